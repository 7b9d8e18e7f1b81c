"""A case: everything that decides about one result, as plain values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from fecontact.errors import InputError, check_positive
from fecontact.material import STEEL, Material


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """How far Hertz may be off the finite elements and still hold: relative limits of peak pressure and patch area."""

    p_max: float = 0.05
    area: float = 0.10

    def __post_init__(self) -> None:
        for name, value in self.limits.items():
            if not (math.isfinite(value) and 0.0 < value < 1.0):
                raise InputError(f"limit of {name} is {value!r}; allowed: between 0 and 1, for example 0.05 for 5 %")

    @property
    def limits(self) -> dict[str, float]:
        """Limits by the name of the measure."""
        return {"p_max_MPa": self.p_max, "area_mm2": self.area}


@dataclass(frozen=True, kw_only=True)
class BodySize:
    """Where the bodies are cut (mm): the rail's base below its crown, the sweep to each side, the rim's thickness.

    The rail is fixed at its base and held across at its ends, where it goes on: otherwise its head would roll on the
    slender web, which is a matter of the track and not of the contact. The rim is driven at its inner face.
    """

    rail_depth_mm: float = 60.0
    rail_half_length_mm: float = 60.0
    rim_thickness_mm: float = 65.0
    rim_half_length_mm: float = 60.0


@dataclass(frozen=True, kw_only=True)
class Track:
    """Track and wheelset dimensions (mm).

    The gauge is measured `gauge_depth_mm` below the highest point of the inclined rail. `rail_crown_y_mm` puts the
    crown of the rail at a given distance from the track centre instead (for heads without a gauge face).
    """

    gauge_mm: float = 1435.0
    gauge_depth_mm: float = 14.0
    back_to_back_mm: float = 1360.0
    tape_circle_from_back_mm: float = 70.0
    rail_crown_y_mm: float | None = None

    @property
    def tape_circle_y_mm(self) -> float:
        """Distance of the tape circle from the wheelset's centre."""
        return 0.5 * self.back_to_back_mm + self.tape_circle_from_back_mm


LoadKind = Literal["vertical", "normal"]
SolverChoice = Literal["auto", "pardiso", "amg"]

RESOLUTIONS = {"quick": 5.0, "standard": 8.0, "fine": 12.0}
"""Named resolutions: elements a semi-axis of the expected patch, in each direction."""

INCLINATION_1_40 = math.atan(1.0 / 40.0)


@dataclass(frozen=True, kw_only=True)
class Case:
    """One wheel-rail position under one load.

    Attributes
    ----------
    rail, wheel
        Library name, a profile file, `circle:R` or `arcs:R/R@D` (rail), `cylinder:R` (wheel); lengths in mm.
    inclination_rad
        Rail inclination, towards the track centre; 0 for a profile that is already canted.
    lateral_shift_mm
        Wheelset displacement, positive towards this rail.
    load_N, load_kind
        Wheel load: vertical, or along the contact normal at first touch.
    resolution
        `quick`, `standard`, `fine`, or the element sizes (along x, across) on the contact surface in mm.
    criteria
        Limits within which Hertz holds.
    refine_degrees_of_freedom
        An unresolved verdict is refined as long as the next pair of meshes is expected to have fewer degrees of freedom
        than this, which bounds time and memory alike, on every machine in the same way; 0 never refines.
    """

    rail: str = "60E1"
    wheel: str = "S1002"
    inclination_rad: float = INCLINATION_1_40
    lateral_shift_mm: float = 0.0
    roll_rad: float = 0.0
    yaw_rad: float = 0.0
    load_N: float = 100e3
    load_kind: LoadKind = "vertical"
    rail_material: Material = STEEL
    wheel_material: Material = STEEL
    rolling_radius_mm: float = 460.0
    track: Track = field(default_factory=Track)
    size: BodySize = field(default_factory=BodySize)
    resolution: str | tuple[float, float] = "standard"
    solver: SolverChoice = "auto"
    criteria: Criteria = field(default_factory=Criteria)
    refine_degrees_of_freedom: int = 400_000

    def __post_init__(self) -> None:
        check_positive("load", self.load_N, "N", "give the wheel load, for example 100000 N (100 kN)")
        check_positive("rolling radius", self.rolling_radius_mm, "mm", "railway wheels have 300 to 625 mm")
        _check_range("lateral shift", self.lateral_shift_mm, -60.0, 60.0, "mm", "")
        _check_range("inclination", self.inclination_rad, -0.35, 0.35, "rad", "1:40 is 0.025 rad")
        _check_range("roll", self.roll_rad, -0.1, 0.1, "rad", "wheelsets roll by some mrad")
        _check_range("yaw", self.yaw_rad, -0.1, 0.1, "rad", "wheelsets yaw by some mrad, or some tens in sharp curves")
        _check_range(
            "refinement limit", self.refine_degrees_of_freedom, 0, 1e9, "degrees of freedom", "0 never refines"
        )
        if self.load_kind not in ("vertical", "normal"):
            raise InputError(f"load kind {self.load_kind!r}: allowed are vertical and normal")
        if self.solver not in ("auto", "pardiso", "amg"):
            raise InputError(f"solver {self.solver!r}: allowed are auto, pardiso and amg")
        for name, value in vars(self.size).items():
            check_positive(name.removesuffix("_mm").replace("_", " "), value, "mm", "bodies are usually cut at 60 mm")
        if isinstance(self.resolution, str):
            if self.resolution not in RESOLUTIONS:
                raise InputError(
                    f"resolution {self.resolution!r}: allowed are {', '.join(RESOLUTIONS)}, or two element sizes in mm"
                )
        else:
            for size in self.resolution:
                check_positive("element size", size, "mm", "a tenth of the patch's semi-axis is a good size")

    @property
    def half(self) -> bool:
        """Whether x = 0 is a plane of symmetry."""
        return self.yaw_rad == 0.0


def _check_range(name: str, value: float, low: float, high: float, unit: str, remedy: str) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        raise InputError(
            f"{name} is {value!r} {unit}; allowed: {low:g} to {high:g} {unit}" + (f"; {remedy}" if remedy else "")
        )
