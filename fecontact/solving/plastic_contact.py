"""Contact of bodies that yield: pressure and plastic strain found together, on the elastic factors.

A load goes up from first yield in steps. In each the pressure that the bodies carry and the plastic strain that follows
from it are corrected together until neither changes: bodies answer both through their elastic stiffness, the pressure
follows from a model of their compliance as in `contact.correction`, the strain from the law of the material.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.correction import solve_by_correction
from fecontact.contact.mixing import mixture
from fecontact.contact.solver import Compliance, ContactProblem, ContactSolution, solve_contact
from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.plasticity import PlasticLaw, PlasticState, PlasticZone

Floats = NDArray[np.float64]
# Of rail and wheel; a body without a yield stress has no elements that may yield, and arrays of no rows.
Pair = tuple[Floats, Floats]

STEPS = 4
"""Load steps from first yield to the load; with half of them the peak moves by 1 % at 2.5 times the yield stress."""
# Relative change of pressure and plastic strain by a correction: the peak is then within 5e-5.
TOLERANCE = 1e-4
_MOST_CORRECTIONS = 60
_DEPTH = 6
# Elements whose elastic stress comes so near to the yield stress may yield: where others do, stress is shed to them.
_MAY_YIELD = 0.4
# The climb begins below first yield, as Gauss points see it.
_BELOW_YIELD = 0.95
# Elastic solutions on the way, of which peak stress and pressure are taken alone.
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
        Total strains there.
    displacements_mm
        Of all nodes (n, 3), of rail and wheel.
    corrections
        How many were made; each costs a back-substitution a body.
    change
        Relative change of pressure and plastic strain by the last of them.
    """

    load_N: float
    solution: ContactSolution
    states: tuple[PlasticState, PlasticState]
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
    zones: tuple[PlasticZone, PlasticZone]

    @classmethod
    def of(
        cls, coupled: CoupledBodies, problem: ContactProblem, model: Compliance, pressure_MPa: Floats
    ) -> YieldingBodies:
        """Find the elements that may yield up to the load of an elastic pressure (n,)."""
        displacements = coupled.displacements(pressure_MPa)
        rail, wheel = (_zone(body, u) for body, u in zip((coupled.rail, coupled.wheel), displacements, strict=True))
        return cls(coupled=coupled, problem=problem, model=model, zones=(rail, wheel))

    def with_yield(self, factor: float) -> YieldingBodies:
        """The bodies with yield stresses that are so many times as high."""
        rail, wheel = (
            replace(zone, law=replace(zone.law, yield_MPa=factor * zone.law.yield_MPa)) for zone in self.zones
        )
        return replace(self, zones=(rail, wheel))

    def elastic(self, load_N: float, start_MPa: Floats) -> PlasticContact:
        """The elastic contact under a load, for its pressure and stresses on the way."""
        return self.virgin(
            load_N,
            solve_by_correction(self.problem, load_N, self.model, start_MPa=start_MPa, tolerance=_ON_THE_WAY),
        )

    def virgin(self, load_N: float, solution: ContactSolution) -> PlasticContact:
        """An elastic solution as one without plastic strain."""
        u = self.coupled.displacements(solution.pressure_MPa)
        rail, wheel = (zone.none() for zone in self.zones)
        return PlasticContact(
            load_N=load_N, solution=solution, states=(rail, wheel), strains=self._strains(u), displacements_mm=u
        )

    def yield_used(self, contact: PlasticContact) -> tuple[float, float]:
        """Largest von Mises stress over the yield stress at a Gauss point of rail and wheel; 0 of one without."""
        rail, wheel = (
            float(zone.law.von_mises(strains, state).max(initial=0.0)) / zone.law.yield_MPa
            for zone, strains, state in zip(self.zones, contact.strains, contact.states, strict=True)
        )
        return rail, wheel

    def first_yield(self, loaded: PlasticContact) -> PlasticContact:
        """The elastic contact just below first yield, from one under a larger load, by secants of the logarithms.

        The last of a few where none is, which `is_first_yield` tells.
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

    def is_first_yield(self, contact: PlasticContact) -> bool:
        """Whether an elastic contact is just below first yield."""
        return _is_below_yield(max(self.yield_used(contact)))

    def climb(self, start: PlasticContact, load_N: float, steps: int = STEPS) -> list[PlasticContact]:
        """Contacts under rising loads, in equal steps from a start up to a load; the start is not among them."""
        found = [start]
        for next_N in np.linspace(start.load_N, load_N, steps + 1)[1:]:
            found.append(self._step(found[-1], float(next_N)))
            if found[-1].solution.status != "converged":
                break
        return found[1:]

    def unloaded(self, contact: PlasticContact) -> Pair:
        """Displacements (nodes, 3) in mm of both bodies by their plastic strain alone."""
        forces = self._forces(_strains_of(contact.states))
        return self.coupled.displacements(np.zeros_like(contact.solution.pressure_MPa), forces)

    def imprint(self, contact: PlasticContact) -> Floats:
        """How far the surfaces part (n,) in mm at the pressure nodes by the plastic strain alone."""
        return self.coupled.opening(*self.unloaded(contact))

    def holds(self, contact: PlasticContact) -> bool:
        """Whether nothing yields beside the zones, and no pressure is at the edge of its nodes."""
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
        """Go up to another load."""
        coupled, cheap = self.coupled, replace(self.problem, compliance=self.model)
        packing = self._packing(start.solution.pressure_MPa)
        p = start.solution.pressure_MPa * (load_N / start.load_N)
        plastic = _strains_of(start.states)
        solved: list[Floats] = []
        changes: list[Floats] = []
        corrections = 0
        while True:
            corrections += 1
            u = coupled.displacements(p, self._forces(plastic))
            opening = coupled.opening(*u)
            inner = replace(cheap, gap_mm=self.problem.gap_mm + opening - self.model(p))
            solution = solve_contact(inner, load_N, start_MPa=p, tolerance=0.01 * TOLERANCE)
            strains = self._strains(u)
            states = self._flow(start, strains)
            # what went in, and what came of it
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
        rail, wheel = (zone.forces(strain) for zone, strain in zip(self.zones, plastic, strict=True))
        return rail, wheel

    def _strains(self, displacements: Pair) -> Pair:
        rail, wheel = (zone.strains(u) for zone, u in zip(self.zones, displacements, strict=True))
        return rail, wheel

    def _flow(self, start: PlasticContact, strains: Pair) -> tuple[PlasticState, PlasticState]:
        rail, wheel = (
            zone.law.flow(first, last, state)
            for zone, first, last, state in zip(self.zones, start.strains, strains, start.states, strict=True)
        )
        return rail, wheel

    def _packing(self, pressure: Floats) -> _Packing:
        """Weights by which pressures and plastic strains are of one kind, energies; both as of the whole contact."""
        unit = np.zeros_like(pressure)
        highest = int(np.argmax(pressure))
        unit[highest] = 1.0
        both = math.sqrt(2.0) if self.coupled.grid.half else 1.0
        return _Packing(
            pressure=np.sqrt(self.problem.area_mm2 * float(self.model(unit)[highest])),
            plastic=(both * self.zones[0].weights, both * self.zones[1].weights),
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
    """Whether elements yield that are not in a zone."""
    beside = np.setdiff1d(np.arange(len(mesh.hexes)), zone.elements)
    others = PlasticZone.of(mesh, zone.law, beside)
    stress = zone.law.von_mises(others.strains(displacements), others.none())
    return bool(np.any(stress > zone.law.yield_MPa))


def _strains_of(states: tuple[PlasticState, PlasticState]) -> Pair:
    rail, wheel = states
    return rail.strain, wheel.strain


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
        rail, wheel = (
            part.reshape(*weight.shape[:2], 3, 3) / weight
            for part, weight in zip((vector[start:middle], vector[middle:]), self.plastic, strict=True)
        )
        return vector[:start] / self.pressure, (rail, wheel)

    def change(self, old: Floats, new: Floats) -> float:
        """Relative change: of the pressure to its peak, of the plastic strain in its energy."""
        n = self.pressure.size
        p, q = old[:n] / self.pressure, new[:n] / self.pressure
        size = float(np.linalg.norm(new[n:]))
        of_strain = float(np.linalg.norm(new[n:] - old[n:])) / size if size > 0.0 else 0.0
        return max(float(np.abs(q - p).max() / q.max()), of_strain)
