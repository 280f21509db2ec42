"""The joint fit: one smooth curve of log modulus over log reduced time, and all shift factors with it.

The smooth curve is a cubic B-spline on even knots; a frequency sweep has two channels, with a curve each, that share the shifts.
For given shifts the coefficients are a linear problem, so they are projected out (variable projection in Kaufman's form, DOI
10.1007/BF01932995), and a Gauss-Newton iteration moves the shifts alone.

Real specimens and load cells differ by a few percent, which slides a whole curve up or down and would pull its shift factor
along. If the curves differ vertically by more than their noise, these offsets are therefore estimated too, as random effects of
unknown spread.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.misfit import PARTS, Misfit, find_misfit
from dielast.characterise.robust import Weights, channel_shares, even_weights, noise_shares, robust_weights
from dielast.characterise.spline import Spline, gram, roughness, spline_basis

Array = NDArray[np.float64]
Index = NDArray[np.intp]

LOOSE = 30.0**-2  # precision (1/decade^2) of the prior that keeps the normal matrix regular where the data say nothing
MAX_STEP = 0.5  # decades a shift may move in one iteration
CONVERGED = 0.01  # standard errors
ITERATIONS = 40
EXPECTATIONS = 4
JACKKNIFE_STEPS = 3
AMBIGUOUS = 0.1  # decades by which the shifts may depend on the part of the curves they are read from
NEGLIGIBLE = 1e-3  # decades of modulus: offsets of 0.2 % are below what a spline on few points can tell


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Points (n,) of `curves` curves, sorted by channel, curve and time; `variance` is the measured variance of `log_modulus`.

    Every channel has a smooth curve of its own, and a vertical shift log10 b moves its points by `lift` (n,) times as much.
    """

    curve: Index
    log_time: Array
    log_modulus: Array
    variance: Array
    curves: int
    channel: Index
    lift: Array
    channels: int = 1

    @property
    def series(self) -> Index:
        """The curve of one channel that each point belongs to."""
        return self.channel * self.curves + self.curve if self.channels > 1 else self.curve


@dataclass(frozen=True, slots=True, eq=False)
class MasterFit:
    """log10 a (m,) relative to the anchor, log10 b (m,), their covariance (2m, 2m), the smooth curves and the residuals (n,).

    `noise_stderr` (m,) is the part of the shifts' standard errors that noise alone makes. `offset_spread` is the standard
    deviation, in decades of modulus, of the vertical offsets that were allowed for but not applied; `misfit` is what is missed
    beyond both.
    """

    shift: Array
    vertical: Array
    covariance: Array
    noise_stderr: Array
    splines: tuple[Spline, ...]
    residual: Array
    offset_spread: float
    misfit: Misfit


@dataclass(frozen=True, slots=True, eq=False)
class _Prior:
    """Mean and precision of all shifts (m,) followed by all vertical shifts (m,), and the positions of those that are free."""

    mean: Array
    precision: Array
    free: Index


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """The best splines for given shifts `theta` (2m,); cost, gradient and normal matrix over the free ones; the weights used."""

    theta: Array
    splines: tuple[Spline, ...]
    residual: Array
    cost: float
    gradient: Array
    normal: Array
    weights: Weights

    @property
    def parameters(self) -> int:
        return sum(spline.coefficient.size for spline in self.splines) + self.gradient.size

    @property
    def spacing(self) -> float:
        return self.splines[0].spacing


