"""Hertz's spring over an irregular wheel or rail.

Tested: the half-space with e in its gap, the models, the map, bad input.
"""

import json
import math
import pickle
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import fecontact
from fecontact.case import Case, make_case_record, read_case_record
from fecontact.cli import call
from fecontact.contact.halfspace import _build_grid
from fecontact.contact.patch import measure_patch
from fecontact.contact_theories.hertz import hertz_ellipse
from fecontact.contact_theories.rolling.saturation import saturate
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.irregular.command import IrregularOptions
from fecontact.features.irregular.model_errors import (
    find_largest_amplitude_mm,
    judge_cell,
    judge_place,
    make_irregular_place,
    solve_reference,
)
from fecontact.features.irregular.models import (
    MODELS,
    SmoothBodies,
    compute_eq6_limits,
    compute_filter_factor,
    compute_peak_exponent,
)
from fecontact.features.irregular.telling import format_irregular
from fecontact.guide.pages import read_page
from fecontact.outputs.case_words import case_words
from fecontact.outputs.pair_names import position_text
from fecontact.outputs.records.results import case_inputs, input_columns
from fecontact.outputs.records.stored import placement_record, restore_placement
from fecontact.placement.irregularity import (
    IRREGULARITY_FORMS,
    Irregularity,
    format_irregularity,
    parse_irregularity,
    read_irregularity_table,
)
from fecontact.runs.identity import make_case_id
from fecontact.runs.toml_cases import read_toml_cases
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

MODULUS = 210e3 / (2.0 * (1.0 - 0.3**2))
# wheel of 460 mm on a rail head of 300 mm, 100 kN: a/b 1.33
PAIR = SmoothBodies(A_per_mm=1 / 920, B_per_mm=1 / 600, contact_modulus_MPa=MODULUS)
FORCE = 100e3
HERTZ = PAIR.hertz(FORCE)
ELLIPTIC = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
WORDS = ("--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none")


def sine(wavelength, amplitude, **settings):
    return Irregularity(kind="sine", wavelength_mm=wavelength, amplitude_mm=amplitude, **settings)


def table(opening, half_length=60.0, step=1.0):
    s = np.arange(-half_length, half_length + 0.5 * step, step)
    return Irregularity(kind="table", points_mm=tuple(zip(s.tolist(), opening(s).tolist(), strict=True)))


def test_the_smooth_pair_is_that_of_the_reference():
    smooth_values = (HERTZ.a_mm, HERTZ.b_mm, HERTZ.approach_mm, HERTZ.p0_MPa, 1e-6 * HERTZ.stiffness_N_per_mm15)
    assert smooth_values == pytest.approx((7.1617, 5.3872, 0.104119, 1237.56, 2.9765), rel=2e-5)


# independent program, patches with up to 64 nodes per semi-axis; an edge has no peak
@pytest.mark.parametrize(
    ("line", "s", "approach", "peak"),
    [
        (sine(50.0, 0.010), 0.0, 0.112779, 1210.0),
        (sine(50.0, 0.010), 25.0, 0.095375, 1264.3),
        (sine(20.0, 0.010), 0.0, 0.106929, 1082.9),
        (sine(20.0, 0.010), 10.0, 0.100049, 1378.2),
        (sine(10.0, 0.005), 0.0, 0.102901, 1170.9),
        (sine(100.0, 0.050), 25.0, 0.102002, 1240.7),
        (sine(30.0, 0.100), 0.0, 0.134966, 1154.8),
        (Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.434783), 10.0, 0.277650, 1542.7),
        (Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.434783), 0.0, 0.467283, 916.7),
        (Irregularity(kind="chord", length_mm=40.0).on_wheel(460.0), 0.0, 0.48250, None),
    ],
)
def test_the_half_space_has_the_approach_and_the_peak_of_finer_nodes(line, s, approach, peak):
    truth = solve_reference(PAIR, FORCE, line, s)
    assert truth.approach_mm == pytest.approx(approach, rel=1e-3)
    assert truth.p_max_MPa == (None if peak is None else pytest.approx(peak, rel=3e-3))
    assert truth.residual < 2e-5


