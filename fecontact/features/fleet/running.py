"""A fleet while it is screened: files and pairs as jobs, each kept as it is finished; the tables are made of them.

`profiles/` and `pairs/` in the folder of the results have a folder for each file and pair that was done, named by
what decides about it: a file that is added costs that file and its pairs. `profiles.parquet` and `screen/` are written
from them at the end, with the weights, in the order of the names: the same inputs give the same tables, however often
the run was interrupted, and wherever it ran.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from fecontact.case import Case, case_record
from fecontact.errors import FecontactError, InputError
from fecontact.features.fleet.model import Fleet, read_fleet
from fecontact.features.fleet.population import BODIES, Candidate, Pair, candidates, pairs_of
from fecontact.features.fleet.reading import TILE, Kept, ReadingProfile, origin, read_record
from fecontact.features.fleet.screening import PART, Row, ScreeningPair, refused, schema
from fecontact.features.fleet.tables import PROFILES, SCREEN, of_arrow, write_table
from fecontact.files import read_json, write_atomically, write_sealed, write_text
from fecontact.inputs import as_truth
from fecontact.jobs.engine import OpenRun, RunSettings, finish, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.workers import Done, Job, Work
from fecontact.profiles.library import is_known
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import used_reading
from fecontact.runs.folder import prepare
from fecontact.runs.identity import json_digest

FLEET, TABLE = "fleet.json", "fleet.toml"
VERDICTS = ("HOLDS", "FAILS", "OPEN", "REFUSED")
_OF_PAIR = (("wheel", "string"), ("rail", "string"), ("weight", "double"))
# A library profile that stands for a file in a case whose lines are handed in.
_STANDS_FOR = {"wheel": "S1002", "rail": "60E1"}
Progresses = Mapping[str, Progress]


@dataclass(frozen=True, kw_only=True)
class ReadProfile:
    """A file of a fleet with what its reading gave."""

    given: Candidate
    record: Mapping[str, Any]
    kept: Kept | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What its reader assumed."""
        return tuple(self.record.get("notes", ()))

    @property
    def row(self) -> Row:
        """Its row of `profiles.parquet`."""
        one, record = self.given, self.record
        filters = ", ".join(f"{value:g}" for value in self.kept.filters_mm) if self.kept else ""
        own = {
            **{"body": one.body, "name": one.name, "file": one.spec, "content_hash": one.content_hash},
            **{"status": record["status"], "reason": record.get("reason", ""), "remedy": record.get("remedy", "")},
            **{"noise_um": record.get("noise_um"), "filter_mm": filters, "nominal": record.get("nominal", "")},
            **{"wear_mm": record.get("wear_mm"), "weight": one.weight, "reader_notes": "\n".join(self.notes)},
        }
        return own | {name: value for name, value in one.known.items() if name not in own}


@dataclass(frozen=True, kw_only=True)
class Screened:
    """What screening a fleet gave.

    Attributes
    ----------
    verdicts
        Weight of each verdict; they sum to 1.
    profiles, refused
        Files, and those that were refused.
    reused
        Pairs that were finished before.
    failed
        Why pairs have no rows of their own, by the names of wheel and rail.
    notes
        What readers assumed of files, by body and name.
    """

    out: Path
    pairs: int
    positions: int
    verdicts: Mapping[str, float]
    profiles: int
    refused: Mapping[str, str]
    reused: int
    failed: Mapping[Pair, str] = field(default_factory=dict)
    notes: Mapping[str, Sequence[str]] = field(default_factory=dict)

    @property
    def headline(self) -> str:
        """The answer of the screen in a sentence."""
        told = ", ".join(f"{name} in {100.0 * share:.1f} %" for name, share in self.verdicts.items())
        lost = f"; {len(self.refused)} of {self.profiles} files could not be read" if self.refused else ""
        return f"{self.positions} positions of {self.pairs} pairs, by weight: {told} (screen){lost}"


