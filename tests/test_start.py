"""The first minutes of use: a first study, its check, the machine's check, and progress messages."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from fecontact import __version__
from fecontact.bodies import STEEL, Material
from fecontact.case import Case
from fecontact.cli import _system_error, call
from fecontact.console.log import log_command
from fecontact.console.messages import print_reasons, print_result, write_to_log
from fecontact.console.progress import show_job_progress, show_solution_progress
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.jobs.engine import RunSettings, open_run
from fecontact.runs.casefile import load_study
from fecontact.runs.check import check_study
from fecontact.runs.cost import CASE_FILES_S, MAP_FILES_S, STUDY_FILES_S, estimate_cost
from fecontact.solving.case_meshes import mesh_pair
from fecontact.solving.cost import START_SECONDS, estimate_memory_GB
from fecontact.solving.preview import preview_case

ROOT = Path(__file__).parents[1]
# what is on the other side counts for a wheelset alone: these fail at once
BAD_STUDY = 'roll = "given"\nlateral_shift_mm = [1.0, 1.5]\n[opposite]\nrail = "54E1"\n'


def program(*arguments: str, **options) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **options.pop("env", {})}
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, env=environment, timeout=600, **options
    )


LIMITS = ("# p_max_percent", "# area_percent", "# judged_by", "# theories_out_of_range")


def test_a_folder_to_begin_with_can_be_run_as_it_is(tmp_path, capsys):
    folder = tmp_path / "mine"
    assert call(["init", str(folder)]) == 0
    assert f"fecontact check {folder / 'cases.toml'}" in capsys.readouterr().out
    assert [case.lateral_shift_mm for case in load_study(folder / "cases.toml").cases] == [-4.0, 4.0] * 2
    assert len(load_study(folder / "study.py").cases) == 6
    for file in ("cases.toml", "study.py"):
        assert call(["check", str(folder / file)]) == 0
    # what says no value is the default of that key
    text = (folder / "cases.toml").read_text()
    arguments = [
        line
        for line in text.splitlines()
        if line.startswith(("# roll =", "# yaw", "# gauge", "# young", "# refine", *LIMITS))
        # the pair of shift and roll at the end
        and "0.4" not in line
    ]
    assert len(arguments) == 9
    for line in arguments:
        table = "[track]\n" if "gauge" in line else "[rail_material]\n" if "young" in line else ""
        table = "[criteria]\n" if line.startswith(LIMITS) else table
        (tmp_path / "one.toml").write_text(table + line.removeprefix("# "))
        assert load_study(tmp_path / "one.toml").cases == (Case(),), line
    # no default is a live value, which a new default would not reach
    assert all(case.criteria == Criteria() for case in load_study(folder / "cases.toml").cases)
    assert "\n[criteria]" not in text
    # unchanged files are not overwritten: the same command resumes an interrupted one
    (folder / "study.py").unlink()
    assert call(["init", str(folder)]) == 0
    (folder / "study.py").write_text("mine")
    capsys.readouterr()
    assert call(["init", str(folder)]) == 2
    assert f"init would overwrite {folder / 'study.py'}; give" in capsys.readouterr().err
    assert (folder / "study.py").read_text() == "mine"


def test_checking_a_study_says_how_many_cases_and_what_varies(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text('rail = ["60E1", "54E1"]\nlateral_shift_mm = "-4:4:2"\n[[case]]\nload_kN = [50, 100]\n')
    start = time.perf_counter()
    assert call(["check", str(path)]) == 0
    # a second on an idle machine, with the patches of three cases expected
    assert time.perf_counter() - start < 10.0
    out = capsys.readouterr().out
    assert "20 cases, 2 values of rail, 5 values of lateral_shift_mm, 2 values of load_kN" in out
    assert call(["check", str(path), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["cases"], record["positions"], record["placed"], record["problems"]) == (20, 10, 10, [])
    assert f"about {record['cost']['seconds']:.0f} s with" in out
    path.write_text('rail = ["60E1", "rail.csv"]\nwheel = "wheel.csv"\n')
    assert call(["check", str(path)]) == 2
    err = capsys.readouterr().err
    assert "there is no file 'rail.csv'" in err
    assert "there is no file 'wheel.csv'" in err
    # a name that cannot be a file name is refused in a study
    path.write_text('wheel = "S1003"\n')
    assert call(["check", str(path)]) == 2
    assert "mine.toml: there is no profile 'S1003'; did you mean S1002" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("study", "positions", "positions_placed", "problem"),
    [
        # two loads of three positions
        ("lateral_shift_mm = [-2, 0, 2]\nload_kN = [50, 100]\n", 3, 3, None),
        # the third position cannot be placed
        (
            'roll = "given"\nlateral_shift_mm = [0, 2, 9, 10]\nload_kN = [50, 100]\n',
            4,
            3,
            "lateral shift 9 mm: the wheel derails",
        ),
        (
            "lateral_shift_mm = [0, 2, 9, 10]\n",
            4,
            3,
            "lateral shift 9 mm of the wheelset: left side: the wheel derails",
        ),
        # both wheels of a wheelset, of which the other one stands on another rail
        ('roll = "touching"\n[opposite]\nrail = "54E1"\n', 1, 1, None),
        ('roll = "given"\nlateral_shift_mm = [0, 2]\n[opposite]\nrail = "54E1"\n', 2, 1, "give roll = 'touching'"),
        # nothing is placed where a profile is missing
        ('rail = "rail.csv"\nlateral_shift_mm = [0, 9]\n', 2, 0, "rail.csv"),
        # more than 40: those at both ends, and some between them
        ('lateral_shift_mm = "-4:4:0.1"\n', 81, 40, None),
    ],
)
def test_checking_a_study_places_its_wheels(study, positions, positions_placed, problem, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(study)
    estimate = check_study(path)
    assert (estimate.positions, estimate.placed) == (positions, positions_placed)
    assert len(estimate.problems) == (problem is not None)
    assert all(problem in said for said in estimate.problems)


def test_checking_a_study_says_how_many_positions_were_tried(tmp_path, capsys, monkeypatch):
    path = tmp_path / "mine.toml"
    path.write_text('roll = "given"\nlateral_shift_mm = [0, 2, 4]\n[opposite]\nrail = "54E1"\n')
    assert call(["check", str(path)]) == 2
    assert "1 of 3 positions were checked, up to the first invalid position" in capsys.readouterr().err
    placements = []
    monkeypatch.setattr("fecontact.runs.check.place_case", lambda case: placements.append(case.lateral_shift_mm))
    path.write_text('lateral_shift_mm = "-4:4:0.1"\n')
    assert call(["check", str(path)]) == 0
    assert "40 of 81 positions were checked, spread over the study" in capsys.readouterr().err
    assert (placements[0], placements[-1]) == (-4.0, 4.0)
    assert max(b - a for a, b in pairwise(placements)) < 0.31


def test_checking_a_study_reads_its_profiles_as_the_study_says(tmp_path):
    # a head of R 300 in metres: nobody can tell, and the study does
    y_m = [1e-3 * y for y in range(-30, 31)]
    (tmp_path / "head.txt").write_text("\n".join(f"{y} {(0.3**2 - y**2) ** 0.5 - 0.3}" for y in y_m))
    study = f'rail = "{(tmp_path / "head.txt").as_posix()}"\nwheel = "cylinder:460"\ninclination = "none"\n'
    (tmp_path / "mine.toml").write_text(study + "[track]\nrail_crown_y_mm = 750.0\n")
    assert len(check_study(tmp_path / "mine.toml").problems) == 1
    (tmp_path / "mine.toml").write_text(study + '[track]\nrail_crown_y_mm = 750.0\n[rail_file]\nunits = "m"\n')
    assert check_study(tmp_path / "mine.toml").problems == ()


@pytest.mark.parametrize(
    "case",
    [
        Case(lateral_shift_mm=-4.0, roll="given"),
        Case(lateral_shift_mm=3.0, roll="given", resolution="standard"),
        Case(lateral_shift_mm=3.0, roll="given", resolution="fine"),
        Case(lateral_shift_mm=3.0, roll="given", yaw_rad=5e-3),
        Case(lateral_shift_mm=-4.0, roll="given", resolution=(1.0, 0.8)),
    ],
)
def test_what_a_case_is_expected_to_need_is_near_its_meshes(case):
    pair = mesh_pair(case)
    unknowns = pair.rail.unknowns + pair.wheel.unknowns
    assert preview_case(case).degrees_of_freedom == pytest.approx(unknowns, rel=0.12)


@pytest.mark.parametrize(
    ("case", "unknowns", "seconds", "memory"),
    [
        (Case(lateral_shift_mm=-2.0), 30_318, 2.7, 0.275),
        (Case(lateral_shift_mm=1.0), 63_264, 4.5, 0.43),
        (Case(lateral_shift_mm=3.0, yaw_rad=5e-3), 53_826, 3.5, 0.33),
        (Case(lateral_shift_mm=3.0, resolution="standard"), 61_659, 4.8, 0.43),
        (Case(lateral_shift_mm=3.0, resolution="fine"), 88_812, 6.7, 0.57),
        (Case(lateral_shift_mm=1.0, resolution="standard"), 146_646, 11.2, 0.91),
    ],
)
def test_expected_times_and_memory_are_those_that_were_measured(case, unknowns, seconds, memory):
    """CPU seconds and largest memory (GB) of `solve --refine never`."""
    expected_cost = preview_case(case)
    assert expected_cost.degrees_of_freedom == pytest.approx(unknowns, rel=0.12)
    # a whole model takes less than it is said to, since its halves have a factor each
    assert 1 / 1.2 < expected_cost.cpu_seconds / seconds < (1.2 if case.half else 1.3)
    assert 0.87 < expected_cost.memory_GB / memory < (1.15 if case.half else 1.3)


@pytest.mark.parametrize(
    ("shift", "yield_MPa", "resolution", "seconds"),
    [
        (-4.0, 450.0, "quick", 6.9),
        (3.0, 450.0, "quick", 7.6),
        (0.0, 450.0, "quick", 9.4),
        (3.0, 450.0, "standard", 22.6),
    ],
)
def test_bodies_that_yield_take_as_long_as_was_measured(shift, yield_MPa, resolution, seconds):
    """CPU seconds of `solve --refine never --tangent-mpa 4200`.

    The estimate is within a factor of 1.6.
    """
    steel = Material(young_MPa=210e3, poisson=0.3, yield_MPa=yield_MPa, tangent_MPa=4200.0)
    case = Case(lateral_shift_mm=shift, resolution=resolution, rail_material=steel, wheel_material=steel)
    expected_s = preview_case(case).cpu_seconds
    assert 1 / 1.6 < expected_s / seconds < 1.15
    # from a patch on fewer nodes
    assert estimate_cost([case], 1).seconds == pytest.approx(expected_s, rel=0.05)
    # a yield stress that is not reached takes nothing
    hard = replace(steel, yield_MPa=1200.0)
    elastic = preview_case(replace(case, rail_material=STEEL, wheel_material=STEEL)).cpu_seconds
    assert (
        preview_case(replace(case, rail_material=hard, wheel_material=hard)).cpu_seconds == elastic < 0.6 * expected_s
    )


@pytest.mark.parametrize(
    ("unknowns", "memory"),
    [(57_210, 0.38), (61_143, 0.46), (167_655, 1.07), (242_472, 1.56), (255_762, 1.53), (433_209, 2.8)],
)
def test_memory_grows_faster_than_unknowns_as_measured(unknowns, memory):
    """Memory at 6 and 5.5 mm (`quick`), 6 mm (`standard`), 6 and 1 mm (`fine`) and 3 mm.

    The unknowns of the meshes are given too.
    """
    assert estimate_memory_GB(unknowns) == pytest.approx(memory, rel=0.1)


def test_memory_where_verdicts_stay_open_is_that_of_the_finest_meshes_allowed():
    # 433 thousand unknowns took 2.8 GB
    cells = [Case(lateral_shift_mm=6.0), Case(lateral_shift_mm=3.0)]
    assert estimate_cost(cells, 1).most_memory_GB == pytest.approx(2.8 * 400.0 / 433.0, rel=0.1)
    never = estimate_cost([replace(case, refine="never") for case in cells], 1)
    assert never.most_memory_GB == never.memory_GB < 1.0


def test_a_study_costs_more_if_verdicts_stay_open(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("load_kN = '10:100:10'\n")
    estimate = check_study(path)
    assert estimate.cases == 10
    # but for what all take, and files and the report
    cost, always = estimate.cost, START_SECONDS + 10 * STUDY_FILES_S[0] / estimate.cost.workers + STUDY_FILES_S[1]
    assert cost.most_seconds - always > 2.5 * (cost.seconds - always)
    assert estimate.cost.most_memory_GB > 2.0 * estimate.cost.memory_GB


@pytest.mark.parametrize(
    ("shifts", "loads_kN", "files", "seconds"),
    [
        # of maps, the last one with --refine never as the study of one load
        ((-4.0, 3.0), (50.0, 100.0), MAP_FILES_S, 9.5),
        ((-4.0, 0.0, 4.0), (20.0, 50.0, 80.0, 100.0), MAP_FILES_S, 23.4),
        ((-4.0, 3.0, 5.0), (100.0,), MAP_FILES_S, 13.1),
        # of studies
        ((-4.0, 0.0, 4.0), (20.0, 50.0, 80.0, 100.0), STUDY_FILES_S, 36.8),
        ((-4.0, 3.0, 5.0), (100.0,), STUDY_FILES_S, 15.0),
    ],
)
def test_expected_times_of_maps_and_studies_are_those_that_were_measured(shifts, loads_kN, files, seconds):
    """CPU seconds of whole commands with --workers 1.

    They include all files, pictures and reports, on a busy machine.
    """
    cells = [Case(lateral_shift_mm=shift, load_N=1e3 * load) for shift in shifts for load in loads_kN]
    assert 1 / 1.3 < estimate_cost(cells, 1, files=files).seconds / seconds < 1.3


def test_the_expected_time_of_a_position_is_that_which_was_measured():
    """CPU seconds of `solve --shift 3` on one core."""
    expected_cost = preview_case(Case(lateral_shift_mm=3.0))
    # 2.9 s of the user, 0.5 s of the system; 0.34 GB at its peak
    assert 1 / 1.5 < expected_cost.cpu_seconds / 3.4 < 1.5
    assert 1 / 1.5 < expected_cost.memory_GB / 0.34 < 1.5


def test_lines_of_measured_points_are_solved_at_the_loads_of_limits_too(monkeypatch):
    """On new profiles these loads cost the time that shared meshes save."""
    cells = [Case(lateral_shift_mm=3.0, load_N=load) for load in (50e3, 100e3)]
    expected_cost = preview_case(cells[0])
    for lines_seconds in (0.0, 4.5):
        changed_cost = replace(expected_cost, lines_seconds=lines_seconds)
        monkeypatch.setattr(
            "fecontact.runs.cost.preview_case_to_solve", lambda _, changed_cost=changed_cost: changed_cost
        )
        plain, searched = estimate_cost(cells, 2), estimate_cost(cells, 2, further=(5.0, 14.0))
        assert searched.seconds - plain.seconds == pytest.approx(5.0 * lines_seconds / 2)
        assert searched.most_seconds - plain.most_seconds == pytest.approx(14.0 * lines_seconds / 2)


def test_files_pictures_and_reports_have_their_time(tmp_path, monkeypatch):
    pytest.importorskip("fecontact.maps")
    cells = [Case(lateral_shift_mm=3.0, load_N=load) for load in (50e3, 80e3, 100e3)]
    expected_cost = preview_case(cells[0])
    monkeypatch.setattr("fecontact.runs.cost.preview_case_to_solve", lambda _: expected_cost)
    plain, with_files = estimate_cost(cells, 2), estimate_cost(cells, 2, files=(1.5, 4.0))
    # those of each case by two workers, those of all by one process
    for name in ("seconds", "most_seconds"):
        assert getattr(with_files, name) - getattr(plain, name) == pytest.approx(3 * 1.5 / 2 + 4.0)
    requests = []

    def note_files(*_, files=None, **__):
        requests.append(files)
        raise InputError("enough")

    monkeypatch.setattr("fecontact.runs.cost.estimate_cost", note_files)
    study = tmp_path / "one.toml"
    study.write_text("load_kN = 100.0\n")
    map_words = ("map", "--shifts", "3", "--loads-kn", "100")
    for words in (("solve",), ("solve", "--out", "a"), ("run", str(study), "--out", "b"), (*map_words, "--out", "c")):
        monkeypatch.chdir(tmp_path)
        assert call(words) == 2
    assert requests == [None, CASE_FILES_S, STUDY_FILES_S, MAP_FILES_S]
    # of a case alone some 3 s were measured, of a study of nine 15 s, of a map of nine 8 s
    of_nine = [9 * per_cell_s + at_end for per_cell_s, at_end in (STUDY_FILES_S, MAP_FILES_S)]
    assert [CASE_FILES_S[1], *of_nine] == pytest.approx([3.0, 15.0, 8.0], rel=0.1)


def test_progress_of_a_case_is_a_line_for_each_of_its_meshes_where_nobody_watches(capsys):
    with show_solution_progress() as step:
        for name in ("place", "first meshes: mesh", "first meshes: factorise", "coarser meshes: mesh", "ladder"):
            step(name)
    out, err = capsys.readouterr()
    assert out == ""
    assert [line.split(maxsplit=2)[2] for line in err.splitlines()] == [
        "first meshes: meshing both bodies",
        "coarser meshes: meshing both bodies",
    ]


@pytest.mark.parametrize(
    ("words", "worked_by", "time"),
    [
        ("curve --radii 400", "fecontact.features.curves.running.curve", "1 curve: about 2 s"),
        ("table --shifts 1,2 --loads-kn 50,80", "fecontact.runs.alone.table", "4 rows: about 3 s"),
        (
            "geometry --shifts 1 --loaded-kn 60",
            "fecontact.features.curves.loaded.compute_loaded_conicities",
            "takes about 15 s",
        ),
        ("judge folder --friction 0.3", "fecontact.runs.judging_again.judge", "40 cases: about "),
        (
            "irregular --wavelengths-mm 30 --amplitudes-um 5 --workers 2",
            "fecontact.features.irregular.running.irregular",
            "4 cells: about 1 s",
        ),
    ],
)
def test_a_command_that_takes_long_says_so_before_it_works(words, worked_by, time, capsys, monkeypatch, tmp_path):
    """An expected time first, and the progress after it."""
    pytest.importorskip(worked_by.rpartition(".")[0])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "study.csv").write_text("id\n" + "".join(f"case{number}\n" for number in range(40)))

    def work(*arguments, progress, **keywords):
        progress(0, 4, "working")
        raise InputError("the work begins")

    monkeypatch.setattr(worked_by, work)
    assert call(words.split()) == 2
    first, then, last = capsys.readouterr().err.splitlines()
    assert time in first
    assert "0 of 4" in then
    assert last == "error: the work begins"


def test_a_study_says_what_it_takes_before_it_begins(capsys, monkeypatch, tmp_path):
    def work(*arguments, **keywords):
        raise InputError("the work begins")

    monkeypatch.setattr("fecontact.runs.study.run_study", work)
    (tmp_path / "two.toml").write_text("load_kN = 100.0\nlateral_shift_mm = [-4.0, 4.0]\n")
    command_line = ["run", str(tmp_path / "two.toml"), "--out", str(tmp_path / "out"), "--workers", "1"]
    said = []
    for options in ((), ("--part", "1/2"), ("--quiet",)):
        assert call([*command_line, *options]) == 2
        said.append(capsys.readouterr().err.splitlines())
    # a part has no information about the other parts
    assert [line for line in said[0] if "about" in line] == [said[0][0]]
    assert re.match(r"2 cases: about \d+ s with 1 worker and 0\.3 GB per worker; up to \d+ s", said[0][0])
    assert said[1:] == [["error: the work begins"]] * 2


def test_progress_of_many_quick_cases_is_a_line_in_five_seconds_where_nobody_watches(capsys, monkeypatch, tmp_path):
    """The first case and the last case always have a line.

    The log has a line for every case.
    """
    now = [100.0]
    monkeypatch.setattr("fecontact.console.progress.time.monotonic", lambda: now[0])

    with log_command(tmp_path / "run.log"), show_job_progress("pairs") as show:
        for number in range(300):
            show(number, 300, f"solving {number}")
            now[0] += 0.25
    lines = [line.split()[:6] for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        [f"{number / 4:.0f}", "s", str(number), "of", "300", "pairs"] for number in (*range(0, 300, 20), 299)
    ]
    assert len(log_lines(tmp_path / "run.log")) == 302


def test_the_last_line_of_what_is_interrupted_is_printed(capsys):
    def interrupted():
        with show_job_progress("pairs") as show:
            show(0, 1000, "solving 0")
            show(1, 1000, "solving 1")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert [line.split()[2] for line in capsys.readouterr().err.splitlines()] == ["0", "1"]


def test_progress_of_many_cases_is_a_line_each_time_one_is_done(capsys, monkeypatch):
    now = [100.0]
    monkeypatch.setattr("fecontact.console.progress.time.monotonic", lambda: now[0])
    with show_job_progress("cases") as show:
        show(2, 6, "solving one")
        show(2, 6, "solving one, two")
        now[0] += 30.0
        show(4, 6, "solving three; about 30 s left")
        # parts of what is under way: loads, and those that no one asked for
        for words in ("0 of 2 loads", "2 of 2 loads, 1 more for limits", "2 of 2 loads, 2 more for limits"):
            now[0] += 10.0
            show(4, 6, f"solving four ({words})")
    lines = [" ".join(line.split()) for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "0 s 2 of 6 cases done: solving one",
        "30 s 4 of 6 cases done: solving three; about 30 s left",
        "50 s 4 of 6 cases done: solving four (2 of 2 loads, 1 more for limits)",
        "60 s 4 of 6 cases done: solving four (2 of 2 loads, 2 more for limits)",
    ]


def log_lines(path):
    """Levels and texts of a log."""
    return [line.split(maxsplit=3)[2:] for line in path.read_text("utf-8").splitlines()]


def test_a_log_has_what_was_said_and_how_it_ended(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("fecontact.console.progress.sys.argv", ["fecontact", "run", "my study.toml"])
    path = tmp_path / "new" / "run.log"
    with log_command(path):
        with show_job_progress("cases", quiet=True) as show:
            show(0, 2, "solving one")
            show(0, 2, "solving one, two")
            show(1, 2, "solving two")
        print_result("it holds", quiet=True)
        print_result("here")
        write_to_log("one: 3 mm deep", warning=True)
        print_reasons("1 of 2", {"a": "derails"})
    with pytest.raises(InputError), log_command(path):
        raise InputError("no such rail")
    with pytest.raises(KeyboardInterrupt), log_command(path):
        raise KeyboardInterrupt
    out, err = capsys.readouterr()
    # `--quiet` is silent only about success
    assert (out, err) == ("here\n", "1 of 2:\n  a: derails\n")
    began = ["INFO", f"fecontact {__version__}: fecontact run 'my study.toml'\n".rstrip()]
    assert log_lines(path) == [
        began,
        ["INFO", "0 of 2 cases done: solving one"],
        ["INFO", "1 of 2 cases done: solving two"],
        ["INFO", "it holds"],
        ["INFO", "here"],
        ["WARNING", "one: 3 mm deep"],
        ["WARNING", "1 of 2:"],
        ["WARNING", "a: derails"],
        ["INFO", "ended"],
        began,
        ["ERROR", "ended by InputError: no such rail"],
        began,
        ["ERROR", "ended by KeyboardInterrupt"],
    ]
    # nothing is kept open, and nothing said afterwards gets into it
    size = path.stat().st_size
    print_result("later", quiet=True)
    assert path.stat().st_size == size


def test_a_log_that_cannot_be_written_any_more_is_no_error(tmp_path, capsys):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    with log_command(Path("/dev/full")):
        print_result("here")
    assert capsys.readouterr() == ("here\n", "")


def test_a_log_that_leads_elsewhere_or_waits_for_a_reader_is_refused(tmp_path):
    link, pipe = tmp_path / "link.log", tmp_path / "pipe.log"
    link.symlink_to(elsewhere := tmp_path / "elsewhere")
    os.mkfifo(pipe)
    for path in (link, pipe):
        with pytest.raises(OSError, match="a link or a pipe instead of a file; remove it"), log_command(path):
            pytest.fail("it began")
    assert not elsewhere.exists()


def test_reasons_are_told_together(capsys):
    print_reasons("3 of 5", {"a": "derails", "b": "memory", "c": "derails"})
    print_reasons("none", {})
    assert capsys.readouterr().err == "3 of 5:\n  a, c: derails\n  b: memory\n"


@pytest.mark.slow
def test_a_study_says_what_failed_once_more_at_its_end(tmp_path):
    (tmp_path / "two.toml").write_text(BAD_STUDY)
    completed = program(
        "-m", "fecontact", "run", str(tmp_path / "two.toml"), "--out", str(tmp_path / "out"), "--workers", "1"
    )
    assert completed.returncode == 3
    end = completed.stderr.splitlines()
    assert "2 of 2 cases without a usable result:" in end
    # both have one reason, which is printed once
    (reason,) = [line for line in end if "give roll = 'touching'" in line]
    assert "+1.00mm" in reason
    assert "+1.50mm" in reason
    log = (tmp_path / "out" / "run.log").read_text("utf-8")
    assert all(line.strip() in log for line in end[end.index("2 of 2 cases without a usable result:") :])


def test_a_quiet_study_says_only_what_went_wrong(tmp_path, capfd):
    (tmp_path / "two.toml").write_text(BAD_STUDY)
    command = ["run", str(tmp_path / "two.toml"), "--out", str(tmp_path / "out"), "--workers", "1"]
    assert call([*command, "-q"]) == 3
    # of its workers as well
    out, err = capfd.readouterr()
    assert out == ""
    assert err.splitlines()[0] == "2 of 2 cases without a usable result:"
    log = (tmp_path / "out" / "run.log").read_text("utf-8")
    assert "0 of 2 cases done: solving +1.00 mm 100 kN" in log
    assert f"Results in {tmp_path / 'out'}" in log


@pytest.mark.slow
@pytest.mark.parametrize("source", ["file", "stdin"])
def test_a_script_without_a_main_guard_is_not_run_by_its_workers(tmp_path, source):
    code = (
        # cases that fail at once
        "import fecontact\nfrom fecontact.case import Opposite\nprint('once')\nother = Opposite(rail='54E1')\n"
        "cases = [fecontact.Case(lateral_shift_mm=shift, roll='given', opposite=other) for shift in (1.0, 1.5)]\n"
        f"print({{row['status'][:30] for row in fecontact.run(cases, {str(tmp_path / 'out')!r}, workers=1).rows}})\n"
    )
    script = tmp_path / "script.py"
    script.write_text(code)
    completed = program(str(script)) if source == "file" else program("-", input=code)
    assert completed.stdout.splitlines()[0] == "once"
    assert completed.stdout.count("once") == 1
    assert "died" not in completed.stdout
    assert "failed: the opposite side has" in completed.stdout
    assert completed.stderr == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no process groups")
@pytest.mark.parametrize(
    ("ended_by", "seconds"),
    [(signal.SIGINT, 1.0), (signal.SIGTERM, 1.0), pytest.param(signal.SIGINT, 2.0, marks=pytest.mark.slow)],
)
def test_an_end_from_outside_while_workers_begin_is_one_line(tmp_path, ended_by, seconds):
    # in the background a shell has Ctrl-C ignored
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from fecontact.cli import main;"
        f"main(['run', {str(ROOT / 'studies' / 'first_light.py')!r}, '--quick', '--out', {str(tmp_path / 'out')!r}])"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    # from where workers begin: when the folder is held
    while not (tmp_path / "out" / "run.lock").exists():
        time.sleep(0.02)
    time.sleep(seconds - 0.9)
    # Ctrl-C goes to all processes of a terminal, a queue of jobs knows the first one
    (os.killpg if ended_by == signal.SIGINT else os.kill)(process.pid, ended_by)
    _, err = process.communicate(timeout=600)
    assert "Traceback" not in err
    assert err.splitlines()[-1] == "interrupted; finished results are kept"
    assert process.returncode in (130, -signal.SIGINT)


def test_an_end_before_the_first_job_says_what_is_kept(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("fecontact.jobs.engine.remove_unfinished", interrupted)
    with pytest.raises(KeyboardInterrupt) as ended, open_run(tmp_path, tmp_path / "cases", RunSettings()):
        pass
    assert ended.value.__notes__ == ["finished results are kept"]


def test_an_interrupted_solution_says_nothing_of_what_is_kept(monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("fecontact.solving.solve.solve", interrupted)
    assert call(["solve", "--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none"]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "interrupted"


def test_a_reader_that_has_enough_is_no_error():
    completed = program(
        "-c",
        "from fecontact.cli import main; import os; r, w = os.pipe(); os.dup2(w, 1); os.close(r); main(['profiles'])",
    )
    assert "Traceback" not in completed.stderr
    assert "Broken pipe" not in completed.stderr
    assert completed.returncode == 0


def test_a_closed_standard_output_changes_no_exit_code(monkeypatch, capsys):
    """The exit code of `compare A A >&-`.

    Exit code 1 would mean that both differ.
    """
    monkeypatch.setattr(sys, "stdout", None)
    code = call(["compare", "A", "A"])
    sys.stdout.close()
    assert code == 2
    assert capsys.readouterr().err.startswith("error: results A: no such file or folder")


def test_a_terminal_without_the_sign_gets_another_one():
    completed = program(
        "-m", "fecontact", "hertz", "--shift", "3", env={"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    )
    assert completed.returncode == 0
    assert completed.stderr == ""


def test_a_missing_system_library_leads_to_the_doctor():
    said = _system_error(OSError("libGLU.so.1: cannot open shared object file: No such file or directory"))
    assert "libGLU.so.1" in said
    assert "fecontact doctor" in said


def test_completion_is_installed_for_the_shell(tmp_path):
    completed = program("-m", "fecontact", "--install-completion", env={"HOME": str(tmp_path), "SHELL": "/bin/bash"})
    assert completed.returncode == 0, completed.stderr
    written = [path.read_text() for path in tmp_path.rglob("*") if path.is_file()]
    assert any("fecontact" in text for text in written)


def test_a_profile_is_drawn_only_where_one_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(["profiles", "60E1"]) == 0
    assert list(tmp_path.iterdir()) == []
    assert call(["profiles", "60E1", "--out", "head.png"]) == 0
    assert (tmp_path / "head.png").is_file()


def test_files_that_held_something_else_are_named(tmp_path, capsys):
    pytest.importorskip("fecontact.features.irregular")
    words = ["irregular", "--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none", "--workers", "1"]
    words += ["--wavelengths-mm", "50", "--out", str(tmp_path), "--amplitudes-um"]
    (tmp_path / "notes.txt").write_text("mine")
    replaced_names = ("irregular.json", "irregular.png", "irregular.svg", "report.html")
    for amplitude, names in (("10", ()), ("10", ()), ("20", replaced_names)):
        assert call([*words, amplitude]) == 0
        said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("replaced")]
        listed = ", ".join(str(tmp_path / name) for name in names)
        assert said == ([f"replaced files that had different content: {listed}"] if names else [])
    # of a picture both forms, and nothing beside it
    for profile, names in (("60E1", ()), ("54E1", ("head.png", "head.svg"))):
        assert call(["profiles", profile, "--out", str(tmp_path / "head.png")]) == 0
        listed = ", ".join(str(tmp_path / name) for name in names)
        assert capsys.readouterr().err == (f"replaced files that had different content: {listed}\n" if names else "")
