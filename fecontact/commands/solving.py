"""Commands that solve with finite elements: one case, a study, a map, the studies that have references."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from cyclopts import Parameter

from fecontact.case import Case, Group, unusual
from fecontact.commands.console import (
    announce,
    log_only,
    logged,
    many,
    print_reasons,
    say,
    solving,
    tell_geometry,
    tell_notes,
)
from fecontact.commands.options import PANELS, CaseOptions, takes
from fecontact.errors import usable, with_remedy
from fecontact.jobs.remaining import duration
from fecontact.outputs.terminal import count, show

if TYPE_CHECKING:
    from fecontact.jobs.engine import RunSettings


@Parameter(name="*", group=PANELS["run"])
@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """How the cases of a study, or the shifts of a map, are worked through.

    Attributes
    ----------
    workers
        Cases, or shifts of a map, at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each of them computes on.
    force
        Solve what is finished again instead of using it, and write into a folder that holds other results.
    part
        Solve only part i of N, given as i/N; the same command without it then puts all parts together.
    scheduler
        Address of a Dask scheduler whose workers share the folder of the results.
    quiet
        Say only what went wrong; run.log in the folder of the results has all of it in any case.
    """

    workers: int | None = None
    threads: int = 1
    force: bool = False
    part: str | None = None
    scheduler: str | None = None
    quiet: Annotated[bool, Parameter(alias="-q")] = False

    def settings(self) -> RunSettings:
        """What of it the run itself needs.

        Raises
        ------
        InputError
            If a number or the part cannot be.
        """
        from fecontact.jobs.engine import RunSettings, parse_part

        return RunSettings(
            workers=self.workers,
            threads=self.threads,
            force=self.force,
            part=parse_part(self.part) if self.part else None,
            scheduler=self.scheduler,
        )


AS_USUAL = RunOptions()
# CPU seconds of creep forces of a case or a cell, with those of the loads of its limits, and of the laws of them: 0.9,
# 1.3, 2.0 and 2.3 s, and 1.5, 2.3, 2.9 and 2.7 s, of a cell of S1002 on 60E1 at -4, 0, 3 and 5.5 mm.
FORCES_S, LAWS_S = 2.0, 2.5
# The time of the files is said from this part of the time of a solution on.
_MUCH_KEPT = 0.1


@takes(*get_args(Group))
def solve(
    *,
    options: CaseOptions,
    json: bool = False,
    out: Path | None = None,
    force: bool = False,
    long: bool = False,
) -> int:
    """Solve one position with finite elements and compare it with Hertz.

    Parameters
    ----------
    long
        Print everything that is known of the case, not the answer alone.
    json
        Print the result as JSON and nothing else.
    out
        Folder for the case's report.html, JSON, ParaView files and figure.
    force
        Write into a folder that holds other results.
    """
    from fecontact.files import json_text
    from fecontact.outputs.documents import case_parts
    from fecontact.outputs.words import case_words
    from fecontact.runs.cost import CASE_FILES_S, cost_of
    from fecontact.runs.folder import prepare_for_case
    from fecontact.runs.report import keep_with_report
    from fecontact.runs.store import Told
    from fecontact.solving.solve import solve as solve_case

    case = options.case()
    tell_notes(unusual([case]))
    if out is not None:
        prepare_for_case(out, case, force=force)
    cost = cost_of([case], 1) if out is None else cost_of([case], 1, files=CASE_FILES_S)
    # a case that does not fit into the memory is refused with what it needs
    if cost and cost.memory_GB < cost.available_GB:
        announce(*cost.words)
    with solving() as progress:
        result = solve_case(case, progress=progress)
        # what was solved is kept before it is shown: what it is shown on may be full, or closed
        begun, told = time.perf_counter(), Told.of(result)
        lost = None
        try:
            if out is not None:
                keep_with_report(result, told, out)
        except OSError as error:
            # it is said afterwards, since the numbers are there
            lost = error
        kept_s = time.perf_counter() - begun
    solved_s = sum(result.effort.seconds.values())
    if kept_s > _MUCH_KEPT * solved_s:
        announce(f"files, pictures and report took {kept_s:.1f} s, the solution {solved_s:.1f} s")
    if json:
        print(json_text(told.record), flush=True)
    else:
        title, evidence = case_words(result.case, result.placement), result.case.refine == "evidence"
        show(case_parts(told.record, title, elements=evidence), long=long)
        if not long:
            say("--long prints all that is known" + ("" if out is None else f", {out / 'report.html'} shows it"))
    if lost is not None:
        raise lost
    return 0 if result.load.usable else 3


def run(study: Path, *, out: Path, quick: bool = False, json: bool = False, how: RunOptions = AS_USUAL) -> int:
    """Run a study and write its tables, figures and ParaView files; finished cases are reused.

    Parameters
    ----------
    study
        A script of studies/ or a TOML file of cases.
    out
        Folder for the results.
    quick
        The small version of the study.
    json
        Print the rows as JSON and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.outputs.documents import rows_parts
    from fecontact.runs.casefile import load_study
    from fecontact.runs.cost import STUDY_FILES_S
    from fecontact.runs.folder import prepare_for_study
    from fecontact.runs.study import run_study

    settings, loaded = how.settings(), load_study(study, quick=quick)
    prepare_for_study(out, loaded.name, force=how.force)
    with logged(out / f"run{settings.part_suffix}.log"):
        tell_notes(unusual(loaded.cases))
        tell_geometry(loaded.cases)
        tell_cost(loaded.cases, "case", len(loaded.cases), out / "cases", how, files=STUDY_FILES_S)
        with many("cases", quiet=how.quiet) as progress:
            outcome = run_study(loaded, out, settings=settings, progress=progress)
        if json:
            print(json_text(outcome.rows), flush=True)
        how = replace(how, quiet=how.quiet or json)
        if not how.quiet:
            show(rows_parts(outcome.rows))
        _log_rows(outcome.rows)
        tell_reused(outcome.reused, outcome.recomputed, "case", how)
        if outcome.conclusion:
            say(outcome.conclusion, quiet=how.quiet)
        lost = tell_lost(outcome.rows, "case", "without a usable result")
        shown = outcome.collections[:3] + (("...",) if len(outcome.collections) > 3 else ())
        paraview = f"; for ParaView: {', '.join((*shown, 'cases/*/case.vtm'))}, or fecontact view {out}"
        files = ("report.html", "study.csv", "study.png", "cases")
        tell_files(out, files, paraview if lost < len(outcome.rows) else "", how)
    return 0 if outcome.all_converged else 3


