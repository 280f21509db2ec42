"""FEBio: an "uncoupled viscoelastic" material over an uncoupled elastic one.

Conventions (FEBio User Manual): the relaxation function g0 + sum g_i exp(-t/t_i) multiplies the elastic response as it
stands, g0 = 1 unless stated; at most six terms, no shift function, a bulk modulus k is needed. Neo-Hookean and uncoupled is
Mooney-Rivlin with c2 = 0, G = 2 c1. Ogden's is W = sum c_i/m_i^2 (l1^m_i + l2^m_i + l3^m_i - 3), uncoupled. Its Arruda-Boyce
is left out: the series in the source (FEArrudaBoyce.cpp) has other coefficients than that of the inverse Langevin function.
"""

from dielast.handover.export.code import Card, Code, number, ogden_terms
from dielast.material.springs import CardForm


def _files(card: Card) -> dict[str, str]:
    """`material.feb`."""
    # a material that flows has no long-term modulus to refer to
    long_term = card.options.moduli == "long-term" and card.equilibrium > 0
    modulus = card.equilibrium if long_term else card.instantaneous
    comments = [
        "Material card for FEBio 4, written by dielast; use it with Material from=material.feb in a model",
        *card.notes,
        "G(t) = G [g0 + sum g_i exp(-t/t_i)], G the elastic material's shear modulus, here at "
        + ("infinite time (g0 = 1)." if long_term else "time zero (all g sum to one)."),
    ]
    comments += [f"k: {text}" for text in card.default_bulk]
    entries = {"k": card.bulk or 0.0, "g0": card.equilibrium / modulus}
    if card.density is not None:
        entries = {"density": card.density, **entries}
    for index, (stiffness, time) in enumerate(card.branches, 1):
        entries |= {f"g{index}": stiffness / modulus, f"t{index}": time}
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<febio_spec version="4.0">',
        *(f"  <!-- {text} -->" for text in comments),
        "  <Material>",
        f'    <material id="1" name="{card.name}" type="uncoupled viscoelastic">',
        *(f"      <{key}>{number(value)}</{key}>" for key, value in entries.items()),
        *card.spring_lines(modulus),
        "    </material>",
        "  </Material>",
        "</febio_spec>",
    ]
    return {"material.feb": "\n".join(lines) + "\n"}


def _elastic(kind: str, constants: dict[str, float]) -> list[str]:
    values = (f"        <{key}>{number(value)}</{key}>" for key, value in constants.items())
    return [f'      <elastic type="{kind}">', *values, "      </elastic>"]


def _numbered(spring: CardForm) -> dict[str, float]:
    """The constants of the spring as c1, c2 and so on."""
    return {f"c{index}": value for index, value in enumerate(spring.constants.values(), 1)}


def _ogden(spring: CardForm, card: Card) -> list[str]:
    """c_i = mu_p alpha_p, m_i = alpha_p."""
    constants: dict[str, float] = {}
    for index, (modulus, exponent) in enumerate(ogden_terms(spring), 1):
        constants |= {f"c{index}": modulus * exponent, f"m{index}": exponent}
    return _elastic("Ogden", constants)


CODE = Code(
    "febio",
    {
        "gent": lambda spring, card: _elastic("Gent", {"G": spring.modulus, "Jm": spring.constants["J_lim"]}),
        "neo-hookean": lambda spring, card: _elastic("Mooney-Rivlin", {"c1": spring.modulus / 2, "c2": 0.0}),
        "mooney-rivlin": lambda spring, card: _elastic("Mooney-Rivlin", _numbered(spring)),
        "ogden": _ogden,
        "yeoh": lambda spring, card: _elastic("Yeoh", _numbered(spring)),  # c_i of (I1 - 3)^i
    },
    {},
    _files,
    most_terms=6,
    flows=True,
    poisson_ratio=0.495,
    most_exponents=6,
    unlike={"arruda-boyce": "is a series with other coefficients than those of the inverse Langevin function"},
)
