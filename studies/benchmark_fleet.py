"""Cost of a large fleet: screening from measured files to tables, and the report.

Worn and noisy copies of profiles of the library, written with a seed (`fecontact fleet examples`), every wheel on every
rail at ten positions. The report is timed on as many rows as asked for: the screened ones, again and again under other
names of wheels. Times are of processes of their own; memory is the largest of a worker.

The CPU time of the screening alone is that of a run with read files and no finished pair, minus that of a run with
nothing to do. With `--against`, a different checkout screens the same files in turn, because times on a busy machine
are comparable only within minutes.

`--jobs` only distributes this number of empty jobs to two processes, and to two workers of a Dask cluster on this
machine: CPU time and memory of the process that distributes them, and of the scheduler.

    python studies/benchmark_fleet.py --wheels 100 --rails 10 --report-rows 100000
    python studies/benchmark_fleet.py --wheels 100 --rails 100
    python studies/benchmark_fleet.py --wheels 4 --rails 4 --workers 1 --repeats 3 --against ../earlier
    python studies/benchmark_fleet.py --jobs 10000
"""

import argparse
import contextlib
import json
import os
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
import pyarrow.parquet as parquet
from pyarrow import Table, array, concat_tables

from fecontact.features.fleet.fleet_jobs import run_fleet_jobs
from fecontact.jobs.engine import RunSettings, open_run
from fecontact.jobs.workers import WorkResult
from fecontact.process import THREAD_VARIABLES

HERE = Path(__file__).resolve().parents[1]
MANY_POSITIONS = 100_000


def run_timed(words: str, *command: str, checkout: Path = HERE) -> float:
    """Run a command of a checkout, print its cost, and return its CPU seconds.

    The cost is seconds, CPU seconds and peak memory. The memory is the largest of all commands until then.
    """
    begun, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    arguments = [sys.executable, "-m", "fecontact", "fleet", *command]
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL, env=environment)
    elapsed, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{words}: {elapsed:.0f} s, {cpu:.0f} CPU s, at most {after.ru_maxrss / 1024.0:.0f} MB a process", flush=True)
    return cpu


def time_screening(files: str, screened: Path, workers: int, checkout: Path) -> float:
    """CPU seconds of screening all pairs by a checkout.

    Reading files and starting processes are not included.
    """
    run = ("run", f"{files}/fleet.toml", "--out", str(screened), "--workers", str(workers))
    shutil.rmtree(screened / "pairs")
    cpu = run_timed(f"screen, {checkout.name}", *run, checkout=checkout)
    return cpu - run_timed(f"nothing to do, {checkout.name}", *run, checkout=checkout)


def compare_checkouts(files: str, out: Path, workers: int, repeats: int, checkouts: dict[str, Path]) -> None:
    """Print the CPU time of screening by each checkout, and the ratio of the times."""
    cpu: dict[str, list[float]] = {name: [] for name in checkouts}
    for name, checkout in checkouts.items():
        run = ("run", f"{files}/fleet.toml", "--out", str(out / name), "--workers", str(workers))
        run_timed(f"read and screen, {name}", *run, checkout=checkout)
    for _ in range(repeats):
        for name, checkout in checkouts.items():
            cpu[name].append(time_screening(files, out / name, workers, checkout))
    table = concat_tables([parquet.ParquetFile(path).read() for path in (out / "this" / "screen").iterdir()])
    positions, variants = table.num_rows, sum(filter(None, table["variants"].to_pylist()))
    for name, seconds in cpu.items():
        shortest = min(seconds)
        print(
            f"{name}: {1e3 * shortest / positions:.1f} CPU ms a position, {1e3 * shortest / variants:.2f} CPU ms a"
            f" variant ({variants / positions:.1f} variants a position); extrapolated to {MANY_POSITIONS} positions:"
            f" {shortest / positions * MANY_POSITIONS / 3600.0:.2f} CPU hours; {shortest / min(cpu['this']):.2f} times"
            " the time of this checkout"
        )


