"""Columns of numbers out of text files: tables of coordinates, and the files of MiniProf and SIMPACK."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from pathlib import Path

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import LARGEST_COORDINATE_MM, Kind, check_size
from fecontact.profiles.points import FEWEST_POINTS, Points, drop_close_points, format_count
from fecontact.profiles.reading import MM, Reading, remedy

_COMMENT = re.compile(r"\s*(?:#|!|%|//).*")
_COMMA_NUMBER = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?|[-+]?\d+")
_PAIR_WITH_COMMAS = re.compile(r"([-+]?\d+,\d+)\s*,\s*([-+]?\d+,\d+)")
_UNIT_IN_HEADER = re.compile(r"[\[(_ ](mm|m|cm|um|µm|in|inch|inches)[\])]?$", re.IGNORECASE)
# Longer files are no profiles: an instrument with 0.01 mm steps gives 20,000 points.
_LARGEST_FILE_BYTES = 20_000_000
_LARGEST_HEADER_LINES = 40
_LETTERS_SHOWN = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Two columns of a file in the unit of the file, and what had to be said about them.

    `columns` are their numbers with the sign of z turned, as a user would ask for them.
    """

    y: Floats
    z: Floats
    unit: str | None = None
    notes: tuple[str, ...] = ()
    columns: str = "1,-2"


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where columns come from: its name in messages, the profile that is wanted, and what is known beside it."""

    what: str
    kind: Kind
    reading: Reading

    def remedy(self, key: str, value: str | float) -> str:
        """The exact option that settles a question about it."""
        return remedy(self.kind, key, value)


def read_columns(path: Path, kind: Kind, reading: Reading) -> Points:
    """Points from a text file of columns, y and z.

    Columns may be separated by blanks, tabs, commas or semicolons; what follows # ! % or // is a comment, and the first
    lines may be a header. The axes are the library's: y positive to the field side, z up; a rail has its crown
    and a wheel its tape circle at (0, 0). `reading` says what is otherwise.

    Raises
    ------
    InputError
        The file cannot be read, or is not two columns of numbers.
    """
    return parse_points(read_text(path), path.stem, Source(what=str(path), kind=kind, reading=reading))


def parse_points(text: str, name: str, source: Source) -> Points:
    """Points of a text of columns, as `read_columns` reads them from a file."""
    table = columns_of(text, source)
    points, notes = convert_to_mm(table.y, table.z, table.unit, source)
    said = (*table.notes, *notes)
    return Points(
        points=points, kind=source.kind, name=name, source=source.what, notes=said, flipped_columns=table.columns
    )


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
            raise InputError(f"cannot read {shorten_text(path)}: it is a device or a pipe; give the path of a file")
        if size > _LARGEST_FILE_BYTES:
            raise InputError(
                f"{path} has {size / 1e6:.0f} MB; allowed: {_LARGEST_FILE_BYTES / 1e6:.0f} MB; it is no profile"
            )
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read {shorten_text(path)}: {getattr(error, 'strerror', error)}; check the path"
        ) from None


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


def shorten_text(text: object) -> str:
    """A text that a user gave, at a length that a message can have."""
    whole = str(text)
    return whole if len(whole) <= 200 else f"{whole[:120]}... ({len(whole)} characters)"


def columns_of(text: str, source: Source, *, names: str = "", unnamed: bool = False) -> Table:
    """Columns y and z of a text.

    Parameters
    ----------
    text
        Numbers in lines, perhaps below a header.
    source
        Where they come from.
    names
        Of the columns, where the header does not have them.
    unnamed
        Whether the first two of more columns are y and z where nothing names them.

    Raises
    ------
    InputError
        The text is not two columns of numbers, or may be read in several ways; with the option that settles it.
    """
    lines = _number_lines(text)
    comma = _has_decimal_commas([line for _, line in lines])
    if source.reading.columns is None and _are_pairs_with_commas(lines):
        lines, comma = [(number, _PAIR_WITH_COMMAS.sub(r"\1;\2", line)) for number, line in lines], True
    header, rest = _separate_header(lines, comma=comma)
    notes = ["decimal commas"] if comma else []
    if len(header) > 1:
        notes.append(f"{len(header)} lines of header left out")
    names = names or (header[-1] if header else "")
    if rest and (count := _read_point_count(rest, comma=comma)):
        rest = rest[1:]
        notes.append(f"the first line, {count}, is the number of points")
    if not rest:
        raise InputError(f"{source.what}: no numbers; the file needs at least {FEWEST_POINTS} lines of y and z in mm")
    rows = [_split_fields(line, comma=comma) for _, line in rest]
    width = len(rows[0])
    chosen, signs = _choose_columns(rest[0], rows, names, source, unnamed=unnamed)
    if width > 2 and source.reading.columns is None:
        notes.append(
            f"of {width} columns those named {_name_column(names, chosen[0])} and {_name_column(names, chosen[1])}"
        )
    values, remarks = [], []
    for (number, line), fields in zip(rest, rows, strict=True):
        where = f"{source.what}, line {number}"
        if len(fields) > width and fields[width][:1].isalpha() and _parse_number(fields[width], comma=comma) is None:
            remarks.append(number)
        elif len(fields) != width:
            raise InputError(
                f"{where}: {format_count(len(fields), 'column')} instead of {width} in {line[:_LETTERS_SHOWN]!r}; "
                "make all"
                " lines alike, and start comments with #"
            )
        values.append(_parse_pair([fields[column] for column in chosen], where, line, comma=comma))
    if remarks:
        notes.append(
            f"what is written behind the numbers of line {remarks[0]} left out"
            + (f", and of {len(remarks) - 1} more" if len(remarks) > 1 else "")
        )
    unit = source.reading.units or _read_column_unit(names, chosen)
    if unit not in (None, "mm", source.reading.units):
        notes.append(f"unit {unit} from the header")
    notes += [f"the sign of {axis} is turned" for axis, sign in zip("yz", signs, strict=True) if sign < 0]
    y, z = (np.array(values) * signs).T
    asked = [f"{'-' if sign < 0 else ''}{k + 1}" for k, sign in zip(chosen, (signs[0], -signs[1]), strict=True)]
    return Table(y=y, z=z, unit=unit, notes=tuple(notes), columns=",".join(asked))


def _number_lines(text: str) -> list[tuple[int, str]]:
    stripped = ((number, _COMMENT.sub("", raw).strip()) for number, raw in enumerate(text.splitlines(), start=1))
    return [(number, line) for number, line in stripped if line]


def _has_decimal_commas(lines: Sequence[str]) -> bool:
    """Whether commas are decimal signs for sure: something else separates the fields, and each has one at most."""
    numeric = [line for line in lines if re.match(r"[-+]?[\d.,]", line)]
    with_commas = [line for line in numeric if "," in line]
    if not with_commas or any("." in line for line in numeric):
        return False
    fields = [_split_fields(line, comma=True) for line in with_commas]
    return all(len(row) > 1 and all(_COMMA_NUMBER.fullmatch(field) for field in row) for row in fields)


def _are_pairs_with_commas(lines: Sequence[tuple[int, str]]) -> bool:
    """Whether each line of numbers is two numbers with decimal commas and a comma between them, as `1,5,-2,25`."""
    numeric = [line for _, line in lines if re.match(r"[-+]?\d", line)]
    return len(numeric) >= FEWEST_POINTS and all(map(_PAIR_WITH_COMMAS.fullmatch, numeric))


def _split_fields(line: str, *, comma: bool = False) -> list[str]:
    separator = r"\s*;\s*|\s+" if comma else r"\s*[,;]\s*|\s+"
    return re.split(separator, line.rstrip("; \t" if comma else ",; \t"))


def _parse_number(field: str, *, comma: bool = False) -> float | None:
    # float() takes underscores and other scripts' digits as well, which no instrument writes
    if not field.isascii() or "_" in field:
        return None
    try:
        return float(field.replace(",", ".") if comma else field)
    except ValueError:
        return None


def _separate_header(lines: list[tuple[int, str]], *, comma: bool) -> tuple[list[str], list[tuple[int, str]]]:
    """Lines before the first one of which a field is a number, and the lines from there."""
    # where no line is all numbers, the first one that has some says what is wrong
    for enough in (all, any):
        starts = [
            i
            for i, (_, line) in enumerate(lines[: _LARGEST_HEADER_LINES + 1])
            if enough(_parse_number(field, comma=comma) is not None for field in _split_fields(line, comma=comma))
        ]
        if starts:
            # numbers that stand among words, and are others than what follows, belong to the header
            words = (
                not (after == i + 1 or _has_equal_width(lines[i], lines[after], comma=comma))
                for i, after in pairwise(starts)
            )
            first = starts[len(list(takewhile(bool, words)))]
            return [text for _, text in lines[:first]], lines[first:]
    return [], []


def _has_equal_width(one: tuple[int, str], other: tuple[int, str], *, comma: bool) -> bool:
    return len(_split_fields(one[1], comma=comma)) == len(_split_fields(other[1], comma=comma))


def _read_point_count(rest: list[tuple[int, str]], *, comma: bool) -> int:
    first = _split_fields(rest[0][1], comma=comma)
    if len(first) != 1 or not first[0].isascii() or not first[0].isdigit() or len(first[0]) > 8:
        return 0
    return int(first[0]) if int(first[0]) == len(rest) - 1 else 0


def _name_column(names: str, column: int) -> str:
    titles = _split_titles(names)
    return repr(titles[column]) if column < len(titles) else f"number {column + 1}"


def _split_titles(names: str) -> list[str]:
    # a unit belongs to the name before it
    joined = re.sub(r"\s+(?=[\[(])", "_", names)
    return [title for title in re.split(r"\s*[,;]\s*|\s+", joined.strip(" ,;\t\"'")) if title]


def _strip_unit(title: str) -> str:
    return _UNIT_IN_HEADER.sub("", title.strip("\"'")).strip("_ ").lower()


def _choose_columns(
    first: tuple[int, str], rows: list[list[str]], names: str, source: Source, *, unnamed: bool
) -> tuple[tuple[int, int], tuple[float, float]]:
    """Which two columns are y and z, and the signs that they are to have."""
    reading, count = source.reading, len(rows[0])
    stems = [_strip_unit(title) for title in _split_titles(names)]
    if reading.columns is not None:
        wanted = [part.strip().lower() for part in reading.columns.split(",")]
        signs = [-1.0 if part.startswith("-") else 1.0 for part in wanted]
        found = [
            int(part) - 1 if part.isdigit() and len(part) < 4 else stems.index(part) if part in stems else -1
            for part in (part.removeprefix("-") for part in wanted)
        ]
        if len(found) != 2 or found[0] == found[1] or not all(0 <= column < count for column in found):
            raise InputError(
                f"{source.what}: columns {shorten_text(reading.columns)!r} are not two of the "
                f"{format_count(count, 'column')}"
                f"{' ' + ', '.join(stems[:12]) if stems else ''}; give two numbers from 1 to {count}, such as"
                f" --{source.kind}-columns 1,2"
            )
        return (found[0], found[1]), (signs[0], signs[1])
    if count == 2:
        return ((1, 0) if stems[:2] == ["z", "y"] else (0, 1)), (1.0, 1.0)
    if len(stems) == count and stems.count("y") == 1 and stems.count("z") == 1:
        return (stems.index("y"), stems.index("z")), (1.0, 1.0)
    if unnamed and count > 2:
        return (0, 1), (1.0, 1.0)
    number, line = first
    commas = "; decimal commas between commas: write points" if "," in line and "." not in line else ""
    raise InputError(
        f"{source.what}, line {number}: {format_count(count, 'column')} instead of 2 in {line[:_LETTERS_SHOWN]!r}; "
        "say which are y"
        f" and z: {source.remedy('columns', _guess_columns(rows))}{commas}"
    )


def _guess_columns(rows: list[list[str]]) -> str:
    """Two columns that may be coordinates: neither the same everywhere nor the number of the line."""
    columns = list(
        zip(*([_parse_number(field) for field in row] for row in rows if len(row) == len(rows[0])), strict=True)
    )
    likely = []
    for k, column in enumerate(columns, start=1):
        steps = {round(b - a, 9) for a, b in pairwise(column) if a is not None and b is not None}
        if not (steps <= {0.0} or steps <= {1.0}):
            likely.append(k)
    return "{},{}".format(*likely[:2]) if len(rows) > 1 and 2 <= len(likely) < len(columns) else "2,3"


def _parse_pair(fields: list[str], where: str, line: str, *, comma: bool) -> list[float]:
    pair = [value for field in fields if (value := _parse_number(field, comma=comma)) is not None]
    if len(pair) < 2:
        raise InputError(f"{where}: {line[:_LETTERS_SHOWN]!r} is not two numbers; start comments with #")
    if not np.isfinite(sum(pair)):
        raise InputError(f"{where}: {line[:_LETTERS_SHOWN]!r} is not finite; remove the line")
    return pair


def _read_column_unit(names: str, chosen: tuple[int, int]) -> str | None:
    titles = _split_titles(names)
    if max(chosen) >= len(titles):
        return None
    found = {match[1].lower() for column in chosen if (match := _UNIT_IN_HEADER.search(titles[column].strip("\"'")))}
    unit = found.pop() if len(found) == 1 else None
    if unit is None:
        return None
    return {"µm": "um", "inch": "in", "inches": "in"}.get(unit, unit)


def convert_to_mm(
    y: Floats, z: Floats, unit: str | None, source: Source, *, mirror: bool = False
) -> tuple[Floats, list[str]]:
    """Points (n, 2) in mm from the tape circle with the signs that are asked for, and what was done.

    `mirror` says that a file of this kind has the line turned over.
    """
    reading, factor = source.reading, MM[unit or "mm"]
    notes = [] if factor == 1.0 else [f"turned from {unit} into mm"]
    at = reading.tape_circle_mm or 0.0
    if at:
        notes.append(f"the tape circle at y = {at:g} mm of the file is y = 0")
    if reading.mirror:
        notes.append("as the file has it: not mirrored" if mirror else "mirrored: the sign of y is turned")
    # far beyond what is allowed for mm, but finite when it is multiplied
    wide = 1e12 * LARGEST_COORDINATE_MM
    points = np.clip(np.column_stack((y, z)), -wide, wide) * factor - (at, 0.0)
    return points * (-1.0 if bool(reading.mirror) != mirror else 1.0, 1.0), notes


# --- Profiles of the MiniProf instrument, .ban (rail) and .whl (wheel): lines of a header, and columns of numbers.
#
# The columns are named by `ColumnDef` (X across, Y into the depth of the body, then angle, curvature and more that a
# profile does not need). Files of the instrument (MiniProf for Windows 2.43 and MiniProf 2020) and of programs that
# write its format, all in the test bank of CONTACT by Vtech CMCC (testbank/profiles), have
#
# - a wheel's X from the back of the flange to the field side, with the tape circle at `WheelDiameterTaperline` (70 mm)
#   if the header says so, its Y growing towards the tip of the flange;
# - a rail's X growing to the centre of the track, in all of avg_low2.ban (whose last line says which side is the gauge
#   face), rail_left_iter288.ban and others; CONTACT's manual says that they usually need mirror_y = 1;
# - lengths in mm; `Xoffset` and `Yoffset`, which CONTACT adds to the points; a blank line before the points, or none.
#
# Y grows downwards in some and upwards in others: the shape of the line says which.

_MINIPROF_KEY = re.compile(r"([A-Za-z][A-Za-z0-9_. ]*?)\s*=\s*(.*)")
# A key that only this format has, or the first line of files with a header in words instead of keys.
_MINIPROF_MARK = re.compile(
    r'^\s*"?(?:ColumnDef|MPTypeNo|MPSerNo|XYPoints)\s*=|\A#\s*MINI\w*PROF', re.IGNORECASE | re.MULTILINE
)
_OFFSET_KEYS = (("xoffset", "xoff"), ("yoffset", "yoff"))
_ALIGNMENT_KEYS = ("aligndx", "aligndy", "alignda")
_KIND_BY_SUFFIX: dict[str, Kind] = {".ban": "rail", ".whl": "wheel"}
_TAPERLINE_KEY = "wheeldiametertaperline"
# Where the tip of a flange lies over the back of the flange (mm): 15.5 mm on the S1002.
_TIP_OVER_BACK_MM = (5.0, 30.0)
_ALLOWED_TAPE_CIRCLE_MM = (40.0, 100.0)
# How much of a head beside each of its ends says where down is.
_BESIDE_END_MM = 15.0


def is_miniprof(path: Path) -> bool:
    """Whether a file has a header of the MiniProf instrument, whatever its ending."""
    try:
        with path.open("rb") as file:
            return _MINIPROF_MARK.search(file.read(20_000).decode("latin-1")) is not None
    except (OSError, ValueError):
        return False


def read_miniprof(path: Path, kind: Kind, reading: Reading) -> Points:
    """Points of a MiniProf file.

    Raises
    ------
    InputError
        The file cannot be read, or its header leaves open where the points lie; with the option that settles it.
    """
    keys, rest = _split_miniprof_keys(read_text(path))
    source = Source(what=str(path), kind=_KIND_BY_SUFFIX.get(path.suffix.lower(), kind), reading=reading)
    names = ""
    if (columns := keys.get("columndef")) is not None:
        given = [name.strip().lower() for name in columns.split(",")]
        if "x" not in given or "y" not in given or len(set(given)) != len(given):
            raise InputError(
                f"{path}: ColumnDef = {columns[:60]!r}; it has to name the columns X and Y, such as X,Y,A,C"
            )
        # X is y here, and Y is z until its sign is known; columns that are not named come last
        names = ",".join({"x": "y", "y": "z"}.get(name, f"_{name}") for name in given if name != "*")
        if "*" in given:
            names = names if given[:2] != ["x", "y"] else ""
    table = columns_of(rest, source, names=names, unnamed=True)
    y, z, moved = _add_offsets(table.y, table.z, keys, source)
    points, done = convert_to_mm(
        y, z, reading.units or _read_header_unit(keys, source), source, mirror=source.kind == "rail"
    )
    if points.size:
        # what follows knows lengths
        check_size(*points.T, kind=source.kind, what=str(path), unit=reading.units or "mm")
    points, turned = _turn_upwards(points, source)
    points, placed = _shift_to_tape_circle(points, keys, source)
    across = "X grows to the centre of the track: y is -X" if source.kind == "rail" else "X taken as y"
    said = (
        f"MiniProf file: {across}",
        *table.notes,
        *moved,
        *done,
        *turned,
        *placed,
        *_describe_diameter(keys, source),
    )
    return Points(
        points=points, kind=source.kind, name=path.stem, source=str(path), notes=said, flipped_columns=table.columns
    )


def _turn_upwards(points: Floats, source: Source) -> tuple[Floats, list[str]]:
    """z upwards, by the shape of the line: a head falls towards its ends, the tip of a flange is below the tread."""
    if len(points) < 3 or (source.reading.columns or "").partition(",")[2].strip().startswith("-"):
        return points, []
    y, z = points.T
    if source.kind == "rail":
        ends = [(z[end] - np.mean(z[np.abs(y - y[end]) < _BESIDE_END_MM])) for end in (0, -1)]
        down = sum(ends) > 0.0
    else:
        tread = float(np.median(z))
        down = float(z.max()) - tread > max(10.0, tread - float(z.min()))
    if down:
        return points * (1.0, -1.0), ["its Y grows into the body: z is -Y"]
    return points, ["its Y grows upwards: z is Y"]


def _shift_to_tape_circle(points: Floats, keys: dict[str, str], source: Source) -> tuple[Floats, list[str]]:
    """Points with y of a wheel from its tape circle, where the file has it from the back of the flange."""
    tip = float(points[np.argmin(points[:, 1]), 0]) if points.size else 0.0
    low, high = _TIP_OVER_BACK_MM
    if source.kind == "rail" or source.reading.tape_circle_mm is not None or not low <= tip <= high:
        return points, []
    at = _read_header_value(keys.get(_TAPERLINE_KEY, ""), "WheelDiameterTaperline", source)
    if not _ALLOWED_TAPE_CIRCLE_MM[0] <= at <= _ALLOWED_TAPE_CIRCLE_MM[1]:
        usual = -70.0 if source.reading.mirror else 70.0
        raise InputError(
            f"{source.what}: the tip of the flange lies at X = {tip:.1f} mm, so X begins at the back of the flange, and"
            f" the header does not say where the tape circle is; {source.remedy('tape_circle_mm', usual)} for the usual"
            " 70 mm from there"
        )
    said = f"X from the back of the flange: the tape circle at WheelDiameterTaperline = {at:g} mm is y = 0"
    return points - (at, 0.0), [said]


def _describe_diameter(keys: dict[str, str], source: Source) -> list[str]:
    """What the header says of the diameter at the tape circle, which belongs to the case."""
    diameter = _read_header_value(keys.get("diametertaperline", ""), "DiameterTaperline", source)
    if source.kind == "rail" or diameter <= 0.0:
        return []
    return [
        f"DiameterTaperline = {diameter:g} mm of the header is not applied: --rolling-radius-mm {0.5 * diameter:g}"
        " gives the wheel this radius"
    ]


def _split_miniprof_keys(text: str) -> tuple[dict[str, str], str]:
    """Keys in small letters, and the text after them with its lines in their places."""
    keys: dict[str, str] = {}
    lines = text.splitlines()
    rest = [""] * len(lines)
    for number, line in enumerate(lines):
        # a line may be quoted as a whole, a value be in quotes, or a remark in quotes follow it
        bare = line.strip()
        if _is_numbers(_strip_remark(bare)):
            # among the points a quote begins a remark
            rest[number:] = (one.partition('"')[0] for one in lines[number:])
            break
        if match := _MINIPROF_KEY.fullmatch(bare.strip('"') if bare.startswith('"') else bare):
            keys[match[1].lower()] = match[2].removeprefix('"').partition('"')[0].strip()
        else:
            rest[number] = line
    return keys, "\n".join(rest)


def _strip_remark(line: str) -> str:
    """A line without what it says in quotes behind its values; one that begins with a quote as it is."""
    return line if line.lstrip().startswith('"') else line.partition('"')[0]


def _is_numbers(line: str) -> bool:
    fields = _split_fields(_COMMENT.sub("", line).strip())
    return len(fields) > 1 and None not in map(_parse_number, fields)


def _read_header_unit(keys: dict[str, str], source: Source) -> str | None:
    unit = keys.get("units", keys.get("unit", "")).lower()
    if unit in MM or unit in ("", "metric"):
        return unit if unit in MM else None
    raise InputError(
        f"{source.what}: the header says Units = {unit[:40]!r}; known are {', '.join(MM)}:"
        f" {source.remedy('units', 'mm')}"
    )


def _add_offsets(y: Floats, z: Floats, keys: dict[str, str], source: Source) -> tuple[Floats, Floats, list[str]]:
    """The points with the offsets of the header, and what of it was not applied."""
    named = (*(key for both in _OFFSET_KEYS for key in both), *_ALIGNMENT_KEYS)
    values = {key: value for key in named if (value := _read_header_value(keys.get(key, ""), key, source)) != 0.0}
    along, up = (sum(values.get(key, 0.0) for key in both) for both in _OFFSET_KEYS)
    notes = [
        f"{key.upper()} = {value:g} of the header {'not applied' if key in _ALIGNMENT_KEYS else 'added'}"
        for key, value in values.items()
    ]
    return y + along, z + up, notes


def _read_header_value(text: str, key: str, source: Source) -> float:
    # a key of a form that was not filled in is none
    value = _parse_number(text or "0")
    if value is None or not abs(value) <= 1e6:
        raise InputError(
            f"{source.what}: {key.upper()} = {text[:40]!r} in the header; allowed: a number from -1e6 to 1e6"
        )
    return value


# --- Profiles of SIMPACK, .prr (rail) and .prw (wheel): blocks of keys, and the points of a spline.
#
# The numbers in the comments of such a file give the order in which the points are processed: points that are closer
# than `point.dist.min` are left out, then they are shifted, rotated, cut at the bounds, mirrored and reversed; lengths
# are in units of which `units.len.f` make a metre. z points down, and y of a wheel to its flange unless the file
# mirrors it. A third column is a weight, which means nothing for a line through the points.

_SIMPACK_BLOCK = re.compile(r"^\s*(header|spline)\.begin\s*(?:!.*)?$", re.MULTILINE)
_SIMPACK_KEY = re.compile(r"^\s*([a-z][a-z.]*[a-z])\s*=\s*('[^']*'|[^!\s]+)")
# The length unit in metres is 1 / units.len.f: 1000 for mm, 1 for m, 39.37 for inches.
_ALLOWED_LENGTH_FACTORS = (0.5, 2e6)
_KNOWN_KEYS = {
    *("version", "type", "approx.smooth", "file", "file.mtime", "comment", "point.dist.min", "shift.y", "shift.z"),
    *("rotate", "bound.y.min", "bound.y.max", "bound.z.min", "bound.z.max", "mirror.y", "mirror.z", "inversion"),
    *("units.len", "units.ang", "units.len.f", "units.ang.f", "table.nr"),
}


@dataclass(frozen=True, kw_only=True)
class _SimpackKeys:
    """Keys of a file, with the line that each stands in."""

    what: str
    values: dict[str, tuple[str, int]]

    def number(self, key: str, default: float) -> float:
        if key not in self.values:
            return default
        text, line = self.values[key]
        value = _parse_number(text)
        if value is None or not abs(value) <= 1e9:
            raise InputError(f"{self.what}, line {line}: {key} = {text[:60]}; allowed: a number from -1e9 to 1e9")
        return value

    def flag(self, key: str) -> bool:
        value = self.number(key, 0.0)
        if value not in (0.0, 1.0):
            line = self.values[key][1]
            raise InputError(f"{self.what}, line {line}: {key} = {value:g}; allowed: 0 and 1")
        return value == 1.0


def is_simpack(path: Path) -> bool:
    """Whether a file has SIMPACK's blocks."""
    try:
        with path.open("rb") as file:
            return _SIMPACK_BLOCK.search(file.read(20_000).decode("latin-1")) is not None
    except (OSError, ValueError):
        return False


