"""Does Hertz hold on a switch tongue, whose head is planed so thin that it is far from a half-space?

Four machined tongue sections have heads 20 to 40 mm thick; the full 60E1 head has 72 mm. All have a crown of 300 mm
under a wheel cylinder of radius 460 mm, 50 kN: about half a wheel load, as where the wheel moves from the stock rail to
the tongue. The patch (8.6 mm wide) is completely on the crown arc, so that Hertz and the true gap on a half-space are
equal for all sections. Only the body differs, which is the last step of the ladder. A further case has the load 3 mm
off the middle of the thinnest head, towards its planed back.

The sections (`profiles/switch_tongue_*.toml`, written by `write_profiles`) are made up, but typical: 134 mm high as
tongue rails are, a head with vertical sides that is planed on its back down to 60 mm below the crown, below it a web of
44 mm and a foot that is cut off on the side of the stock rail. Bodies are cut at 110 mm below the crown and 60 mm to
each side, where they are held across: the bending of the whole tongue between its slide chairs is not included.

Reference: the solution of this package with the full head. Expected: with slenderness the approach grows by tens of per
cent and the pressure hardly changes, because bending and compressing the head move the patch and do not change its gap.
The verdict answers whether Hertz still holds.
"""

import json
from dataclasses import dataclass
from itertools import pairwise
from math import asin, sqrt
from pathlib import Path
from typing import Any

from fecontact.case import BodySize, Case, Track
from fecontact.judging.ladder import BODIES_STEP
from fecontact.outputs.style import SERIES_COLOURS, add_grid, blank_figure, save_figure
from fecontact.regression.checks import Check, compare_discretisation, compare_with_hertz

CROWN_MM, GAUGE_CORNER_MM, BACK_CORNER_MM = 300.0, 5.0, 2.0
THICKNESS_MM = (20, 25, 30, 40)
WEB_MM, HEIGHT_MM, PLANED_MM, SIDE_MM = 44.0, 134.0, 60.0, 20.0
FULL_HEAD, FULL_HEAD_MM = "60E1", 72
OFF_CENTRE_MM = 3.0
# Finite elements on the full head against Hertz: a block of 110 mm instead of a half-space.
FULL_HEAD_PERCENT = 0.5
# Hertz's gap on the half-space, with 32 nodes per semi-axis: 0.01 % is reached.
DISCRETISATION_PERCENT = 0.05
PROFILES = Path(__file__).parent / "profiles"


def profile_path(thickness_mm: int) -> str:
    return str(PROFILES / f"switch_tongue_{thickness_mm}.toml")


def cases(quick: bool = False) -> list[Case]:
    """Full head, all tongues, and an eccentric load; or the first two heads."""
    if quick:
        return [_case(rail, refine="never") for rail in (FULL_HEAD, profile_path(20))]
    tongues = [_case(profile_path(thickness)) for thickness in THICKNESS_MM]
    tilt = round(asin(OFF_CENTRE_MM / CROWN_MM), 9)
    off = _case(profile_path(THICKNESS_MM[0]), inclination_rad=tilt, lateral_shift_mm=OFF_CENTRE_MM)
    return [_case(FULL_HEAD), *tongues, off]


