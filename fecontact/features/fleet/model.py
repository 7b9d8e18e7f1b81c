"""Definition of a fleet in a file: wheels and rails, pairs, shifts and loads, and their screening."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from statistics import NormalDist
from typing import Any, Literal

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.features.fleet.table_columns import POSITION_LAYOUT
from fecontact.files import read_toml
from fecontact.inputs.kinds import choice_field, custom_field, number_field, to_float
from fecontact.inputs.slots import input_dataclass, list_input_places, read_table
from fecontact.inputs.texts import count_text
from fecontact.inputs.user_tables import read_user_table
from fecontact.profiles.library import is_library_name
from fecontact.runs.identity import make_paths_absolute
from fecontact.runs.toml_cases import read_case_table

ScreeningTheory = Literal["strip", "half_space"]
Position = tuple[float, float]
"""Lateral shift (mm) and wheel load (kN)."""
_MOST_VALUES = 1000
_KEYS_OF_TABLES = ("rail", "wheel", "lateral_shift_mm", "load_kN")


def _is_numbers(value: Any) -> bool:
    """Whether a value is a list of numbers that is not empty."""
    return isinstance(value, Sequence) and bool(value) and None not in map(to_float, value)


def _make_numbers_slot(help: str, words: str) -> Any:
    """Input slot for a list of numbers."""
    return custom_field(None, help, domain="numbers", words=words, holds=_is_numbers)


def _is_sources(value: Any) -> bool:
    """Whether a value is a text, or a list of texts."""
    names = [value] if isinstance(value, str) else value
    return isinstance(names, list | tuple) and bool(names) and all(isinstance(name, str) and name for name in names)


def _make_table_slot(help: str) -> Any:
    """Input slot for the path of a table."""
    return custom_field(
        None,
        help,
        domain="file",
        words="the path of a table",
        holds=lambda path: isinstance(path, str) and bool(path),
    )


@input_dataclass
class Sources:
    """The wheels, or the rails, of a fleet."""

    files: Any = custom_field(
        None,
        "Folder, glob, library name, or table (.csv, .parquet) with the column file and columns of your own",
        domain="a text, or a list of texts",
        words='a text such as "wheels/*.csv", or a list of texts',
        holds=_is_sources,
    )

    @property
    def texts(self) -> tuple[str, ...]:
        """Folders, globs, names and tables in their order."""
        return (self.files,) if isinstance(self.files, str) else tuple(self.files or ())


@input_dataclass
class Pairing:
    """Pairs of wheels and rails: each wheel with each rail by default."""

    draw: float | None = number_field(
        None,
        "Number of pairs, drawn by the weights of wheels and rails",
        low=1.0,
        high=1e6,
        whole_only=True,
        remedy="give for example 10000",
    )
    table: str | None = _make_table_slot(
        "Table (.csv, .parquet) with the columns wheel and rail, and weight if the weights differ"
    )

    def __post_init__(self) -> None:
        """Raise InputError if both keys are given."""
        if self.draw is not None and self.table is not None:
            raise InputError("draw and table are both given; allowed: draw or table; leave out draw or table")


@input_dataclass
class Distribution:
    """Values with weights.

    The values are listed, or are the middles of equally likely intervals of a distribution.
    """

    values: Any = _make_numbers_slot("Values", "a list of numbers")
    weights: Any = _make_numbers_slot("Weight of each value; equal weights by default", "a list of numbers")
    normal: Any = _make_numbers_slot("Mean and standard deviation", "two numbers: mean and standard deviation")
    uniform: Any = _make_numbers_slot("Smallest and largest value", "two numbers: smallest and largest value")
    count: float = number_field(
        10.0,
        "Number of equally likely values of a distribution",
        low=1.0,
        high=_MOST_VALUES,
        whole_only=True,
        remedy="give 5 to 20",
    )

    def __post_init__(self) -> None:
        """Raise InputError unless a single distribution is given, with its numbers and weights."""
        present = [name for name in ("values", "normal", "uniform") if getattr(self, name) is not None]
        if len(present) != 1:
            raise InputError(
                f"{' and '.join(present) or 'nothing'} given; allowed: exactly one of values, normal, uniform"
            )
        if self.values is None and len(getattr(self, present[0])) != 2:
            raise InputError(
                f"{present[0]} has {count_text(len(getattr(self, present[0])), 'number')}; allowed: 2;"
                " give mean and standard"
                " deviation (normal), or smallest and largest value (uniform)"
            )
        if self.weights is not None and len(self.weights) != len(self.values or ()):
            raise InputError(
                f"{count_text(len(self.weights), 'weight')} for"
                f" {count_text(len(self.values or ()), 'value')}; give a weight for each value"
            )

    @property
    def points(self) -> dict[float, float]:
        """Weight of each value, increasing; the weights sum to 1.

        Raises
        ------
        InputError
            If a weight or the standard deviation is out of range.
        """
        if self.values is not None:
            return normalise_weights(
                zip(map(float, self.values), self.weights or [1.0] * len(self.values), strict=True), "weights"
            )
        count = int(self.count)
        middles = [(k + 0.5) / count for k in range(count)]
        if self.uniform is not None:
            low, high = self.uniform
            return normalise_weights(((low + middle * (high - low), 1.0) for middle in middles), "weights")
        mean, deviation = self.normal
        if not deviation > 0.0:
            raise InputError(f"standard deviation is {deviation:g}; allowed: > 0; give a single value with values")
        return normalise_weights(((NormalDist(mean, deviation).inv_cdf(middle), 1.0) for middle in middles), "weights")


@input_dataclass
class Positions:
    """Shifts and loads that go together, in place of a `Distribution` of each."""

    table: str | None = _make_table_slot(
        "Table (.csv, .parquet) with the columns shift_mm and load_kN, and weight if the weights differ"
    )


def normalise_weights(weighted: Any, subject: str) -> dict[Any, float]:
    """Weight of each key over the sum of all weights, keys increasing.

    Weights of equal keys are added.

    Parameters
    ----------
    weighted
        Pairs of a key and a weight.
    subject
        Source of the weights, for messages.

    Returns
    -------
    dict
        Weights that sum to 1.

    Raises
    ------
    InputError
        If a weight is negative or not finite, or all weights are zero.

    Examples
    --------
    >>> from fecontact.features.fleet.model import normalise_weights
    >>> normalise_weights([("b", 1.0), ("a", 2.0), ("b", 1.0)], "weights")
    {'a': 0.5, 'b': 0.5}
    """
    weights: dict[Any, float] = {}
    for key, weight in weighted:
        if not (math.isfinite(weight) and weight >= 0.0):
            raise InputError(
                f"{subject}: the weight of {key} is {weight}; allowed: finite and >= 0; correct it or leave it out"
            )
        weights[key] = weights.get(key, 0.0) + weight
    total = math.fsum(weights.values())
    if not total > 0.0:
        raise InputError(
            f"{subject}: the sum of the weights is {total:g}; allowed: > 0; give at least one weight above zero"
        )
    return {key: weights[key] / total for key in sorted(weights)}


@input_dataclass
class FleetSettings:
    """Keys at the top level of the file, outside its tables."""

    seed: float = number_field(
        1.0, "Seed of random draws", low=0.0, high=2**53, whole_only=True, remedy="give for example 1"
    )
    theory: ScreeningTheory = choice_field("strip", "Theory of the screen", ("strip", "half_space"))
    filter_mm: float | None = number_field(
        None,
        "Declared filter length, which alone counts; if not given, every measured profile has the filters of a case",
        label="filter length",
        high=1000.0,
        inclusive=False,
        remedy="4 to 8 mm is usual; leave it out to judge all usual filters",
    )


def refuse_wrong_seed(seed: int) -> None:
    """Refuse a seed outside the range that the file of a fleet allows.

    Parameters
    ----------
    seed
        Seed of random draws.

    Raises
    ------
    InputError
        With the value, the allowed range and the remedy.
    """
    description = next(place.input for place in list_input_places(FleetSettings()) if place.field == "seed")
    description.check(seed)


@dataclass(frozen=True, kw_only=True)
class Fleet:
    """Definition of a fleet.

    Attributes
    ----------
    folder
        Folder that the paths of its file are relative to.
    wheels, rails
        Folders, globs, names and tables of the profiles.
    pairing
        Pairs of wheels and rails.
    positions
        Weight of each shift (mm) with a load (kN); they sum to 1.
    positions_table
        Table of the positions; None for distributions of shifts and loads.
    case
        Everything but profiles, shift and load.
    theory
        Theory of the screening.
    filter_mm
        Declared filter length in mm, which alone counts; None for the filters of a case.
    seed
        Seed of random draws.
    """

    folder: Path
    wheels: tuple[str, ...]
    rails: tuple[str, ...]
    pairing: Pairing
    positions: Mapping[Position, float]
    positions_table: str | None
    case: Case
    theory: ScreeningTheory
    filter_mm: float | None
    seed: int

    @property
    def shifts_mm(self) -> tuple[float, ...]:
        """All shifts, increasing."""
        return tuple(dict.fromkeys(shift for shift, _ in self.positions))


def read_fleet(path: Path, folder: Path | None = None) -> Fleet:
    """Read the file of a fleet.

    Parameters
    ----------
    path
        File (TOML).
    folder
        Folder that the paths in the file are relative to; by default the folder of the file.

    Returns
    -------
    Fleet
        Definition of the fleet.

    Raises
    ------
    InputError
        If the file cannot be read, or for the first key or value that is not allowed.
    """
    content = read_toml(path, f"fleet {path}")
    try:
        return _make_fleet(content, folder or path.absolute().parent)
    except InputError as error:
        raise InputError(f"fleet {path}: {error}") from error


def _make_fleet(content: dict[str, Any], folder: Path) -> Fleet:
    """Fleet from the content of its file; raises InputError for the first key or value that is not allowed."""
    tables = {
        "wheels": Sources,
        "rails": Sources,
        "pairs": Pairing,
        "shifts_mm": Distribution,
        "loads_kN": Distribution,
        "positions": Positions,
    }
    top = {key.name for key in fields(FleetSettings)}
    for key in content.keys() - {*tables, *top, "case"}:
        raise InputError(
            f"{key}: there is no such key; keys: {', '.join(sorted(top))}; tables: {', '.join(tables)}, case"
        )
    values = read_table(FleetSettings, "fleet", {key: value for key, value in content.items() if key in top})
    separate = {name for name, kind in tables.items() if kind is Distribution}
    if "positions" in content and (distributions := sorted(separate & content.keys())):
        raise InputError(
            f"[positions] and [{distributions[0]}] are both given; allowed: [positions], or"
            " [shifts_mm] and [loads_kN]; leave out the others"
        )
    left_out = separate if "positions" in content else {"positions"}
    tables_read: dict[str, Any] = {
        name: read_table(kind, name, content.get(name, {} if kind is Pairing else None))
        for name, kind in tables.items()
        if name not in left_out
    }
    for name in ("wheels", "rails"):
        if not tables_read[name].texts:
            raise InputError(f"[{name}]: files is missing; give a folder, a glob or a table")
    case_table = content.get("case", {})
    if not isinstance(case_table, dict) or (misplaced := [key for key in _KEYS_OF_TABLES if key in case_table]):
        problem = f"{', '.join(misplaced)} not allowed here" if isinstance(case_table, dict) else "not a table"
        raise InputError(
            f"[case]: {problem}; give profiles, shifts and loads in [wheels], [rails], [shifts_mm], [loads_kN]"
        )
    case = make_paths_absolute(read_case_table(_find_opposite_files(case_table, folder)))
    if case.irregularities:
        raise InputError("[case]: an irregularity along the track is given; allowed: smooth bodies; leave it out")
    if case.roll == "loaded" and case.roll_load_N is None:
        raise InputError(
            "[case]: all loads of a position have the same roll; give roll_load_kN, the load that sets the roll"
        )
    return Fleet(
        folder=folder,
        wheels=tables_read["wheels"].texts,
        rails=tables_read["rails"].texts,
        pairing=tables_read["pairs"],
        positions=_weigh_positions(tables_read, case, folder),
        positions_table=tables_read["positions"].table if "positions" in tables_read else None,
        case=case,
        theory=values.theory,
        filter_mm=values.filter_mm,
        seed=int(values.seed),
    )


def _find_opposite_files(case_table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Table of the case with absolute paths of the profiles of the other side.

    The paths in the file are relative to its folder. Profiles of a library of the user are names of its files.
    """
    opposite = case_table.get("opposite")
    if "library" in case_table or not isinstance(opposite, dict):
        return case_table
    paths = {
        body: str(folder / text)
        for body in ("rail", "wheel")
        if isinstance(text := opposite.get(body), str) and text and not is_library_name(text)
    }
    return {**case_table, "opposite": {**opposite, **paths}}


