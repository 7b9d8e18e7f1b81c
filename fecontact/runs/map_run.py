"""Applicability maps as runs: positions as jobs, each kept when it is finished."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ
from fecontact.errors import InputError
from fecontact.files import format_json
from fecontact.inputs.texts import require_number_list
from fecontact.jobs.engine import OpenRun, RunSettings, finish_jobs, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.store import check_stored_job
from fecontact.jobs.workers import Job, JobOutcome
from fecontact.maps.files import write_map
from fecontact.maps.model import ApplicabilityMap, MapPosition
from fecontact.maps.positions import build_failed_position
from fecontact.maps.report import count_fitting_pictures, write_result_report
from fecontact.maps.views import refuse_measure
from fecontact.maps.yaw_map import MapResult, YawMap, format_yaw, list_maps, require_yaws_rad
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.study_report import REPORT_FILE
from fecontact.packages import require_finite_elements
from fecontact.runs.cost import sort_longest_first
from fecontact.runs.folder import prepare_folder
from fecontact.runs.identity import make_case_id, make_paths_absolute, make_provenance
from fecontact.runs.map_positions import PositionWork, has_open_loads, name_position_folder, read_pictured_position
from fecontact.runs.store import make_job

# Interval of drawing, and fraction of the time for tables. Pictures are drawn while a map is made, except in its first
# minute. The cost of tables grows with the positions and takes time from solving, so its fraction is small.
_DRAWING_INTERVAL_S, _TABLE_TIME_FRACTION = 60.0, 0.02


@dataclass(frozen=True, kw_only=True)
class MapOutcome:
    """Results of a map.

    Attributes
    ----------
    made
        The map, or the maps of several yaws.
    reused
        Ids of the positions that were finished before.
    recomputed
        Reasons for solving or judging finished positions again, by id.
    """

    made: MapResult
    reused: tuple[str, ...] = ()
    recomputed: dict[str, str] = field(default_factory=dict)


def run_map(
    base_case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    out: Path,
    *,
    yaws_mrad: Sequence[float] | None = None,
    measure: str = "pressure",
    theory: str = HERTZ,
    settings: RunSettings | None = None,
    progress: Progress | None = None,
) -> MapOutcome:
    """Solve all unfinished positions and loads, find the load limits, and write the map.

    Parameters
    ----------
    base_case
        Everything except lateral shift, `yaws_mrad` and load.
    lateral_shifts_mm
        Lateral shifts in mm.
    loads_N
        Wheel loads in N.
    out
        Folder for the results.
    yaws_mrad
        Yaws of the wheelset in mrad, each with its own map; None for the yaw of the case.
    measure
        Measure of the map; for `theory` with friction the laws of creep forces are judged and written too.
    theory
        Theory of the pressure with a separate map beside the map of Hertz.
    settings
        Settings of the run; the defaults if not given.
    progress
        Receives the number of finished positions, the number of positions, and the present activity.

    Returns
    -------
    MapOutcome
        The map, or the maps of all yaws.

    Raises
    ------
    InputError
        If there are no shifts or loads, or values that no case can have; if a yaw is given twice, or together with a
        yaw of the case; if another run has the folder, or the cluster cannot be used. A position that cannot be solved
        raises no error: the status of its cells gives the reason.
    """
    settings = settings or RunSettings()
    shifts, loads = tuple(sorted(set(lateral_shifts_mm))), tuple(sorted(set(loads_N)))
    if not shifts or not loads:
        raise InputError("map: give at least one lateral shift and one load")
    base_case.creep.refuse_unheard()
    refuse_measure(base_case, measure, theory)
    if base_case.roll == "loaded" and base_case.roll_load_N is None:
        raise InputError(
            "map: all loads of a position have the same roll; give the wheel load for this roll, roll_load_kN"
            f" (--roll-load-kn), such as {1e-3 * loads[len(loads) // 2]:g}"
        )
    yaws_rad = None if yaws_mrad is None else require_yaws_rad(base_case, yaws_mrad)
    # all cases are made first: a value that no case can have is refused before anything is solved
    all_cases = [
        replace(base_case, yaw_rad=yaw, lateral_shift_mm=shift, load_N=load)
        for yaw in yaws_rad or (base_case.yaw_rad,)
        for shift in shifts
        for load in reversed(loads)
    ]
    cases = {(case.yaw_rad, case.lateral_shift_mm): case for case in all_cases[:: len(loads)]}
    with open_run(out, out / "positions", settings, progress) as opened_run:
        dear = measure == "theory"
        run = _MapRun(
            base_case=base_case,
            yaws_rad=yaws_rad,
            cases=cases,
            loads_N=loads,
            out=out,
            opened_run=opened_run,
            theory=theory,
            dear=dear,
        )
        try:
            run.solve()
        except BaseException:
            with contextlib.suppress(OSError):
                run.write()
            raise
        map_result = run.write()
        if opened_run.settings.part is None and map_result.positions:
            write_result_report(map_result, out, theory=theory, pictures=run.pictures)
    return MapOutcome(made=map_result, reused=tuple(opened_run.reused), recomputed=opened_run.recomputed)


_Place: TypeAlias = tuple[float, float]
"""Yaw (rad) and lateral shift (mm) of a position."""


@dataclass(kw_only=True)
class _MapRun:
    """State of a map while it is made."""

    base_case: Case
    yaws_rad: tuple[float, ...] | None
    cases: Mapping[_Place, Case]
    loads_N: tuple[float, ...]
    out: Path
    opened_run: OpenRun
    theory: str
    dear: bool

    def __post_init__(self) -> None:
        """Start without positions, and decide whether each cell has a picture."""
        self._places = {make_case_id(case, self.loads_N): place for place, case in self.cases.items()}
        self._positions: dict[_Place, MapPosition] = {}
        self.pictures: dict[float, dict[tuple[float, float], bytes]] = {yaw: {} for yaw, _ in self.cases}
        cells = len(self.cases) * len(self.loads_N)
        # if there are more cells, only some get a picture, and they are chosen at the end
        self._pictured = self.opened_run.settings.part is None and cells <= count_fitting_pictures((), cells)
        self._drawn_at, self._tables_at = time.monotonic(), -math.inf

    def solve(self) -> None:
        """Solve the positions that are not finished."""
        names = self.opened_run.settings.select_part(list(self._places))
        # towards the gauge corner curvatures are large and second patches appear: the longest positions come first
        names = tuple(sorted(names, key=lambda name: self._places[name][1], reverse=self.base_case.side == "left"))
        largest = {name: replace(self.cases[self._places[name]], load_N=self.loads_N[-1]) for name in names}
        names = tuple(sort_longest_first(largest, self.opened_run.crew.workers))
        # loads that failed or did not converge are tried again, after all others
        jobs = sorted(map(self._job, names), key=lambda job: job.force)
        finish_jobs(jobs, self.opened_run, on_done=self._keep_position)

    def write(self, *, drawn: bool = True) -> MapResult:
        """Write the files of the map, or of the part, with the finished positions.

        `drawn` decides whether pictures are drawn too. The time for writing decides when the tables are written next.
        """
        map_result = self._assemble()
        name, start = f"map{self.opened_run.settings.part_suffix}", time.monotonic()
        positions = {name: place for name, place in self._places.items() if place in self._positions}
        provenances = [
            make_provenance(
                single_map.case,
                positions={name: shift for name, (yaw, shift) in positions.items() if yaw == single_map.case.yaw_rad},
            )
            for single_map in list_maps(map_result)
        ]
        write_map(map_result, self.out, name, theory=self.theory, provenances=provenances, drawn=drawn)
        now = time.monotonic()
        self._tables_at = now + (now - start) / _TABLE_TIME_FRACTION
        if drawn:
            self._drawn_at = now
        return map_result

    def _assemble(self) -> MapResult:
        """Map of the finished positions, or the maps of all yaws."""
        maps = tuple(
            ApplicabilityMap(
                case=replace(self.base_case, yaw_rad=yaw),
                loads_N=self.loads_N,
                positions=tuple(self._positions[place] for place in sorted(self._positions) if place[0] == yaw),
            )
            for yaw in dict.fromkeys(yaw for yaw, _ in self.cases)
        )
        return maps[0] if self.yaws_rad is None else YawMap(maps=maps)

    def _job(self, name: str) -> Job:
        """Job of a position; it is forced if loads failed or did not converge."""
        case = self.cases[self._places[name]]
        if self.opened_run.settings.scheduler:
            case = make_paths_absolute(case)
        dear, pictured, base_case = self.dear, self._pictured, self.base_case
        work = PositionWork(case=case, name=name, loads_N=self.loads_N, dear=dear, pictured=pictured)
        read_folder = partial(
            read_pictured_position,
            criteria=replace(base_case.criteria, own=base_case.criteria.own or ()),
            creep=base_case.creep,
            dear=dear,
            pictured=pictured,
        )
        job = make_job(case, name_position_folder(self.out, name), work)
        has_retry = has_open_loads(job.folder) and check_stored_job(job.folder, job.name, job.origin).problem is None
        yaw_text = "" if self.yaws_rad is None else f", {format_yaw(1e3 * case.yaw_rad)} mrad"
        return replace(job, read=read_folder, label=f"{case.lateral_shift_mm:+z.2f} mm{yaw_text}", force=has_retry)

    def _keep_position(self, outcome: JobOutcome) -> None:
        """Keep the outcome of a position; write the files if their time has come.

        A failed job gives a position with failed cells.
        """
        yaw, shift = place = self._places[outcome.name]
        failure = outcome.failure
        if failure is None:
            self._positions[place] = outcome.value.position
            self.pictures[yaw] |= {(shift, load_N): picture for load_N, picture in outcome.value.pictures.items()}
        else:
            self._positions[place] = build_failed_position(shift, self.loads_N, failure)
        now = time.monotonic()
        # positions finished before are drawn with the next solved position, or at the end, like the last position
        if (
            len(self._positions) < len(self._places)
            and outcome.name not in self.opened_run.reused
            and now >= self._tables_at
        ):
            # a disk that is full now may have room at the end
            with contextlib.suppress(OSError):
                self.write(drawn=now - self._drawn_at > _DRAWING_INTERVAL_S)


# --- Folder of a map before the solution, and maps from Python, as `fecontact map` solves them.

# inputs of the case of a map that its positions and loads replace, or that only judge
_MAP_FILES = ("map.csv", "map.json", "map.png", "contacts.csv", "stiffness.csv", REPORT_FILE)
_IGNORED_INPUTS = ("lateral_shift_mm", "yaw_rad", "load_N", "criteria", "creep")


def prepare_for_map(
    out: Path,
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    *,
    yaws_mrad: Sequence[float] | None = None,
    force: bool = False,
) -> None:
    """Create the folder of a map and check that it can be written.

    A map continues with more shifts, more yaws, different criteria and different friction.

    Parameters
    ----------
    out
        Folder.
    case
        Case of the map.
    lateral_shifts_mm
        Lateral shifts in mm.
    loads_N
        Wheel loads in N.
    yaws_mrad
        Yaws of the wheelset in mrad; None for the yaw of the case.
    force
        Whether to write into a folder with other results.

    Raises
    ------
    InputError
        For yaws that are not allowed, and if the folder has other results; the message names them.
    OSError
        If the folder cannot be written.
    """
    map_inputs = {name: value for name, value in case_inputs(case).items() if name not in _IGNORED_INPUTS}
    stored_form = json.loads(format_json(map_inputs))
    yaws_rad = (case.yaw_rad,) if yaws_mrad is None else require_yaws_rad(case, yaws_mrad)

    def is_own(stored: Any) -> bool:
        # a map of several yaws never becomes a map of a single yaw: the others would be lost
        stored_yaws_rad = stored.get("yaws_rad", [stored["case"].get("yaw_rad")])
        has_same_places = (
            set(stored["lateral_shifts_mm"]) <= set(lateral_shifts_mm)
            and set(stored["loads_N"]) == set(loads_N)
            and set(stored_yaws_rad) <= set(yaws_rad)
            and ("yaws_rad" not in stored or yaws_mrad is not None)
        )
        return has_same_places and all(stored["case"].get(name) == value for name, value in stored_form.items())

    prepare_folder(out, "map.json", is_own, force, _MAP_FILES)


def map_(
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    out: str | Path,
    *,
    yaws_mrad: Sequence[float] | None = None,
    measure: str = "pressure",
    theory: str = HERTZ,
    workers: int | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> MapOutcome:
    """Map the validity of Hertz over lateral shift and load.

    If the run is interrupted, an equal call resumes it.

    Parameters
    ----------
    case
        Everything except lateral shift, `yaws_mrad` and load.
    lateral_shifts_mm
        Lateral shifts of the wheelset, in mm.
    loads_N
        Wheel loads, in N.
    out
        Folder for the results; `fecontact.load` reads them back.
    yaws_mrad
        Yaws of the wheelset in mrad, each with its own map; None for the yaw of the case.
    measure
        Measure of the map; for `theory` with friction the laws of creep forces are judged and written too.
    theory
        Theory of the pressure with a separate map beside the map of Hertz.
    workers, force, progress
        As for `run`, with shifts in place of cases.

    Returns
    -------
    MapOutcome
        The map; with `yaws_mrad` a `YawMap`, whose `select_yaw` gives the map of a yaw.

    Raises
    ------
    InputError
        As `run_map` does, and for a folder that holds other results.

    Examples
    --------
    >>> import tempfile
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> case = fecontact.Case(**pair, resolution="quick", refine="never")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = fecontact.map(case, [0.0], [60e3, 100e3], folder)
    ...     cells = fecontact.load(folder).rows()
    >>> [(cell["load_kN"], cell["verdict_answer"]) for cell in cells]
    [(60.0, 'HOLDS'), (100.0, 'HOLDS')]
    """
    require_finite_elements()
    map_arguments = (
        case,
        require_number_list(lateral_shifts_mm, "lateral_shifts_mm"),
        require_number_list(loads_N, "loads_N"),
        Path(out),
    )
    yaws = None if yaws_mrad is None else require_number_list(yaws_mrad, "yaws_mrad")
    prepare_for_map(map_arguments[-1], *map_arguments[:-1], yaws_mrad=yaws, force=force)
    settings = RunSettings(workers=workers, force=force)
    return run_map(*map_arguments, yaws_mrad=yaws, measure=measure, theory=theory, settings=settings, progress=progress)
