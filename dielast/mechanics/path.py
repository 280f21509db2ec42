"""The part of a step that is known in closed form: what fades after a kink, and the path of prescribed stretches (`response`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.mechanics.span import Load
from dielast.numerics.arrays import ByCase, Floats
from dielast.numerics.response import Response, relaxed

MIDDLE = 0.5  # of a step: where observers evaluate every step


@dataclass(frozen=True, slots=True, eq=False)
class StretchPath(ByCase):
    """The path of prescribed stretches within one step, which springs that flow under them follow: a step under a `load` that
    begins at `begin` (cases,) in s since the span of load, at the stretches `start` (axes, cases). Springs that follow the path
    are `lifted` (n, cases) by it: 1, others 0.
    """

    load: Load
    begin: Floats
    lifted: Floats
    start: Floats

    def at(self, time: Floats) -> Floats:
        """The change (axes n, cases) of x that follows Lambda, at `time` (cases,) in s since the step began."""
        return self._lifted(self._change(self._stretch(time[None]))[0])

    def slope(self, time: Floats) -> Floats:
        """The rate (axes n, cases) of that change per s."""
        times = time[None]
        return self._lifted(self._rate(times, self._stretch(times))[0])

    def changes(self, times: Floats) -> tuple[Floats, Floats]:
        """The change of Lambda and its rate per s, both (k, axes, cases), at `times` (k, cases) in s since the step began."""
        stretch = self._stretch(times)
        return self._change(stretch), self._rate(times, stretch)

    def bend(self) -> Floats:
        """The second derivative (axes, cases) of Lambda per s^2 at the beginning of the step."""
        axes = len(self.start)
        ratio = self.load.slope(self.begin)[:axes] / self.start
        if self.load.wave is None:
            return np.asarray(-2 * np.square(ratio))
        return np.asarray(2 * (self.load.bend(self.begin)[:axes] / self.start - np.square(ratio)))

    def _stretch(self, times: Floats) -> Floats:
        return self.load.values(self.begin + times)[:, : len(self.start)]

    def _change(self, stretch: Floats) -> Floats:
        return np.asarray(2 * np.log(stretch / self.start))

    def _rate(self, times: Floats, stretch: Floats) -> Floats:
        return np.asarray(2 * self.load.slopes(self.begin + times)[:, : len(self.start)] / stretch)

    def _lifted(self, of_axes: Floats) -> Floats:
        return np.asarray((self.lifted * of_axes[:, None]).reshape(-1, of_axes.shape[1]))


def decay_along(rate: Floats, change: Floats) -> Floats:
    """The rate (n, cases) at which a = `rate` (axes, n, cases) fades by da/dt = -B a, from `change` = B a: Rayleigh's quotient,
    that of the direction of a, along which a flow that is activated by stress relaxes far faster than across it.
    """
    size = np.add.reduce(np.square(rate), axis=0)
    along = np.add.reduce(rate * change, axis=0)
    return np.asarray(np.maximum(along / np.where(size > 0, size, 1.0), 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class KnownPart:
    """What is known of the springs in the stages of a step: the change `inner` (stages, axes, n, cases) of x since the step began,
    and its rate times the step, `right` (stages, axes, n, cases).

    The system of the step contains them only to first order: its right-hand side lacks gamma_i times `bent` (axes, n, cases),
    None where that is 0. `response` is the known part of the whole state.
    """

    inner: Floats
    right: Floats
    bent: Floats | None
    response: Response

    @classmethod
    def of(
        cls, fading: Floats, times: Floats, step: Floats, decay: Floats, moved: Floats | None, path: StretchPath, others: int
    ) -> KnownPart:
        """The known part of a `step` (cases,) in s with stages at `times` (stages, cases), in which the rates `fading`
        (axes, n, cases) decay by `decay` (n, cases); `moved` (axes, n, cases) is what the system of the step takes for the decay
        of the rate times the step, None if it is the same. The state has `others` rows besides those of the springs.
        """
        (axes, springs, cases), stages = fading.shape, len(times)
        share = np.empty((stages + 1, 1, cases))
        np.divide(times - times[0], np.where(step > 0, step, 1.0), out=share[:stages, 0])
        share[-1] = MIDDLE
        rate = fading * step
        fallen, response = relaxed(decay, share)
        inner = rate * response[:, None]
        right = rate * (1 + fallen[:stages])[:, None]
        bent = None if moved is None else decay * rate - moved
        if not path.load.still:
            moments = np.concatenate((times - path.begin, MIDDLE * step[None]))
            change, pace = path.changes(moments)
            inner += path.lifted * change[:, :, None]
            right += path.lifted * (step * pace[:stages])[:, :, None]
            bend = path.lifted * (np.square(step) * path.bend())[:, None]
            bent = -bend if bent is None else bent - bend
        whole = np.zeros((2, axes * springs + others, cases))
        whole[:, :-others] = inner[-2:].reshape(2, -1, cases)
        of_rows = fading.reshape(-1, cases), others, whole[0], whole[1], tuple(range(springs)) * axes
        return cls(inner, right, bent, Response(decay / step, *of_rows, path))
