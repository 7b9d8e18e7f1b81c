"""Profiles into files: SIMPACK (.prr, .prw), columns (.csv, .txt), and segments (.toml), which keep a line exact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import Arc, Floats, Line, Polynomial, Segment, Spline

# A file of points takes one so often, unless a line is made of points itself.
STEP_MM = 0.1
# Digits after the decimal point (mm): more than any file is measured to.
_DIGITS = 12
_ENDINGS: dict[str, str] = {".prr": "rail", ".prw": "wheel"}


def points_along(profile: Profile, step_mm: float = STEP_MM) -> Floats:
    """Points (n, 2) in mm along a running surface, the ends of all segments among them; its own if it has some."""
    parts = []
    for number, segment in enumerate(profile.segments):
        if isinstance(segment, Spline):
            parts.append(segment.points)
            continue
        first, last = (float(s) for s in profile.arc_length([number, number + 1.0 - 1e-15]))
        count = max(1, int(np.ceil((last - first) / step_mm)))
        p = segment.evaluate(np.linspace(0.0, 1.0, count + 1))
        parts.append(np.column_stack((p.y, p.z)))
    points = np.concatenate(parts)
    # the end of a segment is the start of the next, to the rounding of the joint
    apart = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-2 * step_mm))
    return np.asarray(points[apart])


def profile_text(profile: Profile, ending: str, *, step_mm: float = STEP_MM) -> str:
    """Text of a file for a profile, by the ending that it will have.

    Raises
    ------
    InputError
        There is no writer for the ending, it is that of the other body, or the line has pieces that the format cannot
        hold.
    """
    ending = ending.lower()
    if ending not in WRITERS:
        raise InputError(f"profiles are written as {', '.join(WRITERS)}, not as {ending or 'a file without ending'!r}")
    if _ENDINGS.get(ending, profile.kind) != profile.kind:
        raise InputError(f"{ending} is for a {_ENDINGS[ending]}, and {profile.name} is a {profile.kind}")
    return WRITERS[ending](profile, step_mm)


def _columns(profile: Profile, step_mm: float, separator: str) -> str:
    head = f"# {profile.kind} {profile.name}: y to the field side, z up\ny [mm]{separator}z [mm]\n"
    rows = points_along(profile, step_mm)
    return head + "".join(f"{y:.{_DIGITS}f}{separator}{z:.{_DIGITS}f}\n" for y, z in rows)


def _csv(profile: Profile, step_mm: float) -> str:
    return _columns(profile, step_mm, ",")


def _txt(profile: Profile, step_mm: float) -> str:
    return _columns(profile, step_mm, " ")


def _simpack(profile: Profile, step_mm: float) -> str:
    keys = {
        "approx.smooth": "0.0", "file": "''", "file.mtime": "0", "comment": f"'{_plain(profile.name)}'", "type": "0",
        "point.dist.min": "0.0", "shift.y": "0.0", "shift.z": "0.0", "rotate": "0.0", "bound.y.min": "1.0",
        "bound.y.max": "0.0", "bound.z.min": "1.0", "bound.z.max": "0.0", "mirror.y": "0", "mirror.z": "0",
        "inversion": "0", "units.len.f": "1000.0", "units.ang.f": "1.0",
    }  # fmt: skip
    head = f"header.begin\n  version = 1\n  type = {int(profile.kind == 'wheel')}\nheader.end\nspline.begin\n"
    body = "".join(f"  {key} = {value}\n" for key, value in keys.items())
    # z points down there
    rows = "".join(f"{y:.{_DIGITS}f} {-z:.{_DIGITS}f}\n" for y, z in points_along(profile, step_mm))
    return f"{head}{body}  point.begin\n{rows}  point.end\nspline.end\n"


def _toml(profile: Profile, step_mm: float) -> str:
    # what is given by points stays what it is: no list of segments says it
    if not all(isinstance(segment, Line | Arc | Polynomial) for segment in profile.segments):
        raise InputError(
            f"{profile.name} is a line through points, which no list of exact segments holds; write it as .csv"
        )
    head = f'kind = "{profile.kind}"\nunits = "mm"\ncertainty = {_quoted(profile.certainty)}\n'
    head += f"source = {_quoted(profile.source)}\n"
    rest = profile.outline[len(profile.segments) :]
    return (
        head
        + "".join(_toml_segment("surface", one) for one in profile.segments)
        + "".join(_toml_segment("body", one) for one in rest)
    )


def _toml_segment(table: str, segment: Segment) -> str:
    if isinstance(segment, Polynomial):
        return (
            f'\n[[{table}]]\ntype = "polynomial"\ny_from = {segment.y_from!r}\ny_to = {segment.y_to!r}\n'
            f"coefficients = {_list(segment.coefficients)}\n"
        )
    assert isinstance(segment, Line | Arc)
    ends = segment.evaluate(np.array([0.0, 1.0]))
    start, end = ((float(ends.y[k]), float(ends.z[k])) for k in (0, 1))
    if isinstance(segment, Line):
        return f'\n[[{table}]]\ntype = "line"\nfrom = {_list(segment.start)}\nto = {_list(segment.end)}\n'
    return (
        f'\n[[{table}]]\ntype = "arc"\nfrom = {_list(start)}\nto = {_list(end)}\ncentre = {_list(segment.centre)}\n'
        f"radius = {segment.radius!r}\n"
    )


def _list(values: tuple[float, ...]) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{"".join(c if c.isprintable() else " " for c in escaped)}"'


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() and c not in "'!" else " " for c in text)


WRITERS: dict[str, Callable[[Profile, float], str]] = {
    ".prr": _simpack,
    ".prw": _simpack,
    ".csv": _csv,
    ".txt": _txt,
    ".toml": _toml,
}
"""Writers by the ending of the file."""
