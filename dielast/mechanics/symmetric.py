"""Loads under which every spring has the same symmetry: the equations of `point`, with one unknown per spring instead of two.

Under uniaxial stress lambda_2 = lambda_1^(-1/2) and xi_2 = xi_1^(-1/2) hold exactly, under equibiaxial load lambda_2 = lambda_1 and
xi_2 = xi_1. A state is a column (n + 1,): x = 2 ln xi_1 of the springs, and last the unknown of axis 1: Lambda_1 = 2 ln lambda_1 if
the stress is prescribed, the nominal stress s_1 if the stretch is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dielast.material.springs import UNIAXIAL, Symmetry
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.passive.framed import FramedFilms
from dielast.mechanics.point import FOLLOWER_WEIGHT, BorderedStep, LoadedPoints
from dielast.mechanics.point_material import Points
from dielast.mechanics.span import Control, Load, UnderLoad
from dielast.numerics.arrays import Floats
from dielast.numerics.stride import Stride


@dataclass(frozen=True, slots=True, eq=False)
class SymmetricPoints(UnderLoad):
    """Material points in one smooth span of a symmetric load; a nominal field is compatible only with equibiaxial symmetry."""

    points: Points
    load: Load
    symmetry: Symmetry

    border: ClassVar[int] = -1
    """Index of the first row of the border, counted from the end of the state."""

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats) -> Floats:
        """State (n + 1, cases) from x (2, n, cases), Lambda and nominal stress (2, cases)."""
        unknown = log_squared_stretch if self.load.controls[0] is Control.STRESS else nominal_stress
        return np.concatenate((internal[0], unknown[:1]))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        internal = state[: self.border]
        return np.stack((internal, self.symmetry.second * internal))

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress, both (2, cases), of a `state` under the prescribed values `driven` (3, cases)."""
        log_squared, nominal = self._axis(state, driven)
        second = np.zeros_like(nominal) if self.symmetry is UNIAXIAL else nominal
        return np.stack((log_squared, self.symmetry.second * log_squared)), np.stack((nominal, second))

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stress and viscous stretches due to an `increment` of the `state`."""
        error = np.abs(increment[-1])
        if self.load.controls[0] is Control.STRETCH:
            error *= 2 * FOLLOWER_WEIGHT / (np.abs(state[-1]) + self.points.stress_floor)
        else:
            error *= np.where(self.load.moving, FOLLOWER_WEIGHT, 1.0)
        return np.asarray(0.5 * np.maximum(np.max(np.abs(increment[: self.border]), axis=0), error))

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> SymmetricArrowhead:
        """The linear system of a step (cases,) in s that starts at `time` and `state`."""
        return SymmetricArrowhead(self, time, state, step, gamma)

    def _axis(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress (cases,) of axis 1."""
        if self.load.controls[0] is Control.STRESS:
            return state[-1], driven[0]
        return 2 * np.log(driven[0]), state[-1]

    def strain(self, state: Floats, log_squared_stretch: Floats) -> tuple[Floats, Floats]:
        """A and C of the springs, both (n, cases)."""
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


class SymmetricArrowhead(BorderedStep):
    """The linear system of one step, factorised: `point.Arrowhead` with scalars in place of 2x2 blocks."""

    unknowns: ClassVar[int] = 1

    def __init__(self, system: SymmetricPoints, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.gamma = system, gamma
        points, load, symmetry = system.points, system.load, system.symmetry
        driven = system.driven(time, state)
        log_squared, nominal = system._axis(state, driven)
        self.stress, tangent = points.law.axial_tangent(symmetry, *system.strain(state, log_squared))
        self.flow = (symmetry.flow * step) * points.rate
        self.follows = self.flow * tangent  # becomes the change of x over that of Lambda within the step
        inverse = self.follows + 1 / gamma
        self.inverse = np.divide(1.0, inverse, out=inverse)
        self.follows *= inverse
        tangent *= inverse
        tangent *= points.modulus
        self.share = tangent
        self._condense(load, step * load.slope(time), driven, log_squared, nominal)

    def _condense(self, load: Load, change: Floats, driven: Floats, log_squared: Floats, nominal: Floats) -> None:
        """Set the inverse (cases,) of the border's entry, and the right-hand side due to the rates of the prescribed values.

        `change` (3, cases) is these rates times the step.
        """
        points = self.system.points
        stretch = np.exp(0.5 * log_squared)
        tangent = np.add.reduce(self.share, axis=0) * (1 / self.gamma)
        tangent -= (0.5 * nominal) * stretch
        self.load_term = 0.0 * stretch
        if self.system.electric:
            by_stretch, by_load = points.equibiaxial_maxwell_tangent(log_squared, driven[ELECTRIC])
            tangent -= by_stretch
            self._drive(by_load, change)
        if load.controls[0] is Control.STRESS:
            self.prescribed_change = None
            self.load_term += stretch * change[0]
            self.border_inverse = 1 / tangent
        else:
            self.prescribed_change = 2 * change[0] / driven[0]
            self.load_term -= tangent * self.prescribed_change
            self.border_inverse = -1 / stretch

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i of the stage at `time` and `state`, in `out`; `history` is sum_j c_ij u_j, None in the first stage."""
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
        self._solve(residual, out, time, state, history, gamma_i)
        right *= self.inverse
        change_of_stretch = out[-1] if self.prescribed_change is None else gamma_i * self.prescribed_change
        np.multiply(self.follows, change_of_stretch, out=out[: system.border])
        out[: system.border] += right
        return out

    def _border(self, right: Floats, out: Floats | None = None) -> Floats:
        """The last row (1, cases) of the increment for a right-hand side (1, cases)."""
        return np.asarray(np.multiply(self.border_inverse, right, out=out))

    def _change_of_stretch(self, border: Floats, gamma_i: float) -> Floats:
        """The increment of Lambda (1, cases) that belongs to the last row `border` (1, cases)."""
        return border if self.prescribed_change is None else gamma_i * self.prescribed_change[None]


Films = LoadedPoints | SymmetricPoints | FramedFilms
"""Films under load, in any of their forms."""


def films_of(stride: Stride) -> Films:
    """The films that a step of the stepper integrates."""
    assert isinstance(stride.system, Films)
    return stride.system
