"""Theories of the pressure without finite elements: at a case's position, and in contact tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fecontact.case import Case
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, HERTZ_GAUGE, THEORIES, Loaded, gap_line_of
from fecontact.contact_theories.strips import strip
from fecontact.contact_theories.touch_hertz import HertzPoints
from fecontact.errors import InputError
from fecontact.judging.measures import MEASURES, Measures, measures_of_theory
from fecontact.judging.verdict import Answer, Standing, cheapest
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.hertz import direction_of_case, hertz_of_case, hertz_points_of_case
from fecontact.solving.placing import place_case, placed_or_why
from fecontact.solving.position import expect_on_half_space

HALF_SPACE = "half_space"
"""Name of the half-space among `THEORIES`, the only theory that is a solution."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TheoryAlone:
    """A theory at a case's position.

    Attributes
    ----------
    normal_force_N
        Force given to the theory: a vertical load is divided by the cosine of the contact angle at first touch.
    contact
        Contact by the theory; None without a contact, see `problem`.
    """

    name: str
    case: Case
    placement: Placement
    normal_force_N: float
    contact: Approximation | None
    problem: str | None = None

    @property
    def status(self) -> str:
        """Status of the theory's answer; `solved` if the theory is in its range."""
        return "no contact" if self.contact is None else self.contact.status

    @property
    def measures(self) -> Measures | None:
        """Measures of the contact; None without a contact."""
        return None if self.contact is None else measures_of_theory(self.contact)


def theory_alone(case: Case, name: str) -> TheoryAlone:
    """Place a case and evaluate one of `THEORIES` by its name.

    A theory that does not differ from Hertz, such as springs at a single touch point, gives Hertz with a note. Range of
    validity: strips carry the whole force along the normal at first touch. With patches at 17 and 7 degrees to a
    vertical load (S1002 on 60E1, 5 mm, 50 kN) this force is 3 % too large; springs and half-space do not have this
    error.

    Raises
    ------
    InputError
        As in `place_case`, and if there is no ellipse for Hertz, or no contact on the half-space.
    ConvergenceError
        If a patch on the half-space grows without bound.
    """
    placement = place_case(case)
    loaded = Loaded(placement=placement, case=case, normal_force_N=normal_force_of(case, placement))
    if name == HALF_SPACE:
        loaded = replace(loaded, half_space=expect_on_half_space(case, placement)[1].half_space)
    return theory_of(loaded, name)


def theory_of(loaded: Loaded, name: str) -> TheoryAlone:
    """One of `THEORIES` on a loaded placement.

    Raises
    ------
    InputError
        If there is no ellipse for Hertz.
    """
    made = THEORIES[name].approximate(loaded)
    if made is None:
        of_hertz = THEORIES[HERTZ].approximate(loaded)
        assert isinstance(of_hertz, Approximation)
        made = replace(of_hertz, notes=(*of_hertz.notes, f"{THEORIES[name].words}: undefined here, Hertz is shown"))
    contact, problem = (None, made) if isinstance(made, str) else (made, None)
    return TheoryAlone(
        name=name,
        case=loaded.case,
        placement=loaded.placement,
        normal_force_N=loaded.normal_force_N,
        contact=contact,
        problem=problem,
    )


def normal_force_of(case: Case, placement: Placement) -> float:
    """Force (N) along the contact normal at first touch under a case's load, if first touch carries all of it."""
    return case.load_N / float(placement.first.normal @ direction_of_case(case, placement))


# --- Lines of a contact table over lateral shift and load, which a vehicle code looks up instead of solving a contact.

STRIPS = "strip"
"""Name of the strip method among `THEORIES`."""
_CENTRE = "centre_over_b"
# The stiffness of the strips is a difference over this part of the force to either side.
_SIDE = 0.02
_OPEN = Standing(answer="UNRESOLVED")


