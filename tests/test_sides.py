"""Verdict and printed numbers at a curvature junction.

Both belong to one side of the junction.
"""

import io
from dataclasses import replace

import pytest
import pyvista
from rich.console import Console

from fecontact.bodies import Material
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE
from fecontact.criteria import Criteria
from fecontact.judging.judge import judge_load
from fecontact.judging.measures import MEASURES
from fecontact.judging.verdict import compare_with_limit, judge
from fecontact.judging.yielded import PathPoint, PlasticResult, YieldedBody
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.figures.case import case_inches, draw_case
from fecontact.outputs.figures.pressure_maps import PressureFields
from fecontact.outputs.paraview.contact_surface import contact_surface
from fecontact.outputs.records.asked import requested_record, requested_row
from fecontact.outputs.records.cheapest import judgements_by_theory
from fecontact.outputs.records.results import case_row, result_record
from fecontact.outputs.study_report import parts_of_rows
from fecontact.outputs.style import blank_figure
from fecontact.outputs.terminal import print_parts
from fecontact.outputs.theory_records import deciding_hertz
from fecontact.outputs.verdict_words import BY_EACH_VARIANT, case_annotation, verdict_reason
from fecontact.outputs.verdict_words import deciding_measure_text as decided_text

LIMITS = Criteria().limits
# curvature of the rail on the gauge side; the field side has R 300, with which Hertz holds
SHARPER_MM = 150.0


def junction_result(result, solved_load=None):
    """A result at a junction of curvatures.

    The result is judged again with both curvatures at its contact point.
    """
    touch = result.placement.first
    sharper = replace(touch.curvatures[0], rail_per_mm=1.0 / SHARPER_MM, yy_per_mm=1.0 / SHARPER_MM)
    first = replace(touch, curvatures=(sharper, touch.curvatures[0]))
    placement = replace(result.placement, contact_points=(first,))
    return replace(result, load=judge_load(solved_load or result.load.solved, placement), placement=placement)


@pytest.fixture(scope="module")
def gauge_decides(elliptic_quick):
    result = junction_result(elliptic_quick)
    assert [side.verdict.answer for side in result.load.sides.values()] == ["FAILS", "HOLDS"]
    assert (result.load.verdict.answer, result.load.deciding_side) == ("FAILS", "gauge")
    return result


@pytest.fixture(scope="module")
def gauge_decides_in_yielding(elliptic_quick):
    """The same contact for bodies with a yield stress that is not reached."""
    steel = Material(young_MPa=210e3, poisson=0.3, yield_MPa=450.0, tangent_MPa=4200.0)
    loaded, body = elliptic_quick.load.solved, YieldedBody(yield_MPa=450.0, tangent_MPa=4200.0, first_yield_N=24e3)
    path = (
        PathPoint(load_N=100e3, steps=dict.fromkeys(MEASURES, 0.0), largest_strain=0.0, corrections=1, change=1e-9),
    )
    levels = tuple(
        replace(
            level, yielded=PlasticResult(fe=level.fe, nodal=level.nodal, bodies={"rail": body}, path=path, by_band={})
        )
        for level in loaded.levels
    )
    result = junction_result(
        elliptic_quick, replace(loaded, case=replace(loaded.case, rail_material=steel), levels=levels)
    )
    assert (result.load.plastic.verdict.answer, result.load.plastic.deciding_side) == ("FAILS", "gauge")
    return result


def printed(parts) -> str:
    text = io.StringIO()
    print_parts(parts, Console(file=text, width=200, no_color=True))
    return text.getvalue()


def check_one_side(result):
    """Compare deviations with the ellipse next to them, and with the verdict."""
    row, record = requested_row(case_row(result)), requested_record(result_record(result))
    hertz = deciding_hertz(record)
    for of_hertz, of_fe, deviation in (
        (row["hertz_p_max_MPa"], row["fe_p_max_MPa"], 1e-2 * row["hertz_deviation_p_max_percent"]),
        (hertz["p_max_MPa"], record["fe"]["p_max_MPa"], hertz["deviation"]["p_max_MPa"]),
    ):
        assert of_hertz / of_fe - 1.0 == pytest.approx(deviation, rel=1e-9)
    measure, answer = record["verdict"]["measure"], record["verdict"]["answer"]
    assert (row["verdict_measure"], row["verdict_answer"]) == (measure, answer)
    assert compare_with_limit(hertz["deviation"][measure], hertz["uncertainty"][measure], LIMITS[measure]) == answer
    utilisation = max(abs(hertz["deviation"][name]) / limit for name, limit in LIMITS.items())
    assert (
        row["verdict_limit_utilisation"]
        == record["verdict"]["limit_utilisation"]
        == pytest.approx(utilisation, rel=1e-12)
    )
    # the text has these numbers too, and does not contradict itself
    text = decided_text(row, LIMITS)
    assert BY_EACH_VARIANT not in text
    assert text in verdict_reason(result_record(result))
    assert "with the curvature of the gauge side" in verdict_reason(result_record(result))
    (line, *_) = [
        text_line
        for text_line in printed(parts_of_rows([{"id": "one", **case_row(result)}])).splitlines()
        if "FAILS" in text_line
    ]
    assert f"{1e2 * hertz['deviation']['p_max_MPa']:+.1f}" in line
    assert text in printed(case_parts(result_record(result)))


