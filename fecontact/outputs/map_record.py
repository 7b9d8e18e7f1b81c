"""Cells and positions of an applicability map as plain values for JSON, and back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from fecontact.comparison.measures import Measures
from fecontact.comparison.verdict import Judgement
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.solving.load_sweep import LoadPoint

Record = dict[str, Any]


def cell_record(cell: MapCell) -> Record:
    """A cell with all that is known of it."""
    point = cell.point
    return {
        "lateral_shift_mm": cell.shift_mm,
        "load_N": cell.load_N,
        "status": cell.status,
        "verdict": cell.verdict,
        "solved": cell.solved,
        "cause": cell.cause,
        "point": None if point is None else asdict(point),
        "inferred": None if cell.inferred is None else asdict(cell.inferred),
    }


def limit_record(shift_mm: float, limit: LoadLimit) -> Record:
    """The load limit of a position."""
    return {
        "lateral_shift_mm": shift_mm,
        "F_max_N": limit.F_max_N,
        "holds_N": limit.holds_N,
        "fails_N": limit.fails_N,
        "reason": limit.reason,
        "note": limit.note,
        "bisection": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }


def position_record(position: MapPosition) -> Record:
    """A position with its cells and its load limit."""
    return {
        "lateral_shift_mm": position.shift_mm,
        "cells": [cell_record(cell) for cell in position.cells],
        "limit": limit_record(position.shift_mm, position.limit),
    }


def position_from_record(record: Mapping[str, Any]) -> MapPosition:
    """A position whose cells were all solved, from its record.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """
    return MapPosition(
        shift_mm=record["lateral_shift_mm"],
        cells=tuple(_cell(cell) for cell in record["cells"]),
        limit=_limit(record["limit"]),
    )


def _cell(record: Mapping[str, Any]) -> MapCell:
    return MapCell(
        shift_mm=record["lateral_shift_mm"],
        load_N=record["load_N"],
        status=record["status"],
        point=_point(record["point"]),
    )


def _point(record: Mapping[str, Any]) -> LoadPoint:
    # a value that was no number is null in JSON
    named = {
        name: {key: math.nan if value is None else value for key, value in record[name].items()}
        for name in ("fe", "hertz", "deviation", "uncertainty")
    }
    measures = {name: Measures(**named[name]) for name in ("fe", "hertz")}
    return LoadPoint(
        **{
            **record,
            **named,
            **measures,
            "verdict": Judgement(**record["verdict"]),
            "warnings": tuple(record["warnings"]),
        }
    )


def _limit(record: Mapping[str, Any]) -> LoadLimit:
    plain = {name: record[name] for name in ("F_max_N", "holds_N", "fails_N", "reason", "note")}
    return LoadLimit(**plain, tried=tuple((step["load_N"], step["verdict"]) for step in record["bisection"]))
