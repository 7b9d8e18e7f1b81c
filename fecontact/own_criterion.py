"""Criterion of a user: a Python function of the pressure and the gap, which other processes can import."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib.machinery import PathFinder
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

from fecontact.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactField:
    """Pressure and gap of a contact on a grid of nodes.

    It is the argument of a user's function. The arrays are read-only. A sum over `weight_mm2` is an integral over the
    surface.

    Attributes
    ----------
    x_mm : ndarray of shape (nx,)
        Positions along the rail, from the first contact point.
    s_mm : ndarray of shape (ns,)
        Arc lengths across the rail, from the first contact point.
    pressure_MPa : ndarray of shape (nx, ns)
        Pressure at each node of the whole contact.
    weight_mm2 : ndarray of shape (nx, ns)
        Area of each node.
    normal_force_N
        Force along the contact normal.
    undeformed_gap
        Function from x (nx, 1) and s (1, ns) in mm to the undeformed gap (nx, ns) in mm.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.own_criterion import ContactField
    >>> contact = ContactField(
    ...     x_mm=np.array([-1.0, 0.0, 1.0]),
    ...     s_mm=np.array([0.0, 1.0]),
    ...     pressure_MPa=np.full((3, 2), 10.0),
    ...     weight_mm2=np.ones((3, 2)),
    ...     normal_force_N=60.0,
    ...     undeformed_gap=lambda x, s: 0.5 * (x**2 + s**2),
    ... )
    >>> float(contact.gap_mm[0, 1])
    1.0
    """

    x_mm: NDArray[np.float64]
    s_mm: NDArray[np.float64]
    pressure_MPa: NDArray[np.float64]
    weight_mm2: NDArray[np.float64]
    normal_force_N: float
    undeformed_gap: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("x_mm", "s_mm", "pressure_MPa", "weight_mm2"):
            view = getattr(self, name).view()
            view.flags.writeable = False
            object.__setattr__(self, name, view)

    # The gap takes a hundred times as long as the pressure, and most functions do not use it.
    @cached_property
    def gap_mm(self) -> NDArray[np.float64]:
        """Undeformed gap (nx, ns) between the bodies along the normals of the rail in mm."""
        gap = self.undeformed_gap(self.x_mm[:, None], self.s_mm[None, :])
        gap.flags.writeable = False
        return gap


@dataclass(frozen=True)
class UnavailableFunction:
    """Stored function that this process cannot import.

    Attributes
    ----------
    reference
        Module and name, as `module:name`.
    source
        Source text of the function.
    reason
        Reason why the function is not used.
    """

    reference: str
    source: str
    reason: str


OWN_PREFIX, _ABSOLUTE_PREFIX, _UNIT_MARK = "own_", "own_absolute_", "_in_"
"""Beginning of the names of measures that a user has defined."""
RESERVED_NAMES = (
    *("p_max", "area", "a", "b", "centre", "valley", "separate", "misplaced", "extent_x", "extent_y", "approach"),
    *("p_max_MPa", "area_mm2", "a_mm", "b_mm", "extent_x_mm", "extent_y_mm", "approach_mm"),
    *("centre_over_b", "separate_load", "misplaced_load"),
    *("strength", "patch", "all", "own", "none"),
)
"""Names of measures and of their sets, and words of options, which are no names of a user's criteria."""
_ALLOWED_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")
_ALLOWED_UNIT = re.compile(r"[A-Za-z0-9µ²³^·]+([ /][A-Za-z0-9µ²³^·]+)*")
_LONGEST_NAME = 30
_IN_FILE = "write it with def at the top level of a file .py, and import it from there"


