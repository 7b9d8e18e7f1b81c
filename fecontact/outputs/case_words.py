"""Words for cases: pair, position, load, roll and side of the wheelset."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case, Opposite
from fecontact.outputs.pair_names import RowMapping, pair_words
from fecontact.placement.irregularity import format_irregularity
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.reading import can_form_wheelset, is_crane_rail
from fecontact.solving.placing import compute_roll


def case_words(case: Case, placement: Placement) -> str:
    """Pair, position and load of a case.

    Parameters
    ----------
    case
        Inputs of the case.
    placement
        Placement of the case, with its roll.

    Returns
    -------
    str
        Text in one line. Shift in mm, angles in mrad, load in kN.
    """
    roll = 1e3 * compute_roll(case, placement)
    rotations = f", yaw {1e3 * case.yaw_rad:+.4g} mrad" if case.yaw_rad else ""
    if case.roll != "given":
        rotations = f" of the wheelset, {case.side} side, roll {roll:+z.4g} mrad{rotations}"
    elif roll:
        rotations = f", roll {roll:+.4g} mrad{rotations}"
    irregularities = (("rail", case.rail_irregularity), ("wheel", case.wheel_irregularity))
    irregularity_words = ", ".join(
        f"{body} {format_irregularity(irregularity)}"
        for body, irregularity in irregularities
        if irregularity is not None
    )
    return (
        f"{pair_words(case)};"
        f" shift {case.lateral_shift_mm:+z.2f} mm{rotations}; {case.load_kind} load {case.load_N / 1e3:.4g} kN"
        + (f"; at {case.distance_mm:g} mm of {irregularity_words}" if irregularity_words else "")
    )


SHIFT_LABEL = "lateral shift of the wheelset in mm  (positive: towards this rail)"
"""Label of an axis over the lateral shift."""
TOUCHING_ROLL_WORDS = "rolled until both wheels touch"
LOADED_ROLL_WORDS = "roll of the loaded wheelset"
_OPPOSITE_SIDE = {"left": "right", "right": "left"}
_SHIFT_SIGN_WORDS = {"left": "positive: towards its rail", "right": "negative: towards its rail"}


def roll_words(case: Case) -> str:
    """Words for the roll of a case, such as "roll fixed at 0 mrad".

    Parameters
    ----------
    case
        Inputs of the case.

    Returns
    -------
    str
        Whether the roll is found from the wheelset or given. If the case has no wheelset, the reason is included.
    """
    if case.roll == "loaded":
        load_kN, opposite_load_kN = (
            load_N and load_N / 1e3 for load_N in (case.roll_load_N, case.opposite.wheel_load_N)
        )
        return _loaded_roll_words(case.side, load_kN, opposite_load_kN)
    if case.roll == "touching":
        return TOUCHING_ROLL_WORDS
    fixed = f"roll fixed at {1e3 * case.roll_rad:g} mrad"
    if can_form_wheelset(case.rail, case.wheel):
        return fixed
    reason = "a crane rail has" if is_crane_rail(case.rail) else "profiles given by their radii have"
    return f"{fixed} ({reason} no wheelset)"


def roll_words_of_rows(rows: Sequence[RowMapping]) -> str:
    """Words for the roll of several rows of a table.

    Parameters
    ----------
    rows
        Rows; their values may be texts.

    Returns
    -------
    str
        Words as in `roll_words`; empty if no row has a roll.
    """
    rolled_rows = [row for row in rows if row.get("roll_mrad") not in (None, "")]
    kinds = {row.get("roll") or "given" for row in rolled_rows}
    if kinds == {"touching"}:
        return TOUCHING_ROLL_WORDS
    if kinds == {"touching", "loaded"}:
        return f"{TOUCHING_ROLL_WORDS}, loaded or not"
    if kinds == {"loaded"}:
        loads_kN = {(_read_number(row, "roll_load_kN"), _read_number(row, "opposite_load_kN")) for row in rolled_rows}
        sides = {str(row["side"]) for row in rolled_rows}
        return (
            _loaded_roll_words(sides.pop(), *loads_kN.pop()) if len(loads_kN) == len(sides) == 1 else LOADED_ROLL_WORDS
        )
    rolls = {float(row["roll_mrad"]) for row in rolled_rows}
    if kinds == {"given"}:
        return f"roll fixed at {rolls.pop():g} mrad" if len(rolls) == 1 else "roll fixed for each case"
    return f"{TOUCHING_ROLL_WORDS}, or fixed" if kinds else ""


def _loaded_roll_words(side: str, load_kN: float | None, opposite_load_kN: float | None) -> str:
    """Words for the roll of a loaded wheelset.

    Both loads are in kN. A load is None if it is equal to the load of the cases.
    """
    if opposite_load_kN is None:
        return LOADED_ROLL_WORDS if load_kN is None else f"roll of the wheelset under {load_kN:g} kN per wheel"
    opposite_part = f"{opposite_load_kN:g} kN on its {_OPPOSITE_SIDE[side]} wheel"
    if load_kN is None:
        return f"{LOADED_ROLL_WORDS}, {opposite_part}"
    return f"roll of the wheelset under {load_kN:g} kN on its {side} wheel, {opposite_part}"


def _read_number(row: RowMapping, column: str) -> float | None:
    return None if row.get(column) in (None, "") else float(row[column])


def shift_label(case: Case) -> str:
    """Label of an axis over the lateral shift; for a wheelset it names the wheel.

    Parameters
    ----------
    case
        Case whose side and roll decide the label.

    Returns
    -------
    str
        Label with its unit.
    """
    if case.roll == "given" and case.side == "left":
        return SHIFT_LABEL
    return f"{case.side} wheel: lateral shift of the wheelset in mm  ({_SHIFT_SIGN_WORDS[case.side]})"


def other_wheel_label(case: Case) -> str | None:
    """Label of the axis for the opposite wheel, with the opposite sign of the shift.

    Parameters
    ----------
    case
        Inputs of the case.

    Returns
    -------
    str or None
        None if the picture does not show the opposite wheel: it has other profiles or another diameter, or the roll is
        given.
    """
    if case.roll == "given" or case.opposite != Opposite():
        return None
    opposite_side = _OPPOSITE_SIDE[case.side]
    yaw_part = " at the opposite yaw" if case.yaw_rad else ""
    return f"{opposite_side} wheel{yaw_part}: lateral shift of the wheelset in mm  ({_SHIFT_SIGN_WORDS[opposite_side]})"
