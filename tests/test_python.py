"""The package as a library: public names, results and examples.

Results are arrays, rows and pictures; the examples run unchanged.
"""

import doctest
import importlib
import inspect
import math
import pickle
import pydoc
import re
import sys
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from kept import keep_case
from matplotlib import rc_context
from matplotlib.figure import Figure

import fecontact
from fecontact.case import PARTS, Case
from fecontact.cli import app
from fecontact.errors import InputError
from fecontact.guide.pages import read_page
from fecontact.outputs.paraview.vtk import write_case_vtk
from fecontact.solving.solve import CaseResult

README = Path(__file__).parents[1] / "README.md"


def test_what_is_public_is_seen_by_tab_completion_and_help():
    assert set(fecontact.__all__) <= set(dir(fecontact))
    assert all(getattr(fecontact, name) is not None for name in fecontact.__all__)
    text = pydoc.render_doc(fecontact, renderer=pydoc.plaintext)
    for name in ("class Case(", "class CaseResult(", "solve(", "load(", "run(", "rows(", "mesh("):
        assert re.search(rf"^    {re.escape(name)}", text, re.MULTILINE), name


def test_the_door_has_what_the_commands_do_and_all_parts_of_a_case():
    commands = {name for name in app if not name.startswith("-")}
    # these commands print facts of a machine, of files or of two sets of results: they are not functions of a case
    without_function = {
        "demo",
        "guide",
        "doctor",
        "init",
        "check",
        "profiles",
        "compare",
        "view",
        "validate",
        "baseline",
        # result_schema
        "keys",
        # run_fleet, check_fleet, open_fleet
        "fleet",
    }
    assert commands - without_function <= set(fecontact.__all__)
    classes = {type(getattr(Case(), name_of_part)).__name__ for name_of_part in PARTS}
    assert classes <= set(fecontact.__all__)
    for name in fecontact.__all__:
        assert inspect.getdoc(getattr(fecontact, name)), name


DOORS = ("fecontact.runs.alone", "fecontact.solving.wheelset_geometry", "fecontact.solving.preview")
PACKAGE = Path(fecontact.__file__).parent
# these examples solve a case or screen a fleet, which takes 5 to 40 s
WITH_SOLUTIONS = (
    "fecontact.features.fleet.checking",
    "fecontact.features.fleet.running",
    "fecontact.outputs.frames",
    "fecontact.outputs.mesh_dataset",
    "fecontact.outputs.records.results",
    "fecontact.plot",
    "fecontact.runs.judging_again",
    "fecontact.runs.load",
    "fecontact.runs.map_run",
    "fecontact.runs.study",
    "fecontact.solving.solve",
)
# the package itself has its examples below
WITH_EXAMPLES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>> " in path.read_text("utf-8") and path.name != "__init__.py"
}


@pytest.mark.parametrize("module", sorted({*DOORS, *WITH_EXAMPLES} - {*WITH_SOLUTIONS}))
def test_the_examples_of_functions_have_these_numbers(module):
    outcome = doctest.testmod(importlib.import_module(module))
    assert outcome.attempted >= (2 if module in DOORS else 1)
    assert outcome.failed == 0


@pytest.fixture
def each_case_is_solved_once(solved, monkeypatch):
    """Let `fecontact.solve` store its results for the other tests."""
    monkeypatch.setattr(fecontact, "solve", solved, raising=False)


@pytest.mark.slow
@pytest.mark.parametrize("module", WITH_SOLUTIONS)
@pytest.mark.usefixtures("each_case_is_solved_once")
def test_the_examples_with_solutions_have_these_numbers(module):
    outcome = doctest.testmod(importlib.import_module(module))
    assert outcome.attempted >= 4
    assert outcome.failed == 0


def test_public_functions_and_classes_have_an_example():
    """The module `plot` has examples in its functions; `to_xarray` needs an optional package."""
    places = {*fecontact.__all__, "plot.case", "plot.map"} - {"__version__", "plot", "to_xarray"}
    without_example = [name for name in sorted(places) if ">>> " not in (attrgetter(name)(fecontact).__doc__ or "")]
    assert without_example == []


