"""The answer of a map in sentences: where a theory holds at all loads, up to which load elsewhere, and why."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, groupby, pairwise

from fecontact.contact_theories.registry import THEORIES
from fecontact.maps.model import ApplicabilityMap, MapPosition
from fecontact.maps.verdict_views import CAUSES
from fecontact.maps.view import CLOSE_MM, ColumnView, MapView
from fecontact.outputs.style import BETWEEN


def verdict_sentences(made: ApplicabilityMap, view: MapView, name: str, *, why: bool) -> list[str]:
    """Where a theory holds at all loads, up to which load elsewhere, and where it fails.

    Parameters
    ----------
    view
        The map of its verdicts.
    name
        What it is called; after its first sentence it is "it".
    why
        Whether the causes explain this theory.
    """
    shifts = [column.shift_mm for column in view.columns]
    groups: dict[tuple[int, str], list[int]] = {}
    for at, (position, column) in enumerate(zip(made.positions, view.columns, strict=True)):
        groups.setdefault(_phrase(column, view, _because(position) if why else ""), []).append(at)
    said: list[str] = []
    for (rank, phrase), chosen in sorted(groups.items(), key=lambda one: one[0][0]):
        where = f"at {join_words([f'{shifts[at]:g}' for at in chosen])} mm" if rank == _UP_TO else _runs(shifts, chosen)
        ends = join_words([f"{view.columns[at].bands[0][1]:.3g}" for at in chosen]) if rank == _UP_TO else ""
        told = phrase.replace("{ends}", ends).replace("{it}", "it" if said else name)
        said.append(f"{capitalise(f'{where} {told}')}.")
    return said + _counted(view)


_ALL, _UP_TO, _NO, _MIXED, _NOTHING = range(5)


def _phrase(column: ColumnView, view: MapView, because: str) -> tuple[int, str]:
    """What is said of a shift, and the rank of that."""
    answers = [answer for _, _, answer in column.bands if answer != BETWEEN]
    if not answers:
        return _NOTHING, "there is no result"
    begins = column.bands[0][0] <= min(view.loads_N) / 1e3
    whole = begins and column.bands[-1][1] >= max(view.loads_N) / 1e3
    if whole and set(answers) == {"HOLDS"}:
        return _ALL, f"{{it}} holds at all loads ({_load_range(view.loads_N)})"
    if whole and set(answers) == {"FAILS"}:
        return _NO, f"{{it}} fails at all loads{because}"
    if begins and answers[0] == "HOLDS" and "HOLDS" not in answers[1:] and len(answers) > 1:
        return _UP_TO, f"{{it}} holds up to {{ends}} kN{because}"
    return _MIXED, f"{{it}} {_spoken(column.limit)}"


def theory_sentences(view: MapView) -> list[str]:
    """Which theory of the pressure is the cheapest that holds, and where, from the map of it."""
    found: list[str] = []
    for name, theory in THEORIES.items():
        if where := _where(view, name):
            out = _where(view, name, out_of_range=True)
            begin = "It" if found else capitalise(view.title)
            found.append(f"{begin} is {theory.in_sentence} {where}{out and f', out of its range {out}'}.")
    if where := _where(view, "FAILS"):
        found.append(f"None holds {where}.")
    return found + _counted(view)


def _where(view: MapView, name: str, *, out_of_range: bool = False) -> str:
    """Shifts and loads at which this is the answer, or is so out of its range; shifts with the same loads together."""
    shifts = [column.shift_mm for column in view.columns]
    at_loads = {
        number: tuple(
            load_N
            for load_N, cell in zip(view.loads_N, column.cells, strict=True)
            if cell.answer == name and cell.out_of_range >= out_of_range
        )
        for number, column in enumerate(view.columns)
    }
    parts = []
    for loads in sorted({loads for loads in at_loads.values() if loads}, key=lambda loads: (-len(loads), loads)):
        places = _runs(shifts, [number for number, own in at_loads.items() if own == loads])
        where = "at all loads" if loads == view.loads_N else _load_list(view.loads_N, loads)
        parts.append(f"{places} {where}")
    return "; ".join(parts)


def _spoken(limit: str) -> str:
    """Load limits as a table has them, with the verbs of a sentence."""
    told, unit, note = limit.partition(" kN")
    parts = [f"is {one}" if one.startswith(("open", "not solved")) else one for one in told.split(", ")]
    return f"{', '.join(parts)}{unit}{note}"


def _because(position: MapPosition) -> str:
    """Why Hertz fails at the smallest load at which it does; empty where it nowhere does, or nobody knows."""
    loads = [*position.tried, *(cell.judged for cell in position.cells if cell.judged is not None)]
    failing = [one for one in loads if one.usable and one.verdict.answer == "FAILS"]
    cause = min(failing, key=lambda one: one.load_N).verdict.cause if failing else None
    return f", where {CAUSES[cause][1]}" if cause else ""


def _counted(view: MapView) -> list[str]:
    """How many cells are open or lost; nothing where none is."""
    found = [cell.answer for column in view.columns for cell in column.cells]
    counts = ((found.count("UNRESOLVED"), "open"), (found.count("failed"), "without a result"))
    said = [f"{count} {'is' if count == 1 else 'are'} {words}" for count, words in counts if count]
    return [f"Of {len(found)} cells {' and '.join(said)}."] if said else []


def _runs(shifts_mm: Sequence[float], chosen: Sequence[int]) -> str:
    """Shifts in words, three close neighbours and more as a range."""
    parts: list[str] = []
    single: list[str] = []
    # a gap in the picture is a gap in the sentence
    steps = (1 if after - before <= CLOSE_MM else 2 for before, after in pairwise(shifts_mm))
    places = list(accumulate(steps, initial=0))
    for _, group in groupby(enumerate(chosen), key=lambda pair: places[pair[1]] - pair[0]):
        numbers = [shifts_mm[at] for _, at in group]
        if len(numbers) > 2:
            parts.append(f"from {numbers[0]:g} to {numbers[-1]:g}")
        else:
            single += [f"{number:g}" for number in numbers]
    if single:
        parts.append(f"at {join_words(single)}")
    return f"{join_words(parts)} mm"


def _load_range(loads_N: Sequence[float]) -> str:
    low, high = (f"{load_N / 1e3:g}" for load_N in (min(loads_N), max(loads_N)))
    return f"{low} kN" if low == high else f"{low} to {high} kN"


def _load_list(every_N: Sequence[float], some_N: Sequence[float]) -> str:
    first = every_N.index(some_N[0])
    if len(some_N) > 2 and tuple(every_N[first : first + len(some_N)]) == tuple(some_N):
        return f"from {_load_range(some_N)}"
    return f"at {join_words([f'{load_N / 1e3:g}' for load_N in some_N])} kN"


def join_words(texts: Sequence[str]) -> str:
    """An enumeration of at least one text."""
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}"


def capitalise(text: str) -> str:
    """The text with a capital letter at its beginning; the rest stays."""
    return text[:1].upper() + text[1:]
