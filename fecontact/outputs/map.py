"""An applicability map as CSV, JSON and text."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.files import write_json
from fecontact.geometry.placement import Placement
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.force_map import force_map_figure
from fecontact.outputs.map_figure import map_figure
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.multi_hertz import judged_record, springs_help, springs_of_cell
from fecontact.outputs.record import load_record, shown_case_record, versions
from fecontact.outputs.roll_words import other_wheel_label, roll_words
from fecontact.outputs.rows import cell_row
from fecontact.outputs.tables import write_csv
from fecontact.solving.stiffness_fit import fit_stiffness

Floats = NDArray[np.float64]
Record = dict[str, Any]

MAP_SCHEMA = "fecontact/map/3"
_FEWEST_LOADS = 3


def write_map(
    made: ApplicabilityMap, out: Path, name: str = "map", *, provenance: Record | None = None, drawn: bool = True
) -> None:
    """Write NAME.csv, NAME.json and NAME.png, into a folder; for the whole map stiffness.csv, if it has any."""
    rows = [cell_row(cell, position.placement) for position in made.positions for cell in position.cells]
    write_csv(rows, out / f"{name}.csv")
    if name == "map":
        stiffness = [row for position in made.positions for row in stiffness_rows(position)]
        if stiffness:
            write_csv(stiffness, out / "stiffness.csv")
        else:
            # one of other loads would not belong to this map
            (out / "stiffness.csv").unlink(missing_ok=True)
    write_json(out / f"{name}.json", map_record(made, provenance))
    if not (drawn and made.positions):
        return
    map_figure(made, out / f"{name}.png")
    if made.case.creep.asked:
        force_map_figure(made, out / f"{name}_force.png")


def stiffness_rows(position: MapPosition) -> list[Record]:
    """Contact stiffness of a position at each of its loads, from a fit over all of them; none for fewer than three.

    Two loads would be met exactly, which says nothing about the fit's error.
    """
    points = [c.judged for c in position.cells if c.judged is not None and c.status == "converged"]
    if len(points) < _FEWEST_LOADS:
        return []
    fit = fit_stiffness(points)
    rows = []
    for point in points:
        tangent = fit.tangent(point.normal_force_N)
        rows.append(
            {
                "lateral_shift_mm": position.lateral_shift_mm,
                "load_kN": point.load_N / 1e3,
                "normal_force_kN": point.normal_force_N / 1e3,
                "approach_fe_mm": point.comparison.fe.approach_mm,
                "approach_hertz_mm": point.comparison.hertz.approach_mm,
                "tangent_with_bulk_kN_per_mm": tangent.with_bulk_N_per_mm / 1e3,
                "tangent_with_bulk_error_kN_per_mm": tangent.error_N_per_mm / 1e3,
                "tangent_contact_kN_per_mm": tangent.contact_N_per_mm / 1e3,
                "tangent_contact_error_kN_per_mm": tangent.contact_error_N_per_mm / 1e3,
                "tangent_hertz_kN_per_mm": tangent.hertz_N_per_mm / 1e3,
                "tangent_deviation_percent": 1e2 * tangent.deviation,
                "c1_mm_per_N23": fit.c1_mm_per_N23,
                "c1_error_mm_per_N23": fit.c1_error,
                "c1_hertz_mm_per_N23": fit.hertz_c1_mm_per_N23,
                "c2_mm_per_N": fit.c2_mm_per_N,
                "c2_error_mm_per_N": fit.c2_error,
                "fit_residual_percent": 1e2 * fit.residual,
            }
        )
    return rows


def map_record(made: ApplicabilityMap, provenance: Record | None = None) -> Record:
    """The whole map with the base case, its criteria, and what made it."""
    return {
        "schema": MAP_SCHEMA,
        # shift and load are the map's own
        "case": {k: v for k, v in shown_case_record(made.case).items() if k not in ("lateral_shift_mm", "load_N")},
        "roll": roll_words(made.case),
        "criteria": asdict(made.case.criteria),
        "lateral_shifts_mm": list(made.lateral_shifts_mm),
        "loads_N": list(made.loads_N),
        "cells": [cell_record(cell, position.placement) for position in made.positions for cell in position.cells],
        "limits": [limit_record(position) for position in made.positions],
        "stiffness": [row for position in made.positions for row in stiffness_rows(position)],
        "versions": versions(),
        "provenance": provenance or {},
    }


def cell_record(cell: MapCell, placement: Placement | None = None) -> Record:
    """A cell with all that is known of it; with a placement also the ellipses that share its load, if several do."""
    springs = springs_of_cell(cell, placement)
    return {
        "lateral_shift_mm": cell.lateral_shift_mm,
        "load_N": cell.load_N,
        "status": cell.status,
        "verdict": cell.verdict,
        "solved": cell.solved,
        "cause": cell.cause,
        "load": None if cell.judged is None else load_record(cell.judged),
        "inferred": None if cell.inferred is None else asdict(cell.inferred),
        **({} if springs is None else {"multi_hertz": judged_record(springs)}),
    }


def limit_record(position: MapPosition) -> Record:
    """The load limit of a position."""
    limit = position.limit
    return {
        "lateral_shift_mm": position.lateral_shift_mm,
        "F_max_N": limit.F_max_N,
        "intervals": [asdict(interval) for interval in limit.intervals],
        "reason": limit.reason,
        "note": limit.note,
        "tried": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }


_MEASURE_LETTERS = {
    "p_max_MPa": "p",
    "area_mm2": "A",
    "a_mm": "a",
    "b_mm": "b",
    "centre_over_b": "c",
    "valley": "v",
    "separate_load": "s",
    "misplaced_load": "m",
}


_ANSWER_WORDS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "open"}


def limit_text(limit: LoadLimit) -> str:
    """At which loads Hertz holds, in words."""
    parts = [
        f"{_ANSWER_WORDS[one.answer]} {one.low_N / 1e3:.4g}"
        + (f" to {one.high_N / 1e3:.4g}" if one.high_N > one.low_N else "")
        for one in limit.intervals
    ]
    text = f"{', '.join(parts)} kN" if parts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def _deviation_text(cell: MapCell) -> str:
    usable = cell.status in ("converged", "inferred")
    percent = 1e2 * cell.deviation["p_max_MPa"] if usable else math.nan
    return f"{percent:+z.1f}" if math.isfinite(percent) else ""


def map_table(made: ApplicabilityMap, *, width: int | None = None) -> str:
    """Verdicts and peak deviations in percent, a line for each position, and the load limits.

    Where a line is longer than `width`, the limits stand below, and cells are closer; a table that is still too wide
    is cut into tables of fewer loads.
    """
    texts = [[_cell_text(cell, position.placement) for cell in position.cells] for position in made.positions]
    limits = [limit_text(position.limit) for position in made.positions]
    heads = [f"{load / 1e3:g}" for load in made.loads_N]
    lines = _lines(made, heads, texts, range(len(heads)), 10)
    widest = max((len(line) + 2 + len(limit) for line, limit in zip(lines[1:], limits, strict=True)), default=0)
    if width is None or widest <= width:
        lines[1:] = [f"{line}  {limit}" for line, limit in zip(lines[1:], limits, strict=True)]
    else:
        room = max(1, (width - 13) // 9)
        parts = [range(first, min(first + room, len(heads))) for first in range(0, len(heads), room)]
        lines = [line for part in parts for line in _lines(made, heads, texts, part, 9)]
        lines.append("load limits:")
        for position, limit in zip(made.positions, limits, strict=True):
            lines += wrap(
                f"{position.lateral_shift_mm:+z8.2f}  {limit}", width, subsequent_indent=" " * 10, drop_whitespace=True
            )
    notes = ["+ holds, x fails, ? unresolved, ! could not be solved; peak pressure, Hertz against FE in %"]
    letters = ", ".join(f"{letter} {WORDS[measure].short}" for measure, letter in _MEASURE_LETTERS.items())
    notes.append(f"decided by {letters}")
    if not all(cell.solved for cell in made.cells):
        notes.append("i inferred from the half-space and both neighbours, not solved")
    if any(text.endswith(_SPRINGS_HELP) for row in texts for text in row):
        notes.append(f"{_SPRINGS_HELP} Hertz at all touch points, which share the load as springs, holds")
    notes.append(_position_text(made.case))
    return "\n".join(lines + [line for note in notes for line in (wrap(note, width) if width else [note])])


def _position_text(case: Case) -> str:
    other = other_wheel_label(case)
    same = "; the other wheel at a shift is this one at the opposite shift" if other else ""
    return f"{case.side} wheel, {roll_words(case)}{same}"


def _lines(
    made: ApplicabilityMap, heads: Sequence[str], texts: Sequence[Sequence[str]], part: range, column: int
) -> list[str]:
    """A line of loads, and a line for each position."""
    head = "shift mm " + "".join(heads[k].rjust(column) for k in part) + "  kN"
    return [head] + [
        f"{shift:+z8.2f} " + "".join(row[k].rjust(column) for k in part)
        for shift, row in zip(made.lateral_shifts_mm, texts, strict=True)
    ]


_SPRINGS_HELP = "*"


def _cell_text(cell: MapCell, placement: Placement | None) -> str:
    marks: Mapping[str, str] = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
    mark = _SPRINGS_HELP if springs_help(cell, placement) else "i "[cell.solved]
    return marks[cell.verdict] + _decided_by(cell) + _deviation_text(cell).rjust(6) + mark


def _decided_by(cell: MapCell) -> str:
    found = cell.judged or cell.inferred
    # no measure leaves open what did not converge
    usable = cell.status in ("converged", "inferred")
    return " " if found is None or not usable or cell.verdict == "HOLDS" else _MEASURE_LETTERS[found.verdict.measure]
