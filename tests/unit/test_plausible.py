"""Legal but foolish inputs are warned of with what they look like, sound ones never."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dielast.errors import DielastWarning
from dielast.material import VACUUM_PERMITTIVITY, Breakdown, Material
from dielast.plausible import doubt_breakdown, doubt_curve, doubt_material, doubt_strain, doubt_temperature, doubt_use
from dielast.prony import Spectrum
from dielast.shift import WLF

VHB = Material(
    "VHB",
    26e3,
    Spectrum(np.geomspace(1e-7, 1e5, 13), np.geomspace(1e8, 1e3, 13)),
    WLF(20.0, 13.7, 187.1),
    permittivity=4.5 * VACUUM_PERMITTIVITY,
    breakdown=Breakdown((1.7, 1.9), (4e7, 4.8e7)),
    measured_temperature=(-40.0, 60.0),
)


def scaled(factor: float) -> Material:
    spectrum = Spectrum(VHB.spectrum.relaxation_time, factor * VHB.spectrum.shear_modulus)
    return replace(VHB, equilibrium_modulus=factor * VHB.equilibrium_modulus, spectrum=spectrum)


def test_sound_inputs_are_not_doubted() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        doubt_material(VHB)
        doubt_material(replace(VHB, equilibrium_modulus=0.0))  # a melt
        doubt_curve(2e9)
        doubt_temperature([-40.0, 60.0], "tests at")
        doubt_temperature([130.0, 190.0], "tests at")  # polystyrene
        doubt_strain([0.01, 0.05])
        doubt_use(VHB, 60.0, 1.0)
        doubt_use(replace(VHB, measured_temperature=None), 90.0, 1.0)


@pytest.mark.parametrize(
    ("doubt", "said"),
    [
        (lambda: doubt_material(scaled(1e-3)), "equilibrium shear modulus is 26 Pa"),
        (lambda: doubt_material(replace(VHB, equilibrium_modulus=2e8)), "equilibrium shear modulus is 2e"),
        (lambda: doubt_material(scaled(1e3)), "more than any polymer's glass"),
        (lambda: doubt_material(replace(VHB, permittivity=4.5)), "times that of the vacuum"),
        (lambda: doubt_material(replace(VHB, breakdown=Breakdown((1.0,), (40e3,)))), "breakdown field of 40000 V/m"),
        (lambda: doubt_breakdown([40e6, 40e12]), "breakdown field of 4e"),
        (lambda: doubt_curve(2e11), "largest Young's modulus is 2e"),
        (lambda: doubt_curve(100.0), "less than that of a gel"),
        (lambda: doubt_temperature(np.array([-40.0, 60.0]) - 273.15, "tests at"), "taken for kelvin"),
        (lambda: doubt_temperature(np.array([-40.0, 60.0]) + 273.15, "tests at"), "kelvin that were taken for degC"),
        (lambda: doubt_temperature([-190.0, 20.0], "tests at"), "is the scale right"),
        (lambda: doubt_strain([1.05, 1.05]), r"is it a stretch, so that the strain is 0.05\?"),
        (lambda: doubt_strain([0.5]), "at small strain only"),
        (lambda: doubt_strain([5.0]), "a strain of 500 %"),
        (lambda: doubt_use(VHB, 80.0, 1.0), "measured from -40 to 60 degC: at 80 degC it is extrapolated"),
        (lambda: doubt_use(VHB, -60.0, 1e6), "extrapolated"),
        (lambda: doubt_use(VHB, 20.0, 1e-9), "the load lasts 1e-09 s, but the fastest branch takes 1e-07 s"),
    ],
)
def test_what_is_foolish_is_said(doubt: Callable[[], None], said: str) -> None:
    with pytest.warns(DielastWarning, match=said):
        doubt()


def test_moduli_that_would_dissipate_negatively_are_refused() -> None:
    with pytest.raises(ValueError, match="not negative"):
        Spectrum(np.array([1.0, 10.0]), np.array([1e3, -1.0]))
