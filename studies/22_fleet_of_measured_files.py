"""Does the interval of a fleet contain the true share of its positions?

A fleet of measured files: four worn wheels and three worn rails of the test bank of CONTACT (`tests/profiles`), with
the wheel of the Manchester Contact Benchmark and 60E1. Each of the five wheels is put on each of the four rails, at -6,
-3, 0, 3 and 6 mm under 60 and 100 kN, with a declared filter of 8 mm: 200 positions. In 16 of them the wheel cannot
stand on the rail. The screen is the strip method.

Reference: finite elements in all 184 contacts, at `quick`, not refined. The share of each answer over all of them is
the true share. Expected: in at least 93 % of 200 random samples of 40 positions the interval for 95 % contains it, for
HOLDS, FAILS, OPEN and UNSOLVED (which has the positions that the screen refuses); no position at which both decide has
different verdicts. The samples are drawn and evaluated by the functions of the program, from the stored solutions
`measured_fleet/positions.csv` (a row per contact).

`python studies/22_fleet_of_measured_files.py --screen` screens the fleet, solves all positions, resumes where it was
stopped, and writes this file. `fecontact run` of this file solves the positions alone; in quick size three of them,
which must have the stored answers.

Found: by the screen Hertz holds in 60 of the contacts and fails in 78; 42 are unresolved and 4 refused. Screen and
finite elements have equal verdicts at all 138 positions that both decide, and finite elements cannot solve the refused
positions either. Of the unresolved positions they decide 12: 6 of the 11 that the accuracy of the screen leaves
unresolved, and 6 of the 31 that noise leaves unresolved. The interval contains the true share in the following part of
the samples: HOLDS 99.5 %, FAILS 98.5 %, OPEN 99 %, UNSOLVED 100 %. Half of its length is 12, 13 and 12 percentage
points for HOLDS, FAILS and OPEN in the mean. It is longer than necessary, because the screen is right more often than a
small sample can prove. A position took about 2.5 CPU s.
"""

import argparse
import csv
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.features.fleet.checking import open_fleet
from fecontact.features.fleet.estimate import Share, Stratum, estimate_share
from fecontact.features.fleet.packages import import_duckdb
from fecontact.features.fleet.running import run_fleet
from fecontact.features.fleet.sampling import FAILS, HOLDS, OPEN, UNSOLVED, draw_sample, select_positions, solve_sample
from fecontact.features.fleet.tables import FE_ANSWERS, POSITION_COLUMNS, STRATA, open_tables, query_rows
from fecontact.files import write_text
from fecontact.inputs.texts import parse_inclination
from fecontact.jobs.engine import RunSettings
from fecontact.outputs.cases import verdict_of
from fecontact.outputs.tables import write_csv
from fecontact.profiles.reading import Reading
from fecontact.regression.checks import Check

POSITIONS = Path(__file__).parent / "measured_fleet" / "positions.csv"
MEASURED = Path(__file__).parents[1] / "tests" / "profiles"
FILTER_MM = 8.0
WHEELS = {
    "Car7422": "Car7422_0001r.whl",
    "Car7813": "Car7813_0001r.whl",
    "whl288": "whl_left_iter288.whl",
    "worn_hm": "worn_high_mileage.prw",
    "S1002": "MBench_S1002",
}
RAILS = {
    "avg_low2": "avg_low2.ban",
    "rail288": "rail_left_iter288.ban",
    "site_b": "site_b_hr.prr",
    "60E1": "60E1",
}
# Both are suspicious: avg_low2 ends 11.8 mm below its highest point, and the gauge is measured at 14 mm; rail288 has a
# dent at y = 29.8 mm, which worn_hm touches beside its contact point at 27 mm. Screen and elements see the same.
ACCEPTED = ("avg_low2", "rail288")
# Of the rails of the library; the measured rails are inclined in their files.
INCLINATION = "1:40"
SHIFTS_MM = (-6.0, -3.0, 0.0, 3.0, 6.0)
LOADS_KN = (60.0, 100.0)
SAMPLES, DRAWN = 200, 40
LEAST_COVERED_PERCENT = 93.0
# The first position of each answer that finite elements give in few seconds.
QUICK = (
    ("S1002", "site_b", 0.0, 60.0),
    ("S1002", "60E1", 0.0, 60.0),
    ("Car7422", "site_b", -6.0, 60.0),
)
# Largest difference of Hertz's peak deviation from the stored one, in percentage points. A load solved alone has
# different meshes from two loads that share them: 0.011 was measured.
SAME_PERCENT = 0.02
_FLEET = """theory = "strip"
filter_mm = {filter_mm}

[wheels]
files = "wheels.csv"

[rails]
files = "rails.csv"

[shifts_mm]
values = {shifts}

[loads_kN]
values = {loads}

[case]
refine = "never"
"""


