"""Files that `[wheels]` and `[rails]` name: tables that list files, and texts that may be tables or profiles."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from fecontact.errors import InputError
from fecontact.features.fleet.table_columns import Body
from fecontact.inputs.table_files import guess_cells, is_parquet, is_workbook
from fecontact.inputs.user_tables import reduce_name
from fecontact.profiles.library import is_library_name
from fecontact.profiles.readers.columns import is_miniprof
from fecontact.profiles.readers.formats import READERS
from fecontact.profiles.readers.numerals import parse_number

# Names of a column by which a text is recognised as a list of files.
_FILE_COLUMNS = {"file", "files", "filename", "path", "filepath"}
_TEXT_SUFFIXES = (".csv", ".tsv", ".tab", ".txt", "")
_COMMENT_SIGNS = ("#", "!", "%", "//")


def is_file_table(path: Path) -> bool:
    """Whether a file is a table that lists files: Parquet, a workbook, or a text with a column of files.

    Parameters
    ----------
    path
        Any path.

    Returns
    -------
    bool
        True for a workbook too, which the reader of tables refuses with the remedy.
    """
    if is_parquet(path) or is_workbook(path):
        return path.is_file()
    if path.suffix.lower() not in _TEXT_SUFFIXES or not path.is_file():
        return False
    names = next(iter(guess_cells(path)), ())
    return not _FILE_COLUMNS.isdisjoint(map(reduce_name, names))


def refuse_unclear_table(path: Path, body: Body) -> None:
    """Refuse a text that is neither a file of points nor a table with the column of files.

    Parameters
    ----------
    path
        File that `[wheels]` or `[rails]` names by itself, and that is not a table.
    body
        `wheel` or `rail`.

    Raises
    ------
    InputError
        If the file is empty, or lists files without the heading of this column.
    """
    if path.suffix.lower() not in _TEXT_SUFFIXES or not path.is_file() or is_miniprof(path):
        return
    lines = [cells for cells in guess_cells(path) if not cells[0].startswith(_COMMENT_SIGNS)]
    remedy = (
        "give a file of points, or a table with the heading file in its first line and the path of a profile in each"
        " row, such as file,weight"
    )
    if not path.stat().st_size or not lines:
        raise InputError(f"[{body}s]: {path} is empty; {remedy}")
    if any(map(_are_numbers, lines)):
        return
    has_files = any(_is_file_cell(cell) for cells in lines[1:] for cell in cells)
    if has_files or max(sum(parse_number(cell) is not None for cell in cells) for cells in lines) < 2:
        headings = ", ".join(lines[0])
        raise InputError(
            f"[{body}s]: {path} has no line of numbers, as points have, and no heading file, as a table has; its first"
            f" line is {headings!r:.80}; {remedy}"
        )


def _are_numbers(cells: Iterable[str]) -> bool:
    """Whether the cells of a line are at least two numbers, apart from empty cells; blanks may separate them."""
    words = [word for cell in cells for word in cell.split()]
    return len(words) > 1 and all(parse_number(word) is not None for word in words)


def _is_file_cell(cell: str) -> bool:
    """Whether a cell names a profile: a name of the library, or a path with the ending of a profile file."""
    return is_library_name(cell) or Path(cell).suffix.lower() in READERS
