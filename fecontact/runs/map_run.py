"""An applicability map while it is made: positions as jobs, each kept as it is finished."""

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
from fecontact.files import json_text
from fecontact.inputs.texts import listed
from fecontact.jobs.engine import OpenRun, RunSettings, finish, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.store import kept_folder
from fecontact.jobs.workers import Done, Job
from fecontact.maps.files import write_map
from fecontact.maps.model import ApplicabilityMap, MapPosition
from fecontact.maps.positions import failed_position
from fecontact.maps.report import pictures_that_fit, write_map_report
from fecontact.maps.views import refuse_measure
from fecontact.outputs.records.results import case_inputs
from fecontact.packages import require_finite_elements
from fecontact.runs.cost import longest_first
from fecontact.runs.folder import prepare
from fecontact.runs.identity import case_id, provenance, with_absolute_paths
from fecontact.runs.map_positions import SolvingPosition, found_position, has_open_loads, position_folder
from fecontact.runs.store import job_of

# Pictures are drawn while a map is made, but in its first minute; tables take so small a part of the time: what they
# cost grows with the positions, and it is taken from those who solve.
_DRAWN_EVERY_S, _PART_FOR_TABLES = 60.0, 0.02


@dataclass(frozen=True, kw_only=True)
class MapOutcome:
    """What a map gave, which positions were finished before, and why others were solved, or judged, again."""

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
    """Solve all positions and loads that are not finished, find each position's load limit, and write the map.

    Parameters
    ----------
    base_case
        Everything but lateral shift and load.
    measure
        By `theory` with friction the laws of creep forces are judged and written too.
    theory
        A theory of the pressure, whose map is drawn beside the map of Hertz.
    progress
        Called with the number of finished positions, how many there are, and what is under way.

    Raises
    ------
    InputError
        If there are no shifts or loads, or values that no case can have; if another run has the folder, or the cluster
        cannot be used. A position that cannot be solved is not an error but cells whose status says why.
    """
    settings = settings or RunSettings()
    shifts, loads = tuple(sorted(set(lateral_shifts_mm))), tuple(sorted(set(loads_N)))
    if not shifts or not loads:
        raise InputError("map: give at least one lateral shift and one load")
    base_case.creep.refuse_unheard()
    refuse_measure(base_case, measure, theory)
    if base_case.roll == "loaded" and base_case.roll_load_N is None:
        raise InputError(
            "map: it has one roll for all loads of a position; say under which load it is found, roll_load_kN"
            f" (--roll-load-kn), such as {1e-3 * loads[len(loads) // 2]:g}"
        )
    # all are made first: a value that no case can have is said before anything is solved
    every = [replace(base_case, lateral_shift_mm=shift, load_N=load) for shift in shifts for load in reversed(loads)]
    cases = {case.lateral_shift_mm: case for case in every[:: len(loads)]}
    with open_run(out, out / "positions", settings, progress) as by:
        dear = measure == "theory"
        run = _Run(base_case=base_case, cases=cases, loads_N=loads, out=out, by=by, theory=theory, dear=dear)
        try:
            run.solve()
        except BaseException:
            with contextlib.suppress(OSError):
                run.write()
            raise
        made = run.write()
        if by.settings.part is None and made.positions:
            write_map_report(made, out, theory=theory, pictures=run.pictures)
    return MapOutcome(made=made, reused=tuple(by.reused), recomputed=by.recomputed)


