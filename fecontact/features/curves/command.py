"""The command `fecontact curve`: positions, angles of attack, guiding forces of all wheels; no finite elements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fecontact.console.messages import announce, reporting_replaced_files
from fecontact.console.options import CaseOptions, add_case_options
from fecontact.console.progress import show_job_progress
from fecontact.errors import InputError
from fecontact.features.curves.conditions import DEFAULT_RADII_M, DEFAULT_THEORY, Conditions
from fecontact.features.curves.model import BOGIES, DEFAULT_VEHICLE
from fecontact.inputs.texts import count_text, parse_numbers
from fecontact.jobs.remaining import format_duration
from fecontact.outputs.terminal import print_answer
from fecontact.packages import require_finite_elements

if TYPE_CHECKING:
    from fecontact.features.curves.solved_wheels import SolvedWheels
    from fecontact.features.curves.visits import CurveResults

WHEELS_FOLDER = "wheels"
"""Subfolder of the results with the study of the solved wheels."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CurveOptions:
    """A vehicle, and the curves that it runs through.

    Attributes
    ----------
    vehicle
        wheelset (a free wheelset, 60 kN per wheel), manchester, metro, or a TOML file in the same format.
    bogie
        Bogie of the vehicle: leading or trailing.
    radii
        Radii in m: numbers and ranges FROM:TO:STEP, separated by commas; positive to the right, with the left wheels
        outside, negative to the left.
    theory
        Theories of the normal force, separated by commas: overlap (each strip carries its overlap), or any of
        `fecontact theories` except hertz_gauge. Each theory is compared with the last theory.
    friction
        Coefficient of friction, > 0.
    cant_mm
        Cant in mm, over 1500 mm.
    unbalanced_m_s2
        Unbalanced lateral acceleration in the plane of the track in m/s2, positive outwards; determines the speed.
    speed_km_h
        Speed in km/h, instead of --unbalanced-m-s2.
    shares
        Share of the distance with each radius, separated by commas; equal shares if not given.
    map
        Folder of a map of the same pair: adds the verdict and the cheapest theory that holds for each wheel.
    solve
        Solve the wheels of all curves by finite elements, by the last theory, and answer where Hertz holds; needs
        --out, whose subfolder wheels/ is a study.
    workers
        Number of processes; a process solves a theory or a wheel at a time.
    """

    vehicle: str = DEFAULT_VEHICLE
    bogie: str = BOGIES[0]
    radii: Annotated[str, Parameter(allow_leading_hyphen=True)] = ",".join(f"{radius:g}" for radius in DEFAULT_RADII_M)
    theory: str = DEFAULT_THEORY
    friction: float = Conditions.friction
    cant_mm: float = Conditions.cant_mm
    unbalanced_m_s2: Annotated[float, Parameter(name="--unbalanced-m-s2", allow_leading_hyphen=True)] = (
        Conditions.unbalanced_m_s2
    )
    speed_km_h: Annotated[float | None, Parameter(name="--speed-km-h")] = Conditions.speed_km_h
    shares: str = ""
    map: Path | None = None
    solve: bool = False
    workers: int = 1

    def read_radii(self) -> dict[float, float]:
        """Read the radii in m, with the share of the way of each radius.

        Returns
        -------
        dict
            Shares by radius.

        Raises
        ------
        InputError
            If a radius is repeated, or the number of shares differs from the number of radii.
        """
        radius_values = _parse_terms(self.radii, "radii")
        if repeated := sorted({radius for radius in radius_values if radius_values.count(radius) > 1}):
            raise InputError(
                f"radii {self.radii!r}: {', '.join(f'{radius:g}' for radius in repeated)} m is there more than once;"
                " give each radius once"
            )
        share_values = _parse_terms(self.shares, "shares") if self.shares else [1.0] * len(radius_values)
        if len(share_values) != len(radius_values):
            raise InputError(
                f"number of shares is {len(share_values)}; allowed: {len(radius_values)}, a share >= 0 for each radius"
            )
        return dict(zip(radius_values, share_values, strict=True))


def _parse_terms(text: str, name: str) -> list[float]:
    """Numbers of a comma list with ranges; equal numbers are kept."""
    return [number for term in text.split(",") for number in parse_numbers(term, name)]


_DEFAULT_OPTIONS = CurveOptions()
# Seconds of a curve by a theory, including the share of straight track.
_SECONDS_PER_CURVE, _MAX_SECONDS_PER_CURVE = {"overlap": 2.0, "kik_piotrowski": 2.0, "strip": 3.0}, 7.0


