"""Readers of columns of numbers: tables of coordinates, and files of MiniProf and SIMPACK."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from pathlib import Path

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.files import open_regular_file
from fecontact.inputs.texts import count_text
from fecontact.profiles.curve import LARGEST_COORDINATE_MM, ProfileKind, check_size
from fecontact.profiles.points import FEWEST_POINTS, ProfilePoints, drop_close_points
from fecontact.profiles.readers.instrument_header import (
    InstrumentHeader,
    compare_flange,
    describe_diameter,
    make_header,
    parse_words,
)
from fecontact.profiles.readers.numerals import parse_number, replace_minus_signs, unquote_numbers
from fecontact.profiles.reading import MM_PER_UNIT, Reading, suggest_option

_COMMENT = re.compile(r"\s*(?:#|!|%|//).*")
_COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eEdD][-+]?\d+)?|[-+]?\d+")
_PAIR_WITH_COMMAS = re.compile(r"([-+]?\d+,\d+)\s*,\s*([-+]?\d+,\d+)")
_UNIT_IN_HEADER = re.compile(r"[\[(_ ](mm|m|cm|um|µm|in|inch|inches)[\])]?$", re.IGNORECASE)
# Largest size of a profile file: an instrument with steps of 0.01 mm gives 20,000 points.
_LARGEST_FILE_BYTES = 20_000_000
_LARGEST_HEADER_LINES = 40
_LETTERS_SHOWN = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnTable:
    """Two columns of a file in the unit of the file, with notes.

    Attributes
    ----------
    y, z
        Coordinates (n,) in the unit of the file.
    unit
        Unit of the file; None if unknown.
    notes
        Notes on the file.
    columns
        Columns option with the opposite sign of z.
    """

    y: Floats
    z: Floats
    unit: str | None = None
    notes: tuple[str, ...] = ()
    columns: str = "1,-2"


@dataclass(frozen=True, kw_only=True)
class ColumnSource:
    """Origin of columns: its name in messages, the wanted kind, and the options of the file.

    Attributes
    ----------
    what
        Name of the file in messages.
    kind
        Wanted kind of profile: `rail` or `wheel`.
    reading
        Options for reading the file.
    """

    what: str
    kind: ProfileKind
    reading: Reading

    def remedy(self, key: str, value: str | float) -> str:
        """Option that answers a question about the file."""
        return suggest_option(self.kind, key, value)


def read_columns(path: Path, kind: ProfileKind, reading: Reading) -> ProfilePoints:
    """Points from a text file with the columns y and z.

    Columns may be separated by blanks, tabs, commas or semicolons. Text after # ! % or // is a comment, and the first
    lines may be a header. The axes are the axes of the library: y positive to the field side, z up; a rail has its
    crown and a wheel its tape circle at (0, 0). `reading` has the exceptions.

    Parameters
    ----------
    path
        Path of the file.
    kind
        `rail` or `wheel`.
    reading
        Options of the file.

    Returns
    -------
    ProfilePoints
        Unchecked points in mm.

    Raises
    ------
    InputError
        The file cannot be read, or does not have two columns of numbers.
    """
    return parse_points(read_text(path), path.stem, ColumnSource(what=str(path), kind=kind, reading=reading))


def parse_points(text: str, name: str, source: ColumnSource) -> ProfilePoints:
    """Parse the points of a text of columns, as `read_columns` does for a file.

    Parameters
    ----------
    text
        Text of columns.
    name
        Name of the profile.
    source
        Origin of the text.

    Returns
    -------
    ProfilePoints
        Unchecked points in mm.

    Raises
    ------
    InputError
        The text does not have two columns of numbers.
    """
    table = parse_columns(text, source)
    points, notes = convert_to_mm(table.y, table.z, table.unit, source)
    remarks = (*table.notes, *notes)
    return ProfilePoints(
        points=points, kind=source.kind, name=name, source=source.what, notes=remarks, flipped_columns=table.columns
    )


def file_bytes(path: Path) -> bytes:
    """Content of a regular file with a plausible size for a profile.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    bytes
        Content.

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
                f"{path} has {size / 1e6:.0f} MB; allowed: at most {_LARGEST_FILE_BYTES / 1e6:.0f} MB; give a file of"
                " profile points"
            )
        return path.read_bytes()
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read {shorten_text(path)}: {getattr(error, 'strerror', error)}; check the path"
        ) from None


