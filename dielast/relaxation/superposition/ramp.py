"""A ramp that was left in tests over time: found by its likelihood, and taken out.

A load that grows evenly up to the time T leaves, at the time t, the mean of the modulus (or the compliance) over the ages of its
parts, from max(0, t - T) to t, where the response is read over the load of the moment; read over the last load, it is smaller by
t/T during the ramp (superposition of L. Boltzmann, see J. D. Ferry, Viscoelastic properties of polymers, 3rd ed., Wiley 1980, ch.
1). To first order in the slope of the log-log curve, this mean is the value at the mean of log age, whatever the curve. What is
left is of second order, and follows from the fitted smooth curve. So a fit with a ramp is that of other times, and T is one more
parameter, the same in all tests, for Gauss and Newton's iteration.

Curves that do not superpose for another reason are no ramp: its effect has no free size. The two hypotheses, no ramp or one of any
duration, are compared by their posterior probabilities (R. E. Kass and A. E. Raftery, J. Am. Stat. Assoc. 90 (1995) 773, with
Laplace's approximation for T); where residuals are correlated, so many points count as one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dielast.base.errors import InputError, NumericsError, warn, without_warnings
from dielast.material.measurement import Measurement, measurement_of
from dielast.numerics.arrays import Floats
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.binning import Binned
from dielast.relaxation.superposition.gather import MIN_BINS, Gathered
from dielast.relaxation.superposition.joint_fit import Fitted, best_fit, converge
from dielast.relaxation.superposition.joint_problem import Prior, State, assemble, correlation
from dielast.relaxation.superposition.overlap import starting_shifts, steepest
from dielast.relaxation.superposition.points import FitPoints, points_of
from dielast.relaxation.superposition.spline import Spline

SIGNIFICANT = 4.0  # standard errors of a significant rise
DROPPED = 2.0  # durations before which no step stands for a ramp
SHORTEST = 0.01  # of the first time: no shorter ramp is looked for
TRIED = 40  # durations at which the likelihood is tried, before the iteration
SURE = 0.95  # probability from which on a ramp is named and taken out
ITERATIONS = 12
LONGEST_STEP = 0.7  # change of the logarithm of the duration in one iteration
CONVERGED = 0.1  # standard errors of the duration
CHANGE = 1e-3  # of the logarithm of the duration, for derivatives

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_AGES = ((_NODES + 1) / 2) ** 3  # ages within their range; the cube is for a curve that is steep at the age 0
_SHARES = 3 / 2 * ((_NODES + 1) / 2) ** 2 * _WEIGHTS


@dataclass(frozen=True, slots=True)
class Ramp:
    """A ramp of a `duration` in s, with the standard error of its logarithm; `over_last`: the load that values are read over is
    the last one.
    """

    duration: float
    stderr: float
    over_last: bool

    def log_age(self, time: Floats) -> Floats:
        """Mean log10 of the ages at the times (n,) in s."""
        within = np.minimum(time, self.duration)
        oldest, youngest = time * np.log10(time), time - within
        return np.asarray((oldest - youngest * np.log10(np.maximum(youngest, 1e-300))) / within - 1 / np.log(10))

    def lift(self, time: Floats) -> Floats:
        """log10 of the last load over that of the moment, if values are read over the last one."""
        return np.log10(self.duration / np.minimum(time, self.duration)) if self.over_last else np.zeros(time.size)

    def excess(self, spline: Spline, shift: Floats, time: Floats, power: int) -> Floats:
        """What the mean over the ages is in log10 above the value at the mean log age (n,): of curves that the `spline`, log modulus
        over log reduced time, describes after shifts (n,); a `power` of the modulus is what is averaged.
        """
        within = np.minimum(time, self.duration)
        ages = (time - within)[:, None] + within[:, None] * _AGES
        value = power * spline.extended((np.log10(ages) - shift[:, None]).ravel()).reshape(ages.shape)
        return np.asarray(np.log10(10**value @ _SHARES) / power - spline.extended(self.log_age(time) - shift))


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The curves of a search for a ramp, and arguments of `best_fit`; no ramp is longer than `longest` s."""

    data: Gathered
    points: FitPoints
    vertical: bool
    drift: Floats | None
    longest: float

    @property
    def time(self) -> Floats:
        """Times (n,) in s."""
        return np.asarray(10**self.points.log_time)

    @property
    def shortest(self) -> float:
        """The shortest ramp that is looked for, in s."""
        return SHORTEST * float(np.min(self.time))


