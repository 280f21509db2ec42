"""Abaqus: *HYPERELASTIC, *VISCOELASTIC, TIME=PRONY and *TRS.

Conventions (Abaqus Keywords and Analysis guides): g_R(t) = 1 - sum g_i (1 - exp(-t/tau_i)), so the g_i are ratios to the
instantaneous modulus whichever moduli *HYPERELASTIC states, and sum to less than one. Reduced time is t/A with
log10 A = -C1 (T - T0)/(C2 + T - T0), or ln A = E0/R (1/(T - TZ) - 1/(T0 - TZ)) with R and TZ from *PHYSICAL CONSTANTS.
D1 = 2/K, zero for incompressible.
"""

from collections.abc import Iterable, Sequence

from dielast.handover.export.code import Card, Code, number, ogden_terms, rows_of
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius, kelvin
from dielast.material.springs import CardForm


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
    lines += [f"{ratio}, 0, {number(time)}" for ratio, time in zip(card.ratios_below_one(), card.time.tolist(), strict=True)]
    return {"material.inp": "\n".join(lines + card.shift_lines()) + "\n"}


def _hyperelastic(card: Card, keyword: str, constants: Iterable[float], terms: int = 1, comments: Sequence[str] = ()) -> list[str]:
    """The `constants` of a law, then as many D_i as its energy has `terms`, eight numbers on a line."""
    moduli = "LONG TERM" if card.options.moduli == "long-term" else "INSTANTANEOUS"
    numbers = [*constants, *card.compressibilities(terms)]
    return [
        *(f"** {comment}" for comment in comments),
        f"*HYPERELASTIC, {keyword}, MODULI={moduli}",
        *(", ".join(row) for row in rows_of(map(number, numbers), 8)),
    ]


def _arruda_boyce(spring: CardForm, card: Card) -> list[str]:
    """mu (not the initial modulus), lambda_m."""
    constants = spring.constants["mu"], spring.constants["locking_stretch"]
    return _hyperelastic(card, "ARRUDA-BOYCE", constants, comments=spring.notes)


def _ogden(spring: CardForm, card: Card) -> list[str]:
    """mu_i, alpha_i of every term; mu_i = mu_p alpha_p/2."""
    terms = ogden_terms(spring)
    constants = [value for modulus, exponent in terms for value in (modulus * exponent / 2, exponent)]
    comments = (
        "Ogden: W = sum 2 mu_i/alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), so that mu_i = mu_p alpha_p/2 of the form",
        "mu_p/alpha_p, and the mu_i add up to the initial shear modulus",
    )
    return _hyperelastic(card, f"OGDEN, N={len(terms)}", constants, len(terms), comments)


def _model_data(card: Card) -> list[str]:
    """Model data that Arrhenius' law needs, which stands outside of a material."""
    if card.shift.name != Arrhenius.name:
        return []
    zero = 0.0 if card.options.temperature_scale == "K" else -kelvin(0.0)
    gas = GAS_CONSTANT * card.units.molar_energy
    return [
        "** Model data for the Arrhenius law; merge with a *PHYSICAL CONSTANTS of your own:",
        f"*PHYSICAL CONSTANTS, ABSOLUTE ZERO={number(zero)}, UNIVERSAL GAS CONSTANT={number(gas)}",
    ]


def _trs(card: Card, definition: str, equation: str, *constants: float) -> list[str]:
    """A shift law with its `constants` behind the reference temperature."""
    data = card.shift_data(*constants)
    return [f"** {equation}", f"*TRS, DEFINITION={definition}", ", ".join(data)]


def _wlf(law: WLF, card: Card) -> list[str]:
    equation = "log10 A = -C1 (T - T0)/(C2 + T - T0), relaxation times times A; data: T0, C1, C2"
    return _trs(card, "WLF", equation, law.C1, law.C2)


def _arrhenius(law: Arrhenius, card: Card) -> list[str]:
    equation = "ln A = E0/R (1/(T - TZ) - 1/(T0 - TZ)), relaxation times times A; data: T0, E0"
    return _trs(card, "ARRHENIUS", equation, law.activation_energy * card.units.molar_energy)


CODE = Code(
    "abaqus",
    {
        "neo-hookean": lambda spring, card: _hyperelastic(card, "NEO HOOKE", [spring.modulus / 2]),  # C10
        "yeoh": lambda spring, card: _hyperelastic(card, "YEOH", spring.constants.values(), 3),
        "arruda-boyce": _arruda_boyce,
        "mooney-rivlin": lambda spring, card: _hyperelastic(card, "MOONEY-RIVLIN", spring.constants.values()),
        "ogden": _ogden,
    },
    {"wlf": _wlf, "arrhenius": _arrhenius},
    _files,
    most_exponents=6,
)
