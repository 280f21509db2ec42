"""ANSYS Mechanical APDL: TB,HYPER with TB,PRONY,,,,SHEAR and TB,SHIFT.

Conventions (Material Reference, viscoelasticity): hyperelastic constants are instantaneous;
G(t) = G_0 [a_inf + sum a_i exp(-t/tau_i)] with a_inf = 1 - sum a_i; at most 100 pairs, six values on a TBDATA line. Reduced time is
A t, not t/A, with log10 A = C1 (T - Tr)/(C2 + T - Tr), so the constants are the usual ones; TN: ln A = H/R (1/Tr - 1/T), absolute
temperatures. d = 2/K, zero for incompressible.
"""

from __future__ import annotations

from dielast.export.code import Card, Code, ogden_terms
from dielast.export.text import number
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius
from dielast.material.springs import CardForm


def _files(card: Card) -> dict[str, str]:
    """`material.mac`."""
    pairs = [
        text for ratio, (_, time) in zip(card.ratios_below_one(), card.branches, strict=True) for text in (ratio, number(time))
    ]
    comments = [
        "Material card for ANSYS Mechanical APDL, written by dielast; read it in /PREP7 with /INPUT,material,mac",
        *card.notes,
        f"Temperatures: {card.options.temperature_scale}.",
        "Hyperelastic constants are instantaneous (time zero), as TB,PRONY takes them.",
        "TB,PRONY,SHEAR pairs: a_i (the branch's modulus over the instantaneous one), tau_i.",
        "G(t) = G_0 [1 - sum a_i + sum a_i exp(-t/tau_i)]; the equilibrium modulus is what the sum lacks of one: keep every digit.",
    ]
    if card.bulk is None:
        comments.append("d = 0: incompressible; mixed u-P elements (KEYOPT(6) = 1), or plane stress.")
    lines = [*(f"! {text}" for text in comments), "DIELAST_MAT = 1  ! material number"]
    if card.density is not None:
        lines.append(f"MP,DENS,DIELAST_MAT,{number(card.density)}")
    lines += [*card.spring_lines(card.instantaneous), f"TB,PRONY,DIELAST_MAT,1,{len(card.time)},SHEAR"]
    lines += [f"TBDATA,{start + 1},{','.join(pairs[start : start + 6])}" for start in range(0, len(pairs), 6)]
    return {"material.mac": "\n".join(lines + card.shift_lines()) + "\n"}


def _neo_hookean(spring: CardForm, card: Card) -> list[str]:
    return [
        "! neo-Hookean: mu, d",
        "TB,HYPER,DIELAST_MAT,1,2,NEO",
        f"TBDATA,1,{number(spring.modulus)},{number(card.compressibility)}",
    ]


def _gent(spring: CardForm, card: Card) -> list[str]:
    return [
        "! Gent: mu, J_m, d",
        "TB,HYPER,DIELAST_MAT,1,3,GENT",
        f"TBDATA,1,{number(spring.modulus)},{number(spring.constants['J_lim'])},{number(card.compressibility)}",
    ]


def _yeoh(spring: CardForm, card: Card) -> list[str]:
    series = ",".join(map(number, spring.constants.values()))
    return [
        "! Yeoh: C10, C20, C30, d1, d2, d3",
        "TB,HYPER,DIELAST_MAT,1,3,YEOH",
        f"TBDATA,1,{series},{number(card.compressibility)},0,0",
    ]


def _arruda_boyce(spring: CardForm, card: Card) -> list[str]:
    constants = (spring.constants["mu"], spring.constants["locking_stretch"], card.compressibility)
    return [
        *(f"! {note}" for note in spring.notes),
        "! Arruda-Boyce: mu, lambda_L, d",
        "TB,HYPER,DIELAST_MAT,1,3,BOYCE",
        f"TBDATA,1,{','.join(map(number, constants))}",
    ]


def _mooney_rivlin(spring: CardForm, card: Card) -> list[str]:
    constants = (*spring.constants.values(), card.compressibility)
    return [
        "! Mooney-Rivlin: C10, C01, d",
        "TB,HYPER,DIELAST_MAT,1,2,MOONEY",
        f"TBDATA,1,{','.join(map(number, constants))}",
    ]


def _ogden(spring: CardForm, card: Card) -> list[str]:
    """mu_i, alpha_i of every term, then d_i, six numbers on a line."""
    terms = ogden_terms(spring)
    values = [number(value) for term in terms for value in term]
    values += [number(card.compressibility), *["0"] * (len(terms) - 1)]
    return [
        "! Ogden: mu_i, alpha_i, then d_i; W = sum mu_i/alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3)",
        f"TB,HYPER,DIELAST_MAT,1,{len(terms)},OGDEN",
        *(f"TBDATA,{start + 1},{','.join(values[start : start + 6])}" for start in range(0, len(values), 6)),
    ]


def _wlf(law: WLF, card: Card) -> list[str]:
    return [
        "! log10 A = C1 (T - Tr)/(C2 + T - Tr), reduced time is A t (A is one over dielast's a(T)); data: Tr, C1, C2",
        "TB,SHIFT,DIELAST_MAT,1,3,WLF",
        f"TBDATA,1,{card.temperature(law.reference_temperature)},{number(law.C1)},{number(law.C2)}",
    ]


def _arrhenius(law: Arrhenius, card: Card) -> list[str]:
    return [
        "! ln A = (H/R) (1/Tr - 1/T), reduced time is A t, T in K (TOFFST = 0); data: Tr, H/R",
        "TB,SHIFT,DIELAST_MAT,1,2,TN",
        f"TBDATA,1,{card.temperature(law.reference_temperature)},{number(law.activation_energy / GAS_CONSTANT)}",
    ]


CODE = Code(
    "ansys",
    {
        "gent": _gent,
        "neo-hookean": _neo_hookean,
        "yeoh": _yeoh,
        "arruda-boyce": _arruda_boyce,
        "mooney-rivlin": _mooney_rivlin,
        "ogden": _ogden,
    },
    {"wlf": _wlf, "arrhenius": _arrhenius},
    _files,
    most_terms=100,
    absolute=("arrhenius",),
)
