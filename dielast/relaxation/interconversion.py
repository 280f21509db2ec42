"""Exact conversion between relaxation and retardation spectra of a material.

With moduli G_i at relaxation times tau_i and an equilibrium modulus G_e, and compliances J_k at retardation times lambda_k, a
glassy compliance J_0 and a fluidity 1/eta, the modulus and the compliance of an oscillation are reciprocal (B. Gross,
Mathematical structure of the theories of viscoelasticity, Hermann 1953):

    [G_e + sum G_i tau_i s/(1 + tau_i s)] [J_0 + sum J_k/(1 + lambda_k s) + 1/(eta s)] = 1 for every s.

Either bracket is c + sum w_k/(p_k + z), in z = s with poles p = 1/lambda (and 0 for the flow), or in z = 1/s with poles p = tau.
The poles of its reciprocal are its zeros z = -x, one between neighbouring poles and one beyond the last. Each zero is found as a
distance from its nearest pole, by bisection in the logarithm of that distance within a bracket. So no digits are lost if poles are
many decades apart, or if a zero is very close to a pole; all strengths are positive.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import TabularResult, freeze
from dielast.io.table import Column, Table, spoken
from dielast.material.argument_types import checked
from dielast.material.measurement_kind import MeasurementKind
from dielast.material.spectrum import Spectrum, check_processes
from dielast.numerics.arrays import Floats, Index

_HALVINGS = 64  # of a bracket in log distance: the width of a bracket of 300 decades is then at rounding level


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RetardationSpectrum(TabularResult):
    """`retardation_time` (s) and `compliance` (1/Pa, shear), both (N,), slowest first; `glassy_compliance` in 1/Pa; `fluidity`, the
    inverse of the viscosity, in 1/(Pa s), 0 for a solid.

    Raises `InputError` if the lists differ in length, a time is not positive, or another number is negative or not finite.
    """

    retardation_time: Floats
    compliance: Floats
    glassy_compliance: float
    fluidity: float = 0.0

    def columns(self) -> Table:
        """The table, one row per process."""
        return [Column("retardation_time", "s", self.retardation_time), Column("compliance", "1/Pa", self.compliance)]

    def __post_init__(self) -> None:
        check_processes(self, "retardation_time", "compliance")
        order = np.argsort(-self.retardation_time, kind="stable")
        freeze(self, {"retardation_time": self.retardation_time[order], "compliance": self.compliance[order]})
        for name in ("glassy_compliance", "fluidity"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"the {spoken(name)} must be finite and not negative")

    def creep_compliance(self, time: ArrayLike) -> Floats:
        """Shear creep compliance in 1/Pa at `time` (s): J(t) = J_0 + sum J_k (1 - exp(-t/lambda_k)) + t/eta."""
        t = np.asarray(time, dtype=float)
        retarded = -np.expm1(-t[..., None] / self.retardation_time) @ self.compliance
        return np.asarray(self.glassy_compliance + retarded + t * self.fluidity)


def relaxation_from_retardation(retardation: RetardationSpectrum) -> tuple[Spectrum, float]:
    """The relaxation spectrum and the equilibrium shear modulus (Pa; 0 if the material flows) of the same material.

    The spectrum has one process per distinct retardation time, and one more if the material flows. Exact, by the reciprocity of
    modulus and compliance (Gross 1953, see the module). Raises `InputError` without a glassy compliance, as moduli would be
    infinite.
    """
    glassy = retardation.glassy_compliance
    if glassy <= 0:
        raise InputError("a glassy compliance above zero is needed: without one no relaxation modulus is finite")
    rate, compliance = 1 / retardation.retardation_time, retardation.compliance
    flow = [retardation.fluidity] if retardation.fluidity > 0 else []
    poles, weights = np.concatenate([np.zeros(len(flow)), rate]), np.concatenate([flow, compliance * rate])
    zeros, moduli = _reciprocal(poles, weights, glassy)
    return Spectrum(1 / zeros, moduli).slowest_first(), 0.0 if flow else float(1 / (glassy + compliance.sum()))


def retardation_from_relaxation(spectrum: Spectrum, equilibrium_modulus: float = 0.0) -> RetardationSpectrum:
    """The retardation spectrum of the material with the relaxation `spectrum` and `equilibrium_modulus` (shear, Pa; 0 if it flows).

    Exact, by the reciprocity of modulus and compliance (Gross 1953, see the module). Raises `InputError` if a modulus is negative,
    or all are 0.
    """
    spectrum = spectrum.slowest_first()
    tau, moduli = spectrum.relaxation_time, spectrum.shear_modulus
    total = float(equilibrium_modulus + moduli.sum())
    if not 0 < total < np.inf or equilibrium_modulus < 0:
        raise InputError("moduli that are not negative, and not all zero, are needed to creep")
    zeros, compliance = _reciprocal(tau, moduli * tau, equilibrium_modulus)
    fluidity = 0.0 if equilibrium_modulus > 0 else float(1 / (moduli @ tau))
    return RetardationSpectrum(zeros, compliance, 1 / total, fluidity)


def response(kind: MeasurementKind, spectrum: Spectrum, equilibrium_modulus: float, time: Floats) -> Floats:
    """The response (channels, n) in shear of a solid with this `spectrum` and `equilibrium_modulus` (Pa) to a test of this `kind`.

    `time` (n,) in s is one over the angular frequency of an oscillation.
    """
    process_time, strength, constants = spectrum.relaxation_time, spectrum.shear_modulus, np.array([equilibrium_modulus])
    if kind.stiffness_power < 0:
        creep = retardation_from_relaxation(spectrum, equilibrium_modulus)
        process_time, strength = creep.retardation_time, creep.compliance
        constants = np.array([creep.glassy_compliance, creep.fluidity])
    return np.asarray(kind.processes(time, process_time) @ strength + np.tensordot(constants, kind.constants(time), axes=1))


def _reciprocal(poles: Floats, weights: Floats, constant: float) -> tuple[Floats, Floats]:
    """The zeros -x of F(z) = constant + sum weights/(poles + z), and their strengths 1/(x sum weights/(poles - x)^2) in 1/F.

    Poles with weight 0 are omitted, equal poles merged. If the constant is 0, there is no zero beyond the last pole.
    """
    present = weights > 0
    pole, same = np.unique(poles[present], return_inverse=True)
    weight = np.bincount(same, weights[present], minlength=pole.size).astype(float)
    zeros = pole.size - (constant <= 0)
    if zeros <= 0:
        return np.zeros(0), np.zeros(0)
    left = np.arange(zeros)
    right = np.minimum(left + 1, pole.size - 1)
    last = left == right
    half = 0.5 * (pole[right] - pole[left])
    ahead = pole > pole[left][:, None]

    def sums(origin: Index, distance: Floats) -> tuple[Floats, Floats]:
        """The sums over the poles below and above `pole[origin] + distance`, both positive; F is constant - below + above."""
        offset = (pole[origin][:, None] - pole) + distance[:, None]
        term = weight / offset
        return np.sum(np.where(ahead, 0.0, term), axis=1), np.sum(np.where(ahead, -term, 0.0), axis=1)

    # F rises from minus infinity at the left pole to plus infinity at the right one: its sign half way shows which pole is nearer
    beyond = weight.sum() / constant if constant > 0 else np.inf  # no zero lies farther past the last pole
    middle = np.where(last, beyond, half)
    below, above = sums(left, middle)
    from_left = last | (constant - below + above > 0)
    origin = np.where(from_left, left, right)
    # at the zero, the term of the nearest pole is at most the sum of all others, which bounds the distance from below
    most = np.where(from_left, constant + above, below)
    low, high = np.log(0.5 * weight[origin] / most), np.log(middle)
    sign = np.where(from_left, 1.0, -1.0)
    for _ in range(_HALVINGS):
        trial = 0.5 * (low + high)
        below, above = sums(origin, sign * np.exp(trial))
        farther = (constant - below + above > 0) != from_left
        low, high = np.where(farther, trial, low), np.where(farther, high, trial)
    distance = sign * np.exp(0.5 * (low + high))
    offset = (pole[origin][:, None] - pole) + distance[:, None]
    zero = pole[origin] + distance
    return zero, 1 / (zero * np.sum(weight / offset**2, axis=1))
