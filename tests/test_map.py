"""Loads with the factors reused, contact stiffness, the applicability map with its limits, and its files."""

import csv
import json
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from fecontact.case import Case, Criteria
from fecontact.cli import call
from fecontact.comparison.measures import MEASURES, Measures, deviations
from fecontact.comparison.verdict import Judgement, judge
from fecontact.errors import InputError
from fecontact.inputs.texts import parse_numbers
from fecontact.jobs.provenance import json_digest
from fecontact.map import making as applicability_map
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.map.inference import Inferred, infer_loads, predict
from fecontact.map.load_limit import load_limit
from fecontact.map.making import make_map, solve_position
from fecontact.outputs.map import cell_row, map_figure, map_record, map_table, write_map
from fecontact.runs.map_store import kept_positions, write_position
from fecontact.solving.load_sweep import LoadPoint, LoadSweep, solve_loads
from fecontact.solving.stiffness_fit import fit_stiffness

K_H = 3.0e6
LOADS = (10e3, 50e3, 100e3, 150e3)


def point(load_N: float, deviation: float = 0.0, uncertainty: float = 0.001, status: str = "converged") -> LoadPoint:
    """A point whose peak pressure deviates by a given part."""
    measures = Measures(**dict.fromkeys(MEASURES, 1.0))
    measures = replace(measures, approach_mm=(load_N / K_H) ** (2 / 3) + 2e-8 * load_N)
    deviations = dict.fromkeys(MEASURES, 0.0) | {"p_max_MPa": deviation}
    unsure = dict.fromkeys(MEASURES, uncertainty)
    verdict = judge(deviations, unsure, Criteria())
    if status != "converged":
        verdict = Judgement(verdict="UNRESOLVED", measure=verdict.measure)
    return LoadPoint(
        load_N=load_N,
        status=status,
        fe=measures,
        hertz=measures,
        deviation=deviations,
        uncertainty=unsure,
        verdict=verdict,
        cause=None if verdict.verdict == "HOLDS" else "second patch",
        normal_force_N=load_N,
        half_space_p_max_MPa=1.0,
        hertz_stiffness_N_per_mm15=K_H,
        pieces=1,
        meshes=2,
    )


def limit_of(deviation, loads=LOADS, **options):
    """Limit of a deviation that depends on the load."""
    made = [point(load, deviation(load), **options) for load in loads]
    cells = [MapCell(shift_mm=0.0, load_N=p.load_N, status=p.status, point=p) for p in made]
    return load_limit(Case(), cells, lambda load: point(load, deviation(load), **options))


def test_limit_is_bisected_to_two_percent():
    limit = limit_of(lambda load: 0.05 * load / 66e3)
    assert 0.97 * 66e3 < limit.F_max_N <= 66e3
    assert limit.holds_N <= limit.F_max_N < 66e3 < limit.fails_N
    assert limit.reason is None
    assert limit.tried


def test_limit_with_a_band_of_unresolved_loads():
    limit = limit_of(lambda load: 0.10 * load / 150e3, uncertainty=0.005)
    assert 0.97 * 75e3 < limit.F_max_N <= 75e3
    assert limit.holds_N < 67.5e3
    assert limit.fails_N > 82.5e3
    assert "unresolved between" in limit.note


@pytest.mark.parametrize(
    ("deviation", "options", "reason"),
    [
        (lambda load: 0.0, {}, "holds at all loads"),
        (lambda load: 0.2, {}, "fails at all loads"),
        (lambda load: 0.05, {}, "unresolved at all loads"),
        (lambda load: 0.05 if load > 120e3 else 0.0, {}, "holds at all loads that are resolved"),
        (lambda load: 0.2 if load < 60e3 else 0.0, {}, "fails at small loads and holds above"),
        (lambda load: 0.2, {"status": "not converged"}, "no load could be solved"),
    ],
)
def test_no_limit_says_why(deviation, options, reason):
    limit = limit_of(deviation, **options)
    assert limit.F_max_N is None
    assert limit.reason == reason


