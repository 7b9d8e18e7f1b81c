"""The true gap on a half-space, opened by the additional displacement of the bodies.

It cannot expect a patch at ends and corners.
"""

import math
import re
import time
from dataclasses import replace

import numpy as np
import pytest
from kinked import case_on, kinked_rail
from rungs import rung_with

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact_theories.hertz import HertzContact, hertz_ellipse
from fecontact.errors import ConvergenceError, FecontactError, InputError
from fecontact.judging.measures import (
    MEASURES,
    UNCERTAINTIES,
    compute_hertz_deviations,
    read_hertz_misfit,
    read_measures,
)
from fecontact.judging.uncertainty import SolutionQuality, estimate_uncertainty
from fecontact.solving import expected_patch
from fecontact.solving.expected_patch import _make_fitted_grid
from fecontact.solving.lobe_sizes import measure_lobe_sizes
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space, expect_position, make_true_gap
from fecontact.solving.true_gap import TrueGap, interpolate_field

FLAT = """kind = "wheel"
units = "mm"
[[surface]]
type = "line"
from = [-70.0, 0.0]
to = [{end}, 0.0]
"""


def refused_within_seconds(case: Case, kind: type[FecontactError] = InputError) -> str:
    start = time.perf_counter()
    with pytest.raises(kind) as error:
        expect_on_half_space(case)
    # 0.2 s measured; without the check it took a minute and gave a contact that had not converged
    assert time.perf_counter() - start < 10.0
    return str(error.value)


@pytest.mark.parametrize("end", [1.0, 4.0])
def test_a_patch_at_the_end_of_a_wheel_s_line(tmp_path, end):
    wheel = tmp_path / "flat.toml"
    wheel.write_text(FLAT.format(end=end))
    said = refused_within_seconds(Case(rail="circle:300", wheel=str(wheel), inclination_rad=0.0))
    assert "reaches the end of the running surface of wheel flat" in said
    # b is 5.4 mm: where the line is longer than that there is nothing to say
    wheel.write_text(FLAT.format(end=6.5))
    assert expect_on_half_space(Case(rail="circle:300", wheel=str(wheel), inclination_rad=0.0))


def test_a_patch_over_a_corner_of_the_rail(tmp_path):
    said = refused_within_seconds(case_on(kinked_rail(tmp_path / "kinked.toml", 0.2)))
    assert "a corner of rail kinked at y = 2.00 mm" in said


# gauge corner and head, of which the one is 0.8 mm wide in a patch of 17 mm
THIN_LOBES = [
    Case(lateral_shift_mm=shift, roll="given", load_N=load_N) for shift, load_N in ((5.0, 150e3), (4.9, 120e3))
]


def test_a_lobe_too_thin_to_be_followed(monkeypatch):
    # eight nodes on the lobe are too many yet
    monkeypatch.setattr(expected_patch, "MOST_NODES", 2_000)
    said = refused_within_seconds(THIN_LOBES[0], ConvergenceError)
    assert re.search(
        r"a lobe of the pressure is 0\.\d+ mm long from its peak to a valley, in a patch 16.8 mm wide: it needs"
        r" \d+ by \d+ nodes; allowed: at most 2000 nodes, or lobes of at least \d\.\d+ mm; change",
        said,
    )


def test_the_flange_root_of_the_s1002_has_no_thin_lobe():
    """Its sections miss each other by 0.12 um there: 1795 MPa 27 um beside a valley on 12 thousand nodes, refused."""
    case = Case(lateral_shift_mm=6.6, roll="given")
    rungs = [expect_on_half_space(replace(case, load_N=load_N))[1].half_space for load_N in (48e3, 50e3, 52e3)]
    assert all(rung.pressure_MPa.shape[1] < 300 for rung in rungs)
    peaks = [read_measures(rung).p_max_MPa for rung in rungs]
    # 1248, 1273 and 1298 MPa, nearly a straight line over the load
    assert peaks[1] == pytest.approx(0.5 * (peaks[0] + peaks[2]), rel=5e-4)


def test_a_patch_that_coarse_nodes_end_too_soon_is_not_cut_off():
    """Steps of 6 um after steps of 0.2 mm: the patch went past their end, with 4167 MPa there, and was refused."""
    case = Case(rail="55E1", wheel="EN15302_A", lateral_shift_mm=6.5, load_N=39.6e3, roll="given")
    _, expected = expect_on_half_space(case)
    pressure = expected.half_space.pressure_MPa
    assert not pressure[:, [0, -1]].any()
    # both neighbours fit at once
    peaks = [
        expect_on_half_space(replace(case, load_N=load_N))[1].half_space.pressure_MPa.max() for load_N in (38e3, 41e3)
    ]
    assert pressure.max() == pytest.approx(np.mean(peaks), rel=5e-3)


