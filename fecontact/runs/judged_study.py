"""A stored study or case judged again, by other criteria or with friction: no finite elements, no meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, failed, has_numbers, usable
from fecontact.jobs.remaining import Progress, watched
from fecontact.jobs.workers import began_on_one_thread, default_workers, evaluators
from fecontact.outputs.pair_names import VARIED
from fecontact.outputs.parts import Part
from fecontact.outputs.records.results import Row, case_row, read_row
from fecontact.outputs.study_files import write_tables
from fecontact.outputs.study_report import judged_rows_parts
from fecontact.outputs.terminal import count
from fecontact.runs.casefile import kinds
from fecontact.runs.report import report_judged
from fecontact.runs.store import RESULT, ROW, case_folder, read_case
from fecontact.runs.stored_folder import stored_study, unusable

# A case takes some hundredths of a second, with creep forces seconds, and a process seconds to begin.
_WORTH_PROCESSES = 100
# What is in a folder of results that were solved, and not of such that were judged again.
_SOLVED = ("cases", "positions", RESULT)


@dataclass(frozen=True, kw_only=True)
class JudgedStudy:
    """Rows of a study by other criteria.

    Attributes
    ----------
    rows
        One row per case; the row of a case that cannot be judged has a status that says why.
    changed
        Verdicts before and now, by id, where there are both and they differ.
    missing
        Cases of the study that have no row yet, as it still runs or was interrupted.
    """

    rows: tuple[Row, ...]
    changed: dict[str, tuple[str, str]]
    missing: int = 0

    @property
    def all_judged(self) -> bool:
        """Whether every case was judged and may be used."""
        return not self.missing and all(usable(row) for row in self.rows)

    @property
    def problems(self) -> tuple[str, ...]:
        """None: rows have a status."""
        return ()

    @property
    def words(self) -> str:
        """How many cases were judged, and how many verdicts are others."""
        lost = sum("verdict_answer" not in row for row in self.rows)
        cases, changed = count(len(self.rows), "case"), count(len(self.changed), "verdict")
        if self.missing:
            every = count(len(self.rows) + self.missing, "case")
            cases = f"{len(self.rows)} of {every} ({self.missing} not solved yet)"
        return f"{cases} judged by {{criteria}}: {changed} changed" + (f", {lost} not judged" if lost else "")

    @property
    def record(self) -> Mapping[str, Any]:
        """The rows, the verdicts before and now that differ, by id, and how many cases have no row."""
        return {"rows": self.rows, "changed": self.changed, "missing": self.missing}

    def parts(self, width: int | None) -> Iterable[Part]:
        """The rows, and the verdicts that have changed."""
        changed = (f"{name}: {before} -> {now}" for name, (before, now) in self.changed.items())
        return (*judged_rows_parts(self.rows), *changed)


def judge_study(
    folder: str | Path,
    criteria: Criteria,
    out: Path | None = None,
    *,
    creep: Creep | None = None,
    progress: Progress | None = None,
) -> JudgedStudy:
    """Judge the cases of a stored study, or a single stored case, by given criteria.

    Parameters
    ----------
    creep
        Friction and creepages; each case's if not given.
    out
        Folder for `study.csv`, `study.json`, `study.png` and `report.html` of the new verdicts; the old ones stay.

    Raises
    ------
    InputError
        If the folder holds neither, or `out` is the folder itself.
    """
    folder = Path(folder)
    check_out(folder, out)
    if (folder / RESULT).is_file():
        row = read_row(folder / ROW)
        name, before, folders, cases = str(row["id"]), [row], [folder], 1
    else:
        name, before, cases = stored_study(folder)
        folders = [case_folder(folder, str(row["id"])) for row in before]
    rows = _judged_rows(before, folders, criteria, creep, progress)
    changed = {
        str(new["id"]): (str(old["verdict_answer"]), str(new["verdict_answer"]))
        for old, new in zip(before, rows, strict=True)
        if old.get("verdict_answer") and new.get("verdict_answer") and old["verdict_answer"] != new["verdict_answer"]
    }
    if out is not None:
        write_tables(name, cases, rows, out / "study")
        report_judged(name, rows, folders, out, criteria, creep)
    return JudgedStudy(rows=tuple(rows), changed=changed, missing=cases - len(rows))


def _judged_rows(
    before: Sequence[Row], folders: Sequence[Path], criteria: Criteria, creep: Creep | None, progress: Progress | None
) -> list[Row]:
    rows = [_unjudged(old, folder) for old, folder in zip(before, folders, strict=True)]
    left = [folder for folder, row in zip(folders, rows, strict=True) if row is None]
    with judges(len(left), creep) as map_over:
        made = map_over(partial(_judged_row, criteria=criteria, creep=creep), left)
        judged = iter(list(watched(made, len(left), progress, "judging")))
    return [
        {"id": old["id"], **next(judged), **({VARIED: old[VARIED]} if old.get(VARIED) else {})} if row is None else row
        for old, row in zip(before, rows, strict=True)
    ]


def judges(count: int, creep: Creep | None) -> AbstractContextManager[Callable[..., Iterable[Any]]]:
    """What judges so many on one thread, as the workers that solved them; this process if others are not worth it."""
    return evaluators(count, here=_here(count, creep))


def workers_of(count: int, creep: Creep | None) -> int:
    """How many processes judge so many."""
    return 1 if _here(count, creep) else min(default_workers(), count)


def _here(count: int, creep: Creep | None) -> bool:
    worth = _WORTH_PROCESSES // (20 if creep is not None and creep.asked else 1)
    return count < worth and began_on_one_thread()


def _unjudged(old: Row, folder: Path) -> Row | None:
    """The row of a case that has no result or cannot be judged any more, None of the others."""
    if not has_numbers(old):
        return old
    problem = unusable(folder)
    kept = {key: value for key, value in old.items() if key in ("rail", "wheel", "lateral_shift_mm", "load_kN")}
    return None if problem is None else {"id": old["id"], "status": failed(problem), **kept}


def _judged_row(folder: Path, criteria: Criteria, creep: Creep | None) -> Row:
    return case_row(read_case(folder, criteria=criteria, creep=creep))


def check_out(folder: Path, out: Path | None) -> None:
    """Refuse to write into the folder of the results or into one below it, and over other results that were solved."""
    if out is not None and out.resolve().is_relative_to(folder.resolve()):
        where = "is" if out.resolve() == folder.resolve() else "lies in"
        raise InputError(f"--out {out} {where} the folder of the results, which stay as they are; give another one")
    if out is not None and any((out / file).is_file() for file in kinds()):
        solved = next((name for name in _SOLVED if (out / name).exists()), None)
        if solved is not None:
            raise InputError(f"--out {out} holds other results, which were solved ({solved}); give another folder")
