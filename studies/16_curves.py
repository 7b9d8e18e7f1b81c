"""Which positions does a curve visit, and what does the theory of the contact move?

A metro trailer in curves of 200 to 500 m and the Manchester vehicle 1, as a main-line coach, in curves of 600 to
3000 m: S1002 on 60E1 at 1:40, gauge 1435 mm, friction 0.3, cant balanced. Normal forces by Hertz at all touch points as
springs, overlapping strips, Kik and Piotrowski, and the half-space. What is told: the
shift, yaw and load of all four wheels of the leading bogie, where a theory has no equilibrium, by how much each is off
the half-space in shift and Y/Q of the leading wheelset, and the critical speed on straight track.

Reference: the half-space for what theories change, and a proven solution by another program with overlapping strips
for two positions. Expected: inner and trailing wheels between -6 and 2.5 mm, outer leading wheels between 5 and 6.3 mm
in curves below 1000 m, on two patches or on the root of the flange and yawed by 1 to 12 mrad.

`cases()` are two outer leading wheels by finite elements with their shift, yaw and load: the Manchester bogie at R 500
and the metro's at R 300. The table and the figure alone, in some minutes:
`python studies/16_curves.py --figure`.
"""

import sys
from math import atan
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.geometry.placement import pair_of
from fecontact.geometry.wheelset import Wheelset
from fecontact.material import STEEL
from fecontact.outputs.figures.style import MARKS, SERIES, blank_figure, finish, save_figure
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.regression.checks import Check
from fecontact.vehicle.conditions import Conditions, lines_of
from fecontact.vehicle.curve import CurveRun, curves
from fecontact.vehicle.model import load_vehicle
from fecontact.vehicle.stability import critical_speed_m_s, linear_model

PAIR = {"rail": "60E1", "wheel": "S1002", "inclination_rad": atan(1.0 / 40.0)}
VISITS = {"metro": (500.0, 300.0, 200.0), "manchester": (3000.0, 1500.0, 1000.0, 600.0)}
THEORIES = ("multi_hertz", "overlap", "kik_piotrowski", "half_space")
REFERENCE = "half_space"
# Outer leading wheels by finite elements: shift (mm), yaw (mrad), vertical force (N).
BY_ELEMENTS = {"Manchester, R 500 m": (6.12, 4.84, 58e3), "metro, R 300 m": (6.21, 5.57, 61e3)}
# Leading shift and yaw, trailing shift, by the other program, and how far off they may be: its digits.
PROVEN = {("manchester", 1000.0): (5.31, 2.01, 1.50), ("metro", 300.0): (6.21, 5.57, 0.89)}
PROVEN_PERCENT = 1.0
LARGE_PERCENT = 10.0


def cases(quick: bool = False) -> list[Case]:
    """Two outer leading wheels, yawed, with the roll of the wheelset; one in quick size."""
    every = [
        Case(**PAIR, lateral_shift_mm=shift, yaw_rad=1e-3 * yaw, load_N=load, roll="touching")
        for shift, yaw, load in BY_ELEMENTS.values()
    ]
    return every[:1] if quick else every


def wheelset(radius_mm: float) -> Wheelset:
    """The pair on both sides."""
    own = pair_of(
        resolve_rail("60E1"),
        resolve_wheel("S1002").profile,
        inclination_rad=PAIR["inclination_rad"],
        rolling_radius_mm=radius_mm,
    )
    return Wheelset.of(own, own)


def runs(theory: str, vehicle: str, radii: tuple[float, ...] = ()) -> list[CurveRun]:
    """A vehicle in its curves."""
    made = load_vehicle(vehicle)
    return curves(made, wheelset(made.wheelset.rolling_radius_mm), radii or VISITS[vehicle], theory=theory)


def critical_speed(theory: str, vehicle: str) -> float | None:
    """Critical speed in m/s."""
    made = load_vehicle(vehicle)
    line = lines_of(
        Conditions(),
        wheelset(made.wheelset.rolling_radius_mm),
        materials=(STEEL, STEEL),
        theory=theory,
        widest_per_mm=1e-6,
    )(0.0)
    return critical_speed_m_s(linear_model(made, line))


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Two positions of bogies against the other program."""
    found = []
    for (vehicle, radius), numbers in PROVEN.items():
        (run,) = runs("overlap", vehicle, (radius,))
        own = (run.wheelsets[0].lateral_shift_mm, run.wheelsets[0].yaw_mrad, run.wheelsets[1].lateral_shift_mm)
        for name, value, expected in zip(("shift 1, mm", "yaw 1, mrad", "shift 2, mm"), own, numbers, strict=True):
            found.append(
                Check(
                    quantity=name,
                    case=f"{vehicle}, R {radius:g} m, overlapping strips",
                    reference="the same equations by another program",
                    kind="other code",
                    value=value,
                    expected=expected,
                    limit_percent=PROVEN_PERCENT,
                )
            )
    return found


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Write what the finite elements say of the two wheels."""
    words = [
        f"{name}: {row['verdict']}" + (f" ({row['verdict_measure']})" if row.get("verdict_measure") else "")
        for name, row in zip(BY_ELEMENTS, rows, strict=False)
    ]
    return "Hertz on outer leading wheels: " + "; ".join(words) + "."


