"""What a map shows, as a value that one table and one picture draw: verdicts, the cheapest theory, the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, chain, groupby, pairwise, repeat
from textwrap import wrap
from typing import Any

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import offered
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import PLASTIC
from fecontact.judging.readings import MappedLaws, MappedVerdicts
from fecontact.judging.verdict import (
    AT_JUNCTION,
    ELEMENTS,
    NOT_IN_IT,
    PROFILE,
    Judgement,
    Standing,
    cheapest,
    standings,
)
from fecontact.maps.load_limits import intervals_of, stretches
from fecontact.maps.model import FIRST_YIELD, PLASTIC_LIMIT, ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.maps.telling import all_ellipses_instead, ellipses_instead, judged_by, laws_of
from fecontact.outputs.case_words import other_wheel_label, roll_words
from fecontact.outputs.records.results import theories_of
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, BETWEEN
from fecontact.outputs.theory_alone import check_theory
from fecontact.outputs.verdict_words import YIELDING
from fecontact.outputs.words import WORDS, limits_text

Band = tuple[float, float, str]
"""Smallest and largest load (kN) of a stretch, and its answer."""
# Columns farther apart than the first (mm) have gaps between them: so much of a step is their width, at most the last.
_CLOSE_MM, _PART_OF_WIDE, _WIDEST_MM = 0.5, 0.7, 1.0


def column_width(shifts_mm: Sequence[float]) -> float:
    """Width of every column, in mm: the smallest step between two, of which wide ones leave gaps; a single one has 1.

    What was solved at a shift says nothing of shifts that are farther away than their neighbours usually are.
    """
    step = min((after - before for before, after in pairwise(shifts_mm)), default=math.inf)
    if not math.isfinite(step):
        return 1.0
    return step if step <= _CLOSE_MM else min(max(_CLOSE_MM, _PART_OF_WIDE * step), _WIDEST_MM)


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
    share
        Part of the lines that measured points allow on which it holds; where it hangs on them.
    """

    load_kN: float
    answer: str
    text: str
    letter: str
    printed: str = ""
    bold: bool = False
    diamond: bool = False
    out_of_range: bool = False
    share: float | None = None


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
        """Loads that were solved beside the map's own."""
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


# --- Maps of verdicts: where a theory of the pressure holds, and where Hertz does by what features judge.

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
    PLASTIC.cause: ("Y", "the bodies yield"),
}
"""Marks of the causes, and what is said of them in a sentence."""
CAUSE_LETTERS = {cause: letter for cause, (letter, _) in CAUSES.items()}
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

    A letter says why Hertz does not hold, and a diamond that another theory does there. Where the
    theory is undefined, Hertz is shown.
    """
    words, of_hertz = THEORIES[theory].in_sentence, theory == HERTZ
    name, instead = (words, all_ellipses_instead(made)) if of_hertz else ("it", "")
    cells = {cell: _verdict_cell(cell, theory) for cell in made.cells}
    of_load = any("%" in cell.text for cell in cells.values())
    return _verdicts(
        made,
        cells,
        lambda position: position.limit if of_hertz else _limit_of(position, theory),
        name,
        {cause: mark for cause, mark in CAUSES.items() if of_hertz},
        title=f"where {words} holds{against(made, of_hertz)}",
        criterion=limits_text(made.case.criteria),
        number=f"share of the error limit\nthat {name} uses; above 1 it does not hold"
        + "\n%: load on separate patches" * of_load,
        notes=[
            f"{_SIGN_WORDS} could not be solved; peak pressure, {words} against FE in %",
            f"decided by {', '.join(f'{WORDS[one].letter} {WORDS[one].short}' for one in made.case.criteria.limits)}",
            *["where the theory is undefined, Hertz is shown"] * (not of_hertz),
            *yield_notes(made),
            *[f"{_OTHER_HOLDS} {instead} holds"] * bool(instead),
        ],
        diamond=f"{instead}, holds" if instead else "",
    )


def offered_view(made: ApplicabilityMap, name: str) -> MapView:
    """Where Hertz holds by the verdict of a feature, with the part of its limit that Hertz uses.

    Load limits are only as sharp as the spacing of the loads that were solved for the pressure's limits.
    """
    of: MappedVerdicts = offered("MAPS")[name]
    within = of.criterion(made.case)
    return _verdicts(
        made,
        {cell: _offered_cell(cell, of) for cell in made.cells},
        lambda position: position.limits_of.get(name, position.limit),
        THEORIES[HERTZ].words,
        of.causes,
        title=of.title,
        criterion=within,
        number="share of the error limit\nthat Hertz uses; above 1 it does not hold",
        notes=[
            f"{_SIGN_WORDS} {of.lost}; part of the limit of {within}",
            f"off by {', '.join(f'{letter} {cause}' for cause, (letter, _) in of.causes.items())}",
        ],
    )


def _verdicts(
    made: ApplicabilityMap,
    cells: Mapping[MapCell, CellView],
    limit_of: Callable[[MapPosition], LoadLimit],
    name: str,
    causes: Mapping[str, tuple[str, str]],
    **words: Any,
) -> MapView:
    """A map of the verdicts of what has a name, with letters of causes and what they stand for."""
    columns = [_column(one, limit_of(one), [cells[cell] for cell in one.cells]) for one in made.positions]
    painted = {answer for column in columns for _, _, answer in column.bands}
    painted |= {"failed" for column in columns if not column.bands}
    letters = {cell.letter for cell in cells.values()}
    of_lines = any(cell.share is not None for cell in cells.values())
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=tuple(columns),
        colours=ANSWERS,
        answers=[(answer, said.replace("Hertz", name)) for answer, said in ANSWER_WORDS.items() if answer in painted],
        marks=[
            *[("$!$", "not to be used")] * (not made.all_solved),
            *[("$8/12$", "on how many lines of the points\nit holds, and their colour")] * of_lines,
            *((rf"$\mathbf{{{letter}}}$", cause) for letter, cause in causes.values() if letter in letters),
        ],
        **words,
    )


def against(made: ApplicabilityMap, yielding: bool) -> str:
    """Which bodies a verdict is against, for the end of a title; empty without a yield stress."""
    if not made.case.may_yield:
        return ""
    return f", {YIELDING if yielding else 'against elastic bodies'}"


def yield_notes(made: ApplicabilityMap) -> list[str]:
    """Loads of first yield, with what a first loading does not say; none where no yield stress is given."""
    loads_kN = [loads[FIRST_YIELD] / 1e3 for one in made.positions if FIRST_YIELD in (loads := one.yield_loads_N)]
    return [f"first yield from {min(loads_kN):.3g} kN on; {NOT_IN_IT}"] if loads_kN else []


def bands_of(limit: LoadLimit, open_kN: Collection[float]) -> tuple[Band, ...]:
    """Smallest and largest load (kN) and answer of each stretch of loads; `open_kN` are loads with open verdicts.

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


