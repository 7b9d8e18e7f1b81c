"""`report.html` of a study: one file that says the question, the answer and everything behind it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.files import read_json, write_text
from fecontact.geometry.placement import Placement
from fecontact.outcome import usable
from fecontact.outputs.figures.report import ladder_figure
from fecontact.outputs.figures.section import pair_figure
from fecontact.outputs.figures.style import svg_of
from fecontact.outputs.paraview.scene import begin_scene
from fecontact.outputs.records.results import versions
from fecontact.outputs.records.theories import theory_text
from fecontact.outputs.reports.html import drawing, folded, heading, items, page, paragraph, picture, table, terms
from fecontact.outputs.reports.words import GLOSSARY, answer_words, lead_style, measure_terms, question
from fecontact.outputs.tables.cases import (
    ReportedCase,
    elements_table,
    ladder_table,
    lobe_table,
    measure_tables,
    plastic_tables,
    solver_table,
    theories_table,
    verdict_of,
    verdict_table,
)
from fecontact.outputs.words.measures import unknown_text
from fecontact.outputs.words.pairs import pair_of_row, position_text
from fecontact.outputs.words.roll import roll_words_of_rows
from fecontact.outputs.words.verdicts import decided, plastic_words, what_would_decide

Row = Mapping[str, Any]
_Row = TypeVar("_Row", bound=Row)

REPORT, PAIR = "report.html", "pair.png"
MOST_PICTURES = 40
"""More pictures make a page of tens of megabytes."""


@dataclass(frozen=True, kw_only=True)
class ShownPair:
    """The case whose pair is drawn: in section, and as `scene`; `no_scene` waits for it and says why there is none."""

    row: Row
    placement: Placement
    scene: Path
    no_scene: Callable[[], str | None]


def shown_pair(row: Row, placement: Placement, folder: Path, out: Path) -> ShownPair:
    """The pair of a case that lies in a folder; its picture in three dimensions is begun, and put into `out`."""
    scene = out / PAIR
    return ShownPair(row=row, placement=placement, scene=scene, no_scene=begin_scene(folder, scene))


def reported_case(row: Row, folder: Path) -> ReportedCase:
    """A case as it lies in its folder."""
    try:
        record = read_json(folder / "result.json")
    except InputError:
        record = None
    picture = folder / "case.png"
    return ReportedCase(
        row=row,
        record=record if isinstance(record, Mapping) else {},
        picture=picture if picture.is_file() else None,
    )


def most_used(rows: Iterable[_Row], count: int) -> list[_Row]:
    """So many of the rows, those that use most of a limit first."""
    return sorted(rows, key=lambda row: -float(row.get("limit_used") or 0.0))[:count]


def write_study_report(
    name: str,
    cases: Sequence[ReportedCase],
    out: Path,
    *,
    shown: ShownPair | None = None,
    criteria: Criteria | None = None,
    conclusion: str | None = None,
    pictures: str = "all are in cases/ID/case.png",
) -> Path:
    """Write `report.html` into the folder of a study, or of a single case.

    Parameters
    ----------
    shown
        The pair to draw, of the case that uses most of a limit.
    criteria
        Those by which all rows were judged, None if there is more than one set.
    conclusion
        What the study itself says.
    pictures
        Where the pictures are that the report leaves out.
    """
    rows = [case.row for case in cases]
    verdicts = [verdict_of(row) for row in rows]
    pairs = list(dict.fromkeys(pair_of_row(row, " and ") for row in rows))
    pair = "; ".join(pairs[:4]) + ("; ..." if len(pairs) > 4 else "")
    title = _title(name, rows)
    # pictures become smaller ones beside what is drawn
    with ThreadPoolExecutor() as beside:
        told = _begin_pictures(cases, beside)
        body = [
            heading(title, 1),
            paragraph(conclusion or _answer(cases), lead_style(verdicts)),
            paragraph(f"{name}: {_answer(cases)}." if conclusion or title != name else ""),
            paragraph(question(pair, criteria, roll_words_of_rows(rows))),
            heading("Verdicts"),
            table(verdict_table(cases)),
            picture(out / "study.svg", "Peak pressure, how far Hertz is off, and the touch point."),
            *_pair_drawn(shown, rows),
            _ladder(rows),
        ]
    body += [
        heading("Cases"),
        *_cases(cases, told, pictures),
        heading("Meshes and solver"),
        folded("Of each case", table(solver_table(cases))),
        *closing(),
    ]
    return write_text(out / REPORT, page(f"{title}: where Hertz holds", body))


def closing(*more: tuple[str, str]) -> list[str]:
    """What every report ends with: versions and terms, those of all and `more`."""
    packages = [f"{package} {version}" for package, version in versions().items() if version]
    told = terms((*GLOSSARY, *measure_terms(), *more))
    return [heading("What made it"), items(packages), heading("Terms"), told]


def _title(name: str, rows: Sequence[Row]) -> str:
    """The pair and its loads, or the name of a study of several pairs, and of a single case."""
    pairs = {pair_of_row(row, " and ") for row in rows}
    if len(rows) == 1 or len(pairs) != 1:
        return name
    loads = sorted({float(row["load_kN"]) for row in rows})
    (pair,) = pairs
    return (
        f"{pair[0].upper()}{pair[1:]}, {' to '.join(f'{load:g}' for load in dict.fromkeys((loads[0], loads[-1])))} kN"
    )


def _answer(cases: Sequence[ReportedCase]) -> str:
    if len(cases) != 1:
        return answer_words([verdict_of(case.row) for case in cases], "cases")
    (row,) = (case.row for case in cases)
    cause = f"; {row['verdict_cause']}" if row.get("verdict_cause") else ""
    return f"Hertz {verdict_of(row)}: {decided(row, cases[0].limits)}{cause}"


def _pair_drawn(shown: ShownPair | None, rows: Sequence[Row]) -> list[str]:
    """Both pictures of the pair, each with the words that say which case it is."""
    if shown is None:
        return []
    which = _which(shown.row, rows)
    section = drawing(svg_of(pair_figure(shown.placement)), f"Section through the first touch point {which}.")
    parts = [heading("The pair"), section]
    if (reason := shown.no_scene()) is not None:
        return [*parts, paragraph(f"There is no picture in three dimensions: {reason}.")]
    words = f"Pressure on the rail as a relief {which}; orange: the edge of Hertz's ellipse."
    return [*parts, picture(shown.scene, words, small=True)]


def _which(row: Row, rows: Sequence[Row]) -> str:
    """Which of the cases is drawn, and why that one."""
    at = f"at {position_text(row)}" + (
        f" of {pair_of_row(row, ' and ')}" if len({pair_of_row(one) for one in rows}) > 1 else ""
    )
    if sum(usable(one) for one in rows) < 2:
        return at
    used = row.get("limit_used")
    part = "" if used is None else f" ({float(used):.2f} times the limit)"
    return f"{at}, the case that uses most of a limit{part}"


def _open(case: ReportedCase) -> str:
    """What would decide a verdict that is open; nothing where it is decided."""
    if verdict_of(case.row) != "UNRESOLVED" or not case.record:
        return ""
    unknown = case.record["verdict"]["unknown"]
    return unknown_text(unknown) if unknown else what_would_decide(case.record)


def _ladder(rows: Sequence[Row]) -> str:
    # a single case is no line over the shift
    figure = ladder_figure(rows) if len(rows) > 1 else None
    words = "The ladder: by how much the shape of the gap, and then the finite bodies, change the peak pressure."
    return "" if figure is None else drawing(svg_of(figure), words)


def _begin_pictures(cases: Sequence[ReportedCase], beside: Executor) -> dict[str, Future[str]]:
    """The picture of each case, by its id; of many, of those that use most of a limit."""
    have = {str(case.row["id"]): case for case in cases if case.picture is not None}
    most = [str(row["id"]) for row in most_used((case.row for case in have.values()), MOST_PICTURES)]
    return {name: beside.submit(_case_picture, have[name]) for name in most}


def _case_picture(case: ReportedCase) -> str:
    words = f"{decided(case.row, {})}. Dashed: Hertz's ellipse; solid: the patch of the finite elements."
    return "" if case.picture is None else picture(case.picture, words)


def _cases(cases: Sequence[ReportedCase], drawn: Mapping[str, Future[str]], pictures: str) -> list[str]:
    """Picture and all measures of the cases that are drawn, and where those of the others are."""
    solved = sum(usable(case.row) for case in cases)
    parts = []
    if len(drawn) < max(solved, sum(case.picture is not None for case in cases)):
        parts.append(paragraph(f"{len(drawn)} of {len(cases)} cases, those that use most of a limit; {pictures}."))
    for case in cases:
        row = case.row
        if str(row["id"]) not in drawn:
            continue
        parts += [
            heading(f"{pair_of_row(row, ' and ')}, {position_text(row)}: {verdict_of(row)}", 3),
            drawn[str(row["id"])].result(),
            folded("All measures", _measures(case.record)),
        ]
        said = (
            _open(case),
            plastic_words(case.record),
            theory_text(row),
            *(str(row.get(key) or "") for key in ("verdict_warnings", "warnings")),
        )
        parts.append(items([one for one in said if one]))
    return parts


def _measures(record: Mapping[str, Any]) -> str:
    tables = measure_tables(record)
    tables += (
        [theories_table(record), lobe_table(record), elements_table(record), ladder_table(record)] if tables else []
    )
    tables += plastic_tables(record) if tables else []
    return "".join(map(table, tables))
