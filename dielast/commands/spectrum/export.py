"""The [export] section: material cards for finite-element codes."""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Literal

from pydantic import Field

from dielast.errors import InputError
from dielast.export.card import CODES, spring_names
from dielast.export.code import CardOptions
from dielast.recipe.fields import OneOf, PositiveModulus, Quantity, Section, Temperature
from dielast.units import Dimension

DENSITY = Dimension("a density", "kg/m^3", "960 kg/m^3")
Format = Annotated[str, OneOf(lambda: CODES.names)]


EXPORT_KEYS = {name: f"export.{name}" for name in ("formats", *(field.name for field in fields(CardOptions)))}
"""Arguments and options of `export_card` -> keys of the recipe."""


class ExportSection(Section):
    """Material cards to write beside material.toml; what a code cannot carry is an error unless a key here allows it."""

    formats: list[Format] = Field(min_length=1, description="Finite-element codes to write cards for.")
    units: Literal["SI", "mm-t-s", "mm-N-MPa"] = Field(
        "SI", description="Consistent units of the cards; the card for COMSOL is always in SI."
    )
    temperature_scale: Literal["degC", "K"] = Field("degC", description="Scale of the model's temperatures (Abaqus, ANSYS).")
    hyperelastic: Annotated[str, OneOf(spring_names)] | None = Field(
        None, description="Law of the springs in the cards. Default: that of the material, or an error if a code lacks it."
    )
    J_lim: float | None = Field(None, gt=0, description="One J_lim for all springs, for codes that take only one.")
    moduli: Literal["instantaneous", "long-term"] = Field(
        "instantaneous", description="The modulus that the elastic constants state (Abaqus, FEBio)."
    )
    bulk_modulus: PositiveModulus | None = Field(None, description="Bulk modulus. Default: incompressible, or from poisson_ratio.")
    poisson_ratio: float | None = Field(
        None,
        ge=0,
        lt=0.5,
        description="Poisson's ratio at time zero. Default: 0.495 for codes that need a bulk modulus (FEBio, MFront).",
    )
    density: Annotated[float, Quantity(DENSITY, above=0.0)] | None = Field(None, description="Density. Default: none in the cards.")
    temperature: Temperature | None = Field(None, description="Temperature of the cards for codes that cannot carry the shift law.")

    def _check(self) -> None:
        if len(set(self.formats)) < len(self.formats):
            raise InputError("formats must differ")
        if self.bulk_modulus is not None and self.poisson_ratio is not None:
            raise InputError("state bulk_modulus or poisson_ratio, not both")

    def options(self) -> CardOptions:
        """The options as the library takes them."""
        return CardOptions(**self.model_dump(exclude={"formats"}))
