"""A ramp that was left in tests over time: found by its likelihood, and taken out.

A load that grows evenly up to the time T leaves, at the time t, the mean of the modulus (or the compliance) over the ages of its
parts, where the response is read over the load of the moment; read over the last load, it is smaller by t/T during the ramp. To
first order, the mean is the value at the mean log age (`dielast.material.ramp`). What is left is of second order, and follows from
the fitted smooth curve. So a fit with a ramp is that of other times, and T is one more parameter, the same in all tests, for Gauss
and Newton's iteration.

Curves that do not superpose for another reason may bend alike. So a ramp is taken out only if there are readings before twice its
duration, which stand for none after a step; a shorter one is named, for the user to state. As the effect of a ramp has no free
size, most misfits are none: the two hypotheses, no ramp or one of any duration, are compared by their posterior probabilities (R.
E. Kass and A. E. Raftery, J. Am. Stat. Assoc. 90 (1995) 773, with Laplace's approximation for T); where residuals are correlated,
so many points count as one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np

from dielast.base.errors import InputError, NumericsError, warn, without_warnings
from dielast.material.ramp import DROPPED, mean_log_age, time_of_age
from dielast.numerics.arrays import Floats, Index
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.binning import Binned
from dielast.relaxation.superposition.effects import Drift
from dielast.relaxation.superposition.gather import MIN_BINS, Gathered
from dielast.relaxation.superposition.joint_fit import Fitted, best_fit, converge
from dielast.relaxation.superposition.joint_problem import State
from dielast.relaxation.superposition.overlap import starting_shifts, steepest
from dielast.relaxation.superposition.points import FitPoints, points_of
from dielast.relaxation.superposition.spline import Spline

SIGNIFICANT = 4.0  # standard errors of a significant rise
SHORTEST = 0.01  # of the first time: no shorter ramp is looked for
TRIED = 40  # durations at which the likelihood is tried, before the iteration
SURE = 0.95  # probability from which on a ramp is named,
NEEDED = float(2 * np.log(SURE / (1 - SURE)))  # and gain of -2 ln likelihood that one of known duration needs for it
ITERATIONS = 8
WIDEST, HALVINGS = 0.1, 6  # of the steps that are halved
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
        return np.asarray(mean_log_age(time, self.duration) / np.log(10))

    def lift(self, time: Floats) -> Floats:
        """log10 of the last load over that of the moment, if values are read over the last one."""
        return np.log10(self.duration / np.minimum(time, self.duration)) if self.over_last else np.zeros(time.size)

    def excess(self, spline: Spline, shift: Floats, time: Floats, power: int) -> Floats:
        """What the mean over the ages is in log10 above the value at the mean log age (n,), for curves that the `spline`, log
        modulus over log reduced time, describes after shifts (n,). The mean is that of a `power` of the modulus.
        """
        within = np.minimum(time, self.duration)
        ages = (time - within)[:, None] + within[:, None] * _AGES
        value = power * spline.extended((np.log10(ages) - shift[:, None]).ravel()).reshape(ages.shape)
        return np.asarray(np.log10(10**value @ _SHARES) / power - spline.extended(self.log_age(time) - shift))


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The curves of a search for a ramp, and arguments of `best_fit`; no ramp is longer than `longest` s.

    A point is the mean of readings at the times `reading` (r,) in s; `owner` (r,) is the point of a reading.
    """

    data: Gathered
    points: FitPoints
    vertical: bool
    drift: Drift | None
    longest: float
    reading: Floats
    owner: Index

    @classmethod
    def of(cls, data: Gathered, binned: Binned, vertical: bool, drift: Drift | None) -> Self:
        """The search for a ramp in all curves."""
        used = binned.bin_of_point >= 0
        return cls(data, points_of(binned), vertical, drift, _longest(binned), data.abscissa[used], binned.bin_of_point[used])

    @property
    def time(self) -> Floats:
        """Times (n,) in s."""
        return np.asarray(10**self.points.log_time)

    @property
    def shortest(self) -> float:
        """The shortest ramp that is looked for, in s."""
        return SHORTEST * float(np.min(self.time))

    def log_age(self, ramp: Ramp) -> Floats:
        """Mean log10 of the ages (n,) of the parts of a `ramp`."""
        return self._mean(ramp.log_age(self.reading))

    def lift(self, ramp: Ramp) -> Floats:
        """log10 (n,) of the modulus over the load of the moment, over that as measured after a `ramp`."""
        return self.data.kind.stiffness_power * self._mean(ramp.lift(self.reading))

    def _mean(self, values: Floats) -> Floats:
        return np.asarray(np.bincount(self.owner, values) / np.bincount(self.owner))


