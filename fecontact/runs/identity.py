"""Which result is whose: the id of a case from its inputs, and what made a result beside them."""

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
from fecontact.case import Case, case_record
from fecontact.errors import InputError
from fecontact.fe.linear_solver import choose_solver
from fecontact.jobs.store import Origin
from fecontact.profiles.library import content_of, profile_file
from fecontact.runs.sources import digests

SOLVING_SOURCE = "source of solving"
_MOST_SHOWN_BYTES = 60
_COMMON = ("numpy", "scipy", "scikit-fem", "gmsh")
_SOLVERS = {"pardiso": ("pypardiso", "mkl"), "amg": ("pyamg",)}


def case_id(case: Case, loads_N: Sequence[float] = ()) -> str:
    """Readable name of a case with a hash of all inputs that it is solved with, usable as a file name.

    That of a position under several loads is the name of its case at the largest load, with a hash of all loads.

    Of a profile that is a file the content counts, not the folder. Neither do criteria and creepages count, with which
    a solved case is judged, nor versions: results of two versions have the same ids and can be compared row by row.
    """
    if loads_N:
        return f"{case_id(replace(case, load_N=max(loads_N)))}_{json_digest(sorted(set(loads_N)))[:8]}"
    record = {name: value for name, value in case_record(case).items() if name not in ("criteria", "creep")}
    files = input_files(case)
    for body, file in files.items():
        # the ending decides how the content is read
        content = {"sha256": file["sha256"], "ending": Path(file["name"]).suffix.lower()}
        inner = body.removeprefix("opposite_")
        (record if inner == body else record["opposite"])[inner] = content
    shown = (Path(case.profiles[body]).stem if body in files else case.profiles[body] for body in ("rail", "wheel"))
    names = "_".join(_shown("".join(c if c.isalnum() or c in ".-" else "-" for c in name)) for name in shown)
    return f"{names}_{case.lateral_shift_mm:+.2f}mm_{case.load_N / 1e3:g}kN_{json_digest(record)[:8]}"


def _shown(name: str) -> str:
    """As much of a name as leaves room for the rest in the name of a file, which has 255 bytes."""
    return name.encode("utf-8", "replace")[:_MOST_SHOWN_BYTES].decode("utf-8", "ignore")


def input_files(case: Case) -> dict[str, dict[str, str]]:
    """Name and sha256 of the profiles that are files, by body; one that cannot be read is left for `solve`."""
    found = {}
    for body, spec in case.profiles.items():
        try:
            file = content_of(spec)
        except OSError:
            continue
        if file is not None:
            found[body] = {"name": file[0], "sha256": hashlib.sha256(file[1]).hexdigest()}
    return found


def with_absolute_paths(case: Case) -> Case:
    """The same case for a process that runs in another folder."""
    paths = {body: profile_file(spec) for body, spec in case.profiles.items()}
    return case.with_profiles({body: str(path.absolute()) for body, path in paths.items() if path is not None})


def origin_of(case: Case) -> Origin:
    """Everything beside the inputs that decides about the numbers of a case on this machine.

    Versions of this package, of Python and of the packages that compute; the solver path; digests of the sources that
    solve and that evaluate, the criteria, and friction with creepages. A solver that this machine does not have is left
    for `solve` to refuse.
    """
    solving = _solving(case.solver)
    if input_files(case):
        # theories on the other lines that measured points allow are stored with the solution
        solving = {**solving, SOLVING_SOURCE: json_digest([digests().solving, digests().evaluating])}
    criteria = {f"criterion {name}": repr(limit) for name, limit in asdict(case.criteria).items()}
    creep = {f"creep {name}": repr(value) for name, value in asdict(case.creep).items() if case.creep.friction}
    evaluated = {"source of evaluation": digests().evaluating, **criteria, **creep}
    return Origin(solved_by=solving, evaluated_by=evaluated)


@cache
def _solving(solver: str) -> Mapping[str, str]:
    try:
        path: str = choose_solver(solver)  # type: ignore[arg-type]
    except InputError:
        path = solver
    return {
        "fecontact": __version__,
        "python": ".".join(platform.python_version_tuple()[:2]),
        **_versions((*_COMMON, *_SOLVERS[path])),
        "solver path": path,
        SOLVING_SOURCE: digests().solving,
    }


def _versions(packages: Iterable[str]) -> dict[str, str]:
    from importlib import metadata

    found = {}
    for package in packages:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "absent"
    return found


def provenance(case: Case, **more: Any) -> dict[str, Any]:
    """Where a result comes from: what made it, platform, input files, and more that is given."""
    made = origin_of(case)
    return {
        **more,
        "made_by": {**made.solved_by},
        "evaluated_by": {**made.evaluated_by},
        "platform": platform.platform(),
        "input_files": input_files(case),
    }


def json_digest(value: object) -> str:
    """SHA-256 of a value of plain JSON, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
