"""Stored results are read and judged again with equal objects.

No finite elements are needed, and an incomplete result is not judged.
"""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from damage import files_without_checksum, unnoticed
from inline import inline_crew, study_by
from kept import keep_case
from pictures import draw_nothing

import fecontact
from fecontact.case import BodySize, Case, Criteria
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.jobs import workers
from fecontact.jobs.store import MANIFEST, check_stored_job, write_manifest
from fecontact.judging.judge import judge_load
from fecontact.outputs.records.results import case_row, read_row
from fecontact.outputs.study_files import write_tables
from fecontact.regression.compare import compare_tables
from fecontact.regression.tables import load_table
from fecontact.runs import identity, judged_study
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.identity import determine_origin, make_case_id
from fecontact.runs.judged_study import judge_study
from fecontact.runs.load import load
from fecontact.runs.sources import read_digests
from fecontact.runs.store import FIELDS_FILE, PROFILES_FOLDER, ROW_FILE, SOLUTION_FILE
from fecontact.runs.stored_folder import read_stored_study

# an arc of R 300 as a file of segments
HEAD = """kind = "rail"
units = "mm"
[[surface]]
type = "arc"
from = [-30.0, -1.5037689]
to = [30.0, -1.5037689]
centre = [0.0, -300.0]
radius = 300.0
"""


def assert_identical(first: object, second: object, where: str = "result") -> None:
    """Equal to the last bit, field by field; a NaN is equal to a NaN."""
    if is_dataclass(first):
        assert type(first) is type(second), where
        for field in fields(first):
            if field.name != "bodies":
                assert_identical(getattr(first, field.name), getattr(second, field.name), f"{where}.{field.name}")
    elif isinstance(first, np.ndarray):
        np.testing.assert_array_equal(first, second, where)
    elif isinstance(first, dict):
        assert first.keys() == second.keys(), where
        for key in first:
            assert_identical(first[key], second[key], f"{where}.{key}")
    elif isinstance(first, tuple):
        assert len(first) == len(second), where
        for number, (first_value, second_value) in enumerate(zip(first, second, strict=True)):
            assert_identical(first_value, second_value, f"{where}[{number}]")
    else:
        assert first == second or (first != first and second != second), where


def stored(result: fecontact.CaseResult, folder: Path) -> Path:
    """A result as `solve --out` writes it."""
    keep_case(result, folder)
    return folder


@pytest.fixture(scope="module")
def solved_folder(elliptic_quick, tmp_path_factory) -> Path:
    return stored(elliptic_quick, tmp_path_factory.mktemp("solved") / "one")


def test_what_is_read_back_is_what_was_solved(elliptic_quick, solved_folder):
    restored = load(solved_folder)
    assert_identical(elliptic_quick, restored)
    assert restored.bodies is None
    # a half model's result is that of both halves
    assert restored.pressure_MPa.sum() > 1.9 * restored.load.fe.pressure_MPa.sum()
    assert np.array_equal(restored.load.fe.pressure.whole().values, restored.pressure_MPa)
    # each rung has its own field, and all carry the load
    for rung in (
        restored.load.fe,
        restored.load.level.nodal,
        restored.load.solved.half_space,
        restored.load.solved.quadratic,
    ):
        area = rung.grid.whole_area_mm2()
        assert float(area @ rung.pressure_MPa.ravel()) == pytest.approx(1e5, rel=2e-4)


def test_the_row_that_is_stored_is_that_of_the_result(elliptic_quick, solved_folder):
    row = read_row(solved_folder / ROW_FILE)
    assert_identical({"id": make_case_id(elliptic_quick.case), **case_row(elliptic_quick)}, row)
    assert_identical(row, {"id": row["id"], **case_row(load(solved_folder))})