@pytest.mark.parametrize(
    "line",
    [
        sine(50.0, 0.010),
        Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.4),
        Irregularity(kind="chord", length_mm=40.0, depth_mm=0.4),
        table(lambda s: 2e-4 * s**2),
    ],
    ids=lambda line: line.kind,
)
def test_largest_slope_and_height_are_those_of_the_openings(line):
    """Slope as the measure of the irregularity in the gap that is in no mesh."""
    s = np.linspace(-60.0, 60.0, 120_001)
    opening = line.opening_mm(s)
    # of a table it is the slope between points 1 mm apart, and its end is steepest
    limit = 0.01 if line.kind == "table" else 1e-4
    assert line.largest_slope == pytest.approx(np.abs(np.diff(opening)).max() / (s[1] - s[0]), rel=limit)
    assert line.height_mm == pytest.approx(np.ptp(opening), rel=1e-5)


def test_models_on_a_wave_of_50_mm_are_those_of_the_independent_program():
    place = judge_place(PAIR, FORCE, sine(50.0, 0.010), 0.0)
    approaches = {"eq6": 0.114119, "path": 0.114119, "filtered": 0.112823, "local": 0.112719, "fitted": 0.112781}
    assert {name: model.approach_mm for name, model in place.models.items()} == pytest.approx(approaches, abs=1e-6)
    under = MODELS["fitted"].under(make_irregular_place(PAIR, FORCE, sine(50.0, 0.010), 0.0))
    assert under.p_max_MPa == pytest.approx(1210.9, rel=1e-4)


def test_a_parabola_is_hertz_with_another_curvature():
    bent = replace(PAIR, A_per_mm=PAIR.A_per_mm + 2e-4)
    hertz, smooth = bent.hertz(FORCE), sine(1e3, 1e-9)
    parabola = table(lambda s: 2e-4 * s**2)
    truth, same = solve_reference(PAIR, FORCE, parabola, 0.0), solve_reference(bent, FORCE, smooth, 0.0)
    # the same gap, on nodes that differ by where the search begins
    assert truth.approach_mm == pytest.approx(same.approach_mm, rel=1e-4)
    assert truth.p_max_MPa == pytest.approx(same.p_max_MPa, rel=1e-3)
    # nodes of 16 a semi-axis
    assert truth.approach_mm == pytest.approx(hertz.approach_mm, rel=4e-4)
    place = make_irregular_place(PAIR, FORCE, parabola, 0.0)
    for name in ("local", "fitted"):
        said = MODELS[name].under(place)
        assert (said.approach_mm, said.p_max_MPa) == pytest.approx((hertz.approach_mm, hertz.p0_MPa), rel=1e-6), name
        assert MODELS[name].force_N(place, hertz.approach_mm) == pytest.approx(FORCE, rel=1e-6), name


@pytest.mark.parametrize("name", MODELS)
def test_a_constant_opening_moves_the_approach_and_nothing_else(name):
    place = make_irregular_place(PAIR, FORCE, table(lambda s: 0.02 + 0.0 * s), 0.0)
    said = MODELS[name].under(place)
    assert (said.approach_mm - 0.02, said.p_max_MPa) == pytest.approx((HERTZ.approach_mm, HERTZ.p0_MPa), rel=1e-9)
    assert MODELS[name].force_N(place, said.approach_mm) == pytest.approx(FORCE, rel=1e-8)


# each model's two questions are inverse to each other
@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize(
    ("line", "s"),
    # on the crest of the long one the approach is below zero
    [*((sine(40.0, 0.012), s) for s in (0.0, 4.0, 11.0, 20.0)), *((sine(480.0, 0.3), s) for s in (0.0, 100.0, 240.0))],
)
def test_the_force_at_the_approach_under_a_force_is_that_force(name, line, s):
    place = make_irregular_place(PAIR, FORCE, line, s)
    assert MODELS[name].force_N(place, MODELS[name].under(place).approach_mm) == pytest.approx(FORCE, rel=1e-6)


@pytest.mark.parametrize("rail_radius_mm", [80.0, 300.0, 1500.0])
@pytest.mark.parametrize("lengths", [0.5, 1.0, 4.0])
def test_the_contact_filters_a_low_wave_by_its_length(rail_radius_mm, lengths):
    pair = replace(PAIR, B_per_mm=0.5 / rail_radius_mm)
    hertz = pair.hertz(FORCE)
    wavelength, amplitude = 2.0 * hertz.a_mm * lengths, 2e-3 * hertz.approach_mm
    # nodes of 16 a semi-axis lie elsewhere on a crest than in a hollow: a ten thousandth of the approach, 0.03 of this
    crest, hollow = (
        solve_reference(pair, FORCE, sine(wavelength, amplitude), s, nodes=32) for s in (0.0, 0.5 * wavelength)
    )
    slope = 0.5 * (crest.approach_mm - hollow.approach_mm) / amplitude
    assert slope == pytest.approx(compute_filter_factor(2.0 * math.pi / wavelength, hertz.a_mm), abs=0.01)


