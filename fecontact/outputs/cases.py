"""Tables of cases, and cases on the terminal: touch points, measures, lobes, ladder, verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.criteria import Criteria
from fecontact.errors import short_status, usable
from fecontact.feature_registry import offered
from fecontact.judging.ladder import PLASTIC
from fecontact.judging.measures import MEASURES
from fecontact.outputs.flat_records import flat
from fecontact.outputs.pair_names import VARIED, pair_of_row
from fecontact.outputs.parts import Picture
from fecontact.outputs.records.cheapest import cheapest_words
from fecontact.outputs.tables import (
    Column,
    Item,
    Table,
    TableRow,
    Tone,
    columns_of,
    number,
    number_text,
    table_of,
    text,
)
from fecontact.outputs.verdict_words import decided, theory_words
from fecontact.outputs.words import WORDS, deviation_column

# --- Tables about theories of the pressure, for the terminal and reports.


def cheapest_column(heading: str, of: str, *, name: str = "") -> Column:
    """The cheapest theory that holds in words, and whether it is out of its range."""
    return text(
        heading, lambda row: theory_words(row.get(of), row.get(f"{of}_status")), none="-", name=name, wraps=True
    )


# --- Tables of cases: their verdicts, and of one its measures, lobes, ladder and effort.

_TONES: Mapping[str, Tone] = {"HOLDS": "plain", "UNRESOLVED": "open", "FAILS": "fails"}


@dataclass(frozen=True, kw_only=True)
class ReportedCase:
    """A case as a report shows it.

    Attributes
    ----------
    row
        Its line in the study's table.
    record
        What its `result.json` says; empty where there is none.
    picture
        File of its picture; None where there is none.
    relief
        Its pressure as a relief that turns; None where it is not drawn.
    """

    row: Item
    record: Item = field(default_factory=dict)
    picture: Path | None = None
    relief: Picture | None = None

    @property
    def limits(self) -> Mapping[str, float]:
        """Limits by which it was judged, by measure; empty where they are not known."""
        found: Mapping[str, float] = self.record.get("verdict", {}).get("limits", {})
        return found


NO_VERDICT = "failed"
"""In place of a verdict where the result must not be used."""


def verdict_of(row: Item) -> str:
    """Its verdict; `failed` where the result must not be used, but for a failure that is certain without it."""
    return str(row.get("verdict_answer", NO_VERDICT)) if _has_verdict(row) else NO_VERDICT


def _has_verdict(row: Item) -> bool:
    return usable(row) or row.get("verdict_answer") == "FAILS"


_PLACE = (number("shift\nmm", "lateral_shift_mm", "{:+z.2f}"), number("load\nkN", "load_kN"))
_DISTANCE = number("distance\nmm", "distance_mm")


def _off(measure: str, limit: float) -> Column:
    """How far Hertz is off in a measure that decides, to a digit that a limit below 1 is seen by."""
    words, (column, _, _) = WORDS[measure], deviation_column(measure)
    form = f"{{:{'+' * words.signed}z.{1 + (words.factor * limit < 1.0)}f}}"
    unit = f"in {words.off_unit}" if words.off_unit != "%" else "dev %" if measure in MEASURES else "%"
    short = words.short if len(words.short) < 8 else f"{words.short[:5]}."
    return number(f"{short}\n{unit}", column, form, rank=words.rank, name=words.short * bool(words.rank))


_P_MAX, *_OTHERS = (_off(measure, limit) for measure, limit in Criteria().limits.items())
_NUMBERS = (
    number("p_max\nFE MPa", "fe_p_max_MPa", "{:.0f}", rank=5, name="p_max in MPa"),
    _P_MAX,
    number("\n± %", "hertz_uncertainty_p_max_percent", "{:.1f}", rank=3, name="± of p_max"),
    *_OTHERS,
)
_EFFORT = (
    number("meshes", "solver_meshes", "{:.0f}", rank=2, name="meshes"),
    number("time\ns", "seconds", "{:.0f}", rank=1, name="time"),
)
_PEAKS = (
    number("peak FE MPa", "fe_p_max_MPa", "{:.0f}"),
    number("peak Hertz MPa", "hertz_p_max_MPa", "{:.0f}"),
    number("share of the limit", "verdict_limit_used", "{:.2f}"),
)


def deviation_table(rows: Sequence[Item], title: str, failing_width: int, *, with_pair: bool = False) -> Table:
    """How far Hertz is off in each case, and by what it fails, in so many characters."""
    theories = any(row.get("cheapest_theory") for row in rows)
    columns = [
        *[text("rail, wheel", pair_of_row)] * with_pair,
        *_places(rows),
        *_NUMBERS,
        # what must not be used has no verdict
        text("verdict", lambda row: row.get("verdict_answer", "-") if _has_verdict(row) else short_status(row)),
        text("fails by", lambda row: _failing(row, failing_width)),
        *[text("elastic\nbodies", "elastic_verdict_answer")] * any("elastic_verdict_answer" in row for row in rows),
        *[cheapest_column("cheapest\ntheory", "cheapest_theory", name="cheapest theory")] * theories,
        *_EFFORT,
    ]
    return table_of(title, columns, rows, lambda row: "plain" if usable(row) else "fails")


def _places(rows: Sequence[Item]) -> list[Column]:
    """Shift and load, along what is irregular the distance, and what else varies."""
    distance = any(row.get("distance_mm") is not None for row in rows)
    return [
        *_PLACE,
        *[_DISTANCE] * distance,
        *[text(VARIED, VARIED, wraps=True)] * any(row.get(VARIED) for row in rows),
    ]


def _failing(row: Item, width: int) -> str:
    """Short names of the measures that fail, the one that decided first; those that find no room are counted."""
    measures, first = filter(None, str(row.get("verdict_failing") or "").split("; ")), row.get("verdict_measure")
    names = [WORDS[measure].short for measure in sorted(measures, key=lambda measure: measure != first)]
    for shown in range(len(names), 0, -1):
        more = [f"+{len(names) - shown}"] if shown < len(names) else []
        text = " ".join((*names[:shown], *more))
        if len(text) <= width:
            return text
    return ""


def verdict_table(cases: Sequence[ReportedCase]) -> Table:
    """All cases with their verdicts and what decided; and what features say of them."""
    rows = [{**case.row, "limits": case.limits} for case in cases]
    several = len({pair_of_row(row) for row in rows}) > 1
    theories = any(row.get("cheapest_theory") for row in rows)
    columns = [
        *[text("rail and wheel", lambda row: pair_of_row(row, " and "))] * several,
        *_places(rows),
        text("Hertz", verdict_of, "answer"),
        *[text("Hertz against elastic bodies", "elastic_verdict_answer", "answer")]
        * any("elastic_verdict_answer" in row for row in rows),
        text("decided by", lambda row: decided(row, row["limits"])),
        text("because", "verdict_cause"),
        *_PEAKS,
        *[text("cheapest theory that holds", cheapest_words)] * theories,
        *(
            column
            for name, telling in offered("TELLINGS").items()
            if any(key.startswith(f"{name}_") for row in rows for key in row)
            for column in telling.columns
        ),
    ]
    return table_of("", columns, rows, lambda row: "fails" if verdict_of(row) == "FAILS" else "plain")


def elements_table(record: Item) -> Table:
    """Hertz against the contact on the elements' own nodes alone: what they say by themselves."""
    own, fine, limits = record["elements"], record["fe"], record["verdict"]["limits"]
    judged = own[HERTZ]
    lines = []
    for measure in limits:
        words, answer = WORDS[measure], judged["verdict"]["each"][measure]
        values = (number_text(own[measure]), number_text(fine[measure])) if measure in own else ("", "")
        off, unsure = (judged[of].get(measure) for of in ("deviation", "uncertainty"))
        cells = [words.title, *values, words.off(off), words.off(unsure, size=True), words.limit(limits[measure])]
        lines.append(TableRow(cells=[*cells, answer], tone=_TONES[answer]))
    columns = columns_of("own nodes", "finer nodes", "Hertz off\nown nodes", "±", "limit", "answer", texts=("answer",))
    title = f"The elements by themselves: Hertz {judged['verdict']['answer']} (verdict: {record['verdict']['answer']})"
    return Table(title=title, columns=[Column(heading="measure", kind="text", wraps=True), *columns], rows=lines)


