"""Patches far apart: a grid with regular nodes at each patch.

The reference is a grid with regular nodes all over.
"""

from dataclasses import replace
from math import atan

import numpy as np
import pytest

from fecontact.case import BodySize, Case
from fecontact.contact.elements import Bands
from fecontact.contact.grid import ContactGrid, evaluate_hat_functions
from fecontact.contact.halfspace import build_half_space_compliance, build_half_space_problem
from fecontact.contact.solver import ContactProblem, solve_contact
from fecontact.errors import FoldedMeshError
from fecontact.fe.meshing import FineZone, rail_mesh, wheel_mesh
from fecontact.fe.section import Stretch, place_nodes
from fecontact.judging.lobes import split_lobes
from fecontact.judging.uncertainty import MESH_RATIO
from fecontact.solving.element_sizes import choose_element_size_mm, choose_element_width_mm
from fecontact.solving.fine_zone import MARGIN_ELEMENTS, ZoneMargin, enlarge_room, make_fine_zone
from fecontact.solving.meshes import CoupledMesh, Meshes
from fecontact.solving.position import expect_position
from fecontact.solving.preview import preview_case
from fecontact.solving.solve import _can_serve, _make_shared_position

MODULUS = 115e3
# The gauge corner and the top of the head touch, 5 mm of free surface between them.
TWO = Case(
    rail="MBench_UIC60",
    inclination_rad=atan(1 / 40),
    lateral_shift_mm=5.0,
    roll_rad=0.362e-3,
    load_N=50e3,
    resolution="quick",
    refine="never",
)


@pytest.fixture(scope="module")
def two():
    return expect_position(TWO)


def banded(half: bool) -> tuple[Bands, ContactGrid]:
    """Bands of steps 0.2 and 0.4 mm, 6 mm apart, and a regular grid.

    The regular grid of 0.2 mm contains all nodes of the bands.
    """
    stretches = (
        Stretch(low_mm=-2.0, high_mm=2.0, intervals=20),
        Stretch(low_mm=8.0, high_mm=16.0, intervals=20),
    )
    s = place_nodes(stretches)
    x = 0.25 * np.arange(0 if half else -16, 17)
    columns = (slice(0, 21), slice(s.size - 21, s.size))
    regular = ContactGrid(x_mm=x, s_mm=-2.0 + 0.2 * np.arange(91), half=half)
    return Bands(grid=ContactGrid(x_mm=x, s_mm=s, half=half), columns=columns, contact_modulus_MPa=MODULUS), regular


# --- the half-space of a banded grid ----------------------------------------------------------------------------


@pytest.mark.parametrize("half", [True, False])
def test_a_band_presses_on_the_other_one_as_on_regular_nodes(half):
    bands, regular = banded(half)
    at_first = np.zeros(bands.grid.shape)
    at_first[:13, 3:18] = np.random.default_rng(1).uniform(1.0, 2.0, (13, 15))
    same = np.zeros(regular.shape)
    same[:, :21] = at_first[:, :21]
    opening = bands.half_space()(at_first.ravel()).reshape(bands.grid.shape)
    expected = build_half_space_compliance(regular, MODULUS)(same.ravel()).reshape(regular.shape)
    np.testing.assert_allclose(opening[:, :21], expected[:, :21], rtol=1e-12)
    # cells of the other band are as large as 0.4 by 0.25 mm, 6 mm away: (h / r)^2 / 24 of it, in the mean of both cells
    np.testing.assert_allclose(opening[:, bands.columns[1]], expected[:, 50::2], rtol=2e-4)


