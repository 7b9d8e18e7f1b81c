"""Files of a fleet's profiles, read and smoothed as jobs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.features.fleet.fleet_jobs import run_fleet_jobs
from fecontact.features.fleet.model import Fleet
from fecontact.features.fleet.population import Candidate
from fecontact.features.fleet.quality_gate import is_left_out, judge_profile
from fecontact.features.fleet.reading import ReadingProfile, StoredProfile, read_record
from fecontact.features.fleet.screening_rows import Row
from fecontact.features.fleet.sealed_folder import PROFILE_JOBS, SYSTEM_REMEDY
from fecontact.features.fleet.table_columns import (
    ACCEPTED_COLUMN,
    INCLINATION_COLUMN,
    OPPOSITE_FILE,
    OPPOSITE_HASH,
    OPPOSITE_INPUTS,
    OPPOSITE_OPTIONS,
    OPPOSITE_RADIUS,
    RADIUS_COLUMN,
    READ,
    REFUSED,
    TRACK_COLUMNS,
    UNREAD,
    select_case_values,
    select_reading_values,
    set_case_values,
)
from fecontact.inputs.texts import count_text
from fecontact.jobs.engine import OpenRun
from fecontact.jobs.workers import JobOutcome
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import radius_note, radius_of_file_mm
from fecontact.runs.identity import digest_json

# Names that are shown for each kind of reason.
_MOST_NAMES = 3
# Parts by which reasons of one kind differ: the name of a copied file, quoted texts, paths and numbers.
_VARYING_TEXT = re.compile(r"(?<=same content as ).*?(?=;)|'[^']*'|\S*[/\\]\S*|[-+]?\d[\d.]*(?:e[-+]?\d+)?")


@dataclass(frozen=True, kw_only=True)
class ReadProfile:
    """A profile of a fleet with the result of its reading.

    Attributes
    ----------
    candidate
        The profile before it was read.
    record
        Record of the reading.
    stored
        The stored profile; None if the profile is suspicious, was refused or not read.
    radius_note
        Contradiction between the rolling radius and the header of the file; empty if there is none.
    stored_opposite
        The stored profile of the other side; None for the mirror image.
    """

    candidate: Candidate
    record: Mapping[str, Any]
    stored: StoredProfile | None = None
    radius_note: str = ""
    stored_opposite: StoredProfile | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of the reader, and the contradiction of the radius to the header of the file."""
        return (*self.record.get("notes", ()), *filter(None, (self.radius_note,)))

    @property
    def row(self) -> Row:
        """Row of `profiles.parquet`.

        Columns: identity, status with reason and remedy, noise (um), filter lengths (mm), wear (mm), weight, notes of
        the reader, dimensions of the flange (mm), then the inputs and the metadata of its row in a table, and the file
        of the other side.
        """
        candidate, record = self.candidate, self.record
        filters = ", ".join(dict.fromkeys(f"{length:.3g}" for _, length, *_ in record.get("lines", ())))
        columns = {
            **{
                "body": candidate.body,
                "name": candidate.name,
                "file": candidate.spec,
                "content_hash": candidate.content_hash,
            },
            **{"status": record["status"], "reason": record.get("reason", ""), "remedy": record.get("remedy", "")},
            **{"noise_um": record.get("noise_um"), "filter_mm": filters, "nominal": record.get("nominal", "")},
            **{"wear_mm": record.get("wear_mm"), "weight": candidate.weight, "reader_notes": "\n".join(self.notes)},
            "suspicions": ", ".join(dict.fromkeys(record.get("kinds", ()))),
            **{f"flange_{name}": record.get("flange", {}).get(name) for name in ("height_mm", "thickness_mm", "qr_mm")},
        }
        if opposite := candidate.opposite:
            columns |= {
                OPPOSITE_FILE: opposite.spec,
                OPPOSITE_HASH: opposite.content_hash,
                OPPOSITE_RADIUS: find_opposite_radius_mm(candidate),
                **{column: opposite.known.get(name) for column, name in OPPOSITE_OPTIONS.items()},
            }
        return {**columns, **candidate.known, **candidate.metadata}


def read_refusal_reason(profile: ReadProfile) -> str:
    """Reason why a profile is suspicious or refused."""
    return str(profile.record["reason"])


def list_reasons(profiles: Sequence[ReadProfile], *statuses: str) -> dict[str, str]:
    """Reasons and remedies of the profiles with some statuses.

    Parameters
    ----------
    profiles
        Results of the readings.
    *statuses
        Such as `REFUSED`.

    Returns
    -------
    dict
        Reason, with the remedy after a semicolon, by body and name.
    """
    return {
        f"{profile.candidate.body} {profile.candidate.name}": "; ".join(
            filter(None, (read_refusal_reason(profile), profile.record.get("remedy")))
        )
        for profile in profiles
        if profile.record["status"] in statuses
    }


