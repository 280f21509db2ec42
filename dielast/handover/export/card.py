"""A material as a card for a finite-element code.

Nothing is approximated in silence: a property that a code cannot represent is an `InputError` with the recipe key to change, or is
replaced if an option allows that, and the card then says so.
"""

import math
import re
import textwrap
import unicodedata
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, Mistakes, Problem, located, nearest, shown, warn
from dielast.base.registry import Registry
from dielast.handover.export import abaqus, ansys, comsol, febio, mfront
from dielast.handover.export.code import UNITS, Card, CardOptions, Code
from dielast.material.material import Material
from dielast.material.shift import NoShift, ShiftLaw
from dielast.material.springs import CardForm, SpringLaw

NOTE_WIDTH = 120  # characters of a line of notes


CODES: Registry[Code] = Registry(
    "finite-element code",
    abaqus.CODE,
    ansys.CODE,
    febio.CODE,
    comsol.CODE,
    mfront.CODE,
    group="dielast.cards",
    base=Code,
)


def spring_names() -> tuple[str, ...]:
    """The springs that some code has."""
    return tuple(sorted({name for code in CODES for name in code.springs}))


def export_card(material: Material, form: str, options: CardOptions | None = None) -> dict[str, str]:
    """The material as text files (name -> ASCII text) for the finite-element code `form`, one of `CODES`.

    Every card states its conventions and what it leaves out. Raises `InputError` with the option to change where the code cannot
    represent the material and the options do not allow a replacement.
    """
    if form not in CODES:
        raise InputError(f"{shown(form)}: {nearest(form, CODES.names)}", argument="formats")
    options = options or CardOptions()
    springs = spring_names()
    if options.hyperelastic is not None and options.hyperelastic not in springs:
        raise InputError(f"{shown(options.hyperelastic)}: {nearest(options.hyperelastic, springs)}", argument="hyperelastic")
    code = CODES[form]
    return code.write(prepare(material, code, options))


def export_cards(material: Material, formats: tuple[str, ...], options: CardOptions | None = None) -> dict[str, str]:
    """The files of several codes; raises `InputError` with a line for every code that cannot carry the material."""
    files: dict[str, str] = {}
    wrong = Mistakes()
    for form in formats:
        files |= wrong.tried(partial(export_card, material, form, options)) or {}
    wrong.refuse()
    return files


def prepare(material: Material, code: Code, options: CardOptions) -> Card:
    """The material as `code` can represent it; raises `InputError` with a problem for each option to change where it cannot."""
    wrong = Mistakes()
    if material.flow.depends_on_stress:
        raise InputError(
            f"{code.name} has Prony series, whose flow is linear: no card can hold {material.flow.title}", argument="formats"
        )
    options = replace(options, units=code.units or options.units)
    units = UNITS[options.units]
    spectrum = material.spectrum.slowest_first()
    there = spectrum.shear_modulus > 0
    dropped = int(np.count_nonzero(~there))
    modulus, time = spectrum.shear_modulus[there], spectrum.relaxation_time[there]
    wrong.tried(lambda: _check_branches(material, len(modulus), code))
    spring = wrong.tried(lambda: _springs(material, code, options))
    shifted = wrong.tried(lambda: _shift(material.shift, time, code, options))
    scaled = wrong.tried(lambda: _moduli(material, modulus, material.shift if shifted is None else shifted[0]))
    bulk = None
    if scaled is not None:
        bulk = wrong.tried(lambda: _bulk(scaled[0] + float(np.sum(scaled[1])), code, options))
    wrong.refuse()
    assert spring is not None
    assert shifted is not None
    assert scaled is not None
    equilibrium, modulus, modulus_notes = scaled
    (law, equilibrium_law, branch_law, spring_notes), (shift, time, note) = spring, shifted
    notes = [
        f"Name in dielast: {plain(material.name)}",
        f"Units: {units.names}; moduli are shear moduli unless said otherwise.",
        note,
        *modulus_notes,
        *options.notes,
    ]
    if dropped:
        notes.append(f"Left out: branches of zero modulus ({dropped}).")
        warn(f"the cards leave out {dropped} {'branch' if dropped == 1 else 'branches'} of zero modulus")
    notes += spring_notes
    if bulk is not None:
        notes.append("The material is incompressible; the bulk modulus K makes Young's modulus 9 K G/(3 K + G), short of 3 G.")
    notes += [
        "Exact: the linear viscoelastic response. At large strain the code's own convolution of the elastic stress stands in for",
        "the branches' own elastic and viscous stretches (DOI 10.1115/1.4030850).",
        "Not carried: permittivity, electrostatic stress, breakdown field.",
    ]
    return Card(
        code=code,
        options=options,
        name=identifier(material.name),
        law=law,
        equilibrium_law=equilibrium_law,
        branch_law=branch_law,
        equilibrium=equilibrium * units.stress,
        modulus=modulus * units.stress,
        time=time,
        shift=shift,
        bulk=None if bulk is None else bulk * units.stress,
        density=None if options.density is None else options.density * units.density,
        notes=tuple(notes),
    )


