"""A map on the terminal and its `report.html`: where Hertz holds, up to which load, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import TypeAlias

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.feature_registry import offered
from fecontact.files import write_text
from fecontact.judging.judged_load import JudgedLoad
from fecontact.maps.files import cell_boxes, draw_map
from fecontact.maps.model import ApplicabilityMap, MapCell, cell_row
from fecontact.maps.telling import cell_record, share_records
from fecontact.maps.theory_views import laws_judged
from fecontact.maps.verdict_views import CAUSE_LETTERS, offered_view, verdict_view
from fecontact.maps.view import MapView
from fecontact.maps.views import map_answer, map_text, views_of
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.case_words import other_wheel_label, roll_words
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.figures.report_pictures import ladder_figure, patches_figure, small_figure
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.parts import Details, Heading, Lead, Part, Picture, Spot
from fecontact.outputs.records.cheapest import cheapest_columns, cheapest_of, cheapest_words
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.report_words import answer_words, lead_style, question
from fecontact.outputs.study_report import REPORT, closing
from fecontact.outputs.style import image_of, page, svg_of, webp_of
from fecontact.outputs.tables import Item, Table, TableRow, columns_of, number, table_of, text
from fecontact.outputs.verdict_words import verdict_reason
from fecontact.placement.wheel_on_rail import Placement

WIDE = 120
"""Columns of text where no terminal says how wide it is."""
# More patches in one picture are too small to see.
_MOST_PATCHES = 24
# Cells get pictures while the page has room: with those of maps, and what is told of each cell, for 5 MB.
_MOST_BYTES, _BYTES_A_CELL, _BYTES_A_PICTURE = 4.9e6, 6e3, 32e3
_CELL_WIDTH = 480
_SMALL = "Solid the patch, dashed Hertz, colours from zero to the larger of both peaks; below, cut across."

Pictures: TypeAlias = Mapping[tuple[float, float], bytes]
"""Pictures of cells that were drawn before, as WEBP, by shift (mm) and load (N)."""


def write_map_report(
    made: ApplicabilityMap, out: Path, *, theory: str = HERTZ, pictures: Pictures | None = None
) -> Path:
    """Write `report.html` beside `map.csv`, with the pictures of the map and another theory's picture if asked for."""
    case = made.case
    pair = pair_words(case, " and ")
    verdicts = [cell.verdict if cell.usable else "failed" for cell in made.cells]
    shown, views = _largest_loads(made), views_of(made, theory)
    cells = {f"cell-{number}": _cell(cell) for number, cell in enumerate(made.cells, start=1)}
    drawn = [_drawn(view, cells) for view in views.values()]
    cheapest = list(views).index("theory")
    parts: list[Part] = [
        Heading(f"Applicability map: {pair}", 1),
        Lead(" ".join(map_answer(made, "pressure")), lead_style(verdicts)),
        f"{answer_words(verdicts, 'cells')}.",
        question(pair, case.criteria),
        _rolled(case),
        *drawn[:cheapest],
        Heading("If not Hertz, what?"),
        " ".join(map_answer(made, "theory")),
        *drawn[cheapest:],
        shares_table(share_records(made)),
        Heading("Load limits"),
        _limits(made),
        Heading("The pair"),
        *_pictures(made, shown),
        Heading("Cells"),
        _cells(made),
        *_each(made, cells, pictures or {}, most=pictures_that_fit(drawn, len(cells))),
        *closing(
            THEORIES,
            *((letter, cause) for cause, letter in CAUSE_LETTERS.items()),
            laws=bool(laws_judged(made)),
        ),
    ]
    return write_text(out / REPORT, page(f"Where Hertz holds: {pair}", parts))


def _cell(cell: MapCell) -> list[Part]:
    """A cell by itself: where it is, its answer, and its measures, without what a case shows on demand."""
    where = f"{cell.lateral_shift_mm:+z.2f} mm, {cell.load_N / 1e3:g} kN"
    if not cell.usable or cell.judged is None:
        return [f"{where}: {cell.status}"]
    # what may decide an open verdict hangs on the case
    parts = case_parts({**cell_record(cell), "case": case_inputs(cell.judged.case)})
    return [f"{where}: Hertz {cell.verdict}", *(part for part in parts if part and not isinstance(part, Details))]


def _drawn(view: MapView, cells: Mapping[str, Sequence[Part]]) -> Picture:
    """The picture of a map, whose cells say their measures and lead to what is told of them."""
    figure = draw_map(view)
    # it is laid out where it is drawn
    content = svg_of(figure)
    spots = [
        Spot(name=name, words="\n".join(_pointed(parts)), box=box)
        for (name, parts), box in zip(cells.items(), cell_boxes(view, figure), strict=True)
    ]
    return Picture(content=content, words=f"{view.title[0].upper()}{view.title[1:]}.", spots=spots)


def _pointed(parts: Sequence[Part]) -> Iterator[str]:
    """What is said of a cell under the pointer: its answer, and a line for each measure."""
    yield str(parts[0])
    for table in (part for part in parts[:4] if isinstance(part, Table)):
        for name, *_, off, unsure, limit, answer in (row.cells for row in table.rows):
            yield f"{name}: {off} ± {unsure} (limit {limit}) {answer}"


