"""Steps of the integrator within which a signal falls to zero, and the time of its first zero in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dielast.mechanics.criteria.criterion import Moment, Signal
from dielast.mechanics.span import Load
from dielast.mechanics.symmetric import Films
from dielast.numerics.arrays import ByCase, Cases, Floats
from dielast.numerics.roots import fall, samples
from dielast.numerics.stride import DenseSteps

NEARBY = 1e-3  # half-width, as a fraction of the step, of the difference quotient for the slope of a signal


@dataclass(frozen=True, slots=True, eq=False)
class Brackets(ByCase):
    """Steps of columns (k,) over which a signal falls from `last` (k,) to `value` (k,).

    The span of `load` that contains the step began `begin` (k,) s after the voltage programme; the magnitude of the voltage last
    began to rise `switched_on` (k,) s after the beginning of the programme.
    """

    steps: DenseSteps
    load: Load
    begin: Floats
    switched_on: Floats
    last: Floats
    value: Floats
    exposed: Floats
    """The integrals of exposure at the beginning of the steps (exposures, k)."""

    def sampled(self, signal: Signal, system: Films, needs_springs: bool) -> tuple[Floats, Floats]:
        """Samples of the signal in the steps, and their fractions of the steps, both (samples, k); see `roots.samples`."""
        return samples(self._along(signal, system, needs_springs), self.last, self.value)

    def first_fall(self, signal: Signal, system: Films, needs_springs: bool) -> tuple[Floats, Moment]:
        """The time (k,) in s since the span began at which the signal first falls to zero, and the films at that moment."""
        along = self._along(signal, system, needs_springs)
        values, fractions = samples(along, self.last, self.value)
        first, every = np.argmax(~(values > 0), axis=0), np.arange(self.last.size)
        fraction = fall(along, fractions[first - 1, every], fractions[first, every])
        return self._by_steps(signal, along, system, fraction)

    def _by_steps(
        self, signal: Signal, along: Callable[[Floats], Floats], system: Films, fraction: Floats
    ) -> tuple[Floats, Moment]:
        """The time and the moment of the zero that the signal has `along` the dense output at a `fraction` (k,) of the step.

        The dense output is of a lower order than the steps. So the step is repeated up to this fraction, and one step of Newton's
        method removes the residual of the signal there.
        """
        low, high = np.maximum(fraction - NEARBY, 0.0), np.minimum(fraction + NEARBY, 1.0)
        with np.errstate(all="ignore"):  # a correction that is not finite is discarded
            slope = (along(high) - along(low)) / (high - low)
            state = self.steps.anew(system, fraction)
            end = fraction - signal(self._moment(fraction, state, system)) / slope
        exact = (end >= 0) & (end <= 1)
        end = np.where(exact, end, fraction)
        state = self.steps.state(end) + np.where(exact, state - self.steps.state(fraction), 0.0)
        return self._time(end), self._moment(end, state, system)

    def _along(self, signal: Signal, system: Films, needs_springs: bool) -> Callable[[Floats], Floats]:
        """The signal (k,) as a function of the fractions (k,) of the steps."""
        every: Cases = np.arange(self.last.size)
        steps = self.steps if needs_springs else self.steps.take(every, slice(system.border, None))
        return lambda fraction: signal(self.at(fraction, steps, system)[1])

    def at(self, fraction: Floats, steps: DenseSteps, system: Films) -> tuple[Floats, Moment]:
        """The time (k,) in s since the span began at fractions (k,) of the steps, and the films then."""
        return self._time(fraction), self._moment(fraction, steps.state(fraction), system)

    def _time(self, fraction: Floats) -> Floats:
        """The time (k,) in s since the span began at fractions (k,) of the steps."""
        return np.asarray(self.steps.time + fraction * self.steps.step)

    def _moment(self, fraction: Floats, state: Floats, system: Films) -> Moment:
        """The films in the `state` (rows, k) at fractions (k,) of the steps."""
        time = self._time(fraction)
        return Moment.of(system, self.steps.cases, self.begin + time - self.switched_on, time, state)
