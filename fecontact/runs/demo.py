"""A first example: a position at which Hertz's peak is right and its patch is not, and a sphere, where all is."""

from __future__ import annotations

import math
from pathlib import Path

from fecontact.case import Case
from fecontact.outputs.verdict_words import verdict_reason
from fecontact.runs.casefile import Study
from fecontact.runs.identity import case_id
from fecontact.runs.store import case_folder, read_case
from fecontact.runs.study import StudyOutcome

_RADIUS_MM = 460.0
POSITION = Case(lateral_shift_mm=3.0, refine="never")
# two cylinders of one radius that cross at right angles touch as a sphere of that radius touches a plane
SPHERE = Case(
    rail=f"circle:{_RADIUS_MM:g}",
    wheel=f"cylinder:{_RADIUS_MM:g}",
    inclination_rad=0.0,
    refine="never",
)


def demo_study() -> Study:
    """Both cases, on first meshes alone."""
    return Study(name="demo", cases=(POSITION, SPHERE))


def exact_peak_MPa() -> float:
    """Peak pressure of the sphere in closed form (Johnson 1985, eq. 3.25): (6 F E*^2 / (pi^3 R^2))^(1/3)."""
    return float((6.0 * SPHERE.load_N * SPHERE.contact_modulus_MPa**2 / (math.pi**3 * _RADIUS_MM**2)) ** (1.0 / 3.0))


def demo_words(out: Path, outcome: StudyOutcome) -> str:
    """What came out, and where the files are."""
    if not outcome.all_converged:
        return f"Not all could be solved; {out / 'study.csv'} says why"
    folders = {case: case_folder(out, case_id(case)) for case in (POSITION, SPHERE)}
    result, sphere = (read_case(folder) for folder in folders.values())
    exact, found = exact_peak_MPa(), sphere.comparison.fe.p_max_MPa
    where, verdict = folders[POSITION], result.load.answer.answer
    return "\n".join(
        (
            f"Sphere of {_RADIUS_MM:g} mm on a plane, {SPHERE.load_N / 1e3:g} kN: the finite elements' peak pressure is"
            f" {found:.1f} MPa, the exact one {exact:.1f} MPa: {1e2 * (found / exact - 1.0):+.2f} %.",
            f"S1002 on 60E1 1:40, shifted by {POSITION.lateral_shift_mm:g} mm, {POSITION.load_N / 1e3:g} kN: Hertz"
            f" {verdict}.",
            f"  {verdict_reason(result.load)}",
            f"  Peak pressure: Hertz {result.comparison.hertz.p_max_MPa:.0f} MPa, finite elements"
            f" {result.comparison.fe.p_max_MPa:.0f} MPa.",
            "",
            f"Report:   {out / 'report.html'}",
            f"Picture:  {where / 'case.png'}",
            f"ParaView: {where / 'case.vtm'}",
            f"Table:    {out / 'study.csv'}",
            "Next: fecontact init FOLDER for a study of your own, fecontact solve --help-all for all inputs",
        )
    )