@pytest.mark.slow
def test_a_door_to_stored_results_judges_cases_and_refuses_what_needs_friction(elliptic_quick, tmp_path):
    keep_case(elliptic_quick, tmp_path / "one")
    result = fecontact.judge(tmp_path / "one", fecontact.Criteria(p_max=1e-9, judged_by=("p_max",)))
    (row,) = result.rows
    assert (row["verdict_measure"], row["verdict_answer"]) == ("p_max_MPa", "UNRESOLVED")
    assert list(result.changed.values()) == [("HOLDS", "UNRESOLVED")]
    with pytest.raises(InputError, match="no friction coefficient is given"):
        fecontact.judge(tmp_path / "one", creep=fecontact.Creep(xi=1e-3))
    with pytest.raises(InputError, match=r"no map\.json"):
        fecontact.judge(tmp_path / "one", measure="force")


@pytest.mark.slow
@pytest.mark.usefixtures("each_case_is_solved_once")
def test_the_story_of_the_package_has_these_numbers():
    outcome = doctest.testmod(fecontact, optionflags=doctest.ELLIPSIS)
    assert outcome.attempted > 15
    assert outcome.failed == 0


def test_fields_are_those_of_the_whole_contact(elliptic_quick: CaseResult):
    result, half = elliptic_quick, elliptic_quick.load.fe
    assert half.grid.half
    nx = 2 * half.grid.x_mm.size - 1
    shape = (nx, half.grid.s_mm.size)
    assert result.grid.shape == result.pressure_MPa.shape == result.gap_mm.shape == shape
    assert not result.grid.half
    np.testing.assert_array_equal(result.pressure_MPa, result.pressure_MPa[::-1])
    np.testing.assert_array_equal(result.pressure_MPa[nx // 2 :], half.pressure_MPa)
    # pressures are means over the cells of the nodes: their sum is the force, except that normals turn by up to 18 mrad
    force = (result.grid.whole_area_mm2() * result.pressure_MPa.ravel()).sum()
    assert force == pytest.approx(result.normal_force_N, rel=1e-4)
    assert result.normal_force_N == pytest.approx(100e3, rel=1e-5)


def test_a_result_is_told_in_one_line(elliptic_quick):
    assert repr(elliptic_quick) == (
        "<CaseResult circle:300 and cylinder:460, +0.00 mm, 100 kN: converged, Hertz HOLDS by"
        f" {elliptic_quick.verdict.measure}>"
    )
    assert len(repr(elliptic_quick.load)) < 200


def test_a_pickled_result_has_all_but_the_factors(elliptic_quick, tmp_path):
    again = pickle.loads(pickle.dumps(elliptic_quick))
    np.testing.assert_array_equal(again.pressure_MPa, elliptic_quick.pressure_MPa)
    assert fecontact.rows(again) == fecontact.rows(elliptic_quick)
    # the pickle has the meshes and displacements, from which the stresses are computed
    for folder, result in (("here", elliptic_quick), ("again", again)):
        write_case_vtk(result, tmp_path / folder)
    for file in ("rail.vtu", "wheel.vtu", "pressure.vtp"):
        assert (tmp_path / "here" / file).read_bytes() == (tmp_path / "again" / file).read_bytes()
    with pytest.raises(InputError, match="solve the case again"):
        again.bodies.coupled.rail.displacements(np.array([0]), np.zeros((1, 3)))


def test_rows_are_flat(elliptic_quick):
    for results in (elliptic_quick, (elliptic_quick,)):
        (row,) = fecontact.rows(results)
        assert row["load_kN"] == 100.0
        assert row["fe_p_max_MPa"] == elliptic_quick.comparison.fe.p_max_MPa
        assert all(isinstance(value, str | bool | int | float | None) for value in row.values())


def test_a_mesh_is_a_dataset_with_its_surfaces(elliptic_quick):
    body = elliptic_quick.bodies.coupled.wheel.mesh
    dataset = fecontact.mesh(elliptic_quick, "wheel")
    assert dataset.volume == pytest.approx(body.volume_mm3, rel=1e-9)
    for name, quads in body.surfaces.items():
        np.testing.assert_array_equal(np.flatnonzero(dataset.point_data[name]), np.unique(quads))
    # the rim is fixed
    assert not dataset.point_data["displacement_mm"][dataset.point_data["driven"] == 1].any()
    alone = fecontact.mesh(elliptic_quick.case, "wheel")
    np.testing.assert_array_equal(alone.points, dataset.points)
    assert "displacement_mm" not in alone.point_data
    with pytest.raises(InputError, match="allowed: rail, wheel"):
        fecontact.mesh(elliptic_quick, "both")
    with pytest.raises(InputError, match=r"wheel\.vtu"):
        fecontact.mesh(replace(elliptic_quick, bodies=None), "wheel")


def test_a_result_is_drawn_into_given_axes_or_a_figure_that_is_made(elliptic_quick, tmp_path):
    figure = Figure()
    axes = figure.subplots()
    assert fecontact.plot.case(elliptic_quick, axes, field="Hertz") is figure
    (image,) = axes.images
    assert image.get_array().max() == pytest.approx(elliptic_quick.hertz.p0_MPa, rel=0.01)
    new_figure = fecontact.plot.case(elliptic_quick)
    new_figure.savefig(tmp_path / "case.png")
    assert (tmp_path / "case.png").stat().st_size > 50_000
    with pytest.raises(InputError, match="Hertz minus finite elements"):
        fecontact.plot.case(elliptic_quick, axes, field="FE")


def test_a_picture_for_a_paper_has_its_width_and_follows_the_settings_of_matplotlib(elliptic_quick, tmp_path):
    with rc_context({"font.size": 7.0, "lines.linewidth": 0.75}):
        figure = fecontact.plot.case(elliptic_quick, width_mm=170)
        assert figure.get_figwidth() == pytest.approx(170.0 / 25.4)
        # three fields with their scales, and two cuts
        assert sum(bool(axes.images) for axes in figure.axes) == 3
        cut = next(axes for axes in figure.axes if axes.get_title().startswith("lateral cut"))
        # the usual picture has 1.3 points at the usual width of 1.5
        assert cut.lines[0].get_linewidth() == pytest.approx(0.65)
        assert cut.xaxis.label.get_fontsize() == 7.0
        for ending, start in (("pdf", b"%PDF"), ("svg", b"<?xml")):
            figure.savefig(tmp_path / f"case.{ending}")
            assert (tmp_path / f"case.{ending}").read_bytes().startswith(start)
    assert figure.get_suptitle().startswith("rail circle:300")
    column = fecontact.plot.case(elliptic_quick, width_mm=85, title=False, numbers=False)
    assert column.get_figwidth() == pytest.approx(85.0 / 25.4)
    assert not column.get_suptitle()
    # panels keep the titles that name their fields
    assert {"finite elements", "lateral cut at x = 0.00 mm"} <= {axes.get_title() for axes in column.axes}
    field = fecontact.plot.case(elliptic_quick, field="lateral cut", width_mm=85, title=False)
    assert [axes.get_title() for axes in field.axes] == [""]


@pytest.mark.parametrize("width_mm", [0.0, 39.9, 1000.1, -85.0, math.nan])
def test_a_width_in_which_nothing_can_be_read_is_refused(elliptic_quick, width_mm):
    with pytest.raises(InputError, match=r"width_mm is .*; allowed: 40 to 1000; a page usually has 85 mm"):
        fecontact.plot.case(elliptic_quick, width_mm=width_mm)


def test_axes_have_the_width_of_their_figure(elliptic_quick):
    with pytest.raises(InputError, match="leave one of them out"):
        fecontact.plot.case(elliptic_quick, Figure().subplots(), width_mm=85)


@pytest.mark.parametrize("study", [[], ["60E1"]])
def test_running_needs_cases(study, tmp_path):
    with pytest.raises(InputError, match="at least one Case"):
        fecontact.run(study, tmp_path)


def example(text: str) -> str:
    """The first example in Python of a page."""
    return text.partition("```python")[2].partition("```")[0]


def test_the_example_of_the_readme_runs(elliptic_quick, monkeypatch, tmp_path, capsys):
    """As it stands, but with a result that is there already."""
    cases = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(fecontact, "solve", lambda case: cases.append(case) or elliptic_quick, raising=False)
    exec(compile(example(README.read_text("utf-8")), "README", "exec"), {"__name__": "__main__"})
    assert cases == [Case(lateral_shift_mm=3.0)]
    assert [path.name for path in tmp_path.iterdir()] == ["case.png"]
    out = capsys.readouterr().out
    assert out.startswith("HOLDS ")
    assert all(measure in out for measure in elliptic_quick.load.uncertainty)


@pytest.mark.slow
def test_the_example_of_the_guide_runs(elliptic_quick, monkeypatch, tmp_path, capsys):
    """The example, unchanged except for stored results in place of four solved cases."""
    code = example(read_page("python"))
    calls = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(fecontact, "solve", lambda case: elliptic_quick, raising=False)
    monkeypatch.setattr(fecontact, "run", lambda cases, out: calls.append((cases, out)), raising=False)
    monkeypatch.setattr(fecontact, "load", lambda folder: (elliptic_quick,), raising=False)
    exec(compile(code, "python.md", "exec"), {"__name__": "__main__"})
    assert calls == [([Case(lateral_shift_mm=-4.0), Case(lateral_shift_mm=4.0)], "out/mine")]
    assert {path.name for path in tmp_path.iterdir()} == {"case.pdf", "case.png", "map.png", "out", "rail.vtu"}
    assert "0.0 HOLDS" in capsys.readouterr().out


def test_one_case_is_a_sequence_of_one_and_a_table(elliptic_quick):
    assert [result is elliptic_quick for result in elliptic_quick] == [True] == [elliptic_quick[0] is elliptic_quick]
    assert len(elliptic_quick) == 1
    frame = fecontact.to_dataframe(elliptic_quick)
    assert frame.to_dict("records") == fecontact.rows(elliptic_quick)
    assert len(fecontact.to_dataframe([elliptic_quick, elliptic_quick])) == 2


def test_fields_as_a_data_set_need_xarray_and_say_so(elliptic_quick, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(InputError, match=r"pip install 'fecontact\[xarray\]'"):
        fecontact.to_xarray(elliptic_quick)
    module = SimpleNamespace(Dataset=lambda fields, coords: (fields, coords))
    monkeypatch.setitem(sys.modules, "xarray", module)
    fields, coords = fecontact.to_xarray(elliptic_quick)
    for dims, values in fields.values():
        assert values.shape == tuple(len(coords[name]) for name in dims)
    assert set(fields) == {"pressure_MPa", "gap_mm"}


@pytest.mark.parametrize(("backend", "open_ones"), [("agg", 1), ("module://matplotlib_inline.backend_inline", 0)])
def test_a_notebook_shows_a_figure_once_and_a_script_by_show(elliptic_quick, backend, open_ones, monkeypatch):
    from matplotlib import pyplot

    pyplot.close("all")
    monkeypatch.setattr("matplotlib.get_backend", lambda: backend)
    figure = fecontact.plot.case(elliptic_quick)
    assert isinstance(figure, Figure)
    assert len(pyplot.get_fignums()) == open_ones
    pyplot.close("all")


def test_what_is_shown_of_a_value_is_short(elliptic_quick):
    assert [name for name in dir(fecontact.plot) if not name.startswith("__")] == ["case", "map"]
    case = Case(lateral_shift_mm=3.0, resolution="fine")
    assert repr(case) == "Case(rail='60E1', wheel='S1002', lateral_shift_mm=3.0, load_N=100000.0, resolution='fine')"
    assert eval(repr(case), {"Case": Case}) == case
    placement = fecontact.place(case)
    for value in (case, placement, elliptic_quick):
        assert len(repr(value)) < 200
        assert "<table" in value._repr_html_()
    assert "fine" in case._repr_html_()
