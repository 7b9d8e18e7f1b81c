"""Do the cut planes and the element size decide about the result?

60E1, 1:40, S1002, 100 kN, at a tread position (3 mm) and at the two-lobed one (0 mm): each of the four cut planes moved
out by half, and three resolutions. Expected: a cut plane changes the peak pressure by less than 0.3 %. The approach is
another matter: it grows with the bodies, as it must.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.meshing import BodySize

LIMIT_PERCENT = 0.3
CUTS = ("rail_depth_mm", "rail_half_length_mm", "rim_thickness_mm", "rim_half_length_mm")


def cases(quick: bool = False) -> list[Case]:
    """A base case and one case a cut plane at each position; then the other resolutions."""
    made = []
    for shift in (3.0,) if quick else (3.0, 0.0):
        base = Case(lateral_shift_mm=shift, resolution="quick" if quick else "standard")
        made.append(base)
        made += [replace(base, size=replace(BodySize(), **{cut: 1.5 * getattr(BodySize(), cut)})) for cut in CUTS]
        if not quick:
            made += [replace(base, resolution="quick"), replace(base, resolution="fine")]
    return made


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Change of the peak pressure by each cut plane, and by the resolution."""
    lines = []
    size = 5 if len(rows) == 5 else 7
    for start in range(0, len(rows), size):
        base, *others = rows[start : start + size]
        names = (*CUTS, "quick", "fine")
        for name, row in zip(names, others, strict=False):
            change = 100.0 * (float(row["p_max_fe_MPa"]) / float(base["p_max_fe_MPa"]) - 1.0)
            what = f"{name} times 1.5" if name in CUTS else f"resolution {name}"
            verdict = "" if name not in CUTS else " (ok)" if abs(change) < LIMIT_PERCENT else " (TOO MUCH)"
            lines.append(f"shift {base['lateral_shift_mm']:g} mm, {what}: peak pressure {change:+.3f} %{verdict}")
    return "\n".join(lines)


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