@pytest.mark.slow
def test_other_criteria_give_the_verdict_of_a_solution_with_them(elliptic_quick, solved_folder):
    # Hertz's peak is off by 0.07 ± 0.25 % there
    strict = Criteria(p_max=0.002)
    (row,) = judge_study(solved_folder, strict).rows
    case = replace(elliptic_quick.case, criteria=strict)
    fresh = judge_load(replace(elliptic_quick.load.solved, case=case), elliptic_quick.placement)
    assert (row["verdict_answer"], row["verdict_measure"]) == (fresh.verdict.answer, fresh.verdict.measure)
    assert (elliptic_quick.verdict.answer, row["verdict_answer"]) == ("HOLDS", "UNRESOLVED")
    assert row["verdict_measure"] == "p_max_MPa"
    # who does not ask for the peak has his answer
    (patch_row,) = judge_study(solved_folder, replace(strict, judged_by=("patch",))).rows
    assert (patch_row["verdict_answer"], patch_row["verdict_failing"]) == ("HOLDS", "")
    assert patch_row["verdict_measure"] in ("area_mm2", "a_mm", "b_mm", "centre_over_b")
    # the numbers are as they were
    assert row["fe_p_max_MPa"] == elliptic_quick.comparison.fe.p_max_MPa
    assert row["hertz_uncertainty_area_percent"] == 1e2 * elliptic_quick.load.uncertainty["area_mm2"]


def test_a_verdict_does_not_hang_on_the_threads_of_who_asks(solved_folder, tmp_path, monkeypatch):
    """All verdicts are computed on a single thread, as the solution was.

    Sums over nodes differ in their last digits with the threads of BLAS.
    """
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    monkeypatch.setattr("fecontact.runs.judged_study.has_single_thread", lambda: False)
    with workers.open_evaluators(1, here=False) as map_over:
        assert list(map_over(os.getenv, ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"])) == ["1", "1"]
    monkeypatch.setattr("fecontact.runs.store.read_case", lambda *a, **options: pytest.fail("read by the caller"))
    (row,) = judge_study(solved_folder, Criteria()).rows
    assert row["verdict_answer"] == "HOLDS"


def test_judging_needs_neither_gmsh_nor_finite_elements(solved_folder):
    missing = ("gmsh", "skfem", "pypardiso", "pyamg", "meshio", "vtk", "pyvista")
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({missing!r})); from fecontact.cli import call;"
        f"sys.exit(call(['judge', {str(solved_folder)!r}, '--p-max-percent', '3', '--area-percent', '20']))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert "p_max ±3 %, area ±20 %, a ±10 %" in process.stdout


@pytest.mark.parametrize("file", [FIELDS_FILE, SOLUTION_FILE, ROW_FILE, MANIFEST])
def test_a_damaged_result_is_named_and_never_judged(solved_folder, tmp_path, file, capsys):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    data = bytearray((folder / file).read_bytes())
    data[len(data) // 2] ^= 1
    (folder / file).write_bytes(data)
    # a checksum that is damaged is that of another file
    file_name = "" if file == MANIFEST else file
    with pytest.raises(InputError, match=rf"{file_name}.*solve (it|the case) again"):
        load(folder)
    code = call(["judge", str(folder)])
    out, err = capsys.readouterr()
    assert code in (2, 3)
    assert file_name in " ".join((out + err).split())
    assert "HOLDS" not in out


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"schema": "fecontact/result/1"}, "the layout is fecontact/result/1; allowed:"),
        ({"loads": []}, "cannot be read"),
        ({"case": {"rail": "60E1", "wheels": "S1002"}}, "wheels"),
    ],
)
def test_a_result_of_another_layout_is_named(elliptic_quick, solved_folder, tmp_path, change, says):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    record = json.loads((folder / SOLUTION_FILE).read_text()) | change
    (folder / SOLUTION_FILE).write_text(json.dumps(record))
    (folder / MANIFEST).unlink()
    files = [path for path in folder.rglob("*") if path.is_file()]
    write_manifest(folder, files, make_case_id(elliptic_quick.case), determine_origin(elliptic_quick.case))
    with pytest.raises(InputError, match=says):
        load(folder)


def test_another_version_of_the_solving_code_is_named_and_never_judged(solved_folder, monkeypatch, capsys):
    monkeypatch.setattr(identity, "read_digests", lambda: replace(read_digests(), solving="another"))
    identity._determine_solving_origin.cache_clear()
    try:
        with pytest.raises(InputError, match=r"made by a different version: source of solving .* solve it again"):
            load(solved_folder)
        assert call(["judge", str(solved_folder)]) == 3
        assert "source of solving" in " ".join(capsys.readouterr().out.split())
    finally:
        monkeypatch.undo()
        identity._determine_solving_origin.cache_clear()


