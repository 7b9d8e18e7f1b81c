"""What does the noise of a measured profile leave of Hertz's ellipse?

The exact lines of a 60E1 rail (1:40) and an S1002 wheel, sampled along the arc every 0.1, 0.2 and 0.5 mm with 5, 10 and
20 um of independent noise across the line, 20 seeds at 10 um every 0.2 mm and 4 elsewhere, are read as any measured
points are: smoothed as their deviation from the nearest profile of the library. Hertz's peak pressure and semi-axes
under 100 kN at shifts of -4, 0, 3 and 4 mm are held against those of the exact lines: closed forms, no finite elements.
At -4, 0, and 4 mm the contact point is 5.6, 10 and 3.4 mm from the next junction of curvature, at 3 mm 2.3 mm.

Reference: Hertz on the exact lines. Expected: peak and semi-axes within 3 % at 10 um every 0.2 mm, and the error inside
the stated uncertainty (0.71 and double the width, and other noise of the same size) in 95 %. The same points are also
smoothed without a nominal profile, which has to find the shape itself: what a nominal is worth is the difference.

`cases()` is the pair with exact lines, by finite elements; the sampled ones are made in `measured()`. The figure alone,
in some minutes: `python studies/14_measured_profiles.py --figure`.

Found: the largest errors of the peak are 0.4, 1.6, 0.1 and 0.1 % at -4, 0, 3 and 4 mm (10 um every 0.2 mm), and the
largest errors of b are 0.6, 2.6, 0.1 and 0.2 %. All 624 errors are within the stated uncertainty. All errors are below
3 %, except the errors of b at 0 mm (4.7 % with 20 um every 0.1 mm). Without a nominal profile, the largest errors of
the peak are 11 to 42 %, within the stated 17 to 190 %. If points with 10 um of noise every 0.2 mm are taken as exact,
then Hertz has more than ten times the true peak.

A spike is a point outside the scatter of its neighbours: 0.001 mm in a table of exact points, 0.3 mm in 0.02 mm of
noise. Of 1,422 tables with a wrong digit next to a junction under the contact point, 1,056 are refused or named. In the
other 366 the error of Hertz's peak is below 1 % or below the stated uncertainty in 358, and up to twice the stated
uncertainty in 8.
"""

import sys
from dataclasses import dataclass
from math import atan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.outputs.style import (
    SERIES_COLOURS,
    SERIES_MARKS,
    add_grid,
    add_legend_beside,
    blank_figure,
    save_figure,
    set_plain_log_scale,
)
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.regression.checks import Check
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import estimate_hertz_uncertainty

SHIFTS_MM = (-4.0, 0.0, 3.0, 4.0)
NOISES_MM = (0.005, 0.01, 0.02)
STEPS_MM = (0.1, 0.2, 0.5)
# Numbers of seeds at 10 um every 0.2 mm, and elsewhere.
SEEDS, FEWER_SEEDS = 20, 4
MEASURES = ("p_max_MPa", "a_mm", "b_mm")
# Limit for Hertz's peak and semi-axes at 10 um every 0.2 mm. Three seeds reach 0.8 % at 0 mm and 0.1 % elsewhere.
LIMIT_PERCENT = 3.0
LEAST_COVERED = 0.95
PAIR = {"rail": "60E1", "wheel": "S1002"}


@dataclass(frozen=True)
class Error:
    """Relative errors of Hertz on measured profiles, and the stated uncertainties.

    Both have the order of `MEASURES`; the reference is Hertz on exact profiles.
    """

    shift_mm: float
    noise_mm: float
    step_mm: float
    seed: int
    error: tuple[float, ...]
    stated: tuple[float, ...]


def write_sampled(folder: Path, name: str, step_mm: float, noise_mm: float, seed: int) -> str:
    """Write a file of points with noise across an exact profile; returns its path."""
    profile = load_library_profile(name)
    s = np.arange(0.0, profile.length_mm, step_mm)
    p = profile.evaluate(profile.at_arc_length(s))
    noise = noise_mm * np.random.default_rng([seed, len(name)]).normal(size=s.size)
    angle = p.angle_rad
    path = folder / f"{name}_{1e3 * noise_mm:g}um_{step_mm:g}mm_{seed}.txt"
    np.savetxt(path, np.column_stack((p.y - noise * np.sin(angle), p.z + noise * np.cos(angle))), fmt="%.9f")
    return str(path)


def _hertz(case: Case) -> tuple[np.ndarray, np.ndarray]:
    placement = place_case(case)
    hertz, stated = compute_hertz(case, placement), estimate_hertz_uncertainty(case, placement)
    values = np.array([hertz.p0_MPa, hertz.a_mm, hertz.b_mm])
    return values, np.zeros(3) if stated is None else np.array([stated[name] for name in MEASURES])


def measured(
    noises_mm: tuple[float, ...] = NOISES_MM,
    steps_mm: tuple[float, ...] = STEPS_MM,
    *,
    seeds: int = SEEDS,
    fewer: int = FEWER_SEEDS,
    nominal: str = "auto",
) -> list[Error]:
    """Errors and stated uncertainties of all samples at all shifts."""
    exact = {shift: _hertz(_case(shift))[0] for shift in SHIFTS_MM}
    reading = Reading(nominal=nominal)
    errors = []
    with TemporaryDirectory() as folder:
        for noise in noises_mm:
            for step in steps_mm:
                for seed in range(seeds if (noise, step) == (0.01, 0.2) else fewer):
                    files = {body: write_sampled(Path(folder), name, step, noise, seed) for body, name in PAIR.items()}
                    for shift in SHIFTS_MM:
                        values, stated = _hertz(_case(shift, rail_file=reading, wheel_file=reading, **files))
                        error = values / exact[shift] - 1.0
                        errors.append(Error(shift, noise, step, seed, tuple(error), tuple(stated)))
    return errors