def _column(position: MapPosition, limit: LoadLimit, cells: Sequence[CellView]) -> ColumnView:
    open_kN = {cell.load_kN for cell in cells if cell.answer == "UNRESOLVED"}
    open_kN |= {load_N / 1e3 for load_N, answer in limit.tried if answer == "UNRESOLVED"}
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=bands_of(limit, open_kN),
        solved_kN=_solved_kN(position) + tuple(load_N / 1e3 for load_N, _ in limit.tried),
        cells=tuple(cells),
        limit=limit_text(limit, open_kN),
        lines=[(load_N / 1e3, YIELD_WORDS[name]) for name, load_N in position.yield_loads_N.items()],
    )


def _solved_kN(position: MapPosition) -> tuple[float, ...]:
    return tuple(cell.load_kN for cell in position.cells if cell.judged is not None)


def _limit_of(position: MapPosition, theory: str) -> LoadLimit:
    """At which loads another theory than Hertz holds, from the loads that were solved for the map."""
    told = [(cell, judged_by(cell.judged, theory)) for cell in position.cells if cell.usable]
    known = [(cell.load_N, judged.verdict.answer) for cell, judged in told if judged is not None]
    return LoadLimit(
        intervals=intervals_of(known),
        reason=None if known else position.limit.reason or f"no contact by {THEORIES[theory].in_sentence}",
        note=position.limit.note,
    )


def _verdict_cell(cell: MapCell, theory: str) -> CellView:
    judged, of_hertz = judged_by(cell.judged, theory), theory == HERTZ
    if judged is None or not cell.usable:
        # no measure leaves open what did not converge
        answer = "failed" if judged is None else judged.verdict.answer
        return _marked(cell, answer, "!", "", " " * 8)
    instead = of_hertz and ellipses_instead(cell.judged) is not None
    answer, percent = judged.verdict.answer, 1e2 * judged.deviation["p_max_MPa"]
    by = " " if answer == "HOLDS" else WORDS[judged.verdict.measure].letter
    off = f"{percent:+z.1f}" if math.isfinite(percent) else ""
    letter = CAUSE_LETTERS[cell.cause] if of_hertz and cell.cause is not None else ""
    printed = by + off.rjust(6) + (_OTHER_HOLDS if instead else " ")
    shown = _marked(cell, answer, _number(judged), letter, printed, diamond=instead)
    lines = [*judged.verdict.lines.values()]
    if answer != "UNRESOLVED" or len({*lines}) < 2:
        return shown
    holds = lines.count("HOLDS")
    return replace(shown, text=f"{holds}/{len(lines)} {letter}".strip(), share=holds / len(lines))


