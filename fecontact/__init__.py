"""Where does Hertz's ellipse hold for a railway wheel on a rail?

The story, step by step:

1. Profiles: a rail and a wheel as lines of exact segments.

    >>> from fecontact.profiles.library import load as profile
    >>> rail, wheel = profile("60E1"), profile("S1002")

2. Placement: the wheel on the rail, where the rigid bodies touch.

    >>> from fecontact.geometry.placement import place
    >>> position = place(rail, wheel, inclination_rad=1 / 40, lateral_shift_mm=4.0)
    >>> round(position.first.rail_y_mm, 1)
    -13.6

3. Hertz: the ellipse that vehicle codes use there.

    >>> from fecontact.material import STEEL, contact_modulus_MPa
    >>> from fecontact.theory.hertz import hertz_from_hessian
    >>> ellipse = hertz_from_hessian(
    ...     position.first.curvatures[0].hessian,
    ...     normal_force_N=100e3,
    ...     contact_modulus_MPa=contact_modulus_MPa(STEEL, STEEL),
    ... )
    >>> round(ellipse.p0_MPa, -1)
    1500.0

4. Solve: both bodies by finite elements, on two meshes.

    >>> import fecontact
    >>> case = fecontact.Case(lateral_shift_mm=4.0, resolution="quick", refine_degrees_of_freedom=0)
    >>> result = fecontact.solve(case)
    >>> result.status
    'converged'

5. Ladder: what each step from Hertz to the finite elements moves; all rungs carry the same force.

    >>> [name for name in result.load.ladder.rungs]
    ['hertz', 'half_space_quadratic', 'half_space', 'elements', 'fe']
    >>> abs(result.load.ladder.steps["half_space_to_bodies"]["p_max_MPa"]) < 0.02
    True

6. Verdict: whether Hertz holds, by which measure, and how sure that is.

    >>> result.verdict.answer, result.verdict.measure
    ('HOLDS', 'misplaced_load')
    >>> abs(result.load.deviation["p_max_MPa"]) < 0.05 - result.load.uncertainty["p_max_MPa"]
    True

7. Fields, rows and pictures: NumPy arrays, dictionaries for pandas, matplotlib, pyvista.

    >>> result
    <CaseResult 60E1 and S1002, +4.00 mm, 100 kN: converged, Hertz HOLDS by misplaced_load>
    >>> dx, ds = result.grid.steps_mm
    >>> round(float(result.pressure_MPa.sum() * dx * ds / result.normal_force_N), 3)
    1.0
    >>> fecontact.rows(result)[0]["p_max_deviation_percent"] == 100 * result.load.deviation["p_max_MPa"]
    True
    >>> figure = fecontact.plot.case(result)
    >>> fecontact.mesh(result, "rail").n_cells == result.load.level.elements["rail"]
    True

Many cases are solved by `fecontact.run(CASES, FOLDER)`, and `fecontact.load(FOLDER)` reads back what it wrote, and
what `fecontact solve --out`, `run` and `map` wrote.
"""

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from fecontact import plot
    from fecontact.case import Case
    from fecontact.criteria import Criteria
    from fecontact.outputs.dataset import mesh
    from fecontact.outputs.rows import rows
    from fecontact.runs.load import load
    from fecontact.runs.run import run
    from fecontact.solving.solve import CaseResult, solve

__all__ = ["Case", "CaseResult", "Criteria", "__version__", "load", "mesh", "plot", "rows", "run", "solve"]

_HOMES = {
    "Case": "fecontact.case",
    "Criteria": "fecontact.criteria",
    "CaseResult": "fecontact.solving.solve",
    "solve": "fecontact.solving.solve",
    "load": "fecontact.runs.load",
    "run": "fecontact.runs.run",
    "rows": "fecontact.outputs.rows",
    "mesh": "fecontact.outputs.dataset",
}


def __getattr__(name: str) -> Any:
    # the command line must answer --help at once: nothing heavy is imported before it is used
    from importlib import import_module

    if name == "plot":
        return import_module("fecontact.plot")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'fecontact' has no attribute {name!r}")


def __dir__() -> list[str]:
    # what is imported here for the annotations is nobody's business
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
