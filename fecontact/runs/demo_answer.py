"""The answer of the demo in words: where Hertz holds, where it fails and why, the remedy, and the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import has_numbers, usable
from fecontact.judging.verdict import cheapest, standings
from fecontact.maps.model import ApplicabilityMap, LoadInterval, MapCell, MapPosition
from fecontact.maps.sentences import capitalise, join_words
from fecontact.maps.verdict_views import CAUSES
from fecontact.outputs.paraview.vtk import COLLECTION
from fecontact.outputs.records.cheapest import theories_of
from fecontact.outputs.records.results import Row
from fecontact.runs.demo import RADIUS_MM, SPHERE, DemoOutcome, exact_peak_MPa
from fecontact.runs.store import case_folder


def answer_sentences(made: ApplicabilityMap) -> list[str]:
    """Where Hertz holds, and where it fails and why; then the unresolved cells and those without a usable result."""
    cells = made.cells
    lost = [cell for cell in cells if not cell.usable]
    if len(lost) == len(cells):
        return [f"There is no answer: {_without_result(lost)}."]
    unresolved = [cell for cell in cells if cell.usable and cell.verdict == "UNRESOLVED"]
    is_known = not (lost or unresolved)
    sentences = [
        f"{_between(made.loads_N)}, {_holding(made, is_known=is_known)}.",
        f"It {_failing(made, is_known=is_known)}.",
    ]
    if unresolved:
        sentences.append(f"The verdict is unresolved at {_cells(unresolved)}.")
    if lost:
        sentences.append(f"{capitalise(_without_result(lost))}.")
    return sentences


def _holding(made: ApplicabilityMap, *, is_known: bool) -> str:
    where = [
        f"at {_shift(position.lateral_shift_mm)} {loads}".strip()
        for position in made.positions
        if (loads := _loads_of(position, "HOLDS", made.loads_N)) is not None
    ]
    if where:
        return f"Hertz holds {join_words(where)}"
    return f"Hertz {'does not hold' if is_known else 'is not known to hold'} at any shift or load of this map"


def _failing(made: ApplicabilityMap, *, is_known: bool) -> str:
    by_cause: dict[str, list[str]] = {}
    for position in made.positions:
        if (loads := _loads_of(position, "FAILS", made.loads_N)) is not None:
            where = f"at {_shift(position.lateral_shift_mm)} {loads}".strip()
            by_cause.setdefault(_causes(position), []).append(where)
    if by_cause:
        return "fails " + "; ".join(f"{join_words(where)}, because {cause}" for cause, where in by_cause.items())
    return f"{'does not fail' if is_known else 'is not known to fail'} at any shift or load of this map"


def _loads_of(position: MapPosition, answer: str, loads_N: Sequence[float]) -> str | None:
    """The loads of a position with one verdict in words, empty for the only load; None without any."""
    stretches = [interval for interval in position.limit.intervals if interval.answer == answer]
    return join_words([_stretch(interval, loads_N) for interval in stretches]) if stretches else None


def _stretch(interval: LoadInterval, loads_N: Sequence[float]) -> str:
    low_N, high_N = interval.low_N, interval.high_N
    begins, ends = low_N <= min(loads_N), high_N >= max(loads_N)
    if begins and ends:
        return "at all loads" if len(loads_N) > 1 else ""
    # a load that the search tried is known to 2 %
    low, high = (_load(load_N) if load_N in loads_N else f"{load_N / 1e3:.3g} kN" for load_N in (low_N, high_N))
    if low_N == high_N:
        return f"at {low}"
    if begins:
        return f"up to {high}"
    return f"from {low}" + ("" if ends else f" to {high}")


def _causes(position: MapPosition) -> str:
    """The causes at all loads at which Hertz fails, by increasing load."""
    loads = sorted((load for load in position.solved if load.usable), key=lambda load: load.load_N)
    causes = dict.fromkeys(load.verdict.cause for load in loads if load.verdict.answer == "FAILS")
    return join_words([CAUSES[cause][1] if cause else "of an unknown cause" for cause in causes])


def remedy_sentences(made: ApplicabilityMap) -> list[str]:
    """The cheapest theory inside its range that holds where Hertz fails, and the cells without such a theory."""
    by_theory: dict[str, list[MapCell]] = {}
    for cell in made.cells:
        if cell.usable and cell.verdict == "FAILS":
            remedy = cheapest(standings(theories_of(cell.usable)), in_range=True)
            by_theory.setdefault(remedy.label, []).append(cell)
    parts = [
        f"{_named(theory.in_sentence)} at {_cells(by_theory[name])}"
        for name, theory in THEORIES.items()
        if name in by_theory
    ]
    sentences = []
    if parts:
        sentences.append(f"The cheapest theory that holds there, inside its range, is {'; '.join(parts)}.")
    if "UNRESOLVED" in by_theory:
        where = _cells(by_theory["UNRESOLVED"])
        sentences.append(f"It is unresolved whether a theory inside its range holds at {where}.")
    if "none" in by_theory:
        where = _cells(by_theory["none"])
        sentences.append(f"Every theory fails, or is outside its range, at {where}: use finite elements there.")
    return sentences


def _named(theory: str) -> str:
    """A name that has a comma ends with a comma too."""
    return f"{theory}," if "," in theory else theory


def sphere_sentence(row: Row) -> str:
    """The peak pressure of the finite elements compared with the closed form, for the sphere."""
    where = f"Sphere of radius {RADIUS_MM:g} mm on a plane, {_load(SPHERE.load_N)}, where Hertz is exact"
    if not usable(row):
        return f"{where}: {row['status']}"
    exact_MPa, found_MPa = exact_peak_MPa(), float(str(row["fe_p_max_MPa"]))
    return (
        f"{where}: peak pressure {found_MPa:.1f} MPa by finite elements, {exact_MPa:.1f} MPa in closed form,"
        f" deviation {1e2 * (found_MPa / exact_MPa - 1.0):+.2f} %."
    )


def file_lines(out: Path, outcome: DemoOutcome) -> Iterator[str]:
    """The files to look at, one per line."""
    yield f"Map:      {out / 'map.png'}"
    yield f"Report:   {out / 'report.html'}"
    if outcome.shown is not None and has_numbers(outcome.shown):
        yield f"ParaView: {case_folder(out, str(outcome.shown['id'])) / COLLECTION}"
    yield f"Table:    {out / 'map.csv'}"


def _cells(cells: Sequence[MapCell]) -> str:
    """Cells in words: each shift with its loads."""
    loads: dict[float, list[str]] = {}
    for cell in cells:
        loads.setdefault(cell.lateral_shift_mm, []).append(_load(cell.load_N))
    return join_words([f"{_shift(shift_mm)} ({', '.join(of_shift)})" for shift_mm, of_shift in loads.items()])


def _without_result(cells: Sequence[MapCell]) -> str:
    return f"{len(cells)} cell{'s have' if len(cells) > 1 else ' has'} no usable result, at {_cells(cells)}"


def _between(loads_N: Sequence[float]) -> str:
    low_N, high_N = min(loads_N), max(loads_N)
    return f"At {_load(low_N)}" if low_N == high_N else f"Between {_load(low_N)} and {_load(high_N)}"


def _shift(shift_mm: float) -> str:
    return f"{shift_mm:zg} mm"


def _load(load_N: float) -> str:
    return f"{load_N / 1e3:g} kN"
