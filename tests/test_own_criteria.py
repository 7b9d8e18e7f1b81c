"""Criteria of a user: functions with exact values, refusals, workers, stored results."""

import csv
import json
import math
import os
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import jsonschema
import own_functions
import pytest
from kept import keep_case

import fecontact
from fecontact.cli import call
from fecontact.criteria import _OWN_ALONE, _SETS, Criteria
from fecontact.errors import InputError
from fecontact.guide.pages import read_page
from fecontact.jobs.store import describe_differences
from fecontact.judging.judge import judge_load
from fecontact.judging.measures import MEASURES, MISFITS
from fecontact.judging.own_measures import make_evaluations_record, restore_evaluations
from fecontact.judging.uncertainty import Sensitivity, SolutionQuality, estimate_own_budget
from fecontact.judging.verdict import judge
from fecontact.outputs.cases import deviation_table, measures_table
from fecontact.outputs.records.results import case_row, load_record, load_row, result_record
from fecontact.outputs.words import MEASURE_WORDS, criteria_text
from fecontact.own_criterion import (
    RESERVED_NAMES,
    OwnCriterion,
    UnavailableFunction,
    restore_criterion,
    split_own_measure,
)
from fecontact.runs.identity import determine_origin, make_case_id
from fecontact.runs.store import read_case, seal_case

TESTS = Path(__file__).parent
EXACT = fecontact.Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick", refine="never")
PEAK = OwnCriterion(own_functions.peak, "peak", 0.05, "MPa")


def criteria_of(*functions, **settings) -> Criteria:
    """Criteria with a relative limit of 10 % for each function."""
    return Criteria(own=tuple(OwnCriterion(f, f.__name__, 0.1, "-") for f in functions), **settings)


@pytest.fixture(scope="module")
def exact():
    """Contact of two bodies for which Hertz is exact."""
    return fecontact.solve(EXACT)


def judged_by(exact, criteria: Criteria):
    """The exact contact judged by other criteria, without a new solution."""
    solved_load = exact.load.solved
    return judge_load(replace(solved_load, case=replace(solved_load.case, criteria=criteria)), exact.placement)


# --- values that are known


def test_a_peak_is_judged_as_the_built_in_peak(exact):
    load = judged_by(exact, Criteria(own=(PEAK,)))
    measure = PEAK.key
    # the built-in peak is interpolated between the nodes: up to 0.02 % higher on 32 nodes per semi-axis
    assert load.deviation[measure] == pytest.approx(load.deviation["p_max_MPa"], abs=3e-4)
    assert 0.9 < load.uncertainty[measure] / load.uncertainty["p_max_MPa"] < 1.5
    assert load.verdict.each[measure] == load.verdict.each["p_max_MPa"] == "HOLDS"
    assert load.ladder.own_values["fe"][measure] == pytest.approx(load.comparison.fe.p_max_MPa, rel=3e-4)


@pytest.mark.parametrize(
    "function",
    [
        own_functions.peak,
        own_functions.node_area,
        own_functions.mean_pressure,
        own_functions.total_load,
        own_functions.outer_load,
        own_functions.mean_gap,
    ],
)
def test_an_exact_contact_is_within_the_uncertainty(exact, function):
    load = judged_by(exact, criteria_of(function))
    (measure,) = load.case.criteria.own_measures
    assert abs(load.deviation[measure]) < load.uncertainty[measure] < 0.025
    assert load.verdict.each[measure] == "HOLDS"
    assert sum(load.deciding.budgets[measure].contributions.values()) == pytest.approx(load.uncertainty[measure])


