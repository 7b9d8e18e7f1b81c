"""Tables that users give: types by declaration, names of columns, encodings, and defects of CSV and Parquet files."""

import csv
import io
import math
import re
import tracemalloc
from contextlib import suppress
from dataclasses import dataclass
from datetime import date

import numpy as np
import pyarrow
import pytest
from marks import slow_but
from pyarrow.parquet import write_table

from fecontact.errors import InputError
from fecontact.inputs.kinds import Input, choice_field, flag_field, number_field, text_field
from fecontact.inputs.slots import input_dataclass, list_descriptions
from fecontact.inputs.user_tables import TableLayout, convert_plain_numbers, read_user_table


@input_dataclass
class Columns:
    file: str = text_field("", "File", "a path, not empty")
    weight: float = number_field(1.0, "Weight", low=0.0, high=1e6)
    radius_mm: float | None = number_field(None, "Radius", remedy="give a radius")
    load_N: float | None = number_field(None, "Load", shown_unit="kN", low=1.0, high=1e9)
    mirror: bool | None = flag_field("Side", default=None)
    units: str | None = choice_field(None, "Unit", ("mm", "m"))


@dataclass(frozen=True)
class Table:
    """File with the cells of a table."""

    folder: object

    def csv(self, content):
        path = self.folder / "table.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_user_table(path, LAYOUT)

    def parquet(self, **columns):
        path = self.folder / "table.parquet"
        write_table(pyarrow.table(columns), path)
        return read_user_table(path, LAYOUT)


DESCRIPTIONS = list_descriptions(Columns)
LAYOUT = TableLayout(
    inputs={"load_kN" if name == "load_N" else name: column for name, column in DESCRIPTIONS.items()},
    required=("file",),
    most_rows=1000,
    refused={"depth_mm": "leave it out"},
    remarks={"inclination": "give it in the file"},
)


@pytest.fixture
def table(tmp_path):
    return Table(tmp_path)


def test_a_text_stays_a_text_and_a_number_is_what_its_column_declares(table):
    rows = table.csv("file,weight,line,load_kN\n007,1e3,007,60.5\n1e3,,1e3,\n")
    assert [row.values for row in rows] == [{"file": "007", "weight": 1000.0, "load_kN": 60.5}, {"file": "1e3"}]
    assert [row.metadata for row in rows] == [{"line": "007"}, {"line": "1e3"}]
    assert [row.number for row in rows] == [1, 2]


@pytest.mark.parametrize(
    ("text", "value"),
    [("yes", True), ("No", False), ("TRUE", True), (" false ", False), ("", None), ("  ", None)],
)
def test_a_truth_value_has_four_words(table, text, value):
    assert table.csv(f"file,mirror\na,{text}\n")[0].values.get("mirror") is value


@pytest.mark.parametrize("text", ["n", "y", "left", "0", "1", "ja", "nein", "None", "nan", "yes no", "on", "-"])
def test_any_other_truth_value_is_refused_with_its_place(table, text):
    message = rf"table .*table\.csv, row 2: mirror is '{text}'; allowed: yes or no, true or false"
    with pytest.raises(InputError, match=message):
        table.csv(f"file,mirror\na,yes\nb,{text}\n")


@pytest.mark.parametrize(
    ("column", "text", "message"),
    [
        *(("weight", text, "allowed: a number (no unit, 0 to 1000000)") for text in ("much", "nan", "inf", "1_000")),
        *(("weight", text, "allowed: a number (no unit, 0 to 1000000)") for text in ("0x10", "١٢", "1 000", "1;2")),
        ("weight", "-1", "allowed: 0 to 1000000"),
        ("weight", "2000000", "allowed: 0 to 1000000"),
        ("weight", '"1,5"', "a number with a decimal point"),
        ("radius_mm", "-3", "allowed: finite and > 0"),
        ("load_kN", "0", "allowed: 1 to 1000000000 N"),
        ("units", "MM", "allowed: mm, m"),
    ],
)
def test_a_value_outside_its_declaration_is_refused_with_its_place(table, column, text, message):
    with pytest.raises(InputError) as refusal:
        table.csv(f"file,{column}\na,\nb,{text}\n")
    refusal_text = str(refusal.value)
    assert f"row 2: {column} is " in refusal_text
    assert message in refusal_text
    assert text.strip('"') in refusal_text


