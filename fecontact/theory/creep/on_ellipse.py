"""Creep forces on an ellipse that is given by numbers, without any placement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.material import Material
from fecontact.theory.creep.contact import Creepages, CreepForce, RollingEllipse, friction_warnings
from fecontact.theory.creep.forces import creep_force, creep_forces, ellipse_patch


@dataclass(frozen=True, kw_only=True)
class EllipseForces:
    """Creep forces on an ellipse: of each theory its force, or why there is none, and what makes them doubtful."""

    contact: RollingEllipse
    creepages: Creepages
    forces: Mapping[str, CreepForce | str]
    warnings: tuple[str, ...]


def forces_on_ellipse(
    *,
    a_mm: float,
    b_mm: float,
    normal_force_N: float,
    friction: float,
    creepages: Creepages,
    young_MPa: float,
    poisson: float,
    theories: Sequence[str],
) -> EllipseForces:
    """Creep forces by some theories, or by `all` that cover the ellipse; both bodies are of one material.

    Raises
    ------
    InputError
        For values out of range, and if a theory that was named does not cover the ellipse or the creepages.
    """
    material = Material(name="both", young_MPa=young_MPa, poisson=poisson)
    contact = RollingEllipse(
        a_mm=a_mm,
        b_mm=b_mm,
        normal_force_N=normal_force_N,
        friction=friction,
        shear_MPa=material.shear_MPa,
        poisson=poisson,
    )
    patch = ellipse_patch(contact)
    forces: Mapping[str, CreepForce | str] = (
        creep_forces(patch, creepages)
        if list(theories) == ["all"]
        else {theory: creep_force(theory, patch, creepages) for theory in theories}
    )
    return EllipseForces(contact=contact, creepages=creepages, forces=forces, warnings=friction_warnings(friction))
