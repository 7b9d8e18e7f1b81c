"""Folder of a fleet: its files, their checksums, and the refusal of changed, foreign and linked files.

`fleet.json` has the checksums of all tables of the screening, `sample.json` of the sample, and `answer.json` of the
report. `fleet.json` is written last: a run that ends before leaves tables that `read_record` refuses until the same
command ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, get_args

from fecontact.errors import InputError
from fecontact.features.fleet.model import ScreeningTheory
from fecontact.features.fleet.packages import import_parquet
from fecontact.files import (
    describe_object,
    explain_broken_seal,
    hash_file,
    list_companions,
    read_json,
    remove_unfinished,
    write_sealed,
)
from fecontact.inputs.kinds import to_float
from fecontact.inputs.texts import count_text, quote_path
from fecontact.jobs.store import LOCK, find_damage, lock_folder
from fecontact.outputs.study_report import REPORT_FILE
from fecontact.runs.folder import prepare_folder
from fecontact.runs.identity import digest_json

FLEET_RECORD, FLEET_FILE = "fleet.json", "fleet.toml"
PROFILES, SCREEN = "profiles.parquet", "screen"
SAMPLE, SAMPLE_RECORD = "sample.parquet", "sample.json"
ANSWER, ANSWER_RECORD = "answer.csv", "answer.json"
REPORT_FOLDER, SAMPLE_FOLDER = "report", "sample"
SYSTEM_REMEDY = "free memory or disk space, or use fewer --workers, and run the same command again"
"""Remedy for a lack of memory, disk space or workers."""
PROFILE_JOBS, PAIR_JOBS = "profiles", "pairs"
"""Folders of the finished files and pairs."""
_FOLDERS = (SCREEN, PROFILE_JOBS, PAIR_JOBS, REPORT_FOLDER, SAMPLE_FOLDER)
_FILES = (
    *(FLEET_RECORD, FLEET_FILE, PROFILES, SAMPLE, SAMPLE_RECORD, ANSWER, ANSWER_RECORD, REPORT_FILE, LOCK, "run.log"),
    f"{SAMPLE_FOLDER}/run.log",
)
_PART_NAME = re.compile(r"part-\d{6}\.parquet")
_REPORT_KIND, _UNFINISHED_REPORT = "fleet report", ""
# Columns of every table that a screening wrote, also by earlier versions.
_PART_COLUMNS = {"wheel", "rail", "weight", "shift_mm", "load_kN", "verdict"}
# Characters of a pattern in the names that DuckDB reads.
_PATTERN_SIGNS = re.compile(r"([*?\[])")


def describe_rerun(folder: Path) -> str:
    """Remedy for tables that cannot be used.

    Parameters
    ----------
    folder
        Folder of the results.

    Returns
    -------
    str
        The command to run.
    """
    command = f"fecontact fleet run FLEET.toml --out {quote_path(folder)}"
    return f"run the same command again: {command} (finished jobs are kept)"


def describe_unscreened(unscreened: int, pairs: int) -> str:
    """Words on pairs that were not screened, with the remedy.

    The reason is a lack of memory, disk space or workers, and not in the files.

    Parameters
    ----------
    unscreened
        Number of these pairs, at least 1.
    pairs
        Number of all pairs.

    Returns
    -------
    str
        Words for a headline; they start with "the screen decided nothing" if no pair was screened.

    Examples
    --------
    >>> from fecontact.features.fleet.sealed_folder import describe_unscreened
    >>> print(describe_unscreened(1, 3).partition(";")[0])
    1 of 3 pairs was not screened, for want of memory, disk space or workers, and is REFUSED
    """
    count = f"{unscreened} of {count_text(pairs, 'pair')} {'was' if unscreened == 1 else 'were'} not screened"
    result = f"and {'is' if unscreened == 1 else 'are'} REFUSED"
    if unscreened == pairs:
        count, result = f"the screen decided nothing: {count}", "which the files did not cause"
    return f"{count}, for want of memory, disk space or workers, {result}; {SYSTEM_REMEDY}"


def describe_redraw(folder: Path, draws: int | None = None) -> str:
    """Remedy for a sample that cannot be used.

    Parameters
    ----------
    folder
        Folder of the fleet.
    draws
        Number of positions of the sample, if it is known.

    Returns
    -------
    str
        The command to run.
    """
    count = "" if draws is None else f" --finite-elements {draws}"
    return f"draw again: fecontact fleet sample {quote_path(folder)}{count} (solved positions are kept)"


# --- Before anything is written.


def prepare_for_fleet(file: Path, out: Path, *, force: bool = False) -> None:
    """Create the folder of a fleet's results and check that it can be written.

    Parameters
    ----------
    file
        File of the fleet.
    out
        Folder of the results.
    force
        Whether results of a different fleet are replaced.

    Raises
    ------
    InputError
        If the folder has other results or files of the user with the names of the results, is not readable as a folder
        of a fleet, or has links in place of its files.
    OSError
        If the folder cannot be written.
    """
    _refuse_name(file, "the path of the fleet")
    _refuse_name(out, "--out")
    refuse_links(out)
    written_files = [FLEET_RECORD, PROFILES]
    if not _has_equal_text(out / FLEET_FILE, file):
        written_files.append(FLEET_FILE)
    prepare_folder(out, FLEET_RECORD, lambda stored: _is_same_fleet(stored, file, out), force, written_files)


def _has_equal_text(copy: Path, file: Path) -> bool:
    """Whether the copy of a fleet's file exists and has the text of the file."""
    return copy.is_file() and file.is_file() and copy.read_bytes() == file.read_bytes()


