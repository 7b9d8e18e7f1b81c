"""Results as tables of pandas and data sets of xarray."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from fecontact.errors import InputError
from fecontact.outputs.records.results import Rowed, rows
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    import pandas
    import xarray


def to_dataframe(results: CaseResult | Rowed | Iterable[CaseResult]) -> pandas.DataFrame:
    """Results as a table of pandas: a line for each case or cell, with units in the names of the columns."""
    import pandas

    return pandas.DataFrame(rows(results))


def to_xarray(results: CaseResult | Rowed | Iterable[CaseResult]) -> xarray.Dataset:
    """Results as a data set of xarray.

    Parameters
    ----------
    results
        Of a case: pressure and gap over `x_mm` and `s_mm`, the pressure nodes of the whole contact. Of a map: each
        column of its table over `lateral_shift_mm` and `load_kN`. Of several cases: each column over `case`.

    Raises
    ------
    InputError
        If xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise InputError("to_xarray needs xarray; install it: python -m pip install 'fecontact[xarray]'") from error
    if isinstance(results, CaseResult):
        dims = ("x_mm", "s_mm")
        fields = {"pressure_MPa": (dims, results.pressure_MPa), "gap_mm": (dims, results.gap_mm)}
        return xarray.Dataset(fields, {"x_mm": results.grid.x_mm, "s_mm": results.grid.s_mm})
    frame, place = to_dataframe(results), ["lateral_shift_mm", "load_kN"]
    frame = frame.set_index(place) if isinstance(results, Rowed) else frame.rename_axis("case")
    return xarray.Dataset.from_dataframe(frame)
