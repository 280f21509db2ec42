"""Specimens of prescribed stretch, branch by branch: the branches are independent, as all have the stretch of the specimen.

The viscous stretch of a branch follows from the history of the stretch, its relaxation time and its law, whatever its modulus:

    dx/dt = f p(Lambda(t) - x) / (3 tau),    s = sum mu p / lambda,

with Lambda = 2 ln lambda, x = 2 ln xi and f = `Symmetry.flow` (Sec. 3 of DOI 10.1115/1.4030850). So materials that differ only in
moduli share all branches, and materials that differ in some branches share the others. If axis 2 is held at stretch 1, the flow is
that of `elimination`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.material.springs import SpringLaw, Symmetry
from dielast.mechanics.elimination import Eliminated, flow_of
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.stride import DenseSteps, Stride


@dataclass(frozen=True, slots=True, eq=False)
class Branches(ByCase):
    """Branches of `rate` 1/(3 tau) (cases,) in 1/s, whose stretch in axis 1 is `start` + `slope` t, both (cases,).

    A state (rows, cases) holds x of axis 1; without a `symmetry` it also holds x of axis 2, which is held at stretch 1.
    """

    law: SpringLaw
    rate: Floats
    symmetry: Symmetry | None
    start: Floats
    slope: Floats

    def log_squared(self, time: Floats) -> Floats:
        """Lambda (cases,) of axis 1 at `time` (cases,) in s since the span began."""
        return np.asarray(2 * np.log(self.start + self.slope * time))

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of the viscous stretches."""
        return np.asarray(0.5 * np.max(np.abs(increment), axis=0))

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> AxialStep | PlanarStep:
        """The linear system of a step (cases,) in s that starts at `time` and `state`."""
        return (PlanarStep if self.symmetry is None else AxialStep)(self, time, state, step, gamma)


