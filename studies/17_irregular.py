"""Down to which wave does Hertz's spring over an irregular wheel or rail (eq. 6) hold, and what do codes take instead?

Corrugation of 20 to 200 mm, wheels out of round, worn flats and welds, on S1002 on 60E1 1:40 at a shift of 3 mm under
100 kN: eq. 6, the path of the rigid wheel, the mean over the patch, Hertz at the rigid contact points and on a fitted
parabola, each against the half-space with the irregularity in its gap.

Reference: the half-space, and for the force of low waves the mean over the patch, sin(ka)/(ka), which is exact there.
Expected: eq. 6 holds from some three lengths of the patch on at 10 um, from six at 50 um; on flats it does not.

`cases()` are two waves and a worn flat by finite elements on R 300, and the smooth pair for comparison: the change from
the half-space to finite bodies should not depend on the irregularity. The tables and the figure alone, in minutes:
`python studies/17_irregular.py --figure`.

Found (patch 15.8 mm long, approach 115 um): the least of three closed forms gives the limit of eq. 6 within some 8 %,
at worst 20 %. The patch filters the wave, 1.5 (h/delta)(1 - sin(ka)/(ka)); the wheel touches beside its middle,
(hk)^2/(4A); the wave bends the surface, h k^2/2A. Largest errors in force of `eq6`, `path`, `local` and `fitted`, %:
corrugation of 30 mm, 25 um -15, -15, +5.7, -0.4; of 60 mm -3.8, -3.8, +0.1, 0; wheel of order 6, 300 um -4.6, -0.7, 0,
0; weld of 100 mm, 150 um -7.0, -4.2, +1.6, 0; worn flat of 52 mm -100, -50, +9.4, -0.7; fresh flat of 40 mm -100, +79,
+20, -8.8. A fitted parabola has no result where the patch bridges a hollow.

Finite bodies change the peak on R 300 by 0.046 % without a wave. They change it by 0.043, 0.039 and 0.039 % with waves
of 50 and 20 mm, 10 um, and on the flank of the worn flat. The half-space on 16 nodes per semi-axis is within 0.03 % of
another program in the approach and within 0.25 % in the peak. A cell of the map takes 0.11 CPU s.
"""

import math
import sys
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.features.irregular.running import irregular
from fecontact.features.irregular.telling import draw_irregular
from fecontact.jobs.workers import count_default_workers
from fecontact.placement.irregularity import Irregularity
from fecontact.regression.checks import Check

CIRCLES: dict[str, Any] = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
REAL = Case(lateral_shift_mm=3.0, inclination_rad=math.atan(1.0 / 40.0))
WAVELENGTHS_MM = (20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 120.0, 160.0, 200.0)
AMPLITUDES_MM = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
# Irregularities in service: text of the irregularity, and the positions besides its middle that are evaluated.
EVERYDAY: dict[str, tuple[str, tuple[float, ...]]] = {
    "corrugation of 30 mm, 25 um": ("sine:wavelength_mm=30,amplitude_um=25", ()),
    "corrugation of 60 mm, 25 um": ("sine:wavelength_mm=60,amplitude_um=25", ()),
    "wheel of order 20, 50 um": (f"sine:wavelength_mm={2.0 * math.pi * 460.0 / 20.0:.2f},amplitude_um=50", ()),
    "wheel of order 6, 300 um": (f"sine:wavelength_mm={2.0 * math.pi * 460.0 / 6.0:.2f},amplitude_um=300", ()),
    "weld of 100 mm, 150 um": ("haversine:length_mm=100,depth_mm=0.15", ()),
    "weld of 300 mm, 300 um": ("haversine:length_mm=300,depth_mm=0.3", ()),
    "worn flat of 52 mm": ("haversine:length_mm=52,depth_mm=0.435", ()),
    "fresh flat of 40 mm": ("chord:length_mm=40", ()),
}
# By finite elements: irregularity, position on it (mm), and the half-space's peak (MPa) by an independent program.
BY_ELEMENTS: dict[str, tuple[Irregularity | None, float, float]] = {
    "smooth": (None, 0.0, 1237.56),
    "wave of 50 mm": (Irregularity(kind="sine", wavelength_mm=50.0, amplitude_mm=0.010), 25.0, 1264.3),
    "wave of 20 mm": (Irregularity(kind="sine", wavelength_mm=20.0, amplitude_mm=0.010), 10.0, 1378.2),
    "worn flat of 52 mm": (Irregularity(kind="haversine", length_mm=52.0, depth_mm=0.434783), 10.0, 1542.7),
}
# Nodes of an independent program, 16 to 64 a semi-axis.
HALF_SPACE_PERCENT = 0.3