@dataclass(frozen=True)
class OwnCriterion:
    """Criterion of a user: a function of the pressure and the gap, with a name, a limit and a unit.

    The function is evaluated on the pressure of the finite elements of each mesh level, and on the pressure of each
    theory at the same nodes. It must be at the top level of a module, so that worker processes can import it.

    Attributes
    ----------
    function
        Function from a `ContactField` to a number.
    name
        Name of the measure: letters, digits and single underscores.
    limit
        Largest allowed deviation: a fraction of the value of the finite elements, or in `unit` if not `relative`.
    unit
        Unit of the number; `-` without a unit.
    relative
        Whether the deviation is relative to the value of the finite elements; if not, it is the difference.
    reference, source
        Module and name of the function, as `module:name`, and its source text.

    Examples
    --------
    >>> from fecontact.own_criterion import OwnCriterion
    >>> OwnCriterion(lambda contact: contact.pressure_MPa.max(), "peak", 0.05)
    Traceback (most recent call last):
        ...
    fecontact.errors.InputError: own criterion peak: a lambda is not allowed; write it with def at the top level of a \
file .py, and import it from there
    """

    function: Callable[[ContactField], float] | UnavailableFunction = field(compare=False, repr=False)
    name: str
    limit: float
    unit: str = "-"
    relative: bool = True
    reference: str = field(init=False)
    source: str = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check all attributes, and read the source of the function.

        Raises
        ------
        InputError
            With the attribute, the allowed values and the remedy.
        """
        self._refuse_wrong_texts()
        limit = self.limit
        if isinstance(limit, bool) or not isinstance(limit, int | float) or not 0.0 < limit < math.inf:
            raise InputError(
                f"own criterion {self.name}: limit is {limit!r}; allowed: finite and > 0; for example 0.05"
                + (" for 5 %" if self.relative is True else f" {self.unit}")
            )
        object.__setattr__(self, "limit", float(limit))
        if not isinstance(self.relative, bool):
            raise InputError(f"own criterion {self.name}: relative is {self.relative!r}; allowed: True, False")
        if isinstance(self.function, UnavailableFunction):
            reference, source = self.function.reference, self.function.source
        else:
            reference, source = _identify_function(self.name, self.function)
        object.__setattr__(self, "reference", reference)
        object.__setattr__(self, "source", source)

    def _refuse_wrong_texts(self) -> None:
        """Refuse a name or a unit that cannot be part of the names of columns."""
        name, unit = self.name, self.unit
        if (
            not isinstance(name, str)
            or len(name) > _LONGEST_NAME
            or not _ALLOWED_NAME.fullmatch(name)
            or _UNIT_MARK in f"_{name}_"
            or name.startswith("absolute_")
        ):
            raise InputError(
                f"name of the own criterion is {name!r:.80}; allowed: at most {_LONGEST_NAME} letters, digits and"
                " single underscores, without the word in, and not beginning with absolute_; such as mean_pressure"
            )
        if name.lower() in map(str.lower, RESERVED_NAMES):
            raise InputError(
                f"name of the own criterion is {name!r}, which is a measure or a word of the program; allowed: all"
                f" except {', '.join(RESERVED_NAMES)}; such as my_{name}"
            )
        if not isinstance(unit, str) or (unit != "-" and not _ALLOWED_UNIT.fullmatch(unit)):
            raise InputError(
                f"own criterion {name}: unit is {unit!r:.80}; allowed: letters and digits, also with ^, ·, /, ², ³ and"
                " blanks, or - without a unit; for example MPa or N/mm; give a fraction in place of %"
            )

    @property
    def key(self) -> str:
        """Name of the measure in deviations, records and columns."""
        unit = "" if self.unit == "-" else f"{_UNIT_MARK}{self.unit.replace('/', '_per_').replace(' ', '_')}"
        return f"{OWN_PREFIX if self.relative else _ABSOLUTE_PREFIX}{self.name}{unit}"

    @property
    def record(self) -> dict[str, Any]:
        """Plain values for a file."""
        return {
            "name": self.name,
            "limit": self.limit,
            "unit": self.unit,
            "relative": self.relative,
            "function": self.reference,
            "source": self.source,
        }

    @property
    def digest(self) -> str:
        """Short digest of all attributes that affect the numbers: name, unit, kind of deviation and source text."""
        return hashlib.sha256(f"{self.key}\n{self.source}".encode()).hexdigest()[:12]

    @property
    def is_available(self) -> bool:
        """Whether the function can be called in this process."""
        return not isinstance(self.function, UnavailableFunction)

    def refuse_unsendable(self) -> None:
        """Refuse a function that other processes cannot import.

        Raises
        ------
        InputError
            For a function of an interactive session, and of a script that would run again in other processes.
        """
        if isinstance(self.function, UnavailableFunction):
            return
        module = sys.modules.get(self.function.__module__)
        file = inspect.getsourcefile(self.function)
        if file is None or not Path(file).is_file():
            raise InputError(
                f"own criterion {self.name}: worker processes cannot import {self.reference}, which is not in a file;"
                f" {_IN_FILE}"
            )
        if module is not None and module.__name__ == "__main__" and not _has_main_guard(Path(file)):
            raise InputError(
                f"own criterion {self.name}: worker processes would run {Path(file).name} again to import"
                f" {self.function.__name__}; put the calls of the script below if __name__ == '__main__':"
            )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the reference of the function, and the file in which other processes find it."""
        function = self.function
        if isinstance(function, UnavailableFunction):
            return OwnCriterion, (function, self.name, self.limit, self.unit, self.relative)
        self.refuse_unsendable()
        file = str(Path(inspect.getsourcefile(function) or "").absolute())
        return _load_criterion, (function.__module__, function.__name__, file, *self._settings)

    @property
    def _settings(self) -> tuple[str, float, str, bool]:
        return self.name, self.limit, self.unit, self.relative


def is_own(measure: str) -> bool:
    """Whether a measure is a measure of a user, by its name."""
    return measure.startswith(OWN_PREFIX)


def is_own_relative(measure: str) -> bool:
    """Whether a measure is a relative measure of a user, by its name."""
    return measure.startswith(OWN_PREFIX) and not measure.startswith(_ABSOLUTE_PREFIX)


def split_own_measure(measure: str) -> tuple[str, str]:
    """Name and unit of a measure that a user has defined.

    Parameters
    ----------
    measure
        Name of the measure in deviations, from `OwnCriterion.key`.

    Returns
    -------
    tuple of str
        Name and unit; the unit is `-` without a unit.

    Examples
    --------
    >>> from fecontact.own_criterion import split_own_measure
    >>> split_own_measure("own_line_load_in_N_per_mm")
    ('line_load', 'N/mm')
    """
    stem = measure.removeprefix(_ABSOLUTE_PREFIX).removeprefix(OWN_PREFIX)
    name, mark, unit = stem.partition(_UNIT_MARK)
    return name, unit.replace("_per_", "/").replace("_", " ") if mark else "-"


