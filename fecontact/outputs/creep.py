"""Creep forces as records, rows and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fecontact.comparison.creep_comparison import CreepComparison
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import FORCE
from fecontact.outputs.table import Table, TableRow, columns_of
from fecontact.outputs.terminal import print_table, say, standard_console
from fecontact.theory.creep.contact import CreepForce
from fecontact.theory.creep.on_ellipse import EllipseForces

if TYPE_CHECKING:
    from rich.console import Console

Record = dict[str, Any]

CREEP_SCHEMA = "fecontact/creep/1"


def creep_record(load: JudgedLoad) -> Record | None:
    """Creep forces of a judged load; None where no friction is given."""
    return None if load.creep is None else _comparison_record(load.creep)


def _comparison_record(found: CreepComparison) -> Record:
    judged, worst = found.verdict, found.verdict.decided[0]
    return {
        "friction": found.friction,
        "limit_N": found.limit_N,
        "creepages": asdict(found.creepages),
        "centre_creepages": asdict(found.centre_creepages),
        "curved": found.curved,
        "surface_of_muN": found.surface_of_muN,
        "theories": {
            theory: {
                "hertz": _force_record(found.hertz[theory]),
                "fe": _force_record(found.fe[theory]),
                "deviation_of_muN": found.deviation_of_muN[theory],
                "uncertainty_of_muN": found.uncertainty_of_muN[theory],
            }
            for theory in found.hertz
        },
        "verdict": {
            "verdict": judged.verdict.answer,
            "deviation_of_muN": worst.deviation,
            "uncertainty_of_muN": worst.uncertainty,
            "limit_of_muN": judged.limits[FORCE],
            "cause": judged.verdict.cause,
            "at": asdict(worst.creepages),
            "decided": [
                {
                    "creepages": asdict(at.creepages),
                    "deviation_of_muN": at.deviation,
                    "uncertainty_of_muN": at.uncertainty,
                }
                for at in judged.decided
            ],
        },
        "warnings": list(found.warnings),
    }


def _force_record(force: CreepForce | str) -> Record:
    if isinstance(force, str):
        return {"problem": force}
    # zero is told without a sign
    return {name: value if value is None else value + 0.0 for name, value in asdict(force).items()}


def creep_columns(load: JudgedLoad) -> Record:
    """Columns of a row: forces of the rolling half-space, their difference, the verdict; none without friction."""
    found = load.creep
    if found is None:
        return {}
    row: Record = {
        "friction": found.friction,
        "xi": found.creepages.xi,
        "eta": found.creepages.eta,
        "spin_per_mm": found.creepages.spin_per_mm,
    }
    theory = "rolling_half_space"
    for side, forces in (("hertz", found.hertz), ("fe", found.fe)):
        force = forces[theory]
        for name in ("fx_N", "fy_N", "mz_Nmm"):
            stem, unit = name.split("_")
            row[f"{stem}_{side}_{unit}"] = None if isinstance(force, str) else getattr(force, name)
    off = found.deviation_of_muN[theory]
    return row | {
        "force_deviation_percent": None if off is None else 1e2 * off,
        "force_verdict": found.verdict.verdict.answer,
        "force_cause": found.verdict.verdict.cause,
        "force_surface_percent": 1e2 * found.surface_of_muN,
        "force_worst_percent": 1e2 * found.verdict.deviation[FORCE],
        "force_worst_uncertainty_percent": 1e2 * found.verdict.uncertainty[FORCE],
    }


def force_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line a row that has a verdict of forces."""
    lines = []
    for row in rows:
        if row.get("force_verdict"):
            off, unsure = row["force_worst_percent"], row["force_worst_uncertainty_percent"]
            lines.append(f"{row['id']}: {_force_verdict(row['force_verdict'], off, unsure, row.get('force_cause'))}")
    return lines


def ellipse_creep(found: EllipseForces) -> Record:
    """Creep forces on an ellipse that is given by numbers."""
    return {
        "schema": CREEP_SCHEMA,
        "contact": asdict(found.contact),
        "creepages": asdict(found.creepages),
        "limit_N": found.contact.limit_N,
        "theories": {theory: _force_record(force) for theory, force in found.forces.items()},
        "warnings": list(found.warnings),
    }


