"""Theories by themselves, previews and contact tables: records, rows, and what is printed of them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.touch_hertz import HertzPoints
from fecontact.errors import InputError
from fecontact.features import offered
from fecontact.judging.measures import hertz_measures, measures_of_theory
from fecontact.outputs.cases import cheapest_column
from fecontact.outputs.geometry import touch_columns, touch_record
from fecontact.outputs.own_profiles import geometry_line, own_profiles_record
from fecontact.outputs.records.results import (
    case_inputs,
    cheapest_columns,
    contact_record,
    versions,
)
from fecontact.outputs.tables import Item, Record, flat, number, picked, table_of, text, told
from fecontact.outputs.terminal import Lines, notes
from fecontact.placement.placement import Placement
from fecontact.solving.alone import TableLine, TheoryAlone
from fecontact.solving.placing import roll_of_case
from fecontact.solving.preview import Preview

_EXPECTED = "x_low_mm x_high_mm s_low_mm s_high_mm semi_axis_x_mm semi_axis_s_mm parts"
_THEORY = "words cost source range differs"


def check_theory(name: str) -> None:
    """Refuse a theory of the pressure that there is not.

    Raises
    ------
    InputError
        With those that there are.
    """
    if name not in THEORIES:
        raise InputError(f"theory is {name!r}; allowed: {', '.join(THEORIES)}; `fecontact theories` says what they are")


def theories_listed() -> Record:
    """The theories of the `pressure`, and the laws that features judge, each from the cheapest."""
    return {
        "pressure": {name: picked(theory, _THEORY) for name, theory in THEORIES.items()},
        **{laws.kind: told(laws.laws) for laws in offered("LAWS").values()},
    }


def alone_record(found: TheoryAlone) -> Record:
    """What a theory says at a position; without a contact its `problem` is why there is none."""
    placement, measures = found.placement, found.measures
    said: Record = {"status": found.status, "notes": [], "solutions": 0, "patches": []}
    if found.contact is not None and measures is not None:
        said = contact_record(found.contact, measures) | {"normal_force_N": found.contact.normal_force_N}
    return {
        "schema": "fecontact/theory/1",
        "theory": found.name,
        **picked(THEORIES[found.name], _THEORY),
        "case": case_inputs(found.case, placement),
        **own_profiles_record(found.case, placement),
        "contact_angle_rad": placement.first.contact_angle_rad,
        "given_normal_force_N": found.normal_force_N,
        "problem": found.problem,
        **said,
        "warnings": list(placement.notes),
        "versions": versions(),
    }


# --- A case before it is solved, as a record.


def preview_record(seen: Preview) -> dict[str, Any]:
    """Everything that a preview says, with units in the keys."""
    return {
        "schema": "fecontact/place/1",
        "case": case_inputs(seen.case, seen.placement),
        "touch_points": [touch_record(touch) for touch in seen.placement.touch_points],
        "hertz": {"p_max_MPa": seen.hertz.p0_MPa, **picked(seen.hertz, "a_mm b_mm")},
        "uncertainty_of_profile": seen.hertz_uncertainty,
        "expected_patch": picked(seen.expected, _EXPECTED),
        **picked(seen, "element_size_mm elements degrees_of_freedom cpu_seconds memory_GB"),
        "junctions": junctions_of(seen),
        "notes": list(seen.placement.notes),
    }


def junctions_of(seen: Preview) -> list[dict[str, Any]]:
    """Curvature junctions of both profiles by their distance from the first touch point along the line."""
    found = [
        {"profile": place.profile.kind, "y_mm": place.junction.y_mm, "distance_mm": place.s_mm}
        for place in seen.placement.junctions
    ]
    return sorted(found, key=lambda one: abs(one["distance_mm"]))


# --- Lines of a contact table as flat rows with units in their keys.

# as each contact has them
SIZES = "p_max_MPa area_mm2 a_mm b_mm approach_mm"
_NUMBERED = re.compile(r"(patch|touch)(\d+)_")
BETWEEN_LINES = {
    "strip_approach_mm": "strip_approach_between_percent",
    "strip_stiffness_N_per_mm": "strip_stiffness_between_percent",
}
"""Columns that say what straight lines to the lines beside it miss in the middle, by what is interpolated."""


def table_row(line: TableLine) -> Record:
    """A line with all that is known of it; touch points come last, numbered from 1, the first touch first.

    The ellipse has the whole load at the first touch point; N grows with the approach as its power of 1.5.
    """
    row: Record = {
        "lateral_shift_mm": line.case.lateral_shift_mm,
        "load_kN": line.case.load_N / 1e3,
        "problem": line.problem,
    }
    if line.placement is None:
        return row
    hertz, strips, springs = line.hertz, line.strips, line.points
    row |= {
        "roll_mrad": 1e3 * roll_of_case(line.case, line.placement),
        "touch_points": len(line.placement.touch_points),
        **cheapest_columns("cheapest_theory", line.cheapest),
    }
    if hertz is not None:
        row |= picked(hertz, "normal_force_N", "hertz_") | picked(hertz_measures(hertz), SIZES, "hertz_")
        row["hertz_stiffness_N_per_mm"] = 1.5 * hertz.normal_force_N / hertz.approach_mm
    row["strip_status"] = "no contact" if strips is None else strips.status
    if strips is not None:
        row |= {
            "strip_patches": len(strips.patches),
            **picked(strips, "normal_force_N", "strip_"),
            **picked(measures_of_theory(strips), SIZES, "strip_"),
            "strip_centre_mm": strips.centre_mm[1],
            "strip_stiffness_N_per_mm": line.strip_stiffness_N_per_mm,
            **_strip_patches(line.placement, strips),
        }
    if springs is not None:
        row |= {"springs_approach_mm": springs.shared_approach_mm, "springs_p_max_MPa": springs.shared_p_max_MPa}
    return row | touches(line.placement, {n: _spring_columns(springs, n) for n in range(row["touch_points"])})


def _strip_patches(placement: Placement, strips: Approximation) -> Record:
    """Columns of each patch of the strips, from the largest force: where its centre lies, and the rail's angle there.

    All forces are along the normal at first touch.
    """
    found: Record = {}
    for place, patch in enumerate(strips.patches, 1):
        rail_y, wheel_y, angle = placement.on_profiles(*patch.centre_mm)
        places = {"rail_y_mm": rail_y, "wheel_y_mm": wheel_y, "contact_angle_rad": angle}
        found |= flat({f"patch{place}": picked(patch, "normal_force_N p_max_MPa a_mm b_mm") | places})
    return found


def touches(placement: Placement, springs: Mapping[int, Record]) -> Record:
    """Columns of all touch points, numbered from 1, each with the columns of its spring."""
    touches = enumerate(placement.touch_points)
    return flat({f"touch{n + 1}": touch_columns(placement, touch) | springs.get(n, {}) for n, touch in touches})


def _spring_columns(points: HertzPoints | None, number: int) -> Record:
    """The spring of a touch point, and its ellipse under the force that it takes as one of them."""
    found = [one for one in points.points if one.touch_point == number and one.side != "gauge"] if points else []
    if not found or found[0].whole is None:
        return {}
    return {"spring_N_per_mm15": found[0].whole.stiffness_N_per_mm15} | ellipse_columns(found[0].shared)


def ellipse_columns(shared: HertzContact | None) -> Record:
    """The force that a touch point takes, and its ellipse; None where it takes none."""
    if shared is None:
        return {"spring_force_N": 0.0}
    sizes = picked(shared, "a_mm b_mm", "ellipse_")
    return {"spring_force_N": shared.normal_force_N, **sizes, "ellipse_p_max_MPa": shared.p0_MPa}


def ordered(rows: list[Record]) -> list[Record]:
    """Rows with all columns that any has, patches and touch points last, by their numbers."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns.sort(key=lambda name: (found[1], int(found[2])) if (found := _NUMBERED.match(name)) else ("", 0))
    return [{name: row.get(name) for name in columns} for row in rows]


