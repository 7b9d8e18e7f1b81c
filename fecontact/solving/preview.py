"""A case before it is solved: position, expected patch and mesh, and about what the solution will cost."""

from __future__ import annotations

from dataclasses import dataclass

from fecontact.case import Case
from fecontact.geometry.placement import Placement
from fecontact.solving.cost import START_SECONDS, cpu_seconds, memory_GB, unknowns_of
from fecontact.solving.expected_patch import ExpectedPatch
from fecontact.solving.measured_lines import hertz_uncertainty
from fecontact.solving.placing import place_case
from fecontact.solving.position import MARGIN_ELEMENTS, element_size_mm, expect_on_half_space
from fecontact.solving.zone import fine_zone
from fecontact.theory.hertz import HertzContact


@dataclass(frozen=True, kw_only=True, eq=False)
class Preview:
    """What is known of a case without finite elements.

    Attributes
    ----------
    hertz
        At the first touch point under the case's load.
    hertz_uncertainty
        What measured profiles leave open of its peak pressure and semi-axes (relative); None for exact lines.
    expected
        The patch under the true gap on a half-space.
    element_size_mm, elements
        Along x and across: sizes, and how many there are in the fine zone.
    degrees_of_freedom, cpu_seconds, memory_GB
        Of `fecontact solve` on its first meshes, to 10 % and to a factor of two; a refinement takes up to
        `Case.refine_degrees_of_freedom`.
    """

    case: Case
    placement: Placement
    hertz: HertzContact
    hertz_uncertainty: dict[str, float] | None
    expected: ExpectedPatch
    element_size_mm: tuple[float, float]
    elements: tuple[int, int]
    degrees_of_freedom: int
    cpu_seconds: float
    memory_GB: float


def preview(case: Case) -> Preview:
    """Place a case and expect its patch and the cost of its solution.

    >>> import fecontact
    >>> seen = fecontact.place(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(seen.placement.first.rail_y_mm, 1), seen.elements[1] > seen.elements[0]
    (-13.8, True)

    Raises
    ------
    InputError, ConvergenceError
        As `expect_on_half_space` does.
    """
    placement = place_case(case)
    hertz, expected = expect_on_half_space(case, placement)
    sizes = element_size_mm(case, expected)
    lengths = (max(expected.x_high_mm, -expected.x_low_mm), expected.s_high_mm - expected.s_low_mm)
    along_x = round(lengths[0] / sizes[0]) + MARGIN_ELEMENTS
    across = round(lengths[1] / sizes[1]) + 2 * MARGIN_ELEMENTS
    # patches far apart have fewer between them
    if (zone := fine_zone(expected, sizes)).bands:
        across = zone.intervals_s
    unknowns = unknowns_of(along_x, across, half=case.half)
    return Preview(
        case=case,
        placement=placement,
        hertz=hertz,
        hertz_uncertainty=hertz_uncertainty(case, placement),
        expected=expected,
        element_size_mm=sizes,
        elements=(along_x, across),
        degrees_of_freedom=int(unknowns),
        cpu_seconds=START_SECONDS + cpu_seconds(unknowns),
        memory_GB=memory_GB(unknowns),
    )
