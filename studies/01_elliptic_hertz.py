"""How accurate are the finite elements where Hertz's theory is exact?

Reference (analytic): Hertz's ellipse for a wheel cylinder of radius 460 mm on circular rail heads of radius 300, 80 and
13 mm and on a crossed cylinder of radius 460 mm (a circular patch), 100 kN, E 210 GPa, nu 0.3. Expected at `standard`:
peak pressure within 0.5 %, semi-axes within 1.5 %, area within 2 %, L2 of the pressure within 5 %; all falling with the
element size. The finite block itself raises the peak pressure by about 0.15 %.
"""

from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.regression.checks import Check, hertz_check

LIMITS_PERCENT = {"p_max": 0.5, "a": 1.5, "b": 1.5, "area": 2.0}
L2_LIMIT_PERCENT = 5.0


def cases(quick: bool = False) -> list[Case]:
    """Four radii at `standard`, and the first one at three resolutions; or R 300 alone, at `quick`."""
    if quick:
        return [_case(300, "quick")]
    return [*(_case(radius, "standard") for radius in (300, 80, 13, 460)), _case(300, "quick"), _case(300, "fine")]


def _case(radius_mm: int, resolution: str) -> Case:
    return Case(rail=f"circle:{radius_mm}", wheel="cylinder:460", inclination_rad=0.0, resolution=resolution)


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Largest deviation of each measure at `standard` against its limit."""
    standard = [row for row in rows if row["resolution"] == "standard"] or rows
    parts = []
    for name, limit in LIMITS_PERCENT.items():
        worst = max(abs(float(row[f"{name}_deviation_percent"])) for row in standard)
        parts.append(f"{name} {worst:.2f} % (limit {limit:g} %)")
    worst_l2 = max(float(row["pressure_l2_percent"]) for row in standard)
    parts.append(f"L2 {worst_l2:.1f} % (limit {L2_LIMIT_PERCENT:g} %)")
    return "Largest deviations from exact Hertz: " + ", ".join(parts) + "."


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Peak, semi-axes, area and L2 of the cases at `standard` and finer; a quick study is held to its own 1.5 times."""
    made = []
    for row in rows:
        slack = 1.0 if row["resolution"] != "quick" else 1.5
        where = f"{row['rail']}, {row['load_kN']:g} kN, {row['resolution']}"
        for name, limit in LIMITS_PERCENT.items():
            unit = {"p_max": "MPa", "area": "mm2"}.get(name, "mm")
            made.append(hertz_check(row, f"{name}_{unit}", where, slack * limit))
        made.append(
            Check(
                quantity="L2 of the pressure, %",
                case=where,
                reference="Hertz",
                kind="analytic",
                value=float(row["pressure_l2_percent"]),
                expected=None,
                limit_percent=L2_LIMIT_PERCENT,
            )
        )
    return made


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
