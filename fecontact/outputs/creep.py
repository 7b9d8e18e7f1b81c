"""Creep forces as records, rows and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fecontact.comparison.creep_comparison import CreepComparison, creep_of
from fecontact.comparison.creep_forces import creep_force, creep_forces, ellipse_patch
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.creep import Creep
from fecontact.geometry.placement import Placement
from fecontact.material import STEEL, Material
from fecontact.theory.creep.contact import Creepages, CreepForce, RollingEllipse, friction_warnings

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Record = dict[str, Any]

CREEP_SCHEMA = "fecontact/creep/1"


def creep_record(load: JudgedLoad, placement: Placement) -> Record | None:
    """Creep forces of a judged load; None where no friction is given."""
    found = creep_of(load, placement)
    return None if found is None else _comparison_record(found)


def _comparison_record(found: CreepComparison) -> Record:
    verdict = found.verdict
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
            "verdict": verdict.answer,
            "deviation_of_muN": verdict.worst.deviation,
            "uncertainty_of_muN": verdict.worst.uncertainty,
            "limit_of_muN": verdict.limit,
            "cause": verdict.cause,
            "at": asdict(verdict.worst.creepages),
            "decided": [
                {
                    "creepages": asdict(at.creepages),
                    "deviation_of_muN": at.deviation,
                    "uncertainty_of_muN": at.uncertainty,
                }
                for at in verdict.decided
            ],
        },
        "warnings": list(found.warnings),
    }


def _force_record(force: CreepForce | str) -> Record:
    if isinstance(force, str):
        return {"problem": force}
    # zero is told without a sign
    return {name: value if value is None else value + 0.0 for name, value in asdict(force).items()}


def creep_columns(load: JudgedLoad, placement: Placement) -> Record:
    """Columns of a row: forces of the rolling half-space, their difference, the verdict; none without friction."""
    found = creep_of(load, placement)
    if found is None:
        return {}
    row: Record = {
        "friction": found.friction,
        "creepage_xi": found.creepages.xi,
        "creepage_eta": found.creepages.eta,
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
        "force_verdict": found.verdict.answer,
        "force_cause": found.verdict.cause,
        "force_surface_percent": 1e2 * found.surface_of_muN,
        "force_worst_percent": 1e2 * found.verdict.worst.deviation,
        "force_worst_uncertainty_percent": 1e2 * found.verdict.worst.uncertainty,
    }


def force_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line a row that has a verdict of forces."""
    return [
        f"{row['id']}: for forces Hertz {row['force_verdict']}, off by at most {row['force_worst_percent']:.1f} ±"
        f" {row['force_worst_uncertainty_percent']:.1f} % of mu N"
        + (f": {row['force_cause']}" if row.get("force_cause") else "")
        for row in rows
        if row.get("force_verdict")
    ]


def ellipse_creep(
    *,
    a_mm: float,
    b_mm: float,
    normal_force_N: float,
    friction: float,
    creepages: tuple[float, float, float] = (0.0, 0.0, 0.0),
    young_MPa: float = STEEL.young_MPa,
    poisson: float = STEEL.poisson,
    theories: Sequence[str] = ("all",),
) -> Record:
    """Creep forces on an ellipse by some theories, or by `all` that cover it; analytic, no mesh.

    >>> import fecontact
    >>> found = fecontact.creep(
    ...     a_mm=5.8, b_mm=8.5, normal_force_N=100e3, friction=0.3, creepages=(0.001, 0.0, 0.0), theories=["polach"]
    ... )
    >>> -found["limit_N"] < found["theories"]["polach"]["fx_N"] < 0.0
    True

    Parameters
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    normal_force_N, friction
        Normal force, and coefficient of friction.
    creepages
        Longitudinal and lateral creepage of the wheel over the rolling speed, and spin in 1/mm.
    young_MPa, poisson
        Of both bodies.
    theories
        Names of theories, or `all`.

    Raises
    ------
    InputError
        For values out of range, and if a theory that was named does not cover the ellipse or the creepages.
    """
    material = Material(name="both", young_MPa=young_MPa, poisson=poisson)
    # in the ranges of a case
    Creep(friction=friction, xi=creepages[0], eta=creepages[1], spin_per_mm=creepages[2])
    contact = RollingEllipse(
        a_mm=a_mm,
        b_mm=b_mm,
        normal_force_N=normal_force_N,
        friction=friction,
        shear_MPa=material.shear_MPa,
        poisson=poisson,
    )
    xi, eta, spin = creepages
    motion, patch = Creepages(xi=xi, eta=eta, spin_per_mm=spin), ellipse_patch(contact)
    forces: Mapping[str, CreepForce | str] = (
        creep_forces(patch, motion)
        if list(theories) == ["all"]
        else {theory: creep_force(theory, patch, motion) for theory in theories}
    )
    return {
        "schema": CREEP_SCHEMA,
        "contact": asdict(contact),
        "creepages": asdict(motion),
        "limit_N": contact.limit_N,
        "theories": {theory: _force_record(force) for theory, force in forces.items()},
        "warnings": list(friction_warnings(friction)),
    }


