"""Verdicts in words: on the terminal, in pictures and in reports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.case import RESOLUTIONS
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.theories import HERTZ, HERTZ_GAUGE, THEORIES
from fecontact.outcome import usable, with_remedy
from fecontact.outputs.records.theories import theory_words
from fecontact.outputs.words.cases import case_words
from fecontact.outputs.words.measures import WORDS, deviation_column
from fecontact.solving.solve import CaseResult

Record = Mapping[str, Any]

_NEAREST = {"HOLDS": "nearest to its limit", "UNRESOLVED": "open", "FAILS": "furthest beyond its limit"}


def off_text(
    measure: str, deviation: float | None, uncertainty: float | None, limit: float | None, answer: str = ""
) -> str:
    """How far a theory is off in a measure beside its uncertainty and its limit, and how near that is."""
    words = WORDS[measure]
    within = "" if limit is None else f" (limit {words.limit(limit)})"
    nearest = f"{_NEAREST[answer]}: " if answer else ""
    return f"{nearest}{words.name} {words.off(deviation)} ± {words.off(uncertainty, size=True)}{within}"


def _off(judged: Record, verdict: Record, limits: Record) -> str:
    """How far a judged theory is off in the measure that decided a verdict."""
    measure = verdict["measure"]
    off, unsure = (judged[of].get(measure) for of in ("deviation", "uncertainty"))
    return off_text(measure, off, unsure, limits[measure], verdict["each"][measure])


def _because(cause: str | None) -> str:
    return f"; because: {cause}" if cause else ""


def _reason(verdict: Record, judged: Record) -> str:
    """What decided a verdict, with which curvature, and why."""
    at = "" if verdict["side"] == "both" else f", with the curvature of the {verdict['side']} side"
    return f"{_off(judged, verdict, verdict['limits'])}{at}{_because(verdict['cause'])}"


def verdict_reason(load: JudgedLoad) -> str:
    """What decided the verdict, how far Hertz is off in it, and why, in one line."""
    if not load.usable:
        return f"not to be used: {load.status}"
    side, judged = load.deciding_side
    return _reason({**vars(load.verdict), "limits": load.case.criteria.limits, "side": side}, vars(judged))


def reason_of_record(record: Record) -> str:
    """What decided the verdict of a record, also of one that must not be used."""
    return _reason(record["verdict"], deciding(record))


def plastic_words(record: Record) -> str:
    """Whether Hertz holds against bodies that yield, by which measure, and why not; empty without a yield stress."""
    if (plastic := record.get("plastic")) is None:
        return ""
    judged, verdict = plastic[HERTZ], plastic[HERTZ]["verdict"]
    off = _off(judged, verdict, record["verdict"]["limits"])
    said = f"against bodies that yield: Hertz {verdict['answer']}; {off}{_because(verdict['cause'])}"
    return f"{said}; {judged['cancelling']}" if judged["cancelling"] else said


def cheapest_text(record: Record) -> str:
    """The theory to take where Hertz does not hold in its range; empty elsewhere, and without one."""
    name, *status = (record[f"cheapest_theory{of}"] for of in ("", "_status", "_reason"))
    if name not in THEORIES or (name == HERTZ and status[0] != "out of range"):
        return ""
    found = record["theories"][name]
    shown = {WORDS[one].short: WORDS[one].off(found["deviation"][one]) for one in ("p_max_MPa", "area_mm2")}
    off = ", ".join(f"{short} {value}" for short, value in shown.items())
    words = theory_words(name, *status)
    return f"the cheapest theory that holds: {words} ({off}; {found['limit_used']:.2f} of a limit)"


def decided(row: Record, limits: Mapping[str, float]) -> str:
    """The measure that decided about a row, how far Hertz is off in it, and its limit; or why it must not be used."""
    if not usable(row):
        return str(row["status"])
    measure = row.get("verdict_measure")
    if measure not in WORDS:
        return ""
    *columns, factor = deviation_column(measure)
    off, unsure = (None if row.get(name) is None else float(row[name]) / factor for name in columns)
    return off_text(measure, off, unsure, limits.get(measure))


def deciding(record: Record) -> Record:
    """Hertz with the curvature of the side that decided the verdict of a record."""
    found: Record = record["theories"][HERTZ_GAUGE if record["verdict"]["side"] == "gauge" else HERTZ]
    return found


def what_would_decide(record: Record) -> str:
    """What decides an open verdict: finer meshes, or better profiles."""
    side, measure = deciding(record), record["verdict"]["measure"]
    if not usable(record):
        return f"the result must not be used: {with_remedy(record)}"
    of_points = (record["uncertainty_of_profile"] or {}).get(measure, 0.0)
    # a NaN is not less
    if not of_points < 0.5 * side["uncertainty"][measure]:
        left = WORDS[measure].off(of_points, size=True)
        return (
            f"finer meshes would hardly decide it: points of the profiles leave {left} open; give profiles with less"
            " noise, or closer points"
        )
    case, solver, names = record["case"], record["solver"], list(RESOLUTIONS)
    if case["resolution"] in names[:-1]:
        finer = f"--resolution {' or '.join(names[names.index(case['resolution']) + 1 :])}"
    else:
        finer = (
            f"--resolution with sizes below {','.join(f'{size:.3g}' for size in solver['element_size_mm'].values())}"
        )
    more = solver["finer_degrees_of_freedom"]
    limit = f", or --refine-degrees-of-freedom {more}" if more > case["refine_degrees_of_freedom"] else ""
    return f"to decide it: {finer}{limit}"


def case_annotation(result: CaseResult) -> str:
    """A case and its verdict in three lines, for a picture."""
    fe, hertz = result.comparison.fe.p_max_MPa, result.comparison.hertz.p_max_MPa
    return (
        f"{case_words(result.case, result.placement)}\nHertz {result.verdict.answer}: {verdict_reason(result.load)}\n"
        f"peak pressure: finite elements {fe:.0f} MPa, Hertz {hertz:.0f} MPa"
    )
