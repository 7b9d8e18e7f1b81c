"""Files that `[wheels]` and `[rails]` name: tables that list files, and texts that may be tables or profiles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from fecontact.errors import InputError
from fecontact.features.fleet.sealed_folder import ANSWER_RECORD, SAMPLE_RECORD
from fecontact.features.fleet.table_columns import Body
from fecontact.files import list_companions, read_json, read_toml
from fecontact.inputs.table_files import guess_cells, is_parquet, is_workbook
from fecontact.inputs.user_tables import reduce_name
from fecontact.jobs.store import LOCK, MANIFEST
from fecontact.profiles.library import is_library_name
from fecontact.profiles.readers.columns import is_miniprof
from fecontact.profiles.readers.formats import READERS
from fecontact.profiles.readers.numerals import parse_number
from fecontact.runs.casefile import list_result_files

# Files of a run, also of a run that ended early.
_RUN_FILES = (LOCK, "run.log")
# Endings of files in a folder of results that are no profiles.
_REPORT_SUFFIXES = (".html", ".png", ".svg", ".json", ".log", ".parquet")
# Folders above a file in which a record may name it: `sample/cases/ID/profiles/rail/` is the deepest folder.
_LEVELS = 6
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


def select_profile_files(files: Iterable[Path], tables: Iterable[Path]) -> Iterator[Path]:
    """Files of a folder or a glob that may be profiles.

    Results of the program, files of fleets and of studies, and tables are left out.

    Parameters
    ----------
    files
        Files in their order.
    tables
        Tables of pairs and of positions of the fleet.

    Yields
    ------
    Path
        A file that may be a profile.
    """
    own_tables = {table.resolve() for table in tables}
    results: dict[Path, frozenset[Path]] = {}
    for path in files:
        file = path.resolve()
        is_result = path.name in _RUN_FILES or any(
            file in (results[folder] if folder in results else results.setdefault(folder, _list_results(folder)))
            for folder in file.parents[:_LEVELS]
        )
        if not (is_result or file in own_tables or is_file_table(path) or _is_definition(path)):
            yield path


def _list_results(folder: Path) -> frozenset[Path]:
    """Files that the manifest and the records of a folder name, and these records."""
    names: set[str] = set()
    for record in (MANIFEST, SAMPLE_RECORD, ANSWER_RECORD, *list_result_files()):
        if not (folder / record).is_file():
            continue
        names.add(record)
        if record != MANIFEST:
            names |= {path.name for path in folder.iterdir() if path.suffix.lower() in _REPORT_SUFFIXES}
        try:
            document = read_json(folder / record)
            names |= {*(document["files"] if record == MANIFEST else list_companions(document))}
        except (InputError, KeyError, TypeError, AttributeError):
            # a damaged record names no other files
            continue
    return frozenset(folder / name for name in names)


def _is_definition(path: Path) -> bool:
    """Whether a file defines a fleet or a study instead of a profile."""
    if path.suffix.lower() != ".toml":
        return False
    try:
        keys = read_toml(path, str(path)).keys()
    except InputError:
        return False
    return {"wheels", "rails"} <= keys or "case" in keys


def refuse_unclear_table(path: Path, body: Body) -> None:
    """Refuse a text that is neither points nor a table with a column of files.

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
    if any(_is_file_cell(cell) for cells in lines[1:] for cell in cells):
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
