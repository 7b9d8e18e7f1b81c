"""What a fleet's Parquet files answer: in how many of its positions Hertz holds, where not, and how sure that is."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.errors import InputError
from fecontact.features.fleet.estimate import Share, Stratum, bounds, limits, resampled, share_of
from fecontact.features.fleet.sampling import FAILS, HOLDS, OPEN, UNSOLVED
from fecontact.features.fleet.tables import STRATA, asked, opened, quoted
from fecontact.files import read_json
from fecontact.outputs.flat_records import Record

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

UNDECIDED = (OPEN, UNSOLVED)
_SHARES = f"""
    sum(weight) FILTER (verdict = '{HOLDS}') / sum(weight) AS holds,
    sum(weight) FILTER (verdict = '{FAILS}') / sum(weight) AS fails,
    sum(weight) FILTER (verdict = '{OPEN}') / sum(weight) AS open,
    sum(weight) FILTER (verdict = 'REFUSED') / sum(weight) AS refused"""
# Columns of profiles that are no property of a wheel or a rail.
_NO_CLASSES = {
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
}
# A text with more values is a name and no class; numbers with more values are put into quarters.
_MOST_TEXTS, _MOST_NUMBERS, _QUARTERS = 12, 6, 4
# More shifts or loads, as where they are drawn at random, are rounded to these steps.
_MOST_SHIFTS, _SHIFT_STEP_MM = 41, 0.5
_MOST_LOADS, _LOAD_STEP_KN = 12, 10.0
_WORST = 20
# Fewer wheels or rails are no sample of a network.
_LEAST_PROFILES = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """A population or a part of it: shares by the screen, from 0 to 1, and its strata with the positions drawn."""

    weight: float
    positions: int
    screen: Mapping[str, float]
    strata: Sequence[Stratum]

    @property
    def drawn(self) -> int:
        """Positions that finite elements solved."""
        return sum(one.drawn for one in self.strata)

    def share(self, *answers: str) -> Share:
        """The share with one of some answers of finite elements."""
        return share_of(self.strata, answers)

    @property
    def bounds(self) -> tuple[float, float]:
        """Limits of the share at which Hertz holds, whichever answer the open and unsolved positions have.

        Without a sample all that the screen leaves open or refuses.
        """
        if self.drawn:
            return bounds(self.strata, HOLDS, UNDECIDED)
        holds = self.screen["holds"]
        return holds, holds + self.screen["open"] + self.screen["refused"]

    def record(self) -> Record:
        """Its shares in percent, as a row."""
        row: Record = {"weight_percent": 1e2 * self.weight, "positions": self.positions}
        row |= {f"screen_{name}_percent": 1e2 * value for name, value in self.screen.items()}
        row["drawn"] = self.drawn
        for answer in (HOLDS, *UNDECIDED) if self.drawn else ():
            found, name = self.share(answer), answer.lower()
            row |= {f"{name}_percent": 1e2 * found.estimate, f"{name}_low_percent": 1e2 * found.low}
            row[f"{name}_high_percent"] = 1e2 * found.high
        low, high = self.bounds
        return row | {"bound_low_percent": 1e2 * low, "bound_high_percent": 1e2 * high}


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """All that a report tells of a fleet.

    Attributes
    ----------
    about
        What `fleet.json` has: population in words, limits, theory of the screen, filters.
    whole
        The population.
    network
        The share for a network of which these profiles are a random sample; None for few of them.
    groups
        Parts by body, column of its profiles, and value.
    cells
        Shares by the screen at each shift and load.
    causes, theories
        Shares of all positions, by why Hertz does not hold and by the cheapest theory that holds.
    worst
        Pairs with the smallest share, each with its worst position.
    strata
        What the sample says of the screen.
    files
        Wheels and rails that were read and those that were not, with the reasons.
    notes
        What readers assumed of files, the notes of most files first.
    """

    about: Mapping[str, Any]
    whole: Part
    network: Share | None
    groups: Mapping[tuple[str, str, str], Part]
    cells: Sequence[Record]
    causes: Sequence[Record]
    theories: Sequence[Record]
    worst: Sequence[Record]
    strata: Sequence[Record]
    files: Sequence[Record]
    notes: Sequence[Record]


def answer_of(folder: Path) -> Answer:
    """Ask a fleet's folder.

    Raises
    ------
    InputError
        If it is not screened, or was screened again after its sample was drawn.
    """
    with opened(folder) as tables:
        _refuse_old_sample(tables, folder)
        (whole,) = _parts(tables).values()
        return Answer(
            about=read_json(folder / "fleet.json"),
            whole=whole,
            network=_network(tables, whole),
            groups={
                (body, column, value): part
                for body, column in _columns(tables)
                for value, part in _groups(tables, body, column).items()
            },
            cells=_cells(tables),
            causes=_shares_by(tables, "coalesce(cause, reason)", f"verdict <> '{HOLDS}'"),
            theories=_shares_by(tables, "cheapest_theory", "verdict <> 'REFUSED'"),
            worst=asked(tables, _WORST_PAIRS),
            strata=[_stratum_row(tables, one) for one in whole.strata],
            files=asked(tables, _FILES),
            notes=_notes(tables),
        )


def _refuse_old_sample(tables: DuckDBPyConnection, folder: Path) -> None:
    (found,) = asked(
        tables,
        "SELECT (SELECT count(*) FROM sample) - (SELECT count(*) FROM drawn WHERE drawn_stratum = stratum"
        " AND drawn_weight = weight) AS changed",
    )
    if found["changed"]:
        raise InputError(
            f"{folder}: of {found['changed']} drawn positions the screen or the weight changed after the draw; draw"
            f" again, which takes over what was solved: fecontact fleet sample {folder}"
        )


def _parts(tables: DuckDBPyConnection, body: str = "wheel", value: str = "''", place: str = "0") -> dict[str, Part]:
    """The parts of a population by an SQL expression of the wheels or the rails, in the order of another one."""

    def of(table: str) -> str:
        return (
            f"(SELECT {table}.*, {value} AS value, {place} AS place FROM {table} JOIN profiles AS own"
            f" ON own.body = '{body}' AND own.name = {table}.{body})"
        )

    by_value = asked(
        tables,
        f"SELECT value, sum(weight) AS weight, count(*) AS positions, {_SHARES} FROM {of('screen')}"
        " GROUP BY value ORDER BY min(place), value",
    )
    strata = asked(
        tables,
        f"SELECT value, stratum, sum(weight) AS weight, count(*) AS positions, {_SHARES} FROM {of('screen')}"
        " GROUP BY value, stratum",
    )
    by_stratum: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for row in asked(tables, f"SELECT value, stratum, fe_verdict, weight, inclusion_probability FROM {of('drawn')}"):
        by_stratum[row["value"], row["stratum"]].append(row)
    own = {(row["value"], row["stratum"]): row for row in strata}
    return {
        one["value"]: Part(
            weight=one["weight"],
            positions=one["positions"],
            screen={name: one[name] or 0.0 for name in ("holds", "fails", "open", "refused")},
            strata=[_stratum(own[key], by_stratum[key]) for name in STRATA if (key := (one["value"], name)) in own],
        )
        for one in by_value
    }


def _stratum(row: Record, solved: Sequence[Record]) -> Stratum:
    return Stratum(
        name=row["stratum"],
        weight=row["weight"],
        positions=row["positions"],
        guess=row["holds"] or 0.0,
        answers=np.array([one["fe_verdict"] for one in solved], dtype=str),
        weights=np.array([one["weight"] for one in solved], dtype=float),
        inclusion=np.array([one["inclusion_probability"] for one in solved], dtype=float),
    )


def _stratum_row(tables: DuckDBPyConnection, one: Stratum) -> Record:
    """What finite elements say of a stratum, and how often they decide against the screen."""
    solved = asked(
        tables,
        "SELECT verdict, fe_verdict, weight / inclusion_probability AS stands_for FROM drawn WHERE stratum = ?",
        one.name,
    )
    decided = [row for row in solved if {row["verdict"], row["fe_verdict"]} <= {HOLDS, FAILS}]
    against = [row for row in decided if row["verdict"] != row["fe_verdict"]]
    row = {"stratum": one.name, "weight_percent": 1e2 * one.weight, "positions": one.positions, "drawn": one.drawn}
    row |= {answer.lower(): int(np.sum(one.answers == answer)) for answer in (HOLDS, FAILS, *UNDECIDED)}
    row |= {"decided": len(decided), "discordant": len(against)}
    if decided:
        share = sum(own["stands_for"] for own in against) / sum(own["stands_for"] for own in decided)
        draws = one.effective_draws * len(decided) / one.drawn
        low, high = limits(np.array([share]), np.array([draws]))
        row |= {"discordant_percent": 1e2 * share, "discordant_low_percent": 1e2 * float(low[0])}
        row["discordant_high_percent"] = 1e2 * float(high[0])
    return row


def _network(tables: DuckDBPyConnection, whole: Part) -> Share | None:
    """The share for the network: limits of other profiles, and of the sample, squared and added."""
    pairs = asked(
        tables, "SELECT wheel, rail, stratum, sum(weight) AS weight FROM screen GROUP BY wheel, rail, stratum"
    )
    wheels, rails = (np.unique([row[body] for row in pairs], return_inverse=True)[1] for body in ("wheel", "rail"))
    if min(wheels.max(), rails.max()) + 1 < _LEAST_PROFILES:
        return None
    shares = {one.name: one.share({HOLDS}) for one in whole.strata}
    weights = np.array([row["weight"] for row in pairs])
    holding = weights * np.array([shares[row["stratum"]] for row in pairs])
    profiles, sample = resampled(wheels, rails, holding, weights, seed=1), whole.share(HOLDS)
    p = profiles.estimate
    # without a sample nothing is known of the strata, and the profiles' part alone is told
    low = np.hypot(p - profiles.low, (p - sample.low) * bool(whole.drawn))
    high = np.hypot(profiles.high - p, (sample.high - p) * bool(whole.drawn))
    return Share(estimate=p, low=max(p - float(low), 0.0), high=min(p + float(high), 1.0))


# --- Groups of wheels or rails, by what their tables say of them.


def _columns(tables: DuckDBPyConnection) -> list[tuple[str, str]]:
    """Columns of profiles that make classes, by body: a class has two profiles or more on average."""
    names = [row["column_name"] for row in asked(tables, "DESCRIBE profiles") if row["column_name"] not in _NO_CLASSES]
    counts = {body: len(_values(tables, body, "name")) for body in ("wheel", "rail")}
    found = []
    for body, profiles in counts.items():
        for name in names:
            values = len(_values(tables, body, name))
            classes = _QUARTERS if _is_number(tables, name) and values > _MOST_NUMBERS else values
            if 1 < classes <= min(_MOST_TEXTS, profiles / 2):
                found.append((body, name))
    return found


def _values(tables: DuckDBPyConnection, body: str, column: str) -> list[Any]:
    sql = f"SELECT DISTINCT {quoted(column)} AS value FROM profiles WHERE body = ? AND status = 'read'"
    return [row["value"] for row in asked(tables, sql, body) if row["value"] is not None]


def _is_number(tables: DuckDBPyConnection, column: str) -> bool:
    (found,) = asked(tables, f"SELECT typeof(any_value({quoted(column)})) AS kind FROM profiles")
    return found["kind"] in ("DOUBLE", "FLOAT") or "INT" in found["kind"]


def _groups(tables: DuckDBPyConnection, body: str, column: str) -> dict[str, Part]:
    """Parts by a column of the wheels or rails: its values, or quarters of the profiles where it has many numbers."""
    own, values = f"own.{quoted(column)}", _values(tables, body, column)
    value = f"CAST({own} AS VARCHAR)"
    if _is_number(tables, column):
        value = f"format('{{:g}}', CAST({own} AS DOUBLE))"
        if len(values) > _MOST_NUMBERS:
            edges = np.quantile(values, np.linspace(0.0, 1.0, _QUARTERS + 1))
            cases = [
                f"WHEN {own} <= {float(top)!r} THEN '{_rounded(low)} to {_rounded(top)}'"
                for low, top in pairwise(edges)
            ]
            value = f"CASE {' '.join(cases)} END"
    return _parts(tables, body, f"coalesce({value}, 'not given')", own)


def _rounded(value: float) -> str:
    return f"{float(f'{value:.3g}'):.10g}"


# --- Tables over all positions by the screen.


def _cells(tables: DuckDBPyConnection) -> list[Record]:
    """Shares at each shift and load, of the weight of all pairs there.

    In steps where there are many of one of them, or fewer than half of all their combinations.
    """
    shifts, loads = _distinct(tables, "shift_mm"), _distinct(tables, "load_kN")
    sparse = 2 * _distinct(tables, "(shift_mm, load_kN)") < shifts * loads
    shift, load = (
        f"round({name} / {step}) * {step}" if many or sparse else name
        for name, many, step in (
            ("shift_mm", shifts > _MOST_SHIFTS, _SHIFT_STEP_MM),
            ("load_kN", loads > _MOST_LOADS, _LOAD_STEP_KN),
        )
    )
    return asked(
        tables,
        f"SELECT {shift} AS shift, {load} AS load, sum(weight) AS weight, count(*) AS positions, {_SHARES}"
        " FROM screen GROUP BY ALL ORDER BY ALL",
    )


def _distinct(tables: DuckDBPyConnection, columns: str) -> int:
    (found,) = asked(tables, f"SELECT count(DISTINCT {columns}) AS number FROM screen")
    return int(found["number"])


def _shares_by(tables: DuckDBPyConnection, value: str, where: str) -> list[Record]:
    """Shares of all positions by a value, and which verdicts the screen gives where it has it."""
    return asked(
        tables,
        f"SELECT coalesce({value}, 'none') AS value, string_agg(DISTINCT lower(verdict), ', ') AS verdicts,"
        " sum(weight) / (SELECT sum(weight) FROM screen) AS share, count(*) AS positions"
        f" FROM screen WHERE {where} GROUP BY value ORDER BY share DESC, value",
    )


_WORST_PAIRS = f"""
    SELECT wheel, rail, count(*) AS positions, {_SHARES}, min(margin) AS margin,
           arg_min(shift_mm, margin) AS shift_mm, arg_min(load_kN, margin) AS load_kN, arg_min(cause, margin) AS cause
    FROM screen GROUP BY wheel, rail HAVING min(margin) IS NOT NULL
    ORDER BY coalesce(holds, 0), fails DESC NULLS LAST, margin, wheel, rail LIMIT {_WORST}"""
_FILES = """
    SELECT body, status, coalesce(reason, '') AS reason, coalesce(remedy, '') AS remedy, count(*) AS files,
           count(*) / sum(count(*)) OVER (PARTITION BY body) AS share, min(file) AS example
    FROM profiles GROUP BY body, status, reason, remedy ORDER BY body DESC, status, files DESC, reason"""
_NOTES = """
    SELECT body, note, count(*) AS files, min(file) AS example
    FROM (SELECT body, file, unnest(string_split(reader_notes, chr(10))) AS note FROM profiles)
    WHERE note <> '' GROUP BY body, note ORDER BY body DESC, files DESC, note"""


def _notes(tables: DuckDBPyConnection) -> list[Record]:
    """What readers assumed of files, a row for each note; none of a fleet that was screened without keeping notes."""
    names = {row["column_name"] for row in asked(tables, "DESCRIBE profiles")}
    return asked(tables, _NOTES) if "reader_notes" in names else []
