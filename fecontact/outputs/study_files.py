"""Files of a whole study: tables, figure, and collections of its cases for ParaView."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from fecontact.outputs.files import write_json
from fecontact.outputs.record import versions
from fecontact.outputs.tables import write_csv

Row = dict[str, Any]


def write_tables(study: str, cases: int, rows: Sequence[Row], path: Path) -> None:
    """Write the rows of a study of so many cases to `path` with the endings .csv and .json."""
    write_csv(rows, path.with_name(f"{path.name}.csv"))
    record = {
        "schema": "fecontact/study/1",
        "study": study,
        "cases": cases,
        "rows": list(rows),
        "versions": versions(),
    }
    write_json(path.with_name(f"{path.name}.json"), record)


def study_figures(rows: Sequence[Row], out: Path) -> tuple[str, ...]:
    """Draw the figure of a study and write its collections; cases are in the folder `cases` below `out`.

    Returns the names of the collections.
    """
    from fecontact.outputs.figures import study_figure

    solved = [row for row in rows if row.get("p_max_fe_MPa") is not None]
    if solved:
        study_figure(list(rows), out / "study.png")
    return _write_collections(solved, out)


# What a collection has only one of; of the latter only where the cases would not be told apart by their shift.
_OWN = ("rail", "wheel", "load_kN")
_OWN_IF_NEEDED = ("inclination_rad", "yaw_mrad", "roll_mrad", "resolution")


def _write_collections(rows: Sequence[Row], out: Path) -> tuple[str, ...]:
    """A .pvd for each series of cases over the lateral shift: ParaView merges equal times, so two cannot share one.

    Left out are single cases beside others, and cases that differ in something else (such as their bodies' sizes).
    """
    from fecontact.outputs.vtk import write_pvd

    unique = list({row["id"]: row for row in rows}.values())
    series = list(_series(unique, "study", (*_OWN, *_OWN_IF_NEEDED)))
    written = []
    for name, own in series:
        shifts = {float(row["lateral_shift_mm"]): out / "cases" / str(row["id"]) for row in own}
        if len(shifts) == len(own) and (len(own) > 1 or len(series) == 1):
            written.append(write_pvd(out / f"{name}.pvd", sorted(shifts.items())).name)
    return tuple(written)


def _series(rows: Sequence[Row], name: str, columns: Sequence[str]) -> Iterator[tuple[str, list[Row]]]:
    """Rows that have the columns' values in common, by a name of what they do not share with others."""
    one_a_shift = len({row["lateral_shift_mm"] for row in rows}) == len(rows)
    if not columns or (columns[0] in _OWN_IF_NEEDED and one_a_shift):
        yield name, list(rows)
        return
    column, *others = columns
    values = list(dict.fromkeys(str(row[column]) for row in rows))
    for value in values:
        label = f"_{_label(column, value)}" if len(values) > 1 else ""
        yield from _series([row for row in rows if str(row[column]) == value], name + label, others)


def _label(column: str, value: str) -> str:
    quantity, _, unit = column.rpartition("_")
    if not quantity:
        text = Path(value).stem if column in ("rail", "wheel") else value
    else:
        text = f"{'' if unit == 'kN' else quantity}{float(value):.4g}{unit}"
    return "".join(c if c.isalnum() or c in ".-@" else "-" for c in text)
