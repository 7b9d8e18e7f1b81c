"""Meshes of the two heads: valid, closed, true to the profiles, and refused where they cannot be."""

import itertools
import math
import signal
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.case import BodySize, Case, Track
from fecontact.errors import InputError
from fecontact.fe.body_mesh import (
    CORNER_SIGNS,
    BodyMesh,
    corner_jacobians,
    mesh_volume,
    shape_gradients,
    surface_normals,
)
from fecontact.fe.meshing import FineZone, _sweep_positions, estimate_least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.fe.section import (
    Stretch,
    Zone,
    _has_convex_quads,
    _is_on_segment,
    _place_graded_nodes,
    layer_depths,
    mesh_section,
    polygon_area,
)
from fecontact.placement.wheel_on_rail import Placement, place
from fecontact.profiles.curve import make_circular_rail_head, make_cylinder_wheel
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.solving.solve import solve

INCLINATION = math.atan(1.0 / 40.0)
ZONE = FineZone(half_length_mm=7.0, s_low_mm=-7.0, s_high_mm=7.0, step_x_mm=1.4, step_s_mm=1.0, semi_axis_mm=5.0)
NARROW = FineZone(half_length_mm=9.0, s_low_mm=-3.0, s_high_mm=3.0, step_x_mm=1.5, step_s_mm=0.5, semi_axis_mm=2.0)
SMALL = FineZone(half_length_mm=3.0, s_low_mm=-1.5, s_high_mm=1.5, step_x_mm=0.5, step_s_mm=0.25, semi_axis_mm=1.0)
# rail, wheel, lateral shift, zone: crown, gauge side, gauge corner and the flange's root, and closed forms
POSITIONS = {
    "crown": ("60E1", "S1002", -4.0, ZONE),
    "two lobes": (
        "60E1",
        "S1002",
        0.0,
        FineZone(half_length_mm=7.0, s_low_mm=-14.0, s_high_mm=6.0, step_x_mm=1.2, step_s_mm=0.8, semi_axis_mm=4.0),
    ),
    "gauge side": ("60E1", "S1002", 2.0, NARROW),
    "gauge corner": ("60E1", "S1002", 6.0, NARROW),
    "flange root": ("60E1", "S1002", 7.0, SMALL),
    "60E2": ("60E2", "S1002", 1.0, NARROW),
    "light rail": ("46E1", "S1002", -2.0, NARROW),
    "head only": ("MBench_UIC60", "S1002", 3.0, NARROW),
    "circle": ("circle:300", "cylinder:460", 0.0, ZONE),
    "slender": (
        "circle:13",
        "cylinder:460",
        0.0,
        FineZone(half_length_mm=12.0, s_low_mm=-1.6, s_high_mm=1.6, step_x_mm=1.5, step_s_mm=0.2, semi_axis_mm=1.0),
    ),
}


def placed(rail: str, wheel: str, shift: float, yaw: float = 0.0) -> Placement:
    """Placement of named profiles at a lateral shift (mm) and a yaw (rad)."""
    return place(
        resolve_rail(rail),
        resolve_wheel(wheel).profile,
        inclination_rad=0.0 if rail.startswith("circle") else INCLINATION,
        lateral_shift_mm=shift,
        yaw_rad=yaw,
        track=Track(rail_crown_y_mm=750.0) if rail.startswith("circle") else None,
    )


_positions: dict[str, tuple[Placement, FineZone, dict[str, BodyMesh]]] = {}


def position_meshes(key: str) -> tuple[Placement, FineZone, dict[str, BodyMesh]]:
    """Placement, fine zone and half meshes of a position; they are made once."""
    if key not in _positions:
        rail, wheel, shift, zone = POSITIONS[key]
        pair = placed(rail, wheel, shift)
        meshes = {
            "rail": rail_mesh(pair, zone, half=True, size=BodySize()),
            "wheel": wheel_mesh(pair, zone, half=True, size=BodySize()),
        }
        _positions[key] = pair, zone, meshes
    return _positions[key]


def full_pair() -> tuple[Placement, dict[str, BodyMesh]]:
    pair = placed("60E1", "S1002", 6.0, yaw=0.01)
    return pair, {
        "rail": rail_mesh(pair, NARROW, half=False, size=BodySize()),
        "wheel": wheel_mesh(pair, NARROW, half=False, size=BodySize()),
    }


