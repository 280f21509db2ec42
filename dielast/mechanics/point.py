"""The residual of loaded material points and its arrowhead Jacobian (Sec. 3 of DOI 10.1115/1.4030850).

State of one point, a column of shape (2n + 2,): x_i = 2 ln xi_i of the n springs, axis 1 then axis 2, and last what the load leaves
open in axes 1 and 2: Lambda_i = 2 ln lambda_i where the stress is prescribed, the nominal stress s_i where the stretch is.
Spring 0 is the equilibrium spring, a branch that never flows. The equations are

    dx_i/dt = (2p - q, 2q - p)_i / (3 tau),                                 one pair for each spring,
    0 = sum mu p - m_1 - s_1 lambda_1,  and the same for axis 2 with q and m_2,

m the Maxwell stress, eps E^2 in both axes where the permittivity does not depend on stretch (`electric`): an index-1
differential-algebraic system. Springs meet only in the last two rows, so a linear solve is one 2x2 solve a spring, a sum
over the springs, and one 2x2 solve more. Arrays hold cases in the last axis, and cases never mix: no result depends on its
neighbours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from dielast.errors import InputError
from dielast.material.dielectric import DielectricLaw, StretchedDielectrics, stretched_dielectrics
from dielast.material.material import Material
from dielast.material.springs import SpringLaw, gathered
from dielast.mechanics.cases import of_case
from dielast.mechanics.circuit import Circuit
from dielast.mechanics.electric import ELECTRIC, FIELD, ElectricalLoad
from dielast.mechanics.span import Control, Load, stretched
from dielast.numerics.columns import Cases, Floats

SYMMETRIC = np.array(((0, 1), (1, 2)))  # where the entries 11, 12, 22 of a symmetric matrix stand

# what follows a moving load at once is less smooth within a step than the error estimate at its end can see
FOLLOWER_WEIGHT = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Material of the points: shear `modulus` (n, cases) in Pa and `rate` = 1/(3 tau) (n, cases) in 1/s, row 0 the equilibrium
    spring with rate 0; `law` acts on arrays (2, n, cases); `permittivity` (cases,) in F/m at stretch 1; `stress_floor` (cases,) in
    Pa: errors of a smaller stress count as errors of this one; `electric` is the electrical quantity that loads prescribe;
    `stretching` is how the permittivity changes with stretch, None where it does not; `circuit` says how the charge flows where it
    is an unknown, and `electric` is then the charge.
    """

    modulus: Floats
    rate: Floats
    law: SpringLaw
    permittivity: Floats
    stress_floor: Floats
    electric: ElectricalLoad = FIELD
    stretching: StretchedDielectrics | None = None
    circuit: Circuit | None = None

    @classmethod
    def of(cls, material: Material | Sequence[Material], temperature: Floats, rtol: float, with_dielectric: bool = True) -> Points:
        """Points of one material, or of one for each case, at temperatures (cases,) in degC, to be integrated to `rtol`; without
        the dielectric for films that never see a voltage.

        Branches of modulus 0 are left out, and materials with fewer branches than others filled up with ones that neither carry,
        flow nor lock. Raises as the laws over temperature do.
        """
        materials = [material] if isinstance(material, Material) else list(material)
        width, carrying = temperature.size, [each.spectrum.shear_modulus > 0 for each in materials]
        branches = max(int(np.count_nonzero(some)) for some in carrying)
        modulus, rate = np.zeros((2, branches + 1, width))
        permittivity = np.zeros(width)
        laws: list[tuple[SpringLaw, SpringLaw]] = []
        dielectrics: list[DielectricLaw] = []
        for index, (each, some) in enumerate(zip(materials, carrying, strict=True)):
            cases = slice(None) if len(materials) == 1 else slice(index, index + 1)
            own = slice(1, int(np.count_nonzero(some)) + 1)
            modulus[0, cases] = each.equilibrium_modulus
            modulus[own, cases] = each.spectrum.shear_modulus[some, None]
            for springs, scaling in ((slice(0, 1), each.equilibrium_scaling), (own, each.nonequilibrium_scaling)):
                if scaling.depends_on_temperature:
                    factor = partial(scaling.factor, reference_temperature=each.reference_temperature)
                    modulus[springs, cases] *= _at(factor, temperature, index, cases)
            rate[own, cases] = 1 / (3 * _at(each.relaxation_time, temperature, index, cases)[:, some].T)
            if with_dielectric and (dielectric := each.dielectric) is not None:
                permittivity[cases] = _at(dielectric.at, temperature, index, cases)
                dielectrics.append(dielectric)
            laws.append((each.equilibrium_law, each.nonequilibrium_law))
        # no stress is known better than the rounding of the stiffest spring's share
        floor = 1e-4 * modulus[0] + 20 * np.finfo(float).eps / rtol * modulus.sum(axis=0)
        stretching = stretched_dielectrics(dielectrics, width) if len(dielectrics) == len(materials) else None
        return cls(modulus, rate, gathered(laws, modulus > 0), permittivity, floor, stretching=stretching)

    def take(self, cases: Cases) -> Points:
        """The points of some cases."""
        # np.take keeps the cases contiguous in memory, which indexing does not
        modulus, rate = np.take(self.modulus, cases, axis=1), np.take(self.rate, cases, axis=1)
        stretching = None if self.stretching is None else self.stretching.take(cases)
        law, permittivity, floor = self.law.take(cases), self.permittivity[cases], self.stress_floor[cases]
        circuit = None if self.circuit is None else self.circuit.take(cases)
        return Points(modulus, rate, law, permittivity, floor, self.electric, stretching, circuit)

    def springs(self, internal: Floats, log_squared_stretch: Floats) -> Floats:
        """Squared elastic stretches (2, n, cases) at x (2, n, cases) and Lambda (2, cases)."""
        elastic = log_squared_stretch[:, None] - internal
        return np.exp(elastic, out=elastic)

    def permittivity_at(self, log_squared_stretch: Floats) -> Floats:
        """eps (cases,) in F/m at Lambda (2, cases)."""
        if self.stretching is None:
            return self.permittivity
        return np.asarray(self.permittivity * np.exp(self.stretching.log_ratio(log_squared_stretch)[0]))

    def maxwell_stress(self, log_squared_stretch: Floats, electrical: Floats) -> Floats:
        """The Maxwell stress in Pa at Lambda (2, cases) and the prescribed electrical quantity (cases,): eps E^2 (cases,), alike in
        both axes, or m_1 and m_2 (2, cases) where the permittivity depends on stretch.
        """
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        if self.stretching is None:
            return self.electric.stress(self.permittivity, log_area, electrical)
        ratio, slope, _ = self.stretching.log_ratio(log_squared_stretch)
        return np.asarray(self.electric.stress(self.permittivity * np.exp(ratio), log_area, electrical) * (1 + slope))

    def maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats) -> tuple[Floats, Floats, Floats]:
        """The Maxwell stress, its derivatives in Lambda, and those in the prescribed electrical quantity: each (cases,) where both
        axes are alike, or (2, cases), (2, 2, cases) and (2, cases) where the permittivity depends on stretch.
        """
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        if self.stretching is None:
            return self.electric.linearised(self.permittivity, log_area, electrical)
        ratio, slope, bend = self.stretching.log_ratio(log_squared_stretch)
        stress, by_area, by_load = self.electric.linearised(self.permittivity * np.exp(ratio), log_area, electrical)
        share = 1 + slope
        return stress * share, by_area * (share[:, None] * share) + stress * bend[SYMMETRIC], by_load * share

    def equibiaxial_maxwell_stress(self, log_squared_stretch: Floats, electrical: Floats) -> Floats:
        """The Maxwell stress (cases,) of each axis where both have this Lambda (cases,)."""
        if self.stretching is None:
            return self.electric.stress(self.permittivity, 2 * log_squared_stretch, electrical)
        stress: Floats = self.maxwell_stress(np.stack((log_squared_stretch, log_squared_stretch)), electrical)[0]
        return stress

    def equibiaxial_maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats) -> tuple[Floats, Floats]:
        """The derivatives (cases,) of the same in this Lambda, of both axes together, and in the prescribed electrical quantity."""
        if self.stretching is None:
            _, by_area, by_load = self.electric.linearised(self.permittivity, 2 * log_squared_stretch, electrical)
            return 2 * by_area, by_load
        both = np.stack((log_squared_stretch, log_squared_stretch))
        _, by_stretch, by_load = self.maxwell_tangent(both, electrical)
        return by_stretch[0, 0] + by_stretch[0, 1], by_load[0]

    def capacitance(self, log_squared_stretch: Floats) -> tuple[Floats, Floats]:
        """eps (cases,) in F/m at Lambda (2, cases), and the derivatives (2, cases) in Lambda of ln(eps lambda_1^2 lambda_2^2)."""
        if self.stretching is None:
            return self.permittivity, np.ones_like(log_squared_stretch)
        ratio, slope, _ = self.stretching.log_ratio(log_squared_stretch)
        return np.asarray(self.permittivity * np.exp(ratio)), 1 + slope

    def watched_maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats, watched: Floats) -> Floats:
        """The derivatives in Lambda as in `maxwell_tangent`, but a time `watched` (cases,) in s after the stretches changed, in
        which charge flows where there is a circuit.
        """
        _, by_stretch, by_load = self.maxwell_tangent(log_squared_stretch, electrical)
        if self.circuit is None:
            return by_stretch
        permittivity, share = self.capacitance(log_squared_stretch)
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        released = self.circuit.released(permittivity, share, log_area, electrical, watched)
        return by_stretch + np.atleast_2d(by_load)[:, None] * released


