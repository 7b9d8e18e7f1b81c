"""What a worker does with a case or a position: solve it, or judge again what is stored, and write its files."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path, PureWindowsPath
from typing import Any, Generic, TypeVar

from fecontact.case import Case, case_from_record
from fecontact.creep import Creep
from fecontact.criteria import Criteria
from fecontact.errors import FecontactError, InputError
from fecontact.files import read_json
from fecontact.jobs.job import Job, Work
from fecontact.outputs.records.results import FOUND_INPUTS
from fecontact.profiles.identity import content_of, file_of_identity
from fecontact.profiles.library import is_known
from fecontact.profiles.short_forms import is_short_form
from fecontact.runs.identity import case_id, origin_of, position_id

FIELDS, PROFILES = "fields.npz", "profiles"
Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True)
class Store(Generic[Result]):
    """How one kind of result is solved, kept and read; functions that a worker can import.

    Attributes
    ----------
    record, schema
        The file that has all but the fields, and its layout.
    unchanged
        Files that stay as they are where a result is judged again.
    write
        All files but profiles, from a result and the folder that it was read from; None where it was just solved.
    read
        The result from its folder, its record, and its case with today's criteria and creepages.
    decided
        Whether what is stored is all that a new solution would have.
    short_of_memory
        Whether the machine had too little memory for all that was asked for.
    """

    record: str
    schema: str
    unchanged: tuple[str, ...]
    solve: Callable[[StoredWork[Result]], Result]
    write: Callable[[Result, StoredWork[Result], Path, Path | None], object]
    read: Callable[[Path, Mapping[str, Any], Case], Result]
    decided: Callable[[Result], bool]
    short_of_memory: Callable[[Result], bool]


@dataclass(frozen=True, kw_only=True)
class StoredWork(Generic[Result]):
    """A case under its own load, or a position under several, which increase; `settings` are those of the command."""

    store: Store[Result]
    case: Case
    name: str
    loads_N: tuple[float, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self, folder: Path, finished: Path | None) -> bool:
        """Solve, or judge again from the finished folder, and write all files."""
        stored = None if finished is None else self.judged_again(finished)
        if stored is not None and finished is not None:
            for file in self.store.unchanged:
                shutil.copyfile(finished / file, folder / file)
            if (finished / PROFILES).is_dir():
                shutil.copytree(finished / PROFILES, folder / PROFILES)
            self.store.write(stored, self, folder, finished)
            return False
        result = self.store.solve(self)
        self.store.write(result, self, folder, None)
        copy_profiles(self.case, folder)
        if (position_id(self.case, self.loads_N) if self.loads_N else case_id(self.case)) != self.name:
            raise InputError("a profile's file changed while it was used for solving; give the same command again")
        return self.store.short_of_memory(result)

    def judged_again(self, finished: Path) -> Result | None:
        """What is stored by the criteria and readings of today, None where it has to be solved again."""
        try:
            result = read_stored(self.store, finished, self.case.criteria, self.case.creep)
        except InputError:
            # of another layout
            return None
        return result if self.store.decided(result) else None


def job_of(case: Case, folder: Path, work: Work, *, label: str = "") -> Job:
    """Job that is kept in a folder of its own name; its case says what decides about its numbers."""
    return Job(
        name=folder.name,
        folder=folder.absolute(),
        origin=origin_of(case),
        origin_here=partial(origin_of, case),
        work=work,
        label=label,
    )


def copy_profiles(case: Case, folder: Path) -> None:
    """Keep the profiles of a case that are files beside its result: without them it could not be judged again."""
    for body, spec in case.profiles.items():
        if (file := content_of(spec)) is not None:
            own = folder / PROFILES / body / file[0]
            own.parent.mkdir(parents=True, exist_ok=True)
            own.write_bytes(file[1])


def read_stored(
    store: Store[Result], folder: str | Path, criteria: Criteria | None = None, creep: Creep | None = None
) -> Result:
    """Read a finished result and judge it, by other criteria, friction and creepages than its own if they are given.

    Raises
    ------
    InputError
        If the folder holds no finished result of this kind, or one of another layout, and what to do.
    """
    folder = Path(folder)
    path = folder / store.record
    record = read_json(path)
    found = record.get("schema") if isinstance(record, Mapping) else None
    if found != store.schema:
        raise InputError(f"{path}: its layout is {found}, not {store.schema}; solve it again")
    try:
        case = stored_case(folder, record["case"])
        return store.read(folder, record, replace(case, criteria=criteria or case.criteria, creep=creep or case.creep))
    except FecontactError:
        raise
    except Exception as error:
        # whatever a file that was changed on purpose leads to
        said = f"{type(error).__name__}: {error}"
        raise InputError(f"{folder}: it cannot be read ({said}); solve it again") from error


def stored_case(folder: Path, record: Mapping[str, Any]) -> Case:
    """The case of a record, with the profiles that were stored beside it in place of the files that it was given."""
    case = case_from_record({name: value for name, value in record.items() if name not in FOUND_INPUTS})
    files = {}
    for body, spec in case.profiles.items():
        name = file_of_identity(spec)
        if name is None and (is_known(spec) or is_short_form(spec)):
            continue
        if name is None or PureWindowsPath(name).name != name:
            raise InputError(
                f"{folder}: {body} is {spec!r:.80}; allowed is the name of a file beside the result, with @"
            )
        files[body] = str(folder / PROFILES / body / name)
    return case.with_profiles(files)
