"""`report.html` of an applicability map: where Hertz holds, up to which load, and what is behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.criteria import Criteria
from fecontact.files import write_text
from fecontact.geometry.placement import Placement
from fecontact.map.cells import ApplicabilityMap, LoadLimit
from fecontact.outputs.figures.report import ladder_figure, patches_figure
from fecontact.outputs.figures.section import pair_figure
from fecontact.outputs.figures.style import image_of, svg_of
from fecontact.outputs.maps.measures import map_answer
from fecontact.outputs.maps.verdicts import CAUSE_LETTERS, force_view, limit_text, verdict_view
from fecontact.outputs.records.rows import cell_row
from fecontact.outputs.records.theories import cheapest_words, share_records, theory_columns
from fecontact.outputs.reports.html import drawing, heading, page, paragraph, picture, pixels, table
from fecontact.outputs.reports.study import REPORT, closing
from fecontact.outputs.reports.words import answer_words, lead_style, question, theory_terms
from fecontact.outputs.tables.table import Table, TableRow, columns_of
from fecontact.outputs.tables.theories import shares_table
from fecontact.outputs.words.measures import WORDS
from fecontact.outputs.words.pairs import pair_words
from fecontact.outputs.words.roll import other_wheel_label, roll_words
from fecontact.outputs.words.verdicts import verdict_reason

# More patches in one picture are too small to see.
_MOST_PATCHES = 24


def write_map_report(
    made: ApplicabilityMap, out: Path, *, uses: Mapping[str, Sequence[LoadLimit]], theory: str = HERTZ
) -> Path:
    """Write `report.html` beside `map.csv`, with the pictures of the map, and that of another theory if it is one.

    `uses` are the load limits by each set of measures (`map.uses`), which stand side by side.
    """
    case = made.case
    pair = pair_words(case, " and ")
    verdicts = [cell.verdict if cell.usable else "failed" for cell in made.cells]
    shown = _largest_loads(made)
    body = [
        heading(f"Applicability map: {pair}", 1),
        paragraph(" ".join(map_answer(made, "pressure")), lead_style(verdicts)),
        paragraph(f"{answer_words(verdicts, 'cells')}."),
        paragraph(question(pair, case.criteria)),
        paragraph(_rolled(case)),
        picture(out / "map.svg", "Where Hertz holds over lateral shift and load."),
        picture(out / "map_force.svg", "Where Hertz holds for creep forces.") if case.creep.asked else "",
        picture(out / f"map_{theory}.svg", f"Where {THEORIES[theory].words} holds.") if theory != HERTZ else "",
        heading("If not Hertz, what?"),
        paragraph(" ".join(map_answer(made, "theory"))),
        picture(out / "map_theory.svg", "The cheapest theory of the pressure that holds."),
        table(shares_table(share_records(made))),
        picture(out / "map_law.svg", "The cheapest law of creep forces that holds.") if made.laws_judged else "",
        heading("Load limits"),
        table(_limits(made, uses)),
        heading("The pair"),
        *_pictures(made, shown),
        heading("Cells"),
        table(_cells(made)),
        *closing(
            *theory_terms(str(one["theory"]) for one in share_records(made) if one["theory"] in THEORIES),
            *((letter, cause) for cause, letter in CAUSE_LETTERS.items()),
        ),
    ]
    return write_text(out / REPORT, page(f"Where Hertz holds: {pair}", body))


def _rolled(case: Case) -> str:
    both = " At the opposite shift it stands as the other wheel of the wheelset does: both are here."
    return f"The {case.side} wheel, {roll_words(case)}.{both if other_wheel_label(case) else ''}"


def _largest_loads(made: ApplicabilityMap) -> list[tuple[JudgedLoad, Placement]]:
    """The largest load of each position that was solved, of many positions some evenly among them."""
    found = [
        (cells[-1], position.placement)
        for position in made.positions
        if position.placement is not None
        and (cells := [cell.judged for cell in position.cells if cell.judged is not None])
    ]
    step = -(-len(found) // _MOST_PATCHES) or 1
    return found[::step]


def _pictures(made: ApplicabilityMap, shown: Sequence[tuple[JudgedLoad, Placement]]) -> list[str]:
    parts = []
    if shown:
        load, middle = shown[len(shown) // 2]
        at = load.case.lateral_shift_mm
        words = f"Section through the first touch point at {at:+z.2f} mm, the middle one of the positions shown below."
        parts.append(drawing(svg_of(pair_figure(middle)), words))
    largest = [
        cell_row(position.cells[-1], position.placement) | {"rail": made.case.rail, "wheel": made.case.wheel}
        for position in made.positions
        if position.cells
    ]
    if (ladder := ladder_figure(largest)) is not None:
        words = "The ladder at the largest load: what the shape of the gap, and then the finite bodies, change."
        parts += [heading("Shape of the gap, or finite bodies?"), drawing(svg_of(ladder), words)]
    if shown:
        words = "Pressure at the largest load of each position: solid the patch, dashed Hertz; below, cut across."
        parts += [heading("Pressure"), pixels(image_of(patches_figure(shown)), words, width=2400)]
    return parts


def _limits(made: ApplicabilityMap, uses: Mapping[str, Sequence[LoadLimit]]) -> Table:
    """At which loads Hertz holds at each position, by the map's measures, by each set of them, and for forces."""
    views = [verdict_view(made), *([force_view(made)] if made.case.creep.asked else [])]
    heads = ["as judged here", *(f"{use} ({_set_text(made.case.criteria, use)})" for use in uses)]
    heads += ["creep forces"] * (len(views) - 1)
    rows = []
    for number, column in enumerate(views[0].columns):
        told = (_limit_cell(limits[number]) for limits in uses.values())
        rows.append(
            TableRow(
                cells=[
                    f"{column.shift_mm:+z.2f}",
                    column.limit,
                    *told,
                    *(view.columns[number].limit for view in views[1:]),
                ]
            )
        )
    return Table(title="", columns=columns_of("shift mm", *heads, texts=tuple(heads)), rows=rows)


def _set_text(criteria: Criteria, use: str) -> str:
    return ", ".join(WORDS[measure].short for measure in replace(criteria, judged_by=(use,)).limits)


def _limit_cell(limit: LoadLimit) -> str:
    return limit_text(limit, {load_N / 1e3 for load_N, answer in limit.tried if answer == "UNRESOLVED"})


def _cells(made: ApplicabilityMap) -> Table:
    """The verdict of each cell, and the cheapest theory that holds there."""
    words = ("decided by", "cheapest theory that holds")
    headings = ("shift mm", "load kN", "Hertz", "part of a limit", words[0], "unknowns", words[1])
    rows = []
    for cell in made.cells:
        judged = cell.judged
        answer = cell.verdict if cell.usable else "failed"
        cells = [f"{cell.lateral_shift_mm:+z.2f}", f"{cell.load_N / 1e3:g}", answer]
        cells += ["-", cell.status, "-", ""] if judged is None else _cells_of(judged)
        rows.append(TableRow(cells=cells, tone="fails" if answer == "FAILS" else "plain"))
    return Table(title="", columns=columns_of(*headings, texts=words, answers=("Hertz",)), rows=rows)


def _cells_of(load: JudgedLoad) -> list[str]:
    unknowns = str(sum(load.level.degrees_of_freedom.values()))
    return [f"{load.limit_used:.2f}", verdict_reason(load), unknowns, cheapest_words(theory_columns(load))]
