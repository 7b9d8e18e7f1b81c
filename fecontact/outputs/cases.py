"""Tables of cases for the terminal and reports: verdicts, measures, lobes, ladder and effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.criteria import Criteria
from fecontact.errors import is_usable_status, short_status
from fecontact.feature_registry import load_offers
from fecontact.judging.ladder import PLASTIC_STEP
from fecontact.judging.measures import is_relative
from fecontact.outputs.flat_records import flatten
from fecontact.outputs.pair_names import VARIED_COLUMN, row_pair_text
from fecontact.outputs.parts import Picture
from fecontact.outputs.tables import (
    Column,
    Table,
    TableRecord,
    TableRow,
    Tone,
    make_columns,
    make_table,
    number_column,
    number_text,
    text_column,
)
from fecontact.outputs.theory_records import judged_theories
from fecontact.outputs.verdict_words import cheapest_words, deciding_measure_text, theory_words, utilisation_text
from fecontact.outputs.words import MEASURE_WORDS, deviation_columns
from fecontact.own_criterion import OWN_PREFIX

# --- Tables about theories of the pressure, for the terminal and reports.


def cheapest_column(heading: str, column: str, *, name: str = "") -> Column:
    """Column of the cheapest theory that holds, in words.

    Parameters
    ----------
    heading
        Heading of the column.
    column
        Column of the theory's name in a row.
    name
        Name of the column, see `Column`.

    Returns
    -------
    Column
        The words include whether the theory is out of its range.
    """
    return text_column(
        heading, lambda row: theory_words(row.get(column), row.get(f"{column}_status")), none="-", name=name, wraps=True
    )


# --- Tables of several cases (verdicts), and tables of a case (measures, lobes, ladder and effort).

_TONES: Mapping[str, Tone] = {"HOLDS": "plain", "UNRESOLVED": "open", "FAILS": "fails"}


@dataclass(frozen=True, kw_only=True)
class ReportedCase:
    """Case of a report.

    Attributes
    ----------
    row
        Line of the case in the table of the study.
    record
        Content of `result.json`; empty without such a file.
    picture
        File of the picture; None without a picture.
    relief
        Pressure as a relief that turns; None if it is not drawn.
    """

    row: TableRecord
    record: TableRecord = field(default_factory=dict)
    picture: Path | None = None
    relief: Picture | None = None

    @property
    def limits(self) -> Mapping[str, float]:
        """Limits of the criteria by measure; empty without a record."""
        limits_by_measure: Mapping[str, float] = self.record.get("verdict", {}).get("limits", {})
        return limits_by_measure


NO_VERDICT = "failed"
"""Replaces the verdict of a result that must not be used."""


def verdict_of(row: TableRecord) -> str:
    """Verdict of a row, or `failed` for an unusable result.

    A verdict FAILS that is certain by the half-space alone stays, even if the result must not be used.
    """
    return str(row.get("verdict_answer", NO_VERDICT)) if _has_verdict(row) else NO_VERDICT


def _has_verdict(row: TableRecord) -> bool:
    return is_usable_status(row) or row.get("verdict_answer") == "FAILS"


_PLACE_COLUMNS = (number_column("shift\nmm", "lateral_shift_mm", "{:+z.2f}"), number_column("load\nkN", "load_kN"))
_DISTANCE_COLUMN = number_column("distance\nmm", "distance_mm")


def _deviation_column(measure: str, limit: float) -> Column:
    """Column of the deviation of Hertz in a deciding measure.

    A limit below 1 gets a further decimal.
    """
    words, (column, _, _) = MEASURE_WORDS[measure], deviation_columns(measure)
    form = "{:+.3g}" if words.has_any_size else f"{{:{'+' * words.signed}z.{1 + (words.factor * limit < 1.0)}f}}"
    unit = f"in {words.off_unit}" if words.off_unit != "%" else "dev %" if is_relative(measure) else "%"
    short = words.short if len(words.short) < 8 else f"{words.short[:5]}."
    return number_column(f"{short}\n{unit}", column, form, rank=words.rank, name=words.short * bool(words.rank))


_UNCERTAINTY_RANK = 3
_P_MAX, *_OTHER_DEVIATIONS = (_deviation_column(measure, limit) for measure, limit in Criteria().limits.items())
_DEVIATION_COLUMNS = (
    number_column("p_max\nFE MPa", "fe_p_max_MPa", "{:.0f}", rank=5, name="p_max in MPa"),
    _P_MAX,
    number_column("\n± %", "hertz_uncertainty_p_max_percent", "{:.1f}", rank=_UNCERTAINTY_RANK, name="± of p_max"),
    *_OTHER_DEVIATIONS,
)
_EFFORT_COLUMNS = (
    number_column("meshes", "solver_meshes", "{:.0f}", rank=2, name="meshes"),
    number_column("time\ns", "seconds", "{:.0f}", rank=1, name="time"),
)
_PEAKS = (
    number_column("peak FE MPa", "fe_p_max_MPa", "{:.0f}"),
    number_column("peak Hertz MPa", "hertz_p_max_MPa", "{:.0f}"),
    text_column("limit utilisation", lambda row: utilisation_text(row.get("verdict_limit_utilisation")), "number"),
)


def deviation_table(rows: Sequence[TableRecord], title: str, failing_width: int, *, with_pair: bool = False) -> Table:
    """Table of the deviations of Hertz in each case, with the failing measures.

    Parameters
    ----------
    rows
        Rows of cases.
    title
        Title of the table.
    failing_width
        Characters for the names of the failing measures.
    with_pair
        Whether the first column has rail and wheel.

    Returns
    -------
    Table
        The table.
    """
    has_theories = any(row.get("cheapest_theory") for row in rows)
    columns = [
        *[text_column("rail, wheel", row_pair_text)] * with_pair,
        *_place_columns(rows),
        *_DEVIATION_COLUMNS,
        *_own_columns(rows),
        # a result that must not be used has no verdict
        text_column("verdict", lambda row: row.get("verdict_answer", "-") if _has_verdict(row) else short_status(row)),
        text_column("fails by", lambda row: _failing_measures_text(row, failing_width)),
        *[text_column("elastic\nbodies", "elastic_verdict_answer")]
        * any("elastic_verdict_answer" in row for row in rows),
        *[cheapest_column("cheapest\ntheory", "cheapest_theory", name="cheapest theory")] * has_theories,
        *_EFFORT_COLUMNS,
    ]
    return make_table(title, columns, rows, lambda row: "plain" if is_usable_status(row) else "fails")


def _own_columns(rows: Sequence[TableRecord]) -> list[Column]:
    """Columns of the deviations of Hertz in a user's measures, with uncertainties."""
    prefix = deviation_columns(OWN_PREFIX)[0].removesuffix("_percent")
    columns = dict.fromkeys(name for row in rows for name in row if name.startswith(prefix))
    measures = (f"{OWN_PREFIX}{name.removeprefix(prefix).removesuffix('_percent')}" for name in columns)
    return [column for measure in measures for column in _own_measure_columns(measure)]


