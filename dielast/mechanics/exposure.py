"""What films have been exposed to: the integral of a rate over the time of the voltage programme, beside their states.

The rate is integrated over the dense output of each step, which is halved as often as the rate asks for. The integral is as exact
as the states are, and does not shorten the steps, as it would if it were one of the states.
"""

from __future__ import annotations

import numpy as np

from dielast.mechanics.brackets import Brackets
from dielast.mechanics.criteria.criterion import Moment, Signal
from dielast.mechanics.symmetric import Films
from dielast.numerics.columns import Cases, Floats
from dielast.numerics.quadrature import integrals
from dielast.numerics.roots import fall
from dielast.numerics.stride import DenseSteps, Stride


class Exposure:
    """The integral `total` (cases,) of a `rate` in 1/s, a function of a moment that needs no springs."""

    def __init__(self, rate: Signal, cases: int) -> None:
        self.rate, self.total = rate, np.zeros(cases)
        self.before = np.zeros(0)
        """At the beginning of the step that was followed last (pool,)."""

    def follow(self, stride: Stride, system: Films) -> tuple[Floats, Floats]:
        """Go through a step; the integrals (pool,) before and after it, as if it were accepted."""
        steps = DenseSteps.of(stride, slice(system.border, None), np.arange(stride.cases.size))
        before = self.total[stride.cases]
        after = before + self._within(steps, system, stride.accepted.astype(float))
        self.total[stride.cases[stride.accepted]] = after[stride.accepted]
        self.before = before
        return before, after

    def along(self, stride: Stride, system: Films, columns: Cases, fraction: Floats) -> Floats:
        """The integrals (k,) of `columns` (k,) at fractions (k,) of the step that was followed last."""
        steps = DenseSteps.of(stride, slice(system.border, None), columns)
        return self.before[columns] + self._within(steps, system.take(columns), fraction)

    def at(self, brackets: Brackets, before: Floats, time: Floats, system: Films) -> Floats:
        """The integrals (k,) at a `time` (k,) within steps at whose beginning they are those `before` (k,)."""
        steps = brackets.steps.take(np.arange(before.size), slice(system.border, None))
        return before + self._within(steps, system, np.clip((time - steps.time) / steps.step, 0.0, 1.0))

    def reached(self, brackets: Brackets, system: Films) -> tuple[Floats, Moment]:
        """The time (k,) since the span began at which the integral is 1, within steps before and after which it is `last` and
        `value`, and how the films are then.
        """
        begin, end = np.zeros_like(brackets.last), np.ones_like(brackets.last)
        steps = brackets.steps.take(np.arange(begin.size), slice(system.border, None))
        part = fall(lambda part: 1 - brackets.last - self._within(steps, system, part), begin, end)
        return brackets.at(part, brackets.steps, system)

    def _within(self, steps: DenseSteps, system: Films, part: Floats) -> Floats:
        """The integral (k,) over the first `part` (k,) of the steps, of which the rows of the border are there."""

        def rate(columns: Cases, fraction: Floats) -> Floats:
            left_out = not np.array_equal(columns, every)
            chosen, films = (steps.take(columns), system.take(columns)) if left_out else (steps, system)
            time = chosen.time + fraction * chosen.step
            return self.rate(Moment.of(films, chosen.cases, np.zeros_like(time), time, chosen.state(fraction)))

        every = np.arange(part.size)
        with np.errstate(all="ignore"):  # a rate beyond all numbers is one by which the film fails
            return integrals(rate, np.zeros_like(part), part) * steps.step