# --- The positions.


@dataclass(frozen=True, kw_only=True)
class SolvedPosition:
    """A contact of the fleet with its screen verdict and its answer by finite elements."""

    wheel: str
    rail: str
    shift_mm: float
    load_kN: float
    weight: float
    stratum: str
    verdict: str
    open_because: str
    p_max_percent: float
    fe_verdict: str
    fe_p_max_percent: float

    @property
    def place(self) -> tuple[str, str, float, float]:
        """Wheel, rail, shift (mm) and load (kN)."""
        return self.wheel, self.rail, self.shift_mm, self.load_kN

    @property
    def case(self) -> Case:
        """The position as a case for finite elements, as the fleet makes it."""
        specs = {"wheel": WHEELS[self.wheel], "rail": RAILS[self.rail]}
        files = {body: str(MEASURED / spec) for body, spec in specs.items() if (MEASURED / spec).exists()}
        readings = {
            "wheel": Reading(tape_circle_mm=70.0, filter_mm=FILTER_MM),
            "rail": Reading(mirror=False if self.rail in ACCEPTED else None, filter_mm=FILTER_MM),
        }
        return Case(
            **{**specs, **files},
            **{f"{body}_file": readings[body] if body in files else Reading() for body in specs},
            inclination_rad=0.0 if "rail" in files else parse_inclination(INCLINATION),
            lateral_shift_mm=self.shift_mm,
            load_N=1e3 * self.load_kN,
            refine="never",
        )


@cache
def positions() -> tuple[SolvedPosition, ...]:
    """All contacts of the fleet with their answers."""
    kinds = SolvedPosition.__annotations__
    with POSITIONS.open(encoding="utf-8", newline="") as file:
        return tuple(
            SolvedPosition(
                **{name: float(text or "nan") if kinds[name] is float else text for name, text in row.items()}
            )
            for row in csv.DictReader(file)
        )


def cases(quick: bool = False) -> list[Case]:
    """All positions that finite elements can be asked for, in quick size three of them."""
    return [
        position.case
        for position in positions()
        if (position.place in QUICK if quick else position.fe_verdict != UNSOLVED)
    ]


# --- The samples.


def true_share(answer: str) -> float:
    """Share of the weight of all contacts with an answer of finite elements."""
    return sum(position.weight for position in positions() if position.fe_verdict == answer)


@cache
def draw_intervals(samples: int = SAMPLES, draws: int = DRAWN) -> dict[str, tuple[Share, ...]]:
    """Share of each answer with its interval, by each sample.

    The seeds of the samples are 1, 2, 3 and so on.
    """
    by_place = {position.place: position for position in positions()}
    columns = ("wheel", "rail", "shift_mm", "load_kN", "weight", "stratum")
    intervals: dict[str, list[Share]] = {answer: [] for answer in FE_ANSWERS}
    with import_duckdb().connect() as tables:
        tables.execute(
            "CREATE TABLE screen (wheel TEXT, rail TEXT, shift_mm DOUBLE, load_kN DOUBLE, weight DOUBLE, stratum TEXT)"
        )
        tables.execute("CREATE TABLE drawn (stratum TEXT, fe_verdict TEXT)")
        rows = [[getattr(position, name) for name in columns] for position in positions()]
        tables.executemany("INSERT INTO screen VALUES (?, ?, ?, ?, ?, ?)", rows)
        for seed in range(1, samples + 1):
            strata = _make_strata(by_place, select_positions(tables, draws, seed))
            for answer in FE_ANSWERS:
                intervals[answer].append(estimate_share(strata, {answer}))
    return {answer: tuple(shares) for answer, shares in intervals.items()}


