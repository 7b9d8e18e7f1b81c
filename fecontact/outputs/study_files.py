"""Files of a complete study: tables, figures, and collections of its cases for ParaView."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from fecontact.criteria import Criteria
from fecontact.files import write_sealed
from fecontact.outputs.pair_names import RowMapping
from fecontact.outputs.records.results import package_versions
from fecontact.outputs.series import split_into_series
from fecontact.outputs.tables import write_csv
from fecontact.outputs.words import criteria_settings
from fecontact.profiles.curve import Profile

STUDY_SCHEMA = "fecontact/study/3"


def write_tables(
    study: str, cases: int, rows: Sequence[RowMapping], path: Path, criteria_of_cases: Iterable[Criteria] = ()
) -> None:
    """Write the rows of a study as CSV and JSON.

    Parameters
    ----------
    study
        Name of the study.
    cases
        Number of cases.
    rows
        Rows of the cases.
    path
        Path of the files without the endings .csv and .json.
    criteria_of_cases
        Criteria of each case.
    """
    write_csv(rows, path.with_name(f"{path.name}.csv"))
    record = {
        "schema": STUDY_SCHEMA,
        "study": study,
        "cases": cases,
        **criteria_settings(criteria_of_cases),
        "rows": rows,
        "versions": package_versions(),
    }
    write_sealed(path.with_name(f"{path.name}.json"), record, [path.with_name(f"{path.name}.csv")])


def study_figures(
    rows: Sequence[RowMapping], out: Path, rail: Profile | None = None, criteria: Criteria | None = None
) -> tuple[str, ...]:
    """Draw the figure of a study and write its collections.

    Parameters
    ----------
    rows
        Rows of the study.
    out
        Folder of the study; the cases are in its folder `cases`.
    rail
        Only rail of the study, for its junctions; None if there are several rails.
    criteria
        Common criteria, for their limits; None if there are several sets.

    Returns
    -------
    tuple of str
        Names of the collections.
    """
    from fecontact.outputs.figures.study import draw_study

    solved_rows = [row for row in rows if row.get("fe_p_max_MPa") is not None]
    if solved_rows:
        draw_study(list(rows), out / "study.png", rail, criteria)
    return _write_collections(solved_rows, out)


def _write_collections(rows: Sequence[RowMapping], out: Path) -> tuple[str, ...]:
    """Write a .pvd for each series of cases over the lateral shift.

    ParaView merges equal times, so that two series cannot share a collection. Single cases are left out if there are
    other series. Cases that differ in something else, such as the sizes of their bodies, are left out too.
    """
    from fecontact.outputs.paraview.vtk import write_pvd

    unique = list({row["id"]: row for row in rows}.values())
    found_series = split_into_series(unique)
    written_names: list[str] = []
    for series_ in found_series:
        folders_by_shift = {float(row["lateral_shift_mm"]): out / "cases" / str(row["id"]) for row in series_.rows}
        if len(folders_by_shift) == len(series_.rows) and (len(folders_by_shift) > 1 or len(found_series) == 1):
            name = f"study{series_.file_suffix}"
            # two folders have profile files of equal names
            equal_names = sum(written_name.startswith(f"{name}.") for written_name in written_names)
            path = out / (f"{name}.{equal_names + 1}.pvd" if equal_names else f"{name}.pvd")
            written_names.append(write_pvd(path, folders_by_shift.items()).name)
    return tuple(written_names)