@pytest.mark.parametrize("half", [True, False])
def test_a_banded_half_space_is_symmetric(half):
    """In the product by areas: contacts are found by conjugate gradients."""
    bands, _ = banded(half)
    compliance, area = bands.half_space(), bands.grid.whole_area_mm2()
    rng = np.random.default_rng(2)
    inside = np.zeros(bands.grid.shape, dtype=bool)
    inside[1 if half else 2 : -2, 2:-2] = True
    # neither on the plane of symmetry, whose nodes have half a cell, nor next to a strip
    for columns in bands.columns:
        inside[:, [columns.start, columns.stop - 1]] = False
    p, q = (np.where(inside, rng.uniform(size=bands.grid.shape), 0.0).ravel() for _ in range(2))
    q_work, p_work = np.dot(area * p, compliance(q)), np.dot(area * q, compliance(p))
    assert q_work == pytest.approx(p_work, rel=1e-12)


def test_two_contacts_on_bands_are_those_on_regular_nodes():
    """Forces and peaks of a ball on a small cap and on a wide cap.

    Each cap is 0.02 mm high beside the other cap.
    """

    def gap(x, s):
        return np.minimum((x**2 + s**2) / 60.0, 0.02 + (x**2 + (s - 12.0) ** 2) / 400.0)

    bands, regular = banded(True)
    problems = []
    for grid in (bands.grid, regular):
        x, s = np.meshgrid(grid.x_mm, grid.s_mm, indexing="ij")
        problems.append(
            build_half_space_problem(regular, gap(x, s).ravel(), contact_modulus_MPa=MODULUS)
            if grid is regular
            else ContactProblem(
                compliance=bands.half_space(),
                gap_mm=gap(x, s).ravel(),
                closing=np.ones(x.size),
                area_mm2=grid.whole_area_mm2(),
            )
        )
    banded_contact, expected = (solve_contact(problem, 9e3) for problem in problems)
    assert banded_contact.status == expected.status == "converged"
    assert banded_contact.approach_mm == pytest.approx(expected.approach_mm, rel=2e-4)
    for low, high in ((-2.0, 2.0), (8.0, 16.0)):
        force, peak = [], []
        for problem, solution, grid in zip(problems, (banded_contact, expected), (bands.grid, regular), strict=True):
            in_band = (grid.s_mm >= low) & (grid.s_mm <= high)
            force.append((problem.area_mm2 * solution.pressure_MPa).reshape(grid.shape)[:, in_band].sum())
            peak.append(solution.pressure_MPa.reshape(grid.shape)[:, in_band].max())
        assert min(force) > 2e3
        # the second patch has 8 nodes on its semi-axis here and 16 there
        assert force[0] == pytest.approx(force[1], rel=3e-3)
        assert peak[0] == pytest.approx(peak[1], rel=5e-3)


def test_one_band_is_a_regular_grid_to_the_last_bit():
    _, regular = banded(True)
    bands = Bands(grid=regular, columns=(slice(0, regular.shape[1]),), contact_modulus_MPa=MODULUS)
    p = np.random.default_rng(3).uniform(size=regular.nodal_area_mm2().size)
    assert np.array_equal(bands.half_space()(p), build_half_space_compliance(regular, MODULUS)(p))


def test_shape_functions_of_unequal_nodes():
    line = np.array([0.0, 0.5, 1.0, 3.0, 4.0])
    places = np.linspace(0.0, 4.0, 81)
    hats = evaluate_hat_functions(line, places)
    np.testing.assert_allclose(hats.sum(axis=0), 1.0, atol=1e-14)
    np.testing.assert_allclose(line @ hats, places, atol=1e-14)


# --- which patches are far apart --------------------------------------------------------------------------------


def test_patches_far_apart_are_parts_with_elements_of_their_own(two):
    """The case has two patches that are far apart.

    On the half-space they are 2.3 mm wide at the gauge corner and 6.9 mm on the head, with 5.1 mm between them.
    """
    corner, head = two.expected.parts
    assert corner.s_low_mm == two.expected.s_low_mm
    assert head.s_high_mm == two.expected.s_high_mm
    assert corner.larger == 1.0
    assert head.larger > 2.0
    between = head.s_low_mm - corner.s_high_mm
    assert between == pytest.approx(5.07, abs=0.05)
    assert between > 0.5 * (head.s_high_mm - head.s_low_mm)


