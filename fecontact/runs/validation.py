"""Studies run and their numbers checked against references, all of them in one table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from fecontact.errors import FecontactError, InputError, usable
from fecontact.files import write_text
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.remaining import Progress
from fecontact.outputs.records.results import versions
from fecontact.regression.checks import Check, reports
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.study import run_study


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Checks of all studies, studies with cases or checks without a usable result, and the file of the table."""

    checks: tuple[Check, ...]
    unusable: tuple[str, ...]
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
    """Run studies that have checks, and write a table of them and a page for each; other studies' lines are kept.

    Parameters
    ----------
    out
        Folder for the results, one folder a study.
    table
        Markdown file for a line of each study; VALIDATION.md in `out`, if not given. Their pages are beside it.
    watched
        Who hears of the progress of a study, by its name.
    """
    found: dict[str, list[Check]] = {}
    unusable = []
    for study in studies:
        with watched(study.name) as progress:
            outcome = run_study(study, out / study.name, settings=RunSettings(workers=workers), progress=progress)
        bad = [str(row["id"]) for row in outcome.rows if not usable(row)]
        if bad:
            unusable.append(f"{study.name}: {', '.join(bad)}")
        assert study.checks is not None
        try:
            found[study.name] = study.checks([row for row in outcome.rows if usable(row)])
        except FecontactError as error:
            # hours of other studies are not lost with one
            unusable.append(f"{study.name}: its checks: {error}")
    path = table or out / "VALIDATION.md"
    asked = {study.name: study.question for study in studies}
    before = path.read_text("utf-8") if path.exists() else ""
    summary, *pages = reports(found, asked, versions(), unusable, before).items()
    for place, text in ((path.name, summary[1]), *pages):
        write_text(path.parent / place, text)
    checks = tuple(check for own in found.values() for check in own)
    return Validation(checks=checks, unusable=tuple(unusable), path=path)


def checked_studies(paths: Sequence[Path], *, quick: bool = False) -> tuple[Study, ...]:
    """Those of some study files that have checks.

    Raises
    ------
    InputError
        If none has, or a file is no study.
    """
    loaded = [load_study(path, quick=quick) for path in paths]
    found = tuple(study for study in loaded if study.checks is not None)
    if not found:
        raise InputError("validate: none of the studies has a function checks(rows); give scripts of studies/ that do")
    return found
