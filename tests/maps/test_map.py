"""The applicability map with its limits, its run and its files.

Also loads with reused factors, and contact stiffness.
"""

import csv
import hashlib
import json
import math
import os
import pickle
import re
import shutil
import subprocess
import sys
import threading
import time
from bisect import bisect
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import ClassVar

import numpy as np
import psutil
import pytest
from damage import files_without_checksum, unnoticed
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from marks import slow_but
from points import MEASURED_COLUMNS
from positions import map_by
from test_study import dask_cluster

import fecontact
from fecontact.bodies import Material
from fecontact.case import Case, Criteria, Track
from fecontact.cli import call
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.contact_theories.approximation import average_pressure_over_cells
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, MULTI_HERTZ, THEORIES
from fecontact.errors import InputError, MemoryShortageError, ProgramError
from fecontact.files import format_json
from fecontact.inputs.texts import parse_numbers
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.store import write_manifest
from fecontact.jobs.workers import Crew, WorkResult
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.lines import ProfileVariants, VariantLobe, VariantResult
from fecontact.judging.measures import MEASURES, MISFITS
from fecontact.judging.solved_load import Level, SolvedLoad
from fecontact.judging.uncertainty import MESH_RATIO
from fecontact.judging.verdict import judge
from fecontact.maps.files import write_map
from fecontact.maps.load_limits import LoadVerdict, choose_next_load, find_load_limit, list_usable_loads
from fecontact.maps.model import ApplicabilityMap, LoadInterval, LoadLimit, MapCell, MapPosition, build_cell_row
from fecontact.maps.picture import save_map_figure
from fecontact.maps.positions import solve_position
from fecontact.maps.report import write_map_report
from fecontact.maps.telling import build_cell_record, build_limit_record, build_map_record
from fecontact.maps.text_map import format_map_table
from fecontact.maps.verdict_views import CAUSE_LETTERS, CAUSES, build_verdict_view, format_limit
from fecontact.outputs.records.results import load_row
from fecontact.outputs.records.stored import (
    placement_from_record,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    write_arrays,
)
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.regression.tables import load_table
from fecontact.runs import map_positions, store
from fecontact.runs.identity import determine_origin, make_case_id
from fecontact.runs.load import load as load_results
from fecontact.runs.map_positions import (
    PositionWork,
    keep_position,
    name_position_folder,
    read_pictured_position,
    read_position,
)
from fecontact.runs.store import SOLUTION_FILE
from fecontact.runs.stored_map import judge_map, read_map_document
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import Clock, expect_on_half_space
from fecontact.solving.solve import LoadSweep, fit_stiffness

LOADS = (10e3, 50e3, 100e3, 150e3)
# by none of them a verdict changes between -2 and 1 mm: no limit is looked for
FEW_LOADS = LOADS[:3]
# at 0 mm one lies between both, and at -1 and 1 mm none
TWO_SIDES = LOADS[2:]
SHIFTS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
# coarse enough for a load to be made in milliseconds: its meshes are never made
ROUND = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
BULK_MM_PER_N = 2e-8


# --- loads whose fields are planted ---------------------------------------------------------------------------------


@cache
def placement_of(shift_mm):
    return place_case(replace(ROUND, lateral_shift_mm=shift_mm))


def planted_rung(hertz, nodes, deviation, status="converged"):
    """Hertz's pressure on nodes per semi-axis.

    Its peak and patch are changed so that Hertz deviates by a given fraction.
    """
    ellipse = replace(
        hertz,
        p0_MPa=hertz.p0_MPa / (1.0 + deviation),
        a_mm=hertz.a_mm * math.sqrt(1.0 + deviation),
        b_mm=hertz.b_mm * math.sqrt(1.0 + deviation),
    )
    count = math.ceil(1.4 * nodes)
    x = hertz.a_mm / nodes * np.arange(count + 1)
    s = hertz.b_mm / nodes * np.arange(-count, count + 1)
    grid = ContactGrid(x_mm=x, s_mm=s, half=True)
    pressure = average_pressure_over_cells(grid, ellipse)
    return Rung(
        grid=grid,
        pressure_MPa=pressure,
        gap_mm=np.where(pressure > 0.0, 0.0, 1e-3 * x[:, None] ** 2 + s**2),
        approach_mm=hertz.approach_mm + BULK_MM_PER_N * hertz.normal_force_N,
        normal_force_N=hertz.normal_force_N,
        status=status,
        iterations=17,
        compliance_calls=23,
        contact_residual=1e-7 / 3.0,
        penetration_residual=1e-8 / 3.0,
        load_balance=-1e-13 / 3.0,
    )


def planted_solved(case, deviation=0.0, status="converged", **settings):
    """Solved load with Hertz's pressure, changed by a relative deviation."""
    hertz = compute_hertz(case, placement_of(case.lateral_shift_mm))
    levels = tuple(
        Level(
            nodal=planted_rung(hertz, nodes, deviation, status),
            fe=planted_rung(hertz, 16, deviation, status),
            otherwise=planted_rung(hertz, 16, deviation, status),
            compliance_error=0.0,
            degrees_of_freedom={"rail": 900 * nodes, "wheel": 800 * nodes},
            elements={"rail": 300 * nodes, "wheel": 200 * nodes},
            enlarged=0,
            at_edge=False,
        )
        for nodes in (9, 6)
    )
    solved_load = SolvedLoad(
        case=case,
        levels=levels,
        half_space=planted_rung(hertz, 16, 0.0),
        quadratic=planted_rung(hertz, 16, 0.0),
        lines=None,
    )
    return replace(solved_load, **settings)


@cache
def real_load():
    """A load with all numbers read from fields."""
    return judge_load(planted_solved(ROUND), placement_of(0.0))


def point(load_N: float, deviation: float = 0.0, uncertainty: float = 0.001, status: str = "converged") -> JudgedLoad:
    """A load with a given deviation of its peak pressure, whatever its fields contain."""
    like = real_load()
    deviating = dict.fromkeys((*MEASURES, *MISFITS), 0.0) | {"p_max_MPa": deviation}
    # less than the least limit, that of separate patches
    uncertainties = {name: min(uncertainty, 1e-4) if name == "separate_load" else uncertainty for name in deviating}
    verdict = judge(deviating, uncertainties, Criteria())
    level = replace(like.level, fe=replace(like.fe, normal_force_N=load_N, status=status))
    approach = (load_N / like.hertz.stiffness_N_per_mm15) ** (2 / 3) + BULK_MM_PER_N * load_N
    if status != "converged":
        verdict = replace(verdict, answer="UNRESOLVED")
    return replace(
        like,
        status=status,
        solved=replace(like.solved, case=replace(like.case, load_N=load_N), levels=(level, like.solved.levels[1])),
        comparison=replace(
            like.comparison,
            deviation=deviating,
            fe=replace(like.comparison.fe, approach_mm=approach),
        ),
        judgements={
            HERTZ: replace(like.judgements[HERTZ], deviation=deviating, uncertainty=uncertainties, verdict=verdict)
        },
        verdict=replace(verdict, cause=None if verdict.answer == "HOLDS" else "second patch"),
    )


K_H = compute_hertz(ROUND, placement_of(0.0)).stiffness_N_per_mm15


def cell_of(judged_load):
    return MapCell(lateral_shift_mm=0.0, load_N=judged_load.load_N, status=judged_load.status, judged=judged_load)


# --- load limits ----------------------------------------------------------------------------------------------------

UNSURE = 0.0005
Answers = Callable[[float], float]


def cells_at(deviation: Answers, loads=LOADS, uncertainty=UNSURE):
    return [cell_of(point(load, deviation(load), uncertainty)) for load in loads]


def searched(deviation: Answers, loads=LOADS, uncertainty=UNSURE):
    """Limits of a deviation that depends on the load.

    The search runs until it asks for no more loads.
    """
    cells = cells_at(deviation, loads, uncertainty)
    tried = []
    while (next_load_N := choose_next_load(list_usable_loads(cells, tried), loads)) is not None:
        assert not find_load_limit(cells, tried).narrowed
        tried.append(point(next_load_N, deviation(next_load_N), uncertainty))
        assert len(tried) <= 14
    limit = find_load_limit(cells, tried)
    assert limit.narrowed
    assert limit.tried == tuple((judged_load.load_N, judged_load.verdict.answer) for judged_load in tried)
    assert_intervals_fit(limit, list_usable_loads(cells, tried))
    return limit


def assert_intervals_fit(limit, loads_tried):
    """Check that the intervals cover the range from the first load to the last.

    The verdict of every load fits its interval.
    """
    assert (limit.intervals[0].low_N, limit.intervals[-1].high_N) == (loads_tried[0].load_N, loads_tried[-1].load_N)
    for lower, upper in pairwise(limit.intervals):
        assert lower.high_N == upper.low_N
        assert lower.answer != upper.answer
        assert "UNRESOLVED" in (lower.answer, upper.answer)
    for load_tried in loads_tried:
        assert any(i.low_N <= load_tried.load_N <= i.high_N and i.answer == load_tried.answer for i in limit.intervals)


def answers(limit):
    """Verdicts of the intervals by their first letters."""
    return "".join(interval.answer[0] for interval in limit.intervals)


def assert_changes(limit, at_N, share=0.02):
    """Check that the open intervals contain these loads.

    Each interval is as narrow as a limit must be.
    """
    between = [(interval.low_N, interval.high_N) for interval in limit.intervals if interval.answer == "UNRESOLVED"]
    assert len(between) == len(at_N)
    for (low, high), at in zip(between, at_N, strict=True):
        assert low <= at <= high
        assert high - low <= share * high


def rising(at_N, power=1.0):
    return lambda load: 0.05 * (load / at_N) ** power


@pytest.mark.parametrize(
    ("law", "most_loads"),
    [
        # loads that were tried at most, the guard beyond the limit among them; by halves alone it would be 8
        (rising, 6),
        (lambda at_N: rising(at_N, 0.5), 6),
        (lambda at_N: rising(at_N, 3.0), 11),
        # no straight line says where a jump is
        (lambda at_N: lambda load: 0.1 if load > at_N else 0.0, 10),
    ],
    ids=["linear", "root", "cube", "jump"],
)
def test_a_limit_is_known_to_two_percent_with_few_loads(law, most_loads):
    counts = []
    for at_N in np.geomspace(10.5e3, 148e3, 23):
        limit = searched(law(at_N), uncertainty=0.0)
        assert answers(limit) == "HUF"
        assert_changes(limit, [at_N])
        assert limit.F_max_N == limit.intervals[0].high_N <= at_N
        counts.append(len(limit.tried))
    assert max(counts) <= most_loads


def test_the_search_goes_to_where_the_deviation_is_to_be_expected_at_its_limit():
    limit = searched(rising(66e3))
    # between 50 and 100 kN; just below, on the limit where it is open, just above, and the guard half way to 100 kN
    assert [load for load, _ in limit.tried] == pytest.approx([62.9e3, 65.9e3, 68.7e3, 82.9e3], rel=1e-3)
    assert [answer for _, answer in limit.tried] == ["HOLDS", "UNRESOLVED", "FAILS", "FAILS"]
    assert limit.reason is None
    assert limit.note is None


def test_a_band_of_unresolved_loads_is_known_to_five_percent_at_both_ends():
    # 10 % of the limit: open from 67.5 to 82.5 kN
    limit = searched(rising(75e3), uncertainty=0.005)
    assert answers(limit) == "HUF"
    assert 0.95 * 67.5e3 < limit.F_max_N <= 67.5e3
    assert 82.5e3 <= limit.intervals[2].low_N < 82.5e3 / 0.95


def test_all_changes_over_the_loads_are_found():
    """A second lobe that comes at 31 kN.

    From 117 kN on it is part of the patch.
    """
    loads = (20e3, 50e3, 100e3, 150e3)
    limit = searched(lambda load: 0.05 + 0.03 * math.sin(math.pi * (load - 31e3) / 86e3), loads, uncertainty=0.0)
    assert answers(limit) == "HUFUH"
    assert_changes(limit, [31e3, 117e3])
    assert limit.F_max_N == limit.intervals[0].high_N
    # also where nothing tells how far a change is away
    limit = searched(lambda load: 0.08 if 31e3 < load < 117e3 else 0.02, loads)
    assert answers(limit) == "HUFUH"
    assert_changes(limit, [31e3, 117e3])


def test_hertz_may_fail_at_small_loads_alone():
    limit = searched(lambda load: 0.05 * 66e3 / load, uncertainty=0.0)
    assert answers(limit) == "FUH"
    assert_changes(limit, [66e3])
    # there is no load up to which he holds
    assert limit.F_max_N is None


@pytest.mark.parametrize(("deviation", "answer"), [(0.0, "HOLDS"), (0.2, "FAILS"), (0.05, "UNRESOLVED")])
def test_one_verdict_at_all_loads_is_one_interval_and_no_load_is_tried(deviation, answer):
    limit = searched(lambda load: deviation)
    (interval,) = limit.intervals
    assert interval == LoadInterval(low_N=10e3, high_N=150e3, answer=answer)
    assert (limit.F_max_N, limit.tried, limit.reason) == (None, (), None)


def test_a_single_load_is_an_interval_of_its_own():
    limit = searched(rising(66e3), [100e3])
    assert limit.intervals == (LoadInterval(low_N=100e3, high_N=100e3, answer="FAILS"),)
    assert limit.F_max_N is None


JUMPS = (60e3, 72e3, 90e3)


def between_two_loads(load):
    """Fails from 60 to 72 kN and from 90 kN on."""
    if load < 54e3:
        return 0.04
    return 0.05 + 0.01 * (math.cos(math.pi * (load - 66e3) / 12e3) if load < 84e3 else (load - 90e3) / 6e3)


@pytest.mark.parametrize(
    "deviation",
    [between_two_loads, lambda load: 0.08 if 60e3 < load < 72e3 or load > 90e3 else 0.045 if load < 60e3 else 0.02],
    ids=["smooth", "jumps"],
)
def test_a_guard_finds_where_hertz_holds_again_between_two_loads_of_the_map(deviation):
    """A guard load in spite of failing loads next to the first limit."""
    limit = searched(deviation, uncertainty=0.0)
    assert answers(limit) == "HUFUHUF"
    assert_changes(limit, JUMPS, share=0.08)
    assert_changes(replace(limit, intervals=limit.intervals[:5]), JUMPS[:2])


