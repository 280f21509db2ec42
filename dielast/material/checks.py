"""Warnings of valid inputs that look like mistakes: a modulus in the wrong unit, a temperature on the wrong scale, a load faster
than
the spectrum covers.

A warning states the likely mistake. None of these inputs is an error: a real material may have such constants.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import warn
from dielast.material.breakdown import BreakdownLaw
from dielast.material.material import VACUUM_PERMITTIVITY, Material
from dielast.material.springs.stable_range import stable_range, tension_rises
from dielast.units import TIMES, ZERO_CELSIUS

SOFTEST, HARDEST = 100.0, 1e8  # Pa, shear modulus of a rubber at rest: from gels to leather
GLASS = 1.5e10  # Pa, shear modulus that no polymer's glass exceeds
RELAXING = 0.01  # of the equilibrium modulus: the relaxation of branches with a smaller sum of moduli cannot be measured
TAUT = 0.03  # distance to the limit of stretch, 1 at rest, below which chains are taut and break
COLDEST, HOTTEST = -150.0, 300.0  # degC, where polymers are measured
LOOKS_LIKE_KELVIN = 200.0  # degC; higher readings are most likely in kelvin
MARGIN = 5.0  # K by which a temperature may exceed the range of a shift law without a warning
FAINTEST, STRONGEST = 1e6, 1e9  # V/m, breakdown fields of polymer films
LARGEST_PERMITTIVITY = 1e3  # relative
UNFELT, BEYOND = (
    1 / 300,
    30.0,
)  # of the breakdown field, outside of which the Maxwell stress is 1e-5 or 1000 times that at breakdown
LEAKIEST = 30.0  # true field over E_c of a leakage law, at which the conductivity is 1e13 times sigma_0
THINNEST, THICKEST, THICKEST_SPECIMEN = 1e-6, 1e-2, 0.1  # m
_SHEAR = re.compile(r"^\|?g(?![a-z])|^g(p|pp|prime|stor|loss)\b|^j(?![a-z])|\bshear\b|scher|schub")  # names, in lower case
_STRAIN = re.compile(r"\bstrain|dehnung(?!sverh)|elongation|^[εϵ]")
UNSEEN = 1e-5  # strain below the resolution of an extensometer
SQUEEZED = 0.7  # a prescribed stretch below this is most likely a strain


def warn_of_material(material: Material) -> None:
    """Warn of constants that are most likely in another unit."""
    rest, branches = material.equilibrium_modulus, float(np.sum(material.spectrum.shear_modulus))
    if rest > 0 and not SOFTEST <= rest <= HARDEST:
        known = f"rubbers at rest have {SOFTEST:g} Pa to {HARDEST / 1e6:g} MPa"
        warn(f"the equilibrium shear modulus is {rest:g} Pa, but {known}: is it in another unit?")
    if rest + branches > GLASS:
        warn(f"the shear moduli add up to {rest + branches:g} Pa, more than any polymer's glass: are they in another unit?")
    if 0 < branches < RELAXING * rest:
        beside = f"beside an equilibrium modulus of {rest:g} Pa"
        warn(f"the branches add up to {branches:.3g} Pa {beside}, so that nothing relaxes: are they in another unit?")
    for law, whose in ((material.equilibrium_law, "equilibrium"), (material.nonequilibrium_law, "nonequilibrium")):
        if reason := law.warning(whose):
            warn(reason)
    warn_of_temperature(material.reference_temperature, "the reference temperature is")
    if reason := material.shift.warning():
        warn(reason)
    if material.dielectric is not None:
        relatives = np.atleast_1d(material.dielectric.typical(material.reference_temperature)) / VACUUM_PERMITTIVITY
        for relative in relatives[~((relatives >= 1) & (relatives <= LARGEST_PERMITTIVITY))][:1]:
            warn(f"the permittivity is {relative:.3g} times that of the vacuum: is it relative, or in another unit?")
    if material.breakdown is not None:
        warn_of_breakdown(material.breakdown.typical_fields())


def warn_of_breakdown(field: ArrayLike) -> None:
    """Warn of breakdown fields (V/m, any shape) outside of those of polymer films."""
    values = np.atleast_1d(np.asarray(field, dtype=float))
    for value in values[(values < FAINTEST) | (values > STRONGEST)][:1]:
        warn(f"a breakdown field of {value:g} V/m: films break down at 1 to 1000 MV/m, so is it in another unit?")


def warn_of_prestretches(prestretch: Sequence[tuple[float, float]], known: Sequence[BreakdownLaw | None]) -> None:
    """Warn of prestretches, one pair per film, outside of those for which breakdown fields are `known`."""
    films = [(pair, float(np.sqrt(pair[0] * pair[1])), law) for pair, law in zip(prestretch, known, strict=True)]
    outside = [(pair, value, law) for pair, value, law in films if law is not None and not law.is_known_at(value)]
    if not outside:
        return
    (first, second), value, law = outside[0]
    what = f"prestretch {first:g}" if first == second else f"prestretch {first:g} x {second:g} (as {value:.4g} equibiaxial)"
    others = len({pair for pair, _, _ in outside}) - 1
    warn(f"{what}{f' (and {others} more)' if others else ''}: {law.outside(value)}")


def warn_of_thickness(thickness: ArrayLike, whose: str = "film", thickest: float = THICKEST) -> None:
    """Warn of implausible thicknesses (m, any shape); `whose` names the object, whose plausible maximum is `thickest` (m)."""
    values = np.atleast_1d(np.asarray(thickness, dtype=float))
    for value in values[(values < THINNEST) | (values > thickest)][:1]:
        known = f"a {whose} has {THINNEST * 1e6:g} um to {thickest * 1e3:g} mm"
        warn(f"the thickness is {value * 1e3:g} mm, but {known}: is it in another unit?")


def warn_of_field(highest: ArrayLike, breakdown: ArrayLike, charged: ArrayLike = False) -> None:
    """Warn if the `highest` true fields (V/m) of films at their initial stretch are all far from their `breakdown` fields.

    The fields are due to a voltage, or to a charge where films are `charged`.
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
        warn(f"the highest {what} makes a field of {field[k]:.3g} V/m, {so}: is it, or the {other}, in another unit?")


