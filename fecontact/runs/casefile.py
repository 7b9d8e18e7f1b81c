"""Studies as files: a Python script with `cases(quick=False)`, or a TOML file of cases; templates of both."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.regression.checks import Check
from fecontact.runs.toml_cases import toml_cases

# --- Studies as files: a Python script with `cases(quick=False)`, or a TOML file of cases.


@dataclass(frozen=True, kw_only=True)
class Study:
    """The cases of a study, its question, and what it makes of their rows: a text, and checks of its numbers."""

    name: str
    cases: tuple[Case, ...]
    conclude: Callable[[list[dict[str, Any]], Path], str | None] | None = None
    checks: Callable[[list[dict[str, Any]]], list[Check]] | None = None
    question: str = ""


def load_study(path: str | Path, *, quick: bool = False) -> Study:
    """Read a study.

    Raises
    ------
    InputError
        If the file does not exist, is neither .py nor .toml, or does not hold cases.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"study {path}: {_folder_words(path)}")
    if not path.is_file():
        raise InputError(f"study {path}: no such file; give a script of studies/ or a TOML file of cases")
    if path.suffix == ".py":
        return _from_script(path, quick)
    if path.suffix == ".toml":
        return Study(name=path.stem, cases=toml_cases(path, quick=quick))
    raise InputError(f"study {path}: the ending {path.suffix or '(none)'} is not known; allowed are .py and .toml")


def kinds() -> dict[str, str]:
    """Files by which a folder is known to hold results, and what they are of."""
    return {"study.json": "study", "row.json": "case", "map.json": "map"}


def _folder_words(folder: Path) -> str:
    """What a folder is, and what to give in its place."""
    for file, kind in kinds().items():
        if (folder / file).is_file():
            return f"it is a folder with the results of a {kind}; `fecontact judge` reads it; give the file of a study"
    found = sorted(path for path in folder.iterdir() if path.suffix in (".toml", ".py"))
    files = ", ".join(map(str, found[:3])) + ", ..." * (len(found) > 3)
    return f"it is a folder; give the file of a study{f', such as {files}' if files else ''}"


def _from_script(path: Path, quick: bool) -> Study:
    module = _import(path)
    make = getattr(module, "cases", None)
    if not callable(make):
        raise InputError(f"study {path}: it has no function cases(quick=False) that returns a list of Case")
    cases = tuple(make(quick=quick))
    if not cases or not all(isinstance(case, Case) for case in cases):
        raise InputError(f"study {path}: cases() must return at least one Case and nothing else")
    return Study(
        name=path.stem,
        cases=cases,
        conclude=getattr(module, "conclude", None),
        checks=getattr(module, "checks", None),
        question=(module.__doc__ or "").partition("\n")[0],
    )


def _import(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"fecontact_study_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise InputError(f"study {path}, line {error.lineno}: {error.msg}") from error
    return module