def find_kind(text: str, profile_name: str) -> str:
    """Kind of a reason or a note: its text without varying parts.

    The varying parts are numbers, paths, quoted texts and the name of the profile.

    Parameters
    ----------
    text
        Reason or note on a file.
    profile_name
        Name of the profile.

    Returns
    -------
    str
        Text with `...` in place of these parts.

    Examples
    --------
    >>> from fecontact.features.fleet.profile_files import find_kind
    >>> find_kind("wheel7: 3 points are left out", "wheel7")
    '...: ... points are left out'
    """
    return _VARYING_TEXT.sub("...", re.sub(rf"(?<!\w){re.escape(profile_name)}(?!\w)", "...", text))


def group_reasons(reasons: Mapping[str, str]) -> dict[str, str]:
    """First reason of each kind of reasons, by the number and names of its profiles.

    Kinds are by `find_kind`.

    Parameters
    ----------
    reasons
        Reason of each profile, by body and name.

    Returns
    -------
    dict
        Reason by words such as "4 files, wheel a, wheel b, wheel c, ...", or by the only name.

    Examples
    --------
    >>> from fecontact.features.fleet.profile_files import group_reasons
    >>> group_reasons({"rail a": "/data/a.csv has 3 points; give 50", "rail b": "/data/b.csv has 5 points; give 50"})
    {'2 files, rail a, rail b': '/data/a.csv has 3 points; give 50'}
    """
    names_by_kind: dict[str, list[str]] = {}
    for name, reason in reasons.items():
        names_by_kind.setdefault(find_kind(reason, name.partition(" ")[2]), []).append(name)
    groups = {}
    for names in names_by_kind.values():
        omitted = ", ..." * (len(names) > _MOST_NAMES)
        count = f"{count_text(len(names), 'file')}, " * (len(names) > 1)
        groups[f"{count}{', '.join(names[:_MOST_NAMES])}{omitted}"] = reasons[names[0]]
    return groups


def mark_unusable(fleet: Fleet, one: Candidate) -> Candidate:
    """Give a profile a problem if its row is not usable.

    A row is not usable if no case can have its inputs, or if it leaves the profile out.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    one
        Profile.

    Returns
    -------
    Candidate
        The profile, or a copy with problem and remedy.
    """
    if one.problem:
        return one
    if one.opposite is not None:
        one = replace(one, opposite=mark_unusable(fleet, one.opposite))
    if is_left_out(one):
        return replace(one, problem="accepted is no in its table", remedy="give accepted = yes to use it")
    try:
        select_reading(fleet, one)
        set_case_values(fleet.case, select_case_values(one.known))
        _refuse_different_opposite(fleet, one)
    except InputError as error:
        reason, _, remedy = str(error).partition("; ")
        return replace(one, problem=reason, remedy=remedy)
    return one


def _refuse_different_opposite(fleet: Fleet, candidate: Candidate) -> None:
    """Refuse a row that names a row with a different inclination or track.

    A case has one rail inclination and one track for both sides.

    Raises
    ------
    InputError
        With the name of the row and the inputs that differ.
    """
    opposite = candidate.opposite
    if opposite is None or not opposite.has_row:
        return
    case, opposite_case = (
        set_case_values(fleet.case, select_case_values(profile.known)) for profile in (candidate, opposite)
    )
    different = [
        *[INCLINATION_COLUMN] * (case.inclination_rad != opposite_case.inclination_rad),
        *(name for name in TRACK_COLUMNS if getattr(case.track, name) != getattr(opposite_case.track, name)),
    ]
    if different:
        raise InputError(
            f"{OPPOSITE_INPUTS[candidate.body]} is the row {opposite.name!r} with different values of"
            f" {', '.join(different)}, which both sides of a case share; give both rows equal values"
        )


def find_opposite_radius_mm(candidate: Candidate) -> float | None:
    """Rolling radius of the other wheel, from its row or the header of its file.

    Parameters
    ----------
    candidate
        Profile after `with_radius`.

    Returns
    -------
    float or None
        Radius in mm; None for the mirror image, for a rail, and if neither a row nor a header gives it.
    """
    opposite = candidate.opposite
    return None if opposite is None or candidate.body == "rail" else opposite.known.get(RADIUS_COLUMN)


