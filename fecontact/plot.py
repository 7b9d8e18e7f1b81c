"""Pictures of results by matplotlib, in given axes or in a new figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fecontact.errors import InputError
from fecontact.outputs.figures.case import case_inches, draw_case
from fecontact.outputs.figures.paper import (
    Field,
    draw_field,
    draw_paper_case,
    measure_paper_case,
    refuse_width,
)
from fecontact.outputs.figures.pressure_maps import PressureFields
from fecontact.outputs.records.results import result_record
from fecontact.outputs.style import MM_PER_INCH, show_text_literally
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["case", "map"]

# Widths of a single field and of both columns of a page in mm, if no width is given.
_FIELD_MM, _PAGE_MM = 127.0, 170.0


def case(
    result: CaseResult,
    axes: Axes | None = None,
    *,
    field: Field | None = None,
    width_mm: float | None = None,
    title: bool = True,
    numbers: bool = True,
) -> Figure | SubFigure:
    """Draw a result: the whole picture, a picture for a paper, or a single field.

    Fonts and lines follow matplotlib's `rcParams`. A saved figure can be PNG, SVG or PDF.

    Parameters
    ----------
    result
        Result of a case.
    axes
        Axes for a single field. Without axes, a new figure is made.
    field
        Single field: pressure of `finite elements` (of yielding bodies if there is a yield stress), of `Hertz`, or
        `Hertz minus finite elements`, from which the deviations of the verdict follow; `lateral cut` or
        `longitudinal cut` through the peak. If not given, axes have the finite elements, and a figure has all fields.
    width_mm
        Width of a new figure in mm, such as 85 or 170 in a paper. If not given, the whole picture is equal to
        `case.png`.
    title
        Whether a single field has a title, and whether a picture of several fields has the case and the reason of the
        verdict above it. Fields of such a picture keep their titles, because these name them.
    numbers
        Whether the lobes have numbers.

    Returns
    -------
    Figure
        Figure with the picture, to be shown or saved.

    Raises
    ------
    InputError
        If the field does not exist, or if the width is outside its range or given with axes.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> result = fecontact.solve(fecontact.Case(**pair, resolution="quick", refine="never"))
    >>> figure = fecontact.plot.case(result, field="lateral cut", width_mm=85)
    >>> len(figure.axes)
    1
    """
    _refuse_sizes(axes, width_mm)
    fields, record = PressureFields.of(result.load), result_record(result)
    if axes is not None or field is not None:
        if axes is None:
            width = (width_mm or _FIELD_MM) / MM_PER_INCH
            axes = _make_figure(width, 0.75 * width).add_subplot()
        draw_field(axes, field or "finite elements", record, result.placement, fields, title=title, numbers=numbers)
        show_text_literally(axes)
        return axes.figure
    if width_mm is None and title and numbers:
        figure = _make_figure(*case_inches(fields))
        draw_case(figure, record, result.placement, fields)
    else:
        figure = _make_figure(*measure_paper_case(_PAGE_MM if width_mm is None else width_mm))
        draw_paper_case(figure, record, result.placement, fields, title=title, numbers=numbers)
    show_text_literally(figure)
    return figure


def map(
    applicability_map: Any,
    axes: Axes | None = None,
    *,
    measure: str = "pressure",
    theory: str = "hertz",
    width_mm: float | None = None,
    title: bool = True,
    numbers: bool = True,
) -> Figure | SubFigure:
    """Draw a map over lateral shift and load, as in `map.png`.

    Parameters
    ----------
    applicability_map
        An `ApplicabilityMap`, as `fecontact.load` returns it for the folder of a map. For a map of several yaws give
        one of its maps, such as `fecontact.load(folder).select_yaw(10)`.
    measure
        `pressure` for the verdict on a theory of the pressure, `theory` for the cheapest theory that holds, or a
        measure of a feature, such as `force` or `t_gamma`.
    theory
        Theory of the pressure, for the measure `pressure`.
    axes
        Axes for the map. Without axes, a new figure is made.
    width_mm
        Width of a new figure in mm, such as 85 or 170 in a paper.
    title
        Whether the map has a title.
    numbers
        Whether cells have numbers. Narrow columns have letters alone.

    Returns
    -------
    Figure
        Figure with the picture, to be shown or saved.

    Raises
    ------
    InputError
        If the measure or the theory does not exist, for the maps of several yaws, or if the width is outside its range
        or given with axes.

    Examples
    --------
    >>> import tempfile
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> case = fecontact.Case(**pair, resolution="quick", refine="never")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = fecontact.map(case, [0.0], [100e3], folder)
    ...     figure = fecontact.plot.map(fecontact.load(folder))
    >>> len(figure.axes) > 0
    True
    """
    from fecontact.maps.picture import draw_map_by_measure

    _refuse_sizes(axes, width_mm)
    figure = draw_map_by_measure(
        applicability_map,
        measure,
        theory,
        _make_figure,
        axes=axes,
        width_mm=width_mm,
        title=title,
        numbers=numbers,
    )
    show_text_literally(figure if axes is None else axes)
    return figure


def _refuse_sizes(axes: Axes | None, width_mm: float | None) -> None:
    """Refuse a width outside its range, and a width in addition to axes."""
    refuse_width(width_mm)
    if axes is not None and width_mm is not None:
        raise InputError("width_mm is given with axes, which have the width of their figure; leave one of them out")


def _make_figure(width: float, height: float) -> Figure:
    """Empty figure for scripts and notebooks, with a size in inches.

    A script shows the figure by pyplot.show(). A notebook shows it a single time, as the value of its cell.
    """
    from matplotlib import get_backend, pyplot

    figure = pyplot.figure(figsize=(width, height), layout="constrained")
    if "inline" in get_backend():
        # A notebook draws all open figures of pyplot below a cell, in addition to the value of the cell.
        pyplot.close(figure)
    return figure


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