def cases(quick: bool = False) -> list[Case]:
    """The smooth pair, two waves and a flat.

    In quick size, the smooth pair and one wave.
    """
    irregular_cases = [
        Case(**CIRCLES, wheel_irregularity=line, distance_mm=distance, refine="never")
        for line, distance, _ in BY_ELEMENTS.values()
    ]
    return irregular_cases[:2] if quick else irregular_cases


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the half-space by an independent program and of the bodies' step.

    The step from the half-space to the bodies is compared with the step of the smooth pair.
    """
    peak_checks = []
    for row, (name, (line, distance, expected)) in zip(rows, BY_ELEMENTS.items(), strict=False):
        peak_checks.append(
            Check(
                quantity="peak pressure of the half-space, MPa",
                case=f"{name} at {distance:g} mm",
                reference="finer nodes, by another program",
                kind="other code",
                value=float(row["half_space_p_max_MPa"]),
                expected=expected,
                limit_percent=HALF_SPACE_PERCENT,
            )
        )
        if line is not None:
            smooth_ratio, peak_ratio = (
                1.0 + 1e-2 * float(compared_row["steps_half_space_to_bodies_p_max_percent"])
                for compared_row in (rows[0], row)
            )
            peak_checks.append(
                Check(
                    quantity="peak pressure with the bodies over that without",
                    case=f"{name} at {distance:g} mm",
                    reference="the smooth pair: bodies do not know of it, but for the slope",
                    kind="invariant",
                    value=peak_ratio,
                    expected=smooth_ratio,
                    limit_percent=1e2 * line.largest_slope,
                )
            )
    return peak_checks


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Contributions of the bodies to the peak, compared with the smooth pair."""
    added = [float(row["steps_half_space_to_bodies_p_max_percent"]) for row in rows]
    peak_changes = [f"{name} {percent:+.2f} %" for name, percent in zip(BY_ELEMENTS, added, strict=False)]
    largest = max(abs(percent - added[0]) for percent in added[1:])
    return (
        f"Finite bodies move the peak by {', '.join(peak_changes)}: what is irregular changes that by"
        f" {largest:.2f} % at most, and the half-space is enough for it."
    )


def everyday_table() -> list[str]:
    """Table of the errors of each model on everyday irregularities."""
    lines = ["| irregularity | model | worst force, % | worst peak, % | holds at places, % |", "|---|---|---|---|---|"]
    for name, (text, places) in EVERYDAY.items():
        result = irregular(REAL, irregularity=text, positions_mm=places, workers=count_default_workers())
        for model, worst in result["worst"].items():
            force, peak = (
                "-" if worst[key] is None else f"{1e2 * worst[key]:+.1f}" for key in ("force_error", "peak_error")
            )
            lines.append(f"| {name} | {model} | {force} | {peak} | {1e2 * worst['share_within_limit']:.0f} |")
    return lines


def main() -> None:
    """Print the limits of the map and the table, and draw the map."""
    result = irregular(
        REAL, wavelengths_mm=WAVELENGTHS_MM, amplitudes_mm=AMPLITUDES_MM, workers=count_default_workers()
    )
    for name in ("eq6", "fitted"):
        limits = [(limit["wavelength_mm"], limit["amplitude_mm"][name]) for limit in result["limits"]]
        limit_words = ", ".join(
            f"{length:g} mm {1e3 * height:.3g} um" for length, height in limits if height is not None
        )
        print(f"{name} holds up to: {limit_words}")
    print("\n".join(everyday_table()))
    print(draw_irregular(result, Path(__file__).parent / "figures" / "irregular.png"))


if __name__ == "__main__":
    if "--figure" in sys.argv[1:]:
        main()
    else:
        from fecontact.cli import run_script

        run_script(__file__)
