"""Draws of the parameters from their posterior, by an ensemble of walkers that move in batches until their draws agree.

The prior is uniform in the coordinates within the bounds: a positive parameter that the tests do not determine is drawn
log-uniformly over its range. The ranges of parameters that tests do not determine are divided, and as many walkers move in each of
these `strata`: a few hundred draws of all ranges together would hardly have any where several such parameters are in their tails.
The walkers start from points of the profiles, or about the centre of their stratum. A move is a chain of many moves (`moves`) in a
surrogate of the model. The model is evaluated at its end alone, which is accepted or not such that the draws are those of the model
(delayed acceptance, Christen and Fox 2005, DOI 10.1198/106186005X76983). In the first half of the moves the surrogate learns, and
the positions that moves are made from are renewed; in the second half both stay as they are.

The first half is dropped. The walkers move until the rank-normalised split R-hat of the second half, of all coordinates and of the
sum of squares, is small (Vehtari et al. 2021, DOI 10.1214/20-BA1221); ranks are those within a stratum. For n moves in each half of
a chain that forgets its start within t moves, R-hat is nearly sqrt(1 + t/n), and exp(-2 n/t) of any error of the starts is left
when the first draw is kept. At `AGREEMENT` this is a tenth, and the chain holds two independent draws. This is enough, as the draws
are those of all walkers together; 1.01 is needed for means over a few chains only (Margossian et al. 2024, DOI 10.1214/24-BA1453).
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import fdtri, ndtri

from dielast.base.errors import warn
from dielast.calibration.levenberg import costs
from dielast.calibration.likelihood import Likelihood
from dielast.calibration.moves import Moves
from dielast.calibration.profiles import Profile
from dielast.calibration.strata import Strata, stratify
from dielast.calibration.surrogate import Surrogate
from dielast.numerics.arrays import Cases, Flags, Floats, Index
from dielast.numerics.random_streams import stream

FEWEST_WALKERS, MOST_WALKERS = 40, 200
ROUNDS = 4  # draws of a walker, if the number of walkers allows for it
SPACING = 2  # moves of a walker between two of its draws, at least
FEWEST_MOVES, MOST_MOVES = 16, 400
LONGER = 2  # moves up to a check over those up to the check before: the half that is dropped ends there
AHEAD = 30  # moves in the surrogate in each move
MORE = 1.3  # number of evaluations over that at the last surrogate, for a new one
MOST_KNOWN = 500  # points of a surrogate
MOST_PAST = 400  # positions that moves are made from
FAR = 100.0  # largest root of a sum of squares that a surrogate follows
AGREEMENT = 1.35  # largest R-hat
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
    """Draws (count, p) of the coordinates, those of all strata in turns; `watch` is called with the number of moves at which the
    chains are checked next, and the share of them since the last check, in draws.

    Warns if the walkers do not agree after the largest number of moves.
    """
    fit = likelihood.fit
    random = stream(seed, "posterior")
    strata = stratify(likelihood, profiles, count)
    each = 1 if strata is None else len(strata)
    walkers = each * -(-max(FEWEST_WALKERS, 3 * fit.coordinates.size, min(-(-count // ROUNDS), MOST_WALKERS)) // each)
    rounds = -(-count // walkers)
    fewest = max(FEWEST_MOVES, 2 * SPACING * rounds)
    most = max(MOST_MOVES, fewest)
    ensemble = _Ensemble(likelihood, profiles, strata, walkers, random)
    before, check, ratio = 0, fewest, np.inf
    for done in range(1, most + 1):
        if done <= check - check // 2:
            ensemble.learn()
        ensemble.move()
        if watch is not None:
            watch(check, count * (done - before) // (check - before))
        if done == check:
            ratio = float(np.max(r_hat(ensemble.second_half, ensemble.stratum)))
            if ratio <= AGREEMENT:
                break
            before, check = check, min(LONGER * check, most)
    else:
        warn(
            f"draws are approximate: after {most} moves R-hat is {ratio:.2g}, at most {AGREEMENT} is wanted; "
            "weakly determined parameters need narrower bounds, a prior, or further tests"
        )
    half = ensemble.second_half
    times = np.linspace(half.shape[0] - 1, 0, rounds + 1)[:-1].round().astype(np.intp)
    return np.asarray(half[times, :, : fit.coordinates.size].reshape(-1, fit.coordinates.size)[:count])


def r_hat(chains: Floats, stratum: Index | None = None) -> Floats:
    """The rank-normalised split R-hat (q,) of chains (moves, chains, q), the larger one of those of the values and of their
    distances from the median (Vehtari et al. 2021, DOI 10.1214/20-BA1221, Eqs. 1-4 and 14); 1 for values that are all equal. Chains
    of another `stratum` (chains,) are not expected to agree: medians and ranks are those of a stratum.
    """
    half = chains.shape[0] // 2
    split = np.concatenate((chains[:half], chains[half : 2 * half]), axis=1)
    number = np.zeros(split.shape[1]) if stratum is None else np.concatenate((stratum, stratum))
    scores, folded = np.empty_like(split), np.empty_like(split)
    for own in (number == k for k in np.unique(number)):
        values = split[:, own]
        scores[:, own] = _normal(values)
        folded[:, own] = _normal(np.abs(values - np.median(values, axis=(0, 1))))
    return np.maximum(_r_hat(scores), _r_hat(folded))


def _normal(values: Floats) -> Floats:
    """The normal deviates (moves, chains, q) of the ranks of values."""
    every = values.shape[0] * values.shape[1]
    columns = values.reshape(every, -1).T
    # equal values share their mean rank; scipy.stats has such ranks, but is slow to load
    ends = [[np.searchsorted(np.sort(column), column, side=side) for side in ("left", "right")] for column in columns]
    rank = 0.5 * (1 + np.sum(ends, axis=1)).T.reshape(values.shape)
    return np.asarray(ndtri((rank - 0.375) / (every + 0.25)))


def _r_hat(normal: Floats) -> Floats:
    length = normal.shape[0]
    within = np.mean(np.var(normal, axis=0, ddof=1), axis=0)
    between = np.var(np.mean(normal, axis=0), axis=0, ddof=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.sqrt((length - 1) / length + between / within)
    return np.asarray(np.where(between <= ROUNDING, 1.0, ratio))


class _Ensemble:
    """Walkers `at` (walkers, p) with their sums of squares `cost` (walkers,); `past` are positions (m, p) that moves are made from,
    `path` holds the positions and sums of squares (walkers, p + 1) after each move. Each walker stays in its `stratum` (walkers,).
    """

    def __init__(
        self,
        likelihood: Likelihood,
        profiles: Sequence[Profile],
        strata: Strata | None,
        walkers: int,
        random: np.random.Generator,
    ) -> None:
        self.likelihood, self.random = likelihood, random
        lower, upper = self.bounds = likelihood.fit.space.bounds
        self.stratum: Index = np.arange(walkers) % (1 if strata is None else len(strata))
        self.lower, self.upper = (lower, upper) if strata is None else (strata.lower[self.stratum], strata.upper[self.stratum])
        self.logarithm: Flags = np.array([parameter.scale is None for parameter in likelihood.fit.space.parameters])
        self.evaluated = _Evaluated(likelihood)
        starts, cost = _starts(self.evaluated, profiles, strata, 2 * walkers, random)
        self.at, self.cost, self.past = starts[:walkers], cost[:walkers], starts
        self.path: list[Floats] = []
        self.learnt = 0

    @property
    def second_half(self) -> Floats:
        """Positions and sums of squares (moves, walkers, p + 1) of the second half of the moves."""
        return np.array(self.path[len(self.path) // 2 :])

    def learn(self) -> None:
        """Renew the positions that moves are made from, and the surrogate if many points have been evaluated since the last one."""
        if self.path:
            self.past = np.concatenate((self.past, self.at))[-MOST_PAST:]
        self.moves = Moves.of(self.past, self.bounds[1] - self.bounds[0], self.logarithm)
        if self.evaluated.count > MORE * self.learnt:
            self.learnt = self.evaluated.count
            self.surrogate = Surrogate.of(*self.evaluated.points, self.logarithm)

    def move(self) -> None:
        """Move all walkers in the surrogate, and then to where this led, or leave them where they are (Metropolis)."""
        at = self.at
        guess = foreseen = self.surrogate.cost(at)
        for _ in range(AHEAD):
            trial, way = self.moves.trial(at, self.random)
            inside = np.flatnonzero(np.all((trial >= self.lower) & (trial <= self.upper), axis=1))
            cost = np.full(len(at), np.inf)
            cost[inside] = self.surrogate.cost(trial[inside])
            taken = self._taken(self._gain(foreseen, cost) + way)
            at, foreseen = np.where(taken[:, None], trial, at), np.where(taken, cost, foreseen)
        cost = self.evaluated(at)
        taken = self._taken(self._gain(self.cost, cost) - self._gain(guess, foreseen))
        self.at, self.cost = np.where(taken[:, None], at, self.at), np.where(taken, cost, self.cost)
        self.path.append(np.column_stack((self.at, self.cost)))

    def _gain(self, before: Floats, after: Floats) -> Floats:
        """The gain (walkers,) of the logarithm of the density with sums of squares `after` instead of `before`."""
        return 0.5 * (_heavy(before, self.likelihood) - _heavy(after, self.likelihood))

    def _taken(self, gain: Floats) -> Flags:
        """Whether moves with this `gain` (walkers,) are taken; NaN is none."""
        return np.asarray(np.log(self.random.random(gain.size)) < np.where(np.isnan(gain), -np.inf, gain))


class _Evaluated:
    """Evaluates a `likelihood`, and keeps the latest points with their residuals."""

    def __init__(self, likelihood: Likelihood) -> None:
        self.likelihood = likelihood
        self.kept: list[tuple[Floats, Floats]] = []
        self.count = 0

    def __call__(self, at: Floats) -> Floats:
        """Sums of squares (k,) at coordinates (k, p), infinite if the tests cannot be simulated."""
        every: Cases = np.zeros(len(at), dtype=np.intp)
        residuals = self.likelihood.residuals(at, every)
        cost = costs(residuals)
        known = np.isfinite(cost)
        # far beyond what is plausible, only the direction matters
        share = np.minimum(1.0, FAR / np.sqrt(np.maximum(cost[known], 1e-300)))
        self.kept.append((at[known], share[:, None] * residuals[known]))
        self.count += int(np.sum(known))
        while sum(len(each) for each, _ in self.kept[1:]) >= MOST_KNOWN:
            del self.kept[0]
        return cost

    @property
    def points(self) -> tuple[Floats, Floats]:
        """Coordinates (m, p) and residuals (m, n) of the latest points."""
        at, residuals = (np.concatenate(parts)[-MOST_KNOWN:] for parts in zip(*self.kept, strict=True))
        return at, residuals


def _heavy(cost: Floats, likelihood: Likelihood) -> Floats:
    """Minus twice the logarithm of the density (k,), a Student's t because the scatter is estimated."""
    freedom = likelihood.common_freedom
    return np.asarray((freedom + likelihood.fit.coordinates.size) * np.log1p(cost / freedom))