class AxialStep:
    """The linear system of one step of branches under a symmetry: one scalar equation per branch."""

    def __init__(self, system: Branches, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        assert system.symmetry is not None
        self.system, self.symmetry, self.flow = system, system.symmetry, system.symmetry.flow * step * system.rate
        self.stress, tangent = system.law.axial_tangent(system.symmetry, *elastic(system.symmetry, self._at(time, state)))
        tangent *= self.flow
        self.change = tangent * (2 * step * system.slope / (system.start + system.slope * time))
        self.inverse = 1 / (tangent + 1 / gamma)

    def _at(self, time: Floats, state: Floats) -> Floats:
        return self.system.log_squared(time) - state

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i of the stage at `time` and `state`, in `out`; `history` is sum_j c_ij u_j, None in the first stage."""
        stress = self.stress
        if history is not None:
            stress = self.system.law.axial_stress(self.symmetry, *elastic(self.symmetry, self._at(time, state)))
        right = stress * self.flow
        if history is not None:
            right += history
        if gamma_i:
            right += gamma_i * self.change
        return np.multiply(self.inverse, right, out=out)


class PlanarStep:
    """The linear system of one step of branches whose axis 2 is held: one 2x2 block per branch."""

    def __init__(self, system: Branches, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.flow = system, step * system.rate
        self.stress, tangent = system.law.tangent(self._squared(time, state))
        self.springs = Eliminated.of(np.ones_like(self.flow), tangent, self.flow, 1 / gamma)
        change_of_stretch = 2 * step * system.slope / (system.start + system.slope * time)
        self.change = flow_of(tangent[:2] * change_of_stretch, self.flow)

    def _squared(self, time: Floats, state: Floats) -> Floats:
        elastic = -state[:, None]
        elastic[0] += self.system.log_squared(time)
        return np.exp(elastic, out=elastic)

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """As in `AxialStep`."""
        stress = self.stress if history is None else self.system.law.stress(self._squared(time, state))
        right = flow_of(stress, self.flow)
        if history is not None:
            right += history[:, None]
        if gamma_i:
            right += gamma_i * self.change
        increment = np.empty_like(right)
        self.springs.solve(right, increment)
        out[:] = increment[:, 0]
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Histories:
    """Straight lines between corners of `time` in s and `stretch`, both (cases, corners).

    Shorter histories are padded with their last corner. The stretch jumps from 1 to its first corner.
    """

    time: Floats
    stretch: Floats

    @property
    def spans(self) -> int:
        """The number of intervals between corners."""
        return int(self.time.shape[1]) - 1

    def lasts(self, cases: Cases, index: Cases) -> Floats:
        """The durations (k,) in s of the spans `index` (k,) of `cases` (k,)."""
        return np.asarray(self.time[cases, index + 1] - self.time[cases, index])

    def enter(self, system: Branches, columns: Cases, cases: Cases, index: Cases) -> tuple[Branches, Floats]:
        """The branches whose columns (k,) enter the spans `index` (k,) of `cases` (k,), and the durations (k,) of these spans."""
        lasts = self.lasts(cases, index)
        start, slope = system.start.copy(), system.slope.copy()
        start[columns] = self.stretch[cases, index]
        rise = self.stretch[cases, index + 1] - start[columns]
        slope[columns] = np.where(lasts > 0, rise, 0.0) / np.where(lasts > 0, lasts, 1.0)
        return replace(system, start=start, slope=slope), lasts

    def smooth(self, index: Cases) -> Flags:
        """False (k,): every corner is a kink."""
        return np.zeros(index.shape, dtype=bool)


def elastic(symmetry: Symmetry, log_squared: Floats) -> tuple[Floats, Floats]:
    """A and C (...) of a spring whose elastic stretch in axis 1 has the 2 ln lambda `log_squared` (...)."""
    return np.exp(log_squared), np.exp(-symmetry.thinning * log_squared)


def carried(
    law: SpringLaw, rate: Floats, symmetry: Symmetry | None, histories: Histories, times: Floats, stretch: Floats, rtol: float
) -> Floats:
    """The nominal stress (cases, k) in axis 1 of branches, over their shear moduli, at `times` (cases, k) in s.

    `stretch` (cases, k) is the stretch at these times, `rate` (cases,) is 1/(3 tau) in 1/s, 0 for an elastic spring. `symmetry` is
    that of the load, None if axis 2 is held; `law` is for arrays (..., 1, cases). `rtol` bounds the local relative error of the
    viscous stretches. The stress is NaN where a branch cannot follow its history.
    """
    viscous = np.zeros((2 if symmetry is None else 1, rate.size, times.shape[1]))
    lost, flowing = np.zeros(rate.size, dtype=bool), np.flatnonzero(rate > 0)
    if flowing.size:
        flowing_histories = Histories(histories.time[flowing], histories.stretch[flowing])
        viscous[:, flowing], lost[flowing] = _flowed(
            law.take(flowing), rate[flowing], symmetry, flowing_histories, times[flowing], rtol
        )
    log_squared = 2 * np.log(stretch)
    with np.errstate(all="ignore"):
        if symmetry is None:
            squared = np.exp(np.stack((log_squared, np.zeros_like(log_squared))) - viscous)
            stress = law.stress(np.moveaxis(squared, 1, 2))[0].T
        else:
            stress = law.axial_stress(symmetry, *(side.T for side in elastic(symmetry, log_squared - viscous[0]))).T
        stress = stress / stretch
    return np.where(np.isfinite(stress) & ~lost[:, None], stress, np.nan)


def _flowed(
    law: SpringLaw, rate: Floats, symmetry: Symmetry | None, histories: Histories, times: Floats, rtol: float
) -> tuple[Floats, Flags]:
    """x (rows, cases, k) of branches that flow, and whether (cases,) they cannot follow their histories; as in `carried`."""
    rows, last, start = 2 if symmetry is None else 1, histories.time[:, -1], histories.stretch[:, 0]
    parts: list[DenseSteps] = []
    begins: list[Floats] = []

    def store(stride: Stride) -> None:
        columns = np.flatnonzero(stride.accepted)
        parts.append(DenseSteps.of(stride, slice(None), columns))
        begins.append(stride.begin[columns] + stride.time[columns])

    system = Branches(law, rate, symmetry, start, np.zeros_like(rate))
    ended = integrate(system, np.zeros((rows, rate.size)), last, rtol=rtol, observe=store, spans=histories)
    lost = ended.status != Status.COMPLETED
    if not parts:
        return np.zeros((rows, *times.shape)), lost
    steps, begin = DenseSteps.joined(parts), np.concatenate(begins)
    # one ascending sort key for the steps of all cases: the case, plus half the fraction of its duration
    key = steps.cases + 0.5 * begin / last[steps.cases]
    order = np.argsort(key, kind="stable")
    key_of_times = np.arange(rate.size)[:, None] + 0.5 * times / last[:, None]
    indices = order[np.maximum(np.searchsorted(key[order], key_of_times.ravel(), side="right") - 1, 0)]
    fraction = (times.ravel() - begin[indices]) / steps.step[indices]
    return steps.take(indices).state(np.clip(fraction, 0.0, 1.0)).reshape(rows, *times.shape), lost
