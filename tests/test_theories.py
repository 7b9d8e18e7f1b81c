"""A judged theory as a value: its deviations, its judgement, and a further theory as a further entry."""

import io
import json
import math
import pickle
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from kept import keep_as
from rich.console import Console
from rungs import on_half_space

from fecontact.case import Case, Criteria
from fecontact.contact.grid import ContactGrid
from fecontact.contact_theories.approximation import TheoryContact, TheoryPatch, patch_from_ellipse
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import (
    HERTZ,
    HERTZ_GAUGE,
    MULTI_HERTZ,
    THEORIES,
    LoadedPlacement,
    Theory,
    _strip_theory_function,
)
from fecontact.feature_registry import load_offers
from fecontact.judging.judge import judge_load
from fecontact.judging.measures import MEASURES, MISFITS, compute_deviations
from fecontact.judging.theory import judge_theory
from fecontact.judging.verdict import find_cheapest_theory, list_theory_answers
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.records.results import load_record, load_row, result_record
from fecontact.outputs.study_report import parts_of_rows, read_reported_case, write_study_report
from fecontact.outputs.terminal import print_parts
from fecontact.outputs.words import MEASURE_WORDS as WORDS_OF_MEASURES
from fecontact.regression.tables import LATER_COLUMN_PREFIXES, TEXT_KIND, TOLERANCES_BY_KIND, find_kind
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

ROUND = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
TWO_POINTS = Case(lateral_shift_mm=5.0, roll="touching", load_N=50e3)


def solved_on_half_space(case):
    """A load whose finite elements are a half-space, and its placement."""
    placement = place_case(case)
    _, expected = expect_on_half_space(case, placement)
    return on_half_space(case, placement, expected.half_space), placement


@pytest.fixture(scope="module")
def two():
    """A wheel on the top of the head and on the gauge corner, with friction."""
    return solved_on_half_space(TWO_POINTS)


@pytest.fixture(scope="module")
def judged_two(two):
    return judge_load(*two)


# how a theory is read


@dataclass(frozen=True)
class Pressure:
    """A pressure without any other attribute."""

    of: HertzContact

    def pressure_MPa(self, x_mm, y_mm):
        return self.of.pressure_MPa(x_mm, y_mm)


def test_a_theory_with_a_single_ellipse_reads_as_hertz():
    solved_load, placement = solved_on_half_space(ROUND)
    load = judge_load(solved_load, placement)
    hertz = load.judgements[HERTZ]
    same = judge_theory(
        ROUND, solved_load.levels, TheoryContact(patches=(patch_from_ellipse(load.hertz),), approach_mm=0.1)
    )
    # all but the approach, which is the theory's own word
    for name in (*MEASURES, *MISFITS):
        if name != "approach_mm":
            assert same.deviation[name] == hertz.deviation[name], name
            assert same.uncertainty[name] == hertz.uncertainty[name], name
    assert same.deviation["approach_mm"] == 0.1 / solved_load.levels[0].fe.approach_mm - 1.0
    assert (same.verdict, same.limits, same.limit_utilisation) == (hertz.verdict, hertz.limits, hertz.limit_utilisation)
    assert same.hertz == load.hertz
    # a pressure that is not known to be an ellipse is read off nodes, as the contact itself
    (patch,) = same.approximation.patches
    unknown = replace(same.approximation, patches=(replace(patch, shape=Pressure(of=load.hertz)),))
    verdict = judge_theory(ROUND, solved_load.levels, unknown)
    assert unknown.single.hertz is None
    assert verdict.deviation == pytest.approx(same.deviation, abs=1e-12)


