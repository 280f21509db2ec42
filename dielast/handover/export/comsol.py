"""COMSOL Multiphysics: a parameter file, the table of branches, and notes on where they go.

Conventions (Structural Mechanics Module User's Guide): in the generalised Maxwell model the parent is the long-term spring.
A branch has a relaxation time and, over a linear elastic parent, a shear modulus, over a hyperelastic one an energy factor (its
modulus over the parent's); the table is loaded from three space-separated columns. Relaxation times are tau_m a_T with
log10 a_T = -C1 (T - Tref)/(C2 + T - Tref), or a_T = exp(Q/R (1/T - 1/Tref)); temperatures are absolute.
"""

from typing import Any

import numpy as np

from dielast.handover.export.code import Card, Code, number, ogden_terms
from dielast.material.shift import ShiftTable, kelvin
from dielast.material.springs import CardForm

NAME = "material-comsol"


def _files(card: Card) -> dict[str, str]:
    """Text files, in SI: COMSOL knows units."""
    notes = [
        "Material for COMSOL Multiphysics, written by dielast.",
        *card.notes,
        f"{NAME}-parameters.txt: Parameters > Load from File.",
        f"{NAME}-branches-energy-factor.txt: Viscoelasticity (generalized Maxwell) under a Hyperelastic Material, Load from File;",
        "  columns: branch, energy factor (the branch's modulus over mu_eq), relaxation time in s.",
        f"{NAME}-branches-shear-modulus.txt: the same under a Linear Elastic Material; second column: shear modulus in Pa.",
        "The parent material is the long-term spring, shear modulus mu_eq: G(t) = mu_eq + sum G_m exp(-t/tau_m).",
        "COMSOL temperatures are absolute (K).",
    ]
    if card.bulk is None:
        notes.append("Incompressible: choose the compressibility Incompressible, or plane stress.")
    files = {
        f"{NAME}-parameters.txt": _parameters(card),
        f"{NAME}-branches-energy-factor.txt": _branches(card, card.equilibrium),
        f"{NAME}-branches-shear-modulus.txt": _branches(card, 1.0),
    }
    if card.shift.name in SHIFT_NOTES:
        notes.append(f"Shift function: {SHIFT_NOTES[card.shift.name]}")
    if card.shift.name == ShiftTable.name:
        files[f"{NAME}-shift.txt"] = _table(card.shift)
    files[f"{NAME}-notes.txt"] = "\n".join(notes) + "\n"
    return files


def _parameters(card: Card) -> str:
    """Lines of name, value with its unit, description."""
    lines = [_row("mu_eq", f"{number(card.equilibrium)}[Pa]", "shear modulus at infinite time, of the parent material")]
    lines += card.spring_lines(card.equilibrium)
    if card.bulk is not None:
        lines.append(_row("kappa", f"{number(card.bulk)}[Pa]", "bulk modulus"))
    if card.density is not None:
        lines.append(_row("rho", f"{number(card.density)}[kg/m^3]", "density"))
    reference = f"{number(kelvin(card.shift.reference_temperature))}[K]"
    lines += [_row("T_ref", reference, "temperature at which the relaxation times hold"), *card.shift_lines()]
    return "".join(line + "\n" for line in lines)


def _row(name: str, value: str, description: str) -> str:
    return f'{name} {value} "{description}"'


def _yeoh(spring: CardForm, card: Card) -> list[str]:
    return [_row(f"c{power}", f"{number(value)}[Pa]", "Yeoh") for power, value in enumerate(spring.constants.values(), 1)]


def _arruda_boyce(spring: CardForm, card: Card) -> list[str]:
    return [
        _row(
            "mu0",
            f"{number(spring.constants['mu'])}[Pa]",
            "Arruda-Boyce, series of five terms: its constant, not the initial modulus",
        ),
        _row("N_segments", number(spring.constants["locking_stretch"] ** 2), "Arruda-Boyce: number of segments"),
    ]


def _ogden(spring: CardForm, card: Card) -> list[str]:
    rows = []
    for index, (modulus, exponent) in enumerate(ogden_terms(spring), 1):
        rows += [_row(f"mu_{index}", f"{number(modulus)}[Pa]", "Ogden, W = sum mu_p/alpha_p (...)")]
        rows += [_row(f"alpha_{index}", number(exponent), "Ogden")]
    return rows


def _table(law: Any) -> str:
    """Lines of temperature in K and log10 a."""
    shift = law.log10_shift_factor(np.array(law.temperature)).tolist()
    rows = zip(law.temperature, shift, strict=True)
    return "".join(f"{number(kelvin(at))} {number(value)}\n" for at, value in rows)


def _branches(card: Card, unit: float) -> str:
    """Lines of number, modulus over `unit`, relaxation time in s."""
    rows = enumerate(card.branches, 1)
    return "".join(f"{index} {number(modulus / unit)} {number(time)}\n" for index, (modulus, time) in rows)


SHIFT_NOTES = {
    "wlf": "Williams-Landel-Ferry with T_ref, C1_WLF, C2_WLF (decimal logarithm).",
    "arrhenius": "Arrhenius with T_ref and Q_arrhenius.",
    "table": f"User defined, 10^log10_aT(T), log10_aT an Interpolation of {NAME}-shift.txt (K, 1), linear.",
}
CODE = Code(
    "comsol",
    {
        "gent": lambda spring, card: [_row("J_m", number(spring.constants["J_lim"]), "Gent: limit of I1 - 3")],
        "neo-hookean": lambda spring, card: [],
        "yeoh": _yeoh,
        "arruda-boyce": _arruda_boyce,
        "mooney-rivlin": lambda spring, card: [
            _row(name, f"{number(value)}[Pa]", "Mooney-Rivlin, two parameters") for name, value in spring.constants.items()
        ],
        "ogden": _ogden,
    },
    {
        "wlf": lambda law, card: [
            _row("C1_WLF", number(law.C1), "log10 a_T = -C1 (T-T_ref)/(C2+T-T_ref)"),
            _row("C2_WLF", f"{number(law.C2)}[K]", ""),
        ],
        "arrhenius": lambda law, card: [
            _row("Q_arrhenius", f"{number(law.activation_energy)}[J/mol]", "a_T = exp(Q/R (1/T - 1/T_ref))")
        ],
        "table": lambda law, card: [],
    },
    _files,
    units="SI",
)
