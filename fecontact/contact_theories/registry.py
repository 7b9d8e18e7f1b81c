"""Theories of the contact that are judged, from the cheapest to the most expensive.

A new theory is a new entry here, and its words in `registry.toml`. A theory of a gap line is a function from an
approach to the contact. Its contact under a force is found here, and vehicles can use it by its name.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact_theories.analyn import find_analyn_forces, solve_analyn
from fecontact.contact_theories.approximation import (
    TheoryContact,
    patch_from_ellipse,
    theory_contact_from_rung,
    theory_contact_from_strips,
)
from fecontact.contact_theories.equivalent_ellipse import find_equivalent_ellipse_forces, solve_equivalent_ellipse
from fecontact.contact_theories.gap_line import (
    GapLine,
    GapLineForces,
    GapLineTheory,
    StripContact,
    build_gap_line,
    solve_under_load,
)
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.kik_piotrowski import find_kik_piotrowski_forces, solve_kik_piotrowski
from fecontact.contact_theories.kpec import find_kpec_forces, solve_kpec
from fecontact.contact_theories.stripes import find_stripes_forces, solve_stripes
from fecontact.contact_theories.strips import (
    build_gap_line_under_load,
    build_gap_lines_under_loads,
    solve_strip_theory,
    solve_strip_theory_on_lines,
)
from fecontact.contact_theories.touch_hertz import describe_profile_end, solve_hertz_points
from fecontact.errors import InputError
from fecontact.placement.poses import ContactPoint, RelativeCurvature
from fecontact.placement.wheel_on_rail import Placement


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedPlacement:
    """Input of the theories: a placed case under a normal force.

    Attributes
    ----------
    placement
        Placed wheel and rail.
    case
        The case.
    normal_force_N
        Normal force of the finite elements.
    half_space
        Contact of the true gap on a half-space; None if it is not available.
    known_gap_line
        Gap line, if it was built before together with the gap lines of other positions.
    """

    placement: Placement
    case: Case
    normal_force_N: float
    half_space: Rung | None = None
    known_gap_line: GapLine | None = None

    @cached_property
    def gap_line(self) -> GapLine:
        """Gap on the line across through the first contact point.

        Under a vertical load the wheel slides down a steep flank.
        """
        if self.known_gap_line is not None:
            return self.known_gap_line
        modulus = self.case.contact_modulus_MPa
        if self.case.load_kind == "normal":
            return build_gap_line(self.placement, contact_modulus_MPa=modulus)
        return build_gap_line_under_load(self.placement, self.normal_force_N, contact_modulus_MPa=modulus)


# Largest growth of the peak, as a fraction of it, for half the width of strips or nodes. Pressure has no bound at a
# convex corner: it grows with the logarithm of the distance (Johnson 1985, sec. 5.3), so that a peak is as exact as 5 %
# only where four halvings do not change it by more.
_MAX_CORNER_GROWTH = 0.01
# Largest step between two segments, larger than rounding errors of a computer. Smaller steps of published digits are
# closed when a file is read; steps of 0.6 to 0.8 um in EN 15302 are kept.
_MAX_STEP_MM = 1e-6

TheoryFunction: TypeAlias = Callable[[LoadedPlacement], TheoryContact | str | None]


@dataclass(frozen=True, kw_only=True)
class Theory:
    """Theory of the contact.

    Attributes
    ----------
    words, spoken
        Name of the theory in tables, and its name within a sentence if it is different.
    letter
        One or two letters of the theory in the cells of a map. No picture uses them for anything else.
    cost
        Class of cost for a vehicle code.
    source, range
        Source of the theory, and its range of validity.
    differs
        Differences from the source, and details that were not found there; may be empty.
    approximate
        Function from a loaded placement to the contact, or to the reason for no contact; None if the contact would be
        Hertz.
    at_approach
        Contact on a gap line at an approach, which vehicles use too; None for a theory without a gap line.
    """

    words: str
    letter: str
    cost: str
    source: str
    range: str
    approximate: TheoryFunction
    at_approach: GapLineTheory | None = None
    differs: str = ""
    spoken: str = ""

    @property
    def in_sentence(self) -> str:
        """Name of the theory within a sentence."""
        return self.spoken or self.words


def _hertz_contact(loaded: LoadedPlacement, curvature: RelativeCurvature) -> TheoryContact:
    """Hertz's ellipse at the first contact point, with a given curvature."""
    modulus = loaded.case.contact_modulus_MPa
    hertz = hertz_from_hessian(curvature.hessian, normal_force_N=loaded.normal_force_N, contact_modulus_MPa=modulus)
    notes = _hertz_range_notes(loaded, hertz)
    return replace(TheoryContact.of(hertz), status="out of range" if notes else "solved", notes=notes)


