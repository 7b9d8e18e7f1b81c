"""Does Hertz hold on a crane rail, whose head is nearly flat, and how close to its corner?

DIN 536 heads A100 and A120 (crown 500 and 600 mm, corners 10 mm) under a cylindrical wheel of radius 400 mm (800 mm in
diameter, a preferred number, and a usual size for such loads), 100 and 250 kN. The rail is tilted about its axis, as
after imprecise laying or bending, and the wheel is placed over the contact point. The contact point thus moves from the
centre towards the corner, until the joint of crown and corner arc is at half of Hertz's semi-axis. The tilt for this
(up to 80 mrad) is far above the tilt of a crane runway; the result depends on the remaining distance.

Reference: Hertz's ellipse with the crown's curvature (analytic). The verdict of this package, by all measures, answers
whether it holds there. Expected, after the claim of Yan and Fischer (2000, who also had a crane rail): Hertz holds
while the patch stays on the crown arc, and fails as soon as the patch reaches over the joint. For comparison, the
pressure of a line contact over the width without the corners, which is the usual approximation of a flat head.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import groupby
from math import asin, inf, pi, sin, sqrt
from pathlib import Path
from typing import Any

from fecontact.bodies import STEEL, combine_moduli_MPa
from fecontact.case import BodySize, Case, Track
from fecontact.outputs.style import SERIES_COLOURS, SERIES_MARKS, add_grid, blank_figure, save_figure
from fecontact.regression.checks import Check, compare_discretisation, compare_with_hertz
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case

WHEEL_RADIUS_MM = 400.0
LOADED = (("A100", 100e3), ("A100", 250e3), ("A120", 250e3))
NEAR_THE_JOINT_MM = (1.4, 0.4)
# Distance from the contact point to the joint over Hertz's semi-axis across; infinite: the centre of the head.
DISTANCES = (inf, 1.5, 1.0, 0.75, 0.5)

# Centre of the head: the deviation is due to the head, which is not a half-space.
CENTRE_PERCENT = 0.7
# Hertz's gap on the half-space, with 32 nodes per semi-axis: 0.01 % is reached.
DISCRETISATION_PERCENT = 0.05


@dataclass(frozen=True, kw_only=True)
class Head:
    """Dimensions (mm) of a rail of DIN 536-1."""

    width_mm: float
    height_mm: float
    corner_mm: float
    crown_mm: float

    @property
    def joint_mm(self) -> float:
        """Arc length from the centre to the joint of crown and corner arc.

        Both arcs are tangent at the joint, on their common normal.
        """
        return self.crown_mm * asin((0.5 * self.width_mm - self.corner_mm) / (self.crown_mm - self.corner_mm))


HEADS = {
    "A100": Head(width_mm=100.0, height_mm=95.0, corner_mm=10.0, crown_mm=500.0),
    "A120": Head(width_mm=120.0, height_mm=105.0, corner_mm=10.0, crown_mm=600.0),
}


def cases(quick: bool = False) -> list[Case]:
    """Heads under 250 kN and A100 under 100 kN, at all distances.

    At `quick`: A100 with 250 kN at two distances, unrefined. While the joint is outside Hertz's ellipse, the resolution
    is `quick`, refined if the verdict is unresolved. Nearer to the joint the narrow lobe on the corner would decide the
    element size of the whole patch (a million unknowns at 0.75 b). There, given element sizes are used, with two or
    three elements on the semi-axis of that lobe, and finer elements if these are rejected. The pressure of the lobe has
    32 nodes.
    """
    if quick:
        base = replace(_centred("A100", 250e3), refine="never")
        return [_move_contact_point(base, distance) for distance in (inf, 0.5)]
    return [_move_contact_point(_centred(rail, load), distance) for rail, load in LOADED for distance in DISTANCES]


def _centred(rail: str, load_N: float) -> Case:
    track = Track()
    return Case(
        rail=rail,
        wheel=f"cylinder:{WHEEL_RADIUS_MM:g}",
        inclination_rad=0.0,
        load_N=load_N,
        # a crane rail has no gauge face: its crown under the middle of the wheel, its foot on the runway
        track=replace(track, rail_crown_y_mm=track.tape_circle_y_mm),
        size=BodySize(rail_depth_mm=HEADS[rail].height_mm),
    )


def _move_contact_point(case: Case, distance: float) -> Case:
    """Case with a tilted rail and the wheel above the contact point.

    The tilt brings the joint to a distance of `distance` semi-axes.
    """
    if distance == inf:
        return case
    head = HEADS[case.rail]
    semi_axis = 0.5 * compute_hertz(case, place_case(case)).extent_y_mm
    # ids hash inputs: no digits that differ between machines
    tilt = round((head.joint_mm - distance * semi_axis) / head.crown_mm, 9)
    moved_case = replace(case, inclination_rad=tilt, lateral_shift_mm=round(head.crown_mm * sin(tilt), 6))
    return moved_case if distance > 1.0 else replace(moved_case, resolution=NEAR_THE_JOINT_MM)


def distance_mm(row: dict[str, Any]) -> float:
    """Arc length from the contact point to the next joint."""
    head = HEADS[row["rail"]]
    return head.joint_mm - head.crown_mm * asin(abs(float(row["contact_rail_y_mm"])) / head.crown_mm)


def distance_over_b(row: dict[str, Any]) -> float:
    """Arc length to the next joint, divided by Hertz's lateral semi-axis."""
    return distance_mm(row) / float(row["hertz_b_mm"])