def _refuse_name(path: Path, subject: str) -> None:
    """Raise InputError for a path that the tables or DuckDB cannot have."""
    text = path.absolute().as_posix()
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{subject} {escape_path(path)} is not UTF-8; rename the folder") from None
    if "\\" in text and _PATTERN_SIGNS.search(text):
        raise InputError(
            rf"{subject} {path} has a backslash together with *, ? or [; allowed: one of the two; rename the folder"
        )


def escape_path(path: Path | str) -> str:
    r"""Text of a path in which bytes that are not UTF-8 are escaped.

    Parameters
    ----------
    path
        Path or name of a file.

    Returns
    -------
    str
        Text that can be printed and stored.

    Examples
    --------
    >>> import os
    >>> from fecontact.features.fleet.sealed_folder import escape_path
    >>> escape_path(os.fsdecode(b"rail\xff.csv"))
    'rail\\xff.csv'
    """
    return str(path).encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _is_same_fleet(stored: Mapping[str, Any], file: Path, out: Path) -> bool:
    """Whether stored results are of a fleet file.

    The file has an unchanged path, either relative to the folder of the results or absolute. A renamed file with an
    unchanged text is an equal fleet too.
    """
    present, stored_folder = file.resolve(), Path(stored["folder"])
    places = {(out.resolve() / stored["file"]).resolve(), (stored_folder / Path(stored["file"]).name).resolve()}
    if present in places:
        return True
    return present.parent == stored_folder.resolve() and _has_equal_text(out / FLEET_FILE, present)


def refuse_links(out: Path) -> None:
    """Refuse links, pipes and other objects in place of the files of a fleet.

    Parameters
    ----------
    out
        Folder of the results.

    Raises
    ------
    InputError
        For the first of them: a link may lead out of the folder, and a pipe never ends.
    """
    for name in _FOLDERS:
        path = out / name
        if path.is_symlink() or (path.exists() and not path.is_dir()):
            raise InputError(
                f"{path} is {describe_object(path)} instead of a folder; remove it, or give another folder"
            )
    for name in _FILES:
        _refuse_special_file(out / name)


def _refuse_special_file(path: Path) -> None:
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise InputError(f"{path} is {describe_object(path)} instead of a file; remove it, or give another folder")


