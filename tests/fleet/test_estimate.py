"""Shares of a fleet and their intervals, against closed forms, published examples and simulated fleets."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest, norm

from fecontact.features.fleet.estimate import (
    Stratum,
    allocate_draws,
    bootstrap_share,
    combine_shares,
    count_needed_draws,
    estimate_share,
    find_addable_limits,
    find_draw_scale,
    find_exact_limits,
    find_share_bounds,
)

FLEETS = 1000
# three standard deviations of a coverage of 95 % that is seen in so many fleets
SEEN = 3.0 * np.sqrt(0.95 * 0.05 / FLEETS)
DRAWS = (100, 300, 1000)


def wilson(share: np.ndarray, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Wilson (1927)."""
    z = norm.ppf(0.975)
    middle = (share + 0.5 * z**2 / draws) / (1.0 + z**2 / draws)
    reach = z * np.sqrt(share * (1.0 - share) / draws + 0.25 * (z / draws) ** 2) / (1.0 + z**2 / draws)
    return middle - reach, middle + reach


def stratum(
    answers: str, *, weight: float = 1.0, positions: int = 10**6, guess: float = 0.5, name: str = ""
) -> Stratum:
    """A stratum of equal weights.

    The letters are the verdicts of the positions that were drawn.
    """
    count = len(answers)
    inclusion = np.full(count, count / positions)
    weights = np.full(count, weight / positions)
    answer_array = np.array(list(answers), dtype=str)
    return Stratum(
        name=name,
        weight=weight,
        positions=positions,
        guess=guess,
        answers=answer_array,
        weights=weights,
        inclusion=inclusion,
    )


@pytest.mark.parametrize(
    ("share", "draws", "low", "high"),
    # Newcombe (1998), Statistics in Medicine 17, 857, table I, method 5
    [(81, 263, 0.2527, 0.3676), (15, 148, 0.0578, 0.1617), (0, 20, 0.0, 0.1684), (1, 29, 0.0009, 0.1776)],
)
def test_limits_are_published_ones(share, draws, low, high):
    limits_found = [float(limit[0]) for limit in find_exact_limits(np.array([share / draws]), np.array([float(draws)]))]
    assert limits_found == pytest.approx([low, high], abs=6e-5)
    exact = binomtest(share, draws).proportion_ci(method="exact")
    assert limits_found == pytest.approx([exact.low, exact.high], abs=1e-9)


def test_none_of_the_draws_is_not_none_of_the_stratum():
    for draws in DRAWS:
        low, high = find_exact_limits(np.array([0.0, 1.0]), np.array([float(draws)] * 2))
        assert high[0] == pytest.approx(1.0 - 0.025 ** (1.0 / draws), rel=1e-9)
        assert (low[0], high[1]) == (0.0, 1.0)
        assert low[1] == pytest.approx(0.025 ** (1.0 / draws), rel=1e-9)


def test_no_draw_tells_nothing_and_all_draws_tell_all():
    low, high = find_exact_limits(np.array([0.3, 0.3]), np.array([0.0, np.inf]))
    assert list(zip(low, high, strict=True)) == [(0.0, 1.0), (0.3, 0.3)]
    assert stratum("").share({"H"}) == 0.5
    share = estimate_share([stratum("HHF", positions=3)], {"H"})
    assert (share.low, share.high) == pytest.approx((2 / 3, 2 / 3))


def test_limits_combine_as_in_a_published_difference():
    # Newcombe (1998), Statistics in Medicine 17, 873, table II, method 10, case a: 56/70 - 48/80
    shares, draws = np.array([56 / 70, 32 / 80]), np.array([70.0, 80.0])
    difference = [float(limit) - 1.0 for limit in combine_shares(np.ones(2), shares + 0.0, *wilson(shares, draws))]
    # a sum of shares may be more than 1, which a share of a fleet is not
    assert difference[0] == pytest.approx(0.2)
    low = 0.2 - np.sqrt(np.sum((shares - wilson(shares, draws)[0]) ** 2))
    high = 0.2 + np.sqrt(np.sum((wilson(shares, draws)[1] - shares) ** 2))
    assert (low, high) == pytest.approx((0.0524, 0.3339), abs=6e-5)
    halved = [float(limit) for limit in combine_shares(np.full(2, 0.5), shares, *wilson(shares, draws))]
    assert 2.0 * np.array(halved) - 1.0 == pytest.approx([0.2, 0.0524, 0.3339], abs=6e-5)


