"""An applicability map as CSV, JSON and text."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.files import write_sealed
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.force_map import force_map_figure
from fecontact.outputs.map_figure import map_figure
from fecontact.outputs.record import load_record, shown_case_record, versions
from fecontact.outputs.roll_words import roll_words
from fecontact.outputs.rows import cell_row
from fecontact.outputs.tables import write_csv
from fecontact.outputs.theory_map import write_theory_map

Floats = NDArray[np.float64]
Record = dict[str, Any]

MAP_SCHEMA = "fecontact/map/4"


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
    write_sealed(out / f"{name}.json", map_record(made, provenance), [out / f"{name}.csv"])
    if not (drawn and made.positions):
        return
    map_figure(made, out / f"{name}.png")
    # those of another friction, or of theories before, would not belong to this map
    for old in ("force.png", "force.svg", "theory.csv", "theory.png", "theory.svg"):
        (out / f"{name}_{old}").unlink(missing_ok=True)
    if made.case.creep.asked:
        force_map_figure(made, out / f"{name}_force.png")
    if made.laws_judged:
        write_theory_map(made, out)


def stiffness_rows(position: MapPosition) -> list[Record]:
    """Contact stiffness of a position at each of its loads, from the fit over all of them; none without it."""
    fit = position.stiffness
    if fit is None:
        return []
    rows = []
    for point in (c.judged for c in position.cells if c.judged is not None and c.status == "converged"):
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
        "cells": [cell_record(cell) for cell in made.cells],
        "limits": [limit_record(position.lateral_shift_mm, position.limit) for position in made.positions],
        **({"force_limits": _force_limits(made)} if made.case.creep.asked else {}),
        "stiffness": [row for position in made.positions for row in stiffness_rows(position)],
        "versions": versions(),
        "provenance": provenance or {},
    }


def cell_record(cell: MapCell) -> Record:
    """A cell with all that is known of it."""
    return {
        "lateral_shift_mm": cell.lateral_shift_mm,
        "load_N": cell.load_N,
        "status": cell.status,
        "verdict": cell.verdict,
        "cause": cell.cause,
        "load": None if cell.judged is None else load_record(cell.judged),
    }


def _force_limits(made: ApplicabilityMap) -> list[Record]:
    return [limit_record(one.lateral_shift_mm, one.force_limit or one.limit) for one in made.positions]


def limit_record(shift_mm: float, limit: LoadLimit) -> Record:
    """A load limit of a position."""
    return {
        "lateral_shift_mm": shift_mm,
        "F_max_N": limit.F_max_N,
        "intervals": [asdict(interval) for interval in limit.intervals],
        "reason": limit.reason,
        "note": limit.note,
        "tried": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }
