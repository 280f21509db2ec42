"""The numbers of a material by section and key of its file, and a material with other numbers.

Calibration and tables of draws change a material by these functions, without knowledge of its laws.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from dielast.material.law import Law
from dielast.material.material import Material
from dielast.material.spectrum import Spectrum
from dielast.units import STRESS, TIME, Dimension, parse

Numbers = dict[str, dict[str, Any]]
"""Values in SI, each a number or a list of numbers, by section and key."""

LISTS = {"shear_modulus": STRESS, "relaxation_time": TIME}
"""Keys of the numbers of branches, with their dimensions."""
SCALE = "scale"
"""The key of a common factor on the moduli of all branches."""


@dataclass(frozen=True, slots=True)
class Kind:
    """The kind of a number: its `dimension` (None: a bare number), and whether it can only be positive."""

    dimension: Dimension | None
    positive: bool

    @property
    def unit(self) -> str:
        """The unit of its values; "1" for a bare number."""
        return "1" if self.dimension is None else self.dimension.unit


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


def kinds_of(material: Material) -> dict[str, dict[str, Kind]]:
    """The kinds of the numbers, by section and key."""
    kinds_by_section: dict[str, dict[str, Kind]] = {
        "equilibrium": {"shear_modulus": Kind(STRESS, True)} if material.equilibrium_law.takes_modulus else {},
        "nonequilibrium": {**{key: Kind(dimension, True) for key, dimension in LISTS.items()}, SCALE: Kind(None, True)},
    }
    springs: dict[str, Law] = {"equilibrium": material.equilibrium_law, "nonequilibrium": material.nonequilibrium_law}
    for section, law in (springs | _laws(material)).items():
        kinds = kinds_by_section.setdefault(section, {})
        for constant in law.constants:
            positive = any(bound is not None and bound >= 0 for bound in (constant.above, constant.at_least))
            kinds.setdefault(constant.file_key, Kind(constant.dimension, positive))
    return kinds_by_section


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
