"""The default roll of a case.

Tables and pictures give this roll and the other wheel.
"""

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

from fecontact.case import Case, Opposite, make_case_record, read_case_record
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.outputs.case_words import roll_words, roll_words_of_rows
from fecontact.outputs.records.results import input_columns
from fecontact.outputs.series import split_into_series
from fecontact.profiles.library import list_names, toml_text
from fecontact.runs.casefile import load_study
from fecontact.solving.placing import place_case

FIRST_LIGHT = Path(__file__).parents[1] / "studies" / "first_light.py"
WHEELSET = Case(roll="touching")
ALONE = Case(roll="given")


# options, and the case that they are for every command
WAYS = [
    ([], WHEELSET),
    (["--side", "right"], replace(WHEELSET, side="right")),
    (["--opposite", "wheel=cylinder:459"], replace(WHEELSET, opposite=Opposite(wheel="cylinder:459"))),
    (["--roll", "touching"], WHEELSET),
    (["--roll", "given"], ALONE),
    # a roll of zero is a roll that is given, too
    (["--roll-mrad", "0"], ALONE),
    (["--roll-mrad", "-0.4"], Case(roll="given", roll_rad=-0.4e-3)),
    (["--rail", "circle:300"], replace(ALONE, rail="circle:300")),
    (["--rail", "arcs:300/80@2.5"], replace(ALONE, rail="arcs:300/80@2.5")),
    (["--rail", "a75"], replace(ALONE, rail="a75")),
    (["--wheel", "cylinder:460"], replace(ALONE, wheel="cylinder:460")),
    (["--wheel", "cylinder:460", "--roll", "touching"], replace(WHEELSET, wheel="cylinder:460")),
    (["--roll-load-kn", "80"], Case(roll="loaded", roll_load_N=80e3)),
    (
        ["--roll-load-kn", "80", "--opposite", "load-kn=60"],
        Case(roll="loaded", roll_load_N=80e3, opposite=Opposite(wheel_load_N=60e3)),
    ),
]
COMMANDS = {
    "fecontact.runs.alone.table": ["table", "--shifts", "0", "--out"],
    "fecontact.runs.alone.theory": ["theory", "strip"],
    "fecontact.runs.alone.hertz": ["hertz"],
    "fecontact.solving.preview.preview_case": ["place"],
    "fecontact.solving.solve.solve": ["solve"],
    "fecontact.solving.case_meshes.mesh_case": ["mesh", "rail", "--out"],
}


@pytest.mark.parametrize(
    ("options", "case"), WAYS, ids=lambda value: " ".join(value) if isinstance(value, list) else ""
)
@pytest.mark.parametrize(
    ("doing", "command"), COMMANDS.items(), ids=lambda value: value if isinstance(value, str) else ""
)
def test_every_command_rolls_its_wheelset_unless_a_roll_is_given_or_there_is_none(
    doing, command, options, case, monkeypatch, tmp_path
):
    rolls(doing, command, options, case, monkeypatch, tmp_path)


def rolls(doing, command, options, case, monkeypatch, tmp_path):
    placements = []

    def do(case, *_, **__):
        placements.append(case)
        raise InputError("seen")

    monkeypatch.setattr(doing, do)
    written_name = "table.csv" if command[0] == "table" else "rail.msh"
    out = [str(tmp_path / written_name)] if command[-1] == "--out" else []
    assert call([*command, *out, *options]) == 2
    (roll,) = placements
    assert roll == case


def test_a_roll_of_zero_is_given_in_python_and_in_files_as_well(tmp_path):
    assert Case() == WHEELSET
    assert Case(roll_rad=0.0) == ALONE
    (tmp_path / "two.toml").write_text("[[case]]\n[[case]]\nroll_mrad = 0\n")
    assert load_study(tmp_path / "two.toml").cases == (WHEELSET, ALONE)
    # other changes do not change the roll
    assert replace(Case(), lateral_shift_mm=3.0) == replace(WHEELSET, lateral_shift_mm=3.0)
    assert replace(Case(roll_rad=0.0), lateral_shift_mm=3.0).roll == "given"
    # a roll that nobody asked for goes where one is given; one that was asked for contradicts it
    assert replace(Case(), roll_rad=4e-4) == Case(roll_rad=4e-4)
    with pytest.raises(InputError, match=r"roll angle is 0\.4 mrad, but the roll is 'touching'.*give roll = 'given'"):
        replace(Case(roll="touching"), roll_rad=4e-4)
    for case in (WHEELSET, ALONE, Case(roll_rad=4e-4), Case(roll_load_N=80e3)):
        assert read_case_record(make_case_record(case)) == case


