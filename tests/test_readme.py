"""What the two READMEs name exists: commands and options, files and headings, targets, and no line is too long."""

import re
import shlex
from pathlib import Path

import pytest

from fecontact.cli import app

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", ROOT / "studies" / "README.md")
TEXTS = {page.relative_to(ROOT).as_posix(): page.read_text("utf-8") for page in PAGES}
# what stands for the reader's own choice
PLACEHOLDER = re.compile(r"\b(FOLDER|FILE|BASELINE|NEW|COLUMNS|NAME)\b")


OPTIONS = {
    name
    for command in [app[name] for name in app if not name.startswith("-") and name != "baseline"]
    + [app["baseline"]["update"]]
    for argument in command.assemble_argument_collection()
    for name in argument.names
}


def commands(text: str) -> list[str]:
    """Commands in blocks of code and in the middle of a line, without comments and optional parts."""
    blocks = re.findall(r"^ *(fecontact .*)$", text, re.MULTILINE)
    spans = [span.replace("\n", " ") for span in re.findall(r"`(fecontact [^`]*)`", text)]
    shown = [re.sub(r"\[[^\]]*\]", "", line.partition(" #")[0]).strip() for line in (*blocks, *spans)]
    return sorted({line for line in shown if not PLACEHOLDER.search(line)})


def anchors(text: str) -> set[str]:
    """Headings as links name them."""
    heads = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("command", sorted({one for text in TEXTS.values() for one in commands(text)}))
def test_a_command_is_understood(command):
    """Its name and options, and that no argument is missing or left over: nothing is run."""
    _, *words = shlex.split(command.replace("$SLURM_ARRAY_TASK_ID", "1"))
    named = [word for word in words if not word.startswith("-")][:1]
    if len(words) == len(named):  # the command by its name alone, in a sentence
        assert words[0] in app
    else:
        app.parse_args(words, exit_on_error=False, print_error=False)


@pytest.mark.parametrize("page", TEXTS)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", TEXTS[page]):
        path, _, anchor = link.partition("#")
        target = ((ROOT / page).parent / path).resolve() if path else ROOT / page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target.read_text("utf-8")), link


@pytest.mark.parametrize("page", TEXTS)
def test_options_and_targets_exist(page):
    known = {*app, *OPTIONS, "--help-all"}
    named = set(
        re.findall(
            r"(?<![\w-])--[a-z][a-z-]*[a-z]",
            re.sub(r"^(dask|#SBATCH).*$|`[^`]*paraview --[^`]*`", "", TEXTS[page], flags=re.M),
        )
    )
    assert named - known == set()
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    assert set(re.findall(r"(?:`|^ {4})make ([a-z-]+)", TEXTS[page], re.MULTILINE)) - targets == set()


@pytest.mark.parametrize("page", TEXTS)
def test_lines_fit_an_editor(page):
    """Tables and pictures cannot be broken."""
    lines = [line for line in TEXTS[page].splitlines() if not line.lstrip().startswith(("|", "!["))]
    assert [line for line in lines if len(line) > 120] == []
