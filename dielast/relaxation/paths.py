"""Random paths of the spectrum H(ln tau) about the end of a curve, and how well each of them follows the curve.

The slope d ln H/d ln tau begins at random where a path begins, changes by normal steps at each point, and falls at some points by
gamma distributed steps: small ones, so that a power law goes on, or large ones, which cut it off. A share of the fall is even, as
that of a log-normal spectrum is. Every path is cut off by exp(-(tau/tau_c)^p), at an unknown time, maybe before or long after the
end of the curve: so ends the spectrum of a stretched exponential of exponent b, with p = b/(1 - b) (M. N. Berberan-Santos, E. N.
Bodunov, B. Valeur, Chem. Phys. 315 (2005) 171). Some paths end with the curve. The numbers of this prior are choices. They are not
derived, and no measurement determines them; their effect is the width of the range that follows from a curve.
"""

from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np

from dielast.numerics.arrays import Floats
from dielast.numerics.random_streams import stream
from dielast.relaxation.nnls import WeightedCurve

SEED = 1
FASTER, SLOWER = 2.0, 4.0  # decades of relaxation times before and after the end of the curve
PER_DECADE, BRANCHES_PER_DECADE = 6, 3  # points of a path, and branches after the end
PATHS = 2**14
FIRST_SLOPE = (-0.3, 1.0)  # mean and standard deviation of d ln H/d ln tau where a path begins
# A choice: about two falls of the slope in three decades, of a mean size between 0.1, a bend, and 10, after which H
# falls by ten decades in one; the logarithm of this size is even.
FALLS, DROP = 0.3, (0.1, 10.0)
# Choices: log10 of tau_c over the end of the curve, even, and p, even in the logarithm: of stretched exponentials of exponents from
# 1/6 to 2/3.
CUT, POWER = (-4.0, 4.0), (0.2, 2.0)
# Share of paths that end with the curve, a choice: some times the share that an interval leaves beyond either of its ends. Such a
# material is at the border of what the curve allows, where an interval of paths that all go on does not reach. A larger share makes
# moduli far below the end of the curve less likely.
ENDING = 0.2
WANDERS = 0.2  # standard deviation of the change of the slope per square root of a unit of ln tau
# Paths that must count, a choice: for the Monte Carlo error of a bound. A curve more exact than the paths are dense counts less.
ENOUGH = 200.0
GUIDES, GUIDED, LEAST_POWER = 2**11, 0.5, 0.01  # paths led to a curve, and by which power of the likelihood; the least such power
CHANGES, ROUNDS = (0.1, 0.2, 0.4), 3  # shares by which the steps of a path change at random, and how often


# First slope, mean fall, wandering, falls, a pair for end and evenness, and one for the cut-off, each (paths, ...).
Steps = tuple[Floats, ...]


def _steps(count: int, generator: np.random.Generator) -> Steps:
    """Random steps of `count` paths, in standard form."""
    later = (count, round((FASTER + SLOWER) * PER_DECADE) - 1)
    first, drop = generator.standard_normal((count, 1)), generator.uniform(size=(count, 1))
    falls = generator.standard_gamma(FALLS * np.log(10) / PER_DECADE, later)
    wander, (kind, cut) = generator.standard_normal(later), generator.uniform(size=(2, count, 2))
    return first, drop, wander, falls, kind, cut


def _paths(steps: Steps) -> tuple[Floats, Floats]:
    """ln tau over the end of the curve (m,), and H times its spacing on each path (paths, m), 1 per unit of ln tau at the end."""
    first, drop, wander, fall, kind, cut = steps
    on, even, power = kind[:, :1], kind[:, 1:], POWER[0] * (POWER[1] / POWER[0]) ** cut[:, 1:]
    step, at_end = np.log(10) / PER_DECADE, round(FASTER * PER_DECADE)
    mean_fall = np.exp(np.log(DROP[0]) + drop * np.log(DROP[1] / DROP[0]))
    change = WANDERS * np.sqrt(step) * wander - mean_fall * (even * FALLS * step + (1 - even) * fall)
    slope = np.cumsum(np.hstack([FIRST_SLOPE[0] + FIRST_SLOPE[1] * first, change]), axis=1)
    height = np.hstack([np.zeros_like(first), np.cumsum(slope * step, axis=1)])
    u = step * (np.arange(height.shape[1]) - at_end)
    height -= np.exp(power * (u - np.log(10) * (CUT[0] + (CUT[1] - CUT[0]) * cut[:, :1])))
    height -= height[:, [at_end]]
    density = np.exp(np.clip(height, -60.0, 40.0))
    return u, step * np.where((u > 0) & (on < ENDING), 0.0, density)