def test_another_version_of_the_evaluating_code_is_judged(elliptic_quick, solved_folder, monkeypatch):
    monkeypatch.setattr(identity, "read_digests", lambda: replace(read_digests(), evaluating="another"))
    assert_identical(elliptic_quick, load(solved_folder))


def test_a_folder_that_is_none_is_said(tmp_path):
    with pytest.raises(InputError, match=r"no result\.json or study\.json"):
        load(tmp_path)
    assert call(["judge", str(tmp_path / "nowhere")]) == 2


# --- studies of profiles in files ------------------------------------------------------------------------------------


def study_of(folder: Path, **options: object) -> Study:
    """A study in a folder: two loads on a rail head from a file."""
    folder.mkdir(exist_ok=True)
    (folder / "head.toml").write_text(HEAD)
    (folder / "mine.toml").write_text(
        f'rail = "{(folder / "head.toml").as_posix()}"\nwheel = "cylinder:460"\ninclination = "none"\n'
        'load_kN = [50.0, 80.0]\nresolution = [1.4, 1.1]\nrefine = "never"\n'
        "[track]\nrail_crown_y_mm = 750.0\n"
        # smaller bodies than usual, which are enough for what is looked at here
        "[size]\nrail_depth_mm = 25.0\nrim_thickness_mm = 25.0\nhalf_length_mm = 32.0\n"
    )
    return load_study(folder / "mine.toml")


@pytest.fixture(scope="module")
def twice(tmp_path_factory) -> tuple[Path, Path]:
    """A study that is run in two folders, in the second folder with all pictures."""
    first, second = (tmp_path_factory.mktemp("studies") / name for name in ("a", "other place"))
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        assert study_by(study_of(first), first / "out", crew=inline_crew()).all_converged
    assert study_by(study_of(second), second / "out", crew=inline_crew()).all_converged
    return first, second


@pytest.mark.slow
def test_results_made_under_two_folders_are_the_same(twice):
    first, second = (load_table(folder / "out") for folder in twice)
    assert list(first.rows.index) == list(second.rows.index)
    comparison = compare_tables(first, second)
    assert comparison.same
    assert set(comparison.columns.times_tolerance) == {0.0}


def test_no_file_of_a_result_says_where_it_was_made(twice):
    _, folder = twice
    files = [path for path in (folder / "out").rglob("*") if path.is_file() and path.suffix != ".lock"]
    endings = {".json", ".csv", ".npz", ".png", ".svg", ".html", ".vtu", ".vtp", ".vtm", ".toml"}
    assert {path.suffix for path in files} >= endings
    for path in files:
        assert str(folder).encode() not in path.read_bytes(), path


def test_a_study_is_read_back_and_judged_without_its_profile_files(twice, tmp_path, monkeypatch, capsys):
    out = shutil.copytree(twice[0] / "out", tmp_path / "out")
    results = load(out)
    assert [result.case.load_N for result in results] == [50e3, 80e3]
    rows = {row["id"]: row for row in map(lambda f: read_row(f / ROW_FILE), sorted((out / "cases").iterdir()))}
    for result in results:
        # the stored copy of the profile is the same profile: the same id, whatever the file is called from
        assert PROFILES_FOLDER in result.case.rail
        assert make_case_id(result.case) in rows
        assert_identical(rows[make_case_id(result.case)], {"id": make_case_id(result.case), **case_row(result)})
    assert call(["judge", str(out), "--p-max-percent", "0.01", "--out", str(tmp_path / "strict")]) == 0
    said = capsys.readouterr().out
    assert "2 cases judged by p_max ±0.01 %" in said
    table = load_table(tmp_path / "strict")
    assert list(table.rows.index) == list(load_table(out).rows.index)
    assert set(table.rows.verdict_answer) <= {"FAILS", "UNRESOLVED"}
    for inside in (out, out / "cases", out / "cases" / "strict"):
        assert call(["judge", str(out), "--out", str(inside)]) == 2
        assert f"{inside} {'is' if inside == out else 'is inside'} the folder of the results" in capsys.readouterr().err
    # nor over other results that were solved: the judged ones may be judged once more
    other_folder = tmp_path / "other"
    shutil.copytree(out, other_folder)
    capsys.readouterr()
    assert call(["judge", str(out), "--out", str(other_folder)]) == 2
    assert f"{other_folder} has other solved results (cases)" in capsys.readouterr().err
    assert (other_folder / "study.csv").read_bytes() == (out / "study.csv").read_bytes()
    assert call(["judge", str(out), "--p-max-percent", "0.02", "--out", str(tmp_path / "strict")]) == 0
    assert (
        f"replaced files that had different content: {tmp_path / 'strict' / 'report.html'}, " in capsys.readouterr().err
    )


