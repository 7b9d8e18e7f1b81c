"""The standard rails and wheels, profile files in TOML, and the short forms of the command line.

The files in `data/` are the library and also the pattern for a profile of one's own: copy one, change it and give its
path instead of a name.
"""

from __future__ import annotations

import difflib
import math
import os
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.errors import InputError, check_positive
from fecontact.profiles.curve import JOINT_GAP_MM, Arc, Kind, Line, Polynomial, Profile, Segment

if TYPE_CHECKING:
    from fecontact.profiles import schema

_DATA = resources.files("fecontact.profiles") / "data"
Point = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class WheelProfile:
    """A wheel as it is written on the command line.

    Attributes:
        profile: The line across the tread.
        rolling_radius_mm: Radius at the tape circle (y = 0) in mm, or None if the text names the line only.
    """

    profile: Profile
    rolling_radius_mm: float | None = None


@cache
def _kinds() -> dict[str, Kind]:
    """Kind of each library profile by its name."""
    files = sorted(_DATA.iterdir(), key=lambda entry: entry.name)
    return {f.name[:-5]: tomllib.loads(f.read_text("utf-8"))["kind"] for f in files if f.name.endswith(".toml")}


def names(kind: Kind | None = None) -> tuple[str, ...]:
    """Names in the library, all or those of one kind."""
    return tuple(name for name, its_kind in _kinds().items() if kind in (None, its_kind))


def _find(name: str, among: Sequence[str]) -> str:
    by_lower = {known.lower(): known for known in among}
    if name.lower() in by_lower:
        return by_lower[name.lower()]
    near = difflib.get_close_matches(name.lower(), list(by_lower), n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(by_lower[n] for n in near)}?" if near else f"the library has {', '.join(among)}"
    raise InputError(f"there is no profile {name!r}; {hint}")


def toml_text(name: str) -> str:
    """Text of a library file, to copy and change.

    Raises:
        InputError: There is no such name; the message has near ones.
    """
    return (_DATA / f"{_find(name, names())}.toml").read_text("utf-8")


@cache
def load(name: str) -> Profile:
    """Profile of the library by its name, in any case of letters.

    Raises:
        InputError: There is no such name; the message has near ones.
    """
    name = _find(name, names())
    return parse_toml(toml_text(name), name=name)


def read_toml(path: str | Path) -> Profile:
    """Profile from a TOML file of the form of the library files; its name is the file's.

    Raises:
        InputError: The file cannot be read or does not describe a profile; the message names the key.
    """
    path = Path(path)
    try:
        text = path.read_text("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file in UTF-8; save the profile as plain text") from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {getattr(error, 'strerror', error)}; check the path") from None
    return parse_toml(text, name=path.stem)


def parse_toml(text: str, *, name: str) -> Profile:
    """Profile from the text of a TOML file.

    Raises:
        InputError: The text does not describe a profile; the message names the key.
    """
    # pydantic takes longer to import than everything else here
    from pydantic import ValidationError

    from fecontact.profiles import reader, schema

    try:
        file = schema.ProfileFile.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"profile {name}: not valid TOML: {error}") from None
    except ValidationError as error:
        raise InputError(f"profile {name}: " + "; ".join(_explain(dict(e)) for e in error.errors())) from None

    body = [_segment(s, f"profile {name}: body {i + 1}") for i, s in enumerate(file.body)]
    if file.head is not None:
        surface = tangent_head(
            file.head.radii, file.head.half_widths, side_one_in=file.head.side_one_in, side_to_z=file.head.side_to_z
        )
        body += _mirrored(body)
    else:
        surface = [_segment(s, f"profile {name}: surface {i + 1}") for i, s in enumerate(file.surface)]
    profile = Profile(
        name=name,
        kind=file.kind,
        segments=tuple(surface),
        source=file.source,
        outline=(*surface, *body) if body else (),
        notes=tuple(file.notes),
    )
    points = profile.evaluate(np.linspace(0.0, len(surface), 16 * len(surface) + 1))
    reader.check_shape(points.y, points.z, kind=profile.kind, what=f"profile {name}")
    return profile


