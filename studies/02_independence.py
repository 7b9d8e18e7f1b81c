"""Do the cut planes, the element size and the nodes decide about the result?

60E1, 1:40, S1002, 100 kN, at a tread position (3 mm) and at the two-lobed one (0 mm): the cut planes moved out by half,
those of the rail's base, of both bodies' ends and of the rim, and three resolutions. Expected: a cut plane changes peak
pressure, area and half-widths by 0.1 to 0.2 % at most, the contribution of cut planes to the stated uncertainty.
The approach must grow with the bodies, and therefore has no stated uncertainty. The reference of a patch that is
no ellipse is the half-space under the true gap with three times the nodes: two lobes (-0.5 mm), a patch over a junction
(0.25 and 2.5 mm) and a thin tail (4 mm), whose area is the only thing that takes more than 32 nodes a semi-axis to some
1e-4.

Found: far meshes with two and a half times the unknowns change the peak by less than 0.09 %, and the approach by at
most 0.7 %. For two patches (MBench_UIC60, 5 mm, 50 kN), a fine mesh for each patch needs 431 thousand unknowns instead
of 630 thousand. Elements that are four times as long as wide reduce them to 293 thousand. Peaks and forces change by at
most 0.16 and 0.035 %. A narrow lobe needs no separate elements: 1.5 to 2.5 elements on its semi-axis give every measure
within 0.1 % of the measures with 6 elements (-0.5 and 5 mm). With the slide on steep surfaces, a round head in a round
groove has equal contacts at 0, 50 and 70 degrees (force within 5e-5, peak within 5e-4). Without the slide, 60E1 at 7 mm
and 50 kN carries 91 % of F / cos 70; with the slide it carries 99.5 %.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.case import BodySize, Case
from fecontact.judging.measures import UNCERTAINTIES, read_measures
from fecontact.regression.checks import Check, compare_discretisation
from fecontact.runs.identity import make_case_id
from fecontact.solving.expected_patch import find_expected_patch
from fecontact.solving.placing import place_case
from fecontact.solving.position import make_true_gap

RESOLUTION_PERCENT = {"standard": 0.2, "quick": 0.3}
MEASURES = {"p_max": "MPa", "area": "mm2", "a": "mm", "b": "mm"}
# Contribution of the cut planes to the stated uncertainty.
STATED_PERCENT = {m: 100.0 * UNCERTAINTIES[f"{m}_{unit}"].cut_planes for m, unit in MEASURES.items()}
# Hertz's gap on the half-space, with 32 nodes per semi-axis: 0.01 % is reached.
DISCRETISATION_PERCENT = 0.05
# A half-space with 32 nodes per semi-axis against one with 96. Peak, a and b reach 0.009, 0.01 and 0.007 %; the area
# reaches 0.13 % over a junction and 0.33 % with a thin tail.
NODES_PERCENT = {"p_max": 0.02, "area": 0.4, "a": 0.02, "b": 0.01}
MORE_NODES = 3
NODES_SHIFTS_MM = (2.5, -0.75, 0.25, 4.0)
CUTS = ("rail_depth_mm", "half_length_mm", "rim_thickness_mm")


def cases(quick: bool = False) -> list[Case]:
    """Base case and cases with moved cut planes at each position, then two more resolutions.

    At `quick` there are two cut planes, one position and no more resolutions.
    """
    case_list = []
    for shift in (3.0,) if quick else (3.0, 0.0):
        base = Case(lateral_shift_mm=shift, roll="given", refine="never")
        case_list.append(base)
        cuts = CUTS[:2] if quick else CUTS
        case_list += [replace(base, size=replace(BodySize(), **{cut: 1.5 * getattr(BodySize(), cut)})) for cut in cuts]
        if not quick:
            case_list += [replace(base, resolution="standard"), replace(base, resolution="fine")]
    return case_list


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Change of each measure by each cut plane, and by the resolution."""
    lines = []
    size = 6 if len(rows) > 3 else 3
    for start in range(0, len(rows), size):
        base, *changed_rows = rows[start : start + size]
        names = (*CUTS, "standard", "fine")
        for name, row in zip(names, changed_rows, strict=False):
            label = f"{name} times 1.5" if name in CUTS else f"resolution {name}"
            changes = ", ".join(
                f"{measure} {100.0 * (float(row[column]) / float(base[column]) - 1.0):+.3f} %"
                for measure, column in ((m, f"fe_{m}_{unit}") for m, unit in MEASURES.items())
            )
            lines.append(f"shift {base['lateral_shift_mm']:g} mm, {label}: {changes}")
    return "\n".join(lines)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of each measure against moved cut planes and the finest resolution."""
    by_case = {make_case_id(case): case for quick in (False, True) for case in cases(quick)}
    case_rows = [(by_case[row["id"]], row) for row in rows]
    measure_checks = []
    for case, row in case_rows:
        # a base case is compared with the finest mesh, a case with a moved cut plane with its base case
        moved_cuts = [cut for cut in CUTS if getattr(case.size, cut) != getattr(BodySize(), cut)]
        reference_case = replace(case, size=BodySize()) if moved_cuts else replace(case, resolution="fine")
        name = f"{moved_cuts[0]} times 1.5" if moved_cuts else str(case.resolution)
        reference_rows = [
            reference_row for row_case, reference_row in case_rows if row_case == reference_case and row_case != case
        ]
        if not reference_rows:
            continue
        measure_checks += [
            Check(
                quantity=f"{measure}, {unit}",
                case=f"shift {case.lateral_shift_mm:+g} mm, {name}",
                reference="cut planes where they are" if moved_cuts else "resolution fine",
                kind="invariant",
                value=float(row[f"fe_{measure}_{unit}"]),
                expected=float(reference_rows[0][f"fe_{measure}_{unit}"]),
                limit_percent=STATED_PERCENT[measure] if moved_cuts else RESOLUTION_PERCENT[str(case.resolution)],
                uncertainty_percent=float(row[f"hertz_uncertainty_{measure}_percent"]),
            )
            for measure, unit in MEASURES.items()
        ]
    return [
        *measure_checks,
        *_nodes_checks(quick=len(rows) <= len(cases(quick=True))),
        *compare_discretisation(rows, DISCRETISATION_PERCENT),
    ]


def _nodes_checks(quick: bool) -> list[Check]:
    """Checks of patches that are not ellipses, on half-spaces with more nodes.

    The reference has three times the nodes of the product.
    """
    node_checks = []
    for shift in NODES_SHIFTS_MM[: 1 if quick else None]:
        case = Case(lateral_shift_mm=shift, roll="given")
        true_gap = make_true_gap(case, place_case(case))
        measures, finer_measures = (
            read_measures(
                find_expected_patch(
                    true_gap, case.load_N, half=case.half, nodes=count * case.nodes_per_semi_axis
                ).half_space
            ).as_dict()
            for count in (1, MORE_NODES)
        )
        node_checks += [
            Check(
                quantity=f"{measure} on the half-space, {unit}",
                case=f"shift {shift:+g} mm",
                reference=f"half-space of {MORE_NODES * case.nodes_per_semi_axis} nodes a semi-axis",
                kind="invariant",
                value=measures[f"{measure}_{unit}"],
                expected=finer_measures[f"{measure}_{unit}"],
                limit_percent=NODES_PERCENT[measure],
            )
            for measure, unit in MEASURES.items()
        ]
    return node_checks


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
