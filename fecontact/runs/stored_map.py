"""Finished maps read back from their folders, judged again, and looked up: nothing is solved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError
from fecontact.files import is_file_name
from fecontact.inputs.texts import count_text
from fecontact.jobs.remaining import Progress, report_progress
from fecontact.maps.files import write_map
from fecontact.maps.model import ApplicabilityMap, MapPosition
from fecontact.maps.positions import build_failed_position
from fecontact.maps.report import format_map_lines, write_result_report
from fecontact.maps.telling import MAP_SCHEMA
from fecontact.maps.views import refuse_measure
from fecontact.maps.yaw_map import MapResult, YawMap
from fecontact.maps.yaw_records import YAW_MAP_SCHEMA, build_result_record
from fecontact.outputs.parts import Part
from fecontact.outputs.words import criteria_text
from fecontact.runs.judged_study import judges
from fecontact.runs.map_positions import name_position_folder, read_position
from fecontact.runs.store import read_stored_inputs, refuse_changed_files
from fecontact.runs.stored_folder import describe_unusable_result, read_sealed_document


class OpenJudges(Protocol):
    """Function that opens a function like `map`."""

    def __call__(self, count: int, *, has_forces: bool) -> AbstractContextManager[Callable[..., Iterable[Any]]]:
        """Open the function for a number of positions, with or without creep forces."""


@dataclass(frozen=True, kw_only=True)
class JudgedMap:
    """Map by different criteria.

    Attributes
    ----------
    map
        The map, or the maps of several yaws.
    problems
        Reasons for positions and criteria of a user that cannot be judged.
    notes
        Criteria of a user that were judged by their stored values, with the reason.
    measure, theory
        Measure and theory of the printed map.
    """

    map: MapResult
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()
    measure: str = "pressure"
    theory: str = HERTZ

    @property
    def all_judged(self) -> bool:
        """Whether every cell was judged and may be used."""
        return self.map.all_solved and not self.problems

    @property
    def words(self) -> str:
        """Number of judged cells, in words."""
        return f"{count_text(len(self.map.cells), 'cell')} judged by {criteria_text(self.map.case.criteria)}"

    @property
    def record(self) -> Mapping[str, Any]:
        """The map in the layout of `map.json`."""
        return build_result_record(self.map)

    def terminal_parts(self, width: int | None) -> Iterable[Part]:
        """Parts for a terminal: the map by its measure.

        Parameters
        ----------
        width
            Columns of the terminal; None without a terminal.

        Returns
        -------
        iterable
            The lines of the map.
        """
        return format_map_lines(self.map, self.measure, self.theory, width=width)


def load_map(folder: Path) -> MapResult:
    """Read a finished map.

    Parameters
    ----------
    folder
        Folder of the map.

    Returns
    -------
    ApplicabilityMap or YawMap
        The map, or the maps of several yaws.

    Raises
    ------
    InputError
        As `read_map` does, and if a position of the map cannot be used.
    """
    loaded_map, problems = read_map(folder)
    if problems:
        raise InputError(next(iter(problems.values())))
    return loaded_map


def judge_map(
    folder: Path,
    criteria: Criteria | Mapping[str, Any] | None = None,
    out: Path | None = None,
    *,
    creep: Creep | Mapping[str, Any] | None = None,
    measure: str = "pressure",
    theory: str = HERTZ,
    progress: Progress | None = None,
) -> JudgedMap:
    """Judge a stored map by changed criteria, and with friction and creepages.

    A load limit is as sharp as the loads that were solved.

    Parameters
    ----------
    folder
        Folder of the map.
    criteria, creep
        Changes of the stored criteria, and of the stored friction and creepages.
    out
        Folder for the files of the new map; for the measure `theory` with friction also for the laws of creep forces.
    measure
        Measure of the printed map.
    theory
        Theory of the pressure of the printed map.
    progress
        Receives the progress.

    Returns
    -------
    JudgedMap
        The new map.

    Raises
    ------
    InputError
        If the folder holds no map, or for a measure that needs friction if there is none.
    """
    new_map, problems = read_map(folder, criteria, creep, dear=measure == "theory", judges=judges, progress=progress)
    refuse_measure(new_map.case, measure, theory)
    if out is not None:
        write_map(new_map, out, theory=theory)
        write_result_report(new_map, out, theory=theory)
    judged_loads = [cell.judged for cell in new_map.cells if cell.judged is not None]
    stored_measures = set.intersection(*({*load.stored_own} for load in judged_loads)) if judged_loads else set()
    notes, own_problems = new_map.case.criteria.describe_unavailable_own(stored_measures)
    return JudgedMap(
        map=new_map,
        problems=(*problems.values(), *own_problems),
        notes=tuple(notes),
        measure=measure,
        theory=theory,
    )


def read_map_document(folder: Path) -> Mapping[str, Any]:
    """Read `map.json`, and check that it was written together with `map.csv`.

    Parameters
    ----------
    folder
        Folder of the map.

    Returns
    -------
    mapping
        Content of `map.json`.

    Raises
    ------
    InputError
        If it has another layout, or either file was changed.
    """
    return read_sealed_document(folder / "map.json", (MAP_SCHEMA, YAW_MAP_SCHEMA), "make the map again")


def list_map_documents(document: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """Records of maps of a single yaw each, from the content of `map.json`."""
    return list(document["maps"]) if document["schema"] == YAW_MAP_SCHEMA else [document]


_Place: TypeAlias = tuple[int, float]
"""Number of a map by increasing yaw, and lateral shift (mm) of a position."""


def read_map(
    folder: Path,
    criteria: Criteria | Mapping[str, Any] | None = None,
    creep: Creep | Mapping[str, Any] | None = None,
    *,
    dear: bool = False,
    judges: OpenJudges = lambda count, has_forces: nullcontext(map),
    progress: Progress | None = None,
) -> tuple[MapResult, dict[str, str]]:
    """Read a finished map, and find positions that cannot be used.

    Parameters
    ----------
    folder
        Folder of the map.
    criteria, creep
        Changes of the stored criteria, and of the stored friction and creepages.
    dear
        Whether to include the readings of features that take seconds per load.
    judges
        Opens a function like `map` for a given number of positions, with or without creep forces.
    progress
        Receives the progress.

    Returns
    -------
    tuple of ApplicabilityMap or YawMap, and dict
        The map, and the problems of unusable positions by their folder.

    Raises
    ------
    InputError
        If `map.json` has another layout, or no position of the map can be read.
    """
    document = read_map_document(folder)
    with refuse_changed_files(folder / "map.json", "make the map again"):
        documents = list_map_documents(document)
        folders: dict[_Place, Path] = {
            (number, shift): name_position_folder(folder, name)
            for number, single_document in enumerate(documents)
            for name, shift in single_document["provenance"].get("positions", {}).items()
            if is_file_name(name)
        }
        problems = {
            place: problem
            for place, position_path in folders.items()
            if (problem := describe_unusable_result(position_path))
        }
        usable = {place: position_path for place, position_path in folders.items() if place not in problems}
        if not usable:
            reason = next(iter(problems.values()), "the map has no position")
            raise InputError(f"{folder}: no position of the map can be judged ({reason})")
        # all positions have the criteria of the first; workers have not imported the functions of a user's criteria
        stored_case = read_stored_inputs(usable[min(usable)])
        base_case = replace(
            stored_case,
            lateral_shift_mm=0.0,
            criteria=stored_case.criteria.apply_change(criteria),
            creep=stored_case.creep.apply_change(creep),
        )
        read_folder = partial(_try_position, criteria=base_case.criteria, creep=base_case.creep, dear=dear)
        with judges(len(usable), has_forces=base_case.creep.asked) as map_over:
            judged_positions = report_progress(map_over(read_folder, usable.values()), len(usable), progress, "judging")
            results: dict[_Place, MapPosition | str] = dict(zip(usable, judged_positions, strict=True))
        problems |= {place: result for place, result in results.items() if isinstance(result, str)}
        positions = {place: result for place, result in results.items() if not isinstance(result, str)}
        if not positions:
            reason = next(iter(problems.values()), "the map has no position")
            raise InputError(f"{folder}: no position of the map can be judged ({reason})")
        maps = tuple(
            ApplicabilityMap(
                case=replace(base_case, yaw_rad=single_document["case"]["yaw_rad"]),
                loads_N=tuple(single_document["loads_N"]),
                positions=tuple(
                    positions[place]
                    if place in positions
                    else build_failed_position(place[1], single_document["loads_N"], problems[place])
                    for place in folders
                    if place[0] == number
                ),
            )
            for number, single_document in enumerate(documents)
        )
        map_result = YawMap(maps=maps) if document["schema"] == YAW_MAP_SCHEMA else maps[0]
        return map_result, {str(folders[place]): problem for place, problem in problems.items()}


def _try_position(folder: Path, **settings: Any) -> MapPosition | str:
    """Read a finished position; returns the problem if it cannot be read."""
    try:
        return read_position(folder, **settings)
    except InputError as error:
        return str(error)
