"""The command line: parse, call, print; nothing heavy is imported before a command needs it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, get_args

from cyclopts import App, CycloptsError, Parameter

from fecontact import __version__
from fecontact.case import Criteria, Group
from fecontact.errors import FecontactError, InputError
from fecontact.options import CaseOptions, options_of

app = App(
    name="fecontact",
    version=__version__,
    help="Where does Hertz's ellipse hold for a railway wheel on a rail?",
    help_epilogue="Exit codes: 0 solved, or the same; 1 results differ (compare); 2 bad input;"
    " 3 a case did not converge or could not be solved.",
)
baseline_app = App(name="baseline", help="Baselines: the results that later ones are held against.")
app.command(baseline_app)


# a map has lists of these two, and the theory needs no meshes
_EVERY = options_of(*get_args(Group))
_OF_MAP = options_of(*get_args(Group), without=("lateral_shift_mm", "load_N"))
_OF_HERTZ = options_of("place", "load", "material")
_OF_MESH = options_of("place", "load", "material", "bodies", "solution")
_OF_VERDICT = options_of("verdict")
# a table has a list of shifts, finds the roll, and shows both sides
_OF_TRACK = options_of("place", without=("lateral_shift_mm", "roll_rad", "wheelset", "side"))
if TYPE_CHECKING:
    EveryOption: TypeAlias = CaseOptions
    MapOptions: TypeAlias = CaseOptions
    HertzOptions: TypeAlias = CaseOptions
    MeshOptions: TypeAlias = CaseOptions
    VerdictOptions: TypeAlias = CaseOptions
    TrackOptions: TypeAlias = CaseOptions
else:
    EveryOption, MapOptions, HertzOptions, MeshOptions, VerdictOptions, TrackOptions = map(
        type, (_EVERY, _OF_MAP, _OF_HERTZ, _OF_MESH, _OF_VERDICT, _OF_TRACK)
    )


@app.command
def run(
    study: Path,
    *,
    out: Path,
    quick: Annotated[bool, Parameter(negative="")] = False,
    workers: int | None = None,
    threads: int = 1,
    force: Annotated[bool, Parameter(name="--force", negative="--resume")] = False,
    part: str | None = None,
    scheduler: str | None = None,
) -> int:
    """Run a study and write its tables, figures and ParaView files; finished cases are reused.

    Parameters
    ----------
    study
        A script of studies/ or a TOML file of cases.
    out
        Folder for the results.
    quick
        The small version of the study.
    workers
        Cases at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each case computes on.
    force
        Solve finished cases again.
    part
        Solve only part i of N, given as i/N; the same command without it then puts all parts together.
    scheduler
        Address of a Dask scheduler whose workers share the folder of the results.
    """
    from fecontact.jobs.engine import RunSettings, parse_part
    from fecontact.outputs.tables import print_table
    from fecontact.runs.casefile import load_study
    from fecontact.runs.study import run_study

    settings = RunSettings(
        workers=workers, threads=threads, force=force, part=parse_part(part) if part else None, scheduler=scheduler
    )
    loaded = load_study(study, quick=quick)
    with _progress(len(loaded.cases), first=0) as progress:
        outcome = run_study(loaded, out, settings=settings, progress=progress)
    _print_recomputed(outcome.recomputed)
    print_table(outcome.rows)
    if outcome.reused:
        print(f"{len(outcome.reused)} finished cases were reused; --force solves them again")
    if outcome.conclusion:
        print(outcome.conclusion)
    if settings.part is None:
        shown = outcome.collections[:3] + (("...",) if len(outcome.collections) > 3 else ())
        print(
            f"Results in {out}: study.csv, study.png, cases/; for ParaView: {', '.join((*shown, 'cases/*/case.vtm'))}"
        )
    else:
        print(f"Part {part} is in {out}; when all parts are, the same command without --part puts them together")
    return 0 if outcome.all_converged else 3


def _print_recomputed(recomputed: Mapping[str, str]) -> None:
    """Say which finished jobs were solved, or evaluated, again, and why."""
    for reason in dict.fromkeys(recomputed.values()):
        names = [name for name, why in recomputed.items() if why == reason]
        print(f"done again, {reason}: {', '.join(names)}", file=sys.stderr)


@app.command
def validate(
    *studies: Path,
    out: Path,
    report: Path | None = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
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
        Markdown file for the table of all checks; VALIDATION.md in `out`, if not given.
    quick
        The small version of each study.
    workers
        Cases at a time, as for `run`.
    """
    from fecontact.files import write_text
    from fecontact.jobs.engine import RunSettings
    from fecontact.outputs.record import versions
    from fecontact.regression.checks import Check
    from fecontact.regression.checks import report as validation_report
    from fecontact.runs.casefile import load_study
    from fecontact.runs.study import run_study

    loaded = [load_study(path, quick=quick) for path in studies or sorted(Path("studies").glob("[0-9]*.py"))]
    checked = [study for study in loaded if study.checks is not None]
    if not checked:
        raise InputError("validate: none of the studies has a function checks(rows); give scripts of studies/ that do")
    found: dict[str, list[Check]] = {}
    unusable = []
    for study in checked:
        print(study.name, file=sys.stderr)
        with _progress(len(study.cases), first=0) as progress:
            outcome = run_study(study, out / study.name, settings=RunSettings(workers=workers), progress=progress)
        bad = [str(row["id"]) for row in outcome.rows if row["status"] != "converged"]
        if bad:
            unusable.append(f"{study.name}: {', '.join(bad)}")
        usable = [row for row in outcome.rows if row["status"] == "converged"]
        assert study.checks is not None
        found[study.name] = study.checks(usable)
    path = write_text(report or out / "VALIDATION.md", validation_report(found, versions(), unusable))
    every = [check for own in found.values() for check in own]
    failed = [check for check in every if not check.passed]
    for check in failed:
        print(
            f"FAIL {check.quantity}, {check.case}: {check.deviation_percent:+.2f} % (limit {check.limit_percent:g} %)"
        )
    print(f"{len(every)} checks, {len(failed)} failed, {len(unusable)} studies with unusable cases: {path}")
    return 3 if unusable else int(bool(failed))


