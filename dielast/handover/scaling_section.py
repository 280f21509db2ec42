"""The table of a material file that says how moduli change with temperature."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, create_model, model_validator

from dielast.errors import InputError
from dielast.handover.law_section import constant_fields, law_constants
from dielast.material.law import Registry
from dielast.material.material import Material
from dielast.material.modulus import CONSTANT_MODULUS, ModulusLaw
from dielast.recipe.fields import OneOf, Section

SPRINGS = {"equilibrium": "the equilibrium spring", "nonequilibrium": "all branches"}


class ScalingSection(Section):
    """How moduli change with temperature; relaxation times change as [shift] says."""

    FAMILY: ClassVar[Registry[type[ModulusLaw]]]

    @model_validator(mode="after")
    def _can_be_stated(self) -> Self:
        laws = [self.FAMILY[getattr(self, key)] for key in SPRINGS]
        taken = {constant.file_key for law in laws for constant in law.constants}
        for key in law_constants(self.FAMILY):
            if getattr(self, key) is not None and key not in taken:
                takes = " or ".join(f'"{law.name}"' for law in self.FAMILY if key in law_constants_of(law))
                raise InputError(f"it belongs to moduli that are {takes}: state {' or '.join(SPRINGS)} = {takes}", key=key)
        for key in SPRINGS:
            self.scaling(key)
        return self

    def scaling(self, springs: str) -> ModulusLaw:
        """The law of the springs, which is a key of `SPRINGS`; raises `InputError` for a constant that it lacks."""
        law = self.FAMILY[getattr(self, springs)]
        return law(**law.arguments({key: getattr(self, key) for key in law_constants_of(law)}))


def law_constants_of(law: type[ModulusLaw]) -> list[str]:
    """The keys of the constants of a law."""
    return [constant.file_key for constant in law.constants]


def scaling_section(section: type[ScalingSection], family: Registry[type[ModulusLaw]], default: str) -> type[ScalingSection]:
    """The `section` with a law of the `family` for the equilibrium spring and for the branches, and a key for every constant."""
    law = Annotated[str, OneOf(lambda: family.names)]
    fields: dict[str, Any] = {
        key: (law, Field(default, description=f"Moduli of {springs}: entropic ones are proportional to T in kelvin."))
        for key, springs in SPRINGS.items()
    }
    fields |= constant_fields(family)
    made = create_model(section.__name__, __base__=section, __doc__=section.__doc__, __module__=section.__module__, **fields)
    made.FAMILY = family
    return made


def stated_scaling(material: Material) -> dict[str, Any]:
    """The table that states how the moduli of the material change with temperature; none where they do not.

    Raises `InputError` for two laws that no table can state side by side.
    """
    laws = {"equilibrium": material.equilibrium_scaling, "nonequilibrium": material.nonequilibrium_scaling}
    stated: dict[str, Any] = {key: law.name for key, law in laws.items() if law.name != CONSTANT_MODULUS.name}
    constants: dict[str, Any] = {}
    for law in laws.values():
        for key in law_constants_of(type(law)):
            value = law.stated().get(key)
            if constants.setdefault(key, value) != value:
                raise InputError(f"a material file has one {key} for the equilibrium spring and the branches, not two")
    stated |= {key: value for key, value in constants.items() if value is not None}
    return {"temperature": stated} if stated else {}
