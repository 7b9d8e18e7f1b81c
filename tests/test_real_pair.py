"""Real profiles: where Hertz holds and where it fails, both solver paths, and another code's pressures."""

import math
import sys
import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from points import simpack
from scipy.optimize import brentq

from fecontact.bodies import Material, combine_moduli_MPa
from fecontact.case import BodySize, Case
from fecontact.contact.halfspace import build_half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.linear_solver import is_pardiso_available
from fecontact.judging.measures import Measures, read_measures
from fecontact.outputs.records.results import case_row
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.writers import sample_points
from fecontact.solving.expected_patch import find_expected_patch
from fecontact.solving.fine_zone import make_fine_zone
from fecontact.solving.meshes import couple_bodies, make_coupled_problem
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space, expect_position, make_true_gap
from fecontact.solving.solve import CaseResult, measure_peak_memory_MB, solve

needs_pardiso = pytest.mark.skipif(not is_pardiso_available(), reason="MKL PARDISO is not installed on this platform")


# No refinement beyond the named sizes: the refinement steps depend on the speed of the machine.
FIXED = {"refine": "never"}


def check_balance(result: CaseResult) -> None:
    """Force balance and status of the fine pressure, on the true surface."""
    assert result.status == "converged"
    rung = result.load.fe
    assert rung.load_balance < 1e-8
    _, normals = result.placement.surface(rung.grid.x_mm[:, None], rung.grid.s_mm[None, :])
    force = rung.grid.whole_area_mm2().reshape(rung.grid.shape) * rung.pressure_MPa
    direction = np.array([0.0, 0.0, 1.0]) if result.case.load_kind == "vertical" else result.placement.first.normal
    assert float((force * (normals @ direction)).sum()) == pytest.approx(result.case.load_N, rel=1e-8)
    along_normal = float((force * (normals @ result.placement.first.normal)).sum())
    assert result.normal_force_N == pytest.approx(along_normal, rel=1e-12)
    assert result.hertz.normal_force_N == result.normal_force_N


# --- 60E1 1:40, S1002, 100 kN ----------------------------------------------------------------------------------------

