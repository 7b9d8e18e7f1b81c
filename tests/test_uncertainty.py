"""The stated uncertainty: its contributions, and its relation to exact errors."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rungs import rung_with

from fecontact.case import Case, Track
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.contact_theories.registry import HERTZ
from fecontact.judging.measures import (
    MEASURES,
    MISFITS,
    UNCERTAINTIES,
    read_measures,
    read_patch,
)
from fecontact.judging.solved_load import (
    compare_with_more_nodes,
    compute_peak_lobe_share,
    compute_skewness,
    estimate_irreducible_budgets,
    read_quality,
)
from fecontact.judging.uncertainty import (
    SolutionQuality,
    estimate_cut_plane_share,
    estimate_elements_budget,
    estimate_share_uncertainty,
    estimate_step_budget,
    estimate_uncertainty,
)
from fecontact.judging.verdict import judge_profile_variants
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.reading import Reading
from fecontact.solving.expected_patch import solve_on_more_nodes
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_position
from fecontact.solving.profile_variants import estimate_hertz_uncertainty, judge_case_variants
from fecontact.solving.solve import solve

# Of reading one field, and of a cut plane that is moved out by half and what meshes have in common, written down a
# second time.
REST = {
    "p_max_MPa": (0.0006, 0.0014 + 0.0006),
    "area_mm2": (0.002, 0.0019),
    "a_mm": (0.0004, 0.0009 + 0.0005),
    "b_mm": (0.0005, 0.0018 + 0.0008),
    "extent_x_mm": (0.01, 0.0009),
    "extent_y_mm": (0.01, 0.0018),
    "centre_over_b": (0.0003, 0.004 + 0.0005),
    "valley": (0.0005, 0.001 + 0.0006),
    "separate_load": (0.000025, 0.0),
    "misplaced_load": (0.0008, 0.0008 + 0.0004),
}
# What is read of the misplaced load of Hertz's own ellipse; where there is more, it adds to its square.
NOISE = 0.0014
READING = {name: reading for name, (reading, _) in REST.items()}
STEP = {name: cut for name, (_, cut) in REST.items()}
SIZES = tuple(name for name in READING if name in MEASURES)
BESIDE = tuple(name for name in READING if name in MISFITS)


def read(name: str, value: float) -> float:
    """Uncertainty of reading a value off its nodes, as a second implementation."""
    if name != "misplaced_load":
        return READING[name]
    return READING[name] + (NOISE if value <= NOISE else value - math.sqrt(value * value - NOISE * NOISE))


# --- what it is made of -----------------------------------------------------------------------------------------


def test_every_measure_but_the_approach_has_an_uncertainty():
    assert {name: declared.reading for name, declared in UNCERTAINTIES.items()} == {**READING, "approach_mm": None}
    assert {
        name: UNCERTAINTIES[name].cut_planes + UNCERTAINTIES[name].common_mesh_error for name in STEP
    } == pytest.approx(STEP)
    assert set(UNCERTAINTIES) == {*MEASURES, *MISFITS}
    assert estimate_uncertainty("approach_mm", (0.1, 0.1)) is None


@pytest.mark.parametrize("name", SIZES)
def test_a_size_is_known_to_its_last_change_and_what_no_mesh_takes_away(name):
    # a change of 2 % of the finest value, whatever its unit and sign
    for finest in (1000.0, 2e-3, -5.0):
        for change in (0.02, -0.02):
            value = estimate_uncertainty(name, (finest, finest * (1.0 + change)), SolutionQuality(residual=1e-4))
            assert value == pytest.approx(READING[name] + 0.02 + STEP[name] + 1e-4, rel=1e-9)


@pytest.mark.parametrize("name", BESIDE)
def test_what_hertz_has_none_of_is_known_absolutely(name):
    # relative to nothing: most are zero on the finest mesh
    for values in ((0.0, 0.02), (0.02, 0.0), (-0.3, -0.32)):
        rest = read(name, values[0]) + STEP[name] + 1e-4
        assert estimate_uncertainty(name, values, SolutionQuality(residual=1e-4)) == pytest.approx(
            0.02 + rest, rel=1e-9
        )


@pytest.mark.parametrize("name", READING)
def test_equal_meshes_still_leave_the_rest(name):
    rest = read(name, 7.0) + STEP[name]
    assert estimate_uncertainty(name, (7.0, 7.0)) == pytest.approx(rest, rel=1e-9)
    assert estimate_step_budget(name, (7.0, 7.0)).total == pytest.approx(STEP[name], abs=1e-12)


def test_the_noise_of_the_misplaced_load_adds_to_its_square():
    for share in (0.0014, 0.01, 0.2):
        # read is the root of the sum of both squares, and what is stated brings it back
        value = math.hypot(share, NOISE)
        assert value - (read("misplaced_load", value) - READING["misplaced_load"]) == pytest.approx(share, rel=1e-9)
    assert estimate_uncertainty("misplaced_load", (NOISE, NOISE)) == pytest.approx(
        NOISE + sum(REST["misplaced_load"]), rel=1e-9
    )


@given(
    name=st.sampled_from(tuple(READING)),
    values=st.lists(st.floats(0.5, 2.0), min_size=2, max_size=4),
    residual=st.floats(0.0, 0.1),
)
def test_a_step_on_the_same_nodes_has_no_reading_in_it(name, values, residual):
    stated = estimate_uncertainty(name, values, SolutionQuality(residual=residual))
    reading = read(name, values[0])
    assert stated - estimate_step_budget(name, values, SolutionQuality(residual=residual)).total == pytest.approx(
        reading, rel=1e-9, abs=1e-15
    )
    # neither less than the rest nor less than the last change; a mesh before adds what it changed itself, or nothing
    size = values[0] if name in SIZES else 1.0
    assert stated >= reading + residual
    assert stated >= abs(values[0] - values[1]) / size
    assert stated >= estimate_uncertainty(name, values[:2], SolutionQuality(residual=residual))


@pytest.mark.parametrize("name", READING)
def test_a_last_change_that_is_small_by_chance_does_not_hide_the_one_before(name):
    # an error that falls with the size of the elements: two thirds of the change before are left
    by_chance, falling = estimate_uncertainty(name, (1.0, 1.0, 1.03)), estimate_uncertainty(name, (1.0, 1.02, 1.05))
    assert by_chance == pytest.approx(estimate_uncertainty(name, (1.0, 1.02)), rel=1e-12)
    assert falling == pytest.approx(by_chance, rel=1e-12)
    assert estimate_uncertainty(name, (1.0, 1.02, 1.021)) == pytest.approx(by_chance, rel=1e-12)


@pytest.mark.parametrize("name", READING)
@pytest.mark.parametrize("values", [(math.nan, 1.0), (1.0, math.nan), (1.0, 1.1, math.nan), (1.0, math.inf)])
def test_no_number_no_uncertainty(name, values):
    assert math.isnan(estimate_uncertainty(name, values))
    assert math.isnan(estimate_step_budget(name, values).total)


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("order", [0.8, 1.0, 1.5, 2.0, 3.0])
def test_an_error_that_falls_with_the_elements_is_covered(name, order):
    """Elements 1.5 times larger have errors r^p times larger.

    The remaining error is less than the change for p = 0.6 and more.
    """
    # the rest of the uncertainty covers what r^0.8 - 1 = 0.38 of an error of 0.2 % leaves out
    error = 0.002
    values = (1.0 + error, 1.0 + error * 1.5**order)
    assert estimate_uncertainty(name, values) >= error / (1.0 + error)


# Of a rail that is cut farther down, where several patches share the load, written down a second time.
SHARED = {
    "p_max_MPa": 0.006,
    "a_mm": 0.0015,
    "b_mm": 0.006,
    "extent_y_mm": 0.006,
    "centre_over_b": 0.006,
    "valley": 0.005,
    "misplaced_load": 0.0045,
}


@pytest.mark.parametrize("name", READING)
def test_each_part_of_it_counts_as_often_as_its_source_says(name):
    """A change of 1 % of values of 7, with each contribution alone."""
    size = 7.0 if name in SIZES else 1.0
    finest, change = 7.0, 0.01 * size

    def step(values=(finest, finest), otherwise=None, **settings) -> float:
        return estimate_step_budget(name, values, SolutionQuality(**settings), otherwise=otherwise).total

    rest = step()
    assert step((finest, finest + change)) - rest == pytest.approx(0.01, rel=1e-9)
    # where patches just come apart the last change is off by 1.09 of it
    assert step((finest, finest + change), parting=True) - rest == pytest.approx(0.015, rel=1e-9)
    assert step(otherwise=finest - change) - rest == pytest.approx(0.02, rel=1e-9)
    # bodies softer by a part move the area by 0.045 of it; what is not seen is 6 %, as on a gauge corner
    assert step(compliance_error=-0.02) - rest == pytest.approx(0.05 * 0.02 * finest / size, rel=1e-9)
    assert step(compliance_error=math.nan) - rest == pytest.approx(0.05 * 0.06 * finest / size, rel=1e-9)
    cut = UNCERTAINTIES[name].cut_planes
    planes = 0.016 * finest if name == "separate_load" else max(cut, SHARED.get(name, 0.0))
    assert step(shared=True) - rest == pytest.approx(planes - cut, abs=1e-12)
    # a notch one to three nodes wide has three times the change by more nodes
    values = (finest, finest)
    increase = estimate_uncertainty(name, values, SolutionQuality(more_nodes={name: 0.03})) - estimate_uncertainty(
        name, values
    )
    # the change to 96 nodes is twice this one, and replaces the reading of the area and of the length across
    expected = 1.25 * 0.06 - READING[name] if name in ("area_mm2", "extent_y_mm") else 0.09
    assert increase == pytest.approx(expected, rel=1e-9)


# Of reading the elements' own nodes with six on a semi-axis, and with which power of their number it falls.
ON_ELEMENTS = {
    "p_max_MPa": (0.0025, 1),
    "area_mm2": (0.024, 1),
    "a_mm": (0.01, 2),
    "b_mm": (0.01, 2),
    "extent_x_mm": (0.025, 1),
    "extent_y_mm": (0.025, 1),
    "centre_over_b": (0.003, 2),
    "valley": (0.01, 2),
    "separate_load": (0.0004, 2),
    "misplaced_load": (0.0135, 1),
}


@pytest.mark.parametrize("name", READING)
def test_what_elements_say_alone_is_known_by_their_number_change_and_softness(name):
    floor, power = ON_ELEMENTS[name]
    size = 7.0 if name in SIZES else 1.0

    def stated(values=(7.0, 7.0), elements=6.0, compliance_error=0.0, residual=0.0) -> float:
        return estimate_elements_budget(
            name, values, elements=elements, compliance_error=compliance_error, residual=residual
        ).total

    rest = stated()
    assert rest == pytest.approx(floor + UNCERTAINTIES[name].cut_planes, rel=1e-9)
    assert rest - stated(elements=9.0) == pytest.approx(floor * (1.0 - (2.0 / 3.0) ** power), rel=1e-9)
    assert stated((7.0, 7.0 - 0.01 * size)) - rest == pytest.approx(0.01, rel=1e-9)
    assert stated(residual=1e-4) - rest == pytest.approx(1e-4, rel=1e-9)
    # Hertz: p0 and area with the power 2/3 of the modulus, lengths with 1/3; two lobes somewhat more
    of_modulus = 0.5 if name in ("a_mm", "b_mm", "extent_x_mm", "extent_y_mm") else 1.0
    for error, seen_change in ((-0.01, 0.01), (math.nan, 0.02)):
        assert stated(compliance_error=error) - rest == pytest.approx(of_modulus * seen_change * 7.0 / size, rel=1e-9)


@pytest.mark.parametrize("refined", [0, 1, 4])
def test_so_many_refinements_leave_what_so_many_times_half_more_elements_read(refined, elliptic_quick):
    level, size = elliptic_quick.load.level, {"p_max_MPa": 1.0}
    uncertainties = {"compliance_error": 0.0, "elements": 1.0}
    of_one = (
        estimate_elements_budget("p_max_MPa", (1.0,), **uncertainties).total - UNCERTAINTIES["p_max_MPa"].cut_planes
    )
    left = estimate_irreducible_budgets(level, lambda _: size, {"p_max_MPa": 0.0}, on_elements=refined)[
        "p_max_MPa"
    ].total
    remaining = of_one / (left - UNCERTAINTIES["p_max_MPa"].cut_planes)
    patch, steps = read_patch(level.on_elements), level.on_elements.grid.steps_mm
    first = min(patch.a_mm / steps[0], patch.b_mm / steps[1])
    assert remaining == pytest.approx(first * 1.5**refined, rel=1e-9)


def test_the_load_on_a_lobe_is_known_by_two_changes_and_the_cut_planes_by_what_goes_to_the_others():
    assert estimate_share_uncertainty((0.3, 0.3)) == pytest.approx(2e-4, rel=1e-9)
    solved = SolutionQuality(residual=1e-5, compliance_error=0.01)
    parts = 2e-4 + 2.0 * 0.004 + 2.0 * 0.001 + 0.05 * 0.01 * 0.3 + 1e-5
    assert estimate_share_uncertainty((0.3, 0.304), solved, otherwise=0.299) == pytest.approx(parts, rel=1e-9)
    assert math.isnan(estimate_share_uncertainty((0.3, math.nan)))
    assert [estimate_cut_plane_share(share) for share in (0.1, 0.9, 0.5)] == pytest.approx(
        [0.0016, 0.0016, 0.008], rel=1e-9
    )


# --- what is stated of skewed patches ---------------------------------------------------------------------------------


def skewed(c: float) -> Rung:
    """sqrt(1 - X^2 - Y^2) (1 + c Y) on an ellipse of 3 and 2 mm."""
    x, y = np.linspace(-1.1, 1.1, 221), np.linspace(-1.1, 1.1, 441)
    pressure = (1.0 + c * y) * np.sqrt(np.maximum(1.0 - x[:, None] ** 2 - y**2, 0.0))
    return rung_with(ContactGrid(x_mm=3.0 * x, s_mm=2.0 * y, half=False), 1e3 * pressure)


@pytest.mark.parametrize("c", [0.0, 0.4, -0.9])
def test_the_skewness_is_that_of_the_moments_of_the_load_across(c):
    # (1 - Y^2) (1 + c Y) across: means of Y, Y^2 and Y^3 are c/5, 1/5 and 3 c/35
    mean, square, cube = c / 5.0, 1.0 / 5.0, 3.0 * c / 35.0
    expected = (cube - 3.0 * mean * square + 2.0 * mean**3) / (square - mean**2) ** 1.5
    assert compute_skewness(skewed(c)) == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize("skew", [0.3, -0.3])
def test_the_centre_of_a_skewed_patch_is_known_less_well(skew):
    for name in READING:
        values = (7.0, 7.0)
        increase = estimate_uncertainty(name, values, SolutionQuality(skew=skew)) - estimate_uncertainty(name, values)
        # what meshes have in common of 60 exact contacts falls with their skewness
        assert increase == pytest.approx(0.0021 if name == "centre_over_b" else 0.0, abs=1e-12)


def test_the_skewness_of_a_load_is_that_of_the_fine_pressure(elliptic_quick):
    finest, *coarser = elliptic_quick.load.solved.levels
    # measured 1.1e-5 of two circles
    assert read_quality((finest, *coarser)).skew == pytest.approx(0.0, abs=3e-5)
    assert read_quality((replace(finest, fe=skewed(0.4)), *coarser)).skew == compute_skewness(skewed(0.4))


# --- contacts for which Hertz is exact --------------------------------------------------------------------------

# rail, wheel, load, yaw (mrad): patches of 0.5 to 4 mm on whole bodies, so that only meshes and readings err
EXACT = (
    (300, 460, 5e3, 0),
    (460, 520, 20e3, 0),
    (120, 400, 10e3, 0),
    (40, 400, 2e3, 0),
    (25, 520, 2e3, 0),
    (13, 460, 500.0, 0),
    (80, 520, 20e3, 0),
    (80, 460, 5e3, 0),
    (200, 460, 10e3, 60),
    (300, 460, 20e3, 100),
)


@pytest.mark.slow
def test_the_true_error_lies_inside_the_stated_one_nine_times_of_ten():
    ratios = []
    for rail, wheel, load_N, yaw in EXACT:
        result = solve(
            Case(
                rail=f"circle:{rail}",
                wheel=f"cylinder:{wheel}",
                inclination_rad=0.0,
                yaw_rad=1e-3 * yaw,
                load_N=load_N,
                resolution="quick",
                refine="never",
            )
        )
        assert result.status == "converged"
        deviation, stated = result.load.deviation, result.load.uncertainty
        print(rail, wheel, load_N, yaw, *(f"{name} {deviation[name]:+.5f}/{stated[name]:.5f}" for name in READING))
        ratios.append([abs(deviation[name]) / stated[name] for name in READING])
    ratios_found = np.array(ratios)
    # measured: one of all outside, the area of a yawed one by a third more
    assert ratios_found.max() < 1.6
    assert np.mean(ratios_found <= 1.0) >= 0.97
    assert np.all(np.mean(ratios_found <= 1.0, axis=0) >= 0.9)


# --- profiles that are given by points ------------------------------------------------------------------------------


# points through which a spline is put as they are
EXACT_POINTS = Reading(filter_mm=0.0)


def head_of_points(path, radius_mm: float, spacing_mm: float, decimals: int) -> str:
    y = np.arange(-20.0, 20.0 + 1e-9, spacing_mm)
    z = np.round(np.sqrt(radius_mm**2 - y**2) - radius_mm, decimals)
    np.savetxt(path, np.column_stack([y, z]), fmt="%.15g")
    return str(path)


def noise_of_points(rail: str) -> dict[str, float] | None:
    """Contribution of the scatter of points to the uncertainty of each measure."""
    case = Case(
        rail_file=Reading() if rail.startswith("circle") else EXACT_POINTS,
        rail=rail,
        wheel="cylinder:460",
        inclination_rad=0.0,
        load_N=50e3,
        track=Track(rail_crown_y_mm=750.0),
    )
    return part_of(case, place_case(case))


def part_of(case: Case, placement: Placement) -> dict[str, float] | None:
    """Shift of Hertz's deviations from the half-space over the profile variants that the points allow."""
    lines = judge_case_variants(case, placement)
    if lines is None:
        return None
    own_deviations = lines.own.deviations["hertz"]
    _, contribution = judge_profile_variants(
        own_deviations, dict.fromkeys(own_deviations, 0.0), lines.find_shifts("hertz"), case.criteria
    )
    return contribution


