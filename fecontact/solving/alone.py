"""Theories of the pressure without finite elements, at a position and in contact tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from fecontact.case import Case
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import (
    HERTZ,
    HERTZ_GAUGE,
    HERTZ_OF_EACH_SIDE,
    THEORIES,
    LoadedPlacement,
)
from fecontact.contact_theories.rolling.creepage import combine_materials
from fecontact.contact_theories.rolling.kalker import LinearCreep, calculate_linear_creep
from fecontact.contact_theories.strips import solve_strip_theory
from fecontact.contact_theories.touch_hertz import HertzAtContactPoints
from fecontact.errors import InputError
from fecontact.judging.measures import MEASURES, Measures, read_theory_measures
from fecontact.judging.verdict import Answer, TheoryAnswer, find_cheapest_theory
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.hertz import compute_hertz, compute_hertz_points, compute_load_direction
from fecontact.solving.placing import place_case, place_or_explain
from fecontact.solving.position import expect_on_half_space

HALF_SPACE = "half_space"
"""Name of the half-space among `THEORIES`; it is the only theory that solves a contact."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TheoryEvaluation:
    """Theory at the position of a case.

    Attributes
    ----------
    name
        Name of the theory.
    case, placement
        Case, and its wheel on its rail.
    normal_force_N
        Force given to the theory: a vertical load is divided by the cosine of the contact angle at first contact.
    contact
        Contact by the theory; None without a contact, see `problem`.
    problem
        Reason for a missing contact, in words.
    """

    name: str
    case: Case
    placement: Placement
    normal_force_N: float
    contact: TheoryContact | None
    problem: str | None = None

    @property
    def status(self) -> str:
        """Status of the theory's contact; `solved` if the theory is in its range."""
        return "no contact" if self.contact is None else self.contact.status

    @property
    def measures(self) -> Measures | None:
        """Measures of the contact; None without a contact."""
        return None if self.contact is None else read_theory_measures(self.contact)


def evaluate_theory(case: Case, name: str) -> TheoryEvaluation:
    """Place a case and evaluate a theory by its name in `THEORIES`.

    A theory that does not differ from Hertz, such as springs at a single contact point, gives Hertz with a note. Range
    of validity: strips carry the whole force along the normal at first contact. With patches at 17 and 7 degrees to a
    vertical load (S1002 on 60E1, 5 mm, 50 kN) this force is 3 % too large; springs and half-space do not have this
    error.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    name
        Name of the theory.

    Returns
    -------
    TheoryEvaluation
        Contact by the theory, or the reason why there is none.

    Raises
    ------
    InputError
        As in `place_case`, and if there is no ellipse for Hertz, or no contact on the half-space.
    ConvergenceError
        If a patch on the half-space grows without bound.

    Examples
    --------
    >>> import fecontact
    >>> from fecontact.solving.alone import evaluate_theory
    >>> evaluate_theory(fecontact.Case(), "strip").status
    'solved'
    """
    placement = place_case(case)
    loaded = LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
    if name == HALF_SPACE:
        loaded = replace(loaded, half_space=expect_on_half_space(case, placement)[1].half_space)
    return evaluate_loaded_theory(loaded, name)


def evaluate_loaded_theory(loaded: LoadedPlacement, name: str) -> TheoryEvaluation:
    """Evaluate a theory on a loaded placement.

    Parameters
    ----------
    loaded
        Placement with case, normal force and half-space contact.
    name
        Name of the theory in `THEORIES`.

    Returns
    -------
    TheoryEvaluation
        Contact by the theory, or the reason why there is none.

    Raises
    ------
    InputError
        If there is no ellipse for Hertz.
    """
    theory_contact = THEORIES[name].approximate(loaded)
    if theory_contact is None:
        hertz_contact = THEORIES[HERTZ].approximate(loaded)
        assert isinstance(hertz_contact, TheoryContact)
        theory_contact = replace(
            hertz_contact, notes=(*hertz_contact.notes, f"{THEORIES[name].words}: not defined here; Hertz is shown")
        )
    contact, problem = (None, theory_contact) if isinstance(theory_contact, str) else (theory_contact, None)
    return TheoryEvaluation(
        name=name,
        case=loaded.case,
        placement=loaded.placement,
        normal_force_N=loaded.normal_force_N,
        contact=contact,
        problem=problem,
    )


