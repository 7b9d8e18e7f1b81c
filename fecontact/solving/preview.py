"""Preview of a case: position, expected patch and mesh, and estimated cost of the solution."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape

from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.cost import (
    START_SECONDS,
    estimate_cpu_seconds,
    estimate_memory_GB,
    estimate_unknowns,
    estimate_yield_factor,
)
from fecontact.solving.element_sizes import choose_element_size_mm
from fecontact.solving.expected_patch import ExpectedPatch
from fecontact.solving.fine_zone import MARGIN_ELEMENTS, make_fine_zone
from fecontact.solving.placing import place_case
from fecontact.solving.position import ROUGH_NODES, expect_on_half_space, refuse_too_long
from fecontact.solving.profile_variants import estimate_hertz_uncertainty, list_profile_variants

# CPU seconds per profile variant under each load: 0.23, 0.24, 0.30, 0.69 and 2.1 s at five positions of the worn pair
# of `fecontact profiles --examples`. The largest time is for patches at a large distance.
_VARIANT_SECONDS = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Preview:
    """Preview of a case without finite elements.

    Attributes
    ----------
    case, placement
        Case, and its wheel on its rail.
    hertz
        Hertz's ellipse at the first contact point under the load of the case.
    expected
        Patch under the true gap on a half-space.
    element_size_mm, elements
        Sizes of the elements along x and across, and their numbers in the fine zone.
    degrees_of_freedom, cpu_seconds, memory_GB
        Cost of `fecontact solve` on its first meshes, to 10 % and to a factor of two (at 5.5 mm on 60E1, where two
        patches are at a large distance, the estimate is 1.6 times the number of unknowns). A refinement takes up to
        `Case.most_unknowns`.
    lines_seconds
        Part of `cpu_seconds` for the profile variants, for each load; 0 for exact profiles.
    """

    case: Case
    placement: Placement
    hertz: HertzContact
    expected: ExpectedPatch
    element_size_mm: tuple[float, float]
    elements: tuple[int, int]
    degrees_of_freedom: int
    cpu_seconds: float
    lines_seconds: float
    memory_GB: float

    @cached_property
    def hertz_uncertainty(self) -> dict[str, float] | None:
        """Relative uncertainty of Hertz's peak pressure and semi-axes from measured profiles.

        None for exact profiles.
        """
        return estimate_hertz_uncertainty(self.case, self.placement)

    def __repr__(self) -> str:
        case, point_count = self.case, len(self.placement.contact_points)
        return (
            f"<Preview {case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {case.load_N / 1e3:g} kN:"
            f" {point_count} contact points, Hertz {self.hertz.p0_MPa:.0f} MPa, about {self.cpu_seconds:.0f} s to"
            " solve>"
        )

    def _repr_html_(self) -> str:
        """HTML for a notebook: summary, and a table of the contact points.

        Positions on both profiles are in mm, contact angles in mrad.
        """
        points = {
            f"contact point {number}": {
                "rail y in mm": f"{contact_point.rail_y_mm:.2f}",
                "wheel y in mm": f"{contact_point.wheel_y_mm:.2f}",
                "contact angle in mrad": f"{1e3 * contact_point.contact_angle_rad:.1f}",
            }
            for number, contact_point in enumerate(self.placement.contact_points, start=1)
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(points, orient='index').to_html()}"


def preview_case(case: Case) -> Preview:
    """Place a case, and estimate its patch and the cost of its solution.

    Parameters
    ----------
    case
        Case with profiles, position and load.

    Returns
    -------
    Preview
        Expected patch and estimated cost.

    Raises
    ------
    InputError, ConvergenceError
        As in `expect_on_half_space`.

    Examples
    --------
    >>> import fecontact
    >>> seen = fecontact.place(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(seen.placement.first.rail_y_mm, 1), seen.elements[1] > seen.elements[0]
    (-13.8, True)
    """
    return _make_preview(case, place_case(case))


def preview_case_to_solve(case: Case) -> Preview:
    """Preview of a case that will be solved, on few nodes.

    A patch that is much longer than the bodies is refused first. Few nodes are sufficient, since the cost is estimated
    to a factor of two.

    Parameters
    ----------
    case
        Case with profiles, position and load.

    Returns
    -------
    Preview
        Expected patch and estimated cost.

    Raises
    ------
    InputError, ConvergenceError
        As in `expect_on_half_space`, and if the patch is too long.
    """
    placement = place_case(case)
    refuse_too_long(case, placement)
    return _make_preview(case, placement, nodes=ROUGH_NODES)


def _make_preview(case: Case, placement: Placement, *, nodes: int | None = None) -> Preview:
    """Preview of a placed case, from its half-space contact.

    `nodes` is the number of pressure nodes per semi-axis for the half-space; None for the number of the case. The
    preview has estimates of degrees of freedom, CPU seconds and memory in GB; no mesh is made.
    """
    hertz, expected = expect_on_half_space(case, placement, nodes=nodes)
    size_mm = choose_element_size_mm(case, expected)
    lengths_mm = (max(expected.x_high_mm, -expected.x_low_mm), expected.s_high_mm - expected.s_low_mm)
    elements_x = round(lengths_mm[0] / size_mm[0]) + MARGIN_ELEMENTS
    elements_s = round(lengths_mm[1] / size_mm[1]) + 2 * MARGIN_ELEMENTS
    # Patches at a large distance have fewer elements between them.
    if (zone := make_fine_zone(expected, size_mm)).bands:
        elements_s = zone.intervals_s
    unknowns = estimate_unknowns(elements_x, elements_s, half=case.half)
    variant_labels = {*list_profile_variants(placement.rail.profile), *list_profile_variants(placement.wheel.profile)}
    lines_seconds = _VARIANT_SECONDS * (1 + len(variant_labels)) if variant_labels else 0.0
    return Preview(
        case=case,
        placement=placement,
        hertz=hertz,
        expected=expected,
        element_size_mm=size_mm,
        elements=(elements_x, elements_s),
        degrees_of_freedom=int(unknowns),
        cpu_seconds=START_SECONDS
        + estimate_yield_factor(case, hertz.p0_MPa) * estimate_cpu_seconds(unknowns)
        + lines_seconds,
        lines_seconds=lines_seconds,
        memory_GB=estimate_memory_GB(unknowns),
    )
