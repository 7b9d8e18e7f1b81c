"""Stored studies and cases judged again, by different criteria or with friction, without finite elements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, describe_failure, has_numbers, is_usable_status
from fecontact.inputs.texts import count_text
from fecontact.jobs.remaining import Progress, report_progress
from fecontact.jobs.workers import count_default_workers, has_single_thread, open_evaluators
from fecontact.outputs.pair_names import VARIED_COLUMN
from fecontact.outputs.parts import Part
from fecontact.outputs.records.results import Row, case_row, read_row
from fecontact.outputs.study_files import write_tables
from fecontact.outputs.study_report import parts_of_judged_rows
from fecontact.outputs.words import criteria_settings, list_criteria_texts
from fecontact.runs.casefile import list_feature_result_files, list_result_files
from fecontact.runs.report import report_judged
from fecontact.runs.store import (
    RECORD_FILE,
    ROW_FILE,
    ChangedCase,
    name_case_folder,
    read_stored_inputs,
)
from fecontact.runs.stored_folder import describe_unusable_result, read_stored_study

# Number of cases from which on processes save time: a case takes some hundredths of a second, with creep forces
# seconds, and a process takes seconds to begin.
_WORTH_PROCESSES = 100
# Files and folders that only solved results have, and not results that were judged again.
_FILES_OF_SOLVED_RESULTS = ("cases", "positions", RECORD_FILE)


@dataclass(frozen=True, kw_only=True)
class JudgedStudy:
    """Rows of a study by different criteria.

    Attributes
    ----------
    rows
        A row per case; the status of a row gives the reason if the case cannot be judged.
    changed
        Old and new verdict by id, for cases with two different verdicts.
    missing
        Number of cases of the study without a row, since the study still runs or was interrupted.
    case_criteria
        Criteria by which each judged case was judged, by id.
    """

    rows: tuple[Row, ...]
    changed: dict[str, tuple[str, str]]
    missing: int = 0
    case_criteria: Mapping[str, Criteria]

    @property
    def problems(self) -> tuple[str, ...]:
        """Criteria of a user that were not judged, with the reason; all other rows have a status."""
        return self._own_texts[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """Criteria of a user that were judged by their stored values, with the reason."""
        return self._own_texts[0]

    @cached_property
    def _own_texts(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Messages about criteria with stored values, and about criteria that were not judged, each once."""
        texts: tuple[dict[str, None], dict[str, None]] = ({}, {})
        for row in self.rows:
            if is_usable_status(row) and (criteria := self.case_criteria.get(str(row["id"]))) is not None:
                measures = [name for name in criteria.own_measures if row.get(f"fe_{name}") is not None]
                for kind, messages in zip(texts, criteria.describe_unavailable_own(measures), strict=True):
                    kind.update(dict.fromkeys(messages))
        return tuple(texts[0]), tuple(texts[1])

    @property
    def all_judged(self) -> bool:
        """Whether every case was judged and may be used."""
        return not self.missing and not self.problems and all(is_usable_status(row) for row in self.rows)

    @property
    def words(self) -> str:
        """Numbers of judged cases and of changed verdicts, in words."""
        unjudged_count = sum("verdict_answer" not in row for row in self.rows)
        cases, changed = count_text(len(self.rows), "case"), count_text(len(self.changed), "verdict")
        if self.missing:
            all_cases = count_text(len(self.rows) + self.missing, "case")
            cases = f"{len(self.rows)} of {all_cases} ({self.missing} not solved yet)"
        texts = " and ".join(list_criteria_texts(self.case_criteria.values()))
        return f"{cases} judged{' by ' * bool(texts)}{texts}: {changed} changed" + (
            f", {unjudged_count} not judged" if unjudged_count else ""
        )

    @property
    def record(self) -> Mapping[str, Any]:
        """Criteria, rows, changed verdicts by id, and number of cases without a row."""
        settings = criteria_settings(self.case_criteria.values())
        return {**settings, "rows": self.rows, "changed": self.changed, "missing": self.missing}

    def terminal_parts(self, width: int | None) -> Iterable[Part]:
        """Parts for a terminal: the rows and the changed verdicts.

        Parameters
        ----------
        width
            Columns of the terminal; None without a terminal.

        Returns
        -------
        iterable
            The parts.
        """
        changed = (f"{name}: {before} -> {now}" for name, (before, now) in self.changed.items())
        return (*parts_of_judged_rows(self.rows), *changed)


