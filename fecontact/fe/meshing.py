"""Hexahedral meshes of the two bodies.

Cross-sections are swept in graded layers, along the rail and around the axle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from fecontact.arrays import Floats, Integers
from fecontact.bodies import BodySize
from fecontact.errors import CoverageError, FoldedMeshError, InputError
from fecontact.fe.body_mesh import BodyMesh, ConstrainedNodes, check_mesh
from fecontact.fe.section import LAYER_RATIO, Section, Stretch, Zone, mesh_section, place_nodes
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import Segment, StraightSegment

# --- The zone of equal elements around the expected patch, on which both meshes meet.

# Largest width, in steps and in semi-axes, that decides on the depth of the block. A wider block holds several patches
# and need be only as deep as for a single patch. This saves a quarter to two fifths of the cost of a two-lobed contact,
# and moves its peak pressure by 2e-4 to 5e-4 at `quick`. The depth also follows the semi-axis, or finer meshes would
# not converge to the same bodies. With 20 steps two lobes take a tenth less time, but healthy elements of a gauge
# corner then read -2.3 % too soft, beyond their limit, instead of -1.3 %.
_BLOCK_WIDTH_STEPS = 25
_BLOCK_WIDTH_SEMI_AXES = 3.0
# If a zone is shorter than this fraction of its width, the block below is as deep as for this length. On flat bodies
# and patches 0.32 times as long as wide healthy elements read -1.7 and -0.7 %. With the length of the zone itself they
# read -3.5 and -2.3 %.
_MIN_LENGTH_PER_WIDTH = 0.5
# Width in steps and ratio of the layers if distant patches have a band each: four layers that grow by 1.6 instead of
# eight that grow by 1.3, for half of the time. On a worn pair under 60 kN, with 8 and 67 mm of least radius below its
# patches, the peak, the half-widths and the load on separate patches differ by at most 0.08 % from those with eight
# layers, where both meshes of a case differ by up to 0.3 %, and the compliance has an error of 0.1 %. With layers that
# all end where the tightest profile allows, the error is -2.5 %.
_BLOCK_WIDTH_STEPS_IN_BANDS = 15
_LAYER_RATIO_IN_BANDS = 1.6


@dataclass(frozen=True, kw_only=True)
class FineZone:
    """Uniform zone around the expected patch on the rail's surface.

    The origin is the first contact point. Nodes lie at x = -half_length..half_length and at the arc lengths s from
    `s_low_mm` to `s_high_mm`, both in an even number of steps.

    Attributes
    ----------
    half_length_mm
        Half length of the zone along x.
    s_low_mm, s_high_mm
        Arc lengths of both ends of the zone on the rail's profile.
    step_x_mm
        Step of the nodes along x.
    step_s_mm
        Step of the nodes across. With `bands` it is the finest step.
    semi_axis_mm
        Semi-axis across of the narrowest lobe of the patch.
    bands
        A stretch for each of several distant patches, else empty. The first band begins at `s_low_mm` and the last band
        ends at `s_high_mm`. On the strips between bands the steps grow as they do around the zone.
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
        """Step of the nodes across, in mm, for each stretch."""
        return tuple(band.step_mm for band in self.bands) or (self.step_s_mm,)

    @property
    def block_widths_mm(self) -> tuple[float, ...]:
        """Width in mm below each stretch, which decides on the depth of the uniform block."""
        steps = _BLOCK_WIDTH_STEPS_IN_BANDS if self.bands else _BLOCK_WIDTH_STEPS
        width, length = self.s_high_mm - self.s_low_mm, 2.0 * self.half_length_mm
        max_width = min(width, length if self.bands else max(length, _MIN_LENGTH_PER_WIDTH * width))
        return tuple(
            min(max_width, max(steps * step, _BLOCK_WIDTH_SEMI_AXES * self.semi_axis_mm)) for step in self.steps_s_mm
        )

    @property
    def layer_ratio(self) -> float:
        """Ratio of the thicknesses of the block's layers, growing downwards.

        It holds for steel that does not yield.
        """
        return _LAYER_RATIO_IN_BANDS if self.bands else LAYER_RATIO

    @property
    def intervals_x(self) -> int:
        """Number of steps along x from the middle to an end."""
        return max(2, round(self.half_length_mm / self.step_x_mm))

    @property
    def intervals_s(self) -> int:
        """Number of steps across, always even."""
        return self.s_mm.size - 1

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """The bands, or the whole zone as a single stretch if there are no bands."""
        intervals = max(4, 2 * round(0.5 * (self.s_high_mm - self.s_low_mm) / self.step_s_mm))
        return self.bands or (Stretch(low_mm=self.s_low_mm, high_mm=self.s_high_mm, intervals=intervals),)

    @property
    def s_mm(self) -> Floats:
        """Arc lengths in mm of the nodes across, including the strips between bands."""
        return place_nodes(self.stretches)

    @property
    def columns(self) -> tuple[slice, ...]:
        """Indices of the nodes across in each stretch."""
        nodes = self.s_mm
        starts = [int(np.argmin(np.abs(nodes - stretch.low_mm))) for stretch in self.stretches]
        return tuple(
            slice(start, start + stretch.intervals + 1) for start, stretch in zip(starts, self.stretches, strict=True)
        )