def _at(answer: Callable[[Floats], Floats], temperature: Floats, first: int, cases: slice) -> Floats:
    """What a law answers at the temperatures in degC of the cases, the first of which is named; an error says of which case it
    speaks.
    """
    try:
        return answer(temperature[cases])
    except InputError:
        for case, alone in enumerate(temperature[cases], start=first):
            try:
                answer(np.array([alone]))
            except InputError as error:
                raise error.at(case=of_case(case, temperature.size)) from None
        raise


@dataclass(frozen=True, slots=True, eq=False)
class LoadedPoints:
    """Material points under one smooth stretch of load: the system that the stepper integrates."""

    points: Points
    load: Load

    @property
    def border(self) -> int:
        """Where the rows of the border begin, from the end."""
        return -2

    @property
    def electric(self) -> bool:
        """Whether there is a field."""
        return self.load.electric

    def take(self, cases: Cases) -> LoadedPoints:
        """The same for some of the cases."""
        return type(self)(self.points.take(cases), self.load.take(cases))

    def driven_by(self, columns: Cases, load: Load) -> LoadedPoints:
        """The same with another span of load in these columns."""
        return type(self)(self.points, self.load.put(columns, load))

    def driven(self, time: Floats, state: Floats) -> Floats:
        """The prescribed values (3, cases) at a `time` (cases,) in s since the span of load began, and a `state` then."""
        return self.load.value(time)

    def pack(self, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats) -> Floats:
        """State (2n + 2, cases) from x (2, n, cases), Lambda and nominal stress (2, cases)."""
        left_open = np.where(stretched(self.load.controls), nominal_stress, log_squared_stretch)
        return np.concatenate((internal.reshape(-1, internal.shape[2]), left_open))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        return state[: self.border].reshape(2, -1, state.shape[1])

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress (2, cases each) at a `state` under the prescribed values `driven` (3, cases)."""
        left_open, prescribed = state[-2:], driven[:2]
        if Control.STRETCH not in self.load.controls:
            return left_open, prescribed
        log_squared_stretch, nominal_stress = left_open.copy(), prescribed.copy()
        for axis, control in enumerate(self.load.controls):
            if control is Control.STRETCH:
                log_squared_stretch[axis] = 2 * np.log(prescribed[axis])
                nominal_stress[axis] = left_open[axis]
        return log_squared_stretch, nominal_stress

    def error(self, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stresses and viscous stretches that `increment` of a `state` amounts to."""
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
        """The equations at the start of a step of given length (cases,), ready to be solved."""
        return Arrowhead(self, time, state, step, gamma)


