"""Finished maps read back from their folders, judged again, and looked up: nothing is solved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError
from fecontact.jobs.remaining import Progress, watched
from fecontact.maps.files import write_map
from fecontact.maps.model import ApplicabilityMap, MapPosition
from fecontact.maps.positions import failed_position
from fecontact.maps.report import map_lines, write_map_report
from fecontact.maps.telling import MAP_SCHEMA, map_record
from fecontact.maps.views import refuse_measure
from fecontact.outputs.parts import Part
from fecontact.outputs.terminal import count
from fecontact.runs.judged_study import judges
from fecontact.runs.map_positions import position_folder, read_position
from fecontact.runs.store import refused_if_changed, solved_in, stored_case
from fecontact.runs.stored_folder import is_name, sealed, unusable

Judges = Callable[[int], AbstractContextManager[Callable[..., Iterable[Any]]]]


@dataclass(frozen=True, kw_only=True)
class JudgedMap:
    """A map by other criteria, and what of it cannot be judged, in words."""

    map: ApplicabilityMap
    problems: tuple[str, ...]
    measure: str = "pressure"
    theory: str = HERTZ

    @property
    def all_judged(self) -> bool:
        """Whether every cell was judged and may be used."""
        return self.map.all_solved

    @property
    def words(self) -> str:
        """How many cells were judged."""
        return f"{count(len(self.map.cells), 'cell')} judged by {{criteria}}"

    @property
    def record(self) -> Mapping[str, Any]:
        """The map as `map.json` has it."""
        return map_record(self.map)

    def parts(self, width: int | None) -> Iterable[Part]:
        """The map by its measure."""
        return map_lines(self.map, self.measure, self.theory, width=width)


def load_map(folder: Path) -> ApplicabilityMap:
    """A finished map.

    Raises
    ------
    InputError
        As `read_map` does, and where a position of it cannot be used.
    """
    made, problems = read_map(folder)
    if problems:
        raise InputError(next(iter(problems.values())))
    return made


def judge_map(
    folder: Path,
    criteria: Criteria,
    out: Path | None = None,
    *,
    creep: Creep | None = None,
    measure: str = "pressure",
    theory: str = HERTZ,
    progress: Progress | None = None,
) -> JudgedMap:
    """Judge a stored map by given criteria, and with friction and creepages.

    A load limit is as sharp as the loads that were solved. `out` is a folder for the files of the new map,
    by `theory` with friction also with files of the laws of creep forces.

    Raises
    ------
    InputError
        If the folder holds no map, or for a measure that needs friction without any.
    """
    by = partial(judges, creep=creep)
    made, problems = read_map(folder, criteria, creep, dear=measure == "theory", judges=by, progress=progress)
    refuse_measure(made.case, measure, theory)
    if out is not None:
        write_map(made, out, theory=theory)
        write_map_report(made, out, theory=theory)
    return JudgedMap(map=made, problems=tuple(problems.values()), measure=measure, theory=theory)


def map_document(folder: Path) -> Mapping[str, Any]:
    """What `map.json` says, as it was written together with `map.csv`.

    Raises
    ------
    InputError
        If it has another layout, or either file was changed.
    """
    return sealed(folder / "map.json", MAP_SCHEMA, "make the map again")


def read_map(
    folder: Path,
    criteria: Criteria | None = None,
    creep: Creep | None = None,
    *,
    dear: bool = False,
    judges: Judges = lambda count: nullcontext(map),
    progress: Progress | None = None,
) -> tuple[ApplicabilityMap, dict[float, str]]:
    """A finished map, and which positions cannot be used.

    Criteria, friction and creepages are the map's, unless others are given. `judges` opens what reads so
    many positions as `map` does.

    Raises
    ------
    InputError
        If `map.json` has another layout, or no position of the map can be read.
    """
    document = map_document(folder)
    read = partial(_position, criteria=criteria, creep=creep, dear=dear)
    with refused_if_changed(folder / "map.json", "make the map again"):
        names = {shift: name for name, shift in document["provenance"].get("positions", {}).items() if is_name(name)}
        folders = {shift: position_folder(folder, name) for shift, name in names.items()}
        problems = {shift: problem for shift, own in folders.items() if (problem := unusable(own))}
        usable = {shift: own for shift, own in folders.items() if shift not in problems}
        with judges(len(usable)) as map_over:
            judged = watched(map_over(read, usable.values()), len(usable), progress, "judging")
            found: dict[float, MapPosition | str] = dict(zip(usable, judged, strict=True))
        problems |= {shift: one for shift, one in found.items() if isinstance(one, str)}
        known = {shift: one for shift, one in found.items() if not isinstance(one, str)}
        positions = [
            known[shift] if shift in known else failed_position(shift, document["loads_N"], problems[shift])
            for shift in folders
        ]
        if not known:
            why = next(iter(problems.values()), "none is there")
            raise InputError(f"{folder}: no position of the map can be judged ({why})")
        first = usable[min(known)]
        base = stored_case(first, solved_in(first)["case"])
        case = replace(base, lateral_shift_mm=0.0, criteria=criteria or base.criteria, creep=creep or base.creep)
        return ApplicabilityMap(case=case, loads_N=tuple(document["loads_N"]), positions=tuple(positions)), problems


def _position(folder: Path, **by: Any) -> MapPosition | str:
    """A finished position, or why it cannot be read."""
    try:
        return read_position(folder, **by)
    except InputError as error:
        return str(error)
