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
    >>> fecontact.rows(result)[0]["hertz_deviation_p_max_percent"] == 100 * result.load.deviation["p_max_MPa"]
    True
    >>> figure = fecontact.plot.case(result)
    >>> fecontact.mesh(result, "rail").n_cells == result.load.level.elements["rail"]
    True

Many cases are solved by `fecontact.run(CASES, FOLDER)`, shifts and loads by `fecontact.map(CASE, SHIFTS, LOADS,
FOLDER)`; `fecontact.load(FOLDER)` reads back what they and `fecontact solve --out` wrote, and `fecontact.judge(FOLDER)`
judges it again. What needs no finite elements: `fecontact.hertz`, `theory`, `table`, `place` and `geometry` of a case,
`creep` of an ellipse, a vehicle in a `curve`, and the list of `theories`. The commands of these names do the same and
print it.
"""

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from fecontact import plot
    from fecontact.case import Case, Opposite
    from fecontact.creep import Creep
    from fecontact.criteria import Criteria
    from fecontact.dimensions import BodySize, Track
    from fecontact.irregularity.shapes import Irregularity
    from fecontact.material import Material
    from fecontact.outputs.meshes.dataset import mesh
    from fecontact.outputs.records.results import rows
    from fecontact.profiles.given import profile
    from fecontact.profiles.reading import Reading
    from fecontact.runs.analytic import creep, hertz, theories
    from fecontact.runs.contact_table import table
    from fecontact.runs.curving import curve
    from fecontact.runs.irregular import irregular
    from fecontact.runs.judging import judge
    from fecontact.runs.load import load
    from fecontact.runs.run import run
    from fecontact.solving.preview import preview as place
    from fecontact.solving.solve import CaseResult, solve
    from fecontact.vehicle.conditions import Conditions

__all__ = [
    "BodySize",
    "Case",
    "CaseResult",
    "Conditions",
    "Creep",
    "Criteria",
    "Irregularity",
    "Material",
    "Opposite",
    "Reading",
    "Track",
    "__version__",
    "creep",
    "curve",
    "geometry",
    "hertz",
    "irregular",
    "judge",
    "load",
    "map",
    "mesh",
    "place",
    "plot",
    "profile",
    "rows",
    "run",
    "solve",
    "table",
    "theories",
    "theory",
]

_HOMES = {
    "BodySize": "dimensions.BodySize",
    "Case": "case.Case",
    "Conditions": "vehicle.conditions.Conditions",
    "CaseResult": "solving.solve.CaseResult",
    "Creep": "creep.Creep",
    "Criteria": "criteria.Criteria",
    "Irregularity": "irregularity.shapes.Irregularity",
    "Material": "material.Material",
    "Opposite": "case.Opposite",
    "Reading": "profiles.reading.Reading",
    "Track": "dimensions.Track",
    "curve": "runs.curving.curve",
    "hertz": "runs.analytic.hertz",
    "irregular": "runs.irregular.irregular",
    "judge": "runs.judging.judge",
    "load": "runs.load.load",
    "mesh": "outputs.meshes.dataset.mesh",
    "profile": "profiles.given.profile",
    "place": "solving.preview.preview",
    "rows": "outputs.records.results.rows",
    "run": "runs.run.run",
    "solve": "solving.solve.solve",
    "table": "runs.contact_table.table",
    "theories": "runs.analytic.theories",
}
_HOMES_OF_ROOMS = {
    "creep": "runs.analytic.creep",
    "geometry": "runs.wheelset.geometry",
    "map": "runs.run.map_",
    "theory": "runs.analytic.theory",
}


def _at(home: str) -> Any:
    module, _, name = home.rpartition(".")
    return getattr(import_module(f"fecontact.{module}"), name)


class _Room(ModuleType):
    """A module of the package that is called as the function of its name, whose signature and help it shows."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return self.__wrapped__(*args, **options)

    @property
    def __wrapped__(self) -> Any:
        return _at(_HOMES_OF_ROOMS[self.__name__.rpartition(".")[2]])

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        text: str | None = self.__wrapped__.__doc__
        return text


for _name in _HOMES_OF_ROOMS:
    import_module(f"fecontact.{_name}").__class__ = _Room


def __getattr__(name: str) -> Any:
    # the command line must answer --help at once: nothing heavy is imported before it is used
    if name == "plot":
        return import_module("fecontact.plot")
    if name in _HOMES:
        return _at(_HOMES[name])
    raise AttributeError(f"module 'fecontact' has no attribute {name!r}")


def __dir__() -> list[str]:
    # what is imported here for the annotations is nobody's business
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
