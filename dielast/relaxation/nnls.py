"""A spectrum by non-negative least squares on the relative error, with the smoothness that the data support.

The sum sum_i w_i (G_model(t_i)/G_i - 1)^2 + s^2 |D b|^2 is minimised over moduli mu_k >= 0 at given relaxation times and, unless
it is prescribed, the equilibrium modulus. For an oscillation, the sum is over storage and loss modulus; for creep, the unknowns are
compliances and the fluidity. D takes second differences of the strengths b_k = mu_k / G(tau_k): the moduli span many decades, but
relative to the curve at their times they are of one order. The smoothing s minimises generalised cross-validation (Golub, Heath and
Wahba 1979, DOI 10.1080/00401706.1979.10489751), with the moduli held at zero excluded from the trace.

An orthogonal reduction first turns the n points into as many rows as there are unknowns, so that the cost of trying a value of s
does not depend on n.
"""

from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np

from dielast.base.errors import NumericsError
from dielast.material.measurement_kind import RELAXATION, MeasurementKind
from dielast.numerics.arrays import Flags, Floats

Known = tuple[float | None, ...]

_COARSE = np.geomspace(1e-6, 1e2, 17)  # trials of s, besides 0, before finer trials around the best
_FINER = 10 ** np.array([-0.25, 0.25])
EVEN = 0.02  # scores that count as equal where the course of a spectrum matters more than the end of its curve
_HELD = 1e4  # weight of a prescribed sum of moduli, in units of the weight of all points
_CELL = 0.05  # decades over which points are averaged for placing the processes
_WORTHWHILE = 0.98  # ratio of misfits below which a change of the times is accepted, so that noise causes none
_SINGULAR = 1e-13  # ratio to the largest singular value below which one is a rounding error
EXACT = 1e-9  # misfit, relative to the curve, below which a fit is exact but for rounding errors, which differ between machines


@dataclass(frozen=True, slots=True, eq=False)
class WeightedCurve:
    """Points of a measurement of a `kind`: `time` in s, ascending, and `weight`, both (n,), and `values` (channels, n).

    Of an oscillation, `time` is 1/omega and the channels are storage and loss; moduli (Pa) and compliances (1/Pa) are shear.
    """

    time: Floats
    values: Floats
    weight: Floats
    kind: MeasurementKind = RELAXATION

    @property
    def size(self) -> Floats:
        """The norm of the values over all channels, (n,)."""
        return self.values[0] if len(self.values) == 1 else np.asarray(np.linalg.norm(self.values, axis=0))

    @property
    def stiffness(self) -> Floats:
        """The modulus, storage modulus or inverse compliance (n,) in Pa."""
        return np.asarray(self.values[0] ** self.kind.stiffness_power)

    @property
    def row_weight(self) -> Floats:
        """The weight of every value, one channel after another, (channels * n,)."""
        return np.tile(self.weight, len(self.values))

    @property
    def constant_scale(self) -> Floats:
        """The scale of each constant, (constants,): that with which it alone would reach the last point, where it acts most."""
        return np.asarray(self.size[-1] / np.max(np.abs(self.kind.constants(self.time[-1:])), axis=(1, 2)))

    def averaged(self) -> Self:
        """The curve with one point for each 0.05 decade with points: their log means and the sum of their weights."""
        x = np.log10(self.time)
        cell = np.unique(np.floor((x - x[0]) / _CELL + 1e-6), return_inverse=True)[1]
        weight = np.bincount(cell, self.weight).astype(float)
        time, *values = (10 ** (np.bincount(cell, self.weight * y) / weight) for y in (x, *np.log10(self.values)))
        return type(self)(time, np.array(values), weight, self.kind)


