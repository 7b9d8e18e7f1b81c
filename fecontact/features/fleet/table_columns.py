"""Columns of the tables that users give for a fleet: profiles, pairs and positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal

from fecontact.bodies import Track
from fecontact.case import INPUTS, Case
from fecontact.errors import InputError
from fecontact.features.fleet.stored_columns import ColumnKind
from fecontact.inputs.kinds import Number, custom_field, flag_field, number_field, text_field
from fecontact.inputs.slots import input_dataclass, list_descriptions
from fecontact.inputs.texts import INCLINATION_FORMS, parse_inclination
from fecontact.inputs.user_tables import TableLayout
from fecontact.profiles.reading import Reading

Body = Literal["wheel", "rail"]
FILE_STATUSES = READ, SUSPICIOUS, REFUSED, UNREAD, UNUSED = "read", "suspicious", "refused", "unread", "unused"
"""Status of a file: read, left out until its row settles a suspicion, refused for its content, not read for a reason
that is not in the file, or not read because it is in no pair.
"""
MOST_FILES, MOST_PAIRS, MOST_POSITIONS = 100_000, 1_000_000, 10_000
READING_COLUMNS = ("mirror", "units", "columns", "tape_circle_mm", "tape_circle_z_mm", "repair")
"""Options of reading a file that its row can have, in place of the options of `[case.wheel_file]` or
`[case.rail_file]`.
"""
RADIUS_COLUMN = "rolling_radius_mm"
INCLINATION_COLUMN, ACCEPTED_COLUMN = "inclination", "accepted"
TRACK_COLUMNS = ("back_to_back_mm", "gauge_mm")
"""Inputs of the track that a row can have."""
RESULT_COLUMNS = (
    *("body", "name", "file", "content_hash", "status", "reason", "remedy", "noise_um", "filter_mm", "nominal"),
    *("wear_mm", "weight", "reader_notes", "suspicions"),
    *("flange_height_mm", "flange_thickness_mm", "flange_qr_mm"),
)
"""Columns of `profiles.parquet` that each profile has."""
METADATA_PREFIX = "user_"
"""Beginning of the stored name of a column of the user that has the name of a column of the program."""
OPPOSITE_INPUTS: Mapping[Body, str] = {"wheel": "opposite_wheel", "rail": "opposite_rail"}
"""Column of the profile of the other side, by body."""
OPPOSITE_FILE, OPPOSITE_HASH, OPPOSITE_RADIUS = "opposite_file", "opposite_content_hash", "opposite_rolling_radius_mm"
OPPOSITE_OPTIONS = {f"opposite_{name}": name for name in (*READING_COLUMNS, ACCEPTED_COLUMN)}
"""Columns of `profiles.parquet` with the options of the profile of the other side, and the options."""
_WHEEL_COLUMNS = ("tape_circle_mm", "tape_circle_z_mm", RADIUS_COLUMN, "back_to_back_mm", OPPOSITE_INPUTS["wheel"])
_RAIL_COLUMNS = (INCLINATION_COLUMN, "gauge_mm", OPPOSITE_INPUTS["rail"])
_SIMILAR_TO_OPPOSITE = ("opposite", "other_wheel", "other_rail")
_OPPOSITE_PROFILE = "a path relative to the table, an absolute path, a name of the library, or the name of another row"


def _is_inclination(value: Any) -> bool:
    """Whether a value is a text of a rail inclination."""
    try:
        return isinstance(value, str) and parse_inclination(value) is not None
    except InputError:
        return False


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
    accepted: bool | None = flag_field(
        "Decision on a suspicious profile: yes uses it as it is, no leaves it out", default=None, alone=False
    )
    inclination: str | None = custom_field(
        None,
        "Only for a rail: inclination of this rail; none if the profile in the file is inclined already",
        domain=INCLINATION_FORMS,
        words=f"a text ({INCLINATION_FORMS})",
        holds=_is_inclination,
    )
    opposite_wheel: str | None = text_field(
        None, "Only for a wheel: the other wheel of its wheelset; its mirror image by default", _OPPOSITE_PROFILE
    )
    opposite_rail: str | None = text_field(
        None, "Only for a rail: the other rail of its track; its mirror image by default", _OPPOSITE_PROFILE
    )


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
_CASE, _READING, _TRACK = list_descriptions(Case), list_descriptions(Reading), list_descriptions(Track)


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
        **{name: _TRACK[name] for name in TRACK_COLUMNS},
    }
    other_body, other_columns = ("rail", _RAIL_COLUMNS) if body == "wheel" else ("wheel", _WHEEL_COLUMNS)
    return TableLayout(
        inputs={name: description for name, description in inputs.items() if name not in other_columns},
        required=("file",),
        most_rows=MOST_FILES,
        refused={
            **{name: f"only {other_body}s have it; remove or rename the column" for name in other_columns},
            **dict.fromkeys(
                _SIMILAR_TO_OPPOSITE, f"rename it to {OPPOSITE_INPUTS[body]} to give the other {body}, or remove it"
            ),
            **{
                column: f"the other {body} has the {name} of its row: name this row in {OPPOSITE_INPUTS[body]}, and"
                " remove the column"
                for column, name in {OPPOSITE_RADIUS: RADIUS_COLUMN, **OPPOSITE_OPTIONS}.items()
            },
        },
        remarks=_REMARKS,
    )


def list_input_kinds() -> dict[str, ColumnKind]:
    """Types of the inputs of wheels and rails in their tables.

    Returns
    -------
    dict
        Type of each declared column but file, name and weight.
    """
    inputs = {**make_profile_layout("wheel").inputs, **make_profile_layout("rail").inputs}
    return {
        name: "number" if isinstance(description, Number) else "flag" if description.holds(True) else "text"
        for name, description in inputs.items()
        if name not in ("file", "name", "weight")
    }


OPPOSITE_COLUMNS: Mapping[str, ColumnKind] = {
    **{OPPOSITE_FILE: "text", OPPOSITE_HASH: "text", OPPOSITE_RADIUS: "number"},
    **{column: list_input_kinds()[name] for column, name in OPPOSITE_OPTIONS.items()},
}
"""Columns of `profiles.parquet` for a profile that has a profile of the other side."""
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
_CASE_COLUMNS = (RADIUS_COLUMN, INCLINATION_COLUMN, *TRACK_COLUMNS)
_PROGRAM_COLUMNS = {
    name.casefold()
    for name in (
        *RESULT_COLUMNS,
        *READING_COLUMNS,
        *_CASE_COLUMNS,
        *OPPOSITE_INPUTS.values(),
        *OPPOSITE_COLUMNS,
        ACCEPTED_COLUMN,
    )
}


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


def set_opposite(
    case: Case,
    specs: Mapping[Body, str],
    radius_mm: float | None,
    readings: Mapping[Body, Reading] = MappingProxyType({}),
) -> Case:
    """Case with given profiles of the other side.

    Parameters
    ----------
    case
        Case of the fleet.
    specs
        Files or names of the library, by body; a missing body keeps the profile of the case.
    radius_mm
        Rolling radius of the other wheel in mm; None for the radius of the case.
    readings
        Options of the files by body, if they differ from the options of the case.

    Returns
    -------
    Case
        The case with these profiles.
    """
    changes: dict[str, Any] = {str(body): spec for body, spec in specs.items()}
    changes |= {f"{body}_file": reading for body, reading in readings.items()}
    if radius_mm is not None:
        changes["rolling_radius_mm"] = radius_mm
    return replace(case, opposite=replace(case.opposite, **changes)) if changes else case


def select_case_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs of a case from the values of a row, without empty columns.

    Parameters
    ----------
    values
        Values of the row, in a table of the user or in `profiles.parquet`.

    Returns
    -------
    dict
        Values by column.
    """
    present = {name: values.get(name) for name in _CASE_COLUMNS}
    return {name: value for name, value in present.items() if isinstance(value, str) or (value or 0.0) > 0.0}


def set_case_values(case: Case, values: Mapping[str, Any]) -> Case:
    """Case with the inputs that the rows of its wheel and rail have.

    Parameters
    ----------
    case
        Case of the fleet.
    values
        Values by column, as of `select_case_values`.

    Returns
    -------
    Case
        The case with these inputs.

    Raises
    ------
    InputError
        If a value is not allowed, or has no effect.
    """
    if "gauge_mm" in values and case.track.rail_crown_y_mm is not None:
        raise InputError(
            f"gauge_mm is {values['gauge_mm']:g}, but rail_crown_y_mm in [case.track] places all rails; leave out"
            " one of them"
        )
    changes: dict[str, Any] = {}
    if RADIUS_COLUMN in values:
        changes[RADIUS_COLUMN] = float(values[RADIUS_COLUMN])
    if INCLINATION_COLUMN in values:
        changes["inclination_rad"] = parse_inclination(values[INCLINATION_COLUMN])
    if track := {name: float(values[name]) for name in TRACK_COLUMNS if name in values}:
        changes["track"] = replace(case.track, **track)
    return replace(case, **changes) if changes else case
