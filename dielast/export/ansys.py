"""ANSYS Mechanical APDL: TB,HYPER with TB,PRONY,,,,SHEAR and TB,SHIFT.

Conventions (Material Reference, viscoelasticity): hyperelastic constants are instantaneous;
G(t) = G_0 [a_inf + sum a_i exp(-t/tau_i)] with a_inf = 1 - sum a_i; at most 100 pairs, six values on a TBDATA line. Reduced time is
A t, not t/A, with log10 A = C1 (T - Tr)/(C2 + T - Tr), so the constants are the usual ones; TN: ln A = H/R (1/Tr - 1/T), absolute
temperatures. d = 2/K, zero for incompressible.
"""

from __future__ import annotations

from dielast.export.conventions import Card, CardOptions, Code, number, prepare, ratios_below_one, temperature, yeoh_series
from dielast.material.material import Material
from dielast.material.shift import GAS_CONSTANT, WLF, Arrhenius

CODE = Code("ansys", laws=("gent", "neo-hookean", "yeoh"), shifts=(WLF, Arrhenius), most_terms=100, arrhenius_in_kelvin=True)


def write(material: Material, options: CardOptions) -> dict[str, str]:
    """`material.mac`; raises `InputError` for what APDL cannot carry."""
    card = prepare(material, CODE, options)
    pairs = [
        text for ratio, time in zip(ratios_below_one(card, CODE), card.time.tolist(), strict=True) for text in (ratio, number(time))
    ]
    comments = [
        "Material card for ANSYS Mechanical APDL, written by dielast; read it in /PREP7 with /INPUT,material,mac",
        *card.notes,
        f"Temperatures: {options.temperature_scale}.",
        "Hyperelastic constants are instantaneous (time zero), as TB,PRONY takes them.",
        "TB,PRONY,SHEAR pairs: a_i (the branch's modulus over the instantaneous one), tau_i.",
        "G(t) = G_0 [1 - sum a_i + sum a_i exp(-t/tau_i)]; the equilibrium modulus is what the sum lacks of one: keep every digit.",
    ]
    if card.bulk is None:
        comments.append("d = 0: incompressible; mixed u-P elements (KEYOPT(6) = 1), or plane stress.")
    lines = [*(f"! {text}" for text in comments), "DIELAST_MAT = 1  ! material number"]
    if card.density is not None:
        lines.append(f"MP,DENS,DIELAST_MAT,{number(card.density)}")
    lines += [*_hyper(card), f"TB,PRONY,DIELAST_MAT,1,{len(card.time)},SHEAR"]
    lines += [f"TBDATA,{start + 1},{','.join(pairs[start : start + 6])}" for start in range(0, len(pairs), 6)]
    return {"material.mac": "\n".join(lines + _shift(card, options)) + "\n"}


def _hyper(card: Card) -> list[str]:
    modulus, limit = card.instantaneous, card.limits[0]
    compliance = number(card.compressibility)
    if card.law == "gent":
        return [
            "! Gent: mu, J_m, d",
            "TB,HYPER,DIELAST_MAT,1,3,GENT",
            f"TBDATA,1,{number(modulus)},{number(limit)},{compliance}",
        ]
    if card.law == "yeoh":
        series = ",".join(map(number, yeoh_series(modulus, limit)))
        return ["! Yeoh: C10, C20, C30, d1, d2, d3", "TB,HYPER,DIELAST_MAT,1,3,YEOH", f"TBDATA,1,{series},{compliance},0,0"]
    return ["! neo-Hookean: mu, d", "TB,HYPER,DIELAST_MAT,1,2,NEO", f"TBDATA,1,{number(modulus)},{compliance}"]


def _shift(card: Card, options: CardOptions) -> list[str]:
    match card.shift:
        case WLF(reference, C1, C2):
            return [
                "! log10 A = C1 (T - Tr)/(C2 + T - Tr), reduced time is A t (A is one over dielast's a(T)); data: Tr, C1, C2",
                "TB,SHIFT,DIELAST_MAT,1,3,WLF",
                f"TBDATA,1,{temperature(reference, options)},{number(C1)},{number(C2)}",
            ]
        case Arrhenius(reference, energy):
            return [
                "! ln A = (H/R) (1/Tr - 1/T), reduced time is A t, T in K (TOFFST = 0); data: Tr, H/R",
                "TB,SHIFT,DIELAST_MAT,1,2,TN",
                f"TBDATA,1,{temperature(reference, options)},{number(energy / GAS_CONSTANT)}",
            ]
        case _:
            return []
