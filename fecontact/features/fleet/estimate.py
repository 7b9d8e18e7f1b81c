"""Shares of a fleet from a sample by finite elements, stratified by the screening, with intervals.

A position counts by its weight. Within a stratum positions are drawn in order of u / w, of uniform random numbers u and
their weights w (sequential Poisson sampling, Ohlsson 1998). A larger sample contains each smaller sample. A position is
drawn with the probability min(1, c w); a heavy position is drawn with certainty. So a drawn position represents the
weight w over that probability, which is equal for all positions that are not drawn with certainty, and the share of a
stratum is approximately a mean.

The limits of a stratum's share are the exact limits (Clopper and Pearson 1934) of the effective number of draws. The
limits of a sum over strata are the distances of the strata's limits, squared and added (MOVER, Zou and Donner 2008,
eq. 3). Zero of n draws does not mean zero in the stratum. With Wilson's limits in place of the exact limits, an
interval for 95 % covers the true share in 86 to 98 % of the cases if at most one draw in a hundred disagrees with the
screening.

If one draw of a stratum disagrees, its exact limit is just above zero, which is half of a normal distance. Two such
strata, squared and added, then claim more than their draws together allow: of the intervals of 2,000 kinds of simulated
fleets at least 92 % contained the true share. So a distance is at least a normal distance: at least 95.4 % of the
intervals contain the true share, and intervals are longer by 5 % in the mean and by at most 13 %.
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
# Number of standard deviations within which a normal distribution has this probability.
_NORMAL = NormalDist().inv_cdf(0.5 * (1.0 + CONFIDENCE))


@dataclass(frozen=True, kw_only=True)
class Share:
    """A share of the weight of all positions, with its interval.

    Attributes
    ----------
    estimate, low, high
        Share and its limits, from 0 to 1.
    """

    estimate: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Stratum:
    """Positions that are alike to the screening, with their draws.

    Attributes
    ----------
    name
        Stratum, of `tables.STRATA`.
    weight, positions
        Weight and number of all its positions; weights of a population sum to 1.
    guess
        Share that holds by the screening.
    answers : ndarray of shape (n,)
        Answers of the drawn positions, by finite elements.
    weights, inclusion : ndarray of shape (n,)
        Weights of the drawn positions, and the probabilities with which they were drawn.
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
        """Number of drawn positions."""
        return len(self.answers)

    @property
    def represented_weights(self) -> Floats:
        """Weight (n,) that each drawn position represents."""
        return self.weights / self.inclusion

    @property
    def effective_draws(self) -> float:
        """Number of draws with equal probabilities from an infinite stratum with equal information.

        Infinite if all positions were drawn.
        """
        spread = float(np.sum(self.represented_weights**2 * (1.0 - self.inclusion)))
        return float(np.sum(self.represented_weights)) ** 2 / spread if spread > 0.0 else np.inf if self.drawn else 0.0

    def share(self, answers: Collection[str]) -> float:
        """Share of the positions with some answers (Hajek's estimate).

        Without draws, the share that holds by the screening.

        Parameters
        ----------
        answers
            Answers that are counted, such as `HOLDS`.

        Returns
        -------
        float
            Share from 0 to 1.
        """
        if not self.drawn:
            return self.guess
        return float(np.average(np.isin(self.answers, list(answers)), weights=self.represented_weights))


def find_exact_limits(share: Floats, draws: Floats) -> tuple[Floats, Floats]:
    """Exact limits of a share that was observed in a number of draws.

    Parameters
    ----------
    share : ndarray of shape (n,)
        Observed shares, from 0 to 1.
    draws : ndarray of shape (n,)
        Numbers of draws, which need not be whole; infinite for an exact share.

    Returns
    -------
    tuple of arrays (n,)
        Lower and upper limits of the intervals for 95 % (Clopper and Pearson 1934).

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.fleet.estimate import find_exact_limits
    >>> low, high = find_exact_limits(np.array([0.0]), np.array([20.0]))
    >>> float(low[0]), round(float(high[0]), 4)
    (0.0, 0.1684)
    """
    tail, finite = 0.5 * (1.0 - CONFIDENCE), np.isfinite(draws)
    n = np.where(finite, draws, 1.0)
    successes = share * n
    # a beta distribution needs both numbers above zero; if a number is zero, the limit is 0 or 1
    low = np.where(successes > 0.0, beta.ppf(tail, np.maximum(successes, 1e-12), n - successes + 1.0), 0.0)
    high = np.where(successes < n, beta.ppf(1.0 - tail, successes + 1.0, np.maximum(n - successes, 1e-12)), 1.0)
    return np.where(finite, low, share), np.where(finite, high, share)


