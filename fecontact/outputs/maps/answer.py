"""The answer of a map in sentences: where it holds at all loads, up to which load elsewhere, and why it fails."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from fecontact.comparison.theories import THEORIES
from fecontact.map.cells import ApplicabilityMap, MapPosition
from fecontact.outputs.figures.style import BETWEEN
from fecontact.outputs.maps.verdicts import CAUSES
from fecontact.outputs.maps.view import ColumnView, MapView


def verdict_sentences(made: ApplicabilityMap, view: MapView, name: str, *, why: bool) -> list[str]:
    """Where a theory holds at all loads, up to which load elsewhere, and where it fails.

    Parameters
    ----------
    view
        The map of its verdicts.
    name
        What it is called; after its first sentence it is "it".
    why
        Whether the causes are those of this theory.
    """
    ends_kN = (min(made.loads_N) / 1e3, max(made.loads_N) / 1e3)
    groups: dict[tuple[str, str], list[int]] = {}
    for at, (position, column) in enumerate(zip(made.positions, view.columns, strict=True)):
        kind = _kind(column, *ends_kN)
        of = _because(position) if why and kind in ("up to", "no") else ""
        if kind == "mixed":
            of = f"at {column.shift_mm:g} mm {{it}} {_spoken(column.limit)}"
        groups.setdefault((kind, of), []).append(at)
    said = [
        _said(kind, of, chosen, view)
        for wanted in ("all", "up to", "no", "mixed", "lost")
        for (kind, of), chosen in groups.items()
        if kind == wanted
    ]
    sentences = [f"{_capital(text.format(it=name if first == 0 else 'it'))}." for first, text in enumerate(said)]
    return sentences + _counted(view)


def _said(kind: str, of: str, chosen: Sequence[int], view: MapView) -> str:
    """What is said of shifts of a kind; `of` is why, or all of it."""
    shifts = [column.shift_mm for column in view.columns]
    if kind == "mixed":
        return of
    if kind == "up to":
        ends = _joined([f"{view.columns[at].bands[0][1]:.3g}" for at in chosen])
        return f"at {_joined([f'{shifts[at]:g}' for at in chosen])} mm {{it}} holds up to {ends} kN{of}"
    all_loads = f"{{it}} holds at all loads ({_load_range(view.loads_N)})"
    what = {"all": all_loads, "no": f"{{it}} fails at all loads{of}", "lost": "there is no result"}
    return f"{_runs(shifts, chosen)} {what[kind]}"


def theory_sentences(view: MapView) -> list[str]:
    """Which theory of the pressure is the cheapest that holds, and where, from the map of it."""
    found: list[str] = []
    for name, theory in THEORIES.items():
        if where := _where(view, name):
            out = _where(view, name, out_of_range=True)
            begin = "It" if found else _capital(view.title)
            found.append(f"{begin} is {theory.words} {where}{out and f', out of its range {out}'}.")
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


def _kind(column: ColumnView, first_kN: float, last_kN: float) -> str:
    """Of a shift between two loads: all, up to, no, mixed, or lost."""
    answers = [answer for _, _, answer in column.bands if answer != BETWEEN]
    if not answers:
        return "lost"
    begins, ends = column.bands[0][0] <= first_kN, column.bands[-1][1] >= last_kN
    if begins and ends and len(set(answers)) == 1:
        return {"HOLDS": "all", "FAILS": "no"}.get(answers[0], "mixed")
    holding = [answer == "HOLDS" for answer in answers]
    return "up to" if begins and holding[0] and not any(holding[1:]) and len(holding) > 1 else "mixed"


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
    counts = {"open": found.count("UNRESOLVED"), "without a result": found.count("failed")}
    said = [f"{count} {'is' if count == 1 else 'are'} {words}" for words, count in counts.items() if count]
    return [f"Of {len(found)} cells {' and '.join(said)}."] if said else []


def _runs(shifts_mm: Sequence[float], chosen: Sequence[int]) -> str:
    """Shifts in words, three neighbours and more as a range."""
    parts: list[str] = []
    single: list[str] = []
    for _, group in groupby(enumerate(chosen), key=lambda pair: pair[1] - pair[0]):
        numbers = [shifts_mm[at] for _, at in group]
        if len(numbers) > 2:
            parts.append(f"from {numbers[0]:g} to {numbers[-1]:g}")
        else:
            single += [f"{number:g}" for number in numbers]
    if single:
        parts.append(f"at {_joined(single)}")
    return f"{_joined(parts)} mm"


def _load_range(loads_N: Sequence[float]) -> str:
    low, high = (f"{load_N / 1e3:g}" for load_N in (min(loads_N), max(loads_N)))
    return f"{low} kN" if low == high else f"{low} to {high} kN"


def _load_list(every_N: Sequence[float], some_N: Sequence[float]) -> str:
    first = every_N.index(some_N[0])
    if len(some_N) > 2 and tuple(every_N[first : first + len(some_N)]) == tuple(some_N):
        return f"from {_load_range(some_N)}"
    return f"at {_joined([f'{load_N / 1e3:g}' for load_N in some_N])} kN"


def _joined(texts: Sequence[str]) -> str:
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