def test_limit_that_is_not_monotone_is_the_first_failure():
    limit = limit_of(lambda load: 0.2 if 70e3 < load < 120e3 else 0.0)
    assert 0.97 * 70e3 < limit.F_max_N <= 70e3
    assert "not monotone: fails at 100 kN but holds at 150 kN" in limit.note


def test_bisection_that_cannot_go_on_keeps_its_bracket():
    cells = [MapCell(shift_mm=0.0, load_N=f, status="converged", point=point(f, d)) for f, d in ((1e4, 0), (9e4, 0.2))]

    def broken(load_N):
        raise InputError("no memory")

    limit = load_limit(Case(), cells, broken)
    assert (limit.F_max_N, limit.fails_N) == (1e4, 9e4)
    assert "no memory" in limit.note


class FakeSweep:
    """Deviates with load and shift; one position cannot be placed, one load not solved, one not used."""

    open = 0
    solved: ClassVar[list[float]] = []

    def __init__(self, case, step):
        if case.lateral_shift_mm > 3.5:
            raise InputError("the wheel is off the rail")
        self.shift = case.lateral_shift_mm
        FakeSweep.open += 1
        step("mesh")

    def solve(self, load_N):
        FakeSweep.solved.append(self.shift)
        if self.shift == 3.0 and load_N > 140e3:
            raise InputError("the contact reaches the end")
        status = "not converged" if self.shift == -2.0 and load_N < 20e3 else "converged"
        return point(load_N, 0.02 * (2.0 + self.shift) * load_N / 100e3, uncertainty=0.003, status=status)

    def close(self):
        FakeSweep.open -= 1


def fake_map(**options):
    return make_map(Case(), [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0], LOADS, sweep=FakeSweep, **options)


def test_map_has_a_cell_for_every_position_and_load():
    seen, heard = [], []
    made = fake_map(on_position=lambda _, m: seen.append(m), progress=lambda *args: heard.append(args))
    assert [(c.shift_mm, c.load_N) for c in made.cells] == [(s, f) for s in made.shifts_mm for f in LOADS]
    assert [len(part.cells) for part in seen] == [len(LOADS) * k for k in range(1, 8)]
    assert heard[0] == (0, 7, "-2.00 mm: mesh")
    assert FakeSweep.open == 0
    assert not made.all_solved
    assert all(cell.solved for cell in made.cells)


def test_map_says_what_could_not_be_solved():
    made = fake_map()
    assert {c.status for c in made.cells if c.shift_mm == 4.0} == {"failed: the wheel is off the rail"}
    assert made.limits[-1].reason == "failed: the wheel is off the rail"
    assert [c.status for c in made.cells if c.shift_mm == 3.0][-1] == "failed: the contact reaches the end"
    assert made.limits[2].F_max_N == pytest.approx(125e3, rel=0.03)


def test_map_needs_positions_and_loads():
    with pytest.raises(InputError, match="at least one"):
        make_map(Case(), [], LOADS, sweep=FakeSweep)


