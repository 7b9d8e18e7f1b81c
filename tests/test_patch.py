"""Measures of a contact patch on exact pressures, and the patch that is expected before any mesh is made."""

import math
from dataclasses import fields

import numpy as np
import pytest

from fecontact.case import Case
from fecontact.comparison.measures import (
    MEASURES,
    Measures,
    deviations,
    hertz_measures,
    measures_of,
    patch_of,
    reading_uncertainty,
)
from fecontact.comparison.patch import measure_patch, signed_square
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.rung import Rung
from fecontact.contact.solver import solve_contact
from fecontact.errors import InputError
from fecontact.material import STEEL, contact_modulus_MPa
from fecontact.solving.expected_patch import ExpectedPatch, approach_direction, expected_patch
from fecontact.solving.position import place_case
from fecontact.theory.hertz import HertzContact, hertz_from_hessian

MODULUS = contact_modulus_MPa(STEEL, STEEL)
A, B, P0 = 7.0, 4.0, 1000.0


def field(x: np.ndarray, s: np.ndarray, p: np.ndarray, *, half: bool = False) -> Field:
    return Field(grid=ContactGrid(x_mm=x, s_mm=s, half=half), values=p)


def sampled(count: float, *, turn: float = 0.0, offset: tuple[float, float] = (0.0, 0.0)):
    """Ellipsoidal pressure on a grid of `count` nodes a semi-axis; `offset` moves the grid by parts of a step."""
    dx, ds = A / count, B / count
    k = int(1.8 * A / min(dx, ds) if turn else 1.3 * count) + 2
    x, s = dx * (np.arange(-k, k + 1) + offset[0]), ds * (np.arange(-k, k + 1) + offset[1])
    c, t = math.cos(turn), math.sin(turn)
    u, v = c * x[:, None] + t * s[None, :], -t * x[:, None] + c * s[None, :]
    return x, s, P0 * np.sqrt(np.maximum(0.0, 1.0 - (u / A) ** 2 - (v / B) ** 2))


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.3, 0.45), (0.5, 0.5)])
@pytest.mark.parametrize("count", [5, 8, 12])
def test_measures_of_an_exact_ellipsoid(count, offset):
    patch = measure_patch(field(*sampled(count, offset=offset)))
    # the outline is a polygon between nodes: its chords cut off the square of a step, in units of the semi-axis
    # measured: 1.3 % at 5 nodes a semi-axis, 0.45 % at 8, 0.2 % at 12
    assert patch.area_mm2 == pytest.approx(math.pi * A * B, rel=0.4 / count**2)
    assert patch.extent_x_mm == pytest.approx(2.0 * A, rel=0.3 / count**2)
    assert patch.extent_y_mm == pytest.approx(2.0 * B, rel=0.3 / count**2)
    assert patch.area_spread_mm2 < 0.5 / count**2 * patch.area_mm2
    # p^2 is a paraboloid, so that the fit is exact
    assert (patch.a_mm, patch.b_mm) == pytest.approx((A, B), rel=1e-9)
    # the centre is a sum over nodes of a pressure with vertical edges: cells at the edge count wholly or not
    assert (patch.centre_x_mm, patch.centre_y_mm) == pytest.approx((0.0, 0.0), abs=0.05 * A / count)
    # half a step from the peak the ellipsoid is lower by at most (1/2)^2 / count^2
    assert P0 * (1.0 - 0.3 / count**2) <= patch.p_max_MPa <= P0
    assert patch.pieces == 1


def test_area_error_falls_with_second_order():
    counts = np.array([6, 9, 13, 19])
    errors = [
        abs(measure_patch(field(*sampled(n, offset=(0.3, 0.2)))).area_mm2 / (math.pi * A * B) - 1) for n in counts
    ]
    # at least: the mean of the outlines with and without the edge nodes makes part of the error cancel
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] > 1.7
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("turn", [0.3, -0.6])
def test_turned_ellipse(turn):
    x, s, p = sampled(10, turn=turn)
    # and away from the origin, where the fit has linear terms as well
    patch = measure_patch(field(x + 3.0, s - 2.0, p))
    c, t = math.cos(turn), math.sin(turn)
    # extents of a turned ellipse, and its principal semi-axes as Hertz states them
    assert patch.extent_x_mm == pytest.approx(2.0 * math.hypot(A * c, B * t), rel=0.01)
    assert patch.extent_y_mm == pytest.approx(2.0 * math.hypot(A * t, B * c), rel=0.01)
    assert (patch.centre_x_mm, patch.centre_y_mm) == pytest.approx((3.0, -2.0), abs=1e-9)
    assert patch.a_mm == pytest.approx(A, rel=1e-9)
    assert patch.b_mm == pytest.approx(B, rel=1e-9)
    assert patch.area_mm2 == pytest.approx(math.pi * A * B, rel=0.01)


