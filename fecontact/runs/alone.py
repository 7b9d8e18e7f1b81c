"""Theories alone and contact tables, without finite elements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.inputs.texts import require_number_list
from fecontact.jobs.remaining import Progress, report_progress
from fecontact.outputs.alone import INTERPOLATION_ERROR_COLUMNS, equalise_columns, map_columns, table_row
from fecontact.outputs.records.results import hertz_record
from fecontact.outputs.theory_alone import check_theory, list_theories, theory_record
from fecontact.runs.map_lookup import read_map_rows
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


# --- Contact tables for vehicle codes: lines over shift and load, with the verdicts of a stored map if it has them.

Line = tuple[float, float]
# Decimals to which shifts (mm) and loads (kN) are compared.
_KEY_DECIMALS = 6


def table(
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    *,
    map_folder: str | Path | None = None,
    progress: Progress | None = None,
) -> list[Record]:
    """Compute a contact table over lateral shift and load, without a solution.

    Parameters
    ----------
    case
        Everything except lateral shift and load; its criteria limit the deviation of a cheap theory from the strips.
    lateral_shifts_mm
        Lateral shifts of the wheelset, in mm.
    loads_N
        Wheel loads, in N.
    map_folder
        Folder of a map that `fecontact map` wrote for this pair: columns `map_*` have its verdicts at its shifts and
        loads.
    progress
        Receives the progress as for `run`, with lines in place of cases.

    Returns
    -------
    list of dict
        Flat dictionaries with units in their keys, a dictionary per shift and load. `strip_approach_between_percent`
        and `strip_stiffness_between_percent` are the errors of linear interpolation to the neighbouring shifts and
        loads, compared with the strips in the middle between them. A position without contact is a row with its
        `problem`.

    Raises
    ------
    InputError
        Without shifts and loads, or for a map of another pair.

    Examples
    --------
    >>> import fecontact
    >>> rows = fecontact.table(fecontact.Case(roll="touching"), [0.0, 4.0], [50e3, 100e3])
    >>> [(row["lateral_shift_mm"], row["load_kN"], row["cheapest_theory"]) for row in rows]
    [(0.0, 50.0, 'strip'), (0.0, 100.0, 'strip'), (4.0, 50.0, 'hertz'), (4.0, 100.0, 'hertz')]
    """
    shifts, loads = require_number_list(lateral_shifts_mm, "lateral_shifts_mm"), require_number_list(loads_N, "loads_N")
    if not shifts or not loads:
        raise InputError("table: give at least one lateral shift and one load")
    map_rows_by_line = (
        None if map_folder is None else {_line_key(row): row for row in read_map_rows(Path(map_folder), case)}
    )
    rows = []
    lines = iterate_table_rows(case, shifts, loads)
    for line in report_progress(lines, len(shifts) * len(loads), progress, "strips and cheaper theories"):
        row = table_row(line)
        if map_rows_by_line is not None:
            row |= map_columns(map_rows_by_line.get(_line_key(row)))
        rows.append(row)
    rows_by_line = {(float(row["lateral_shift_mm"]), float(row["load_kN"])): row for row in rows}
    middles = list(_iterate_middles(shifts, [load_N / 1e3 for load_N in loads]))
    for middle, corners in report_progress(middles, len(middles), progress, "strips between rows"):
        _add_interpolation_errors(case, middle, [rows_by_line[corner] for corner in corners])
    return equalise_columns(rows)


def _iterate_middles(shifts: Sequence[float], loads_kN: Sequence[float]) -> Iterator[tuple[Line, list[Line]]]:
    """Yield the middles between neighbouring lines, each with the lines around it.

    A middle is a shift in mm and a load in kN.
    """
    axes = [sorted(set(values)) for values in (shifts, loads_kN)]
    intervals: list[list[tuple[float, ...]]] = [list(pairwise(values)) or [(values[0],)] for values in axes]
    for shift_interval, load_interval in product(*intervals):
        if len(shift_interval) + len(load_interval) > 2:
            yield (
                (sum(shift_interval) / len(shift_interval), sum(load_interval) / len(load_interval)),
                list(product(shift_interval, load_interval)),
            )


def _add_interpolation_errors(case: Case, middle: Line, rows: Sequence[Record]) -> None:
    """Add the error of interpolation at a middle to the rows around it.

    A row keeps the largest error of all its middles, in %.
    """
    strip_values = compute_strip_stiffness(replace(case, lateral_shift_mm=middle[0], load_N=1e3 * middle[1]))
    if strip_values is None or not all("strip_approach_mm" in row for row in rows):
        return
    for name, value in zip(INTERPOLATION_ERROR_COLUMNS, strip_values, strict=True):
        row_values = [row[name] for row in rows]
        deviation_percent = 1e2 * abs(sum(row_values) / len(row_values) / value - 1.0)
        for row in rows:
            row[INTERPOLATION_ERROR_COLUMNS[name]] = max(
                deviation_percent, row.get(INTERPOLATION_ERROR_COLUMNS[name], 0.0)
            )


def _line_key(row: Mapping[str, Any]) -> tuple[float, float]:
    """Key of a row: lateral shift in mm and load in kN, rounded."""
    return round(float(row["lateral_shift_mm"]), _KEY_DECIMALS), round(float(row["load_kN"]), _KEY_DECIMALS)
