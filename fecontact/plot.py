"""Pictures of results by matplotlib, in given axes or in a new figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, get_args

from fecontact.errors import InputError
from fecontact.outputs.figures.case import case_inches, draw_case
from fecontact.outputs.figures.pressure_maps import PressureFields, draw_pressure
from fecontact.outputs.records.results import lobe_records, result_record
from fecontact.outputs.style import show_text_literally
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["case", "map"]

Field = Literal["finite elements", "Hertz", "Hertz minus finite elements"]


def case(result: CaseResult, axes: Axes | None = None, *, field: Field = "finite elements") -> Figure | SubFigure:
    """Draw the whole picture of a result, or a single field into given axes.

    The whole picture is equal to `case.png`.

    Parameters
    ----------
    result
        Result of a case.
    axes
        Axes for the map of a single field. Without axes, a new figure gets all maps, cuts and measures.
    field
        Field for given axes: pressure of `finite elements` (of yielding bodies if there is a yield stress), of `Hertz`,
        or `Hertz minus finite elements`, from which the deviations of the verdict follow.

    Returns
    -------
    Figure
        Figure with the picture, to be shown or saved.

    Raises
    ------
    InputError
        If the field does not exist.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> result = fecontact.solve(fecontact.Case(**pair, resolution="quick", refine="never"))
    >>> figure = fecontact.plot.case(result, field="Hertz")
    >>> len(figure.axes) > 1
    True
    """
    if field not in get_args(Field):
        raise InputError(f"field is {field!r}; allowed: {', '.join(get_args(Field))}")
    fields = PressureFields.of(result.load)
    if axes is not None:
        draw_pressure(axes, field, fields, lobe_records(result.load))
        show_text_literally(axes)
        return axes.figure
    figure = _make_figure(*case_inches(fields))
    draw_case(figure, result_record(result), result.placement, fields)
    show_text_literally(figure)
    return figure


def map(applicability_map: Any, *, measure: str = "pressure", theory: str = "hertz") -> Figure:
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

    Returns
    -------
    Figure
        Figure with the picture, to be shown or saved.

    Raises
    ------
    InputError
        If the measure or the theory does not exist, and for the maps of several yaws.

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
    from fecontact.maps.files import draw_map_by_measure

    figure = draw_map_by_measure(applicability_map, measure, theory, _make_figure)
    show_text_literally(figure)
    return figure


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
