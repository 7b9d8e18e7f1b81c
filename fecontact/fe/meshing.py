"""Hexahedral meshes of the two bodies: cross-sections swept in graded layers, along the rail and around the axle."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from fecontact.arrays import Floats, Integers
from fecontact.bodies import BodySize
from fecontact.errors import FoldedMesh, InputError, NotCovered
from fecontact.fe.body_mesh import BodyMesh, Spacing, check_mesh
from fecontact.fe.section import LAYER_RATIO, Section, Stretch, Zone, lines_of, mesh_section
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import Line, Segment

# --- The zone of equal elements around the expected patch, on which both meshes meet.

# Largest width, in steps and in semi-axes, that decides about the depth of the block: a wider block holds several
# patches and need be only as deep as for one of them. This saves a quarter to two fifths of the cost of a two-lobed
# contact, and moves its peak pressure by 2e-4 to 5e-4 at `quick`. The depth also follows the semi-axis, or finer meshes
# would not converge to the same bodies. With 20 steps two lobes take a tenth less time, but healthy elements of a gauge
# corner then read -2.3 % too soft, beyond their limit, instead of -1.3 %.
_PART_STEPS = 25
_PART_SEMI_AXES = 3.0
# The block below a zone that is shorter than this part of its width is as deep as if it had that length. On flat bodies
# and patches 0.32 times as long as wide healthy elements read -1.7 and -0.7 %; with their own length -3.5 and -2.3 %.
_OF_WIDE = 0.5
# The same where patches far apart have bands of their own: four layers that grow by 1.6 in place of eight that grow by
# 1.3, for half of the time. On a worn pair under 60 kN, with 8 and 67 mm of least radius below its patches, the peak,
# half-widths and the load on separate patches are within 0.08 % of those of eight layers, where both meshes of a case
# are up to 0.3 % apart, and the compliance is 0.1 % off. Layers that all ended where the tightest line allows: -2.5 %.
_PART_STEPS_IN_BANDS = 15
_LAYER_RATIO_IN_BANDS = 1.6


@dataclass(frozen=True, kw_only=True)
class FineZone:
    """Uniform zone around the expected patch on the rail's surface, about the first touch point (mm).

    The nodes lie at x = -half_length..half_length in steps of `step_x_mm` and at the arc lengths s from `s_low_mm` to
    `s_high_mm` in steps of `step_s_mm`, both in an even number of steps. `semi_axis_mm` is the semi-axis across of the
    narrowest part of the patch.

    Patches far apart have `bands` of their own; the first begins at `s_low_mm` and the last ends at `s_high_mm`. Then
    `step_s_mm` is the finest step, and on the strips between bands the steps grow as they do around the zone.
    """

    half_length_mm: float
    s_low_mm: float
    s_high_mm: float
    step_x_mm: float
    step_s_mm: float
    semi_axis_mm: float
    bands: tuple[Stretch, ...] = ()

    @property
    def steps_s_mm(self) -> tuple[float, ...]:
        """Step of the nodes across of each stretch."""
        return tuple(band.step_mm for band in self.bands) or (self.step_s_mm,)

    @property
    def block_widths_mm(self) -> tuple[float, ...]:
        """Width that decides about the depth of the uniform block, below each stretch."""
        steps = _PART_STEPS_IN_BANDS if self.bands else _PART_STEPS
        wide, long = self.s_high_mm - self.s_low_mm, 2.0 * self.half_length_mm
        most = min(wide, long if self.bands else max(long, _OF_WIDE * wide))
        return tuple(min(most, max(steps * step, _PART_SEMI_AXES * self.semi_axis_mm)) for step in self.steps_s_mm)

    @property
    def layer_ratio(self) -> float:
        """How the layers of the block grow downwards in steel that does not yield."""
        return _LAYER_RATIO_IN_BANDS if self.bands else LAYER_RATIO

    @property
    def intervals_x(self) -> int:
        """Steps along x from the middle to one end."""
        return max(2, round(self.half_length_mm / self.step_x_mm))

    @property
    def intervals_s(self) -> int:
        """Steps across, always even."""
        return self.s_mm.size - 1

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """The bands, or the whole zone as one stretch if there are no bands."""
        intervals = max(4, 2 * round(0.5 * (self.s_high_mm - self.s_low_mm) / self.step_s_mm))
        return self.bands or (Stretch(low_mm=self.s_low_mm, high_mm=self.s_high_mm, intervals=intervals),)

    @property
    def s_mm(self) -> Floats:
        """Arc lengths of the nodes across, also on the strips between bands."""
        return lines_of(self.stretches)

    @property
    def columns(self) -> tuple[slice, ...]:
        """Nodes across that belong to each stretch."""
        s = self.s_mm
        starts = [int(np.argmin(np.abs(s - stretch.low_mm))) for stretch in self.stretches]
        return tuple(
            slice(start, start + stretch.intervals + 1) for start, stretch in zip(starts, self.stretches, strict=True)
        )


# Memory a node while the mesh is made and the stiffness assembled (8 to 12 kB measured, with small factors).
_BYTES_A_NODE = 8e3


def least_memory_bytes(zone: FineZone) -> float:
    """A lower bound of the memory that both bodies need, from the nodes of the uniform blocks under the zone."""
    layers = _OF_WIDTH * min(zone.block_widths_mm) / min(zone.step_x_mm, zone.step_s_mm)
    ratio = zone.layer_ratio
    nodes = zone.intervals_x * zone.intervals_s * max(2.0, np.log1p((ratio - 1.0) * layers) / np.log(ratio))
    return float(2.0 * nodes * _BYTES_A_NODE)


# --- Hexahedral meshes of the two bodies: cross-sections swept in graded layers, along the rail and around the axle.

_SWEEP_RATIO = 2.2
# Longest element of the sweep, as a part of the sweep's length to one side.
_LONGEST_OF_SWEEP = 0.3
# Points of an outline closer than this are one point: published coordinates are rounded to micrometres.
_SAME_POINT_MM = 1e-3
# Largest distance of a surface node from the profile: on a steep line heights are a hundred times less exact than
# places.
_ON_PROFILE_MM = 1e-6
# Spacing of the profile's places among which the nearest to a node is looked up.
_LOOKED_AT_MM = 0.02
# Depth of the layers of a section over the width above them, and over the least radius of a convex line.
_OF_WIDTH, _OF_RADIUS = 0.45, 0.35
# Places of a section's zone where its curvature is looked at, and how steeply the depth of the layers may change.
_DEPTH_PLACES, _STEEPEST = 200, 0.5
# Newton steps from this place to the foot of the normal through the node: each step squares the error.
_STEPS_ALONG = 3
# Layers below and beside the zone may be so far apart, as a part of the distance from the zone. At 0.2 peak, area and
# half-widths are within 4e-5 of a mesh with all layers, the approach is within 1e-4, and the compliance reads the same
# within 0.05 % (S1002 on 60E1, 3, -3, 5 and 6.3 mm at `quick`); `fine` has its peak within 7e-5. At 0.3 the compliance
# moves by 0.4 %, at 0.4 by 1.6 %. In the root of the flange this saves a quarter of the unknowns and of the time.
_FAR = 0.2
# Nearer than this part of the zone's half length all layers stay, or meshes that are ever finer would not converge.
_NEAR = 0.75
# The surface by which each body is held.
_BASE = {"rail": "fixed", "wheel": "driven"}
# The wheel's uniform zone reaches this many steps further than the rail's, so that it covers the rail's zone.
_COVER_STEPS = 2


def rail_mesh(
    placement: Placement, zone: FineZone, *, half: bool, size: BodySize, layer_ratio: float | None = None
) -> BodyMesh:
    """Extrude the rail's head along x.

    Raises
    ------
    InputError
        If the cut plane does not leave room for the uniform zone.
    """
    size = size.at_radius(placement.wheel.rolling_radius_mm)
    # a patch that is too long is refused before the section is meshed
    x, zone_layers = _sweep_positions(zone, size.half_length_mm, half, 0, "the rail's half length")
    pose = placement.rail
    middle = placement.first_arc_length_mm
    closure = _rail_closure(pose.profile, size.rail_depth_mm)
    section = mesh_section(
        pose.profile,
        closure,
        _held_edge(closure),
        _section_zone(
            pose.profile,
            zone,
            [(middle + part.low_mm, middle + part.high_mm, part.intervals) for part in zone.stretches],
        ),
        layer_ratio or zone.layer_ratio,
    )
    c, s = np.cos(pose.inclination_rad), np.sin(pose.inclination_rad)
    y = pose.crown_y_mm + section.points @ np.array([c, -s])
    z = pose.crown_z_mm + section.points @ np.array([s, c])
    count = len(y)
    points = np.column_stack([np.repeat(x + placement.first.x_mm, count), np.tile(y, x.size), np.tile(z, x.size)])
    volume = section.outline_area_mm2 * float(x[-1] - x[0])
    return _swept("rail", section, points, x, zone_layers, half=half, volume=volume)


def wheel_mesh(
    placement: Placement, zone: FineZone, *, half: bool, size: BodySize, layer_ratio: float | None = None
) -> BodyMesh:
    """Revolve the wheel's rim about the axle.

    Raises
    ------
    InputError
        If the cut planes do not leave room for the uniform zone.
    """
    pose, touch = placement.wheel, placement.first
    size = size.at_radius(pose.rolling_radius_mm)
    x, zone_layers = _sweep_positions(zone, size.half_length_mm, half, _COVER_STEPS, "the rim's half length")
    y_low, y_high = pose.profile.y_range_mm
    z_inner = size.rim_thickness_mm
    section = mesh_section(
        pose.profile,
        np.array([[y_high, z_inner], [y_low, z_inner]]),
        (0, 1),
        _section_zone(pose.profile, zone, _facing(placement, zone)),
        layer_ratio or zone.layer_ratio,
    )
    rolling = float(pose.radius(touch.wheel_u))
    theta_0 = float(pose.silhouette(touch.wheel_u)[0]) + np.arcsin(placement.ahead_mm / rolling)
    theta = theta_0 + x / rolling
    radius = pose.rolling_radius_mm - section.points[:, 1]
    points = pose.point(section.points[None, :, 0], radius[None, :], theta[:, None]).reshape(-1, 3)
    # Pappus, for planes joined by straight lines: sin of the step instead of the step
    moment = _radius_moment(section, pose.rolling_radius_mm)
    volume = moment * float(np.sum(np.sin(np.diff(theta))))
    return _swept("wheel", section, points, x, zone_layers, half=half, volume=volume)


def check_on_profiles(placement: Placement, rail: BodyMesh, wheel: BodyMesh) -> None:
    """Check that both contact surfaces lie on the placed profiles; else the gap would be wrong."""
    on_rail, on_wheel = (mesh.points[mesh.contact_nodes.ravel()] for mesh in (rail, wheel))
    pose = placement.rail
    cosine, sine = np.cos(pose.inclination_rad), np.sin(pose.inclination_rad)
    from_crown = on_rail[:, 1:] - [pose.crown_y_mm, pose.crown_z_mm]
    around = placement.wheel
    from_axle = (on_wheel - around.centre_mm) @ around.axes
    radius = np.hypot(from_axle[:, 0], from_axle[:, 2])
    for profile, y, z in (
        (pose.profile, from_crown @ [cosine, sine], from_crown @ [-sine, cosine]),
        (around.profile, from_axle[:, 1] - around.tape_circle_y_mm, around.rolling_radius_mm - radius),
    ):
        # the nearest place of the line, not the place at the same y: a tongue has several places at one y
        places = np.arange(0.0, profile.length_mm, _LOOKED_AT_MM)
        line = profile.evaluate(profile.at_arc_length(places))
        s = places[cKDTree(np.stack([line.y, line.z], axis=-1)).query(np.stack([y, z], axis=-1))[1]]
        for _ in range(_STEPS_ALONG):
            foot = profile.evaluate(profile.at_arc_length(np.clip(s, 0.0, profile.length_mm)))
            along, up = np.cos(foot.angle_rad), np.sin(foot.angle_rad)
            across = (z - foot.z) * along - (y - foot.y) * up
            s = s + (y - foot.y) * along + (z - foot.z) * up
        off = float(np.abs(across).max())
        assert off < _ON_PROFILE_MM, f"{profile.kind} {profile.name}: its mesh is {off:.2g} mm beside its surface"


def _facing(placement: Placement, zone: FineZone) -> list[tuple[float, float, int]]:
    """First and last arc length on the wheel's profile, and number of steps, opposite each part of the rail's zone.

    At both ends of the zone they reach _COVER_STEPS further.
    """
    facing, parts = [], zone.stretches
    for number, part in enumerate(parts):
        low, high = _wheel_arc_lengths(placement, zone, part)
        before, after = (_COVER_STEPS if number == end else 0 for end in (0, len(parts) - 1))
        step = part.step_mm if zone.bands else zone.step_s_mm
        facing.append((low - before * step, high + after * step, part.intervals + before + after))
    return facing


def _wheel_arc_lengths(placement: Placement, zone: FineZone, part: Stretch) -> tuple[float, float]:
    """Arc lengths on the wheel's profile opposite the ends of a part of the rail's zone, along the rail's normals."""
    pose = placement.wheel
    middle = float(pose.profile.arc_length(placement.first.wheel_u))
    ends = np.array([part.low_mm, part.high_mm])
    # on a steep flange the facing wheel's line shifts across the rail's zone towards the zone's ends in x
    x = np.array([-zone.half_length_mm, 0.0, zone.half_length_mm])
    points, normals = placement.surface(x[:, None], ends[None, :])
    facing = points + pose.distance_along(points, normals)[..., None] * normals
    y = ((facing - pose.centre_mm) @ pose.axes)[..., 1] - pose.tape_circle_y_mm
    arcs = pose.profile.arc_length(np.nan_to_num(pose.profile.locate(y)))
    # if a normal misses the wheel's profile, an equal arc length on both surfaces is the best guess
    arcs = np.where(np.isfinite(y), arcs, middle + ends)
    low, high = float(arcs.min()), float(arcs.max())
    # several bands leave no room beside each of them
    return (low, high) if zone.bands else (min(low, middle + part.low_mm), max(high, middle + part.high_mm))


