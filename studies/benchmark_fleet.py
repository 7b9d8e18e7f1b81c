"""What a large fleet costs: screening it from measured files to its tables, and its report.

Worn and noisy copies of profiles of the library, written with a seed (`fecontact fleet examples`), every wheel on every
rail at ten positions. The report is timed on as many rows as asked for: the screened ones, again and again under other
names of wheels. Times are of processes of their own; memory is the largest of a worker.

    python studies/benchmark_fleet.py --wheels 100 --rails 10 --report-rows 100000
    python studies/benchmark_fleet.py --wheels 100 --rails 100
"""

import argparse
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pyarrow.parquet as parquet
from pyarrow import Table, array, concat_tables


def measured(words: str, *command: str) -> None:
    """Run a command, and print its seconds, its CPU seconds and the largest memory of all commands so far."""
    begun, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-m", "fecontact", "fleet", *command], check=True, stdout=subprocess.DEVNULL)
    taken, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{words}: {taken:.0f} s, {cpu:.0f} CPU s, at most {after.ru_maxrss / 1024.0:.0f} MB a process", flush=True)


def repeated(screened: Path, out: Path, rows: int) -> int:
    """A folder with the tables of a screened fleet as often as it takes for so many rows; how many it has."""
    (out / "screen").mkdir(parents=True, exist_ok=True)
    for name in ("fleet.json", "fleet.toml"):
        (out / name).write_bytes((screened / name).read_bytes())
    parts = [parquet.ParquetFile(path).read() for path in sorted((screened / "screen").iterdir())]
    times = -(-rows // sum(part.num_rows for part in parts))
    profiles = parquet.ParquetFile(screened / "profiles.parquet").read()
    copies = list(_wheels(profiles, times))
    parquet.write_table(concat_tables(copies), out / "profiles.parquet")
    for copy in range(times):
        for number, part in enumerate(parts):
            names = array([f"{name}, {copy}" for name in part["wheel"].to_pylist()])
            weights = array([weight / times for weight in part["weight"].to_pylist()])
            own = part.set_column(0, "wheel", names).set_column(2, "weight", weights)
            parquet.write_table(own, out / "screen" / f"part-{copy:03d}{number:03d}.parquet")
    return times * sum(part.num_rows for part in parts)


def _wheels(profiles: Table, times: int) -> Iterator[Table]:
    """The rails, and the wheels under as many names."""
    bodies, place = profiles["body"].to_pylist(), profiles.column_names.index("name")
    yield profiles.filter(array([body == "rail" for body in bodies]))
    wheels = profiles.filter(array([body == "wheel" for body in bodies]))
    for copy in range(times):
        yield wheels.set_column(place, "name", array([f"{name}, {copy}" for name in wheels["name"].to_pylist()]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wheels", type=int, default=100)
    parser.add_argument("--rails", type=int, default=100)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--report-rows", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("out/benchmark_fleet"))
    given = parser.parse_args()
    files, screened, many = (str(given.out / name) for name in ("files", "screened", "many"))
    measured("files", "examples", files, "--wheels", str(given.wheels), "--rails", str(given.rails))
    measured("screen", "run", f"{files}/fleet.toml", "--out", screened, "--workers", str(given.workers))
    measured("nothing to do", "run", f"{files}/fleet.toml", "--out", screened, "--workers", str(given.workers))
    measured("report", "report", screened)
    if given.report_rows:
        rows = repeated(Path(screened), Path(many), given.report_rows)
        measured(f"report of {rows} rows", "report", many)


if __name__ == "__main__":
    main()