def _own_measure_columns(measure: str) -> tuple[Column, Column]:
    """Columns of the deviation of Hertz in a user's measure, and of its uncertainty."""
    words, (deviation, uncertainty, _) = MEASURE_WORDS[measure], deviation_columns(measure)
    unit = f"dev {words.off_unit}".rstrip()
    sign_form, form = ("{:+.3g}", "{:.3g}") if words.has_any_size else ("{:+z.1f}", "{:.1f}")
    return (
        number_column(f"{words.short}\n{unit}", deviation, sign_form),
        number_column(
            f"\n± {words.off_unit}".rstrip(), uncertainty, form, rank=_UNCERTAINTY_RANK, name=f"± of {words.short}"
        ),
    )


def _place_columns(rows: Sequence[TableRecord]) -> list[Column]:
    """Columns of shift and load, of the distance along an irregularity, and of varied inputs."""
    has_distance = any(row.get("distance_mm") is not None for row in rows)
    return [
        *_PLACE_COLUMNS,
        *[_DISTANCE_COLUMN] * has_distance,
        *[text_column(VARIED_COLUMN, VARIED_COLUMN, wraps=True)] * any(row.get(VARIED_COLUMN) for row in rows),
    ]


def _failing_measures_text(row: TableRecord, width: int) -> str:
    """Short names of the failing measures, the deciding measure first.

    Measures without room are counted. If no measure fails, the text is the least certain measure of an open verdict.
    """
    measures, deciding_measure = (
        filter(None, str(row.get("verdict_failing") or "").split("; ")),
        row.get("verdict_measure"),
    )
    names = [
        MEASURE_WORDS[measure].short for measure in sorted(measures, key=lambda measure: measure != deciding_measure)
    ]
    if not names and deciding_measure and row.get("verdict_answer") == "UNRESOLVED":
        names = [f"open: {MEASURE_WORDS[deciding_measure].short}"]
    for shown_count in range(len(names), 0, -1):
        hidden_parts = [f"+{len(names) - shown_count}"] if shown_count < len(names) else []
        text = " ".join((*names[:shown_count], *hidden_parts))
        if len(text) <= width:
            return text
    return ""


