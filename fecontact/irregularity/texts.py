"""An irregularity as a text, such as `sine:wavelength_mm=30,amplitude_um=25`, and as a table of a file."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.inputs.texts import nearest
from fecontact.irregularity.shapes import Irregularity

FORMS = (
    "sine:wavelength_mm=30,amplitude_um=25[,phase_deg=90], chord:length_mm=40, haversine:length_mm=52,depth_mm=0.4, or"
    " table:FILE,distance=mm,opening=um"
)
_UNITS = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1e3}
_ANGLES = {"deg": math.pi / 180.0, "rad": 1.0}
_STEMS = ("wavelength", "amplitude", "length", "depth", "phase")
_MOST_BYTES = 20_000_000


def parse_irregularity(text: str) -> Irregularity:
    """The irregularity of a text.

    Raises
    ------
    InputError
        For a kind, a quantity or a unit that there is not, or a table that cannot be read.
    """
    kind, _, rest = text.strip().partition(":")
    items = [item.strip() for item in rest.split(",") if item.strip()]
    if kind == "table":
        return _table_of_text(items)
    values: dict[str, Any] = {}
    for item in items:
        name, _, value = item.partition("=")
        values |= quantity(name.strip(), value.strip())
    return Irregularity(kind=kind, **values)  # type: ignore[arg-type]


def irregularity_of(value: Any) -> Irregularity:
    """The irregularity of a text, or of a table of a file with a `kind` and quantities with units in their names.

    Raises
    ------
    InputError
        As `parse_irregularity` and `read_table` do.
    """
    if isinstance(value, Irregularity):
        return value
    if isinstance(value, str):
        return parse_irregularity(value)
    if not isinstance(value, dict) or "kind" not in value:
        raise InputError(f"irregularity is {value!r}; allowed: {FORMS}, or a table with a kind")
    rest = {name: one for name, one in value.items() if name != "kind"}
    if value["kind"] == "table":
        unknown = rest.keys() - {"file", "distance", "opening"}
        if unknown or not rest.get("file"):
            told = ", ".join(sorted(unknown)) or "file is missing"
            raise InputError(f"irregularity table: {told}; it has file, distance and opening")
        return read_table(rest["file"], distance_unit=rest.get("distance"), opening_unit=rest.get("opening"))
    values: dict[str, Any] = {}
    for name, one in rest.items():
        values |= quantity(name, one)
    return Irregularity(kind=value["kind"], **values)


def irregularity_text(value: Irregularity) -> str:
    """An irregularity as a text; of a table how many points it has, for they are not a text."""
    if value.kind == "table":
        first, last = value.points_mm[0][0], value.points_mm[-1][0]
        return f"table of {len(value.points_mm)} points from {first:g} to {last:g} mm"
    given = {name: getattr(value, name) for name in ("wavelength_mm", "amplitude_mm", "length_mm", "depth_mm")}
    if value.phase_rad:
        given["phase_rad"] = value.phase_rad
    return f"{value.kind}:" + ",".join(f"{name}={one:.12g}" for name, one in given.items() if one is not None)


def quantity(name: str, value: Any) -> dict[str, float]:
    """A quantity of an irregularity by the name it has in files, which ends in its unit, in the unit inside."""
    stem, _, unit = name.rpartition("_")
    units = _ANGLES if stem == "phase" else _UNITS
    if stem not in _STEMS or unit not in units:
        known = {
            f"{one}_{'deg' if one == 'phase' else 'mm'}": f"{one}_{'deg' if one == 'phase' else 'mm'}" for one in _STEMS
        }
        raise InputError(
            f"irregularity: {name or 'an empty item'} is none of its quantities; allowed: {', '.join(known)}, also in"
            f" um, cm and m{nearest(name, known)}"
        )
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"irregularity: {name} is {value!r}; allowed: a number") from None
    return {f"{stem}_{'rad' if stem == 'phase' else 'mm'}": number * units[unit]}


def _table_of_text(items: list[str]) -> Irregularity:
    if not items:
        raise InputError(f"irregularity table: no file is given; allowed: {FORMS}")
    options = dict(item.partition("=")[::2] for item in items[1:])
    if unknown := options.keys() - {"distance", "opening"}:
        raise InputError(f"irregularity table: {', '.join(sorted(unknown))}; allowed: distance=UNIT and opening=UNIT")
    return read_table(items[0], distance_unit=options.get("distance"), opening_unit=options.get("opening"))


def read_table(path: str | Path, *, distance_unit: str | None = None, opening_unit: str | None = None) -> Irregularity:
    """A measured irregularity from a text of two columns, the distance and the opening (missing material positive).

    Units are those in the heading, such as `s_m,e_um`, or are given; they are asked for where neither says them.

    Raises
    ------
    InputError
        If it cannot be read, has no units, too few points, gaps or steps.
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
    """Factor to mm of a column, from what is said of it or its heading."""
    name = ("distance", "opening")[column]
    found = re.search(r"[\[(_ ](mm|um|µm|cm|m)[\])]?$", heading[column].strip()) if heading else None
    unit = given or (found[1].replace("µ", "u") if found else None)
    if unit is None:
        raise InputError(
            f"{path}: the unit of its {name} is not said; give {name}=mm, um, cm or m, or head it {name}_mm"
        )
    if unit not in _UNITS:
        raise InputError(f"{path}: the unit of its {name} is {unit!r}; allowed: {', '.join(_UNITS)}: {_shown(_UNITS)}")
    return _UNITS[unit]


def _shown(units: Mapping[str, float]) -> str:
    return ", ".join(f"1 {unit} is {factor:g} mm" for unit, factor in units.items())
