"""Do the cut planes and the element size decide about the result?

60E1, 1:40, S1002, 100 kN, at a tread position (3 mm) and at the two-lobed one (0 mm): each of the four cut planes moved
out by half, and three resolutions. Expected: a cut plane changes the peak pressure by less than 0.3 %. The approach is
another matter: it grows with the bodies, as it must.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.case import BodySize, Case
from fecontact.regression.checks import Check, discretisation_check
from fecontact.runs.identity import case_id

LIMIT_PERCENT = 0.3
# Eight elements a semi-axis state the peak pressure of a real pair to half a per cent, five to one.
RESOLUTION_PERCENT = {"standard": 0.5, "quick": 1.0}
# Hertz's own gap on the half-space, at five nodes a semi-axis.
DISCRETISATION_PERCENT = 0.5
CUTS = ("rail_depth_mm", "rail_half_length_mm", "rim_thickness_mm", "rim_half_length_mm")


def cases(quick: bool = False) -> list[Case]:
    """A base case and one case a cut plane at each position, then the other resolutions; at `quick` the rail's only."""
    made = []
    for shift in (3.0,) if quick else (3.0, 0.0):
        base = Case(lateral_shift_mm=shift)
        if quick:
            base = replace(base, resolution="quick", refine_degrees_of_freedom=0)
        made.append(base)
        moved = CUTS[:2] if quick else CUTS
        made += [replace(base, size=replace(BodySize(), **{cut: 1.5 * getattr(BodySize(), cut)})) for cut in moved]
        if not quick:
            made += [replace(base, resolution="quick"), replace(base, resolution="fine")]
    return made


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Change of the peak pressure by each cut plane, and by the resolution."""
    lines = []
    size = 7 if len(rows) > 3 else 3
    for start in range(0, len(rows), size):
        base, *others = rows[start : start + size]
        names = (*CUTS, "quick", "fine")
        for name, row in zip(names, others, strict=False):
            change = 100.0 * (float(row["p_max_fe_MPa"]) / float(base["p_max_fe_MPa"]) - 1.0)
            what = f"{name} times 1.5" if name in CUTS else f"resolution {name}"
            verdict = "" if name not in CUTS else " (ok)" if abs(change) < LIMIT_PERCENT else " (TOO MUCH)"
            lines.append(f"shift {base['lateral_shift_mm']:g} mm, {what}: peak pressure {change:+.3f} %{verdict}")
    return "\n".join(lines)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Peak pressure against the same case with a cut plane moved out, and against the finest resolution."""
    by_case = {case_id(case): case for quick in (False, True) for case in cases(quick)}
    solved = [(by_case[row["id"]], row) for row in rows]
    made = []
    for case, row in solved:
        # what it is checked against: a base case the finest mesh, a moved cut plane its base case
        moved = [cut for cut in CUTS if getattr(case.size, cut) != getattr(BodySize(), cut)]
        wanted = replace(case, size=BodySize()) if moved else replace(case, resolution="fine")
        name = f"{moved[0]} times 1.5" if moved else str(case.resolution)
        reference = [other for its, other in solved if its == wanted and its != case]
        if reference:
            made.append(
                Check(
                    quantity="p_max, MPa",
                    case=f"shift {case.lateral_shift_mm:+g} mm, {name}",
                    reference="cut planes where they are" if moved else "resolution fine",
                    kind="invariant",
                    value=float(row["p_max_fe_MPa"]),
                    expected=float(reference[0]["p_max_fe_MPa"]),
                    limit_percent=LIMIT_PERCENT if moved else RESOLUTION_PERCENT[str(case.resolution)],
                    uncertainty_percent=float(row["p_max_uncertainty_percent"]),
                )
            )
    return [*made, *discretisation_check(rows, DISCRETISATION_PERCENT)]


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
