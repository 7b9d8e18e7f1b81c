"""Results drawn by matplotlib, into given axes or a new figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, get_args

from fecontact.errors import InputError
from fecontact.outputs.figures.case import case_inches, draw_case
from fecontact.outputs.figures.pressure_maps import PressureFields, draw_pressure
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["case", "map"]

Field = Literal["finite elements", "Hertz", "Hertz minus finite elements"]


def case(result: CaseResult, axes: Axes | None = None, *, field: Field = "finite elements") -> Figure | SubFigure:
    """Draw a result: the whole picture, as in `case.png`, or one of its maps into given axes.

    Parameters
    ----------
    axes
        Axes for the map of one field; if not given, a new figure gets all maps, cuts and measures.
    field
        Pressure of `finite elements` (bodies that yield if there is a yield stress), of `Hertz`, or `Hertz minus finite
        elements`, as the verdict's deviations; for given axes.

    Returns
    -------
    Figure
        The figure that was drawn into, to be shown or saved.

    Raises
    ------
    InputError
        If there is no such field.
    """
    if field not in get_args(Field):
        raise InputError(f"field {field!r}; allowed: {', '.join(get_args(Field))}")
    fields = PressureFields.of(result.load)
    if axes is not None:
        draw_pressure(axes, result.load, field, fields)
        return axes.figure
    figure = _shown(*case_inches(fields))
    draw_case(figure, result.load, result.placement, fields)
    return figure


def map(made: Any, *, measure: str = "pressure", theory: str = "hertz") -> Figure:
    """Draw a map over lateral shift and load, as in `map.png`.

    Parameters
    ----------
    made
        An `ApplicabilityMap`, which `fecontact.load` gives of the folder of a map.
    measure
        Where the `pressure` holds, the cheapest `theory` that holds, or what features judge, such as the `force`.
    theory
        Theory of the pressure, for the measure `pressure`.

    Raises
    ------
    InputError
        For a measure or a theory that there is not.
    """
    from fecontact.maps.files import figure_of

    return figure_of(made, measure, theory, _shown)


def _shown(width: float, height: float) -> Figure:
    """An empty figure that a script shows by pyplot.show(), and a notebook once, as the value of its cell."""
    from matplotlib import get_backend, pyplot

    figure = pyplot.figure(figsize=(width, height), layout="constrained")
    if "inline" in get_backend():
        # a notebook draws all open figures of pyplot below a cell, beside the value of the cell
        pyplot.close(figure)
    return figure


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
