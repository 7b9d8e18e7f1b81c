"""Theories alone and contact tables, without finite elements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.inputs.texts import require_number_list
from fecontact.jobs.remaining import Progress, report_progress
from fecontact.outputs.alone import INTERPOLATION_ERROR_COLUMNS, equalise_columns, map_columns, table_row
from fecontact.outputs.records.results import hertz_record
from fecontact.outputs.table_grid import TABLE_AXES
from fecontact.outputs.theory_alone import check_theory, list_theories, theory_record
from fecontact.runs.table_steps import refine_shifts, require_accuracy
from fecontact.solving.alone import compute_strip_stiffness, evaluate_theory, iterate_table_rows
from fecontact.solving.hertz_alone import evaluate_hertz

Record = dict[str, Any]


def hertz(case: Case) -> Record:
    """Evaluate Hertz's theory alone at the position of a case.

    Parameters
    ----------
    case
        Case; its meshes and criteria are not used.

    Returns
    -------
    dict
        Record of Hertz. `hertz` is the ellipse that a result is compared with. `ellipses` has every contact point, and
        both sides of a junction, as if each carried the whole load. If the surfaces conform there is no ellipse, and
        `problem` gives the reason.

    Raises
    ------
    InputError
        For profiles that cannot be read, positions in which the wheel does not run on the rail, and surfaces that
        conform at the first contact point, so that there is no ellipse.

    Examples
    --------
    >>> import fecontact
    >>> record = fecontact.hertz(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(record["ellipses"][0]["p_max_MPa"], -1)
    1480.0
    """
    return hertz_record(evaluate_hertz(case))


def theory(case: Case, name: str) -> Record:
    """Evaluate a theory of the pressure alone at the position of a case.

    Parameters
    ----------
    case
        Case; its meshes and criteria are not used.
    name
        Name of the theory, such as `strip` or `multi_hertz`; `theories` lists all names.

    Returns
    -------
    dict
        Record of the theory. `status` is `solved` if the theory is inside its range; otherwise `notes` give the
        reasons. `solutions` is the number of approaches with this force, and `problem` the reason if there is no
        contact.

    Raises
    ------
    InputError
        For an unknown name, profiles that cannot be read, positions in which the wheel does not run on the rail, and
        surfaces that conform, so that there is no ellipse for Hertz.

    Examples
    --------
    >>> import fecontact
    >>> record = fecontact.theory(fecontact.Case(lateral_shift_mm=4.0), "strip")
    >>> record["status"], round(record["p_max_MPa"], -1)
    ('solved', 1480.0)
    """
    check_theory(name)
    return theory_record(evaluate_theory(case, name))


def theories() -> Record:
    """List the judged theories of the pressure, and laws such as laws of creep forces.

    Returns
    -------
    dict
        Theories and laws by kind, from the cheapest.

    Examples
    --------
    >>> import fecontact
    >>> list(fecontact.theories()["pressure"])[0]
    'hertz'
    """
    return list_theories()


# --- Contact tables for vehicle codes: lines over shift, yaw and load, with the verdicts of a stored map.

Line = tuple[float, float, float]
"""Lateral shift in mm, yaw in mrad and load in kN."""
# Decimals to which shifts (mm), yaws (mrad) and loads (kN) are compared.
_KEY_DECIMALS = 6


def table(
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    *,
    yaws_mrad: Sequence[float] | None = None,
    accuracy_percent: float | None = None,
    map_folder: str | Path | None = None,
    progress: Progress | None = None,
) -> list[Record]:
    """Compute a contact table over lateral shift, yaw and load, without a solution.

    Parameters
    ----------
    case
        Everything except lateral shift, `yaws_mrad` and load; its criteria limit the deviation of a cheap theory from
        the strips.
    lateral_shifts_mm
        Lateral shifts of the wheelset, in mm.
    loads_N
        Wheel loads, in N.
    yaws_mrad
        Yaws of the wheelset, in mrad; None for the yaw of the case.
    accuracy_percent
        Accuracy of linear interpolation between shifts, in % (0.1 to 50): steps, which are checked at least every
        0.125 mm, are halved where it is not reached, down to 0.01 mm. The error is relative to the value; for places,
        angles, rolling radii, creepages, creep forces and T-gamma it is relative to their range over the table, for the
        centre of pressure to the half-width, and for one of several patches or contact points to the largest value.
        Radii of curvature are not checked. None for the given shifts alone.
    map_folder
        Folder of a map that `fecontact map` wrote for this pair: columns `map_*` have its verdicts at its shifts and
        loads, in rows with one of its yaws; `map_status` is `not in the map` in all other rows.
    progress
        Receives the progress as for `run`, with lines in place of cases.

    Returns
    -------
    list of dict
        Flat dictionaries with units in their keys, a dictionary per shift, yaw and load, in this order.
        `strip_approach_between_percent` and `strip_stiffness_between_percent` are the errors of linear interpolation to
        the neighbouring shifts, yaws and loads, compared with the strips in the middle between them. A position without
        contact is a row with its `problem`. With an accuracy the rows are sorted by shift. `shift_step_mm` is the step
        to the next shift, `shift_step_error_percent` its largest error (None if a column is missing on one side),
        `shift_step_error_column` the column, and `shift_step_status` is `within accuracy` or `jump`. With friction
        `creep_*`, `hertz_creep_*`, `strip_creep_*`, `hertz_t_gamma_N` and `strip_t_gamma_N` are creepages, and creep
        forces and T-gamma by FASTSIM.

    Raises
    ------
    InputError
        Without shifts, yaws and loads, with yaws for a case with a yaw, for an accuracy that is not allowed, or for a
        map of another pair.

    Examples
    --------
    >>> import fecontact
    >>> rows = fecontact.table(fecontact.Case(roll="touching"), [0.0, 4.0], [50e3, 100e3])
    >>> [(row["lateral_shift_mm"], row["load_kN"], row["cheapest_theory"]) for row in rows]
    [(0.0, 50.0, 'strip'), (0.0, 100.0, 'strip'), (4.0, 50.0, 'hertz'), (4.0, 100.0, 'hertz')]
    """
    shifts, loads = require_number_list(lateral_shifts_mm, "lateral_shifts_mm"), require_number_list(loads_N, "loads_N")
    yaws = _require_yaws_rad(case, yaws_mrad)
    if not (shifts and yaws and loads):
        raise InputError("table: give at least one lateral shift, one yaw and one load")
    map_rows_by_line = None if map_folder is None else _read_map_lines(Path(map_folder), case, yaws)
    accuracy = None if accuracy_percent is None else require_accuracy(accuracy_percent)

    case.creep.refuse_unheard()
    feature_columns = load_offers("TABLE_COLUMNS").values()
    # rows in the middle of a step are evaluated once, for its accuracy and for the errors of interpolation
    evaluated: dict[Line, Record] = {}

    def compute_rows(row_shifts: Sequence[float]) -> list[Record]:
        lines = iterate_table_rows(case, row_shifts, loads, yaws)
        count = len(row_shifts) * len(yaws) * len(loads)
        rows = []
        for line in report_progress(lines, count, progress, "strips and cheaper theories"):
            row = table_row(line)
            for make_columns in feature_columns:
                row |= make_columns(line)
            rows.append(row)
        evaluated.update((_line_key(row), row) for row in rows)
        return rows

    rows = compute_rows(shifts) if accuracy is None else refine_shifts(shifts, compute_rows, accuracy)
    if map_rows_by_line is not None:
        rows = [row | map_columns(map_rows_by_line.get(_line_key(row))) for row in rows]
    rows_by_line = {_read_line(row): row for row in rows}
    middles = list(_iterate_middles(list(rows_by_line)))
    for middle, corners in report_progress(middles, len(middles), progress, "strips between rows"):
        _add_interpolation_errors(case, middle, [rows_by_line[corner] for corner in corners], evaluated)
    return equalise_columns(rows)


def _require_yaws_rad(case: Case, yaws_mrad: Sequence[float] | None) -> list[float]:
    """Yaws of a table in rad; the yaw of the case if no yaws are given."""
    if yaws_mrad is None:
        return [case.yaw_rad]
    if case.yaw_rad != 0.0:
        raise InputError(
            f"yaw_rad is {case.yaw_rad:g}, and yaws_mrad is given too; give the yaw of the case or yaws_mrad, not both"
        )
    return [yaw_mrad / 1e3 for yaw_mrad in require_number_list(yaws_mrad, "yaws_mrad")]


def _read_map_lines(folder: Path, case: Case, yaws_rad: Sequence[float]) -> dict[Line, Mapping[str, str]]:
    """Rows of a stored map by their lines, at the common yaws."""
    # only a table with a map needs the modules of maps, whose import takes 40 ms
    from fecontact.runs.map_lookup import read_map_rows, read_map_yaws_rad

    table_yaws_mrad = [round(1e3 * yaw_rad, _KEY_DECIMALS) for yaw_rad in yaws_rad]
    common_yaws_rad = [
        yaw_rad for yaw_rad in read_map_yaws_rad(folder) if round(1e3 * yaw_rad, _KEY_DECIMALS) in table_yaws_mrad
    ]
    # a map without any yaw of the table is the map of another contact, and is refused
    return {
        _line_key({**row, "yaw_mrad": 1e3 * yaw_rad}): row
        for yaw_rad in common_yaws_rad or yaws_rad[:1]
        for row in read_map_rows(folder, replace(case, yaw_rad=yaw_rad))
    }


def _iterate_middles(lines: Sequence[Line]) -> Iterator[tuple[Line, list[Line]]]:
    """Yield the middles between neighbouring lines, each with the lines around it."""
    axes = [sorted(set(values)) for values in zip(*lines, strict=True)]
    intervals: list[list[tuple[float, ...]]] = [list(pairwise(values)) or [(values[0],)] for values in axes]
    for shifts, yaws, loads in product(*intervals):
        corners = list(product(shifts, yaws, loads))
        if len(corners) > 1:
            yield (sum(shifts) / len(shifts), sum(yaws) / len(yaws), sum(loads) / len(loads)), corners


def _add_interpolation_errors(
    case: Case, middle: Line, rows: Sequence[Record], evaluated: Mapping[Line, Record]
) -> None:
    """Add the error of interpolation at a middle to the rows around it.

    A row keeps the largest error of all its middles, in %. A middle that is evaluated is not evaluated again.
    """
    if not all("strip_approach_mm" in row for row in rows):
        return
    if (middle_row := evaluated.get(_round_line(middle))) is not None:
        strip_values = tuple(middle_row.get(name) for name in INTERPOLATION_ERROR_COLUMNS)
    else:
        strip_values = compute_strip_stiffness(_place_on_line(case, middle)) or (None, None)
    if None in strip_values:
        return
    for name, value in zip(INTERPOLATION_ERROR_COLUMNS, strip_values, strict=True):
        row_values = [row[name] for row in rows]
        deviation_percent = 1e2 * abs(sum(row_values) / len(row_values) / value - 1.0)
        for row in rows:
            row[INTERPOLATION_ERROR_COLUMNS[name]] = max(
                deviation_percent, row.get(INTERPOLATION_ERROR_COLUMNS[name], 0.0)
            )


def _place_on_line(case: Case, line: Line) -> Case:
    """Case with the shift, yaw and load of a line."""
    shift_mm, yaw_mrad, load_kN = line
    return replace(case, lateral_shift_mm=shift_mm, yaw_rad=yaw_mrad / 1e3, load_N=1e3 * load_kN)


def _read_line(row: Mapping[str, Any]) -> Line:
    """Line of a row."""
    shift_mm, yaw_mrad, load_kN = (float(row[name]) for name in TABLE_AXES)
    return shift_mm, yaw_mrad, load_kN


def _line_key(row: Mapping[str, Any]) -> Line:
    """Line of a row, rounded, as the key of rows of a map."""
    return _round_line(_read_line(row))


def _round_line(line: Line) -> Line:
    """Line with rounded values."""
    shift_mm, yaw_mrad, load_kN = (round(value, _KEY_DECIMALS) for value in line)
    return shift_mm, yaw_mrad, load_kN