def _identify_function(name: str, function: Any) -> tuple[str, str]:
    """Reference and source text of a function at the top level of a module.

    Raises
    ------
    InputError
        For other objects, with the remedy.
    """
    if not isinstance(function, FunctionType):
        raise InputError(
            f"own criterion {name}: function is {function!r:.80}; allowed: a Python function of a ContactField;"
            f" {_IN_FILE}"
        )
    if function.__name__ == "<lambda>":
        raise InputError(f"own criterion {name}: a lambda is not allowed; {_IN_FILE}")
    if function.__qualname__ != function.__name__ or function.__closure__:
        raise InputError(
            f"own criterion {name}: {function.__qualname__} is inside another function or a class; {_IN_FILE}"
        )
    try:
        source = inspect.getsource(function)
    except (OSError, TypeError) as error:
        raise InputError(
            f"own criterion {name}: the source of {function.__name__} cannot be read ({error}); {_IN_FILE}"
        ) from error
    return f"{function.__module__}:{function.__name__}", source


def _has_main_guard(file: Path) -> bool:
    """Whether a script has a statement `if __name__ == "__main__":` at its top level."""
    tree = ast.parse(file.read_text("utf-8"))
    return any(isinstance(statement, ast.If) and "__name__" in ast.unparse(statement.test) for statement in tree.body)


def _load_criterion(module_name: str, function_name: str, file: str, *settings: Any) -> OwnCriterion:
    """Restore a criterion in another process, with its function from the module or its file."""
    module = sys.modules.get(module_name)
    if module_name == "__main__" or module is None or not hasattr(module, function_name):
        module = _import_file(module_name, file)
    return OwnCriterion(getattr(module, function_name), *settings)


# Every case of a study brings its criterion to a worker; the file is imported once.
@lru_cache
def _import_file(module_name: str, file: str) -> ModuleType:
    """Import a module by its name, or a script by its file."""
    try:
        found_file = None if module_name == "__main__" else _find_source_file(module_name)
        if found_file is not None and Path(found_file) == Path(file):
            return importlib.import_module(module_name)
        # a script runs as the main module of its process; here its part below the main guard must not run
        name = "__mp_main__" if module_name == "__main__" else module_name
        spec = importlib.util.spec_from_file_location(name, file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"own criterion: {file} cannot be imported ({type(error).__name__}: {error})") from error
    return module


def _find_source_file(module_name: str) -> str | None:
    """Source file of a module that can be imported, found without importing anything."""
    path: Sequence[str] | None = None
    spec = None
    parts = module_name.split(".")
    for number in range(len(parts)):
        spec = PathFinder.find_spec(".".join(parts[: number + 1]), path)
        if spec is None:
            return None
        path = spec.submodule_search_locations
    return None if spec is None else spec.origin


def restore_criterion(record: Mapping[str, Any]) -> OwnCriterion:
    """Restore a criterion of a user from its record.

    A function is used only if its module is already imported, and its source text is equal to the stored text.

    Parameters
    ----------
    record
        Record from `OwnCriterion.record`.

    Returns
    -------
    OwnCriterion
        Criterion; without an equal function, its function is an `UnavailableFunction`.

    Raises
    ------
    InputError
        If the record has other keys.
    """
    try:
        reference, source = str(record["function"]), str(record["source"])
        settings = {name: record[name] for name in ("name", "limit", "unit", "relative")}
    except (KeyError, TypeError) as error:
        raise InputError(f"own criterion: the record has no {error}; solve the case again") from error
    function, reason = _find_stored_function(reference, source)
    unavailable = UnavailableFunction(reference=reference, source=source, reason=reason)
    return OwnCriterion(unavailable if function is None else function, **settings)


def _find_stored_function(reference: str, source: str) -> tuple[Any, str]:
    """Function of an imported module with an equal source; None with the reason if there is none.

    The stored module has precedence. A script has a different module name if it is imported, run, or read by `run`.
    """
    module_name, _, function_name = reference.partition(":")
    # only modules that are already imported: a stored file must not decide which code runs
    stored_module = sys.modules.get(module_name)
    modules = [*sys.modules.values()] if stored_module is None else [stored_module]
    functions = [
        function
        for module in modules
        if isinstance(function := getattr(module, "__dict__", {}).get(function_name), FunctionType)
    ]
    for function in functions:
        if _has_source(function, source):
            return function, ""
    if stored_module is None:
        return None, f"no imported module has its function {function_name}"
    if not functions:
        return None, f"{module_name} has no function {function_name} here"
    return None, f"{function_name} in {module_name} differs from the stored function"


def _has_source(function: FunctionType, source: str) -> bool:
    """Whether the source text of a function is equal to a text."""
    try:
        return inspect.getsource(function) == source
    except (OSError, TypeError):
        return False