def test_map_files(tmp_path):
    made = fake_map()
    write_map(made, tmp_path)
    with (tmp_path / "map.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(made.cells)
    assert rows[-1]["verdict"] == "failed"
    assert rows[-1]["p_max_deviation_percent"] == ""
    assert float(rows[9]["p_max_deviation_percent"]) == pytest.approx(2.0)
    record = json.loads((tmp_path / "map.json").read_text("utf-8"))
    assert record["schema"] == "fecontact/map/1"
    assert record["criteria"] == {"p_max": 0.05, "area": 0.10}
    assert len(record["cells"]) == len(rows)
    assert record["limits"][2]["F_max_N"] == made.limits[2].F_max_N
    assert record["versions"]["fecontact"]
    assert "load_N" not in record["case"]
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_stiffness_of_each_position_over_its_loads(tmp_path):
    made = fake_map()
    write_map(made, tmp_path)
    with (tmp_path / "stiffness.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
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
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["stiffness"][0]["load_kN"] == 50.0


def test_map_of_one_cell_is_drawn(tmp_path):
    made = make_map(Case(), [0.0], [100e3], sweep=FakeSweep)
    assert map_figure(made, tmp_path / "one.png").stat().st_size > 0
    assert map_record(made)["limits"][0]["reason"] == "holds at all loads"
    assert cell_row(made.cells[0])["verdict"] == "HOLDS"


def test_map_table_has_a_line_for_each_position():
    lines = map_table(fake_map()).splitlines()
    assert len(lines) == 9
    assert "no limit: holds at all loads" in lines[2]
    assert "holds up to" in lines[4]
    assert "failed: the wheel is off the rail" in lines[7]


# --- positions solved elsewhere, and before -------------------------------------------------------------------------


def fake_position(case, loads):
    if case.lateral_shift_mm == 1.0:
        raise RuntimeError("a fault\nof the program")
    return solve_position(case, loads, sweep=FakeSweep)


def test_positions_solved_by_an_executor_are_those_solved_here(monkeypatch):
    monkeypatch.setattr(applicability_map, "solve_position", fake_position)
    seen, heard = [], []
    with ThreadPoolExecutor(3) as executor:
        made = make_map(
            Case(),
            [3.0, -2.0, 0.0, 1.0],
            LOADS,
            executor=executor,
            workers=1,
            progress=lambda done, count, what: heard.append(what),
            on_position=lambda _, m: seen.append(m.shifts_mm),
        )
    monkeypatch.undo()
    alone = make_map(Case(), [3.0, -2.0, 0.0, 1.0], LOADS, sweep=FakeSweep)
    # in the order of the shifts, whichever is finished first
    assert made.shifts_mm == (-2.0, 0.0, 1.0, 3.0)
    assert all(shifts == tuple(sorted(shifts)) for shifts in seen)
    assert len(seen) == 4
    # a pool of processes calls what it has fetched in advance running as well
    assert heard
    assert all(what.count("mm") == 1 and "," not in what for what in heard)
    for got, expected in zip(map_record(made)["cells"], map_record(alone)["cells"], strict=True):
        if got["lateral_shift_mm"] == 1.0:
            assert got["status"] == "failed: RuntimeError: a fault of the program"
        else:
            assert got == expected


def test_a_position_short_of_memory_is_solved_again_alone(monkeypatch):
    order = []

    def hungry(case, loads):
        order.append(case.lateral_shift_mm)
        if case.lateral_shift_mm == 0.0 and order.count(0.0) == 1:
            raise InputError("the factor needs about 4.5 GB of memory, 1.2 GB are available")
        return solve_position(case, loads, sweep=FakeSweep)

    def hungry_position(case, loads):
        try:
            return hungry(case, loads)
        except InputError as error:
            cells = tuple(MapCell(shift_mm=0.0, load_N=f, status=f"failed: {error}", point=None) for f in loads)
            return MapPosition(shift_mm=0.0, cells=cells, limit=LoadLimit(reason="failed"))

    monkeypatch.setattr(applicability_map, "solve_position", hungry_position)
    with ThreadPoolExecutor(2) as executor:
        made = make_map(Case(), [-1.0, 0.0, 1.0], LOADS, executor=executor)
    assert order.count(0.0) == 2
    assert order[-1] == 0.0
    assert made.shifts_mm == (-1.0, 0.0, 1.0)
    assert made.all_solved


def keep_all(made, out):
    for position in made.positions:
        write_position(position, out, made.case, made.loads_N)


def test_finished_positions_are_taken_from_their_files(tmp_path):
    made = fake_map()
    keep_all(made, tmp_path)
    kept = kept_positions(tmp_path, Case(), made.shifts_mm, LOADS)
    assert kept.problems == ()
    # positions with a load that failed or did not converge are tried again
    assert [p.shift_mm for p in kept.positions] == [-1.0, 0.0, 1.0, 2.0]
    FakeSweep.solved = []
    again = fake_map(done=kept.positions)
    assert map_record(again) == map_record(made)
    assert set(FakeSweep.solved) == {-2.0, 3.0}


def test_a_value_that_was_no_number_is_read_as_one(tmp_path):
    made = fake_map()
    cell = made.positions[2].cells[0]
    blank = replace(cell.point, fe=replace(cell.point.fe, a_mm=math.nan))
    position = replace(made.positions[2], cells=(replace(cell, point=blank), *made.positions[2].cells[1:]))
    write_position(position, tmp_path, Case(), LOADS)
    (kept,) = kept_positions(tmp_path, Case(), made.shifts_mm, LOADS).positions
    assert math.isnan(kept.cells[0].point.fe.a_mm)


def test_positions_of_other_inputs_or_loads_stay_beside_each_other(tmp_path):
    made = fake_map()
    others = [(Case(wheel="cylinder:460"), LOADS), (Case(criteria=Criteria(p_max=0.1)), LOADS), (Case(), LOADS[1:])]
    keep_all(made, tmp_path)
    for case, loads in others:
        kept = kept_positions(tmp_path, case, made.shifts_mm, loads)
        assert kept.positions == kept.problems == ()
        write_position(made.positions[2], tmp_path, case, loads)
    assert len(kept_positions(tmp_path, Case(), made.shifts_mm, LOADS).positions) == 4
    assert len(list((tmp_path / "positions").iterdir())) == 4 + len(others)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda text: text[:-200], "cannot be read"),
        (lambda text: text.replace("HOLDS", "FAILS", 1), "its checksum differs"),
        (lambda text: text.replace('"sha256"', '"sha"'), "another layout"),
        (lambda text: "[]", "another layout"),
        (lambda text: signed(text, '"measure"', '"mass"'), "another layout"),
        (lambda text: signed(text, '"source of fecontact": "', '"source of fecontact": "x'), "another version"),
    ],
)
def test_a_file_that_cannot_be_used_is_said(damage, says, tmp_path):
    made = fake_map()
    path = write_position(made.positions[2], tmp_path, Case(), LOADS)
    path.write_text(damage(path.read_text("utf-8")), "utf-8")
    kept = kept_positions(tmp_path, Case(), made.shifts_mm, LOADS)
    assert kept.positions == ()
    (problem,) = kept.problems
    assert says in problem
    assert path.name in problem