def part_of_points(rail: str) -> dict[str, float]:
    contribution = noise_of_points(rail)
    assert contribution is not None
    return contribution


def test_exact_lines_have_no_part_from_points():
    assert noise_of_points("circle:80") is None


def test_dense_exact_points_have_hardly_a_part(tmp_path):
    # a cubic spline through points 1 mm apart errs in the curvature by about h^2 / (12 R^3) here, 1e-7 of 1/R
    contribution = part_of_points(head_of_points(tmp_path / "head.txt", 80.0, 1.0, 12))
    # what is left is where the two fitted grids put their nodes
    assert max(contribution["p_max_MPa"], contribution["approach_mm"]) < 1e-3
    assert contribution["area_mm2"] < 5e-3


def test_rounded_points_have_a_part_of_the_size_of_what_they_do(tmp_path):
    """Points 1 mm apart, rounded to 0.01 mm.

    The truth, Hertz on the circle itself, lies within the contribution.
    """
    contribution = part_of_points(head_of_points(tmp_path / "head.txt", 80.0, 1.0, 2))
    finer = part_of_points(head_of_points(tmp_path / "finer.txt", 80.0, 1.0, 4))
    # curvature noise of 6 x 0.003 mm / (1 mm)^2 beside 1/80 per mm
    assert contribution["p_max_MPa"] > 0.05
    assert finer["p_max_MPa"] < 0.2 * contribution["p_max_MPa"]


