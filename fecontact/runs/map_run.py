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
from typing import Any

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
from fecontact.maps.report import count_fitting_pictures, write_map_report
from fecontact.maps.views import refuse_measure
from fecontact.outputs.records.results import case_inputs
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
        The map.
    reused
        Ids of the positions that were finished before.
    recomputed
        Reasons for solving or judging finished positions again, by id.
    """

    made: ApplicabilityMap
    reused: tuple[str, ...] = ()
    recomputed: dict[str, str] = field(default_factory=dict)


def run_map(
    base_case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    out: Path,
    *,
    measure: str = "pressure",
    theory: str = HERTZ,
    settings: RunSettings | None = None,
    progress: Progress | None = None,
) -> MapOutcome:
    """Solve all unfinished positions and loads, find the load limits, and write the map.

    Parameters
    ----------
    base_case
        Everything except lateral shift and load.
    lateral_shifts_mm
        Lateral shifts in mm.
    loads_N
        Wheel loads in N.
    out
        Folder for the results.
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
        The map.

    Raises
    ------
    InputError
        If there are no shifts or loads, or values that no case can have; if another run has the folder, or the cluster
        cannot be used. A position that cannot be solved raises no error: the status of its cells gives the reason.
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
    # all cases are made first: a value that no case can have is refused before anything is solved
    all_cases = [
        replace(base_case, lateral_shift_mm=shift, load_N=load) for shift in shifts for load in reversed(loads)
    ]
    cases = {case.lateral_shift_mm: case for case in all_cases[:: len(loads)]}
    with open_run(out, out / "positions", settings, progress) as opened_run:
        dear = measure == "theory"
        run = _MapRun(
            base_case=base_case, cases=cases, loads_N=loads, out=out, opened_run=opened_run, theory=theory, dear=dear
        )
        try:
            run.solve()
        except BaseException:
            with contextlib.suppress(OSError):
                run.write()
            raise
        map_result = run.write()
        if opened_run.settings.part is None and map_result.positions:
            write_map_report(map_result, out, theory=theory, pictures=run.pictures)
    return MapOutcome(made=map_result, reused=tuple(opened_run.reused), recomputed=opened_run.recomputed)


