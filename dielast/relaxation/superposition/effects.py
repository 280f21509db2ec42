"""Vertical offsets and tilts of whole curves, as random effects with estimated spreads.

Differences between specimens or load cells, and a drift between two temperatures, shift a curve up or down. A systematic error of
the first or the last points of a test tilts it. Within one curve, neither differs from a shift factor; the curves together show
both, as they fail to superpose. The spreads are those of greatest restricted likelihood (H. D. Patterson and R. Thompson,
Biometrika 58 (1971) 545), by the update of S. N. Wood and M. Fasiolo, Biometrics 73 (2017) 1071. A few curves hardly determine a
spread, and the likeliest value is then often zero or far too large. A prior prevents both (Y. Chung et al., Psychometrika 78 (2013)
685, with the tail of A. Gelman, Bayesian Anal. 1 (2006) 515); where the curves have no information, the spread is that of usual
specimens.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dielast.numerics.arrays import Floats, Index

AVOID = 0.25  # exponent with which the prior rises from zero: a choice
LEAST = 1e-5  # decades; lower bound of a spread
SPREAD_RATIO = 500.0  # ratio of the largest to the smallest spread of its distribution
SETTLED = 0.02  # relative change of a spread at which the iteration ends
NONE = 0.5  # probability, before any data, that there are no effects: a choice
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
class RandomEffect:
    """Effects of one `kind` on m curves: independent, with a `spread` in decades, plus effects of covariance `known` (m, m)."""

    kind: Effect
    spread: float
    known: Floats | None = None

    def precision(self, curves: int) -> Floats:
        """Inverse of the covariance (m, m) of the effects on so many `curves`."""
        spread = max(self.spread, LEAST)
        if self.known is None:
            return np.eye(curves) / spread**2
        return np.asarray(np.linalg.inv(np.eye(curves) * spread**2 + self.known), dtype=float)


@dataclass(frozen=True, slots=True)
class LikelySpreads:
    """Effects of the likeliest spreads, their effective number of parameters, and their contribution to -2 ln likelihood."""

    effects: tuple[RandomEffect, ...]
    counted: float
    evidence: float


def likeliest(effects: Sequence[RandomEffect], normal: Floats, right: Floats, rounds: int) -> LikelySpreads:
    """The effects with the likeliest spreads, by at most `rounds` iterations from those of the g kinds of `effects` (g m,).

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
    prior = sum(_tail(each.spread, each.kind.usual) - 2 * AVOID * float(np.log(each.spread / each.kind.usual)) for each in effects)
    return LikelySpreads(effects, float(np.sum(normal * covariance)), float(values @ precision @ values + volume) + prior)


def _updated(effect: RandomEffect, pulled: float, trace: float) -> float:
    """The next spread, from sums over the curves of squares and of expected squares of precision times effects."""
    spread, kind = effect.spread, effect.kind
    observed, expected = pulled + AVOID / spread**2, trace + 2 / (kind.usual**2 + spread**2)
    return min(max(spread * float(np.sqrt(np.clip(observed / expected, 0.01, 100.0))), LEAST), kind.most)


def probable(effects: Sequence[RandomEffect], normal: Floats, right: Floats) -> tuple[Floats, Floats, Floats]:
    """Spreads (s, g) of the g kinds of `effects`, their probabilities (s,), and precisions (s, g m, g m) of the effects.

    The probabilities are those of the restricted likelihood and a prior; arguments as in `likeliest`. Before any data, there are no
    effects (the spread is `LEAST`) with the probability `NONE`; else the density of the spread rises from zero, as most specimens
    and instruments differ by about the usual spread if they differ at all, and falls with the square of a large spread.
    """
    m = right.size // len(effects)
    tried = [[LEAST, *np.geomspace(each.kind.most / SPREAD_RATIO, each.kind.most, each.kind.nodes).tolist()] for each in effects]
    inverses = [
        np.array([replace(each, spread=spread).precision(m) for spread in spreads])
        for each, spreads in zip(effects, tried, strict=True)
    ]
    places = np.array(list(product(*(range(len(spreads)) for spreads in tried))))
    precision = np.zeros((len(places), right.size, right.size))
    cost = np.zeros(len(places))
    for g, (each, spreads, inverse) in enumerate(zip(effects, tried, inverses, strict=True)):
        block = slice(g * m, (g + 1) * m)
        precision[:, block, block] = inverse[places[:, g]]
        size = np.array(spreads[1:])
        shares = size**2 / (1 + (size / each.kind.usual) ** 2) ** 1.5  # they are even in the logarithm
        prior = np.concatenate(([NONE], (1 - NONE) * shares / np.sum(shares)))
        cost -= (2 * np.log(prior) + np.linalg.slogdet(inverse)[1])[places[:, g]]
    total = normal + precision
    cost += (
        np.linalg.slogdet(total)[1]
        - np.linalg.solve(total, np.broadcast_to(right, cost.shape + right.shape)[..., None])[..., 0] @ right
    )
    likelihood = np.exp((np.min(cost) - cost) / 2)
    probability = likelihood / np.sum(likelihood)
    order = np.argsort(-probability, kind="stable")
    kept = np.sort(order[: 1 + int(np.searchsorted(np.cumsum(probability[order]), 1 - REMOTE))])
    chosen = np.array([[tried[g][k] for g, k in enumerate(place)] for place in places[kept].tolist()])
    return chosen, probability[kept] / np.sum(probability[kept]), precision[kept]


def joint_precision(effects: Sequence[RandomEffect], curves: int) -> Floats:
    """The precision (g m, g m) of the g kinds of `effects` on m curves, one kind after another."""
    joint = np.zeros((len(effects) * curves,) * 2)
    for g, each in enumerate(effects):
        block = slice(g * curves, (g + 1) * curves)
        joint[block, block] = each.precision(curves)
    return joint


def _tail(spread: float, scale: float) -> float:
    """-2 ln of a half-Cauchy distribution of the spread."""
    return float(2 * np.log1p((spread / scale) ** 2))


def walk(order: Index, step: float) -> Floats:
    """Covariance (m, m) of a random walk with standard deviation `step` from one curve to the next; the first has one step from 0.

    `order` (m,) lists the curves in the order of the walk.
    """
    place = np.empty(order.size)
    place[order] = np.arange(1, order.size + 1)
    return step**2 * np.minimum(place[:, None], place)