def test_values_have_their_units(exact):
    load = judged_by(exact, criteria_of(own_functions.node_area, own_functions.total_load, own_functions.mean_pressure))
    area, force, mean = load.ladder.own_values["fe"].values()
    # a solver loads nodes up to a tenth of a node spacing outside the patch
    assert area == pytest.approx(load.comparison.fe.area_mm2, rel=0.01)
    # the pressures are along the normals of the rail, which turn by 30 mrad below the patch
    assert force == pytest.approx(load.normal_force_N, rel=5e-4)
    assert mean == pytest.approx(load.normal_force_N / area)
    hertz = load.deciding.own_values
    assert hertz["own_mean_pressure"] == pytest.approx(2.0 / 3.0 * load.hertz.p0_MPa, rel=0.01)
    assert hertz["own_total_load"] == pytest.approx(load.normal_force_N, rel=1e-4)


def test_a_difference_is_judged_in_its_unit(exact):
    centre = OwnCriterion(own_functions.centre, "load_centre", 0.2, "mm", relative=False)
    load = judged_by(exact, Criteria(own=centre))
    assert centre.key == "own_absolute_load_centre_in_mm"
    assert abs(load.deviation[centre.key]) < 1e-3
    # the centre of pressure may be off by 0.004 b through the cut planes
    b_mm = load.comparison.fe.b_mm
    assert 0.004 * b_mm < load.uncertainty[centre.key] < 0.02 * b_mm
    assert load.verdict.each[centre.key] == "HOLDS"
    tight = judged_by(exact, Criteria(own=replace_limit(centre, 1e-4)))
    assert tight.verdict.answer == "UNRESOLVED"
    assert tight.verdict.measure == centre.key


def replace_limit(criterion: OwnCriterion, limit: float) -> OwnCriterion:
    return OwnCriterion(criterion.function, criterion.name, limit, criterion.unit, criterion.relative)


def test_own_criteria_may_decide_alone(exact):
    load = judged_by(exact, Criteria(own=PEAK, judged_by=("own",)))
    assert [*load.verdict.each] == ["own_peak_in_MPa"]
    assert all(lobe.verdict is None for lobe in load.lobes)
    with pytest.raises(InputError, match="there is no own criterion"):
        Criteria(judged_by=("own",))


# --- an uncertainty that cannot be stated


def test_a_measure_without_an_uncertainty_stays_unresolved(exact):
    load = judged_by(exact, criteria_of(own_functions.fine_peak))
    assert math.isnan(load.uncertainty["own_fine_peak"])
    assert load.verdict.answer == load.verdict.each["own_fine_peak"] == "UNRESOLVED"
    sensitivity = Sensitivity(along=0.0, across=0.0, force=0.0, centre=0.0, lobe=0.0)
    budget = estimate_own_budget([0.0, 0.0], sensitivity, SolutionQuality(), by_other_fit=math.nan, node_change=0.0)
    assert math.isnan(budget.total)


def test_a_measure_without_a_deviation_is_never_held():
    assert judge({"p_max_MPa": 0.0}, {"p_max_MPa": 0.0}, Criteria(own=PEAK, judged_by=("strength",))).answer == (
        "UNRESOLVED"
    )


@pytest.mark.parametrize(
    ("deviations", "quality", "other_deviation", "contribution"),
    [
        # the whole change from mesh to mesh, and twice the difference of the fits
        ([0.0, 0.01], {}, 0.0, 0.01),
        ([0.0, 0.0], {}, 0.01, 0.02),
        ([0.0, 0.0], {"compliance_error": 0.02}, 0.0, 0.05 * 0.02),
        ([0.0, 0.0], {"turned_force": 0.03}, 0.0, 0.01),
        ([0.0, 0.0], {"residual": 1e-3}, 0.0, 1e-3),
    ],
)
def test_errors_of_the_meshes_are_in_the_uncertainty(deviations, quality, other_deviation, contribution):
    # the sensitivity of the peak of Hertz's theory
    of_peak = Sensitivity(along=-1.0, across=-1.0, force=1.0 / 3.0, centre=0.0, lobe=0.0)
    budget = partial(estimate_own_budget, sensitivity=of_peak, node_change=0.0)
    exact_total = budget([0.0, 0.0], quality=SolutionQuality(), by_other_fit=0.0).total
    total = budget(deviations, quality=SolutionQuality(**quality), by_other_fit=other_deviation).total
    assert total - exact_total == pytest.approx(contribution)


