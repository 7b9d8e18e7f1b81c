"""Words for cases: pair, position, load, roll and side of the wheelset."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case, Opposite
from fecontact.outputs.pair_names import BODIES, RowMapping, row_pair_text
from fecontact.placement.irregularity import Irregularity, format_irregularity
from fecontact.profiles.reading import can_form_wheelset, is_crane_rail


def case_words(inputs: RowMapping) -> str:
    """Pair, position and load of a case.

    Parameters
    ----------
    inputs
        Record of the inputs of a placed case, with `roll_mrad` (`case` in a record of a result).

    Returns
    -------
    str
        Text in one line. Shift in mm, angles in mrad, load in kN.
    """
    roll_mrad = inputs["roll_mrad"]
    rotations = f", yaw {1e3 * inputs['yaw_rad']:+.4g} mrad" if inputs["yaw_rad"] else ""
    if inputs["roll"] != "given":
        rotations = f" of the wheelset, {inputs['side']} side, roll {roll_mrad:+z.4g} mrad{rotations}"
    else:
        rotations = (f", roll {roll_mrad:+.4g} mrad" if roll_mrad else "") + rotations
        # the left wheel is the default, and the only one without a wheelset
        rotations = (", right side" if inputs["side"] == "right" else "") + rotations
    irregularity_words = ", ".join(
        f"{body} {format_irregularity(Irregularity(**inputs[f'{body}_irregularity']))}"
        for body in BODIES
        # the inputs of smooth bodies have no key
        if inputs.get(f"{body}_irregularity")
    )
    return (
        f"{row_pair_text(inputs)}; shift {inputs['lateral_shift_mm']:+z.2f} mm{rotations};"
        f" {inputs['load_kind']} load {inputs['load_N'] / 1e3:.4g} kN"
        + (f"; at {inputs.get('distance_mm', 0.0):g} mm of {irregularity_words}" if irregularity_words else "")
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
    loads_kN = (load_N and load_N / 1e3 for load_N in (case.roll_load_N, case.opposite.wheel_load_N))
    words = _describe_roll(str(case.roll), 1e3 * case.roll_rad, case.side, *loads_kN)
    if case.roll != "given" or can_form_wheelset(case.rail, case.wheel):
        return words
    reason = "a crane rail has" if is_crane_rail(case.rail) else "profiles given by their radii have"
    return f"{words} ({reason} no wheelset)"


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
    rolls = {_read_roll(row) for row in rolled_rows}
    if len(rolls) < 2:
        return _describe_roll(*rolls.pop()) if rolls else ""
    kinds = {kind for kind, *_ in rolls}
    words_by_kinds = {
        frozenset({"loaded"}): LOADED_ROLL_WORDS,
        frozenset({"given"}): "roll fixed for each case",
        frozenset({"touching", "loaded"}): f"{TOUCHING_ROLL_WORDS}, loaded or not",
    }
    return words_by_kinds.get(frozenset(kinds), f"{TOUCHING_ROLL_WORDS}, or fixed")


def _read_roll(row: RowMapping) -> tuple[str, float, str, float | None, float | None]:
    """Arguments of `_describe_roll`; values that it does not show are zero, empty or None."""
    kind = str(row.get("roll") or "given")
    if kind == "loaded":
        return kind, 0.0, str(row["side"]), _read_number(row, "roll_load_kN"), _read_number(row, "opposite_load_kN")
    return kind, float(row["roll_mrad"]) if kind == "given" else 0.0, "", None, None


def _describe_roll(
    kind: str, roll_mrad: float, side: str, load_kN: float | None, opposite_load_kN: float | None
) -> str:
    """Words for a roll of a kind.

    The roll is shown only if it is given, the loads (kN) only for a loaded wheelset. A load is None if it is equal to
    the load of the cases.
    """
    if kind == "given":
        return f"roll fixed at {roll_mrad:g} mrad"
    if kind == "touching":
        return TOUCHING_ROLL_WORDS
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


def other_wheel_hint(case: Case) -> str:
    """Advice how to read a map for the opposite wheel; empty if the map does not show that wheel.

    Parameters
    ----------
    case
        Inputs of the case.

    Returns
    -------
    str
        Text without a full stop.
    """
    yaw_part = " of a map with the opposite yaw" if case.yaw_rad else ""
    return f"for the other wheel, read the opposite shift{yaw_part}" if other_wheel_label(case) else ""


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