def warn_of_leak(true_field: ArrayLike, scale: ArrayLike) -> None:
    """Warn of true fields (V/m) at a multiple of the `scale` E_c (V/m) of a leakage law at which it was never measured."""
    ratio = float(np.max(np.abs(np.asarray(true_field, dtype=float)) / np.asarray(scale, dtype=float), initial=0.0))
    if ratio > LEAKIEST:
        grown = f"the true field comes to {ratio:.3g} times the leak's, by which the conductivity grows e^{ratio:.3g} times"
        warn(f"{grown}: is leakage.field in another unit?")


def warn_of_temperature(temperature: ArrayLike, what: str) -> None:
    """Warn of temperatures (degC, any shape) that are most likely on another scale; `what` says what they belong to."""
    values = np.atleast_1d(np.asarray(temperature, dtype=float))
    if not values.size:
        return
    coldest, hottest = float(values.min()), float(values.max())
    span = f"{coldest:g}" if coldest == hottest else f"{coldest:g} to {hottest:g}"
    if hottest < COLDEST:
        kelvin = f"{coldest + ZERO_CELSIUS:g}" + ("" if coldest == hottest else f" to {hottest + ZERO_CELSIUS:g}")
        warn(f"{what} {span} degC, which is {kelvin} K: are they degC that were taken for kelvin?")
    elif coldest > LOOKS_LIKE_KELVIN:
        warn(f"{what} {span} degC: are they kelvin that were taken for degC?")
    elif coldest < COLDEST or hottest > HOTTEST:
        warn(f"{what} {span} degC, where polymers are hardly ever measured: is the scale right?")


BEYOND_TESTS = 0.05  # of the largest I1 - 3 of the tests, by which it may be exceeded without a warning
LONGER = 2.0  # ratio to the longest test that is allowed without a warning
UNTESTED = 0.1  # the same ratio for I1 - 3 in a mode without tests


def warn_of_curve(largest: float, plateau: float | None = None) -> None:
    """Warn of a master curve whose `largest` Young's modulus (Pa), or that of its `plateau`, is implausible for a polymer."""
    if largest > 3 * GLASS:
        warn(f"the largest Young's modulus is {largest:.3g} Pa, more than any polymer's glass: is it in another unit?")
    elif largest < 3 * SOFTEST:
        warn(f"the largest Young's modulus is {largest:.3g} Pa, less than that of a gel: is it in another unit?")
    elif plateau is not None and plateau < 3 * SOFTEST:
        warn(f"Young's modulus levels off at {plateau:.3g} Pa, less than that of a gel: is it in another unit, such as kPa?")


