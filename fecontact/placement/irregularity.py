"""Irregularities of wheel and rail along the track: waves, flats and welds, and the texts that give them.

An irregularity is an opening e(s) in mm at the distance s in mm along the running surface, positive if material is
missing: it opens the gap, on the wheel and on the rail.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Literal, get_args

from fecontact.errors import InputError
from fecontact.inputs.kinds import choice, number
from fecontact.inputs.slots import inputs
from fecontact.inputs.texts import nearest

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from scipy.interpolate import CubicSpline

    from fecontact.arrays import Floats


Kind = Literal["sine", "chord", "haversine", "table"]
STEEPEST = 0.05
"""Largest slope of an irregularity: with a larger slope it cannot simply be added to the gap."""
# Change of slope between two pieces of a table that counts as a kink; a patch of 14 mm on points 1 mm apart bends by a
# tenth of it.
_KINK = 0.01
# Largest distance between points of a table, over the median distance.
_WIDEST = 4.0
_FEWEST_POINTS = 5
_NEEDS: Mapping[str, tuple[str, ...]] = {
    "sine": ("wavelength_mm", "amplitude_mm"),
    "chord": ("length_mm",),
    "haversine": ("length_mm", "depth_mm"),
    "table": ("points_mm",),
}
_MAY: Mapping[str, tuple[str, ...]] = {"sine": ("phase_rad",), "chord": ("depth_mm",)}
_LENGTHS = ("wavelength_mm", "amplitude_mm", "length_mm", "depth_mm")


_REMEDY = "give lengths in mm, um, cm or m"


@inputs
class Irregularity:
    """An opening e(s) along the track.

    Attributes
    ----------
    kind
        `sine`: amplitude cos(2 pi s / wavelength + phase). `chord`: a fresh flat, straight from edge to edge.
        `haversine`: a worn flat, depth (1 + cos(2 pi s / length)) / 2. `table`: measured.
    wavelength_mm, amplitude_mm, phase_rad
        Numbers of a sine; the amplitude is half of peak to valley.
    length_mm, depth_mm
        Numbers of a flat; the depth of a chord is length^2 / (8 R) if not given, see `on_wheel`.
    points_mm
        Distances and openings of a table, in order of distance; a cubic spline between the points.

    Notes
    -----
    Sources: the haversine of Newton and Clark (1979); the chord of a circle to first order.
    """

    kind: Kind = choice(MISSING, "Its shape", get_args(Kind), label="irregularity")
    wavelength_mm: float | None = number(None, "Of a sine", remedy=_REMEDY)
    amplitude_mm: float | None = number(None, "Half of peak to valley of a sine", remedy=_REMEDY)
    phase_rad: float = number(0.0, "Of a sine", low=-1e6, high=1e6)
    length_mm: float | None = number(None, "Of a flat", remedy=_REMEDY)
    depth_mm: float | None = number(None, "Of a flat", remedy=_REMEDY)
    points_mm: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        needed, allowed = _NEEDS[self.kind], (*_NEEDS[self.kind], *_MAY.get(self.kind, ()))
        # a file of records gives them as lists
        object.__setattr__(self, "points_mm", tuple((float(s), float(e)) for s, e in self.points_mm))
        for name in (*_LENGTHS, "phase_rad", "points_mm"):
            given = getattr(self, name) is not None if name in _LENGTHS else bool(getattr(self, name))
            if name in needed and not given:
                raise InputError(f"irregularity {self.kind}: {name} is missing; give {' and '.join(needed)}")
            if given and name not in allowed:
                raise InputError(f"irregularity {self.kind}: it has no {name}; allowed: {', '.join(allowed)}")
        if self.kind == "table":
            _check_points(self.points_mm)
        if self.largest_slope > STEEPEST:
            raise InputError(
                f"irregularity {self.kind}: its largest slope is {self.largest_slope:.3g}; allowed: up to {STEEPEST:g},"
                " beyond which it is a shape of the body and no line to be added to a gap; smooth it, or give the"
                " wheel or rail that has it"
            )

    def on_wheel(self, radius_mm: float) -> Irregularity:
        """A chord without a depth gets the depth of its length on a wheel of this radius; else unchanged."""
        if self.kind != "chord" or self.depth_mm is not None:
            return self
        assert self.length_mm is not None
        return replace(self, depth_mm=self.length_mm**2 / (8.0 * radius_mm))

    def opening_mm(self, s_mm: ArrayLike) -> Floats:
        """The opening e at distances s, of any shape; a table continues with its end values."""
        import numpy as np

        s = np.asarray(s_mm)
        if self.kind == "table":
            return np.asarray(self._spline(np.clip(s, self.points_mm[0][0], self.points_mm[-1][0])))
        if self.kind == "sine":
            wave = np.cos(2.0 * np.pi * s / (self.wavelength_mm or math.inf) + self.phase_rad)
            return np.asarray((self.amplitude_mm or 0.0) * wave)
        length, depth = self.length_mm or math.inf, self.depth_mm or 0.0
        if self.kind == "chord":
            return np.maximum(0.0, depth * (1.0 - (2.0 * s / length) ** 2))
        return np.where(np.abs(s) < 0.5 * length, 0.5 * depth * (1.0 + np.cos(2.0 * np.pi * s / length)), 0.0)

    @property
    def largest_slope(self) -> float:
        """Largest |de/ds|; 0 for a flat whose depth is not known yet."""
        if self.kind == "table":
            return max(map(abs, _slopes(self.points_mm)))
        if self.kind == "sine":
            return 2.0 * math.pi * (self.amplitude_mm or 0.0) / (self.wavelength_mm or math.inf)
        factor = math.pi if self.kind == "haversine" else 4.0
        return factor * (self.depth_mm or 0.0) / (self.length_mm or math.inf)

    @property
    def height_mm(self) -> float:
        """Largest opening minus the smallest opening."""
        if self.kind == "table":
            openings = [e for _, e in self.points_mm]
            return max(openings) - min(openings)
        return 2.0 * (self.amplitude_mm or 0.0) if self.kind == "sine" else self.depth_mm or 0.0

    @property
    def finest_mm(self) -> float:
        """Shortest length along the track that nodes must resolve: a wave, a flat, four points of a table."""
        if self.kind == "table":
            return 4.0 * median(_steps(self.points_mm))
        return self.wavelength_mm or self.length_mm or math.inf

    @property
    def kinks_mm(self) -> tuple[float, ...]:
        """Places at which the slope jumps, where the elastic pressure is unbounded."""
        if self.kind == "chord":
            half = 0.5 * (self.length_mm or 0.0)
            return (-half, half)
        if self.kind != "table":
            return ()
        inner = [s for s, _ in self.points_mm[1:-1]]
        jumps = [abs(after - before) for before, after in pairwise(_slopes(self.points_mm))]
        return tuple(s for s, jump in zip(inner, jumps, strict=True) if jump > _KINK)

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        return CubicSpline(*zip(*self.points_mm, strict=True), bc_type="natural")


def _steps(points: Sequence[tuple[float, float]]) -> list[float]:
    return [after[0] - before[0] for before, after in pairwise(points)]


def _slopes(points: Sequence[tuple[float, float]]) -> list[float]:
    return [(after[1] - before[1]) / (after[0] - before[0]) for before, after in pairwise(points)]


def _check_points(points: Sequence[tuple[float, float]]) -> None:
    """Refuse a table with too few points, points out of order, gaps and steps."""
    if len(points) < _FEWEST_POINTS or not all(math.isfinite(one) for point in points for one in point):
        raise InputError(
            f"irregularity table: {len(points)} points; allowed: {_FEWEST_POINTS} and more, all of them finite"
        )
    middle = median(_steps(points))
    for (s, e), (next_s, next_e) in pairwise(points):
        if next_s <= s:
            raise InputError(
                f"irregularity table: distances do not grow at {next_s:g} mm; sort it, and leave nothing in twice"
            )
        if next_s - s > _WIDEST * middle:
            raise InputError(
                f"irregularity table: a gap of {next_s - s:g} mm from {s:g} to {next_s:g} mm, where points are"
                f" {middle:g} mm apart; allowed: {_WIDEST:g} times that; measure it, fill it in, or cut the table there"
            )
        if abs(slope := (next_e - e) / (next_s - s)) > STEEPEST:
            raise InputError(
                f"irregularity table: a step of {next_e - e:+.4g} mm from {s:g} to {next_s:g} mm, a slope of"
                f" {abs(slope):.3g}; allowed: up to {STEEPEST:g}; check the units of both columns, smooth it over some"
                " mm, or give the wheel or rail that has it"
            )


# --- An irregularity as a text, such as `sine:wavelength_mm=30,amplitude_um=25`, and as a table in a file.

FORMS = (
    "sine:wavelength_mm=30,amplitude_um=25[,phase_deg=90] (a cosine), chord:length_mm=40,"
    " haversine:length_mm=52,depth_mm=0.4, or table:FILE,distance=mm,opening=um"
)
_UNITS = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1e3}
_ANGLES = {"deg": math.pi / 180.0, "rad": 1.0}
_MOST_BYTES = 20_000_000


def parse_irregularity(text: str) -> Irregularity:
    """The irregularity of a text.

    Raises
    ------
    InputError
        For an unknown kind, quantity or unit, or a table that cannot be read.
    """
    kind, _, rest = text.strip().partition(":")
    items = [item for item in rest.split(",") if item.strip()]
    if kind == "table":
        items[:1] = [f"file={item.strip()}" for item in items[:1]]
    pairs = (item.partition("=") for item in items)
    return irregularity_of({"kind": kind, **{name.strip(): value.strip() for name, _, value in pairs}})


def irregularity_of(value: Any) -> Irregularity:
    """The irregularity of a text, or of a mapping with a `kind` and quantities with units in their names.

    Raises
    ------
    InputError
        As in `parse_irregularity` and `read_table`.
    """
    if isinstance(value, Irregularity):
        return value
    if isinstance(value, str):
        return parse_irregularity(value)
    if not isinstance(value, dict) or "kind" not in value:
        raise InputError(f"irregularity is {value!r}; allowed: {FORMS}, or a table with a kind")
    rest = {name: one for name, one in value.items() if name != "kind"}
    if value["kind"] == "table":
        if unknown := rest.keys() - {"file", "distance", "opening"}:
            raise InputError(f"irregularity table: {', '.join(sorted(unknown))}; it has file, distance and opening")
        if not rest.get("file"):
            raise InputError(f"irregularity table: no file is given; allowed: {FORMS}")
        return read_table(rest["file"], distance_unit=rest.get("distance"), opening_unit=rest.get("opening"))
    quantities: dict[str, Any] = dict(quantity(name, one) for name, one in rest.items())
    return Irregularity(kind=value["kind"], **quantities)


def irregularity_text(value: Irregularity) -> str:
    """An irregularity as a text; for a table only the number of its points and its ends."""
    if value.kind == "table":
        first, last = value.points_mm[0][0], value.points_mm[-1][0]
        return f"table of {len(value.points_mm)} points from {first:g} to {last:g} mm"
    given = {name: getattr(value, name) for name in _LENGTHS}
    if value.phase_rad:
        given["phase_rad"] = value.phase_rad
    return f"{value.kind}:" + ",".join(f"{name}={one:.12g}" for name, one in given.items() if one is not None)


def quantity(name: str, value: Any) -> tuple[str, float]:
    """Name and value of a quantity in internal units, from its name in files, which ends in a unit."""
    stem, _, unit = name.rpartition("_")
    units = _ANGLES if stem == "phase" else _UNITS
    if (stem != "phase" and f"{stem}_mm" not in _LENGTHS) or unit not in units:
        known = {name: name for name in (*_LENGTHS, "phase_deg")}
        raise InputError(
            f"irregularity: {name or 'an empty item'} is no known quantity; allowed: {', '.join(known)}, also in"
            f" um, cm and m{nearest(name, known)}"
        )
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"irregularity: {name} is {value!r}; allowed: a number") from None
    return f"{stem}_{'rad' if stem == 'phase' else 'mm'}", number * units[unit]


def read_table(path: str | Path, *, distance_unit: str | None = None, opening_unit: str | None = None) -> Irregularity:
    """A measured irregularity from a text of two columns, the distance and the opening (missing material positive).

    Units are given, or stand in the heading, such as `s_m,e_um`.

    Raises
    ------
    InputError
        If the file cannot be read, has no units, too few points, gaps or steps.
    """
    lines = _lines(Path(path))
    heading = lines[0] if lines and _numbers(lines[0]) is None else None
    rows = [_numbers(line) for line in (lines[1:] if heading else lines)]
    bad = next((number for number, row in enumerate(rows, 1) if row is None or len(row) < 2), None)
    if bad is not None or not rows:
        raise InputError(f"{path}: row {bad or 1} is no pair of numbers; give distance and opening in two columns")
    units = [_unit(given, heading, column, str(path)) for column, given in enumerate((distance_unit, opening_unit))]
    points = tuple((row[0] * units[0], row[1] * units[1]) for row in rows if row)
    try:
        return Irregularity(kind="table", points_mm=points)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _lines(path: Path) -> list[list[str]]:
    try:
        if not path.is_file() or path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path}: there is no such file of up to {_MOST_BYTES / 1e6:g} MB; check the path")
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: it cannot be read ({error}); give a text of two columns") from None
    kept = [line for raw in text.splitlines() if (line := re.sub(r"[#!%].*", "", raw).strip())]
    if not kept:
        raise InputError(f"{path}: it is empty; give distance and opening in two columns")
    separator = next((one for one in ";,\t" if one in kept[-1]), None)
    return [line.split() for line in kept] if separator is None else list(csv.reader(kept, delimiter=separator))


def _numbers(row: list[str]) -> list[float] | None:
    try:
        return [float(cell) for cell in row[:2]]
    except ValueError:
        return None


def _unit(given: str | None, heading: list[str] | None, column: int, path: str) -> float:
    """Factor to mm of a column, from a given unit or the heading."""
    name = ("distance", "opening")[column]
    found = re.search(r"[\[(_ ](mm|um|µm|cm|m)[\])]?$", heading[column].strip()) if heading else None
    unit = given or (found[1].replace("µ", "u") if found else None)
    if unit is None:
        raise InputError(
            f"{path}: the unit of its {name} is not given; give {name}=mm, um, cm or m, or the heading {name}_mm"
        )
    if unit not in _UNITS:
        sizes = ", ".join(f"1 {name} is {factor:g} mm" for name, factor in _UNITS.items())
        raise InputError(f"{path}: the unit of its {name} is {unit!r}; allowed: {', '.join(_UNITS)}: {sizes}")
    return _UNITS[unit]
