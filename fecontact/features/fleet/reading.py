"""Profiles of a fleet: each file is read, smoothed and stored once.

The reason of a refused file is stored too.
"""

from __future__ import annotations

import errno
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from fecontact import __version__
from fecontact.errors import InputError, MemoryShortageError
from fecontact.features.fleet.table_columns import Body
from fecontact.files import hash_file, read_json, write_json
from fecontact.jobs.store import Origin
from fecontact.jobs.workers import WorkResult
from fecontact.profiles.curve import Profile
from fecontact.profiles.flange import measure_flange
from fecontact.profiles.library import is_library_name, load_library_profile
from fecontact.profiles.plausibility import find_suspicions
from fecontact.profiles.points import ProfilePoints, check_points
from fecontact.profiles.reading import Reading
from fecontact.profiles.remedies import read_or_explain
from fecontact.profiles.resolve import read_profile_content, resolve_rail, resolve_wheel
from fecontact.profiles.segments import Registration, SmoothingFrame
from fecontact.profiles.suspicions import Suspicion, SuspiciousProfileError
from fecontact.profiles.variants import build_smoothed_segments
from fecontact.runs.identity import digest_json
from fecontact.runs.sources import read_digests
from fecontact.solving.profile_variants import label_reference, list_profile_variants

_RECORD_FILE, _VARIANTS_FILE = "profile.json", "lines.npz"
TILE_SIZE = 8
"""Number of wheels, and of rails, that are screened at a time."""
# Number of profile variants in the memory of a worker: up to eight of each profile. A variant has 1 MB with its tables.
_CACHED_VARIANTS = 16 * TILE_SIZE + 4
# Modules of this folder that determine the result of a file or a pair.
_SOURCES = ("reading.py", "screening.py", "screened_position.py", "screening_rows.py")


@cache
def find_origin() -> Origin:
    """Versions and sources that determine the result of a screening.

    Returns
    -------
    Origin
        Versions of the program, of numpy and of scipy, and a digest of the sources.
    """
    from importlib import metadata

    source_hashes = [hash_file(Path(__file__).with_name(name)) for name in _SOURCES]
    sources = digest_json([read_digests().solving, read_digests().evaluating, *source_hashes])
    versions = {name: metadata.version(name) for name in ("numpy", "scipy")}
    return Origin(solved_by={"fecontact": __version__, **versions, "source of fleets": sources}, evaluated_by={})


@dataclass(frozen=True, kw_only=True)
class StoredProfile:
    """A profile that was read, with the folder of its profile variants.

    Attributes
    ----------
    body, spec, reading
        Wheel or rail, file or name in the library, and reading options.
    folder
        Folder of the stored variants.
    labels
        Labels of its smoothed variants, with the reference variant first; empty for a profile that is not smoothed.
    """

    body: Body
    spec: str
    reading: Reading
    folder: Path
    labels: tuple[str, ...]

    @property
    def reference_label(self) -> str:
        """Label of the reference variant; empty for a profile that is not smoothed."""
        return self.labels[0] if self.labels else ""

    @property
    def other_labels(self) -> tuple[str, ...]:
        """Labels of the variants besides the reference variant."""
        return self.labels[1:] if self.labels else tuple(list_profile_variants(_read_variant(self, "")))

    def variant(self, label: str) -> Profile:
        """Profile variant with a label.

        Parameters
        ----------
        label
            Label of a variant of this profile or of the other profile of a pair.

        Returns
        -------
        Profile
            The profile variant; the reference variant if the profile has no variant with this label.
        """
        return _read_variant(self, label if label in self.other_labels else self.reference_label)


@lru_cache(maxsize=_CACHED_VARIANTS)
def _read_variant(profile: StoredProfile, label: str) -> Profile:
    """Profile variant of a stored profile, read from its folder.

    A profile that is not smoothed is resolved from its specification.
    """
    if not profile.labels:
        resolved = _resolve_profile(profile.body, profile.spec, profile.reading)
        return list_profile_variants(resolved)[label] if label else resolved
    record, index = read_json(profile.folder / _RECORD_FILE), profile.labels.index(label)
    with np.load(profile.folder / _VARIANTS_FILE, allow_pickle=False) as stored:
        s_mm, values, relative = (stored[f"{name}{index}"] for name in ("s", "values", "relative"))
    _, filter_mm, nominal, turn, shift = record["lines"][index]
    smoothed = SmoothingFrame(
        points=np.empty((0, 2)),
        s_mm=s_mm,
        values=values,
        normals=np.empty((0, 2)),
        relative_filter=relative if relative.size else None,
        nominal=nominal,
        registration=Registration(turn_rad=turn, shift=tuple(shift)),
        reference=load_library_profile(nominal).segments if nominal else (),
    )
    gauge_side_end = record["gauge_side_end_mm"]
    return Profile(
        name=record["name"],
        kind=profile.body,
        segments=build_smoothed_segments(smoothed, filter_mm),
        gauge_side_end_mm=gauge_side_end and tuple(gauge_side_end),
    )


def _resolve_profile(body: Body, spec: str, reading: Reading) -> Profile:
    """Profile of a file or a name of the library, as a case has it."""
    return resolve_rail(spec, reading) if body == "rail" else resolve_wheel(spec, reading).profile