EACH = list(itertools.product(POSITIONS, ("rail", "wheel")))


def area_vectors_and_volume(mesh: BodyMesh) -> tuple[np.ndarray, float]:
    """Integrals of the normal and of n . x / 3 over all named surfaces, by 2 x 2 Gauss points on bilinear faces."""
    quads = np.vstack(list(mesh.surfaces.values()))
    p = mesh.points[quads] - mesh.points.mean(axis=0)
    area, volume = np.zeros(3), 0.0
    g = 1.0 / math.sqrt(3.0)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for r, s in itertools.product((-g, g), repeat=2):
        shape = 0.25 * (1 + signs[:, 0] * r) * (1 + signs[:, 1] * s)
        d_r = 0.25 * signs[:, 0] * (1 + signs[:, 1] * s)
        d_s = 0.25 * signs[:, 1] * (1 + signs[:, 0] * r)
        at = np.einsum("c,qcd->qd", shape, p)
        normal = np.cross(np.einsum("c,qcd->qd", d_r, p), np.einsum("c,qcd->qd", d_s, p))
        area += normal.sum(axis=0)
        volume += float(np.einsum("qd,qd->", normal, at)) / 3.0
    return area, volume


def face_counts(mesh: BodyMesh) -> Counter[tuple[int, ...]]:
    faces = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    all_faces = np.sort(mesh.hexes[:, faces].reshape(-1, 4), axis=1)
    return Counter(map(tuple, all_faces.tolist()))


@pytest.mark.parametrize(("key", "name"), EACH)
def test_cells_are_valid_hexahedra(key, name):
    mesh = position_meshes(key)[2][name]
    assert mesh.hexes.shape[1] == 8
    # no collapsed hexahedra: prisms and pyramids would be written with repeated nodes
    assert all(len(set(cell)) == 8 for cell in mesh.hexes[::17].tolist())
    assert np.unique(np.sort(mesh.hexes, axis=1), axis=0).shape[0] == len(mesh.hexes)
    assert np.array_equal(np.unique(mesh.hexes), np.arange(len(mesh.points)))
    assert corner_jacobians(mesh).min() > 0.0
    # two nodes in the same place would tear the body open without any message
    spread = np.unique(np.round(mesh.points, 6), axis=0)
    assert len(spread) == len(mesh.points)


@pytest.mark.parametrize(("key", "name"), EACH)
def test_named_surfaces_partition_the_boundary(key, name):
    mesh = position_meshes(key)[2][name]
    counts = face_counts(mesh)
    assert set(counts.values()) == {1, 2}
    boundary = {face for face, count in counts.items() if count == 1}
    named_faces = np.sort(np.vstack(list(mesh.surfaces.values())), axis=1)
    assert len(named_faces) == len(boundary)
    assert {tuple(face) for face in named_faces.tolist()} == boundary
    surface_names = {"contact", "free", "end", "symmetry", "fixed" if name == "rail" else "driven"}
    assert set(mesh.surfaces) == surface_names
    assert all(len(quads) > 0 for quads in mesh.surfaces.values())


@pytest.mark.parametrize(("key", "name"), EACH)
def test_normals_point_outwards(key, name):
    mesh = position_meshes(key)[2][name]
    area, volume = area_vectors_and_volume(mesh)
    total = sum(float(np.ptp(mesh.points, axis=0).prod() ** (2 / 3)) for _ in range(6))
    # divergence theorem: exact for bilinear faces, so only rounding is left; a single face turned around shows at once
    np.testing.assert_allclose(area, 0.0, atol=1e-9 * total)
    assert volume == pytest.approx(mesh_volume(mesh), rel=1e-10)
    assert volume == pytest.approx(mesh.volume_mm3, rel=1e-9)


