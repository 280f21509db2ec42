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
from dielast.mechanics.span import Control, Load, UnderLoad
from dielast.numerics.arrays import Flags, Floats, paired
from dielast.numerics.response import Fading, Response, relaxed

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
    free: list[int] = field(init=False)
    """The axes whose stretch is not prescribed, or not for all points."""

    CHARGES: ClassVar[int] = 0
    """The number of charges among the unknowns."""

    def __post_init__(self) -> None:
        axes = 2 if self.symmetry is None else 1
        held: list[bool | Flags] = [control is Control.STRETCH for control in self.load.controls[:axes]]
        if self.slack is not None and held[0] and self.slack.any():
            held[0] = ~self.slack
        free = [axis for axis, fixed in enumerate(held) if fixed is not True]
        for name, value in (("axes", axes), ("border", -axes - self.CHARGES), ("held", tuple(held)), ("free", free)):
            object.__setattr__(self, name, value)

    @property
    def stretched(self) -> bool:
        """Whether the stretch of an axis is prescribed: its stress then follows from the springs."""
        return any(held is not False for held in self.held)

    @property
    def of_membrane(self) -> slice:
        """The rows of a state on which the membrane depends."""
        return slice(None) if self.stretched else slice(self.border, None)

    def pack(self, internal: Floats, log_squared_stretch: Floats) -> Floats:
        """State (rows, cases) from x (2, n, cases) and Lambda (2, cases)."""
        return np.concatenate((internal[: self.axes].reshape(-1, internal.shape[2]), log_squared_stretch[: self.axes]))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        internal = self.packed(state)
        return internal if self.symmetry is None else np.concatenate((internal, self.symmetry.second * internal))

    def packed(self, state: Floats) -> Floats:
        """x (axes, n, cases) of a state."""
        return state[: self.border].reshape(self.axes, -1, state.shape[1])

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress, both (2, cases), of a `state` under the prescribed values `driven` (3, cases).

        In a state of the border alone, the nominal stress along axes of prescribed stretch is NaN.
        """
        log_squared = self.log_squared(state, driven)
        nominal = self.applied(driven, log_squared)
        if self.stretched:
            carried = self._carried(state, driven, log_squared) * np.exp(-0.5 * log_squared)
            nominal = np.array([np.where(held, *both) for held, *both in zip(self.held, carried, nominal, strict=True)])
        if self.symmetry is not None:
            nominal = np.concatenate((nominal, np.zeros_like(nominal) if self.symmetry == UNIAXIAL else nominal))
        return self._of_both(log_squared), nominal

    def of_both_axes(self, state: Floats, driven: Floats) -> Floats:
        """Lambda (2, cases) of a `state` under the prescribed values `driven` (3, cases)."""
        return self._of_both(self.log_squared(state, driven))

    def _of_both(self, log_squared: Floats) -> Floats:
        return log_squared if self.symmetry is None else np.concatenate((log_squared, self.symmetry.second * log_squared))

    def log_squared(self, state: Floats, driven: Floats) -> Floats:
        """Lambda (axes, cases), which the border holds or the load prescribes."""
        unknown, prescribed = state[-self.axes :], driven[: self.axes]
        if not self.stretched:
            return unknown
        if all(axis is True for axis in self.held):
            return np.asarray(2.0 * np.log(prescribed))
        along = zip(self.held, prescribed, unknown, strict=True)
        return np.array([free if held is False else np.where(held, 2.0 * np.log(fixed), free) for held, fixed, free in along])

    def applied(self, driven: Floats, log_squared: Floats) -> Floats:
        """The nominal stress (axes, cases) that the load prescribes at Lambda (axes, cases), 0 along axes of prescribed stretch."""
        stress = driven[: self.axes]
        if self.stretched:
            stress = np.array(
                [load if held is False else np.zeros_like(load) for held, load in zip(self.held, stress, strict=True)]
            )
        if self.points.edges is None:
            return stress
        return np.asarray(stress - self.points.edges.borne(in_both_axes(log_squared))[: self.axes])

    def _carried(self, state: Floats, driven: Floats, log_squared: Floats) -> Floats:
        """The true mechanical stress (axes, cases) of the springs at Lambda (axes, cases), less the Maxwell stress."""
        if len(state) == -self.border:
            return np.full_like(log_squared, np.nan)
        columns = paired(np.arange(state.shape[1]))
        elastic = np.subtract(log_squared[:, None], self.packed(state), order="C").take(columns, axis=-1)
        stress = stress_of(self.points.law, self.symmetry, elastic)
        carried = np.einsum("nm,cnm->cm", self.points.modulus.take(columns, axis=-1), stress)[:, : state.shape[1]]
        return np.asarray(carried - self.points.maxwell_stress(log_squared, driven[ELECTRIC]) if self.electric else carried)

    def error(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stresses and viscous stretches due to an `increment` of the `state` at a
        `time` (cases,) in s.
        """
        load, worst = self.load, 0.5 * np.maximum.reduce(np.abs(increment[: self.border]), axis=0)
        of_stress = self._error_of_stress(time, state, increment) if self.stretched else None
        if self.free:
            following = 0.5 if load.still else np.where(load.moving, 0.5 * FOLLOWER_WEIGHT, 0.5)
            of_stretch = following * np.abs(increment[-self.axes :])
        for axis, held in enumerate(self.held):
            if held is False:
                worst = np.maximum(worst, of_stretch[axis])
            else:
                assert of_stress is not None
                worst = np.maximum(worst, of_stress[axis] if held is True else np.where(held, of_stress[axis], of_stretch[axis]))
        return np.asarray(worst)

    def _error_of_stress(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """The largest relative error (axes, cases) of the stresses at prescribed stretches due to that of the springs: errors of
        springs do not cancel, as they would now and then at the end of a step but not within it.
        """
        points, driven = self.points, self.driven(time, state)
        log_squared = self.log_squared(state, driven)
        stress, tangent = tangent_of(points.law, self.symmetry, log_squared[:, None] - self.packed(state))
        carried = np.einsum("nm,cnm->cm", points.modulus, stress)
        if self.electric:
            carried -= points.maxwell_stress(log_squared, driven[ELECTRIC])
        np.abs(tangent, out=tangent)
        tangent *= points.modulus
        strain = np.abs(self.packed(increment))
        pairs = (slice(None),) if self.axes == 1 else (slice(0, 2), slice(1, 3))  # the entries 11 and 12, 12 and 22
        change = np.stack([np.einsum("cnm,cnm->m", tangent[pair], strain) for pair in pairs])
        return np.asarray(change / (np.abs(carried) + points.stress_floor * np.exp(0.5 * log_squared)))

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
        log_squared = self.log_squared(state, self.driven(time, state))
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
    return np.asarray(np.maximum(along / np.where(size > 0, size, 1.0), 0.0))


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
        self.free = system.free
        self.stretched = system.stretched
        self.driven = load.values(times)
        if not self.free:  # the stretches of all stages are known
            self.held_stretch = self.driven[:, : self.axes]
            self.held_log_squared = 2.0 * np.log(self.held_stretch)
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
        self.prescribed_change = np.zeros(self.stretch.shape)
        if change is not None:
            for axis, held in enumerate(self.held):
                if held is not False:
                    self.prescribed_change[axis] = np.where(held, 2 * change[axis] / driven[axis], 0.0)
        if self.free:
            self._condense(change, driven, log_squared, nominal)

    def _respond(self, fading: Floats, times: Floats, step: Floats, tangent: Floats, mobility: Mobility) -> None:
        """Set the `response` to rates that are `fading` (axes, n, cases), and in the stages at `times` (stages, cases) its values
        `known` and, times the step, its rates; `tangent` is K of both axes.
        """
        share, axes = (times - times[0]) / np.where(step > 0, step, 1.0), self.axes
        rate = fading * step
        if axes == 1:
            decay = np.maximum(1 / self.springs.diagonal[0] - self.hold, 0.0)
        else:
            block = mobility.through(tangent)
            moved = np.einsum("abnm,bnm->anm", block, rate)
            decay = decay_along(rate, moved)
            self.bent = decay * rate - moved
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
        self.known = np.concatenate((inner, np.zeros((stages, -self.border, cases))), axis=1)
        index = tuple(range(decay.shape[0])) * axes
        self.response = Response(decay / step, fading.reshape(-1, cases), -self.border, self.known[-1], index, path)

    def _driven(self, stage: int, state: Floats) -> Floats:
        """The prescribed values (3, cases) of a stage at `state`."""
        driven: Floats = self.driven[stage]
        return driven

    def _membrane(self, stage: int, state: Floats, driven: Floats) -> tuple[Floats, Floats, Floats]:
        """Lambda, the stretch and the prescribed nominal stress (axes, cases) in a stage."""
        if not self.free:
            return self.held_log_squared[stage], self.held_stretch[stage], driven[: self.axes]
        log_squared = self.system.log_squared(state, driven)
        return log_squared, np.exp(0.5 * log_squared), self.system.applied(driven, log_squared)

    def _condense(self, change: Floats | None, driven: Floats, log_squared: Floats, nominal: Floats) -> None:
        """Set the inverse (axes, axes, cases) of the border's matrix, 0 along held axes, and the right-hand side due to the
        rates of the prescribed values; `change` (3, cases) is these rates times the step, None for a load that is still.
        """
        stretch, axes, points = self.stretch, self.axes, self.points
        tangent = np.einsum("nm,bcnm->bcm", points.modulus, self.springs.share)
        tangent *= self.hold
        for axis in range(axes):
            tangent[axis, axis] -= 0.5 * nominal[axis] * stretch[axis]
        if (edges := points.edges) is not None:
            stiff = edges.tangent(in_both_axes(log_squared))
            for axis in self.free:
                tangent[axis, axis] += stiff[axis]
        self.load_term = np.zeros(stretch.shape)
        if self.electric:
            _, by_stretch, by_load = points.maxwell_tangent(log_squared, driven[ELECTRIC])
            tangent -= by_stretch
            self._drive(by_load, change)
        if change is not None:
            for axis, held in enumerate(self.held):
                if held is False:
                    self.load_term[axis] += stretch[axis] * change[axis]
                else:
                    self.load_term -= tangent[:, axis] * self.prescribed_change[axis]
        if axes == 1:
            self.inverse = 1 / tangent
        else:
            for axis, held in enumerate(self.held):
                if held is not False:
                    tangent[axis, 1 - axis] = tangent[1 - axis, axis] = np.where(held, 0.0, tangent[0, 1])
                    tangent[axis, axis] = np.where(held, 1.0, tangent[axis, axis])
            determinant = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
            self.inverse = np.empty_like(tangent)
            self.inverse[0, 0], self.inverse[1, 1] = tangent[1, 1], tangent[0, 0]
            self.inverse[0, 1], self.inverse[1, 0] = -tangent[0, 1], -tangent[1, 0]
            self.inverse /= determinant
        for axis, held in enumerate(self.held):
            if held is not False:
                self.inverse[axis, axis] = np.where(held, 0.0, self.inverse[axis, axis])

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
        if self.free:
            carried = self.springs.carried(right)
            carried -= stress
            residual = np.einsum("nm,cnm->cm", points.modulus, carried)
            residual += nominal * stretch
            if self.electric:
                residual += points.maxwell_stress(log_squared, driven[ELECTRIC])
            if follows:
                residual += gamma_i * self.load_term
            self._border(residual, out=out[-axes:])
        else:
            out[-axes:] = 0.0
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