@dataclass(frozen=True, slots=True, eq=False)
class FoundRamp:
    """A ramp that is left in the curves: its `duration` in s, rounded by less than half of its standard error, the `stderr` of its
    logarithm, and the shifts and vertical shifts `theta` (2m,) of the fit with it.
    """

    duration: float
    stderr: float
    theta: Floats

    def covariance(self, state: State) -> Floats:
        """The covariance (2m, 2m) of shifts and vertical shifts due to the error of the duration, if the ramp is taken out of the
        points: a longer one makes all ages smaller, early ones most.
        """
        m, free = state.points.curves, state.prior.free
        time = time_of_age(10**state.points.log_time, self.duration)
        later = mean_log_age(time, self.duration * np.exp(CHANGE)) - mean_log_age(time, self.duration)
        _, across = _weighed(state, (state.sides[0] * later / np.log(10) / CHANGE)[:, None])
        moved = np.zeros(3 * m)
        moved[free] = np.linalg.solve(state.normal, across)[:, 0]
        return self.stderr**2 * np.outer(moved[: 2 * m], moved[: 2 * m])

    def doubt(self, anchor: int, state: State) -> Floats:
        """The covariance (2m, 2m) of shifts and vertical shifts relative to the curve `anchor`, if the ramp may be there or not and
        is left in, as in a fit with the `state`.
        """
        moved = (self.theta - state.theta[: self.theta.size]).reshape(2, -1)
        relative = (moved - moved[:, [anchor]]).ravel()
        return np.outer(relative, relative)


def find_ramp(data: Gathered, binned: Binned, plain: Fitted | None, vertical: bool, drift: Drift | None) -> FoundRamp | None:
    """The ramp that is left in the curves, None if it is not sure that there is one.

    `plain` is the `best_fit` without a ramp, None if there is no such fit; `vertical` and `drift` are its arguments.
    """
    problem = _Problem.of(data, binned, vertical, drift)
    if problem.longest <= problem.shortest:
        return None
    found: list[tuple[Ramp, Fitted]] = []
    if plain is not None and (begin := _likeliest(problem, plain)) is not None:
        found.append(_most_likely(problem, begin, plain))
    if (rise := _rise(data, binned)) is not None:
        begin = Ramp(min(rise[0], problem.longest), 0.0, True)
        moved = replace(binned, log_time=problem.log_age(begin), log_modulus=binned.log_modulus + problem.lift(begin))
        try:
            anchor = steepest(moved)
            shift = starting_shifts(data.temperature, moved, anchor, data.kind)
            with without_warnings():
                found.append((begin, _fit(problem, _moved(problem, begin, shift, None), shift, anchor)))
        except (InputError, NumericsError, np.linalg.LinAlgError):
            pass  # a ramp does not explain why the curves do not overlap
    best, least = None, np.inf if plain is None else plain.score
    for begin, fitted in found:
        try:
            with without_warnings():
                trial, bare = _settled(problem, begin, fitted)
        except (InputError, NumericsError, np.linalg.LinAlgError):
            continue
        gain = (min(least, bare) - trial.score) / trial.state.repeated
        # a duration that the curves do not determine is anywhere in its range
        known = min(np.sqrt(2 * np.pi) * trial.ramp.stderr / np.log(problem.longest / problem.shortest), 1.0)
        if np.isfinite(trial.ramp.stderr) and gain + 2 * np.log(known) > NEEDED:
            best, least = trial, trial.score
    if best is None:
        return None
    duration, stderr = best.ramp.duration, best.ramp.stderr
    theta = best.state.theta[: 2 * problem.points.curves]
    return FoundRamp(round(duration, -int(np.floor(np.log10(duration * stderr)))), stderr, theta)


def after_step(data: Gathered, binned: Binned, fitted: Fitted) -> Binned:
    """The averages of tests whose ramps are taken out as after a step to second order, by the smooth curve `fitted` to them."""
    first = np.searchsorted(binned.bin_of_point, np.arange(binned.curve.size), sorter=(order := np.argsort(binned.bin_of_point)))
    duration, shift = data.ramp[order[first]], fitted.state.theta[binned.curve]
    values = binned.log_modulus.copy()
    for each in np.unique(duration[duration > 0]).tolist():
        own = duration == each
        time = time_of_age(10 ** binned.log_time[own], each)
        values[0, own] -= Ramp(each, 0.0, False).excess(fitted.state.splines[0], shift[own], time, data.kind.stiffness_power)
    return replace(binned, log_modulus=values)


