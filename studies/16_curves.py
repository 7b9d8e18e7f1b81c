"""Which positions does a curve visit, and what does the theory of the contact move?

A metro trailer in curves of 200 to 500 m and the Manchester vehicle 1, as a main-line coach, in curves of 600 to
3000 m: S1002 on 60E1 at 1:40, gauge 1435 mm, friction 0.3, cant balanced. Normal forces by Hertz at all contact points
as springs, overlapping strips, Kik and Piotrowski, the strip method, and the half-space. What is told: the shift, yaw
and load of all four wheels of the leading bogie, where Hertz's ellipse is within the criteria of the strip method
there, where a theory has no equilibrium, by how much each is off the half-space in shift and Y/Q of the leading
wheelset, and the critical speed on straight track.

Reference: the half-space for what theories change, and a proven solution by another program with overlapping strips
for two positions. Expected: inner and trailing wheels between -6 and 2.5 mm, outer leading wheels between 5 and 6.3 mm
in curves below 1000 m, on two patches or on the root of the flange and yawed by 1 to 12 mrad.

`cases()` are two outer leading wheels by finite elements with their shift, yaw and vertical force: the Manchester bogie
at R 500 and the metro's at R 300; without creep forces the normal force is a tenth more than in the curve. Vehicles are
run in full size only, in some two minutes; `curves.md` is their table.

Found: without their yaw an ellipse is within the criteria of the strip method for 10 of 12 (metro) and 10 of 16
(Manchester) wheels. It is not within them for the trailing wheelset at 1 to 2 mm and for outer leading wheels at about
5 mm. The largest deviations from the half-space are 0.27 mm and 0.014 in Y/Q for springs, 0.12 mm and 0.013 (more than
10 % at R 3000 only) for overlapping strips, 0.16 mm and 0.005 for Kik and Piotrowski, and 0.02 mm and 0.001 for the
strip method. Critical speeds by springs, overlapping strips, strip method and half-space: 239, 186, 217, 223 km/h
(metro), 305, 242, 276, 272 km/h (Manchester); by Kik and Piotrowski 177 and 248. The critical speed by the half-space
depends on its nodes: 212 to 254 km/h with 8 nodes along half the patch and 0.3 mm across, 221 to 223 with 16 and 0.1
mm, which are used for straight track. A free wheelset on springs has no equilibrium at some radii.

With their yaw, Hertz has a deviation of -8.1 ± 0.3 % in the peak at the Manchester wheel (6.12 mm, 4.84 mrad, 58 kN,
1929 MPa; ANALYN holds) and of -16.9 ± 0.3 % at the metro's wheel (6.21 mm, 5.57 mrad, 61 kN, 1662 MPa, a second lobe;
unresolved). At 6 mm and 50 kN without yaw Hertz holds: a map does not give the verdict on a yawed wheel.

224 cases (2 vehicles, both bogies, friction 0.15 to 0.5, -0.4 and 0.65 m/s2, 3000 to 200 m, overlapping strips) all
have an equilibrium, with less than 1e-6 N left, in 0.44 CPU s each. In three of the 32 paths the trailing wheelset goes
over to the inner rail between R 280 and R 240 within a fold; the equilibrium beyond it is found.

Differences of the rolling radii at 0.1, 0.25, 0.5 and 1 mm, 60 kN per wheel: 0.0443, 0.1107, 0.2227, 0.4309 mm; by the
half-space of the ladder 0.0444, 0.1110, 0.2223, 0.4305 mm; by the proven solution 0.042, 0.107, 0.222, 0.435 mm. The
differences near the middle are most likely due to the roll in the other program: without roll both agree within 3 %.

Not made: tables of the loaded contact over shift, roll and load for Newton's method. The outer leading wheel is yawed,
so that such tables would need yaw as a fourth variable.
"""

from math import atan
from pathlib import Path
from typing import Any

import fecontact
from fecontact.case import Case
from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.sentences import describe_difference, describe_straight_track
from fecontact.features.curves.visits import CurveResults
from fecontact.outputs.style import ANSWER_COLOURS, SERIES_COLOURS, SERIES_MARKS, add_grid, blank_figure, save_figure
from fecontact.regression.checks import Check
from fecontact.solving.alone import iterate_table_rows