def _log_rows(rows: Sequence[Mapping[str, Any]]) -> None:
    """Keep for the log what the table shows of each case."""
    from fecontact.outputs.records.results import asked_row

    for row in rows:
        log_only(f"{row['id']}: {asked_row(row).get('verdict_answer') or row['status']}")
        for name in ("verdict_warnings", "warnings"):
            if row.get(name):
                log_only(f"{row['id']}: {row[name]}", warning=True)


def tell_cost(
    cases: Sequence[Case],
    what: str,
    places: int,
    finished: Path,
    how: RunOptions,
    *,
    files: tuple[float, float],
    further: tuple[float, float] = (0.0, 0.0),
    laws: bool = False,
) -> None:
    """Say about what cases take before they are solved.

    Parameters
    ----------
    what
        What one of them is called.
    places
        So many workers have something to do.
    finished
        Folder of those that were finished before.
    files, further
        As for `cost_of`.
    laws
        Whether laws of creep forces are judged where there is friction.
    """
    from fecontact.jobs.workers import default_workers
    from fecontact.runs.cost import cost_of

    if how.part is not None or how.scheduler is not None:
        # how many others work, and on what machines, is not known
        return
    workers = how.workers or min(default_workers(), places)
    cost = cost_of(cases, workers, further=further, files=files)
    if cost is None:
        # none can be solved, which the results say
        return
    seconds = sum((FORCES_S + LAWS_S * laws) / workers for case in cases if case.creep.asked)
    forces = f"; creep forces about {duration(seconds)} more" * bool(seconds)
    taken = f"; finished {finished.name} are taken as they are" * finished.is_dir()
    expected, *short = cost.words
    announce(f"{count(len(cases), what)}: {expected}{forces}{taken}", *short, quiet=how.quiet)


def tell_reused(reused: Collection[str], recomputed: Mapping[str, str], what: str, how: RunOptions) -> None:
    """Say what was finished before, and why some of it was done again."""
    print_reasons("done again", recomputed)
    if reused:
        told = f"{count(len(reused), f'finished {what}')} {'was' if len(reused) == 1 else 'were'}"
        say(f"{told} reused; --force solves again", quiet=how.quiet)


def tell_lost(rows: Sequence[Mapping[str, Any]], what: str, how_lost: str) -> int:
    """Say which rows of cases have no result that can be used, and why; how many these are."""
    lost = {str(row["id"]): with_remedy(row) for row in rows if not usable(row)}
    print_reasons(f"{len(lost)} of {count(len(rows), what)} {how_lost}", lost)
    return len(lost)


def tell_files(out: Path, files: Sequence[str], more: str, how: RunOptions) -> None:
    """Say which files there are, and what to do where it is a part alone."""
    if how.part is None:
        there = ", ".join(f"{name}/" if (out / name).is_dir() else name for name in files if (out / name).exists())
        say(f"Results in {out}: {there}{more}", quiet=how.quiet)
    else:
        words = f"Part {how.part} is in {out}; when all parts are, the same command without --part puts them together"
        say(words, quiet=how.quiet)


def validate(
    *studies: Path,
    out: Path,
    report: Path | None = None,
    quick: bool = False,
    workers: int | None = None,
) -> int:
    """Run studies and check their numbers against references; exit code 1 if a check fails.

    Parameters
    ----------
    studies
        Scripts with a function checks(rows); all of studies/ that have one, if none is given.
    out
        Folder for the results, one folder a study; finished cases are reused.
    report
        Markdown file with a line for each study; VALIDATION.md in `out`, if not given. Lines of other studies that it
        has are kept. The pages that it links to are in the folder validation beside it.
    quick
        The small version of each study.
    workers
        Cases at a time, as for `run`.
    """
    from fecontact.runs.validation import checked_studies
    from fecontact.runs.validation import validate as run_and_check

    @contextmanager
    def watched(name: str) -> Iterator[Callable[[int, int, str], None]]:
        print(name, file=sys.stderr)
        with many("cases") as progress:
            yield progress

    chosen = checked_studies(studies or sorted(Path("studies").glob("[0-9]*.py")), quick=quick)
    found = run_and_check(chosen, out, table=report, workers=workers, watched=watched)
    for check in found.failed:
        print(
            f"FAIL {check.quantity}, {check.case}: {check.deviation_percent:+.2f} % (limit {check.limit_percent:g} %)"
        )
    print(
        f"{len(found.checks)} checks, {len(found.failed)} failed, {len(found.unusable)} studies with unusable cases:"
        f" {found.path}"
    )
    return 3 if found.unusable else int(bool(found.failed))
