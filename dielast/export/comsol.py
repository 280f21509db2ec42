"""COMSOL Multiphysics: a parameter file, the table of branches, and notes on where they go.

Conventions (Structural Mechanics Module User's Guide): in the generalised Maxwell model the parent is the long-term spring.
A branch has a relaxation time and, over a linear elastic parent, a shear modulus, over a hyperelastic one an energy factor (its
modulus over the parent's); the table is loaded from three space-separated columns. Relaxation times are tau_m a_T with
log10 a_T = -C1 (T - Tref)/(C2 + T - Tref), or a_T = exp(Q/R (1/T - 1/Tref)); temperatures are absolute.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from dielast.export.conventions import Card, CardOptions, Code, number, prepare, yeoh_series
from dielast.material.material import Material
from dielast.material.shift import WLF, Arrhenius, ShiftTable
from dielast.units import ZERO_CELSIUS

CODE = Code("comsol", laws=("gent", "neo-hookean", "yeoh"), shifts=(WLF, Arrhenius, ShiftTable))
NAME = "material-comsol"


def write(material: Material, options: CardOptions) -> dict[str, str]:
    """Text files, always in SI (COMSOL knows units); raises `InputError` for what COMSOL cannot carry."""
    card = prepare(material, CODE, replace(options, units="SI"))
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
        f"{NAME}-parameters.txt": _parameters(card, notes),
        f"{NAME}-branches-energy-factor.txt": _branches(card, card.equilibrium),
        f"{NAME}-branches-shear-modulus.txt": _branches(card, 1.0),
    }
    if isinstance(card.shift, ShiftTable):
        notes.append(f"Shift function: User defined, 10^log10_aT(T), log10_aT an Interpolation of {NAME}-shift.txt (K, 1), linear.")
        kelvin = [value + ZERO_CELSIUS for value in card.shift.temperature]
        shift = card.shift.log10_shift_factor(np.array(card.shift.temperature)).tolist()
        files[f"{NAME}-shift.txt"] = _rows([number(at), number(value)] for at, value in zip(kelvin, shift, strict=True))
    files[f"{NAME}-notes.txt"] = "\n".join(notes) + "\n"
    return files


def _parameters(card: Card, notes: list[str]) -> str:
    """Lines of name, value with its unit, description; `notes` learns which shift function is meant."""
    rows = [("mu_eq", f"{number(card.equilibrium)}[Pa]", "shear modulus at infinite time, of the parent material")]
    if card.law == "gent":
        rows.append(("J_m", number(card.limits[0]), "Gent: limit of I1 - 3"))
    elif card.law == "yeoh":
        series = yeoh_series(card.equilibrium, card.limits[0])
        rows += [(f"c{power}", f"{number(value)}[Pa]", "Yeoh") for power, value in enumerate(series, 1)]
    if card.bulk is not None:
        rows.append(("kappa", f"{number(card.bulk)}[Pa]", "bulk modulus"))
    if card.density is not None:
        rows.append(("rho", f"{number(card.density)}[kg/m^3]", "density"))
    reference = f"{number(card.shift.reference_temperature + ZERO_CELSIUS)}[K]"
    rows.append(("T_ref", reference, "temperature at which the relaxation times hold"))
    match card.shift:
        case WLF(_, C1, C2):
            rows += [("C1_WLF", number(C1), "log10 a_T = -C1 (T-T_ref)/(C2+T-T_ref)"), ("C2_WLF", f"{number(C2)}[K]", "")]
            notes.append("Shift function: Williams-Landel-Ferry with T_ref, C1_WLF, C2_WLF (decimal logarithm).")
        case Arrhenius(_, energy):
            rows.append(("Q_arrhenius", f"{number(energy)}[J/mol]", "a_T = exp(Q/R (1/T - 1/T_ref))"))
            notes.append("Shift function: Arrhenius with T_ref and Q_arrhenius.")
    return _rows([name, value, f'"{text}"'] for name, value, text in rows)


def _branches(card: Card, unit: float) -> str:
    pairs = zip(card.modulus.tolist(), card.time.tolist(), strict=True)
    return _rows([str(index), number(own / unit), number(time)] for index, (own, time) in enumerate(pairs, 1))


def _rows(rows: Iterable[list[str]]) -> str:
    return "".join(" ".join(row) + "\n" for row in rows)