def fit_master(points: Points, start: Array, anchor: int, vertical: bool) -> MasterFit:
    """Fit the smooth curve and all shifts together, from the starting values `start` (m,); the curve numbered `anchor` stays put.

    With `vertical`, the curves slide along the modulus too. Knots grow denser until Akaike's criterion no longer gains.
    """
    m = points.curves
    theta = np.concatenate((start, np.zeros(m)))
    movable = np.delete(np.arange(2 * m), [anchor, m + anchor])
    prior = _Prior(theta, np.full(2 * m, LOOSE), movable if vertical else movable[: m - 1])
    state = _fit(points, theta, prior)
    spread = 0.0
    if not vertical and np.any(points.lift):
        everything = _Prior(theta, prior.precision, movable)
        spread = _offset_spread(points, state, everything, anchor)
        if spread > NEGLIGIBLE:
            state, prior, spread = _fit_offsets(points, state, theta, spread, anchor)
    misfit = find_misfit(points.series, points.curve, points.log_time, state.residual)
    covariance = np.zeros((2 * m, 2 * m))
    covariance[np.ix_(prior.free, prior.free)] = np.linalg.inv(state.normal) * _correlation(points, state)
    noise_stderr = np.sqrt(np.diag(covariance)[:m])
    if misfit.sure:
        ambiguity = _jackknife(points, prior, state, misfit.part)
        covariance += ambiguity
        misfit = replace(misfit, matters=misfit.matters or bool(np.max(np.diag(ambiguity)[:m]) > AMBIGUOUS**2))
    offset = state.theta[m:]
    if vertical:
        return MasterFit(state.theta[:m], offset, covariance, noise_stderr, state.splines, state.residual, 0.0, misfit)
    covariance[m:, :] = covariance[:, m:] = 0.0
    residual = state.residual - points.lift * offset[points.curve]
    return MasterFit(state.theta[:m], np.zeros(m), covariance, noise_stderr, state.splines, residual, spread, misfit)


def fit_held(points: Points, shifts: MasterFit, anchor: int, vertical: bool) -> MasterFit:
    """Fit smooth curves, and with `vertical` vertical shifts, to `points`, their shifts those of another fit `shifts`."""
    m = points.curves
    theta = np.concatenate((shifts.shift, shifts.vertical))
    movable = np.delete(np.arange(2 * m), [anchor, m + anchor])
    prior = _Prior(theta, np.full(2 * m, LOOSE), movable[m - 1 :] if vertical else movable[:0])
    state = _fit(points, theta, prior)
    covariance = shifts.covariance.copy()
    if vertical:
        own = np.linalg.inv(state.normal) * _correlation(points, state)
        joint = _assemble(points, state.theta, replace(prior, free=movable), state.weights, state.spacing).normal
        response = np.zeros((m, m))
        across, down = movable[: m - 1], movable[m - 1 :] - m
        response[np.ix_(down, across)] = -np.linalg.solve(joint[m - 1 :, m - 1 :], joint[m - 1 :, : m - 1])
        covariance[m:, :m] = response @ covariance[:m, :m]
        covariance[:m, m:] = covariance[m:, :m].T
        covariance[m:, m:] = covariance[m:, :m] @ response.T
        covariance[np.ix_(m + down, m + down)] += own
    return replace(shifts, vertical=state.theta[m:], covariance=covariance, splines=state.splines, residual=state.residual)


def _jackknife(points: Points, prior: _Prior, state: _State, part: Index) -> Array:
    """Covariance (2m, 2m) of the shifts that comes of leaving out one part of all curves after the other.

    Where curves do not superpose, the shift depends on what part of them it is read from, and no scatter tells that.
    """
    moved = []
    for k in range(PARTS):
        weights = replace(state.weights, weight=np.where(part == k, 1e-9, 1.0) * state.weights.weight)
        left = _assemble(points, state.theta, prior, weights, state.spacing)
        for _ in range(JACKKNIFE_STEPS):
            left, _ = _step(points, prior, left)
        moved.append(left.theta)
    away = np.array(moved) - np.mean(moved, axis=0)
    covariance = (PARTS - 1) / PARTS * away.T @ away
    # A few parts tell the variances, hardly which combinations of shifts are free of error: half of the correlation is believed.
    return np.asarray((covariance + np.diag(np.diag(covariance))) / 2)