# Results of an independent reading of the elements' nodes on finer meshes: shift (mm), answer, deviation of Hertz in
# peak, area, a and b (per cent); centre of pressure over b; valley and misplaced load (per cent). The area at 4 mm is
# from a half-space with 64 nodes per semi-axis, because a thin tail was lost on those nodes (-1.0 %).
FACTS = [
    (-4.0, "HOLDS", -0.3, -2.1, 0.6, -2.5, -0.07, 0.0, 4.8),
    pytest.param(-2.0, "HOLDS", -0.1, -4.8, 1.7, -6.0, -0.11, 0.0, 7.1, marks=pytest.mark.slow),
    # there is a second lobe at 0 mm too
    pytest.param(-1.0, "FAILS", 1.3, -9.4, 5.4, -17.0, -0.19, 15.0, 12.5, marks=pytest.mark.slow),
    (0.0, "FAILS", -21.0, 3.1, 2.6, -11.5, -0.26, 22.0, 15.5),
    (3.0, "FAILS", 1.7, -12.9, 2.2, -9.7, 0.03, 0.0, 5.6),
    # Hertz holds at -4 mm too
    pytest.param(4.0, "HOLDS", 0.0, -2.5, 0.2, -1.4, -0.03, 0.0, 2.9, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("shift", "answer", "p", "area", "a", "b", "centre", "valley", "misplaced"), FACTS)
def test_what_other_readings_say(solved, shift, answer, p, area, a, b, centre, valley, misplaced):
    """At quick, with the default criteria; measured 0.3 in the sizes, 1.2 in the area, 1.3 in the valley at most."""
    result = solved(Case(lateral_shift_mm=shift, roll="given", **FIXED))
    check_balance(result)
    deviation = result.comparison.deviation
    percent = {name: 100.0 * deviation[name] for name in deviation}
    # the independent reading is less accurate in area and valley
    assert percent["p_max_MPa"] == pytest.approx(p, abs=0.5)
    assert percent["area_mm2"] == pytest.approx(area, abs=1.3)
    assert percent["a_mm"] == pytest.approx(a, abs=0.5)
    assert percent["b_mm"] == pytest.approx(b, abs=0.5)
    assert deviation["centre_over_b"] == pytest.approx(centre, abs=0.01)
    assert percent["valley"] == pytest.approx(valley, abs=1.5)
    assert percent["misplaced_load"] == pytest.approx(misplaced, abs=0.5)
    assert deviation["separate_load"] == 0.0
    assert (result.verdict.answer, result.load.solved.levels[0].status) == (answer, "converged")
    assert len(result.comparison.patch.lobes) == (2 if valley else 1)
    # corrections of the calibrated half-space, to residuals of 1e-7 on the elements' nodes: measured 3
    assert result.load.level.nodal.compliance_calls <= 5


@pytest.mark.slow
@pytest.mark.parametrize("load_N", [80e3, 100e3, 150e3])
def test_hertz_fails_between_the_lobes_though_his_peak_is_right(load_N):
    """Position with two equally high lobes, where Hertz's peak is right by chance.

    It is half a millimetre from the centre.
    """
    result = solve(Case(lateral_shift_mm=-0.5, roll="given", load_N=load_N, **FIXED))
    check_balance(result)
    deviation = result.comparison.deviation
    # measured 2.7, 2.5 and 0.5 %
    assert abs(deviation["p_max_MPa"]) < 0.05
    assert result.verdict.answer == "FAILS"
    assert result.verdict.cause == "second lobe"
    assert {"b_mm", "centre_over_b", "valley", "misplaced_load"} <= set(result.verdict.failing)
    # measured 34, 35 and 36 %
    assert deviation["valley"] == pytest.approx(0.35, abs=0.03)
    # for strength alone, Hertz holds
    assert result.verdict.each["p_max_MPa"] == "HOLDS"


def check_corrections(case: Case, placement: Placement, bodies: CoupledBodies, most_calls: int) -> None:
    """Corrections of the calibrated half-space agree with conjugate gradients."""
    problem = make_coupled_problem(make_true_gap(case, placement), bodies)
    solution = problem.solve(100e3)
    exact = solve_contact(problem.bodies, 100e3, start_MPa=solution.pressure_MPa, tolerance=1e-9)
    assert solution.status == exact.status == "converged"
    assert solution.compliance_calls <= most_calls
    difference = np.dot(problem.bodies.area_mm2, np.abs(solution.pressure_MPa - exact.pressure_MPa))
    # residuals of 1e-7 of the approach; the stiff pressures of neighbouring nodes multiply them
    assert difference < 1e-6 * 100e3


@needs_pardiso
@pytest.mark.parametrize(("shift", "most_calls"), [(0.25, 5), pytest.param(6.5, 9, marks=pytest.mark.slow)])
def test_corrections_are_few(shift, most_calls):
    """Beside a junction, and on the gauge corner, where bodies are least like a half-space; measured 4 and 7 calls."""
    position = expect_position(Case(lateral_shift_mm=shift, roll="given"))
    along_x, across = position.element_size_mm
    zone = make_fine_zone(position.expected, (1.5 * along_x, 1.5 * across))
    bodies = couple_bodies(position.case, position.placement, zone, position.clock)
    check_corrections(position.case, position.placement, bodies, most_calls)


@pytest.mark.slow
def test_first_touch_next_to_a_junction():
    # first contact close to the junction R 300 / R 80: the peak of Hertz's narrow ellipse is far too high (by 62 %)
    result = solve(Case(lateral_shift_mm=0.25, roll="given", **FIXED))
    check_balance(result)
    assert result.comparison.deviation["p_max_MPa"] == pytest.approx(0.62, abs=0.03)
    assert result.comparison.overlap < 0.5
    assert result.verdict.answer == "FAILS"


@pytest.mark.slow
@pytest.mark.parametrize(("shift", "answer"), [(-4.0, "HOLDS"), (4.0, "HOLDS"), (0.0, "FAILS"), (0.25, "FAILS")])
def test_named_resolutions_say_the_same(shift, answer):
    quick, standard = (
        solve(Case(lateral_shift_mm=shift, roll="given", resolution=resolution, **FIXED))
        for resolution in ("quick", "standard")
    )
    for result in (quick, standard):
        check_balance(result)
        assert result.verdict.answer == answer
    for name, value in quick.comparison.deviation.items():
        if name in quick.load.uncertainty:
            assert standard.comparison.deviation[name] == pytest.approx(value, abs=quick.load.uncertainty[name])


# --- force and approach of a rung are along the contact normal -------------------------------------------------------


def test_force_and_approach_of_a_rung_on_a_tilted_pair():
    case = Case(lateral_shift_mm=4.0, roll="given")
    placement = place_case(case)
    normal, vertical = placement.first.normal, np.array([0.0, 0.0, 1.0])
    # the load is vertical, the contact is not
    assert normal @ vertical < 0.9995
    rung = expect_on_half_space(case, placement)[1].half_space
    grid, p = rung.grid, rung.pressure_MPa
    assert grid.half
    assert p[-1].max() == p[:, [0, -1]].max() == 0.0
    _, normals = placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])

    def force_along(direction: np.ndarray) -> float:
        """Trapezoidal sums of the pressure over both halves, along a direction."""
        return 2.0 * float(np.trapezoid(np.trapezoid(p * (normals @ direction), grid.s_mm, axis=1), grid.x_mm))

    assert force_along(vertical) == pytest.approx(case.load_N, rel=1e-8)
    assert rung.normal_force_N == pytest.approx(force_along(normal), rel=1e-12)
    # the normals below the patch hardly turn: the force is nearly the load divided by the cosine
    assert rung.normal_force_N == pytest.approx(case.load_N / float(normal @ vertical), rel=1e-3)
    assert rung.normal_force_N > 1.0005 * case.load_N
    # the vertical approach of the bodies closes the gaps of the nodes in contact, each gap along its normal
    problem = build_half_space_problem(
        grid,
        placement.gap(grid.x_mm[:, None], grid.s_mm[None, :]).ravel(),
        contact_modulus_MPa=case.contact_modulus_MPa,
    )
    opened = (problem.gap_mm + problem.compliance(p.ravel())).reshape(grid.shape)
    approach = (opened / (normals @ vertical))[p > 0.0]
    # the solution's tolerance there is 1e-6 of the approach
    np.testing.assert_allclose(approach * (normal @ vertical), rung.approach_mm, rtol=3e-6)