def test_a_wave_as_long_as_the_patch_is_filtered_out():
    assert compute_filter_factor(math.pi / HERTZ.a_mm, HERTZ.a_mm) == pytest.approx(0.0, abs=1e-15)
    place = make_irregular_place(PAIR, FORCE, sine(2.0 * HERTZ.a_mm, 0.003), 0.0)
    assert MODELS["filtered"].under(place).approach_mm == pytest.approx(HERTZ.approach_mm, abs=1e-12)


def test_a_phase_and_a_shift_are_the_same():
    shifted, turned_wave = (
        solve_reference(PAIR, FORCE, line, s)
        for line, s in ((sine(40.0, 0.02), 5.0), (sine(40.0, 0.02, phase_rad=0.25 * math.pi), 0.0))
    )
    assert shifted.approach_mm == pytest.approx(turned_wave.approach_mm, rel=1e-12)
    assert shifted.p_max_MPa == pytest.approx(turned_wave.p_max_MPa, rel=1e-9)


def test_lengths_and_the_square_of_the_force_scale_the_same_pressure():
    small = solve_reference(PAIR, FORCE, sine(30.0, 0.02), 4.0)
    twice = SmoothBodies(A_per_mm=0.5 * PAIR.A_per_mm, B_per_mm=0.5 * PAIR.B_per_mm, contact_modulus_MPa=MODULUS)
    large = solve_reference(twice, 4.0 * FORCE, sine(60.0, 0.04), 8.0)
    assert large.p_max_MPa == pytest.approx(small.p_max_MPa, rel=1e-9)
    assert large.approach_mm == pytest.approx(2.0 * small.approach_mm, rel=1e-9)


# largest amplitude over the approach with an error of 5 %, of an independent program; its own spread is some per cent
@pytest.mark.parametrize(
    ("model", "error", "lengths", "amplitude"),
    [
        ("eq6", "force_error", 1.0, 0.033),
        ("eq6", "force_error", 4.0, 0.28),
        ("eq6", "force_error", 8.0, 0.66),
        ("eq6", "peak_error", 0.7, 0.015),
        ("eq6", "peak_error", 2.0, 0.070),
        ("eq6", "peak_error", 5.6, 0.51),
        ("path", "force_error", 5.6, 0.59),
        ("filtered", "force_error", 2.0, 0.26),
        ("local", "force_error", 1.4, 0.089),
        ("fitted", "peak_error", 1.0, 0.047),
    ],
)
def test_the_limits_of_the_map_are_those_of_an_independent_program(model, error, lengths, amplitude):
    cells = [
        judge_cell(PAIR, FORCE, 2.0 * lengths * HERTZ.a_mm, share * amplitude * HERTZ.approach_mm)
        for share in (0.85, 1.15)
    ]
    amplitude_mm = find_largest_amplitude_mm(cells, model, (error,))
    assert amplitude_mm is not None
    assert amplitude_mm / HERTZ.approach_mm == pytest.approx(amplitude, rel=0.1)


# the same limits of eq. 6, the least of force and peak, in closed form
@pytest.mark.parametrize(
    ("lengths", "amplitude", "tolerance"),
    [
        (0.5, 0.012, 0.08),
        (1.0, 0.023, 0.08),
        (2.0, 0.070, 0.08),
        (2.8, 0.132, 0.08),
        (4.0, 0.26, 0.2),
        (8.0, 0.66, 0.08),
    ],
)
def test_closed_forms_draw_the_limit_of_eq_6(lengths, amplitude, tolerance):
    limits = compute_eq6_limits(PAIR, FORCE, 2.0 * lengths * HERTZ.a_mm)
    assert min(limits.force_mm, limits.peak_mm) / HERTZ.approach_mm == pytest.approx(amplitude, rel=tolerance)


def test_a_circle_has_a_third_of_both_curvatures_in_its_peak():
    # p0 goes with (A + B)^(2/3)
    assert compute_peak_exponent(replace(PAIR, B_per_mm=PAIR.A_per_mm)) == pytest.approx(1.0 / 3.0, rel=1e-6)


