"""Creep forces on an ellipse that is given by numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fecontact.bodies import STEEL, Material
from fecontact.contact_theories.rolling.creepage import Creepages, CreepForce, RollingEllipse, check_friction
from fecontact.criteria import Creep
from fecontact.features.creep.forces import calculate_creep_force, calculate_creep_forces, make_ellipse_patch
from fecontact.features.creep.telling import make_force_record
from fecontact.outputs.flat_records import Record, to_plain


def creep(
    *,
    a_mm: float,
    b_mm: float,
    normal_force_N: float,
    friction: float,
    creepages: tuple[float, float, float] = (0.0, 0.0, 0.0),
    young_MPa: float = STEEL.young_MPa,
    poisson: float = STEEL.poisson,
    theories: Sequence[str] = ("all",),
) -> Record:
    """Calculate creep forces on an ellipse by some theories, or by `all` that cover it.

    The theories are analytic; there is no mesh.

    Parameters
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    normal_force_N, friction
        Normal force, and coefficient of friction.
    creepages
        Longitudinal and lateral creepage of the wheel over the rolling speed, and spin in 1/mm.
    young_MPa, poisson
        Elastic constants of both bodies.
    theories
        Names of theories, or `all`.

    Returns
    -------
    dict
        Record with `contact`, `creepages`, `limit_N`, the forces by theory in `theories` (N, N mm, mm2) and `warnings`.

    Raises
    ------
    InputError
        For values out of range, and if a named theory does not cover the ellipse or the creepages.

    Examples
    --------
    >>> import fecontact
    >>> record = fecontact.creep(
    ...     a_mm=5.8, b_mm=8.5, normal_force_N=100e3, friction=0.3, creepages=(0.001, 0.0, 0.0), theories=["polach"]
    ... )
    >>> -record["limit_N"] < record["theories"]["polach"]["fx_N"] < 0.0
    True
    """
    xi, eta, spin = creepages
    # checks the ranges, which are those of a case
    Creep(friction=friction, xi=xi, eta=eta, spin_per_mm=spin)
    material = Material(young_MPa=young_MPa, poisson=poisson)
    contact = RollingEllipse(
        a_mm=a_mm,
        b_mm=b_mm,
        normal_force_N=normal_force_N,
        friction=friction,
        shear_MPa=material.shear_MPa,
        poisson=poisson,
    )
    patch, motion = make_ellipse_patch(contact), Creepages(xi=xi, eta=eta, spin_per_mm=spin)
    forces: Mapping[str, CreepForce | str] = (
        calculate_creep_forces(patch, motion)
        if list(theories) == ["all"]
        else {theory: calculate_creep_force(theory, patch, motion) for theory in theories}
    )
    return {
        "schema": "fecontact/creep/2",
        "contact": to_plain(contact),
        "creepages": to_plain(motion),
        "limit_N": contact.limit_N,
        "theories": {theory: make_force_record(force) for theory, force in forces.items()},
        "warnings": list(check_friction(friction)),
    }
