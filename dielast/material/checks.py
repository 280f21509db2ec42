"""Warnings of legal constants that look like mistakes: a modulus in the wrong unit, a temperature on the wrong scale.

A warning states the likely mistake. None of these inputs is an error: a real material may have such constants.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import and_more, warn
from dielast.base.units import ZERO_CELSIUS
from dielast.material.breakdown import BreakdownLaw
from dielast.material.material import VACUUM_PERMITTIVITY, Material

SOFTEST = 100.0  # Pa, shear modulus of a gel
GLASS = 1.5e10  # Pa, shear modulus that no polymer's glass exceeds
RELAXING = 0.01  # of the equilibrium modulus: branches with a smaller sum do not show
TAUT = 0.03  # distance to the limit of stretch, 1 at rest: with less, chains are taut and break
COLDEST, HOTTEST = -150.0, 300.0  # degC, where polymers are measured
LOOKS_LIKE_KELVIN = 200.0  # degC: higher readings are most likely in kelvin
FAINTEST, STRONGEST = 1e6, 1e9  # V/m, breakdown fields of polymer films
UNFELT, BEYOND = 1 / 300, 30.0  # of the breakdown field: the electrostatic stress is 1e-5 and 1000 times that at breakdown
LEAKIEST = 30.0  # fields E_c of leakage: the conductivity grows by a factor 1e13
_SHEAR = re.compile(r"^\|?g(?![a-z])|^g(p|pp|prime|stor|loss)\b|^j(?![a-z])|\bshear\b|scher|schub")  # names, in lower case
_STRAIN = re.compile(r"\bstrain|dehnung(?!sverh)|elongation|^[εϵ]")
UNSEEN = 1e-5  # strain that no extensometer resolves
SQUEEZED = 0.7  # stretch: a smaller value is probably a strain


@dataclass(frozen=True, slots=True)
class Usual:
    """The usual range of a quantity, in SI: `text` says what is usual of a `value`, which is in units of 1/`factor`, and `below`
    what is of values below the range, if that is another text. `mistaken` are other values that may have been meant: a factor on
    the value, and its unit.
    """

    low: float
    high: float
    text: str
    factor: float = 1.0
    mistaken: Sequence[tuple[float, str]] = ()
    below: str = ""

    def warn(self, values: ArrayLike) -> bool:
        """Warn of the first of the values (any shape) outside of the range, and say whether there is one."""
        flat = np.ravel(np.asarray(values, dtype=float))
        for value in flat[(flat < self.low) | (flat > self.high)][:1].tolist():
            meant = [
                f"{value * factor * self.factor:g} {unit}".rstrip() for factor, unit in self.mistaken if self._holds(value * factor)
            ]
            text = self.below if self.below and value < self.low else self.text
            warn(text.format(value=value * self.factor) + (f", such as {' or '.join(meant)}?" if meant else "?"))
            return True
        return False

    def _holds(self, value: float) -> bool:
        return self.low <= value <= self.high


USUAL = {
    "sum of moduli": Usual(
        0.0, GLASS, "the shear moduli add up to {value:g} Pa, more than any polymer's glass: are they in another unit"
    ),
    "equilibrium modulus": Usual(
        SOFTEST,
        1e7,
        "the equilibrium shear modulus is {value:g} Pa, but rubbers at rest have 100 Pa to 10 MPa: is it in another unit",
        mistaken=((1e-3, "Pa"), (1e3, "Pa"), (1e6, "Pa")),
    ),
    "permittivity": Usual(
        1.0,
        100.0,
        "the permittivity is {value:.3g} times that of the vacuum, but elastomers have 2 to 20 times: is it relative, or in "
        "another unit",
        mistaken=((1e-2, ""), (1e-3, ""), (VACUUM_PERMITTIVITY, "")),
    ),
    "breakdown field": Usual(
        FAINTEST, STRONGEST, "a breakdown field of {value:g} V/m: films break down at 1 to 1000 MV/m, so is it in another unit"
    ),
    "leakage": Usual(  # a true field over that of the law, where it was measured
        0.0,
        LEAKIEST,
        "the true field reaches {value:.3g} times leakage.field, so that the conductivity grows by a factor e^{value:.3g}: is "
        "leakage.field in another unit",
    ),
    "largest modulus": Usual(
        3 * SOFTEST,
        3 * GLASS,
        "the largest Young's modulus is {value:.3g} Pa, more than any polymer's glass: is it in another unit",
        below="the largest Young's modulus is {value:.3g} Pa, less than that of a gel: is it in another unit",
    ),
    "plateau": Usual(
        3 * SOFTEST,
        np.inf,
        "Young's modulus levels off at {value:.3g} Pa, less than that of a gel: is it in another unit, such as kPa",
    ),
    "film": Usual(1e-6, 1e-2, "the thickness is {value:g} mm, but a film has 1 um to 10 mm: is it in another unit", 1e3),
    "gauge length": Usual(
        1e-4, 2.0, "the gauge length is {value:g} mm, but a specimen has 0.1 mm to 2 m: is it in another unit", 1e3
    ),
    "width": Usual(1e-5, 2.0, "the width is {value:g} mm, but a specimen has 0.01 mm to 2 m: is it in another unit", 1e3),
    "field of tests": Usual(
        FAINTEST,
        np.inf,
        "the specimens are tested at fields of up to {value:.3g} V/m, but films fail at 1 to 1000 MV/m: is the voltage, or the "
        "thickness, in another unit",
    ),
    "specimen": Usual(1e-6, 0.1, "the thickness is {value:g} mm, but a specimen has 1 um to 100 mm: is it in another unit", 1e3),
}
"""The usual ranges by quantity. A value outside is no error: a real material may have it."""


def warn_of_material(material: Material) -> None:
    """Warn of constants that are most likely in another unit."""
    rest, branches = material.equilibrium_modulus, float(np.sum(material.spectrum.shear_modulus))
    if not USUAL["sum of moduli"].warn(rest + branches):
        USUAL["equilibrium modulus"].warn([rest] if rest > 0 else [])
    if 0 < branches < RELAXING * rest:
        beside = f"beside an equilibrium modulus of {rest:g} Pa"
        why = "is the material elastic, or are they in another unit?"
        warn(f"the branches add up to {branches:.3g} Pa {beside}, so that relaxation does not show: {why}")
    springs = material.equilibrium_law.warning("equilibrium"), material.nonequilibrium_law.warning("nonequilibrium")
    for reason in filter(None, (*springs, material.shift.warning())):
        warn(reason)
    warn_of_temperature(material.reference_temperature, "the reference temperature is")
    if material.dielectric is not None:
        relatives = material.dielectric.typical(material.reference_temperature) / VACUUM_PERMITTIVITY
        USUAL["permittivity"].warn(relatives)
    if material.breakdown is not None:
        USUAL["breakdown field"].warn(material.breakdown.typical_fields())


def warn_of_prestretches(prestretch: Sequence[tuple[float, float]], laws: Sequence[BreakdownLaw | None]) -> None:
    """Warn of prestretches, a pair for each film, outside the range of the breakdown law."""
    films = [(pair, float(np.sqrt(pair[0] * pair[1])), law) for pair, law in zip(prestretch, laws, strict=True) if law is not None]
    outside = [(pair, value, text) for pair, value, law in films if (text := law.outside(value))]
    if not outside:
        return
    (first, second), value, text = outside[0]
    what = f"prestretch {first:g}" if first == second else f"prestretch {first:g} x {second:g} (as {value:.4g} equibiaxial)"
    warn(f"{what}{and_more(len({pair for pair, _, _ in outside}) - 1)}: {text}")


def warn_of_field(highest: ArrayLike, breakdown: ArrayLike, charged: ArrayLike = False) -> None:
    """Warn if the `highest` true fields (V/m) of films before they deform are all far from their `breakdown` fields; the fields are
    those of a charge for films that are `charged`, else of a voltage.
    """
    field, limit = np.broadcast_arrays(np.abs(np.asarray(highest, dtype=float)), np.asarray(breakdown, dtype=float))
    if not np.any(field):
        return
    k = np.unravel_index(np.argmax(field / limit), field.shape)
    ratio = float(field[k] / limit[k])
    if not UNFELT <= ratio <= BEYOND:
        so = (
            f"{ratio:.3g} times the breakdown field"
            if ratio > 1
            else f"1/{1 / ratio:.0f} of the breakdown field: no film moves then"
        )
        what, other = ("charge", "electrode") if np.broadcast_to(charged, field.shape)[k] else ("voltage", "thickness")
        warn(f"the highest {what} makes a field of {field[k]:.3g} V/m, {so}: is the {what}, or the {other}, in a wrong unit?")


def warn_of_temperature(temperature: ArrayLike, what: str) -> None:
    """Warn of temperatures (degC, any shape) that look as if they were on another scale; `what` begins the message."""
    if odd := odd_temperature(temperature):
        warn(f"{what} {odd}")


def odd_temperature(temperature: ArrayLike) -> str:
    """The range of temperatures (degC, any shape) and what is odd about it, if they look as if they were on another scale; else
    empty.
    """
    values = np.ravel(np.asarray(temperature, dtype=float))
    if not values.size:
        return ""
    coldest, hottest = float(values.min()), float(values.max())
    span = f"{coldest:g}" if coldest == hottest else f"{coldest:g} to {hottest:g}"
    if hottest < COLDEST:
        kelvin = f"{coldest + ZERO_CELSIUS:g}" + ("" if coldest == hottest else f" to {hottest + ZERO_CELSIUS:g}")
        return f"{span} degC, which is {kelvin} K: was the value in degC, but stated as kelvin?"
    if coldest > LOOKS_LIKE_KELVIN:
        return f"{span} degC: was the value in kelvin, but stated as degC?"
    if coldest < COLDEST or hottest > HOTTEST:
        return f"{span} degC, outside the usual range of polymers: is the scale right?"
    return ""


def warn_of_tension(names: Sequence[str], source: str) -> None:
    """Warn of moduli, compliances, strains or stresses that are read as those of tension, in columns whose `names` say shear."""
    for name in [name for name in names if _SHEAR.search(name.strip().casefold().replace("_", " "))][:1]:
        warn(
            f'column "{name}" looks like a quantity in shear, but is read as in tension, which differs by a factor of three: state '
            'test = "shear" or test = "tension"',
            file=source,
        )


def warn_of_strain(strain: ArrayLike) -> None:
    """Warn of strains (1, any shape) of a relaxation test that are not small, or that look like stretches or per cent."""
    values = np.atleast_1d(np.asarray(strain, dtype=float))
    typical = float(np.median(values)) if values.size else 0.0
    if typical <= 0.3:
        return
    stated, per_cent = f"the strain is {typical:.3g}, that is {100 * typical:.3g} %", "in per cent, which its unit must state"
    if 1 < typical < 2:
        warn(f"{stated}: is it a stretch, so that the strain is {typical - 1:.3g}, or {per_cent}?")
    elif typical >= 1:
        warn(f"{stated}: is it {per_cent}?")
    else:
        warn(f"{stated}: stress over strain is the relaxation modulus at small strain only; or is it {per_cent}?")


def warn_of_measured_stretch(name: str, stretch: ArrayLike, source: str) -> None:
    """Warn of measured stretches (1, any shape) in a column whose `name` says strain, or with values of a strain."""
    values = np.atleast_1d(np.asarray(stretch, dtype=float))
    typical = float(np.median(values))
    if _STRAIN.search(name.casefold()) or not 0.5 <= typical <= 20:
        warn(
            f'column "{name}" is about {typical:.3g} and compared with a stretch, which is 1 + strain: is it a strain?', file=source
        )


def warn_of_stretch(lowest: float, highest: float) -> None:
    """Warn of prescribed stretches, from `lowest` to `highest`, that look like strains."""
    if lowest < SQUEEZED:
        warn(
            f"a stretch of {lowest:g} compresses the film (1 is undeformed): is it a strain, so that the stretch is {1 + lowest:g}?"
        )
    elif lowest == highest == 1:
        warn("the stretch is 1 throughout, which is undeformed: is it a strain of 100 %, so that the stretch is 2?")


def warn_of_elongation(stretch_1: ArrayLike, stretch_2: ArrayLike, margin: ArrayLike) -> None:
    """Warn of films whose stretches (points,) under load are those of taut chains, or too small to be measured.

    `margin` (points,) is the distance to the limit of the equilibrium spring: 1 at rest, 0 at the limit.
    """
    first, second, left = (np.asarray(values, dtype=float) for values in (stretch_1, stretch_2, margin))
    if not left.size:
        return
    k = int(np.argmin(left))
    if left[k] < TAUT:
        warn(f"the load stretches the film to {first[k]:.3g}, where its chains are taut and break: is it in another unit?")
    elif max(float(np.max(np.abs(axis - 1))) for axis in (first, second)) < UNSEEN:
        warn(f"the load strains the film by less than {UNSEEN:g}: is it, or the section, in another unit?")
