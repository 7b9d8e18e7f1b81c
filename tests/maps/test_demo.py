"""The demo: its answer over maps of every kind, its refusals, and a whole run."""

import json
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import pyvista
from test_map_views import failing, flat_patch, position, verdicts

from fecontact.cli import call
from fecontact.contact_theories.registry import MULTI_HERTZ, THEORIES
from fecontact.judging.verdict import Verdict
from fecontact.maps.load_limits import find_load_limit
from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
from fecontact.maps.verdict_views import CAUSES
from fecontact.runs import demo
from fecontact.runs.demo import (
    BASE_CASE,
    LOADS_N,
    SHIFTS_MM,
    SPHERE_CASE,
    DemoOutcome,
    choose_paraview_case,
    compute_exact_peak_MPa,
)
from fecontact.runs.demo_answer import list_files, write_answer_sentences, write_remedy_sentences, write_sphere_sentence
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case

ROOT = Path(__file__).parents[2]
ROW = {"id": "sphere", "status": "converged", "fe_p_max_MPa": 1068.54}
FILES = ("Map:     ", "Report:  ", "ParaView:", "Table:   ")


@pytest.fixture(scope="module")
def base_map():
    """A map where Hertz holds at one contact point, and fails at two.

    Springs hold at the two contact points.
    """
    case = replace(BASE_CASE)
    return ApplicabilityMap(case=case, loads_N=(50e3,), positions=(position(-4.0), position(5.0)))


def said(base_map, shifts_mm, loads_kN, rows, causes=None):
    return write_answer_sentences(verdicts(base_map, shifts_mm, loads_kN, rows, causes))


def test_the_sphere_is_one_and_its_peak_is_that_of_the_closed_form():
    hertz = compute_hertz(SPHERE_CASE, place_case(SPHERE_CASE))
    assert hertz.a_mm == pytest.approx(hertz.b_mm, rel=1e-9)
    assert hertz.p0_MPa == pytest.approx(compute_exact_peak_MPa(), rel=1e-9)
    # 3 F / (2 pi a^2), with a^3 = 3 F R / (4 E*): the same by other steps, E* of steel on steel (210 GPa, 0.3)
    a_mm = (0.75 * 100e3 * 460.0 / (210e3 / (2.0 * (1.0 - 0.3**2)))) ** (1.0 / 3.0)
    assert compute_exact_peak_MPa() == pytest.approx(1.5 * 100e3 / (3.141592653589793 * a_mm**2), rel=1e-12)


def test_an_answer_has_two_sentences(base_map):
    shifts, loads = [0.0, 1.0, 2.0, 3.0], [20, 50, 100]
    assert said(base_map, shifts, loads, ["hhh", "hff", "hhf", "fff"], {3.0: "second patch"}) == [
        "Between 20 kN and 100 kN, Hertz holds at 0 mm at all loads, at 1 mm at 20 kN and at 2 mm up to 50 kN.",
        "It fails at 1 mm from 50 kN and at 2 mm at 100 kN, because the pressure has a second lobe; at 3 mm at all"
        " loads, because a second patch takes load.",
    ]


def test_an_answer_of_one_kind(base_map):
    assert said(base_map, [-1.0, 0.0], [20, 50], ["hh", "hh"]) == [
        "Between 20 kN and 50 kN, Hertz holds at -1 mm at all loads and at 0 mm at all loads.",
        "It does not fail at any shift or load of this map.",
    ]
    assert said(base_map, [1.5], [20, 50], ["ff"]) == [
        "Between 20 kN and 50 kN, Hertz does not hold at any shift or load of this map.",
        "It fails at 1.5 mm at all loads, because the pressure has a second lobe.",
    ]
    # a single load needs no words about loads
    assert said(base_map, [-0.0, 1.0], [112.5], ["h", "f"]) == [
        "At 112.5 kN, Hertz holds at 0 mm.",
        "It fails at 1 mm, because the pressure has a second lobe.",
    ]


def test_an_answer_where_hertz_holds_again_at_larger_loads(base_map):
    assert said(base_map, [1.0], [20, 50, 80, 100, 125], ["hfhhf"]) == [
        "Between 20 kN and 125 kN, Hertz holds at 1 mm at 20 kN and from 80 kN to 100 kN.",
        "It fails at 1 mm at 50 kN and at 125 kN, because the pressure has a second lobe.",
    ]
    assert said(base_map, [1.0], [20, 50, 80, 100], ["fffh"])[1].startswith("It fails at 1 mm up to 80 kN, because")


