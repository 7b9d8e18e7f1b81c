"""Defaults of parameters, fields and options: each number has a single definition."""

import ast
import inspect
import re
from collections import defaultdict
from pathlib import Path

import pytest

import fecontact
from fecontact import plot
from fecontact.commands import looking, mapping, results
from fecontact.outputs import decks, mesh_files

PACKAGE = Path(fecontact.__file__).parent
_UNIT = re.compile(r"_(percent|mm|m|rad|mpa|n|kn)$")
# Defaults without a setting behind them: switches, counts of one, and the neutral element.
_NEUTRAL = (0, 1, -1)
# Numbers of example files, which `fleet examples` has as options; `write_fleet` has equal numbers (tests/fleet).
_EXAMPLES = ("wheels", "rails", "seed")


def numeric_defaults(node):
    """Iterate over the numeric defaults of a function or a class, by name without unit."""
    pairs = []
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        positional = [*node.args.posonlyargs, *node.args.args]
        pairs += list(zip(reversed(positional), reversed(node.args.defaults), strict=False))
        pairs += list(zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True))
        pairs = [(argument.arg, default) for argument, default in pairs]
    elif isinstance(node, ast.ClassDef):
        for line in node.body:
            if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name):
                is_input = isinstance(line.value, ast.Call) and line.value.args
                pairs.append((line.target.id, line.value.args[0] if is_input else line.value))
    for name, default in pairs:
        if isinstance(default, ast.Constant) and type(default.value) in (int, float) and default.value not in _NEUTRAL:
            name, factor = name.lower(), 0.01 if name.lower().endswith("_percent") else 1.0
            yield _UNIT.sub("", name), factor * default.value


def find_repeated_defaults(package):
    """Find equal names with equal default numbers in several signatures or classes."""
    places = defaultdict(list)
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            for name, number in numeric_defaults(node):
                places[name, number].append(f"{path.relative_to(package)}:{node.name}")
    return {
        (name, number): definitions
        for (name, number), definitions in places.items()
        if len(definitions) > 1 and name not in _EXAMPLES
    }


def test_no_default_is_written_twice():
    assert find_repeated_defaults(PACKAGE) == {}


def test_a_default_that_is_written_twice_is_noticed(tmp_path):
    (tmp_path / "model.py").write_text("class Conditions:\n    friction: float = input_field(0.3, FRICTION)\n", "utf-8")
    (tmp_path / "command.py").write_text(
        "class Options:\n    friction: float = 0.3\n    limit_percent: float = 5.0\n\ndef judge(*, limit=0.05): ...\n",
        "utf-8",
    )
    assert find_repeated_defaults(tmp_path) == {
        ("friction", 0.3): ["command.py:Options", "model.py:Conditions"],
        ("limit", 0.05): ["command.py:Options", "command.py:judge"],
    }


@pytest.mark.parametrize(
    ("command", "function"),
    [
        (mapping.map_, fecontact.map),
        (mapping.map_, plot.map),
        (results.judge, fecontact.judge),
        (mesh_files.write_mesh, decks.write_deck),
        (looking.mesh, mesh_files.write_mesh),
    ],
)
def test_names_that_are_chosen_by_default_are_equal_everywhere(command, function):
    command_defaults, function_defaults = (
        {name: parameter.default for name, parameter in inspect.signature(signature).parameters.items()}
        for signature in (command, function)
    )
    texts = {
        name: value for name, value in command_defaults.items() if isinstance(value, str) and name in function_defaults
    }
    assert texts
    assert texts == {name: function_defaults[name] for name in texts}
