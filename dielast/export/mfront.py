"""MFront: a finite-strain behaviour with the constants written into it.

Conventions (MFront documentation): F1, T and dT (K) come from the solver. Model: S = S_vol + S_eq + sum H_k, where H_k convolves
exp(-t/tau_k) with the isochoric stress of the branch's spring (Simo, DOI 10.1016/0045-7825(87)90107-1). Both springs are Gent's,
S = 2 mu dW/dC of I = J^(-2/3) tr C, each with its own J_lim; the volumetric energy is K (J - 1)^2/2. The temperature that counts is
the one at the middle of the increment.
"""

from __future__ import annotations

from collections.abc import Sequence
from string import Template

import numpy as np

from dielast.export.conventions import CardOptions, Code, number, prepare
from dielast.material.material import Material
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius, ShiftLaw, ShiftTable
from dielast.units import ZERO_CELSIUS

CODE = Code(
    "mfront",
    laws=("gent", "neo-hookean"),
    shifts=(WLF, Arrhenius, ShiftTable),
    flows=True,
    separate_limits=True,
    poisson_ratio=0.495,
)

_BEHAVIOUR = Template("""\
@DSL DefaultFiniteStrain;
@Behaviour $name;
@Description {
$comments
}

@Includes {
#include <cmath>
#include <stdexcept>
}

@IntegerConstant Nv = $terms;

// isochoric stress of the branches' spring of unit modulus, and of every branch
@StateVariable StressStensor Sb;
Sb.setEntryName("BranchSpringStress");
@StateVariable StressStensor H[Nv];
H.setEntryName("BranchStress");

@LocalVariable StiffnessTensor dS_dC;

@Integrator {
  const real bulk = $bulk;
  const real mu_eq = $equilibrium;
  // one over J_lim, zero for neo-Hookean
  const real inverse_limit_eq = $limit_eq;
  const real inverse_limit_b = $limit_b;
  // branches, slowest first: shear moduli, relaxation times
  const real mu[Nv] = {
$moduli};
  const real tau[Nv] = {
$times};
  // shift factor: the relaxation times are tau * a
$shift
  // invariants of C and their derivatives; Ib is the isochoric I1
  const auto id = Stensor::Id();
  const auto J = det(F1);
  const auto C = computeRightCauchyGreenTensor(F1);
  const auto CC = square(C);
  const auto I1 = trace(C);
  const auto I2 = (I1 * I1 - trace(CC)) / 2;
  const auto I3 = J * J;
  const auto dI3 = CC - I1 * C + I2 * id;
  const auto d2I3 = computeDeterminantSecondDerivative(C);
  const auto w = 1 / std::cbrt(I3);
  const auto dw = -w / (3 * I3);
  const auto d2w = 4 * w / (9 * I3 * I3);
  const auto Ib = w * I1;
  const auto dIb = w * id + (I1 * dw) * dI3;
  const auto d2Ib = dw * ((id ^ dI3) + (dI3 ^ id)) + (I1 * d2w) * (dI3 ^ dI3) + (I1 * dw) * d2I3;
  // Gent's stiffnesses, of unit modulus
  const auto room_eq = 1 - (Ib - 3) * inverse_limit_eq;
  const auto room_b = 1 - (Ib - 3) * inverse_limit_b;
  if ((room_eq <= 0) || (room_b <= 0)) {
    throw std::runtime_error("$name: stretched beyond J_lim");
  }
  const auto y_eq = 1 / room_eq;
  const auto y_b = 1 / room_b;
  // branches: exact for a spring stress that changes linearly over the increment
  const StressStensor Sb_old = Sb;
  Sb = y_b * dIb;
  StressStensor S = (bulk * (J - 1) / J) * dI3 + (mu_eq * y_eq) * dIb;
  auto stiffness = real(0);
  for (unsigned short k = 0; k != Nv; ++k) {
    const auto x = dt / (tau[k] * a);
    const auto share = x > 0 ? -std::expm1(-x) / x : real(1);
    H[k] = std::exp(-x) * H[k] + (mu[k] * share) * (Sb - Sb_old);
    S += H[k];
    stiffness += mu[k] * share;
  }
  sig = convertSecondPiolaKirchhoffStressToCauchyStress(S, F1);
  if (computeTangentOperator_) {
    dS_dC = (bulk / (2 * I3 * J)) * (dI3 ^ dI3) + (bulk * (J - 1) / J) * d2I3 +
            mu_eq * ((y_eq * y_eq * inverse_limit_eq) * (dIb ^ dIb) + y_eq * d2Ib) +
            stiffness * ((y_b * y_b * inverse_limit_b) * (dIb ^ dIb) + y_b * d2Ib);
  }
}

@TangentOperator<DS_DC> {
  static_cast<void>(smt);
  Dt = dS_dC;
}
""")