def judge_study(
    folder: str | Path,
    criteria: Criteria | Mapping[str, Any] | None = None,
    out: Path | None = None,
    *,
    creep: Creep | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> JudgedStudy:
    """Judge the cases of a stored study, or a single stored case, by changed criteria.

    Parameters
    ----------
    folder
        Folder of the study or the case.
    criteria, creep
        Changes of the stored criteria, and of the stored friction and creepages, of each case.
    out
        Folder for `study.csv`, `study.json`, `study.png` and `report.html` of the new verdicts; the old files stay.
    progress
        Receives the progress.

    Returns
    -------
    JudgedStudy
        New rows and changed verdicts.

    Raises
    ------
    InputError
        If the folder holds neither a study nor a case, or `out` is the folder itself.
    """
    folder = Path(folder)
    refuse_output_folder(folder, out)
    name, before, folders, cases = list_stored_cases(folder)
    open_rows = [_row_without_verdict(old, case_folder) for old, case_folder in zip(before, folders, strict=True)]
    # the functions of stored criteria are found here, because workers have not imported their modules
    changed_cases = [
        None if row is not None else _change_case(case_folder, criteria, creep)
        for row, case_folder in zip(open_rows, folders, strict=True)
    ]
    rows = _judge_rows(before, open_rows, changed_cases, progress)
    changed = {
        str(new["id"]): (str(old["verdict_answer"]), str(new["verdict_answer"]))
        for old, new in zip(before, rows, strict=True)
        if old.get("verdict_answer") and new.get("verdict_answer") and old["verdict_answer"] != new["verdict_answer"]
    }
    if out is not None:
        new_criteria = [changed_case.criteria for changed_case in changed_cases if changed_case is not None]
        write_tables(name, cases, rows, out / "study", new_criteria)
        report_judged(name, rows, folders, out, changed_cases)
    return JudgedStudy(
        rows=tuple(rows),
        changed=changed,
        missing=cases - len(rows),
        case_criteria={
            str(row["id"]): changed_case.criteria
            for row, changed_case in zip(rows, changed_cases, strict=True)
            if changed_case is not None
        },
    )


def _change_case(
    folder: Path, criteria: Criteria | Mapping[str, Any] | None, creep: Creep | Mapping[str, Any] | None
) -> ChangedCase:
    """Stored case with the changes of its criteria and creepages."""
    stored_case = read_stored_inputs(folder)
    return ChangedCase(
        folder=folder,
        criteria=stored_case.criteria.apply_change(criteria),
        creep=stored_case.creep.apply_change(creep),
    )


def list_stored_cases(folder: Path) -> tuple[str, Sequence[Row], list[Path], int]:
    """List the cases of a stored study, or a single stored case.

    Parameters
    ----------
    folder
        Folder of the study or the case.

    Returns
    -------
    tuple of str, sequence of Row, list of Path and int
        Name of the study, stored rows, folder of each row, and number of cases, some of which may not have a row yet.

    Raises
    ------
    InputError
        If the folder holds neither a study nor a case.
    """
    if (folder / RECORD_FILE).is_file():
        row = read_row(folder / ROW_FILE)
        return str(row["id"]), [row], [folder], 1
    name, rows, cases = read_stored_study(folder)
    return name, rows, [name_case_folder(folder, str(row["id"])) for row in rows], cases


def _judge_rows(
    before: Sequence[Row],
    rows: Sequence[Row | None],
    changed_cases: Sequence[ChangedCase | None],
    progress: Progress | None,
) -> list[Row]:
    """Judge the stored cases of a study again, in several processes if they are many.

    Parameters
    ----------
    before
        Rows of the study, a row per case.
    rows
        New rows of the cases that cannot be judged; None for the other cases.
    changed_cases
        Cases with their new criteria; None for the cases that cannot be judged.
    progress
        Receives the number of judged cases.

    Returns
    -------
    list of Row
        New rows in the order of the cases. A case that has failed keeps its row; a case whose files are missing or
        damaged has a row with this reason as its status.
    """
    judged_cases = [changed_case for changed_case in changed_cases if changed_case is not None]
    has_forces = any(changed_case.creep.asked for changed_case in judged_cases)
    with judges(len(judged_cases), has_forces=has_forces) as map_over:
        judged_rows = map_over(_judge_row, judged_cases)
        remaining_rows = iter(list(report_progress(judged_rows, len(judged_cases), progress, "judging")))
    return [
        {
            "id": old["id"],
            **next(remaining_rows),
            **({VARIED_COLUMN: old[VARIED_COLUMN]} if old.get(VARIED_COLUMN) else {}),
        }
        if row is None
        else row
        for old, row in zip(before, rows, strict=True)
    ]


def judges(count: int, *, has_forces: bool) -> AbstractContextManager[Callable[..., Iterable[Any]]]:
    """Open a function like `map` for judging.

    It runs on a single thread, as the workers that solved.

    Parameters
    ----------
    count
        Number of cases or positions.
    has_forces
        Whether creep forces are evaluated.

    Returns
    -------
    context manager
        Yields the function; it works in this process if processes would save no time.
    """
    return open_evaluators(count, here=_is_done_here(count, has_forces=has_forces))


def count_judging_processes(count: int, *, has_forces: bool) -> int:
    """Number of processes that judge a number of cases, with or without creep forces."""
    return 1 if _is_done_here(count, has_forces=has_forces) else min(count_default_workers(), count)


def _is_done_here(count: int, *, has_forces: bool) -> bool:
    worthwhile_count = _WORTH_PROCESSES // (20 if has_forces else 1)
    return count < worthwhile_count and has_single_thread()


def _row_without_verdict(old: Row, folder: Path) -> Row | None:
    """Row of a case that has no result or cannot be judged any more; None for other cases."""
    if not has_numbers(old):
        return old
    problem = describe_unusable_result(folder)
    inputs = {key: value for key, value in old.items() if key in ("rail", "wheel", "lateral_shift_mm", "load_kN")}
    return None if problem is None else {"id": old["id"], "status": describe_failure(problem), **inputs}


def _judge_row(changed_case: ChangedCase) -> Row:
    return case_row(changed_case.read())


def refuse_output_folder(folder: Path, out: Path | None) -> None:
    """Refuse an output folder that would change or replace solved results.

    These are the folder of the results, folders below it, and folders with other solved results.

    Parameters
    ----------
    folder
        Folder of the results.
    out
        Folder for the new files; None if no files are written.

    Raises
    ------
    InputError
        If `out` is refused.
    """
    if out is not None and out.resolve().is_relative_to(folder.resolve()):
        relation = "is" if out.resolve() == folder.resolve() else "is inside"
        raise InputError(f"--out {out} {relation} the folder of the results, which is not changed; give another folder")
    if out is not None and any((out / file).is_file() for file in list_result_files()):
        solved_names = (*_FILES_OF_SOLVED_RESULTS, *list_feature_result_files())
        solved_file = next((name for name in solved_names if (out / name).exists()), None)
        if solved_file is not None:
            raise InputError(f"--out {out} has other solved results ({solved_file}); give another folder")
