"""Words for verdicts on the terminal, in pictures and in reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

from fecontact.case import RESOLUTIONS
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, THEORIES
from fecontact.errors import describe_status, is_usable_status
from fecontact.judging.lines import FILTER_LABEL
from fecontact.judging.verdict import PROFILE_CAUSE, compare_with_limit
from fecontact.outputs.case_words import case_words
from fecontact.outputs.records.asked import elastic_record, requested_record
from fecontact.outputs.tables import is_missing, number_text
from fecontact.outputs.theory_records import deciding_hertz, judged_theories
from fecontact.outputs.words import MEASURE_WORDS, deviation_columns, unknown_text
from fecontact.own_criterion import is_own

AGAINST_YIELDING_BODIES = "against bodies that yield"
"""Reference of a verdict if there is a yield stress."""


def elastic_words(answer: str) -> str:
    """Text for the second verdict of a case with a yield stress."""
    return f"against elastic bodies Hertz {answer}"


Record = Mapping[str, Any]

_NEARNESS_WORDS = {"HOLDS": "nearest to its limit", "UNRESOLVED": "least certain", "FAILS": "furthest beyond its limit"}


BY_EACH_VARIANT = " over all profile variants, each of which is judged separately"
"""Reason for an apparent contradiction of uncertainty and verdict, if several profile variants fit the points."""


def deviation_sentence(
    measure: str,
    deviation: float | None,
    uncertainty: float | None,
    limit: float | None,
    answer: str = "",
    *,
    nearest: bool = False,
) -> str:
    """Text for the deviation of a theory in a measure, with uncertainty and limit.

    Parameters
    ----------
    measure
        Name of the measure.
    deviation, uncertainty
        Relative values; None if missing.
    limit
        Limit of the deviation; None without a limit.
    answer
        Answer for the measure. If the deviation with its uncertainty does not give this answer, the profile variants
        that fit the measured points give it, and the text states this.
    nearest
        Whether the text states how near the measure is to its limit by this answer.

    Returns
    -------
    str
        Text such as "peak pressure +3.20 % ± 1.00 % (limit ±5 %)".
    """
    words = MEASURE_WORDS[measure]
    limit_part = "" if limit is None else f" (limit {words.limit_text(limit)})"
    variants = ""
    if answer in ("HOLDS", "FAILS") and deviation is not None and uncertainty is not None and limit is not None:
        variants = "" if compare_with_limit(deviation, uncertainty, limit) == answer else BY_EACH_VARIANT
    nearness = f"{_NEARNESS_WORDS[answer]}: " if nearest else ""
    return (
        f"{nearness}{words.name} {words.deviation_text(deviation)} ± {words.deviation_text(uncertainty, size=True)}"
        f"{variants}{limit_part}"
    )


def _decision_text(judgement: Record, verdict: Record) -> str:
    """Deviation of a judged theory in the measure that decided a verdict."""
    measure, answer, limits = verdict["measure"], verdict["answer"], verdict["limits"]
    deviation, uncertainty = (judgement[quantity].get(measure) for quantity in ("deviation", "uncertainty"))
    measure_answer = verdict["each"][measure]
    if answer != "FAILS" or measure_answer == "FAILS":
        return deviation_sentence(measure, deviation, uncertainty, limits[measure], measure_answer, nearest=True)
    # on each profile variant a measure fails, but the variants do not agree on a measure
    return (
        "the profile variants exceed different limits:"
        f" {deviation_sentence(measure, deviation, uncertainty, limits[measure], answer)}"
    )


def variant_share_text(lines: Mapping[str, str]) -> str:
    """Text for the number of profile variants on which a theory holds or fails.

    The text names the filters with which the theory fails.

    Parameters
    ----------
    lines
        Answer for each profile variant that fits the measured points.

    Returns
    -------
    str
        Text such as "holds on 3 of 4 profile variants (it fails on ...)".
    """
    holds = [variant for variant, answer in lines.items() if answer == "HOLDS"]
    fails = [variant for variant, answer in lines.items() if answer == "FAILS"]
    variants_text = f"{len(lines)} profile variants"
    if max(len(holds), len(fails)) == len(lines):
        return f"{'holds' if holds else 'fails'} on all {variants_text}"
    unresolved_count = len(lines) - len(holds) - len(fails)
    statements = [_failing_text(holds, fails)] if fails else []
    if unresolved_count:
        statements.append(f"it is unresolved on {unresolved_count}")
    return f"holds on {len(holds)} of {variants_text} ({'; '.join(statements)})"


def _failing_text(holds: Sequence[str], fails: Sequence[str]) -> str:
    """Text for the profile variants on which a theory fails.

    If filters decide, the text gives the filter length (mm) above or below which the theory fails.

    Parameters
    ----------
    holds, fails
        Names of the variants on which the theory holds, and on which it fails.
    """
    holding_filters_mm, failing_filters_mm = (
        [float(variant.split()[1]) for variant in variants if variant.startswith(FILTER_LABEL)]
        for variants in (holds, fails)
    )
    if (
        holding_filters_mm
        and len(failing_filters_mm) == len(fails)
        and min(failing_filters_mm) > max(holding_filters_mm)
    ):
        return f"it fails with filters above {max(holding_filters_mm):g} mm"
    if (
        holding_filters_mm
        and len(failing_filters_mm) == len(fails)
        and max(failing_filters_mm) < min(holding_filters_mm)
    ):
        return f"it fails with filters below {min(holding_filters_mm):g} mm"
    return f"it fails on {', '.join(fails)}" if len(fails) < 4 else f"it fails on {len(fails)}"


def peak_range_text(fe: Record) -> str:
    """Range of the peak pressure over the profile variants; empty for exact profiles.

    Parameters
    ----------
    fe
        Record of the finite elements.

    Returns
    -------
    str
        Range in MPa in words, or an empty text.
    """
    if fe["p_max_low_MPa"] is None:
        return ""
    return f"peak pressure {fe['p_max_low_MPa']:.0f} to {fe['p_max_high_MPa']:.0f} MPa over the profile variants"


def verdict_reason(record: Record) -> str:
    """Reason of the requested verdict: measure, deviation of Hertz, and cause.

    With a yield stress this is the verdict against bodies that yield, and the verdict against elastic bodies comes
    last.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    str
        The reason in one line. For unusable results it is the status.
    """
    reason = deciding_text(requested_record(record))
    if record["elastic_verdict"] is not None:
        return f"{AGAINST_YIELDING_BODIES}, {reason}; {elastic_words(record['elastic_verdict']['answer'])}"
    if is_usable_status(record):
        return reason
    certain_part = f"certain from the half-space alone, {reason}; do not use the numbers of the finite elements: "
    return f"{certain_part if record['verdict']['answer'] == 'FAILS' else 'do not use this result: '}{record['status']}"


def deciding_text(record: Record) -> str:
    """Deciding measure of the verdict of a record, with curvature, cause and share of profile variants.

    Parameters
    ----------
    record
        Record of a load in which the verdict and Hertz have the same reference (`requested_record`, `elastic_record`).

    Returns
    -------
    str
        The text, also for an unusable record.
    """
    verdict = record["verdict"]
    side = "" if verdict["side"] == "both" else f", with the curvature of the {verdict['side']} side"
    variants = f"; it {variant_share_text(verdict['variant_answers'])}" if verdict["variant_answers"] else ""
    variants += f"; open because of the {verdict['open_because']}" if verdict["cause"] == PROFILE_CAUSE else ""
    cause = f"; cause: {verdict['cause']}" if verdict["cause"] else ""
    return f"{_decision_text(deciding_hertz(record), verdict)}{side}{cause}{variants}"


def answer_sentence(record: Record) -> str:
    """Requested verdict on Hertz with its deciding measure and its cause.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    str
        The sentence, also for an unusable record.
    """
    reference = "" if record["plastic"] is None else f" {AGAINST_YIELDING_BODIES}"
    return f"Hertz {record['verdict']['answer']}{reference}; {deciding_text(requested_record(record))}"


def describe_verdict(record: Record) -> str:
    """Requested verdict on Hertz with the physical meaning of its deciding measure, and its cause.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    str
        Headline of a report. The answer with its numbers (`answer_sentence`) if no measure alone explains the verdict.
    """
    converted_record = requested_record(record)
    verdict, judgement = converted_record["verdict"], deciding_hertz(converted_record)
    measure, answer = verdict["measure"], verdict["answer"]
    deviation, uncertainty = (judgement[quantity].get(measure) for quantity in ("deviation", "uncertainty"))
    is_explained = answer != "FAILS" or verdict["each"][measure] == "FAILS"
    if not is_usable_status(record) or not is_explained or is_missing(deviation) or is_missing(uncertainty):
        return answer_sentence(record)
    reference = "" if record["plastic"] is None else f" {AGAINST_YIELDING_BODIES}"
    meaning = MEASURE_WORDS[measure].describe_deviation(deviation, uncertainty, verdict["limits"][measure])
    cause = f"; cause: {verdict['cause']}" if verdict["cause"] else ""
    variants = f"; it {variant_share_text(verdict['variant_answers'])}" if verdict["variant_answers"] else ""
    return f"Hertz {answer}{reference}: {meaning}{cause}{variants}"


def utilisation_text(utilisation: float | None) -> str:
    """Text for a limit utilisation in a report.

    A value above 1 has no meaning in physics, so the deciding measure with its limit takes its place.

    Parameters
    ----------
    utilisation
        Deviation divided by its limit; None if it is missing.

    Returns
    -------
    str
        The number up to 1, otherwise "above 1", or a dash.
    """
    return "above 1" if utilisation is not None and utilisation > 1.0 else number_text(utilisation, "{:.2f}")


def theory_words(name: str | None, status: str | None = "", reason: str | None = "") -> str:
    """Words for a theory or another answer.

    The words include the reason if the theory is out of its range.

    Parameters
    ----------
    name
        Name of the theory; None if there is no such theory.
    status
        Status of the theory, such as `out of range`.
    reason
        Reason of the status.

    Returns
    -------
    str
        The words; empty without a name.
    """
    words = THEORIES[name].words if name and name in THEORIES else name or ""
    return f"{words}, {status}{reason and f': {reason}'}" if status == "out of range" else words


def cheapest_words(columns: Record) -> str:
    """Words for the cheapest theory that holds in a record or in a row."""
    return theory_words(*(columns.get(f"cheapest_theory{suffix}") for suffix in ("", "_status", "_reason")))


def _cheapest_lead(columns: Record) -> str:
    """First words on the cheapest theory that holds in a record or in a row.

    They are empty if Hertz holds in its range, and if no theory holds.
    """
    name = columns.get("cheapest_theory")
    if name not in THEORIES or (name == HERTZ and columns.get("cheapest_theory_status") != "out of range"):
        return ""
    return f"cheapest theory that holds: {cheapest_words(columns)}"


def cheapest_text(record: Record) -> str:
    """Text for the cheapest theory that holds or may hold.

    It is empty if Hertz holds in its range, and if there is no such theory.

    Parameters
    ----------
    record
        Record of a load, with its theories.

    Returns
    -------
    str
        Theory, deviations of peak pressure and area, and limit utilisation.
    """
    name = record["cheapest_theory"]
    if name == "UNRESOLVED":
        verdicts = {theory_name: theory["verdict"] for theory_name, theory in judged_theories(record).items()}
        possible_theory = next(
            (theory_name for theory_name, verdict in verdicts.items() if verdict["answer"] != "FAILS"), HERTZ
        )
        lines = verdicts[possible_theory]["variant_answers"]
        return (
            f"cheapest theory that may hold: {THEORIES[possible_theory].words} {variant_share_text(lines)}"
            if lines
            else ""
        )
    lead = _cheapest_lead(record)
    if not lead:
        return ""
    judged_theory = deciding_hertz(record) if name == HERTZ else record["theories"][name]
    deviations_text = ", ".join(
        f"{MEASURE_WORDS[measure].short} {MEASURE_WORDS[measure].deviation_text(judged_theory['deviation'][measure])}"
        for measure in ("p_max_MPa", "area_mm2")
    )
    footnote = _describe_cheaper_theory(record, name)
    return f"{lead} ({deviations_text}; limit utilisation {judged_theory['limit_utilisation']:.2f}){footnote}"


def _describe_cheaper_theory(record: Record, cheapest_name: str) -> str:
    """Sentence about the first cheaper theory that may hold."""
    for name, theory in judged_theories(record).items():
        if name == cheapest_name:
            break
        answer = elastic_record(record)["verdict"]["answer"] if name == HERTZ else theory["verdict"]["answer"]
        if name != HERTZ_GAUGE and answer == "UNRESOLVED":
            return f"; {THEORIES[name].words} is cheaper and may hold"
    return ""


def cheapest_text_of_row(row: Record) -> str:
    """Text for the cheapest theory of a row, in percent with fewer digits than `cheapest_text`.

    It is empty if Hertz holds in its range, or if no theory holds.

    Parameters
    ----------
    row
        Row of a load.

    Returns
    -------
    str
        Theory, deviations of peak pressure and area, and limit utilisation.
    """
    lead = _cheapest_lead(row)
    if not lead:
        return ""
    name = row["cheapest_theory"]
    p_max, area = (float(row[f"{name}_deviation_{short}_percent"]) for short in ("p_max", "area"))
    utilisation = float(row[f"{name}_limit_utilisation"])
    return f"{lead} (p_max {p_max:+z.1f} %, area {area:+z.1f} %, limit utilisation {utilisation:.2f})"


def deciding_measure_text(row: Record, limits: Mapping[str, float]) -> str:
    """Deciding measure of a row with the deviation of Hertz and its limit.

    Parameters
    ----------
    row
        Row of a table.
    limits
        Limits by measure.

    Returns
    -------
    str
        The text. For an unusable row it is the status; without a deciding measure it is empty.
    """
    if not is_usable_status(row):
        return str(row["status"])
    if (numbers := _read_deciding_numbers(row)) is None:
        return ""
    measure, deviation, uncertainty = numbers
    return deviation_sentence(measure, deviation, uncertainty, limits.get(measure), str(row.get("verdict_answer", "")))


def reason_text_of_row(row: Record) -> str:
    """Reason for the verdict of a row: its cause, and for UNRESOLVED the least certain measure.

    Parameters
    ----------
    row
        Row of a usable result.

    Returns
    -------
    str
        The reason; empty without a cause and for a resolved verdict.
    """
    cause, numbers = row.get("verdict_cause") or "", _read_deciding_numbers(row)
    if row.get("verdict_answer") != "UNRESOLVED" or numbers is None:
        return str(cause)
    measure, deviation, uncertainty = numbers
    sentence = (
        unknown_text([measure])
        if deviation is None
        else deviation_sentence(measure, deviation, uncertainty, None, "UNRESOLVED", nearest=True)
    )
    return f"{sentence}; cause: {cause}" if cause else sentence


def _read_deciding_numbers(row: Record) -> tuple[str, float | None, float | None] | None:
    """Deciding measure of a row, with the deviation of Hertz and its uncertainty; None without a measure."""
    measure = row.get("verdict_measure")
    if measure is None or not (measure in MEASURE_WORDS or is_own(measure)):
        return None
    *columns, factor = deviation_columns(measure)
    deviation, uncertainty = (None if row.get(name) is None else float(row[name]) / factor for name in columns)
    return measure, deviation, uncertainty


_ANY_PROFILE_REMEDY = "declare the filter length, or measure the profiles with less noise or closer points"
# What decides a verdict that profile variants leave open, by the cause in the record.
_PROFILE_REMEDIES = {
    "filter": "declare the filter length that counts (--rail-filter-mm, --wheel-filter-mm)",
    "nominal profile": "give the nominal profile, or none (--rail-nominal, --wheel-nominal)",
    "noise": "measure the profiles with less noise or closer points",
}


def remedy_text(record: Record) -> str:
    """Remedy for an unresolved verdict: finer meshes, or better profiles.

    Parameters
    ----------
    record
        Record of a load with the verdict UNRESOLVED.

    Returns
    -------
    str
        Sentence for the reader.
    """
    measure = record["verdict"]["measure"]
    if record.get("plastic") and not is_usable_status(record["plastic"]):
        return f"the effect of yielding was not solved: {describe_status(record['plastic'])}"
    if not is_usable_status(record):
        return f"do not use this result: {describe_status(record)}"
    if record["verdict"]["cause"] == PROFILE_CAUSE:
        change = MEASURE_WORDS[measure].deviation_text(record["uncertainty_of_profile"][measure], size=True)
        remedy = _PROFILE_REMEDIES.get(record["verdict"]["open_because"], _ANY_PROFILE_REMEDY)
        return (
            f"finer meshes cannot decide: the deviation differs by {change} between the profile variants; to decide,"
            f" {remedy}"
        )
    if (irreducible := _irreducible_uncertainty(record)) is not None:
        distance, irreducible_uncertainty = (
            MEASURE_WORDS[measure].deviation_text(size, size=True) for size in irreducible
        )
        return (
            f"finer meshes cannot decide: the deviation is only {distance} from its limit, and"
            f" {irreducible_uncertainty} of its uncertainty comes from reading it on nodes and from the cut planes"
        )
    case, solver, names = record["case"], record["solver"], list(RESOLUTIONS)
    if case["resolution"] in names[:-1]:
        finer = f"--resolution {' or '.join(names[names.index(case['resolution']) + 1 :])}"
    else:
        finer = (
            f"--resolution with sizes below {','.join(f'{size:.3g}' for size in solver['element_size_mm'].values())}"
        )
    return f"to decide, use {finer}{', or --refine verdict' if case['refine'] == 'never' else ''}"


_IRREDUCIBLE_CONTRIBUTIONS = ("reading", "common_mesh_error", "cut_planes")


def _irreducible_uncertainty(record: Record) -> tuple[float, float] | None:
    """Distance of the deciding measure from its limit, and its irreducible uncertainty.

    Both are in the unit of the deviation (-). No mesh removes the irreducible uncertainty. The result is None if the
    distance is at least as large, or if the stated uncertainty is more than 2 times the irreducible uncertainty.
    """
    measure, hertz = record["verdict"]["measure"], deciding_hertz(record)
    if measure not in record["uncertainty_budget"]:
        return None
    deviation, stated_uncertainty = hertz["deviation"][measure], hertz["uncertainty"][measure]
    irreducible_uncertainty = sum(record["uncertainty_budget"][measure][name] for name in _IRREDUCIBLE_CONTRIBUTIONS)
    distance = abs(abs(deviation) - record["verdict"]["limits"][measure])
    return (
        (distance, irreducible_uncertainty)
        if distance < irreducible_uncertainty and stated_uncertainty <= 2.0 * irreducible_uncertainty
        else None
    )


# Characters of a line in a picture that is as wide as half a window of 1000 pixels.
_ANNOTATION_WIDTH = 40


def case_annotation(record: Record) -> str:
    """Text of a case and its verdict in short lines, for a picture.

    Parameters
    ----------
    record
        Record of a result.

    Returns
    -------
    str
        Lines of at most 40 characters.
    """
    fe, hertz = (measures["p_max_MPa"] for measures in (requested_record(record)["fe"], deciding_hertz(record)))
    lines = (
        case_words(record["case"]),
        f"Hertz {record['verdict']['answer']}: {verdict_reason(record)}",
        f"peak pressure: finite elements {fe:.0f} MPa, Hertz {hertz:.0f} MPa",
    )
    return "\n".join(fill(text, _ANNOTATION_WIDTH) for text in lines)
