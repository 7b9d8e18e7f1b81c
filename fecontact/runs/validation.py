"""Validation: studies run, and their numbers checked against references, in a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from fecontact.errors import FecontactError, InputError, is_usable_status
from fecontact.files import check_regular_file, write_text
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.remaining import Progress
from fecontact.outputs.records.results import package_versions
from fecontact.regression.check_pages import UnsolvedCases, render_reports
from fecontact.regression.checks import Check
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.study import run_study


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Result of a validation.

    Attributes
    ----------
    checks
        Checks of all studies.
    unsolved
        Cases or checks without a result.
    path
        File of the table.
    """

    checks: tuple[Check, ...]
    unsolved: tuple[UnsolvedCases, ...]
    path: Path

    @property
    def failed(self) -> tuple[Check, ...]:
        """Checks outside their limits."""
        return tuple(check for check in self.checks if not check.passed)


def validate(
    studies: Sequence[Study],
    out: Path,
    *,
    table: Path | None = None,
    workers: int | None = None,
    watched: Callable[[str], AbstractContextManager[Progress]],
) -> Validation:
    """Run studies with checks, and write a table and a page for each study.

    The lines of other studies are kept.

    Parameters
    ----------
    studies
        Studies with checks.
    out
        Folder for the results, with a folder per study.
    table
        Markdown file with a line per study; VALIDATION.md in `out`, if not given. The pages are beside it.
    workers
        Number of cases at a time.
    watched
        Opens the receiver of the progress of a study, by its name.

    Returns
    -------
    Validation
        The checks.
    """
    checks_by_study: dict[str, list[Check]] = {}
    unsolved = []
    for study in studies:
        with watched(study.name) as progress:
            outcome = run_study(study, out / study.name, settings=RunSettings(workers=workers), progress=progress)
        reasons = [f"{row['id']} ({row['status']})" for row in outcome.rows if not is_usable_status(row)]
        if reasons:
            unsolved.append(UnsolvedCases(study=study.name, reason=", ".join(reasons)))
        assert study.checks is not None
        try:
            checks_by_study[study.name] = study.checks([row for row in outcome.rows if is_usable_status(row)])
        except FecontactError as error:
            # an error in a study must not lose hours of other studies
            unsolved.append(UnsolvedCases(study=study.name, reason=f"error in its checks: {error}"))
    path = table or out / "VALIDATION.md"
    questions = {study.name: study.question for study in studies}
    check_regular_file(path)
    previous_text = path.read_text("utf-8") if path.exists() else ""
    summary, *pages = render_reports(checks_by_study, questions, package_versions(), unsolved, previous_text).items()
    for place, text in ((path.name, summary[1]), *pages):
        write_text(path.parent / place, text)
    checks = tuple(check for study_checks in checks_by_study.values() for check in study_checks)
    return Validation(checks=checks, unsolved=tuple(unsolved), path=path)


def load_checked_studies(paths: Sequence[Path], *, quick: bool = False) -> tuple[Study, ...]:
    """Read study files, and select the studies that have checks.

    Parameters
    ----------
    paths
        Files.
    quick
        Whether to read the small versions of the studies.

    Returns
    -------
    tuple of Study
        Studies with checks.

    Raises
    ------
    InputError
        If no study has checks, or a file is not a study.
    """
    loaded = [load_study(path, quick=quick) for path in paths]
    studies_with_checks = tuple(study for study in loaded if study.checks is not None)
    if not studies_with_checks:
        raise InputError("validate: none of the studies has a function checks(rows); give scripts that have one")
    return studies_with_checks
