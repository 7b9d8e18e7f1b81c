"""Answer of the demo in words: holding and failing positions, causes, remedies, and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import has_numbers, is_usable_status
from fecontact.judging.verdict import find_cheapest_theory, list_theory_answers
from fecontact.maps.model import ApplicabilityMap, LoadInterval, MapCell, MapPosition
from fecontact.maps.sentences import capitalise, join_words
from fecontact.maps.verdict_views import CAUSES
from fecontact.outputs.paraview.vtk import COLLECTION
from fecontact.outputs.records.cheapest import judgements_by_theory
from fecontact.outputs.records.results import Row
from fecontact.runs.demo import RADIUS_MM, SPHERE_CASE, DemoOutcome, compute_exact_peak_MPa
from fecontact.runs.store import name_case_folder


def write_answer_sentences(map_: ApplicabilityMap) -> list[str]:
    """Describe the positions at which Hertz holds and fails, with the causes.

    Parameters
    ----------
    map_
        Map of the demo.

    Returns
    -------
    list of str
        Sentences; the last sentences name the unresolved cells and the cells without a usable result.
    """
    cells = map_.cells
    lost_cells = [cell for cell in cells if not cell.usable]
    if len(lost_cells) == len(cells):
        return [f"No answer: {_count_lost_cells(lost_cells)}."]
    unresolved_cells = [cell for cell in cells if cell.usable and cell.verdict == "UNRESOLVED"]
    is_known = not (lost_cells or unresolved_cells)
    sentences = [
        f"{_describe_load_range(map_.loads_N)}, {_describe_holding(map_, is_known=is_known)}.",
        f"It {_describe_failing(map_, is_known=is_known)}.",
    ]
    if unresolved_cells:
        sentences.append(f"The verdict is unresolved at {_list_cells(unresolved_cells)}.")
    if lost_cells:
        sentences.append(f"{capitalise(_count_lost_cells(lost_cells))}.")
    return sentences


def _describe_holding(map_: ApplicabilityMap, *, is_known: bool) -> str:
    """Shifts and loads at which Hertz holds, as a main clause."""
    where = [
        f"at {_format_shift(position.lateral_shift_mm)} {loads}".strip()
        for position in map_.positions
        if (loads := _describe_loads(position, "HOLDS", map_.loads_N)) is not None
    ]
    if where:
        return f"Hertz holds {join_words(where)}"
    return f"Hertz {'does not hold' if is_known else 'is not known to hold'} at any shift or load of this map"


def _describe_failing(map_: ApplicabilityMap, *, is_known: bool) -> str:
    """Shifts and loads at which Hertz fails, with causes, as a part of a sentence."""
    by_cause: dict[str, list[str]] = {}
    for position in map_.positions:
        if (loads := _describe_loads(position, "FAILS", map_.loads_N)) is not None:
            where = f"at {_format_shift(position.lateral_shift_mm)} {loads}".strip()
            by_cause.setdefault(_describe_causes(position), []).append(where)
    if by_cause:
        return "fails " + "; ".join(f"{join_words(where)}, because {cause}" for cause, where in by_cause.items())
    return f"{'does not fail' if is_known else 'is not known to fail'} at any shift or load of this map"


def _describe_loads(position: MapPosition, answer: str, loads_N: Sequence[float]) -> str | None:
    """Loads of a position with a given verdict in words.

    The text is empty if the map has a single load. None without such a load.
    """
    stretches = [interval for interval in position.limit.intervals if interval.answer == answer]
    return join_words([_describe_interval(interval, loads_N) for interval in stretches]) if stretches else None


def _describe_interval(interval: LoadInterval, loads_N: Sequence[float]) -> str:
    """Interval of loads in words, such as "up to 50 kN".

    `loads_N` are the loads of the map. An interval over all of them is "at all loads", or empty for a single load.
    """
    low_N, high_N = interval.low_N, interval.high_N
    is_from_start, is_to_end = low_N <= min(loads_N), high_N >= max(loads_N)
    if is_from_start and is_to_end:
        return "at all loads" if len(loads_N) > 1 else ""
    # a load that the search tried has an accuracy of 2 %
    low, high = (_format_load(load_N) if load_N in loads_N else f"{load_N / 1e3:.3g} kN" for load_N in (low_N, high_N))
    if low_N == high_N:
        return f"at {low}"
    if is_from_start:
        return f"up to {high}"
    return f"from {low}" + ("" if is_to_end else f" to {high}")


def _describe_causes(position: MapPosition) -> str:
    """Causes at all loads at which Hertz fails, by increasing load."""
    loads = sorted((load for load in position.solved if load.usable), key=lambda load: load.load_N)
    causes = dict.fromkeys(load.verdict.cause for load in loads if load.verdict.answer == "FAILS")
    return join_words([CAUSES[cause][1] if cause else "of an unknown cause" for cause in causes])


def write_remedy_sentences(map_: ApplicabilityMap) -> list[str]:
    """Name the cheapest theory inside its range that holds at the cells where Hertz fails.

    Parameters
    ----------
    map_
        Map of the demo.

    Returns
    -------
    list of str
        Sentences; the last sentences name the cells without such a theory.
    """
    cells_by_theory: dict[str, list[MapCell]] = {}
    for cell in map_.cells:
        if cell.usable and cell.verdict == "FAILS":
            remedy = find_cheapest_theory(list_theory_answers(judgements_by_theory(cell.usable)), in_range=True)
            cells_by_theory.setdefault(remedy.label, []).append(cell)
    parts = [
        f"{_close_with_comma(theory.in_sentence)} at {_list_cells(cells_by_theory[name])}"
        for name, theory in THEORIES.items()
        if name in cells_by_theory
    ]
    sentences = []
    if parts:
        sentences.append(f"The cheapest theory that holds there, inside its range, is {'; '.join(parts)}.")
    if "UNRESOLVED" in cells_by_theory:
        where = _list_cells(cells_by_theory["UNRESOLVED"])
        sentences.append(f"It is unresolved whether a theory inside its range holds at {where}.")
    if "none" in cells_by_theory:
        where = _list_cells(cells_by_theory["none"])
        sentences.append(f"Every theory fails, or is outside its range, at {where}: use finite elements there.")
    return sentences


def _close_with_comma(theory: str) -> str:
    """Add a comma to a name that contains a comma."""
    return f"{theory}," if "," in theory else theory


def write_sphere_sentence(row: Row) -> str:
    """Compare the peak pressure of the finite elements with the closed form, for the sphere.

    Parameters
    ----------
    row
        Row of the sphere.

    Returns
    -------
    str
        Sentence with both pressures in MPa and the deviation in %.
    """
    where = f"Sphere of radius {RADIUS_MM:g} mm on a plane, {_format_load(SPHERE_CASE.load_N)}, where Hertz is exact"
    if not is_usable_status(row):
        return f"{where}: {row['status']}"
    exact_MPa, found_MPa = compute_exact_peak_MPa(), float(str(row["fe_p_max_MPa"]))
    return (
        f"{where}: peak pressure {found_MPa:.1f} MPa by finite elements, {exact_MPa:.1f} MPa in closed form,"
        f" deviation {1e2 * (found_MPa / exact_MPa - 1.0):+.2f} %."
    )


def list_files(out: Path, outcome: DemoOutcome) -> Iterator[str]:
    """Yield the files of the demo for the user, a file per line.

    Parameters
    ----------
    out
        Folder of the demo.
    outcome
        Results of the demo.

    Yields
    ------
    str
        Lines.
    """
    yield f"Map:      {out / 'map.png'}"
    yield f"Report:   {out / 'report.html'}"
    if outcome.shown is not None and has_numbers(outcome.shown):
        yield f"ParaView: {name_case_folder(out, str(outcome.shown['id'])) / COLLECTION}"
    yield f"Table:    {out / 'map.csv'}"


def _list_cells(cells: Sequence[MapCell]) -> str:
    """Cells in words: each shift with its loads."""
    loads: dict[float, list[str]] = {}
    for cell in cells:
        loads.setdefault(cell.lateral_shift_mm, []).append(_format_load(cell.load_N))
    return join_words(
        [f"{_format_shift(shift_mm)} ({', '.join(load_texts)})" for shift_mm, load_texts in loads.items()]
    )


def _count_lost_cells(cells: Sequence[MapCell]) -> str:
    return f"{len(cells)} cell{'s have' if len(cells) > 1 else ' has'} no usable result, at {_list_cells(cells)}"


def _describe_load_range(loads_N: Sequence[float]) -> str:
    low_N, high_N = min(loads_N), max(loads_N)
    return (
        f"At {_format_load(low_N)}" if low_N == high_N else f"Between {_format_load(low_N)} and {_format_load(high_N)}"
    )


def _format_shift(shift_mm: float) -> str:
    return f"{shift_mm:zg} mm"


def _format_load(load_N: float) -> str:
    return f"{load_N / 1e3:g} kN"
