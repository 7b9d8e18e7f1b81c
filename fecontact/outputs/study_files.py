"""Files of a whole study: tables, figure, and collections of its cases for ParaView."""

from __future__ import annotations

from collections.abc import Sequence
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


def study_figures(rows: Sequence[Row], out: Path) -> None:
    """Draw the figure of a study and write its collections; cases are in the folder `cases` below `out`."""
    from fecontact.outputs.figures import study_figure

    solved = [row for row in rows if row.get("p_max_fe_MPa") is not None]
    _write_collections(solved, out)
    if solved:
        study_figure(list(rows), out / "study.png")


def _write_collections(rows: Sequence[Row], out: Path) -> None:
    """One .pvd a load and pair: ParaView merges equal times, so two loads cannot share one."""
    from fecontact.outputs.vtk import write_pvd

    groups: dict[tuple[str, str, float], set[tuple[float, Path]]] = {}
    for row in rows:
        key = (str(row["rail"]), str(row["wheel"]), float(row["load_kN"]))
        groups.setdefault(key, set()).add((float(row["lateral_shift_mm"]), out / "cases" / str(row["id"])))
    for (rail, wheel, load), entries in groups.items():
        pair = (
            "" if len({key[:2] for key in groups}) == 1 else f"_{Path(rail).stem}_{Path(wheel).stem}".replace(":", "-")
        )
        name = f"study{pair}.pvd" if len({key[2] for key in groups}) == 1 else f"study{pair}_{load:g}kN.pvd"
        if len({shift for shift, _ in entries}) == len(entries):
            write_pvd(out / name, sorted(entries))
