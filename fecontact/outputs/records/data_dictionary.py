"""Data dictionary: keys of result.json and columns of study.csv, as a page of the guide."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from fecontact.judging.measures import MEASURES, MISFITS
from fecontact.outputs.flat_records import relative_name
from fecontact.outputs.records.result_schema import (
    KeyDeclaration,
    find_unit,
    iterate_keys,
    list_column_patterns,
    row_column_meanings,
)
from fecontact.outputs.words import CONTRIBUTION_WORDS, MEASURE_WORDS

_TITLE = "Data dictionary: keys of `result.json`, columns of `study.csv`"
_INTRODUCTION = """\
Every solved case has a `result.json` with the keys below. All keys are in every file: a key that does not apply to a
case is null. `fecontact keys --json` prints the JSON schema; `schema` in the file names the layout. Keys and columns
end in their unit. `<measure>` is each measure of the first table, `<name>` for a free name, `[]` for the
members of a list. Deviations and uncertainties are fractions in `result.json`, and percent in tables.
"""


@dataclass(frozen=True, kw_only=True)
class ColumnDeclaration:
    """Declaration of a column of `study.csv`.

    Attributes
    ----------
    column
        Name of the column, with placeholders in angle brackets.
    unit
        Unit of a number; `%` for deviations, `-` without a unit or for texts.
    meaning
        Meaning in words.
    key
        Key of `result.json` with the same value; empty for a column of inputs.
    """

    column: str
    unit: str
    meaning: str
    key: str


def dictionary_page() -> str:
    """Page of the data dictionary, in Markdown.

    Returns
    -------
    str
        Tables of the measures, of the contributions to an uncertainty, of all keys and of all columns.
    """
    measures = [
        [f"`{name}`", f"`{relative_name(name)}`", MEASURE_WORDS[name].unit, MEASURE_WORDS[name].meaning]
        for name in (*MEASURES, *MISFITS)
    ]
    contributions = [[f"`{name}`", words] for name, words in CONTRIBUTION_WORDS.items()]
    keys = [[f"`{key.key}`", key.unit, key.meaning, key.places] for key in iterate_keys()]
    columns = [
        [f"`{column.column}`", column.unit, column.meaning, f"`{column.key}`" if column.key else ""]
        for column in iterate_columns()
    ]
    return "\n".join(
        [
            f"# {_TITLE}\n",
            _INTRODUCTION,
            "## Measures\n",
            *_table(["key", "column", "unit", "meaning"], measures),
            "\n## Contributions to an uncertainty\n",
            *_table(["key", "meaning"], contributions),
            "\n## Keys of `result.json`\n",
            *_table(["key", "unit", "meaning", "shown in"], keys),
            "\n## Columns of `study.csv` and `map.csv`\n",
            "`<size>` and `<deviation>` are measures by their keys and by their columns, `<step>` for p_max, area"
            " and approach, `<hertz>` for `hertz` and, at a junction of curvatures, `hertz_gauge`, `<theory>` for all"
            " other theories, `<body>` for `rail` and `wheel`.\n",
            *_table(["column", "unit", "meaning", "key"], columns),
            "",
        ]
    )


def iterate_columns() -> Iterator[ColumnDeclaration]:
    """Iterate over the declared columns of `study.csv`.

    Yields
    ------
    ColumnDeclaration
        Column with unit and meaning, and the key with its value.
    """
    for column, meaning in row_column_meanings().items():
        yield ColumnDeclaration(column=column, unit=_column_unit(column), meaning=meaning, key="")
    keys = {_column_of_key(key): key for key in iterate_keys()}
    for column in list_column_patterns():
        key = _find_key(column, keys)
        name = re.sub(r"<name=(\w+)>", r"\1", column)
        yield ColumnDeclaration(column=name, unit=_column_unit(column), meaning=key.meaning, key=key.key)


def _column_unit(column: str) -> str:
    if column.endswith(("<size>",)):
        return "of the name"
    return "%, b" if column.endswith(("<deviation>", "<step>")) else find_unit(column)


def _column_of_key(key: KeyDeclaration) -> str:
    """Column pattern of a key, with `<measure>` for the measures of an object."""
    path = key.key.removeprefix("theories.")
    if key.type_name.removesuffix("?") in ("measures", "all measures"):
        path += ".<measure>"
    return path.replace(".", "_").removesuffix("[]")


def _find_key(column: str, keys: Mapping[str, KeyDeclaration]) -> KeyDeclaration:
    """Key with the value of a column.

    A column may name a measure where the key has `<measure>`.
    """
    column = re.sub(r"<name=\w+>", "<name>", column.replace("<hertz>", "<theory>"))
    measures = ("<size>", "<deviation>", "<step>", *MEASURES, *map(relative_name, MEASURES))
    patterns = [column, *(column.removesuffix(name) + "<measure>" for name in measures if column.endswith(name))]
    return next(keys[pattern] for pattern in patterns if pattern in keys)


def _table(headings: list[str], rows: list[list[str]]) -> list[str]:
    """Lines of a table in Markdown."""
    lines = [headings, ["---"] * len(headings), *rows]
    return [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines]
