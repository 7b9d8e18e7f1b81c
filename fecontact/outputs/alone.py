"""Records, rows and printed lines of theories alone and of contact tables."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.rolling.kalker import LinearCreep
from fecontact.judging.measures import read_hertz_measures, read_theory_measures
from fecontact.outputs.cases import cheapest_column
from fecontact.outputs.flat_records import Record, flatten, select_attributes
from fecontact.outputs.geometry import touch_columns
from fecontact.outputs.records.cheapest import cheapest_columns
from fecontact.outputs.table_jumps import describe_jumps
from fecontact.outputs.tables import TableRecord, make_table, number_column, text_column
from fecontact.outputs.terminal import OutputLines
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.alone import ContactTableRow
from fecontact.solving.placing import compute_roll

# --- Lines of a contact table as flat rows with units in their keys.

# measures that every contact has
SIZE_MEASURES = "p_max_MPa area_mm2 a_mm b_mm approach_mm"
_NUMBERED = re.compile(r"(patch|touch)(\d+)_")
INTERPOLATION_ERROR_COLUMNS = {
    "strip_approach_mm": "strip_approach_between_percent",
    "strip_stiffness_N_per_mm": "strip_stiffness_between_percent",
}
"""Columns of the error of linear interpolation halfway to the adjacent lines, by the interpolated column."""


def table_row(line: ContactTableRow) -> Record:
    """Flat row of a line of a contact table.

    Contact points come last, numbered from 1, the first touch first. The ellipse has the complete load at the first
    touch point. Its normal force grows with the approach as the power 1.5.

    Parameters
    ----------
    line
        Line of a contact table.

    Returns
    -------
    Record
        Row with all results of the line.
    """
    row: Record = {
        "lateral_shift_mm": line.case.lateral_shift_mm,
        # rounded, so that 7 mrad stay 7 mrad after their conversion to rad and back
        "yaw_mrad": round(1e3 * line.case.yaw_rad, 9),
        "load_kN": line.case.load_N / 1e3,
        "problem": line.problem,
    }
    if line.placement is None:
        return row
    hertz, strips, springs = line.hertz, line.strips, line.points
    row |= {
        "roll_mrad": 1e3 * compute_roll(line.case, line.placement),
        "contact_points": len(line.placement.contact_points),
        **cheapest_columns("cheapest_theory", line.cheapest),
    }
    if hertz is not None:
        row |= select_attributes(hertz, "normal_force_N", "hertz_") | select_attributes(
            read_hertz_measures(hertz), SIZE_MEASURES, "hertz_"
        )
        row["hertz_stiffness_N_per_mm"] = 1.5 * hertz.normal_force_N / hertz.approach_mm
        row |= _creep_columns(line.hertz_creep, "hertz_")
    if springs is not None:
        first_note = next(point.whole_note for point in reversed(springs.points) if point.contact_point_number == 0)
        row["hertz_notes"] = "; ".join(
            dict.fromkeys(filter(None, [first_note, *springs.shared_notes, line.creep_note]))
        )
    row["strip_status"] = "no contact" if strips is None else strips.status
    if strips is not None:
        row |= {
            "strip_patches": len(strips.patches),
            **select_attributes(strips, "normal_force_N", "strip_"),
            **select_attributes(read_theory_measures(strips), SIZE_MEASURES, "strip_"),
            "strip_centre_mm": strips.centre_mm[1],
            "strip_stiffness_N_per_mm": line.strip_stiffness_N_per_mm,
            **_strip_patch_columns(line.placement, strips),
        }
    if springs is not None:
        row |= {"springs_approach_mm": springs.shared_approach_mm, "springs_p_max_MPa": springs.shared_p_max_MPa}
    return row | contact_point_columns(
        line.placement,
        {touch_index: _spring_columns(line, touch_index) for touch_index in range(row["contact_points"])},
    )


def _strip_patch_columns(placement: Placement, strips: TheoryContact) -> Record:
    """Columns of each patch of the strips, the largest force first.

    They include the centre on both profiles and the angle of the rail there. All forces are along the normal at first
    touch.
    """
    columns: Record = {}
    for place, patch in enumerate(strips.patches, 1):
        rail_y, wheel_y, angle = placement.on_profiles(*patch.centre_mm)
        place_entries = {"rail_y_mm": rail_y, "wheel_y_mm": wheel_y, "contact_angle_rad": angle}
        columns |= flatten(
            {f"patch{place}": select_attributes(patch, "normal_force_N p_max_MPa a_mm b_mm") | place_entries}
        )
    return columns


def contact_point_columns(placement: Placement, springs: Mapping[int, Record]) -> Record:
    """Columns of all contact points, numbered from 1.

    Parameters
    ----------
    placement
        Placement with the contact points.
    springs
        Columns of the spring by index of the contact point, from 0.

    Returns
    -------
    Record
        Columns of all contact points, each with the columns of its spring.
    """
    contact_points = enumerate(placement.contact_points)
    return flatten(
        {
            f"touch{touch_index + 1}": touch_columns(placement, touch) | springs.get(touch_index, {})
            for touch_index, touch in contact_points
        }
    )


def _spring_columns(line: ContactTableRow, touch_index: int) -> Record:
    """Columns of the spring of a contact point and of its ellipse, with Kalker's coefficients.

    The ellipse has the force that this contact point takes as one of several springs.
    """
    springs = (
        [
            (point, creep)
            for point, creep in zip(line.points.points, line.spring_creep, strict=True)
            if point.contact_point_number == touch_index and point.side != "gauge"
        ]
        if line.points
        else []
    )
    if not springs or springs[0][0].whole is None:
        return {}
    spring, creep = springs[0]
    assert spring.whole is not None
    return {
        "spring_N_per_mm15": spring.whole.stiffness_N_per_mm15,
        **ellipse_columns(spring.shared),
        **_creep_columns(creep),
    }


def _creep_columns(creep: LinearCreep | None, prefix: str = "") -> Record:
    """Columns of Kalker's coefficients and of the factors of the linear creep force."""
    if creep is None:
        return {}
    return {
        **select_attributes(creep.coefficients, "c11 c22 c23 c33", f"{prefix}kalker_"),
        **select_attributes(creep, "f11_N f22_N f23_Nmm f33_Nmm2", prefix),
    }