def list_own_parts(out: Path) -> set[str]:
    """Names of the tables of positions that earlier runs wrote into a folder.

    Parameters
    ----------
    out
        Folder of the results.

    Returns
    -------
    set of str
        Names in `screen/`.

    Raises
    ------
    InputError
        For a Parquet file that no screening wrote: it would be read together with the tables, or be overwritten.
    """
    sealed_names = _list_sealed_names(out / FLEET_RECORD)
    own_parts = set()
    for path in _list_parts(out):
        _refuse_special_file(path)
        if not (f"{SCREEN}/{path.name}" in sealed_names or _is_screen_table(path)):
            raise InputError(f"{path} is not a table of this fleet; move it to a different folder")
        own_parts.add(path.name)
    return own_parts


def _list_parts(out: Path) -> list[Path]:
    """Parquet files in `screen/`, sorted; unfinished files have names with a dot at the start."""
    folder = out / SCREEN
    entries = folder.iterdir() if folder.is_dir() else ()
    return sorted(path for path in entries if path.suffix == ".parquet" and not path.name.startswith("."))


def _list_sealed_names(record: Path) -> set[str]:
    """Names of the files with checksums in a record; empty if the record is missing or damaged."""
    try:
        document = read_json(record)
        return set() if explain_broken_seal(record, document) else set(list_companions(document))
    except (InputError, AttributeError):
        return set()


def _is_screen_table(path: Path) -> bool:
    """Whether a file has the name and the columns of a table of positions."""
    if not _PART_NAME.fullmatch(path.name):
        return False
    try:
        with path.open("rb") as file:
            return set(import_parquet().read_schema(file).names) >= _PART_COLUMNS
    except (OSError, ValueError):
        return False


# --- Records with checksums.


def write_record(out: Path, record: Mapping[str, object], parts: Iterable[str]) -> Path:
    """Write `fleet.json` with the checksums of all tables.

    Parameters
    ----------
    out
        Folder of the results.
    record
        Content.
    parts
        Names of the tables in `screen/`.

    Returns
    -------
    Path
        The file.
    """
    tables = [out / PROFILES, out / FLEET_FILE, *(out / SCREEN / name for name in sorted(parts))]
    return write_sealed(out / FLEET_RECORD, record, tables)


def read_record(folder: Path) -> dict[str, Any]:
    """Read `fleet.json`, and check that all tables of the screening are unchanged.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Returns
    -------
    dict
        Content of `fleet.json`.

    Raises
    ------
    InputError
        If the folder has no screened fleet, or a table was changed, removed or added.
    """
    record = folder / FLEET_RECORD
    if not record.exists():
        raise InputError(
            f"{folder} has no screened fleet ({FLEET_RECORD} is missing); screen it: fecontact fleet run FLEET.toml"
            f" --out {quote_path(folder)}"
        )
    document = _read_sealed(record, describe_rerun(folder))
    sealed_parts = _select_parts(document)
    checksums = list_companions(document)
    if not sealed_parts or not {PROFILES, FLEET_FILE} <= checksums.keys():
        raise InputError(
            f"{record} has no checksums of the tables (an earlier version wrote it); {describe_rerun(folder)}"
        )
    if problem := find_damage(folder, checksums):
        raise InputError(f"{folder}: {problem}; {describe_rerun(folder)}")
    if problem := _find_wrong_entry(document):
        raise InputError(f"{record}: {problem}; {describe_rerun(folder)}")
    if added := {f"{SCREEN}/{path.name}" for path in _list_parts(folder)} - sealed_parts.keys():
        raise InputError(f"{folder}: {min(added)} was added after the screening; {describe_rerun(folder)}")
    return document


