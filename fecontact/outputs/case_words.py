"""What cases are called: pair, position and load, the roll, and which wheel of the wheelset."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case, Opposite
from fecontact.outputs.pair_names import Row, pair_words
from fecontact.placement.irregularity import irregularity_text
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.reading import is_crane_rail, makes_a_wheelset
from fecontact.solving.placing import roll_of_case


def case_words(case: Case, placement: Placement) -> str:
    """Pair, position and load of a case, in one line."""
    roll = 1e3 * roll_of_case(case, placement)
    turned = f", yaw {1e3 * case.yaw_rad:+.4g} mrad" if case.yaw_rad else ""
    if case.roll != "given":
        turned = f" of the wheelset, {case.side} side, roll {roll:+z.4g} mrad{turned}"
    elif roll:
        turned = f", roll {roll:+.4g} mrad{turned}"
    lines = (("rail", case.rail_irregularity), ("wheel", case.wheel_irregularity))
    irregular = ", ".join(f"{body} {irregularity_text(line)}" for body, line in lines if line is not None)
    return (
        f"{pair_words(case)};"
        f" shift {case.lateral_shift_mm:+z.2f} mm{turned}; {case.load_kind} load {case.load_N / 1e3:.4g} kN"
        + (f"; at {case.distance_mm:g} mm of {irregular}" if irregular else "")
    )


SHIFT = "lateral shift of the wheelset in mm  (positive: towards this rail)"
"""Label of an axis over the shift."""
OF_WHEELSET = "rolled until both wheels touch"
UNDER_LOAD = "roll of the loaded wheelset"
_OTHER = {"left": "right", "right": "left"}
_TOWARDS = {"left": "positive: towards its rail", "right": "negative: towards its rail"}


def roll_words(case: Case) -> str:
    """Whether the roll is found from the wheelset or given, such as "roll fixed at 0 mrad"."""
    if case.roll == "loaded":
        own, other = (load_N and load_N / 1e3 for load_N in (case.roll_load_N, case.opposite.wheel_load_N))
        return _under_load(case.side, own, other)
    if case.roll == "touching":
        return OF_WHEELSET
    fixed = f"roll fixed at {1e3 * case.roll_rad:g} mrad"
    if makes_a_wheelset(case.rail, case.wheel):
        return fixed
    why = "a crane rail has" if is_crane_rail(case.rail) else "lines given by their radii have"
    return f"{fixed} ({why} no wheelset)"


def roll_words_of_rows(rows: Sequence[Row]) -> str:
    """The same of rows of tables, whose values may be texts."""
    found = [row for row in rows if row.get("roll_mrad") not in (None, "")]
    kinds = {row.get("roll") or "given" for row in found}
    if kinds == {"touching"}:
        return OF_WHEELSET
    if kinds == {"touching", "loaded"}:
        return f"{OF_WHEELSET}, loaded or not"
    if kinds == {"loaded"}:
        ways = {(_number(row, "roll_load_kN"), _number(row, "opposite_load_kN")) for row in found}
        sides = {str(row["side"]) for row in found}
        return _under_load(sides.pop(), *ways.pop()) if len(ways) == len(sides) == 1 else UNDER_LOAD
    rolls = {float(row["roll_mrad"]) for row in found}
    if kinds == {"given"}:
        return f"roll fixed at {rolls.pop():g} mrad" if len(rolls) == 1 else "roll fixed case by case"
    return f"{OF_WHEELSET}, or fixed" if kinds else ""


def _under_load(side: str, own: float | None, other: float | None) -> str:
    """The roll of a loaded wheelset; `own` and `other` are loads (kN) if they differ from the cases' loads."""
    if other is None:
        return UNDER_LOAD if own is None else f"roll of the wheelset under {own:g} kN a wheel"
    others = f"{other:g} kN on its {_OTHER[side]} wheel"
    if own is None:
        return f"{UNDER_LOAD}, {others}"
    return f"roll of the wheelset under {own:g} kN on its {side} wheel, {others}"


def _number(row: Row, column: str) -> float | None:
    return None if row.get(column) in (None, "") else float(row[column])


def shift_label(case: Case) -> str:
    """Label of an axis over the lateral shift, of a wheelset with the wheel whose it is."""
    if case.roll == "given" and case.side == "left":
        return SHIFT
    return f"{case.side} wheel: lateral shift of the wheelset in mm  ({_TOWARDS[case.side]})"


def other_wheel_label(case: Case) -> str | None:
    """Label of the axis with the sign turned, on which the picture shows the other wheel of the wheelset.

    None where it is not: the other side has other profiles or another diameter, or the roll is given.
    """
    if case.roll == "given" or case.opposite != Opposite():
        return None
    other = _OTHER[case.side]
    yawed = " at the opposite yaw" if case.yaw_rad else ""
    return f"{other} wheel{yawed}: lateral shift of the wheelset in mm  ({_TOWARDS[other]})"
