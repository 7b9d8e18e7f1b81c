"""A stand-in for solving, which worker processes can import.

It follows `plan.json` in the study's folder. The plan gives for a load in kN what shall happen to its case;
`solves.txt` there has a line a solve.
"""

import errno
import math
import os
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import ConvergenceError, MemoryShortageError
from fecontact.files import read_json, write_json, write_text
from fecontact.jobs.workers import WorkResult
from fecontact.judging.measures import MEASURES, UNCERTAINTIES
from fecontact.judging.verdict import judge
from fecontact.outputs.flat_records import flatten
from fecontact.outputs.records.results import input_columns, write_row
from fecontact.runs.identity import make_provenance
from fecontact.runs.store import RECORD_FILE, ROW_FILE

MEMORY = "the factor of 9 degrees of freedom needs about 9.0 GB of memory, 1.0 GB are available; use a larger machine"


def plan(out: Path, **what: str) -> None:
    """Plan for loads, such as kN50="die"."""
    write_json(out / "plan.json", {name.removeprefix("kN"): text for name, text in what.items()})


def solves(out: Path) -> list[str]:
    """Ids in the order in which they were begun."""
    path = out / "solves.txt"
    return path.read_text().split() if path.exists() else []


@dataclass(frozen=True, kw_only=True)
class FakeWork:
    """Stands for the work of a case."""

    case: Case
    name: str
    settings: Mapping[str, Any]
    loads: object = None

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        """Note the job, write small files, and act by the plan of the test."""
        out = folder.parent.parent
        begun = solves(out).count(self.name)
        with (out / "solves.txt").open("a") as file:
            file.write(("" if finished is None else "again:") + self.name + "\n")
        what = read_json(out / "plan.json") if (out / "plan.json").exists() else {}
        write_text(folder / "rail.vtu", f"mesh of {self.case.load_N}\n")
        for file in ("bodies.vtm", "case.vtm", "wheel.vtu", "pressure.vtp", "elements.vtp", "hertz_ellipse.vtp"):
            write_text(folder / file, "")
        short = _act(what.get(f"{self.case.load_N / 1e3:g}", what.get("all", "")), begun)
        write_json(
            folder / RECORD_FILE, {"provenance": make_provenance(self.case, id=self.name, settings=self.settings)}
        )
        write_row(folder / ROW_FILE, {"id": self.name, **row(self.case), "verdict_warnings": MEMORY if short else ""})
        return WorkResult(short_of_memory=short)


def _act(what: str, begun: int) -> bool:
    """Do the planned action; returns whether all of it had too little memory."""
    match what.split():
        case ["die"]:
            os._exit(9)
        case ["die", "once"] if begun == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        case ["sleep", seconds]:
            time.sleep(float(seconds))
        case ["disk"]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "rail.vtu")
        case ["bug"]:
            raise ZeroDivisionError("no such thing")
        case ["wrong"]:
            raise KeyError("area_mm2")
        case ["iteration"]:
            raise ConvergenceError("it did not converge")
        case ["memory"] if begun == 0:
            raise MemoryShortageError(MEMORY)
        case ["less"] if begun == 0:
            return True
    return False


def row(case: Case) -> dict[str, Any]:
    """A row with the columns that tables and figures need; some numbers are none, as it can happen."""
    columns: dict[str, Any] = {"status": "converged", **input_columns(case), "contact_rail_y_mm": 1.0 / 3.0}
    for number, measure in enumerate(MEASURES):
        columns[f"fe_{measure}"] = columns[f"hertz_{measure}"] = case.load_N / (3.0 + number)
    # of points that cannot be thinned it is not known how uncertain they leave the peak
    uncertainty = {
        name: math.nan if name == "p_max_MPa" else 0.01 for name, declared in UNCERTAINTIES.items() if declared.reading
    }
    verdict = judge(dict.fromkeys(UNCERTAINTIES, 0.1), uncertainty, case.criteria)
    return columns | {
        **flatten({"hertz": {"deviation": dict.fromkeys(UNCERTAINTIES, 0.1), "uncertainty": uncertainty}}),
        "geometry_junction_distance_mm": math.inf,
        "verdict_answer": verdict.answer,
        "verdict_measure": verdict.measure,
        "verdict_failing": "; ".join(verdict.failing),
        "verdict_cause": None,
        "pressure_l2": 0.1,
        "fe_lobes": 1,
        "fe_patch_count": 1,
        "resolution": None,
        "solver_meshes": 2,
        "solver_degrees_of_freedom_rail": 1,
        "seconds": time.perf_counter(),
        "cpu_seconds": time.process_time(),
        "peak_memory_MB": time.perf_counter(),
    }