def _find_wrong_entry(record: Mapping[str, Any]) -> str:
    """First entry of `fleet.json` that does not have its type; empty if there is none."""
    for name in ("folder", "population", "file", "headline"):
        if not isinstance(text := record.get(name, None if name == "folder" else ""), str) or "\0" in text:
            return f"{name} is not a text, or has a NUL character"
    if record.get("theory") not in get_args(ScreeningTheory):
        return f"theory is {record.get('theory')!r:.80}; allowed: {', '.join(get_args(ScreeningTheory))}"
    share = to_float(record.get("suspicious_share", 0.0))
    if share is None or not 0.0 <= share <= 1.0:
        return "suspicious_share is not a number from 0 to 1"
    unscreened, pairs = (record.get(name, 0) for name in ("unscreened_pairs", "pairs"))
    is_count = all(isinstance(number, int) for number in (unscreened, pairs))
    return "" if is_count and 0 <= unscreened <= pairs else "unscreened_pairs is not a whole number from 0 to pairs"


def _read_samples(path: Path, remedy: str) -> list[dict[str, Any]]:
    """Checksums of the samples in `sample.json`; raises InputError if the file was changed or has another layout."""
    samples = _read_sealed(path, remedy).get("samples")
    if not isinstance(samples, list) or not samples or not all(map(_is_sample, samples)):
        raise InputError(f"{path} has a different layout; {remedy}")
    return samples


def _is_sample(state: Any) -> bool:
    """Whether an entry of `sample.json` has both of its checksums."""
    return isinstance(state, Mapping) and all(isinstance(state.get(name), str) for name in ("checksum", "screen"))


def _read_sealed(path: Path, remedy: str) -> dict[str, Any]:
    """Content of a record, which `write_sealed` wrote; raises InputError if it was changed."""
    try:
        document = read_json(path)
    except InputError as error:
        raise InputError(f"{str(error).partition('; ')[0]}; {remedy}") from None
    problem = explain_broken_seal(path, document) if isinstance(document, dict) else f"{path} has a different layout"
    if problem:
        raise InputError(f"{problem}; {remedy}")
    content: dict[str, Any] = document
    return content


def _select_parts(record: Mapping[str, Any]) -> dict[str, str]:
    """Checksums of the tables of positions, by their names in the folder."""
    return {name: digest for name, digest in list_companions(record).items() if name.startswith(f"{SCREEN}/")}


def list_part_paths(folder: Path, record: Mapping[str, Any]) -> list[Path]:
    """Paths of the tables of positions.

    Parameters
    ----------
    folder
        Folder of a screened fleet.
    record
        Content of `fleet.json`.

    Returns
    -------
    list of Path
        Files in the order of the tables.
    """
    return [folder / name for name in sorted(_select_parts(record))]


def name_for_duckdb(path: Path) -> str:
    """Absolute path in which the signs of a pattern are escaped.

    Parameters
    ----------
    path
        File.

    Returns
    -------
    str
        Name that stands for this file only.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fecontact.features.fleet.sealed_folder import name_for_duckdb
    >>> name_for_duckdb(Path("/data/run [1]/a.parquet"))
    '/data/run [[]1]/a.parquet'
    """
    return _PATTERN_SIGNS.sub(r"[\1]", path.absolute().as_posix())


def digest_screen(record: Mapping[str, Any]) -> str:
    """Digest of all tables of positions, which a sample belongs to."""
    return digest_json(sorted(_select_parts(record).items()))


def write_sample_record(folder: Path, table: Path, screen: str, *, keep_earlier: bool) -> None:
    """Write `sample.json` with the checksum of a sample.

    Parameters
    ----------
    folder
        Folder of the fleet.
    table
        Table of the sample, before or after it has its final name.
    screen
        Digest of the tables from which the sample was drawn.
    keep_earlier
        Whether the checksum of the earlier sample stays valid, until the table has its final name.
    """
    states = [{"checksum": hash_file(table), "screen": screen}]
    if keep_earlier and (folder / SAMPLE_RECORD).exists():
        states += _read_samples(folder / SAMPLE_RECORD, describe_redraw(folder))
    write_sealed(folder / SAMPLE_RECORD, {"kind": "fleet sample", "samples": states})