@pytest.mark.parametrize("nodes", [32, 48])
def test_a_light_distant_patch_is_not_cut_off_by_its_band_of_nodes(nodes):
    """A light patch is solved again in a separate plane, and reaches further there.

    It has 0.15 % of the load, 17 mm away, and reaches 0.1 mm further. Cut off, it had a peak of 357 MPa at its end, and
    the area of both patches was 28 % too large.
    """
    case = Case(rail="55E1", wheel="EN13715_1in40_h32", inclination_rad=0.0, lateral_shift_mm=2.12, load_N=250e3)
    rung = expect_on_half_space(case, nodes=nodes)[1].half_space
    bands = rung.grid.bands
    assert len(bands) == 2
    first_columns = np.cumsum([0, *(band.s_mm.size for band in bands)])
    assert not rung.pressure_MPa[:, [*first_columns[:-1], *(first_columns[1:] - 1)]].any()
    # a single band of equal nodes, 16 on the main patch
    exact = expect_on_half_space(case, nodes=16)[1].half_space
    assert len(exact.grid.bands) == 1
    light_peaks = [float(contact.pressure_MPa[:, contact.grid.s_mm > 5.0].max()) for contact in (rung, exact)]
    assert light_peaks[0] == pytest.approx(light_peaks[1], rel=0.02)
    # measured 2 %: the light patch is three nodes long on equal nodes
    assert read_measures(rung).area_mm2 == pytest.approx(read_measures(exact).area_mm2, rel=0.03)


def test_a_narrow_highest_peak_leaves_the_size_of_its_lobe():
    """The size of a lobe does not follow a single node with the highest pressure."""
    grid = ContactGrid(x_mm=np.arange(4.0), s_mm=0.1 * np.arange(44), half=True)
    ridge = np.sqrt(np.maximum(0.0, 4.0 - (grid.s_mm - 2.1) ** 2))
    ridge[np.flatnonzero(ridge)[1]] = 5.0
    rung = rung_with(grid, np.outer([1.0, 0.5, 0.0, 0.0], ridge))
    sizes = measure_lobe_sizes(rung, least_nodes=4)
    assert sizes.large == [sizes.main]
    assert sizes.main[1] == pytest.approx(2.0, abs=0.11)


@pytest.mark.parametrize("case", THIN_LOBES)
def test_large_lobes_get_fewer_nodes_where_they_would_be_too_many(case, monkeypatch):
    """Fewer nodes give the contact on all nodes within the uncertainty of so coarse a grid.

    Such a contact was refused before.
    """
    exact = expect_on_half_space(case)[1].half_space
    monkeypatch.setattr(expected_patch, "MOST_NODES", 7_000)
    position = expect_position(case)
    coarse = position.expected.half_space
    assert math.prod(coarse.grid.shape) <= 7_000 < 0.4 * math.prod(exact.grid.shape)
    solution = SolutionQuality(more_nodes=position.more_nodes)
    coarse_measures, exact_measures = (read_measures(rung).as_dict() for rung in (coarse, exact))
    # measured: up to a tenth of what is stated; a length along x 0.3 of it
    for name in (name for name in MEASURES if UNCERTAINTIES[name].reading is not None):
        assert coarse_measures[name] == pytest.approx(
            exact_measures[name], rel=estimate_uncertainty(name, [coarse_measures[name]] * 2, solution)
        )
    # more is stated than of all nodes
    assert estimate_uncertainty("b_mm", [1.0, 1.0], solution) > estimate_uncertainty("b_mm", [1.0, 1.0]) + 1e-5


