"""Screening of a fleet: files and pairs as jobs, each stored as it is finished, and the tables of their results.

`profiles/` and `pairs/` in the folder of the results have a folder for each finished file and pair. The name of a
folder depends on everything that determines its content: an added file costs only this file and its pairs.
`profiles.parquet` and `screen/` are written from these folders at the end, with the weights, in the order of the names.
Equal inputs give equal tables, for any number of interruptions and on any machine.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, read_fleet
from fecontact.features.fleet.packages import import_parquet
from fecontact.features.fleet.pair_jobs import screen_pairs, write_screen
from fecontact.features.fleet.paired_profiles import read_paired_profiles
from fecontact.features.fleet.population import Pair, list_candidates
from fecontact.features.fleet.profile_files import (
    list_reasons,
    mark_unusable,
    read_profiles,
    with_radius,
)
from fecontact.features.fleet.reading import find_origin
from fecontact.features.fleet.sealed_folder import (
    FLEET_FILE,
    PAIR_JOBS,
    PROFILE_JOBS,
    PROFILES,
    describe_unscreened,
    list_own_parts,
    prepare_for_fleet,
    remove_outdated_report,
    write_record,
)
from fecontact.features.fleet.table_columns import REFUSED, SUSPICIOUS, UNREAD, UNUSED
from fecontact.features.fleet.tables import write_table
from fecontact.files import write_text
from fecontact.inputs.texts import count_text
from fecontact.jobs.engine import RunSettings, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.store import remove_leftovers

Progresses = Mapping[str, Progress]


@dataclass(frozen=True, kw_only=True)
class FleetScreening:
    """Result of screening a fleet.

    Attributes
    ----------
    out
        Folder of the results.
    pairs, positions
        Number of pairs, and of positions of all pairs.
    verdicts
        Weight of each verdict; they sum to 1.
    profiles, refused
        Number of files, without files in no pair, and reasons and remedies of the refused files.
    reused
        Number of pairs that were finished before.
    failed
        Reasons why pairs have no rows, by the names of wheel and rail.
    unscreened
        Number of the failed pairs that failed for want of memory, disk space or workers.
    notes
        Assumptions of readers, by body and name.
    unread
        Reasons why files were not read that may be good, such as a lack of memory, by body and name.
    removed_report
        Whether a report of earlier tables was removed.
    suspicious
        Reasons and remedies of the files that the quality gate leaves out, by body and name.
    suspicious_share
        Share of the pairs, by weight, with such a file.
    unused
        Number of files that were not read because they are in no pair.
    unusable_pairs
        Sentence on listed pairs with a file that cannot be used; empty if there is none.
    """

    out: Path
    pairs: int
    positions: int
    verdicts: Mapping[str, float]
    profiles: int
    refused: Mapping[str, str]
    reused: int
    failed: Mapping[Pair, str] = field(default_factory=dict)
    unscreened: int = 0
    notes: Mapping[str, Sequence[str]] = field(default_factory=dict)
    unread: Mapping[str, str] = field(default_factory=dict)
    removed_report: bool = False
    suspicious: Mapping[str, str] = field(default_factory=dict)
    suspicious_share: float = 0.0
    unused: int = 0
    unusable_pairs: str = ""

    @property
    def headline(self) -> str:
        """Answer of the screening in a sentence."""
        unscreened_text = describe_unscreened(self.unscreened, self.pairs) if self.unscreened else ""
        if self.unscreened == self.pairs:
            return unscreened_text
        verdicts_text = ", ".join(f"{name} in {100.0 * share:.1f} %" for name, share in self.verdicts.items())
        missing = len(self.refused) + len(self.unread)
        refused_text = f"; {missing} of {count_text(self.profiles, 'file')} could not be read" if missing else ""
        refused_text += f"; {self.unusable_pairs}" if self.unusable_pairs else ""
        if self.suspicious:
            refused_text += (
                f"; {describe_suspicious(len(self.suspicious), self.profiles)}, and"
                f" {1e2 * self.suspicious_share:.1f} % of the pairs, by weight, are left out for them"
            )
        return (
            f"{count_text(self.positions, 'position')} of {count_text(self.pairs, 'pair')}, by"
            f" weight: {verdicts_text} (screen){refused_text}{unscreened_text and '; '}{unscreened_text}"
        )


def describe_suspicious(number: int, files: int) -> str:
    """Words on the number of suspicious files among all files."""
    return f"{number} of {count_text(files, 'file')} {'is' if number == 1 else 'are'} suspicious"


def refuse_part(settings: RunSettings) -> None:
    """Refuse a part of a run, because a fleet cannot be divided.

    Parameters
    ----------
    settings
        Settings of the run.

    Raises
    ------
    InputError
        If the settings have a part.
    """
    if settings.part is not None:
        number, count = settings.part
        raise InputError(
            f"--part is {number}/{count}; a fleet cannot be screened in parts; leave out --part, or use --scheduler for"
            " several machines"
        )


def run_fleet(
    fleet: str | Path, out: str | Path, *, settings: RunSettings | None = None, progress: Progresses | None = None
) -> FleetScreening:
    """Screen all positions of a fleet.

    The same call resumes an interrupted run.

    Parameters
    ----------
    fleet
        File of the fleet (TOML).
    out
        Folder for `profiles.parquet`, `screen/part-*.parquet`, `fleet.json` and their sources.
    settings
        Workers, scheduler, and whether to overwrite other results.
    progress
        Progress as for `run`, of `files` and of `pairs`.

    Returns
    -------
    FleetScreening
        Weights of the verdicts, refused files and failed pairs.

    Raises
    ------
    InputError
        For a file that does not describe a fleet, a fleet without a readable wheel or rail, and a folder that another
        run uses or that has other results. A profile that cannot be read is a row of `profiles.parquet`, a position
        that cannot be placed is a row of the screen with its reason.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import fecontact
    >>> from fecontact.features.fleet.examples import write_fleet
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     screening = fecontact.run_fleet(write_fleet(Path(folder), wheels=1, rails=1), Path(folder) / "out")
    >>> screening.pairs
    1
    """
    path, folder = Path(fleet), Path(out)
    import_parquet()
    definition, settings, progress = read_fleet(path), settings or RunSettings(), progress or {}
    refuse_part(settings)
    candidate_list = [
        mark_unusable(definition, with_radius(definition, candidate)) for candidate in list_candidates(definition)
    ]
    prepare_for_fleet(path, folder, force=settings.force)
    with open_run(folder, folder / PAIR_JOBS, settings, progress.get("files")) as open_jobs:
        list_own_parts(folder)
        remove_leftovers(folder / PROFILE_JOBS)
        paired = read_paired_profiles(
            definition, candidate_list, lambda some: read_profiles(definition, some, folder, open_jobs)
        )
        profiles, pairs = paired.profiles, paired.pairs
        pair_run, reused_files = replace(open_jobs, progress=progress.get("pairs")), len(open_jobs.reused)
        failed = screen_pairs(definition, profiles, pairs, folder, pair_run)
        # until here an interrupted run leaves the tables of an earlier run complete
        write_table([profile.row for profile in profiles], folder / PROFILES)
        verdict_weights = write_screen(definition, profiles, pairs, failed, folder)
        write_text(folder / FLEET_FILE, path.read_text("utf-8"))
        screened = FleetScreening(
            out=folder,
            pairs=len(pairs),
            positions=len(pairs) * len(definition.positions),
            verdicts={name: share for name, share in verdict_weights.items() if share},
            profiles=len(profiles) - paired.count_files(UNUSED),
            unused=paired.count_files(UNUSED),
            unusable_pairs=paired.unusable_text,
            refused=list_reasons(profiles, REFUSED),
            unread=list_reasons(profiles, UNREAD),
            suspicious=list_reasons(profiles, SUSPICIOUS),
            suspicious_share=paired.suspicious_share,
            reused=len(pair_run.reused) - reused_files,
            failed={pair: str(outcome.failure) for pair, outcome in failed.items()},
            unscreened=sum(outcome.is_system_failure for outcome in failed.values()),
            notes={
                f"{profile.candidate.body} {profile.candidate.name}": profile.notes
                for profile in profiles
                if profile.notes
            },
        )
        write_record(folder, _make_record(definition, path, screened), list_own_parts(folder))
        return replace(screened, removed_report=remove_outdated_report(folder))


def _make_record(fleet: Fleet, path: Path, screened: FleetScreening) -> dict[str, object]:
    """Content of `fleet.json`.

    It has the headline, the population, the numbers of pairs and positions, the verdicts, the inputs, and the path of
    the fleet's file relative to the folder.
    """
    return {
        "kind": "fleet",
        "headline": screened.headline,
        "population": _describe_population(fleet, screened),
        "theory": fleet.theory,
        "filter_mm": fleet.filter_mm,
        "seed": fleet.seed,
        "limits": fleet.case.criteria.limits,
        "positions_mm_kN_weight": [[*position, weight] for position, weight in fleet.positions.items()],
        "pairs": screened.pairs,
        "positions": screened.positions,
        "unscreened_pairs": screened.unscreened,
        "files": screened.profiles,
        "unused_files": screened.unused,
        "unusable_pairs": screened.unusable_pairs,
        "refused_files": dict(screened.refused),
        "unread_files": dict(screened.unread),
        "suspicious_files": dict(screened.suspicious),
        "suspicious_share": screened.suspicious_share,
        "verdicts": dict(screened.verdicts),
        "folder": str(fleet.folder),
        "file": _find_relative_path(path, screened.out),
        "made_by": dict(find_origin().solved_by),
    }


def _find_relative_path(path: Path, folder: Path) -> str:
    """Path of a file relative to a folder; absolute if they are on different drives."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.resolve().as_posix()


def _describe_range(values: Sequence[float]) -> str:
    """Smallest and largest of some numbers, or their common value."""
    low, high = (f"{value:.4g}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _describe_population(fleet: Fleet, screened: FleetScreening) -> str:
    """Pairs, profiles and positions of the fleet in words."""
    selection = (
        "listed" if fleet.pairing.table else "drawn at random" if fleet.pairing.draw else "every wheel on every rail"
    )
    ranges = [_describe_range(values) for values in zip(*fleet.positions, strict=True)]
    return (
        f"{count_text(screened.pairs, 'pair')} ({selection}) of the wheels {', '.join(fleet.wheels)} and rails"
        f" {', '.join(fleet.rails)}, each at {count_text(len(fleet.positions), 'position')} (shifts of"
        f" {ranges[0]} mm, loads of"
        f" {ranges[1]} kN), by weight"
    )
