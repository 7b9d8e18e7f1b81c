"""Irregularities of wheel and rail along the track: waves, flats and welds, also as texts.

An irregularity is an opening e(s) in mm at the distance s in mm along the running surface. It is positive if material
is missing: then it opens the gap, on the wheel and on the rail.
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
from fecontact.inputs.kinds import choice_field, number_field
from fecontact.inputs.slots import input_dataclass
from fecontact.inputs.texts import count_text, suggest_name

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from scipy.interpolate import CubicSpline

    from fecontact.arrays import Floats


IrregularityKind = Literal["sine", "chord", "haversine", "table"]
MAX_SLOPE = 0.05
"""Largest slope (-) of an irregularity. A steeper irregularity cannot simply be added to the gap."""
# Change of slope between two segments of a table that counts as a kink. A patch of 14 mm on points 1 mm apart has bends
# of a tenth of it.
_KINK_SLOPE = 0.01
# Largest distance between points of a table, relative to the median distance.
_MAX_GAP_RATIO = 4.0
_MIN_POINTS = 5
_REQUIRED_INPUTS: Mapping[str, tuple[str, ...]] = {
    "sine": ("wavelength_mm", "amplitude_mm"),
    "chord": ("length_mm",),
    "haversine": ("length_mm", "depth_mm"),
    "table": ("points_mm",),
}
_OPTIONAL_INPUTS: Mapping[str, tuple[str, ...]] = {"sine": ("phase_rad",), "chord": ("depth_mm",)}
_LENGTH_INPUTS = ("wavelength_mm", "amplitude_mm", "length_mm", "depth_mm")


_REMEDY = "give lengths in mm, um, cm or m"


@input_dataclass
class Irregularity:
    """An opening e(s) along the track.

    Attributes
    ----------
    kind
        `sine`: amplitude cos(2 pi s / wavelength + phase). `chord`: a fresh flat, straight from edge to edge.
        `haversine`: a worn flat, depth (1 + cos(2 pi s / length)) / 2. `table`: measured.
    wavelength_mm, amplitude_mm, phase_rad
        Wave length, half of peak to valley, and phase of a sine.
    length_mm, depth_mm
        Length and depth of a flat. Without a depth, a chord has the depth length^2 / (8 R); see `on_wheel`.
    points_mm
        Distances and openings of a table, in order of distance, joined by a cubic spline.

    Notes
    -----
    Sources: the haversine of Newton and Clark (1979); the chord of a circle to first order.

    Examples
    --------
    >>> flat = Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.4)
    >>> [round(float(flat.opening_mm(s)), 6) for s in (0.0, 13.0, 26.0)]
    [0.4, 0.2, 0.0]
    """

    kind: IrregularityKind = choice_field(
        MISSING, "Shape of the irregularity", get_args(IrregularityKind), label="irregularity"
    )
    wavelength_mm: float | None = number_field(None, "Wavelength of a sine", remedy=_REMEDY)
    amplitude_mm: float | None = number_field(None, "Amplitude of a sine, half of peak to valley", remedy=_REMEDY)
    phase_rad: float = number_field(0.0, "Phase of a sine", low=-1e6, high=1e6)
    length_mm: float | None = number_field(None, "Length of a flat", remedy=_REMEDY)
    depth_mm: float | None = number_field(None, "Depth of a flat", remedy=_REMEDY)
    points_mm: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Refuse missing or additional inputs of the kind, bad tables and steep slopes.

        Points become tuples of floats (mm).

        Raises
        ------
        InputError
            For the first fault, with the allowed inputs; slopes above `MAX_SLOPE` are refused.
        """
        required, possible = (
            _REQUIRED_INPUTS[self.kind],
            (*_REQUIRED_INPUTS[self.kind], *_OPTIONAL_INPUTS.get(self.kind, ())),
        )
        # Records in a file have the points as lists.
        object.__setattr__(self, "points_mm", tuple((float(s), float(e)) for s, e in self.points_mm))
        for name in (*_LENGTH_INPUTS, "phase_rad", "points_mm"):
            has_value = getattr(self, name) is not None if name in _LENGTH_INPUTS else bool(getattr(self, name))
            if name in required and not has_value:
                raise InputError(f"irregularity {self.kind}: {name} is missing; give {' and '.join(required)}")
            if has_value and name not in possible:
                raise InputError(
                    f"irregularity {self.kind}: {name} is not an input of this kind; allowed: {', '.join(possible)}"
                )
        if self.kind == "table":
            _check_points(self.points_mm)
        if self.largest_slope > MAX_SLOPE:
            raise InputError(
                f"irregularity {self.kind}: its largest slope is {self.largest_slope:.3g}; allowed: at most"
                f" {MAX_SLOPE:g}, because a steeper irregularity cannot be added to the gap; give a smaller depth or"
                " amplitude, or a longer flat or wave"
            )

    def on_wheel(self, radius_mm: float) -> Irregularity:
        """Set the depth of a chord from its length on a wheel.

        Parameters
        ----------
        radius_mm
            Radius of the wheel in mm.

        Returns
        -------
        Irregularity
            A chord with a depth; any other irregularity without a change.
        """
        if self.kind != "chord" or self.depth_mm is not None:
            return self
        assert self.length_mm is not None
        return replace(self, depth_mm=self.length_mm**2 / (8.0 * radius_mm))

    def opening_mm(self, s_mm: ArrayLike) -> Floats:
        """The opening e at distances s.

        Parameters
        ----------
        s_mm
            Distances in mm, of any shape. A table continues with its end values.

        Returns
        -------
        opening
            Opening in mm, in the shape of `s_mm`.
        """
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
        """Largest |de/ds| (-).

        It is 0 for a flat without a depth.
        """
        if self.kind == "table":
            return max(map(abs, _slopes(self.points_mm)))
        if self.kind == "sine":
            return 2.0 * math.pi * (self.amplitude_mm or 0.0) / (self.wavelength_mm or math.inf)
        factor = math.pi if self.kind == "haversine" else 4.0
        return factor * (self.depth_mm or 0.0) / (self.length_mm or math.inf)

    @property
    def height_mm(self) -> float:
        """Largest opening minus the smallest opening, in mm."""
        if self.kind == "table":
            openings = [e for _, e in self.points_mm]
            return max(openings) - min(openings)
        return 2.0 * (self.amplitude_mm or 0.0) if self.kind == "sine" else self.depth_mm or 0.0

    @property
    def finest_mm(self) -> float:
        """Shortest length along the track that nodes must resolve, in mm.

        It is a wave, a flat or four points of a table.
        """
        if self.kind == "table":
            return 4.0 * median(_steps(self.points_mm))
        return self.wavelength_mm or self.length_mm or math.inf

    @property
    def kinks_mm(self) -> tuple[float, ...]:
        """Places in mm at which the slope jumps, where the elastic pressure is unbounded."""
        if self.kind == "chord":
            half = 0.5 * (self.length_mm or 0.0)
            return (-half, half)
        if self.kind != "table":
            return ()
        inner = [s for s, _ in self.points_mm[1:-1]]
        jumps = [abs(after - before) for before, after in pairwise(_slopes(self.points_mm))]
        return tuple(s for s, jump in zip(inner, jumps, strict=True) if jump > _KINK_SLOPE)

    @cached_property
    def _spline(self) -> CubicSpline:
        """Natural cubic spline through the points of a table."""
        from scipy.interpolate import CubicSpline

        return CubicSpline(*zip(*self.points_mm, strict=True), bc_type="natural")


