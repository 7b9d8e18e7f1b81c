"""The contributions to an uncertainty add up to it, and are shown in results."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fecontact.case import Case
from fecontact.guide.pages import read_page
from fecontact.judging.measures import MEASURES, UNCERTAINTIES, read_measures
from fecontact.judging.uncertainty import (
    SolutionQuality,
    estimate_budget,
    estimate_elements_budget,
    estimate_step_budget,
    estimate_uncertainty,
)
from fecontact.judging.uncertainty_budget import UncertaintyBudget
from fecontact.outputs.budget import budget_table
from fecontact.outputs.figures.budget import draw_budget, group_contributions
from fecontact.outputs.records.results import load_row, result_record
from fecontact.outputs.style import blank_figure
from fecontact.outputs.words import CONTRIBUTION_WORDS, MEASURE_WORDS
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.solve import solve

ROOT = Path(__file__).parents[1]
MEASURED = tuple(name for name, declared in UNCERTAINTIES.items() if declared.reading is not None)
small = st.floats(0.0, 0.05)


@given(
    name=st.sampled_from(MEASURED),
    change=small,
    fit=small,
    quality=st.builds(
        SolutionQuality,
        residual=small,
        compliance_error=small,
        parting=st.booleans(),
        shared=st.booleans(),
        skew=small,
        more_nodes=small.map(lambda change: dict.fromkeys(MEASURED, change)),
        joined_share=st.floats(0.3, 1.0),
        turned_force=small,
    ),
)
def test_contributions_add_up(name, change, fit, quality):
    """Sum of all contributions, computed a second time from the declared values."""
    values, other_fit_value = (2.0, 2.0 * (1.0 + change)), 2.0 * (1.0 + fit)
    budget = estimate_budget(name, values, quality, otherwise=other_fit_value)
    declared, size = UNCERTAINTIES[name], 2.0 if name in MEASURES else 1.0
    cut_planes = declared.cut_planes
    if quality.shared:
        cut_planes = 2.0 * 0.016 if name == "separate_load" else max(cut_planes, declared.shared_cut_planes)
    reading = declared.reading + (2.0 - math.sqrt(4.0 - declared.noise**2) if declared.noise else 0.0)
    nodes = quality.more_nodes[name]
    is_peak = name == "p_max_MPa"
    share = min(quality.joined_share, 1.0 - quality.joined_share)
    expected = (
        (max(reading, 2.5 * nodes) if name in ("area_mm2", "extent_y_mm") else reading + 3.0 * nodes)
        + (1.5 if quality.parting else 1.0) * 2.0 * change / size
        + declared.common_mesh_error
        + declared.skewness_error * quality.skew
        + 2.0 * 2.0 * fit / size
        + cut_planes
        + (0.016 * share / quality.joined_share / 3.0 if is_peak and not quality.shared else 0.0)
        + (quality.turned_force / 3.0 if is_peak else 0.0)
        + 0.05 * quality.compliance_error * 2.0 / size
        + quality.residual
    )
    assert budget.total == pytest.approx(expected, rel=1e-12)
    assert estimate_uncertainty(name, values, quality, otherwise=other_fit_value) == budget.total
    step = estimate_step_budget(name, values, quality, otherwise=other_fit_value)
    left_out = budget.reading + budget.more_nodes + budget.turned_force
    assert step.total == pytest.approx(budget.total - left_out, rel=1e-9, abs=1e-15)


def test_a_value_that_is_not_finite_makes_the_sum_undefined():
    for name in MEASURED:
        assert math.isnan(estimate_budget(name, (1.0, math.nan)).total)
        assert math.isnan(estimate_elements_budget(name, (1.0, math.nan), elements=4.0, compliance_error=0.0).total)


def test_scaling_keeps_the_contributions_in_proportion():
    budget = UncertaintyBudget(reading=0.001, cut_planes=0.003)
    scaled = budget.scaled(2.0)
    assert (scaled.reading, scaled.cut_planes, scaled.total) == (0.002, 0.006, pytest.approx(0.008))
    assert set(CONTRIBUTION_WORDS) == {contribution.name for contribution in dataclasses.fields(budget)}


def test_every_stated_uncertainty_has_its_contributions(elliptic_quick):
    """In a judgement, in the record, and in the table of the long output."""
    load = elliptic_quick.load
    for judgement in (*load.judgements.values(), load.by_elements):
        assert judgement.budgets.keys() == judgement.uncertainty.keys()
        for name, value in judgement.uncertainty.items():
            assert judgement.budgets[name].total == pytest.approx(value, rel=1e-12)
    record = result_record(elliptic_quick)
    for name, contributions in record["uncertainty_budget"].items():
        assert sum(contributions.values()) == pytest.approx(load.deciding.uncertainty[name], rel=1e-12)
        assert contributions["profile_variants"] == contributions["plastic_step"] == 0.0
    table = budget_table(record)
    assert [row.cells[0] for row in table.rows] == [
        *(words for name, words in CONTRIBUTION_WORDS.items() if any(
            contributions[name] for measure, contributions in record["uncertainty_budget"].items()
            if measure in record["verdict"]["each"]
        )),
        "sum",
    ]  # fmt: skip
    for column, name in enumerate(record["verdict"]["each"], start=1):
        cells = [float(row.cells[column] or 0.0) for row in table.rows]
        digits = 3 if name != "centre_over_b" else 4
        assert cells[-1] == pytest.approx(sum(cells[:-1]), abs=0.5 * len(cells) * 10.0**-digits)
    assert not [
        column for column in load_row(load, elliptic_quick.placement) if column.startswith("uncertainty_budget")
    ]


def test_the_bar_is_as_long_as_the_uncertainty(elliptic_quick):
    budget = result_record(elliptic_quick)["uncertainty_budget"]["p_max_MPa"]
    total = elliptic_quick.load.deciding.budgets["p_max_MPa"].total
    groups = group_contributions(budget)
    assert sum(groups.values()) == pytest.approx(total, rel=1e-12)
    *large, _ = groups.values()
    assert large == sorted(large, reverse=True)
    ax = blank_figure(8.0, 1.0).add_subplot()
    draw_budget(ax, "p_max_MPa", budget)
    ends = [bar.get_x() + bar.get_width() for bar in ax.patches]
    np.testing.assert_allclose(ends, np.cumsum([*groups.values()]), rtol=1e-12)
    assert ax.get_xlim() == (0.0, pytest.approx(total, rel=1e-12))


@pytest.fixture(scope="module")
def page() -> str:
    """Page of the guide on the contributions."""
    return read_page("uncertainty")


def table_rows(page: str, heading: str) -> list[list[str]]:
    """Cells of a table, found by the first words of its heading."""
    table = page[page.index(f"| {heading}") :].partition("\n\n")[0]
    return [[cell.strip(" *") for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]


# Measures in the order of the printed table.
JUDGED = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "centre_over_b", "valley", "separate_load", "misplaced_load")


def read_printed_budget(page: str) -> dict[str, dict[str, float]]:
    """Contributions by measure from the printed table of the page.

    They are in the units of the deviations. Numbers end below the units of the first line.
    """
    head, *lines = re.search(r"^```text\n(contribution .*?)^```$", page, re.MULTILINE | re.DOTALL)[1].splitlines()
    ends = [unit.end() for unit in re.finditer("[%b](?= |$)", head)]
    assert len(ends) == len(JUDGED)
    budgets: dict[str, dict[str, float]] = {measure: {} for measure in JUDGED}
    for line in lines:
        name, _, numbers = re.match(r"(\S+(?: \S+)*)( {2,})(.*)", line).groups()
        columns = [number.end() for number in re.finditer(r"\S+", line) if number.start() >= len(name)]
        assert set(columns) <= set(ends), line
        for column, number in zip(columns, numbers.split(), strict=True):
            budgets[JUDGED[ends.index(column)]][name] = float(number)
    return budgets


def test_the_page_names_every_contribution_of_its_table(page):
    for budget in read_printed_budget(page).values():
        total = budget.pop("sum")
        assert budget.keys() <= {*CONTRIBUTION_WORDS.values()}
        assert total == pytest.approx(sum(budget.values()), abs=0.0005 * len(budget))


def test_constant_contributions_and_the_sum_of_the_page_agree(page):
    rows = {row[0]: [*map(float, row[1:])] for row in table_rows(page, "contribution to the ± of the area")}
    meshes = {row[0]: row[3] for row in table_rows(page, "elements per semi-axis") if row[3]}
    sums = [float(number) for number in meshes.values()]
    assert [sum(column) for column in zip(*rows.values(), strict=True)] == pytest.approx(sums, abs=0.0021)
    budget = read_printed_budget(page)["area_mm2"]
    assert sums[0] == budget["sum"]
    assert all(budget[name] == rows[name][0] for name in rows if name in budget)


def test_the_observed_order_of_the_page_follows_from_its_peaks():
    """The half-space of the position is solved again on all nodes of the table."""
    rows = table_rows(read_page("uncertainty"), "nodes per semi-axis")
    patches = [
        read_measures(expect_on_half_space(Case(lateral_shift_mm=3.0), nodes=int(row[0]))[1].half_space) for row in rows
    ]
    peaks = [patch.p_max_MPa for patch in patches]
    assert [float(row[1]) for row in rows] == pytest.approx(peaks, abs=0.01)
    assert [float(row[2]) for row in rows] == pytest.approx([patch.area_mm2 for patch in patches], abs=0.01)
    changes = -np.diff(peaks)
    orders = np.log2(changes[:-1] / changes[1:])
    assert [float(row[3]) for row in rows if row[3]] == pytest.approx([*orders], abs=0.051)
    assert 100.0 * (peaks[2] / peaks[-1] - 1.0) == pytest.approx(0.007, abs=0.0005)
    assert 100.0 * (patches[2].area_mm2 / patches[-1].area_mm2 - 1.0) == pytest.approx(0.25, abs=0.005)


def test_the_coverage_of_the_page_is_of_the_last_validation(page):
    validation = (ROOT / "studies" / "validation" / "12_uncertainty.md").read_text("utf-8")
    outside = {
        (measure, kind): float(percentage)
        for measure, kind, percentage in re.findall(
            r"^\| (\w+), cases outside, % \| (\w+, testing, \d+ cases) \| 0 \| ([\d.]+) \|", validation, re.MULTILINE
        )
    }
    kinds = ("ellipses, testing, 243 cases", "others, testing, 31 cases", "real, testing, 42 cases")
    rows = {row[0]: [*map(float, row[1:])] for row in table_rows(page, "measure | 243 ellipses")}
    assert [*rows] == [MEASURE_WORDS[measure].name for measure in JUDGED]
    for measure, percentages in zip(JUDGED, rows.values(), strict=True):
        assert percentages == pytest.approx([100.0 - outside[measure, kind] for kind in kinds], abs=0.051), measure


@pytest.mark.slow
def test_the_page_has_the_numbers_of_its_position(page):
    levels = {}
    for resolution in ("quick", "standard", "fine"):
        load = solve(Case(lateral_shift_mm=3.0, resolution=resolution, refine="never")).load
        budgets = load.deciding.budgets
        for level in load.solved.levels:
            measures = read_measures(level.fe)
            elements = round(measures.a_mm / level.nodal.grid.steps_mm[0], 1)
            levels.setdefault(elements, (measures.p_max_MPa, measures.area_mm2))
        column = ("quick", "standard", "fine").index(resolution) + 1
        constant = {row[0]: float(row[column]) for row in table_rows(page, "contribution to the ± of the area")}
        for name in ("reading", "cut_planes", "more_nodes"):
            value = 100.0 * getattr(budgets["area_mm2"], name)
            assert constant[CONTRIBUTION_WORDS[name]] == pytest.approx(value, abs=0.0006)
        rows = {row[0]: row[1:] for row in table_rows(page, "elements per semi-axis")}
        (name,) = (name for name in rows if resolution in name)
        assert float(rows[name][2]) == pytest.approx(100.0 * budgets["area_mm2"].total, abs=0.001)
        if resolution == "quick":
            keys = {words: key for key, words in CONTRIBUTION_WORDS.items()}
            for measure, budget in read_printed_budget(page).items():
                factor = MEASURE_WORDS[measure].factor
                assert budget.pop("sum") == pytest.approx(factor * budgets[measure].total, abs=0.0006)
                for contribution, size in budget.items():
                    value = factor * getattr(budgets[measure], keys[contribution])
                    assert size == pytest.approx(value, abs=0.0006), (measure, contribution)
    for name, (peak, area, _) in rows.items():
        nearest = min(levels, key=lambda elements: abs(elements - float(name.split()[0])))
        assert abs(nearest - float(name.split()[0])) < 0.15
        # the last digits depend on the machine
        assert float(peak) == pytest.approx(levels[nearest][0], abs=0.1)
        assert float(area) == pytest.approx(levels[nearest][1], abs=0.02)


@pytest.mark.parametrize("measure", MEASURES)
def test_a_size_of_zero_has_no_relative_uncertainty(measure):
    """A lobe on a single line of nodes has the half-width 0."""
    assert math.isnan(estimate_step_budget(measure, [0.0, 0.1]).total)
    budget = estimate_elements_budget(measure, [0.0, 0.1], elements=5.0, compliance_error=0.01)
    assert budget is None or math.isnan(budget.total)