def _starts(
    evaluated: _Evaluated, profiles: Sequence[Profile], strata: Strata | None, count: int, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Starts (count, p), those of strata in turns, with their sums of squares (count,): points of the profiles, by likelihood, or
    the centres of strata, with scatter from the covariance, and parameters without a variance anywhere along their profile or
    their stratum. Where the sum of squares would not be plausible, the scatter is halved, again and again, down to none.
    """
    likelihood = evaluated.likelihood
    fit = likelihood.fit
    bounds = fit.space.bounds
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    values, vectors = np.linalg.eigh(covariance)
    width = np.minimum(np.sqrt(np.maximum(values, 0.0)), WIDEST)
    if strata is None:
        lower, upper = (np.broadcast_to(bound, (count, bound.size)) for bound in bounds)
        centre = _points(likelihood, profiles, count, random)
    else:
        stratum = np.arange(count) % len(strata)
        lower, upper, centre = (part[stratum] for part in (strata.lower, strata.upper, strata.centre))
    scatter = (random.standard_normal((count, values.size)) * width) @ vectors.T
    for j in np.flatnonzero(~np.isfinite(likelihood.standard_error)).tolist():
        # nearly all likely places are along the profile, which the fit may be at the end of
        place = random.uniform(bounds[0][j], bounds[1][j], 20 * count)
        rise = _heavy(np.interp(place, profiles[j].coordinate, profiles[j].rise), likelihood)
        likely = place[random.random(place.size) < np.exp(-0.5 * rise)]
        scatter[:, j] = (np.resize(likely, count) if likely.size else fit.coordinates[j]) - centre[:, j]
    if strata is not None:
        scatter[:, strata.divided] = 0.0
        scatter += strata.spread(stratum, random)
    freedom, size = likelihood.common_freedom, fit.coordinates.size
    plausible = size * float(fdtri(size, freedom, PLAUSIBLE))
    if strata is None:
        centre[0], scatter[0] = fit.coordinates, 0.0  # the tests can be simulated there
    edge = 1e-9 * (bounds[1] - bounds[0])
    at, cost = np.clip(centre, lower + edge, upper - edge), np.full(count, np.inf)
    for halving in range(HALVINGS + 1):
        left = np.flatnonzero(cost > plausible)
        if left.size:
            share = 0.5**halving if halving < HALVINGS else 0.0
            at[left] = np.clip(centre[left] + share * scatter[left], (lower + edge)[left], (upper - edge)[left])
            cost[left] = evaluated(at[left])
    lost = ~np.isfinite(cost)
    if strata is None:
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
