"""The profiles of a fleet: each file is read and smoothed once, and kept, as is the reason of one that is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from fecontact import __version__
from fecontact.errors import InputError
from fecontact.features.fleet.population import Body
from fecontact.files import read_json, sha256, write_json
from fecontact.jobs.store import Origin
from fecontact.jobs.workers import Made
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import is_known, load
from fecontact.profiles.points import checked, is_exact
from fecontact.profiles.reading import Reading
from fecontact.profiles.recognition import line_through
from fecontact.profiles.resolve import content_of_file, resolve_rail, resolve_wheel
from fecontact.profiles.segments import Held, Registration
from fecontact.profiles.variants import pieces_of
from fecontact.runs.identity import json_digest
from fecontact.runs.sources import digests

_RECORD, _LINES = "profile.json", "lines.npz"
TILE = 16
"""Wheels, and rails, that are screened at a time."""
# Lines that a worker keeps at hand: two of each; a line has 1 MB with the tables that are made of it.
_AT_HAND = 4 * TILE + 4
_FEWEST = 20


@cache
def origin() -> Origin:
    """Versions and sources that decide about what is screened."""
    from importlib import metadata

    own = [sha256(Path(__file__).with_name(name)) for name in ("reading.py", "screening.py")]
    sources = json_digest([digests().solving, digests().evaluating, *own])
    versions = {name: metadata.version(name) for name in ("numpy", "scipy")}
    return Origin(solved_by={"fecontact": __version__, **versions, "source of fleets": sources}, evaluated_by={})


@dataclass(frozen=True, kw_only=True)
class Kept:
    """A profile that was read: where its lines are kept, and how to get those that are exact.

    Attributes
    ----------
    filters_mm
        Of its smoothed lines; empty for an exact line.
    """

    body: Body
    spec: str
    reading: Reading
    folder: Path
    filters_mm: tuple[float, ...]

    def line(self, filter_mm: float) -> Profile:
        """The line smoothed over a wave length; an exact one whatever that is."""
        return _line(self, filter_mm if self.filters_mm else 0.0)


@lru_cache(maxsize=_AT_HAND)
def _line(kept: Kept, filter_mm: float) -> Profile:
    if not kept.filters_mm:
        return _exact(kept.body, kept.spec, kept.reading)
    record = read_json(kept.folder / _RECORD)
    with np.load(kept.folder / _LINES, allow_pickle=False) as stored:
        number = kept.filters_mm.index(filter_mm)
        s, values, relative = (stored[f"{name}{number}"] for name in ("s", "values", "relative"))
    nominal, turn, shift = record["lines"][number]
    held = Held(
        points=np.empty((0, 2)),
        s_mm=s,
        values=values,
        normals=np.empty((0, 2)),
        relative_filter=relative if relative.size else None,
        nominal=nominal,
        registration=Registration(turn_rad=turn, shift=tuple(shift)),
        reference=load(nominal).segments if nominal else (),
    )
    return Profile(name=record["name"], kind=kept.body, segments=pieces_of(held, filter_mm))


def _exact(body: Body, spec: str, reading: Reading) -> Profile:
    return resolve_rail(spec, reading) if body == "rail" else resolve_wheel(spec, reading).profile


@dataclass(frozen=True, kw_only=True)
class ReadingProfile:
    """What a worker does with a file: read it, smooth it over each wave length, and keep the lines, or the refusal."""

    body: Body
    spec: str
    content_hash: str
    reading: Reading
    filters_mm: tuple[float, ...]

    def __call__(self, folder: Path, finished: Path | None) -> Made:
        """Write the record, and the lines of measured points."""
        try:
            lines = self._lines()
        except InputError as error:
            reason, _, remedy = str(error).partition("; ")
            write_json(folder / _RECORD, {"status": "refused", "reason": reason, "remedy": remedy})
            return Made()
        if self.content_hash and sha256(Path(self.spec)) != self.content_hash:
            raise InputError(f"{self.spec} changed while it was read; give the same command again")
        write_json(folder / _RECORD, _record(lines))
        if lines[0].measured is not None:
            _keep(lines, folder / _LINES)
        return Made()

    def _lines(self) -> list[Profile]:
        exact = replace(self.reading, filter_mm=0.0)
        if is_known(self.spec):
            return [_exact(self.body, self.spec, self.reading)]
        found = content_of_file(self.spec, self.body, self.reading)
        if isinstance(found, Profile):
            return [found]
        if self.reading.filter_mm == 0.0 or len(found.points) < _FEWEST or is_exact(checked(found, exact).points):
            return [line_through(found, exact)]
        return [line_through(found, replace(self.reading, filter_mm=one)) for one in self.filters_mm]


def _record(lines: list[Profile]) -> dict[str, Any]:
    first = lines[0].measured
    told: dict[str, Any] = {"status": "read", "name": lines[0].name, "measured": first is not None}
    told["notes"] = list(lines[0].notes)
    if first is None:
        return told
    wear = float(np.hypot(*first.held.values.T).max()) if first.nominal else None
    of_lines = []
    for line in lines:
        assert line.measured is not None
        held = line.measured.held
        of_lines.append((held.nominal, held.registration.turn_rad, held.registration.shift))
    return {**told, "noise_um": 1e3 * first.noise_mm, "nominal": first.nominal, "wear_mm": wear, "lines": of_lines}


def _keep(lines: list[Profile], path: Path) -> None:
    arrays: dict[str, Any] = {}
    for number, line in enumerate(lines):
        assert line.measured is not None
        held = line.measured.held
        relative = np.empty(0) if held.relative_filter is None else held.relative_filter
        arrays |= {f"s{number}": held.s_mm, f"values{number}": held.values, f"relative{number}": relative}
    np.savez(path, **arrays)


def read_record(folder: Path) -> Mapping[str, Any]:
    """What is kept of a file that was read or refused."""
    record = read_json(folder / _RECORD)
    if not isinstance(record, dict) or record.get("status") not in ("read", "refused"):
        raise InputError(f"{folder / _RECORD}: it has another layout; it is read again")
    return cast("Mapping[str, Any]", record)