# Memory per node while the mesh is made and the stiffness assembled (8 to 12 kB measured, with small factors).
_BYTES_PER_NODE = 8e3


def estimate_least_memory_bytes(zone: FineZone) -> float:
    """A lower bound of the memory that both bodies need, in bytes.

    It counts the nodes of the uniform blocks under the zone.

    Parameters
    ----------
    zone
        Uniform zone on the rail's surface.

    Returns
    -------
    memory
        Bytes of both bodies.
    """
    layers = _DEPTH_PER_WIDTH * min(zone.block_widths_mm) / min(zone.step_x_mm, zone.step_s_mm)
    ratio = zone.layer_ratio
    nodes = zone.intervals_x * zone.intervals_s * max(2.0, np.log1p((ratio - 1.0) * layers) / np.log(ratio))
    return float(2.0 * nodes * _BYTES_PER_NODE)


# --- Hexahedral meshes of the two bodies: cross-sections swept in graded layers, along the rail and around the axle.

_SWEEP_RATIO = 2.2
# Longest element of the sweep, as a fraction of the sweep's length to each side.
_MAX_ELEMENT_PER_SWEEP = 0.3
# Points of an outline closer than this count as a single point: published coordinates are rounded to micrometres.
_SAME_POINT_MM = 1e-3
# Largest distance of a surface node from the profile. On a steep profile heights are a hundred times less exact than
# places.
_MAX_OFF_PROFILE_MM = 1e-6
# Spacing of the places on the profile among which the place nearest to a node is looked up.
_LOOKUP_STEP_MM = 0.02
# Largest depth of a section's layers, relative to the width above them and to the least radius of a convex profile.
_DEPTH_PER_WIDTH, _DEPTH_PER_RADIUS = 0.45, 0.35
# Number of places of a section's zone at which its curvature is evaluated, and largest slope of the depth of the
# layers.
_DEPTH_PLACES, _MAX_DEPTH_SLOPE = 200, 0.5
# Number of Newton steps from the nearest place to the foot of the normal through the node. Each step squares the error.
_FOOT_STEPS = 3
# Largest distance between layers below and next to the zone, as a fraction of the distance from the zone. At 0.2 peak,
# area and half-widths are within 4e-5 of a mesh with all layers, the approach is within 1e-4, and the compliance reads
# the same within 0.05 % (S1002 on 60E1, 3, -3, 5 and 6.3 mm at `quick`); `fine` has its peak within 7e-5. At 0.3 the
# compliance moves by 0.4 %, at 0.4 by 1.6 %. In the root of the flange this saves a quarter of the unknowns and of the
# time.
_LAYER_DISTANCE_RATIO = 0.2
# All layers stay up to this distance, as a fraction of the zone's half length, or ever finer meshes would not converge.
_ALL_LAYERS_RATIO = 0.75
# The surface with the support of each body.
_SUPPORT_SURFACES = {"rail": "fixed", "wheel": "driven"}
# Steps by which the wheel's uniform zone extends beyond the rail's zone, so that it covers the rail's zone.
_COVER_STEPS = 2


