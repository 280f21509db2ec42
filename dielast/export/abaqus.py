"""Abaqus: *HYPERELASTIC, *VISCOELASTIC, TIME=PRONY and *TRS.

Conventions (Abaqus Keywords and Analysis guides): g_R(t) = 1 - sum g_i (1 - exp(-t/tau_i)), so the g_i are ratios to the
instantaneous modulus whichever moduli *HYPERELASTIC states, and sum to less than one. Reduced time is t/A with
log10 A = -C1 (T - T0)/(C2 + T - T0), or ln A = E0/R (1/(T - TZ) - 1/(T0 - TZ)) with R and TZ from *PHYSICAL CONSTANTS.
D1 = 2/K, zero for incompressible.
"""

from __future__ import annotations

from dielast.export.conventions import UNITS, Card, CardOptions, Code, number, prepare, ratios_below_one, temperature, yeoh_series
from dielast.material.material import Material
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius
from dielast.units import ZERO_CELSIUS

CODE = Code("abaqus", laws=("neo-hookean", "yeoh"), shifts=(WLF, Arrhenius))


def write(material: Material, options: CardOptions) -> dict[str, str]:
    """`material.inp`; raises `InputError` for what Abaqus cannot carry."""
    card = prepare(material, CODE, options)
    ratios = ratios_below_one(card, CODE)
    long_term = options.moduli == "long-term"
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
    lines = [*(f"** {text}" for text in comments), *_constants(card, options), f"*MATERIAL, NAME={card.name}"]
    if card.density is not None:
        lines += ["*DENSITY", number(card.density) + ","]
    modulus = card.equilibrium if long_term else card.instantaneous
    compliance = number(card.compressibility)
    moduli = "LONG TERM" if long_term else "INSTANTANEOUS"
    if card.law == "yeoh":
        series = map(number, yeoh_series(modulus, card.limits[0]))
        lines += [f"*HYPERELASTIC, YEOH, MODULI={moduli}", ", ".join((*series, compliance, "0", "0"))]
    else:
        lines += [f"*HYPERELASTIC, NEO HOOKE, MODULI={moduli}", f"{number(modulus / 2)}, {compliance}"]
    lines.append("*VISCOELASTIC, TIME=PRONY")
    lines += [f"{ratio}, 0, {number(time)}" for ratio, time in zip(ratios, card.time.tolist(), strict=True)]
    return {"material.inp": "\n".join(lines + _trs(card, options)) + "\n"}


def _constants(card: Card, options: CardOptions) -> list[str]:
    """Model data that Arrhenius' law needs, which stands outside of a material."""
    if not isinstance(card.shift, Arrhenius):
        return []
    zero = 0.0 if options.temperature_scale == "K" else -ZERO_CELSIUS
    gas = GAS_CONSTANT * UNITS[options.units].molar_energy
    return [
        "** Model data for the Arrhenius law; merge with a *PHYSICAL CONSTANTS of your own:",
        f"*PHYSICAL CONSTANTS, ABSOLUTE ZERO={number(zero)}, UNIVERSAL GAS CONSTANT={number(gas)}",
    ]


def _trs(card: Card, options: CardOptions) -> list[str]:
    match card.shift:
        case WLF(reference, C1, C2):
            return [
                "** log10 A = -C1 (T - T0)/(C2 + T - T0), relaxation times times A; data: T0, C1, C2",
                "*TRS, DEFINITION=WLF",
                f"{temperature(reference, options)}, {number(C1)}, {number(C2)}",
            ]
        case Arrhenius(reference, energy):
            return [
                "** ln A = E0/R (1/(T - TZ) - 1/(T0 - TZ)), relaxation times times A; data: T0, E0",
                "*TRS, DEFINITION=ARRHENIUS",
                f"{temperature(reference, options)}, {number(energy * UNITS[options.units].molar_energy)}",
            ]
        case _:
            return []
