"""Films whose charge is an unknown, in a `circuit`: the equations of `point` and `symmetric` with one more row.

The state holds the nominal charge density D~ (C/m^2) in the row before the unknown stretches or stresses. The film responds to D~
as to a prescribed charge, and D~ changes at the rate f = dD~/dt of the circuit, which depends on D~ and on the stretches, not on
the springs. So the border of one step is solved with D~ fixed, u = u_0, and for a unit change of D~, u = w, and the increment u_D
of the charge follows from

    (1/gamma - h f_D - h f_L w_L) u_D = h f + sum c_j u_D,j + h^2 gamma_i f_t + h f_L u_0L,

with f_L the derivatives of f in Lambda, and w_L, u_0L the Lambda parts of w and u_0. The cost is that of the film plus one
evaluation of f.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dielast.mechanics.circuit import Circuit
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.point import Arrowhead, LoadedPoints, Points
from dielast.mechanics.span import Control, Load, UnderLoad
from dielast.mechanics.symmetric import SymmetricArrowhead, SymmetricPoints
from dielast.numerics.arrays import Cases, Floats


def circuit_of(points: Points) -> Circuit:
    """The circuit of points that have one (asserted)."""
    assert points.circuit is not None
    return points.circuit


def charge_rate(points: Points, load: Load, time: Floats, log_squared_stretch: Floats, charge: Floats) -> Floats:
    """dD~/dt (cases,) in A/m^2 at `time` (cases,) in s since the span began, Lambda (2, cases) and D~ (cases,)."""
    circuit, permittivity = circuit_of(points), points.permittivity_at(log_squared_stretch)
    log_area = log_squared_stretch[0] + log_squared_stretch[1]
    source, slope = load.value(time)[ELECTRIC], load.slope(time)[ELECTRIC]
    supply = circuit.supply(permittivity, log_area, charge, source, slope)
    return np.asarray(supply - circuit.leak(permittivity, log_area, charge))


def charge_error(points: Points, state: Floats, increment: Floats) -> Floats:
    """The relative error (cases,) of the Maxwell stress due to an `increment` (cases,) of the charge D~ in `state` (cases,).

    It is relative to the stress floor where the Maxwell stress is below that.
    """
    return np.asarray(np.abs(increment) / (np.abs(state) + np.sqrt(points.permittivity * points.stress_floor)))


class _Charged(UnderLoad):
    """Films whose charge is an unknown, in the first row of the border."""

    __slots__ = ()

    @property
    def electric(self) -> bool:
        """Whether there may be a Maxwell stress: always."""
        return True

    def driven(self, time: Floats, state: Floats, some: Cases | None = None) -> Floats:
        """The prescribed values (3, k), with D~ of the state in place of the quantity that the source prescribes."""
        driven = self.load.value(time, some).copy()
        driven[ELECTRIC] = state[self.border]
        return driven


@dataclass(frozen=True, slots=True, eq=False)
class ChargedPoints(_Charged, LoadedPoints):
    """Material points whose charge is an unknown."""

    @property
    def border(self) -> int:
        """Index of the first row of the border, which is that of the charge, counted from the end of the state."""
        return -3

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats, charge: Floats | None = None) -> Floats:
        """State (2n + 3, cases) from x (2, n, cases), Lambda and nominal stress (2, cases), and D~ (cases,), by default 0."""
        return _with_charge(LoadedPoints.pack(self, internal, log_squared_stretch, nominal_stress), -2, charge)

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,), including that of the charge."""
        return np.maximum(LoadedPoints.error(self, state, increment), charge_error(self.points, state[-3], increment[-3]))

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> ChargedArrowhead:
        """The linear system of a step (cases,) in s that starts at `time` and `state`."""
        return ChargedArrowhead(self, time, state, step, gamma)