def map_columns(row: Mapping[str, str] | None) -> Record:
    """What a row of a stored map says of theories at a line; `map_status` alone where the map has no such cell."""
    if row is None:
        return {"map_status": "not in the map"}
    verdicts = {name: row.get(f"{name}_verdict_answer") or "" for name in THEORIES}
    verdicts["hertz"] = row.get("verdict_answer") or ""
    return {
        "map_status": row["status"],
        **{f"map_cheapest_theory{of}": row.get(f"cheapest_theory{of}") or "" for of in ("", "_status")},
        **{f"map_{name}_verdict": verdict for name, verdict in verdicts.items() if verdict},
    }


# --- Theories on the terminal: the list of those that are judged, and one of them at a position.

_PATCH = (
    text("patch", "patch"),
    number("F_n\nkN", "normal_force_N", "{:.3f}", 1e-3),
    number("p_max\nMPa", "p_max_MPa", "{:.1f}"),
    number("area\nmm²", "area_mm2", "{:.2f}"),
    number("a\nmm", "a_mm", "{:.3f}"),
    number("b\nmm", "b_mm", "{:.3f}"),
    number("approach\nmm", "approach_mm", "{:.5f}", none=""),
    number("centre s\nmm", lambda patch: patch["centre_mm"][1], "{:+z.3f}"),
)


