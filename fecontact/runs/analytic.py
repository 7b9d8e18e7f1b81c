"""What needs no finite elements, as plain dictionaries with units in their keys: what `--json` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fecontact.alone.position import theory_alone
from fecontact.case import Case
from fecontact.creep import Creep
from fecontact.material import STEEL, Material
from fecontact.outputs.records.results import ellipse_creep, hertz_record
from fecontact.outputs.records.theory_alone import alone_record, check_theory, theories_listed
from fecontact.solving.hertz_alone import hertz_alone
from fecontact.theory.creep.contact import Creepages, RollingEllipse
from fecontact.theory.creep.on_ellipse import forces_on_ellipse

Record = dict[str, Any]


def hertz(case: Case) -> Record:
    """Hertz's theory alone at a case's position: `hertz` is what a result is compared with.

    >>> import fecontact
    >>> record = fecontact.hertz(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(record["ellipses"][0]["p_max_MPa"], -1)
    1480.0

    `ellipses` has every touch point, and both sides of a junction, as if each carried the whole load; where the
    surfaces conform there is no ellipse, and `problem` says so.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do.
    """
    return hertz_record(hertz_alone(case))


def theory(case: Case, name: str) -> Record:
    """One theory of the pressure alone at a case's position, such as `strip` or `multi_hertz`; `theories` lists them.

    >>> import fecontact
    >>> found = fecontact.theory(fecontact.Case(lateral_shift_mm=4.0), "strip")
    >>> found["status"], round(found["p_max_MPa"], -1)
    ('solved', 1480.0)

    `status` is `solved` where the theory is in its range; `notes` say why it is not. `solutions` is the number of
    approaches that were found to carry the force, and `problem` why there is no contact.

    Raises
    ------
    InputError
        For a name that there is not; as `place_case` does, and where there is no ellipse for Hertz.
    """
    check_theory(name)
    return alone_record(theory_alone(case, name))


def theories() -> Record:
    """The theories of the pressure and the laws of creep forces that are judged, from the cheapest.

    >>> import fecontact
    >>> list(fecontact.theories()["pressure"])[0], list(fecontact.theories()["forces"])[-1]
    ('hertz', 'real')
    """
    return theories_listed()


def creep(
    *,
    a_mm: float,
    b_mm: float,
    normal_force_N: float,
    friction: float,
    creepages: tuple[float, float, float] = (0.0, 0.0, 0.0),
    young_MPa: float = STEEL.young_MPa,
    poisson: float = STEEL.poisson,
    theories: Sequence[str] = ("all",),
) -> Record:
    """Creep forces on an ellipse by some theories, or by `all` that cover it; analytic, no mesh.

    >>> import fecontact
    >>> found = fecontact.creep(
    ...     a_mm=5.8, b_mm=8.5, normal_force_N=100e3, friction=0.3, creepages=(0.001, 0.0, 0.0), theories=["polach"]
    ... )
    >>> -found["limit_N"] < found["theories"]["polach"]["fx_N"] < 0.0
    True

    Parameters
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    normal_force_N, friction
        Normal force, and coefficient of friction.
    creepages
        Longitudinal and lateral creepage of the wheel over the rolling speed, and spin in 1/mm.
    young_MPa, poisson
        Of both bodies.
    theories
        Names of theories, or `all`.

    Raises
    ------
    InputError
        For values out of range, and if a theory that was named does not cover the ellipse or the creepages.
    """
    xi, eta, spin = creepages
    # in the ranges of a case
    Creep(friction=friction, xi=xi, eta=eta, spin_per_mm=spin)
    both = Material(name="both", young_MPa=young_MPa, poisson=poisson)
    contact = RollingEllipse(
        a_mm=a_mm,
        b_mm=b_mm,
        normal_force_N=normal_force_N,
        friction=friction,
        shear_MPa=both.shear_MPa,
        poisson=poisson,
    )
    return ellipse_creep(forces_on_ellipse(contact, Creepages(xi=xi, eta=eta, spin_per_mm=spin), theories))
