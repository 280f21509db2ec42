"""Steps of the integrator within which a signal falls to zero or an exposure reaches 1, and the time of that.

An exposure of a film is the integral of a rate over the time of the voltage programme, computed beside the states. The rate is
integrated over the dense output of each step, by adaptive quadrature. The integral is as accurate as the states, and does not
shorten the steps, as it would if it were itself a state.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dielast.mechanics.criteria.criterion import FilmSnapshot, Signal
from dielast.mechanics.equations import Films
from dielast.mechanics.span import Load
from dielast.numerics.arrays import ByCase, Cases, Floats
from dielast.numerics.quadrature import integrals
from dielast.numerics.roots import OfFraction, fall, samples
from dielast.numerics.stride import DenseSteps, TriedStep

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

    def sampled(self, signal: Signal, system: Films, needs_springs: bool) -> Floats:
        """Samples (samples, k) of the signal in the steps; see `roots.samples`."""
        return samples(self._along(signal, system, needs_springs), self.last, self.value)[0]

    def first_fall(self, signal: Signal, system: Films, needs_springs: bool) -> tuple[Floats, FilmSnapshot]:
        """The time (k,) in s since the span began at which the signal first falls to zero, and the films at that moment.

        The dense output is of a lower order than the steps. So the step is repeated up to the zero of the signal along the dense
        output, and one step of Newton's method removes the residual of the signal there.
        """
        along = self._along(signal, system, needs_springs)
        values, fractions = samples(along, self.last, self.value)
        first, every = np.argmax(~(values > 0), axis=0), np.arange(self.last.size)
        fraction = fall(along, fractions[first - 1, every], fractions[first, every])
        low, high = np.maximum(fraction - NEARBY, 0.0), np.minimum(fraction + NEARBY, 1.0)
        with np.errstate(all="ignore"):  # a correction that is not finite is discarded
            slope = (along(high) - along(low)) / (high - low)
            state = self.steps.repeated(system, fraction)
            end = fraction - signal(self.at(fraction, state, system)[1]) / slope
        exact = (end >= 0) & (end <= 1)
        end = np.where(exact, end, fraction)
        state = self.steps.state(end) + np.where(exact, state - self.steps.state(fraction), 0.0)
        return self.at(end, state, system)

    def _along(self, signal: Signal, system: Films, needs_springs: bool) -> OfFraction:
        """The signal (k,) as a function of the fractions (k,) of the steps."""
        steps = self.steps if needs_springs else self.steps.rows(system.of_membrane)
        return lambda fraction: signal(self.at(fraction, steps.state(fraction), system)[1])

    def at(self, fraction: Floats, state: Floats, system: Films) -> tuple[Floats, FilmSnapshot]:
        """The time (k,) in s since the span began at fractions (k,) of the steps, and the films in the `state` (rows, k) then."""
        time = np.asarray(self.steps.time + fraction * self.steps.step)
        return time, FilmSnapshot.of(system, self.steps.cases, self.begin + time - self.switched_on, time, state)


class Exposure:
    """The integral `total` (cases,) of a `rate` in 1/s, which is a function of a snapshot and does not depend on the springs."""

    def __init__(self, rate: Signal, cases: int) -> None:
        self.rate, self.total = rate, np.zeros(cases)
        self.before = self.after = np.zeros(0)
        """The integrals (pool,) at both ends of the last step that was followed; `after` counts only where it is accepted."""

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "rate"}

    def follow(self, stride: TriedStep, system: Films) -> None:
        """Add a step."""
        steps = DenseSteps.of(stride, slice(system.border, None), np.arange(stride.cases.size))
        self.before = self.total[stride.cases]
        self.after = self.before + self._within(steps, system, stride.accepted.astype(float))
        self.total[stride.cases[stride.accepted]] = self.after[stride.accepted]

    def along(self, stride: TriedStep, system: Films, columns: Cases, fraction: Floats) -> Floats:
        """The integrals (k,) of `columns` (k,) at fractions (k,) of the last step that was followed."""
        steps = DenseSteps.of(stride, slice(system.border, None), columns)
        return self.before[columns] + self._within(steps, system.take(columns), fraction)

    def at(self, brackets: Brackets, before: Floats, time: Floats, system: Films) -> Floats:
        """The integrals (k,) at `time` (k,) within steps, given the integrals `before` (k,) at the beginning of these steps."""
        steps = brackets.steps.rows(slice(system.border, None))
        return before + self._within(steps, system, np.clip((time - steps.time) / steps.step, 0.0, 1.0))

    def reached(self, brackets: Brackets, system: Films) -> tuple[Floats, FilmSnapshot]:
        """The time (k,) in s since the span began at which the integral reaches 1, and the films then.

        The integral is `last` at the beginning of a step and `value` at its end.
        """
        begin, end = np.zeros_like(brackets.last), np.ones_like(brackets.last)
        steps = brackets.steps.rows(slice(system.border, None))
        part = fall(lambda part: 1 - brackets.last - self._within(steps, system, part), begin, end)
        return brackets.at(part, brackets.steps.state(part), system)

    def _within(self, steps: DenseSteps, system: Films, part: Floats) -> Floats:
        """The integral (k,) over the first `part` (k,) of the steps, whose states hold the rows of the border."""

        def rate(columns: Cases, fraction: Floats) -> Floats:
            is_subset = not np.array_equal(columns, all_columns)
            chosen, films = (steps.take(columns), system.take(columns)) if is_subset else (steps, system)
            time = chosen.time + fraction * chosen.step
            return self.rate(FilmSnapshot.of(films, chosen.cases, np.zeros_like(time), time, chosen.state(fraction)))

        all_columns = np.arange(part.size)
        with np.errstate(all="ignore"):  # where the rate overflows, the film fails
            return integrals(rate, np.zeros_like(part), part) * steps.step