PAIR = {"rail": "60E1", "wheel": "S1002", "inclination_rad": atan(1.0 / 40.0)}
VISITS = {"metro": (500.0, 300.0, 200.0), "manchester": (3000.0, 1500.0, 1000.0, 600.0)}
THEORIES = ("multi_hertz", "overlap", "kik_piotrowski", "strip", "half_space")
REFERENCE = THEORIES[-1]
# Outer leading wheels by finite elements: shift (mm), yaw (mrad), vertical force (N).
BY_ELEMENTS = {"Manchester, R 500 m": (6.12, 4.84, 58e3), "metro, R 300 m": (6.21, 5.57, 61e3)}
# Leading shift and yaw, trailing shift, by the other program. The limit is the resolution of its printed digits.
PROVEN = {("manchester", 1000.0): (5.31, 2.01, 1.50), ("metro", 300.0): (6.21, 5.57, 0.89)}
PROVEN_PERCENT = 1.0
LARGE_PERCENT = 10.0
_LARGE = 1e-2 * LARGE_PERCENT
# A Y/Q below this limit is compared with the limit.
SMALL_Y_OVER_Q = 0.1
# Positions and the load (N) of the figure's zones.
ZONES_MM, ZONES_N = [0.25 * k for k in range(-24, 25)], 57e3


def cases(quick: bool = False) -> list[Case]:
    """Two outer leading wheels, yawed, with the roll of the wheelset.

    In quick size, the first wheel.
    """
    wheel_cases = [
        Case(**PAIR, lateral_shift_mm=shift, yaw_rad=1e-3 * yaw, load_N=load, roll="touching")
        for shift, yaw, load in BY_ELEMENTS.values()
    ]
    return wheel_cases[:1] if quick else wheel_cases


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Two positions of bogies against the other program."""
    position_checks = []
    for (vehicle, radius), numbers in PROVEN.items():
        (run,) = fecontact.curve(vehicle, [radius], case=Case(**PAIR)).runs["overlap"]
        positions = (run.wheelsets[0].lateral_shift_mm, run.wheelsets[0].yaw_mrad, run.wheelsets[1].lateral_shift_mm)
        for name, value, expected in zip(
            ("shift 1, mm", "yaw 1, mrad", "shift 2, mm"), positions, numbers, strict=True
        ):
            position_checks.append(
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
    return position_checks


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Verdicts of the two wheels; in full size also the visited positions and theory differences."""
    words = [
        f"{name}: {row['verdict_answer']} ({', '.join(filter(None, (row['verdict_failing'], row['verdict_cause'])))})"
        for name, row in zip(BY_ELEMENTS, rows, strict=False)
    ]
    said = ["Hertz on outer leading wheels: " + "; ".join(words) + "."]
    if len(rows) == len(BY_ELEMENTS):
        results = {
            name: fecontact.curve(name, radii, case=Case(**PAIR), theories=THEORIES) for name, radii in VISITS.items()
        }
        enough = hertz_is_enough()
        (out / "curves.md").write_text("\n".join(_table(results)) + "\n", encoding="utf-8")
        draw(results, enough, out / "curves.png")
        said += [_describe_visits(results, enough), _describe_differences(results)]
        said += [describe_difference(difference) for curves in results.values() for difference in curves.differences]
        said += [
            describe_straight_track(straight_track) for curves in results.values() for straight_track in curves.straight
        ]
    return "\n".join(said)


def hertz_is_enough() -> dict[float, bool]:
    """Whether Hertz's ellipse meets the strip method's criteria at each position, without yaw."""
    lines = iterate_table_rows(Case(**PAIR, roll="touching"), ZONES_MM, [ZONES_N])
    return {line.case.lateral_shift_mm: line.cheapest.label == "hertz" for line in lines}


def _wheels(run: CurveRun) -> list[tuple[float, float]]:
    """Shift on the map of the left wheel, and yaw, of all wheels."""
    return [
        (sign * wheelset.lateral_shift_mm, sign * wheelset.yaw_mrad)
        for wheelset in run.wheelsets
        for sign in (1.0, -1.0)
    ]


def _describe_visits(results: dict[str, CurveResults], enough: dict[float, bool]) -> str:
    """Sentence on the positions of the wheels by the reference."""
    parts = []
    for name, curves in results.items():
        runs = curves.runs[REFERENCE]
        shifts = [shift for run in runs for shift, _ in _wheels(run)]
        leading = [_wheels(run)[0] for run in runs]
        inside = [enough[min(enough, key=lambda place: abs(place - shift))] for shift in shifts]
        parts.append(
            f"the {name}'s wheels are at {min(shifts):.1f} to {max(shifts):.1f} mm, its outer leading one at"
            f" {min(leading)[0]:.1f} to {max(leading)[0]:.1f} mm with {min(yaw for _, yaw in leading):.1f} to"
            f" {max(yaw for _, yaw in leading):.1f} mrad, and {sum(inside)} of {len(inside)} where an ellipse is enough"
        )
    return f"In curves {'; '.join(parts)}."


