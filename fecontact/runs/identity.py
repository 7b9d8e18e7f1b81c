"""Identity of a result: the id of a case from its inputs, and the versions and sources of a result."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

from fecontact import __version__
from fecontact.case import Case, make_case_record
from fecontact.errors import InputError
from fecontact.fe.linear_solver import choose_solver
from fecontact.jobs.store import LIMIT_MARK, OWN_CRITERION_KEY, Origin
from fecontact.profiles.library import profile_file, read_content
from fecontact.runs.sources import read_digests

SOLVING_SOURCE = "source of solving"
_MAX_NAME_BYTES = 60
_COMMON_PACKAGES = ("numpy", "scipy", "scikit-fem", "gmsh")
_SOLVER_PACKAGES = {"pardiso": ("pypardiso", "mkl"), "amg": ("pyamg",)}


def make_case_id(case: Case, loads_N: Sequence[float] = ()) -> str:
    """Readable file name of a case with a hash of all inputs of its solution.

    For a profile that is a file the hash covers the content, not the folder. Criteria and creepages, with which a
    solved case is judged, do not count. Versions do not count either: results of two versions have equal ids and can be
    compared row by row.

    Parameters
    ----------
    case
        Case.
    loads_N
        Loads in N of a position under several loads. Its name is the name of the case at the largest load, with a hash
        of all loads.

    Returns
    -------
    str
        The id.
    """
    if loads_N:
        return f"{make_case_id(replace(case, load_N=max(loads_N)))}_{digest_json(sorted(set(loads_N)))[:8]}"
    record = {name: value for name, value in make_case_record(case).items() if name not in ("criteria", "creep")}
    files = digest_input_files(case)
    for body, file in files.items():
        # the ending decides how the content is read
        content = {"sha256": file["sha256"], "ending": Path(file["name"]).suffix.lower()}
        side_body = body.removeprefix("opposite_")
        (record if side_body == body else record["opposite"])[side_body] = content
    profile_names = (
        Path(case.profiles[body]).stem if body in files else case.profiles[body] for body in ("rail", "wheel")
    )
    names = "_".join(
        _shorten_name("".join(character if character.isalnum() or character in ".-" else "-" for character in name))
        for name in profile_names
    )
    return f"{names}_{case.lateral_shift_mm:+.2f}mm_{case.load_N / 1e3:g}kN_{digest_json(record)[:8]}"


def _shorten_name(name: str) -> str:
    """Shorten a name to `_MAX_NAME_BYTES`; file names have at most 255 bytes."""
    return name.encode("utf-8", "replace")[:_MAX_NAME_BYTES].decode("utf-8", "ignore")


def digest_input_files(case: Case) -> dict[str, dict[str, str]]:
    """Name and sha256 of the profiles that are files.

    A file that cannot be read is left out; `solve` refuses it.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    dict
        Name and sha256 by body.
    """
    files_by_body = {}
    for body, spec in case.profiles.items():
        try:
            file = read_content(spec)
        except OSError:
            continue
        if file is not None:
            files_by_body[body] = {"name": file[0], "sha256": hashlib.sha256(file[1]).hexdigest()}
    return files_by_body


def make_paths_absolute(case: Case) -> Case:
    """Make the paths of a case absolute, for a process in another folder.

    Parameters
    ----------
    case
        Case whose profiles may be files.

    Returns
    -------
    Case
        Case with absolute paths.
    """
    paths = {body: profile_file(spec) for body, spec in case.profiles.items()}
    return case.with_profiles({body: str(path.absolute()) for body, path in paths.items() if path is not None})


def determine_origin(case: Case) -> Origin:
    """Determine the versions, sources and criteria of the numbers of a case on this machine.

    They are the versions of this package, of Python and of the packages that compute, the solver path, the
    digests of the sources that solve and that evaluate, the criteria, and friction with creepages. A solver that this
    machine does not have is left for `solve` to refuse.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    Origin
        Versions, sources and criteria.
    """
    solved_by = _determine_solving_origin(case.solver)
    if digest_input_files(case):
        # theories for the other profile variants of measured points are stored with the solution
        solved_by = {**solved_by, SOLVING_SOURCE: digest_json([read_digests().solving, read_digests().evaluating])}
        # and so are the deviations of theories in a user's measures
        solved_by |= {f"{OWN_CRITERION_KEY}{criterion.name}": criterion.digest for criterion in case.criteria.own or ()}
    criteria = {f"criterion {name}": repr(limit) for name, limit in case.criteria.record.items() if name != "own"}
    criteria |= {
        f"{OWN_CRITERION_KEY}{criterion.name}": f"{criterion.digest}{LIMIT_MARK}{criterion.limit!r}"
        for criterion in case.criteria.own or ()
    }
    creep = {f"creep {name}": repr(value) for name, value in asdict(case.creep).items() if case.creep.friction}
    evaluated_by = {"source of evaluation": read_digests().evaluating, **criteria, **creep}
    return Origin(solved_by=solved_by, evaluated_by=evaluated_by)


@cache
def _determine_solving_origin(solver: str) -> Mapping[str, str]:
    """Versions and sources of a solution with a solver, by name.

    An unknown or unavailable solver keeps its name as the path of the solver.
    """
    try:
        path: str = choose_solver(solver)  # type: ignore[arg-type]
    except InputError:
        path = solver
    return {
        "fecontact": __version__,
        "python": ".".join(platform.python_version_tuple()[:2]),
        **_read_versions((*_COMMON_PACKAGES, *_SOLVER_PACKAGES[path])),
        "solver path": path,
        SOLVING_SOURCE: read_digests().solving,
    }


def _read_versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of packages; "absent" for a missing package."""
    from importlib import metadata

    versions_by_package = {}
    for package in packages:
        try:
            versions_by_package[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions_by_package[package] = "absent"
    return versions_by_package


def make_provenance(case: Case, **entries: Any) -> dict[str, Any]:
    """Provenance of a result: versions and sources, platform and input files.

    Parameters
    ----------
    case
        Case.
    **entries
        Further entries.

    Returns
    -------
    dict
        The provenance, for a file.
    """
    origin = determine_origin(case)
    return {
        **entries,
        "made_by": {**origin.solved_by},
        "evaluated_by": {**origin.evaluated_by},
        "platform": platform.platform(),
        "input_files": digest_input_files(case),
    }


def digest_json(value: object) -> str:
    """SHA-256 of a value of plain JSON, independent of the order of its keys."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
