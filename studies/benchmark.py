"""Cost of accuracy, of a further load, of a further core and of a larger mesh.

The elliptic test (wheel cylinder R 460, rail R 300, 100 kN, half model) at four meshes, each in a process of its own
on one thread: degrees of freedom, CPU seconds from mesh to comparison, peak memory, errors against exact Hertz. Then
ratios that do not depend on the machine: contact over assembling and factorising, contact over one linear solution, a
further load over the first one, assembly by scalar forms over the plain vector form, growth with the number of
unknowns (also by multigrid), the files of a case over its solution, and a nine-position study on two processes over
one, with what its own process has of all CPU seconds. Nothing here is asserted: tests protect results, not times.

`python studies/benchmark.py [--quick] [--study] [--million] [--against PATH] [--before] [--cores] [--out DIR]`;
`--study` adds the nine-position study, and `--million` two meshes of 0.28 and 0.97 million unknowns by multigrid; both
take minutes, the latter 3 GB. `--against` only compares with another checkout, in turn: placing, Hertz, strips and
half-space, reading and smoothing of a measured pair, the picture, the ParaView files and the record of a case, and
whole commands on one thread and on the default number of threads (`--quick`: the first commands only). `--repeats 3`
gives the least of three runs. `--before` is `--against` an earlier commit. `--cores` makes the map of 13 by 7 cells
with one worker and with two, and says what 2 and 64 cores wait for.

Found (one thread, PARDISO): 33, 52, 78 and 140 thousand unknowns take 0.9, 1.7, 2.7 and 6.1 CPU s and 0.26, 0.35, 0.48
and 0.81 GB; peak -0.03, +0.12, +0.23, +0.23 %, area -1.7, -0.9, -0.5, -0.2 %. The peak stays at +0.23 %, because
elements that are much finer than the far mesh are too stiff; the finer nodes are nearer. Factorisation takes 63 % of
the last one. Multigrid needs 2.2 to 1.4 times as long and 0.9 to 0.7 times the memory; 0.28 and 0.97 million unknowns
take it 20 and 89 CPU s and 1.0 and 2.9 GB. A further load takes a fourteenth of the first one by factors. Time grows as
n^1.3 (PARDISO) and, up to a million, n^1.14. The map takes 145 s with one worker and 78 s with two, as by the model,
which gives 34 s on 64: the longest of 13 positions takes 28 s, and the report 5 s after it.
"""

import argparse
import csv
import heapq
import json
import math
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid
from fecontact.contact_theories.hertz import HertzContact
from fecontact.jobs.workers import set_thread_environment
from fecontact.process import THREAD_VARIABLES

ELLIPTIC = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, refine="never")
# Element sizes along x and across (mm): 5, 8, 12 and 18 on a semi-axis.
SIZES_MM = tuple((7.162 / n, 5.387 / n) for n in (5.25, 8.25, 12.25, 18.25))
LARGE_MM = tuple((7.162 / n, 5.387 / n) for n in (30.25, 61.25))
# Semi-axes of the core of the patch, as a fraction. At the edge of the patch the slope of the pressure is infinite.
CORE = 0.8


def cases(quick: bool = False) -> list[Case]:
    """The elliptic test at four meshes, or at the two coarsest."""
    return [replace(ELLIPTIC, resolution=size) for size in SIZES_MM[: 2 if quick else 4]]


