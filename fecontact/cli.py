"""The command line: parse, call, print; nothing heavy is imported before a command needs it."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, get_args

from cyclopts import App, CycloptsError, Parameter

from fecontact import __version__, start
from fecontact.case import Criteria, Group
from fecontact.console import count, many, print_reasons, solving
from fecontact.creep import Creep
from fecontact.errors import FecontactError, InputError
from fecontact.options import CaseOptions, options_of

app = App(
    name="fecontact",
    # it is said below what an interrupted command leaves
    suppress_keyboard_interrupt=False,
    version=__version__,
    help="Where does Hertz's ellipse hold for a railway wheel on a rail?",
    help_epilogue="Exit codes: 0 solved, or the same; 1 results differ (compare); 2 bad input;"
    " 3 a case did not converge or could not be solved.",
)
for first in (start.demo, start.check, start.init, start.doctor):
    app.command(first)
app.register_install_completion_command(help="Install completion for this shell, and say where.")
baseline_app = App(name="baseline", help="Baselines: the results that later ones are held against.")
app.command(baseline_app)


# a map has lists of these two, and the theory needs no meshes
_EVERY = options_of(*get_args(Group))
_OF_MAP = options_of(*get_args(Group), without=("lateral_shift_mm", "load_N"))
# no stress is looked at, and nothing is solved
_OF_HERTZ = options_of("place", "files", "load", "material", without=("yield_MPa",))
_OF_PLACE = options_of("place", "files", "load", "material", "solution")
_OF_FILE = options_of("files", without=("library",))
_OF_MESH = options_of(
    *("place", "files", "load", "material", "bodies", "solution"),
    without=("yield_MPa", "name", "solver", "refine_degrees_of_freedom"),
)
_OF_VERDICT = options_of("verdict", "creep")
# a table has a list of shifts, finds the roll, and shows both sides
_OF_TRACK = options_of("place", "files", without=("lateral_shift_mm", "roll_rad", "wheelset", "side"))
if TYPE_CHECKING:
    from fecontact.profiles.curve import Profile

    EveryOption: TypeAlias = CaseOptions
    MapOptions: TypeAlias = CaseOptions
    HertzOptions: TypeAlias = CaseOptions
    MeshOptions: TypeAlias = CaseOptions
    PlaceOptions: TypeAlias = CaseOptions
    FileOptions: TypeAlias = CaseOptions
    VerdictOptions: TypeAlias = CaseOptions
    TrackOptions: TypeAlias = CaseOptions
else:
    EveryOption, MapOptions, HertzOptions, MeshOptions, VerdictOptions, PlaceOptions, FileOptions, TrackOptions = map(
        type, (_EVERY, _OF_MAP, _OF_HERTZ, _OF_MESH, _OF_VERDICT, _OF_PLACE, _OF_FILE, _OF_TRACK)
    )


@app.command
def run(
    study: Path,
    *,
    out: Path,
    quick: Annotated[bool, Parameter(negative="")] = False,
    workers: int | None = None,
    threads: int = 1,
    force: Annotated[bool, Parameter(negative="")] = False,
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
        Solve finished cases again instead of using them.
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
    with many("cases") as progress:
        outcome = run_study(loaded, out, settings=settings, progress=progress)
    _print_recomputed(outcome.recomputed)
    print_table(outcome.rows)
    if outcome.reused:
        print(f"{len(outcome.reused)} finished cases were reused; --force solves them again")
    if outcome.conclusion:
        print(outcome.conclusion)
    lost = {str(row["id"]): str(row["status"]) for row in outcome.rows if row["status"] != "converged"}
    print_reasons(f"{len(lost)} of {count(len(outcome.rows), 'case')} without a usable result", lost)
    if settings.part is None:
        shown = outcome.collections[:3] + (("...",) if len(outcome.collections) > 3 else ())
        print(
            f"Results in {out}: report.html, study.csv, study.png, cases/;"
            f" for ParaView: {', '.join((*shown, 'cases/*/case.vtm'))}, or fecontact view {out}"
        )
    else:
        print(f"Part {part} is in {out}; when all parts are, the same command without --part puts them together")
    return 0 if outcome.all_converged else 3


def _print_recomputed(recomputed: Mapping[str, str]) -> None:
    """Say which finished jobs were solved, or evaluated, again, and why."""
    print_reasons("done again", recomputed)


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
        with many("cases") as progress:
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
    with solving() as progress:
        # what was solved is kept before it is shown: what it is shown on may be full, or closed
        result = solve_case(case, progress=progress) if out is None else solve_into_folder(case, out, progress=progress)
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
    force: Annotated[bool, Parameter(negative="")] = False,
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
        Folder for map.csv, stiffness.csv, map.json and map.png (with friction also map_force.png, where Hertz holds for
        creep forces), written after each shift, and for each shift a folder
        in positions/ from which a later map with the same inputs and loads takes it.
    adaptive
        Solve every second shift, and those between only where the half-space leaves a doubt; marked in all outputs.
    workers
        Shifts at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each shift computes on.
    force
        Solve finished shifts again instead of using them.
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
    with many("positions") as progress:
        outcome = run_map(case, positions, loads_N, out, adaptive=adaptive, settings=settings, progress=progress)
    _print_recomputed(outcome.recomputed)
    print(map_table(outcome.made, width=_width()))
    if outcome.reused:
        print(f"{len(outcome.reused)} finished positions were reused; --force solves them again")
    lost = {
        f"{cell.lateral_shift_mm:+g} mm, {cell.load_N / 1e3:g} kN": str(cell.status)
        for cell in outcome.made.cells
        if cell.status not in ("converged", "inferred")
    }
    print_reasons(f"{len(lost)} of {count(len(outcome.made.cells), 'cell')} without a usable result", lost)
    if settings.part is None:
        stiffness = "stiffness.csv, " if (out / "stiffness.csv").is_file() else ""
        print(f"Results in {out}: report.html, map.csv, {stiffness}map.json, map.png")
        if not stiffness:
            print("No stiffness.csv: a fit over the load needs three loads or more at a shift")
    else:
        print(f"Part {part} is in {out}; when all parts are, the same command without --part puts them together")
    return 0 if outcome.made.all_solved else 3


@app.command
def judge(folder: Path, options: VerdictOptions = _OF_VERDICT, *, out: Path | None = None) -> int:
    """Judge stored results again by other criteria, or with friction and creepages, without gmsh and finite elements.

    Parameters
    ----------
    folder
        Of a study, a map, or a case that fecontact wrote; it stays as it is.
    out
        Folder for the tables of the new verdicts (study.csv and study.json, or map.csv, map.json and map.png).
    """
    case = options.case()
    case.creep.refuse_unheard()
    # without friction those of each case stay
    criteria, creep = case.criteria, case.creep if case.creep.asked else None
    if (folder / "map.json").is_file():
        return _judge_map(folder, criteria, out, creep)
    from fecontact.outputs.creep import force_lines
    from fecontact.outputs.measure_words import criteria_text
    from fecontact.outputs.tables import print_table
    from fecontact.runs.judging import judge_study

    judged = judge_study(folder, criteria, out, creep=creep)
    print_table(judged.rows)
    for line in force_lines(judged.rows):
        print(line)
    for name, (before, now) in judged.changed.items():
        print(f"{name}: {before} -> {now}")
    cases, changed = count(len(judged.rows), "case"), count(len(judged.changed), "verdict")
    lost = sum("verdict" not in row for row in judged.rows)
    print(f"{cases} judged by {criteria_text(criteria)}: {changed} changed" + (f", {lost} not judged" if lost else ""))
    return 0 if judged.all_judged else 3


def _judge_map(folder: Path, criteria: Criteria, out: Path | None, creep: Creep | None) -> int:
    from fecontact.outputs.map import map_table
    from fecontact.outputs.measure_words import criteria_text, unknown_text
    from fecontact.runs.judging import judge_map

    made, problems = judge_map(folder, criteria, out, creep=creep)
    print(map_table(made, width=_width()))
    for problem in problems:
        print(f"not judged: {problem}", file=sys.stderr)
    unknown = [cell.inferred.verdict.unknown for cell in made.cells if cell.inferred and cell.inferred.verdict.unknown]
    if unknown:
        missing = dict.fromkeys(name for names in unknown for name in names)
        print(f"{count(len(unknown), 'inferred cell')} left open: {unknown_text(missing)}", file=sys.stderr)
    print(f"{count(len(made.cells), 'cell')} judged by {criteria_text(criteria)}")
    return 0 if made.all_solved else 3


def _width() -> int | None:
    """Columns of the terminal, None where the output goes elsewhere."""
    import shutil

    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


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
def creep(
    *,
    a_mm: float,
    b_mm: float,
    normal_force_kn: Annotated[float, Parameter(name="--normal-force-kn")],
    friction: float,
    xi: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0,
    eta: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0,
    spin_per_mm: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0,
    theory: str = "all",
    young_mpa: float = 210_000.0,
    poisson: float = 0.3,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Creep forces on an elliptic contact by every theory; analytic, no mesh, no gmsh.

    Forces are those on the wheel: x in the running direction, y to the field side, z up for the left wheel. Creepages
    are those of the wheel against the rail: positive xi gives negative Fx.

    Parameters
    ----------
    a_mm
        Semi-axis along the rolling direction in mm.
    b_mm
        Semi-axis across in mm.
    normal_force_kn
        Normal force in kN.
    friction
        Coefficient of friction, > 0.
    xi
        Longitudinal creepage, over the rolling speed.
    eta
        Lateral creepage.
    spin_per_mm
        Spin in 1/mm.
    theory
        kalker, vermeulen_johnson, she, polach, fastsim, rolling_half_space, several with commas between, or all.
    young_mpa
        Young's modulus of both bodies in MPa.
    poisson
        Poisson's ratio of both bodies.
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.outputs.creep import ellipse_creep, print_ellipse

    record = ellipse_creep(
        a_mm=a_mm,
        b_mm=b_mm,
        normal_force_N=1e3 * normal_force_kn,
        friction=friction,
        creepages=(xi, eta, spin_per_mm),
        young_MPa=young_mpa,
        poisson=poisson,
        theories=theory.split(","),
    )
    if json:
        print(json_text(record))
    else:
        print_ellipse(record)
    return 0


@app.command
def place(
    options: PlaceOptions = _OF_PLACE,
    *,
    out: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """See a case before it is solved: touch points, curvatures, expected patch and mesh, time and memory. Without gmsh.

    Parameters
    ----------
    out
        File of a picture (PNG) of the pair in position and the curvatures about its contact.
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.outputs.preview import preview_figure, preview_record, preview_text
    from fecontact.solving.preview import preview

    seen = preview(options.case())
    print(json_text(preview_record(seen)) if json else preview_text(seen), flush=True)
    if out is not None:
        preview_figure(seen, out)
        print(f"picture: {out}", file=sys.stderr if json else sys.stdout)
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
def profiles(
    name: str | None = None,
    options: FileOptions = _OF_FILE,
    *,
    kind: Literal["rail", "wheel"] | None = None,
    out: Path | None = None,
    write: Path | None = None,
    library: Path | None = None,
) -> int:
    """List the profile library, or show one profile and plot its line and curvature.

    Parameters
    ----------
    name
        Library name or profile file.
    kind
        What the file is; if not given, a rail where it can be one.
    out
        File for the picture (PNG); none is made if not given.
    write
        File to write the profile into: .prr, .prw, .csv, .txt or .toml.
    library
        Folder of profiles of your own.
    """
    from fecontact.outputs.tables import print_library, print_profile
    from fecontact.profiles.library import in_folder
    from fecontact.profiles.resolve import resolve_rail, resolve_wheel

    if name is None:
        print_library(folder=library)
        return 0
    case = options.case()
    found = name if library is None else in_folder(name, library)
    if kind is not None:
        profile = (
            resolve_rail(found, case.rail_file) if kind == "rail" else resolve_wheel(found, case.wheel_file).profile
        )
    else:
        try:
            profile = resolve_rail(found, case.rail_file)
        except InputError as as_rail:
            try:
                profile = resolve_wheel(found, case.wheel_file).profile
            except InputError:
                raise as_rail from None
    print_profile(profile)
    _print_measured(profile)
    if out is None:
        print("--out FILE.png draws its line and curvature")
    else:
        print(f"picture: {_profile_picture(profile, out)}")
    if write is not None:
        from fecontact.files import write_text
        from fecontact.profiles.writers import profile_text

        print(f"written: {write_text(write, profile_text(profile, write.suffix))}")
    return 0


