"""What results are called: measures, verdicts, cases, rolls and series; what reports say in words."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from textwrap import fill
from typing import Any

from fecontact.case import RESOLUTIONS, Case, Opposite
from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, HERTZ_GAUGE, THEORIES
from fecontact.criteria import Criteria
from fecontact.errors import usable, with_remedy
from fecontact.feature_registry import offered
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import PLASTIC, RUNGS
from fecontact.judging.lines import FILTER
from fecontact.judging.measures import MEASURES, Measures
from fecontact.judging.solved_load import unmeshed
from fecontact.judging.verdict import PROFILE
from fecontact.outputs.tables import VARIED, Row, pair_words, relative_name, short_name
from fecontact.placement.irregularity import irregularity_text
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.reading import is_crane_rail, makes_a_wheelset
from fecontact.solving.placing import roll_of_case
from fecontact.solving.solve import CaseResult


@dataclass(frozen=True, kw_only=True)
class Words:
    """A measure in words.

    Attributes
    ----------
    short
        Its name in the criteria, or one for a picture.
    meaning
        What it is.
    letter
        Of its own, for the cells of a map.
    name, unit
        Its name, and the unit of its value.
    off_unit
        Unit of the deviation, its uncertainty and its limit: `%`, or Hertz's half-width `b`.
    signed
        Whether Hertz may be off to both sides.
    rank
        Where a table has no room, measures of the lowest rank are left out first; rank 0 stays.
    """

    short: str
    letter: str
    name: str
    unit: str
    meaning: str
    off_unit: str = "%"
    signed: bool = True
    rank: int = 0

    @property
    def title(self) -> str:
        """Name with unit, for the head of a line."""
        return f"{self.name} ({self.unit})"

    @property
    def factor(self) -> float:
        """What a deviation is multiplied by to be in its unit."""
        return 100.0 if self.off_unit == "%" else 1.0

    @property
    def digits(self) -> int:
        """Decimals of a deviation in its unit."""
        return 2 if self.off_unit == "%" else 3

    def off(self, value: float | None, *, size: bool = False) -> str:
        """A deviation with its unit, or with `size` its uncertainty; a dash where it is not known."""
        if value is None or not math.isfinite(value):
            return "-"
        sign = "+" if self.signed and not size else ""
        return f"{self.factor * value:{sign}z.{self.digits}f} {self.off_unit}"

    def limit(self, value: float) -> str:
        """A limit with its unit."""
        return f"{'±' if self.signed else '< '}{self.factor * value:.12g} {self.off_unit}"


_TEXTS = tomllib.loads((files("fecontact.outputs") / "words.toml").read_text("utf-8"))
WORDS: dict[str, Words] = {name: Words(**parts) for name, parts in _TEXTS["measures"].items()}
"""The words of every measure."""


def names_text(measures: Iterable[str]) -> str:
    """Names of measures, joined by commas."""
    return ", ".join(WORDS[measure].name for measure in measures)


def criteria_text(criteria: Criteria) -> str:
    """The measures that decide, each with its limit."""
    shown = ((WORDS[measure], limit) for measure, limit in criteria.limits.items())
    return ", ".join(f"{words.short} {words.limit(limit)}" for words, limit in shown)


def limits_text(criteria: Criteria) -> str:
    """Measures that decide by their limits, such as "5 % p_max; 10 % area, a, b; 0.15 b centre"."""
    groups: dict[str, list[str]] = {}
    for measure, limit in criteria.limits.items():
        words = WORDS[measure]
        groups.setdefault(f"{words.factor * limit:.4g} {words.off_unit}", []).append(words.short)
    return "; ".join(f"{limit} {', '.join(names)}" for limit, names in groups.items())


def unknown_text(measures: Iterable[str]) -> str:
    """That a result does not tell measures, and what to do about it."""
    return f"the stored result does not have {names_text(measures)}; solve it again to judge by them"


def deviation_column(measure: str) -> tuple[str, str, float]:
    """Columns of a measure's deviation and of its uncertainty, and what their numbers are multiplied by."""
    factor = WORDS[measure].factor
    name = relative_name(measure)
    return f"hertz_deviation_{name}", f"hertz_uncertainty_{name}", factor


# --- A case in words.


def case_words(case: Case, placement: Placement) -> str:
    """Pair, position and load of a case, in one line."""
    roll = 1e3 * roll_of_case(case, placement)
    turned = f", yaw {1e3 * case.yaw_rad:+.4g} mrad" if case.yaw_rad else ""
    if case.roll != "given":
        turned = f" of the wheelset, {case.side} side, roll {roll:+z.4g} mrad{turned}"
    elif roll:
        turned = f", roll {roll:+.4g} mrad{turned}"
    lines = (("rail", case.rail_irregularity), ("wheel", case.wheel_irregularity))
    irregular = ", ".join(f"{body} {irregularity_text(line)}" for body, line in lines if line is not None)
    return (
        f"{pair_words(case)};"
        f" shift {case.lateral_shift_mm:+z.2f} mm{turned}; {case.load_kind} load {case.load_N / 1e3:.4g} kN"
        + (f"; at {case.distance_mm:g} mm of {irregular}" if irregular else "")
    )