# --- errors of the user's function


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (own_functions.failing, "raised IndexError: tuple index out of range"),
        (own_functions.leaving, "raised SystemExit: 0"),
        (own_functions.undefined, "returned nan"),
        (own_functions.text, "returned 'high'"),
        (own_functions.load_beyond_1_m, "returned 0 for the finite elements"),
    ],
)
def test_errors_of_a_function_name_it_and_the_case(exact, function, words):
    with pytest.raises(InputError) as error:
        judged_by(exact, criteria_of(function))
    message = str(error.value)
    assert words in message
    assert f"own_functions:{function.__name__}" in message
    assert "circle:300 and cylinder:460, +0.00 mm, 100 kN" in message
    assert error.value.exit_code == 2


def test_a_difference_of_zero_is_no_error(exact):
    load = judged_by(
        exact, Criteria(own=OwnCriterion(own_functions.load_beyond_1_m, "far", 100.0, "N", relative=False))
    )
    assert load.deviation["own_absolute_far_in_N"] == 0.0
    assert load.verdict.each["own_absolute_far_in_N"] == "HOLDS"


def test_a_function_cannot_change_the_contact(exact):
    contacts = []
    function = own_functions.peak

    def spy(contact):
        contacts.append(contact)
        return function(contact)

    criterion = OwnCriterion(function, "peak", 0.05)
    object.__setattr__(criterion, "function", spy)
    judged_by(exact, Criteria(own=criterion))
    for name in ("x_mm", "s_mm", "pressure_MPa", "weight_mm2", "gap_mm"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(contacts[0], name)[...] = 0.0
    assert contacts[0].gap_mm.shape == contacts[0].pressure_MPa.shape
    # a wheel of radius 460 mm along x, and a rail of radius 300 mm across; the fourth order is 0.1 % at the edge
    x_mm, s_mm = contacts[0].x_mm[:, None], contacts[0].s_mm[None, :]
    assert contacts[0].gap_mm == pytest.approx(x_mm**2 / 920.0 + s_mm**2 / 600.0, rel=2e-3)


# --- refusals


def local_function():
    def inner(contact):
        return 1.0

    return inner


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda contact: 1.0, "a lambda is not allowed; write it with def"),
        (local_function(), "inside another function or a class"),
        (max, "allowed: a Python function"),
        (partial(own_functions.peak), "allowed: a Python function"),
        (5.0, "function is 5.0"),
    ],
)
def test_functions_that_no_worker_can_import_are_refused(function, words):
    with pytest.raises(InputError, match=re.escape(words)):
        OwnCriterion(function, "measure", 0.1)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"limit": 0.0}, "limit is 0.0; allowed: finite and > 0"),
        ({"limit": math.nan}, "limit is nan"),
        ({"limit": "5"}, "limit is '5'"),
        ({"name": "mean pressure"}, "name of the own criterion is 'mean pressure'"),
        ({"name": "share_in_middle"}, "without the word in"),
        ({"name": "absolute_load"}, "not beginning with absolute_"),
        ({"name": "p_max"}, "which is a measure or a word of the program; allowed: all except p_max, area, a, b"),
        ({"name": "Area"}, "such as my_Area"),
        ({"name": "all"}, "such as my_all"),
        ({"name": "own"}, "such as my_own"),
        ({"unit": "%"}, "give a fraction in place of %"),
        ({"relative": "no"}, "relative is 'no'; allowed: True, False"),
    ],
)
def test_wrong_settings_are_refused_with_a_remedy(settings, words):
    with pytest.raises(InputError, match=re.escape(words)):
        OwnCriterion(**{"function": own_functions.peak, "name": "peak", "limit": 0.1, **settings})


