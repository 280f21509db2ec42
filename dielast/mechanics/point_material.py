"""The material of points: their springs, and their dielectric, with the Maxwell stress that it makes of an electrical load.

Lambda_i = 2 ln lambda_i are those of axes 1 and 2, x = 2 ln xi the viscous stretches of the n springs, of which spring 0 is the
equilibrium spring. Arrays hold cases in the last axis.
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
from dielast.mechanics.electric import FIELD, ElectricalLoad
from dielast.numerics.columns import Cases, Floats

SYMMETRIC = np.array(((0, 1), (1, 2)))  # where the entries 11, 12, 22 of a symmetric matrix stand


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
