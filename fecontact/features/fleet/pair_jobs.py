"""Pairs of a fleet, screened as jobs, and the tables made of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from fecontact.case import Case, case_record
from fecontact.errors import InputError
from fecontact.features.fleet.fleet_jobs import do_jobs
from fecontact.features.fleet.model import Fleet
from fecontact.features.fleet.population import Candidate, Pair, pairs_of
from fecontact.features.fleet.profile_files import ReadProfile, refusal_reason
from fecontact.features.fleet.reading import TILE
from fecontact.features.fleet.screening import ScreeningPair, refused
from fecontact.features.fleet.screening_rows import PART, schema
from fecontact.features.fleet.tables import PROFILES, SCREEN, of_arrow
from fecontact.files import write_atomically
from fecontact.jobs.engine import OpenRun
from fecontact.profiles.library import is_known
from fecontact.profiles.reading import Reading
from fecontact.runs.identity import json_digest

VERDICTS = ("HOLDS", "FAILS", "OPEN", "REFUSED")
_OF_PAIR = (("wheel", "string"), ("rail", "string"), ("weight", "double"))
# A library profile that stands for a file in a case whose lines are handed in.
_STANDS_FOR = {"wheel": "S1002", "rail": "60E1"}


def weigh_pairs(fleet: Fleet, profiles: Sequence[ReadProfile]) -> dict[Pair, float]:
    """Pairs of the profiles that could be read, with their weights."""
    weights: dict[str, dict[str, float]] = {"wheel": {}, "rail": {}}
    for one in profiles:
        if one.kept is not None:
            weights[one.given.body][one.given.name] = one.given.weight
    for body, read in weights.items():
        if not read:
            why = next(refusal_reason(one) for one in profiles if one.given.body == body)
            raise InputError(f"[{body}s]: none of its files could be read; the first one: {why}; see {PROFILES}")
    known = {f"{one.given.body} {one.given.name}" for one in profiles}
    return pairs_of(fleet, weights["wheel"], weights["rail"], known)


Stand = tuple[str, str, float | None]
"""What stands for wheel and rail in the case of a pair, and the radius of the wheel where its table has one."""


def _stand(wheel: Candidate, rail: Candidate) -> Stand:
    specs = (one.spec if is_known(one.spec) else _STANDS_FOR[one.body] for one in (wheel, rail))
    return *specs, wheel.known.get("rolling_radius_mm")  # type: ignore[return-value]


def _case_of(fleet: Fleet, stand: Stand) -> Case:
    """The case of a pair, whose lines are handed in: its files are not read again."""
    wheel, rail, radius = stand
    case = replace(fleet.case.with_profiles({"wheel": wheel, "rail": rail}), rail_file=Reading(), wheel_file=Reading())
    return case if radius is None else replace(case, rolling_radius_mm=radius)


def _names(
    fleet: Fleet, profiles: Sequence[ReadProfile], pairs: Iterable[Pair]
) -> Iterator[tuple[Pair, str, ScreeningPair]]:
    """The pairs with the ids of their jobs, and those."""
    by_name = {(one.given.body, one.given.name): one for one in profiles}
    positions = tuple(fleet.positions)
    cases: dict[Stand, tuple[Case, str]] = {}
    for pair in pairs:
        wheel, rail = by_name["wheel", pair[0]], by_name["rail", pair[1]]
        assert wheel.kept is not None
        assert rail.kept is not None
        if (stand := _stand(wheel.given, rail.given)) not in cases:
            case = _case_of(fleet, stand)
            cases[stand] = case, json_digest([case_record(case), positions, fleet.theory])
        case, decides = cases[stand]
        work = ScreeningPair(wheel=wheel.kept, rail=rail.kept, case=case, positions=positions, theory=fleet.theory)
        yield pair, json_digest([decides, wheel.kept.folder.name, rail.kept.folder.name])[:20], work


def screen_pairs(
    fleet: Fleet, profiles: Sequence[ReadProfile], pairs: Mapping[Pair, float], out: Path, by: OpenRun
) -> dict[Pair, str]:
    """Screen what is not screened; why pairs failed."""
    named = list(_names(fleet, profiles, _in_tiles(pairs)))
    labels = {name: f"{wheel} on {rail}" for (wheel, rail), name, _ in named}
    done = do_jobs({name: work for _, name, work in named}, labels, out / "pairs", None, by)
    return {pair: why for pair, name, _ in named if (why := done[name].failure) is not None}


def _in_tiles(pairs: Iterable[Pair]) -> list[Pair]:
    """Pairs in an order in which few wheels meet few rails at a time, whose lines a worker keeps at hand."""
    given = list(pairs)
    wheels, rails = (
        {name: k // TILE for k, name in enumerate(dict.fromkeys(pair[body] for pair in given))} for body in (0, 1)
    )
    return sorted(given, key=lambda pair: (wheels[pair[0]], rails[pair[1]], pair))


def write_screen(
    fleet: Fleet, profiles: Sequence[ReadProfile], pairs: Mapping[Pair, float], failed: Mapping[Pair, str], out: Path
) -> dict[str, float]:
    """Write a part for each wheel, from what its pairs kept, with names and weights; the weight of each verdict."""
    parquet, lib = of_arrow("parquet"), of_arrow("lib")
    counted: dict[str, float] = {name: 0.0 for name in VERDICTS}
    written = set()
    for number, (_, own) in enumerate(groupby(_names(fleet, profiles, sorted(pairs)), key=lambda one: one[0][0])):
        path = out / SCREEN / f"part-{number:06d}.parquet"
        tables = []
        for pair, name, _work in own:
            if pair in failed:
                rows = [{"shift_mm": s, "load_kN": load, **refused(failed[pair])} for s, load in fleet.positions]
                table = lib.Table.from_pylist(rows, schema=schema())
            else:
                table = parquet.ParquetFile(out / "pairs" / name / PART).read()
            weights = [pairs[pair] * weight for weight in fleet.positions.values()]
            for verdict, weight in zip(table["verdict"].to_pylist(), weights, strict=True):
                counted[verdict] += weight
            own_columns = [[pair[0]] * len(weights), [pair[1]] * len(weights), weights]
            arrays = [lib.array(column) for column in own_columns]
            tables.append(lib.Table.from_arrays([*arrays, *table.columns], schema=schema(*_OF_PAIR)))
        whole = lib.concat_tables(tables)
        write_atomically(path, lambda temporary, whole=whole: parquet.write_table(whole, temporary))  # type: ignore[misc]
        written.add(path.name)
    for path in (out / SCREEN).iterdir():
        if path.name not in written:
            path.unlink()
    return counted