@pytest.mark.parametrize(("key", "name"), EACH)
def test_each_surface_lies_where_its_name_says(key, name):
    pair, _, meshes = position_meshes(key)
    mesh = meshes[name]
    normals = {surface: surface_normals(mesh, surface) for surface in mesh.surfaces}
    points = {surface: mesh.points[np.unique(quads)] for surface, quads in mesh.surfaces.items()}
    towards = 1.0 if name == "rail" else -1.0
    # the chords of the elements turn by at most half an element's angle against the true normal, 0.1 rad here
    assert np.all(normals["contact"] @ pair.first.normal * towards > 0.7)
    # a half model is cut at x = 0, exactly (the wheel's tread is set at the touch angle, 0 without yaw)
    np.testing.assert_allclose(points["symmetry"][:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(normals["symmetry"], [[-1.0, 0.0, 0.0]] * len(normals["symmetry"]), atol=1e-9)
    assert np.all(normals["end"][:, 0] > 0.9)
    if name == "rail":
        np.testing.assert_allclose(points["end"][:, 0], 60.0, atol=1e-9)
        # the base is a plane turned with the rail, 60 mm below the crown along the rail's own axis
        down = np.array([0.0, math.sin(pair.rail.inclination_rad), -math.cos(pair.rail.inclination_rad)])
        np.testing.assert_allclose(normals["fixed"], np.broadcast_to(down, normals["fixed"].shape), atol=1e-9)
        crown = np.array([0.0, pair.rail.crown_y_mm, pair.rail.crown_z_mm])
        np.testing.assert_allclose((points["fixed"] - crown) @ down, 60.0, atol=1e-9)
    else:
        # the inner face of the rim is a cylinder about the axle
        local = (points["driven"] - pair.wheel.centre_mm) @ pair.wheel.axes
        np.testing.assert_allclose(np.hypot(local[:, 0], local[:, 2]), 460.0 - 65.0, atol=1e-9)


@pytest.mark.parametrize("key", POSITIONS)
def test_rail_zone_is_a_uniform_grid_on_the_true_profile(key):
    pair, zone, meshes = position_meshes(key)
    mesh = meshes["rail"]
    nodes = mesh.contact_nodes
    assert nodes.shape == (zone.intervals_x + 1, zone.intervals_s + 1)
    x = np.linspace(0.0, zone.half_length_mm, nodes.shape[0])
    s = np.linspace(zone.s_low_mm, zone.s_high_mm, nodes.shape[1])
    true, _ = pair.surface(x[:, None], s[None, :])
    # parameters come from the arc length to 1e-11
    np.testing.assert_allclose(mesh.points[nodes], true, atol=1e-9)
    assert set(np.unique(mesh.surfaces["contact"])) == set(nodes.ravel())
    assert len(mesh.surfaces["contact"]) == zone.intervals_x * zone.intervals_s


@pytest.mark.parametrize("key", POSITIONS)
def test_wheel_zone_lies_on_the_revolved_profile_and_covers_the_rails(key):
    pair, zone, meshes = position_meshes(key)
    mesh, pose = meshes["wheel"], pair.wheel
    nodes = mesh.contact_nodes
    points = mesh.points[nodes]
    local = (points - pose.centre_mm) @ pose.axes
    y = local[..., 1] - pose.tape_circle_y_mm
    true = 460.0 - pose.profile.height(y)
    np.testing.assert_allclose(np.hypot(local[..., 0], local[..., 2]), true, atol=1e-9)
    # layers of equal angle, the step at the radius of the contact point
    theta = np.arctan2(local[..., 0], -local[..., 2])
    step = zone.half_length_mm / zone.intervals_x / float(pose.radius(pair.first.wheel_u))
    np.testing.assert_allclose(np.diff(theta, axis=0), step, atol=1e-12)
    arc = pose.profile.arc_length(pose.profile.locate(y[0]))
    np.testing.assert_allclose(np.diff(arc), np.diff(arc)[0], atol=1e-7)
    xs = pair.project(points)
    assert xs[..., 0].max() > zone.half_length_mm
    assert xs[-1, :, 0].min() > zone.half_length_mm
    assert xs[..., 0, 1].max() < zone.s_low_mm
    assert xs[..., -1, 1].min() > zone.s_high_mm


def test_wheel_volume_against_pappus():
    pair, _, meshes = position_meshes("circle")
    # ring sector of the cylinder: the chords of the layers lose a little of it, sin(h)/h of the largest step
    mesh = meshes["wheel"]
    theta = np.arctan2(mesh.points[:, 0], pair.wheel.centre_mm[2] - mesh.points[:, 2])
    closed = 135.0 * 0.5 * (460.0**2 - 395.0**2) * float(np.ptp(theta))
    assert mesh.volume_mm3 == pytest.approx(closed, rel=(12.0 / 395.0) ** 2 / 6.0 + 1e-12)
    assert mesh.volume_mm3 < closed


def test_rail_volume_against_the_circular_block():
    mesh = position_meshes("circle")[2]["rail"]
    half = math.asin(36.0 / 300.0)
    segment = 300.0**2 * (half - math.sin(half) * math.cos(half))
    edge_depth = 300.0 * (1.0 - math.cos(half))
    closed = 60.0 * (72.0 * (60.0 - edge_depth) + segment)
    # chords of at most 9 mm on R 300: 9^2 / (12 R) mm in height, over 60 mm
    assert mesh.volume_mm3 == pytest.approx(closed, rel=81.0 / (12.0 * 300.0) / 60.0)


def true_area(pair: Placement, closure_low: float) -> float:
    """Area between the running surface, sampled at 1 um, and a level line."""
    profile = pair.rail.profile
    p = profile.evaluate(profile.at_arc_length(np.linspace(0.0, profile.length_mm - 1e-9, 100001)))
    line = np.vstack(
        [np.column_stack([p.y, p.z]), [[p.y[-1], closure_low], [p.y[0], closure_low]]],
    )
    return polygon_area(line)


@pytest.mark.parametrize("key", ["circle", "head only", "slender"])
def test_section_area_of_a_head_without_outline(key):
    pair, _, meshes = position_meshes(key)
    # elements of up to 9 mm follow the sides; the head's shape matters to the contact by much less than 0.5 %
    assert meshes["rail"].volume_mm3 / 60.0 == pytest.approx(true_area(pair, -60.0), rel=5e-3)


def test_section_area_of_a_rail_with_its_outline():
    rail = load_library_profile("60E1")
    outline = np.vstack(
        [np.column_stack([p.y, p.z]) for p in (seg.evaluate(np.linspace(0, 1, 2001)) for seg in rail.outline)]
    )
    y, z = outline.T
    depth = 60.0
    # area of the outline above the cut: integrate its width over the height, by counting crossings
    levels = np.linspace(-depth, 0.0, 6001)
    levels = 0.5 * (levels[1:] + levels[:-1])
    width = np.zeros(levels.size)
    for (y0, y1), (z0, z1) in zip(
        zip(y, np.roll(y, -1), strict=True), zip(z, np.roll(z, -1), strict=True), strict=True
    ):
        if z0 == z1:
            continue
        hit = (levels > min(z0, z1)) & (levels <= max(z0, z1))
        width[hit] += np.sign(z0 - z1) * (y0 + (levels[hit] - z0) / (z1 - z0) * (y1 - y0))
    area = float(np.abs(width).sum()) * depth / levels.size
    # 0.5 % is what the head's outline may lose at its fillets; the contact sees 1e-3 of the head's compliance there
    assert position_meshes("crown")[2]["rail"].volume_mm3 / 60.0 == pytest.approx(area, rel=5e-3)


@pytest.mark.parametrize(
    ("half_length_mm", "wide_mm", "block_mm"), [(2.0, 20.0, 10.0), (7.0, 20.0, 14.0), (20.0, 20.0, 20.0)]
)
def test_the_block_below_a_short_zone_is_as_deep_as_half_of_its_width_asks_for(half_length_mm, wide_mm, block_mm):
    """Else the elements below are too stiff far from a pressure; the length decides from half of the width on."""
    zone = FineZone(
        half_length_mm=half_length_mm,
        s_low_mm=-0.4 * wide_mm,
        s_high_mm=0.6 * wide_mm,
        step_x_mm=0.5,
        step_s_mm=1.0,
        semi_axis_mm=8.0,
    )
    assert zone.block_widths_mm == pytest.approx([block_mm])
    band = Stretch(low_mm=zone.s_low_mm, high_mm=zone.s_high_mm, intervals=20)
    assert replace(zone, bands=(band,)).block_widths_mm == pytest.approx([min(2.0 * half_length_mm, wide_mm)])


@pytest.mark.parametrize("key", ["crown", "gauge side"])
def test_the_memory_that_is_asked_for_first_is_a_lower_bound(key):
    """Of 8 kB a node: on these small zones 7 % of all nodes lie in the two blocks that it counts."""
    _, zone, meshes = position_meshes(key)
    nodes = sum(len(mesh.points) for mesh in meshes.values())
    assert 0.06 < estimate_least_memory_bytes(zone) / (8e3 * nodes) < 0.08


def test_section_reports_its_areas():
    zone = Zone(
        stretches=(Stretch(low_mm=30.0, high_mm=42.0, intervals=12),), depth_step_mm=0.8, depth_mm=np.full(13, 5.0)
    )
    profile = resolve_rail("circle:300")
    section = mesh_section(profile, np.array([[36.0, -60.0], [-36.0, -60.0]]), (0, 1), zone)
    p = section.points[section.quads]
    d1, d2 = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    areas = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(section.outline_area_mm2, rel=1e-12)
    assert section.outline_area_mm2 == pytest.approx(section.true_area_mm2, rel=5e-3)
    np.testing.assert_allclose(
        section.points[section.block_nodes[0]],
        np.column_stack([(p := profile.evaluate(profile.at_arc_length(section.zone_arc_length_mm))).y, p.z]),
        atol=1e-12,
    )


def test_section_that_recombination_turns_inside_out():
    # on this zone gmsh moves a node through the corner of the uniform block, as on one of about 200 others
    zone = Zone(
        stretches=(Stretch(low_mm=60.27262004761905, high_mm=70.17738195238095, intervals=20),),
        depth_step_mm=0.3961904761904764,
        depth_mm=np.full(21, 4.457142857142857),
    )
    rail = load_library_profile("MBench_UIC60")
    (y_low, _), (y_high, _) = ((float(p.y), float(p.z)) for p in (rail.evaluate(0.0), rail.evaluate(7.0)))
    section = mesh_section(rail, np.array([[y_high, -60.0], [y_low, -60.0]]), (0, 1), zone)
    p = section.points[section.quads]
    ahead, back = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    assert np.all(ahead[..., 0] * back[..., 1] > ahead[..., 1] * back[..., 0])
    d1, d2 = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    total = 0.5 * float(np.sum(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]))
    assert total == pytest.approx(section.outline_area_mm2, rel=1e-12)


@pytest.mark.parametrize("low", [28.337, 31.791, 36.113, 40.959])
def test_a_section_is_meshed_alike_by_all_processors(low):
    """Their instruction sets move points by up to 2e-12 mm; gmsh alone then makes other meshes."""
    profile = resolve_rail("60E1")
    closure = np.array([[36.0, -60.0], [-36.0, -60.0]])

    def meshed(off: float):
        ends = low + off, low + 12.3 - off
        stretch = Stretch(low_mm=ends[0], high_mm=ends[1], intervals=12)
        zone = Zone(stretches=(stretch,), depth_step_mm=0.8, depth_mm=np.full(13, 5.0))
        return mesh_section(profile, closure, (0, 1), zone)

    first = meshed(0.0)
    for off in (-1e-12, 1e-12, 3e-12):
        rounded = meshed(off)
        np.testing.assert_array_equal(rounded.quads, first.quads)
        np.testing.assert_allclose(rounded.points, first.points, atol=1e-11)


SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
DART = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]])
BOW_TIE = SQUARE[[0, 2, 1, 3]]


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0, 4.0])
def test_cells_that_fold_are_seen_in_any_direction_and_order(turn):
    axes = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    square, dart, tie = (3.0 * shape @ axes + 50.0 for shape in (SQUARE, DART, BOW_TIE))
    assert _has_convex_quads(np.array([square, square + 1.0]))
    assert _has_convex_quads(square[None, ::-1])
    for wrong in (dart, tie, dart[::-1]):
        assert not _has_convex_quads(np.array([square, wrong]))
    # two cells of unlike order overlap
    assert not _has_convex_quads(np.array([square, square[::-1]]))