@pytest.mark.parametrize(
    "name",
    ["Weight", "weight ", " WEIGHT", "weights", "Mirrored", "mirror?", "radius", "Radius [mm]", "radius_m", "Load"],
)
def test_a_name_like_an_input_is_refused_with_the_input(table, name):
    nearest = next(column for column in LAYOUT.inputs if column[:4] == name.strip().lower()[:4])
    with pytest.raises(InputError, match=rf"column {re.escape(repr(name))} is not an input; did you mean {nearest}"):
        table.csv(f"file,{name}\na,1\n")
    with pytest.raises(InputError, match=rf"did you mean {nearest}"):
        table.parquet(file=["a"], **{name: [1]})


def test_names_of_other_columns_are_kept_with_remarks(table):
    names = ["file", "height", "weight_kg", "inclination", "line", "radius_of_the_curve_m"]
    assert LAYOUT.list_metadata(names) == names[1:]
    assert LAYOUT.list_remarks(names) == [
        "'height' is not the input weight",
        "'weight_kg' is not the input weight",
        "'inclination' is not used: give it in the file",
    ]
    assert list(table.csv(f"{','.join(names)}\na,1,2,3,4,5\n")[0].metadata.values()) == ["1", "2", "3", "4", "5"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("file,line,line\na,1,2\n", "columns 2 and 3 are both named 'line'"),
        ("file,Line,line\na,1,2\n", "columns 2 and 3 are both named 'line'"),
        ("file,,line\na,1,2\n", "name of column 2 is ''"),
        ("file, ,line\na,1,2\n", "name of column 2 is ' '"),
        ("line\n1\n", "no column file; columns: line; add the column"),
        ("file,depth\na,1\n", "column 'depth' is not allowed; leave it out"),
        ("file,line\na,1\nb\n", "row 2 (line 3): 1 cell for 2 named columns"),
        ("file,line\na,1\n\nb,2,3\n", "row 2 (line 4): 3 cells for 2 named columns"),
        ('file,line\na,1\nb,"2\nc,3\n', "row 2 (line 3): not CSV"),
        ('file,line\na,"1"2\n', "row 1 (line 2): not CSV"),
        ('file,"line\na,1\n', "names of the columns (line 1): not CSV"),
        ("", "row 1 is missing: the file is empty"),
        ("\n \r\n", "row 1 is missing: the file is empty"),
        ("\ufeff", "row 1 is missing: the file is empty"),
        ("file,line\n", "row 1 is missing: there are no rows"),
        ("file,line\na,1\n ,2\n", "row 2: file is empty; allowed: a text (a path, not empty)"),
        ("file,line\na,1\nb,\0\n", "line 3 has a NUL character"),
        (f"file,line\na,1\nb,{'x' * 200_000}\n", "row 2 (line 3): not CSV (field larger than field limit"),
        (f"file,line\na,1\n{'x' * 120_000},1\n", "row 2: file has 120000 characters"),
        ("file;line,km\na;1,2\n", "commas and semicolons separate the names of the columns"),
        ("file\n" + "a\n" * 1001, "1001 rows; allowed: at most 1000"),
    ],
)
def test_a_defect_of_a_file_is_refused_with_its_row(table, content, message):
    with pytest.raises(InputError, match=re.escape(message)) as refusal:
        table.csv(content)
    assert "table.csv" in str(refusal.value)


TEXT = "file;line;Länge\na;Zürich;1,5\nb;Köln;2,5\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be with mark"])
def test_encodings_that_a_mark_or_utf_8_defines_are_read(table, encoding):
    content = b"\xfe\xff" + TEXT.encode("utf-16-be") if "mark" in encoding else TEXT.encode(encoding)
    rows = table.csv(content)
    assert [row.metadata for row in rows] == [{"line": "Zürich", "Länge": "1.5"}, {"line": "Köln", "Länge": "2.5"}]


@pytest.mark.parametrize(
    ("encoding", "message"),
    [
        ("latin-1", "line 1 has the byte 0xE4, which is not UTF-8; perhaps it is Latin-1 or Windows-1252; save"),
        ("cp1252", "line 1 has the byte 0xE4"),
        ("utf-16-le", "NUL character; perhaps the file is UTF-16 or UTF-32 without a byte order mark"),
        ("utf-32", "NUL character"),
    ],
)
def test_other_encodings_are_refused_with_the_remedy(table, encoding, message):
    with pytest.raises(InputError, match=message):
        table.csv(TEXT.encode(encoding))


def test_a_damaged_utf_16_file_is_refused(table):
    with pytest.raises(InputError, match="not UTF-16"):
        table.csv(TEXT.encode("utf-16") + b"\x41")