def _case(rail: str, **overrides: Any) -> Case:
    inputs: dict[str, Any] = {"inclination_rad": 0.0, **overrides}
    return Case(
        rail=rail,
        wheel="cylinder:460",
        load_N=50e3,
        # a tongue's gauge face ends above the gauge plane: its crown under the tape circle
        track=Track(rail_crown_y_mm=Track().tape_circle_y_mm),
        size=BodySize(rail_depth_mm=110.0),
        # coarser elements are large compared with a thin head: their compliance cannot be checked, and with an
        # eccentric load they fold
        resolution="standard",
        **inputs,
    )


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Step from the half-space to the bodies for each head, compared with the full head."""
    heads = [_head(row, out) for row in rows]
    _figure(heads, out / "switch_rail.png")
    full = heads[0]
    lines = ["thickness  touch     peak    half-space to bodies, %         approach against   largest von Mises"]
    lines += [
        "       mm     mm      MPa     peak     area  approach         the full head     MPa     mm deep   verdict"
    ]
    for head in heads:
        row = head.row
        lines.append(
            f"{head.thickness_mm:9d} {row['contact_rail_y_mm']:+6.1f} {row['fe_p_max_MPa']:8.1f}"
            f" {head.step['p_max_MPa']:+8.2f} {head.step['area_mm2']:+8.2f} {head.step['approach_mm']:+9.1f}"
            f" {100.0 * (row['fe_approach_mm'] / full.row['fe_approach_mm'] - 1.0):+15.1f} %"
            f" {row['von_mises_rail_von_mises_MPa']:12.1f} {row['von_mises_rail_depth_mm']:8.2f}"
            f"       {row['verdict_answer']}{', ' + row['verdict_cause'] if row['verdict_cause'] else ''}"
        )
    worst = max(heads[1:], key=lambda head: abs(head.step["p_max_MPa"]))
    softest = max(heads[1:], key=lambda head: head.step["approach_mm"])
    lines.append(
        f"The bodies change the peak pressure by at most {abs(worst.step['p_max_MPa']):.2f} % (head of"
        f" {worst.thickness_mm} mm), the approach by up to {softest.step['approach_mm']:.0f} %"
        f" ({softest.thickness_mm} mm);"
        f" with the full head by {abs(full.step['p_max_MPa']):.2f} % and {full.step['approach_mm']:.0f} %. Hertz"
        f" {_verdicts(heads)}."
    )
    return "\n".join(lines)


@dataclass(frozen=True, kw_only=True)
class _Head:
    """Row with the thickness of its head (mm) and its bodies step (%)."""

    row: dict[str, Any]
    thickness_mm: int
    step: dict[str, float]


def _head(row: dict[str, Any], out: Path) -> _Head:
    # a profile from a file is recorded as its name and a hash of its content
    rail = Path(str(row["rail"]).partition("@")[0]).stem
    result = json.loads((out / "cases" / row["id"] / "result.json").read_text("utf-8"))
    step = result["steps"][BODIES_STEP.name]
    return _Head(
        row=row,
        thickness_mm=FULL_HEAD_MM if rail == FULL_HEAD else int(rail.rpartition("_")[2]),
        step={name: 100.0 * float(value) for name, value in step.items()},
    )


def _verdicts(heads: list[_Head]) -> str:
    counts = {v: sum(h.row["verdict_answer"] == v for h in heads) for v in ("HOLDS", "FAILS", "UNRESOLVED")}
    return ", ".join(f"{verdict} on {count} of {len(heads)}" for verdict, count in counts.items() if count)


def _figure(heads: list[_Head], path: Path) -> None:
    """Draw the last ladder step over the thickness of the head.

    Open marks: eccentric load.
    """
    figure = blank_figure(10.0, 4.6)
    for ax, name, title in zip(
        figure.subplots(1, 2), ("p_max_MPa", "approach_mm"), ("peak pressure", "approach"), strict=True
    ):
        for centred, style, colour in ((True, "o-", SERIES_COLOURS[0]), (False, "s", SERIES_COLOURS[1])):
            points = sorted(
                (h.thickness_mm, h.step[name]) for h in heads if (abs(h.row["contact_rail_y_mm"]) < 1e-6) == centred
            )
            label = "load in the middle" if centred else "load towards the planed back"
            line_style = {"color": colour, "mfc": colour if centred else "white", "label": label}
            ax.plot([t for t, _ in points], [s for _, s in points], style, **line_style)
        ax.axhline(0.0, color="0.5", lw=0.8)
        ax.set(xlabel="thickness of the head in mm", ylabel=f"half-space to bodies: {title} changes by %")
        add_grid(ax)
    ax.legend(fontsize=9)
    save_figure(figure, path)


def profile_toml(thickness_mm: int) -> str:
    """A tongue section of a given head thickness as a profile file."""
    half = 0.5 * thickness_mm
    (gauge_joint, gauge_centre), (back_joint, back_centre) = (
        _corner(half, GAUGE_CORNER_MM, -1.0),
        _corner(half, BACK_CORNER_MM, 1.0),
    )
    side, planed, web = -SIDE_MM, -PLANED_MM, WEB_MM - half
    surface = [
        _line_segment((-half, side), (-half, gauge_centre[1])),
        _arc_segment((-half, gauge_centre[1]), gauge_joint, gauge_centre, GAUGE_CORNER_MM),
        _arc_segment(gauge_joint, back_joint, (0.0, -CROWN_MM), CROWN_MM),
        _arc_segment(back_joint, (half, back_centre[1]), back_centre, BACK_CORNER_MM),
        _line_segment((half, back_centre[1]), (half, side)),
    ]
    foot = -half - 60.0
    # down the planed back, out to the web, round the foot, and up the gauge face
    corners = [
        *((half, side), (half, planed), (web, planed - WEB_MM + thickness_mm), (web, -114.0), (web + 10.0, -122.0)),
        *((web + 10.0, -HEIGHT_MM), (foot, -HEIGHT_MM), (foot, -122.0), (-half, -114.0), (-half, side)),
    ]
    body = [_line_segment(start, end) for start, end in pairwise(corners)]
    head = f"""\
