"""The numbers of a material by section and key of its file, and a material with other numbers.

Calibration and tables of draws change a material by these functions, without knowledge of its laws.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dielast.material.law import Constant, Law
from dielast.material.material import Material
from dielast.material.spectrum import Spectrum
from dielast.units import STRESS, TIME, parse

Numbers = dict[str, dict[str, Any]]
"""Values in SI, each a number or a list of numbers, by section and key."""

SCALE = "scale"
"""The key of a common factor on the moduli of all branches."""
MODULUS = Constant("shear_modulus", "Initial shear modulus.", STRESS, above=0.0)
OF_BRANCHES = (
    Constant("shear_modulus", "Shear moduli of all branches.", STRESS, above=0.0, many=True),
    Constant("relaxation_time", "Relaxation times of all branches.", TIME, above=0.0, many=True),
    Constant(SCALE, "Common factor on the moduli of all branches.", above=0.0),
)


def numbers_of(material: Material) -> Numbers:
    """All numbers of a material that may be varied, by section and key of its file."""
    modulus, spring = material.equilibrium_modulus, material.equilibrium_law
    numbers: Numbers = {
        "equilibrium": {**({"shear_modulus": modulus} if spring.takes_modulus else {}), **_read(spring, spring.in_file(modulus))},
        "nonequilibrium": {
            "shear_modulus": material.spectrum.shear_modulus.tolist(),
            "relaxation_time": material.spectrum.relaxation_time.tolist(),
            SCALE: 1.0,
            **_read(material.nonequilibrium_law, material.nonequilibrium_law.stated()),
        },
    }
    for section, law in _laws(material).items():
        numbers[section] = _read(law, law.stated())
    return numbers


def constants_of(material: Material) -> dict[str, dict[str, Constant]]:
    """The constants that the numbers are values of, by section and key."""
    spring = material.equilibrium_law
    constants = {
        "equilibrium": (*([MODULUS] if spring.takes_modulus else []), *spring.constants),
        "nonequilibrium": (*OF_BRANCHES, *material.nonequilibrium_law.constants),
        **{section: law.constants for section, law in _laws(material).items()},
    }
    return {section: {constant.file_key: constant for constant in group} for section, group in constants.items()}


def material_of(material: Material, numbers: Mapping[str, Mapping[str, Any]]) -> Material:
    """The material with other numbers; raises `InputError` for numbers that its laws do not allow."""
    equilibrium, branches = dict(numbers["equilibrium"]), dict(numbers["nonequilibrium"])
    modulus = equilibrium.pop("shear_modulus", None)
    spring = type(material.equilibrium_law).of_file(equilibrium, modulus)
    moduli, times, factor = (branches.pop(key) for key in ("shear_modulus", "relaxation_time", SCALE))
    changed: dict[str, Any] = {
        "equilibrium_modulus": spring.initial_modulus() if modulus is None else modulus,
        "equilibrium_law": spring,
        "spectrum": Spectrum(times, [factor * value for value in moduli]),  # type: ignore[arg-type]
        "nonequilibrium_law": type(material.nonequilibrium_law).of_file(branches, None),
    }
    for section, law in _laws(material).items():
        place = (material.reference_temperature,) if section == "shift" else ()
        made = type(law)(*place, **law.arguments(numbers[section]))
        changed["permittivity" if section == "dielectric" else section] = made
    return replace(material, **changed)


def _laws(material: Material) -> dict[str, Law]:
    """The laws of a material other than the springs, by section."""
    known = {"shift": material.shift, "dielectric": material.dielectric, "breakdown": material.breakdown, "damage": material.damage}
    return {section: law for section, law in known.items() if law is not None}


def _read(law: Law, stated: Mapping[str, Any]) -> dict[str, Any]:
    """The constants of a law as numbers in SI, None for one left out without a value."""
    values_by_key: dict[str, Any] = {}
    for constant in law.constants:
        value = stated.get(constant.file_key, constant.left_out)
        if value is None:
            continue
        texts = value if isinstance(value, list | tuple) else [value]
        numbers = [parse(text, constant.dimension) if isinstance(text, str) and constant.dimension else text for text in texts]
        values_by_key[constant.file_key] = numbers if isinstance(value, list | tuple) else numbers[0]
    return values_by_key
