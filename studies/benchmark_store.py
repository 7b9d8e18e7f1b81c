"""Cost of thousands of stored cases: resuming a finished study, and judging it again.

It is judged by other criteria. One case is solved in earnest; all others are its files under other names, so that their
sizes are those of real results but for the meshes, which nothing here reads beside their checksums. Measured in
processes of their own: the run that finds nothing to do, tables included, and `fecontact judge`.

    python studies/benchmark_store.py --cases 5000
"""

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import fecontact.runs.study as study_runs
from fecontact.case import Case
from fecontact.jobs import engine
from fecontact.jobs.workers import Crew, WorkResult
from fecontact.outputs.records.results import read_row, write_row
from fecontact.runs.casefile import Study
from fecontact.runs.store import (
    FIELDS_FILE,
    RECORD_FILE,
    ROW_FILE,
    SOLUTION_FILE,
    CaseRecords,
    seal_case,
    write_case_records,
    write_solution,
)
from fecontact.solving.solve import solve

TEMPLATE = Case(roll="given", resolution="quick", refine="never")


def study(count: int) -> Study:
    """A study of `count` cases with loads in steps of 10 N."""
    return Study(name="stored", cases=tuple(replace(TEMPLATE, load_N=50e3 + 10.0 * k) for k in range(count)))


@dataclass(frozen=True, kw_only=True)
class Copy:
    """Replacement for solving a case, which copies the files of the template.

    The name and the load of the case are written into the copies.
    """

    case: Case
    name: str
    template: Path
    settings: Mapping[str, Any]
    loads: Any = None

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        for file in (FIELDS_FILE, RECORD_FILE):
            shutil.copyfile(self.template / file, folder / file)
        record = json.loads((self.template / SOLUTION_FILE).read_text("utf-8"))
        record["case"]["load_N"] = record["loads"][0]["load_N"] = self.case.load_N
        (folder / SOLUTION_FILE).write_text(json.dumps(record), "utf-8")
        row = read_row(self.template / ROW_FILE)
        write_row(folder / ROW_FILE, row | {"id": self.name, "load_kN": self.case.load_N / 1e3})
        return WorkResult()


def fill(out: Path, count: int) -> None:
    """Store all missing cases."""
    template = out / "template"
    if not (template / ROW_FILE).is_file():
        result = solve(TEMPLATE)
        records = CaseRecords.of(result)
        write_solution(result, result.case, template)
        write_case_records(result, records, template, svg=True)
        seal_case(result.case, template)

    study_runs.CaseWork = partial(Copy, template=template)
    engine.make_process_crew = lambda workers, threads: Crew(open=ThreadPoolExecutor, workers=1, together=1)
    study_runs.run_study(study(count), out)


_FILL = """
import sys
from pathlib import Path
sys.path.insert(0, {studies!r})
import benchmark_store
if __name__ == "__main__":
    benchmark_store.fill(Path({out!r}), {count})
"""
# Figures are left out: their time does not depend on the number of cases.
_RESUME = """
import sys, time
from pathlib import Path
sys.path.insert(0, {studies!r})
import benchmark_store, fecontact.runs.study as runs
from fecontact.solving.solve import measure_peak_memory_MB
runs.study_figures = lambda *inputs: ()
begin = time.perf_counter()
outcome = runs.run_study(benchmark_store.study({count}), Path({out!r}))
assert len(outcome.reused) == {count}, outcome.recomputed
print(f"nothing to do: {{time.perf_counter() - begin:.1f}} s, {{measure_peak_memory_MB():.0f}} MB")
"""
_JUDGE = """
import time
from pathlib import Path
from fecontact.case import Criteria
from fecontact.runs.judged_study import judge_study
from fecontact.solving.solve import measure_peak_memory_MB
if __name__ == "__main__":
    begin = time.perf_counter()
    judged = judge_study(Path({out!r}), Criteria(p_max=0.03))
    assert len(judged.rows) == {count} and judged.all_judged, judged.rows[0]["status"]
    print(f"judged again: {{time.perf_counter() - begin:.1f}} s, {{measure_peak_memory_MB():.0f}} MB")
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=5000)
    parser.add_argument("--out", type=Path, default=Path("out/benchmark_store"))
    options = parser.parse_args()
    # separate processes: the peak memory of each is measured alone
    for code in (_FILL, _RESUME, _JUDGE):
        script = options.out / "measured.py"
        script.parent.mkdir(parents=True, exist_ok=True)
        script.write_text(code.format(studies=str(Path(__file__).parent), count=options.cases, out=str(options.out)))
        subprocess.run([sys.executable, str(script)], check=True)


if __name__ == "__main__":
    main()