def test_unresolved_cells_are_neither(base_map):
    assert said(base_map, [0.0, 1.0], [20, 50], ["oo", "oo"]) == [
        "Between 20 kN and 50 kN, Hertz is not known to hold at any shift or load of this map.",
        "It is not known to fail at any shift or load of this map.",
        "The verdict is unresolved at 0 mm (20 kN, 50 kN) and 1 mm (20 kN, 50 kN).",
    ]
    assert said(base_map, [0.0], [20, 50, 100], ["hof"]) == [
        "Between 20 kN and 100 kN, Hertz holds at 0 mm at 20 kN.",
        "It fails at 0 mm at 100 kN, because the pressure has a second lobe.",
        "The verdict is unresolved at 0 mm (50 kN).",
    ]


def test_cells_without_a_result_are_counted_and_named(base_map):
    assert said(base_map, [0.0, 1.0], [20, 50], ["h!", "hh"]) == [
        "Between 20 kN and 50 kN, Hertz holds at 0 mm at 20 kN and at 1 mm at all loads.",
        "It is not known to fail at any shift or load of this map.",
        "1 cell has no usable result, at 0 mm (50 kN).",
    ]
    assert said(base_map, [0.0, 1.0], [20, 50], ["ff", "!!"])[2:] == [
        "2 cells have no usable result, at 1 mm (20 kN, 50 kN).",
    ]
    assert said(base_map, [0.0, 1.0], [20], ["!", "!"]) == [
        "No answer: 2 cells have no usable result, at 0 mm (20 kN) and 1 mm (20 kN).",
    ]


def test_a_load_that_did_not_converge_is_not_an_answer(base_map):
    shown_map = verdicts(base_map, [0.0], [20, 50], ["hf"])
    (where,) = shown_map.positions
    cells = (where.cells[0], replace(where.cells[1], status="not converged"))
    shown_map = replace(shown_map, positions=(replace(where, cells=cells, limit=find_load_limit(cells)),))
    assert write_answer_sentences(shown_map) == [
        "Between 20 kN and 50 kN, Hertz holds at 0 mm at 20 kN.",
        "It is not known to fail at any shift or load of this map.",
        "1 cell has no usable result, at 0 mm (50 kN).",
    ]
    assert write_remedy_sentences(shown_map) == []


def test_loads_of_the_search_bound_the_answer(base_map):
    """Limits of the search with three digits, and with their causes."""
    shown_map = verdicts(base_map, [2.0], [20, 28.93, 31.52, 100], ["hhff"])
    (where,) = shown_map.positions
    map_loads, tried = (where.cells[0], where.cells[3]), [cell.judged for cell in where.cells[1:3]]
    limit = find_load_limit(map_loads, tried)
    shown_map = replace(
        shown_map, loads_N=(20e3, 100e3), positions=(replace(where, cells=map_loads, tried=tuple(tried), limit=limit),)
    )
    assert write_answer_sentences(shown_map) == [
        "Between 20 kN and 100 kN, Hertz holds at 2 mm up to 28.9 kN.",
        "It fails at 2 mm from 31.5 kN, because the pressure has a second lobe.",
    ]
    conforming = replace(tried[1], verdict=replace(tried[1].verdict, cause="conformity"))
    shown_map = replace(shown_map, positions=(replace(shown_map.positions[0], tried=(tried[0], conforming)),))
    assert write_answer_sentences(shown_map)[1].endswith(
        "because the surfaces conform and the pressure has a second lobe."
    )


@pytest.mark.parametrize("cause", [*CAUSES, None])
def test_every_cause_has_words(base_map, cause):
    (_, fails) = said(base_map, [1.0], [20, 50], ["ff"], {1.0: cause})
    assert fails == f"It fails at 1 mm at all loads, because {CAUSES[cause][1] if cause else 'of an unknown cause'}."


