"""Reports of a map, on the terminal and as `report.html`: where Hertz holds, up to which load, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import TypeAlias

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import is_usable_status
from fecontact.feature_registry import load_offers
from fecontact.files import write_text
from fecontact.judging.judged_load import JudgedLoad
from fecontact.maps.files import cell_boxes, draw_map
from fecontact.maps.model import ApplicabilityMap, build_cell_row
from fecontact.maps.telling import build_cell_record, count_theory_shares
from fecontact.maps.theory_views import find_judged_laws
from fecontact.maps.verdict_views import CAUSE_LETTERS, build_feature_view, build_verdict_view
from fecontact.maps.view import MapView
from fecontact.maps.views import build_views, format_map, write_map_answer
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.case_words import other_wheel_label, roll_words
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.figures.report_pictures import ladder_figure, patches_figure, small_figure
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.parts import Details, Heading, Lead, Part, Picture, Spot
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.report_words import answer_words, lead_style, question_text
from fecontact.outputs.study_report import REPORT_FILE, closing_parts
from fecontact.outputs.style import encode_webp, render_image, render_page, render_svg
from fecontact.outputs.tables import Table, TableRecord, TableRow, make_columns, make_table, number_column, text_column
from fecontact.outputs.verdict_words import cheapest_words, verdict_reason
from fecontact.placement.wheel_on_rail import Placement

DEFAULT_TEXT_WIDTH = 120
"""Width of texts in characters if the output is not a terminal."""
# Largest number of patches in a picture; more patches are too small to see.
_MOST_PATCHES = 24
# Cells get pictures up to a size of the page of 5 MB, with the pictures of the maps and the text of each cell.
_LARGEST_PAGE_BYTES, _BYTES_PER_CELL, _BYTES_PER_PICTURE = 4.9e6, 6e3, 32e3
_CELL_WIDTH = 480
_SMALL_PICTURE_WORDS = (
    "Solid line: patch. Dashed line: Hertz. Colours from zero to the larger of both peaks. Below: lateral cut."
)

Pictures: TypeAlias = Mapping[tuple[float, float], bytes]
"""Pictures of cells that were drawn before, as WEBP, by shift (mm) and load (N)."""


def write_map_report(
    applicability_map: ApplicabilityMap, out: Path, *, theory: str = HERTZ, pictures: Pictures | None = None
) -> Path:
    """Write `report.html` of a map beside `map.csv`.

    Parameters
    ----------
    applicability_map
        Map.
    out
        Folder of the map.
    theory
        Further theory of the pressure with a picture.
    pictures
        Pictures of cells that were drawn before.

    Returns
    -------
    Path
        File of the report.
    """
    case = applicability_map.case
    pair = pair_words(case, " and ")
    verdicts = [cell.verdict if cell.usable else "failed" for cell in applicability_map.cells]
    largest_loads, views = _choose_largest_loads(applicability_map), build_views(applicability_map, theory)
    records = [
        build_cell_record(cell) | ({} if cell.judged is None else {"case": case_inputs(cell.judged.case)})
        for cell in applicability_map.cells
    ]
    cells = {f"cell-{number}": _build_cell_parts(record) for number, record in enumerate(records, start=1)}
    map_pictures = [_draw_map_picture(view, cells) for view in views.values()]
    theory_index = list(views).index("theory")
    parts: list[Part] = [
        Heading(f"Applicability map: {pair}", 1),
        Lead(" ".join(write_map_answer(applicability_map, "pressure")), lead_style(verdicts)),
        f"{answer_words(verdicts, 'cells')}.",
        question_text(pair, case.criteria),
        _describe_wheel(case),
        *map_pictures[:theory_index],
        Heading("If not Hertz, what?"),
        " ".join(write_map_answer(applicability_map, "theory")),
        *map_pictures[theory_index:],
        build_shares_table(count_theory_shares(applicability_map)),
        Heading("Load limits"),
        _build_limits_table(applicability_map),
        Heading("The pair"),
        *_build_pictures(applicability_map, largest_loads),
        Heading("Cells"),
        _build_cells_table(records),
        *_build_details(
            applicability_map, cells, pictures or {}, picture_count=count_fitting_pictures(map_pictures, len(cells))
        ),
        *closing_parts(
            THEORIES,
            *((letter, cause) for cause, letter in CAUSE_LETTERS.items()),
            laws=bool(find_judged_laws(applicability_map)),
        ),
    ]
    return write_text(out / REPORT_FILE, render_page(f"Where Hertz holds: {pair}", parts))


def _build_cell_parts(record: TableRecord) -> list[Part]:
    """Parts of a cell: its place, its answer and its measures, without the details of a case.

    The record has the inputs of the case, on which the remedy for an unresolved verdict depends.
    """
    place = f"{record['lateral_shift_mm']:+z.2f} mm, {record['load_N'] / 1e3:g} kN"
    if not is_usable_status(record):
        return [f"{place}: {record['status']}"]
    return [
        f"{place}: Hertz {record['verdict']['answer']}",
        *(
            document_part
            for document_part in case_parts(record)
            if document_part and not isinstance(document_part, Details)
        ),
    ]


def _draw_map_picture(view: MapView, cells: Mapping[str, Sequence[Part]]) -> Picture:
    """Picture of a map with a spot for each cell.

    The spot shows the measures of the cell and links to its details."""
    figure = draw_map(view)
    # Drawing the figure also lays it out.
    content = render_svg(figure)
    spots = [
        Spot(name=name, words="\n".join(_describe_measures(parts)), box=box)
        for (name, parts), box in zip(cells.items(), cell_boxes(view, figure), strict=True)
    ]
    return Picture(content=content, words=f"{view.title[0].upper()}{view.title[1:]}.", spots=spots)


def _describe_measures(parts: Sequence[Part]) -> Iterator[str]:
    """Lines of a cell under the mouse pointer: its answer, and a line for each measure."""
    yield str(parts[0])
    for table in (document_part for document_part in parts[:4] if isinstance(document_part, Table)):
        for name, *_, deviation, uncertainty, limit, answer in (row.cells for row in table.rows):
            yield f"{name}: {deviation} ± {uncertainty} (limit {limit}) {answer}"


def count_fitting_pictures(map_pictures: Sequence[Picture], cells: int) -> int:
    """Number of cells for which a page has room for pictures.

    Four bytes of the page hold three bytes of a picture.

    Parameters
    ----------
    map_pictures
        Pictures of the maps.
    cells
        Number of cells.

    Returns
    -------
    int
        Number of pictures of cells.
    """
    bytes_of_maps = sum(4 / 3 * len(picture.content) for picture in map_pictures if isinstance(picture.content, bytes))
    return max(0, int((_LARGEST_PAGE_BYTES - bytes_of_maps - _BYTES_PER_CELL * cells) / _BYTES_PER_PICTURE))


def draw_cell_picture(load: JudgedLoad, placement: Placement) -> bytes:
    """Picture of a cell, as WEBP."""
    return encode_webp(render_image(small_figure(load, placement)), _CELL_WIDTH)


def _build_details(
    applicability_map: ApplicabilityMap, cells: Mapping[str, Sequence[Part]], pictures: Pictures, *, picture_count: int
) -> Iterator[Details]:
    """Details of each cell, with pictures for the cells of largest limit utilisation.

    Parameters
    ----------
    applicability_map
        Map.
    cells
        Parts of each cell by its name.
    pictures
        Pictures of cells that were drawn before.
    picture_count
        Largest number of pictures.

    Yields
    ------
    Details
        Details of a cell.
    """
    placements = (position.placement for position in applicability_map.positions for _ in position.cells)
    loads = {
        name: (cell.judged, placement)
        for name, cell, placement in zip(cells, applicability_map.cells, placements, strict=True)
        if cell.judged is not None and placement is not None
    }
    names_with_picture = sorted(loads, key=lambda name: -loads[name][0].limit_utilisation)[:picture_count]
    for (name, (title, *parts)), cell in zip(cells.items(), applicability_map.cells, strict=True):
        if name in names_with_picture:
            content = pictures.get((cell.lateral_shift_mm, cell.load_N)) or draw_cell_picture(*loads[name])
            parts.insert(0, Picture(content=content, words=_SMALL_PICTURE_WORDS, width=_CELL_WIDTH))
        yield Details(str(title), parts, name)


def format_map_lines(
    applicability_map: ApplicabilityMap, measure: str, theory: str, *, width: int | None
) -> Iterator[Table | str]:
    """Lines of a map on the terminal, by a measure.

    The answer in sentences is first, then the map. For the measure `theory` a table with the share of each theory
    follows.

    Parameters
    ----------
    applicability_map
        Map.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.
    width
        Width in characters; None if the output is not a terminal.

    Yields
    ------
    Table or str
        Part of the output.
    """
    yield from (
        fill(sentence, width or DEFAULT_TEXT_WIDTH) for sentence in write_map_answer(applicability_map, measure, theory)
    )
    yield " "
    yield format_map(applicability_map, measure, theory=theory, width=width)
    if measure == "theory":
        yield build_shares_table(count_theory_shares(applicability_map))


def _describe_wheel(case: Case) -> str:
    hint = " For the other wheel, read the opposite shift."
    return f"The {case.side} wheel, {roll_words(case)}.{hint if other_wheel_label(case) else ''}"


def _choose_largest_loads(applicability_map: ApplicabilityMap) -> list[tuple[JudgedLoad, Placement]]:
    """Largest solved load of each position, evenly spaced if there are many positions."""
    loads = [
        (cells[-1], position.placement)
        for position in applicability_map.positions
        if position.placement is not None
        and (cells := [cell.judged for cell in position.cells if cell.judged is not None])
    ]
    step = -(-len(loads) // _MOST_PATCHES) or 1
    return loads[::step]


def _build_pictures(
    applicability_map: ApplicabilityMap, largest_loads: Sequence[tuple[JudgedLoad, Placement]]
) -> list[Part]:
    """Pictures of the pair, of the ladder and of the pressures.

    `largest_loads` has the usable load and the placement of the shown positions; without them there is no picture of
    the pair and of the pressures.
    """
    parts: list[Part] = []
    if largest_loads:
        load, placement = largest_loads[len(largest_loads) // 2]
        shift = load.case.lateral_shift_mm
        words = (
            f"Section through the first contact point at {shift:+z.2f} mm, the middle position of those shown below."
        )
        parts.append(Picture(content=render_svg(pair_figure(placement)), words=words))
    ladder_rows = [
        build_cell_row(position.cells[-1], position.placement)
        | {"rail": applicability_map.case.rail, "wheel": applicability_map.case.wheel}
        for position in applicability_map.positions
        if position.cells
    ]
    if (ladder := ladder_figure(ladder_rows)) is not None:
        words = "Ladder at the largest load: the change by the shape of the gap, then the change by the finite bodies."
        parts += [Heading("Shape of the gap, or finite bodies?"), Picture(content=render_svg(ladder), words=words)]
    if largest_loads:
        words = f"Pressure at the largest load of each position. {_SMALL_PICTURE_WORDS}"
        parts += [
            Heading("Pressure"),
            Picture(content=render_image(patches_figure(largest_loads)), words=words, width=2400),
        ]
    return parts


def _build_limits_table(applicability_map: ApplicabilityMap) -> Table:
    """Table of load limits, with a row for each shift.

    The columns are the shift in mm, the limit of the verdict on the pressure, and a limit for each feature's verdict
    that the case requests. Limits are texts in kN.
    """
    feature_verdicts = [
        name for name, verdict in load_offers("MAPS").items() if verdict.criterion(applicability_map.case)
    ]
    views = [
        build_verdict_view(applicability_map),
        *(build_feature_view(applicability_map, name) for name in feature_verdicts),
    ]
    headings = ("pressure", *(load_offers("MAPS")[name].short for name in feature_verdicts))
    rows = [
        TableRow(cells=[f"{columns[0].shift_mm:+z.2f}", *(column.limit for column in columns)])
        for columns in zip(*(view.columns for view in views), strict=True)
    ]
    return Table(title="", columns=make_columns("shift mm", *headings, texts=headings), rows=rows)


def _build_cells_table(records: Sequence[TableRecord]) -> Table:
    """Table of cells with the verdict and the cheapest theory that holds."""
    words = ("decided by", "cheapest theory that holds")
    headings = ("shift mm", "load kN", "Hertz", "limit utilisation", words[0], "unknowns", words[1])
    rows = []
    for record in records:
        answer = record["verdict"]["answer"] if is_usable_status(record) else "failed"
        cells = [f"{record['lateral_shift_mm']:+z.2f}", f"{record['load_N'] / 1e3:g}", answer]
        cells += _describe_load(record) if "verdict" in record else ["-", record["status"], "-", ""]
        rows.append(TableRow(cells=cells, tone="fails" if answer == "FAILS" else "plain"))
    return Table(title="", columns=make_columns(*headings, texts=words, answers=("Hertz",)), rows=rows)


def _describe_load(record: TableRecord) -> list[str]:
    """Table cells of a solved cell by its record."""
    unknowns = str(sum(record["solver"]["degrees_of_freedom"].values()))
    utilisation = record["verdict"]["limit_utilisation"]
    return [f"{utilisation:.2f}", verdict_reason(record), unknowns, cheapest_words(record)]


_ANSWERS_WITHOUT_THEORY = {
    "UNRESOLVED": "unresolved whether a cheaper theory holds",
    "none": "no theory holds",
    "failed": "could not be solved",
}

_SHARE_COLUMNS = (
    text_column("theory", lambda share: share.get("words") or _ANSWERS_WITHOUT_THEORY[share["theory"]], wraps=True),
    text_column("cost", "cost", wraps=True),
    number_column("cheapest\ncells", "cheapest_cells", "{:.0f}"),
    number_column("cheapest\n%", "cheapest_percent", "{:.0f}"),
    number_column("out of\nrange", "out_of_range_cells", "{:.0f}"),
    number_column("largest\nlimit\nutilisation", "largest_limit_utilisation", "{:.2f}"),
    number_column("holds\n%", "holds_percent", "{:.0f}"),
)


def build_shares_table(shares: Sequence[TableRecord]) -> Table:
    """Table of the cells in which each theory holds or is the cheapest.

    Parameters
    ----------
    shares
        Records of the theories.

    Returns
    -------
    Table
        Table without the theories that were judged in no cell.
    """
    occurring_shares = [share for share in shares if share["cheapest_cells"] or "cost" in share]
    return make_table(
        "Cheapest theory that holds, and cells in which each theory holds", _SHARE_COLUMNS, occurring_shares
    )