def measures_table(
    record: Item, judged: Item, title: str = "", name: str = "Hertz", *, judged_only: bool = False
) -> Table:
    """The measures of finite elements and of a theory side by side, deciding measures first."""
    limits, each = record["verdict"]["limits"], judged["verdict"]["each"]
    others = () if judged_only else (measure for measure in WORDS if measure not in limits)
    lines = []
    for measure in (*limits, *others):
        words, off = WORDS[measure], judged["deviation"].get(measure)
        # of some there is nothing in an ellipse
        values = (words.off(off).removesuffix(words.off_unit).strip(), "0")
        if measure in judged:
            values = (number_text(record["fe"][measure]), number_text(judged[measure]))
        cells = [words.title, *values, words.off(off), words.off(judged["uncertainty"].get(measure), size=True)]
        cells += [words.limit(limits[measure]) if measure in limits else "", each.get(measure, "not judged")]
        lines.append(TableRow(cells=cells, tone=_TONES.get(each.get(measure, ""), "dim")))
    columns = columns_of("FE", name, "off by", "±", "limit", "answer", texts=("answer",))
    # where there is no room, the names take two lines
    return Table(title=title, columns=[Column(heading="measure", kind="text", wraps=True), *columns], rows=lines)


_OF_THEORY = (
    text("theory", lambda theory: THEORIES[theory["name"]].words),
    number("p_max\ndev %", lambda theory: theory["deviation"].get("p_max_MPa"), "{:+z.1f}", 1e2, none=""),
    number("area\ndev %", lambda theory: theory["deviation"].get("area_mm2"), "{:+z.1f}", 1e2, none=""),
    number("share of\nthe limit", "limit_used", "{:.2f}", none=""),
    text("decided by", lambda theory: theory.get("problem") or WORDS[theory["verdict"]["measure"]].name, wraps=True),
    text("verdict", lambda theory: theory_words(theory["verdict"]["answer"], theory.get("status")), wraps=True),
)


