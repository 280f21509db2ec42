"""Specimens whose stretch is prescribed: every branch on its own, as no other spring changes what it goes through.

The viscous stretch of a branch then follows from the history of the stretch, its relaxation time and its law, whatever its modulus:

    dx/dt = f p(Lambda(t) - x) / (3 tau),    s = sum mu p / lambda,

Lambda = 2 ln lambda, x = 2 ln xi, f = `Symmetry.flow` (Sec. 3 of DOI 10.1115/1.4030850). So materials that differ in moduli, or in
some of their branches alone, have the other branches in common. Where axis 2 is held at stretch 1, the flow is that of
`elimination`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.material.springs import SpringLaw, Symmetry
from dielast.mechanics.elimination import Eliminated, flow_of
from dielast.numerics.columns import Cases, Flags, Floats
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.stride import DenseSteps, Stride


@dataclass(frozen=True, slots=True, eq=False)
class Branches:
    """Branches of a `rate` 1/(3 tau) (cases,) in 1/s whose stretch in axis 1 is `start` + `slope` t, both (cases,).

    A state has x of axis 1, and of axis 2 where there is no `symmetry` and that axis is held at stretch 1.
    """

    law: SpringLaw
    rate: Floats
    symmetry: Symmetry | None
    start: Floats
    slope: Floats

    def take(self, cases: Cases) -> Branches:
        """The same for some of the cases."""
        return Branches(self.law.take(cases), self.rate[cases], self.symmetry, self.start[cases], self.slope[cases])

    def log_squared(self, time: Floats) -> Floats:
        """Lambda (cases,) of axis 1 at a `time` (cases,) in s since the span began."""
        return np.asarray(2 * np.log(self.start + self.slope * time))

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of the viscous stretches."""
        return np.asarray(0.5 * np.max(np.abs(increment), axis=0))

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> AxialStep | PlanarStep:
        """The equations at the start of a step of given length (cases,), ready to be solved."""
        return (PlanarStep if self.symmetry is None else AxialStep)(self, time, state, step, gamma)


class AxialStep:
    """One step of branches under a symmetry: a number for each."""

    def __init__(self, system: Branches, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        assert system.symmetry is not None
        self.system, self.symmetry, self.flow = system, system.symmetry, system.symmetry.flow * step * system.rate
        self.stress, tangent = system.law.axial_tangent(system.symmetry, *elastic(system.symmetry, self._at(time, state)))
        tangent *= self.flow
        self.change = tangent * (2 * step * system.slope / (system.start + system.slope * time))
        self.inverse = 1 / (tangent + 1 / gamma)

    def _at(self, time: Floats, state: Floats) -> Floats:
        return self.system.log_squared(time) - state

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float) -> Floats:
        """u_i of a stage at `time` and `state`, with the sum over c_ij u_j as `history` (None in the first stage)."""
        stress = self.stress
        if history is not None:
            stress = self.system.law.axial_stress(self.symmetry, *elastic(self.symmetry, self._at(time, state)))
        right = stress * self.flow
        if history is not None:
            right += history
        if gamma_i:
            right += gamma_i * self.change
        right *= self.inverse
        return right


class PlanarStep:
    """One step of branches whose axis 2 is held: a 2x2 block for each."""

    def __init__(self, system: Branches, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.flow = system, step * system.rate
        self.stress, tangent = system.law.tangent(self._squared(time, state))
        self.springs = Eliminated.of(np.ones_like(self.flow), tangent, self.flow, 1 / gamma)
        moved = 2 * step * system.slope / (system.start + system.slope * time)
        self.change = flow_of(tangent[:2] * moved, self.flow)

    def _squared(self, time: Floats, state: Floats) -> Floats:
        elastic = -state[:, None]
        elastic[0] += self.system.log_squared(time)
        return np.exp(elastic, out=elastic)

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float) -> Floats:
        """As in `AxialStep`."""
        stress = self.stress if history is None else self.system.law.stress(self._squared(time, state))
        right = flow_of(stress, self.flow)
        if history is not None:
            right += history[:, None]
        if gamma_i:
            right += gamma_i * self.change
        increment = np.empty_like(right)
        self.springs.solve(right, increment)
        return increment[:, 0]