@app.command
def solve(
    options: EveryOption = _EVERY,
    *,
    json: Annotated[bool, Parameter(negative="")] = False,
    out: Path | None = None,
) -> int:
    """Solve one position with finite elements and compare it with Hertz.

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    out
        Folder for the case's JSON, ParaView files and figure.
    """
    from fecontact.files import json_text
    from fecontact.outputs.record import result_record
    from fecontact.outputs.rows import case_row
    from fecontact.outputs.tables import print_case, print_table
    from fecontact.runs.case_store import solve_into_folder
    from fecontact.solving.solve import solve as solve_case

    case = options.case()
    with _progress(1) as progress:

        def step(name: str) -> None:
            progress(0, 1, name)

        # what was solved is kept before it is shown: what it is shown on may be full, or closed
        result = solve_case(case, progress=step) if out is None else solve_into_folder(case, out, progress=step)
    record = result_record(result)
    if json:
        print(json_text(record), flush=True)
    else:
        print_table([case_row(result)])
        print_case(record)
    return 0 if result.status == "converged" else 3


@app.command(name="map")
def map_(
    options: MapOptions = _OF_MAP,
    *,
    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)],
    loads_kn: Annotated[str, Parameter(name="--loads-kn", allow_leading_hyphen=True)] = "10,20,50,80,100,125,150",
    out: Path,
    adaptive: Annotated[bool, Parameter(negative="")] = False,
    workers: int | None = None,
    threads: int = 1,
    force: Annotated[bool, Parameter(name="--force", negative="--resume")] = False,
    part: str | None = None,
    scheduler: str | None = None,
) -> int:
    """Map where Hertz holds over lateral shift and load, with the load up to which it holds at each shift.

    Parameters
    ----------
    shifts
        Lateral shifts in mm: numbers and ranges FROM:TO:STEP, separated by commas, such as -6:6:0.5.
    loads_kn
        Wheel loads in kN, likewise.
    out
        Folder for map.csv, stiffness.csv, map.json and map.png, written after each shift, and for each shift a folder
        in positions/ from which a later map with the same inputs and loads takes it.
    adaptive
        Solve every second shift, and those between only where the half-space leaves a doubt; marked in all outputs.
    workers
        Shifts at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each shift computes on.
    force
        Solve finished shifts again.
    part
        Solve only part i of N, given as i/N; the same command without it then puts all parts together.
    scheduler
        Address of a Dask scheduler whose workers share the folder of the results.
    """
    from fecontact.inputs.texts import parse_numbers
    from fecontact.jobs.engine import RunSettings, parse_part
    from fecontact.outputs.map import map_table
    from fecontact.runs.map_run import run_map

    settings = RunSettings(
        workers=workers, threads=threads, force=force, part=parse_part(part) if part else None, scheduler=scheduler
    )
    positions, case = parse_numbers(shifts, "shifts"), options.case()
    loads_N = [1e3 * load for load in parse_numbers(loads_kn, "loads")]
    with _progress(len(positions), first=0) as progress:
        outcome = run_map(case, positions, loads_N, out, adaptive=adaptive, settings=settings, progress=progress)
    _print_recomputed(outcome.recomputed)
    print(map_table(outcome.made))
    if outcome.reused:
        print(f"{len(outcome.reused)} finished positions were reused; --force solves them again")
    if settings.part is None:
        print(f"Results in {out}: map.csv, stiffness.csv, map.json, map.png")
    else:
        print(f"Part {part} is in {out}; when all parts are, the same command without --part puts them together")
    return 0 if outcome.made.all_solved else 3


