"""The material of points: their springs and their dielectric, with its Maxwell stress under an electrical load.

Lambda_i = 2 ln lambda_i (axes 1 and 2), x = 2 ln xi the viscous stretches of the n springs, of which spring 0 is the equilibrium
spring. The last axis of arrays is the cases.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from dielast.base.errors import InputError
from dielast.material.law import DielectricLaw
from dielast.material.laws_of_cases import UNSTRETCHED, LawsOfCases, log_ratio, stretch_laws
from dielast.material.material import Material, materials_of
from dielast.material.springs import SpringLaw, gathered
from dielast.mechanics.cases import of_case
from dielast.mechanics.electric import FIELD, ElectricalLoad, FilmCircuit
from dielast.mechanics.flow import Flow, flow_laws
from dielast.numerics.arrays import ByCase, Floats

# of the modulus: the rounding error of the stiffest spring's stress bounds the accuracy of every stress
ROUNDING = 20 * np.finfo(float).eps
FLOOR = 1e-4  # of the modulus of the equilibrium spring: the stress floor, but for rounding
SYMMETRIC = np.array(((0, 1), (1, 2)))  # indices of the entries 11, 12, 22 in a symmetric 2x2 matrix


@dataclass(frozen=True, slots=True, eq=False)
class EdgeSprings(ByCase):
    """Springs that hold the edges of films: the nominal stress along an axis is the prescribed one less `stiffness` (2, cases) in
    Pa times the stretch beyond `home` (2, cases), at which the spring bears the prescribed stress; 0 along an axis without one.
    """

    stiffness: Floats
    home: Floats

    def borne(self, log_squared_stretch: Floats) -> Floats:
        """The prescribed less the present nominal stress (2, cases) in Pa at Lambda (2, cases)."""
        return np.asarray(self.stiffness * (np.exp(0.5 * log_squared_stretch) - self.home))

    def tangent(self, log_squared_stretch: Floats) -> Floats:
        """d(stiffness lambda) lambda/dLambda (2, cases) in Pa at Lambda (2, cases), which stabilises a film."""
        return np.asarray(0.5 * self.stiffness * np.exp(log_squared_stretch))


@dataclass(frozen=True, slots=True, eq=False)
class PointMaterial(ByCase):
    """The material of points.

    - `modulus` (n, cases): shear moduli in Pa, row 0 that of the equilibrium spring.
    - `flow`: of the springs; the equilibrium spring does not flow.
    - `law`: the law of the springs, for arrays (2, n, cases).
    - `permittivity` (cases,): in F/m at stretch 1.
    - `stress_floor` (cases,): in Pa; errors of a smaller stress are relative to this stress.
    - `electric`: the electrical quantity that the load prescribes, the charge if there is a `circuit`.
    - `stretching`: the dependence of the permittivity on stretch.
    - `circuit`: the circuit through which charge flows, None unless the charge is an unknown.
    - `edges`: springs that hold the edges, if any.
    """

    modulus: Floats
    flow: Flow
    law: SpringLaw
    permittivity: Floats
    stress_floor: Floats
    electric: ElectricalLoad = FIELD
    stretching: LawsOfCases[DielectricLaw] = UNSTRETCHED
    circuit: FilmCircuit | None = None
    edges: EdgeSprings | None = None

    @classmethod
    def of(
        cls, material: Material | Sequence[Material], temperature: Floats, rtol: float, with_dielectric: bool = True
    ) -> PointMaterial:
        """Points of one material, or of one material per case, at `temperature` (cases,) in degC, for integration to `rtol`.

        `with_dielectric` is False for films that never see a voltage. Branches of modulus 0 are omitted. Materials with fewer
        branches than others are padded with branches of modulus 0 that do not flow. Raises the errors of the laws over temperature.
        """
        materials = materials_of(material)
        width, carrying = temperature.size, [member.spectrum.shear_modulus > 0 for member in materials]
        most = max(int(np.count_nonzero(branches)) for branches in carrying)
        modulus, fluidity = np.zeros((2, most + 1, width))
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
            fluidity[rows, cases] = 1 / (3 * _at(member.relaxation_time, temperature, index, cases)[:, branches].T)
            if with_dielectric and (dielectric := member.dielectric) is not None:
                permittivity[cases] = _at(dielectric.at, temperature, index, cases)
                dielectrics.append(dielectric)
            laws.append((member.equilibrium_law, member.nonequilibrium_law))
        floor = FLOOR * modulus[0] + ROUNDING / rtol * modulus.sum(axis=0)
        complete = len(dielectrics) == len(materials)
        stretching = stretch_laws(dielectrics, width) if complete else UNSTRETCHED
        flow = Flow.of(flow_laws([member.flow for member in materials], width), fluidity, modulus)
        return cls(modulus, flow, gathered(laws, modulus > 0), permittivity, floor, stretching=stretching)

    def undamped(self) -> PointMaterial:
        """The points without stress in the last spring, the damper (`stability.damped`)."""
        return replace(self, modulus=np.concatenate((self.modulus[:-1], np.zeros_like(self.modulus[-1:]))))

    def without_springs(self) -> PointMaterial:
        """The points without springs, for what only the border of a state tells: many of them are quickly selected."""
        return replace(self, modulus=self.modulus[:0], flow=Flow(self.flow.fluidity[:0]), law=self.law.of_spring(0, 0))

    def apart(self) -> PointMaterial:
        """Points of one spring each, of all n springs of the cases, spring after spring: arrays (1, n cases)."""
        springs, cases = self.modulus.shape
        single = self.without_springs().take(np.tile(np.arange(cases), springs))
        law = self.law.apart(springs, cases)
        return replace(single, modulus=self.modulus.reshape(1, -1), flow=self.flow.apart(), law=law)

    def with_damper_floor(self, rtol: float) -> PointMaterial:
        """The points with a stress floor that counts the rounding of the last spring, the damper, for films whose edges move."""
        return replace(self, stress_floor=self.stress_floor + ROUNDING / rtol * self.modulus[-1])

    def retained(self, watched: Floats | float, stress: Callable[[], Floats]) -> Floats:
        """The modulus (n, cases) in Pa that springs under a `stress` (2, n, cases) retain after a time `watched` in s (cases,), 0
        for the last, the damper.
        """
        held = self.modulus * self.flow.retained(watched, stress)
        held[-1] = 0.0
        return np.asarray(held)

    def springs(self, internal: Floats, log_squared_stretch: Floats) -> Floats:
        """Squared elastic stretches (2, n, cases) at x (2, n, cases) and Lambda (2, cases)."""
        elastic = log_squared_stretch[:, None] - internal
        return np.exp(elastic, out=elastic)

    def permittivity_at(self, log_squared_stretch: Floats) -> Floats:
        """eps (cases,) in F/m at Lambda (2, cases)."""
        if not self.stretching:
            return self.permittivity
        return np.asarray(self.permittivity * np.exp(log_ratio(self.stretching, log_squared_stretch)[0]))

    def nominal(self, log_squared_stretch: Floats, acting: Floats) -> tuple[Floats, Floats]:
        """The nominal field in V/m and the nominal charge density in C/m^2 (cases,) at Lambda (2, cases); `acting` (cases,) is that
        of the two which the load prescribes or the state holds.
        """
        capacity = self.permittivity_at(log_squared_stretch) * np.exp(log_squared_stretch[0] + log_squared_stretch[1])
        if self.electric == FIELD:
            return acting, capacity * acting
        return acting / capacity, acting

    def stored(self, internal: Floats, log_squared_stretch: Floats, acting: Floats) -> Floats:
        """The energy (cases,) in J/m^3 stored in springs and dielectric at x (2, n, cases), or (1, n, cases) if both axes are
        equal, and Lambda (2, cases), with `acting` as in `nominal`.
        """
        field, charge = self.nominal(log_squared_stretch, acting)
        with np.errstate(invalid="ignore"):
            internal = np.broadcast_to(internal, (2, *internal.shape[1:]))
            springs = self.modulus * self.law.energy(self.springs(internal, log_squared_stretch))
            return np.asarray(np.sum(springs, axis=0) + 0.5 * field * charge)

    def maxwell_stress(self, log_squared_stretch: Floats, electrical: Floats) -> Floats:
        """The Maxwell stress m_1 and m_2 (axes, cases) in Pa at Lambda (axes, cases) and the prescribed electrical quantity
        (cases,); one row (1, cases) stands for two equal ones.
        """
        log_area = log_squared_stretch[0] + log_squared_stretch[-1]
        if not self.stretching:  # in most films: this is evaluated in every stage of a step
            return self.electric.stress(self.permittivity, log_area, electrical)[None]
        permittivity, share = self.capacitance(in_both_axes(log_squared_stretch))
        return np.asarray(self.electric.stress(permittivity, log_area, electrical) * share[: len(log_squared_stretch)])

    def maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats) -> tuple[Floats, Floats, Floats]:
        """The Maxwell stress (axes, cases), its derivatives (axes, axes, cases) in Lambda, and (axes, cases) in the prescribed
        electrical quantity; one axis stands for two equal ones, and the derivative is in both together.
        """
        one, log_area = len(log_squared_stretch) == 1, log_squared_stretch[0] + log_squared_stretch[-1]
        if not self.stretching:
            stress, by_area, by_load = self.electric.linearised(self.permittivity, log_area, electrical)
            if one:
                return stress[None], 2 * by_area[None, None], by_load[None]
            return np.array((stress, stress)), np.array(((by_area, by_area),) * 2), np.array((by_load, by_load))
        ratio, slope, bend = log_ratio(self.stretching, in_both_axes(log_squared_stretch))
        stress, by_area, by_load = self.electric.linearised(self.permittivity * np.exp(ratio), log_area, electrical)
        share = 1 + slope
        by_stretch = by_area * (share[:, None] * share) + stress * bend[SYMMETRIC]
        if one:
            return stress * share[:1], np.sum(by_stretch[:1], axis=1, keepdims=True), by_load * share[:1]
        return stress * share, by_stretch, by_load * share

    def film_tangent(self, half: Floats, by_stretch: Floats, carried: Floats, log_squared_stretch: Floats) -> Floats:
        """The derivatives (2, 2, cases) in Lambda of the true stress of films, less that of the edges, from the tangents `half`
        (3, n, cases) of the springs, the derivative `by_stretch` (2, 2, cases) of the Maxwell stress, and the true mechanical
        stress `carried` (2, cases), at Lambda (2, cases).
        """
        tangent = np.einsum("nm,cnm->cm", self.modulus, half)[SYMMETRIC] - by_stretch
        tangent[(0, 1), (0, 1)] -= 0.5 * carried
        if self.edges is not None:
            tangent[(0, 1), (0, 1)] += self.edges.tangent(log_squared_stretch)
        return np.asarray(tangent)

    def capacitance(self, log_squared_stretch: Floats) -> tuple[Floats, Floats]:
        """eps (cases,) in F/m at Lambda (2, cases), and the derivatives (2, cases) in Lambda of ln(eps lambda_1^2 lambda_2^2)."""
        ratio, slope, _ = log_ratio(self.stretching, log_squared_stretch)
        return np.asarray(self.permittivity * np.exp(ratio)), 1 + slope

    def watched_maxwell_tangent(self, log_squared_stretch: Floats, electrical: Floats, watched: Floats | None) -> Floats:
        """The derivatives (2, 2, cases) in Lambda as in `maxwell_tangent`, `watched` (cases,) s after the stretches changed.

        In a circuit, charge flows in that time; None stands for no time.
        """
        _, by_stretch, by_load = self.maxwell_tangent(log_squared_stretch, electrical)
        if self.circuit is None or watched is None:
            return by_stretch
        permittivity, share = self.capacitance(log_squared_stretch)
        log_area = log_squared_stretch[0] + log_squared_stretch[1]
        released = self.circuit.released(permittivity, share, log_area, electrical, watched)
        return by_stretch + by_load[:, None] * released


def in_both_axes(of_axes: Floats) -> Floats:
    """Values (2, cases) of both axes from those of the axes (axes, cases) in a state; one axis stands for two equal ones."""
    return of_axes if len(of_axes) == 2 else np.concatenate((of_axes, of_axes))


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
