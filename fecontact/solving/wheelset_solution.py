"""Both wheels of a wheelset, each solved as a case."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from fecontact.bodies import TrackSide
from fecontact.case import Case, Opposite
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.wheelset import TRACK_SIDES
from fecontact.profiles.reading import can_form_wheelset
from fecontact.solving.placing import make_wheelset
from fecontact.solving.solve import CaseResult, solve

WheelsetCases = Mapping[TrackSide, Case]
"""Case of each wheel."""
WheelsetResults = Mapping[TrackSide, CaseResult | InputError | ConvergenceError]
"""Result of each wheel, or the error for which it has none."""


def list_wheelset_cases(case: Case) -> dict[TrackSide, Case]:
    """List the cases of both wheels of a wheelset.

    Parameters
    ----------
    case
        Case of a wheel.

    Returns
    -------
    dict
        Case of the left wheel and of the right wheel; one of them is the given case.

    Raises
    ------
    InputError
        If the pair has no wheelset, or if an input belongs to a single wheel: creepages and irregularities.

    Examples
    --------
    >>> import fecontact
    >>> from fecontact.solving.wheelset_solution import list_wheelset_cases
    >>> cases = list_wheelset_cases(fecontact.Case(opposite=fecontact.Opposite(wheel_load_N=80e3)))
    >>> cases["right"].load_N, cases["right"].opposite.wheel_load_N
    (80000.0, 100000.0)
    """
    if not can_form_wheelset(case.rail, case.wheel):
        raise InputError(
            f"{case.wheel} on {case.rail} has no wheelset: circles, cylinders and crane rails have none; solve the"
            " wheel alone"
        )
    creepages = {"xi": case.creep.xi, "eta": case.creep.eta, "spin": case.creep.spin_per_mm}
    if given_creepages := [f"{name} is {value:g}" for name, value in creepages.items() if value is not None]:
        raise InputError(
            f"{', '.join(given_creepages)}, but creepages belong to a single wheel; leave them out, so that they follow"
            " from the motion of the wheelset (its yaw, and --speed-ratio in case it drives or brakes)"
        )
    if case.irregularities:
        raise InputError("waves, flats and welds belong to a single wheel; solve each wheel alone")
    other_case = _make_other_case(case)
    return {side: case if side == case.side else other_case for side in TRACK_SIDES}


def _make_other_case(case: Case) -> Case:
    """Make the case of the other wheel from the case of a wheel."""
    side: TrackSide = "right" if case.side == "left" else "left"
    opposite = case.opposite
    other_case = replace(case, side=side)
    if not opposite.is_mirror_image:
        wheelset = make_wheelset(case)
        radii_mm = {"left": wheelset.left.pair.rolling_radius_mm, "right": wheelset.right.pair.rolling_radius_mm}
        other_case = replace(
            other_case,
            rail=opposite.rail or case.rail,
            wheel=opposite.wheel or case.wheel,
            rail_file=opposite.rail_file or case.rail_file,
            wheel_file=opposite.wheel_file or case.wheel_file,
            rolling_radius_mm=radii_mm[side],
            opposite=Opposite(
                rail=case.rail if opposite.rail else None,
                wheel=case.wheel if opposite.wheel else None,
                rail_file=case.rail_file if opposite.rail_file else None,
                wheel_file=case.wheel_file if opposite.wheel_file else None,
                rolling_radius_mm=radii_mm[case.side],
            ),
        )
    if case.roll == "loaded":
        load_N = case.load_N if opposite.wheel_load_N is None else opposite.wheel_load_N
        roll_loads_N = case.roll_loads_N()
        other_case = replace(
            other_case,
            load_N=load_N,
            roll_load_N=None if roll_loads_N[side] == load_N else roll_loads_N[side],
            opposite=replace(
                other_case.opposite,
                wheel_load_N=None if roll_loads_N[side] == roll_loads_N[case.side] else roll_loads_N[case.side],
            ),
        )
    return other_case


def solve_wheelset(case: Case, *, progress: Callable[[str], None] | None = None) -> WheelsetResults:
    """Solve both wheels of a wheelset, each as by `solve`.

    Shift, yaw and roll are those of the wheelset. The case supplies the inputs of its side, and `opposite` those of the
    other side.

    Parameters
    ----------
    case
        Case of a wheel.
    progress
        Called with the name of each step as it begins, after the side of the wheel.

    Returns
    -------
    mapping
        Result of the left wheel and of the right wheel. A wheel that cannot be solved has its error instead.

    Raises
    ------
    InputError
        As in `list_wheelset_cases`, and if neither wheel can be solved.

    Examples
    --------
    >>> import fecontact
    >>> case = fecontact.Case(lateral_shift_mm=4.0, resolution="quick", refine="never")
    >>> {side: result.status for side, result in fecontact.solve_wheelset(case).items()}
    {'left': 'converged', 'right': 'converged'}
    """
    results: dict[TrackSide, CaseResult | InputError | ConvergenceError] = {}
    for side, wheel_case in list_wheelset_cases(case).items():
        try:
            results[side] = solve(wheel_case, progress=_name_steps(side, progress))
        except (InputError, ConvergenceError) as error:
            results[side] = error
    errors = [result for result in results.values() if not isinstance(result, CaseResult)]
    if len(errors) == len(results):
        raise errors[0]
    return results


def _name_steps(side: TrackSide, progress: Callable[[str], None] | None) -> Callable[[str], None] | None:
    """Progress with the side before the name of each step."""
    if progress is None:
        return None
    return lambda name: progress(f"{side} wheel: {name}" if ": " not in name else f"{side} wheel, {name}")