@pytest.mark.parametrize(
    ("loads", "guard"),
    [
        # the limit between 60 and 61 kN; half way from what fails beside it to the map's next load
        ([50, 60, 61, 100], math.sqrt(61 * 100)),
        # loads that fail beside it, from the search for it, are no guard
        ([50, 60, 61, 62, 100], math.sqrt(62 * 100)),
        # a load about half way is
        ([50, 60, 61, 78, 100], None),
        ([50, 60, 61, 85, 100], None),
        # wherever most is open
        ([50, 60, 61, 95, 100], math.sqrt(61 * 95)),
        # the map's next load is near
        ([50, 93, 94, 100], None),
        # the limit is at a load of the map: its next one says what comes
        ([50, 99, 100, 150], None),
    ],
)
def test_guard_beyond_a_limit(loads, guard):
    loads_tried = [
        LoadVerdict(load_N=load, answer="HOLDS" if load <= 60 or load in (93, 99) else "FAILS", excess=math.nan)
        for load in loads
    ]
    next_load_kN = choose_next_load(loads_tried, [50, 100, 150])
    assert next_load_kN == (None if guard is None else pytest.approx(guard))


def test_what_lies_between_two_loads_with_one_verdict_is_taken_for_theirs():
    limit = searched(lambda load: 0.08 if 60e3 < load < 72e3 else 0.02)
    assert answers(limit) == "H"


@pytest.mark.parametrize(
    ("deviation", "uncertainty", "most_loads"),
    [
        (lambda load: 0.05 * load / 97e3, 0.001, 4),
        (lambda load: 0.05 * (load / 64e3) ** 1.5, 0.004, 5),
        (lambda load: 0.05 * (load / 33e3) ** 0.6, 0.002, 5),
        (lambda load: 0.01 + 0.04 * (load / 90e3) ** 3, 0.002, 4),
    ],
)
def test_the_ends_of_an_open_stretch_take_few_loads(deviation, uncertainty, most_loads):
    """Few loads for each end, by the interpolated measure.

    With bisection in place of it these take 6, 8, 9 and 5.
    """
    limit = searched(deviation, (20e3, 50e3, 80e3, 120e3), uncertainty)
    assert answers(limit) == "HUF"
    assert len(limit.tried) <= most_loads


def test_a_known_load_fails_or_holds_by_the_least_and_the_most_of_its_excess():
    for deviation, answer in ((0.045, "HOLDS"), (0.052, "UNRESOLVED"), (0.06, "FAILS")):
        load_tried = LoadVerdict.of(point(1e5, deviation, 0.004))
        assert load_tried.answer == answer
        assert (load_tried.least, load_tried.most) == pytest.approx((20 * deviation - 1.08, 20 * deviation - 0.92))
    nothing = replace(point(1e5, 0.06), judgements={HERTZ: replace(point(1e5, 0.06).judgements[HERTZ], uncertainty={})})
    assert math.isnan(LoadVerdict.of(nothing).least)
    assert LoadVerdict.of(nothing).excess == pytest.approx(0.2)


def test_only_loads_that_were_tried_count():
    """Two loads of the map that could not be solved.

    They do not make room for two more loads.
    """
    loads_tried = [LoadVerdict(load_N=10e3, answer="HOLDS", excess=-0.5)]
    loads_tried += [LoadVerdict(load_N=60e3 + load, answer="FAILS", excess=1.0) for load in range(14)]
    assert choose_next_load(loads_tried, LOADS) is None
    assert choose_next_load(loads_tried[:-1], LOADS) is not None


def test_a_number_that_is_none_says_nothing_of_where_a_limit_is():
    loads_tried = [
        LoadVerdict(load_N=10e3, answer="HOLDS", excess=-0.5),
        LoadVerdict(load_N=90e3, answer="UNRESOLVED", excess=math.nan),
    ]
    assert choose_next_load(loads_tried, (10e3, 90e3)) == pytest.approx(30e3, rel=0.01)


def test_a_load_that_may_not_be_used_ends_the_search_beside_it_alone():
    """A soft load on worn profiles between 50 and 53.8 kN.

    After it, nothing was tried between 20 and 50 kN.
    """
    loads_tried = [
        LoadVerdict(load_N=load_N, answer=answer, excess=excess)
        for load_N, answer, excess in (
            (20e3, "HOLDS", -0.5),
            (50e3, "UNRESOLVED", 0.1),
            (53.8e3, "FAILS", 1.0),
            (120e3, "FAILS", 3.0),
        )
    ]
    map_loads = (20e3, 50e3, 120e3)
    assert 20e3 < choose_next_load(loads_tried, map_loads, [52.3e3]) < 50e3
    # known well there, and 7 % apart where the load is that may not be used
    loads_tried.insert(1, LoadVerdict(load_N=48.5e3, answer="HOLDS", excess=-0.1))
    assert choose_next_load(loads_tried, map_loads, [52.3e3]) is None
    assert 50e3 < choose_next_load(loads_tried, map_loads) < 53.8e3


excesses = st.floats(-1.0, 5.0) | st.just(math.nan)


@given(
    map_loads=st.lists(st.floats(1e3, 3e5), min_size=1, max_size=8, unique=True).map(sorted),
    steps=st.lists(st.tuples(st.floats(1e3, 3e5), excesses), max_size=12).map(sorted),
    band=st.floats(0.0, 1.0),
)
def test_every_search_ends(map_loads, steps, band):
    """At most 14 loads for any verdicts.

    Each load lies between its neighbours, and the remaining interval is narrow.
    """

    def known_at(load):
        excess = next((value for low, value in reversed(steps) if low <= load), -1.0)
        answer = "FAILS" if excess > band else "HOLDS" if excess < -band else "UNRESOLVED"
        return LoadVerdict(load_N=load, answer=answer, excess=excess)

    loads_tried = [known_at(load) for load in map_loads]
    while (next_load_N := choose_next_load(loads_tried, map_loads)) is not None:
        place = bisect([load_tried.load_N for load_tried in loads_tried], next_load_N)
        assert 0 < place < len(loads_tried)
        assert loads_tried[place - 1].load_N < next_load_N < loads_tried[place].load_N
        loads_tried.insert(place, known_at(next_load_N))
        assert len(loads_tried) <= len(map_loads) + 14
    if len(loads_tried) < len(map_loads) + 14:
        for lower, upper in pairwise(loads_tried):
            if lower.answer != upper.answer:
                share = 0.05 if "UNRESOLVED" in (lower.answer, upper.answer) else 0.02
                assert upper.load_N - lower.load_N <= share * upper.load_N


# --- limits of what could not be solved, or was judged by others ------------------------------------------------------

TWO_LOADS = [cell_of(point(1e4)), cell_of(point(9e4, 0.2))]
OPEN_BETWEEN = (
    LoadInterval(low_N=1e4, high_N=1e4, answer="HOLDS"),
    LoadInterval(low_N=1e4, high_N=9e4, answer="UNRESOLVED"),
    LoadInterval(low_N=9e4, high_N=9e4, answer="FAILS"),
)


def test_a_load_that_could_not_be_solved_ends_the_search_and_is_named():
    stopped = MapCell(lateral_shift_mm=0.0, load_N=2.9e4, status="failed: no memory")
    limit = find_load_limit(TWO_LOADS, stopped=stopped)
    assert limit.intervals == OPEN_BETWEEN
    assert (limit.F_max_N, limit.tried) == (1e4, ())
    assert limit.note == "29 kN: failed: no memory"
    # the next attempt may go further
    assert not limit.narrowed


def test_a_load_that_did_not_converge_ends_the_search_for_good():
    open_ = point(2.9e4, 0.2, status="not converged")
    limit = find_load_limit(TWO_LOADS, [open_])
    assert limit.intervals == OPEN_BETWEEN
    assert limit.tried == ((2.9e4, "UNRESOLVED"),)
    assert limit.note == "29 kN: not converged"
    # another attempt would end there again
    assert limit.narrowed


def test_loads_of_the_map_that_cannot_be_used_are_not_known():
    lost = MapCell(lateral_shift_mm=0.0, load_N=150e3, status="failed: no memory")
    open_ = cell_of(point(10e3, status="not converged"))
    cells = [open_, *cells_at(rising(66e3), LOADS[1:3]), lost]
    assert [load_tried.load_N for load_tried in list_usable_loads(cells)] == [50e3, 100e3]
    limit = find_load_limit(cells)
    assert (limit.intervals[0].low_N, limit.intervals[-1].high_N) == (50e3, 100e3)
    assert not limit.narrowed
    assert (find_load_limit([lost]).reason, find_load_limit([lost]).intervals) == ("failed: no memory", ())
    assert find_load_limit([open_, lost]).reason == "no load could be solved"
    assert find_load_limit([lost]).F_max_N is None


def test_a_known_load_is_as_far_beyond_its_limit_as_its_worst_measure():
    judged_load = point(1e5, 0.06)
    assert LoadVerdict.of(judged_load).excess == pytest.approx(0.2)
    field = judged_load.judgements[HERTZ]
    gauge = replace(field, deviation=field.deviation | {"centre_over_b": -0.3})
    either = replace(judged_load, judgements={HERTZ_GAUGE: gauge, HERTZ: field})
    assert LoadVerdict.of(either).excess == pytest.approx(1.0)
    # the verdict of another theory does not count
    two_theories = replace(judged_load, judgements={HERTZ: field, MULTI_HERTZ: gauge})
    assert LoadVerdict.of(two_theories).excess == pytest.approx(0.2)


# --- positions ------------------------------------------------------------------------------------------------------


class FakeSweep:
    """A sweep with deviations by load and shift.

    One position cannot be placed, one load cannot be solved, and one cannot be used.
    """

    open = 0
    solved: ClassVar[list[float]] = []
    steps: ClassVar[list[str]] = []
    short_of_memory: ClassVar[set[str]] = set()

    def __init__(self, case, loads_N):
        assert list(loads_N) == sorted(loads_N)
        if case.lateral_shift_mm > 3.5:
            raise InputError("the wheel is off the rail")
        self._case, self._meshed_N = case, None
        self.shift = case.lateral_shift_mm
        self.placement = placement_of(self.shift)
        self._hungry("position")
        FakeSweep.open += 1

    def _hungry(self, what):
        if self.shift == 0.0 and what in FakeSweep.short_of_memory:
            raise MemoryShortageError("the factor needs about 4.5 GB of memory, 1.2 GB are available")

    def solve(self, load_N, *, refine=True):
        # a search beside a limit is not worth finer meshes
        assert refine == (load_N in LOADS)
        FakeSweep.solved.append(self.shift)
        if not self.is_ready_for(load_N):
            self._meshed_N = load_N
            self._step(load_N, "mesh", refine)
        self._step(load_N, "contact", refine)
        if self.shift == 3.0 and load_N > 140e3:
            raise InputError("the contact reaches the end")
        if self.shift == 2.0 and 60e3 < load_N < 65e3:
            raise InputError("a limit that cannot be solved")
        self._hungry("load" if load_N in LOADS else "limit")
        status = "not converged" if self.shift == -2.0 and load_N < 20e3 else "converged"
        short = self.shift == 0.0 and "refinement" in FakeSweep.short_of_memory
        # as the sweep that it stands for
        theories = tuple(THEORIES) if refine else (HERTZ,)
        return self._judged(replace(self._case, load_N=load_N), status, short, theories)

    def _step(self, load_N, step, refine):
        FakeSweep.steps.append(f"{load_N / 1e3:g} kN: {step}" if refine else f"limit, {load_N / 1e3:.1f} kN: {step}")

    def is_ready_for(self, load_N):
        """Meshes serve loads down to a quarter of the load that they were made for."""
        return self._meshed_N is not None and 0.25 * self._meshed_N <= load_N <= self._meshed_N

    @staticmethod
    @cache
    def _judged(case, status, short, theories):
        solved_load = planted_solved(
            case,
            0.02 * (2.0 + case.lateral_shift_mm) * case.load_N / 100e3,
            status,
            short_of_memory=short,
            limits=("not refined: 4.5 GB of memory",) if short else (),
        )
        return judge_load(solved_load, placement_of(case.lateral_shift_mm), theories)

    def close(self):
        FakeSweep.open -= 1


JUDGED = {}
SWEEPING = threading.Lock()


def judged_once(solved_load, placement, theories, stored_own):
    """Judge equal loads only once.

    Every test reads positions, at 0.1 s per load. Equal means equal to the last bit.
    """
    values = pickle.dumps((solved_load, format_json(placement_record(placement)), tuple(theories), stored_own))
    key = hashlib.sha256(values).digest()
    if key not in JUDGED:
        JUDGED[key] = judge_load(solved_load, placement, theories, stored_own)
    return JUDGED[key]


def no_figure(applicability_map, path, **_):
    return Path(path)


@pytest.fixture(autouse=True)
def _reset_sweep(request, monkeypatch):
    """Start without solved loads, and without pictures unless a test looks at them.

    A picture takes a second.
    """
    monkeypatch.setattr(FakeSweep, "solved", [])
    monkeypatch.setattr(FakeSweep, "steps", [])
    monkeypatch.setattr(FakeSweep, "short_of_memory", set())
    monkeypatch.setattr(FakeSweep, "open", 0)
    if "png" not in request.node.name:
        monkeypatch.setattr("fecontact.maps.files.save_map_figure", no_figure)
    monkeypatch.setattr("fecontact.runs.map_run.write_result_report", no_figure)
    monkeypatch.setattr("fecontact.runs.stored_map.write_result_report", no_figure)
    monkeypatch.setattr(store, "judge_load", judged_once)


def fake_position(case, loads_N, tell=None, sweep=FakeSweep):
    """A position solved by another sweep.

    A single thread runs at a time, because the whole module shares the sweep.
    """
    with SWEEPING, pytest.MonkeyPatch.context() as patch:
        patch.setattr("fecontact.maps.positions.LoadSweep", sweep)
        return solve_position(case, loads_N)


def fresh_map(shifts=SHIFTS, loads=LOADS, case=ROUND):
    """A map that was never stored."""
    positions = tuple(fake_position(replace(case, lateral_shift_mm=shift), loads) for shift in shifts)
    return ApplicabilityMap(case=case, loads_N=tuple(loads), positions=positions)


def inline_workers(workers=1):
    return Crew(open=ThreadPoolExecutor, workers=workers, together=workers)


def fake_run(out, shifts=SHIFTS, case=ROUND, loads=LOADS, *, crew=None, progress=None, **settings):
    """Run a map in this process."""
    return map_by(
        case,
        shifts,
        loads,
        out,
        settings=RunSettings(**settings),
        progress=progress,
        crew=crew or inline_workers(),
    )


