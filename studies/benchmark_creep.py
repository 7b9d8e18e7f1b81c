"""CPU time and deviation of each creep theory.

One ellipse (a 5.8 mm, b 8.5 mm, 100 kN, friction 0.3) at a longitudinal creepage, a lateral one and spin together: CPU
time a call, the best of several rounds, on one thread. FASTSIM on 20 x 20 cells is what vehicle codes call thousands of
times a second. The distance is that of the force as a vector from the rolling half-space of most cells, in % of mu N.

    OMP_NUM_THREADS=1 python studies/benchmark_creep.py
"""

import time
from collections.abc import Callable
from functools import partial

from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
from fecontact.contact_theories.rolling.fastsim import fastsim
from fecontact.errors import InputError
from fecontact.features.creep.forces import (
    CREEP_THEORIES,
    calculate_creep_force,
    calculate_force_difference,
    make_ellipse_patch,
)
from fecontact.features.creep.steady import discretise_ellipse, solve_steady_rolling

CONTACT = RollingEllipse(a_mm=5.8, b_mm=8.5, normal_force_N=100e3, friction=0.3, shear_MPa=80_769.0, poisson=0.3)
MOTION = Creepages(xi=8e-4, eta=4e-4, spin_per_mm=1e-4)
WITHOUT_SPIN = Creepages(xi=8e-4, eta=4e-4)
CELLS = (24, 48, 96)
ROUND_S = 0.3


def seconds(call: Callable[[], object]) -> float:
    """CPU seconds of a call: the least mean of three rounds."""
    call()
    best = float("inf")
    for _ in range(3):
        count, begun = 0, time.process_time()
        while time.process_time() - begun < ROUND_S:
            call()
            count += 1
        best = min(best, (time.process_time() - begun) / count)
    return best


def solve_half_space(motion: Creepages, cells: int):
    """Force of the rolling half-space with `cells` cells along and across."""
    contact = discretise_ellipse(CONTACT.a_mm, CONTACT.b_mm, CONTACT.normal_force_N, cells)
    return solve_steady_rolling(contact, motion, CONTACT).force


def main() -> None:
    patch = make_ellipse_patch(CONTACT)
    print("theory                       ms a call   off the exact force, % of mu N")
    for motion, words in ((WITHOUT_SPIN, "without spin"), (MOTION, "with spin")):
        exact = solve_half_space(motion, CELLS[-1])
        calls: dict[str, Callable[[], object]] = {
            theory: partial(calculate_creep_force, theory, patch, motion)
            for theory in CREEP_THEORIES
            if theory != "rolling_half_space"
        }
        for n in (10, 20, 50):
            calls[f"fastsim, ellipse, {n} x {n}"] = partial(fastsim, CONTACT, motion, cells=(n, n))
        for n in CELLS:
            calls[f"rolling half-space, {n}"] = partial(solve_half_space, motion, n)
        print(words)
        for name, call in calls.items():
            try:
                off = 1e2 * calculate_force_difference(call(), exact, CONTACT.limit_N)
            except InputError:
                continue
            print(f"{name:<27} {1e3 * seconds(call):10.3f} {off:10.2f}")


if __name__ == "__main__":
    main()