def line_contact_MPa(row: dict[str, Any]) -> float:
    """Peak pressure of a wheel on a flat head without its corners (Johnson 1985, eq. 4.45)."""
    head = HEADS[row["rail"]]
    load_per_mm = 1e3 * float(row["load_kN"]) / (head.width_mm - 2.0 * head.corner_mm)
    return sqrt(load_per_mm * combine_moduli_MPa(STEEL, STEEL) / (pi * WHEEL_RADIUS_MM))


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Width of the patch, Hertz's deviations by position, and the distance of its failure."""
    groups = [(key, list(group)) for key, group in groupby(rows, lambda row: (row["rail"], row["load_kN"]))]
    _figure(groups, out / "crane_rail.png")
    lines = []
    for (rail, load), group in groups:
        first = group[0]
        width = 2.0 * float(first["hertz_b_mm"])
        lines.append(
            f"{rail}, {load:g} kN: Hertz's patch is {width:.1f} mm wide, {100 * width / HEADS[rail].width_mm:.0f} % of"
            f" the head; peak {first['hertz_p_max_MPa']:.0f} MPa; a line contact would have"
            f" {line_contact_MPa(first):.0f} MPa"
        )
        for row in group:
            cause = f", {row['verdict_cause']}" if row["verdict_cause"] else ""
            lines.append(
                f"  joint at {distance_mm(row):6.2f} mm = {distance_over_b(row):5.2f} b:"
                f" peak FE {row['fe_p_max_MPa']:7.1f} MPa,"
                f" Hertz {row['hertz_deviation_p_max_percent']:+6.1f} % in peak,"
                f" {row['hertz_deviation_area_percent']:+6.1f} % in area: {row['verdict_answer']}{cause}"
            )
    return "\n".join([*lines, _limit(rows)])


def _limit(rows: Iterable[dict[str, Any]]) -> str:
    distances = {
        verdict: [distance_over_b(r) for r in rows if r["verdict_answer"] == verdict] for verdict in ("HOLDS", "FAILS")
    }
    holds = f"holds down to {min(distances['HOLDS']):.2f} b" if distances["HOLDS"] else "holds nowhere"
    fails = f"fails from {max(distances['FAILS']):.2f} b on" if distances["FAILS"] else "fails nowhere"
    mixed = bool(distances["HOLDS"] and distances["FAILS"]) and min(distances["HOLDS"]) < max(distances["FAILS"])
    return f"Hertz {holds} from the joint and {fails}{' (elsewhere)' if mixed else ''}."


def _figure(groups: list[tuple[tuple[str, float], list[dict[str, Any]]]], path: Path) -> None:
    """Draw the deviation of Hertz over the distance to the joint, in semi-axes.

    The centre of the head is left out.
    """
    figure = blank_figure(10.0, 4.6)
    panels = dict(zip(("p_max", "area"), figure.subplots(1, 2), strict=True))
    for (name, ax), (title, limit) in zip(panels.items(), (("peak pressure", 5.0), ("area", 10.0)), strict=True):
        ax.axhspan(-limit, limit, color="0.9", zorder=0)
        for number, ((rail, load), group) in enumerate(groups):
            style = {
                "color": SERIES_COLOURS[number % len(SERIES_COLOURS)],
                "marker": SERIES_MARKS[number % len(SERIES_MARKS)],
            }
            near = [row for row in group if distance_over_b(row) < 2.0]
            x, y = [distance_over_b(r) for r in near], [r[f"hertz_deviation_{name}_percent"] for r in near]
            ax.plot(x, y, ms=5, label=f"{rail}, {load:g} kN", **style)
        ax.axvline(1.0, color="0.4", lw=0.8, ls=":")
        ax.set(xlabel="distance to the corner arc / Hertz's semi-axis b", ylabel=f"Hertz against FE, {title}, in %")
        add_grid(ax)
    panels["p_max"].legend(fontsize=9)
    save_figure(figure, path)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the peak pressure at the centre of the head.

    Only the crown arc is below the patch there.
    """
    centre_checks = [
        compare_with_hertz(
            row, "p_max_MPa", f"{row['rail']}, {row['load_kN']:g} kN, centre of the head", CENTRE_PERCENT
        )
        for row in rows
        if distance_over_b(row) > 2.0
    ]
    return [*centre_checks, *compare_discretisation(rows, DISCRETISATION_PERCENT)]


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