# Machined tongue of a switch, head {thickness_mm} mm thick: made up but typical, see studies/08_switch_rail.py.
#
# Axes: y across the rail, 0 in the middle of the head, negative to its running edge, positive to its planed back (to
# the stock rail); z up, 0 at the crown. All lengths in mm.
kind = "rail"
units = "mm"
source = "made up: crown 300, corners 5 (running edge) and 2 (back), planed {PLANED_MM:g} deep, web {WEB_MM:g}"
notes = ["rail switch_tongue_{thickness_mm}: a made-up section"]
"""
    parts = [head, *(f"[[surface]]\n{s}" for s in surface), *(f"[[body]]\n{b}" for b in body)]
    return "\n".join(parts)


Point = tuple[float, float]


def _corner(half: float, radius: float, side: float) -> tuple[Point, Point]:
    """Joint with the crown arc and centre of a corner arc that touches it and the vertical side."""
    inner = CROWN_MM - radius
    y = half - radius
    z = sqrt(inner**2 - y**2)
    joint = (side * y * CROWN_MM / inner, z * CROWN_MM / inner - CROWN_MM)
    return joint, (side * y, z - CROWN_MM)


def _line_segment(start: Point, end: Point) -> str:
    return f'type = "line"\nfrom = {_point(start)}\nto = {_point(end)}\n'


def _arc_segment(start: Point, end: Point, centre: Point, radius: float) -> str:
    ends = f"from = {_point(start)}\nto = {_point(end)}"
    return f'type = "arc"\n{ends}\ncentre = {_point(centre)}\nradius = {radius}\n'


def _point(point: Point) -> str:
    # nanometres; adding zero takes the sign off a negative zero
    return f"[{round(point[0], 6) + 0.0}, {round(point[1], 6) + 0.0}]"


def write_profiles() -> None:
    """Write the sections' files."""
    PROFILES.mkdir(exist_ok=True)
    for thickness in THICKNESS_MM:
        (PROFILES / f"switch_tongue_{thickness}.toml").write_text(profile_toml(thickness), "utf-8")


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the peak pressure on the full head.

    The crown arc of this head is wider than the patch.
    """
    peak_checks = [
        compare_with_hertz(
            row, "p_max_MPa", f"{row['rail']}, {row['load_kN']:g} kN, {row['resolution']}", FULL_HEAD_PERCENT
        )
        for row in rows
        if row["rail"] == FULL_HEAD
    ]
    return [*peak_checks, *compare_discretisation(rows, DISCRETISATION_PERCENT)]


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
