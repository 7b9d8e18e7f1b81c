"""Contact of bodies that yield: pressure and plastic strain solved together, on the elastic factors.

The load rises from first yield in steps. In each step pressure and plastic strain are corrected together until neither
changes. The bodies respond to both through their elastic stiffness, the pressure follows from a model of their
compliance as in `contact.solver`, and the plastic strain from the law of the material.
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
    mix_solutions,
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
    average_at_nodes,
    find_stress_peak,
    nodal_stress,
    von_mises,
)
from fecontact.judging.measures import MEASURES, read_measures
from fecontact.judging.yielded import YIELD_STRESS_SPREAD, PathPoint, PlasticResult, YieldedBody

# Arrays of rail and wheel. A body without a yield stress does not have elements that may yield; its arrays have no
# rows.
Pair = tuple[Floats, ...]

LOAD_STEPS = 4
"""Number of load steps from first yield to the load.

With half of them the peak changes by 1 % at 2.5 times the yield stress.
"""
# Relative change of pressure and plastic strain by the last correction: the peak is then within 5e-5.
TOLERANCE = 1e-4
# Tolerance of the linear solutions of a correction, as a fraction of the forces. Nearly always a single iteration from
# the last solutions leaves a smaller residual, and the peak changes by 2e-11.
_LINEAR_TOLERANCE = 1e-6
_MOST_CORRECTIONS = 60
_MIXTURE_DEPTH = 6
# Elements may yield if their elastic stress exceeds this fraction of the yield stress: yielding elements shed stress to
# their neighbours.
_YIELD_ZONE_FRACTION = 0.4
# The climb begins with the largest stress at the Gauss points at this fraction of the yield stress.
_START_FRACTION = 0.95
# Tolerance of elastic solutions on the load path, of which only peak stress and pressure are used.
_INTERMEDIATE_TOLERANCE = 1e-5
_MOST_SEARCHES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticContact:
    """Contact between bodies that have yielded, under a load of the climb.

    Attributes
    ----------
    load_N
        Load in N.
    solution
        Pressure and approach.
    states
        Plastic state in the zones of rail and wheel.
    strains
        Total strains in the zones.
    displacements_mm
        Displacements (n, 3) of all nodes of rail and wheel.
    corrections
        Number of corrections; each costs a back-substitution for each body.
    change
        Relative change of pressure and plastic strain by the last correction (-).
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
    """Two coupled bodies and their contact; at least one body may yield.

    Attributes
    ----------
    coupled
        Coupled bodies with their factors.
    problem
        Contact problem of the elastic bodies.
    model
        Compliance of the bodies, taken as equal at every node.
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
        """Make bodies with zones of the elements that may yield.

        Parameters
        ----------
        coupled
            Coupled bodies with their factors.
        problem, model
            Contact problem of the elastic bodies, and model of their compliance.
        pressure_MPa
            Elastic pressure (n,) under the largest load.

        Returns
        -------
        YieldingBodies
            Bodies without plastic strain.
        """
        displacements = coupled.displacements(pressure_MPa, tolerance=_LINEAR_TOLERANCE)
        zones = (
            _find_zone(body, displacements_mm)
            for body, displacements_mm in zip((coupled.rail, coupled.wheel), displacements, strict=True)
        )
        return cls(coupled=coupled, problem=problem, model=model, zones=tuple(zones))

    def with_yield(self, factor: float) -> YieldingBodies:
        """Bodies with yield stresses multiplied by a factor.

        Parameters
        ----------
        factor
            Factor on the yield stresses (-).

        Returns
        -------
        YieldingBodies
            Bodies with the new yield stresses.
        """
        zones = (replace(zone, law=replace(zone.law, yield_MPa=factor * zone.law.yield_MPa)) for zone in self.zones)
        return replace(self, zones=tuple(zones))

    def elastic(self, load_N: float, start_MPa: Floats) -> PlasticContact:
        """Elastic contact under a load, for pressure and stresses on the load path.

        Parameters
        ----------
        load_N
            Load in N.
        start_MPa
            Pressure (n,) from which the iterations start.

        Returns
        -------
        PlasticContact
            Contact without plastic strain.
        """
        return self.virgin(
            load_N,
            solve_by_correction(
                self.problem, load_N, self.model, start_MPa=start_MPa, tolerance=_INTERMEDIATE_TOLERANCE
            ),
        )

    def virgin(self, load_N: float, solution: ContactSolution) -> PlasticContact:
        """Elastic solution as a contact without plastic strain.

        Parameters
        ----------
        load_N
            Load in N.
        solution
            Elastic solution.

        Returns
        -------
        PlasticContact
            Contact with strains and displacements.
        """
        displacements_mm = self.coupled.displacements(solution.pressure_MPa, tolerance=_LINEAR_TOLERANCE)
        states = tuple(zone.none() for zone in self.zones)
        return PlasticContact(
            load_N=load_N,
            solution=solution,
            states=states,
            strains=self._strains(displacements_mm),
            displacements_mm=displacements_mm,
        )

    def yield_used(self, contact: PlasticContact) -> tuple[float, ...]:
        """Largest von Mises stress divided by yield stress at a Gauss point of each body.

        Parameters
        ----------
        contact
            Contact with strains and plastic states.

        Returns
        -------
        tuple of float
            Ratio (-) of rail and wheel; 0 without a yield stress.
        """
        return tuple(
            float(zone.law.von_mises(strains, state).max(initial=0.0)) / zone.law.yield_MPa
            for zone, strains, state in zip(self.zones, contact.strains, contact.states, strict=True)
        )

    def first_yield(self, loaded: PlasticContact) -> PlasticContact:
        """Find the elastic contact just below first yield, by secants of the logarithms.

        If the search fails, the last contact is returned, and `_has_arrived` is false for a climb from it.

        Parameters
        ----------
        loaded
            Contact under a larger load.

        Returns
        -------
        PlasticContact
            Contact without plastic strain.
        """
        exponent, previous, contact = 1.0 / 3.0, None, loaded
        for _ in range(_MOST_SEARCHES):
            utilisation = max(self.yield_used(contact))
            if previous is not None:
                exponent = math.log(utilisation / previous[1]) / math.log(contact.load_N / previous[0])
            if previous is not None and _is_below_yield(utilisation):
                break
            previous = (contact.load_N, utilisation)
            load_N = contact.load_N * (_START_FRACTION / utilisation) ** (1.0 / exponent)
            contact = self.elastic(load_N, contact.solution.pressure_MPa)
        return contact

    def climb(self, start: PlasticContact, load_N: float, steps: int = LOAD_STEPS) -> list[PlasticContact]:
        """Solve contacts under loads that rise in equal steps from a start to a load.

        Parameters
        ----------
        start
            Contact at first yield.
        load_N
            Last load in N.
        steps
            Number of steps.

        Returns
        -------
        list of PlasticContact
            Contacts without the start; the list ends with the first contact that does not converge.
        """
        contacts = [start]
        for next_N in np.linspace(start.load_N, load_N, steps + 1)[1:]:
            contacts.append(self._step(contacts[-1], float(next_N)))
            if contacts[-1].solution.status != "converged":
                break
        return contacts[1:]

    def unloaded(self, contact: PlasticContact) -> Pair:
        """Displacements of both bodies by their plastic strain alone, without load.

        Arrays (nodes, 3) in mm.

        Parameters
        ----------
        contact
            Contact with plastic strains.

        Returns
        -------
        tuple of ndarray
            Displacements of the rail and of the wheel.
        """
        forces = self._plastic_forces(_plastic_strains(contact.states))
        return self.coupled.displacements(np.zeros_like(contact.solution.pressure_MPa), forces)

    def holds(self, contact: PlasticContact) -> bool:
        """Whether the zones and the pressure nodes are large enough for a contact.

        No element may yield outside the zones, and no pressure may reach the edge of the pressure nodes.

        Parameters
        ----------
        contact
            Contact under the last load.

        Returns
        -------
        bool
            True if both are large enough.
        """
        pressure = contact.solution.pressure_MPa.reshape(self.coupled.grid.shape)
        is_at_edge = bool(pressure[-1].any() or pressure[:, [0, -1]].any())
        if not self.coupled.grid.half:
            is_at_edge = is_at_edge or bool(pressure[0].any())
        meshes = (self.coupled.rail.mesh, self.coupled.wheel.mesh)
        return not is_at_edge and not any(
            _has_yielded_outside(zone, mesh, displacements_mm)
            for zone, mesh, displacements_mm in zip(self.zones, meshes, contact.displacements_mm, strict=True)
        )

    def _step(self, start: PlasticContact, load_N: float) -> PlasticContact:
        """Solve the contact under another load, from the plastic state of a contact.

        Pressure and plastic strain are iterated together, and each correction mixes earlier corrections.

        Parameters
        ----------
        start
            Contact before the load step.
        load_N
            New load.

        Returns
        -------
        PlasticContact
            Contact with the status `converged` if the last relative change is below `TOLERANCE`, `not converged` after
            `_MOST_CORRECTIONS` corrections.
        """
        coupled, model_problem = self.coupled, replace(self.problem, compliance=self.model, within=None)
        packing = self._make_packing(start.solution.pressure_MPa)
        pressure_MPa = start.solution.pressure_MPa * (load_N / start.load_N)
        plastic_strains = _plastic_strains(start.states)
        solutions: list[Floats] = []
        changes: list[Floats] = []
        corrections = 0
        while True:
            corrections += 1
            displacements_mm = coupled.displacements(
                pressure_MPa, self._plastic_forces(plastic_strains), tolerance=_LINEAR_TOLERANCE
            )
            opening_mm = coupled.opening(*displacements_mm)
            model_gap_problem = replace(
                model_problem, gap_mm=self.problem.gap_mm + opening_mm - self.model(pressure_MPa)
            )
            solution = solve_contact(model_gap_problem, load_N, start_MPa=pressure_MPa, tolerance=0.01 * TOLERANCE)
            strains = self._strains(displacements_mm)
            states = self._update_states(start, strains)
            # Input and output of this correction.
            input_vector = packing.pack(pressure_MPa, plastic_strains)
            output_vector = packing.pack(solution.pressure_MPa, _plastic_strains(states))
            change = packing.change(input_vector, output_vector)
            is_done = change < TOLERANCE
            if is_done or corrections == _MOST_CORRECTIONS:
                return PlasticContact(
                    load_N=load_N,
                    solution=replace(solution, status="converged" if is_done else "not converged"),
                    states=states,
                    strains=strains,
                    displacements_mm=displacements_mm,
                    corrections=corrections,
                    change=change,
                )
            solutions, changes = (
                [*solutions, output_vector][-_MIXTURE_DEPTH - 1 :],
                [*changes, output_vector - input_vector][-_MIXTURE_DEPTH - 1 :],
            )
            pressure_MPa, plastic_strains = packing.unpack(mix_solutions(solutions, changes))
            pressure_MPa = np.maximum(pressure_MPa, 0.0)
            pressure_MPa = pressure_MPa * (load_N / self.problem.load_N(pressure_MPa))

    def _plastic_forces(self, plastic: Pair) -> Pair:
        return tuple(zone.forces(strain) for zone, strain in zip(self.zones, plastic, strict=True))

    def _strains(self, displacements: Pair) -> Pair:
        return tuple(
            zone.strains(displacements_mm) for zone, displacements_mm in zip(self.zones, displacements, strict=True)
        )

    def _update_states(self, start: PlasticContact, strains: Pair) -> tuple[PlasticState, ...]:
        return tuple(
            zone.law.flow(first_strains, last_strains, state)
            for zone, first_strains, last_strains, state in zip(
                self.zones, start.strains, strains, start.states, strict=True
            )
        )

    def _make_packing(self, pressure: Floats) -> _Packing:
        """Weights that turn pressures and plastic strains into energies of the whole contact.

        `pressure` (n,) in MPa only decides on the node with the highest pressure, where the compliance is taken.
        """
        unit_pressure = np.zeros_like(pressure)
        highest = int(np.argmax(pressure))
        unit_pressure[highest] = 1.0
        symmetry_factor = math.sqrt(2.0) if self.coupled.grid.half else 1.0
        return _Packing(
            pressure=np.sqrt(self.problem.area_mm2 * float(self.model(unit_pressure)[highest])),
            plastic=tuple(symmetry_factor * zone.weights for zone in self.zones),
        )


def _is_below_yield(utilisation: float) -> bool:
    """Whether the largest stress is in the range from which a climb starts."""
    return _START_FRACTION**2 < utilisation <= 1.0


def _find_zone(body: ElasticBody, displacements: Floats) -> PlasticZone:
    """Find the elements of a body that may yield, from elastic displacements (n, 3)."""
    law = PlasticLaw.of(body.material)
    all_elements = PlasticZone.of(body.mesh, law, np.arange(len(body.mesh.hexes)))
    stress_MPa = law.von_mises(all_elements.strains(displacements), all_elements.none()).max(axis=1)
    return all_elements.part(stress_MPa > _YIELD_ZONE_FRACTION * law.yield_MPa)


def _has_yielded_outside(zone: PlasticZone, mesh: BodyMesh, displacements: Floats) -> bool:
    """Whether elements outside a zone yield."""
    outside_elements = np.setdiff1d(np.arange(len(mesh.hexes)), zone.elements)
    outside_zone = PlasticZone.of(mesh, zone.law, outside_elements)
    stress_MPa = zone.law.von_mises(outside_zone.strains(displacements), outside_zone.none())
    return bool(np.any(stress_MPa > zone.law.yield_MPa))


def _plastic_strains(states: tuple[PlasticState, ...]) -> Pair:
    return tuple(state.strain for state in states)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Packing:
    """Pressure (n,) and plastic strain of both bodies as a single vector, with weights."""

    pressure: Floats
    plastic: Pair

    def pack(self, pressure: Floats, plastic: Pair) -> Floats:
        """Join pressure (n,) and plastic strains of both bodies in a weighted vector."""
        strains = ((weight * strain).ravel() for weight, strain in zip(self.plastic, plastic, strict=True))
        return np.concatenate([self.pressure * pressure, *strains])

    def unpack(self, vector: Floats) -> tuple[Floats, Pair]:
        """Split a vector into pressure (n,) in MPa and plastic strains of both bodies.

        The strains (elements, 8, 3, 3) are at the Gauss points, rail first. It is the inverse of `pack`.
        """
        pressure_end = self.pressure.size
        rail_end = pressure_end + 9 * self.plastic[0].size
        plastic = (
            vector_part.reshape(*weight.shape[:2], 3, 3) / weight
            for vector_part, weight in zip(
                (vector[pressure_end:rail_end], vector[rail_end:]), self.plastic, strict=True
            )
        )
        return vector[:pressure_end] / self.pressure, tuple(plastic)

    def change(self, old: Floats, new: Floats) -> float:
        """Relative change of pressure or plastic strain (-), the larger of both.

        The change of the pressure is its largest nodal change, relative to the new peak. The change of the plastic
        strain is a ratio of energy norms; it is 0 without plastic strain. `old` and `new` are packed vectors.
        """
        count = self.pressure.size
        old_pressure, new_pressure = old[:count] / self.pressure, new[:count] / self.pressure
        strain_norm = float(np.linalg.norm(new[count:]))
        strain_change = float(np.linalg.norm(new[count:] - old[count:])) / strain_norm if strain_norm > 0.0 else 0.0
        return max(float(np.abs(new_pressure - old_pressure).max() / new_pressure.max()), strain_change)


# --- Rung of bodies that yield: the climb from first yield to a load, read on the nodes of the elastic rungs.

# Function that reads a contact, elastic or not, under a load: its rungs on the elements' nodes and on finer nodes.
Read = Callable[[ContactSolution, float], tuple[Rung, Rung]]

# Indices of tensors (3, 3) in the order of stresses.
_STRESS_INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Climb:
    """Result of a climb: the plastic rung and its contact.

    Attributes
    ----------
    yielded
        First loading of the bodies.
    contact
        Contact under the last load; None if no body yields.
    """

    yielded: PlasticResult
    contact: PlasticContact | None


def load_bodies(
    bodies: YieldingBodies,
    elastic: tuple[ContactSolution, Rung, Rung],
    load_N: float,
    read_rungs: Read,
    *,
    sparing: bool,
) -> Climb:
    """Load bodies from first yield up to a load.

    Parameters
    ----------
    bodies
        Bodies that may yield.
    elastic
        Elastic solution under this load, and its rungs on the elements' nodes and on finer nodes.
    load_N
        Load in N.
    read_rungs
        Function that reads the rungs of a solution under a load.
    sparing
        Whether the results for a single mesh level are left out: the path, half as many steps, other yield stresses.

    Returns
    -------
    Climb
        Not converged if the climb does not reach the load, or if first yield was not found.
    """
    solution, nodal, fe = elastic
    loaded = bodies.virgin(load_N, solution)
    if max(bodies.yield_used(loaded)) <= 1.0:
        yielded = PlasticResult(fe=fe, nodal=nodal, bodies=_yielded_bodies(bodies, loaded, loaded, None), by_band={})
        return Climb(yielded=yielded, contact=None)
    start = bodies.first_yield(loaded)
    path_contacts = bodies.climb(start, load_N)
    last_contact = path_contacts[-1]
    nodal_rung, fe_rung = read_rungs(last_contact.solution, load_N)
    if not _has_arrived(bodies, start, last_contact):
        nodal_rung = replace(nodal_rung, status="not converged")
    yielded = PlasticResult(
        fe=fe_rung,
        nodal=nodal_rung,
        bodies=_yielded_bodies(bodies, start, loaded, last_contact),
        path=() if sparing else _make_path(bodies, path_contacts, (fe, fe_rung), read_rungs),
        fewer_steps=None,
        by_band={},
        imprint_mm=float(bodies.coupled.opening(*bodies.unloaded(last_contact)).max()),
    )
    return Climb(yielded=yielded, contact=last_contact)


def add_variants(
    climbed: Climb,
    bodies: YieldingBodies,
    elastic: tuple[ContactSolution, Rung, Rung],
    load_N: float,
    read_rungs: Read,
) -> Climb:
    """Repeat a climb with fewer steps and with different yield stresses.

    Coarse meshes are accurate enough for these repetitions.

    Parameters
    ----------
    climbed
        Result of the climb.
    bodies, elastic, load_N, read_rungs
        As in `load_bodies`.

    Returns
    -------
    Climb
        Not converged if a repetition does not find first yield or does not reach the load: stated errors depend on all
        of them.
    """
    if climbed.contact is None:
        return climbed
    solution, _, fe = elastic
    rung_by_factor: dict[float, Rung] = {}
    nodal = climbed.yielded.nodal
    for factor in (1.0, 1.0 - YIELD_STRESS_SPREAD, 1.0 + YIELD_STRESS_SPREAD):
        varied_bodies = bodies.with_yield(factor)
        loaded = varied_bodies.virgin(load_N, solution)
        if max(varied_bodies.yield_used(loaded)) <= 1.0:
            rung_by_factor[factor] = fe
            continue
        start = varied_bodies.first_yield(loaded)
        path_contacts = varied_bodies.climb(start, load_N, LOAD_STEPS // 2)
        rung_by_factor[factor] = read_rungs(path_contacts[-1].solution, load_N)[1]
        if not _has_arrived(varied_bodies, start, path_contacts[-1]):
            nodal = replace(nodal, status="not converged")
    names = {1.0 - YIELD_STRESS_SPREAD: "lower", 1.0: "given", 1.0 + YIELD_STRESS_SPREAD: "higher"}
    return replace(
        climbed,
        yielded=replace(
            climbed.yielded,
            nodal=nodal,
            fewer_steps=rung_by_factor[1.0],
            by_band={names[factor]: _plastic_changes(fe, rung) for factor, rung in rung_by_factor.items()},
        ),
    )


def _has_arrived(bodies: YieldingBodies, start: PlasticContact, last: PlasticContact) -> bool:
    """Whether a climb went from first yield to its load.

    The last contact of a climb is the first contact that fails.
    """
    converged = start.solution.status == last.solution.status == "converged"
    return converged and _is_below_yield(max(bodies.yield_used(start))) and bodies.holds(last)


def _make_path(
    bodies: YieldingBodies, path_contacts: Sequence[PlasticContact], last_rungs: tuple[Rung, Rung], read_rungs: Read
) -> tuple[PathPoint, ...]:
    """Yielding and elastic bodies under every load of the path.

    `last_rungs` has the rungs of both under the last load.
    """
    points = []
    for contact in path_contacts:
        rungs = last_rungs
        if contact is not path_contacts[-1]:
            elastic = bodies.elastic(contact.load_N, contact.solution.pressure_MPa).solution
            rungs = (read_rungs(elastic, contact.load_N)[1], read_rungs(contact.solution, contact.load_N)[1])
        points.append(
            PathPoint(
                load_N=contact.load_N,
                steps=_plastic_changes(*rungs),
                largest_strain=max(float(state.equivalent.max(initial=0.0)) for state in contact.states),
                corrections=contact.corrections,
                change=contact.change,
            )
        )
    return tuple(points)


def _plastic_changes(elastic: Rung, plastic: Rung) -> dict[str, float]:
    """Relative change of each measure from elastic to plastic bodies (-)."""
    elastic_measures, plastic_measures = read_measures(elastic).as_dict(), read_measures(plastic).as_dict()
    return {name: plastic_measures[name] / elastic_measures[name] - 1.0 for name in MEASURES}


def _yielded_bodies(
    bodies: YieldingBodies, start: PlasticContact, loaded: PlasticContact, last: PlasticContact | None
) -> dict[str, YieldedBody]:
    """Yield of each body that may yield: load of first yield, and extent of the plastic zone.

    First yield follows from elastic contacts near it and under the load, at the Gauss points. Stress at the nodes is a
    mean of the adjacent elements, which is too low below a narrow patch; it is used only if a body is so far from yield
    that it does not have a zone.
    """
    yielded_bodies: dict[str, YieldedBody] = {}
    exponent, point_utilisations = _stress_exponent(bodies, start, loaded), bodies.yield_used(start)
    for number, body in enumerate((bodies.coupled.rail, bodies.coupled.wheel)):
        law = bodies.zones[number].law
        if math.isinf(law.yield_MPa):
            continue
        stress_MPa = nodal_stress(body, start.displacements_mm[number])
        utilisation = (
            point_utilisations[number] or find_stress_peak(body.mesh, stress_MPa).von_mises_MPa / law.yield_MPa
        )
        yielded_body = YieldedBody(
            yield_MPa=law.yield_MPa,
            tangent_MPa=body.material.tangent_MPa,
            first_yield_N=start.load_N * utilisation ** (-1.0 / exponent),
        )
        yielded_bodies[body.mesh.name] = (
            yielded_body
            if last is None
            else _measure_extent(yielded_body, body.mesh, bodies.zones[number], last.states[number])
        )
    return yielded_bodies


def _stress_exponent(bodies: YieldingBodies, start: PlasticContact, loaded: PlasticContact) -> float:
    """Exponent of the load in the stress above first yield.

    It is a third, as below an ellipse, if it cannot be measured.
    """
    if start is loaded:
        return 1.0 / 3.0
    stress_ratio = max(bodies.yield_used(loaded)) / max(bodies.yield_used(start))
    return math.log(stress_ratio) / math.log(loaded.load_N / start.load_N)


def _measure_extent(yielded_body: YieldedBody, mesh: BodyMesh, zone: PlasticZone, state: PlasticState) -> YieldedBody:
    """Extent of the plastic zone of a body, from its Gauss points.

    Places and depths below the surface are in mm, the volume is in mm3 of the whole body. Without plastic strain the
    body is returned unchanged.
    """
    strain = state.equivalent.ravel()
    has_flowed = strain > 0.0
    if not np.any(has_flowed):
        return yielded_body
    shape_values = np.prod(1.0 + CORNER_SIGNS[:, None, :] * CORNER_SIGNS[None] / np.sqrt(3.0), axis=2) / 8.0
    points = np.einsum("gc,mcd->mgd", shape_values, mesh.points[zone.nodes]).reshape(-1, 3)[has_flowed]
    # Depths are measured from the surface along the lines of the block.
    surface_points, lower_points = (mesh.points[mesh.block_nodes[..., layer].ravel()] for layer in (0, 1))
    inward = (lower_points - surface_points) / np.linalg.norm(lower_points - surface_points, axis=1, keepdims=True)
    _, nearest = cKDTree(surface_points).query(points)
    depth_mm = np.einsum("nd,nd->n", points - surface_points[nearest], inward[nearest])
    largest = int(np.argmax(strain[has_flowed]))
    return replace(
        yielded_body,
        largest_strain=float(strain.max()),
        x_mm=float(points[largest, 0]),
        y_mm=float(points[largest, 1]),
        depth_mm=float(depth_mm[largest]),
        top_mm=float(depth_mm.min()),
        bottom_mm=float(depth_mm.max()),
        volume_mm3=(2.0 if mesh.half else 1.0) * float(zone.volumes_mm3.ravel()[has_flowed].sum()),
    )


def compute_nodal_fields(bodies: YieldingBodies, contact: PlasticContact) -> Mapping[str, Mapping[str, Floats]]:
    """Arrays at the nodes of each body that may yield.

    Parameters
    ----------
    bodies
        Bodies that may yield.
    contact
        Contact under the load.

    Returns
    -------
    dict of str to dict of str to ndarray
        By body: `equivalent_plastic_strain` (n,), `von_mises_plastic_MPa` (n,) under the load, and `imprint_mm` (n, 3):
        displacements that remain without load, with base and driver fixed.
    """
    fields_by_body: dict[str, Mapping[str, Floats]] = {}
    imprint_mm = bodies.unloaded(contact)
    for number, body in enumerate((bodies.coupled.rail, bodies.coupled.wheel)):
        zone, state = bodies.zones[number], contact.states[number]
        if not math.isinf(zone.law.yield_MPa):
            fields_by_body[body.mesh.name] = _compute_nodal_fields(
                body, zone, state, contact.displacements_mm[number]
            ) | {"imprint_mm": imprint_mm[number]}
    return fields_by_body


def _compute_nodal_fields(
    body: ElasticBody, zone: PlasticZone, state: PlasticState, displacements: Floats
) -> dict[str, Floats]:
    """Plastic strain and von Mises stress at the n nodes of a body.

    Parameters
    ----------
    body
        Elastic body with its mesh.
    zone
        Elements that may yield.
    state
        Plastic state at the 8 Gauss points of each element of the zone.
    displacements
        Displacements of the nodes in mm.

    Returns
    -------
    dict of str to ndarray
        `equivalent_plastic_strain` (n,) without unit, 0 outside the zone; `von_mises_plastic_MPa` (n,) with the stress
        that the plastic strain takes away.
    """
    cells = len(body.mesh.hexes)
    equivalent, stress_relaxation = np.zeros((cells, 8, 1)), np.zeros((cells, 8, 6))
    equivalent[zone.elements, :, 0] = state.equivalent
    for column, (i, j) in enumerate(_STRESS_INDICES):
        stress_relaxation[zone.elements, :, column] = 2.0 * zone.law.shear_MPa * state.strain[..., i, j]
    return {
        "equivalent_plastic_strain": average_at_nodes(body.mesh, equivalent)[:, 0],
        "von_mises_plastic_MPa": von_mises(nodal_stress(body, displacements, stress_relaxation)),
    }
