"""The path of prescribed stretches within one step, which springs that flow under them follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.mechanics.span import Load
from dielast.numerics.arrays import ByCase, Floats


@dataclass(frozen=True, slots=True, eq=False)
class StretchPath(ByCase):
    """A step under a `load` that begins at `begin` (cases,) in s since the span of load began, at the stretches `start`
    (axes, cases). Springs that follow the path are `lifted` (n, cases) by it: 1, others 0.
    """

    load: Load
    begin: Floats
    lifted: Floats
    start: Floats

    def at(self, time: Floats) -> Floats:
        """The change (axes n, cases) of x that follows Lambda, at `time` (cases,) in s since the step began."""
        return self._lifted(self.change(time[None])[0])

    def slope(self, time: Floats) -> Floats:
        """The rate (axes n, cases) of that change per s."""
        return self._lifted(self.rate(time[None])[0])

    def change(self, times: Floats) -> Floats:
        """The change (k, axes, cases) of Lambda at `times` (k, cases) in s since the step began."""
        return np.asarray(2 * np.log(self.load.values(self.begin + times)[:, : len(self.start)] / self.start))

    def rate(self, times: Floats) -> Floats:
        """The rate (k, axes, cases) of Lambda per s at `times` (k, cases) in s since the step began."""
        moments, axes = self.begin + times, len(self.start)
        return np.asarray(2 * self.load.slopes(moments)[:, :axes] / self.load.values(moments)[:, :axes])

    def bend(self) -> Floats:
        """The second derivative (axes, cases) of Lambda per s^2 at the beginning of the step."""
        axes = len(self.start)
        ratio = self.load.slope(self.begin)[:axes] / self.start
        return np.asarray(2 * (self.load.bend(self.begin)[:axes] / self.start - np.square(ratio)))

    def _lifted(self, of_axes: Floats) -> Floats:
        return np.asarray((self.lifted * of_axes[:, None]).reshape(-1, of_axes.shape[1]))
