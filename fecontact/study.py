"""Many cases: solve one after the other, write each as soon as it is done, lose nothing when one fails."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.casefile import Study
from fecontact.errors import FecontactError
from fecontact.pipeline import CaseResult, solve

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, kw_only=True)
class StudyOutcome:
    """Rows of a study, one a case, and the text of its conclusion; `all_converged` is False if any row is unusable."""

    rows: tuple[dict[str, Any], ...]
    conclusion: str | None

    @property
    def all_converged(self) -> bool:
        """Whether every case gave a result that may be used."""
        return all(row["status"] == "converged" for row in self.rows)


def case_id(case: Case) -> str:
    """Readable name of a case with a hash of all its inputs, usable as a file name."""
    from fecontact.outputs.record import case_record

    digest = hashlib.sha256(json.dumps(case_record(case), sort_keys=True).encode()).hexdigest()[:8]
    names = "_".join("".join(c if c.isalnum() else "-" for c in Path(name).stem) for name in (case.rail, case.wheel))
    return f"{names}_{case.lateral_shift_mm:+.2f}mm_{case.load_N / 1e3:g}kN_{digest}"


def run_study(study: Study, out: Path, *, progress: Progress | None = None) -> StudyOutcome:
    """Solve all cases of a study and write its outputs below `out`.

    A case that cannot be solved becomes a row that says why; the others go on. Tables are written after each
    case, so that an interrupted study keeps what it has finished.
    """
    from fecontact.outputs.figures import study_figure

    rows: list[dict[str, Any]] = []
    folders: list[Path | None] = []
    for number, case in enumerate(study.cases):
        name = case_id(case)

        def step(what: str, number: int = number, name: str = name) -> None:
            if progress is not None:
                progress(number, len(study.cases), f"{name}: {what}")

        try:
            result = solve(case, progress=step)
        except FecontactError as error:
            rows.append(_failed_row(case, name, error))
            folders.append(None)
        else:
            step("write")
            folder = out / "cases" / name
            rows.append(write_case(result, folder, name))
            folders.append(folder)
        _write_tables(study, rows, out)
    _write_collections(rows, folders, out)
    if any(row.get("p_max_fe_MPa") is not None for row in rows):
        study_figure(rows, out / "study.png")
    conclusion = None
    if study.conclude is not None:
        unusable = sum(row["status"] != "converged" for row in rows)
        conclusion = (
            f"No conclusion: {unusable} of {len(rows)} cases gave no usable result."
            if unusable
            else study.conclude(rows, out)
        )
    return StudyOutcome(rows=tuple(rows), conclusion=conclusion)


def write_case(result: CaseResult, folder: Path, name: str) -> dict[str, Any]:
    """Write all files of one case into a folder and return its row."""
    from fecontact.outputs.figures import case_figure
    from fecontact.outputs.files import write_json
    from fecontact.outputs.record import case_record, result_record, row
    from fecontact.outputs.vtk import write_case_vtk

    folder.mkdir(parents=True, exist_ok=True)
    record = result_record(result)
    write_case_vtk(result, folder)
    case_figure(result, folder / "case.png")
    write_json(folder / "case.json", case_record(result.case))
    write_json(folder / "result.json", record)
    return {"id": name, **row(record)}


def _failed_row(case: Case, name: str, error: FecontactError) -> dict[str, Any]:
    return {
        "id": name,
        "status": f"failed: {error}",
        "rail": case.rail,
        "wheel": case.wheel,
        "lateral_shift_mm": case.lateral_shift_mm,
        "load_kN": case.load_N / 1e3,
    }


def _write_tables(study: Study, rows: list[dict[str, Any]], out: Path) -> None:
    from fecontact.outputs.files import write_json
    from fecontact.outputs.record import versions
    from fecontact.outputs.tables import write_csv

    out.mkdir(parents=True, exist_ok=True)
    write_csv(rows, out / "study.csv")
    write_json(
        out / "study.json",
        {
            "schema": "fecontact/study/1",
            "study": study.name,
            "cases": len(study.cases),
            "rows": rows,
            "versions": versions(),
        },
    )


def _write_collections(rows: list[dict[str, Any]], folders: list[Path | None], out: Path) -> None:
    """One .pvd a load and pair: ParaView merges equal times, so two loads cannot share one."""
    from fecontact.outputs.vtk import write_pvd

    groups: dict[tuple[str, str, float], list[tuple[float, Path]]] = {}
    for row, folder in zip(rows, folders, strict=True):
        if folder is not None:
            key = (str(row["rail"]), str(row["wheel"]), float(row["load_kN"]))
            groups.setdefault(key, []).append((float(row["lateral_shift_mm"]), folder))
    for (rail, wheel, load), entries in groups.items():
        pair = (
            "" if len({key[:2] for key in groups}) == 1 else f"_{Path(rail).stem}_{Path(wheel).stem}".replace(":", "-")
        )
        name = f"study{pair}.pvd" if len({key[2] for key in groups}) == 1 else f"study{pair}_{load:g}kN.pvd"
        times = [shift for shift, _ in entries]
        if len(set(times)) == len(times):
            write_pvd(out / name, sorted(entries))