def theories_lines(listed: Item) -> Lines:
    """What each theory is, where it is from, what it takes for granted, and what differs from its source."""
    headings = {laws.kind: laws.heading for laws in offered("LAWS").values()}
    for kind, theories in listed.items():
        yield f"{headings.get(kind, 'Theories of the pressure')}, from the cheapest:"
        for name, theory in theories.items():
            yield f"  {name}: {theory['words']}; {theory['cost']}"
            yield from (f"      {key}: {theory[key]}" for key in ("source", "range", "differs") if theory.get(key))


def alone_lines(record: Item) -> Lines:
    """What a theory says at a position, and each of its patches where there are several."""
    yield from geometry_line(record)
    if record["problem"] is None:
        patches = record["patches"] if len(record["patches"]) > 1 else []
        numbered = ({**patch, "patch": place, "approach_mm": None} for place, patch in enumerate(patches, 1))
        yield table_of(record["words"], _PATCH, [{**record, "patch": "all"}, *numbered])
    yield f"status: {record['status']}"
    yield from filter(None, (record["problem"], *record["notes"]))
    if record["solutions"] > 1:
        yield f"approaches that carry the force: {record['solutions']}"
    yield from notes(record["warnings"])


# --- A case before it is solved, in words.


def preview_lines(seen: Preview) -> Lines:
    """A preview in lines."""
    yield from geometry_line(own_profiles_record(seen.case, seen.placement))
    patch, (dx, ds) = seen.expected, seen.element_size_mm
    for place, touch in enumerate(seen.placement.touch_points, start=1):
        yield (
            f"touch point {place}: rail y {touch.rail_y_mm:+.2f} mm, wheel y {touch.wheel_y_mm:+.2f} mm, contact angle"
            f" {1e3 * touch.contact_angle_rad:+.1f} mrad, gap {1e3 * touch.vertical_gap_mm:.1f} um"
        )
    unsure = "" if seen.hertz_uncertainty is None else f"; {uncertainty_text(seen.hertz_uncertainty)}"
    yield f"Hertz: p0 {seen.hertz.p0_MPa:.1f} MPa, a {seen.hertz.a_mm:.3f} mm, b {seen.hertz.b_mm:.3f} mm{unsure}"
    yield (
        f"expected patch: {patch.x_high_mm - patch.x_low_mm:.2f} mm along x, {patch.s_high_mm - patch.s_low_mm:.2f} mm"
        f" across, from {patch.s_low_mm:+.2f} to {patch.s_high_mm:+.2f} mm of the touch point"
    )
    reached = [one for one in junctions_of(seen) if patch.s_low_mm <= one["distance_mm"] <= patch.s_high_mm]
    told = ", ".join(f"{one['profile']} at {one['distance_mm']:+.2f} mm" for one in reached)
    yield f"curvature junctions below it: {told or 'none'}"
    yield (
        f"elements {dx:.3g} by {ds:.3g} mm, {seen.elements[0]} by {seen.elements[1]} in the fine zone: about"
        f" {round(seen.degrees_of_freedom, -3)} unknowns, {seen.cpu_seconds:.0f} CPU s and {seen.memory_GB:.1f} GB;"
        f" more where the verdict is open, up to {seen.case.most_unknowns} unknowns"
    )
    yield from notes(seen.placement.notes)


