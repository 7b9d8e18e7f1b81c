"""Names in the documents exist: commands and options, files and headings, targets.

The guide runs as it is shown and pasted.
"""

import ast
import importlib
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from cyclopts import App
from marks import slow_but

from fecontact.cli import app, call
from fecontact.features.fleet.model import read_fleet
from fecontact.guide.pages import read_page, read_titles, remove_links
from fecontact.regression.tables import read_tolerances
from fecontact.runs.toml_cases import read_toml_cases

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "fecontact" / "guide"
OTHERS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "studies/README.md")
PAGES = (*(ROOT / name for name in OTHERS), *sorted(GUIDE.glob("*.md")))
TEXTS = {page.relative_to(ROOT).as_posix(): page.read_text("utf-8") for page in PAGES if page.exists()}
TOPICS = [path.stem for path in sorted(GUIDE.glob("*.md"))]
# what stands for the reader's own choice
PLACEHOLDER = re.compile(r"\b(FOLDER|FILE|BASELINE|NEW|COLUMNS|NAME|TOPIC)\b")


def leaves(application: App) -> list[App]:
    """A command, or the commands below it."""
    commands = [application[name] for name in application if not name.startswith("-")]
    return [leaf for command in commands for leaf in leaves(command)] or [application]


OPTIONS = {name for one in leaves(app) for argument in one.assemble_argument_collection() for name in argument.names}

# options of `dask scheduler` and `dask worker` that sentences name
OPTIONS_OF_DASK = {"--host", "--no-dashboard"}


def join_lines(text: str) -> str:
    """Join commands of several lines into a single line.

    Each of their lines but the last ends with a backslash.
    """
    return re.sub(r" *\\\n *", " ", text)


def typed(text: str) -> list[str]:
    """Blocks of code for a shell."""
    return [*fenced(text, "console"), *fenced(text, "sh")]


def commands(text: str) -> list[str]:
    """Commands in blocks of code and within text, without comments and optional parts."""
    blocks = re.findall(r"^(fecontact .*)$", join_lines("".join(typed(text))), re.MULTILINE)
    spans = [span.replace("\n", " ") for span in re.findall(r"`(fecontact [^`]*)`", text)]
    lines = [re.sub(r"\[[^\]]*\]", "", line.partition(" #")[0]).strip() for line in (*blocks, *spans)]
    return sorted({line for line in lines if not PLACEHOLDER.search(line)})


