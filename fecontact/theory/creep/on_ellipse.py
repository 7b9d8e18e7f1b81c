"""Creep forces on an ellipse that is given by numbers, without any placement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.theory.creep.contact import Creepages, CreepForce, RollingEllipse, friction_warnings
from fecontact.theory.creep.forces import creep_force, creep_forces, ellipse_patch


@dataclass(frozen=True, kw_only=True)
class EllipseForces:
    """Creep forces on an ellipse: of each theory its force, or why there is none, and what makes them doubtful."""

    contact: RollingEllipse
    creepages: Creepages
    forces: Mapping[str, CreepForce | str]
    warnings: tuple[str, ...]


def forces_on_ellipse(contact: RollingEllipse, creepages: Creepages, theories: Sequence[str]) -> EllipseForces:
    """Creep forces by some theories, or by `all` that cover the ellipse.

    Raises
    ------
    InputError
        If a theory that was named does not cover the ellipse or the creepages.
    """
    patch = ellipse_patch(contact)
    forces: Mapping[str, CreepForce | str] = (
        creep_forces(patch, creepages)
        if list(theories) == ["all"]
        else {theory: creep_force(theory, patch, creepages) for theory in theories}
    )
    warnings = friction_warnings(contact.friction)
    return EllipseForces(contact=contact, creepages=creepages, forces=forces, warnings=warnings)
