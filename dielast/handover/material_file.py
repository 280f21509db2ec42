"""The material file: read into a `Material`, and written from one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.io.files import read_file, resolve
from dielast.material.material import VACUUM_PERMITTIVITY, Breakdown, Material
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftLaw, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.recipe.base import BreakdownField, Dielectric
from dielast.recipe.fields import Modulus, MolarEnergy, Section, Temperature, TemperatureDifference
from dielast.recipe.toml import parse_toml
from dielast.recipe.validate import check

NO_TABLE = "a material file is needed, which spectrum writes: material.toml"
JLim = Annotated[float, Field(ge=1e-6)]


class Equilibrium(Section):
    """The spring that never relaxes; without J_lim it is neo-Hookean."""

    shear_modulus: Modulus = Field(description="Of the spring that never relaxes.")
    J_lim: JLim | None = Field(None, description="Limit of stretch of the Gent spring; left out: neo-Hookean.")


class Nonequilibrium(Section):
    """The relaxation processes at the reference temperature."""

    J_lim: JLim | None = Field(None, description="Limit of stretch of the Gent springs; left out: neo-Hookean.")
    relaxation_time_s: list[Annotated[float, Field(gt=0, allow_inf_nan=False)]] = Field(
        description="Of each branch, in s, at the reference temperature; none: purely elastic."
    )
    shear_modulus_Pa: list[Annotated[float, Field(ge=0, allow_inf_nan=False)]] = Field(description="Of each branch, in Pa.")

    @model_validator(mode="after")
    def _a_spectrum(self) -> Self:
        self.spectrum()
        return self

    def spectrum(self) -> Spectrum:
        """The branches as arrays."""
        return Spectrum(np.array(self.relaxation_time_s), np.array(self.shear_modulus_Pa))


class ShiftSection(Section):
    """The shift law and its constants."""

    law: Literal["wlf", "arrhenius", "table", "none"] = Field(description="How relaxation times change with temperature.")
    C1: Annotated[float, Field(gt=0)] | None = Field(None, description="Of WLF.")
    C2: TemperatureDifference | None = Field(None, description="Of WLF.")
    activation_energy: MolarEnergy | None = Field(None, description="Of Arrhenius.")
    temperature_degC: list[float] | None = Field(None, description="Of a table, in degC.")
    log10_shift_factor: list[float] | None = Field(
        None, description="Of a table: of relaxation times, positive where it is colder."
    )

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

    name: str = Field("unnamed", description="Of the material, for legends.")
    reference_temperature: Temperature = Field(description="Where the relaxation times hold.")
    equilibrium: Equilibrium = Field(description="The spring that never relaxes.")
    nonequilibrium: Nonequilibrium = Field(description="The relaxation processes.")
    shift: ShiftSection = Field(description="The shift law and its constants.")
    measured_temperature: Annotated[list[Temperature], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Lowest and highest that the shift law was measured at; simulations outside are warned of."
    )
    dielectric: Dielectric = Field(Dielectric(), description="Needed for voltages.")
    breakdown: BreakdownField | None = Field(None, description="The field that the film breaks down at.")
    draws: str | None = Field(
        None, min_length=1, description="Table of draws of this material, for [uncertainty]; a path relative to this file."
    )

    @model_validator(mode="after")
    def _carries(self) -> Self:
        if self.equilibrium.shear_modulus == 0 and not any(self.nonequilibrium.shear_modulus_Pa):
            raise InputError("every shear modulus is zero: the material carries no load")
        if self.measured_temperature is not None and self.measured_temperature[0] > self.measured_temperature[1]:
            raise InputError("the lowest comes first", key="measured_temperature")
        measured, there = self.shift.temperature_degC, self.reference_temperature
        if measured is not None and not measured[0] <= there <= measured[-1]:
            outside = f"{there:g} degC is outside the shift table's {measured[0]:g} to {measured[-1]:g} degC"
            raise InputError(f"{outside}: an entry of 0 is needed there", key="reference_temperature")
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
            measured_temperature=None
            if self.measured_temperature is None
            else (self.measured_temperature[0], self.measured_temperature[1]),
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
    return check(MaterialFile, parse_toml(content, source, NO_TABLE), source, Path()).material()


def draws_file(content: bytes, source: str) -> str | None:
    """The name that a material file gives the table of its draws, if there is one; raises as `parse_material`."""
    return check(MaterialFile, parse_toml(content, source, NO_TABLE), source, Path()).draws


def read_material(path: str | Path) -> Material:
    """The material in a material file, or in one that ships with dielast, `example:vhb4905`.

    Raises `InputError` with a line for every mistake.
    """
    return parse_material(read_file(resolve(Path(), path), str(path)), str(path))


def write_material(material: Material, draws: str | None = None) -> bytes:
    """The material as a material file (TOML, UTF-8), numbers with 9 significant digits; `draws` names the table of its draws."""
    import tomli_w

    equilibrium: dict[str, Any] = {"shear_modulus": f"{material.equilibrium_modulus:.9g} Pa"}
    nonequilibrium: dict[str, Any] = {}
    for section, law in ((equilibrium, material.equilibrium_law), (nonequilibrium, material.nonequilibrium_law)):
        if not isinstance(law, Gent):
            raise InputError(f"a material file holds Gent springs only, not {type(law).__name__}")
        if math.isfinite(limit := float(law.J_lim)):
            section["J_lim"] = limit
    measured = material.measured_temperature
    nonequilibrium["relaxation_time_s"] = _digits(material.spectrum.relaxation_time.tolist())
    nonequilibrium["shear_modulus_Pa"] = _digits(material.spectrum.shear_modulus.tolist())
    document: dict[str, Any] = {
        "name": material.name,
        "reference_temperature": f"{material.reference_temperature:.9g} degC",
        **({} if draws is None else {"draws": draws}),
        **({} if measured is None else {"measured_temperature": [f"{value:.9g} degC" for value in measured]}),
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
