"""Contact points and wheelset geometry over the lateral shift: records, terminal and picture."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.case import Case, make_case_record
from fecontact.contact_theories.touch_hertz import sides
from fecontact.outputs.flat_records import Record, flatten, select_attributes, to_plain
from fecontact.outputs.pair_names import inclination_words, short_name
from fecontact.outputs.style import SERIES_COLOURS, add_grid, blank_figure, save_figure
from fecontact.outputs.tables import Table, TableRecord, make_table, number_column, radius_column, text_column
from fecontact.outputs.terminal import OutputLines, note_lines
from fecontact.placement.poses import ContactPoint, RelativeCurvature
from fecontact.placement.wheel_on_rail import Placement
from fecontact.placement.wheelset import ContactFunctions, PlacedWheelset, rolling_radius_difference_mm
from fecontact.profiles.curve import invert_curvature_mm
from fecontact.profiles.library import profile_identity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_RADII = ("rail", "wheel_lateral", "wheel_rolling")
# the last two inputs are included only if they are given
_INPUT_NAMES = (
    *("rail", "wheel", "inclination_rad", "yaw_rad", "rolling_radius_mm", "track", "opposite", "flange_climb"),
    *("rail_file", "wheel_file"),
)


def contact_point_records(placement: Placement) -> Record:
    """Record of the rigid contact: angle at first touch, and all contact points.

    Parameters
    ----------
    placement
        Placement of wheel and rail.

    Returns
    -------
    Record
        Contact angle in rad, and a record for each contact point.
    """
    return {
        "contact_angle_rad": placement.first.contact_angle_rad,
        "contact_points": [contact_point_record(touch) for touch in placement.contact_points],
    }


def contact_point_record(touch: ContactPoint) -> Record:
    """Record of a contact point with its curvatures.

    Parameters
    ----------
    touch
        Contact point.

    Returns
    -------
    Record
        Place (mm), contact angle (rad), gap (mm), and one entry of curvatures, or two entries (gauge side, field side)
        at a junction.
    """
    return {
        **select_attributes(touch, "x_mm y_mm z_mm rail_y_mm wheel_y_mm contact_angle_rad vertical_gap_mm at_junction"),
        "curvatures": [
            {"side": side, **to_plain(curvature), **_radii(curvature)}
            for side, curvature in zip(sides(touch), touch.curvatures, strict=True)
        ],
    }


def touch_columns(placement: Placement, touch: ContactPoint) -> Record:
    """Columns of a contact point.

    Parameters
    ----------
    placement
        Placement with the contact point.
    touch
        Contact point.

    Returns
    -------
    Record
        Place, contact angle, gap, rolling radius and radii of curvature; lengths in mm, angle in rad. At a junction the
        radii belong to one side.
    """
    return {
        **select_attributes(touch, "rail_y_mm wheel_y_mm contact_angle_rad vertical_gap_mm"),
        "rolling_radius_mm": float(placement.wheel.radius(touch.wheel_u)),
        "at_junction": touch.at_junction,
        **_radii(touch.curvature),
    }


def _radii(curvature: RelativeCurvature) -> Record:
    return {f"{name}_radius_mm": invert_curvature_mm(getattr(curvature, f"{name}_per_mm")) for name in _RADII}


def contact_functions_record(case: Case, contact_functions: ContactFunctions) -> Record:
    """Record of the contact functions of a wheelset.

    Parameters
    ----------
    case
        Case with the pair.
    contact_functions
        Contact functions over the lateral shift.

    Returns
    -------
    Record
        Content of the JSON output, with units in its keys. Radii are positive if convex, None if straight.
    """
    inputs = make_case_record(
        case.with_profiles({body: profile_identity(spec) for body, spec in case.profiles.items()})
    )
    return {
        "schema": "fecontact/geometry/2",
        "case": {name: inputs[name] for name in _INPUT_NAMES if name in inputs},
        **select_attributes(contact_functions, "symmetric jumps"),
        "positions": [
            _position_record(shift, wheelset, contact_functions.centred_height_mm)
            for shift, wheelset in contact_functions.positions.items()
        ],
        "equal_radii_shift_mm": {
            name: math.nan if conicity_function is None else conicity_function.equal_radii_mm
            for name, conicity_function in (
                ("rolled", contact_functions.rolled),
                ("unrolled", contact_functions.unrolled),
            )
        },
        "equivalent_conicity": to_plain(contact_functions.conicities),
        "warnings": _placement_notes(contact_functions),
    }


def _placement_notes(contact_functions: ContactFunctions) -> list[str]:
    wheelset = next(position for position in contact_functions.positions.values() if not isinstance(position, str))
    return list(dict.fromkeys((*wheelset.left.notes, *wheelset.right.notes)))


def _position_record(shift: float, wheelset: PlacedWheelset | str, centred_mm: float) -> Record:
    """Record of the wheelset at a shift, or of the problem that prevents a position."""
    if isinstance(wheelset, str):
        return {"lateral_shift_mm": shift, "problem": wheelset}
    return {
        "lateral_shift_mm": shift,
        "roll_mrad": 1e3 * wheelset.roll_rad,
        "axle_height_mm": wheelset.axle_height_mm,
        "lift_mm": wheelset.axle_height_mm - centred_mm,
        "rolling_radius_difference_mm": rolling_radius_difference_mm(wheelset),
        "left": _side_record(wheelset.left),
        "right": _side_record(wheelset.right),
    }


def contact_functions_rows(record: Record) -> list[Record]:
    """Flat rows of the positions of a record.

    Parameters
    ----------
    record
        Record of the contact functions.

    Returns
    -------
    list of Record
        Rows with numbered contact points, the left wheel first.
    """
    rows = []
    for position in record["positions"]:
        row = {name: value for name, value in position.items() if name not in ("left", "right")}
        for side in ("left", "right"):
            for index, touch in enumerate(position.get(side, {}).get("contact_points", ()), start=1):
                row |= flatten({f"{side}_touch{index}": touch})
        rows.append(row)
    return rows


def _side_record(placement: Placement) -> Record:
    """Record of the contact points of a wheel."""
    return {
        "contact_points": [
            {
                **select_attributes(touch, "rail_y_mm wheel_y_mm"),
                "ahead_mm": touch.x_mm - float(placement.wheel.point(touch.wheel_y_mm, 0.0, 0.0)[0]),
                **touch_columns(placement, touch),
            }
            for touch in placement.contact_points
        ],
    }


# --- The geometry of a wheelset over its lateral shift on the terminal.

_COLUMNS = (
    number_column("shift\nmm", "lateral_shift_mm", "{:+z.2f}"),
    number_column("roll\nmrad", "roll_mrad", "{:+z.4f}"),
    number_column("lift\nmm", "lift_mm", "{:+z.3f}", rank=2, name="lift"),
    number_column("r left -\nright mm", "rolling_radius_difference_mm", "{:+z.3f}"),
    number_column("y rail\nmm", "rail_y_mm", "{:+z.2f}"),
    number_column("y wheel\nmm", "wheel_y_mm", "{:+z.2f}", rank=4, name="y wheel"),
    number_column("angle\nmrad", "contact_angle_rad", "{:+z.2f}", 1e3),
    number_column("radius\nmm", "rolling_radius_mm", "{:.3f}", rank=3, name="rolling radius"),
    radius_column("R rail\nmm", "rail_radius_mm"),
    radius_column("R wheel\nacross mm", "wheel_lateral_radius_mm", rank=5, name="radius of the wheel across"),
    radius_column("R wheel\nrolling mm", "wheel_rolling_radius_mm", rank=1, name="radius of the wheel along the rail"),
    text_column("contact\npoints", lambda row: f"{row['points']}{' junction' * row['at_junction']}", "number"),
)


def contact_functions_lines(record: TableRecord) -> OutputLines:
    """Iterate over the outputs of a geometry record: tables, jumps, conicity and notes.

    There is a table of the left side, and of the right side if it is not the mirror image.

    Parameters
    ----------
    record
        Record of the contact functions.

    Returns
    -------
    iterator of Table and str
        Tables and lines in order.
    """
    mirrored = record["symmetric"] and record["case"]["yaw_rad"] == 0.0
    sides = ("left",) if mirrored else ("left", "right")
    for side in sides:
        yield _side_table(record, side)
    if mirrored:
        yield "The right wheel at a shift is the left wheel at the opposite shift."
    for jump in (jump for jump in record["jumps"] if jump["side"] in sides):
        yield (
            f"jump at a shift of {jump['shift_mm']:+z.3f} mm: the first contact point on the {jump['side']} rail moves"
            f" from y = {jump['from_rail_y_mm']:+z.2f} mm (smaller shifts) to {jump['to_rail_y_mm']:+z.2f} mm"
        )
    if record["equivalent_conicity"]:
        yield from _conicity_lines(record)
    for row in record.get("loaded_conicity", ()):
        yield (
            f"loaded with {row['wheel_load_N'] / 1e3:g} kN per wheel, amplitude {row['amplitude_mm']:g} mm: conicity"
            f" {row['overlap']:.3f} by overlapping strips, {row['half_space']:.3f} by the half-space"
        )
    yield from _list_impossible_shifts(record["positions"])
    yield from note_lines(record["warnings"])


def _list_impossible_shifts(rows: Sequence[TableRecord]) -> Iterator[str]:
    """Iterate over the reasons for shifts without a position.

    Adjacent shifts have a common line if their reasons differ only by numbers.
    """
    for reason, group in groupby(rows, key=lambda row: _NUMBER.sub("", row.get("problem", ""))):
        impossible = list(group)
        shifts_mm = [f"{row['lateral_shift_mm']:+z.2f}" for row in impossible]
        if reason and len(impossible) == 1:
            yield f"no position at {shifts_mm[0]} mm: {impossible[0]['problem']}"
        elif reason:
            yield (
                f"no position at {shifts_mm[0]} to {shifts_mm[-1]} mm ({len(impossible)} shifts); at the first:"
                f" {impossible[0]['problem']}"
            )


def _conicity_lines(record: TableRecord) -> OutputLines:
    """Iterate over the conicities by amplitude, of the kinematic motion and linearised.

    Both are about the shift with equal radii.
    """
    shift_mm = record["equal_radii_shift_mm"]["unrolled"]
    if math.isnan(shift_mm):
        yield "no equivalent conicity, because the rolling radii are not equal at any shift"
        return
    if shift_mm:
        yield f"without roll the rolling radii are equal at a shift of {shift_mm:+z.3f} mm"
    for method, prefix in (("EN 15302", ""), ("harmonic linearisation", "harmonic_")):
        values = ", ".join(
            f"{row['amplitude_mm']:g} mm {_conicity_text(row[f'{prefix}unrolled'])}"
            f" ({_conicity_text(row[f'{prefix}rolled'])})"
            for row in record["equivalent_conicity"]
        )
        yield f"equivalent conicity by amplitude, {method}, without roll (with roll in brackets): {values}"


def _conicity_text(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.3f}"


def _side_table(record: TableRecord, side: str) -> Table:
    """Table of a side of the wheelset at each shift, by its first contact point."""
    placed_rows = [(row, row[side]["contact_points"]) for row in record["positions"] if "problem" not in row]
    title = f"The {side} wheel on its rail; lengths in mm, convex radii are positive"
    return make_table(title, _COLUMNS, [{**row, **points[0], "points": len(points)} for row, points in placed_rows])


# --- The picture of a wheelset's geometry over its lateral shift.

_LEFT, _RIGHT, _UNROLLED = SERIES_COLOURS[:3]


def draw_contact_functions(case: Case, contact_functions: ContactFunctions, path: str | Path) -> Path:
    """Draw rolling-radius difference, contact points, contact angles and equivalent conicity.

    Parameters
    ----------
    case
        Case with the pair.
    contact_functions
        Contact functions over the lateral shift.
    path
        File of the picture.

    Returns
    -------
    Path
        The given path.
    """
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    wheelsets = [position for position in contact_functions.positions.values() if not isinstance(position, str)]
    shifts = np.array([wheelset.shift_mm for wheelset in wheelsets])
    difference = np.array([rolling_radius_difference_mm(wheelset) for wheelset in wheelsets])
    _draw_with_jumps(axes[0, 0], shifts, difference, [jump.shift_mm for jump in contact_functions.jumps], "black")
    axes[0, 0].set_ylabel("rolling radius, left - right, mm")
    for side, colour in (("left", _LEFT), ("right", _RIGHT)):
        first_touches = [wheelset.left.first if side == "left" else wheelset.right.first for wheelset in wheelsets]
        places_mm, angles = (
            np.array([getattr(touch, name) for touch in first_touches]) for name in ("rail_y_mm", "contact_angle_rad")
        )
        jumps = [jump.shift_mm for jump in contact_functions.jumps if jump.side == side]
        _draw_with_jumps(axes[0, 1], shifts, places_mm, jumps, colour).set_label(f"{side} rail")
        _draw_with_jumps(axes[1, 0], shifts, 1e3 * angles, jumps, colour).set_label(f"{side} wheel")
    axes[0, 1].set_ylabel("first contact point on the rail, mm\n(> 0: field side)")
    axes[1, 0].set_ylabel("contact angle, mrad")
    for ax in (axes[0, 0], axes[0, 1], axes[1, 0]):
        ax.set_xlabel("lateral shift of the wheelset, mm (> 0: to the left)")
    _draw_conicity(axes[1, 1], contact_functions)
    add_grid(*axes.flat)
    axes[0, 1].legend(fontsize=9)
    axes[1, 0].legend(fontsize=9)
    rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
    figure.suptitle(
        f"wheelset {wheel} on {rail}{inclination_words(case.inclination_rad)}, gauge {case.track.gauge_mm:g} mm,"
        f" back to back {case.track.back_to_back_mm:g} mm; dotted: jumps"
    )
    return save_figure(figure, Path(path))


def _draw_with_jumps(ax: Axes, x: np.ndarray, y: np.ndarray, jumps: Sequence[float], colour: str) -> Line2D:
    """Draw a curve with a break at each jump; returns its first section."""
    pieces = np.searchsorted(jumps, x)
    lines = [ax.plot(x[pieces == piece], y[pieces == piece], ".-", color=colour)[0] for piece in np.unique(pieces)]
    for jump in jumps:
        ax.axvline(jump, color=colour, linestyle=":", linewidth=0.8)
    return lines[0]


def _draw_conicity(ax: Axes, contact_functions: ContactFunctions) -> None:
    """Draw the equivalent conicity over the amplitude, with and without roll."""
    amplitudes = [conicity.amplitude_mm for conicity in contact_functions.conicities]
    for roll, label, line_style, colour in (
        ("unrolled", "without roll", "o-", _UNROLLED),
        ("rolled", "with roll", "s--", "black"),
    ):
        kinematic, harmonic = (
            [getattr(conicity, name) for conicity in contact_functions.conicities]
            for name in (roll, f"harmonic_{roll}")
        )
        ax.plot(amplitudes, kinematic, line_style, color=colour, label=label)
        ax.plot(amplitudes, harmonic, ":", color=colour, label=f"harmonic linearisation, {label}")
    ax.set(xlabel="amplitude, mm", ylabel="equivalent conicity, EN 15302")
    ax.set_ylim(bottom=0.0)
    ax.legend(fontsize=9)