def test_a_rounded_flat_is_two_contacts_in_its_middle_and_eq_6_loses_it_on_the_flank():
    wheel_flat = Irregularity(kind="haversine", length_mm=40.0, depth_mm=0.434783)
    middle, flank = (judge_place(PAIR, FORCE, wheel_flat, s) for s in (0.0, 10.0))
    assert middle.truth.patch.patch_count == 2
    assert middle.truth.approach_mm == pytest.approx(0.278 + HERTZ.approach_mm, rel=2e-3)
    assert flank.truth.approach_mm == pytest.approx(0.0982 + HERTZ.approach_mm, rel=2e-3)
    assert flank.models["eq6"].force_N == 0.0
    assert flank.models["path"].force_error == pytest.approx(0.32, abs=0.01)
    assert abs(flank.models["local"].force_error) < 0.015
    assert abs(flank.models["fitted"].force_error) < 0.005


def test_a_map_is_the_same_on_any_number_of_workers():
    waves = {"wavelengths_mm": [20.0, 60.0], "amplitudes_mm": [0.006, 0.04]}
    alone, on_workers = (fecontact.irregular(ELLIPTIC, **waves, workers=workers) for workers in (1, 2))
    assert alone == on_workers
    first = alone["cells"][0]
    assert set(first["models"]) == set(MODELS)
    assert set(first["models"]["eq6"]) == {"force_error", "peak_error", "holds"}
    assert [cell["models"]["eq6"]["holds"] for cell in alone["cells"]] == [False, False, True, False]


