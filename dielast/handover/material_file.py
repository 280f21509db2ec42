"""The material file: read into a `Material`, and written from one."""

import re
from collections.abc import Mapping, Set
from copy import copy
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, PlainValidator, WithJsonSchema, create_model

from dielast.base.errors import InputError, shown
from dielast.base.registry import adopt_laws
from dielast.base.units import DENSITY
from dielast.handover.law_section import (
    SCALING_KEYS,
    BreakdownSection,
    LawSection,
    ScalingSection,
    breakdown_section,
    law_constants,
    law_section,
    stated_law,
    stated_scaling,
)
from dielast.handover.provenance import OF_SCATTER, CalibratedSection, WindowSection, origins, stated_provenance, warn_of_origin
from dielast.io.files import read_file, resolve
from dielast.io.table import rounded
from dielast.io.toml import parse_toml
from dielast.material.breakdown import BREAKDOWNS
from dielast.material.damage import DAMAGES
from dielast.material.dielectric import DIELECTRICS, DielectricLaw
from dielast.material.flow import FLOWS, LINEAR_FLOW
from dielast.material.material import NEO_HOOKEAN, Material
from dielast.material.modulus import CONSTANT_MODULUS, MODULI
from dielast.material.shift import SHIFTS, NoShift, ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.material.springs import SPRINGS, NeoHookean, SpringLaw
from dielast.recipe.fields import Modulus, Pair, Section, Temperature, WithUnit, first_below
from dielast.recipe.validate import check

Density = Annotated[float, WithUnit(DENSITY, above=0.0)]
_NEEDED = "a material file is needed, which spectrum writes: material.toml"


class SpringSection(LawSection):
    """A table that states the law of springs."""

    def restated(self, values: Mapping[str, Any], law: str, given: Set[str]) -> dict[str, Any]:
        """The `values` without any constant: the same key has another meaning in another law of springs."""
        return {key: value for key, value in values.items() if key not in law_constants(self.FAMILY)}


class Equilibrium(SpringSection):
    """The spring that never relaxes; without J_lim it is neo-Hookean."""

    shear_modulus: Modulus | None = Field(
        None, description="Shear modulus of the spring at small strain; needed unless C10 or mu of the law states it."
    )
    shear_modulus_range: Annotated[Pair[Modulus], first_below("the lower bound")] | None = Field(
        None, description="Bounds of the shear modulus (90 %), where the measured curve ends before its plateau."
    )

    def stated(self, *place: float) -> SpringLaw:
        """The law of the spring."""
        law: SpringLaw = self.FAMILY[self.law].of_file(self.constants(), self.shear_modulus)
        self._modulus_of(law)
        return law

    def restated(self, values: Mapping[str, Any], law: str, given: Set[str]) -> dict[str, Any]:
        """The `values` with the same initial modulus, if shear_modulus states it."""
        kept = super().restated(values, law, given)
        kept.pop("shear_modulus", None)
        spring: type[SpringLaw] = self.FAMILY[law]
        by_itself = spring.takes_modulus and not given & {*spring.file_keys()} - {*spring.beside_modulus()}
        return kept | ({"shear_modulus": values.get("shear_modulus", f"{self.modulus()!r} Pa")} if by_itself else {})

    def modulus(self) -> float:
        """The initial shear modulus in Pa, as stated or from the constants of the law."""
        return self._modulus_of(self.stated())

    def _modulus_of(self, law: SpringLaw) -> float:
        modulus = law.initial_modulus() if self.shear_modulus is None else self.shear_modulus
        if modulus is None:
            raise InputError("is needed", key="shear_modulus")
        return modulus


class Nonequilibrium(SpringSection):
    """The relaxation processes at the reference temperature.

    Constants of the law that are stresses count by their ratios only: the spring of each branch is scaled to its modulus.
    """

    relaxation_time_s: list[Annotated[float, Field(gt=0, allow_inf_nan=False)]] = Field(
        description="Relaxation time of each branch in s, at the reference temperature; an empty list is a purely elastic material."
    )
    shear_modulus_Pa: list[Annotated[float, Field(ge=0, allow_inf_nan=False)]] = Field(
        description="Shear modulus of each branch in Pa."
    )

    def _check(self) -> None:
        super()._check()
        self.spectrum()

    def stated(self, *place: float) -> SpringLaw:
        """The law of the springs of all branches."""
        law: SpringLaw = self.FAMILY[self.law].of_file(self.constants(), None)
        return law

    def spectrum(self) -> Spectrum:
        """The branches as arrays."""
        return Spectrum(np.array(self.relaxation_time_s), np.array(self.shear_modulus_Pa))


