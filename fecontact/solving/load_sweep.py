"""Several loads at one position with the factors reused, and the stiffness of the contact over the load.

Assembly and factors do not depend on the load: after the first load of a mesh each further one costs only its contact
iterations, started from the half-space pressure.
"""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.errors import check_positive
from fecontact.solving.meshes import Meshes
from fecontact.solving.position import Position, Progress, position_of

# A load whose patch has fewer than this part of the elements that the resolution asks for gets meshes of its own.
# Patches grow with the cube root of the load: one set of meshes serves loads down to about a fifth of its largest.
_LEAST_ELEMENTS = 0.6


class LoadSweep:
    """A position that is solved for one load after the other.

    Loads are best given from the largest down: each goes to the smallest meshes made for a load at least as large on
    which its patch has enough elements. Only one set of meshes is in memory at a time.
    """

    def __init__(self, case: Case, *, progress: Progress | None = None) -> None:
        """Place the case; its own load does not matter."""
        self._position = position_of(case, progress=progress)
        self.placement = self._position.placement
        self._groups: list[Meshes] = []
        self._open: Meshes | None = None

    def solve(self, load_N: float) -> JudgedLoad:
        """Solve one load.

        Raises
        ------
        InputError
            As `fecontact.solve` does.
        """
        wanted = self._position.for_load(check_positive("load", load_N, "N", "give the wheel load"))
        meshes = self._meshes_for(wanted)
        if self._open is not meshes:
            self.close()
            self._open = meshes
        return meshes.solve(load_N)

    def close(self) -> None:
        """Release the factors; the sweep may go on, with new ones."""
        if self._open is not None:
            self._open.close()
            self._open = None

    @property
    def groups_N(self) -> tuple[float, ...]:
        """The loads that meshes were made for."""
        return tuple(group.position.case.load_N for group in self._groups)

    def _meshes_for(self, wanted: Position) -> Meshes:
        fitting = [group for group in self._groups if _serves(group.position, wanted)]
        if fitting:
            return min(fitting, key=lambda group: group.position.case.load_N)
        made = Meshes(wanted, keep=True)
        self._groups.append(made)
        return made


def _serves(meshed: Position, wanted: Position) -> bool:
    """Whether meshes made for one load hold the patch of another with enough elements."""
    fine_enough = all(
        _LEAST_ELEMENTS * size <= needed
        for size, needed in zip(meshed.element_size_mm, wanted.element_size_mm, strict=True)
    )
    # the margin around the expected patch, and the zone's growth, take what a smaller load reaches beyond
    return fine_enough and meshed.case.load_N >= wanted.case.load_N


def solve_loads(case: Case, loads_N: Sequence[float], progress: Progress | None = None) -> tuple[JudgedLoad, ...]:
    """Solve several loads at the position of a case with the factors reused.

    Returns
    -------
    tuple of JudgedLoad
        In the order of the loads.

    Raises
    ------
    InputError
        As `fecontact.solve` does, for the first load that cannot be solved.
    """
    sweep = LoadSweep(case, progress=progress)
    try:
        solved = {load: sweep.solve(load) for load in sorted(set(loads_N), reverse=True)}
    finally:
        sweep.close()
    return tuple(solved[load] for load in loads_N)
