"""A relaxation spectrum by non-negative least squares on the relative error, as smooth as the data ask for.

Minimised is sum_i w_i (G_model(t_i)/G_i - 1)^2 + s^2 |D b|^2 over moduli mu_k >= 0 on given relaxation times and, unless it is
given, the equilibrium modulus. D takes second differences of the strengths b_k = mu_k / G(tau_k): the moduli span many decades,
but relative to the curve where they act they are of one order. The smoothing s is the one of least generalised cross-validation
(Golub, Heath and Wahba 1979, DOI 10.1080/00401706.1979.10489751), with the moduli held at zero taken out of the trace.

An orthogonal reduction first takes the n points to as many rows as there are unknowns, so that a trial of s does not depend on n.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dielast.errors import NumericsError

Array = NDArray[np.float64]

_COARSE = np.geomspace(1e-6, 1e2, 17)  # trials of s, besides 0; a finer look around the best follows
_FINER = 10 ** np.array([-0.25, 0.25])
_EVEN = 0.02  # scores closer than this are a draw, which the smoother spectrum wins: cross-validation alone now and then fits noise
_HELD = 1e4  # weight of a prescribed sum of moduli, in units of all points together
_CELL = 0.05  # decades over which points are averaged for placing the relaxation times
_WORTHWHILE = 0.98  # of the misfit: a move of the relaxation times must bring it below this, so that noise does not drive it


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Points of a shear relaxation curve: `time` s, `modulus` Pa and `weight`, all of shape (n,), times ascending."""

    time: Array
    modulus: Array
    weight: Array

    def averaged(self) -> Curve:
        """The curve with one point for each 0.05 decade that holds any: the log means there, and the weights' sum."""
        x = np.log10(self.time)
        cell = np.unique(np.floor((x - x[0]) / _CELL + 1e-6), return_inverse=True)[1]  # not at the mercy of rounding
        weight = np.bincount(cell, self.weight).astype(float)
        time, modulus = (10 ** (np.bincount(cell, self.weight * y) / weight) for y in (x, np.log10(self.modulus)))
        return Curve(time, modulus, weight)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Moduli in Pa of shape (branches,), equilibrium modulus in Pa and the smoothing s that was chosen."""

    shear_modulus: Array
    equilibrium_modulus: float
    smoothing: float


def fit_moduli(
    curve: Curve, relaxation_time: Array, equilibrium_modulus: float | None = None, total: float | None = None
) -> Solution:
    """Moduli on `relaxation_time` (s, shape (branches,)); every modulus is shear, in Pa.

    `equilibrium_modulus` None makes it an unknown; `total`, if given, is the sum of the moduli. `NumericsError` if the active set
    does not settle.
    """
    branches = relaxation_time.size
    scale = np.exp(np.interp(np.log(relaxation_time), np.log(curve.time), np.log(curve.modulus)))
    design, target = _relative_rows(curve, relaxation_time, scale, equilibrium_modulus)
    unknowns = design.shape[1]
    rows, values = _reduced(design, target, curve.weight)
    # Points of equal scatter but unequal weight: crowded ones follow their noise less, hence the weight squared in the trace.
    twice_weighted = design * curve.weight[:, None]
    influence = twice_weighted.T @ twice_weighted
    count = float(curve.weight.sum())
    if total is not None:
        held = np.zeros((1, unknowns))
        held[0, :branches] = scale / total
        rows, values = np.vstack([rows, _HELD * np.sqrt(count) * held]), np.append(values, _HELD * np.sqrt(count))
    roughness = np.zeros((max(branches - 2, 0), unknowns))
    roughness[:, :branches] = np.diff(np.eye(branches), n=2, axis=0)
    padded = np.concatenate([values, np.zeros(len(roughness))])

    def trial(smoothing: float) -> tuple[float, Array]:
        stacked = np.vstack([rows, smoothing * roughness])
        strength, _ = _non_negative(stacked, padded)
        free = strength > 0
        normal = stacked[:, free].T @ stacked[:, free]
        trace = float(np.trace(np.linalg.lstsq(normal, influence[np.ix_(free, free)], rcond=None)[0]))
        spare = 1 - trace / count
        return (float(np.sum((rows @ strength - values) ** 2)) / spare**2 if spare > 1e-6 else np.inf), strength

    trials = {smoothing: trial(smoothing) for smoothing in [0.0, *_COARSE]}
    best = min(trials, key=lambda smoothing: trials[smoothing][0])
    trials |= {smoothing: trial(smoothing) for smoothing in best * _FINER if best > 0}
    least = min(score for score, _ in trials.values())
    best = max(smoothing for smoothing, (score, _) in trials.items() if score <= (1 + _EVEN) * least)
    strength = trials[best][1]
    equilibrium = float(strength[-1] * curve.modulus[-1]) if equilibrium_modulus is None else equilibrium_modulus
    return Solution(strength[:branches] * scale, equilibrium, float(best))


def place_relaxation_times(
    curve: Curve, branches: int, shortest: float, longest: float, movable: tuple[bool, bool], equilibrium_modulus: float | None
) -> Array:
    """Log-spaced relaxation times (s) of shape (branches,), slowest first, between `shortest` and `longest`.

    An end that is `movable` (shortest, longest) is taken inwards, by fractions of the spacing, to where the curve is met best: a
    regular row of exponentials serves a curve best when its outermost members stand a little inside it.
    """
    low, high = np.log10(shortest), np.log10(longest)
    intervals = max(branches - 1, 1)
    spacing = (high - low) / intervals
    coarse = curve.averaged()

    def times(inset: tuple[float, float]) -> Array:
        return np.logspace(high - inset[1] * spacing, low + inset[0] * spacing, branches)

    def misfit(inset: tuple[float, float]) -> float:
        design, target = _relative_rows(coarse, times(inset), np.full(branches, coarse.modulus[-1]), equilibrium_modulus)
        return _non_negative(*_reduced(design, target, coarse.weight))[1]

    # One branch alone has no spacing to keep: its time is sought over the whole range, and to many digits.
    alone = branches == 1
    furthest = (0.0, float(any(movable))) if alone else tuple(min(2.0, 0.4 * intervals) * end for end in movable)
    finest, step = 1e-7 if alone else 0.1, max(furthest) / 4
    trials = sorted(product(*(np.linspace(0.0, end, 5 if end else 1).tolist() for end in furthest)), key=sum)  # widest range first
    inset, least = (0.0, 0.0), np.inf
    while step >= finest:
        improved = False
        for trial in trials:
            inside = all(0 <= own <= end for own, end in zip(trial, furthest, strict=True))
            if inside and (score := misfit(trial)) < _WORTHWHILE * least:
                inset, least, improved = trial, score, True
        step = step if improved else step / 2
        trials = [(inset[0] + step * shorter, inset[1] + step * longer) for shorter, longer in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    return times(inset)


def _relative_rows(curve: Curve, relaxation_time: Array, scale: Array, equilibrium_modulus: float | None) -> tuple[Array, Array]:
    """Design matrix and target of the relative error G_model/G - 1, in the unknowns mu_k/scale_k and mu_eq/G(last)."""
    design = np.exp(-curve.time[:, None] / relaxation_time) * scale / curve.modulus[:, None]
    if equilibrium_modulus is None:
        return np.column_stack([design, curve.modulus[-1] / curve.modulus]), np.ones(curve.time.size)
    return design, 1 - equilibrium_modulus / curve.modulus


def _reduced(design: Array, target: Array, weight: Array) -> tuple[Array, Array]:
    """The weighted least-squares problem in at most as many rows as it has unknowns, and one."""
    triangle = np.asarray(np.linalg.qr(np.column_stack([design, target]) * np.sqrt(weight)[:, None], mode="r"))
    return triangle[:, :-1], triangle[:, -1]


def _non_negative(rows: Array, values: Array) -> tuple[Array, float]:
    """Non-negative least-squares solution and the norm of its residual."""
    from scipy.optimize import nnls

    try:
        solution, residual = nnls(rows, values, maxiter=100 * rows.shape[1])
    except RuntimeError as reason:
        raise NumericsError(
            f"non-negative least squares did not settle with {rows.shape[1]} unknowns: take fewer branches"
        ) from reason
    return solution, float(residual)