@pytest.mark.parametrize(
    "case",
    [
        Case(lateral_shift_mm=-4.0, roll="given"),
        # two lobes of one patch, and two of the pair above under twice the load
        Case(lateral_shift_mm=-0.5, roll="given"),
        replace(TWO, load_N=100e3),
        # two patches, with less between them than half of the wider one
        Case(lateral_shift_mm=5.0, roll="given", load_N=100e3),
    ],
)
def test_other_patches_have_one_zone_of_equal_elements(case):
    position = expect_position(case)
    assert len(position.expected.parts) == 1
    zone = make_fine_zone(position.expected, position.element_size_mm)
    assert zone.bands == ()
    assert np.ptp(np.diff(zone.s_mm)) < 1e-12


def test_elements_whose_size_is_given_have_it_everywhere(two):
    case = replace(TWO, resolution=(0.4, 0.2))
    sizes = choose_element_size_mm(case, two.expected)
    position = expect_position(case)
    zone = make_fine_zone(position.expected, sizes)
    assert zone.bands == ()
    assert zone.step_s_mm == 0.2


def test_elements_below_patches_far_apart_are_longer(two):
    """Elements are four times as wide as for each patch alone.

    They have that length along x too, as long as each patch has its number of elements along x.
    """
    step_x, step_s = two.element_size_mm
    assert step_x == pytest.approx(4.0 * step_s, rel=1e-12)
    corner, head = two.expected.parts
    count = corner.semi_axes_mm[1] / step_s
    assert min(corner.semi_axes_mm[0], head.semi_axes_mm[0]) / step_x > count

    def sized(**changes):
        return choose_element_size_mm(TWO, replace(two.expected, parts=(corner, replace(head, **changes))))

    assert sized(semi_axes_mm=(3.0, 2.0)) == (pytest.approx(3.0 / count), step_s)
    # and never shorter than twice that of the narrowest, or than other patches have them
    assert sized(semi_axes_mm=(0.5, 2.0)) == (pytest.approx(2.0 * step_s), step_s)
    assert choose_element_size_mm(TWO, two.expected.joined()) == (pytest.approx(2.0 * step_s), step_s)


def test_bands_hold_the_patches_and_their_margins(two):
    zone = make_fine_zone(two.expected, two.element_size_mm)
    assert len(zone.bands) == 2
    s = zone.s_mm
    assert zone.intervals_s == s.size - 1
    assert zone.intervals_s % 2 == 0
    assert np.all(np.diff(s) > 0.0)
    for band, columns, patch_part in zip(zone.bands, zone.columns, two.expected.parts, strict=True):
        steps = np.diff(s[columns])
        np.testing.assert_allclose(steps, band.step_mm, rtol=1e-9)
        assert s[columns][0] <= patch_part.s_low_mm - MARGIN_ELEMENTS * band.step_mm + 1e-9
        assert s[columns][-1] >= patch_part.s_high_mm + MARGIN_ELEMENTS * band.step_mm - 1e-9
        assert band.step_mm <= 2.0 * zone.step_x_mm * (1.0 + 1e-9)
    assert zone.bands[0].step_mm == pytest.approx(zone.step_s_mm, rel=1e-9)
    # neighbouring steps grow by the rate of the grading, and by rounding to an even number
    growth = np.diff(s)[1:] / np.diff(s)[:-1]
    assert max(growth.max(), 1.0 / growth.min()) < 1.8
    # 74 elements without bands; margins of four elements, larger than those of finer meshes, are half of what is left
    assert (
        zone.intervals_s < 0.65 * make_fine_zone(two.expected, two.element_size_mm, ZoneMargin(joined=True)).intervals_s
    )


