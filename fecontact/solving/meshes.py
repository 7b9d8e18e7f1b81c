"""The meshes of a position, the one owner of their factors: a load is solved on as many as its verdict takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import worst_of
from fecontact.comparison.judging import Evidence, judge_hertz
from fecontact.comparison.measures import patch_of
from fecontact.comparison.point_noise import PointNoise
from fecontact.comparison.solved_load import Level, SolvedLoad, elements_off
from fecontact.comparison.uncertainty import MESH_RATIO
from fecontact.contact.rung import Rung
from fecontact.errors import InputError, NotEnoughMemory
from fecontact.fe.coupling import CoupledBodies
from fecontact.geometry.placement import Placement
from fecontact.solving.coupled_mesh import CoupledMesh
from fecontact.solving.expected_patch import followed_mm
from fecontact.solving.lobe_sizes import lobe_sizes
from fecontact.solving.measured_lines import point_noise
from fecontact.solving.planes import angle_of_normals
from fecontact.solving.position import Position, hertz_of_case
from fecontact.solving.quadratic_rung import quadratic_rung
from fecontact.solving.yielding import nodal_fields
from fecontact.theory.hertz import hertz_from_hessian

# The case's own mesh, a coarser one, and three refinements.
_MOST_MESHES = 5
# Where the elements' own nodes are to know the verdict too.
_MOST_FOR_EVIDENCE = 6
# Elements that the finest meshes of every named resolution have on the semi-axis that they are made for.
_FEWEST_ELEMENTS = 4
# A lobe on its last nodes is measured a little differently than on those that they were made for.
_MOST_OF_NODES = 0.7


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedBodies:
    """Both bodies of the finest meshes under a load, and the displacements (n, 3) in mm of their nodes.

    Base held and driver held: the rigid approach is not in them. Displacements are elastic; `yielded` has arrays at the
    nodes of a body that has yielded (`yielding.nodal_fields`).
    """

    coupled: CoupledBodies
    displacement_mm: dict[str, NDArray[np.float64]]
    yielded: Mapping[str, Mapping[str, NDArray[np.float64]]] = field(default_factory=dict)


class Meshes:
    """The meshes of a position, each made when it is first needed and solved for any number of loads.

    Parameters
    ----------
    position
        Its expected patch decides about zone and element size of all meshes.
    keep
        Whether the factors stay for further loads until `close`; otherwise they go as soon as a load is solved, and
        `bodies` are those of its finest meshes.
    """

    def __init__(self, position: Position, *, keep: bool = False) -> None:
        """Make no mesh yet."""
        self.position = position
        self.bodies: SolvedBodies | None = None
        self._keep = keep
        self._meshes: dict[float, CoupledMesh] = {}
        self._not_enlarged: list[InputError] = []

    def solve(self, position: Position) -> SolvedLoad:
        """Solve a position's load on two meshes; refine while the verdict is open and the limit allows.

        It is the position of the meshes, or the same one under another load.
        """
        case, placement = position.case, position.placement
        with position.clock.step("expect the patch"):
            own = (hertz_of_case(case, placement), position.expected.half_space)
            noise = point_noise(case, placement, own)
        self._not_enlarged = []
        levels = [self._level(position, 1.0), self._level(position, MESH_RATIO)]
        stop: InputError | None = None
        while stop is None and is_open(case, levels, placement, noise):
            stop = self._refine(position, levels)
        with position.clock.step("ladder"):
            hertz = hertz_from_hessian(
                placement.first.curvature.hessian,
                normal_force_N=levels[0].fe.normal_force_N,
                contact_modulus_MPa=case.contact_modulus_MPa,
            )
            return SolvedLoad(
                case=case,
                levels=tuple(levels),
                half_space=position.expected.half_space,
                turned=_turned(position),
                quadratic=quadratic_rung(placement.first, hertz, half=case.half, nodes=case.nodes_a_semi_axis),
                point_noise=noise,
                limits=(
                    *_few_elements(position, levels),
                    *_few_nodes(position),
                    *(f"the contact zone cannot be enlarged: {error}" for error in self._not_enlarged),
                    *(() if stop is None else (f"refinement stopped: {stop}",)),
                ),
                short_of_memory=any(isinstance(error, NotEnoughMemory) for error in (*self._not_enlarged, stop)),
            )

    def close(self) -> None:
        """Release all factors; a further load makes its meshes again."""
        for mesh in self._meshes.values():
            mesh.close()
        self._meshes.clear()

    def _refine(self, position: Position, levels: list[Level]) -> InputError | None:
        """Put a level on finer meshes before the others, or say why there is none."""
        case = position.case
        if (expected := finer_degrees_of_freedom(levels)) > case.refine_degrees_of_freedom:
            return InputError(
                f"the next meshes would have about {expected} of at most {case.refine_degrees_of_freedom} degrees of"
                " freedom"
            )
        try:
            levels.insert(0, self._level(position, MESH_RATIO ** (1 - len(levels))))
        except InputError as error:
            return error
        return None

    def _level(self, position: Position, coarser: float) -> Level:
        clock = position.clock
        clock.stage = _stage(coarser)
        try:
            return self._solved(position, coarser)
        finally:
            clock.stage = ""

    def _solved(self, position: Position, coarser: float) -> Level:
        mesh = self._meshes.get(coarser) or CoupledMesh(self.position, coarser)
        level = mesh.solve(position)
        if mesh.stopped_by is not None:
            self._not_enlarged.append(mesh.stopped_by)
        if self._keep:
            self._meshes[coarser] = mesh
            return level
        with self.position.clock.step("recover"):
            # the coarse mesh comes second, a refinement after it
            if self.bodies is None or coarser < 1.0:
                rail, wheel = mesh.bodies.displacements(level.nodal.pressure_MPa.ravel())
                self.bodies = SolvedBodies(
                    coupled=mesh.bodies,
                    displacement_mm={"rail": rail, "wheel": wheel},
                    yielded={} if mesh.plastic is None else nodal_fields(*mesh.plastic),
                )
            mesh.close()
        return level


def _turned(position: Position) -> Rung | None:
    """The half-space of several lobes with each pressure along its own normal; None for a single lobe."""
    rung = position.expected.half_space
    if len(patch_of(rung).lobes) == 1:
        return None
    angle = angle_of_normals(position.placement, rung.grid.s_mm)
    return position.true_gap.solve(rung.grid, position.case.load_N, start=rung.pressure, angle_rad=angle)


def _stage(coarser: float) -> str:
    """Which meshes are under way, for those who wait."""
    if coarser == 1.0:
        return "first meshes"
    return "coarser meshes, for the uncertainty" if coarser > 1.0 else "finer meshes, because the verdict is open"


def _few_elements(position: Position, levels: Sequence[Level]) -> tuple[str, ...]:
    """What is to be said of element sizes that were given and leave too few elements to the patch."""
    semi_axes = (position.expected.semi_axis_x_mm, position.expected.semi_axis_s_mm)
    sizes = levels[0].nodal.grid.steps_mm
    count, size, semi_axis = min((axis / size, size, axis) for axis, size in zip(semi_axes, sizes, strict=True))
    if count >= _FEWEST_ELEMENTS:
        return ()
    return (
        f"elements of {size:.2f} mm are only {count:.1f} to the patch's semi-axis of {semi_axis:.2f} mm;"
        f" {_FEWEST_ELEMENTS} or more make what the bodies add below it sure",
    )


def _few_nodes(position: Position) -> tuple[str, ...]:
    """What is to be said where the least lobe has fewer nodes than the case asks for, since there would be too many."""
    rung = position.expected.half_space
    least = zip(followed_mm(lobe_sizes(rung)), rung.grid.steps_mm, strict=True)
    count, length = min((length / step, length) for length, step in least)
    if count > _MOST_OF_NODES * position.case.nodes_a_semi_axis:
        return ()
    return (
        f"a lobe of {length:.2g} mm has {count:.0f} pressure nodes in place of {position.case.nodes_a_semi_axis}: in so"
        " wide a patch more would be too many; its own peak and load are known less well than is stated",
    )


def is_open(case: Case, levels: Sequence[Level], placement: Placement, noise: PointNoise | None) -> bool:
    """Whether the verdict on a load is open and another pair of meshes may decide it.

    With `Case.evidence` also that of the elements' own nodes. Elements that are too coarse for where they are look too
    soft or too stiff: finer ones do not, unless they are.
    """
    most = _MOST_FOR_EVIDENCE if case.evidence else _MOST_MESHES
    if any(level.status != "converged" for level in levels) or len(levels) == most:
        return False
    # what the profiles alone leave open no mesh decides
    if noise is not None and _open_by("profiles", case, levels, placement, noise):
        return False
    if elements_off(levels):
        return True
    asked: tuple[Evidence, ...] = ("fe", "elements") if case.evidence else ("fe",)
    return any(_open_by(one, case, levels, placement, noise) for one in asked)


def _open_by(by: Evidence, case: Case, levels: Sequence[Level], placement: Placement, noise: PointNoise | None) -> bool:
    return worst_of(judge_hertz(case, levels, placement, noise, by=by)).answer == "UNRESOLVED"


def would_be_refined(load: JudgedLoad, placement: Placement) -> bool:
    """Whether a new solution would go on where a stored one, as it is judged now, leaves the verdict open."""
    solved = load.solved
    affordable = finer_degrees_of_freedom(solved.levels) <= load.case.refine_degrees_of_freedom
    return affordable and is_open(load.case, solved.levels, placement, solved.point_noise)


def finer_degrees_of_freedom(levels: Sequence[Level]) -> int:
    """Degrees of freedom to expect of the next finer meshes: graded ones grow less than with the cube of MESH_RATIO."""
    fine, coarse = (sum(level.degrees_of_freedom.values()) for level in levels[:2])
    # the uniform zone grows faster than the rest, so that the ratio grows too
    return int(fine * min((fine / coarse) ** 1.2, MESH_RATIO**3))
