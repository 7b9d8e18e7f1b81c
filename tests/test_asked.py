"""Order of the two verdicts of a case with a yield stress.

The verdict against bodies that yield comes first, and the verdict against elastic bodies second.
"""

import io
import json
import re
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista
from rich.console import Console

from fecontact.bodies import Material
from fecontact.cli import call
from fecontact.contact.grid import Rung
from fecontact.files import format_json
from fecontact.judging import verdict
from fecontact.judging.judge import judge_load
from fecontact.judging.measures import MEASURES, read_measures
from fecontact.judging.own_measures import NO_OWN_MEASURES
from fecontact.judging.yielded import PathPoint, PlasticResult, YieldedBody
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.cases import ReportedCase
from fecontact.outputs.figures.case import case_inches, draw_case
from fecontact.outputs.figures.pressure_maps import PressureFields
from fecontact.outputs.figures.study import draw_study
from fecontact.outputs.paraview.contact_surface import contact_surface
from fecontact.outputs.records.asked import requested_record, requested_row
from fecontact.outputs.records.cheapest import judgements_by_theory
from fecontact.outputs.records.results import case_row, result_record
from fecontact.outputs.study_report import parts_of_rows, write_study_report
from fecontact.outputs.style import blank_figure
from fecontact.outputs.terminal import print_parts
from fecontact.outputs.verdict_words import case_annotation

STEEL = Material(young_MPa=210e3, poisson=0.3, yield_MPa=450.0, tangent_MPa=4200.0)
# peak of bodies that yield over that of elastic ones
SOFTER = 0.78


def softer(rung: Rung) -> Rung:
    """A contact with a truncated pressure."""
    return replace(rung, pressure_MPa=rung.pressure_MPa.clip(max=SOFTER * rung.pressure_MPa.max()))


@pytest.fixture(scope="module")
def result(elliptic_quick):
    """A case in which Hertz holds on elastic bodies.

    The pressure of the bodies that yield has a far lower peak.
    """
    solution, body = elliptic_quick.load.solved, YieldedBody(yield_MPa=450.0, tangent_MPa=4200.0, first_yield_N=24e3)
    levels = []
    for level in solution.levels:
        fe, nodal = softer(level.fe), softer(level.nodal)
        before, after = read_measures(level.fe).as_dict(), read_measures(fe).as_dict()
        steps = {name: after[name] / before[name] - 1.0 for name in MEASURES}
        path = (PathPoint(load_N=100e3, steps=steps, largest_strain=0.01, corrections=3, change=1e-6),)
        bodies = {"rail": replace(body, largest_strain=0.01)}
        levels.append(replace(level, yielded=PlasticResult(fe=fe, nodal=nodal, bodies=bodies, path=path, by_band={})))
    case = replace(solution.case, rail_material=STEEL)
    load = judge_load(replace(solution, case=case, levels=tuple(levels)), elliptic_quick.placement)
    assert (load.elastic_verdict.answer, load.verdict.answer) == ("HOLDS", "FAILS")
    return replace(elliptic_quick, load=load)


def printed(parts, **options) -> str:
    text = io.StringIO()
    print_parts(parts, Console(file=text, width=160, no_color=True), **options)
    return text.getvalue()


def first_answer(text: str) -> str:
    """The first verdict in a text."""
    return re.search("FAILS|HOLDS|UNRESOLVED", text)[0]


def test_the_terminal_says_it_first(result):
    said = printed(case_parts(result_record(result), "the case")).splitlines()
    assert said[1].startswith(
        "Hertz FAILS against bodies that yield; furthest beyond its limit: peak pressure +27.64 %"
    )
    assert said[2].startswith("against elastic bodies Hertz HOLDS; ")
    peak = next(line for line in said if line.startswith("peak pressure (MPa)"))
    assert peak.endswith("FAILS ")
    assert any(line.startswith("against elastic bodies: HOLDS: Hertz") for line in said)


def test_the_elements_own_verdict_is_told_where_it_is_asked_for(result):
    record = result_record(result)
    assert "On the nodes of the elements" in printed(case_parts(record), long=True)
    without = printed(case_parts(record, elements=False), long=True)
    assert "On the nodes of the elements" not in without
    assert "verdict on the nodes of the elements" not in without


