"""Loads under which every spring shares one symmetry: the same equations as `point`, with one unknown a spring instead of two.

Under uniaxial stress lambda_2 = lambda_1^(-1/2) and xi_2 = xi_1^(-1/2) hold exactly, under equibiaxial load lambda_2 = lambda_1 and
xi_2 = xi_1. A state is a column of shape (n + 1,): x = 2 ln xi_1 of the springs, and last Lambda_1 = 2 ln lambda_1 or the nominal
stress s_1, whichever the load leaves open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Symmetry
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.passive.framed import FramedFilms
from dielast.mechanics.point import FOLLOWER_WEIGHT, LoadedPoints, Points
from dielast.mechanics.span import Control, Load, UnderLoad
from dielast.numerics.columns import Cases, Floats

__all__ = ["EQUIBIAXIAL", "UNIAXIAL", "Films", "SymmetricPoints", "Symmetry"]


@dataclass(frozen=True, slots=True, eq=False)
class SymmetricPoints(UnderLoad):
    """Material points under a symmetric and smooth stretch of load; a nominal field keeps only the equibiaxial symmetry."""

    points: Points
    load: Load
    symmetry: Symmetry

    @property
    def border(self) -> int:
        """Where the rows of the border begin, from the end."""
        return -1

    def take(self, cases: Cases) -> SymmetricPoints:
        """The same for some of the cases."""
        return type(self)(self.points.take(cases), self.load.take(cases), self.symmetry)

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats) -> Floats:
        """State (n + 1, cases) from x (2, n, cases), Lambda and nominal stress (2, cases)."""
        left_open = log_squared_stretch if self.load.controls[0] is Control.STRESS else nominal_stress
        return np.concatenate((internal[0], left_open[:1]))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        internal = state[: self.border]
        return np.stack((internal, self.symmetry.second * internal))

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress (2, cases each) at a `state` under the prescribed values `driven` (3, cases)."""
        log_squared, nominal = self._axis(state, driven)
        second = np.zeros_like(nominal) if self.symmetry is UNIAXIAL else nominal
        return np.stack((log_squared, self.symmetry.second * log_squared)), np.stack((nominal, second))

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stress and viscous stretches that `increment` of a `state` amounts to."""
        error = np.abs(increment)
        if self.load.controls[0] is Control.STRETCH:
            error[-1] *= 2 * FOLLOWER_WEIGHT / (np.abs(state[-1]) + self.points.stress_floor)
        else:
            error[-1] *= np.where(self.load.moving, FOLLOWER_WEIGHT, 1.0)
        return np.asarray(0.5 * np.max(error, axis=0))

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> SymmetricArrowhead:
        """The equations at the start of a step of given length (cases,), ready to be solved."""
        return SymmetricArrowhead(self, time, state, step, gamma)

    def _axis(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress (cases,) of axis 1."""
        if self.load.controls[0] is Control.STRESS:
            return state[-1], driven[0]
        return 2 * np.log(driven[0]), state[-1]

    def strain(self, state: Floats, log_squared_stretch: Floats) -> tuple[Floats, Floats]:
        """A and C of the springs, each (n, cases)."""
        elastic = log_squared_stretch - state[: self.border]
        if self.symmetry is UNIAXIAL:
            elastic *= -0.5
            thickness = np.exp(elastic, out=elastic)
            front = thickness * thickness
            np.divide(1.0, front, out=front)
        else:
            front = np.exp(elastic, out=elastic)
            thickness = front * front
            np.divide(1.0, thickness, out=thickness)
        return front, thickness


class SymmetricArrowhead:
    """One step's linear system, factorised, as in `point.Arrowhead` with numbers for 2x2 blocks."""

    def __init__(self, system: SymmetricPoints, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.gamma = system, gamma
        points, load, symmetry = system.points, system.load, system.symmetry
        driven = system.driven(time, state)
        log_squared, nominal = system._axis(state, driven)
        self.stress, tangent = points.law.axial_tangent(symmetry, *system.strain(state, log_squared))
        self.flow = (symmetry.flow * step) * points.rate
        self.follows = self.flow * tangent  # how far a spring follows the stretch within the step, a share
        inverse = self.follows + 1 / gamma
        self.inverse = np.divide(1.0, inverse, out=inverse)
        self.follows *= inverse
        tangent *= inverse
        tangent *= points.modulus
        self.share = tangent
        self._condense(load, step * load.slope(time), driven, log_squared, nominal)

    def _condense(self, load: Load, change: Floats, driven: Floats, log_squared: Floats, nominal: Floats) -> None:
        """The border's number, and what the rates of the prescribed quantities put on its right-hand side; `change` (3, cases) is
        their rate times the step.
        """
        points = self.system.points
        stretch = np.exp(0.5 * log_squared)
        tangent = np.add.reduce(self.share, axis=0) * (1 / self.gamma)
        tangent -= (0.5 * nominal) * stretch
        self.known = 0.0 * stretch
        if self.system.electric:
            by_stretch, by_load = points.equibiaxial_maxwell_tangent(log_squared, driven[ELECTRIC])
            tangent -= by_stretch
            self._drive(by_load, change)
        if load.controls[0] is Control.STRESS:
            self.prescribed_change = None
            self.known += stretch * change[0]
            self.border = 1 / tangent
        else:
            self.prescribed_change = 2 * change[0] / driven[0]
            self.known -= tangent * self.prescribed_change
            self.border = -1 / stretch

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """u_i of a stage at `time` and `state`, in `out`; `history` is the sum over c_ij u_j, None in the first stage."""
        system, points = self.system, self.system.points
        driven = system.driven(time, state)
        log_squared, nominal = system._axis(state, driven)
        if history is None:
            stress = self.stress
            right = stress * self.flow
        else:
            stress = points.law.axial_stress(system.symmetry, *system.strain(state, log_squared))
            right = stress * self.flow
            right += history[: system.border]
        residual = np.einsum("nm,nm->m", self.share, right)
        residual -= np.einsum("nm,nm->m", points.modulus, stress)
        residual += nominal * np.exp(0.5 * log_squared)
        if system.electric:
            residual += points.equibiaxial_maxwell_stress(log_squared, driven[ELECTRIC])
        if gamma_i:
            residual += gamma_i * self.known
        residual = self._solve(residual, out, time, state, history, gamma_i)
        out[-1] = residual
        moved = residual if self.prescribed_change is None else gamma_i * self.prescribed_change
        right *= self.inverse
        np.multiply(self.follows, moved, out=out[: system.border])
        out[: system.border] += right
        return out

    def _drive(self, by_load: Floats, change: Floats) -> None:
        """Add what the rate of the electrical quantity puts on the right-hand side, with the Maxwell stress's derivative in it."""
        self.known += by_load * change[ELECTRIC]

    def _solve(
        self, residual: Floats, increment: Floats, time: Floats, state: Floats, history: Floats | None, gamma_i: float
    ) -> Floats:
        """The last row of the increment (cases,) for its right-hand side `residual` (cases,)."""
        residual *= self.border
        return residual


Films = LoadedPoints | SymmetricPoints | FramedFilms
"""Films under load, in whichever form."""
