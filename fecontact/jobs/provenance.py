"""Which result is whose: the id of a case from its inputs, the fingerprint of a result from what made it."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from fecontact import __version__
from fecontact.case import Case, case_record

_PACKAGE = Path(__file__).parents[1]
# Parts that bring cases in, carry results about or write them: no number of a result depends on them.
_NOT_NUMERICAL = {
    "__main__.py",
    "cli.py",
    "files.py",
    "jobs",
    "options.py",
    "outputs",
    "regression",
    "runs",
    "system_check.py",
}
_COMMON = ("numpy", "scipy", "scikit-fem", "gmsh")
_SOLVERS = {"pardiso": ("pypardiso", "mkl"), "amg": ("pyamg",)}


def case_id(case: Case) -> str:
    """Readable name of a case with a hash of all its inputs, usable as a file name.

    Of a profile that is a file the content counts, not the folder. Versions do not count: results of two versions have
    the same ids and can be compared row by row.
    """
    record = case_record(case)
    for body, file in input_files(case).items():
        # the ending decides how the content is read
        record[body] = {"sha256": file["sha256"], "ending": Path(file["path"]).suffix.lower()}
    shown = (Path(name).stem if body in input_files(case) else name for body, name in _bodies(case).items())
    names = "_".join("".join(c if c.isalnum() or c in ".-" else "-" for c in name) for name in shown)
    return f"{names}_{case.lateral_shift_mm:+.2f}mm_{case.load_N / 1e3:g}kN_{json_digest(record)[:8]}"


def position_id(case: Case, loads_N: Sequence[float]) -> str:
    """Name of a position of a map: that of its case at the largest load, with a hash of all loads."""
    return f"{case_id(case)}_{json_digest(sorted(set(loads_N)))[:8]}"


def input_files(case: Case) -> dict[str, dict[str, str]]:
    """Path and sha256 of the profiles that are files, by body; one that cannot be read is left for `solve`."""
    found = {}
    for body, path in _profile_paths(case).items():
        try:
            found[body] = {"path": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
        except OSError:
            continue
    return found


def with_absolute_paths(case: Case) -> Case:
    """The same case for a process that runs in another folder."""
    paths = {body: str(path.absolute()) for body, path in _profile_paths(case).items()}
    return replace(case, rail=paths.get("rail", case.rail), wheel=paths.get("wheel", case.wheel))


def _profile_paths(case: Case) -> dict[str, Path]:
    from fecontact.profiles.library import names

    known = {name.lower() for name in names()}
    return {body: Path(name) for body, name in _bodies(case).items() if name.lower() not in known and _is_file(name)}


def _bodies(case: Case) -> dict[str, str]:
    return {"rail": case.rail, "wheel": case.wheel}


def _is_file(name: str) -> bool:
    try:
        return Path(name).is_file()
    except (OSError, ValueError):
        return False


def makers(case: Case) -> dict[str, str]:
    """Everything beside the inputs that decides about the numbers of a case on this machine.

    Versions of this package, of Python and of the packages that compute; the solver path; and a digest of this
    package's numerical source and data. A solver that this machine does not have is left for `solve` to refuse.
    """
    from fecontact.errors import InputError
    from fecontact.fe.linear_solver import choose_solver

    try:
        path: str = choose_solver(case.solver)
    except InputError:
        path = case.solver
    return {
        "fecontact": __version__,
        "python": ".".join(platform.python_version_tuple()[:2]),
        **_versions((*_COMMON, *_SOLVERS[path])),
        "solver path": path,
        "source of fecontact": source_digest()[:16],
    }


@cache
def _versions(packages: tuple[str, ...]) -> dict[str, str]:
    from importlib import metadata

    found = {}
    for package in packages:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "absent"
    return found


def fingerprint(name: str, made_by: Mapping[str, str]) -> str:
    """Hash of a case's id and of what made its result: equal fingerprints stand for equal numbers."""
    return json_digest({"id": name, "made_by": dict(made_by)})[:16]


def difference(old: Mapping[str, str], new: Mapping[str, str]) -> str:
    """What differs between two makers of a result, such as `numpy 2.1.0 -> 2.2.0`."""
    return ", ".join(
        f"{key} {old.get(key, 'none')} -> {new.get(key, 'none')}"
        for key in dict.fromkeys((*new, *old))
        if old.get(key) != new.get(key)
    )


@cache
def source_digest() -> str:
    """Hash of the package's numerical source and data files and of what makes a record of a result; read once."""
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*")):
        parts = path.relative_to(_PACKAGE).parts
        decides = parts[0] not in _NOT_NUMERICAL or parts == ("outputs", "record.py")
        if decides and path.suffix in (".py", ".toml") and path.is_file():
            digest.update("/".join(parts).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def provenance(case: Case, name: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Where a result comes from: fingerprint and what is in it, platform, input files, settings of the command."""
    made_by = makers(case)
    return {
        "id": name,
        "fingerprint": fingerprint(name, made_by),
        "made_by": made_by,
        "platform": platform.platform(),
        "solver_path": made_by["solver path"],
        "input_files": input_files(case),
        "settings": dict(settings),
    }


def json_digest(value: object) -> str:
    """SHA-256 of a value of plain JSON, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