# --- solver paths and symmetry ---------------------------------------------------------------------------------------

COARSE = Case(
    rail="circle:300",
    wheel="cylinder:460",
    inclination_rad=0.0,
    load_N=50e3,
    resolution=(2.0, 1.8),
    **FIXED,
    size=BodySize(rail_depth_mm=25.0, rim_thickness_mm=25.0, half_length_mm=32.0),
)


# displacements of both are compared in test_elasticity, and measures without MKL in test_package
@pytest.mark.slow
@needs_pardiso
def test_both_solver_paths_agree(solved):
    direct, multigrid = solved(COARSE), solve(replace(COARSE, solver="amg"))
    assert (direct.effort.path, multigrid.effort.path) == ("pardiso", "amg")
    np.testing.assert_array_equal(direct.grid.s_mm, multigrid.grid.s_mm)
    # the same iterations on the same problem; multigrid solves to 1e-10 of the load
    np.testing.assert_allclose(multigrid.pressure_MPa, direct.pressure_MPa, atol=1e-6 * direct.pressure_MPa.max())
    for name in ("rail", "wheel"):
        u = direct.bodies.displacement_mm[name]
        np.testing.assert_allclose(multigrid.bodies.displacement_mm[name], u, atol=1e-6 * np.abs(u).max())


def test_a_solve_ends_well_where_no_system_keeps_the_largest_memory(monkeypatch):
    memory_before_MB = measure_peak_memory_MB()
    # as on Windows
    monkeypatch.setitem(sys.modules, "resource", None)
    with pytest.raises(ImportError):
        import_module("resource")
    result = solve(COARSE)
    check_balance(result)
    # the resident memory now: less than its maximum so far, more than Python with NumPy and SciPy alone
    assert result.effort.peak_memory_MB > 50.0
    assert measure_peak_memory_MB() > 50.0
    monkeypatch.undo()
    assert result.effort.peak_memory_MB <= 1.01 * measure_peak_memory_MB()
    assert memory_before_MB <= measure_peak_memory_MB()


