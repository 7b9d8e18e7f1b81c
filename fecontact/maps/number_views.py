"""Views of the deviation of Hertz in a quantity, in percent."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from fecontact.inputs.texts import count_text
from fecontact.judging.readings import NumberReading, NumberReadingView
from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
from fecontact.maps.verdict_views import list_solved_loads_kN
from fecontact.maps.view import Band, CellView, ColumnView, MapView
from fecontact.outputs.style import ANSWER_COLOURS

# Deviations (%) at which the colour changes, and the colours from the largest deviation to the smallest: orange for too
# high and blue for too low, both distinct for readers who do not see red or green.
_STEPS_PERCENT = (2.0, 5.0, 10.0, 20.0)
_HIGH_COLOURS = ("#fee0b6", "#fdb863", "#e08214", "#b35806")
_LOW_COLOURS = ("#d8daeb", "#b2abd2", "#8073ac", "#5e4fa2")
_SMALL, _SMALL_COLOUR = "small", "#d9f0d3"
_WITHOUT, _WITHOUT_COLOUR = "without", "#ffffff"
_LOST = "failed"


def build_number_view(applicability_map: ApplicabilityMap, number: NumberReadingView) -> MapView:
    """View of the deviation of Hertz in a quantity of a feature.

    The colour of a cell reaches half way to the neighbouring loads: nothing was solved between them.

    Parameters
    ----------
    applicability_map
        Map.
    number
        Quantity of the feature.

    Returns
    -------
    MapView
        View.
    """
    columns = tuple(_build_column(position, number) for position in applicability_map.positions)
    cells = [cell for column in columns for cell in column.cells]
    drawn_answers = {cell.answer for cell in cells} | {answer for column in columns for _, _, answer in column.bands}
    scale = {name: (colour, words) for name, colour, words in _list_scale()}
    scale |= {_WITHOUT: (_WITHOUT_COLOUR, number.without), _LOST: (ANSWER_COLOURS[_LOST], number.lost)}
    has_brackets = any(cell.text.startswith("(") for cell in cells)
    criterion = number.criterion(applicability_map.case) or ""
    small_words, unknown_words = "smaller than its uncertainty", "its uncertainty is unknown"
    has_unknown = any(cell.text.endswith("?") for cell in cells)
    marks = {_LOST: ("$!$", number.lost), _WITHOUT: ("$-$", number.without)}
    return MapView(
        case=applicability_map.case,
        loads_N=applicability_map.loads_N,
        columns=columns,
        title=number.title,
        criterion=criterion,
        preposition="at",
        number_example="+7",
        is_compact=True,
        colours={name: colour for name, (colour, _) in scale.items()},
        answers=[(name, words) for name, (_, words) in scale.items() if name in drawn_answers],
        marks=[
            *[("$(1)$", small_words)] * has_brackets,
            *[("$?$", unknown_words)] * has_unknown,
            *(marks[name] for name in marks if name in drawn_answers),
        ],
        number="deviation of Hertz in %;\ncolour of the nearest load",
        notes=[
            f"deviation of Hertz in {number.name} from FE in %, at {criterion}",
            *[f"( ) {small_words}"] * has_brackets,
            *[f"? {unknown_words}"] * has_unknown,
            *(f"{mark.strip('$')} {words}" for name, (mark, words) in marks.items() if name in drawn_answers),
        ],
    )


def write_number_sentences(applicability_map: ApplicabilityMap, number: NumberReadingView) -> list[str]:
    """Sentence on the largest deviations of Hertz in a quantity of a feature.

    Parameters
    ----------
    applicability_map
        Map.
    number
        Quantity of the feature.

    Returns
    -------
    list of str
        Sentences; empty if the map has no usable cell with the quantity.
    """
    readings = [(cell, reading) for cell in applicability_map.cells if (reading := _read(cell, number)) is not None]
    values = [
        (reading.deviation_percent, reading, cell)
        for cell, reading in readings
        if reading.deviation_percent is not None
    ]
    if not values:
        return [f"{number.name} has no deviation: {number.without}."] if readings else []
    cells, criterion = count_text(len(values), "cell"), number.criterion(applicability_map.case)
    certain = [value for value in values if not _is_uncertain(value[1])]
    if not certain:
        return [f"By Hertz {number.name} has no deviation beyond its uncertainty in {cells} ({criterion})."]
    phrases = [
        f"up to {_format_reading(reading)} too {direction} at {cell.lateral_shift_mm:g} mm and {cell.load_kN:g} kN"
        for direction, (value, reading, cell) in (
            ("high", max(certain, key=lambda deviation: deviation[0])),
            ("low", min(certain, key=lambda deviation: deviation[0])),
        )
        if (value > 0.0) == (direction == "high")
    ]
    uncertain = len(values) - len(certain)
    end = f"; in {uncertain} of {cells} the deviation is smaller than its uncertainty" if uncertain else ""
    return [f"By Hertz {number.name} is {', and '.join(phrases)}{end} ({criterion})."]


def _format_reading(reading: NumberReading) -> str:
    """Size of a deviation with its uncertainty, in percent."""
    uncertainty = reading.uncertainty_percent
    uncertainty_text = "" if uncertainty is None else f" ± {uncertainty:.1f}"
    return f"{abs(reading.deviation_percent or 0.0):.1f}{uncertainty_text} %"


def _is_uncertain(reading: NumberReading) -> bool:
    """Whether a deviation is not larger than its uncertainty."""
    deviation, uncertainty = reading.deviation_percent, reading.uncertainty_percent
    return deviation is not None and uncertainty is not None and abs(deviation) <= uncertainty


def _list_scale() -> Iterator[tuple[str, str, str]]:
    """Yield name, colour and words of each step of the scale."""
    ranges = [
        *(f"{low:g} to {high:g} %" for low, high in pairwise(_STEPS_PERCENT)),
        f"more than {_STEPS_PERCENT[-1]:g} %",
    ]
    for step in reversed(range(len(ranges))):
        yield f"high {step}", _HIGH_COLOURS[step], f"{ranges[step]} too high"
    yield _SMALL, _SMALL_COLOUR, f"within {_STEPS_PERCENT[0]:g} %"
    for step, text in enumerate(ranges):
        yield f"low {step}", _LOW_COLOURS[step], f"{text} too low"


def _choose_step(deviation_percent: float) -> str:
    """Name of the step of the scale for a deviation in percent."""
    step = sum(abs(deviation_percent) > limit for limit in _STEPS_PERCENT) - 1
    return _SMALL if step < 0 else f"{'high' if deviation_percent > 0.0 else 'low'} {step}"


def _read(cell: MapCell, number: NumberReadingView) -> NumberReading | None:
    """Deviation of a cell; None for an unusable cell."""
    return number.read_deviation(cell.usable) if cell.usable else None


def _build_column(position: MapPosition, number: NumberReadingView) -> ColumnView:
    """Column of deviations at a position."""
    cells = tuple(_build_cell(cell, number) for cell in position.cells)
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=_list_bands(cells) if any(cell.answer != _LOST for cell in cells) else (),
        solved_kN=list_solved_loads_kN(position),
        cells=cells,
    )


def _build_cell(cell: MapCell, number: NumberReadingView) -> CellView:
    """View of a cell with its deviation in percent."""
    reading = _read(cell, number)
    if reading is None:
        return CellView(load_kN=cell.load_kN, answer=_LOST, text="!", letter="!")
    if reading.deviation_percent is None:
        return CellView(load_kN=cell.load_kN, answer=_WITHOUT, text="-", letter="-")
    texts = [f"{reading.deviation_percent:+z.{decimals}f}" for decimals in (0, 1)]
    if reading.uncertainty_percent is None:
        texts = [f"{text}?" for text in texts]
    elif _is_uncertain(reading):
        texts = [f"({text})" for text in texts]
    drawn_text, printed_text = texts
    return CellView(
        load_kN=cell.load_kN,
        answer=_choose_step(reading.deviation_percent),
        text=drawn_text,
        letter="",
        printed=printed_text,
    )


def _list_bands(cells: tuple[CellView, ...]) -> tuple[Band, ...]:
    """Bands of equal answers, which reach half way to the neighbouring loads (kN)."""
    middles = [0.5 * (lower.load_kN + upper.load_kN) for lower, upper in pairwise(cells)]
    edges = [cells[0].load_kN, *middles, cells[-1].load_kN]
    bands: list[Band] = []
    for cell, (low, high) in zip(cells, pairwise(edges), strict=True):
        start = bands.pop()[0] if bands and bands[-1][2] == cell.answer else low
        bands.append((start, high, cell.answer))
    return tuple(bands)