def _section_zone(profile: Profile, zone: FineZone, parts: list[tuple[float, float, int]]) -> Zone:
    """Zone of a body's section from the first and last arc length and number of steps of each of its parts."""
    stretches = tuple(Stretch(low_mm=low, high_mm=high, intervals=intervals) for low, high, intervals in parts)
    if any(before.high_mm >= after.low_mm for before, after in pairwise(stretches)):
        raise FoldedMesh(f"{profile.kind} {profile.name}: two bands of the contact zone meet on its surface")
    low, high = stretches[0].low_mm, stretches[-1].high_mm
    if low <= 0.0 or high >= profile.length_mm:
        raise NotCovered(
            f"{profile.kind} {profile.name}: the contact zone from {low:.2f} to {high:.2f} mm along the profile leaves"
            f" its running surface (0 to {profile.length_mm:.2f} mm); give a longer line or another lateral position"
        )
    columns = lines_of(stretches)
    places = np.union1d(columns, np.linspace(low, high, _DEPTH_PLACES))
    p = profile.evaluate(profile.at_arc_length(places))
    # the layers follow the normals, and must end before the normals of a convex line meet
    convex = profile.convex_sign * p.curvature_per_mm
    allowed = np.divide(_OF_RADIUS, convex, out=np.full(places.size, np.inf), where=convex > 0.0)
    below = [(places >= one.low_mm) & (places <= one.high_mm) for one in stretches]
    widths = [min(one.high_mm - one.low_mm, wide) for one, wide in zip(stretches, zone.block_widths_mm, strict=True)]
    # a single block has two layers that are no thinner than others; thin ones cost nothing where others are deep
    firsts = [0.8 * min(zone.step_x_mm, step) for step in zone.steps_s_mm]
    least = 0.0 if zone.bands else 2.0 * firsts[0]
    depths = [
        max(least, min(_OF_WIDTH * wide, float(allowed[own].min()))) for own, wide in zip(below, widths, strict=True)
    ]
    allowed = np.minimum(allowed, max(depths))
    for own, depth in zip(below, depths, strict=True):
        allowed[own] = depth
    return Zone(
        stretches=stretches,
        depth_step_mm=firsts[int(np.argmax(depths))],
        # what lies between two stretches leads from one depth to the other
        depth_mm=np.asarray(np.min(allowed + _STEEPEST * np.abs(columns[:, None] - places), axis=1)),
    )