def ellipse_columns(shared: HertzContact | None) -> Record:
    """Columns of the force of a contact point and of its ellipse.

    Parameters
    ----------
    shared
        Ellipse under the share of the load; None if the contact point carries no load.

    Returns
    -------
    Record
        Force in N, semi-axes in mm and peak pressure in MPa. Without a load only the force of zero.
    """
    if shared is None:
        return {"spring_force_N": 0.0}
    sizes = select_attributes(shared, "a_mm b_mm", "ellipse_")
    return {"spring_force_N": shared.normal_force_N, **sizes, "ellipse_p_max_MPa": shared.p0_MPa}


def equalise_columns(rows: list[Record]) -> list[Record]:
    """Give all rows equal columns.

    Parameters
    ----------
    rows
        Rows with different columns.

    Returns
    -------
    list of Record
        Rows with all columns. The columns of patches and contact points come last, in the order of their numbers.
    """
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns.sort(key=lambda name: (match[1], int(match[2])) if (match := _NUMBERED.match(name)) else ("", 0))
    return [{name: row.get(name) for name in columns} for row in rows]


def map_columns(row: Mapping[str, str] | None) -> Record:
    """Columns of the verdicts of a stored map for a line of a contact table.

    Parameters
    ----------
    row
        Row of the map; None if the map has no such cell.

    Returns
    -------
    Record
        Status, cheapest theory and verdicts; only `map_status` without a row.
    """
    if row is None:
        return {"map_status": "not in the map"}
    verdicts = {name: row.get(f"{name}_verdict_answer") or "" for name in THEORIES}
    verdicts["hertz"] = row.get("verdict_answer") or ""
    return {
        "map_status": row["status"],
        **{f"map_cheapest_theory{suffix}": row.get(f"cheapest_theory{suffix}") or "" for suffix in ("", "_status")},
        **{f"map_{name}_verdict": verdict for name, verdict in verdicts.items() if verdict},
    }


# --- A contact table on the terminal: its most important columns.