def _case(shift_mm: float, **overrides: Any) -> Case:
    return Case(**{**PAIR, **overrides}, inclination_rad=atan(1 / 40), lateral_shift_mm=shift_mm, roll="given")


def cases(quick: bool = False) -> list[Case]:
    """Cases with exact profiles, by finite elements.

    Their uncertainty has no contribution of the profile.
    """
    shifts = (4.0,) if quick else SHIFTS_MM
    return [_case(shift, refine="never") for shift in shifts]


def covered(errors: list[Error]) -> float:
    """Share of the errors inside the stated uncertainty, over all measures."""
    inside = [abs(e) <= s for error in errors for e, s in zip(error.error, error.stated, strict=True)]
    return float(np.mean(inside))


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the largest error of each measure over the seeds, at each shift.

    The noise is 10 um every 0.2 mm.
    """
    errors = measured((0.01,), (0.2,), seeds=SEEDS if len(rows) > 1 else 3)
    check_list = []
    for shift in SHIFTS_MM:
        for k, name in enumerate(MEASURES):
            worst = max((error.error[k] for error in errors if error.shift_mm == shift), key=abs)
            check_list.append(
                Check(
                    quantity="Hertz on measured lines, {}, {}".format(*name.rsplit("_", 1)),
                    case=f"10 um every 0.2 mm, shift {shift:+g} mm, worst seed",
                    reference="Hertz on the exact lines",
                    kind="analytic",
                    value=1.0 + worst,
                    expected=1.0,
                    limit_percent=LIMIT_PERCENT,
                )
            )
    return check_list


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Errors and coverage, and the figure of the full size."""
    full = len(rows) > 1
    errors = measured() if full else measured((0.01,), (0.2,), seeds=3)
    lines = _table(errors)
    if full:
        without = measured((0.01,), (0.2,), nominal="none")
        draw(errors, without, out / "measured_profiles.png")
        lines += ["Without a nominal profile:", *_table(without)]
    return "\n".join(lines)


def _table(errors: list[Error]) -> list[str]:
    lines = ["noise um  every mm  shift mm   p0: rms, worst %    a: rms, worst %    b: rms, worst %   covered %"]
    for (noise, step, shift), group_errors in _grouped(errors).items():
        table = 100.0 * np.array([error.error for error in group_errors])
        cells = "".join(f"{np.sqrt(np.mean(c**2)):11.2f}{np.abs(c).max():8.2f}" for c in table.T)
        lines.append(f"{1e3 * noise:8g} {step:9g} {shift:+9g}{cells}{100 * covered(group_errors):12.0f}")
    lines.append(f"Inside the stated uncertainty: {100 * covered(errors):.1f} % of {3 * len(errors)} errors.")
    return lines


def _grouped(errors: list[Error]) -> dict[tuple[float, float, float], list[Error]]:
    grouped: dict[tuple[float, float, float], list[Error]] = {}
    for error in errors:
        grouped.setdefault((error.noise_mm, error.step_mm, error.shift_mm), []).append(error)
    return grouped


def draw(errors: list[Error], without: list[Error], path: Path) -> Path:
    """Draw the largest errors over the noise, and errors against their stated uncertainty."""
    figure = blank_figure(14.0, 5.6)
    left, right = figure.subplots(1, 2)
    for k, name in enumerate(("p0", "a", "b")):
        for step, style in zip(STEPS_MM, ("-", "--", ":"), strict=True):
            worst = [
                100.0
                * max(abs(error.error[k]) for error in errors if error.noise_mm == noise and error.step_mm == step)
                for noise in NOISES_MM
            ]
            line_style = {"color": SERIES_COLOURS[k], "marker": SERIES_MARKS[k], "label": f"{name}, every {step:g} mm"}
            left.plot([1e3 * noise for noise in NOISES_MM], worst, style, **line_style)
    left.axhline(LIMIT_PERCENT, color="0.5", lw=0.8)
    left.set(
        xlabel="noise of the points in um", ylabel="largest error of Hertz over shifts and seeds in %", ylim=(0, None)
    )
    add_legend_beside(left)
    of_nominal = (errors, "o", SERIES_COLOURS[2], "deviation\nfrom the nominal")
    for group, marker, colour, label in (of_nominal, (without, "x", SERIES_COLOURS[3], "no nominal\nprofile")):
        stated = 100.0 * np.array([error.stated[2] for error in group])
        deviations = 100.0 * np.abs([error.error[2] for error in group])
        style = {"color": colour, "ms": 4, "mfc": "none", "label": f"b, {label}"}
        right.plot(np.maximum(stated, 1e-3), np.maximum(deviations, 1e-4), marker, **style)
    right.plot([1e-2, 1e2], [1e-2, 1e2], color="0.5", lw=0.8)
    right.set(xlabel="stated uncertainty in %", ylabel="error of b in %")
    set_plain_log_scale(right)
    add_legend_beside(right)
    add_grid(left, right)
    return save_figure(figure, path)


def main() -> None:
    from fecontact.cli import run_script

    if "--figure" in sys.argv:
        where = Path(__file__).parent / "figures" / "measured_profiles.png"
        errors, without = measured(), measured((0.01,), (0.2,), nominal="none")
        print("\n".join(_table(errors)))
        print("without a nominal profile\n" + "\n".join(_table(without)))
        print(draw(errors, without, where))
        return
    run_script(__file__)


if __name__ == "__main__":
    main()
