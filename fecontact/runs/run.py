"""Many cases and maps from Python, as `fecontact run` and `map` solve them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from fecontact.case import Case
from fecontact.comparison.theories import HERTZ
from fecontact.errors import InputError
from fecontact.jobs.engine import Progress, RunSettings
from fecontact.outputs.maps.measures import MapMeasure
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.folders import prepare_for_map, prepare_for_study
from fecontact.runs.map_run import MapOutcome, run_map
from fecontact.runs.study import StudyOutcome, run_study


def run(
    study: str | Path | Study | Iterable[Case],
    out: str | Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    threads: int = 1,
    force: bool = False,
    progress: Progress | None = None,
) -> StudyOutcome:
    """Solve many cases at a time, each once, and write their tables, pictures and ParaView files.

    The same call goes on where an interrupted one stopped. `outcome.rows` is a list of flat dictionaries, one a case,
    with units in their keys, as `pandas.DataFrame` takes it.

    Parameters
    ----------
    study
        Cases, or a study file: a script with `cases(quick=False)`, or TOML.
    out
        Folder for the results; `fecontact.load` reads them back.
    quick
        The small version of a study file.
    workers
        Cases at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each case computes on.
    force
        Solve finished cases again, and write into a folder that holds other results.
    progress
        Called with the number of finished cases, the number of cases, and what is under way.

    Raises
    ------
    InputError
        If the study cannot be read, or another run has the folder. A case that cannot be solved is not an error but a
        row whose status says why.
    """
    settings = RunSettings(workers=workers, threads=threads, force=force)
    found = _study(study, Path(out), quick)
    prepare_for_study(Path(out), found.name, force=force)
    return run_study(found, Path(out), settings=settings, progress=progress)


def map_(
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    out: str | Path,
    *,
    measure: MapMeasure = "pressure",
    theory: str = HERTZ,
    workers: int | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> MapOutcome:
    """Map where Hertz holds over lateral shift and load; the same call goes on where an interrupted one stopped.

    Parameters
    ----------
    case
        Everything but lateral shift and load.
    lateral_shifts_mm, loads_N
        Of the wheelset, and wheel loads.
    out
        Folder for the results; `fecontact.load` reads them back.
    measure
        By `theory` with friction the laws of creep forces are judged and written too.
    theory
        One of the pressure, whose map is drawn beside that of Hertz.
    workers, force, progress
        As for `run`, with shifts in place of cases.

    Raises
    ------
    InputError
        As `runs.map_run.run_map` does, and for a folder that holds other results.
    """
    prepare_for_map(Path(out), case, force=force)
    settings = RunSettings(workers=workers, force=force)
    return run_map(
        case,
        lateral_shifts_mm,
        loads_N,
        Path(out),
        measure=measure,
        theory=theory,
        settings=settings,
        progress=progress,
    )


def _study(study: str | Path | Study | Iterable[Case], out: Path, quick: bool) -> Study:
    if isinstance(study, Study):
        return study
    if isinstance(study, str | Path):
        return load_study(study, quick=quick)
    cases = tuple(study)
    if not cases or not all(isinstance(case, Case) for case in cases):
        raise InputError("run: give at least one Case and nothing else, or the file of a study")
    return Study(name=out.name, cases=cases)