def _fit(points: Points, theta: Array, prior: _Prior) -> _State:
    """Try knot spacings from wide to narrow, then iterate with the best until nothing moves."""
    best: tuple[float, _State] | None = None
    worse = 0
    weights = even_weights(points.variance)
    for spacing in _spacings(points, theta, prior.free.size):
        state = _assemble(points, theta, prior, weights, spacing)
        state, _ = _step(points, prior, _reweigh(points, state, prior, channel_shares(points.channel, state.residual)))
        state = _reweigh(points, state, prior, channel_shares(points.channel, state.residual))
        theta, weights = state.theta, state.weights
        score = _akaike(state)
        if best is None or score < best[0]:
            best, worse = (score, state), 0
        else:
            worse += 1
        if worse == 2:
            break
    assert best is not None
    return _converge(points, prior, best[1])


def _converge(points: Points, prior: _Prior, state: _State) -> _State:
    for _ in range(ITERATIONS):
        state, moved = _step(points, prior, state)
        state = _reweigh(points, state, prior, noise_shares(points.series, state.residual, points.channel))
        if moved < CONVERGED:
            break
    return state


def _spacings(points: Points, theta: Array, parameters: int) -> Array:
    """Knot spacings to try, wide to narrow, in decades; never fewer than about three points to an interval."""
    span = float(np.ptp(points.log_time - theta[points.curve]))
    finest = max(0.15, 3 * span / max(points.curve.size / points.channels - parameters, 1))
    widest = max(min(1.6, span / 3), finest)
    return np.geomspace(widest, finest, 2 + int(np.log(widest / finest) / np.log(1.5)))


def _assemble(points: Points, theta: Array, prior: _Prior, weights: Weights, spacing: float) -> _State:
    m, curve, weight, free = points.curves, points.curve, weights.weight, prior.free
    u = points.log_time - theta[curve]
    target = points.log_modulus + points.lift * theta[m:][curve] if np.any(theta[m:]) else points.log_modulus
    origin, end = float(u.min()), float(u.max())
    size = int(np.ceil((end - origin) / spacing + 1e-9)) + 3
    index, basis, derivative = spline_basis(u, origin, spacing, size)
    each, size = size, size * points.channels
    if points.channels > 1:  # one block of coefficients after the other: no interval straddles two
        index = index + points.channel * each
    inverse = _inverse(gram(index, basis, weight, size), roughness(each, spacing), points.channels)
    rows = index + np.arange(4)[:, None]
    weighted = basis * weight
    coefficient = inverse @ np.bincount(rows.ravel(), (weighted * target).ravel(), minlength=size)
    local = coefficient[rows]
    slope = np.sum(derivative * local, axis=0)
    residual = target - np.sum(basis * local, axis=0)

    sides = [slope, points.lift] if free.size and free[-1] >= m else [slope]
    key = (rows * m + curve).ravel()
    cross = np.hstack([np.bincount(key, (weighted * side).ravel(), minlength=size * m).reshape(size, m) for side in sides])
    own = np.block([[np.diag(np.bincount(curve, weight * one * other, minlength=m)) for other in sides] for one in sides])
    pull = np.hstack([np.bincount(curve, weight * residual * side, minlength=m) for side in sides])
    away = theta - prior.mean
    own = own - cross.T @ inverse @ cross
    normal = np.asarray(own[np.ix_(free, free)] + np.diag(prior.precision[free]), dtype=float)
    gradient = np.asarray(pull[free] + (prior.precision * away)[free], dtype=float)
    cost = float(np.sum(weight * residual**2) + np.sum(prior.precision * away**2))
    splines = tuple(Spline(origin, spacing, part, end) for part in np.split(coefficient, points.channels))
    return _State(theta, splines, residual, cost, gradient, normal, weights)


def _inverse(matrix: Array, prior: Array, channels: int) -> Array:
    """Inverse of the block-diagonal `matrix` with the `prior` added to every block."""
    if channels == 1:
        return np.asarray(np.linalg.inv(matrix + prior))
    inverse = np.zeros(matrix.shape)
    for first in range(0, len(matrix), len(prior)):
        block = slice(first, first + len(prior))
        inverse[block, block] = np.linalg.inv(matrix[block, block] + prior)
    return inverse


