"""Parts of a study: a line per case for the terminal, and `report.html`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from fecontact.criteria import Criteria
from fecontact.errors import InputError, is_usable_status
from fecontact.feature_registry import load_offers
from fecontact.files import read_json, write_text
from fecontact.inputs.texts import count_text
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
from fecontact.outputs.pair_names import RowMapping, position_text, row_pair_text
from fecontact.outputs.parts import Details, Heading, Items, Lead, Part, Picture, Terms
from fecontact.outputs.records.asked import requested_row
from fecontact.outputs.records.results import package_versions
from fecontact.outputs.report_words import (
    GLOSSARY,
    answer_words,
    lead_style,
    measure_terms,
    question_text,
    theory_terms,
)
from fecontact.outputs.style import render_page, render_svg
from fecontact.outputs.tables import Table, TableRecord
from fecontact.outputs.verdict_words import (
    AGAINST_YIELDING_BODIES,
    cheapest_text_of_row,
    deciding_measure_text,
    describe_verdict,
    elastic_words,
    reason_text_of_row,
    utilisation_text,
)
from fecontact.placement.wheel_on_rail import Placement

_Row = TypeVar("_Row", bound=RowMapping)

REPORT_FILE = "report.html"
MAX_PICTURES = 40
"""Largest number of pictures in a report. More pictures make a page of tens of megabytes."""


@dataclass(frozen=True, kw_only=True)
class DrawnCase:
    """Case for the section through both profiles.

    Attributes
    ----------
    row
        Row of the case.
    placement
        The wheel on the rail.
    """

    row: RowMapping
    placement: Placement


def read_reported_case(row: RowMapping, folder: Path) -> ReportedCase:
    """Read a case from its folder for a report.

    Parameters
    ----------
    row
        Row of the case.
    folder
        Folder of the case.

    Returns
    -------
    ReportedCase
        Row, record and picture. The record is empty and the picture None if their files do not exist.
    """
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


def rows_by_utilisation(rows: Iterable[_Row], count: int) -> list[_Row]:
    """Rows with the largest limit utilisations, in descending order."""
    return sorted(rows, key=lambda row: -float(row.get("verdict_limit_utilisation") or 0.0))[:count]


def write_study_report(
    name: str,
    cases: Sequence[ReportedCase],
    out: Path,
    *,
    shown: DrawnCase | None = None,
    criteria: Criteria | None = None,
    conclusion: str | None = None,
    pictures: str = "all are in cases/ID/case.png",
) -> Path:
    """Write `report.html` into the folder of a study or of a single case.

    Parameters
    ----------
    name
        Name of the study.
    cases
        Cases of the study.
    out
        Folder of the study.
    shown
        Pair to draw, from the case with the largest limit utilisation.
    criteria
        Common criteria of all rows; None if there are several sets.
    conclusion
        Conclusion of the study, below the numbers of verdicts; None without a conclusion.
    pictures
        Text that names the place of the pictures that the report leaves out.

    Returns
    -------
    Path
        The written page.
    """
    cases = [replace(case, row=requested_row(case.row)) for case in cases]
    rows = [case.row for case in cases]
    verdicts = [verdict_of(row) for row in rows]
    pairs = list(dict.fromkeys(row_pair_text(row, " and ") for row in rows))
    pair = "; ".join(pairs[:4]) + ("; ..." if len(pairs) > 4 else "")
    title = _report_title(name, rows)
    parts: list[Part] = [
        Lead(_answer_text(cases), lead_style(verdicts), title if title == name else f"{title}; study {name}"),
        conclusion or "",
        question_text(pair, criteria, roll_words_of_rows(rows)),
        Heading("Verdicts"),
        verdict_table(cases),
        Picture(
            content=out / "study.svg",
            words="Peak pressure, limit utilisation or deviation of Hertz, and contact point.",
        ),
        *_pair_parts(shown, rows),
        *_ladder_parts(rows),
        Heading("Cases"),
        *_case_sections(cases, pictures),
        Heading("Meshes and solver"),
        Details("All cases", [solver_table(cases)]),
        *closing_parts(
            (name for case in cases for name, theory in case.record.get("theories", {}).items() if theory is not None),
            laws=any(case.record.get(name) is not None for case in cases for name in load_offers("TELLINGS")),
        ),
    ]
    return write_text(out / REPORT_FILE, render_page(f"{title}: where Hertz holds", parts))


def closing_parts(theories: Iterable[str], *further_terms: tuple[str, str], laws: bool) -> list[Part]:
    """Last parts of every report: the terms of reports, theories and laws, then versions.

    Parameters
    ----------
    theories
        Names of theories of the pressure.
    further_terms
        Terms of this report alone, with their meanings.
    laws
        Whether the laws of features are included.

    Returns
    -------
    list of Part
        Headings, terms and versions.
    """
    packages = [f"{package} {version}" for package, version in package_versions().items() if version]
    terms = Terms((*GLOSSARY, *measure_terms(), *theory_terms(theories, laws=laws), *further_terms))
    return [Heading("Terms"), terms, Heading("Versions"), Items(packages)]


def _report_title(name: str, rows: Sequence[RowMapping]) -> str:
    """Title of a report: the pair and its loads.

    It is the name of the study if there are several pairs or a single case.
    """
    pairs = {row_pair_text(row, " and ") for row in rows}
    if len(rows) == 1 or len(pairs) != 1:
        return name
    loads = sorted({float(row["load_kN"]) for row in rows})
    (pair,) = pairs
    return (
        f"{pair[0].upper()}{pair[1:]}, {' to '.join(f'{load:g}' for load in dict.fromkeys((loads[0], loads[-1])))} kN"
    )


def _answer_text(cases: Sequence[ReportedCase]) -> str:
    """Answer of a study: the numbers of verdicts, or the verdict of a single case with its reason."""
    if len(cases) != 1:
        elastic = [case.row["elastic_verdict_answer"] for case in cases if "elastic_verdict_answer" in case.row]
        elastic_part = (
            f"; {AGAINST_YIELDING_BODIES}, and against elastic bodies it holds in {elastic.count('HOLDS')}"
            if elastic
            else ""
        )
        return answer_words([verdict_of(case.row) for case in cases], "cases") + elastic_part
    ((row, record),) = ((case.row, case.record) for case in cases)
    if not is_usable_status(row) or "verdict" not in record:
        return f"Hertz {verdict_of(row)}: {deciding_measure_text(row, {})}"
    elastic = record["elastic_verdict"]
    return describe_verdict(record) + (f"; {elastic_words(elastic['answer'])}" if elastic is not None else "")


def _pair_parts(drawn_case: DrawnCase | None, rows: Sequence[RowMapping]) -> list[Part]:
    """Section through the pair, with words that name the case."""
    if drawn_case is None:
        return []
    words = f"Section through the first contact point {_drawn_case_text(drawn_case.row, rows)}."
    return [Heading("The pair"), Picture(content=render_svg(pair_figure(drawn_case.placement)), words=words)]


def _drawn_case_text(row: RowMapping, rows: Sequence[RowMapping]) -> str:
    """Text that names the drawn case and the reason of its choice."""
    place_text = f"at {position_text(row)}" + (
        f" of {row_pair_text(row, ' and ')}" if len({row_pair_text(other_row) for other_row in rows}) > 1 else ""
    )
    if sum(is_usable_status(other_row) for other_row in rows) < 2:
        return place_text
    utilisation = row.get("verdict_limit_utilisation")
    utilisation_part = "" if utilisation is None else f" ({utilisation_text(float(utilisation))})"
    return f"{place_text}, the case with the largest limit utilisation{utilisation_part}"


def _ladder_parts(rows: Sequence[RowMapping]) -> list[Part]:
    # a single case gives no curve over the shift
    figure = ladder_figure(rows) if len(rows) > 1 else None
    words = "Ladder: change of the peak pressure by the shape of the gap, then by the finite bodies."
    return [] if figure is None else [Picture(content=render_svg(figure), words=words)]


def _case_sections(cases: Sequence[ReportedCase], pictures: str) -> list[Part]:
    """Picture and all measures of the drawn cases, and the place of the other cases."""
    rows_with_picture = [case.row for case in cases if case.picture is not None]
    drawn_ids = {str(row["id"]) for row in rows_by_utilisation(rows_with_picture, MAX_PICTURES)}
    parts: list[Part] = []
    if len(drawn_ids) < max(sum(is_usable_status(case.row) for case in cases), len(rows_with_picture)):
        parts.append(
            f"{len(drawn_ids)} of {count_text(len(cases), 'case')}, with the largest limit utilisation; {pictures}."
        )
    for case in (case for case in cases if str(case.row["id"]) in drawn_ids):
        row, words = case.row, "Dashed: Hertz's ellipse; solid: the patch of the finite elements."
        assert case.picture is not None
        parts += [
            Heading(f"{row_pair_text(row, ' and ')}, {position_text(row)}: {verdict_of(row)}", 3),
            Picture(content=case.picture, words=f"{deciding_measure_text(row, {})}. {words}"),
            *([] if case.relief is None else [case.relief]),
            *(case_parts(case.record) if "theories" in case.record else ()),
        ]
    return parts


_COLUMN_KEY = "dev %: deviation; separ.: load on separate patches; mispl.: misplaced load"
# If there are more pairs, all are in one table, with the pair in its first column.
_MAX_TABLES = 6
# Characters for the measures by which a case fails, in descending order. Measures without room are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def parts_of_judged_rows(rows: Sequence[TableRecord]) -> Iterator[Part]:
    """Iterate over the parts of `parts_of_rows` and the parts that features add.

    Parameters
    ----------
    rows
        Rows of cases.

    Returns
    -------
    Iterator of Part
        Parts in order.
    """
    yield from parts_of_rows(rows)
    for telling in load_offers("TELLINGS").values():
        yield from telling.of_rows(rows)


def parts_of_rows(rows: Sequence[TableRecord]) -> Iterator[Table | str]:
    """Iterate over tables of cases, and lines on unusable rows and causes.

    There is a table for each rail, wheel and inclination, with one line per case.

    Parameters
    ----------
    rows
        Rows of cases.

    Returns
    -------
    Iterator of Table or str
        Parts in order.
    """
    groups: dict[tuple[Any, ...], list[TableRecord]] = {}
    rows = [requested_row(row) for row in rows]
    for row in rows:
        pair = (row["rail"], row["wheel"], float(row.get("inclination_rad") or 0.0))
        groups.setdefault(pair, []).append(row)
    if len(groups) > _MAX_TABLES:
        yield _shrinking_table(rows, "", with_pair=True)
    else:
        for group in groups.values():
            yield _shrinking_table(group, "; ".join(filter(None, (row_pair_text(group[0]), roll_words_of_rows(group)))))
    if any(is_usable_status(row) for row in rows):
        yield _COLUMN_KEY
    if any("elastic_verdict_answer" in row for row in rows):
        yield f"verdict, FE, dev %: {AGAINST_YIELDING_BODIES}"
    for row in rows:
        place_text = (f"{row_pair_text(row)}, " if len(groups) > 1 else "") + position_text(row)
        if not is_usable_status(row):
            yield f"{place_text}: {row['status']}"
            continue
        if reason := reason_text_of_row(row):
            yield f"{place_text}: {row['verdict_answer']}: {reason}"
        if text := cheapest_text_of_row(row):
            yield f"{place_text}: {text}"


def _shrinking_table(rows: Sequence[TableRecord], title: str, *, with_pair: bool = False) -> Table:
    """Table in which first the list of measures shrinks, then columns disappear."""
    wide, *shorter = (deviation_table(rows, title, width, with_pair=with_pair) for width in _FAILING_WIDTHS)
    return replace(wide, shorter=shorter)