@pytest.mark.parametrize(("first", "total", "ratio"), [(0.5, 6.0, 1.2), (1.0, 1.5, 1.2), (0.1, 20.0, 1.35)])
def test_layer_depths(first, total, ratio):
    depths = layer_depths(first, total, ratio)
    assert (depths[0], depths[-1]) == pytest.approx((0.0, total))
    assert (len(depths) - 1) % 2 == 0
    steps = np.diff(depths)
    assert np.all(steps > 0.0)
    assert steps[0] <= first * 1.0000001
    np.testing.assert_allclose(steps[1:] / steps[:-1], (steps[1:] / steps[:-1])[0], rtol=1e-9)


def test_nodes_along_a_polyline_have_its_corners_and_steps_that_grow_from_its_ends():
    trace = np.array([[0.0, 0.0], [12.0, 16.0], [18.0, 16.0], [18.0, 46.0]])
    nodes = _place_graded_nodes(trace, (0.5, 2.0))
    np.testing.assert_allclose(nodes[[0, -1]], trace[[0, -1]], atol=1e-12)
    corners = [int(np.argmin(np.hypot(*(nodes - corner).T))) for corner in trace[1:3]]
    np.testing.assert_allclose(nodes[corners], trace[1:3], atol=1e-12)
    assert [count % 2 for count in np.diff([0, *corners, len(nodes) - 1])] == [0, 0, 0]
    steps = np.hypot(*np.diff(nodes, axis=0).T)
    # they grow from either end on, each by the same part
    for growth in (steps[1:4] / steps[:3], steps[-4:-1] / steps[-3:]):
        assert 1.2 < growth[0] < 1.5
        np.testing.assert_allclose(growth, growth[0], rtol=5e-3)
    assert steps[[0, -1]] == pytest.approx((0.5, 2.0), rel=0.3)