def test_the_remedy_is_a_theory_inside_its_range(base_map):
    assert write_remedy_sentences(base_map) == [
        "The cheapest theory that holds there, inside its range, is"
        f" {THEORIES[MULTI_HERTZ].in_sentence}, at 5 mm (50 kN)."
    ]
    # ANALYN holds by its numbers, outside its range: the next one that holds is named
    partly_flat = flat_patch(theories_out_of_range=True)
    assert partly_flat.rows()[0]["cheapest_theory"] == "analyn"
    assert partly_flat.rows()[0]["cheapest_theory_status"] == "out of range"
    (sentence,) = write_remedy_sentences(partly_flat)
    assert "is KPEC at 3 mm (100 kN)" in sentence


def test_without_a_remedy_that_is_said(base_map):
    no_remedy = failing(replace(base_map, positions=(*base_map.positions, lost_position())))
    assert write_remedy_sentences(no_remedy) == [
        "Every theory fails, or is outside its range, at 5 mm (50 kN): use finite elements there."
    ]
    assert write_remedy_sentences(replace(base_map, positions=base_map.positions[:1])) == []


def test_an_open_remedy_is_not_named(base_map):
    second = base_map.positions[1]
    (cell,) = second.cells
    verdict = Verdict(answer="UNRESOLVED", measure="area_mm2", each={"area_mm2": "UNRESOLVED"})
    judgements = {name: replace(judgement, verdict=verdict) for name, judgement in cell.judged.judgements.items()}
    cells = (replace(cell, judged=replace(cell.judged, judgements=judgements)),)
    assert write_remedy_sentences(replace(base_map, positions=(replace(second, cells=cells),))) == [
        "It is unresolved whether a theory inside its range holds at 5 mm (50 kN)."
    ]


def lost_position(shift_mm=6.0):
    cell = MapCell(lateral_shift_mm=shift_mm, load_N=50e3, status="failed: no memory")
    return MapPosition(lateral_shift_mm=shift_mm, cells=(cell,), limit=find_load_limit([cell]))


def test_the_sphere_is_compared_with_the_closed_form():
    assert write_sphere_sentence(ROW) == (
        "Sphere of radius 460 mm on a plane, 100 kN, where Hertz is exact: peak pressure 1068.5 MPa by finite elements,"
        " 1067.8 MPa in closed form, deviation +0.07 %."
    )
    assert write_sphere_sentence({**ROW, "fe_p_max_MPa": 0.98 * compute_exact_peak_MPa()}).endswith(
        "deviation -2.00 %."
    )
    assert write_sphere_sentence({"id": "sphere", "status": "failed: disk full"}).endswith("exact: failed: disk full")


def test_the_case_for_paraview_fails_if_any_does(base_map):
    assert choose_paraview_case(base_map) == replace(BASE_CASE, lateral_shift_mm=5.0, load_N=50e3)
    assert choose_paraview_case(replace(base_map, positions=base_map.positions[:1])) == replace(
        BASE_CASE, lateral_shift_mm=-4.0, load_N=50e3
    )
    assert choose_paraview_case(replace(base_map, positions=(lost_position(),))) is None


@pytest.mark.parametrize(
    ("rows", "sphere", "code", "lost"),
    [
        (["hf", "ff"], ROW, 0, []),
        (["hf", "f!"], ROW, 3, ["+1 mm, 50 kN: failed: no memory"]),
        (["hf", "ff"], {"id": "sphere", "status": "not converged"}, 3, ["case sphere: not converged"]),
    ],
)
def test_the_exit_code_says_whether_all_converged(rows, sphere, code, lost, base_map, monkeypatch, tmp_path, capsys):
    outcome = DemoOutcome(
        map=verdicts(base_map, [0.0, 1.0], [20, 50], rows), sphere=sphere, shown={**ROW, "id": "shown"}
    )
    monkeypatch.setattr(demo, "run_demo", lambda out, **_: outcome)
    assert call(["demo", "--out", str(tmp_path)]) == code
    out, err = capsys.readouterr()
    assert "less than a minute" in err
    assert [line for line in lost if line not in err] == []
    assert [line[:9] for line in out.splitlines()[-4:]] == list(FILES)
    # the answer comes after the map, and before the files
    assert out.index("shift mm") < out.index("Between 20 kN and 50 kN") < out.index("Sphere of") < out.index("Map: ")
    assert "Between 20 kN and 50 kN" in (tmp_path / "run.log").read_text("utf-8")


def test_without_a_case_for_paraview_none_is_named(base_map):
    outcome = DemoOutcome(map=replace(base_map, positions=(lost_position(),)), sphere=ROW, shown=None)
    assert not outcome.all_converged
    assert [line[:9] for line in list_files(Path("out"), outcome)] == [FILES[0], FILES[1], FILES[3]]