def read_simpack(path: Path, reading: Reading) -> Points:
    """Points of a SIMPACK file.

    Raises
    ------
    InputError
        The file cannot be read, or is not what the format allows; the message names line and key.
    """
    what = str(path)
    keys, rows = _parse_simpack(read_text(path), what)
    kind: Kind = "wheel" if keys.flag("type@header") else "rail"
    if reading.columns not in (None, "1,2", "1,-2"):
        raise InputError(
            f"{what}: a SIMPACK file says itself what its columns are; leave out columns, or give 1,-2 to turn the sign"
            " of z"
        )
    table, notes = _process_points(keys, rows)
    turned = reading.columns == "1,-2"
    factor = keys.number("units.len.f", 1000.0)
    if not _ALLOWED_LENGTH_FACTORS[0] <= factor <= _ALLOWED_LENGTH_FACTORS[1]:
        raise InputError(
            f"{what}, line {keys.values['units.len.f'][1]}: units.len.f = {factor:g}; the number of length units in a"
            " metre: 1000 for mm, 1 for m"
        )
    if reading.units is None:
        table = table * (1000.0 / factor) if factor != 1000.0 else table
        notes += [] if factor == 1000.0 else [f"turned into mm: the file has {factor:g} units in a metre"]
    source = Source(what=what, kind=kind, reading=reading)
    line, done = convert_to_mm(table[:, 0], table[:, 1] if turned else -table[:, 1], reading.units, source)
    said = (f"SIMPACK file: {'the sign of z as it is' if turned else 'z turned up'}", *notes, *done)
    asked = "1,2" if turned else "1,-2"
    return Points(points=line, kind=kind, name=path.stem, source=what, notes=said, flipped_columns=asked)