def _hertz_range_notes(loaded: LoadedPlacement, hertz: HertzContact) -> tuple[str, ...]:
    """Reasons why a single ellipse is out of its range.

    The reasons are the end of a profile, a junction, and other contact points that close.
    """
    placement, first = loaded.placement, loaded.placement.first
    notes = [end_note] if (end_note := describe_profile_end(placement, first, hertz)) else []
    if first.at_junction:
        notes.append("the contact point is at a curvature junction; the ellipse has the curvature of one side")
    closed_count = len(_closed_points(loaded, hertz.approach_mm))
    if closed_count > 1:
        notes.append(
            f"{closed_count} contact points are closed at the approach of the ellipse, which covers only one of them"
        )
    return tuple(notes)


def _closed_points(loaded: LoadedPlacement, approach_mm: float) -> list[ContactPoint]:
    """Contact points that an approach (mm) along the normal at the first contact point closes.

    The bodies move along the load: under a vertical load on a steep first contact point, they come down by more than
    the approach.
    """
    placement = loaded.placement
    direction = placement.load_direction(normal=loaded.case.load_kind == "normal")
    moved_mm = approach_mm / float(placement.first.normal @ direction)
    return [
        touch
        for touch in placement.contact_points
        if moved_mm * float(touch.normal @ direction) > touch.vertical_gap_mm * float(touch.normal[2])
    ]


def _points_beyond_line(loaded: LoadedPlacement, approach_mm: float) -> tuple[str, ...]:
    """Notes about closed contact points that the gap line does not reach: its theories are out of range."""
    low, high = loaded.gap_line.surface_mm[[0, -1]]
    points = [
        touch for touch in _closed_points(loaded, approach_mm) if not low <= loaded.placement.arc_mm(touch) <= high
    ]
    return tuple(
        f"at this approach the contact point at y = {touch.rail_y_mm:+z.2f} mm on the rail is closed too, but the gap"
        " line does not reach it"
        for touch in points
    )


def _hertz_at_first_touch(loaded: LoadedPlacement) -> TheoryContact:
    """Hertz at the first contact point.

    At a junction it has the curvature of the field side.
    """
    return _hertz_contact(loaded, loaded.placement.first.curvatures[-1])


def _hertz_at_gauge_side(loaded: LoadedPlacement) -> TheoryContact | None:
    """Hertz with the curvature of the gauge side of a junction; None without a junction."""
    first = loaded.placement.first
    return _hertz_contact(loaded, first.curvatures[0]) if first.at_junction else None


def _multi_hertz(loaded: LoadedPlacement) -> TheoryContact | str | None:
    """Ellipses that share the load.

    At a curvature junction they have the curvature of the field side. The result is None for a single ellipse, which is
    Hertz.
    """
    case, placement = loaded.case, loaded.placement
    direction = placement.load_direction(normal=case.load_kind == "normal")
    points = solve_hertz_points(
        placement, case.load_N, direction=direction, contact_modulus_MPa=case.contact_modulus_MPa
    )
    if points.shared_approach_mm is None:
        return next(point.problem for point in points.points if point.problem)
    patches = []
    notes = (*["the ellipses overlap, so they are a single patch"] * points.overlapping, *points.shared_notes)
    for point in points.points:
        if point.shared is None:
            continue
        contact_point = placement.contact_points[point.contact_point_number]
        centre = (contact_point.x_mm - placement.first.x_mm, placement.arc_mm(contact_point))
        patches.append(
            replace(
                patch_from_ellipse(point.shared, centre),
                contact_point_number=point.contact_point_number,
                touch=contact_point,
            )
        )
    if len(patches) < 2:
        # A single ellipse is Hertz.
        return None
    return TheoryContact(
        patches=tuple(sorted(patches, key=lambda patch: -patch.normal_force_N)),
        approach_mm=points.shared_approach_mm * float(placement.first.normal @ direction),
        overlapping=points.overlapping,
        status="out of range" if notes else "solved",
        notes=notes,
    )


