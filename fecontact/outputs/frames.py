"""Conversion of results to pandas tables and xarray data sets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, cast

from fecontact.errors import InputError
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import HasRows, rows
from fecontact.outputs.table_grid import TABLE_AXES, arrange_table, is_contact_table
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    import pandas
    import xarray


def to_dataframe(results: CaseResult | HasRows | Iterable[CaseResult]) -> pandas.DataFrame:
    """Convert results to a pandas table.

    Parameters
    ----------
    results
        One case, several cases, or results with a method `rows`, such as a map.

    Returns
    -------
    pandas.DataFrame
        One line per case or cell. The names of the columns contain the units.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> result = fecontact.solve(fecontact.Case(**pair, resolution="quick", refine="never"))
    >>> fecontact.to_dataframe([result])[["load_kN", "verdict_answer"]].values.tolist()
    [[100.0, 'HOLDS']]
    """
    import pandas

    return pandas.DataFrame(rows(results))


def to_xarray(results: CaseResult | HasRows | Iterable[CaseResult] | Sequence[Record]) -> xarray.Dataset:
    """Convert results to an xarray data set.

    Parameters
    ----------
    results
        One case, several cases, a map, or the rows of a contact table.

    Returns
    -------
    xarray.Dataset
        For a case: pressure (MPa) and gap (mm) over `x_mm` and `s_mm`, on the pressure nodes of the whole contact. For
        a map: each column of its table over `lateral_shift_mm` and `load_kN`, for several yaws also over `yaw_mrad`.
        For a contact table: each column over `lateral_shift_mm`, `yaw_mrad` and `load_kN`, with `long_name` and
        `units`. For several cases: each column over `case`.

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
        dimensions = ("x_mm", "s_mm")
        fields = {"pressure_MPa": (dimensions, results.pressure_MPa), "gap_mm": (dimensions, results.gap_mm)}
        return xarray.Dataset(fields, {"x_mm": results.grid.x_mm, "s_mm": results.grid.s_mm})
    if is_contact_table(results):
        grid = arrange_table(cast("Sequence[Record]", results))
        return xarray.Dataset(
            {name: (TABLE_AXES, column.values, column.attributes) for name, column in grid.variables.items()},
            {name: (name, axis.values, axis.attributes) for name, axis in grid.axes.items()},
            grid.attributes,
        )
    results = cast("CaseResult | HasRows | Iterable[CaseResult]", results)
    frame, coordinates = to_dataframe(results), ["lateral_shift_mm", "load_kN"]
    if isinstance(results, HasRows) and frame.duplicated(coordinates).any():
        # maps of several yaws
        coordinates = [*TABLE_AXES]
    frame = frame.set_index(coordinates) if isinstance(results, HasRows) else frame.rename_axis("case")
    return xarray.Dataset.from_dataframe(frame)
