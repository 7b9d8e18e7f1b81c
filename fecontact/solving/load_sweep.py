"""Several loads at one position with the factors reused, and the stiffness of the contact over the load.

Assembly and factors do not depend on the load: after the first load of a mesh each further one costs only its contact
iterations, started from the half-space pressure.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from fecontact.case import NODES_A_SEMI_AXIS, Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judging import judge_load
from fecontact.comparison.theories import HERTZ
from fecontact.errors import ConvergenceError, InputError, check_positive
from fecontact.solving.meshes import Meshes
from fecontact.solving.position import Position, position_of

# Loads share meshes whose elements are at most so many times finer than the largest of them asks for: a coarse mesh
# that served all loads would have too few elements for the smallest, and a fine one too many for the largest.
_MOST_FINER = 1.5
# An expected semi-axis is a number of nodes, so that a load between two others may ask for so many times finer elements
# than either: meshes for such loads have them.
_SPARE = 1.0 + 1.0 / NODES_A_SEMI_AXIS
# Rounding of what is asked for twice.
_SAME = 1.0 + 1e-9


class LoadSweep:
    """A position that is solved for one load after the other.

    Loads are best given from the largest down: each goes to the smallest meshes made for a load at least as large on
    which its patch has the elements that the resolution asks for. Only one set of meshes is in memory at a time.

    Parameters
    ----------
    planned_N
        Loads to come; meshes are made so that some of them can share them.
    """

    def __init__(self, case: Case, planned_N: Sequence[float] = ()) -> None:
        """Place the case; its own load does not matter."""
        self._position = _placed(case, planned_N)
        self.placement = self._position.placement
        self._planned: dict[float, Position] = {}
        for load_N in sorted(set(planned_N), reverse=True):
            # a load that cannot be solved says so when it is its turn
            with suppress(InputError, ConvergenceError):
                self._planned[load_N] = self._position.for_load(load_N)
        self._groups: list[Meshes] = []
        self._open: Meshes | None = None

    def solve(self, load_N: float, *, refine: bool = True) -> JudgedLoad:
        """Solve one load; with `refine` on finer meshes too while its verdict is open, as the case allows.

        It is judged by Hertz alone, which decides about refinement and the next load: what is stored is judged by all
        theories when it is read.

        Raises
        ------
        InputError
            As `fecontact.solve` does.
        """
        check_positive("load", load_N, "N", "give the wheel load")
        wanted = self._planned.get(load_N) or self._position.for_load(load_N)
        if not refine:
            wanted = replace(wanted, case=_elastic(unrefined(wanted.case)))
        meshes = self._meshes_for(wanted)
        if self._open is not meshes:
            self.close()
            self._open = meshes
        solved = meshes.solve(wanted)
        with wanted.clock.step("judge"):
            return judge_load(solved, self.placement, (HERTZ,))

    def is_ready_for(self, load_N: float) -> bool:
        """Whether a planned load goes to the meshes whose factors are in memory."""
        wanted = self._planned.get(load_N)
        return wanted is not None and self._open is not None and self._open is self._group_of(wanted)

    def close(self) -> None:
        """Release the factors; the sweep may go on, with new ones."""
        if self._open is not None:
            self._open.close()
            self._open = None

    def _group_of(self, wanted: Position) -> Meshes | None:
        fitting = [group for group in self._groups if _serves(group.position, wanted)]
        return min(fitting, key=lambda group: group.position.case.load_N) if fitting else None

    def _meshes_for(self, wanted: Position) -> Meshes:
        if (group := self._group_of(wanted)) is not None:
            return group
        # a load between planned ones is not the last there: the meshes serve all of them
        above = min((load for load in self._planned if load >= wanted.case.load_N), default=None)
        largest = wanted if above is None else self._planned[above]
        sharing = [wanted]
        for load_N, planned in self._planned.items():
            if load_N < wanted.case.load_N and _finer(planned, largest) <= _MOST_FINER:
                sharing.append(planned)
        spare = 1.0 if above in (None, wanted.case.load_N) else _SPARE
        made = Meshes(_made_for(largest, sharing, spare), keep=True)
        self._groups.append(made)
        return made


def _made_for(largest: Position, sharing: Sequence[Position], spare: float) -> Position:
    """The position under its largest load, with elements as fine as any of the loads that share them asks for."""
    along_x, across = (min(one.element_size_mm[k] for one in sharing) / spare for k in (0, 1))
    parts = []
    for part in largest.expected.parts:
        asked = min(one.widest_element_mm(part.s_low_mm, part.s_high_mm) for one in sharing)
        parts.append(replace(part, larger=max(1.0, min(part.larger, asked / spare / across))))
    expected = replace(largest.expected, parts=tuple(parts))
    return replace(largest, element_size_mm=(along_x, across), expected=expected, several_loads=True)


def unrefined(case: Case) -> Case:
    """The case without refinement, solved on its first two meshes and no others."""
    return replace(case, refine_degrees_of_freedom=0)


def _elastic(case: Case) -> Case:
    """The case with bodies that never yield."""
    rail, wheel = (replace(body, yield_MPa=None) for body in (case.rail_material, case.wheel_material))
    return replace(case, rail_material=rail, wheel_material=wheel)


def _placed(case: Case, planned_N: Sequence[float]) -> Position:
    """The position of a case under the largest of its loads that can be expected; which one does not matter."""
    try:
        return position_of(case)
    except (InputError, ConvergenceError):
        for load_N in sorted(set(planned_N) - {case.load_N}, reverse=True):
            with suppress(InputError, ConvergenceError):
                return position_of(replace(case, load_N=load_N))
        raise


def _finer(planned: Position, meshed: Position) -> float:
    """How many times finer elements one load asks for than meshes made for another have."""
    pairs = zip(meshed.element_size_mm, planned.element_size_mm, strict=True)
    return max(here / there for here, there in pairs)


def _serves(meshed: Position, wanted: Position) -> bool:
    """Whether meshes made for one load hold the patch of another with enough elements."""
    # the margin around the expected patch, and the zone's growth, take what a smaller load reaches beyond
    if _finer(wanted, meshed) > _SAME or meshed.case.load_N < wanted.case.load_N:
        return False
    # patches far apart have elements of different widths, and need not shrink alike
    return len(meshed.expected.parts) == 1 or all(
        meshed.widest_element_mm(part.s_low_mm, part.s_high_mm)
        <= _SAME * wanted.widest_element_mm(part.s_low_mm, part.s_high_mm)
        for part in wanted.expected.parts
    )