def _offered_cell(cell: MapCell, of: MappedVerdicts) -> CellView:
    judged = of.read(cell.usable) if cell.usable else None
    if judged is None:
        return _marked(cell, "failed", "!", "", "")
    letter, part = of.causes.get(judged.verdict.cause or "", ("", ""))[0], part_words(judged.limit_used)
    return _marked(cell, judged.verdict.answer, part, letter, f"{letter or ' '}{part:>6}")


def _marked(cell: MapCell, answer: str, number: str, letter: str, printed: str, *, diamond: bool = False) -> CellView:
    """A cell with its number and a letter, printed behind the sign of its answer."""
    return CellView(
        load_kN=cell.load_kN,
        answer=answer,
        text=f"{number} {letter}".strip(),
        letter="!" if number == "!" else letter,
        printed=_SIGNS[answer] + printed,
        bold=answer == "FAILS",
        diamond=diamond,
    )


def _number(judged: JudgedLoad | Judgement) -> str:
    """The part of a limit that is used; of load on separate patches, whose limit is next to nothing, the load."""
    if judged.verdict.measure != SEPARATE or judged.verdict.answer == "HOLDS":
        return part_words(judged.limit_used)
    return f"{1e2 * judged.deviation[SEPARATE]:.2g}%"


# --- Maps of the cheapest theory that holds: of the laws of features, and of the theories of the pressure.

# Of theories of the pressure, from the cheapest; a further one has the last.
_PRESSURE_COLOURS = (
    *("#d3ebf8", "#8fcbed", "#56a5d8"),
    *("#d5efd0", "#a5dba2", "#66c2a5", "#2a9d78"),
    *("#f5d2a8", "#f5b878"),
)
_OPEN, _NONE, _LOST = "UNRESOLVED", "FAILS", "failed"
_OUT, _OUT_WORDS = "*", "out of its range"


def laws_judged(made: ApplicabilityMap) -> dict[str, MappedLaws]:
    """Laws of features that were judged in a map, by its name."""
    return {name: laws for name, laws in offered("LAWS").items() if any(laws_of(cell, laws) for cell in made.cells)}


def theory_view(made: ApplicabilityMap) -> MapView:
    """The cheapest theory of the pressure that holds, and the largest part of a limit that it uses."""
    judged = {name for cell in made.cells if cell.usable for name in theories_of(cell.usable)}
    names = [name for name in THEORIES if name in judged]
    colours = chain(_PRESSURE_COLOURS, repeat(_PRESSURE_COLOURS[-1]))
    title = "the cheapest theory that holds" + " in its range" * made.case.criteria.theories_in_range
    theories = MappedLaws(
        title=f"{title}{against(made, yielding=False)}",
        criterion=lambda case: limits_text(case.criteria),
        lost="could not be solved",
        laws={name: {"words": THEORIES[name].words} for name in names},
        read=theories_of,
        marks={name: (THEORIES[name].letter, colour) for name, colour in zip(names, colours, strict=False)},
        note=f"{title}, and the largest share of a limit that it uses",
        number="share of the error limit\nthat it uses; above 1 it does not hold",
        of=lambda _, judged: part_words(judged.limit_used),
        in_range=made.case.criteria.theories_in_range,
    )
    return law_view(made, theories)


def law_view(made: ApplicabilityMap, theories: MappedLaws) -> MapView:
    """The cheapest of some theories or laws that holds.

    A stretch between two loads with different answers was not solved; a load whose answer is open is unresolved.
    """
    columns = tuple(_cheapest_column(position, theories) for position in made.positions)
    given = {cell.answer for column in columns for cell in column.cells}
    painted = given | {answer for column in columns for _, _, answer in column.bands}
    found = [_cheapest(laws_of(cell, theories), theories) for cell in made.cells]
    within = theories.criterion(made.case) or ""
    standing, out_of_range = {one.name for one in found}, any(one.out_of_range for one in found)
    words_of = {name: law["words"] for name, law in theories.laws.items()}
    letters = {name: f"{theories.marks[name][0]}  {words}" for name, words in words_of.items()}
    others = {_NONE: "none holds", _LOST: theories.lost, _OPEN: "unresolved", BETWEEN: ANSWER_WORDS[BETWEEN]}
    marks = {_NONE: ("$x$", "none holds"), _LOST: ("$!$", theories.lost), _OPEN: ("$?$", "open whether it holds")}
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=columns,
        title=theories.title,
        criterion=within,
        colours={**ANSWERS, **{name: colour for name, (_, colour) in theories.marks.items()}},
        answers=[
            *((name, words) for name, words in letters.items() if name in standing),
            *((answer, words) for answer, words in others.items() if answer in painted),
        ],
        marks=[mark for answer, mark in marks.items() if answer in given] + [(f"${_OUT}$", _OUT_WORDS)] * out_of_range,
        number=theories.number,
        notes=[
            theories.note.format(within=within),
            ", ".join(f"{theories.marks[name][0]} {words}" for name, words in words_of.items()),
            f"? open whether it holds{', x none holds' * (_NONE in given)}, ! {theories.lost}"
            + f", {_OUT} {_OUT_WORDS}" * out_of_range,
        ],
    )