def _describe_differences(results: dict[str, CurveResults]) -> str:
    """Sentence on theory deviations above a tenth from the reference."""
    parts = []
    for name, curves in results.items():
        for theory in THEORIES[:-1]:
            pairs = list(zip(curves.runs[theory], curves.runs[REFERENCE], strict=True))
            radii = [
                f"{run.radius_m:g}"
                for run, reference_run in pairs
                if run.is_balanced and max(_relative_deviations(run, reference_run)) > _LARGE
            ]
            speed = next(difference.critical_speed for difference in curves.differences if difference.theory == theory)
            texts = [f"shift or Y/Q at R {', '.join(radii)} m"] * bool(radii)
            texts += [f"critical speed {1e2 * speed:+.0f} %"] * (speed is not None and abs(speed) > _LARGE)
            texts += [f"no equilibrium at R {run.radius_m:g} m" for run, _ in pairs if not run.is_balanced]
            if texts:
                parts.append(f"{name}, {theory}: {', '.join(texts)}")
    return f"More than {LARGE_PERCENT:g} % off the half-space: {'; '.join(parts) or 'nothing'}."


def _relative_deviations(run: CurveRun, reference_run: CurveRun) -> tuple[float, float]:
    """Relative deviations of the leading wheelset in shift and outer-wheel Y/Q.

    Both are relative to the reference run. A Y/Q below `SMALL_Y_OVER_Q` is compared with that limit.
    """
    a, b = run.wheelsets[0], reference_run.wheelsets[0]
    y_over_q, reference_y_over_q = a.wheels[0].y_over_q, b.wheels[0].y_over_q
    return (
        abs(a.lateral_shift_mm / b.lateral_shift_mm - 1.0),
        abs(y_over_q - reference_y_over_q) / max(abs(reference_y_over_q), SMALL_Y_OVER_Q),
    )


def _table(results: dict[str, CurveResults]) -> list[str]:
    """Lines of text: every theory against the reference."""
    lines = ["| vehicle | R, m | theory | shift 1, mm | yaw 1, mrad | Y/Q | shift 2, mm | off in shift 1, Y/Q, % |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for name, curves in results.items():
        for theory in THEORIES:
            for run, exact in zip(curves.runs[theory], curves.runs[REFERENCE], strict=True):
                head = f"| {name} | {run.radius_m:g} | {theory} |"
                if not run.is_balanced:
                    lines.append(f"{head} none | | | | |")
                    continue
                first, second = run.wheelsets
                shift, guiding = _relative_deviations(run, exact)
                lines.append(
                    f"{head} {first.lateral_shift_mm:.2f} | {first.yaw_mrad:.2f} | {first.wheels[0].y_over_q:.3f} |"
                    f" {second.lateral_shift_mm:.2f} | {1e2 * shift:.1f}, {1e2 * guiding:.1f} |"
                )
    return lines


def draw(results: dict[str, CurveResults], enough: dict[float, bool], path: Path) -> Path:
    """Draw the positions of a bogie's four wheels over the radius, and their yaw.

    The positions are on the map of the left wheel.
    """
    figure = blank_figure(12.0, 5.0)
    axes = figure.subplots(1, 2)
    step = ZONES_MM[1] - ZONES_MM[0]
    for place, holds in enough.items():
        colour = ANSWER_COLOURS["HOLDS" if holds else "FAILS"]
        axes[0].axvspan(place - 0.5 * step, place + 0.5 * step, color=colour, alpha=0.35, lw=0.0)
    for number, (name, theory) in enumerate((v, t) for v in VISITS for t in ("multi_hertz", REFERENCE)):
        good = [run for run in results[name].runs[theory] if run.is_balanced]
        style = {"color": SERIES_COLOURS[number], "marker": SERIES_MARKS[number], "linestyle": "none"}
        if theory != REFERENCE:
            style["markerfacecolor"] = "none"
        for run in good:
            label = f"{name}, {theory}" if run is good[0] else None
            wheels = _wheels(run)
            axes[0].plot([shift for shift, _ in wheels], [run.radius_m] * len(wheels), label=label, **style)
            axes[1].plot(*zip(*wheels[::2], strict=True), label=label, **style)
    axes[0].set(
        xlabel="lateral shift towards the wheel's own rail, mm", ylabel="radius, m", yscale="log", xlim=(-7.0, 7.0)
    )
    axes[0].set_title("blue: an ellipse is within the criteria of the strip method, 57 kN, no yaw", fontsize=9)
    axes[1].set(xlabel="lateral shift of the wheelset to the outer rail, mm", ylabel="yaw (angle of attack), mrad")
    add_grid(*axes)
    axes[1].legend(fontsize=8, loc="upper left")
    figure.suptitle("all wheels of leading bogies on the map of the left wheel; S1002 on 60E1 1:40, friction 0.3")
    return save_figure(figure, path)


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