@pytest.mark.slow
def test_judging_a_study_that_still_runs_says_how_many_cases_are_missing(twice, tmp_path, capsys):
    out = shutil.copytree(twice[0] / "out", tmp_path / "out")
    name, rows, cases = read_stored_study(out)
    assert cases == len(rows) == 2
    # as `run` writes it after the first of four cases
    write_tables(name, 4, rows[:1], out / "study")
    assert call(["judge", str(out), "--out", str(tmp_path / "again")]) == 3
    assert "1 of 4 cases (3 not solved yet) judged by " in capsys.readouterr().out
    judgement = judge_study(out, Criteria())
    assert (judgement.missing, judgement.all_judged) == (3, False)
    assert read_stored_study(tmp_path / "again")[2] == 4


@pytest.mark.slow
def test_many_cases_are_judged_by_processes_with_the_same_rows(twice, monkeypatch):
    in_process = judge_study(twice[0] / "out", Criteria(p_max=0.01))
    monkeypatch.setattr(judged_study, "_WORTH_PROCESSES", 2)
    in_workers = judge_study(twice[0] / "out", Criteria(p_max=0.01))
    assert len(in_process.rows) == 2
    assert_identical(in_process, in_workers)


def test_a_study_with_a_damaged_case_is_judged_without_it(twice, tmp_path):
    out = shutil.copytree(twice[0] / "out", tmp_path / "out")
    first = sorted((out / "cases").iterdir())[0]
    (first / "rail.vtu").unlink()
    judgement = judge_study(out, Criteria())
    (bad,) = [row for row in judgement.rows if row["status"] != "converged"]
    assert bad["id"] == first.name
    assert "rail.vtu is missing; solve it again" in bad["status"]
    assert not judgement.all_judged


def test_damage_of_every_file_of_a_result_is_noticed(twice, tmp_path):
    """Every file is damaged, also a file that is added to a result some day.

    Files without a reader are excepted.
    """
    out = shutil.copytree(twice[1] / "out", tmp_path / "out")
    (case, *_) = sorted((out / "cases").iterdir())
    assert (case / PROFILES_FOLDER / "rail" / "head.toml").is_file()
    assert files_without_checksum(case) == set()
    (case / "case.png").write_bytes(b"")
    with pytest.raises(InputError, match=r"case\.png is damaged"):
        load(case)
    shutil.rmtree(out / "cases")
    assert unnoticed(out, (lambda: read_stored_study(out), lambda: load_table(out))) == set()


def test_versions_that_a_result_names_are_no_part_of_its_checksums(solved_folder, tmp_path):
    """Another version is a reason to solve again, but not to refuse a result.

    This is independent of the writer of the version.
    """
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    manifest = json.loads((folder / MANIFEST).read_text())
    manifest["solved_by"]["numpy"] = "0.1"
    (folder / MANIFEST).write_text(json.dumps(manifest))
    assert load(folder).verdict.answer == "HOLDS"
    folder_kept = check_stored_job(folder, manifest["id"], determine_origin(load(folder).case))
    assert "numpy 0.1 -> " in (folder_kept.problem or "")


@pytest.mark.slow
def test_a_case_solved_into_a_folder_of_another_one_is_read_with_its_pair_geometry(tmp_path, monkeypatch):
    draw_nothing(monkeypatch)
    folder = tmp_path / "one"
    first = replace(study_of(tmp_path / "mine").cases[0], resolution=(2.0, 1.8))
    keep_case(fecontact.solve(first), folder)
    assert load(folder).placement.rail.profile.name == "head"
    second = replace(first, rail="circle:290")
    result = fecontact.solve(second)
    keep_case(result, folder)
    # the copy of the first one's rail is still there, and neither read nor sealed with the second one
    assert (folder / PROFILES_FOLDER / "rail" / "head.toml").is_file()
    assert_identical(result, load(folder))
    (folder / PROFILES_FOLDER / "rail" / "head.toml").unlink()
    assert_identical(result, load(folder))