def test_the_command_prints_a_map_and_writes_it(capsys, tmp_path):
    words = ("irregular", *WORDS, "--wavelengths-mm", "30,60", "--amplitudes-um", "5,20", "--workers", "1")
    assert call([*words, "--json", "--out", str(tmp_path)]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record == json.loads((tmp_path / "irregular.json").read_text())
    assert (tmp_path / "irregular.png").stat().st_size > 10_000
    # the picture says which pair, position and force, and what the models are
    picture = (tmp_path / "irregular.svg").read_text("utf-8")
    for printed in ("rail circle:300", "shift +0.00 mm", "the cheapest model that holds", "in the middle"):
        assert printed in picture
    page = ElementTree.fromstring((tmp_path / "report.html").read_text("utf-8").removeprefix("<!DOCTYPE html>\n"))
    holding_count = sum(cell["models"]["eq6"]["holds"] for cell in record["cells"])
    (headline,) = (heading.text for heading in page.iter("h1"))
    assert headline == (
        f"Hertz's spring (eq6) holds in {holding_count} of 4 cells of wavelength and amplitude: force and peak pressure"
        " within 5 %"
    )
    assert len([*page.iter("img")]) == 1
    pair = record["pair"]
    assert f"patch {2.0 * pair['a_mm']:.1f} mm long, approach {1e3 * pair['approach_mm']:.0f} µm" in picture
    # corrugation of 30 mm: between 5 and 20 um, as in the sheet 8 um
    limits = {limit["wavelength_mm"]: limit["amplitude_mm"]["eq6"] for limit in record["limits"]}
    assert 0.006 < limits[30.0] < 0.0105
    assert call(list(words)) == 0
    printed = capsys.readouterr().out
    assert "Largest amplitude with errors of force and peak within 5 %" in printed


# at 0 mm the patch of S1002 on 60E1 reaches over a junction to a second lobe; two cylinders are Hertz's own bodies
@pytest.mark.parametrize(("case", "holds"), [(Case(), False), (Case(lateral_shift_mm=-4.0), True), (ELLIPTIC, True)])
def test_whether_hertz_holds_without_the_irregularity_is_said(case, holds):
    record = fecontact.irregular(case, wavelengths_mm=[60.0], amplitudes_mm=[0.01])
    smooth_record = record["without_irregularity"]
    alone, hertz = (fecontact.theory(case, name) for name in ("half_space", "hertz"))
    off = {
        "peak_error": hertz["p_max_MPa"] / alone["p_max_MPa"] - 1.0,
        # a spring of the power 1.5
        "force_error": (alone["approach_mm"] / hertz["approach_mm"]) ** 1.5
        * hertz["normal_force_N"]
        / alone["normal_force_N"]
        - 1.0,
    }
    assert {name: smooth_record[name] for name in off} == pytest.approx(off, abs=1e-3)
    assert (smooth_record["holds"], smooth_record["problem"]) == (holds, None)
    _, line, *_ = format_irregular(record)
    assert line.startswith(
        f"Hertz's force and peak {'hold' if holds else 'FAIL'} on the full profiles without the irregularity: "
    )
    assert f"{100 * off['peak_error']:+z.1f} %" in line


def test_a_half_space_without_an_answer_leaves_open_whether_hertz_holds(monkeypatch):
    def failing(*_):
        raise ConvergenceError("it grows without bound")

    monkeypatch.setattr("fecontact.features.irregular.model_errors.evaluate_theory", failing)
    record = fecontact.irregular(ELLIPTIC, wavelengths_mm=[60.0], amplitudes_mm=[0.01])
    assert record["without_irregularity"]["holds"] is None
    _, line, *_ = format_irregular(record)
    assert line.endswith("without the irregularity: it grows without bound")


def test_a_measured_line_has_its_worst_places_named(capsys, tmp_path):
    s = np.arange(0.0, 121.0)
    e = 0.02 * np.cos(2.0 * np.pi * s / 30.0)
    path = tmp_path / "rail.csv"
    path.write_text("s_mm,e_um\n" + "".join(f"{a:g},{1e3 * b:.6f}\n" for a, b in zip(s, e, strict=True)))
    words = ("irregular", *WORDS, "--workers", "1", "--positions-mm", "45,52.5,60")
    assert call([*words, "--table", str(path), "--json"]) == 0
    measured = json.loads(capsys.readouterr().out)
    assert call([*words, "--irregularity", "sine:wavelength_mm=30,amplitude_um=20", "--json"]) == 0
    exact = json.loads(capsys.readouterr().out)
    for measured_place, exact_place in zip(measured["places"], exact["places"], strict=True):
        assert measured_place["approach_mm"] == pytest.approx(exact_place["approach_mm"], rel=1e-4)
    worst = measured["worst"]["eq6"]
    assert worst["force_error_at_mm"] in (45.0, 60.0)
    assert abs(worst["force_error"]) > 0.1 > abs(measured["worst"]["fitted"]["force_error"])


def test_a_model_is_within_the_limit_at_the_places_where_it_holds():
    # `filtered` says nothing of the peak of a wave that all others follow; nothing has a peak at the edge of a chord
    for text, positions in (
        ("sine:wavelength_mm=60,amplitude_um=2", [0.0, 30.0]),
        ("chord:length_mm=40", [10.0, 20.0]),
    ):
        record = fecontact.irregular(ELLIPTIC, irregularity=text, positions_mm=positions)
        for name in MODELS:
            holding = [place["models"][name]["holds"] for place in record["places"]]
            assert record["worst"][name]["share_within_limit"] == sum(holding) / len(holding), name


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sine:wavelength_mm=30", "amplitude_mm is missing"),
        ("sine:wavelength_mm=30,amplitude_um=-3", "allowed: finite and > 0"),
        ("sine:wavelength_mm=30,amplitude_um=25,length_mm=3", "length_mm is not an input of this kind"),
        ("sine:wavelength=30,amplitude_um=25", "did you mean wavelength_mm"),
        ("sine:wavelength_mm=10,amplitude_um=200", "its largest slope is 0.126"),
        ("square:wavelength_mm=10", "allowed: sine, chord, haversine, table"),
        ("table:", "file is missing"),
        ("table:nowhere.csv", "there is no file of at most 20 MB"),
    ],
)
def test_a_text_that_is_no_irregularity_says_what_is(text, said):
    with pytest.raises(InputError, match=said):
        parse_irregularity(text)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0,0\n1,0\n2,0\n3,0\n4,0\n", "the unit of column distance is missing"),
        ("s_mm,e\n0,0\n1,0\n2,0\n3,0\n4,0\n", "the unit of column opening is missing"),
        ("s_mm,e_um\n0,0\n1,0\n2,0\n9,0\n10,0\n11,0\n", "a gap of 7 mm from 2 to 9 mm"),
        ("s_mm,e_mm\n0,0\n1,0\n2,0\n3,0.2\n4,0.2\n5,0.2\n", "a step of .0.2 mm from 2 to 3 mm is a slope of 0.2"),
        ("s_mm,e_mm\n0,0\n1,0\n1,0\n3,0\n4,0\n", "the distance does not increase at 1 mm"),
        ("s_mm,e_mm\n0,0\n1,0\n", "2 points; allowed: at least 5"),
        ("s_mm,e_mm\n0,0\n1,high\n", "row 2 is not a pair of numbers"),
    ],
)
def test_tables_with_gaps_steps_or_no_units_are_named(tmp_path, rows, said):
    path = tmp_path / "line.csv"
    path.write_text(rows)
    with pytest.raises(InputError, match=said):
        parse_irregularity(f"table:{path}")


def test_units_of_a_table_are_converted(tmp_path):
    path = tmp_path / "line.csv"
    path.write_text("# a weld\n0 0\n0.001 10\n0.002 20\n0.003 10\n0.004 0\n")
    line = parse_irregularity(f"table:{path},distance=m,opening=um")
    assert line.points_mm[1:3] == ((1.0, 0.01), (2.0, 0.02))