def test_tables_and_the_report_say_it_first(result, tmp_path):
    row = {"id": "one", **case_row(result)}
    (line,) = [line for line in printed(parts_of_rows([row])).splitlines() if line.startswith("+0.00   ")]
    assert first_answer(line) == "FAILS"
    assert "HOLDS" in line
    page = write_study_report("one", [ReportedCase(row=row, record=result_record(result))], tmp_path).read_text("utf-8")
    lead = re.search(r"<h1 ([^>]*)>(.*?)</h1>", page, re.DOTALL)
    assert lead[1] == 'class="lead fails"'
    assert lead[2].startswith("Hertz FAILS against bodies that yield: peak pressure too high by 27.64 ± ")
    assert lead[2].endswith("against elastic bodies Hertz HOLDS")
    table = page[page.index("<table") : page.index("</table>")]
    assert first_answer(table) == "FAILS"


def test_what_is_asked_for_is_read_against_bodies_that_yield(result):
    hertz, plastic = result.hertz.p0_MPa, read_measures(result.load.level.yielded.fe).p_max_MPa
    row, record = requested_row(case_row(result)), requested_record(result_record(result))
    assert row["fe_p_max_MPa"] == record["fe"]["p_max_MPa"] == pytest.approx(plastic, rel=1e-9)
    assert row["hertz_deviation_p_max_percent"] == pytest.approx(1e2 * (hertz / plastic - 1.0), rel=1e-9)
    assert row["verdict_limit_utilisation"] == pytest.approx((hertz / plastic - 1.0) / 0.05, rel=1e-9)
    assert (row["verdict_answer"], row["verdict_measure"], row["elastic_verdict_answer"]) == (
        *("FAILS", "p_max_MPa", "HOLDS"),
    )
    # a row of before has no such deviation: none is shown, not the elastic one
    old = {name: value for name, value in case_row(result).items() if not name.startswith("plastic_hertz_d")}
    assert requested_row(old)["hertz_deviation_p_max_percent"] is None


def test_python_record_row_and_terminal_have_the_same_two_verdicts(result):
    row, record = case_row(result), json.loads(format_json(result_record(result)))
    for plastic_record, elastic in (
        (result.verdict.answer, result.elastic_verdict.answer),
        (result.load.verdict.answer, result.load.elastic_verdict.answer),
        (record["verdict"]["answer"], record["elastic_verdict"]["answer"]),
        (row["verdict_answer"], row["elastic_verdict_answer"]),
        re.findall(r"Hertz (FAILS|HOLDS|UNRESOLVED)", printed(case_parts(record)))[:2],
    ):
        assert (plastic_record, elastic) == ("FAILS", "HOLDS")
    assert "Hertz FAILS by p_max_MPa" in repr(result.load)
    # Hertz's peak is furthest beyond its limit against bodies that yield
    hertz, plastic = result.hertz.p0_MPa, read_measures(result.load.level.yielded.fe).p_max_MPa
    utilisation = (hertz / plastic - 1.0) / result.case.criteria.p_max
    assert (
        record["verdict"]["limit_utilisation"]
        == row["verdict_limit_utilisation"]
        == pytest.approx(utilisation, rel=1e-9)
    )
    assert (
        record["elastic_verdict"]["limit_utilisation"]
        == row["elastic_verdict_limit_utilisation"]
        == result.load.limit_utilisation
    )
    assert result.load.limit_utilisation < 1.0 < utilisation
    assert (record["verdict"]["measure"], record["verdict"]["cause"]) == ("p_max_MPa", "plasticity")
    assert (row["verdict_cause"], row["elastic_verdict_cause"]) == ("plasticity", None)
    assert record["verdict"]["each"] == dict(result.load.plastic.verdict.each)
    assert record["verdict"]["warnings"] == record["elastic_verdict"]["warnings"] != []


def test_the_elements_and_other_theories_are_beside_the_elastic_verdict(result):
    said = printed(case_parts(result_record(result)), long=True)
    assert re.search(r"On the nodes of the elements: Hertz \w+ \(verdict: HOLDS\)", said)
    # Hertz is among the theories that are judged against elastic bodies
    assert judgements_by_theory(result.load)["hertz"].verdict == result.elastic_verdict