class ShiftSection(LawSection):
    """The shift law and its constants."""

    EXAMPLE_PLACE = (np.inf,)  # a reference temperature above all that a law excludes; `MaterialFile` checks its own


class FlowSection(LawSection):
    """How branches flow under stress; their relaxation times are those at small stress."""


class DielectricSection(LawSection):
    """Permittivity, absolute or relative to that of vacuum."""

    ELSEWHERE: ClassVar = {
        "frequency": "a permittivity holds at every frequency: leave this out, and state values at one as low as in the simulation"
    }

    def law_stated(self) -> str:
        """The stated law, or else the first law that takes most of the stated constants."""
        if "law" in self.model_fields_set:
            return self.law
        stated = {key for key in self.model_fields_set if getattr(self, key) is not None}
        law: type[DielectricLaw] = min(self.FAMILY, key=lambda law: len(stated.difference(law.file_keys())))
        return law.name

    def for_material(self) -> float | DielectricLaw | None:
        """The law of the permittivity; None if nothing is stated."""
        law: DielectricLaw = self.stated()
        return law.brief()


class DamageSection(LawSection):
    """Damage that accumulates over the time under voltage: a film fails when it reaches 1, even below the breakdown field."""


class MaterialFile(Section):
    """A dielectric elastomer: springs, relaxation processes, shift law, dielectric."""

    name: str = Field("unnamed", description="Name of the material, for legends.")
    reference_temperature: Temperature = Field(description="Temperature at which the relaxation times hold.")
    density: Density | None = Field(None, description="Density, for the energy per mass of a generator.")
    equilibrium: Equilibrium = Field(description="The spring that never relaxes.")
    nonequilibrium: Nonequilibrium | None = Field(
        None, description="The relaxation processes. Default: none, a purely elastic material."
    )
    shift: ShiftSection | None = Field(None, description="The shift law and its constants; needed with nonequilibrium.")
    flow: FlowSection | None = Field(None, description="How branches flow under stress. Default: in proportion to it.")
    measured_temperature: Annotated[Pair[Temperature], first_below("the lowest temperature")] | None = Field(
        None, description="Lowest and highest temperature at which the shift factors were measured; simulations outside warn."
    )
    dielectric: DielectricSection | None = Field(None, description="Permittivity; needed for simulations with a voltage.")
    breakdown: BreakdownSection | None = Field(None, description="The breakdown field. Default: no breakdown.")
    damage: DamageSection | None = Field(None, description="Damage by the field over time. Default: none.")
    temperature: ScalingSection | None = Field(None, description="How moduli change with temperature. Default: they are constant.")
    calibrated: CalibratedSection | None = Field(None, description="The range of the tests that the material was fitted to.")
    origin: Annotated[dict[str, str], PlainValidator(origins), WithJsonSchema({"type": "object"})] = Field(
        {},
        description='Where constants are from, by path, such as "equilibrium.shear_modulus" = "measured": stated, measured, or '
        "fitted, with the tests. Written by spectrum and calibrate.",
    )
    window: WindowSection | None = Field(None, description="The part of the relaxation that was measured.")
    draws: str | None = Field(
        None, min_length=1, description="Table of draws of this material, for [uncertainty]; its path is relative to this file."
    )

    def _check(self) -> None:
        if self.equilibrium.modulus() == 0 and not any(self.spectrum.shear_modulus):
            raise InputError("every shear modulus is zero: the material carries no load")
        if self.nonequilibrium is not None and self.shift is None:
            raise InputError('is needed; law = "none" says that temperature does not change relaxation times', key="shift")
        if self.nonequilibrium is None and self.shift_law.depends_on_temperature:
            needed = "is needed, as [shift] says how relaxation times change; leave both out of a purely elastic material"
            raise InputError(needed, key="nonequilibrium")
        reach, there = self.shift_law.measured_range(), self.reference_temperature
        if reach is not None and not reach[0] <= there <= reach[1]:
            outside = f"{there:g} degC is outside the {self.shift_law.title}'s {reach[0]:g} to {reach[1]:g} degC"
            raise InputError(f"{outside}: an entry of 0 is needed there", key="reference_temperature")

    @property
    def spectrum(self) -> Spectrum:
        """The branches, none of a purely elastic material."""
        return Spectrum(np.zeros(0), np.zeros(0)) if self.nonequilibrium is None else self.nonequilibrium.spectrum()

    @property
    def shift_law(self) -> ShiftLaw:
        """How relaxation times change with temperature."""
        there = self.reference_temperature
        try:
            law: ShiftLaw = NoShift(there) if self.shift is None else self.shift.stated(there)
        except InputError as error:
            raise error.changed(lambda problem: replace(problem, key=".".join(filter(None, ("shift", problem.key))))) from None
        return law

    def material(self) -> Material:
        """The material that the file describes."""
        measured, scaling, bounds = self.measured_temperature, self.temperature, self.equilibrium.shear_modulus_range
        material = Material(
            name=self.name,
            equilibrium_modulus=self.equilibrium.modulus(),
            spectrum=self.spectrum,
            shift=self.shift_law,
            equilibrium_law=self.equilibrium.stated(),
            nonequilibrium_law=NEO_HOOKEAN if self.nonequilibrium is None else self.nonequilibrium.stated(),
            permittivity=None if self.dielectric is None else self.dielectric.for_material(),
            breakdown=None if self.breakdown is None else self.breakdown.stated(),
            measured_temperature=None if measured is None else (measured[0], measured[1]),
            damage=None if self.damage is None else self.damage.stated(),
            equilibrium_scaling=CONSTANT_MODULUS if scaling is None else scaling.scaling("equilibrium"),
            nonequilibrium_scaling=CONSTANT_MODULUS if scaling is None else scaling.scaling("nonequilibrium"),
            calibrated=None if self.calibrated is None else self.calibrated.stated(),
            flow=LINEAR_FLOW if self.flow is None else self.flow.stated(),
            origin=self.origin,
            window=None if self.window is None else self.window.stated(),
            equilibrium_range=None if bounds is None else (bounds[0], bounds[1]),
            density=self.density,
        )
        warn_of_origin(material)
        return material


