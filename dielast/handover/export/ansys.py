"""ANSYS Mechanical APDL: TB,HYPER with TB,PRONY,,,,SHEAR and TB,SHIFT.

Conventions (Material Reference, viscoelasticity): hyperelastic constants are instantaneous;
G(t) = G_0 [a_inf + sum a_i exp(-t/tau_i)] with a_inf = 1 - sum a_i; at most 100 pairs, six values on a TBDATA line. Reduced time is
A t, not t/A, with log10 A = C1 (T - Tr)/(C2 + T - Tr), so the constants are the usual ones; TN: ln A = H/R (1/Tr - 1/T), absolute
temperatures. d = 2/K, zero for incompressible.
"""

from collections.abc import Iterable
from itertools import chain

from dielast.handover.export.code import Card, Code, number, ogden_terms, rows_of
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius
from dielast.material.springs import CardForm


def _files(card: Card) -> dict[str, str]:
    """`material.mac`."""
    pairs = chain(*zip(card.ratios_below_one(), map(number, card.time.tolist()), strict=True))
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
    lines += _data(pairs)
    return {"material.mac": "\n".join(lines + card.shift_lines()) + "\n"}


def _hyperelastic(card: Card, keyword: str, count: int, comment: str, constants: Iterable[float], terms: int = 1) -> list[str]:
    """The `constants` of a law, then as many d_i as its energy has `terms`; `count` is what TB,HYPER states beside the keyword."""
    numbers = [*constants, *card.compressibilities(terms)]
    return [f"! {comment}", f"TB,HYPER,DIELAST_MAT,1,{count},{keyword}", *_data(map(number, numbers))]


def _data(numbers: Iterable[str]) -> list[str]:
    """TBDATA with six numbers on a line."""
    return [f"TBDATA,{6 * line + 1},{','.join(row)}" for line, row in enumerate(rows_of(numbers, 6))]


def _arruda_boyce(spring: CardForm, card: Card) -> list[str]:
    constants = spring.constants["mu"], spring.constants["locking_stretch"]
    notes = [f"! {note}" for note in spring.notes]
    return notes + _hyperelastic(card, "BOYCE", 3, "Arruda-Boyce: mu, lambda_L, d", constants)


def _ogden(spring: CardForm, card: Card) -> list[str]:
    terms = ogden_terms(spring)
    comment = "Ogden: mu_i, alpha_i, then d_i; W = sum mu_i/alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3)"
    return _hyperelastic(card, "OGDEN", len(terms), comment, chain(*terms), len(terms))


def _shift(card: Card, keyword: str, equation: str, *constants: float) -> list[str]:
    """A shift law with its `constants` behind the reference temperature."""
    data = card.shift_data(*constants)
    return [f"! {equation}", f"TB,SHIFT,DIELAST_MAT,1,{len(data)},{keyword}", *_data(data)]


def _wlf(law: WLF, card: Card) -> list[str]:
    equation = "log10 A = C1 (T - Tr)/(C2 + T - Tr), reduced time is A t (A is one over dielast's a(T)); data: Tr, C1, C2"
    return _shift(card, "WLF", equation, law.C1, law.C2)


def _arrhenius(law: Arrhenius, card: Card) -> list[str]:
    equation = "ln A = (H/R) (1/Tr - 1/T), reduced time is A t, T in K (TOFFST = 0); data: Tr, H/R"
    return _shift(card, "TN", equation, law.activation_energy / GAS_CONSTANT)


CODE = Code(
    "ansys",
    {
        "gent": lambda spring, card: _hyperelastic(
            card, "GENT", 3, "Gent: mu, J_m, d", [spring.modulus, spring.constants["J_lim"]]
        ),
        "neo-hookean": lambda spring, card: _hyperelastic(card, "NEO", 2, "neo-Hookean: mu, d", [spring.modulus]),
        "yeoh": lambda spring, card: _hyperelastic(
            card, "YEOH", 3, "Yeoh: C10, C20, C30, d1, d2, d3", spring.constants.values(), 3
        ),
        "arruda-boyce": _arruda_boyce,
        "mooney-rivlin": lambda spring, card: _hyperelastic(
            card, "MOONEY", 2, "Mooney-Rivlin: C10, C01, d", spring.constants.values()
        ),
        "ogden": _ogden,
    },
    {"wlf": _wlf, "arrhenius": _arrhenius},
    _files,
    most_terms=100,
    absolute=("arrhenius",),
)