def test_thin_lobes_get_fewer_nodes_where_fewer_are_asked_for():
    grid = ContactGrid(x_mm=0.1 * np.arange(60), s_mm=0.05 * np.arange(-240, 261), half=True)
    x, s = grid.x_mm[:, None], grid.s_mm[None, :]
    wide, thin = (
        np.sqrt(np.maximum(0.0, 1.0 - (x / a) ** 2 - ((s - s0) / b) ** 2))
        for a, b, s0 in ((5.0, 8.0, -2.0), (2.5, 0.4, 6.4))
    )
    rung = rung_with(grid, 1000.0 * wide + 800.0 * thin)
    assert sorted(size[1] for size in measure_lobe_sizes(rung).every) == pytest.approx([0.4, 8.0], abs=0.051)
    sparing, plain = (_make_fitted_grid(rung, 16, most=limit) for limit in (3_000, None))
    assert math.prod(sparing.shape) <= 3_000 < 0.6 * math.prod(plain.shape)
    # up to half of the nodes that follow the thin lobe, and all of the wide one's
    for coarse_step, fine_step, wide_mm in zip(sparing.steps_mm, plain.steps_mm, (5.0, 8.0), strict=True):
        assert fine_step < coarse_step <= 2.0 * fine_step
        assert wide_mm / coarse_step > 15.5


@pytest.mark.slow
def test_the_least_lobes_get_fewer_nodes_where_they_would_be_too_many():
    """A load of 50 kN was refused for a thin lobe beside a wide patch.

    Loads of 45 and 55 kN were accepted.
    """
    case = Case(inclination_rad=math.atan(1.0 / 20.0), lateral_shift_mm=5.5, roll="given")
    peaks = []
    for load_N in (45e3, 50e3, 55e3):
        rung = expect_on_half_space(replace(case, load_N=load_N))[1].half_space
        assert rung.status == "converged"
        peaks.append(read_measures(rung).p_max_MPa)
    # on the line between its neighbours, which have their nodes: measured 0.2 % beside it
    assert peaks[1] == pytest.approx(0.5 * (peaks[0] + peaks[2]), rel=5e-3)


@pytest.mark.parametrize("kink_rad", [0.0, 0.003, -0.003])
def test_kinks_of_rounded_data_are_none(tmp_path, kink_rad):
    _, expected = expect_on_half_space(case_on(kinked_rail(tmp_path / "kinked.toml", kink_rad)))
    assert expected.half_space.status == "converged"
    # the patch lies over the kink, and is about as wide as without it
    assert expected.s_low_mm < 2.0 < expected.s_high_mm
    assert expected.s_high_mm - expected.s_low_mm == pytest.approx(10.8, abs=1.5)


# --- the true gap, opened by what bodies add ------------------------------------------------------------------------


def opened(rail: str = "circle:300", load_N: float = 10e3) -> tuple[TrueGap, HertzContact, ContactGrid]:
    """A cylinder on a circular head, and 16.4 nodes per semi-axis; a small load, so that both are parabolas."""
    case = Case(rail=rail, wheel="cylinder:460", inclination_rad=0.0, load_N=load_N)
    placement = place_case(case)
    hertz = hertz_ellipse(
        0.5 / 460, 0.5 / float(rail[7:]), normal_force_N=load_N, contact_modulus_MPa=case.contact_modulus_MPa
    )
    grid = ContactGrid(
        x_mm=hertz.a_mm / 16.4 * np.arange(24), s_mm=hertz.b_mm / 16.4 * (np.arange(-23, 24) + 0.3), half=True
    )
    return make_true_gap(case, placement), hertz, grid


def sample_field(hertz: HertzContact, values: object, nodes: int = 9) -> Field:
    """Sample a function of (x, s) on few nodes over the patch and a little around it.

    The nodes differ from the nodes of the contact and are far fewer.
    """
    grid = ContactGrid(
        x_mm=1.5 * hertz.a_mm / nodes * np.arange(nodes + 1),
        s_mm=1.5 * hertz.b_mm / nodes * (np.arange(-nodes, nodes + 1) + 0.2),
        half=True,
    )
    assert callable(values)
    return Field(grid=grid, values=np.asarray(values(grid.x_mm[:, None], grid.s_mm[None, :])))


def test_nothing_added_is_the_true_gap():
    true_gap, hertz, grid = opened()
    plain = true_gap.solve(grid, 10e3)
    zero = true_gap.solve(grid, 10e3, added=sample_field(hertz, lambda x, s: 0.0 * x * s))
    np.testing.assert_array_equal(zero.pressure_MPa, plain.pressure_MPa)
    assert (zero.approach_mm, zero.status) == (plain.approach_mm, "converged")
    # and that is Hertz's: measured 0.02 % in the peak, 0.06 % in a
    assert abs(compute_hertz_deviations(plain, hertz)["p_max_MPa"]) < 4e-4
    assert abs(compute_hertz_deviations(plain, hertz)["a_mm"]) < 9e-4