def compute_normal_force(case: Case, placement: Placement) -> float:
    """Normal force at first contact under the load of a case, in N.

    The first contact point is assumed to carry the whole load.

    Parameters
    ----------
    case
        Case with its load in N.
    placement
        The wheel on the rail.

    Returns
    -------
    float
        Normal force in N.
    """
    return case.load_N / float(placement.first.normal @ compute_load_direction(case, placement))


# --- Lines of a contact table over lateral shift, yaw and load, for vehicle codes that look up a contact instead of
# solving it.

STRIPS = "strip"
"""Name of the strip method among `THEORIES`."""
_CENTRE = "centre_over_b"
# The stiffness of the strips is a difference quotient over this fraction of the force on either side. Strips begin and
# end to carry in steps, by up to 0.08 % of the approach: over 2 % of the force the stiffness of S1002 on 60E1 between
# 3.5 and 4.4 mm scatters by up to 3.6 %, over 5 % by 1.3 %, over 10 % by 0.7 %. Over 10 % the quotient of Hertz's
# spring is 0.1 % below its tangent.
_FORCE_STEP = 0.1
_UNRESOLVED = TheoryAnswer(answer="UNRESOLVED")


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactTableRow:
    """Line of a contact table: a position under a single load.

    Attributes
    ----------
    case
        Case with shift, yaw and load of the line.
    placement
        Placement; None if the wheel cannot stand, see `problem`.
    hertz, points
        Ellipse at the first contact point, and Hertz's springs at all contact points; None if there is no ellipse.
    strips, strip_stiffness_N_per_mm
        Contact by the strip method and its stiffness; None without a contact.
    cheapest
        Cheapest theory with peak, area, half-widths and centre that agree with the strips within the case's criteria;
        UNRESOLVED if there are no strips, or if the strips are out of their range. It is not a verdict: no contact is
        solved.
    hertz_creep
        Kalker's coefficients of `hertz`; None without an ellipse or outside their range.
    spring_creep
        Kalker's coefficients of the ellipse of each entry of `points`, under its share of the load; None for an entry
        without an ellipse or outside their range.
    creep_note
        Reason for missing coefficients, in words.
    problem
        Description of the missing quantities, in words.
    """

    case: Case
    placement: Placement | None = None
    hertz: HertzContact | None = None
    points: HertzAtContactPoints | None = None
    strips: TheoryContact | None = None
    strip_stiffness_N_per_mm: float | None = None
    cheapest: TheoryAnswer = _UNRESOLVED
    hertz_creep: LinearCreep | None = None
    spring_creep: tuple[LinearCreep | None, ...] = ()
    creep_note: str = ""
    problem: str = ""


def iterate_table_rows(
    case: Case, lateral_shifts_mm: Sequence[float], loads_N: Sequence[float], yaws_rad: Sequence[float] | None = None
) -> Iterator[ContactTableRow]:
    """Lines of a contact table, by shift, then yaw, then load.

    A wheel is placed once for each shift and yaw, or for each load if the roll depends on the load.

    Parameters
    ----------
    case
        Case with profiles and criteria.
    lateral_shifts_mm, loads_N
        Lateral shifts in mm and loads in N.
    yaws_rad
        Yaws of the wheelset in rad; None for the yaw of the case.

    Yields
    ------
    ContactTableRow
        Line with its problem if a wheel cannot stand, or if no ellipse fits.
    """
    case.criteria.refuse_own("a contact table without finite elements")
    needs_placement_per_load = case.roll == "loaded" and case.roll_load_N is None
    for shift_mm, yaw_rad in product(lateral_shifts_mm, [case.yaw_rad] if yaws_rad is None else yaws_rad):
        placement: Placement | str | None = None
        for load_N in loads_N:
            line_case = replace(case, lateral_shift_mm=shift_mm, yaw_rad=yaw_rad, load_N=load_N)
            if placement is None or needs_placement_per_load:
                placement = place_or_explain(line_case)
            yield (
                ContactTableRow(case=line_case, problem=placement)
                if isinstance(placement, str)
                else _make_line(line_case, placement)
            )


def compute_strip_stiffness(case: Case) -> tuple[float, float] | None:
    """Approach and stiffness of the strips at a position.

    Parameters
    ----------
    case
        Case with profiles, position and load.

    Returns
    -------
    tuple of float or None
        Approach in mm and stiffness in N/mm; None without a contact.
    """
    placement = place_or_explain(case)
    if isinstance(placement, str):
        return None
    loaded = LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
    strips = THEORIES[STRIPS].approximate(loaded)
    return (strips.approach_mm, _strip_stiffness(loaded)) if isinstance(strips, TheoryContact) else None