def run_fleet(
    fleet: str | Path, out: str | Path, *, settings: RunSettings | None = None, progress: Progresses | None = None
) -> Screened:
    """Screen all positions of a fleet; the same call goes on where an interrupted one stopped.

    Parameters
    ----------
    fleet
        Its file (TOML).
    out
        Folder for `profiles.parquet`, `screen/part-*.parquet`, `fleet.json` and what they are made of.
    progress
        As for `run`, of `files` and of `pairs`.

    Raises
    ------
    InputError
        For a file that does not describe a fleet, one of which no wheel or no rail can be read, and a folder that
        another run has, or that holds other results. A profile that cannot be read is a row of `profiles.parquet`, a
        position that cannot be placed is a row of the screen with its reason.
    """
    path, folder = Path(fleet), Path(out)
    of_arrow("parquet")
    asked, settings, progress = read_fleet(path), settings or RunSettings(), progress or {}
    if settings.part is not None:
        raise InputError("fleets have no parts; give --scheduler for many machines")
    found = [_usable(asked, one) for body in BODIES for one in candidates(asked, body)]
    prepare(folder, FLEET, lambda stored: True, settings.force)
    with open_run(folder, folder / "pairs", settings, progress.get("files")) as by:
        profiles = _read(asked, found, folder, by)
        write_table([one.row for one in profiles], folder / PROFILES)
        pairs = _population(asked, profiles)
        run, read = replace(by, progress=progress.get("pairs")), len(by.reused)
        failed = _screen(asked, profiles, pairs, folder, run)
        (folder / TABLE).unlink(missing_ok=True)
        counted = _write_screen(asked, profiles, pairs, failed, folder)
        write_text(folder / TABLE, path.read_text("utf-8"))
        screened = Screened(
            out=folder,
            pairs=len(pairs),
            positions=len(pairs) * len(asked.positions),
            verdicts={name: share for name, share in counted.items() if share},
            profiles=len(profiles),
            refused={f"{one.given.body} {one.given.name}": _why(one) for one in profiles if one.kept is None},
            reused=len(run.reused) - read,
            failed=failed,
            notes={f"{one.given.body} {one.given.name}": one.notes for one in profiles if one.notes},
        )
        _seal(asked, screened)
    return screened


def _why(one: ReadProfile) -> str:
    return str(one.record["reason"])


# --- Files.


def _usable(fleet: Fleet, one: Candidate) -> Candidate:
    """A profile whose table has a radius or a side that no case can have has a problem."""
    if one.problem:
        return one
    try:
        _reading(fleet, one)
        if (radius := one.known.get("rolling_radius_mm")) is not None:
            replace(fleet.case, rolling_radius_mm=radius)
    except InputError as error:
        reason, _, remedy = str(error).partition("; ")
        return replace(one, problem=reason, remedy=remedy)
    return one


def _reading(fleet: Fleet, one: Candidate) -> Reading:
    base = fleet.case.wheel_file if one.body == "wheel" else fleet.case.rail_file
    mirror = one.known.get("mirror")
    return base if mirror is None else replace(base, mirror=as_truth(mirror))


def _read(fleet: Fleet, found: Sequence[Candidate], out: Path, by: OpenRun) -> list[ReadProfile]:
    works: dict[str, ReadingProfile] = {}
    names: list[str] = []
    for one in found:
        reading = _reading(fleet, one)
        work = ReadingProfile(
            body=one.body, spec=one.spec, content_hash=one.content_hash, reading=reading, filters_mm=fleet.filters_mm
        )
        # the ending decides how the content is read
        decides = (
            one.body,
            one.content_hash or one.spec,
            Path(one.spec).suffix.lower(),
            repr(reading),
            fleet.filters_mm,
        )
        names.append("" if one.problem else json_digest(decides)[:20])
        if not one.problem:
            works[names[-1]] = work
    folder = out / "profiles"
    done = _do(works, {name: Path(work.spec).name for name, work in works.items()}, folder, read_record, by)
    return [_kept(one, done.get(name), works.get(name), folder / name) for one, name in zip(found, names, strict=True)]


