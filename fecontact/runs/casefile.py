"""Studies as files: a Python script with `cases(quick=False)`, or a TOML file of cases."""

from __future__ import annotations

import importlib.util
import math
import re
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fecontact.case import BodySize, Case, Track
from fecontact.errors import InputError
from fecontact.material import Material
from fecontact.regression.checks import Check


@dataclass(frozen=True, kw_only=True)
class Study:
    """The cases of a study and what it makes of their rows when they are solved: a text, and checks of its numbers."""

    name: str
    cases: tuple[Case, ...]
    conclude: Callable[[list[dict[str, Any]], Path], str | None] | None = None
    checks: Callable[[list[dict[str, Any]]], list[Check]] | None = None


def load_study(path: str | Path, *, quick: bool = False) -> Study:
    """Read a study.

    Raises
    ------
    InputError
        If the file does not exist, is neither .py nor .toml, or does not hold cases.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"study {path}: no such file; give a script of studies/ or a TOML file of cases")
    if path.suffix == ".py":
        return _from_script(path, quick)
    if path.suffix == ".toml":
        return Study(name=path.stem, cases=_from_toml(path, quick))
    raise InputError(f"study {path}: the ending {path.suffix or '(none)'} is not known; allowed are .py and .toml")


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


class _MaterialEntry(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    name: str = "steel"
    young_MPa: float = Field(default=210_000.0)
    poisson: float = 0.3
    yield_MPa: float | None = None

    def material(self) -> Material:
        return Material(name=self.name, young_MPa=self.young_MPa, poisson=self.poisson, yield_MPa=self.yield_MPa)


class _TrackEntry(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    gauge_mm: float = 1435.0
    gauge_depth_mm: float = 14.0
    back_to_back_mm: float = 1360.0
    tape_circle_from_back_mm: float = 70.0
    rail_crown_y_mm: float | None = None


class _SizeEntry(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    rail_depth_mm: float = 60.0
    rail_half_length_mm: float = 60.0
    rim_thickness_mm: float = 65.0
    rim_half_length_mm: float = 60.0


class _CaseFile(BaseModel):
    """Layout of a TOML study; lists of shifts, loads and rails are combined with each other."""

    model_config = ConfigDict(extra="forbid", strict=True)
    rail: str | list[str] = "60E1"
    wheel: str | list[str] = "S1002"
    inclination: str = "1:40"
    lateral_shift_mm: float | list[float] = 0.0
    load_kN: float | list[float] = 100.0
    load_kind: Literal["vertical", "normal"] = "vertical"
    roll_mrad: float = 0.0
    yaw_mrad: float = 0.0
    rolling_radius_mm: float = 460.0
    resolution: str | list[float] = "standard"
    solver: Literal["auto", "pardiso", "amg"] = "auto"
    rail_material: _MaterialEntry = _MaterialEntry()
    wheel_material: _MaterialEntry = _MaterialEntry()
    track: _TrackEntry = _TrackEntry()
    size: _SizeEntry = _SizeEntry()

    def cases(self, quick: bool) -> tuple[Case, ...]:
        resolution = self.resolution if isinstance(self.resolution, str) else _two_sizes(self.resolution)
        lists = (_listed(self.rail), _listed(self.wheel), _listed(self.load_kN), _listed(self.lateral_shift_mm))
        return tuple(
            Case(
                rail=rail,
                wheel=wheel,
                inclination_rad=parse_inclination(self.inclination),
                lateral_shift_mm=shift,
                load_N=1e3 * load,
                load_kind=self.load_kind,
                roll_rad=1e-3 * self.roll_mrad,
                yaw_rad=1e-3 * self.yaw_mrad,
                rolling_radius_mm=self.rolling_radius_mm,
                resolution="quick" if quick else resolution,
                solver=self.solver,
                rail_material=self.rail_material.material(),
                wheel_material=self.wheel_material.material(),
                track=Track(**self.track.model_dump()),
                size=BodySize(**self.size.model_dump()),
            )
            for rail, wheel, load, shift in product(*lists)
        )


def _listed(value: Any) -> Sequence[Any]:
    return value if isinstance(value, list) else [value]


def _two_sizes(sizes: list[float]) -> tuple[float, float]:
    if len(sizes) != 2:
        raise InputError(f"resolution {sizes}: give a name or two element sizes in mm, [along x, across]")
    return sizes[0], sizes[1]


def _from_toml(path: Path, quick: bool) -> tuple[Case, ...]:
    try:
        data = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"study {path}: it cannot be read ({error})") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"study {path}: it is not TOML ({error})") from error
    try:
        entry = _CaseFile.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        allowed = ", ".join(_CaseFile.model_fields)
        raise InputError(f"study {path}: {where}: {first['msg']}; keys that exist: {allowed}") from error
    return entry.cases(quick)


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def parse_inclination(text: str) -> float:
    """Rail inclination in rad from `1:40`, `none`, or an angle with its unit such as `25mrad` or `1.43deg`."""
    text = text.strip().lower()
    if text in ("none", "0"):
        return 0.0
    if match := re.fullmatch(rf"1:({_NUMBER})", text):
        ratio = float(match[1])
        if ratio != 0.0:
            return math.atan(1.0 / ratio)
    if match := re.fullmatch(rf"({_NUMBER})\s*(mrad|rad|deg)", text):
        return float(match[1]) * {"mrad": 1e-3, "rad": 1.0, "deg": math.pi / 180.0}[match[2]]
    raise InputError(
        f"inclination {text!r}: allowed are 1:N such as 1:40, none, or an angle with its unit such as 25mrad or 1.43deg"
    )


def parse_resolution(text: str) -> str | tuple[float, float]:
    """A named resolution, or two element sizes in mm from `0.5,0.4`."""
    if "," not in text:
        return text
    try:
        return _two_sizes([float(part) for part in text.split(",")])
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"resolution {text!r}: give a name, or two element sizes in mm such as 0.5,0.4") from error


_MOST_NUMBERS = 1000


def parse_numbers(text: str, name: str) -> tuple[float, ...]:
    """Numbers from a comma list whose items are numbers or ranges a:b:step (both ends included), such as -6:6:0.5,8."""
    found: list[float] = []
    for item in text.split(","):
        if re.fullmatch(rf"{_NUMBER}(:{_NUMBER}:{_NUMBER})?", item.strip()) is None:
            raise InputError(f"{name} {text!r}: {item!r} is neither a number nor a range FROM:TO:STEP such as -6:6:0.5")
        parts = [float(part) for part in item.split(":")]
        found += parts if len(parts) == 1 else _range(parts[0], parts[1], parts[2], f"{name} {text!r}")
    return tuple(dict.fromkeys(found))


def _range(first: float, last: float, step: float, what: str) -> list[float]:
    if not step > 0.0 or last < first:
        raise InputError(f"{what}: a range goes up, with a step above zero, such as -6:6:0.5")
    # a millionth of a step for ends that are no sums of the step in binary
    count = math.floor((last - first) / step + 1e-6) + 1
    if count > _MOST_NUMBERS:
        raise InputError(f"{what}: {count} values; allowed are {_MOST_NUMBERS}; take a larger step")
    return [round(first + step * k, 9) for k in range(count)]