@pytest.mark.slow
def test_the_part_of_points_goes_into_the_uncertainty(tmp_path):
    rail = head_of_points(tmp_path / "head.txt", 80.0, 1.0, 4)
    options = {
        "rail_file": EXACT_POINTS,
        "wheel": "cylinder:460",
        "inclination_rad": 0.0,
        "track": Track(rail_crown_y_mm=750.0),
    }
    coarse = {"resolution": (1.6, 0.6), "refine": "never"}
    result = solve(Case(rail=rail, **options, **coarse))
    judgement = result.load.judgements[HERTZ]
    contribution = {name: judgement.uncertainty[name] - numerical for name, numerical in judgement.numerical.items()}
    # of (Hertz - FE) / FE what it is of (Hertz - half-space) / half-space, but for what the bodies change
    on_half_space = part_of(result.case, result.placement)
    assert {name: contribution[name] for name in READING} == pytest.approx(
        {n: on_half_space[n] for n in READING}, rel=0.05
    )
    assert contribution["p_max_MPa"] > 0.0
    stated = result.load.uncertainty
    assert "approach_mm" not in stated
    assert set(stated) == set(READING)
    # it is added to what meshes and reading leave
    assert all(stated[name] >= contribution[name] + 0.9 * READING[name] for name in READING)