def anchors(text: str) -> set[str]:
    """Headings as links name them."""
    heads = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def fenced(text: str, language: str) -> list[str]:
    """Blocks of code of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("command", sorted({command for text in TEXTS.values() for command in commands(text)}))
def test_a_command_is_understood(command):
    """A command has existing options, the right number of arguments, and values in range.

    Nothing is run.
    """
    _, *words = shlex.split(command.replace("$SLURM_ARRAY_TASK_ID", "1"))
    command_name = [word for word in words if not word.startswith("-")][:1]
    if len(words) == len(command_name):  # the command by its name alone, in a sentence
        assert words[0] in app
    elif not {"--help", "--help-all"} & {*words}:
        _, bound, _ = app.parse_args(words, exit_on_error=False, print_error=False)
        if "options" in bound.arguments:
            bound.arguments["options"].case()
        if "grid" in bound.arguments:
            assert bound.arguments["grid"].shifts_mm
            assert bound.arguments["grid"].loads_N
        if words[0] == "guide":
            assert words[1] in TOPICS


@pytest.mark.parametrize("page", TEXTS)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", TEXTS[page]):
        path, _, anchor = link.partition("#")
        target = ((ROOT / page).parent / path).resolve() if path else ROOT / page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target.read_text("utf-8")), link


@pytest.mark.parametrize("page", TEXTS)
def test_options_and_targets_exist(page):
    scripts = "".join(path.read_text("utf-8") for path in (ROOT / "studies").glob("*.py"))
    known_words = {*app, *OPTIONS, "--help-all", *re.findall(r'add_argument\("(--[a-z-]+)"', scripts)}
    foreign = r"^(dask|#SBATCH).*$|`[^`]*paraview --[^`]*`|^.*paraview --.*$"
    options = set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*[a-z0-9]", re.sub(foreign, "", TEXTS[page], flags=re.M)))
    assert options - known_words - OPTIONS_OF_DASK == set()
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    shown_targets = re.findall(r"(?:`|^ {4})make ([a-z-]+)", TEXTS[page], re.MULTILINE)
    typed_targets = re.findall(r"^make ([a-z-]+)", "".join(typed(TEXTS[page])), re.MULTILINE)
    assert {*shown_targets, *typed_targets} - targets == set()


@pytest.mark.parametrize("page", TEXTS)
def test_lines_fit_an_editor(page):
    """Tables, pictures and the output of a program cannot be broken."""
    text = re.sub(r"^```text\n.*?^```$", "", TEXTS[page], flags=re.MULTILINE | re.DOTALL)
    lines = [line for line in text.splitlines() if not line.lstrip().startswith(("|", "!["))]
    assert [line for line in lines if len(line) > 120] == []


@pytest.mark.parametrize("page", TEXTS)
def test_tables_are_whole(page):
    """A line of a table that stands alone is shown with its bars."""
    text = re.sub(r"^```.*?^```$", "", TEXTS[page], flags=re.MULTILINE | re.DOTALL)
    for table in re.findall(r"(?:^\|.*\n)+", text + "\n", re.MULTILINE):
        head, rule, *_ = [*table.splitlines(), ""]
        assert re.fullmatch(r"\|( *:?-+:? *\|)+", rule), head


@pytest.mark.parametrize("page", TEXTS)
def test_what_is_to_be_typed_can_be_pasted(page):
    """Without the sign of a shell before it."""
    assert [line for line in "".join(fenced(TEXTS[page], "console")).splitlines() if line.startswith(("$", "%"))] == []


@pytest.mark.parametrize("page", [page for page in TEXTS if "```toml" in TEXTS[page]])
def test_files_that_are_shown_can_be_read(page, tmp_path):
    path = tmp_path / "shown.toml"
    for block in fenced(TEXTS[page], "toml"):
        path.write_text(block, "utf-8")
        reader = (
            read_fleet if "[wheels]" in block else read_tolerances if block.startswith("[kinds") else read_toml_cases
        )
        reader(path)


@pytest.mark.parametrize("page", [page for page in TEXTS if "```python" in TEXTS[page]])
def test_what_is_imported_in_an_example_exists(page):
    for block in fenced(TEXTS[page], "python"):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.ImportFrom):
                assert all(hasattr(importlib.import_module(node.module), alias.name) for alias in node.names)
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "fecontact":
                assert hasattr(importlib.import_module("fecontact"), node.attr), node.attr


# --- the guide as it is pasted, a page at a time, into an empty folder ------------------------------------------------

# what is done in a second or two
QUICK = ("codes", "conventions", "setup")
WRITTEN = {"--examples", "--out", "--write"}
A_FILE = re.compile(r"[\w.+-]*/[\w./+-]+|[\w+-]+\.[a-z]+")


def pasted(topic: str) -> list[list[str]]:
    """Words of each command that a page has to be typed."""
    lines = join_lines("".join(fenced(TEXTS[f"fecontact/guide/{topic}.md"], "console"))).splitlines()
    return [shlex.split(line) for line in lines]


@pytest.mark.parametrize("topic", TOPICS)
def test_a_page_of_the_guide_needs_nothing_but_itself(topic):
    """A file that a command reads has been written by a command before it."""
    written: list[str] = []
    for program, command, *words in pasted(topic):
        assert program == "fecontact"
        for before, word in zip([command, *words], words, strict=False):
            if before in WRITTEN or command == "init" or before == "examples":
                written.append(word)
            elif A_FILE.fullmatch(word):
                assert any(f"{word}/".startswith(f"{path}/") for path in written), (command, word)


# A number that is no part of a name. With decimals a mesh moves its last digit; others are counts, or large.
A_NUMBER = re.compile(r"(?:± )?(?<![\w.])[+-]?\d+(?:\.\d+)?(?![\w.]*\w)")
# What another mesh moves, relative: a number, and a stated uncertainty, which is a change between two meshes (see
# `fecontact/regression/tolerances.toml`). Another processor makes another mesh.
MOVED, UNCERTAINTY_MOVED = 0.005, 0.2


def agrees(shown_line: str, printed: str) -> bool:
    """Whether a line of a document agrees with a printed line.

    Words agree exactly, numbers to 2 units of the last decimal or to the differences between meshes.
    """

    def close(shown_number: str, printed_number: str) -> bool:
        tolerance, decimals = (
            UNCERTAINTY_MOVED if shown_number.startswith("±") else MOVED,
            len(shown_number.partition(".")[2]),
        )
        was, now = (float(text.removeprefix("± ")) for text in (shown_number, printed_number))
        return abs(was - now) <= max(2.0 * 10.0**-decimals if decimals else 0.0, tolerance * abs(was)) + 1e-9

    words, numbers = zip(
        *((A_NUMBER.sub("#", text).split(), A_NUMBER.findall(text)) for text in (shown_line, printed)), strict=True
    )
    return words[0] == words[1] and all(map(close, *numbers))


def not_printed(example: str, said: str) -> list[str]:
    """Lines of a block of a page that were not printed."""
    printed = said.splitlines()
    return [line for line in example.splitlines() if not any(agrees(line, printed_line) for printed_line in printed)]


@pytest.mark.parametrize(
    ("printed", "same"),
    [
        ("area (mm2)  106.67  95.413  -10.56 %  (limit 10 %)", True),
        # a mesh moves numbers, and with them the columns
        ("area (mm2)    106.8  95.413  -10.58 %  (limit 10 %)", True),
        ("area (mm2)  107.3  95.413  -10.56 %  (limit 10 %)", False),
        ("area (mm2)  106.67  95.413  -10.62 %  (limit 10 %)", False),
        ("area (mm2)  106.67  95.413  10.56 %  (limit 10 %)", False),
        # what is set, counted, or said stays
        ("area (mm2)  106.67  95.413  -10.56 %  (limit 11 %)", False),
        ("area (mm2)  106.67  95.413  -10.56 %", False),
        ("size (mm2)  106.67  95.413  -10.56 %  (limit 10 %)", False),
    ],
)
def test_what_a_mesh_moves_is_no_other_line(printed, same):
    assert agrees("area (mm2)  106.67  95.413  -10.56 %  (limit 10 %)", printed) == same
    assert not agrees("case.png in 3.00mm_d57239c3", "case.png in 3.01mm_d57239c3")
    shown_line = "peak pressure +27.63 % ± 6.81 % (limit ±5 %)"
    assert agrees(shown_line, shown_line.replace("6.81", "5.60"))
    assert not any(
        agrees(shown_line, shown_line.replace(*change)) for change in (("6.81", "5.40"), ("± 6.81 %", ""), ("±5", "±6"))
    )


@pytest.mark.parametrize("topic", slow_but(TOPICS, *map(list(TOPICS).index, QUICK)))
def test_a_page_of_the_guide_runs_as_it_is_pasted(topic, tmp_path):
    """In its order; each line that it shows of an output was printed, as far as a mesh leaves its numbers alone."""
    program = tmp_path / "bin" / "fecontact"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m fecontact "$@"\n', "utf-8")
    program.chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{program.parent}:{os.environ['PATH']}"}
    folder, said = tmp_path / "pasted", ""
    folder.mkdir()
    # its commands run in a checkout, with measured files: tests/fleet/test_guide_with_files.py pastes them
    page = re.sub(
        r"^## With the files of an instrument\n.*?(?=^## )", "", TEXTS[f"fecontact/guide/{topic}.md"], flags=re.M | re.S
    )
    blocks = re.findall(r"^```(\w+)\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    for language, code in blocks:
        lines = join_lines(code).splitlines()
        if language == "text" and said:
            assert not_printed(code, said) == []
        runs = {"console": [["bash", "-c", line] for line in lines], "python": [[sys.executable, "-c", code]]}
        for run in runs.get(language, ()):
            process = subprocess.run(run, cwd=folder, env=environment, capture_output=True, text=True, timeout=900)
            # 1: two sets of results that are compared are not the same; 3: a position of a sample was not solved
            exit_code = next((code for words, code in {"compare": 1, "fleet sample": 3}.items() if words in run[-1]), 0)
            assert process.returncode in (0, exit_code), (run, process.stdout, process.stderr)
            said += process.stdout


# --- the guide on the terminal ----------------------------------------------------------------------------------------


def test_the_guide_lists_its_topics(capsys):
    assert call(["guide"]) == 0
    out = capsys.readouterr().out
    assert [line.split()[0] for line in out.splitlines()[:-1]] == TOPICS
    assert all(title in out for title in read_titles().values())


@pytest.mark.parametrize("topic", TOPICS)
def test_a_page_of_the_guide_is_shown(topic, capsys):
    assert re.fullmatch(r"# \S.*", read_page(topic).partition("\n")[0]), "the first line is its title"
    assert call(["guide", topic]) == 0
    assert capsys.readouterr().out == (GUIDE / f"{topic}.md").read_text("utf-8")


def test_a_page_is_laid_out_on_a_terminal(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert call(["guide", "conventions"]) == 0
    out = capsys.readouterr().out
    assert "\x1b[1m" in out
    assert "# Conventions" not in out
    assert "contact angle" in out


@pytest.mark.parametrize("topic", TOPICS)
def test_links_on_a_terminal_are_commands_or_words(topic):
    """A path leads nowhere there."""
    plain_page = remove_links(read_page(topic))
    assert ".md" not in re.sub(r"```.*?```|`[^`]*`", "", plain_page, flags=re.DOTALL)
    topics = set(re.findall(r"`fecontact guide (\w+)`", plain_page))
    assert topics >= set(re.findall(r"\]\((\w+)\.md", read_page(topic)))
    assert topics <= set(TOPICS)


def test_a_misspelt_topic_is_recognised(capsys):
    assert call(["guide", "convention"]) == 2
    assert "did you mean conventions?" in capsys.readouterr().err


def test_the_guide_is_instant():
    """Nothing that computes is imported for a page."""
    heavy = ("numpy", "scipy", "matplotlib", "pyvista", "gmsh", "skfem")
    code = (
        "import sys; from fecontact.cli import call; code = call(['guide', 'conventions']);"
        f"print([name for name in {heavy!r} if name in sys.modules], file=sys.stderr); sys.exit(code)"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert process.stderr == "[]\n"