def with_radius(fleet: Fleet, candidate: Candidate) -> Candidate:
    """Candidate and its other side with their rolling radii.

    A radius that the table does not give follows from the case, or else from the header of the file. The radius of a
    wheel of the other side that is not a row follows from `[case.opposite]`, or else from the header of its file; this
    is the order of a case.

    Parameters
    ----------
    fleet
        Fleet with its case.
    candidate
        Profile file with the values of its table.

    Returns
    -------
    Candidate
        The candidate with radii in mm where there are any.
    """
    opposite = candidate.opposite
    if opposite is not None and candidate.body == "wheel" and not candidate.problem and not opposite.problem:
        if opposite.has_row:
            opposite = _add_header_radius(fleet, opposite)
            radius_mm = opposite.known.get(RADIUS_COLUMN, float(fleet.case.rolling_radius_mm))
        else:
            radius_mm = fleet.case.opposite.rolling_radius_mm or radius_of_file_mm(opposite.spec)
        candidate = replace(candidate, opposite=replace(opposite, known={**opposite.known, RADIUS_COLUMN: radius_mm}))
    return _add_header_radius(fleet, candidate)


def _add_header_radius(fleet: Fleet, candidate: Candidate) -> Candidate:
    """Candidate with the rolling radius of its header, if neither its table nor the case gives a radius."""
    if candidate.problem:
        return candidate
    is_given = fleet.case.is_radius_given or candidate.known.get(RADIUS_COLUMN) is not None
    if candidate.body == "rail" or is_given:
        return candidate
    radius_mm = radius_of_file_mm(candidate.spec)
    if radius_mm is None:
        return candidate
    return replace(candidate, known={**candidate.known, RADIUS_COLUMN: radius_mm})


def _find_radius_note(fleet: Fleet, candidate: Candidate) -> str:
    """Contradiction between the rolling radius of a wheel and the header of its file; empty if there is none."""
    if candidate.body == "rail":
        return ""
    return radius_note(candidate.spec, candidate.known.get(RADIUS_COLUMN) or fleet.case.rolling_radius_mm)


def select_reading(fleet: Fleet, candidate: Candidate) -> Reading:
    """Reading options of a profile.

    Options of its row in a table come first, then those of its body, then the filter of the fleet.

    Parameters
    ----------
    fleet
        Fleet with its case.
    candidate
        Profile file with the values of its table.

    Returns
    -------
    Reading
        Options of reading this file.
    """
    reading = fleet.case.wheel_file if candidate.body == "wheel" else fleet.case.rail_file
    if reading.filter_mm is None and fleet.filter_mm is not None:
        reading = replace(reading, filter_mm=fleet.filter_mm)
    reading = replace(reading, **select_reading_values(candidate.known))
    # a head is used as it is: it is not mirrored
    if candidate.body == "rail" and candidate.known.get(ACCEPTED_COLUMN) and reading.mirror is None:
        return replace(reading, mirror=False)
    return reading


def read_profiles(fleet: Fleet, candidates: Sequence[Candidate], out: Path, open_run: OpenRun) -> list[ReadProfile]:
    """Read the profiles of both sides of a fleet as jobs, unless they are finished.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    candidates
        Profiles of the fleet.
    out
        Folder of the results.
    open_run
        The run that executes the jobs.

    Returns
    -------
    list of ReadProfile
        The result of each profile, in order. A profile whose other side cannot be used is refused.
    """
    opposites = [
        candidate.opposite for candidate in candidates if candidate.opposite is not None and not candidate.problem
    ]
    profiles = _read_files(fleet, [*candidates, *opposites], out, open_run)
    read_opposites = iter(profiles[len(candidates) :])
    return [
        profile
        if profile.candidate.opposite is None or profile.candidate.problem
        else _join_opposite(profile, next(read_opposites))
        for profile in profiles[: len(candidates)]
    ]


def _read_files(fleet: Fleet, candidates: Sequence[Candidate], out: Path, open_run: OpenRun) -> list[ReadProfile]:
    """Results of reading files, in order; each content is read once with the same options."""
    works: dict[str, ReadingProfile] = {}
    job_ids: list[str] = []
    for candidate in candidates:
        if candidate.problem:
            job_ids.append("")
            continue
        work = _make_work(fleet, candidate)
        # the file suffix determines how the content is read
        identity = (
            candidate.body,
            candidate.content_hash or candidate.spec,
            Path(candidate.spec).suffix.lower(),
            repr(work.reading),
            work.gauge_depth_mm,
        )
        job_ids.append(digest_json(identity)[:20])
        works[job_ids[-1]] = work
    folder = out / PROFILE_JOBS
    outcomes = run_fleet_jobs(
        works, {job_id: Path(work.spec).name for job_id, work in works.items()}, folder, read_record, open_run
    )
    return [
        replace(
            _collect_profile(fleet, candidate, outcomes.get(job_id), works.get(job_id), folder / job_id),
            radius_note=_find_radius_note(fleet, candidate),
        )
        for candidate, job_id in zip(candidates, job_ids, strict=True)
    ]


