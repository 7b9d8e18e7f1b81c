"""The answer of a map in sentences: where it holds at all loads, up to which load elsewhere, and why it fails."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from fecontact.comparison.judgement import cheapest, first_standing
from fecontact.comparison.theories import THEORIES
from fecontact.comparison.verdict import AT_JUNCTION
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.outputs.figures.style import BETWEEN
from fecontact.outputs.maps.view import ColumnView, MapView
from fecontact.outputs.records.theories import theories_of_cell

_WHY = {
    "finite bodies": "the finite bodies change the pressure",
    "second patch": "a second patch takes load",
    "second lobe": "the pressure has a second lobe",
    "curvature change within the patch": "the patch reaches a change of curvature",
    "conformity": "the surfaces conform",
    "curvature varies over the patch": "the curvature varies over the patch",
    AT_JUNCTION: "the curvature jumps at the touch point",
}
# What a theory is at a load, beside one that holds.
_OPEN, _NONE, _LOST = "open", "none", "lost"


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
    loads, columns = _load_range(made.loads_N), list(view.columns)
    ends_kN = (min(made.loads_N) / 1e3, max(made.loads_N) / 1e3)
    kinds = [
        (_kind(column, *ends_kN), _cause(position) if why else "")
        for column, position in zip(columns, made.positions, strict=True)
    ]
    said = []
    if chosen := [at for at, (kind, _) in enumerate(kinds) if kind == "all"]:
        said.append(f"{_places(view, chosen)} {{it}} holds at all loads ({loads})")
    for cause in _causes(kinds, "up to"):
        chosen = [at for at, kind in enumerate(kinds) if kind == ("up to", cause)]
        ends = _joined([f"{columns[at].bands[0][1]:.3g}" for at in chosen])
        said.append(f"{_places(view, chosen, runs=False)} {{it}} holds up to {ends} kN{_because(cause)}")
    for cause in _causes(kinds, "no"):
        chosen = [at for at, kind in enumerate(kinds) if kind == ("no", cause)]
        said.append(f"{_places(view, chosen)} {{it}} fails at all loads{_because(cause)}")
    for at, (kind, _) in enumerate(kinds):
        if kind == "mixed":
            said.append(f"at {columns[at].shift_mm:g} mm {{it}} {_spoken(columns[at].limit)}")
    if lost := [at for at, (kind, _) in enumerate(kinds) if kind == "lost"]:
        said.append(f"{_places(view, lost)} there is no result")
    sentences = [f"{_capital(text.format(it=name if first == 0 else 'it'))}." for first, text in enumerate(said)]
    return sentences + _counted(cell.answer for column in columns for cell in column.cells)


def theory_sentences(made: ApplicabilityMap) -> list[str]:
    """Which theory of the pressure is the cheapest that holds, and where."""
    answers = [[_theory_at(cell) for cell in position.cells] for position in made.positions]
    found: list[str] = []
    for name, theory in THEORIES.items():
        if where := _where(made, answers, name):
            found.append(f"{'It' if found else 'The cheapest theory that holds'} is {theory.words} {where}.")
    if where := _where(made, answers, _NONE):
        found.append(f"None holds {where}.")
    return found + _counted(answer for column in answers for answer in column)


def _theory_at(cell: MapCell) -> str:
    judged = theories_of_cell(cell)
    if not judged:
        return _LOST
    return cheapest(judged) or (_NONE if first_standing(judged) is None else _OPEN)


def _where(made: ApplicabilityMap, answers: Sequence[Sequence[str]], name: str) -> str:
    """Shifts and loads at which this is the answer, shifts with the same loads together."""
    shifts = [position.lateral_shift_mm for position in made.positions]
    at_loads = {
        number: tuple(load_N for load_N, answer in zip(made.loads_N, own, strict=True) if answer == name)
        for number, own in enumerate(answers)
    }
    parts = []
    for loads in sorted({loads for loads in at_loads.values() if loads}, key=lambda loads: (-len(loads), loads)):
        places = _runs(shifts, [number for number, own in at_loads.items() if own == loads])
        where = "at all loads" if loads == made.loads_N else _load_list(made.loads_N, loads)
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


def _cause(position: MapPosition) -> str:
    """Why Hertz fails at the smallest load at which it does; empty where it nowhere does, or nobody knows."""
    loads = [*position.tried, *(cell.judged for cell in position.cells if cell.judged is not None)]
    failing = [one for one in loads if one.usable and one.verdict.answer == "FAILS"]
    return min(failing, key=lambda one: one.load_N).verdict.cause or "" if failing else ""


def _causes(kinds: Iterable[tuple[str, str]], wanted: str) -> list[str]:
    return list(dict.fromkeys(cause for kind, cause in kinds if kind == wanted))


def _because(cause: str) -> str:
    return f", where {_WHY.get(cause, cause)}" if cause else ""


def _counted(answers: Iterable[str]) -> list[str]:
    """How many cells are open or lost; nothing where none is."""
    found = list(answers)
    counts = {
        "open": sum(answer in ("UNRESOLVED", _OPEN) for answer in found),
        "without a result": sum(answer in ("failed", _LOST) for answer in found),
    }
    said = [f"{count} {'is' if count == 1 else 'are'} {words}" for words, count in counts.items() if count]
    return [f"Of {len(found)} cells {' and '.join(said)}."] if said else []


def _places(view: MapView, chosen: Sequence[int], *, runs: bool = True) -> str:
    shifts = [column.shift_mm for column in view.columns]
    return _runs(shifts, chosen) if runs else f"at {_joined([f'{shifts[at]:g}' for at in chosen])} mm"


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