def test_bodies_have_the_zone_of_their_bands(two):
    """Rail nodes lie on the lines of the zone; the bands of the wheel face the bands of the rail."""
    zone = make_fine_zone(two.expected, two.element_size_mm)
    meshes = [make(two.placement, zone, half=True, size=TWO.size) for make in (rail_mesh, wheel_mesh)]
    on_rail, on_wheel = (two.placement.project(mesh.points[mesh.contact_nodes[0]]) for mesh in meshes)
    np.testing.assert_allclose(on_rail[:, 1], zone.s_mm, atol=1e-9)
    assert on_wheel[0, 1] < zone.s_mm[0]
    assert on_wheel[-1, 1] > zone.s_mm[-1]
    for band, columns in zip(zone.bands, zone.columns, strict=True):
        inside = (on_wheel[:, 1] > band.low_mm - 1e-6) & (on_wheel[:, 1] < band.high_mm + 1e-6)
        assert np.diff(on_wheel[inside, 1]).max() < 1.1 * band.step_mm
        assert columns.stop - columns.start - 1 == band.intervals


def test_layers_are_as_deep_as_the_line_above_them_allows(two):
    """Layers below the gauge corner of 13 mm end early.

    Below the head, the width of its band alone limits their depth.
    """
    bands = (Stretch(low_mm=-6.0, high_mm=6.0, intervals=24), Stretch(low_mm=14.0, high_mm=30.0, intervals=32))
    sizes = {"half_length_mm": 20.0, "step_x_mm": 0.5, "step_s_mm": 0.5, "semi_axis_mm": 6.0}
    zone = FineZone(s_low_mm=-6.0, s_high_mm=30.0, bands=bands, **sizes)
    mesh = rail_mesh(two.placement, zone, half=True, size=TWO.size)
    column = mesh.points[mesh.block_nodes[0]]
    depth_mm = np.linalg.norm(column[:, -1] - column[:, 0], axis=-1)
    corner, head = (depth_mm[columns] for columns in zone.columns)
    np.testing.assert_allclose(corner, 0.35 * 13.0, rtol=1e-6)
    np.testing.assert_allclose(head, 0.45 * 16.0, rtol=1e-6)
    # and between them they are no steeper than what a cell bears
    assert np.abs(np.diff(depth_mm) / np.diff(zone.s_mm)).max() <= 0.5 + 1e-9


def test_bands_that_meet_are_one_zone(two):
    wide = replace(
        two.expected,
        parts=tuple(
            replace(patch_part, s_low_mm=low, s_high_mm=high, larger=1.0)
            for patch_part, low, high in zip(two.expected.parts, (-0.9, 6.5), (6.0, 13.3), strict=True)
        ),
    )
    assert make_fine_zone(wide, two.element_size_mm).bands == ()
    zone = make_fine_zone(two.expected, two.element_size_mm)
    before, after = zone.bands
    with pytest.raises(FoldedMeshError, match="overlap"):
        rail_mesh(
            two.placement,
            replace(zone, bands=(before, replace(after, low_mm=before.high_mm - 0.1))),
            half=True,
            size=TWO.size,
        )


def test_a_contact_between_bands_joins_them(two):
    zone = make_fine_zone(two.expected, two.element_size_mm)
    grid = ContactGrid(x_mm=zone.step_x_mm * np.arange(zone.intervals_x + 1), s_mm=zone.s_mm, half=True)
    rung = replace(two.expected.half_space, grid=grid, pressure_MPa=np.zeros(grid.shape))
    first, last = zone.columns

    def room(*columns: int) -> ZoneMargin:
        pressure = np.zeros(grid.shape)
        pressure[0, list(columns)] = 1.0
        return enlarge_room(ZoneMargin(), replace(rung, pressure_MPa=pressure), two.expected, zone.columns)

    assert room(first.start + 5, last.stop - 6) == ZoneMargin()
    # on the strip, and next to the inner edge of a band
    assert room(first.stop + 1).joined
    assert room(first.stop - 2).joined
    assert room(last.start).joined
    # at an outer edge there is more room, as ever
    assert not room(first.start).joined
    assert room(first.start).s_low > 0.0
    assert make_fine_zone(two.expected, two.element_size_mm, ZoneMargin(joined=True)).bands == ()