def _profile_picture(profile: Profile, path: Path) -> Path:
    """Line and curvature; with its points, where it was made from some."""
    from fecontact.outputs.figures import profile_figure
    from fecontact.outputs.preview import measured_figure

    return profile_figure(profile, path) if profile.measured is None else measured_figure(profile, path)


def _print_measured(profile: Profile) -> None:
    """What the points behind a line say of it."""
    from fecontact.outputs.preview import nearest_text
    from fecontact.profiles.recognition import nearest, points_of

    if (points := points_of(profile)) is not None:
        print(nearest_text(nearest(points, profile.kind)))


@app.command
def mesh(
    body: Literal["rail", "wheel", "both"],
    options: MeshOptions = _OF_MESH,
    *,
    out: Path,
    element: Literal["C3D8", "C3D8I"] = "C3D8I",
) -> int:
    """Write the mesh of one body or both, refined about the contact of the given position.

    Parameters
    ----------
    body
        Which body; of both a .inp is a deck with materials, supports, contact and load, ready to run.
    out
        File to write: .msh (gmsh 4.1), .inp (CalculiX, Abaqus) or .vtu.
    element
        Type of the elements in .inp; C3D8 is the one that `solve` has.
    """
    from fecontact.outputs.meshfile import write_mesh
    from fecontact.solving.meshed_case import MeshedPair, mesh_case, mesh_pair

    case = options.case()
    meshed = mesh_pair(case) if body == "both" else mesh_case(case, body)
    write_mesh(meshed, out, element=element)
    for made in (meshed.rail, meshed.wheel) if isinstance(meshed, MeshedPair) else (meshed,):
        print(
            f"{out}: {made.name}, {len(made.points)} nodes, {len(made.hexes)} hexahedra, surfaces"
            f" {', '.join(made.surfaces)}" + ("; half of it, x >= 0" if made.half else "")
        )
    return 0


