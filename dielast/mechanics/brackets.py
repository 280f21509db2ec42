"""Steps within which a signal falls to zero, and where in them it first does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dielast.mechanics.criteria.criterion import Moment, Signal
from dielast.mechanics.span import Load
from dielast.mechanics.symmetric import Films
from dielast.numerics.columns import Cases, Floats
from dielast.numerics.roots import fall, samples
from dielast.numerics.stride import DenseSteps

NEARBY = 1e-3  # of a step: so far to either side goes the difference that is a signal's slope


@dataclass(frozen=True, slots=True, eq=False)
class Brackets:
    """Steps of columns (k,) over which a signal goes from `last` to `value`. The span of `load` in which they lie began `begin` s
    after the voltage programme, and `switched_on` is when the voltage began to rise, in the same time.
    """

    steps: DenseSteps
    load: Load
    begin: Floats
    switched_on: Floats
    last: Floats
    value: Floats
    exposed: Floats
    """What adds up over time, at the beginning of the steps (exposures, k)."""

    @classmethod
    def joined(cls, parts: list[Brackets]) -> Brackets:
        """The columns of all parts."""
        names = ("begin", "switched_on", "last", "value", "exposed")
        numbers = (np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names)
        return cls(DenseSteps.joined([part.steps for part in parts]), Load.joined([part.load for part in parts]), *numbers)

    def sampled(self, signal: Signal, system: Films, needs_springs: bool) -> tuple[Floats, Floats]:
        """The signal at some fractions of the steps, and these fractions, (samples, k) each; see `roots.samples`."""
        return samples(self._along(signal, system, needs_springs), self.last, self.value)

    def first_fall(self, signal: Signal, system: Films, needs_springs: bool) -> tuple[Floats, Moment]:
        """The time (k,) since the span began at which the signal first falls to zero, and how the films are then."""
        along = self._along(signal, system, needs_springs)
        values, fractions = samples(along, self.last, self.value)
        first, every = np.argmax(~(values > 0), axis=0), np.arange(self.last.size)
        fraction = fall(along, fractions[first - 1, every], fractions[first, every])
        return self._by_steps(signal, along, system, fraction)

    def _by_steps(
        self, signal: Signal, along: Callable[[Floats], Floats], system: Films, fraction: Floats
    ) -> tuple[Floats, Moment]:
        """The time and the moment at which the signal vanishes that does so `along` the dense output at a `fraction` (k,).

        The dense output is of a lower order than the steps. So films go there by a step of their own, and the signal that they
        then have left takes one step of Newton's method.
        """
        low, high = np.maximum(fraction - NEARBY, 0.0), np.minimum(fraction + NEARBY, 1.0)
        with np.errstate(all="ignore"):  # what is not finite is left where it is
            slope = (along(high) - along(low)) / (high - low)
            state = self.steps.anew(system, fraction)
            end = fraction - signal(self._moment(fraction, state, system)) / slope
        exact = (end >= 0) & (end <= 1)
        end = np.where(exact, end, fraction)
        state = self.steps.state(end) + np.where(exact, state - self.steps.state(fraction), 0.0)
        return self._time(end), self._moment(end, state, system)

    def _along(self, signal: Signal, system: Films, needs_springs: bool) -> Callable[[Floats], Floats]:
        """The signal (k,) over the fractions (k,) of the steps."""
        every: Cases = np.arange(self.last.size)
        steps = self.steps if needs_springs else self.steps.take(every, slice(system.border, None))
        return lambda fraction: signal(self.at(fraction, steps, system)[1])

    def at(self, fraction: Floats, steps: DenseSteps, system: Films) -> tuple[Floats, Moment]:
        """Time since the span began, and the films then."""
        return self._time(fraction), self._moment(fraction, steps.state(fraction), system)

    def _time(self, fraction: Floats) -> Floats:
        """Time (k,) since the span began at fractions (k,) of the steps."""
        return np.asarray(self.steps.time + fraction * self.steps.step)

    def _moment(self, fraction: Floats, state: Floats, system: Films) -> Moment:
        """Films that are in this `state` at fractions (k,) of the steps."""
        time = self._time(fraction)
        return Moment.of(system, self.steps.cases, self.begin + time - self.switched_on, time, state)
