"""One theory of the pressure alone at a case's position: what a vehicle code would say there."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fecontact.case import Case
from fecontact.comparison.approximation import Approximation
from fecontact.comparison.measures import Measures, measures_of_theory
from fecontact.comparison.theories import HERTZ, THEORIES, Loaded
from fecontact.geometry.placement import Placement
from fecontact.solving.placing import place_case
from fecontact.solving.position import direction_of_case, expect_on_half_space

HALF_SPACE = "half_space"
"""The theory that is a solution, by the name it has among `THEORIES`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TheoryAlone:
    """A theory at a case's position.

    Attributes
    ----------
    normal_force_N
        That it is given: of a vertical load that over the cosine of the contact angle at first touch.
    contact
        What it says; None where it has no contact, see `problem`.
    """

    name: str
    case: Case
    placement: Placement
    normal_force_N: float
    contact: Approximation | None
    problem: str | None = None

    @property
    def status(self) -> str:
        """What the theory says of its own answer in a word; `solved` where it is in its range."""
        return "no contact" if self.contact is None else self.contact.status

    @property
    def measures(self) -> Measures | None:
        """Its measures; None where it has no contact."""
        return None if self.contact is None else measures_of_theory(self.contact)


def theory_alone(case: Case, name: str) -> TheoryAlone:
    """Place a case and evaluate one of `THEORIES` by its name.

    A theory that says nothing of its own, such as springs at a single touch point, is Hertz, and says so. Range of
    validity: strips carry the whole force along the normal at first touch; where patches stand at 17 and 7 degrees to a
    vertical load (S1002 on 60E1, 5 mm, 50 kN) that is 3 % more than it takes, which springs and half-space know.

    Raises
    ------
    InputError
        As `place_case` does, and where there is no ellipse for Hertz, or no contact on the half-space.
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
        Where there is no ellipse for Hertz.
    """
    made = THEORIES[name].approximate(loaded)
    if made is None:
        of_hertz = THEORIES[HERTZ].approximate(loaded)
        assert isinstance(of_hertz, Approximation)
        made = replace(
            of_hertz, notes=(*of_hertz.notes, f"{THEORIES[name].words}: nothing of its own here, it is Hertz")
        )
    problem = made if isinstance(made, str) else None
    return TheoryAlone(
        name=name,
        case=loaded.case,
        placement=loaded.placement,
        normal_force_N=loaded.normal_force_N,
        contact=None if isinstance(made, str) else made,
        problem=problem,
    )


def normal_force_of(case: Case, placement: Placement) -> float:
    """Force (N) along the contact normal at first touch under a case's load, if that touch point carries all of it."""
    return case.load_N / float(placement.first.normal @ direction_of_case(case, placement))
