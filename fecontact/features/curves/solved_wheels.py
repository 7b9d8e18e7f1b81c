"""Wheels of a vehicle in curves, judged by finite elements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.features.curves.curve import WheelRun, WheelsetRun
from fecontact.features.curves.visits import NO_EQUILIBRIUM, CurveResults
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.remaining import Progress
from fecontact.outputs.verdict_words import cheapest_text_of_row, deciding_measure_text
from fecontact.runs.casefile import Study
from fecontact.runs.identity import make_case_id
from fecontact.runs.study import StudyOutcome, run_study


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
        Case of the wheel.
    """

    radius_m: float
    wheelset: int
    side: TrackSide
    is_outer: bool
    share: float
    patch_count: int
    case: Case

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
        Row of the study for each wheel.
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
            case=make_wheel_case(results, wheelset, wheel),
        )
        for run in list(results.runs.values())[-1]
        if run.is_balanced
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    )


def make_wheel_case(results: CurveResults, wheelset: WheelsetRun, wheel: WheelRun) -> Case:
    """Make the case of a wheel in a curve.

    The wheelset has the shift, yaw and roll of its steady motion. The load is the vertical component of the normal
    forces of all patches: finite elements have no friction, and their contact carries this component alone. Friction
    and creepages are those of the patch with the largest normal force.

    Parameters
    ----------
    results
        Results of a vehicle in curves.
    wheelset
        Steady motion of the wheelset.
    wheel
        Wheel of this wheelset.

    Returns
    -------
    Case
        Case with the profiles, track and materials of the curve.

    Raises
    ------
    InputError
        If the wheel has no contact.
    """
    if not wheel.patches:
        raise InputError(f"the {wheel.side} wheel has no contact; give curves in which both wheels carry a load")
    largest = max(wheel.patches, key=lambda patch: patch.normal_force_N)
    creepages = largest.creepages
    return replace(
        results.case,
        lateral_shift_mm=wheelset.lateral_shift_mm,
        yaw_rad=1e-3 * wheelset.yaw_mrad,
        roll="given",
        roll_rad=1e-3 * wheelset.roll_mrad,
        side=wheel.side,
        load_N=sum(patch.normal_force_N * math.cos(patch.angle_rad) for patch in wheel.patches),
        load_kind="vertical",
        creep=replace(
            results.case.creep,
            friction=results.conditions.friction,
            xi=creepages.xi,
            eta=creepages.eta,
            spin_per_mm=creepages.spin_per_mm,
        ),
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
    if not wheels:
        return SolvedWheels(theory=theory, wheels=(), rows=(), share_without=1.0, outcome=None)
    case_ids = [make_case_id(wheel.case) for wheel in wheels]
    cases = dict(zip(case_ids, (wheel.case for wheel in wheels), strict=True))
    study = Study(
        name="wheels",
        cases=tuple(cases.values()),
        question="Does Hertz hold on the wheels of a vehicle in curves?",
    )
    outcome = run_study(study, out, settings=settings, progress=progress)
    row_by_id = dict(zip(cases, outcome.rows, strict=True))
    return SolvedWheels(
        theory=theory,
        wheels=wheels,
        rows=tuple(row_by_id[case_id] for case_id in case_ids),
        share_without=share_without if share_without > 1e-9 else 0.0,
        outcome=outcome,
    )


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
        For each radius the number of wheels for which Hertz holds, then each wheel for which it does not. At the end
        the shares of the distance, if there are several radii.
    """
    sentences = []
    radii = dict.fromkeys(wheel.radius_m for wheel in judged_wheels.wheels)
    for radius in radii:
        answers = [
            (wheel, row)
            for wheel, row in zip(judged_wheels.wheels, judged_wheels.rows, strict=True)
            if wheel.radius_m == radius
        ]
        without = [(wheel, row) for wheel, row in answers if _find_answer(row) != "HOLDS"]
        sentences.append(f"R {radius:g} m: Hertz holds for {len(answers) - len(without)} of {len(answers)} wheels")
        sentences += [f"  {wheel.words}: {_describe_wheel(wheel.case, row)}" for wheel, row in without]
    if len(radii) > 1 or judged_wheels.share_without:
        shares = ", ".join(f"{answer} {1e2 * share:.3g} %" for answer, share in judged_wheels.shares().items())
        sentences.append(f"over the distance of all wheels: {shares}")
    return sentences


def _describe_wheel(case: Case, row: Mapping[str, Any]) -> str:
    """Answer for a wheel on which Hertz does not hold: the deciding deviation, and the theory to use instead."""
    if _find_answer(row) == NOT_SOLVED:
        return f"{NOT_SOLVED}: {row['status']}"
    columns = dict(row)
    reasons = (deciding_measure_text(columns, case.criteria.limits), cheapest_text_of_row(columns))
    return "; ".join([f"Hertz {row['verdict_answer']}", *filter(None, reasons)])
