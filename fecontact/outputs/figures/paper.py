"""Pictures of a case for a page of a paper: single panels, and several panels within a width in mm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from fecontact.errors import InputError
from fecontact.outputs.case_words import case_words
from fecontact.outputs.figures.case import draw_lateral_cut, draw_rolling_cut
from fecontact.outputs.figures.pressure_maps import PressureFields, draw_pressure
from fecontact.outputs.style import MM_PER_INCH
from fecontact.outputs.tables import TableRecord
from fecontact.outputs.verdict_words import verdict_reason
from fecontact.placement.wheel_on_rail import Placement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Field = Literal["finite elements", "Hertz", "Hertz minus finite elements", "lateral cut", "longitudinal cut"]
# Widths of a picture that are allowed; a page has 85 mm for a column and 170 mm for both.
NARROWEST_MM, WIDEST_MM = 40.0, 1000.0
# From this width in mm, three fields are side by side.
_TWO_COLUMNS_MM = 120.0
_HEIGHT_TO_WIDTH = {True: 0.72, False: 1.35}


def refuse_width(width_mm: float | None) -> None:
    """Refuse a width in which no picture can be read.

    Parameters
    ----------
    width_mm
        Width of a picture in mm; None for a picture in its usual size.

    Raises
    ------
    InputError
        If the width is outside its range.
    """
    if width_mm is not None and not NARROWEST_MM <= width_mm <= WIDEST_MM:
        raise InputError(
            f"width_mm is {width_mm:g}; allowed: {NARROWEST_MM:g} to {WIDEST_MM:g}; a page usually has 85 mm"
            " for a column and 170 mm for two"
        )


def draw_field(
    ax: Axes,
    field: Field,
    record: TableRecord,
    placement: Placement,
    fields: PressureFields,
    *,
    title: bool = True,
    numbers: bool = True,
) -> None:
    """Draw a panel of a case into axes: a pressure over the surface, or a cut.

    Parameters
    ----------
    ax
        Axes to draw into.
    field
        Panel.
    record
        Record of the result.
    placement
        Placement of the load.
    fields
        Pressure fields of the load.
    title
        Whether the panel has a title.
    numbers
        Whether the lobes have numbers.

    Raises
    ------
    InputError
        If the panel does not exist.
    """
    if field not in get_args(Field):
        raise InputError(f"field is {field!r}; allowed: {', '.join(get_args(Field))}")
    if field == "lateral cut":
        draw_lateral_cut(ax, placement, fields, label=True)
    elif field == "longitudinal cut":
        draw_rolling_cut(ax, fields)
    else:
        draw_pressure(ax, field, fields, record["lobes"] if numbers else [])
    if not title:
        ax.set_title("")


def measure_paper_case(width_mm: float) -> tuple[float, float]:
    """Width and height in inches of a picture with a width in mm.

    Parameters
    ----------
    width_mm
        Width in mm.

    Returns
    -------
    tuple of float
        Width and height in inches.
    """
    width = width_mm / MM_PER_INCH
    return width, width * _HEIGHT_TO_WIDTH[width_mm >= _TWO_COLUMNS_MM]


def draw_paper_case(
    figure: Figure,
    record: TableRecord,
    placement: Placement,
    fields: PressureFields,
    *,
    title: bool,
    numbers: bool,
) -> None:
    """Draw a case into a figure of a paper.

    A wide figure has the three fields above both cuts. A narrow figure has the pressure of the finite elements above
    the lateral cut.

    Parameters
    ----------
    figure
        Figure of the size `measure_paper_case`.
    record
        Record of the result.
    placement
        Placement of the load.
    fields
        Pressure fields of the load.
    title
        Whether the figure has the case and the reason of the verdict above it.
    numbers
        Whether the lobes have numbers.
    """
    figure.set_layout_engine("constrained")
    is_wide = figure.get_figwidth() * MM_PER_INCH >= _TWO_COLUMNS_MM - 1e-6
    maps: list[Field] = ["finite elements", "Hertz", "Hertz minus finite elements"] if is_wide else ["finite elements"]
    cuts: list[Field] = ["lateral cut", "longitudinal cut"] if is_wide else ["lateral cut"]
    upper, lower = figure.subfigures(2, 1, squeeze=False).flat
    for rows, row_fields in ((upper, maps), (lower, cuts)):
        for ax, field in zip(rows.subplots(1, len(row_fields), squeeze=False).flat, row_fields, strict=True):
            draw_field(ax, field, record, placement, fields, numbers=numbers)
    if title:
        verdict_text = f"Hertz {record['verdict']['answer']}: {verdict_reason(record)}"
        figure.suptitle(f"{case_words(record['case'])}\n{verdict_text}", fontsize="medium")
