"""Tables of wheels, rails, pairs and positions: inputs, columns of the user, paths and messages."""

import os
from pathlib import Path

import duckdb
import pyarrow
import pytest
from inline import inline_crew, stand_ins
from pyarrow.parquet import read_table, write_table

import fecontact
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.features.fleet import screening
from fecontact.features.fleet.answer import _merge_kinds, evaluate_fleet
from fecontact.features.fleet.model import read_fleet
from fecontact.features.fleet.population import Candidate, find_candidates, list_candidates, list_table_pairs
from fecontact.features.fleet.profile_files import ReadProfile, select_reading
from fecontact.features.fleet.report import write_headline
from fecontact.features.fleet.table_columns import (
    PAIR_LAYOUT,
    POSITION_LAYOUT,
    RESULT_COLUMNS,
    make_profile_layout,
)
from fecontact.features.fleet.tables import open_tables
from fecontact.profiles.examples import write_examples

GUIDE = Path(__file__).parents[2] / "fecontact" / "guide" / "fleet.md"
FLEET = """
[wheels]
files = "{wheels}"
[rails]
files = "{rails}"
[shifts_mm]
values = [0]
[loads_kN]
values = [60]
"""


def write_fleet_file(folder, *, wheels="wheels.csv", rails="60E1", rest=""):
    (folder / "fleet.toml").write_text(FLEET.format(wheels=wheels, rails=rails) + rest)
    return folder / "fleet.toml"


def write_csv(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))


def write_parquet(path, **columns):
    write_table(pyarrow.table(columns), path)


def refusal(path):
    """Message of the refusal of a fleet."""
    with pytest.raises(InputError) as error:
        fecontact.check_fleet(path)
    return str(error.value)


def test_the_guide_has_the_declared_columns():
    for layout in (make_profile_layout("wheel"), PAIR_LAYOUT, POSITION_LAYOUT):
        rows = [
            f"| `{name}` | {column.help} | {column.allowed.removeprefix('a text (').removesuffix(')')} |"
            if column.allowed.startswith("a text")
            else f"| `{name}` | {column.help} | {column.allowed} |"
            for name, column in layout.inputs.items()
        ]
        assert "\n".join(rows) in GUIDE.read_text("utf-8")


def test_a_row_of_profiles_has_the_columns_of_the_program():
    profile = ReadProfile(candidate=Candidate(body="wheel", name="a", spec="S1002"), record={"status": "read"})
    assert tuple(profile.row) == RESULT_COLUMNS


CLASHING = "wear_mm,status,noise_um,nominal,reason,filter_mm,remedy,content_hash,body"


@pytest.fixture
def run_without_contacts(monkeypatch):
    """Run of a fleet that reads its files, with a stored row for each position."""

    def make_rows(self):
        row = {"verdict": "HOLDS", "margin": 3.0, "variants": 1.0}
        return [{"shift_mm": shift, "load_kN": load, **row} for shift, load in self.positions]

    monkeypatch.setattr(screening.ScreeningPair, "rows", make_rows)

    def run(path, out):
        with stand_ins(inline_crew(), None, ""):
            return fecontact.run_fleet(path, out)

    return run


