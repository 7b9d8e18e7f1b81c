"""The population of a fleet: its files and what is known of each, its pairs, and the weight of every one."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, shares
from fecontact.features.fleet.tables import rows_of, weight_of
from fecontact.profiles.library import is_known
from fecontact.profiles.readers.columns import file_bytes

Body = Literal["wheel", "rail"]
BODIES: tuple[Body, ...] = ("wheel", "rail")
Pair = tuple[str, str]
"""Names of a wheel and a rail."""
MOST_FILES, MOST_PAIRS = 100_000, 1_000_000
# Files of the other body, by their endings; a folder of an instrument has both.
_OF_THE_OTHER = {"wheel": (".ban", ".prr"), "rail": (".whl", ".prw")}
_OWN_COLUMNS = ("file", "name", "weight")


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A profile as it was given, before it is read.

    Attributes
    ----------
    spec
        Absolute path of its file, or its name in the library.
    content_hash
        SHA-256 of the file; empty where it cannot be read, or is of the library.
    known
        What a table says of it: columns and values.
    problem, remedy
        Why it is not even read.
    """

    body: Body
    name: str
    spec: str
    weight: float = 1.0
    content_hash: str = ""
    known: Mapping[str, Any] = field(default_factory=dict)
    problem: str = ""
    remedy: str = ""


def candidates(fleet: Fleet, body: Body) -> list[Candidate]:
    """All wheels, or all rails, of a fleet in their order; a file that is there twice has a problem.

    Raises
    ------
    InputError
        If there is none, there are too many, or a table cannot be read.
    """
    texts = fleet.wheels if body == "wheel" else fleet.rails
    given = (one for text in texts for one in _given(fleet.folder, text, body))
    found = list(islice(given, MOST_FILES + 1))
    if not found:
        raise InputError(f"[{body}s]: {', '.join(texts)} has no file; give a folder or a glob that has some")
    if len(found) > MOST_FILES:
        raise InputError(f"[{body}s]: more than {MOST_FILES} files; allowed: up to that; give a part of them")
    names: dict[str, str] = {}
    contents: dict[tuple[str, str], str] = {}
    return [_checked(_named(one, names), contents) for one in found]


def _given(folder: Path, text: str, body: Body) -> Iterator[Candidate]:
    path = folder / text
    if is_known(text) and not path.exists():
        yield Candidate(body=body, name=text, spec=text)
    elif any(sign in text for sign in "*?["):
        yield from (_of_file(one, body) for one in sorted(folder.glob(text)) if one.is_file())
    elif path.is_dir():
        files = (one for one in sorted(path.iterdir()) if one.is_file() and not one.name.startswith("."))
        yield from (_of_file(one, body) for one in files if one.suffix.lower() not in _OF_THE_OTHER[body])
    elif path.suffix.lower() == ".parquet" or _is_table(path):
        yield from _of_table(path, body)
    else:
        yield _of_file(path, body)


def _of_file(path: Path, body: Body) -> Candidate:
    return Candidate(body=body, name=path.stem, spec=str(path.absolute()))


def _is_table(path: Path) -> bool:
    """Whether a CSV file names files, and is no profile itself."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return "file" in (name.strip().strip('"') for name in file.readline(10_000).split(","))


def _of_table(path: Path, body: Body) -> Iterator[Candidate]:
    for number, row in enumerate(rows_of(path, ["file"], MOST_FILES), start=1):
        known = {name: value for name, value in row.items() if name not in _OWN_COLUMNS}
        weight = weight_of(row, f"table {path}, row {number}")
        given = str(row["file"])
        file = path.parent / given
        spec = given if is_known(given) and not file.exists() else str(file.absolute())
        yield Candidate(body=body, name=str(row.get("name") or file.stem), spec=spec, weight=weight, known=known)


def _named(one: Candidate, taken: dict[str, str]) -> Candidate:
    """With a name that no other has: that of the file, with its ending and folder where others have it too."""
    path = Path(one.spec)
    choices = (one.name, path.name, f"{path.parent.name}/{path.name}")
    numbered = (f"{one.name}#{number}" for number in range(2, MOST_FILES + 3))
    name = next(name for name in chain(choices, numbered) if name not in taken)
    taken[name] = one.spec
    return replace(one, name=name)


def _checked(one: Candidate, contents: dict[tuple[str, str], str]) -> Candidate:
    if is_known(one.spec):
        content = one.spec
    else:
        try:
            content = hashlib.sha256(file_bytes(Path(one.spec))).hexdigest()
        except InputError as error:
            return replace(one, problem=str(error), remedy="check the path")
        one = replace(one, content_hash=content)
    same = contents.setdefault((content, repr(one.known.get("mirror"))), one.name)
    if same != one.name:
        return replace(one, problem=f"it has the content of {same}", remedy="give it once, with the sum of the weights")
    return one


def pairs_of(
    fleet: Fleet, wheels: Mapping[str, float], rails: Mapping[str, float], known: set[str]
) -> dict[Pair, float]:
    """Weight of each pair of wheels and rails that were read; the weights sum to 1.

    Parameters
    ----------
    wheels, rails
        Weights by name, of those that were read.
    known
        Names of all, also of those that were refused, whose pairs are left out.

    Raises
    ------
    InputError
        If there are too many pairs, or none, or a table names an unknown one.
    """
    (of_wheels, of_rails) = shares(wheels.items(), "[wheels]"), shares(rails.items(), "[rails]")
    if fleet.pairing.table is not None:
        path = fleet.folder / fleet.pairing.table
        return shares(_listed(path, of_wheels, of_rails, known), f"table {path}")
    if fleet.pairing.draw is not None:
        draw = np.random.default_rng(fleet.seed).choice
        count = round(fleet.pairing.draw)
        drawn = (draw(list(one), count, p=list(one.values())) for one in (of_wheels, of_rails))
        return shares(((pair, 1.0) for pair in zip(*(map(str, one) for one in drawn), strict=True)), "[pairs]")
    if (count := len(of_wheels) * len(of_rails)) > MOST_PAIRS:
        raise InputError(f"[pairs]: {count} pairs; allowed: up to {MOST_PAIRS}; draw some: draw = 10000 in [pairs]")
    return {(wheel, rail): of_wheels[wheel] * of_rails[rail] for wheel in of_wheels for rail in of_rails}


def _listed(
    path: Path, wheels: Mapping[str, float], rails: Mapping[str, float], known: set[str]
) -> Iterator[tuple[Pair, float]]:
    for number, row in enumerate(rows_of(path, ["wheel", "rail"], MOST_PAIRS), start=1):
        wheel, rail = str(row["wheel"]), str(row["rail"])
        if unknown := {f"wheel {wheel}", f"rail {rail}"} - known:
            raise InputError(
                f"table {path}, row {number}: there is no {min(unknown)}; give names as profiles have them"
            )
        if wheel in wheels and rail in rails:
            yield (wheel, rail), weight_of(row, f"table {path}, row {number}") * wheels[wheel] * rails[rail]