def material_file() -> type[MaterialFile]:
    """The model of a material file, with the keys of the laws that are registered at present."""
    families = SPRINGS, SHIFTS, FLOWS, DIELECTRICS, BREAKDOWNS, DAMAGES, MODULI
    return _model(*(family.names for family in families))


@lru_cache(maxsize=1)
def _model(*registered: tuple[str, ...]) -> type[MaterialFile]:
    sections = {
        "equilibrium": law_section(Equilibrium, SPRINGS, "gent", law="Law of the spring. Default: gent."),
        "nonequilibrium": law_section(Nonequilibrium, SPRINGS, "gent", law="Law of the springs of all branches. Default: gent."),
        "shift": law_section(
            ShiftSection, SHIFTS, None, law="Law of the shift factors: how relaxation times change with temperature."
        ),
        "flow": law_section(FlowSection, FLOWS, "linear", law="Law of the flow. Default: linear."),
        "dielectric": law_section(
            DielectricSection,
            DIELECTRICS,
            "constant",
            law="Law of the permittivity. Default: the law that the other keys belong to.",
        ),
        "breakdown": breakdown_section(),
        "damage": law_section(DamageSection, DAMAGES, "inverse-power", law="Law of the damage. Default: inverse-power."),
        "temperature": law_section(ScalingSection, MODULI, "constant", **SCALING_KEYS),
    }
    # a field that a model states again keeps its place, so that the keys stay in the order of the file
    fields: dict[str, Any] = {}
    for name, section in sections.items():
        field = copy(MaterialFile.model_fields[name])
        fields[name] = section if field.is_required() else section | None, field
    return create_model("MaterialFile", __base__=MaterialFile, __doc__=MaterialFile.__doc__, **fields)