# --- Verdicts in words: on the terminal, in pictures and in reports.

YIELDING = "against bodies that yield"
"""What a verdict is against if there is a yield stress."""


def elastic_words(answer: str) -> str:
    """The second verdict of a case with a yield stress."""
    return f"against elastic bodies Hertz {answer}"


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
    if load.plastic is not None:
        decided = load.plastic.deciding
        limits = {"limits": load.case.criteria.limits, "side": "both"}
        reason = _reason({**vars(decided.verdict), **limits}, vars(decided))
        return f"{YIELDING}, {reason}; {elastic_words(load.verdict.answer)}"
    side, judged = load.deciding_side
    reason = _reason({**vars(load.verdict), "limits": load.case.criteria.limits, "side": side}, vars(judged))
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
        f"Hertz {result.load.answer.answer}: {verdict_reason(result.load)}",
        f"peak pressure: finite elements {fe:.0f} MPa, Hertz {hertz:.0f} MPa",
    )
    return "\n".join(fill(text, _ANNOTATION_WIDTH) for text in told)


# --- How a wheel is rolled, and which wheel of a wheelset it is, in words: for titles, axes, tables and reports.

SHIFT = "lateral shift of the wheelset in mm  (positive: towards this rail)"
"""Label of an axis over the shift."""
OF_WHEELSET = "rolled until both wheels touch"
UNDER_LOAD = "roll of the loaded wheelset"
_OTHER = {"left": "right", "right": "left"}
_TOWARDS = {"left": "positive: towards its rail", "right": "negative: towards its rail"}


def roll_words(case: Case) -> str:
    """Whether the roll is found from the wheelset or given, such as "roll fixed at 0 mrad"."""
    if case.roll == "loaded":
        own, other = (load_N and load_N / 1e3 for load_N in (case.roll_load_N, case.opposite.wheel_load_N))
        return _under_load(case.side, own, other)
    if case.roll == "touching":
        return OF_WHEELSET
    fixed = f"roll fixed at {1e3 * case.roll_rad:g} mrad"
    if makes_a_wheelset(case.rail, case.wheel):
        return fixed
    why = "a crane rail has" if is_crane_rail(case.rail) else "lines given by their radii have"
    return f"{fixed} ({why} no wheelset)"


def roll_words_of_rows(rows: Sequence[Row]) -> str:
    """The same of rows of tables, whose values may be texts."""
    found = [row for row in rows if row.get("roll_mrad") not in (None, "")]
    kinds = {row.get("roll") or "given" for row in found}
    if kinds == {"touching"}:
        return OF_WHEELSET
    if kinds == {"touching", "loaded"}:
        return f"{OF_WHEELSET}, loaded or not"
    if kinds == {"loaded"}:
        ways = {(_number(row, "roll_load_kN"), _number(row, "opposite_load_kN")) for row in found}
        sides = {str(row["side"]) for row in found}
        return _under_load(sides.pop(), *ways.pop()) if len(ways) == len(sides) == 1 else UNDER_LOAD
    rolls = {float(row["roll_mrad"]) for row in found}
    if kinds == {"given"}:
        return f"roll fixed at {rolls.pop():g} mrad" if len(rolls) == 1 else "roll fixed case by case"
    return f"{OF_WHEELSET}, or fixed" if kinds else ""


def _under_load(side: str, own: float | None, other: float | None) -> str:
    """The roll of a loaded wheelset; `own` and `other` are loads (kN) if they differ from the cases' loads."""
    if other is None:
        return UNDER_LOAD if own is None else f"roll of the wheelset under {own:g} kN a wheel"
    others = f"{other:g} kN on its {_OTHER[side]} wheel"
    if own is None:
        return f"{UNDER_LOAD}, {others}"
    return f"roll of the wheelset under {own:g} kN on its {side} wheel, {others}"


def _number(row: Row, column: str) -> float | None:
    return None if row.get(column) in (None, "") else float(row[column])


def shift_label(case: Case) -> str:
    """Label of an axis over the lateral shift, of a wheelset with the wheel whose it is."""
    if case.roll == "given" and case.side == "left":
        return SHIFT
    return f"{case.side} wheel: lateral shift of the wheelset in mm  ({_TOWARDS[case.side]})"


def other_wheel_label(case: Case) -> str | None:
    """Label of the axis with the sign turned, on which the picture shows the other wheel of the wheelset.

    None where it is not: the other side has other profiles or another diameter, or the roll is given.
    """
    if case.roll == "given" or case.opposite != Opposite():
        return None
    other = _OTHER[case.side]
    yawed = " at the opposite yaw" if case.yaw_rad else ""
    return f"{other} wheel{yawed}: lateral shift of the wheelset in mm  ({_TOWARDS[other]})"


# --- Series of a study's cases over the lateral shift: what is one line of a figure, and one collection for ParaView.

