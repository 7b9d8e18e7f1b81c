"""Words for jumps in a contact table over the lateral shift."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from fecontact.inputs.texts import count_text
from fecontact.outputs.tables import TableRecord

_MOST_INTERVALS = 20
# The first contact point moves by up to 30 mm per mm of shift where the arcs of wheel and rail have nearly equal radii.
# The steps of jumps are shorter than 0.02 mm, so that more than 1 mm is not continuous.
_CONTACT_POINT_JUMP_MM = 1.0
_SAME_SHIFT_MM = 1e-9
# Columns with the number of contact points and of patches, and the beginnings of the columns of each of them.
_COUNTS = {
    "contact_points": ("touch", "number of contact points"),
    "strip_patches": ("patch", "number of patches of the strip method"),
}


@dataclass(frozen=True, kw_only=True)
class JumpInterval:
    """Adjacent steps of the shift with the status `jump`, at equal yaw.

    Attributes
    ----------
    start_mm, end_mm
        Lateral shifts between which the table must not be interpolated.
    yaw_mrad
        Yaw of the rows.
    steps
        Rows on both sides of each step.
    """

    start_mm: float
    end_mm: float
    yaw_mrad: float
    steps: tuple[tuple[TableRecord, TableRecord], ...]

    @property
    def largest_error_percent(self) -> float:
        """Largest stated error of its steps; 0 if no step has a number."""
        return max((left["shift_step_error_percent"] or 0.0 for left, _ in self.steps), default=0.0)

    @property
    def phrases(self) -> list[str]:
        """Descriptions of the changes, the most important change first."""
        phrases = [*self._describe_contact_points(), *self._describe_counts(), *self._describe_columns()]
        return list(dict.fromkeys(phrases))

    def _describe_contact_points(self) -> Iterator[str]:
        """Describe the largest jump of the first contact point."""
        name = "touch1_rail_y_mm"
        moves_mm = [abs(right[name] - left[name]) for left, right in self.steps if left.get(name) and right.get(name)]
        if max(moves_mm, default=0.0) > _CONTACT_POINT_JUMP_MM:
            yield f"contact point jumps by {max(moves_mm):.1f} mm"

    def _describe_counts(self) -> Iterator[str]:
        """Describe changes of the numbers of contact points and patches."""
        for column, (_, words) in _COUNTS.items():
            changes = dict.fromkeys(
                (left[column], right[column])
                for left, right in self.steps
                if left.get(column) is not None and right.get(column) is not None and left[column] != right[column]
            )
            if changes:
                yield f"{words} changes " + ", ".join(f"from {before:.0f} to {after:.0f}" for before, after in changes)

    def _describe_columns(self) -> Iterator[str]:
        """Describe missing columns and the largest error."""
        changing = [
            beginning
            for column, (beginning, _) in _COUNTS.items()
            if any(left.get(column) != right.get(column) for left, right in self.steps)
        ]
        for left, right in self.steps:
            name = left["shift_step_error_column"]
            if left["shift_step_error_percent"] is None and not name.startswith(tuple(changing)):
                is_missing = (left.get(name) is None) != (right.get(name) is None)
                yield f"{name} {'is missing on one side' if is_missing else 'jumps'}"
        worst, _ = max(self.steps, key=lambda step: step[0]["shift_step_error_percent"] or 0.0)
        if self.largest_error_percent:
            yield f"{worst['shift_step_error_column']} is off by up to {self.largest_error_percent:.2g} %"

    @property
    def words(self) -> str:
        """Sentence with the interval, the loads and the changes."""
        loads_kN = sorted({left["load_kN"] for left, _ in self.steps})
        loads = (
            " and ".join(f"{load:g}" for load in loads_kN)
            if len(loads_kN) < 3
            else f"{len(loads_kN)} loads from {loads_kN[0]:g} to {loads_kN[-1]:g}"
        )
        yaw = f", yaw {self.yaw_mrad:+g} mrad" if self.yaw_mrad else ""
        return f"between {self.start_mm:+z.3f} and {self.end_mm:+z.3f} mm{yaw} ({loads} kN): {'; '.join(self.phrases)}"


def list_jump_intervals(rows: Sequence[TableRecord]) -> list[JumpInterval]:
    """List the intervals of a contact table with jumps; adjacent steps are joined, over all loads of a yaw.

    Parameters
    ----------
    rows
        Rows of a contact table with an accuracy.

    Returns
    -------
    list of JumpInterval
        Intervals by yaw, then by shift.
    """
    lines: dict[tuple[float, float], list[TableRecord]] = {}
    for row in rows if any(row.get("shift_step_status") == "jump" for row in rows) else ():
        lines.setdefault((row["yaw_mrad"], row["load_kN"]), []).append(row)
    steps = [
        (left, right)
        for line_rows in lines.values()
        for left, right in pairwise(sorted(line_rows, key=lambda row: float(row["lateral_shift_mm"])))
        if left.get("shift_step_status") == "jump"
    ]
    steps.sort(key=lambda step: (step[0]["yaw_mrad"], step[0]["lateral_shift_mm"]))
    intervals: list[JumpInterval] = []
    for left, right in steps:
        start, end, yaw = left["lateral_shift_mm"], right["lateral_shift_mm"], left["yaw_mrad"]
        joined: tuple[tuple[TableRecord, TableRecord], ...] = ((left, right),)
        if intervals and intervals[-1].yaw_mrad == yaw and start <= intervals[-1].end_mm + _SAME_SHIFT_MM:
            previous = intervals.pop()
            start, end, joined = previous.start_mm, max(previous.end_mm, end), (*previous.steps, *joined)
        intervals.append(JumpInterval(start_mm=start, end_mm=end, yaw_mrad=yaw, steps=joined))
    return intervals


def describe_jumps(rows: Sequence[TableRecord], stored: str) -> Iterator[str]:
    """Yield sentences on the intervals with jumps, at most 20.

    Parameters
    ----------
    rows
        Rows of a contact table with an accuracy.
    stored
        Place of the whole table, in words.

    Yields
    ------
    str
        Sentences by shift. Of more than 20 intervals those with changes of contact points, patches or the place of the
        contact are shown first, then those with the largest errors.
    """
    intervals = list_jump_intervals(rows)
    if not intervals:
        return
    step_count = sum(len(interval.steps) for interval in intervals)
    yield (
        f"do not interpolate in {count_text(len(intervals), 'interval')} of the shift, where the accuracy cannot be"
        f" reached; their {count_text(step_count, 'step')} have the shift_step_status jump in {stored}"
    )
    ordered = sorted(intervals, key=lambda interval: (len(interval.phrases) < 2, -interval.largest_error_percent))
    shown_intervals = ordered[:_MOST_INTERVALS]
    yield from (f"  {interval.words}" for interval in intervals if interval in shown_intervals)
    if len(intervals) > len(shown_intervals):
        yield f"  and {count_text(len(intervals) - len(shown_intervals), 'further interval')}"