@pytest.fixture
def run(monkeypatch):
    """Make a map as usual, except for the finite elements."""
    monkeypatch.setattr(map_positions, "solve_position", fake_position)
    return fake_run


def stored_map(out, shifts=SHIFTS, loads=LOADS, progress=None):
    """Folder of a map, and the map."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_positions, "solve_position", fake_position)
        patch.setattr("fecontact.maps.files.save_map_figure", no_figure)
        patch.setattr("fecontact.runs.map_run.write_result_report", no_figure)
        patch.setattr(store, "judge_load", judged_once)
        return out, fake_run(out, shifts, loads=loads, progress=progress).made


@dataclass
class Watched:
    """A whole map, and the progress reports during its run."""

    out: Path
    progress_reports: list
    applicability_map: ApplicabilityMap | None = None
    left_open: int = 0

    def __call__(self, finished, count, what):
        self.progress_reports.append((finished, count, what.partition(";")[0]))


@pytest.fixture(scope="module")
def watched(tmp_path_factory):
    """A whole map with its run.

    Shifts that are asked for twice, or in another order, are solved once.
    """
    watch = Watched(tmp_path_factory.mktemp("map"), [])
    FakeSweep.open = 0
    _, watch.applicability_map = stored_map(watch.out, (3.0, *SHIFTS, 0.0), progress=watch)
    watch.left_open = FakeSweep.open
    return watch


@pytest.fixture(scope="module")
def whole_map(watched):
    """A whole map for tests that only read it."""
    return watched.out, watched.applicability_map


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """A map of two positions, to be copied before it is damaged."""
    return stored_map(tmp_path_factory.mktemp("two"), [0.0, 1.0], FEW_LOADS)


# a load that does not converge, limits that are found, a search that stops, and a load that fails
UNEVEN = (-2.0, 0.0, 2.0, 3.0, 4.0)


@pytest.fixture(scope="module")
def uneven(tmp_path_factory):
    return stored_map(tmp_path_factory.mktemp("uneven"), UNEVEN)


@pytest.fixture(scope="module")
def made_one(tmp_path_factory):
    return stored_map(tmp_path_factory.mktemp("one"), [0.0])


@pytest.fixture
def one_position(made_one, tmp_path):
    """A folder with a map of a single position that has a limit.

    Tests change this folder.
    """
    return shutil.copytree(made_one[0], tmp_path, dirs_exist_ok=True)


@pytest.fixture(scope="module")
def fresh():
    """The map of the fixture `whole_map`, never stored."""
    return fresh_map()


def cells_of(applicability_map):
    return [build_cell_record(cell) for cell in applicability_map.cells]


def open_loads(position):
    """Loads (kN) of a position whose verdicts are open."""
    cells = {cell.load_N / 1e3 for cell in position.cells if cell.verdict == "UNRESOLVED"}
    return cells | {load_N / 1e3 for load_N, answer in position.limit.tried if answer == "UNRESOLVED"}


def plain(applicability_map):
    """All of a map as JSON.

    Missing numbers compare as equal, as numbers do.
    """
    limits = [build_limit_record(position.lateral_shift_mm, position.limit) for position in applicability_map.positions]
    return json.loads(format_json({"cells": cells_of(applicability_map), "limits": limits}))


def test_a_position_has_all_loads_and_its_limit():
    position = fake_position(replace(ROUND, lateral_shift_mm=0.0), LOADS)
    heard = list(FakeSweep.steps)
    assert [cell.load_N for cell in position.cells] == list(LOADS)
    assert all(cell.lateral_shift_mm == 0.0 for cell in position.cells)
    # the largest first, whose meshes serve others; the limits among these before they make room for new ones
    assert [text for text in heard if not text.startswith("limit")] == [
        *("150 kN: mesh", "150 kN: contact", "100 kN: contact", "50 kN: contact"),
        *("10 kN: mesh", "10 kN: contact"),
    ]
    assert heard[4:-2] == [f"limit, {load / 1e3:.1f} kN: contact" for load, _ in position.limit.tried]
    assert heard[4] == "limit, 122.7 kN: contact"
    # 4 % at 100 kN, and 0.4 % uncertainty: open from 115 to 133 kN
    assert [interval.answer for interval in position.limit.intervals] == ["HOLDS", "UNRESOLVED", "FAILS"]
    assert position.limit.F_max_N == pytest.approx(115e3, rel=0.05)
    assert position.limit.narrowed
    assert [judged_load.load_N for judged_load in position.tried] == [load for load, _ in position.limit.tried]
    assert position.converged
    assert not position.short_of_memory
    assert FakeSweep.open == 0


def test_a_position_tells_how_many_of_its_loads_are_done(monkeypatch):
    """Progress of the loads of the map and of the loads for its limits.

    A report before each load shows that the position is still running.
    """
    monkeypatch.setattr("fecontact.maps.positions.LoadSweep", FakeSweep)
    reports = []
    with SWEEPING:
        position = solve_position(
            replace(ROUND, lateral_shift_mm=0.0), LOADS, lambda share, words: reports.append((words, share))
        )
    assert len(reports) == len(LOADS) + len(position.tried)
    assert reports[:3] == [("0 of 4 loads", 0.0), ("1 of 4 loads", 0.2), ("2 of 4 loads", 0.4)]
    searched = len(position.tried)
    assert reports[-1] == (f"3 of 4 loads, {searched} more for limits", (3 + searched) / (5 + searched))


def test_a_position_that_cannot_be_solved_says_why():
    position = fake_position(replace(ROUND, lateral_shift_mm=4.0), LOADS)
    assert {cell.status for cell in position.cells} == {"failed: the wheel is off the rail"}
    assert position.limit.reason == "failed: the wheel is off the rail"
    assert {cell.verdict for cell in position.cells} == {"failed"}
    assert not position.converged
    position = fake_position(replace(ROUND, lateral_shift_mm=3.0), LOADS)
    assert [cell.status for cell in position.cells] == ["converged"] * 3 + ["failed: the contact reaches the end"]
    # where Hertz holds among the loads that could be solved
    assert position.limit.intervals[-1].high_N == 100e3
    assert position.limit.F_max_N == pytest.approx(46e3, rel=0.05)
    assert FakeSweep.open == 0


class OneMeshALoad(FakeSweep):
    """A sweep with separate meshes for every load."""

    def is_ready_for(self, load_N):
        return False


def test_the_search_follows_each_set_of_meshes_and_goes_on_between_them():
    position = fake_position(ROUND, LOADS, sweep=OneMeshALoad)
    what = [text.partition(" kN")[0] for text in FakeSweep.steps if text.endswith("contact")]
    # a limit between 100 and 150 kN is looked for as soon as both are known
    assert what[:2] == ["150", "100"]
    assert what[-2:] == ["50", "10"]
    assert all(text.startswith("limit") for text in what[2:-2])
    assert position.limit == fake_position(ROUND, LOADS).limit


@pytest.mark.parametrize(("fails", "narrowed"), [(InputError("no memory"), False), (None, True)])
def test_a_load_that_cannot_be_used_ends_the_search_of_its_position(fails, narrowed):
    class Sweep(FakeSweep):
        def solve(self, load_N, *, refine=True):
            if load_N not in LOADS:
                FakeSweep.solved.append(load_N)
                if fails:
                    raise fails
                return self._judged(replace(self._case, load_N=load_N), "not converged", False, (HERTZ,))
            return super().solve(load_N, refine=refine)

    FakeSweep.solved = []
    position = fake_position(ROUND, LOADS, sweep=Sweep)
    assert len([load for load in FakeSweep.solved if load > 1e3]) == 1
    (lost,) = [load for load in FakeSweep.solved if load > 1e3]
    assert position.converged
    assert position.limit.note == f"{lost / 1e3:.1f} kN: " + ("failed: no memory" if fails else "not converged")
    assert position.limit.narrowed is narrowed
    assert (position.stopped is None) is narrowed
    open_ = position.limit.intervals[1]
    assert (open_.low_N, open_.high_N, open_.answer) == (100e3, 150e3, "UNRESOLVED")


@pytest.mark.parametrize("pictured", [False, True])
def test_what_a_worker_hands_on_is_what_its_folder_says(run, tmp_path, pictured):
    work = PositionWork(case=ROUND, name=make_case_id(ROUND, FEW_LOADS), loads_N=FEW_LOADS, pictured=pictured)
    handed = work(tmp_path, None).value
    position_read = read_pictured_position(
        tmp_path, criteria=ROUND.criteria, creep=ROUND.creep, dear=False, pictured=pictured
    )
    maps = [
        ApplicabilityMap(case=ROUND, loads_N=FEW_LOADS, positions=(map_position.position,))
        for map_position in (handed, position_read)
    ]
    assert plain(maps[0]) == plain(maps[1])
    assert handed.pictures == position_read.pictures
    assert set(handed.pictures) == (set(FEW_LOADS) if pictured else set())
    # all other values of a row are there
    assert all("overlap" in vars(cell.judged.comparison) for map_position in maps for cell in map_position.cells)


@pytest.mark.slow
def test_numbers_of_a_map_come_from_its_workers_alone(tmp_path, monkeypatch):
    """Threads of the workers are pinned.

    The last digits do not depend on the threads of the caller.
    """

    def evaluated(*arguments, **keywords):
        pytest.fail("evaluated by the process that only writes")

    monkeypatch.setattr(map_positions, "read_stored", evaluated)
    for name in ("theory.judge_theory", "judge.load_offers", "judge.judge_lobes"):
        monkeypatch.setattr(f"fecontact.judging.{name}", evaluated)
    settings = RunSettings(workers=1)
    map_made = map_by(ROUND, [0.0], [50e3], tmp_path, settings=settings, work=PlantedWork).made
    again = map_by(ROUND, [0.0], [50e3], tmp_path, settings=settings, work=PlantedWork)
    assert len(again.reused) == 1
    assert plain(again.made) == plain(map_made)
    monkeypatch.undo()
    fresh = read_position(next((tmp_path / "positions").iterdir()), criteria=ROUND.criteria)
    (cell,) = fresh.cells
    assert float(rows_of(tmp_path / "map.csv")[0]["fe_p_max_MPa"]) == cell.judged.comparison.fe.p_max_MPa


@pytest.mark.parametrize("what", ["position", "load", "limit", "refinement"])
def test_a_position_short_of_memory_anywhere_knows_it(what):
    FakeSweep.short_of_memory.add(what)
    assert fake_position(ROUND, LOADS).short_of_memory
    assert not fake_position(replace(ROUND, lateral_shift_mm=4.0), LOADS).short_of_memory


# --- maps as they are made ------------------------------------------------------------------------------------------


def test_map_has_a_cell_for_every_position_and_load(watched):
    map_made = watched.applicability_map
    assert map_made.lateral_shifts_mm == SHIFTS
    assert [(c.lateral_shift_mm, c.load_N) for c in map_made.cells] == [(s, f) for s in SHIFTS for f in LOADS]
    names = [make_case_id(replace(ROUND, lateral_shift_mm=shift), LOADS) for shift in SHIFTS]
    # from the gauge corner on, where a position takes longest
    # each may be reported several times in a long run
    reports = [(k, 7, f"solving {shift:+z.2f} mm") for k, shift in enumerate(SHIFTS[::-1])]
    assert [*dict.fromkeys(watched.progress_reports)] == reports
    assert sorted(path.name for path in (watched.out / "positions").iterdir()) == sorted(names)
    assert watched.left_open == 0
    assert not map_made.all_solved


def test_map_says_what_could_not_be_solved(whole_map):
    _, map_kept = whole_map
    assert {c.status for c in map_kept.cells if c.lateral_shift_mm == 4.0} == {"failed: the wheel is off the rail"}
    assert map_kept.limits[-1].reason == "failed: the wheel is off the rail"
    assert [c.status for c in map_kept.cells if c.lateral_shift_mm == 3.0][-1] == "failed: the contact reaches the end"
    assert map_kept.cells[0].status == "not converged"
    assert map_kept.cells[0].verdict == "UNRESOLVED"
    # 4 % at 100 kN, and 0.4 % uncertainty: the largest load tried below 115 kN, or little above
    assert map_kept.limits[2].F_max_N == pytest.approx(115e3, rel=0.05)


def test_what_was_stored_is_what_was_solved_to_the_last_bit(whole_map, fresh):
    """Verdicts, limits with their notes, and all numbers are equal.

    They are judged from the stored values.
    """
    _, map_kept = whole_map
    assert plain(map_kept) == plain(fresh)
    # a limit that ended early says why, and not that nothing was solved there
    assert map_kept.limits[4].note == "64.23 kN: failed: a limit that cannot be solved"
    assert [judged_load.load_N for judged_load in map_kept.positions[4].tried] == pytest.approx(
        [59.6e3, 57.5e3, 65.6e3], rel=2e-3
    )
    assert not map_kept.limits[4].narrowed


def test_map_needs_positions_and_loads(run, tmp_path):
    for shifts, loads in (([], LOADS), ([0.0], [])):
        with pytest.raises(InputError, match="at least one"):
            run(tmp_path, shifts, loads=loads)
    # a value that no case can have is said before anything is solved
    with pytest.raises(InputError, match="lateral shift is 99"):
        run(tmp_path, [0.0, 99.0])
    assert FakeSweep.solved == []


@pytest.mark.parametrize(("time_share", "positions_in_file"), [(1e9, (1, 2)), (1e-9, (1, 1))])
def test_files_are_written_after_each_position_that_took_much_longer(
    time_share, positions_in_file, run, tmp_path, monkeypatch
):
    monkeypatch.setattr("fecontact.runs.map_run._TABLE_TIME_FRACTION", time_share)
    shifts_in_file, pictures = {}, []

    def look(finished, count, what):
        # a position that takes longer than usual is reported several times
        if finished:
            shifts_in_file[finished] = json.loads((tmp_path / "map.json").read_text("utf-8"))["lateral_shifts_mm"]

    def write(*arguments, drawn, **keywords):
        pictures.append(drawn)
        write_map(*arguments, drawn=False, **keywords)

    monkeypatch.setattr("fecontact.runs.map_run.write_map", write)
    shifts = [-1.0, 0.0, 1.0]
    run(tmp_path, shifts, loads=FEW_LOADS, progress=look)
    # from the gauge corner on, where a position takes longest
    assert list(shifts_in_file.values()) == [shifts[-k:] for k in positions_in_file]
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["lateral_shifts_mm"] == shifts
    # pictures take longer: a map of seconds has them at its end
    assert pictures[-1]
    assert not any(pictures[:-1])


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_map_files(whole_map):
    out, map_kept = whole_map
    rows = rows_of(out / "map.csv")
    assert len(rows) == len(map_kept.cells)
    assert rows[-1]["verdict_answer"] == "failed"
    assert rows[-1]["hertz_deviation_p_max_percent"] == ""
    assert rows[-1]["fe_p_max_MPa"] == ""
    assert float(rows[9]["hertz_deviation_p_max_percent"]) == pytest.approx(2.0, abs=0.05)
    assert (rows[-1]["lateral_shift_mm"], rows[-1]["load_kN"]) == ("4.0", "150.0")
    record = json.loads((out / "map.json").read_text("utf-8"))
    assert record["criteria"] == json.loads(format_json(Criteria().record))
    assert len(record["cells"]) == len(rows)
    assert record["limits"][2]["F_max_N"] == map_kept.limits[2].F_max_N
    limit, (first, *_) = record["limits"][2], map_kept.limits[2].tried
    assert limit["tried"][0] == {"load_N": first[0], "verdict": first[1]}
    assert [(interval["answer"], interval["high_N"]) for interval in limit["intervals"]] == [
        (interval.answer, interval.high_N) for interval in map_kept.limits[2].intervals
    ]
    assert (limit["reason"], record["limits"][6]["reason"]) == (None, "failed: the wheel is off the rail")
    assert record["limits"][4]["note"] == "64.23 kN: failed: a limit that cannot be solved"
    assert record["limits"][6]["intervals"] == []
    assert record["versions"]["fecontact"]
    assert "load_N" not in record["case"]
    assert "lateral_shift_mm" not in record["case"]
    made_by = determine_origin(ROUND)
    assert record["provenance"]["made_by"] == dict(made_by.solved_by)
    assert record["provenance"]["evaluated_by"] == dict(made_by.evaluated_by)
    assert record["provenance"]["input_files"] == {}
    assert list(record["provenance"]["positions"].values()) == list(SHIFTS)


def test_a_map_is_drawn_as_png_while_it_is_made(run, tmp_path):
    run(tmp_path, [0.0], loads=LOADS[:1])
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_columns_of_a_map_are_those_of_a_case(whole_map):
    out, map_kept = whole_map
    rows = rows_of(out / "map.csv")
    load_columns = load_row(real_load(), placement_of(0.0))
    assert list(rows[0]) == ["lateral_shift_mm", "load_kN", "status", "verdict_answer", *(
        name for name in load_columns if name not in ("lateral_shift_mm", "load_kN", "status", "verdict_answer")
    )]  # fmt: skip
    assert not set(MEASURED_COLUMNS) & set(rows[0])
    row, cell = rows[11], map_kept.cells[11]
    assert (row["verdict_answer"], row["verdict_cause"], row["verdict_measure"]) == (
        "FAILS",
        "finite bodies",
        "p_max_MPa",
    )
    assert float(row["fe_p_max_MPa"]) == cell.judged.comparison.fe.p_max_MPa
    assert float(row["hertz_uncertainty_area_percent"]) == 1e2 * cell.judged.uncertainty["area_mm2"]
    assert row["rail"] == "circle:300"
    # what is not converged has its numbers, and a status that says not to use them
    assert rows[0]["status"] == "not converged"
    assert float(rows[0]["fe_p_max_MPa"]) > 0.0


def test_stiffness_of_two_loads_is_no_file_and_an_older_one_goes(run, tmp_path):
    (tmp_path / "stiffness.csv").write_text("of another map")
    run(tmp_path, SHIFTS[:1], loads=LOADS[:2])
    assert (tmp_path / "map.csv").is_file()
    assert not (tmp_path / "stiffness.csv").exists()


def test_stiffness_of_each_position_over_its_loads(whole_map):
    out, _ = whole_map
    rows = rows_of(out / "stiffness.csv")
    # one position cannot be placed; of two one load each cannot be used
    assert len(rows) == 4 * len(LOADS) + 2 * (len(LOADS) - 1)
    for row in rows:
        force = 1e3 * float(row["normal_force_kN"])
        # the approach that the points were made with: F^(2/3) / K_H^(2/3) + 2e-8 F
        assert float(row["c1_mm_per_N23"]) == pytest.approx(K_H ** (-2 / 3), rel=1e-9)
        assert float(row["c2_mm_per_N"]) == pytest.approx(2e-8, rel=1e-6)
        slope = 2.0 / 3.0 * K_H ** (-2 / 3) * force ** (-1 / 3) + 2e-8
        assert float(row["tangent_with_bulk_kN_per_mm"]) == pytest.approx(1e-3 / slope, rel=1e-8)
        assert float(row["tangent_deviation_percent"]) == pytest.approx(0.0, abs=1e-6)
    assert json.loads((out / "map.json").read_text("utf-8"))["stiffness"][0]["load_kN"] == 50.0


def test_map_of_one_cell_is_drawn_as_png(tmp_path):
    one_cell_map = fresh_map([0.0], [100e3])
    assert save_map_figure(build_verdict_view(one_cell_map), tmp_path / "one.png").stat().st_size > 0
    (limit,) = build_map_record(one_cell_map)["limits"]
    assert limit["intervals"] == [{"low_N": 100e3, "high_N": 100e3, "answer": "HOLDS"}]
    assert (limit["F_max_N"], limit["reason"]) == (None, None)
    row = build_cell_row(one_cell_map.cells[0], one_cell_map.positions[0].placement)
    assert row["verdict_answer"] == "HOLDS"
    assert row["contact_points"] == 1


def test_map_table_has_a_line_for_each_position(fresh):
    lines = format_map_table(build_verdict_view(fresh)).splitlines()
    assert len(lines) == 11
    assert lines[2].endswith("+   +3.0   holds 10 to 150 kN")
    # where the loads come to lie that were tried hangs on the last digit of the stated uncertainty
    (limit,) = (position_read.limit for position_read in fresh.positions if position_read.lateral_shift_mm == 0.0)
    low, high = (f"{position_read.high_N / 1e3:.4g}" for position_read in limit.intervals[:2])
    assert lines[3].endswith(f"xp  +6.0   holds 10 to {low}, unresolved {low} to {high}, fails {high} to 150 kN")
    (limit,) = (position_read.limit for position_read in fresh.positions if position_read.lateral_shift_mm == 2.0)
    low, high = (f"{position_read.high_N / 1e3:.4g}" for position_read in limit.intervals[:2])
    assert lines[5].endswith(f"fails {high} to 150 kN (64.23 kN: failed: a limit that cannot be solved)")
    assert lines[7].split() == ["+4.00", *"!!!!", "failed:", "the", "wheel", "is", "off", "the", "rail"]
    # what did not converge is open, and has no number to be relied on: no measure decided that
    assert lines[1].split()[1:4] == ["?", "+", "+0.0"]
    assert lines[9].startswith("decided by p p_max, A area, a a, b b, c centre, v valley, s separate")
    assert lines[10] == "left wheel, roll fixed at 0 mrad (profiles given by their radii have no wheelset)"
    assert "nan" not in "".join(lines)


@pytest.mark.parametrize("width", [120, 80, 60])
def test_map_table_fits_a_terminal(fresh, width):
    wide = format_map_table(build_verdict_view(fresh))
    lines = format_map_table(build_verdict_view(fresh), width=width).splitlines()
    assert max(map(len, lines)) <= width
    # every cell and every limit is still there, once
    cells = [
        cell_text
        for line in wide.splitlines()[1:8]
        for cell_text in line.split("  ")
        if cell_text.strip()[:1] in "+x?!"
    ]
    assert cells
    limits = "".join(lines[lines.index("load limits:") + 1 :]).replace(" ", "")
    for position in fresh.positions:
        assert (
            f"{position.lateral_shift_mm:+z.2f}{format_limit(position.limit, open_loads(position))}".replace(" ", "")
            in limits
        )
    rows = [line for line in lines[: lines.index("load limits:")] if not line.startswith("shift mm")]
    marks = [mark for line in rows for mark in line[8:] if mark in "x?!"]
    assert len(marks) == sum(cell.verdict != "HOLDS" for cell in fresh.cells)


@pytest.mark.parametrize(
    ("measure", "letter"),
    [("p_max_MPa", "p"), ("area_mm2", "A"), ("centre_over_b", "c"), ("valley", "v"), ("misplaced_load", "m")],
)
@pytest.mark.parametrize(("answer", "mark"), [("FAILS", "x"), ("UNRESOLVED", "?")])
def test_the_table_shows_the_measure_that_decided(measure, letter, answer, mark):
    like = point(100e3)
    cell = cell_of(replace(like, verdict=replace(like.verdict, answer=answer, measure=measure)))
    position = MapPosition(lateral_shift_mm=0.0, cells=(cell,), limit=find_load_limit([cell]))
    line = format_map_table(
        build_verdict_view(ApplicabilityMap(case=ROUND, loads_N=(100e3,), positions=(position,)))
    ).splitlines()[1]
    word = "fails" if answer == "FAILS" else "unresolved"
    assert line == f"   +0.00  {mark}{letter}  +0.0   {word} 100 kN"


@pytest.mark.parametrize(
    ("limit", "text"),
    [
        (
            LoadLimit(intervals=tuple(
                LoadInterval(low_N=1e3 * low, high_N=1e3 * high, answer=answer)
                for low, high, answer in [
                    *((20, 30.6, "HOLDS"), (30.6, 31.16, "UNRESOLVED"), (31.16, 116.2, "FAILS")),
                    *((116.2, 118.3, "UNRESOLVED"), (118.3, 118.3, "HOLDS")),
                ]
            )),
            "holds 20 to 30.6, unresolved 30.6 to 31.16, fails 31.16 to 116.2, holds 118.3 kN",
        ),
        (LoadLimit(intervals=OPEN_BETWEEN[:1], note="29.0 kN: not converged"), "holds 10 kN (29.0 kN: not converged)"),
        (LoadLimit(reason="no load could be solved"), "no load could be solved"),
    ],
)  # fmt: skip
def test_a_limit_in_words(limit, text):
    # the load at 30.8 kN is open, and none between 116.2 and 118.3 kN was solved
    assert format_limit(limit, {30.8}) == text


def test_the_title_of_the_picture_says_by_what_hertz_is_judged_in_its_png(tmp_path, monkeypatch):
    titles, conditions = [], []

    def look(figure, path):
        titles.append(figure.axes[0].get_title())
        conditions.append(" ".join(figure.legends[0].get_title().get_text().split()))
        return path

    monkeypatch.setattr("fecontact.maps.picture.save_figure", look)
    one_cell_map = fresh_map([0.0], [100e3])
    for criteria in (Criteria(), Criteria(p_max=0.03, area=0.2, judged_by=("strength", "area"))):
        save_map_figure(
            build_verdict_view(replace(one_cell_map, case=replace(one_cell_map.case, criteria=criteria))), tmp_path
        )
    assert titles == ["rail circle:300, wheel cylinder:460: where Hertz holds"] * 2
    roll = "roll fixed at 0 mrad (profiles given by their radii have no wheelset)"
    assert conditions == [
        f"{roll}; within 5 % p_max; 10 % area, a, b, valley, misplaced; 0.15 b centre; 0.1 % separate",
        f"{roll}; within 3 % p_max; 20 % area",
    ]


@pytest.mark.parametrize(("cause", "letter"), CAUSE_LETTERS.items())
def test_every_cause_has_its_letter_in_the_png(cause, letter, tmp_path, monkeypatch):
    figures = []

    def look(figure, path):
        figures.extend(text.get_text() for text in figure.axes[0].texts)
        figures.extend(text.get_text() for text in figure.legends[0].get_texts())
        return path

    monkeypatch.setattr("fecontact.maps.picture.save_figure", look)
    like = point(100e3, 0.2)
    cell = cell_of(replace(like, verdict=replace(like.verdict, cause=cause)))
    position = MapPosition(lateral_shift_mm=0.0, cells=(cell,), limit=find_load_limit([cell]))
    save_map_figure(build_verdict_view(ApplicabilityMap(case=ROUND, loads_N=(100e3,), positions=(position,))), tmp_path)
    assert [text for text in figures if text.endswith(f" {letter}")]
    assert CAUSES[cause][1] in figures


@pytest.mark.parametrize(("holds", "colour"), [(9, "#a3cc95"), (0, "#d55e00"), (6, "#f0e442")])
def test_an_open_cell_has_the_colour_of_the_share_of_lines_on_which_hertz_holds(holds, colour, tmp_path, monkeypatch):
    from matplotlib.colors import to_rgba

    colours = {}

    def look(figure, path):
        colours.update({text.get_text(): text.get_bbox_patch() for text in figure.axes[0].texts})
        colours.update(dict.fromkeys(text.get_text() for text in figure.legends[0].get_texts()))
        return path

    monkeypatch.setattr("fecontact.maps.picture.save_figure", look)
    like = point(100e3, 0.05)
    lines = {str(k): "HOLDS" if k < holds else "UNRESOLVED" if k == 11 else "FAILS" for k in range(12)}
    verdict = replace(like.verdict, answer="UNRESOLVED", variant_answers=lines)
    cell = cell_of(replace(like, verdict=verdict))
    position = MapPosition(lateral_shift_mm=0.0, cells=(cell,), limit=find_load_limit([cell]))
    save_map_figure(build_verdict_view(ApplicabilityMap(case=ROUND, loads_N=(100e3,), positions=(position,))), tmp_path)
    (box,) = (patch for text, patch in colours.items() if text.startswith(f"{holds}/12"))
    # of 256 colours the nearest
    assert box.get_facecolor() == pytest.approx(to_rgba(colour), abs=0.01)
    assert any("profile variants on which it holds" in text for text in colours)


def test_the_png_changes_its_colour_where_the_verdict_does(monkeypatch):
    from matplotlib.colors import to_hex

    from fecontact.outputs.style import ANSWER_COLOURS

    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    limit = replace(find_load_limit(TWO_LOADS), tried=((3e4, "UNRESOLVED"),))
    lost = MapCell(lateral_shift_mm=1.0, load_N=1e4, status="failed: no memory")
    positions = (
        MapPosition(lateral_shift_mm=0.0, cells=tuple(TWO_LOADS), limit=limit),
        MapPosition(lateral_shift_mm=1.0, cells=(lost,), limit=find_load_limit([lost])),
    )
    save_map_figure(
        build_verdict_view(ApplicabilityMap(case=ROUND, loads_N=(1e4, 9e4), positions=positions)), "unused.png"
    )
    (ax,) = figures[0].axes
    filled = [
        (to_hex(bar.get_facecolor()), bar.get_x(), bar.get_y(), bar.get_y() + bar.get_height())
        for bar in ax.patches
        if bar.get_fill()
    ]
    assert ax.get_yscale() == "linear"
    # 8 % of the loads' range, room for a diamond, below and above; open between both loads
    assert filled == [
        (ANSWER_COLOURS["HOLDS"], -0.35, pytest.approx(3.6), 10.0),
        (ANSWER_COLOURS["UNRESOLVED"], -0.35, 10.0, 90.0),
        (ANSWER_COLOURS["FAILS"], -0.35, 90.0, pytest.approx(96.4)),
        (ANSWER_COLOURS["failed"], 0.65, pytest.approx(3.6), pytest.approx(96.4)),
    ]
    # a tick at both sides of the column for each load that was solved in the search; those of the map have a number
    ticks = [line.get_ydata()[0] for line in ax.get_lines() if np.ptp(line.get_xdata()) < 0.2]
    assert sorted(ticks) == [30.0, 30.0]
    assert [text.get_text() for text in ax.texts][-1] == "!"


def tables_of_cells(page):
    """Tables of cells alone."""
    return {table for details in page.iter("details") for table in details.iter("table")}


@pytest.mark.slow
def test_the_report_of_a_map_says_limits_and_cells_beside_its_png(tmp_path):
    from xml.etree import ElementTree

    map_made = fresh_map([0.0, 1.0], LOADS)
    save_map_figure(build_verdict_view(map_made), tmp_path / "map.png")
    text = write_map_report(map_made, tmp_path).read_text("utf-8")
    page = ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))
    shares, limits, cells = [table for table in page.iter("table") if not {table} & tables_of_cells(page)]
    # Hertz, and whatever else was judged, each with the cells where it is the cheapest that holds
    lines = [["".join(cell.itertext()) for cell in line] for line in shares.iter("tr")][1:]
    assert lines[0][0] == "Hertz"
    assert sum(int(line[2]) for line in lines) == len(map_made.cells)
    lines = [["".join(cell.itertext()) for cell in line] for line in limits.iter("tr")][1:]
    assert lines == [[f"{p.lateral_shift_mm:+z.2f}", format_limit(p.limit, open_loads(p))] for p in map_made.positions]
    lines = [["".join(cell.itertext()) for cell in line] for line in cells.iter("tr")][1:]
    assert [line[:3] for line in lines] == [
        [f"{cell.lateral_shift_mm:+z.2f}", f"{cell.load_N / 1e3:g}", cell.verdict] for cell in map_made.cells
    ]
    utilisations = [cell.judged.limit_utilisation for cell in map_made.cells]
    assert [line[3] for line in lines] == [f"{value:.2f}" if value <= 1.0 else "above 1" for value in utilisations]
    # two maps, section, ladder, patches, and each cell; none from elsewhere
    assert [image.get("src").partition(";")[0] for image in page.iter("img")] == [
        *["data:image/svg+xml"] * 4, *["data:image/webp"] * (1 + len(map_made.cells)),
    ]  # fmt: skip
    # a spot is a link without a script, with the words of its cell (XML has blanks for line ends), and leads to them
    spots = [spot for spot in page.iter("a") if spot.get("title")]
    targets = {division.get("id"): division for division in page.iter("div")}
    assert len(spots) == 2 * len(map_made.cells)
    for spot, cell in zip(spots, [*map_made.cells] * 2, strict=True):
        head = f"{cell.lateral_shift_mm:+z.2f} mm, {cell.load_N / 1e3:g} kN: Hertz {cell.verdict}"
        assert spot.get("title").startswith(f"{head} peak pressure (MPa): ")
        target = targets[spot.get("href").removeprefix("#")]
        assert f"Hertz {cell.verdict}; " in "".join(target.itertext())
        assert len(list(target.iter("img"))) == 1
    # the boxes lie on the cells: side by side, and the larger load above
    boxes = [
        [float(number) for number in re.findall(r"[\d.]+(?=%)", spot.get("style"))]
        for spot in spots[: len(map_made.cells)]
    ]
    for (left, top, _, high), (right, bottom, *_) in zip(boxes[1::2], boxes[::2], strict=True):
        assert (left, top + high) == pytest.approx((right, bottom), abs=0.02)
    verdicts = [cell.verdict for cell in map_made.cells]
    assert f"Hertz holds in {verdicts.count('HOLDS')} of {len(verdicts)} cells" in text


def test_causes_have_letters_of_their_own():
    assert CAUSE_LETTERS["second lobe"] == "L"
    assert len(set(CAUSE_LETTERS.values())) == len(CAUSE_LETTERS)


# --- positions solved elsewhere, before, and again --------------------------------------------------------------------


def test_positions_of_several_workers_are_those_of_one(run, tmp_path, monkeypatch):
    monkeypatch.setattr(map_positions, "solve_position", faulty_position)
    heard, positions_seen = [], []

    def look(finished, count, what):
        heard.append(what)
        if finished:
            positions_seen.append(json.loads((tmp_path / "map.json").read_text("utf-8"))["lateral_shifts_mm"])

    outcome = run(tmp_path, [3.0, -2.0, 0.0, 1.0], loads=FEW_LOADS, crew=inline_workers(3), progress=look)
    alone = fresh_map([-2.0, 0.0, 1.0, 3.0], FEW_LOADS)
    # in the order of the shifts, whichever is finished first
    assert outcome.made.lateral_shifts_mm == (-2.0, 0.0, 1.0, 3.0)
    assert all(shifts == sorted(shifts) for shifts in positions_seen)
    # no more positions are reported as running than there are workers
    assert heard
    assert all(1 <= what.count(" mm") <= 3 for what in heard)
    name = make_case_id(replace(ROUND, lateral_shift_mm=1.0), FEW_LOADS)
    said = f"failed: RuntimeError: a fault of the program; see {name}.error.txt"
    for got, expected in zip(plain(outcome.made)["cells"], plain(alone)["cells"], strict=True):
        if got["lateral_shift_mm"] == 1.0:
            assert got["status"] == said
            assert "verdict" not in got
        else:
            assert got == expected
    assert outcome.made.limits[2].reason == said
    assert "faulty_position" in (tmp_path / "positions" / f"{name}.error.txt").read_text("utf-8")


def test_an_error_of_the_program_is_no_cell(run, tmp_path, monkeypatch):
    def wrong(case, loads_N, tell=None):
        if case.lateral_shift_mm == 1.0:
            raise KeyError("area_mm2")
        return fake_position(case, loads_N)

    monkeypatch.setattr(map_positions, "solve_position", wrong)
    shifts = [3.0, 0.0, 1.0]
    with pytest.raises(ProgramError, match=r"1 of 3 jobs ended.* first \+1.00 mm: KeyError: 'area_mm2'"):
        run(tmp_path, shifts, loads=FEW_LOADS, crew=inline_workers(2))
    stored = json.loads((tmp_path / "map.json").read_text("utf-8"))
    assert stored["lateral_shifts_mm"] == [0.0, 3.0]
    assert not (tmp_path / "report.html").exists()
    assert "KeyError" not in (tmp_path / "map.csv").read_text("utf-8")
    # with a corrected program the same command resumes
    monkeypatch.setattr(map_positions, "solve_position", fake_position)
    outcome = run(tmp_path, shifts, loads=FEW_LOADS, crew=inline_workers(2))
    assert outcome.made.lateral_shifts_mm == (0.0, 1.0, 3.0)
    assert all(cell.usable for cell in outcome.made.cells)
    assert len(outcome.reused) == 2


def test_a_map_of_errors_of_the_program_alone_says_so(run, tmp_path, monkeypatch):
    def wrong(case, loads_N, tell=None):
        raise TypeError("no such thing")

    monkeypatch.setattr(map_positions, "solve_position", wrong)
    with pytest.raises(ProgramError, match=r"2 of 2 jobs ended.*TypeError: no such thing"):
        run(tmp_path, [0.0, 1.0], loads=FEW_LOADS, crew=inline_workers(2))


def faulty_position(case, loads_N, tell=None):
    if case.lateral_shift_mm == 1.0:
        raise RuntimeError("a fault\nof the program")
    return fake_position(case, loads_N)


@dataclass(frozen=True, kw_only=True)
class DeadlyWork:
    """Work that processes can import: one shift always ends the process."""

    case: Case
    loads_N: tuple[float, ...]
    name: str
    dear: bool = False
    pictured: bool = False

    def __call__(self, folder, finished):
        if self.case.lateral_shift_mm == 0.0:
            os._exit(9)
        keep_position(fake_position(self.case, self.loads_N), self.case, folder)
        return WorkResult()


@dataclass(frozen=True)
class PlantedWork:
    """Work that processes can import: a position with planted solutions."""

    case: Case
    loads_N: tuple[float, ...]
    name: str
    dear: bool = False
    pictured: bool = False

    def __call__(self, folder, finished):
        keep_position(fake_position(self.case, self.loads_N), self.case, folder)
        return WorkResult()


@dataclass(frozen=True)
class SlowWork(PlantedWork):
    """One shift waits until it may go on."""

    def __call__(self, folder, finished):
        while self.case.lateral_shift_mm == 0.0 and not (folder.parents[1] / "go").exists():
            time.sleep(0.05)
        return super().__call__(folder, finished)


def slow_map(out):
    return map_by(ROUND, [-1.0, 0.0, 1.0], [50e3, 100e3], out, settings=RunSettings(workers=2), work=SlowWork)


KILLED = """
import sys
from pathlib import Path
sys.path[:0] = {here!r}
from test_map import slow_map
if __name__ == "__main__":
    slow_map(Path(sys.argv[1]))
