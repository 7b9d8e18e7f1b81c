"""Results drawn by matplotlib, into given axes or a new figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from fecontact.errors import InputError
from fecontact.outputs.figures.case import PressureFields, case_inches, draw_case, draw_pressure
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["case"]

Field = Literal["finite elements", "Hertz", "finite elements minus Hertz"]


def case(result: CaseResult, axes: Axes | None = None, *, field: Field = "finite elements") -> Figure | SubFigure:
    """Draw a result: the whole picture, as in `case.png`, or one of its maps into given axes.

    Parameters
    ----------
    axes
        Axes for the map of one field; if not given, a new figure gets all maps, cuts and measures.
    field
        Pressure of `finite elements` (bodies that yield if there is a yield stress), of `Hertz`, or `finite elements
        minus Hertz`; for given axes.

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
    # by pyplot, so that pyplot.show() finds the figure
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=case_inches(fields))
    draw_case(figure, result.load, result.placement, fields)
    return figure
