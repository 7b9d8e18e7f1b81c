"""Where does Hertz's ellipse hold for a railway wheel on a rail?

From a profile to a verdict, step by step:

1. Profiles: a rail and a wheel, made of exact segments.

    >>> from fecontact.profiles.library import load_library_profile as profile
    >>> rail, wheel = profile("60E1"), profile("S1002")

2. Placement: the wheel on the rail, with the contact points of the rigid bodies.

    >>> from fecontact.placement.wheel_on_rail import place
    >>> position = place(rail, wheel, inclination_rad=1 / 40, lateral_shift_mm=4.0)
    >>> round(position.first.rail_y_mm, 1)
    -13.6

3. Hertz: the ellipse that vehicle codes use for this position.

    >>> from fecontact.bodies import STEEL, combine_moduli_MPa
    >>> from fecontact.contact_theories.hertz import hertz_from_hessian
    >>> ellipse = hertz_from_hessian(
    ...     position.first.curvatures[0].hessian,
    ...     normal_force_N=100e3,
    ...     contact_modulus_MPa=combine_moduli_MPa(STEEL, STEEL),
    ... )
    >>> round(ellipse.p0_MPa, -1)
    1500.0

4. Solve: both bodies by finite elements, on two meshes.

    >>> import fecontact
    >>> case = fecontact.Case(lateral_shift_mm=4.0, resolution="quick", refine="never")
    >>> result = fecontact.solve(case)
    >>> result.status
    'converged'

5. Ladder: the change by each step from Hertz to the finite elements; all rungs carry the same force.

    >>> [name for name in result.load.ladder.rungs]
    ['hertz', 'half_space_quadratic', 'half_space', 'elements', 'fe']
    >>> abs(result.load.ladder.steps["half_space_to_bodies"]["p_max_MPa"]) < 0.02
    True

6. Verdict: whether Hertz holds, the deciding measure, and the uncertainty.

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
FOLDER)`; `fecontact.load(FOLDER)` reads results of these functions and of `fecontact solve --out`, and
`fecontact.judge(FOLDER)` judges them again. Functions without finite elements are `fecontact.hertz`, `theory`, `table`,
`place` and `geometry` of a case, `creep` of an ellipse, a vehicle in a `curve`, and the list of `theories`. Commands
with these names print the result.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fecontact.feature_registry import find_public_names, import_place

__version__ = "0.1.0"

if TYPE_CHECKING:
    from fecontact import plot
    from fecontact.bodies import BodySize, Material, Track
    from fecontact.case import Case, Opposite
    from fecontact.criteria import Creep, Criteria
    from fecontact.features.creep.running import creep as creep
    from fecontact.features.curves.conditions import Conditions as Conditions
    from fecontact.features.curves.running import curve as curve
    from fecontact.features.irregular.running import irregular as irregular
    from fecontact.outputs.frames import to_dataframe, to_xarray
    from fecontact.outputs.mesh_dataset import mesh
    from fecontact.outputs.records.result_schema import result_schema
    from fecontact.outputs.records.results import rows
    from fecontact.own_criterion import ContactField, OwnCriterion
    from fecontact.placement.irregularity import Irregularity
    from fecontact.profiles.library import profile
    from fecontact.profiles.reading import Reading
    from fecontact.runs.alone import hertz, table, theories, theory
    from fecontact.runs.judging_again import judge
    from fecontact.runs.load import load
    from fecontact.runs.map_run import map_ as map
    from fecontact.runs.study import run
    from fecontact.solving.preview import preview_case as place
    from fecontact.solving.solve import CaseResult, solve
    from fecontact.solving.wheelset_geometry import geometry
    from fecontact.solving.wheelset_solution import solve_wheelset

__all__ = [
    "BodySize",
    "Case",
    "CaseResult",
    "ContactField",
    "Creep",
    "Criteria",
    "Irregularity",
    "Material",
    "Opposite",
    "OwnCriterion",
    "Reading",
    "Track",
    "__version__",
    "geometry",
    "hertz",
    "judge",
    "load",
    "map",
    "mesh",
    "place",
    "plot",
    "profile",
    "result_schema",
    "rows",
    "run",
    "solve",
    "solve_wheelset",
    "table",
    "theories",
    "theory",
    "to_dataframe",
    "to_xarray",
]
__all__ += [*find_public_names()]

_HOMES = {
    "BodySize": "bodies.BodySize",
    "Case": "case.Case",
    "CaseResult": "solving.solve.CaseResult",
    "ContactField": "own_criterion.ContactField",
    "Creep": "criteria.Creep",
    "Criteria": "criteria.Criteria",
    "Irregularity": "placement.irregularity.Irregularity",
    "Material": "bodies.Material",
    "Opposite": "case.Opposite",
    "OwnCriterion": "own_criterion.OwnCriterion",
    "Reading": "profiles.reading.Reading",
    "Track": "bodies.Track",
    "geometry": "solving.wheelset_geometry.geometry",
    "hertz": "runs.alone.hertz",
    "judge": "runs.judging_again.judge",
    "load": "runs.load.load",
    "map": "runs.map_run.map_",
    "mesh": "outputs.mesh_dataset.mesh",
    "place": "solving.preview.preview_case",
    "profile": "profiles.library.profile",
    "result_schema": "outputs.records.result_schema.result_schema",
    "rows": "outputs.records.results.rows",
    "run": "runs.study.run",
    "solve": "solving.solve.solve",
    "solve_wheelset": "solving.wheelset_solution.solve_wheelset",
    "table": "runs.alone.table",
    "theories": "runs.alone.theories",
    "theory": "runs.alone.theory",
    "to_dataframe": "outputs.frames.to_dataframe",
    "to_xarray": "outputs.frames.to_xarray",
}


def __getattr__(name: str) -> Any:
    """Import a public name of the package on its first use."""
    # the command line must answer --help at once: no large module is imported before its use
    if name == "plot":
        return import_module("fecontact.plot")
    if place := _HOMES.get(name):
        return import_place(f"fecontact.{place}")
    if place := find_public_names().get(name):
        return import_place(place)
    raise AttributeError(f"module 'fecontact' has no attribute {name!r}")


def __dir__() -> list[str]:
    # names that are imported only for annotations are not listed
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
