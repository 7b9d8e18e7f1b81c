"""A case before it is solved: position, expected patch and mesh, and about what the solution will cost."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape

from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.cost import START_SECONDS, cpu_seconds, memory_GB, times_by_yielding, unknowns_of
from fecontact.solving.element_sizes import element_size_mm
from fecontact.solving.expected_patch import ExpectedPatch
from fecontact.solving.fine_zone import MARGIN_ELEMENTS, fine_zone
from fecontact.solving.placing import place_case
from fecontact.solving.position import ROUGH_NODES, expect_on_half_space, refuse_too_long
from fecontact.solving.profile_variants import hertz_uncertainty, lines_by_label

# Of each line that points allow, under each load: 0.23, 0.24, 0.30, 0.69 and 2.1 s at five positions of the worn pair
# of `fecontact profiles --examples`; the most where patches lie far apart.
_LINE_SECONDS = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Preview:
    """What is known of a case without finite elements.

    Attributes
    ----------
    hertz
        At the first touch point under the case's load.
    expected
        The patch under the true gap on a half-space.
    element_size_mm, elements
        Along x and across: sizes, and how many there are in the fine zone.
    degrees_of_freedom, cpu_seconds, memory_GB
        Of `fecontact solve` on its first meshes, to 10 % and to a factor of two (at 5.5 mm on 60E1, where two patches
        are far apart, 1.6 times as many unknowns as there are); a refinement takes up to `Case.most_unknowns`.
    lines_seconds
        The part of `cpu_seconds` for the lines that points allow, which each load takes; 0 for exact lines.
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
        """What measured profiles leave open of Hertz's peak pressure and semi-axes (relative); None for exact lines."""
        return hertz_uncertainty(self.case, self.placement)

    def __repr__(self) -> str:
        case, points = self.case, len(self.placement.touch_points)
        return (
            f"<Preview {case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {case.load_N / 1e3:g} kN:"
            f" {points} touch points, Hertz {self.hertz.p0_MPa:.0f} MPa, about {self.cpu_seconds:.0f} s to solve>"
        )

    def _repr_html_(self) -> str:
        points = {
            f"touch point {number}": {
                "rail y in mm": f"{one.rail_y_mm:.2f}",
                "wheel y in mm": f"{one.wheel_y_mm:.2f}",
                "contact angle in mrad": f"{1e3 * one.contact_angle_rad:.1f}",
            }
            for number, one in enumerate(self.placement.touch_points, start=1)
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(points, orient='index').to_html()}"


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
    return _preview(case, place_case(case))


def preview_to_solve(case: Case) -> Preview:
    """As `preview`, of a case that is to be solved: a patch that is far longer than the bodies is refused first.

    The patch is that of few nodes, as the cost is told to a factor of two.
    """
    placement = place_case(case)
    refuse_too_long(case, placement)
    return _preview(case, placement, nodes=ROUGH_NODES)


def _preview(case: Case, placement: Placement, *, nodes: int | None = None) -> Preview:
    hertz, expected = expect_on_half_space(case, placement, nodes=nodes)
    sizes = element_size_mm(case, expected)
    lengths = (max(expected.x_high_mm, -expected.x_low_mm), expected.s_high_mm - expected.s_low_mm)
    along_x = round(lengths[0] / sizes[0]) + MARGIN_ELEMENTS
    across = round(lengths[1] / sizes[1]) + 2 * MARGIN_ELEMENTS
    # patches far apart have fewer between them
    if (zone := fine_zone(expected, sizes)).bands:
        across = zone.intervals_s
    unknowns = unknowns_of(along_x, across, half=case.half)
    others = {*lines_by_label(placement.rail.profile), *lines_by_label(placement.wheel.profile)}
    lines_seconds = _LINE_SECONDS * (1 + len(others)) if others else 0.0
    return Preview(
        case=case,
        placement=placement,
        hertz=hertz,
        expected=expected,
        element_size_mm=sizes,
        elements=(along_x, across),
        degrees_of_freedom=int(unknowns),
        cpu_seconds=START_SECONDS + times_by_yielding(case, hertz.p0_MPa) * cpu_seconds(unknowns) + lines_seconds,
        lines_seconds=lines_seconds,
        memory_GB=memory_GB(unknowns),
    )
