"""The command `fecontact creep`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from cyclopts import Parameter

from fecontact.bodies import STEEL
from fecontact.outputs.terminal import print_answer


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class EllipseOptions:
    """An ellipse that rolls.

    Attributes
    ----------
    a_mm
        Semi-axis along the rolling direction in mm.
    b_mm
        Semi-axis across in mm.
    normal_force_kn
        Normal force in kN.
    friction
        Coefficient of friction, > 0.
    xi
        Longitudinal creepage, relative to the rolling speed.
    eta
        Lateral creepage, relative to the rolling speed.
    spin_per_mm
        Spin in 1/mm.
    young_mpa
        Young's modulus of both bodies in MPa.
    poisson
        Poisson's ratio of both bodies.
    """

    a_mm: float
    b_mm: float
    normal_force_kn: float
    friction: float
    xi: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    eta: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    spin_per_mm: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    young_mpa: float = STEEL.young_MPa
    poisson: float = STEEL.poisson


def creep(ellipse: EllipseOptions, *, theory: str = "all", json: bool = False) -> int:
    """Creep forces on a contact ellipse by each theory (no mesh).

    The forces act on the wheel: x in the running direction, y to the field side, z up for the left wheel. Creepages are
    velocities of the wheel relative to the rail: if xi is positive, Fx is negative.

    Parameters
    ----------
    theory
        Theories, separated by commas, or all: kalker, vermeulen_johnson, she, polach, fastsim, rolling_half_space.
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.features.creep.running import creep as ellipse_forces
    from fecontact.features.creep.telling import report_ellipse_forces

    record = ellipse_forces(
        a_mm=ellipse.a_mm,
        b_mm=ellipse.b_mm,
        normal_force_N=1e3 * ellipse.normal_force_kn,
        friction=ellipse.friction,
        creepages=(ellipse.xi, ellipse.eta, ellipse.spin_per_mm),
        young_MPa=ellipse.young_mpa,
        poisson=ellipse.poisson,
        theories=theory.split(","),
    )
    print_answer(record, report_ellipse_forces, json=json)
    return 0
