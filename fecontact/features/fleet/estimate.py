"""Shares of a fleet from a sample by finite elements, stratified by what the screen says, with intervals.

A position counts by its weight. Within a stratum positions are drawn in order of u / w, of uniform random numbers u and
their weights w (sequential Poisson sampling, Ohlsson 1998): a larger sample has all of a smaller one, a position is
drawn with the probability min(1, c w), and a heavy one surely. So a drawn position stands for the weight w over that
probability, which is the same for all that are not drawn surely, and the share of a stratum is about a mean.

The limits of a stratum's share are the exact ones (Clopper and Pearson 1934) of the effective number of draws; limits
of a sum over strata are their distances, squared and added (MOVER, Zou and Donner 2008, eq. 3). None of n draws is not
none of the stratum. With Wilson's limits in place of the exact ones an interval for 95 % has 86 to 98 % where one draw
in a hundred or fewer is at odds with the screen.

Where one draw of a stratum is at odds, its exact limit lies just above none, which is half of a normal distance. Two
such strata, squared and added, then say more than their draws together do: of the intervals of 2,000 kinds of simulated
fleets 92 % at least had the true share. So a distance is a normal one at least: 95.4 % at least, for intervals that are
longer by 5 % in the mean and by 13 % at most.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from fecontact.arrays import Floats

CONFIDENCE = 0.95
# Of a normal distribution, so much lies within so many standard deviations.
_NORMAL = NormalDist().inv_cdf(0.5 * (1.0 + CONFIDENCE))


@dataclass(frozen=True, kw_only=True)
class Share:
    """A share of the weight of all positions, from 0 to 1, with the limits of its interval."""

    estimate: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Stratum:
    """Positions that are alike to the screen, with those of them that were drawn.

    Attributes
    ----------
    weight, positions
        Of all its positions; weights of a population sum to 1.
    guess
        Share that holds by the screen.
    answers
        Of each drawn position, by finite elements.
    weights, inclusion
        Of each drawn position, and the probability with which it was drawn.
    """

    name: str
    weight: float
    positions: int
    guess: float
    answers: NDArray[np.str_]
    weights: Floats
    inclusion: Floats

    @property
    def drawn(self) -> int:
        """Positions that were drawn."""
        return len(self.answers)

    @property
    def stands_for(self) -> Floats:
        """Weight that each drawn position stands for."""
        return self.weights / self.inclusion

    @property
    def effective_draws(self) -> float:
        """Draws with equal probabilities from an endless stratum that tell as much; endless if all were drawn."""
        spread = float(np.sum(self.stands_for**2 * (1.0 - self.inclusion)))
        return float(np.sum(self.stands_for)) ** 2 / spread if spread > 0.0 else np.inf if self.drawn else 0.0

    def share(self, answers: Collection[str]) -> float:
        """The share with one of some answers (Hajek's estimate); by the screen's guess if none was drawn."""
        if not self.drawn:
            return self.guess
        return float(np.average(np.isin(self.answers, list(answers)), weights=self.stands_for))


def limits(share: Floats, draws: Floats) -> tuple[Floats, Floats]:
    """Exact limits of a share that was seen in so many draws (Clopper and Pearson 1934); draws need not be whole.

    >>> low, high = limits(np.array([0.0]), np.array([20.0]))
    >>> float(low[0]), round(float(high[0]), 4)
    (0.0, 0.1684)
    """
    tail, finite = 0.5 * (1.0 - CONFIDENCE), np.isfinite(draws)
    n = np.where(finite, draws, 1.0)
    seen = share * n
    # a beta distribution needs both numbers above zero; where they are not the limit is 0 or 1
    low = np.where(seen > 0.0, beta.ppf(tail, np.maximum(seen, 1e-12), n - seen + 1.0), 0.0)
    high = np.where(seen < n, beta.ppf(1.0 - tail, seen + 1.0, np.maximum(n - seen, 1e-12)), 1.0)
    return np.where(finite, low, share), np.where(finite, high, share)


def addable(share: Floats, draws: Floats) -> tuple[Floats, Floats]:
    """Limits of a share whose distances from it can be squared and added: exact ones, or normal ones where farther.

    They may lie below 0 or above 1.
    """
    low, high = limits(share, draws)
    spread = np.divide(share * (1.0 - share), draws, out=np.ones_like(share), where=draws > 0.0)
    normal = _NORMAL * np.sqrt(spread)
    return np.minimum(low, share - normal), np.maximum(high, share + normal)


def combined(weights: Floats, shares: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """The weighted sum of shares and its limits from those of each share (MOVER); sums are over the last axis."""
    whole = np.sum(weights * shares, axis=-1)
    below = np.sqrt(np.sum((weights * (shares - low)) ** 2, axis=-1))
    above = np.sqrt(np.sum((weights * (high - shares)) ** 2, axis=-1))
    return whole, np.maximum(whole - below, 0.0), np.minimum(whole + above, 1.0)


def share_of(strata: Sequence[Stratum], answers: Collection[str]) -> Share:
    """The share of a population with one of some answers."""
    weights = np.array([one.weight for one in strata])
    shares = np.array([one.share(answers) for one in strata])
    low, high = addable(shares, np.array([one.effective_draws for one in strata]))
    estimate, low, high = combined(weights / weights.sum(), shares, low, high)
    return Share(estimate=float(estimate), low=float(low), high=float(high))


def bounds(strata: Sequence[Stratum], holds: str, undecided: Collection[str]) -> tuple[float, float]:
    """Limits within which the share is, whichever answer all undecided positions have."""
    return share_of(strata, {holds}).low, share_of(strata, {holds, *undecided}).high


# --- Which positions are drawn.


def draw_scale(weights: Floats, draws: int) -> float:
    """The number c by which positions are drawn with the probabilities min(1, c w), which sum to the draws."""
    if draws >= weights.size:
        return float(1.0 / weights.min())
    heaviest = np.sort(weights)[::-1]
    # with the k heaviest drawn surely, the others share what is left of the draws
    left = np.cumsum(heaviest[::-1])[::-1][:draws]
    scales = (draws - np.arange(draws)) / left
    return float(scales[np.argmax(scales * heaviest[:draws] <= 1.0)])


def allocation(
    weights: Floats, shares: Floats, positions: NDArray[np.int64], drawn: NDArray[np.int64], draws: int
) -> NDArray[np.int64]:
    """Draws of each stratum: half in proportion to its weight W, half to W sqrt(p (1 - p)) (Neyman 1934).

    A position costs the same in each stratum. A stratum keeps what was drawn, and has two draws at least, so that
    nothing is taken for known; what it has no positions for the others have (whole numbers by Webster's method).
    """
    spread = weights * np.sqrt(shares * (1.0 - shares))
    wanted = 0.5 * weights / weights.sum() + 0.5 * spread / spread.sum()
    given = np.minimum(positions, np.maximum(drawn, 2))
    while given.sum() < min(draws, positions.sum()):
        given[np.argmin(np.where(given < positions, (given + 0.5) / wanted, np.inf))] += 1
    return given


# --- From these profiles to the network that they were taken from.

REPEATS = 400


def resampled(
    wheels: NDArray[np.int64], rails: NDArray[np.int64], holding: Floats, weights: Floats, seed: int
) -> Share:
    """The share for a network of which these wheels and rails are a random sample (pigeonhole bootstrap, Owen 2007).

    Wheels and rails are drawn again, each with replacement, and a pair counts as often as both of its profiles do.

    Parameters
    ----------
    wheels, rails
        Numbers of the profiles of each pair.
    holding, weights
        Weight of a pair's positions at which Hertz holds, and of all of them.
    """
    random = np.random.default_rng(seed)
    found = []
    for _ in range(REPEATS):
        times = _times(random, wheels) * _times(random, rails)
        if (whole := float(times @ weights)) > 0.0:
            found.append(float(times @ holding) / whole)
    low, high = np.quantile(found, [0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)])
    return Share(estimate=float(holding.sum() / weights.sum()), low=float(low), high=float(high))


def _times(random: np.random.Generator, profiles: NDArray[np.int64]) -> Floats:
    """How often the profile of each pair is drawn, among as many draws as there are profiles."""
    count = int(profiles.max()) + 1
    return np.bincount(random.integers(count, size=count), minlength=count)[profiles].astype(float)
