"""The table of a material file that says how moduli change with temperature."""

from __future__ import annotations

from typing import Any, Self

from pydantic import model_validator

from dielast.errors import InputError
from dielast.handover.law_section import FamilySection, law_constants
from dielast.material.material import Material
from dielast.material.modulus import CONSTANT_MODULUS, ModulusLaw

SCALING_KEYS = {
    key: f"Moduli of {springs}: entropic ones are proportional to T in kelvin."
    for key, springs in {"equilibrium": "the equilibrium spring", "nonequilibrium": "all branches"}.items()
}
"""Keys that state a law -> their descriptions."""


class ScalingSection(FamilySection):
    """How moduli change with temperature; for relaxation times see [shift]."""

    @model_validator(mode="after")
    def _can_be_stated(self) -> Self:
        laws = [self.FAMILY[getattr(self, key)] for key in SCALING_KEYS]
        taken = {constant.file_key for law in laws for constant in law.constants}
        for key in law_constants(self.FAMILY):
            if getattr(self, key) is not None and key not in taken:
                takes = " or ".join(f'"{law.name}"' for law in self.FAMILY if key in law_constants_of(law))
                raise InputError(f"belongs to moduli that are {takes}: state {' or '.join(SCALING_KEYS)} = {takes}", key=key)
        for key in SCALING_KEYS:
            self.scaling(key)
        return self

    def scaling(self, springs: str) -> ModulusLaw:
        """The law for `springs`, one of `SCALING_KEYS`; raises `InputError` if a constant of the law is missing."""
        law: type[ModulusLaw] = self.FAMILY[getattr(self, springs)]
        return law(**law.arguments({key: getattr(self, key) for key in law_constants_of(law)}))


def law_constants_of(law: type[ModulusLaw]) -> list[str]:
    """The keys of the constants of a law."""
    return [constant.file_key for constant in law.constants]


def stated_scaling(material: Material) -> dict[str, Any]:
    """The table that states how the moduli of the material change with temperature; empty if they are constant.

    Raises `InputError` if the equilibrium spring and the branches need different values of one key.
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
