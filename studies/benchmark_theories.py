"""Cost of a call of each theory of the normal contact, compared with the half-space.

S1002 on 60E1 1:40 at 0.25 mm (two lobes grown together) under 100 kN, gap line in steps of 0.02 mm, which is made
before. CPU time a call under a given force and at a given approach, the best of several rounds, on one thread. The
strips also from a contact under 95 % of the force, as a vehicle code has it from the step before.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python studies/benchmark_theories.py
"""

import time
from collections.abc import Callable
from functools import partial

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import measure_patch
from fecontact.contact_theories.gap_line import GapLine, build_gap_line, solve_under_load
from fecontact.contact_theories.hertz import hertz_ellipse
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.strip_method import StripGap, StripLoad, StripSearch, solve_strips
from fecontact.contact_theories.strips import solve_strip_theory, solve_strip_theory_at_approach
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

CASE = Case(lateral_shift_mm=0.25, roll="touching")
ROUNDS, ROUND_S = 5, 0.1


def milliseconds(call: Callable[[], object]) -> float:
    """CPU milliseconds of a call: the least mean of some rounds."""
    call()
    best = float("inf")
    for _ in range(ROUNDS):
        count, begun = 0, time.process_time()
        while time.process_time() - begun < ROUND_S:
            call()
            count += 1
        best = min(best, (time.process_time() - begun) / count)
    return 1e3 * best


def prepare_warm_strips(line: GapLine, force: float, strips: int) -> Callable[[], object]:
    """The strip method, started from the contact under 95 % of the force."""
    closing, search = 1.0 + 0.0 * line.f_mm, StripSearch(strips=strips)
    gap = StripGap(t=line.surface_mm, f=line.f_mm, A=line.A_per_mm, E=line.contact_modulus_MPa, closing=closing)
    before = solve_strips(gap, StripLoad(force=0.95 * force), search)
    return partial(solve_strips, gap, StripLoad(force=force), search, start=before)


def main() -> None:
    placement = place_case(CASE)
    _, expected = expect_on_half_space(CASE, placement)
    rung = expected.half_space
    force, approach, patch = rung.normal_force_N, rung.approach_mm, measure_patch(rung.pressure)
    line = build_gap_line(placement, contact_modulus_MPa=CASE.contact_modulus_MPa)
    B = float(line.B_per_mm[line.touch])
    theories = {
        **{
            name: (partial(solve_under_load, theory=theory.at_approach), theory.at_approach)
            for name, theory in THEORIES.items()
            if theory.at_approach is not None
        },
        "strip, 50": (partial(solve_strip_theory, strips=50), partial(solve_strip_theory_at_approach, strips=50)),
        "strip, 100": (solve_strip_theory, solve_strip_theory_at_approach),
    }
    print(f"{'':24} {'ms, given force':>16} {'ms, given approach':>19} {'peak off, %':>12}  status")
    hertz = partial(hertz_ellipse, line.A_per_mm, B, normal_force_N=force, contact_modulus_MPa=line.contact_modulus_MPa)
    off = 100.0 * (hertz().p0_MPa / patch.p_max_MPa - 1.0)
    print(f"{'hertz':24} {milliseconds(hertz):16.3f} {'':19} {off:+12.1f}")
    for name, (under_force, at_approach) in theories.items():
        contact = under_force(line, force)
        by_force, by_approach = (
            milliseconds(partial(under_force, line, force)),
            milliseconds(partial(at_approach, line, approach)),
        )
        off = 100.0 * (contact.p_max_MPa / patch.p_max_MPa - 1.0)
        print(f"{name:24} {by_force:16.3f} {by_approach:19.3f} {off:+12.1f}  {contact.status}")
    for strips in (50, 100):
        warm = milliseconds(prepare_warm_strips(line, force, strips))
        print(f"{f'strip, {strips}, step before':24} {warm:16.3f}")
    grid: ContactGrid = rung.grid
    solution_ms = milliseconds(partial(expected.true_gap.solve, grid, CASE.load_N))
    print(f"{f'half_space, {grid.shape[0]} x {grid.shape[1]}':24} {solution_ms:16.3f}")
    total = milliseconds(partial(expect_on_half_space, CASE, placement))
    print(f"{'half_space with its grid':24} {total:16.3f}")


if __name__ == "__main__":
    main()
