"""Folders of results before anything is solved.

Messages if a folder cannot be written or has other results.
"""

import errno
import json
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest
from kept import keep_case

import fecontact
from fecontact.cli import _system_error, call
from fecontact.errors import InputError
from fecontact.jobs.store import LOCK, lock_folder
from fecontact.runs import store
from fecontact.runs.folder import prepare_for_case, prepare_for_study

PAIR = ["--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none"]


@pytest.fixture
def solve(monkeypatch, elliptic_quick):
    """Stand-in for the solver of `fecontact solve` with a stored result.

    Returns the list of the requested cases.
    """
    cases = []
    monkeypatch.setattr("fecontact.solving.solve.solve", lambda case, progress: cases.append(case) or elliptic_quick)
    return cases


def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_solved(solve, tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert call(["solve", *PAIR, "--out", str(tmp_path / "file" / "out")]) == 2
    assert solve == []
    assert "error: " in capsys.readouterr().err


def test_a_result_that_cannot_be_written_is_printed_all_the_same(solve, tmp_path, capsys, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "case.vtm")

    monkeypatch.setattr("fecontact.runs.report.keep_with_report", full)
    assert call(["solve", *PAIR, "--json", "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out)["status"] == "converged"
    assert "case.vtm: No space left on device; free disk space, or choose a folder on another disk" in err


def test_what_is_told_of_a_case_is_made_once(solve, tmp_path, monkeypatch):
    """For the terminal, its files and its report."""
    reports = []
    for name in ("result_record", "case_row"):
        make = getattr(store, name)
        monkeypatch.setattr(store, name, lambda result, make=make, name=name: reports.append(name) or make(result))
    monkeypatch.setattr("fecontact.outputs.study_report.read_json", lambda path: pytest.fail(f"{path} is read back"))
    assert call(["solve", *PAIR, "--out", str(tmp_path / "out")]) == 0
    assert sorted(reports) == ["case_row", "result_record"]
    assert "HOLDS" in (tmp_path / "out" / "report.html").read_text("utf-8")


@pytest.mark.parametrize(("solved_s", "is_reported"), [(0.5, True), (50.0, False)])
def test_files_that_take_a_tenth_of_a_solve_are_told(
    solved_s, is_reported, elliptic_quick, tmp_path, capsys, monkeypatch
):
    result = replace(elliptic_quick, effort=replace(elliptic_quick.effort, seconds={"mesh": solved_s}))
    monkeypatch.setattr("fecontact.solving.solve.solve", lambda case, progress: result)
    monkeypatch.setattr("fecontact.runs.report.keep_with_report", lambda *_: time.sleep(0.2))
    assert call(["solve", *PAIR, "--json", "--out", str(tmp_path / "out")]) == 0
    said = re.search(r"^files, pictures and report took (\S+) s, the solution (\S+) s$", capsys.readouterr().err, re.M)
    assert (said is not None) is is_reported
    # a machine that others use sleeps longer, not shorter
    assert said is None or (0.2 <= float(said[1]) < 2.0 and float(said[2]) == solved_s)


@pytest.mark.parametrize(
    ("code", "file", "remedy"),
    [
        (errno.ENOSPC, "x", "free disk space"),
        (errno.EMFILE, None, "ulimit"),
        (errno.ENAMETOOLONG, "x", "shorter path"),
        (errno.EROFS, "x", "choose another file or folder"),
        # the locks between processes, which have no name
        (errno.EROFS, None, "/dev/shm"),
    ],
)
def test_the_remedy_is_for_what_the_system_refused(code, file, remedy):
    said = _system_error(OSError(code, "refused", file))
    assert remedy in said
    assert ("choose another file" in said) == (remedy == "choose another file or folder")


def test_nothing_is_left_of_the_look_at_a_folder(tmp_path):
    prepare_for_study(tmp_path / "new" / "out", "mine")
    assert list((tmp_path / "new" / "out").iterdir()) == []


def test_a_folder_with_other_results_is_taken_by_force_alone(solve, elliptic_quick, tmp_path, capsys):
    case = elliptic_quick.case
    keep_case(elliptic_quick, tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    # the same case again, and no other one
    prepare_for_case(tmp_path, case)
    for refused in (
        lambda: prepare_for_case(tmp_path, replace(case, load_N=50e3)),
        lambda: prepare_for_study(tmp_path, "mine"),
        lambda: fecontact.run([case], tmp_path),
    ):
        with pytest.raises(
            InputError, match=r"case \(row\.json\), which would be overwritten; give another --out, or --force"
        ):
            refused()
    assert call(["solve", *PAIR, "--load-kn", "50", "--out", str(tmp_path)]) == 2
    assert solve == []
    assert {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before
    prepare_for_study(tmp_path, "mine", force=True)


@pytest.mark.parametrize(
    ("command", "names"),
    [
        ("run", ["study.csv"]),
        ("run", ["report.html", "study.json", "study_left.pvd"]),
        ("map", ["map.csv"]),
        ("map", ["map.json", "report.html"]),
        ("solve", ["case.png", "report.html", "row.json"]),
        ("wheelset", ["report.html", "wheelset.csv"]),
    ],
)
def test_files_of_the_user_with_the_names_of_results_are_not_overwritten(command, names, solve, tmp_path, capsys):
    study, out = tmp_path / "study.toml", tmp_path / "out"
    study.write_text("[[case]]\nload_kN = 60\n", "utf-8")
    out.mkdir()
    for name in names:
        (out / name).write_text('{"mine": 1}', "utf-8")
    words = {
        "run": ["run", str(study)],
        "map": ["map", *PAIR, "--shifts", "0", "--loads-kn", "60"],
        "solve": ["solve", *PAIR],
        "wheelset": ["solve", "--wheelset"],
    }[command]
    assert call([*words, "--out", str(out)]) == 2
    assert (
        f"error: {out} has {', '.join(names)}, which no run of this program wrote and which would be overwritten; give"
        " another --out, or --force" in capsys.readouterr().err
    )
    assert solve == []
    assert {path.name: path.read_text("utf-8") for path in out.iterdir()} == dict.fromkeys(names, '{"mine": 1}')
    prepare_for_study(out, "study", force=True)


def test_the_files_of_an_interrupted_study_are_results(tmp_path):
    with lock_folder(tmp_path):
        (tmp_path / "study.csv").write_text("id\n", "utf-8")
    prepare_for_study(tmp_path, "mine")


def test_a_file_of_the_user_beside_the_results_does_not_matter(tmp_path):
    (tmp_path / "study.toml").write_text("[[case]]\n", "utf-8")
    prepare_for_study(tmp_path, "mine")


@pytest.mark.parametrize(
    ("file", "record", "goes"),
    [
        ("study.json", {"study": "mine"}, "mine"),
        # a damaged one is no result that could be lost
        ("study.json", {}, "mine"),
        ("study.json", {"study": "other"}, None),
    ],
)
def test_a_study_goes_on_in_its_own_folder_and_in_no_other(file, record, goes, tmp_path):
    (tmp_path / file).write_text(json.dumps(record))
    (tmp_path / LOCK).touch()
    if goes:
        prepare_for_study(tmp_path, goes)
    else:
        with pytest.raises(InputError, match="which would be overwritten"):
            prepare_for_study(tmp_path, "mine")


@pytest.mark.slow
def test_a_run_names_the_files_that_there_are(tmp_path, capsys):
    # both fail at once, so that there is nothing to draw
    (tmp_path / "two.toml").write_text('roll = "given"\nlateral_shift_mm = [1.0, 1.5]\n[opposite]\nrail = "54E1"\n')
    out = tmp_path / "out"
    assert call(["run", str(tmp_path / "two.toml"), "--out", str(out), "--workers", "1"]) == 3
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Results in")]
    file_names = line.partition(": ")[2].split("; ")[0].split(", ")
    assert "study.csv" in file_names
    assert all((out / name).exists() for name in file_names)
    assert "ParaView" not in line


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["hertz", "--wheel-young-mpa", "1e-308"], "Young's modulus is 1e-308 MPa; allowed: 1e-30 to 1e+20"),
        (["hertz", "--rolling-radius-mm", "1e300"], "allowed: 1e-30 to 1e+20"),
        (["hertz", "--friction", "0.3", "--rail-columns", "1:nan"], "Unknown option"),
        (["hertz", "--rail-columns", "1:nan"], "--rail-columns is only for a profile file, but the rail is 60E1"),
        (["hertz", "--wheel", "cylinder:460", "--wheel-units", "m"], "but the wheel is cylinder:460"),
    ],
)
def test_extreme_numbers_and_options_that_nothing_reads_are_refused(words, says, capsys):
    assert call(words) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert says in err


def test_an_option_of_files_is_taken_where_one_side_is_a_file(tmp_path, capsys):
    head = tmp_path / "head.csv"
    head.write_text("y,z\n" + "\n".join(f"{y},{(300.0**2 - y**2) ** 0.5 - 300.0}" for y in range(-30, 31)))
    options = ["--rail", str(head), "--rail-units", "mm", "--rail-filter-mm", "0", "--wheel", "cylinder:460"]
    assert call(["hertz", *options, "--inclination", "none", "--rail-crown-y-mm", "750", "--json"]) == 0
    assert Path(head).is_file()


@pytest.mark.parametrize("command", ["judge", "compare", "view"])
def test_a_folder_without_results_is_named_with_what_to_give(command, tmp_path, capsys):
    arguments = [command, str(tmp_path)] + [str(tmp_path)] * (command == "compare")
    assert call(arguments) == 2
    said = capsys.readouterr().err
    assert str(tmp_path) in said
    assert "solve it again" not in said