def _cheapest(judged: Mapping[str, Judgement], theories: MappedLaws) -> Standing:
    return cheapest(standings(judged), in_range=theories.in_range)


def _cheapest_column(position: MapPosition, theories: MappedLaws) -> ColumnView:
    shown = tuple(_cell(cell, theories) for cell in position.cells)
    known = [(cell.load_kN, cell.answer) for cell in shown if cell.answer != _LOST]
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=stretches(known, BETWEEN),
        solved_kN=_solved_kN(position),
        cells=shown,
    )


def _cell(cell: MapCell, theories: MappedLaws) -> CellView:
    judged, load_kN = laws_of(cell, theories), cell.load_kN
    found = _cheapest(judged, theories)
    if not found.name:
        text = "x" if judged else "!"
        return CellView(load_kN=load_kN, answer=_NONE if judged else _LOST, text=text, letter=text)
    letter = theories.marks[found.name][0] + "?" * (found.answer == _OPEN) + _OUT * found.out_of_range
    text = f"{letter} {theories.of(found.name, judged[found.name])}".strip()
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
    failing = [one for one in loads if one.usable and one.answer.answer == "FAILS"]
    cause = min(failing, key=lambda one: one.load_N).answer.cause if failing else None
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
    steps = (1 if after - before <= _CLOSE_MM else 2 for before, after in pairwise(shifts_mm))
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


# --- By what a map is told and drawn: a theory's pressure, the cheapest theory, or what features judge.


def refuse_measure(case: Case, measure: str, theory: str = HERTZ) -> None:
    """Refuse a measure that there is not, or that the case does not ask for, and a theory that it has no room for.

    Raises
    ------
    InputError
        With what to do.
    """
    found = offered("MAPS")
    if measure not in ("pressure", "theory", *found):
        raise InputError(f"measure is {measure!r}; allowed: {', '.join(('pressure', 'theory', *found))}")
    if measure in found and found[measure].criterion(case) is None:
        raise InputError(f"measure is {measure!r}, but {found[measure].missing}")
    check_theory(theory)
    if measure != "pressure" and theory != HERTZ:
        raise InputError(
            f"theory is {theory!r}, but the measure is {measure!r}; leave one of them out: a theory goes with the"
            " measure pressure, and the measure theory has all of them"
        )


def views_of(made: ApplicabilityMap, theory: str = HERTZ) -> dict[str, MapView]:
    """All pictures of a map by the ending of their file names, the cheapest theory after the verdicts."""
    verdicts = {"": verdict_view(made), **({} if theory == HERTZ else {theory: verdict_view(made, theory)})}
    verdicts |= {name: offered_view(made, name) for name, of in offered("MAPS").items() if of.criterion(made.case)}
    return (
        verdicts | {"theory": theory_view(made)} | {of: law_view(made, laws) for of, laws in laws_judged(made).items()}
    )


def map_view(made: ApplicabilityMap, measure: str, theory: str = HERTZ) -> MapView:
    """A map by a measure; with the measure `pressure` also for a theory."""
    if measure == "pressure":
        return verdict_view(made, theory)
    return theory_view(made) if measure == "theory" else offered_view(made, measure)


def map_answer(made: ApplicabilityMap, measure: str, theory: str = HERTZ) -> list[str]:
    """The answer of a map by a measure, in sentences."""
    view = map_view(made, measure, theory)
    if measure == "theory":
        return theory_sentences(view)
    name = THEORIES[theory].in_sentence if measure == "pressure" else offered("MAPS")[measure].name
    bodies = against(made, theory == HERTZ).removeprefix(", ") if measure == "pressure" else ""
    more = [f"Verdicts are {bodies}."] if bodies else []
    return verdict_sentences(made, view, name, why=measure == "pressure" and theory == HERTZ) + more


def map_text(made: ApplicabilityMap, measure: str, *, theory: str = HERTZ, width: int | None = None) -> str:
    """A map as text, by a measure; for the cheapest theory also the maps of laws that features judged."""
    views = [map_view(made, measure, theory)]
    views += [law_view(made, laws) for laws in laws_judged(made).values()] if measure == "theory" else []
    return "\n\n".join(map_table(view, width=width) for view in views)