def _rail_closure(profile: Profile, depth: float) -> Floats:
    """Polyline around the body, from the field-side end of the running surface to its gauge-side end."""
    start, end = (
        [float(p.y), float(p.z)] for p in (profile.evaluate(float(len(profile.segments))), profile.evaluate(0.0))
    )
    if -depth >= min(start[1], end[1]) - 1.0:
        raise InputError(
            f"rail depth {depth:g} mm: the running line of {profile.name} reaches down to {-min(start[1], end[1]):.1f}"
            " mm; cut the rail at least 1 mm below that"
        )
    if not profile.outline:
        return np.array([[start[0], -depth], [end[0], -depth]])
    # the outline begins with the running surface and continues around the foot to the gauge-side end
    line = np.vstack([_segment_points(segment) for segment in profile.outline[len(profile.segments) :]])
    line = line[np.append(True, np.hypot(*np.diff(line, axis=0).T) > _SAME_POINT_MM)][1:-1]
    if depth >= -line[:, 1].min():
        raise InputError(f"rail depth {depth:g} mm: {profile.name} is only {-line[:, 1].min():.1f} mm high")
    below = np.flatnonzero(line[:, 1] <= -depth)
    first, last = int(below[0]), int(below[-1])
    right = _cut(line[first - 1] if first > 0 else np.array(start), line[first], depth)
    left = _cut(line[last + 1] if last < len(line) - 1 else np.array(end), line[last], depth)
    return np.vstack([line[:first], [right, left], line[last + 1 :]])


