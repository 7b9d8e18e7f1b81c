"""What do the finite elements say by themselves, on their own nodes?

Verdicts use the pressure on finer nodes, where the response of the elements near by is replaced by the response of a
half-space of the same material. This study uses the contact on the elements' nodes alone, with 4, 9 and 13.5 elements
per semi-axis, and compares it with the contact on finer nodes and with Hertz.

Reference: the finer nodes, and Hertz where it is exact (R 300 and R 80 on a cylinder of R 460, 100 kN; limits as in
study 01, and what means over the elements around a node read). Expected: with more elements their own contact comes to
that of the finer nodes, inside the uncertainty that is stated for it, and where their own verdict is known it is that
of the finer nodes.

Found, largest (median) difference between the elements' nodes and the finer nodes in %, always within the stated
uncertainty: with 6 elements (17 places) peak 0.19 (0.08), area 6.8 (0.9), a 0.9 (0.7), b 0.6 (0.1); with 9 peak 0.76
(0.02), area 4.0 (0.5); with 13.5 (13 places) peak 0.20 (0.06), area 1.2 (0.3), a 0.12, b 0.07. Large differences of the
area come from thin tails, in which single nodes touch or do not touch. Half-widths converge with the power 2.7 and 2.8
of the element size, peak and area with 1.5 and 1.6. The four unresolved places are unresolved because of the area of a
thin tail. Means over elements give half-widths that are 5 / (12 n2) too long and peaks that are 1 / (6 n2) too low. The
stated uncertainty on the elements' nodes covers the error in 191 of 192 measures of 24 exact gaps; for the peak it is
seven times too large. CalculiX 2.20 on meshes of four elements (C3D8) has a largest nodal pressure that is below the
peak on the elements' nodes, which is interpolated between nodes, by 0.8 % at 3 mm and by 0.3 % at R 300; at 3 mm the
largest nodal pressures differ by 0.09 %. The check and the verdict on the elements' nodes take 0.4 to 0.9 % of the CPU
time. 20 elements were not run, because the time did not suffice.

Errors planted in the elements alone (tests/test_planted_errors.py): a modulus off by 3, 5 and 20 %, Poisson's ratio
0.25, mortar weights off by 3 % and a missing layer are seen by the compliance far from a pressure (limit 2 %, healthy
elements within 0.8 %), locking by it or by the elements' own contact, a misplaced body by a guard of the meshes, a
wrong sign of the gap by a patch that runs to the edge. Nothing sees less than 2 % of the compliance, a fault on the
coarser mesh alone, or a wrong shape of the bodies away from the contact.

The check takes the bodies' shape for quadratic. On a switch tongue of 20 mm healthy elements read 19 % too soft. A side
nearer than sixteen nodes together with a fit that leaves more than 0.2 % tells this from a fault: of 29 healthy
contacts each that reads 3 % or more has both, each that is right within 1.5 % has not. In vain: more terms of the
shape. With the fourth degree the tongue still reads 3.3 %, and a missing layer falls to less than half.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import RESOLUTIONS, Case
from fecontact.criteria import Criteria
from fecontact.judging.verdict import ANSWERS_BEST_FIRST, compare_with_limit
from fecontact.outputs.style import (
    SERIES_COLOURS,
    add_grid,
    add_legend_beside,
    blank_figure,
    save_figure,
    set_plain_log_scale,
)
from fecontact.regression.checks import Check

Row = dict[str, Any]

SHIFTS_MM = (-6.0, -4.0, -2.0, -1.0, -0.5, 0.0, 1.0, 3.0, 4.0)
# Cells of the README's map in which Hertz holds: loads are 10 % below the load at which Hertz fails there.
NEAR_LIMITS = ((-1.5, 95e3), (-1.0, 53e3), (2.5, 48e3), (3.0, 82e3), (3.5, 129e3), (4.5, 102e3))
EXACT = ("circle:300", "circle:80")
MEASURES = {"p_max_MPa": "peak", "area_mm2": "area", "a_mm": "a", "b_mm": "b"}
# Deviation of the bodies from Hertz, as in study 01; means over the elements around a node add to it.
BODIES_PERCENT = 0.5


def cases(quick: bool = False) -> list[Case]:
    """Nine positions, two exact contacts and six cells near limits at three resolutions.

    In quick size, one position and one exact contact at two resolutions. The coarsest resolution is first: an
    interrupted run has complete resolutions, and the same command resumes it.
    """
    chosen: list[dict[str, Any]] = [
        {"rail": rail, "wheel": "cylinder:460", "inclination_rad": 0.0} for rail in (EXACT[:1] if quick else EXACT)
    ]
    chosen += [{"lateral_shift_mm": shift, "roll": "given"} for shift in ((3.0,) if quick else SHIFTS_MM)]
    if not quick:
        chosen += [{"lateral_shift_mm": shift, "load_N": load, "roll": "touching"} for shift, load in NEAR_LIMITS]
    resolutions = ("quick", "standard") if quick else ("quick", "standard", "fine")
    return [Case(resolution=resolution, refine="never", **place) for resolution in resolutions for place in chosen]


def difference_percent(row: Row, measure: str) -> float:
    """Relative difference of the elements' contact from the contact on finer nodes."""
    return 100.0 * (float(row[f"elements_{measure}"]) / float(row[f"fe_{measure}"]) - 1.0)


