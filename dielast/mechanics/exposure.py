"""The exposure of films: the integral of a rate over the time of the voltage programme, computed beside the states.

The rate is integrated over the dense output of each step, by adaptive quadrature. The integral is as accurate as the states, and
does not shorten the steps, as it would if it were itself a state.
"""

from __future__ import annotations

import numpy as np

from dielast.mechanics.brackets import Brackets
from dielast.mechanics.criteria.criterion import Moment, Signal
from dielast.mechanics.symmetric import Films
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.quadrature import integrals
from dielast.numerics.roots import fall
from dielast.numerics.stride import DenseSteps, Stride


class Exposure:
    """The integral `total` (cases,) of a `rate` in 1/s, which is a function of a moment and does not depend on the springs."""

    def __init__(self, rate: Signal, cases: int) -> None:
        self.rate, self.total = rate, np.zeros(cases)
        self.before = self.after = np.zeros(0)
        """The integrals (pool,) at both ends of the last step that was followed; `after` counts only where it is accepted."""

    def follow(self, stride: Stride, system: Films) -> None:
        """Add a step."""
        steps = DenseSteps.of(stride, slice(system.border, None), np.arange(stride.cases.size))
        self.before = self.total[stride.cases]
        self.after = self.before + self._within(steps, system, stride.accepted.astype(float))
        self.total[stride.cases[stride.accepted]] = self.after[stride.accepted]

    def along(self, stride: Stride, system: Films, columns: Cases, fraction: Floats) -> Floats:
        """The integrals (k,) of `columns` (k,) at fractions (k,) of the last step that was followed."""
        steps = DenseSteps.of(stride, slice(system.border, None), columns)
        return self.before[columns] + self._within(steps, system.take(columns), fraction)

    def at(self, brackets: Brackets, before: Floats, time: Floats, system: Films) -> Floats:
        """The integrals (k,) at `time` (k,) within steps, given the integrals `before` (k,) at the beginning of these steps."""
        steps = brackets.steps.take(np.arange(before.size), slice(system.border, None))
        return before + self._within(steps, system, np.clip((time - steps.time) / steps.step, 0.0, 1.0))

    def reached(self, brackets: Brackets, system: Films) -> tuple[Floats, Moment]:
        """The time (k,) in s since the span began at which the integral reaches 1, and the films then.

        The integral is `last` at the beginning of a step and `value` at its end.
        """
        begin, end = np.zeros_like(brackets.last), np.ones_like(brackets.last)
        steps = brackets.steps.take(np.arange(begin.size), slice(system.border, None))
        part = fall(lambda part: 1 - brackets.last - self._within(steps, system, part), begin, end)
        return brackets.at(part, brackets.steps, system)

    def _within(self, steps: DenseSteps, system: Films, part: Floats) -> Floats:
        """The integral (k,) over the first `part` (k,) of the steps, whose states hold the rows of the border."""

        def rate(columns: Cases, fraction: Floats) -> Floats:
            is_subset = not np.array_equal(columns, all_columns)
            chosen, films = (steps.take(columns), system.take(columns)) if is_subset else (steps, system)
            time = chosen.time + fraction * chosen.step
            return self.rate(Moment.of(films, chosen.cases, np.zeros_like(time), time, chosen.state(fraction)))

        all_columns = np.arange(part.size)
        with np.errstate(all="ignore"):  # where the rate overflows, the film fails
            return integrals(rate, np.zeros_like(part), part) * steps.step