def _explain(error: dict[str, object]) -> str:
    location = error["loc"]
    assert isinstance(location, tuple)
    where = ".".join(str(part) for part in location) or "file"
    given = error["input"]
    return f"{where}: {error['msg']}" + (f" (given: {given!r})" if isinstance(given, str | int | float) else "")


def _segment(entry: schema.Entry, what: str) -> Segment:
    if entry.type == "line":
        return Line(start=entry.from_, end=entry.to)
    if entry.type == "polynomial":
        return Polynomial(coefficients=tuple(entry.coefficients), y_from=entry.y_from, y_to=entry.y_to)
    return arc_between(entry.from_, entry.to, centre=entry.centre, radius=entry.radius, what=what)


def arc_between(start: Point, end: Point, *, centre: Point, radius: float, what: str = "arc") -> Arc:
    """Shorter arc from `start` to `end` about `centre` (mm); the points only give its two angles.

    Raises:
        InputError: A point lies off the circle by more than 0.001 mm.
    """
    angles = []
    for point in (start, end):
        off = math.hypot(point[0] - centre[0], point[1] - centre[1]) - radius
        if not abs(off) <= JOINT_GAP_MM:
            raise InputError(
                f"{what}: the point {point} mm lies {off:.3g} mm off the circle of radius {radius:g} mm about {centre} "
                f"mm; allowed: {JOINT_GAP_MM:g} mm; correct the point, the centre or the radius"
            )
        angles.append(math.atan2(point[1] - centre[1], point[0] - centre[0]))
    turn = math.remainder(angles[1] - angles[0], math.tau)
    return Arc(centre=centre, radius=radius, angle_from=angles[0], angle_to=angles[0] + turn)


def tangent_head(
    radii: Sequence[float], half_widths: Sequence[float], *, side_one_in: float, side_to_z: float
) -> list[Segment]:
    """Segments of a mirror-symmetric rail head of tangent arcs and straight sides, from left to right.

    Args:
        radii: Radii of the arcs from the crown outwards (mm).
        half_widths: Distance from the axis of the point where each arc meets the next (mm), one fewer than the radii.
        side_one_in: The sides lean outwards, 1 across to this much down; infinite for vertical sides.
        side_to_z: Height at which the sides end (mm, negative: below the crown).

    Raises:
        InputError: The arcs do not follow one another outwards and downwards.
    """
    # Each centre lies on the radius through the joint, which makes the joint exactly tangent. Angles from the y axis.
    centre, angles = (0.0, -radii[0]), [math.pi / 2]
    right: list[Segment] = []
    for i, radius in enumerate(radii):
        if i < len(half_widths):
            reach = (half_widths[i] - centre[0]) / radius
            angle = math.acos(reach) if 0.0 < reach < 1.0 else math.nan
        else:
            angle = math.atan(1.0 / side_one_in)
        if not angle < angles[-1]:
            raise InputError(
                f"head: arc {i + 1} with radius {radius:g} mm cannot reach its outer end; give the half-widths from "
                f"the crown outwards, each within its arc (radii {list(radii)}, half_widths {list(half_widths)} mm)"
            )
        right.append(Arc(centre=centre, radius=radius, angle_from=angles[-1], angle_to=angle))
        angles.append(angle)
        if i + 1 < len(radii):
            shift = radius - radii[i + 1]
            centre = (centre[0] + shift * math.cos(angle), centre[1] + shift * math.sin(angle))
    corner = (centre[0] + radii[-1] * math.cos(angles[-1]), centre[1] + radii[-1] * math.sin(angles[-1]))
    if not side_to_z < corner[1]:
        raise InputError(f"head: side_to_z is {side_to_z:g} mm; allowed: below the last arc, {corner[1]:.4f} mm")
    foot = (corner[0] + (corner[1] - side_to_z) / side_one_in, side_to_z)
    right.append(Line(start=corner, end=foot))
    crown = Arc(centre=(0.0, -radii[0]), radius=radii[0], angle_from=math.pi - angles[1], angle_to=angles[1])
    return [*_mirrored(right[1:]), crown, *right[1:]]