def test_full_model_of_a_yawed_pair():
    pair, meshes = full_pair()
    for name, mesh in meshes.items():
        assert not mesh.half
        assert "symmetry" not in mesh.surfaces
        counts = face_counts(mesh)
        assert sum(len(q) for q in mesh.surfaces.values()) == sum(count == 1 for count in counts.values())
        area, volume = area_vectors_and_volume(mesh)
        np.testing.assert_allclose(area, 0.0, atol=1e-6)
        assert volume == pytest.approx(mesh.volume_mm3, rel=1e-9)
        cover = 0 if name == "rail" else 2
        assert mesh.contact_nodes.shape[0] == 2 * (NARROW.intervals_x + cover) + 1
    xs = pair.project(meshes["rail"].points[meshes["rail"].contact_nodes])
    np.testing.assert_allclose(xs[..., 0], np.linspace(-9.0, 9.0, 13)[:, None] + 0.0 * xs[..., 0], atol=1e-9)


def test_full_model_is_twice_the_half():
    pair, zone, meshes = position_meshes("gauge side")
    for name, maker in (("rail", rail_mesh), ("wheel", wheel_mesh)):
        half = meshes[name]
        full = maker(pair, zone, half=False, size=BodySize())
        layer = len(half.surfaces["symmetry"])
        in_layer = len(np.unique(half.surfaces["symmetry"]))
        assert len(full.hexes) == 2 * len(half.hexes)
        assert len(full.hexes) % layer == 0
        assert len(full.points) == 2 * len(half.points) - in_layer
        assert full.volume_mm3 == pytest.approx(2.0 * half.volume_mm3, rel=1e-12)
        assert full.contact_nodes.shape[0] == 2 * half.contact_nodes.shape[0] - 1
        # the right half of the full model is the half model
        right = full.points[len(full.points) - len(half.points) :]
        np.testing.assert_allclose(right, half.points, atol=1e-9)


