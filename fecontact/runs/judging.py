"""Stored results judged again, by other criteria or by a newer evaluation: no finite elements, no meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.comparison.theories import HERTZ
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, failed, has_numbers, usable
from fecontact.jobs.workers import began_on_one_thread, evaluators
from fecontact.outputs.documents import write_map_report, write_tables
from fecontact.outputs.maps.files import write_map
from fecontact.outputs.maps.views import MapMeasure, refuse_measure
from fecontact.outputs.records.results import Row, case_row, read_row
from fecontact.runs.load import read_map, stored_study, unusable
from fecontact.runs.store import RESULT, ROW, case_folder, read_case
from fecontact.runs.study import report_judged
from fecontact.solving.map import ApplicabilityMap

# A case takes some hundredths of a second, with creep forces seconds, and a process seconds to begin.
_WORTH_PROCESSES = 100


@dataclass(frozen=True, kw_only=True)
class JudgedStudy:
    """Rows of a study by other criteria.

    Attributes
    ----------
    rows
        One a case; that of a case that cannot be judged has a status that says why.
    changed
        Verdicts before and now, by id, where there are both and they differ.
    """

    rows: tuple[Row, ...]
    changed: dict[str, tuple[str, str]]

    @property
    def all_judged(self) -> bool:
        """Whether every case was judged and may be used."""
        return all(usable(row) for row in self.rows)


@dataclass(frozen=True, kw_only=True)
class JudgedMap:
    """A map by other criteria, and what of it cannot be judged, in words."""

    map: ApplicabilityMap
    problems: tuple[str, ...]

    @property
    def all_judged(self) -> bool:
        """Whether every cell was judged and may be used."""
        return self.map.all_solved


def judge(
    folder: str | Path,
    criteria: Criteria | None = None,
    *,
    creep: Creep | None = None,
    measure: MapMeasure = "pressure",
    theory: str = HERTZ,
    out: str | Path | None = None,
) -> JudgedStudy | JudgedMap:
    """Judge a stored study, map or case again, by other criteria or with friction; nothing is solved.

    Parameters
    ----------
    folder
        That fecontact wrote; it stays as it is.
    criteria
        The usual ones if not given.
    creep
        Friction and creepages; without friction those of each case.
    measure
        Of a map, what it is about; by `theory` with friction the laws of creep forces are judged too.
    theory
        Of a map, one of the pressure whose map is drawn beside that of Hertz.
    out
        Folder for tables, pictures and report of the new verdicts.

    Raises
    ------
    InputError
        If the folder holds no results or is `out`, for creepages without friction, and for a measure without it.
    """
    folder, out = Path(folder), None if out is None else Path(out)
    criteria, creep = criteria or Criteria(), creep or Creep()
    creep.refuse_unheard()
    asked = creep if creep.asked else None
    if (folder / "map.json").is_file():
        made, problems = judge_map(folder, criteria, out, creep=asked, measure=measure, theory=theory)
        return JudgedMap(map=made, problems=tuple(problems))
    if measure != "pressure" or theory != HERTZ:
        what = f"measure is {measure!r}" if measure != "pressure" else f"theory is {theory!r}"
        raise InputError(
            f"{what}, but {folder} has no map.json; a study and a case have every theory in their tables, and forces by"
            " --friction alone"
        )
    return judge_study(folder, criteria, out, creep=asked)


def judge_study(
    folder: str | Path, criteria: Criteria, out: Path | None = None, *, creep: Creep | None = None
) -> JudgedStudy:
    """Judge the cases of a stored study, or a single stored case, by given criteria.

    Parameters
    ----------
    creep
        Friction and creepages; those of each case if not given.
    out
        Folder for `study.csv`, `study.json`, `study.png` and `report.html` of the new verdicts; the old ones stay.

    Raises
    ------
    InputError
        If the folder holds neither, or `out` is the folder itself.
    """
    folder = Path(folder)
    _check_out(folder, out)
    if (folder / RESULT).is_file():
        row = read_row(folder / ROW)
        name, before, folders = str(row["id"]), [row], [folder]
    else:
        name, before = stored_study(folder)
        folders = [case_folder(folder, str(row["id"])) for row in before]
    rows = _judged_rows(before, folders, criteria, creep)
    changed = {
        str(new["id"]): (str(old["verdict_answer"]), str(new["verdict_answer"]))
        for old, new in zip(before, rows, strict=True)
        if old.get("verdict_answer") and new.get("verdict_answer") and old["verdict_answer"] != new["verdict_answer"]
    }
    if out is not None:
        write_tables(name, len(rows), rows, out / "study")
        report_judged(name, rows, folders, out, criteria, creep)
    return JudgedStudy(rows=tuple(rows), changed=changed)


def _judged_rows(before: Sequence[Row], folders: Sequence[Path], criteria: Criteria, creep: Creep | None) -> list[Row]:
    rows = [_unjudged(old, folder) for old, folder in zip(before, folders, strict=True)]
    left = [folder for folder, row in zip(folders, rows, strict=True) if row is None]
    with _judges(len(left), creep) as map_over:
        judged = iter(list(map_over(partial(_judged_row, criteria=criteria, creep=creep), left)))
    return [{"id": old["id"], **next(judged)} if row is None else row for old, row in zip(before, rows, strict=True)]


def _judges(count: int, creep: Creep | None) -> AbstractContextManager[Callable[..., Iterable[Any]]]:
    """What judges so many on one thread, as the workers that solved them; this process if others are not worth it."""
    worth = _WORTH_PROCESSES // (20 if creep is not None and creep.asked else 1)
    return evaluators(count, here=count < worth and began_on_one_thread())


def _unjudged(old: Row, folder: Path) -> Row | None:
    """The row of a case that has no result or cannot be judged any more, None of the others."""
    if not has_numbers(old):
        return old
    problem = unusable(folder)
    kept = {key: value for key, value in old.items() if key in ("rail", "wheel", "lateral_shift_mm", "load_kN")}
    return None if problem is None else {"id": old["id"], "status": failed(problem), **kept}


def _judged_row(folder: Path, criteria: Criteria, creep: Creep | None) -> Row:
    return case_row(read_case(folder, criteria=criteria, creep=creep))


def judge_map(
    folder: str | Path,
    criteria: Criteria,
    out: Path | None = None,
    *,
    creep: Creep | None = None,
    measure: MapMeasure = "pressure",
    theory: str = HERTZ,
) -> tuple[ApplicabilityMap, list[str]]:
    """Judge a stored map by given criteria, and with friction and creepages; returns it with what cannot be judged.

    A load limit is as sharp as the loads that were solved. `out` is a folder for the files of the new map,
    by `theory` with friction with those of the laws of creep forces.

    Raises
    ------
    InputError
        If the folder holds no map or `out` is the folder itself, or for a measure that needs friction without any.
    """
    folder = Path(folder)
    _check_out(folder, out)
    judges = partial(_judges, creep=creep)
    made, problems = read_map(folder, criteria, creep, creep_laws=measure == "theory", judges=judges)
    refuse_measure(made.case, measure, theory)
    if out is not None:
        write_map(made, out, theory=theory)
        write_map_report(made, out, theory=theory)
    return made, list(problems.values())


def _check_out(folder: Path, out: Path | None) -> None:
    if out is not None and out.resolve() == folder.resolve():
        raise InputError(f"--out {out} is the folder of the results, which stay as they are; give another one")