def test_row_record_and_terminal_are_of_the_side_that_decides(gauge_decides):
    check_one_side(gauge_decides)


def test_bodies_that_yield_are_judged_on_one_side_too(gauge_decides_in_yielding):
    check_one_side(gauge_decides_in_yielding)


def test_numbers_in_python_are_of_the_side_that_decides(gauge_decides):
    load = gauge_decides.load
    gauge = load.judgements[HERTZ_GAUGE]
    assert (load.deviation, load.uncertainty) == (gauge.deviation, gauge.uncertainty)
    assert load.limit_utilisation == judgements_by_theory(load)[HERTZ].limit_utilisation == gauge.limit_utilisation
    for measure, answer in load.verdict.each.items():
        assert compare_with_limit(load.deviation[measure], load.uncertainty[measure], LIMITS[measure]) == answer


def test_the_side_that_is_open_decides_although_the_other_one_uses_more_of_a_limit(gauge_decides):
    load = gauge_decides.load

    def peak_record(name: str, deviation: float, uncertainty: float):
        off = dict.fromkeys(load.deviation, 0.0) | {"p_max_MPa": deviation}
        uncertainties = dict.fromkeys(off, 1e-4) | {"p_max_MPa": uncertainty}
        verdict = judge(off, uncertainties, Criteria())
        return replace(load.judgements[name], deviation=off, uncertainty=uncertainties, verdict=verdict)

    gauge, field = peak_record(HERTZ_GAUGE, 0.045, 0.001), peak_record(HERTZ, 0.04, 0.02)
    open_ = replace(load, judgements={HERTZ_GAUGE: gauge, HERTZ: field}, verdict=field.verdict)
    assert (open_.deciding_side, open_.verdict.answer) == ("field", "UNRESOLVED")
    (hertz_record,) = [verdict_record for name, verdict_record in judgements_by_theory(open_).items() if name == HERTZ]
    assert (hertz_record.limit_utilisation, hertz_record.verdict.answer) == (pytest.approx(0.8), "UNRESOLVED")
    assert hertz_record.limit_range == (pytest.approx(0.4), pytest.approx(1.2))


def test_without_a_junction_a_row_is_shown_as_it_is(elliptic_quick):
    row = case_row(elliptic_quick)
    assert row["verdict_side"] == "both"
    assert requested_row(row) is row


@pytest.mark.parametrize("name", ["gauge_decides", "gauge_decides_in_yielding"])
def test_pictures_have_the_ellipse_and_the_numbers_of_the_side_that_decides(name, request):
    result = request.getfixturevalue(name)
    record, fields = result_record(result), PressureFields.of(result.load)
    gauge, field = (record["theories"][side] for side in (HERTZ_GAUGE, HERTZ))
    assert gauge["p_max_MPa"] > 1.1 * field["p_max_MPa"]
    assert fields.ellipse.p0_MPa == gauge["p_max_MPa"]
    figure = blank_figure(*case_inches(fields))
    draw_case(figure, record, result.placement, fields)
    (text,) = (words.get_text() for words in figure.texts if "status: converged" in words.get_text())
    peak_line = next(line for line in text.splitlines() if line.startswith("p_max"))
    uncertainty = sum(record["uncertainty_budget"]["p_max_MPa"].values())
    assert peak_line.split()[2:6] == [
        *(f"{contact['p_max_MPa']:.4g}" for contact in (record["fe"], gauge)),
        f"{1e2 * gauge['deviation']['p_max_MPa']:+.2f}",
        "%",
    ]
    assert f" {1e2 * uncertainty:.2f} " in peak_line
    assert "Hertz with the curvature of the gauge side" in text
    # the peak of the ellipse in ParaView, and in its words
    arrays = pyvista.wrap(contact_surface(result, result.load.fe, None)).point_data
    assert arrays["hertz_pressure_MPa"].max() == pytest.approx(gauge["p_max_MPa"], rel=0.02)
    assert f"Hertz {gauge['p_max_MPa']:.0f} MPa" in case_annotation(record).replace("\n", " ")
