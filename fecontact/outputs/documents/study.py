"""A study in parts: a line a case for the terminal, and `report.html` with question, answer and all behind it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.files import read_json, write_text
from fecontact.geometry.placement import Placement
from fecontact.outcome import usable
from fecontact.outputs.documents.case import case_parts
from fecontact.outputs.documents.parts import Details, Heading, Items, Lead, Part, Picture, Terms
from fecontact.outputs.documents.words import GLOSSARY, answer_words, lead_style, measure_terms, question
from fecontact.outputs.figures.report import ladder_figure
from fecontact.outputs.figures.section import pair_figure
from fecontact.outputs.figures.style import svg_of
from fecontact.outputs.paraview.scene import begin_scene
from fecontact.outputs.records.results import versions
from fecontact.outputs.records.theories import theory_text
from fecontact.outputs.reports.html import page
from fecontact.outputs.tables.cases import ReportedCase, deviation_table, solver_table, verdict_of, verdict_table
from fecontact.outputs.tables.table import Record, Table
from fecontact.outputs.words.pairs import pair_of_row, position_text
from fecontact.outputs.words.roll import roll_words_of_rows
from fecontact.outputs.words.verdicts import decided

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
    return sorted(rows, key=lambda row: -float(row.get("verdict_limit_used") or 0.0))[:count]


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
    parts: list[Part] = [
        Heading(title, 1),
        Lead(conclusion or _answer(cases), lead_style(verdicts)),
        f"{name}: {_answer(cases)}." if conclusion or title != name else "",
        question(pair, criteria, roll_words_of_rows(rows)),
        Heading("Verdicts"),
        verdict_table(cases),
        Picture(content=out / "study.svg", words="Peak pressure, how far Hertz is off, and the touch point."),
        *_pair_drawn(shown, rows),
        *_ladder(rows),
        Heading("Cases"),
        *_cases(cases, pictures),
        Heading("Meshes and solver"),
        Details("Of each case", [solver_table(cases)]),
        *closing(),
    ]
    return write_text(out / REPORT, page(f"{title}: where Hertz holds", parts))


def closing(*more: tuple[str, str]) -> list[Part]:
    """What every report ends with: versions and terms, those of all and `more`."""
    packages = [f"{package} {version}" for package, version in versions().items() if version]
    told = Terms((*GLOSSARY, *measure_terms(), *more))
    return [Heading("What made it"), Items(packages), Heading("Terms"), told]


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


def _pair_drawn(shown: ShownPair | None, rows: Sequence[Row]) -> list[Part]:
    """Both pictures of the pair, each with the words that say which case it is."""
    if shown is None:
        return []
    which = _which(shown.row, rows)
    words = f"Section through the first touch point {which}."
    section = Picture(content=svg_of(pair_figure(shown.placement)), words=words)
    if (reason := shown.no_scene()) is not None:
        return [Heading("The pair"), section, f"There is no picture in three dimensions: {reason}."]
    words = f"Pressure on the rail as a relief {which}; orange: the edge of Hertz's ellipse."
    return [Heading("The pair"), section, Picture(content=shown.scene, words=words, small=True)]


def _which(row: Row, rows: Sequence[Row]) -> str:
    """Which of the cases is drawn, and why that one."""
    at = f"at {position_text(row)}" + (
        f" of {pair_of_row(row, ' and ')}" if len({pair_of_row(one) for one in rows}) > 1 else ""
    )
    if sum(usable(one) for one in rows) < 2:
        return at
    used = row.get("verdict_limit_used")
    part = "" if used is None else f" ({float(used):.2f} times the limit)"
    return f"{at}, the case that uses most of a limit{part}"


def _ladder(rows: Sequence[Row]) -> list[Part]:
    # a single case is no line over the shift
    figure = ladder_figure(rows) if len(rows) > 1 else None
    words = "The ladder: by how much the shape of the gap, and then the finite bodies, change the peak pressure."
    return [] if figure is None else [Picture(content=svg_of(figure), words=words)]


def _cases(cases: Sequence[ReportedCase], pictures: str) -> list[Part]:
    """Picture and all measures of the cases that are drawn, and where those of the others are."""
    have = [case.row for case in cases if case.picture is not None]
    drawn = {str(row["id"]) for row in most_used(have, MOST_PICTURES)}
    parts: list[Part] = []
    if len(drawn) < max(sum(usable(case.row) for case in cases), len(have)):
        parts.append(f"{len(drawn)} of {len(cases)} cases, those that use most of a limit; {pictures}.")
    for case in (case for case in cases if str(case.row["id"]) in drawn):
        row, words = case.row, "Dashed: Hertz's ellipse; solid: the patch of the finite elements."
        assert case.picture is not None
        parts += [
            Heading(f"{pair_of_row(row, ' and ')}, {position_text(row)}: {verdict_of(row)}", 3),
            Picture(content=case.picture, words=f"{decided(row, {})}. {words}"),
            *(case_parts(case.record) if "theories" in case.record else ()),
        ]
    return parts


_KEY = "dev %: what Hertz is off; separ., mispl.: load on other patches, elsewhere"
# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def rows_parts(rows: Sequence[Record]) -> Iterator[Table | str]:
    """One line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for row in rows:
        pair = (row["rail"], row["wheel"], float(row.get("inclination_rad") or 0.0))
        groups.setdefault(pair, []).append(row)
    if len(groups) > _MOST_TABLES:
        yield _fitting(rows, "", with_pair=True)
    else:
        for own in groups.values():
            yield _fitting(own, "; ".join(filter(None, (pair_of_row(own[0]), roll_words_of_rows(own)))))
    if any(usable(row) for row in rows):
        yield _KEY
    for row in rows:
        where = (f"{pair_of_row(row)}, " if len(groups) > 1 else "") + position_text(row)
        if not usable(row):
            yield f"{where}: {row['status']}"
            continue
        if row.get("verdict_cause"):
            yield f"{where}: {row['verdict_answer']}: {row['verdict_cause']}"
        if text := theory_text(row):
            yield f"{where}: {text}"


def _fitting(rows: Sequence[Record], title: str, *, with_pair: bool = False) -> Table:
    """The list of measures shrinks first, then columns go."""
    wide, *shorter = (deviation_table(rows, title, width, with_pair=with_pair) for width in _FAILING_WIDTHS)
    return replace(wide, shorter=shorter)
