"""Series of a study's cases over the lateral shift.

Each series is one curve of a figure and one collection for ParaView.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fecontact.outputs.pair_names import VARIED_COLUMN, RowMapping, short_name

# All cases of a series have equal values in the first columns. The optional columns separate series only if several
# cases would have equal shifts (the roll may follow from the shift).
_SERIES_COLUMNS = ("rail", "wheel", "load_kN")
_OPTIONAL_COLUMNS = (
    *("side", "roll", "inclination_rad", "yaw_mrad", "resolution"),
    *("roll_load_kN", "opposite_load_kN", "roll_mrad", VARIED_COLUMN),
)
# Values for rows without these columns: rows of single left wheels.
_DEFAULTS = {"side": "left", "roll": "given"}
_WORDS = {
    ("roll", "touching"): "both wheels touch",
    ("roll", "loaded"): "roll of the loaded wheelset",
    ("roll", "given"): "fixed roll",
}


@dataclass(frozen=True, kw_only=True)
class Series:
    """Cases that differ in their lateral shift, in the order of the shift.

    Attributes
    ----------
    rows
        Rows of the cases, sorted by shift.
    labels
        Values that distinguish the series from other series, by column.
    """

    rows: tuple[RowMapping, ...]
    labels: Mapping[str, str]

    @property
    def label(self) -> str:
        """Label of the series for a legend; empty for a single series."""
        return ", ".join(_column_words(column, value) for column, value in self.labels.items())

    @property
    def file_suffix(self) -> str:
        """Label of the series as part of a file name, with a separator before it."""
        suffixes = (f"_{_column_words(column, value).replace(' ', '')}" for column, value in self.labels.items())
        return "".join(
            character if character.isalnum() or character in "_.-@" else "-" for character in "".join(suffixes)
        )


def split_into_series(rows: Sequence[RowMapping]) -> tuple[Series, ...]:
    """Divide the rows of a study into series, in the order of their first cases."""
    return tuple(_split(rows, {}, (*_SERIES_COLUMNS, *_OPTIONAL_COLUMNS)))


def _split(rows: Sequence[RowMapping], labels: Mapping[str, str], columns: Sequence[str]) -> Iterator[Series]:
    """Divide rows by the first column that separates them, then by the other columns.

    Parameters
    ----------
    labels
        Values of the columns that separated the rows before, by column.
    """
    shifts_are_unique = len({row["lateral_shift_mm"] for row in rows}) == len(rows)
    if not columns or (columns[0] in _OPTIONAL_COLUMNS and shifts_are_unique):
        yield Series(rows=tuple(sorted(rows, key=lambda row: float(row["lateral_shift_mm"]))), labels=labels)
        return
    column, *further_columns = columns
    # a case that failed early has no value in some of the columns
    column_values = [str(row.get(column, _DEFAULTS.get(column, ""))) for row in rows]
    values = list(dict.fromkeys(column_values))
    for value in values:
        rows_of_value = [row for row, row_value in zip(rows, column_values, strict=True) if row_value == value]
        yield from _split(rows_of_value, {**labels, column: value} if len(values) > 1 else labels, further_columns)


def _column_words(column: str, value: str) -> str:
    """Words for the value of a column, such as "100 kN" or "roll 2 mrad"."""
    if column in ("rail", "wheel"):
        return short_name(value)
    if column == VARIED_COLUMN:
        return value
    if (column, value) in _WORDS:
        return _WORDS[column, value]
    quantity, _, unit = column.rpartition("_")
    words = quantity.replace("_", " ")
    if not quantity or not value:
        return value or f"no {column}"
    return f"{'' if quantity == 'load' else words + ' '}{float(value):.4g} {unit}"
