"""The joint fit: one smooth curve of log modulus over log reduced time, and all shift factors with it.

The smooth curve is a cubic B-spline on even knots; a frequency sweep has two channels, with a curve each, that share the shifts.
For given shifts the coefficients are a linear problem, so they are projected out (variable projection in Kaufman's form, DOI
10.1007/BF01932995), and a Gauss-Newton iteration moves the shifts alone.

Real specimens and load cells differ by a few percent, which slides a whole curve up or down, or tilts it, and would pull its shift
factor along. The offsets are therefore fitted too, as random effects, and the standard errors allow for tilts (see `effects`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dielast.superposition.effects import OFFSET, TILT, likeliest, precision_of
from dielast.superposition.misfit import PARTS, VISIBLE, Misfit, find_misfit
from dielast.superposition.robust import Weights, channel_shares, even_weights, noise_shares, robust_weights
from dielast.superposition.spline import Spline, gram, roughness, spline_basis

Array = NDArray[np.float64]
Index = NDArray[np.intp]

LOOSE = 30.0**-2  # precision (1/decade^2) of the prior that keeps the normal matrix regular where the data say nothing
MAX_STEP = 0.5  # decades a shift may move in one iteration
CONVERGED = 0.01  # standard errors
ITERATIONS = 40
ROUNDS = 6  # of the spread of the offsets to one step of the shifts
TILT_ROUNDS = 50
FINER = 1
SPACING_RATIO = 1.5
BEGINNING = 3  # steps for each spacing of the knots
JACKKNIFE_STEPS = 3
AMBIGUOUS = 0.1  # decades by which the shifts may depend on the part of the curves they are read from
SAME_START = 0.01  # decades
BOUND = 5.0  # standard deviations beyond which a point that was left out is no farther off


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

    @property
    def lean(self) -> Array:
        """By how much a tilt of its curve by one decade from end to end raises each point (n,)."""
        low, high = np.full(self.curves, np.inf), np.full(self.curves, -np.inf)
        np.minimum.at(low, self.curve, self.log_time)
        np.maximum.at(high, self.curve, self.log_time)
        along = (self.log_time - ((low + high) / 2)[self.curve]) / np.maximum(high - low, 1e-12)[self.curve]
        return np.asarray(along * self.lift if np.any(self.lift) else along)


@dataclass(frozen=True, slots=True, eq=False)
class MasterFit:
    """log10 a (m,) relative to the anchor, log10 b (m,), their covariance (2m, 2m), the smooth curves and the residuals (n,).

    `noise_stderr` (m,) is the part of the shifts' standard errors without what the shifts depend on the part of the curves they are
    read from. `offset_spread` and `tilt_spread` are the standard deviations, in decades of modulus, of the curves' vertical offsets
    and tilts from end to end that were allowed for but not applied: `placed` are smooth curves through the points as they lie.
    `misfit` is what is missed beyond noise and offsets.

    `score` is Akaike's criterion of the fit: of two to the same points the lower one is the better. `left_out` says for each
    channel how well points that are left out are predicted: the mean square of what they are missed by, over the variance of the
    prediction, of their scatter, and of what specimens and instruments do.
    """

    shift: Array
    vertical: Array
    covariance: Array
    noise_stderr: Array
    splines: tuple[Spline, ...]
    residual: Array
    offset_spread: float
    tilt_spread: float
    placed: tuple[Spline, ...]
    misfit: Misfit
    score: float
    left_out: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Prior:
    """Mean (2m,) and precision (2m, 2m) of all shifts, then all vertical shifts, and which of them are free.

    With a `spread` the vertical shifts are random effects of that spread, and of the covariance `drift` (m, m) besides; `freedom`
    is how many parameters the free ones count for, `evidence` what random ones add to -2 ln likelihood.
    """

    mean: Array
    precision: Array
    free: Index
    freedom: float
    spread: float = 0.0
    drift: Array | None = None
    evidence: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """The best splines for given shifts and vertical shifts `theta` (2m,); cost, gradient and normal matrix over the free ones; the
    weights used."""

    theta: Array
    splines: tuple[Spline, ...]
    residual: Array
    cost: float
    gradient: Array
    normal: Array
    weights: Weights
    freedom: float

    @property
    def parameters(self) -> float:
        return sum(spline.coefficient.size for spline in self.splines) + self.freedom

    @property
    def spacing(self) -> float:
        return self.splines[0].spacing


def fit_master(points: Points, starts: Sequence[Array], anchor: int, vertical: bool, drift: Array | None = None) -> MasterFit:
    """Fit the smooth curve and all shifts together, from each of the starting values (m,); the curve numbered `anchor` stays put.

    With `vertical`, the curves slide along the modulus too. A stated `drift` is the covariance (m, m) of the vertical offsets that
    are expected. Knots grow denser until Akaike's criterion no longer gains; of the fits from several starts the best is kept.
    """
    m = points.curves
    best: tuple[float, _State, _Prior] | None = None
    for k, start in enumerate(starts):
        known = [*starts[:k], *([] if best is None else [best[1].theta[:m]])]
        if any(np.max(np.abs(start - other)) < SAME_START for other in known):
            continue
        state, prior, score = _fit(points, *_begin(points, start, anchor, vertical, drift))
        if best is None or score < best[0]:
            best = score, state, prior
    assert best is not None
    score, state, prior = best
    misfit = find_misfit(points.series, points.curve, points.log_time, state.residual)
    covariance = np.zeros((2 * m, 2 * m))
    inner = np.ix_(prior.free, prior.free)
    tilts, tilt_spread = _tilts(points, prior, state)
    covariance[inner] = np.linalg.inv(state.normal) * _correlation(points, state) + tilts
    covariance += _smoothing(points, prior, state)
    noise_stderr = np.sqrt(np.diag(covariance)[:m])
    ambiguity, left_out = _leave_out(points, prior, state, misfit)
    if misfit.sure:
        covariance += ambiguity
        misfit = replace(misfit, matters=misfit.matters or bool(np.max(np.diag(ambiguity)[:m]) > AMBIGUOUS**2))
    shift, level, residual, placed = state.theta[:m], state.theta[m:], state.residual, state.splines
    if not vertical:
        covariance[m:, :] = covariance[:, m:] = 0.0
        residual = residual - points.lift * level[points.curve]
        level = np.zeros(m)
        none = prior.free[:0]
        plain = _Prior(np.concatenate((shift, level)), prior.precision, none, 0.0)
        placed = _assemble(points, plain.mean, plain, state.weights, state.spacing).splines
    spread = prior.spread if prior.spread > 0 else 0.0
    splines = state.splines
    return MasterFit(
        shift, level, covariance, noise_stderr, splines, residual, spread, tilt_spread, placed, misfit, score, left_out
    )


def fit_held(points: Points, shifts: MasterFit, anchor: int, vertical: bool) -> MasterFit:
    """Fit smooth curves, and with `vertical` vertical shifts, to `points`, their shifts those of another fit `shifts`."""
    m = points.curves
    theta = np.concatenate((shifts.shift, shifts.vertical))
    movable = np.delete(np.arange(2 * m), [anchor, m + anchor])
    free = movable[m - 1 :] if vertical else movable[:0]
    prior = _Prior(theta, np.eye(2 * m) * LOOSE, free, float(free.size))
    state, prior, _ = _fit(points, theta, prior)
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
    level, splines = state.theta[m:], state.splines
    return replace(shifts, vertical=level, covariance=covariance, splines=splines, placed=splines, residual=state.residual)


def _begin(points: Points, start: Array, anchor: int, vertical: bool, drift: Array | None) -> tuple[Array, _Prior]:
    """All parameters to begin with, and their prior."""
    m = points.curves
    theta = np.concatenate((start, np.zeros(m)))
    random = not vertical and bool(np.any(points.lift))
    fixed = [anchor, m + anchor] if vertical else [anchor] if random else [anchor, *range(m, 2 * m)]
    free = np.delete(np.arange(2 * m), fixed)
    prior = _Prior(theta, np.eye(2 * m) * LOOSE, free, float(free.size))
    return theta, _with_spread(replace(prior, drift=drift), OFFSET.first) if random else prior


def _with_spread(prior: _Prior, spread: float, repeated: float = 1.0) -> _Prior:
    """The prior with vertical shifts of another spread, beside points of which so many count for one."""
    m = prior.mean.size // 2
    precision = prior.precision.copy()
    precision[m:, m:] = repeated * precision_of(spread, m, prior.drift)
    return replace(prior, precision=precision, spread=spread)


def _respread(points: Points, prior: _Prior, state: _State) -> tuple[_State, _Prior]:
    """The likeliest spread of the vertical shifts, given the linearised fit."""
    if prior.spread == 0:
        return state, prior
    m = prior.mean.size // 2
    random = prior.free >= m
    fixed, level = ~random, state.theta[m:]
    own = prior.precision[m:, m:]
    normal, gradient = state.normal[np.ix_(random, random)] - own, state.gradient[random] - own @ level
    across = state.normal[np.ix_(random, fixed)]
    answer = np.linalg.solve(state.normal[np.ix_(fixed, fixed)], np.column_stack((across.T, state.gradient[fixed])))
    normal, gradient = normal - across @ answer[:, :-1], gradient - across @ answer[:, -1]
    repeated = _correlation(points, state)
    told = likeliest(OFFSET, normal / repeated, (normal @ level - gradient) / repeated, prior.spread, ROUNDS, prior.drift)
    freedom = float(np.count_nonzero(fixed)) + told.counted
    new = replace(_with_spread(prior, told.spread, repeated), freedom=freedom, evidence=told.evidence)
    change = new.precision[m:, m:] - own
    normal, gradient = state.normal.copy(), state.gradient.copy()
    normal[np.ix_(random, random)] += change
    gradient[random] += change @ level
    cost = state.cost + float(level @ change @ level)
    return replace(state, cost=cost, gradient=gradient, normal=normal, freedom=freedom), new


def _tilts(points: Points, prior: _Prior, state: _State) -> tuple[Array, float]:
    """What tilts of the curves add to the covariance of the free parameters, and the spread of the tilts."""
    weight, m = state.weights.weight, points.curves
    parts = _parts(points, state.theta, prior.free, state.weights, state.spacing)
    lean = points.lean
    size = len(parts.cross)
    key = (parts.rows * m + points.curve).ravel()
    cross = np.bincount(key, (parts.basis * weight * lean).ravel(), minlength=size * m).reshape(size, m)
    own = np.diag(np.bincount(points.curve, weight * lean**2, minlength=m)) - cross.T @ parts.inverse @ cross
    pull = np.bincount(points.curve, weight * parts.residual * lean, minlength=m)
    both = np.vstack([np.diag(np.bincount(points.curve, weight * side * lean, minlength=m)) for side in parts.sides])
    beside = np.asarray(both - parts.cross.T @ parts.inverse @ cross, dtype=float)[prior.free]
    response = np.linalg.solve(state.normal, np.column_stack((beside, state.gradient)))
    normal, right = own - beside.T @ response[:, :-1], beside.T @ response[:, -1] - pull
    repeated = _correlation(points, state)
    told = likeliest(TILT, normal / repeated, right / repeated, TILT.first, TILT_ROUNDS)
    return told.spread**2 * response[:, :-1] @ response[:, :-1].T, told.spread


def _leave_out(points: Points, prior: _Prior, state: _State, misfit: Misfit) -> tuple[Array, tuple[float, ...]]:
    """What comes of leaving out one part of all curves after the other: covariance (2m, 2m) of the shifts, and how far off the
    points left out are predicted in each channel, see `MasterFit`.

    Where curves do not superpose, the shift depends on what part of them it is read from, and no scatter tells that.
    """
    moved, off = [], np.zeros(points.curve.size)
    scatter = _scatter(points, state.residual)
    for k in range(PARTS):
        out = misfit.part == k
        weights = replace(state.weights, weight=np.where(out, 1e-9, 1.0) * state.weights.weight)
        left = _assemble(points, state.theta, prior, weights, state.spacing)
        for _ in range(JACKKNIFE_STEPS):
            left, _ = _step(points, prior, left)
        moved.append(left.theta)
        off[out] = (left.residual**2 / (_predicted_variance(points, prior, left) + scatter))[out]
    away = np.array(moved) - np.mean(moved, axis=0)
    covariance = (PARTS - 1) / PARTS * away.T @ away
    # A few parts tell the variances, hardly which combinations of shifts are free of error: half of the correlation is believed.
    return np.asarray((covariance + np.diag(np.diag(covariance))) / 2), tuple(
        float(np.mean(np.minimum(off[points.channel == k], BOUND**2))) for k in range(points.channels)
    )


def _smoothing(points: Points, prior: _Prior, state: _State) -> Array:
    """Covariance (2m, 2m) of how far the shifts depend on how smooth the curves are taken to be: with knots wider or closer."""
    moved = []
    for factor in (SPACING_RATIO, 1 / SPACING_RATIO):
        other = _assemble(points, state.theta, prior, state.weights, state.spacing * factor)
        for _ in range(JACKKNIFE_STEPS):
            other, _ = _step(points, prior, other)
        moved.append(other.theta - state.theta)
    away = np.array(moved)
    covariance = away.T @ away / len(moved)
    return np.asarray((covariance + np.diag(np.diag(covariance))) / 2)


def _scatter(points: Points, residual: Array) -> Array:
    """Variance of each point by how neighbours differ, one for each channel, and by what specimens and instruments do (n,)."""
    joined = points.series[1:] == points.series[:-1]
    square = np.diff(residual) ** 2 / 2
    found = [np.median(square[joined & (points.channel[1:] == k)]) / 0.455 for k in range(points.channels)]
    return np.array(found)[points.channel] + points.variance + VISIBLE**2


def _predicted_variance(points: Points, prior: _Prior, state: _State) -> Array:
    """Variance of the smooth curve at each point (n,), shifts and offsets being as uncertain as they are."""
    parts = _parts(points, state.theta, prior.free, state.weights, state.spacing)
    basis, rows, inverse = parts.basis, parts.rows, parts.inverse
    leverage = np.einsum("an,abn,bn->n", basis, inverse[rows[:, None], rows[None]], basis)
    m = points.curves
    answer = (inverse @ parts.cross)[:, prior.free]
    sensitive = -np.einsum("an,ank->nk", basis, answer[rows])
    place = np.full(2 * m, -1)
    place[prior.free] = np.arange(prior.free.size)
    for number, side in enumerate(parts.sides):
        column = place[number * m + points.curve]
        here = np.flatnonzero(column >= 0)
        sensitive[here, column[here]] += side[here]
    return np.asarray(leverage + np.einsum("nk,kl,nl->n", sensitive, np.linalg.inv(state.normal), sensitive))


def _fit(points: Points, theta: Array, prior: _Prior) -> tuple[_State, _Prior, float]:
    """Try knot spacings from wide to narrow, then iterate with the best until nothing moves; with Akaike's criterion."""
    tried: list[tuple[float, _State]] = []
    weights, last = even_weights(points.variance), theta
    for spacing in _spacings(points, theta, prior.free.size):
        starts = [_assemble(points, start, prior, weights, spacing) for start in (theta, last)]
        state = min(starts, key=lambda each: each.cost)
        for _ in range(BEGINNING):
            state, _ = _step(points, prior, _reweigh(points, state, prior, channel_shares(points.channel, state.residual)))
        state = _reweigh(points, state, prior, channel_shares(points.channel, state.residual))
        tried.append((_akaike(state, 0.0), state))
        last = state.theta
        best = min(range(len(tried)), key=lambda k: tried[k][0])
        if len(tried) > best + 2:
            break
    # What smooths the curves best still bends them a little, and the shifts with them: one step finer costs next to nothing.
    return _converge(points, prior, tried[min(best + FINER, len(tried) - 1)][1])


