"""How an integration begins, at its start and after a kink of the load: consistent states, what fades, and first steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dielast.numerics.arrays import Cases, Floats, paired
from dielast.numerics.response import Fading, Responsive
from dielast.numerics.rosenbrock import Rosenbrock
from dielast.numerics.stride import PoolColumns, System

FIRST_MOVE = 5.0  # change of the state in the first step, in tolerances
PROBED = 10.0 ** -np.arange(10)  # fractions of the proposed first step at which transients are looked for


@dataclass(slots=True, eq=False)
class Beginning:
    """What is known of a pool of cases as it begins: `fading` in every column, None where that is not known."""

    method: Rosenbrock
    rtol: float
    fading: Fading | None = None

    def respond(self, system: System, state: Floats, at: PoolColumns, columns: Cases) -> None:
        """Make the state of columns (k,) after the start or a kink consistent, in place, and find what fades, if it is known.

        A state that is consistent only to the tolerance would be an error within the first step, however short that is.
        """
        if not isinstance(system, Responsive):
            return
        pair, count = paired(columns), columns.size
        responding = system if count == at.cases.size else system.take(pair)
        fading = responding.fading(at.time[pair], np.take(state, pair, axis=1), (at.duration - at.time)[pair])
        if fading is None or count == at.cases.size:
            self.fading = None if fading is None else fading.take(np.arange(count))
        elif self.fading is not None:
            self.fading = self.fading.put(columns, fading.take(np.arange(count)))
        no_time = np.zeros(pair.size)
        increment = self._first_increment(responding, at.time[pair], np.take(state, pair, axis=1), no_time, pair)
        state[:, pair] += np.where(np.isfinite(increment).all(axis=0), increment, 0.0)  # there is none at a limit point

    def _first_increment(self, system: Any, time: Floats, state: Floats, step: Floats, columns: Cases) -> Floats:
        """The increment (rows, k) of the first stage of a `step` (k,) of columns (k,), but for what fades as is known."""
        gamma, shape, start = self.method.gamma, state.shape, time[None]
        if self.fading is None:
            equations = system.linearise(start, state, step, gamma)
        else:
            fading = self.fading.take(columns)
            equations = system.linearise(start, state, step, gamma, fading.rate - fading.beyond)
        return np.asarray(equations.increment(0, state, None, gamma, np.empty(shape)))

    def step(self, system: System, state: Floats, at: PoolColumns, columns: Cases, proposed: Floats) -> Floats:
        """The first step (k,) of columns (k,) after the start or a kink, at most `proposed` (k,) where that is not 0."""
        step, left = np.zeros(columns.size), at.duration - at.time
        with_proposal = np.flatnonzero(proposed > 0)
        if with_proposal.size:
            chosen = columns[with_proposal]
            most = np.minimum(proposed[with_proposal], left[chosen])
            step[with_proposal] = self._continued_step(system, state, chosen, most, at.time)
        undecided = np.flatnonzero(step <= 0)
        if undecided.size:
            pair = paired(columns[undecided])
            first = self._first_step(system.take(pair), np.take(state, pair, axis=1), left[pair], at.time[pair], pair)
            step[undecided] = first[: undecided.size]
        return step

    def _first_step(self, system: System, state: Floats, duration: Floats, time: Floats, columns: Cases) -> Floats:
        """A step in which the initial rates change the state by `FIRST_MOVE` tolerances.

        A longer first step would hide any stiffer transient: neither its error estimate nor its dense output would show it. Where
        nothing changes it is a small part of the duration, as an early event within a far longer step has few digits.
        """
        probe = 1e-18 * duration
        increment = self._first_increment(system, time, state, probe, columns)
        rate = system.error(time, state, increment) / (self.method.gamma * probe)
        step = FIRST_MOVE * self.rtol / rate
        return np.where((step > 0) & (step < np.inf), np.minimum(step, duration), 1e-6 * duration)

    def _continued_step(self, system: System, state: Floats, columns: Cases, proposed: Floats, time: Floats) -> Floats:
        """The proposed first step (k,), reduced so far that no transient decays within it unseen; 0 where it would be too short.

        The slope of an implicit Euler step shows the rate that remains after that step. Where it differs by more than the
        tolerance from the slope over a step ten times as long, a transient decays in between.
        """
        many = np.repeat(columns, PROBED.size + 1)
        system, state = system.take(many), np.take(state, many, axis=1)
        steps = (proposed[:, None] * np.append(PROBED, 1e-18)).ravel()
        change = self._first_increment(system, time[many], state, steps, many)
        change = change.reshape(state.shape[0], columns.size, -1)
        change = change - change[..., -1:]  # less the correction towards a consistent state
        change[..., 1:] -= 0.1 * change[..., :-1]
        change = change.reshape(state.shape) / self.method.gamma
        error = system.error(time[many], state, change).reshape(columns.size, -1)
        transient = ~(error[:, 1:-1] <= FIRST_MOVE * self.rtol)
        finest = np.where(transient.any(axis=1), PROBED.size - 1 - np.argmax(transient[:, ::-1], axis=1), 0)
        return np.where(finest < PROBED.size - 1, proposed * PROBED[np.maximum(finest - 1, 0)], 0.0)
