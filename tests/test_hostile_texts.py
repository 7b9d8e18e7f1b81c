"""Names are text: no output takes them for mathematics, markup or control of the terminal."""

import csv
import hashlib
import io
import json
import os
import shutil
import subprocess
import unicodedata
from contextlib import redirect_stderr, redirect_stdout
from importlib.resources import files
from pathlib import Path
from xml.dom import minidom

import pytest
from fuzz_fleets import write_fleet, write_rows
from marks import slow_but
from matplotlib.figure import Figure
from matplotlib.text import Text
from pyarrow import parquet

import fecontact
from fecontact.case import Case
from fecontact.cli import call
from fecontact.console.log import log_command
from fecontact.console.messages import announce, print_result
from fecontact.errors import InputError
from fecontact.features.curves.model import load_vehicle
from fecontact.files import explain_broken_seal, format_json, is_file_name, read_json, write_sealed
from fecontact.inputs.texts import escape_invisible, escape_line, quote_path
from fecontact.outputs.paraview.vtk import _to_ascii
from fecontact.outputs.parts import Lead
from fecontact.outputs.style import render_image, render_page, render_svg, show_text_literally
from fecontact.outputs.tables import write_csv
from fecontact.outputs.terminal import print_parts
from fecontact.profiles.library import load_library_profile, profile_identity
from fecontact.profiles.writers import csv_text
from fecontact.regression.check_pages import UnsolvedCases, render_reports
from fecontact.regression.checks import Check
from fecontact.regression.tables import _read_csv_rows

VISIBLE = (
    *(r"w$\frac{$x", "a$b$c", r"a\$b", "<script>alert(1)</script>".replace("/", "_"), "&amp;", "a_b^c{d}"),
    *("q'\"", "b\\s", "%s", "{x}", "[bold]x", "|a|", "x" * 251),
)
INVISIBLE = (
    "\x1b[31m",
    "\x1b]0;x\x07",
    "a\rb",
    "a\nb",
    "a\u202eb",
    "a\x9bb",
    "a\x7fb",
    "a\u2066b",
    os.fsdecode(b"n\xff"),
)
# controls, formats such as marks of direction, separators of lines and paragraphs, halves of characters
EXECUTED = {"Cc", "Cf", "Zl", "Zp", "Cs"}


def is_clean(text: str) -> bool:
    """Whether all characters of a text are printable or newlines."""
    return all(character.isprintable() or character == "\n" for character in text)


def run(*words: str) -> tuple[int, str]:
    """Exit code and printed text of a command."""
    out = io.StringIO()
    with redirect_stdout(out), redirect_stderr(out):
        code = call(words)
    return code, out.getvalue()


def check_files(folder: Path) -> int:
    """Check that text files are clean and pages well-formed; returns their number."""
    paths = [path for path in folder.rglob("*") if path.suffix in (".svg", ".html", ".csv", ".json", ".log", ".md")]
    for path in paths:
        text = path.read_text("utf-8")
        assert is_clean(text), path
        if path.suffix in (".svg", ".html"):
            elements = minidom.parseString(text.encode()).getElementsByTagName("script")
            assert not any("alert(1)" in element.toxml() for element in elements)
    return len(paths)


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """Writer of a wheel's file with a name, in the working folder."""
    monkeypatch.chdir(tmp_path)
    text = csv_text(load_library_profile("S1002"), step_mm=0.5)

    def write(name: str) -> str:
        Path(f"{name}.csv").write_text(text)
        return f"{name}.csv"

    return write


@pytest.mark.parametrize("name", slow_but(VISIBLE, 0, 3, 11), ids=ascii)
def test_names_are_drawn_and_printed_as_they_are(wheel, name):
    file = wheel(name)
    assert run("profiles", file, "--out", "out/profile.svg")[0] == 0
    code, printed = run("hertz", "--wheel", file)
    assert code == 0
    assert is_clean(printed)
    assert check_files(Path("out")) == 1


@pytest.mark.parametrize("name", slow_but([VISIBLE[0], "a$b$c", "<script>alert(1)", "x" * 251], 0, 3), ids=ascii)
def test_a_position_is_drawn_whatever_its_wheel_is_called(wheel, name):
    assert run("place", "--wheel", wheel(name), "--out", "out/place.svg")[0] == 0
    assert check_files(Path("out")) == 1


@pytest.mark.parametrize("name", INVISIBLE, ids=ascii)
def test_files_with_invisible_names_are_refused_in_a_clean_line(wheel, name):
    lines = [
        [name],
        ["run", f"{name}.toml"],
        ["compare", name, name],
        ["judge", name],
        ["guide", name],
        ["curve", "--vehicle", name, "--radii", "300"],
        ["check", name],
        ["hertz", f"--{name}=1"],
    ]
    for words in lines:
        code, printed = run(*words)
        assert code == 2
        assert is_clean(printed)