@app.command
def judge(folder: Path, options: VerdictOptions = _OF_VERDICT, *, out: Path | None = None) -> int:
    """Judge stored results again by other criteria, without gmsh and finite elements.

    Parameters
    ----------
    folder
        Of a study, a map, or a case that fecontact wrote; it stays as it is.
    out
        Folder for the tables of the new verdicts (study.csv and study.json, or map.csv, map.json and map.png).
    """
    criteria = options.case().criteria
    if (folder / "map.json").is_file():
        return _judge_map(folder, criteria, out)
    from fecontact.outputs.measure_words import criteria_text
    from fecontact.outputs.tables import print_table
    from fecontact.runs.judging import judge_study

    judged = judge_study(folder, criteria, out)
    print_table(judged.rows)
    for name, (before, now) in judged.changed.items():
        print(f"{name}: {before} -> {now}")
    cases, changed = _count(len(judged.rows), "case"), _count(len(judged.changed), "verdict")
    lost = sum("verdict" not in row for row in judged.rows)
    print(f"{cases} judged by {criteria_text(criteria)}: {changed} changed" + (f", {lost} not judged" if lost else ""))
    return 0 if judged.all_judged else 3


def _judge_map(folder: Path, criteria: Criteria, out: Path | None) -> int:
    from fecontact.outputs.map import map_table
    from fecontact.outputs.measure_words import criteria_text, unknown_text
    from fecontact.runs.judging import judge_map

    made, problems = judge_map(folder, criteria, out)
    print(map_table(made))
    for problem in problems:
        print(f"not judged: {problem}", file=sys.stderr)
    unknown = [cell.inferred.verdict.unknown for cell in made.cells if cell.inferred and cell.inferred.verdict.unknown]
    if unknown:
        missing = dict.fromkeys(name for names in unknown for name in names)
        print(f"{_count(len(unknown), 'inferred cell')} left open: {unknown_text(missing)}", file=sys.stderr)
    print(f"{_count(len(made.cells), 'cell')} judged by {criteria_text(criteria)}")
    return 0 if made.all_solved else 3


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


