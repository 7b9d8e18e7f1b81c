"""Maps of a pair at several yaws of the wheelset, as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import Row

_YAW_DECIMALS = 6
"""Decimals (mrad) to which two yaws are different."""


@dataclass(frozen=True, kw_only=True, eq=False)
class YawMap:
    """Maps of a pair at several yaws of the wheelset.

    They have equal lateral shifts and loads.

    Attributes
    ----------
    maps
        Map of each yaw, by increasing yaw; the case of each map has its yaw.
    """

    maps: tuple[ApplicabilityMap, ...]

    def __repr__(self) -> str:
        return f"<YawMap at {join_yaws(self.yaws_mrad)}: {', '.join(map(repr, self.maps))}>"

    def _repr_html_(self) -> str:
        """Table of the verdicts over shift and load for each yaw, for a notebook."""
        return "".join(
            f"<p>Yaw {format_yaw(single_map.yaw_mrad)} mrad</p>{single_map._repr_html_()}" for single_map in self.maps
        )

    def __len__(self) -> int:
        return len(self.cells)

    def __iter__(self) -> Iterator[MapCell]:
        """Cells by yaw, then by position, then by load."""
        return iter(self.cells)

    @property
    def case(self) -> Case:
        """Base case of the maps, without a yaw."""
        return replace(self.maps[0].case, yaw_rad=0.0)

    @property
    def loads_N(self) -> tuple[float, ...]:
        """Loads in N, increasing."""
        return self.maps[0].loads_N

    @property
    def yaws_mrad(self) -> tuple[float, ...]:
        """Yaws of the maps in mrad, increasing."""
        return tuple(single_map.yaw_mrad for single_map in self.maps)

    @property
    def positions(self) -> tuple[MapPosition, ...]:
        """Positions by yaw, then by lateral shift."""
        return tuple(position for single_map in self.maps for position in single_map.positions)

    @property
    def cells(self) -> tuple[MapCell, ...]:
        """Cells by yaw, then by position, then by load."""
        return tuple(cell for single_map in self.maps for cell in single_map.cells)

    @property
    def all_solved(self) -> bool:
        """Whether every cell has a usable result."""
        return all(single_map.all_solved for single_map in self.maps)

    def rows(self) -> list[Row]:
        """Flat row of each cell with its yaw, also of a failed cell.

        Returns
        -------
        list of dict
            Rows by yaw, then by position, then by load.
        """
        return [add_yaw_column(row, single_map.case) for single_map in self.maps for row in single_map.rows()]

    def select_yaw(self, yaw_mrad: float) -> ApplicabilityMap:
        """Map of a stored yaw.

        Parameters
        ----------
        yaw_mrad
            Yaw in mrad.

        Returns
        -------
        ApplicabilityMap
            Map at this yaw.

        Raises
        ------
        InputError
            If there is no map at this yaw. No other yaw takes its place.
        """
        for stored_mrad, single_map in zip(self.yaws_mrad, self.maps, strict=True):
            if round_yaw(stored_mrad) == round_yaw(yaw_mrad):
                return single_map
        raise describe_missing_yaw(yaw_mrad, self.yaws_mrad)


MapResult: TypeAlias = ApplicabilityMap | YawMap
"""Map of a single yaw, or maps of several yaws."""


@dataclass(frozen=True, kw_only=True)
class YawChange:
    """Cell with an answer that changes with the yaw.

    Attributes
    ----------
    lateral_shift_mm, load_N
        Place of the cell.
    answers
        Answer at each yaw (mrad), by increasing yaw.
    """

    lateral_shift_mm: float
    load_N: float
    answers: Mapping[float, str]


AnswersByCell: TypeAlias = Mapping[tuple[float, float], str]
"""Answer by lateral shift (mm) and load (N)."""


def find_yaw_changes(answers_by_yaw: Mapping[float, AnswersByCell]) -> tuple[YawChange, ...]:
    """Find the cells with an answer that changes with the yaw.

    Parameters
    ----------
    answers_by_yaw
        Answers of the cells by yaw in mrad. Cells that are missing at a yaw, as in an unfinished map, are left out.

    Returns
    -------
    tuple of YawChange
        Changes by lateral shift, then by load.

    Examples
    --------
    >>> from fecontact.maps.yaw_map import find_yaw_changes
    >>> changes = find_yaw_changes({0.0: {(2.0, 50e3): "HOLDS"}, 10.0: {(2.0, 50e3): "FAILS"}})
    >>> [(change.lateral_shift_mm, change.answers) for change in changes]
    [(2.0, {0.0: 'HOLDS', 10.0: 'FAILS'})]
    """
    common_cells = set.intersection(*(set(answers) for answers in answers_by_yaw.values()))
    changes = (
        YawChange(
            lateral_shift_mm=shift,
            load_N=load_N,
            answers={yaw_mrad: answers[shift, load_N] for yaw_mrad, answers in answers_by_yaw.items()},
        )
        for shift, load_N in sorted(common_cells)
    )
    return tuple(change for change in changes if len({*change.answers.values()}) > 1)


def choose_reference_yaw(yaws_mrad: Sequence[float]) -> float:
    """Yaw (mrad) with which the other yaws are compared: the smallest, and of two the positive."""
    return min(yaws_mrad, key=lambda yaw_mrad: (abs(yaw_mrad), yaw_mrad < 0.0))


def list_maps(map_result: MapResult) -> tuple[ApplicabilityMap, ...]:
    """Maps of a single yaw each, by increasing yaw."""
    return map_result.maps if isinstance(map_result, YawMap) else (map_result,)


def name_cells(map_result: MapResult) -> dict[str, MapCell]:
    """Cells of a map by their shift, their load and, for several yaws, their yaw.

    Parameters
    ----------
    map_result
        Map, or maps of several yaws.

    Returns
    -------
    dict of MapCell
        Cells by names such as "+2 mm, 50 kN, yaw 5 mrad".
    """

    def name_cell(cell: MapCell, single_map: ApplicabilityMap) -> str:
        yaw_text = f", yaw {format_yaw(single_map.yaw_mrad)} mrad" * isinstance(map_result, YawMap)
        return f"{cell.lateral_shift_mm:+g} mm, {cell.load_N / 1e3:g} kN{yaw_text}"

    return {name_cell(cell, single_map): cell for single_map in list_maps(map_result) for cell in single_map.cells}


def add_yaw_column(row: Record, case: Case) -> Record:
    """Row of a cell with its yaw after its lateral shift.

    Parameters
    ----------
    row
        Row with `lateral_shift_mm`.
    case
        Case with the yaw.

    Returns
    -------
    Record
        The row with `yaw_mrad`.
    """
    return {"lateral_shift_mm": row["lateral_shift_mm"], "yaw_mrad": 1e3 * case.yaw_rad} | row


def round_yaw(yaw_mrad: float) -> float:
    """Yaw in mrad, rounded to the digits in which two yaws of a map differ."""
    return round(yaw_mrad, _YAW_DECIMALS) + 0.0


def format_yaw(yaw_mrad: float) -> str:
    """Yaw in mrad as a text without a unit, which differs for different yaws."""
    return f"{round_yaw(yaw_mrad):.9g}"


def join_yaws(yaws_mrad: Sequence[float]) -> str:
    """Enumeration of yaws, such as "0, 5 and 10 mrad".

    Parameters
    ----------
    yaws_mrad
        Yaws in mrad, at least one.

    Returns
    -------
    str
        Text with the unit.
    """
    *first, last = (format_yaw(yaw_mrad) for yaw_mrad in yaws_mrad)
    return f"{', '.join(first)} and {last} mrad" if first else f"{last} mrad"


def describe_missing_yaw(yaw_mrad: float, stored_mrad: Sequence[float]) -> InputError:
    """Describe a yaw that a map does not have, as an error.

    Parameters
    ----------
    yaw_mrad
        Yaw in mrad.
    stored_mrad
        Yaws of the map in mrad.

    Returns
    -------
    InputError
        Error to raise.
    """
    return InputError(
        f"yaw is {format_yaw(yaw_mrad)} mrad, but the map has {join_yaws(stored_mrad)} and no answer between or beyond"
        " them; give one of these yaws, or make the map with this yaw added to --yaws-mrad"
    )


def require_yaws_rad(case: Case, yaws_mrad: Sequence[float]) -> tuple[float, ...]:
    """Yaws of maps in rad, increasing.

    Parameters
    ----------
    case
        Base case of the maps.
    yaws_mrad
        Yaws in mrad.

    Returns
    -------
    tuple of float
        Yaws in rad, exactly the yaws that a case has from `yaw_mrad`.

    Raises
    ------
    InputError
        If there are no yaws, if a yaw is given twice or is out of range, or if the case has a yaw too.
    """
    if case.yaw_rad != 0.0:
        raise InputError(
            f"yaw is {1e3 * case.yaw_rad:.9g} mrad (--yaw-mrad, yaw_rad), and yaws are given too; give one of them:"
            " a single yaw, or a list of yaws (--yaws-mrad, yaws_mrad)"
        )
    if not yaws_mrad:
        raise InputError("yaws are an empty list; give at least one yaw in mrad, for example 0,5,10")
    rounded_mrad = [round_yaw(yaw_mrad) for yaw_mrad in yaws_mrad]
    repeated_mrad = [yaw_mrad for yaw_mrad in dict.fromkeys(rounded_mrad) if rounded_mrad.count(yaw_mrad) > 1]
    if repeated_mrad:
        raise InputError(
            f"yaws are {', '.join(f'{yaw_mrad:.9g}' for yaw_mrad in yaws_mrad)} mrad, with {join_yaws(repeated_mrad)}"
            " more than once; give each yaw once (they differ from 1e-6 mrad on)"
        )
    # each case refuses a yaw that is out of range or not a number
    # adding 0.0 removes the sign of zero, which would be another case
    return tuple(replace(case, yaw_rad=yaw_mrad / 1e3 + 0.0).yaw_rad for yaw_mrad in sorted(yaws_mrad))
