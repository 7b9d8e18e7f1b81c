"""Tables of cases: their verdicts, and of one its measures, lobes, ladder and effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.comparison.theories import EITHER_SIDE, THEORIES
from fecontact.outcome import short_status, usable
from fecontact.outputs.records.theories import cheapest_words
from fecontact.outputs.tables.table import (
    Column,
    Record,
    Table,
    TableRow,
    Tone,
    columns_of,
    number,
    number_text,
    table_of,
    text,
)
from fecontact.outputs.words.measures import WORDS
from fecontact.outputs.words.pairs import pair_of_row
from fecontact.outputs.words.verdicts import decided

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
    """

    row: Record
    record: Record = field(default_factory=dict)
    picture: Path | None = None

    @property
    def limits(self) -> Mapping[str, float]:
        """Limits by which it was judged, by measure; empty where they are not known."""
        found: Mapping[str, float] = self.record.get("verdict", {}).get("limits", {})
        return found


def verdict_of(row: Record) -> str:
    """Its verdict; `failed` where the result must not be used."""
    return str(row.get("verdict", "failed")) if usable(row) else "failed"


_PLACE = (number("shift\nmm", "lateral_shift_mm", "{:+z.2f}"), number("load\nkN", "load_kN"))
_DISTANCE = number("distance\nmm", "distance_mm")
_NUMBERS = (
    number("p_max\nFE MPa", "p_max_fe_MPa", "{:.0f}", rank=5, name="p_max in MPa"),
    number("p_max\ndev %", "p_max_deviation_percent", "{:+z.1f}"),
    number("\n± %", "p_max_uncertainty_percent", "{:.1f}", rank=3, name="± of p_max"),
    number("area\ndev %", "area_deviation_percent", "{:+z.1f}", rank=9, name="area"),
    number("a\ndev %", "a_deviation_percent", "{:+z.1f}", rank=4, name="a"),
    number("b\ndev %", "b_deviation_percent", "{:+z.1f}", rank=8, name="b"),
    number("centre\nin b", "centre_over_b", "{:+z.2f}", rank=7, name="centre"),
    number("valley\n%", "valley_percent", "{:z.1f}", rank=6, name="valley"),
    number("mispl.\n%", "misplaced_load_percent", "{:z.1f}", rank=10, name="misplaced"),
)
_EFFORT = (
    number("meshes", "meshes", "{:.0f}", rank=2, name="meshes"),
    number("time\ns", "seconds", "{:.0f}", rank=1, name="time"),
)
_PEAKS = (
    number("peak FE MPa", "p_max_fe_MPa", "{:.0f}"),
    number("peak Hertz MPa", "p_max_hertz_MPa", "{:.0f}"),
    number("part of a limit", "limit_used", "{:.2f}"),
)


def deviation_table(rows: Sequence[Record], title: str, failing_width: int, *, with_pair: bool = False) -> Table:
    """How far Hertz is off in each case, and by what it fails, in so many characters."""
    theories = any(row.get("theory_cheapest") for row in rows)
    columns = [
        *[text("rail, wheel", pair_of_row)] * with_pair,
        *_places(rows),
        *_NUMBERS,
        # what must not be used has no verdict
        text("verdict", lambda row: row.get("verdict", "-") if usable(row) else short_status(row)),
        text("fails by", lambda row: _failing(row, failing_width)),
        *[text("cheapest\ntheory", "theory_cheapest", none="-", name="cheapest theory")] * theories,
        *_EFFORT,
    ]
    return table_of(title, columns, rows, lambda row: "plain" if usable(row) else "fails")


def _places(rows: Sequence[Record]) -> list[Column]:
    """Shift and load, and along what is irregular the distance."""
    return [*_PLACE, *[_DISTANCE] * any(row.get("distance_mm") is not None for row in rows)]


def _failing(row: Record, width: int) -> str:
    """Short names of the measures that fail, the one that decided first; those that find no room are counted."""
    measures, first = str(row.get("verdict_failing") or "").split(), row.get("verdict_measure")
    names = [WORDS[measure].short for measure in sorted(measures, key=lambda measure: measure != first)]
    for shown in range(len(names), 0, -1):
        more = [f"+{len(names) - shown}"] if shown < len(names) else []
        text = " ".join((*names[:shown], *more))
        if len(text) <= width:
            return text
    return ""