def measure(case: Case) -> dict[str, Any]:
    """Solve a case on a single mesh and time each step."""
    from fecontact.contact.grid import Rung
    from fecontact.judging.comparison import compare
    from fecontact.solving.fine_zone import make_fine_zone
    from fecontact.solving.hertz import compute_hertz
    from fecontact.solving.meshes import couple_bodies, make_coupled_problem
    from fecontact.solving.position import expect_position
    from fecontact.solving.solve import measure_peak_memory_MB

    begin = time.process_time()
    position = expect_position(case)
    zone = make_fine_zone(position.expected, position.element_size_mm)
    bodies = couple_bodies(case, position.placement, zone, position.clock)
    coupling_end = time.process_time()
    problem = make_coupled_problem(position.true_gap, bodies)
    solution = problem.solve(case.load_N)
    contact_end = time.process_time()
    hertz = compute_hertz(case, position.placement)
    comparison = compare(Rung.of(bodies.grid, solution, approach_mm=solution.approach_mm), hertz)
    end = time.process_time()
    again = problem.solve(0.8 * case.load_N)
    further = time.process_time() - end
    # independent random pressures: multigrid starts from its previous solutions
    pressures = np.random.default_rng(1).random((3, solution.pressure_MPa.size))
    start = time.process_time()
    for pressure in pressures:
        bodies.compliance(pressure)
    linear = (time.process_time() - start) / 3.0
    dof = bodies.rail.mesh.unknowns + bodies.wheel.mesh.unknowns
    steps = position.clock.seconds
    return {
        "solver": bodies.rail.solver,
        "degrees_of_freedom": dof,
        "cpu_s": end - begin,
        "dof_per_cpu_s": dof / (end - begin),
        "peak_memory_MB": measure_peak_memory_MB(),
        "p_max_error_percent": -100.0 * comparison.deviation["p_max_MPa"] / (1.0 + comparison.deviation["p_max_MPa"]),
        "a_error_percent": -100.0 * comparison.deviation["a_mm"] / (1.0 + comparison.deviation["a_mm"]),
        "b_error_percent": -100.0 * comparison.deviation["b_mm"] / (1.0 + comparison.deviation["b_mm"]),
        "area_error_percent": -100.0 * comparison.deviation["area_mm2"] / (1.0 + comparison.deviation["area_mm2"]),
        "core_rms_percent": 100.0 * core_rms(bodies.grid, solution.pressure_MPa, hertz),
        "l2_percent": 100.0 * comparison.pressure_l2,
        "mesh_s": steps["mesh"],
        "assemble_s": steps["assemble"],
        "factorise_s": steps["factorise"],
        "contact_s": contact_end - coupling_end,
        "compliance_calls": solution.compliance_calls + 1,
        "linear_solution_s": linear,
        "further_load_s": further,
        "further_load_calls": again.compliance_calls,
    }


def core_rms(grid: ContactGrid, pressure_MPa: np.ndarray, hertz: HertzContact) -> float:
    """Root mean square pressure error in the core of Hertz's ellipse.

    It is relative to Hertz's peak.
    """
    x, s = np.meshgrid(grid.x_mm, grid.s_mm, indexing="ij")
    core = (x / hertz.a_mm) ** 2 + (s / hertz.b_mm) ** 2 < CORE**2
    error = pressure_MPa.reshape(grid.shape)[core] - hertz.pressure_MPa(x[core], s[core])
    return float(np.sqrt(np.mean(error**2)) / hertz.p0_MPa)


def assembly(case: Case) -> dict[str, float]:
    """CPU seconds of a body's stiffness by scalar forms and by vector form.

    The vector form is scikit-fem's.
    """
    from skfem import Basis, ElementHex1, ElementVector
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    from fecontact.bodies import STEEL
    from fecontact.fe.stiffness import _skfem_mesh, assemble_stiffness
    from fecontact.solving.case_meshes import mesh_case

    # all layers have unknowns: the vector form has no layers without unknowns
    mesh = replace(mesh_case(case, "rail"), spacing=None)
    start = time.process_time()
    ours = assemble_stiffness(mesh, STEEL)
    middle = time.process_time()
    basis = Basis(_skfem_mesh(mesh), ElementVector(ElementHex1()), intorder=3)
    plain = linear_elasticity(*lame_parameters(STEEL.young_MPa, STEEL.poisson)).assemble(basis)
    end = time.process_time()
    assert math.isclose(ours.diagonal().sum(), plain.diagonal().sum(), rel_tol=1e-10)
    return {"scalar_forms_s": middle - start, "vector_form_s": end - middle}


