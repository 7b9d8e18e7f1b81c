"""Files of a fleet's profiles, read and smoothed as jobs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.features.fleet.fleet_jobs import do_jobs
from fecontact.features.fleet.model import Fleet
from fecontact.features.fleet.population import Candidate
from fecontact.features.fleet.reading import Kept, ReadingProfile, read_record
from fecontact.features.fleet.screening_rows import Row
from fecontact.inputs.kinds import as_truth
from fecontact.jobs.engine import OpenRun
from fecontact.jobs.workers import Done
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import radius_note, radius_of_file_mm
from fecontact.runs.identity import json_digest


@dataclass(frozen=True, kw_only=True)
class ReadProfile:
    """A file of a fleet with what its reading gave."""

    given: Candidate
    record: Mapping[str, Any]
    kept: Kept | None = None
    radius_note: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """What its reader assumed, and what contradicts its header."""
        return (*self.record.get("notes", ()), *filter(None, (self.radius_note,)))

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


def refusal_reason(one: ReadProfile) -> str:
    """Reason for which a profile is refused."""
    return str(one.record["reason"])


def mark_unusable(fleet: Fleet, one: Candidate) -> Candidate:
    """A profile whose table has a radius or a side that no case can have has a problem."""
    if one.problem:
        return one
    try:
        reading_of_candidate(fleet, one)
        if (radius := one.known.get("rolling_radius_mm")) is not None:
            replace(fleet.case, rolling_radius_mm=radius)
    except InputError as error:
        reason, _, remedy = str(error).partition("; ")
        return replace(one, problem=reason, remedy=remedy)
    return one


def with_radius(fleet: Fleet, one: Candidate) -> Candidate:
    """A wheel with the rolling radius of its file's header, where neither its table nor the case gives one."""
    if one.body == "rail" or fleet.case.is_radius_given or one.known.get("rolling_radius_mm") is not None:
        return one
    radius = radius_of_file_mm(one.spec)
    return one if radius is None else replace(one, known={**one.known, "rolling_radius_mm": radius})


def _radius_note(fleet: Fleet, one: Candidate) -> str:
    """What the rolling radius of a wheel contradicts in the header of its file; empty for nothing."""
    radius = one.known.get("rolling_radius_mm")
    return "" if one.body == "rail" else radius_note(one.spec, radius or fleet.case.rolling_radius_mm)


def reading_of_candidate(fleet: Fleet, one: Candidate) -> Reading:
    """Reading options of a profile: those of the fleet with the side in its table."""
    base = fleet.case.wheel_file if one.body == "wheel" else fleet.case.rail_file
    mirror = one.known.get("mirror")
    return base if mirror is None else replace(base, mirror=as_truth(mirror))


def read_profiles(fleet: Fleet, found: Sequence[Candidate], out: Path, by: OpenRun) -> list[ReadProfile]:
    """Read the profiles of a fleet as jobs, those that are not finished."""
    works: dict[str, ReadingProfile] = {}
    names: list[str] = []
    for one in found:
        reading = reading_of_candidate(fleet, one)
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
    done = do_jobs(works, {name: Path(work.spec).name for name, work in works.items()}, folder, read_record, by)
    return [
        replace(_kept(one, done.get(name), works.get(name), folder / name), radius_note=_radius_note(fleet, one))
        for one, name in zip(found, names, strict=True)
    ]


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