# A series has one of each; of the latter only where its cases would not be told apart by their shift (the roll may
# follow from it).
_OWN = ("rail", "wheel", "load_kN")
_OWN_IF_NEEDED = (
    *("side", "roll", "inclination_rad", "yaw_mrad", "resolution"),
    *("roll_load_kN", "opposite_load_kN", "roll_mrad", VARIED),
)
# Rows of single left wheels have neither column.
_ABSENT = {"side": "left", "roll": "given"}
_WORDS = {
    ("roll", "touching"): "both wheels touch",
    ("roll", "loaded"): "roll of the loaded wheelset",
    ("roll", "given"): "fixed roll",
}


@dataclass(frozen=True, kw_only=True)
class Series:
    """Cases that differ in their lateral shift, sorted by it, and the values that set them apart from other series."""

    rows: tuple[Row, ...]
    own: Mapping[str, str]

    @property
    def label(self) -> str:
        """What tells it from the other series, for a legend; empty if there is none."""
        return ", ".join(_words(column, value) for column, value in self.own.items())

    @property
    def file_suffix(self) -> str:
        """The same for the name of a file, with a separator before it."""
        words = (f"_{_words(column, value).replace(' ', '')}" for column, value in self.own.items())
        return "".join(c if c.isalnum() or c in "_.-@" else "-" for c in "".join(words))


def series(rows: Sequence[Row]) -> tuple[Series, ...]:
    """All series of a study, in the order of their first cases."""
    return tuple(_split(rows, {}, (*_OWN, *_OWN_IF_NEEDED)))


def _split(rows: Sequence[Row], own: Mapping[str, str], columns: Sequence[str]) -> Iterator[Series]:
    one_a_shift = len({row["lateral_shift_mm"] for row in rows}) == len(rows)
    if not columns or (columns[0] in _OWN_IF_NEEDED and one_a_shift):
        yield Series(rows=tuple(sorted(rows, key=lambda row: float(row["lateral_shift_mm"]))), own=own)
        return
    column, *others = columns
    # a case that failed early has no value for some of them
    each = [str(row.get(column, _ABSENT.get(column, ""))) for row in rows]
    values = list(dict.fromkeys(each))
    for value in values:
        mine = [row for row, its in zip(rows, each, strict=True) if its == value]
        yield from _split(mine, {**own, column: value} if len(values) > 1 else own, others)


def _words(column: str, value: str) -> str:
    if column in ("rail", "wheel"):
        return short_name(value)
    if column == VARIED:
        return value
    if (column, value) in _WORDS:
        return _WORDS[column, value]
    quantity, _, unit = column.rpartition("_")
    words = quantity.replace("_", " ")
    if not quantity or not value:
        return value or f"no {column}"
    return f"{'' if quantity == 'load' else words + ' '}{float(value):.4g} {unit}"


# --- What reports say in words: the question, the answer, and what the terms mean.

_RUNGS = "; ".join(f"{name.replace('_', ' ')}: {words}" for name, words in RUNGS.items())
GLOSSARY = tuple((term, meaning.format(rungs=_RUNGS)) for term, meaning in _TEXTS["terms"].items())
"""Terms of a report."""


def measure_terms() -> tuple[tuple[str, str], ...]:
    """Names of the measures and what they are."""
    return tuple(
        (f"{words.short}: {words.title}", f"{words.meaning[0].upper()}{words.meaning[1:]}.") for words in WORDS.values()
    )


def theory_terms(names: Iterable[str], *, laws: bool) -> Iterator[tuple[str, str]]:
    """Theories of the pressure, and the laws of features: their source, what they take for granted, and their cost."""
    wanted = {*names} - {*EITHER_SIDE}
    told: list[Mapping[str, Any]] = [vars(theory) for name, theory in THEORIES.items() if name in wanted]
    if laws:
        told += [law for found in offered("LAWS").values() for law in found.laws.values()]
    for one in told:
        yield one["words"], "{source}. It takes for granted: {range}. Cost: {cost}.".format_map(one)


def question(pair: str, criteria: Criteria | None, roll: str = "") -> str:
    """What a study or map asks, and how the wheels are rolled."""
    by = (
        f" Judged by: {criteria_text(criteria)} (what that is: see Terms)."
        if criteria
        else " Each case has its own criteria."
    )
    rolled = f" {roll[0].upper()}{roll[1:]}." if roll else ""
    return f"May Hertz's ellipse stand for the contact of {pair}?{by}{rolled}"


def answer_words(verdicts: Sequence[str], what: str) -> str:
    """How many hold, fail, and are open or lost, such as "Hertz holds in 4 of 9 cases, fails in 5"."""
    count = {one: verdicts.count(one) for one in ("HOLDS", "FAILS", "UNRESOLVED")}
    lost = len(verdicts) - sum(count.values())
    more = [f"is open in {count['UNRESOLVED']}"] if count["UNRESOLVED"] else []
    more += [f"{lost} could not be used"] if lost else []
    return f"Hertz holds in {count['HOLDS']} of {len(verdicts)} {what}, fails in {count['FAILS']}" + "".join(
        f", {one}" for one in more
    )


def lead_style(verdicts: Sequence[str]) -> str:
    """Colour of the answer: the colour of HOLDS only if all hold."""
    if set(verdicts) == {"HOLDS"}:
        return "lead holds"
    return "lead fails" if "FAILS" in verdicts else "lead"
