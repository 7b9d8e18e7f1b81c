"""How far two results may be apart and still be the same: one tolerance for each kind of column, and why."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fecontact.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Two numbers are the same if they differ by no more than the larger of both parts.

    Attributes
    ----------
    relative
        Part of the baseline's magnitude.
    absolute
        In the unit of the column.
    reason
        Why it is of this size.
    """

    relative: float = 0.0
    absolute: float = 0.0
    reason: str = ""

    def allowed(self, baseline: float) -> float:
        """Largest difference from a baseline value, in its unit."""
        return max(self.absolute, self.relative * abs(baseline))


# Rounding (PARDISO against multigrid: 3e-12 of the peak) and the end of the contact iteration (2e-7 of the pressure)
# are far below all of these. Another version of gmsh or MKL moves nodes by rounding, which may end in another mesh of a
# cross-section: an element size changed by 1e-6 made one of 3 % more unknowns at `quick`. On R 300 under R 460 with
# 100 kN it moved the peak by 2e-5, the approach by 1.4e-4 and the depth of the largest stress by 2 µm; on 60E1 under
# S1002 at +0.5 mm and 80 kN, where two lobes share the load, the peak by 4e-4 and the approach by 1.4e-3, which is
# beyond their tolerances. What one wants to hear of is above all of these: another model, another solution, a mesh that
# is finer or coarser.
KINDS: Mapping[str, Tolerance] = MappingProxyType(
    {
        "pressure": Tolerance(relative=1e-4, reason="smooth in the mesh; 1/50 of the usual discretisation error"),
        "approach": Tolerance(relative=5e-4, reason="has the stiffness of the coarse mesh of the whole bodies in it"),
        "stress": Tolerance(relative=1e-3, reason="recovered from derivatives; moved by 3.5e-4 by the change above"),
        "area": Tolerance(relative=1e-3, reason="read from the edge of the pressure, where one node may come or go"),
        "length": Tolerance(relative=1e-3, absolute=2e-3, reason="read from the same edge; 2 µm about zero"),
        "position": Tolerance(absolute=1e-4, reason="touch point of the rigid bodies, found by a root search"),
        "theory": Tolerance(relative=1e-6, reason="closed form; only the force and the touch point go into it"),
        "force": Tolerance(relative=1e-6, reason="given, or its component along the normal; no mesh in it"),
        "angle in rad": Tolerance(absolute=1e-6, reason="slope at the touch point"),
        "angle in mrad": Tolerance(absolute=1e-3, reason="slope at the touch point"),
        "input": Tolerance(relative=1e-8, absolute=1e-12, reason="given, not computed; a baseline keeps 10 digits"),
        "fraction": Tolerance(absolute=1e-3, reason="a ratio of areas or of lengths"),
        "percent": Tolerance(absolute=0.1, reason="in percentage points: 1e-3 of an area, a length or a load"),
        "percent of a pressure": Tolerance(absolute=0.01, reason="in percentage points: 1e-4 of a pressure"),
        "percent of an approach": Tolerance(absolute=0.05, reason="in percentage points: 5e-4 of an approach"),
        "percent of a small load": Tolerance(absolute=0.01, reason="in percentage points: 1/10 of what Hertz may lose"),
        "uncertainty": Tolerance(
            absolute=0.3, reason="in percentage points: 3 x the value's, the change of two meshes"
        ),
        "uncertainty of a pressure": Tolerance(absolute=0.03, reason="in percentage points: 3 x the pressure's"),
        "uncertainty of a small load": Tolerance(absolute=0.03, reason="in percentage points: 3 x the load's"),
        "fraction of a limit": Tolerance(absolute=0.01, reason="1e-3 of an area or a length at limits of 10 %"),
        "uncertainty of a fraction": Tolerance(absolute=3e-3, reason="3 x the fraction's"),
        "creep force": Tolerance(absolute=30.0, reason="in N: 1e-3 of mu N at 100 kN and 0.3, whatever the part of it"),
        "creep moment": Tolerance(absolute=300.0, reason="in N mm: that force on an arm of 10 mm"),
        "creepage": Tolerance(
            absolute=1e-6, reason="1e-4 of what saturates; of the wheelset's, place of the touch point"
        ),
        "spin": Tolerance(absolute=3e-9, reason="in 1/mm: the slope at the touch point over the rolling radius"),
        "count": Tolerance(reason="a number of things that are there"),
        "default": Tolerance(relative=1e-4, reason="a column whose name says no known unit"),
    }
)
"""Kinds of numbers."""

TEXT = "text"
"""Kind of a column that is compared letter by letter."""

LATER = ("theory_", "of_elements_")
"""Columns that begin like this are no difference where the baseline is older than they are, and are named."""

EFFORT = "effort"
"""Kind of a column that is shown and not compared: it depends on the machine and on the path of the solver."""