def read_text(path: Path) -> str:
    """Read the text of a file, in UTF-8 or an older encoding.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    str
        Text.

    Raises
    ------
    InputError
        The file cannot be read, or is not a text.
    """
    content = file_bytes(path)
    if b"\0" in content:
        raise InputError(
            f"{path} is not plain text (perhaps a spreadsheet or UTF-16); save it as text with two columns"
        )
    try:
        return replace_minus_signs(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        # comments may have an older encoding; the numbers are checked below
        return replace_minus_signs(content.decode("latin-1"))


def shorten_text(text: object) -> str:
    """Shorten a user's text of more than 200 characters to its first 120.

    Parameters
    ----------
    text
        The user's text.

    Returns
    -------
    str
        The text, or its start with the number of its characters.
    """
    full_text = str(text)
    return full_text if len(full_text) <= 200 else f"{full_text[:120]}... ({len(full_text)} characters)"


def parse_columns(text: str, source: ColumnSource, *, names: str = "", unnamed: bool = False) -> ColumnTable:
    """Columns y and z of a text.

    Parameters
    ----------
    text
        Numbers in lines, with or without a header.
    source
        Origin of the text.
    names
        Names of the columns, if the header does not have them.
    unnamed
        Whether the first two of several unnamed columns are y and z.

    Returns
    -------
    ColumnTable
        Columns in the unit of the text.

    Raises
    ------
    InputError
        The text does not have two columns of numbers, or is ambiguous. The message has the option that answers the
        question.
    """
    lines = _number_lines(text)
    has_commas = _has_decimal_commas([line for _, line in lines])
    if source.reading.columns is None and _are_pairs_with_commas(lines):
        lines, has_commas = [(number, _PAIR_WITH_COMMAS.sub(r"\1;\2", line)) for number, line in lines], True
    header, data_lines = _separate_header(lines, comma=has_commas)
    notes = ["decimal commas recognised"] if has_commas else []
    if len(header) > 1:
        notes.append(f"{len(header)} header lines left out")
    # words before unnamed columns are no names of them
    if (
        header
        and not names
        and not (unnamed and len(_split_titles(header[-1])) != _count_fields(data_lines, has_commas))
    ):
        names = header[-1]
    if data_lines and (count := _read_point_count(data_lines, comma=has_commas)):
        data_lines = data_lines[1:]
        notes.append(f"the first line, {count}, is the number of points")
    if not data_lines:
        raise InputError(
            f"{source.what} has no numbers; the file needs at least {FEWEST_POINTS} lines of y and z in mm"
        )
    rows = [_split_fields(line, comma=has_commas) for _, line in data_lines]
    width = len(rows[0])
    chosen, signs = _choose_columns(data_lines[0], rows, names, source, unnamed=unnamed)
    if width > 2 and source.reading.columns is None:
        notes.append(
            f"of {width} columns, {_name_column(names, chosen[0])} and {_name_column(names, chosen[1])} are used"
        )
    values, remarks = [], []
    for (number, line), fields in zip(data_lines, rows, strict=True):
        where = f"{source.what}, line {number}"
        if (
            len(fields) > width
            and fields[width][:1].isalpha()
            and parse_number(fields[width], comma=has_commas) is None
        ):
            remarks.append(number)
        elif len(fields) != width:
            raise InputError(
                f"{where}: {count_text(len(fields), 'column')} instead of {width} in {line[:_LETTERS_SHOWN]!r}; "
                "give all lines the same number of columns, and start comments with #"
            )
        values.append(_parse_pair([fields[column] for column in chosen], where, line, comma=has_commas))
    if remarks:
        notes.append(
            f"text after the numbers left out in line {remarks[0]}"
            + (f" and {len(remarks) - 1} more" if len(remarks) > 1 else "")
        )
    unit = source.reading.units or _read_column_unit(names, chosen)
    if unit not in (None, "mm", source.reading.units):
        notes.append(f"unit {unit} from the header")
    notes += [f"the sign of {axis} is reversed" for axis, sign in zip("yz", signs, strict=True) if sign < 0]
    y, z = (np.array(values) * signs).T
    flipped = [f"{'-' if sign < 0 else ''}{k + 1}" for k, sign in zip(chosen, (signs[0], -signs[1]), strict=True)]
    return ColumnTable(y=y, z=z, unit=unit, notes=tuple(notes), columns=",".join(flipped))


def _number_lines(text: str) -> list[tuple[int, str]]:
    stripped = ((number, _COMMENT.sub("", raw).strip()) for number, raw in enumerate(text.splitlines(), start=1))
    return [(number, unquote_numbers(line)) for number, line in stripped if line]


def _has_decimal_commas(lines: Sequence[str]) -> bool:
    """Whether commas are certainly decimal signs.

    A different sign separates the fields, and each field has at most one comma.
    """
    numeric = [line for line in lines if re.match(r"[-+]?[\d.,]", line)]
    with_commas = [line for line in numeric if "," in line]
    if not with_commas or any("." in line for line in numeric):
        return False
    fields = [_split_fields(line, comma=True) for line in with_commas]
    return all(len(row) > 1 and all(_COMMA_NUMBER.fullmatch(field) for field in row) for row in fields)


def _count_fields(lines: Sequence[tuple[int, str]], has_commas: bool) -> int:
    """Count the fields of the first line of numbers."""
    return len(_split_fields(lines[0][1], comma=has_commas)) if lines else 0


def _are_pairs_with_commas(lines: Sequence[tuple[int, str]]) -> bool:
    """Whether each line has two numbers with decimal commas, as `1,5,-2,25`."""
    numeric = [line for _, line in lines if re.match(r"[-+]?\d", line)]
    return len(numeric) >= FEWEST_POINTS and all(map(_PAIR_WITH_COMMAS.fullmatch, numeric))


def _split_fields(line: str, *, comma: bool = False) -> list[str]:
    separator = r"\s*;\s*|\s+" if comma else r"\s*[,;]\s*|\s+"
    return re.split(separator, line.rstrip("; \t" if comma else ",; \t"))


def _separate_header(lines: list[tuple[int, str]], *, comma: bool) -> tuple[list[str], list[tuple[int, str]]]:
    """Separate the lines before the first line of numbers from the lines of numbers.

    Parameters
    ----------
    lines
        Numbers and texts of the lines.
    comma
        Whether commas are decimal signs.

    Returns
    -------
    header, rest
        Texts of the header, and numbers and texts of the other lines.
    """
    # if no line consists of numbers alone, the first line with a number explains the error
    for condition in (all, any):
        starts = [
            i
            for i, (_, line) in enumerate(lines[: _LARGEST_HEADER_LINES + 1])
            if condition(parse_number(field, comma=comma) is not None for field in _split_fields(line, comma=comma))
        ]
        if starts:
            # numbers among words belong to the header if their count differs from the following lines
            is_header = (
                not (after == i + 1 or _has_equal_width(lines[i], lines[after], comma=comma))
                for i, after in pairwise(starts)
            )
            first = starts[len(list(takewhile(bool, is_header)))]
            return [text for _, text in lines[:first]], lines[first:]
    return [], []


def _has_equal_width(first_line: tuple[int, str], second_line: tuple[int, str], *, comma: bool) -> bool:
    return len(_split_fields(first_line[1], comma=comma)) == len(_split_fields(second_line[1], comma=comma))


def _read_point_count(rest: list[tuple[int, str]], *, comma: bool) -> int:
    first = _split_fields(rest[0][1], comma=comma)
    if len(first) != 1 or not first[0].isascii() or not first[0].isdigit() or len(first[0]) > 8:
        return 0
    return int(first[0]) if int(first[0]) == len(rest) - 1 else 0


def _name_column(names: str, column: int) -> str:
    titles = _split_titles(names)
    return repr(titles[column]) if column < len(titles) else f"column {column + 1}"


def _split_titles(names: str) -> list[str]:
    # a unit belongs to the preceding name
    joined = re.sub(r"\s+(?=[\[(])", "_", names)
    return [title for title in re.split(r"\s*[,;]\s*|\s+", joined.strip(" ,;\t\"'")) if title]


def _strip_unit(title: str) -> str:
    return _UNIT_IN_HEADER.sub("", title.strip("\"'")).strip("_ ").lower()


def _choose_columns(
    first: tuple[int, str], rows: list[list[str]], names: str, source: ColumnSource, *, unnamed: bool
) -> tuple[tuple[int, int], tuple[float, float]]:
    """Choose the two columns y and z, and their signs.

    Parameters
    ----------
    first
        Number and text of the first line.
    rows
        Fields of all lines.
    names
        Names of the columns.
    source
        Origin of the text.
    unnamed
        Whether the first two of several unnamed columns are y and z.

    Returns
    -------
    columns, signs
        Indices of y and z, and their signs.

    Raises
    ------
    InputError
        The columns are ambiguous, or the requested columns do not exist.
    """
    reading, count = source.reading, len(rows[0])
    stems = [_strip_unit(title) for title in _split_titles(names)]
    if reading.columns is not None:
        words = [word.strip().lower() for word in reading.columns.split(",")]
        signs = [-1.0 if word.startswith("-") else 1.0 for word in words]
        columns = [
            int(word) - 1 if word.isdigit() and len(word) < 4 else stems.index(word) if word in stems else -1
            for word in (word.removeprefix("-").removeprefix("+") for word in words)
        ]
        if len(columns) != 2 or columns[0] == columns[1] or not all(0 <= column < count for column in columns):
            raise InputError(
                f"{source.what}: columns {shorten_text(reading.columns)!r} do not select two of the "
                f"{count_text(count, 'column')}"
                f"{' ' + ', '.join(stems[:12]) if stems else ''}; give two numbers from 1 to {count}, such as"
                f" --{source.kind}-columns 1,2"
            )
        return (columns[0], columns[1]), (signs[0], signs[1])
    if count == 2:
        return ((1, 0) if stems[:2] == ["z", "y"] else (0, 1)), (1.0, 1.0)
    if len(stems) == count and stems.count("y") == 1 and stems.count("z") == 1:
        return (stems.index("y"), stems.index("z")), (1.0, 1.0)
    if unnamed and count > 2:
        return (0, 1), (1.0, 1.0)
    number, line = first
    if not _has_coordinates(rows):
        raise InputError(
            f"{source.what}, line {number}: {line[:_LETTERS_SHOWN]!r} is a line of a table of texts and numbers with"
            f" {count_text(count, 'column')}, and not all lines have two columns of numbers at equal places: it is not"
            " a profile; give a file with the columns y and z in mm"
        )
    comma_text = (
        "; commas separate columns and decimals: write decimal points" if "," in line and "." not in line else ""
    )
    raise InputError(
        f"{source.what}, line {number}: {count_text(count, 'column')} instead of 2 in {line[:_LETTERS_SHOWN]!r}; "
        f"state which columns are y and z: {source.remedy('columns', _guess_columns(rows))}{comma_text}"
    )


def _has_coordinates(rows: list[list[str]]) -> bool:
    """Whether lines of equal length have at least two columns of numbers alone.

    A remark after the numbers of a line is no column.
    """
    # the first line may be a number of points
    ((count, _),) = Counter(map(len, rows)).most_common(1)
    plain_rows = [row[:count] if len(row) > count and parse_number(row[count]) is None else row for row in rows]
    if any(len(row) != count for row in plain_rows):
        # a single line that is too short or too long is a mistake, and is named with its number
        return sum(len(row) != count for row in plain_rows) < 0.1 * len(plain_rows)
    return (
        sum(all(parse_number(field) is not None for field in column) for column in zip(*plain_rows, strict=True)) >= 2
    )


def _guess_columns(rows: list[list[str]]) -> str:
    """Guess two columns that may be coordinates.

    A column of coordinates is neither constant nor the number of the line.

    Parameters
    ----------
    rows
        Fields of all lines.

    Returns
    -------
    str
        Columns option.
    """
    columns = list(
        zip(*([parse_number(field) for field in row] for row in rows if len(row) == len(rows[0])), strict=True)
    )
    likely = []
    for k, column in enumerate(columns, start=1):
        steps = {round(b - a, 9) for a, b in pairwise(column) if a is not None and b is not None}
        if not (steps <= {0.0} or steps <= {1.0}):
            likely.append(k)
    return "{},{}".format(*likely[:2]) if len(rows) > 1 and 2 <= len(likely) < len(columns) else "2,3"


def _parse_pair(fields: list[str], where: str, line: str, *, comma: bool) -> list[float]:
    """Parse two finite numbers of a line.

    `where` names the file and the line in messages. Fields that are not numbers are left out; `comma` reads decimal
    commas.

    Raises
    ------
    InputError
        If there are fewer than two numbers, or a number that is not finite.
    """
    pair = [value for field in fields if (value := parse_number(field, comma=comma)) is not None]
    if len(pair) < 2:
        raise InputError(f"{where}: {line[:_LETTERS_SHOWN]!r} does not have two numbers; start comments with #")
    if not np.isfinite(sum(pair)):
        raise InputError(f"{where}: {line[:_LETTERS_SHOWN]!r} has a number that is not finite; remove the line")
    return pair


def _read_column_unit(names: str, chosen: tuple[int, int]) -> str | None:
    """Read the unit of the chosen columns from their names; None without a unique unit."""
    titles = _split_titles(names)
    if max(chosen) >= len(titles):
        return None
    units = {match[1].lower() for column in chosen if (match := _UNIT_IN_HEADER.search(titles[column].strip("\"'")))}
    unit = units.pop() if len(units) == 1 else None
    if unit is None:
        return None
    return {"µm": "um", "inch": "in", "inches": "in"}.get(unit, unit)


def convert_to_mm(
    y: Floats, z: Floats, unit: str | None, source: ColumnSource, *, mirror: bool = False
) -> tuple[Floats, list[str]]:
    """Convert coordinates to points in mm from the tape circle, with the requested signs.

    Parameters
    ----------
    y, z
        Coordinates (n,) in the unit of the file.
    unit
        Unit of the file; None for mm.
    source
        Origin of the text.
    mirror
        Whether files of this kind have mirrored profiles.

    Returns
    -------
    points, notes
        Points (n, 2) in mm, and notes.
    """
    reading, factor = source.reading, MM_PER_UNIT[unit or "mm"]
    notes = [] if factor == 1.0 else [f"converted from {unit} to mm"]
    tape_circle_mm = reading.tape_circle_mm or 0.0
    if tape_circle_mm:
        notes.append(f"y is measured from the tape circle, which is at y = {tape_circle_mm:g} mm of the file")
    if reading.mirror:
        notes.append(
            "mirrored: y keeps the sign of the file, because this format is mirrored without the option"
            if mirror
            else "mirrored: the sign of y is reversed"
        )
    # far beyond the largest allowed coordinate, but finite after a multiplication
    largest = 1e12 * LARGEST_COORDINATE_MM
    points = np.clip(np.column_stack((y, z)), -largest, largest) * factor - (tape_circle_mm, 0.0)
    return points * (-1.0 if bool(reading.mirror) != mirror else 1.0, 1.0), notes


# --- Profiles of the MiniProf instrument, .ban (rail) and .whl (wheel): lines of a header, and columns of numbers.
#
# `ColumnDef` names the columns (X across, Y into the depth of the body, then angle, curvature and columns that a
# profile does not need). The test bank of CONTACT by Vtech CMCC (testbank/profiles) has files of the instrument
# (MiniProf for Windows 2.43 and MiniProf 2020) and of programs that write its format. In these files
#
# - a wheel's X grows from the back of the flange to the field side, its Y grows towards the tip of the flange, and the
#   tape circle is at `WheelDiameterTaperline` (70 mm) if the header has this key;
# - a rail's X grows to the centre of the track, in avg_low2.ban (its last line names the side of the gauge face),
#   rail_left_iter288.ban and others; according to CONTACT's manual they usually need mirror_y = 1;
# - lengths are in mm; CONTACT adds `Xoffset` and `Yoffset` to the points; a blank line may precede the points.
#
# Y grows downwards in some files and upwards in others. The shape of the profile shows the direction.

_MINIPROF_KEY = re.compile(r"([A-Za-z][A-Za-z0-9_. ]*?)\s*=\s*(.*)")
# Keys that only this format has, or the first line of files with a header in words instead of keys.
_MINIPROF_MARK = re.compile(
    r'^\s*"?(?:ColumnDef|MPTypeNo|MPSerNo|XYPoints)\s*=|\A#\s*MINI\w*PROF', re.IGNORECASE | re.MULTILINE
)
# Sections of files with several profiles (.mpt), which MiniProf for Windows writes.
_SECTION_LINE = re.compile(r"^[ \t]*\[(FileInfo|Profile\d{1,6}(?:Info|Points))\][ \t]*$", re.IGNORECASE | re.MULTILINE)
_UNIT_WORDS = {"inch": "in", "inches": "in", "millimeter": "mm", "millimetre": "mm"}
_OFFSET_KEYS = (("xoffset", "xoff"), ("yoffset", "yoff"))
_ALIGNMENT_KEYS = ("aligndx", "aligndy", "alignda")
_KIND_BY_SUFFIX: dict[str, ProfileKind] = {".ban": "rail", ".whl": "wheel"}
_TAPERLINE_KEY = "wheeldiametertaperline"
# Distance of the tip of a flange from the back of the flange (mm): 15.5 mm on the S1002.
_TIP_OVER_BACK_MM = (5.0, 30.0)
_ALLOWED_TAPE_CIRCLE_MM = (40.0, 100.0)
# Least height of the tip of a flange above both ends of the profile (mm).
_LEAST_TIP_HEIGHT_MM = 3.0
# Width of the part at each end of a head that shows the direction of z.
_BESIDE_END_MM = 15.0


def read_start(path: Path) -> bytes:
    """First bytes of a file, which show its format.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    bytes
        At most 20,000 bytes; empty for an unreadable file, which the reader of its content refuses.
    """
    try:
        with open_regular_file(path) as file:
            return file.read(20_000)
    except (OSError, ValueError):
        return b""


def is_miniprof(path: Path) -> bool:
    """Whether a file has a header of the MiniProf instrument, with any ending.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    bool
        False for an unreadable file.
    """
    return _MINIPROF_MARK.search(read_start(path).decode("latin-1")) is not None


def read_miniprof(path: Path, kind: ProfileKind, reading: Reading) -> ProfilePoints:
    """Points of a MiniProf file.

    Parameters
    ----------
    path
        Path of the file.
    kind
        `rail` or `wheel`, for a file with a different ending than .ban or .whl.
    reading
        Options of the file.

    Returns
    -------
    ProfilePoints
        Unchecked points in mm.

    Raises
    ------
    InputError
        The file cannot be read, or its header does not define the position of the points. The message has the option
        that answers the question.
    """
    source = ColumnSource(what=str(path), kind=_KIND_BY_SUFFIX.get(path.suffix.lower(), kind), reading=reading)
    text, section_notes = _select_section(read_text(path), source)
    keys, table_text = _split_miniprof_keys(text)
    names = ""
    if (columns := keys.get("columndef")) is not None:
        column_names = [name.strip().lower() for name in columns.split(",")]
        if "x" not in column_names or "y" not in column_names or len(set(column_names)) != len(column_names):
            raise InputError(f"{path}: ColumnDef = {columns[:60]!r}; it must name the columns X and Y, such as X,Y,A,C")
        # X is y here, and Y is z until its sign is determined; unnamed columns are the last ones
        names = ",".join({"x": "y", "y": "z"}.get(name, f"_{name}") for name in column_names if name != "*")
        if "*" in column_names:
            names = names if column_names[:2] != ["x", "y"] else ""
    table = parse_columns(table_text, source, names=names, unnamed=True)
    y, z, offset_notes = _add_offsets(table.y, table.z, keys, source)
    points, conversion_notes = convert_to_mm(
        y, z, reading.units or _read_header_unit(keys, source), source, mirror=source.kind == "rail"
    )
    if points.size:
        # the following functions compare lengths in mm
        check_size(*points.T, kind=source.kind, label=str(path), unit=reading.units or "mm")
    given_points = points
    points, direction_notes = _turn_upwards(points, source)
    # a sign of z, also a plus, keeps the direction of the file
    y_column, z_column = table.columns.split(",")
    is_turned = points is not given_points
    points, tape_circle_notes, question = _shift_to_tape_circle(points, keys, source)
    across = "X points to the track centre, so y = -X" if source.kind == "rail" else "y = X"
    remarks = (
        f"MiniProf file: {across}",
        *section_notes,
        *table.notes,
        *offset_notes,
        *conversion_notes,
        *direction_notes,
        *tape_circle_notes,
        *_check_header(points, keys, source),
    )
    return ProfilePoints(
        points=points,
        kind=source.kind,
        name=path.stem,
        source=str(path),
        notes=remarks,
        flipped_columns=f"{y_column},+{z_column.removeprefix('-')}" if is_turned else table.columns,
        question=question,
    )


def _select_section(text: str, source: ColumnSource) -> tuple[str, list[str]]:
    """Select the header and the points of a profile in a file of sections.

    Parameters
    ----------
    text
        Text of a file.
    source
        Origin of the text.

    Returns
    -------
    text, notes
        Lines of the profile, and a note; the unchanged text of a file without sections.

    Raises
    ------
    InputError
        The file has several profiles, and none is chosen, or the chosen one does not exist.
    """
    # texts before the first section, then name and lines of each section
    parts = _SECTION_LINE.split(text)
    sections = {name.lower(): lines for name, lines in zip(parts[1::2], parts[2::2], strict=True)}
    numbers = sorted(int(name[7:-4]) for name in sections if re.fullmatch(r"profile\d{1,6}info", name))
    chosen = source.reading.section
    if not numbers:
        if chosen is not None:
            raise InputError(
                f"{source.what}: profile {chosen:g} is wanted, but the file has no numbered profiles; leave out"
                f" --{source.kind}-section (section in [{source.kind}_file])"
            )
        return text, []
    titles = [f"{number}{_name_section(sections[f'profile{number}info'])}" for number in numbers]
    if chosen not in numbers and (chosen is not None or len(numbers) > 1):
        missing = "" if chosen is None else f", and {chosen:g} is none of them"
        raise InputError(
            f"{source.what}: the file has {count_text(len(numbers), 'profile')}: {', '.join(titles[:20])}{missing};"
            f" {source.remedy('section', float(numbers[0]))} for the first one"
        )
    number = int(chosen or numbers[0])
    lines = f"{sections[f'profile{number}info']}\n{sections.get(f'profile{number}points', '')}"
    return lines, [f"profile {titles[numbers.index(number)]} of {len(numbers)} in the file"]


def _name_section(header_text: str) -> str:
    """Name of a section from its header, in parentheses; empty without a name."""
    keys, _ = _split_miniprof_keys(header_text)
    names = [value for key in ("mpdn", "id", "rail", "side") if (value := keys.get(key, "").lstrip("%"))]
    return f" ({', '.join(names)[:40]})" if names else ""


def is_sectioned(path: Path) -> bool:
    """Whether a file has sections of MiniProf, each with a profile.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    bool
        False for an unreadable file.
    """
    return _SECTION_LINE.search(read_start(path).decode("latin-1")) is not None


def _turn_upwards(points: Floats, source: ColumnSource) -> tuple[Floats, list[str]]:
    """Turn z upwards, by the shape of the profile.

    A head falls towards its ends, and the tip of a flange is below the tread.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    source
        Origin of the text.

    Returns
    -------
    points, notes
        Points (n, 2) in mm, and notes.
    """
    if len(points) < 3 or (source.reading.columns or "").partition(",")[2].strip().startswith(("-", "+")):
        return points, []
    y, z = points.T
    if source.kind == "rail":
        ends = [(z[end] - np.mean(z[np.abs(y - y[end]) < _BESIDE_END_MM])) for end in (0, -1)]
        is_downwards = sum(ends) > 0.0
    else:
        is_downwards = _find_tip_height(z) > max(_LEAST_TIP_HEIGHT_MM, _find_tip_height(-z))
    if is_downwards:
        return points * (1.0, -1.0), ["Y points into the body, so z = -Y"]
    return points, ["Y points upwards, so z = Y"]


def _find_tip_height(z: Floats) -> float:
    """Height of the highest point above both ends (mm); 0 if it is near an end.

    The tip of a flange is between its back and the tread. The face of a rim is at an end, however far it reaches.
    """
    top = int(np.argmax(z))
    return float(z[top] - max(z[0], z[-1])) if 2 <= top < z.size - 2 else 0.0


def _shift_to_tape_circle(points: Floats, keys: dict[str, str], source: ColumnSource) -> tuple[Floats, list[str], str]:
    """Shift a wheel's y from the back of the flange to the tape circle.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    keys
        Keys of the header.
    source
        Origin of the text.

    Returns
    -------
    points, notes, question
        Points (n, 2) in mm, unchanged if y is not measured from the back of the flange, notes, and the refusal of a
        header without the position of the tape circle.
    """
    tip = float(points[np.argmin(points[:, 1]), 0]) if points.size else 0.0
    low, high = _TIP_OVER_BACK_MM
    if source.kind == "rail" or source.reading.tape_circle_mm is not None or not low <= tip <= high:
        return points, [], ""
    tape_circle_mm = _read_header_value(keys.get(_TAPERLINE_KEY, ""), "WheelDiameterTaperline", source)
    if not _ALLOWED_TAPE_CIRCLE_MM[0] <= tape_circle_mm <= _ALLOWED_TAPE_CIRCLE_MM[1]:
        usual = -70.0 if source.reading.mirror else 70.0
        question = (
            f"{source.what}: the tip of the flange is at X = {tip:.1f} mm, so X begins at the back of the flange, but"
            f" the header does not give the tape circle; {source.remedy('tape_circle_mm', usual)} for the usual"
            " 70 mm from the back"
        )
        return points, [], question
    remark = (
        "X begins at the back of the flange: y is measured from the tape circle, which is at WheelDiameterTaperline ="
        f" {tape_circle_mm:g} mm"
    )
    return points - (tape_circle_mm, 0.0), [remark], ""


def _check_header(points: Floats, keys: dict[str, str], source: ColumnSource) -> list[str]:
    """Check the diameter and the flange of a wheel in the header.

    Parameters
    ----------
    points
        Points (n, 2) in mm, with y = 0 at the tape circle and z up.
    keys
        Keys of the header.
    source
        Origin of the text.

    Returns
    -------
    list of str
        Notes on the diameter, and on dimensions of the flange that contradict the points.
    """
    if source.kind == "rail" or len(points) < FEWEST_POINTS:
        return []
    _read_header_value(keys.get("diametertaperline", ""), "DiameterTaperline", source)
    header = make_header(keys, MM_PER_UNIT[_read_header_unit(keys, source) or "mm"])
    # dimensions of a flange need the back of the flange, from which the instrument measures X
    back_mm = source.reading.tape_circle_mm or _read_header_value(keys.get(_TAPERLINE_KEY, ""), _TAPERLINE_KEY, source)
    return [*describe_diameter(header), *(compare_flange(header, points, abs(back_mm)) if back_mm else [])]


def read_header(path: Path) -> InstrumentHeader | None:
    """Header of a MiniProf file.

    Parameters
    ----------
    path
        Path of a profile file.

    Returns
    -------
    InstrumentHeader or None
        None for a file of another format, and for a file that cannot be read: the reader of its points refuses it.
    """
    if is_sectioned(path) or not (path.suffix.lower() in _KIND_BY_SUFFIX or is_miniprof(path)):
        return None
    try:
        keys, _ = _split_miniprof_keys(read_text(path))
        unit = _read_header_unit(keys, ColumnSource(what=str(path), kind="wheel", reading=Reading()))
    except InputError:
        return None
    return make_header(keys, MM_PER_UNIT[unit or "mm"])


def find_stated_kind(path: Path) -> ProfileKind | None:
    """Kind of profile that the ending of a file states; None for any other ending."""
    return _KIND_BY_SUFFIX.get(path.suffix.lower())


def _split_miniprof_keys(text: str) -> tuple[dict[str, str], str]:
    """Split a text into keys in lower case and the following lines.

    Parameters
    ----------
    text
        Text of a file.

    Returns
    -------
    keys, rest
        Keys with their values, and the text with the other lines at their positions.
    """
    keys: dict[str, str] = {}
    lines = text.splitlines()
    rest = [""] * len(lines)
    for number, line in enumerate(lines):
        # a complete line may be quoted, a value may be quoted, or a quoted remark may follow the value
        stripped = line.strip()
        if words := parse_words(stripped, lines[number + 1].strip() if number + 1 < len(lines) else ""):
            keys |= words
            continue
        if _is_numbers(_strip_remark(stripped)):
            # a quote among the points begins a remark
            rest[number:] = (data_line.partition('"')[0] for data_line in lines[number:])
            break
        if match := _MINIPROF_KEY.fullmatch(stripped.strip('"') if stripped.startswith('"') else stripped):
            keys[match[1].lower()] = match[2].removeprefix('"').partition('"')[0].strip()
        else:
            rest[number] = line
    return keys, "\n".join(rest)


def _strip_remark(line: str) -> str:
    """Strip the quoted remark after the values of a line.

    A line that begins with a quote stays unchanged.
    """
    return line if line.lstrip().startswith('"') else line.partition('"')[0]


def _is_numbers(line: str) -> bool:
    fields = _split_fields(_COMMENT.sub("", line).strip())
    return len(fields) > 1 and None not in map(parse_number, fields)


def _read_header_unit(keys: dict[str, str], source: ColumnSource) -> str | None:
    """Read the unit of the header; None if it is not defined.

    Raises
    ------
    InputError
        The unit is unknown.
    """
    unit = keys.get("units", keys.get("unit", "")).lower()
    unit = _UNIT_WORDS.get(unit, unit)
    if unit in MM_PER_UNIT or unit in ("", "metric"):
        return unit if unit in MM_PER_UNIT else None
    raise InputError(
        f"{source.what}: the header has Units = {unit[:40]!r}; allowed: {', '.join(MM_PER_UNIT)};"
        f" {source.remedy('units', 'mm')}"
    )


def _add_offsets(y: Floats, z: Floats, keys: dict[str, str], source: ColumnSource) -> tuple[Floats, Floats, list[str]]:
    """Add the offsets of the header to the coordinates.

    Parameters
    ----------
    y, z
        Coordinates (n,).
    keys
        Keys of the header.
    source
        Origin of the text.

    Returns
    -------
    y, z, notes
        Coordinates (n,), and notes on applied and ignored keys.
    """
    known_keys = (*(key for axis_keys in _OFFSET_KEYS for key in axis_keys), *_ALIGNMENT_KEYS)
    values = {key: value for key in known_keys if (value := _read_header_value(keys.get(key, ""), key, source)) != 0.0}
    along, up = (sum(values.get(key, 0.0) for key in axis_keys) for axis_keys in _OFFSET_KEYS)
    notes = [
        f"{key.upper()} = {value:g} of the header is {'not applied' if key in _ALIGNMENT_KEYS else 'added'}"
        for key, value in values.items()
    ]
    return y + along, z + up, notes


def _read_header_value(text: str, key: str, source: ColumnSource) -> float:
    """Read a number of the header.

    Raises
    ------
    InputError
        The text is not a number of a plausible size.
    """
    # an empty key is 0
    value = parse_number(text or "0")
    if value is None or not abs(value) <= 1e6:
        raise InputError(
            f"{source.what}: {key.upper()} = {text[:40]!r} in the header; allowed: a number from -1e6 to 1e6; correct"
            " it"
        )
    return value


# --- Profiles of SIMPACK, .prr (rail) and .prw (wheel): blocks of keys, and the points of a spline.
#
# The numbers in the comments of such a file give the order in which the points are processed: points that are closer
# than `point.dist.min` are left out, then the points are shifted, rotated, cut at the bounds, mirrored and reversed.
# `units.len.f` is the number of length units per metre. z points down, and y of a wheel points to its flange unless the
# file mirrors it. A third column is a weight, which has no meaning for a profile through the points.

_SIMPACK_BLOCK = re.compile(r"^\s*(header|spline)\.begin\s*(?:!.*)?$", re.MULTILINE)
_SIMPACK_KEY = re.compile(r"^\s*([a-z][a-z.]*[a-z])\s*=\s*('[^']*'|[^!\s]+)")
# Allowed units.len.f. The length unit in metres is 1 / units.len.f: 1000 for mm, 1 for m, 39.37 for inches.
_ALLOWED_LENGTH_FACTORS = (0.5, 2e6)
_KNOWN_KEYS = {
    *("version", "type", "approx.smooth", "file", "file.mtime", "comment", "point.dist.min", "shift.y", "shift.z"),
    *("rotate", "bound.y.min", "bound.y.max", "bound.z.min", "bound.z.max", "mirror.y", "mirror.z", "inversion"),
    *("units.len", "units.ang", "units.len.f", "units.ang.f", "table.nr"),
}


@dataclass(frozen=True, kw_only=True)
class _SimpackKeys:
    """Keys of a file with their line numbers.

    Attributes
    ----------
    label
        Subject of messages.
    values
        Value and line number of each key.
    """

    label: str
    values: dict[str, tuple[str, int]]

    def number(self, key: str, default: float) -> float:
        """Number of a key, or a default.

        Parameters
        ----------
        key
            Name of the key.
        default
            Number of a missing key.

        Returns
        -------
        float
            Number.

        Raises
        ------
        InputError
            The value is not a number of a plausible size.
        """
        if key not in self.values:
            return default
        text, line = self.values[key]
        value = parse_number(text)
        if value is None or not abs(value) <= 1e9:
            raise InputError(
                f"{self.label}, line {line}: {key} = {text[:60]}; allowed: a number from -1e9 to 1e9; correct it"
            )
        return value

    def flag(self, key: str) -> bool:
        """Whether a key is 1; a missing key is 0.

        Parameters
        ----------
        key
            Name of the key.

        Returns
        -------
        bool
            Value of the key.

        Raises
        ------
        InputError
            The value is neither 0 nor 1.
        """
        value = self.number(key, 0.0)
        if value not in (0.0, 1.0):
            line = self.values[key][1]
            raise InputError(f"{self.label}, line {line}: {key} = {value:g}; allowed: 0 or 1; correct it")
        return value == 1.0


def is_simpack(path: Path) -> bool:
    """Whether a file has SIMPACK's blocks.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    bool
        False for an unreadable file.
    """
    return _SIMPACK_BLOCK.search(read_start(path).decode("latin-1")) is not None


def read_simpack(path: Path, reading: Reading) -> ProfilePoints:
    """Points of a SIMPACK file.

    Parameters
    ----------
    path
        Path of the file.
    reading
        Options of the file.

    Returns
    -------
    ProfilePoints
        Unchecked points in mm.

    Raises
    ------
    InputError
        The file cannot be read, or violates the format; the message has the line and the key.
    """
    label = str(path)
    keys, rows = _parse_simpack(read_text(path), label)
    kind: ProfileKind = "wheel" if keys.flag("type@header") else "rail"
    if reading.columns not in (None, "1,2", "1,-2"):
        raise InputError(
            f"{label}: a SIMPACK file defines its columns; leave out the option columns, or give 1,-2 to reverse the"
            " sign"
            " of z"
        )
    table, notes = _process_points(keys, rows)
    is_sign_kept = reading.columns == "1,-2"
    factor = keys.number("units.len.f", 1000.0)
    if not _ALLOWED_LENGTH_FACTORS[0] <= factor <= _ALLOWED_LENGTH_FACTORS[1]:
        raise InputError(
            f"{label}, line {keys.values['units.len.f'][1]}: units.len.f = {factor:g}; give the number of length units"
            " per metre: 1000 for mm, 1 for m"
        )
    if reading.units is None:
        table = table * (1000.0 / factor) if factor != 1000.0 else table
        notes += [] if factor == 1000.0 else [f"converted to mm: the file has {factor:g} length units per metre"]
    source = ColumnSource(what=label, kind=kind, reading=reading)
    points, conversion_notes = convert_to_mm(
        table[:, 0], table[:, 1] if is_sign_kept else -table[:, 1], reading.units, source
    )
    remarks = (
        f"SIMPACK file: {'z keeps its sign' if is_sign_kept else 'the sign of z is reversed, so z points up'}",
        *notes,
        *conversion_notes,
    )
    flipped = "1,2" if is_sign_kept else "1,-2"
    return ProfilePoints(points=points, kind=kind, name=path.stem, source=label, notes=remarks, flipped_columns=flipped)


def _parse_simpack(text: str, label: str) -> tuple[_SimpackKeys, list[tuple[float, float]]]:
    """Parse the keys and the points of a SIMPACK file.

    Parameters
    ----------
    text
        Text of the file.
    label
        Subject of messages.

    Returns
    -------
    keys, rows
        Keys, and the points (y, z) in the unit of the file.

    Raises
    ------
    InputError
        The text violates the format.
    """
    values: dict[str, tuple[str, int]] = {}
    rows: list[tuple[list[str], int]] = []
    block, is_inside, has_ended = "", False, False
    for number, raw_line in enumerate(text.splitlines(), start=1):
        # a quoted value may have any character
        line = (
            raw_line.partition("!")[0] if "'" not in raw_line else _COMMENT.sub("", raw_line) if is_inside else raw_line
        ).strip()
        line = "" if _COMMENT.match(line) else line
        if not line:
            continue
        if line in ("header.begin", "spline.begin", "header.end", "spline.end"):
            block = line[:6] if line.endswith("begin") else ""
        elif line in ("point.begin", "point.end"):
            is_inside, has_ended = line == "point.begin", has_ended or line == "point.end"
        elif is_inside:
            rows.append((_COMMENT.sub("", line).split(), number))
        elif match := _SIMPACK_KEY.match(line):
            # both blocks have a key `type`, for the profile and for the original data
            key = f"type@{block}" if match[1] == "type" else match[1]
            if key in values:
                raise InputError(
                    f"{label}, line {number}: {match[1]} is given twice, first in line {values[key][1]}; remove one of"
                    " the lines"
                )
            if key.partition("@")[0] not in _KNOWN_KEYS:
                raise InputError(
                    f"{label}, line {number}: {match[1][:60]} is not a supported key of a SIMPACK file; remove it"
                )
            values[key] = match[2], number
        else:
            raise InputError(
                f"{label}, line {number}: {line[:60]!r} is neither a key nor a block of a SIMPACK file; remove the line"
            )
    if is_inside or not has_ended:
        raise InputError(f"{label}: the points are not between point.begin and point.end; the file may be truncated")
    if "type@header" not in values:
        raise InputError(f"{label}: the header has no type; add type = 0 for a rail or type = 1 for a wheel")
    return _SimpackKeys(label=label, values=values), [_parse_row(label, *row) for row in rows]


def _process_points(keys: _SimpackKeys, rows: list[tuple[float, float]]) -> tuple[Floats, list[str]]:
    """Process the points as the keys of the file demand.

    Parameters
    ----------
    keys
        Keys of the file.
    rows
        Points (y, z) in the unit of the file.

    Returns
    -------
    points, notes
        Points (n, 2) in the unit of the file, and notes.

    Raises
    ------
    InputError
        A key has an invalid value.
    """
    table, notes = np.array(rows).reshape(-1, 2), []
    closest_mm = keys.number("point.dist.min", 0.0)
    if closest_mm > 0.0 and len(table):
        count, table = len(table), drop_close_points(table, closest_mm)
        notes.append(f"{count_text(count - len(table), 'point')} closer than point.dist.min left out")
    shift = (keys.number("shift.y", 0.0), keys.number("shift.z", 0.0))
    angle = keys.number("rotate", 0.0) / (keys.number("units.ang.f", 1.0) or 1.0)
    if any(shift):
        table = table + np.array(shift)
        notes.append(f"shifted by ({shift[0]:g}, {shift[1]:g}) as the file demands")
    if angle:
        c, s = np.cos(angle), np.sin(angle)
        table = table @ np.array([[c, s], [-s, c]])
        notes.append(f"rotated by {1e3 * angle:g} mrad as the file demands")
    for column, axis in enumerate("yz"):
        low, high = keys.number(f"bound.{axis}.min", 1.0), keys.number(f"bound.{axis}.max", 0.0)
        # the format expresses a missing bound by a lower bound above the upper bound
        if low < high:
            inside = (table[:, column] >= low) & (table[:, column] <= high)
            notes.append(
                f"{count_text(int(np.count_nonzero(~inside)), 'point')} outside {axis} = {low:g} to {high:g} left out"
            )
            table = table[inside]
    for sign, axis in (((-1.0, 1.0), "y"), ((1.0, -1.0), "z")):
        if keys.flag(f"mirror.{axis}"):
            table = table * sign
            notes.append(f"mirrored in {axis} as the file demands")
    if keys.flag("inversion"):
        table = table[::-1]
    if keys.number("approx.smooth", 0.0):
        notes.append("approx.smooth of the file is not applied, because only SIMPACK has this smoothing")
    return table, notes


def _parse_row(label: str, fields: list[str], line: int) -> tuple[float, float]:
    values = [value for field in fields if (value := parse_number(field)) is not None and np.isfinite(value)]
    if len(fields) in (2, 3) and len(values) == len(fields):
        return values[0], values[1]
    raise InputError(
        f"{label}, line {line}: {' '.join(fields)[:60]!r} must be two numbers, y and z, or three with a weight"
    )
