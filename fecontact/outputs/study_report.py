"""`report.html` of a study: one file that says the question, the answer and everything behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.files import read_json, write_text
from fecontact.geometry.placement import Placement
from fecontact.outputs.html import folded, heading, items, page, paragraph, picture, table, terms
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.multi_hertz import springs_text
from fecontact.outputs.record import versions
from fecontact.outputs.report_figures import ladder_figure, pair_figure
from fecontact.outputs.report_words import GLOSSARY, answer_words, lead_style, measure_terms, question
from fecontact.outputs.roll_words import roll_words_of_rows
from fecontact.outputs.rows import deviation_column
from fecontact.outputs.series import short_name
from fecontact.outputs.verdict_words import inclination_words

Row = Mapping[str, Any]

REPORT = "report.html"
# More pictures make a page of tens of megabytes.
_MOST_PICTURES = 40
_NUMBERS = (
    *("shift mm", "load kN", "peak FE MPa", "peak Hertz MPa", "part of a limit"),
    *("elements a semi-axis", "unknowns", "residual", "load balance", "seconds", "memory MB"),
    *("FE", "Hertz", "springs", "off by", "±", "limit"),
)
_SOLVER = (
    *("shift mm", "load kN", "status", "elements a semi-axis", "unknowns", "solver", "residual"),
    *("load balance", "seconds", "memory MB"),
)


def write_study_report(
    name: str,
    rows: Sequence[Row],
    out: Path,
    *,
    placement: Placement | None = None,
    criteria: Criteria | None = None,
    conclusion: str | None = None,
    no_scene: str | None = None,
) -> Path:
    """Write `report.html` beside the tables of a study, whose cases are in `cases` below `out`.

    Parameters
    ----------
    placement
        A pair to draw.
    criteria
        Those by which all rows were judged, None if there is more than one set.
    conclusion
        What the study itself says.
    no_scene
        Why there is no `pair.png`, the pair in three dimensions.
    """
    verdicts = [_verdict(row) for row in rows]
    pairs = list(dict.fromkeys(_pair(row) for row in rows))
    pair = "; ".join(pairs[:4]) + ("; ..." if len(pairs) > 4 else "")
    records = {str(row["id"]): _record(out / "cases" / str(row["id"])) for row in rows}
    with TemporaryDirectory() as folder:
        drawn = Path(folder)
        body = [
            heading(name, 1),
            paragraph(answer_words(verdicts, "cases"), lead_style(verdicts)),
            paragraph(question(pair, criteria, roll_words_of_rows(rows))),
            paragraph(conclusion or ""),
            heading("The pair") if placement is not None or (out / "pair.png").is_file() else "",
            _pair_drawn(placement, drawn),
            picture(out / "pair.png", "Pressure on the rail as a relief, and the edge of Hertz's ellipse (orange)."),
            paragraph(f"There is no picture in three dimensions: {no_scene}." if no_scene else ""),
            heading("Verdicts"),
            _verdict_table(rows, records),
            picture(
                out / "study.svg", "Peak pressure, how far Hertz is off in parts of each limit, and the touch point."
            ),
            _ladder(rows, drawn),
        ]
    body += [
        heading("Cases"),
        *_cases(rows, records, out),
        heading("Meshes and solver"),
        _solver_table(rows, records),
        heading("What made it"),
        items([f"{package} {version}" for package, version in versions().items() if version]),
        heading("Terms"),
        terms((*GLOSSARY, *measure_terms())),
    ]
    return write_text(out / REPORT, page(f"{name}: where Hertz holds", body))


def _pair_drawn(placement: Placement | None, folder: Path) -> str:
    if placement is None:
        return ""
    path = pair_figure(placement, folder / "pair.png")
    return picture(path.with_suffix(".svg"), "Section through the first touch point.")


def _ladder(rows: Sequence[Row], folder: Path) -> str:
    path = ladder_figure(rows, folder / "ladder.png")
    words = "The ladder: by how much the shape of the gap, and then the finite bodies, change the peak pressure."
    return "" if path is None else picture(path.with_suffix(".svg"), words)


def _verdict(row: Row) -> str:
    return str(row.get("verdict", "failed")) if row["status"] == "converged" else "failed"


def _pair(row: Row) -> str:
    rail, wheel = short_name(str(row["rail"])), short_name(str(row["wheel"]))
    return f"rail {rail}{inclination_words(float(row.get('inclination_rad') or 0.0))} and wheel {wheel}"


def _record(folder: Path) -> Mapping[str, Any]:
    """What a case's result says, empty where it has none."""
    try:
        record = read_json(folder / "result.json")
    except InputError:
        return {}
    return record if isinstance(record, Mapping) else {}


def _verdict_table(rows: Sequence[Row], records: Mapping[str, Mapping[str, Any]]) -> str:
    several = len({_pair(row) for row in rows}) > 1
    springs = any(row.get("multi_hertz_verdict") for row in rows)
    headings = ("rail and wheel",) * several + (
        *("shift mm", "load kN", "Hertz", "decided by", "because", "peak FE MPa", "peak Hertz MPa", "part of a limit"),
        *("as springs",) * springs,
    )
    lines = []
    for row in rows:
        cells = [_pair(row)] if several else []
        cells += [f"{row['lateral_shift_mm']:+z.2f}", f"{row['load_kN']:g}", _verdict(row)]
        limits = records[str(row["id"])].get("verdict", {}).get("limits", {})
        cells += [_decided(row, limits), str(row.get("verdict_cause") or "")]
        cells += [_number(row.get(key), form) for key, form in _PEAKS]
        cells += [str(row.get("multi_hertz_verdict") or "-")] * springs
        lines.append((cells, _verdict(row) == "FAILS"))
    return table("", headings, lines, numbers=_NUMBERS, answers=("Hertz", "as springs"))


