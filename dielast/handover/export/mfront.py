"""MFront: a finite-strain behaviour with the constants written into it.

Conventions (MFront documentation): F1, T and dT (K) come from the solver. Model: S = S_vol + S_eq + sum H_k, where H_k convolves
exp(-t/tau_k) with the isochoric stress of the branch's spring (Simo, DOI 10.1016/0045-7825(87)90107-1). Both springs are Gent's,
S = 2 mu dW/dC of I = J^(-2/3) tr C, each with its own J_lim; the volumetric energy is K (J - 1)^2/2. The temperature that counts is
the one at the middle of the increment.
"""

import math
from collections.abc import Iterable
from string import Template

import numpy as np

from dielast.handover.export.code import Card, Code, number, rows_of
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius, ShiftLaw, ShiftTable, kelvin
from dielast.material.springs import CardForm

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


def _files(card: Card) -> dict[str, str]:
    """`material.mfront`."""
    comments = [
        "Material behaviour for MFront (TFEL 3.4 or later), written by dielast.",
        *card.notes,
        "G(t) = mu_eq + sum mu_k exp(-t/(tau_k a(T))); external state variable: the temperature in K.",
        *(f"bulk: {text}" for text in card.default_bulk),
    ]
    if card.density is not None:
        comments.append(f"Density {number(card.density)}, to be given to the solver.")
    text = _BEHAVIOUR.substitute(
        name=f"Dielast_{card.name}",
        comments="\n".join('  "' + line.replace('"', "'") + ' "' for line in comments),
        terms=len(card.time),
        bulk=number(card.bulk or 0.0),
        equilibrium=number(card.equilibrium),
        limit_eq=_inverse_limit(card.equilibrium_law.form(card.law)),
        limit_b=_inverse_limit(card.branch_law.form(card.law)),
        moduli=_listed(card.modulus.tolist()),
        times=_listed(card.time.tolist()),
        shift="\n".join(card.shift_lines()) or "  const real a = 1;",
    )
    return {"material.mfront": text}


def _inverse_limit(spring: CardForm | None) -> str:
    """1/J_lim; 0 for a neo-Hookean spring."""
    return number(1 / (spring.constants if spring else {}).get("J_lim", math.inf))


def _listed(values: Iterable[float]) -> str:
    return ",\n".join("      " + ", ".join(row) for row in rows_of(map(number, values), 4))


def _temperatures(law: ShiftLaw) -> list[str]:
    """C++ of the temperatures Tm, in the middle of the increment, and Tr, the reference."""
    return ["  const real Tm = T + dT / 2;", f"  const real Tr = {number(kelvin(law.reference_temperature))};"]


def _wlf(law: WLF, card: Card) -> list[str]:
    return [
        *_temperatures(law),
        f"  const real above_pole = {number(law.C2)} + Tm - Tr;",
        "  if (above_pole <= 0) {",
        '    throw std::runtime_error("colder than the pole of the WLF law");',
        "  }",
        f"  const real a = std::pow(10., {number(-law.C1)} * (Tm - Tr) / above_pole);",
    ]


def _arrhenius(law: Arrhenius, card: Card) -> list[str]:
    barrier = number(law.activation_energy / GAS_CONSTANT)
    return [*_temperatures(law), f"  const real a = std::exp({barrier} * (1 / Tm - 1 / Tr));"]


def _table(law: ShiftTable, card: Card) -> list[str]:
    """Linear interpolation of log10 a over T."""
    absolute = [kelvin(value) for value in law.temperature]
    count = len(absolute)
    if count == 1:
        return []
    return [
        f"  const real Ts[{count}] = {{",
        f"{_listed(absolute)}}};",
        f"  const real log10_a[{count}] = {{",
        f"{_listed(law.log10_shift_factor(np.array(law.temperature)).tolist())}}};",
        "  const real Tm = T + dT / 2;",
        f"  if ((Tm < Ts[0]) || (Tm > Ts[{count - 1}])) {{",
        '    throw std::runtime_error("temperature outside of the shift table");',
        "  }",
        "  unsigned short i = 0;",
        f"  while ((i < {count - 2}) && (Tm > Ts[i + 1])) {{",
        "    ++i;",
        "  }",
        "  const real a = std::pow(10., log10_a[i] + (log10_a[i + 1] - log10_a[i]) * (Tm - Ts[i]) / (Ts[i + 1] - Ts[i]));",
    ]


CODE = Code(
    "mfront",
    # the behaviour holds Gent's springs; its limits are constants in the text
    {"gent": lambda spring, card: [], "neo-hookean": lambda spring, card: []},
    {"wlf": _wlf, "arrhenius": _arrhenius, "table": _table},
    _files,
    flows=True,
    separate_limits=True,
    poisson_ratio=0.495,
)
