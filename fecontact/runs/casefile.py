"""Studies as files: a Python script with `cases(quick=False)`, or a TOML file of cases."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.feature_registry import iterate_offers
from fecontact.files import path_exists
from fecontact.regression.checks import Check
from fecontact.runs.toml_cases import read_toml_cases

# --- Studies as files: a Python script with `cases(quick=False)`, or a TOML file of cases.


@dataclass(frozen=True, kw_only=True)
class Study:
    """Cases of a study, its question, and the evaluation of its rows.

    Attributes
    ----------
    name
        Name of the study.
    cases
        Its cases.
    conclude
        Makes a text from the rows and the folder of the results.
    checks
        Makes checks of numbers from the rows.
    question
        Question of the study, in a sentence.
    """

    name: str
    cases: tuple[Case, ...]
    conclude: Callable[[list[dict[str, Any]], Path], str | None] | None = None
    checks: Callable[[list[dict[str, Any]]], list[Check]] | None = None
    question: str = ""


def load_study(path: str | Path, *, quick: bool = False) -> Study:
    """Read a study from a file.

    Parameters
    ----------
    path
        Python script or TOML file.
    quick
        Whether to read the small version of the study.

    Returns
    -------
    Study
        The study.

    Raises
    ------
    InputError
        If the file does not exist, is neither .py nor .toml, or does not hold cases.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"study {path}: {_describe_folder(path)}")
    if not path_exists(path) or not path.is_file():
        reason = "a pipe or a device instead of a file" if path_exists(path) else "no such file"
        raise InputError(f"study {path}: {reason}; give a script or a TOML file of cases")
    if path.suffix == ".py":
        return _load_script(path, quick)
    if path.suffix == ".toml":
        return Study(name=path.stem, cases=read_toml_cases(path, quick=quick))
    raise InputError(f"study {path}: the file ending is {path.suffix or '(none)'}; allowed: .py, .toml")


_RESULT_FILES = {"study.json": "study", "row.json": "case", "map.json": "map"}


def list_result_files() -> dict[str, str]:
    """Files that identify a folder of results, with the kind of the results."""
    return _RESULT_FILES | list_feature_result_files()


def list_feature_result_files() -> dict[str, str]:
    """Files that identify a folder of a feature's results, with the kind of the results."""
    return {file: kind for _, files in iterate_offers("RESULT_FILES") for file, kind in files.items()}


def _describe_folder(folder: Path) -> str:
    """Describe a folder that was given in place of a file, and the remedy."""
    for file, kind in list_result_files().items():
        if (folder / file).is_file():
            remedy = ", or use `fecontact judge`" if file in _RESULT_FILES else ""
            return f"this folder has the results of a {kind}; give the file of a study{remedy}"
    study_files = sorted(path for path in folder.iterdir() if path.suffix in (".toml", ".py"))
    files = ", ".join(map(str, study_files[:3])) + ", ..." * (len(study_files) > 3)
    return f"this is a folder; give the file of a study{f', such as {files}' if files else ''}"


def _load_script(path: Path, quick: bool) -> Study:
    """Read a study from a Python script.

    Raises
    ------
    InputError
        If the script has no function `cases`, or the function returns other objects than cases.
    """
    module = _import_script(path)
    make = getattr(module, "cases", None)
    if not callable(make):
        raise InputError(
            f"study {path}: add a function cases(quick=False) that returns a list of Case; the script has none"
        )
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


def _import_script(path: Path) -> ModuleType:
    """Import a script as a module.

    Raises
    ------
    InputError
        If the script has a syntax error.
    """
    spec = importlib.util.spec_from_file_location(f"fecontact_study_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise InputError(f"study {path}, line {error.lineno}: {error.msg}") from error
    return module