def _converge(points: Points, prior: _Prior, state: _State) -> tuple[_State, _Prior, float]:
    for _ in range(ITERATIONS):
        state, prior = _respread(points, prior, state)
        state, moved = _step(points, prior, state)
        state = _reweigh(points, state, prior, noise_shares(points.series, state.residual, points.channel))
        if moved < CONVERGED:
            break
    return state, prior, _akaike(state, prior.evidence)


def _spacings(points: Points, theta: Array, parameters: int) -> Array:
    """Knot spacings to try, wide to narrow, in decades; never fewer than about three points to an interval."""
    span = float(np.ptp(points.log_time - theta[points.curve]))
    finest = max(0.15, 3 * span / max(points.curve.size / points.channels - parameters, 1))
    widest = max(min(1.6, span / 3), finest)
    return np.geomspace(widest, finest, 2 + int(np.log(widest / finest) / np.log(SPACING_RATIO)))


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    """The linear problem of the smooth curves at given shifts: basis functions (4, n), the coefficients (4, n) that they belong
    to, the inverse of the normal matrix, the derivatives `sides` of the residuals, each (n,), with respect to shifts and vertical
    shifts, and what these have in `cross` (K, sides m) with the basis."""

    basis: Array
    rows: Index
    inverse: Array
    coefficient: Array
    residual: Array
    sides: list[Array]
    cross: Array
    origin: float
    end: float