POINTS = [(0.5 * number, 0.01 * (number % 2)) for number in range(40)]


@pytest.mark.parametrize(
    ("heading", "separator", "encoding"),
    [
        ("s_mm;e_mm", ";", "utf-8"),
        ("", ";", "utf-8"),
        ("s_mm\te_mm", "\t", "utf-16"),
        ("Länge_mm\te_mm", "\t", "utf-8-sig"),
    ],
)
def test_tables_with_decimal_commas_are_read(tmp_path, heading, separator, encoding):
    path = tmp_path / "points.csv"
    rows = [f"{s}{separator}{e}".replace(".", ",") for s, e in POINTS]
    path.write_bytes("\n".join([heading, *rows]).encode(encoding))
    table_read = read_irregularity_table(path, distance_unit="mm", opening_unit="mm")
    assert table_read.points_mm == tuple(POINTS)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("s_mm,e_mm\n1,5,0,1\n2,5,0,2\n", "has 4 cells, and the first row has 2"),
        ("s_mm\n1,2\n3,4\n", "has 2 cells, and the first row has 1"),
        (f"s_mm,e_mm\n{'1' * 200_000},2\n", "cannot be divided into cells"),
        ('s_mm,e_mm\n"1,2\n', "cannot be divided into cells"),
        ("s_mm,e_mm\n1\0,2\n", "line 2 has a NUL character"),
        ("Länge_mm,e_mm\n1,2\n".encode("latin-1"), "line 1 has the byte 0xE4, which is not UTF-8"),
    ],
)
def test_defects_of_tables_are_refused(tmp_path, content, message):
    path = tmp_path / "points.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError, match=message):
        read_irregularity_table(path)


def test_what_nodes_cannot_follow_or_a_table_does_not_reach_is_refused():
    with pytest.raises(InputError, match=r"the shortest wave is 1 mm; allowed: at least 1\.8 mm on a patch"):
        fecontact.irregular(ELLIPTIC, wavelengths_mm=[1.0], amplitudes_mm=[1e-4])
    line = table(lambda s: 1e-4 * s)
    with pytest.raises(InputError, match="the contact at 58 mm reaches beyond its ends, -60 and 60 mm"):
        fecontact.irregular(ELLIPTIC, irregularity=line, positions_mm=[58.0])
    with pytest.raises(InputError, match="give either wavelengths and amplitudes for a map, or an irregularity"):
        fecontact.irregular(ELLIPTIC)
    with pytest.raises(InputError, match="yaw is 3 mrad; allowed: 0"):
        fecontact.irregular(replace(ELLIPTIC, yaw_rad=3e-3), wavelengths_mm=[50.0], amplitudes_mm=[0.01])


def test_amplitudes_that_lift_the_wheel_off_and_lost_contacts_and_edges_are_named():
    high = fecontact.irregular(ELLIPTIC, wavelengths_mm=[160.0], amplitudes_mm=[0.2])
    assert any("leaves the rail over the hollows" in note for note in high["notes"])
    wheel_flat = fecontact.irregular(ELLIPTIC, irregularity="chord:length_mm=40", positions_mm=[10.0])
    assert any("eq6 has no contact at 1 of 1 place" in note for note in wheel_flat["notes"])
    assert any("is unbounded" in note and "haversine" in note for note in wheel_flat["notes"])
    assert wheel_flat["places"][0]["p_max_MPa"] is None
    # a cell that is too steep is one that says why, among others that are solved
    steep = fecontact.irregular(ELLIPTIC, wavelengths_mm=[12.0], amplitudes_mm=[0.01, 0.2])
    assert [cell["problem"] is None for cell in steep["cells"]] == [True, False]


# --- irregular bodies of a case ---------------------------------------------------------------------------------------


WAVE = sine(50.0, 0.010)


def irregular_case(line, distance=0.0, **settings):
    """Case of a circular rail head at a distance (mm) along an irregularity."""
    return Case(
        rail="circle:300",
        wheel="cylinder:460",
        inclination_rad=0.0,
        rail_irregularity=line,
        distance_mm=distance,
        **settings,
    )