def print_creep(record: Record, console: Console) -> None:
    """Print the forces of a result record."""
    limit, creepages, at = record["limit_N"], record["creepages"], record["verdict"]["at"]
    table = _forces_table(f"creep forces at {_creepages_text(creepages)}, mu N {limit / 1e3:.2f} kN")
    for theory, found in record["theories"].items():
        _add(table, f"{theory}, Hertz", found["hertz"], limit)
        _add(table, f"{theory}, FE", found["fe"], limit)
    console.print(table)
    _print_problems({theory: found["fe"] for theory, found in record["theories"].items()}, console)
    off = {name: found["deviation_of_muN"] for name, found in record["theories"].items()}
    told = ", ".join(f"{name} {1e2 * value:.1f}" for name, value in off.items() if value is not None)
    verdict = record["verdict"]
    console.print(f"Hertz is off in force by, % of mu N: {told}", soft_wrap=True)
    console.print(
        f"for forces Hertz {verdict['verdict']}: off by at most {1e2 * verdict['deviation_of_muN']:.1f} ±"
        f" {1e2 * verdict['uncertainty_of_muN']:.1f} % of mu N (limit {1e2 * verdict['limit_of_muN']:g} %), at"
        f" {_creepages_text(at)}" + (f": {verdict['cause']}" if verdict["cause"] else ""),
        soft_wrap=True,
    )
    for warning in record["warnings"]:
        console.print(f"warning: {warning}", soft_wrap=True)


def print_ellipse(record: Record, console: Console | None = None) -> None:
    """Print the forces on an ellipse."""
    from rich.console import Console

    console = console or Console()
    limit = record["limit_N"]
    table = _forces_table(f"forces on the wheel at {_creepages_text(record['creepages'])}, mu N {limit / 1e3:.2f} kN")
    for theory, force in record["theories"].items():
        _add(table, theory, force, limit)
    console.print(table)
    _print_problems(record["theories"], console)
    for warning in record["warnings"]:
        console.print(f"warning: {warning}", soft_wrap=True)


def _print_problems(theories: Mapping[str, Record], console: Console) -> None:
    for theory, force in theories.items():
        if "problem" in force:
            console.print(f"{theory}: {force['problem']}", soft_wrap=True)


def _creepages_text(creepages: Record) -> str:
    xi, eta, spin = 1e2 * creepages["xi"], 1e2 * creepages["eta"], creepages["spin_per_mm"]
    return f"xi {xi:.3f} %, eta {eta:.3f} %, spin {spin:.3g}/mm"


def _forces_table(title: str) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=None)
    table.add_column("theory")
    for heading in ("Fx\nkN", "Fy\nkN", "Mz\nN m", "|F|\n% of mu N", "adhesion\nmm²", "power/speed\nN"):
        table.add_column(heading, justify="right")
    return table


def _add(table: Table, name: str, force: Record, limit_N: float) -> None:
    if "problem" in force:
        table.add_row(name, *["none"] * 6)
        return
    size = float((force["fx_N"] ** 2 + force["fy_N"] ** 2) ** 0.5)
    table.add_row(
        name,
        f"{force['fx_N'] / 1e3:+.3f}",
        f"{force['fy_N'] / 1e3:+.3f}",
        _shown(force["mz_Nmm"], 1e-3, "+.2f"),
        f"{1e2 * size / limit_N:.1f}",
        _shown(force["adhesion_area_mm2"], 1.0, ".1f"),
        _shown(force["power_per_speed_N"], 1.0, ".2f"),
    )


def _shown(value: float | None, factor: float, form: str) -> str:
    return "" if value is None else f"{factor * value:{form}}"
