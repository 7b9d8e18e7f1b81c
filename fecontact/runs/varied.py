"""What differs between the cases of a study, in words."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import INPUTS, Case

# A row has columns for these; what only judges does not make another case.
_SHOWN = ("rail", "wheel", "inclination", "lateral_shift_mm", "load_kN", "distance_mm")
_JUDGING = ("verdict", "creep")


def varied_words(cases: Sequence[Case]) -> list[str]:
    """For each case the inputs that are not the same in all cases of a pair, in words, but those in every table.

    What all cases of a pair have alike is known by the pair.
    """
    pairs = [(case.rail, case.wheel) for case in cases]
    found: dict[tuple[str, tuple[str, ...]], str] = {}
    for slot in INPUTS:
        own = (slot.of(case) for case in cases)
        values = tuple("none" if value is None else slot.input.shown(value) for value in own)
        varies = len(set(zip(pairs, values, strict=True))) > len(set(pairs))
        if varies and slot.key not in _SHOWN and slot.group not in _JUDGING:
            same = (slot.key, values)
            # what both bodies have alike is told once
            found[same] = slot.key if same in found else f"{slot.body} {slot.key}".strip()
    return [", ".join(f"{name} {values[at]}" for (_, values), name in found.items()) for at in range(len(cases))]
