"""Checks of solved contacts: their loads, and the correction of the elements on the finer nodes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from fecontact.contact.grid import Field, Rung
from fecontact.contact.solver import Compliance
from fecontact.judging.solved_load import Level
from fecontact.solving.true_gap import TrueGap

# Order of the differences that separate the opening of the elements, which follows the pressure from node to node, from
# the smooth opening of the bodies.
_DIFFERENCE_ORDER = 4


def compute_load_error(true_gap: TrueGap, load_N: float, rungs: Iterable[Rung]) -> float:
    """Largest difference between the loads of contacts and the load of the case.

    The load of a contact is the sum of its nodal pressures, each multiplied by the area of its node and by the cosine
    between the normal of its node and the direction of the load. The load that its solver was given is not used.

    Parameters
    ----------
    true_gap
        True gap with the direction of the load.
    load_N
        Load of the case in N.
    rungs
        Contacts under this load; at least one.

    Returns
    -------
    float
        Difference relative to the load of the case (-).
    """
    return max(abs(_compute_load_N(true_gap, rung) / load_N - 1.0) for rung in rungs)


def _compute_load_N(true_gap: TrueGap, rung: Rung) -> float:
    """Force in N of a contact along the load."""
    _, normals = true_gap.placement.surface(0.0, rung.grid.s_mm)
    forces_N = rung.pressure_MPa * rung.grid.whole_area_mm2().reshape(rung.grid.shape)
    return float((forces_N * (normals @ true_gap.direction)).sum())


def iterate_loaded_rungs(half_space: Rung, turned_rung: Rung | None, levels: Sequence[Level]) -> Iterator[Rung]:
    """Contacts of a solution that have the load of the case.

    Parameters
    ----------
    half_space, turned_rung
        True gap on a half-space, in a plane for each patch, and with a normal at each node. `turned_rung` is None for a
        single lobe.
    levels
        Mesh levels.

    Yields
    ------
    Rung
        Contact under the load of the case. Bodies that yield have a contact on the elements' nodes and on the finer
        nodes.
    """
    yield half_space
    if turned_rung is not None:
        yield turned_rung
    for level in levels:
        yield from level.rungs.values()
        if level.yielded is not None:
            yield from (level.yielded.fe, level.yielded.nodal)


def compute_correction_error(added: Field, pressure: Field, model: Compliance, half_space: Compliance) -> float:
    """Fraction of the elements' softness that is left in the opening for the finer nodes.

    The response of the bodies to a unit pressure, taken as equal at every node, opens more than a half-space by the
    softness of the elements and by the shape of the bodies. The opening for the finer nodes must contain the shape of
    the bodies alone, which is smooth. Fourth differences along the track remove smooth openings. The fraction is the
    least-squares factor between the fourth differences of both openings.

    Parameters
    ----------
    added
        Opening of the bodies minus opening of a half-space of elements, in mm, as in `TrueGap.solve`.
    pressure
        Pressure of the contact on the elements' nodes in MPa.
    model, half_space
        Compliance with the response of the bodies at every node, and compliance of a half-space on these nodes.

    Returns
    -------
    float
        0 for a right correction, 1 for a correction that is left out, -1 for a doubled correction (-).
    """
    nodal_pressure = pressure.values.ravel()
    uncorrected = Field.of_nodes(added.grid, model(nodal_pressure) - half_space(nodal_pressure))
    rough, rough_uncorrected = (
        np.diff(opening.values, n=_DIFFERENCE_ORDER, axis=0) for opening in (added, uncorrected)
    )
    return float((rough * rough_uncorrected).sum() / (rough_uncorrected**2).sum())