def _make_strata(
    by_place: Mapping[tuple[Any, ...], SolvedPosition], sample_rows: Sequence[Mapping[str, Any]]
) -> list[Stratum]:
    """Strata of the fleet with the stored answers of a sample."""
    strata = []
    for name in STRATA:
        members = [position for position in by_place.values() if position.stratum == name]
        rows = [row for row in sample_rows if row["stratum"] == name]
        answers = [by_place[tuple(row[column] for column in POSITION_COLUMNS.split(", "))].fe_verdict for row in rows]
        if members:
            strata.append(
                Stratum(
                    name=name,
                    weight=sum(position.weight for position in members),
                    positions=len(members),
                    guess=float(np.mean([position.verdict == HOLDS for position in members])),
                    answers=np.array(answers),
                    weights=np.array([row["weight"] for row in rows]),
                    inclusion=np.array([row["inclusion_probability"] for row in rows]),
                )
            )
    return strata


def covered_share(answer: str) -> float:
    """Part of the samples with the true share of an answer in their interval."""
    share_of_all = true_share(answer)
    # the limit of a share that no draw has is exactly 0
    return float(
        np.mean([share.low - 1e-12 <= share_of_all <= share.high + 1e-12 for share in draw_intervals()[answer]])
    )


def confusion() -> Counter[tuple[str, str]]:
    """Numbers of positions by the verdict of the screen and the answer of finite elements."""
    return Counter((position.verdict, position.fe_verdict) for position in positions())


def contradictions() -> list[SolvedPosition]:
    """Positions at which screen and finite elements decide differently."""
    return [position for position in positions() if {position.verdict, position.fe_verdict} == {HOLDS, FAILS}]


# --- Checks.


def match_rows(rows: Iterable[Mapping[str, Any]]) -> list[tuple[SolvedPosition, Mapping[str, Any]]]:
    """Converged rows with their stored positions."""
    matched_rows = []
    by_case = {
        _key(position.case.wheel, position.case.rail, position.shift_mm, position.load_kN): position
        for position in positions()
    }
    for row in rows:
        if row["status"] == "converged":
            numbers = (float(row[name]) for name in ("lateral_shift_mm", "load_kN"))
            matched_rows.append((by_case[_key(str(row["wheel"]), str(row["rail"]), *numbers)], row))
    return matched_rows