def _parse_simpack(text: str, what: str) -> tuple[_SimpackKeys, list[tuple[float, float]]]:
    values: dict[str, tuple[str, int]] = {}
    rows: list[tuple[list[str], int]] = []
    block, inside, ended = "", False, False
    for number, raw in enumerate(text.splitlines(), start=1):
        # a key may have a text with any sign in it
        line = (raw.partition("!")[0] if "'" not in raw else _COMMENT.sub("", raw) if inside else raw).strip()
        line = "" if _COMMENT.match(line) else line
        if not line:
            continue
        if line in ("header.begin", "spline.begin", "header.end", "spline.end"):
            block = line[:6] if line.endswith("begin") else ""
        elif line in ("point.begin", "point.end"):
            inside, ended = line == "point.begin", ended or line == "point.end"
        elif inside:
            rows.append((_COMMENT.sub("", line).split(), number))
        elif match := _SIMPACK_KEY.match(line):
            # both blocks have a `type`, of the profile and of the original data
            key = f"type@{block}" if match[1] == "type" else match[1]
            if key in values:
                raise InputError(f"{what}, line {number}: {match[1]} is there twice, in line {values[key][1]} as well")
            if key.partition("@")[0] not in _KNOWN_KEYS:
                raise InputError(f"{what}, line {number}: {match[1][:60]} is no key of this format that is known here")
            values[key] = match[2], number
        else:
            raise InputError(f"{what}, line {number}: {line[:60]!r} is neither a key nor a block of a SIMPACK file")
    if inside or not ended:
        raise InputError(f"{what}: the points do not stand between point.begin and point.end; the file may be cut off")
    if "type@header" not in values:
        raise InputError(f"{what}: the header has no type (0 for a rail, 1 for a wheel); the file may be damaged")
    return _SimpackKeys(what=what, values=values), [_parse_row(what, *row) for row in rows]


