"""The linear system of one step of material points, an arrowhead, and its solution: one small block per spring, a sum over the
springs, and one further solve for the border (`point`).
"""

from __future__ import annotations

import numpy as np

from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.elimination import Eliminated, stress_of, tangent_of
from dielast.mechanics.flow import Mobility
from dielast.mechanics.path import KnownPart, StretchPath, decay_along
from dielast.mechanics.point_material import in_both_axes
from dielast.mechanics.point_state import PointStates
from dielast.numerics.arrays import Floats
from dielast.numerics.response import Response


class Arrowhead:
    """The linear system of one step, factorised; its cost is linear in the number of springs.

    The block of a spring is D = 1/gamma + h G K (`elimination`), and the condensed tangent is sum mu Q / gamma. Where the
    right-hand side of a spring is r and Lambda changes by u_L, x changes by D^-1 r + h G Q u_L, as D^-1 G K = G Q.
    """

    def __init__(
        self, system: PointStates, times: Floats, state: Floats, step: Floats, gamma: float, fading: Floats | None = None
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
        self.known = None if fading is None or system.loose else self._known(fading, times, step, tangent, mobility)
        self.of_slack = self._of_slack(times[0]) if fading is not None and system.loose else None
        if self.known is not None and not self.free:  # Lambda - x but for what the stages add to x
            self.ahead = self.held_log_squared[:, :, None] - self.known.inner[:-1]
        if self.known is None or self.free:
            self.following = mobility.times(self.springs.share)
        change = step * load.slope(times[0]) if self.moves else None
        self.prescribed_change = np.zeros(self.stretch.shape)
        if change is not None:
            for axis, held in enumerate(self.held):
                if held is not False:
                    self.prescribed_change[axis] = np.where(held, 2 * change[axis] / driven[axis], 0.0)
        if self.free:
            self._condense(change, driven, log_squared, nominal)

    @property
    def response(self) -> Response | None:
        """What is known of the step in closed form."""
        return self.of_slack if self.known is None else self.known.response

    def _of_slack(self, begin: Floats) -> Response:
        """Nothing that is known, in the form in which steps of taut points are: springs of slack points follow no grips."""
        (axes, springs, cases), start = self.stress.shape, self.driven[0, : self.axes]
        rate, rows = np.zeros((springs, cases)), np.zeros((axes * springs - self.border, cases))
        path = StretchPath(self.system.load, begin, rate, start)
        return Response(rate, rows[: self.border], -self.border, rows, rows, tuple(range(springs)) * axes, path)

    def _known(self, fading: Floats, times: Floats, step: Floats, tangent: Floats, mobility: Mobility) -> KnownPart:
        """The known part of the step with rates that are `fading` (axes, n, cases); `tangent` is K of both axes."""
        moved = None
        if self.axes == 1:
            decay = np.maximum(1 / self.springs.diagonal[0] - self.hold, 0.0)
        else:
            moved = np.einsum("abnm,bnm->anm", mobility.through(tangent), rate := fading * step)
            decay = decay_along(rate, moved)
        path = StretchPath(self.system.load, times[0], self.system.lifted(), self.driven[0, : self.axes])
        return KnownPart.of(fading, times, step, decay, moved, path, -self.border)

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
                if self.system.loose and axis == 0:
                    continue
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
        points, axes, border, shape, known = self.points, self.axes, self.border, self.stress.shape, self.known
        follows = gamma_i != 0 and self.moves
        if self.free:
            driven = self._driven(stage, state)
            log_squared, stretch, nominal = self._membrane(stage, state, driven)
        else:
            log_squared = self.held_log_squared[stage]
        if history is None:
            stress = self.stress
            right = self.flow.rate(stress)
        else:
            ahead = log_squared[:, None]
            if known is not None:  # in the same order whether the points beside are held or not
                ahead = ahead - known.inner[stage] if self.free else self.ahead[stage]
            elastic = ahead - state[:border].reshape(shape)
            stress = stress_of(points.law, self.symmetry, elastic)
            right = self.flow.rate(stress)
            right += history[:border].reshape(shape)
        if known is not None:
            right -= known.right[stage]
            if known.bent is not None and gamma_i:
                right += gamma_i * known.bent
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
        if self.free or (follows and known is None):
            change = self._change_of_stretch(out[-axes:], gamma_i)
            internal += self._followed(change) if known is None else self._followed(change) * (1 - known.response.path.lifted)
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
