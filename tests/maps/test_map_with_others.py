"""Maps with the topics of other test files.

These are springs, yielding, rolls, commands, folders, tables, and vehicles in curves.
"""

# ruff: noqa: F811

import importlib
import inspect
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import fake_solve
import positions
import pytest
from inline import inline_crew
from marks import slow_but
from matplotlib import rc_context
from points import MEASURED_COLUMNS
from positions import map_by
from test_cli import limits_and_sets
from test_crash_points import disk, goes_on  # noqa: F401
from test_inputs import first_page, help_lines
from test_outputs import elliptic_row, record  # noqa: F401
from test_plasticity import (
    FORCE,
    loaded_sphere,  # noqa: F401
)
from test_regression import case_names, case_row, position_row, refuse_comparison, rows_of_frame, write_study
from test_sources import EVALUATING
from test_springs_in_tables import LOAD_N, position
from test_static_roll import ALONE, WAYS, WHEELSET, rolls
from test_study import case as loaded_case
from test_study import dask_cluster, wait_until
from test_theories import another, judged_result  # noqa: F401

import fecontact
from fecontact.case import INPUTS, Case, Opposite
from fecontact.cli import call
from fecontact.contact_theories.registry import HERTZ, MULTI_HERTZ
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.files import SEAL_KEY, write_json, write_sealed
from fecontact.jobs.engine import RunSettings
from fecontact.maps.load_limits import find_load_limit
from fecontact.maps.model import ApplicabilityMap, LoadLimit, MapCell, MapPosition, build_cell_row
from fecontact.maps.picture import draw_map, save_map_figure
from fecontact.maps.positions import build_failed_position, build_solved_cell
from fecontact.maps.report import write_map_report
from fecontact.maps.telling import MAP_SCHEMA, build_map_record
from fecontact.maps.text_map import format_map_table
from fecontact.maps.verdict_views import build_verdict_view
from fecontact.maps.views import format_map
from fecontact.outputs.case_words import other_wheel_label, roll_words, shift_label
from fecontact.outputs.records.results import case_inputs, load_record, load_row
from fecontact.outputs.tables import write_csv
from fecontact.regression.compare import compare_tables
from fecontact.regression.tables import find_kind, load_table
from fecontact.runs.folder import prepare_for_study
from fecontact.runs.identity import make_case_id
from fecontact.runs.map_run import prepare_for_map, run_map

# springs


@pytest.fixture(scope="module")
def springs():
    """Placements for springs.

    At 5 mm the wheel touches the top of the head and the gauge corner, at -4 mm a single point.
    """
    positions = []
    for shift in (-4.0, 5.0):
        load, placement = position(shift)
        cells = (build_solved_cell(shift, load),)
        positions.append(
            MapPosition(lateral_shift_mm=shift, cells=cells, limit=find_load_limit(cells), placement=placement)
        )
    return ApplicabilityMap(
        case=replace(load.case, lateral_shift_mm=0.0), loads_N=(LOAD_N,), positions=tuple(positions)
    )


@pytest.mark.slow
def test_a_map_marks_where_springs_hold_and_one_ellipse_does_not(springs, monkeypatch, tmp_path):
    lines = format_map_table(build_verdict_view(springs)).splitlines()
    assert lines[1].split()[1] == "+"
    assert "*" in lines[2]
    assert "*" not in lines[1]
    assert any(line.startswith("* Hertz at all contact points") for line in lines)
    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    save_map_figure(build_verdict_view(springs), "unused.png")
    (ax,) = figures[0].axes
    marks = [line for line in ax.get_lines() if line.get_marker() == "D"]
    assert [line.get_xdata()[0] for line in marks] == [pytest.approx(5.0, abs=0.6)]
    assert "Hertz at all contact points, as springs, holds" in [
        text.get_text() for text in ax.figure.legends[0].get_texts()
    ]
    record = build_map_record(springs)["cells"]
    assert [cell["theories"][MULTI_HERTZ] is not None for cell in record] == [False, True]
    theory = record[1]["theories"][MULTI_HERTZ]
    assert theory["verdict"]["answer"] == "HOLDS"
    forces = [patch["normal_force_N"] * math.cos(patch["contact_angle_rad"]) for patch in theory["patches"]]
    assert sum(forces) == pytest.approx(LOAD_N, rel=1e-9)
    text = write_map_report(springs, tmp_path).read_text("utf-8")
    page = ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))
    tables = [
        [["".join(cell.itertext()) for cell in line] for line in patch.iter("tr")] for patch in page.iter("table")
    ]
    (rows,) = (rows for rows in tables if rows[0][-1] == "cheapest theory that holds")
    assert [line[-1] for line in rows[1:]] == ["Hertz", "Hertz at all contact points, as springs"]


