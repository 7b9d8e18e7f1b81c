"""Population of a fleet: its files with their table values, its pairs, and the weight of each."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.features.fleet.file_lists import is_file_table, refuse_unclear_table, select_profile_files
from fecontact.features.fleet.model import Fleet
from fecontact.features.fleet.sealed_folder import escape_path
from fecontact.features.fleet.table_columns import (
    MOST_FILES,
    MOST_PAIRS,
    OPPOSITE_INPUTS,
    PAIR_LAYOUT,
    POSITION_LAYOUT,
    Body,
    describe_columns,
    make_profile_layout,
    name_metadata,
    select_case_values,
    select_reading_values,
)
from fecontact.files import path_exists
from fecontact.inputs.table_files import open_table_file
from fecontact.inputs.user_tables import TableLayout, convert_plain_numbers, read_user_table
from fecontact.profiles.library import find_library_name, is_library_name
from fecontact.profiles.readers.columns import file_bytes

BODIES: tuple[Body, ...] = ("wheel", "rail")
Pair = tuple[str, str]
"""Names of a wheel and a rail."""
# Endings of the files of the other body; a folder of an instrument has files of both bodies.
_SUFFIXES_OF_THE_OTHER_BODY = {"wheel": (".ban", ".prr"), "rail": (".whl", ".prw")}
_LISTED_COLUMNS = ("file", "name", "weight")


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A profile of a fleet before it is read.

    Attributes
    ----------
    body, name
        Wheel or rail, and its unique name.
    spec
        Absolute path of its file, or its name in the library.
    weight
        Weight among the profiles of its body.
    content_hash
        SHA-256 of the file; empty if it cannot be read, or is of the library.
    known
        Values of the declared columns of its row in a table, without file, name and weight.
    metadata
        Values of the other columns of its row, under their names in the table.
    problem, remedy
        Reason why it is not read.
    copy_of
        Name of an earlier profile with the same content and the same options; empty if there is none.
    has_row
        Whether it is a row of a table.
    opposite
        Profile of the other side of the track; None for the mirror image.
    """

    body: Body
    name: str
    spec: str
    weight: float = 1.0
    content_hash: str = ""
    known: Mapping[str, Any] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)
    problem: str = ""
    remedy: str = ""
    copy_of: str = ""
    has_row: bool = False
    opposite: Candidate | None = None


def find_candidates(fleet: Fleet, body: Body) -> list[Candidate]:
    """All wheels, or all rails, of a fleet in their order.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    body
        `wheel` or `rail`.

    Returns
    -------
    list of Candidate
        Profiles with unique names. A profile with the content of an earlier profile has a problem.

    Raises
    ------
    InputError
        If there is no file, there are too many, or a table cannot be read.
    """
    texts = fleet.wheels if body == "wheel" else fleet.rails
    all_candidates = (candidate for text in texts for candidate in _find_candidates(fleet, text, body))
    profiles = _count_once(list(islice(all_candidates, MOST_FILES + 1)))
    if not profiles:
        raise InputError(f"[{body}s]: no file in {', '.join(texts)}; give a folder or a glob with at least one file")
    if len(profiles) > MOST_FILES:
        raise InputError(f"[{body}s]: more than {MOST_FILES} files; allowed: at most this number; give fewer files")
    names: dict[str, str] = {}
    contents: dict[tuple[str, ...], str] = {}
    return [
        _check_content(_assign_unique_name(_check_path(_add_opposite(fleet, candidate)), names), contents)
        for candidate in profiles
    ]


def _add_opposite(fleet: Fleet, candidate: Candidate) -> Candidate:
    """Candidate with the checked profile of the other side.

    The row of the candidate gives this profile, or else the case of the fleet. The file is read with the options of
    the candidate, as the file of a case.
    """
    opposite, spec = candidate.opposite, getattr(fleet.case.opposite, candidate.body)
    if opposite is None and spec is not None:
        opposite = replace(candidate, spec=spec, has_row=False)
    return replace(candidate, opposite=opposite and _check_content(_check_path(opposite), {}))


