"""Meshes of a case for other programs: a single body, or both bodies with their load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.memory import check_memory
from fecontact.fe.meshing import FineZone, estimate_least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.packages import require_finite_elements
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.element_sizes import choose_element_size_mm
from fecontact.solving.fine_zone import make_fine_zone
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshedPair:
    """Both bodies of a case on the first meshes of `solve`.

    Attributes
    ----------
    case
        Case of the bodies.
    rail, wheel
        Meshes of rail and wheel.
    direction : ndarray of shape (3,)
        Unit vector against which the wheel is pushed: upwards, or the contact normal at first contact.
    approach_mm
        Displacement of the wheel along the direction under the load of the case, if both bodies were half-spaces.
    """

    case: Case
    rail: BodyMesh
    wheel: BodyMesh
    direction: NDArray[np.float64]
    approach_mm: float


def mesh_case(case: Case, body: Literal["rail", "wheel"]) -> BodyMesh:
    """Mesh a single body of a case, without solving it.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    body
        `rail` or `wheel`.

    Returns
    -------
    BodyMesh
        First mesh of `solve` for this body.

    Raises
    ------
    InputError
        As in `solve`.
    """
    placement = place_case(case)
    zone, _ = _expect_fine_zone(case, placement)
    make_mesh = rail_mesh if body == "rail" else wheel_mesh
    return make_mesh(placement, zone, half=case.half, size=case.size)


def mesh_pair(case: Case) -> MeshedPair:
    """Mesh both bodies of a case, without solving it.

    Parameters
    ----------
    case
        Case with profiles, position and load.

    Returns
    -------
    MeshedPair
        First meshes of `solve`, with direction and approach in mm.

    Raises
    ------
    InputError
        As in `solve`.
    """
    placement = place_case(case)
    zone, approach_mm = _expect_fine_zone(case, placement)
    direction = placement.load_direction(normal=case.load_kind == "normal")
    return MeshedPair(
        case=case,
        rail=rail_mesh(placement, zone, half=case.half, size=case.size),
        wheel=wheel_mesh(placement, zone, half=case.half, size=case.size),
        direction=direction,
        # The approach of the half-space is the component along the normal.
        approach_mm=approach_mm / float(direction @ placement.first.normal),
    )


def _expect_fine_zone(case: Case, placement: Placement) -> tuple[FineZone, float]:
    """Fine zone of the first meshes of a case, and the half-space's normal approach (mm)."""
    require_finite_elements()
    _, expected = expect_on_half_space(case, placement)
    zone = make_fine_zone(expected, choose_element_size_mm(case, expected))
    check_memory(
        estimate_least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements"
    )
    return zone, expected.half_space.approach_mm