def verdict_table(cases: Sequence[ReportedCase]) -> Table:
    """Table of cases with verdict, deciding measure and cause, and the columns of features.

    Parameters
    ----------
    cases
        Cases of a report.

    Returns
    -------
    Table
        The table.
    """
    rows = [{**case.row, "limits": case.limits} for case in cases]
    has_several_pairs = len({row_pair_text(row) for row in rows}) > 1
    has_theories = any(row.get("cheapest_theory") for row in rows)
    columns = [
        *[text_column("rail and wheel", lambda row: row_pair_text(row, " and "))] * has_several_pairs,
        *_place_columns(rows),
        text_column("Hertz", verdict_of, "answer"),
        *[text_column("Hertz against elastic bodies", "elastic_verdict_answer", "answer")]
        * any("elastic_verdict_answer" in row for row in rows),
        text_column("deciding measure", lambda row: deciding_measure_text(row, row["limits"])),
        text_column("cause", "verdict_cause"),
        *_PEAKS,
        *[text_column("cheapest theory that holds", cheapest_words)] * has_theories,
        *(
            column
            for name, telling in load_offers("TELLINGS").items()
            if any(key.startswith(f"{name}_") for row in rows for key in row)
            for column in telling.columns
        ),
    ]
    return make_table("", columns, rows, lambda row: "fails" if verdict_of(row) == "FAILS" else "plain")


def elements_table(record: TableRecord) -> Table:
    """Table of Hertz's measures against the contact on the elements' nodes alone.

    These are the elements' own, coarser nodes.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    Table
        Values on both sets of nodes, deviation, uncertainty, limit and answer by measure.
    """
    contact, fe, limits = record["elements"], record["fe"], record["verdict"]["limits"]
    hertz = contact[HERTZ]
    lines = []
    for measure in limits:
        words, answer = MEASURE_WORDS[measure], hertz["verdict"]["each"][measure]
        values = (number_text(contact[measure]), number_text(fe[measure])) if measure in contact else ("", "")
        deviation, uncertainty = (hertz[quantity].get(measure) for quantity in ("deviation", "uncertainty"))
        cells = [
            words.title,
            *values,
            words.deviation_text(deviation),
            words.deviation_text(uncertainty, size=True),
            words.limit_text(limits[measure]),
        ]
        lines.append(TableRow(cells=[*cells, answer], tone=_TONES[answer]))
    columns = make_columns(
        "FE\nelement nodes", "FE\nfiner nodes", "deviation\nelement nodes", "±", "limit", "answer", texts=("answer",)
    )
    title = f"On the nodes of the elements: Hertz {hertz['verdict']['answer']} (verdict: {record['verdict']['answer']})"
    return Table(title=title, columns=[Column(heading="measure", kind="text", wraps=True), *columns], rows=lines)