def _strip_theory_function(
    theory: Callable[[GapLine, float], StripContact], *, in_plane: bool = True
) -> Callable[[LoadedPlacement], TheoryContact | str]:
    """Create a theory function from a theory of strips under a force.

    The gap is on the line across through the first contact point. If `in_plane`, the strips of the theory lie on the
    tangent plane, and are projected to the surface.
    """

    def approximate(loaded: LoadedPlacement) -> TheoryContact | str:
        """Contact by the theory, or the reason for no contact.

        A contact that reaches beyond the gap line has the status `out of range` and a note.
        """
        try:
            line = loaded.gap_line
            contact = theory(line, loaded.normal_force_N)
        except InputError as error:
            return str(error)
        return _describe_strips(loaded, contact, in_plane=in_plane)

    return approximate


def _describe_strips(loaded: LoadedPlacement, contact: StripContact, *, in_plane: bool = False) -> TheoryContact | str:
    """Contact of a theory of strips, or the reason for no contact.

    If `in_plane`, the strips are on the tangent plane; if not, they are on the surface of the rail.
    """
    if not (contact.half_length_mm > 0.0).any():
        return "; ".join(contact.notes) or "no strip is in contact"
    approximation = theory_contact_from_strips(_project_to_surface(contact, loaded.gap_line) if in_plane else contact)
    return _limit_range(
        approximation,
        (
            *_points_beyond_line(loaded, approximation.approach_mm),
            *_corner_notes(loaded, approximation),
        ),
    )


def _limit_range(contact: TheoryContact, notes: tuple[str, ...]) -> TheoryContact:
    """Contact with notes why it is out of its range; unchanged without notes."""
    if not notes:
        return contact
    status = "out of range" if contact.status == "solved" else contact.status
    return replace(contact, status=status, notes=(*contact.notes, *notes))


def _corner_notes(loaded: LoadedPlacement, contact: TheoryContact) -> tuple[str, ...]:
    """Notes about corners and steps in the patches.

    The peak pressure there grows without bound on finer strips or nodes. At a corner that turns by the angle g, the
    pressure grows by E* g / (2 pi) per unit of the logarithm of the distance; at a step it grows with the inverse of
    the distance.
    """
    p_max_MPa = max(patch.p_max_MPa for patch in contact.patches)
    notes = []
    for corner in loaded.placement.junctions:
        if not any(patch.low_mm[1] <= corner.s_mm <= patch.high_mm[1] for patch in contact.patches):
            continue
        place = f"in the patch, at y = {corner.junction.y_mm:.1f} mm"
        if (step_mm := corner.junction.step_mm) > _MAX_STEP_MM:
            notes.append(
                f"{corner.profile.kind} {corner.profile.name} has a step of {1e3 * step_mm:.2f} µm {place}: the elastic"
                " pressure has no bound there"
            )
        turn_rad = corner.profile.convex_sign * corner.junction.turn_rad
        growth_MPa = loaded.case.contact_modulus_MPa * turn_rad * math.log(2.0) / (2.0 * math.pi)
        if growth_MPa > _MAX_CORNER_GROWTH * p_max_MPa:
            notes.append(
                f"{corner.profile.kind} {corner.profile.name} has a corner of {1e3 * turn_rad:.1f} mrad"
                f" {place}: the elastic pressure has no bound there, and the peak grows by"
                f" {growth_MPa:.0f} MPa on strips or nodes of half the width"
            )
    return tuple(notes)


def solve_strips_of_positions(
    positions: Sequence[LoadedPlacement],
) -> list[tuple[LoadedPlacement, TheoryContact | str]]:
    """Contacts by the strip method at many positions together.

    This takes a part of the time of one position after the other. Each contact is exactly the contact by the theory
    `strip`.

    Parameters
    ----------
    positions
        Placed cases under their normal forces, all with one contact modulus and one kind of load.

    Returns
    -------
    list of tuple
        Each position with its gap line, and its contact or the reason for no contact.
    """
    try:
        lines = _build_gap_lines(positions)
        contacts = solve_strip_theory_on_lines(lines, [loaded.normal_force_N for loaded in positions])
    except InputError:
        # one position without a gap line: each position alone has its own reason
        return [(loaded, _approximate_by_strips(loaded)) for loaded in positions]
    with_lines = [replace(loaded, known_gap_line=line) for loaded, line in zip(positions, lines, strict=True)]
    return [(loaded, _describe_strips(loaded, contact)) for loaded, contact in zip(with_lines, contacts, strict=True)]


