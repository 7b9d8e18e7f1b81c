"""Steps of the lateral shift in a contact table that interpolates with a given accuracy."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from fecontact.errors import InputError
from fecontact.outputs.flat_records import Record

SMALLEST_STEP_MM = 0.01
"""Steps of the lateral shift below twice this length are not halved."""
ACCURACY_RANGE_PERCENT = (0.1, 50.0)
"""Accuracies that a table can be asked for. The strip method has steps of some tenths of a percent."""
# A jump of a column within a step is half as large at the middle as at the place of the jump. So the error in the
# middle must be at most this fraction of the accuracy.
_MIDDLE_FRACTION = 0.5
# Columns with a zero or an offset that means nothing for a contact. Their errors are relative to their range over the
# table, and errors of all other columns are relative to the value.
_RANGE_COLUMNS = (
    *("roll_mrad", "_rail_y_mm", "_wheel_y_mm", "_contact_angle_rad", "_vertical_gap_mm", "_rolling_radius_mm"),
)
# The centre of pressure is relative to the half-width, as in the criteria of a verdict.
_CENTRE_COLUMN, _HALF_WIDTH_COLUMN = "strip_centre_mm", "strip_b_mm"
# Radii of curvature are infinite where a profile is straight, and have a step at each junction of arcs.
_UNCHECKED_COLUMNS = ("_rail_radius_mm", "_wheel_lateral_radius_mm", "_wheel_rolling_radius_mm")
_COORDINATES = ("lateral_shift_mm", "yaw_mrad", "load_kN")

ComputeRows = Callable[[Sequence[float]], list[Record]]
"""Function from lateral shifts in mm to their rows: by shift, then in an equal order of yaws and loads."""


@dataclass(frozen=True, kw_only=True)
class StepError:
    """Largest error of linear interpolation in the middle of a step.

    Attributes
    ----------
    percent
        Error in %; infinite if a column or a text is different on both sides.
    column
        Name of the column with the largest error; empty without an error.
    """

    percent: float
    column: str


def require_accuracy(accuracy_percent: float) -> float:
    """Return an accuracy in % if it is allowed.

    Parameters
    ----------
    accuracy_percent
        Accuracy in %.

    Returns
    -------
    float
        The accuracy.

    Raises
    ------
    InputError
        If it is not a number within the allowed range.
    """
    low, high = ACCURACY_RANGE_PERCENT
    try:
        accuracy = float(accuracy_percent)
    except (TypeError, ValueError):
        accuracy = math.nan
    if not low <= accuracy <= high:
        raise InputError(f"accuracy_percent is {accuracy_percent!r}; allowed: {low:g} to {high:g}, for example 2")
    return accuracy


def refine_shifts(shifts_mm: Sequence[float], compute_rows: ComputeRows, accuracy_percent: float) -> list[Record]:
    """Halve steps of the lateral shift until linear interpolation has an accuracy.

    Each step is checked in its middle. A step in which a column jumps is halved down to the smallest step.

    Parameters
    ----------
    shifts_mm
        Lateral shifts in mm, at least two.
    compute_rows
        Function that computes the rows of shifts.
    accuracy_percent
        Accuracy in %.

    Returns
    -------
    list of Record
        Rows by shift. `shift_step_mm` is the step to the next shift, and `shift_step_error_percent` the largest error
        in its middle, in `shift_step_error_column`. `shift_step_status` is `within accuracy` or `jump`.

    Raises
    ------
    InputError
        For fewer than two shifts.
    """
    shifts = sorted(set(shifts_mm))
    if len(shifts) < 2:
        raise InputError("accuracy_percent needs at least two lateral shifts, because it limits the step between them")
    rows_by_shift = dict(zip(shifts, _group_rows(compute_rows, shifts), strict=True))
    steps, ranges = list(pairwise(shifts)), None
    step_columns: dict[float, list[Record]] = {}
    while steps:
        middles = [round(0.5 * (left + right), 9) for left, right in steps]
        middle_rows = _group_rows(compute_rows, middles)
        if ranges is None:
            ranges = _find_ranges([*rows_by_shift.values(), *middle_rows])
        remaining_steps: list[tuple[float, float]] = []
        for (left, right), middle, rows in zip(steps, middles, middle_rows, strict=True):
            errors = [
                _find_error((left_row, row, right_row), column_ranges)
                for left_row, row, right_row, column_ranges in zip(
                    rows_by_shift[left], rows, rows_by_shift[right], ranges, strict=True
                )
            ]
            is_accurate = all(error.percent <= _MIDDLE_FRACTION * accuracy_percent for error in errors)
            if is_accurate or right - left < 2.0 * SMALLEST_STEP_MM:
                step_columns[left] = [_step_columns(right - left, error, accuracy_percent) for error in errors]
            else:
                rows_by_shift[middle] = rows
                remaining_steps += [(left, middle), (middle, right)]
        steps = remaining_steps
    # the last shift has no step
    return [
        row | columns
        for shift_mm, rows in sorted(rows_by_shift.items())
        for row, columns in zip(rows, step_columns.get(shift_mm, [{}] * len(rows)), strict=True)
    ]


def _group_rows(compute_rows: ComputeRows, shifts_mm: Sequence[float]) -> list[list[Record]]:
    """Rows of each shift."""
    rows = compute_rows(shifts_mm)
    count = len(rows) // len(shifts_mm)
    return [rows[start : start + count] for start in range(0, len(rows), count)]


def _step_columns(step_mm: float, error: StepError, accuracy_percent: float) -> Record:
    """Columns of a step at the row on its left side."""
    is_accurate = error.percent <= _MIDDLE_FRACTION * accuracy_percent
    return {
        "shift_step_mm": round(step_mm, 9),
        "shift_step_status": "within accuracy" if is_accurate else "jump",
        "shift_step_error_percent": error.percent if math.isfinite(error.percent) else None,
        "shift_step_error_column": error.column,
    }


def _find_ranges(rows_of_shifts: Sequence[Sequence[Record]]) -> list[dict[str, float]]:
    """Ranges of the columns over the shifts, for each yaw and load."""
    ranges = []
    for rows in zip(*rows_of_shifts, strict=True):
        numbers_by_column = {name: _read_numbers(rows, name) for name in _list_columns(rows)}
        ranges.append({name: max(numbers) - min(numbers) for name, numbers in numbers_by_column.items() if numbers})
    return ranges


def _list_columns(rows: Sequence[Record]) -> list[str]:
    """Columns of rows with a checked interpolation."""
    names = dict.fromkeys(name for row in rows for name in row)
    return [name for name in names if name not in _COORDINATES and not name.endswith(_UNCHECKED_COLUMNS)]


def _read_numbers(rows: Sequence[Record], name: str) -> list[float]:
    """Numbers of a column, without missing values and texts."""
    values = [row.get(name) for row in rows]
    return [float(value) for value in values if isinstance(value, (int, float)) and not isinstance(value, bool)]


def _find_error(rows: tuple[Record, Record, Record], ranges: Mapping[str, float]) -> StepError:
    """Largest error of linear interpolation in the middle of three rows."""
    worst = StepError(percent=0.0, column="")
    for name in _list_columns(rows):
        numbers = _read_numbers(rows, name)
        if not numbers:
            continue
        if len(numbers) < len(rows):
            return StepError(percent=math.inf, column=name)
        left, middle, right = numbers
        deviation = abs(0.5 * (left + right) - middle)
        if name == _CENTRE_COLUMN:
            scale = float(rows[1][_HALF_WIDTH_COLUMN])
        else:
            scale = ranges.get(name, 0.0) if name.endswith(_RANGE_COLUMNS) else abs(middle)
        percent = 100.0 * deviation / scale if scale > 0.0 else math.inf if deviation > 0.0 else 0.0
        if percent > worst.percent:
            worst = StepError(percent=percent, column=name)
    return worst