def _check_branches(material: Material, terms: int, code: Code) -> None:
    wrong = Mistakes()
    if terms == 0:
        spring = f"{_described(material.equilibrium_law)} with a shear modulus of {material.equilibrium_modulus:g} Pa"
        nothing = "no branch has a modulus: there is nothing viscoelastic to write"
        alone = f"{nothing}; state the spring, {spring}, as a hyperelastic material of the code"
        wrong.append(Problem(alone, file=code.name, argument="formats"))
    if code.most_terms is not None and terms > code.most_terms:
        wrong.append(
            Problem(
                f"{code.name} takes at most {code.most_terms} Prony terms, the spectrum has {terms}: "
                "fit fewer ([fit] branches), or as many as a window of times needs ([reduce] window)",
                argument="formats",
            )
        )
    if material.equilibrium_modulus == 0 and not code.flows:
        wrong.append(
            Problem(
                f"{code.name} needs an equilibrium modulus above zero (ratios that sum to less than one): "
                "the material flows; if it does not, state fit.equilibrium_modulus",
                argument="formats",
            )
        )
    wrong.refuse()


def _springs(material: Material, code: Code, options: CardOptions) -> tuple[str, SpringLaw, SpringLaw, list[str]]:
    """The code's name of the springs, the laws of the equilibrium spring and of the branches, and notes on them."""
    stated = (material.equilibrium_law, material.nonequilibrium_law)
    for law in stated:
        if options.J_lim is not None and "J_lim" not in law.values():
            raise InputError(f"the material's {law.title} springs have no J_lim", argument="J_lim")
    first, rest = (law if options.J_lim is None else law.with_values({"J_lim": options.J_lim}) for law in stated)
    exact_for_both = {form.law for form in rest.forms() if form.exact}
    common = [form.law for form in first.forms() if form.exact and form.law in exact_for_both]
    form_name = options.hyperelastic or (common[0] if common else first.name)
    possible = " or ".join(f'"{form}"' for form in code.springs if first.form(form) and rest.form(form))
    approximated = f"allow {possible} instead, which the card will name as an approximation"
    instead = approximated if possible else "no card can hold these springs"
    if form_name not in code.springs:
        lacks = f'{code.name} has no "{form_name}" law'
        if form_name in code.unlike:
            lacks = f'the "{form_name}" law of {code.name} {code.unlike[form_name]}'
        raise InputError(f"{lacks}: {instead}", argument="hyperelastic")
    if options.hyperelastic is None and not common:
        alike = f"{code.name} has one law for the equilibrium spring and the branches alike"
        raise InputError(f"{alike}, not {_described(first)} and {_described(rest)}: {instead}", argument="hyperelastic")
    forms = first.form(form_name), rest.form(form_name)
    if forms[0] is None or forms[1] is None:
        raise InputError(f'"{form_name}" cannot stand for {_titles(first, rest)}', argument="hyperelastic")
    if forms[0].constants and forms[0].needs and forms[1].needs:
        needs = forms[0].needs
        raise InputError(
            f'"{form_name}" needs a {needs}, and the material has none: state {needs}', argument="hyperelastic", mentions=(needs,)
        )
    if not code.separate_limits:
        _check_alike(first, rest, forms[0], forms[1], code)
    terms = len(forms[0].constants) // 2
    if form_name == "ogden" and code.most_exponents is not None and terms > code.most_exponents:
        raise InputError(
            f'{code.name} takes at most {code.most_exponents} terms of an Ogden spring, not {terms}: allow "neo-hookean" instead, '
            "which the card will name as an approximation",
            argument="hyperelastic",
        )
    notes = [f"Springs: {form_name}" + (f", {_constants(first, rest) or _titles(first, rest)}." if forms[0].constants else ".")]
    as_stated = [law.form(form_name) for law in stated]
    if all(form and form.exact for form in as_stated) and _constants(first, rest) == _constants(*stated):
        return form_name, first, rest, notes
    notes.append(f"APPROXIMATION, allowed by the recipe: the material's springs are {_titles(*stated)}.")
    return form_name, first, rest, [*notes, *_losses(forms[0], forms[1])]


