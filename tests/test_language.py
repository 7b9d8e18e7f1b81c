"""Counts of vague names and of sentences that are hard to read; the allowed numbers may only fall.

Rules for names and docstrings are in CONTRIBUTING.md, the words of the field in `fecontact guide glossary`.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def words_of(text: str) -> frozenset[str]:
    """Words of a text."""
    return frozenset(text.split())


# Words that say nothing about a value: pronouns, participles, prepositions.
VAGUE_NAMES = words_of(
    """
    one own made told found read of by known given there here took asked unsure taken whole part kept wanted seen done
    named held beside others other beyond needed allowed used drawn gone came shown meant spoken flat stands looked
    counted placed solved judged moved grown turned within below above such each both every most least few more less
    all any none
    """
)
# Words that fit every value.
GENERIC_NAMES = words_of("item items obj object thing things data tmp temp res ret val elem entry it stuff info")
PREPOSITIONS = "of|by|on|in|at|as|from|with|without|beside|beyond|below|above|against|for|per|so|than"
PREPOSITION_FIRST = re.compile(rf"_*(?:{PREPOSITIONS})(?:_|$)", re.IGNORECASE)
LOOSE_NAMES = words_of(
    """
    same off told seen made kept found known given done tried taken carried faced facing met spans slid unlike together
    stand standing held drawn moves marked limited usable cleared clipped other others own part parts line lines
    """
)
# Words with which a first paragraph needs a second reading.
HARD_WORDS = re.compile(
    r"\b(?:what|otherwise|none of|known|told|tells?|sa(?:ys?|id)|own|ones?|whose|(?:of|by) which"
    r"|by (?:itself|themselves)|the same|(?:so|as) (?:many|few|much)"
    r"|th(?:at|ose) (?:of|from|in|on|at|under|with|which|by))\b",
    re.IGNORECASE,
)
MOST_WORDS = 15
DEFINITIONS = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def syntax_trees(folder: str) -> Iterator[tuple[Path, ast.Module]]:
    """Syntax tree of every module in a folder."""
    for path in sorted((ROOT / folder).rglob("*.py")):
        yield path, ast.parse(path.read_text("utf-8"))


def bound_names(tree: ast.AST) -> Iterator[str]:
    """Names of variables, fields and parameters, without leading and trailing underscores."""
    for node in ast.walk(tree):
        if isinstance(node, ast.arg):
            yield node.arg.strip("_")
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id.strip("_")


def is_loose(name: str) -> bool:
    """Whether a function or class has a preposition, an adverb or a participle as its name."""
    return PREPOSITION_FIRST.match(name) is not None or name.strip("_").lower() in LOOSE_NAMES


def first_paragraphs(tree: ast.AST) -> Iterator[str]:
    """First paragraph of every docstring, without line breaks."""
    for node in ast.walk(tree):
        is_documented = isinstance(node, (ast.Module, *DEFINITIONS))
        if is_documented and (text := ast.get_docstring(node)):
            yield " ".join(text.partition("\n\n")[0].split())


def language_counts(folder: str) -> Counter[str]:
    """Counts of vague names, loose names, hard and long sentences in a folder.

    The counts include the totals.
    """
    counts: Counter[str] = Counter()
    for _, tree in syntax_trees(folder):
        for name in bound_names(tree):
            counts["names"] += 1
            counts["vague names"] += name in VAGUE_NAMES
            counts["generic names"] += name in GENERIC_NAMES
        for node in ast.walk(tree):
            if isinstance(node, DEFINITIONS):
                counts["definitions"] += 1
                counts["loose definitions"] += is_loose(node.name)
        for paragraph in first_paragraphs(tree):
            sentence = re.split(r"(?<=[.:;])\s", paragraph)[0]
            counts["docstrings"] += 1
            counts["hard sentences"] += HARD_WORDS.search(paragraph) is not None
            counts["long sentences"] += len(sentence.split()) > MOST_WORDS
    return counts


# The numbers of the present code. A change that lowers a count lowers its number here.
LIMITS = {
    "fecontact": {
        "generic names": 5,
        "hard sentences": 11,
        "long sentences": 27,
        "loose definitions": 59,
        "vague names": 72,
    },
    "tests": {
        "generic names": 23,
        "hard sentences": 24,
        "long sentences": 50,
        "loose definitions": 13,
        "vague names": 35,
    },
    "studies": {
        "generic names": 8,
        "hard sentences": 10,
        "long sentences": 14,
        "loose definitions": 6,
        "vague names": 2,
    },
}


@pytest.mark.parametrize("folder", LIMITS)
def test_the_language_gets_no_vaguer(folder):
    counts = language_counts(folder)
    assert {kind: counts[kind] for kind in LIMITS[folder] if counts[kind] > LIMITS[folder][kind]} == {}


def test_no_class_name_has_two_meanings():
    """Each class name belongs to a single module."""
    modules: dict[str, set[str]] = {}
    for path, tree in syntax_trees("fecontact"):
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                modules.setdefault(node.name, set()).add(path.relative_to(ROOT).as_posix())
    assert {name: sorted(paths) for name, paths in modules.items() if len(paths) > 1} == {}


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        ("for one in patches: pass", "vague names"),
        ("def area(*, own): pass", "vague names"),
        ("data = 1", "generic names"),
        ("def _off(): pass", "loose definitions"),
        ("class Kept: pass", "loose definitions"),
        ("def of_lines(): pass", "loose definitions"),
        ('"""What a rung has."""', "hard sentences"),
        ('def f():\n    """Area of the patch, and that of the ellipse."""', "hard sentences"),
        ('"""' + "word " * 16 + '."""', "long sentences"),
    ],
)
def test_each_count_sees_its_kind(tmp_path, monkeypatch, code, kind):
    monkeypatch.setattr("test_language.ROOT", tmp_path)
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "module.py").write_text("")
    before = language_counts("package")[kind]
    (tmp_path / "package" / "module.py").write_text(code)
    assert language_counts("package")[kind] == before + 1


def test_plain_names_and_sentences_are_not_counted(tmp_path, monkeypatch):
    monkeypatch.setattr("test_language.ROOT", tmp_path)
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "module.py").write_text(
        '"""Areas of contact patches."""\n\n\ndef patch_areas(patches):\n    """Areas in mm2."""\n'
        "    return [patch.area_mm2 for patch in patches]\n"
    )
    counts = language_counts("package")
    assert {kind for kind, count in counts.items() if count} == {"names", "definitions", "docstrings"}