def files(case: Case) -> dict[str, float]:
    """CPU seconds of a solution, its files, and its picture.

    Everything that they import is loaded before.
    """
    from fecontact.outputs.figures.case import write_case_figure
    from fecontact.runs.store import CaseRecords, write_case_records, write_solution
    from fecontact.solving.solve import CaseResult, solve

    def keep_case(result: CaseResult, folder: Path) -> None:
        write_solution(result, case, folder)
        write_case_records(result, CaseRecords.of(result), folder)

    start = time.process_time()
    result = solve(case)
    solve_end = time.process_time()
    with TemporaryDirectory() as folder:
        keep_case(result, Path(folder))
        files_start = time.process_time()
        keep_case(result, Path(folder))
        files_end = time.process_time()
        write_case_figure(result, Path(folder) / "case.png")
        picture_end = time.process_time()
    return {"solve_s": solve_end - start, "files_s": files_end - files_start, "picture_s": picture_end - files_end}


def study_share(out: Path) -> float:
    """Main-process share of the CPU seconds of the nine-position study.

    The rest is taken by its two workers.
    """
    from fecontact.runs.study import run

    run(Path(__file__).parent / "first_light.py", out / "share", quick=True, workers=2, force=True)
    spent = os.times()
    process_seconds = spent.user + spent.system
    return process_seconds / (process_seconds + spent.children_user + spent.children_system)


def call_in_process(function: Any, argument: Case | Path) -> Any:
    """Call a function in a separate single-threaded process.

    Peak memory and CPU seconds are then those of the function alone.
    """
    with set_thread_environment(1), ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(function, argument).result()


def study_seconds(workers: int, out: Path, quick: bool) -> float:
    """Wall seconds of the nine-position study."""
    script = Path(__file__).parent / "first_light.py"
    command = [sys.executable, "-m", "fecontact", "run", str(script), "--out", str(out / f"workers-{workers}")]
    start = time.perf_counter()
    subprocess.run([*command, "--workers", str(workers), "--force", *(["--quick"] if quick else [])], check=True)
    return time.perf_counter() - start


# Commit for the comparison of times: the last state before threads followed the size of a factor.
BEFORE = "60aa963a"
# CPU seconds in a single process, after all imports. It runs with the code of both commits.
GEOMETRY = """
import json, sys, time
from dataclasses import replace
from fecontact.case import Case
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.solving.placing import place_case
from fecontact.solving.alone import evaluate_theory
from fecontact.solving.hertz_alone import evaluate_hertz
exact, measured = Case(), Case(rail=sys.argv[1], wheel=sys.argv[2])
def seconds(function, *values):
    start = time.process_time()
    for value in values:
        function(value)
    return (time.process_time() - start) / len(values)
def at(case, *shifts):
    return [replace(case, lateral_shift_mm=shift) for shift in shifts]
place_case(exact)
reading = seconds(lambda _: (resolve_rail(sys.argv[1]), resolve_wheel(sys.argv[2])), 0)
place_case(measured)
told = {
    "place": seconds(place_case, *at(exact, -3.0, -1.0, 1.0, 2.5, 4.0)),
    "place, measured pair": seconds(place_case, *at(measured, -3.0, -1.0, 1.0, 2.5, 4.0)),
    "read and smooth a pair": reading,
    "Hertz, measured pair, the first": seconds(evaluate_hertz, *at(measured, 3.0)),
    "Hertz, measured pair": seconds(evaluate_hertz, *at(measured, -1.0, 2.5)),
}
for name, words in ("strip", "strips at a position"), ("half_space", "half-space at a position"):
    evaluate_theory(replace(exact, lateral_shift_mm=0.5), name)
    told[words] = seconds(lambda case: evaluate_theory(case, name), *at(exact, -3.1, -1.1, 1.1, 2.4, 4.1))
print(json.dumps(told))
"""
# CPU seconds of the files of a case, each after a first call, and the least of three.
CASE_FILES = """
import json, time
from pathlib import Path
from tempfile import TemporaryDirectory
from fecontact.case import Case
from fecontact.outputs.figures.case import write_case_figure
from fecontact.outputs.paraview.vtk import write_case_vtk
from fecontact.runs.store import CaseRecords
from fecontact.solving.solve import solve
result = solve(Case(lateral_shift_mm=3.0, refine="never"))
def seconds(function):
    function()
    times = []
    for _ in range(3):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)
with TemporaryDirectory() as folder:
    print(json.dumps({
        "picture of a case, PNG": seconds(lambda: write_case_figure(result, Path(folder) / "case.png", svg=False)),
        "picture of a case, PNG and SVG": seconds(lambda: write_case_figure(result, Path(folder) / "case.png")),
        "ParaView files of a case": seconds(lambda: write_case_vtk(result, folder)),
        "record of a case, JSON": seconds(lambda: json.dumps(CaseRecords.of(result).record)),
    }))
"""
# Four loads as a study: at an ordinary position, and at one with two patches.
SHIFTS_MM = (3.0, 5.0)
# Each command in a separate process: an ordinary position and its files, two patches, the root of the flange, finer
# meshes, the elements' contact, four loads of a position as a study and as a map, and the map of 13 by 7 cells.
MAP = "map --shifts=-6:6:1 --loads-kn 20:140:20 --out {out}"
QUICK_COMMANDS = (
    "hertz --shift 3",
    "solve --shift 3",
    "solve --shift 3 --out {out}",
)
COMMANDS = (
    *QUICK_COMMANDS,
    "run {first_light} --out {out}",
    "solve --shift 5 --load-kn 50",
    "solve --shift 6.3 --load-kn 60",
    "solve --shift 3 --resolution standard",
    "solve --shift 3 --resolution fine",
    "solve --shift 3 --refine evidence",
    *(f"run {{loads}}/{shift}mm.toml --out {{out}}" for shift in SHIFTS_MM),
    "map --shifts 3 --loads-kn 20,50,80,120 --out {out}",
    MAP,
)
# CPU seconds, wall seconds and peak memory (GB).
Cost: TypeAlias = tuple[float, ...]
FOUR_LOADS = 'rail = "60E1"\nwheel = "S1002"\nlateral_shift_mm = {}\nload_kN = [20.0, 50.0, 80.0, 120.0]\n'


