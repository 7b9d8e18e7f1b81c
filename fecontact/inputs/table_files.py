"""Cells of tables that users give as CSV or Parquet files."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.files import open_regular_file
from fecontact.inputs.texts import count_text

_LARGEST_BYTES = 500_000_000
_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
_FIRST_LINE = re.compile(r'(?:"(?:[^"]|"")*"|[^"\r\n])*')
_QUOTED = re.compile(r'"(?:[^"]|"")*"')
_UTF_16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_SAVE_AS = "save the table as CSV in UTF-8"
# First line by which Excel states the separator.
_SEPARATOR_LINE = re.compile(r"""["']?sep=([^"'\r\n])["']?[,;\t ]*(?:\r\n|\r|\n|$)""", re.IGNORECASE)
_WORKBOOK_SUFFIXES = (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods", ".numbers")
_WORKBOOK_STARTS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


@dataclass(frozen=True, kw_only=True)
class TableFile:
    """Cells of a table in a file.

    Attributes
    ----------
    names
        Names of the columns, as in the file.
    rows
        Cells of each row, to be read once.
    count
        Number of rows; 0 if it is not known before the rows are read.
    is_text
        Whether all cells are texts, as in CSV.
    has_semicolons
        Whether semicolons separate the columns.
    """

    names: Sequence[str]
    rows: Iterator[Sequence[Any]]
    count: int = 0
    is_text: bool = True
    has_semicolons: bool = False


def is_parquet(path: Path) -> bool:
    """Whether a file is Parquet, by its ending."""
    return path.suffix.lower() == ".parquet"


def is_workbook(path: Path) -> bool:
    """Whether a file is a workbook of a spreadsheet, by its ending."""
    return path.suffix.lower() in _WORKBOOK_SUFFIXES


def open_table_file(path: Path) -> TableFile:
    """Open a table.

    Parameters
    ----------
    path
        Parquet file with the ending .parquet, or CSV file. Columns of a CSV file are separated by commas, semicolons or
        tabs; its text is as for `decode_text`. A first line such as `sep=;` states the separator. Columns without name
        and without any value at the right end, as Excel writes them, are left out.

    Returns
    -------
    TableFile
        Cells of the table. Reading its rows can raise InputError too.

    Raises
    ------
    InputError
        If the file cannot be read or is not a table, with the row or the line.
    """
    subject = f"table {path}"
    if is_parquet(path):
        return _open_parquet(path, subject)
    content = _read_bytes(path, subject)
    if is_workbook(path) or content.startswith(_WORKBOOK_STARTS):
        raise InputError(f"{subject} is a workbook of a spreadsheet; allowed: CSV or Parquet; {_SAVE_AS}")
    text = decode_text(content, subject)
    stated = _SEPARATOR_LINE.match(text)
    if not text[stated.end() if stated else 0 :].strip():
        raise InputError(f"{subject}: row 1 is missing: the file is empty; give the names of the columns, and rows")
    if stated and stated[1] not in _SEPARATORS:
        raise InputError(
            f"{subject}: line 1 states the separator {stated[1]!r}; allowed: comma, semicolon or tab; {_SAVE_AS}"
        )
    separator = stated[1] if stated else _find_separator(text, subject)
    records = _split_records(text, separator, subject, start=stated.end() if stated else 0)
    names = next(records)
    return TableFile(names=names, rows=records, has_semicolons=separator == ";")


def decode_text(content: bytes, subject: str) -> str:
    """Text of a file in UTF-8, or in UTF-16 with a byte order mark.

    Parameters
    ----------
    content
        Bytes of the file.
    subject
        File in messages.

    Returns
    -------
    str
        Text without the byte order mark.

    Raises
    ------
    InputError
        For a different encoding, with the line and the first byte that is not allowed.
    """
    is_utf_16 = content.startswith(_UTF_16_MARKS)
    try:
        # without a mark, UTF-16 has NUL bytes, which are looked for before other bytes
        text = content.decode("utf-16" if is_utf_16 else "utf-8-sig" if b"\0" not in content else "latin-1")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise InputError(
            f"{subject}: line {line} has the byte 0x{error.object[error.start]:02X}, which is not"
            f" {'UTF-16' if is_utf_16 else 'UTF-8'}; perhaps it is Latin-1 or Windows-1252; {_SAVE_AS}, or convert it:"
            " iconv -f WINDOWS-1252 -t UTF-8"
        ) from None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise InputError(
            f"{subject}: line {line} has a NUL character; perhaps the file is UTF-16 or UTF-32 without a byte order"
            f" mark, or not a text; {_SAVE_AS}"
        )
    return text


def guess_cells(path: Path) -> list[tuple[str, ...]]:
    """Cells of the first lines of a file that may be a CSV table.

    Parameters
    ----------
    path
        Any file.

    Returns
    -------
    list of tuple of str
        Cells without quotes of each line that is not blank, without a line that states the separator; empty for a file
        that cannot be read. A long file is read in part.
    """
    try:
        with open_regular_file(path) as file:
            start = file.read(20_000)
    except (OSError, ValueError):
        return []
    text = start.decode("utf-16" if start.startswith(_UTF_16_MARKS) else "utf-8-sig", "replace")
    lines = [line for line in text.splitlines() if line.strip() and not _SEPARATOR_LINE.fullmatch(line)]
    return [tuple(name.strip().strip('"') for name in re.split(r"[,;\t]", line)) for line in lines]


def _read_bytes(path: Path, subject: str) -> bytes:
    try:
        with open_regular_file(path) as file:
            # Reading with a limit of this many bytes would reserve that memory, even for a small file.
            size = os.fstat(file.fileno()).st_size
            content = file.read() if size <= _LARGEST_BYTES else b""
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{subject} cannot be read ({reason}); give a CSV or Parquet file") from error
    _check_size(size, subject)
    return content


def _check_size(size: int, subject: str) -> None:
    if size > _LARGEST_BYTES:
        raise InputError(
            f"{subject}: more than {_LARGEST_BYTES / 1e6:g} MB; allowed: at most this size; leave out columns or rows"
        )


def _find_separator(text: str, subject: str) -> str:
    """The only separator outside quotes in the first line; a comma for a single column."""
    match = _FIRST_LINE.match(text.lstrip("\r\n"))
    line = _QUOTED.sub("", match[0] if match else "")
    separators = [separator for separator in _SEPARATORS if separator in line]
    if len(separators) > 1:
        names = " and ".join(_SEPARATORS[separator] for separator in separators)
        raise InputError(
            f"{subject}: {names} separate the names of the columns; allowed: one of commas, semicolons, tabs; put a"
            " name with such a character in quotes"
        )
    return separators[0] if separators else ","


def _split_records(text: str, separator: str, subject: str, start: int) -> Iterator[list[str]]:
    """Yield the names of the columns, then the cells of each row; empty lines are left out.

    The names begin at the position `start` of the text. Empty cells to the right of the last name are left out.
    """
    lines = io.StringIO(text, newline="")
    lines.seek(start)
    reader = csv.reader(lines, delimiter=separator, strict=True)
    number, width, skipped = 0, 0, 1 if start else 0
    while True:
        row = f"row {number}" if number else "names of the columns"
        where = f"{subject}, {row} (line {reader.line_num + skipped + 1})"
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise InputError(
                f"{where}: not CSV ({error}); correct the cell: a cell with quotes ends with a quote before the"
                " separator, and a quote in it is written twice"
            ) from None
        if not cells:
            continue
        width = width or _count_filled(cells) or len(cells)
        if len(cells) < width or _count_filled(cells) > width:
            raise InputError(
                f"{where}: {count_text(len(cells), 'cell')} for {count_text(width, 'named column')}; give a cell for"
                f" each column, name each column, and put a cell with {_SEPARATORS[separator]} in quotes"
            )
        yield cells[:width]
        number += 1


def _count_filled(cells: Sequence[str]) -> int:
    """Number of cells up to the last cell that is not blank."""
    return max((number for number, cell in enumerate(cells, start=1) if cell.strip()), default=0)


def _open_parquet(path: Path, subject: str) -> TableFile:
    """Cells of a Parquet file."""
    try:
        parquet, lib = import_module("pyarrow.parquet"), import_module("pyarrow.lib")
    except ImportError as error:
        raise InputError(
            f"{subject}: Parquet needs the package pyarrow; install it: pip install 'fecontact[fleet]'"
        ) from error
    try:
        with open_regular_file(path):
            file = parquet.ParquetFile(path)
        metadata = file.metadata
        groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
        names, count = file.schema_arrow.names, metadata.num_rows
    except (OSError, ValueError, lib.ArrowException) as error:
        raise InputError(f"{subject} cannot be read ({str(error)[:200]}); give a CSV or Parquet file") from error
    _check_size(sum(group.total_byte_size for group in groups), subject)

    def iterate() -> Iterator[Sequence[Any]]:
        """Yield the cells of each row."""
        try:
            for batch in file.iter_batches(batch_size=10_000):
                yield from zip(*(column.to_pylist() for column in batch.columns), strict=True)
        except (OSError, ValueError, lib.ArrowException) as error:
            raise InputError(f"{subject} cannot be read ({str(error)[:200]}); write the file again") from error

    return TableFile(names=names, rows=iterate(), count=count, is_text=False)