def test_columns_of_the_user_are_kept_whatever_their_names_are(tmp_path, run_without_contacts, capsys):
    names = CLASHING.split(",")
    values = ["1.5", "in service", "9", "new", "turned, then measured", "3", "none", "abc", "B7"]
    cells = ",".join(f'"{value}"' for value in values)
    write_csv(tmp_path / "wheels.csv", f"file,name,vehicle,Status code,{CLASHING}\nS1002,007,1e3,7,{cells}\n")
    write_csv(tmp_path / "rails.csv", "file,name,line,Reader_Notes\n60E1,1e3,007,dry\n54E1,a,0042,wet\n")
    path = write_fleet_file(tmp_path, rails="rails.csv")
    run_without_contacts(path, tmp_path / "out")
    wheel, *rails = read_table(tmp_path / "out" / "profiles.parquet").to_pylist()
    stored = [1.5, "in service", 9, "new", "turned, then measured", 3, "none", "abc", "B7"]
    assert {name: wheel[f"user_{name}"] for name in names} == dict(zip(names, stored, strict=True))
    assert (wheel["name"], wheel["vehicle"], wheel["Status code"]) == ("007", "1e3", 7)
    assert (wheel["status"], wheel["body"], wheel["wear_mm"]) == ("read", "wheel", None)
    assert [(rail["name"], rail["line"], rail["user_Reader_Notes"]) for rail in rails] == [
        ("1e3", "007", "dry"),
        ("a", "0042", "wet"),
    ]
    # the tables of SQL have each column once, and the names of a screen are texts
    with open_tables(tmp_path / "out") as tables:
        assert tables.execute("SELECT user_status FROM profiles WHERE status = 'read' AND name = '007'").fetchall() == [
            ("in service",)
        ]
        assert {row[:2] for row in tables.execute("SELECT wheel, rail FROM screen").fetchall()} == {
            ("007", "1e3"),
            ("007", "a"),
        }
    assert evaluate_fleet(tmp_path / "out").whole.positions == 2
    assert call(["fleet", "check", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(
        "wheels.csv: inputs file, name; kept as metadata: vehicle, Status code, wear_mm, status,"
    )
    for name in names:
        assert f"'{name}' is kept as user_{name}" in lines[0]
    assert lines[1] == (
        "rails.csv: inputs file, name; kept as metadata: line, Reader_Notes; 'Reader_Notes' is kept as"
        " user_Reader_Notes"
    )


def test_columns_of_several_tables_have_one_type_and_one_spelling(tmp_path):
    write_csv(tmp_path / "wheels.csv", "file,km,age\nS1002,12,1\nEN13715_1in40,,2.50\n")
    write_csv(tmp_path / "rails.csv", "file,km\n60E1,12a\n")
    path = write_fleet_file(tmp_path, rails="rails.csv")
    assert [candidate.metadata for candidate in list_candidates(read_fleet(path))] == [
        {"km": "12", "age": 1},
        {"km": None, "age": 2.5},
        {"km": "12a"},
    ]
    write_parquet(tmp_path / "rails.parquet", file=["60E1"], km=[3.5])
    path = write_fleet_file(tmp_path, rails="rails.parquet")
    assert [candidate.metadata["km"] for candidate in list_candidates(read_fleet(path))] == [12, None, 3.5]
    for columns, names in (("Km", "'km' and 'Km'"), ("user_status,status", "'user_status' and 'status'")):
        write_csv(tmp_path / "rails.csv", f"file,{columns}\n60E1,1{',2' * columns.count(',')}\n")
        assert f"columns {names} have equal names" in refusal(write_fleet_file(tmp_path, rails="rails.csv"))


def test_a_profile_with_two_names_counts_once(tmp_path):
    write_csv(tmp_path / "wheels.csv", "file\nLMB\nS1002\ns1002CN\n")
    write_csv(tmp_path / "rails.csv", "file\nUIC60\n60E1\n60E2\n")
    path = write_fleet_file(tmp_path, rails="rails.csv")
    cost = fecontact.check_fleet(path)
    assert (cost.wheels, cost.rails, cost.pairs) == (1, 2, 2)
    problems = [candidate.problem for candidate in list_candidates(read_fleet(path)) if candidate.problem]
    assert problems == ["same content as LMB", "same content as LMB", "same content as UIC60"]


def test_a_name_that_the_library_cannot_have_is_refused_with_the_reason(tmp_path):
    write_csv(tmp_path / "rails.csv", "file\n60E1\nR65\n60E9\nabsent.csv\n")
    fleet = read_fleet(write_fleet_file(tmp_path, wheels="S1002", rails="rails.csv"))
    usual, gost, misspelt, absent = find_candidates(fleet, "rail")
    assert not usual.problem
    assert gost.problem.startswith("the rail 'R65' (GOST R 51685) is not in the library")
    assert gost.remedy.startswith("give a file of your own")
    assert (misspelt.problem, misspelt.remedy[:17]) == ("there is no profile '60E9'", "did you mean 60E2")
    assert absent.remedy == "check the path"


def test_an_unusual_input_of_all_positions_is_noted(tmp_path, capsys):
    path = write_fleet_file(tmp_path, wheels="S1002", rest="[case]\nrolling_radius_mm = 0.46\n")
    assert call(["fleet", "check", str(path)]) == 0
    assert "rolling radius is 0.46 mm; usual: 100 to 1000" in capsys.readouterr().out


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize(
    ("body", "column", "cell", "typed_cell", "message"),
    [
        ("wheel", "mirror", "left", "no", "row 2: mirror is '{}'; allowed: yes or no, true or false"),
        ("wheel", "mirror", "1", 1, "row 2: mirror is "),
        ("wheel", "weight", "much", "much", "row 2: weight is 'much'; allowed: a number (no unit, 0 to 1e+15)"),
        ("wheel", "weight", "-1", -1.0, "row 2: weight is -1.0; allowed: 0 to 1e+15"),
        ("wheel", "rolling_radius_mm", "0", 0.0, "row 2: rolling_radius_mm is 0.0 mm; allowed: finite and > 0"),
        ("wheel", "rolling_radius_mm", "0.46", 0.46, "rolling_radius_mm is 0.46 mm; usual: 100 to 1000;"),
        ("wheel", "tape_circle_mm", "7000", 7000.0, "row 2: tape_circle_mm is 7000.0 mm; allowed: -1000 to 1000 mm"),
        ("wheel", "units", "foot", "foot", "row 2: units is 'foot'; allowed: mm, m, cm, um, in"),
        ("wheel", "Weight", "1", 1, "column 'Weight' is not an input; did you mean weight?"),
        ("wheel", "mirrored", "yes", True, "column 'mirrored' is not an input; did you mean mirror?"),
        ("wheel", "rolling_radius_m", "0.46", 0.46, "did you mean rolling_radius_mm, in mm?"),
        ("rail", "rolling_radius_mm", "460", 460, "column 'rolling_radius_mm' is not allowed; only wheels have it"),
        ("rail", "Tape circle [mm]", "70", 70, "column 'Tape circle [mm]' is not allowed; only wheels have it"),
    ],
)
def test_a_value_or_name_that_cannot_be_is_refused(tmp_path, ending, body, column, cell, typed_cell, message):
    files = {"wheel": ["S1002", "EN13715_1in40"], "rail": ["60E1", "54E1"]}
    table = tmp_path / f"table.{ending}"
    if ending == "csv":
        write_csv(table, f"file,{column}\n{files[body][0]},\n{files[body][1]},{cell}\n")
    else:
        write_parquet(table, **{"file": files[body], column: [None, typed_cell]})
    path = write_fleet_file(tmp_path, **{"wheels": "S1002", "rails": "60E1", f"{body}s": table.name})
    text = refusal(path)
    assert message.format(cell if ending == "csv" else typed_cell) in text
    assert str(table) in text


def test_options_of_reading_of_a_row_replace_those_of_the_fleet(tmp_path, run_without_contacts):
    columns = "file,name,mirror,units,columns,tape_circle_mm,repair\n"
    write_csv(tmp_path / "wheels.csv", f'{columns}S1002,a,no,cm,"2,3",70,yes\nS1002,b,,,,,\n')
    path = write_fleet_file(tmp_path, rest='[case.wheel_file]\nmirror = true\nunits = "mm"\n')
    fleet = read_fleet(path)
    first, second = (select_reading(fleet, candidate) for candidate in find_candidates(fleet, "wheel"))
    assert (first.mirror, first.units, first.columns, first.tape_circle_mm, first.repair) == (
        False,
        "cm",
        "2,3",
        70,
        True,
    )
    assert second == fleet.case.wheel_file
    # a screened fleet makes its cases with the options of the row
    _, wheel = write_examples(tmp_path)
    lines = [line for line in wheel.read_text("utf-8").splitlines() if line[:1] in "-0123456789"]
    numbers = [tuple(map(float, line.replace(",", " ").split()[:2])) for line in lines]
    (tmp_path / "m.csv").write_text("".join(f"{y / 10:.7f},{z / 10:.7f}\n" for y, z in numbers))
    write_csv(tmp_path / "wheels.csv", "file,units,mirror\nm.csv,cm,no\n")
    run_without_contacts(write_fleet_file(tmp_path), tmp_path / "out")
    case = fecontact.open_fleet(tmp_path / "out").case("m", "60E1", 0.0, 60.0)
    assert (case.wheel_file.units, case.wheel_file.mirror) == ("cm", False)


def test_paths_of_a_table_are_relative_to_it_or_absolute_and_no_patterns(tmp_path):
    _, wheel = write_examples(tmp_path / "ex")
    folder = tmp_path / "lists [1]"
    (folder / "sub*").mkdir(parents=True)
    paths = [folder / "sub*" / "a[x]?.csv", tmp_path / "Länge 2.csv", folder / " b.csv", folder / 'q"uote,.csv']
    for number, path in enumerate(paths):
        path.write_text(wheel.read_text("utf-8") + f"# {number}\n")
    cells = ["sub*/a[x]?.csv", str(paths[1]), " b.csv", '"q""uote,.csv"']
    write_csv(folder / "wheels.csv", "file\n" + "\n".join(cells) + "\n")
    (tmp_path / "fleet.toml").write_text(FLEET.format(wheels="S1002", rails="60E1"))
    fleet = read_fleet(write_fleet_file(folder))
    candidates = find_candidates(fleet, "wheel")
    assert [candidate.spec for candidate in candidates] == list(map(str, paths))
    assert [candidate.problem for candidate in candidates] == [""] * 4


def test_a_path_that_is_not_utf_8_is_refused_and_the_others_are_read(tmp_path, run_without_contacts):
    _, wheel = write_examples(tmp_path / "ex")
    folder = tmp_path / os.fsdecode(b"d\xe4")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("this file system has only names in UTF-8")
    text = wheel.read_text("utf-8")
    (folder / "w.csv").write_text(text + "# 1\n")
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / os.fsdecode(b"x\xe4.csv")).write_text(text + "# 2\n")
    (tmp_path / "mixed" / "y.csv").write_text(text + "# 3\n")
    run_without_contacts(write_fleet_file(tmp_path, wheels="mixed"), tmp_path / "out")
    rows = duckdb.sql(f"SELECT name, status, reason FROM '{tmp_path}/out/profiles.parquet' ORDER BY name").fetchall()
    assert rows == [
        ("60E1", "read", ""),
        ("x\\xe4", "refused", "the name of the file or of its folder is not UTF-8"),
        ("y", "read", ""),
    ]
    write_csv(folder / "wheels.csv", "file\nw.csv\n")
    assert "[wheels]: 0 of 1 file can be used; first reason: the name of the" in refusal(write_fleet_file(folder))


def test_names_of_pairs_are_the_texts_of_the_tables(tmp_path):
    write_csv(tmp_path / "wheels.csv", "file,name\nS1002,007\nEN13715_1in40,7\n")
    write_csv(tmp_path / "pairs.csv", "wheel;rail;weight;note\n007;60E1;1,5;a\n7;60E1;0,5;b\n")
    names = {("wheel", "007"), ("wheel", "7"), ("rail", "60E1")}
    assert list_table_pairs(tmp_path / "pairs.csv", names) == [(("007", "60E1"), 1.5), (("7", "60E1"), 0.5)]
    write_fleet_file(tmp_path, rest='[pairs]\ntable = "pairs.parquet"\n')
    write_parquet(tmp_path / "pairs.parquet", wheel=["007", "7"], rail=["60E1"] * 2, weight=[3, 1])
    assert list_table_pairs(tmp_path / "pairs.parquet", names) == [(("007", "60E1"), 3.0), (("7", "60E1"), 1.0)]
    write_parquet(tmp_path / "pairs.parquet", wheel=[7, 7], rail=["60E1"] * 2)
    assert "row 1: wheel is 7; allowed: a text" in refusal(tmp_path / "fleet.toml")
    write_csv(tmp_path / "pairs.csv", "wheel,rail\n007,60E1\n07,60E1\n")
    path = write_fleet_file(tmp_path, rest='[pairs]\ntable = "pairs.csv"\n')
    assert "row 2: there is no wheel 07" in refusal(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("shift_mm;load_kN\n2,5;60\n-1;55,5\n", None),
        ("shift_mm,load_kN\n2.5,60\n-1,55.5\n", None),
        ("shift_mm,load_kN\n2.5,60\n-1,2000000\n", "row 2: load_kN is 2000000000.0 N (2e+06 kN); allowed: 1 to"),
        ("shift_mm,load_kN\n99,60\n", "row 1: shift_mm is 99.0 mm; allowed: -60 to 60 mm"),
        ("shift,load_kN\n9,60\n", "column 'shift' is not an input; did you mean shift_mm, in mm?"),
        ("shift_mm,load_N\n9,60\n", "did you mean load_kN, in kN?"),
    ],
)
def test_positions_are_numbers_in_their_units(tmp_path, content, message):
    write_csv(tmp_path / "places.csv", content)
    path = tmp_path / "fleet.toml"
    path.write_text('[wheels]\nfiles = "S1002"\n[rails]\nfiles = "60E1"\n[positions]\ntable = "places.csv"\n')
    if message is None:
        assert read_fleet(path).positions == {(-1.0, 55.5): 0.5, (2.5, 60.0): 0.5}
    else:
        assert message in refusal(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("file,Länge\nS1002,1\n".encode("latin-1"), "line 1 has the byte 0xE4, which is not UTF-8"),
        (b"File;Weight\nS1002;1\n", "column 'File' is not an input; did you mean file?"),
        (b"path,weight\nS1002,1\n", "no column file; columns: path, weight; add the column"),
        (b"file,weight\n", "row 1 is missing"),
        (b'file,weight\n"S1002,1\n', "row 1 (line 2): not CSV"),
        (b"file,weight\nS1002\n", "row 1 (line 2): 1 cell for 2 named columns"),
        (b"file,weight\n,1\n", "row 1: file is empty"),
        (b"file,weight\nS10\x0002,1\n", "line 2 has a NUL character"),
    ],
)
def test_a_defect_of_a_table_is_one_line_of_the_command(tmp_path, capsys, content, message):
    (tmp_path / "wheels.csv").write_bytes(content)
    path = write_fleet_file(tmp_path)
    for command in (["fleet", "check", str(path)], ["fleet", "run", str(path), "--out", str(tmp_path / "out")]):
        assert call(command) == 2
        captured = capsys.readouterr()
        (line,) = captured.err.splitlines()
        assert message in line
        assert "wheels.csv" in line


