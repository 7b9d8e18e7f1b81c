"""Creep forces as records and columns of rows."""

from __future__ import annotations

from dataclasses import asdict

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import FORCE
from fecontact.outputs.records.plain import Record, picked
from fecontact.theory.creep.contact import CreepForce
from fecontact.theory.creep.on_ellipse import EllipseForces

CREEP_SCHEMA = "fecontact/creep/1"


def creep_record(load: JudgedLoad) -> Record | None:
    """Creep forces of a judged load; None where no friction is given."""
    found = load.creep
    if found is None:
        return None
    judged = found.verdict
    decided = [
        (asdict(at.creepages), {"deviation_of_muN": at.deviation, "uncertainty_of_muN": at.uncertainty})
        for at in judged.decided
    ]
    worst_at, worst = decided[0]
    return {
        **picked(found, "friction limit_N"),
        "creepages": asdict(found.creepages),
        "centre_creepages": asdict(found.centre_creepages),
        **picked(found, "curved surface_of_muN"),
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
            **worst,
            "limit_of_muN": judged.limits[FORCE],
            "cause": judged.verdict.cause,
            "at": worst_at,
            "decided": [{"creepages": creepages, **off} for creepages, off in decided],
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
    row = {"friction": found.friction, **picked(found.creepages, "xi eta spin_per_mm")}
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