def print_creep(record: Record, console: Console) -> None:
    """Print the forces of a result record."""
    limit, verdict = record["limit_N"], record["verdict"]
    forces: dict[str, Record] = {}
    for theory, found in record["theories"].items():
        forces |= {f"{theory}, Hertz": found["hertz"], f"{theory}, FE": found["fe"]}
    title = f"creep forces at {_creepages_text(record['creepages'])}, mu N {limit / 1e3:.2f} kN"
    print_table(console, force_table(title, forces, limit))
    _print_problems({theory: found["fe"] for theory, found in record["theories"].items()}, console)
    off = {name: found["deviation_of_muN"] for name, found in record["theories"].items()}
    told = ", ".join(f"{name} {1e2 * value:.1f}" for name, value in off.items() if value is not None)
    say(console, f"Hertz is off in force by, % of mu N: {told}")
    off_percent, unsure = 1e2 * verdict["deviation_of_muN"], 1e2 * verdict["uncertainty_of_muN"]
    limit_percent, at = 1e2 * verdict["limit_of_muN"], _creepages_text(verdict["at"])
    within = f" (limit {limit_percent:g} %), at {at}"
    say(console, _force_verdict(verdict["verdict"], off_percent, unsure, verdict["cause"], within))
    for warning in record["warnings"]:
        say(console, f"warning: {warning}")


def _force_verdict(answer: str, off: float, unsure: float, cause: str | None, within: str = "") -> str:
    """What creep forces say of Hertz; numbers in percent of mu N."""
    because = f": {cause}" if cause else ""
    return f"for forces Hertz {answer}, off by at most {off:.1f} ± {unsure:.1f} % of mu N{within}{because}"


def print_ellipse(record: Record, console: Console | None = None) -> None:
    """Print the forces on an ellipse."""
    console, limit = console or standard_console(), record["limit_N"]
    title = f"forces on the wheel at {_creepages_text(record['creepages'])}, mu N {limit / 1e3:.2f} kN"
    print_table(console, force_table(title, record["theories"], limit))
    _print_problems(record["theories"], console)
    for warning in record["warnings"]:
        say(console, f"warning: {warning}")


def _print_problems(theories: Mapping[str, Record], console: Console) -> None:
    for theory, force in theories.items():
        if "problem" in force:
            say(console, f"{theory}: {force['problem']}")


def _creepages_text(creepages: Record) -> str:
    xi, eta, spin = 1e2 * creepages["xi"], 1e2 * creepages["eta"], creepages["spin_per_mm"]
    return f"xi {xi:.3f} %, eta {eta:.3f} %, spin {spin:.3g}/mm"


def force_table(title: str, forces: Mapping[str, Record], limit_N: float) -> Table:
    """Forces by the names of their theories."""
    headings = ("Fx\nkN", "Fy\nkN", "Mz\nN m", "|F|\n% of mu N", "adhesion\nmm²", "power/speed\nN")
    rows = []
    for name, force in forces.items():
        cells = ["none"] * len(headings)
        if "problem" not in force:
            size = float((force["fx_N"] ** 2 + force["fy_N"] ** 2) ** 0.5)
            cells = [f"{force['fx_N'] / 1e3:+.3f}", f"{force['fy_N'] / 1e3:+.3f}"]
            cells += [_shown(force["mz_Nmm"], 1e-3, "+.2f"), f"{1e2 * size / limit_N:.1f}"]
            cells += [_shown(force["adhesion_area_mm2"], 1.0, ".1f"), _shown(force["power_per_speed_N"], 1.0, ".2f")]
        rows.append(TableRow(cells=[name, *cells]))
    return Table(title=title, columns=columns_of("theory", *headings, texts=("theory",)), rows=rows)


def _shown(value: float | None, factor: float, form: str) -> str:
    return "" if value is None else f"{factor * value:{form}}"