def test_a_further_theory_is_in_maps(judged_result, tmp_path):
    load, case = judged_result.load, judged_result.case
    cells = (build_solved_cell(0.0, load),)
    position = MapPosition(
        lateral_shift_mm=0.0, cells=cells, limit=find_load_limit(cells), placement=judged_result.placement
    )
    block_map = ApplicabilityMap(case=case, loads_N=(case.load_N,), positions=(position,))
    (cell,) = json.loads(json.dumps(build_map_record(block_map)))["cells"]
    assert [name for name in cell["theories"] if name in (HERTZ, "block")] == [HERTZ, "block"]
    assert "cheapest" in write_map_report(block_map, tmp_path).read_text("utf-8")
    text_lines = format_map(block_map, "pressure", theory="block").splitlines()
    assert text_lines[1].split()[1].startswith("x")


@pytest.mark.slow
def test_a_map_draws_loads_of_first_yield_and_of_plasticity(loaded_sphere):
    load = loaded_sphere.load
    position = MapPosition(
        lateral_shift_mm=0.0, cells=(build_solved_cell(0.0, load),), limit=LoadLimit(reason="one load")
    )
    yielding_map = ApplicabilityMap(case=loaded_sphere.case, loads_N=(FORCE,), positions=(position,))
    first, limit = load.plastic.yielded.first_yield_N, load.plastic.plastic_load_N
    assert position.yield_loads_N == {"first_yield_N": first, "plastic_load_N": limit}
    view = build_verdict_view(yielding_map)
    assert [load_kN for load_kN, _ in view.columns[0].lines] == [first / 1e3, limit / 1e3]
    assert any("without shakedown, residual stress, friction and repeated passes" in note for note in view.notes)
    assert build_map_record(yielding_map)["yield_loads_N"] == [{"lateral_shift_mm": 0.0, **position.yield_loads_N}]


# how the wheelset rolls