@dataclass(frozen=True, slots=True, eq=False)
class ChargedSymmetricPoints(_Charged, SymmetricPoints):
    """Material points under equibiaxial load whose charge is an unknown."""

    @property
    def border(self) -> int:
        """Index of the first row of the border, which is that of the charge, counted from the end of the state."""
        return -2

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats, charge: Floats | None = None) -> Floats:
        """State (n + 2, cases) from x (2, n, cases), Lambda and nominal stress (2, cases), and D~ (cases,), by default 0."""
        return _with_charge(SymmetricPoints.pack(self, internal, log_squared_stretch, nominal_stress), -1, charge)

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,), including that of the charge."""
        rows = [*range(state.shape[0] - 2), -1]
        film = SymmetricPoints.error(self, state[rows], increment[rows])
        return np.maximum(film, charge_error(self.points, state[-2], increment[-2]))

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> ChargedSymmetricArrowhead:
        """The linear system of a step (cases,) in s that starts at `time` and `state`."""
        return ChargedSymmetricArrowhead(self, time, state, step, gamma)


def _with_charge(packed: Floats, row: int, charge: Floats | None) -> Floats:
    """The state with D~, by default 0, inserted before this row."""
    held = np.zeros(packed.shape[1]) if charge is None else charge
    return np.concatenate((packed[:row], held[None], packed[row:]))


class _ChargeRow:
    """The row of the charge in the linear system of one step: its derivatives at the start, and its right-hand side in a stage."""

    def __init__(self, points: Points, load: Load, time: Floats, log_squared: Floats, charge: Floats, step: Floats) -> None:
        circuit = circuit_of(points)
        self.points, self.load, self.step = points, load, step
        permittivity, share = points.capacitance(log_squared)
        by_charge, by_stretch = circuit.linearised(permittivity, share, log_squared[0] + log_squared[1], charge)
        self.by_charge, self.by_stretch = step * by_charge, step * by_stretch
        slope, bend = load.slope(time)[ELECTRIC], load.bend(time)[ELECTRIC]
        self.by_time = np.square(step) * circuit.supply_change(slope, bend)

    def right(self, time: Floats, log_squared: Floats, charge: Floats, history: Floats | None, gamma_i: float) -> Floats:
        """The right-hand side (cases,): h f + `history` + h^2 gamma_i f_t, where `history` is sum_j c_ij u_j of this row."""
        right = self.step * charge_rate(self.points, self.load, time, log_squared, charge)
        if history is not None:
            right += history
        if gamma_i:
            right += gamma_i * self.by_time
        return right


class ChargedArrowhead(Arrowhead):
    """The linear system of one step, with a row for the charge."""

    system: ChargedPoints

    def __init__(self, system: ChargedPoints, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        super().__init__(system, time, state, step, gamma)
        log_squared = system.membrane(state, system.driven(time, state))[0]
        self.row = row = _ChargeRow(system.points, system.load, time, log_squared, state[-3], step)
        self.moving = np.array([[control is Control.STRESS] for control in system.load.controls])
        self.by_charge = np.einsum("bcm,cm->bm", self.inverse, self.by_load)
        unit_change = np.where(self.moving, self.by_charge, 0.0)
        self.pivot = 1 / gamma - row.by_charge - np.einsum("cm,cm->m", row.by_stretch, unit_change)

    def _drive(self, by_load: Floats, change: Floats) -> None:
        """Keep the derivatives in the charge: the charge is an unknown, not prescribed."""
        self.by_load = np.broadcast_to(by_load, self.load_term.shape)

    def _solve(self, residual: Floats, border: Floats, increment: Floats, *stage: Any) -> None:
        """Write the last three rows of the increment: the charge, and the two rows of `border`."""
        time, state, history, gamma_i = stage
        np.einsum("bcm,cm->bm", self.inverse, residual, out=border)
        log_squared = self.system.membrane(state, self.system.driven(time, state))[0]
        right = self.row.right(time, log_squared, state[-3], None if history is None else history[-3], gamma_i)
        right += np.einsum("cm,cm->m", self.row.by_stretch, np.where(self.moving, border, gamma_i * self.prescribed_change))
        increment[-3] = right / self.pivot
        border += self.by_charge * increment[-3]


class ChargedSymmetricArrowhead(SymmetricArrowhead):
    """The linear system of one step, with a row for the charge: `ChargedArrowhead` with a scalar in place of the 2x2 border."""

    system: ChargedSymmetricPoints

    def __init__(self, system: ChargedSymmetricPoints, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        super().__init__(system, time, state, step, gamma)
        log_squared = system.membrane(state, system.driven(time, state))[0]
        self.row = row = _ChargeRow(system.points, system.load, time, log_squared, state[-2], step)
        self.by_stretch = row.by_stretch[0] + row.by_stretch[1]
        self.by_charge = self.border * self.by_load
        unit_change = self.by_charge if self.prescribed_change is None else np.zeros_like(self.by_charge)
        self.pivot = 1 / gamma - row.by_charge - self.by_stretch * unit_change

    def _drive(self, by_load: Floats, change: Floats) -> None:
        """Keep the derivative in the charge: the charge is an unknown, not prescribed."""
        self.by_load = by_load

    def _solve(self, residual: Floats, increment: Floats, *stage: Any) -> Floats:
        """The last row (cases,) of the increment; the row of the charge is written to `increment`."""
        time, state, history, gamma_i = stage
        residual *= self.border
        log_squared = self.system.membrane(state, self.system.driven(time, state))[0]
        right = self.row.right(time, log_squared, state[-2], None if history is None else history[-2], gamma_i)
        right += self.by_stretch * (residual if self.prescribed_change is None else gamma_i * self.prescribed_change)
        increment[-2] = right / self.pivot
        residual += self.by_charge * increment[-2]
        return residual