def _parts(points: Points, theta: Array, free: Index, weights: Weights, spacing: float) -> _Parts:
    m, curve, weight = points.curves, points.curve, weights.weight
    u, target = points.log_time - theta[curve], points.log_modulus
    if np.any(theta[m:]):
        target = target + points.lift * theta[m:][curve]
    origin, end = float(u.min()), float(u.max())
    size = int(np.ceil((end - origin) / spacing + 1e-9)) + 3
    index, basis, derivative = spline_basis(u, origin, spacing, size)
    each, size = size, size * points.channels
    if points.channels > 1:  # one block of coefficients after the other: no interval straddles two
        index = index + points.channel * each
    inverse = _inverse(gram(index, basis, weight, size), roughness(each, spacing), points.channels)
    rows: Index = np.asarray(index + np.arange(4)[:, None], dtype=np.intp)
    weighted = basis * weight
    coefficient = inverse @ np.bincount(rows.ravel(), (weighted * target).ravel(), minlength=size)
    local = coefficient[rows]
    residual = target - np.sum(basis * local, axis=0)
    slope = np.sum(derivative * local, axis=0)
    sides = [slope, points.lift] if free.size and free[-1] >= m else [slope]
    key = (rows * m + curve).ravel()
    products = [np.bincount(key, (weighted * side).ravel(), minlength=size * m).reshape(size, m) for side in sides]
    cross = np.asarray(np.hstack(products), dtype=float)
    return _Parts(basis, rows, inverse, coefficient, residual, sides, cross, origin, end)


