"""Fits of failure models: the most likely coordinates from many starts at once, and Wald's standard errors.

The maxima of many likelihoods are found together by Newton's method, damped as by Levenberg and Marquardt, within bounds by
projection (Bertsekas 1982, DOI 10.1137/0320018).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError, NumericsError
from dielast.calibration.failures.likelihood import Anchored, FailureModel, Mixed, Seen
from dielast.io.result import Result
from dielast.numerics.arrays import Cases, Flags, Floats

MOST_ITERATIONS = 200
SETTLED, ROUNDING = 1e-16, 1e-8  # of the log likelihood: an expected gain at which a fit ends, and what sums may lose
FIRST, FALL, RISE, LEAST, MOST = 1e-3, 0.1, 6.0, 1e-14, 1e12  # damping
LONGEST = 3.0  # step of a coordinate

Function = Callable[[Floats, Cases], tuple[Floats, Floats, Floats]]
"""Values (k,), gradients (k, p) and second derivatives (k, p, p) at coordinates (k, p) of the problems (k,); a value that is not
finite is one that cannot be reached.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Maxima:
    """The maxima: `at` (fits, p), `value` (fits,), `gradient` (fits, p), `hessian` (fits, p, p) and which have `settled`
    (fits,).
    """

    at: Floats
    value: Floats
    gradient: Floats
    hessian: Floats
    settled: Flags


def maximise(function: Function, start: Floats, bounds: tuple[Floats, Floats], fixed: Flags | None = None) -> Maxima:
    """Maxima from `start` (fits, p) within the bounds, each (p,); those that are `fixed` (fits, p) or (p,) keep their value."""
    count, size = start.shape
    held = np.zeros((count, size), dtype=bool) if fixed is None else np.broadcast_to(fixed, start.shape)
    at = np.where(held, start, np.clip(start, *bounds))
    value, gradient, hessian = function(at, np.arange(count))
    damping, settled = np.full(count, FIRST), ~np.isfinite(value)
    diagonal = np.arange(size)
    for _ in range(MOST_ITERATIONS):
        run = np.flatnonzero(~settled)
        if not run.size:
            break
        x, slope = at[run], gradient[run]
        stopped = held[run] | ((x <= bounds[0]) & (slope < 0)) | ((x >= bounds[1]) & (slope > 0))
        free = ~stopped
        curved = np.where(free[:, :, None] & free[:, None, :], -hessian[run], 0.0)
        scale = np.sqrt(np.maximum(np.abs(curved[:, diagonal, diagonal]), 1e-12))
        curved = curved / (scale[:, :, None] * scale[:, None, :])
        # where the likelihood is not concave, its curvatures count by their magnitudes
        roots, axes = np.linalg.eigh(curved)
        stiff = np.maximum(np.abs(roots), 1e-9) + damping[run, None]
        right = np.where(free, slope, 0.0) / scale
        step = np.einsum("kij,kj->ki", axes, np.einsum("kji,kj->ki", axes, right) / stiff) / scale
        most = LONGEST / np.maximum(damping[run, None], 1.0)  # which damping shortens also where there is no curvature
        trial = np.where(free, np.clip(x + np.clip(step, -most, most), *bounds), x)
        new_value, new_gradient, new_hessian = function(trial, run)
        expected = np.sum(np.where(free, slope, 0.0) * (trial - x), axis=1)
        with np.errstate(invalid="ignore"):
            # gains below the rounding of the sums are those of the slope
            better = (new_value > value[run]) | ((np.abs(expected) < ROUNDING) & (new_value > value[run] - ROUNDING))
        ended = (np.abs(expected) <= SETTLED) & (np.all(roots > -1e-7, axis=1) | (damping[run] >= 1.0))
        taken = run[better]
        at[taken], value[taken] = trial[better], new_value[better]
        gradient[taken], hessian[taken] = new_gradient[better], new_hessian[better]
        damping[run] = np.clip(damping[run] * np.where(better, FALL, RISE), LEAST, MOST)
        settled[run] = ended | (damping[run] >= MOST)
    return Maxima(at, value, gradient, hessian, settled & np.isfinite(value))


