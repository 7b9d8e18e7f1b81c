"""Flat rows of results, one a case or a cell of a map: the columns of the tables."""

from __future__ import annotations

from dataclasses import asdict

from fecontact.comparison.creep import REAL
from fecontact.comparison.verdict import FORCE, cheapest, standings
from fecontact.outputs.records.results import case_inputs, load_record, share_records, versions
from fecontact.outputs.tables import Record, picked
from fecontact.outputs.words import roll_words
from fecontact.solving.map import ApplicabilityMap, LoadLimit, MapCell, MapPosition

MAP_SCHEMA = "fecontact/map/5"


def stiffness_rows(position: MapPosition) -> list[Record]:
    """Contact stiffness of a position at each of its loads, from the fit over all of them; none without it."""
    fit = position.stiffness
    if fit is None:
        return []
    rows = []
    for point in (cell.usable for cell in position.cells if cell.usable):
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
    force_limits = [limit_record(one.lateral_shift_mm, one.force_limit or one.limit) for one in made.positions]
    # first yield, and where yielding takes up a limit
    yields = [{"lateral_shift_mm": one.lateral_shift_mm, **one.yield_loads_N} for one in made.positions]
    return {
        "schema": MAP_SCHEMA,
        # shift and load are the map's own
        "case": {k: v for k, v in case_inputs(made.case).items() if k not in ("lateral_shift_mm", "load_N")},
        "roll": roll_words(made.case),
        "criteria": asdict(made.case.criteria),
        **picked(made, "lateral_shifts_mm loads_N"),
        "cells": [cell_record(cell) for cell in made.cells],
        "limits": [limit_record(position.lateral_shift_mm, position.limit) for position in made.positions],
        **({"force_limits": force_limits} if made.case.creep.asked else {}),
        **({"yield_loads_N": yields} if any(one.yield_loads_N for one in made.positions) else {}),
        "theory_shares": share_records(made),
        "stiffness": [row for position in made.positions for row in stiffness_rows(position)],
        "versions": versions(),
        "provenance": provenance or {},
    }


def cell_record(cell: MapCell) -> Record:
    """A cell with all that is known of it."""
    return {
        **picked(cell, "lateral_shift_mm load_N status"),
        **({} if cell.judged is None else load_record(cell.judged)),
    }


def limit_record(shift_mm: float, limit: LoadLimit) -> Record:
    """A load limit of a position."""
    return {
        "lateral_shift_mm": shift_mm,
        **picked(limit, "F_max_N intervals reason note"),
        "tried": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }


def law_row(cell: MapCell) -> Record:
    """A cell with the cheapest law of creep forces that holds, and how far each is off."""
    row = picked(cell, "lateral_shift_mm load_kN status")
    laws = {} if cell.judged is None else cell.judged.creep_laws
    if laws:
        row["cheapest_theory"] = cheapest(standings(laws)).label
    for name, judged in laws.items():
        if name == REAL:
            continue
        row[f"{name}_verdict"] = judged.verdict.answer
        row[f"{name}_off_percent_of_muN"] = 1e2 * judged.deviation[FORCE]
        row[f"{name}_uncertainty_percent_of_muN"] = 1e2 * judged.uncertainty[FORCE]
        worst = judged.decided[0].creepages
        row[f"{name}_xi"], row[f"{name}_eta"] = worst.xi, worst.eta
    return row
