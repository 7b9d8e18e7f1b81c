"""Contact tables as arrays over lateral shift, yaw and load, for NetCDF files and xarray."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact import __version__
from fecontact.case import Case
from fecontact.errors import InputError, ProgramError
from fecontact.files import format_json, write_atomically
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.result_schema import find_unit
from fecontact.outputs.records.results import case_inputs

NETCDF_ENDING = ".nc"
"""Ending of NetCDF files."""
TABLE_AXES = ("lateral_shift_mm", "yaw_mrad", "load_kN")
"""Columns of a contact table that are its dimensions."""
# Inputs of a case that the axes replace.
_AXIS_INPUTS = ("lateral_shift_mm", "yaw_rad", "load_N")
# Units of columns whose texts are different for UDUNITS, which the CF conventions of NetCDF files use.
_UDUNITS = {
    "-": "1",
    "%": "percent",
    "mm²": "mm2",
    "N mm²": "N mm2",
    "1/mm": "mm-1",
    "N/mm": "N mm-1",
    "N/mm^1.5": "N mm-1.5",
}
_SIGNS = (
    "Left wheel: x forward, y to the field side, z up. A positive lateral shift and a positive yaw are to the left;"
    " positions on profiles are positive to the field side; contact angles are positive on the gauge side."
)


@dataclass(frozen=True, kw_only=True, eq=False)
class GridVariable:
    """Column of a contact table on its grid.

    Attributes
    ----------
    values
        Numbers with NaN for missing values, or texts; in the shape of the grid, or of an axis.
    attributes
        `long_name`, and `units` of numbers.
    """

    values: NDArray[Any]
    attributes: Mapping[str, str]


@dataclass(frozen=True, kw_only=True, eq=False)
class TableGrid:
    """Contact table on the grid of its shifts, yaws and loads.

    Attributes
    ----------
    axes
        Coordinates in ascending order, by their names in `TABLE_AXES`.
    variables
        All other columns, by their names.
    attributes
        Texts on the whole table.
    """

    axes: Mapping[str, GridVariable]
    variables: Mapping[str, GridVariable]
    attributes: Mapping[str, str] = field(default_factory=dict)


def is_contact_table(results: object) -> bool:
    """Whether a value is the list of rows of a contact table.

    Parameters
    ----------
    results
        Any value.

    Returns
    -------
    bool
        True for a list of dictionaries that all have the axes of a contact table.
    """
    return (
        isinstance(results, Sequence)
        and bool(results)
        and all(isinstance(row, Mapping) and set(TABLE_AXES) <= set(row) for row in results)
    )


def arrange_table(rows: Sequence[Record], case: Case | None = None) -> TableGrid:
    """Arrange the rows of a contact table on its grid.

    Parameters
    ----------
    rows
        Rows of a contact table.
    case
        Case of the table, for its attributes; None leaves the inputs out.

    Returns
    -------
    TableGrid
        Grid with all columns. A position without a row has missing numbers and empty texts.

    Raises
    ------
    InputError
        If there are no rows.
    """
    if not rows:
        raise InputError("the contact table has no rows; give at least one lateral shift, one yaw and one load")
    axes = {name: np.unique([float(row[name]) for row in rows]) for name in TABLE_AXES}
    places = [tuple(int(np.searchsorted(axes[name], float(row[name]))) for name in TABLE_AXES) for row in rows]
    shape = tuple(values.size for values in axes.values())
    columns = dict.fromkeys(name for row in rows for name in row if name not in TABLE_AXES)
    attributes = {
        "title": "Contact table of a wheel on a rail",
        "source": f"fecontact {__version__}, without finite elements",
        "sign_conventions": _SIGNS,
    }
    if case is not None:
        inputs = {name: value for name, value in case_inputs(case).items() if name not in _AXIS_INPUTS}
        attributes["inputs"] = format_json(inputs)
    return TableGrid(
        axes={name: GridVariable(values=values, attributes=_describe(name)) for name, values in axes.items()},
        variables={name: _arrange_column(name, rows, places, shape) for name in columns},
        attributes=attributes,
    )


def _arrange_column(
    name: str, rows: Sequence[Record], places: Sequence[tuple[int, ...]], shape: tuple[int, ...]
) -> GridVariable:
    """Column on the grid, as texts if a row has a text."""
    is_text = any(isinstance(row.get(name), str) for row in rows)
    values = np.full(shape, "" if is_text else np.nan, object if is_text else float)
    for row, place in zip(rows, places, strict=True):
        if (value := row.get(name)) is not None:
            values[place] = value
    attributes = {"long_name": find_column_meaning(name)} if is_text else _describe(name)
    return GridVariable(values=values.astype(str) if is_text else values, attributes=attributes)


def _describe(name: str) -> dict[str, str]:
    """Attributes of a column of numbers: meaning and unit."""
    unit = find_unit(name)
    return {"long_name": find_column_meaning(name), "units": _UDUNITS.get(unit, unit)}


def find_column_meaning(column: str) -> str:
    """Meaning of a column of a contact table.

    Parameters
    ----------
    column
        Name of the column.

    Returns
    -------
    str
        Meaning in words.

    Raises
    ------
    ProgramError
        If the column is not declared in `table_columns.toml`.

    Examples
    --------
    >>> from fecontact.outputs.table_grid import find_column_meaning
    >>> find_column_meaning("patch2_b_mm")
    'half-width across; patch of the strip method, numbered by decreasing force: 2'
    """
    declarations = _read_declarations()
    if column in declarations["columns"]:
        return declarations["columns"][column]
    match = re.fullmatch(r"([a-z]+)(\d*)_(\w+)", column)
    if match is not None and match[1] in declarations["places"]:
        place = declarations["places"][match[1]] + (f": {match[2]}" if match[2] else "")
        quantity = "verdict" if match[1] == "map" and column.endswith("_verdict") else match[3]
        if quantity in declarations["quantities"]:
            theory = f" {match[3].removesuffix('_verdict')}" if quantity != match[3] else ""
            return f"{declarations['quantities'][quantity]}{theory}; {place}"
    raise ProgramError(f"column {column} is not declared in table_columns.toml")


@cache
def _read_declarations() -> dict[str, dict[str, str]]:
    return tomllib.loads((files("fecontact.outputs") / "table_columns.toml").read_text("utf-8"))


def write_netcdf(grid: TableGrid, path: str | Path) -> Path:
    """Write a contact table as a NetCDF-3 file.

    Texts are arrays of characters in UTF-8 with an additional dimension; xarray joins them.

    Parameters
    ----------
    grid
        Contact table on its grid.
    path
        File to write.

    Returns
    -------
    Path
        The written file.
    """
    return write_atomically(path, lambda temporary: _write_netcdf(grid, temporary))


def _write_netcdf(grid: TableGrid, path: Path) -> None:
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        for name, text in grid.attributes.items():
            setattr(file, name, text.encode("utf-8"))
        for name, axis in grid.axes.items():
            file.createDimension(name, axis.values.size)
        for name, column in {**grid.axes, **grid.variables}.items():
            dimensions = (name,) if name in grid.axes else TABLE_AXES
            if column.values.dtype.kind == "U":
                variable = _write_texts(file, name, dimensions, column.values)
            else:
                variable = file.createVariable(name, "f8", dimensions)
                variable[:] = column.values
            for attribute, text in column.attributes.items():
                setattr(variable, attribute, text.encode("utf-8"))


def _write_texts(file: Any, name: str, dimensions: tuple[str, ...], texts: NDArray[Any]) -> Any:
    """Write texts as characters along a last dimension, and return their variable."""
    encoded = np.char.encode(texts, "utf-8")
    length = max(encoded.dtype.itemsize, 1)
    dimension = f"characters{length}"
    if dimension not in file.dimensions:
        file.createDimension(dimension, length)
    variable = file.createVariable(name, "S1", (*dimensions, dimension))
    variable[:] = encoded.astype(f"S{length}").reshape(texts.shape)[..., None].view("S1")
    variable._Encoding = b"utf-8"
    return variable
