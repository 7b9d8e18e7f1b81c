"""Digests of the sources that solve and that evaluate: a stored result is used as long as they are equal.

A digest covers an import closure, which is read from the sources without an import. Docstrings, comments, texts of
inputs and messages of exceptions do not count. Modules that read, write or show inputs do not count either, since the
inputs are in the id of a case.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache
from importlib.util import cache_from_source, find_spec
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.feature_registry import find_places
from fecontact.files import read_json, write_json

_PACKAGE = Path(__file__).parents[1]
SOLVING_MODULES = ("solving.solve",)
"""Modules that make a solution, together with their imports."""
_FEATURE_MODULES = sorted(
    {place.rpartition(".")[0] for kind in ("READINGS", "TELLINGS") for place in find_places(kind).values()}
)
EVALUATING_MODULES = (
    "runs.store",
    "runs.map_positions",
    *(place.removeprefix("fecontact.") for place in _FEATURE_MODULES if place.startswith("fecontact.")),
)
"""Modules that read a solution back, judge it and write its records, together with their imports."""
JUDGING_MODULES = (
    "criteria",
    "contact_theories.registry",
    *(f"judging.{name}" for name in ("judge", "judged_load", "lobes", "notes", "theory", "verdict")),
    *(f"judging.{name}" for name in ("ladder", "reference_check", "causes", "comparison")),
)
"""Modules that solving uses only for a verdict. Stored results are also asked whether they would be refined further."""
INPUT_MODULES = ("files", "inputs")
"""Modules that read, check and show inputs; the values of inputs are in the id of a case."""
DISPLAY_MODULES = ("jobs", "outputs.style", "outputs.figures", "outputs.paraview", "runs.identity", "runs.sources")
"""Modules for the files that accompany the numbers of a result."""
# Arguments with texts about an input.
_TEXT_ARGUMENTS = {"help", "label", "domain", "remedy", "forms", "options"}


@dataclass(frozen=True, kw_only=True)
class Digests:
    """Digests of the sources of this package.

    Attributes
    ----------
    solving
        Digest of the sources that solve.
    evaluating
        Digest of the sources that only evaluate.
    """

    solving: str
    evaluating: str


@cache
def read_digests() -> Digests:
    """Digests of this package.

    They are kept beside its compiled modules as long as no source changes.

    Returns
    -------
    Digests
        The digests.
    """
    cache_file = Path(cache_from_source(__file__)).with_suffix(".json")
    files = [
        *_list_source_files(_PACKAGE),
        *(path for folder in _list_foreign_folders() for path in _list_source_files(folder)),
    ]
    sources = hashlib.sha256(b"\0".join(map(_name_and_content, files))).hexdigest()
    with contextlib.suppress(InputError, KeyError, TypeError, AttributeError):
        cached_values = read_json(cache_file)
        if cached_values.pop("sources") == sources:
            return Digests(**cached_values)
    new_digests = compute_digests(_PACKAGE)
    if foreign := [
        _name_and_content(path) for folder in _list_foreign_folders() for path in _list_source_files(folder)
    ]:
        # the complete package that offers a feature: the modules of it that judge cannot be identified
        evaluating = hashlib.sha256(b"\0".join((new_digests.evaluating.encode(), *foreign))).hexdigest()[:16]
        new_digests = replace(new_digests, evaluating=evaluating)
    if not sys.dont_write_bytecode:
        # if the folder of the package cannot be written, the next process computes the digests again
        with contextlib.suppress(OSError):
            write_json(cache_file, {"sources": sources, **asdict(new_digests)})
    return new_digests


def _list_source_files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".toml"))


def _list_foreign_folders() -> list[Path]:
    """Folders of other packages with features that judge or write records."""
    homes = {place.partition(".")[0] for place in _FEATURE_MODULES if not place.startswith("fecontact.")}
    specs = (find_spec(home) for home in sorted(homes))
    return [Path(folder) for spec in specs if spec for folder in spec.submodule_search_locations or ()]


def compute_digests(package: Path) -> Digests:
    """Compute the digests of the package in a folder.

    Parameters
    ----------
    package
        Folder of the package.

    Returns
    -------
    Digests
        The digests.
    """
    solving = collect_imports(package, SOLVING_MODULES, (*JUDGING_MODULES, *INPUT_MODULES))
    return Digests(
        solving=_digest_modules(package, solving),
        evaluating=_digest_modules(
            package, collect_imports(package, EVALUATING_MODULES, (*INPUT_MODULES, *DISPLAY_MODULES)) - solving
        ),
    )


def collect_imports(package: Path, roots: Iterable[str], excluded: Iterable[str] = ()) -> set[str]:
    """Collect the modules that some modules import, directly or through others.

    Parameters
    ----------
    package
        Folder of the package.
    roots
        Dotted names of the first modules, without the name of the package.
    excluded
        Modules and packages that are not entered.

    Returns
    -------
    set of str
        Dotted names, with the first modules.
    """
    modules: set[str] = set()
    queue = list(roots)
    while queue:
        module = queue.pop()
        if module not in modules and not any(f"{module}.".startswith(f"{name}.") for name in excluded):
            modules.add(module)
            imports, _ = _read_source(_module_path(package, module).read_text("utf-8"))
            queue += (name for name in imports if _module_path(package, name).is_file())
    return modules


def _digest_modules(package: Path, modules: Iterable[str]) -> str:
    """Digest of modules, and of the data files beside them."""
    paths = {module: _module_path(package, module) for module in sorted(modules)}
    code_digests = [f"{module} {_read_source(path.read_text('utf-8'))[1]}".encode() for module, path in paths.items()]
    data_path = sorted({data_path for path in paths.values() for data_path in path.parent.glob("data/*.toml")})
    return hashlib.sha256(b"\0".join((*code_digests, *map(_name_and_content, data_path)))).hexdigest()[:16]


def _module_path(package: Path, module: str) -> Path:
    path = package.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _name_and_content(path: Path) -> bytes:
    return path.name.encode() + b"\0" + path.read_bytes()


@lru_cache(maxsize=1024)
def _read_source(text: str) -> tuple[list[str], str]:
    """Read the imports of a module from the package, and a digest of its code.

    The imports are modules and names.
    """
    tree = ast.parse(text)
    imports: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("fecontact."):
            module = node.module.removeprefix("fecontact.")
            # a name that is imported from a package may be a module of this package
            imports += [module, *(f"{module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Call):
            node.keywords = [keyword for keyword in node.keywords if keyword.arg not in _TEXT_ARGUMENTS]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Call):
            # the help of an input is a sentence after its default
            node.value.args = [argument for argument in node.value.args if not _is_sentence(argument)]
        elif isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            node.exc.args = []
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [statement for statement in node.body if not _is_text(statement)]
    return imports, hashlib.sha256(_syntax_text(tree).encode()).hexdigest()


def _syntax_text(node: Any) -> str:
    """Text of a syntax tree, equal on every Python.

    Fields that are None or empty are left out: `ast.dump` prints them up to Python 3.12 only, and 3.12 has a field
    `type_params` that 3.11 does not have. 3.12 ends some format strings with an empty constant.
    """
    if isinstance(node, ast.AST):
        if isinstance(node, ast.JoinedStr):
            node.values = [
                segment for segment in node.values if not (isinstance(segment, ast.Constant) and segment.value == "")
            ]
        # plain loops: with generators and `ast.iter_fields` the texts take 1.7 times as long, a third of a digest
        fields = []
        for name in node._fields:
            value = getattr(node, name, None)
            if value is not None and value != []:
                fields.append(f"{name}={_syntax_text(value)}")
        return f"{type(node).__name__}({', '.join(fields)})"
    if isinstance(node, list):
        return f"[{', '.join([_syntax_text(element) for element in node])}]"
    return repr(node)


def _is_sentence(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a docstring, also the docstring of an attribute."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)
