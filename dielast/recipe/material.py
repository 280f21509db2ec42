"""The material file: read into a `Material`, and written from one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.gent import Gent
from dielast.material import Breakdown, Material
from dielast.prony import Spectrum
from dielast.recipe.base import BreakdownField, Dielectric
from dielast.recipe.fields import Modulus, MolarEnergy, Section, Temperature, TemperatureDifference
from dielast.recipe.validate import check, parse_toml
from dielast.shift import WLF, Arrhenius, NoShift, ShiftLaw, ShiftTable

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018
JLim = Annotated[float, Field(gt=0)]


class Equilibrium(Section):
    """The spring that never relaxes; without J_lim it is neo-Hookean."""

    shear_modulus: Modulus
    J_lim: JLim | None = None


class Nonequilibrium(Section):
    """The relaxation processes at the reference temperature."""

    J_lim: JLim | None = None
    relaxation_time_s: list[float] = Field(min_length=1)
    shear_modulus_Pa: list[float] = Field(min_length=1)

    @model_validator(mode="after")
    def _a_spectrum(self) -> Self:
        self.spectrum()
        return self

    def spectrum(self) -> Spectrum:
        """The branches as arrays."""
        return Spectrum(np.array(self.relaxation_time_s), np.array(self.shear_modulus_Pa))


class ShiftSection(Section):
    """The shift law and its constants."""

    law: Literal["wlf", "arrhenius", "table", "none"]
    C1: Annotated[float, Field(gt=0)] | None = None
    C2: TemperatureDifference | None = None
    activation_energy: MolarEnergy | None = None
    temperature_degC: list[float] | None = None
    log10_shift_factor: list[float] | None = None

    @model_validator(mode="after")
    def _constants(self) -> Self:
        needed = {
            "wlf": {"C1", "C2"},
            "arrhenius": {"activation_energy"},
            "table": {"temperature_degC", "log10_shift_factor"},
            "none": set[str](),
        }[self.law]
        stated = {name for name, value in self if name != "law" and value is not None}
        if needed - stated:
            raise InputError(f'law "{self.law}" needs {" and ".join(sorted(needed - stated))}')
        if stated - needed:
            raise InputError(f'law "{self.law}" does not take {" and ".join(sorted(stated - needed))}')
        self.at(0.0)
        return self

    def at(self, reference_temperature: float) -> ShiftLaw:
        """The law for relaxation times that hold at `reference_temperature` (degC)."""
        if self.C1 is not None and self.C2 is not None:
            return WLF(reference_temperature, self.C1, self.C2)
        if self.activation_energy is not None:
            return Arrhenius(reference_temperature, self.activation_energy)
        if self.temperature_degC is not None and self.log10_shift_factor is not None:
            return ShiftTable(reference_temperature, tuple(self.temperature_degC), tuple(self.log10_shift_factor))
        return NoShift(reference_temperature)


class MaterialFile(Section):
    """A dielectric elastomer: springs, relaxation processes, shift law, dielectric."""

    name: str = "unnamed"
    reference_temperature: Temperature
    equilibrium: Equilibrium
    nonequilibrium: Nonequilibrium
    shift: ShiftSection
    dielectric: Dielectric = Dielectric()
    breakdown: BreakdownField | None = None

    @model_validator(mode="after")
    def _carries(self) -> Self:
        if self.equilibrium.shear_modulus == 0 and not any(self.nonequilibrium.shear_modulus_Pa):
            raise InputError("every shear modulus is zero: the material carries no load")
        return self

    def material(self) -> Material:
        """The material that the file describes."""
        return Material(
            name=self.name,
            equilibrium_modulus=self.equilibrium.shear_modulus,
            spectrum=self.nonequilibrium.spectrum(),
            shift=self.shift.at(self.reference_temperature),
            equilibrium_law=Gent(self.equilibrium.J_lim or math.inf),
            nonequilibrium_law=Gent(self.nonequilibrium.J_lim or math.inf),
            permittivity=permittivity(self.dielectric),
            breakdown=breakdown(self.breakdown),
        )


def permittivity(dielectric: Dielectric) -> float | None:
    """Permittivity in F/m, if one is stated."""
    if dielectric.relative_permittivity is not None:
        return dielectric.relative_permittivity * VACUUM_PERMITTIVITY
    return dielectric.permittivity


def breakdown(section: BreakdownField | None) -> Breakdown | None:
    """The breakdown field over prestretch, if one is stated."""
    return None if section is None else Breakdown(tuple(section.prestretch or [1.0]), section.field)


def parse_material(content: bytes, source: str) -> Material:
    """The material in the bytes of a material file; raises `InputError` with a line for every mistake."""
    return check(MaterialFile, parse_toml(content, source), source, Path()).material()


def read_material(path: str | Path) -> Material:
    """The material in a material file; raises `InputError` with a line for every mistake."""
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {(error.strerror or 'cannot be read').lower()}") from None
    return parse_material(content, str(path))


def write_material(material: Material) -> bytes:
    """The material as a material file (TOML, UTF-8), numbers with 9 significant digits."""
    import tomli_w

    equilibrium: dict[str, Any] = {"shear_modulus": f"{material.equilibrium_modulus:.9g} Pa"}
    nonequilibrium: dict[str, Any] = {}
    for section, law in ((equilibrium, material.equilibrium_law), (nonequilibrium, material.nonequilibrium_law)):
        if not isinstance(law, Gent):
            raise InputError(f"a material file holds Gent springs only, not {type(law).__name__}")
        if math.isfinite(limit := float(law.J_lim)):
            section["J_lim"] = limit
    nonequilibrium["relaxation_time_s"] = _digits(material.spectrum.relaxation_time.tolist())
    nonequilibrium["shear_modulus_Pa"] = _digits(material.spectrum.shear_modulus.tolist())
    document: dict[str, Any] = {
        "name": material.name,
        "reference_temperature": f"{material.reference_temperature:.9g} degC",
        "equilibrium": equilibrium,
        "nonequilibrium": nonequilibrium,
        "shift": _shift_section(material.shift),
    }
    if material.permittivity is not None:
        document["dielectric"] = {"permittivity": f"{material.permittivity:.9g} F/m"}
    if material.breakdown is not None:
        fields = [f"{value:.9g} V/m" for value in material.breakdown.field]
        document["breakdown"] = {"prestretch": list(material.breakdown.prestretch), "field": fields}
    return tomli_w.dumps(document).encode()


def _shift_section(law: ShiftLaw) -> dict[str, Any]:
    match law:
        case WLF():
            return {"law": "wlf", "C1": _digits([law.C1])[0], "C2": f"{law.C2:.9g} K"}
        case Arrhenius():
            return {"law": "arrhenius", "activation_energy": f"{law.activation_energy:.9g} J/mol"}
        case ShiftTable():
            return {"law": "table", "temperature_degC": list(law.temperature), "log10_shift_factor": _digits(list(law.log10_shift))}
        case _:
            return {"law": "none"}


def _digits(values: list[float]) -> list[float]:
    return [float(f"{value:.9g}") for value in values]
