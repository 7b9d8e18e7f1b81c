"""The sample of a fleet by finite elements: which positions are drawn, solved as a study in `sample/`, and kept.

Every position has a random number from 0 to 1, of the seed and its own name. A stratum's sample is the positions with
the smallest random numbers over their weights, so a larger sample has all of a smaller one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.case import Case
from fecontact.errors import InputError, usable
from fecontact.features.fleet.estimate import allocation, draw_scale
from fecontact.features.fleet.tables import KEYS, SAMPLE, STRATA, asked, opened, write_table
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.remaining import Progress
from fecontact.outputs.cases import NO_VERDICT, verdict_of
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import Row
from fecontact.outputs.records.asked import asked_row
from fecontact.runs.casefile import Study
from fecontact.runs.study import StudyOutcome, run_study

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

HOLDS, FAILS, OPEN, UNSOLVED = "HOLDS", "FAILS", "OPEN", "UNSOLVED"
"""What finite elements say of a drawn position."""
# Shares that hold, before any draw; each counts as much as one draw.
_EXPECTED = dict(zip(STRATA, (0.98, 0.5, 0.02, 0.02), strict=True))
CaseOf = Callable[[str, str, float, float], Case]
"""Makes the case of a wheel, a rail, a shift (mm) and a load (kN)."""


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A sample before it is solved: a row a position, those of earlier draws with their verdicts, and the seed.

    `dropped` are positions of an earlier sample of another population.
    """

    rows: Sequence[Record]
    seed: int
    new: int
    dropped: int


def draw(folder: Path, draws: int, seed: int | None = None) -> Drawn:
    """Draw so many positions in all, those of earlier draws among them.

    Raises
    ------
    InputError
        If fewer than two are asked for, or earlier draws have another seed.
    """
    if draws < 2:
        raise InputError(f"--finite-elements is {draws}; allowed: 2 and more, 300 for an interval of about 2 points")
    with opened(folder) as tables:
        seed = _seed(tables, seed)
        counts = _counts(tables, draws)
        tables.execute("CREATE TABLE wanted (stratum VARCHAR, draws INTEGER, scale DOUBLE)")
        for name, count in counts.items():
            weights = tables.execute("SELECT weight FROM screen WHERE stratum = ?", [name]).fetchnumpy()["weight"]
            tables.execute("INSERT INTO wanted VALUES (?, ?, ?)", [name, count, draw_scale(weights, count)])
        rows = asked(tables, _CHOSEN, str(seed))
        earlier = {_key(row): row for row in asked(tables, "SELECT * FROM sample")}
    number = 1 + max((row["draw"] for row in earlier.values()), default=0)
    # verdicts of earlier draws stay, weights and strata are today's
    found = [{"draw": number, "seed": seed} | earlier.get(_key(row), {}) | row for row in rows]
    kept = sum(_key(row) in earlier for row in rows)
    return Drawn(rows=found, seed=seed, new=len(rows) - kept, dropped=len(earlier) - kept)


_CHOSEN = f"""
    SELECT {KEYS}, stratum, weight, least(1.0, scale * weight) AS inclusion_probability
    FROM (SELECT {KEYS}, stratum, weight, wanted.draws, wanted.scale, row_number() OVER (
              PARTITION BY stratum
              ORDER BY md5_number_lower(concat_ws('|', ?, {KEYS})) / weight, {KEYS}) AS place
          FROM screen JOIN wanted USING (stratum))
    WHERE place <= draws ORDER BY {KEYS}"""


def _key(row: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(row[name] for name in KEYS.split(", "))


def _seed(tables: DuckDBPyConnection, asked_for: int | None) -> int:
    """The seed of all draws of a sample."""
    earlier = [row["seed"] for row in asked(tables, "SELECT DISTINCT seed FROM sample")]
    if earlier and asked_for not in (None, *earlier):
        raise InputError(f"--seed is {asked_for}; earlier draws of this sample have {earlier[0]}; leave it out")
    return int(earlier[0]) if earlier else 1 if asked_for is None else asked_for


def _counts(tables: DuckDBPyConnection, draws: int) -> dict[str, int]:
    """How many positions of each stratum are drawn, with what earlier draws say of how alike its positions are."""
    strata = asked(
        tables,
        "SELECT stratum, sum(weight) AS weight, count(*) AS positions, (SELECT count(*) FROM drawn WHERE"
        " drawn.stratum = screen.stratum) AS drawn, (SELECT count(*) FROM drawn WHERE drawn.stratum = screen.stratum"
        f" AND fe_verdict = '{HOLDS}') AS holds FROM screen GROUP BY stratum ORDER BY stratum",
    )
    shares = np.array([(one["holds"] + _EXPECTED[one["stratum"]]) / (one["drawn"] + 1.0) for one in strata])
    weights = np.array([one["weight"] for one in strata])
    positions, drawn = (np.array([one[name] for one in strata]) for name in ("positions", "drawn"))
    given = allocation(weights, shares, positions, drawn, draws)
    return {one["stratum"]: int(count) for one, count in zip(strata, given, strict=True)}


def solve_sample(
    folder: Path, drawn: Drawn, case_of: CaseOf, settings: RunSettings, progress: Progress | None = None
) -> StudyOutcome:
    """Solve the drawn positions that are not solved, as a study in `sample/`, and write `sample.parquet`.

    It is written when all are solved: a sample that was interrupted is drawn again in the same way, and takes over
    what was finished.
    """
    outcome = run_study(
        Study(name="sample", cases=cases_of(drawn, case_of)), folder / "sample", settings=settings, progress=progress
    )
    rows = [row | _solved(found) for row, found in zip(drawn.rows, outcome.rows, strict=True)]
    write_table(rows, folder / SAMPLE)
    return outcome


def cases_of(drawn: Drawn, case_of: CaseOf) -> tuple[Case, ...]:
    """The cases of drawn positions."""
    return tuple(case_of(*_key(row)) for row in drawn.rows)


def _solved(row: Row) -> Record:
    """What is kept of a solved case: verdict, status, cause, its folder, and how far Hertz is off.

    A failure that is certain counts although the finite elements must not be used; how far Hertz is off is not known
    then.
    """
    row = asked_row(row)
    answer = verdict_of(row)
    verdict = UNSOLVED if answer == NO_VERDICT else answer if answer in (HOLDS, FAILS) else OPEN
    off = {
        f"fe_{name.removeprefix('hertz_deviation_')}": value if usable(row) else None
        for name, value in row.items()
        if name.startswith("hertz_deviation_")
    }
    told = {"fe_verdict": verdict, "fe_status": row["status"], "fe_cause": row.get("verdict_cause")}
    return told | {"fe_case": row["id"]} | off
