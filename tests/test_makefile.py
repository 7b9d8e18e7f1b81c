"""Recipes of the Makefile, in a folder with a blank in its path."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

MAKEFILE = Path(__file__).parents[1] / "Makefile"
TARGETS = re.search(r"^\.PHONY: (.*)$", MAKEFILE.read_text("utf-8"), re.MULTILINE)[1].split()
# paths that make or the shell puts in
PATHS = re.compile(r"\$\(CURDIR\)|\$\((?:abspath|realpath) [^)]*\)|\$\$\(pwd[^)]*\)|\$\$\{?PWD\}?|\$\$\{?HOME\}?")


def remove_quotes(text: str) -> str:
    """A recipe without its quoted texts: the parts that a shell splits at blanks."""
    return re.sub(r"\"(?:\\.|[^\"\\])*\"|'[^']*'", "", text, flags=re.DOTALL)


def unquoted_paths(recipe: str) -> list[str]:
    """Paths in a recipe that a blank would split."""
    return PATHS.findall(remove_quotes(recipe))


def test_paths_in_recipes_are_quoted():
    recipes = re.findall(r"^\t.*(?:\\\n.*)*", MAKEFILE.read_text("utf-8"), re.MULTILINE)
    assert len(recipes) > 30
    assert [recipe for recipe in recipes if unquoted_paths(recipe)] == []


@pytest.mark.parametrize("path", ["$(CURDIR)", "$$(pwd -P)", "$$PWD", "$(abspath out)"])
def test_a_path_without_quotes_is_found(path):
    assert unquoted_paths(f"\tPYTHONPATH={path} python tests/mutants.py") == [path]
    assert unquoted_paths(f'\tPYTHONPATH="{path}" python tests/mutants.py') == []


@pytest.mark.parametrize("target", TARGETS)
def test_what_make_runs_has_no_path_that_a_blank_splits(target, tmp_path):
    folder = tmp_path / "one two"
    folder.mkdir()
    shutil.copyfile(MAKEFILE, folder / "Makefile")
    for name in ("requirements.lock", "pyproject.toml"):
        (folder / name).touch()
    recipe = subprocess.run(
        ["make", "--dry-run", target], cwd=folder, capture_output=True, text=True, check=True
    ).stdout
    assert recipe
    assert "one two" not in remove_quotes(recipe)
