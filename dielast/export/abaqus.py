"""Abaqus: *HYPERELASTIC, *VISCOELASTIC, TIME=PRONY and *TRS.

Conventions (Abaqus Keywords and Analysis guides): g_R(t) = 1 - sum g_i (1 - exp(-t/tau_i)), so the g_i are ratios to the
instantaneous modulus whichever moduli *HYPERELASTIC states, and sum to less than one. Reduced time is t/A with
log10 A = -C1 (T - T0)/(C2 + T - T0), or ln A = E0/R (1/(T - TZ) - 1/(T0 - TZ)) with R and TZ from *PHYSICAL CONSTANTS.
D1 = 2/K, zero for incompressible.
"""

from __future__ import annotations

from dielast.export.code import Card, Code, ogden_terms
from dielast.export.text import number
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius
from dielast.material.springs import CardForm
from dielast.units import ZERO_CELSIUS


def _files(card: Card) -> dict[str, str]:
    """`material.inp`."""
    options, long_term = card.options, card.options.moduli == "long-term"
    comments = [
        "Material card for Abaqus/Standard, written by dielast; include it with *INCLUDE, INPUT=material.inp",
        *card.notes,
        f"Temperatures: {options.temperature_scale}.",
        f"MODULI={'LONG TERM' if long_term else 'INSTANTANEOUS'}: the hyperelastic constants hold at "
        + ("infinite time." if long_term else "time zero."),
        "Prony lines: g_i, k_i, tau_i; g_i is the branch's modulus over the instantaneous one (for either MODULI),",
        "k_i = 0 (no bulk relaxation).",
        "G(t) = G_0 [1 - sum g_i (1 - exp(-t/tau_i))]; the equilibrium modulus is what the sum lacks of one, so keep every digit",
        "(Abaqus/Explicit: double precision).",
    ]
    if card.bulk is None:
        comments.append("D1 = 0: incompressible; hybrid elements, or plane stress (Abaqus/Explicit then takes its own K).")
    lines = [*(f"** {text}" for text in comments), *_model_data(card), f"*MATERIAL, NAME={card.name}"]
    if card.density is not None:
        lines += ["*DENSITY", number(card.density) + ","]
    lines += card.spring_lines(card.equilibrium if long_term else card.instantaneous)
    lines.append("*VISCOELASTIC, TIME=PRONY")
    lines += [f"{ratio}, 0, {number(time)}" for ratio, (_, time) in zip(card.ratios_below_one(), card.branches, strict=True)]
    return {"material.inp": "\n".join(lines + card.shift_lines()) + "\n"}


def _moduli(card: Card) -> str:
    return "MODULI=LONG TERM" if card.options.moduli == "long-term" else "MODULI=INSTANTANEOUS"


def _neo_hookean(spring: CardForm, card: Card) -> list[str]:
    """C10 = mu/2, D1."""
    return [f"*HYPERELASTIC, NEO HOOKE, {_moduli(card)}", f"{number(spring.modulus / 2)}, {number(card.compressibility)}"]


def _yeoh(spring: CardForm, card: Card) -> list[str]:
    """C10, C20, C30, D1, D2, D3."""
    series = map(number, spring.constants.values())
    return [f"*HYPERELASTIC, YEOH, {_moduli(card)}", ", ".join((*series, number(card.compressibility), "0", "0"))]


def _arruda_boyce(spring: CardForm, card: Card) -> list[str]:
    """mu (not the initial modulus), lambda_m, D."""
    constants = (spring.constants["mu"], spring.constants["locking_stretch"], card.compressibility)
    return [
        *(f"** {note}" for note in spring.notes),
        f"*HYPERELASTIC, ARRUDA-BOYCE, {_moduli(card)}",
        ", ".join(map(number, constants)),
    ]


def _mooney_rivlin(spring: CardForm, card: Card) -> list[str]:
    """C10, C01, D1."""
    constants = (*spring.constants.values(), card.compressibility)
    return [f"*HYPERELASTIC, MOONEY-RIVLIN, {_moduli(card)}", ", ".join(map(number, constants))]


def _ogden(spring: CardForm, card: Card) -> list[str]:
    """mu_i, alpha_i of every term, then D_i, eight numbers on a line; mu_i = mu_p alpha_p/2."""
    terms = ogden_terms(spring)
    values = [value for modulus, exponent in terms for value in (modulus * exponent / 2, exponent)]
    values += [card.compressibility, *[0.0] * (len(terms) - 1)]
    return [
        "** Ogden: W = sum 2 mu_i/alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), so that mu_i = mu_p alpha_p/2 of the form",
        "** mu_p/alpha_p, and the mu_i add up to the initial shear modulus",
        f"*HYPERELASTIC, OGDEN, N={len(terms)}, {_moduli(card)}",
        *(", ".join(map(number, values[start : start + 8])) for start in range(0, len(values), 8)),
    ]


def _model_data(card: Card) -> list[str]:
    """Model data that Arrhenius' law needs, which stands outside of a material."""
    if card.shift.name != Arrhenius.name:
        return []
    zero = 0.0 if card.options.temperature_scale == "K" else -ZERO_CELSIUS
    gas = GAS_CONSTANT * card.units.molar_energy
    return [
        "** Model data for the Arrhenius law; merge with a *PHYSICAL CONSTANTS of your own:",
        f"*PHYSICAL CONSTANTS, ABSOLUTE ZERO={number(zero)}, UNIVERSAL GAS CONSTANT={number(gas)}",
    ]


def _wlf(law: WLF, card: Card) -> list[str]:
    return [
        "** log10 A = -C1 (T - T0)/(C2 + T - T0), relaxation times times A; data: T0, C1, C2",
        "*TRS, DEFINITION=WLF",
        f"{card.temperature(law.reference_temperature)}, {number(law.C1)}, {number(law.C2)}",
    ]


def _arrhenius(law: Arrhenius, card: Card) -> list[str]:
    return [
        "** ln A = E0/R (1/(T - TZ) - 1/(T0 - TZ)), relaxation times times A; data: T0, E0",
        "*TRS, DEFINITION=ARRHENIUS",
        f"{card.temperature(law.reference_temperature)}, {number(law.activation_energy * card.units.molar_energy)}",
    ]


CODE = Code(
    "abaqus",
    {
        "neo-hookean": _neo_hookean,
        "yeoh": _yeoh,
        "arruda-boyce": _arruda_boyce,
        "mooney-rivlin": _mooney_rivlin,
        "ogden": _ogden,
    },
    {"wlf": _wlf, "arrhenius": _arrhenius},
    _files,
    most_exponents=6,
)