def noisy_circle(path, radius_mm: float, noise_mm: float, seed: int) -> str:
    """A head of points 0.5 mm apart that is in no library, with noise across its line."""
    angle = np.arange(-25.0, 25.0 + 1e-9, 0.5) / radius_mm
    radius = radius_mm + noise_mm * np.random.default_rng(seed).normal(size=angle.size)
    np.savetxt(path, np.column_stack([radius * np.sin(angle), radius * np.cos(angle) - radius_mm]), fmt="%.9f")
    return str(path)


def smooth_case(rail: str, **changes) -> Case:
    # a circle is exact, and has no points to be read
    reading = Reading(**changes) if rail.startswith("circle") else Reading(nominal="none", **changes)
    return Case(
        rail=rail, rail_file=reading, wheel="cylinder:460", inclination_rad=0.0, track=Track(rail_crown_y_mm=750.0)
    )


def test_hertz_on_a_smoothed_circle_errs_by_less_than_is_stated(tmp_path):
    """The truth is Hertz on the circle itself.

    0.01 mm of noise would make the curvature of a spline wrong by 0.2 /mm.
    """
    exact = compute_hertz(case := smooth_case("circle:80"), place_case(case))
    errors, stated = [], []
    for seed in range(20):
        case = smooth_case(noisy_circle(tmp_path / f"{seed}.txt", 80.0, 0.01, seed))
        placement = place_case(case)
        hertz = compute_hertz(case, placement)
        errors.append([abs(hertz.p0_MPa / exact.p0_MPa - 1.0), abs(hertz.a_mm / exact.a_mm - 1.0)])
        said = estimate_hertz_uncertainty(case, placement)
        stated.append([said["p_max_MPa"], said["a_mm"]])
    errors, stated = np.array(errors), np.array(stated)
    # measured: one of twenty outside
    assert np.count_nonzero(np.all(errors < stated, axis=1)) >= 18
    # and it says something. Half the width carries six times the noise; measured: 8 times what arises
    assert np.sqrt(np.mean(stated**2)) < 10.0 * np.sqrt(np.mean(errors**2))