def repeat_tables(screened: Path, out: Path, rows: int) -> int:
    """Write a folder with a screened fleet's tables repeated; return its number of rows.

    The tables are repeated until the folder has at least `rows` rows.
    """
    (out / "screen").mkdir(parents=True, exist_ok=True)
    for name in ("fleet.json", "fleet.toml"):
        (out / name).write_bytes((screened / name).read_bytes())
    tables = [parquet.ParquetFile(path).read() for path in sorted((screened / "screen").iterdir())]
    times = -(-rows // sum(table.num_rows for table in tables))
    profiles = parquet.ParquetFile(screened / "profiles.parquet").read()
    copies = list(_wheels(profiles, times))
    parquet.write_table(concat_tables(copies), out / "profiles.parquet")
    for copy in range(times):
        for number, table in enumerate(tables):
            names = array([f"{name}, {copy}" for name in table["wheel"].to_pylist()])
            weights = array([weight / times for weight in table["weight"].to_pylist()])
            renamed_table = table.set_column(0, "wheel", names).set_column(2, "weight", weights)
            parquet.write_table(renamed_table, out / "screen" / f"part-{copy:03d}{number:03d}.parquet")
    return times * sum(table.num_rows for table in tables)


def _wheels(profiles: Table, times: int) -> Iterator[Table]:
    """The rails, then the wheels under `times` names."""
    bodies, place = profiles["body"].to_pylist(), profiles.column_names.index("name")
    yield profiles.filter(array([body == "rail" for body in bodies]))
    wheels = profiles.filter(array([body == "wheel" for body in bodies]))
    for copy in range(times):
        yield wheels.set_column(place, "name", array([f"{name}, {copy}" for name in wheels["name"].to_pylist()]))


@dataclass(frozen=True)
class EmptyJob:
    """Job without work."""

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        return WorkResult()


def distribute(count: int, address: str | None) -> None:
    """Distribute empty jobs to two processes or to a Dask cluster, and print the cost."""
    process = psutil.Process()
    with TemporaryDirectory() as folder:
        settings = RunSettings(workers=None if address else 2, scheduler=address)
        with open_run(Path(folder), Path(folder) / "jobs", settings) as run:
            begun, cpu, memory = time.perf_counter(), time.process_time(), process.memory_info().rss
            works = {f"{number:07d}": EmptyJob() for number in range(count)}
            run_fleet_jobs(works, dict.fromkeys(works, "empty"), Path(folder) / "jobs", None, run)
            elapsed, cpu, memory = (
                time.perf_counter() - begun,
                time.process_time() - cpu,
                process.memory_info().rss - memory,
            )
    receiver = "Dask" if address else "processes"
    print(
        f"{count} empty jobs by {receiver}: {1e3 * cpu / count:.2f} CPU ms and {1e-3 * memory / count:.1f} kB a job,"
        f" {elapsed:.0f} s",
        flush=True,
    )


@contextlib.contextmanager
def run_dask_cluster(environment: dict[str, str]) -> Iterator[tuple[str, psutil.Process]]:
    """Run a scheduler and two workers on this machine: address, and process of the scheduler."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        worker = ("dask_worker", "--nthreads", "1", "--no-nanny", "--local-directory", folder)
        processes = [
            subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{name}", *options, "--no-dashboard", "--scheduler-file", file],
                env=environment,
                stderr=subprocess.DEVNULL,
            )
            for name, *options in (("dask_scheduler", "--host", "127.0.0.1", "--port", "0"), worker, worker)
        ]
        try:
            while not file.is_file():
                time.sleep(0.1)
            yield json.loads(file.read_text("utf-8"))["address"], psutil.Process(processes[0].pid)
        finally:
            for process in processes:
                process.kill()
                process.wait()


def compare_distributions(count: int) -> None:
    """Print the cost of distributing empty jobs by processes and by Dask.

    Each distribution is made by a separate process.
    """
    # workers import the class of the jobs by the name of its module
    paths = os.pathsep.join([str(HERE), str(HERE / "studies")])
    environment = os.environ | {"PYTHONPATH": paths} | dict.fromkeys(THREAD_VARIABLES, "1")
    with run_dask_cluster(environment) as (address, scheduler):
        before = scheduler.cpu_times()
        for scheduler_address in (None, address):
            code = f"import benchmark_fleet; benchmark_fleet.distribute({count}, {scheduler_address!r})"
            subprocess.run([sys.executable, "-c", code], check=True, env=environment)
        after = scheduler.cpu_times()
        seconds = after.user + after.system - before.user - before.system
        print(
            f"scheduler of Dask: {1e3 * seconds / count:.2f} CPU ms a job, {1e-6 * scheduler.memory_info().rss:.0f} MB"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wheels", type=int, default=100)
    parser.add_argument("--rails", type=int, default=100)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--report-rows", type=int, default=0)
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--against", type=Path, help="folder of a different checkout")
    parser.add_argument("--out", type=Path, default=Path("out/benchmark_fleet"))
    parser.add_argument("--jobs", type=int, default=0)
    options = parser.parse_args()
    if options.jobs:
        compare_distributions(options.jobs)
        return
    files, screened, many = (str(options.out / name) for name in ("files", "this", "many"))
    checkouts = {"this": HERE} | ({"other": options.against.resolve()} if options.against else {})
    run_timed("files", "examples", files, "--wheels", str(options.wheels), "--rails", str(options.rails))
    compare_checkouts(files, options.out, options.workers, options.repeats, checkouts)
    run_timed("report", "report", screened)
    if options.report_rows:
        rows = repeat_tables(Path(screened), Path(many), options.report_rows)
        run_timed(f"report of {rows} rows", "report", many)


if __name__ == "__main__":
    main()