def stated_percent(row: Row, measure: str) -> float:
    """Stated uncertainty of a measure of the elements' contact."""
    return float(row[f"elements_uncertainty_{measure.rsplit('_', 1)[0]}_percent"])


def find_verdict(row: Row, *, by_elements: bool) -> str:
    """Verdict by peak, area and half-widths, from the elements' contact or the finer nodes."""
    limits, answers = Criteria().limits, []
    for measure in MEASURES:
        name = measure.rsplit("_", 1)[0]
        if by_elements:
            deviation = float(row[f"hertz_{measure}"]) / float(row[f"elements_{measure}"]) - 1.0
            uncertainty = 0.01 * stated_percent(row, measure) * (1.0 + deviation)
        else:
            deviation = 0.01 * float(row[f"hertz_deviation_{name}_percent"])
            uncertainty = 0.01 * float(row[f"hertz_uncertainty_{name}_percent"])
        answers.append(compare_with_limit(deviation, uncertainty, limits[measure]))
    return max(answers, key=ANSWERS_BEST_FIRST.index)


def exact_percent(row: Row, measure: str) -> float:
    """Limit of a measure of the elements' contact against an exact contact.

    A nodal pressure is a mean over its hat, which has a variance of h^2 / 6 in each direction: with n elements a
    semi-axis the peak reads lower by 1 / (6 n^2), sqrt(5 <x^2>) longer by 5 / (12 n^2). Where the edge lies between
    nodes is a matter of chance.
    """
    if measure == "area_mm2":
        return stated_percent(row, measure)
    coefficient = 1.0 / 6.0 if measure == "p_max_MPa" else 5.0 / 12.0
    return BODIES_PERCENT + 100.0 * coefficient / RESOLUTIONS[row["resolution"]] ** 2


def conclude(rows: list[Row], out: Path) -> str:
    """Largest differences at each resolution, convergence rates and agreement of the verdicts."""
    figure(rows, out / "elements_alone.png")
    lines = ["Elements' own contact against the finer nodes: largest difference (stated), %"]
    for resolution in dict.fromkeys(row["resolution"] for row in rows):
        resolution_rows = [row for row in rows if row["resolution"] == resolution]
        parts = (
            f"{word} {max(abs(difference_percent(row, m)) for row in resolution_rows):.2f}"
            f" ({max(stated_percent(row, m) for row in resolution_rows):.2f})"
            for m, word in MEASURES.items()
        )
        lines.append(f"{resolution:9} {', '.join(parts)}")
    lines.append(
        "Rates over the element size, median: " + ", ".join(f"{w} {rate(rows, m):.1f}" for m, w in MEASURES.items())
    )
    finest = [place_rows[-1] for place_rows in places(rows)]
    decided_rows = [row for row in finest if find_verdict(row, by_elements=True) != "UNRESOLVED"]
    agreed = sum(find_verdict(row, by_elements=True) == find_verdict(row, by_elements=False) for row in decided_rows)
    lines.append(
        f"By peak, area and half-widths finite elements alone say the same in {agreed} of {len(decided_rows)}"
        f" places where they know it, of {len(finest)} in all."
    )
    return "\n".join(lines)


