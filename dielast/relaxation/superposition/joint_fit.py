"""The joint fit: the best smooth curve and shift factors, with a knot spacing chosen by Akaike's criterion.

Specimens and load cells differ by a few percent, which shifts a whole curve up or down, or tilts it, and would bias its shift
factor. The offsets are therefore fitted too, as random effects, and the standard errors allow for tilts (see `effects`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dielast.numerics.arrays import Floats
from dielast.relaxation.superposition.effects import OFFSET, TILT, Drift, RandomEffect, likeliest
from dielast.relaxation.superposition.joint_errors import Misfit, find_misfit, leave_out, smoothing_errors
from dielast.relaxation.superposition.joint_problem import (
    CONVERGED,
    LOOSE,
    Prior,
    State,
    akaike,
    gauss_newton_step,
    reweighed,
    with_random,
)
from dielast.relaxation.superposition.points import FitPoints, channel_shares, even_weights, noise_shares
from dielast.relaxation.superposition.shift_errors import effect_equations, shift_covariance
from dielast.relaxation.superposition.spline import Spline

ITERATIONS = 40
SPREAD_ROUNDS = 6  # iterations of the spreads of offsets and tilts per step of the shifts
BEGINNING = 3  # steps at each knot spacing
FINER = 1  # number of spacings by which the final one is finer than the one with the lowest criterion
AMBIGUOUS = 0.1  # decades; dependence of the shifts on the part of the curves, above which a misfit matters
SPACING_RATIO = 1.5  # ratio of successive knot spacings
FINEST, WIDEST = 0.15, 1.6  # decades; limits of the knot spacing
LEAST_POINTS, LEAST_INTERVALS = 3, 3  # smallest numbers of points per interval, and of intervals
SAME_START = 0.01  # decades; closer starting values are taken as equal


@dataclass(frozen=True, slots=True, eq=False)
class MasterFit:
    """log10 a (m,) relative to the anchor, log10 b (m,), their covariance (2m, 2m), and the smooth curves.

    `noise_stderr` (m,) is the standard error of the shifts without the contribution of their dependence on the part of the curves
    that determines them. `offset_spread` and `tilt_spread` are the standard deviations, in decades of modulus, of the vertical
    offsets of the curves and of their tilts from end to end. The errors allow for these, but they are not applied: `placed` are
    smooth curves through the points without them. `misfit` is the distance of the curves beyond noise and offsets.

    `score` is Akaike's criterion: of two fits to the same points, the one with the lower score is better. `left_out` is, for each
    channel, the mean square distance of omitted points from their prediction, over the variance of prediction, scatter, specimens
    and instruments together.
    """

    shift: Floats
    vertical: Floats
    covariance: Floats
    noise_stderr: Floats
    splines: tuple[Spline, ...]
    offset_spread: float
    tilt_spread: float
    placed: tuple[Spline, ...]
    misfit: Misfit
    score: float
    left_out: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A fit relative to the curve `anchor`, Akaike's criterion as `score`, and the misfit of the curves."""

    anchor: int
    state: State
    score: float
    misfit: Misfit


def best_fit(points: FitPoints, starts: Sequence[Floats], anchor: int, vertical: bool, drift: Drift | None = None) -> Fitted:
    """The best of the fits of the smooth curve and all shifts from each of the starting values (m,), after Akaike's criterion.

    The curve numbered `anchor` is not shifted. With `vertical`, the curves are also shifted along the modulus. Offsets may be a
    `drift`, stated or not. Knots are refined until Akaike's criterion no longer improves.
    """
    m = points.curves
    best: tuple[State, float] | None = None
    for k, start in enumerate(starts):
        earlier = [*starts[:k], *([] if best is None else [best[0].theta[:m]])]
        if any(np.max(np.abs(start - other)) < SAME_START for other in earlier):
            continue
        state, score = fit_state(points, *_begin(points, start, anchor, vertical, drift))
        if best is None or score < best[1]:
            best = state, score
    assert best is not None
    return Fitted(anchor, *best, find_misfit(points.series, points.curve, points.log_time, best[0].residual))


def fit_master(
    points: FitPoints,
    starts: Sequence[Floats],
    anchor: int,
    vertical: bool,
    drift: Drift | None = None,
) -> MasterFit:
    """The `best_fit`, with the covariance of its shifts, as `with_errors`."""
    return with_errors(points, best_fit(points, starts, anchor, vertical, drift), vertical)


def with_errors(points: FitPoints, fitted: Fitted, vertical: bool, compared: bool = True, doubt: Floats | None = None) -> MasterFit:
    """A fit of `points` with the covariance of its shifts, to which that of a `doubt` (2m, 2m) about the points is added. One that
    is not `compared` with those to other points has no `left_out` where its curves superpose.
    """
    m, score, state, prior, misfit = points.curves, fitted.score, fitted.state, fitted.state.prior, fitted.misfit
    covariance = smoothing_errors(state)
    scatter = shift_covariance(_smoothest(state, score))
    free = prior.free[prior.free < 2 * m]
    covariance[np.ix_(free, free)] += scatter[: free.size, : free.size]
    if doubt is not None:
        covariance += doubt
    noise_stderr = np.sqrt(np.diag(covariance)[:m])
    ambiguity, left_out = leave_out(state, misfit) if compared or misfit.sure else (None, ())
    if misfit.sure and ambiguity is not None:
        covariance += ambiguity
        misfit = replace(misfit, matters=misfit.matters or bool(np.max(np.diag(ambiguity)[:m]) > AMBIGUOUS**2))
    shift, level = state.theta[:m], state.theta[m : 2 * m]
    if not vertical:
        covariance[m:, :] = covariance[:, m:] = 0.0
        level = np.zeros(m)
    placed = state.at(np.concatenate((shift, level))).splines
    splines = state.splines
    return MasterFit(
        shift,
        level,
        covariance,
        noise_stderr,
        splines,
        prior.spread(OFFSET),
        prior.spread(TILT),
        placed,
        misfit,
        score,
        left_out,
    )