_SHIFT_COLUMN = number_column("shift\nmm", "lateral_shift_mm", "{:+z.2f}")
_YAW_COLUMN = number_column("yaw\nmrad", "yaw_mrad", "{:+z.2f}")
_COLUMNS = (
    number_column("load\nkN", "load_kN"),
    number_column("angle\nmrad", "touch1_contact_angle_rad", "{:.1f}", 1e3, rank=2, name="angle"),
    number_column("points", "contact_points", "{:.0f}", rank=1, name="points"),
    number_column("Hertz\np_max MPa", "hertz_p_max_MPa", "{:.0f}"),
    number_column("strips\np_max MPa", "strip_p_max_MPa", "{:.0f}"),
    number_column("area\nmm²", "strip_area_mm2", "{:.1f}", rank=6, name="area"),
    number_column("a\nmm", "strip_a_mm", "{:.2f}", rank=5, name="a"),
    number_column("b\nmm", "strip_b_mm", "{:.2f}", rank=4, name="b"),
    number_column("approach\nmm", "strip_approach_mm", "{:.4f}", rank=3, name="approach"),
    number_column("stiffness\nkN/mm", "strip_stiffness_N_per_mm", "{:.0f}", 1e-3, rank=7, name="stiffness"),
    text_column("strips", "strip_status", none="-"),
    cheapest_column("cheapest within criteria", "cheapest_theory"),
)
_T_GAMMA_COLUMN = number_column("T-gamma\nN", "strip_t_gamma_N", "{:.2f}")
_MAP_COLUMN = cheapest_column("map: cheapest", "map_cheapest_theory")


def _position_text(row: TableRecord) -> str:
    """Shift, yaw and load of a row; a yaw of zero is left out."""
    yaw_text = f", yaw {row['yaw_mrad']:+g} mrad" if row.get("yaw_mrad") else ""
    return f"{row['lateral_shift_mm']:+z.2f} mm{yaw_text}, {row['load_kN']:g} kN"


def _worst_interpolation_text(rows: Sequence[TableRecord], name: str) -> str:
    worst = max(rows, key=lambda row: row.get(name) or 0.0)
    return f"{worst[name]:.2g} % (next to {_position_text(worst)})"


def _step_texts(rows: Sequence[TableRecord], stored: str) -> Iterator[str]:
    """Sentences on the accuracy of interpolation between shifts, and on intervals with jumps."""
    steps = [row for row in rows if row.get("shift_step_status")]
    accurate_steps = [row for row in steps if row["shift_step_status"] == "within accuracy"]
    if accurate_steps:
        worst = max(accurate_steps, key=lambda row: row["shift_step_error_percent"])
        place = f" ({worst['shift_step_error_column']}, from {_position_text(worst)})" * bool(
            worst["shift_step_error_column"]
        )
        yield (
            "error of linear interpolation at the checked shifts between rows: up to"
            f" {worst['shift_step_error_percent']:.2g} %{place}"
        )
    yield from describe_jumps(rows, stored)


def contact_table_lines(rows: Sequence[TableRecord], stored: str = "the table") -> OutputLines:
    """Iterate over the outputs of a contact table: its most important columns and notes.

    Parameters
    ----------
    rows
        Rows of the table. Columns of a map and T-gamma are shown if the rows have them, and a column of yaws if a wheel
        has a yaw.
    stored
        Place of the whole table, in words.

    Returns
    -------
    iterator of Table and str
        The table, the errors of interpolation, and the problems of single lines.
    """
    has_map_columns = any("map_cheapest_theory" in row for row in rows)
    has_yaws = any(row.get("yaw_mrad") for row in rows)
    has_forces = any("strip_t_gamma_N" in row for row in rows)
    columns = [
        *(_SHIFT_COLUMN, *[_YAW_COLUMN] * has_yaws, *_COLUMNS),
        *(*[_T_GAMMA_COLUMN] * has_forces, *[_MAP_COLUMN] * has_map_columns),
    ]
    yield make_table("Contact table", columns, rows)
    if worst_texts := [
        _worst_interpolation_text(rows, name)
        for name in INTERPOLATION_ERROR_COLUMNS.values()
        if any(name in row for row in rows)
    ]:
        yield (
            "error of linear interpolation midway between rows: approach of the strip method up to"
            f" {worst_texts[0]}, stiffness up to {worst_texts[1]}; smaller steps there reduce it"
        )
    yield from _step_texts(rows, stored)
    for row in rows:
        for note in filter(None, (row["problem"], row.get("hertz_notes"), row.get("creep_notes"))):
            yield f"{_position_text(row)}: {note}"