@pytest.mark.parametrize("at", [(0.0, 3.7), (1.1, -2.0)])
def test_a_theory_is_read_where_it_lies(at):
    """A shift of contact and ellipse together, on all nodes of a whole contact.

    It changes nothing.
    """
    solved_load, placement = solved_on_half_space(replace(ROUND, yaw_rad=0.01))
    rung, hertz = solved_load.half_space, judge_load(solved_load, placement).hertz
    assert not rung.grid.half
    moved_grid = ContactGrid(x_mm=rung.grid.x_mm + at[0], s_mm=rung.grid.s_mm + at[1], half=False)
    deviations = compute_deviations(rung, TheoryContact.of(hertz))
    moved_theory = TheoryContact(patches=(patch_from_ellipse(hertz, at),), approach_mm=hertz.approach_mm)
    assert compute_deviations(replace(rung, grid=moved_grid), moved_theory) == pytest.approx(deviations, abs=1e-9)
    # left behind it is beside the contact by so many half-widths
    left = compute_deviations(replace(rung, grid=moved_grid), TheoryContact.of(hertz))
    assert left["centre_over_b"] - deviations["centre_over_b"] == pytest.approx(
        2.0 * at[1] / hertz.extent_y_mm, abs=1e-9
    )


def test_the_cheapest_theory_of_the_pressure(two, judged_two):
    load = judged_two
    assert list(load.judgements)[:2] == [HERTZ, MULTI_HERTZ]
    answers = [load.judgements[name].verdict.answer for name in (HERTZ, MULTI_HERTZ)]
    assert answers == ["FAILS", "HOLDS"]
    assert find_cheapest_theory(list_theory_answers(load.judgements)).label == MULTI_HERTZ
    # its own criteria decide, however the load is read
    strict = replace(two[0], case=replace(TWO_POINTS, criteria=Criteria(p_max=0.01)))
    assert find_cheapest_theory(list_theory_answers(judge_load(strict, two[1]).judgements)).label != MULTI_HERTZ


# what is asked for


def test_by_hertz_alone_nothing_else_is_looked_at(two, judged_two, monkeypatch):
    judged_by_all = judged_two
    assert judged_by_all.lobes

    def refuse(*_):
        raise AssertionError("it was not asked for")

    for name in THEORIES:
        if name not in (HERTZ, HERTZ_GAUGE):
            monkeypatch.setitem(THEORIES, name, replace(THEORIES[name], approximate=refuse))
    monkeypatch.setattr("fecontact.judging.judge.judge_lobes", refuse)
    monkeypatch.setattr("fecontact.judging.judge.load_offers", refuse)
    alone = judge_load(*two, theories=(HERTZ,))
    assert list(alone.judgements) == [HERTZ]
    assert (alone.without, alone.lobes, alone.features) == ({}, (), {})
    # and its statement about Hertz does not change
    record, of_all = load_record(alone), load_record(judged_by_all)
    assert record["theories"] == {**dict.fromkeys(THEORIES), HERTZ: of_all["theories"][HERTZ]}
    same = ("verdict", "fe", "elements", "half_space_quadratic", "steps", "steps_uncertainty", "geometry", "solver")
    assert {name: record[name] for name in same} == {name: of_all[name] for name in same}


def same_values(first, second):
    """Whether two values have equal fields, to the last bit."""
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and np.array_equal(first, second, equal_nan=first.dtype.kind == "f")
    if is_dataclass(first):
        return all(same_values(getattr(first, field.name), getattr(second, field.name)) for field in fields(first))
    if isinstance(first, Mapping):
        return list(first) == list(second) and all(same_values(first[name], second[name]) for name in first)
    if isinstance(first, tuple | list):
        return len(first) == len(second) and all(map(same_values, first, second))
    return first == second or (isinstance(first, float) and math.isnan(first) and math.isnan(second))


def test_a_judged_load_goes_to_another_process_and_comes_back(two, judged_two):
    load = judged_two
    back = pickle.loads(pickle.dumps(load))
    assert back is not load
    assert same_values(back, load)
    assert json.dumps(load_record(back)) == json.dumps(load_record(load))
    assert load_row(back, two[1]) == load_row(load, two[1])
    # the comparison sees what differs
    judgement = load.judgements[MULTI_HERTZ]
    planted = replace(
        judgement, deviation={**judgement.deviation, "valley": math.nextafter(judgement.deviation["valley"], 1.0)}
    )
    assert not same_values(replace(load, judgements={**load.judgements, MULTI_HERTZ: planted}), load)