def _process_points(keys: _SimpackKeys, rows: list[tuple[float, float]]) -> tuple[Floats, list[str]]:
    table, notes = np.array(rows).reshape(-1, 2), []
    closest = keys.number("point.dist.min", 0.0)
    if closest > 0.0 and len(table):
        before, table = len(table), drop_close_points(table, closest)
        notes.append(f"{before - len(table)} points closer than point.dist.min left out")
    shift = (keys.number("shift.y", 0.0), keys.number("shift.z", 0.0))
    turn = keys.number("rotate", 0.0) / (keys.number("units.ang.f", 1.0) or 1.0)
    if any(shift):
        table = table + np.array(shift)
        notes.append(f"shifted by ({shift[0]:g}, {shift[1]:g}) as the file says")
    if turn:
        c, s = np.cos(turn), np.sin(turn)
        table = table @ np.array([[c, s], [-s, c]])
        notes.append(f"rotated by {1e3 * turn:g} mrad as the file says")
    for column, axis in enumerate("yz"):
        low, high = keys.number(f"bound.{axis}.min", 1.0), keys.number(f"bound.{axis}.max", 0.0)
        # the format's own way of saying none
        if low < high:
            inside = (table[:, column] >= low) & (table[:, column] <= high)
            notes.append(f"{np.count_nonzero(~inside)} points beyond {axis} = {low:g} to {high:g} left out")
            table = table[inside]
    for sign, axis in (((-1.0, 1.0), "y"), ((1.0, -1.0), "z")):
        if keys.flag(f"mirror.{axis}"):
            table = table * sign
            notes.append(f"mirrored in {axis} as the file says")
    if keys.flag("inversion"):
        table = table[::-1]
    if keys.number("approx.smooth", 0.0):
        notes.append("the file asks SIMPACK for smoothing (approx.smooth), which is SIMPACK's own; not applied here")
    return table, notes


def _parse_row(what: str, row: list[str], line: int) -> tuple[float, float]:
    values = [value for field in row if (value := _parse_number(field)) is not None and np.isfinite(value)]
    if len(row) in (2, 3) and len(values) == len(row):
        return values[0], values[1]
    raise InputError(f"{what}, line {line}: {' '.join(row)[:60]!r} is not y, z and perhaps a weight as numbers")
