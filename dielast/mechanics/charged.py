"""Films whose charge is an unknown, in a circuit (`electric`): the equations of `point` with one more row.

The state holds the nominal charge density D~ (C/m^2) in the row before the unknown stretches or stresses. The film responds to D~
as to a prescribed charge, and D~ changes at the rate f = dD~/dt of the circuit, which depends on D~ and on the stretches, not on
the springs. So the border of one step is solved with D~ fixed, u = u_0, and for a unit change of D~, u = w, and the increment u_D
of the charge follows from

    (1/gamma - h f_D - h f_L w_L) u_D = h f + sum c_j u_D,j + h^2 gamma_i f_t + h f_L u_0L,

with f_L the derivatives of f in Lambda, and w_L, u_0L the Lambda parts of w and u_0. The cost is that of the film plus one
evaluation of f.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from dielast.mechanics.arrowhead import Arrowhead
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import in_both_axes
from dielast.numerics.arrays import Cases, Floats


class ChargedPoints(LoadedPoints):
    """Material points whose charge is an unknown, in the first row of the border."""

    __slots__ = ()

    CHARGES: ClassVar[int] = 1

    @property
    def electric(self) -> bool:
        """Whether there may be a Maxwell stress: always."""
        return True

    def driven(self, time: Floats, state: Floats, cases: Cases | None = None) -> Floats:
        """The prescribed values (3, k), with D~ of the state in place of the quantity that the source prescribes."""
        driven = self.load.value(time, cases).copy()
        driven[ELECTRIC] = state[self.border]
        return driven

    def pack(self, internal: Floats, log_squared_stretch: Floats, charge: Floats | None = None) -> Floats:
        """State (rows, cases) from x (2, n, cases), Lambda (2, cases) and D~ (cases,), by default 0."""
        packed = super().pack(internal, log_squared_stretch)
        charge = np.zeros(packed.shape[1]) if charge is None else charge
        return np.concatenate((packed[: self.border + 1], charge[None], packed[self.border + 1 :]))

    def error(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,), including that of the Maxwell stress due to an error of the charge.

        That is relative to the stress floor where the Maxwell stress is below it.
        """
        floor = np.sqrt(self.points.permittivity * self.points.stress_floor)
        of_charge = np.abs(increment[self.border]) / (np.abs(state[self.border]) + floor)
        return np.asarray(np.maximum(super().error(time, state, increment), of_charge))

    def linearise(self, times: Floats, state: Floats, step: Floats, gamma: float, fading: Floats | None = None) -> ChargedArrowhead:
        """As for films of a prescribed field."""
        return ChargedArrowhead(self, times, state, step, gamma, fading)


class ChargedArrowhead(Arrowhead):
    """The linear system of one step, with a row for the charge."""

    def __init__(
        self, system: ChargedPoints, times: Floats, state: Floats, step: Floats, gamma: float, fading: Floats | None = None
    ) -> None:
        super().__init__(system, times, state, step, gamma, fading)
        points, load, charge, axes = system.points, system.load, state[system.border], system.axes
        assert points.circuit is not None
        self.step, self.circuit = step, points.circuit
        self.source, self.slope = self.driven[:, ELECTRIC], load.slopes(times)[:, ELECTRIC]
        log_squared = in_both_axes(self._membrane(0, state, self._driven(0, state))[0])
        permittivity, share = points.capacitance(log_squared)
        by_charge, by_stretch = self.circuit.linearised(permittivity, share, log_squared[0] + log_squared[1], charge)
        by_stretch = step * by_stretch
        self.by_stretch = by_stretch if axes == 2 else np.sum(by_stretch, axis=0, keepdims=True)  # one axis stands for both
        self.by_time = np.square(step) * self.circuit.supply_change(self.slope[0], load.bend(times[0])[ELECTRIC])
        self.by_charge = self._border(self.by_load) if self.free else np.zeros_like(self.stretch)
        unit_change = self._change_of_stretch(self.by_charge, 0.0)
        self.pivot = 1 / gamma - step * by_charge - np.einsum("cm,cm->m", self.by_stretch, unit_change)

    def _driven(self, stage: int, state: Floats) -> Floats:
        """The prescribed values (3, cases) of a stage, with the charge at `state` in place of the source."""
        driven: Floats = self.driven[stage].copy()
        driven[ELECTRIC] = state[self.border]
        return driven

    def _drive(self, by_load: Floats, change: Floats | None) -> None:
        """Keep the derivatives in the charge: the charge is an unknown, not prescribed."""
        self.by_load = by_load

    def _charge(self, stage: int, log_squared: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> None:
        """Write the row of the charge, and add its effect on the rows of the film."""
        row = self.border
        border = out[row + 1 :]
        right = self.step * self._rate(stage, in_both_axes(log_squared), state[row])
        if history is not None:
            right += history[row]
        if gamma_i:
            right += gamma_i * self.by_time
        right += np.einsum("cm,cm->m", self.by_stretch, self._change_of_stretch(border, gamma_i))
        out[row] = right / self.pivot
        border += self.by_charge * out[row]

    def _rate(self, stage: int, log_squared_stretch: Floats, charge: Floats) -> Floats:
        """dD~/dt (cases,) in A/m^2 in a stage, at Lambda (2, cases) and D~ (cases,)."""
        permittivity = self.system.points.permittivity_at(log_squared_stretch)
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        supply = self.circuit.supply(permittivity, log_area, charge, self.source[stage], self.slope[stage])
        return supply if self.circuit.leakage is None else supply - self.circuit.leak(permittivity, log_area, charge)