@pytest.mark.parametrize("case", [ROUND, replace(TWO_POINTS, load_N=50.0)])
def test_ellipses_that_share_a_load_are_told_only_where_several_carry_it(case):
    placement = place_case(case)
    # two contact points, of which a small load closes one
    assert len(placement.contact_points) == (1 if case is ROUND else 2)
    force = compute_hertz(case, placement).normal_force_N
    assert (
        THEORIES[MULTI_HERTZ].approximate(LoadedPlacement(placement=placement, case=case, normal_force_N=force)) is None
    )
    if case is ROUND:
        load = judge_load(solved_on_half_space(case)[0], placement)
        assert MULTI_HERTZ not in load.judgements
        assert load.without == {}


# a further theory


@dataclass(frozen=True)
class Block:
    """A uniform pressure on an ellipse."""

    a_mm: float
    b_mm: float
    p_MPa: float

    def pressure_MPa(self, x_mm, y_mm):
        return np.where((x_mm / self.a_mm) ** 2 + (y_mm / self.b_mm) ** 2 < 1.0, self.p_MPa, 0.0)


def block(loaded):
    """Hertz's ellipse with its mean pressure."""
    hertz, force_N = compute_hertz(loaded.case, loaded.placement), loaded.normal_force_N
    a, b = hertz.a_mm, hertz.b_mm
    patch = TheoryPatch(
        shape=Block(a, b, force_N / (math.pi * a * b)),
        normal_force_N=force_N,
        p_max_MPa=force_N / (math.pi * a * b),
        area_mm2=math.pi * a * b,
        a_mm=a,
        b_mm=b,
        origin_mm=(0.0, 0.0),
        centre_mm=(0.0, 0.0),
        low_mm=(-a, -b),
        high_mm=(a, b),
    )
    return TheoryContact(patches=(patch,), approach_mm=hertz.approach_mm)


WORDS = "a block on Hertz's ellipse"


@pytest.fixture
def another(monkeypatch):
    """A further entry in the table of theories."""
    entry = Theory(words=WORDS, letter="W", cost="closed form", source="this test", range="none", approximate=block)
    monkeypatch.setitem(THEORIES, "block", entry)
    return entry


def printed(lines, *options):
    text = io.StringIO()
    print_parts(lines(*options), Console(file=text, width=250), long=True)
    return text.getvalue()


@pytest.fixture
def judged_result(another, elliptic_quick):
    """A result of finite elements, judged by the further theory too."""
    return replace(elliptic_quick, load=judge_load(elliptic_quick.load.solved, elliptic_quick.placement))


def test_a_further_theory_is_judged_by_the_same_measures(judged_result):
    load = judged_result.load
    block, hertz = load.judgements["block"], load.judgements[HERTZ]
    # a block has two thirds of the peak of Hertz's ellipse
    assert 1.0 + block.deviation["p_max_MPa"] == pytest.approx(2.0 / 3.0 * (1.0 + hertz.deviation["p_max_MPa"]))
    assert block.deviation["area_mm2"] == pytest.approx(hertz.deviation["area_mm2"], abs=1e-9)
    # and 4/27 of its load elsewhere: 1.5 sqrt(1 - u) against 1 over u from 0 to 1
    assert block.deviation["misplaced_load"] == pytest.approx(4.0 / 27.0, abs=0.002)
    assert block.deviation["valley"] == pytest.approx(0.0, abs=1e-3)
    assert (block.verdict.answer, block.verdict.measure) == ("FAILS", "p_max_MPa")
    assert block.verdict.each["area_mm2"] == hertz.verdict.each["area_mm2"]
    # it says nothing about Hertz
    assert load.verdict.answer == "HOLDS"
    assert find_cheapest_theory(list_theory_answers(load.judgements)).label == HERTZ