def compare_with_commit(quick: bool, repeats: int) -> str:
    """Table of the costs of the commit `BEFORE` and of the present code."""
    repository, before = Path(__file__).resolve().parents[1], TemporaryDirectory()
    with before as folder:
        tree = Path(folder) / "before"
        git = ["git", "-C", str(repository), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", str(tree), BEFORE], check=True)
        try:
            return compare_checkouts(tree, BEFORE, quick, repeats)
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


def compare_checkouts(before: Path, label: str, quick: bool, repeats: int) -> str:
    """Table of the costs of another checkout and of the present code.

    Both do equal work in turn, so that the load of the machine is equal for both. The least of all repeats counts, and
    the last columns are ratios.

    Parameters
    ----------
    before
        Folder of the other checkout.
    label
        Heading of its columns.
    quick
        Whether only the first commands run.
    repeats
        Number of runs of each part and command.
    """
    checkouts = before, Path(__file__).resolve().parents[1]
    with TemporaryDirectory() as folder:
        pair = Path(folder) / "pair"
        subprocess.run(
            [sys.executable, "-m", "fecontact", "profiles", "--examples", str(pair)], check=True, cwd=checkouts[1]
        )
        files = [str(pair / f"{body}.csv") for body in ("rail", "wheel")]
        parts = [
            [_run_part(root, GEOMETRY, *files) | _run_part(root, CASE_FILES) for root in checkouts]
            for _ in range(repeats)
        ]
    lines = [f"{'CPU ms, one thread':56} {label:>12} {'now':>9} {'ratio':>6}"]
    for name in parts[0][1]:
        if name in parts[0][0]:
            then, now = (min(repeat[k][name] for repeat in parts) for k in (0, 1))
            lines.append(f"{name:56} {1e3 * then:12.1f} {1e3 * now:9.1f} {now / then:6.2f}")
    lines.append(f"{'CPU s, wall s, GB':56} {label:>20} {'now':>20} {'ratios':>14}")
    for threads in (1, None):
        for command in QUICK_COMMANDS if quick else COMMANDS:
            costs = _compare_command(checkouts, command, threads, repeats)
            then, now = (" ".join(f"{value:6.2f}" for value in cost) for cost in costs)
            ratios = " ".join(f"{b / a:4.2f}" for a, b in zip(*costs, strict=True))
            name = command if threads == 1 else f"{command}, default threads"
            lines.append(f"{name:56} {then} {now} {ratios}")
    return "\n".join(lines)


def _compare_command(
    checkouts: tuple[Path, Path], command: str, threads: int | None, repeats: int
) -> tuple[Cost, Cost]:
    """Least costs of a command in both checkouts."""
    runs = [[_run_command(root, command, threads) for root in checkouts] for _ in range(repeats)]
    before, now = (tuple(min(run[k][i] for run in runs) for i in range(3)) for k in (0, 1))
    return before, now


def _checkout_environment(root: Path, threads: int | None) -> dict[str, str]:
    """Environment variables for the source of a checkout.

    Python may write compiled files, so that imports are compiled once, as on a machine where the source was used
    before. Without a number of threads the program chooses it.
    """
    left_out = {"PYTHONDONTWRITEBYTECODE", *THREAD_VARIABLES}
    environment = {name: value for name, value in os.environ.items() if name not in left_out}
    numbers = {} if threads is None else dict.fromkeys(THREAD_VARIABLES, str(threads))
    return {**environment, "PYTHONPATH": str(root), **numbers}


def _run_part(root: Path, code: str, *files: str) -> dict[str, float]:
    """Run a script on a single thread and read its CPU seconds by name."""
    process = subprocess.run(
        [sys.executable, "-c", code, *files],
        check=True,
        cwd=root,
        env=_checkout_environment(root, 1),
        stdout=subprocess.PIPE,
        text=True,
    )
    return dict(json.loads(process.stdout))


def _run_command(root: Path, command: str, threads: int | None = 1) -> Cost:
    """CPU seconds, wall seconds and peak memory (GB) of a command in a separate process.

    3 is the exit code of an open verdict. A study and a map use a single worker, and its CPU seconds and
    memory are included.
    """
    with TemporaryDirectory() as out:
        for shift in SHIFTS_MM:
            (Path(out) / f"{shift}mm.toml").write_text(FOUR_LOADS.format(shift), encoding="utf-8")
        first_light = Path(__file__).resolve().parent / "first_light.py"
        words = command.format(out=Path(out) / "made", loads=out, first_light=first_light).split()
        arguments = [
            sys.executable,
            "-m",
            "fecontact",
            *words,
            *(["--workers", "1"] if words[0] in ("run", "map") else []),
        ]
        environment, messages = _checkout_environment(root, threads), Path(out) / "messages"
        with messages.open("w") as stream:
            start = time.perf_counter()
            process = subprocess.Popen(arguments, cwd=root, env=environment, stdout=subprocess.DEVNULL, stderr=stream)
            _, status, usage = os.wait4(process.pid, 0)
            wall = time.perf_counter() - start
        assert os.waitstatus_to_exitcode(status) in (0, 3), f"{command}: {messages.read_text('utf-8')}"
        return usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024.0**2


# --- Idle time of cores: the positions of a map take different times, and one process makes its tables and report.


@dataclass(frozen=True, kw_only=True)
class MapTiming:
    """Wall seconds of a map, its positions, and the work before and after them."""

    seconds: float
    positions: tuple[float, ...]
    before: float
    after: float


def make_map(workers: int, out: Path) -> MapTiming:
    """Make the map and time it.

    The seconds of positions are valid for one worker, which ends one position before it begins the next.
    """
    command = [*MAP.format(out=out).split(), "--workers", str(workers), "--quiet", "--force"]
    start = time.time()
    subprocess.run([sys.executable, "-m", "fecontact", *command], check=True)
    end = time.time()
    # a folder gets its name as the position is finished
    finished = sorted(path.stat().st_ctime for path in (out / "positions").iterdir() if path.is_dir())
    log = (out / "run.log").read_text("utf-8").splitlines()
    begun = datetime.strptime(next(line for line in log if "0 of" in line)[:23], "%Y-%m-%d %H:%M:%S,%f").timestamp()
    return MapTiming(
        seconds=end - start,
        positions=tuple(last - first for first, last in pairwise((begun, *finished))),
        before=begun - start,
        after=end - finished[-1],
    )


def makespan(seconds: Iterable[float], workers: int) -> float:
    """Wall seconds of jobs that are given in order to free workers."""
    free = [0.0] * workers
    for duration in seconds:
        heapq.heapreplace(free, free[0] + duration)
    return max(free)


def cores(out: Path) -> str:
    """Table of the map's wall seconds with 1 and 2 workers, and modelled with 64."""
    by_one, by_two = (make_map(workers, out / f"map-{workers}") for workers in (1, 2))
    work = sum(by_one.positions)
    lines = [
        f"a map of {len(by_one.positions)} positions: {by_one.seconds:.0f} s with one worker,"
        f" {by_two.seconds:.0f} s with two",
        f"positions take {min(by_one.positions):.1f} to {max(by_one.positions):.1f} s, {work:.0f} s in all;"
        f" before them {by_one.before:.1f} s, after them {by_one.after:.1f} s (two workers: {by_two.after:.1f} s)",
    ]
    longest_first = sorted(by_one.positions, reverse=True)
    for workers in (2, 64):
        jobs = makespan(longest_first, workers)
        total = by_one.before + jobs + by_one.after
        lines.append(
            f"by a model {workers} workers need {total:.0f} s, of which the positions take {jobs:.0f} s"
            f" ({work / workers / jobs:.0%} of the workers' time is work then)"
        )
    return "\n".join(lines)


def exponent(rows: list[dict[str, Any]], column: str) -> float:
    """Growth of a time with the number of unknowns: the slope in logarithms."""
    x = np.log([row["degrees_of_freedom"] for row in rows])
    return float(np.polyfit(x, np.log([row[column] for row in rows]), 1)[0])


def report(rows: list[dict[str, Any]], multigrid: list[dict[str, Any]], forms: dict[str, float]) -> str:
    """Table of the meshes, then the ratios."""
    lines = [
        "solver     DOF   CPU s  DOF/CPU s  peak MB   p0 %    a %    b %  area %  core RMS %   L2 %  contact calls"
    ]
    for row in (*rows, *multigrid):
        lines.append(
            f"{row['solver']:7} {row['degrees_of_freedom']:7d} {row['cpu_s']:6.1f} {row['dof_per_cpu_s']:10.0f}"
            f" {row['peak_memory_MB']:8.0f} {row['p_max_error_percent']:+6.2f} {row['a_error_percent']:+6.2f}"
            f" {row['b_error_percent']:+6.2f} {row['area_error_percent']:+7.2f} {row['core_rms_percent']:11.2f}"
            f" {row['l2_percent']:6.2f}"
            f" {row['compliance_calls']:9d}"
        )
    last = rows[-1]
    share = {step: last[f"{step}_s"] / last["cpu_s"] for step in ("mesh", "assemble", "factorise", "contact")}
    lines += [
        f"contact / (assembling and factorising): {share['contact'] / (share['assemble'] + share['factorise']):.2f}",
        f"parts of the whole: {', '.join(f'{step} {fraction:.0%}' for step, fraction in share.items())}",
        f"contact / one linear solution of both bodies: {last['contact_s'] / last['linear_solution_s']:.1f}",
        f"a further load / the first: {last['further_load_s'] / last['cpu_s']:.3f}"
        f" ({last['further_load_calls']} calls)",
        f"assembly, vector form / scalar forms: {forms['vector_form_s'] / forms['scalar_forms_s']:.1f}",
        f"growth of the whole with the unknowns, pardiso: n^{exponent(rows, 'cpu_s'):.2f}",
    ]
    if len(multigrid) > 1:
        lines.append(f"growth of the whole with the unknowns, amg: n^{exponent(multigrid, 'cpu_s'):.2f}")
    return "\n".join(lines)


def figure(rows: list[dict[str, Any]], multigrid: list[dict[str, Any]], path: Path) -> None:
    """Errors against CPU seconds."""
    from fecontact.outputs.style import (
        SERIES_COLOURS,
        SERIES_MARKS,
        add_grid,
        add_legend_beside,
        blank_figure,
        save_figure,
        set_plain_log_scale,
    )

    picture = blank_figure(9.0, 4.6)
    axes = picture.add_subplot()
    columns = (("l2_percent", "L2 of the pressure"), ("area_error_percent", "area"), ("p_max_error_percent", "peak"))
    for number, (column, label) in enumerate(columns):
        for group, line, filled in ((rows, "-", True), (multigrid, "--", False)):
            if group:
                cpu, error = [row["cpu_s"] for row in group], [abs(row[column]) for row in group]
                solver = {"pardiso": "PARDISO", "amg": "multigrid"}.get(group[0]["solver"], group[0]["solver"])
                style = {
                    "color": SERIES_COLOURS[number],
                    "marker": SERIES_MARKS[number],
                    "mfc": SERIES_COLOURS[number] if filled else "white",
                }
                axes.plot(cpu, error, line, ms=5, label=f"{label}, {solver}", **style)
    set_plain_log_scale(axes)
    add_grid(axes)
    axes.set_xlabel("CPU seconds from mesh to comparison, one thread")
    axes.set_ylabel("error against exact Hertz in %")
    add_legend_beside(axes)
    save_figure(picture, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/benchmark"))
    parser.add_argument("--quick", action="store_true", help="two meshes only")
    parser.add_argument("--study", action="store_true", help="the nine-position study on one and two processes too")
    parser.add_argument("--million", action="store_true", help="up to a million unknowns by multigrid too")
    parser.add_argument("--cores", action="store_true", help="the map of 13 by 7 cells by 1 and 2 workers, and no more")
    parser.add_argument("--before", action="store_true", help=f"compare with commit {BEFORE}, and do nothing else")
    parser.add_argument("--against", type=Path, help="compare with another checkout, and do nothing else")
    parser.add_argument("--repeats", type=int, default=1, help="runs of each part and command in a comparison")
    options = parser.parse_args()
    if options.before:
        print(compare_with_commit(options.quick, options.repeats))
        return
    if options.against is not None:
        against = options.against.resolve()
        print(compare_checkouts(against, against.name, options.quick, options.repeats))
        return
    options.out.mkdir(parents=True, exist_ok=True)
    if options.cores:
        print(cores(options.out))
        return
    chosen = cases(options.quick)
    rows = [call_in_process(measure, case) for case in chosen]
    large = [replace(ELLIPTIC, resolution=size) for size in LARGE_MM] if options.million else []
    multigrid = [call_in_process(measure, replace(case, solver="amg")) for case in (*chosen, *large)]
    text = report(rows, multigrid, call_in_process(assembly, chosen[0]))
    file_seconds = call_in_process(files, Case(lateral_shift_mm=3.0))
    text += f"\nfiles of a case / its solution: {file_seconds['files_s'] / file_seconds['solve_s']:.2f}"
    text += f", its picture alone {file_seconds['picture_s'] / file_seconds['solve_s']:.2f}"
    if options.study:
        seconds_by_one, seconds_by_two = (study_seconds(workers, options.out, options.quick) for workers in (1, 2))
        text += (
            f"\nnine positions: {seconds_by_one:.0f} s with 1 process, {seconds_by_two:.0f} s with 2:"
            f" {seconds_by_one / seconds_by_two:.2f} times faster"
        )
        text += (
            f"\nnine positions in small: {call_in_process(study_share, options.out):.0%} of the CPU seconds"
            " in their own process"
        )
    with (options.out / "benchmark.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows([*rows, *multigrid])
    figure(rows, multigrid, options.out / "benchmark.png")
    print(text)


if __name__ == "__main__":
    main()