@pytest.mark.parametrize(
    ("line", "distance", "approach", "peak"),
    [
        (WAVE, 0.0, 0.112779, 1210.0),
        (WAVE, 25.0, 0.095375, 1264.3),
        (sine(20.0, 0.010), 10.0, 0.100049, 1378.2),
        # the rigid wheel stands on two crests, the loaded patch is one
        (sine(30.0, 0.100), 0.0, 0.134966, 1154.8),
        (Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.434783), 10.0, 0.277650, 1542.7),
    ],
)
def test_the_half_space_of_a_case_has_the_irregularity_in_its_gap(line, distance, approach, peak):
    _, expected = expect_on_half_space(irregular_case(line, distance))
    placement, rung = expected.true_gap.placement, expected.half_space
    # from where smooth bodies touch; nodes of 32 a semi-axis, and circles for parabolas
    assert rung.approach_mm + placement.along.lowered_mm == pytest.approx(approach, rel=3e-4)
    assert measure_patch(rung.pressure).p_max_MPa == pytest.approx(peak, rel=1e-3)


def test_contact_points_and_hertz_follow_gap_and_irregularity():
    two = place_case(irregular_case(sine(30.0, 0.100)))
    touches = make_irregular_place(PAIR, FORCE, sine(30.0, 0.100), 0.0).touches
    assert sorted(touch.x_mm for touch in two.contact_points) == pytest.approx(
        sorted(touch.x_mm for touch in touches[:2]), rel=1e-5
    )
    assert two.along.lowered_mm == pytest.approx(touches[0].gap_mm, abs=1e-6)
    hertz = fecontact.hertz(irregular_case(WAVE))["ellipses"][0]
    local = MODELS["local"].under(make_irregular_place(PAIR, FORCE, WAVE, 0.0))
    assert hertz["p_max_MPa"] == pytest.approx(local.p_max_MPa, rel=1e-4)


def test_rail_and_wheel_enter_alike_and_add_up():
    base = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    half = sine(50.0, 0.005)
    alone, wheel, rail_and_wheel = (
        fecontact.theory(Case(**base, distance_mm=7.0, **lines), "half_space")
        for lines in (
            {"rail_irregularity": WAVE},
            {"wheel_irregularity": WAVE},
            {"rail_irregularity": half, "wheel_irregularity": half},
        )
    )
    assert alone["p_max_MPa"] == wheel["p_max_MPa"]
    assert rail_and_wheel["p_max_MPa"] == pytest.approx(alone["p_max_MPa"], rel=1e-9)


def test_what_is_irregular_is_solved_whole_and_told_in_the_case():
    case = irregular_case(WAVE, 3.0)
    assert (ELLIPTIC.half, case.half) == (True, False)
    record = make_case_record(case)
    assert read_case_record(json.loads(json.dumps(record))) == case
    # smooth bodies are printed as before irregular bodies existed
    assert not {"rail_irregularity", "wheel_irregularity", "distance_mm"} & make_case_record(ELLIPTIC).keys()
    # a table goes to workers with its points
    measured = irregular_case(table(lambda s: 1e-4 * s**2))
    measured.rail_irregularity.opening_mm(0.5)
    assert pickle.loads(pickle.dumps(measured)) == measured
    assert read_case_record(json.loads(json.dumps(make_case_record(measured)))) == measured


def test_a_study_has_irregularities_as_texts_or_tables_and_lists_of_distances(tmp_path):
    path = tmp_path / "waves.toml"
    path.write_text(
        'rail = "circle:300"\nwheel = "cylinder:460"\ninclination = "none"\ndistance_mm = "0:25:12.5"\n'
        'rail_irregularity = "sine:wavelength_mm=50,amplitude_um=10"\n'
        'wheel_irregularity = {kind = "haversine", length_mm = 80, depth_um = 100}\n'
    )
    cases = read_toml_cases(path)
    assert [case.distance_mm for case in cases] == [0.0, 12.5, 25.0]
    assert cases[0].rail_irregularity == WAVE
    assert cases[0].wheel_irregularity == Irregularity(kind="haversine", length_mm=80.0, depth_mm=0.1)
    assert len({make_case_id(case) for case in cases}) == 3
    assert input_columns(cases[1])["distance_mm"] == 12.5
    assert input_columns(cases[1])["rail_irregularity"] == "sine:wavelength_mm=50,amplitude_mm=0.01"
    assert position_text(input_columns(cases[1])) == "+0.00 mm, 100 kN, at 12.5 mm"
    words = case_words(case_inputs(cases[1], place_case(cases[1])))
    assert "at 12.5 mm of rail sine:wavelength_mm=50,amplitude_mm=0.01, wheel haversine:length_mm=80" in words


def test_the_command_line_takes_the_same_text(capsys):
    words = ("hertz", *WORDS, "--rail-irregularity", "sine:wavelength_mm=50,amplitude_um=10", "--json")
    assert call(list(words)) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(fecontact.hertz(irregular_case(WAVE))))


