"""Tables of cases: their verdicts, and of one its measures, lobes, ladder and effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fecontact.comparison.theories import EITHER_SIDE, THEORIES
from fecontact.outcome import has_numbers, usable
from fecontact.outputs.records.theories import cheapest_words
from fecontact.outputs.tables.table import Column, Table, TableRow, Tone, columns_of, missing, number_text
from fecontact.outputs.words.measures import WORDS
from fecontact.outputs.words.pairs import pair_of_row
from fecontact.outputs.words.verdicts import decided

Row = Mapping[str, Any]
Record = Mapping[str, Any]

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

    row: Row
    record: Record = field(default_factory=dict)
    picture: Path | None = None

    @property
    def limits(self) -> Mapping[str, float]:
        """Limits by which it was judged, by measure; empty where they are not known."""
        found: Mapping[str, float] = self.record.get("verdict", {}).get("limits", {})
        return found


def verdict_of(row: Row) -> str:
    """Its verdict; `failed` where the result must not be used."""
    return str(row.get("verdict", "failed")) if usable(row) else "failed"


@dataclass(frozen=True, kw_only=True)
class _Number:
    """A column of numbers of a row. Deviations are Hertz minus finite elements."""

    key: str
    form: str
    column: Column

    def text(self, row: Row) -> str:
        value = row.get(self.key)
        return "-" if missing(value) else self.form.format(float(value))  # type: ignore[arg-type]


def _number(heading: str, key: str, form: str, rank: int = 0, name: str = "") -> _Number:
    return _Number(key=key, form=form, column=Column(heading=heading, rank=rank, name=name))


_PLACE = (
    _number("shift\nmm", "lateral_shift_mm", "{:+z.2f}"),
    _number("load\nkN", "load_kN", "{:g}"),
)
_NUMBERS = (
    *_PLACE,
    _number("p_max\nFE MPa", "p_max_fe_MPa", "{:.0f}", 5, "p_max in MPa"),
    _number("p_max\ndev %", "p_max_deviation_percent", "{:+z.1f}"),
    _number("\n± %", "p_max_uncertainty_percent", "{:.1f}", 3, "± of p_max"),
    _number("area\ndev %", "area_deviation_percent", "{:+z.1f}", 9, "area"),
    _number("a\ndev %", "a_deviation_percent", "{:+z.1f}", 4, "a"),
    _number("b\ndev %", "b_deviation_percent", "{:+z.1f}", 8, "b"),
    _number("centre\nin b", "centre_over_b", "{:+z.2f}", 7, "centre"),
    _number("valley\n%", "valley_percent", "{:z.1f}", 6, "valley"),
    _number("mispl.\n%", "misplaced_load_percent", "{:z.1f}", 10, "misplaced"),
)
_EFFORT = (
    _number("meshes", "meshes", "{:.0f}", 2, "meshes"),
    _number("time\ns", "seconds", "{:.0f}", 1, "time"),
)
_PEAKS = (
    _number("peak FE MPa", "p_max_fe_MPa", "{:.0f}"),
    _number("peak Hertz MPa", "p_max_hertz_MPa", "{:.0f}"),
    _number("part of a limit", "limit_used", "{:.2f}"),
)
_SHORT_STATUS = {
    "elements too soft or too stiff": "elements off",
    "patch at the edge of the fine mesh": "at edge",
    "not converged": "not conv.",
}


def deviation_table(rows: Sequence[Row], title: str, failing_width: int, *, with_pair: bool = False) -> Table:
    """How far Hertz is off in each case, and by what he fails, in so many characters."""
    theories = any(row.get("theory_cheapest") for row in rows)
    columns = [Column(heading="rail, wheel", kind="text")] * with_pair + [one.column for one in _NUMBERS]
    columns += columns_of("verdict", "fails by", texts=("verdict", "fails by"))
    columns += [Column(heading="cheapest\ntheory", kind="text", name="cheapest theory")] * theories
    lines = []
    for row in rows:
        used = usable(row)
        cells = [pair_of_row(row)] * with_pair + [one.text(row) for one in _NUMBERS]
        # what must not be used has no verdict
        cells += [str(row.get("verdict", "-")) if used else _short_status(row)]
        cells += [_failing(row, failing_width), *[str(row.get("theory_cheapest") or "-")] * theories]
        tone: Tone = "plain" if used else "fails"
        lines.append(TableRow(cells=[*cells, *(one.text(row) for one in _EFFORT)], tone=tone))
    return Table(title=title, columns=[*columns, *(one.column for one in _EFFORT)], rows=lines)


def _short_status(row: Row) -> str:
    status = str(row["status"])
    return _SHORT_STATUS.get(status, status) if has_numbers(row) else "no result"


def _failing(row: Row, width: int) -> str:
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
    several = len({pair_of_row(case.row) for case in cases}) > 1
    theories = any(case.row.get("theory_cheapest") for case in cases)
    forces = any(case.row.get("force_verdict") for case in cases)
    columns = columns_of("rail and wheel", texts=("rail and wheel",)) * several + [one.column for one in _PLACE]
    columns += columns_of("Hertz", "decided by", "because", texts=("decided by", "because"), answers=("Hertz",))
    columns += [one.column for one in _PEAKS]
    columns += [Column(heading="cheapest theory that holds", kind="text")] * theories
    columns += columns_of("for forces", "force off by, % of mu N", answers=("for forces",)) * forces
    lines = []
    for case in cases:
        row, answer = case.row, verdict_of(case.row)
        cells = [pair_of_row(row, " and ")] * several + [one.text(row) for one in _PLACE]
        cells += [answer, decided(row, case.limits), str(row.get("verdict_cause") or "")]
        cells += [one.text(row) for one in _PEAKS] + [cheapest_words(row)] * theories
        cells += _force_cells(row) if forces else ()
        lines.append(TableRow(cells=cells, tone="fails" if answer == "FAILS" else "plain"))
    return Table(title="", columns=columns, rows=lines)


def _force_cells(row: Row) -> tuple[str, str]:
    """What creep forces say of Hertz, and by how much they are off."""
    if not row.get("force_verdict"):
        return "failed", "-"
    off, unsure = (float(row[f"force_worst{name}_percent"]) for name in ("", "_uncertainty"))
    return str(row["force_verdict"]), f"{off:.1f} ± {unsure:.1f}"


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


def theories_table(record: Record) -> Table:
    """The verdict on every theory of the pressure, and why one has no contact."""
    columns = columns_of("theory", "p_max\ndev %", "area\ndev %", "part of\na limit", texts=("theory",))
    columns += [Column(heading="decided by", kind="text", wraps=True), Column(heading="verdict", kind="text")]
    lines = []
    for name, theory in record["theories"].items():
        words = THEORIES[name].words
        if "problem" in theory:
            lines.append(TableRow(cells=(words, "", "", "", theory["problem"], "none"), tone="dim"))
            continue
        verdict, off = theory["verdict"], theory["deviation"]
        cells = [words, *(f"{1e2 * off[measure]:+z.1f}" for measure in ("p_max_MPa", "area_mm2"))]
        cells += [f"{theory['limit_used']:.2f}", WORDS[verdict["measure"]].name, verdict["verdict"]]
        lines.append(TableRow(cells=cells, tone=_TONES[verdict["verdict"]]))
    return Table(title="Theories of the contact, the cheapest first", columns=columns, rows=lines)


def lobe_table(record: Record) -> Table:
    """The lobes of a contact, from the gauge side on."""
    lobes, pieces = record["lobes"], record["pieces"]
    counts = f"{len(lobes)} {'lobe' if len(lobes) == 1 else 'lobes'}, {pieces} {'patch' if pieces == 1 else 'patches'}"
    lines = [
        (str(number), f"{one['y_mm']:+z.1f}", f"{one['p_max_MPa']:.0f}", f"{1e2 * one['force_share']:.1f}")
        for number, one in enumerate(lobes, start=1)
    ]
    columns = columns_of("lobe", "place across\nmm", "peak\nMPa", "of the force\n%")
    return Table(title=counts, columns=columns, rows=[TableRow(cells=cells) for cells in lines])


def ladder_table(record: Record) -> Table:
    """The rungs from Hertz to the finite elements."""
    columns = columns_of("rung", "p_max\nMPa", "area\nmm²", "approach\nmm", texts=("rung",))
    lines = []
    for name, rung in record["rungs"].items():
        # the other rungs of the same nodes are no better known than what is judged
        unsure = record["elements_uncertainty"] if name == "elements" else {}
        cells = (
            number_text(rung[m]) + (f" ± {1e2 * unsure[m]:.1f} %" if m in unsure else "")
            for m in ("p_max_MPa", "area_mm2", "approach_mm")
        )
        lines.append((name.replace("_", " "), *cells))
    return Table(title="Ladder", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


def effort_table(solver: Record) -> Table:
    """Time and memory of each step of a case."""
    lines = [
        (step, f"{seconds:.2f}", f"{solver['memory_MB'][step]:.0f}") for step, seconds in solver["seconds"].items()
    ]
    lines.append(("all (memory: peak)", f"{sum(solver['seconds'].values()):.2f}", f"{solver['peak_memory_MB']:.0f}"))
    columns = columns_of("step", "time\ns", "memory after\nMB", texts=("step",))
    return Table(title="Time and memory", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


def solver_table(cases: Sequence[ReportedCase]) -> Table:
    """Meshes, residuals, time and memory of all cases."""
    texts = ("status", "solver")
    headings = (
        "status",
        "elements a semi-axis",
        "unknowns",
        "solver",
        "residual",
        "load balance",
        "seconds",
        "memory MB",
    )
    rows = []
    for case in cases:
        row, solver = case.row, case.record.get("solver", {})
        elements = ", ".join(f"{count:.1f}" for count in solver.get("elements_a_semi_axis", ()))
        cells = [*(one.text(row) for one in _PLACE), str(row["status"]), elements]
        cells += [_text(row, "degrees_of_freedom", "{:.0f}"), str(solver.get("path", "-"))]
        cells += [_text(solver, name, "{:.0e}") for name in ("contact_residual", "load_balance")]
        cells += [_text(row, name, "{:.0f}") for name in ("seconds", "peak_memory_MB")]
        rows.append(TableRow(cells=cells))
    return Table(title="", columns=[*(one.column for one in _PLACE), *columns_of(*headings, texts=texts)], rows=rows)


def _text(of: Record, key: str, form: str) -> str:
    return "-" if of.get(key) is None else form.format(float(of[key]))