def test_bounds_count_open_ones_as_either():
    strata = [stratum("HHHHOF", weight=0.6), stratum("FFUF", weight=0.4)]
    bounds_found = find_share_bounds(strata, "H", {"O", "U"})
    assert bounds_found == (estimate_share(strata, {"H"}).low, estimate_share(strata, {"H", "O", "U"}).high)
    assert estimate_share(strata, {"H"}).estimate == pytest.approx(0.6 * 4 / 6)
    assert estimate_share(strata, {"H", "O", "U"}).estimate == pytest.approx(0.6 * 5 / 6 + 0.4 / 4)


# --- Which positions are drawn.


def inclusion_probabilities(weights: np.ndarray, draws: int) -> np.ndarray:
    return np.minimum(1.0, find_draw_scale(weights, draws) * weights)


def test_probabilities_of_a_draw():
    assert inclusion_probabilities(np.full(50, 0.02), 10) == pytest.approx(np.full(50, 0.2))
    # the heaviest is drawn surely, the others share two draws by their weights
    assert inclusion_probabilities(np.array([1.0, 2.0, 3.0, 4.0, 100.0]), 3) == pytest.approx([0.2, 0.4, 0.6, 0.8, 1])
    assert inclusion_probabilities(np.ones(3), 5) == pytest.approx(np.ones(3))
    weights = np.random.default_rng(1).lognormal(0.0, 1.5, 500)
    for draws in (1, 7, 120, 499):
        probabilities = inclusion_probabilities(weights, draws)
        assert probabilities.sum() == pytest.approx(draws)
        assert probabilities.max() <= 1.0


def test_positions_are_drawn_as_often_as_their_probabilities_say():
    random, times, draws = np.random.default_rng(2), 4000, 30
    weights = random.lognormal(0.0, 1.0, 200)
    hits = np.zeros(200)
    for _ in range(times):
        hits[np.argsort(random.random(200) / weights)[:draws]] += 1
    probabilities = inclusion_probabilities(weights, draws)
    noise = np.sqrt(probabilities * (1.0 - probabilities) / times)
    # an order of u / w has these probabilities but for terms of the second order: in 4 10^4 such samples 0.015, and
    # 0.039 of a position that is just heavy enough to be drawn surely
    off = np.abs(hits / times - probabilities)
    assert np.all(off < np.where(probabilities < 1.0, 0.016, 0.045) + 4.0 * noise)
    assert np.mean(off) < 0.005


def test_draws_are_half_by_weight_and_half_by_spread():
    weights, shares = np.array([0.6, 0.1, 0.3]), np.array([0.02, 0.25, 0.02])
    spread = weights * np.sqrt(shares * (1.0 - shares))
    many, no_draws = np.full(3, 10**6), np.zeros(3, int)
    draws_found = allocate_draws(weights, shares, many, no_draws, 1000)
    assert draws_found.sum() == 1000
    assert np.all(np.abs(draws_found - 500 * weights - 500 * spread / spread.sum()) <= 1.0)


def test_draws_keep_earlier_ones_and_are_no_more_than_there_are():
    weights, shares = np.array([0.6, 0.1, 0.3]), np.array([0.02, 0.25, 0.02])
    draws_found = allocate_draws(weights, shares, np.array([1000, 20, 1]), np.array([0, 15, 0]), 100)
    assert list(draws_found) == [79, 20, 1] or (
        draws_found.sum() == 100 and draws_found[1] >= 15 and draws_found[2] == 1
    )
    assert allocate_draws(weights, shares, np.array([3, 4, 1]), np.zeros(3, int), 100).sum() == 8