def signed(text, old, new):
    """The record changed, with the checksum of what it has become."""
    record = json.loads(text.replace(old, new))
    del record["sha256"]
    return json.dumps(record | {"sha256": json_digest(record)})


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
    # a flat wheel over a round head: the same contact at every shift, but for where gmsh puts its nodes (6e-5 seen)
    peaks = [cell["point"]["fe"]["p_max_MPa"] for cell in second["cells"]]
    assert peaks[1] == pytest.approx(peaks[0], rel=2e-4)
    assert "+1.00" in out
    # a map of fewer shifts shows those only, and the others are still there
    assert call([*options, "--shifts", "1"]) == 0
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["cells"] == second["cells"][1:]
    assert len(list((tmp_path / "positions").glob("*.json"))) == 2
    assert call([*options, "--shifts", "0", "--workers", "0"]) == 2


# --- inferred positions -------------------------------------------------------------------------------------------

ROUND = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)


def solved_like(case, load_N, factor, uncertainty=0.01):
    """A point whose finite elements are the half-space's measures times a factor."""
    prediction = predict(replace(case, load_N=load_N))
    fe = replace(
        prediction.half_space,
        p_max_MPa=prediction.half_space.p_max_MPa * factor,
        area_mm2=prediction.half_space.area_mm2 / factor,
    )
    deviation = deviations(prediction.hertz, fe)
    unsure = dict.fromkeys(MEASURES, uncertainty)
    verdict = judge(deviation, unsure, case.criteria)
    return replace(
        point(load_N), fe=fe, hertz=prediction.hertz, deviation=deviation, uncertainty=unsure, verdict=verdict
    )