def test_a_constant_only_adds_to_the_approach():
    true_gap, hertz, grid = opened()
    plain = true_gap.solve(grid, 10e3)
    lifted = true_gap.solve(grid, 10e3, added=sample_field(hertz, lambda x, s: 0.004 + 0.0 * x * s))
    # residuals of 1e-6 of the approach, and normals that turn by 8 mrad below the patch: measured 5e-5
    np.testing.assert_allclose(lifted.pressure_MPa, plain.pressure_MPa, atol=1e-4 * plain.pressure_MPa.max())
    assert lifted.approach_mm - plain.approach_mm == pytest.approx(0.004, rel=2e-5)


@pytest.mark.parametrize("radius", [80.0, 300.0])
@pytest.mark.parametrize(("c", "d"), [(3e-4, 0.0), (0.0, 1e-3), (-4e-4, 8e-4), (5e-4, -6e-4)])
def test_added_curvature_is_hertz_with_that_curvature(radius, c, d):
    """A displacement added to the gap counts as the gap itself.

    It is given on few nodes, and is constant beyond them.
    """
    true_gap, hertz, _ = opened(f"circle:{radius:g}")
    changed = hertz_ellipse(
        0.5 * (1 / 460 + c), 0.5 * (1 / radius + d), normal_force_N=10e3, contact_modulus_MPa=hertz.contact_modulus_MPa
    )
    assert abs(changed.b_mm / hertz.b_mm - 1.0) > 0.005
    grid = ContactGrid(
        x_mm=changed.a_mm / 16.4 * np.arange(22), s_mm=changed.b_mm / 16.6 * (np.arange(-21, 22) + 0.3), half=True
    )
    rung = true_gap.solve(grid, 10e3, added=sample_field(changed, lambda x, s: 0.5 * (c * x**2 + d * s**2)))
    deviation = compute_hertz_deviations(rung, changed)
    # as exact ellipses are read; a circle of R 80 is a parabola to 1e-4 below a patch of 1.2 mm
    limits = {"p_max_MPa": 6e-4, "area_mm2": 3.5e-3, "a_mm": 9e-4, "b_mm": 9e-4, "approach_mm": 6e-4}
    assert {name: deviation[name] for name, limit in limits.items() if abs(deviation[name]) > limit} == {}
    assert read_hertz_misfit(rung, changed).misplaced_load < 4.5e-3
    assert read_hertz_misfit(rung, changed).valley == 0.0


def test_an_added_slope_moves_the_centre_and_nothing_else():
    true_gap, hertz, grid = opened()
    rung = true_gap.solve(grid, 10e3, added=sample_field(hertz, lambda x, s: 0.0 * x + 1e-4 * s))
    # the bottom of s^2 / 2 R + e s
    assert read_hertz_misfit(rung, hertz).centre_over_b == pytest.approx(-300.0 * 1e-4 / hertz.b_mm, rel=2e-3)
    assert read_measures(rung).p_max_MPa == pytest.approx(hertz.p0_MPa, rel=4e-4)


def test_a_carried_field_is_a_cubic_inside_and_constant_outside():
    x, s = np.linspace(0.0, 4.0, 6), np.linspace(-3.0, 5.0, 9)
    field = Field(
        grid=ContactGrid(x_mm=x, s_mm=s, half=True), values=x[:, None] ** 3 - 2.0 * x[:, None] * s**2 + s**3 - 1.0
    )
    at_x, at_s = np.array([0.0, 1.3, 3.9]), np.array([-2.9, 0.7, 4.4])
    exact = at_x[:, None] ** 3 - 2.0 * at_x[:, None] * at_s**2 + at_s**3 - 1.0
    np.testing.assert_allclose(interpolate_field(field, at_x, at_s), exact, atol=1e-10)
    outside = interpolate_field(field, np.array([0.0, 4.0, 9.0]), np.array([-8.0, -3.0, 5.0, 6.0]))
    np.testing.assert_array_equal(outside[2], outside[1])
    np.testing.assert_array_equal(outside[:, 0], outside[:, 1])
    np.testing.assert_array_equal(outside[:, 3], outside[:, 2])
    np.testing.assert_allclose(outside[1, 2], field.values[-1, -1], rtol=1e-12)