def uncertainty_text(part: dict[str, float]) -> str:
    """What measured profiles leave open of Hertz, in words."""
    if any(np.isnan(value) for value in part.values()):
        return "another line that the measured points allow does not come into contact here: Hertz is not known"
    p, a, b = (100.0 * part[name] for name in ("p_max_MPa", "a_mm", "b_mm"))
    return f"the measured profiles leave ±{p:.2g} % of p0, ±{a:.2g} % of a and ±{b:.2g} % of b open"


# --- A contact table on the terminal: its most important columns.

_COLUMNS = (
    number("shift\nmm", "lateral_shift_mm", "{:+z.2f}"),
    number("load\nkN", "load_kN"),
    number("angle\nmrad", "touch1_contact_angle_rad", "{:.1f}", 1e3, rank=2, name="angle"),
    number("points", "touch_points", "{:.0f}", rank=1, name="points"),
    number("Hertz\np_max MPa", "hertz_p_max_MPa", "{:.0f}"),
    number("strips\np_max MPa", "strip_p_max_MPa", "{:.0f}"),
    number("area\nmm²", "strip_area_mm2", "{:.1f}", rank=6, name="area"),
    number("a\nmm", "strip_a_mm", "{:.2f}", rank=5, name="a"),
    number("b\nmm", "strip_b_mm", "{:.2f}", rank=4, name="b"),
    number("approach\nmm", "strip_approach_mm", "{:.4f}", rank=3, name="approach"),
    number("stiffness\nkN/mm", "strip_stiffness_N_per_mm", "{:.0f}", 1e-3, rank=7, name="stiffness"),
    text("strips", "strip_status", none="-"),
    cheapest_column("cheapest within criteria", "cheapest_theory"),
)
_OF_MAP = cheapest_column("map: cheapest", "map_cheapest_theory")


def _worst_between(rows: Sequence[Item], name: str) -> str:
    worst = max(rows, key=lambda row: row.get(name) or 0.0)
    return f"{worst[name]:.2g} % (beside {worst['lateral_shift_mm']:+z.2f} mm, {worst['load_kN']:g} kN)"


def contact_table_lines(rows: Sequence[Item]) -> Lines:
    """The most important columns of a contact table, columns of a map if asked for, and what is missing."""
    of_map = any("map_cheapest_theory" in row for row in rows)
    yield table_of("Contact table", [*_COLUMNS, *[_OF_MAP] * of_map], rows)
    if worst := [_worst_between(rows, name) for name in BETWEEN_LINES.values() if any(name in row for row in rows)]:
        yield (
            f"interpolated straight between lines, in the middle of shifts and loads, the strips' approach is off by up"
            f" to {worst[0]}, their stiffness by up to {worst[1]}; finer steps there bring less"
        )
    for row in rows:
        if row["problem"]:
            yield f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN: {row['problem']}"