def measures_table(
    record: TableRecord, judgement: TableRecord, title: str = "", name: str = "Hertz", *, judged_only: bool = False
) -> Table:
    """Table of the measures of finite elements and of a theory, deciding measures first.

    Parameters
    ----------
    record
        Record of a load.
    judgement
        Record of the judged theory.
    title
        Title of the table.
    name
        Heading of the column of the theory.
    judged_only
        Whether only deciding measures are shown.

    Returns
    -------
    Table
        The table.
    """
    limits, answers = record["verdict"]["limits"], judgement["verdict"]["each"]
    stored_measures = {criterion["measure"] for criterion in record["own_criteria"] if criterion.get("stored")}
    other_measures = () if judged_only else (measure for measure in MEASURE_WORDS if measure not in limits)
    lines = []
    for measure in (*limits, *other_measures):
        words, deviation = MEASURE_WORDS[measure], judgement["deviation"].get(measure)
        # some measures are zero for an ellipse
        values = (words.deviation_text(deviation).removesuffix(words.off_unit).strip(), "0")
        if measure in judgement:
            values = (number_text(record["fe"][measure]), number_text(judgement[measure]))
        cells = [
            words.title + ", stored" * (measure in stored_measures),
            *values,
            words.deviation_text(deviation),
            words.deviation_text(judgement["uncertainty"].get(measure), size=True),
        ]
        cells += [words.limit_text(limits[measure]) if measure in limits else "", answers.get(measure, "not judged")]
        lines.append(TableRow(cells=cells, tone=_TONES.get(answers.get(measure, ""), "dim")))
    columns = make_columns("FE", name, "deviation", "±", "limit", "answer", texts=("answer",))
    # without room the names take two lines
    return Table(title=title, columns=[Column(heading="measure", kind="text", wraps=True), *columns], rows=lines)


_THEORY_COLUMNS = (
    text_column("theory", lambda theory: THEORIES[theory["name"]].words),
    number_column("p_max\ndev %", lambda theory: theory["deviation"].get("p_max_MPa"), "{:+z.1f}", 1e2, none=""),
    number_column("area\ndev %", lambda theory: theory["deviation"].get("area_mm2"), "{:+z.1f}", 1e2, none=""),
    text_column(
        "limit\nutilisation",
        lambda theory: "" if theory.get("problem") else utilisation_text(theory["limit_utilisation"]),
        "number",
    ),
    text_column(
        "deciding measure",
        lambda theory: theory.get("problem") or MEASURE_WORDS[theory["verdict"]["measure"]].name,
        wraps=True,
    ),
    text_column("verdict", lambda theory: theory_words(theory["verdict"]["answer"], theory.get("status")), wraps=True),
)


def theories_table(record: TableRecord) -> Table:
    """Table of the verdicts on all theories of the pressure, with reasons for missing contacts.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    Table
        Deviations, limit utilisation, deciding measure and verdict of each theory, the cheapest first.
    """
    no_contact = {"deviation": {}, "verdict": {"answer": "none"}}
    theories = [
        {**theory, "name": name}
        if theory["problem"] is None
        else {**no_contact, "problem": theory["problem"], "name": name}
        for name, theory in record["theories"].items()
        if theory is not None
    ]
    title = "Theories of the contact, the cheapest first"
    return make_table(title, _THEORY_COLUMNS, theories, lambda theory: _TONES.get(theory["verdict"]["answer"], "dim"))


_PEAK_COLUMNS = (
    number_column("peak", "number", "{:.0f}"),
    number_column("s\nmm", "y_mm", "{:+z.1f}"),
    number_column("peak\nMPa", "p_max_MPa", "{:.0f}"),
    number_column("force\n% of load", "force_share", "{:.1f}", 1e2),
)
_LOBE_COLUMNS = (
    text_column("kind", lambda lobe: "patch" if lobe["separate"] else "lobe"),
    number_column("centre\nrail y mm", "rail_y_mm", "{:+z.1f}"),
    number_column("force\nkN", "normal_force_N", "{:.2f}", 1e-3),
    number_column("\n± %", lambda lobe: lobe["fe_uncertainty"]["normal_force_N"], "{:.1f}", 1e2, name="± of force"),
    number_column("p_max\nFE MPa", lambda lobe: lobe["fe"]["p_max_MPa"], "{:.0f}"),
    number_column("\n± %", lambda lobe: lobe["fe_uncertainty"]["p_max_MPa"], "{:.1f}", 1e2, name="± of p_max"),
    number_column("p_max\ndev %", lambda lobe: lobe["deviation"].get("p_max_MPa"), "{:+z.1f}", 1e2),
    number_column("area\ndev %", lambda lobe: lobe["deviation"].get("area_mm2"), "{:+z.1f}", 1e2),
    text_column(
        "deciding\nmeasure",
        lambda lobe: MEASURE_WORDS[lobe["verdict"]["measure"]].short if lobe["verdict"] else "no ellipse",
    ),
    text_column("Hertz", lambda lobe: lobe["verdict"]["answer"] if lobe["verdict"] else "none", "answer"),
)