def rail_mesh(
    placement: Placement, zone: FineZone, *, half: bool, size: BodySize, layer_ratio: float | None = None
) -> BodyMesh:
    """Extrude the rail's head along x.

    Parameters
    ----------
    placement
        The wheel on the rail.
    zone
        Uniform zone on the rail's surface.
    half
        Whether only x >= 0 is meshed.
    size
        Sizes of the bodies.
    layer_ratio
        Ratio of the thicknesses of the block's layers; None for the ratio of the zone.

    Returns
    -------
    BodyMesh
        Checked mesh of the rail in the track frame (mm).

    Raises
    ------
    InputError
        If the cut plane does not leave room for the uniform zone.
    """
    size = size.at_radius(placement.wheel.rolling_radius_mm)
    # A patch that is too long is refused before the section is meshed.
    x, zone_layers = _sweep_positions(zone, size.half_length_mm, half, 0, "the rail's half length")
    pose = placement.rail
    middle = placement.first_arc_length_mm
    closure = _rail_closure(pose.profile, size.rail_depth_mm)
    section = mesh_section(
        pose.profile,
        closure,
        _base_edge(closure),
        _section_zone(
            pose.profile,
            zone,
            [(middle + stretch.low_mm, middle + stretch.high_mm, stretch.intervals) for stretch in zone.stretches],
        ),
        layer_ratio or zone.layer_ratio,
    )
    c, s = np.cos(pose.inclination_rad), np.sin(pose.inclination_rad)
    y = pose.crown_y_mm + section.points @ np.array([c, -s])
    z = pose.crown_z_mm + section.points @ np.array([s, c])
    count = len(y)
    points = np.column_stack([np.repeat(x + placement.first.x_mm, count), np.tile(y, x.size), np.tile(z, x.size)])
    volume = section.outline_area_mm2 * float(x[-1] - x[0])
    return _sweep("rail", section, points, x, zone_layers, half=half, volume=volume)


