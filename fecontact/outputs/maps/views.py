"""What a map shows, as a value that one table and one picture draw: verdicts, the cheapest theory, the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, groupby, repeat
from string import ascii_uppercase
from textwrap import wrap
from typing import Any, Literal, TypeAlias

from fecontact.case import Case
from fecontact.comparison.creep import CREEP_LAWS, PLACE, REAL, SHAPE
from fecontact.comparison.judging import JudgedLoad
from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.comparison.verdict import (
    AT_JUNCTION,
    ELEMENTS,
    FORCE,
    NOT_IN_IT,
    PROFILE,
    Judgement,
    Standing,
    cheapest,
    standings,
)
from fecontact.errors import InputError
from fecontact.outputs.alone import check_theory
from fecontact.outputs.records.results import all_ellipses_instead, ellipses_instead, judged_by, theories_of_cell
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, BETWEEN
from fecontact.outputs.words import WORDS, limits_text, other_wheel_label, roll_words
from fecontact.solving.map import (
    FIRST_YIELD,
    PLASTIC_LIMIT,
    ApplicabilityMap,
    LoadInterval,
    LoadLimit,
    MapCell,
    MapPosition,
    stretches,
)

Band = tuple[float, float, str]
"""Smallest and largest load (kN) of a stretch, and its answer."""


@dataclass(frozen=True, kw_only=True)
class CellView:
    """What is shown of a position under one load.

    Attributes
    ----------
    answer
        Key of the view's colours.
    text, letter
        In the picture: with its number, and where there is no room for numbers.
    printed
        In the table; empty where it is the text there too.
    bold
        For what does not hold.
    diamond
        Whether there is a diamond below it.
    out_of_range
        Whether the theory that is the answer is out of its own range.
    """

    load_kN: float
    answer: str
    text: str
    letter: str
    printed: str = ""
    bold: bool = False
    diamond: bool = False
    out_of_range: bool = False


@dataclass(frozen=True, kw_only=True)
class ColumnView:
    """A lateral shift over the loads.

    Attributes
    ----------
    bands
        Smallest and largest load (kN) and answer, by increasing load; none where nothing is known.
    solved_kN
        Loads that were solved; without any there is no border.
    lines
        Loads (kN) at which something begins, and what.
    limit
        At which loads it holds, in words; empty where the map has no limits.
    """

    shift_mm: float
    bands: Sequence[Band]
    solved_kN: tuple[float, ...]
    cells: tuple[CellView, ...]
    limit: str = ""
    lines: Sequence[tuple[float, str]] = ()

    @property
    def further_kN(self) -> tuple[float, ...]:
        """Loads that were solved beside those of the map."""
        return tuple(load for load in self.solved_kN if load not in {cell.load_kN for cell in self.cells})


@dataclass(frozen=True, kw_only=True)
class MapView:
    """A map as it is shown.

    Attributes
    ----------
    title, criterion
        What it shows, and within what.
    colours
        Colour of each answer.
    answers, marks, number
        What the answers that occur, the marks, and the number of a cell stand for, for the legend.
    diamond
        What a diamond stands for; empty where there is none.
    notes
        Lines below the table.
    """

    case: Case
    loads_N: tuple[float, ...]
    columns: tuple[ColumnView, ...]
    title: str
    criterion: str
    colours: Mapping[str, str]
    answers: Sequence[tuple[str, str]]
    marks: Sequence[tuple[str, str]]
    number: str
    notes: Sequence[str]
    diamond: str = ""

    @property
    def lines(self) -> list[str]:
        """What lines across columns stand for, in the order of their dashes."""
        shown = {words for column in self.columns for _, words in column.lines}
        return [words for words in YIELD_WORDS.values() if words in shown]


def part_words(used: float) -> str:
    """A part of a limit in three characters, whatever it is."""
    return f"{used:.{2 if used < 1.0 else 1 if used < 10.0 else 0}f}"


# --- Maps of verdicts: where a theory of the pressure holds, and where Hertz does for creep forces.

CAUSES: Mapping[str, tuple[str, str]] = {
    "finite bodies": ("B", "the finite bodies change the pressure"),
    "second patch": ("S", "a second patch takes load"),
    "second lobe": ("L", "the pressure has a second lobe"),
    "curvature change within the patch": ("J", "the patch reaches a change of curvature"),
    "conformity": ("C", "the surfaces conform"),
    "curvature varies over the patch": ("V", "the curvature varies over the patch"),
    AT_JUNCTION: ("U", "the curvature jumps at the touch point"),
    PROFILE: ("P", PROFILE),
    ELEMENTS: ("E", ELEMENTS),
}
"""Marks of the causes, and what is said of them in a sentence."""
CAUSE_LETTERS = {cause: letter for cause, (letter, _) in CAUSES.items()}
_FORCE_CAUSES = {PLACE: ("P", "centre of pressure beside\nthe touch point"), SHAPE: ("F", SHAPE)}
YIELD_WORDS: Mapping[str, str] = {
    FIRST_YIELD: "first yield of virgin steel",
    PLASTIC_LIMIT: "yielding alone takes up a limit\nat first loading",
}
"""What the lines of a map stand for where a yield stress is given."""
_SIGNS = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
_SIGN_WORDS = "+ holds, x fails, ? unresolved, !"
_LIMIT_WORDS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "open", BETWEEN: "not solved"}
# A change of the verdict that is known to this part of its load needs no words of what lies between.
_KNOWN_WELL = 0.05
_OTHER_HOLDS = "*"
SEPARATE = "separate_load"
"""The measure of load on separate patches."""


def verdict_view(made: ApplicabilityMap, theory: str = HERTZ) -> MapView:
    """Where a theory of the pressure holds, with the largest part of a limit that it uses.

    A letter says why Hertz does not hold, and a diamond that another theory does there. A theory that says nothing of
    its own at a position is Hertz there.
    """
    words, of_hertz = THEORIES[theory].words, theory == HERTZ
    name = words if of_hertz else "it"
    columns = [
        _verdict_column(
            position,
            position.limit if of_hertz else _limit_of(position, theory),
            [_verdict_cell(cell, theory) for cell in position.cells],
        )
        for position in made.positions
    ]
    causes = {cell.cause for cell in made.cells} if of_hertz else set()
    instead = all_ellipses_instead(made) if of_hertz else ""
    measures = [WORDS[measure] for measure in made.case.criteria.limits]
    of_load = any("%" in cell.text for column in columns for cell in column.cells)
    return _verdicts(
        made,
        columns,
        name,
        [(letter, cause) for cause, (letter, _) in CAUSES.items() if cause in causes],
        title=f"where {words} holds",
        criterion=limits_text(made.case.criteria),
        number=f"largest part of a limit\nthat {name} uses; off from 1 on" + "\n%: load on separate patches" * of_load,
        notes=[
            f"{_SIGN_WORDS} could not be solved; peak pressure, {words} against FE in %",
            f"decided by {', '.join(f'{one.letter} {one.short}' for one in measures)}",
            *["where it says nothing of its own it is Hertz"] * (not of_hertz),
            *yield_notes(made),
            *[f"{_OTHER_HOLDS} {instead} holds"] * bool(instead),
        ],
        diamond=f"{instead}, holds" if instead else "",
    )


def _verdicts(
    made: ApplicabilityMap, columns: list[ColumnView], name: str, causes: Sequence[tuple[str, str]], **words: Any
) -> MapView:
    """A map of the verdicts of what has a name, with letters of causes and what they stand for."""
    painted = {answer for column in columns for _, _, answer in column.bands}
    painted |= {"failed" for column in columns if not column.bands}
    unsolved = [] if made.all_solved else [("$!$", "not to be used")]
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=tuple(columns),
        colours=ANSWERS,
        answers=[(answer, said.replace("Hertz", name)) for answer, said in ANSWER_WORDS.items() if answer in painted],
        marks=[*unsolved, *((rf"$\mathbf{{{letter}}}$", cause) for letter, cause in causes)],
        **words,
    )


def yield_notes(made: ApplicabilityMap) -> list[str]:
    """Loads of first yield, with what a first loading does not say; none where no yield stress is given."""
    loads_kN = [loads[FIRST_YIELD] / 1e3 for one in made.positions if FIRST_YIELD in (loads := one.yield_loads_N)]
    return [f"first yield from {min(loads_kN):.3g} kN on; {NOT_IN_IT}"] if loads_kN else []


def force_view(made: ApplicabilityMap) -> MapView:
    """Where Hertz holds for creep forces, with the part of the limit of forces that it uses.

    Load limits are as sharp as the loads that were solved for those of pressure. What was not solved has no forces.
    """
    columns = [
        _verdict_column(one, one.force_limit or one.limit, [_force_cell(cell) for cell in one.cells])
        for one in made.positions
    ]
    causes = {cell.force.verdict.cause for cell in made.cells if cell.force}
    within = force_criterion(made)
    return _verdicts(
        made,
        columns,
        THEORIES[HERTZ].words,
        [mark for cause, mark in _FORCE_CAUSES.items() if cause in causes],
        title="where Hertz holds for creep forces",
        criterion=within,
        number="part of the limit that\nHertz uses; off from 1 on",
        notes=[
            f"{_SIGN_WORDS} no forces: not solved; part of the limit of {within}",
            f"off by {', '.join(f'{letter} {cause}' for cause, (letter, _) in _FORCE_CAUSES.items())}",
        ],
    )


def bands_of(limit: LoadLimit, open_kN: Collection[float]) -> tuple[Band, ...]:
    """Smallest and largest load (kN) and answer of each stretch of loads, of which those of open verdicts are given.

    A stretch without any of them lies between two loads with different verdicts, and nothing was solved there.
    """
    bands = ((one.low_N / 1e3, one.high_N / 1e3, str(one.answer)) for one in limit.intervals)
    return tuple(
        (low, high, answer if answer != "UNRESOLVED" or any(low <= load <= high for load in open_kN) else BETWEEN)
        for low, high, answer in bands
    )


def limit_text(limit: LoadLimit, open_kN: Collection[float]) -> str:
    """At which loads a theory holds, in words; `open_kN` as in `bands_of`."""
    parts = [
        f"{_LIMIT_WORDS[answer]} {low:.4g}" + (f" to {high:.4g}" if high > low else "")
        for low, high, answer in bands_of(limit, open_kN)
        if answer != BETWEEN or high - low > _KNOWN_WELL * high
    ]
    text = f"{', '.join(parts)} kN" if parts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def force_criterion(made: ApplicabilityMap) -> str:
    """Limit, friction and creepages in words."""
    creep = made.case.creep
    assert creep.friction is not None
    surfaces = ", which follow the curved surfaces" if creep.curved else ""
    return (
        f"{1e2 * creep.force_limit:g} % of µN, friction {creep.friction:g}, creepages up to"
        f" {1e2 * creep.largest_creepage:g} %{surfaces}"
    )


def _verdict_column(position: MapPosition, limit: LoadLimit, cells: Sequence[CellView]) -> ColumnView:
    own = (cell.load_N for cell in position.cells if cell.judged is not None)
    open_kN = {cell.load_kN for cell in cells if cell.answer == "UNRESOLVED"}
    open_kN |= {load_N / 1e3 for load_N, answer in limit.tried if answer == "UNRESOLVED"}
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=bands_of(limit, open_kN),
        solved_kN=tuple(load_N / 1e3 for load_N in (*own, *(load_N for load_N, _ in limit.tried))),
        cells=tuple(cells),
        limit=limit_text(limit, open_kN),
        lines=[(load_N / 1e3, YIELD_WORDS[name]) for name, load_N in position.yield_loads_N.items()],
    )


def _limit_of(position: MapPosition, theory: str) -> LoadLimit:
    """At which loads another theory than Hertz holds, from the loads that were solved for the map."""
    told = [(cell, judged_by(cell.judged, theory)) for cell in position.cells if cell.usable]
    known = [(cell.load_N, judged.verdict.answer) for cell, judged in told if judged is not None]
    found = stretches(known, "UNRESOLVED")
    return LoadLimit(
        intervals=tuple(LoadInterval(low_N=low_N, high_N=high_N, answer=answer) for low_N, high_N, answer in found),
        reason=None if known else position.limit.reason or f"no contact by {THEORIES[theory].words}",
        note=position.limit.note,
    )


def _verdict_cell(cell: MapCell, theory: str) -> CellView:
    judged, of_hertz = judged_by(cell.judged, theory), theory == HERTZ
    answer = "failed" if judged is None else judged.verdict.answer
    shown = partial(CellView, load_kN=cell.load_kN, answer=answer, bold=answer == "FAILS")
    if judged is None or not cell.usable:
        # no measure leaves open what did not converge
        return shown(text="!", letter="!", printed=_SIGNS[answer] + " " * 8)
    letter = CAUSE_LETTERS[cell.cause] if of_hertz and cell.cause is not None else ""
    instead = of_hertz and ellipses_instead(cell.judged) is not None
    by = " " if answer == "HOLDS" else WORDS[judged.verdict.measure].letter
    percent = 1e2 * judged.deviation["p_max_MPa"]
    off = f"{percent:+z.1f}" if math.isfinite(percent) else ""
    return shown(
        text=f"{_number(judged)} {letter}".strip(),
        letter=letter,
        printed=_SIGNS[answer] + by + off.rjust(6) + (_OTHER_HOLDS if instead else " "),
        diamond=instead,
    )


def _number(judged: JudgedLoad | Judgement) -> str:
    """The part of a limit that is used; of load on separate patches, whose limit is next to nothing, the load."""
    if judged.verdict.measure != SEPARATE or judged.verdict.answer == "HOLDS":
        return part_words(judged.limit_used)
    return f"{1e2 * judged.deviation[SEPARATE]:.2g}%"


def _force_cell(cell: MapCell) -> CellView:
    force, load_kN = cell.force, cell.load_kN
    if force is None:
        return CellView(load_kN=load_kN, answer="failed", text="!", letter="!")
    answer, letter = force.verdict.answer, _FORCE_CAUSES.get(force.verdict.cause or "", ("", ""))[0]
    part = part_words(force.limit_used)
    return CellView(
        load_kN=load_kN,
        answer=answer,
        text=f"{part} {letter}".strip(),
        letter=letter,
        printed=f"{_SIGNS[answer]}{letter or ' '}{part:>6}",
        bold=answer == "FAILS",
    )


# --- Maps of the cheapest theory that holds: of the laws of creep forces, and of the theories of the pressure.

# Blue where Hertz's ellipse is enough, green for several, orange where the real patch is needed; darker where dearer.
_LAWS = {
    "polach": ("P", "#d3ebf8"),
    "fastsim": ("F", "#8fcbed"),
    "exact": ("E", "#56a5d8"),
    "multi_hertz": ("S", "#66c2a5"),
    "strips": ("T", "#f5b878"),
    "real": ("R", "#d55e00"),
}
# Of theories of the pressure, from the cheapest; a further one has the last.
_PRESSURE_COLOURS = (
    *("#d3ebf8", "#8fcbed", "#56a5d8"),
    *("#d5efd0", "#a5dba2", "#66c2a5", "#2a9d78"),
    *("#f5d2a8", "#f5b878"),
)
_OPEN, _NONE, _LOST = "UNRESOLVED", "FAILS", "failed"
_OUT, _OUT_WORDS = "*", "out of its range"


@dataclass(frozen=True, kw_only=True)
class _Theories:
    """Theories that are shown: their judgements in a cell, and of each its letter and colour, words and number."""

    of: Callable[[MapCell], Mapping[str, Judgement]]
    marks: Mapping[str, tuple[str, str]]
    words: Mapping[str, str]
    number: Callable[[str, Judgement], str]
    lost: str
    in_range: bool = False

    def cheapest(self, cell: MapCell) -> Standing:
        """The cheapest of them in a cell."""
        return cheapest(standings(self.of(cell)), in_range=self.in_range)


def law_view(made: ApplicabilityMap) -> MapView:
    """The cheapest law of creep forces that holds, and by how much of mu N it is off at most."""
    within = force_criterion(made)
    laws = _Theories(
        of=lambda cell: {} if cell.judged is None else cell.judged.creep_laws,
        marks=_LAWS,
        words={name: law.words for name, law in CREEP_LAWS.items()},
        number=lambda name, judged: "" if name == REAL else f"{1e2 * judged.deviation[FORCE]:.1f}",
        lost="no forces: not solved",
    )
    note = f"the cheapest theory of creep forces within {within}, and by how much of µN it is off, %"
    title = "the cheapest theory of creep forces that holds"
    return _view(made, laws, title, within, number="off by at most, % of µN", note=note)


def theory_view(made: ApplicabilityMap) -> MapView:
    """The cheapest theory of the pressure that holds, and the largest part of a limit that it uses."""
    judged = {name for cell in made.cells for name in theories_of_cell(cell)}
    names = [name for name in THEORIES if name in judged]
    colours = chain(_PRESSURE_COLOURS, repeat(_PRESSURE_COLOURS[-1]))
    theories = _Theories(
        of=theories_of_cell,
        marks=dict(zip(names, zip(ascii_uppercase, colours, strict=False), strict=False)),
        words={name: THEORIES[name].words for name in names},
        number=lambda _, judged: part_words(judged.limit_used),
        lost="could not be solved",
        in_range=made.case.criteria.theories_in_range,
    )
    title = "the cheapest theory that holds" + " in its range" * theories.in_range
    note = f"{title}, and the largest part of a limit that it uses"
    number = "largest part of a limit\nthat it uses; off from 1 on"
    return _view(made, theories, title, limits_text(made.case.criteria), number=number, note=note)


def _view(
    made: ApplicabilityMap, theories: _Theories, title: str, criterion: str, *, number: str, note: str
) -> MapView:
    """A stretch between two loads with different answers was not solved; a load whose answer is open is unresolved."""
    columns = tuple(_cheapest_column(position, theories) for position in made.positions)
    given = {cell.answer for column in columns for cell in column.cells}
    painted = given | {answer for column in columns for _, _, answer in column.bands}
    found = [theories.cheapest(cell) for cell in made.cells]
    standing, out_of_range = {one.name for one in found}, any(one.out_of_range for one in found)
    letters = {name: f"{theories.marks[name][0]}  {words}" for name, words in theories.words.items()}
    others = {_NONE: "none holds", _LOST: theories.lost, _OPEN: "unresolved", BETWEEN: ANSWER_WORDS[BETWEEN]}
    marks = {_NONE: ("$x$", "none holds"), _LOST: ("$!$", theories.lost), _OPEN: ("$?$", "open whether it holds")}
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=columns,
        title=title,
        criterion=criterion,
        colours={**ANSWERS, **{name: colour for name, (_, colour) in theories.marks.items()}},
        answers=[
            *((name, words) for name, words in letters.items() if name in standing),
            *((answer, words) for answer, words in others.items() if answer in painted),
        ],
        marks=[mark for answer, mark in marks.items() if answer in given] + [(f"${_OUT}$", _OUT_WORDS)] * out_of_range,
        number=number,
        notes=[
            note,
            ", ".join(f"{theories.marks[name][0]} {words}" for name, words in theories.words.items()),
            f"? open whether it holds{', x none holds' * (_NONE in given)}, ! {theories.lost}"
            + f", {_OUT} {_OUT_WORDS}" * out_of_range,
        ],
    )


def _cheapest_column(position: MapPosition, theories: _Theories) -> ColumnView:
    shown = tuple(_cell(cell, theories) for cell in position.cells)
    known = [(cell.load_kN, cell.answer) for cell in shown if cell.answer != _LOST]
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=stretches(known, BETWEEN),
        solved_kN=tuple(cell.load_kN for cell in position.cells if cell.judged is not None),
        cells=shown,
    )


def _cell(cell: MapCell, theories: _Theories) -> CellView:
    judged, load_kN, found = theories.of(cell), cell.load_kN, theories.cheapest(cell)
    if not found.name:
        text = "x" if judged else "!"
        return CellView(load_kN=load_kN, answer=_NONE if judged else _LOST, text=text, letter=text)
    letter = theories.marks[found.name][0] + "?" * (found.answer == _OPEN) + _OUT * found.out_of_range
    text = f"{letter} {theories.number(found.name, judged[found.name])}".strip()
    return CellView(load_kN=load_kN, answer=found.label, text=text, letter=letter, out_of_range=found.out_of_range)


# --- The answer of a map in sentences: where it holds at all loads, up to which load elsewhere, and why it fails.


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
    counts = ((found.count("UNRESOLVED"), "open"), (found.count("failed"), "without a result"))
    said = [f"{count} {'is' if count == 1 else 'are'} {words}" for count, words in counts if count]
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


# --- A map as text: a line for each position, its load limit, and what the signs stand for.


def map_table(view: MapView, *, width: int | None = None) -> str:
    """A line for each position, with a text of a cell for each load and its load limit, and notes below.

    Where a line is longer than `width`, the limits stand below, and cells are closer; a table that is still too wide
    is cut into tables of fewer loads.
    """
    loads = range(len(view.loads_N))
    lines = _lines(view, loads, 10)
    ends = [f"  {column.limit}" if column.limit else "" for column in view.columns]
    widest = max((len(line) + len(end) for line, end in zip(lines[1:], ends, strict=True)), default=0)
    if width is None or widest <= width:
        lines[1:] = [f"{line}{end}" for line, end in zip(lines[1:], ends, strict=True)]
    else:
        room = max(1, (width - 13) // 9)
        parts = [loads[first : first + room] for first in range(0, len(loads), room)]
        lines = [line for part in parts for line in _lines(view, part, 9)]
        if any(ends):
            lines.append("load limits:")
        for column, end in zip(view.columns, ends, strict=True):
            own = f"{column.shift_mm:+z8.2f}{end}"
            lines += wrap(own, width, subsequent_indent=" " * 10, drop_whitespace=True) if end else []
    every = (*view.notes, _position_text(view.case))
    return "\n".join(lines + [line for note in every for line in (wrap(note, width) if width else [note])])


def _position_text(case: Case) -> str:
    other = other_wheel_label(case)
    same = "; the other wheel at a shift is this one at the opposite shift" if other else ""
    return f"{case.side} wheel, {roll_words(case)}{same}"


def _lines(view: MapView, part: range, width: int) -> list[str]:
    """A line of loads, and a line for each position."""
    head = "shift mm " + "".join(f"{view.loads_N[k] / 1e3:g}".rjust(width) for k in part) + "  kN"
    shown = [[(cell.printed or cell.text).rjust(width) for cell in column.cells] for column in view.columns]
    return [head] + [
        f"{column.shift_mm:+z8.2f} {''.join(cells[k] for k in part)}"
        for column, cells in zip(view.columns, shown, strict=True)
    ]


# --- By what a map is told and drawn: a theory's pressure, Hertz's creep forces, or the cheapest theory.

MapMeasure: TypeAlias = Literal["pressure", "force", "theory"]
"""By the measures of pressure and patch, by Hertz's creep force, or by the cheapest theory that holds."""