def _make_work(fleet: Fleet, candidate: Candidate) -> ReadingProfile:
    """Job that reads the file of a profile."""
    track = fleet.case.track
    return ReadingProfile(
        body=candidate.body,
        spec=candidate.spec,
        content_hash=candidate.content_hash,
        reading=select_reading(fleet, candidate),
        gauge_depth_mm=0.0 if track.rail_crown_y_mm is not None else track.gauge_depth_mm,
    )


def check_profile(fleet: Fleet, candidate: Candidate) -> ReadProfile:
    """Read the points of a profile without smoothing and storing them.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    candidate
        Profile after `mark_unusable`.

    Returns
    -------
    ReadProfile
        Profile with the status `read`, or with the status, reason and remedy that a run would give.
    """
    profile = _check_file(fleet, candidate)
    opposite = candidate.opposite
    return profile if opposite is None else _join_opposite(profile, _check_file(fleet, opposite))


def _check_file(fleet: Fleet, candidate: Candidate) -> ReadProfile:
    """Read the points of a file without smoothing and storing them."""
    if candidate.problem:
        return _refuse_candidate(candidate)
    refusal = _find_refusal(_make_work(fleet, candidate))
    return ReadProfile(
        candidate=candidate, record={"status": READ} if refusal is None else judge_profile(fleet, candidate, refusal)
    )


# A file can be the other side of many profiles.
@lru_cache(maxsize=1024)
def _find_refusal(work: ReadingProfile) -> dict[str, Any] | None:
    """Record of a file that is refused; None if its points can be used."""
    return work.find_refusal()


def _join_opposite(profile: ReadProfile, opposite: ReadProfile) -> ReadProfile:
    """Join a profile with the profile of its other side.

    A profile is refused if the profile of its other side cannot be used. If the other side is suspicious, the status is
    `refused`, because the file of this profile is not suspicious. If the other side was not read for want of memory,
    disk space or workers, the status is `unread`.
    """
    if profile.record["status"] != READ:
        return profile
    if opposite.record["status"] == READ:
        return replace(profile, stored_opposite=opposite.stored)
    body, reason = profile.candidate.body, read_refusal_reason(opposite)
    remedy = opposite.record.get("remedy", "")
    if not opposite.candidate.has_row and opposite.record["status"] != UNREAD:
        remedy += (
            f"{remedy and '; '}the file was read with the options of this row: if it needs different options, give it"
            f" a row of its own with them, and name that row in {OPPOSITE_INPUTS[body]} (weight = 0 leaves that row out"
            " of the answer)"
        )
    record = {
        **profile.record,
        "status": UNREAD if opposite.record["status"] == UNREAD else REFUSED,
        "reason": f"its opposite {body} {opposite.candidate.spec} cannot be used: {reason}",
        "remedy": remedy,
    }
    return replace(profile, record=record, stored=None)


def _refuse_candidate(candidate: Candidate) -> ReadProfile:
    """Profile that is refused with the problem of its candidate."""
    return ReadProfile(
        candidate=candidate, record={"status": REFUSED, "reason": candidate.problem, "remedy": candidate.remedy}
    )


def _collect_profile(
    fleet: Fleet, candidate: Candidate, outcome: JobOutcome | None, work: ReadingProfile | None, folder: Path
) -> ReadProfile:
    """Result of a profile from the outcome of its job, or its refusal.

    A profile without a job is refused with the problem of its candidate. The quality gate judges a profile that was
    read. A job that failed because of its content is a
    refusal with the failure as reason; a lack of memory, a full disk or a lost process is not a property of the file.
    """
    if outcome is None or work is None:
        return _refuse_candidate(candidate)
    if outcome.failure is not None and outcome.is_system_failure:
        record = {"status": UNREAD, "reason": outcome.failure, "remedy": SYSTEM_REMEDY}
        return ReadProfile(candidate=candidate, record=record)
    if outcome.failure is not None:
        return ReadProfile(
            candidate=candidate,
            record={"status": REFUSED, "reason": outcome.failure, "remedy": "check it with `fecontact profiles`"},
        )
    record = judge_profile(fleet, candidate, outcome.value)
    if record["status"] != READ:
        return ReadProfile(candidate=candidate, record=record)
    labels = tuple(label for label, *_ in outcome.value.get("lines", ()))
    stored = StoredProfile(
        body=candidate.body, spec=candidate.spec, reading=work.reading, folder=folder.absolute(), labels=labels
    )
    return ReadProfile(candidate=candidate, record=record, stored=stored)
