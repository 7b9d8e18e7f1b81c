"""How far from a curvature junction must the contact point be for Hertz to hold?

A wheel that is flat across (radius 460 mm) on two tangent arcs, R 300 / R 80 and R 80 / R 13 as on the head of 60E1;
the contact point lies up to 8 mm from their junction on either side; 20 and 100 kN. No other effect violates Hertz's
assumptions: no change of curvature in the wheel, no second patch on a different part of the head.

Reference: the finite elements of this package, whose deviation from Hertz far from the junction is the check (there
it must vanish up to the finite bodies). Expected: the error depends on the distance over Hertz's semi-axis, and on
the ratio of the radii; on the flatter arc the patch feels the junction where its ellipse reaches it, on the tighter
arc later.

Found: the results of both loads are on a single curve. Over both pairs and loads, the limit is 0.52 to 0.72 b on the
flatter arc, and 0.44 to 0.56 b on the tighter arc. Nearer to the junction, b is the first measure beyond its limit, and
the peak follows later.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.regression.checks import Check, compare_discretisation, compare_with_hertz

PAIRS = ((300, 80), (80, 13))
DISTANCES_MM = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0)
LOADS_KN = (20.0, 100.0)
# Hertz's gap on the half-space, with 32 nodes per semi-axis: 0.01 % is reached.
DISCRETISATION_PERCENT = 0.05
# Far from the junction: the bodies are not half-spaces.
FAR_PERCENT = 0.7
PEAK_LIMIT_PERCENT = 5.0


def cases(quick: bool = False) -> list[Case]:
    """Cases of both pairs, sides and loads; or three distances on a flatter arc."""
    if quick:
        return [_case((300, 80), distance, 100.0) for distance in (8.0, 2.0, 0.0)]
    signed_distances = [*(-distance for distance in reversed(DISTANCES_MM)), 0.0, *DISTANCES_MM]
    return [_case(pair, distance, load) for pair in PAIRS for load in LOADS_KN for distance in signed_distances]


def _case(pair: tuple[int, int], distance_mm: float, load_kN: float) -> Case:
    return Case(
        rail=f"arcs:{pair[0]}/{pair[1]}@{distance_mm:g}",
        wheel="cylinder:460",
        inclination_rad=0.0,
        load_N=1e3 * load_kN,
        # the study needs the curve, not each verdict
        refine="never",
    )


def distance_mm(row: dict[str, Any]) -> float:
    """Distance of the contact point of a row from the junction, positive on the flatter arc."""
    return float(str(row["rail"]).partition("@")[2])


Series = dict[tuple[str, float, str], tuple[np.ndarray, ...]]


def series(rows: list[dict[str, Any]]) -> Series:
    """Curves over the distance from the junction, by pair, load and arc.

    Each curve is the distance over Hertz's semi-axis, then the columns of `_numbers`.
    """
    curves = {}
    for pair, load in dict.fromkeys((str(row["rail"]).partition("@")[0], float(row["load_kN"])) for row in rows):
        for arc, sign in (("flatter", 1.0), ("tighter", -1.0)):
            # at the junction itself Hertz's ellipse is not defined for either arc
            points = sorted(
                (sign * distance_mm(row) / float(row["hertz_b_mm"]), *_numbers(row))
                for row in rows
                if str(row["rail"]).startswith(f"{pair}@")
                and float(row["load_kN"]) == load
                and sign * distance_mm(row) > 0.0
            )
            if points:
                curves[pair, load, arc] = tuple(np.array(column) for column in zip(*points, strict=True))
    return curves


def _numbers(row: dict[str, Any]) -> tuple[float, ...]:
    """Deviation of the peak and its uncertainty in %, and the largest limit utilisation."""
    return tuple(
        float(row[name])
        for name in ("hertz_deviation_p_max_percent", "hertz_uncertainty_p_max_percent", "verdict_limit_utilisation")
    )


def reach(distance: np.ndarray, deviation: np.ndarray, limit: float) -> float:
    """Distance over the semi-axis beyond which a deviation stays within its limit.

    The deviation is interpolated linearly between the points. 0 if it is within the limit everywhere, infinite if it is
    not at the farthest point.
    """
    outside = np.flatnonzero(np.abs(deviation) > limit)
    if outside.size == 0:
        return 0.0
    last = int(outside[-1])
    if last == distance.size - 1:
        return float("inf")
    last_outside, first_inside = np.abs(deviation[last : last + 2])
    return float(np.interp(limit, [first_inside, last_outside], [distance[last + 1], distance[last]]))


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Rule of thumb for either arc with its scatter over radii and loads.

    Draws the figure junctions.png.
    """
    curves = series(rows)
    figure(curves, out / "junctions.png")
    lines = [
        "pair         load kN  touch on  peak within 5 %      all measures  largest error of the peak  at the far end"
    ]
    reached: dict[str, list[float]] = {}
    for (pair, load, arc), (distance, peak, _, limit_utilisation) in curves.items():
        limits = (reach(distance, peak, PEAK_LIMIT_PERCENT), reach(distance, limit_utilisation, 1.0))
        reached.setdefault(arc, []).append(limits[1])
        texts = (f"beyond {limit:.2f} b" if np.isfinite(limit) else "nowhere" for limit in limits)
        worst = peak[np.argmax(np.abs(peak))]
        lines.append(
            f"{pair:12} {load:7g}  {arc:8} {' '.join(f'{t:>16}' for t in texts)} {worst:+24.1f} % {peak[-1]:+10.2f} %"
        )
    for arc, limits in reached.items():
        if len(limits) > 1 and np.all(np.isfinite(limits)):
            lines.append(
                f"Rule of thumb, contact point on the {arc} arc: Hertz holds, by all measures, where the junction is"
                f" farther than {np.mean(limits):.2f} b ({min(limits):.2f} to {max(limits):.2f} b over {len(limits)}"
                " pairs and loads)."
            )
    decided = [row for row in rows if row["verdict_answer"] == "FAILS"]
    count = Counter(str(row["verdict_measure"]) for row in decided)
    lines.append("What decides where it fails: " + ", ".join(f"{name} {n}" for name, n in count.most_common()) + ".")
    return "\n".join(lines)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the peak pressure far from the junction, and of the lowest rung.

    Farther than two semi-axes from the junction Hertz is exact except for the bodies. The lowest rung of the ladder is
    exact everywhere.
    """
    far = [
        replace(
            compare_with_hertz(
                row, "p_max_MPa", f"{row['rail']}, {row['load_kN']:g} kN, {row['resolution']}", FAR_PERCENT
            ),
            explanation="the bodies are finite, and Hertz's are half-spaces",
        )
        for row in rows
        if float(row["geometry_junction_distance_over_b"]) > 2.0
    ]
    return [*far, *compare_discretisation(rows, DISCRETISATION_PERCENT)]


def figure(curves: Series, path: Path) -> None:
    """Draw Hertz's error of the peak and the worst measure over the distance from the junction."""
    from fecontact.outputs.style import (
        SERIES_COLOURS,
        SERIES_MARKS,
        add_grid,
        blank_figure,
        save_figure,
        set_plain_log_scale,
    )

    picture = blank_figure(8.0, 7.0)
    peak_axes, measure_axes = picture.subplots(2, 1, sharex=True)
    peak_axes.axhspan(-PEAK_LIMIT_PERCENT, PEAK_LIMIT_PERCENT, color="0.92")
    measure_axes.axhspan(0.0, 1.0, color="0.92")
    pairs, loads = (list(dict.fromkeys(key[k] for key in curves)) for k in (0, 1))
    for (pair, load, arc), (distance, peak, uncertainty, limit_utilisation) in curves.items():
        sign = 1.0 if arc == "flatter" else -1.0
        style = {
            "color": SERIES_COLOURS[pairs.index(pair) % len(SERIES_COLOURS)],
            "marker": SERIES_MARKS[loads.index(load) % len(SERIES_MARKS)],
            "mfc": "white" if loads.index(load) % 2 else None,
            "ls": ("-", "--")[loads.index(load) % 2],
            "ms": 4,
            "lw": 1,
        }
        label = f"R {pair.removeprefix('arcs:').replace('/', ' / R ')}, {load:g} kN" if arc == "flatter" else None
        peak_axes.errorbar(sign * distance, peak, uncertainty, label=label, **style)
        measure_axes.plot(sign * distance, limit_utilisation, **style)
    for axes in (peak_axes, measure_axes):
        axes.axvline(0.0, color="0.4", lw=0.8)
    add_grid(peak_axes, measure_axes)
    measure_axes.set_xlim(-4.0, 4.0)
    set_plain_log_scale(measure_axes, "y")
    measure_axes.set_xlabel(
        "distance of the contact point from the junction / Hertz's semi-axis b  (left: on the tighter arc)"
    )
    peak_axes.set_ylabel("peak pressure, (Hertz - FE) / FE, in %")
    measure_axes.set_ylabel("worst measure / its limit")
    peak_axes.legend(fontsize=9)
    save_figure(picture, path)


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