def fit_held(points: FitPoints, shifts: MasterFit, anchor: int, vertical: bool) -> MasterFit:
    """Fit smooth curves to `points`, and with `vertical` also vertical shifts, at the horizontal shifts of the fit `shifts`."""
    m = points.curves
    theta = np.concatenate((shifts.shift, shifts.vertical))
    movable = np.delete(np.arange(2 * m), [anchor, m + anchor])
    free = movable[m - 1 :] if vertical else movable[:0]
    prior = Prior(theta, np.eye(2 * m) * LOOSE, free, float(free.size))
    state, _ = fit_state(points, theta, prior)
    covariance = shifts.covariance.copy()
    if vertical:
        level_covariance = np.linalg.inv(state.normal) * state.repeated
        joint = state.with_prior(replace(prior, free=movable)).normal
        response = np.zeros((m, m))
        across, down = movable[: m - 1], movable[m - 1 :] - m
        response[np.ix_(down, across)] = -np.linalg.solve(joint[m - 1 :, m - 1 :], joint[m - 1 :, : m - 1])
        covariance[m:, :m] = response @ covariance[:m, :m]
        covariance[:m, m:] = covariance[m:, :m].T
        covariance[m:, m:] = covariance[m:, :m] @ response.T
        covariance[np.ix_(m + down, m + down)] += level_covariance
    level, splines = state.theta[m:], state.splines
    return replace(shifts, vertical=level, covariance=covariance, splines=splines, placed=splines)


def _begin(points: FitPoints, start: Floats, anchor: int, vertical: bool, drift: Drift | None) -> tuple[Floats, Prior]:
    """The initial values of all parameters, and their prior."""
    m = points.curves
    theta = np.concatenate((start, np.zeros(2 * m)))
    random = not vertical and bool(np.any(points.lift))
    fixed = [anchor, m + anchor] if vertical else [anchor] if random else [anchor, *range(m, 2 * m)]
    free = np.delete(np.arange(3 * m), fixed)
    prior = Prior(theta, np.eye(3 * m) * LOOSE, free, float(free.size))
    offsets = (RandomEffect(OFFSET, OFFSET.first, drift),) if random else ()
    return theta, with_random(prior, (*offsets, RandomEffect(TILT, TILT.first)), m)


def _respread(state: State) -> State:
    """The fit with the likeliest spreads of the random effects, given the linearised equations."""
    prior, m = state.prior, state.points.curves
    if not prior.random:
        return state
    effects, counted, evidence = likeliest(prior.random, *effect_equations(state), SPREAD_ROUNDS)
    new = with_random(prior, effects, m, state.repeated)
    return state.with_prior(replace(new, freedom=float(prior.free.size - len(effects) * m) + counted, evidence=evidence))


def fit_state(points: FitPoints, theta: Floats, prior: Prior) -> tuple[State, float]:
    """Try knot spacings from wide to narrow, then iterate with the best one to convergence; also returns Akaike's criterion."""
    tried: list[tuple[float, State]] = []
    begin = even_weights(points.variance)
    for spacing in knot_spacings(points, theta, int(np.count_nonzero(prior.free < 2 * points.curves))):
        state = State.of(points, theta, prior, begin, spacing)
        if tried:
            state = min(state, state.at(tried[-1][1].theta), key=lambda each: each.cost)
        for _ in range(BEGINNING):
            state, _ = gauss_newton_step(reweighed(state, channel_shares(points.channel, state.residual)))
        state = reweighed(state, channel_shares(points.channel, state.residual))
        tried.append((akaike(state, 0.0), state))
        best = min(range(len(tried)), key=lambda k: tried[k][0])
        if len(tried) > best + 2:
            break
    # The spacing of the lowest criterion still bends the curves slightly, and so biases the shifts; one step finer costs little.
    return converge(tried[min(best + FINER, len(tried) - 1)][1])


def _smoothest(state: State, score: float) -> State:
    """The fit with no more knots than the data support once offsets are known: more take noise for the shape of the curves."""
    points, free = state.points, state.prior.free
    tried = [(state, score)]
    spacings = knot_spacings(points, state.theta, int(np.count_nonzero(free < 2 * points.curves)))
    for spacing in spacings[spacings > 1.01 * state.spacing][::-1]:
        tried.append(converge(state.with_knots(spacing)))
        best = min(range(len(tried)), key=lambda k: tried[k][1])
        if len(tried) > best + 2:
            break
    return min(tried, key=lambda fit: fit[1])[0]


def converge(state: State) -> tuple[State, float]:
    """Iterate shifts, weights and the spread of the offsets to convergence; also returns Akaike's criterion."""
    points = state.points
    for _ in range(ITERATIONS):
        state, change = gauss_newton_step(_respread(state))
        state = reweighed(state, noise_shares(points.series, state.residual, points.channel))
        if change < CONVERGED:
            break
    return state, akaike(state, state.prior.evidence)


def knot_spacings(points: FitPoints, theta: Floats, parameters: int) -> Floats:
    """Knot spacings to try, from wide to narrow, in decades."""
    span = float(np.ptp(points.log_time - theta[points.curve]))
    finest = max(FINEST, LEAST_POINTS * span / max(points.curve.size / points.channels - parameters, 1))
    widest = max(min(WIDEST, span / LEAST_INTERVALS), finest)
    return np.geomspace(widest, finest, 2 + int(np.log(widest / finest) / np.log(SPACING_RATIO)))
