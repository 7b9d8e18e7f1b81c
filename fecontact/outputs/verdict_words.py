"""Verdicts in words: on the terminal, in pictures and in reports."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

from fecontact.case import RESOLUTIONS
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, THEORIES
from fecontact.errors import usable, with_remedy
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import PLASTIC
from fecontact.judging.lines import FILTER
from fecontact.judging.measures import MEASURES, Measures
from fecontact.judging.uncertainty import unmeshed
from fecontact.judging.verdict import PROFILE, answer_of
from fecontact.outputs.case_words import case_words
from fecontact.outputs.words import WORDS, deviation_column
from fecontact.solving.solve import CaseResult

YIELDING = "against bodies that yield"
"""What a verdict is against if there is a yield stress."""


def elastic_words(answer: str) -> str:
    """The second verdict of a case with a yield stress."""
    return f"against elastic bodies Hertz {answer}"


Record = Mapping[str, Any]

_NEAREST = {"HOLDS": "nearest to its limit", "UNRESOLVED": "open", "FAILS": "furthest beyond its limit"}


BY_EACH_LINE = " over all lines, each of which is judged by itself"
"""Why an uncertainty and a verdict seem to contradict each other, where points of a profile allow several lines."""


def off_text(
    measure: str,
    deviation: float | None,
    uncertainty: float | None,
    limit: float | None,
    answer: str = "",
    *,
    nearest: bool = False,
) -> str:
    """How far a theory is off in a measure beside its uncertainty and its limit.

    Parameters
    ----------
    answer
        The answer on the measure. Where one deviation with its uncertainty does not give it, the lines that points of
        the profiles allow do, and the text says so.
    nearest
        Whether to say how near to its limit the measure is by that answer.
    """
    words = WORDS[measure]
    within = "" if limit is None else f" (limit {words.limit(limit)})"
    of_lines = ""
    if answer in ("HOLDS", "FAILS") and deviation is not None and uncertainty is not None and limit is not None:
        of_lines = "" if answer_of(deviation, uncertainty, limit) == answer else BY_EACH_LINE
    near = f"{_NEAREST[answer]}: " if nearest else ""
    return f"{near}{words.name} {words.off(deviation)} ± {words.off(uncertainty, size=True)}{of_lines}{within}"


def _off(judged: Record, verdict: Record, limits: Record) -> str:
    """How far a judged theory is off in the measure that decided a verdict."""
    measure, answer = verdict["measure"], verdict["answer"]
    off, unsure = (judged[of].get(measure) for of in ("deviation", "uncertainty"))
    of_measure = verdict["each"][measure]
    if answer != "FAILS" or of_measure == "FAILS":
        return off_text(measure, off, unsure, limits[measure], of_measure, nearest=True)
    # on each line a measure fails, on none of the measures most lines agree
    return f"beyond another limit from line to line: {off_text(measure, off, unsure, limits[measure], answer)}"


def _because(cause: str | None) -> str:
    return f"; because: {cause}" if cause else ""


def _reason(verdict: Record, judged: Record) -> str:
    """What decided a verdict, with which curvature, and why, and on how many lines of measured points."""
    at = "" if verdict["side"] == "both" else f", with the curvature of the {verdict['side']} side"
    on = f"; it {share_text(verdict['lines'])}" if verdict["lines"] else ""
    return f"{_off(judged, verdict, verdict['limits'])}{at}{_because(verdict['cause'])}{on}"


def share_text(lines: Mapping[str, str]) -> str:
    """On how many of the lines that measured points allow a theory holds, and with which filters it does not."""
    holds = [line for line, answer in lines.items() if answer == "HOLDS"]
    fails = [line for line, answer in lines.items() if answer == "FAILS"]
    allowed = f"of the {len(lines)} lines that the points allow"
    if max(len(holds), len(fails)) == len(lines):
        return f"{'holds' if holds else 'fails'} on all {allowed}"
    open_ones = len(lines) - len(holds) - len(fails)
    said = [_failing_text(holds, fails)] if fails else []
    if open_ones:
        said.append(f"it is open on {open_ones}")
    return f"holds on {len(holds)} {allowed} ({'; '.join(said)})"


def _failing_text(holds: Sequence[str], fails: Sequence[str]) -> str:
    """On which lines a theory fails: above or below a filter, where filters decide."""
    good, bad = ([float(line.split()[1]) for line in of if line.startswith(FILTER)] for of in (holds, fails))
    if good and len(bad) == len(fails) and min(bad) > max(good):
        return f"it fails with filters above {max(good):g} mm"
    if good and len(bad) == len(fails) and max(bad) < min(good):
        return f"it fails with filters below {min(good):g} mm"
    return f"it fails on {', '.join(fails)}" if len(fails) < 4 else f"it fails on {len(fails)}"


def band_text(fe: Record) -> str:
    """The peak over the lines that measured points allow; empty for exact lines."""
    if "p_max_low_MPa" not in fe:
        return ""
    return f"peak pressure {fe['p_max_low_MPa']:.0f} to {fe['p_max_high_MPa']:.0f} MPa over the lines"


def verdict_reason(load: JudgedLoad) -> str:
    """What decided the verdict that was asked for, how far Hertz is off in it, and why, in one line.

    With a yield stress this is the verdict against bodies that yield, and the one against elastic bodies comes last.
    """
    if load.plastic is not None and load.elastic_verdict is not None:
        decided = load.plastic.deciding
        limits = {"limits": load.case.criteria.limits, "side": load.plastic.deciding_side}
        reason = _reason({**vars(decided.verdict), **limits}, vars(decided))
        return f"{YIELDING}, {reason}; {elastic_words(load.elastic_verdict.answer)}"
    limits = {"limits": load.case.criteria.limits, "side": load.deciding_side}
    reason = _reason({**vars(load.verdict), **limits}, vars(load.deciding))
    if load.usable:
        return reason
    sure = f"certain by the half-space alone, {reason}; numbers of the finite elements are "
    return f"{sure if load.verdict.answer == 'FAILS' else ''}not to be used: {load.status}"


def shown_measures(load: JudgedLoad) -> Measures:
    """Measures of the finite elements, of bodies that yield if there is a yield stress."""
    return load.ladder.rungs.get(PLASTIC.end, load.comparison.fe)


def reason_of_record(record: Record) -> str:
    """What decided the verdict of a record, also of one that must not be used."""
    return _reason(record["verdict"], deciding(record))


def theory_words(name: str | None, status: str | None = "", reason: str | None = "") -> str:
    """A theory in words, or another answer, and that it is out of its own range, and why."""
    words = THEORIES[name].words if name and name in THEORIES else name or ""
    return f"{words}, {status}{reason and f': {reason}'}" if status == "out of range" else words


def cheapest_text(record: Record) -> str:
    """The theory to take where Hertz does not hold in its range; empty elsewhere, and without one."""
    name, *status = (record[f"cheapest_theory{of}"] for of in ("", "_status", "_reason"))
    if name == "UNRESOLVED":
        judged = {one: theory["verdict"] for one, theory in record["theories"].items() if "verdict" in theory}
        first = next((one for one, verdict in judged.items() if verdict["answer"] != "FAILS"), HERTZ)
        lines = judged[first]["lines"]
        return f"the cheapest theory that may hold: {THEORIES[first].words} {share_text(lines)}" if lines else ""
    if name not in THEORIES or (name == HERTZ and status[0] != "out of range"):
        return ""
    found = deciding(record) if name == HERTZ else record["theories"][name]
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
    return off_text(measure, off, unsure, limits.get(measure), str(row.get("verdict_answer", "")))


def deciding(record: Record) -> Record:
    """Hertz with the curvature of the side that decided the verdict of a record."""
    found: Record = record["theories"][HERTZ_GAUGE if record["verdict"]["side"] == "gauge" else HERTZ]
    return found


def what_would_decide(record: Record) -> str:
    """What decides an open verdict: finer meshes, or better profiles."""
    measure = record["verdict"]["measure"]
    if record.get("plastic") and not usable(record["plastic"]):
        return f"what yielding does was not solved: {with_remedy(record['plastic'])}"
    if not usable(record):
        return f"the result must not be used: {with_remedy(record)}"
    if record["verdict"]["cause"] == PROFILE:
        left = WORDS[measure].off(record["uncertainty_of_profile"][measure], size=True)
        return (
            f"no finer mesh decides it: over the lines that the points allow the deviation changes by {left}; say the"
            " filter that counts, or measure the profiles with less noise, or closer points"
        )
    if (unmeshed_ := _unmeshed(record)) is not None:
        beside, open_ = (WORDS[measure].off(size, size=True) for size in unmeshed_)
        return (
            f"no finer mesh decides it: it is {beside} beside its limit, and reading it and the bodies' cut planes"
            f" leave {open_} open"
        )
    case, solver, names = record["case"], record["solver"], list(RESOLUTIONS)
    if case["resolution"] in names[:-1]:
        finer = f"--resolution {' or '.join(names[names.index(case['resolution']) + 1 :])}"
    else:
        finer = (
            f"--resolution with sizes below {','.join(f'{size:.3g}' for size in solver['element_size_mm'].values())}"
        )
    return f"to decide it: {finer}{', or --refine verdict' if case['refine'] == 'never' else ''}"


def _unmeshed(record: Record) -> tuple[float, float] | None:
    """How far a measure is beside its limit and what no mesh takes away of it, where that is more; None elsewhere."""
    measure, hertz = record["verdict"]["measure"], deciding(record)
    off, stated = (hertz[name].get(measure, math.nan) for name in ("deviation", "uncertainty"))
    known = unmeshed(measure, off, shared=record["fe"]["pieces"] > 1)
    if known is None:
        return None
    left = known * (abs(1.0 + off) if measure in MEASURES else 1.0)
    beside = abs(abs(off) - record["verdict"]["limits"][measure])
    return (beside, left) if beside < left and stated <= 2.0 * left else None


# Characters of a line in a picture of half a window of 1000 pixels.
_ANNOTATION_WIDTH = 40


def case_annotation(result: CaseResult) -> str:
    """A case and its verdict in short lines, for a picture."""
    fe, hertz = shown_measures(result.load).p_max_MPa, result.comparison.hertz.p_max_MPa
    told = (
        case_words(result.case, result.placement),
        f"Hertz {result.load.verdict.answer}: {verdict_reason(result.load)}",
        f"peak pressure: finite elements {fe:.0f} MPa, Hertz {hertz:.0f} MPa",
    )
    return "\n".join(fill(text, _ANNOTATION_WIDTH) for text in told)
