"""Vertical offsets and tilts of whole curves, as random effects with estimated spreads.

Differences between specimens or load cells, and a drift between two temperatures, shift a curve up or down. A systematic error of
the first or the last points of a test tilts it. Within one curve, neither differs from a shift factor; the curves together show
both, as they fail to superpose. The spreads are those of greatest restricted likelihood (H. D. Patterson and R. Thompson,
Biometrika 58 (1971) 545), by the update of S. N. Wood and M. Fasiolo, Biometrics 73 (2017) 1071. A few curves hardly determine a
spread, and the likeliest value is then often zero or far too large. A prior prevents both (Y. Chung et al., Psychometrika 78 (2013)
685, with the tail of A. Gelman, Bayesian Anal. 1 (2006) 515); where the curves have no information, the spread is that of usual
specimens.
"""

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Floats, Index

AVOID = 0.25  # exponent with which the prior rises from zero
LEAST = 1e-5  # decades; lower bound of a spread
PRIOR_SCALE = 0.334  # of a half-Cauchy distribution, over its root mean square if it ends at five times that, as OFFSET does
SPREAD_RATIO, SPREADS = 500.0, 16  # ratio of the largest to the smallest spread of its distribution, and their number
SETTLED = 0.02  # relative change of a spread at which the iteration ends


@dataclass(frozen=True, slots=True)
class Effect:
    """One kind of random effect: the `usual` spread (prior), the `first` to try and the `most` allowed, in decades of modulus."""

    usual: float
    first: float
    most: float


# Offsets of 12 % and more are not scatter of specimens, and curves tilted by more than 2 % from end to end do not superpose.
OFFSET = Effect(0.01, 0.01, 0.05)
TILT = Effect(0.005, 0.002, 0.01)


@dataclass(frozen=True, slots=True)
class LikelySpread:
    """The likeliest spread, the effective number of parameters of the effects, and their contribution to -2 ln likelihood."""

    spread: float
    counted: float
    evidence: float


def likeliest(
    effect: Effect, normal: Floats, right: Floats, spread: float, rounds: int, known: Floats | None = None
) -> LikelySpread:
    """The likeliest spread of effects (m,), by at most `rounds` iterations from `spread`.

    `normal` (m, m) and `right` (m,) are the normal equations of the effects without a prior. `known` (m, m) is a covariance that
    the effects have in addition to that of the spread.
    """
    likely, counted = spread, 0.0
    for _ in range(rounds):
        precision = precision_of(likely, normal.shape[0], known)
        covariance = np.linalg.inv(normal + precision)
        pulled = precision @ covariance @ right
        counted = float(np.sum(normal * covariance))
        observed = float(pulled @ pulled) + AVOID / likely**2
        expected = float(np.trace(precision - precision @ covariance @ precision)) + 2 / (effect.usual**2 + likely**2)
        updated = min(max(likely * float(np.sqrt(np.clip(observed / expected, 0.01, 100.0))), LEAST), effect.most)
        settled, likely = abs(updated - likely) <= SETTLED * likely, updated
        if settled:
            break
    precision, effects, volume = _at_spread(normal, right, likely, known)
    prior = _tail(likely, effect.usual) - 2 * AVOID * float(np.log(likely / effect.usual))
    return LikelySpread(likely, counted, float(effects @ precision @ effects) + volume + prior)


def probable(effect: Effect, normal: Floats, right: Floats, known: Floats | None = None) -> tuple[Floats, Floats]:
    """Spreads (s,) and their probabilities (s,), from the restricted likelihood and a prior; arguments as in `likeliest`.

    An average does not have to avoid zero. Without information from the curves, its root mean square is about the usual spread.
    """
    spreads = np.geomspace(effect.most / SPREAD_RATIO, effect.most, SPREADS)
    cost = np.empty(SPREADS)
    for k, spread in enumerate(spreads.tolist()):
        _, effects, volume = _at_spread(normal, right, spread, known)
        cost[k] = volume - right @ effects + _tail(spread, PRIOR_SCALE * effect.usual)
    likelihood = np.exp((np.min(cost) - cost) / 2) * spreads  # they are even in the logarithm
    return spreads, likelihood / np.sum(likelihood)


def _at_spread(normal: Floats, right: Floats, spread: float, known: Floats | None) -> tuple[Floats, Floats, float]:
    """The precision (m, m) of effects of this spread, the effects (m,), and the log of the volume that the data leave them."""
    precision = precision_of(spread, normal.shape[0], known)
    effects = np.asarray(np.linalg.solve(normal + precision, right), dtype=float)
    return precision, effects, float(np.linalg.slogdet(normal + precision)[1] - np.linalg.slogdet(precision)[1])


def _tail(spread: float, scale: float) -> float:
    """-2 ln of a half-Cauchy distribution of the spread."""
    return float(2 * np.log1p((spread / scale) ** 2))


def precision_of(spread: float, curves: int, known: Floats | None = None) -> Floats:
    """Inverse of the covariance (m, m) of effects with this spread, in addition to the covariance `known`."""
    independent = np.eye(curves) * max(spread, LEAST) ** 2
    return np.asarray(np.linalg.inv(independent if known is None else independent + known))


def walk(order: Index, step: float) -> Floats:
    """Covariance (m, m) of a random walk with standard deviation `step` from one curve to the next; the first has one step from 0.

    `order` (m,) lists the curves in the order of the walk.
    """
    place = np.empty(order.size)
    place[order] = np.arange(1, order.size + 1)
    return step**2 * np.minimum(place[:, None], place)