def inferred(left, right, loads=(50e3, 100e3), uncertainty=0.01):
    cases = [replace(ROUND, lateral_shift_mm=shift) for shift in (-1.0, 1.0)]
    neighbours = [
        {load: solved_like(case, load, factor, uncertainty) for load in loads}
        for case, factor in zip(cases, (left, right), strict=True)
    ]
    return infer_loads(ROUND, loads, neighbours, cases)


def test_what_the_bodies_add_is_taken_from_both_neighbours():
    found = inferred(0.995, 0.985)
    for one in found.values():
        # the half-space itself is Hertz here, to the part of a per cent that its grid leaves
        assert one.deviation["p_max_MPa"] == pytest.approx(1.0 / 0.99 - 1.0, abs=0.003)
        # theirs, how far they are apart, and the grids
        assert one.uncertainty["p_max_MPa"] == pytest.approx(0.01 + 0.01 + 0.003, rel=0.05)
        assert one.verdict.verdict == "HOLDS"


@pytest.mark.parametrize(
    ("left", "right", "uncertainty"),
    [
        (0.99, 0.80, 0.01),  # one holds, the other fails
        (0.96, 0.97, 0.01),  # both hold with certainty, but not with twice what they differ
        (0.99, 0.99, 0.06),  # neighbours that are not sure themselves
    ],
)
def test_a_doubt_is_worth_solving(left, right, uncertainty):
    assert inferred(left, right, uncertainty=uncertainty) is None


def test_a_neighbour_that_failed_is_none():
    good = {1e5: solved_like(ROUND, 1e5, 0.99)}
    cases = [replace(ROUND, lateral_shift_mm=shift) for shift in (-1.0, 1.0)]
    for other in ({1e5: None}, {}, {1e5: replace(good[1e5], status="not converged")}):
        assert infer_loads(ROUND, [1e5], [good, other], cases) is None
    assert infer_loads(ROUND, [1e5], [good, good], cases) is not None


