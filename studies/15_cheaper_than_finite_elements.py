"""If not Hertz, what? Cheap theories of the normal contact on S1002 and four rails, and what each costs.

60E1 1:40 and 1:20, 60E2 1:40 and 54E1 1:40; the left wheel of a wheelset that rolls until both wheels touch, -6 to
6 mm, 10 to 150 kN.

Reference: the true gap on a half-space, solved by FFT on 16 nodes a semi-axis, on planes of their own where patches
are apart: it has the same mechanics as these theories, so that what is left is theirs. Expected: the strip method
within 5 % of the peak and 10 % of area and half-widths at every position and load where it does not say that it is out
of its range, which is 2 % of them at most; Kik-Piotrowski 6 to 11 % too low in the peak even where Hertz holds; STRIPES
and ANALYN good in area, too high in the peak where the curvature rises inside the patch.

`python studies/15_cheaper_than_finite_elements.py [--quick]` makes the comparison with the half-space (minutes) and
writes `half_space.csv`; `fecontact run` of this file has each theory judged by finite elements at a position of each
kind: where Hertz holds, where two lobes have grown together, and where two patches share the load.

Found: strips have their largest deviation on 54E1 at 5 mm, where two patches in separate planes share the load (b -12
%). The shape correction of Kik-Piotrowski changes its deviations to 8.6 % (peak) and 6.1 % (area); with the correction
it holds nowhere. Against finite elements, 50 kN at -4, 0.25 and 5 mm, strips and half-space hold at all three positions
(peaks within 0.3 and 0.9 %). ANALYN holds at two positions; at 5 mm it is out of its range. STRIPES, KPEC, springs and
the equivalent ellipse hold at the first position, as Hertz does; Kik-Piotrowski holds at no position. Springs are
unresolved at 5 mm.

Springs at all contact points were judged against the half-space in 49 contacts with two contact points (four rails, 20
and 100 kN). They hold in 6 contacts in which the single ellipse fails; in 9 contacts their peak has a larger deviation
than the peak of the single ellipse. The springs misplace 2 to 8 % of the load. If they were moved together to the
common centre of pressure, as the single ellipse is, they would misplace 12 to 38 %: load fractions with errors of 2 to
6 % would move each ellipse away from its patch. Moving each ellipse to its patch would change no verdict.
"""

import argparse
import csv
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.contact.patch import measure_patch
from fecontact.contact_theories.gap_line import GapLine, StripContact, solve_under_load
from fecontact.contact_theories.kik_piotrowski import solve_kik_piotrowski
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, LoadedPlacement
from fecontact.contact_theories.registry import THEORIES as JUDGED_THEORIES
from fecontact.contact_theories.strips import build_gap_line_under_load, solve_strip_theory
from fecontact.errors import ConvergenceError, InputError
from fecontact.inputs.texts import parse_inclination
from fecontact.regression.checks import Check
from fecontact.solving.alone import HALF_SPACE, compute_normal_force
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

PAIRS = (("60E1", "1:40"), ("60E1", "1:20"), ("60E2", "1:40"), ("54E1", "1:40"))
SHIFTS_MM = tuple(np.arange(-6.0, 6.5, 1.0))
# Where Hertz holds, where two lobes have grown together, and where two patches share the load.
JUDGED_MM = (-4.0, 0.25, 5.0)
LOADS_KN = (10.0, 25.0, 50.0, 100.0, 150.0)
# at an approach
BY_APPROACH = {name: theory.at_approach for name, theory in JUDGED_THEORIES.items() if theory.at_approach is not None}
BY_APPROACH["kik_piotrowski, L/W"] = partial(solve_kik_piotrowski, shape_correction=True)
ORDER = ("equivalent_ellipse", "analyn", "stripes", "kik_piotrowski", "kik_piotrowski, L/W", "kpec")
THEORIES: dict[str, Callable[[GapLine, float], StripContact]] = {
    **{name: partial(solve_under_load, theory=BY_APPROACH[name]) for name in ORDER},
    "strip": solve_strip_theory,
}
ALL = tuple(name for name in JUDGED_THEORIES if name != HERTZ_GAUGE)
WORDS = {name: JUDGED_THEORIES[name].words for name in ALL}
LIMITS_PERCENT = {"p_max_MPa": 5.0, "area_mm2": 10.0, "a_mm": 10.0, "b_mm": 10.0}