def left_out(duration: float, data: Gathered) -> bool:
    """Whether there are readings too early to stand for those after a step, with a ramp of a `duration` in s."""
    return bool(np.min(data.abscissa) < DROPPED * duration)


def warn_of_ramp(duration: float, data: Gathered, *, taken_out: bool, lost: Sequence[float] = ()) -> None:
    """Name a ramp that was found; if it is `taken_out`, with the temperatures in degC of curves that are `lost` by that."""
    step, stated = data.kind.step, f'ramp = "{duration:.6g} s"'
    bend = f"all curves bend as after a ramp of the {step} of {duration:.6g} s"
    if not taken_out:
        why = "the rest of the curves has no overlap" if left_out(duration, data) else "they begin late after it"
        warn(
            f"{bend}, or do not superpose; as {why}, times are those after a step, and the standard errors allow for either: state "
            f'{stated} if the {step} took that long, or ramp = "0 s" if it did not'
        )
        return
    gone = f", and with them the test at {', '.join(f'{at:g}' for at in lost)} degC" if lost else ""
    warn(
        f"{bend}, which is taken out: times are mean log ages of its parts, points before {DROPPED * duration:.3g} s are left "
        f'out{gone}; state {stated}, or ramp = "0 s" if there is none'
    )


def warn_if_modulus_rises(data: Gathered, binned: Binned) -> None:
    """Warn if at most temperatures the modulus rises at first: no relaxation modulus does."""
    if data.kind.stiffness_power < 0 or (rise := _rise(data, binned)) is None:
        return
    time, curves = rise
    warn(
        f"at {curves} of {data.temperature.size} temperatures the {data.kind.value} rises up to about {time:.2g} s, which "
        f"no step of {data.kind.step} does: state the time in which the {data.kind.step} was applied, such as ramp = "
        f'"{time:.1g} s": times are then mean log ages of the {data.kind.step}, and points of the ramp are left out; until '
        "then, neither shift factors nor the law are to be trusted"
    )


def _rise(data: Gathered, binned: Binned) -> tuple[float, int] | None:
    """The time in s up to which values rise at first as only those over a last load do, and the number of curves in which they do;
    None if they do not in most of the curves.

    A modulus rises then, and a compliance rises as fast as time or faster: after a step it is concave over time.
    """
    ends, rising, power = [], 0, data.kind.stiffness_power
    for first, last in pairwise(binned.bounds.tolist()):
        x, y = binned.log_time[first:last], power * binned.log_modulus[0, first:last]
        noise = robust_deviation(np.diff(y, 2)) / np.sqrt(6)  # of a point, from the bends between three
        y = y if power > 0 else y - x
        high = np.flatnonzero(y >= np.max(y) - noise)
        level = high[0] if power > 0 else high[-1]  # a compliance may rise just as fast as time
        ends.append(x[level])
        rising += bool(level >= 1 and (power < 0 or y[level] - y[0] > SIGNIFICANT * np.sqrt(2) * noise))
    return (float(10 ** np.median(ends)), rising) if 2 * rising > len(ends) else None


def _longest(binned: Binned) -> float:
    """The longest ramp in s after which all curves are still long enough."""
    last = [binned.log_time[end - MIN_BINS - 1] for begin, end in pairwise(binned.bounds) if end - begin > MIN_BINS]
    return float(10 ** np.min(last) / DROPPED) if len(last) == binned.bounds.size - 1 else 0.0


def _likeliest(problem: _Problem, plain: Fitted) -> Ramp | None:
    """The ramp of the highest likelihood near a fit without one, to first order; None if not even one of known duration would be
    sure.
    """
    state = plain.state
    durations = np.geomspace(problem.shortest, problem.longest, TRIED)
    ages = np.stack([problem.log_age(Ramp(each, 0.0, False)) for each in durations.tolist()], axis=1)
    along, square = _projected(state, state.sides[0][:, None] * (ages - state.points.log_time[:, None]))
    gain = (2 * along - square) / state.repeated
    best = int(np.argmax(gain))
    return Ramp(float(durations[best]), 0.0, False) if gain[best] > NEEDED else None


