"""FEBio: an "uncoupled viscoelastic" material over an uncoupled elastic one.

Conventions (FEBio User Manual): the relaxation function g0 + sum g_i exp(-t/t_i) multiplies the elastic response as it
stands, g0 = 1 unless stated; at most six terms, no shift function, a bulk modulus k is needed. Neo-Hookean and uncoupled is
Mooney-Rivlin with c2 = 0, G = 2 c1.
"""

from __future__ import annotations

from dielast.export.conventions import CardOptions, Code, number, prepare
from dielast.material.material import Material

CODE = Code("febio", laws=("gent", "neo-hookean"), shifts=(), most_terms=6, flows=True, poisson_ratio=0.495)


def write(material: Material, options: CardOptions) -> dict[str, str]:
    """`material.feb`; raises `InputError` for what FEBio cannot carry."""
    card = prepare(material, CODE, options)
    assert card.bulk is not None
    # a material that flows has no long-term modulus to refer to
    long_term = options.moduli == "long-term" and card.equilibrium > 0
    modulus = card.equilibrium if long_term else card.instantaneous
    comments = [
        "Material card for FEBio 4, written by dielast; use it with Material from=material.feb in a model",
        *card.notes,
        "G(t) = G [g0 + sum g_i exp(-t/t_i)], G the elastic material's shear modulus, here at "
        + ("infinite time (g0 = 1)." if long_term else "time zero (all g sum to one)."),
    ]
    if options.bulk_modulus is None and options.poisson_ratio is None:
        comments.append(f"k: by default from Poisson's ratio {CODE.poisson_ratio:g} at time zero.")
    entries = {"k": card.bulk, "g0": card.equilibrium / modulus}
    if card.density is not None:
        entries = {"density": card.density, **entries}
    for index, (own, time) in enumerate(zip(card.modulus.tolist(), card.time.tolist(), strict=True), 1):
        entries |= {f"g{index}": own / modulus, f"t{index}": time}
    if card.law == "gent":
        elastic, constants = "Gent", {"G": modulus, "Jm": card.limits[0]}
    else:
        elastic, constants = "Mooney-Rivlin", {"c1": modulus / 2, "c2": 0.0}
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<febio_spec version="4.0">',
        *(f"  <!-- {text} -->" for text in comments),
        "  <Material>",
        f'    <material id="1" name="{card.name}" type="uncoupled viscoelastic">',
        *(f"      <{key}>{number(value)}</{key}>" for key, value in entries.items()),
        f'      <elastic type="{elastic}">',
        *(f"        <{key}>{number(value)}</{key}>" for key, value in constants.items()),
        "      </elastic>",
        "    </material>",
        "  </Material>",
        "</febio_spec>",
    ]
    return {"material.feb": "\n".join(lines) + "\n"}