@dataclass(frozen=True, slots=True, eq=False)
class Histories:
    """Straight lines through `time` in s and `stretch`, both (cases, corners): a history that ends early is filled up with its last
    corner. The stretch is at its first corner at once.
    """

    time: Floats
    stretch: Floats

    @property
    def spans(self) -> int:
        """Between the corners."""
        return int(self.time.shape[1]) - 1

    def lasts(self, cases: Cases, index: Cases) -> Floats:
        """How long spans last."""
        return np.asarray(self.time[cases, index + 1] - self.time[cases, index])

    def enter(self, system: Branches, columns: Cases, cases: Cases, index: Cases) -> tuple[Branches, Floats]:
        """The branches with columns of these cases in these spans, and how long these last."""
        lasts = self.lasts(cases, index)
        start, slope = system.start.copy(), system.slope.copy()
        start[columns] = self.stretch[cases, index]
        rise = self.stretch[cases, index + 1] - start[columns]
        slope[columns] = np.where(lasts > 0, rise, 0.0) / np.where(lasts > 0, lasts, 1.0)
        return replace(system, start=start, slope=slope), lasts

    def smooth(self, index: Cases) -> Flags:
        """Every corner is a kink."""
        return np.zeros(index.shape, dtype=bool)


@dataclass(slots=True)
class _Steps:
    """Keeps every step, to look up states in later."""

    parts: list[DenseSteps] = field(default_factory=list)
    begins: list[Floats] = field(default_factory=list)

    def __call__(self, stride: Stride) -> None:
        columns = np.flatnonzero(stride.accepted)
        self.parts.append(DenseSteps.of(stride, slice(None), columns))
        self.begins.append(stride.begin[columns] + stride.time[columns])

    def states(self, times: Floats, last: Floats) -> Floats:
        """States (rows, cases, k) at `times` (cases, k) in s, up to the `last` (cases,)."""
        steps, begin = DenseSteps.joined(self.parts), np.concatenate(self.begins)
        # one ascending number for the steps of all cases: the case, and how far it has come
        key = steps.cases + 0.5 * begin / last[steps.cases]
        order = np.argsort(key, kind="stable")
        wanted = np.arange(times.shape[0])[:, None] + 0.5 * times / last[:, None]
        rows_at = order[np.maximum(np.searchsorted(key[order], wanted.ravel(), side="right") - 1, 0)]
        fraction = (times.ravel() - begin[rows_at]) / steps.step[rows_at]
        return steps.take(rows_at).state(np.clip(fraction, 0.0, 1.0)).reshape(-1, *times.shape)


def elastic(symmetry: Symmetry, log_squared: Floats) -> tuple[Floats, Floats]:
    """A and C (...) of a spring whose elastic stretch in axis 1 has this 2 ln lambda (...)."""
    return np.exp(log_squared), np.exp(-symmetry.thinning * log_squared)


def carried(
    law: SpringLaw, rate: Floats, symmetry: Symmetry | None, histories: Histories, times: Floats, stretch: Floats, rtol: float
) -> Floats:
    """The nominal stress (cases, k) over the shear modulus that branches carry in axis 1 at `times` (cases, k) in s, when the
    `stretch` is (cases, k); NaN where a branch cannot follow its history. A `rate` of 0 is that of a spring.

    `symmetry` is that of the load, None where axis 2 is held; `law` acts on arrays (..., 1, cases). `rtol` bounds the local
    relative error of the viscous stretches.
    """
    count, (rows, lasting) = rate.size, (2 if symmetry is None else 1, histories.time[:, -1])
    viscous = np.zeros((rows, count, times.shape[1]))
    flowing = np.flatnonzero(rate > 0)
    lost = np.zeros(count, dtype=bool)
    if flowing.size:
        flows = Histories(histories.time[flowing], histories.stretch[flowing])
        start, zero = flows.stretch[:, 0], np.zeros(flowing.size)
        system = Branches(law.take(flowing), rate[flowing], symmetry, start, zero)
        steps = _Steps()
        ended = integrate(system, np.zeros((rows, flowing.size)), lasting[flowing], rtol=rtol, observe=steps, spans=flows)
        lost[flowing] = ended.status != Status.COMPLETED
        if steps.parts:
            viscous[:, flowing] = steps.states(times[flowing], lasting[flowing])
    log_squared = 2 * np.log(stretch)
    with np.errstate(all="ignore"):
        if symmetry is None:
            squared = np.exp(np.stack((log_squared, np.zeros_like(log_squared))) - viscous)
            stress = law.stress(np.moveaxis(squared, 1, 2))[0].T
        else:
            stress = law.axial_stress(symmetry, *(side.T for side in elastic(symmetry, log_squared - viscous[0]))).T
        stress = stress / stretch
    return np.where(np.isfinite(stress) & ~lost[:, None], stress, np.nan)