def test_a_result_that_must_not_be_used_leaves_both_verdicts_open(result, monkeypatch):
    monkeypatch.setattr("fecontact.judging.judge.compute_reference_error", lambda *_: 1.0)
    load = judge_load(result.load.solved, result.placement)
    assert (load.status, load.plastic.verdict.answer) == ("references disagree", "FAILS")
    assert (load.verdict.answer, load.elastic_verdict.answer) == ("UNRESOLVED", "UNRESOLVED")


def test_without_a_yield_stress_nothing_changes(elliptic_quick):
    row, record = case_row(elliptic_quick), result_record(elliptic_quick)
    assert elliptic_quick.elastic_verdict is elliptic_quick.load.elastic_verdict is record["elastic_verdict"] is None
    assert not [name for name in row if name.startswith("elastic_verdict")]
    assert requested_row(row) is row
    assert requested_record(record) is record
    assert "yield" not in printed(case_parts(record), long=True)


def test_pictures_and_paraview_say_it_first(result, tmp_path):
    fields = PressureFields.of(result.load)
    figure = blank_figure(*case_inches(fields))
    draw_case(figure, result_record(result), result.placement, fields)
    assert figure.texts[0].get_text().strip() == "Hertz FAILS"
    assert figure.texts[2].get_text().endswith("against elastic bodies Hertz HOLDS")
    lines = {line.get_label(): max(line.get_ydata()) for ax in figure.axes for line in ax.get_lines()}
    # the cut goes through the peak of bodies that yield
    elastic = float(result.pressure_MPa.max())
    assert lines["finite elements, elastic bodies"] == pytest.approx(elastic, rel=5e-3)
    assert lines["finite elements, bodies that yield"] == pytest.approx(SOFTER * elastic, rel=1e-9)
    assert first_answer(" ".join(case_annotation(result_record(result)).split())) == "FAILS"
    level = result.load.level
    point_data = pyvista.wrap(contact_surface(result, level.fe, level.yielded.fe)).point_data
    plastic = point_data["plastic_pressure_MPa"]
    # the arrays have single precision
    assert float(plastic.max()) == pytest.approx(SOFTER * elastic, rel=1e-7)
    difference = point_data["hertz_pressure_MPa"] - plastic
    np.testing.assert_allclose(point_data["hertz_minus_fe_MPa"], difference, atol=2e-7 * elastic)
    svg_text = draw_study([case_row(result)], tmp_path / "study.png").with_suffix(".svg").read_text("utf-8")
    assert "FAILS" in svg_text
    assert "HOLDS" not in svg_text


def wider(rung: Rung, nodes: int) -> Rung:
    """Extend the grid of a contact by a number of nodes across, on the field side."""
    step, low = rung.grid.steps_mm[1], rung.grid.s_mm[-1]
    s = np.append(rung.grid.s_mm, low + step * np.arange(1, nodes + 1))
    pressure, gap = (np.pad(values, ((0, 0), (0, nodes))) for values in (rung.pressure_MPa, rung.gap_mm))
    return replace(rung, grid=replace(rung.grid, s_mm=s), pressure_MPa=pressure, gap_mm=gap)


def test_bodies_that_yield_may_have_a_wider_grid_than_elastic_ones(result):
    level = result.load.level
    # further than Hertz's ellipse
    yielded = replace(level.yielded, fe=wider(level.yielded.fe, 40))
    for first, second in ((level.fe, yielded.fe), (yielded.fe, level.yielded.fe)):
        surface = pyvista.wrap(contact_surface(result, first, second))
        usual = pyvista.wrap(contact_surface(result, level.fe, level.yielded.fe))
        assert surface.n_points > usual.n_points
        # both have all nodes of the smaller grid at the same places
        where = [surface.find_closest_point(point) for point in usual.points]
        np.testing.assert_allclose(surface.points[where], usual.points, atol=1e-6)
        assert float(usual.point_data["plastic_pressure_MPa"].max()) > 1.0
        np.testing.assert_allclose(
            surface.point_data["plastic_pressure_MPa"][where], usual.point_data["plastic_pressure_MPa"], atol=1e-6
        )
        pressure = "plastic_pressure_MPa" if first is yielded.fe else "contact_pressure_MPa"
        np.testing.assert_allclose(
            surface.point_data["contact_pressure_MPa"][where], usual.point_data[pressure], atol=1e-6
        )
        assert np.count_nonzero(surface.point_data["plastic_pressure_MPa"]) == np.count_nonzero(
            usual.point_data["plastic_pressure_MPa"]
        )
    solution = replace(result.load.solved, levels=(replace(level, yielded=yielded),))
    fields, usual = PressureFields.of(replace(result.load, solved=solution)), PressureFields.of(result.load)
    assert fields.elastic.shape == fields.fe.shape == fields.grid.shape
    assert fields.grid.shape != usual.grid.shape
    assert fields.elastic[fields.peak] == pytest.approx(usual.elastic[usual.peak], rel=1e-9)