def wheel_mesh(
    placement: Placement, zone: FineZone, *, half: bool, size: BodySize, layer_ratio: float | None = None
) -> BodyMesh:
    """Revolve the wheel's rim about the axle.

    Parameters
    ----------
    placement
        The wheel on the rail.
    zone
        Uniform zone on the rail's surface.
    half
        Whether only x >= 0 is meshed.
    size
        Sizes of the bodies.
    layer_ratio
        Ratio of the thicknesses of the block's layers; None for the ratio of the zone.

    Returns
    -------
    BodyMesh
        Checked mesh of the wheel in the track frame (mm).

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
        _section_zone(pose.profile, zone, _wheel_intervals(placement, zone)),
        layer_ratio or zone.layer_ratio,
    )
    rolling = float(pose.radius(touch.wheel_u))
    theta_0 = float(pose.silhouette(touch.wheel_u)[0]) + np.arcsin(placement.ahead_mm / rolling)
    theta = theta_0 + x / rolling
    radius = pose.rolling_radius_mm - section.points[:, 1]
    points = pose.point(section.points[None, :, 0], radius[None, :], theta[:, None]).reshape(-1, 3)
    # Pappus, for planes joined by straight lines: the sine of the step replaces the step.
    moment = _radius_moment(section, pose.rolling_radius_mm)
    volume = moment * float(np.sum(np.sin(np.diff(theta))))
    return _sweep("wheel", section, points, x, zone_layers, half=half, volume=volume)


def check_on_profiles(placement: Placement, rail: BodyMesh, wheel: BodyMesh) -> None:
    """Check that both contact surfaces lie on the placed profiles; else the gap would be wrong.

    Parameters
    ----------
    placement
        The wheel on the rail.
    rail, wheel
        Meshes of both bodies.

    Raises
    ------
    AssertionError
        If a surface node is farther than 1e-6 mm from its profile.
    """
    rail_points, wheel_points = (mesh.points[mesh.contact_nodes.ravel()] for mesh in (rail, wheel))
    pose = placement.rail
    cosine, sine = np.cos(pose.inclination_rad), np.sin(pose.inclination_rad)
    from_crown = rail_points[:, 1:] - [pose.crown_y_mm, pose.crown_z_mm]
    wheel_pose = placement.wheel
    from_axle = (wheel_points - wheel_pose.centre_mm) @ wheel_pose.axes
    radius = np.hypot(from_axle[:, 0], from_axle[:, 2])
    for profile, y, z in (
        (pose.profile, from_crown @ [cosine, sine], from_crown @ [-sine, cosine]),
        (wheel_pose.profile, from_axle[:, 1] - wheel_pose.tape_circle_y_mm, wheel_pose.rolling_radius_mm - radius),
    ):
        # The nearest place of the profile, not the place at equal y: a tongue rail has several places at each y.
        places = np.arange(0.0, profile.length_mm, _LOOKUP_STEP_MM)
        line = profile.evaluate(profile.at_arc_length(places))
        s = places[cKDTree(np.stack([line.y, line.z], axis=-1)).query(np.stack([y, z], axis=-1))[1]]
        for _ in range(_FOOT_STEPS):
            foot = profile.evaluate(profile.at_arc_length(np.clip(s, 0.0, profile.length_mm)))
            along, up = np.cos(foot.angle_rad), np.sin(foot.angle_rad)
            across = (z - foot.z) * along - (y - foot.y) * up
            s = s + (y - foot.y) * along + (z - foot.z) * up
        distance = float(np.abs(across).max())
        assert distance < _MAX_OFF_PROFILE_MM, (
            f"{profile.kind} {profile.name}: the mesh is {distance:.2g} mm away from the surface"
        )


def _wheel_intervals(placement: Placement, zone: FineZone) -> list[tuple[float, float, int]]:
    """Intervals on the wheel's profile opposite each stretch of the rail's zone.

    An interval is its first and last arc length in mm and its number of steps.

    At both ends of the zone they extend _COVER_STEPS beyond the rail's zone.
    """
    intervals, stretches = [], zone.stretches
    for number, stretch in enumerate(stretches):
        low, high = _wheel_arc_lengths(placement, zone, stretch)
        before, after = (_COVER_STEPS if number == end else 0 for end in (0, len(stretches) - 1))
        step = stretch.step_mm if zone.bands else zone.step_s_mm
        intervals.append((low - before * step, high + after * step, stretch.intervals + before + after))
    return intervals


def _wheel_arc_lengths(placement: Placement, zone: FineZone, stretch: Stretch) -> tuple[float, float]:
    """Lowest and highest arc length (mm) on the wheel's profile opposite a stretch of the rail's zone.

    The opposite points lie along the rail's normals, at the middle and at both ends of the zone. A zone without bands
    gives at least the arc lengths of the stretch.
    """
    pose = placement.wheel
    middle = float(pose.profile.arc_length(placement.first.wheel_u))
    ends = np.array([stretch.low_mm, stretch.high_mm])
    # On a steep flange the opposite profile of the wheel shifts across the rail's zone towards the zone's ends in x.
    x = np.array([-zone.half_length_mm, 0.0, zone.half_length_mm])
    points, normals = placement.surface(x[:, None], ends[None, :])
    opposite = points + pose.distance_along(points, normals)[..., None] * normals
    y = ((opposite - pose.centre_mm) @ pose.axes)[..., 1] - pose.tape_circle_y_mm
    arcs = pose.profile.arc_length(np.nan_to_num(pose.profile.locate(y)))
    # If a normal misses the wheel's profile, an equal arc length on both surfaces is the best guess.
    arcs = np.where(np.isfinite(y), arcs, middle + ends)
    low, high = float(arcs.min()), float(arcs.max())
    # Several bands leave no room next to each of them.
    return (low, high) if zone.bands else (min(low, middle + stretch.low_mm), max(high, middle + stretch.high_mm))


def _section_zone(profile: Profile, zone: FineZone, ranges: list[tuple[float, float, int]]) -> Zone:
    """Zone of a body's section from the ranges of its stretches.

    A range is the first and last arc length in mm and the number of steps of a stretch.
    """
    stretches = tuple(Stretch(low_mm=low, high_mm=high, intervals=intervals) for low, high, intervals in ranges)
    if any(before.high_mm >= after.low_mm for before, after in pairwise(stretches)):
        raise FoldedMeshError(f"{profile.kind} {profile.name}: two bands of the contact zone overlap on the surface")
    low, high = stretches[0].low_mm, stretches[-1].high_mm
    if low <= 0.0 or high >= profile.length_mm:
        raise CoverageError(
            f"{profile.kind} {profile.name}: the contact zone from {low:.2f} to {high:.2f} mm along the profile extends"
            f" beyond the running surface (0 to {profile.length_mm:.2f} mm); give a longer profile or a different shift"
        )
    columns = place_nodes(stretches)
    places = np.union1d(columns, np.linspace(low, high, _DEPTH_PLACES))
    p = profile.evaluate(profile.at_arc_length(places))
    # The layers follow the normals, and must end before the normals of a convex profile meet.
    convex = profile.convex_sign * p.curvature_per_mm
    max_depths = np.divide(_DEPTH_PER_RADIUS, convex, out=np.full(places.size, np.inf), where=convex > 0.0)
    stretch_masks = [(places >= stretch.low_mm) & (places <= stretch.high_mm) for stretch in stretches]
    widths = [
        min(stretch.high_mm - stretch.low_mm, width)
        for stretch, width in zip(stretches, zone.block_widths_mm, strict=True)
    ]
    # A single block has at least two layers of the first thickness. Thin layers cost nothing where other layers are
    # deep.
    first_layers = [0.8 * min(zone.step_x_mm, step) for step in zone.steps_s_mm]
    min_depth = 0.0 if zone.bands else 2.0 * first_layers[0]
    depths = [
        max(min_depth, min(_DEPTH_PER_WIDTH * width, float(max_depths[inside].min())))
        for inside, width in zip(stretch_masks, widths, strict=True)
    ]
    max_depths = np.minimum(max_depths, max(depths))
    for inside, depth in zip(stretch_masks, depths, strict=True):
        max_depths[inside] = depth
    return Zone(
        stretches=stretches,
        depth_step_mm=first_layers[int(np.argmax(depths))],
        # Between two stretches the depth changes from the depth of the first to the depth of the second.
        depth_mm=np.asarray(np.min(max_depths + _MAX_DEPTH_SLOPE * np.abs(columns[:, None] - places), axis=1)),
    )


def _rail_closure(profile: Profile, depth: float) -> Floats:
    """Polyline (n, 2) in mm around the body of the rail.

    It runs from the field-side end of the running surface to its gauge-side end.
    """
    start, end = (
        [float(p.y), float(p.z)] for p in (profile.evaluate(float(len(profile.segments))), profile.evaluate(0.0))
    )
    if -depth >= min(start[1], end[1]) - 1.0:
        raise InputError(
            f"rail depth {depth:g} mm: the running surface of {profile.name} reaches down to"
            f" {-min(start[1], end[1]):.1f} mm; give a rail depth at least 1 mm larger"
        )
    if not profile.outline:
        return np.array([[start[0], -depth], [end[0], -depth]])
    # The outline begins with the running surface and continues around the foot to the gauge-side end.
    line = np.vstack([_segment_points(segment) for segment in profile.outline[len(profile.segments) :]])
    line = line[np.append(True, np.hypot(*np.diff(line, axis=0).T) > _SAME_POINT_MM)][1:-1]
    if depth >= -line[:, 1].min():
        raise InputError(
            f"rail depth {depth:g} mm: {profile.name} is {-line[:, 1].min():.1f} mm high; give a smaller depth"
        )
    below_cut = np.flatnonzero(line[:, 1] <= -depth)
    first, last = int(below_cut[0]), int(below_cut[-1])
    right = _point_at_depth(line[first - 1] if first > 0 else np.array(start), line[first], depth)
    left = _point_at_depth(line[last + 1] if last < len(line) - 1 else np.array(end), line[last], depth)
    return np.vstack([line[:first], [right, left], line[last + 1 :]])


def _segment_points(segment: Segment) -> Floats:
    """Points (n, 2) along a segment in mm."""
    p = segment.evaluate(np.linspace(0.0, 1.0, 2 if isinstance(segment, StraightSegment) else 40))
    return np.column_stack([p.y, p.z])


def _point_at_depth(upper: Floats, lower: Floats, depth: float) -> Floats:
    """Point at a depth on the straight line between two points."""
    fraction = (-depth - upper[1]) / (lower[1] - upper[1])
    return np.asarray(upper + fraction * (lower - upper))


def _base_edge(closure: Floats) -> tuple[int, int]:
    """Index of the first and last point of the closure at its lowest height."""
    lowest = closure[:, 1].min()
    on_base = np.flatnonzero(closure[:, 1] < lowest + 1e-9)
    return int(on_base[0]), int(on_base[-1])


def make_too_short_error(what: str, half_length_mm: float, zone_mm: str) -> InputError:
    """Error for bodies that are too short for the contact.

    Parameters
    ----------
    what
        The body's length, as the subject of the message.
    half_length_mm
        Half length of the body in mm.
    zone_mm
        Length of the contact zone in mm, as a text.

    Returns
    -------
    InputError
        The error, which the caller raises.
    """
    return InputError(
        f"{what} is {half_length_mm:g} mm; allowed: at least two elements more than the contact zone ({zone_mm} mm);"
        " give a larger half_length_mm, or correct the load or Young's modulus if they are wrong"
    )


def _sweep_positions(zone: FineZone, end: float, half: bool, cover: int, what: str) -> tuple[Floats, slice]:
    """Positions (n,) in mm along the sweep, and their slice in the uniform zone.

    Parameters
    ----------
    zone
        Fine zone with its half length and its number of intervals.
    end
        Last position in mm. The mesh ends there.
    half
        Whether the mesh begins at x = 0; a whole mesh begins at -`end`.
    cover
        Number of uniform intervals beyond the zone at each end.
    what
        Name of the body for the message of an error.

    Raises
    ------
    InputError
        If the body is too short for two intervals beyond the uniform zone.
    """
    intervals = zone.intervals_x + cover
    step = zone.half_length_mm / zone.intervals_x
    start = intervals * step
    if end < start + 2.0 * step:
        raise make_too_short_error(what, end, f"{start:.2f}")
    count = int(np.ceil(np.log1p((_SWEEP_RATIO - 1.0) * (end - start) / step) / np.log(_SWEEP_RATIO)))
    steps = np.minimum(step * _SWEEP_RATIO ** np.arange(1, count + 8), _MAX_ELEMENT_PER_SWEEP * end)
    tail = np.cumsum(steps)
    tail = tail[: np.searchsorted(tail, end - start) + 1]
    tail *= (end - start) / tail[-1]
    right = np.concatenate([np.arange(intervals + 1) * step, start + tail])
    if half:
        return right, slice(0, intervals + 1)
    return np.concatenate([-right[:0:-1], right]), slice(tail.size, tail.size + 2 * intervals + 1)


def _radius_moment(section: Section, rolling_radius: float) -> float:
    """First moment of the section about the axle, in mm^3."""
    p = section.points[section.quads]
    total = 0.0
    for a, b, c in ((0, 1, 2), (0, 2, 3)):
        d1, d2 = p[:, b] - p[:, a], p[:, c] - p[:, a]
        area = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
        total += float(np.sum(area * (rolling_radius - (p[:, a, 1] + p[:, b, 1] + p[:, c, 1]) / 3.0)))
    return total


def _sweep(
    name: Literal["rail", "wheel"],
    section: Section,
    points: Floats,
    x: Floats,
    zone_layers: slice,
    *,
    half: bool,
    volume: float,
) -> BodyMesh:
    """Sweep a section to a checked mesh of hexahedra.

    The points are the section's nodes at each position x, one cross-section after another.
    """
    count = len(section.points)
    layers = len(points) // count
    offsets = (np.arange(layers - 1) * count)[:, None, None]
    hexes = (np.concatenate([section.quads, section.quads + count], axis=1)[None] + offsets).reshape(-1, 8)

    def swept_edges(edges: Integers, layer_slice: slice) -> Integers:
        """Boundary quadrilaterals that edges of the section sweep in a slice of the layers."""
        quads = np.column_stack([edges[:, 0], edges[:, 1], edges[:, 1] + count, edges[:, 0] + count])
        if name == "rail":
            # The rail's section is seen against the direction of the sweep.
            quads = quads[:, ::-1]
        return np.asarray((quads[None] + offsets[layer_slice]).reshape(-1, 4))

    zone_cells = slice(zone_layers.start, zone_layers.stop - 1)
    all_layers = slice(None)
    outer_layers = np.setdiff1d(np.arange(layers - 1), np.arange(layers - 1)[zone_cells])
    outer_contact = np.vstack([swept_edges(section.edges["contact"], slice(k, k + 1)) for k in outer_layers])
    first, last = section.quads[:, ::-1], section.quads + (layers - 1) * count
    surfaces = {
        "contact": swept_edges(section.edges["contact"], zone_cells),
        _SUPPORT_SURFACES[name]: swept_edges(section.edges["base"], all_layers),
        "free": np.vstack([swept_edges(section.edges["free"], all_layers), outer_contact]),
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
        spacing=_constrain_nodes(section, x, zone_layers, half=half),
    )
    check_mesh(mesh)
    return mesh


def _constrain_nodes(section: Section, x: Floats, zone_layers: slice, *, half: bool) -> ConstrainedNodes:
    """Nodes without unknowns, far from the contact.

    There the layers of the solution are farther apart than the layers of the mesh.

    Nodes of the section at a distance of 2^n / _LAYER_DISTANCE_RATIO steps from the contact zone have unknowns on each
    2^n-th layer from the middle.
    """
    count, layers = len(section.points), np.arange(x.size)
    first, last = zone_layers.start, zone_layers.stop - 1
    middle = first if half else (first + last) // 2
    from_middle, zone_layer_count = np.abs(layers - middle), last - middle
    distances, _ = cKDTree(section.points[section.block_nodes[0]]).query(section.points)
    half_length = x[last] - x[middle]
    steps = np.where(
        distances < _ALL_LAYERS_RATIO * half_length,
        1.0,
        _LAYER_DISTANCE_RATIO * distances * zone_layer_count / half_length,
    )
    halvings = np.log2(np.maximum(steps, 1.0)).astype(int)
    # Elements have the layers of their corner with most layers.
    quad_halvings = halvings[section.quads].min(axis=1)
    hexes, between, ends, weights = [], [], [], []
    for halving in range(int(halvings.max()) + 1):
        solved_layers = np.flatnonzero((from_middle % 2**halving == 0) | (from_middle >= zone_layer_count))
        quads, nodes = section.quads[quad_halvings == halving], np.flatnonzero(halvings == halving)
        hexes += [np.concatenate([quads + a * count, quads + b * count], axis=1) for a, b in pairwise(solved_layers)]
        other_layers = np.setdiff1d(layers, solved_layers)
        number = np.searchsorted(solved_layers, other_layers)
        low, high = solved_layers[number - 1], solved_layers[number]
        fraction = np.repeat((x[other_layers] - x[low]) / (x[high] - x[low]), nodes.size)
        between.append((nodes + other_layers[:, None] * count).ravel())
        ends.append(np.stack([(nodes + end[:, None] * count).ravel() for end in (low, high)], axis=1))
        weights.append(np.stack([1.0 - fraction, fraction], axis=1))
    return ConstrainedNodes(
        hexes=np.concatenate(hexes),
        between=np.concatenate(between),
        ends=np.concatenate(ends),
        parts=np.concatenate(weights),
    )
