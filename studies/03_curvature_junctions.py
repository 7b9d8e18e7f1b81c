"""How far from a curvature junction must the touch point be for Hertz to hold?

A wheel that is flat across (radius 460 mm) on two tangent arcs, R 300 / R 80 and R 80 / R 13 as on the head of 60E1;
the touch point lies up to 8 mm from their junction on either side; 20 and 100 kN. Nothing else is there that Hertz does
not know: no change of curvature in the wheel, no second patch on another part of the head.

Reference: the finite elements of this package, whose deviation from Hertz far from the junction is the check (there it
must vanish up to the finite bodies). Expected: the error depends on the distance over Hertz's semi-axis, and on the
ratio of the radii; on the flatter arc the patch feels the junction where its ellipse reaches it, on the tighter arc
later.
"""

from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import Case

PAIRS = ((300, 80), (80, 13))
DISTANCES_MM = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
LOADS_KN = (20.0, 100.0)
LIMIT_PERCENT = 5.0


def cases(quick: bool = False) -> list[Case]:
    """Both pairs, sides and loads at `standard`; or three distances on the flatter arc of one pair, at `quick`."""
    if quick:
        return [_case((300, 80), distance, 100.0, "quick") for distance in (8.0, 2.0, 0.0)]
    both = sorted({sign * distance for sign in (-1.0, 1.0) for distance in DISTANCES_MM})
    return [_case(pair, distance, load, "standard") for pair in PAIRS for load in LOADS_KN for distance in both]


def _case(pair: tuple[int, int], distance_mm: float, load_kN: float, resolution: str) -> Case:
    return Case(
        rail=f"arcs:{pair[0]}/{pair[1]}@{distance_mm:g}",
        wheel="cylinder:460",
        inclination_rad=0.0,
        load_N=1e3 * load_kN,
        resolution=resolution,
        # the curve is wanted, not each verdict
        refine_degrees_of_freedom=0,
    )


def distance_mm(row: dict[str, Any]) -> float:
    """Distance of a row's touch point from the junction, positive on the flatter arc."""
    return float(str(row["rail"]).partition("@")[2])


Series = dict[tuple[str, float, str], tuple[np.ndarray, np.ndarray, np.ndarray]]


def series(rows: list[dict[str, Any]]) -> Series:
    """Distance over Hertz's semi-axis, deviation and uncertainty of the peak pressure (%), by pair, load and arc."""
    found = {}
    for pair, load in dict.fromkeys((str(row["rail"]).partition("@")[0], float(row["load_kN"])) for row in rows):
        for arc, sign in (("flat", 1.0), ("tight", -1.0)):
            # the junction itself has no ellipse of its own
            own = sorted(
                (sign * distance_mm(row) / float(row["b_hertz_mm"]), *_peak(row))
                for row in rows
                if str(row["rail"]).startswith(f"{pair}@")
                and float(row["load_kN"]) == load
                and sign * distance_mm(row) > 0.0
            )
            if own:
                found[pair, load, arc] = tuple(np.array(column) for column in zip(*own, strict=True))
    return found


def _peak(row: dict[str, Any]) -> tuple[float, float]:
    return float(row["p_max_deviation_percent"]), float(row["p_max_uncertainty_percent"])


def reach(distance: np.ndarray, deviation: np.ndarray) -> float:
    """Distance over the semi-axis beyond which the deviation stays within the limit; straight between the points."""
    outside = np.flatnonzero(np.abs(deviation) > LIMIT_PERCENT)
    if outside.size == 0:
        return float("nan")
    last = int(outside[-1])
    if last == distance.size - 1:
        return float("inf")
    here, there = np.abs(deviation[last : last + 2])
    return float(np.interp(LIMIT_PERCENT, [there, here], [distance[last + 1], distance[last]]))


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Rule of thumb for either arc with its scatter over radii and loads; figure junctions.png."""
    found = series(rows)
    figure(found, out / "junctions.png")
    lines = ["pair              load kN  arc    |error| of the peak within 5 % beyond   largest error   farthest point"]
    for (pair, load, arc), (distance, deviation, _) in found.items():
        limit = reach(distance, deviation)
        worst = deviation[np.argmax(np.abs(deviation))]
        said = f"{limit:6.2f} b" if np.isfinite(limit) else "everywhere" if np.isnan(limit) else "nowhere"
        lines.append(f"{pair:16} {load:8g}  {arc:5}  {said:>24} {worst:+25.1f} % {deviation[-1]:+14.2f} %")
    for arc in ("flat", "tight"):
        reached = [reach(d, p) for (_, _, a), (d, p, _) in found.items() if a == arc]
        reached = [r for r in reached if np.isfinite(r)]
        if len(reached) > 1:
            name = {"flat": "flatter", "tight": "tighter"}[arc]
            lines.append(
                f"Rule of thumb, touch point on the {name} arc: Hertz's peak pressure is within {LIMIT_PERCENT:g} %"
                f" where the junction is farther than {np.mean(reached):.2f} b (from {min(reached):.2f} to"
                f" {max(reached):.2f} over {len(reached)} pairs and loads)."
            )
    return "\n".join(lines)


def figure(found: Series, path: Path) -> None:
    """Error of Hertz's peak pressure over the distance from the junction."""
    from fecontact.outputs.figures import blank_figure, save_figure

    picture = blank_figure(8.0, 4.6)
    axes = picture.add_subplot()
    axes.axhspan(-LIMIT_PERCENT, LIMIT_PERCENT, color="0.92")
    axes.axvspan(-1.0, 1.0, color="0.96", zorder=0)
    for number, ((pair, load, arc), (distance, deviation, uncertainty)) in enumerate(found.items()):
        sign = 1.0 if arc == "flat" else -1.0
        colour = f"C{number // 2}"
        label = f"R {pair.removeprefix('arcs:').replace('/', ' / R ')}, {load:g} kN" if arc == "flat" else None
        axes.errorbar(sign * distance, deviation, uncertainty, color=colour, marker="o", ms=3, lw=1, label=label)
    axes.set_xlim(-4.0, 4.0)
    axes.set_xlabel("distance of the touch point from the junction / Hertz's semi-axis b  (left: on the tighter arc)")
    axes.set_ylabel("(Hertz - FE) / FE of the peak pressure, %")
    axes.legend(frameon=False, fontsize=8)
    save_figure(picture, path)


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
