"""A fleet as a file: which wheels and rails, which pairs of them, which shifts and loads, and how they are screened."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from statistics import NormalDist
from typing import Any, Literal

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.features.fleet.tables import rows_of, weight_of
from fecontact.files import toml_content
from fecontact.inputs.kinds import as_number, choice, custom, number
from fecontact.inputs.slots import inputs, read_table
from fecontact.runs.toml_cases import case_of

Screen = Literal["strip", "half_space"]
Position = tuple[float, float]
"""Lateral shift (mm) and wheel load (kN)."""
_MOST_POINTS, _MOST_POSITIONS = 1000, 10_000
_GIVEN_ELSEWHERE = ("rail", "wheel", "lateral_shift_mm", "load_kN")


def _is_numbers(value: Any) -> bool:
    return isinstance(value, Sequence) and bool(value) and None not in map(as_number, value)


def _numbers(help: str, words: str) -> Any:
    return custom(None, help, domain="numbers", words=words, holds=_is_numbers)


def _is_sources(value: Any) -> bool:
    names = [value] if isinstance(value, str) else value
    return isinstance(names, list | tuple) and bool(names) and all(isinstance(one, str) and one for one in names)


def _table(help: str) -> Any:
    return custom(
        None,
        help,
        domain="file",
        words="the path of a table",
        holds=lambda one: isinstance(one, str) and bool(one),
    )


@inputs
class Sources:
    """The wheels, or the rails, of a fleet."""

    files: Any = custom(
        None,
        "Folder, glob, name of the library, or table (.csv, .parquet) with a column file and what is known of each",
        domain="a text, or a list of texts",
        words='a text such as "wheels/*.csv", or a list of texts',
        holds=_is_sources,
    )

    @property
    def texts(self) -> tuple[str, ...]:
        """What was given, one after the other."""
        return (self.files,) if isinstance(self.files, str) else tuple(self.files or ())


@inputs
class Pairing:
    """Which wheels meet which rails: all of them each other, if nothing is given."""

    draw: float | None = number(
        None, "Pairs drawn at random by the weights of wheels and rails", low=0.5, high=1e6, remedy="give 1 to 1000000"
    )
    table: str | None = _table("Table (.csv, .parquet) with columns wheel and rail, and weight if pairs differ in it")

    def __post_init__(self) -> None:
        if self.draw is not None and self.table is not None:
            raise InputError("draw and table are both given; allowed: one of them; leave one out")


@inputs
class Distribution:
    """Values with weights: listed, or the middles of equally likely parts of a distribution."""

    values: Any = _numbers("Values", "a list of numbers")
    weights: Any = _numbers("Weight of each value; equal ones if not given", "a list of numbers")
    normal: Any = _numbers("Mean and standard deviation", "two numbers: mean and standard deviation")
    uniform: Any = _numbers("Smallest and largest value", "two numbers: smallest and largest value")
    count: float = number(
        10.0, "How many values stand for a distribution", low=1.0, high=_MOST_POINTS, remedy="5 to 20"
    )

    def __post_init__(self) -> None:
        given = [name for name in ("values", "normal", "uniform") if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError(f"{' and '.join(given) or 'nothing'} given; allowed: one of values, normal, uniform")
        if self.values is None and len(getattr(self, given[0])) != 2:
            raise InputError(f"{given[0]} has {len(getattr(self, given[0]))} numbers; allowed: 2")
        if self.weights is not None and len(self.weights) != len(self.values or ()):
            raise InputError(
                f"{len(self.weights)} weights for {len(self.values or ())} values; give one for each value"
            )

    @property
    def points(self) -> dict[float, float]:
        """Weight of each value, increasing; the weights sum to 1."""
        if self.values is not None:
            return shares(
                zip(map(float, self.values), self.weights or [1.0] * len(self.values), strict=True), "weights"
            )
        count = int(self.count)
        middles = [(k + 0.5) / count for k in range(count)]
        if self.uniform is not None:
            low, high = self.uniform
            return shares(((low + part * (high - low), 1.0) for part in middles), "weights")
        mean, deviation = self.normal
        if not deviation > 0.0:
            raise InputError(f"standard deviation is {deviation:g}; allowed: > 0; a single value stands in values")
        return shares(((NormalDist(mean, deviation).inv_cdf(part), 1.0) for part in middles), "weights")


@inputs
class Positions:
    """Shifts and loads that go together, in place of `Distribution` of each."""

    table: str | None = _table(
        "Table (.csv, .parquet) with columns shift_mm and load_kN, and weight if positions differ in it"
    )


def shares(weighted: Any, what: str) -> dict[Any, float]:
    """Weight of each key over the sum of all, keys increasing; of equal keys the sum.

    Raises
    ------
    InputError
        If a weight is negative or none, or all are zero.
    """
    found: dict[Any, float] = {}
    for key, weight in weighted:
        if not (math.isfinite(weight) and weight >= 0.0):
            raise InputError(f"{what}: the weight of {key} is {weight}; allowed: finite and >= 0; mend or leave it out")
        found[key] = found.get(key, 0.0) + weight
    total = math.fsum(found.values())
    if not total > 0.0:
        raise InputError(f"{what}: they sum to {total:g}; allowed: > 0; give at least one weight above zero")
    return {key: found[key] / total for key in sorted(found)}


@inputs
class _Asked:
    """What stands in no table of the file."""

    seed: float = number(1.0, "Seed of what is drawn", low=0.0, high=2**53, remedy="any whole number")
    theory: Screen = choice("strip", "Theory by which every position is screened", ("strip", "half_space"))
    filters_mm: Any = custom(
        (4.0, 8.0),
        "Wave lengths over which measured points are smoothed: a line each",
        domain="numbers",
        words="two or more lengths in mm such as [4, 8]",
        holds=lambda value: _is_numbers(value) and len(value) > 1 and all(0.0 < one <= 1000.0 for one in value),
    )


@dataclass(frozen=True, kw_only=True)
class Fleet:
    """A fleet as it was asked for.

    Attributes
    ----------
    folder
        Folder that the paths of its file are relative to.
    case
        Everything but profiles, shift and load.
    positions
        Weight of each shift (mm) with a load (kN); they sum to 1.
    """

    folder: Path
    wheels: tuple[str, ...]
    rails: tuple[str, ...]
    pairing: Pairing
    positions: Mapping[Position, float]
    case: Case
    theory: Screen
    filters_mm: tuple[float, ...]
    seed: int

    @property
    def shifts_mm(self) -> tuple[float, ...]:
        """All shifts, increasing."""
        return tuple(dict.fromkeys(shift for shift, _ in self.positions))


def read_fleet(path: Path, folder: Path | None = None) -> Fleet:
    """Read the file of a fleet; its paths are relative to its own folder if no other one is given.

    Raises
    ------
    InputError
        If it cannot be read, or for the first key or value that is not allowed.
    """
    try:
        content = toml_content(path.read_text("utf-8"), f"fleet {path}")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"fleet {path}: it cannot be read ({error})") from error
    try:
        return _fleet(content, folder or path.absolute().parent)
    except InputError as error:
        raise InputError(f"fleet {path}: {error}") from error


def _fleet(content: dict[str, Any], folder: Path) -> Fleet:
    tables = {
        "wheels": Sources,
        "rails": Sources,
        "pairs": Pairing,
        "shifts_mm": Distribution,
        "loads_kN": Distribution,
        "positions": Positions,
    }
    top = {one.name for one in fields(_Asked)}
    for key in content.keys() - {*tables, *top, "case"}:
        raise InputError(
            f"{key}: there is no such key; keys: {', '.join(sorted(top))}; tables: {', '.join(tables)}, case"
        )
    asked = read_table(_Asked, "fleet", {key: value for key, value in content.items() if key in top})
    separate = {name for name, kind in tables.items() if kind is Distribution}
    if "positions" in content and (both := sorted(separate & content.keys())):
        raise InputError(f"[positions] and [{both[0]}] are both given; allowed: one of them; leave one out")
    left_out = separate if "positions" in content else {"positions"}
    read: dict[str, Any] = {
        name: read_table(kind, name, content.get(name, {} if kind is Pairing else None))
        for name, kind in tables.items()
        if name not in left_out
    }
    for name in ("wheels", "rails"):
        if not read[name].texts:
            raise InputError(f"[{name}]: files is missing; give a folder, a glob or a table")
    inner = content.get("case", {})
    if not isinstance(inner, dict) or (told := [key for key in _GIVEN_ELSEWHERE if key in inner]):
        named = f"{', '.join(told)} stand" if isinstance(inner, dict) else "it is no table, or stands"
        raise InputError(f"[case]: {named} in tables of their own: [wheels], [rails], [shifts_mm], [loads_kN]")
    case = case_of(inner)
    if case.irregularities:
        raise InputError("[case]: it has an irregularity along the track; allowed: smooth bodies; leave it out")
    if case.roll == "loaded" and case.roll_load_N is None:
        raise InputError(
            "[case]: a position has one roll for all loads; say under which load it is found: roll_load_kN"
        )
    return Fleet(
        folder=folder,
        wheels=read["wheels"].texts,
        rails=read["rails"].texts,
        pairing=read["pairs"],
        positions=_positions(read, case, folder),
        case=case,
        theory=asked.theory,
        filters_mm=tuple(sorted(set(map(float, asked.filters_mm)))),
        seed=int(asked.seed),
    )


def _positions(read: Mapping[str, Any], case: Case, folder: Path) -> dict[Position, float]:
    """Weight of each position: of a table, or of every shift with every load."""
    found = _listed(read["positions"], folder) if "positions" in read else _crossed(read)
    # a case refuses what it cannot have; it is asked for each shift and each load, of which there are fewer
    for shift in {shift for shift, _ in found}:
        replace(case, lateral_shift_mm=shift)
    for load in {load for _, load in found}:
        replace(case, load_N=1e3 * load)
    return found


def _crossed(read: Mapping[str, Any]) -> dict[Position, float]:
    points = {}
    for name in ("shifts_mm", "loads_kN"):
        try:
            points[name] = read[name].points.items()
        except InputError as error:
            raise InputError(f"[{name}]: {error}") from error
    of_shifts, of_loads = points.values()
    return {(shift, load): part * share for shift, part in of_shifts for load, share in of_loads}


def _listed(positions: Positions, folder: Path) -> dict[Position, float]:
    if positions.table is None:
        raise InputError("[positions]: table is missing; give a table with columns shift_mm and load_kN")
    path = folder / positions.table
    weighted = []
    for place, row in enumerate(rows_of(path, ("shift_mm", "load_kN"), _MOST_POSITIONS), start=1):
        where = f"table {path}, row {place}"
        shift, load = (as_number(row[name]) for name in ("shift_mm", "load_kN"))
        if shift is None or load is None:
            raise InputError(
                f"{where}: shift_mm is {row['shift_mm']!r} and load_kN {row['load_kN']!r}; allowed: numbers; mend the"
                " row, or take it out"
            )
        weighted.append(((shift, load), weight_of(row, where)))
    return shares(weighted, f"table {path}")