"""


# a map that ends at any file operation, and a study whose processes are killed, are tested by default
@pytest.mark.slow
def test_a_map_that_is_killed_goes_on_where_it_stopped(tmp_path):
    out, script = tmp_path / "out", tmp_path / "script.py"
    script.write_text(KILLED.format(here=[str(folder) for folder in Path(__file__).parents[:2]]))
    process = subprocess.Popen([sys.executable, script, out])
    try:
        end = time.monotonic() + 120.0
        while len(list((out / "positions").glob("[!.]*"))) < 2:
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.05)
        children = psutil.Process(process.pid).children(recursive=True)
    finally:
        process.kill()
        process.wait()
    _, alive = psutil.wait_procs(children, timeout=20)
    assert alive == [], "workers linger"
    assert list((out / "positions").glob(".*"))
    (out / "go").touch()
    outcome = slow_map(out)
    assert len(outcome.reused) == 2
    assert plain(outcome.made) == plain(fresh_map([-1.0, 0.0, 1.0], [50e3, 100e3]))
    assert not list(out.rglob(".*"))


# one worker that dies is started again for studies as for maps
@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_dies_costs_its_position_and_no_other(tmp_path, workers):
    map_made = map_by(
        ROUND,
        [-1.0, 0.0, 1.0],
        FEW_LOADS,
        tmp_path,
        settings=RunSettings(workers=workers),
        work=DeadlyWork,
    ).made
    assert [p.converged for p in map_made.positions] == [True, False, True]
    assert {cell.status for cell in map_made.positions[1].cells} == {"failed: the process died twice (out of memory?)"}
    fresh = plain(fresh_map([-1.0, 1.0], FEW_LOADS))
    outcome = plain(map_made)
    assert [cell for cell in outcome["cells"] if cell["lateral_shift_mm"]] == fresh["cells"]
    assert [limit for limit in outcome["limits"] if limit["lateral_shift_mm"]] == fresh["limits"]
    # and is tried again by the next run, which has the others
    names = [make_case_id(replace(ROUND, lateral_shift_mm=shift), FEW_LOADS) for shift in (-1.0, 1.0)]
    assert sorted(path.name for path in (tmp_path / "positions").iterdir()) == sorted(names)


@pytest.mark.parametrize("what", ["position", "load", "limit", "refinement"])
def test_a_position_short_of_memory_beside_others_is_solved_again_alone(run, tmp_path, monkeypatch, what):
    order = []

    def hungry(case, loads_N, tell=None):
        order.append(case.lateral_shift_mm)
        FakeSweep.short_of_memory = {what} if order.count(0.0) == 1 else set()
        return fake_position(case, loads_N)

    monkeypatch.setattr(map_positions, "solve_position", hungry)
    map_made = run(tmp_path, [-1.0, 0.0, 1.0], loads=TWO_SIDES, crew=inline_workers(2)).made
    assert sorted(order) == [-1.0, 0.0, 0.0, 1.0]
    assert order[-1] == 0.0
    assert map_made.all_solved
    FakeSweep.short_of_memory = set()
    assert plain(map_made) == plain(fresh_map([-1.0, 0.0, 1.0], TWO_SIDES))


def test_what_is_short_of_memory_alone_says_so_and_is_tried_again_by_the_next_run(run, tmp_path):
    FakeSweep.short_of_memory = {"load"}
    map_made = run(tmp_path, [-1.0, 0.0], loads=FEW_LOADS).made
    assert FakeSweep.solved.count(0.0) == len(FEW_LOADS)
    assert all("needs about 4.5 GB of memory" in cell.status for cell in map_made.positions[1].cells)
    assert map_made.positions[1].short_of_memory
    # a larger machine
    FakeSweep.short_of_memory, FakeSweep.solved = set(), []
    outcome = run(tmp_path, [-1.0, 0.0], loads=FEW_LOADS)
    assert set(FakeSweep.solved) == {0.0}
    assert plain(outcome.made) == plain(fresh_map([-1.0, 0.0], FEW_LOADS))


@pytest.mark.slow
def test_finished_positions_are_taken_from_their_folders(run, tmp_path):
    shifts = [-2.0, 0.0, 1.0, 3.0]
    first = run(tmp_path, shifts, loads=LOADS[::3])
    assert (first.reused, first.recomputed) == ((), {})
    files = {name: (tmp_path / name).read_bytes() for name in ("map.csv", "map.json", "contacts.csv")}
    FakeSweep.solved = []
    again = run(tmp_path, shifts, loads=LOADS[::3])
    # positions with a load that failed or did not converge are tried again
    assert [name.split("_")[2] for name in again.reused] == ["+1.00mm", "+0.00mm"]
    assert again.recomputed == {}
    assert set(FakeSweep.solved) == {-2.0, 3.0}
    assert build_map_record(again.made) == build_map_record(first.made)
    assert {name: (tmp_path / name).read_bytes() for name in files} == files


def test_force_solves_all_again(run, tmp_path):
    run(tmp_path, [0.0, 1.0], loads=LOADS[:1])
    FakeSweep.solved = []
    outcome = run(tmp_path, [0.0, 1.0], loads=LOADS[:1], force=True)
    assert set(FakeSweep.solved) == {0.0, 1.0}
    assert (outcome.reused, outcome.recomputed) == ((), {})


def test_parts_together_are_the_whole_map(run, tmp_path):
    shifts, loads = [-1.0, 0.0, 1.0, 2.0], LOADS[:2]
    whole_run = run(tmp_path / "whole", shifts, loads=loads).made
    FakeSweep.solved = []
    counts = set()

    def look(finished, count, what):
        counts.add(count)

    parts = [run(tmp_path / "parts", shifts, loads=loads, part=(k, 2), progress=look).made for k in (1, 2)]
    # of a part the progress counts its own positions
    assert counts == {2}
    assert [part_map.lateral_shifts_mm for part_map in parts] == [(-1.0, 1.0), (0.0, 2.0)]
    for k in (1, 2):
        assert len(rows_of(tmp_path / "parts" / f"map.part-{k}-of-2.csv")) == 2 * len(parts[k - 1].positions)
    assert not (tmp_path / "parts" / "map.csv").exists()
    solved_loads = list(FakeSweep.solved)
    together = run(tmp_path / "parts", shifts, loads=loads).made
    assert FakeSweep.solved == solved_loads
    assert plain(together) == plain(whole_run)
    assert rows_of(tmp_path / "parts" / "map.csv") == rows_of(tmp_path / "whole" / "map.csv")


@pytest.mark.slow
def test_positions_of_other_inputs_or_loads_stay_beside_each_other(run, tmp_path):
    shifts = [-1.0, 0.0]
    before = run(tmp_path, shifts, loads=FEW_LOADS).made
    variants = [(replace(ROUND, load_kind="normal"), FEW_LOADS), (replace(ROUND, resolution="fine"), FEW_LOADS)]
    for case, loads in [*variants, (ROUND, FEW_LOADS[1:])]:
        FakeSweep.solved = []
        assert run(tmp_path, shifts, case, loads).reused == ()
        assert set(FakeSweep.solved) == set(shifts)
    FakeSweep.solved = []
    again = run(tmp_path, shifts, loads=FEW_LOADS)
    assert len(again.reused) == 2
    assert FakeSweep.solved == []
    assert plain(again.made) == plain(before)
    assert len(list((tmp_path / "positions").iterdir())) == 4 * len(shifts)


@pytest.mark.slow
def test_other_criteria_are_judged_again_without_solving(run, tmp_path):
    run(tmp_path, [0.0, 1.0], loads=TWO_SIDES)
    # all loads hold by these: there is no limit to look for
    case = replace(ROUND, criteria=Criteria(p_max=0.9, area=0.95))
    FakeSweep.solved = []
    outcome = run(tmp_path, [0.0, 1.0], case, TWO_SIDES)
    assert FakeSweep.solved == []
    assert (
        list(outcome.recomputed.values())
        == ["judged by different criteria: criterion p_max 0.05 -> 0.9, criterion area 0.1 -> 0.95"] * 2
    )
    assert outcome.reused == ()
    fresh = fresh_map([0.0, 1.0], TWO_SIDES, case)
    assert cells_of(outcome.made) == cells_of(fresh)
    assert {cell.verdict for cell in outcome.made.cells} == {"HOLDS"}
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["criteria"] == json.loads(
        format_json(case.criteria.record)
    )
    # whoever reads the folder now reads these verdicts
    assert plain(load_results(tmp_path)) == plain(outcome.made)
    assert run(tmp_path, [0.0, 1.0], case, TWO_SIDES).recomputed == {}


def test_criteria_whose_limit_lies_elsewhere_are_solved_for(run, made_one, one_position):
    before = made_one[1].limits
    case = replace(ROUND, criteria=Criteria(p_max=0.03, area=0.2))
    outcome = run(one_position, [0.0], case)
    assert set(FakeSweep.solved) == {0.0}
    # searched for by these criteria, as if there had been no others
    assert outcome.made.limits == fresh_map([0.0], case=case).limits
    assert outcome.made.limits != before
    assert outcome.made.limits[0].narrowed


def folder_of(out, shift_mm, loads=LOADS):
    return name_position_folder(out, make_case_id(replace(ROUND, lateral_shift_mm=shift_mm), loads))


def sealed(folder, change):
    """Change the record of a position, and write checksums of the changed record."""
    path = folder / SOLUTION_FILE
    path.write_text(change(path.read_text("utf-8")), "utf-8")
    write_manifest(folder, [path, folder / "fields.npz"], folder.name, determine_origin(ROUND))


def edited(path, change):
    path.write_text(change(path.read_text("utf-8")), "utf-8")


DAMAGES = [
    (lambda folder: edited(folder / SOLUTION_FILE, lambda text: text[:-200]), "solved.json is damaged"),
    (lambda folder: edited(folder / SOLUTION_FILE, lambda text: text.replace("17", "71")), "its checksum differs"),
    (lambda folder: (folder / "fields.npz").write_bytes(b"PK"), "fields.npz is damaged"),
    (lambda folder: (folder / "fields.npz").unlink(), "fields.npz is missing"),
    (lambda folder: (folder / "stored.json").unlink(), "stored.json is missing"),
    (lambda folder: edited(folder / "stored.json", lambda text: "[]"), "does not have the layout"),
    (
        lambda folder: edited(folder / "stored.json", lambda text: text.replace('"fecontact": "', '"fecontact": "x')),
        "different version: fecontact x",
    ),
]


@pytest.mark.parametrize(
    ("damage", "says"),
    slow_but(
        [
            *DAMAGES,
            (
                lambda folder: sealed(folder, lambda text: text.replace("solved/2", "solved/0")),
                "the layout is",
            ),
            (
                lambda folder: sealed(folder, lambda text: text.replace('"quadratic"', '"cubic"')),
                "KeyError: 'quadratic'",
            ),
        ],
        *(0, 1, 2, 6, 8),
    ),
)
def test_a_folder_that_cannot_be_used_is_named_and_solved_again(run, two, tmp_path, damage, says):
    kept_whole, before = two
    shutil.copytree(kept_whole, tmp_path, dirs_exist_ok=True)
    folder = folder_of(tmp_path, 0.0, FEW_LOADS)
    damage(folder)
    outcome = run(tmp_path, [0.0, 1.0], loads=FEW_LOADS)
    assert list(outcome.recomputed) == [folder.name]
    assert says in outcome.recomputed[folder.name]
    assert set(FakeSweep.solved) == {0.0}
    assert outcome.reused == (folder_of(tmp_path, 1.0, FEW_LOADS).name,)
    assert plain(outcome.made) == plain(before)
    assert run(tmp_path, [0.0, 1.0], loads=FEW_LOADS).recomputed == {}


@pytest.mark.slow
def test_another_layout_is_solved_again_also_with_other_criteria(run, one_position):
    sealed(folder_of(one_position, 0.0), lambda text: text.replace("solved/2", "solved/0"))
    case = replace(ROUND, criteria=Criteria(p_max=0.03))
    assert plain(run(one_position, [0.0], case).made) == plain(fresh_map([0.0], case=case))
    assert FakeSweep.solved


def test_a_number_that_was_none_is_read_as_none(run, tmp_path, monkeypatch):
    """Profiles by points without contact for half of the points.

    The uncertainty of a measure is then not available.
    """

    def solve_with_few_points(case, loads_N, tell=None):
        position = fake_position(case, loads_N)
        cell = position.cells[0]
        solved_load = cell.judged.solved
        unknown = ProfileVariants(own=VariantResult(label="own line"), others=())
        judged_load = judge_load(replace(solved_load, lines=unknown), position.placement)
        return replace(position, cells=(replace(cell, judged=judged_load), *position.cells[1:]))

    monkeypatch.setattr(map_positions, "solve_position", solve_with_few_points)
    map_made = run(tmp_path, [0.0], loads=LOADS[:1]).made
    assert math.isnan(map_made.cells[0].judged.uncertainty["a_mm"])
    assert map_made.cells[0].verdict == "UNRESOLVED"
    assert rows_of(tmp_path / "map.csv")[0]["hertz_uncertainty_a_percent"] == ""
    load = json.loads((tmp_path / "map.json").read_text("utf-8"))["cells"][0]
    assert load["theories"]["hertz"]["uncertainty"]["a_mm"] is None
    assert load["verdict"]["each"]["a_mm"] == "UNRESOLVED"


# --- what is stored -------------------------------------------------------------------------------------------------


def is_equal(first, second):
    """Every value of two objects, to the last bit."""
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and first.shape == second.shape and first.tobytes() == second.tobytes()
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(is_equal, first, second))
    if hasattr(first, "__dataclass_fields__"):
        return type(first) is type(second) and all(is_equal(getattr(first, f), getattr(second, f)) for f in vars(first))
    return first == second and type(first) is type(second)


def stored_again(value, tmp_path):
    arrays = {}
    record = json.loads(format_json(solved_record(value, arrays, "load0_")))
    return solved_from_record(record, read_arrays(write_arrays(tmp_path / "fields.npz", arrays)), value.case)


@pytest.mark.parametrize("thinned", [False, True])
@pytest.mark.parametrize("noise", [False, True])
def test_a_solved_load_comes_back_to_the_last_bit(tmp_path, noise, thinned):
    hertz = compute_hertz(ROUND, placement_of(0.0))
    lobe = VariantLobe(low_y_mm=0.1 / 3.0, high_y_mm=0.4, normal_force_N=1e4, p_max_MPa=900.1, deviation={"a_mm": 0.1})
    line = VariantResult(
        label="own line", p_max_MPa=1e3 / 3.0, deviations={"hertz": {"p_max_MPa": 1e-2 / 3.0}}, lobes=(lobe,)
    )
    empty_variant = VariantResult(label="filter 4 mm")
    solved_load = planted_solved(
        ROUND,
        1.0 / 30.0,
        lines=ProfileVariants(own=line, others=(line, line) if thinned else (empty_variant,)) if noise else None,
        turned=planted_rung(hertz, 6, 0.03) if thinned else None,
        limits=("not refined: 4.5 GB", "zone"),
        short_of_memory=True,
    )
    # whole models have both halves themselves
    whole_rung = replace(solved_load.quadratic, grid=replace(solved_load.quadratic.grid, half=False))
    edge = replace(solved_load.levels[0], enlarged=2, at_edge=True)
    solved_load = replace(solved_load, quadratic=whole_rung, levels=(edge, *solved_load.levels))
    load_read = stored_again(solved_load, tmp_path)
    if noise and not thinned:
        assert math.isnan(load_read.lines.others[0].p_max_MPa)
        # NaN is not equal to itself
        load_read, solved_load = (
            replace(load, lines=replace(load.lines, others=())) for load in (load_read, solved_load)
        )
    assert is_equal(load_read, solved_load)
    assert not is_equal(replace(load_read, limits=()), solved_load)


def test_what_was_stored_before_is_found_by_its_names():
    """Another name of a field would leave stored results without this field."""
    hertz = compute_hertz(ROUND, placement_of(0.0))
    lines = ProfileVariants(own=VariantResult(label="own line", deviations={"hertz": {"a_mm": 0.1}}), others=())
    solved_load, arrays = planted_solved(ROUND, lines=lines, turned=planted_rung(hertz, 6, 0.03)), {}
    record = solved_record(solved_load, arrays, "load0_")
    rungs = {f"level{k}_{name}" for k in range(len(solved_load.levels)) for name in ("nodal", "fe", "otherwise")}
    rungs |= {"half_space", "turned", "quadratic"}
    parts = ("x_mm", "s_mm", "pressure_MPa", "gap_mm")
    assert set(arrays) == {f"load0_{rung}_{quantity}" for rung in rungs for quantity in parts}
    assert list(record) == [
        *("load_N", "levels", "half_space", "turned", "quadratic", "lines", "limits", "short_of_memory"),
        *("gap_curvature_error", "load_error"),
    ]
    assert set(record["lines"]["own"]) == {"label", "p_max_MPa", "deviations", "patches", "lobes"}
    assert "yielded" not in record["levels"][0]


def test_a_stored_load_with_what_nobody_knows_is_refused():
    record = solved_record(planted_solved(ROUND), arrays := {})
    record["levels"][0]["half_as_wide"] = 1.0
    with pytest.raises(KeyError, match="half_as_wide"):
        solved_from_record(record, arrays, ROUND)


def test_stored_arrays_are_the_same_bytes_each_time(tmp_path):
    arrays = {}
    solved_record(planted_solved(ROUND), arrays)
    first, second = (write_arrays(tmp_path / f"{k}.npz", arrays).read_bytes() for k in "ab")
    assert first == second
    # only the given values, also for NumPy's own reader
    assert set(read_arrays(tmp_path / "a.npz")) == set(arrays)
    with np.load(tmp_path / "a.npz") as archive:
        assert all(np.array_equal(archive[name], values) for name, values in arrays.items())


@pytest.mark.parametrize(
    "case",
    [
        ROUND,
        Case(),
        # two contact points, and one at a junction, which has two curvatures
        Case(lateral_shift_mm=5.5, yaw_rad=0.01, roll_rad=0.001),
        replace(ROUND, rail="arcs:300/80@0"),
        # the flange stands on the rail beyond its steepest place
        Case(lateral_shift_mm=11.0, roll="given", flange_climb=True),
    ],
)
def test_a_placement_comes_back_to_the_last_bit_without_a_search(case, monkeypatch):
    placement = place_case(case)
    record = json.loads(format_json(placement_record(placement)))
    rail, wheel = resolve_rail(case.rail), resolve_wheel(case.wheel).profile
    monkeypatch.setattr("fecontact.placement.wheel_on_rail.place", None)
    placement_read = placement_from_record(record, rail, wheel)
    assert placement_record(placement_read) == placement_record(placement)
    assert placement_read.climbs is placement.climbs is case.flange_climb
    for body in ("rail", "wheel"):
        fields = {k: v for k, v in vars(getattr(placement, body)).items() if k != "profile"}
        assert all(is_equal(getattr(getattr(placement_read, body), k), v) for k, v in fields.items())
    assert is_equal(placement_read.contact_points, placement.contact_points)
    x = np.linspace(-3.0, 3.0, 7)
    np.testing.assert_array_equal(placement_read.gap(x[:, None], x[None, :]), placement.gap(x[:, None], x[None, :]))


# --- stored maps read and judged again --------------------------------------------------------------------------------


def test_a_map_s_folder_is_read_as_it_was_made(whole_map):
    out, map_kept = whole_map
    map_read = fecontact.load(out)
    assert FakeSweep.solved == []
    assert isinstance(map_read, ApplicabilityMap)
    assert plain(map_read) == plain(map_kept)
    assert (map_read.loads_N, map_read.lateral_shifts_mm) == (map_kept.loads_N, map_kept.lateral_shifts_mm)
    assert build_map_record(map_read)["case"] == build_map_record(map_kept)["case"]
    # whole objects: fields and placements as well
    cell, kept_cell = map_read.cells[9], map_kept.cells[9]
    assert is_equal(cell.judged.solved.levels, kept_cell.judged.solved.levels)
    assert is_equal(map_read.positions[2].placement.contact_points, map_kept.positions[2].placement.contact_points)


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"no result\.json or study\.json or map\.json"):
        fecontact.load(tmp_path)


@pytest.mark.parametrize(
    "criteria", slow_but([Criteria(p_max=0.03, area=0.2), Criteria(p_max=0.08), Criteria()], 2), ids=str
)
def test_other_criteria_give_the_verdicts_of_a_new_evaluation(uneven, tmp_path, criteria):
    out, stored = uneven
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    outcome = judge_map(out, criteria, tmp_path / "out")
    judged_map = outcome.map
    assert outcome.problems == ()
    assert FakeSweep.solved == []
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    fresh = fresh_map(UNEVEN, case=replace(ROUND, criteria=criteria))
    assert plain(judged_map)["cells"] == plain(fresh)["cells"]
    assert json.loads((tmp_path / "out" / "map.json").read_text("utf-8"))["criteria"]["p_max"] == criteria.p_max
    written = [row["verdict_answer"] for row in rows_of(tmp_path / "out" / "map.csv")]
    assert written == [cell.verdict for cell in fresh.cells]
    for position, stored_position, new in zip(judged_map.positions, stored.positions, fresh.positions, strict=True):
        limit, sharp = position.limit, new.limit
        assert limit.reason == sharp.reason
        # all that was solved, and no more
        loads_tried = list_usable_loads(position.cells, position.tried)
        assert [load_tried.load_N for load_tried in loads_tried] == [
            load_tried.load_N for load_tried in list_usable_loads(stored_position.cells, stored_position.tried)
        ]
        if not loads_tried:
            continue
        assert_intervals_fit(limit, loads_tried)
        next_load_N = choose_next_load(loads_tried, LOADS)
        assert limit.narrowed is (next_load_N is None and position.stopped is None)
        # nowhere against what was looked for by these criteria
        for load_tried in limit.intervals:
            for sharp_interval in sharp.intervals:
                if min(load_tried.high_N, sharp_interval.high_N) > max(load_tried.low_N, sharp_interval.low_N):
                    assert {load_tried.answer, sharp_interval.answer} != {"HOLDS", "FAILS"}
    if criteria == Criteria():
        assert plain(judged_map) == plain(stored)


@pytest.mark.slow
def test_a_limit_by_other_criteria_is_found_among_the_loads_that_were_solved(one_position):
    """A limit by other criteria at 0 mm, where Hertz deviates by 4 % at 100 kN.

    The limit of 5 % was looked for around 125 kN, and nothing below 100 kN.
    """
    judged_map = judge_map(one_position, Criteria(p_max=0.03, area=0.2)).map
    (limit,) = judged_map.limits
    assert [(one_position.low_N, one_position.high_N, one_position.answer) for one_position in limit.intervals] == [
        (10e3, 50e3, "HOLDS"),
        (50e3, 100e3, "UNRESOLVED"),
        (100e3, 150e3, "FAILS"),
    ]
    assert limit.F_max_N == 50e3
    assert {answer for _, answer in limit.tried} == {"FAILS"}
    # a map by these criteria would solve more
    assert not limit.narrowed
    # nothing was solved between both, which is not the same as a verdict that is open
    assert format_limit(limit, ()) == "holds 10 to 50, not solved 50 to 100, fails 100 to 150 kN"


def is_decided(folder, case):
    """Whether a worker takes over the stored position in place of a new solution."""
    again = store.judge_again(read_position, folder, case)
    return again is not None and again.limit.narrowed


@pytest.mark.parametrize(
    ("criteria", "decided"),
    [
        # limits elsewhere among the loads are not known
        (Criteria(p_max=0.03, area=0.2), False),
        (Criteria(p_max=0.9, area=0.9, a=0.9, b=0.9, misplaced=0.9), True),
        (Criteria(p_max=1e-4), True),
        (Criteria(judged_by=("centre", "valley")), True),
    ],
    ids=["other limit", "all hold", "all fail", "other measures"],
)
def test_a_stored_position_is_decided_if_a_new_solution_would_have_no_more_loads(one_position, criteria, decided):
    folder = folder_of(one_position, 0.0)
    # what the own criteria leave open no finer mesh is allowed to decide
    case = replace(ROUND, criteria=criteria, refine="never")
    assert is_decided(folder, case) is decided
    assert read_position(folder, criteria=criteria).limit.narrowed is decided
    sealed(folder, lambda text: text.replace("solved/2", "solved/0"))
    assert not is_decided(folder, case)


def test_a_position_whose_search_stopped_is_not_decided(run, tmp_path):
    map_made = run(tmp_path, [2.0]).made
    folder = folder_of(tmp_path, 2.0)
    position_read = read_position(folder)
    assert position_read.limit == map_made.limits[0]
    assert position_read.stopped.status == "failed: a limit that cannot be solved"
    assert not position_read.limit.narrowed
    assert not is_decided(folder, ROUND)


def test_an_open_load_that_finer_meshes_may_decide_is_not_decided(one_position):
    folder = folder_of(one_position, 0.0)
    for refine, decided in (("never", True), ("verdict", False)):
        case = replace(ROUND, criteria=Criteria(p_max=0.06), refine=refine)
        position = read_position(folder, criteria=case.criteria)
        # 6 % at 150 kN, which is the limit itself
        assert position.cells[-1].verdict == "UNRESOLVED"
        sealed(folder, lambda text, refine=refine: re.sub(r'"refine": "\w+"', f'"refine": "{refine}"', text))
        assert is_decided(folder, case) is (decided and position.limit.narrowed)


@pytest.mark.slow
def test_cells_of_all_kinds_come_back_from_a_cluster(run, tmp_path):
    shifts = [-2.0, 3.0, 4.0]
    local_map = run(tmp_path / "here", shifts).made
    with dask_cluster(tmp_path, 2, PYTHONPATH=os.pathsep.join(sys.path)) as (address, _):
        settings = RunSettings(scheduler=address)
        cluster_map = map_by(ROUND, shifts, LOADS, tmp_path / "there", settings=settings, work=PlantedWork).made
    assert plain(cluster_map) == plain(local_map)
    assert rows_of(tmp_path / "there" / "map.csv") == rows_of(tmp_path / "here" / "map.csv")
    # solved and judged both ways, not converged, a load that cannot be solved, and a position that is none
    assert {cell.verdict for cell in cluster_map.cells} >= {"HOLDS", "FAILS"}
    assert {cell.status.partition(":")[0] for cell in cluster_map.cells} == {"converged", "not converged", "failed"}


def test_damage_of_every_file_of_a_map_is_noticed(two, tmp_path):
    """Damage of every file, also of a file that is added to a map some day.

    Files that nobody reads are exempt.
    """
    out = shutil.copytree(two[0], tmp_path / "out")
    (position, *_) = sorted((out / "positions").iterdir())
    assert files_without_checksum(position) == set()
    shutil.rmtree(out / "positions")
    # the stiffness is fitted anew whenever a map is read, and contacts are for other programs
    assert unnoticed(out, (lambda: read_map_document(out), lambda: load_table(out))) == {
        "contacts.csv",
        "stiffness.csv",
    }


@pytest.mark.parametrize(
    ("damage", "says"),
    slow_but(
        [
            *DAMAGES[:-1],
            (
                lambda folder: edited(
                    folder / "stored.json",
                    lambda text: text.replace('"source of solving": "', '"source of solving": "x'),
                ),
                "made by a different version: source of solving x",
            ),
            (
                lambda folder: sealed(folder, lambda text: text.replace("solved/2", "solved/0")),
                "the layout is",
            ),
        ],
        4,
        6,
    ),
)
def test_a_position_that_cannot_be_judged_is_named_and_no_verdict_is_made_up(two, tmp_path, damage, says):
    kept_whole, whole_result = two
    shutil.copytree(kept_whole, tmp_path, dirs_exist_ok=True)
    folder = folder_of(tmp_path, 0.0, FEW_LOADS)
    damage(folder)
    outcome = judge_map(tmp_path, Criteria())
    judged_map, (problem,) = outcome.map, outcome.problems
    assert str(folder) in problem
    assert says in problem
    assert "again" in problem
    first, second = judged_map.positions
    assert {cell.verdict for cell in first.cells} == {"failed"}
    assert {cell.status for cell in first.cells} == {f"failed: {problem}"}
    assert all(cell.judged is None for cell in first.cells)
    assert first.limit.F_max_N is None
    assert [build_cell_record(cell) for cell in second.cells] == cells_of(whole_result)[len(FEW_LOADS) :]
    assert not judged_map.all_solved
    with pytest.raises(InputError, match=re.escape(problem)):
        fecontact.load(tmp_path)
    assert call(["judge", str(tmp_path)]) == 3


def test_a_map_of_another_layout_is_refused(one_position):
    edited(one_position / "map.json", lambda text: text.replace("fecontact/map/6", "fecontact/map/3"))
    for read_map in (fecontact.load, lambda folder: judge_map(folder, Criteria())):
        with pytest.raises(InputError, match="the layout is not fecontact/map/6; make the map again"):
            read_map(one_position)


def test_judge_command_of_a_map(made_one, tmp_path, capsys):
    kept_map = str(made_one[0])
    assert call(["judge", kept_map, "--p-max-percent", "3", "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "4 cells judged by" in said
    assert "holds 10 to 50, not solved 50 to 100, fails 100 to 150 kN" in said
    assert [row["verdict_answer"] for row in rows_of(tmp_path / "out" / "map.csv")] == [
        "HOLDS",
        "HOLDS",
        "FAILS",
        "FAILS",
    ]
    assert call(["judge", kept_map, "--out", kept_map]) == 2
    assert "which is not changed" in capsys.readouterr().err
    # what was judged has no positions of its own
    assert call(["judge", str(tmp_path / "out")]) == 2
    assert "no position of the map can be judged (the map has no position)" in capsys.readouterr().err


def test_profiles_that_are_files_are_kept_with_a_position(run, tmp_path, monkeypatch):
    """The map is judged where the file has changed since, or is gone."""
    head = tmp_path / "head.txt"
    y = np.linspace(-30.0, 30.0, 241)
    np.savetxt(head, np.column_stack([y, np.sqrt(300.0**2 - y**2) - 300.0]))
    case = replace(ROUND, rail=str(head), track=Track(rail_crown_y_mm=Track().tape_circle_y_mm))
    placement = place_case(case)
    monkeypatch.setitem(globals(), "placement_of", lambda shift_mm: placement)
    map_made = run(tmp_path / "map", [0.0], case, LOADS[:1]).made
    case_shown = build_map_record(map_made)["case"]
    head.unlink()
    map_read = fecontact.load(tmp_path / "map")
    assert plain(map_read) == plain(map_made)
    assert build_map_record(map_read)["case"] == case_shown
    assert "head.txt@" in case_shown["rail"]
    assert str(tmp_path) not in (tmp_path / "map" / "map.json").read_text("utf-8")


# --- the command ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_map_command_goes_on_where_it_stopped(tmp_path, capsys):
    options = ["map", "--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none"]
    options += ["--resolution", "1.6,1.2"]
    options += ["--loads-kn", "100", "--workers", "1", "--out", str(tmp_path)]
    assert call([*options, "--shifts", "0"]) == 0
    first = json.loads((tmp_path / "map.json").read_text("utf-8"))
    capsys.readouterr()
    assert call([*options, "--shifts", "0,1"]) == 0
    out = capsys.readouterr().out
    second = json.loads((tmp_path / "map.json").read_text("utf-8"))
    assert second["cells"][0] == first["cells"][0]
    assert len(second["cells"]) == 2
    assert "1 finished position was reused" in out
    # a flat wheel over a round head: the same contact at every shift, but for where gmsh puts its nodes (6e-5 seen)
    peaks = [cell["fe"]["p_max_MPa"] for cell in second["cells"]]
    assert peaks[1] == pytest.approx(peaks[0], rel=2e-4)
    assert "+1.00" in out
    # what finite elements solved is what is read back from its folder
    assert plain(fecontact.load(tmp_path))["cells"] == second["cells"]
    # a map of fewer shifts would lose rows, and is made by force alone; what was solved is still there
    assert call([*options, "--shifts", "1"]) == 2
    assert "has a different map" in capsys.readouterr().err
    assert json.loads((tmp_path / "map.json").read_text("utf-8")) == second
    assert call([*options, "--shifts", "1", "--force"]) == 0
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["cells"] == second["cells"][1:]
    assert len(list((tmp_path / "positions").glob("*/solved.json"))) == 2
    assert call([*options, "--shifts", "0", "--workers", "0"]) == 2


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("-6:6:3", (-6.0, -3.0, 0.0, 3.0, 6.0)),
        ("0:0.3:0.1", (0.0, 0.1, 0.2, 0.3)),
        ("10,20, 50", (10.0, 20.0, 50.0)),
        ("-1:0:0.5,4,4", (-1.0, -0.5, 0.0, 4.0)),
        ("5", (5.0,)),
    ],
)
def test_numbers_and_ranges(text, numbers):
    assert parse_numbers(text, "shifts") == numbers


@pytest.mark.parametrize(
    "text", ["", "a", "1:2", "1:2:0", "2:1:0.5", "1:2:-0.5", "1,,2", "0:1e6:0.1", "1:2:3:4", "nan"]
)
def test_numbers_that_are_none(text):
    with pytest.raises(InputError, match="shifts"):
        parse_numbers(text, "shifts")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--shifts", "-6:x:1"], "neither a number nor a range"),
        (["--shifts", "0", "--shift", "2"], "--shift"),
        (["--shifts", "0", "--load-kn", "2"], "--load-kn"),
        (["--shifts", "0", "--loads-kn", "-5"], "load is -5000.0 N"),
    ],
)
def test_command_line_refuses(arguments, message, tmp_path, capsys):
    assert call(["map", *arguments, "--out", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.glob("map*")) == []


# --- stiffness ------------------------------------------------------------------------------------------------------


def test_stiffness_of_a_known_law():
    fit = fit_stiffness([point(load) for load in LOADS])
    assert fit.c1_mm_per_N23 == pytest.approx(K_H ** (-2 / 3), rel=1e-9)
    assert fit.c2_mm_per_N == pytest.approx(2e-8, rel=1e-7)
    assert fit.hertz_c1_mm_per_N23 == pytest.approx(fit.c1_mm_per_N23, rel=1e-9)
    tangent = fit.tangent(100e3)
    hertz = 1.5 * K_H ** (2 / 3) * 100e3 ** (1 / 3)
    assert tangent.hertz_N_per_mm == pytest.approx(hertz)
    assert tangent.contact_N_per_mm == pytest.approx(hertz)
    assert tangent.with_bulk_N_per_mm == pytest.approx(1.0 / (1.0 / hertz + 2e-8))
    assert tangent.error_N_per_mm < 1e-3 * hertz


def test_standard_error_covers_the_scatter():
    rng = np.random.default_rng(1)
    ratios, exact = [], [point(float(load)) for load in np.linspace(10e3, 150e3, 8)]
    for _ in range(200):
        noisy = []
        for p in exact:
            fe = p.comparison.fe
            fe = replace(fe, approach_mm=fe.approach_mm * (1.0 + 1e-3 * rng.standard_normal()))
            noisy.append(replace(p, comparison=replace(p.comparison, fe=fe)))
        fit = fit_stiffness(noisy)
        ratios.append((fit.c1_mm_per_N23 - K_H ** (-2 / 3)) / fit.c1_error)
    # Student's t with six degrees of freedom: standard deviation 1.22
    assert 1.0 < np.std(ratios) < 1.5


def test_stiffness_needs_two_loads():
    assert math.isnan(fit_stiffness([point(1e4), point(1e5)]).c1_error)
    with pytest.raises(InputError, match="at least two"):
        fit_stiffness([point(1e4), point(1e5, status="not converged")])


# --- which loads share meshes ---------------------------------------------------------------------------------------


class FakeMeshes:
    """Meshes that record the loads that are solved on them."""

    made: ClassVar[list["FakeMeshes"]] = []

    def __init__(self, position, *, keep):
        assert keep
        self.position, self.open = position, False
        FakeMeshes.made.append(self)

    def solve(self, position):
        self.open = True
        # one set of factors in memory at a time
        assert [meshes for meshes in FakeMeshes.made if meshes.open] == [self]
        return self, position

    def close(self):
        self.open = False


@pytest.fixture
def meshes(monkeypatch):
    monkeypatch.setattr(FakeMeshes, "made", [])
    monkeypatch.setattr("fecontact.solving.solve.Meshes", FakeMeshes)
    monkeypatch.setattr("fecontact.solving.solve.judge_load", lambda solved_load, placement, theories: solved_load)
    return FakeMeshes.made


def elements_per_semi_axis(solved_load):
    """Elements on the narrowest semi-axis of a load, the smaller number of both directions."""
    on, position = solved_load
    expected = position.expected
    return min(
        axis / size
        for axis, size in zip(
            (expected.semi_axis_x_mm, expected.semi_axis_s_mm), on.position.element_size_mm, strict=True
        )
    )


QUICK = replace(ROUND, resolution="quick")


def test_a_load_of_the_map_is_judged_by_all_theories_and_one_that_is_tried_by_hertz(meshes, monkeypatch):
    theories_asked = []
    monkeypatch.setattr(
        "fecontact.solving.solve.judge_load", lambda solved_load, placement, theories: theories_asked.append(theories)
    )
    sweep = LoadSweep(QUICK, (150e3,))
    sweep.solve(150e3)
    sweep.solve(140e3, refine=False)
    assert [tuple(theories) for theories in theories_asked] == [tuple(THEORIES), (HERTZ,)]


def groups_N(sweep: LoadSweep) -> tuple[float, ...]:
    """Groups of loads with common meshes."""
    return tuple(group.position.case.load_N for group in sweep._groups)


def test_planned_loads_share_meshes_with_enough_elements_for_each(meshes):
    sweep = LoadSweep(QUICK, LOADS)
    for load_N in LOADS:
        assert not sweep.is_ready_for(load_N)
    solved_loads = {150e3: sweep.solve(150e3)}
    # a load asks for elements that grow with its cube root: half as large ones for an eighth of it
    assert [sweep.is_ready_for(load_N) for load_N in LOADS] == [False, True, True, True]
    # loads that were not planned may need other meshes
    assert not sweep.is_ready_for(70e3)
    solved_loads |= {load_N: sweep.solve(load_N) for load_N in (100e3, 50e3, 10e3)}
    assert groups_N(sweep) == (150e3, 10e3)
    assert [sweep.is_ready_for(load_N) for load_N in LOADS] == [True, False, False, False]
    assert [on.open for on in meshes] == [False, True]
    for load_N, solved_load in solved_loads.items():
        assert solved_load[1].case.load_N == load_N
        # on the case's own meshes what it asks for, and 2.7 on the coarser ones
        assert elements_per_semi_axis(solved_load) >= 4.0
        assert elements_per_semi_axis(solved_load) / MESH_RATIO >= 4.0 / 1.5
    # and not many more than the largest needs
    assert elements_per_semi_axis(solved_loads[150e3]) < 1.5 * 4.25
    # the kept meshes serve a load that comes back
    assert sweep.solve(100e3)[0] is meshes[0]
    sweep.close()
    assert not any(on.open for on in meshes)
    assert not sweep.is_ready_for(100e3)


def test_an_unplanned_load_goes_to_the_smallest_meshes_that_have_its_elements(meshes):
    sweep = LoadSweep(QUICK, (50e3, 150e3))
    sweep.solve(150e3)
    on, _ = sweep.solve(70e3)
    assert on is meshes[0]
    assert len(meshes) == 1
    # below all planned ones there are too few elements
    assert elements_per_semi_axis(sweep.solve(20e3)) >= 4.0
    assert groups_N(sweep) == (150e3, 50e3)
    # above all of them the patch is larger
    on, _ = sweep.solve(200e3)
    assert on.position.case.load_N == 200e3


def test_meshes_for_a_load_between_two_planned_ones_serve_all_that_lies_between_them(meshes):
    sweep = LoadSweep(QUICK, (20e3, 50e3, 150e3))
    for load_N in (150e3, 50e3, 20e3):
        sweep.solve(load_N)
    assert groups_N(sweep) == (150e3, 20e3)
    # 30 kN is too small for the first meshes and too large for the second
    solved_loads = [sweep.solve(load_N) for load_N in (30e3, 49e3, 21e3, 35e3, 50e3, 20.1e3)]
    assert groups_N(sweep) == (150e3, 20e3, 50e3)
    assert {on for on, _ in solved_loads} == {meshes[2]}
    assert all(elements_per_semi_axis(solved_load) >= 4.0 for solved_load in solved_loads)
    # those of the load below stay its own, with fewer elements
    assert sweep.solve(20e3)[0] is meshes[1]


def test_meshes_for_a_wide_gap_have_the_elements_of_the_load_that_is_there(meshes):
    """From 10 to 50 kN the elements differ by a factor of 1.7.

    The smallest load would require three times more elements for the largest load.
    """
    sweep = LoadSweep(QUICK, LOADS)
    solved_loads = [sweep.solve(load_N) for load_N in (150e3, 10e3, 30e3, 40e3, 15e3)]
    assert all(elements_per_semi_axis(solved_load) >= 4.0 for solved_load in solved_loads)
    assert groups_N(sweep) == (150e3, 10e3, 50e3, 50e3)
    assert solved_loads[3][0] is meshes[2]


def test_given_element_sizes_are_those_of_all_loads(meshes):
    sweep = LoadSweep(replace(ROUND, resolution=(1.6, 1.2)), LOADS)
    for load_N in (150e3, 100e3, 50e3, 10e3, 30e3):
        assert sweep.solve(load_N)[0].position.element_size_mm == (1.6, 1.2)
    assert groups_N(sweep) == (150e3,)


@dataclass(frozen=True)
class OnePatch:
    """A patch without other patches far from it."""

    parts: tuple[object, ...] = ()


@dataclass(frozen=True, kw_only=True)
class AnyPosition:
    """Element sizes without any condition."""

    case: Case
    element_size_mm: tuple[float, float]
    sizes: tuple[tuple[float, float], ...]
    expected: OnePatch = OnePatch()
    several_loads: bool = False

    placement = None
    clock = Clock(None)

    def for_load(self, load_N):
        size = self.sizes[round(load_N / 10e3) - 1]
        return replace(self, case=replace(self.case, load_N=load_N), element_size_mm=size)


some_loads = st.lists(st.integers(1, 12).map(lambda k: 10e3 * k), min_size=1, max_size=12)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    sizes=st.tuples(*[st.tuples(st.floats(0.2, 2.0), st.floats(0.2, 2.0))] * 12),
    planned=some_loads,
    later_loads=some_loads,
)
def test_every_load_has_the_elements_it_asks_for(meshes, sizes, planned, later_loads):
    """Elements where a second lobe makes a larger load ask for smaller elements."""
    meshes.clear()
    position = AnyPosition(case=ROUND, element_size_mm=(1.0, 1.0), sizes=sizes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fecontact.solving.solve.expect_position", lambda case: position)
        sweep = LoadSweep(ROUND, planned)
    for load_N in [*sorted(set(planned), reverse=True), *later_loads]:
        ready, count = sweep.is_ready_for(load_N), len(meshes)
        opened = [on for on in meshes if on.open]
        on, own_plan = sweep.solve(load_N)
        assert own_plan.case.load_N == load_N <= on.position.case.load_N
        for size_mm, wanted_mm in zip(on.position.element_size_mm, own_plan.element_size_mm, strict=True):
            assert size_mm <= wanted_mm * (1.0 + 1e-9)
        if ready:
            assert len(meshes) == count
            assert opened == [on]
        if load_N in planned and len(meshes) > count:
            # made for it: not much finer than it asks for itself
            assert all(
                wanted_mm <= 1.5 * size_mm * (1.0 + 1e-9)
                for size_mm, wanted_mm in zip(on.position.element_size_mm, own_plan.element_size_mm, strict=True)
            )


def test_a_load_that_cannot_be_expected_says_so_when_it_is_its_turn(meshes, monkeypatch):
    """The failing load may also be the load of the case.

    The smaller loads of the position are still solved.
    """

    def expect_small_loads(case, placement=None):
        if case.load_N > most_N:
            raise InputError(f"the contact of {case.load_N / 1e3:g} kN reaches the end")
        return expect_on_half_space(case, placement)

    monkeypatch.setattr("fecontact.solving.position.expect_on_half_space", expect_small_loads)
    most_N = 120e3
    sweep = LoadSweep(replace(QUICK, load_N=150e3), LOADS)
    assert not sweep.is_ready_for(150e3)
    with pytest.raises(InputError, match="150 kN reaches the end"):
        sweep.solve(150e3)
    assert [sweep.solve(load_N)[1].case.load_N for load_N in (100e3, 50e3)] == [100e3, 50e3]
    assert groups_N(sweep) == (100e3,)
    # no load of it can be solved: what is said is that of the case's own
    most_N = 0.0
    with pytest.raises(InputError, match="150 kN reaches the end"):
        LoadSweep(replace(QUICK, load_N=150e3), LOADS)


def test_a_load_must_be_a_load(meshes):
    with pytest.raises(InputError, match="load is -1"):
        LoadSweep(QUICK).solve(-1.0)


# --- loads on the same meshes ---------------------------------------------------------------------------------------

CYLINDERS = replace(ROUND, resolution="quick")


def check_cylinders(points):
    """Check Hertz's verdict, and a peak that grows with the cube root of the force."""
    assert [p.verdict.answer for p in points] == ["HOLDS"] * len(points)
    p0 = np.array([p.comparison.fe.p_max_MPa for p in points])
    force = np.array([p.normal_force_N for p in points])
    uncertainty = max(p.uncertainty["p_max_MPa"] for p in points)
    scaled = p0 / force ** (1 / 3)
    assert np.ptp(scaled) / scaled.mean() < 2.0 * uncertainty
    # measured 0.2 %
    fit = fit_stiffness(points)
    assert fit.hertz_c1_mm_per_N23 == pytest.approx(fit.c1_mm_per_N23, rel=0.02)


