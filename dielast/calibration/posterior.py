"""Draws of the parameters from their posterior, by an ensemble of walkers that move in batches until their draws agree.

The prior is uniform in the coordinates within the bounds: a positive parameter that the tests do not determine is drawn
log-uniformly over its range. The walkers start from points of the profiles. They move by differences between earlier positions of
all walkers (ter Braak and Vrugt 2008, DOI 10.1007/s11222-008-9104-9), often in some of the parameters only (Vrugt et al. 2009, DOI
10.1515/IJNSNS.2009.10.3.273): parameters that tests determine and those that they do not need steps of different length. Half of
the differences are of the values of positive parameters instead of their logarithms.

The first half of the moves is dropped. The walkers move until the rank-normalised split R-hat of the second half, of all
coordinates and of the sum of squares, is small (Vehtari et al. 2021, DOI 10.1214/20-BA1221). For n moves in each half of a chain
that forgets its start within t moves, R-hat is nearly sqrt(1 + t/n), and exp(-2 n/t) of any error of the starts is left when the
first draw is kept. At `AGREEMENT` this is a tenth, and the chain holds two independent draws. This is enough, as the draws are
those of all walkers together; 1.01 is needed for means over a few chains only (Margossian et al. 2024, DOI 10.1214/24-BA1453).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import fdtri, ndtri

from dielast.calibration.likelihood import Likelihood
from dielast.calibration.profiles import Profile
from dielast.errors import warn
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.random_streams import stream

FEWEST_WALKERS, MOST_WALKERS = 40, 200
ROUNDS = 4  # draws of a walker, if the number of walkers allows for it
SPACING = 5  # moves of a walker between two of its draws, at least
FEWEST_MOVES, MOST_MOVES = 100, 400
LONGER = 1.4  # number of moves over that of the check before
AGREEMENT = 1.35  # largest R-hat
JUMP = 0.1  # share of the moves that can jump between modes of the posterior
BY_VALUE = 0.5  # share of the moves by differences of values instead of logarithms
MOVED = (0.3, 0.6, 1.0)  # probabilities that a parameter moves, one of them for each move
JITTER = 1e-6  # of the range
ROUNDING = 1e-12  # variance of equal values, which have no R-hat
WIDEST = 0.3  # standard deviation of the scatter about profiles, at most: beyond, a linearised model is not to be relied on
PLAUSIBLE = 0.99  # level of the sums of squares of starts
HALVINGS = 8  # of the scatter of starts


def draw(
    likelihood: Likelihood,
    profiles: Sequence[Profile],
    count: int,
    *,
    seed: int = 1,
    watch: Callable[[int, int], None] | None = None,
) -> Floats:
    """Draws (count, p) of the coordinates; `watch` is called with the number of moves done and the largest number.

    Warns if the walkers do not agree after the largest number of moves.
    """
    fit = likelihood.fit
    random = stream(seed, "posterior")
    walkers = max(FEWEST_WALKERS, 3 * fit.coordinates.size, min(-(-count // ROUNDS), MOST_WALKERS))
    rounds = -(-count // walkers)
    fewest = max(FEWEST_MOVES, 2 * SPACING * rounds)
    most = max(MOST_MOVES, fewest)
    ensemble = _Ensemble(likelihood, profiles, walkers, random)
    check, ratio = fewest, np.inf
    for done in range(1, most + 1):
        ensemble.move()
        if watch is not None:
            watch(done, most)
        if done == check:
            ratio = float(np.max(r_hat(ensemble.second_half)))
            if ratio <= AGREEMENT:
                break
            check = min(int(LONGER * check), most)
    else:
        warn(
            f"draws are approximate: after {most} moves R-hat is {ratio:.2g}, at most {AGREEMENT} is wanted; "
            "weakly determined parameters need narrower bounds, a prior, or further tests"
        )
    half = ensemble.second_half
    times = np.linspace(half.shape[0] - 1, 0, rounds + 1)[:-1].round().astype(np.intp)
    return np.asarray(half[times, :, : fit.coordinates.size].reshape(-1, fit.coordinates.size)[:count])


def r_hat(chains: Floats) -> Floats:
    """The rank-normalised split R-hat (q,) of chains (moves, chains, q), the larger one of those of the values and of their
    distances from the median (Vehtari et al. 2021, DOI 10.1214/20-BA1221, Eqs. 1-4 and 14); 1 for values that are all equal.
    """
    half = chains.shape[0] // 2
    split = np.concatenate((chains[:half], chains[half : 2 * half]), axis=1)
    folded = np.abs(split - np.median(split, axis=(0, 1)))
    return np.maximum(_r_hat(split), _r_hat(folded))


def _r_hat(split: Floats) -> Floats:
    from scipy.stats import rankdata

    length, every = split.shape[0], split.shape[0] * split.shape[1]
    rank = rankdata(split.reshape(every, -1), axis=0).reshape(split.shape)
    normal = ndtri((rank - 0.375) / (every + 0.25))
    within = np.mean(np.var(normal, axis=0, ddof=1), axis=0)
    between = np.var(np.mean(normal, axis=0), axis=0, ddof=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.sqrt((length - 1) / length + between / within)
    return np.asarray(np.where(between <= ROUNDING, 1.0, ratio))


class _Ensemble:
    """Walkers `at` (walkers, p) with their sums of squares `cost` (walkers,); `past` are positions (m, p) that moves are made from,
    `path` holds the positions and sums of squares (walkers, p + 1) after each move.
    """

    def __init__(self, likelihood: Likelihood, profiles: Sequence[Profile], walkers: int, random: np.random.Generator) -> None:
        self.likelihood, self.random = likelihood, random
        self.lower, self.upper = likelihood.fit.space.bounds
        self.positive: Flags = np.array([parameter.scale is None for parameter in likelihood.fit.space.parameters])
        starts, cost = _starts(likelihood, profiles, 2 * walkers, random)
        self.at, self.cost = starts[:walkers], cost[:walkers]
        self.past = [starts]
        self.path: list[Floats] = []

    @property
    def second_half(self) -> Floats:
        """Positions and sums of squares (moves, walkers, p + 1) of the second half of the moves."""
        return np.array(self.path[len(self.path) // 2 :])

    def move(self) -> None:
        """Move all walkers, or leave them where they are (Metropolis)."""
        trial, volume = self._trial()
        inside = np.all((trial >= self.lower) & (trial <= self.upper), axis=1)
        cost = np.full(inside.size, np.inf)
        if inside.any():
            cost[inside] = _cost(self.likelihood, trial[inside])
        gain = 0.5 * (_heavy(self.cost, self.likelihood) - _heavy(cost, self.likelihood)) + volume
        taken = np.log(self.random.random(gain.size)) < np.where(inside, gain, -np.inf)
        self.at = np.where(taken[:, None], trial, self.at)
        self.cost = np.where(taken, cost, self.cost)
        self.path.append(np.column_stack((self.at, self.cost)))
        if len(self.path) % SPACING == 0:
            self.past.append(self.at)

    def _trial(self) -> tuple[Floats, Floats]:
        """Trials (walkers, p), NaN where a value would be negative, and the logarithm (walkers,) of the change of the volume."""
        past, (walkers, size), random = np.concatenate(self.past), self.at.shape, self.random
        one = random.integers(0, len(past), walkers)
        two = (one + random.integers(1, len(past), walkers)) % len(past)
        moved = random.random((walkers, size)) < random.choice(MOVED, walkers)[:, None]
        moved[np.arange(walkers), random.integers(0, size, walkers)] = True
        # 2.38/sqrt(2d) is the best factor for normal distributions in d dimensions; shorter moves follow curved ones
        length = 2.38 / np.sqrt(2 * np.sum(moved, axis=1)) * random.uniform(0.1, 1.2, walkers)
        length = np.where(random.random(walkers) < JUMP, 1.0, length)[:, None]
        step = length * (past[one] - past[two])
        step += JITTER * (self.upper - self.lower) * random.standard_normal(step.shape)
        # values relative to the present ones; tests often see sums of moduli, which differences of values leave as they are
        rise = length * (np.exp(past[one] - self.at) - np.exp(past[two] - self.at))
        by_value = moved & self.positive & (random.random((walkers, 1)) < BY_VALUE)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.where(by_value, np.log1p(rise), step)
        volume = -np.sum(step, axis=1, where=by_value)
        return self.at + np.where(moved, step, 0.0), volume


def _cost(likelihood: Likelihood, at: Floats) -> Floats:
    """Sums of squares (k,), infinite if the tests cannot be simulated."""
    every: Cases = np.zeros(len(at), dtype=np.intp)
    residuals = likelihood.residuals(at, every)
    cost = np.einsum("kn,kn->k", residuals, residuals)
    return np.where(np.isfinite(cost), cost, np.inf)


def _heavy(cost: Floats, likelihood: Likelihood) -> Floats:
    """Minus twice the logarithm of the density (k,), a Student's t because the scatter is estimated."""
    freedom = likelihood.common_freedom
    return np.asarray((freedom + likelihood.fit.coordinates.size) * np.log1p(cost / freedom))