def test_semicolons_allow_decimal_commas_in_all_numbers_or_in_none(table):
    rows = table.csv("file;weight;radius_mm\na;1,5;460\nb;2;459,25\n")
    assert [row.values["weight"] for row in rows] == [1.5, 2.0]
    assert rows[1].values["radius_mm"] == 459.25
    assert table.csv("file;weight\na;1.5\n")[0].values["weight"] == 1.5
    assert table.csv("file\tweight\na\t1.5\n")[0].values["weight"] == 1.5
    with pytest.raises(
        InputError, match=r"row 2: weight is '2.5', but row 1 has '1,5'; allowed: a number with a decimal"
    ):
        table.csv("file;weight\na;1,5\nb;2.5\n")
    with pytest.raises(InputError, match=r"weight is '1.234,5'; allowed: a number"):
        table.csv("file;weight\na;1.234,5\n")
    with pytest.raises(InputError, match=r"weight is '1,5', but columns are separated by commas or tabs"):
        table.csv("file\tweight\na\t1,5\n")


def test_columns_of_the_user_with_decimal_commas_are_numbers_only_if_all_are(table):
    rows = table.csv("file;km;line\na;1,5;1,5\nb;2;2,5b\nc;;\n")
    assert [row.metadata for row in rows] == [
        {"km": "1.5", "line": "1,5"},
        {"km": "2", "line": "2,5b"},
        {"km": None, "line": None},
    ]


@pytest.mark.parametrize(
    ("texts", "values"),
    [
        (["12", "-3", "0"], [12, -3, 0]),
        (["12.50", None, "0.5"], [12.5, None, 0.5]),
        (["12", "1.5"], [12, 1.5]),
        (["007", "12"], ["007", "12"]),
        (["1e3", "12"], ["1e3", "12"]),
        (["+1", "12"], ["+1", "12"]),
        (["nan", "12"], ["nan", "12"]),
        (["1234567890123456", "12"], ["1234567890123456", "12"]),
        (["12", 3, 2.5], [12, 3, 2.5]),
        (["12a", 3, None], ["12a", "3", None]),
        (["12", True], ["12", "True"]),
        ([3, 2.5, None], [3, 2.5, None]),
        ([3, 2.5, True], ["3", "2.5", "True"]),
        ([True, False], [True, False]),
        ([date(2026, 1, 2), None], [date(2026, 1, 2), None]),
        ([date(2026, 1, 2), "2026-01-03"], ["2026-01-02", "2026-01-03"]),
    ],
)
def test_a_column_has_numbers_only_if_each_text_is_equal_to_its_number(texts, values):
    converted = convert_plain_numbers(texts)
    assert converted == values
    assert list(map(type, converted)) == list(map(type, values))


def test_types_of_parquet_are_taken_where_they_fit(table):
    rows = table.parquet(
        file=["007", "b"], weight=[1, None], radius_mm=[460.5, None], mirror=[True, None], units=["m", ""], line=[7, 8]
    )
    assert [row.values for row in rows] == [
        {"file": "007", "weight": 1.0, "radius_mm": 460.5, "mirror": True, "units": "m"},
        {"file": "b"},
    ]
    assert [row.metadata for row in rows] == [{"line": 7}, {"line": 8}]
    categories = pyarrow.array(["m", "m"]).dictionary_encode()
    assert [row.values["units"] for row in table.parquet(file=["a", "b"], units=categories)] == ["m", "m"]


@pytest.mark.parametrize(
    ("column", "cells", "message"),
    [
        ("mirror", ["no"], r"row 1: mirror is 'no'; allowed: yes or no, true or false \(str in the file\)"),
        ("mirror", [1], r"row 1: mirror is 1; .* \(int in the file\)"),
        ("weight", ["2"], r"row 1: weight is '2'; allowed: a number .* \(str in the file\)"),
        ("weight", [True], r"row 1: weight is True"),
        ("weight", [math.nan], r"row 1: weight is nan; allowed: 0 to 1000000"),
        ("weight", [b"2"], r"row 1: weight is b'2'"),
        ("weight", [[2.0]], r"row 1: weight is \[2.0\]"),
        ("units", [1.0], r"row 1: units is 1.0; allowed: mm, m"),
        ("units", ["cm"], r"row 1: units is 'cm'; allowed: mm, m"),
    ],
)
def test_types_of_parquet_that_do_not_fit_are_refused(table, column, cells, message):
    with pytest.raises(InputError, match=message):
        table.parquet(file=["a"], **{column: cells})