def _segment_points(segment: Segment) -> Floats:
    p = segment.evaluate(np.linspace(0.0, 1.0, 2 if isinstance(segment, Line) else 40))
    return np.column_stack([p.y, p.z])


def _cut(above: Floats, below: Floats, depth: float) -> Floats:
    """Point at a depth on the line between two points."""
    t = (-depth - above[1]) / (below[1] - above[1])
    return np.asarray(above + t * (below - above))


def _held_edge(closure: Floats) -> tuple[int, int]:
    lowest = closure[:, 1].min()
    on_base = np.flatnonzero(closure[:, 1] < lowest + 1e-9)
    return int(on_base[0]), int(on_base[-1])


def too_short(what: str, half_length_mm: float, zone_mm: str) -> InputError:
    """The error of bodies that are too short for the contact."""
    return InputError(
        f"{what} of {half_length_mm:g} mm must reach at least two elements past the contact zone ({zone_mm} mm):"
        " give a larger half_length_mm, or a smaller load or stiffer steel if that is a mistake"
    )


def _sweep_positions(zone: FineZone, end: float, half: bool, cover: int, what: str) -> tuple[Floats, slice]:
    """Positions along the sweep and which of them belong to the uniform zone."""
    intervals = zone.intervals_x + cover
    step = zone.half_length_mm / zone.intervals_x
    start = intervals * step
    if end < start + 2.0 * step:
        raise too_short(what, end, f"{start:.2f}")
    count = int(np.ceil(np.log1p((_SWEEP_RATIO - 1.0) * (end - start) / step) / np.log(_SWEEP_RATIO)))
    steps = np.minimum(step * _SWEEP_RATIO ** np.arange(1, count + 8), _LONGEST_OF_SWEEP * end)
    tail = np.cumsum(steps)
    tail = tail[: np.searchsorted(tail, end - start) + 1]
    tail *= (end - start) / tail[-1]
    right = np.concatenate([np.arange(intervals + 1) * step, start + tail])
    if half:
        return right, slice(0, intervals + 1)
    return np.concatenate([-right[:0:-1], right]), slice(tail.size, tail.size + 2 * intervals + 1)