def _losses(first: CardForm, rest: CardForm) -> list[str]:
    """What the forms of the equilibrium spring and of the branches lose where they approximate."""
    lost, lost_in_branches = (() if form.exact else form.notes for form in (first, rest))
    if lost == lost_in_branches:
        return list(lost)
    named = (("Equilibrium spring:", lost), ("Branches:", lost_in_branches))
    return [line for springs, notes in named if notes for line in (springs, *notes)]


def _check_alike(first: SpringLaw, rest: SpringLaw, one: CardForm, other: CardForm, code: Code) -> None:
    """`InputError` if the forms of the equilibrium spring and of the branches differ by more than their modulus."""
    if one.constants.keys() == other.constants.keys() and all(
        math.isclose(value, other.constants[name], rel_tol=1e-9, abs_tol=1e-12) for name, value in one.constants.items()
    ):
        return
    instead = 'or allow hyperelastic = "neo-hookean"'
    alone = "for the equilibrium spring and the branches alike"
    values, others = first.shape(), rest.shape()
    # a constant that an option of the card states once for all springs
    for name in [name for name in values if name in others and hasattr(CardOptions, name)]:
        value = values[name]
        raise InputError(f"{code.name} has one {name} {alone}, not {value} and {others[name]}: state one, {instead}", argument=name)
    alike = f"{code.name} has one set of constants {alone}, not {_described(first)} and {_described(rest)}"
    raise InputError(f"{alike}: make them alike in the material file, {instead}", argument="hyperelastic")


def _titles(first: SpringLaw, rest: SpringLaw) -> str:
    """The laws of the equilibrium spring and of the branches, with their constants."""
    if type(first) is not type(rest):
        return f"{_described(first)} in equilibrium and {_described(rest)} in the branches"
    constants = _constants(first, rest)
    return f"{first.title}'s with {constants}" if constants else first.title


def _constants(first: SpringLaw, rest: SpringLaw) -> str:
    """The constants of the equilibrium spring and of the branches if they have one law, else an empty text."""
    if type(first) is not type(rest):
        return ""
    values = zip(first.shape().items(), rest.shape().values(), strict=True)
    return "; ".join(f"{name} = {value} (equilibrium) and {other} (branches)" for (name, value), other in values)


def _described(law: SpringLaw) -> str:
    """A law with its constants."""
    return f"{law.title} ({', '.join(f'{name} = {value}' for name, value in law.shape().items())})" if law.shape() else law.title


