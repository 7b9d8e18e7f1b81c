"""Tables of rows: CSV for other programs, and the table of cases on the terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.comparison.theories import EITHER_SIDE, THEORIES
from fecontact.files import write_text
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.roll_words import roll_words_of_rows
from fecontact.outputs.terminal import missing, print_fitting, say, standard_console, titled_table
from fecontact.outputs.theories import theory_texts

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Record = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class _Column:
    """A column of the table of cases: heading, key of its values and their format.

    Where there is no room, columns with a `name` are left out, those of the lowest `rank` first, and named.
    """

    heading: str
    key: str
    form: str
    rank: int = 0
    name: str = ""

    @property
    def left(self) -> bool:
        return "verdict" in self.key


# Deviations are Hertz minus finite elements.
_COLUMNS = (
    _Column(heading="shift\nmm", key="lateral_shift_mm", form="{:+z.2f}"),
    _Column(heading="load\nkN", key="load_kN", form="{:g}"),
    _Column(heading="p_max\nFE MPa", key="p_max_fe_MPa", form="{:.0f}", rank=5, name="p_max in MPa"),
    _Column(heading="p_max\ndev %", key="p_max_deviation_percent", form="{:+z.1f}"),
    _Column(heading="\n± %", key="p_max_uncertainty_percent", form="{:.1f}", rank=3, name="± of p_max"),
    _Column(heading="area\ndev %", key="area_deviation_percent", form="{:+z.1f}", rank=9, name="area"),
    _Column(heading="a\ndev %", key="a_deviation_percent", form="{:+z.1f}", rank=4, name="a"),
    _Column(heading="b\ndev %", key="b_deviation_percent", form="{:+z.1f}", rank=8, name="b"),
    _Column(heading="centre\nin b", key="centre_over_b", form="{:+z.2f}", rank=7, name="centre"),
    _Column(heading="valley\n%", key="valley_percent", form="{:z.1f}", rank=6, name="valley"),
    _Column(heading="mispl.\n%", key="misplaced_load_percent", form="{:z.1f}", rank=10, name="misplaced"),
    _Column(heading="verdict", key="verdict", form="{}"),
    _Column(heading="fails by", key="verdict_failing", form="{}"),
    _Column(heading="meshes", key="meshes", form="{}", rank=2, name="meshes"),
    _Column(heading="time\ns", key="seconds", form="{:.0f}", rank=1, name="time"),
)
# The verdicts of theories but Hertz stand before the last ones.
_AFTER_THEORIES = 2
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def write_csv(rows: Iterable[Record], path: str | Path) -> Path:
    """Write rows as CSV: the columns in the order in which they first occur, missing values and NaN empty."""
    rows = list(rows)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    table = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    table.writeheader()
    table.writerows({key: None if missing(value) else value for key, value in row.items()} for row in rows)
    return write_text(path, text.getvalue())


def print_table(rows: Sequence[Record], *, console: Console | None = None) -> None:
    """Print one line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    console = console or standard_console()
    groups: dict[str, list[Record]] = {}
    for row in rows:
        groups.setdefault(_pair_text(row), []).append(row)
    if len(groups) > _MOST_TABLES:
        _print_rows(rows, "", console, with_pair=True)
    else:
        for pair, own in groups.items():
            _print_rows(own, "; ".join(filter(None, (pair, roll_words_of_rows(own)))), console)
    if any(row["status"] == "converged" for row in rows):
        say(console, _KEY)
    for row in rows:
        pair = f"{_pair_text(row)}, " if len(groups) > 1 else ""
        where = f"{pair}{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN"
        if row["status"] != "converged":
            console.print(f"{where}: {row['status']}", markup=False, highlight=False)
            continue
        if row.get("verdict_cause"):
            console.print(f"{where}: {row['verdict']}: {row['verdict_cause']}", markup=False, highlight=False)
        for text in theory_texts(row):
            say(console, f"{where}: {text}")


_KEY = "dev %: what Hertz is off; valley: between lobes; mispl.: load elsewhere"
# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6


def _theory_columns(rows: Sequence[Record]) -> list[_Column]:
    """Columns of the theories but Hertz of which any row has a verdict."""
    found = (name for name in THEORIES if name not in EITHER_SIDE and any(row.get(f"{name}_verdict") for row in rows))
    return [_Column(heading=name.replace("_", " "), key=f"{name}_verdict", form="{}", name=name) for name in found]


def _print_rows(rows: Sequence[Record], title: str, console: Console, *, with_pair: bool = False) -> None:
    """Print a table with the columns that find room, and name those that do not."""
    every = [*_COLUMNS[:-_AFTER_THEORIES], *_theory_columns(rows), *_COLUMNS[-_AFTER_THEORIES:]]
    by_rank = sorted((column for column in every if column.name), key=lambda column: column.rank)
    # the list of measures shrinks first, then columns go
    attempts = [(0, width) for width in _FAILING_WIDTHS]
    attempts += [(count, _FAILING_WIDTHS[-1]) for count in range(1, len(by_rank) + 1)]

    def tables() -> Iterator[tuple[Table, list[str]]]:
        for count, failing_width in attempts:
            left_out = [column.name for column in by_rank[:count]]
            columns = [column for column in every if not column.name or column.name not in left_out]
            yield _rows_table(rows, columns, failing_width, title, console, with_pair=with_pair), left_out

    print_fitting(console, tables())


def _rows_table(
    rows: Sequence[Record],
    columns: Sequence[_Column],
    failing_width: int,
    title: str,
    console: Console,
    *,
    with_pair: bool,
) -> Table:
    table = titled_table(console, title=title)
    if with_pair:
        table.add_column("rail, wheel", no_wrap=True)
    for column in columns:
        table.add_column(column.heading, justify="left" if column.left else "right", no_wrap=True)
    for row in rows:
        pair = [_pair_text(row)] if with_pair else []
        table.add_row(*pair, *(_cell(row, column, failing_width) for column in columns), style=_row_style(row))
    return table


def _pair_text(row: Record) -> str:
    inclination = float(row.get("inclination_rad") or 0.0)
    inclined = f" 1:{1.0 / math.tan(inclination):.3g}" if inclination else ""
    return f"rail {row['rail']}{inclined}, wheel {row['wheel']}"


def _cell(row: Record, column: _Column, failing_width: int) -> str:
    value = row.get(column.key)
    if column.key == "verdict" and row["status"] != "converged":
        # what must not be used has no verdict
        status = str(row["status"])
        return "no result" if status.startswith("failed") else _SHORT_STATUS.get(status, status)
    if column.key == "verdict_failing":
        return _failing(str(value or "").split(), row.get("verdict_measure"), failing_width)
    return "-" if missing(value) else column.form.format(value)


_SHORT_STATUS = {"patch at the edge of the fine mesh": "at edge", "not converged": "not conv."}


def _failing(measures: Sequence[str], decided: str | None, width: int) -> str:
    """Short names of the measures that fail, the one that decided first; those that find no room are counted."""
    names = [WORDS[measure].short for measure in sorted(measures, key=lambda measure: measure != decided)]
    for shown in range(len(names), 0, -1):
        more = [f"+{len(names) - shown}"] if shown < len(names) else []
        text = " ".join((*names[:shown], *more))
        if len(text) <= width:
            return text
    return ""


def _row_style(row: Record) -> str:
    return "" if row["status"] == "converged" else "red"
