"""How accurate are the finite elements where Hertz's theory is exact?

Reference (analytic): Hertz's ellipse for a wheel cylinder of radius 460 mm on circular rail heads of radius 300, 80 and
13 mm and on a crossed cylinder of radius 460 mm (a circular patch), 100 kN, E 210 GPa, nu 0.3. Expected at every
resolution: peak pressure, area and half-widths within 0.5 %, the misplaced load and the L2 of the pressure within 0.5
and 2 %. Meshes do not limit this: cut and curved bodies are not half-spaces. A block of 60 mm raises
the peak by 0.2 to 0.4 %; the head of R 13 is thirteen of its semi-axes across and widens the patch by 1 %.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.regression.checks import Check, compare_with_hertz

LIMITS_PERCENT = {"p_max": 0.5, "a": 0.5, "b": 0.5, "area": 0.5}
# Limits for a head that is narrow compared with its patch, see above.
NARROW_PERCENT = {"p_max": 0.5, "a": 0.6, "b": 1.2, "area": 1.0}
NARROW = "circle:13"
NARROW_REASON = "the head of R 13 is only thirteen semi-axes wide, and Hertz's is a half-space"
L2_LIMIT_PERCENT = 2.0
NARROW_L2_PERCENT = 3.0


def cases(quick: bool = False) -> list[Case]:
    """Cases with four radii at `quick`, and R 300 at three resolutions; or R 300 alone."""
    if quick:
        return [_case(300, "quick")]
    return [*(_case(radius, "quick") for radius in (300, 80, 13, 460)), _case(300, "standard"), _case(300, "fine")]


def _case(radius_mm: int, resolution: str) -> Case:
    return Case(rail=f"circle:{radius_mm}", wheel="cylinder:460", inclination_rad=0.0, resolution=resolution)


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Largest deviation of each measure and its limit, separately for the narrow head."""
    lines = []
    for heading, narrow, limits, l2 in (
        ("Largest deviations from Hertz", False, LIMITS_PERCENT, L2_LIMIT_PERCENT),
        ("On the narrow head", True, NARROW_PERCENT, NARROW_L2_PERCENT),
    ):
        head_rows = [row for row in rows if (row["rail"] == NARROW) == narrow]
        if head_rows:
            worst = {
                name: max(abs(float(row[f"hertz_deviation_{name}_percent"])) for row in head_rows) for name in limits
            }
            parts = [f"{name} {worst[name]:.2f} % (limit {limit:g} %)" for name, limit in limits.items()]
            worst_l2 = max(1e2 * float(row["pressure_l2"]) for row in head_rows)
            lines.append(f"{heading}: {', '.join(parts)}, L2 {worst_l2:.1f} % (limit {l2:g} %).")
    return "\n".join(lines)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of peak, half-widths, area and L2 of all cases."""
    check_list = []
    for row in rows:
        narrow = row["rail"] == NARROW
        where = f"{row['rail']}, {row['load_kN']:g} kN, {row['resolution']}"
        for name, limit in (NARROW_PERCENT if narrow else LIMITS_PERCENT).items():
            unit = {"p_max": "MPa", "area": "mm2"}.get(name, "mm")
            checked = compare_with_hertz(row, f"{name}_{unit}", where, limit)
            check_list.append(replace(checked, explanation=NARROW_REASON if narrow else ""))
        check_list.append(
            Check(
                quantity="L2 of the pressure, %",
                case=where,
                reference="Hertz",
                kind="analytic",
                value=1e2 * float(row["pressure_l2"]),
                expected=None,
                limit_percent=NARROW_L2_PERCENT if narrow else L2_LIMIT_PERCENT,
            )
        )
    return check_list


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