def _count_once(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Remove candidates of files with equal real paths.

    The row of a table counts in place of the same file in a folder. Several rows of a file stay.
    """
    paths = [os.path.realpath(candidate.spec) for candidate in candidates]
    earlier_paths = {path for candidate, path in zip(candidates, paths, strict=True) if candidate.has_row}
    distinct = []
    for candidate, path in zip(candidates, paths, strict=True):
        if candidate.has_row or path not in earlier_paths or is_library_name(candidate.spec):
            distinct.append(candidate)
        earlier_paths.add(path)
    return distinct


def _find_candidates(fleet: Fleet, text: str, body: Body) -> Iterator[Candidate]:
    """Profiles of a text: a name of the library, a glob, a folder, a table or a file."""
    folder, path = fleet.folder, fleet.folder / text
    tables = [folder / table for table in (fleet.pairing.table, fleet.positions_table) if table is not None]
    if is_library_name(text) and not path.exists():
        yield Candidate(body=body, name=text, spec=text)
    elif not os.path.exists(path) and any(sign in text for sign in "*?["):
        files = select_profile_files(_match_pattern(folder, text, body), tables)
        yield from (_make_file_candidate(file, body) for file in files)
    elif path.is_dir():
        visible_files = (file for file in sorted(path.iterdir()) if file.is_file() and not file.name.startswith("."))
        files = select_profile_files(visible_files, tables)
        yield from (
            _make_file_candidate(file, body)
            for file in files
            if file.suffix.lower() not in _SUFFIXES_OF_THE_OTHER_BODY[body]
        )
    elif is_file_table(path):
        yield from _read_table_candidates(path, body)
    else:
        refuse_unclear_table(path, body)
        yield _make_file_candidate(path, body)


def _match_pattern(folder: Path, pattern: str, body: Body) -> list[Path]:
    """Files of a pattern in their order; the pattern is relative to a folder or absolute.

    Hidden files are left out, as in a folder, unless the pattern asks for them.

    Raises
    ------
    InputError
        If two stars are only a part of a folder's name, which versions of Python read differently.
    """
    parts = Path(pattern).parts
    if any("**" in name and name != "**" for name in parts):
        raise InputError(
            f"[{body}s]: {pattern} has ** next to other characters; allowed: ** alone between slashes; give for example"
            " wheels/**/*.csv"
        )
    if parts[-1] == "**":
        parts = (*parts, "*")
    root, anchor = (folder, "") if not Path(pattern).anchor else (Path(pattern).anchor, Path(pattern).anchor)
    files = Path(root).glob(str(Path(*parts).relative_to(anchor)))
    is_hidden_wanted = parts[-1].startswith(".")
    return sorted(file for file in files if file.is_file() and (is_hidden_wanted or not file.name.startswith(".")))


def _make_file_candidate(path: Path, body: Body) -> Candidate:
    """Profile of a file without a table."""
    return Candidate(body=body, name=path.stem, spec=str(path.absolute()))


def _read_table_candidates(path: Path, body: Body) -> Iterator[Candidate]:
    """Profiles of the rows of a table, with the values of further columns."""
    candidates = [*_read_rows(path, body)]
    names = Counter(candidate.name for candidate in candidates)
    rows = {candidate.name: candidate for candidate in candidates}
    for number, candidate in enumerate(candidates, start=1):
        text = candidate.known.get(OPPOSITE_INPUTS[body])
        if text is None:
            yield candidate
        elif names[text] > 1:
            raise InputError(
                f"table {path}, row {number}: {OPPOSITE_INPUTS[body]} is {text!r}, the name of {names[text]} rows;"
                " allowed: the name of one row; give these rows different names"
            )
        elif text in rows:
            # two wheels of a wheelset name each other: the opposite of the opposite is not needed
            yield replace(candidate, opposite=replace(rows[text], opposite=None))
        else:
            yield replace(candidate, opposite=replace(candidate, spec=_find_spec(path, text), has_row=False))


def _find_spec(table: Path, text: str) -> str:
    """Absolute path of a file in a table, or a name of the library."""
    file = table.parent / text
    return text if is_library_name(text) and not file.exists() else str(file.absolute())


def _read_rows(path: Path, body: Body) -> Iterator[Candidate]:
    """Profiles of the rows of a table, without the profiles of the other side."""
    rows_by_name: dict[str, int] = {}
    for row in read_user_table(path, make_profile_layout(body)):
        if (name := row.values.get("name")) and rows_by_name.setdefault(name, row.number) != row.number:
            raise InputError(
                f"table {path}, row {row.number}: name is {name!r}, as in row {rows_by_name[name]}; allowed: a"
                " different name in each row; correct the cell, or leave it empty for the name of the file"
            )
        yield Candidate(
            body=body,
            name=row.values.get("name", (path.parent / row.values["file"]).stem),
            spec=_find_spec(path, row.values["file"]),
            weight=row.values.get("weight", 1.0),
            known={name: value for name, value in row.values.items() if name not in _LISTED_COLUMNS},
            metadata=row.metadata,
            has_row=True,
        )


def list_candidates(fleet: Fleet) -> list[Candidate]:
    """All wheels and rails of a fleet, with their metadata as in `profiles.parquet`.

    A column of metadata has numbers if each text in it is equal to its number, in all tables. A column with the name of
    a column of the program has the name `user_NAME`.

    Parameters
    ----------
    fleet
        Definition of the fleet.

    Returns
    -------
    list of Candidate
        Wheels, then rails.

    Raises
    ------
    InputError
        As for `find_candidates`, and for columns that differ only by upper case.
    """
    candidates = [candidate for body in BODIES for candidate in find_candidates(fleet, body)]
    columns: dict[str, str] = {}
    for name in dict.fromkeys(name for candidate in candidates for name in candidate.metadata):
        stored_name = name_metadata(name)
        first_name = columns.setdefault(stored_name.casefold(), name)
        if first_name != name:
            raise InputError(
                f"tables of [wheels] and [rails]: columns {first_name!r} and {name!r} have equal names in the results;"
                " allowed: names that differ by more than upper case; rename one of the columns"
            )
    typed_values = {
        name: iter(convert_plain_numbers([row.metadata[name] for row in candidates if name in row.metadata]))
        for name in columns.values()
    }
    return [
        replace(candidate, metadata={name_metadata(name): next(typed_values[name]) for name in candidate.metadata})
        for candidate in candidates
    ]


def describe_tables(fleet: Fleet) -> list[str]:
    """Sentences on the columns of the tables of a fleet: inputs, metadata, and names that may be a mistake.

    Parameters
    ----------
    fleet
        Definition of the fleet.

    Returns
    -------
    list of str
        A sentence for each table.

    Raises
    ------
    InputError
        If a table cannot be read.
    """
    tables: list[tuple[str, TableLayout, bool]] = [
        (text, make_profile_layout(body), True)
        for body, texts in zip(BODIES, (fleet.wheels, fleet.rails), strict=True)
        for text in texts
        if is_file_table(fleet.folder / text)
    ]
    if fleet.pairing.table is not None:
        tables.append((fleet.pairing.table, PAIR_LAYOUT, False))
    if fleet.positions_table is not None:
        tables.append((fleet.positions_table, POSITION_LAYOUT, False))
    return [
        describe_columns(text, layout, open_table_file(fleet.folder / text).names, is_kept=is_kept)
        for text, layout, is_kept in tables
    ]


def _assign_unique_name(candidate: Candidate, names: dict[str, str]) -> Candidate:
    """Candidate with a unique name, which is added to `names`.

    The name is the name of the file, with its ending and folder if several files have this name, or with a number.
    `names` maps each name to the specification of its profile.
    """
    path = Path(candidate.spec)
    choices = (candidate.name, path.name, f"{path.parent.name}/{path.name}")
    numbered = (f"{candidate.name}#{number}" for number in range(2, MOST_FILES + 3))
    name = next(name for name in chain(choices, numbered) if name not in names)
    names[name] = candidate.spec
    return replace(candidate, name=name)


def _check_path(candidate: Candidate) -> Candidate:
    """Candidate, with a problem and a readable path if its path is not UTF-8.

    No table of the results could store such a path.
    """
    name, spec = escape_path(candidate.name), escape_path(candidate.spec)
    if (name, spec) == (candidate.name, candidate.spec):
        return candidate
    problem, remedy = "the name of the file or of its folder is not UTF-8", "rename the file or the folder"
    return replace(candidate, name=name, spec=spec, problem=problem, remedy=remedy)


def _check_content(candidate: Candidate, contents: dict[tuple[str, ...], str]) -> Candidate:
    """Candidate with the hash of its content, or with a problem.

    The problem is a file that cannot be read, or the content of an earlier candidate.
    """
    if candidate.problem:
        return candidate
    if is_library_name(candidate.spec):
        content = find_library_name(candidate.spec)
    else:
        try:
            content = hashlib.sha256(file_bytes(Path(candidate.spec))).hexdigest()
        except InputError as error:
            problem, _, remedy = str(error).partition("; ")
            problem, remedy = _explain_missing_file(candidate) or (problem, remedy or "check the path")
            return replace(candidate, problem=problem, remedy=remedy)
        candidate = replace(candidate, content_hash=content)
    reading = repr(select_reading_values(candidate.known) | select_case_values(candidate.known))
    opposite = candidate.opposite
    opposite_key = "" if opposite is None else f"{opposite.content_hash or opposite.spec} {opposite.known}"
    first_name = contents.setdefault((content, reading, opposite_key), candidate.name)
    if first_name != candidate.name:
        return replace(
            candidate,
            problem=f"same content as {first_name}",
            remedy="list it once, with the sum of the weights",
            copy_of=first_name,
        )
    return candidate


def _explain_missing_file(candidate: Candidate) -> tuple[str, str] | None:
    """Problem and remedy of a name that is neither a file nor in the library; None for other problems."""
    path = Path(candidate.spec)
    if path.suffix or path_exists(path):
        return None
    try:
        find_library_name(path.name, candidate.body)
    except InputError as error:
        problem, _, remedy = str(error).rpartition("; ")
        return problem, remedy
    return None


def list_all_pairs(wheels: Mapping[str, float], rails: Mapping[str, float]) -> dict[Pair, float]:
    """Weights of all pairs of some wheels and rails.

    Parameters
    ----------
    wheels, rails
        Weights by name.

    Returns
    -------
    dict
        Product of the weights by names of wheel and rail.

    Raises
    ------
    InputError
        If there are more than a million pairs.
    """
    if (count := len(wheels) * len(rails)) > MOST_PAIRS:
        raise InputError(
            f"[pairs]: {count} pairs; allowed: at most {MOST_PAIRS}; draw a sample: draw = 10000 in [pairs]"
        )
    return {(wheel, rail): wheels[wheel] * rails[rail] for wheel in wheels for rail in rails}


def list_table_pairs(path: Path, known_names: set[tuple[Body, str]]) -> list[tuple[Pair, float]]:
    """Pairs of a table with their weights in the table.

    Parameters
    ----------
    path
        Table of pairs.
    known_names
        Body and name of each profile of the fleet.

    Returns
    -------
    list of tuple
        Names of wheel and rail, and the weight.

    Raises
    ------
    InputError
        If a row names a profile that is not in the fleet.
    """
    pairs = []
    for row in read_user_table(path, PAIR_LAYOUT):
        wheel, rail = row.values["wheel"], row.values["rail"]
        named_profiles: set[tuple[Body, str]] = {("wheel", wheel), ("rail", rail)}
        if unknown := named_profiles - known_names:
            raise InputError(
                f"table {path}, row {row.number}: there is no {' '.join(min(unknown))}; give the name in its table, or"
                " its file name without ending"
            )
        pairs.append(((wheel, rail), row.values.get("weight", 1.0)))
    return pairs