@cache
def unguided_paths() -> tuple[Steps, Floats, Floats]:
    """The steps of paths that no curve has guided, and what `_paths` makes of them."""
    steps = _steps(PATHS, stream(SEED, "spectra beyond the curve"))
    return steps, *_paths(steps)


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """How well paths follow the end of a curve: for each path, the normal likelihood of size and equilibrium modulus, cut off at 0.

    Means in terms of the modulus at the end; `square` is the sum of squares at the means and `allowed` that where neither is below
    0; a, b, c, d, e are the sums of the normal equations and n that of the weights.
    """

    mean_level: Floats
    mean_size: Floats
    square: Floats
    allowed: Floats
    a: float
    b: Floats
    c: Floats
    d: float
    det: Floats
    n: float

    @classmethod
    def of(cls, cells: WeightedCurve, end: float, u: Floats, paths: Floats) -> Self:
        """The `paths` (paths, m) at ln tau `u` (m,) from the `end` in s of the curve of `cells`."""
        # the average of k points is k times as certain; how certain that is, their scatter about the paths decides, cell by cell
        time, values, weight = cells.time, cells.values[0], cells.weight / cells.weight.mean()
        level, falling = values[-1] / values, (paths @ np.exp(-np.exp(np.log(time / end)[:, None] - u)).T) * values[-1] / values
        a, b, c = float(weight @ level**2), falling @ (weight * level), falling**2 @ weight
        d, e, n = float(weight @ level), falling @ weight, float(weight.sum())
        c = np.maximum(c, 1e-300)
        det = a * c * np.maximum(1 - b**2 / (a * c), 1e-12)
        mean_level, mean_size = (c * d - b * e) / det, (a * e - b * d) / det
        square = n - mean_level * d - mean_size * e
        bounded = np.minimum(n - np.maximum(e, 0) ** 2 / c, n - d**2 / a)
        allowed = np.where((mean_level >= 0) & (mean_size >= 0), square, bounded)
        return cls(mean_level, mean_size, square, allowed, a, b, c, d, det, n)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the noise."""
        return max(self.n - 3, 1.0)

    @property
    def least(self) -> float:
        """The sum of squares of the path that follows the curve best."""
        return max(float(self.allowed.min()), 1e-12)

    def spread(self, least: float) -> tuple[Floats, Floats]:
        """Standard deviations of equilibrium modulus and size where the least sum of squares is all noise."""
        noise = np.sqrt(least / self.freedom)
        return noise * np.sqrt(self.c / self.det), noise * np.sqrt(self.a / self.det)

    def evidence(self, least: float, power: float = 1.0) -> Floats:
        """ln of the likelihood to a `power`, integrated over size and equilibrium modulus, up to a constant, and over the noise."""
        from scipy.special import log_ndtr

        sigma_level, sigma_size = self.spread(least)
        inside = log_ndtr(self.mean_level / sigma_level) + log_ndtr(self.mean_size / sigma_size) - 0.5 * np.log(self.det)
        return np.asarray(inside - power * 0.5 * self.freedom * np.log(np.maximum(self.square, least) / least))


def effective(logarithm: Floats) -> float:
    """Number of paths that count where these are the logarithms of their weights."""
    share = np.exp(logarithm - np.max(logarithm))
    return float(share.sum() ** 2 / (share @ share))


def guided_paths(cells: WeightedCurve, end: float, generator: np.random.Generator) -> tuple[Floats, Floats]:
    """Paths (paths, m) and the logarithms (paths,) of the weights that make them paths that no curve has guided.

    Where few of those follow the curve, they are led to it by sequential Monte Carlo (P. Del Moral, A. Doucet, A. Jasra, J. R.
    Stat. Soc. B 68 (2006) 411): the likelihood comes in by and by, and paths move by random changes of their steps that leave their
    distribution as it is (preconditioned Crank-Nicolson, S. L. Cotter et al., Stat. Sci. 28 (2013) 424).
    """
    steps, u, paths = unguided_paths()
    follow = Following.of(cells, end, u, paths)
    least, power = follow.least, 0.0
    if effective(follow.evidence(least)) >= ENOUGH:
        return paths, np.zeros(len(paths))
    target, constant = np.zeros(len(paths)), 0.0
    while power < GUIDED:
        least, before = min(least, follow.least), power
        power = GUIDED
        while power - before > LEAST_POWER and effective(follow.evidence(least, power) - target) < min(len(target), GUIDES) / 4:
            power = before + (power - before) / 1.5
        gain = follow.evidence(least, power) - target
        share = np.exp(gain - gain.max())
        constant += float(gain.max() + np.log(share.mean()))
        kept = generator.choice(share.size, size=GUIDES, p=share / share.sum())
        steps = tuple(each[kept] for each in steps)
        follow = Following.of(cells, end, u, _paths(steps)[1])
        target = follow.evidence(least, power)
        for change in np.tile(CHANGES, ROUNDS):
            fresh, share = _steps(GUIDES, generator), np.sqrt(1 - change**2)
            other = [generator.random(each.shape) < change / 2 for each in steps]
            trial = (
                share * steps[0] + change * fresh[0],
                np.where(other[1], fresh[1], steps[1]),
                share * steps[2] + change * fresh[2],
                *(np.where(each, new, old) for each, new, old in zip(other[3:], fresh[3:], steps[3:], strict=True)),
            )
            moved = Following.of(cells, end, u, _paths(trial)[1])
            reached = moved.evidence(least, power)
            accepted = np.log(generator.random(GUIDES)) < reached - target
            target = np.where(accepted, reached, target)
            steps = tuple(np.where(accepted[:, None], new, each) for new, each in zip(trial, steps, strict=True))
        paths = _paths(steps)[1]
        follow = Following.of(cells, end, u, paths)
    return paths, constant - target