def warn_of_tension(names: Sequence[str], source: str) -> None:
    """Warn of moduli, compliances, strains or stresses that are used as tensile ones, in columns whose `names` suggest shear."""
    for name in [name for name in names if _SHEAR.search(name.strip().casefold().replace("_", " "))][:1]:
        warn(
            f'column "{name}" looks like one of shear, but is read as one of tension, which is a factor of three: say '
            'test = "shear", or test = "tension"',
            file=source,
        )


def warn_of_strain(strain: ArrayLike) -> None:
    """Warn of strains (1, any shape) of a relaxation test that are not small, or look like stretches or per cent."""
    values = np.atleast_1d(np.asarray(strain, dtype=float))
    typical = float(np.median(values)) if values.size else 0.0
    if typical <= 0.3:
        return
    stated, per_cent = f"the strain is {typical:.3g}, that is {100 * typical:.3g} %", "in per cent, which its unit must say"
    if 1 < typical < 2:
        warn(f"{stated}: is it a stretch, so that the strain is {typical - 1:.3g}, or {per_cent}?")
    elif typical >= 1:
        warn(f"{stated}: is it {per_cent}?")
    else:
        warn(f"{stated}: stress over strain is the relaxation modulus at small strain only; or is it {per_cent}?")


def warn_of_measured_stretch(name: str, stretch: ArrayLike, source: str) -> None:
    """Warn of measured stretches (1, any shape) in a column whose `name` suggests strain, or with impossible values."""
    values = np.atleast_1d(np.asarray(stretch, dtype=float))
    typical = float(np.median(values))
    if _STRAIN.search(name.casefold()) or not 0.5 <= typical <= 20:
        warn(
            f'column "{name}" is about {typical:.3g} and compared with a stretch, which is 1 + strain: is it a strain?', file=source
        )


def warn_of_stretch(lowest: float, highest: float) -> None:
    """Warn of prescribed stretches, from `lowest` to `highest`, that look like strains."""
    if lowest < SQUEEZED:
        warn(f"a stretch of {lowest:g} squeezes the film (1 is undeformed): is it a strain, so that the stretch is {1 + lowest:g}?")
    elif lowest == highest == 1:
        warn("the stretch is 1 throughout, which is undeformed: is it a strain of 100 %, so that the stretch is 2?")


def warn_of_elongation(stretch_1: ArrayLike, stretch_2: ArrayLike, room: ArrayLike) -> None:
    """Warn of films whose stretches (points,) under load are those of taut chains, or too small to be measured.

    `room` (points,) is the distance to the limit of the equilibrium spring: 1 at rest, 0 at the limit.
    """
    first, second, left = (np.asarray(values, dtype=float) for values in (stretch_1, stretch_2, room))
    if not left.size:
        return
    k = int(np.argmin(left))
    if left[k] < TAUT:
        warn(f"the load stretches the film to {first[k]:.3g}, where its chains are taut and break: is it in another unit?")
    elif max(float(np.max(np.abs(axis - 1))) for axis in (first, second)) < UNSEEN:
        warn(f"the load strains the film by less than {UNSEEN:g}: is it, or the section, in another unit?")


def warn_of_falling_tension(material: Material, stretch: ArrayLike, mode: str | None) -> None:
    """Warn of stretches (2, points) at which the tension of the equilibrium spring decreases, in a `mode`, None for any mode."""
    law, values = material.equilibrium_law, np.asarray(stretch, dtype=float)
    if law.always_stable or material.equilibrium_modulus == 0 or not values.size:
        return
    falls = ~tension_rises(law, np.square(values), mode) & np.all(np.isfinite(values), axis=0)
    if not falls.any():
        return
    first, second = values[:, int(np.argmax(falls))].tolist()
    if mode is None:
        where, known = f"stretches of {first:.4g} x {second:.4g}", ""
    else:
        low, high = stable_range(law, mode)
        ends = [f"above {low:.4g}"] * (low > 0) + [f"below {high:.4g}"] * (high < np.inf)
        where, known = f"a stretch of {first:.4g}", f"; in {mode} loading it rises {' and '.join(ends)} only"
    warn(
        f"at {where} the {law.title} law of the equilibrium spring is unstable, its tension falls with the stretch{known}: were "
        "its constants fitted so far?"
    )