def test_what_a_smoothed_line_leaves_open_is_linear_in_its_noise(tmp_path):
    def stated(noise_mm: float) -> float:
        case = smooth_case(noisy_circle(tmp_path / f"{noise_mm}.txt", 80.0, noise_mm, 3), filter_mm=6.0)
        uncertainties = estimate_hertz_uncertainty(case, place_case(case))
        assert uncertainties is not None
        return uncertainties["p_max_MPa"]

    # at one width; the ends, where a smoothing spline is straight, add 0.1 % whatever the noise is
    assert stated(0.0002) == pytest.approx(0.2 * stated(0.001), rel=0.2)


# --- what more nodes change ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rail", "wheel", "slope", "shift_mm", "load_N", "least_MPa"),
    [
        # a step of 0.037 um was a valley of 17 % of the peak on 64 nodes, and 1.5 % on 32; 0.3 % are left, on 96
        ("55E1", "S1002", 20, 3.56, 120.7e3, 0.0),
        ("56E1", "EN15302_A", 40, 5.62, 109e3, 0.2),
        ("50E6", "EN15302_H", 20, 5.42, 101.7e3, 0.06),
    ],
)
def test_a_valley_beside_a_junction_is_stated_as_far_off_as_more_nodes_find_it(
    rail, wheel, slope, shift_mm, load_N, least_MPa
):
    """Valleys that are one to three nodes wide.

    They are read on 32 nodes, against five times more nodes, or as many as possible.
    """
    case = Case(
        rail=rail, wheel=wheel, inclination_rad=math.atan(1.0 / slope), lateral_shift_mm=shift_mm, load_N=load_N
    )
    position = expect_position(case)
    coarse, fine = position.expected.half_space, solve_on_more_nodes(position.expected, load_N, nodes=160)
    valleys = [read_patch(rung).valley for rung in (coarse, fine)]
    assert valleys[0] >= least_MPa
    solution = SolutionQuality(more_nodes=position.more_nodes)
    # of meshes nothing is in it: equal values
    stated = (
        estimate_uncertainty("valley", (valleys[0], valleys[0]), solution)
        - UNCERTAINTIES["valley"].cut_planes
        - UNCERTAINTIES["valley"].common_mesh_error
    )
    assert abs(valleys[0] - valleys[1]) <= stated
    # measured 0.0028, 0.0093 and 0.0076 with 0.0049, 0.017 and 0.016 stated
    assert stated <= 4.0 * abs(valleys[0] - valleys[1]) + 0.001