@dataclass(frozen=True, kw_only=True, eq=False)
class TableLine:
    """A position under one load.

    Attributes
    ----------
    case
        Case with shift and load of the line.
    placement
        Placement; None if the wheel cannot stand, see `problem`.
    hertz, points
        The ellipse at the first touch point, and Hertz's springs at all touch points; None if there is no ellipse.
    strips, strip_stiffness_N_per_mm
        The strip method's contact and its stiffness; None without a contact.
    cheapest
        The cheapest theory whose peak, area, half-widths and centre agree with the strips within the case's criteria;
        open if there are no strips, or strips are out of their range. It is no verdict: nothing is solved.
    problem
        What is missing, in words.
    """

    case: Case
    placement: Placement | None = None
    hertz: HertzContact | None = None
    points: HertzPoints | None = None
    strips: Approximation | None = None
    strip_stiffness_N_per_mm: float | None = None
    cheapest: Standing = _OPEN
    problem: str = ""


def table_lines(case: Case, lateral_shifts_mm: Sequence[float], loads_N: Sequence[float]) -> Iterator[TableLine]:
    """Lines by shift, then load; if a wheel cannot stand, or no ellipse fits, the line gives the problem.

    A wheel is placed once for each shift, or for each load if the roll depends on the load.
    """
    every_load = case.roll == "loaded" and case.roll_load_N is None
    for shift in lateral_shifts_mm:
        placed: Placement | str | None = None
        for load_N in loads_N:
            own = replace(case, lateral_shift_mm=shift, load_N=load_N)
            if placed is None or every_load:
                placed = placed_or_why(own)
            yield TableLine(case=own, problem=placed) if isinstance(placed, str) else _line(own, placed)


def stiffness_at(case: Case) -> tuple[float, float] | None:
    """Approach (mm) and stiffness (N/mm) of the strips at a position; None without a contact."""
    placement = placed_or_why(case)
    if isinstance(placement, str):
        return None
    loaded = Loaded(placement=placement, case=case, normal_force_N=normal_force_of(case, placement))
    strips = THEORIES[STRIPS].approximate(loaded)
    return (strips.approach_mm, _stiffness(loaded)) if isinstance(strips, Approximation) else None


def _line(case: Case, placement: Placement) -> TableLine:
    hertz, problem = None, ""
    try:
        hertz = hertz_of_case(case, placement)
    except InputError as error:
        problem = str(error)
    loaded = Loaded(placement=placement, case=case, normal_force_N=normal_force_of(case, placement))
    line = TableLine(case=case, placement=placement, hertz=hertz, points=hertz_points_of_case(case, placement))
    strips = THEORIES[STRIPS].approximate(loaded)
    if not isinstance(strips, Approximation):
        return replace(line, problem=f"{problem}{'; ' * bool(problem)}{THEORIES[STRIPS].words}: {strips}")
    line = replace(line, strips=strips, strip_stiffness_N_per_mm=_stiffness(loaded), problem=problem)
    if strips.status != "solved":
        return line
    return replace(line, cheapest=cheapest(_standings(loaded, strips), in_range=case.criteria.theories_in_range))


def _stiffness(loaded: Loaded) -> float:
    """Stiffness dF/dapproach of the strips (N/mm), on the gap of their contact."""
    line = gap_line_of(loaded)
    less, more = (strip(line, (1.0 + side) * loaded.normal_force_N) for side in (-_SIDE, _SIDE))
    return (more.normal_force_N - less.normal_force_N) / (more.approach_mm - less.approach_mm)


def _standings(loaded: Loaded, strips: Approximation) -> Iterator[Standing]:
    """Standing of each theory against the strips, the cheapest first; at a junction Hertz must hold on both sides."""
    for name in THEORIES:
        if name == HERTZ_GAUGE:
            continue
        try:
            answers = [THEORIES[side].approximate(loaded) for side in (EITHER_SIDE if name == HERTZ else (name,))]
        except InputError:
            # no ellipse fits
            continue
        made = [one for one in answers if isinstance(one, Approximation)]
        if made:
            within = all(_is_within(one, strips, loaded.case.criteria.limits) for one in made)
            answer: Answer = "HOLDS" if within else "FAILS"
            yield Standing(name=name, answer=answer if made[-1].definite else "UNRESOLVED", made=made[-1])


def _is_within(made: Approximation, strips: Approximation, limits: dict[str, float]) -> bool:
    own, wanted = (measures_of_theory(one).as_dict() for one in (made, strips))
    off = {name: own[name] / wanted[name] - 1.0 for name in MEASURES}
    off[_CENTRE] = (made.centre_mm[1] - strips.centre_mm[1]) / made.half_widths_mm[1]
    return all(abs(off[name]) <= limit for name, limit in limits.items() if name in off)
