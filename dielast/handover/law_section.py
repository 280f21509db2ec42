"""Tables of a material file that state a law and its constants; the keys come from the registered laws of a family."""

from collections.abc import Mapping, Sequence, Set
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

from pydantic import Field, create_model

from dielast.base.errors import InputError
from dielast.base.registry import Registry
from dielast.material.breakdown import BREAKDOWNS, BreakdownLaw
from dielast.material.law import Constant, Law, ModulusLaw
from dielast.material.material import Material
from dielast.material.modulus import CONSTANT_MODULUS
from dielast.recipe.fields import Numbers, OneOf, Section, WithUnit

Kind = TypeVar("Kind", bound="FamilySection")


class FamilySection(Section):
    """A table that states laws of one family and their constants."""

    FAMILY: ClassVar[Registry[Any]]


class LawSection(FamilySection):
    """A table that states one law and its constants."""

    EXAMPLE_PLACE: ClassVar[tuple[float, ...]] = ()
    """Arguments for `stated` with which every law that is correctly stated can be made."""
    law: Annotated[str, OneOf(tuple)]

    def _check(self) -> None:
        self._check_default()
        self.stated(*self.EXAMPLE_PLACE)

    def _check_default(self) -> None:
        """`InputError` naming the law to state, if none is stated and the constants belong to another law than the default."""
        if "law" in self.model_fields_set:
            return
        law = self.FAMILY[self.law_stated()]
        others = {key for key, value in self.constants().items() if value is not None and key not in law.file_keys()}
        instead = [f'"{other.name}"' for other in self.FAMILY if others <= set(other.file_keys())]
        if others and instead:
            refused = f'law "{law.name}" does not take {" and ".join(sorted(others))}'
            raise InputError(f"{refused}: state law = {' or '.join(instead)}")

    def law_stated(self) -> str:
        """The name of the law."""
        return self.law

    def stated(self, *place: float) -> Any:
        """The law; `place` are the arguments of its class that precede the constants.

        Raises `InputError` for a constant that is missing, or that belongs to another law.
        """
        law = self.FAMILY[self.law_stated()]
        stated = law.arguments(self.constants())
        try:
            return law(*place, **stated)
        except InputError as error:
            keys = {constant.name: constant.file_key for constant in law.constants}
            raise error.changed(lambda problem: problem.in_keys(keys)) from None

    def restated(self, values: Mapping[str, Any], law: str, given: Set[str]) -> dict[str, Any]:
        """The `values` of this table for another law of the family, without the constants that this law does not take.

        `given` are the keys of the constants that are stated for the other law.
        """
        taken = self.FAMILY[law].file_keys()
        return {key: value for key, value in values.items() if key in taken or key not in law_constants(self.FAMILY)}

    def constants(self) -> dict[str, Any]:
        """The values (SI) of the constants of all laws by their keys, None for those left out."""
        return {key: getattr(self, key) for key in law_constants(self.FAMILY)}


def law_section(section: type[Kind], family: Registry[Any], default: str | None, **descriptions: str) -> type[Kind]:
    """The `section` with keys that name a law of the `family`, each with its description, and a key for every constant of the laws.

    `default` is the law where none is stated; None: the law must be stated.
    """
    law = Annotated[str, OneOf(lambda: family.names)]
    first = ... if default is None else default
    fields: dict[str, Any] = {key: (law, Field(first, description=text)) for key, text in descriptions.items()}
    for key, constants in law_constants(family).items():
        text = " ".join(dict.fromkeys(constant.description for constant in constants))
        fields[key] = (_annotation(constants) | None, Field(None, description=text))
    made = create_model(section.__name__, __base__=section, __doc__=section.__doc__, __module__=section.__module__, **fields)
    made.FAMILY = family
    return made


def stated_law(law: Law, default: str | None = None) -> dict[str, Any]:
    """The keys of a table that state the law, without the `default` law's name."""
    return {**({} if law.name == default else {"law": law.name}), **law.stated()}


def law_constants(family: Registry[Any]) -> dict[str, list[Constant]]:
    """The constants of all laws of a family by their keys; laws may share a key."""
    by_key: dict[str, list[Constant]] = {}
    for constant in chain.from_iterable(law.constants for law in family):
        by_key.setdefault(constant.file_key, []).append(constant)
    return by_key


def _annotation(constants: Sequence[Constant]) -> Any:
    """The type of a key that states these constants, which belong to different laws."""
    constant = constants[0]
    if constant.dimension is None:
        if len({constant.many for constant in constants}) > 1:
            return Annotated[tuple[float, ...], Numbers(constant.at_least, constant.above)]
        number = Annotated[float, Field(gt=constant.above, ge=constant.at_least, le=constant.at_most)]
        return list[number] if constant.many else number
    quantity = WithUnit(constant.dimension, constant.at_least, constant.above, many=constant.many)
    return Annotated[tuple[float, ...] if constant.many else float, quantity]


SCALING_KEYS = {
    key: f"Moduli of {springs}: entropic ones are proportional to T in kelvin."
    for key, springs in {"equilibrium": "the equilibrium spring", "nonequilibrium": "all branches"}.items()
}
"""Keys that state a law -> their descriptions."""


class ScalingSection(FamilySection):
    """How moduli change with temperature; for relaxation times see [shift]."""

    def _check(self) -> None:
        taken = {key for springs in SCALING_KEYS for key in self.FAMILY[getattr(self, springs)].file_keys()}
        for key in law_constants(self.FAMILY):
            if getattr(self, key) is not None and key not in taken:
                takes = " or ".join(f'"{law.name}"' for law in self.FAMILY if key in law.file_keys())
                raise InputError(f"belongs to moduli that are {takes}: state {' or '.join(SCALING_KEYS)} = {takes}", key=key)
        for key in SCALING_KEYS:
            self.scaling(key)

    def scaling(self, springs: str) -> ModulusLaw:
        """The law for `springs`, one of `SCALING_KEYS`; raises `InputError` if a constant of the law is missing."""
        law: type[ModulusLaw] = self.FAMILY[getattr(self, springs)]
        return law(**law.arguments({key: getattr(self, key) for key in law.file_keys()}))


def stated_scaling(material: Material) -> dict[str, Any]:
    """The table that states how the moduli of the material change with temperature; empty if they are constant.

    Raises `InputError` if the equilibrium spring and the branches need different values of one key.
    """
    laws = {"equilibrium": material.equilibrium_scaling, "nonequilibrium": material.nonequilibrium_scaling}
    stated: dict[str, Any] = {key: law.name for key, law in laws.items() if law.name != CONSTANT_MODULUS.name}
    constants: dict[str, Any] = {}
    for law in laws.values():
        for key in law.file_keys():
            value = law.stated().get(key)
            if constants.setdefault(key, value) != value:
                raise InputError(f"a material file has one {key} for the equilibrium spring and the branches, not two")
    stated |= {key: value for key, value in constants.items() if value is not None}
    return {"temperature": stated} if stated else {}


class BreakdownSection(LawSection):
    """Breakdown field: one for all prestretches, a table over prestretch, or a law over the present stretch and thickness."""


def breakdown_section() -> type[BreakdownSection]:
    """The table with the keys of the laws that are registered at present."""
    return law_section(BreakdownSection, BREAKDOWNS, "table", law="Law of the breakdown field. Default: table.")


def breakdown(section: BreakdownSection | None) -> BreakdownLaw | None:
    """The law of the breakdown field; None if none is stated."""
    if section is None:
        return None
    law: BreakdownLaw = section.stated()
    return law


if TYPE_CHECKING:
    BreakdownField = BreakdownSection
else:
    BreakdownField = breakdown_section()