def _most_likely(problem: _Problem, begin: Ramp, plain: Fitted) -> tuple[Ramp, Fitted]:
    """The likeliest of ramps of the duration of `begin` or 2, 4, 8... times that, and its fit: there are several maxima."""
    octaves = int(np.log2(problem.longest / begin.duration))
    tried = [replace(begin, duration=begin.duration * 2.0**k) for k in range(octaves + 1)]
    shift, spline = plain.state.theta[: problem.points.curves], plain.state.splines[0]
    fits = [_fit(problem, _moved(problem, each, shift, spline), shift, plain.anchor) for each in tried]
    return min(zip(tried, fits, strict=True), key=lambda each: each[1].score)


def _moved(problem: _Problem, ramp: Ramp, shift: Floats, spline: Spline | None) -> FitPoints:
    """The points as after a step instead of the `ramp`; of second order by the `spline` with shifts (m,), if there is one."""
    points, target = problem.points, problem.points.log_modulus + problem.lift(ramp)
    if spline is not None:
        target = target - ramp.excess(spline, shift[points.curve], problem.time, problem.data.kind.stiffness_power)
    return replace(points, log_time=problem.log_age(ramp), log_modulus=target)


def _fit(problem: _Problem, moved: FitPoints, shift: Floats, anchor: int) -> Fitted:
    return best_fit(moved, [shift], anchor, problem.vertical, problem.drift)


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """The fit for a ramp, with Akaike's criterion as `score`; the next `step` of the logarithm of the duration."""

    ramp: Ramp
    state: State
    score: float
    step: float

    @classmethod
    def of(cls, problem: _Problem, ramp: Ramp, state: State) -> Self:
        """The fit near a `state` of the fit for another ramp."""
        moved = _moved(problem, ramp, state.theta[: problem.points.curves], state.splines[0])
        state, score = converge(state.of_points(moved))
        longer = replace(ramp, duration=ramp.duration * np.exp(CHANGE))
        later, higher = problem.log_age(longer) - moved.log_time, problem.lift(longer) - problem.lift(ramp)
        change = (state.sides[0] * later - higher) / CHANGE
        (along,), (square,) = _projected(state, change[:, None])
        step = float(np.clip(along / square, -LONGEST_STEP, LONGEST_STEP))
        return cls(replace(ramp, stderr=float(np.sqrt(state.repeated / square))), state, score, step)

    def moved(self, problem: _Problem, step: float) -> Self:
        """The fit for another duration, by a `step` of its logarithm."""
        duration = float(np.clip(self.ramp.duration * np.exp(step), problem.shortest, problem.longest))
        return self.of(problem, replace(self.ramp, duration=duration), self.state)


def _settled(problem: _Problem, ramp: Ramp, fitted: Fitted) -> tuple[_Trial, float]:
    """The likeliest ramp, from one near it with its fit on, and the criterion of a fit without a ramp and with the same knots.

    The likelihood has a cusp where the ramp ends at a reading: where the iteration is caught by one, steps are halved instead.
    """
    trial = _Trial.of(problem, ramp, fitted.state)
    for _ in range(ITERATIONS):
        if abs(trial.step) < CONVERGED * trial.ramp.stderr:
            break
        trial = trial.moved(problem, trial.step)
    else:
        for k in range(HALVINGS):
            others = [trial.moved(problem, sign * 2.0**-k * WIDEST) for sign in (-1, 1)]
            trial = min(trial, *others, key=lambda each: each.score)
    _, bare = converge(trial.state.of_points(problem.points))
    return trial, bare


def _projected(state: State, change: Floats) -> tuple[Floats, Floats]:
    """Weighted products (k,) of the residuals with the `change` (n, k) of the values for unit steps of k further parameters, and
    squares (k,) of these changes, less what all other parameters explain.
    """
    weighted = state.weights.weight[:, None] * change
    square, others = _weighed(state, change)
    square = square - np.sum(others * np.linalg.solve(state.normal, others), axis=0)
    return np.asarray(weighted.T @ state.residual), square


def _weighed(state: State, change: Floats) -> tuple[Floats, Floats]:
    """Weighted squares (k,) of the `change` (n, k) of the values for unit steps of k further parameters, and products (p, k) with
    those for the free parameters, both less what the smooth curves explain.
    """
    points = state.points
    weighted = state.weights.weight[:, None] * change
    of_curves = np.stack([state.curves.gather(state.curves.basis * column) for column in weighted.T], axis=1)
    sums = [[np.bincount(points.curve, side * column, minlength=points.curves) for column in weighted.T] for side in state.sides]
    answer = state.inverse @ of_curves
    others = (np.concatenate(np.swapaxes(sums, 1, 2)) - state.cross.T @ answer)[state.prior.free]
    return np.asarray(np.sum(weighted * change, axis=0) - np.sum(of_curves * answer, axis=0)), others