@pytest.mark.parametrize(
    ("rail", "wheel", "slope_rad", "shift_mm", "load_N", "area_mm2", "extent_y_mm"),
    [
        ("56E1", "CONE40", math.atan(1.0 / 40.0), 4.26, 159.6e3, 165.70, 12.46),
        ("56E1", "EN15302_H", math.atan(1.0 / 40.0), 0.28, 158.527e3, 164.99, 12.45),
        # 48 nodes show a fifth of it
        ("60E1", "EN15302_H", 0.0, -0.31, 158.527e3, 99.88, 6.205),
    ],
)
def test_an_area_that_ends_just_beyond_a_junction_is_stated_as_far_off_as_more_nodes_find_it(
    rail, wheel, slope_rad, shift_mm, load_N, area_mm2, extent_y_mm
):
    """Areas that 32 nodes read 0.7 to 1.4 % too large.

    The reference is 192 nodes, which differ from 96 nodes by 0.03 to 0.06 %.
    """
    case = Case(rail=rail, wheel=wheel, inclination_rad=slope_rad, lateral_shift_mm=shift_mm, load_N=load_N)
    position = expect_position(case)
    measures = read_measures(position.expected.half_space).as_dict()
    solution = SolutionQuality(more_nodes=position.more_nodes)
    for name, finer in (("area_mm2", area_mm2), ("extent_y_mm", extent_y_mm)):
        off = abs(measures[name] / finer - 1.0)
        assert off > READING[name]
        # of meshes nothing is in it: equal values
        stated = (
            estimate_uncertainty(name, [measures[name]] * 2, solution)
            - UNCERTAINTIES[name].cut_planes
            - UNCERTAINTIES[name].common_mesh_error
        )
        assert off <= stated
        # 96 nodes leave little of it
        assert stated <= 1.3 * off