@app.command
def view(out: Path) -> int:
    """Write view.py into a folder of results, which shows the contact in ParaView.

    Parameters
    ----------
    out
        Folder that run or solve --out wrote.
    """
    import shlex

    from fecontact.outputs.paraview import write_view

    path = write_view(out)
    print(f"{path}: open it with (cd {shlex.quote(str(path.parent))}; paraview --script={path.name})")
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


def run_script(path: str, arguments: Sequence[str] | None = None) -> None:
    """Run a study script as a program: `python studies/NAME.py [--out DIR] [--quick]`; ends the process."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if "--out" not in given and "--help" not in given:
        given += ["--out", f"out/{Path(path).stem}"]
    main(["run", path, *given])


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point of the program `fecontact`."""
    sys.exit(call(arguments))


def _system_error(error: OSError) -> str:
    """What the system refused, and what to do."""
    if "cannot open shared object file" in str(error):
        return f"a system library is missing ({error}); `fecontact doctor` says which package has it"
    return f"{f'{error.filename}: ' if error.filename else ''}{error.strerror or error}; choose another file or folder"


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        # a terminal without some sign shows a question mark for it
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code: Any = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        # here a reader that is gone is noticed, and not at the interpreter's end
        sys.stdout.flush()
        return int(code or 0)
    except CycloptsError as error:
        print(f"error: {error}", file=sys.stderr)
        return InputError.exit_code
    except FecontactError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:
        # whoever reads has enough, as `head` does; nothing more is written, also not at the interpreter's end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        print(f"error: {_system_error(error)}", file=sys.stderr)
        return InputError.exit_code
    except KeyboardInterrupt:
        print("interrupted; what was finished is kept", file=sys.stderr)
        return 130