@pytest.mark.slow
@pytest.mark.parametrize("name", [VISIBLE[0], "<script>alert(1)", "x" * 251], ids=ascii)
def test_a_solved_case_is_written_whatever_its_wheel_is_called(wheel, name):
    coarse = ("--resolution", "1.6,1.3", "--refine", "never", "--wheel", wheel(name), "--shift", "3")
    code, printed = run("solve", *coarse, "--out", "out")
    assert code in (0, 3)
    assert is_clean(printed)
    assert check_files(Path("out")) > 2
    assert run("judge", "out", "--out", "judged")[0] == 0
    assert run("compare", "out", "out")[0] == 0
    shutil.rmtree("out")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["-s$\\frac{$x<b>&amp;<!--]]>\"'*[1]?%s;--\\b", "=s\x1b[31m\u202e\x9b\n\\'"], ids=ascii
)
def test_a_study_is_written_whatever_it_and_its_folder_are_called(wheel, name):
    """Study file, folder and wheel with hostile names, through the commands that use results."""
    file, out = wheel("=w" + VISIBLE[0] + "<b>&'\\b"), f"{name}o"
    study = f'wheel = {json.dumps(os.path.abspath(file))}\nlateral_shift_mm = 3.0\nresolution = "1.6,1.3"\n'
    Path(f"{name}.toml").write_text(f'{study}refine = "never"\n', "utf-8")
    lines = [
        ("check", f"./{name}.toml"),
        ("run", f"./{name}.toml", "--workers", "1", "--out", f"./{out}"),
        ("judge", f"./{out}", "--out", f"./{name}j"),
        ("compare", f"./{out}", f"./{name}j", "--out", f"./{name}c"),
        ("view", f"./{out}"),
    ]
    for words in lines:
        code, printed = run(*words)
        assert code == 0, printed
        assert is_clean(printed)
    assert read_json(Path(out) / "study.json")["study"] == name
    assert check_files(Path(out)) + check_files(Path(f"{name}j")) + check_files(Path(f"{name}c")) > 10


@pytest.mark.parametrize(
    "name", slow_but([VISIBLE[0], "a|b", "=1+1", "\x1b[31m", "a\nb", "a\u202eb\x9b"], 0, 4), ids=ascii
)
def test_curves_show_the_name_of_their_vehicle(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    text = (files("fecontact.features.curves") / "data" / "wheelset.toml").read_text("utf-8")
    assert '"free wheelset"' in text
    Path("=v<b>.toml").write_text(text.replace('"free wheelset"', json.dumps(name)), "utf-8")
    code, printed = run("curve", "--vehicle", "=v<b>.toml", "--radii", "2000", "--out", "out")
    assert code == 0
    assert is_clean(printed)
    assert escape_line(name) in printed
    assert check_files(Path("out")) > 2
    assert read_json("out/curve.json")["vehicle"]["name"] == name


@pytest.mark.slow
@pytest.mark.parametrize("name", ["=w$\\frac{$x<b>&<!--]]>\"'*[1]?%s;--\\b", "w\x1b[31m\u202e\x9b'"], ids=ascii)
def test_a_fleet_shows_the_names_and_columns_of_its_tables(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    fleet = write_fleet(Path("trial"))
    # a folder with a backslash and an asterisk is refused
    out = "./" + name.replace("\\", "")
    tables = {
        "wheels": [{"file": "wheel.csv", "name": name, f"{name}c": name}],
        "rails": [{"file": "rail.csv", "name": "r", "line": name}],
        "pairs": [{"wheel": name, "rail": "r"}],
    }
    for table, rows in tables.items():
        write_rows(Path(f"trial/{table}.csv"), rows)
    for words in (["run", str(fleet), "--workers", "1", "--out", out], ["report", out]):
        code, printed = run("fleet", *words)
        assert code == 0, printed
        assert is_clean(printed)
    assert check_files(Path(out)) > 3
    assert name in parquet.read_table(f"{out}/profiles.parquet").column("name").to_pylist()


@pytest.mark.parametrize("name", ["a\\b.csv", "w$\\frac{$x.csv", "=1", "-x", "a\nb", "x:y"])
def test_a_stored_name_may_have_any_letters_of_a_file_name(name):
    assert is_file_name(name)
    assert profile_identity(f"{name}@01234567") == f"{name}@01234567"


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "/a", "..\\x", "a\\..\\b", None, 3])
def test_a_stored_name_never_leads_out_of_its_folder(name):
    assert not is_file_name(name)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('name = "free wheelset"', "name = [1]"), r"name is \[1\]; allowed: a text in quotes"),
        (("roll_inertia_kg_m2", "zzz"), "zzz is not an input of WheelsetBody; allowed: mass_kg, "),
    ],
)
def test_a_changed_vehicle_is_refused_with_the_allowed_inputs(tmp_path, change, words):
    text = (files("fecontact.features.curves") / "data" / "wheelset.toml").read_text("utf-8")
    assert change[0] in text
    path = tmp_path / "v.toml"
    path.write_text(text.replace(*change), "utf-8")
    with pytest.raises(InputError, match=words):
        load_vehicle(str(path))