@dataclass(kw_only=True)
class _MapRun:
    """State of a map while it is made."""

    base_case: Case
    cases: Mapping[float, Case]
    loads_N: tuple[float, ...]
    out: Path
    opened_run: OpenRun
    theory: str
    dear: bool

    def __post_init__(self) -> None:
        """Start without positions, and decide whether each cell has a picture."""
        self._shifts = {make_case_id(case, self.loads_N): shift for shift, case in self.cases.items()}
        self._positions: dict[float, MapPosition] = {}
        self.pictures: dict[tuple[float, float], bytes] = {}
        cells = len(self.cases) * len(self.loads_N)
        # if there are more cells, only some get a picture, and they are chosen at the end
        self._pictured = self.opened_run.settings.part is None and cells <= count_fitting_pictures((), cells)
        self._drawn_at, self._tables_at = time.monotonic(), -math.inf

    def solve(self) -> None:
        """Solve the positions that are not finished."""
        names = self.opened_run.settings.select_part(list(self._shifts))
        # towards the gauge corner curvatures are large and second patches appear: the longest positions come first
        names = tuple(sorted(names, key=self._shifts.__getitem__, reverse=self.base_case.side == "left"))
        largest = {name: replace(self.cases[self._shifts[name]], load_N=self.loads_N[-1]) for name in names}
        names = tuple(sort_longest_first(largest, self.opened_run.crew.workers))
        # loads that failed or did not converge are tried again, after all others
        jobs = sorted(map(self._job, names), key=lambda job: job.force)
        finish_jobs(jobs, self.opened_run, on_done=self._keep_position)

    def write(self, *, drawn: bool = True) -> ApplicabilityMap:
        """Write the files of the map, or of the part, with the finished positions.

        `drawn` decides whether pictures are drawn too. The time for writing decides when the tables are written next.
        """
        positions_so_far = tuple(self._positions[shift] for shift in sorted(self._positions))
        map_result = ApplicabilityMap(case=self.base_case, loads_N=self.loads_N, positions=positions_so_far)
        name, start = f"map{self.opened_run.settings.part_suffix}", time.monotonic()
        positions = {name: shift for name, shift in self._shifts.items() if shift in self._positions}
        origin = make_provenance(self.base_case, positions=positions)
        write_map(map_result, self.out, name, theory=self.theory, provenance=origin, drawn=drawn)
        now = time.monotonic()
        self._tables_at = now + (now - start) / _TABLE_TIME_FRACTION
        if drawn:
            self._drawn_at = now
        return map_result

    def _job(self, name: str) -> Job:
        """Job of a position; it is forced if loads failed or did not converge."""
        case = self.cases[self._shifts[name]]
        if self.opened_run.settings.scheduler:
            case = make_paths_absolute(case)
        dear, pictured, base_case = self.dear, self._pictured, self.base_case
        work = PositionWork(case=case, name=name, loads_N=self.loads_N, dear=dear, pictured=pictured)
        read_folder = partial(
            read_pictured_position, criteria=base_case.criteria, creep=base_case.creep, dear=dear, pictured=pictured
        )
        job = make_job(case, name_position_folder(self.out, name), work)
        has_retry = has_open_loads(job.folder) and check_stored_job(job.folder, job.name, job.origin).problem is None
        return replace(job, read=read_folder, label=f"{case.lateral_shift_mm:+z.2f} mm", force=has_retry)

    def _keep_position(self, outcome: JobOutcome) -> None:
        """Keep the outcome of a position; write the files if their time has come.

        A failed job gives a position with failed cells.
        """
        shift = self._shifts[outcome.name]
        failure = outcome.failure
        if failure is None:
            self._positions[shift] = outcome.value.position
            self.pictures |= {(shift, load_N): picture for load_N, picture in outcome.value.pictures.items()}
        else:
            self._positions[shift] = build_failed_position(shift, self.loads_N, failure)
        now = time.monotonic()
        # positions finished before are drawn with the next solved position, or at the end, like the last position
        if (
            len(self._positions) < len(self._shifts)
            and outcome.name not in self.opened_run.reused
            and now >= self._tables_at
        ):
            # a disk that is full now may have room at the end
            with contextlib.suppress(OSError):
                self.write(drawn=now - self._drawn_at > _DRAWING_INTERVAL_S)


# --- Folder of a map before the solution, and maps from Python, as `fecontact map` solves them.

# inputs of the case of a map that its positions and loads replace, or that only judge
_IGNORED_INPUTS = ("lateral_shift_mm", "load_N", "criteria", "creep")


def prepare_for_map(
    out: Path, case: Case, lateral_shifts_mm: Sequence[float], loads_N: Sequence[float], *, force: bool = False
) -> None:
    """Create the folder of a map and check that it can be written.

    A map continues with more shifts, different criteria and different friction.

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
    force
        Whether to write into a folder with other results.

    Raises
    ------
    InputError
        If the folder has other results; the message names them.
    OSError
        If the folder cannot be written.
    """
    map_inputs = {name: value for name, value in case_inputs(case).items() if name not in _IGNORED_INPUTS}
    stored_form = json.loads(format_json(map_inputs))

    def is_own(stored: Any) -> bool:
        has_same_places = set(stored["lateral_shifts_mm"]) <= set(lateral_shifts_mm) and set(stored["loads_N"]) == set(
            loads_N
        )
        return has_same_places and all(stored["case"].get(name) == value for name, value in stored_form.items())

    prepare_folder(out, "map.json", is_own, force)


def map_(
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    out: str | Path,
    *,
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
        Everything except lateral shift and load.
    lateral_shifts_mm
        Lateral shifts of the wheelset, in mm.
    loads_N
        Wheel loads, in N.
    out
        Folder for the results; `fecontact.load` reads them back.
    measure
        Measure of the map; for `theory` with friction the laws of creep forces are judged and written too.
    theory
        Theory of the pressure with a separate map beside the map of Hertz.
    workers, force, progress
        As for `run`, with shifts in place of cases.

    Returns
    -------
    MapOutcome
        The map.

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
    prepare_for_map(map_arguments[-1], *map_arguments[:-1], force=force)
    settings = RunSettings(workers=workers, force=force)
    return run_map(*map_arguments, measure=measure, theory=theory, settings=settings, progress=progress)