def find_ramp(data: Gathered, binned: Binned, plain: Fitted | None, vertical: bool, drift: Floats | None) -> float:
    """The duration in s of the ramp that is left in the curves, rounded as it is worth; 0 if it is not sure that there is one.

    `plain` is the `best_fit` without a ramp, None if there is no such fit; `vertical` and `drift` are its arguments.
    """
    problem = _Problem(data, points_of(binned), vertical, drift, _longest(binned))
    if problem.longest <= problem.shortest:
        return 0.0
    found = []
    if plain is not None and (begin := _likeliest(problem, plain)) is not None:
        found.append((begin, plain.state.theta[: problem.points.curves], plain.state.splines[0], plain.anchor))
    if (peak := _rise(data, binned)[0]) > 0:
        begin = Ramp(min(peak, problem.longest), 0.0, True)
        moved = replace(binned, log_time=begin.log_age(problem.time), log_modulus=_lifted(data, binned, begin, problem.time))
        try:
            anchor = steepest(moved)
            found.append((begin, starting_shifts(data.temperature, moved, anchor, data.kind), None, anchor))
        except InputError:
            pass  # a ramp does not explain why the curves do not overlap
    best, least = 0.0, np.inf if plain is None else plain.score
    for begin, shift, spline, anchor in found:
        try:
            with without_warnings():
                ramp, score, repeated = _settled(problem, begin, shift, spline, anchor)
        except (InputError, NumericsError, np.linalg.LinAlgError):
            continue
        gain = (least - score) / repeated
        known = np.sqrt(2 * np.pi) * ramp.stderr / np.log(problem.longest / problem.shortest)
        if gain / 2 + np.log(known) > np.log(SURE / (1 - SURE)):
            best, least = float(f"{ramp.duration:.3g}"), score
    return best


def without_ramp(curves: Sequence[Measurement], duration: float) -> list[Measurement]:
    """The curves as after a step: times from the middle of the ramp of a `duration` in s, without points before twice that."""
    if not duration:
        return list(curves)
    changed, ramp = [], Ramp(duration, 0.0, False)
    for curve in curves:
        columns = curve.columns[:, curve.columns[0] >= DROPPED * duration]
        columns[0] = 10 ** ramp.log_age(columns[0])
        changed.append(measurement_of(curve.KIND, curve.temperature, columns, curve.source, duration / 2))
    return changed


def warn_of_ramp(duration: float, data: Gathered) -> None:
    """Say which ramp was found and taken out."""
    stated = f'ramp = "{duration:.3g} s"'
    warn(
        f"all curves begin with a ramp of the {data.kind.step} of about {duration:.3g} s, which is taken out as {stated} would: times "
        f'count from its middle, points before {DROPPED * duration:.3g} s are left out; state {stated}, or ramp = "0 s" if there is none'
    )


def warn_if_modulus_rises(data: Gathered, binned: Binned) -> None:
    """Warn if at most temperatures the modulus rises at first: no relaxation modulus does, and no creep compliance falls."""
    if data.kind.stiffness_power < 0:
        return
    end, rising = _rise(data, binned)
    if end > 0:
        warn(
            f"at {rising} of {data.temperature.size} temperatures the {data.kind.value} rises up to about {end:.2g} s, which no step "
            f"of {data.kind.step} does: state the time in which the {data.kind.step} was applied, such as ramp = "
            f'"{end:.1g} s": times then count from the middle of the ramp, and its points are left out; until then, neither shift '
            "factors nor the law are to be trusted"
        )


def _rise(data: Gathered, binned: Binned) -> tuple[float, int]:
    """The time in s up to which the values over the last load rise as only a ramp lets them, and the number of curves that do so; 0
    if these are not most.

    A modulus rises then, and a compliance rises as fast as time or faster: after a step it is concave over time.
    """
    ends, rising, power = [], 0, data.kind.stiffness_power
    for first, last in pairwise(binned.bounds.tolist()):
        x, y = binned.log_time[first:last], power * binned.log_modulus[0, first:last]
        noise = robust_deviation(np.diff(y, 2)) / np.sqrt(6)  # of a point, from the bends between three
        y = y if power > 0 else y - x
        high = np.flatnonzero(y >= np.max(y) - noise)
        level = high[0] if power > 0 else high[-1]
        ends.append(x[level])
        enough = SIGNIFICANT * np.sqrt(2) * noise
        rising += bool(level >= 1 and (y[level] - y[0] > enough or power < 0))
    return (float(10 ** np.median(ends)), rising) if 2 * rising > len(ends) else (0.0, rising)