def test_half_model_is_mirrored():
    x, s, p = sampled(8)
    p = p * (1.0 + 0.2 * s[None, :] / B)
    middle = x.size // 2
    half, full = measure_patch(field(x[middle:], s, p[middle:], half=True)), measure_patch(field(x, s, p))
    for name, value in vars(full).items():
        assert getattr(half, name) == pytest.approx(value, rel=1e-9, abs=1e-12)
    assert half.centre_y_mm > 0.1


def test_two_separate_patches():
    x, s = np.linspace(-6.0, 6.0, 61), np.linspace(-12.0, 12.0, 121)

    def lobe(middle, a, b, p0):
        return p0 * np.sqrt(np.maximum(0.0, 1.0 - (x[:, None] / a) ** 2 - ((s[None, :] - middle) / b) ** 2))

    patch = measure_patch(field(x, s, lobe(-6.0, 4.0, 2.0, 800.0) + lobe(5.0, 3.0, 3.0, 1000.0)))
    assert patch.pieces == 2
    assert patch.area_mm2 == pytest.approx(math.pi * (8.0 + 9.0), rel=0.01)
    assert patch.extent_y_mm == pytest.approx(16.0, rel=0.01)
    assert patch.extent_x_mm == pytest.approx(8.0, rel=0.01)
    # the axes are those of the lobe with the peak
    assert (patch.a_mm, patch.b_mm) == pytest.approx((3.0, 3.0), rel=1e-6)
    # forces 2/3 pi a b p0: 8 * 800 at -6 and 9 * 1000 at 5
    assert patch.centre_y_mm == pytest.approx((-6.0 * 6400.0 + 5.0 * 9000.0) / 15400.0, abs=0.05)


def test_no_ellipsoid_no_axes():
    x = s = np.linspace(-3.0, 3.0, 13)
    single = np.zeros((13, 13))
    single[6, 6] = 5.0
    tiny = measure_patch(field(x, s, single))
    assert math.isnan(tiny.a_mm)
    assert math.isnan(tiny.b_mm)
    assert tiny.pieces == 1
    # rising to both ends along x: a saddle, not concave
    saddle = np.where(np.abs(s[None, :]) < 2.0, 10.0 + x[:, None] ** 2 - s[None, :] ** 2, 0.0)
    assert math.isnan(measure_patch(field(x, s, saddle)).a_mm)


def test_signed_square_continues_a_paraboloid():
    x, s, p = sampled(6, offset=(0.2, 0.4))
    q = signed_square(p)[1:-1, 1:-1]
    core = signed_square(p, without_edge=True)[1:-1, 1:-1]
    exact = P0**2 * (1.0 - (x[:, None] / A) ** 2 - (s[None, :] / B) ** 2)
    inside = p > 0.0
    np.testing.assert_allclose(q[inside], exact[inside], rtol=1e-12)
    assert np.all(q[~inside] < 0.0)
    # one step beyond the ends of the axes, where three nodes of the line lie inside
    row, column = int(np.argmin(np.abs(x))), int(np.argmin(np.abs(s)))
    end = int(np.flatnonzero(inside[row])[-1]) + 1
    assert q[row, end] == pytest.approx(exact[row, end], rel=1e-9)
    end = int(np.flatnonzero(inside[:, column])[0]) - 1
    assert q[end, column] == pytest.approx(exact[end, column], rel=1e-9)
    # without the edge nodes nothing changes on an exact paraboloid, wherever three nodes are in line
    np.testing.assert_allclose(
        core[row, 2:-2][inside[row, 2:-2]], exact[row, 2:-2][inside[row, 2:-2]], atol=1e-9 * P0**2
    )