def theories_table(record: Item) -> Table:
    """The verdict on every theory of the pressure, and why one has no contact."""
    none = {"deviation": {}, "verdict": {"answer": "none"}}
    theories = [{**none, **theory, "name": name} for name, theory in record["theories"].items()]
    title = "Theories of the contact, the cheapest first"
    return table_of(title, _OF_THEORY, theories, lambda theory: _TONES.get(theory["verdict"]["answer"], "dim"))


_PEAK = (
    number("peak", "number", "{:.0f}"),
    number("its s from the\ntouch point mm", "y_mm", "{:+z.1f}"),
    number("peak\nMPa", "p_max_MPa", "{:.0f}"),
    number("of the force\n%", "force_share", "{:.1f}", 1e2),
)
_LOBE = (
    text("part", lambda one: "patch" if one["separate"] else "lobe"),
    number("centre at\nrail y mm", "rail_y_mm", "{:+z.1f}"),
    number("its force\nkN", "normal_force_N", "{:.2f}", 1e-3),
    number("\n± %", lambda one: one["fe_uncertainty"]["normal_force_N"], "{:.1f}", 1e2, name="± of its force"),
    number("p_max\nFE MPa", lambda one: one["fe"]["p_max_MPa"], "{:.0f}"),
    number("\n± %", lambda one: one["fe_uncertainty"]["p_max_MPa"], "{:.1f}", 1e2, name="± of p_max"),
    number("p_max\ndev %", lambda one: one["deviation"].get("p_max_MPa"), "{:+z.1f}", 1e2),
    number("area\ndev %", lambda one: one["deviation"].get("area_mm2"), "{:+z.1f}", 1e2),
    text("decided by", lambda one: WORDS[one["verdict"]["measure"]].short if one["verdict"] else "no ellipse there"),
    text("Hertz", lambda one: one["verdict"]["answer"] if one["verdict"] else "none", "answer"),
)


def lobes_table(record: Item) -> Table:
    """Every separate patch and every lobe by itself, each beside Hertz's ellipse under its own force."""
    return table_of("", _LOBE, record["lobes"])


def peaks_table(record: Item) -> Table:
    """The peaks of a contact, the highest first."""
    peaks, pieces = record["fe"]["lobes"], record["fe"]["pieces"]
    counts = f"{len(peaks)} {'lobe' if len(peaks) == 1 else 'lobes'}, {pieces} {'patch' if pieces == 1 else 'patches'}"
    return table_of(counts, _PEAK, [{**peak, "number": place} for place, peak in enumerate(peaks, start=1)])