def cases(quick: bool = False) -> list[Case]:
    """Positions of each kind on all pairs under two loads.

    In quick size, the positions of 60E1 1:40 under one load.
    """
    pairs, loads = (PAIRS[:1], (50.0,)) if quick else (PAIRS, (50.0, 100.0))
    positions = [_case(*pair, shift, load) for pair, shift, load in product(pairs, JUDGED_MM, loads)]
    return [replace(case, refine="never") for case in positions] if quick else positions


def _case(rail: str, inclination: str, shift_mm: float, load_kN: float) -> Case:
    return Case(
        rail=rail,
        inclination_rad=parse_inclination(inclination),
        lateral_shift_mm=float(shift_mm),
        load_N=1e3 * load_kN,
        roll="touching",
    )


def survey(positions: Iterable[Case]) -> list[dict[str, Any]]:
    """Deviations of each theory from the half-space in %, with status and milliseconds.

    There is a row for each theory at each case. A case that cannot be placed or solved has one row with the reason.
    """
    rows: list[dict[str, Any]] = []
    for case in positions:
        place = {"rail": case.rail, "inclination": f"1:{1.0 / np.tan(case.inclination_rad):.0f}"}
        place |= {"lateral_shift_mm": case.lateral_shift_mm, "load_kN": 1e-3 * case.load_N}
        try:
            placement = place_case(case)
            begun = time.process_time()
            _, expected = expect_on_half_space(case, placement)
        except (InputError, ConvergenceError) as error:
            rows.append(place | {"theory": "half_space", "status": str(error)})
            continue
        seconds, rung = time.process_time() - begun, expected.half_space
        patch, force = measure_patch(rung.pressure), rung.normal_force_N
        reference = {name: float(getattr(patch, name)) for name in LIMITS_PERCENT} | {"approach_mm": rung.approach_mm}
        rows.append(place | reference | {"theory": "half_space", "status": "solved", "ms": 1e3 * seconds})
        line = build_gap_line_under_load(placement, force, contact_modulus_MPa=case.contact_modulus_MPa)
        rows += [place | _theory_row(name, line, force, reference) for name in THEORIES]
    return rows


def _theory_row(name: str, line: GapLine, force: float, reference: dict[str, float]) -> dict[str, Any]:
    begun = time.process_time()
    contact = THEORIES[name](line, force)
    seconds = time.process_time() - begun
    deviations = {
        measure: 100.0 * (float(getattr(contact, measure)) / value - 1.0) for measure, value in reference.items()
    }
    return {"theory": name, "status": contact.status, "solutions": contact.solutions, "ms": 1e3 * seconds} | {
        f"{measure}_deviation_percent": value for measure, value in deviations.items()
    }


def holds(row: dict[str, Any]) -> bool:
    """Whether a row of a theory is within all limits."""
    return all(abs(row[f"{name}_deviation_percent"]) <= limit for name, limit in LIMITS_PERCENT.items())


def describe_survey(rows: list[dict[str, Any]]) -> str:
    """Table of the theories: answered shares, verdicts, deviations and cost.

    Each theory has a line with the share of contacts that it answers, the share in which it holds, its median and worst
    deviations, and its milliseconds.
    """
    solved_rows = [row for row in rows if row["theory"] == "half_space" and row["status"] == "solved"]
    unsolved_rows = [row for row in rows if row["theory"] == "half_space" and row["status"] != "solved"]
    lines = [
        f"{len(solved_rows)} positions and loads, {len(unsolved_rows)} without a contact on the half-space"
        f" ({np.median([row['ms'] for row in solved_rows]):.0f} ms each)",
        f"{'theory':20} {'speaks':>7} {'holds':>7} {'median and worst |deviation| where it speaks, %':^60} {'ms':>6}",
    ]
    for name in THEORIES:
        theory_rows = [row for row in rows if row["theory"] == name]
        speaking = [row for row in theory_rows if row["status"] == "solved"]
        if not speaking:
            lines.append(f"{name:20} {'0 %':>7}")
            continue
        parts = []
        for measure in LIMITS_PERCENT:
            deviations = np.abs([row[f"{measure}_deviation_percent"] for row in speaking])
            parts.append(f"{measure.split('_m')[0]} {np.median(deviations):.2f} {deviations.max():.1f}")
        good = sum(holds(row) for row in speaking)
        lines.append(
            f"{name:20} {100.0 * len(speaking) / len(theory_rows):5.1f} % {100.0 * good / len(speaking):5.1f} %"
            f" {', '.join(parts):60} {np.median([row['ms'] for row in theory_rows]):6.1f}"
        )
    return "\n".join(lines)