@pytest.mark.parametrize(
    "name", [*VISIBLE, *INVISIBLE, "-x", "--out", "=1+1", "a b", "$(touch x)", "`id`", "\U000e0001"], ids=ascii
)
def test_a_shell_reads_a_quoted_path_as_the_path(name):
    quoted = quote_path(Path(name))
    assert is_clean(quoted)
    assert "\n" not in quoted
    printed = subprocess.run(
        ["bash", "-c", f"printf %s {quoted}"], capture_output=True, check=True, env={"LC_ALL": "C.UTF-8"}
    ).stdout
    assert printed.removeprefix(b"./") == os.fsencode(name)


# each kind of output by itself


@pytest.mark.parametrize("name", [*VISIBLE[:4], "\x1b[31m", "a\u202eb", os.fsdecode(b"n\xff")], ids=ascii)
def test_every_text_of_a_figure_is_literal(name):
    figure = Figure(figsize=(8, 6), layout="constrained")
    axes = figure.subplots()
    axes.plot([1, 2, 3], label=name)
    axes.set(title=name, xlabel=name)
    axes.set_xticks([0, 1, 2], [name] * 3)
    axes.set_yticks([1.5, 2.5], [name] * 2, minor=True)
    axes.annotate(name, (1, 1))
    axes.legend()
    figure.suptitle(name)
    assert is_clean(render_svg(figure).decode())
    render_image(figure)
    escaped = escape_invisible(name)
    texts = [text for text in figure.findobj(Text) if escaped[:20] in text.get_text()]
    # the title twice, the axis, the legend, the note, and the ticks of both axes
    assert len(texts) >= 10
    assert not any(text.get_parse_math() for text in texts)


def test_a_figure_of_the_caller_is_drawn_by_matplotlib_itself():
    """Ticks that the last drawing makes are literal; powers are not."""
    figure = Figure()
    axes, powers = figure.subplots(2)
    axes.set_yticks([0, 1], [r"w$\frac{$x", "b"])
    powers.set(yscale="log", ylim=(1e-3, 1e5))
    # minor labels are names on an axis of powers
    powers.set_yticks([0.02, 30.0], [r"m$\frac{$x", "c"], minor=True)
    show_text_literally(figure)
    figure.savefig(io.BytesIO(), format="png")
    minor_labels = powers.get_yticklabels(minor=True)
    assert [label.get_text() for label in minor_labels] == [r"m$\frac{$x", "c"]
    assert not any(label.get_parse_math() for label in minor_labels)
    assert axes.get_yticklabels()[0].get_text() == r"w$\frac{$x"
    assert all(label.get_parse_math() for label in powers.get_yticklabels())


@pytest.mark.parametrize("name", [*VISIBLE, *INVISIBLE], ids=ascii)
def test_pages_and_printed_parts_are_clean(name, capsys):
    page = render_page(name, [Lead(text=name), name])
    assert is_clean(page)
    assert not minidom.parseString(page.encode()).getElementsByTagName("script")
    print_parts([Lead(text=name), name])
    print_result(name)
    announce(name)
    assert is_clean("".join(capsys.readouterr()))


def test_a_log_is_clean(tmp_path):
    with log_command(tmp_path / "a.log"):
        print_result("\x1b[31m")
    assert is_clean((tmp_path / "a.log").read_text("utf-8"))


@pytest.mark.parametrize("name", ["a|b", "a\nb", "<script>", "\x1b[31m"], ids=ascii)
def test_a_name_stays_in_its_cell_of_a_page_in_markdown(name):
    check = Check(
        quantity=name, case=name, reference=name, kind="other code", value=1.0, expected=1.0, uncertainty_percent=None,
        limit_percent=1.0,
    )  # fmt: skip
    unsolved = [UnsolvedCases(study="study", reason=name)]
    for text in render_reports({"study": [check]}, {"study": name}, {}, unsolved).values():
        assert is_clean(text)
        assert "<script>" not in text
        rows = [line for line in text.splitlines() if line.startswith("|")]
        assert len({line.replace(r"\|", "").count("|") for line in rows}) == 1