def _starts(likelihood: Likelihood, profiles: Sequence[Profile], count: int, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Starts (count, p) with their sums of squares (count,): points of the profiles, by likelihood, with scatter from the
    covariance, and parameters without a variance anywhere along their profile. Where the sum of squares would not be plausible,
    the scatter is halved, again and again, down to none.
    """
    fit = likelihood.fit
    lower, upper = fit.space.bounds
    centre = _points(likelihood, profiles, count, random)
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    values, vectors = np.linalg.eigh(covariance)
    width = np.minimum(np.sqrt(np.maximum(values, 0.0)), WIDEST)
    scatter = (random.standard_normal((count, values.size)) * width) @ vectors.T
    for j in np.flatnonzero(~np.isfinite(likelihood.standard_error)).tolist():
        # nearly all likely places are along the profile, which the fit may be at the end of
        place = random.uniform(lower[j], upper[j], 20 * count)
        rise = _heavy(np.interp(place, profiles[j].coordinate, profiles[j].rise), likelihood)
        likely = place[random.random(place.size) < np.exp(-0.5 * rise)]
        scatter[:, j] = (np.resize(likely, count) if likely.size else fit.coordinates[j]) - centre[:, j]
    freedom, size = likelihood.common_freedom, fit.coordinates.size
    plausible = size * float(fdtri(size, freedom, PLAUSIBLE))
    edge = 1e-9 * (upper - lower)
    at, cost = np.clip(centre, lower + edge, upper - edge), np.full(count, np.inf)
    for halving in range(HALVINGS + 1):
        left = np.flatnonzero(cost > plausible)
        if left.size:
            share = 0.5**halving if halving < HALVINGS else 0.0
            at[left] = np.clip(centre[left] + share * scatter[left], lower + edge, upper - edge)
            cost[left] = _cost(likelihood, at[left])
    lost = ~np.isfinite(cost)
    at[lost], cost[lost] = fit.coordinates, 0.0
    return at, cost


def _points(likelihood: Likelihood, profiles: Sequence[Profile], count: int, random: np.random.Generator) -> Floats:
    """Points (count, p) of the profiles: each profile alike, a point by its likelihood and its share of the profile's length."""
    points, weights = [likelihood.fit.coordinates[None]], [np.full(1, 1e-9)]
    for profile in profiles:
        if profile.coordinate.size > 1:
            likely = np.exp(-0.5 * _heavy(profile.rise, likelihood)) * np.gradient(profile.coordinate)
            points.append(profile.points)
            weights.append(likely / np.sum(likely))
    weight = np.concatenate(weights)
    return np.asarray(np.concatenate(points)[random.choice(weight.size, count, p=weight / np.sum(weight))])