# --- measures -----------------------------------------------------------------------------------------------------

READINGS = {
    "p_max_MPa": (lambda patch, rung: patch.p_max_MPa, lambda hertz: hertz.p0_MPa),
    "area_mm2": (lambda patch, rung: patch.area_mm2, lambda hertz: hertz.area_mm2),
    "a_mm": (lambda patch, rung: patch.a_mm, lambda hertz: hertz.a_mm),
    "b_mm": (lambda patch, rung: patch.b_mm, lambda hertz: hertz.b_mm),
    "extent_x_mm": (lambda patch, rung: patch.extent_x_mm, lambda hertz: hertz.extent_x_mm),
    "extent_y_mm": (lambda patch, rung: patch.extent_y_mm, lambda hertz: hertz.extent_y_mm),
    "approach_mm": (lambda patch, rung: rung.approach_mm, lambda hertz: hertz.approach_mm),
}


def solved_ellipse() -> tuple[Rung, HertzContact]:
    hertz = hertz_from_hessian([[1 / 460, 0.0], [0.0, 1 / 300]], normal_force_N=100e3, contact_modulus_MPa=MODULUS)
    grid = ContactGrid(x_mm=hertz.a_mm / 6.0 * np.arange(9), s_mm=hertz.b_mm / 6.0 * np.arange(-8, 9), half=True)
    gap = 0.5 / 460 * grid.x_mm[:, None] ** 2 + 0.5 / 300 * grid.s_mm**2
    solution = solve_contact(half_space_problem(grid, gap.ravel(), contact_modulus_MPa=MODULUS), 100e3)
    return Rung.of(grid, solution, approach_mm=solution.approach_mm), hertz


def test_a_measure_is_one_entry():
    """Everything that reads measures follows the fields of `Measures`, in their order."""
    rung, hertz = solved_ellipse()
    patch = patch_of(rung)
    assert patch == measure_patch(rung.pressure)
    names = tuple(entry.name for entry in fields(Measures))
    assert tuple(READINGS) == MEASURES == names
    # each entry says itself how it is read: nothing else needs to know its name
    assert all(set(entry.metadata) == {"of_contact", "of_hertz", "reading"} for entry in fields(Measures))
    fe, analytic = measures_of(rung), hertz_measures(hertz)
    assert tuple(fe.as_dict()) == tuple(analytic.as_dict()) == names
    assert tuple(reading_uncertainty(patch)) == tuple(deviations(analytic, fe)) == names
    for entry in fields(Measures):
        of_contact, of_hertz = READINGS[entry.name]
        assert getattr(fe, entry.name) == fe.as_dict()[entry.name] == of_contact(patch, rung)
        assert getattr(analytic, entry.name) == analytic.as_dict()[entry.name] == of_hertz(hertz)
        assert entry.metadata["of_contact"](patch, rung) == of_contact(patch, rung)
        assert entry.metadata["of_hertz"](hertz) == of_hertz(hertz)
        assert reading_uncertainty(patch)[entry.name] == entry.metadata["reading"](patch)
        deviation = of_hertz(hertz) / of_contact(patch, rung) - 1.0
        assert deviations(analytic, fe)[entry.name] == pytest.approx(deviation, rel=1e-12)


def test_only_the_area_has_an_uncertainty_of_reading():
    patch = measure_patch(solved_ellipse()[0].pressure)
    found = reading_uncertainty(patch)
    assert patch.area_spread_mm2 > 0.0
    assert found.pop("area_mm2") == 0.25 * patch.area_spread_mm2 / patch.area_mm2
    assert set(found.values()) == {0.0}


# --- the expected patch -----------------------------------------------------------------------------------------


def expected(case: Case) -> ExpectedPatch:
    placement = place_case(case)
    return expected_patch(
        placement,
        case.load_N,
        contact_modulus_MPa=MODULUS,
        direction=approach_direction(placement, normal_force=case.load_kind == "normal"),
        half=case.half,
    )