def verdict_table(cases: Sequence[ReportedCase]) -> Table:
    """All cases with their verdicts and what decided; with those of forces where there are any."""
    rows = [{**case.row, "limits": case.limits} for case in cases]
    several = len({pair_of_row(row) for row in rows}) > 1
    theories, forces = (any(row.get(name) for row in rows) for name in ("theory_cheapest", "force_verdict"))
    columns = [
        *[text("rail and wheel", lambda row: pair_of_row(row, " and "))] * several,
        *_places(rows),
        text("Hertz", verdict_of, "answer"),
        text("decided by", lambda row: decided(row, row["limits"])),
        text("because", "verdict_cause"),
        *_PEAKS,
        *[text("cheapest theory that holds", cheapest_words)] * theories,
        *[
            text("for forces", lambda row: row.get("force_verdict") or "failed", "answer"),
            text("force off by, % of mu N", _force_off, "number"),
        ]
        * forces,
    ]
    return table_of("", columns, rows, lambda row: "fails" if verdict_of(row) == "FAILS" else "plain")


def _force_off(row: Record) -> str:
    """By how much creep forces are off."""
    if not row.get("force_verdict"):
        return "-"
    off, unsure = (float(row[f"force_worst{name}_percent"]) for name in ("", "_uncertainty"))
    return f"{off:.1f} ± {unsure:.1f}"


def hertz_tables(record: Record) -> list[Table]:
    """All measures of a case by Hertz, with both curvatures where the touch point lies at a junction."""
    tables = []
    for side in record.get("verdict", {}).get("sides", ()):
        by = "" if side["side"] == "both" else f", with the curvature of the {side['side']} side"
        tables.append(_measure_table(record, f"Hertz against finite elements{by}", "Hertz", side["hertz"], side))
    return tables


def elements_table(record: Record) -> Table:
    """Hertz against the contact on the elements' own nodes alone: what they say by themselves."""
    judged, verdict = record["verdict_elements"], record["verdict"]
    limits, own, fine = verdict["limits"], record["rungs"]["elements"], record["fe"]
    lines = []
    for measure in limits:
        words, answer = WORDS[measure], judged["each"][measure]
        values = (number_text(own[measure]), number_text(fine[measure])) if measure in own else ("", "")
        off, unsure = (judged[of].get(measure) for of in ("deviation", "uncertainty"))
        cells = [words.title, *values, words.off(off), words.off(unsure, size=True), words.limit(limits[measure])]
        lines.append(TableRow(cells=[*cells, answer], tone=_TONES[answer]))
    columns = columns_of("own nodes", "finer nodes", "Hertz off\nown nodes", "±", "limit", "answer", texts=("answer",))
    title = f"The elements by themselves: Hertz {judged['verdict']} (verdict: {verdict['verdict']})"
    return Table(title=title, columns=[Column(heading="measure", kind="text", wraps=True), *columns], rows=lines)


def measure_tables(record: Record) -> list[Table]:
    """All measures of a case by each theory."""
    tables = hertz_tables(record)
    for name, theory in record.get("theories", {}).items():
        if name not in EITHER_SIDE and "patches" in theory:
            judged = {**theory, "each": theory["verdict"]["each"]}
            tables.append(_measure_table(record, THEORIES[name].words, "theory", theory, judged))
    return tables


def _measure_table(record: Record, title: str, name: str, sizes: Record, judged: Record) -> Table:
    """The measures of the finite elements beside those of a theory, those that decide first."""
    limits, each = record["verdict"]["limits"], judged["each"]
    lines = []
    for measure in (*limits, *(measure for measure in WORDS if measure not in limits)):
        words, off = WORDS[measure], judged["deviation"].get(measure)
        # of some there is nothing in an ellipse
        values = (words.off(off).removesuffix(words.off_unit).strip(), "0")
        if measure in sizes:
            values = (number_text(record["fe"][measure]), number_text(sizes[measure]))
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
    number("part of\na limit", "limit_used", "{:.2f}", none=""),
    text("decided by", lambda theory: theory.get("problem") or WORDS[theory["verdict"]["measure"]].name, wraps=True),
    text("verdict", lambda theory: theory["verdict"]["verdict"]),
)


