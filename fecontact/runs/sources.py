"""Digests of the sources that solve and that evaluate: a stored result is used as long as they are equal.

A digest covers an import closure, read from the sources without importing anything. Docstrings, comments, texts of
inputs and of refusals do not count, nor do modules that read, write or show what is in the id of a case anyway.
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
from fecontact.feature_registry import places
from fecontact.files import read_json, write_json

_PACKAGE = Path(__file__).parents[1]
SOLVE = ("solving.solve",)
"""Modules whose imports make a solution."""
_OFFERED = sorted({place.rpartition(".")[0] for kind in ("READINGS", "TELLINGS") for place in places(kind).values()})
EVALUATE = (
    "runs.store",
    "runs.map_positions",
    *(one.removeprefix("fecontact.") for one in _OFFERED if one.startswith("fecontact.")),
)
"""Modules whose imports read a solution back, judge it and tell it."""
JUDGES = (
    "criteria",
    "contact_theories.registry",
    *(f"judging.{name}" for name in ("judge", "judged_load", "lobes", "notes", "theory", "verdict")),
    *(f"judging.{name}" for name in ("ladder", "reference_check", "causes", "comparison")),
)
"""What solving asks for a verdict alone: whether it would refine further is asked of what is stored, too."""
INPUTS = ("files", "inputs")
"""What reads, checks and tells inputs; their values are in the id of a case."""
SHOWN = ("jobs", "outputs.style", "outputs.figures", "outputs.paraview", "runs.identity", "runs.sources")
"""What is written beside the numbers of a result."""
# Arguments that say what an input is called.
_TEXTS = {"help", "label", "domain", "remedy", "forms", "options"}


@dataclass(frozen=True, kw_only=True)
class Digests:
    """Of the sources that solve, and of those that only evaluate."""

    solving: str
    evaluating: str


@cache
def digests() -> Digests:
    """Digests of this package, which are kept beside its compiled modules as long as no source changes."""
    kept = Path(cache_from_source(__file__)).with_suffix(".json")
    files = [*_files(_PACKAGE), *(path for folder in _foreign() for path in _files(folder))]
    sources = hashlib.sha256(b"\0".join(map(_named, files))).hexdigest()
    with contextlib.suppress(InputError, KeyError, TypeError, AttributeError):
        found = read_json(kept)
        if found.pop("sources") == sources:
            return Digests(**found)
    made = digests_of(_PACKAGE)
    if foreign := [_named(path) for folder in _foreign() for path in _files(folder)]:
        # all of a package that offers a feature: what of it judges is not known
        whole = hashlib.sha256(b"\0".join((made.evaluating.encode(), *foreign))).hexdigest()[:16]
        made = replace(made, evaluating=whole)
    if not sys.dont_write_bytecode:
        # a package that cannot be written to is read again by the next process
        with contextlib.suppress(OSError):
            write_json(kept, {"sources": sources, **asdict(made)})
    return made


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".toml"))


def _foreign() -> list[Path]:
    """Folders of other packages whose features judge or tell."""
    homes = {one.partition(".")[0] for one in _OFFERED if not one.startswith("fecontact.")}
    specs = (find_spec(home) for home in sorted(homes))
    return [Path(folder) for spec in specs if spec for folder in spec.submodule_search_locations or ()]


def digests_of(package: Path) -> Digests:
    """Digests of the package in a folder."""
    solving = closure(package, SOLVE, (*JUDGES, *INPUTS))
    return Digests(
        solving=_digest(package, solving),
        evaluating=_digest(package, closure(package, EVALUATE, (*INPUTS, *SHOWN)) - solving),
    )


def closure(package: Path, roots: Iterable[str], without: Iterable[str] = ()) -> set[str]:
    """Modules by their dotted names that some modules import, directly or through others; some are not entered."""
    found: set[str] = set()
    queue = list(roots)
    while queue:
        module = queue.pop()
        if module not in found and not any(f"{module}.".startswith(f"{name}.") for name in without):
            found.add(module)
            imports, _ = _read(_path(package, module).read_text("utf-8"))
            queue += (name for name in imports if _path(package, name).is_file())
    return found


def _digest(package: Path, modules: Iterable[str]) -> str:
    """Digest of modules, and of the data beside them."""
    paths = {module: _path(package, module) for module in sorted(modules)}
    does = [f"{module} {_read(path.read_text('utf-8'))[1]}".encode() for module, path in paths.items()]
    data = sorted({data for path in paths.values() for data in path.parent.glob("data/*.toml")})
    return hashlib.sha256(b"\0".join((*does, *map(_named, data)))).hexdigest()[:16]


def _path(package: Path, module: str) -> Path:
    path = package.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _named(path: Path) -> bytes:
    return path.name.encode() + b"\0" + path.read_bytes()


@lru_cache(maxsize=1024)
def _read(text: str) -> tuple[list[str], str]:
    """What a module imports of the package, modules and names, and a digest of what it does."""
    tree = ast.parse(text)
    imports: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("fecontact."):
            module = node.module.removeprefix("fecontact.")
            # what is imported from a package may be a module of it
            imports += [module, *(f"{module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Call):
            node.keywords = [one for one in node.keywords if one.arg not in _TEXTS]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Call):
            # the help of an input is a sentence, beside its default
            node.value.args = [one for one in node.value.args if not _is_sentence(one)]
        elif isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            node.exc.args = []
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [one for one in node.body if not _is_text(one)]
    return imports, hashlib.sha256(_syntax_text(tree).encode()).hexdigest()


def _syntax_text(node: Any) -> str:
    """Text of a syntax tree, the same on every Python.

    Fields that are None or empty are left out: `ast.dump` prints them up to Python 3.12 only, and 3.12 has a field
    `type_params` that 3.11 does not have. 3.12 ends some format strings with an empty constant.
    """
    if isinstance(node, ast.JoinedStr):
        node.values = [one for one in node.values if not (isinstance(one, ast.Constant) and one.value == "")]
    if isinstance(node, ast.AST):
        fields = (f"{name}={_syntax_text(value)}" for name, value in ast.iter_fields(node) if value not in (None, []))
        return f"{type(node).__name__}({', '.join(fields)})"
    if isinstance(node, list):
        return f"[{', '.join(map(_syntax_text, node))}]"
    return repr(node)


def _is_sentence(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a docstring, of a module, a class, a function or an attribute."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)
