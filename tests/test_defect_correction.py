"""A unit response, the model of the contact from it, and a half-space as soft as the elements."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fecontact.bodies import STEEL, combine_moduli_MPa
from fecontact.contact.elements import UnitResponse
from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import build_convolution, build_half_space_problem, love_influence
from fecontact.contact.solver import SLIDING_CORRECTIONS, ContactProblem, solve_by_correction, solve_contact

MODULUS = combine_moduli_MPa(STEEL, STEEL)
LOAD = 20e3
STEP_X, STEP_S = 0.5, 0.4


def problem(*, half: bool, skew: float = 0.0) -> tuple[ContactProblem, ContactGrid]:
    """An elliptic gap with a wave in it, on Love's half-space."""
    nx, ns = (12, 23) if half else (23, 23)
    x = STEP_X * (np.arange(nx) - (0 if half else nx // 2))
    s = STEP_S * (np.arange(ns) - ns // 2)
    gap = x[:, None] ** 2 / 900.0 + s**2 / 500.0 + skew * x[:, None] * s / 900.0 + 0.004 * np.cos(1.3 * s + 0.4)
    area = np.full((nx, ns), STEP_X * STEP_S)
    if half:
        area[1:] *= 2.0
    grid = ContactGrid(x_mm=x, s_mm=s, half=half)
    base = build_half_space_problem(grid, gap.ravel(), contact_modulus_MPa=MODULUS)
    # whole cells at the ends too
    return replace(base, area_mm2=area.ravel()), grid


def bodies_like(base: ContactProblem, grid: ContactGrid, strength: float) -> Callable[[np.ndarray], np.ndarray]:
    """A half-space with the softness of elements under each node.

    Its compliance drifts slowly across the grid.
    """
    nx, ns = grid.shape
    drift = 1.0 + strength * np.sin(np.arange(ns) / ns)[None, :].repeat(nx, axis=0).ravel()
    local = 0.4 * float(base.compliance(_unit(nx * ns, nx * ns // 2)).max())

    def compliance(p: np.ndarray) -> np.ndarray:
        # symmetric in the areas: the drift stands on both sides
        return drift * base.compliance(drift * p) + local * p

    return compliance


def _unit(size: int, at: int) -> np.ndarray:
    unit = np.zeros(size)
    unit[at] = 1.0
    return unit


def counted(compliance: Callable[[np.ndarray], np.ndarray]) -> tuple[Callable[[np.ndarray], np.ndarray], list[int]]:
    """Compliance that counts its calls, and the list with an entry for each call."""
    calls: list[int] = []

    def apply(p: np.ndarray) -> np.ndarray:
        calls.append(1)
        return compliance(p)

    return apply, calls


def test_convolution_is_the_dense_matrix_of_its_kernel():
    nx, ns = 5, 4
    rng = np.random.default_rng(2)
    kernel = rng.uniform(size=(2 * nx - 1, 2 * ns - 1))
    kernel = kernel + kernel[::-1, ::-1]
    i, j = (k.ravel() for k in np.meshgrid(np.arange(nx), np.arange(ns), indexing="ij"))
    dense = kernel[i[:, None] - i + nx - 1, j[:, None] - j + ns - 1]
    p = rng.uniform(-1.0, 1.0, nx * ns)
    apply = build_convolution(kernel[nx - 1 :], (nx, ns), half=False)
    # FFT rounding
    np.testing.assert_allclose(apply(p), dense @ p, atol=1e-13 * np.abs(dense @ p).max())


def test_least_spectrum_makes_a_kernel_positive_definite():
    nx, ns = 6, 5
    x, s = np.arange(nx)[:, None] * STEP_X, np.arange(1 - ns, ns)[None, :] * STEP_S
    kernel = love_influence(x, s, STEP_X, STEP_S)
    kernel[0, ns - 1] *= 0.2
    matrices = [
        np.stack([build_convolution(kernel, (nx, ns), half=False, **k)(_unit(nx * ns, n)) for n in range(30)])
        for k in ({}, {"least_spectrum": 1e-3})
    ]
    lowest = [np.linalg.eigvalsh(0.5 * (m + m.T))[0] for m in matrices]
    assert lowest[0] < 0.0 < lowest[1]


@pytest.mark.parametrize("half", [True, False])
def test_model_of_a_uniform_compliance_is_the_compliance(half):
    base, grid = problem(half=half)
    model = UnitResponse.of(base.compliance, grid, contact_modulus_MPa=MODULUS).model()
    p = np.random.default_rng(1).uniform(size=base.gap_mm.size)
    # FFT rounding; nothing is extrapolated, since the difference to the half-space is zero
    np.testing.assert_allclose(model(p), base.compliance(p), rtol=1e-10)
    solution = solve_by_correction(base, LOAD, model)
    exact = solve_contact(base, LOAD, tolerance=1e-10)
    assert solution.compliance_calls <= 2
    np.testing.assert_allclose(solution.pressure_MPa, exact.pressure_MPa, atol=2e-6 * exact.pressure_MPa.max())


@pytest.mark.parametrize(("half", "skew"), [(True, 0.0), (False, 0.0), (False, 0.6)])
@pytest.mark.parametrize("strength", [0.02, 0.1, 0.4])
def test_correction_gives_the_answer_of_conjugate_gradients(half, skew, strength):
    base, grid = problem(half=half, skew=skew)
    compliance, calls = counted(bodies_like(base, grid, strength))
    full_problem = replace(base, compliance=compliance)
    exact = solve_contact(full_problem, LOAD, tolerance=1e-11)
    plain = len(calls)
    calls.clear()
    model = UnitResponse.of(compliance, grid, contact_modulus_MPa=MODULUS).model()
    solution = solve_by_correction(full_problem, LOAD, model)
    assert solution.status == "converged"
    assert len(calls) == solution.compliance_calls + 1
    assert max(solution.contact_residual, solution.penetration_residual) <= 1e-7
    assert solution.load_balance < 1e-12
    # residuals of 1e-7 of the approach leave a few times that in the pressure
    np.testing.assert_allclose(solution.pressure_MPa, exact.pressure_MPa, atol=2e-6 * exact.pressure_MPa.max())
    assert solution.approach_mm == pytest.approx(exact.approach_mm, rel=1e-6)
    # a drift of 40 % in each factor is far more than bodies have
    assert len(calls) < plain if strength > 0.1 else len(calls) <= 8


@pytest.mark.parametrize("half", [True, False])
@pytest.mark.parametrize(("strength", "largest_count"), [(0.3, 7), (0.8, 10)])
def test_no_pressure_is_left_where_the_last_contact_has_none(half, strength, largest_count):
    """A mixture of contacts reaches as far as its widest contact.

    Pressure left there took up to four more corrections.
    """
    base, grid = problem(half=half)
    full_problem = replace(base, compliance=bodies_like(base, grid, strength))
    model = UnitResponse.of(full_problem.compliance, grid, contact_modulus_MPa=MODULUS).model()
    assert solve_by_correction(full_problem, LOAD, model).compliance_calls <= largest_count


def test_a_useless_model_falls_back_to_conjugate_gradients(monkeypatch):
    base, grid = problem(half=False)
    compliance, calls = counted(bodies_like(base, grid, 0.1))
    full_problem = replace(base, compliance=compliance)
    exact = solve_contact(full_problem, LOAD, tolerance=1e-10)
    calls.clear()
    before: list[int] = []

    def gradients(solved_problem, *arguments, **options):
        if solved_problem is full_problem:
            before.append(len(calls))
        return solve_contact(solved_problem, *arguments, **options)

    monkeypatch.setattr("fecontact.contact.solver.solve_contact", gradients)
    # a Winkler foundation: no node feels another one
    solution = solve_by_correction(full_problem, LOAD, lambda p: 1e-6 * p)
    assert solution.status == "converged"
    # healthy bodies take three to five corrections: after three times as many it is better to begin anew
    assert before == [15]
    assert solution.compliance_calls == len(calls) > 15
    np.testing.assert_allclose(solution.pressure_MPa, exact.pressure_MPa, atol=2e-6 * exact.pressure_MPa.max())


def test_start_does_not_change_the_answer():
    base, grid = problem(half=True)
    full_problem = replace(base, compliance=bodies_like(base, grid, 0.1))
    model = UnitResponse.of(full_problem.compliance, grid, contact_modulus_MPa=MODULUS).model()
    start = np.random.default_rng(5).uniform(size=base.gap_mm.size)
    from_zero, from_start = (
        solve_by_correction(full_problem, LOAD, model),
        solve_by_correction(full_problem, LOAD, model, start_MPa=start),
    )
    np.testing.assert_allclose(
        from_zero.pressure_MPa, from_start.pressure_MPa, atol=2e-6 * from_zero.pressure_MPa.max()
    )


@pytest.mark.parametrize("strength", [0.02, 0.1, 0.4])
def test_a_compliance_that_is_asked_for_roughly_gives_the_same_answer(strength):
    """Each application has a random error up to the permitted error.

    The reported convergence is true of the exact compliance.
    """
    base, grid = problem(half=False, skew=0.6)
    compliance = bodies_like(base, grid, strength)
    random, errors = np.random.default_rng(7), []

    def within(p: np.ndarray, error: float) -> np.ndarray:
        errors.append(error)
        opening = compliance(p)
        return opening + error * opening.max() * random.uniform(-1.0, 1.0, p.size)

    exactly = replace(base, compliance=compliance)
    model = UnitResponse.of(compliance, grid, contact_modulus_MPa=MODULUS).model()
    exact = solve_by_correction(exactly, LOAD, model)
    contact = solve_by_correction(replace(exactly, within=within), LOAD, model)
    assert contact.status == "converged"
    assert errors[0] > 1e-4
    assert errors[-1] == pytest.approx(1e-8)
    assert contact.compliance_calls == len(errors) <= exact.compliance_calls + 2
    opened = base.gap_mm + compliance(contact.pressure_MPa) - contact.approach_mm
    assert np.abs(opened[contact.in_contact]).max() < 1.2e-7 * contact.approach_mm
    np.testing.assert_allclose(contact.pressure_MPa, exact.pressure_MPa, atol=2e-6 * exact.pressure_MPa.max())


def test_bodies_that_slide_end_with_the_gap_after_their_slide():
    """A wheel that slides along the rail by a fraction of the approach.

    The reference is the contact at the final place.
    """
    base, grid = problem(half=True)
    full_problem = replace(base, compliance=bodies_like(base, grid, 0.1))
    model = UnitResponse.of(full_problem.compliance, grid, contact_modulus_MPa=MODULUS).model()
    s = np.tile(grid.s_mm, grid.shape[0])
    approaches = []

    def after(solution) -> np.ndarray:
        approaches.append(5.0 * solution.approach_mm)
        return full_problem.gap_mm - approaches[-1] * s / 250.0

    contact = solve_by_correction(full_problem, LOAD, model, slid=after)
    assert len(approaches) == SLIDING_CORRECTIONS
    assert approaches[-1] == pytest.approx(5.0 * contact.approach_mm, rel=1e-4)
    exact = solve_by_correction(
        replace(full_problem, gap_mm=full_problem.gap_mm - approaches[-1] * s / 250.0), LOAD, model
    )
    assert contact.compliance_calls < SLIDING_CORRECTIONS + exact.compliance_calls
    np.testing.assert_allclose(contact.pressure_MPa, exact.pressure_MPa, atol=2e-6 * exact.pressure_MPa.max())


# --- a half-space as soft as the elements ---------------------------------------------------------------------------


def offsets(grid: ContactGrid) -> tuple[np.ndarray, np.ndarray]:
    """Offsets in nodes at which a kernel of `convolution` is given."""
    rows = 2 * grid.shape[0] - 1 if grid.half else grid.shape[0]
    return np.arange(rows)[:, None], np.arange(1 - grid.shape[1], grid.shape[1])[None, :]


def uniform(kernel: np.ndarray, grid: ContactGrid) -> Callable[[np.ndarray], np.ndarray]:
    return build_convolution(kernel, grid.shape, half=grid.half)


def softness(grid: ContactGrid, amplitude: float, reach: float) -> np.ndarray:
    """Softer under the node and stiffer around it, as elements are, up to `reach` nodes; even."""
    x, s = offsets(grid)
    near = np.hypot(x, s) <= reach
    return np.where(near, amplitude * (1.0 - 0.6 * np.hypot(x, s) + 0.05 * x * s * (not grid.half)), 0.0)


def smooth(grid: ContactGrid, amplitude: float) -> np.ndarray:
    """A quadratic function of the offsets, as bodies of a different shape add."""
    x, s = offsets(grid)
    return amplitude * (0.3 + 4e-4 * x**2 - 7e-4 * s**2 + 2e-4 * x * s * (not grid.half))


@pytest.mark.parametrize("half", [True, False])
def test_elements_that_are_a_half_space_are_that_half_space(half):
    base, grid = problem(half=half)
    elements = UnitResponse.of(base.compliance, grid, contact_modulus_MPa=MODULUS).half_space_of_elements()
    p = np.random.default_rng(3).uniform(size=base.gap_mm.size)
    # FFT rounding
    np.testing.assert_allclose(elements(p), base.compliance(p), rtol=1e-10)


@pytest.mark.parametrize("reach", [0.0, 1.5, 2.3, 3.2])
@pytest.mark.parametrize("half", [True, False])
def test_softness_of_the_elements_is_told_from_the_shape_of_the_bodies(half, reach):
    base, grid = problem(half=half)
    largest = float(base.compliance(_unit(base.gap_mm.size, 0 if half else base.gap_mm.size // 2)).max())
    local, shape = uniform(softness(grid, 0.4 * largest, reach), grid), uniform(smooth(grid, largest), grid)
    p = np.random.default_rng(3).uniform(0.0, 1.0, base.gap_mm.size)

    def bodies(pressure: np.ndarray) -> np.ndarray:
        return base.compliance(pressure) + local(pressure) + shape(pressure)

    elements = UnitResponse.of(bodies, grid, contact_modulus_MPa=MODULUS).half_space_of_elements()
    # what is quadratic is fitted exactly, so that all of it is left: rounding of the fit and of the FFT
    np.testing.assert_allclose(elements(p), base.compliance(p) + local(p), rtol=1e-9)
    added = bodies(p) - elements(p)
    np.testing.assert_allclose(added, shape(p), atol=1e-9 * np.abs(bodies(p)).max())
    # by hand: the moments of the pressure in nodes, both halves of it
    x, s = (line / step for line, step in zip((grid.x_mm, grid.s_mm), (STEP_X, STEP_S), strict=True))
    full_field = p.reshape(grid.shape)
    if half:
        x, full_field = np.concatenate([-x[:0:-1], x]), np.concatenate([full_field[:0:-1], full_field])
    at_x, at_s = grid.x_mm / STEP_X, grid.s_mm / STEP_S
    dx, ds = at_x[:, None] - x, at_s[:, None] - s
    cross = 0.0 if half else 2e-4
    by_hand = largest * (
        0.3 * full_field.sum()
        + 4e-4 * (dx**2 @ full_field.sum(axis=1))[:, None]
        - 7e-4 * (ds**2 @ full_field.sum(axis=0))[None, :]
        + cross * dx @ full_field @ ds.T
    )
    np.testing.assert_allclose(added.reshape(grid.shape), by_hand, atol=1e-9 * np.abs(bodies(p)).max())


@pytest.mark.parametrize("half", [True, False])
def test_a_tail_that_falls_with_the_cube_of_the_distance_is_the_elements(half):
    """The first error of a regular mesh: of degree -3, and symmetric under the mirrors of the mesh."""
    base, grid = problem(half=half)
    largest = float(base.compliance(_unit(base.gap_mm.size, 0 if half else base.gap_mm.size // 2)).max())
    x, s = offsets(grid)
    distance = np.maximum(np.hypot(x * STEP_X, s * STEP_S), min(STEP_X, STEP_S))
    turns = np.arctan2(s * STEP_S, x * STEP_X)
    tail = uniform(1e-2 * largest * (1.0 - 0.5 * np.cos(2 * turns) + 0.3 * np.cos(4 * turns)) / distance**3, grid)
    local, shape = uniform(softness(grid, 0.4 * largest, 2.0), grid), uniform(smooth(grid, largest), grid)
    p = np.random.default_rng(3).uniform(0.0, 1.0, base.gap_mm.size)

    def bodies(pressure: np.ndarray) -> np.ndarray:
        return base.compliance(pressure) + local(pressure) + tail(pressure) + shape(pressure)

    elements = UnitResponse.of(bodies, grid, contact_modulus_MPa=MODULUS).half_space_of_elements()
    # rounding of the fit and of the FFT
    np.testing.assert_allclose(elements(p), base.compliance(p) + local(p) + tail(p), rtol=1e-8)


def test_bodies_answer_alike_on_opposite_sides():
    """A symmetric compliance: all shapes of a response are even."""
    grid = ContactGrid(x_mm=0.1 * np.arange(9.0), s_mm=0.15 * np.arange(9.0), half=False)
    response = UnitResponse(grid=grid, contact_modulus_MPa=MODULUS, node=(4, 4), opening_mm=np.zeros((9, 9)))
    x, s = (axis.ravel() for axis in np.meshgrid(np.arange(-3, 4), np.arange(-3, 4), indexing="ij"))
    for shape, opposite_shape in zip(
        response._shapes(x, s, quartic=True), response._shapes(-x, -s, quartic=True), strict=True
    ):
        np.testing.assert_allclose(shape, opposite_shape, atol=1e-12)
