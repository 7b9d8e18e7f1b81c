"""A study in parts: a line per case for the terminal, and `report.html`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from fecontact.criteria import Criteria
from fecontact.errors import InputError, usable
from fecontact.feature_registry import offered
from fecontact.files import read_json, write_text
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.case_words import roll_words_of_rows
from fecontact.outputs.cases import (
    ReportedCase,
    deviation_table,
    solver_table,
    verdict_of,
    verdict_table,
)
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.figures.report_pictures import ladder_figure
from fecontact.outputs.pair_names import Row, pair_of_row, position_text
from fecontact.outputs.parts import Details, Heading, Items, Lead, Part, Picture, Terms
from fecontact.outputs.records.asked import asked_row
from fecontact.outputs.records.cheapest import theory_text
from fecontact.outputs.records.results import versions
from fecontact.outputs.report_words import GLOSSARY, answer_words, lead_style, measure_terms, question, theory_terms
from fecontact.outputs.style import page, svg_of
from fecontact.outputs.tables import Item, Table
from fecontact.outputs.verdict_words import (
    YIELDING,
    decided,
    elastic_words,
)
from fecontact.placement.wheel_on_rail import Placement

_Row = TypeVar("_Row", bound=Row)

REPORT = "report.html"
MOST_PICTURES = 40
"""More pictures make a page of tens of megabytes."""


@dataclass(frozen=True, kw_only=True)
class ShownPair:
    """The case whose pair is drawn in section."""

    row: Row
    placement: Placement


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
    cases = [replace(case, row=asked_row(case.row)) for case in cases]
    rows = [case.row for case in cases]
    verdicts = [verdict_of(row) for row in rows]
    pairs = list(dict.fromkeys(pair_of_row(row, " and ") for row in rows))
    pair = "; ".join(pairs[:4]) + ("; ..." if len(pairs) > 4 else "")
    title = _title(name, rows)
    parts: list[Part] = [
        Heading(title, 1),
        Lead(conclusion or _answer(cases), lead_style(verdicts)),
        f"{name}: {_answer(cases)}." if conclusion else f"Study {name}." if title != name else "",
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
        *closing(
            (name for case in cases for name in case.record.get("theories", ())),
            laws=any(name in case.record for case in cases for name in offered("TELLINGS")),
        ),
    ]
    return write_text(out / REPORT, page(f"{title}: where Hertz holds", parts))


def closing(theories: Iterable[str], *more: tuple[str, str], laws: bool) -> list[Part]:
    """What every report ends with: the terms of all reports, of theories and laws, and `more`; then versions."""
    packages = [f"{package} {version}" for package, version in versions().items() if version]
    told = Terms((*GLOSSARY, *measure_terms(), *theory_terms(theories, laws=laws), *more))
    return [Heading("Terms"), told, Heading("What made it"), Items(packages)]


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
        elastic = [case.row["elastic_verdict_answer"] for case in cases if "elastic_verdict_answer" in case.row]
        more = f"; {YIELDING}, and against elastic bodies it holds in {elastic.count('HOLDS')}" if elastic else ""
        return answer_words([verdict_of(case.row) for case in cases], "cases") + more
    (row,) = (case.row for case in cases)
    cause = f"; {row['verdict_cause']}" if row.get("verdict_cause") else ""
    against = more = ""
    if "elastic_verdict_answer" in row:
        against, more = f" {YIELDING}", f"; {elastic_words(row['elastic_verdict_answer'])}"
    return f"Hertz {verdict_of(row)}{against}: {decided(row, cases[0].limits)}{cause}{more}"


def _pair_drawn(shown: ShownPair | None, rows: Sequence[Row]) -> list[Part]:
    """The pair in section, with the words that say which case it is."""
    if shown is None:
        return []
    words = f"Section through the first touch point {_which(shown.row, rows)}."
    return [Heading("The pair"), Picture(content=svg_of(pair_figure(shown.placement)), words=words)]


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
    """Picture and all measures of the drawn cases, and where the other cases are."""
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
            *([] if case.relief is None else [case.relief]),
            *(case_parts(case.record) if "theories" in case.record else ()),
        ]
    return parts


_KEY = "dev %: error of Hertz; separ., mispl.: load on separate patches, misplaced load"
# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def judged_rows_parts(rows: Sequence[Item]) -> Iterator[Part]:
    """Do as `rows_parts` does, with what features say of the rows."""
    yield from rows_parts(rows)
    for telling in offered("TELLINGS").values():
        yield from telling.of_rows(rows)


def rows_parts(rows: Sequence[Item]) -> Iterator[Table | str]:
    """One line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    groups: dict[tuple[Any, ...], list[Item]] = {}
    rows = [asked_row(row) for row in rows]
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
    if any("elastic_verdict_answer" in row for row in rows):
        yield f"verdict, FE, dev %: {YIELDING}"
    for row in rows:
        where = (f"{pair_of_row(row)}, " if len(groups) > 1 else "") + position_text(row)
        if not usable(row):
            yield f"{where}: {row['status']}"
            continue
        if row.get("verdict_cause"):
            yield f"{where}: {row['verdict_answer']}: {row['verdict_cause']}"
        if text := theory_text(row):
            yield f"{where}: {text}"


def _fitting(rows: Sequence[Item], title: str, *, with_pair: bool = False) -> Table:
    """The list of measures shrinks first, then columns go."""
    wide, *shorter = (deviation_table(rows, title, width, with_pair=with_pair) for width in _FAILING_WIDTHS)
    return replace(wide, shorter=shorter)