def _mirrored(segments: Sequence[Segment]) -> list[Segment]:
    """Mirror image in y of a chain, in the order that goes on from its end on the axis."""
    mirrored: list[Segment] = []
    for s in reversed(segments):
        if isinstance(s, Line):
            mirrored.append(Line(start=(-s.end[0], s.end[1]), end=(-s.start[0], s.start[1])))
        elif isinstance(s, Arc):
            mirrored.append(
                Arc(
                    centre=(-s.centre[0], s.centre[1]),
                    radius=s.radius,
                    angle_from=math.pi - s.angle_to,
                    angle_to=math.pi - s.angle_from,
                )
            )
        elif isinstance(s, Polynomial):
            flipped = tuple(c * (-1.0) ** k for k, c in enumerate(s.coefficients))
            mirrored.append(Polynomial(coefficients=flipped, y_from=-s.y_to, y_to=-s.y_from))
        else:
            raise AssertionError("points are never mirrored")
    return mirrored


def circular_rail_head(radius_mm: float, half_width_mm: float = 36.0) -> Profile:
    """Rail head of one arc with its crown at (0, 0), for comparisons with closed forms.

    The arc reaches to |y| = min(half_width_mm, 0.95 radius_mm).

    Raises:
        InputError: A length is not finite and positive.
    """
    check_positive("radius of the rail head", radius_mm, "mm", "for example circle:300")
    check_positive("half-width of the rail head", half_width_mm, "mm", "for example 36")
    reach = math.asin(min(half_width_mm / radius_mm, 0.95))
    arc = Arc(centre=(0.0, -radius_mm), radius=radius_mm, angle_from=math.pi / 2 + reach, angle_to=math.pi / 2 - reach)
    return Profile(name=f"circle:{radius_mm:g}", kind="rail", segments=(arc,), source="circular arc")


def two_arc_rail_head(crown_mm: float, gauge_mm: float, junction_mm: float, half_width_mm: float = 36.0) -> Profile:
    """Rail head of two tangent arcs with its crown at (0, 0): a curvature junction at a known distance from it.

    Args:
        crown_mm: Radius on the field side of the junction.
        gauge_mm: Radius on its gauge side.
        junction_mm: Arc length from the crown to the junction, positive to the gauge side: the crown then lies on the
            first arc; negative: on the second; 0: at the junction itself.
        half_width_mm: The arcs reach to this |y|, at most to 95 % of their radius from their centre.

    Raises:
        InputError: A length is not finite and positive, or the crown does not lie on the arcs.
    """
    for name, radius in (("field", crown_mm), ("gauge", gauge_mm)):
        check_positive(f"radius on the {name} side", radius, "mm", "for example arcs:300/80@2.5")
    radius = crown_mm if junction_mm >= 0.0 else gauge_mm
    if not abs(junction_mm) < min(radius, half_width_mm):
        raise InputError(
            f"junction at {junction_mm:g} mm from the crown; allowed: less than the arc of {radius:g} mm under it and"
            f" the half-width of {half_width_mm:g} mm"
        )
    angle = math.pi / 2 + junction_mm / radius
    normal = (math.cos(angle), math.sin(angle))
    # each centre lies on the common normal, which makes the junction exactly tangent
    joint = (radius * normal[0], radius * (normal[1] - 1.0))
    segments: list[Segment] = []
    for r, side in ((gauge_mm, -1.0), (crown_mm, 1.0)):
        centre = (joint[0] - r * normal[0], joint[1] - r * normal[1])
        reach = min(max((half_width_mm - side * centre[0]) / r, 0.0), 0.95)
        end = math.pi / 2 - side * math.asin(reach)
        first, last = (end, angle) if side < 0.0 else (angle, end)
        if not first > last:
            raise InputError(
                f"junction at {junction_mm:g} mm: the arc of {r:g} mm beside it is too steep there; give a smaller"
                " distance"
            )
        segments.append(Arc(centre=centre, radius=r, angle_from=first, angle_to=last))
    name = f"arcs:{crown_mm:g}/{gauge_mm:g}@{junction_mm:g}"
    return Profile(name=name, kind="rail", segments=tuple(segments), source="two tangent arcs")


