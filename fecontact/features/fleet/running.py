"""Screening of a fleet: files and pairs as jobs, each stored as it is finished, and the tables of their results.

`profiles/` and `pairs/` in the folder of the results have a folder for each finished file and pair. The name of a
folder depends on everything that determines its content: an added file costs only this file and its pairs.
`profiles.parquet` and `screen/` are written from these folders at the end, with the weights, in the order of the names.
Equal inputs give equal tables, for any number of interruptions and on any machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, read_fleet
from fecontact.features.fleet.pair_jobs import screen_pairs, weigh_pairs, write_screen
from fecontact.features.fleet.population import Pair, list_candidates
from fecontact.features.fleet.profile_files import mark_unusable, read_profiles, read_refusal_reason, with_radius
from fecontact.features.fleet.reading import find_origin
from fecontact.features.fleet.tables import PROFILES, import_arrow, write_table
from fecontact.files import write_sealed, write_text
from fecontact.jobs.engine import RunSettings, open_run
from fecontact.jobs.remaining import Progress
from fecontact.runs.folder import prepare_folder

FLEET_RECORD, FLEET_FILE = "fleet.json", "fleet.toml"
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
        Number of files, and reasons of the refused files.
    reused
        Number of pairs that were finished before.
    failed
        Reasons why pairs have no rows, by the names of wheel and rail.
    notes
        Assumptions of readers, by body and name.
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
        """Answer of the screening in a sentence."""
        verdicts_text = ", ".join(f"{name} in {100.0 * share:.1f} %" for name, share in self.verdicts.items())
        refused_text = f"; {len(self.refused)} of {self.profiles} files could not be read" if self.refused else ""
        return f"{self.positions} positions of {self.pairs} pairs, by weight: {verdicts_text} (screen){refused_text}"


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
    import_arrow("parquet")
    definition, settings, progress = read_fleet(path), settings or RunSettings(), progress or {}
    refuse_part(settings)
    candidate_list = [
        mark_unusable(definition, with_radius(definition, candidate)) for candidate in list_candidates(definition)
    ]
    prepare_folder(folder, FLEET_RECORD, lambda stored: True, settings.force)
    with open_run(folder, folder / "pairs", settings, progress.get("files")) as open_jobs:
        profiles = read_profiles(definition, candidate_list, folder, open_jobs)
        write_table([profile.row for profile in profiles], folder / PROFILES)
        pairs = weigh_pairs(definition, profiles)
        pair_run, reused_files = replace(open_jobs, progress=progress.get("pairs")), len(open_jobs.reused)
        failed = screen_pairs(definition, profiles, pairs, folder, pair_run)
        (folder / FLEET_FILE).unlink(missing_ok=True)
        verdict_weights = write_screen(definition, profiles, pairs, failed, folder)
        write_text(folder / FLEET_FILE, path.read_text("utf-8"))
        screened = FleetScreening(
            out=folder,
            pairs=len(pairs),
            positions=len(pairs) * len(definition.positions),
            verdicts={name: share for name, share in verdict_weights.items() if share},
            profiles=len(profiles),
            refused={
                f"{profile.candidate.body} {profile.candidate.name}": read_refusal_reason(profile)
                for profile in profiles
                if profile.stored is None
            },
            reused=len(pair_run.reused) - reused_files,
            failed=failed,
            notes={
                f"{profile.candidate.body} {profile.candidate.name}": profile.notes
                for profile in profiles
                if profile.notes
            },
        )
        _write_record(definition, screened)
    return screened


def _write_record(fleet: Fleet, screened: FleetScreening) -> None:
    """Write `fleet.json` with a seal on `profiles.parquet`.

    It has the headline, the population, the numbers of pairs and positions, the verdicts and the inputs. The seal shows
    later whether the table was changed.
    """
    record = {
        "kind": "fleet",
        "headline": screened.headline,
        "population": _describe_population(fleet, screened),
        "theory": fleet.theory,
        "filters_mm": list(fleet.filters_mm),
        "seed": fleet.seed,
        "limits": fleet.case.criteria.limits,
        "positions_mm_kN_weight": [[*position, weight] for position, weight in fleet.positions.items()],
        "pairs": screened.pairs,
        "positions": screened.positions,
        "files": screened.profiles,
        "refused_files": dict(screened.refused),
        "verdicts": dict(screened.verdicts),
        "folder": str(fleet.folder),
        "made_by": dict(find_origin().solved_by),
    }
    write_sealed(screened.out / FLEET_RECORD, record, [screened.out / PROFILES])


def _describe_population(fleet: Fleet, screened: FleetScreening) -> str:
    """Pairs, profiles and positions of the fleet in words."""
    selection = (
        "listed" if fleet.pairing.table else "drawn at random" if fleet.pairing.draw else "every wheel on every rail"
    )
    ranges = [f"{min(values):.4g} to {max(values):.4g}" for values in zip(*fleet.positions, strict=True)]
    return (
        f"{screened.pairs} pairs ({selection}) of the wheels {', '.join(fleet.wheels)} and rails"
        f" {', '.join(fleet.rails)}, each at {len(fleet.positions)} positions (shifts of {ranges[0]} mm, loads of"
        f" {ranges[1]} kN), by weight"
    )