# --- loads that share meshes ------------------------------------------------------------------------------------


def test_loads_share_bands_that_are_fine_enough_for_each(two):
    smaller = two.for_load(40e3)
    assert len(smaller.expected.parts) == 2
    together = _make_shared_position(two, [two, smaller], 1.0)
    assert _can_serve(together, two)
    assert _can_serve(together, smaller)
    # fine enough at the narrowest patch is not enough
    wide = tuple(replace(joint_part, larger=joint_part.larger * 1.2) for joint_part in together.expected.parts)
    assert not _can_serve(replace(together, expected=replace(together.expected, parts=wide)), smaller)
    for joint_part, smaller_part in zip(together.expected.parts, smaller.expected.parts, strict=True):
        assert choose_element_width_mm(together.element_size_mm, joint_part) <= (1 + 1e-9) * choose_element_width_mm(
            smaller.element_size_mm, smaller_part
        )


def test_one_patch_shares_as_before():
    position = expect_position(Case(lateral_shift_mm=-4.0, roll="given", resolution="quick"))
    smaller = position.for_load(60e3)
    shared = _make_shared_position(position, [position, smaller], 1.0)
    assert shared.expected == position.expected
    assert shared.element_size_mm == tuple(map(min, position.element_size_mm, smaller.element_size_mm))
    assert _can_serve(shared, position)
    assert _can_serve(shared, smaller)


# --- as one zone ------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_bands_and_one_zone_make_the_same_contact(two, monkeypatch):
    """Finite bodies with a band for each patch, and with equal elements all over.

    The equal elements are finer in deep layers. Layers of 25 steps are not deep enough there: 30,685 N below the head
    in place of 30,745, and in bands 30,760.
    """
    banded = Meshes(two).solve(two)
    monkeypatch.setattr("fecontact.fe.meshing._BLOCK_WIDTH_STEPS", 70)
    single_zone = replace(two, expected=two.expected.joined())
    finer = CoupledMesh(single_zone, 1.0 / MESH_RATIO)
    joined = finer.solve(single_zone)
    finer.close()
    assert banded.status == joined.status == "converged"
    unknowns = [sum(level.degrees_of_freedom.values()) for level in (banded.levels[0], joined)]
    assert unknowns[0] < 0.3 * unknowns[1]
    for banded_part, joined_part in zip(split_lobes(banded.levels[0].fe), split_lobes(joined.fe), strict=True):
        # measured 0.07, 0.15 and 0.14 %; the stated uncertainties are 0.1, 0.3 and 0.3 %
        assert banded_part.rung.normal_force_N == pytest.approx(joined_part.rung.normal_force_N, rel=1.5e-3)
        assert banded_part.rung.pressure_MPa.max() == pytest.approx(joined_part.rung.pressure_MPa.max(), rel=3e-3)
        assert banded_part.area_mm2 == pytest.approx(joined_part.area_mm2, rel=4e-3)


def test_a_preview_counts_the_elements_of_bands(two):
    previewed = preview_case(TWO)
    zone = make_fine_zone(two.expected, two.element_size_mm)
    assert previewed.elements[1] == zone.intervals_s


def test_other_meshes_begin_with_the_room_that_the_first_one_needed(monkeypatch):
    # no free elements between the patch and the edge of its zone
    monkeypatch.setattr("fecontact.solving.fine_zone.MARGIN_ELEMENTS", 0)
    size = BodySize(rail_depth_mm=25.0, rim_thickness_mm=25.0, half_length_mm=32.0)
    case = Case(
        rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, load_N=50e3, resolution=(1.4, 1.3), size=size
    )
    position = expect_position(case)
    meshes = Meshes(position, keep=True)
    solution = meshes.solve(position)
    assert [level.enlarged for level in solution.levels] == [1, 0]
    assert not any(level.at_edge for level in solution.levels)
    # a further load begins as it would by itself
    meshes.drop_enlarged()
    assert meshes.solve(position).levels[0].enlarged == 1
    meshes.close()