def _kept(one: Candidate, done: Done | None, work: ReadingProfile | None, folder: Path) -> ReadProfile:
    if done is None or work is None:
        return ReadProfile(given=one, record={"status": "refused", "reason": one.problem, "remedy": one.remedy})
    if done.failure is not None:
        return ReadProfile(given=one, record={"status": "refused", "reason": done.failure, "remedy": "read it alone"})
    if done.value["status"] == "refused":
        return ReadProfile(given=one, record=done.value)
    filters = work.filters_mm if done.value["measured"] else ()
    kept = Kept(body=one.body, spec=one.spec, reading=work.reading, folder=folder.absolute(), filters_mm=filters)
    return ReadProfile(given=one, record=done.value, kept=kept)


def _do(works: Mapping[str, Work], labels: Mapping[str, str], folder: Path, read: Any, by: OpenRun) -> dict[str, Done]:
    """Do all jobs that are not finished, by their ids, which are the names of their folders.

    Raises
    ------
    FecontactError
        A job ended with an error of the program, which is neither a result nor a refusal.
    """
    found: dict[str, Done] = {}
    here = folder.absolute()
    jobs = [
        Job(
            name=name,
            folder=here / name,
            origin=origin(),
            origin_here=origin,
            work=work,
            read=read,
            label=labels[name],
        )
        for name, work in works.items()
    ]
    finish(jobs, by, on_done=lambda done: found.update({done.name: done}))
    if wrong := [done for done in found.values() if done.program_error]:
        first = wrong[0]
        raise FecontactError(
            f"{len(wrong)} of {len(jobs)} jobs ended with an error of the program, the first one,"
            f" {labels[first.name]}, with {first.failure} in {here}; nothing is reported of a fleet with such errors;"
            " report the error; with a mended program the same command resumes"
        )
    return found


# --- Pairs.


def _population(fleet: Fleet, profiles: Sequence[ReadProfile]) -> dict[Pair, float]:
    weights: dict[str, dict[str, float]] = {"wheel": {}, "rail": {}}
    for one in profiles:
        if one.kept is not None:
            weights[one.given.body][one.given.name] = one.given.weight
    for body, read in weights.items():
        if not read:
            why = next(_why(one) for one in profiles if one.given.body == body)
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


def _screen(
    fleet: Fleet, profiles: Sequence[ReadProfile], pairs: Mapping[Pair, float], out: Path, by: OpenRun
) -> dict[Pair, str]:
    """Screen what is not screened; why pairs failed."""
    named = list(_names(fleet, profiles, _in_tiles(pairs)))
    labels = {name: f"{wheel} on {rail}" for (wheel, rail), name, _ in named}
    done = _do({name: work for _, name, work in named}, labels, out / "pairs", None, by)
    return {pair: why for pair, name, _ in named if (why := done[name].failure) is not None}