_HASH = """
import hashlib, sys
sys.path.insert(0, "tests")
from test_meshing import position_meshes
for mesh in position_meshes("gauge side")[2].values():
    digest = hashlib.sha256(mesh.points.tobytes() + mesh.hexes.tobytes())
    for name in sorted(mesh.surfaces):
        digest.update(mesh.surfaces[name].tobytes())
    print(digest.hexdigest())
"""


def test_meshes_are_the_same_bytes_in_every_run(request):
    runs = [
        subprocess.run(
            [sys.executable, "-c", _HASH], check=True, capture_output=True, text=True, cwd=request.config.rootpath
        ).stdout
        for _ in range(2)
    ]
    assert runs[0] == runs[1]
    assert len(set(runs[0].split())) == 2


def test_only_edges_within_a_segment_lie_on_it():
    start, end = np.array([30.0, 40.0]), np.array([33.0, 44.0])
    along = (end - start) / 5.0

    def edge(first, last, aside=0.0):
        return np.array([start + first * along, start + last * along + aside * np.array([-along[1], along[0]])])

    edges = np.array([edge(0.0, 1.0), edge(5.0, 4.0), edge(4.0, 5.1), edge(-0.1, 1.0), edge(1.0, 2.0, 0.01)])
    assert list(_is_on_segment(edges, start, end)) == [True, True, False, False, False]