def test_two_loads_on_the_same_meshes():
    # two meshes and no third: at five elements per semi-axis the area is read too coarsely for a limit of 10 %
    case = replace(CYLINDERS, refine="never", criteria=Criteria(area=0.25))
    sweep = LoadSweep(case, (50e3, 100e3))
    points = [sweep.solve(load_N) for load_N in (100e3, 50e3)]
    sweep.close()
    check_cylinders(points)


@pytest.mark.slow
def test_loads_with_refinement():
    loads = (100e3, 50e3, 25e3, 10e3)
    sweep = LoadSweep(CYLINDERS, loads)
    points = [sweep.solve(load) for load in loads]
    # 25 kN has a patch of less than two thirds of the size
    assert groups_N(sweep) == (100e3, 25e3)
    sweep.close()
    check_cylinders(points)


@pytest.mark.slow
def test_loads_between_those_of_a_map_yield_too(tmp_path):
    steel = Material(young_MPa=210e3, poisson=0.3, yield_MPa=400.0, tangent_MPa=4200.0)
    case = Case(lateral_shift_mm=3.0, rail_material=steel, wheel_material=steel)
    map_made = fecontact.map(case, [3.0], [10e3, 60e3], tmp_path, workers=1).made
    (position,) = map_made.positions
    assert position.tried
    for judged_load in (*position.tried, *(cell.judged for cell in position.cells)):
        assert judged_load.plastic is not None
    # yielding takes more of the peak under a larger load: what failed under 60 kN does not hold just below it
    answers = [
        judged_load.verdict.answer for judged_load in sorted(position.tried, key=lambda load_tried: load_tried.load_N)
    ]
    assert position.cells[-1].judged.verdict.answer == "FAILS"
    assert answers[-1] != "HOLDS"