def _steps(points: Sequence[tuple[float, float]]) -> list[float]:
    """Distances in mm between neighbouring points."""
    return [after[0] - before[0] for before, after in pairwise(points)]


def _slopes(points: Sequence[tuple[float, float]]) -> list[float]:
    """Slopes (-) between neighbouring points."""
    return [(after[1] - before[1]) / (after[0] - before[0]) for before, after in pairwise(points)]


def _check_points(points: Sequence[tuple[float, float]]) -> None:
    """Refuse a table with too few points, points out of order, gaps or steps.

    Points are (distance, opening) in mm. A gap is longer than `_MAX_GAP_RATIO` times the median spacing; a step has a
    slope above `MAX_SLOPE`.

    Raises
    ------
    InputError
        For the first fault, with its place.
    """
    if len(points) < _MIN_POINTS or not all(math.isfinite(coordinate) for point in points for coordinate in point):
        raise InputError(
            f"irregularity table: {count_text(len(points), 'point')}; allowed: at least {_MIN_POINTS}, all finite"
        )
    middle = median(_steps(points))
    for (s, e), (next_s, next_e) in pairwise(points):
        if next_s <= s:
            raise InputError(
                f"irregularity table: the distance does not increase at {next_s:g} mm; sort the rows, and remove"
                " repeated rows"
            )
        if next_s - s > _MAX_GAP_RATIO * middle:
            raise InputError(
                f"irregularity table: a gap of {next_s - s:g} mm from {s:g} to {next_s:g} mm; allowed: at most"
                f" {_MAX_GAP_RATIO:g} times the median spacing of {middle:g} mm; add points there, or cut the table"
                " there"
            )
        if abs(slope := (next_e - e) / (next_s - s)) > MAX_SLOPE:
            raise InputError(
                f"irregularity table: a step of {next_e - e:+.4g} mm from {s:g} to {next_s:g} mm is a slope"
                f" of {abs(slope):.3g}; allowed: at most {MAX_SLOPE:g}; check the units of both columns, or smooth the"
                " opening over a few mm"
            )


