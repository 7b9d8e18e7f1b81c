"""Contact of bodies that yield: pressure and plastic strain found together, on the elastic factors.

The load rises from first yield in steps. In each step pressure and plastic strain are corrected together until neither
changes: the bodies answer both through their elastic stiffness, the pressure follows from a model of their compliance
as in `contact.solver`, and the plastic strain from the law of the material.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from fecontact.arrays import Floats
from fecontact.contact.grid import Rung
from fecontact.contact.solver import (
    Compliance,
    ContactProblem,
    ContactSolution,
    mixture,
    solve_by_correction,
    solve_contact,
)
from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import CORNER_SIGNS, BodyMesh
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.stress import (
    PlasticLaw,
    PlasticState,
    PlasticZone,
    mean_at_nodes,
    nodal_stress,
    stress_peak,
    von_mises,
)
from fecontact.judging.measures import MEASURES, measures_of
from fecontact.judging.yielded import YIELD_BAND, PathPoint, Yielded, YieldedBody

# Arrays of rail and wheel; a body without a yield stress has no elements that may yield, and arrays without rows.
Pair = tuple[Floats, ...]

STEPS = 4
"""Load steps from first yield to the load; with half of them the peak moves by 1 % at 2.5 times the yield stress."""
# Relative change of pressure and plastic strain by the last correction: the peak is then within 5e-5.
TOLERANCE = 1e-4
# Of the linear solutions of a correction, as a part of the forces: nearly always one step from the last solutions
# leaves less, and the peak moves by 2e-11.
_LINEAR_TOLERANCE = 1e-6
_MOST_CORRECTIONS = 60
_DEPTH = 6
# Elements may yield if their elastic stress exceeds this part of the yield stress: yielding elements shed stress to
# their neighbours.
_MAY_YIELD = 0.4
# The climb begins with the largest stress at the Gauss points at this part of the yield stress.
_BELOW_YIELD = 0.95
# Tolerance of elastic solutions on the way, of which only peak stress and pressure are used.
_ON_THE_WAY = 1e-5
_SEARCHES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticContact:
    """A contact between bodies that have yielded, under one load of the climb.

    Attributes
    ----------
    states
        Plastic state in the zones of rail and wheel.
    strains
        Total strains in the zones.
    displacements_mm
        Displacements (n, 3) of all nodes of rail and wheel.
    corrections
        Number of corrections; each costs a back-substitution for each body.
    change
        Relative change of pressure and plastic strain by the last correction.
    """

    load_N: float
    solution: ContactSolution
    states: tuple[PlasticState, ...]
    strains: Pair
    displacements_mm: Pair
    corrections: int = 0
    change: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class YieldingBodies:
    """Two coupled bodies, of which one or both may yield, and the contact between them.

    Attributes
    ----------
    zones
        Elements of rail and wheel that may yield.
    """

    coupled: CoupledBodies
    problem: ContactProblem
    model: Compliance
    zones: tuple[PlasticZone, ...]

    @classmethod
    def of(
        cls, coupled: CoupledBodies, problem: ContactProblem, model: Compliance, pressure_MPa: Floats
    ) -> YieldingBodies:
        """Bodies with zones of the elements that may yield up to the load of an elastic pressure (n,)."""
        displacements = coupled.displacements(pressure_MPa, tolerance=_LINEAR_TOLERANCE)
        zones = (_zone(body, u) for body, u in zip((coupled.rail, coupled.wheel), displacements, strict=True))
        return cls(coupled=coupled, problem=problem, model=model, zones=tuple(zones))

    def with_yield(self, factor: float) -> YieldingBodies:
        """The bodies with yield stresses multiplied by a factor."""
        zones = (replace(zone, law=replace(zone.law, yield_MPa=factor * zone.law.yield_MPa)) for zone in self.zones)
        return replace(self, zones=tuple(zones))

    def elastic(self, load_N: float, start_MPa: Floats) -> PlasticContact:
        """The elastic contact under a load, for pressure and stresses on the way."""
        return self.virgin(
            load_N,
            solve_by_correction(self.problem, load_N, self.model, start_MPa=start_MPa, tolerance=_ON_THE_WAY),
        )

    def virgin(self, load_N: float, solution: ContactSolution) -> PlasticContact:
        """An elastic solution as a contact without plastic strain."""
        u = self.coupled.displacements(solution.pressure_MPa, tolerance=_LINEAR_TOLERANCE)
        states = tuple(zone.none() for zone in self.zones)
        return PlasticContact(
            load_N=load_N, solution=solution, states=states, strains=self._strains(u), displacements_mm=u
        )

    def yield_used(self, contact: PlasticContact) -> tuple[float, ...]:
        """Largest von Mises stress over yield stress at a Gauss point of rail and of wheel; 0 without yield stress."""
        return tuple(
            float(zone.law.von_mises(strains, state).max(initial=0.0)) / zone.law.yield_MPa
            for zone, strains, state in zip(self.zones, contact.strains, contact.states, strict=True)
        )

    def first_yield(self, loaded: PlasticContact) -> PlasticContact:
        """The elastic contact just below first yield, from a contact under a larger load, by secants of the logarithms.

        If the search fails, the last contact is returned, and `_arrived` is false for a climb from it.
        """
        power, before, here = 1.0 / 3.0, None, loaded
        for _ in range(_SEARCHES):
            used = max(self.yield_used(here))
            if before is not None:
                power = math.log(used / before[1]) / math.log(here.load_N / before[0])
            if before is not None and _is_below_yield(used):
                break
            before = (here.load_N, used)
            load_N = here.load_N * (_BELOW_YIELD / used) ** (1.0 / power)
            here = self.elastic(load_N, here.solution.pressure_MPa)
        return here

    def climb(self, start: PlasticContact, load_N: float, steps: int = STEPS) -> list[PlasticContact]:
        """Contacts under loads that rise in equal steps from a start to a load, without the start."""
        contacts = [start]
        for next_N in np.linspace(start.load_N, load_N, steps + 1)[1:]:
            contacts.append(self._step(contacts[-1], float(next_N)))
            if contacts[-1].solution.status != "converged":
                break
        return contacts[1:]

    def unloaded(self, contact: PlasticContact) -> Pair:
        """Displacements (nodes, 3) in mm of both bodies by their plastic strain alone, without load."""
        forces = self._forces(_strains_of(contact.states))
        return self.coupled.displacements(np.zeros_like(contact.solution.pressure_MPa), forces)

    def holds(self, contact: PlasticContact) -> bool:
        """Whether nothing yields outside the zones, and no pressure reaches the edge of the pressure nodes."""
        pressure = contact.solution.pressure_MPa.reshape(self.coupled.grid.shape)
        at_edge = bool(pressure[-1].any() or pressure[:, [0, -1]].any())
        if not self.coupled.grid.half:
            at_edge = at_edge or bool(pressure[0].any())
        meshes = (self.coupled.rail.mesh, self.coupled.wheel.mesh)
        return not at_edge and not any(
            _yields_beside(zone, mesh, u)
            for zone, mesh, u in zip(self.zones, meshes, contact.displacements_mm, strict=True)
        )

    def _step(self, start: PlasticContact, load_N: float) -> PlasticContact:
        """The contact under another load, from the plastic state of a contact."""
        coupled, cheap = self.coupled, replace(self.problem, compliance=self.model, within=None)
        packing = self._packing(start.solution.pressure_MPa)
        p = start.solution.pressure_MPa * (load_N / start.load_N)
        plastic = _strains_of(start.states)
        solved: list[Floats] = []
        changes: list[Floats] = []
        corrections = 0
        while True:
            corrections += 1
            u = coupled.displacements(p, self._forces(plastic), tolerance=_LINEAR_TOLERANCE)
            opening = coupled.opening(*u)
            inner = replace(cheap, gap_mm=self.problem.gap_mm + opening - self.model(p))
            solution = solve_contact(inner, load_N, start_MPa=p, tolerance=0.01 * TOLERANCE)
            strains = self._strains(u)
            states = self._flow(start, strains)
            # input and output of this correction
            old = packing.pack(p, plastic)
            new = packing.pack(solution.pressure_MPa, _strains_of(states))
            change = packing.change(old, new)
            done = change < TOLERANCE
            if done or corrections == _MOST_CORRECTIONS:
                return PlasticContact(
                    load_N=load_N,
                    solution=replace(solution, status="converged" if done else "not converged"),
                    states=states,
                    strains=strains,
                    displacements_mm=u,
                    corrections=corrections,
                    change=change,
                )
            solved, changes = [*solved, new][-_DEPTH - 1 :], [*changes, new - old][-_DEPTH - 1 :]
            p, plastic = packing.unpack(mixture(solved, changes))
            p = np.maximum(p, 0.0)
            p = p * (load_N / self.problem.load_N(p))

    def _forces(self, plastic: Pair) -> Pair:
        return tuple(zone.forces(strain) for zone, strain in zip(self.zones, plastic, strict=True))

    def _strains(self, displacements: Pair) -> Pair:
        return tuple(zone.strains(u) for zone, u in zip(self.zones, displacements, strict=True))

    def _flow(self, start: PlasticContact, strains: Pair) -> tuple[PlasticState, ...]:
        return tuple(
            zone.law.flow(first, last, state)
            for zone, first, last, state in zip(self.zones, start.strains, strains, start.states, strict=True)
        )

    def _packing(self, pressure: Floats) -> _Packing:
        """Weights that turn pressures and plastic strains into energies; both are of the whole contact."""
        unit = np.zeros_like(pressure)
        highest = int(np.argmax(pressure))
        unit[highest] = 1.0
        both = math.sqrt(2.0) if self.coupled.grid.half else 1.0
        return _Packing(
            pressure=np.sqrt(self.problem.area_mm2 * float(self.model(unit)[highest])),
            plastic=tuple(both * zone.weights for zone in self.zones),
        )


def _is_below_yield(used: float) -> bool:
    return _BELOW_YIELD**2 < used <= 1.0


def _zone(body: ElasticBody, displacements: Floats) -> PlasticZone:
    """Elements of a body that may yield, from displacements (n, 3) of the elastic body."""
    law = PlasticLaw.of(body.material)
    whole = PlasticZone.of(body.mesh, law, np.arange(len(body.mesh.hexes)))
    stress = law.von_mises(whole.strains(displacements), whole.none()).max(axis=1)
    return whole.part(stress > _MAY_YIELD * law.yield_MPa)


def _yields_beside(zone: PlasticZone, mesh: BodyMesh, displacements: Floats) -> bool:
    """Whether elements outside a zone yield."""
    beside = np.setdiff1d(np.arange(len(mesh.hexes)), zone.elements)
    others = PlasticZone.of(mesh, zone.law, beside)
    stress = zone.law.von_mises(others.strains(displacements), others.none())
    return bool(np.any(stress > zone.law.yield_MPa))


def _strains_of(states: tuple[PlasticState, ...]) -> Pair:
    return tuple(state.strain for state in states)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Packing:
    """Pressure (n,) and plastic strain of both bodies as one vector, each with its weights."""

    pressure: Floats
    plastic: Pair

    def pack(self, pressure: Floats, plastic: Pair) -> Floats:
        strains = ((weight * strain).ravel() for weight, strain in zip(self.plastic, plastic, strict=True))
        return np.concatenate([self.pressure * pressure, *strains])

    def unpack(self, vector: Floats) -> tuple[Floats, Pair]:
        start = self.pressure.size
        middle = start + 9 * self.plastic[0].size
        plastic = (
            part.reshape(*weight.shape[:2], 3, 3) / weight
            for part, weight in zip((vector[start:middle], vector[middle:]), self.plastic, strict=True)
        )
        return vector[:start] / self.pressure, tuple(plastic)

    def change(self, old: Floats, new: Floats) -> float:
        """Relative change of the pressure, to its peak, or of the plastic strain, in energy; the larger of both."""
        n = self.pressure.size
        p, q = old[:n] / self.pressure, new[:n] / self.pressure
        size = float(np.linalg.norm(new[n:]))
        of_strain = float(np.linalg.norm(new[n:] - old[n:])) / size if size > 0.0 else 0.0
        return max(float(np.abs(q - p).max() / q.max()), of_strain)


# --- The rung of bodies that yield: the climb from first yield to a load, read on the nodes of the elastic rungs.

# Reads a contact, elastic or not, under a load: its rungs on the elements' nodes and on finer nodes.
Read = Callable[[ContactSolution, float], tuple[Rung, Rung]]

# Indices of tensors (3, 3) in the order of stresses.
_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Climb:
    """Outcome for bodies that may yield: the rung and its contact; None if nothing yields."""

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
    """Load bodies up to a load; not converged if the climb does not reach it, or first yield was not found.

    Parameters
    ----------
    elastic
        The elastic solution under this load, and its rungs on the elements' nodes and on finer nodes.
    sparing
        Leaves out what is computed on a single mesh only: the path, half as many steps, other yield stresses.
    """
    solution, nodal, fe = elastic
    loaded = bodies.virgin(load_N, solution)
    if max(bodies.yield_used(loaded)) <= 1.0:
        rungs = Yielded(fe=fe, nodal=nodal, bodies=_bodies(bodies, loaded, loaded, None), by_band={})
        return Climb(yielded=rungs, contact=None)
    start = bodies.first_yield(loaded)
    way = bodies.climb(start, load_N)
    last = way[-1]
    on_nodes, on_finer = read(last.solution, load_N)
    if not _arrived(bodies, start, last):
        on_nodes = replace(on_nodes, status="not converged")
    rungs = Yielded(
        fe=on_finer,
        nodal=on_nodes,
        bodies=_bodies(bodies, start, loaded, last),
        path=() if sparing else _path(bodies, way, (fe, on_finer), read),
        fewer_steps=None,
        by_band={},
        imprint_mm=float(bodies.coupled.opening(*bodies.unloaded(last)).max()),
    )
    return Climb(yielded=rungs, contact=last)


def with_variants(
    climbed: Climb,
    bodies: YieldingBodies,
    elastic: tuple[ContactSolution, Rung, Rung],
    load_N: float,
    read: Read,
) -> Climb:
    """A climb repeated with half as many steps and with other yield stresses, for which coarse meshes are good enough.

    Not converged if a repetition does not find first yield or reach the load: stated errors depend on all of them.
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
        start = other.first_yield(loaded)
        way = other.climb(start, load_N, STEPS // 2)
        found[factor] = read(way[-1].solution, load_N)[1]
        if not _arrived(other, start, way[-1]):
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


def _arrived(bodies: YieldingBodies, start: PlasticContact, last: PlasticContact) -> bool:
    """Whether a climb, which ends with the first contact that fails, went from first yield to its load."""
    converged = start.solution.status == last.solution.status == "converged"
    return converged and _is_below_yield(max(bodies.yield_used(start))) and bodies.holds(last)


def _path(
    bodies: YieldingBodies, way: Sequence[PlasticContact], last: tuple[Rung, Rung], read: Read
) -> tuple[PathPoint, ...]:
    """Yielding and elastic bodies under every load of the way; `last` has the rungs of both under the last load."""
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
    """Yield of each body that may yield: first yield, from elastic contacts near it and under the load, and extent.

    First yield follows from the Gauss points. Stress at the nodes is a mean of the adjacent elements, which is too low
    below a narrow patch; it is used only if a body is so far from yield that it has no zone.
    """
    extents: dict[str, YieldedBody] = {}
    power, at_points = _power(bodies, start, loaded), bodies.yield_used(start)
    for k, body in enumerate((bodies.coupled.rail, bodies.coupled.wheel)):
        law = bodies.zones[k].law
        if math.isinf(law.yield_MPa):
            continue
        elastic = nodal_stress(body, start.displacements_mm[k])
        used = at_points[k] or stress_peak(body.mesh, elastic).von_mises_MPa / law.yield_MPa
        at_first = YieldedBody(
            yield_MPa=law.yield_MPa,
            tangent_MPa=body.material.tangent_MPa,
            first_yield_N=start.load_N * used ** (-1.0 / power),
        )
        extents[body.mesh.name] = (
            at_first if last is None else _extent(at_first, body.mesh, bodies.zones[k], last.states[k])
        )
    return extents


def _power(bodies: YieldingBodies, start: PlasticContact, loaded: PlasticContact) -> float:
    """Power of the load with which stress rises from first yield; a third, as below an ellipse, if it is not known."""
    if start is loaded:
        return 1.0 / 3.0
    rises = max(bodies.yield_used(loaded)) / max(bodies.yield_used(start))
    return math.log(rises) / math.log(loaded.load_N / start.load_N)


def _extent(one: YieldedBody, mesh: BodyMesh, zone: PlasticZone, state: PlasticState) -> YieldedBody:
    """Extent of the yielded part of a body, from its Gauss points."""
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

    `equivalent_plastic_strain` (n,), `von_mises_plastic_MPa` (n,) under the load, and `imprint_mm` (n, 3):
    displacements that remain without load, with base and driver held.
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
