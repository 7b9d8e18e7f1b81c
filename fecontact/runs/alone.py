"""What needs no finite elements: theories alone, contact tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.inputs.texts import listed
from fecontact.jobs.remaining import Progress, watched
from fecontact.outputs.alone import BETWEEN_LINES, map_columns, ordered, table_row
from fecontact.outputs.records.results import hertz_record
from fecontact.outputs.theory_alone import alone_record, check_theory, theories_listed
from fecontact.runs.map_lookup import map_rows
from fecontact.solving.alone import stiffness_at, table_lines, theory_alone
from fecontact.solving.hertz_alone import hertz_alone

Record = dict[str, Any]


def hertz(case: Case) -> Record:
    """Hertz's theory alone at a case's position: `hertz` is what a result is compared with.

    >>> import fecontact
    >>> record = fecontact.hertz(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(record["ellipses"][0]["p_max_MPa"], -1)
    1480.0

    `ellipses` has every touch point, and both sides of a junction, as if each carried the whole load; where the
    surfaces conform there is no ellipse, and `problem` says so.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do.
    """
    return hertz_record(hertz_alone(case))


def theory(case: Case, name: str) -> Record:
    """One theory of the pressure alone at a case's position, such as `strip` or `multi_hertz`; `theories` lists them.

    >>> import fecontact
    >>> found = fecontact.theory(fecontact.Case(lateral_shift_mm=4.0), "strip")
    >>> found["status"], round(found["p_max_MPa"], -1)
    ('solved', 1480.0)

    `status` is `solved` where the theory is in its range; `notes` say why it is not. `solutions` is the number of
    approaches that were found to carry the force, and `problem` why there is no contact.

    Raises
    ------
    InputError
        For a name that there is not; as `place_case` does, and where there is no ellipse for Hertz.
    """
    check_theory(name)
    return alone_record(theory_alone(case, name))


def theories() -> Record:
    """The theories of the pressure that are judged, and laws, such as of creep forces, from the cheapest.

    >>> import fecontact
    >>> list(fecontact.theories()["pressure"])[0]
    'hertz'
    """
    return theories_listed()


# --- Contact tables for vehicle codes: lines over shift and load, with the verdicts of a stored map where it has them.

Line = tuple[float, float]
# Decimals to which shifts (mm) and loads (kN) are the same.
_SAME = 6


def table(
    case: Case,
    lateral_shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    *,
    map_folder: str | Path | None = None,
    progress: Progress | None = None,
) -> list[Record]:
    """A contact table over lateral shift and load, as flat dictionaries with units in their keys; nothing is solved.

    >>> import fecontact
    >>> rows = fecontact.table(fecontact.Case(roll="touching"), [0.0, 4.0], [50e3, 100e3])
    >>> [(row["lateral_shift_mm"], row["load_kN"], row["cheapest_theory"]) for row in rows]
    [(0.0, 50.0, 'strip'), (0.0, 100.0, 'strip'), (4.0, 50.0, 'hertz'), (4.0, 100.0, 'hertz')]

    `strip_approach_between_percent` and `strip_stiffness_between_percent` say by how much straight lines to the
    neighbouring shifts and loads miss the strips in the middle between them.

    Parameters
    ----------
    case
        Everything but lateral shift and load; its criteria say how near a cheap theory must be to the strips.
    lateral_shifts_mm, loads_N
        Of the wheelset, and wheel loads.
    map_folder
        A map that `fecontact map` wrote of the same pair: columns `map_*` have its verdicts at its shifts and loads.
    progress
        As for `run`, with lines in place of cases.

    Raises
    ------
    InputError
        Without shifts and loads, or for a map of another pair. A position that has no contact is a row with its
        `problem`.
    """
    shifts, loads = listed(lateral_shifts_mm, "lateral_shifts_mm"), listed(loads_N, "loads_N")
    if not shifts or not loads:
        raise InputError("table: give at least one lateral shift and one load")
    cells = None if map_folder is None else {_key(row): row for row in map_rows(Path(map_folder), case)}
    rows = []
    lines = table_lines(case, shifts, loads)
    for line in watched(lines, len(shifts) * len(loads), progress, "strips and cheaper theories"):
        row = table_row(line)
        if cells is not None:
            row |= map_columns(cells.get(_key(row)))
        rows.append(row)
    own = {(float(row["lateral_shift_mm"]), float(row["load_kN"])): row for row in rows}
    between = list(_between(shifts, [load_N / 1e3 for load_N in loads]))
    for middle, corners in watched(between, len(between), progress, "strips between lines"):
        _add_between(case, middle, [own[corner] for corner in corners])
    return ordered(rows)


def _between(shifts: Sequence[float], loads_kN: Sequence[float]) -> Iterator[tuple[Line, list[Line]]]:
    """Middles between neighbouring lines, each as shift and load, and the lines around it."""
    axes = [sorted(set(values)) for values in (shifts, loads_kN)]
    cells: list[list[tuple[float, ...]]] = [list(pairwise(values)) or [(values[0],)] for values in axes]
    for of_shift, of_load in product(*cells):
        if len(of_shift) + len(of_load) > 2:
            yield (sum(of_shift) / len(of_shift), sum(of_load) / len(of_load)), list(product(of_shift, of_load))


def _add_between(case: Case, middle: Line, rows: Sequence[Record]) -> None:
    """Into the rows around a middle: what interpolation from them is off there, the largest of all their middles."""
    found = stiffness_at(replace(case, lateral_shift_mm=middle[0], load_N=1e3 * middle[1]))
    if found is None or not all("strip_approach_mm" in row for row in rows):
        return
    for name, value in zip(BETWEEN_LINES, found, strict=True):
        around = [row[name] for row in rows]
        off = 1e2 * abs(sum(around) / len(around) / value - 1.0)
        for row in rows:
            row[BETWEEN_LINES[name]] = max(off, row.get(BETWEEN_LINES[name], 0.0))


def _key(row: Mapping[str, Any]) -> tuple[float, float]:
    return round(float(row["lateral_shift_mm"]), _SAME), round(float(row["load_kN"]), _SAME)
