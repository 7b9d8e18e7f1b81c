"""Wheels of a vehicle in curves, judged by finite elements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.contact_theories.rolling.creepage import Creepages
from fecontact.errors import ConvergenceError, InputError, describe_failure, describe_status, is_usable_status
from fecontact.feature_registry import load_offers
from fecontact.features.curves.curve import CurveRun, WheelRun, WheelsetRun
from fecontact.features.curves.visits import NO_EQUILIBRIUM, CurveResults
from fecontact.features.curves.wheel_forces import Motion, compute_rigid_slip
from fecontact.files import read_json
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.remaining import Progress
from fecontact.outputs.case_parts import iterate_feature_answers
from fecontact.outputs.verdict_words import cheapest_text_of_row, deciding_measure_text
from fecontact.runs.casefile import Study
from fecontact.runs.identity import make_case_id
from fecontact.runs.store import RECORD_FILE, name_case_folder
from fecontact.runs.study import StudyOutcome, run_study
from fecontact.solving.placing import place_case


@dataclass(frozen=True, kw_only=True)
class CurveWheel:
    """Wheel of a curve, as a case for finite elements.

    Attributes
    ----------
    radius_m, wheelset, side
        Radius of the curve, number of the wheelset from 1, and side of the wheel.
    is_outer
        Whether the wheel is on the outer rail.
    share
        Share of the distance of all wheels.
    patch_count
        Number of patches in the curve.
    case
        Case of the wheel; None if the wheel cannot be solved.
    problem
        Reason why there is no case; empty otherwise.
    """

    radius_m: float
    wheelset: int
    side: TrackSide
    is_outer: bool
    share: float
    patch_count: int
    case: Case | None
    problem: str = ""

    @property
    def words(self) -> str:
        """Name of the wheel within its curve."""
        return f"{'outer' if self.is_outer else 'inner'} wheel of wheelset {self.wheelset} ({self.side})"


@dataclass(frozen=True, kw_only=True)
class SolvedWheels:
    """Wheels of a vehicle in curves, judged by finite elements.

    Attributes
    ----------
    theory
        Theory of the normal force by which the vehicle runs.
    wheels
        Wheels, by radius, wheelset and side.
    rows
        Row of the study for each wheel. A wheel without a case has a row with its status alone.
    records
        Record of each wheel, as `result.json`; None without a usable result. Empty if there are no records.
    share_without
        Share of the distance without an equilibrium.
    outcome
        Results of the study; None without any wheel.
    """

    theory: str
    wheels: tuple[CurveWheel, ...]
    rows: tuple[Mapping[str, Any], ...]
    share_without: float
    outcome: StudyOutcome | None
    records: tuple[Mapping[str, Any] | None, ...] = ()

    @property
    def all_converged(self) -> bool:
        """Whether every wheel has a usable result."""
        return all(is_usable_status(row) for row in self.rows)

    @property
    def verdicts(self) -> list[str]:
        """Verdict on Hertz for each wheel, or `not solved`."""
        return [_find_answer(row) for row in self.rows]

    def shares(self) -> dict[str, float]:
        """Shares of the distance of all wheels by the answer on Hertz.

        Returns
        -------
        dict
            Share by verdict, `not solved`, or no equilibrium.
        """
        shares: dict[str, float] = {}
        for wheel, row in zip(self.wheels, self.rows, strict=True):
            answer = _find_answer(row)
            shares[answer] = shares.get(answer, 0.0) + wheel.share
        return shares | ({NO_EQUILIBRIUM: self.share_without} if self.share_without else {})


NOT_SOLVED = "not solved"


def _find_answer(row: Mapping[str, Any]) -> str:
    """Verdict of a row, or `not solved`."""
    return str(row.get("verdict_answer") or NOT_SOLVED)


def list_wheels(results: CurveResults) -> tuple[CurveWheel, ...]:
    """List the wheels of all curves with an equilibrium, by the last theory.

    Parameters
    ----------
    results
        Results of a vehicle in curves.

    Returns
    -------
    tuple of CurveWheel
        A wheel for each curve, wheelset and side.
    """
    share_by_radius = dict(zip(results.radii_m, results.share, strict=True))
    return tuple(
        CurveWheel(
            radius_m=run.radius_m,
            wheelset=number,
            side=wheel.side,
            is_outer=(wheel.side == "left") == (run.radius_m > 0.0),
            share=share_by_radius[run.radius_m] / (2.0 * len(run.wheelsets)),
            patch_count=len(wheel.patches),
            **_find_case(results, run, wheelset, wheel),
        )
        for run in list(results.runs.values())[-1]
        if run.is_balanced
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    )


def _find_case(results: CurveResults, run: CurveRun, wheelset: WheelsetRun, wheel: WheelRun) -> dict[str, Any]:
    """Find the attributes `case` and `problem` of a `CurveWheel`."""
    try:
        return {"case": make_wheel_case(results, run, wheelset, wheel)}
    except (InputError, ConvergenceError) as error:
        return {"case": None, "problem": str(error)}


def make_wheel_case(results: CurveResults, run: CurveRun, wheelset: WheelsetRun, wheel: WheelRun) -> Case:
    """Make the case of a wheel in a curve.

    The wheelset has the shift, yaw and roll of its steady motion. The load is the vertical component of the normal
    forces of all patches: finite elements have no friction, and their contact carries this component alone. Creepages
    are those of the rigid wheel at the first contact point of the case, and follow the curved surfaces from there.

    Parameters
    ----------
    results
        Results of a vehicle in curves.
    run
        Steady motion in the curve.
    wheelset
        Wheelset of this motion.
    wheel
        Wheel of this wheelset.

    Returns
    -------
    Case
        Case with the profiles, track and materials of the curve.

    Raises
    ------
    InputError
        If the wheel has no contact, if a value is out of the range of a case, or if the wheel of the case cannot stand.
    ConvergenceError
        If its contact point is not found.
    """
    if not wheel.patches:
        raise InputError("the wheel has no contact in this curve; reduce the lateral acceleration, or leave it out")
    case = replace(
        results.case,
        lateral_shift_mm=wheelset.lateral_shift_mm,
        yaw_rad=1e-3 * wheelset.yaw_mrad,
        roll="given",
        roll_rad=1e-3 * wheelset.roll_mrad,
        side=wheel.side,
        load_N=sum(patch.normal_force_N * math.cos(patch.angle_rad) for patch in wheel.patches),
        load_kind="vertical",
    )
    creepages = _find_creepages(case, run, wheelset)
    return replace(
        case,
        creep=replace(
            case.creep,
            friction=results.conditions.friction,
            xi=creepages.xi,
            eta=creepages.eta,
            spin_per_mm=creepages.spin_per_mm,
            speed_ratio=1.0 + wheelset.slip,
            curved=True,
        ),
    )


def _find_creepages(case: Case, run: CurveRun, wheelset: WheelsetRun) -> Creepages:
    """Find the creepages at the first contact point of the case of a wheel.

    Under pressure, bodies of one material meet midway between their undeformed surfaces, so the axle is midway between
    its height at first touch and its height under load. Either height alone changes the longitudinal creepage by 0.01
    %, and the longitudinal force by 4 % of mu N.
    """
    placement = place_case(case)
    touch, first_height_mm = placement.first, float(placement.wheel.centre_mm[2])
    height_mm = 0.5 * (first_height_mm + wheelset.height_mm)
    position = (wheelset.lateral_shift_mm, height_mm, 1e-3 * wheelset.roll_mrad, 1e-3 * wheelset.yaw_mrad)
    motion = Motion(place=np.array(position), slip=wheelset.slip, curvature_per_mm=-1e-3 / run.radius_m)
    if case.side == "right":
        motion = motion.mirror_image()
    (velocity,), turning = compute_rigid_slip(
        np.array([[touch.x_mm, touch.y_mm, touch.z_mm]]) - np.array([0.0, *motion.place[:2]]),
        motion,
        placement.wheel.rolling_radius_mm,
    )
    return Creepages(
        xi=float(velocity[0]), eta=float(velocity @ touch.tangent), spin_per_mm=float(turning @ touch.normal)
    )


def solve_wheels(
    results: CurveResults, out: Path, settings: RunSettings | None = None, progress: Progress | None = None
) -> SolvedWheels:
    """Solve the wheels of all curves by finite elements, and judge Hertz on them.

    Parameters
    ----------
    results
        Results of a vehicle in curves.
    out
        Folder of the study. Finished cases are kept.
    settings, progress
        As in `run_study`.

    Returns
    -------
    SolvedWheels
        Wheels with their rows.

    Raises
    ------
    InputError
        As in `run_study`.
    """
    wheels = list_wheels(results)
    share_without = max(0.0, 1.0 - math.fsum(wheel.share for wheel in wheels))
    theory = list(results.runs)[-1]
    cases = {make_case_id(wheel.case): wheel.case for wheel in wheels if wheel.case is not None}
    outcome = None
    rows_by_id: dict[str, Mapping[str, Any]] = {}
    if cases:
        study = Study(
            name="wheels",
            cases=tuple(cases.values()),
            question="Does Hertz hold on the wheels of a vehicle in curves?",
        )
        outcome = run_study(study, out, settings=settings, progress=progress)
        rows_by_id = dict(zip(cases, outcome.rows, strict=True))
    rows = tuple(
        _make_row_without_case(wheel) if wheel.case is None else rows_by_id[make_case_id(wheel.case)]
        for wheel in wheels
    )
    return SolvedWheels(
        theory=theory,
        wheels=wheels,
        rows=rows,
        share_without=share_without if share_without > 1e-9 else 0.0,
        outcome=outcome,
        records=tuple(
            read_json(name_case_folder(out, str(row["id"])) / RECORD_FILE) if is_usable_status(row) else None
            for row in rows
        ),
    )


def _make_row_without_case(wheel: CurveWheel) -> dict[str, Any]:
    """Row of a wheel that cannot be solved, with the reason as its status."""
    return {"id": f"R {wheel.radius_m:g} m, {wheel.words}", "status": describe_failure(wheel.problem)}


def make_solved_rows(judged_wheels: SolvedWheels) -> list[dict[str, Any]]:
    """Make a row for each solved wheel.

    Parameters
    ----------
    judged_wheels
        Solved wheels.

    Returns
    -------
    list of dict
        Curve, wheel and share of the distance, then the columns of the study.
    """
    return [
        {
            "radius_m": wheel.radius_m,
            "wheelset": wheel.wheelset,
            "share_of_distance_percent": 1e2 * wheel.share,
            "patches_in_curve": wheel.patch_count,
            **row,
        }
        for wheel, row in zip(judged_wheels.wheels, judged_wheels.rows, strict=True)
    ]


def describe_solved_wheels(judged_wheels: SolvedWheels) -> list[str]:
    """Answer for each curve and for the whole distance, in sentences.

    Parameters
    ----------
    judged_wheels
        Solved wheels.

    Returns
    -------
    list of str
        For each radius the number of wheels for which Hertz holds, then each wheel for which it does not. With friction
        all wheels follow, with their creep forces, and the sum of T-gamma. At the end the shares of the distance, if
        there are several radii.
    """
    sentences: list[str] = []
    tellings = load_offers("TELLINGS")
    radii = dict.fromkeys(wheel.radius_m for wheel in judged_wheels.wheels)
    for radius in radii:
        answers = [
            (wheel, row, record)
            for wheel, row, record in zip(
                judged_wheels.wheels,
                judged_wheels.rows,
                judged_wheels.records or [None] * len(judged_wheels.rows),
                strict=True,
            )
            if wheel.radius_m == radius
        ]
        holding = sum(_find_answer(row) == "HOLDS" for _, row, _ in answers)
        sentences.append(f"R {radius:g} m: Hertz holds for {holding} of {len(answers)} wheels")
        for wheel, row, record in answers:
            feature_answers = [] if record is None else list(iterate_feature_answers(record))
            if feature_answers or _find_answer(row) != "HOLDS":
                sentences.append(f"  {wheel.words}: {_describe_wheel(wheel, row)}")
                sentences += [f"    {answer}" for answer in feature_answers]
        for name, telling in tellings.items():
            records = [None if record is None else record[name] for *_, record in answers]
            sentences += [f"  {sentence}" for sentence in telling.total(records)]
    if len(radii) > 1 or judged_wheels.share_without:
        shares = ", ".join(f"{answer} {1e2 * share:.3g} %" for answer, share in judged_wheels.shares().items())
        sentences.append(f"over the distance of all wheels: {shares}")
    return sentences


def _describe_wheel(wheel: CurveWheel, row: Mapping[str, Any]) -> str:
    """Answer for a wheel: the verdict, and unless Hertz holds the deciding deviation and the theory to use instead."""
    if wheel.case is None or _find_answer(row) == NOT_SOLVED:
        return f"{NOT_SOLVED}: {describe_status(row).removeprefix('failed: ')}"
    if _find_answer(row) == "HOLDS":
        return "Hertz HOLDS"
    columns = dict(row)
    reasons = (deciding_measure_text(columns, wheel.case.criteria.limits), cheapest_text_of_row(columns))
    return "; ".join([f"Hertz {row['verdict_answer']}", *filter(None, reasons)])
