"""The command line: exit codes, a single clear line for bad input, pure JSON on standard output."""

import errno
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from inline import inline_crew, study_by
from pictures import draw_nothing

from fecontact.case import Case, Criteria, make_case_record, read_case_record
from fecontact.cli import _system_error, app, call
from fecontact.criteria import Creep
from fecontact.errors import InputError, ProgramError
from fecontact.files import format_json
from fecontact.inputs.texts import parse_inclination
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.identity import make_case_id

STUDIES = Path(__file__).parents[1] / "studies"


# Command lines that write a file, and the allowed endings of this file.
WRITTEN_FILES = {
    "place --out": ".png, .svg",
    "geometry --shifts 0 --out": ".png, .svg, .csv",
    "table --shifts 0 --loads-kn 50 --out": ".csv, .nc",
    "profiles 60E1 --out": ".png, .svg",
    "profiles 60E1 --write": ".csv, .toml",
    "mesh rail --out": ".msh, .inp, .vtu",
    "validate study.py --out out --report": ".md",
}


@pytest.mark.parametrize("ending", ["", ".parquet", ".json", ".csv.gz", ".png~", ".stl"])
@pytest.mark.parametrize("line", WRITTEN_FILES)
def test_an_output_file_of_another_format_is_refused_before_the_computation(
    line, ending, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert call([*line.split(), f"x{ending}"]) == 2
    out, err = capsys.readouterr()
    printed_ending = f".{ending.split('.')[-1]}" if ending else "(none)"
    assert out == ""
    assert err.startswith("error: ")
    assert f" x{ending}: the ending is {printed_ending}; allowed: {WRITTEN_FILES[line]}; give a name such as x." in err
    assert list(tmp_path.iterdir()) == []


def test_the_endings_of_all_options_that_write_a_file_are_checked():
    options = set()
    for name, command in ((name, app[name]) for name in app):
        if not name.startswith("-") and command.default_command is not None:
            for argument in command.assemble_argument_collection(parse_docstring=True):
                if (argument.parameter.help or "").startswith(("File ", "Markdown file")) and argument.names[0][
                    0
                ] == "-":
                    options.add(f"{name} {argument.names[0]}")
    assert options == {f"{line.split()[0]} {line.split()[-1]}" for line in WRITTEN_FILES}


def test_a_fraction_for_a_whole_number_is_refused_and_not_rounded(capsys):
    commands = {(name,): app[name] for name in app if not name.startswith("-")}
    commands |= {("fleet", name): app["fleet"][name] for name in app["fleet"] if not name.startswith("-")}
    options = {
        (*words, argument.name)
        for words, command in commands.items()
        if command.default_command is not None
        for argument in command.assemble_argument_collection(parse_docstring=True)
        if argument.hint in (int, int | None)
    }
    assert {("run", "--workers"), ("fleet", "examples", "--wheels"), ("fleet", "sample", "--seed")} <= options
    for *words, option in sorted(options):
        assert call([*words, f"{option}=2.9"]) == 2
        assert capsys.readouterr().err.startswith(f"error: {option} is 2.9; allowed: whole numbers; give ")
    for number in ("-0.4", "1.e999", "two", ""):
        assert call(["fleet", "examples", "folder", f"--wheels={number}"]) == 2
        assert capsys.readouterr().err.startswith(f"error: --wheels is {number or 'empty'}; allowed: whole numbers; ")


def test_a_whole_number_may_have_zeros_as_its_fraction(tmp_path, capsys):
    assert call(["fleet", "examples", str(tmp_path), "--wheels", "2.0", "--rails", "1", "--seed", "+1"]) == 0
    assert len(list((tmp_path / "wheels").iterdir())) == 2


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["solve", "--rail", "60X1"], "60E1"),
        (["solve", "--wheel", "nowhere.txt"], "nowhere.txt"),
        (["solve", "--load-kn", "0"], "0.001 to 1000000 kN"),
        (["solve", "--load-kn", "nan"], "0.001 to 1000000 kN"),
        (["solve", "--load-kn", "heavy"], "heavy"),
        (["solve", "--poisson", "0.5"], "-1 < nu < 0.5"),
        (["solve", "--young-mpa", "-1"], "Young"),
        (["solve", "--shift", "9"], "derails"),
        (["solve", "--shift", "1e9"], "-60 to 60 mm"),
        (["solve", "--resolution", "best"], "quick, standard, fine"),
        (["solve", "--resolution", "1"], "quick, standard, fine"),
        (["solve", "--resolution", "1,2,3"], "two element sizes"),
        (["solve", "--resolution", "0.003,0.003"], "GB"),
        (["solve", "--inclination", "1:x"], "1:40"),
        (["solve", "--inclination", "1:0"], "1:40"),
        (["solve", "--solver", "magic"], "magic"),
        (["solve", "--judged-by", "strenght"], "did you mean strength?"),
        (["solve", "--judged-by", "patch,"], "sets strength, patch, all; measures p_max, area, a, b, centre, valley"),
        (["judge", ".", "--judged-by", "p_max,L2"], "'L2'; allowed: sets strength, patch, all; measures p_max, area"),
        (["judge", ".", "--valley-percent", "100"], "between 0 and 100 %"),
        (["judge", ".", "--centre-over-b", "1"], "between 0 and 1; for example 0.15"),
        (["hertz", "--rail", "circle:abc"], "circle"),
        (["mesh", "rail", "--out", "rail.stl"], ".msh"),
        (["run", "nothing.py", "--out", "x"], "no such file"),
        (["run", __file__, "--out", "x"], "cases"),
        (["profiles", "nothing"], "nothing"),
        (["hertz", "--rail-noise-mm", "x" * 3000], "xxx...'; allowed: a number"),
        (["geometry", "--shifts", "0", "--out", "picture"], "the ending is (none); allowed: .png, .svg, .csv; give a"),
        (["init", "\0"], "NUL character"),
        (["unknown"], "unknown"),
        (["table"], "--shifts is missing; see fecontact table --help"),
        (["table", "--shifts"], "--shifts has no value; see fecontact table --help"),
        (["compare", "a"], "NEW is missing; see fecontact compare --help"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert call(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert err.startswith("error: ")
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_exit_code_2(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    study = tmp_path / "one.toml"
    study.write_text('rail = "circle:300"\nwheel = "cylinder:460"\ninclination = "none"\nload_kN = 1e9\n')
    assert call(["run", str(study), "--out", str(tmp_path / "file" / "out")]) == 2
    assert "error: " in capsys.readouterr().err


def test_help_and_version_are_instant_and_import_nothing_heavy():
    code = (
        "import sys; from fecontact.cli import call; call(['--help']);"
        "print(sorted({'numpy', 'scipy', 'skfem', 'gmsh', 'vtk', 'pyvista', 'matplotlib'} & set(sys.modules)))"
    )
    start = time.perf_counter()
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip().endswith("[]")
    # half a second would already be felt; the bound leaves room for a loaded machine
    assert time.perf_counter() - start < 5.0


def test_hertz_as_json_needs_no_gmsh(capsys):
    code = (
        "import sys; sys.modules['gmsh'] = None; from fecontact.cli import call;"
        "pair = ['--rail', 'circle:300', '--wheel', 'cylinder:460', '--inclination', 'none'];"
        "sys.exit(call(['hertz', *pair, '--json']))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    record = json.loads(process.stdout)
    # Johnson (1985), section 4.2, as in test_hertz
    assert record["ellipses"][0]["p_max_MPa"] == pytest.approx(1237.559, abs=1e-3)


def test_solve_as_json_prints_the_result_alone(capsys):
    arguments = ["solve", "--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none", "--load-kn", "50"]
    assert call([*arguments, "--resolution", "2.0,1.8", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["status"] == "converged"
    # p0 ~ F^(1/3); 2 %: a mesh of 2.8 elements per semi-axis
    assert record["fe"]["p_max_MPa"] == pytest.approx(1237.559 * 0.5 ** (1 / 3), rel=0.02)


def test_solving_by_other_measures_says_so(capsys):
    pair = ["--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none", "--load-kn", "50"]
    options = ["--resolution", "2.0,1.8", "--refine", "never", "--judged-by", "strength,valley"]
    assert call(["solve", *pair, *options, "--valley-percent", "3", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["verdict"]["limits"] == {"p_max_MPa": 0.05, "valley": 0.03}
    assert list(record["verdict"]["each"]) == ["p_max_MPa", "valley"]
    assert record["case"]["criteria"]["judged_by"] == ["strength", "valley"]


@pytest.mark.parametrize("command", ["solve", "judge"])
def test_the_help_names_every_limit_and_every_set(command, capsys):
    limits_and_sets(command, capsys)


def limits_and_sets(command, capsys):
    assert call([command, "--help-all"]) == 0
    out = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for option in ("p-max-percent", "area-percent", "a-percent", "b-percent", "centre-over-b", "valley-percent"):
        assert f"--{option}" in out
    assert "--separate-load-percent" in out
    assert "--misplaced-load-percent" in out
    assert "--judged-by" in out
    assert "sets strength, patch, all; measures p_max, area, a, b, centre, valley, separate, misplaced" in out


@pytest.mark.parametrize(
    ("text", "value"),
    [("1:40", math.atan(1 / 40)), ("none", 0.0), ("25mrad", 0.025), ("1.5deg", math.radians(1.5)), ("-0.02rad", -0.02)],
)
def test_inclinations(text, value):
    assert parse_inclination(text) == pytest.approx(value, rel=1e-15)


def test_a_toml_study_combines_its_lists(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        "lateral_shift_mm = [0.0, 1.0]\nload_kN = [50.0, 100.0]\nresolution = [0.5, 0.4]\n[track]\ngauge_mm = 1437.0\n"
    )
    study = load_study(path)
    assert [(c.load_N, c.lateral_shift_mm) for c in study.cases] == [
        (50e3, 0.0),
        (50e3, 1.0),
        (100e3, 0.0),
        (100e3, 1.0),
    ]
    assert all(c.resolution == (0.5, 0.4) and c.track.gauge_mm == 1437.0 for c in study.cases)
    assert len({make_case_id(c) for c in study.cases}) == 4


@pytest.mark.parametrize(
    ("judged_by", "measures"),
    [
        ('"strength"', ["p_max_MPa"]),
        ('["strength"]', ["p_max_MPa"]),
        ('"strength, valley"', ["p_max_MPa", "valley"]),
        ('["patch", "misplaced"]', ["area_mm2", "a_mm", "b_mm", "centre_over_b", "misplaced_load"]),
        ('"all"', list(Criteria().limits)),
    ],
)
def test_a_toml_study_says_by_which_measures_it_is_judged(tmp_path, judged_by, measures):
    path = tmp_path / "mine.toml"
    path.write_text(
        f"load_kN = [50, 60]\n[criteria]\njudged_by = {judged_by}\ncentre_over_b = 0.2\nvalley_percent = 5\n"
    )
    cases = load_study(path).cases
    assert len(cases) == 2
    for case in cases:
        assert list(case.criteria.limits) == measures
        assert (case.criteria.centre, case.criteria.valley) == (0.2, 0.05)
        # what is stored comes back the same, lists or not
        assert read_case_record(json.loads(format_json(make_case_record(case)))) == case


@pytest.mark.parametrize(
    "text",
    [
        *("loads = 3\n", "load_kN = 'x'\n", "load_kN = [\n", "[track]\ngauge = 1435\n"),
        *("[criteria]\njudged_by = ['power']\n", "[criteria]\njudged_by = []\n", "[criteria]\np_max_percent = [5]\n"),
        *("[criteria]\njudged_by = 1\n", "[criteria]\njudged_by = [['strength']]\n"),
    ],
)
def test_a_wrong_toml_study_is_refused(tmp_path, text):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=r"wrong\.toml"):
        load_study(path)


def test_a_case_that_cannot_be_solved_is_a_row_and_the_rest_goes_on(tmp_path, monkeypatch):
    draw_nothing(monkeypatch, of_studies=True)
    pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    good = Case(**pair, load_N=50e3, resolution=(2.0, 1.8), refine="never")
    bad = Case(lateral_shift_mm=9.0)

    def conclude(rows: list, out: Path) -> str:
        return pytest.fail("a conclusion from rows that cannot be used")

    outcome = study_by(Study(name="two", cases=(bad, good), conclude=conclude), tmp_path, crew=inline_crew())
    assert outcome.conclusion == "No conclusion: 1 of 2 cases without a usable result."
    assert [row["status"] for row in outcome.rows][1] == "converged"
    assert "derails" in outcome.rows[0]["status"]
    assert not outcome.all_converged
    table = (tmp_path / "study.csv").read_text().splitlines()
    assert len(table) == 3
    assert "derails" in table[1]
    folder = tmp_path / "cases" / make_case_id(good)
    expected = {
        "solved.json",
        "result.json",
        "row.json",
        "fields.npz",
        "rail.vtu",
        "wheel.vtu",
        "pressure.vtp",
        "elements.vtp",
        "hertz_ellipse.vtp",
        "bodies.vtm",
        "case.vtm",
        "case.png",
        "stored.json",
    }
    assert {path.name for path in folder.iterdir()} == expected
    assert (tmp_path / "study.pvd").is_file()
    assert (tmp_path / "study.png").is_file()


# the benchmarks measure times, and ask nothing of the results
@pytest.mark.parametrize(
    "path",
    [path for path in sorted(STUDIES.glob("*.py")) if not path.stem.startswith("benchmark")],
    ids=lambda path: path.stem,
)
def test_every_study_has_a_quick_size_and_says_what_it_asks(path):
    quick, full = load_study(path, quick=True), load_study(path)
    assert 0 < len(quick.cases) <= len(full.cases)
    assert quick.conclude is not None
    assert "Expected" in path.read_text()


def test_hertz_says_how_contact_points_share_the_load(capsys):
    assert call(["hertz", "--shift", "0"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "Load shared by parallel springs: point 1 69.0 kN" in out
    assert "they are a single patch" in out
    assert call(["hertz", "--shift", "-4"]) == 0
    assert "Load shared" not in capsys.readouterr().out


def test_a_message_has_no_endless_word():
    with pytest.raises(InputError) as refused:
        Creep(curved="9" * 5000)
    assert "curved" in str(refused.value)
    assert len(str(refused.value)) < 300


def test_a_working_folder_that_is_gone_is_said(tmp_path):
    code = "import os, sys; os.rmdir(os.getcwd()); from fecontact.cli import call; sys.exit(call(sys.argv[1:]))"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-c", code, "table", "--shifts", "3", "--loads-kn", "50", "--out", "table.csv"]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert process.returncode == 2
    assert "the working folder no longer exists; change to an existing folder" in process.stderr


def test_an_error_of_the_system_without_a_name_is_not_blamed_on_the_workers_where_the_folder_is_gone(monkeypatch):
    # as `os.getcwd` raises it
    missing_folder = FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
    assert "/dev/shm" in _system_error(missing_folder)
    monkeypatch.setattr(Path, "cwd", raising(missing_folder))
    assert "/dev/shm" not in _system_error(missing_folder)


def test_an_error_of_the_program_in_a_job_is_one_line_and_an_exit_code_of_its_own(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("fecontact.runs.study.run_study", raising(ProgramError("1 of 2 jobs ended so")))
    study = Path(__file__).parents[1] / "studies" / "first_light.py"
    assert call(["run", str(study), "--quick", "--out", str(tmp_path / "out")]) == 4
    assert capsys.readouterr().err.splitlines()[-1] == "error: 1 of 2 jobs ended so"


def test_too_little_memory_is_one_line_and_no_difference_of_results(monkeypatch, capsys):
    monkeypatch.setattr("fecontact.cli.find_help_page", raising(MemoryError()))
    # 1 would mean that both differ
    assert call(["compare", "A", "B"]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("error: not enough memory; close other programs")


def raising(error: Exception):
    def call(*_, **__):
        raise error

    return call
