"""The material of points: their springs and their dielectric, with its Maxwell stress under an electrical load.

Lambda_i = 2 ln lambda_i (axes 1 and 2), x = 2 ln xi the viscous stretches of the n springs, of which spring 0 is the equilibrium
spring. The last axis of arrays is the cases.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from dielast.errors import InputError
from dielast.material.law import DielectricLaw
from dielast.material.laws_of_cases import StretchedDielectrics, stretched_dielectrics
from dielast.material.material import Material, materials_of
from dielast.material.springs import SpringLaw, gathered
from dielast.mechanics.cases import of_case
from dielast.mechanics.electric import FIELD, Circuit, ElectricalLoad
from dielast.numerics.arrays import ByCase, Floats

SYMMETRIC = np.array(((0, 1), (1, 2)))  # indices of the entries 11, 12, 22 in a symmetric 2x2 matrix


@dataclass(frozen=True, slots=True, eq=False)
class Points(ByCase):
    """The material of points.

    - `modulus` (n, cases): shear moduli in Pa, row 0 that of the equilibrium spring.
    - `rate` (n, cases): 1/(3 tau) in 1/s, 0 for the equilibrium spring.
    - `law`: the law of the springs, for arrays (2, n, cases).
    - `permittivity` (cases,): in F/m at stretch 1.
    - `stress_floor` (cases,): in Pa; errors of a smaller stress are relative to this stress.
    - `electric`: the electrical quantity that the load prescribes, the charge if there is a `circuit`.
    - `stretching`: the dependence of the permittivity on stretch, None if there is none.
    - `circuit`: the circuit through which charge flows, None unless the charge is an unknown.
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
        """Points of one material, or of one material per case, at `temperature` (cases,) in degC, for integration to `rtol`.

        `with_dielectric` is False for films that never see a voltage. Branches of modulus 0 are omitted. Materials with fewer
        branches than others are padded with branches of modulus 0 and rate 0. Raises the errors of the laws over temperature.
        """
        materials = materials_of(material)
        width, carrying = temperature.size, [member.spectrum.shear_modulus > 0 for member in materials]
        most = max(int(np.count_nonzero(branches)) for branches in carrying)
        modulus, rate = np.zeros((2, most + 1, width))
        permittivity = np.zeros(width)
        laws: list[tuple[SpringLaw, SpringLaw]] = []
        dielectrics: list[DielectricLaw] = []
        for index, (member, branches) in enumerate(zip(materials, carrying, strict=True)):
            cases = slice(None) if len(materials) == 1 else slice(index, index + 1)
            rows = slice(1, int(np.count_nonzero(branches)) + 1)
            modulus[0, cases] = member.equilibrium_modulus
            modulus[rows, cases] = member.spectrum.shear_modulus[branches, None]
            for springs, scaling in ((slice(0, 1), member.equilibrium_scaling), (rows, member.nonequilibrium_scaling)):
                if scaling.depends_on_temperature:
                    factor = partial(scaling.factor, reference_temperature=member.reference_temperature)
                    modulus[springs, cases] *= _at(factor, temperature, index, cases)
            rate[rows, cases] = 1 / (3 * _at(member.relaxation_time, temperature, index, cases)[:, branches].T)
            if with_dielectric and (dielectric := member.dielectric) is not None:
                permittivity[cases] = _at(dielectric.at, temperature, index, cases)
                dielectrics.append(dielectric)
            laws.append((member.equilibrium_law, member.nonequilibrium_law))
        # the rounding error of the stiffest spring's stress bounds the accuracy of every stress
        floor = 1e-4 * modulus[0] + 20 * np.finfo(float).eps / rtol * modulus.sum(axis=0)
        stretching = stretched_dielectrics(dielectrics, width) if len(dielectrics) == len(materials) else None
        return cls(modulus, rate, gathered(laws, modulus > 0), permittivity, floor, stretching=stretching)

    def undamped(self) -> Points:
        """The points without stress in the last spring, the damper (`stability.damped`)."""
        return replace(self, modulus=np.concatenate((self.modulus[:-1], np.zeros_like(self.modulus[-1:]))))

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
        """The Maxwell stress in Pa at Lambda (2, cases) and the prescribed electrical quantity (cases,): eps E^2 (cases,), equal in
        both axes, or m_1 and m_2 (2, cases) if the permittivity depends on stretch.
        """
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        if self.stretching is None:
            return self.electric.stress(self.permittivity, log_area, electrical)
        ratio, slope, _ = self.stretching.log_ratio(log_squared_stretch)
        return np.asarray(self.electric.stress(self.permittivity * np.exp(ratio), log_area, electrical) * (1 + slope))

    def maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats) -> tuple[Floats, Floats, Floats]:
        """The Maxwell stress, its derivatives in Lambda, and those in the prescribed electrical quantity: all (cases,) if both axes
        are equal; (2, cases), (2, 2, cases) and (2, cases) if the permittivity depends on stretch.
        """
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        if self.stretching is None:
            return self.electric.linearised(self.permittivity, log_area, electrical)
        ratio, slope, bend = self.stretching.log_ratio(log_squared_stretch)
        stress, by_area, by_load = self.electric.linearised(self.permittivity * np.exp(ratio), log_area, electrical)
        share = 1 + slope
        return stress * share, by_area * (share[:, None] * share) + stress * bend[SYMMETRIC], by_load * share

    def equibiaxial_maxwell_stress(self, log_squared_stretch: Floats, electrical: Floats) -> Floats:
        """The Maxwell stress (cases,) of either axis, where Lambda (cases,) is equal in both."""
        if self.stretching is None:
            return self.electric.stress(self.permittivity, 2 * log_squared_stretch, electrical)
        stress: Floats = self.maxwell_stress(np.stack((log_squared_stretch, log_squared_stretch)), electrical)[0]
        return stress

    def equibiaxial_maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats) -> tuple[Floats, Floats]:
        """The derivatives (cases,) of `equibiaxial_maxwell_stress` in the Lambda of both axes, and in the electrical quantity."""
        if self.stretching is None:
            _, by_area, by_load = self.electric.linearised(self.permittivity, 2 * log_squared_stretch, electrical)
            return 2 * by_area, by_load
        in_both_axes = np.stack((log_squared_stretch, log_squared_stretch))
        _, by_stretch, by_load = self.maxwell_tangent(in_both_axes, electrical)
        return by_stretch[0, 0] + by_stretch[0, 1], by_load[0]

    def capacitance(self, log_squared_stretch: Floats) -> tuple[Floats, Floats]:
        """eps (cases,) in F/m at Lambda (2, cases), and the derivatives (2, cases) in Lambda of ln(eps lambda_1^2 lambda_2^2)."""
        if self.stretching is None:
            return self.permittivity, np.ones_like(log_squared_stretch)
        ratio, slope, _ = self.stretching.log_ratio(log_squared_stretch)
        return np.asarray(self.permittivity * np.exp(ratio)), 1 + slope

    def watched_maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats, watched: Floats | None) -> Floats:
        """The derivatives in Lambda as in `maxwell_tangent`, `watched` (cases,) s after the stretches changed.

        In a circuit, charge flows in that time, and they are (2, 2, cases); None stands for no time.
        """
        _, by_stretch, by_load = self.maxwell_tangent(log_squared_stretch, electrical)
        if self.circuit is None or watched is None:
            return by_stretch
        permittivity, share = self.capacitance(log_squared_stretch)
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        released = self.circuit.released(permittivity, share, log_area, electrical, watched)
        return by_stretch + np.atleast_2d(by_load)[:, None] * released


def _at(law: Callable[[Floats], Floats], temperature: Floats, first: int, cases: slice) -> Floats:
    """The values of a law at the temperatures (cases,) in degC of `cases`, the first of which is case number `first`.

    An `InputError` of the law is raised again with the number of the case.
    """
    try:
        return law(temperature[cases])
    except InputError:
        for case, value in enumerate(temperature[cases], start=first):
            try:
                law(np.array([value]))
            except InputError as error:
                raise error.at(case=of_case(case, temperature.size)) from None
        raise