def test_changed_criteria_judge_a_study_again_and_solve_nothing(twice, tmp_path, monkeypatch):
    draw_nothing(monkeypatch)
    study = study_of(twice[0])
    out = shutil.copytree(twice[0] / "out", tmp_path / "out")
    meshes = {path: path.read_bytes() for path in out.rglob("*.vtu")}
    assert set(load_table(out).rows.verdict_answer) == {"HOLDS"}
    # nothing is as exact as that, and nothing may be refined
    strict = Criteria(p_max=1e-6, judged_by=("strength", "area"))
    strict_cases = tuple(replace(case, criteria=strict) for case in study.cases)
    outcome = study_by(Study(name="mine", cases=strict_cases), out, crew=inline_crew())
    assert set(outcome.recomputed) == {make_case_id(case) for case in study.cases}
    assert [row["verdict_answer"] for row in outcome.rows] == ["UNRESOLVED", "UNRESOLVED"]
    assert {path: path.read_bytes() for path in out.rglob("*.vtu")} == meshes
    # what was written again is whole, and judged by the criteria that it says
    for result in load(out):
        assert result.case.criteria == strict
        assert set(result.verdict.each) == {"p_max_MPa", "area_mm2"}
    assert study_by(Study(name="mine", cases=strict_cases), out, crew=inline_crew()).recomputed == {}


def test_an_open_verdict_that_may_be_refined_is_solved_again(tmp_path, monkeypatch):
    draw_nothing(monkeypatch)
    monkeypatch.setattr("fecontact.case.REFINED_UNKNOWNS", 25_000)
    case = Case(
        rail="circle:300",
        wheel="cylinder:460",
        inclination_rad=0.0,
        load_N=50e3,
        resolution=(2.0, 1.8),
        size=BodySize(rail_depth_mm=25.0, rim_thickness_mm=25.0, half_length_mm=32.0),
    )
    wide, strict = (replace(case, criteria=Criteria(p_max=limit, judged_by=("strength",))) for limit in (0.9, 1e-6))
    assert study_by(Study(name="x", cases=(wide,)), tmp_path, crew=inline_crew()).rows[0]["solver_meshes"] == 2
    outcome = study_by(Study(name="x", cases=(strict,)), tmp_path, crew=inline_crew())
    (why,) = outcome.recomputed.values()
    assert why.startswith("judged by different criteria: criterion p_max 0.9 -> 1e-06")
    assert outcome.rows[0]["solver_meshes"] > 2


PRESSURES = """
import pickle, sys
import numpy as np
from fecontact.judging.comparison import compare
from fecontact.contact.grid import ContactGrid
from fecontact.contact_theories.hertz import hertz_ellipse
from rungs import rung_with
for force in (90e3, 100e3, 110e3):
    hertz = hertz_ellipse(1 / 460, 1 / 300, normal_force_N=force, contact_modulus_MPa=1.15e5)
    line = np.linspace(-1.3, 1.3, 251) * hertz.extent_x_mm
    grid = ContactGrid(x_mm=line, s_mm=line, half=False)
    pressure = 1.01 * hertz.pressure_MPa(line[:, None] + 0.1, line)
    print(compare(rung_with(grid, pressure), hertz).pressure_l2.hex())
"""


def test_numbers_of_a_load_are_the_same_to_the_last_bit_on_any_number_of_threads():
    """A report may be computed on all cores, the verdict in it on a single core."""
    outputs = [
        subprocess.run(
            [sys.executable, "-c", PRESSURES],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": threads},
        ).stdout
        for threads in ("1", "2")
    ]
    assert outputs[0].count("0x") == 3
    assert outputs[0] == outputs[1]


def test_what_is_told_of_a_load_is_known_where_it_is_judged(elliptic_quick):
    comparison = judge_load(elliptic_quick.load.solved, elliptic_quick.placement).comparison
    assert "pressure_l2" in vars(comparison)