@app.command
def hertz(options: HertzOptions = _OF_HERTZ, *, json: Annotated[bool, Parameter(negative="")] = False) -> int:
    """Hertz's ellipse at the touch points, analytic only (no mesh, no gmsh).

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.outputs.record import hertz_record
    from fecontact.outputs.tables import print_hertz

    record = hertz_record(options.case())
    if json:
        print(json_text(record))
    else:
        print_hertz(record)
    return 0


@app.command
def geometry(
    options: TrackOptions = _OF_TRACK,
    *,
    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)] = "-8:8:0.5",
    json: Annotated[bool, Parameter(negative="")] = False,
    out: Path | None = None,
) -> int:
    """Touch points of a rigid wheelset over its lateral shift, rolling radii and equivalent conicity (no mesh).

    Parameters
    ----------
    shifts
        Lateral shifts in mm, positive towards the left rail: numbers and ranges FROM:TO:STEP, separated by commas.
    json
        Print the table as JSON and nothing else.
    out
        File of the picture (PNG).
    """
    from fecontact.files import json_text
    from fecontact.inputs.texts import parse_numbers
    from fecontact.outputs.contact_functions import functions_of_case, functions_record, print_functions

    case = options.case()
    found = functions_of_case(case, parse_numbers(shifts, "shifts"))
    if out is not None:
        from fecontact.outputs.contact_figure import functions_figure

        functions_figure(case, found, out)
    record = functions_record(case, found)
    if json:
        print(json_text(record))
        return 0
    print_functions(record)
    if out is not None:
        print(f"picture: {out}")
    return 0


@app.command
def profiles(name: str | None = None, *, out: Path | None = None) -> int:
    """List the profile library, or show one profile and plot its line and curvature.

    Parameters
    ----------
    name
        Library name or profile file.
    out
        File of the picture (PNG); NAME.png if not given.
    """
    from fecontact.outputs.tables import print_library, print_profile
    from fecontact.profiles.resolve import resolve_rail, resolve_wheel

    if name is None:
        print_library()
        return 0
    try:
        profile = resolve_rail(name)
    except InputError as as_rail:
        try:
            profile = resolve_wheel(name).profile
        except InputError:
            raise as_rail from None
    from fecontact.outputs.figures import profile_figure

    print_profile(profile)
    path = out or Path(f"{Path(name).stem.replace(':', '-')}.png")
    profile_figure(profile, path)
    print(f"picture: {path}")
    return 0


@app.command
def mesh(body: Literal["rail", "wheel"], options: MeshOptions = _OF_MESH, *, out: Path) -> int:
    """Write the mesh of one body, refined about the contact of the given position.

    Parameters
    ----------
    body
        Which of the two bodies.
    out
        File to write: .msh (gmsh 4.1), .inp (CalculiX, Abaqus) or .vtu.
    """
    from fecontact.outputs.meshfile import write_mesh
    from fecontact.solving.coupled_mesh import mesh_case

    made = mesh_case(options.case(), body)
    write_mesh(made, out)
    print(f"{out}: {len(made.points)} nodes, {len(made.hexes)} hexahedra, surfaces {', '.join(made.surfaces)}")
    return 0


@app.command
def compare(
    baseline: Path,
    new: Path,
    *,
    match: str | None = None,
    tolerance: Path | None = None,
    json: Path | None = None,
    html: Path | None = None,
) -> int:
    """Compare two sets of results, case by case; exit code 1 if they differ by more than the tolerances.

    Parameters
    ----------
    baseline
        Folder that run, map or solve --out wrote, study.json, study.csv, map.csv, row.json, or a CSV of
        studies/baselines.
    new
        Likewise.
    match
        Columns by which cases are matched where their ids differ, such as shift,load; in full, or shift, load, roll and
        yaw.
    tolerance
        TOML file with [kinds.NAME] and [columns.NAME] tables of relative and absolute tolerances.
    json
        File for the comparison as JSON.
    html
        File for the comparison as HTML.
    """
    from fecontact.files import write_json, write_text
    from fecontact.outputs.comparison_report import comparison_html, comparison_record, print_comparison
    from fecontact.regression.compare import compare_tables
    from fecontact.regression.tables import load_table
    from fecontact.regression.tolerances import read_tolerances

    tolerances = read_tolerances(tolerance) if tolerance is not None else None
    comparison = compare_tables(
        load_table(baseline), load_table(new), tolerances, match=() if match is None else match.split(",")
    )
    if json is not None:
        write_json(json, comparison_record(comparison))
    if html is not None:
        write_text(html, comparison_html(comparison))
    print_comparison(comparison)
    return 0 if comparison.same else 1


@baseline_app.command(name="update")
def baseline_update(
    study_result: Path,
    *,
    reason: str,
    baselines: Path = Path("studies/baselines"),
    allow_failed: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Make the results of a study its baseline, and say what changes.

    Parameters
    ----------
    study_result
        Folder that `run` wrote.
    reason
        Why the new results are right; kept beside the baseline.
    baselines
        Folder of the baselines.
    allow_failed
        Take cases that failed or did not converge as well.
    """
    from fecontact.outputs.comparison_report import print_comparison
    from fecontact.regression.baselines import update_baseline

    update = update_baseline(study_result, baselines, reason=reason, allow_failed=allow_failed)
    if update.comparison is not None:
        print_comparison(update.comparison)
    print(f"{update.path}: {update.text}")
    return 0


@contextmanager
def _progress(total: int, *, first: int = 1) -> Iterator[Callable[[int, int, str], None]]:
    """A progress line on a terminal's standard error, plain lines a case elsewhere, numbered from `first`."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        last = ""

        def plain(number: int, count: int, text: str) -> None:
            nonlocal last
            name = text.partition(":")[0]
            if count > 1 and name != last:
                print(f"{number + first}/{count} {name}", file=sys.stderr, flush=True)
            last = name

        yield plain
        return
    columns = (BarColumn(20), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=total)

        def show(number: int, count: int, text: str) -> None:
            bar.update(task, completed=number, total=count, description=text)

        yield show


def run_script(path: str, arguments: Sequence[str] | None = None) -> None:
    """Run a study script as a program: `python studies/NAME.py [--out DIR] [--quick]`; ends the process."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if "--out" not in given and "--help" not in given:
        given += ["--out", f"out/{Path(path).stem}"]
    main(["run", path, *given])


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point of the program `fecontact`."""
    sys.exit(call(arguments))


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    try:
        code: Any = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        return int(code or 0)
    except CycloptsError as error:
        print(f"error: {error}", file=sys.stderr)
        return InputError.exit_code
    except FecontactError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    except OSError as error:
        print(
            f"error: {error.filename or ''}: {error.strerror or error}; choose another file or folder", file=sys.stderr
        )
        return InputError.exit_code
    except KeyboardInterrupt:
        print("interrupted; what was finished is kept", file=sys.stderr)
        return 130