def describe_largest_deviations(rows: list[dict[str, Any]], theory: str, count: int = 5) -> str:
    """Positions with the largest deviations of a theory relative to the limits.

    Only positions that the theory answers are compared.
    """

    def over(row: dict[str, Any]) -> float:
        return max(abs(row[f"{name}_deviation_percent"]) / limit for name, limit in LIMITS_PERCENT.items())

    worst_rows = sorted((row for row in rows if row["theory"] == theory and row["status"] == "solved"), key=over)[
        -count:
    ]
    return "\n".join(
        f"{row['rail']} {row['inclination']} {row['lateral_shift_mm']:+5.1f} mm {row['load_kN']:5.0f} kN: "
        + ", ".join(f"{name.split('_m')[0]} {row[f'{name}_deviation_percent']:+.2f} %" for name in LIMITS_PERCENT)
        for row in reversed(worst_rows)
    )


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Judgement of each theory by finite elements and by the half-space, and its cost.

    The figure is cost.png.
    """
    positions = [
        _case(row["rail"], inclination_of(row), float(row["lateral_shift_mm"]), float(row["load_kN"])) for row in rows
    ]
    judgements = judged(rows)
    _figure(judgements, costs_ms(positions), len(rows), out / "cost.png")
    return f"{describe_judgements(judgements, rows)}\n{describe_survey(survey(positions))}"


def inclination_of(row: dict[str, Any]) -> str:
    """Inclination of the rail in a row as text, such as 1:40."""
    return f"1:{1.0 / np.tan(float(row['inclination_rad'])):.0f}"


@dataclass(frozen=True, kw_only=True)
class TheoryJudgement:
    """Verdicts, limit utilisations and peak deviations (%) of a theory by finite elements.

    Each has an entry per row. Where a theory is undefined, Hertz is shown. Where a theory is undefined, Hertz is shown.
    """

    verdicts: tuple[str, ...]
    limit_utilisation: tuple[float, ...]
    p_max_percent: tuple[float, ...]

    @property
    def holds(self) -> int:
        """Number of rows in which the theory holds."""
        return self.verdicts.count("HOLDS")


def judged(rows: list[dict[str, Any]]) -> dict[str, TheoryJudgement]:
    """Each theory of the pressure by its name, from the cheapest."""
    judgements = {}
    for name in ALL:
        columns = [_columns(row, name) for row in rows]
        verdicts, utilisations, peaks = zip(*columns, strict=True)
        judgements[name] = TheoryJudgement(verdicts=verdicts, limit_utilisation=utilisations, p_max_percent=peaks)
    return judgements


def _columns(row: dict[str, Any], name: str) -> tuple[str, float, float]:
    # where a theory is undefined it is Hertz
    shown_name = name if row.get(f"{name}_verdict_answer") else HERTZ
    keys = ("verdict_answer", "limit_utilisation", "deviation_p_max_percent")
    verdict, utilisation, peak = (row[f"{shown_name}_{key}"] for key in keys)
    return str(verdict), float(utilisation), float(peak)


def describe_judgements(judgements: dict[str, TheoryJudgement], rows: list[dict[str, Any]]) -> str:
    """Numbers of verdicts and largest peak deviation of each theory.

    For each theory: in how many rows it is the cheapest that holds, in how many it holds, in how many it fails.
    """
    first = [str(row["cheapest_theory"]) for row in rows]
    lines = [f"Judged by finite elements, {len(rows)} positions and loads:"]
    for name, judgement in judgements.items():
        lines.append(
            f"{WORDS[name]}: cheapest that holds in {first.count(name)}, holds in {judgement.holds}, fails in"
            f" {judgement.verdicts.count('FAILS')}; peak off by at most {max(map(abs, judgement.p_max_percent)):.1f} %"
        )
    enough = next((name for name, judgement in judgements.items() if judgement.holds == len(rows)), None)
    lines.append(f"The cheapest that holds in all of them: {WORDS[enough]}" if enough else "None holds in all of them")
    return "\n".join(lines)


def costs_ms(positions: list[Case]) -> dict[str, float]:
    """Median CPU milliseconds of each theory at some cases.

    The gap line is made before.
    """
    times_ms: dict[str, list[float]] = {}
    for case in positions:
        placement = place_case(case)
        loaded = LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
        for name in ALL:
            if name == HALF_SPACE:
                call: Callable[[], object] = partial(expect_on_half_space, case, placement)
            else:
                call = partial(JUDGED_THEORIES[name].approximate, loaded)
                call()
            begun = time.process_time()
            call()
            times_ms.setdefault(name, []).append(1e3 * (time.process_time() - begun))
    return {name: float(np.median(times)) for name, times in times_ms.items()}


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Strips against the half-space under the force of the finite elements.

    At 259 positions and loads they are within 1.6 % of the peak and 3.2 % of the area.
    """
    return [
        Check(
            quantity=f"{measure} of the strip method, %",
            case=f"{row['rail']} {inclination_of(row)}, {row['lateral_shift_mm']:g} mm, {row['load_kN']:g} kN",
            reference="true gap on the half-space",
            kind="analytic",
            value=100.0
            * (_ratio_to_elements(row, "strip", measure) / _ratio_to_elements(row, HALF_SPACE, measure) - 1.0),
            expected=None,
            limit_percent=limit,
        )
        for row in rows
        for measure, limit in (("p_max", 2.0), ("area", 4.0))
    ]


