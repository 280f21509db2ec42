"""Tables of a material file that state a law and its constants, made of what the laws of a family say of themselves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import Field, create_model, model_validator

from dielast.material.law import Constant, Law, Registry
from dielast.recipe.fields import Numbers, OneOf, Quantity, Section

Kind = TypeVar("Kind", bound="LawSection")


class LawSection(Section):
    """A table that states a law of one family and its constants."""

    FAMILY: ClassVar[Registry[Any]]
    law: Annotated[str, OneOf(tuple)]

    @model_validator(mode="after")
    def _can_be_stated(self) -> Self:
        self.check()
        return self

    def check(self) -> None:
        """`InputError` if the law cannot be had."""
        self.stated()

    def law_stated(self) -> str:
        """The name of the law."""
        return self.law

    def stated(self, *place: float) -> Any:
        """The law; `place` are arguments of its class before the constants.

        Raises `InputError` for a constant that is missing, or that belongs to another law.
        """
        law = self.FAMILY[self.law_stated()]
        return law(*place, **law.arguments(self.constants()))

    def restated(self, values: Mapping[str, Any], law: str, given: Set[str]) -> dict[str, Any]:
        """The `values` of this table for another law of the family: without the constants that it does not take.

        `given` are the keys of constants that are then stated.
        """
        taken = {constant.file_key for constant in self.FAMILY[law].constants}
        return {key: value for key, value in values.items() if key in taken or key not in law_constants(self.FAMILY)}

    def constants(self) -> dict[str, Any]:
        """The values (SI) of the constants of all laws by their keys, None for those left out."""
        return {key: getattr(self, key) for key in law_constants(self.FAMILY)}


def law_section(section: type[Kind], family: Registry[Any], default: str | None, description: str) -> type[Kind]:
    """The `section` with the key `law`, one of the `family`, and a key for every constant of these laws.

    `default` is the law where none is stated; None: the law must be stated.
    """
    law = Annotated[str, OneOf(lambda: family.names)]
    fields: dict[str, Any] = {"law": (law, Field(... if default is None else default, description=description))}
    fields |= constant_fields(family)
    made = create_model(section.__name__, __base__=section, __doc__=section.__doc__, __module__=section.__module__, **fields)
    made.FAMILY = family
    return made


def constant_fields(family: Registry[Any]) -> dict[str, Any]:
    """A field for every constant of the laws of a family, by its key."""
    return {
        key: (
            _annotation(constants) | None,
            Field(None, description=" ".join(dict.fromkeys(constant.description for constant in constants))),
        )
        for key, constants in law_constants(family).items()
    }


def stated_law(law: Law, default: str | None = None) -> dict[str, Any]:
    """The keys of a table that state the law, without the `default` law's name."""
    return {**({} if law.name == default else {"law": law.name}), **law.stated()}


def law_constants(family: Registry[Any]) -> dict[str, list[Constant]]:
    """The constants of all laws of a family by their keys; laws may share a key."""
    found: dict[str, list[Constant]] = {}
    for constant in _every(family):
        found.setdefault(constant.file_key, []).append(constant)
    return found


def _every(family: Registry[Any]) -> Iterator[Constant]:
    for law in family:
        yield from law.constants


def _annotation(constants: Sequence[Constant]) -> Any:
    """The type of a key that states these constants, each of another law."""
    constant = constants[0]
    if constant.dimension is None:
        if len({each.many for each in constants}) > 1:
            return Annotated[tuple[float, ...], Numbers(constant.at_least, constant.above)]
        number = Annotated[float, Field(gt=constant.above, ge=constant.at_least)]
        return list[number] if constant.many else number
    quantity = Quantity(constant.dimension, constant.at_least, constant.above, many=constant.many)
    return Annotated[tuple[float, ...] if constant.many else float, quantity]