@dataclass(frozen=True, slots=True)
class Total:
    """A prescribed sum `value` (Pa or 1/Pa) of all processes plus the constants, each multiplied by its factor in `constants`."""

    value: float
    constants: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Strengths of the processes (m,) and the `constants` of the kind, in Pa or 1/Pa, and the chosen smoothing s.

    `objective` is the minimised sum, `misfit` its first part, and `freedom` the number of remaining degrees of freedom, with points
    counted by weight.
    """

    strength: Floats
    constants: Floats
    smoothing: float
    objective: float
    misfit: float
    freedom: float


def fit_strengths(
    curve: WeightedCurve,
    process_time: Floats,
    known: Known,
    total: Total | None = None,
    least: float = 0.0,
    smoothing: float | None = None,
    even: float | None = None,
) -> Solution:
    """Strengths of processes at `process_time` (s, shape (m,)) and the constants; `known` are the prescribed constants, else None.

    `total` prescribes a sum, `least` is the smallest smoothing to try, and `smoothing` prescribes it. Scores closer than the share
    `even` count as equal, and the smoothest fit wins: cross-validation alone sometimes fits noise. By default, this is the noise of
    one degree of freedom: of many points, a share of the score would be many, and all that the fit misses may be at the end of the
    curve. Raises `NumericsError` if the active set does not converge.
    """
    processes = process_time.size
    scale = np.exp(np.interp(np.log(process_time), np.log(curve.time), np.log(curve.size)))
    unknown, constant_scale = _unknown(known), curve.constant_scale
    design, target = relative_rows(curve, process_time, scale, known)
    unknowns = design.shape[1]
    weight = curve.row_weight
    rows, values = reduced_rows(design, target, weight)
    # Points have equal scatter but unequal weight: dense ones follow their noise less, hence the squared weight in the trace.
    influence = np.asarray(np.linalg.qr(design * weight[:, None], mode="r"))
    count = float(weight.sum())
    if total is not None:
        shares = np.array(total.constants)
        others = total.value - sum(share * value for share, value in zip(total.constants, known, strict=True) if value is not None)
        held = np.concatenate([scale, (shares * constant_scale)[unknown]])[None] / others
        rows, values = np.vstack([rows, _HELD * np.sqrt(count) * held]), np.append(values, _HELD * np.sqrt(count))
    roughness = np.zeros((max(processes - 2, 0), unknowns))
    roughness[:, :processes] = np.diff(np.eye(processes), n=2, axis=0)
    padded = np.concatenate([values, np.zeros(len(roughness))])

    def trial(smoothing: float) -> tuple[float, Floats, float]:
        stacked = np.vstack([rows, smoothing * roughness])
        strength, _ = non_negative(stacked, padded)
        free = strength > 0
        # singular values, as normal equations lose too many digits where little freedom is left
        _, size, axes = np.linalg.svd(stacked[:, free], full_matrices=False)
        seen = size > _SINGULAR * np.max(size, initial=0.0)
        spare = 1 - float(np.sum((influence[:, free] @ (axes[seen].T / size[seen])) ** 2)) / count
        return (float(np.sum((rows @ strength - values) ** 2)) / spare**2 if spare > 1e-6 else np.inf), strength, count * spare

    tried = [smoothing for smoothing in [0.0, *_COARSE] if smoothing >= least] if smoothing is None else [smoothing]
    trials = {value: trial(value) for value in tried}
    best = min(trials, key=lambda value: trials[value][0])
    if smoothing is None:
        trials |= {value: trial(value) for value in best * _FINER if value > least}
    least = min(score for score, *_ in trials.values())
    even = float(np.sum(weight**2)) / count**2 if even is None else even
    best = max(value for value, (score, *_) in trials.items() if score <= (1 + even) * least)
    _, strength, freedom = trials[best]
    misfit, rough = float(np.sum((rows @ strength - values) ** 2)), float(np.sum((roughness @ strength) ** 2))
    constants = np.array([0.0 if value is None else value for value in known])
    constants[unknown] = strength[processes:] * constant_scale[unknown]
    return Solution(strength[:processes] * scale, constants, float(best), misfit + best**2 * rough, misfit, freedom)


def place_times(
    curve: WeightedCurve, branches: int, shortest: float, longest: float, movable: tuple[bool, bool], known: Known
) -> Floats:
    """Log-spaced times of processes (s) of shape (branches,), slowest first, between `shortest` and `longest`.

    An end that is `movable` (shortest, longest) is moved inwards, by fractions of the spacing, to where the misfit is least: evenly
    spaced exponentials fit a curve best if the outermost ones are slightly inside it.
    """
    low, high = np.log10(shortest), np.log10(longest)
    intervals = max(branches - 1, 1)
    spacing = (high - low) / intervals
    coarse = curve.averaged()

    def times(inset: tuple[float, float]) -> Floats:
        return np.logspace(high - inset[1] * spacing, low + inset[0] * spacing, branches)

    def misfit(inset: tuple[float, float]) -> float:
        design, target = relative_rows(coarse, times(inset), np.full(branches, coarse.size[-1]), known)
        return non_negative(*reduced_rows(design, target, coarse.row_weight))[1]

    # A single branch has no spacing to keep: its time is sought over the whole range, to many digits.
    single = branches == 1
    furthest = (0.0, float(any(movable))) if single else tuple(min(2.0, 0.4 * intervals) * end for end in movable)
    finest, step = 1e-7 if single else 0.1, max(furthest) / 4
    trials = sorted(product(*(np.linspace(0.0, end, 5 if end else 1).tolist() for end in furthest)), key=sum)  # widest range first
    inset, least = (0.0, 0.0), np.inf
    exact = EXACT * float(np.sqrt(coarse.row_weight.sum()))
    while step >= finest and least > exact:
        improved = False
        for trial in trials:
            inside = all(0 <= place <= end for place, end in zip(trial, furthest, strict=True))
            if inside and least > exact and (score := misfit(trial)) < _WORTHWHILE * least:
                inset, least, improved = trial, score, True
        step = step if improved else step / 2
        trials = [(inset[0] + step * shorter, inset[1] + step * longer) for shorter, longer in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    return times(inset)


def _unknown(known: Known) -> Flags:
    return np.array([value is None for value in known], dtype=bool)


def relative_rows(curve: WeightedCurve, process_time: Floats, scale: Floats, known: Known) -> tuple[Floats, Floats]:
    """Design matrix and target of the relative error, one channel after another.

    The unknowns are strengths over `scale`, and the constants that are not `known` over their `constant_scale`.
    """
    design = curve.kind.processes(curve.time, process_time) * scale / curve.values[..., None]
    constants = curve.kind.constants(curve.time)
    target = 1 - sum(value * response for value, response in zip(known, constants, strict=True) if value is not None) / curve.values
    unknown = _unknown(known)
    single = constants[unknown] * curve.constant_scale[unknown, None, None] / curve.values
    columns = [design.reshape(-1, process_time.size), single.reshape(len(single), curve.values.size).T]
    return np.column_stack(columns), target.reshape(-1)


def reduced_rows(design: Floats, target: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """The weighted least-squares problem, reduced to at most one row more than it has unknowns."""
    triangle = np.asarray(np.linalg.qr(np.column_stack([design, target]) * np.sqrt(weight)[:, None], mode="r"))
    return triangle[:, :-1], triangle[:, -1]


def non_negative(rows: Floats, values: Floats) -> tuple[Floats, float]:
    """Non-negative least-squares solution and the norm of its residual."""
    from scipy.optimize import nnls

    try:
        solution, residual = nnls(rows, values, maxiter=100 * rows.shape[1])
    except RuntimeError as reason:
        raise NumericsError(
            f"non-negative least squares did not settle with {rows.shape[1]} unknowns: take fewer branches"
        ) from reason
    return solution, float(residual)