def ladder_table(record: Item) -> Table:
    """The rungs from Hertz to the finite elements."""
    columns = columns_of("rung", "p_max\nMPa", "area\nmm²", "approach\nmm", texts=("rung",))
    lines = []
    rungs = {**record["theories"], **record, "fe_plastic": record.get("plastic")}
    for name in ("hertz", "half_space_quadratic", "half_space", "elements", "fe", "fe_plastic"):
        if (rung := rungs[name]) is None:
            continue
        # other rungs on these nodes are known no better than the judged rung
        unsure = record["elements"]["uncertainty"] if name == "elements" else {}
        if name == "fe_plastic":
            unsure = record["steps_uncertainty"][PLASTIC.name]
        cells = (
            number_text(rung[m]) + (f" ± {1e2 * unsure[m]:.1f} %" if m in unsure else "")
            for m in ("p_max_MPa", "area_mm2", "approach_mm")
        )
        lines.append((name.replace("_", " "), *cells))
    return Table(title="Ladder", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


_YIELDED = (
    text("body", "name"),
    number("yield stress\nMPa", "yield_MPa"),
    number("tangent\nMPa", "tangent_MPa"),
    number("first yield\nkN", "first_yield_N", "{:.1f}", 1e-3),
    number("plastic strain\n%", "largest_strain", "{:.2f}", 1e2),
    number("depth\nmm", "depth_mm", "{:.1f}"),
    text("zone\nmm", lambda body: _zone(body) if body["largest_strain"] else "-", "number"),
)


def _zone(body: Item) -> str:
    return f"{body['top_mm']:.1f} to {body['bottom_mm']:.1f}"


def plastic_tables(record: Item) -> list[Table]:
    """What yielding does to a contact, and Hertz against bodies that yield; none without a yield stress."""
    plastic = record.get("plastic")
    if plastic is None:
        return []
    steps, unsure = (record[of][PLASTIC.name] for of in ("steps", "steps_uncertainty"))
    lower, higher = (plastic[f"step_with_yield_stress_15_percent_{which}"] for which in ("lower", "higher"))
    columns = [
        text("measure", lambda measure: WORDS[measure].name, wraps=True),
        text("by plasticity", lambda measure: WORDS[measure].off(steps[measure]), "number"),
        text("±", lambda measure: WORDS[measure].off(unsure[measure], size=True), "number"),
        text("yield stress\n-15 %", lambda measure: WORDS[measure].off(lower[measure]), "number"),
        text("+15 %", lambda measure: WORDS[measure].off(higher[measure]), "number"),
    ]
    changes = [table_of(f"What yielding changes ({plastic['range']})", columns, lower)] if lower else []
    bodies = ({**body, "name": name} for name, body in plastic["bodies"].items())
    return [*changes, table_of("Bodies that yield", _YIELDED, bodies)]


_NUMBER = (text("number", lambda one: one[0]), number("value", lambda one: one[1], "{:.6g}"))


def numbers_table(record: Item) -> Table:
    """Every number of a record by its path, as the columns of tables are called."""
    told = {name: part for name, part in record.items() if name not in ("case", "theories", "versions")}
    found = flat({**told, **record["theories"]}).items()
    return table_of("", _NUMBER, (one for one in found if isinstance(one[1], int | float)))


def effort_table(solver: Item) -> Table:
    """Time and memory of each step of a case."""
    lines = [
        (step, f"{seconds:.2f}", f"{solver['memory_MB'][step]:.0f}") for step, seconds in solver["seconds"].items()
    ]
    lines.append(("all (memory: peak)", f"{sum(solver['seconds'].values()):.2f}", f"{solver['peak_memory_MB']:.0f}"))
    columns = columns_of("step", "time\ns", "memory after\nMB", texts=("step",))
    return Table(title="Time and memory", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


_RESIDUALS = ("contact_residual", "load_balance", "force_balance", "moment_balance")
_SOLVER = (
    *_PLACE,
    text("status", "status"),
    text("elements per semi-axis", lambda row: ", ".join(f"{count:.1f}" for count in row["elements"]), "number"),
    number("unknowns", "unknowns", "{:.0f}"),
    text("solver", lambda row: row["path"]),
    number("residual", "contact_residual", "{:.0e}"),
    number("load balance", "load_balance", "{:.0e}"),
    number("force balance", "force_balance", "{:.0e}"),
    number("moment balance", "moment_balance", "{:.0e}"),
    number("seconds", "seconds", "{:.0f}"),
    number("memory MB", "peak_memory_MB", "{:.0f}"),
)


def solver_table(cases: Sequence[ReportedCase]) -> Table:
    """Meshes, residuals, time and memory of all cases."""
    rows = []
    for case in cases:
        solver = case.record.get("solver", {})
        own = {name: solver.get(name) for name in _RESIDUALS}
        elements, path = solver.get("elements_a_semi_axis", ()), solver.get("path", "-")
        unknowns = sum(solver["degrees_of_freedom"].values()) if solver else None
        rows.append({**case.row, **own, "elements": elements, "path": path, "unknowns": unknowns})
    return table_of("", _SOLVER, rows)
