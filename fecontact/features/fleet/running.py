"""A fleet while it is screened: files and pairs as jobs, each kept as it is finished; the tables are made of them.

`profiles/` and `pairs/` in the folder of the results have a folder for each file and pair that was done, named by
what decides about it: a file that is added costs that file and its pairs. `profiles.parquet` and `screen/` are written
from them at the end, with the weights, in the order of the names: the same inputs give the same tables, however often
the run was interrupted, and wherever it ran.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, read_fleet
from fecontact.features.fleet.pair_jobs import screen_pairs, weigh_pairs, write_screen
from fecontact.features.fleet.population import BODIES, Pair, candidates
from fecontact.features.fleet.profile_files import mark_unusable, read_profiles, refusal_reason, with_radius
from fecontact.features.fleet.reading import origin
from fecontact.features.fleet.tables import PROFILES, of_arrow, write_table
from fecontact.files import write_sealed, write_text
from fecontact.jobs.engine import RunSettings, open_run
from fecontact.jobs.remaining import Progress
from fecontact.runs.folder import prepare

FLEET, TABLE = "fleet.json", "fleet.toml"
Progresses = Mapping[str, Progress]


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
    found = [mark_unusable(asked, with_radius(asked, one)) for body in BODIES for one in candidates(asked, body)]
    prepare(folder, FLEET, lambda stored: True, settings.force)
    with open_run(folder, folder / "pairs", settings, progress.get("files")) as by:
        profiles = read_profiles(asked, found, folder, by)
        write_table([one.row for one in profiles], folder / PROFILES)
        pairs = weigh_pairs(asked, profiles)
        run, read = replace(by, progress=progress.get("pairs")), len(by.reused)
        failed = screen_pairs(asked, profiles, pairs, folder, run)
        (folder / TABLE).unlink(missing_ok=True)
        counted = write_screen(asked, profiles, pairs, failed, folder)
        write_text(folder / TABLE, path.read_text("utf-8"))
        screened = Screened(
            out=folder,
            pairs=len(pairs),
            positions=len(pairs) * len(asked.positions),
            verdicts={name: share for name, share in counted.items() if share},
            profiles=len(profiles),
            refused={f"{one.given.body} {one.given.name}": refusal_reason(one) for one in profiles if one.kept is None},
            reused=len(run.reused) - read,
            failed=failed,
            notes={f"{one.given.body} {one.given.name}": one.notes for one in profiles if one.notes},
        )
        _seal(asked, screened)
    return screened


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
