"""Profiles and pairs of a fleet: a file that is in no pair is not read."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, normalise_weights
from fecontact.features.fleet.population import BODIES, Candidate, Pair, list_all_pairs, list_table_pairs
from fecontact.features.fleet.profile_files import ReadProfile, read_refusal_reason
from fecontact.features.fleet.table_columns import READ, REFUSED, SUSPICIOUS, UNREAD, UNUSED, Body
from fecontact.inputs.texts import count_text
from fecontact.jobs.workers import WorkersLost

# A fleet of which less than a twentieth of the drawn pairs can be used needs better files, not more draws. A few pairs
# may need more draws.
_MOST_DRAWS_PER_PAIR, _MOST_DRAWS_OF_FEW_PAIRS = 20, 1000

# Pairs that are drawn at once, besides the needed ones, to replace pairs that cannot be used.
_SPARE_DRAWS = 50

Reader = Callable[[Sequence[Candidate]], Sequence[ReadProfile]]
"""Function that reads some profiles of a fleet, and returns the results in their order."""


@dataclass(frozen=True, kw_only=True)
class PairedProfiles:
    """Profiles of a fleet with their readings, and the pairs that can be used.

    Attributes
    ----------
    profiles
        Result of each profile, in the order of the candidates. The file of a profile in no pair has the status
        `unused`.
    pairs
        Weight of each pair by the names of wheel and rail; the weights sum to 1.
    suspicious_share
        Share of the pairs, by weight, that suspicious profiles leave out, from 0 to 1. Pairs with a file that was
        refused or not read do not count.
    listed, unusable
        Number of pairs in a table of pairs, and number of those with a file that was refused or not read.
    unusable_share
        Share of the listed pairs, by weight, with such a file.
    """

    profiles: tuple[ReadProfile, ...]
    pairs: Mapping[Pair, float]
    suspicious_share: float
    listed: int = 0
    unusable: int = 0
    unusable_share: float = 0.0

    @property
    def unusable_text(self) -> str:
        """Sentence on the listed pairs that are left out; empty if there is none."""
        if not self.unusable:
            return ""
        verb = "is" if self.unusable == 1 else "are"
        return (
            f"{self.unusable} of {count_text(self.listed, 'listed pair')}, {1e2 * self.unusable_share:.3g} % by weight,"
            f" {verb} left out, because a file cannot be used"
        )

    def count_files(self, status: str) -> int:
        """Number of the files with a status, such as `unused`."""
        return sum(profile.record["status"] == status for profile in self.profiles)


def read_paired_profiles(fleet: Fleet, candidates: Sequence[Candidate], read_files: Reader) -> PairedProfiles:
    """Read the profiles that are in pairs.

    Without a table of pairs and without a draw, these are all profiles.

    Parameters
    ----------
    fleet
        Definition of the fleet.
    candidates
        Profiles of the fleet.
    read_files
        Reads the files of some of them.

    Returns
    -------
    PairedProfiles
        Results of the readings, and the pairs.

    Raises
    ------
    InputError
        If no wheel or no rail can be used, for pairs that are not allowed, and if too few drawn pairs can be used.
    WorkersLost
        If no wheel or no rail was read for want of memory, disk space or workers.

    Notes
    -----
    Pairs are drawn one after the other, each wheel and each rail by its weight among the candidates. A pair with a file
    that cannot be used is replaced by the next one. The pairs thus are random pairs of the profiles that can be used
    (rejection sampling), and the files of a large fleet need not be read to draw from it. A pair that is drawn twice
    has the weight of two pairs.
    """
    if fleet.pairing.draw is not None:
        return _read_drawn_pairs(fleet, int(fleet.pairing.draw), candidates, read_files)
    if fleet.pairing.table is None:
        profiles = tuple(read_files(candidates))
        refuse_unusable(profiles)
        pairs = list_all_pairs(*_weigh_profiles(profiles, READ))
        return PairedProfiles(profiles=profiles, pairs=pairs, suspicious_share=_find_suspicious_share(profiles))
    path = fleet.folder / fleet.pairing.table
    listed_pairs = list_table_pairs(path, {(candidate.body, candidate.name) for candidate in candidates})
    names = {name for pair, _ in listed_pairs for name in _name_profiles(pair)}
    paired_candidates = [candidate for candidate in candidates if (candidate.body, candidate.name) in names]
    profiles = _add_unused(candidates, read_files(paired_candidates), f"it is in no pair of {path.name}")
    refuse_unusable(profiles)
    return _weigh_listed_pairs(path, listed_pairs, profiles)


def refuse_unusable(profiles: Iterable[ReadProfile]) -> None:
    """Refuse a fleet without a wheel or without a rail that can be used.

    Parameters
    ----------
    profiles
        Results of the readings.

    Raises
    ------
    InputError
        With the reason and the remedy of the first file.
    WorkersLost
        If a file was not read for want of memory, disk space or workers.
    """
    by_body: dict[Body, list[ReadProfile]] = {body: [] for body in BODIES}
    for profile in profiles:
        by_body[profile.candidate.body].append(profile)
    for body, body_profiles in by_body.items():
        if any(profile.record["status"] == READ for profile in body_profiles):
            continue
        unusable = [profile for profile in body_profiles if profile.record["status"] != UNUSED] or body_profiles
        reason = f"first reason: {read_refusal_reason(unusable[0])}"
        if unread := [profile for profile in unusable if profile.record["status"] == UNREAD]:
            raise WorkersLost(f"[{body}s]: no file could be read; {reason}; {unread[0].record['remedy']}")
        raise InputError(
            f"[{body}s]: 0 of {count_text(len(unusable), 'file')} can be used; {reason}; remedy:"
            f" {unusable[0].record['remedy']}"
        )


def _name_profiles(pair: Pair) -> Iterator[tuple[Body, str]]:
    """Yield body and name of the wheel and of the rail of a pair."""
    return zip(BODIES, pair, strict=True)


def _add_unused(
    candidates: Iterable[Candidate], profiles: Iterable[ReadProfile], reason: str
) -> tuple[ReadProfile, ...]:
    """Results of all candidates.

    A candidate without a result has the status `unused`, for a reason.
    """
    results = {(profile.candidate.body, profile.candidate.name): profile for profile in profiles}
    return tuple(
        results.get((candidate.body, candidate.name))
        or ReadProfile(candidate=candidate, record={"status": UNUSED, "reason": reason})
        for candidate in candidates
    )


def _read_drawn_pairs(fleet: Fleet, count: int, candidates: Sequence[Candidate], read_files: Reader) -> PairedProfiles:
    """Draw pairs and read their files, until `count` pairs can be used."""
    usable_candidates = [candidate for candidate in candidates if not candidate.problem]
    # the others are refused without being read
    profiles = [*read_files([candidate for candidate in candidates if candidate.problem])]
    drawn_pairs: list[Pair] = []
    usable: list[Pair] = []
    statuses: dict[tuple[Body, str], str] = {}
    if {candidate.body for candidate in usable_candidates} == {*BODIES}:
        most_draws = max(_MOST_DRAWS_PER_PAIR * count, _MOST_DRAWS_OF_FEW_PAIRS)
        available_pairs = _draw_pairs(fleet.seed, usable_candidates, count + _SPARE_DRAWS)
        # more files need more memory: without it, the same command goes on with the same draws later
        while len(usable) < count and len(drawn_pairs) < most_draws and UNREAD not in statuses.values():
            end = min(len(drawn_pairs) + count - len(usable), most_draws)
            if end > len(available_pairs):
                available_pairs = _draw_pairs(fleet.seed, usable_candidates, min(2 * end, most_draws))
            block = available_pairs[len(drawn_pairs) : end]
            names = {name for pair in block for name in _name_profiles(pair)} - statuses.keys()
            new = read_files(
                [candidate for candidate in usable_candidates if (candidate.body, candidate.name) in names]
            )
            statuses |= {(profile.candidate.body, profile.candidate.name): profile.record["status"] for profile in new}
            profiles += new
            drawn_pairs += block
            usable += [pair for pair in block if all(statuses[name] == READ for name in _name_profiles(pair))]
    refuse_unusable(profiles)
    if not usable or (len(usable) < count and UNREAD not in statuses.values()):
        unusable = next(profile for profile in profiles if profile.record["status"] != READ)
        raise InputError(
            f"[pairs]: draw is {count}, but of {len(drawn_pairs)} drawn pairs only {len(usable)} have two files that"
            f" can be used; allowed: at least one in {_MOST_DRAWS_PER_PAIR}; first reason:"
            f" {read_refusal_reason(unusable)}; remedy: {unusable.record['remedy']}"
        )
    complete = [
        pair_statuses
        for pair in drawn_pairs
        if (pair_statuses := {statuses[name] for name in _name_profiles(pair)}) <= {READ, SUSPICIOUS}
    ]
    return PairedProfiles(
        profiles=_add_unused(candidates, profiles, "it is in no drawn pair"),
        pairs=normalise_weights(((pair, 1.0) for pair in usable), "[pairs]"),
        suspicious_share=sum(SUSPICIOUS in pair_statuses for pair_statuses in complete) / len(complete),
    )


def _draw_pairs(seed: int, candidates: Sequence[Candidate], count: int) -> list[Pair]:
    """First pairs of the random sequence of a seed.

    Each wheel and each rail is drawn by its weight, with replacement.

    Raises
    ------
    InputError
        If a weight is negative or not finite, or all weights of a body are zero.
    """
    wheels, rails = (
        _draw_names(
            seed, body, {candidate.name: candidate.weight for candidate in candidates if candidate.body == body}, count
        )
        for body in BODIES
    )
    return list(zip(wheels, rails, strict=True))


def _draw_names(seed: int, body: Body, weights: Mapping[str, float], count: int) -> list[str]:
    """First names of the random sequence of a seed.

    Each name has a sequence of random exponential times of its own. In each draw the shortest time over weight wins: it
    belongs to a name with the probability of its weight. So more draws keep the earlier ones, and a new or a removed
    file changes only the draws that it wins. A draw from the sum of the weights would change nearly all of them, and
    with them the finished pairs.

    Source: exponential times as by Efraimidis and Spirakis (2006).
    """
    names = list(normalise_weights(weights.items(), f"[{body}s]"))
    shortest_times, winners = np.full(count, np.inf), np.zeros(count, dtype=np.intp)
    for number, name in enumerate(names):
        if weights[name] > 0.0:
            digest = hashlib.sha256(f"{seed} {body} {name}".encode()).digest()
            generator = np.random.default_rng(int.from_bytes(digest[:16], "little"))
            times = generator.standard_exponential(count) / weights[name]
            is_shorter = times < shortest_times
            shortest_times[is_shorter], winners[is_shorter] = times[is_shorter], number
    return [names[winner] for winner in winners.tolist()]


def _weigh_profiles(profiles: Sequence[ReadProfile], *statuses: str) -> Iterator[dict[str, float]]:
    """Yield the weights of the wheels, and of the rails, with some statuses; each sum to 1."""
    for body in BODIES:
        yield normalise_weights(
            (
                (profile.candidate.name, profile.candidate.weight)
                for profile in profiles
                if profile.candidate.body == body and profile.record["status"] in statuses
            ),
            f"[{body}s]",
        )


def _find_suspicious_share(profiles: Sequence[ReadProfile]) -> float:
    """Share of all pairs that suspicious profiles leave out, by weight."""
    statuses = {(profile.candidate.body, profile.candidate.name): profile.record["status"] for profile in profiles}
    if SUSPICIOUS not in statuses.values():
        return 0.0
    usable_shares = [
        math.fsum(weight for name, weight in weights.items() if statuses[body, name] == READ)
        for body, weights in zip(BODIES, _weigh_profiles(profiles, READ, SUSPICIOUS), strict=True)
    ]
    return 1.0 - usable_shares[0] * usable_shares[1]


def _weigh_listed_pairs(
    path: Path, listed_pairs: Sequence[tuple[Pair, float]], profiles: Sequence[ReadProfile]
) -> PairedProfiles:
    """Usable pairs of a table, and the shares of the other pairs.

    The weight of a pair is its weight in the table times the weights of both profiles.
    """
    by_name = {(profile.candidate.body, profile.candidate.name): profile for profile in profiles}
    weights: dict[str, list[tuple[Pair, float]]] = {READ: [], SUSPICIOUS: [], REFUSED: []}
    for pair, weight in listed_pairs:
        pair_profiles = [by_name[name] for name in _name_profiles(pair)]
        statuses = {profile.record["status"] for profile in pair_profiles}
        status = REFUSED if not statuses <= {READ, SUSPICIOUS} else SUSPICIOUS if SUSPICIOUS in statuses else READ
        weights[status].append((pair, weight * math.prod(profile.candidate.weight for profile in pair_profiles)))
    sums = {status: math.fsum(weight for _, weight in weighted) for status, weighted in weights.items()}
    return PairedProfiles(
        profiles=tuple(profiles),
        pairs=normalise_weights(weights[READ], f"table {path}"),
        suspicious_share=sums[SUSPICIOUS] / (sums[READ] + sums[SUSPICIOUS]),
        listed=len(listed_pairs),
        unusable=len(weights[REFUSED]),
        unusable_share=sums[REFUSED] / math.fsum(sums.values()),
    )