def _in_tiles(pairs: Iterable[Pair]) -> list[Pair]:
    """Pairs in an order in which few wheels meet few rails at a time, whose lines a worker keeps at hand."""
    given = list(pairs)
    wheels, rails = (
        {name: k // TILE for k, name in enumerate(dict.fromkeys(pair[body] for pair in given))} for body in (0, 1)
    )
    return sorted(given, key=lambda pair: (wheels[pair[0]], rails[pair[1]], pair))


def _write_screen(
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


def _seal(fleet: Fleet, screened: Screened) -> None:
    record = {
        "kind": "fleet",
        "headline": screened.headline,
        "population": _words(fleet, screened),
        "theory": fleet.theory,
        "filters_mm": list(fleet.filters_mm),
        "seed": fleet.seed,
        "limits": fleet.case.criteria.limits,
        "positions_mm_kN_weight": [[*one, weight] for one, weight in fleet.positions.items()],
        "pairs": screened.pairs,
        "positions": screened.positions,
        "files": screened.profiles,
        "refused_files": dict(screened.refused),
        "verdicts": dict(screened.verdicts),
        "folder": str(fleet.folder),
        "made_by": dict(origin().solved_by),
    }
    write_sealed(screened.out / FLEET, record, [screened.out / PROFILES])


def _words(fleet: Fleet, screened: Screened) -> str:
    how = "listed" if fleet.pairing.table else "drawn at random" if fleet.pairing.draw else "every wheel on every rail"
    ends = [f"{min(one):.4g} to {max(one):.4g}" for one in zip(*fleet.positions, strict=True)]
    return (
        f"{screened.pairs} pairs ({how}) of the wheels {', '.join(fleet.wheels)} and rails {', '.join(fleet.rails)},"
        f" each at {len(fleet.positions)} positions (shifts of {ends[0]} mm, loads of {ends[1]} kN) by their weights"
    )


# --- A fleet before it is screened, and one that was.

# CPU seconds of a file, of a pair, of a shift and of a position on each line of it; MB of a worker, kB of a pair in the
# process that hands them out. 100 wheels on 10 rails, measured, at ten positions took 0.9 s a pair on a busy machine.
_FILE_S, _PAIR_S, _PLACE_S, _POSITION_S, _WORKER_MB, _PAIR_KB = 0.6, 0.1, 0.02, 0.025, 270.0, 4.0


@dataclass(frozen=True, kw_only=True)
class Checked:
    """What a fleet will take; files are not read for it."""

    wheels: int
    rails: int
    pairs: int
    positions: int
    cpu_seconds: float
    memory_MB: float

    @property
    def words(self) -> str:
        """All of it in a sentence, without the time."""
        files = f"{self.wheels} wheels, {self.rails} rails, {self.pairs} pairs, {self.positions} positions"
        return f"{files}; about {self.memory_MB:.0f} MB per worker"


def check_fleet(fleet: str | Path) -> Checked:
    """How many positions a fleet has, and about what time and memory they take; nothing is read but tables.

    Raises
    ------
    InputError
        As `run_fleet` does, as far as no profile must be read for it.
    """
    asked = read_fleet(Path(fleet))
    found = {body: [one for one in candidates(asked, body) if not one.problem] for body in BODIES}
    weights = {body: {one.name: one.weight for one in given} for body, given in found.items()}
    known = {f"{body} {name}" for body, names in weights.items() for name in names}
    pairs = len(pairs_of(asked, weights["wheel"], weights["rail"], known))
    positions, lines = len(asked.positions), len(asked.filters_mm)
    of_pair = _PAIR_S + lines * (len(asked.shifts_mm) * _PLACE_S + positions * _POSITION_S)
    files = sum(map(len, found.values()))
    return Checked(
        wheels=len(found["wheel"]),
        rails=len(found["rail"]),
        pairs=pairs,
        positions=pairs * positions,
        cpu_seconds=files * _FILE_S + pairs * of_pair,
        memory_MB=_WORKER_MB + 1e-3 * _PAIR_KB * pairs,
    )


@dataclass(frozen=True, kw_only=True)
class Opened:
    """A fleet that was screened, for what is done with its positions."""

    out: Path
    fleet: Fleet
    record: Mapping[str, Any]
    _rows: Mapping[tuple[str, str], Row]

    def case(self, wheel: str, rail: str, shift_mm: float, load_kN: float) -> Case:
        """The case of a position, with the names of wheel and rail in `profiles.parquet`."""
        given: dict[str, Any] = {}
        for body, named in zip(BODIES, (wheel, rail), strict=True):
            row = self._rows[body, named]
            own = {name: row.get(name) for name in ("mirror", "rolling_radius_mm")}
            one = Candidate(body=body, name=named, spec=row["file"], known=own)
            given |= {body: row["file"], f"{body}_file": used_reading(one.spec, _reading(self.fleet, one))}
        radius = self._rows["wheel", wheel].get("rolling_radius_mm")
        if radius is not None and math.isfinite(radius):
            given["rolling_radius_mm"] = float(radius)
        return replace(self.fleet.case, **given, lateral_shift_mm=shift_mm, load_N=1e3 * load_kN)


def open_fleet(out: str | Path) -> Opened:
    """A fleet that `run_fleet` has screened.

    Raises
    ------
    InputError
        If the folder has none.
    """
    folder = Path(out)
    if not (folder / FLEET).is_file() or not (folder / TABLE).is_file():
        raise InputError(f"{folder}: it has no {FLEET}; give the folder of a finished `fecontact fleet run`")
    record = read_json(folder / FLEET)
    rows = of_arrow("parquet").ParquetFile(folder / PROFILES).read().to_pylist()
    return Opened(
        out=folder,
        fleet=read_fleet(folder / TABLE, Path(record["folder"])),
        record=record,
        _rows={(row["body"], row["name"]): row for row in rows},
    )
