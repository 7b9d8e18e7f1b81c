"""Columns of numbers out of text files: separators, decimal signs, headers, units; what is certain is done and said."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import FARTHEST_MM, Kind
from fecontact.profiles.points import FEWEST_POINTS, Points, counted
from fecontact.profiles.reading import MM, Reading, remedy
from fecontact.profiles.segments import Floats

_COMMENT = re.compile(r"\s*(?:#|!|%|//).*")
_COMMA_NUMBER = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?|[-+]?\d+")
_UNIT_IN_HEADER = re.compile(r"[\[(_ ](mm|m|cm|um|µm|in|inch|inches)[\])]?$", re.IGNORECASE)
# Longer files are no profiles: an instrument with 0.01 mm steps gives 20,000 points.
_MOST_BYTES = 20_000_000
_MOST_HEADER_LINES = 40
_SHOWN = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Two columns of a file in the unit of the file, and what had to be said about them."""

    y: Floats
    z: Floats
    unit: str | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where columns come from: its name in messages, the profile that is wanted, and what is known beside it."""

    what: str
    kind: Kind
    reading: Reading

    def remedy(self, key: str, value: str) -> str:
        """The exact option that settles a question about it."""
        return remedy(self.kind, key, value)


def read_columns(path: Path, kind: Kind, reading: Reading) -> Points:
    """Points from a text file of columns, y and z.

    Columns may be separated by blanks, tabs, commas or semicolons; what follows # ! % or // is a comment, and the first
    lines may be a header. The axes are those of the library: y positive to the field side, z up; a rail has its crown
    and a wheel its tape circle at (0, 0). `reading` says what is otherwise.

    Raises
    ------
    InputError
        The file cannot be read, or is not two columns of numbers.
    """
    return points_of_columns(read_text(path), path.stem, Source(what=str(path), kind=kind, reading=reading))


def points_of_columns(text: str, name: str, source: Source) -> Points:
    """Points of a text of columns, as `read_columns` reads them from a file."""
    table = columns_of(text, source)
    points, notes = in_mm(table.y, table.z, table.unit, source.reading)
    return Points(points=points, kind=source.kind, name=name, source=source.what, notes=(*table.notes, *notes))


def file_bytes(path: Path) -> bytes:
    """Content of a regular file of a size that a profile can have.

    Raises
    ------
    InputError
        It is a device or a pipe, which may never end, it is too large, or it cannot be read.
    """
    try:
        size = path.stat().st_size
        if not (path.is_file() or path.is_dir()):
            raise InputError(f"cannot read {shown(path)}: it is a device or a pipe; give the path of a file")
        if size > _MOST_BYTES:
            raise InputError(f"{path} has {size / 1e6:.0f} MB; allowed: {_MOST_BYTES / 1e6:.0f} MB; it is no profile")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {shown(path)}: {getattr(error, 'strerror', error)}; check the path") from None


def read_text(path: Path) -> str:
    """Text of a file, in UTF-8 or an older encoding.

    Raises
    ------
    InputError
        It cannot be read, or is no text.
    """
    data = file_bytes(path)
    if b"\0" in data:
        raise InputError(f"{path} is not plain text (a table file or UTF-16?); save it as text of two columns")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # comments in an older encoding; the numbers are checked below
        return data.decode("latin-1")


def shown(text: object) -> str:
    """A text that a user gave, at a length that a message can have."""
    whole = str(text)
    return whole if len(whole) <= 200 else f"{whole[:120]}... ({len(whole)} characters)"


def columns_of(text: str, source: Source) -> Table:
    """Columns y and z of a text.

    Raises
    ------
    InputError
        The text is not two columns of numbers, or may be read in several ways; with the option that settles it.
    """
    lines = _numbered(text)
    comma = _has_decimal_commas([line for _, line in lines], source.reading)
    table = _rows(lines, source, comma=comma)
    return replace(table, notes=(*(("decimal commas",) if comma else ()), *table.notes))


def _numbered(text: str) -> list[tuple[int, str]]:
    stripped = ((number, _COMMENT.sub("", raw).strip()) for number, raw in enumerate(text.splitlines(), start=1))
    return [(number, line) for number, line in stripped if line]


def _has_decimal_commas(lines: Sequence[str], reading: Reading) -> bool:
    """Whether commas are decimal signs for sure: something else separates the fields, and each has one at most."""
    if reading.decimal is not None:
        return reading.decimal == "comma"
    numeric = [line for line in lines if re.match(r"[-+]?[\d.,]", line)]
    with_commas = [line for line in numeric if "," in line]
    if not with_commas or any("." in line for line in numeric):
        return False
    fields = [_split(line, comma=True) for line in with_commas]
    return all(len(row) > 1 and all(_COMMA_NUMBER.fullmatch(field) for field in row) for row in fields)


def _split(line: str, *, comma: bool) -> list[str]:
    separator = r"\s*;\s*|\s+" if comma else r"\s*[,;]\s*|\s+"
    return re.split(separator, line.rstrip("; \t" if comma else ",; \t"))


def _number(field: str, *, comma: bool) -> float | None:
    # float() takes underscores and other scripts' digits as well, which no instrument writes
    if not field.isascii() or "_" in field:
        return None
    try:
        return float(field.replace(",", ".") if comma else field)
    except ValueError:
        return None


def _rows(lines: list[tuple[int, str]], source: Source, *, comma: bool) -> Table:
    header, rest = _header(lines, comma=comma)
    notes = [] if len(header) < 2 else [f"{len(header)} lines of header left out"]
    names = header[-1] if header else ""
    if rest and (count := _count_line(rest, comma=comma)):
        rest = rest[1:]
        notes.append(f"the first line, {count}, is the number of points")
    if not rest:
        raise InputError(f"{source.what}: no numbers; the file needs at least {FEWEST_POINTS} lines of y and z in mm")
    chosen = _chosen(rest[0], names, source, comma=comma)
    if len(first := _split(rest[0][1], comma=comma)) > 2 and source.reading.columns is None:
        notes.append(f"of {len(first)} columns those named {_title(names, chosen[0])} and {_title(names, chosen[1])}")
    known = source.reading.units
    rows = []
    for number, line in rest:
        fields, where = _split(line, comma=comma), f"{source.what}, line {number}"
        if len(fields) != len(first):
            raise InputError(
                f"{where}: {counted(len(fields), 'column')} instead of {len(first)} in {line[:_SHOWN]!r}; make all"
                " lines alike, and start comments with #"
            )
        rows.append(_pair([fields[column] for column in chosen], where, line, comma=comma))
    values = np.array(rows)
    unit = known or _unit_of(names, chosen)
    if unit is not None and known is None and unit != "mm":
        notes.append(f"unit {unit} from the header")
    return Table(y=values[:, 0], z=values[:, 1], unit=unit, notes=tuple(notes))


def _header(lines: list[tuple[int, str]], *, comma: bool) -> tuple[list[str], list[tuple[int, str]]]:
    """Lines before the first one of which a field is a number, and the lines from there."""
    for i, (_, line) in enumerate(lines[: _MOST_HEADER_LINES + 1]):
        if all(_number(field, comma=comma) is not None for field in _split(line, comma=comma)):
            return [text for _, text in lines[:i]], lines[i:]
    # no line is all numbers: the first one that has some says what is wrong
    for i, (_, line) in enumerate(lines[: _MOST_HEADER_LINES + 1]):
        if any(_number(field, comma=comma) is not None for field in _split(line, comma=comma)):
            return [text for _, text in lines[:i]], lines[i:]
    return [], []


def _count_line(rest: list[tuple[int, str]], *, comma: bool) -> int:
    first = _split(rest[0][1], comma=comma)
    if len(first) != 1 or not first[0].isascii() or not first[0].isdigit() or len(first[0]) > 8:
        return 0
    return int(first[0]) if int(first[0]) == len(rest) - 1 else 0


def _title(names: str, column: int) -> str:
    titles = _titles(names)
    return repr(titles[column]) if column < len(titles) else f"number {column + 1}"


def _titles(names: str) -> list[str]:
    # a unit belongs to the name before it
    joined = re.sub(r"\s+(?=[\[(])", "_", names)
    return [title for title in re.split(r"\s*[,;]\s*|\s+", joined.strip(" ,;\t\"'")) if title]


def _stem(title: str) -> str:
    return _UNIT_IN_HEADER.sub("", title.strip("\"'")).strip("_ ").lower()


def _chosen(first: tuple[int, str], names: str, source: Source, *, comma: bool) -> tuple[int, int]:
    """Which two columns are y and z."""
    reading, count = source.reading, len(_split(first[1], comma=comma))
    stems = [_stem(title) for title in _titles(names)]
    if reading.columns is not None:
        wanted = [part.strip().lower() for part in reading.columns.split(",")]
        found = [
            int(part) - 1 if part.isdigit() and len(part) < 4 else stems.index(part) if part in stems else -1
            for part in wanted
        ]
        if len(found) != 2 or found[0] == found[1] or not all(0 <= column < count for column in found):
            raise InputError(
                f"{source.what}: columns {shown(reading.columns)!r} are not two of the {counted(count, 'column')}"
                f"{' ' + ', '.join(stems[:12]) if stems else ''}; give two numbers from 1 to {count}, such as"
                f" --{source.kind}-columns 1,2"
            )
        return found[0], found[1]
    if count == 2:
        return (1, 0) if stems[:2] == ["z", "y"] else (0, 1)
    if len(stems) == count and stems.count("y") == 1 and stems.count("z") == 1:
        return stems.index("y"), stems.index("z")
    number, line = first
    if "," in line and not comma and count in (3, 4) and reading.decimal is None and "." not in line:
        raise InputError(
            f"{source.what}, line {number}: {line[:_SHOWN]!r} may have decimal commas, or {count} columns;"
            f" {source.remedy('decimal', 'comma')}, or {source.remedy('columns', '1,2')}"
        )
    raise InputError(
        f"{source.what}, line {number}: {counted(count, 'column')} instead of 2 in {line[:_SHOWN]!r}; say which are y"
        f" and z: {source.remedy('columns', '2,3')}"
    )


def _pair(fields: list[str], where: str, line: str, *, comma: bool) -> list[float]:
    pair = [value for field in fields if (value := _number(field, comma=comma)) is not None]
    if len(pair) < 2:
        raise InputError(f"{where}: {line[:_SHOWN]!r} is not two numbers; start comments with #")
    if not np.isfinite(sum(pair)):
        raise InputError(f"{where}: {line[:_SHOWN]!r} is not finite; remove the line")
    return pair


def _unit_of(names: str, chosen: tuple[int, int]) -> str | None:
    titles = _titles(names)
    if max(chosen) >= len(titles):
        return None
    found = {match[1].lower() for column in chosen if (match := _UNIT_IN_HEADER.search(titles[column].strip("\"'")))}
    unit = found.pop() if len(found) == 1 else None
    if unit is None:
        return None
    return {"µm": "um", "inch": "in", "inches": "in"}.get(unit, unit)


def in_mm(y: Floats, z: Floats, unit: str | None, reading: Reading) -> tuple[Floats, list[str]]:
    """Points (n, 2) in mm with the signs that are asked for, and what was done."""
    factor = MM[unit or "mm"]
    notes = [] if factor == 1.0 else [f"turned from {unit} into mm"]
    if reading.mirror:
        notes.append("mirrored: the sign of y is turned")
    if reading.flip_z:
        notes.append("the sign of z is turned")
    # far beyond what is allowed for mm, but finite when it is multiplied
    wide = 1e12 * FARTHEST_MM
    points = np.clip(np.column_stack((y, z)), -wide, wide) * factor
    return points * (-1.0 if reading.mirror else 1.0, -1.0 if reading.flip_z else 1.0), notes
