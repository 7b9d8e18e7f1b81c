"""Answers from the Parquet files of a fleet: the share of positions where Hertz holds, the reasons, and the
uncertainty.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.features.fleet.estimate import (
    Share,
    Stratum,
    bootstrap_share,
    estimate_share,
    find_exact_limits,
    find_share_bounds,
)
from fecontact.features.fleet.open_positions import (
    SolutionTime,
    estimate_new_screening,
    find_solution_time,
    query_open_causes,
)
from fecontact.features.fleet.profile_files import find_kind
from fecontact.features.fleet.sampling import FAILS, HOLDS, OPEN, UNSOLVED, CaseOf
from fecontact.features.fleet.screening_rows import FILTER_COLUMNS, NO_CONTACT, REFUSED
from fecontact.features.fleet.sealed_folder import (
    FLEET_RECORD,
    check_sample,
    describe_redraw,
    digest_screen,
)
from fecontact.features.fleet.tables import POSITION_COLUMNS, STRATA, open_tables, query_rows, quote_column
from fecontact.files import read_json
from fecontact.inputs.texts import count_text
from fecontact.outputs.flat_records import Record

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

UNDECIDED = (OPEN, UNSOLVED)
_SHARES_SQL = f"""
    sum(weight) FILTER (verdict = '{HOLDS}') / sum(weight) AS holds,
    sum(weight) FILTER (verdict = '{FAILS}') / sum(weight) AS fails,
    sum(weight) FILTER (verdict = '{OPEN}') / sum(weight) AS open,
    sum(weight) FILTER (verdict = '{REFUSED}') / sum(weight) AS refused"""
# Columns of profiles that are not a property of a wheel or a rail.
_COLUMNS_WITHOUT_CLASSES = {
    "body",
    "name",
    "file",
    "content_hash",
    "status",
    "reason",
    "remedy",
    "filter_mm",
    "weight",
    "reader_notes",
    "suspicions",
    "accepted",
}
# A text column with more values has names instead of classes. Numbers with more values, or with more values than half
# of the profiles, are divided into up to four classes.
_MOST_TEXTS, _MOST_NUMBERS, _QUARTERS = 12, 6, 4
# More shifts or loads, for example if they are drawn at random, are rounded to these steps.
_MOST_SHIFTS, _SHIFT_STEP_MM = 41, 0.5
_MOST_LOADS, _LOAD_STEP_KN = 12, 10.0
_WORST_COUNT = 20
# Fewer wheels or rails are not a sample of a network.
_LEAST_PROFILES = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class Subpopulation:
    """A population of contacts or a part of it.

    Attributes
    ----------
    weight, positions
        Weight, and number of contacts.
    no_contact
        Share of all positions at which the wheel cannot stand on the rail, from 0 to 1. They are not contacts.
    screen
        Shares by the verdict of the screening, from 0 to 1.
    strata
        Strata with their draws.
    """

    weight: float
    positions: int
    no_contact: float
    screen: Mapping[str, float]
    strata: Sequence[Stratum]

    @property
    def drawn(self) -> int:
        """Number of positions that finite elements solved."""
        return sum(stratum.drawn for stratum in self.strata)

    def share(self, *answers: str) -> Share:
        """Share of the positions with some answers of finite elements.

        Parameters
        ----------
        *answers
            Answers that are counted, such as `HOLDS`.

        Returns
        -------
        Share
            Estimate with its interval (-).
        """
        return estimate_share(self.strata, answers)

    @property
    def bounds(self) -> tuple[float, float]:
        """Limits of the share at which Hertz holds, for any undecided answer.

        With a sample, the open and unsolved positions are undecided. Without a sample, the open and refused positions
        of the screening are undecided.
        """
        if self.drawn:
            return find_share_bounds(self.strata, HOLDS, UNDECIDED)
        holds = self.screen["holds"]
        return holds, holds + self.screen["open"] + self.screen["refused"]

    def record(self) -> Record:
        """Shares in percent, as a row.

        Returns
        -------
        dict
            Weight, number of positions and of draws, shares by the screening and by finite elements, and bounds.
        """
        row: Record = {"weight_percent": 1e2 * self.weight, "positions": self.positions}
        row["no_contact_percent"] = 1e2 * self.no_contact
        row |= {f"screen_{prefix}_percent": 1e2 * value for prefix, value in self.screen.items()}
        row["drawn"] = self.drawn
        for answer in (HOLDS, *UNDECIDED) if self.drawn else ():
            interval, prefix = self.share(answer), answer.lower()
            row |= {f"{prefix}_percent": 1e2 * interval.estimate, f"{prefix}_low_percent": 1e2 * interval.low}
            row[f"{prefix}_high_percent"] = 1e2 * interval.high
        low, high = self.bounds
        return row | {"bound_low_percent": 1e2 * low, "bound_high_percent": 1e2 * high}


@dataclass(frozen=True, kw_only=True, eq=False)
class FleetAnswer:
    """Content of the report of a fleet.

    Attributes
    ----------
    about
        Content of `fleet.json`: population in words, limits, theory of the screening, filters.
    whole
        The population.
    network
        Share for a network of which these profiles are a random sample; None for few profiles.
    groups
        Subpopulations by body, column of its profiles, and value.
    cells
        Shares by the screening at each shift and load.
    causes, theories
        Shares of all contacts, by the cause for which Hertz fails or is unresolved, and by the cheapest theory that is
        known to hold.
    refusals
        Positions without a verdict by the kind of reason, as shares of all positions.
    open_causes
        Unresolved contacts by the change that would decide them, with its cost (`open_positions.query_open_causes`).
    solution_time
        CPU time of a position by finite elements; None if it is unknown.
    new_screening_s
        CPU seconds of screening again with a declared filter.
    filters
        Shares of all contacts by verdict, for each usual filter if it were declared; empty with a declared filter.
    worst
        Pairs with the smallest share, each with its worst position.
    strata
        Agreement of the sample with the screening in each stratum.
    files
        Wheels and rails that were read or refused, with the reasons.
    notes
        Assumptions of readers, the note of most files first.
    """

    about: Mapping[str, Any]
    whole: Subpopulation
    network: Share | None
    groups: Mapping[tuple[str, str, str], Subpopulation]
    cells: Sequence[Record]
    causes: Sequence[Record]
    theories: Sequence[Record]
    refusals: Sequence[Record]
    open_causes: Sequence[Record]
    solution_time: SolutionTime | None
    new_screening_s: float
    filters: Sequence[Record]
    worst: Sequence[Record]
    strata: Sequence[Record]
    files: Sequence[Record]
    notes: Sequence[Record]


def evaluate_fleet(folder: Path, case_of: CaseOf | None = None) -> FleetAnswer:
    """Evaluate the tables in a fleet's folder.

    Parameters
    ----------
    folder
        Folder of a screened fleet.
    case_of
        Function that makes the case of a position. With it, the time of finite elements is estimated if no position
        was solved.

    Returns
    -------
    FleetAnswer
        Shares by the screening and, with a sample, by finite elements.

    Raises
    ------
    InputError
        If the fleet is not screened, or was screened again after its sample was drawn.
    """
    with open_tables(folder) as tables:
        _refuse_old_sample(tables, folder)
        (population,) = _query_subpopulations(tables).values()
        about, solution_time = read_json(folder / FLEET_RECORD), find_solution_time(tables, case_of)
        return FleetAnswer(
            about=about,
            whole=population,
            network=_estimate_network_share(tables, population),
            groups={
                (body, column, value): subpopulation
                for body, column in _find_class_columns(tables)
                for value, subpopulation in _divide_by_column(tables, body, column).items()
            },
            cells=_query_shares_by_position(tables),
            causes=_query_shares_by(tables, _CAUSE_WITHOUT_NUMBERS, f"verdict IN ('{FAILS}', '{OPEN}')"),
            theories=_query_shares_by(tables, "cheapest_theory", f"verdict <> '{REFUSED}'"),
            refusals=query_rows(tables, _REFUSALS),
            open_causes=query_open_causes(tables, solution_time),
            solution_time=solution_time,
            new_screening_s=estimate_new_screening(tables, about["theory"]),
            filters=_query_shares_by_filter(tables),
            worst=query_rows(tables, _WORST_PAIRS),
            strata=[_make_stratum_row(tables, stratum) for stratum in population.strata],
            files=_merge_kinds(query_rows(tables, _FILES), "reason"),
            notes=_list_notes(tables),
        )


def _refuse_old_sample(tables: DuckDBPyConnection, folder: Path) -> None:
    """Raise InputError if a later screening of the drawn positions had a different result."""
    if check_sample(folder) in (None, digest_screen(read_json(folder / FLEET_RECORD))):
        return
    (row,) = query_rows(
        tables,
        "SELECT count(*) AS drawn, (SELECT count(*) FROM drawn WHERE drawn_stratum = stratum AND drawn_weight = weight)"
        " AS unchanged FROM sample",
    )
    changed = row["drawn"] - row["unchanged"]
    reason = (
        f"since the draw, the screen verdict or the weight changed at {count_text(changed, 'drawn position')}"
        if changed
        else "the positions were screened again with a different result since the sample was drawn"
    )
    raise InputError(f"{folder}: {reason}; {describe_redraw(folder, row['drawn'])}")


def _query_subpopulations(
    tables: DuckDBPyConnection, body: str = "wheel", value_sql: str = "''", order_sql: str = "0"
) -> dict[str, Subpopulation]:
    """Subpopulations by an SQL expression of the wheels or the rails.

    `body` is `wheel` or `rail`, `value_sql` the expression of a row of its profiles. The result is by the value, in the
    order of the expression `order_sql`.
    """

    def join_profiles(table: str) -> str:
        """Subquery of a table with the value and the order of each row."""
        return (
            f"(SELECT {table}.*, {value_sql} AS value, {order_sql} AS place FROM {table}"
            f" JOIN profiles AS own ON own.body = '{body}' AND own.name = {table}.{body})"
        )

    by_value = query_rows(
        tables,
        f"SELECT value, sum(weight) AS weight, count(*) AS positions, {_SHARES_SQL} FROM {join_profiles('screen')}"
        " GROUP BY value ORDER BY min(place), value",
    )
    strata = query_rows(
        tables,
        f"SELECT value, stratum, sum(weight) AS weight, count(*) AS positions, {_SHARES_SQL}"
        f" FROM {join_profiles('screen')} GROUP BY value, stratum",
    )
    by_stratum: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for row in query_rows(
        tables,
        f"SELECT value, stratum, fe_verdict, weight, inclusion_probability FROM {join_profiles('drawn')}"
        f" ORDER BY {POSITION_COLUMNS}",
    ):
        by_stratum[row["value"], row["stratum"]].append(row)
    without_contact = {
        row["value"]: row["share"] or 0.0
        for row in query_rows(
            tables,
            f"SELECT value, sum(weight) FILTER (verdict = '{NO_CONTACT}') / sum(weight) AS share"
            f" FROM {join_profiles('placed')} GROUP BY value",
        )
    }
    rows_by_stratum = {(row["value"], row["stratum"]): row for row in strata}
    return {
        part_row["value"]: Subpopulation(
            weight=part_row["weight"],
            positions=part_row["positions"],
            no_contact=without_contact[part_row["value"]],
            screen={name: part_row[name] or 0.0 for name in ("holds", "fails", "open", "refused")},
            strata=[
                _make_stratum(rows_by_stratum[key], by_stratum[key])
                for name in STRATA
                if (key := (part_row["value"], name)) in rows_by_stratum
            ],
        )
        for part_row in by_value
    }


def _make_stratum(row: Record, solved_rows: Sequence[Record]) -> Stratum:
    """Stratum from its row and the rows of its solved positions."""
    return Stratum(
        name=row["stratum"],
        weight=row["weight"],
        positions=row["positions"],
        guess=row["holds"] or 0.0,
        answers=np.array([solved_row["fe_verdict"] for solved_row in solved_rows], dtype=str),
        weights=np.array([solved_row["weight"] for solved_row in solved_rows], dtype=float),
        inclusion=np.array([solved_row["inclusion_probability"] for solved_row in solved_rows], dtype=float),
    )


def _make_stratum_row(tables: DuckDBPyConnection, stratum: Stratum) -> Record:
    """Row of a stratum: answers of finite elements, and the share that contradicts the screening."""
    solved_rows = query_rows(
        tables,
        "SELECT verdict, fe_verdict, weight / inclusion_probability AS stands_for FROM drawn WHERE stratum = ?"
        f" ORDER BY {POSITION_COLUMNS}",
        stratum.name,
    )
    decided = [row for row in solved_rows if {row["verdict"], row["fe_verdict"]} <= {HOLDS, FAILS}]
    discordant = [row for row in decided if row["verdict"] != row["fe_verdict"]]
    row = {
        "stratum": stratum.name,
        "weight_percent": 1e2 * stratum.weight,
        "positions": stratum.positions,
        "drawn": stratum.drawn,
    }
    row |= {answer.lower(): int(np.sum(stratum.answers == answer)) for answer in (HOLDS, FAILS, *UNDECIDED)}
    row |= {"decided": len(decided), "discordant": len(discordant)}
    if decided:
        share = sum(solved_row["stands_for"] for solved_row in discordant) / sum(
            solved_row["stands_for"] for solved_row in decided
        )
        draws = stratum.effective_draws * len(decided) / stratum.drawn
        low, high = find_exact_limits(np.array([share]), np.array([draws]))
        row |= {"discordant_percent": 1e2 * share, "discordant_low_percent": 1e2 * float(low[0])}
        row["discordant_high_percent"] = 1e2 * float(high[0])
    return row


def _estimate_network_share(tables: DuckDBPyConnection, population: Subpopulation) -> Share | None:
    """Share for the network: the distances of the limits by other profiles and by the sample, squared and added."""
    pairs = query_rows(
        tables, "SELECT wheel, rail, stratum, sum(weight) AS weight FROM screen GROUP BY ALL ORDER BY ALL"
    )
    wheels, rails = (np.unique([row[body] for row in pairs], return_inverse=True)[1] for body in ("wheel", "rail"))
    if min(wheels.max(), rails.max()) + 1 < _LEAST_PROFILES:
        return None
    shares = {stratum.name: stratum.share({HOLDS}) for stratum in population.strata}
    weights = np.array([row["weight"] for row in pairs])
    holding = weights * np.array([shares[row["stratum"]] for row in pairs])
    profiles, sample = bootstrap_share(wheels, rails, holding, weights, seed=1), population.share(HOLDS)
    estimate = profiles.estimate
    # without a sample the uncertainty of the strata is unknown, and only the uncertainty of the profiles is included
    low = np.hypot(estimate - profiles.low, (estimate - sample.low) * bool(population.drawn))
    high = np.hypot(profiles.high - estimate, (sample.high - estimate) * bool(population.drawn))
    return Share(estimate=estimate, low=max(estimate - float(low), 0.0), high=min(estimate + float(high), 1.0))


def _find_class_columns(tables: DuckDBPyConnection) -> list[tuple[str, str]]:
    """Columns of profiles that make classes, as pairs (body, column).

    A class has at least two profiles on average.
    """
    names = [
        row["column_name"]
        for row in query_rows(tables, "DESCRIBE profiles")
        if row["column_name"] not in _COLUMNS_WITHOUT_CLASSES
    ]
    counts = {body: len(_query_distinct_values(tables, body, "name")) for body in ("wheel", "rail")}
    class_columns = []
    for body, profiles in counts.items():
        for name in names:
            values = len(_query_distinct_values(tables, body, name))
            limits = _find_limits(tables, body, name)
            if 1 < (len(limits) + 1 if limits else values) <= min(_MOST_TEXTS, profiles / 2):
                class_columns.append((body, name))
    return class_columns


def _find_limits(tables: DuckDBPyConnection, body: str, column: str) -> list[float]:
    """Limits between the classes of a column with many numbers; empty for texts and for few numbers."""
    if not _is_number(tables, column):
        return []
    sql = f"SELECT {_make_finite(column)} AS value FROM profiles WHERE body = ? AND status = 'read'"
    values = np.array([row["value"] for row in query_rows(tables, sql, body) if row["value"] is not None], dtype=float)
    if np.unique(values).size <= min(_MOST_NUMBERS, values.size / 2):
        return []
    return choose_limits(values)


def choose_limits(values: Floats) -> list[float]:
    """Choose round limits between classes with about equal numbers of profiles.

    Parameters
    ----------
    values : ndarray of shape (n,)
        Values of the profiles.

    Returns
    -------
    list of float
        Up to three quantiles, rounded to a multiple of 1, 2 or 5 times a power of ten that is at most a tenth of the
        range of the middle 80 % of the values. No class is empty; fewer than four values have no limits.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.fleet.answer import choose_limits
    >>> choose_limits(np.array([27.91, 28.02, 28.34, 28.77, 29.12, 29.58, 30.05, 30.41]))
    [28.2, 29.0, 29.6]
    """
    classes = min(_QUARTERS, values.size // 2)
    low, high = np.quantile(values, [0.1, 0.9]) if values.size else (0.0, 0.0)
    if classes < 2 or not high > low:
        return []
    decade = 10.0 ** np.floor(np.log10(0.1 * (high - low)))
    step = max(factor * decade for factor in (1.0, 2.0, 5.0) if factor * decade <= 0.1 * (high - low) * (1.0 + 1e-9))
    limits: list[float] = []
    for quantile in np.quantile(values, np.arange(1, classes) / classes):
        # fifteen digits remove the rounding of the product
        limit = float(f"{round(quantile / step) * step:.15g}")
        is_class = np.any((values <= limit) & (values > (limits[-1] if limits else -np.inf)))
        if is_class and np.any(values > limit):
            limits.append(limit)
    return limits


def _query_distinct_values(tables: DuckDBPyConnection, body: str, column: str) -> list[Any]:
    """Distinct values of a column of the profiles that were read."""
    sql = f"SELECT DISTINCT {quote_column(column)} AS value FROM profiles WHERE body = ? AND status = 'read'"
    return [row["value"] for row in query_rows(tables, sql, body) if row["value"] is not None]


def _is_number(tables: DuckDBPyConnection, column: str) -> bool:
    (row,) = query_rows(tables, f"SELECT typeof(any_value({quote_column(column)})) AS kind FROM profiles")
    return row["kind"] in ("DOUBLE", "FLOAT") or "INT" in row["kind"]


def _divide_by_column(tables: DuckDBPyConnection, body: str, column: str) -> dict[str, Subpopulation]:
    """Subpopulations by a column of the wheels or rails.

    Columns with many numbers are divided into classes with round limits. A limit belongs to the class below it.
    """
    order_sql = f"own.{quote_column(column)}"
    value_sql = f"CAST({order_sql} AS VARCHAR)"
    if _is_number(tables, column):
        order_sql = _make_finite(column, "own.")
        value_sql = f"format('{{:g}}', {order_sql})"
    if limits := _find_limits(tables, body, column):
        cases = [f"WHEN {order_sql} <= {limits[0]!r} THEN 'up to {_format_limit(limits[0])}'"]
        cases += [
            f"WHEN {order_sql} <= {high!r} THEN '{_format_limit(low)} to {_format_limit(high)}'"
            for low, high in pairwise(limits)
        ]
        cases.append(f"WHEN {order_sql} > {limits[-1]!r} THEN 'above {_format_limit(limits[-1])}'")
        value_sql = f"CASE {' '.join(cases)} END"
    return _query_subpopulations(tables, body, f"coalesce({value_sql}, 'not given')", order_sql)


def _make_finite(column: str, table: str = "") -> str:
    """SQL of the numbers of a column; values that are not finite are missing."""
    number = f"CAST({table}{quote_column(column)} AS DOUBLE)"
    return f"CASE WHEN isfinite({number}) THEN {number} END"


def _format_limit(value: float) -> str:
    return f"{value:.10g}"


def _query_shares_by_position(tables: DuckDBPyConnection) -> list[Record]:
    """Shares at each shift and load, of the weight of all pairs there.

    Shifts or loads are rounded to steps if there are many of them, or fewer than half of all their combinations.
    """
    shifts, loads = _count_distinct(tables, "shift_mm"), _count_distinct(tables, "load_kN")
    sparse = 2 * _count_distinct(tables, "(shift_mm, load_kN)") < shifts * loads
    shift, load = (
        f"round({name} / {step}) * {step}" if many or sparse else name
        for name, many, step in (
            ("shift_mm", shifts > _MOST_SHIFTS, _SHIFT_STEP_MM),
            ("load_kN", loads > _MOST_LOADS, _LOAD_STEP_KN),
        )
    )
    return query_rows(
        tables,
        f"SELECT {shift} AS shift, {load} AS load, sum(weight) AS weight, count(*) AS positions, {_SHARES_SQL}"
        " FROM screen GROUP BY ALL ORDER BY ALL",
    )


def _count_distinct(tables: DuckDBPyConnection, columns: str) -> int:
    (row,) = query_rows(tables, f"SELECT count(DISTINCT {columns}) AS number FROM screen")
    return int(row["number"])


def _query_shares_by(tables: DuckDBPyConnection, value: str, where: str) -> list[Record]:
    """Shares of all contacts by a value.

    Each row has the verdicts of the screening for the value.
    """
    return query_rows(
        tables,
        f"SELECT coalesce({value}, 'none') AS value,"
        " string_agg(DISTINCT lower(verdict), ', ' ORDER BY lower(verdict)) AS verdicts,"
        " sum(weight) / (SELECT sum(weight) FROM screen) AS share, count(*) AS positions"
        f" FROM screen WHERE {where} GROUP BY value ORDER BY share DESC, value",
    )


# Notes of a theory in a cause may have numbers.
_CAUSE_WITHOUT_NUMBERS = r"regexp_replace(cause, '[-+]?\d+(\.\d+)?(e[-+]?\d+)?', '...', 'g')"
_REFUSALS = f"""
    SELECT verdict, coalesce(reason_kind, reason, 'no reason given') AS kind,
           arg_min(remedy, position) AS remedy, sum(weight) / (SELECT sum(weight) FROM placed) AS share,
           count(*) AS positions, arg_min(wheel, position) AS wheel, arg_min(rail, position) AS rail,
           arg_min(shift_mm, position) AS shift_mm, arg_min(load_kN, position) AS load_kN,
           arg_min(reason, position) AS reason
    FROM (SELECT *, row({POSITION_COLUMNS}) AS position FROM placed WHERE verdict IN ('{NO_CONTACT}', '{REFUSED}'))
    GROUP BY verdict, kind ORDER BY verdict, share DESC, kind"""


def _query_shares_by_filter(tables: DuckDBPyConnection) -> list[Record]:
    """Shares by verdict for each usual filter if it were declared; empty for a fleet with a declared filter.

    The verdict is unknown for profiles whose noise asks for a longer filter.
    """
    counts = ", ".join(f"count({column}) FILTER (variants > 1) AS {column}" for column in FILTER_COLUMNS)
    (counts_by_column,) = query_rows(tables, f"SELECT {counts} FROM screen")
    if not all(counts_by_column.values()):
        return []
    return [
        row
        for column, length in FILTER_COLUMNS.items()
        for row in query_rows(
            tables,
            f"SELECT {length}::DOUBLE AS filter_mm, {_SHARES_SQL},"
            " sum(weight) FILTER (verdict = 'UNKNOWN') / sum(weight) AS unknown FROM (SELECT weight,"
            f" CASE WHEN {column} IS NULL AND variants > 1 AND verdict <> '{REFUSED}' THEN 'UNKNOWN'"
            f" ELSE coalesce({column}, verdict) END AS verdict FROM screen)",
        )
    ]


_WORST_PAIRS = f"""
    SELECT wheel, rail, count(*) AS positions, {_SHARES_SQL}, min(margin) AS margin,
           arg_min(shift_mm, place) AS shift_mm, arg_min(load_kN, place) AS load_kN, arg_min(cause, place) AS cause
    FROM (SELECT *, CASE WHEN margin IS NOT NULL THEN row(margin, shift_mm, load_kN) END AS place FROM screen)
    GROUP BY wheel, rail HAVING min(margin) IS NOT NULL
    ORDER BY coalesce(holds, 0), fails DESC NULLS LAST, margin, wheel, rail LIMIT {_WORST_COUNT}"""
_FILES = """
    SELECT body, status, coalesce(reason, '') AS reason, coalesce(remedy, '') AS remedy, count(*) AS files,
           count(*) / sum(count(*)) OVER (PARTITION BY body) AS share, min(file) AS example
    FROM profiles GROUP BY body, status, reason, remedy ORDER BY body DESC, status, files DESC, reason"""
_NOTES = """
    SELECT body, note, count(*) AS files, min(file) AS example
    FROM (SELECT body, file, unnest(string_split(reader_notes, chr(10))) AS note FROM profiles)
    WHERE note <> '' GROUP BY body, note ORDER BY body DESC, files DESC, note"""


def _list_notes(tables: DuckDBPyConnection) -> list[Record]:
    """Assumptions of readers, a row for each note; empty for a fleet that was screened without notes."""
    names = {row["column_name"] for row in query_rows(tables, "DESCRIBE profiles")}
    return _merge_kinds(query_rows(tables, _NOTES), "note") if "reader_notes" in names else []


def _merge_kinds(rows: Iterable[Record], column: str) -> list[Record]:
    """Merge the rows of files with texts of equal kind, by `find_kind`.

    A row has the text of most files. Without this, texts that differ only by numbers have a row for each file.
    """
    merged_rows: dict[tuple[str, ...], Record] = {}
    for row in rows:
        kind = find_kind(row[column], Path(row["example"]).stem)
        key = (row["body"], row.get("status", ""), kind)
        sums = {
            name: merged_rows[key][name] + row[name] for name in row.keys() & {"files", "share"} if key in merged_rows
        }
        merged_rows[key] = merged_rows.get(key, row) | sums
    return sorted(merged_rows.values(), key=lambda row: (row["body"] != "wheel", row.get("status", ""), -row["files"]))
