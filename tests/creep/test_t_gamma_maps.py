"""Maps of the error of Hertz's T-gamma, and errors of the creep forces by component."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
from test_creep_maps import CASE, LOADS, Judged, cell, judged_as

from fecontact.case import Case
from fecontact.cli import call
from fecontact.criteria import Creep
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.features.creep.creep_comparison import TheoryForces, compare_creep_forces
from fecontact.features.creep.force_verdict import (
    DECIDING_THEORY,
    build_rolling_load,
    estimate_force_uncertainty,
    estimate_pressure_uncertainty,
)
from fecontact.features.creep.forces import calculate_y_over_q
from fecontact.features.creep.maps import T_GAMMA_MAP
from fecontact.features.creep.telling import answer_creep_forces
from fecontact.judging.judge import judge_load
from fecontact.maps.model import ApplicabilityMap, LoadLimit, MapCell, MapPosition, build_cell_row
from fecontact.maps.number_views import build_number_view, write_number_sentences
from fecontact.maps.picture import draw_map
from fecontact.maps.positions import build_solved_cell
from fecontact.maps.text_map import format_map_table
from fecontact.maps.views import build_views, format_map, refuse_measure, write_map_answer, write_number_answer
from fecontact.outputs.records.results import load_record
from fecontact.regression.tables import find_kind
from fecontact.solving.placing import place_case

COLUMN = f"creep_theories_{DECIDING_THEORY}"


# --- the view of planted numbers


def planted_cell(load_N, deviation, uncertainty=1.0, shift=0.0):
    """Cell with a planted deviation of T-gamma in percent."""
    forces = TheoryForces(
        hertz="-", fe="-", t_gamma_deviation_percent=deviation, t_gamma_uncertainty_percent=uncertainty
    )
    comparison = SimpleNamespace(verdict=judged_as("HOLDS", 1.0), theories={DECIDING_THEORY: forces})
    return cell(Judged(load_N=load_N, features={"creep": comparison}), shift=shift)


def planted_map(*columns, case=CASE):
    positions = [
        MapPosition(lateral_shift_mm=column[0].lateral_shift_mm, cells=column, limit=LoadLimit()) for column in columns
    ]
    return ApplicabilityMap(case=case, loads_N=LOADS, positions=tuple(positions))


@pytest.fixture
def errors():
    """Errors of all sizes, with and without an uncertainty.

    A cell has no slip, and a position has no solution."""
    return planted_map(
        tuple(planted_cell(load, value) for load, value in zip(LOADS, (25.0, 12.0, -7.0), strict=True)),
        (
            planted_cell(LOADS[0], 1.5, 2.0, shift=1.0),
            planted_cell(LOADS[1], 3.0, None, shift=1.0),
            planted_cell(LOADS[2], None, None, shift=1.0),
        ),
        tuple(MapCell(lateral_shift_mm=2.0, load_N=load, status="failed: no memory") for load in LOADS),
    )


def test_each_error_has_the_step_of_the_scale_that_contains_it(errors):
    view = build_number_view(errors, T_GAMMA_MAP)
    words = dict(view.answers)
    texts = [(cell_view.text, words.get(cell_view.answer)) for column in view.columns for cell_view in column.cells]
    assert texts == [
        ("+25", "more than 20 % too high"),
        ("+12", "10 to 20 % too high"),
        ("-7", "5 to 10 % too low"),
        ("(+2)", "within 2 %"),
        ("+3?", "2 to 5 % too high"),
        ("-", "no T-gamma: no slip, or no force"),
        *[("!", "no forces: not solved")] * 3,
    ]
    # the limits of the steps belong to the smaller step
    for value, step in ((2.0, "within 2 %"), (-5.0, "2 to 5 % too low"), (20.0, "10 to 20 % too high")):
        single = build_number_view(planted_map((planted_cell(LOADS[0], value),)), T_GAMMA_MAP)
        assert [answer_words for _, answer_words in single.answers] == [step]


def test_the_legend_explains_what_is_in_the_picture_and_nothing_else(errors):
    view = build_number_view(errors, T_GAMMA_MAP)
    figure = draw_map(view)
    (ax,) = figure.axes
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    texts = {text.get_text() for text in ax.texts}
    assert {"+25", "(+2)", "+3?", "-", "!"} <= texts
    for words in ("smaller than its uncertainty", "its uncertainty is unknown", "deviation of Hertz in %"):
        assert any(words in text for text in legend)
    assert "10 to 20 % too low" not in legend
    # a text on a dark colour is white
    colours = {text.get_text(): text.get_color() for text in ax.texts}
    assert (colours["+25"], colours["+12"]) == ("w", "k")
    conditions = " ".join(figure.legends[0].get_title().get_text().split())
    assert "at friction 0.3, creepages of the wheelset" in conditions
    certain = build_number_view(planted_map((planted_cell(LOADS[0], 9.0),)), T_GAMMA_MAP)
    assert [words for _, words in certain.answers] == ["5 to 10 % too high"]
    assert certain.marks == []
    # each load has the colour of its step half way to its neighbours
    assert [band[:2] for band in view.columns[0].bands] == [(20.0, 35.0), (35.0, 75.0), (75.0, 100.0)]
    assert view.columns[2].bands == ()


def test_the_sentence_has_the_largest_errors_that_are_certain(errors):
    assert write_number_sentences(errors, T_GAMMA_MAP) == [
        "By Hertz T-gamma (wear number) is up to 25.0 ± 1.0 % too high at 0 mm and 20 kN, and up to 7.0 ± 1.0 % too low"
        " at 0 mm and 100 kN; in 1 of 5 cells the deviation is smaller than its uncertainty (friction 0.3, creepages of"
        " the wheelset)."
    ]
    small = planted_map(tuple(planted_cell(load, 0.5) for load in LOADS))
    assert write_number_sentences(small, T_GAMMA_MAP) == [
        "By Hertz T-gamma (wear number) has no deviation beyond its uncertainty in 3 cells (friction 0.3, creepages of"
        " the wheelset)."
    ]
    still = planted_map(tuple(planted_cell(load, None, None) for load in LOADS))
    assert write_number_sentences(still, T_GAMMA_MAP) == [
        "T-gamma (wear number) has no deviation: no T-gamma: no slip, or no force."
    ]
    assert write_number_sentences(planted_map(errors.positions[2].cells), T_GAMMA_MAP) == []


@pytest.mark.parametrize(
    ("creep", "words"),
    [
        (Creep(friction=0.3), "friction 0.3, creepages of the wheelset"),
        (Creep(friction=0.4, xi=2e-3), "friction 0.4, xi 0.2 %, other creepages of the wheelset"),
        (Creep(friction=0.3, xi=1e-3, eta=0.0, spin_per_mm=1e-4), "friction 0.3, xi 0.1 %, eta 0 %, spin 0.0001/mm"),
        (
            Creep(friction=0.3, speed_ratio=1.002, curved=True),
            "friction 0.3, creepages of the wheelset at 1.002 times the rolling speed on the curved surfaces",
        ),
        (Creep(), None),
    ],
)
def test_a_map_of_t_gamma_states_its_friction_and_creepages(creep, words):
    assert T_GAMMA_MAP.criterion(Case(creep=creep)) == words


def test_t_gamma_is_a_measure_of_maps_with_friction_alone(errors, tmp_path, capsys):
    refuse_measure(CASE, "t_gamma")
    with pytest.raises(InputError, match=r"measure is 't_gamma', but the map has no friction coefficient"):
        refuse_measure(Case(), "t_gamma")
    assert call(["map", "--shifts", "0", "--measure", "t_gamma", "--out", str(tmp_path / "map")]) == 2
    assert "--friction 0.3" in capsys.readouterr().err
    assert write_map_answer(errors, "t_gamma") == write_number_sentences(errors, T_GAMMA_MAP)
    assert write_number_answer(replace(errors, case=Case())) == []
    table = format_map(errors, "t_gamma").splitlines()
    assert table[1].split() == ["+0.00", "+25.0", "+12.0", "-7.0"]
    assert table == format_map_table(build_number_view(errors, T_GAMMA_MAP)).splitlines()
    assert load_offers("NUMBERS") == {"t_gamma": T_GAMMA_MAP}


# --- numbers of a solved contact


@pytest.fixture(scope="module")
def rolled(elliptic_quick):
    """Case where Hertz is exact, with all creepages, its judged load, and its cell."""
    case = replace(elliptic_quick.case, creep=Creep(friction=0.3, xi=1e-3, eta=-8e-4, spin_per_mm=1e-4))
    load = judge_load(replace(elliptic_quick.load.solved, case=case), elliptic_quick.placement)
    return load, elliptic_quick.placement


def test_t_gamma_and_its_error_follow_from_the_columns_of_a_map(rolled):
    """T-gamma is |Fx xi + Fy eta + Mz spin|.

    All values are columns of the row."""
    load, placement = rolled
    row = build_cell_row(build_solved_cell(0.0, load), placement)
    xi, eta, spin = (row[f"creep_creepages_{name}"] for name in ("xi", "eta", "spin_per_mm"))
    t_gamma = {}
    for side in ("hertz", "fe"):
        fx, fy, mz = (row[f"{COLUMN}_{side}_{name}"] for name in ("fx_N", "fy_N", "mz_Nmm"))
        t_gamma[side] = abs(fx * xi + fy * eta + mz * spin)
        assert row[f"{COLUMN}_{side}_power_per_speed_N"] == pytest.approx(t_gamma[side], rel=1e-9)
    expected = 1e2 * (t_gamma["hertz"] / t_gamma["fe"] - 1.0)
    # a part of T-gamma of 1e-11 is a percentage of 1e-9
    assert row[f"{COLUMN}_t_gamma_deviation_percent"] == pytest.approx(expected, abs=1e-9)
    for name in ("fx_{}_N", "fy_{}_N", "mz_{}_Nmm"):
        values = [row[f"{COLUMN}_{side}_{name.replace('_{}', '')}"] for side in ("hertz", "fe")]
        assert row[f"{COLUMN}_{name.format('deviation')}"] == values[0] - values[1]
    # each column has a known kind, so that comparisons have a tolerance for it
    assert [name for name in row if name.startswith("creep_") and find_kind(name) == "default"] == []


def test_the_errors_are_zero_within_their_uncertainties_where_hertz_is_exact(rolled):
    load, placement = rolled
    row = build_cell_row(build_solved_cell(0.0, load), placement)
    for deviation, uncertainty in (
        ("t_gamma_deviation_percent", "t_gamma_uncertainty_percent"),
        ("fx_deviation_N", "fx_uncertainty_N"),
        ("fy_deviation_N", "fy_uncertainty_N"),
        ("mz_deviation_Nmm", "mz_uncertainty_Nmm"),
        ("y_over_q_deviation", "y_over_q_uncertainty"),
    ):
        assert abs(row[f"{COLUMN}_{deviation}"]) <= row[f"{COLUMN}_{uncertainty}"], deviation
    # the uncertainties are small: below 2 % of mu N, and of mu N times the mean half-width
    limit_N = row["creep_limit_N"]
    assert row[f"{COLUMN}_fx_uncertainty_N"] < 0.02 * limit_N
    assert row[f"{COLUMN}_mz_uncertainty_Nmm"] < 0.02 * limit_N * math.sqrt(load.hertz.a_mm * load.hertz.b_mm)
    assert row[f"{COLUMN}_y_over_q_uncertainty"] < 0.02 * 0.3


def test_a_map_and_a_single_solution_have_one_error_of_t_gamma(rolled):
    load, placement = rolled
    position = MapPosition(
        lateral_shift_mm=0.0, cells=(build_solved_cell(0.0, load),), limit=LoadLimit(), placement=placement
    )
    single_map = ApplicabilityMap(case=load.case, loads_N=(load.load_N,), positions=(position,))
    reading = T_GAMMA_MAP.read_deviation(single_map.cells[0].judged)
    forces = compare_creep_forces(load, placement).theories[DECIDING_THEORY]
    assert reading.deviation_percent == forces.t_gamma_deviation_percent
    assert reading.uncertainty_percent == forces.t_gamma_uncertainty_percent
    # as `solve` prints it
    printed = " ".join(answer_creep_forces(load_record(load)["creep"]))
    assert f"(Hertz {reading.deviation_percent:+.1f} % ± {reading.uncertainty_percent:.1f} %)" in printed
    assert "t_gamma" in build_views(single_map)
    assert "t_gamma" not in build_views(replace(single_map, case=replace(load.case, creep=Creep())))


def test_the_uncertainty_of_a_component_is_at_most_that_of_the_force(rolled):
    load, placement = rolled
    rolling = build_rolling_load(load, placement, load.case.creep)
    motion = rolling.motion(rolling.creepages)
    uncertainty = estimate_force_uncertainty("fastsim", rolling, motion)
    assert uncertainty.force_of_muN == estimate_pressure_uncertainty("fastsim", rolling, motion)
    # each difference of components is at most the length of the difference of forces; 1e-12 is rounding
    largest_N = uncertainty.force_of_muN * rolling.limit_N * (1.0 + 1e-12)
    assert 0.0 < uncertainty.fx_N <= largest_N
    assert 0.0 < uncertainty.fy_N <= largest_N
    # a law without a moment has no uncertainty of it
    assert estimate_force_uncertainty("polach", rolling, motion).mz_Nmm is None


@pytest.mark.parametrize("shift_mm", [-4.0, 3.0, 5.0])
def test_y_over_q_turns_the_force_by_the_contact_angle(shift_mm):
    placement = place_case(Case(lateral_shift_mm=shift_mm, roll="touching"))
    angle = placement.first.contact_angle_rad
    for normal_N, fy_N in ((100e3, 0.0), (100e3, 2e4), (80e3, -2.4e4)):
        # the resultant leans by the contact angle, and back by the angle of friction
        expected = math.tan(angle - math.atan2(fy_N, normal_N))
        assert calculate_y_over_q(placement, normal_N, fy_N) == pytest.approx(expected, abs=1e-12)
    # a force on the wheel towards the field side pushes the rail inwards
    assert calculate_y_over_q(placement, 100e3, 1e4) < calculate_y_over_q(placement, 100e3, 0.0)


def test_y_over_q_needs_a_downward_force_on_the_rail():
    placement = place_case(Case())
    touch = SimpleNamespace(
        normal=placement.first.normal * 0.0 + [0.0, -math.sin(1.2), math.cos(1.2)],
        tangent=placement.first.tangent * 0.0 + [0.0, math.cos(1.2), math.sin(1.2)],
    )
    steep = SimpleNamespace(first=touch)
    assert calculate_y_over_q(steep, 1e3, -500.0) is None
    assert calculate_y_over_q(steep, 1e3, 0.0) == pytest.approx(math.tan(1.2), rel=1e-12)


def test_separate_patches_have_no_y_over_q(rolled, monkeypatch):
    load, placement = rolled
    patch = SimpleNamespace(patch_count=2)
    monkeypatch.setattr("fecontact.features.creep.creep_comparison.read_patch", lambda rung: patch)
    theories = compare_creep_forces(load, placement).theories
    assert {forces.y_over_q for forces in theories.values()} == {None}
    assert theories[DECIDING_THEORY].fx_deviation_N is not None
