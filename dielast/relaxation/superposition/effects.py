"""Vertical offsets and tilts of whole curves, as random effects with estimated spreads.

Differences between specimens or load cells, and a drift between two temperatures, shift a curve up or down. A systematic error of
the first or the last points of a test tilts it. Within one curve, neither differs from a shift factor; the curves together show
both, as they fail to superpose. The spreads are those of greatest restricted likelihood (H. D. Patterson and R. Thompson,
Biometrika 58 (1971) 545), by the update of S. N. Wood and M. Fasiolo, Biometrics 73 (2017) 1071. A few curves hardly determine a
spread, and the likeliest value is then often zero or far too large. A prior prevents both (Y. Chung et al., Psychometrika 78 (2013)
685, with the tail of A. Gelman, Bayesian Anal. 1 (2006) 515); where the curves have no information, the spread is that of usual
specimens.

Offsets are independent, as those of one specimen for each temperature are, or a drift of one specimen, a random walk in the order
of the tests. What is added up over many steps looks like shift factors of another law. So where no drift is stated, standard errors
are those of both kinds of offsets, by their probability; as the order is not stated then either, it is that of the temperatures.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np

from dielast.numerics.arrays import Floats, Index

AVOID = 0.25  # exponent with which the prior rises from zero: a choice
LEAST = 1e-5  # decades; lower bound of a spread
SPREAD_RATIO = 500.0  # ratio of the largest to the smallest spread of its distribution
SETTLED = 0.02  # relative change of a spread at which the iteration ends
NONE = 0.5  # probability, before any data, that there are no effects: a choice
DRIFTS = 0.5  # probability, before any data, that offsets are a drift, if there are any: a choice
STEPS, STEP_RATIO = 8, 50.0  # number of the steps of a drift that are tried, and ratio of the largest to the smallest
REMOTE = 1e-3  # probability of the least probable spreads that are left out together


@dataclass(frozen=True, slots=True)
class Effect:
    """One kind of random effect: its `block` among the parameters (0: shifts), the `usual` spread (prior), the `first` to try and
    the `most` allowed, in decades of modulus, and the number of `nodes` of its distribution.
    """

    block: int
    usual: float
    first: float
    most: float
    nodes: int


# Choices: usual spreads of offsets (2.3 %) and tilts (1.2 %), and the largest. A scatter of offsets of more than 12 % is not one of
# specimens, and curves whose tilts scatter by more than 2.3 % from end to end do not superpose.
OFFSET = Effect(1, 0.01, 0.01, 0.05, 12)
TILT = Effect(2, 0.005, 0.002, 0.01, 6)


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """A drift from one test to the next: `walk` (m, m) is the covariance of the offsets for steps of standard deviation 1, and
    `step` the stated standard deviation in decades; 0 if none is stated.
    """

    walk: Floats
    step: float

    @classmethod
    def of(cls, order: Index, step: float) -> Self:
        """A random walk over curves in this `order` (m,), the first of which has one step from 0."""
        place = np.empty(order.size)
        place[order] = np.arange(1, order.size + 1)
        return cls(np.minimum(place[:, None], place), step)

    def among(self, curves: Index) -> Self:
        """The drift of the numbered `curves` alone."""
        return replace(self, walk=self.walk[np.ix_(curves, curves)])


@dataclass(frozen=True, slots=True, eq=False)
class RandomEffect:
    """Effects of one `kind` on m curves: independent, with a `spread` in decades, plus a `drift`, if one is stated."""

    kind: Effect
    spread: float
    drift: Drift | None = None

    def precision(self, curves: int) -> Floats:
        """Inverse of the covariance (m, m) of the effects on so many `curves`."""
        spread = max(self.spread, LEAST)
        if self.drift is None or not self.drift.step:
            return np.eye(curves) / spread**2
        return _precision(spread, self.drift, self.drift.step)

    def probable(self, curves: int) -> tuple[Floats, Floats]:
        """Precisions (s, m, m) of the effects for spreads from `LEAST` on, and of a drift that is not stated; their probability
        before any data (s,).
        """
        kind, drift = self.kind, self.drift if self.drift is not None and not self.drift.step else None
        spreads = np.geomspace(kind.most / SPREAD_RATIO, kind.most, kind.nodes)
        some = (1 - NONE) * _prior(spreads, kind.usual)
        precisions = [replace(self, spread=spread).precision(curves) for spread in (LEAST, *spreads.tolist())]
        if drift is None:
            return np.array(precisions), np.concatenate(([NONE], some))
        steps = np.geomspace(kind.most / STEP_RATIO, kind.most, STEPS)
        precisions += [_precision(LEAST, drift, step) for step in steps.tolist()]
        walked = (1 - NONE) * DRIFTS * _prior(steps, kind.usual)
        return np.array(precisions), np.concatenate(([NONE], (1 - DRIFTS) * some, walked))


def _prior(size: Floats, usual: float) -> Floats:
    """Probability (k,) of spreads that are even in the logarithm."""
    share = size**2 / (1 + (size / usual) ** 2) ** 1.5
    return np.asarray(share / np.sum(share))


def _precision(spread: float, drift: Drift, step: float) -> Floats:
    """Inverse of the covariance (m, m) of independent effects and of a drift."""
    return np.asarray(np.linalg.inv(np.eye(len(drift.walk)) * spread**2 + step**2 * drift.walk), dtype=float)


def likeliest(
    effects: Sequence[RandomEffect], normal: Floats, right: Floats, rounds: int
) -> tuple[tuple[RandomEffect, ...], float, float]:
    """The effects with the likeliest spreads, by at most `rounds` iterations from those of the g kinds of `effects` (g m,), their
    effective number of parameters, and their contribution to -2 ln likelihood.

    `normal` (g m, g m) and `right` (g m,) are the normal equations of the effects without a prior.
    """
    m, effects = right.size // len(effects), tuple(effects)
    for _ in range(rounds):
        precision = joint_precision(effects, m)
        covariance = np.linalg.inv(normal + precision)
        pulled = (precision @ covariance @ right).reshape(-1, m)
        expected = np.diag(precision - precision @ covariance @ precision).reshape(-1, m).sum(axis=1)
        old = effects
        effects = tuple(
            replace(each, spread=_updated(each, float(pull @ pull), float(trace)))
            for each, pull, trace in zip(old, pulled, expected, strict=True)
        )
        if all(abs(new.spread - each.spread) <= SETTLED * each.spread for new, each in zip(effects, old, strict=True)):
            break
    precision = joint_precision(effects, m)
    covariance = np.linalg.inv(normal + precision)
    values, volume = covariance @ right, np.linalg.slogdet(normal + precision)[1] - np.linalg.slogdet(precision)[1]
    # -2 ln of the prior: a half-Cauchy distribution, times a power that rises from zero
    ratio = np.array([each.spread / each.kind.usual for each in effects])
    prior = float(np.sum(2 * np.log1p(ratio**2) - 2 * AVOID * np.log(ratio)))
    return effects, float(np.sum(normal * covariance)), float(values @ precision @ values + volume) + prior


def _updated(effect: RandomEffect, pulled: float, trace: float) -> float:
    """The next spread, from sums over the curves of squares and of expected squares of precision times effects."""
    spread, kind = effect.spread, effect.kind
    observed, expected = pulled + AVOID / spread**2, trace + 2 / (kind.usual**2 + spread**2)
    return min(max(spread * float(np.sqrt(np.clip(observed / expected, 0.01, 100.0))), LEAST), kind.most)


def probable(effects: Sequence[RandomEffect], normal: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Probabilities (s,) of all probable spreads of the g kinds of `effects`, and precisions (s, g m, g m) of the effects.

    The probabilities are those of the restricted likelihood and a prior; arguments as in `likeliest`. Before any data, there are no
    effects (the spread is `LEAST`) with the probability `NONE`; else the density of the spread rises from zero, as most specimens
    and instruments differ by about the usual spread if they differ at all, and falls with the square of a large spread.
    """
    m = right.size // len(effects)
    tried = [each.probable(m) for each in effects]
    places = np.array(list(product(*(range(prior.size) for _, prior in tried))))
    precision = np.zeros((len(places), right.size, right.size))
    cost = np.zeros(len(places))
    for g, (inverse, prior) in enumerate(tried):
        block = slice(g * m, (g + 1) * m)
        precision[:, block, block] = inverse[places[:, g]]
        cost -= (2 * np.log(prior) + np.linalg.slogdet(inverse)[1])[places[:, g]]
    bordered = np.empty((len(places), right.size + 1, right.size + 1))  # the last row of its factor is that of the right-hand side
    # of curves without noise, rounding errors of the first may exceed the second (N. J. Higham, Accuracy and stability of numerical
    # algorithms, 2nd ed., Philadelphia 2002, theorem 10.7)
    rounding = right.size * float(np.finfo(float).eps) * float(np.trace(normal))
    bordered[:, :-1, :-1] = normal + precision + rounding * np.eye(right.size)
    bordered[:, :-1, -1] = bordered[:, -1, :-1] = right
    bordered[:, -1, -1] = 1e300
    factor = np.linalg.cholesky(bordered)
    cost += 2 * np.sum(np.log(np.diagonal(factor, axis1=1, axis2=2)[:, :-1]), axis=1) - np.sum(factor[:, -1, :-1] ** 2, axis=1)
    likelihood = np.exp((np.min(cost) - cost) / 2)
    probability = likelihood / np.sum(likelihood)
    order = np.argsort(-probability, kind="stable")
    kept = np.sort(order[: 1 + int(np.searchsorted(np.cumsum(probability[order]), 1 - REMOTE))])
    return probability[kept] / np.sum(probability[kept]), precision[kept]


def joint_precision(effects: Sequence[RandomEffect], curves: int) -> Floats:
    """The precision (g m, g m) of the g kinds of `effects` on m curves, one kind after another."""
    joint = np.zeros((len(effects) * curves,) * 2)
    for g, each in enumerate(effects):
        block = slice(g * curves, (g + 1) * curves)
        joint[block, block] = each.precision(curves)
    return joint
