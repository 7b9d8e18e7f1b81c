"""Tables that users give: cells are texts until the declaration of their column gives them a type."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.inputs.kinds import Input, Number
from fecontact.inputs.table_files import TableFile, open_table_file
from fecontact.inputs.texts import count_text

_LONGEST_NAME, _LONGEST_CELL = 200, 100_000
# A number as in a CSV file. The character of an integer part or a fraction is an ASCII digit.
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][-+]?[0-9]+)?")
# A number that is equal to its text: without leading zeros and exponent.
_PLAIN_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?")
_PLAIN_COMMA_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(?:,[0-9]+)?")
# Number of digits that a float keeps.
_MOST_DIGITS = 15
_LARGEST_INTEGER = 2**63 - 1
# Endings of names that are not part of the meaning.
_UNITS = ("inches", "inch", "percent", "mrad", "mm", "cm", "um", "km", "kn", "kg", "deg", "rad", "in", "m", "n", "t")
_WORD_ENDINGS = ("", "s", "ed")
# Similarity of `mirrored` and `mirror` is 0.86, of `height` and `weight` 0.83.
_SIMILARITY = 0.8


@dataclass(frozen=True, kw_only=True)
class TableLayout:
    """Declared columns of a table.

    Attributes
    ----------
    inputs
        Description of each declared column. A number has the unit in the name of its column.
    required
        Columns that a table must have, with a value in each row.
    most_rows
        Largest number of rows.
    refused
        Columns that must not be in the table, with the reason and the remedy.
    remarks
        Reason why a column is not used, for names of inputs elsewhere.
    """

    inputs: Mapping[str, Input]
    required: tuple[str, ...]
    most_rows: int
    refused: Mapping[str, str] = field(default_factory=dict)
    remarks: Mapping[str, str] = field(default_factory=dict)

    def list_metadata(self, names: Sequence[str]) -> list[str]:
        """Columns of a table that are not declared."""
        return [name for name in names if name not in self.inputs]

    def list_remarks(self, names: Sequence[str]) -> list[str]:
        """Remarks on columns that are not declared, but have a name like an input.

        Parameters
        ----------
        names
            Names of the columns.

        Returns
        -------
        list of str
            A phrase for each such column.
        """
        spellings = {reduce_name(column): column for column in self.inputs}
        phrases = []
        for name in self.list_metadata(names):
            reduced = reduce_name(name)
            without_unit = {reduced.removesuffix(unit) for unit in _UNITS} & {*spellings}
            matches = [*without_unit, *get_close_matches(reduced, spellings, n=1, cutoff=_SIMILARITY)]
            if column := _find_spelling(name, self.remarks):
                phrases.append(f"{name!r} is not used: {self.remarks[column]}")
            elif matches:
                phrases.append(f"{name!r} is not the input {spellings[matches[0]]}")
        return phrases

    def check_names(self, names: Sequence[str], subject: str) -> None:
        """Refuse missing names, equal names, missing columns and misspelt inputs.

        Parameters
        ----------
        names
            Names of the columns.
        subject
            Table in messages.

        Raises
        ------
        InputError
            With the number or the name of the column, and the remedy.
        """
        numbers: dict[str, int] = {}
        for number, name in enumerate(names, start=1):
            if not name.strip() or len(name) > _LONGEST_NAME or "\0" in name:
                raise InputError(
                    f"{subject}: the name of column {number} is {name[:_LONGEST_NAME]!r}; allowed: 1 to {_LONGEST_NAME}"
                    " characters; give the column a name, or remove it"
                )
            if first := numbers.get(name.casefold()):
                raise InputError(
                    f"{subject}: columns {first} and {number} are both named {name!r}, apart from upper case; allowed:"
                    " different names; rename or remove one of the columns"
                )
            numbers[name.casefold()] = number
        for name in self.list_metadata(names):
            if column := _find_spelling(name, self.refused):
                raise InputError(f"{subject}: column {name!r} is not allowed; {self.refused[column]}")
            column = _find_spelling(name, self.inputs)
            if column is not None and column not in names:
                description = self.inputs[column]
                unit = (description.shown_unit or description.unit) if isinstance(description, Number) else ""
                raise InputError(
                    f"{subject}: column {name!r} is not an input; did you mean {column}{f', in {unit}' * bool(unit)}?"
                    f" Rename it to {column}, or give a column of your own a name that differs more"
                )
        for name in self.required:
            if name not in names:
                columns = ", ".join(names)[:200]
                raise InputError(f"{subject}: no column {name}; columns: {columns}; add the column")


@dataclass(frozen=True, kw_only=True, slots=True)
class UserRow:
    """A row of a table.

    Attributes
    ----------
    number
        Number of the row, from 1 for the first row below the names of the columns.
    values
        Values of the declared columns; an empty cell has no value. A number is in the unit of its column.
    metadata
        Values of the other columns: texts of a CSV file, values of a Parquet file, None for an empty cell.
    """

    number: int
    values: Mapping[str, Any]
    metadata: Mapping[str, Any]


def read_user_table(path: Path, layout: TableLayout) -> list[UserRow]:
    """Rows of a table of a user, with the type of each declared column.

    Parameters
    ----------
    path
        CSV file, or Parquet file with the ending .parquet. In a CSV file with semicolons, all numbers have decimal
        commas, or all have decimal points.
    layout
        Declared columns.

    Returns
    -------
    list of UserRow
        At least one row.

    Raises
    ------
    InputError
        For a file that is not a table, and for the first cell that is not allowed. The message has the table, the row,
        the column, the value, and the allowed values.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fecontact.inputs.kinds import Number
    >>> from fecontact.inputs.user_tables import TableLayout, read_user_table
    >>> layout = TableLayout(
    ...     inputs={"weight": Number(help="Weight", high=10.0)}, required=("weight",), most_rows=10
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "table.csv"
    ...     _ = path.write_text("weight;line\\n1,5;007\\n")
    ...     row = read_user_table(path, layout)[0]
    >>> dict(row.values), dict(row.metadata)
    ({'weight': 1.5}, {'line': '007'})
    """
    subject, table = f"table {path}", open_table_file(path)
    layout.check_names(table.names, subject)
    reader = _CellReader(layout=layout, table=table, subject=subject)
    rows: list[UserRow] = []
    count = table.count
    for number, cells in enumerate(table.rows, start=1):
        count = max(count, number)
        # further rows are only counted, for the message
        if count <= layout.most_rows:
            rows.append(reader.read_row(number, cells))
        elif table.count:
            break
    if count > layout.most_rows:
        raise InputError(
            f"{subject}: {count} rows; allowed: at most {layout.most_rows}; give fewer rows, or draw pairs"
        )
    if not rows:
        raise InputError(f"{subject}: row 1 is missing: there are no rows below the names of the columns; add a row")
    return _replace_decimal_commas(rows) if table.has_semicolons else rows


class _CellReader:
    """Reader of the rows of a table.

    It remembers the first number with a decimal comma or a decimal point.
    """

    def __init__(self, *, layout: TableLayout, table: TableFile, subject: str) -> None:
        self.layout, self.table, self.subject = layout, table, subject
        self.columns = [
            (name, replace(layout.inputs[name], label=name) if name in layout.inputs else None) for name in table.names
        ]
        self.decimal_mark, self.place_of_mark = "" if table.has_semicolons else ".", ""

    def read_row(self, number: int, cells: Sequence[Any]) -> UserRow:
        """Read a row from its number and its cells; raises InputError for the first cell that is not allowed."""
        values, metadata = {}, {}
        for (name, description), cell in zip(self.columns, cells, strict=True):
            if description is None:
                metadata[name] = self._read_metadata(cell, name, number)
            elif cell is not None and not (isinstance(cell, str) and not cell.strip()):
                values[name] = self._read_cell(cell, description, number)
            elif name in self.layout.required:
                raise InputError(
                    f"{self.subject}, row {number}: {name} is empty; allowed: {description.allowed}; fill in the cell,"
                    " or remove the row"
                )
        return UserRow(number=number, values=values, metadata=metadata)

    def _read_metadata(self, cell: Any, name: str, number: int) -> Any:
        """Value of a cell of a column that is not declared; None for an empty cell and for NaN."""
        is_list = isinstance(cell, list | dict)
        is_large = isinstance(cell, int) and abs(cell) > _LARGEST_INTEGER
        if is_list or is_large or (isinstance(cell, float) and math.isinf(cell)):
            raise InputError(
                f"{self.subject}, row {number}: {name} is {str(cell)[:60]}; allowed: a text, a finite number, an"
                " integer of 64 bits, a truth value, a date or a time; change or remove the column"
            )
        return None if cell == "" or (isinstance(cell, float) and math.isnan(cell)) else cell

    def _read_cell(self, cell: Any, description: Input, number: int) -> Any:
        """Value of a cell by the description of its column."""
        where = f"{self.subject}, row {number}"
        if isinstance(cell, str) and (len(cell) > _LONGEST_CELL or "\0" in cell):
            raise InputError(
                f"{where}: {description.label} has {count_text(len(cell), 'character')}; allowed: at"
                f" most {_LONGEST_CELL}, without"
                " NUL; correct the cell"
            )
        try:
            if isinstance(description, Number):
                value = self._parse_number(cell, description, number) if self.table.is_text else cell
                number_inside = description.read(value)
                description.check(number_inside)
                # hundreds of rows have no reader who would see a note on a wrong unit
                if note := description.note(number_inside):
                    raise InputError(f"{note}; a table can have usual values only")
                return float(value)
            if self.table.is_text:
                return description.read(cell)
            # the type in the file must fit: a text such as "yes" is not a truth value
            description.check(cell)
            return cell
        except InputError as error:
            kind = "" if self.table.is_text else f" ({type(cell).__name__} in the file)"
            raise InputError(f"{where}: {error}{kind}; correct the cell") from None

    def _parse_number(self, text: str, description: Number, number: int) -> float:
        """Number of a text; raises InputError for a text that is not a number in the form of the table."""
        stripped = text.strip()
        if not _NUMBER.fullmatch(stripped):
            raise description.refusal(text)
        mark = next((mark for mark in ".," if mark in stripped), "")
        if mark and not self.decimal_mark:
            self.decimal_mark, self.place_of_mark = mark, f"row {number} has {text!r}"
        if mark and mark != self.decimal_mark:
            reason = self.place_of_mark or "columns are separated by commas or tabs"
            raise InputError(
                f"{description.label} is {text!r}, but {reason}; allowed: a number with a decimal point, or a decimal"
                " comma in all numbers of a table with semicolons"
            )
        return float(stripped.replace(",", "."))


def _replace_decimal_commas(rows: Sequence[UserRow]) -> list[UserRow]:
    """Rows with decimal points in place of decimal commas in their metadata.

    A column with any other text is not changed.
    """
    names = set()
    for name in rows[0].metadata:
        texts = [row.metadata[name] for row in rows if row.metadata[name] is not None]
        if any("," in text for text in texts) and all(map(_PLAIN_COMMA_NUMBER.fullmatch, texts)):
            names.add(name)
    return [
        replace(
            row,
            metadata={
                name: text.replace(",", ".") if name in names and text is not None else text
                for name, text in row.metadata.items()
            },
        )
        for row in rows
    ]


def convert_plain_numbers(values: Sequence[Any]) -> list[Any]:
    """Numbers of the texts of a column, if each text equals its number.

    A text such as `007`, `1e3` or a number of more than 15 digits is not equal to its number.

    Parameters
    ----------
    values
        Texts, values of other types, and None for an empty cell.

    Returns
    -------
    list
        Numbers, if there are only numbers and such texts. Values of any other single type are not changed. Values of
        several types are texts.

    Examples
    --------
    >>> from fecontact.inputs.user_tables import convert_plain_numbers
    >>> convert_plain_numbers(["12", "0.50", None]), convert_plain_numbers(["12", "007"])
    ([12, 0.5, None], ['12', '007'])
    """
    types = {type(value) for value in values if value is not None}
    texts = [value for value in values if isinstance(value, str)]
    if types <= {int, float, str} and all(map(_is_plain_number, texts)):
        return [_to_number(value) if isinstance(value, str) else value for value in values]
    if len(types) <= 1:
        return list(values)
    return [None if value is None else str(value) for value in values]


def _is_plain_number(text: str) -> bool:
    """Whether a text equals its number, apart from zeros after its decimals."""
    digits = sum(map(str.isdigit, text))
    return _PLAIN_NUMBER.fullmatch(text) is not None and digits <= _MOST_DIGITS


def _to_number(text: str) -> float:
    return float(text) if "." in text else int(text)


def reduce_name(name: str) -> str:
    """Lower case of the letters and digits in the name of a column."""
    return "".join(character for character in name.casefold() if character.isalnum())


def _find_spelling(name: str, columns: Iterable[str]) -> str | None:
    """Column that differs from a name only by case, blanks, punctuation, ending or unit."""
    stems = _list_stems(reduce_name(name))
    without_unit = {reduce_name(name).removesuffix(unit) for unit in ("", *_UNITS)}
    for column in columns:
        reduced, stem = reduce_name(column), _strip_unit(column)
        if stems & _list_stems(reduced) or (stem != reduced and stem in without_unit):
            return column
    return None


def _list_stems(name: str) -> set[str]:
    """A reduced name, and the name without the ending of a plural or a participle."""
    return {name.removesuffix(ending) for ending in _WORD_ENDINGS}


def _strip_unit(column: str) -> str:
    """Reduced name of a declared column without its unit."""
    stem, _, unit = column.rpartition("_")
    return reduce_name(stem if stem and unit.casefold() in _UNITS else column)
