"""Specimens of prescribed stretch, branch by branch: the branches are independent, as all have the stretch of the specimen.

The elastic strain e = Lambda - x of a branch follows from the history of the stretch, its flow and its law:

    de/dt = dLambda/dt - dx/dt,    s = sum mu p / lambda,

with Lambda = 2 ln lambda, x = 2 ln xi (Sec. 3 of DOI 10.1115/1.4030850). Linear flow does not depend on the modulus: materials that
differ only in moduli share all branches, and materials that differ in some branches share the others. The elastic strain of a fast
branch is far smaller than x, and its stress is as exact as this strain.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.material.springs import SpringLaw, Symmetry
from dielast.mechanics.elimination import Eliminated, stress_of, tangent_of
from dielast.mechanics.flow import Flow
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats
from dielast.numerics.integrate import Status, Stepper
from dielast.numerics.stride import DenseSteps, TriedStep

ROUNDING = 3e-15  # least tolerance for an elastic strain: ten times the rounding error of A - C


@dataclass(frozen=True, slots=True, eq=False)
class Branches(ByCase):
    """Branches of a `flow` (1, cases), whose stretch in axis 1 is `start` + `slope` t, both (cases,).

    A state (rows, cases) holds e of axis 1; without a `symmetry` it also holds e of axis 2, which is held at stretch 1. `scale`
    (cases,) is the strain over which errors count.
    """

    law: SpringLaw
    flow: Flow
    scale: Floats
    symmetry: Symmetry | None
    start: Floats
    slope: Floats

    def strain_rate(self, time: Floats) -> Floats:
        """dLambda/dt of axis 1 at `time` in s since the span began, both (..., cases)."""
        return np.asarray(2 * self.slope / (self.start + self.slope * time))

    def error(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """Largest error (cases,) of the elastic stretches over the `scale`."""
        return np.asarray(0.5 * np.max(np.abs(increment), axis=0) / self.scale)

    def driven_by(self, columns: Cases, line: tuple[Floats, Floats]) -> Branches:
        """The branches with another `start` and `slope` of the stretch, both (k,), in the `columns` (k,)."""
        start, slope = self.start.copy(), self.slope.copy()
        start[columns], slope[columns] = line
        return replace(self, start=start, slope=slope)

    def linearise(self, times: Floats, state: Floats, step: Floats, gamma: float) -> BranchStep:
        """The linear system of a step (cases,) in s from `state`, whose stages are at `times` (stages, cases)."""
        return BranchStep(self, times, state, step, gamma)


class BranchStep:
    """The linear system of one step: one small block per branch."""

    def __init__(self, system: Branches, times: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.strain = system, step * system.strain_rate(times)
        self.flow = system.flow.over(step, system.symmetry)
        self.stress, tangent = tangent_of(system.law, system.symmetry, state[:, None].copy())
        self.springs = Eliminated.of(tangent, self.flow.mobility(self.stress), 1 / gamma)
        self.change = -0.5 * np.square(self.strain[0])

    def increment(self, stage: int, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i of a stage at `state`, in `out`; `history` is sum_j c_ij u_j, None in the first stage."""
        system, stress = self.system, self.stress
        if history is not None:
            stress = stress_of(system.law, system.symmetry, state[:, None].copy())
        right = -self.flow.rate(stress)
        right[0] += self.strain[stage]
        if history is not None:
            right += history[:, None]
        if gamma_i:
            right[0] += gamma_i * self.change
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

    def span(self, cases: Cases, index: Cases) -> tuple[tuple[Floats, Floats], Floats]:
        """Start and slope of the stretch in the spans `index` (k,) of `cases` (k,), and the durations (k,) in s of these spans."""
        lasts, start = self.time[cases, index + 1] - self.time[cases, index], self.stretch[cases, index]
        rise = self.stretch[cases, index + 1] - start
        return (start, np.where(lasts > 0, rise, 0.0) / np.where(lasts > 0, lasts, 1.0)), lasts

    def largest_elastic_strain(self, fluidity: Floats) -> Floats:
        """The largest |Lambda - x| (cases,) at the corners, of linear branches of `fluidity` 1/(3 tau) (cases,) in 1/s.

        Between corners at which Lambda differs by D after a time h, d(Lambda - x)/dt = D/h - (Lambda - x)/tau.
        """
        log_squared, lasts = 2 * np.log(self.stretch), np.diff(self.time, axis=1) * 3 * fluidity[:, None]
        fading, rise = np.exp(-lasts), np.diff(log_squared, axis=1)
        rise *= np.where(lasts > 0, -np.expm1(-lasts) / np.where(lasts > 0, lasts, 1.0), 1.0)
        strain = log_squared[:, 0]
        largest = np.abs(strain)
        for span in range(self.spans):
            strain = fading[:, span] * strain + rise[:, span]
            largest = np.maximum(largest, np.abs(strain))
        return np.asarray(largest)

    def smooth(self, index: Cases) -> Flags:
        """False (k,): every corner is a kink."""
        return np.zeros(index.shape, dtype=bool)