def _step(points: Points, prior: _Prior, state: _State) -> tuple[_State, float]:
    """One Gauss-Newton step of the shifts, shortened until the cost falls; with how far it moved, in standard errors."""
    if not prior.free.size:
        return state, 0.0
    step = -np.linalg.solve(state.normal, state.gradient)
    step *= min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-300))
    for _ in range(8):
        theta = state.theta.copy()
        theta[prior.free] += step
        new = _assemble(points, theta, prior, state.weights, state.spacing)
        moved = float(np.sqrt(max(float(step @ state.normal @ step), 0.0) / step.size))
        if moved < CONVERGED or new.cost <= state.cost:
            return new, moved
        step = step / 3
    return state, 0.0


def _reweigh(points: Points, state: _State, prior: _Prior, share: Array) -> _State:
    weights = robust_weights(points.variance, state.residual, state.parameters, share, state.weights)
    return _assemble(points, state.theta, prior, weights, state.spacing)


def _akaike(state: _State) -> float:
    """Akaike's criterion corrected for small samples; what an outlier can add is bounded."""
    n, p = state.residual.size, state.parameters
    bounded = np.minimum(state.residual**2 / state.weights.variance, 16.0)
    return float(np.sum(np.log(state.weights.variance)) + np.sum(bounded)) + 2 * p * n / max(n - p - 1, 1)


def _offset_spread(points: Points, state: _State, everything: _Prior, anchor: int) -> float:
    """Standard deviation of the curves' vertical offsets in decades, zero unless they exceed what the noise explains."""
    m = points.curves
    linear = _assemble(points, state.theta, everything, state.weights, state.spacing)
    freed, _ = _step(points, everything, linear)
    misfit = float(np.sum(freed.weights.weight * freed.residual**2)) / max(freed.residual.size - freed.parameters, 1)
    covariance = np.linalg.inv(linear.normal)[m - 1 :, m - 1 :] * misfit * _correlation(points, freed)
    offset = -np.linalg.solve(linear.normal, linear.gradient)[m - 1 :]
    significance = float(offset @ np.linalg.solve(covariance, offset))
    if significance < m + 11 + 4 * np.sqrt(2 * (m - 1)):  # about one in 100 000 by chance
        return 0.0
    centre = (np.eye(m) - 1 / m)[:, np.arange(m) != anchor]
    excess = float(np.sum((centre @ offset) ** 2) - np.trace(centre @ covariance @ centre.T)) / (m - 1)
    return float(np.sqrt(max(excess, 0.0)))


def _fit_offsets(points: Points, state: _State, start: Array, spread: float, anchor: int) -> tuple[_State, _Prior, float]:
    """Fit with vertical offsets of every curve as random effects, their spread by expectation and maximisation."""
    m = points.curves
    free = np.delete(np.arange(2 * m), anchor)
    for k in range(EXPECTATIONS):
        prior = _Prior(start, np.repeat((LOOSE, spread**-2), m), free)
        if k == 0:
            state = _fit(points, state.theta, prior)
        else:
            state = _converge(points, prior, _assemble(points, state.theta, prior, state.weights, state.spacing))
        scatter = np.diag(np.linalg.inv(state.normal))[m - 1 :]
        spread = float(np.sqrt(np.mean(state.theta[m:] ** 2 + np.maximum(scatter, 0.0))))
    return state, prior, spread


def _correlation(points: Points, state: _State) -> float:
    """Factor on the covariance for residuals that keep their sign for long: (1 + r)/(1 - r), r the correlation of neighbours."""
    z = state.residual * np.sqrt(state.weights.weight)
    joined = points.series[1:] == points.series[:-1]
    r = float(np.sum((z[1:] * z[:-1])[joined]) / max(float(np.sum(z**2)), 1e-300))
    return (1 + r) / (1 - r) if r > 3 / np.sqrt(z.size) else 1.0
