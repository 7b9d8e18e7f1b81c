"""Cheap theories of the normal contact: Hertz's limit, a closed form, the half-space on gaps without an ellipse."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import elliprd, elliprf

from fecontact.case import Case
from fecontact.contact.patch import measure_patch
from fecontact.contact_theories.analyn import solve_analyn
from fecontact.contact_theories.equivalent_ellipse import solve_equivalent_ellipse
from fecontact.contact_theories.gap_line import GapLine, StripContact, _run_around, build_gap_line, solve_under_load
from fecontact.contact_theories.hertz import calculate_ellipse_shape, hertz_ellipse
from fecontact.contact_theories.kik_piotrowski import solve_kik_piotrowski
from fecontact.contact_theories.kpec import find_kpec_forces, solve_kpec
from fecontact.contact_theories.registry import _GAP_LINE_FORCES, THEORIES
from fecontact.contact_theories.strip_method import (
    StripDistances,
    StripGap,
    StripLoad,
    StripSearch,
    StripSolution,
    _selected_spans,
    calculate_influence,
    solve_strips,
    solve_strips_of_lines,
)
from fecontact.contact_theories.stripes import solve_stripes
from fecontact.contact_theories.strips import (
    build_gap_line_under_load,
    solve_strip_theory,
    solve_strip_theory_at_approach,
)
from fecontact.errors import InputError
from fecontact.inputs.texts import parse_inclination
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

A = 1.0 / 920.0
MODULUS = 115_384.615
Theory = Callable[[GapLine, float], StripContact]


def both(at_approach: Theory) -> tuple[Theory, Theory]:
    """A theory under a force, and at an approach."""
    return partial(solve_under_load, theory=at_approach), at_approach


# those that claim Hertz for constant curvature
EXACT: dict[str, tuple[Theory, Theory]] = {
    "kpec": both(solve_kpec),
    "stripes": both(solve_stripes),
    "analyn": both(solve_analyn),
    "equivalent_ellipse": both(solve_equivalent_ellipse),
    "strip": (solve_strip_theory, solve_strip_theory_at_approach),
}
ALL = EXACT | {
    "kik_piotrowski": both(solve_kik_piotrowski),
    "corrected": both(partial(solve_kik_piotrowski, shape_correction=True)),
}


def line_of(
    gap: Callable[[np.ndarray], np.ndarray], low: float, high: float, count: int, offset: float = 0.37, along: float = A
):
    """Gap line of a function of t; the contact point lies anywhere between two places."""
    step = (high - low) / count
    t = low + step * (np.arange(count) + offset)
    return GapLine(t_mm=t, f_mm=gap(t), A_per_mm=along, contact_modulus_MPa=MODULUS)


def parabola(axis_ratio: float, force: float = 1e5, places: int = 161, offset: float = 0.37):
    """A gap line of constant curvature for a ratio a/b, and the Hertz ellipse.

    The other arguments are the number of places across the patch of Hertz and the width beside it.
    """
    # KPEC, STRIPES and ANALYN count no curvature below 1e-4 1/mm: the smallest ratios get a small wheel
    along = A if axis_ratio > 0.25 else 0.01
    square = axis_ratio**2
    B = along * float(elliprd(0.0, square, 1.0) / elliprd(0.0, 1.0, square))
    hertz = hertz_ellipse(along, B, normal_force_N=force, contact_modulus_MPa=MODULUS)
    # the gap at the end is a quarter larger than the approach, or 1.5 times that at the end of the ellipse
    reach = max(1.25 * hertz.b_mm, math.sqrt(1.25 * hertz.approach_mm / B))
    return line_of(lambda t: B * t**2, -reach, reach, places, offset, along), hertz


def relative_percent(value: float, reference: float) -> float:
    """Deviation in %."""
    return 100.0 * (value / reference - 1.0)


# --- Hertz's limit ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("axis_ratio", [0.1, 0.2, 0.5, 1.0, 2.0, 4.5, 10.0])
def test_constant_curvature_gives_hertz(name, axis_ratio):
    line, hertz = parabola(axis_ratio)
    contact = EXACT[name][0](line, hertz.normal_force_N)
    assert contact.status == "solved"
    assert contact.solutions == 1
    # 160 strips across: 0.1 % is reached by all but the length of the strips at the edge, which is worth 0.2 %
    for value, reference in (
        (contact.p_max_MPa, hertz.p0_MPa),
        (contact.area_mm2, hertz.area_mm2),
        (contact.approach_mm, hertz.approach_mm),
        (contact.a_mm, hertz.a_mm),
        (contact.b_mm, hertz.b_mm),
        (contact.normal_force_N, hertz.normal_force_N),
    ):
        # strips ten times as long as the patch is wide say little about their own lengths: 1.1 % of a, 0.6 % of the
        # approach is reached
        assert abs(relative_percent(value, reference)) < (1.2 if name == "strip" and axis_ratio == 10.0 else 0.3)


@pytest.mark.parametrize("offset", [0.0, 0.21, 0.5, 0.83])
@pytest.mark.parametrize("name", EXACT)
def test_it_does_not_matter_where_the_nodes_lie(name, offset):
    line, hertz = parabola(0.7, offset=offset)
    contact = EXACT[name][0](line, hertz.normal_force_N)
    assert abs(relative_percent(contact.p_max_MPa, hertz.p0_MPa)) < 0.3
    assert abs(relative_percent(contact.area_mm2, hertz.area_mm2)) < 0.3


@pytest.mark.parametrize(
    ("axis_ratio", "p0", "area", "approach", "p0_corrected", "area_corrected", "approach_corrected"),
    [
        (0.3, -10.86, 12.19, -2.11, -8.69, 9.52, -4.44),
        (0.5, -7.84, 8.51, -2.77, -7.06, 7.60, -3.59),
        (1.0, -6.16, 6.56, -3.13, -6.16, 6.56, -3.13),
        (2.0, -7.84, 8.51, -2.77, -7.06, 7.60, -3.59),
        (3.0, -10.15, 11.30, -2.27, -8.30, 9.05, -4.24),
    ],
)
def test_kik_piotrowski_misses_hertz_by_its_closed_form(
    axis_ratio, p0, area, approach, p0_corrected, area_corrected, approach_corrected
):
    # on constant curvature the region is an ellipse of the axis ratio sqrt(B/A), whose deflection Hertz knows
    line, hertz = parabola(axis_ratio, places=401)
    for theory, closed_form in (
        ("kik_piotrowski", (p0, area, approach)),
        ("corrected", (p0_corrected, area_corrected, approach_corrected)),
    ):
        contact = ALL[theory][0](line, hertz.normal_force_N)
        assert relative_percent(contact.p_max_MPa, hertz.p0_MPa) == pytest.approx(closed_form[0], abs=0.15)
        assert relative_percent(contact.area_mm2, hertz.area_mm2) == pytest.approx(closed_form[1], abs=0.15)
        assert relative_percent(contact.approach_mm, hertz.approach_mm) == pytest.approx(closed_form[2], abs=0.15)


def test_closed_form_of_kik_piotrowski_itself():
    # the numbers above from the deflection of an ellipse of the ratio k' = sqrt(B/A) that is pressed too flat
    _, hertz = parabola(0.5)
    shape = calculate_ellipse_shape(A, hertz.B_per_mm)
    k = math.sqrt(hertz.B_per_mm / A)
    ratio = (math.sqrt(float(shape.part_t) / 0.55) * float(elliprf(0.0, k**2, 1.0) / shape.integral)) ** (2.0 / 3.0)
    assert relative_percent(ratio, 1.0) == pytest.approx(-2.77, abs=0.006)
    area = 0.55 * ratio / math.sqrt(float(shape.part_x * shape.part_t))
    assert relative_percent(area, 1.0) == pytest.approx(8.51, abs=0.006)


# --- gaps without an ellipse --------------------------------------------------------------------------------------


def junction(t):
    """Curvature jumps at the contact point."""
    return np.where(t < 0.0, 0.002, 0.005) * t**2


def near_jump(t):
    """Curvature jumps 2 mm beside it."""
    return 0.001 * t**2 + 0.003 * np.maximum(t - 2.0, 0.0) ** 2


def two_lobes(t):
    """Two minima of different height, 10 mm apart."""
    return 0.008 * ((t / 5.0) ** 2 - 1.0) ** 2 + 0.0004 * (t + 5.0)


def hump(t):
    """A second, flatter minimum 20 mm away."""
    return np.minimum(0.003 * t**2, 0.02 + 0.0003 * (t - 20.0) ** 2)


GAPS = {"J": junction, "K": near_jump, "W": two_lobes}
# p_max MPa, area mm2, approach mm under 80 kN: independent scripts of the same formulas, 3000 places, step 0.01 mm
PRINTED = {
    ("kik_piotrowski", "J"): (1327.6, 90.39, 0.09450),
    ("kik_piotrowski", "K"): (978.9, 120.4, 0.08314),
    ("kik_piotrowski", "W"): (694.8, 166.3, 0.06219),
    ("corrected", "J"): (1338.2, 89.68, 0.09375),
    ("corrected", "K"): (979.2, 120.3, 0.08310),
    ("corrected", "W"): (699.4, 165.3, 0.06170),
    ("kpec", "J"): (1435.4, 83.24, 0.09696),
    ("kpec", "K"): (1041.0, 113.3, 0.08569),
    ("kpec", "W"): (769.7, 154.5, 0.06478),
    # the approach of STRIPES on J depends on which side of the junction counts
    ("stripes", "J"): (1768.7, 82.82, None),
    ("stripes", "K"): (1496.3, 109.3, 0.07818),
    ("stripes", "W"): (1106.1, 138.9, 0.06291),
    ("analyn", "J"): (1693.7, 83.97, 0.09796),
    ("analyn", "K"): (1365.4, 110.7, 0.08519),
    ("analyn", "W"): (1026.6, 142.0, 0.06265),
    ("equivalent_ellipse", "J"): (1430.1, 83.91, 0.09783),
    ("equivalent_ellipse", "K"): (1075.8, 111.5, 0.08713),
    ("equivalent_ellipse", "W"): (780.4, 153.8, 0.07314),
}
HALF_SPACE = {"J": (1539.7, 84.26, 0.09768), "K": (1156.4, 111.2, 0.08544), "W": (948.1, 146.6, 0.06769)}


@pytest.mark.parametrize(("name", "gap"), PRINTED)
def test_gaps_without_an_ellipse(name, gap):
    contact = ALL[name][0](line_of(GAPS[gap], -15.0, 15.0, 3000, 0.0), 80e3)
    printed = PRINTED[name, gap]
    for value, reference in zip((contact.p_max_MPa, contact.area_mm2, contact.approach_mm), printed, strict=True):
        if reference is not None:
            assert abs(relative_percent(value, reference)) < 0.5


@pytest.mark.parametrize("gap", HALF_SPACE)
def test_strips_are_the_half_space(gap):
    contact = solve_strip_theory(line_of(GAPS[gap], -15.0, 15.0, 3000), 80e3)
    assert contact.status == "solved"
    p_max, area, approach = HALF_SPACE[gap]
    # the half-space's own nodes: 0.1 % of the peak, and its area 0.4 % too large
    assert abs(relative_percent(contact.p_max_MPa, p_max)) < 0.15
    assert abs(relative_percent(contact.area_mm2, area / 1.004)) < 0.3
    assert abs(relative_percent(contact.approach_mm, approach)) < 0.1


# --- force and approach, units, refusals --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("gap", GAPS)
def test_force_and_approach_are_inverse_to_each_other(name, gap):
    line = line_of(GAPS[gap], -15.0, 15.0, 1500)
    under_force, at_approach = ALL[name]
    contact = under_force(line, 80e3)
    again = at_approach(line, contact.approach_mm)
    # closed forms are found to 1e-9; the strips end their sweeps when they change by 0.5 %
    assert again.normal_force_N == pytest.approx(80e3, rel=3e-3 if name == "strip" else 1e-6)
    assert again.p_max_MPa == pytest.approx(contact.p_max_MPa, rel=3e-3 if name == "strip" else 1e-6)


@pytest.mark.parametrize("name", ALL)
def test_lengths_in_another_unit_give_the_same_contact(name):
    # all lengths ten times as long, pressures the same: forces are a hundred times as large
    line = line_of(junction, -15.0, 15.0, 3000)
    large = GapLine(
        t_mm=10.0 * line.t_mm,
        f_mm=10.0 * line.f_mm,
        A_per_mm=0.1 * line.A_per_mm,
        contact_modulus_MPa=MODULUS,
        B_per_mm=0.1 * line.B_per_mm,
    )
    small_found, large_found = ALL[name][0](line, 80e3), ALL[name][0](large, 80e5)
    assert large_found.p_max_MPa == pytest.approx(small_found.p_max_MPa, rel=1e-6)
    assert large_found.area_mm2 == pytest.approx(100.0 * small_found.area_mm2, rel=1e-6)
    assert large_found.approach_mm == pytest.approx(10.0 * small_found.approach_mm, rel=1e-6)


@pytest.mark.parametrize("name", ALL)
def test_the_pressure_carries_the_force(name):
    contact = ALL[name][0](line_of(near_jump, -15.0, 15.0, 1500), 80e3)
    x, t = np.linspace(-12.0, 12.0, 961), np.linspace(-14.0, 14.0, 1121)
    pressure = contact.pressure_MPa(x[:, None], t[None, :])
    cell = (x[1] - x[0]) * (t[1] - t[0])
    assert pressure.sum() * cell == pytest.approx(contact.normal_force_N, rel=3e-3)
    assert np.count_nonzero(pressure) * cell == pytest.approx(contact.area_mm2, rel=0.01)
    assert pressure.max() == pytest.approx(contact.p_max_MPa, rel=2e-3)
    # and its second moments
    weights = pressure / pressure.sum()
    assert math.sqrt(5.0 * float((x**2) @ weights.sum(axis=1))) == pytest.approx(contact.a_mm, rel=5e-3)


@pytest.mark.parametrize(
    ("name", "gap", "words"),
    [
        ("analyn", two_lobes, "flat or concave"),
        ("stripes", two_lobes, "flat or concave"),
        ("equivalent_ellipse", hump, "separate regions"),
        ("kik_piotrowski", hump, "separate regions"),
        ("kpec", hump, "separate regions"),
    ],
)
def test_a_theory_out_of_its_range_says_so(name, gap, words):
    contact = ALL[name][0](line_of(gap, -15.0, 40.0, 2750), 80e3)
    assert contact.status == "out of range"
    assert any(words in note for note in contact.notes)


@pytest.mark.parametrize(("low", "high"), [(-3.0, 3.0), (-1.0, 20.0), (-20.0, 1.0)])
@pytest.mark.parametrize("name", ALL)
def test_a_line_that_is_too_short_is_no_contact_in_silence(name, low, high):
    """At either end, and at both."""
    contact = ALL[name][0](line_of(junction, low, high, round(50.0 * (high - low))), 80e3)
    assert contact.status != "solved"
    assert any("end of the gap line" in note for note in contact.notes)


@pytest.mark.parametrize("gap", [*GAPS.values(), hump], ids=[*GAPS, "hump"])
@pytest.mark.parametrize("name", _GAP_LINE_FORCES)
def test_forces_at_many_approaches_are_the_forces_of_the_contacts(name, gap):
    """From a small patch to several regions, and beyond both ends of the line."""
    line = line_of(gap, -10.0, 40.0, 2500)
    approaches = np.geomspace(0.002, 0.9, 40)
    forces = _GAP_LINE_FORCES[name](line, approaches)
    contact_forces = [THEORIES[name].at_approach(line, approach).normal_force_N for approach in approaches]
    np.testing.assert_allclose(forces, contact_forces, rtol=1e-12)
    # alone as together
    for approach, force in zip(approaches, forces, strict=True):
        assert _GAP_LINE_FORCES[name](line, np.array([approach]))[0] == pytest.approx(force, rel=1e-12)


def test_at_a_jump_of_the_force_the_contact_is_just_below_the_jump():
    line = line_of(hump, -10.0, 40.0, 5000)
    approaches = np.linspace(0.04, 0.08, 200)
    forces = find_kpec_forces(line, approaches)
    fall = int(np.argmin(np.diff(forces)))
    force_N = 0.5 * (forces[fall] + forces[fall + 1])

    def falls(gap_line, approach_mm):
        contact = solve_kpec(gap_line, approach_mm)
        return replace(contact, normal_force_N=force_N * (0.9 if approach_mm < approaches[fall] else 1.2))

    contact = solve_under_load(line, force_N, falls)
    assert contact.status in ("jump", "out of range")
    assert contact.approach_mm < approaches[fall]
    assert contact.approach_mm == pytest.approx(approaches[fall], rel=1e-9)


def test_several_loads_for_one_approach_are_counted():
    # the force of KPEC falls where the second minimum comes below half the approach
    line = line_of(hump, -10.0, 40.0, 5000)
    forces = np.array([solve_kpec(line, approach).normal_force_N for approach in np.linspace(0.04, 0.08, 200)])
    fall = int(np.argmin(np.diff(forces)))
    assert forces[fall + 1] < 0.95 * forces[fall]
    contact = solve_under_load(line, 0.5 * (forces[fall] + forces[fall + 1]), solve_kpec)
    assert contact.solutions == 3
    assert contact.status != "solved"
    assert any("3 approaches carry" in note for note in contact.notes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"t_mm": np.array([0.0, 1.0, 3.0, 4.0, 5.0])}, "equal"),
        ({"t_mm": -np.arange(5.0)}, "> 0 and equal"),
        ({"f_mm": np.array([0.0, 1.0, np.nan, 1.0, 0.0])}, "finite"),
        ({"f_mm": np.zeros(4)}, "as many gaps"),
        ({"A_per_mm": 0.0}, "gap coefficient A"),
        ({"contact_modulus_MPa": -1.0}, "contact modulus"),
    ],
)
def test_a_gap_line_that_is_none_is_refused(changes, words):
    good = {"t_mm": np.arange(5.0), "f_mm": np.arange(5.0) ** 2, "A_per_mm": A, "contact_modulus_MPa": MODULUS}
    with pytest.raises(InputError, match=words):
        GapLine(**good | changes)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_no_force_and_no_approach_are_refused(name, bad):
    line = line_of(junction, -15.0, 15.0, 300)
    with pytest.raises(InputError, match="normal force"):
        ALL[name][0](line, bad)
    with pytest.raises(InputError, match="approach"):
        ALL[name][1](line, bad)


@pytest.mark.parametrize("touch", [0, 1, 2, 37, 78, 79, 80])
def test_kik_and_piotrowskis_contact_of_a_mirrored_line_is_mirrored(touch):
    """The bodies may be deepest at the end of the computed gap."""
    t = 0.1 * np.arange(81.0)
    f = 0.004 * (t - t[touch]) ** 2
    contact, mirror_image = (
        solve_kik_piotrowski(GapLine(t_mm=t, f_mm=gap, A_per_mm=1e-3, contact_modulus_MPa=MODULUS), 0.02)
        for gap in (f, f[::-1])
    )
    np.testing.assert_allclose(contact.centre_pressure_MPa, mirror_image.centre_pressure_MPa[::-1], rtol=1e-9)


def test_a_load_far_beyond_that_of_hertz_is_found_or_told_to_be_carried_by_none():
    """A spring with a thousandth of the stiffness of Hertz, at a hundred times the approach of Hertz."""
    t = 0.1 * (np.arange(201.0) - 100.0)
    line = GapLine(t_mm=t, f_mm=0.004 * t**2, A_per_mm=1e-3, contact_modulus_MPa=MODULUS)
    contact = solve_kik_piotrowski(line, 0.02)

    def soft(_, approach_mm):
        return replace(contact, approach_mm=approach_mm, normal_force_N=1e4 * approach_mm**1.5)

    loaded = solve_under_load(line, 8e4, soft)
    assert (loaded.status, loaded.solutions) == ("solved", 1)
    assert loaded.approach_mm == pytest.approx(4.0, rel=1e-6)
    # no approach carries it where the force stays below
    never = solve_under_load(
        line, 8e4, lambda _, approach_mm: replace(contact, approach_mm=approach_mm, normal_force_N=4e4)
    )
    assert (never.status, never.solutions) == ("not converged", 0)


# --- the strip method ---------------------------------------------------------------------------------------------


def solved(
    line: GapLine, force: float, search: StripSearch | None = None, start: StripSolution | None = None
) -> StripSolution:
    unit_line = StripGap(
        t=line.t_mm, f=line.f_mm, A=line.A_per_mm, E=line.contact_modulus_MPa, closing=np.ones_like(line.t_mm)
    )
    return solve_strips(unit_line, StripLoad(force=force), search or StripSearch(), start=start)


def test_a_gap_line_has_fifty_places_a_millimetre_and_the_gap_that_a_running_wheel_may_close():
    # the chord of its curvature, 0.1 mm, is five of its steps
    line = build_gap_line(
        place_case(Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)), contact_modulus_MPa=MODULUS
    )
    np.testing.assert_allclose(np.diff(line.t_mm), 0.02)
    # 1 mm, up to the last place before it
    assert 1.0 - (line.f_mm[-1] - line.f_mm[-2]) < line.f_mm[-1] < 1.0


def test_fewer_than_twenty_strips_are_refused():
    line, hertz = parabola(1.0)
    # 100 are good to 0.1 %
    assert solve_strip_theory(line, hertz.normal_force_N, strips=20).p_max_MPa == pytest.approx(hertz.p0_MPa, rel=0.02)
    with pytest.raises(InputError, match="number of strips is 19; allowed: at least 20"):
        solve_strip_theory(line, hertz.normal_force_N, strips=19)


def test_influence_is_the_integral_over_a_strip():
    # the half-ellipse's opening beside it and its curvature along x, by quadrature with x = a sin(angle)
    q, away = np.array([9.0, 0.25, 4.0]), np.array([0.5, 3.0, 8.0])
    J, slope, curving, u2 = calculate_influence(q, StripDistances.build(np.tile(away[:, None], 3)), np.full(3, 0.1))
    angle = -0.5 * math.pi + math.pi * (np.arange(20_000) + 0.5) / 20_000
    weight = math.pi / 20_000 * np.cos(angle) ** 2
    for i in range(3):
        for j in range(3):
            if i == j:
                continue
            x = math.sqrt(q[j]) * np.sin(angle)
            distance = np.hypot(x, away[i])
            assert J[i, j] == pytest.approx(q[j] * (weight / distance).sum(), rel=1e-6)
            bent = q[j] * (weight * (away[i] ** 2 - 2.0 * x**2) / distance**5).sum()
            assert curving[i, j] == pytest.approx(bent, rel=1e-5)
            assert u2[i, j] == q[j] + away[i] ** 2
    stretched = calculate_influence(q * (1.0 + 1e-5), StripDistances.build(np.tile(away[:, None], 3)), np.full(3, 0.1))[
        0
    ]
    assert (stretched - J) / (1e-5 * q) == pytest.approx(slope, rel=1e-3)


@pytest.mark.parametrize("fault", ["own strip", "far strips", "curvature"])
def test_a_wrong_influence_is_seen(fault, monkeypatch):
    def wrong(q, distances, h):
        J, slope, curving, u2 = calculate_influence(q, distances, h)
        diagonal = np.eye(q.size, dtype=bool)
        J = np.where(diagonal if fault == "own strip" else ~diagonal, 1.05, 1.0) * J if fault != "curvature" else J
        return J, slope, curving * (1.03 if fault == "curvature" else 1.0), u2

    monkeypatch.setattr("fecontact.contact_theories.strip_method.calculate_influence", wrong)
    line, hertz = parabola(0.7)
    contact = solve_strip_theory(line, hertz.normal_force_N)
    off_most = max(
        abs(relative_percent(contact.p_max_MPa, hertz.p0_MPa)),
        abs(relative_percent(contact.area_mm2, hertz.area_mm2)),
        abs(relative_percent(contact.approach_mm, hertz.approach_mm)),
    )
    assert off_most > 0.3


def test_contacts_that_are_solved_together_are_exactly_the_contacts_alone():
    lines, loads = [], []
    # a narrow second patch has the least number of strips of a region, so that there are more than 100
    for gap in (*GAPS.values(), lambda t: np.minimum(A * t**2, 2.0 * (t - 9.0) ** 2 + 0.01)):
        line = line_of(gap, -15.0, 15.0, 1500)
        unit_line = StripGap(t=line.t_mm, f=line.f_mm, A=A, E=MODULUS, closing=np.cos(0.02 * line.t_mm))
        loads += [StripLoad(approach=0.03), *(StripLoad(force=force) for force in (5e3, 20e3, 80e3, 200e3))]
        lines += 5 * [unit_line]
    together = solve_strips_of_lines(lines, loads)
    # more contacts than a stack has, which need different numbers of sweeps and strips
    assert len(together) > 12
    assert len({contact.sweeps for contact in together}) > 2
    assert len({contact.t.size for contact in together}) > 1
    for line, load, contact in zip(lines, loads, together, strict=True):
        alone = solve_strips(line, load)
        assert (contact.approach, contact.force, contact.sweeps) == (alone.approach, alone.force, alone.sweeps)
        assert (contact.converged, contact.at_end) == (alone.converged, alone.at_end)
        np.testing.assert_array_equal(contact.q, alone.q)
        np.testing.assert_array_equal(contact.c, alone.c)
        np.testing.assert_array_equal(contact.t, alone.t)
    assert solve_strips_of_lines([], []) == []


@pytest.mark.parametrize("gap", GAPS)
def test_a_start_from_another_load_ends_at_the_same_contact(gap):
    line = line_of(GAPS[gap], -15.0, 15.0, 1500)
    cold = solved(line, 80e3, StripSearch(tolerance=1e-3))
    for before in (20e3, 76e3, 200e3):
        warm = solved(line, 80e3, StripSearch(tolerance=1e-3), start=solved(line, before))
        assert warm.converged
        assert warm.approach == pytest.approx(cold.approach, rel=1e-3)
        peak = float((warm.c * np.sqrt(warm.q)).max())
        assert peak == pytest.approx(float((cold.c * np.sqrt(cold.q)).max()), rel=3e-3)


def test_a_second_lobe_that_the_start_does_not_have_is_found():
    line = line_of(hump, -15.0, 40.0, 2750)
    before = solved(line, 5e3)
    assert before.t[before.q > 0.0].max() < 10.0
    assert solved(line, 120e3, start=before).t[-1] > 15.0


def test_a_turned_lobe_closes_by_its_cosine():
    # one lobe in a plane turned by 0.4 rad: Hertz along its own normal, where force and approach have the cosine
    cosine = math.cos(0.4)
    flat_line, hertz = parabola(1.0)
    turned_line = GapLine(
        t_mm=flat_line.t_mm,
        f_mm=flat_line.f_mm / cosine,
        A_per_mm=A / cosine,
        contact_modulus_MPa=MODULUS,
        turned_rad=np.full_like(flat_line.t_mm, 0.4),
    )
    contact = solve_strip_theory(turned_line, cosine * hertz.normal_force_N)
    assert abs(relative_percent(contact.p_max_MPa, hertz.p0_MPa)) < 0.3
    assert abs(relative_percent(contact.area_mm2, hertz.area_mm2)) < 0.3
    assert abs(relative_percent(cosine * contact.approach_mm, hertz.approach_mm)) < 0.3


@pytest.mark.parametrize(
    ("inclination", "shift_mm", "load_kN", "limit"),
    [
        # one patch; two lobes grown together; three contact points in planes of their own; gauge corner under 0.3 rad
        ("1:40", -4.0, 100.0, 0.5),
        ("1:40", 0.0, 100.0, 0.5),
        ("1:20", 6.0, 150.0, 2.5),
        ("1:40", 5.0, 50.0, 4.0),
    ],
)
def test_strips_are_the_half_space_on_real_pairs(inclination, shift_mm, load_kN, limit):
    case = Case(
        inclination_rad=parse_inclination(inclination),
        lateral_shift_mm=shift_mm,
        load_N=1e3 * load_kN,
        roll="touching",
    )
    placement = place_case(case)
    rung = expect_on_half_space(case, placement)[1].half_space
    patch = measure_patch(rung.pressure)
    line = build_gap_line_under_load(placement, rung.normal_force_N, contact_modulus_MPa=case.contact_modulus_MPa)
    contact = solve_strip_theory(line, rung.normal_force_N)
    assert contact.status == "solved"
    for value, reference in (
        (contact.p_max_MPa, patch.p_max_MPa),
        (contact.area_mm2, patch.area_mm2),
        (contact.a_mm, patch.a_mm),
        (contact.b_mm, patch.b_mm),
        (contact.approach_mm, rung.approach_mm),
    ):
        assert abs(relative_percent(value, reference)) < limit
    # positions count along the surface, as on the half-space's grid
    assert contact.centre_t_mm == pytest.approx(patch.centre_y_mm, abs=0.02 * patch.b_mm)


@pytest.mark.parametrize(("near_places", "index", "run"), [("0110", 1, "11"), ("1011", 2, "11"), ("111", 0, "111")])
def test_a_line_ends_where_the_gap_is_too_wide_on_each_side_of_the_touch_point(near_places, index, run):
    places = np.array([letter == "1" for letter in near_places])
    run_slice = _run_around(places, index)
    assert run_slice.start <= index < run_slice.stop
    assert "".join("01"[int(is_near)] for is_near in places[run_slice]) == run


def test_runs_of_a_line_reach_half_a_step_beyond_their_places():
    line = SimpleNamespace(t=0.5 * np.arange(6.0))
    (low, high), (last, end) = _selected_spans(line, np.array([False, True, True, False, False, True]))
    # not beyond the end of the line
    assert (low, high, last, end) == pytest.approx((0.25, 1.25, 2.25, 2.5), abs=1e-12)


@pytest.mark.parametrize(("shift", "approach"), [(-3.0, 0.15), (6.0, 0.4), (6.3, 0.15), (6.3, 0.4)])
def test_the_line_of_a_wheel_that_has_slid_is_that_of_the_wheel_there(shift, approach):
    """The line of the displaced wheel equals the shifted line, also in the root of the flange.

    A slide of a millimetre there brings places together that did not face each other.
    """
    placement = place_case(Case(lateral_shift_mm=shift))
    slide = -approach * math.tan(placement.first.contact_angle_rad)
    centre = placement.wheel.centre_mm + slide * placement.first.tangent
    line_after_slide = build_gap_line(
        replace(placement, wheel=replace(placement.wheel, centre_mm=centre)), contact_modulus_MPa=1.1e5
    )
    slid = build_gap_line(placement, contact_modulus_MPa=1.1e5, slide_mm=slide)
    assert np.array_equal(slid.t_mm, line_after_slide.t_mm)
    # both sought to 1e-11 mm, from other guesses
    assert np.abs(slid.f_mm - line_after_slide.f_mm).max() < 1e-10


def test_a_note_has_the_part_of_the_patch_that_is_flat_or_concave():
    """Of ten places six are in contact, and three of these are flat: those outside do not count."""
    curvature = np.array([-1e-3, 0.0, 1e-3, 1e-3, 1e-3, -1e-3, -1e-3, 0.0, 0.0, 0.0])
    line = GapLine(
        t_mm=np.arange(10.0), f_mm=np.zeros(10), A_per_mm=1e-3, contact_modulus_MPa=MODULUS, B_per_mm=curvature
    )
    inside = np.zeros(10, bool)
    inside[2:8] = True
    assert line.concave_notes(inside) == [
        "50 % of the patch is flat or concave across; its gap coefficient B was set to 0.0001 1/mm there"
    ]
    assert line.concave_notes(curvature > 0.0) == []