@add_case_options("pair", "profiles", "material", "mesh", "solution", "verdict")
def curve(
    *, options: CaseOptions, curve_options: CurveOptions = _DEFAULT_OPTIONS, json: bool = False, out: Path | None = None
) -> int:
    """Steady running of a wheelset or a bogie in curves: shift, yaw, forces of all wheels, critical speed.

    No finite elements are used, except with --solve.

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    out
        Folder for report.html, curve.csv, curve.json, pictures, and positions.csv for a fleet.
    """
    from fecontact.features.curves.pictures import draw_curves, draw_visits
    from fecontact.features.curves.records import make_curve_rows, make_curves_record, make_position_rows
    from fecontact.features.curves.running import curve as run_curves
    from fecontact.features.curves.solved_wheels import describe_solved_wheels
    from fecontact.features.curves.terminal import format_curves, write_curve_report
    from fecontact.files import write_json
    from fecontact.outputs.tables import write_csv

    if curve_options.solve and out is None:
        raise InputError("--solve needs a folder for the solved wheels; give --out FOLDER")
    if curve_options.solve:
        require_finite_elements()
    radii, theories = curve_options.read_radii(), curve_options.theory.split(",")
    seconds = len(radii) * sum(_SECONDS_PER_CURVE.get(name, _MAX_SECONDS_PER_CURVE) for name in theories)
    unit = "curves" if 1 in (len(theories), curve_options.workers) else "theories"
    with show_job_progress(
        unit, before=lambda _: f"{count_text(len(radii), 'curve')}: about {format_duration(seconds)}"
    ) as progress:
        results = run_curves(
            curve_options.vehicle,
            radii,
            case=options.case(),
            conditions=Conditions(
                friction=curve_options.friction,
                cant_mm=curve_options.cant_mm,
                unbalanced_m_s2=curve_options.unbalanced_m_s2,
                speed_km_h=curve_options.speed_km_h,
            ),
            theories=theories,
            bogie=curve_options.bogie,
            map_folder=curve_options.map,
            workers=curve_options.workers,
            progress=progress,
        )
    record = make_curves_record(results)
    if out is not None:
        with reporting_replaced_files(out):
            write_csv(make_curve_rows(results), out / "curve.csv")
            write_csv(make_position_rows(results), out / "positions.csv")
            write_json(out / "curve.json", record)
            draw_curves(results, out / "curve.png")
            if results.columns:
                draw_visits(results, out / "curve_map.png")
    is_complete = all(run.status == "equilibrium" for runs in results.runs.values() for run in runs)
    sentences: list[str] = []
    verdicts: list[str] = []
    if curve_options.solve and out is not None:
        judged_wheels = _solve_wheels(results, out, curve_options.workers)
        is_complete = is_complete and judged_wheels.all_converged
        sentences, verdicts = describe_solved_wheels(judged_wheels), judged_wheels.verdicts
        record["solved_wheels"] = {
            "theory": judged_wheels.theory,
            "answer": sentences,
            "shares": judged_wheels.shares(),
        }
    parts = [*format_curves(results), *sentences]
    if out is not None:
        write_curve_report(results, verdicts, parts, out)
    print_answer(record, lambda _: parts, json=json, written=out)
    return 0 if is_complete else 3


def _solve_wheels(results: CurveResults, out: Path, workers: int) -> SolvedWheels:
    """Solve the wheels by finite elements, and write their rows."""
    from fecontact.console.log import log_command
    from fecontact.console.run_messages import report_unusable_rows
    from fecontact.features.curves.solved_wheels import list_wheels, make_solved_rows, solve_wheels
    from fecontact.jobs.engine import RunSettings
    from fecontact.outputs.tables import write_csv
    from fecontact.runs.cost import STUDY_FILES_S, estimate_cost

    with log_command(out / WHEELS_FOLDER / "run.log"):
        cases = [wheel.case for wheel in list_wheels(results) if wheel.case is not None]
        if cases and (cost := estimate_cost(cases, workers, files=STUDY_FILES_S)):
            announce(*cost.words)
        with show_job_progress("wheels") as progress:
            judged_wheels = solve_wheels(results, out / WHEELS_FOLDER, RunSettings(workers=workers), progress)
        report_unusable_rows(judged_wheels.rows, "wheel", "not solved")
        write_csv(make_solved_rows(judged_wheels), out / "wheels.csv")
    return judged_wheels