def test_a_name_that_a_row_repeats_is_refused(tmp_path):
    write_csv(tmp_path / "wheels.csv", "file,name\nS1002,a\nEN13715_1in40,\nCONE40,a\n")
    assert "wheels.csv, row 3: name is 'a', as in row 1; allowed: a different name" in refusal(
        write_fleet_file(tmp_path)
    )


def test_utf_16_tables_of_spreadsheets_are_read(tmp_path):
    write_csv(tmp_path / "wheels.csv", "file\tweight\tStraße\nS1002\t2\t007\n", "utf-16")
    (wheel,) = find_candidates(read_fleet(write_fleet_file(tmp_path)), "wheel")
    assert (wheel.name, wheel.weight, wheel.metadata) == ("S1002", 2.0, {"Straße": "007"})


def test_a_fleet_of_drawn_pairs_has_an_answer_without_its_unused_files(tmp_path, run_without_contacts, capsys):
    write_csv(tmp_path / "wheels.csv", "file\nS1002\nEN13715_1in40\nAPTA340\n")
    path = write_fleet_file(tmp_path, rest="[pairs]\ndraw = 1\n")
    screening = run_without_contacts(path, tmp_path / "out")
    assert (screening.pairs, screening.profiles, screening.unused) == (1, 2, 2)
    statuses = duckdb.sql(f"SELECT status, count(*) FROM '{tmp_path}/out/profiles.parquet' GROUP BY ALL").fetchall()
    assert sorted(statuses) == [("read", 2), ("unused", 2)]
    assert call(["fleet", "report", str(tmp_path / "out")]) == 0
    answer = evaluate_fleet(tmp_path / "out")
    assert "0 % of the files could not be read; 2 files in no pair are left out" in write_headline(answer)
    capsys.readouterr()
    assert call(["fleet", "check", str(path)]) == 0
    assert "1 wheel, 1 rail, 1 pair, 1 position; 2 files in no pair, not read" in capsys.readouterr().out


def test_notes_that_differ_by_numbers_are_a_single_row():
    rows = [
        {"body": "rail", "note": "12 of 500 points are left out", "files": 1, "example": "/a/r1.csv"},
        {"body": "rail", "note": "3 of 400 points are left out", "files": 2, "example": "/a/r2.csv"},
        {"body": "wheel", "note": "w.csv: y is mirrored", "files": 1, "example": "/a/w.csv"},
    ]
    merged_rows = [(row["note"], row["files"], row["example"]) for row in _merge_kinds(rows, "note")]
    assert merged_rows == [("w.csv: y is mirrored", 1, "/a/w.csv"), (rows[0]["note"], 3, "/a/r1.csv")]