# --- An irregularity as a text, such as `sine:wavelength_mm=30,amplitude_um=25`, and as a table in a file.

IRREGULARITY_FORMS = (
    "sine:wavelength_mm=30,amplitude_um=25[,phase_deg=90] (a cosine), chord:length_mm=40,"
    " haversine:length_mm=52,depth_mm=0.4, or table:FILE,distance=mm,opening=um"
)
_LENGTH_UNITS_MM = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1e3}
_ANGLE_UNITS_RAD = {"deg": math.pi / 180.0, "rad": 1.0}
_MAX_BYTES = 20_000_000


def parse_irregularity(text: str) -> Irregularity:
    """Read an irregularity from a text.

    Parameters
    ----------
    text
        A kind with its quantities, as in `IRREGULARITY_FORMS`.

    Returns
    -------
    Irregularity
        With lengths in mm.

    Raises
    ------
    InputError
        For an unknown kind, quantity or unit, or an unreadable table.

    Examples
    --------
    >>> parse_irregularity("sine:wavelength_mm=30,amplitude_um=25").amplitude_mm
    0.025
    """
    kind, _, rest = text.strip().partition(":")
    fields = [field for field in rest.split(",") if field.strip()]
    if kind == "table":
        fields[:1] = [f"file={field.strip()}" for field in fields[:1]]
    pairs = (field.partition("=") for field in fields)
    return read_irregularity({"kind": kind, **{name.strip(): value.strip() for name, _, value in pairs}})


