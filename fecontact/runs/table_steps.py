"""Steps of the lateral shift in a contact table that interpolates with a given accuracy."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from fecontact.errors import InputError
from fecontact.outputs.flat_records import Record

SMALLEST_STEP_MM = 0.01
"""Steps of the lateral shift below twice this length are not halved."""
ACCURACY_RANGE_PERCENT = (0.1, 50.0)
"""Accuracies that a table can be asked for. The strip method has steps of some tenths of a percent."""
# Steps are checked in their middle and at their quarters: with the middle alone, 1 of 42 random shifts of S1002 on 60E1
# had 2.7 % instead of 2 %, because the stiffness of the strips scatters. A jump of a column is half as large in the
# middle of its step as at the place of the jump. So the error must be at most this fraction of the accuracy.
# Steps are checked at shifts that are at most this far apart: two contact points may exist on 0.15 mm only.
_LARGEST_DISTANCE_MM = 0.125
_CHECKED_FRACTION = 0.5
# Columns with a zero or an offset that means nothing for a contact. Their errors are relative to their range over the
# table, and errors of all other columns are relative to the value.
_RANGE_COLUMNS = (
    *("roll_mrad", "_rail_y_mm", "_wheel_y_mm", "_contact_angle_rad", "_vertical_gap_mm", "_rolling_radius_mm"),
    *("creep_xi", "creep_eta", "creep_spin_per_mm", "_creep_fx_N", "_creep_fy_N", "_creep_mz_Nmm", "_t_gamma_N"),
)
# Patches and contact points have numbers. All numbers have a common range, because a patch that vanishes has only a few
# rows; and an error of a small patch is relative to the largest patch of the row, because its value goes to zero.
_NUMBERED = re.compile(r"(patch|touch)\d+_")
# Deviations below are rounding errors, in the unit of each column.
_ROUNDING = 1e-9
# The centre of pressure is relative to the half-width, as in the criteria of a verdict.
_CENTRE_COLUMN, _HALF_WIDTH_COLUMN = "strip_centre_mm", "strip_b_mm"
# Radii of curvature are infinite where a profile is straight, and have a step at each junction of arcs.
_UNCHECKED_COLUMNS = ("_rail_radius_mm", "_wheel_lateral_radius_mm", "_wheel_rolling_radius_mm")
_COORDINATES = ("lateral_shift_mm", "yaw_mrad", "load_kN")

ComputeRows = Callable[[Sequence[float]], list[Record]]
"""Function from lateral shifts in mm to their rows: by shift, then in an equal order of yaws and loads."""


@dataclass(frozen=True, kw_only=True)
class StepError:
    """Largest error of linear interpolation at the checked shifts of a step.

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

    Each step is checked in its middle, at its quarters, and at shifts that are at most 0.125 mm apart. A step in which
    a column jumps is halved down to the smallest step.

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
        Rows by shift. `shift_step_mm` is the step to the next shift, and `shift_step_error_percent` its largest error,
        in `shift_step_error_column`. `shift_step_status` is `within accuracy` or `jump`.

    Raises
    ------
    InputError
        For fewer than two shifts.
    """
    shifts = sorted(set(shifts_mm))
    if len(shifts) < 2:
        raise InputError("accuracy_percent needs at least two lateral shifts, because it limits the step between them")
    table = _EvaluatedRows(compute_rows=compute_rows)
    table.evaluate(shifts)
    steps = list(pairwise(shifts))
    step_columns: dict[float, list[Record]] = {}
    while steps:
        errors_by_step: dict[Step, list[StepError]] = {}
        halved_steps: list[Step] = []
        # further shifts of a step that fails in its middle are checked shifts of its halves, for the next round
        for list_fractions in (lambda step: [0.5], _list_fractions):
            table.evaluate([_divide(step, fraction) for step in steps for fraction in list_fractions(step)])
            ranges = _find_ranges(list(table.rows_by_shift.values()))
            errors_by_step |= {step: table.find_errors(step, list_fractions(step), ranges) for step in steps}
            failed_steps = [step for step in steps if not _are_accurate(errors_by_step[step], accuracy_percent)]
            halved_steps += [step for step in failed_steps if step[1] - step[0] >= 2.0 * SMALLEST_STEP_MM]
            steps = [step for step in steps if step not in failed_steps]
        for step, errors in errors_by_step.items():
            if step not in halved_steps:
                step_columns[step[0]] = [_step_columns(step[1] - step[0], error, accuracy_percent) for error in errors]
        steps = sorted(half for step in halved_steps for half in pairwise((step[0], _divide(step, 0.5), step[1])))
    # the last shift has no step
    return [
        row | columns
        for shift_mm, rows in sorted(table.rows_by_shift.items())
        if shift_mm in step_columns or shift_mm == shifts[-1]
        for row, columns in zip(rows, step_columns.get(shift_mm, [{}] * len(rows)), strict=True)
    ]


Step = tuple[float, float]
"""Lateral shifts in mm on both sides of a step."""


def _divide(step: Step, fraction: float) -> float:
    """Shift at a fraction of a step."""
    left, right = step
    return round((1.0 - fraction) * left + fraction * right, 9)


def _list_fractions(step: Step) -> list[float]:
    """Fractions of a step at which its interpolation is checked: multiples of a power of 1/2."""
    count = 4
    while step[1] - step[0] > count * _LARGEST_DISTANCE_MM:
        count *= 2
    return [number / count for number in range(1, count)]


@dataclass(frozen=True, kw_only=True, eq=False)
class _EvaluatedRows:
    """Rows by shift, each evaluated once."""

    compute_rows: ComputeRows
    rows_by_shift: dict[float, list[Record]] = field(default_factory=dict)

    def evaluate(self, shifts_mm: Sequence[float]) -> None:
        """Evaluate the shifts that are not evaluated."""
        if new_shifts := [shift for shift in dict.fromkeys(shifts_mm) if shift not in self.rows_by_shift]:
            self.rows_by_shift.update(zip(new_shifts, _group_rows(self.compute_rows, new_shifts), strict=True))

    def find_errors(
        self, step: Step, fractions: Sequence[float], ranges: Sequence[Mapping[str, float]]
    ) -> list[StepError]:
        """Largest errors of linear interpolation in a step, for each yaw and load."""
        left_rows, right_rows = (self.rows_by_shift[shift] for shift in step)
        checked_rows = {fraction: self.rows_by_shift[_divide(step, fraction)] for fraction in fractions}
        return [
            max(
                (
                    _find_error((left, rows[number], right), ranges[number], fraction)
                    for fraction, rows in checked_rows.items()
                ),
                key=lambda error: error.percent,
            )
            for number, (left, right) in enumerate(zip(left_rows, right_rows, strict=True))
        ]


def _are_accurate(errors: Sequence[StepError], accuracy_percent: float) -> bool:
    """Whether the errors of a step are within the accuracy."""
    return all(error.percent <= _CHECKED_FRACTION * accuracy_percent for error in errors)


def _group_rows(compute_rows: ComputeRows, shifts_mm: Sequence[float]) -> list[list[Record]]:
    """Rows of each shift."""
    rows = compute_rows(shifts_mm)
    count = len(rows) // len(shifts_mm)
    return [rows[start : start + count] for start in range(0, len(rows), count)]


def _step_columns(step_mm: float, error: StepError, accuracy_percent: float) -> Record:
    """Columns of a step at the row on its left side."""
    return {
        "shift_step_mm": round(step_mm, 9),
        "shift_step_status": "within accuracy" if _are_accurate([error], accuracy_percent) else "jump",
        "shift_step_error_percent": error.percent if math.isfinite(error.percent) else None,
        "shift_step_error_column": error.column,
    }


def _find_ranges(rows_of_shifts: Sequence[Sequence[Record]]) -> list[dict[str, float]]:
    """Ranges of the columns over the shifts, for each yaw and load.

    Columns that differ in the number of a patch or a contact point have a common range.
    """
    ranges = []
    for rows in zip(*rows_of_shifts, strict=True):
        numbers: dict[str, list[float]] = {}
        for name in _list_columns(rows):
            if name.endswith(_RANGE_COLUMNS):
                numbers.setdefault(_remove_number(name), []).extend(_read_numbers(rows, name))
        ranges.append({name: max(values) - min(values) for name, values in numbers.items() if values})
    return ranges


def _remove_number(name: str) -> str:
    """Name of a column without the number of its patch or contact point."""
    return _NUMBERED.sub(r"\1_", name)


def _list_columns(rows: Sequence[Record]) -> list[str]:
    """Columns of rows with a checked interpolation."""
    names = dict.fromkeys(name for row in rows for name in row)
    return [name for name in names if name not in _COORDINATES and not name.endswith(_UNCHECKED_COLUMNS)]


def _read_numbers(rows: Sequence[Record], name: str) -> list[float]:
    """Numbers of a column, without missing values and texts."""
    values = [row.get(name) for row in rows]
    return [float(value) for value in values if isinstance(value, (int, float)) and not isinstance(value, bool)]


def _find_error(rows: tuple[Record, Record, Record], ranges: Mapping[str, float], fraction: float) -> StepError:
    """Largest error of linear interpolation in the second of three rows."""
    worst = StepError(percent=0.0, column="")
    for name in _list_columns(rows):
        numbers = _read_numbers(rows, name)
        if not numbers:
            continue
        if len(numbers) < len(rows):
            return StepError(percent=math.inf, column=name)
        left, middle, right = numbers
        deviation = abs((1.0 - fraction) * left + fraction * right - middle)
        if deviation <= _ROUNDING:
            continue
        scale = _find_scale(name, rows[1], ranges)
        percent = 100.0 * deviation / scale if scale > 0.0 else math.inf
        if percent > worst.percent:
            worst = StepError(percent=percent, column=name)
    return worst


def _find_scale(name: str, row: Record, ranges: Mapping[str, float]) -> float:
    """Value to which the error of a column is relative."""
    if name == _CENTRE_COLUMN:
        return float(row[_HALF_WIDTH_COLUMN])
    if name.endswith(_RANGE_COLUMNS):
        return ranges.get(_remove_number(name), 0.0)
    unnumbered = _remove_number(name)
    if unnumbered == name:
        return abs(float(row[name]))
    values = (_read_numbers([row], column) for column in row if _remove_number(column) == unnumbered)
    return max(abs(value) for numbers in values for value in numbers)
