"""What yielding does to a contact, as records and columns; nothing where no yield stress is given."""

from __future__ import annotations

from dataclasses import asdict

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.ladder import PLASTIC
from fecontact.comparison.measures import MEASURES
from fecontact.comparison.plastic_verdict import NOT_IN_IT
from fecontact.outputs.records.plain import Record, picked
from fecontact.outputs.records.theories import answer_record


def plastic_record(load: JudgedLoad) -> Record:
    """The plastic rung of a load; lengths in mm, loads in N, steps and uncertainties relative."""
    found = load.plastic
    if found is None:
        return {}
    worst = next(one for one in found.judgements.values() if one.verdict.each == found.verdict.each)
    return {
        "plastic": {
            "status": found.status,
            "range": NOT_IN_IT,
            "first_yield_N": found.yielded.first_yield_N,
            "first_yield_body": found.yielded.first_body,
            **picked(found, "first_yield_uncertainty plastic_load_N"),
            "plastic_load_measure": found.plastic_measure,
            "step": load.ladder.steps[PLASTIC.name],
            "step_uncertainty": found.step_uncertainty,
            "step_with_yield_stress_15_percent_lower_and_higher": {k: list(v) for k, v in found.band.items()},
            "bodies": {name: asdict(body) for name, body in found.yielded.bodies.items()},
            "imprint_mm": found.yielded.imprint_mm,
            "path": [asdict(point) for point in found.yielded.path],
            "verdict": {
                **answer_record(found.verdict),
                "cause": found.verdict.cause,
                "cancelling": found.cancelling,
                **picked(worst, "deviation uncertainty"),
            },
        }
    }


def plastic_columns(load: JudgedLoad) -> Record:
    """The plastic rung of a load in the columns of a row."""
    found = load.plastic
    if found is None:
        return {}
    measures, columns = load.ladder.rungs[PLASTIC.end].as_dict(), {}
    for measure in MEASURES:
        name, unit = measure.rsplit("_", 1)
        columns[f"{name}_plastic_{unit}"] = measures[measure]
    for measure, (low, high) in found.band.items():
        name = measure.rsplit("_", 1)[0]
        columns[f"{name}_step_plastic_uncertainty_percent"] = 1e2 * found.step_uncertainty[measure]
        columns[f"{name}_step_plastic_lower_yield_percent"] = 1e2 * low
        columns[f"{name}_step_plastic_higher_yield_percent"] = 1e2 * high
    for name, body in found.yielded.bodies.items():
        columns[f"{name}_yield_MPa"] = body.yield_MPa
        columns[f"{name}_plastic_strain_max"] = body.largest_strain
    return columns | {
        "first_yield_kN": found.yielded.first_yield_N / 1e3,
        "first_yield_body": found.yielded.first_body,
        "plastic_load_kN": None if found.plastic_load_N is None else found.plastic_load_N / 1e3,
        "plastic_load_measure": found.plastic_measure,
        "imprint_mm": found.yielded.imprint_mm,
        "verdict_plastic": found.verdict.answer,
        **picked(found.verdict, "measure cause", "verdict_plastic_"),
        "verdict_plastic_cancelling": found.cancelling,
    }