def check_sample(folder: Path) -> str | None:
    """Check that the sample of a fleet is unchanged.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Returns
    -------
    str or None
        Digest of the tables from which the sample was drawn; None without a sample.

    Raises
    ------
    InputError
        If `sample.parquet` or `sample.json` was changed or removed.
    """
    table, record = folder / SAMPLE, folder / SAMPLE_RECORD
    if not any(path.is_symlink() or path.exists() for path in (table, record)):
        return None
    remedy = f"remove {SAMPLE} and {SAMPLE_RECORD}, and {describe_redraw(folder)}"
    for path in (table, record):
        if not path.is_symlink() and not path.exists():
            raise InputError(f"{path} is missing; {remedy}")
    for state in _read_samples(record, remedy):
        problem = find_damage(folder, {SAMPLE: state["checksum"]})
        if problem is None:
            return str(state["screen"])
    raise InputError(f"{folder}: {problem}; {remedy}")


def write_answer_record(folder: Path, headline: str, record: Mapping[str, Any], files: Sequence[Path]) -> None:
    """Write `answer.json` with the checksums of the files of a report.

    Parameters
    ----------
    folder
        Folder of the fleet.
    headline
        Answer in a sentence.
    record
        Content of `fleet.json`, to whose tables the report belongs.
    files
        Files of the report.
    """
    content = {"kind": _REPORT_KIND, "headline": headline, "tables": _digest_tables(record)}
    write_sealed(folder / ANSWER_RECORD, content, files)


def refuse_foreign_report(folder: Path) -> None:
    """Refuse a folder with files that a report would overwrite and no report wrote.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Raises
    ------
    InputError
        With the names of the files.
    """
    names = [name for name in (REPORT_FILE, ANSWER, ANSWER_RECORD) if (folder / name).exists()]
    if names and not _has_report(folder):
        raise InputError(
            f"{folder} has {', '.join(names)}, which no report of this fleet wrote and which would be overwritten; move"
            " or rename them"
        )


def mark_report(folder: Path) -> None:
    """Write an `answer.json` without files before the first report.

    It tells the files of a killed report from files of the user.

    Parameters
    ----------
    folder
        Folder of a screened fleet.
    """
    if not _has_report(folder):
        write_sealed(folder / ANSWER_RECORD, {"kind": _REPORT_KIND, "headline": "", "tables": _UNFINISHED_REPORT})


def _has_report(folder: Path) -> bool:
    """Whether a report of a fleet was written into its folder, or was begun."""
    try:
        document = read_json(folder / ANSWER_RECORD)
    except InputError:
        return False
    return isinstance(document, dict) and document.get("kind") == _REPORT_KIND


def _digest_tables(record: Mapping[str, Any]) -> str:
    """Digest of all tables of a screening."""
    return digest_json(sorted(list_companions(record).items()))


def remove_outdated_report(folder: Path) -> bool:
    """Remove the report of earlier tables; only files that are unchanged since the report are removed.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Returns
    -------
    bool
        Whether there was a report of different tables.
    """
    path = folder / ANSWER_RECORD
    try:
        report, record = _read_sealed(path, ""), _read_sealed(folder / FLEET_RECORD, "")
        if report.get("tables") in (_UNFINISHED_REPORT, _digest_tables(record)):
            return False
    except InputError:
        # no report, or a changed one
        return False
    for name, checksum in list_companions(report).items():
        if not (folder / name).is_symlink() and find_damage(folder, {name: checksum}) is None:
            (folder / name).unlink()
    path.unlink()
    return True


# --- Use of a screened fleet.


@contextmanager
def lock_fleet(folder: Path) -> Iterator[None]:
    """Lock the folder of a screened fleet against runs, while tables are read or written.

    Temporary files of a killed report or sample are removed.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Yields
    ------
    None
        Control to the enclosed code.

    Raises
    ------
    InputError
        If the folder has no fleet, has links in place of its files, or is used by another process.
    """
    if not (folder / FLEET_RECORD).exists():
        read_record(folder)
    refuse_links(folder)
    with lock_folder(folder):
        # of a killed report or sample
        remove_unfinished(folder, _FILES)
        if (report_folder := folder / REPORT_FOLDER).is_dir():
            remove_unfinished(report_folder)
        yield
