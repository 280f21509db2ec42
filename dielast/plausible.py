"""Inputs that are legal but foolish: a modulus in the wrong unit, a temperature on the wrong scale, a spectrum asked for what it
does not know. Each is warned of with what it looks like; none is an error, as somebody's material may be like that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import warn
from dielast.material import VACUUM_PERMITTIVITY, Material
from dielast.units import ZERO_CELSIUS

SOFTEST, HARDEST = 100.0, 1e8  # Pa, shear modulus of a rubber at rest: from gels to leather
GLASS = 1.5e10  # Pa, shear modulus that no polymer's glass exceeds
COLDEST, HOTTEST = -150.0, 300.0  # degC, where polymers are measured
KELVIN = 200.0  # degC, from which on readings look like kelvin
FAINTEST, STRONGEST = 1e6, 1e9  # V/m, breakdown fields of polymer films
LARGEST_PERMITTIVITY = 1e3  # relative
MARGIN = 5.0  # K beyond the measured temperatures that a shift law may be used without a word


def doubt_material(material: Material) -> None:
    """Warn of constants that look as if they were in another unit."""
    rest, glass = material.equilibrium_modulus, material.equilibrium_modulus + float(np.sum(material.spectrum.shear_modulus))
    if rest > 0 and not SOFTEST <= rest <= HARDEST:
        known = f"rubbers at rest have {SOFTEST:g} Pa to {HARDEST / 1e6:g} MPa"
        warn(f"the equilibrium shear modulus is {rest:g} Pa, but {known}: is it in another unit?")
    if glass > GLASS:
        warn(f"the shear moduli add up to {glass:g} Pa, more than any polymer's glass: are they in another unit?")
    if material.permittivity is not None:
        relative = material.permittivity / VACUUM_PERMITTIVITY
        if not 1 <= relative <= LARGEST_PERMITTIVITY:
            warn(f"the permittivity is {relative:.3g} times that of the vacuum: is it relative, or in another unit?")
    if material.breakdown is not None:
        doubt_breakdown(material.breakdown.field)


def doubt_breakdown(field: ArrayLike) -> None:
    """Warn of breakdown fields (V/m, any shape) that no film has."""
    values = np.atleast_1d(np.asarray(field, dtype=float))
    for value in values[(values < FAINTEST) | (values > STRONGEST)][:1]:
        warn(f"a breakdown field of {value:g} V/m: films break down at 1 to 1000 MV/m, so is it in another unit?")


def doubt_temperature(temperature: ArrayLike, what: str) -> None:
    """Warn of temperatures (degC, any shape) that look as if they were on another scale; `what` says whose they are."""
    values = np.atleast_1d(np.asarray(temperature, dtype=float))
    if not values.size:
        return
    coldest, hottest = float(values.min()), float(values.max())
    span = f"{coldest:g}" if coldest == hottest else f"{coldest:g} to {hottest:g}"
    if hottest < COLDEST:
        kelvin = f"{coldest + ZERO_CELSIUS:g}" + ("" if coldest == hottest else f" to {hottest + ZERO_CELSIUS:g}")
        warn(f"{what} {span} degC, which is {kelvin} K: are they degC that were taken for kelvin?")
    elif coldest > KELVIN:
        warn(f"{what} {span} degC: are they kelvin that were taken for degC?")
    elif coldest < COLDEST or hottest > HOTTEST:
        warn(f"{what} {span} degC, where polymers are hardly ever measured: is the scale right?")


def doubt_curve(largest: float) -> None:
    """Warn of a master curve whose `largest` Young's modulus (Pa) is no polymer's."""
    if largest > 3 * GLASS:
        warn(f"the largest Young's modulus is {largest:.3g} Pa, more than any polymer's glass: is it in another unit?")
    elif largest < 3 * SOFTEST:
        warn(f"the largest Young's modulus is {largest:.3g} Pa, less than that of a gel: is it in another unit?")


def doubt_strain(strain: ArrayLike) -> None:
    """Warn of strains (1, any shape) of a relaxation test that are no small ones, or that look like stretches."""
    values = np.atleast_1d(np.asarray(strain, dtype=float))
    typical = float(np.median(values)) if values.size else 0.0
    if 1 <= typical < 2:
        warn(
            f"the strain is {typical:.3g}, that is {100 * typical:.3g} %: is it a stretch, so that the strain is {typical - 1:.3g}?"
        )
    elif typical > 0.3:
        warn(f"a strain of {100 * typical:.3g} %: stress over strain is the relaxation modulus at small strain only")


def doubt_use(material: Material, temperature: float, lasting: float) -> None:
    """Warn where a simulation at `temperature` (degC), `lasting` some time (s), asks a material for what was not measured.

    The temperature is compared with those that the shift law was measured at, where they are known, and the time with the fastest
    branch: in less than that nothing relaxes but what the spectrum does not hold.
    """
    doubt_temperature(temperature, "the temperature is")
    if material.measured_temperature is not None:
        low, high = material.measured_temperature
        if not low - MARGIN <= temperature <= high + MARGIN:
            warn(f"the shift law was measured from {low:g} to {high:g} degC: at {temperature:g} degC it is extrapolated")
    fastest = float(material.relaxation_time(temperature)[..., -1])
    if 0 < lasting < fastest:
        warn(
            f"the load lasts {lasting:.3g} s, but the fastest branch takes {fastest:.3g} s at {temperature:g} degC: the spectrum "
            "does not tell what happens in so short a time"
        )