def test_the_cpu_time_of_a_solution_is_within_the_time_of_the_process():
    start_s = time.process_time()
    result = solve(COARSE)
    process_s = time.process_time() - start_s
    # placing and imports are not part of the solution
    assert 0.5 * process_s < result.effort.cpu_seconds <= process_s
    assert case_row(result)["cpu_seconds"] == result.effort.cpu_seconds


def test_full_model_without_yaw_is_the_half_model(solved):
    half, full = solved(COARSE), solve(replace(COARSE, yaw_rad=1e-14))
    assert half.load.fe.grid.half
    assert not full.load.fe.grid.half
    check_balance(half)
    check_balance(full)
    np.testing.assert_allclose(full.grid.s_mm, half.grid.s_mm, atol=1e-9)
    p, middle, half_rung = full.pressure_MPa, full.grid.x_mm.size // 2, half.load.fe
    np.testing.assert_allclose(full.grid.x_mm[middle:], half_rung.grid.x_mm, atol=1e-9)
    # a yaw this small does not change the sections: measured 1.6e-5 (on identical meshes 1e-7, see test_mortar)
    np.testing.assert_allclose(p, p[::-1], atol=1e-7 * p.max())
    np.testing.assert_allclose(p[middle:], half_rung.pressure_MPa, atol=3e-5 * p.max())
    assert full.comparison.fe.approach_mm == pytest.approx(half.comparison.fe.approach_mm, rel=1e-7)


# --- Manchester Contact Benchmark ------------------------------------------------------------------------------------

# Case, solved by CONTACT 25: wheel, shift to the right (mm), yaw (mrad), normal force (N), peak pressure (MPa),
# approach (um). S1002 on the UIC60 of the benchmark, G 82 GPa, nu 0.28, 10 kN on each wheel.
MANCHESTER = [
    ("left", 0.0, 0.0, 9997.0, 338.3, 15.96),
    ("left", 1.0, 2.4, 10050.0, 423.9, 19.46),
    ("left", 2.0, 4.8, 10040.0, 465.9, 20.54),
    ("left", 3.0, 7.2, 10030.0, 498.8, 21.28),
    ("left", 4.0, 9.6, 10030.0, 527.2, 21.85),
    ("right", 1.0, 2.4, 9827.0, 741.3, 24.48),
    ("right", 2.0, 4.8, 9799.0, 744.8, 24.80),
    ("right", 3.0, 7.2, 9774.0, 713.2, 24.39),
    ("right", 4.0, 9.6, 9745.0, 664.4, 23.70),
]
BENCHMARK_STEEL = Material.from_shear(shear_MPa=82e3, poisson=0.28)


def manchester_case(wheel: str, shift: float, yaw_mrad: float, force: float, **changes: object) -> Case:
    """Case of a single wheel of the rolled wheelset; the right wheel is mirrored."""

    def case_of_wheel(sign: float, roll: float) -> Case:
        """Case of the left (+1) or right (-1) wheel at a roll (rad)."""
        return Case(
            rail="MBench_UIC60",
            wheel="S1002",
            lateral_shift_mm=sign * shift,
            roll_rad=-sign * roll,
            yaw_rad=-sign * 1e-3 * yaw_mrad,
            load_N=force,
            load_kind="normal",
            rail_material=BENCHMARK_STEEL,
            wheel_material=BENCHMARK_STEEL,
            **FIXED,
            **changes,
        )

    def step(roll: float) -> float:
        left, right = (place_case(case_of_wheel(sign, roll)).wheel.centre_mm[2] for sign in (-1.0, 1.0))
        return float(left - right)

    roll = brentq(step, -2e-3, 2e-3, xtol=1e-7) if shift else 0.0
    return case_of_wheel(1.0 if wheel == "right" else -1.0, roll)


def solve_on_half_space(case: Case, placement: Placement) -> Measures:
    # for a normal load, with a separate first guess
    true_gap = make_true_gap(case, placement)
    assert (true_gap.direction == placement.first.normal).all()
    assert true_gap.contact_modulus_MPa == combine_moduli_MPa(BENCHMARK_STEEL, BENCHMARK_STEEL)
    return read_measures(find_expected_patch(true_gap, case.load_N, half=case.half, guess_mm=0.025).half_space)


