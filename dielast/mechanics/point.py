"""The residual of loaded material points and its arrowhead Jacobian (Sec. 3 of DOI 10.1115/1.4030850).

The state of one point is a column (2n + 2,): x_i = 2 ln xi_i of the n springs, axis 1 then axis 2, and last the unknowns of axes 1
and 2: Lambda_i = 2 ln lambda_i where the stress is prescribed, the nominal stress s_i where the stretch is. Spring 0 is the
equilibrium spring, treated as a branch that never flows. The equations are

    dx_i/dt = (2p - q, 2q - p)_i / (3 tau),                                 one pair for each spring,
    0 = sum mu p - m_1 - s_1 lambda_1,  and the same for axis 2 with q and m_2,

where m is the Maxwell stress, eps E^2 in both axes if the permittivity does not depend on stretch (`electric`). They are a
differential-algebraic system of index 1. The springs couple only through the last two rows, so a linear solve is one 2x2 solve per
spring, a sum over the springs, and one further 2x2 solve. The last axis of arrays is the cases, which are independent: no result
depends on the cases beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.elimination import Eliminated, flow_of
from dielast.mechanics.point_material import Points
from dielast.mechanics.span import Control, Load, UnderLoad, stretched
from dielast.numerics.arrays import Floats

# weight of unknowns that respond at once to a moving load: within a step they are less smooth than the error estimate at its end
# shows
FOLLOWER_WEIGHT = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class LoadedPoints(UnderLoad):
    """Material points in one smooth span of load: the system that the stepper integrates."""

    points: Points
    load: Load

    border: ClassVar[int] = -2
    """Index of the first row of the border, counted from the end of the state."""

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats) -> Floats:
        """State (2n + 2, cases) from x (2, n, cases), Lambda and nominal stress (2, cases)."""
        unknown = np.where(stretched(self.load.controls), nominal_stress, log_squared_stretch)
        return np.concatenate((internal.reshape(-1, internal.shape[2]), unknown))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        return state[: self.border].reshape(2, -1, state.shape[1])

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress, both (2, cases), of a `state` under the prescribed values `driven` (3, cases)."""
        unknown, prescribed = state[-2:], driven[:2]
        if Control.STRETCH not in self.load.controls:
            return unknown, prescribed
        log_squared_stretch, nominal_stress = unknown.copy(), prescribed.copy()
        for axis, control in enumerate(self.load.controls):
            if control is Control.STRETCH:
                log_squared_stretch[axis] = 2 * np.log(prescribed[axis])
                nominal_stress[axis] = unknown[axis]
        return log_squared_stretch, nominal_stress

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stresses and viscous stretches due to an `increment` of the `state`."""
        worst = 0.5 * np.max(np.abs(increment[: self.border]), axis=0)
        for row, control in ((-2, self.load.controls[0]), (-1, self.load.controls[1])):
            error = np.abs(increment[row])
            if control is Control.STRESS:
                error *= np.where(self.load.moving, 0.5 * FOLLOWER_WEIGHT, 0.5)
            else:
                error *= FOLLOWER_WEIGHT / (np.abs(state[row]) + self.points.stress_floor)
            worst = np.maximum(worst, error)
        return np.asarray(worst)

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> Arrowhead:
        """The linear system of a step (cases,) in s that starts at `time` and `state`."""
        return Arrowhead(self, time, state, step, gamma)


class BorderedStep:
    """Common to the linear systems of one step, with or without symmetry: the solution for the last `unknowns` rows, those of the
    stretches or stresses of the film.
    """

    unknowns: ClassVar[int]
    load_term: Floats

    def _border(self, right: Floats, out: Floats | None = None) -> Floats:
        """The last rows (unknowns, cases) of the increment for a right-hand side (unknowns, cases)."""
        raise NotImplementedError

    def _drive(self, by_load: Floats, change: Floats) -> None:
        """Add the right-hand side due to the rate of the electrical quantity; `by_load` is the derivative of the Maxwell stress."""
        self.load_term += by_load * change[ELECTRIC]

    def _solve(
        self, residual: Floats, increment: Floats, time: Floats, state: Floats, history: Floats | None, gamma_i: float
    ) -> None:
        """Write the border of the increment for the right-hand side `residual`, without that of the rates of the load."""
        if gamma_i:
            residual += gamma_i * self.load_term
        self._border(residual, out=increment[-self.unknowns :])


class Arrowhead(BorderedStep):
    """The linear system of one step, factorised; its cost is linear in the number of springs.

    The block of a spring is D = 1/gamma + h/(3 tau) F K (`elimination`), and the condensed tangent is sum Q / gamma.
    """

    unknowns: ClassVar[int] = 2

    def __init__(self, system: LoadedPoints, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.gamma = system, gamma
        points, load = system.points, system.load
        driven = system.driven(time, state)
        log_squared, nominal = system.membrane(state, driven)
        self.stress, tangent = points.law.tangent(points.springs(system.internal(state), log_squared))
        self.flow = step * points.rate
        self.springs = Eliminated.of(points.modulus, tangent, self.flow, 1 / gamma)
        self._condense(load, step * load.slope(time), driven, log_squared, nominal)

    def _condense(self, load: Load, change: Floats, driven: Floats, log_squared: Floats, nominal: Floats) -> None:
        """Set the inverse (2, 2, cases) of the border's matrix, and the right-hand side due to the rates of the prescribed values;
        `change` (3, cases) is these rates times the step.
        """
        points = self.system.points
        stretch = np.exp(0.5 * log_squared)
        tangent = np.add.reduce(self.springs.share, axis=2) / self.gamma
        tangent[(0, 1), (0, 1)] -= 0.5 * nominal * stretch
        self.load_term = np.zeros_like(stretch)
        if self.system.electric:
            _, by_stretch, by_load = points.maxwell_tangent(log_squared, driven[ELECTRIC])
            tangent -= by_stretch
            self._drive(by_load, change)
        self.tangent = tangent
        self.prescribed_change = np.zeros_like(stretch)
        matrix = tangent.copy()
        for axis, control in enumerate(load.controls):
            if control is Control.STRESS:
                self.load_term[axis] += stretch[axis] * change[axis]
            else:
                self.prescribed_change[axis] = 2 * change[axis] / driven[axis]
                self.load_term -= tangent[:, axis] * self.prescribed_change[axis]
                matrix[:, axis] = 0.0
                matrix[axis, axis] = -stretch[axis]
        determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
        self.inverse = np.empty_like(matrix)
        self.inverse[0, 0], self.inverse[1, 1] = matrix[1, 1], matrix[0, 0]
        self.inverse[0, 1], self.inverse[1, 0] = -matrix[0, 1], -matrix[1, 0]
        self.inverse /= determinant

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i of the stage at `time` and `state`, in `out`; `history` is sum_j c_ij u_j, None in the first stage."""
        system = self.system
        points = system.points
        driven = system.driven(time, state)
        log_squared, nominal = system.membrane(state, driven)
        stress = self.stress if history is None else points.law.stress(points.springs(system.internal(state), log_squared))
        right = flow_of(stress, self.flow)
        if history is not None:
            right += history[: system.border].reshape(right.shape)
        residual = np.einsum("bcnm,cnm->bm", self.springs.share, right)
        residual -= np.einsum("nm,cnm->cm", points.modulus, stress)
        residual += nominal * np.exp(0.5 * log_squared)
        if system.electric:
            residual += points.maxwell_stress(log_squared, driven[ELECTRIC])
        self._solve(residual, out, time, state, history, gamma_i)
        change_of_stretch = self._change_of_stretch(out[-2:], gamma_i)[:, None]
        right -= change_of_stretch * (1 / self.gamma)
        assert out.flags.c_contiguous  # otherwise `reshape` copies, and the increments of the springs are lost
        internal = out[: system.border].reshape(right.shape)
        self.springs.solve(right, out=internal)
        internal += change_of_stretch
        return out

    def _border(self, right: Floats, out: Floats | None = None) -> Floats:
        """The last two rows (2, cases) of the increment for a right-hand side (2, cases)."""
        return np.einsum("bcm,cm->bm", self.inverse, right, out=out)

    def _change_of_stretch(self, border: Floats, gamma_i: float) -> Floats:
        """The increment of Lambda (2, cases) that belongs to the last two rows `border` (2, cases)."""
        change = border.copy()
        for axis, control in enumerate(self.system.load.controls):
            if control is Control.STRETCH:
                np.multiply(self.prescribed_change[axis], gamma_i, out=change[axis])
        return change