def theories_table(record: Record) -> Table:
    """The verdict on every theory of the pressure, and why one has no contact."""
    none = {"deviation": {}, "verdict": {"verdict": "none"}}
    theories = [{**none, **theory, "name": name} for name, theory in record["theories"].items()]
    title = "Theories of the contact, the cheapest first"
    return table_of(title, _OF_THEORY, theories, lambda theory: _TONES.get(theory["verdict"]["verdict"], "dim"))


_LOBE = (
    number("lobe", "number", "{:.0f}"),
    number("place across\nmm", "y_mm", "{:+z.1f}"),
    number("peak\nMPa", "p_max_MPa", "{:.0f}"),
    number("of the force\n%", "force_share", "{:.1f}", 1e2),
)


def lobe_table(record: Record) -> Table:
    """The lobes of a contact, from the gauge side on."""
    lobes, pieces = record["lobes"], record["pieces"]
    counts = f"{len(lobes)} {'lobe' if len(lobes) == 1 else 'lobes'}, {pieces} {'patch' if pieces == 1 else 'patches'}"
    return table_of(counts, _LOBE, [{**lobe, "number": place} for place, lobe in enumerate(lobes, start=1)])


def ladder_table(record: Record) -> Table:
    """The rungs from Hertz to the finite elements."""
    columns = columns_of("rung", "p_max\nMPa", "area\nmm²", "approach\nmm", texts=("rung",))
    lines = []
    for name, rung in record["rungs"].items():
        # the other rungs of the same nodes are no better known than what is judged
        unsure = record["elements_uncertainty"] if name == "elements" else {}
        if name == "fe_plastic":
            unsure = record["plastic"]["step_uncertainty"]
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


def _zone(body: Record) -> str:
    return f"{body['top_mm']:.1f} to {body['bottom_mm']:.1f}"


def plastic_tables(record: Record) -> list[Table]:
    """What yielding does to a contact, and Hertz against bodies that yield; none without a yield stress."""
    plastic = record.get("plastic")
    if plastic is None:
        return []
    steps, unsure = plastic["step"], plastic["step_uncertainty"]
    band = plastic["step_with_yield_stress_15_percent_lower_and_higher"]
    columns = [
        text("measure", lambda measure: WORDS[measure].name, wraps=True),
        text("by plasticity", lambda measure: WORDS[measure].off(steps[measure]), "number"),
        text("±", lambda measure: WORDS[measure].off(unsure[measure], size=True), "number"),
        text("yield stress\n-15 %", lambda measure: WORDS[measure].off(band[measure][0]), "number"),
        text("+15 %", lambda measure: WORDS[measure].off(band[measure][1]), "number"),
    ]
    changes = [table_of(f"What yielding changes ({plastic['range']})", columns, band)] if band else []
    bodies = ({**body, "name": name} for name, body in plastic["bodies"].items())
    return [*changes, table_of("Bodies that yield", _YIELDED, bodies)]


def effort_table(solver: Record) -> Table:
    """Time and memory of each step of a case."""
    lines = [
        (step, f"{seconds:.2f}", f"{solver['memory_MB'][step]:.0f}") for step, seconds in solver["seconds"].items()
    ]
    lines.append(("all (memory: peak)", f"{sum(solver['seconds'].values()):.2f}", f"{solver['peak_memory_MB']:.0f}"))
    columns = columns_of("step", "time\ns", "memory after\nMB", texts=("step",))
    return Table(title="Time and memory", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


_SOLVER = (
    *_PLACE,
    text("status", "status"),
    text("elements a semi-axis", lambda row: ", ".join(f"{count:.1f}" for count in row["elements"]), "number"),
    number("unknowns", "degrees_of_freedom", "{:.0f}"),
    text("solver", lambda row: row["path"]),
    number("residual", "contact_residual", "{:.0e}"),
    number("load balance", "load_balance", "{:.0e}"),
    number("seconds", "seconds", "{:.0f}"),
    number("memory MB", "peak_memory_MB", "{:.0f}"),
)


def solver_table(cases: Sequence[ReportedCase]) -> Table:
    """Meshes, residuals, time and memory of all cases."""
    rows = []
    for case in cases:
        solver = case.record.get("solver", {})
        own = {name: solver.get(name) for name in ("contact_residual", "load_balance")}
        elements, path = solver.get("elements_a_semi_axis", ()), solver.get("path", "-")
        rows.append({**case.row, **own, "elements": elements, "path": path})
    return table_of("", _SOLVER, rows)
