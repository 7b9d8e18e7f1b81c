"""Series of a study's cases over the lateral shift: one curve of a figure, and one collection for ParaView each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fecontact.outputs.pair_names import VARIED, Row, short_name

# A series has one of each; of the latter only where its cases would not be told apart by their shift (the roll may
# follow from it).
_OWN = ("rail", "wheel", "load_kN")
_OWN_IF_NEEDED = (
    *("side", "roll", "inclination_rad", "yaw_mrad", "resolution"),
    *("roll_load_kN", "opposite_load_kN", "roll_mrad", VARIED),
)
# Rows of single left wheels have neither column.
_ABSENT = {"side": "left", "roll": "given"}
_WORDS = {
    ("roll", "touching"): "both wheels touch",
    ("roll", "loaded"): "roll of the loaded wheelset",
    ("roll", "given"): "fixed roll",
}


@dataclass(frozen=True, kw_only=True)
class Series:
    """Cases that differ in their lateral shift, sorted by it, and the values that set them apart from other series."""

    rows: tuple[Row, ...]
    own: Mapping[str, str]

    @property
    def label(self) -> str:
        """What tells it from the other series, for a legend; empty if there is none."""
        return ", ".join(_words(column, value) for column, value in self.own.items())

    @property
    def file_suffix(self) -> str:
        """The same for the name of a file, with a separator before it."""
        words = (f"_{_words(column, value).replace(' ', '')}" for column, value in self.own.items())
        return "".join(c if c.isalnum() or c in "_.-@" else "-" for c in "".join(words))


def series(rows: Sequence[Row]) -> tuple[Series, ...]:
    """All series of a study, in the order of their first cases."""
    return tuple(_split(rows, {}, (*_OWN, *_OWN_IF_NEEDED)))


def _split(rows: Sequence[Row], own: Mapping[str, str], columns: Sequence[str]) -> Iterator[Series]:
    one_a_shift = len({row["lateral_shift_mm"] for row in rows}) == len(rows)
    if not columns or (columns[0] in _OWN_IF_NEEDED and one_a_shift):
        yield Series(rows=tuple(sorted(rows, key=lambda row: float(row["lateral_shift_mm"]))), own=own)
        return
    column, *others = columns
    # a case that failed early has no value for some of them
    each = [str(row.get(column, _ABSENT.get(column, ""))) for row in rows]
    values = list(dict.fromkeys(each))
    for value in values:
        mine = [row for row, its in zip(rows, each, strict=True) if its == value]
        yield from _split(mine, {**own, column: value} if len(values) > 1 else own, others)


def _words(column: str, value: str) -> str:
    if column in ("rail", "wheel"):
        return short_name(value)
    if column == VARIED:
        return value
    if (column, value) in _WORDS:
        return _WORDS[column, value]
    quantity, _, unit = column.rpartition("_")
    words = quantity.replace("_", " ")
    if not quantity or not value:
        return value or f"no {column}"
    return f"{'' if quantity == 'load' else words + ' '}{float(value):.4g} {unit}"
