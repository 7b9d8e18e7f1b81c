"""Profiles of a fleet: each file is read, smoothed and stored once.

The reason of a refused file is stored too.
"""

from __future__ import annotations

import errno
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
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
from fecontact.profiles.points import check_points, is_exact
from fecontact.profiles.reading import Reading
from fecontact.profiles.recognition import fit_profile
from fecontact.profiles.remedies import read_or_explain
from fecontact.profiles.resolve import read_profile_content, resolve_rail, resolve_wheel
from fecontact.profiles.segments import Registration, SmoothingFrame
from fecontact.profiles.suspicions import Suspicion, SuspiciousProfileError
from fecontact.profiles.variants import build_smoothed_segments
from fecontact.runs.identity import digest_json
from fecontact.runs.sources import read_digests

_RECORD_FILE, _VARIANTS_FILE = "profile.json", "lines.npz"
TILE_SIZE = 16
"""Number of wheels, and of rails, that are screened at a time."""
# Number of profile variants in the memory of a worker: two of each profile. A variant has 1 MB with its tables.
_CACHED_VARIANTS = 4 * TILE_SIZE + 4
_FEWEST_POINTS = 20
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
    filters_mm
        Wave lengths of its smoothed variants; empty for an exact profile.
    """

    body: Body
    spec: str
    reading: Reading
    folder: Path
    filters_mm: tuple[float, ...]

    def line(self, filter_mm: float) -> Profile:
        """The profile variant smoothed over a wave length in mm.

        An exact profile is returned for any wave length.

        Parameters
        ----------
        filter_mm
            Smoothed wave length in mm.

        Returns
        -------
        Profile
            The profile variant.
        """
        return _read_variant(self, filter_mm if self.filters_mm else 0.0)


@lru_cache(maxsize=_CACHED_VARIANTS)
def _read_variant(profile: StoredProfile, filter_mm: float) -> Profile:
    """Profile variant of a stored profile, read from its folder.

    `filter_mm` is a filter length of the stored profile. Exact profiles have no filter lengths, and are resolved from
    their specification.
    """
    if not profile.filters_mm:
        return _resolve_exact(profile.body, profile.spec, profile.reading)
    record = read_json(profile.folder / _RECORD_FILE)
    with np.load(profile.folder / _VARIANTS_FILE, allow_pickle=False) as stored:
        index = profile.filters_mm.index(filter_mm)
        s_mm, values, relative = (stored[f"{name}{index}"] for name in ("s", "values", "relative"))
    nominal, turn, shift = record["lines"][index]
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


def _resolve_exact(body: Body, spec: str, reading: Reading) -> Profile:
    """Exact profile of a file or a name of the library."""
    return resolve_rail(spec, reading) if body == "rail" else resolve_wheel(spec, reading).profile


@dataclass(frozen=True, kw_only=True)
class ReadingProfile:
    """Job of a worker: read a file, smooth it over each wave length, and store the variants or the refusal.

    Attributes
    ----------
    body, spec
        Wheel or rail, and its file or its name in the library.
    content_hash
        SHA-256 of the file; empty without a check.
    reading
        Reading options.
    filters_mm
        Wave lengths of the variants.
    gauge_depth_mm
        Depth below the top of a rail to which its gauge side is needed; 0 if the gauge is not used.
    """

    body: Body
    spec: str
    content_hash: str
    reading: Reading
    filters_mm: tuple[float, ...]
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
            variants = read_or_explain(self._read_variants, self.reading, self.body)
        except MemoryShortageError:
            raise
        except InputError as error:
            self._refuse_changed_file()
            reason, _, remedy = str(error).partition("; ")
            record: dict[str, Any] = {"status": "refused", "reason": reason, "remedy": remedy}
            if isinstance(error, SuspiciousProfileError):
                record["suspicions"] = [asdict(Suspicion(kind=error.kind, text=reason))]
            write_json(folder / _RECORD_FILE, record)
            return WorkResult()
        self._refuse_changed_file()
        suspicions = find_suspicions(variants[0], self.reading, self.gauge_depth_mm)
        write_json(folder / _RECORD_FILE, {**_make_record(variants), "suspicions": list(map(asdict, suspicions))})
        if variants[0].measured is not None:
            _store_variants(variants, folder / _VARIANTS_FILE)
        return WorkResult()

    def _refuse_changed_file(self) -> None:
        """Raise OSError if the file changed or can no longer be read: its reading is not a result of its content."""
        if self.content_hash and hash_file(Path(self.spec)) != self.content_hash:
            raise OSError(errno.EAGAIN, "the file changed while it was read; run the same command again", self.spec)

    def _read_variants(self, reading: Reading) -> list[Profile]:
        """Variants of the profile, in the order of the wave lengths.

        A profile of the library, of exact segments or of few or exact points has a single variant.
        """
        exact_reading = replace(reading, filter_mm=0.0)
        if is_library_name(self.spec):
            return [_resolve_exact(self.body, self.spec, reading)]
        content = read_profile_content(self.spec, self.body, reading)
        if isinstance(content, Profile):
            return [content]
        if (
            reading.filter_mm == 0.0
            or len(content.points) < _FEWEST_POINTS
            or is_exact(check_points(content, exact_reading).points)
        ):
            return [fit_profile(content, exact_reading)]
        return [fit_profile(content, replace(reading, filter_mm=filter_mm)) for filter_mm in self.filters_mm]


def _make_record(variants: list[Profile]) -> dict[str, Any]:
    """Record of a profile that was read.

    It has notes, dimensions of the flange in mm, noise in um, wear in mm, and the registration of each variant.
    """
    measured = variants[0].measured
    record: dict[str, Any] = {"status": "read", "name": variants[0].name, "measured": measured is not None}
    record["notes"] = list(variants[0].notes)
    if flange := measure_flange(variants[0]):
        record["flange"] = asdict(flange)
    if measured is None:
        return record
    wear = float(np.hypot(*measured.held.values.T).max()) if measured.nominal else None
    registrations = []
    for profile in variants:
        assert profile.measured is not None
        smoothed = profile.measured.held
        registrations.append((smoothed.nominal, smoothed.registration.turn_rad, smoothed.registration.shift))
    return {
        **record,
        "noise_um": 1e3 * measured.noise_mm,
        "nominal": measured.nominal,
        "wear_mm": wear,
        "lines": registrations,
        "gauge_side_end_mm": variants[0].gauge_side_end_mm,
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