def test_edges_and_ends_of_tables_are_refused():
    chord = Irregularity(kind="chord", length_mm=40.0)
    with pytest.raises(InputError, match="the contact point is on an edge of the irregularity"):
        place_case(irregular_case(chord))
    with pytest.raises(InputError, match="at 25 mm an edge of the irregularity is in the contact patch"):
        expect_on_half_space(irregular_case(chord, 25.0))
    with pytest.raises(InputError, match="reaches beyond the table of the irregularity"):
        expect_on_half_space(irregular_case(table(lambda s: 1e-4 * s), 58.0))
    with pytest.raises(InputError, match="rail irregularity is 'sine'; allowed: Irregularity"):
        Case(rail_irregularity="sine")


@pytest.mark.slow
def test_finite_bodies_add_nothing_of_an_irregularity():
    """Change of the peak of the smooth pair by finite bodies.

    It agrees within the slope, which is part of the uncertainty.
    """
    quick = {"resolution": "quick", "refine": "never"}
    smooth = fecontact.solve(replace(ELLIPTIC, **quick)).load
    waves = (
        (WAVE, 25.0),
        (sine(20.0, 0.010), 10.0),
        (Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.434783), 10.0),
    )
    for line, distance in waves:
        load = fecontact.solve(irregular_case(line, distance, **quick)).load
        added, step_of_bodies = (
            step_mm.ladder.steps["half_space_to_bodies"]["p_max_MPa"] for step_mm in (smooth, load)
        )
        assert abs(step_of_bodies - added) < line.largest_slope, line.kind
        assert load.uncertainty["p_max_MPa"] > line.largest_slope
        assert load.status == "converged"


def test_a_stored_wheel_stands_as_low_as_the_placed_one():
    case = Case(rail_irregularity=parse_irregularity("sine:wavelength_mm=50,amplitude_mm=0.03"), distance_mm=12.0)
    placement = place_case(case)
    stored = restore_placement(case, json.loads(json.dumps(placement_record(placement), default=float)))
    assert placement.along.lowered_mm != 0.0
    x, s = np.linspace(-8.0, 8.0, 9)[:, None], np.linspace(-3.0, 3.0, 5)[None, :]
    np.testing.assert_array_equal(stored.gap(x, s), placement.gap(x, s))
    assert input_columns(case, stored) == input_columns(case, placement)


def test_a_sine_is_said_to_be_a_cosine_where_it_is_asked_for():
    assert sine(30.0, 0.025).opening_mm(0.0) == 0.025
    said = "a cosine"
    for text in (IRREGULARITY_FORMS, read_page("irregular"), IrregularOptions.__doc__):
        assert said in text


def test_misprints_of_the_source_are_told_where_its_equations_are_explained():
    """Misprints of eq. 4 (semi-axes), eq. 12 (saturation) and eq. 16 (steady motion)."""
    steady = pytest.importorskip("fecontact.features.curves.steady")
    for where, equation in (
        ((hertz_ellipse.__doc__, read_page("irregular")), "eq. 4"),
        ((saturate.__doc__, read_page("creep")), "eq. 12"),
        ((steady.__doc__, read_page("curves")), "16"),
    ):
        for text in where:
            assert equation in text
            assert re.search(r"misprint|lacks|factor π", text)
    # what they would make: cube root of pi in the semi-axes, no force where it saturates
    assert math.pi ** (1.0 / 3.0) == pytest.approx(1.4646, abs=1e-4)
    assert 3.0 - 3.0**2 / 3.0 == 0.0


def test_a_table_is_told_by_the_number_of_its_points_and_its_ends():
    table = Irregularity(kind="table", points_mm=((-30.0, 0.0), (-10.0, 0.01), (0.0, 0.02), (5.0, 0.03), (20.5, 0.0)))
    assert format_irregularity(table) == "table of 5 points from -30 to 20.5 mm"


@pytest.mark.parametrize("length_mm", [3.7, 8.0, 11.3])
def test_the_nodes_of_the_half_space_do_not_depend_on_the_last_digits(length_mm):
    """Each length is a whole number of steps but for its rounding error."""
    grids = [
        _build_grid(-length_mm + error_mm, length_mm, 0.7 * length_mm, 2.0 * length_mm / 49, 0.7 * length_mm / 13)
        for error_mm in (-1e-13, 0.0, 1e-13)
    ]
    for grid in grids[1:]:
        assert grid.s_mm == pytest.approx(grids[0].s_mm, abs=1e-10)
        assert grid.x_mm == pytest.approx(grids[0].x_mm, abs=1e-10)
