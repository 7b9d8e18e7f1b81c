"""Where does Hertz's ellipse hold for a railway wheel on a rail?

The pipeline, step by step:

1. Profiles: a rail and a wheel as lines of exact segments.

    >>> from fecontact.profiles import load
    >>> rail, wheel = load("60E1"), load("S1002")

2. Placement: the wheel on the rail, where the rigid bodies touch.

    >>> from fecontact.placement import place
    >>> position = place(rail, wheel, inclination_rad=1 / 40, lateral_shift_mm=4.0)
    >>> round(position.first.rail_y_mm, 1)
    -13.6

3. Hertz: the ellipse that vehicle codes use there.

    >>> from fecontact.hertz import hertz_from_hessian
    >>> from fecontact.material import STEEL, contact_modulus_MPa
    >>> ellipse = hertz_from_hessian(
    ...     position.first.curvatures[0].hessian,
    ...     normal_force_N=100e3,
    ...     contact_modulus_MPa=contact_modulus_MPa(STEEL, STEEL),
    ... )
    >>> round(ellipse.p0_MPa, -1)
    1500.0

4. Meshing, elasticity, contact and comparison: `fecontact.solve(Case(...))` does all of it and returns a `CaseResult`.
"""

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from fecontact.case import Case
    from fecontact.solving.solve import CaseResult, solve

__all__ = ["Case", "CaseResult", "__version__", "solve"]


def __getattr__(name: str) -> Any:
    # the command line must answer --help at once: nothing heavy is imported before it is used
    if name == "Case":
        from fecontact import case

        return case.Case
    if name in ("CaseResult", "solve"):
        from fecontact.solving import solve as pipeline

        return getattr(pipeline, name)
    raise AttributeError(f"module 'fecontact' has no attribute {name!r}")
