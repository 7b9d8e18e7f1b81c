"""A case in words."""

from __future__ import annotations

from fecontact.case import Case
from fecontact.geometry.placement import Placement
from fecontact.irregularity.texts import irregularity_text
from fecontact.outputs.words.pairs import pair_words
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
