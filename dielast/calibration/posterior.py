"""Draws of the parameters from their posterior, by an ensemble of walkers that move in batches.

The prior is uniform in the coordinates within the bounds: a positive parameter that the tests do not determine is drawn
log-uniformly over its range. The walkers start from the profiles and the covariance of the fit, and move by differences of other
walkers (ter Braak 2006, DOI 10.1007/s11222-006-8769-1): each half of them moves by differences of the other half.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dielast.calibration.likelihood import Likelihood
from dielast.calibration.profiles import Profile
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.random_streams import stream

FEWEST_WALKERS, MOST_WALKERS = 40, 200
MOVES = 25  # moves of a walker between two of its draws
JUMP = 0.1  # share of the moves that can jump between modes of the posterior
JITTER = 1e-4  # of the range


def draw(
    likelihood: Likelihood,
    profiles: Sequence[Profile],
    count: int,
    *,
    seed: int = 1,
    watch: Callable[[int, int], None] | None = None,
) -> Floats:
    """Draws (count, p) of the coordinates; `watch` is called with the number of moves done and the total number."""
    fit = likelihood.fit
    random = stream(seed, "posterior")
    lower, upper = fit.space.bounds
    size = fit.coordinates.size
    walkers = 2 * (-(-max(FEWEST_WALKERS, 3 * size, min(count, MOST_WALKERS)) // 2))
    at = _opening(likelihood, profiles, walkers, random, lower, upper)
    every = np.zeros(walkers, dtype=np.intp)
    cost = _cost(likelihood, at, every)
    lost = ~np.isfinite(cost)
    at[lost], cost[lost] = fit.coordinates, 0.0
    rounds = -(-count // walkers)
    kept: list[Floats] = []
    for move in range(MOVES * rounds):
        for half in (np.arange(0, walkers, 2), np.arange(1, walkers, 2)):
            others = np.setdiff1d(np.arange(walkers), half)
            one = random.integers(0, others.size, half.size)
            two = (one + random.integers(1, others.size, half.size)) % others.size
            jump = random.random(half.size) < JUMP
            gain = np.where(jump, 1.0, 2.38 / np.sqrt(2 * size) * random.uniform(0.3, 1.2, half.size))
            step = gain[:, None] * (at[others[one]] - at[others[two]])
            step += JITTER * (upper - lower) * random.standard_normal(step.shape)
            trial = at[half] + step
            inside = np.all((trial >= lower) & (trial <= upper), axis=1)
            trial_cost = np.full(half.size, np.inf)
            if inside.any():
                trial_cost[inside] = _cost(likelihood, trial[inside], every[: int(inside.sum())])
            with np.errstate(over="ignore"):
                taken = random.random(half.size) < np.exp(
                    np.clip(0.5 * (_heavy(cost[half], likelihood) - _heavy(trial_cost, likelihood)), -700.0, 0.0)
                )
            taken &= np.isfinite(trial_cost)
            at[half[taken]], cost[half[taken]] = trial[taken], trial_cost[taken]
        if (move + 1) % MOVES == 0:
            kept.append(at.copy())
        if watch is not None:
            watch(move + 1, MOVES * rounds)
    return np.concatenate(kept)[:count]


def _cost(likelihood: Likelihood, at: Floats, fits: Cases) -> Floats:
    """Sums of squares (k,), infinite if the tests cannot be simulated."""
    residuals = likelihood.residuals(at, fits)
    cost = np.einsum("kn,kn->k", residuals, residuals)
    return np.where(np.isfinite(cost), cost, np.inf)


def _heavy(cost: Floats, likelihood: Likelihood) -> Floats:
    """Minus twice the logarithm of the density (k,), a Student's t because the scatter is estimated."""
    freedom = likelihood.common_freedom
    return np.asarray((freedom + likelihood.fit.coordinates.size) * np.log1p(cost / freedom))


def _opening(
    likelihood: Likelihood, profiles: Sequence[Profile], walkers: int, random: np.random.Generator, lower: Floats, upper: Floats
) -> Floats:
    """Starts of the walkers (walkers, p): points of the profiles, chosen by likelihood, with scatter from the covariance."""
    fit = likelihood.fit
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    values, vectors = np.linalg.eigh(covariance)
    scatter = random.standard_normal((walkers, values.size)) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    made = np.repeat(fit.coordinates[None], walkers, axis=0)
    for j, profile in enumerate(profiles):
        if np.isfinite(likelihood.standard_error[j]):
            continue
        # a parameter without a variance: anywhere along its profile, by likelihood
        place = random.uniform(lower[j], upper[j], 20 * walkers)
        rise = np.interp(place, profile.coordinate, profile.rise)
        likely = place[random.random(place.size) < np.exp(-0.5 * rise)]
        made[:, j] = np.resize(likely, walkers) if likely.size else fit.coordinates[j]
    return np.asarray(np.clip(made + scatter, lower + 1e-9 * (upper - lower), upper - 1e-9 * (upper - lower)))
