"""Every input of a case by Python, by a file and on the command line.

All three give equal cases and equal refusals.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, get_args

import pytest

from fecontact.case import INPUTS, PARTS, Case, Criteria, Group, Opposite, Track, make_case_record, read_case_record
from fecontact.cli import app, call
from fecontact.errors import InputError
from fecontact.guide.pages import read_page
from fecontact.inputs.slots import InputPlace
from fecontact.inputs.texts import FORMER_NAMES, format_inclination, parse_inclination
from fecontact.placement.irregularity import Irregularity
from fecontact.runs.casefile import load_study


@dataclasses.dataclass(frozen=True)
class Row:
    """A value as typed by a user and as stored in the case.

    A bad value has both forms too. The other fields are unit, range and default in the help.
    """

    key: str
    option: str
    written: Any
    held: Any
    bad_written: Any
    bad_held: Any
    refusal: str
    help: str


def length(key: str, value: float, default: str, option: str = "") -> Row:
    option = option or "--" + key.replace("_", "-")
    return Row(
        key, option, value, value, 0, 0.0, "is 0.0 mm; allowed: finite and > 0", f": mm, finite and > 0; {default}"
    )


def creepage(key: str, option: str, label: str) -> Row:
    return Row(
        key, option, -2e-3, -2e-3, 1.5, 1.5, f"{label} is 1.5; allowed: -1 to 1; give it relative to the rolling speed",
        ": no unit, -1 to 1; default none",
    )  # fmt: skip


def material(body: str) -> dict[tuple[str, str], Row]:
    """Rows of the inputs of a material."""
    table = f"{body}_material"
    positive = "allowed: finite and > 0"
    return {
        (table, "young_MPa"): Row(
            "young_MPa", f"--{body}-young-mpa", 206e3, 206e3, -1, -1.0, f"Young's modulus is -1.0 MPa; {positive}",
            ": MPa, finite and > 0; default 210000",
        ),
        (table, "poisson"): Row(
            "poisson", f"--{body}-poisson", 0.28, 0.28, 0.5, 0.5, "Poisson's ratio is 0.5; allowed: -1 < nu < 0.5",
            ": no unit, -1 < nu < 0.5; default 0.3",
        ),
        (table, "yield_MPa"): Row(
            "yield_MPa", f"--{body}-yield-mpa", 500, 500.0, 0, 0.0, f"yield stress is 0.0 MPa; {positive}",
            ": MPa, finite and > 0; default none",
        ),
        (table, "tangent_MPa"): Row(
            "tangent_MPa", f"--{body}-tangent-mpa", 4200, 4200.0, -1, -1.0,
            "tangent modulus is -1.0 MPa; allowed: 0 to 500000 MPa", ": MPa, 0 to 500000; default 0",
        ),
    }  # fmt: skip


def angle(key: str) -> Row:
    return Row(
        key, "--" + key.replace("_", "-"), 9, 0.009, 200, 0.2,
        "is 0.2 rad (200 mrad); allowed: -0.1 to 0.1 rad (-100 to 100 mrad)", ": mrad, -100 to 100; default 0",
    )  # fmt: skip


def limit(key: str, measure: str, default: str) -> Row:
    return Row(
        key, "--" + key.replace("_", "-"), 7, 0.07, 120, 1.2,
        f"limit of {measure} is 1.2 (120 %); allowed: between 0 and 1 (between 0 and 100 %);"
        f" for example {float(default) / 100:g} for {default} %",
        f": %, between 0 and 100; default {default}",
    )  # fmt: skip


def file(body: str) -> dict[tuple[str, str], Row]:
    """Rows of the inputs of a profile file."""
    table = f"{body}_file"
    return {
        (table, "units"): Row(
            "units", f"--{body}-units", "m", "m", "furlong", "furlong",
            "unit of the profile file is 'furlong'; allowed: mm, m, cm, um, in", ": mm, m, cm, um, in; default none",
        ),
        (table, "mirror"): Row(
            "mirror", f"--{body}-mirror", True, True, "perhaps", "perhaps",
            "mirror is 'perhaps'; allowed: yes or no, true or false", ": yes or no; default none",
        ),
        (table, "columns"): Row(
            "columns", f"--{body}-columns", "2,3", "2,3", " ", " ", "columns is ' '; allowed", "default none",
        ),
        (table, "tape_circle_mm"): Row(
            "tape_circle_mm", f"--{body}-tape-circle-mm", 70, 70.0, 2000, 2000.0,
            "tape circle is 2000.0 mm; allowed: -1000 to 1000 mm", ": mm, -1000 to 1000; default none",
        ),
        (table, "tape_circle_z_mm"): Row(
            "tape_circle_z_mm", f"--{body}-tape-circle-z-mm", 1.5, 1.5, 2000, 2000.0,
            "height of the tape circle is 2000.0 mm; allowed: -1000 to 1000 mm", ": mm, -1000 to 1000; default none",
        ),
        (table, "noise_mm"): Row(
            "noise_mm", f"--{body}-noise-mm", 0.01, 0.01, 2, 2.0, "noise is 2.0 mm; allowed: between 0 and 1",
            ": mm, between 0 and 1; default none",
        ),
        (table, "filter_mm"): Row(
            "filter_mm", f"--{body}-filter-mm", 12, 12.0, -1, -1.0,
            "filter length is -1.0 mm; allowed: 0 to 1000 mm", ": mm, 0 to 1000; default none",
        ),
        (table, "nominal"): Row(
            "nominal", f"--{body}-nominal", "none", "none", "", "", "nominal profile is ''; allowed", "default auto",
        ),
        (table, "repair"): Row(
            "repair", f"--{body}-repair", True, True, "maybe", "maybe",
            "repair is 'maybe'; allowed: yes or no", ": yes or no; default no",
        ),
        (table, "section"): Row(
            "section", f"--{body}-section", 2, 2.0, 0, 0.0,
            "number of the profile is 0.0; allowed: whole numbers from 1 to 10000",
            ": no unit, whole numbers from 1 to 10000; default none",
        ),
    }  # fmt: skip


def irregularity(body: str) -> Row:
    text = "sine:wavelength_mm=30,amplitude_um=25"
    return Row(
        f"{body}_irregularity", f"--{body}-irregularity", text,
        Irregularity(kind="sine", wavelength_mm=30.0, amplitude_mm=0.025), "", "", "",
        "or table:FILE,distance=mm,opening=um; default none",
    )  # fmt: skip


SETS = "sets strength, patch, all; measures p_max, area, a, b, centre, valley, separate, misplaced; separated by commas"


OPPOSITE = ": one or more of rail=...,wheel=...,rolling-radius-mm=...,load-kn=...; default none."
# by table and field; written down a second time on purpose, with the units that users know
ROWS: dict[tuple[str, str], Row] = {
    ("", "rail"): Row("rail", "--rail", "54E1", "54E1", "", "", "rail is ''; allowed", "; R and D in mm; default 60E1"),
    ("", "wheel"): Row("wheel", "--wheel", "CONE20", "CONE20", "", "", "wheel is ''; allowed", "mm; default S1002"),
    ("", "inclination_rad"): Row(
        "inclination", "--inclination", "1:20", math.atan(1 / 20), "500mrad", 0.5,
        "inclination is 0.5 rad (500 mrad); allowed: -0.35 to 0.35 rad (-350 to 350 mrad)",
        "1.43deg; mrad, -350 to 350; default 1:40",
    ),
    ("", "rail_irregularity"): irregularity("rail"),
    ("", "wheel_irregularity"): irregularity("wheel"),
    ("", "distance_mm"): Row(
        "distance_mm", "--distance-mm", 12.5, 12.5, 2e7, 2e7,
        "distance is 20000000.0 mm; allowed: -10000000 to 10000000 mm", ": mm, -10000000 to 10000000; default 0",
    ),
    ("", "lateral_shift_mm"): Row(
        "lateral_shift_mm", "--shift", -2.5, -2.5, 61, 61.0, "lateral shift is 61.0 mm; allowed: -60 to 60 mm",
        ": mm, -60 to 60; default 0",
    ),
    ("", "roll_rad"): angle("roll_mrad"),
    ("", "yaw_rad"): angle("yaw_mrad"),
    ("", "roll"): Row(
        "roll", "--roll", "given", "given", "tuching", "tuching",
        "roll is 'tuching'; allowed: touching, given, loaded; did you mean touching?",
        ": touching, given, loaded; default touching",
    ),
    ("", "roll_load_N"): Row(
        "roll_load_kN", "--roll-load-kn", 80, 80e3, -5, -5000.0,
        "roll load is -5000.0 N (-5 kN); allowed: 1 to 1000000000 N (0.001 to 1000000 kN); give the wheel load that",
        ": kN, 0.001 to 1000000; default none",
    ),
    ("", "flange_climb"): Row(
        "flange_climb", "--flange-climb", True, True, "perhaps", "perhaps",
        "flange climb is 'perhaps'; allowed: yes or no, true or false", "; default no",
    ),
    ("", "side"): Row(
        "side", "--side", "right", "right", "rigth", "rigth",
        "side is 'rigth'; allowed: left, right; did you mean right?", ": left, right; default left",
    ),
    ("opposite", "rail"): Row(
        "rail", "--opposite", "54E1", "54E1", "", "", "opposite rail is ''; allowed", OPPOSITE
    ),
    ("opposite", "wheel"): Row(
        "wheel", "--opposite", "CONE20", "CONE20", "", "", "opposite wheel is ''; allowed", OPPOSITE
    ),
    ("opposite", "rolling_radius_mm"): Row(
        "rolling_radius_mm", "--opposite", 459.0, 459.0, 0, 0.0, "opposite rolling radius is 0.0 mm; allowed", OPPOSITE
    ),
    ("opposite", "wheel_load_N"): Row(
        "load_kN", "--opposite", 60, 60e3, -5, -5000.0,
        "opposite load is -5000.0 N (-5 kN); allowed: 1 to 1000000000 N (0.001 to 1000000 kN); give the wheel load",
        OPPOSITE,
    ),
    ("", "load_N"): Row(
        "load_kN", "--load-kn", 87.654321, 87654.321, -5, -5000.0,
        "load is -5000.0 N (-5 kN); allowed: 1 to 1000000000 N (0.001 to 1000000 kN); give the wheel load",
        ": kN, 0.001 to 1000000; default 100",
    ),
    ("", "load_kind"): Row(
        "load_kind", "--load-kind", "normal", "normal", "norml", "norml",
        "load kind is 'norml'; allowed: vertical, normal; did you mean normal?", "vertical, normal; default vertical",
    ),
    ("", "rolling_radius_mm"): length("rolling_radius_mm", 425.0, "default 460"),
    ("", "resolution"): Row(
        "resolution", "--resolution", "fine", "fine", "fin", "fin",
        "resolution is 'fin'; allowed: quick, standard, fine, or two element sizes in mm", "default quick",
    ),
    ("", "solver"): Row(
        "solver", "--solver", "amg", "amg", "magic", "magic", "solver is 'magic'; allowed: auto, pardiso, amg",
        "auto, pardiso, amg; default auto",
    ),
    ("", "refine"): Row(
        "refine", "--refine", "evidence", "evidence", "evidents", "evidents",
        "refine is 'evidents'; allowed: verdict, never, evidence; did you mean evidence?",
        ": verdict, never, evidence; default verdict",
    ),
    **material("rail"),
    **material("wheel"),
    ("", "library"): Row("library", "--library", ".", ".", "", "", "library is ''; allowed", "default none"),
    **file("rail"),
    **file("wheel"),
    ("track", "gauge_mm"): length("gauge_mm", 1432.0, "default 1435"),
    ("track", "gauge_depth_mm"): length("gauge_depth_mm", 16.0, "default 14"),
    ("track", "back_to_back_mm"): length("back_to_back_mm", 1362.0, "default 1360"),
    ("track", "tape_circle_from_back_mm"): length("tape_circle_from_back_mm", 68.0, "default 70"),
    ("track", "rail_crown_y_mm"): length("rail_crown_y_mm", 750.0, "default none"),
    ("size", "rail_depth_mm"): length("rail_depth_mm", 50.0, "default 60"),
    ("size", "rim_thickness_mm"): length("rim_thickness_mm", 50.0, "default 65"),
    ("size", "half_length_mm"): length("half_length_mm", 50.0, "default 60"),
    ("criteria", "p_max"): limit("p_max_percent", "p_max_MPa", "5"),
    ("criteria", "area"): limit("area_percent", "area_mm2", "10"),
    ("criteria", "a"): limit("a_percent", "a_mm", "10"),
    ("criteria", "b"): limit("b_percent", "b_mm", "10"),
    # in Hertz's half-widths b, which are no per cents
    ("criteria", "centre"): Row(
        "centre_over_b", "--centre-over-b", 0.07, 0.07, 1.2, 1.2,
        "limit of centre_over_b is 1.2; allowed: between 0 and 1; for example",
        ": no unit, between 0 and 1; default 0.15",
    ),
    ("criteria", "valley"): limit("valley_percent", "valley", "10"),
    ("criteria", "separate"): limit("separate_load_percent", "separate_load", "0.1"),
    ("criteria", "misplaced"): limit("misplaced_load_percent", "misplaced_load", "10"),
    ("criteria", "judged_by"): Row(
        "judged_by", "--judged-by", "strength,b", ("strength", "b"), "strenght", ("strenght",),
        f"judged by is 'strenght'; allowed: {SETS}; did you mean strength?", f": {SETS}; default all",
    ),
    ("criteria", "theories_out_of_range"): Row(
        "theories_out_of_range", "--theories-out-of-range", True, True, "perhaps", "perhaps",
        "theories out of range is 'perhaps'; allowed: yes or no, true or false", "; default no",
    ),
    ("creep", "friction"): Row(
        "friction", "--friction", 0.4, 0.4, 0, 0.0, "friction coefficient is 0.0; allowed: between 0 and 2; dry steel",
        ": no unit, between 0 and 2; default none",
    ),
    ("creep", "xi"): creepage("xi", "--xi", "creepage xi"),
    ("creep", "eta"): creepage("eta", "--eta", "creepage eta"),
    ("creep", "spin_per_mm"): Row(
        "spin_per_mm", "--spin-per-mm", -1e-4, -1e-4, 2, 2.0, "spin is 2.0 1/mm; allowed: -1 to 1 1/mm; give it",
        ": 1/mm, -1 to 1; default none",
    ),
    ("creep", "speed_ratio"): Row(
        "speed_ratio", "--speed-ratio", 1.01, 1.01, 3, 3.0, "speed ratio is 3.0; allowed: 0 to 2; a free wheel has 1",
        ": no unit, 0 to 2; default 1",
    ),
    ("creep", "curved"): Row(
        "curved", "--curved", True, True, "maybe", "maybe", "curved surfaces is 'maybe'; allowed: yes or no",
        "; default no",
    ),
    ("creep", "force_limit"): Row(
        "force_percent", "--force-percent", 10, 0.1, 100, 1.0, "limit of the creep force is 1.0 (100 %); allowed",
        ": %, between 0 and 100; default 5",
    ),
    ("creep", "largest_creepage"): Row(
        "largest_creepage", "--largest-creepage", 0.01, 0.01, 0.6, 0.6,
        "largest creepage is 0.6; allowed: 0.0001 to 0.5; 0.02 is 2 %", ": no unit, 0.0001 to 0.5; default 0.02",
    ),
}  # fmt: skip

EACH = pytest.mark.parametrize("place", ROWS, ids="/".join)


def case_by_python(place: tuple[str, str], value: Any) -> Case:
    table, field = place
    changes = {field: value}
    return Case(**({table: replace(getattr(Case(), table), **changes)} if table else changes))


def cases_by_file(folder: Path, text: str, *, quick: bool = False) -> tuple[Case, ...]:
    path = folder / "mine.toml"
    path.write_text(text)
    return load_study(path, quick=quick).cases


def toml_line(place: tuple[str, str], value: Any) -> str:
    return (f"[{place[0]}]\n" if place[0] else "") + f"{ROWS[place].key} = {json.dumps(value)}\n"


def case_by_command(*arguments: object) -> Case:
    _, bound, _ = app.parse_args(["solve", *map(str, arguments)], exit_on_error=False, print_error=False)
    bound.apply_defaults()
    case = bound.arguments["options"].case()
    assert isinstance(case, Case)
    return case


def test_the_table_above_has_every_field_of_a_case_and_its_parts():
    case = Case()
    fields = {("", field.name) for field in dataclasses.fields(case) if field.name not in PARTS}
    fields |= {(section, field.name) for section in PARTS for field in dataclasses.fields(getattr(case, section))}
    # only Python and the tables of fleets give the reading of the opposite files
    fields -= {("opposite", "rail_file"), ("opposite", "wheel_file")}
    # only Python has criteria of a user
    fields -= {("criteria", "own")}
    assert set(ROWS) == fields == {(slot.table, slot.field) for slot in INPUTS}


def stands_alone(place: tuple[str, str]) -> bool:
    (slot,) = [candidate for candidate in INPUTS if candidate.place == place]
    return slot.input.alone


def words(place: tuple[str, str], value: Any) -> tuple[str, ...]:
    """Words after an option; none after an option without a value."""
    row = ROWS[place]
    if place[0] == "opposite":
        return (row.option, f"{row.key.lower().replace('_', '-')}={value}")
    return (row.option,) if stands_alone(place) else (row.option, str(value))


@EACH
def test_an_input_is_the_same_by_python_file_and_command_line(place, tmp_path):
    row = ROWS[place]
    case = case_by_python(place, row.held)
    # a folder becomes the paths of the files in it
    assert case != Case() or place == ("", "library")
    assert cases_by_file(tmp_path, toml_line(place, row.written)) == (case,)
    # how a file is read is an option of files alone
    body = place[0].removesuffix("_file") if place[0].endswith("_file") else ""
    file = {body: "mine.csv"} if body else {}
    assert case_by_command(*words(place, row.written), *((f"--{body}", "mine.csv") if body else ())) == replace(
        case, **file
    )
    assert read_case_record(json.loads(json.dumps(make_case_record(case)))) == case


@EACH
def test_an_input_outside_its_range_is_refused_in_the_same_words(place, tmp_path, capsys):
    row = ROWS[place]
    if isinstance(row.held, Irregularity):
        pytest.skip("an irregularity refuses what it cannot be by itself, before it is in a case")
    with pytest.raises(InputError) as python:
        case_by_python(place, row.bad_held)
    assert row.refusal in str(python.value)
    with pytest.raises(InputError) as file:
        cases_by_file(tmp_path, toml_line(place, row.bad_written))
    assert str(file.value).startswith(f"study {tmp_path / 'mine.toml'}: ")
    assert str(file.value).endswith(str(python.value))
    if stands_alone(place):
        return
    assert call(["solve", *words(place, row.bad_written)]) == 2
    assert capsys.readouterr().err.strip().endswith(str(python.value))


@cache
def help_lines(command: str) -> tuple[str, ...]:
    """Lines of a command's help, printed by a separate process.

    A console keeps the width that it began with.
    """
    code = f"from fecontact.cli import call; call([{command!r}, '--help-all'])"
    environment = {**os.environ, "COLUMNS": "300"}
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    return tuple(line.strip("│ ") for line in process.stdout.splitlines() if line.startswith("│"))


def test_help_has_unit_range_and_default_of_every_input():
    lines = {line.split()[0]: line for line in help_lines("solve")}
    for row in ROWS.values():
        assert row.help in lines[row.option]


def test_each_command_takes_what_it_uses():
    def options(command: str) -> set[str]:
        return {word for line in help_lines(command) for word in line.split()[:2] if word.startswith("--")}

    def options_of_groups(*groups: str) -> set[str]:
        return {name for slot in INPUTS if slot.group in groups for name in (*slot.names, *slot.common_names)}

    all_options = options_of_groups(*get_args(Group))
    assert options("solve") & all_options == all_options
    # no stress is looked at
    of_position = options_of_groups("pair", "position", "wheelset", "standing", "load", "profiles", "material")
    assert options("hertz") & all_options == of_position | options_of_groups("irregular")
    # a mesh is not solved, and has nothing that is irregular along the track
    assert options("mesh") & all_options == of_position | options_of_groups("mesh")
    # rigid bodies have no loads
    assert {"--opposite", "--yaw-mrad"} <= options("geometry")
    assert not {"--roll", "--load-kn", "--side"} & options("geometry")
    pytest.importorskip("fecontact.maps")
    assert options("map") & all_options == all_options - options_of_groups("position", "load")


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Case(shift=3.0), "shift is not an input of Case; did you mean lateral_shift_mm?"),
        (lambda: Case(load_kN=100), "did you mean load_N?"),
        (lambda: Case(gauge_mm=1432.0), "it is an input of Track: track=Track(gauge_mm=...)"),
        (lambda: Case(young_MPa=2e5), "it is an input of Material: rail_material=Material(young_MPa=...)"),
        (lambda: Case(wheelset=True), "roll = 'touching' for the roll at which both wheels touch"),
        (lambda: Case("60E1"), "Case takes keyword arguments only: Case(rail=..., wheel=...)"),
        (lambda: Case(track=1432.0), "track is 1432.0; allowed: a Track, such as track=Track(...)"),
        (lambda: replace(Case(), criteria={"p_max": 0.03}), "criteria is {'p_max': 0.03}; allowed: a Criteria"),
        (lambda: Case(rail_material="steel"), "allowed: a Material"),
        (lambda: Criteria(pmax=0.03), "pmax is not an input of Criteria; did you mean p_max?"),
        (lambda: Track(gauge=1432.0), "did you mean gauge_mm?"),
    ],
)
def test_python_refuses_names_and_types_before_anything_is_solved(make, says):
    with pytest.raises(InputError) as refused:
        make()
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("words", "note"),
    [
        (["--load-kn", "100000"], "load is 100000 kN; usual: 1 to 1000"),
        (["--load-kn", "0.1"], "load is 0.1 kN; usual: 1 to 1000"),
        (["--wheel-young-mpa", "210"], "Young's modulus is 210 MPa; usual: 50000 to 500000"),
        (["--young-mpa", "2.1e11"], "Young's modulus is 210000000000 MPa"),
        (
            ["--rolling-radius-mm", "0.46"],
            "rolling radius is 0.46 mm; usual: 100 to 1000; railway wheels have 300 to",
        ),
        (["--load-kn", "1000", "--young-mpa", "50000"], ""),
    ],
)
def test_what_is_not_usual_is_noted_and_computed(words, note, capsys, tmp_path):
    assert call(["hertz", "--json", *words]) == 0
    out, err = capsys.readouterr()
    json.loads(out)
    assert err.startswith(f"note: {note}") if note else err == ""
    # once of both bodies
    assert err.count("note:") == bool(note)
    if "--load-kn" in words:
        (tmp_path / "one.toml").write_text(f"load_kN = [100, {words[1]}]\nrefine = 'never'")
        assert call(["check", str(tmp_path / "one.toml")]) == 0
        assert note in capsys.readouterr().err


@pytest.mark.parametrize("command", ["solve", "place", "mesh", "run"])
def test_every_command_notes_what_is_not_usual_before_it_begins(command, capsys, tmp_path, monkeypatch):
    def begun(*_, **__):
        raise InputError("begun")

    for name in ("solve.solve", "preview.preview_case", "case_meshes.mesh_case"):
        monkeypatch.setattr(f"fecontact.solving.{name}", begun)
    monkeypatch.setattr("fecontact.runs.study.run_study", begun)
    (tmp_path / "one.toml").write_text("load_kN = 1e5")
    out = ["--out", str(tmp_path / "out")]
    words = {
        "mesh": ["mesh", "rail", "--load-kn", "1e5", "--out", str(tmp_path / "rail.vtu")],
        "run": ["run", str(tmp_path / "one.toml"), *out],
    }
    assert call(words.get(command, [command, "--load-kn", "1e5"])) == 2
    note, *cost, error = capsys.readouterr().err.splitlines()
    assert note.startswith("note: load is 100000 kN; usual: 1 to 1000")
    assert all(line.startswith("about ") for line in cost)
    assert error == "error: begun"


@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("study.json", "this folder has the results of a study"),
        ("row.json", "this folder has the results of a case"),
        ("cases.toml", "this is a folder; give the file of a study, such as"),
        (None, "this is a folder; give the file of a study"),
    ],
)
def test_a_folder_in_place_of_a_study_is_called_one(file, says, tmp_path, capsys):
    if file:
        (tmp_path / file).write_text("{}")
    assert call(["check", str(tmp_path)]) == 2
    assert f"{tmp_path}: {says}" in capsys.readouterr().err


def test_words_that_belong_to_no_option_are_named(capsys):
    assert call(["solve", "3", "100"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: 3 100: fecontact solve takes no such argument; write each value after its option")
    assert "Unused" not in said


@pytest.mark.parametrize("command", ["solve", "place", "hertz", "mesh", "geometry"])
def test_the_first_page_of_help_is_two_screens_with_what_most_runs_need(command, capsys, monkeypatch):
    options = "--json --out --shift --load-kn --resolution --friction --p-max-percent --judged-by"
    first_page(command, options if command == "solve" else "", capsys, monkeypatch)


def first_page(command, options, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert call([command, "--help"]) == 0
    out = capsys.readouterr().out
    assert len(out.splitlines()) <= 48
    for option in ("--rail", "--wheel", "--inclination", *options.split()):
        assert f" {option} " in out, option
    assert "--rail-units" not in out
    assert f"fecontact {command} --help-all" in out
    # every topic that it names has a page, with inputs of that topic alone; of others one is looked at
    topics = out.split("--help ")[-1].split("|")
    for topic in map(str.strip, topics if command == "solve" else topics[:1]):
        assert call([command, "--help", topic]) == 0
        page = capsys.readouterr().out
        assert f" {topic.capitalize()} " in page
        assert page.count("╭") == 1
    assert call([command, "--help", "materiel"]) == 2
    assert "unknown topic" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["run", "--help"], "--workers"),
        (["run", "--help-all"], "--workers"),
        (["baseline", "update", "--help"], "--reason"),
        (["--help", "solve"], "--shift"),
        (["solve", "--shift", "3", "-h"], "--help-all"),
        (["--help-all"], "Development"),
    ],
)
def test_help_is_found_wherever_it_is_asked_for(words, says, capsys):
    assert call(words) == 0
    assert says in capsys.readouterr().out


def test_commands_stand_in_the_order_in_which_they_are_used(capsys):
    assert call(["--help"]) == 0
    out = capsys.readouterr().out
    panels = ["Start", "Look", "Solve", "After", "Development"]
    assert [line.split()[1] for line in out.splitlines() if line.startswith("╭")] == [*panels, "Options"]


def test_what_is_known_of_a_file_is_said_for_each_body(capsys):
    assert call(["solve", "--units", "m"]) == 2
    assert (
        "--units is not an option; use the option of a body: --rail-units or --wheel-units" in capsys.readouterr().err
    )


def test_a_material_for_both_bodies_and_one_of_its_own():
    case = case_by_command("--rail-young-mpa", 190e3, "--young-mpa", 206e3, "--poisson", 0.28, "--wheel-yield-mpa", 520)
    assert (case.rail_material.young_MPa, case.wheel_material.young_MPa) == (190e3, 206e3)
    assert (case.rail_material.poisson, case.wheel_material.poisson) == (0.28, 0.28)
    assert (case.rail_material.yield_MPa, case.wheel_material.yield_MPa) == (None, 520.0)


def test_no_option_and_an_empty_file_are_the_default_case(tmp_path):
    assert case_by_command() == Case()
    assert cases_by_file(tmp_path, "") == (Case(),)


def test_a_roll_is_that_of_its_numbers_where_none_is_said(tmp_path):
    assert case_by_command("--roll-mrad", "0.4") == Case(roll_rad=0.4e-3) == Case(roll="given", roll_rad=0.4e-3)
    loads = {"roll_load_N": 80e3, "opposite": Opposite(wheel_load_N=60e3)}
    assert (
        case_by_command("--roll-load-kn", "80", "--opposite", "load-kn=60")
        == Case(**loads)
        == Case(roll="loaded", **loads)
    )
    text = 'roll = "touching"\n[[case]]\n[[case]]\nroll = "given"\nroll_mrad = 0.4\n'
    assert cases_by_file(tmp_path, text) == (Case(roll="touching"), Case(roll_rad=0.4e-3))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            {"roll": "touching", "roll_mrad": 0.4},
            "roll angle is 0.4 mrad, but the roll is 'touching'; leave out the roll angle, or",
        ),
        # also one of zero
        ({"roll": "loaded", "roll_mrad": 0}, "roll angle is 0 mrad, but the roll is 'loaded'"),
        (
            {"roll": "given", "roll_load_kN": 80},
            "roll load is 80 kN, but the roll is 'given'; leave out the roll load, or give",
        ),
        ({"roll": "touching", "opposite": {"load_kN": 60}}, "opposite load is 60 kN, but the roll is 'touching'"),
        ({"roll_mrad": 0.4, "roll_load_kN": 80}, "roll load is 80 kN, but the roll is 'given'"),
        (
            {"wheelset": True},
            "wheelset is no longer an input; use roll = 'touching' for the roll at which both wheels touch",
        ),
        ({"wheelset": False}, "roll = 'given' for a fixed roll"),
        ({"roll_under_load": True}, "use roll = 'loaded' for the roll of the loaded wheelset"),
    ],
)
def test_numbers_of_another_roll_and_its_old_names_are_refused(options, says, tmp_path, capsys):
    top = [f"{key} = {json.dumps(value)}" for key, value in options.items() if not isinstance(value, dict)]
    inner = [f"[{key}]\nload_kN = {value['load_kN']}" for key, value in options.items() if isinstance(value, dict)]
    assert says in refusal(tmp_path, "\n".join((*top, *inner)))
    words: list[str] = []
    for key, value in options.items():
        name = "--" + key.lower().replace("_", "-")
        words += (
            ["--opposite", "load-kn=60"] if isinstance(value, dict) else [name] + [str(value)] * (value is not True)
        )
    # `solve --wheelset` is an option of that command
    if "wheelset" not in options:
        assert call(["solve", *words]) == 2
        assert says in capsys.readouterr().err
    if isinstance(next(iter(options.values())), bool):
        with pytest.raises(InputError, match="is no longer an input"):
            read_case_record(make_case_record(Case()) | options)


@pytest.mark.parametrize(
    ("option", "text", "record", "says"),
    [
        (
            "--evidence",
            "evidence = true",
            {"evidence": True},
            "refine = 'verdict' or 'evidence', or 'never' for none",
        ),
        (
            "--refine-degrees-of-freedom",
            "refine_degrees_of_freedom = 0",
            {"refine_degrees_of_freedom": 0},
            "refine = 'verdict'",
        ),
        ("--opposite-rail", "opposite_rail = '54E1'", {"opposite_rail": "54E1"}, "--opposite rail=...,wheel=..."),
        (
            "--rim-half-length-mm",
            "[size]\nrim_half_length_mm = 50",
            {"size": {"rim_half_length_mm": 50.0}},
            "use half_length_mm",
        ),
        ("--material-name", "[rail_material]\nname = 'x'", {"rail_material": {"name": "x"}}, "materials have no name"),
    ],
)
def test_an_old_name_is_refused_with_what_to_write_instead(option, text, record, says, tmp_path, capsys):
    assert call(["solve", option, "0"]) == 2
    assert says in capsys.readouterr().err
    assert says in refusal(tmp_path, text)
    with pytest.raises(InputError, match="solve the case again") as stored:
        read_case_record(make_case_record(Case()) | record)
    assert says in str(stored.value)
    table, values = next(iter(record.items()))
    with pytest.raises(InputError) as python:
        PARTS[table](**values) if table in PARTS else Case(**record)
    assert says in str(python.value)


_OF_READING = {"smoothing_mm": "filter_mm", "flip_z": "1,-2", "decimal": "recognised", "offsets": "are added"}


@pytest.mark.parametrize(
    ("table", "python", "file", "says"),
    [
        *(("rail_file", name, name, says) for name, says in _OF_READING.items()),
        *(("", f"opposite_{name}", f"opposite_{name}", "--opposite rail=") for name in ("wheel", "rolling_radius_mm")),
        ("", "opposite_load_N", "opposite_load_kN", "--opposite rail="),
        ("size", "rail_half_length_mm", "rail_half_length_mm", "use half_length_mm"),
    ],
)
def test_every_old_name_of_the_changelog_is_refused_by_all_doors(table, python, file, says, tmp_path, capsys):
    prefix = "rail-" if table == "rail_file" else ""
    assert call(["solve", f"--{prefix}{file.lower().replace('_', '-')}", "1"]) == 2
    assert says in capsys.readouterr().err
    assert says in refusal(tmp_path, (f"[{table}]\n" if table else "") + f"{file} = 1")
    old = {python: 1.0}
    with pytest.raises(InputError, match=re.escape(says)):
        read_case_record(make_case_record(Case()) | ({table: old} if table else old))
    owner = getattr(Case(), table) if table else Case()
    with pytest.raises(InputError, match=re.escape(says)):
        replace(owner, **old)


def test_the_changelog_has_the_old_names_that_are_refused_and_no_other():
    text = (Path(__file__).parents[1] / "CHANGELOG.md").read_text("utf-8")
    # keys of results are in a table of their own
    inputs_text, _, _ = text.partition("Keys of `result.json`")
    rows = re.findall(r"^\| (`.*?) \| .* \|$", inputs_text, re.MULTILINE)
    old_names = {name for row in rows for name in re.findall(r"`(\w+)`", row)} - {"compare"}
    # the command line has names of its own for one body, and in small letters
    by_option = ("rail_", "wheel_", "opposite_load_kn")
    assert old_names == {
        name for name in FORMER_NAMES if name == "rail_half_length_mm" or not name.startswith(by_option)
    }


def test_the_shift_has_two_names_and_element_sizes_are_a_resolution():
    assert case_by_command("--lateral-shift-mm", "-3") == Case(lateral_shift_mm=-3.0)
    assert case_by_command("--resolution", "0.5,0.4") == Case(resolution=(0.5, 0.4))
    assert case_by_command("--opposite", "rail=54E1,rolling-radius-mm=459") == Case(
        opposite=Opposite(rail="54E1", rolling_radius_mm=459.0)
    )


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--lateral-shft-mm", "1"], "Did you mean --lateral-shift-mm?"),
        (["--p-max-percnt", "1"], "Did you mean --p-max-percent?"),
        (["--load-kn", "heavy"], "load is 'heavy'; allowed: a number (kN, 0.001 to 1000000)"),
        (
            ["--opposite", "rial=54E1"],
            "'rial=54E1'; allowed: rail=..., wheel=..., rolling-radius-mm",
        ),
        (["--opposite", "54E1"], "'54E1'; allowed: rail="),
        (["--resolution", "0.5,x"], "two element sizes in mm such as 0.5,0.4"),
        (["--resolution", "0.5,-1"], "element size is -1.0 mm; allowed: finite and > 0"),
    ],
)
def test_the_command_line_refuses(arguments, says, capsys):
    assert call(["solve", *arguments]) == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("value", [0.0, math.atan(1 / 40), -math.atan(1 / 20), 0.025, 1e-5, 0.3])
def test_inclinations_are_shown_as_they_are_read(value):
    assert parse_inclination(format_inclination(value)) == value


@pytest.mark.parametrize(
    "change",
    [
        {"load_N": "100"},
        {"load_N": True},
        {"load_N": None},
        {"load_N": 10**400},
        {"rail": 60},
        {"refine": 0.5},
        {"resolution": (0.5,)},
        {"resolution": (0.5, math.inf)},
        {"resolution": 0.5},
    ],
    ids=lambda change: str(change)[:40],
)
def test_values_of_another_type_are_refused_by_python(change):
    with pytest.raises(InputError, match="allowed: "):
        Case(**change)


# --- files ------------------------------------------------------------------------------------------------------


def refusal(folder: Path, text: str) -> str:
    """Message with which a study file is refused, without the name of the file."""
    with pytest.raises(InputError) as refused:
        cases_by_file(folder, text)
    message = str(refused.value)
    assert message.startswith(f"study {folder / 'mine.toml'}")
    assert "Extra inputs" not in message
    assert "Input should" not in message
    assert "\n" not in message
    return message.removeprefix(f"study {folder / 'mine.toml'}")


@pytest.mark.parametrize("slot", INPUTS, ids=lambda slot: f"{slot.table}/{slot.key}")
def test_a_misspelt_key_is_refused_with_the_nearest_and_all_others(slot: InputPlace, tmp_path):
    middle = len(slot.key) // 2
    table_keys = [key.key for key in INPUTS if key.table == slot.table]
    head = f"[{slot.table}]\n" if slot.table else ""
    misspelt = {slot.key[:middle] + slot.key[middle + 1 :], f"{slot.key}s", slot.key[1:], f"{slot.key[:-1]}x"}
    # a_percent and b_percent are equally near to some, side and the table size to one
    for wrong in misspelt - {"sie", *(key[1:] for key in table_keys if key != slot.key)}:
        message = refusal(tmp_path, f"{head}{wrong} = 1\n")
        # of two letters half are wrong
        hint = f" did you mean {slot.key}?;" if len(slot.key) > 2 else ""
        assert f"{wrong}: there is no such key;{hint}" in message
        assert f"; keys: {', '.join(table_keys)}" in message
        assert message.startswith(f": [{slot.table}]: " if slot.table else ": ")
        numbered = refusal(tmp_path, f"[[case]]\n[[case]]\n{head.replace('[', '[case.')}{wrong} = 1\n")
        assert numbered.startswith(f", [[case]] 2: [case.{slot.table}]: " if slot.table else ", [[case]] 2: ")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("shift = 1", "did you mean lateral_shift_mm?"),
        ("load_N = 1e5", "did you mean load_kN?"),
        ("inclination_rad = 0.1", "did you mean inclination?"),
        ("[tracks]\ngauge_mm = 1435", "tracks: there is no such key; did you mean track?"),
        ("[[cases]]", "did you mean case?"),
        ("gauge_mm = 1435", "gauge_mm belongs to [track]"),
        ("young_MPa = 1", "young_MPa belongs to [rail_material] or [wheel_material]"),
        (
            "[track]\nload_kN = 1",
            "[track]: load_kN: there is no such key; load_kN belongs to [opposite] or the keys above all tables",
        ),
        ("[[case]]\n[case.size]\ngauge_mm = 1435", "gauge_mm belongs to [case.track]"),
        ("qqqq = 1", "qqqq: there is no such key; keys: rail, wheel, inclination, lateral_shift_mm"),
        ("load_kN = true", "load_kN: load is True; allowed: a number (kN, 0.001 to 1000000)"),
        ("load_kN = 'x'", "load_kN: load 'x': 'x' is neither a number nor a range"),
        ("load_kN = [50, 'x']", "allowed: a number (kN, 0.001 to 1000000)"),
        ("load_kN = []", "load_kN: the list is empty; allowed: a number (kN, 0.001 to 1000000)"),
        ("load_kN = [[50]]", "load is [50]; allowed: a number (kN, 0.001 to 1000000)"),
        ("load_kN = nan", "load is nan N"),
        ("load_kN = 1e999", "load is inf N"),
        (f"load_kN = {10**400}", "load is 1000"),
        ("load_kN = 1979-05-27", "allowed: a number (kN, 0.001 to 1000000)"),
        ("lateral_shift_mm = '6:-6:1'", "a range must ascend"),
        ("inclination = 40", "inclination is 40; allowed: 1:N such as 1:40"),
        ("rail = 60", "rail is 60; allowed: a text (library name"),
        ("resolution = [0.5]", "two element sizes in mm"),
        ("resolution = 0.5", "resolution is 0.5; allowed: quick, standard, fine, or two"),
        ("track = 1435", "track is 1435; give a table that begins with the line [track]"),
        ("[[track]]", "give a table that begins with the line [track]"),
        ("[track]\ngauge_mm = '1435'", "[track]: gauge_mm: gauge is '1435'; allowed: a number (mm, finite and > 0)"),
        ("[track]\ngauge_mm = [1435, 1437]", "[track]: gauge_mm: it is [1435, 1437]; allowed: a number (mm"),
        ("[case]", "give each case as a table that begins with the line [[case]]"),
        ("case = []", "give each case as a table that begins with the line [[case]]"),
        ("[[case]]\n[[case.case]]", "[[case]] 1: case: there is no such key; keys"),
        ("load_kN = [", "not valid TOML"),
        ("load_kN = '1:1000:1'\nyaw_mrad = '0:0.9:0.001'\nlateral_shift_mm = '0:1:0.1'", "use shorter lists"),
    ],
)
def test_a_wrong_file_is_refused(text, says, tmp_path):
    assert says in refusal(tmp_path, text)


def test_measures_that_decide_are_names_with_commas_between(tmp_path):
    (case,) = cases_by_file(tmp_path, '[criteria]\njudged_by = "patch, valley"\n')
    assert (
        case.criteria
        == Criteria(judged_by=("patch", "valley"))
        == case_by_command("--judged-by", "patch,valley").criteria
    )
    for text, wrong in (("patch,", ""), ("", ""), ("patch,all of them", "all of them")):
        assert f"judged by is {wrong!r}; allowed: {SETS}" in refusal(tmp_path, f"[criteria]\njudged_by = '{text}'\n")


@pytest.mark.parametrize(
    ("text", "case"), [("load_kN = -1", 1), ("load_kN = 'x'", 1), ("[case.track]\ngauge_mm = 0", 1), ("rail = 1", 1)]
)
def test_what_is_wrong_in_a_case_table_is_said_with_its_number(text, case, tmp_path):
    message = refusal(tmp_path, f"load_kN = 80\n[[case]]\nload_kN = 50\n[[case]]\n{text}\n[[case]]\n")
    assert message.startswith(f", [[case]] {case + 1}: ")


def test_every_top_level_key_may_be_a_list_and_the_shift_changes_fastest(tmp_path):
    cases = cases_by_file(
        tmp_path,
        'lateral_shift_mm = [0, 1]\nload_kN = [50, 100]\nwheel = ["S1002", "cylinder:460"]\nrail = ["60E1", "54E1"]\n'
        'solver = ["auto", "amg"]\ninclination = ["1:40", "1:20"]\n',
    )
    expected = [
        Case(rail=rail, wheel=wheel, load_N=load, lateral_shift_mm=shift, solver=solver, inclination_rad=inclination)
        for inclination in (math.atan(1 / 40), math.atan(1 / 20))
        for solver in ("auto", "amg")
        for rail in ("60E1", "54E1")
        for wheel in ("S1002", "cylinder:460")
        for load in (50e3, 100e3)
        for shift in (0.0, 1.0)
    ]
    assert list(cases) == expected


@pytest.mark.parametrize("slot", [slot for slot in INPUTS if not slot.table], ids=lambda slot: slot.key)
def test_a_list_of_any_top_level_key(slot, tmp_path):
    row = ROWS["", slot.field]
    assert cases_by_file(tmp_path, f"{row.key} = [{json.dumps(row.written)}]\n") == (
        case_by_python(("", slot.field), row.held),
    )


def test_ranges_of_numbers(tmp_path):
    cases = cases_by_file(tmp_path, 'lateral_shift_mm = "-6:6:6, 8"\nyaw_mrad = ["0:2:1", 9]\n')
    assert [(case.yaw_rad, case.lateral_shift_mm) for case in cases] == [
        (yaw, shift) for yaw in (0.0, 0.001, 0.002, 0.009) for shift in (-6.0, 0.0, 6.0, 8.0)
    ]


@pytest.mark.parametrize(
    ("text", "resolutions"),
    [
        ("[0.5, 0.4]", [(0.5, 0.4)]),
        ('["quick", "standard"]', ["quick", "standard"]),
        ('["fine", [0.5, 0.4]]', ["fine", (0.5, 0.4)]),
        ("[[0.5, 0.4], [1, 2]]", [(0.5, 0.4), (1.0, 2.0)]),
    ],
)
def test_two_sizes_are_one_resolution_and_names_are_a_list(text, resolutions, tmp_path):
    assert [case.resolution for case in cases_by_file(tmp_path, f"resolution = {text}\n")] == resolutions
    assert [case.resolution for case in cases_by_file(tmp_path, f"resolution = {text}\n", quick=True)] == ["quick"]


def test_case_tables_inherit_what_they_do_not_give(tmp_path):
    cases = cases_by_file(
        tmp_path,
        """
        rail = "54E1"
        load_kN = [50, 100]
        resolution = "fine"
        [criteria]
        p_max_percent = 3
        [track]
        gauge_mm = 1437
        gauge_depth_mm = 16
        [[case]]
        lateral_shift_mm = -3
        roll_mrad = 0.5
        [[case]]
        lateral_shift_mm = [3, 4]
        load_kN = 80
        roll_mrad = -0.5
        resolution = "quick"
        [case.track]
        gauge_mm = 1432
        [[case]]
        """,
    )
    common = {"rail": "54E1", "criteria": Criteria(p_max=0.03)}
    track = Track(gauge_mm=1437.0, gauge_depth_mm=16.0)
    first = {"lateral_shift_mm": -3.0, "roll_rad": 0.0005, "resolution": "fine", "track": track}
    second = {"load_N": 80e3, "roll_rad": -0.0005, "resolution": "quick", "track": replace(track, gauge_mm=1432.0)}
    assert cases == (
        Case(**common, **first, load_N=50e3),
        Case(**common, **first, load_N=100e3),
        Case(**common, **second, lateral_shift_mm=3.0),
        Case(**common, **second, lateral_shift_mm=4.0),
        Case(**common, track=track, resolution="fine", load_N=50e3),
        Case(**common, track=track, resolution="fine", load_N=100e3),
    )


def test_a_key_after_a_case_belongs_to_it_and_not_to_the_next(tmp_path):
    first, second, again = cases_by_file(tmp_path, "[[case]]\nyaw_mrad = 2\n[[case]]\n[[case]]\nyaw_mrad = 2\n")
    assert (first.yaw_rad, second.yaw_rad) == (0.002, 0.0)
    assert again == first


def test_the_example_of_the_guide(tmp_path):
    example = read_page("studies").split("```toml\n")[1].split("```")[0]
    assert [(case.lateral_shift_mm, case.roll_rad, case.load_N) for case in cases_by_file(tmp_path, example)] == [
        (-4.0, 0.0004, 50e3),
        (-4.0, 0.0004, 100e3),
        (4.0, -0.0004, 50e3),
        (4.0, -0.0004, 100e3),
    ]