# --- Simulated fleets: the interval has the true share in 95 % of them and more.


def coverage(
    weights: list[float],
    discordance: list[float],
    draws: int,
    method: Callable = find_addable_limits,
    fleets: int = FLEETS,
) -> tuple[float, float]:
    """Share of simulated fleets with the true share in the interval.

    Also returns the mean half-width of the interval in points.
    """
    w, d = np.array(weights), np.array(discordance)
    guess = np.array([0.02, 0.25, 0.02])[: w.size]
    count = allocate_draws(w, guess, np.full(w.size, 10**6), np.zeros(w.size, int), draws)
    shares_drawn = np.random.default_rng(draws).binomial(count, d, (fleets, w.size)) / count
    _, low, high = combine_shares(
        w, shares_drawn, *method(shares_drawn, np.broadcast_to(count.astype(float), shares_drawn.shape))
    )
    true = float(w @ d)
    return float(np.mean((low <= true) & (true <= high))), float(50.0 * np.mean(high - low))


# half-widths in points of the same strata by Wilson's limits, reported for 1,500 simulated fleets
REPORTED = {100: (4.6, 4.5), 300: (2.0, 1.9), 1000: (0.93, 0.8)}


@pytest.mark.parametrize("draws", DRAWS)
def test_coverage_and_width_of_a_usual_fleet(draws):
    for place, discordance in enumerate(([0.004, 0.25, 0.01], [0.0005, 0.15, 0.002])):
        covered, width = coverage([0.62, 0.10, 0.28], discordance, draws)
        assert covered >= 0.95
        assert 0.7 * REPORTED[draws][place] < width < 1.05 * REPORTED[draws][place]


@pytest.mark.parametrize("draws", DRAWS)
@pytest.mark.parametrize("near", [0.15, 0.25])
@pytest.mark.parametrize("weights", [[0.62, 0.10, 0.28], [0.95, 0.02, 0.03], [0.30, 0.40, 0.30]])
def test_coverage_for_any_discordance(weights, near, draws):
    coverages = [coverage(weights, [d, near, d], draws)[0] for d in np.geomspace(0.0005, 0.25, 12)]
    assert min(coverages) >= 0.955 - SEEN
    assert np.mean(coverages) >= 0.965


def test_wilson_would_not_cover():
    # why the exact limits are used: a discordance of 0.2 % in all strata, 300 draws
    strata = [0.62, 0.10, 0.28], [0.002] * 3, 300
    assert coverage(*strata, method=wilson)[0] < 0.91
    assert coverage(*strata)[0] >= 0.95


def test_exact_limits_squared_and_added_would_not_cover():
    # the least that a search found: strata of like weights, all with the same rare discordance; three standard
    # deviations of 20,000 fleets are 0.005
    alike = [0.3, 0.4, 0.3], [0.0018] * 3, 300
    assert coverage(*alike, method=find_exact_limits, fleets=20_000)[0] < 0.935
    covered, width = coverage(*alike, fleets=20_000)
    assert covered >= 0.95
    assert width < 1.15 * coverage(*alike, method=find_exact_limits, fleets=20_000)[1]


def test_distances_that_are_added_are_normal_ones_at_least():
    share, draws = np.array([0.0, 0.01, 0.3, 0.99, 0.4, 0.4]), np.array([100.0, 100.0, 50.0, 100.0, 0.0, np.inf])
    low, high = find_addable_limits(share, draws)
    exact_low, exact_high = find_exact_limits(share, draws)
    # one of a hundred: 0.01 and 1.96 standard deviations of 0.00995 below it
    assert low[1] == pytest.approx(0.01 - 1.959964 * 0.00994987, abs=1e-7)
    assert high[3] == pytest.approx(0.99 + 1.959964 * 0.00994987, abs=1e-7)
    # away from none, or from all, the exact ones are farther
    assert (high[2], high[1], low[3]) == (exact_high[2], exact_high[1], exact_low[3])
    assert (low[0], high[0], low[5], high[5]) == (0.0, exact_high[0], 0.4, 0.4)
    assert low[4] < 0.0
    assert high[4] > 1.0


