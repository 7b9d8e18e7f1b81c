"""Parquet files of a fleet as tables for SQL (DuckDB, without a server): profiles, screen, sample."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import InputError
from fecontact.features.fleet.packages import import_arrow, import_duckdb, import_parquet
from fecontact.features.fleet.screening_rows import NO_CONTACT, NUMBERS, REFUSED, TEXTS
from fecontact.features.fleet.sealed_folder import (
    PROFILES,
    SAMPLE,
    SCREEN,
    check_sample,
    describe_redraw,
    describe_rerun,
    list_part_paths,
    name_for_duckdb,
    read_record,
)
from fecontact.features.fleet.stored_columns import StoredColumn, check_stored_table
from fecontact.features.fleet.table_columns import FILE_STATUSES, OPPOSITE_COLUMNS, RESULT_COLUMNS, list_input_kinds
from fecontact.files import write_atomically
from fecontact.outputs.flat_records import Record

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

POSITION_COLUMNS = "wheel, rail, shift_mm, load_kN"
"""Columns that name a position."""
STRATA = ("surely holds", "near", "surely fails", "refused")
"""Strata of positions by the verdict of the screen and its margin: margins of at least 2 uncertainties are sure."""
_STRATUM = f"""
    CASE WHEN verdict = '{REFUSED}' THEN 'refused'
         WHEN verdict = 'OPEN' OR margin IS NULL OR abs(margin) < 2 THEN 'near'
         WHEN verdict = 'HOLDS' THEN 'surely holds' ELSE 'surely fails' END"""
FE_ANSWERS = ("HOLDS", "FAILS", "OPEN", "UNSOLVED")
"""Answers of finite elements for a drawn position."""
VERDICTS = ("HOLDS", "FAILS", "OPEN", REFUSED, NO_CONTACT)
"""Verdicts of the screening."""
_NAME = StoredColumn(kind="text", required=True, filled=True)
_TEXT, _NUMBER = StoredColumn(kind="text"), StoredColumn(kind="number")
_PLACE = StoredColumn(kind="number", required=True, filled=True)
# Weights of positions are shares; a share of a sum may be larger than 1 by its rounding.
_SHARE = StoredColumn(kind="number", required=True, filled=True, low=0.0, high=1.0 + 1e-9)
_KEY_COLUMNS = {"wheel": _NAME, "rail": _NAME, "shift_mm": _PLACE, "load_kN": _PLACE, "weight": _SHARE}
SCREEN_COLUMNS: Mapping[str, StoredColumn] = {
    **dict.fromkeys(NUMBERS, _NUMBER),
    **dict.fromkeys(TEXTS, _TEXT),
    **_KEY_COLUMNS,
    "verdict": StoredColumn(kind="text", required=True, filled=True, choices=VERDICTS),
    "margin": StoredColumn(kind="number", required=True),
    # tables of earlier versions have this number under a different name
    "variants": StoredColumn(kind="number", required=True),
    "cause": StoredColumn(kind="text", required=True),
    "cheapest_theory": StoredColumn(kind="text", required=True, choices=(*THEORIES, "OPEN")),
    "open_because": _TEXT,
}
"""Columns of the tables of positions; earlier versions wrote fewer columns."""
_PROFILE_NUMBERS = ("noise_um", "wear_mm", *(name for name in RESULT_COLUMNS if name.startswith("flange_")))
PROFILE_COLUMNS: Mapping[str, StoredColumn] = {
    **{name: StoredColumn(kind=kind) for name, kind in {**list_input_kinds(), **OPPOSITE_COLUMNS}.items()},
    **dict.fromkeys(RESULT_COLUMNS, _TEXT),
    **dict.fromkeys(_PROFILE_NUMBERS, _NUMBER),
    **dict.fromkeys(("name", "file", "content_hash"), _NAME),
    "weight": StoredColumn(kind="number", required=True, filled=True, low=0.0),
    "body": StoredColumn(kind="text", required=True, filled=True, choices=("wheel", "rail")),
    "status": StoredColumn(kind="text", required=True, filled=True, choices=FILE_STATUSES),
    "reason": StoredColumn(kind="text", required=True),
    "remedy": StoredColumn(kind="text", required=True),
    "nominal": StoredColumn(kind="text", required=True),
}
"""Columns of `profiles.parquet` but those of the user; earlier versions wrote fewer columns."""
SAMPLE_COLUMNS: Mapping[str, StoredColumn] = {
    **_KEY_COLUMNS,
    "stratum": StoredColumn(kind="text", required=True, filled=True, choices=STRATA),
    "inclusion_probability": StoredColumn(kind="number", required=True, filled=True, low=sys.float_info.min, high=1.0),
    "seed": StoredColumn(kind="integer", required=True, filled=True),
    "draw": StoredColumn(kind="integer", required=True, filled=True),
    "fe_verdict": StoredColumn(kind="text", required=True, filled=True, choices=FE_ANSWERS),
    "fe_cpu_seconds": _NUMBER,
}
"""Columns of `sample.parquet` that the program reads."""
_SQL_TYPES = {"text": "VARCHAR", "number": "DOUBLE"}
_NO_SAMPLE = """
    SELECT '' AS wheel, '' AS rail, 0.0::DOUBLE AS shift_mm, 0.0::DOUBLE AS load_kN, '' AS stratum,
           0.0::DOUBLE AS weight, 1.0::DOUBLE AS inclusion_probability, 0 AS seed, 0 AS draw, '' AS fe_verdict
    WHERE false"""


def write_table(
    rows: Sequence[Record], path: Path, before_replacing: Callable[[Path], object] = lambda temporary: None
) -> Path:
    """Write rows as Parquet, whole or not at all.

    A row may lack columns that are in different rows.

    Parameters
    ----------
    rows
        Values by the names of their columns.
    path
        File to write.
    before_replacing
        Called with the path of the whole new file before it replaces the old file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If a column has values of several kinds.
    """
    columns = list(dict.fromkeys(name for row in rows for name in row))
    try:
        table = import_arrow("lib").Table.from_pydict({column: [row.get(column) for row in rows] for column in columns})
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path.name}: a column has values of different types ({error}); give the same type in all tables"
        ) from error

    def write(temporary: Path) -> None:
        write_parquet(table, temporary)
        before_replacing(temporary)

    return write_atomically(path, write)


def write_parquet(table: Any, path: Path) -> None:
    """Write a table of pyarrow as Parquet.

    Python opens the file, so that errors of the system have its name, and the name can have any characters.

    Parameters
    ----------
    table
        Table.
    path
        File to write.
    """
    with path.open("wb") as file:
        import_parquet().write_table(table, file)


def read_parquet(path: Path) -> Any:
    """Read a Parquet file that the program wrote.

    Parameters
    ----------
    path
        File.

    Returns
    -------
    pyarrow.Table
        The table.
    """
    with path.open("rb") as file:
        return import_parquet().ParquetFile(file).read()


def read_profile_rows(folder: Path) -> list[dict[str, Any]]:
    """Rows of `profiles.parquet`.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Returns
    -------
    list of dict
        Values of each profile by column.

    Raises
    ------
    InputError
        If the table differs from its declaration.
    """
    path = folder / PROFILES
    check_stored_table(path, PROFILE_COLUMNS, describe_rerun(folder))
    rows: list[dict[str, Any]] = read_parquet(path).to_pylist()
    return rows


@contextmanager
def open_tables(folder: Path) -> Iterator[DuckDBPyConnection]:
    """Open the tables of a fleet as views of a database.

    The views are `profiles`, `placed` with all positions, `screen` with the contacts and their strata, `sample`, and
    `drawn`, the rows of `screen` of the sample. Positions without weight are not part of the population. Positions at
    which the wheel cannot stand are not contacts, and the weights of `screen` are shares of all contacts.

    The database has a single thread: on several threads the order of the positions, and so the last digits of a sum,
    differ from call to call. Two million positions take 5 s in place of 4 s on two cores.

    Parameters
    ----------
    folder
        Folder of a screened fleet.

    Yields
    ------
    DuckDBPyConnection
        A database in memory.

    Raises
    ------
    InputError
        If DuckDB is not installed, the folder has no screened positions, no position is a contact, or a table was
        changed or differs from its declaration.
    MemoryError
        If the memory does not suffice.
    """
    duckdb = import_duckdb()
    parts = list_part_paths(folder, read_record(folder))
    has_sample = check_sample(folder) is not None
    for path, columns in ((folder / PROFILES, PROFILE_COLUMNS), *((path, SCREEN_COLUMNS) for path in parts)):
        check_stored_table(path, columns, describe_rerun(folder))
    if has_sample:
        check_stored_table(folder / SAMPLE, SAMPLE_COLUMNS, describe_redraw(folder))
    with duckdb.connect() as tables:
        try:
            tables.execute("SET threads = 1")
            tables.read_parquet(name_for_duckdb(folder / PROFILES)).create_view("profiles")
            tables.read_parquet([name_for_duckdb(path) for path in parts]).create_view("screened")
            _refuse_foreign_names(tables, folder)
            _create_views_of_positions(tables, folder)
            _create_views_of_sample(tables, folder if has_sample else None)
            yield tables
        except duckdb.OutOfMemoryException as error:
            raise MemoryError from error


def _refuse_foreign_names(tables: DuckDBPyConnection, folder: Path) -> None:
    """Refuse a wheel or rail of a position that is not a single profile."""
    for body in ("wheel", "rail"):
        (row,) = query_rows(
            tables,
            f"SELECT min(name) AS name FROM (SELECT DISTINCT {body} AS name FROM screened) AS used WHERE (SELECT"
            " count(*) FROM profiles WHERE profiles.body = ? AND profiles.name = used.name) <> 1",
            body,
        )
        if row["name"] is not None:
            raise InputError(
                f"{folder}: {SCREEN} has the {body} {row['name']!r:.80}, which is not a single row of {PROFILES};"
                f" {describe_rerun(folder)}"
            )


def _create_views_of_sample(tables: DuckDBPyConnection, folder: Path | None) -> None:
    """Create the views `sample` and `drawn`; both are empty without the folder of a sample."""
    if folder is None:
        tables.execute(f"CREATE VIEW sample AS {_NO_SAMPLE}")
    else:
        tables.read_parquet(name_for_duckdb(folder / SAMPLE)).create_view("sample")
    tables.execute(
        "CREATE VIEW drawn AS SELECT screen.*, inclusion_probability, fe_verdict, sample.stratum AS drawn_stratum,"
        f" sample.weight AS drawn_weight FROM sample JOIN screen USING ({POSITION_COLUMNS})"
    )


def _create_views_of_positions(tables: DuckDBPyConnection, folder: Path) -> None:
    """Create the views `placed` of all positions, and `screen` of the contacts.

    Both have only positions with a weight. Positions at which the wheel cannot stand are not contacts: the weights of
    `screen` are shares of all contacts.

    Raises
    ------
    InputError
        If no position is a contact.
    """
    names = {row["column_name"] for row in query_rows(tables, "DESCRIBE screened")}
    # tables of earlier versions lack columns
    missing = "".join(
        f", NULL::{_SQL_TYPES[column.kind]} AS {name}" for name, column in SCREEN_COLUMNS.items() if name not in names
    )
    tables.execute(f"CREATE VIEW placed AS SELECT *{missing} FROM screened WHERE weight > 0")
    (row,) = query_rows(
        tables, f"SELECT sum(weight) FILTER (verdict <> '{NO_CONTACT}') / sum(weight) AS contacts FROM placed"
    )
    if not row["contacts"]:
        raise InputError(
            f"{folder}: no position is a contact, because the wheel cannot stand on the rail at any shift; the column"
            " reason of screen/ has the reasons; check shifts, gauge and profiles"
        )
    tables.execute(
        f"CREATE VIEW screen AS SELECT * REPLACE (weight / CAST('{row['contacts']!r}' AS DOUBLE) AS weight),"
        f" {_STRATUM} AS stratum FROM placed WHERE verdict <> '{NO_CONTACT}'"
    )


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