_approximate_by_strips = _strip_theory_function(solve_strip_theory, in_plane=False)


def _build_gap_lines(positions: Sequence[LoadedPlacement]) -> list[GapLine]:
    """Gap line of each position, as `LoadedPlacement.gap_line`."""
    if not positions or positions[0].case.load_kind == "normal":
        return [loaded.gap_line for loaded in positions]
    return build_gap_lines_under_loads(
        [loaded.placement for loaded in positions],
        [loaded.normal_force_N for loaded in positions],
        contact_modulus_MPa=positions[0].case.contact_modulus_MPa,
    )


def _project_to_surface(contact: StripContact, line: GapLine) -> StripContact:
    """Contact with its strips projected from the tangent plane to the surface of the rail."""
    return replace(contact, t_mm=np.interp(contact.t_mm, line.t_mm, line.surface_mm))


def _half_space_contact(loaded: LoadedPlacement) -> TheoryContact | None:
    """Contact of the true gap on a half-space; None if it is not available."""
    if loaded.half_space is None:
        return None
    contact = theory_contact_from_rung(loaded.half_space)
    return _limit_range(contact, _corner_notes(loaded, contact))


HERTZ, HERTZ_GAUGE, MULTI_HERTZ = "hertz", "hertz_gauge", "multi_hertz"
_GAP_LINE_THEORIES: Mapping[str, GapLineTheory] = {
    "equivalent_ellipse": solve_equivalent_ellipse,
    "kik_piotrowski": solve_kik_piotrowski,
    "stripes": solve_stripes,
    "analyn": solve_analyn,
    "kpec": solve_kpec,
}
# A theory without forces is searched by its contacts, which takes about twice the time.
_GAP_LINE_FORCES: Mapping[str, GapLineForces] = {
    "equivalent_ellipse": find_equivalent_ellipse_forces,
    "kik_piotrowski": find_kik_piotrowski_forces,
    "stripes": find_stripes_forces,
    "analyn": find_analyn_forces,
    "kpec": find_kpec_forces,
}
_APPROXIMATIONS: Mapping[str, TheoryFunction] = {
    HERTZ: _hertz_at_first_touch,
    HERTZ_GAUGE: _hertz_at_gauge_side,
    MULTI_HERTZ: _multi_hertz,
    **{
        name: _strip_theory_function(partial(solve_under_load, theory=theory, forces=_GAP_LINE_FORCES.get(name)))
        for name, theory in _GAP_LINE_THEORIES.items()
    },
    "strip": _approximate_by_strips,
    "half_space": _half_space_contact,
}
_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
THEORIES = {
    name: Theory(approximate=approximate, at_approach=_GAP_LINE_THEORIES.get(name), **_WORDS[name])
    for name, approximate in _APPROXIMATIONS.items()
}
"""Theories by name, from the cheapest to the most expensive."""
_COARSE_FACTOR = 1.15


def fast_theory(name: str) -> TheoryFunction:
    """Function of a theory for very many contacts.

    For theories of a gap line, approaches are tried in steps of 15 %, not 2 %. Two solutions with a smaller distance
    are both missed. The contact that is found is equal to 1e-9.

    Parameters
    ----------
    name
        Name of the theory in `THEORIES`.

    Returns
    -------
    TheoryFunction
        Function from a loaded placement to the contact, or to the reason for no contact; None if the contact would be
        Hertz.
    """
    theory = _GAP_LINE_THEORIES.get(name)
    if theory is None:
        return THEORIES[name].approximate
    return _strip_theory_function(
        partial(solve_under_load, theory=theory, forces=_GAP_LINE_FORCES.get(name), factor=_COARSE_FACTOR)
    )


HERTZ_OF_EACH_SIDE = (HERTZ_GAUGE, HERTZ)
"""Hertz's ellipse with the curvature of each side of the first contact point."""
ELLIPSE_THEORIES = (MULTI_HERTZ, "equivalent_ellipse")
"""Theories of ellipses, which vehicle codes use in a similar way to Hertz."""
