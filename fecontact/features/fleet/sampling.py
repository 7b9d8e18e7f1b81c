"""Sample of a fleet by finite elements: positions are drawn, solved as a study in `sample/`, and stored.

Every position has a random number from 0 to 1, from the seed and its name. The sample of a stratum is the positions
with the smallest random numbers over their weights, so a larger sample contains each smaller sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.case import Case
from fecontact.errors import InputError, is_usable_status
from fecontact.features.fleet.estimate import allocate_draws, find_draw_scale
from fecontact.features.fleet.model import refuse_wrong_seed
from fecontact.features.fleet.sealed_folder import (
    FLEET_RECORD,
    SAMPLE,
    SAMPLE_FOLDER,
    digest_screen,
    lock_fleet,
    refuse_links,
    write_sample_record,
)
from fecontact.features.fleet.tables import FE_ANSWERS, POSITION_COLUMNS, STRATA, open_tables, query_rows, write_table
from fecontact.files import read_json
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.remaining import Progress
from fecontact.outputs.cases import NO_VERDICT, verdict_of
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import RowMapping
from fecontact.outputs.records.asked import requested_row
from fecontact.runs.casefile import Study
from fecontact.runs.study import StudyOutcome, run_study

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

HOLDS, FAILS, OPEN, UNSOLVED = FE_ANSWERS
"""Answers of finite elements for a drawn position."""
# Shares that hold, assumed before any draw; each has the weight of one draw.
_PRIOR_SHARES = dict(zip(STRATA, (0.98, 0.5, 0.02, 0.02), strict=True))
CaseOf = Callable[[str, str, float, float], Case]
"""Function that makes the case of a wheel, a rail, a shift (mm) and a load (kN)."""


@dataclass(frozen=True, kw_only=True)
class FleetSample:
    """A sample before it is solved.

    Attributes
    ----------
    rows
        A row for each position; positions of earlier draws have their verdicts.
    seed
        Seed of all draws.
    new
        Number of positions without an earlier draw.
    dropped
        Number of positions of an earlier sample of a different population.
    screen
        Digest of the tables from which the positions were drawn.
    """

    rows: Sequence[Record]
    seed: int
    new: int
    dropped: int
    screen: str


def draw_sample(folder: Path, draws: int, seed: int | None = None) -> FleetSample:
    """Draw positions for finite elements, earlier draws included.

    Parameters
    ----------
    folder
        Folder of a screened fleet.
    draws
        Number of positions in all.
    seed
        Seed; by default the seed of earlier draws, or 1.

    Returns
    -------
    FleetSample
        Rows of the positions with stratum, weight and inclusion probability.

    Raises
    ------
    InputError
        If `draws` is less than two, the seed is out of range, earlier draws have a different seed, or a table of the
        fleet was changed.
    """
    if draws < 2:
        raise InputError(
            f"--finite-elements is {draws}; allowed: at least 2; 300 give an interval of about 2 percentage points"
        )
    if seed is not None:
        refuse_wrong_seed(seed)
    with open_tables(folder) as tables:
        screen = digest_screen(read_json(folder / FLEET_RECORD))
        seed = _find_seed(tables, seed)
        rows = select_positions(tables, draws, seed)
        earlier = {_read_position_key(row): row for row in query_rows(tables, "SELECT * FROM sample")}
    draw_number = 1 + max((row["draw"] for row in earlier.values()), default=0)
    # verdicts of earlier draws stay; weights and strata are those of the current screening
    sample_rows = [{"draw": draw_number, "seed": seed} | earlier.get(_read_position_key(row), {}) | row for row in rows]
    reused = sum(_read_position_key(row) in earlier for row in rows)
    return FleetSample(
        rows=sample_rows, seed=seed, new=len(rows) - reused, dropped=len(earlier) - reused, screen=screen
    )


def select_positions(tables: DuckDBPyConnection, draws: int, seed: int) -> list[Record]:
    """Select positions at random, earlier draws included.

    Parameters
    ----------
    tables
        Database with the contacts and their strata in `screen`, and the positions of earlier draws in `drawn`.
    draws
        Number of positions in all.
    seed
        Seed of all draws.

    Returns
    -------
    list of dict
        Place, stratum, weight and inclusion probability of each position.
    """
    counts = _allocate_to_strata(tables, draws)
    tables.execute("CREATE OR REPLACE TEMP TABLE wanted (stratum VARCHAR, draws INTEGER, scale DOUBLE)")
    for name, count in counts.items():
        weights = tables.execute("SELECT weight FROM screen WHERE stratum = ?", [name]).fetchnumpy()["weight"]
        tables.execute("INSERT INTO wanted VALUES (?, ?, ?)", [name, count, find_draw_scale(weights, count)])
    return query_rows(tables, _SELECTED_POSITIONS, str(seed))


_SELECTED_POSITIONS = f"""
    SELECT {POSITION_COLUMNS}, stratum, weight, least(1.0, scale * weight) AS inclusion_probability
    FROM (SELECT {POSITION_COLUMNS}, stratum, weight, wanted.draws, wanted.scale, row_number() OVER (
              PARTITION BY stratum
              ORDER BY md5_number_lower(concat_ws('|', ?, {POSITION_COLUMNS})) / weight, {POSITION_COLUMNS}) AS place
          FROM screen JOIN wanted USING (stratum))
    WHERE place <= draws ORDER BY {POSITION_COLUMNS}"""


def _read_position_key(row: Mapping[str, Any]) -> tuple[Any, ...]:
    """Wheel, rail, shift (mm) and load (kN) of a row."""
    return tuple(row[name] for name in POSITION_COLUMNS.split(", "))


def _find_seed(tables: DuckDBPyConnection, asked_for: int | None) -> int:
    """Seed of all draws of a sample; raises InputError if earlier draws have a different seed."""
    earlier_seeds = [row["seed"] for row in query_rows(tables, "SELECT DISTINCT seed FROM sample")]
    if earlier_seeds and asked_for not in (None, *earlier_seeds):
        raise InputError(
            f"--seed is {asked_for}; earlier draws of this sample have seed {earlier_seeds[0]}; leave out --seed"
        )
    return int(earlier_seeds[0]) if earlier_seeds else 1 if asked_for is None else asked_for


def _allocate_to_strata(tables: DuckDBPyConnection, draws: int) -> dict[str, int]:
    """Number of draws of each stratum, from the shares of earlier draws.

    `draws` is the number in all, with earlier draws. The share that holds is estimated with an assumed share of the
    stratum that counts as a single draw.
    """
    strata = query_rows(
        tables,
        "SELECT stratum, sum(weight) AS weight, count(*) AS positions, (SELECT count(*) FROM drawn WHERE"
        " drawn.stratum = screen.stratum) AS drawn, (SELECT count(*) FROM drawn WHERE drawn.stratum = screen.stratum"
        f" AND fe_verdict = '{HOLDS}') AS holds FROM screen GROUP BY stratum ORDER BY stratum",
    )
    shares = np.array(
        [(stratum["holds"] + _PRIOR_SHARES[stratum["stratum"]]) / (stratum["drawn"] + 1.0) for stratum in strata]
    )
    weights = np.array([stratum["weight"] for stratum in strata])
    positions, drawn_counts = (np.array([stratum[name] for stratum in strata]) for name in ("positions", "drawn"))
    counts = allocate_draws(weights, shares, positions, drawn_counts, draws)
    return {stratum["stratum"]: int(count) for stratum, count in zip(strata, counts, strict=True)}


def solve_sample(
    folder: Path, sample: FleetSample, case_of: CaseOf, settings: RunSettings, progress: Progress | None = None
) -> StudyOutcome:
    """Solve the drawn positions that are not solved, and write `sample.parquet`.

    The positions are solved as a study in `sample/`. The file is written when all are solved: an interrupted sample is
    drawn again in the same way, and finished positions are reused.

    Parameters
    ----------
    folder
        Folder of a screened fleet.
    sample
        Positions of the sample.
    case_of
        Function that makes the case of a position.
    settings
        Workers and scheduler.
    progress
        Progress of the study.

    Returns
    -------
    StudyOutcome
        Rows of the solved positions.
    """
    refuse_links(folder)
    study = Study(name="sample", cases=make_cases(sample, case_of))
    outcome = run_study(study, folder / SAMPLE_FOLDER, settings=settings, progress=progress)
    rows = [row | _make_sample_columns(solved_row) for row, solved_row in zip(sample.rows, outcome.rows, strict=True)]
    with lock_fleet(folder):
        # a command that ends between both files leaves the earlier sample with its checksum
        write_table(
            rows, folder / SAMPLE, lambda table: write_sample_record(folder, table, sample.screen, keep_earlier=True)
        )
        write_sample_record(folder, folder / SAMPLE, sample.screen, keep_earlier=False)
    return outcome


def make_cases(sample: FleetSample, case_of: CaseOf) -> tuple[Case, ...]:
    """Cases of drawn positions."""
    return tuple(case_of(*_read_position_key(row)) for row in sample.rows)


def _make_sample_columns(row: RowMapping) -> Record:
    """Columns of a solved case in the sample: verdict, status, cause, folder, CPU time, and deviations of Hertz.

    A certain failure counts although the finite elements must not be used; then the deviations are None.
    """
    row = requested_row(row)
    answer = verdict_of(row)
    verdict = UNSOLVED if answer == NO_VERDICT else answer if answer in (HOLDS, FAILS) else OPEN
    deviations = {
        f"fe_{name.removeprefix('hertz_deviation_')}": value if is_usable_status(row) else None
        for name, value in row.items()
        if name.startswith("hertz_deviation_")
    }
    columns = {"fe_verdict": verdict, "fe_status": row["status"], "fe_cause": row.get("verdict_cause")}
    return columns | {"fe_case": row["id"], "fe_cpu_seconds": row.get("cpu_seconds")} | deviations