def _make_line(case: Case, placement: Placement) -> ContactTableRow:
    """Row of a contact table at a placement, with Hertz, springs and strips.

    Theories without a solution give a text in `problem`; their fields stay empty. The cheapest theory is found only if
    the strips are solved, because the strips are its reference.
    """
    hertz, problem = None, ""
    try:
        hertz = compute_hertz(case, placement)
    except InputError as error:
        problem = str(error)
    loaded = LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
    line = _add_linear_creep(
        ContactTableRow(case=case, placement=placement, hertz=hertz, points=compute_hertz_points(case, placement))
    )
    strips = THEORIES[STRIPS].approximate(loaded)
    if not isinstance(strips, TheoryContact):
        return replace(line, problem=f"{problem}{'; ' * bool(problem)}{THEORIES[STRIPS].words}: {strips}")
    line = replace(line, strips=strips, strip_stiffness_N_per_mm=_strip_stiffness(loaded), problem=problem)
    if strips.status != "solved":
        return line
    return replace(
        line,
        cheapest=find_cheapest_theory(
            _iterate_standings(loaded, strips), in_range=not case.criteria.theories_out_of_range
        ),
    )


def _add_linear_creep(line: ContactTableRow) -> ContactTableRow:
    """Row with Kalker's coefficients of its ellipses.

    The friction, which the pair of materials needs, has no influence on them.
    """
    pair = combine_materials(1.0, line.case.wheel_material, line.case.rail_material)
    points = () if line.points is None else line.points.points
    creeps: list[LinearCreep | None] = []
    notes = []
    for ellipse in (line.hertz, *(point.shared for point in points)):
        creep = None
        if ellipse is not None:
            try:
                creep = calculate_linear_creep(
                    *ellipse.rolling_semi_axes_mm, shear_MPa=pair.shear_MPa, poisson=pair.poisson
                )
            except InputError as error:
                notes.append(f"without Kalker's coefficients: {error}")
        creeps.append(creep)
    hertz_creep, *spring_creep = creeps
    return replace(
        line,
        hertz_creep=hertz_creep,
        spring_creep=tuple(spring_creep),
        creep_note="; ".join(dict.fromkeys(notes)),
    )


def _strip_stiffness(loaded: LoadedPlacement) -> float:
    """Stiffness dF/dapproach of the strips (N/mm), on the gap of their contact."""
    gap_line = loaded.gap_line
    lower, higher = (
        solve_strip_theory(gap_line, (1.0 + step) * loaded.normal_force_N) for step in (-_FORCE_STEP, _FORCE_STEP)
    )
    return (higher.normal_force_N - lower.normal_force_N) / (higher.approach_mm - lower.approach_mm)


def _iterate_standings(loaded: LoadedPlacement, strips: TheoryContact) -> Iterator[TheoryAnswer]:
    """Answer for each theory compared with the strips, the cheapest theory first.

    At a junction Hertz must hold on both sides.
    """
    for name in THEORIES:
        if name == HERTZ_GAUGE:
            continue
        try:
            results = [
                THEORIES[side].approximate(loaded) for side in (HERTZ_OF_EACH_SIDE if name == HERTZ else (name,))
            ]
        except InputError:
            # No ellipse fits the contact.
            continue
        contacts = [contact for contact in results if isinstance(contact, TheoryContact)]
        if contacts:
            is_within_limits = all(_is_within(contact, strips, loaded.case.criteria.limits) for contact in contacts)
            answer: Answer = "HOLDS" if is_within_limits else "FAILS"
            yield TheoryAnswer(name=name, answer=answer if contacts[-1].definite else "UNRESOLVED", made=contacts[-1])


def _is_within(contact: TheoryContact, strips: TheoryContact, limits: dict[str, float]) -> bool:
    """Whether a theory agrees with the strips within the limits of all measures."""
    theory_values, strip_values = (read_theory_measures(theory).as_dict() for theory in (contact, strips))
    deviation = {name: theory_values[name] / strip_values[name] - 1.0 for name in MEASURES}
    deviation[_CENTRE] = (contact.centre_mm[1] - strips.centre_mm[1]) / contact.half_widths_mm[1]
    return all(abs(deviation[name]) <= limit for name, limit in limits.items() if name in deviation)