def refuse_measure(case: Case, measure: MapMeasure, theory: str = HERTZ) -> None:
    """Refuse forces of a map without friction, and a theory that there is not, or that the measure has no room for.

    Raises
    ------
    InputError
        With what to do.
    """
    if measure == "force" and not case.creep.asked:
        raise InputError(
            f"measure is {measure!r}, but the map has no friction coefficient; give one too, for example --friction 0.3"
            " (fecontact judge FOLDER takes it for a map that was made without, and solves nothing again)"
        )
    check_theory(theory)
    if measure != "pressure" and theory != HERTZ:
        raise InputError(
            f"theory is {theory!r}, but the measure is {measure!r}; leave one of them out: a theory is that of the"
            " measure pressure, and the measure theory has all of them"
        )


def map_view(made: ApplicabilityMap, measure: MapMeasure, theory: str = HERTZ) -> MapView:
    """A map by a measure; by that of pressure for a theory by its name."""
    if measure == "pressure":
        return verdict_view(made, theory)
    return force_view(made) if measure == "force" else theory_view(made)


def map_answer(made: ApplicabilityMap, measure: MapMeasure, theory: str = HERTZ) -> list[str]:
    """The answer of a map by a measure, in sentences."""
    view = map_view(made, measure, theory)
    if measure == "theory":
        return theory_sentences(view)
    name = THEORIES[theory].words if measure == "pressure" else "Hertz's creep force"
    return verdict_sentences(made, view, name, why=measure == "pressure" and theory == HERTZ)


def map_text(made: ApplicabilityMap, measure: MapMeasure, *, theory: str = HERTZ, width: int | None = None) -> str:
    """A map as text, by a measure; by the cheapest theory also that of the laws of forces, where they were judged."""
    text = map_table(map_view(made, measure, theory), width=width)
    if measure != "theory" or not made.laws_judged:
        return text
    return f"{text}\n\n{map_table(law_view(made), width=width)}"