def test_what_any_more_nodes_change_is_told_as_by_half_as_many(elliptic_quick):
    """A length with an error proportional to the step.

    The error is 1.2 % on these nodes, and 0.8, 0.6 and 0.4 % on finer nodes.
    """
    rung = elliptic_quick.load.solved.half_space

    def finer_rung(finer: float) -> Rung:
        # the same values on a shorter grid
        x_mm = rung.grid.x_mm * (1.0 + 0.012 / finer) / 1.012
        return replace(rung, grid=replace(rung.grid, x_mm=x_mm, s_mm=rung.grid.s_mm / finer))

    for finer in (1.5, 2.0, 3.0):
        changed = compare_with_more_nodes(rung, finer_rung(finer), ("a_mm",))
        assert changed["a_mm"] == pytest.approx(0.004, rel=0.02)


# 50E6 with S1002, 1:40, 1.74 mm, 57.1 kN: peaks on meshes of 2.7, 4, 6, 9 and 13.5 elements per semi-axis of the wider
# lobe, and part of the load on the narrow one, which has them.
JOINED_PEAKS_MPA = (1459.5, 1458.6, 1456.5, 1459.7, 1454.1)
JOINED_SHARE = 0.1519


@pytest.mark.parametrize("finest", [1, 2, 3])
def test_the_peak_of_a_narrow_lobe_is_stated_as_far_off_as_all_meshes_find_it(finest):
    """Peaks that do not converge with more elements.

    The last change was stated as the uncertainty.
    """
    values = JOINED_PEAKS_MPA[finest::-1]
    stated = (
        estimate_uncertainty("p_max_MPa", values, SolutionQuality(joined_share=JOINED_SHARE))
        - UNCERTAINTIES["p_max_MPa"].cut_planes
    )
    off = max(abs(peak / values[0] - 1.0) for peak in JOINED_PEAKS_MPA)
    assert off < stated < 0.01


