"""Differences between the cases of a study, in words."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import INPUTS, Case

# A row has columns for these inputs. Inputs that only judge do not make a different case.
_TABLE_COLUMNS = ("rail", "wheel", "inclination", "lateral_shift_mm", "load_kN", "distance_mm")
_JUDGING_GROUPS = ("verdict", "creep")


def describe_varied_inputs(cases: Sequence[Case]) -> list[str]:
    """Describe for each case the inputs that vary between the cases of a pair.

    Inputs with a column in every table are left out. Inputs that are equal in all cases of a pair follow from the pair.

    Parameters
    ----------
    cases
        Cases of the study.

    Returns
    -------
    list of str
        A text per case; empty if nothing varies.
    """
    pairs = [(case.rail, case.wheel) for case in cases]
    input_names: dict[tuple[str, tuple[str, ...]], str] = {}
    for slot in INPUTS:
        slot_values = (slot.of(case) for case in cases)
        values = tuple("none" if value is None else slot.input.shown(value) for value in slot_values)
        varies = len(set(zip(pairs, values, strict=True))) > len(set(pairs))
        if varies and slot.key not in _TABLE_COLUMNS and slot.group not in _JUDGING_GROUPS:
            values_key = (slot.key, values)
            # an input that is equal for both bodies is written once
            input_names[values_key] = slot.key if values_key in input_names else f"{slot.body} {slot.key}".strip()
    return [
        ", ".join(f"{name} {values[index]}" for (_, values), name in input_names.items()) for index in range(len(cases))
    ]
