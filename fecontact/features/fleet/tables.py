"""Parquet files of a fleet as tables for SQL (DuckDB, without a server): profiles, screen, sample."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.errors import InputError
from fecontact.files import write_atomically
from fecontact.outputs.flat_records import Record

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

PROFILES, SCREEN, SAMPLE = "profiles.parquet", "screen", "sample.parquet"
POSITION_COLUMNS = "wheel, rail, shift_mm, load_kN"
"""Columns that name a position."""
STRATA = ("surely holds", "near", "surely fails", "refused")
"""Strata of positions by the verdict of the screen and its margin: margins of at least 2 uncertainties are sure."""
_STRATUM = """
    CASE WHEN verdict = 'REFUSED' THEN 'refused'
         WHEN verdict = 'OPEN' OR margin IS NULL OR abs(margin) < 2 THEN 'near'
         WHEN verdict = 'HOLDS' THEN 'surely holds' ELSE 'surely fails' END"""
_NO_SAMPLE = """
    SELECT '' AS wheel, '' AS rail, 0.0::DOUBLE AS shift_mm, 0.0::DOUBLE AS load_kN, '' AS stratum,
           0.0::DOUBLE AS weight, 1.0::DOUBLE AS inclusion_probability, 0 AS seed, 0 AS draw, '' AS fe_verdict
    WHERE false"""


def import_arrow(module: str) -> Any:
    """Import a module of pyarrow.

    Parameters
    ----------
    module
        Name below `pyarrow`.

    Returns
    -------
    module
        The imported module.

    Raises
    ------
    InputError
        If pyarrow is not installed.
    """
    try:
        return import_module(f"pyarrow.{module}")
    except ImportError as error:
        raise InputError("fleets need the package pyarrow; install it: pip install 'fecontact[fleet]'") from error


def write_table(rows: Sequence[Record], path: Path) -> Path:
    """Write rows as Parquet, whole or not at all.

    A row may lack columns that are in different rows.

    Parameters
    ----------
    rows
        Values by the names of their columns.
    path
        File to write.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If a column has values of several kinds.
    """
    parquet, lib = import_arrow("parquet"), import_arrow("lib")
    columns = list(dict.fromkeys(name for row in rows for name in row))
    try:
        table = lib.Table.from_pydict({column: [row.get(column) for row in rows] for column in columns})
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path.name}: a column has values of different types ({error}); give the same type in all tables"
        ) from error
    return write_atomically(path, lambda temporary: parquet.write_table(table, temporary))


def open_tables(folder: Path) -> DuckDBPyConnection:
    """Open the tables of a fleet as views of a database.

    The views are `profiles`, `screen` with the stratum of each position, `sample`, and `drawn`, the rows of `screen` of
    the sample. Positions without weight are not part of the population.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Returns
    -------
    DuckDBPyConnection
        A database in memory, to be closed by the caller.

    Raises
    ------
    InputError
        If DuckDB is not installed, or the folder has no screened positions.
    """
    try:
        import duckdb
    except ImportError:
        raise InputError(
            "fleets need the packages duckdb and pyarrow; install them: pip install 'fecontact[fleet]'"
        ) from None
    if not (folder / PROFILES).is_file() or not any((folder / SCREEN).glob("part-*.parquet")):
        raise InputError(
            f"{folder} has no screened fleet ({PROFILES}, {SCREEN}/part-*.parquet); screen it first: fecontact fleet"
            f" run FLEET.toml --out {folder}"
        )
    tables = duckdb.connect()
    tables.read_parquet(str(folder / PROFILES)).create_view("profiles")
    tables.read_parquet(str(folder / SCREEN / "part-*.parquet")).create_view("screened")
    tables.execute(f"CREATE VIEW screen AS SELECT *, {_STRATUM} AS stratum FROM screened WHERE weight > 0")
    if (folder / SAMPLE).is_file():
        tables.read_parquet(str(folder / SAMPLE)).create_view("sample")
    else:
        tables.execute(f"CREATE VIEW sample AS {_NO_SAMPLE}")
    tables.execute(
        "CREATE VIEW drawn AS SELECT screen.*, inclusion_probability, fe_verdict, sample.stratum AS drawn_stratum,"
        f" sample.weight AS drawn_weight FROM sample JOIN screen USING ({POSITION_COLUMNS})"
    )
    return tables


def query_rows(tables: DuckDBPyConnection, sql: str, *values: Any) -> list[Record]:
    """Rows of the result of a query, by the names of the columns.

    Parameters
    ----------
    tables
        Connection to the tables.
    sql
        Query, with a question mark for each value.
    *values
        Values of the query.

    Returns
    -------
    list of dict
        Rows in the order of the query.
    """
    result = tables.execute(sql, list(values))
    names = [column[0] for column in result.description or ()]
    return [dict(zip(names, row, strict=True)) for row in result.fetchall()]


def quote_column(name: str) -> str:
    """Quote the name of a column for SQL; the name can have any characters."""
    return '"' + name.replace('"', '""') + '"'