def test_a_further_theory_is_in_all_that_tells_of_a_case(judged_result, tmp_path):
    record = json.loads(json.dumps(result_record(judged_result)))
    block_record, block = record["theories"]["block"], judged_result.load.judgements["block"]
    assert [name for name in record["theories"] if name in (HERTZ, "block")] == [HERTZ, "block"]
    assert block_record["deviation"] == dict(block.deviation)
    assert block_record["verdict"]["answer"] == "FAILS"
    assert block_record["p_max_MPa"] == block.approximation.patches[0].p_max_MPa
    assert WORDS in printed(case_parts, record)
    row = keep_as(judged_result, tmp_path / "cases" / "one")
    assert (row["block_verdict_answer"], row["block_verdict_measure"]) == ("FAILS", "p_max_MPa")
    assert row["block_deviation_p_max_percent"] == 1e2 * block.deviation["p_max_MPa"]
    assert row["block_limit_utilisation"] == block.limit_utilisation > 1.0
    # where Hertz holds, no other theory is recommended
    assert row["cheapest_theory"] == HERTZ
    assert "cheapest theory that holds" not in printed(parts_of_rows, [row])
    write_study_report("one", [read_reported_case(row, tmp_path / "cases" / "one")], tmp_path)
    report = (tmp_path / "report.html").read_text("utf-8").replace("&#39;", "'")
    assert WORDS in report


def test_the_columns_of_a_further_theory_are_compared(judged_result):
    row = load_row(judged_result.load, judged_result.placement)
    columns = [name for name in row if name.startswith("block_")]
    assert len(columns) == 7
    assert not [name for name in columns if find_kind(name) not in {*TOLERANCES_BY_KIND, TEXT_KIND} - {"default"}]
    # and a baseline may be older than any theory but Hertz's
    assert {f"{name}_" for name in THEORIES} - {*LATER_COLUMN_PREFIXES} == {f"{HERTZ}_", "block_"}


def test_a_theory_that_has_no_contact_says_why(judged_result, another, monkeypatch):
    monkeypatch.setitem(THEORIES, "block", replace(another, approximate=lambda loaded: "no block fits"))
    load = judge_load(judged_result.load.solved, judged_result.placement)
    assert "block" not in load.judgements
    assert load.without == {"block": "no block fits"}
    record = result_record(replace(judged_result, load=load))
    block = record["theories"]["block"]
    assert {name: value for name, value in block.items() if value is not None} == {"problem": "no block fits"}
    text = printed(case_parts, record)
    assert WORDS in text
    assert "no block fits" in text
    assert not [name for name in load_row(load, judged_result.placement) if name.startswith("block_")]


def test_a_letter_of_maps_has_one_meaning_in_all_pictures_and_tables():
    """Theories, laws, measures, causes, causes of features, and signs of answers."""
    pytest.importorskip("fecontact.maps")
    from fecontact.maps.verdict_views import CAUSES

    meanings = [
        *((theory.letter, theory.words) for theory in THEORIES.values()),
        *((letter, name) for laws in load_offers("LAWS").values() for name, (letter, _) in laws.marks.items()),
        *((words.letter, words.name) for words in WORDS_OF_MEASURES.values()),
        *CAUSES.values(),
        *(cause for maps in load_offers("MAPS").values() for cause in maps.causes.values()),
        *(("+", "holds"), ("x", "fails"), ("?", "open"), ("!", "lost"), ("*", "out of its range")),
    ]
    letters = Counter(letter for letter, _ in meanings)
    assert len(meanings) > 30
    assert [(letter, what) for letter, what in meanings if letters[letter] > 1] == []
    assert THEORIES["hertz"].letter == "H"


@pytest.mark.parametrize(
    ("notes", "said"),
    [((), "no strip is in contact"), (("the line is short", "too flat"), "the line is short; too flat")],
)
def test_strips_that_do_not_touch_say_why(notes, said):
    case = replace(ROUND, load_kind="normal")
    strips = SimpleNamespace(half_length_mm=np.zeros(3), notes=notes)
    loaded = LoadedPlacement(placement=place_case(case), case=case, normal_force_N=1e4)
    assert _strip_theory_function(lambda line, load_N: strips)(loaded) == said