_TEXTS = (
    *(
        "id",
        "status",
        "rail",
        "wheel",
        "load_kind",
        "rail_irregularity",
        "wheel_irregularity",
        "side",
        "roll",
        "at_junction",
        "junction_in_patch",
        "resolution",
        "cause",
        "warnings",
    ),
    *("verdict", "verdict_measure", "verdict_failing", "verdict_cause", "verdict_warnings"),
)
_EFFORTS = ("iterations", "degrees_of_freedom", "meshes", "load_balance", "seconds", "peak_memory_MB")
_INPUTS = (
    *("lateral_shift_mm", "load_kN", "inclination_rad", "roll_mrad", "yaw_mrad"),
    *("roll_load_kN", "opposite_load_kN", "distance_mm"),
)
_NAMED: Mapping[str, str] = {
    **dict.fromkeys(_TEXTS, TEXT),
    **dict.fromkeys(_EFFORTS, EFFORT),
    **dict.fromkeys(_INPUTS, "input"),
    **dict.fromkeys(("force_verdict", "force_cause"), TEXT),
    "friction": "input",
    **dict.fromkeys(("fx_hertz_N", "fy_hertz_N", "fx_fe_N", "fy_fe_N"), "creep force"),
    **dict.fromkeys(("mz_hertz_Nmm", "mz_fe_Nmm"), "creep moment"),
    **dict.fromkeys(("xi", "eta"), "creepage"),
    "spin_per_mm": "spin",
    "lowered_mm": "position",
    "touch_rail_y_mm": "position",
    "touch_wheel_y_mm": "position",
    "touch_points": "count",
    "pieces": "count",
    "lobes": "count",
    "separate_load_percent": "percent of a small load",
    "separate_load_uncertainty_percent": "uncertainty of a small load",
    "limit_used": "fraction of a limit",
    "centre_over_b": "fraction",
    "centre_uncertainty_over_b": "uncertainty of a fraction",
    "overlap": "fraction",
    "junction_distance_mm": "position",
    # of the patch's edge, which is read from the pressure
    **dict.fromkeys(("junction_distance_over_b", "curvature_variation", "normal_turn_rad"), "fraction"),
}
# The first that fits; what stands before a unit goes before the unit alone.
_PATTERNS = (
    (r"^verdict_plastic|^first_yield_body$|^plastic_load_measure$", TEXT),
    (r"_plastic_strain_max$", "fraction"),
    (r"^theory_(.*_verdict|.*_measure|cheapest)$", TEXT),
    (r"^theory_.*_limit_used$", "fraction of a limit"),
    (r"^of_elements_verdict(_measure)?$", TEXT),
    # of coarse nodes: what is read moves with the places of single ones
    (r"^of_elements_.*_uncertainty_percent$", "uncertainty"),
    (r"p_max_(step_\w+_)?uncertainty_percent$", "uncertainty of a pressure"),
    (r"_uncertainty_percent$", "uncertainty"),
    (r"p_max_(deviation|step_\w+)_percent$", "percent of a pressure"),
    (r"approach_(deviation|step_\w+)_percent$", "percent of an approach"),
    (r"_percent$", "percent"),
    (r"(^|_)hertz_", "theory"),
    (r"^von_mises_.*_MPa$", "stress"),
    (r"approach_.*mm$", "approach"),
    (r"_MPa$", "pressure"),
    (r"_mm2$", "area"),
    (r"_mm$", "length"),
    (r"_k?N$", "force"),
    (r"_rad$", "angle in rad"),
    (r"_mrad$", "angle in mrad"),
    (r"_(s|seconds|MB)$", EFFORT),
)


# asked for each value of a column
@cache
def kind_of(column: str) -> str:
    """Kind of a column by its name: by the whole name, by its unit, or `default`."""
    if column in _NAMED:
        return _NAMED[column]
    return next((kind for pattern, kind in _PATTERNS if re.search(pattern, column)), "default")


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances by kind, and by column where a column has its own."""

    kinds: Mapping[str, Tolerance] = field(default_factory=lambda: KINDS)
    columns: Mapping[str, Tolerance] = field(default_factory=dict)

    def of(self, column: str) -> Tolerance | None:
        """Tolerance of a column, or None if it is text or not compared."""
        return self.columns.get(column) or self.kinds.get(kind_of(column))


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    relative: Annotated[float | None, Field(ge=0.0, allow_inf_nan=False)] = None
    absolute: Annotated[float | None, Field(ge=0.0, allow_inf_nan=False)] = None

    def over(self, tolerance: Tolerance) -> Tolerance:
        """The tolerance with the parts that are given here."""
        return replace(tolerance, **self.model_dump(exclude_none=True), reason="given in the tolerance file")


class _ToleranceFile(BaseModel):
    """Layout of a tolerance file: tables [kinds.NAME] and [columns.NAME]."""

    model_config = ConfigDict(extra="forbid", strict=True)
    kinds: dict[str, _Entry] = {}
    columns: dict[str, _Entry] = {}


def read_tolerances(path: str | Path) -> Tolerances:
    """The tolerances of a TOML file over those of `KINDS`; a part that is not given stays.

    A column of kind `effort` that is named is compared.

    Raises
    ------
    InputError
        If the file does not exist, is no TOML, or names a kind or a value that there is not.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"tolerances {path}: no such file; give a TOML file with [kinds.NAME] or [columns.NAME]")
    try:
        given = _ToleranceFile.model_validate(tomllib.loads(path.read_text("utf-8")))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"tolerances {path}: it is not TOML ({error}); correct it") from error
    except ValidationError as error:
        raise InputError(f"tolerances {path}: {_first(error)}") from error
    for name in given.kinds:
        if name not in KINDS:
            raise InputError(f"tolerances {path}: kinds.{name}: no such kind; allowed are {', '.join(KINDS)}")
    for name in given.columns:
        if kind_of(name) == TEXT:
            raise InputError(f"tolerances {path}: columns.{name} is text and compared exactly; take it out")
    kinds = {name: given.kinds[name].over(t) if name in given.kinds else t for name, t in KINDS.items()}
    own = {name: entry.over(kinds.get(kind_of(name), Tolerance())) for name, entry in given.columns.items()}
    return Tolerances(kinds=kinds, columns=own)


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    return (
        f"{where} is {first['input']!r}: {first['msg']}; allowed are tables [kinds.NAME] and [columns.NAME] with"
        " relative and absolute, finite and >= 0"
    )