START_SLOPES, START_SHAPES = (1.0, 3.0, 8.0, 20.0, 50.0), (0.7, 2.0, 6.0, 20.0)
FLAT = 1e-10  # curvature, over those along the coordinates, of a direction in which the likelihood is level but for rounding


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Estimate(Result):
    """The maximum of a likelihood: coordinates `at` (p,), the log likelihood `value`, `hessian` (p, p); `fixed` (p,) coordinates
    are known.
    """

    model: FailureModel
    at: Floats
    value: float
    hessian: Floats
    fixed: Flags
    settled: bool = True
    """Whether it is a maximum; False where the likelihood rises or stays equal without end."""

    @property
    def free(self) -> Cases:
        """The coordinates that are not known."""
        return np.flatnonzero(~self.fixed)

    @property
    def covariance(self) -> Floats:
        """The inverse (p, p) of the observed information, 0 for known coordinates; NaN if it is not positive definite, beyond its
        rounding.
        """
        result = np.zeros((self.at.size, self.at.size))
        inside = np.ix_(self.free, self.free)
        information = -self.hessian[inside]
        scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
        scaled = information / np.outer(scale, scale)
        known = np.all(np.linalg.eigvalsh(scaled) > FLAT)
        result[inside] = np.linalg.inv(scaled) / np.outer(scale, scale) if known else np.nan
        return result

    @property
    def standard_error(self) -> Floats:
        """Standard errors (p,), NaN where the likelihood has no maximum in the inside."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def share_known(self) -> float:
        """(n - p)/n for n specimens, failed or not, and p coordinates, by which likelihood ratios W count in intervals and draws.

        For few specimens W is larger than chi-squared. In a regression with normal errors, where it is n ln(1 + t^2/(n - p)), the
        factor is right for small t and many specimens; for censored specimens of other scatter it is not derived. It was chosen
        among four because its intervals held the truth of synthetic laboratories closest to their level: those of
        `tests/bench/bench_lifetime.py`, which says how often they do, and which is thus no independent check of the choice.
        """
        n = self.model.observations.seen.size
        return max(n - self.free.size, 1) / n

    @property
    def aic(self) -> float:
        """Akaike's criterion."""
        return 2 * self.free.size - 2 * self.value


def starts_of(model: FailureModel) -> Floats:
    """Starts (k, p): a grid of slopes and shapes, each with the location at the mean exposure of the failures."""
    q = len(model.exposure.slopes)
    shapes = np.array(START_SHAPES)
    of_slopes: list[list[list[float]]] = [[[]], [[s] for s in START_SLOPES], [[a, 0.0] for a in (-1.0, 0.0, 1.0)]]
    grid = np.array([np.append(slope, -np.log(shape)) for slope in of_slopes[q] for shape in shapes])
    slope, failed = grid[:, :q], model.observations.seen != Seen.SUSPENDED
    y = model.exposure.at(slope).y[:, : failed.size]
    known = np.isfinite(y) & failed
    known = np.where(known.any(axis=1, keepdims=True), known, np.isfinite(y))
    mean = np.where(known, np.where(np.isfinite(y), y, 0.0), 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    location = model.location
    own = np.zeros((len(grid), len(location.names)))
    if isinstance(location, Anchored):
        own[:, 0] = location.ageing.field_of(mean - np.log(location.time), slope[:, 0])
    elif isinstance(location, Mixed):
        own[:, : len(location.nodes)] = mean[:, None]
    return np.concatenate((own, grid), axis=1)


def estimate(model: FailureModel, known: Mapping[str, float] | None = None) -> Estimate:
    """The most likely coordinates; those `known` by name are not fitted.

    Raises `InputError` for fewer failures than coordinates, and `NumericsError` if no start has a likelihood.
    """
    start, fixed = starts_of(model), np.zeros(len(model.names), dtype=bool)
    for name, value in (known or {}).items():
        index = model.names.index(name)
        start[:, index], fixed[index] = value, True
    failures = model.observations.failures
    free = [name for name, is_fixed in zip(model.names, fixed, strict=True) if not is_fixed]
    if failures < len(free):
        raise InputError(f"{len(free)} parameters ({', '.join(free)}) need as many failures, not {failures}")

    found = maximise(lambda at, _: model.function(at), start, model.bounds, fixed)
    if not np.isfinite(found.value).any():
        raise NumericsError("no start of the fit has a likelihood: do the specimens fail under rising exposures?")
    # of equal maxima, the first: along a level ridge, rounding would choose one
    best = int(np.argmax(found.value > np.max(found.value[np.isfinite(found.value)]) - ROUNDING))
    return Estimate(model, found.at[best], float(found.value[best]), found.hessian[best], fixed, bool(found.settled[best]))


def without_each(fit: Estimate) -> tuple[Maxima, Floats]:
    """The fits without each specimen in turn, from the fit of all, and the log likelihood (n,) of each specimen under the fit of
    the others.
    """
    n = fit.model.observations.seen.size
    weight = 1.0 - np.eye(n)

    def function(at: Floats, fits: Cases) -> tuple[Floats, Floats, Floats]:
        return fit.model.function(at, weight[fits])

    found = maximise(function, np.tile(fit.at, (n, 1)), fit.model.bounds, fit.fixed)
    return found, np.asarray(np.diagonal(fit.model.values(found.at)))
