"""Docstrings follow the NumPy convention and are complete.

ruff checks the sections of NumPy and overlooks section names that exist only in Google's convention. `incomplete`
finds parameters, fields, results and errors without a description in:

- all public names of the package (`fecontact.__all__`), which are the pages of the documentation, with their methods;
- all other public functions, methods and dataclasses of the package, except functions of a single expression, which
  their first sentence describes.

Commands are outside: their docstrings are texts of `--help`. Inputs have descriptions for `--help` in their fields.
"""

import ast
import builtins
import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest

import fecontact
from fecontact.feature_registry import find_public_names

PACKAGE = Path(__file__).parents[1] / "fecontact"
GOOGLE_ONLY = re.compile(r"^ *((Keyword |Other )?Arg(ument)?s|Note|Example|Warning|Todo):$", re.MULTILINE)
HEADING = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
COMMANDS = ("commands/*.py", "features/*/command*.py", "features/*/asking.py")
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
ERRORS = frozenset(
    node.name for node in ast.parse((PACKAGE / "errors.py").read_text("utf-8")).body if isinstance(node, ast.ClassDef)
)


@cache
def read_modules() -> dict[str, ast.Module]:
    """Syntax trees of the package's modules, by the path in the package."""
    return {
        path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text("utf-8"))
        for path in sorted(PACKAGE.rglob("*.py"))
    }


def find_public_places() -> set[str]:
    """Places `PATH:NAME` of the public names of the package, such as `case.py:Case`."""
    places = [*fecontact._HOMES.values(), *(place.removeprefix("fecontact.") for place in find_public_names().values())]
    split_places = (place.rpartition(".") for place in [*places, "plot.case", "plot.map"])
    return {f"{module.replace('.', '/')}.py:{name}" for module, _, name in split_places}


def read_sections(node: ast.AST) -> dict[str, str]:
    """Sections of a docstring by their headings; the text before the first heading is left out."""
    _, *parts = HEADING.split(ast.get_docstring(node) or "")
    return dict(zip(parts[::2], parts[1::2], strict=True))


def described_names(section: str) -> set[str]:
    """Names that a section describes, without stars; the type follows after ` : `."""
    headlines = (line.partition(" : ")[0] for line in section.splitlines() if line and not line[0].isspace())
    return {name.strip().lstrip("*") for headline in headlines for name in headline.split(",")}