def rate(rows: Sequence[Row], measure: str) -> float:
    """Median convergence order of the difference to the finer nodes in the element size.

    The order is fitted between the first and the last mesh of each place.
    """
    powers = []
    for first, *_, last in (place_rows for place_rows in places(rows) if len(place_rows) > 1):
        finer = RESOLUTIONS[last["resolution"]] / RESOLUTIONS[first["resolution"]]
        differences = [max(abs(difference_percent(row, measure)), 1e-3) for row in (first, last)]
        powers.append(np.log(differences[0] / differences[1]) / np.log(finer))
    return float(np.median(powers))


def places(rows: Sequence[Row]) -> list[list[Row]]:
    """Rows grouped by place and load, from coarse to fine."""
    rows_by_place: dict[tuple[str, float, float], list[Row]] = {}
    for row in rows:
        key = (str(row["rail"]), float(row["lateral_shift_mm"]), float(row["load_kN"]))
        rows_by_place.setdefault(key, []).append(row)
    return list(rows_by_place.values())


def figure(rows: list[Row], path: Path) -> None:
    """Differences over the number of elements, a panel per measure."""
    picture = blank_figure(11.0, 3.4)
    axes = picture.subplots(1, len(MEASURES), sharey=True)
    for ax, (measure, word) in zip(axes, MEASURES.items(), strict=True):
        for number, place_rows in enumerate(places(rows)):
            count = [RESOLUTIONS[row["resolution"]] for row in place_rows]
            differences = [abs(difference_percent(row, measure)) for row in place_rows]
            ax.loglog(
                count,
                differences,
                marker="o",
                ms=4,
                lw=1,
                color=SERIES_COLOURS[number % len(SERIES_COLOURS)],
                label=(
                    f"{place_rows[0]['rail']} {float(place_rows[0]['lateral_shift_mm']):+g} mm,"
                    f" {float(place_rows[0]['load_kN']):g} kN"
                ),
            )
        ax.set_title(word)
        ax.set_xlabel("elements a semi-axis")
        set_plain_log_scale(ax)
    axes[0].set_ylabel("own nodes beside finer ones, %")
    add_grid(*axes)
    add_legend_beside(axes[-1])
    save_figure(picture, path)


def checks(rows: list[Row]) -> list[Check]:
    """Checks of the elements' contact against its stated uncertainty and against exact Hertz."""
    contact_checks = []
    for row in rows:
        where = (
            f"{row['rail']}, {float(row['lateral_shift_mm']):+g} mm, {float(row['load_kN']):g} kN, {row['resolution']}"
        )
        for measure, word in MEASURES.items():
            contact_checks.append(
                Check(
                    quantity=f"{word} of the elements' own contact, %",
                    case=where,
                    reference="finer nodes of the same bodies",
                    kind="invariant",
                    value=difference_percent(row, measure),
                    expected=None,
                    limit_percent=stated_percent(row, measure),
                )
            )
            if row["rail"] in EXACT:
                unit = measure.rsplit("_", 1)[1]
                contact_checks.append(
                    Check(
                        quantity=f"{word} of the elements' own contact, {unit}",
                        case=where,
                        reference="Hertz",
                        kind="analytic",
                        value=float(row[f"elements_{measure}"]),
                        expected=float(row[f"hertz_{measure}"]),
                        limit_percent=exact_percent(row, measure),
                        uncertainty_percent=stated_percent(row, measure),
                    )
                )
    return contact_checks


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