def test_cells_of_the_user_in_parquet_are_kept_if_a_table_of_results_can_have_them(table):
    rows = table.parquet(file=["a", "b"], km=[1.5, math.nan], day=[date(2026, 1, 2), None], turned=[True, False])
    assert [list(row.metadata.values()) for row in rows] == [[1.5, date(2026, 1, 2), True], [None, None, False]]
    for cell in (math.inf, [1, 2], {"a": 1}):
        with pytest.raises(InputError, match=r"row 1: km is .*; allowed: a text, a finite number"):
            table.parquet(file=["a"], km=[cell])
    with pytest.raises(InputError, match="row 1: km is 18446744073709551615"):
        table.parquet(file=["a"], km=pyarrow.array([2**64 - 1], pyarrow.uint64()))


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([7.0], "row 1: file is 7.0"),
        ([None], "row 1: file is empty"),
        ([""], "row 1: file is empty"),
        (["a\0b"], "without NUL"),
    ],
)
def test_a_path_of_parquet_that_cannot_be_is_refused(table, cells, message):
    with pytest.raises(InputError, match=message):
        table.parquet(file=cells)


def test_defects_of_parquet_files_are_refused(table, tmp_path):
    path = tmp_path / "table.parquet"
    write_table(pyarrow.Table.from_arrays([pyarrow.array(["a"])] * 3, names=["file", "line", "line"]), path)
    with pytest.raises(InputError, match="columns 2 and 3 are both named 'line'"):
        read_user_table(path, LAYOUT)
    with pytest.raises(InputError, match="row 1 is missing"):
        table.parquet(file=pyarrow.array([], pyarrow.string()))
    with pytest.raises(InputError, match="1001 rows; allowed: at most 1000"):
        table.parquet(file=["a"] * 1001)
    bad_text = pyarrow.Array.from_buffers(
        pyarrow.string(), 1, [None, pyarrow.py_buffer(np.array([0, 1], np.int32)), pyarrow.py_buffer(b"\xe4")]
    )
    with pytest.raises(InputError, match="cannot be read"):
        table.parquet(file=bad_text)
    content_bytes = path.read_bytes()
    for content in (b"", b"PAR1", content_bytes[: len(content_bytes) // 2], b"file,line\na,1\n"):
        path.write_bytes(content)
        with pytest.raises(InputError, match="cannot be read"):
            read_user_table(path, LAYOUT)
    path.unlink()
    for place in (path, tmp_path, tmp_path / "none.csv", tmp_path / "n\0.csv"):
        with pytest.raises(InputError, match="cannot be read"):
            read_user_table(place, LAYOUT)


CELLS = [
    "",
    " ",
    "yes",
    "no",
    "left",
    "1",
    "007",
    "1e3",
    "-1",
    "1,5",
    "1.5",
    "nan",
    "ä",
    '"',
    "a\nb",
    "=1+1",
    "a/b",
    "m",
]
NAMES = ["file", "weight", "radius_mm", "load_kN", "mirror", "units", "line", "Weight", "wear_mm", "ä", "a,b", ""]


def reference(names, cells):
    """Value of each cell by the declarations, without the code of the reader; None if a cell is not allowed."""
    values = {}
    for name, cell in zip(names, cells, strict=True):
        if name == "file" and not cell.strip():
            return None
        if name not in LAYOUT.inputs or not cell.strip():
            continue
        if name == "mirror":
            value = {"yes": True, "no": False}.get(cell)
        elif name == "units":
            value = cell if cell == "m" else None
        elif name == "file":
            value = cell
        else:
            value = float(cell) if re.fullmatch(r"-?[0-9.]+(e[0-9]+)?", cell) else None
            smallest = {"weight": 0.0, "load_kN": 0.001}.get(name, 1e-12)
            value = value if value is not None and value >= smallest else None
        if value is None:
            return None
        values[name] = value
    return values


@pytest.mark.parametrize("table_count", slow_but([400, 4000], 0))
def test_random_tables_are_read_as_declared_or_refused(table, table_count):
    random, counts = np.random.default_rng(20261128), {"read": 0, "refused": 0}
    for number in range(table_count):
        names = ["file", *random.choice(NAMES, random.integers(0, 4), replace=number % 50 == 0)]
        rows = [[str(random.choice(CELLS)) for _ in names] for _ in range(random.integers(1, 3))]
        buffer = io.StringIO()
        csv.writer(buffer, quoting=csv.QUOTE_ALL).writerows([names, *rows])
        # empty columns at the right end are left out
        while names[-1] == "" and not any(cells[-1].strip() for cells in rows):
            names, rows = names[:-1], [cells[:-1] for cells in rows]
        expected = [reference(names, cells) for cells in rows]
        are_names_good = len(set(names)) == len(names) and "" not in names and "Weight" not in names
        is_good = None not in expected and are_names_good
        counts["read" if is_good else "refused"] += 1
        if not is_good:
            with pytest.raises(InputError, match=r"table\.csv"):
                table.csv(buffer.getvalue())
            continue
        read_rows = table.csv(buffer.getvalue())
        assert [row.values for row in read_rows] == expected
        for row, cells in zip(read_rows, rows, strict=True):
            metadata = {
                name: cell or None for name, cell in zip(names, cells, strict=True) if name not in LAYOUT.inputs
            }
            assert row.metadata == metadata
    assert min(counts.values()) > table_count // 10, counts


@pytest.mark.parametrize("table_count", slow_but([400, 4000], 0))
def test_random_bytes_in_a_table_are_never_more_than_a_refusal(table, table_count):
    random = np.random.default_rng(7)
    content = 'file;weight;line\na;1,5;Zürich\nb;2;"x;y"\nc;;007\n'.encode()
    count = 0
    for _ in range(table_count):
        changed = bytearray(content)
        for place in random.integers(0, len(content), random.integers(1, 4)):
            changed[place] = random.choice([0, 9, 10, 13, 34, 44, 46, 59, 0xE4, 0xFF, int(random.integers(256))])
        with suppress(InputError):
            table.csv(bytes(changed))
            count += 1
    # the others are refused; any other error ends the test
    assert table_count // 15 < count < 4 * table_count // 5


@pytest.mark.parametrize(
    "text",
    [
        "file,line,\na,1,\n",
        "file,line,,,\na,1,,,\nb,2\n",
        "file,line\na,1,,\n",
        "file,line, ,\na,1, ,\n",
        "sep=,\nfile,line\na,1\n",
        'SEP=;\r\nfile;"li,ne"\r\na;1\r\n'.replace('"li,ne"', "line"),
        '"sep=\t"\nfile\tline\na\t1\n',
        "sep=;;\nfile;line;\na;1;\n",
        "\ufeffsep=;\nfile;line\na;1\n",
    ],
)
def test_a_table_that_excel_wrote_is_read(tmp_path, text):
    """Empty columns at the right end, and a line that states the separator."""
    path = tmp_path / "table.csv"
    path.write_text(text, "utf-8", newline="")
    row = read_user_table(path, EXCEL_LAYOUT)[0]
    assert (dict(row.values), dict(row.metadata)) == ({"file": "a"}, {"line": "1"})


def test_the_stated_separator_is_not_guessed(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("sep=;\nfile;line, km\na;1\n", "utf-8")
    assert dict(read_user_table(path, EXCEL_LAYOUT)[0].metadata) == {"line, km": "1"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file,line,\na,1,\nb,1,x\n", "row 2 (line 3): 3 cells for 2 named columns"),
        ("file,,line\na,,1\n", "name of column 2 is ''"),
        ("sep=|\nfile|line\na|1\n", "line 1 states the separator '|'; allowed: comma, semicolon or tab"),
        ("sep=;\n", "the file is empty"),
        ("sep=;\nfile;line\na;1\nb\n", "row 2 (line 4): 1 cell for 2 named columns"),
    ],
)
def test_a_table_of_excel_that_is_not_clear_is_refused(tmp_path, text, said):
    path = tmp_path / "table.csv"
    path.write_text(text, "utf-8")
    with pytest.raises(InputError, match=re.escape(said)):
        read_user_table(path, EXCEL_LAYOUT)


@pytest.mark.parametrize(("name", "start"), [("a.xlsx", b"x"), ("a.ods", b""), ("a.csv", b"PK\x03\x04abc")])
def test_a_workbook_is_refused_with_its_remedy(tmp_path, name, start):
    path = tmp_path / name
    path.write_bytes(start)
    with pytest.raises(InputError, match="is a workbook of a spreadsheet; allowed: CSV or Parquet; save the table as"):
        read_user_table(path, EXCEL_LAYOUT)


EXCEL_LAYOUT = TableLayout(inputs={"file": Input(help="File", domain="text")}, required=("file",), most_rows=10)


def test_a_small_table_reserves_little_memory(table):
    """The largest allowed size would not fit under a limit of memory."""
    tracemalloc.start()
    try:
        table.csv("file,weight\na.csv,1\n")
        assert tracemalloc.get_traced_memory()[1] < 1e7
    finally:
        tracemalloc.stop()