@dataclass(frozen=True, kw_only=True)
class ReadingProfile:
    """Job of a worker: read a file, and store its variants or its refusal.

    Attributes
    ----------
    body, spec
        Wheel or rail, and its file or its name in the library.
    content_hash
        SHA-256 of the file; empty without a check.
    reading
        Reading options.
    gauge_depth_mm
        Depth below the top of a rail to which its gauge side is needed; 0 if the gauge is not used.
    """

    body: Body
    spec: str
    content_hash: str
    reading: Reading
    gauge_depth_mm: float = 0.0

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        """Write the record, and the variants of measured points.

        Parameters
        ----------
        folder
            Folder of the job.
        finished
            Unused.

        Returns
        -------
        WorkResult
            Nothing beside the files.

        Raises
        ------
        OSError
            If the file changed while it was read.
        MemoryShortageError
            If the memory does not suffice.
        """
        try:
            profile = _resolve_profile(self.body, self.spec, self.reading)
        except MemoryShortageError:
            raise
        except InputError as error:
            self._refuse_changed_file()
            write_json(folder / _RECORD_FILE, _make_refusal_record(error))
            return WorkResult()
        self._refuse_changed_file()
        variants = {} if profile.measured is None else {label_reference(profile): profile}
        variants |= list_profile_variants(profile) if variants else {}
        suspicions = find_suspicions(profile, self.reading, self.gauge_depth_mm)
        record = _make_record(profile, variants) | {"suspicions": list(map(asdict, suspicions))}
        write_json(folder / _RECORD_FILE, record)
        if variants:
            _store_variants([*variants.values()], folder / _VARIANTS_FILE)
        return WorkResult()

    def find_refusal(self) -> dict[str, Any] | None:
        """Read the points without smoothing them.

        Returns
        -------
        dict or None
            Record of a file that is refused; None if the points can be used.

        Raises
        ------
        MemoryShortageError
            If the memory does not suffice.
        """
        try:
            read_or_explain(self._read_points, self.reading, self.body)
        except MemoryShortageError:
            raise
        except InputError as error:
            return _make_refusal_record(error)
        return None

    def _refuse_changed_file(self) -> None:
        """Raise OSError if the file changed or can no longer be read: its reading is not a result of its content."""
        if self.content_hash and hash_file(Path(self.spec)) != self.content_hash:
            raise OSError(errno.EAGAIN, "the file changed while it was read; run the same command again", self.spec)

    def _read_points(self, reading: Reading) -> None:
        """Read and check the profile without smoothing its points."""
        if is_library_name(self.spec):
            _resolve_profile(self.body, self.spec, reading)
            return
        content = read_profile_content(self.spec, self.body, reading)
        if isinstance(content, ProfilePoints):
            check_points(content, reading)


def _make_refusal_record(error: InputError) -> dict[str, Any]:
    """Record of a refused file and of its suspicion."""
    reason, _, remedy = str(error).partition("; ")
    record: dict[str, Any] = {"status": "refused", "reason": reason, "remedy": remedy}
    if isinstance(error, SuspiciousProfileError):
        record["suspicions"] = [asdict(Suspicion(kind=error.kind, text=reason))]
    return record


def _make_record(profile: Profile, variants: Mapping[str, Profile]) -> dict[str, Any]:
    """Record of a profile that was read.

    It has notes, dimensions of the flange in mm, noise in um, wear in mm, and the registration of each variant.
    """
    measured = profile.measured
    record: dict[str, Any] = {"status": "read", "name": profile.name, "measured": measured is not None}
    record["notes"] = list(profile.notes)
    if flange := measure_flange(profile):
        record["flange"] = asdict(flange)
    if measured is None:
        return record
    wear = float(np.hypot(*measured.held.values.T).max()) if measured.nominal else None
    lines = []
    for label, variant in variants.items():
        assert variant.measured is not None
        smoothed = variant.measured.held
        registration = smoothed.registration
        lines.append((label, variant.measured.filter_mm, smoothed.nominal, registration.turn_rad, registration.shift))
    return {
        **record,
        "noise_um": 1e3 * measured.noise_mm,
        "nominal": measured.nominal,
        "wear_mm": wear,
        "lines": lines,
        "gauge_side_end_mm": profile.gauge_side_end_mm,
    }


def _store_variants(variants: list[Profile], path: Path) -> None:
    """Store the smoothed points of all variants."""
    arrays: dict[str, Any] = {}
    for index, profile in enumerate(variants):
        assert profile.measured is not None
        smoothed = profile.measured.held
        relative = np.empty(0) if smoothed.relative_filter is None else smoothed.relative_filter
        arrays |= {f"s{index}": smoothed.s_mm, f"values{index}": smoothed.values, f"relative{index}": relative}
    np.savez(path, **arrays)


def read_record(folder: Path) -> Mapping[str, Any]:
    """Record of a file that was read or refused.

    Parameters
    ----------
    folder
        Folder of the job.

    Returns
    -------
    dict
        Record with `status` "read" or "refused".

    Raises
    ------
    InputError
        If the record has a different layout.
    """
    record = read_json(folder / _RECORD_FILE)
    if not isinstance(record, dict) or record.get("status") not in ("read", "refused"):
        raise InputError(f"{folder / _RECORD_FILE} has a different layout; the profile is read again")
    return cast("Mapping[str, Any]", record)