def read_values(content: bytes, source: str) -> dict[str, Any]:
    """The values in the bytes of a material file, unchecked; raises `InputError` for another kind of file, with what takes it."""
    if card := _CARD.search(content[:100_000]):
        code = "Abaqus" if card[0].lstrip().startswith(b"*") else "ANSYS"
        name = shown(Path(source).name)
        instead = f"a card of {code}: dielast spectrum makes a material file of it, with prony = {name} and prony_units"
        raise InputError(instead, file=source)
    values = parse_toml(content, source, _NEEDED)
    if "equilibrium" not in values and (isinstance(values.get("kind"), str) or "step" in values):
        found = f"a recipe or a summary of {shown(values['kind'])}" if "kind" in values else "a load file"
        raise InputError(f"{found}; {_NEEDED}", file=source)
    adopt_laws(values)
    return values


_CARD = re.compile(rb"^[ \t]*(?:\*(?:HEADING|MATERIAL|ELASTIC|HYPERELASTIC|VISCOELASTIC)|TB *, *[A-Z]+ *,|/PREP7)", re.I | re.M)


def parse_file(content: bytes, source: str) -> MaterialFile:
    """The material file in these bytes, with the name of the table of its draws; `InputError` with a line for every mistake."""
    values = read_values(content, source)  # first, as laws of packages add fields to the model
    return check(material_file(), values, source, Path())


def parse_material(content: bytes, source: str) -> Material:
    """The material in the bytes of a material file; raises `InputError` with a line for every mistake."""
    return parse_file(content, source).material()


def read_material(path: str | Path) -> Material:
    """The material (SI units, temperatures in degC) in a material file, or in one that ships with dielast, `example:vhb4905`.

    Raises `InputError` with a line for every mistake.
    """
    return parse_material(read_file(resolve(Path(), path), str(path)), str(path))


def write_material(material: Material, draws: str | None = None) -> bytes:
    """The material as a material file (TOML, UTF-8), numbers with 9 significant digits; `draws` names the table of its draws."""
    import tomli_w

    measured, bounds = material.measured_temperature, material.equilibrium_range
    document: dict[str, Any] = {
        "name": material.name,
        "reference_temperature": f"{material.reference_temperature:.9g} degC",
        **({} if material.density is None else {"density": f"{material.density:.9g} kg/m^3"}),
        **({} if draws is None else {"draws": draws}),
        **({} if measured is None else {"measured_temperature": [f"{value:.9g} degC" for value in measured]}),
        "equilibrium": _stated_spring(material.equilibrium_law, material.equilibrium_modulus)
        | ({} if bounds is None else {"shear_modulus_range": [f"{value:.9g} Pa" for value in bounds]}),
        "nonequilibrium": {
            **stated_law(material.nonequilibrium_law, "gent"),
            "relaxation_time_s": rounded(material.spectrum.relaxation_time.tolist()),
            "shear_modulus_Pa": rounded(material.spectrum.shear_modulus.tolist()),
        },
        "shift": stated_law(material.shift),
        **({"flow": stated_law(material.flow)} if material.flow.depends_on_stress else {}),
    }
    for law, section, default in (
        (material.dielectric, "dielectric", "constant"),
        (material.breakdown, "breakdown", "table"),
        (material.damage, "damage", "inverse-power"),
    ):
        document |= {} if law is None else {section: stated_law(law, default)}
    document |= stated_scaling(material)
    document |= stated_provenance(material)
    return re.sub(
        r"^(specimen_scatter|model_error) = ", rf"{OF_SCATTER}\g<0>", tomli_w.dumps(document), count=1, flags=re.M
    ).encode()


def _stated_spring(law: SpringLaw, modulus: float) -> dict[str, Any]:
    """The keys of the equilibrium spring."""
    if modulus == 0 and law.initial_modulus() is not None:
        law = NeoHookean()  # constants that are stresses cannot describe a spring with modulus 0
    name = {} if law.name == "gent" else {"law": law.name}
    return {**({"shear_modulus": f"{modulus:.9g} Pa"} if law.takes_modulus else {}), **name, **law.in_file(modulus)}