# --- refusals ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rail", "depth", "message"),
    [
        ("60E1", 5.0, r"rail depth 5 mm: .* 60E1 reaches down to 35\.3 mm; give a rail depth at least 1 mm larger"),
        ("circle:300", 2.0, r"rail depth 2 mm: .* at least 1 mm larger"),
        ("60E1", 500.0, r"60E1 is 172\.0 mm high"),
    ],
)
def test_impossible_depth_is_refused(rail, depth, message):
    wheel = "cylinder:460" if rail.startswith("circle") else "S1002"
    pair = placed(rail, wheel, 0.0)
    with pytest.raises(InputError, match=message):
        rail_mesh(pair, SMALL, half=True, size=BodySize(rail_depth_mm=depth))


@pytest.mark.parametrize("depth", [40.0, 80.0, 140.0])
def test_other_depths_of_a_rail_with_its_outline(depth):
    pair = position_meshes("crown")[0]
    # head, web and foot: the mesh checks itself (volume, Jacobians); the cut must be one straight edge
    mesh = rail_mesh(pair, ZONE, half=True, size=BodySize(rail_depth_mm=depth))
    area, volume = area_vectors_and_volume(mesh)
    np.testing.assert_allclose(area, 0.0, atol=1e-6)
    assert volume == pytest.approx(mesh.volume_mm3, rel=1e-9)
    assert mesh.volume_mm3 > 0.0


def test_short_sweeps_are_refused():
    pair = placed("60E1", "S1002", 2.0)
    with pytest.raises(
        InputError, match=r"half length is 10 mm; allowed: at least two elements more than the contact zone"
    ):
        rail_mesh(pair, NARROW, half=True, size=BodySize(half_length_mm=10.0))
    with pytest.raises(InputError, match=r"the rim's half length is 12 mm; allowed: at least two elements"):
        wheel_mesh(pair, NARROW, half=True, size=BodySize(half_length_mm=12.0))


def test_zone_past_the_running_surface_is_refused():
    pair = placed("60E1", "S1002", 6.0)
    wide = FineZone(half_length_mm=9.0, s_low_mm=-45.0, s_high_mm=3.0, step_x_mm=1.5, step_s_mm=0.5, semi_axis_mm=5.0)
    with pytest.raises(InputError, match=r"extends beyond the running surface"):
        rail_mesh(pair, wide, half=True, size=BodySize())


@pytest.mark.parametrize("rim", [2.0, 5.0, 7.0])
def test_rim_thinner_than_the_tread_is_high_is_refused(rim):
    # the field side of the S1002 rises to 7.6 mm above its tape circle: such a rim is cut through its own surface
    with pytest.raises(
        InputError, match=r"wheel S1002: the cut is too close .* give a larger rail depth or rim thickness"
    ):
        wheel_mesh(placed("60E1", "S1002", 2.0), SMALL, half=True, size=BodySize(rim_thickness_mm=rim))


def test_cut_through_the_uniform_block_is_refused():
    # a zone 14 mm wide is meshed 6.3 mm deep, this rail has 4 mm below its crown
    rail = make_circular_rail_head(300.0, 20.0)
    pair = place(rail, make_cylinder_wheel(), inclination_rad=0.0, track=Track(rail_crown_y_mm=750.0))
    with pytest.raises(InputError, match=r"rail circle:300: the cut is too close .* 14\.00 mm, .* 6\.30 mm deep"):
        rail_mesh(pair, ZONE, half=True, size=BodySize(rail_depth_mm=4.0))


@pytest.mark.parametrize("name", ["rail_60E1", "wheel_S1002", "rail_circle_R300"])
def test_reference_meshes_can_be_read(name):
    import meshio

    mesh = meshio.read(Path(__file__).parents[1] / "meshes" / f"{name}.msh")
    body = name.partition("_")[0]
    held_surface = {"rail": "fixed", "wheel": "driven"}[body]
    assert set(mesh.field_data) == {"contact", held_surface, "free", "end", "symmetry", body}
    assert {block.type for block in mesh.cells} == {"quad", "hexahedron"}
    # no node is left over, and none is missing
    used_nodes = np.unique(np.concatenate([block.data.ravel() for block in mesh.cells if block.type == "hexahedron"]))
    assert np.array_equal(used_nodes, np.arange(len(mesh.points)))


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the process's signals from /proc")
def test_gmsh_leaves_broken_pipes_to_python():
    """gmsh sets SIGPIPE to its default.

    With the default a study would end when a worker process dies.
    """
    rail_mesh(placed("circle:300", "cylinder:460", 0.0), ZONE, half=True, size=BodySize())
    status = Path("/proc/self/status").read_text()
    ignored = int(next(line.split()[1] for line in status.splitlines() if line.startswith("SigIgn")), 16)
    assert ignored >> (signal.SIGPIPE - 1) & 1