@pytest.mark.parametrize("radius", [300.0, 80.0, 13.0])
def test_expected_patch_of_a_closed_form_pair(radius):
    case = Case(rail=f"circle:{radius:g}", wheel="cylinder:460", inclination_rad=0.0)
    patch = expected(case)
    curvature = place_case(case).first.curvatures[0].hessian
    hertz = hertz_from_hessian(curvature, normal_force_N=case.load_N, contact_modulus_MPa=MODULUS)
    # the last node with pressure lies within a step, a sixteenth of a semi-axis, of the edge; R 13 bends away from its
    # tangent by (1/13)^2 / 8 and the patch shrinks a little
    assert patch.x_high_mm == pytest.approx(hertz.a_mm, rel=1.5 / 16.0)
    assert patch.semi_axis_x_mm == pytest.approx(hertz.a_mm, rel=1.5 / 16.0)
    assert patch.semi_axis_s_mm == pytest.approx(hertz.b_mm, rel=1.5 / 16.0)
    assert (patch.s_high_mm - patch.s_low_mm) == pytest.approx(2.0 * hertz.b_mm, rel=1.5 / 16.0)
    assert measures_of(patch.half_space).p_max_MPa == pytest.approx(hertz.p0_MPa, rel=0.01)
    assert measures_of(patch.half_space).approach_mm == pytest.approx(hertz.approach_mm, rel=0.01)


def test_two_lobes_are_measured_by_the_narrower_one():
    patch = expected(Case(lateral_shift_mm=0.0))
    # two lobes about rail y 0.19 and -10.4: the box holds both, the semi-axis is that of one
    assert patch.s_high_mm - patch.s_low_mm > 14.0
    assert patch.s_low_mm < -10.6 < patch.s_high_mm
    # frozen: half widths 2.0 and 5.7 mm, to a node's spacing
    assert patch.semi_axis_s_mm == pytest.approx(2.0, abs=0.3)
    # half-space on the true gap, 995 MPa in another programme; here 6 nodes across the narrow lobe: measured 0.9 %
    assert measures_of(patch.half_space).p_max_MPa == pytest.approx(995.0, rel=0.02)


@pytest.mark.parametrize(("shift", "peak"), [(-4.0, 1134.0), (2.0, 1504.0)])
def test_expected_peak_of_the_standard_pair(shift, peak):
    # half-space on the true gap in another programme; a coarse solution to 0.5 %
    assert measures_of(expected(Case(lateral_shift_mm=shift)).half_space).p_max_MPa == pytest.approx(peak, rel=0.01)


def test_expected_patch_with_yaw_is_turned_over_by_opposite_yaw():
    one = expected(Case(lateral_shift_mm=6.0, yaw_rad=0.01))
    other = expected(Case(lateral_shift_mm=6.0, yaw_rad=-0.01))
    # the grid starts at one end, so that the mirrored one lies otherwise by up to a step
    step = one.semi_axis_x_mm / 16.0
    assert one.x_low_mm == pytest.approx(-other.x_high_mm, abs=step)
    assert one.x_high_mm == pytest.approx(-other.x_low_mm, abs=step)
    assert one.s_low_mm == pytest.approx(other.s_low_mm, abs=one.semi_axis_s_mm / 16.0)
    assert measures_of(one.half_space).p_max_MPa == pytest.approx(measures_of(other.half_space).p_max_MPa, rel=5e-3)


def test_first_guess_does_not_matter():
    case = Case(lateral_shift_mm=-4.0)
    placement = place_case(case)
    options = {"contact_modulus_MPa": MODULUS, "direction": np.array([0.0, 0.0, 1.0]), "half": True}
    small, large = (expected_patch(placement, case.load_N, guess_mm=g, **options) for g in (0.005, 0.3))
    # grids fitted to slightly different boxes
    assert small.s_low_mm == pytest.approx(large.s_low_mm, abs=0.5)
    assert measures_of(small.half_space).p_max_MPa == pytest.approx(measures_of(large.half_space).p_max_MPa, rel=0.01)


def test_patch_past_the_end_of_the_rail_is_refused():
    with pytest.raises(InputError, match="reaches the end of the running surface of rail circle:300"):
        expected(Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, load_N=2e7))
