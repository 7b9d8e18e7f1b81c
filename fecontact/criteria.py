"""Criteria of a verdict, and the friction and creepages of a case.

No solution depends on them: a solved case can be judged again by different criteria.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields, replace
from typing import Any

from fecontact.errors import InputError
from fecontact.feature_registry import find_places
from fecontact.inputs.kinds import Number, choice_field, flag_field, input_field, number_field
from fecontact.inputs.slots import input_dataclass
from fecontact.own_criterion import OwnCriterion, UnavailableFunction


def _limit(default: float, measure: str, help: str, key: str) -> Any:
    """Describe the limit of a measure, with label, range and remedy for messages.

    Parameters
    ----------
    default
        Limit as a fraction (no unit).
    measure
        Key of the measure in the deviations.
    help
        Deviation that the limit bounds, as the end of a phrase.
    key
        Key in files; a key that ends in `_percent` is shown in %.
    """
    percent = key.endswith("_percent")
    limit = Number(
        label=f"limit of {measure}",
        help=f"Largest allowed {help}",
        key=key,
        shown_unit="%" if percent else "",
        high=1.0,
        inclusive=False,
        remedy=f"for example {default:g} for {100.0 * default:g} %" if percent else f"for example {default:g}",
    )
    return input_field(default, limit, measure=measure)


_SETS = {
    "strength": ("p_max",),
    "patch": ("area", "a", "b", "centre"),
    "all": ("p_max", "area", "a", "b", "centre", "valley", "separate", "misplaced"),
}
# Only Python has criteria of a user, so that texts about options do not list this set.
_OWN_ALONE = {"own": ()}


@input_dataclass
class Criteria:
    """Limits of the deviations of Hertz from the finite elements, and the measures that decide.

    Limits of peak pressure, area and half-widths are relative. The limit of the centre of pressure is a fraction of
    Hertz's half-width b. The limit of the valley between two lobes is a fraction of the peak. The limits of the load on
    separate patches and of the misplaced load are fractions of the load (`judging.measures.Misfit`).

    Attributes
    ----------
    p_max, area, a, b, centre, valley, separate, misplaced
        Limits of the measures (no unit).
    own
        Criteria of a user, each with a Python function; None and `()` for none. If stored results are judged again,
        None keeps the stored criteria of the user, and `()` leaves them out. Only Python has them.
    judged_by
        Measures by the names of the fields here, or sets of measures: `strength` for the stress below the surface,
        which follows the peak; `patch` for creep forces and wear, which use the axes and the place of the ellipse;
        `all` for users who take the ellipse for the contact patch. The measures of `own` always decide; with `own`
        here they decide alone.
    theories_out_of_range
        Whether theories outside their range are included in the choice of the cheapest theory that holds.

    Examples
    --------
    >>> from fecontact.criteria import Criteria
    >>> Criteria(judged_by=("strength",)).limits
    {'p_max_MPa': 0.05}
    """

    p_max: float = _limit(0.05, "p_max_MPa", "deviation of Hertz in peak pressure", "p_max_percent")
    area: float = _limit(0.10, "area_mm2", "deviation of Hertz in patch area", "area_percent")
    a: float = _limit(0.10, "a_mm", "deviation of Hertz in half-width a along x", "a_percent")
    b: float = _limit(0.10, "b_mm", "deviation of Hertz in half-width b across", "b_percent")
    centre: float = _limit(
        0.15,
        "centre_over_b",
        "distance of the centre of pressure from the first contact point, divided by b",
        "centre_over_b",
    )
    valley: float = _limit(
        0.10, "valley", "drop of the pressure between two lobes, relative to the peak", "valley_percent"
    )
    separate: float = _limit(
        0.001, "separate_load", "load on separate patches, relative to the whole load", "separate_load_percent"
    )
    misplaced: float = _limit(
        0.10,
        "misplaced_load",
        "load outside the pressure of Hertz, relative to the whole load",
        "misplaced_load_percent",
    )
    judged_by: tuple[str, ...] = choice_field(
        ("all",),
        f"Measures that decide the verdict, or sets of measures (patch: {', '.join(_SETS['patch'])}; strength: p_max)",
        (*_SETS, *_SETS["all"], *_OWN_ALONE),
        domain=f"sets {', '.join(_SETS)}; measures {', '.join(_SETS['all'])}; separated by commas",
        each=True,
    )
    theories_out_of_range: bool = flag_field(
        "Include theories outside their range in the choice of the cheapest theory that holds, marked as out of range"
    )

    own: tuple[OwnCriterion, ...] | None = None

    def __post_init__(self) -> None:
        """Refuse criteria of a user that are not distinct, and criteria without a measure."""
        # JSON has lists and no tuples
        object.__setattr__(self, "judged_by", tuple(self.judged_by))
        if self.own is not None:
            criteria: Any = (self.own,) if isinstance(self.own, OwnCriterion) else self.own
            if not isinstance(criteria, list | tuple) or not all(
                isinstance(criterion, OwnCriterion) for criterion in criteria
            ):
                raise InputError(f"own is {self.own!r:.80}; allowed: an OwnCriterion(...), or a tuple of them")
            names = [criterion.name for criterion in criteria]
            if repeated := next((name for name in names if names.count(name) > 1), None):
                raise InputError(f"own has {repeated!r} more than once; give each criterion a different name")
            object.__setattr__(self, "own", tuple(criteria))
        if not self.limits:
            raise InputError(
                "judged_by is 'own', but there is no own criterion; give own=OwnCriterion(...), in Python, or other"
                f" measures: {', '.join((*_SETS, *_SETS['all']))}"
            )

    @property
    def limits(self) -> dict[str, float]:
        """Limits of the measures that decide, by the name of the measure."""
        return self.common_limits | {criterion.key: criterion.limit for criterion in self.own or ()}

    def apply_change(self, change: Criteria | Mapping[str, Any] | None) -> Criteria:
        """Criteria of stored results after a change.

        Parameters
        ----------
        change
            Complete criteria, which keep the criteria of the user here if their `own` is None; or the changed values by
            the names of the fields; or None for no change.

        Returns
        -------
        Criteria
            The changed criteria.

        Examples
        --------
        >>> from fecontact.criteria import Criteria
        >>> Criteria(judged_by=("strength",)).apply_change({"p_max": 0.03}).limits
        {'p_max_MPa': 0.03}
        """
        if isinstance(change, Criteria):
            return change if change.own is not None else replace(change, own=self.own)
        return replace(self, **(change or {}))

    def refuse_unsendable_own(self) -> None:
        """Refuse criteria of a user with functions that worker processes cannot import.

        Raises
        ------
        InputError
            As in `OwnCriterion.refuse_unsendable`.
        """
        for criterion in self.own or ():
            criterion.refuse_unsendable()

    def describe_unavailable_own(self, stored_measures: Collection[str]) -> tuple[list[str], list[str]]:
        """Describe the criteria of a user without a function in this process, with the remedy.

        Parameters
        ----------
        stored_measures
            Names of the measures with stored values.

        Returns
        -------
        tuple of list of str
            Messages about criteria with stored values, and about criteria that are not judged.
        """
        stored_texts, unjudged_texts = [], []
        for criterion in self.own or ():
            if not isinstance(criterion.function, UnavailableFunction):
                continue
            remedy = "fecontact.judge(FOLDER, fecontact.Criteria(own=...)) in Python"
            reason = f"own criterion {criterion.name}: {criterion.function.reason}"
            if criterion.key in stored_measures:
                stored_texts.append(
                    f"{reason}; its stored values are used, with its stored limit; to judge by a different limit or"
                    f" function, use {remedy}"
                )
            else:
                unjudged_texts.append(f"{reason}, and no values are stored; to judge by it, use {remedy}")
        return stored_texts, unjudged_texts

    @property
    def own_measures(self) -> list[str]:
        """Names of the measures of a user."""
        return [criterion.key for criterion in self.own or ()]

    @property
    def record(self) -> dict[str, Any]:
        """Plain values for a file; criteria of a user are included if they are given."""
        values = {
            criterion.name: getattr(self, criterion.name) for criterion in fields(self) if criterion.name != "own"
        }
        return values if self.own is None else {**values, "own": [criterion.record for criterion in self.own]}

    @property
    def common_criteria(self) -> Criteria | None:
        """Criteria without the criteria of a user; None if these decide alone."""
        return replace(self, own=None) if self.common_limits else None

    @property
    def common_limits(self) -> dict[str, float]:
        """Limits of the measures that decide, without the criteria of a user."""
        sets = _SETS | _OWN_ALONE
        chosen = {name for set_or_measure in self.judged_by for name in sets.get(set_or_measure, (set_or_measure,))}
        return {
            limit.metadata["measure"]: getattr(self, limit.name)
            for limit in fields(self)
            if "measure" in limit.metadata and limit.name in chosen
        }

    def refuse_own(self, purpose: str) -> None:
        """Refuse criteria of a user for a purpose that cannot use them.

        Parameters
        ----------
        purpose
            Work that needs criteria without a function, as the subject of the message.

        Raises
        ------
        InputError
            With the names of the criteria and the remedy.
        """
        if self.own:
            names = ", ".join(criterion.name for criterion in self.own)
            raise InputError(
                f"{purpose} cannot use own criteria ({names}); leave own out, and judge single cases by it"
            )


# --- Friction and creepages of a case. Forces are evaluated from its pressure with them, without a new solution.

FRICTION = Number(
    label="friction coefficient",
    help="Coefficient of friction",
    high=2.0,
    inclusive=False,
    remedy="dry steel has 0.3 to 0.6, wet steel 0.1 to 0.3",
)
"""Description of the friction coefficient, for every input of a friction coefficient."""


def _creepage(help: str, label: str, remedy: str = "give it relative to the rolling speed: 0.001 is 0.1 %") -> Any:
    return number_field(None, help, label=label, low=-1.0, high=1.0, remedy=remedy)


@input_dataclass
class Creep:
    """Friction and creepages of the wheel on the rail, at the first contact point.

    Without friction all of them are None. Creepages that are not given are computed for a wheelset that runs along the
    track. It turns at `speed_ratio` times the speed that rolls its tape circle. The longitudinal creepage follows from
    the rolling radius at the contact point, the lateral creepage from the yaw, and the spin from the contact angle.

    These creepages are valid at the contact point, and for its tangent plane over the whole patch. With `curved` the
    creepages follow the surfaces across the real patch.

    Attributes
    ----------
    friction
        Friction coefficient (no unit); None if no forces are evaluated.
    xi, eta
        Longitudinal and lateral creepage (no unit); xi > 0 if the wheel slides forward, eta > 0 towards the field side.
    spin_per_mm
        Spin about the normal of the contact, in 1/mm.
    speed_ratio
        Speed of rotation relative to the speed that rolls the tape circle (no unit).
    curved
        Whether the creepages follow the surfaces across the patch.
    force_limit
        Limit of the deviation of the creep force, as a fraction of mu N.
    largest_creepage
        Largest longitudinal and lateral creepage for which forces are judged (no unit).

    Examples
    --------
    >>> import fecontact
    >>> case = fecontact.Case(creep=fecontact.Creep(friction=0.3, xi=1e-3))
    >>> case.creep.spin_per_mm is None
    True
    """

    friction: float | None = input_field(
        None, replace(FRICTION, help="Coefficient of friction; if it is given, creep forces are computed")
    )
    xi: float | None = _creepage("Longitudinal creepage, > 0 if the wheel slides forward", "creepage xi")
    eta: float | None = _creepage("Lateral creepage, > 0 towards the field side", "creepage eta")
    spin_per_mm: float | None = _creepage(
        "Spin about the contact normal",
        "spin",
        "give it in 1/mm: sin(contact angle) / rolling radius, for example 0.0001 on a tread",
    )
    speed_ratio: float = number_field(
        1.0,
        "Speed of rotation relative to the speed that rolls the tape circle; above 1 the wheel drives",
        high=2.0,
        remedy="a free wheel has 1, a driven wheel a few thousandths more",
    )
    curved: bool = flag_field(
        "Compute the creepages on the real patch from the local rolling radius and contact angle",
        label="curved surfaces",
    )
    force_limit: float = _limit(
        0.05, "the creep force", "deviation of Hertz's creep force, relative to mu N", "force_percent"
    )
    largest_creepage: float = number_field(
        0.02,
        "Largest longitudinal and lateral creepage at which creep forces are judged",
        low=1e-4,
        high=0.5,
        remedy="0.02 is 2 %, at which most contacts slide",
    )

    @property
    def asked(self) -> bool:
        """Whether forces are to be evaluated."""
        return self.friction is not None

    def apply_change(self, change: Creep | Mapping[str, Any] | None) -> Creep:
        """Friction and creepages of stored results after a change.

        Parameters
        ----------
        change
            Complete values, without an effect if they have no friction; or the changed values by the names of the
            fields; or None for no change.

        Returns
        -------
        Creep
            The changed values.

        Raises
        ------
        InputError
            If values are changed and there is no friction.
        """
        if isinstance(change, Creep):
            return change if change.asked else self
        if not change:
            return self
        changed = replace(self, **change)
        changed.refuse_unheard()
        return changed

    def refuse_unheard(self) -> None:
        """Refuse creepages without friction, and friction that no feature evaluates.

        Such inputs would have no effect.

        Raises
        ------
        InputError
            With the input that is missing, or the feature that is missing.
        """
        if self.asked and "creep" not in find_places("READINGS"):
            raise InputError(
                f"friction coefficient is {self.friction:g}, but creep forces need the feature creep, which is not"
                " installed; leave friction out, or install fecontact with all its features"
            )
        for creep_field in () if self.asked else fields(self):
            if (value := getattr(self, creep_field.name)) != creep_field.default:
                label = creep_field.metadata["input"].label
                raise InputError(
                    f"{label} is {value!r}, but no friction coefficient is given; give friction too, for example 0.3"
                )
