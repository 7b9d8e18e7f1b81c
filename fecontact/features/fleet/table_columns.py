"""Columns of the tables that users give for a fleet: profiles, pairs and positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from fecontact.case import INPUTS, Case
from fecontact.inputs.kinds import number_field, text_field
from fecontact.inputs.slots import input_dataclass, list_descriptions
from fecontact.inputs.user_tables import TableLayout
from fecontact.profiles.reading import Reading

Body = Literal["wheel", "rail"]
MOST_FILES, MOST_PAIRS, MOST_POSITIONS = 100_000, 1_000_000, 10_000
READING_COLUMNS = ("mirror", "units", "columns", "tape_circle_mm", "tape_circle_z_mm", "repair")
"""Options of reading a file that its row can have, in place of the options of `[case.wheel_file]` or
`[case.rail_file]`.
"""
RADIUS_COLUMN = "rolling_radius_mm"
RESULT_COLUMNS = (
    *("body", "name", "file", "content_hash", "status", "reason", "remedy", "noise_um", "filter_mm", "nominal"),
    *("wear_mm", "weight", "reader_notes"),
    *("flange_height_mm", "flange_thickness_mm", "flange_qr_mm"),
)
"""Columns of `profiles.parquet` that each profile has."""
METADATA_PREFIX = "user_"
"""Beginning of the stored name of a column of the user that has the name of a column of the program."""
_WHEEL_COLUMNS = ("tape_circle_mm", "tape_circle_z_mm", RADIUS_COLUMN)


@input_dataclass
class _ProfileColumns:
    """Columns of a table of wheels or rails, beside the options of reading."""

    file: str = text_field(
        "", "Profile", "a path relative to the table, an absolute path, or a name of the library, not empty"
    )
    name: str | None = text_field(
        None, "Name in the results and in the table of pairs; the name of the file by default", "not empty"
    )
    weight: float = number_field(1.0, "Weight among the wheels, or among the rails", low=0.0, high=1e15)


@input_dataclass
class _PairColumns:
    """Columns of a table of pairs."""

    wheel: str = text_field("", "Name of the wheel", "the name in its table, or the name of its file without ending")
    rail: str = text_field("", "Name of the rail", "the name in its table, or the name of its file without ending")
    weight: float = number_field(1.0, "Weight of the pair, times the weights of wheel and rail", low=0.0, high=1e15)


@input_dataclass
class _PositionWeight:
    """Weight of a position in a table."""

    weight: float = number_field(1.0, "Weight of the position", low=0.0, high=1e15)


def _list_unused_inputs() -> dict[str, str]:
    """Place of each input of a case, by its key.

    A column with such a name has no effect.
    """
    places: dict[str, str] = {}
    for place in INPUTS:
        table = f"case.{place.table}" if place.table else "case"
        places.setdefault(place.key, f"give {place.key} in [{table}] for all positions")
    return places


_REMARKS = _list_unused_inputs()
_CASE, _READING = list_descriptions(Case), list_descriptions(Reading)


def make_profile_layout(body: Body) -> TableLayout:
    """Columns of a table of wheels or of rails.

    Parameters
    ----------
    body
        `wheel` or `rail`.

    Returns
    -------
    TableLayout
        Declared columns with their units and ranges.
    """
    inputs = {
        **list_descriptions(_ProfileColumns),
        **{name: _READING[name] for name in READING_COLUMNS},
        RADIUS_COLUMN: _CASE[RADIUS_COLUMN],
    }
    if body == "wheel":
        return TableLayout(inputs=inputs, required=("file",), most_rows=MOST_FILES, remarks=_REMARKS)
    return TableLayout(
        inputs={name: description for name, description in inputs.items() if name not in _WHEEL_COLUMNS},
        required=("file",),
        most_rows=MOST_FILES,
        refused={name: "only wheels have it; remove or rename the column" for name in _WHEEL_COLUMNS},
        remarks=_REMARKS,
    )


PAIR_LAYOUT = TableLayout(
    inputs=list_descriptions(_PairColumns), required=("wheel", "rail"), most_rows=MOST_PAIRS, remarks=_REMARKS
)
"""Columns of a table of pairs."""
POSITION_LAYOUT = TableLayout(
    inputs={
        "shift_mm": _CASE["lateral_shift_mm"],
        "load_kN": _CASE["load_N"],
        **list_descriptions(_PositionWeight),
    },
    required=("shift_mm", "load_kN"),
    most_rows=MOST_POSITIONS,
    remarks=_REMARKS,
)
"""Columns of a table of positions."""
_PROGRAM_COLUMNS = {name.casefold() for name in (*RESULT_COLUMNS, *READING_COLUMNS, RADIUS_COLUMN)}


def name_metadata(name: str) -> str:
    """Name in `profiles.parquet` of a column of the user.

    Parameters
    ----------
    name
        Name in the table of the user.

    Returns
    -------
    str
        The same name, or `user_NAME` for the name of a column of the program: SQL does not distinguish upper case.
    """
    return f"{METADATA_PREFIX}{name}" if name.casefold() in _PROGRAM_COLUMNS else name


def describe_columns(title: str, layout: TableLayout, names: Sequence[str], *, is_kept: bool) -> str:
    """Sentence on the columns of a table: inputs, metadata, and names that may be a mistake.

    Parameters
    ----------
    title
        Name of the table.
    layout
        Declared columns.
    names
        Names of its columns.
    is_kept
        Whether the results have the columns that are not declared.

    Returns
    -------
    str
        The sentence, without a full stop.
    """
    metadata = layout.list_metadata(names)
    renamed = [f"{name!r} is kept as {name_metadata(name)}" for name in metadata if name_metadata(name) != name]
    phrases = [f"inputs {', '.join(name for name in names if name in layout.inputs)}"]
    if metadata:
        phrases.append(f"{'kept as metadata' if is_kept else 'not used'}: {', '.join(metadata)}")
    return f"{title}: {'; '.join([*phrases, *(renamed if is_kept else ()), *layout.list_remarks(metadata)])}"


def select_reading_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Options of reading a file from the values of its row; columns without a value are left out."""
    return {name: value for name in READING_COLUMNS if (value := values.get(name)) is not None}
