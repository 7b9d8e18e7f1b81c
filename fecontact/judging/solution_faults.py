"""Errors of the program that the numbers of a solution show: a wrong gap, load or correction."""

from __future__ import annotations

from collections.abc import Iterator

from fecontact.judging.solved_load import SolvedLoad

GAP_CURVATURE_LIMIT = 1e-3
"""Largest error of the gap's second differences at the contact point, relative to the largest curvature.

Of 350 random pairs of the library (inclinations 0 to 1:20, shifts of -8 to 7 mm, 15 to 160 kN) half have at most 3e-7,
and the largest error is 2e-5. A pair with a junction at 0.014 mm from the contact point has 3e-5. A gap with an error
of 1 % has 1e-2.
"""
GAP_DISTANCE_LIMIT_MM = 1e-4
"""Largest difference between the gap on solved nodes and the distance of the meshes' surfaces.

Of 800 such pairs half have at most 2e-10 mm. The largest difference is 1.7e-5 mm, where the spline passes a curvature
junction. An error of 1 micrometre at 5 mm from the contact point changes the half-width by 1.5 %. The limit therefore
allows a change of 0.15 %, which is half of the stated uncertainty of the half-width.
"""
LOAD_ERROR_LIMIT = 1e-9
"""Largest difference between the load of a contact and the load of the case, relative to the load of the case.

Of 135 random contacts (104 of several patches, 7 with yaw, measured pairs) the largest difference is 2.4e-15. Contact
solvers scale every pressure to the load, so that a larger difference is an error of the program.
"""
CORRECTION_ERROR_LIMIT = 0.3
"""Largest fraction of the elements' softness that may be left in the contact on the finer nodes, by magnitude.

Of the same 135 contacts half have at most 0.004, 95 % at most 0.045, and the largest fraction is 0.095 (60E1 upright
with S1002, -5.4 mm, 143 kN). A correction that is left out has 1, a doubled correction -1. The limit is the geometric
mean of 0.095 and 1.
"""


def describe_solution_faults(solved_load: SolvedLoad) -> tuple[str, ...]:
    """Errors of a solution beyond their limits, in words.

    Parameters
    ----------
    solved_load
        Load with its errors: `SolvedLoad.gap_curvature_error`, `SolvedLoad.load_error`, `Level.gap_distance_error_mm`
        and `Level.correction_error`.

    Returns
    -------
    tuple of str
        A sentence for each error beyond its limit; empty for a correct solution.
    """
    return tuple(f"the numbers are wrong, please report this case: {fault}" for fault in _iterate_faults(solved_load))


def _iterate_faults(solved_load: SolvedLoad) -> Iterator[str]:
    """Words for each error beyond its limit.

    An error of NaN is beyond its limit.
    """
    error = solved_load.gap_curvature_error
    if error is not None and not error <= GAP_CURVATURE_LIMIT:
        yield (
            f"the curvatures of the solved gap at the contact point differ by {error:.2%} from the curvatures of the"
            f" profiles (at most {GAP_CURVATURE_LIMIT:.1%} is allowed)"
        )
    distances = [level.gap_distance_error_mm for level in solved_load.levels if level.gap_distance_error_mm is not None]
    if distances and not max(distances) <= GAP_DISTANCE_LIMIT_MM:
        yield (
            f"the solved gap differs by up to {1e3 * max(distances):.2g} micrometres from the distance of the mesh"
            f" surfaces (at most {1e3 * GAP_DISTANCE_LIMIT_MM:g} micrometres is allowed)"
        )
    if solved_load.load_error is not None and not solved_load.load_error <= LOAD_ERROR_LIMIT:
        yield (
            f"the load on the nodes of a contact differs by {solved_load.load_error:.2g} of itself from the load of the"
            f" case (at most {LOAD_ERROR_LIMIT:g} is allowed)"
        )
    wrong_corrections = [
        level.correction_error
        for level in solved_load.levels
        if level.correction_error is not None and not abs(level.correction_error) <= CORRECTION_ERROR_LIMIT
    ]
    if wrong_corrections:
        yield (
            f"the correction of the elements' softness on the finer nodes is wrong by {wrong_corrections[0]:.0%} of"
            f" itself (at most {CORRECTION_ERROR_LIMIT:.0%} is allowed)"
        )