def test_adaptive_map_says_which_cells_were_solved(monkeypatch, tmp_path):
    def only_at_zero(case, loads, neighbours, cases):
        assert [c.lateral_shift_mm for c in cases] == [case.lateral_shift_mm - 1.0, case.lateral_shift_mm + 1.0]
        verdict = Judgement(verdict="HOLDS", measure="p_max_MPa")
        small = {"p_max_MPa": 0.01, "area_mm2": 0.0}
        one = Inferred(deviation=small, uncertainty=small, verdict=verdict)
        return dict.fromkeys(loads, one) if case.lateral_shift_mm == 0.0 else None

    monkeypatch.setattr(applicability_map, "infer_loads", only_at_zero)
    FakeSweep.solved = []
    made = make_map(Case(), [-1.0, 0.0, 1.0, 2.0, 3.0], [50e3, 100e3], sweep=FakeSweep, adaptive=True)
    # every second one, and the one between them that is in doubt
    assert set(FakeSweep.solved) == {-1.0, 1.0, 2.0, 3.0}
    assert [cell.solved for cell in made.cells] == [shift != 0.0 for shift in made.shifts_mm for _ in range(2)]
    assert made.all_solved
    write_map(made, tmp_path)
    with (tmp_path / "map.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["lateral_shift_mm"] == "0.0"]
    assert {(row["solved"], row["status"], row["verdict"]) for row in rows} == {("False", "inferred", "HOLDS")}
    assert all(float(row["p_max_deviation_percent"]) == pytest.approx(1.0) for row in rows)
    assert "inferred" in map_table(made)
    # what was inferred is not taken over: a run that solves all would keep it
    keep_all(made, tmp_path)
    kept = kept_positions(tmp_path, Case(), made.shifts_mm, [50e3, 100e3])
    assert [p.shift_mm for p in kept.positions] == [-1.0, 1.0, 2.0, 3.0]


@pytest.mark.slow
def test_inferred_verdicts_are_those_of_the_finite_elements():
    """S1002 on 60E1: tread positions that hold, and two beside the junction that fail; measured within 0.2 %."""
    base = Case(resolution="quick", refine_degrees_of_freedom=0, criteria=Criteria(area=0.2))
    shifts, loads = [-5.0, -4.5, -4.0, 0.25, 0.5, 0.75], [50e3, 100e3]
    whole = make_map(base, shifts, loads)
    points = {cell.shift_mm: {} for cell in whole.cells}
    for cell in whole.cells:
        points[cell.shift_mm][cell.load_N] = cell.point
    for left, middle, right in (shifts[:3], shifts[3:]):
        cases = [replace(base, lateral_shift_mm=shift) for shift in (left, right)]
        found = infer_loads(replace(base, lateral_shift_mm=middle), loads, [points[left], points[right]], cases)
        for load in loads:
            solved = points[middle][load]
            assert found[load].verdict.verdict == solved.verdict.verdict
            assert abs(found[load].deviation["p_max_MPa"] - solved.deviation["p_max_MPa"]) < 0.01


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
        (["--shifts", "0", "--loads-kn", "-5"], "load is -5000.0 N"),
    ],
)
def test_command_line_refuses(arguments, message, tmp_path, capsys):
    assert call(["map", *arguments, "--out", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err


def test_stiffness_of_a_known_law():
    fit = fit_stiffness([point(load) for load in LOADS])
    assert fit.c1_mm_per_N23 == pytest.approx(K_H ** (-2 / 3), rel=1e-9)
    assert fit.c2_mm_per_N == pytest.approx(2e-8, rel=1e-7)
    assert abs(fit.c1_deviation) < 1e-9
    tangent = fit.tangent(100e3)
    hertz = 1.5 * K_H ** (2 / 3) * 100e3 ** (1 / 3)
    assert tangent.hertz_N_per_mm == pytest.approx(hertz)
    assert tangent.contact_N_per_mm == pytest.approx(hertz)
    assert tangent.with_bulk_N_per_mm == pytest.approx(1.0 / (1.0 / hertz + 2e-8))
    assert tangent.error_N_per_mm < 1e-3 * hertz


def test_standard_error_covers_the_scatter():
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(200):
        noisy = []
        for load in np.linspace(10e3, 150e3, 8):
            p = point(float(load))
            noise = 1.0 + 1e-3 * rng.standard_normal()
            noisy.append(replace(p, fe=replace(p.fe, approach_mm=p.fe.approach_mm * noise)))
        fit = fit_stiffness(noisy)
        ratios.append((fit.c1_mm_per_N23 - K_H ** (-2 / 3)) / fit.c1_error)
    # Student's t with six degrees of freedom: standard deviation 1.22
    assert 1.0 < np.std(ratios) < 1.5


def test_stiffness_needs_two_loads():
    assert math.isnan(fit_stiffness([point(1e4), point(1e5)]).c1_error)
    with pytest.raises(InputError, match="at least two"):
        fit_stiffness([point(1e4), point(1e5, status="not converged")])


CYLINDERS = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick")


def check_cylinders(points):
    assert [p.verdict.verdict for p in points] == ["HOLDS"] * len(points)
    p0 = np.array([p.fe.p_max_MPa for p in points])
    force = np.array([p.normal_force_N for p in points])
    unsure = max(p.uncertainty["p_max_MPa"] for p in points)
    scaled = p0 / force ** (1 / 3)
    assert np.ptp(scaled) / scaled.mean() < 2.0 * unsure
    # measured 0.2 %
    assert abs(fit_stiffness(points).c1_deviation) < 0.02


def test_two_loads_on_the_same_meshes():
    # two meshes and no third: at five elements a semi-axis the area is read too coarsely for a limit of 10 %
    case = replace(CYLINDERS, refine_degrees_of_freedom=0, criteria=Criteria(area=0.25))
    check_cylinders(solve_loads(case, [50e3, 100e3]))


@pytest.mark.slow
def test_loads_with_refinement():
    sweep = LoadSweep(CYLINDERS)
    points = [sweep.solve(load) for load in (100e3, 50e3, 25e3, 10e3)]
    # 10 kN has a patch of less than half the size
    assert sweep.groups_N == (100e3, 10e3)
    sweep.close()
    check_cylinders(points)