def _longest(binned: Binned) -> float:
    """The longest ramp in s after which all curves are still long enough."""
    last = [binned.log_time[end - MIN_BINS - 1] for begin, end in pairwise(binned.bounds) if end - begin > MIN_BINS]
    return float(10 ** np.min(last) / DROPPED) if len(last) == binned.bounds.size - 1 else 0.0


def _lifted(data: Gathered, binned: Binned, ramp: Ramp, time: Floats) -> Floats:
    return binned.log_modulus + data.kind.stiffness_power * ramp.lift(time)


def _likeliest(problem: _Problem, plain: Fitted) -> Ramp | None:
    """The duration of the highest likelihood near a fit without a ramp, to first order; None if none is more likely than no ramp."""
    points, time, state = problem.points, problem.time, plain.state
    durations = np.geomspace(problem.shortest, problem.longest, TRIED)
    ages = np.stack([Ramp(each, 0.0, False).log_age(time) for each in durations.tolist()], axis=1)
    along, square = _projected(points, plain.prior, state, state.parts.sides[0][:, None] * (ages - points.log_time[:, None]))
    gain = (2 * along - square) / correlation(points, state)
    best = int(np.argmax(gain))
    return Ramp(float(durations[best]), 0.0, False) if gain[best] > 0 else None


def _settled(problem: _Problem, ramp: Ramp, shift: Floats, spline: Spline | None, anchor: int) -> tuple[Ramp, float, float]:
    """The likeliest ramp, from one near it on, with the criterion of its fit, and how many of its points count as one.

    `shift` (m,), relative to the curve `anchor`, and `spline` are those of a fit near it.
    """
    points, time, power = problem.points, problem.time, problem.data.kind.stiffness_power
    known: tuple[Prior, State] | None = None
    for _ in range(ITERATIONS):
        target = points.log_modulus + power * ramp.lift(time)
        if spline is not None:
            target = target - ramp.excess(spline, shift[points.curve], time, power)
        moved = replace(points, log_time=ramp.log_age(time), log_modulus=target)
        if known is None:
            fitted = best_fit(moved, [shift], anchor, problem.vertical, problem.drift)
            state, prior, score = fitted.state, fitted.prior, fitted.score
        else:
            prior, state = known
            state = assemble(moved, state.theta, prior, state.weights, state.spacing)
            state, prior, score = converge(moved, prior, state)
        shift, spline, first, known = state.theta[: points.curves], state.splines[0], spline is None, (prior, state)
        next_ramp = replace(ramp, duration=ramp.duration * np.exp(CHANGE))
        change = state.parts.sides[0] * (next_ramp.log_age(time) - moved.log_time) - power * (
            next_ramp.lift(time) - ramp.lift(time)
        )
        along, square = (float(each[0]) for each in _projected(moved, prior, state, change[:, None] / CHANGE))
        repeated = correlation(moved, state)
        stderr = np.sqrt(repeated / max(square, 1e-300))
        ramp = replace(ramp, stderr=float(stderr))
        step = float(np.clip(along / max(square, 1e-300), -LONGEST_STEP, LONGEST_STEP))
        if not first and abs(step) < CONVERGED * stderr:
            break
        moving = float(np.clip(ramp.duration * np.exp(step), problem.shortest, problem.longest))
        ramp = replace(ramp, duration=moving)
    return ramp, score, repeated


def _projected(points: FitPoints, prior: Prior, state: State, change: Floats) -> tuple[Floats, Floats]:
    """Weighted products (k,) of the residuals with the `change` (n, k) of the values for unit steps of k further parameters, and
    squares (k,) of these changes, less what all other parameters explain.
    """
    parts, weight, m = state.parts, state.weights.weight, points.curves
    weighted = weight[:, None] * change
    of_curves = np.stack([parts.curves.gather(parts.curves.basis * column) for column in weighted.T], axis=1)
    sums = [
        np.stack([np.bincount(points.curve, side * column, minlength=m) for column in weighted.T], axis=1) for side in parts.sides
    ]
    answer = parts.inverse @ of_curves
    others = (np.concatenate(sums) - parts.cross.T @ answer)[prior.free]
    explained = np.sum(of_curves * answer, axis=0) + np.sum(others * np.linalg.solve(state.normal, others), axis=0)
    return np.asarray(weighted.T @ state.residual), np.asarray(np.sum(weighted * change, axis=0) - explained)