def _radius_moment(section: Section, rolling_radius: float) -> float:
    """First moment of the section about the axle."""
    p = section.points[section.quads]
    total = 0.0
    for a, b, c in ((0, 1, 2), (0, 2, 3)):
        d1, d2 = p[:, b] - p[:, a], p[:, c] - p[:, a]
        area = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
        total += float(np.sum(area * (rolling_radius - (p[:, a, 1] + p[:, b, 1] + p[:, c, 1]) / 3.0)))
    return total


def _swept(
    name: Literal["rail", "wheel"],
    section: Section,
    points: Floats,
    x: Floats,
    zone_layers: slice,
    *,
    half: bool,
    volume: float,
) -> BodyMesh:
    count = len(section.points)
    layers = len(points) // count
    lift = (np.arange(layers - 1) * count)[:, None, None]
    hexes = (np.concatenate([section.quads, section.quads + count], axis=1)[None] + lift).reshape(-1, 8)

    def swept_edges(edges: Integers, layer_slice: slice) -> Integers:
        quads = np.column_stack([edges[:, 0], edges[:, 1], edges[:, 1] + count, edges[:, 0] + count])
        if name == "rail":
            # the rail's section is seen against the direction of the sweep
            quads = quads[:, ::-1]
        return np.asarray((quads[None] + lift[layer_slice]).reshape(-1, 4))

    zone_cells = slice(zone_layers.start, zone_layers.stop - 1)
    every = slice(None)
    rest = np.setdiff1d(np.arange(layers - 1), np.arange(layers - 1)[zone_cells])
    beyond = np.vstack([swept_edges(section.edges["contact"], slice(k, k + 1)) for k in rest])
    first, last = section.quads[:, ::-1], section.quads + (layers - 1) * count
    surfaces = {
        "contact": swept_edges(section.edges["contact"], zone_cells),
        _BASE[name]: swept_edges(section.edges["base"], every),
        "free": np.vstack([swept_edges(section.edges["free"], every), beyond]),
        "end": last if half else np.vstack([first, last]),
    }
    if half:
        surfaces["symmetry"] = first
    blocks = section.block_nodes.T[None] + (np.arange(layers)[zone_layers] * count)[:, None, None]
    mesh = BodyMesh(
        name=name,
        points=points,
        hexes=hexes,
        surfaces=surfaces,
        contact_nodes=blocks[..., 0],
        block_nodes=blocks,
        half=half,
        volume_mm3=volume,
        opposite=None if half else np.arange(len(points)).reshape(layers, count)[::-1].ravel(),
        spacing=_spacing(section, x, zone_layers, half=half),
    )
    check_mesh(mesh)
    return mesh