@dataclass(kw_only=True)
class _Run:
    """What is known of a map while it is made."""

    base_case: Case
    cases: Mapping[float, Case]
    loads_N: tuple[float, ...]
    out: Path
    by: OpenRun
    theory: str
    dear: bool

    def __post_init__(self) -> None:
        self._shifts = {case_id(case, self.loads_N): shift for shift, case in self.cases.items()}
        self._positions: dict[float, MapPosition] = {}
        self.pictures: dict[tuple[float, float], bytes] = {}
        cells = len(self.cases) * len(self.loads_N)
        # of more cells only some get a picture, which is known at the end
        self._pictured = self.by.settings.part is None and cells <= pictures_that_fit((), cells)
        self._drawn_at, self._tables_at = time.monotonic(), -math.inf

    def solve(self) -> None:
        """Solve what is not finished."""
        names = self.by.settings.own_part(list(self._shifts))
        # towards the gauge corner curvatures are large and second patches come: what takes longest is not left for last
        names = tuple(sorted(names, key=self._shifts.__getitem__, reverse=self.base_case.side == "left"))
        largest = {name: replace(self.cases[self._shifts[name]], load_N=self.loads_N[-1]) for name in names}
        names = tuple(longest_first(largest, self.by.crew.workers))
        # loads that failed or did not converge are tried once more, after all others
        jobs = sorted(map(self._job, names), key=lambda job: job.force)
        finish(jobs, self.by, on_done=self._done)

    def write(self, *, drawn: bool = True) -> ApplicabilityMap:
        """Write the files of the map, or of the part, with the positions that are known."""
        found = tuple(self._positions[shift] for shift in sorted(self._positions))
        made = ApplicabilityMap(case=self.base_case, loads_N=self.loads_N, positions=found)
        name, begun = f"map{self.by.settings.part_suffix}", time.monotonic()
        positions = {name: shift for name, shift in self._shifts.items() if shift in self._positions}
        origin = provenance(self.base_case, positions=positions)
        write_map(made, self.out, name, theory=self.theory, provenance=origin, drawn=drawn)
        now = time.monotonic()
        self._tables_at = now + (now - begun) / _PART_FOR_TABLES
        if drawn:
            self._drawn_at = now
        return made

    def _job(self, name: str) -> Job:
        case = self.cases[self._shifts[name]]
        if self.by.settings.scheduler:
            case = with_absolute_paths(case)
        dear, pictured, by = self.dear, self._pictured, self.base_case
        work = SolvingPosition(case=case, name=name, loads_N=self.loads_N, dear=dear, pictured=pictured)
        read = partial(found_position, criteria=by.criteria, creep=by.creep, dear=dear, pictured=pictured)
        job = job_of(case, position_folder(self.out, name), work)
        open_ = has_open_loads(job.folder) and kept_folder(job.folder, job.name, job.origin).problem is None
        return replace(job, read=read, label=f"{case.lateral_shift_mm:+z.2f} mm", force=open_)

    def _done(self, done: Done) -> None:
        shift = self._shifts[done.name]
        why = done.failure
        if why is None:
            self._positions[shift] = done.value.position
            self.pictures |= {(shift, load_N): picture for load_N, picture in done.value.pictures.items()}
        else:
            self._positions[shift] = failed_position(shift, self.loads_N, why)
        now = time.monotonic()
        # what was finished before is drawn with the next one that is solved, or at the end, as is the last one
        if len(self._positions) < len(self._shifts) and done.name not in self.by.reused and now >= self._tables_at:
            # a full disk now may have room at the end
            with contextlib.suppress(OSError):
                self.write(drawn=now - self._drawn_at > _DRAWN_EVERY_S)


# --- The folder of a map before anything is solved, and maps from Python, as `fecontact map` solves them.

# of the case of a map these are the map's own, or those by which it is judged
_NOT_OF_A_MAP = ("lateral_shift_mm", "load_N", "criteria", "creep")


def prepare_for_map(
    out: Path, case: Case, lateral_shifts_mm: Sequence[float], loads_N: Sequence[float], *, force: bool = False
) -> None:
    """Do as `prepare_for_case` does, for a map, which goes on with more shifts, other criteria and other friction."""
    own = {name: value for name, value in case_inputs(case).items() if name not in _NOT_OF_A_MAP}
    written = json.loads(json_text(own))

    def is_own(stored: Any) -> bool:
        same_places = set(stored["lateral_shifts_mm"]) <= set(lateral_shifts_mm) and set(stored["loads_N"]) == set(
            loads_N
        )
        return same_places and all(stored["case"].get(name) == value for name, value in written.items())

    prepare(out, "map.json", is_own, force)


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
    """Map where Hertz holds over lateral shift and load; the same call goes on where an interrupted one stopped.

    Parameters
    ----------
    case
        Everything but lateral shift and load.
    lateral_shifts_mm, loads_N
        Of the wheelset, and wheel loads.
    out
        Folder for the results; `fecontact.load` reads them back.
    measure
        By `theory` with friction the laws of creep forces are judged and written too.
    theory
        A theory of the pressure, whose map is drawn beside the map of Hertz.
    workers, force, progress
        As for `run`, with shifts in place of cases.

    Raises
    ------
    InputError
        As `run_map` does, and for a folder that holds other results.
    """
    require_finite_elements()
    asked = case, listed(lateral_shifts_mm, "lateral_shifts_mm"), listed(loads_N, "loads_N"), Path(out)
    prepare_for_map(asked[-1], *asked[:-1], force=force)
    settings = RunSettings(workers=workers, force=force)
    return run_map(*asked, measure=measure, theory=theory, settings=settings, progress=progress)