def test_the_rails_without_a_wheelset_are_the_crane_rails():
    # the standard of a library rail says which it is
    crane = {name for name in list_names("rail") if "DIN 536" in toml_text(name)}
    assert crane == {name for name in list_names("rail") if Case(rail=name).roll == "given"}
    assert len(crane) == 7
    assert all(Case(wheel=name).roll == "touching" for name in list_names("wheel"))


def test_the_first_study_stands_on_both_rails():
    spec = importlib.util.spec_from_file_location("first_light", FIRST_LIGHT)
    study = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)
    for quick in (False, True):
        for case in study.cases(quick=quick):
            assert case.roll == "touching"
            # it does not ask for positions at which a wheelset cannot stand
            place_case(case)


@pytest.mark.parametrize(
    ("case", "words"),
    [
        (WHEELSET, "rolled until both wheels touch"),
        (Case(), "rolled until both wheels touch"),
        (Case(roll_rad=0.0), "roll fixed at 0 mrad"),
        (Case(roll_rad=4e-4), "roll fixed at 0.4 mrad"),
        (Case(rail="circle:300"), "roll fixed at 0 mrad (profiles given by their radii have no wheelset)"),
        (Case(rail="A75"), "roll fixed at 0 mrad (a crane rail has no wheelset)"),
        (Case(roll="loaded"), "roll of the loaded wheelset"),
        (Case(roll_load_N=80e3), "roll of the wheelset under 80 kN per wheel"),
        (
            Case(side="right", opposite=Opposite(wheel_load_N=60e3)),
            "roll of the loaded wheelset, 60 kN on its left wheel",
        ),
        (
            Case(roll_load_N=80e3, opposite=Opposite(wheel_load_N=60e3)),
            "roll of the wheelset under 80 kN on its left wheel, 60 kN on its right wheel",
        ),
    ],
)
def test_what_is_said_of_a_roll(case, words):
    assert roll_words(case) == words


def test_what_is_said_of_the_rolls_of_a_table():
    free = [
        input_columns(case, place_case(case)) for case in (replace(WHEELSET, lateral_shift_mm=s) for s in (0.0, 3.0))
    ]
    fixed = [input_columns(case) for case in (ALONE, replace(ALONE, lateral_shift_mm=3.0), Case(roll_rad=1e-3))]
    assert free[1]["roll_mrad"] != 0.0
    assert roll_words_of_rows(free) == "rolled until both wheels touch"
    # as a table on disk has them
    assert roll_words_of_rows(
        [{name: str(value) for name, value in row.items()} for row in free]
    ) == roll_words_of_rows(free)
    assert roll_words_of_rows(fixed[:2]) == "roll fixed at 0 mrad"
    assert roll_words_of_rows(fixed) == "roll fixed for each case"
    assert roll_words_of_rows([*free, *fixed]) == "rolled until both wheels touch, or fixed"
    loaded = Case(roll_load_N=80e3, opposite=Opposite(wheel_load_N=60e3))
    under = [input_columns(case, place_case(case)) for case in (loaded, Case(roll="loaded"))]
    assert roll_words_of_rows(under[:1]) == roll_words(loaded)
    assert roll_words_of_rows([{name: str(value) for name, value in under[0].items()}]) == roll_words(loaded)
    assert roll_words_of_rows(under) == "roll of the loaded wheelset"
    assert roll_words_of_rows([*free, *under]) == "rolled until both wheels touch, loaded or not"
    # a wheelset that could not be placed has no values
    assert roll_words_of_rows([{"roll": "touching", "roll_mrad": None}, {}]) == ""


def test_both_sides_of_a_wheelset_are_two_series_whatever_their_rolls():
    rows = [
        input_columns(case, place_case(case)) | {"resolution": case.resolution}
        for side in ("left", "right")
        for case in (replace(WHEELSET, lateral_shift_mm=shift, side=side) for shift in (0.0, 3.0))
    ]
    assert [one_series.label for one_series in split_into_series(rows)] == ["left", "right"]
    alone = [input_columns(replace(ALONE, lateral_shift_mm=shift)) for shift in (0.0, 3.0)]
    assert [one_series.label for one_series in split_into_series([*rows[:2], *alone])] == [
        "both wheels touch",
        "fixed roll",
    ]
