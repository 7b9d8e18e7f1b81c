"""Files of a whole study: tables, figures, and collections of its cases for ParaView."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fecontact.criteria import Criteria
from fecontact.files import write_sealed
from fecontact.outputs.pair_names import Row
from fecontact.outputs.records.results import versions
from fecontact.outputs.series import series
from fecontact.outputs.tables import write_csv
from fecontact.profiles.curve import Profile

STUDY_SCHEMA = "fecontact/study/3"


def write_tables(study: str, cases: int, rows: Sequence[Row], path: Path) -> None:
    """Write the rows of a study of so many cases to `path` with the endings .csv and .json."""
    write_csv(rows, path.with_name(f"{path.name}.csv"))
    record = {
        "schema": STUDY_SCHEMA,
        "study": study,
        "cases": cases,
        "rows": list(rows),
        "versions": versions(),
    }
    write_sealed(path.with_name(f"{path.name}.json"), record, [path.with_name(f"{path.name}.csv")])


def study_figures(
    rows: Sequence[Row], out: Path, rail: Profile | None = None, criteria: Criteria | None = None
) -> tuple[str, ...]:
    """Draw the figure of a study and write its collections; cases are in the folder `cases` below `out`.

    The junctions of `rail` are drawn where it is the only one, and the limits of `criteria` where they are.

    Returns the names of the collections.
    """
    from fecontact.outputs.figures.study import study_figure

    solved = [row for row in rows if row.get("fe_p_max_MPa") is not None]
    if solved:
        study_figure(list(rows), out / "study.png", rail, criteria)
    return _write_collections(solved, out)


def _write_collections(rows: Sequence[Row], out: Path) -> tuple[str, ...]:
    """A .pvd for each series of cases over the lateral shift: ParaView merges equal times, so two cannot share one.

    Left out are single cases beside others, and cases that differ in something else (such as their bodies' sizes).
    """
    from fecontact.outputs.paraview.vtk import write_pvd

    unique = list({row["id"]: row for row in rows}.values())
    found = series(unique)
    written: list[str] = []
    for one in found:
        shifts = {float(row["lateral_shift_mm"]): out / "cases" / str(row["id"]) for row in one.rows}
        if len(shifts) == len(one.rows) and (len(shifts) > 1 or len(found) == 1):
            name = f"study{one.file_suffix}"
            # profile files of the same name in two folders
            same = sum(other.startswith(f"{name}.") for other in written)
            path = out / (f"{name}.{same + 1}.pvd" if same else f"{name}.pvd")
            written.append(write_pvd(path, shifts.items()).name)
    return tuple(written)
