"""Pairs of a fleet: screened as jobs, and written as tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from fecontact.case import Case, make_case_record
from fecontact.errors import InputError
from fecontact.features.fleet.fleet_jobs import run_fleet_jobs
from fecontact.features.fleet.model import Fleet
from fecontact.features.fleet.packages import import_arrow
from fecontact.features.fleet.population import Candidate, Pair
from fecontact.features.fleet.profile_files import ReadProfile, find_opposite_radius_mm
from fecontact.features.fleet.reading import TILE_SIZE
from fecontact.features.fleet.screening import ScreeningPair, make_refusal_columns
from fecontact.features.fleet.screening_rows import ROWS_FILE, make_schema
from fecontact.features.fleet.sealed_folder import PAIR_JOBS, SCREEN, SYSTEM_REMEDY, list_own_parts
from fecontact.features.fleet.table_columns import (
    Body,
    select_case_values,
    set_case_values,
    set_opposite,
)
from fecontact.features.fleet.tables import VERDICTS, read_parquet, write_parquet
from fecontact.files import remove_unfinished, write_atomically
from fecontact.jobs.engine import OpenRun
from fecontact.jobs.workers import JobOutcome
from fecontact.placement.problems import PositionProblem
from fecontact.profiles.library import is_library_name
from fecontact.profiles.reading import Reading
from fecontact.runs.identity import digest_json

_PAIR_COLUMNS = (("wheel", "string"), ("rail", "string"), ("weight", "double"))
# Profiles of the library that replace files in a case with given profile variants.
_PLACEHOLDER = {"wheel": "S1002", "rail": "60E1"}


CaseKey = tuple[str, str, tuple[tuple[str, Any], ...], tuple[tuple[Body, str], ...], float | None]
"""Names of wheel and rail in the case of a pair, the inputs of the case that their tables have, and the names of the
profiles of the other side with the radius of the other wheel.
"""


def _name_in_case(candidate: Candidate) -> str:
    """Name of the library for a profile in the case of a pair."""
    return candidate.spec if is_library_name(candidate.spec) else _PLACEHOLDER[candidate.body]


def _make_case_key(wheel: Candidate, rail: Candidate) -> CaseKey:
    """Key of the case of a pair: library names, and inputs from the tables.

    A name of the library replaces each file.
    """
    values = select_case_values(wheel.known) | select_case_values(rail.known)
    opposite = tuple(
        (profile.body, _name_in_case(profile.opposite)) for profile in (wheel, rail) if profile.opposite is not None
    )
    return _name_in_case(wheel), _name_in_case(rail), tuple(values.items()), opposite, find_opposite_radius_mm(wheel)


def _make_case(fleet: Fleet, case_key: CaseKey) -> Case:
    """Case of a pair with given profiles: its files are not read again."""
    wheel, rail, values, opposite, opposite_radius_mm = case_key
    # the profiles of the other side come first: the case of the fleet may have files for them
    case = set_opposite(fleet.case, dict(opposite), opposite_radius_mm)
    case = replace(case.with_profiles({"wheel": wheel, "rail": rail}), rail_file=Reading(), wheel_file=Reading())
    return set_case_values(case, dict(values))


def _list_pair_jobs(
    fleet: Fleet, profiles: Sequence[ReadProfile], pairs: Iterable[Pair]
) -> Iterator[tuple[Pair, str, ScreeningPair]]:
    """Yield each pair with the id of its job and the job.

    The id is a hash of the case, the positions, the theory and the stored profiles of both sides, so that an unchanged
    pair is found again. Both profiles of each pair must be stored.
    """
    by_name = {(profile.candidate.body, profile.candidate.name): profile for profile in profiles}
    positions = tuple(fleet.positions)
    cases: dict[CaseKey, tuple[Case, str]] = {}
    for pair in pairs:
        wheel, rail = by_name["wheel", pair[0]], by_name["rail", pair[1]]
        assert wheel.stored is not None
        assert rail.stored is not None
        if (case_key := _make_case_key(wheel.candidate, rail.candidate)) not in cases:
            case = _make_case(fleet, case_key)
            cases[case_key] = case, digest_json([make_case_record(case), positions, fleet.theory])
        case, case_digest = cases[case_key]
        opposite = tuple(filter(None, (wheel.stored_opposite, rail.stored_opposite)))
        work = ScreeningPair(
            wheel=wheel.stored,
            rail=rail.stored,
            case=case,
            positions=positions,
            theory=fleet.theory,
            opposite=opposite,
        )
        folders = [profile.folder.name for profile in (wheel.stored, rail.stored, *opposite)]
        yield pair, digest_json([case_digest, *folders])[:20], work


def screen_pairs(
    fleet: Fleet, profiles: Sequence[ReadProfile], pairs: Mapping[Pair, float], out: Path, open_run: OpenRun
) -> dict[Pair, JobOutcome]:
    """Screen the pairs that are not screened yet.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    profiles
        Results of the readings.
    pairs
        Weights by names of wheel and rail.
    out
        Folder of the results.
    open_run
        The run that executes the jobs.

    Returns
    -------
    dict
        Outcome of each pair that failed, with its reason.
    """
    jobs = list(_list_pair_jobs(fleet, profiles, _sort_into_tiles(pairs)))
    labels = {job_id: f"{wheel} on {rail}" for (wheel, rail), job_id, _ in jobs}
    outcomes = run_fleet_jobs({job_id: work for _, job_id, work in jobs}, labels, out / PAIR_JOBS, None, open_run)
    return {pair: outcomes[job_id] for pair, job_id, _ in jobs if outcomes[job_id].failure is not None}


def _sort_into_tiles(pairs: Iterable[Pair]) -> list[Pair]:
    """Pairs in an order that keeps few wheels and rails in use at a time.

    A worker keeps the profile variants of these wheels and rails in its memory.
    """
    pair_list = list(pairs)
    wheels, rails = (
        {name: number // TILE_SIZE for number, name in enumerate(dict.fromkeys(pair[body] for pair in pair_list))}
        for body in (0, 1)
    )
    return sorted(pair_list, key=lambda pair: (wheels[pair[0]], rails[pair[1]], pair))


def write_screen(
    fleet: Fleet,
    profiles: Sequence[ReadProfile],
    pairs: Mapping[Pair, float],
    failed: Mapping[Pair, JobOutcome],
    out: Path,
) -> dict[str, float]:
    """Write a file for each wheel with the rows, names and weights of its pairs.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    profiles
        Results of the readings.
    pairs
        Weights by names of wheel and rail.
    failed
        Outcome of each pair that failed.
    out
        Folder of the results; files of an earlier run are deleted.

    Returns
    -------
    dict
        Weight of each verdict.

    Raises
    ------
    InputError
        If `screen/` has a table that no screening wrote.
    """
    lib, earlier_parts = import_arrow("lib"), list_own_parts(out)
    verdict_weights: dict[str, float] = {verdict: 0.0 for verdict in VERDICTS}
    written: set[str] = set()
    for number, (_, wheel_jobs) in enumerate(
        groupby(_list_pair_jobs(fleet, profiles, sorted(pairs)), key=lambda job: job[0][0])
    ):
        path = out / SCREEN / f"part-{number:06d}.parquet"
        tables = []
        for pair, job_id, _work in wheel_jobs:
            if pair in failed:
                columns = make_refusal_columns(_explain_failure(failed[pair]))
                rows = [{"shift_mm": shift, "load_kN": load, **columns} for shift, load in fleet.positions]
                table = lib.Table.from_pylist(rows, schema=make_schema())
            else:
                table = _read_pair_rows(out / PAIR_JOBS / job_id, len(fleet.positions))
            weights = [pairs[pair] * weight for weight in fleet.positions.values()]
            for verdict, weight in zip(table["verdict"].to_pylist(), weights, strict=True):
                verdict_weights[verdict] += weight
            pair_columns = [[pair[0]] * len(weights), [pair[1]] * len(weights), weights]
            arrays = [lib.array(column) for column in pair_columns]
            tables.append(lib.Table.from_arrays([*arrays, *table.columns], schema=make_schema(*_PAIR_COLUMNS)))
        wheel_table = lib.concat_tables(tables)
        write_atomically(path, partial(write_parquet, wheel_table))
        written.add(path.name)
    remove_unfinished(out / SCREEN)
    for name in earlier_parts - written:
        (out / SCREEN / name).unlink()
    return verdict_weights


def _explain_failure(outcome: JobOutcome) -> PositionProblem:
    """Reason why a pair has no rows, with the remedy."""
    problem = PositionProblem.explain(outcome.failure or "")
    if not outcome.is_system_failure:
        return problem
    return PositionProblem(problem, problem.kind, remedy=SYSTEM_REMEDY)


def _read_pair_rows(folder: Path, positions: int) -> Any:
    """Read the table of a finished pair. Other columns or another number of rows raise InputError."""
    table = read_parquet(folder / ROWS_FILE)
    if not table.schema.equals(make_schema()) or table.num_rows != positions:
        raise InputError(
            f"{folder / ROWS_FILE} does not have the columns and rows of a screened pair; remove {folder}, and run the"
            " same command again"
        )
    return table