def _assemble(points: Points, theta: Array, prior: _Prior, weights: Weights, spacing: float) -> _State:
    m, curve, weight, free = points.curves, points.curve, weights.weight, prior.free
    parts = _parts(points, theta, free, weights, spacing)
    own = np.block(
        [[np.diag(np.bincount(curve, weight * one * other, minlength=m)) for other in parts.sides] for one in parts.sides]
    )
    pull = np.hstack([np.bincount(curve, weight * parts.residual * side, minlength=m) for side in parts.sides])
    away = theta - prior.mean
    own = own - parts.cross.T @ parts.inverse @ parts.cross
    normal = np.asarray(own[np.ix_(free, free)] + prior.precision[np.ix_(free, free)], dtype=float)
    gradient = np.asarray(pull[free] + prior.precision[free] @ away, dtype=float)
    cost = float(np.sum(weight * parts.residual**2) + away @ prior.precision @ away)
    splines = tuple(Spline(parts.origin, spacing, part, parts.end) for part in np.split(parts.coefficient, points.channels))
    return _State(theta, splines, parts.residual, cost, gradient, normal, weights, prior.freedom)


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


def _akaike(state: _State, evidence: float) -> float:
    """Akaike's criterion corrected for small samples; what an outlier can add is bounded. `evidence` is what effects add."""
    n, p = state.residual.size, state.parameters
    bounded = np.minimum(state.residual**2 / state.weights.variance, 16.0)
    return float(np.sum(np.log(state.weights.variance)) + np.sum(bounded)) + evidence + 2 * p * n / max(n - p - 1, 1)


def _correlation(points: Points, state: _State) -> float:
    """Factor on the covariance for residuals that keep their sign for long: (1 + r)/(1 - r), r the correlation of neighbours."""
    z = state.residual * np.sqrt(state.weights.weight)
    joined = points.series[1:] == points.series[:-1]
    r = float(np.sum((z[1:] * z[:-1])[joined]) / max(float(np.sum(z**2)), 1e-300))
    return (1 + r) / (1 - r) if r > 3 / np.sqrt(z.size) else 1.0