_PEAKS = (("p_max_fe_MPa", "{:.0f}"), ("p_max_hertz_MPa", "{:.0f}"), ("limit_used", "{:.2f}"))


def _decided(row: Row, limits: Mapping[str, float]) -> str:
    """The measure that decided, how far Hertz is off in it, and its limit; the status of what must not be used."""
    if row["status"] != "converged":
        return str(row["status"])
    measure = row.get("verdict_measure")
    if measure not in WORDS:
        return ""
    words = WORDS[measure]
    column, unsure, factor = deviation_column(measure)
    values = (None if row.get(name) is None else float(row[name]) / factor for name in (column, unsure))
    off, error = (words.off(value, size=bool(number)) for number, value in enumerate(values))
    limit = f" (limit {words.limit(limits[measure])})" if measure in limits else ""
    return f"{words.name} {off} ± {error}{limit}"


def _number(value: Any, form: str) -> str:
    return "-" if value is None else form.format(float(value))


def _cases(rows: Sequence[Row], records: Mapping[str, Mapping[str, Any]], out: Path) -> list[str]:
    """A picture and all measures of each case; of many, of those that use most of a limit."""
    have = [row for row in rows if (out / "cases" / str(row["id"]) / "case.png").is_file()]
    used = sorted(have, key=lambda row: -float(row.get("limit_used") or 0.0))[:_MOST_PICTURES]
    shown = {str(row["id"]) for row in used}
    parts = []
    if len(have) > len(shown):
        words = f"{len(shown)} of {len(have)} cases, those that use most of a limit; all are in cases/ID/case.png."
        parts.append(paragraph(words))
    for row in have:
        if str(row["id"]) not in shown:
            continue
        where = f"{_pair(row)}, {row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN"
        path = out / "cases" / str(row["id"]) / "case.png"
        parts += [
            heading(f"{where}: {_verdict(row)}", 3),
            picture(path, f"{_decided(row, {})}. Dashed: Hertz's ellipse; solid: the patch of the finite elements."),
            folded("All measures", _measures(records[str(row["id"])])),
        ]
        said = (springs_text(row), *(str(row.get(key) or "") for key in ("verdict_warnings", "warnings")))
        parts.append(items([one for one in said if one]))
    return parts


def _measures(record: Mapping[str, Any]) -> str:
    parts = []
    for side in record.get("verdict", {}).get("sides", ()):
        by = "" if side["side"] == "both" else f"With the curvature of the {side['side']} side"
        parts.append(_measure_table(record, by, "Hertz", side["hertz"], side))
    theory = record.get("theories", {}).get("multi_hertz", {})
    if len(theory.get("patches", ())) > 1:
        by = f"Hertz at {len(theory['patches'])} touch points, which share the load as springs"
        parts.append(_measure_table(record, by, "springs", theory, {**theory, "each": theory["verdict"]["each"]}))
    return "".join(parts)


def _measure_table(
    record: Mapping[str, Any], by: str, name: str, sizes: Mapping[str, Any], judged: Mapping[str, Any]
) -> str:
    """All measures of the finite elements beside the sizes of a theory, and how it is judged."""
    limits = record["verdict"]["limits"]
    lines = []
    for measure, words in WORDS.items():
        off, unsure, limit = judged["deviation"].get(measure), judged["uncertainty"].get(measure), limits.get(measure)
        both = [f"{of[measure]:.5g}" if measure in of else "" for of in (record["fe"], sizes)]
        cells = [words.title, *both, words.off(off), words.off(unsure, size=True)]
        cells += ["" if limit is None else words.limit(limit), judged["each"].get(measure, "not judged")]
        lines.append((cells, judged["each"].get(measure) == "FAILS"))
    return table(by, ("measure", "FE", name, "off by", "±", "limit", "answer"), lines, numbers=_NUMBERS)


def _solver_table(rows: Sequence[Row], records: Mapping[str, Mapping[str, Any]]) -> str:
    lines = []
    for row in rows:
        solver = records[str(row["id"])].get("solver", {})
        elements = [f"{count:.1f}" for count in solver.get("elements_a_semi_axis", ())]
        cells = [f"{row['lateral_shift_mm']:+z.2f}", f"{row['load_kN']:g}", str(row["status"]), ", ".join(elements)]
        cells += [_number(row.get("degrees_of_freedom"), "{:.0f}"), str(solver.get("path", "-"))]
        cells += [_number(solver.get(name), "{:.0e}") for name in ("contact_residual", "load_balance")]
        cells += [_number(row.get("seconds"), "{:.0f}"), _number(row.get("peak_memory_MB"), "{:.0f}")]
        lines.append((cells, False))
    return table("", _SOLVER, lines, numbers=_NUMBERS)