@pytest.mark.parametrize(
    ("file", "record", "says"),
    [
        ("study.json", {"study": "mine"}, "has a study"),
        ("map.json", {"lateral_shifts_mm": [1.0], "loads_N": [5e3], "case": {}}, "has a different map"),
    ],
)
def test_a_folder_of_other_results_is_refused(file, record, says, tmp_path, capsys):
    (tmp_path / file).write_text(json.dumps(record))
    assert call(["demo", "--out", str(tmp_path)]) == 2
    assert says in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [file]


def run_program(out: Path, **options) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "fecontact", "demo", "--out", str(out)]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, **options
    )


@pytest.mark.slow
def test_the_demo_is_interrupted_resumed_and_repeated(tmp_path):
    """Finished positions are not solved again.

    A repetition prints the same numbers.
    """
    first = run_program(tmp_path)
    end = time.monotonic() + 600.0
    while not list(tmp_path.glob("positions/[!.]*/stored.json")):
        assert first.poll() is None
        assert time.monotonic() < end
        time.sleep(0.1)
    # as at Ctrl-C, which a test that runs in the background does not hear
    first.send_signal(signal.SIGTERM)
    _, err = first.communicate(timeout=120)
    assert first.returncode == 130
    assert "interrupted; finished results are kept" in err
    before = {path.name for path in tmp_path.glob("positions/[!.]*") if (path / "stored.json").exists()}
    written = {name: (tmp_path / "positions" / name / "stored.json").stat().st_mtime_ns for name in before}

    outputs = []
    for reused in (len(before), len(SHIFTS_MM) + 2):
        again = run_program(tmp_path)
        out, err = again.communicate(timeout=1800)
        assert again.returncode == 0, err
        (line,) = re.findall(r"^(\d+) finished jobs? w\w+ reused; use --force to solve again\n", out, re.MULTILINE)
        assert int(line) == reused
        outputs.append(re.sub(r"^\d+ finished job.*\n", "", out, flags=re.MULTILINE))
        if not reused > len(SHIFTS_MM):
            assert re.search(r"about .* left", err)
    assert outputs[0] == outputs[1]
    assert {name: (tmp_path / "positions" / name / "stored.json").stat().st_mtime_ns for name in before} == written
    assert_files_are_sensible(outputs[0], tmp_path)


def assert_files_are_sensible(printed: str, out: Path) -> None:
    """Check the files of the demo that the printed text names."""
    paths = {
        name: Path(line.removeprefix(name).strip())
        for name in FILES
        for line in printed.splitlines()
        if line.startswith(name)
    }
    assert [path.is_file() for path in paths.values()] == [True] * len(FILES)
    document = json.loads((out / "map.json").read_text("utf-8"))
    assert [cell["status"] for cell in document["cells"]] == ["converged"] * len(SHIFTS_MM) * len(LOADS_N)
    # the files for ParaView have both bodies, and the pressure of the cell
    row = json.loads((paths["ParaView:"].parent / "row.json").read_text("utf-8"))["row"]
    blocks = pyvista.read(paths["ParaView:"])
    further_blocks = pyvista.read(paths["ParaView:"].with_name("bodies.vtm"))
    assert {*blocks.keys()} == {"rail", "pressure", "hertz_ellipse"}
    assert {*blocks.keys(), *further_blocks.keys()} == {"rail", "wheel", "pressure", "elements", "hertz_ellipse"}
    assert blocks["pressure"]["contact_pressure_MPa"].max() == pytest.approx(row["fe_p_max_MPa"], rel=0.02)
    assert (paths["ParaView:"].parent / "view.py").is_file()
    (cell,) = (
        cell
        for cell in document["cells"]
        if (cell["lateral_shift_mm"], cell["load_N"] / 1e3) == (row["lateral_shift_mm"], row["load_kN"])
    )
    assert cell["verdict"]["answer"] == row["verdict_answer"] == "FAILS"
    # the same contact on other meshes
    assert row["fe_p_max_MPa"] == pytest.approx(cell["fe"]["p_max_MPa"], rel=0.005)
    # the sphere is exact
    assert abs(float(re.search(r"deviation ([+-][\d.]+) %", printed)[1])) < 0.15
