"""A stand-in for solving, which worker processes can import; it does what `plan.json` in the study's folder says.

The plan gives for a load in kN what shall happen to its case; `solves.txt` there has a line a solve.
"""

import errno
import json
import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.case import Case, case_record
from fecontact.comparison.measures import MEASURES
from fecontact.errors import ConvergenceError, InputError
from fecontact.files import write_json, write_text
from fecontact.jobs.provenance import provenance

MEMORY = "the factor of 9 degrees of freedom needs about 9.0 GB of memory, 1.0 GB are available; use a larger machine"


def plan(out: Path, **what: str) -> None:
    """Plan for loads, such as kN50="die"."""
    write_json(out / "plan.json", {name.removeprefix("kN"): text for name, text in what.items()})


def solves(out: Path) -> list[str]:
    """Ids in the order in which they were begun."""
    path = out / "solves.txt"
    return path.read_text().split() if path.exists() else []


def solve_into(case: Case, folder: Path, name: str, settings: Mapping[str, Any]) -> None:
    out = folder.parent.parent
    begun = solves(out).count(name)
    with (out / "solves.txt").open("a") as file:
        file.write(name + "\n")
    what = json.loads((out / "plan.json").read_text()) if (out / "plan.json").exists() else {}
    write_text(folder / "rail.vtu", f"mesh of {case.load_N}\n")
    write_text(folder / "case.vtm", "")
    for file in ("wheel.vtu", "contact.vtp"):
        write_text(folder / file, "")
    warnings = _act(what.get(f"{case.load_N / 1e3:g}", what.get("all", "")), begun, settings)
    write_json(folder / "result.json", record(case, warnings) | {"provenance": provenance(case, name, settings)})


def _act(what: str, begun: int, settings: Mapping[str, Any]) -> list[str]:
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
        case ["iteration"]:
            raise ConvergenceError("it did not converge")
        case ["memory"] if begun == 0:
            raise InputError(MEMORY)
        case ["less"] if begun == 0:
            return [f"refinement stopped: {MEMORY}"]
    return []


def record(case: Case, warnings: list[str]) -> dict[str, Any]:
    """A result record with all that a row needs; one number is none, as it can happen."""
    numbers = {name: case.load_N / (3.0 + number) for number, name in enumerate(MEASURES)}
    return {
        "schema": "fecontact/result/1",
        "status": "converged",
        "case": case_record(case),
        "normal_force_N": case.load_N,
        "contact_angle_rad": 0.1,
        "touch_points": [{"rail_y_mm": 1.0 / 3.0, "wheel_y_mm": 2.0, "at_junction": False}],
        "fe": numbers,
        "hertz": numbers,
        "deviation": dict.fromkeys(MEASURES, 0.1),
        "uncertainty": dict.fromkeys(MEASURES, 0.01) | {"approach_mm": float("nan")},
        "verdict": {"verdict": "HOLDS", "measure": "p_max_MPa", "cause": None, "warnings": warnings},
        "rungs": {"half_space": {"p_max_MPa": 1.0}},
        "von_mises": {body: {"von_mises_MPa": 1.0, "depth_mm": 1.0} for body in ("rail", "wheel")},
        "steps": dict.fromkeys(("quadratic_to_true_gap", "half_space_to_bodies"), dict.fromkeys(MEASURES, 0.01)),
        "bodies_step_uncertainty": dict.fromkeys(MEASURES, 0.002),
        "geometry": {
            "junction_distance_mm": float("inf"),
            "junction_distance_over_b": float("inf"),
            "junction_in_patch": False,
            "curvature_variation": 0.1,
            "normal_turn_rad": 0.01,
        },
        "hertz_points": {"shared": {"p_max_MPa": 1.0}},
        "pressure_l2": 0.1,
        "overlap": 0.9,
        "centre_of_pressure_mm": [0.0, 0.1],
        "pieces": 1,
        "hertz_stiffness_GN_per_m15": 1.0,
        "solver": {
            "element_size_mm": [1.0, 1.0],
            "degrees_of_freedom": {"rail": 1},
            "iterations": 3,
            "load_balance": 1e-9,
            "seconds": {"contact": time.perf_counter()},
            "peak_memory_MB": time.perf_counter(),
        },
        "warnings": [],
    }
