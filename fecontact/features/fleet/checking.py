"""Check of a fleet before it is screened, and a fleet that was screened."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, read_fleet
from fecontact.features.fleet.population import BODIES, Candidate, candidates, pairs_of
from fecontact.features.fleet.profile_files import reading_of_candidate
from fecontact.features.fleet.running import FLEET, TABLE
from fecontact.features.fleet.screening_rows import Row
from fecontact.features.fleet.tables import PROFILES, of_arrow
from fecontact.files import read_json
from fecontact.profiles.resolve import used_reading

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
            given |= {body: row["file"], f"{body}_file": used_reading(one.spec, reading_of_candidate(self.fleet, one))}
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
