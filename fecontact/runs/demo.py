"""Demo: a small map, a case with files for ParaView, and a contact for which Hertz is exact."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from fecontact.case import Case
from fecontact.errors import describe_failure, has_numbers, is_usable_status
from fecontact.jobs.engine import RunSettings, finish_jobs, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.workers import JobOutcome
from fecontact.maps.model import ApplicabilityMap
from fecontact.outputs.paraview.view import write_view
from fecontact.outputs.records.results import Row, input_columns, read_row
from fecontact.runs.identity import make_case_id
from fecontact.runs.map_run import run_map
from fecontact.runs.store import ROW_FILE, CaseWork, make_job, name_case_folder

RADIUS_MM = 460.0
"""Radius of the sphere, in mm."""
# two cylinders of equal radius that cross at right angles touch like a sphere of this radius on a plane
SPHERE_CASE = Case(
    rail=f"circle:{RADIUS_MM:g}",
    wheel=f"cylinder:{RADIUS_MM:g}",
    inclination_rad=0.0,
    refine="never",
)
# a theory that is outside its range is not a remedy
BASE_CASE = Case(roll="touching")
SHIFTS_MM = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
"""Shifts at which Hertz holds at all loads (4 mm), has a load limit (2 and 3 mm), and fails (0, 1 and 5 mm)."""
LOADS_N = (20e3, 100e3)


def compute_exact_peak_MPa() -> float:
    """Peak pressure of the sphere in closed form, in MPa.

    (6 F E*^2 / (pi^3 R^2))^(1/3), Johnson 1985, eq. 3.25. It is exact for small elastic deformations.

    Returns
    -------
    float
        Peak pressure in MPa.

    Examples
    --------
    >>> from fecontact.runs.demo import compute_exact_peak_MPa
    >>> round(compute_exact_peak_MPa())
    1068
    """
    return float(
        (6.0 * SPHERE_CASE.load_N * SPHERE_CASE.contact_modulus_MPa**2 / (math.pi**3 * RADIUS_MM**2)) ** (1.0 / 3.0)
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class DemoOutcome:
    """Results of the demo.

    Attributes
    ----------
    map
        Map of verdicts.
    sphere, shown
        Rows of the sphere, and of the case with files for ParaView; the latter is None if every cell of the map is
        without a usable result.
    reused
        Ids of the positions and cases that were finished before.
    recomputed
        Reasons for solving or judging finished positions and cases again, by id.
    """

    map: ApplicabilityMap
    sphere: Row
    shown: Row | None
    reused: tuple[str, ...] = ()
    recomputed: Mapping[str, str] = field(default_factory=dict)

    @property
    def lost(self) -> dict[str, str]:
        """Reasons for cells and cases without a usable result, by their names."""
        cells = {
            f"{cell.lateral_shift_mm:+g} mm, {cell.load_kN:g} kN": cell.status
            for cell in self.map.cells
            if not cell.usable
        }
        rows = [row for row in (self.sphere, self.shown) if row is not None and not is_usable_status(row)]
        return cells | {f"case {row['id']}": str(row["status"]) for row in rows}

    @property
    def all_converged(self) -> bool:
        """Whether every cell and case has a usable result."""
        return not self.lost


def run_demo(
    out: Path,
    *,
    settings: RunSettings | None = None,
    map_progress: Progress | None = None,
    case_progress: Progress | None = None,
) -> DemoOutcome:
    """Solve the unfinished part of the demo, and write its files below `out`.

    Parameters
    ----------
    out
        Folder for the results.
    settings
        Settings of the run; the defaults if not given.
    map_progress, case_progress
        Receive the number of finished jobs, the number of jobs, and the jobs under way.

    Returns
    -------
    DemoOutcome
        Results of the demo.
    """
    settings = settings or RunSettings()
    outcome = run_map(BASE_CASE, SHIFTS_MM, LOADS_N, out, settings=settings, progress=map_progress)
    assert isinstance(outcome.made, ApplicabilityMap)
    paraview_case = choose_paraview_case(outcome.made)
    cases = {make_case_id(case): case for case in (SPHERE_CASE, paraview_case) if case is not None}
    rows: dict[str, Row] = {}

    def keep_row(job_outcome: JobOutcome) -> None:
        rows[job_outcome.name] = _row(cases[job_outcome.name], job_outcome, out)

    with open_run(out, out / "cases", settings, case_progress) as demo_run:
        jobs = [
            make_job(case, name_case_folder(out, name), CaseWork(case=case, name=name), label=_label_case(case))
            for name, case in cases.items()
        ]
        finish_jobs(jobs, demo_run, on_done=keep_row)
    shown_row = None if paraview_case is None else rows[make_case_id(paraview_case)]
    if shown_row is not None and has_numbers(shown_row):
        write_view(name_case_folder(out, str(shown_row["id"])))
    return DemoOutcome(
        map=outcome.made,
        sphere=rows[make_case_id(SPHERE_CASE)],
        shown=shown_row,
        reused=(*outcome.reused, *demo_run.reused),
        recomputed=outcome.recomputed | demo_run.recomputed,
    )


def choose_paraview_case(map_result: ApplicabilityMap) -> Case | None:
    """Case with the largest deviation of the peak pressure.

    Cases for which Hertz fails are preferred.

    Parameters
    ----------
    map_result
        Map.

    Returns
    -------
    Case or None
        The case; None without a usable cell.
    """
    loads = [cell.usable for cell in map_result.cells if cell.usable is not None]
    if not loads:
        return None
    worst = max(loads, key=lambda load: (load.verdict.answer == "FAILS", abs(load.deviation["p_max_MPa"])))
    return replace(BASE_CASE, lateral_shift_mm=worst.case.lateral_shift_mm, load_N=worst.load_N)


def _label_case(case: Case) -> str:
    return "sphere" if case is SPHERE_CASE else f"{case.lateral_shift_mm:+z.2f} mm {case.load_N / 1e3:g} kN"


def _row(case: Case, outcome: JobOutcome, out: Path) -> Row:
    """Row of a finished case, also of a failed case."""
    if outcome.failure is None:
        return read_row(name_case_folder(out, outcome.name) / ROW_FILE)
    return {"id": outcome.name, "status": describe_failure(outcome.failure), **input_columns(case)}