def _spacing(section: Section, x: Floats, zone_layers: slice, *, half: bool) -> Spacing:
    """Where the layers of the zone are further apart than the mesh has them.

    Nodes of the section at 2^n / _FAR steps from the zone's line have unknowns on each 2^n-th layer from the middle.
    """
    count, layers = len(section.points), np.arange(x.size)
    first, last = zone_layers.start, zone_layers.stop - 1
    middle = first if half else (first + last) // 2
    from_middle, reach = np.abs(layers - middle), last - middle
    away, _ = cKDTree(section.points[section.block_nodes[0]]).query(section.points)
    half_length = x[last] - x[middle]
    steps = np.where(away < _NEAR * half_length, 1.0, _FAR * away * reach / half_length)
    doubled = np.log2(np.maximum(steps, 1.0)).astype(int)
    # elements have the layers of their corner that has most of them
    of_quads = doubled[section.quads].min(axis=1)
    hexes, between, ends, parts = [], [], [], []
    for times in range(int(doubled.max()) + 1):
        own = np.flatnonzero((from_middle % 2**times == 0) | (from_middle >= reach))
        quads, nodes = section.quads[of_quads == times], np.flatnonzero(doubled == times)
        hexes += [np.concatenate([quads + a * count, quads + b * count], axis=1) for a, b in pairwise(own)]
        rest = np.setdiff1d(layers, own)
        number = np.searchsorted(own, rest)
        low, high = own[number - 1], own[number]
        part = np.repeat((x[rest] - x[low]) / (x[high] - x[low]), nodes.size)
        between.append((nodes + rest[:, None] * count).ravel())
        ends.append(np.stack([(nodes + end[:, None] * count).ravel() for end in (low, high)], axis=1))
        parts.append(np.stack([1.0 - part, part], axis=1))
    return Spacing(
        hexes=np.concatenate(hexes),
        between=np.concatenate(between),
        ends=np.concatenate(ends),
        parts=np.concatenate(parts),
    )
