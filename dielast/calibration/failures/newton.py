"""Newton's method for the maxima of many likelihoods at once, damped as by Levenberg and Marquardt, within bounds by projection
(Bertsekas 1982, DOI 10.1137/0320018).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

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
