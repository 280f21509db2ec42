"""The residual of loaded material points and its arrowhead Jacobian (Sec. 3 of DOI 10.1115/1.4030850).

The state of one point is a column (2n + 2,): x_i = 2 ln xi_i of the n springs, axis 1 then axis 2, and last the unknowns of axes 1
and 2: Lambda_i = 2 ln lambda_i where the stress is prescribed, the nominal stress s_i where the stretch is. Spring 0 is the
equilibrium spring, treated as a branch that never flows. The equations are

    dx_i/dt = (2p - q, 2q - p)_i / (3 tau),                                 one pair for each spring (`flow`),
    0 = sum mu p - m_1 - s_1 lambda_1,  and the same for axis 2 with q and m_2,

where m is the Maxwell stress, eps E^2 in both axes if the permittivity does not depend on stretch (`electric`). They are a
differential-algebraic system of index 1. The springs couple only through the last two rows, so a linear solve is one 2x2 solve per
spring, a sum over the springs, and one further 2x2 solve. The last axis of arrays is the cases, which are independent: no result
depends on the cases beside it.

Under a load that keeps every spring symmetric, axis 1 stands for both, and half of the rows are enough: under uniaxial stress
lambda_2 = lambda_1^(-1/2) and xi_2 = xi_1^(-1/2) hold exactly, under equibiaxial load lambda_2 = lambda_1 and xi_2 = xi_1. A state
is then a column (n + 1,), x of axis 1 and its unknown, and every solve is one of a single row. In arrays, `axes` is 1 or 2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.material.springs import UNIAXIAL, Symmetry
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.elimination import Eliminated, stress_of, tangent_of
from dielast.mechanics.flow import Mobility
from dielast.mechanics.path import StretchPath
from dielast.mechanics.point_material import PointMaterial, in_both_axes
from dielast.mechanics.span import Control, Load, UnderLoad, stretched
from dielast.numerics.arrays import Flags, Floats
from dielast.numerics.response import Fading, Response, relaxed
from dielast.numerics.stride import Inner

# weight of unknowns that respond at once to a moving load: within a step they are less smooth than the error estimate at its end
# shows; on a sine of the stretch, where that estimate passes through 0, the error within the step is estimated itself
FOLLOWER_WEIGHT = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class LoadedPoints(UnderLoad):
    """Material points in one smooth span of load, which keeps the `symmetry`, if there is one: the system that the stepper
    integrates. A nominal field is compatible only with equibiaxial symmetry.
    """

    points: PointMaterial
    load: Load
    symmetry: Symmetry | None = None
    slack: Flags | None = None
    """The points (cases,) whose axis 1 is free of stress although a load prescribes the distance of its grips; None: no point."""

    axes: int = field(init=False)
    """The number of axes in the state."""
    border: int = field(init=False)
    """Index of the first row of the border, counted from the end of the state."""
    held: tuple[bool | Flags, ...] = field(init=False)
    """Whether the stretch of each axis is prescribed, for all points alike, or in flags (cases,)."""

    CHARGES: ClassVar[int] = 0
    """The number of charges among the unknowns."""

    def __post_init__(self) -> None:
        axes = 2 if self.symmetry is None else 1
        held: list[bool | Flags] = [control is Control.STRETCH for control in self.load.controls[:axes]]
        if self.slack is not None and held[0] and self.slack.any():
            held[0] = ~self.slack
        for name, value in (("axes", axes), ("border", -axes - self.CHARGES), ("held", tuple(held))):
            object.__setattr__(self, name, value)

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats) -> Floats:
        """State (rows, cases) from x (2, n, cases), Lambda and nominal stress (2, cases)."""
        held = np.array([np.broadcast_to(axis, nominal_stress.shape[1]) for axis in self.held])
        unknown = np.where(held, nominal_stress[: self.axes], log_squared_stretch[: self.axes])
        return np.concatenate((internal[: self.axes].reshape(-1, internal.shape[2]), unknown))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        internal = self.packed(state)
        return internal if self.symmetry is None else np.concatenate((internal, self.symmetry.second * internal))

    def packed(self, state: Floats) -> Floats:
        """x (axes, n, cases) of a state."""
        return state[: self.border].reshape(self.axes, -1, state.shape[1])

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress, both (2, cases), of a `state` under the prescribed values `driven` (3, cases)."""
        log_squared, nominal = self.unknown(state, driven)
        if self.symmetry is None:
            return log_squared, nominal
        second = np.zeros_like(nominal) if self.symmetry == UNIAXIAL else nominal
        return np.concatenate((log_squared, self.symmetry.second * log_squared)), np.concatenate((nominal, second))

    def unknown(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress (axes, cases), of which the border holds one and the load prescribes the other."""
        axes = self.axes
        unknown, prescribed, held = state[-axes:], driven[:axes], self.held
        if self.points.edges is not None:
            prescribed = self._with_springs(unknown, prescribed)
        if all(axis is False for axis in held):
            return unknown, prescribed
        if all(axis is True for axis in held):
            return 2.0 * np.log(prescribed), unknown
        log_squared_stretch, nominal_stress = unknown.copy(), prescribed.copy()
        for axis, fixed in enumerate(held):
            if fixed is not False:
                free = 0.0 if fixed is True else unknown[axis]
                log_squared_stretch[axis] = np.where(fixed, 2.0 * np.log(prescribed[axis]), free)
                nominal_stress[axis] = np.where(fixed, unknown[axis], 0.0)
        return log_squared_stretch, nominal_stress

    def _with_springs(self, unknown: Floats, prescribed: Floats) -> Floats:
        """The prescribed values (axes, cases), less what springs at the edges bear along axes of prescribed stress."""
        assert self.points.edges is not None
        free = ~stretched(self.load.controls)[: self.axes]
        borne = self.points.edges.borne(in_both_axes(np.where(free, unknown, 0.0)))[: self.axes]
        return np.where(free, prescribed - borne, prescribed)

    def error(self, state: Floats, increment: Floats, inner: Inner | None = None) -> Floats:
        """Largest relative error (cases,) of stretches, stresses and viscous stretches due to an `increment` of the `state`."""
        load, worst = self.load, 0.5 * np.maximum.reduce(np.abs(increment[: self.border]), axis=0)
        following = 0.5 if load.still else np.where(load.moving, 0.5 * FOLLOWER_WEIGHT, 0.5)
        for axis, held in enumerate(self.held):
            row = axis - self.axes
            change = np.abs(increment[row])
            of_stretch = change * following
            if held is not False:
                change = change * FOLLOWER_WEIGHT if inner is None else np.maximum(change, inner(row))
                change /= np.abs(state[row]) + self.points.stress_floor
                of_stretch = change if held is True else np.where(held, change, of_stretch)
            worst = np.maximum(worst, of_stretch)
        return np.asarray(worst)

    def fading(self, time: Floats, state: Floats, lasts: Floats) -> Fading | None:
        """What fades in a `state` (rows, cases) at `time` (cases,) in s, in a load that `lasts` (cases,) s more: known where the
        stretches of all axes are prescribed, so that every spring responds for itself.

        With e = Lambda - x, de/dt = dLambda/dt - g(e), the rate a = dx/dt - dLambda/dt fades, and e with it by a (1 - exp(-k t))/k.
        Then the rate is not that of the load by what g is not linear, and by the lag of x behind the rate of the load.
        """
        if not all(control is Control.STRETCH for control in self.load.controls[: self.axes]):
            return None
        points, axes = self.points, self.axes
        driven, slope, bend = self.driven(time, state)[:axes], self.load.slope(time)[:axes], self.load.bend(time)[:axes]
        log_squared, _ = self.unknown(state, self.driven(time, state))
        ahead = 2 * slope / driven
        ahead_change = 2 * bend / driven - 0.5 * np.square(ahead)
        elastic = log_squared[:, None] - self.packed(state)
        flow = points.flow.over(np.ones_like(time), self.symmetry)
        stress, tangent = tangent_of(points.law, self.symmetry, elastic.copy())
        block = flow.mobility(stress).through(tangent)
        now = flow.rate(stress)
        rate = self.lifted() * (now - ahead[:, None])
        decay = decay_along(rate, np.einsum("abnm,bnm->anm", block, rate))
        share = relaxed(decay * lasts)
        fallen = elastic - rate * lasts * share
        then = flow.rate(stress_of(points.law, self.symmetry, fallen))
        beyond = then - now + rate * (decay * lasts * share) - ahead_change[:, None] * lasts * share
        sure = np.isfinite(rate) & np.isfinite(beyond)
        return Fading(np.where(sure, rate, 0.0), np.where(sure, self.lifted() * beyond, 0.0))

    def lifted(self) -> Floats:
        """1 for springs that flow under prescribed stretches, else 0 (n, cases): their known part follows the load."""
        fluidity = self.points.flow.fluidity
        known = np.logical_and.reduce([np.broadcast_to(held, fluidity.shape[-1]) for held in self.held])
        return np.where(known & (fluidity > 0), 1.0, 0.0)

    def linearise(self, times: Floats, state: Floats, step: Floats, gamma: float, fading: Floats | None = None) -> Arrowhead:
        """The linear system of a step (cases,) in s from `state`, whose stages are at `times` (stages, cases); the rates
        (axes, n, cases) that are `fading` are known.
        """
        return Arrowhead(self, times, state, step, gamma, fading)


def decay_along(rate: Floats, change: Floats) -> Floats:
    """The rate (n, cases) at which a = `rate` (axes, n, cases) fades by da/dt = -B a, from `change` = B a: Rayleigh's quotient,
    that of the direction of a, along which a flow that is activated by stress relaxes far faster than across it.
    """
    size = np.add.reduce(np.square(rate), axis=0)
    along = np.add.reduce(rate * change, axis=0)
    return np.maximum(along / np.where(size > 0, size, 1.0), 0.0)


class Arrowhead:
    """The linear system of one step, factorised; its cost is linear in the number of springs.

    The block of a spring is D = 1/gamma + h G K (`elimination`), and the condensed tangent is sum mu Q / gamma. Where the
    right-hand side of a spring is r and Lambda changes by u_L, x changes by D^-1 r + h G Q u_L, as D^-1 G K = G Q.
    """

    def __init__(
        self, system: LoadedPoints, times: Floats, state: Floats, step: Floats, gamma: float, fading: Floats | None = None
    ) -> None:
        points, load, symmetry = system.points, system.load, system.symmetry
        self.system, self.points, self.symmetry, self.hold = system, points, symmetry, 1 / gamma
        self.axes, self.border, self.held = system.axes, system.border, system.held
        self.moves, self.electric = not load.still, system.electric
        self.free = [axis for axis, held in enumerate(self.held) if held is not True]
        self.stretched = any(held is not False for held in self.held)
        self.driven = load.values(times)
        if not self.free:  # the stretches of all stages are known
            self.held_stretch = self.driven[:, : self.axes]
            self.held_log_squared = 2.0 * np.log(self.held_stretch)
        self.maxwell = self._known_maxwell_stress() if self.electric and not self.free else None
        driven = self._driven(0, state)
        log_squared, self.stretch, nominal = self._membrane(0, state, driven)
        self.stress, tangent = tangent_of(points.law, symmetry, log_squared[:, None] - system.packed(state))
        self.flow = points.flow.over(step, symmetry)
        mobility = self.flow.mobility(self.stress)
        self.springs = Eliminated.of(tangent, mobility, self.hold)
        self.following = mobility.times(self.springs.share)
        change = step * load.slope(times[0]) if self.moves else None
        self.fading: Floats | None = None
        self.bent: Floats | None = None
        self.lifted: Floats | None = None
        if fading is not None:
            self._respond(fading, times, step, tangent, mobility)
        self._condense(change, driven, log_squared, nominal)

    def _respond(self, fading: Floats, times: Floats, step: Floats, tangent: Floats, mobility: Mobility) -> None:
        """Set the `response` to rates that are `fading` (axes, n, cases), and in the stages at `times` (stages, cases) its values
        `known` and, times the step, its rates; `tangent` is K, for one axis that of Q.
        """
        share, axes = (times - times[0]) / np.where(step > 0, step, 1.0), self.axes
        rate = fading * step
        if axes == 1:
            decay = np.maximum(1 / self.springs.diagonal[0] - self.hold, 0.0)
            carried = tangent / self.springs.diagonal * rate
        else:
            block = mobility.through(tangent)
            moved = np.einsum("abnm,bnm->anm", block, rate)
            decay = decay_along(rate, moved)
            carried = np.stack((tangent[0] * rate[0] + tangent[1] * rate[1], tangent[1] * rate[0] + tangent[2] * rate[1]))
            self.bent = decay * rate - moved
        border = -self.points.modulus * carried / self.stretch[:, None]
        response = relaxed(decay, share[:, None])
        stages, cases = share.shape
        inner, right = rate * response[:, None], rate * (1 - decay * response)[:, None]
        path = StretchPath(self.system.load, times[0], self.system.lifted(), self.driven[0, :axes])
        if self.moves:
            lifted = self.lifted = path.lifted
            inner += lifted * path.change(times - times[0])[:, :, None]
            right += lifted * (step * path.rate(times - times[0]))[:, :, None]
            bend = np.square(step) * path.bend()
            self.bent = -lifted * bend[:, None] if self.bent is None else self.bent - lifted * bend[:, None]
        inner, self.fading = inner.reshape(stages, -1, cases), right
        charges = np.zeros((stages, self.system.CHARGES, cases))
        self.known = np.concatenate((inner, charges, np.einsum("anm,snm->sam", border, response)), axis=1)
        rows = np.concatenate((np.zeros((self.system.CHARGES, *decay.shape)), border)) / step
        index = tuple(range(decay.shape[0])) * axes
        self.response = Response(decay / step, fading.reshape(-1, cases), rows, self.known[-1], index, path)

    def _driven(self, stage: int, state: Floats) -> Floats:
        """The prescribed values (3, cases) of a stage at `state`."""
        driven: Floats = self.driven[stage]
        return driven

    def _known_maxwell_stress(self) -> Floats | None:
        """The Maxwell stress (stages, 1, cases) in Pa at the prescribed stretches, None where it needs the state."""
        if self.points.stretching:
            return None
        log_area = self.held_log_squared[:, 0] + self.held_log_squared[:, -1]
        return self.points.electric.stress(self.points.permittivity, log_area, self.driven[:, ELECTRIC])[:, None]

    def _membrane(self, stage: int, state: Floats, driven: Floats) -> tuple[Floats, Floats, Floats]:
        """Lambda, the stretch and the nominal stress (axes, cases) in a stage."""
        if not self.free:
            return self.held_log_squared[stage], self.held_stretch[stage], state[-self.axes :]
        if self.stretched or self.points.edges is not None:
            log_squared, nominal = self.system.unknown(state, driven)
        else:
            log_squared, nominal = state[-self.axes :], driven[: self.axes]
        stretch = np.exp(0.5 * log_squared)
        if self.system.slack is not None:  # rounded as if no other point were slack
            for axis, held in enumerate(self.held):
                stretch[axis] = np.where(held, driven[axis], stretch[axis])
        return log_squared, stretch, nominal

    def _condense(self, change: Floats | None, driven: Floats, log_squared: Floats, nominal: Floats) -> None:
        """Set the inverse (axes, axes, cases) of the border's matrix, and the right-hand side due to the rates of the prescribed
        values; `change` (3, cases) is these rates times the step, None for a load that is still.
        """
        stretch, axes, points = self.stretch, self.axes, self.points
        tangent = np.einsum("nm,bcnm->bcm", points.modulus, self.springs.share)
        tangent *= self.hold
        for axis in range(axes):
            tangent[axis, axis] -= 0.5 * nominal[axis] * stretch[axis]
        if (edges := points.edges) is not None:
            held = edges.tangent(in_both_axes(log_squared))
            for axis in self.free:
                tangent[axis, axis] += held[axis]
        self.load_term = np.zeros(stretch.shape)
        if self.electric:
            _, by_stretch, by_load = points.maxwell_tangent(log_squared, driven[ELECTRIC])
            tangent -= by_stretch
            self._drive(by_load, change)
        matrix = by_path = tangent
        if self.lifted is not None:  # the springs that follow the path of the load do so in the known part
            of_springs = np.einsum("nm,bcnm->bcm", points.modulus * self.lifted, self.springs.share)
            by_path = tangent - of_springs * self.hold
        if self.stretched:
            matrix, self.prescribed_change = tangent.copy(), np.zeros(stretch.shape)
        for axis, fixed in enumerate(self.held):
            if fixed is False:
                if change is not None:
                    self.load_term[axis] += stretch[axis] * change[axis]
            else:
                if change is not None:
                    self.prescribed_change[axis] = np.where(fixed, 2 * change[axis] / driven[axis], 0.0)
                    self.load_term -= by_path[:, axis] * self.prescribed_change[axis]
                loose = 0.0 if fixed is True else np.where(fixed, 0.0, matrix[axis, axis])
                matrix[:, axis] = np.where(fixed, 0.0, matrix[:, axis])
                matrix[axis, axis] = np.where(fixed, -stretch[axis], loose)
        if axes == 1:
            self.inverse = 1 / matrix
            return
        determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
        self.inverse = np.empty_like(matrix)
        self.inverse[0, 0], self.inverse[1, 1] = matrix[1, 1], matrix[0, 0]
        self.inverse[0, 1], self.inverse[1, 0] = -matrix[0, 1], -matrix[1, 0]
        self.inverse /= determinant

    def _drive(self, by_load: Floats, change: Floats | None) -> None:
        """Add the right-hand side due to the rate of the electrical quantity; `by_load` is the derivative of the Maxwell stress."""
        if change is not None:
            self.load_term += by_load * change[ELECTRIC]

    def increment(self, stage: int, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i of a stage at `state`, in `out`; `history` is sum_j c_ij u_j, None in the first stage."""
        points, axes, border, shape, stress = self.points, self.axes, self.border, self.stress.shape, self.stress
        driven, follows = self._driven(stage, state), gamma_i != 0 and self.moves
        log_squared, stretch, nominal = self._membrane(stage, state, driven)
        if history is None:
            right = self.flow.rate(stress)
        else:
            stress = stress_of(points.law, self.symmetry, log_squared[:, None] - state[:border].reshape(shape))
            right = self.flow.rate(stress)
            right += history[:border].reshape(shape)
        if self.fading is not None:
            right -= self.fading[stage]
            if self.bent is not None and gamma_i:
                right += gamma_i * self.bent
        carried = self.springs.carried(right)
        carried -= stress
        residual = np.einsum("nm,cnm->cm", points.modulus, carried)
        residual += nominal * stretch
        if self.maxwell is not None:
            residual += self.maxwell[stage]
        elif self.electric:
            residual += points.maxwell_stress(log_squared, driven[ELECTRIC])
        if follows:
            residual += gamma_i * self.load_term
        self._border(residual, out=out[-axes:])
        self._charge(stage, log_squared, state, history, gamma_i, out)
        assert out.flags.c_contiguous  # otherwise `reshape` copies, and the increments of the springs are lost
        internal = out[:border].reshape(shape)
        self.springs.solve(right, out=internal)
        if self.free or (follows and self.lifted is None):
            change = self._change_of_stretch(out[-axes:], gamma_i)
            internal += self._followed(change) if self.lifted is None else self._followed(change) * (1 - self.lifted)
        return out

    def _followed(self, change_of_stretch: Floats) -> Floats:
        """The change of x (axes, n, cases) that follows a change of Lambda (axes, cases)."""
        if self.axes == 1:
            return np.asarray(self.following[0] * change_of_stretch)
        return np.asarray(np.einsum("abnm,bm->anm", self.following, change_of_stretch))

    def _charge(self, stage: int, log_squared: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> None:
        """Complete the border of the increment `out` of a stage at `state` and Lambda, `log_squared` (axes, cases), by that of the
        charge, which a prescribed field does not have as an unknown.
        """

    def _border(self, right: Floats, out: Floats | None = None) -> Floats:
        """The rows of the unknown stretches or stresses (axes, cases) of the increment for a right-hand side (axes, cases)."""
        if self.axes == 1:
            return np.asarray(np.multiply(self.inverse[0], right, out=out))
        return np.einsum("bcm,cm->bm", self.inverse, right, out=out)

    def _change_of_stretch(self, border: Floats, gamma_i: float) -> Floats:
        """The increment of Lambda (axes, cases) that belongs to the last rows `border` (axes, cases)."""
        if not self.stretched:
            return border
        change = self.prescribed_change * gamma_i
        for axis in self.free:
            change[axis] = np.where(self.held[axis], change[axis], border[axis])
        return change
