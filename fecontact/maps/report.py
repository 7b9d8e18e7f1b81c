"""Reports of a map, on the terminal and as `report.html`: where Hertz holds, up to which load, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TypeAlias

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import is_usable_status
from fecontact.files import write_text
from fecontact.judging.judged_load import JudgedLoad
from fecontact.maps.measure_views import list_verdict_measures
from fecontact.maps.model import ApplicabilityMap, build_cell_row
from fecontact.maps.picture import cell_boxes, draw_map
from fecontact.maps.sentences import capitalise
from fecontact.maps.telling import build_cell_record, count_theory_shares
from fecontact.maps.theory_views import find_judged_laws
from fecontact.maps.verdict_views import CAUSE_LETTERS, build_feature_view, build_verdict_view
from fecontact.maps.view import MapView
from fecontact.maps.views import (
    build_map_view,
    build_views,
    format_map,
    write_map_answer,
    write_number_answer,
    write_yaw_answer,
)
from fecontact.maps.yaw_map import MapResult, YawMap, find_yaw_changes, format_yaw, join_yaws
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.case_words import other_wheel_hint, roll_words
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.figures.report_pictures import ladder_figure, patches_figure, small_figure
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.parts import Details, Heading, Lead, Part, Picture, Spot
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.report_words import answer_words, lead_style, question_text
from fecontact.outputs.study_report import REPORT_FILE, closing_parts
from fecontact.outputs.style import encode_webp, render_image, render_page, render_svg
from fecontact.outputs.tables import Table, TableRecord, TableRow, make_columns, make_table, number_column, text_column
from fecontact.outputs.verdict_words import cheapest_words, utilisation_text, verdict_reason
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


def write_result_report(
    map_result: MapResult, out: Path, *, theory: str = HERTZ, pictures: Mapping[float, Pictures] | None = None
) -> Path:
    """Write `report.html` of a map, or of the maps of several yaws.

    Parameters
    ----------
    map_result
        Map, or maps of several yaws.
    out
        Folder of the map.
    theory
        Further theory of the pressure with a picture.
    pictures
        Pictures of cells that were drawn before, by the yaw in rad.

    Returns
    -------
    Path
        File of the report.
    """
    if isinstance(map_result, YawMap):
        return write_yaw_report(map_result, out, theory=theory, pictures=pictures)
    return write_map_report(map_result, out, theory=theory, pictures=(pictures or {}).get(map_result.case.yaw_rad))


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
    page = _MapPage.build_page(applicability_map, theory, pictures or {})
    parts: list[Part] = [
        Lead(
            answer_words(page.verdicts, "cells"),
            lead_style(page.verdicts),
            f"{pair}; {_describe_cells([applicability_map])}",
        ),
        " ".join(write_map_answer(applicability_map, "pressure")),
        question_text(pair, case.criteria),
        _describe_wheel(case),
        *page.build_parts(count_fitting_pictures(page.map_pictures, len(page.cells))),
        *_close_report([applicability_map]),
    ]
    return write_text(out / REPORT_FILE, render_page(f"Where Hertz holds: {pair}", parts))


def write_yaw_report(
    yaw_map: YawMap, out: Path, *, theory: str = HERTZ, pictures: Mapping[float, Pictures] | None = None
) -> Path:
    """Write `report.html` of the maps of several yaws.

    Changes with the yaw come first, then a section for each yaw.

    Parameters
    ----------
    yaw_map
        Maps of several yaws.
    out
        Folder of the map.
    theory
        Further theory of the pressure with a picture.
    pictures
        Pictures of cells that were drawn before, by the yaw in rad.

    Returns
    -------
    Path
        File of the report.
    """
    pair, maps = pair_words(yaw_map.case, " and "), [single_map for single_map in yaw_map.maps if single_map.positions]
    pages: list[_MapPage] = []
    for single_map in maps:
        first_number, known_pictures = sum(len(page.cells) for page in pages), pictures or {}
        pages.append(
            _MapPage.build_page(
                single_map,
                theory,
                known_pictures.get(single_map.case.yaw_rad, {}),
                first_number=first_number,
                at_yaw=True,
            )
        )
    verdicts = [verdict for page in pages for verdict in page.verdicts]
    map_pictures = [picture for page in pages for picture in page.map_pictures]
    picture_count = count_fitting_pictures(map_pictures, len(verdicts)) // len(pages)
    changes = write_yaw_answer(YawMap(maps=tuple(maps)), "pressure")
    parts: list[Part] = [
        Lead(
            answer_words(verdicts, "cells"),
            lead_style(verdicts),
            f"{pair}; {_describe_cells(maps)}, yaw {join_yaws(yaw_map.yaws_mrad)}",
        ),
        " ".join(changes or write_map_answer(maps[0], "pressure")),
        question_text(pair, yaw_map.case.criteria),
        Heading("Verdicts that change with the yaw"),
        _build_changes_table(maps),
        Heading("Load limits at each yaw"),
        _build_yaw_limits_table(maps),
    ]
    for single_map, page in zip(maps, pages, strict=True):
        parts += [
            Heading(f"Yaw {format_yaw(single_map.yaw_mrad)} mrad"),
            " ".join(write_map_answer(single_map, "pressure")),
            f"{answer_words(page.verdicts, 'cells')}.",
            _describe_wheel(single_map.case),
            *page.build_parts(picture_count),
        ]
    parts += _close_report(maps)
    return write_text(out / REPORT_FILE, render_page(f"Where Hertz holds at each yaw: {pair}", parts))


def _describe_cells(maps: Sequence[ApplicabilityMap]) -> str:
    """Text for the range of shifts and loads of maps."""
    cells = [cell for single_map in maps for cell in single_map.cells]
    shifts, loads = [cell.lateral_shift_mm for cell in cells], [cell.load_N / 1e3 for cell in cells]
    return f"shifts {min(shifts):+z.2f} to {max(shifts):+z.2f} mm, loads {min(loads):g} to {max(loads):g} kN"


def _close_report(maps: Sequence[ApplicabilityMap]) -> list[Part]:
    """Last parts of a report: terms and versions."""
    return closing_parts(
        THEORIES,
        *((letter, cause) for cause, letter in CAUSE_LETTERS.items()),
        laws=any(find_judged_laws(single_map) for single_map in maps),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _MapPage:
    """Section of a report on a map of a single yaw.

    Attributes
    ----------
    applicability_map
        Map.
    records, cells
        Record of each cell, and its parts by the name of its place on the page.
    map_pictures, theory_index
        Pictures of the map, and number of pictures before the picture of the cheapest theory.
    pictures
        Pictures of cells that were drawn before.
    """

    applicability_map: ApplicabilityMap
    records: Sequence[TableRecord]
    cells: Mapping[str, Sequence[Part]]
    map_pictures: Sequence[Picture]
    theory_index: int
    pictures: Pictures

    @classmethod
    def build_page(
        cls,
        applicability_map: ApplicabilityMap,
        theory: str,
        pictures: Pictures,
        *,
        first_number: int = 0,
        at_yaw: bool = False,
    ) -> _MapPage:
        """Section of a map, with its pictures drawn.

        Parameters
        ----------
        applicability_map
            Map.
        theory
            Further theory of the pressure with a picture.
        pictures
            Pictures of cells that were drawn before.
        first_number
            Number of cells that the page has before this section.
        at_yaw
            Whether the titles of pictures have the yaw also if it is zero.

        Returns
        -------
        _MapPage
            Section.
        """
        records = [
            build_cell_record(cell) | ({} if cell.judged is None else {"case": case_inputs(cell.judged.case)})
            for cell in applicability_map.cells
        ]
        cells = {
            f"cell-{number}": _build_cell_parts(record) for number, record in enumerate(records, start=first_number + 1)
        }
        views = build_views(applicability_map, theory, at_yaw=at_yaw)
        return cls(
            applicability_map=applicability_map,
            records=records,
            cells=cells,
            map_pictures=[_draw_map_picture(view, cells) for view in views.values()],
            theory_index=list(views).index("theory"),
            pictures=pictures,
        )

    @property
    def verdicts(self) -> list[str]:
        """Verdict of each cell; `failed` without a usable result."""
        return [cell.verdict if cell.usable else "failed" for cell in self.applicability_map.cells]

    def build_parts(self, picture_count: int) -> list[Part]:
        """Parts of the section: pictures of the map, tables, details of the cells.

        Parameters
        ----------
        picture_count
            Largest number of pictures of cells.

        Returns
        -------
        list of Part
            Parts.
        """
        applicability_map = self.applicability_map
        return [
            *write_number_answer(applicability_map),
            *self.map_pictures[: self.theory_index],
            Heading("If not Hertz, what?"),
            " ".join(write_map_answer(applicability_map, "theory")),
            *self.map_pictures[self.theory_index :],
            build_shares_table(count_theory_shares(applicability_map)),
            Heading("Load limits"),
            _build_limits_table(applicability_map),
            Heading("The pair"),
            *_build_pictures(applicability_map, _choose_largest_loads(applicability_map)),
            Heading("Cells"),
            _build_cells_table(self.records),
            *_build_details(applicability_map, self.cells, self.pictures, picture_count=picture_count),
        ]


def _build_changes_table(maps: Sequence[ApplicabilityMap]) -> Table | str:
    """Table of the verdicts that change with the yaw.

    The table has a column for each yaw, and the text "None." takes its place without a change."""
    verdicts = {
        single_map.yaw_mrad: {
            (cell.lateral_shift_mm, cell.load_N): cell.verdict if cell.usable else "failed" for cell in single_map.cells
        }
        for single_map in maps
    }
    changes = find_yaw_changes(verdicts)
    if not changes:
        return "None."
    headings = [f"{format_yaw(yaw_mrad)} mrad" for yaw_mrad in verdicts]
    rows = [
        TableRow(
            cells=[f"{change.lateral_shift_mm:+z.2f}", f"{change.load_N / 1e3:g}", *change.answers.values()],
            tone="fails" if "FAILS" in change.answers.values() else "plain",
        )
        for change in changes
    ]
    return Table(title="", columns=make_columns("shift mm", "load kN", *headings, answers=headings), rows=rows)


def _build_yaw_limits_table(maps: Sequence[ApplicabilityMap]) -> Table:
    """Table of the load limits of Hertz at each shift and yaw."""
    limits = [
        {column.shift_mm: column.limit for column in build_map_view(single_map, "pressure").columns}
        for single_map in maps
    ]
    headings = [f"{format_yaw(single_map.yaw_mrad)} mrad" for single_map in maps]
    rows = [
        TableRow(cells=[f"{shift:+z.2f}", *(limit.get(shift, "-") for limit in limits)])
        for shift in sorted(set().union(*limits))
    ]
    return Table(title="", columns=make_columns("shift mm", *headings, texts=headings), rows=rows)


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


def format_map_lines(map_result: MapResult, measure: str, theory: str, *, width: int | None) -> Iterator[Table | str]:
    """Lines of a map on the terminal, by a measure.

    The answer in sentences is first, then the map. For the measure `theory` a table with the share of each theory
    follows. For several yaws, the cells in which the answer changes with the yaw come first, then the lines of each
    yaw.

    Parameters
    ----------
    map_result
        Map, or maps of several yaws.
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
    if isinstance(map_result, YawMap):
        for sentence in write_yaw_answer(map_result, measure, theory):
            yield fill(sentence, width or DEFAULT_TEXT_WIDTH)
        for single_map in map_result.maps:
            yield " "
            yield f"Yaw {format_yaw(single_map.yaw_mrad)} mrad:"
            yield from format_map_lines(single_map, measure, theory, width=width)
        return
    sentences = dict.fromkeys((*write_map_answer(map_result, measure, theory), *write_number_answer(map_result)))
    yield from (fill(sentence, width or DEFAULT_TEXT_WIDTH) for sentence in sentences)
    yield " "
    yield format_map(map_result, measure, theory=theory, width=width)
    if measure == "theory":
        yield build_shares_table(count_theory_shares(map_result))


def _describe_wheel(case: Case) -> str:
    hint = other_wheel_hint(case)
    return f"The {case.side} wheel, {roll_words(case)}.{hint and f' {capitalise(hint)}.'}"


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
    verdict_measures = list_verdict_measures(applicability_map.case)
    feature_verdicts = [name for name, verdict in verdict_measures.items() if verdict.criterion(applicability_map.case)]
    views = [
        build_verdict_view(applicability_map),
        *(build_feature_view(applicability_map, name) for name in feature_verdicts),
    ]
    headings = ("pressure", *(verdict_measures[name].short for name in feature_verdicts))
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
    return [utilisation_text(utilisation), verdict_reason(record), unknowns, cheapest_words(record)]


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