def walk_body(statements: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Nodes of a function's body, without nested functions and blocks with handled errors."""
    for statement in statements:
        yield statement
        if isinstance(statement, ast.Try) and any(is_own_error(handler.type) for handler in statement.handlers):
            children = [child for child in ast.iter_child_nodes(statement) if child not in statement.body]
        else:
            children = [*ast.iter_child_nodes(statement)]
        if not isinstance(statement, (*FUNCTIONS, ast.Lambda, ast.ClassDef)):
            yield from walk_body(children)


def is_own_error(handled: ast.expr | None) -> bool:
    """Whether a handler catches errors of the package."""
    return handled is not None and any(isinstance(node, ast.Name) and node.id in ERRORS for node in ast.walk(handled))


def list_decorators(node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> list[str]:
    """Source text of each decorator."""
    return [ast.unparse(decorator) for decorator in node.decorator_list]


def missing_in_function(function: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[str]:
    """Yield parameters, results and errors without a description, and descriptions without a parameter."""
    decorators, sections = list_decorators(function), read_sections(function)
    arguments = function.args
    names = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    names += [argument.arg for argument in (arguments.vararg, arguments.kwarg) if argument]
    names = names[1:] if names[:1] in (["self"], ["cls"]) else names
    described = described_names(sections.get("Parameters", ""))
    yield from (f"parameter {name}" for name in names if name not in described)
    yield from (f"no parameter {name}" for name in sorted(described - {*names}))
    nodes = [*walk_body(function.body)]
    has_result = any(
        isinstance(node, ast.Yield | ast.YieldFrom) or (isinstance(node, ast.Return) and not is_none(node.value))
        for node in nodes
    )
    if has_result and not any("property" in decorator for decorator in decorators):
        yield from () if {"Returns", "Yields"} & sections.keys() else ("result",)
    raised = {
        node.exc.func.id
        for node in nodes
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name)
    }
    yield from (f"error {name}" for name in sorted((raised & ERRORS) - described_names(sections.get("Raises", ""))))


def is_none(value: ast.expr | None) -> bool:
    """Whether a return statement has no value, or the value None."""
    return value is None or (isinstance(value, ast.Constant) and value.value is None)


def missing_in_class(kind: ast.ClassDef) -> Iterator[str]:
    """Yield the public fields of a dataclass without a description; inputs are described in their fields."""
    decorators = list_decorators(kind)
    if "input_dataclass" in decorators or not any("dataclass" in decorator for decorator in decorators):
        return
    described = described_names(read_sections(kind).get("Attributes", ""))
    for field, after in zip(kind.body, [*kind.body[1:], None], strict=True):
        is_described_below = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name) or is_described_below:
            continue
        name = field.target.id
        if not name.startswith("_") and name not in described and "ClassVar" not in ast.unparse(field.annotation):
            yield f"field {name}"


def has_one_expression(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether a function has a single return or expression of at most four lines."""
    _, *statements = function.body
    lines = sum((statement.end_lineno or 0) - statement.lineno + 1 for statement in statements)
    return lines <= 4 and len(statements) <= 1 and all(isinstance(node, ast.Return | ast.Expr) for node in statements)


def incomplete(body: Sequence[ast.stmt], path: str, public: set[str], name: str = "") -> Iterator[str]:
    """Yield the gaps in docstrings of public definitions.

    Parameters
    ----------
    body
        Statements of a module or a class.
    path
        Path of the module in the package.
    public
        Places in which functions of a single expression must be complete too.
    name
        Name of the class with a point, empty for a module.

    Yields
    ------
    str
        Place of a definition, and the thing that is not described.
    """
    for node in body:
        if isinstance(node, ast.If):
            yield from incomplete(node.body, path, public, name)
        if not isinstance(node, (*FUNCTIONS, ast.ClassDef)) or (node.name.startswith("_") and node.name != "__init__"):
            continue
        place = f"{path}:{name}{node.name}"
        if isinstance(node, ast.ClassDef):
            yield from (f"{place} {gap}" for gap in missing_in_class(node))
            yield from incomplete(node.body, path, public, f"{name}{node.name}.")
            continue
        is_public = bool({place, place.rpartition(".")[0]} & public)
        is_variant = any("overload" in text or text.endswith(".setter") for text in list_decorators(node))
        if not is_variant and (is_public or not has_one_expression(node)):
            yield from (f"{place} {gap}" for gap in missing_in_function(node))


def test_no_section_of_another_convention():
    headings = [
        f"{path}: {section[0].strip()}"
        for path, tree in read_modules().items()
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, *FUNCTIONS))
        for section in GOOGLE_ONLY.finditer(ast.get_docstring(node) or "")
    ]
    assert not headings, f"{headings}: write Parameters with a line of dashes below it"


def test_parameters_fields_results_and_errors_are_described():
    public = find_public_places()
    gaps = [
        gap
        for path, tree in read_modules().items()
        if not any(Path(path).match(pattern) for pattern in COMMANDS)
        for gap in incomplete(tree.body, path, public)
    ]
    assert gaps == []


def test_the_public_names_are_found_in_their_files():
    """A place without a definition would silently not be checked."""
    modules = read_modules()
    for place in find_public_places():
        path, _, name = place.partition(":")
        assert any(getattr(node, "name", None) == name for node in modules[path].body), place


def test_types_of_results_and_errors_exist():
    """Classes named in `Returns`, `Yields` and `Raises` exist in the module, the package or Python."""
    modules = read_modules()
    classes = {node.name for tree in modules.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    unknown = []
    for path, tree in modules.items():
        module_names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        module_names |= {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        for node in ast.walk(tree):
            if not isinstance(node, (*FUNCTIONS, ast.ClassDef)):
                continue
            sections = read_sections(node)
            for heading in {"Returns", "Yields", "Raises"} & sections.keys():
                heads = [line for line in sections[heading].splitlines() if line and not line[0].isspace()]
                names = set(re.findall(r"(?<![\w.])[A-Z]\w*[a-z]\w*", " ".join(heads)))
                unknown += [
                    f"{path}:{node.name} {name}"
                    for name in names - classes - module_names
                    if not hasattr(builtins, name)
                ]
    assert unknown == []


DESCRIBED = "'''Text.\n\n    Parameters\n    ----------\n    *a\n        A.\n    '''"


@pytest.mark.parametrize(
    ("code", "gaps"),
    [
        ("def f(a):\n    '''Text.'''\n    a.b()\n    a.c()", ["parameter a"]),
        (f"def f(*a):\n    {DESCRIBED}\n    a.b()\n    a.c()", []),
        (f"def f():\n    {DESCRIBED}\n    b()\n    c()", ["no parameter a"]),
        ("def f():\n    '''Text.'''\n    a = 1\n    return a", ["result"]),
        ("def f():\n    '''Text.'''\n    a = 1\n    yield a", ["result"]),
        ("def f():\n    '''Text.'''\n    return a()", []),
        ("def public():\n    '''Text.'''\n    return a()", ["result"]),
        ("def f():\n    '''Text.'''\n    if a:\n        raise InputError(b)", ["error InputError"]),
        ("def f():\n    '''Text.'''\n    try:\n        raise InputError(b)\n    except InputError:\n        c", []),
        ("@dataclass\nclass A:\n    '''Text.'''\n    a: int\n    b: int\n    '''B.'''\n    _c: int = 0", ["field a"]),
        (
            "class A:\n    '''Text.'''\n    def b(self, c):\n        '''Text.'''\n        c.d()\n        c.e()",
            ["parameter c"],
        ),
        ("def _f(a):\n    '''Text.'''\n    a.b()\n    a.c()", []),
    ],
)
def test_each_gap_is_seen(code, gaps):
    found_gaps = [gap.partition(" ")[2] for gap in incomplete(ast.parse(code).body, "m.py", {"m.py:public"})]
    assert found_gaps == gaps