def test_a_map_takes_it(result):
    pytest.importorskip("fecontact.maps")
    from fecontact.maps.load_limits import LoadVerdict, find_load_limit
    from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
    from fecontact.maps.telling import select_judgement
    from fecontact.maps.verdict_views import build_verdict_view
    from fecontact.maps.views import write_map_answer

    cell = MapCell(lateral_shift_mm=0.0, load_N=100e3, status="converged", judged=result.load)
    assert (cell.verdict, cell.cause) == ("FAILS", "plasticity")
    known_load = LoadVerdict.of(result.load)
    assert known_load.answer == "FAILS"
    plastic = read_measures(result.load.level.yielded.fe).p_max_MPa
    assert known_load.excess == pytest.approx((result.hertz.p0_MPa / plastic - 1.0) / 0.05 - 1.0)
    assert select_judgement(result.load, "hertz").verdict.answer == "FAILS"
    position = MapPosition(lateral_shift_mm=0.0, cells=(cell,), limit=find_load_limit([cell]))
    applicability_map = ApplicabilityMap(case=result.case, loads_N=(100e3,), positions=(position,))
    view = build_verdict_view(applicability_map)
    assert view.title == "where Hertz holds, against bodies that yield"
    (view_cell,) = view.columns[0].cells
    assert (view_cell.answer, view_cell.letter) == ("FAILS", "Y")
    said = write_map_answer(applicability_map, "pressure")
    assert "fails" in said[0]
    assert "where the bodies yield" in said[0]
    assert said[-1] == "Verdicts are against bodies that yield."


@pytest.mark.slow
def test_a_rail_that_yields_is_not_said_to_hold(tmp_path, capsys):
    command = ["solve", "--shift", "-4", "--load-kn", "100", "--yield-mpa", "450", "--tangent-mpa", "4200"]
    assert call([*command, "--out", str(tmp_path / "out")]) == 0
    assert first_answer(capsys.readouterr().out) == "FAILS"
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert first_answer(page[page.index("<body") :]) == "FAILS"
    assert first_answer((tmp_path / "out" / "case.svg").read_text("utf-8")) == "FAILS"


@dataclass(frozen=True)
class Elastic:
    """Stand-in for a judgement on elastic bodies, with the attributes that the tests read."""

    approximation: str
    deviation: dict
    numerical: dict
    moves: str = ""
    uncertainty: str = ""
    verdict: str = ""
    budgets: dict = field(default_factory=dict)


def test_a_step_that_is_unsure_counts_by_what_hertz_has_of_the_contact_that_yields(monkeypatch):
    """Hertz has 1 + d of it: d (1 +- u) is unsure by (1 + d) u, and the elastic part by the ratio of both."""
    after = {"p_max_MPa": 0.25, "misplaced_load": 0.1}
    monkeypatch.setattr(verdict, "compute_deviations", lambda *_: after)
    monkeypatch.setattr(verdict, "judge_profile_variants", lambda _, numerical, *__: (numerical, numerical))
    elastic = Elastic("Hertz", {"p_max_MPa": 0.0, "misplaced_load": 0.02}, {"p_max_MPa": 0.01, "misplaced_load": 0.003})
    step_uncertainty = {"p_max_MPa": 0.02, "misplaced_load": 0.004}
    solution = SimpleNamespace(case=SimpleNamespace(criteria=None))
    judgement = verdict._judge_against_plastic(
        elastic, SimpleNamespace(fe=None), step_uncertainty, solution, NO_OWN_MEASURES
    )
    assert judgement.numerical == pytest.approx({"p_max_MPa": 1.25 * 0.01 + 1.25 * 0.02, "misplaced_load": 0.007})
