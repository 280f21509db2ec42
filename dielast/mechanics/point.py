"""The equations of loaded material points (Sec. 3 of DOI 10.1115/1.4030850), whose Jacobian is an arrowhead.

With the states of `point_state`, of n springs of which spring 0 is the equilibrium spring, treated as a branch that never flows,
the equations are

    dx_i/dt = (2p - q, 2q - p)_i / (3 tau),                                 one pair for each spring (`flow`),
    0 = sum mu p - m_1 - s_1 lambda_1,  and the same for axis 2 with q and m_2,

where m is the Maxwell stress, eps E^2 in both axes if the permittivity does not depend on stretch (`electric`). They are a
differential-algebraic system of index 1. The springs couple only through the last two rows, so a linear solve is one 2x2 solve per
spring, a sum over the springs, and one further 2x2 solve; where axis 1 stands for both, every solve is one of a single row.
"""

from __future__ import annotations

import numpy as np

from dielast.mechanics.arrowhead import Arrowhead
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.elimination import stress_of, tangent_of
from dielast.mechanics.path import decay_along
from dielast.mechanics.point_state import PointStates
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Floats
from dielast.numerics.response import Fading, relaxed

# weight of unknowns that respond at once to a moving load: within a step they are less smooth than the error estimate at its end
# shows; on a sine of the stretch, where that estimate passes through 0, the error within the step is estimated itself
FOLLOWER_WEIGHT = 4.0


class LoadedPoints(PointStates):
    """Material points in one smooth span of load: the system that the stepper integrates."""

    __slots__ = ()

    def error(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stresses and viscous stretches due to an `increment` of the `state` at a
        `time` (cases,) in s.
        """
        load, worst = self.load, 0.5 * np.maximum.reduce(np.abs(increment[: self.border]), axis=0)
        fixed = any(held is not False for held in self.held)
        of_stress = self._error_of_stress(time, state, increment) if fixed else None
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
        if not np.count_nonzero(np.isfinite(points.stress_floor)):  # stresses do not matter
            return np.zeros_like(driven[: self.axes])
        log_squared = self.log_squared(state, driven)
        stress, tangent = tangent_of(points.law, self.symmetry, log_squared[:, None] - self.packed(state))
        carried = np.einsum("nm,cnm->cm", points.modulus, stress)
        if self.electric:
            carried -= points.maxwell_stress(log_squared, driven[ELECTRIC])
        np.abs(tangent, out=tangent)
        tangent *= points.modulus
        strain = np.abs(self.packed(increment))
        if self.axes == 1:
            change = np.einsum("cnm,cnm->cm", tangent, strain)
        else:  # the entries 11 and 12, 12 and 22
            change = np.stack([np.einsum("cnm,cnm->m", tangent[pair], strain) for pair in (slice(0, 2), slice(1, 3))])
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
        share = relaxed(decay * lasts)[1]
        fallen = elastic - rate * lasts * share
        then = flow.rate(stress_of(points.law, self.symmetry, fallen))
        beyond = then - now + rate * (decay * lasts * share) - ahead_change[:, None] * lasts * share
        sure = np.isfinite(rate) & np.isfinite(beyond)
        return Fading(np.where(sure, rate, 0.0), np.where(sure, self.lifted() * beyond, 0.0))

    def linearise(self, times: Floats, state: Floats, step: Floats, gamma: float, fading: Floats | None = None) -> Arrowhead:
        """The linear system of a step (cases,) in s from `state`, whose stages are at `times` (stages, cases); the rates
        (axes, n, cases) that are `fading` are known.
        """
        return Arrowhead(self, times, state, step, gamma, fading)