def read_irregularity(value: Any) -> Irregularity:
    """Read an irregularity from a text or a mapping.

    Parameters
    ----------
    value
        An irregularity, a text, or a mapping with a `kind` and quantities with units in their names.

    Returns
    -------
    Irregularity
        With lengths in mm.

    Raises
    ------
    InputError
        As in `parse_irregularity` and `read_irregularity_table`.
    """
    if isinstance(value, Irregularity):
        return value
    if isinstance(value, str):
        return parse_irregularity(value)
    if not isinstance(value, dict) or "kind" not in value:
        raise InputError(f"irregularity is {value!r}; allowed: {IRREGULARITY_FORMS}, or a mapping with the key kind")
    inputs_of_kind = {name: quantity_value for name, quantity_value in value.items() if name != "kind"}
    if value["kind"] == "table":
        if unknown := inputs_of_kind.keys() - {"file", "distance", "opening"}:
            raise InputError(
                f"irregularity table: unknown {', '.join(sorted(unknown))}; allowed: file, distance, opening"
            )
        if not inputs_of_kind.get("file"):
            raise InputError(f"irregularity table: file is missing; allowed: {IRREGULARITY_FORMS}")
        return read_irregularity_table(
            inputs_of_kind["file"],
            distance_unit=inputs_of_kind.get("distance"),
            opening_unit=inputs_of_kind.get("opening"),
        )
    quantities: dict[str, Any] = dict(
        convert_quantity(name, quantity_value) for name, quantity_value in inputs_of_kind.items()
    )
    return Irregularity(kind=value["kind"], **quantities)


def format_irregularity(value: Irregularity) -> str:
    """Text of an irregularity.

    Parameters
    ----------
    value
        An irregularity with lengths in mm.

    Returns
    -------
    text
        A kind with its quantities. For a table only the number of its points and its ends.
    """
    if value.kind == "table":
        first, last = value.points_mm[0][0], value.points_mm[-1][0]
        return f"table of {len(value.points_mm)} points from {first:g} to {last:g} mm"
    quantities = {name: getattr(value, name) for name in _LENGTH_INPUTS}
    if value.phase_rad:
        quantities["phase_rad"] = value.phase_rad
    return f"{value.kind}:" + ",".join(
        f"{name}={amount:.12g}" for name, amount in quantities.items() if amount is not None
    )


def convert_quantity(name: str, value: Any) -> tuple[str, float]:
    """Convert a quantity of a file to internal units.

    Parameters
    ----------
    name
        Name in the file, which ends in a unit.
    value
        A number, or its text.

    Returns
    -------
    name, value
        Name and value in mm or rad.

    Raises
    ------
    InputError
        For an unknown name or unit, or a value that is not a number.
    """
    stem, _, unit = name.rpartition("_")
    units = _ANGLE_UNITS_RAD if stem == "phase" else _LENGTH_UNITS_MM
    if (stem != "phase" and f"{stem}_mm" not in _LENGTH_INPUTS) or unit not in units:
        names = {name: name for name in (*_LENGTH_INPUTS, "phase_deg")}
        raise InputError(
            f"irregularity: {name or 'an empty item'} is not a known quantity; allowed: {', '.join(names)}, also in"
            f" um, cm and m{suggest_name(name, names)}"
        )
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"irregularity: {name} is {value!r}; allowed: a number") from None
    return f"{stem}_{'rad' if stem == 'phase' else 'mm'}", number * units[unit]


