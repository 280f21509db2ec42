"""Moves of an ensemble of walkers, made from positions that they had before; both kinds leave any density as it is (Metropolis).

Half of the moves are by differences between earlier positions (ter Braak and Vrugt 2008, DOI 10.1007/s11222-008-9104-9), often in
some of the parameters only (Vrugt et al. 2009, DOI 10.1515/IJNSNS.2009.10.3.273): parameters that tests determine and those that
they do not need steps of different length. Half of the differences are of the values of positive parameters instead of their
logarithms. The other half are to places that do not depend on the present one, drawn from a density estimate of the earlier
positions (Holden et al. 2009, DOI 10.1214/08-AAP545): steps cross a valley that is narrow and long only slowly.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.numerics.arrays import Flags, Floats

AFRESH = 0.5  # share of the moves to places that do not depend on the present one
FREEDOM = 5.0  # of the Student's distributions of the density estimate, whose tails are wider than those of the posterior
JUMP = 0.1  # share of the moves by differences that can jump between modes of the posterior
BY_VALUE = 0.5  # share of the differences that are of values instead of logarithms
MOVED = (0.3, 0.6, 1.0)  # probabilities that a parameter moves, one of them for each move
JITTER = 1e-6  # of the range


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """Moves from earlier positions `past` (m, p); `logarithm` (p,) are coordinates that are logarithms. `root` (p, p) is the root
    of the covariance about each position in the density estimate, and `scaled` (m, p) are the positions in its units.
    """

    past: Floats
    jitter: Floats
    logarithm: Flags
    root: Floats
    scaled: Floats

    @classmethod
    def of(cls, past: Floats, length: Floats, logarithm: Flags) -> Self:
        """Moves within ranges of this `length` (p,)."""
        count, size = past.shape
        jitter = JITTER * length
        # the width for a normal density (Silverman 1986, DOI 10.1201/9781315140919, Eq. 4.14)
        width = (4 / ((size + 2) * count)) ** (1 / (size + 4))
        root = width * np.linalg.cholesky(np.atleast_2d(np.cov(past.T)) + np.diag(np.square(jitter)))
        return cls(past, jitter, logarithm, root, np.linalg.solve(root, past.T).T)

    def trial(self, at: Floats, random: np.random.Generator) -> tuple[Floats, Floats]:
        """Trials (walkers, p) from positions `at`, NaN where a value would be negative; and the logarithm (walkers,) of the density
        of the move back over that of the move made.
        """
        return self._afresh(at, random) if random.random() < AFRESH else self._by_difference(at, random)

    def _afresh(self, at: Floats, random: np.random.Generator) -> tuple[Floats, Floats]:
        walkers, size = at.shape
        wide = np.sqrt(FREEDOM / random.chisquare(FREEDOM, walkers))
        step = (wide[:, None] * random.standard_normal((walkers, size))) @ self.root.T
        trial = self.past[random.integers(0, len(self.past), walkers)] + step
        return trial, self._density(at) - self._density(trial)

    def _density(self, at: Floats) -> Floats:
        """The logarithm (walkers,) of the density estimate, up to a constant."""
        places = np.linalg.solve(self.root, at.T).T
        squared = np.sum(np.square(places), axis=1)[:, None] + np.sum(np.square(self.scaled), axis=1) - 2 * places @ self.scaled.T
        near = -0.5 * (FREEDOM + at.shape[1]) * np.log1p(np.maximum(squared, 0.0) / FREEDOM)
        most = np.max(near, axis=1)
        return np.asarray(most + np.log(np.sum(np.exp(near - most[:, None]), axis=1)))

    def _by_difference(self, at: Floats, random: np.random.Generator) -> tuple[Floats, Floats]:
        past, (walkers, size) = self.past, at.shape
        one = random.integers(0, len(past), walkers)
        two = (one + random.integers(1, len(past), walkers)) % len(past)
        moved = random.random((walkers, size)) < random.choice(MOVED, walkers)[:, None]
        moved[np.arange(walkers), random.integers(0, size, walkers)] = True
        # 2.38/sqrt(2d) is the best factor for normal distributions in d dimensions; shorter moves follow curved ones
        length = 2.38 / np.sqrt(2 * np.sum(moved, axis=1)) * random.uniform(0.1, 1.2, walkers)
        length = np.where(random.random(walkers) < JUMP, 1.0, length)[:, None]
        step = length * (past[one] - past[two])
        step += self.jitter * random.standard_normal(step.shape)
        # values relative to the present ones; tests often see sums of moduli, which differences of values leave as they are
        rise = length * (np.exp(past[one] - at) - np.exp(past[two] - at))
        by_value = moved & self.logarithm & (random.random((walkers, 1)) < BY_VALUE)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.where(by_value, np.log1p(rise), step)
        volume = -np.sum(step, axis=1, where=by_value)
        return at + np.where(moved, step, 0.0), volume