def find_addable_limits(share: Floats, draws: Floats) -> tuple[Floats, Floats]:
    """Limits of a share for sums of squared distances.

    The limits are the exact limits, or the normal limits if these are farther from the share. They may be below 0 or
    above 1.

    Parameters
    ----------
    share : ndarray of shape (n,)
        Observed shares, from 0 to 1.
    draws : ndarray of shape (n,)
        Effective numbers of draws.

    Returns
    -------
    tuple of arrays (n,)
        Lower and upper limits.
    """
    low, high = find_exact_limits(share, draws)
    spread = np.divide(share * (1.0 - share), draws, out=np.ones_like(share), where=draws > 0.0)
    normal = _NORMAL * np.sqrt(spread)
    return np.minimum(low, share - normal), np.maximum(high, share + normal)


def combine_shares(weights: Floats, shares: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """Weighted sum of shares with its limits (MOVER, Zou and Donner 2008).

    Parameters
    ----------
    weights, shares : ndarray of shape (..., n)
        Weights and shares of the strata.
    low, high : ndarray of shape (..., n)
        Limits of the shares.

    Returns
    -------
    tuple of arrays (...)
        Sum over the last axis, and its lower and upper limit from 0 to 1.
    """
    estimate = np.sum(weights * shares, axis=-1)
    lower_distance = np.sqrt(np.sum((weights * (shares - low)) ** 2, axis=-1))
    upper_distance = np.sqrt(np.sum((weights * (high - shares)) ** 2, axis=-1))
    return estimate, np.maximum(estimate - lower_distance, 0.0), np.minimum(estimate + upper_distance, 1.0)


def estimate_share(strata: Sequence[Stratum], answers: Collection[str]) -> Share:
    """Share of a population with some answers.

    Parameters
    ----------
    strata
        Strata of the population with their draws.
    answers
        Answers that count.

    Returns
    -------
    Share
        Estimate and interval for 95 %.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.fleet.estimate import Stratum, estimate_share
    >>> stratum = Stratum(
    ...     name="near",
    ...     weight=1.0,
    ...     positions=1000,
    ...     guess=0.5,
    ...     answers=np.array(["HOLDS", "HOLDS", "FAILS", "HOLDS"]),
    ...     weights=np.full(4, 0.001),
    ...     inclusion=np.full(4, 0.004),
    ... )
    >>> share = estimate_share([stratum], {"HOLDS"})
    >>> share.estimate, share.low < 0.75 < share.high
    (0.75, True)
    """
    weights = np.array([stratum.weight for stratum in strata])
    shares = np.array([stratum.share(answers) for stratum in strata])
    low, high = find_addable_limits(shares, np.array([stratum.effective_draws for stratum in strata]))
    estimate, low, high = combine_shares(weights / weights.sum(), shares, low, high)
    return Share(estimate=float(estimate), low=float(low), high=float(high))


def find_share_bounds(strata: Sequence[Stratum], holds: str, undecided: Collection[str]) -> tuple[float, float]:
    """Limits of the share for any answer of the undecided positions.

    Parameters
    ----------
    strata
        Strata of the population.
    holds
        Answer that is counted.
    undecided
        Answers that may become any answer.

    Returns
    -------
    low, high
        Share from 0 to 1 if no undecided position holds (lower end of its interval), and if all hold (upper end).
    """
    return estimate_share(strata, {holds}).low, estimate_share(strata, {holds, *undecided}).high


def find_draw_scale(weights: Floats, draws: int) -> float:
    """The number c for which the probabilities min(1, c w) sum to the draws.

    Parameters
    ----------
    weights : ndarray of shape (n,)
        Weights w of the positions of a stratum.
    draws
        Number of positions to draw.

    Returns
    -------
    float
        Scale c, per unit of weight.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.fleet.estimate import find_draw_scale
    >>> weights = np.array([0.7, 0.1, 0.1, 0.1])
    >>> np.minimum(1.0, find_draw_scale(weights, 2) * weights).round(3).tolist()
    [1.0, 0.333, 0.333, 0.333]
    """
    if draws >= weights.size:
        return float(1.0 / weights.min())
    heaviest = np.sort(weights)[::-1]
    # if the k heaviest positions are drawn with certainty, the remaining draws are shared by the remaining positions
    remaining = np.cumsum(heaviest[::-1])[::-1][:draws]
    scales = (draws - np.arange(draws)) / remaining
    return float(scales[np.argmax(scales * heaviest[:draws] <= 1.0)])


def allocate_draws(
    weights: Floats, shares: Floats, positions: NDArray[np.int64], drawn_counts: NDArray[np.int64], draws: int
) -> NDArray[np.int64]:
    """Number of draws of each stratum.

    Parameters
    ----------
    weights : ndarray of shape (n,)
        Weights of the strata.
    shares : ndarray of shape (n,)
        Expected shares that hold.
    positions, drawn_counts : ndarray of shape (n,)
        Numbers of all positions and of positions drawn before.
    draws
        Number of draws in all.

    Returns
    -------
    array (n,)
        Numbers of draws.

    Notes
    -----
    Half of the draws is in proportion to the weight W of a stratum, half to W sqrt(p (1 - p)) (Neyman 1934). A position
    has equal cost in each stratum. A stratum keeps its earlier draws and has at least two draws, so that no stratum is
    assumed to be exact. Draws that exceed the positions of a stratum go to the others (whole numbers by Webster's
    method).

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.fleet.estimate import allocate_draws
    >>> none_drawn = np.array([0, 0])
    >>> allocate_draws(np.array([0.9, 0.1]), np.array([0.98, 0.5]), np.array([900, 100]), none_drawn, 100).tolist()
    [81, 19]
    """
    spread = weights * np.sqrt(shares * (1.0 - shares))
    target_fractions = 0.5 * weights / weights.sum() + 0.5 * spread / spread.sum()
    counts = np.minimum(positions, np.maximum(drawn_counts, 2))
    while counts.sum() < min(draws, positions.sum()):
        counts[np.argmin(np.where(counts < positions, (counts + 0.5) / target_fractions, np.inf))] += 1
    return counts


def count_needed_draws(strata: Sequence[Stratum], answer: str, half_width: float) -> int:
    """Number of draws in all for an interval of a given half-width.

    The draws are allocated as by `allocate_draws`. The expected share of a stratum is the share of its draws and of one
    further draw with the share by the screening.

    Parameters
    ----------
    strata
        Strata of the population with their draws.
    answer
        Answer that is counted.
    half_width
        Half of the length of the interval for 95 %, from 0 to 1.

    Returns
    -------
    int
        Number of positions to draw, earlier draws included; at most all positions.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.fleet.estimate import Stratum, count_needed_draws
    >>> no_answers, no_weights = np.array([], dtype=str), np.array([])
    >>> stratum = Stratum(
    ...     name="near",
    ...     weight=1.0,
    ...     positions=100_000,
    ...     guess=0.5,
    ...     answers=no_answers,
    ...     weights=no_weights,
    ...     inclusion=no_weights,
    ... )
    >>> count_needed_draws([stratum], "HOLDS", 0.05) > 300
    True
    """
    weights = np.array([stratum.weight for stratum in strata])
    positions = np.array([stratum.positions for stratum in strata])
    earlier = np.array([stratum.drawn for stratum in strata])
    holding = np.array([stratum.share({answer}) * max(stratum.drawn, 1) + stratum.guess for stratum in strata])
    # a share of exactly 0 or 1 would get no draws
    shares = np.clip(holding / (np.maximum(earlier, 1) + 1.0), 0.02, 0.98)

    def predict_half_width(draws: int) -> float:
        """Half-width of the interval after a number of draws."""
        counts = allocate_draws(weights, shares, positions, earlier, draws)
        low, high = find_addable_limits(shares, np.where(counts < positions, counts, np.inf))
        _, lower, upper = combine_shares(weights / weights.sum(), shares, low, high)
        return 0.5 * float(upper - lower)

    too_few, enough = 2, 2
    while enough < positions.sum() and predict_half_width(enough) > half_width:
        too_few, enough = enough, 2 * enough
    enough = min(enough, int(positions.sum()))
    while enough - too_few > max(1, enough // 50):
        middle = (too_few + enough) // 2
        too_few, enough = (middle, enough) if predict_half_width(middle) > half_width else (too_few, middle)
    return enough


REPEATS = 400
"""Number of repeats of the bootstrap over wheels and rails, from these profiles to their network."""


def bootstrap_share(
    wheels: NDArray[np.int64], rails: NDArray[np.int64], holding: Floats, weights: Floats, seed: int
) -> Share:
    """Share for a network, if these wheels and rails are its random sample.

    Wheels and rails are drawn again, each with replacement (pigeonhole bootstrap, Owen 2007). A pair counts by the
    product of the draws of both of its profiles.

    Parameters
    ----------
    wheels, rails
        Numbers of the profiles of each pair.
    holding, weights
        Weight of a pair's positions at which Hertz holds, and of all of them.
    seed
        Seed of the draws.

    Returns
    -------
    Share
        Share of these profiles, with the interval for 95 % over 400 repeats.
    """
    random = np.random.default_rng(seed)
    bootstrap_shares = []
    for _ in range(REPEATS):
        times = _count_draws(random, wheels) * _count_draws(random, rails)
        # sums, not products of vectors: on several threads their last digits differ
        if (total := float(np.sum(times * weights))) > 0.0:
            bootstrap_shares.append(float(np.sum(times * holding)) / total)
    low, high = np.quantile(bootstrap_shares, [0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)])
    return Share(estimate=float(holding.sum() / weights.sum()), low=float(low), high=float(high))


def _count_draws(random: np.random.Generator, profiles: NDArray[np.int64]) -> Floats:
    """Number of draws of the profile of each pair.

    There are as many draws as profiles.
    """
    count = int(profiles.max()) + 1
    return np.bincount(random.integers(count, size=count), minlength=count)[profiles].astype(float)