def warn_of_range(material: Material, stretch: ArrayLike, mode: str | None) -> None:
    """Warn of stretches (2, points) in a `mode`, None for any mode, beyond the tests of a calibrated material."""
    known, values = material.calibrated, np.asarray(stretch, dtype=float)
    if known is None or not values.size:
        return
    first, second = values
    invariant = first**2 + second**2 + (first * second) ** -2.0
    largest = float(np.max(invariant[np.isfinite(invariant)], initial=3.0))
    tested = f"{' and '.join(known.modes)} tests up to I1 = {known.largest_invariant:.4g}"
    if largest > known.largest_invariant * (1 + BEYOND_TESTS):
        warn(f"the stretches go to I1 = {largest:.4g}, but the material was calibrated by {tested}: it is extrapolated")
    elif mode not in known.modes and largest > 3 + UNTESTED * (known.largest_invariant - 3):
        other = "unequal stretches" if mode is None else f"{mode} loading"
        warn(f"the material was calibrated by {tested} alone: {other} asks more of its law than these tests tell")


def warn_of_use(material: Material, temperature: ArrayLike) -> None:
    """Warn of temperatures (degC, any shape) that look wrong, or that are outside of the range of the shift law."""
    warn_of_temperature(temperature, "the temperature is")
    values = np.atleast_1d(np.asarray(temperature, dtype=float))
    if material.calibrated is not None:
        low, high = material.calibrated.temperature
        outside = values[(values < low - MARGIN) | (values > high + MARGIN)]
        if outside.size:
            worst, span = float(outside[0]), f"at {low:g}" if low == high else f"from {low:g} to {high:g}"
            warn(f"the material was calibrated by tests {span} degC: at {worst:g} degC it is extrapolated")
    away = values[np.abs(values - material.reference_temperature) > MARGIN]
    if away.size and len(material.spectrum) and not material.shift.depends_on_temperature:
        as_at = f"at {float(away[0]):g} degC it relaxes as at {material.reference_temperature:g} degC"
        warn(f"the material has no shift law, {as_at}: state [shift] in the material file")
    if material.measured_temperature is not None:
        low, high = material.measured_temperature
        outside = values[(values < low - MARGIN) | (values > high + MARGIN)]
        if outside.size:
            worst = float(outside[np.argmax(np.maximum(low - outside, outside - high))])
            warn(f"the shift law was measured from {low:g} to {high:g} degC: at {worst:g} degC it is extrapolated")


def warn_of_lasting(material: Material, temperature: ArrayLike, time: ArrayLike) -> None:
    """Warn of times in s at temperatures in degC, both (k,), that are longer than the tests of a calibrated material.

    They are compared as reduced times, for the hottest of the tests, by the shift law.
    """
    known = material.calibrated
    values, heat = np.atleast_1d(np.asarray(time, dtype=float)), np.atleast_1d(np.asarray(temperature, dtype=float))
    if known is None or not values.size:
        return
    tested = known.time[1] / 10 ** float(material.shift.log10_shift_factor(np.array(known.temperature[1])))
    longest = tested * 10 ** np.asarray(material.shift.log10_shift_factor(heat))
    k = int(np.argmax(values / longest))
    if values[k] > LONGER * longest[k]:
        lasting = f"{values[k]:.3g} s at {heat[k]:g} degC are longer than the tests that the material was calibrated by"
        warn(f"{lasting}, which tell of {longest[k]:.3g} s there: slower branches are not known")


@dataclass(frozen=True, slots=True)
class Pace:
    """An action on a film that lasts `lasting` s, and the relaxation time `fastest` s of its fastest branch at `temperature` degC;
    `what` is the beginning of a sentence, such as "step[0] takes".
    """

    what: str
    lasting: float
    fastest: float
    temperature: float


def fastest_branch(material: Material, temperature: float) -> float:
    """The shortest relaxation time in s of the branches with a modulus above 0; 0 if there is none."""
    carrying = material.relaxation_time(temperature)[material.spectrum.shear_modulus > 0]
    return float(carrying[-1]) if carrying.size else 0.0


def warn_of_paces(paces: Iterable[Pace]) -> None:
    """Warn of the fastest of the actions that are faster than the fastest branch.

    Faster processes, which a truncated or incomplete spectrum lacks, would resist such an action; without them the film is too
    soft.
    """
    hasty = [pace for pace in paces if pace.lasting < pace.fastest]
    if hasty:
        worst = min(hasty, key=lambda pace: pace.lasting / pace.fastest)
        took = f"{worst.fastest:.3g} s" if worst.fastest <= TIMES[1] else f"more than {TIMES[1]:g} s"
        warn(
            f"{worst.what} {worst.lasting:.3g} s, but the fastest branch takes {took} at {worst.temperature:g} degC: the spectrum "
            "does not hold what is faster, without which the film is too soft in so short a time"
        )