def read_irregularity_table(
    path: str | Path, *, distance_unit: str | None = None, opening_unit: str | None = None
) -> Irregularity:
    """Read a measured irregularity from a text of two columns.

    The columns are the distance and the opening (missing material positive). Blanks, commas, semicolons or tabs
    separate them. With semicolons or tabs, numbers can have decimal commas.

    Parameters
    ----------
    path
        Text file of at most 20 MB.
    distance_unit, opening_unit
        Units of both columns; None to take them from the heading, such as `s_m,e_um`.

    Returns
    -------
    Irregularity
        A table in mm.

    Raises
    ------
    InputError
        If the file cannot be read, has no units, too few points, gaps or steps.
    """
    lines = _read_rows(Path(path))
    heading = lines[0] if lines and _parse_numbers(lines[0]) is None else None
    rows = [_parse_numbers(line) for line in (lines[1:] if heading else lines)]
    bad_row = next((number for number, row in enumerate(rows, 1) if row is None or len(row) < 2), None)
    if bad_row is not None or not rows or (heading and len(heading) < 2):
        raise InputError(
            f"{path}: row {bad_row or 1} is not a pair of numbers; give distance and opening in two columns"
        )
    units = [
        _unit_factor(column_unit, heading, column, str(path))
        for column, column_unit in enumerate((distance_unit, opening_unit))
    ]
    points = tuple((row[0] * units[0], row[1] * units[1]) for row in rows if row)
    try:
        return Irregularity(kind="table", points_mm=points)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read_rows(path: Path) -> list[list[str]]:
    """Cells of the non-empty rows of a text file, without comments.

    Raises
    ------
    InputError
        If there is no such file, it is too large, cannot be read or is empty.
    """
    # the command line imports this module at its start
    from fecontact.files import path_exists
    from fecontact.inputs.table_files import decode_text

    try:
        if not path_exists(path) or not path.is_file() or path.stat().st_size > _MAX_BYTES:
            raise InputError(f"{path}: there is no file of at most {_MAX_BYTES / 1e6:g} MB here; check the path")
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error}); give a text file with two columns") from None
    text = decode_text(content, str(path))
    rows = [line for raw in text.splitlines() if (line := re.sub(r"[#!%].*", "", raw).strip())]
    if not rows:
        raise InputError(f"{path}: the file is empty; give distance and opening in two columns")
    separator = next((character for character in ";\t," if character in rows[-1]), None)
    return [line.split() for line in rows] if separator is None else _split_rows(rows, separator, path)


def _split_rows(rows: Sequence[str], separator: str, path: Path) -> list[list[str]]:
    """Cells of rows with a separator, with decimal points.

    Raises
    ------
    InputError
        If rows have different numbers of cells: a decimal comma may separate cells by mistake.
    """
    cells_of_rows: list[list[str]] = []
    for row in rows:
        try:
            (cells,) = csv.reader([row], delimiter=separator, strict=True)
        except csv.Error as error:
            raise InputError(
                f"{path}: the row {row[:60]!r} cannot be divided into cells ({error}); correct the row"
            ) from None
        while cells and not cells[-1].strip():
            cells.pop()
        cells_of_rows.append(cells if separator == "," else [cell.replace(",", ".") for cell in cells])
        if len(cells) != len(cells_of_rows[0]):
            raise InputError(
                f"{path}: the row {row[:60]!r} has {count_text(len(cells), 'cell')}, and the first row"
                f" has {len(cells_of_rows[0])};"
                " give equal numbers of cells, and separate numbers with decimal commas by semicolons"
            )
    return cells_of_rows


def _parse_numbers(row: list[str]) -> list[float] | None:
    """The first two cells of a row as numbers; None if a cell is not a number."""
    try:
        return [float(cell) for cell in row[:2]]
    except ValueError:
        return None


def _unit_factor(column_unit: str | None, heading: list[str] | None, column: int, path: str) -> float:
    """Factor to mm of a column, from its unit or the heading.

    Parameters
    ----------
    column_unit
        Unit of the column; None to read it from the ending of the heading.
    heading
        Headings of all columns; None without a heading.
    column
        Index of the column: 0 for the distance, 1 for the opening.
    path
        File for the message of an error.

    Raises
    ------
    InputError
        If there is no unit, or if the unit is not a length in `_LENGTH_UNITS_MM`.
    """
    name = ("distance", "opening")[column]
    heading_unit = re.search(r"[\[(_ ](mm|um|µm|cm|m)[\])]?$", heading[column].strip()) if heading else None
    unit = column_unit or (heading_unit[1].replace("µ", "u") if heading_unit else None)
    if unit is None:
        raise InputError(
            f"{path}: the unit of column {name} is missing; give {name}=mm, um, cm or m, or the heading {name}_mm"
        )
    if unit not in _LENGTH_UNITS_MM:
        sizes = ", ".join(f"1 {name} is {factor:g} mm" for name, factor in _LENGTH_UNITS_MM.items())
        raise InputError(
            f"{path}: the unit of column {name} is {unit!r}; allowed: {', '.join(_LENGTH_UNITS_MM)} ({sizes})"
        )
    return _LENGTH_UNITS_MM[unit]
