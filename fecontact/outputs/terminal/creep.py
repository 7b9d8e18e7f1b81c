"""Creep forces on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fecontact.outputs.records.creep import Record
from fecontact.outputs.tables.table import Table, TableRow, columns_of
from fecontact.outputs.terminal.console import print_table, say, standard_console

if TYPE_CHECKING:
    from rich.console import Console


def force_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line a row that has a verdict of forces."""
    lines = []
    for row in rows:
        if row.get("force_verdict"):
            off, unsure = row["force_worst_percent"], row["force_worst_uncertainty_percent"]
            lines.append(f"{row['id']}: {_force_verdict(row['force_verdict'], off, unsure, row.get('force_cause'))}")
    return lines


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