@pytest.mark.parametrize(("share", "left"), [(0.15, 0.016), (0.5, 0.016), (0.8, 0.004), (1.0, 0.0)])
def test_the_peak_of_a_joined_lobe_is_known_by_the_third_root_of_its_load(share, left):
    """A third of 1.6 % of the smaller part of the load, relative to the share of the lobe."""
    alone = estimate_uncertainty("p_max_MPa", (1000.0, 1000.0))
    joined = estimate_uncertainty("p_max_MPa", (1000.0, 1000.0), SolutionQuality(joined_share=share))
    assert joined - alone == pytest.approx(left / 3.0, rel=1e-9, abs=1e-12)
    # of separate patches it is in what cut planes leave, and only the peak has it
    separate = estimate_uncertainty("p_max_MPa", (1000.0, 1000.0), SolutionQuality(shared=True))
    assert (
        estimate_uncertainty("p_max_MPa", (1000.0, 1000.0), SolutionQuality(shared=True, joined_share=share))
        == separate
    )
    assert estimate_uncertainty("b_mm", (3.0, 3.0), SolutionQuality(joined_share=share)) == estimate_uncertainty(
        "b_mm", (3.0, 3.0)
    )


def test_the_share_is_that_of_the_lobe_with_the_peak():
    grid = ContactGrid(x_mm=0.1 * np.arange(30), s_mm=0.05 * np.arange(-80, 81), half=True)
    x, s = grid.x_mm[:, None], grid.s_mm[None, :]
    wide, narrow = (
        np.sqrt(np.maximum(0.0, 1.0 - (x / 2.5) ** 2 - ((s - s0) / b) ** 2)) for s0, b in ((1.0, 2.0), (-1.4, 0.5))
    )
    # 2/3 pi a b p0 of each: 2000 and 600 MPa mm
    rung = rung_with(grid, 1000.0 * wide + 1200.0 * narrow)
    assert compute_peak_lobe_share(rung) == pytest.approx(600.0 / 2600.0, rel=0.02)
    assert compute_peak_lobe_share(rung_with(grid, 1000.0 * wide)) == 1.0


@pytest.mark.slow
def test_the_peak_of_a_narrow_joined_lobe_covers_finer_meshes():
    """A stated uncertainty of 0.28 %, too small.

    13.5 elements have a peak 0.3 % lower.
    """
    case = Case(
        rail="50E6", inclination_rad=math.atan(1.0 / 40.0), lateral_shift_mm=1.74, load_N=57.1e3, refine="never"
    )
    load = solve(replace(case, resolution="quick")).load
    assert load.status == "converged"
    peak = load.comparison.fe.p_max_MPa
    off = max(abs(finer / peak - 1.0) for finer in JOINED_PEAKS_MPA)
    assert 0.002 < off < load.uncertainty["p_max_MPa"] < 0.012


def test_a_force_along_another_normal_goes_into_the_peak_alone():
    values = (1000.0, 1000.0)
    for turned_force in (0.09, -0.09):
        increase = estimate_uncertainty(
            "p_max_MPa", values, SolutionQuality(turned_force=turned_force)
        ) - estimate_uncertainty("p_max_MPa", values)
        assert increase == pytest.approx(0.03, rel=1e-9)
        assert estimate_uncertainty(
            "area_mm2", values, SolutionQuality(turned_force=turned_force)
        ) == estimate_uncertainty("area_mm2", values)


@pytest.mark.slow
def test_a_peak_on_narrow_lobes_beside_a_corner_is_stated_as_far_off_as_finer_meshes_find_it():
    """Hertz is 58.8 % above the peak on quick meshes.

    1.16 % was stated, and finer meshes find 60.2 to 60.9 %.
    """
    case = Case(
        rail="60E1",
        wheel="EN15302_A",
        inclination_rad=math.atan(1.0 / 30.0),
        lateral_shift_mm=5.73,
        load_N=90.2e3,
        resolution="quick",
        refine="never",
    )
    load = solve(case).load
    assert load.status == "converged"
    off, stated = load.deviation["p_max_MPa"], load.uncertainty["p_max_MPa"]
    # `standard`; and nine elements with 32 and 48 nodes, by lines whose published steps were open
    assert max(abs(off - finer) for finer in (0.602, 0.605, 0.609)) < stated < 0.05