def _table(found: dict[tuple[str, str], list[CurveRun]]) -> list[str]:
    """Lines of text: every theory against the reference."""
    lines = ["| vehicle | R, m | theory | shift 1, mm | yaw 1, mrad | Y/Q | shift 2, mm | off in shift 1, Y/Q, % |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for vehicle in VISITS:
        exact = {run.radius_m: run for run in found[vehicle, REFERENCE]}
        for theory in THEORIES:
            for run in found[vehicle, theory]:
                head = f"| {vehicle} | {run.radius_m:g} | {theory} |"
                if run.status == "no equilibrium":
                    lines.append(f"{head} none | | | | |")
                    continue
                other = exact[run.radius_m].wheelsets[0]
                first, second = run.wheelsets
                off = first.lateral_shift_mm / other.lateral_shift_mm - 1.0
                guiding = first.wheels[0].y_over_q - other.wheels[0].y_over_q
                # of Y/Q itself, or of 0.1 where it is small
                relative = guiding / max(abs(other.wheels[0].y_over_q), 0.1)
                large = " large" if max(abs(off), abs(relative)) > 1e-2 * LARGE_PERCENT else ""
                lines.append(
                    f"{head} {first.lateral_shift_mm:.2f} | {first.yaw_mrad:.2f} | {first.wheels[0].y_over_q:.3f} |"
                    f" {second.lateral_shift_mm:.2f} | {1e2 * off:+.1f}, {1e2 * relative:+.1f}{large} |"
                )
    return lines


def draw(found: dict[tuple[str, str], list[CurveRun]], path: Path) -> Path:
    """Draw where the four wheels of a bogie are on the map of the left wheel, over the radius, and their yaw."""
    figure = blank_figure(12.0, 5.0)
    axes = figure.subplots(1, 2)
    for number, (vehicle, theory) in enumerate((v, t) for v in VISITS for t in ("multi_hertz", REFERENCE)):
        good = [run for run in found[vehicle, theory] if run.status != "no equilibrium"]
        style = {"color": SERIES[number], "marker": MARKS[number], "linestyle": "none"}
        if theory != REFERENCE:
            style["markerfacecolor"] = "none"
        for place in (0, 1):
            shift = np.array([run.wheelsets[place].lateral_shift_mm for run in good])
            radii = [run.radius_m for run in good]
            label = f"{vehicle}, {theory}" if place == 0 else None
            axes[0].plot(shift, radii, label=label, **style)
            axes[0].plot(-shift, radii, **style)
            axes[1].plot(shift, [run.wheelsets[place].yaw_mrad for run in good], label=label, **style)
    axes[0].set(
        xlabel="lateral shift towards the wheel's own rail, mm", ylabel="radius, m", yscale="log", xlim=(-7.0, 7.0)
    )
    axes[1].set(xlabel="lateral shift of the wheelset to the outer rail, mm", ylabel="yaw (angle of attack), mrad")
    finish(*axes)
    axes[0].legend(fontsize=8, loc="upper left")
    figure.suptitle("all wheels of leading bogies on the map of the left wheel; S1002 on 60E1 1:40, friction 0.3")
    return save_figure(figure, path)


def main() -> None:
    """Print the table, and draw the figure."""
    found = {(vehicle, theory): runs(theory, vehicle) for vehicle in VISITS for theory in THEORIES}
    print("\n".join(_table(found)))
    for vehicle in VISITS:
        speeds = {theory: critical_speed(theory, vehicle) for theory in THEORIES}
        told = ", ".join(f"{t} {'none' if v is None else f'{v:.1f}'}" for t, v in speeds.items())
        print(f"critical speed of the {vehicle} bogie, m/s: {told}")
    print(draw(found, Path(__file__).parent / "figures" / "curves.png"))


if __name__ == "__main__":
    if "--figure" in sys.argv[1:]:
        main()
    else:
        from fecontact.cli import run_script

        run_script(__file__)