class Arrowhead:
    """One step's linear system, factorised. Its cost is linear in the springs.

    With K the springs' tangents in Lambda and F = [[2, -1], [-1, 2]], a spring's block is D = 1/gamma + h/(3 tau) F K, and its
    part in the border is Q = mu K D^-1, so that the condensed tangent is sum Q / gamma.
    """

    def __init__(self, system: LoadedPoints, time: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.system, self.gamma = system, gamma
        points, load = system.points, system.load
        driven = system.driven(time, state)
        log_squared, nominal = system.membrane(state, driven)
        self.stress, tangent = points.law.tangent(points.springs(system.internal(state), log_squared))
        self.flow = step * points.rate
        self._eliminate_springs(points, tangent)
        self._condense(load, step * load.slope(time), driven, log_squared, nominal)

    def _eliminate_springs(self, points: Points, tangent: Floats) -> None:
        """D^-1, as its diagonal and its off-diagonal (2, n, cases), and Q (2, 2, n, cases)."""
        k11, k12, k22 = tangent
        block = np.empty((2, 2, *k11.shape))
        np.multiply(k11, 2, out=block[0, 0])
        block[0, 0] -= k12
        np.multiply(k12, 2, out=block[1, 0])
        np.subtract(block[1, 0], k22, out=block[0, 1])
        block[1, 0] -= k11
        np.multiply(k22, 2, out=block[1, 1])
        block[1, 1] -= k12
        block *= self.flow
        block[0, 0] += 1 / self.gamma
        block[1, 1] += 1 / self.gamma
        determinant = block[0, 0] * block[1, 1]
        determinant -= block[0, 1] * block[1, 0]
        np.divide(1, determinant, out=determinant)
        self.diagonal = block[(1, 0), (1, 0)] * determinant
        self.off_diagonal = block[(0, 1), (1, 0)] * -determinant
        (d11, d22), (d12, d21) = self.diagonal, self.off_diagonal
        share = block
        np.multiply(k11, d11, out=share[0, 0])
        share[0, 0] += k12 * d21
        np.multiply(k11, d12, out=share[0, 1])
        share[0, 1] += k12 * d22
        np.multiply(k22, d22, out=share[1, 1])
        share[1, 1] += k12 * d12
        share *= points.modulus
        share[1, 0] = share[0, 1]
        self.share = share

    def _condense(self, load: Load, change: Floats, driven: Floats, log_squared: Floats, nominal: Floats) -> None:
        """Inverse (2, 2, cases) of the border's matrix, and what the prescribed quantities' rates put on the right-hand side;
        `change` (3, cases) is their rate times the step.
        """
        points = self.system.points
        stretch = np.exp(0.5 * log_squared)
        tangent = np.add.reduce(self.share, axis=2) / self.gamma
        tangent[(0, 1), (0, 1)] -= 0.5 * nominal * stretch
        self.known = np.zeros_like(stretch)
        if self.system.electric:
            _, by_stretch, by_load = points.maxwell_tangent(log_squared, driven[ELECTRIC])
            tangent -= by_stretch
            self._drive(by_load, change)
        self.tangent = tangent
        self.given = np.zeros_like(stretch)
        matrix = tangent.copy()
        for axis, control in enumerate(load.controls):
            if control is Control.STRESS:
                self.known[axis] += stretch[axis] * change[axis]
            else:
                self.given[axis] = 2 * change[axis] / driven[axis]
                self.known -= tangent[:, axis] * self.given[axis]
                matrix[:, axis] = 0.0
                matrix[axis, axis] = -stretch[axis]
        determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
        self.inverse = np.empty_like(matrix)
        self.inverse[0, 0], self.inverse[1, 1] = matrix[1, 1], matrix[0, 0]
        self.inverse[0, 1], self.inverse[1, 0] = -matrix[0, 1], -matrix[1, 0]
        self.inverse /= determinant

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float) -> Floats:
        """u_i of a stage at `time` and `state`, with the sum over c_ij u_j as `history` (None in the first stage)."""
        system = self.system
        points, load = system.points, system.load
        driven = system.driven(time, state)
        log_squared, nominal = system.membrane(state, driven)
        stress = self.stress if history is None else points.law.stress(points.springs(system.internal(state), log_squared))
        increment = np.empty_like(state)
        border = increment[-2:]
        residual = np.einsum("bcnm,cnm->bm", self.share, self._flow(stress, history))
        residual -= np.einsum("nm,cnm->cm", points.modulus, stress)
        residual += nominal * np.exp(0.5 * log_squared)
        if system.electric:
            residual += points.maxwell_stress(log_squared, driven[ELECTRIC])
        if gamma_i:
            residual += gamma_i * self.known
        self._solve(residual, border, increment, time, state, history, gamma_i)
        moved = border.copy()
        for axis, control in enumerate(load.controls):
            if control is Control.STRETCH:
                np.multiply(self.given[axis], gamma_i, out=moved[axis])
        moved = moved[:, None]
        right = self.right
        right -= moved * (1 / self.gamma)
        internal = increment[: system.border].reshape(right.shape)
        np.multiply(self.diagonal, right, out=internal)
        internal += self.off_diagonal * right[::-1]
        internal += moved
        return increment

    def _drive(self, by_load: Floats, change: Floats) -> None:
        """Add what the rate of the electrical quantity puts on the right-hand side, with the Maxwell stress's derivatives in it."""
        self.known += by_load * change[ELECTRIC]

    def _solve(
        self,
        residual: Floats,
        border: Floats,
        increment: Floats,
        time: Floats,
        state: Floats,
        history: Floats | None,
        gamma_i: float,
    ) -> None:
        """Write the last two rows of the increment, `border`, for their right-hand side `residual` (2, cases)."""
        np.einsum("bcm,cm->bm", self.inverse, residual, out=border)

    def _flow(self, stress: Floats, history: Floats | None) -> Floats:
        """Right-hand side of the springs' rows, kept for the back substitution."""
        right = 3 * stress
        right -= stress[0] + stress[1]
        right *= self.flow
        if history is not None:
            right += history[: self.system.border].reshape(right.shape)
        self.right = right
        return right