def write(material: Material, options: CardOptions) -> dict[str, str]:
    """`material.mfront`; raises `InputError` for what the behaviour cannot carry."""
    card = prepare(material, CODE, options)
    assert card.bulk is not None
    comments = [
        "Material behaviour for MFront (TFEL 3.4 or later), written by dielast.",
        *card.notes,
        "G(t) = mu_eq + sum mu_k exp(-t/(tau_k a(T))); external state variable: the temperature in K.",
    ]
    if options.bulk_modulus is None and options.poisson_ratio is None:
        comments.append(f"bulk: by default from Poisson's ratio {CODE.poisson_ratio:g} at time zero.")
    if card.density is not None:
        comments.append(f"Density {number(card.density)}, to be given to the solver.")
    text = _BEHAVIOUR.substitute(
        name=f"Dielast_{card.name}",
        comments="\n".join(f'  "{_unquoted(line)} "' for line in comments),
        terms=len(card.time),
        bulk=number(card.bulk),
        equilibrium=number(card.equilibrium),
        limit_eq=number(1 / card.limits[0]),
        limit_b=number(1 / card.limits[1]),
        moduli=_listed(card.modulus.tolist()),
        times=_listed(card.time.tolist()),
        shift=_shift(card.shift),
    )
    return {"material.mfront": text}


def _unquoted(text: str) -> str:
    return text.replace('"', "'")


def _listed(values: Sequence[float]) -> str:
    return ",\n".join("      " + ", ".join(map(number, values[start : start + 4])) for start in range(0, len(values), 4))


def _shift(law: ShiftLaw) -> str:
    """C++ that sets `a`."""
    at = f"  const real Tm = T + dT / 2;\n  const real Tr = {number(law.reference_temperature + ZERO_CELSIUS)};\n"
    match law:
        case WLF(_, C1, C2):
            return (
                f"{at}  const real above_pole = {number(C2)} + Tm - Tr;\n"
                '  if (above_pole <= 0) {\n    throw std::runtime_error("colder than the pole of the WLF law");\n  }\n'
                f"  const real a = std::pow(10., {number(-C1)} * (Tm - Tr) / above_pole);"
            )
        case Arrhenius(_, energy):
            return f"{at}  const real a = std::exp({number(energy / GAS_CONSTANT)} * (1 / Tm - 1 / Tr));"
        case ShiftTable():
            kelvin = [value + ZERO_CELSIUS for value in law.temperature]
            log10_a = law.log10_shift_factor(np.array(law.temperature)).tolist()
            return _table(kelvin, log10_a)
        case _:
            return "  const real a = 1;"


def _table(kelvin: Sequence[float], log10_a: Sequence[float]) -> str:
    """The same by linear interpolation of log10 a over T."""
    if len(kelvin) == 1:
        return "  const real a = 1;"
    count = len(kelvin)
    return (
        f"  const real Ts[{count}] = {{\n{_listed(kelvin)}}};\n  const real log10_a[{count}] = {{\n{_listed(log10_a)}}};\n"
        "  const real Tm = T + dT / 2;\n"
        f"  if ((Tm < Ts[0]) || (Tm > Ts[{count - 1}])) {{\n"
        '    throw std::runtime_error("temperature outside of the shift table");\n  }\n'
        f"  unsigned short i = 0;\n  while ((i < {count - 2}) && (Tm > Ts[i + 1])) {{\n    ++i;\n  }}\n"
        "  const real a = std::pow(10., log10_a[i] + (log10_a[i + 1] - log10_a[i]) * (Tm - Ts[i]) / (Ts[i + 1] - Ts[i]));"
    )
