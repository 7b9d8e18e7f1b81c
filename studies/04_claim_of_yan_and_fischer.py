"""Does Hertz fail where the contact spreads into a region of another curvature, and only there?

Yan and Fischer (Arch. Appl. Mech. 70, 2000) claim that for a rail and a wheel Hertz holds only if the contact zone
does not spread into a region of changed surface curvature, and if nothing yields. Here the elastic half of the claim
is a hypothesis that can fail: 60E1 1:40 with S1002 at 29 positions from -8 to 6 mm under 50 and 100 kN. Wheel and rail
alone, without roll: a wheelset would not stand at -8 mm, and the claim knows of none.

Reference: the verdicts of this package's finite elements, by all measures of the field. Expected by
the claim: FAILS where the patch covers a curvature junction of rail or wheel, HOLDS elsewhere. The study counts both
kinds of exceptions and looks for the measure that separates better: the distance from the contact point to the next
junction over Hertz's semi-axis, and how much the relative curvature varies below the patch. Only the claim itself is
Yan and Fischer's; all numbers are this package's.

Found: all 19 failures have a junction below the patch. No limit of the distance to the junction gives the right verdict
in more than 50 of the 57 decided cases, because contacts with two lobes or a second patch have their junctions at 0.9
to 1.3 b.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.regression.checks import Check, compare_discretisation

SHIFTS_MM = tuple(0.5 * k for k in range(-16, 13))
LOADS_KN = (50.0, 100.0)
# Hertz's gap on the half-space, with 32 nodes per semi-axis: 0.01 % is reached.
DISCRETISATION_PERCENT = 0.05


def cases(quick: bool = False) -> list[Case]:
    """All positions and loads, or two positions."""
    if quick:
        return [Case(lateral_shift_mm=s, roll="given", refine="never") for s in (-4.0, 1.0)]
    return [Case(lateral_shift_mm=shift, roll="given", load_N=1e3 * load) for load in LOADS_KN for shift in SHIFTS_MM]


def truth(value: Any) -> bool:
    """A truth value of a row, which a table holds as text."""
    return value if isinstance(value, bool) else str(value) == "True"


MEASURES: dict[str, tuple[str, Callable[[dict[str, Any]], float]]] = {
    # Hertz should fail at larger values
    "nearness of a junction": (
        "b / distance",
        lambda row: 1.0 / max(float(row["geometry_junction_distance_over_b"]), 1e-6),
    ),
    "variation of the curvature below the patch": ("part", lambda row: float(row["geometry_curvature_variation"])),
}


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Confusion matrix of the claim, its exceptions, and the best threshold of each measure."""
    decided = [row for row in rows if row["verdict_answer"] in ("HOLDS", "FAILS")]
    crossing = [truth(row["geometry_junction_in_patch"]) for row in decided]
    fails = [row["verdict_answer"] == "FAILS" for row in decided]
    lines = [f"{len(decided)} of {len(rows)} cases are decided, {len(rows) - len(decided)} UNRESOLVED."]
    lines += ["                                  FAILS  HOLDS"]
    for name, covers in (("patch covers a junction", True), ("patch covers no junction", False)):
        counts = [
            sum(f == failed and c == covers for f, c in zip(fails, crossing, strict=True)) for failed in (True, False)
        ]
        lines.append(f"{name:32} {counts[0]:6d} {counts[1]:6d}")
    for failed, text in (
        (False, "Holds although the patch covers a junction"),
        (True, "Fails although it covers none"),
    ):
        exceptions = [row for row, f, c in zip(decided, fails, crossing, strict=True) if f == failed and c != failed]
        if exceptions:
            lines.append(f"{text}: {', '.join(_name(row) for row in exceptions)}.")
    for name, (unit, measure) in MEASURES.items():
        values = np.array([measure(row) for row in decided])
        threshold, right = best_threshold(values, np.array(fails))
        lines.append(f"Best threshold of the {name}: {threshold:.3g} ({unit}), right in {right} of {len(decided)}.")
    right = sum(f == c for f, c in zip(fails, crossing, strict=True))
    lines.append(f"The claim itself is right in {right} of {len(decided)}.")
    figure(decided, out / "claim.png")
    return "\n".join(lines)


def _name(row: dict[str, Any]) -> str:
    return f"{float(row['lateral_shift_mm']):+g} mm {float(row['load_kN']):g} kN"


def best_threshold(values: np.ndarray, fails: np.ndarray) -> tuple[float, int]:
    """Threshold that separates failing from holding cases best, and its number of right answers."""
    if values.size == 0:
        return float("nan"), 0
    ordered = np.unique(values)
    middles = np.concatenate(([ordered[0] / 2.0], np.sqrt(ordered[1:] * ordered[:-1]), [ordered[-1] * 2.0]))
    right = [int(np.count_nonzero((values > t) == fails)) for t in middles]
    best = int(np.argmax(right))
    return float(middles[best]), right[best]


def figure(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw the worst measure over the distance to the next junction."""
    from fecontact.outputs.figures.study import ANSWER_MARKS
    from fecontact.outputs.style import (
        ANSWER_COLOURS,
        add_grid,
        add_legend_beside,
        blank_figure,
        save_figure,
        set_plain_log_scale,
    )

    picture = blank_figure(10.5, 4.8)
    axes = picture.add_subplot()
    for covers, place in ((True, "over a junction"), (False, "over none")):
        for verdict in ("HOLDS", "FAILS"):
            verdict_rows = [
                row
                for row in rows
                if (truth(row["geometry_junction_in_patch"]), row["verdict_answer"]) == (covers, verdict)
            ]
            if verdict_rows:
                axes.scatter(
                    [float(row["geometry_junction_distance_over_b"]) for row in verdict_rows],
                    [max(float(row["verdict_limit_utilisation"]), 0.01) for row in verdict_rows],
                    s=48,
                    c=ANSWER_COLOURS[verdict] if covers else "white",
                    ec="0.2" if covers else ANSWER_COLOURS[verdict],
                    lw=0.8 if covers else 1.6,
                    marker=ANSWER_MARKS[verdict],
                    label=f"{verdict}, patch {place}: {len(verdict_rows)}",
                )
    axes.axhline(1.0, color="0.5", lw=1, ls="--")
    axes.axvline(1.0, color="0.5", lw=1, ls=":")
    set_plain_log_scale(axes)
    add_grid(axes)
    axes.set_xlabel("distance from the contact point to the next curvature junction / Hertz's semi-axis b")
    axes.set_ylabel("deviation of the worst measure / its limit")
    add_legend_beside(axes)
    save_figure(picture, path)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the lowest rung of the ladder, which is exact.

    The finite elements that the verdicts compare with have no independent reference.
    """
    return compare_discretisation(rows, DISCRETISATION_PERCENT)


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