def _shift(law: ShiftLaw, time: NDArray[np.float64], code: Code, options: CardOptions) -> tuple[ShiftLaw, NDArray[np.float64], str]:
    """The shift law of the card, its relaxation times in s, and a note on the temperature that they hold at."""
    stated, law = law, law.equivalent()
    there = f"{law.reference_temperature:g} degC"
    if not law.depends_on_temperature:
        return law, time, f"Relaxation times hold at {there}; the material has no shift law."
    if law.name in code.shifts:
        if law.name in code.absolute and options.temperature_scale != "K":
            raise InputError(
                f'{code.name} takes the {law.title} law in absolute temperatures only: "K" is needed', argument="temperature_scale"
            )
        same = "" if law is stated else f" It is the {stated.title} law of dielast."
        return law, time, f"Relaxation times hold at {there}, the reference temperature of the shift law.{same}"
    missing = f'{code.name} has no shift function for the law "{law.name}"'
    if options.temperature is None:
        raise InputError(f"{missing}: state the one temperature that its card holds for", argument="temperature")
    with located(argument="temperature"):
        shift_factor = float(10 ** law.log10_shift_factor(options.temperature))
    scaled = time * shift_factor
    if not np.all(np.isfinite(scaled) & (scaled > 0)):
        raise InputError(
            f"{options.temperature:g} degC: the relaxation times are beyond what a number holds", argument="temperature"
        )
    return NoShift(options.temperature), scaled, f"Relaxation times hold at {options.temperature:g} degC ONLY: {missing}."


def _moduli(material: Material, modulus: NDArray[np.float64], shift: ShiftLaw) -> tuple[float, NDArray[np.float64], list[str]]:
    """The moduli in Pa of the equilibrium spring and of the branches at the temperature that the card's relaxation times hold at,
    and notes: no code's card lets moduli change with temperature beside its shift function.
    """
    at, reference = shift.reference_temperature, material.reference_temperature
    scalings = {"the equilibrium spring": material.equilibrium_scaling, "the branches": material.nonequilibrium_scaling}
    changing = [springs for springs, scaling in scalings.items() if scaling.depends_on_temperature]
    if not changing:
        return material.equilibrium_modulus, modulus, []
    with located(argument="temperature"):
        first, rest = (float(scaling.factor(at, reference)) for scaling in scalings.values())
    left_out = f"those of {' and '.join(changing)} change with temperature in dielast, which the card leaves out"
    warn(f"the moduli of the cards hold at {at:g} degC only: {left_out}")
    titles = " and ".join(dict.fromkeys(law.title for law in scalings.values() if law.depends_on_temperature))
    note = f"Moduli hold at {at:g} degC ONLY: {left_out} ({titles})."
    return first * material.equilibrium_modulus, rest * modulus, textwrap.wrap(note, NOTE_WIDTH)


def _bulk(shear: float, code: Code, options: CardOptions) -> float | None:
    if options.bulk_modulus is not None:
        if options.bulk_modulus <= 2 / 3 * shear:
            raise InputError(
                f"{options.bulk_modulus:g} Pa with an instantaneous shear modulus of {shear:.4g} Pa makes "
                f"Poisson's ratio negative: more than {2 / 3 * shear:.4g} Pa is needed, for rubbers about 2 GPa",
                argument="bulk_modulus",
            )
        return options.bulk_modulus
    ratio = code.poisson_ratio if options.poisson_ratio is None else options.poisson_ratio
    return None if ratio is None else 2 * shear * (1 + ratio) / (3 * (1 - 2 * ratio))


def identifier(name: str) -> str:
    """A name of ASCII letters, digits and underscores that begins with a letter, at most 60 long."""
    text = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    text = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:60].rstrip("_")
    return text if text[:1].isalpha() else f"material_{text}".rstrip("_")


def plain(text: str) -> str:
    """Text that is safe in the comments of every code: printable ASCII, no backslash, no double hyphen."""
    shown = "".join(mark if mark.isascii() and mark.isprintable() and mark != "\\" else "?" for mark in text)
    return re.sub(r"-(?=-)", "- ", shown)[:100]