def test_a_table_in_a_file_is_clean(tmp_path):
    names = [*VISIBLE, *INVISIBLE, "=1+1"]
    table = write_csv([{name: name for name in names}], tmp_path / "a.csv")
    assert is_clean(table.read_text("utf-8"))
    with table.open(encoding="utf-8", newline="") as file:
        heading, cells = csv.reader(file)
    # the heading is guarded against formulas like a cell
    assert heading == cells == [*map(escape_invisible, names[:-1]), "'=1+1"]


def test_texts_of_numbers_have_no_apostrophe_in_a_table_and_all_texts_are_read_back(tmp_path):
    numbers = ["-4.5", "+0.039", "-12 %", "+3%", "-1e-3", "-.5", "-"]
    formulas = ["-1+2", "=1", "-x", "+cmd|' /C calc'!A0", "@a", "'-3", "-4.5; -3", "--1", "-1\n"]
    table = write_csv([{"number": -4.5, "text": text} for text in (*numbers, *formulas)], tmp_path / "a.csv")
    with table.open(encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    assert [row[0] for row in rows] == ["-4.5"] * len(rows)
    assert [row[1] for row in rows] == [*numbers, *(f"'{escape_invisible(text)}" for text in formulas)]
    columns, rows = _read_csv_rows(table)
    assert columns == ["number", "text"]
    assert [row[1] for row in rows] == [*numbers, *map(escape_invisible, formulas)]


@pytest.mark.parametrize("name", ["a$b$c", "a|b|c", r"w$\frac{$x"])
def test_vtk_draws_the_annotation_without_mathematics_and_tables(name):
    import vtkmodules.vtkRenderingFreeType
    import vtkmodules.vtkRenderingMatplotlib  # noqa: F401
    from vtkmodules.vtkRenderingCore import vtkTextRenderer

    detect = vtkTextRenderer.GetInstance().DetectBackend
    assert detect(name) == vtkTextRenderer.MathText
    assert detect(_to_ascii(name)) == vtkTextRenderer.FreeType
    assert _to_ascii("a\x1b[31m ± ü") == r"a\x1b[31m +- ?"


def test_json_escapes_invisible_characters_and_keeps_its_values():
    """Escapes for control, format and separator characters of all of Unicode; letters stay."""
    # all characters but letters, ideographs and unassigned ones, of which every 97th
    characters = [
        chr(code)
        for code in range(0x110000)
        if code % 97 == 0 or unicodedata.category(chr(code)) not in ("Lo", "Co", "Cn") or chr(code) == "轨"
    ]
    # each in a separate text: two halves that follow each other would be read as a single character
    record = {f"a{character}b": f"{character}c" for character in characters}
    text = format_json(record)
    text.encode("utf-8")
    assert json.loads(text) == record
    executed = {character for character in characters if unicodedata.category(character) in EXECUTED}
    assert {"\x9b", "\u200b", "\u202e", "\u2028", "\ufeff", "\ud800", "\U000e0001"} <= executed
    assert not executed & set(text) - {"\n"}
    assert {"ä", "Ж", "轨", "😀", "\xa0", "\u3000"} <= set(text)
    # a terminal shows the JSON that a file has
    assert escape_invisible(text) == text


def test_the_checksum_of_a_document_is_that_of_its_values(tmp_path):
    """Documents of before the escapes keep their checksums, on every version of Python."""
    record = {"name": "a\u202eä\x9b"}
    path = write_sealed(tmp_path / "a.json", record)
    assert is_clean(path.read_text("utf-8"))
    text = json.dumps(record, indent=2, ensure_ascii=False)
    assert hashlib.sha256(text.encode()).hexdigest() in path.read_text("utf-8")
    assert explain_broken_seal(path, read_json(path)) is None


def test_a_picture_in_the_axes_of_the_caller_is_literal(monkeypatch):
    monkeypatch.setattr("fecontact.plot.PressureFields.of", lambda load: None)
    monkeypatch.setattr("fecontact.plot.result_record", lambda result: {})
    monkeypatch.setattr("fecontact.plot.draw_field", lambda axes, *_, **__: axes.set_title(r"w$\frac{$x"))
    axes = Figure().subplots()

    class Result:
        load = placement = None
        case = Case()

    figure = fecontact.plot.case(Result(), axes)
    figure.savefig(io.BytesIO(), format="png")
