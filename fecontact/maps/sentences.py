"""Answer of a map in sentences: where a theory holds, up to which load, and why it fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate, groupby, pairwise

from fecontact.contact_theories.registry import THEORIES
from fecontact.inputs.texts import count_text
from fecontact.maps.model import ApplicabilityMap, MapPosition
from fecontact.maps.verdict_views import CAUSES
from fecontact.maps.view import CLOSE_SHIFTS_MM, ColumnView, MapView
from fecontact.maps.yaw_map import YawChange, choose_reference_yaw, find_yaw_changes, format_yaw, join_yaws
from fecontact.outputs.style import BETWEEN_VERDICTS


def write_verdict_sentences(applicability_map: ApplicabilityMap, view: MapView, name: str, *, why: bool) -> list[str]:
    """Sentences on a theory: where it holds at all loads, holds up to a load, and fails.

    Parameters
    ----------
    applicability_map
        Map.
    view
        View of the verdicts on the theory.
    name
        Name of the theory; after the first sentence it is "it".
    why
        Whether the causes of the map explain this theory.

    Returns
    -------
    list of str
        Sentences.
    """
    shifts = [column.shift_mm for column in view.columns]
    groups: dict[tuple[int, str], list[int]] = {}
    for index, (position, column) in enumerate(zip(applicability_map.positions, view.columns, strict=True)):
        groups.setdefault(_describe_column(column, view, _describe_cause(position) if why else ""), []).append(index)
    sentences: list[str] = []
    for (rank, phrase), indices in sorted(groups.items(), key=lambda group: group[0][0]):
        place = (
            f"at {join_words([f'{shifts[index]:g}' for index in indices])} mm"
            if rank == _HOLDS_UP_TO
            else _join_shifts(shifts, indices)
        )
        ends = (
            join_words([f"{view.columns[index].bands[0][1]:.3g}" for index in indices]) if rank == _HOLDS_UP_TO else ""
        )
        clause = phrase.replace("{ends}", ends).replace("{it}", "it" if sentences else name)
        sentences.append(f"{capitalise(f'{place} {clause}')}.")
    return sentences + _count_unusable(view)


_HOLDS_AT_ALL_LOADS, _HOLDS_UP_TO, _FAILS_AT_ALL_LOADS, _CHANGES, _WITHOUT_RESULT = range(5)


def _describe_column(column: ColumnView, view: MapView, because: str) -> tuple[int, str]:
    """Phrase on a column, with its rank in the order of the sentences.

    Parameters
    ----------
    column
        View of a lateral shift.
    view
        View of the map.
    because
        Clause with the cause; may be empty.

    Returns
    -------
    int
        Rank.
    str
        Phrase with the placeholders `{it}` and `{ends}`.
    """
    answers = [answer for _, _, answer in column.bands if answer != BETWEEN_VERDICTS]
    if not answers:
        return _WITHOUT_RESULT, "there is no result"
    starts_at_smallest_load = column.bands[0][0] <= min(view.loads_N) / 1e3
    covers_all_loads = starts_at_smallest_load and column.bands[-1][1] >= max(view.loads_N) / 1e3
    if covers_all_loads and set(answers) == {"HOLDS"}:
        return _HOLDS_AT_ALL_LOADS, f"{{it}} holds at all loads ({_format_load_range(view.loads_N)})"
    if covers_all_loads and set(answers) == {"FAILS"}:
        return _FAILS_AT_ALL_LOADS, f"{{it}} fails at all loads{because}"
    if starts_at_smallest_load and answers[0] == "HOLDS" and "HOLDS" not in answers[1:] and len(answers) > 1:
        return _HOLDS_UP_TO, f"{{it}} holds up to {{ends}} kN{because}"
    return _CHANGES, f"{{it}} {_add_verbs(column.limit)}"


def write_theory_sentences(view: MapView) -> list[str]:
    """Sentences on the cheapest theory of the pressure that holds, and where it holds.

    Parameters
    ----------
    view
        View of the cheapest theory.

    Returns
    -------
    list of str
        Sentences.
    """
    sentences: list[str] = []
    for name, theory in THEORIES.items():
        if places := _describe_places(view, name):
            places_out = _describe_places(view, name, out_of_range=True)
            begin = "It" if sentences else capitalise(view.title)
            sentences.append(
                f"{begin} is {theory.in_sentence} {places}{places_out and f', out of its range {places_out}'}."
            )
    if places := _describe_places(view, "FAILS"):
        sentences.append(f"No theory holds {places}.")
    return sentences + _count_unusable(view)


def _describe_places(view: MapView, name: str, *, out_of_range: bool = False) -> str:
    """Shifts and loads with an answer, grouped by equal loads.

    Parameters
    ----------
    view
        View of the map.
    name
        Answer.
    out_of_range
        Whether only cells of theories outside their range count.

    Returns
    -------
    str
        Text; empty without such cells.
    """
    shifts = [column.shift_mm for column in view.columns]
    at_loads = {
        number: tuple(
            load_N
            for load_N, cell in zip(view.loads_N, column.cells, strict=True)
            if cell.answer == name and cell.out_of_range >= out_of_range
        )
        for number, column in enumerate(view.columns)
    }
    texts = []
    for loads in sorted({loads for loads in at_loads.values() if loads}, key=lambda loads: (-len(loads), loads)):
        places = _join_shifts(shifts, [number for number, name_loads in at_loads.items() if name_loads == loads])
        load_text = "at all loads" if loads == view.loads_N else _format_load_list(view.loads_N, loads)
        texts.append(f"{places} {load_text}")
    return "; ".join(texts)


# Number of cells that a sentence on the yaw names.
_MOST_NAMED_CELLS = 4
_ANSWER_VERBS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "is unresolved", "failed": "has no result"}
# If the answer is the cheapest theory, FAILS means that no theory holds.
_THEORY_VERBS = {
    **_ANSWER_VERBS,
    "FAILS": "does not exist",
    **{theory: f"is {words.in_sentence}" for theory, words in THEORIES.items()},
}


def write_yaw_sentences(views: Mapping[float, MapView], name: str, *, of_theories: bool = False) -> list[str]:
    """Sentences on the cells in which an answer changes with the yaw.

    Parameters
    ----------
    views
        View of the map at each yaw in mrad, by the same measure.
    name
        Name of the theory, or "the cheapest theory that holds".
    of_theories
        Whether the answers are the cheapest theories.

    Returns
    -------
    list of str
        A sentence for each yaw except the reference, which is the yaw nearest to zero; or a single sentence without
        any change.
    """
    answers_by_yaw = {yaw_mrad: _collect_answers(view) for yaw_mrad, view in views.items()}
    if len(views) < 2 or not all(answers_by_yaw.values()):
        return []
    changes, verbs = find_yaw_changes(answers_by_yaw), _THEORY_VERBS if of_theories else _ANSWER_VERBS
    same = f"{name if of_theories else f'the verdict on {name}'} is the same"
    reference_mrad = choose_reference_yaw([*views])
    if not changes:
        cells = count_text(len(answers_by_yaw[reference_mrad]), "cell")
        return [f"At {join_yaws([*views])} {same} in all of {cells} (shift and load)."]
    other_yaws = [yaw_mrad for yaw_mrad in views if yaw_mrad != reference_mrad]
    return [
        _write_yaw_sentence(changes, (reference_mrad, yaw_mrad), name, verbs)
        or f"At {format_yaw(yaw_mrad)} mrad {same} as at {format_yaw(reference_mrad)} mrad in every cell."
        for yaw_mrad in other_yaws
    ]


def _collect_answers(view: MapView) -> dict[tuple[float, float], str]:
    """Answers of the cells of a view by shift (mm) and load (N)."""
    return {
        (column.shift_mm, load_N): cell.answer
        for column in view.columns
        for load_N, cell in zip(view.loads_N, column.cells, strict=True)
    }


def _write_yaw_sentence(
    changes: Sequence[YawChange], yaws_mrad: tuple[float, float], name: str, verbs: Mapping[str, str]
) -> str:
    """Sentence on the answers that change from the first yaw to the second; empty without a change."""
    reference_mrad, yaw_mrad = yaws_mrad
    reference = f"{format_yaw(reference_mrad)} mrad"
    groups: dict[tuple[str, str], list[YawChange]] = {}
    for change in changes:
        before, after = change.answers[reference_mrad], change.answers[yaw_mrad]
        if before != after:
            groups.setdefault((before, after), []).append(change)
    phrases = [
        f"{verbs[after]} in {count_text(len(cells), 'cell')} where it {verbs[before]} at {reference}"
        f" ({_name_cells(cells)})"
        for (before, after), cells in groups.items()
    ]
    return f"At {format_yaw(yaw_mrad)} mrad {name} {'; it '.join(phrases)}." if phrases else ""


def _name_cells(changes: Sequence[YawChange]) -> str:
    """Shifts and loads of cells; of many cells the first, and the number of the others."""
    names = [f"{change.lateral_shift_mm:g} mm {change.load_N / 1e3:g} kN" for change in changes[:_MOST_NAMED_CELLS]]
    further = len(changes) - len(names)
    return ", ".join(names) + (f" and {further} more" if further else "")


def _add_verbs(limit: str) -> str:
    """Load limits of a table with the verbs of a sentence."""
    limits_text, unit, note = limit.partition(" kN")
    phrases = [
        f"is {phrase}" if phrase.startswith(("unresolved", "not solved")) else phrase
        for phrase in limits_text.split(", ")
    ]
    return f"{', '.join(phrases)}{unit}{note}"


def _describe_cause(position: MapPosition) -> str:
    """Clause with the cause at the smallest load at which Hertz fails.

    Empty if Hertz fails nowhere, or without a cause.
    """
    loads = [*position.tried, *(cell.judged for cell in position.cells if cell.judged is not None)]
    failing = [load for load in loads if load.usable and load.verdict.answer == "FAILS"]
    cause = min(failing, key=lambda load: load.load_N).verdict.cause if failing else None
    return f", where {CAUSES[cause][1]}" if cause else ""


def _count_unusable(view: MapView) -> list[str]:
    """Sentence on the numbers of unresolved cells and cells without a result; empty without such cells."""
    answers = [cell.answer for column in view.columns for cell in column.cells]
    counts = ((answers.count("UNRESOLVED"), "unresolved"), (answers.count("failed"), "without a result"))
    phrases = [f"{count} {'is' if count == 1 else 'are'} {words}" for count, words in counts if count]
    return [f"Of {count_text(len(answers), 'cell')}, {' and '.join(phrases)}."] if phrases else []


def _join_shifts(shifts_mm: Sequence[float], indices: Sequence[int]) -> str:
    """Shifts in words, such as "from -4 to 2 and at 5 mm".

    Three or more close neighbours become a range. Neighbours more than `CLOSE_SHIFTS_MM` apart are in different ranges.

    Parameters
    ----------
    shifts_mm
        Ascending shifts of the map.
    indices
        Ascending indices of the shifts to describe.
    """
    ranges: list[str] = []
    single_shifts: list[str] = []
    # A gap in the picture is also a gap in the sentence.
    steps = (1 if after - before <= CLOSE_SHIFTS_MM else 2 for before, after in pairwise(shifts_mm))
    positions = list(accumulate(steps, initial=0))
    for _, group in groupby(enumerate(indices), key=lambda pair: positions[pair[1]] - pair[0]):
        numbers = [shifts_mm[index] for _, index in group]
        if len(numbers) > 2:
            ranges.append(f"from {numbers[0]:g} to {numbers[-1]:g}")
        else:
            single_shifts += [f"{number:g}" for number in numbers]
    if single_shifts:
        ranges.append(f"at {join_words(single_shifts)}")
    return f"{join_words(ranges)} mm"


def _format_load_range(loads_N: Sequence[float]) -> str:
    low, high = (f"{load_N / 1e3:g}" for load_N in (min(loads_N), max(loads_N)))
    return f"{low} kN" if low == high else f"{low} to {high} kN"


def _format_load_list(all_N: Sequence[float], some_N: Sequence[float]) -> str:
    first = all_N.index(some_N[0])
    if len(some_N) > 2 and tuple(all_N[first : first + len(some_N)]) == tuple(some_N):
        return f"from {_format_load_range(some_N)}"
    return f"at {join_words([f'{load_N / 1e3:g}' for load_N in some_N])} kN"


def join_words(texts: Sequence[str]) -> str:
    """Enumeration of texts, at least a single text."""
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}"


def capitalise(text: str) -> str:
    """Text with a capital first letter; the rest is unchanged."""
    return text[:1].upper() + text[1:]