@dataclass(slots=True)
class Steps:
    """An observer that stores every step, to evaluate states later."""

    parts: list[DenseSteps] = field(default_factory=list)
    begins: list[Floats] = field(default_factory=list)

    def __call__(self, stride: TriedStep) -> None:
        """Store the step."""
        columns = np.flatnonzero(stride.accepted)
        self.parts.append(DenseSteps.of(stride, slice(None), columns))
        self.begins.append(stride.begin[columns] + stride.time[columns])

    def largest(self, cases: int) -> Floats:
        """The largest magnitude (cases,) in the states of this number of `cases` at the ends of steps."""
        largest = np.zeros(cases)
        for part in self.parts:
            np.maximum.at(largest, part.cases, np.max(np.abs(part.state(np.ones(part.cases.size))), axis=0))
        return largest

    def states(self, times: Floats, last: Floats) -> Floats:
        """States (rows, cases, k) at `times` (cases, k) in s of integrations that lasted `last` (cases,) s."""
        steps, begin = DenseSteps.joined(self.parts), np.concatenate(self.begins)
        # one ascending sort key for the steps of all cases: the case, plus half the fraction of its duration
        key = steps.cases + 0.5 * begin / last[steps.cases]
        order = np.argsort(key, kind="stable")
        key_of_times = np.arange(times.shape[0])[:, None] + 0.5 * times / last[:, None]
        indices = order[np.maximum(np.searchsorted(key[order], key_of_times.ravel(), side="right") - 1, 0)]
        fraction = (times.ravel() - begin[indices]) / steps.step[indices]
        return steps.take(indices).state(np.clip(fraction, 0.0, 1.0)).reshape(-1, *times.shape)


def carried(
    law: SpringLaw, flow: Flow, symmetry: Symmetry | None, histories: Histories, times: Floats, stretch: Floats, rtol: float
) -> Floats:
    """The nominal stress (cases, k) in axis 1 of branches, over their shear moduli, at `times` (cases, k) in s.

    `stretch` (cases, k) is the stretch at these times. `symmetry` is that of the load, None if axis 2 is held; `law` and `flow` are
    for arrays (..., 1, cases). `rtol` bounds the local error of the elastic stretches over the largest elastic strain of a linear
    branch, or, if the flow depends on stress, over the largest elastic strain: the strain of a fast branch is small, but its
    modulus may be large. The stress is NaN where a branch cannot follow its history.
    """
    log_squared = 2 * np.log(stretch)
    strain = log_squared[None] if symmetry is not None else np.stack((log_squared, np.zeros_like(log_squared)))
    fluidity = flow.fluidity[0]
    flowing = np.flatnonzero(fluidity > 0)
    lost = np.zeros(fluidity.size, dtype=bool)
    if flowing.size:
        history = Histories(histories.time[flowing], histories.stretch[flowing])
        scale = np.clip(history.largest_elastic_strain(fluidity[flowing]), ROUNDING / rtol, 1.0)
        start, zero = history.stretch[:, 0], np.zeros(flowing.size)
        system = Branches(law.take(flowing), flow.take(flowing), scale, symmetry, start, zero)
        opening = np.zeros((strain.shape[0], flowing.size))
        opening[0] = 2 * np.log(start)
        while True:
            steps = Steps()
            ended = Stepper(system, opening, history.time[:, -1], rtol=rtol, spans=history).run(steps)
            largest = np.clip(np.maximum(np.abs(opening[0]), steps.largest(flowing.size)), ROUNDING / rtol, 1.0)
            if not (flow.depends_on_stress and np.any(largest < 0.5 * system.scale)):
                break
            system = replace(system, scale=np.minimum(largest, system.scale))
        lost[flowing] = ended.status != Status.COMPLETED
        strain[:, flowing] = opening[:, :, None]
        if steps.parts:
            strain[:, flowing] = steps.states(times[flowing], history.time[:, -1])
    with np.errstate(all="ignore"):
        stress = stress_of(law, symmetry, np.moveaxis(strain, 1, 2).copy())[0].T / stretch
    return np.where(np.isfinite(stress) & ~lost[:, None], stress, np.nan)