@pytest.mark.parametrize("yaw_rad", [0.0, 1e-9])
def test_the_box_is_hertz_s_ellipse_and_the_grid_leaves_a_rim_of_three_nodes(yaw_rad):
    """A half model, and a full model with a yaw that turns nothing.

    Both are symmetric.
    """
    hertz, expected = expect_on_half_space(replace(case_on("circle:300"), yaw_rad=yaw_rad))
    grid, half = expected.half_space.grid, yaw_rad == 0.0
    step_x, step_s = grid.steps_mm
    # a node that carries stands for half a step on each side
    assert (expected.x_low_mm, expected.x_high_mm) == pytest.approx((-hertz.a_mm, hertz.a_mm), abs=0.6 * step_x)
    assert (expected.s_low_mm, expected.s_high_mm) == pytest.approx((-hertz.b_mm, hertz.b_mm), abs=0.6 * step_s)
    assert grid.x_mm[-1] == pytest.approx(hertz.a_mm + 3.6 * step_x, abs=1.2 * step_x)
    assert grid.x_mm[0] == (0.0 if half else pytest.approx(-hertz.a_mm - 3.6 * step_x, abs=1.2 * step_x))
    assert grid.s_mm[0] == pytest.approx(-hertz.b_mm - 3.6 * step_s, abs=1.2 * step_s)
    assert grid.s_mm[-1] == pytest.approx(hertz.b_mm + 3.6 * step_s, abs=1.2 * step_s)


# --- a patch that is longer than the bodies ---------------------------------------------------------------------------


def test_a_patch_far_longer_than_the_bodies_is_refused_before_it_is_known_well(monkeypatch):
    """A load typed in N instead of kN is refused on a coarse grid.

    On 32 nodes the refusal takes 5 CPU s, and it is computed twice.
    """
    grids = []
    monkeypatch.setattr(
        "fecontact.solving.position.expect_on_half_space", lambda case, placement: grids.append(case.load_N) or 1 / 0
    )
    with pytest.raises(InputError, match=r"half length is 60 mm; allowed: .* contact zone \(about 7[78] mm\)"):
        expect_position(Case(load_N=1e8))
    # a patch of 42 mm is solved in bodies of 60 mm
    with pytest.raises(ZeroDivisionError):
        expect_position(Case(load_N=2e7))
    assert grids == [2e7]


def test_the_gap_on_a_grid_is_evaluated_once_for_each_slide(monkeypatch):
    """Repeated solutions on a single grid evaluate its gap only at the first.

    They differ in the planes of the patches and in the estimate of the displacement that elements add.
    """
    calls, gap = [], TrueGap.gap

    def count_points(self, x, s):
        calls.append(np.broadcast(x, s).size)
        return gap(self, x, s)

    monkeypatch.setattr(TrueGap, "gap", count_points)
    _, expected = expect_on_half_space(Case(lateral_shift_mm=3.0, load_N=20e3))
    grid, before = expected.half_space.grid, len(calls)
    true_gap = expected.true_gap
    assert true_gap.on(grid) is true_gap.on(grid)
    assert len(calls) == before
    # nodes elsewhere, or bodies that have slid, have gaps of their own
    aside = ContactGrid(x_mm=grid.x_mm, s_mm=grid.s_mm + 0.1, half=grid.half)
    slid = replace(true_gap, slide_mm=0.01)
    for gap_after, on in ((true_gap, aside), (slid, grid)):
        assert np.abs(gap_after.on(on) - true_gap.on(grid)).max() > 1e-5
    assert len(calls) == before + 2


def test_a_position_under_its_own_load_is_itself():
    """The largest load of each position of a map was expected twice."""
    position = expect_position(Case(load_N=20e3))
    assert position.for_load(20e3) is position
    other_load = position.for_load(30e3)
    assert other_load.case.load_N == 30e3
    # along the normal there is a little more than the wheel's load
    assert other_load.expected.half_space.normal_force_N == pytest.approx(30e3, rel=2e-3)


def test_a_side_of_the_head_that_faces_away_from_the_approach_has_no_nodes():
    """The vertical side of a crane rail along a normal of 44 degrees has no nodes.

    It had gaps of -50 mm and no pressure.
    """
    case = Case(
        rail="A45",
        wheel="EN15302_H",
        lateral_shift_mm=-4.0133,
        load_N=250e3,
        side="right",
        load_kind="normal",
        roll="given",
    )
    placement = place_case(case)
    half_space = expect_on_half_space(case, placement)[1].half_space
    _, normals = placement.surface(0.0, half_space.grid.s_mm)
    assert (normals @ placement.first.normal > 0.0).all()
    # a patch of 33 mm by 1.6 mm, nearly Hertz's: 8632 MPa
    assert read_measures(half_space).p_max_MPa == pytest.approx(9035.0, rel=2e-3)
