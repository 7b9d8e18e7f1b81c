"""Rungs without a solution: a pressure with its attributes; and profile variants without smoothing."""

import numpy as np

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.contact_theories.hertz import hertz_from_hessian
from fecontact.judging.lines import ProfileVariants, VariantResult
from fecontact.judging.measures import MEASURES, MISFITS
from fecontact.judging.solved_load import Level, SolvedLoad
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.quadratic_gap import solve_quadratic_gap


def rung_with(grid: ContactGrid, pressure_MPa: np.ndarray, **changes: object) -> Rung:
    """A rung of a pressure (nx, ns) and the given attributes alone."""
    plain = {
        "gap_mm": np.zeros(grid.shape),
        "approach_mm": 0.1,
        "normal_force_N": float(grid.whole_area_mm2() @ pressure_MPa.ravel()),
        "status": "converged",
        "iterations": 1,
        "compliance_calls": 1,
        "contact_residual": 0.0,
        "penetration_residual": 0.0,
        "load_balance": 0.0,
    }
    return Rung(grid=grid, pressure_MPa=pressure_MPa, **{**plain, **changes})


def planted_lines(
    *factors: float, peaks: tuple[float, ...] = (), others: dict[str, float] | None = None, without: int = 0
) -> ProfileVariants:
    """Profile variants with planted deviations, and some variants that have no contact.

    On each, 1 + the deviation of Hertz in peak pressure is multiplied by a factor. `peaks` are the peaks of the
    half-space there, 1000 MPa if not given; `others` are factors of other theories.
    """
    deviation = dict.fromkeys((*MEASURES, *MISFITS), 0.0)

    def line(label: str, p_max_MPa: float, **factors_by_theory: float) -> VariantResult:
        deviations = {name: deviation | {"p_max_MPa": factor - 1.0} for name, factor in factors_by_theory.items()}
        return VariantResult(label=label, p_max_MPa=p_max_MPa, deviations=deviations)

    others = others or {}
    variants = [
        line(f"filter {k} mm", peak, hertz=factor, **others)
        for k, (factor, peak) in enumerate(zip(factors, peaks or (1e3,) * len(factors), strict=True), start=4)
    ]
    reference = line("own line", 1e3, hertz=1.0, **dict.fromkeys(others, 1.0))
    return ProfileVariants(
        own=reference, others=(*variants, *(VariantResult(label=f"noise {k}") for k in range(without)))
    )


def on_half_space(case: Case, placement: Placement, rung: Rung, unknowns: tuple[int, int] = (9, 9)) -> SolvedLoad:
    """A load with a half-space as its finite elements, equal on both meshes."""
    levels = tuple(
        Level(
            nodal=rung,
            fe=rung,
            otherwise=rung,
            compliance_error=0.0,
            degrees_of_freedom={"both": number},
            elements={},
            enlarged=0,
            at_edge=False,
        )
        for number in unknowns
    )
    hertz = hertz_from_hessian(
        placement.first.curvature.hessian,
        normal_force_N=rung.normal_force_N,
        contact_modulus_MPa=case.contact_modulus_MPa,
    )
    quadratic = solve_quadratic_gap(placement.first, hertz, half=case.half)
    return SolvedLoad(case=case, levels=levels, half_space=rung, quadratic=quadratic, lines=None)
