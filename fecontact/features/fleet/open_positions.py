"""Changes that would decide the unresolved positions of a fleet, and their cost.

The time of a solution by finite elements is the CPU time of the solved positions of the sample. Without a sample it is
estimated from the meshes of some unresolved positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fecontact.errors import FecontactError
from fecontact.features.fleet.checking import estimate_screening_seconds
from fecontact.features.fleet.model import ScreeningTheory
from fecontact.features.fleet.population import BODIES
from fecontact.features.fleet.sampling import FAILS, HOLDS, OPEN, CaseOf
from fecontact.features.fleet.screening_rows import FILTER_COLUMNS
from fecontact.features.fleet.tables import POSITION_COLUMNS, query_rows
from fecontact.inputs.texts import count_text
from fecontact.jobs.remaining import format_duration
from fecontact.judging.lines import OPEN_CAUSES
from fecontact.outputs.flat_records import Record
from fecontact.runs.cost import STUDY_FILES_S, select_evenly
from fecontact.solving.cost import START_SECONDS
from fecontact.solving.preview import preview_case_to_solve

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

ACCURACY = "accuracy of the screen"
"""Cause of an unresolved position that finite elements decide: all profile variants agree."""
# Fewer solved unresolved positions say little on the mean time; then all solved positions of the sample count.
_LEAST_TIMES = 5
_PREVIEWS = 3
FILES_SECONDS = STUDY_FILES_S[0]
"""CPU seconds of the files and pictures of a position in a sample."""


@dataclass(frozen=True, kw_only=True)
class SolutionTime:
    """CPU time of the solution of a position by finite elements, without files.

    Attributes
    ----------
    cpu_seconds
        Mean in s.
    low, high
        Smallest and largest time in s.
    positions
        Number of positions with these times.
    is_measured
        Whether the positions were solved; otherwise their times are estimated from their meshes.
    are_open
        Whether all these positions are unresolved by the screen.
    """

    cpu_seconds: float
    low: float
    high: float
    positions: int
    is_measured: bool
    are_open: bool

    @property
    def words(self) -> str:
        """Time and its basis in words."""
        noun = "unresolved position" if self.are_open else "position"
        positions = count_text(self.positions, f"solved {noun}" if self.is_measured else noun)
        basis = f"of {positions} of the sample" if self.is_measured else f"estimated from the meshes of {positions}"
        return (
            f"{self.cpu_seconds:.1f} CPU s per position (mean {basis}, {self.low:.1f} to {self.high:.1f} CPU s) and"
            f" {FILES_SECONDS:g} CPU s for its files and pictures"
        )


def find_solution_time(tables: DuckDBPyConnection, case_of: CaseOf | None) -> SolutionTime | None:
    """Find the CPU time of the solution of an unresolved position.

    Parameters
    ----------
    tables
        Tables of a fleet.
    case_of
        Function that makes the case of a position, for an estimate without a sample.

    Returns
    -------
    SolutionTime or None
        Measured time, or else an estimate; None without both.
    """
    if "fe_cpu_seconds" in _list_columns(tables, "sample"):
        sql = (
            f"SELECT verdict, fe_cpu_seconds FROM screen JOIN (SELECT {POSITION_COLUMNS}, fe_cpu_seconds FROM sample)"
            f" USING ({POSITION_COLUMNS}) WHERE fe_cpu_seconds IS NOT NULL ORDER BY {POSITION_COLUMNS}"
        )
        rows = query_rows(tables, sql)
        open_rows = [row for row in rows if row["verdict"] == OPEN]
        are_open = len(open_rows) >= _LEAST_TIMES
        if rows:
            seconds = [row["fe_cpu_seconds"] for row in (open_rows if are_open else rows)]
            return _summarise_times(seconds, is_measured=True, are_open=are_open)
    if case_of is None:
        return None
    positions = query_rows(
        tables, f"SELECT {POSITION_COLUMNS} FROM screen WHERE verdict = '{OPEN}' ORDER BY {POSITION_COLUMNS}"
    )
    estimates = []
    for position in select_evenly(positions, _PREVIEWS):
        # the error of a position that cannot be solved is reported when it is solved
        with suppress(FecontactError):
            estimates.append(preview_case_to_solve(case_of(*position.values())).cpu_seconds - START_SECONDS)
    return _summarise_times(estimates, is_measured=False, are_open=True) if estimates else None


def _list_columns(tables: DuckDBPyConnection, view: str) -> set[str]:
    """Names of the columns of a view."""
    return {row["column_name"] for row in query_rows(tables, f"DESCRIBE {view}")}


def _summarise_times(seconds: Sequence[float], *, is_measured: bool, are_open: bool) -> SolutionTime:
    return SolutionTime(
        cpu_seconds=sum(seconds) / len(seconds),
        low=min(seconds),
        high=max(seconds),
        positions=len(seconds),
        is_measured=is_measured,
        are_open=are_open,
    )


def query_open_causes(tables: DuckDBPyConnection, time: SolutionTime | None) -> list[Record]:
    """Unresolved contacts by the change that would decide them.

    Parameters
    ----------
    tables
        Tables of a fleet.
    time
        CPU time of a solution by finite elements.

    Returns
    -------
    list of dict
        For each cause: share of all contacts, number of positions, numbers of their measured wheels and rails, numbers
        of positions that finite elements solved and decided, number of positions that each usual filter would decide,
        and the CPU seconds of finite elements at the other positions (None without a time).
    """
    # tables of earlier versions may lack the noise
    has_noise = "noise_um" in _list_columns(tables, "profiles")
    measured = "SELECT name FROM profiles WHERE body = '{body}'" + " AND noise_um IS NOT NULL" * has_noise
    profiles = ", ".join(
        f"count(DISTINCT {body}) FILTER ({body} IN ({measured.format(body=body)})) AS {body}s" for body in BODIES
    )
    filters = ", ".join(
        f"count(*) FILTER ({column} IN ('{HOLDS}', '{FAILS}')) AS decided_by_{column}" for column in FILTER_COLUMNS
    )
    rows = query_rows(
        tables,
        "SELECT coalesce(open_because, 'none') AS value, sum(weight) / (SELECT sum(weight) FROM screen) AS share,"
        f" count(*) AS positions, {profiles}, count(fe_verdict) AS solved,"
        f" count(*) FILTER (fe_verdict IN ('{HOLDS}', '{FAILS}')) AS decided_by_elements, {filters}"
        f" FROM screen LEFT JOIN (SELECT {POSITION_COLUMNS}, fe_verdict FROM drawn) USING ({POSITION_COLUMNS})"
        f" WHERE verdict = '{OPEN}' GROUP BY value ORDER BY share DESC, value",
    )
    for row in rows:
        unsolved = row["positions"] - row["solved"]
        row["elements_cpu_seconds"] = None if time is None else unsolved * (time.cpu_seconds + FILES_SECONDS)
    return rows


def estimate_new_screening(tables: DuckDBPyConnection, theory: ScreeningTheory) -> float:
    """CPU seconds of screening all positions again with a declared filter.

    Parameters
    ----------
    tables
        Tables of a fleet.
    theory
        Theory of the screening.

    Returns
    -------
    float
        Expected time in s, as by `check_fleet`.
    """
    (counts,) = query_rows(
        tables,
        "SELECT count(DISTINCT (wheel, rail)) AS pairs, count(DISTINCT shift_mm) AS shifts,"
        " count(DISTINCT (shift_mm, load_kN)) AS positions,"
        " (SELECT count(*) FROM profiles WHERE status = 'read') AS files FROM placed",
    )
    return estimate_screening_seconds(theory, has_filter=True, **counts)


def describe_open_causes(rows: Sequence[Record], new_screening_s: float) -> str:
    """Describe the changes that would decide the unresolved positions, and their cost.

    Parameters
    ----------
    rows
        Rows of `query_open_causes`, at least one.
    new_screening_s
        CPU seconds of screening again with a declared filter.

    Returns
    -------
    str
        Sentence.
    """
    causes = "; ".join(_describe_open_cause(row, new_screening_s) for row in rows)
    positions = sum(row["positions"] for row in rows)
    return f"What would decide {count_text(positions, 'unresolved position')}: {causes}."


def _describe_open_cause(row: Record, new_screening_s: float) -> str:
    """Remedy, number of positions and cost of a cause of unresolved positions."""
    profiles = f"{count_text(row['wheels'], 'wheel')} and {count_text(row['rails'], 'rail')}"
    seconds = row["elements_cpu_seconds"]
    if row["value"] == ACCURACY:
        solved_text = f"; {row['solved']} are solved" * (row["solved"] > 0)
        cost = "CPU time unknown" if seconds is None else f"about {format_duration(seconds)} of CPU time"
        return f"finite elements at {row['positions']} ({cost}{solved_text})"
    if row["value"] not in OPEN_CAUSES:
        return f"an unknown change at {row['positions']}"
    remedy = OPEN_CAUSES[row["value"]]
    if row["value"] == "noise":
        return f"{remedy} at {row['positions']} (measure up to {profiles} again)"
    cost = f"screening again takes about {format_duration(new_screening_s)} of CPU time"
    if row["value"] == "filter":
        usual_lengths = [f"{length:.1f} mm" for length in FILTER_COLUMNS.values()]
        counts = [row[f"decided_by_{column}"] for column in FILTER_COLUMNS]
        decided = ", ".join(f"{count} by {length}" for count, length in zip(counts, usual_lengths, strict=True))
        unknown = f"none by {', '.join(usual_lengths)}: the noise of most profiles needs a longer filter"
        cost = f"{decided if any(counts) else unknown}; {cost}"
    return f"{remedy} at {row['positions']} ({cost})"