def pictures_that_fit(drawn: Sequence[Picture], cells: int) -> int:
    """Of how many cells a page has room for pictures beside those of its maps, whose bytes become four for three."""
    of_maps = sum(4 / 3 * len(one.content) for one in drawn if isinstance(one.content, bytes))
    return max(0, int((_MOST_BYTES - of_maps - _BYTES_A_CELL * cells) / _BYTES_A_PICTURE))


def cell_picture(load: JudgedLoad, placement: Placement) -> bytes:
    """The picture of a cell, as WEBP."""
    return webp_of(image_of(small_figure(load, placement)), _CELL_WIDTH)


def _each(
    made: ApplicabilityMap, cells: Mapping[str, Sequence[Part]], pictures: Pictures, *, most: int
) -> Iterator[Details]:
    """What is told of each cell, with a picture of as many of those that use most of a limit."""
    placements = (position.placement for position in made.positions for _ in position.cells)
    loads = {
        name: (cell.judged, placement)
        for name, cell, placement in zip(cells, made.cells, placements, strict=True)
        if cell.judged is not None and placement is not None
    }
    drawn = sorted(loads, key=lambda name: -loads[name][0].limit_used)[:most]
    for (name, (title, *parts)), cell in zip(cells.items(), made.cells, strict=True):
        if name in drawn:
            content = pictures.get((cell.lateral_shift_mm, cell.load_N)) or cell_picture(*loads[name])
            parts.insert(0, Picture(content=content, words=_SMALL, width=_CELL_WIDTH))
        yield Details(str(title), parts, name)


def map_lines(made: ApplicabilityMap, measure: str, theory: str, *, width: int | None) -> Iterator[Table | str]:
    """A map on the terminal by a measure, or by a theory; by the cheapest theory with the share of each.

    The answer in sentences comes first.
    """
    yield from (fill(one, width or WIDE) for one in map_answer(made, measure, theory))
    yield " "
    yield map_text(made, measure, theory=theory, width=width)
    if measure == "theory":
        yield shares_table(share_records(made))


def _rolled(case: Case) -> str:
    both = " Read the right wheel at the opposite shift."
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


def _pictures(made: ApplicabilityMap, shown: Sequence[tuple[JudgedLoad, Placement]]) -> list[Part]:
    parts: list[Part] = []
    if shown:
        load, middle = shown[len(shown) // 2]
        at = load.case.lateral_shift_mm
        words = f"Section through the first touch point at {at:+z.2f} mm, the middle one of the positions shown below."
        parts.append(Picture(content=svg_of(pair_figure(middle)), words=words))
    largest = [
        cell_row(position.cells[-1], position.placement) | {"rail": made.case.rail, "wheel": made.case.wheel}
        for position in made.positions
        if position.cells
    ]
    if (ladder := ladder_figure(largest)) is not None:
        words = "The ladder at the largest load: what the shape of the gap, and then the finite bodies, change."
        parts += [Heading("Shape of the gap, or finite bodies?"), Picture(content=svg_of(ladder), words=words)]
    if shown:
        words = f"Pressure at the largest load of each position. {_SMALL}"
        parts += [Heading("Pressure"), Picture(content=image_of(patches_figure(shown)), words=words, width=2400)]
    return parts


def _limits(made: ApplicabilityMap) -> Table:
    """At which loads Hertz holds at each position, by the map's measures, and by the measures of features."""
    others = [name for name, of in offered("MAPS").items() if of.criterion(made.case)]
    views = [verdict_view(made), *(offered_view(made, name) for name in others)]
    heads = ("as judged here", *(offered("MAPS")[name].short for name in others))
    rows = [
        TableRow(cells=[f"{columns[0].shift_mm:+z.2f}", *(column.limit for column in columns)])
        for columns in zip(*(view.columns for view in views), strict=True)
    ]
    return Table(title="", columns=columns_of("shift mm", *heads, texts=heads), rows=rows)


def _cells(made: ApplicabilityMap) -> Table:
    """The verdict of each cell, and the cheapest theory that holds there."""
    words = ("decided by", "cheapest theory that holds")
    headings = ("shift mm", "load kN", "Hertz", "share of the limit", words[0], "unknowns", words[1])
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
    cheapest = cheapest_words(cheapest_columns("cheapest_theory", cheapest_of(load)))
    used = load.limit_used if load.plastic is None else load.plastic.deciding.limit_used
    return [f"{used:.2f}", verdict_reason(load), unknowns, cheapest]


_OTHER_ANSWERS = {
    "UNRESOLVED": "open whether a cheaper one holds",
    "none": "none holds",
    "failed": "could not be solved",
}

_SHARES = (
    text("theory", lambda one: one.get("words") or _OTHER_ANSWERS[one["theory"]], wraps=True),
    text("cost", "cost", wraps=True),
    number("cheapest\ncells", "cheapest_cells", "{:.0f}"),
    number("cheapest\n%", "cheapest_percent", "{:.0f}"),
    number("out of\nrange", "out_of_range_cells", "{:.0f}"),
    number("largest\nshare of\nthe limit", "largest_limit_used", "{:.2f}"),
    number("holds\n%", "holds_percent", "{:.0f}"),
)


def shares_table(shares: Sequence[Item]) -> Table:
    """In how many cells of a map each theory is the cheapest that holds, and in how many it holds at all."""
    shown = [one for one in shares if one["cheapest_cells"] or "cost" in one]
    return table_of("The cheapest theory that holds, and where each holds", _SHARES, shown)
