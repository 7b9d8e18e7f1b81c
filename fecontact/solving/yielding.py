"""The rung of bodies that yield: the climb from first yield to a load, read on the nodes of the elastic rungs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fecontact.comparison.measures import MEASURES, measures_of
from fecontact.comparison.yielded import YIELD_BAND, PathPoint, Yielded, YieldedBody
from fecontact.contact.rung import Rung
from fecontact.contact.solver import ContactSolution
from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import CORNER_SIGNS, BodyMesh
from fecontact.fe.plasticity import PlasticState, PlasticZone
from fecontact.fe.stress import mean_at_nodes, nodal_stress, von_mises
from fecontact.fe.stress_peak import stress_peak
from fecontact.solving.plastic_contact import STEPS, PlasticContact, YieldingBodies

Floats = NDArray[np.float64]
# A contact, elastic or not, under a load: its rungs on the elements' own nodes and on finer ones.
Read = Callable[[ContactSolution, float], tuple[Rung, Rung]]

# Of tensors (3, 3) in the order of stresses.
_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Climb:
    """What came of bodies that may yield: the rung, and the contact behind it, None where nothing yields."""

    yielded: Yielded
    contact: PlasticContact | None


def climb(
    bodies: YieldingBodies,
    elastic: tuple[ContactSolution, Rung, Rung],
    load_N: float,
    read: Read,
    *,
    sparing: bool,
) -> Climb:
    """Load bodies up to a load; not converged where the climb does not reach it, or first yield was not found.

    Parameters
    ----------
    elastic
        The elastic solution under that load, and its rungs on the elements' own nodes and on finer ones.
    sparing
        Leaves out what is known from one mesh alone: the path, half as many steps, other yield stresses.
    """
    solution, nodal, fe = elastic
    loaded = bodies.virgin(load_N, solution)
    if max(bodies.yield_used(loaded)) <= 1.0:
        found = Yielded(fe=fe, nodal=nodal, bodies=_bodies(bodies, loaded, loaded, None), by_band={})
        return Climb(yielded=found, contact=None)
    start = bodies.first_yield(loaded)
    way = bodies.climb(start, load_N)
    last = way[-1]
    on_nodes, on_finer = read(last.solution, load_N)
    if not _arrived(bodies, last) or not bodies.is_first_yield(start):
        on_nodes = replace(on_nodes, status="not converged")
    found = Yielded(
        fe=on_finer,
        nodal=on_nodes,
        bodies=_bodies(bodies, start, loaded, last),
        path=() if sparing else _path(bodies, way, (fe, on_finer), read),
        fewer_steps=None,
        by_band={},
        imprint_mm=float(bodies.imprint(last).max()),
    )
    return Climb(yielded=found, contact=last)


def with_variants(
    climbed: Climb,
    bodies: YieldingBodies,
    elastic: tuple[ContactSolution, Rung, Rung],
    load_N: float,
    read: Read,
) -> Climb:
    """The same with half as many steps and with other yield stresses, which coarse meshes tell well enough.

    Not converged where one of these does not reach the load: what is stated hangs on them.
    """
    if climbed.contact is None:
        return climbed
    solution, _, fe = elastic
    found: dict[float, Rung] = {}
    nodal = climbed.yielded.nodal
    for factor in (1.0, 1.0 - YIELD_BAND, 1.0 + YIELD_BAND):
        other = bodies.with_yield(factor)
        loaded = other.virgin(load_N, solution)
        if max(other.yield_used(loaded)) <= 1.0:
            found[factor] = fe
            continue
        way = other.climb(other.first_yield(loaded), load_N, STEPS // 2)
        found[factor] = read(way[-1].solution, load_N)[1]
        if not _arrived(other, way[-1]):
            nodal = replace(nodal, status="not converged")
    names = {1.0 - YIELD_BAND: "lower", 1.0: "given", 1.0 + YIELD_BAND: "higher"}
    return replace(
        climbed,
        yielded=replace(
            climbed.yielded,
            nodal=nodal,
            fewer_steps=found[1.0],
            by_band={names[factor]: _steps(fe, rung) for factor, rung in found.items()},
        ),
    )


def _arrived(bodies: YieldingBodies, last: PlasticContact) -> bool:
    """Whether a climb, which ends with the first contact that is not found, came to its load and is well there."""
    return last.solution.status == "converged" and bodies.holds(last)


def _path(
    bodies: YieldingBodies, way: Sequence[PlasticContact], last: tuple[Rung, Rung], read: Read
) -> tuple[PathPoint, ...]:
    """Every load of the way beside elastic bodies under it; `last` has the rungs of both under the last."""
    points = []
    for one in way:
        pair = last
        if one is not way[-1]:
            elastic = bodies.elastic(one.load_N, one.solution.pressure_MPa).solution
            pair = (read(elastic, one.load_N)[1], read(one.solution, one.load_N)[1])
        points.append(
            PathPoint(
                load_N=one.load_N,
                steps=_steps(*pair),
                largest_strain=max(float(state.equivalent.max(initial=0.0)) for state in one.states),
                corrections=one.corrections,
                change=one.change,
            )
        )
    return tuple(points)


def _steps(elastic: Rung, plastic: Rung) -> dict[str, float]:
    before, after = measures_of(elastic).as_dict(), measures_of(plastic).as_dict()
    return {name: after[name] / before[name] - 1.0 for name in MEASURES}


def _bodies(
    bodies: YieldingBodies, start: PlasticContact, loaded: PlasticContact, last: PlasticContact | None
) -> dict[str, YieldedBody]:
    """Of each body that may yield: first yield from elastic contacts near it and under the load, then the last.

    The points that flow tell first yield. Stress at the nodes is a mean of the elements around, which sees too little
    of a patch that is narrow beside them; it serves where a body is so far from yield that no points may flow.
    """
    found: dict[str, YieldedBody] = {}
    power, at_points = _power(bodies, start, loaded), bodies.yield_used(start)
    for k, body in enumerate((bodies.coupled.rail, bodies.coupled.wheel)):
        law = bodies.zones[k].law
        if math.isinf(law.yield_MPa):
            continue
        used = at_points[k] or stress_peak(body, start.displacements_mm[k]).von_mises_MPa / law.yield_MPa
        one = YieldedBody(
            yield_MPa=law.yield_MPa,
            tangent_MPa=body.material.tangent_MPa,
            first_yield_N=start.load_N * used ** (-1.0 / power),
        )
        found[body.mesh.name] = one if last is None else _extent(one, body.mesh, bodies.zones[k], last.states[k])
    return found


def _power(bodies: YieldingBodies, start: PlasticContact, loaded: PlasticContact) -> float:
    """The power of the load with which stress rises from first yield on; a third, as below ellipses, where none is."""
    if start is loaded:
        return 1.0 / 3.0
    rises = max(bodies.yield_used(loaded)) / max(bodies.yield_used(start))
    return math.log(rises) / math.log(loaded.load_N / start.load_N)


def _extent(one: YieldedBody, mesh: BodyMesh, zone: PlasticZone, state: PlasticState) -> YieldedBody:
    """Where a body has yielded, at Gauss points."""
    strain = state.equivalent.ravel()
    flowed = strain > 0.0
    if not np.any(flowed):
        return one
    values = np.prod(1.0 + CORNER_SIGNS[:, None, :] * CORNER_SIGNS[None] / np.sqrt(3.0), axis=2) / 8.0
    points = np.einsum("gc,mcd->mgd", values, mesh.points[zone.nodes]).reshape(-1, 3)[flowed]
    # down from the surface along the block's lines
    top, below = (mesh.points[mesh.block_nodes[..., layer].ravel()] for layer in (0, 1))
    inward = (below - top) / np.linalg.norm(below - top, axis=1, keepdims=True)
    _, nearest = cKDTree(top).query(points)
    depth = np.einsum("nd,nd->n", points - top[nearest], inward[nearest])
    most = int(np.argmax(strain[flowed]))
    return replace(
        one,
        largest_strain=float(strain.max()),
        x_mm=float(points[most, 0]),
        y_mm=float(points[most, 1]),
        depth_mm=float(depth[most]),
        top_mm=float(depth.min()),
        bottom_mm=float(depth.max()),
        volume_mm3=(2.0 if mesh.half else 1.0) * float(zone.volumes_mm3.ravel()[flowed].sum()),
    )


def nodal_fields(bodies: YieldingBodies, contact: PlasticContact) -> Mapping[str, Mapping[str, Floats]]:
    """Arrays at the nodes of each body that may yield.

    `equivalent_plastic_strain` (n,), `von_mises_plastic_MPa` (n,) under the load, `imprint_mm` (n, 3): displacements
    that stay without it, base and driver held.
    """
    found: dict[str, Mapping[str, Floats]] = {}
    alone = bodies.unloaded(contact)
    for k, body in enumerate((bodies.coupled.rail, bodies.coupled.wheel)):
        zone, state = bodies.zones[k], contact.states[k]
        if not math.isinf(zone.law.yield_MPa):
            found[body.mesh.name] = _fields(body, zone, state, contact.displacements_mm[k]) | {"imprint_mm": alone[k]}
    return found


def _fields(body: ElasticBody, zone: PlasticZone, state: PlasticState, displacements: Floats) -> dict[str, Floats]:
    cells = len(body.mesh.hexes)
    equivalent, relaxed = np.zeros((cells, 8, 1)), np.zeros((cells, 8, 6))
    equivalent[zone.elements, :, 0] = state.equivalent
    for column, (i, j) in enumerate(_ORDER):
        relaxed[zone.elements, :, column] = 2.0 * zone.law.shear_MPa * state.strain[..., i, j]
    return {
        "equivalent_plastic_strain": mean_at_nodes(body.mesh, equivalent)[:, 0],
        "von_mises_plastic_MPa": von_mises(nodal_stress(body, displacements, relaxed)),
    }