def drawn_fleets(sizes: list[int], discordance: list[float], draws: list[int], heavy: float) -> tuple[float, float]:
    """Coverage with finite strata of unequal weights, drawn as in a fleet.

    Also returns the mean error in half-widths.
    """
    random = np.random.default_rng(5)
    parts = [random.lognormal(0.0, heavy, size) for size in sizes]
    total = sum(stratum_weights.sum() for stratum_weights in parts)
    parts = [stratum_weights / total for stratum_weights in parts]
    answers = [np.where(random.random(size) < d, "F", "H") for size, d in zip(sizes, discordance, strict=True)]
    true = sum(float(stratum_weights @ (answer == "H")) for stratum_weights, answer in zip(parts, answers, strict=True))
    hits, errors = 0, []
    for _ in range(FLEETS):
        strata = []
        for stratum_weights, answer, count in zip(parts, answers, draws, strict=True):
            chosen = np.argsort(random.random(stratum_weights.size) / stratum_weights)[:count]
            strata.append(
                Stratum(
                    name="",
                    weight=float(stratum_weights.sum()),
                    positions=stratum_weights.size,
                    guess=0.5,
                    answers=answer[chosen],
                    weights=stratum_weights[chosen],
                    inclusion=inclusion_probabilities(stratum_weights, count)[chosen],
                )
            )
        share = estimate_share(strata, {"H"})
        hits += share.low <= true <= share.high
        errors.append((share.estimate - true) / (share.high - share.low) * 2.0)
    return hits / FLEETS, float(np.mean(errors))


@pytest.mark.parametrize("heavy", [0.0, 1.5])
@pytest.mark.parametrize(
    ("sizes", "draws"),
    [([6200, 1000, 2800], [170, 53, 77]), ([372, 60, 168], [85, 27, 38])],
    ids=["300 of 10000", "150 of 600"],
)
def test_coverage_with_positions_of_unequal_weight(sizes, draws, heavy):
    covered, error = drawn_fleets(sizes, [0.01, 0.25, 0.02], draws, heavy)
    assert covered >= 0.95
    # the estimate is not biased by the weights: its mean error is a small part of the half-width
    assert abs(error) < 0.08


def test_resampled_profiles_have_the_spread_of_wheels():
    # Hertz holds or not by the wheel alone: the share is a mean over 60 wheels
    wheels, rails = (indices.ravel() for indices in np.meshgrid(np.arange(60), np.arange(40), indexing="ij"))
    holding = (wheels < 18).astype(float)
    spread = bootstrap_share(wheels, rails, holding, np.ones(2400), seed=3)
    assert spread.estimate == pytest.approx(0.3)
    assert 0.5 * (spread.high - spread.low) == pytest.approx(1.96 * np.sqrt(0.3 * 0.7 / 60), rel=0.12)
    # of rails as well: both variances, and Owen's term of both, which a share of neither has not
    either = ((wheels < 18) ^ (rails < 12)).astype(float)
    assert bootstrap_share(wheels, rails, either, np.ones(2400), seed=3).high > 0.42


@pytest.mark.parametrize("share", [0.5, 0.2])
def test_needed_draws_are_those_of_a_binomial_share(share):
    nothing = np.array([])
    stratum = Stratum(
        name="near",
        weight=1.0,
        positions=10_000_000,
        guess=share,
        answers=np.array([], dtype=str),
        weights=nothing,
        inclusion=nothing,
    )
    for half_width in (0.05, 0.02):
        # normal interval of a share; the distances of exact limits are longer by about 0.5 / n, which takes
        # 1 / half_width further draws, and the search ends within 2 %
        expected = 1.96**2 * share * (1.0 - share) / half_width**2
        assert expected < count_needed_draws([stratum], "HOLDS", half_width) < 1.05 * expected + 1.0 / half_width
    small_stratum = replace(stratum, positions=40)
    assert count_needed_draws([small_stratum], "HOLDS", 0.01) <= 40