def cylinder_wheel(y_from_mm: float = -70.0, y_to_mm: float = 65.0) -> Profile:
    """Wheel with a straight tread at z = 0 and no flange, for comparisons with closed forms.

    Raises:
        InputError: The tread does not run from small to large y.
    """
    tread = Line(start=(float(y_from_mm), 0.0), end=(float(y_to_mm), 0.0))
    return Profile(name="cylinder", kind="wheel", segments=(tread,), source="straight line")


def resolve_rail(spec: str) -> Profile:
    """Rail from the text of the command line: a library name, `circle:R`, `arcs:R/R@D` (mm), or a profile file.

    Raises:
        InputError: No such name or file, or the file does not hold a rail.
    """
    if spec.lower().startswith("circle:"):
        return circular_rail_head(_number(spec, "circle:300"))
    if spec.lower().startswith("arcs:"):
        return two_arc_rail_head(*_arcs(spec))
    if spec.lower().startswith("cylinder:"):
        raise InputError(f"{spec!r} is a wheel; a rail may be circle:R or arcs:R/R@D")
    return _resolve(spec, "rail")


def resolve_wheel(spec: str) -> WheelProfile:
    """Wheel from the text of the command line: a library name, `cylinder:R` (mm), or the path of a profile file.

    Raises:
        InputError: No such name or file, or the file does not hold a wheel.
    """
    if spec.lower().startswith("cylinder:"):
        radius = check_positive("radius of the wheel", _number(spec, "cylinder:460"), "mm", "for example cylinder:460")
        return WheelProfile(profile=cylinder_wheel(), rolling_radius_mm=radius)
    if has_no_gauge_face(spec):
        raise InputError(f"{spec!r} is a rail; a wheel may be cylinder:R")
    return WheelProfile(profile=_resolve(spec, "wheel"))


def has_no_gauge_face(spec: str) -> bool:
    """Whether a rail is given by its radii alone: it has no gauge face, its crown lies under the tape circle."""
    return spec.lower().startswith(("circle:", "arcs:"))


def _arcs(spec: str) -> tuple[float, float, float]:
    match = re.fullmatch(r"arcs:([^/@]+)/([^/@]+)@([^/@]+)", spec.lower())
    try:
        if match:
            return float(match[1]), float(match[2]), float(match[3])
    except ValueError:
        pass
    raise InputError(
        f"{spec!r}: give the radii on the field and on the gauge side and the junction's distance from the crown in mm,"
        " as in arcs:300/80@2.5"
    )


def _number(spec: str, example: str) -> float:
    try:
        return float(spec.partition(":")[2])
    except ValueError:
        raise InputError(f"{spec!r} has no number after the colon; give a radius in mm, as in {example}") from None


def _resolve(spec: str, kind: Kind) -> Profile:
    from fecontact.profiles import reader

    path = Path(spec)
    known = {name.lower() for name in names()}
    if spec.lower() in known:
        profile = load(_find(spec, names()))
    elif path.suffix.lower() == ".toml":
        profile = read_toml(path)
    elif os.path.exists(spec):  # unlike Path.exists, never raises
        profile = reader.read_points(path, kind=kind)
    elif path.suffix or len(path.parts) > 1:
        raise InputError(f"there is no file {spec!r}; check the path, or give one of {', '.join(names(kind))}")
    else:
        return load(_find(spec, names(kind)))
    if profile.kind != kind:
        raise InputError(
            f"{spec!r} is a {profile.kind} but a {kind} is wanted; the library has {', '.join(names(kind))}"
        )
    return profile