def _key(wheel: str, rail: str, shift_mm: float, load_kN: float) -> tuple[str, str, float, float]:
    """Place of a position, with the names of files as in tables of results."""
    return Path(wheel).name.partition("@")[0], Path(rail).name.partition("@")[0], round(shift_mm, 6), round(load_kN, 6)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the coverage, of contradictions, and of the stored answers."""
    size = f"{SAMPLES} samples of {DRAWN} of {len(positions())} positions"
    decided = sum(count for verdicts, count in confusion().items() if {*verdicts} <= {HOLDS, FAILS})
    study_checks = [
        Check(
            quantity=f"part of the intervals of {answer} that contain the true share",
            case=size,
            reference="finite elements in all positions",
            kind="invariant",
            value=covered_share(answer),
            expected=1.0,
            # shares are ratios of counts: a share equal to the limit passes
            limit_percent=100.0 - LEAST_COVERED_PERCENT + 1e-9,
        )
        for answer in FE_ANSWERS
    ]
    study_checks.append(
        Check(
            quantity="part of the verdicts that are the same",
            case=f"{decided} positions that both decide",
            reference="finite elements",
            kind="invariant",
            value=1.0 - len(contradictions()) / decided,
            expected=1.0,
            limit_percent=1e-9,
        )
    )
    for position, row in match_rows(rows):
        case = f"{position.wheel} on {position.rail}, {position.shift_mm:g} mm, {position.load_kN:g} kN"
        answer = verdict_of(row)
        study_checks.append(
            Check(
                quantity="verdict as stored (1)",
                case=case,
                reference="measured_fleet/positions.csv",
                kind="invariant",
                value=float((OPEN if answer == "UNRESOLVED" else answer) == position.fe_verdict),
                expected=1.0,
                limit_percent=1e-9,
            )
        )
        study_checks.append(
            Check(
                quantity="Hertz's peak deviation minus the stored one, %",
                case=case,
                reference="measured_fleet/positions.csv",
                kind="invariant",
                value=float(row["hertz_deviation_p_max_percent"]) - position.fe_p_max_percent,
                expected=None,
                limit_percent=SAME_PERCENT,
            )
        )
    return study_checks


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Coverage of the intervals, and agreement of screen and finite elements."""
    covered = ", ".join(f"{answer} {1e2 * covered_share(answer):.1f} %" for answer in FE_ANSWERS)
    counts = confusion()
    agreed = sum(counts[verdict, verdict] for verdict in (HOLDS, FAILS))
    return (
        f"Of {SAMPLES} samples of {DRAWN} of {len(positions())} positions, the interval contains the true share of"
        f" {covered}. Screen and finite elements agree in {agreed} of {agreed + len(contradictions())} positions that"
        f" both decide."
    )


# --- Making it.


def write_fleet(out: Path) -> Path:
    """Write the file of the fleet and its tables of wheels and rails."""
    tables = {
        "wheels": [
            {"file": _path(spec), "name": name, "tape_circle_mm": 70.0 if _path(spec) != spec else None}
            for name, spec in WHEELS.items()
        ],
        "rails": [
            {
                "file": _path(spec),
                "name": name,
                "inclination": "none" if _path(spec) != spec else INCLINATION,
                "accepted": "yes" if name in ACCEPTED else None,
            }
            for name, spec in RAILS.items()
        ],
    }
    for name, rows in tables.items():
        write_csv(rows, out / f"{name}.csv")
    text = _FLEET.format(filter_mm=FILTER_MM, shifts=list(SHIFTS_MM), loads=list(LOADS_KN))
    return write_text(out / "fleet.toml", text)


def _path(spec: str) -> str:
    """Path of a measured file; a name of the library is unchanged."""
    path = MEASURED / spec
    return str(path) if path.exists() else spec


def make(out: Path, workers: int) -> None:
    """Screen the fleet and solve all of its contacts.

    Finished results are reused.
    """
    settings, folder = RunSettings(workers=workers), out / "results"
    run_fleet(write_fleet(out), folder, settings=settings)
    # more draws than positions: the sample has all of them
    everything = len(WHEELS) * len(RAILS) * len(SHIFTS_MM) * len(LOADS_KN)
    solve_sample(folder, draw_sample(folder, everything), open_fleet(folder).case, settings)


def collect(folder: Path) -> None:
    """Write the answers of a solved fleet to `measured_fleet/positions.csv`."""
    names = ", ".join(SolvedPosition.__annotations__)
    with open_tables(folder) as tables:
        sample = f"SELECT {POSITION_COLUMNS}, fe_verdict, fe_p_max_percent FROM sample"
        write_csv(
            query_rows(tables, f"SELECT {names} FROM screen JOIN ({sample}) USING ({POSITION_COLUMNS}) ORDER BY ALL"),
            POSITIONS,
        )


def main() -> None:
    from fecontact.cli import run_script

    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--screen", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("out/22_fleet_of_measured_files"))
    parser.add_argument("--workers", type=int, default=2)
    options, _ = parser.parse_known_args()
    if options.screen:
        make(options.out, options.workers)
        collect(options.out / "results")
    else:
        run_script(__file__)


if __name__ == "__main__":
    main()