def _ratio_to_elements(row: dict[str, Any], name: str, measure: str) -> float:
    return 1.0 + 0.01 * float(row[f"{name}_deviation_{measure}_percent"])


def _figure(judgements: dict[str, TheoryJudgement], costs: dict[str, float], count: int, path: Path) -> None:
    """Largest part of a limit over the cost of a call: median, and from best to worst."""
    from fecontact.outputs.style import (
        SERIES_COLOURS,
        SERIES_MARKS,
        add_grid,
        add_legend_beside,
        blank_figure,
        save_figure,
        set_plain_log_scale,
    )

    figure = blank_figure(9.0, 5.0)
    ax = figure.add_subplot()
    for number, (name, judgement) in enumerate(judgements.items()):
        # after the last colour, the colours repeat with different marks
        colour, mark = (
            SERIES_COLOURS[number % len(SERIES_COLOURS)],
            SERIES_MARKS[(number + number // len(SERIES_COLOURS)) % len(SERIES_MARKS)],
        )
        cost, utilisations = costs[name], np.array(judgement.limit_utilisation)
        ax.plot([cost, cost], [utilisations.min(), utilisations.max()], color=colour, lw=1.0)
        label = f"{WORDS[name]}: holds in {judgement.holds} of {count}"
        ax.plot(cost, np.median(utilisations), ls="none", marker=mark, color=colour, ms=8, label=label)
    ax.axhline(1.0, color="0.3", lw=0.9, ls="--")
    ax.set(xlabel="ms a call (numpy, one thread)", ylabel="largest part of a limit that it uses")
    set_plain_log_scale(ax)
    add_grid(ax)
    add_legend_beside(ax)
    ax.set_title("Cheap theories against finite elements: median, best and worst; off above 1", fontsize=10)
    save_figure(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("out/15_cheaper_than_finite_elements"))
    options = parser.parse_args()
    shifts, loads = ((-4.0, 0.0, 5.0), (50.0,)) if options.quick else (SHIFTS_MM, LOADS_KN)
    rows = survey(_case(*pair, shift, load) for pair, shift, load in product(PAIRS, shifts, loads))
    options.out.mkdir(parents=True, exist_ok=True)
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with (options.out / "half_space.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
    print(describe_survey(rows))
    print(f"strip, furthest off:\n{describe_largest_deviations(rows, 'strip')}")


if __name__ == "__main__":
    main()