@pytest.mark.parametrize(("wheel", "shift", "yaw", "force", "peak", "approach"), MANCHESTER)
def test_manchester_on_the_half_space(wheel, shift, yaw, force, peak, approach):
    # the yaw of the file is left out here: it changes the peak by 0.2 % at most
    case = manchester_case(wheel, shift, 0.0, force)
    measures = solve_on_half_space(case, place_case(case))
    # the physics is equal to CONTACT; both are discrete (CONTACT has cells of 0.2 mm): measured 0.2 %
    assert measures.p_max_MPa == pytest.approx(peak, rel=0.005)
    assert measures.approach_mm == pytest.approx(1e-3 * approach, rel=0.005)


def test_manchester_on_the_half_space_with_yaw():
    wheel, shift, yaw, force, peak, approach = MANCHESTER[-1]
    case = manchester_case(wheel, shift, yaw, force)
    measures = solve_on_half_space(case, place_case(case))
    assert measures.p_max_MPa == pytest.approx(peak, rel=0.005)
    assert measures.approach_mm == pytest.approx(1e-3 * approach, rel=0.005)


@pytest.mark.slow
@pytest.mark.parametrize(("wheel", "shift", "yaw", "force", "peak", "approach"), MANCHESTER)
def test_manchester_with_finite_elements(wheel, shift, yaw, force, peak, approach):
    # the yaw of the file, left out, would change the peak by 0.2 % at most
    result = solve(manchester_case(wheel, shift, 0.0, force, resolution="quick"))
    assert result.status == "converged"
    # patches of 2 to 4 mm on heads of 70 mm: the finite bodies change the peak by little
    assert result.comparison.fe.p_max_MPa == pytest.approx(peak, rel=0.02)
    assert math.isclose(result.case.load_N, result.normal_force_N, rel_tol=2e-3)


@pytest.mark.slow
def test_manchester_with_finite_elements_and_yaw():
    wheel, shift, yaw, force, peak, _ = MANCHESTER[-1]
    result = solve(manchester_case(wheel, shift, yaw, force, resolution="quick"))
    assert result.status == "converged"
    assert result.comparison.fe.p_max_MPa == pytest.approx(peak, rel=0.02)


def write_as_simpack(folder: Path) -> dict[str, str]:
    """The benchmark's pair as its files are: points in SIMPACK's form, the rail inclined at 1:40 already."""
    files = {}
    for body, name, ending in (("rail", "MBench_UIC60", ".prr"), ("wheel", "MBench_S1002", ".prw")):
        # 1:40 in rad, with z down
        rotation = {"rotate": -0.024994794} if body == "rail" else {}
        text = simpack(*sample_points(load_library_profile(name), 0.25).T, body, **rotation)
        path = folder / f"{name}{ending}"
        path.write_text(text, "utf-8")
        files[body] = str(path)
    return files


@pytest.mark.parametrize("row", [2, 6])
def test_manchester_from_files_on_the_half_space(tmp_path, row):
    wheel, shift, _, force, peak, approach = MANCHESTER[row]
    exact = manchester_case(wheel, shift, 0.0, force)
    case = replace(exact, **write_as_simpack(tmp_path), inclination_rad=0.0)
    measures, touch = solve_on_half_space(case, place_case(case)), place_case(case).first
    assert touch.wheel_y_mm == pytest.approx(place_case(exact).first.wheel_y_mm, abs=2e-3)
    assert measures.p_max_MPa == pytest.approx(peak, rel=0.005)
    assert measures.approach_mm == pytest.approx(1e-3 * approach, rel=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("row", [2, 6])
def test_manchester_from_files_with_finite_elements(tmp_path, row):
    wheel, shift, _, force, peak, _ = MANCHESTER[row]
    case = manchester_case(wheel, shift, 0.0, force, resolution="quick")
    result = solve(replace(case, **write_as_simpack(tmp_path), inclination_rad=0.0))
    # the limit of studies/06_manchester.py
    assert result.comparison.fe.p_max_MPa == pytest.approx(peak, rel=0.005)
