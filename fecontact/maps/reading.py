"""Finished maps read back from their folders, judged again, and looked up: nothing is solved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError
from fecontact.jobs.remaining import Progress, watched
from fecontact.maps.files import write_map
from fecontact.maps.model import ApplicabilityMap, LoadInterval, LoadLimit, MapPosition, failed_position
from fecontact.maps.report import map_lines, write_map_report
from fecontact.maps.storing import position_folder, read_position
from fecontact.maps.telling import MAP_SCHEMA, map_record
from fecontact.maps.views import Band, bands_of, column_width, refuse_measure
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.tables import Part, Record
from fecontact.outputs.terminal import count
from fecontact.regression.tables import load_table
from fecontact.runs.judging import judges
from fecontact.runs.load import is_name, sealed, unusable
from fecontact.runs.store import refused_if_changed, solved_in, stored_case

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


def load(folder: Path) -> ApplicabilityMap:
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


def judge(
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


# --- Rows of a stored map that must be of a given contact.

# Inputs of a case that say which contact it is; the others say how it is solved and judged.
_CONTACT = (
    *("rail", "wheel", "inclination_rad", "roll", "roll_rad", "yaw_rad", "roll_load_N", "flange_climb", "side"),
    *("opposite", "load_kind", "rail_material", "wheel_material", "rolling_radius_mm", "track"),
)


def rows(folder: Path, case: Case, *, but_for: Sequence[str] = ()) -> list[Mapping[str, str]]:
    """Rows of a stored map, as it was judged when it was written.

    Parameters
    ----------
    case
        The contact that it must be of.
    but_for
        Inputs that may be others.

    Raises
    ------
    InputError
        For a map of another contact, and for files that were changed.
    """
    document = map_document(folder)
    theirs, own = (_contact(one) for one in (document["case"], case_inputs(case)))
    different = [name for name in _CONTACT if name not in but_for and theirs.get(name) != own.get(name)]
    if different:
        told = "; ".join(f"{name} {theirs.get(name)!r} there, {own.get(name)!r} here" for name in different)
        raise InputError(f"{folder}: it is the map of another contact ({told}); give the same inputs, or another map")
    return list(load_table(folder / "map.csv").rows.to_dict("records"))


def _contact(record: Mapping[str, Any]) -> Record:
    """The inputs that say which contact it is, without what is said of yielding."""
    found = {name: record.get(name) for name in _CONTACT}
    for name in ("rail_material", "wheel_material"):
        found[name] = {key: value for key, value in (record.get(name) or {}).items() if key in ("young_MPa", "poisson")}
    return found


def columns(folder: Path) -> list[tuple[float, float, Sequence[Band]]]:
    """Each shift of a stored map (mm), how far on both sides it counts (mm), and its verdicts over the load."""
    document = map_document(folder)
    reach = 0.5 * column_width(document["lateral_shifts_mm"])
    return [(one["lateral_shift_mm"], reach, _bands(one, document["cells"])) for one in document["limits"]]


def _bands(limit: Mapping[str, Any], cells: Sequence[Mapping[str, Any]]) -> Sequence[Band]:
    own = [cell for cell in cells if cell["lateral_shift_mm"] == limit["lateral_shift_mm"] and "verdict" in cell]
    answers = [(cell["load_N"], cell["verdict"]["answer"]) for cell in own]
    answers += [(one["load_N"], one["verdict"]) for one in limit["tried"]]
    open_kN = {1e-3 * load_N for load_N, answer in answers if answer == "UNRESOLVED"}
    return bands_of(LoadLimit(intervals=tuple(LoadInterval(**one) for one in limit["intervals"])), open_kN)