def _weigh_positions(tables_read: Mapping[str, Any], case: Case, folder: Path) -> dict[Position, float]:
    """Weight of each position: from a table, or of each shift with each load."""
    weights = (
        _list_positions(tables_read["positions"], folder)
        if "positions" in tables_read
        else _cross_shifts_and_loads(tables_read)
    )
    # a case refuses values out of range; each shift and each load is checked alone, since there are fewer of these
    # than of positions
    for shift in {shift for shift, _ in weights}:
        replace(case, lateral_shift_mm=shift)
    for load in {load for _, load in weights}:
        replace(case, load_N=1e3 * load)
    return weights


def _cross_shifts_and_loads(tables_read: Mapping[str, Any]) -> dict[Position, float]:
    """Weight of each shift with each load: the product of both weights."""
    points = {}
    for name in ("shifts_mm", "loads_kN"):
        try:
            points[name] = tables_read[name].points.items()
        except InputError as error:
            raise InputError(f"[{name}]: {error}") from error
    shift_points, load_points = points.values()
    return {
        (shift, load): shift_weight * load_weight
        for shift, shift_weight in shift_points
        for load, load_weight in load_points
    }


def _list_positions(positions: Positions, folder: Path) -> dict[Position, float]:
    """Weight of each position of a table.

    The result maps (shift in mm, load in kN) to the weight; the sum of the weights is 1.

    Raises
    ------
    InputError
        If the table is missing, has a value that is not allowed, or has too many rows.
    """
    if positions.table is None:
        raise InputError("[positions]: table is missing; give a table with columns shift_mm and load_kN")
    path = folder / positions.table
    weighted = (
        ((row.values["shift_mm"], row.values["load_kN"]), row.values.get("weight", 1.0))
        for row in read_user_table(path, POSITION_LAYOUT)
    )
    return normalise_weights(weighted, f"table {path}")
