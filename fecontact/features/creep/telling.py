"""Creep forces told: records, columns of rows, tables and lines; forces on an ellipse that is given by numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

from fecontact.contact_theories.rolling.creepage import CreepForce
from fecontact.features.creep.creep_comparison import CreepComparison
from fecontact.features.creep.judged_force import FORCE
from fecontact.outputs.flat_records import Record, picked, told
from fecontact.outputs.parts import Telling
from fecontact.outputs.tables import Column, Item, Of, Table, number, table_of, text
from fecontact.outputs.terminal import Lines


def _creep_record(found: CreepComparison) -> Record:
    """Creep forces of a judged load; deviations are parts of the friction times the normal force."""
    judged, of_muN = found.verdict, "deviation_of_muN uncertainty_of_muN"
    return {
        **picked(found, "friction limit_N creepages centre_creepages curved surface_of_muN"),
        "theories": {
            theory: {"hertz": force_record(one.hertz), "fe": force_record(one.fe), **picked(one, of_muN)}
            for theory, one in found.theories.items()
        },
        "verdict": {
            **picked(judged.verdict, "answer cause"),
            **picked(judged.decided[0], of_muN),
            "limit_of_muN": judged.limits[FORCE],
        },
        "decided": [told(at.creepages) | picked(at, of_muN) for at in judged.decided],
        "warnings": list(found.warnings),
    }


def force_record(force: CreepForce | str) -> Record:
    """A creep force, or why there is none."""
    if isinstance(force, str):
        return {"problem": force}
    # zero is told without a sign
    return {name: value if value is None else value + 0.0 for name, value in asdict(force).items()}


_SIDES = {"hertz": "Hertz", "fe": "FE"}


def _force(heading: str, of: Of, form: str, factor: float = 1.0) -> Column:
    """A column of forces, of which a theory has none where it has a problem."""
    known = number(heading, of, form, factor, none="")
    return replace(known, cell=lambda force: "none" if "problem" in force else known.cell(force))


_FORCE = (
    text("theory", "name"),
    _force("Fx\nkN", "fx_N", "{:+.3f}", 1e-3),
    _force("Fy\nkN", "fy_N", "{:+.3f}", 1e-3),
    _force("Mz\nN m", "mz_Nmm", "{:+.2f}", 1e-3),
    _force("|F|\n% of mu N", lambda force: math.hypot(force["fx_N"], force["fy_N"]) / force["limit_N"], "{:.1f}", 1e2),
    _force("adhesion\nmm²", "adhesion_area_mm2", "{:.1f}"),
    _force("power/speed\nN", "power_per_speed_N", "{:.2f}"),
)


def force_lines(rows: Sequence[Item]) -> Lines:
    """One line a row that has a verdict of forces."""
    for row in rows:
        if row.get("creep_verdict_answer"):
            off, unsure = (1e2 * row[f"creep_verdict_{name}_of_muN"] for name in ("deviation", "uncertainty"))
            cause = row.get("creep_verdict_cause")
            yield f"{row['id']}: {_force_verdict(row['creep_verdict_answer'], off, unsure, cause)}"


def creep_lines(record: Item) -> Lines:
    """The forces of a result record."""
    verdict, theories = record["verdict"], record["theories"]
    sides = {f"{theory}, {of}": found[side] for theory, found in theories.items() for side, of in _SIDES.items()}
    yield _force_table("creep forces", record, sides)
    yield from _problems({theory: found["fe"] for theory, found in theories.items()})
    off = {name: found["deviation_of_muN"] for name, found in theories.items()}
    told = ", ".join(f"{name} {1e2 * value:.1f}" for name, value in off.items() if value is not None)
    yield f"Hertz is off in force by, % of mu N: {told}"
    off_percent, unsure = 1e2 * verdict["deviation_of_muN"], 1e2 * verdict["uncertainty_of_muN"]
    within = f" (limit {1e2 * verdict['limit_of_muN']:g} %), at {_creepages_text(record['decided'][0])}"
    yield _force_verdict(verdict["answer"], off_percent, unsure, verdict["cause"], within)
    yield from (f"warning: {warning}" for warning in record["warnings"])


def _force_verdict(answer: str, off: float, unsure: float, cause: str | None, within: str = "") -> str:
    """What creep forces say of Hertz; numbers in percent of mu N."""
    because = f": {cause}" if cause else ""
    return f"for forces Hertz {answer}, off by at most {off:.1f} ± {unsure:.1f} % of mu N{within}{because}"


def ellipse_lines(record: Item) -> Lines:
    """The forces on an ellipse."""
    yield _force_table("forces on the wheel", record, record["theories"])
    yield from _problems(record["theories"])
    yield from (f"warning: {warning}" for warning in record["warnings"])


def _problems(theories: Mapping[str, Item]) -> Lines:
    return (f"{theory}: {force['problem']}" for theory, force in theories.items() if "problem" in force)


def _creepages_text(creepages: Item) -> str:
    xi, eta, spin = 1e2 * creepages["xi"], 1e2 * creepages["eta"], creepages["spin_per_mm"]
    return f"xi {xi:.3f} %, eta {eta:.3f} %, spin {spin:.3g}/mm"


def _force_table(what: str, record: Item, forces: Mapping[str, Item]) -> Table:
    """Forces by the names of their theories."""
    limit_N = record["limit_N"]
    title = f"{what} at {_creepages_text(record['creepages'])}, mu N {limit_N / 1e3:.2f} kN"
    return table_of(title, _FORCE, ({**force, "name": name, "limit_N": limit_N} for name, force in forces.items()))


def _force_off(row: Item) -> str:
    """By how much creep forces are off."""
    if not row.get("creep_verdict_answer"):
        return "-"
    off, unsure = (1e2 * float(row[f"creep_verdict_{name}_of_muN"]) for name in ("deviation", "uncertainty"))
    return f"{off:.1f} ± {unsure:.1f}"


CREEP = Telling(
    record=_creep_record,
    left_out=("creep_theories_[!r]*", "creep_warnings", "creep_decided", "creep_centre_*"),
    columns=(
        text("for forces", lambda row: row.get("creep_verdict_answer") or "failed", "answer"),
        text("force off by, % of mu N", _force_off, "number"),
    ),
    parts=creep_lines,
    of_rows=force_lines,
)