def test_jacobians_at_the_corners_are_those_of_the_shape_functions():
    """Of a hexahedron with no plane face: edges from a corner are twice the derivatives there."""
    points = 0.5 * CORNER_SIGNS + np.random.default_rng(3).uniform(-0.15, 0.15, (8, 3))
    mesh = SimpleNamespace(points=points, hexes=np.arange(8)[None, :])
    (jacobians,) = corner_jacobians(mesh)
    expected = [8.0 * np.linalg.det(points.T @ shape_gradients(*corner)) for corner in CORNER_SIGNS]
    assert np.ptp(expected) > 0.3
    assert jacobians == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("end_mm", [30.0, 60.0, 100.0])
def test_elements_of_the_sweep_grow_to_three_tenths_of_its_length_at_most(end_mm):
    # at most 2.2 times the one before: few elements far away, where the solution is smooth
    x, zone = _sweep_positions(SMALL, end_mm, True, 0, "the length")
    steps = np.diff(x)
    assert x[-1] == pytest.approx(end_mm)
    np.testing.assert_allclose(steps[: zone.stop - 1], SMALL.step_x_mm)
    growth = steps[zone.stop - 1 :] / steps[zone.stop - 2 : -1]
    assert growth.max() < 2.2 + 1e-9
    # all are shortened alike until the last one ends at the cut plane, so the second and third tell the ratio
    assert growth[1] == pytest.approx(2.2)
    assert steps.max() <= 0.3 * end_mm


@pytest.mark.parametrize("radius_mm", [12.0, 30.0, 65.0, 460.0])
def test_default_cuts_follow_a_small_wheel(radius_mm):
    wheel = place(
        make_circular_rail_head(radius_mm),
        make_cylinder_wheel(),
        inclination_rad=0.0,
        rolling_radius_mm=radius_mm,
        track=Track(rail_crown_y_mm=750.0),
    )
    size = 0.03 * radius_mm
    zone = FineZone(
        half_length_mm=size,
        s_low_mm=-size,
        s_high_mm=size,
        step_x_mm=0.2 * size,
        step_s_mm=0.2 * size,
        semi_axis_mm=0.5 * size,
    )
    mesh = wheel_mesh(wheel, zone, half=True, size=BodySize())
    y, z = mesh.points[:, 0], mesh.points[:, 2]
    # the axle is a radius above the rail
    from_axle = np.hypot(y, z - radius_mm)
    assert from_axle.max() == pytest.approx(radius_mm, rel=1e-9)
    assert radius_mm - from_axle.min() == pytest.approx(min(65.0, 0.6 * radius_mm), rel=1e-6)
    assert np.arctan2(y, radius_mm - z).max() * radius_mm == pytest.approx(min(60.0, 1.2 * radius_mm), rel=1e-6)


def test_other_cuts_than_the_defaults_are_taken_or_refused():
    assert BodySize(rim_thickness_mm=30.0, half_length_mm=40.0).at_radius(50.0) == BodySize(
        rim_thickness_mm=30.0, half_length_mm=40.0
    )
    assert BodySize().at_radius(108.4) == BodySize()
    with pytest.raises(
        InputError, match=r"rim thickness .* is 50 mm; allowed: at most 47\.5 mm for a wheel of radius 50"
    ):
        BodySize(rim_thickness_mm=50.0).at_radius(50.0)
    with pytest.raises(InputError, match=r"half_length_mm\) is 70 mm; allowed: at most 60 mm for a wheel of radius 20"):
        BodySize(half_length_mm=70.0).at_radius(20.0)


def test_a_small_rig_has_the_peak_of_hertz():
    # crossed cylinders of one radius touch as a sphere of that radius touches a plane
    radius, force, modulus = 30.0, 500.0, 210e3 / (2.0 * (1.0 - 0.3**2))
    case = Case(
        rail=f"circle:{radius:g}", wheel=f"cylinder:{radius:g}", load_N=force, resolution="quick", refine="never"
    )
    peak = (6.0 * force * modulus**2 / (math.pi**3 * radius**2)) ** (1.0 / 3.0)
    # 0.06 % at this resolution, as with R 460
    assert solve(case).pressure_MPa.max() == pytest.approx(peak, rel=2e-3)