@pytest.mark.parametrize(
    ("case", "left_letter", "right_letter"),
    [
        (WHEELSET, "left wheel: lateral", "right wheel: lateral"),
        (replace(WHEELSET, side="right"), "right wheel: lateral", "left wheel: lateral"),
        (replace(WHEELSET, yaw_rad=5e-3), "left wheel: lateral", "right wheel at the opposite yaw: lateral"),
        (replace(WHEELSET, opposite=Opposite(rolling_radius_mm=459.0)), "left wheel: lateral", None),
        (ALONE, "lateral", None),
        (replace(ALONE, side="right"), "right wheel: lateral", None),
    ],
)
def test_a_map_of_a_symmetric_wheelset_is_both_wheels(case, left_letter, right_letter, monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    cells = [MapCell(lateral_shift_mm=shift, load_N=1e5, status="failed: for a test") for shift in (-2.0, 3.0)]
    positions = tuple(
        MapPosition(lateral_shift_mm=cell.lateral_shift_mm, cells=(cell,), limit=find_load_limit([cell]))
        for cell in cells
    )
    wheelset_map = ApplicabilityMap(case=case, loads_N=(1e5,), positions=positions)
    save_map_figure(build_verdict_view(wheelset_map), "unused.png")
    (ax,) = figures[0].axes
    assert ax.get_xlabel().startswith(left_letter)
    # lines of nearly equal lengths, none with a single word
    assert min(len(line.split()) for line in ax.get_xlabel().split("\n")) > 1
    assert roll_words(case) in figures[0].legends[0].get_title().get_text()
    assert build_map_record(wheelset_map)["roll"] == roll_words(case)
    assert ("read the opposite shift" in format_map_table(build_verdict_view(wheelset_map))) == (
        right_letter is not None
    )
    assert (other_wheel_label(case) is None) == (right_letter is None)
    assert [second.get_xlabel()[: len(right_letter or "")] for second in ax.child_axes] == [right_letter] * (
        right_letter is not None
    )
    for second in ax.child_axes:
        figures[0].draw_without_rendering()
        # the wheel on the right stands at -3 mm as the one on the left at 3 mm
        right_px, left_px = (axis.transData.transform((at, 0.0))[0] for axis, at in ((ax, 3.0), (second, -3.0)))
        assert left_px == pytest.approx(right_px)
        towards = ["positive" in label for label in (shift_label(case), second.get_xlabel())]
        assert sorted(towards) == [False, True]


def test_lines_of_a_map_follow_the_settings_of_matplotlib():
    cell = MapCell(lateral_shift_mm=0.0, load_N=1e5, status="failed: for a test")
    position = MapPosition(lateral_shift_mm=0.0, cells=(cell,), limit=find_load_limit([cell]))
    view = build_verdict_view(ApplicabilityMap(case=Case(), loads_N=(1e5,), positions=(position,)))
    (column,) = view.columns
    view = replace(view, columns=(replace(column, solved_kN=(100.0,)),))
    widths = []
    for width in (1.5, 0.75):
        with rc_context({"lines.linewidth": width}):
            figure = draw_map(view, numbers=False)
        widths.append({line.get_linewidth() for line in figure.axes[0].get_lines()})
    # ticks of the solved load
    assert widths == [{1.0}, {0.5}]


def test_a_map_has_one_roll_for_all_its_loads(tmp_path):
    for case in (Case(roll="loaded"), Case(opposite=Opposite(wheel_load_N=6e4))):
        with pytest.raises(InputError, match=r"the same roll.*roll_load_kN \(--roll-load-kn\), such as 50"):
            run_map(case, [0.0], [2e4, 5e4, 1e5], tmp_path)


def test_a_map_says_under_which_load_its_wheelset_rolls(tmp_path, monkeypatch):
    def opened(*_):
        raise InputError("the run begins")

    monkeypatch.setattr("fecontact.runs.map_run.open_run", opened)
    case = Case(roll_load_N=8e4, opposite=Opposite(wheel_load_N=6e4))
    with pytest.raises(InputError, match="the run begins"):
        run_map(case, [0.0], [2e4, 1e5], tmp_path)
    failed_map = ApplicabilityMap(
        case=case, loads_N=(2e4,), positions=(build_failed_position(0.0, (2e4,), "for a test"),)
    )
    assert (
        build_map_record(failed_map)["roll"]
        == "roll of the wheelset under 80 kN on its left wheel, 60 kN on its right wheel"
    )


# the command, and its folder


def test_a_map_says_what_it_takes_before_it_begins(tmp_path, monkeypatch, capsys):
    estimates_seen = []

    def stopped(*arguments, **keywords):
        estimates_seen.append(capsys.readouterr().err)
        raise InputError("that was before it")

    monkeypatch.setattr("fecontact.runs.map_run.run_map", stopped)
    arguments = ["map", "--shifts=-4,3", "--loads-kn", "50,100", "--out", str(tmp_path / "map"), "--workers", "1"]
    for options in ((), ("--friction", "0.3"), ("--quiet",)):
        assert call([*arguments, *options]) == 2
        capsys.readouterr()
    estimate, with_forces, quiet = estimates_seen
    # 9.5 CPU s with files, pictures and report
    assert "4 cells: about 10 s with 1 worker and 0.3 GB per worker" in estimate
    assert "creep forces" not in estimate
    assert re.search(r"; creep forces take about \d+ s more", with_forces)
    assert quiet == ""
    assert (tmp_path / "map" / "run.log").read_text("utf-8").count("4 cells: about 10 s") == 3


@pytest.mark.parametrize(("option", "instead"), [("--shift", "--shifts"), ("--load-kn", "--loads-kn")])
def test_a_map_refuses_what_it_has_lists_of_and_names_them(option, instead, capsys, tmp_path):
    assert call(["map", "--shifts", "0", option, "2", "--out", str(tmp_path)]) == 2
    assert f"Did you mean {instead}?" in capsys.readouterr().err


def test_a_map_goes_on_with_more_shifts_and_friction_and_loses_no_cell_of_another(tmp_path):
    base, shifts, loads = Case(lateral_shift_mm=2.0, roll="touching"), [-4.0, 0.0, 4.0], [50e3, 100e3]
    record = {"case": json.loads(json.dumps(fecontact.hertz(base)["case"]))}
    record |= {"lateral_shifts_mm": shifts, "loads_N": loads}
    (tmp_path / "map.json").write_text(json.dumps(record))
    friction = fecontact.Creep(friction=0.3)
    for same in (base, replace(base, load_N=50e3, lateral_shift_mm=0.0), replace(base, creep=friction)):
        prepare_for_map(tmp_path, same, [*shifts, 5.0], loads[::-1])
    variants = [replace(base, rail="54E1"), replace(base, resolution="fine"), replace(base, roll="given")]
    for request in (
        *[(variant, shifts, loads) for variant in variants],
        (base, shifts[1:], loads),
        (base, shifts, loads[1:]),
    ):
        with pytest.raises(InputError, match="a different map"):
            prepare_for_map(tmp_path, *request)
        prepare_for_map(tmp_path, *request, force=True)


# compared, and looked up by others


def test_a_map_is_matched_by_shift_and_load(tmp_path, capsys):
    head = (
        "lateral_shift_mm,load_kN,status,verdict_answer,cause,fe_p_max_MPa,hertz_stiffness_N_per_mm15,solver_meshes\n"
    )
    texts = [
        "-0.5,50.0,converged,HOLDS,,900.0,3e6,2\n",
        "0.0,50.0,converged,FAILS,second patch,950.0,3e6,2\n",
    ]
    (tmp_path / "was").mkdir()
    (tmp_path / "was" / "map.csv").write_text(head + "".join(texts))
    # in another order, with fewer digits
    now = [
        texts[1].replace("second patch,950.0", "conformity,950.1").replace(",2\n", ",3\n"),
        texts[0].replace("-0.5,50.0", "-0.50,50"),
    ]
    (tmp_path / "now.csv").write_text(head + "".join(now))
    comparison = compare_tables(load_table(tmp_path / "was"), load_table(tmp_path / "now.csv"))
    assert list(case_names(comparison).values()) == ["-0.5 mm, 50 kN", "+0 mm, 50 kN"]
    assert {(d.column, d.case) for d in rows_of_frame(comparison.differences)} == {
        ("cause", "lateral_shift_mm 0, load_kN 50"),
        ("fe_p_max_MPa", "lateral_shift_mm 0, load_kN 50"),
    }
    study = write_study(tmp_path / "study", [case_row()])
    assert call(["compare", str(tmp_path / "was"), str(study)]) == 2
    assert "no case in common (such as lateral_shift_mm -0.5, load_kN 50 and one)" in capsys.readouterr().err


def test_a_map_is_compared_with_a_study_by_shift_and_load(tmp_path, capsys):
    cells = [{"lateral_shift_mm": 0.0, "load_kN": at, "status": "converged", "fe_area_mm2": 120.0} for at in (50, 100)]
    (tmp_path / "map").mkdir()
    write_csv([cell | {"fe_patch_count": 1} for cell in cells], tmp_path / "map" / "map.csv")
    study = write_study(tmp_path / "study", [position_row(0.0, 50.0), position_row(0.0, 100.0, fe_area_mm2=132.0)])
    err = refuse_comparison(capsys, tmp_path / "map", study)
    assert "no case in common" in err
    assert ", or match the cases by inputs with --match shift,load (2 in common)" in err
    for pair in ((tmp_path / "map", study), (study, tmp_path / "map")):
        comparison = compare_tables(*map(load_table, pair), match=["shift", "load"])
        assert comparison.cases == [f"lateral_shift_mm 0, load_kN {load}" for load in (50, 100)]
        assert [c.column for c in rows_of_frame(comparison.columns)] == ["fe_area_mm2", "status"]
        assert [(d.column, d.case) for d in rows_of_frame(comparison.differences)] == [
            ("fe_area_mm2", "lateral_shift_mm 0, load_kN 100")
        ]
        one_sided = {name for names in comparison.one_sided.values() for name in names}
        assert one_sided == {"fe_patch_count", "rail", "wheel", "roll_mrad", "resolution", "fe_p_max_MPa"}
    # without the shift a map has each load once for each shift
    write_csv([*cells, cells[0] | {"lateral_shift_mm": 1.0}], tmp_path / "map" / "map.csv")
    err = refuse_comparison(capsys, tmp_path / "map", study, "--match", "load")
    assert "are both load_kN 50" in err
    assert "in which they differ: lateral_shift_mm" in err


def test_every_column_of_a_map_is_known(elliptic_quick):
    cell = build_solved_cell(0.0, elliptic_quick.load)
    columns = list(build_cell_row(cell, elliptic_quick.placement))
    assert len(columns) > 60
    assert [name for name in columns if find_kind(name) == "default"] == []


@pytest.fixture
def stored(tmp_path):
    """A map of two cells with planted verdicts, written as by `fecontact map`."""

    def write(case):
        verdicts = [
            ("HOLDS", {"cheapest_theory": "hertz", "strip_verdict_answer": "HOLDS"}),
            ("FAILS", {"cheapest_theory": "strip", "strip_verdict_answer": "UNRESOLVED"}),
        ]
        cells = [
            {"lateral_shift_mm": -4.0, "load_kN": load, "status": "converged", "verdict_answer": verdict, **entries}
            for load, (verdict, entries) in zip((50.0, 100.0), verdicts, strict=True)
        ]
        folder = tmp_path / "map"
        folder.mkdir()
        write_csv(cells, folder / "map.csv")
        document = {"schema": MAP_SCHEMA, "case": case_inputs(case), "cells": []}
        write_sealed(folder / "map.json", document, [folder / "map.csv"])
        return folder

    return write


def test_the_verdicts_of_a_stored_map_are_added_where_shift_and_load_are_the_same(stored):
    # criteria, meshes and yield stress say nothing of which contact it is
    folder = stored(replace(WHEELSET, resolution="fine", criteria=Criteria(p_max=0.01)))
    rows = fecontact.table(WHEELSET, [-4.0, -3.99], [50e3, 100e3], map_folder=folder)
    map_columns = [(row["map_status"], row["map_cheapest_theory"], row["map_hertz_verdict"]) for row in rows]
    assert map_columns[:2] == [("converged", "hertz", "HOLDS"), ("converged", "strip", "FAILS")]
    # beside it nothing is taken over
    assert map_columns[2:] == [("not in the map", None, None)] * 2
    assert [row["map_strip_verdict"] for row in rows] == ["HOLDS", "UNRESOLVED", None, None]


def test_a_map_whose_seal_is_gone_is_refused(stored):
    folder = stored(WHEELSET)
    document = json.loads((folder / "map.json").read_text())
    assert len(load_table(folder).rows) == 2
    write_json(folder / "map.json", {name: value for name, value in document.items() if name != SEAL_KEY})
    with pytest.raises(InputError, match="its checksum differs"):
        load_table(folder)


def test_a_map_of_another_contact_is_refused(stored, capsys):
    folder = stored(replace(WHEELSET, rail="60E2"))
    with pytest.raises(InputError, match="rail '60E2' in the map, '60E1' given"):
        fecontact.table(WHEELSET, [-4.0], [50e3], map_folder=folder)
    text = (folder / "map.csv").read_text("utf-8")
    (folder / "map.csv").write_text(text.replace("HOLDS", "FAILS"), "utf-8")
    with pytest.raises(InputError, match=r"map\.csv"):
        fecontact.table(replace(WHEELSET, rail="60E2"), [-4.0], [50e3], map_folder=folder)
    assert call(["table", "--shifts", "0", "--map", str(folder / "none")]) == 2
    with pytest.raises(InputError, match="at least one lateral shift"):
        fecontact.table(WHEELSET, [], [50e3])


@pytest.fixture
def mapped(tmp_path):
    """A map as `fecontact map` writes it.

    Beyond 4.5 mm Hertz fails, and ANALYN holds out of its range.
    """

    def write(case: Case, intervals_beyond: Sequence[tuple[float, float, str]] = ((50e3, 70e3, "FAILS"),)) -> Path:
        cells = [
            {
                "lateral_shift_mm": float(shift),
                "load_kN": load,
                "verdict_answer": "HOLDS" if shift < 4.5 else "FAILS",
                "cheapest_theory": "hertz" if shift < 4.5 else "analyn",
                "cheapest_theory_status": "solved" if shift < 4.5 else "out of range",
            }
            for shift in range(-6, 7)
            for load in (50.0, 70.0)
        ]
        write_csv(cells, tmp_path / "map.csv")
        names, everywhere = ("low_N", "high_N", "answer"), ((50e3, 70e3, "HOLDS"),)
        limits = [
            {
                "lateral_shift_mm": float(shift),
                "intervals": [
                    dict(zip(names, interval, strict=True))
                    for interval in (everywhere if shift < 4.5 else intervals_beyond)
                ],
                "tried": [],
            }
            for shift in range(-6, 7)
        ]
        document = {"schema": MAP_SCHEMA, "case": case_inputs(case), "cells": [], "limits": limits}
        document["lateral_shifts_mm"] = [interval["lateral_shift_mm"] for interval in limits]
        write_sealed(tmp_path / "map.json", document, [tmp_path / "map.csv"])
        return tmp_path

    return write


def test_the_command_writes_tables_and_pictures_and_finds_wheels_on_a_map(mapped, tmp_path, capsys):
    pytest.importorskip("fecontact.features.curves")
    folder = mapped(Case(roll="touching"))
    arguments = ["curve", "--vehicle", "wheelset", "--radii", "400,1000", "--theory", "overlap,kik_piotrowski"]
    code = call([*arguments, "--map", str(folder), "--shares", "1,3", "--out", str(tmp_path / "out"), "--json"])
    record = json.loads(capsys.readouterr().out)
    assert code == 0
    assert [curve["radius_m"] for curve in record["curves"]] == [400.0, 1000.0] * 2
    wheels = record["curves"][0]["wheelsets"][0]["wheels"]
    assert [wheel["side"] for wheel in wheels] == ["left", "right"]
    assert len(wheels[0]["patches"]) == 2
    # at R 400 the left wheel is at 4.9 mm and fails, the right one at -4.9; at R 1000 both hold
    assert record["visited_percent"]["overlap"] == pytest.approx({"HOLDS": 87.5, "FAILS": 12.5})
    assert record["cheapest_theory_percent"]["overlap"] == pytest.approx({"hertz": 87.5, "analyn (out of range)": 12.5})
    assert [track["theory"] for track in record["straight_track"]] == ["overlap", "kik_piotrowski"]
    for name in ("curve.csv", "curve.json", "curve.png", "curve_map.png"):
        assert (tmp_path / "out" / name).stat().st_size > 500
    page = ElementTree.fromstring(
        (tmp_path / "out" / "report.html").read_text("utf-8").removeprefix("<!DOCTYPE html>\n")
    )
    (headline,) = (heading.text for heading in page.iter("h1"))
    assert headline.startswith("Verdicts on Hertz over the distance of all wheels: ")
    assert "87.5 %" in headline.partition("(overlap)")[0]
    assert len([*page.iter("img")]) == 2
    assert call([*arguments, "--map", str(tmp_path / "out")]) == 2
    assert "map.json" in capsys.readouterr().err
    assert call([*arguments, "--map", str(folder), "--rail", "60E2"]) == 2
    assert "the map of a different contact (rail '60E1' in the map, '60E2' given)" in capsys.readouterr().err
    assert call([*arguments, "--shares", "1"]) == 2
    assert "number of shares is 1; allowed: 2, a share >= 0 for each radius" in capsys.readouterr().err


def test_a_wheel_on_a_map_has_the_verdict_of_the_load_limits_and_none_beside_what_was_solved(mapped):
    pytest.importorskip("fecontact.features.curves")

    def visited(intervals_beyond: Sequence[tuple[float, float, str]]) -> Mapping[str, float]:
        case = Case(roll="touching")
        curves_found = fecontact.curve("wheelset", [400.0], case=case, map_folder=mapped(case, intervals_beyond))
        (load_kN,) = [1e-3 * visit.vertical_force_N for visit in curves_found.visits if visit.lateral_shift_mm > 4.5]
        assert 61.0 < load_kN < 62.0
        return curves_found.shares("overlap", "verdict")

    # the cells at 50 and 70 kN fail in each of these maps
    assert visited([(50e3, 65e3, "HOLDS"), (65e3, 70e3, "FAILS")]) == {"HOLDS": 1.0}
    assert visited([(50e3, 61e3, "HOLDS"), (61e3, 65e3, "UNRESOLVED"), (65e3, 70e3, "FAILS")]) == {
        "between": 0.5,
        "HOLDS": 0.5,
    }
    assert visited([(65e3, 70e3, "FAILS")]) == {"not on the map": 0.5, "HOLDS": 0.5}


@pytest.mark.slow
def test_a_dask_worker_that_is_killed_during_a_map_costs_no_cell(tmp_path):
    out, shifts = tmp_path / "out", [-1.0, 0.0, 1.0]
    out.mkdir()
    path = os.pathsep.join([*(str(folder) for folder in Path(__file__).parents[:2]), os.environ.get("PYTHONPATH", "")])
    with dask_cluster(tmp_path, 2, PYTHONPATH=path) as (address, processes), ThreadPoolExecutor(1) as runner:
        settings = RunSettings(scheduler=address)
        work = partial(positions.FakePosition, seconds=1.0)
        running = runner.submit(map_by, loaded_case(50), shifts, [50e3], out, settings=settings, work=work)
        wait_until(lambda: len(fake_solve.solves(out)) >= 2 or running.done())
        processes[0].kill()
        map_made = running.result(timeout=60).made
    assert map_made.lateral_shifts_mm == tuple(shifts)
    assert {cell.status for cell in map_made.cells} <= {
        f"failed: planned in process {process.pid}" for process in processes
    }
    # that of the worker that was killed once more
    assert sorted({*map(float, fake_solve.solves(out))}) == shifts
    assert len(fake_solve.solves(out)) <= len(shifts) + 1
    assert {path.name for path in (out / "positions").iterdir()} == {
        make_case_id(replace(loaded_case(50), lateral_shift_mm=shift), [50e3]) for shift in shifts
    }


def run_fake_map(out: Path) -> None:
    map_by(replace(loaded_case(50)), [0.0, 1.0], [50e3], out, crew=inline_crew(), work=positions.FakePosition)


def test_a_load_says_the_same_in_a_case_and_in_a_map(record, elliptic_row, elliptic_quick):
    own_record = load_record(elliptic_quick.load)
    assert {key: record[key] for key in own_record if key != "solver"} == {
        k: v for k, v in own_record.items() if k != "solver"
    }
    assert {key: record["solver"][key] for key in own_record["solver"]} == own_record["solver"]
    assert set(record["solver"]) - set(own_record["solver"]) == {
        *("path", "seconds", "cpu_seconds", "memory_MB", "peak_memory_MB")
    }
    row = load_row(elliptic_quick.load, elliptic_quick.placement)
    assert {key: elliptic_row[key] for key in row} == row
    assert not set(MEASURED_COLUMNS) & set(row)


def test_a_map_that_ends_at_any_file_operation_goes_on(disk, monkeypatch):
    monkeypatch.setattr("fecontact.maps.files.save_map_figure", lambda *arguments: None)
    monkeypatch.setattr("fecontact.runs.map_run.write_result_report", lambda *arguments, **keywords: None)
    goes_on(disk, run_fake_map)


def test_importing_what_writes_a_map_loads_no_plotting():
    check = (
        "import sys, fecontact.maps.files; print(*sorted({'vtk', 'pyvista', 'matplotlib', 'gmsh'} & set(sys.modules)))"
    )
    completed = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert completed.stdout.strip() == ""


def test_what_judges_a_map_is_in_a_digest():
    assert {"maps.model", "runs.map_positions"} <= EVALUATING


def test_maps_have_a_function_a_module_and_results(tmp_path):
    importlib.import_module("fecontact.maps.model")
    assert "lateral_shifts_mm" in inspect.signature(fecontact.map).parameters
    with pytest.raises(InputError, match="at least one lateral shift"):
        fecontact.map(Case(), [], [], tmp_path)
    for function in (partial(fecontact.map, out=tmp_path), fecontact.table):
        with pytest.raises(InputError, match=r"lateral_shifts_mm is -3; give a list, for example \[-3\]"):
            function(Case(), -3, [100e3])
        with pytest.raises(InputError, match=r"loads_N is 100000\.0; give a list"):
            function(Case(), [-3.0], 100e3)
    with pytest.raises(InputError, match=r"no result\.json or study\.json or map\.json"):
        fecontact.load(tmp_path)


def test_the_command_has_help_as_others_have(capsys, monkeypatch):
    limits_and_sets("map", capsys)
    first_page("map", "--shifts", capsys, monkeypatch)
    options_shown = {word for line in help_lines("map") for word in line.split()[:2] if word.startswith("--")}
    option_names = {name for slot in INPUTS if slot.group != "profiles" for name in (*slot.names, *slot.common_names)}
    assert options_shown & option_names == option_names - {"--shift", "--lateral-shift-mm", "--load-kn"}


def test_what_is_not_usual_and_what_it_takes_are_said_before_it_begins(tmp_path, capsys, monkeypatch):
    def begun(*_, **__):
        raise InputError("begun")

    monkeypatch.setattr("fecontact.runs.map_run.run_map", begun)
    assert call(["map", "--shifts", "0", "--loads-kn", "50,1e5", "--out", str(tmp_path / "out")]) == 2
    note, cost, error = capsys.readouterr().err.splitlines()
    assert note.startswith("note: load is 100000 kN; usual: 1 to 1000")
    assert cost.startswith("2 cells: ")
    assert error == "error: begun"


@pytest.mark.parametrize(("options", "case"), slow_but(WAYS, 0, 8, 9))
def test_the_command_rolls_its_wheelset(options, case, monkeypatch, tmp_path):
    rolls("fecontact.runs.map_run.run_map", ["map", "--shifts", "0", "--out"], options, case, monkeypatch, tmp_path)


def test_a_map_does_not_take_the_folder_of_other_results(tmp_path):
    (tmp_path / "row.json").write_text('{"row": {"id": "one"}}')
    for refused_ in (
        lambda: prepare_for_map(tmp_path, Case(), [0.0], [1e5]),
        lambda: fecontact.map(Case(), [0.0], [1e5], tmp_path),
    ):
        with pytest.raises(InputError, match=r"case \(row\.json\), which would be overwritten"):
            refused_()
    (tmp_path / "row.json").rename(tmp_path / "map.json")
    with pytest.raises(InputError, match="which would be overwritten"):
        prepare_for_study(tmp_path, "mine")