def test_all_measures_and_sets_are_reserved():
    assert {*_SETS, *_SETS["all"], *_OWN_ALONE, *MEASURES, *MISFITS} <= {*RESERVED_NAMES}


@pytest.mark.parametrize(
    ("criteria", "words"),
    [((PEAK, PEAK), "'peak' more than once"), ("peak", "own is 'peak'"), ((1.0,), "an OwnCriterion")],
)
def test_own_criteria_are_distinct_criteria(criteria, words):
    with pytest.raises(InputError, match=re.escape(words)):
        Criteria(own=criteria)


def test_a_contact_table_refuses_own_criteria():
    with pytest.raises(InputError, match=r"cannot use own criteria \(peak\)"):
        fecontact.table(replace(EXACT, criteria=Criteria(own=PEAK)), [0.0], [50e3])


def test_a_toml_study_has_no_own_criteria(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('rail = "60E1"\n[criteria]\nown = "peak"\n', "utf-8")
    with pytest.raises(InputError, match="own"):
        fecontact.run(path, tmp_path / "out")


# --- names, records and identity


@pytest.mark.parametrize("unit", ["-", "MPa", "N/mm", "N mm", "mm²", "W/mm²", "1/mm"])
def test_units_are_read_back_from_the_names_of_measures(unit):
    criterion = OwnCriterion(own_functions.peak, "line_load", 0.1, unit, relative=False)
    assert split_own_measure(criterion.key) == ("line_load", unit)
    assert MEASURE_WORDS[criterion.key].title == f"line load ({unit})"
    assert MEASURE_WORDS[criterion.key].deviation_text(1234.5678) == f"+1235 {unit}".removesuffix(" -")


def test_records_and_rows_have_own_criteria(exact):
    centre = OwnCriterion(own_functions.centre, "load_centre", 0.2, "mm", relative=False)
    criteria = Criteria(own=(PEAK, centre))
    result = replace(exact, load=judged_by(exact, criteria))
    record = json.loads(json.dumps(result_record(result)))
    jsonschema.validate(record, fecontact.result_schema())
    first, second = record["own_criteria"]
    assert (first["measure"], first["unit"], first["function"]) == (PEAK.key, "MPa", "own_functions:peak")
    assert "contact.pressure_MPa.max()" in first["source"]
    assert first["hertz"] / first["fe"] - 1.0 == pytest.approx(first["deviation"], abs=1e-6)
    assert second["hertz"] - second["fe"] == pytest.approx(second["deviation"], abs=1e-9)
    row = case_row(result)
    assert row["fe_own_peak_in_MPa"] == first["fe"]
    assert row["hertz_deviation_own_peak_percent"] == pytest.approx(100.0 * first["deviation"])
    assert row["hertz_uncertainty_own_absolute_load_centre_in_mm"] == second["uncertainty"]
    assert criteria_text(criteria).endswith("peak ±5 %, load_centre ±0.2 mm")
    # both deviations have their uncertainties beside them
    table = deviation_table([row], "", 50)
    cells = dict(zip((column.heading for column in table.columns), table.rows[0].cells, strict=True))
    uncertainty_mm = row["hertz_uncertainty_own_absolute_load_centre_in_mm"]
    assert cells["\n± mm"] == f"{uncertainty_mm:.3g}"
    headings = [column.heading for column in table.columns]
    assert headings[headings.index("peak\ndev %") + 1] == "\n± %"


def test_the_source_of_a_function_identifies_a_result():
    def origin(criteria: Criteria):
        return determine_origin(replace(EXACT, criteria=criteria))

    changed = replace(PEAK)
    object.__setattr__(changed, "source", PEAK.source.replace("max", "mean"))
    assert origin(Criteria(own=PEAK)) == origin(Criteria(own=PEAK))
    assert origin(Criteria(own=PEAK)).evaluated_by != origin(Criteria(own=changed)).evaluated_by
    assert origin(Criteria(own=PEAK)).solved_by == origin(Criteria(own=changed)).solved_by
    assert origin(Criteria()) == origin(Criteria(own=()))
    differences = [
        describe_differences(origin(old).evaluated_by, origin(new).evaluated_by)
        for old, new in (
            (Criteria(own=PEAK), Criteria(own=changed)),
            (Criteria(own=PEAK), Criteria(own=replace_limit(PEAK, 0.06))),
            (Criteria(own=changed), Criteria(own=replace_limit(PEAK, 0.06))),
            (Criteria(own=PEAK), Criteria()),
            (Criteria(), Criteria(own=PEAK)),
        )
    ]
    assert differences == [
        "own criterion peak: function or unit changed",
        "own criterion peak: limit 0.05 -> 0.06",
        "own criterion peak: function or unit changed and limit 0.05 -> 0.06",
        "own criterion peak is left out",
        "own criterion peak is new",
    ]
    assert make_case_id(EXACT) == make_case_id(replace(EXACT, criteria=Criteria(own=PEAK)))


def test_a_criterion_is_pickled_by_reference():
    criteria = Criteria(own=PEAK)
    assert pickle.loads(pickle.dumps(criteria)) == criteria
    environment = {**os.environ, "PYTHONPATH": str(TESTS.parent)}
    # another process that cannot import the module finds the function in its file
    code = "import pickle, sys; print(pickle.loads(sys.stdin.buffer.read()).own[0].function.__name__)"
    process = subprocess.run(
        [sys.executable, "-c", code], input=pickle.dumps(criteria), env=environment, capture_output=True, check=True
    )
    assert process.stdout == b"peak\n"


def test_a_stored_function_is_used_only_if_it_is_equal():
    record = PEAK.record
    assert restore_criterion(record) == PEAK
    # `run` reads a script under a different name than `import`
    assert restore_criterion({**record, "function": "fecontact_study_mine:peak"}).function is own_functions.peak
    for change, words in (
        ({"source": "def peak(contact):\n    return 1.0\n"}, "differs from the stored function"),
        ({"function": "no_module:absent"}, "no imported module has its function absent"),
        ({"function": "own_functions:none"}, "has no function none"),
    ):
        restored = restore_criterion({**record, **change})
        assert isinstance(restored.function, UnavailableFunction)
        assert words in restored.function.reason
        _, (text,) = Criteria(own=restored).describe_unavailable_own(())
        assert text.startswith("own criterion peak: ")
        assert "no values are stored" in text


def test_a_stored_record_imports_no_module(tmp_path):
    (tmp_path / "evil.py").write_text("print('executed')\n" + PEAK.source, "utf-8")
    code = (
        "import json, sys; from fecontact.own_criterion import restore_criterion;"
        "print(restore_criterion(json.loads(sys.argv[1])).is_available)"
    )
    record = json.dumps({**PEAK.record, "function": "evil:peak"})
    environment = {**os.environ, "PYTHONPATH": str(TESTS.parent)}
    process = subprocess.run(
        [sys.executable, "-c", code, record], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert process.stdout == "False\n"


def test_an_unavailable_function_leaves_the_verdict_open(exact):
    restored = restore_criterion({**PEAK.record, "function": "no_module:absent"})
    load = judged_by(exact, Criteria(own=restored))
    assert load.verdict.answer == "UNRESOLVED"
    assert load.verdict.unknown == (PEAK.key,)
    assert any(
        warning.startswith("not judged: own criterion peak: no imported module has its function absent, and no values")
        for warning in load.warnings
    )
    record = json.loads(json.dumps(result_record(replace(exact, load=load))))
    jsonschema.validate(record, fecontact.result_schema())
    assert record["own_criteria"][0]["fe"] is None


def judge_by_stored_values(load, placement):
    """Judge a load again without its functions, by its stored values."""
    criteria = load.case.criteria
    restored = tuple(
        restore_criterion({**criterion.record, "function": "no_module:absent"}) for criterion in criteria.own
    )
    case = replace(load.case, criteria=replace(criteria, own=restored))
    record = json.loads(json.dumps(make_evaluations_record(load.own_evaluations)))
    evaluations = restore_evaluations(record, criteria.own_measures)
    return judge_load(replace(load.solved, case=case), placement, stored_own=evaluations)


def normalise(load) -> dict:
    """Record of a load without the entries that name stored values."""
    record = json.loads(json.dumps(load_record(load)))
    for verdict in (record["verdict"], record["elastic_verdict"] or {}):
        verdict.pop("warnings", None)
    for criterion in record["own_criteria"]:
        del criterion["stored"], criterion["function"]
    return record


def test_stored_values_give_the_stored_verdict_without_the_function(exact):
    centre = OwnCriterion(own_functions.centre, "load_centre", 0.2, "mm", relative=False)
    load = judged_by(exact, Criteria(own=(PEAK, centre)))
    restored = judge_by_stored_values(load, exact.placement)
    assert normalise(restored) == normalise(load)
    assert restored.stored_own == (PEAK.key, centre.key)
    assert [criterion["stored"] for criterion in load_record(restored)["own_criteria"]] == [True, True]
    assert repr(restored).endswith(", own criteria by stored values>")
    tables = [measures_table(record, record["theories"]["hertz"]) for record in map(load_record, (load, restored))]
    first_titles = [[row.cells[0] for row in table.rows if "peak (" in row.cells[0]] for table in tables]
    assert first_titles == [["peak (MPa)"], ["peak (MPa), stored"]]
    # a third judgement has the stored values too
    assert restored.own_evaluations == load.own_evaluations


@pytest.mark.slow
def test_stored_values_give_the_stored_verdict_of_bodies_that_yield():
    steel = fecontact.Material(young_MPa=206e3, poisson=0.28, yield_MPa=400.0)
    result = fecontact.solve(
        replace(EXACT, rail_material=steel, wheel_material=steel, criteria=Criteria(own=PEAK)),
    )
    assert result.load.plastic is not None
    assert normalise(judge_by_stored_values(result.load, result.placement)) == normalise(result.load)


def test_a_stored_case_has_its_verdict_without_the_function(exact, tmp_path, capsys):
    load = judged_by(exact, Criteria(own=replace_limit(PEAK, 1e-4), judged_by=("strength",), p_max=0.04))
    keep_case(replace(exact, load=load), tmp_path / "case")
    record = (tmp_path / "case" / "solved.json").read_text("utf-8")
    assert '"function": "own_functions:peak"' in record
    (tmp_path / "case" / "solved.json").write_text(record.replace("own_functions:peak", "absent:absent"), "utf-8")
    restored = read_case(tmp_path / "case")
    assert normalise(restored.load) == normalise(load)
    assert "Hertz UNRESOLVED by own_peak_in_MPa, own criteria by stored values" in repr(restored.load)
    # a table that is judged again without a change is equal
    assert load_row(restored.load, exact.placement) == load_row(load, exact.placement)
    # the command answers by the own criterion alone, and keeps its limit
    seal_case(load.case, tmp_path / "case")
    assert call(["judge", str(tmp_path / "case"), "--judged-by", "own"]) == 0
    output = capsys.readouterr()
    assert "1 case judged by peak ±0.01 %" in output.out
    assert "note: own criterion peak: no imported module has its function absent; its stored values" in output.err
    # values of a different function are not stored
    changed = replace(PEAK)
    object.__setattr__(changed, "source", PEAK.source.replace("max", "mean"))
    changed_record = {**changed.record, "function": "absent:absent"}
    (message,) = [
        warning
        for warning in read_case(
            tmp_path / "case", criteria=Criteria(own=restore_criterion(changed_record))
        ).load.warnings
        if "own criterion" in warning
    ]
    assert message.startswith("not judged: own criterion peak: no imported module has its function absent, and no")


# --- studies and maps with workers


def run_python(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(TESTS.parent)}
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=900
    )


STUDY = """\
import fecontact


def mean_pressure(contact):
    return contact.normal_force_N / contact.weight_mm2[contact.pressure_MPa > 0.0].sum()


CRITERIA = fecontact.Criteria(own=fecontact.OwnCriterion(mean_pressure, "mean_pressure", 0.10, "MPa"))
PAIR = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0, "refine": "never"}


def cases(quick=False):
    return [fecontact.Case(**PAIR, load_N=load_N, criteria=CRITERIA) for load_N in (50e3, 100e3)]


def main():
    fecontact.run(cases(), "out", workers=2)


if __name__ == "__main__":
    main()
"""


def read_rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "study.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_a_study_with_workers_is_resumed_and_judged(tmp_path):
    script = tmp_path / "mine.py"
    script.write_text(STUDY, "utf-8")
    process = run_python(tmp_path, "-m", "fecontact", "run", "mine.py", "--out", "out", "--workers", "2")
    assert process.returncode == 0, process.stderr
    assert "mean_pressure" in process.stdout
    rows = read_rows(tmp_path / "out")
    assert [row["verdict_answer"] for row in rows] == ["HOLDS", "HOLDS"]
    column = "hertz_deviation_own_mean_pressure_percent"
    assert all(abs(float(row[column])) < 2.0 for row in rows)
    assert "mean pressure (MPa)" in (tmp_path / "out" / "report.html").read_text("utf-8")
    # an equal function is not evaluated again
    process = run_python(tmp_path, "-m", "fecontact", "run", "mine.py", "--out", "out", "--workers", "2")
    assert "judged again" not in process.stdout + process.stderr
    # results of another function are not taken
    script.write_text(STUDY.replace("return contact", "return 2.0 * contact"), "utf-8")
    process = run_python(tmp_path, "-m", "fecontact", "run", "mine.py", "--out", "out", "--workers", "2")
    assert process.returncode == 0, process.stderr
    doubled = read_rows(tmp_path / "out")
    values = [float(row["fe_own_mean_pressure_in_MPa"]) for row in (rows[0], doubled[0])]
    assert values[1] == pytest.approx(2.0 * values[0])
    # no process but the script's knows the function: the stored values are used
    process = run_python(tmp_path, "-m", "fecontact", "judge", "out", "--p-max-percent", "3", "--out", "judged")
    assert process.returncode == 0, process.stderr
    assert "mean pressure (MPa)" in (tmp_path / "judged" / "report.html").read_text("utf-8")
    assert (
        "note: own criterion mean_pressure: no imported module has its function mean_pressure; its stored values"
        in process.stderr
    )
    assert "UNRESOLVED" not in process.stdout
    judged_rows = read_rows(tmp_path / "judged")
    assert [row[column] for row in judged_rows] == [row[column] for row in doubled]
    code = (
        "import fecontact, mine; print([row['verdict_answer'] for row in fecontact.judge('out', mine.CRITERIA).rows])"
    )
    assert run_python(tmp_path, "-c", code).stdout == "['HOLDS', 'HOLDS']\n"


@pytest.mark.slow
def test_a_script_with_a_main_guard_uses_workers(tmp_path):
    (tmp_path / "mine.py").write_text(STUDY, "utf-8")
    process = run_python(tmp_path, "mine.py")
    assert process.returncode == 0, process.stderr
    assert len(read_rows(tmp_path / "out")) == 2


def test_a_script_without_a_main_guard_is_refused(tmp_path):
    (tmp_path / "mine.py").write_text(STUDY.replace('if __name__ == "__main__":\n    main()', "main()"), "utf-8")
    process = run_python(tmp_path, "mine.py")
    assert "put the calls of the script below if __name__ == '__main__':" in process.stderr
    assert not (tmp_path / "out" / "cases").exists() or not [*(tmp_path / "out" / "cases").iterdir()]


@pytest.mark.slow
def test_an_error_in_a_worker_is_the_reason_of_the_case(tmp_path):
    (tmp_path / "mine.py").write_text(STUDY.replace("return contact", "return contact.nothing * contact"), "utf-8")
    process = run_python(tmp_path, "-m", "fecontact", "run", "mine.py", "--out", "out", "--workers", "2")
    assert process.returncode == 3, process.stderr
    assert (
        "raised AttributeError: 'ContactField' object has no attribute 'nothing'"
        in read_rows(tmp_path / "out")[0]["status"]
    )


MAP = """\
import fecontact
import mine

if __name__ == "__main__":
    case = fecontact.Case(**mine.PAIR, criteria=mine.CRITERIA)
    made = fecontact.map(case, [0.0], [50e3, 100e3], "out", workers=2).made
    print([cell.verdict for cell in made])
"""


@pytest.mark.slow
def test_a_map_shows_an_own_criterion(tmp_path):
    (tmp_path / "mine.py").write_text(STUDY, "utf-8")
    (tmp_path / "map.py").write_text(MAP, "utf-8")
    process = run_python(tmp_path, "map.py")
    assert process.stdout == "['HOLDS', 'HOLDS']\n", process.stderr
    assert (tmp_path / "out" / "map_own_mean_pressure.png").is_file()
    code = "import fecontact, mine; judged = fecontact.judge('out', measure='own_mean_pressure')"
    process = run_python(tmp_path, "-c", f"{code}; print(judged.all_judged, *judged.terminal_parts(None))")
    assert process.returncode == 0, process.stderr
    assert process.stdout.startswith("True ")
    assert "Hertz's mean pressure holds at all loads" in process.stdout
    assert "limit ±10 % mean_pressure" in process.stdout
    # the command does not import the module, and uses the stored values
    words = ("-m", "fecontact", "judge", "out", "--measure", "own_mean_pressure")
    process = run_python(tmp_path, *words, "--out", "judged")
    assert process.returncode == 0, process.stderr
    assert (tmp_path / "judged" / "report.html").is_file()
    assert "own criterion mean_pressure: no imported module has its function mean_pressure; its" in process.stderr
    assert "Hertz's mean pressure holds at all loads" in process.stdout
    process = run_python(tmp_path, *words[:-1], "own_other")
    assert "allowed: pressure, theory, force, own_mean_pressure" in process.stderr
    # a map without the criterion has no picture of it, and pictures of somebody else stay
    (tmp_path / "judged" / "map_own_notes.png").touch()
    code = "import fecontact; fecontact.judge('out', fecontact.Criteria(own=()), out='judged')"
    process = run_python(tmp_path, "-c", code)
    assert process.returncode == 0, process.stderr
    assert [path.name for path in (tmp_path / "judged").glob("map_own_*")] == ["map_own_notes.png"]


@pytest.mark.slow
def test_the_study_of_the_guide_runs(tmp_path):
    (code,) = re.findall(r"^```py\n(.*?)^```$", read_page("python"), re.MULTILINE | re.DOTALL)
    (tmp_path / "own_criterion.py").write_text(code, "utf-8")
    process = run_python(tmp_path, "-m", "fecontact", "run", "own_criterion.py", "--quick", "--out", "out/own")
    assert process.returncode == 0, process.stderr
    (row,) = read_rows(tmp_path / "out" / "own")
    # Hertz's ellipse is longer and narrower than the patch, and its mean pressure is higher
    assert 5.0 < float(row["hertz_deviation_own_mean_pressure_percent"]) < 20.0
    assert float(row["hertz_deviation_own_absolute_outer_load_in_N"]) < -2000.0