def lobes_table(record: TableRecord) -> Table:
    """Table of all separate patches and lobes, each compared with Hertz's ellipse under its force."""
    return make_table("", _LOBE_COLUMNS, record["lobes"])


def peaks_table(record: TableRecord) -> Table:
    """Table of the peaks of a contact, the highest first.

    Parameters
    ----------
    record
        Record of a result.

    Returns
    -------
    Table
        Table with a row for each peak.
    """
    peaks, patches = record["fe"]["lobes"], record["fe"]["patch_count"]
    counts = (
        f"{len(peaks)} {'lobe' if len(peaks) == 1 else 'lobes'}, {patches} {'patch' if patches == 1 else 'patches'}"
    )
    return make_table(counts, _PEAK_COLUMNS, [{**peak, "number": place} for place, peak in enumerate(peaks, start=1)])


def ladder_table(record: TableRecord) -> Table:
    """Table of the rungs from Hertz to the finite elements.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    Table
        Peak pressure, area and approach of each rung, with uncertainties.
    """
    columns = make_columns("rung", "p_max\nMPa", "area\nmm²", "approach\nmm", texts=("rung",))
    lines = []
    rungs = {**record["theories"], **record, "fe_plastic": record["plastic"]}
    rungs["half_space"] = record["half_space"] or record["theories"]["half_space"]
    for name in ("hertz", "half_space_quadratic", "half_space", "elements", "fe", "fe_plastic"):
        if (rung := rungs[name]) is None:
            continue
        # the uncertainty of other rungs on these nodes is not smaller than the uncertainty of the judged rung
        uncertainty = record["elements"]["uncertainty"] if name == "elements" else {}
        if name == "fe_plastic":
            uncertainty = record["steps_uncertainty"][PLASTIC_STEP.name]
        cells = (
            number_text(rung[measure]) + (f" ± {1e2 * uncertainty[measure]:.1f} %" if measure in uncertainty else "")
            for measure in ("p_max_MPa", "area_mm2", "approach_mm")
        )
        lines.append((name.replace("_", " "), *cells))
    return Table(title="Ladder", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


_YIELDING_COLUMNS = (
    text_column("body", "name"),
    number_column("yield stress\nMPa", "yield_MPa"),
    number_column("tangent\nMPa", "tangent_MPa"),
    number_column("first yield\nkN", "first_yield_N", "{:.1f}", 1e-3),
    number_column("plastic strain\n%", "largest_strain", "{:.2f}", 1e2),
    number_column("depth\nmm", "depth_mm", "{:.1f}"),
    text_column("zone\nmm", lambda body: _zone_text(body) if body["largest_strain"] else "-", "number"),
)


def _zone_text(body: TableRecord) -> str:
    return f"{body['top_mm']:.1f} to {body['bottom_mm']:.1f}"


def plastic_tables(record: TableRecord) -> list[Table]:
    """Tables of the effects of yielding on a contact, and of the yielding bodies.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    list of Table
        Empty without a yield stress.
    """
    plastic = record["plastic"]
    if plastic is None:
        return []
    steps, uncertainty = (record[group][PLASTIC_STEP.name] for group in ("steps", "steps_uncertainty"))
    lower, higher = (plastic[f"step_with_yield_stress_15_percent_{band_side}"] for band_side in ("lower", "higher"))
    columns = [
        text_column("measure", lambda measure: MEASURE_WORDS[measure].name, wraps=True),
        text_column("by plasticity", lambda measure: MEASURE_WORDS[measure].deviation_text(steps[measure]), "number"),
        text_column(
            "±", lambda measure: MEASURE_WORDS[measure].deviation_text(uncertainty[measure], size=True), "number"
        ),
        text_column(
            "yield stress\n-15 %", lambda measure: MEASURE_WORDS[measure].deviation_text(lower[measure]), "number"
        ),
        text_column("+15 %", lambda measure: MEASURE_WORDS[measure].deviation_text(higher[measure]), "number"),
    ]
    change_tables = [make_table(f"Changes by yielding ({plastic['range']})", columns, lower)] if lower else []
    bodies = ({**body, "name": name} for name, body in plastic["bodies"].items())
    return [*change_tables, make_table("Bodies that yield", _YIELDING_COLUMNS, bodies)]


_NUMBER_COLUMNS = (
    text_column("number", lambda path_and_number: path_and_number[0]),
    number_column("value", lambda path_and_number: path_and_number[1], "{:.6g}"),
)


def numbers_table(record: TableRecord) -> Table:
    """Table of all numbers of a record by their paths.

    The columns of tables have these paths as names.

    Parameters
    ----------
    record
        Record of a result.

    Returns
    -------
    Table
        Table with a row for each number, without the inputs of the case and the versions.
    """
    entries = {name: value for name, value in record.items() if name not in ("case", "theories", "versions")}
    numbers = flatten({**entries, **judged_theories(record)}).items()
    return make_table(
        "",
        _NUMBER_COLUMNS,
        (path_and_number for path_and_number in numbers if isinstance(path_and_number[1], int | float)),
    )


def effort_table(solver: TableRecord) -> Table:
    """Table of time (s) and memory (MB) of each step of a case.

    Parameters
    ----------
    solver
        Record of the solver.

    Returns
    -------
    Table
        The table.
    """
    lines = [
        (step, f"{seconds:.2f}", f"{solver['memory_MB'][step]:.0f}") for step, seconds in solver["seconds"].items()
    ]
    lines.append(("all (memory: peak)", f"{sum(solver['seconds'].values()):.2f}", f"{solver['peak_memory_MB']:.0f}"))
    columns = make_columns("step", "time\ns", "memory after\nMB", texts=("step",))
    return Table(title="Time and memory", columns=columns, rows=[TableRow(cells=cells) for cells in lines])


_RESIDUALS = ("contact_residual", "load_balance", "force_balance", "moment_balance")
_SOLVER_COLUMNS = (
    *_PLACE_COLUMNS,
    text_column("status", "status"),
    text_column("elements per semi-axis", lambda row: ", ".join(f"{count:.1f}" for count in row["elements"]), "number"),
    number_column("unknowns", "unknowns", "{:.0f}"),
    text_column("solver", lambda row: row["path"]),
    number_column("residual", "contact_residual", "{:.0e}"),
    number_column("load balance", "load_balance", "{:.0e}"),
    number_column("force balance", "force_balance", "{:.0e}"),
    number_column("moment balance", "moment_balance", "{:.0e}"),
    number_column("seconds", "seconds", "{:.0f}"),
    number_column("memory MB", "peak_memory_MB", "{:.0f}"),
)


def solver_table(cases: Sequence[ReportedCase]) -> Table:
    """Table of meshes, residuals, time and memory of all cases.

    Parameters
    ----------
    cases
        Cases of a report.

    Returns
    -------
    Table
        The table.
    """
    rows = []
    for case in cases:
        solver = case.record.get("solver", {})
        residuals = {name: solver.get(name) for name in _RESIDUALS}
        elements, path = solver.get("elements_per_semi_axis", ()), solver.get("path", "-")
        unknowns = sum(solver["degrees_of_freedom"].values()) if solver else None
        rows.append({**case.row, **residuals, "elements": elements, "path": path, "unknowns": unknowns})
    return make_table("", _SOLVER_COLUMNS, rows)
