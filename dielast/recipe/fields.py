"""The field types of numbers that recipe and material models are made of: quantities with units, and names of laws."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    WithJsonSchema,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, core_schema

from dielast.base import units
from dielast.base.errors import InputError, listed, shown
from dielast.base.registry import adopt
from dielast.base.units import Dimension

Entry = TypeVar("Entry")


class Section(BaseModel):
    """Base of every table of a recipe: unknown keys are errors, and no value is converted silently.

    `ELSEWHERE` holds messages for keys that belong to other recipes, by key.
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)
    ELSEWHERE: ClassVar[Mapping[str, str]] = {}

    @model_validator(mode="after")
    def _checked(self) -> Self:
        self._check()
        return self

    def _check(self) -> None:
        """`InputError` for keys that do not fit each other; a table with such keys overrides this."""


def one_or_more(value: Any, read: Callable[[Any], float], needed: str) -> tuple[float, ...]:
    """One number, or all numbers of a list; `needed` names the quantity for the message about an empty list."""
    if value == []:
        raise InputError(f"{needed} is needed, or a list of them")
    return tuple(map(read, value if isinstance(value, list) else [value]))


def schema_of_one_or_more(one: Mapping[str, Any]) -> dict[str, Any]:
    """The JSON Schema of what `one_or_more` reads, from that of one number."""
    return {"anyOf": [one, {"type": "array", "items": one, "minItems": 1}]}


QUANTITY, UNIT = "x-quantity", "x-unit"
"""Keys of the JSON Schema for the name of a quantity and its SI unit."""


@dataclass(frozen=True, slots=True)
class WithUnit:
    """Marks a number in `dimension.unit` that is stated as text with a unit, optionally bounded.

    `within` bounds the magnitude of all numbers but 0; `many` allows a number or a list, read as a tuple.
    """

    dimension: Dimension
    at_least: float | None = None
    above: float | None = None
    within: tuple[float, float] = units.COMPUTABLE
    many: bool = False

    def read(self, value: Any) -> float:
        """The number; raises `InputError`."""
        number = units.parse(value, self.dimension, self.within)
        name, unit = self.dimension.name, self.dimension.unit
        if self.above is not None and number <= self.above:
            above = f"{self.above:g}" if unit == "1" else f"{self.above:g} {unit}"
            raise InputError(f"{shown(value)}: {name} above {above} is needed")
        if self.at_least is not None and number < self.at_least:
            raise InputError(f"{shown(value)}: {name} of at least {self.at_least:g} {unit} is needed")
        return number

    def read_many(self, value: Any) -> tuple[float, ...]:
        """One number or a list of them; raises `InputError`."""
        return one_or_more(value, self.read, self.dimension.name)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read_many if self.many else self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        name, example = self.dimension.name, self.dimension.example
        text = f'{name[0].upper()}{name[1:]} with its unit, such as "{example}".'
        marks = {QUANTITY: name.split(" ", 1)[1], UNIT: self.dimension.unit}
        quantity = {"type": "string", "description": text, "examples": [example], **marks}
        return schema_of_one_or_more(quantity) if self.many else quantity


@dataclass(frozen=True, slots=True)
class NamedQuantity(WithUnit):
    """Marks quantities that keep their text as a name, such as "1 h": a list is read as pairs of text and number."""

    def read_many(self, value: Any) -> tuple[tuple[str, float], ...]:  # type: ignore[override]
        """The text and the number of one quantity or of each entry of a list; raises `InputError`."""
        numbers = one_or_more(value, self.read, self.dimension.name)
        texts = [" ".join(entry.split()) for entry in (value if isinstance(value, list) else [value])]
        return tuple(zip(texts, numbers, strict=True))


@dataclass(frozen=True, slots=True)
class Numbers:
    """Marks a bare number or a list of them, optionally bounded, read as a tuple."""

    at_least: float | None = None
    above: float | None = None

    def read(self, value: Any) -> float:
        """The number; raises `InputError`."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{shown(value)}: a bare number is needed, or a list of them")
        if self.above is not None and not value > self.above:
            raise InputError(f"{shown(value)}: a number above {self.above:g} is needed")
        if self.at_least is not None and not value >= self.at_least:
            raise InputError(f"{shown(value)}: at least {self.at_least:g} is needed")
        return float(value)

    def read_many(self, value: Any) -> tuple[float, ...]:
        """One number or a list of them; raises `InputError`."""
        return one_or_more(value, self.read, "a bare number")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read_many)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        number: dict[str, Any] = {"type": "number"}
        if self.at_least is not None:
            number["minimum"] = self.at_least
        if self.above is not None:
            number["exclusiveMinimum"] = self.above
        return schema_of_one_or_more(number)


@dataclass(frozen=True, slots=True)
class OneOf:
    """Marks text that is one of `names()`, which is called when a recipe is read, so that laws can be registered from outside."""

    names: Callable[[], Sequence[str]]

    def read(self, value: Any) -> str:
        """The text; raises `InputError`."""
        if value not in self.names() and not (adopt(value) and value in self.names()):
            raise InputError(f"{shown(value)}: one of {listed(map(shown, self.names()))} is needed")
        return str(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": "string", "enum": list(self.names())}


def first_below(what: str) -> AfterValidator:
    """Two numbers of which the first one, `what` it is called, must not be the larger one."""

    def check(pair: list[float] | None) -> list[float] | None:
        if pair is not None and pair[0] > pair[1]:
            raise InputError(f"{what} must come first")
        return pair

    return AfterValidator(check)


def ascending(values: list[float] | None) -> list[float] | None:
    """Times that ascend; raises `InputError`."""
    if any(after <= before for before, after in pairwise(values or ())):
        raise InputError("times must ascend")
    return values


Pair = Annotated[list[Entry], Field(min_length=2, max_length=2)]
Time = Annotated[float, WithUnit(units.TIME, at_least=0.0, within=units.TIMES)]
PositiveTime = Annotated[float, WithUnit(units.TIME, above=0.0, within=units.TIMES)]
NamedTimes = Annotated[tuple[tuple[str, float], ...], NamedQuantity(units.TIME, above=0.0, within=units.TIMES, many=True)]
RelaxationTime = Annotated[float, WithUnit(units.TIME, above=0.0)]
Temperature = Annotated[float, WithUnit(units.TEMPERATURE, above=-units.ZERO_CELSIUS, within=units.TEMPERATURES)]
TemperatureDifference = Annotated[float, WithUnit(units.TEMPERATURE_DIFFERENCE, above=0.0)]
TemperatureError = Annotated[float, WithUnit(units.TEMPERATURE_DIFFERENCE, at_least=0.0)]
ThermalExpansion = Annotated[float, WithUnit(units.THERMAL_EXPANSION)]
Modulus = Annotated[float, WithUnit(units.STRESS, at_least=0.0)]
PositiveModulus = Annotated[float, WithUnit(units.STRESS, above=0.0)]
Permittivity = Annotated[float, WithUnit(units.PERMITTIVITY, above=0.0)]
StrainRate = Annotated[float, WithUnit(units.STRAIN_RATE, within=units.TIMES)]
Voltage = Annotated[float, WithUnit(units.VOLTAGE)]
Voltages = Annotated[tuple[float, ...], WithUnit(units.VOLTAGE, at_least=0.0, many=True)]
Temperatures = Annotated[
    tuple[float, ...], WithUnit(units.TEMPERATURE, above=-units.ZERO_CELSIUS, within=units.TEMPERATURES, many=True)
]
Force = Annotated[float, WithUnit(units.FORCE)]
Stress = Annotated[float, WithUnit(units.STRESS)]
AscendingTimes = Annotated[list[Time], Field(min_length=1), AfterValidator(ascending)]
Length = Annotated[float, WithUnit(units.LENGTH, above=0.0)]
Area = Annotated[float, WithUnit(units.AREA, above=0.0)]


def _relative_deviation(value: Any) -> float:
    """A standard deviation over the mean."""
    try:
        number = units.parse(value, units.STRAIN)
    except InputError:
        number = -1.0
    if not 0 < number < 1:
        raise InputError(f'{shown(value)}: a relative standard deviation below 100 % is needed, such as "5 %"')
    return number


RelativeDeviation = Annotated[float, PlainValidator(_relative_deviation), WithJsonSchema({"type": "string", "examples": ["5 %"]})]


def dimension_of(field: FieldInfo | None) -> Dimension | None:
    """The dimension of the quantities that a field takes; None if it takes none."""

    def within(annotation: Any) -> Iterator[Dimension]:
        for inner in get_args(annotation):
            yield from [inner.dimension] if isinstance(inner, WithUnit) else within(inner)

    if field is None:
        return None
    stated = [mark.dimension for mark in field.metadata if isinstance(mark, WithUnit)]
    return next(iter([*stated, *within(field.annotation)]), None)


def on_one_scale(values: Sequence[Any], dimension: Dimension | None = None) -> tuple[list[float], str] | None:
    """The numbers and their common unit; None unless all values are numbers, or quantities of one dimension.

    `dimension` is needed for quantities with a unit of two dimensions, such as "187 K", a temperature or a difference.
    """
    quantities = []
    for value in values:
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            return None
        try:
            if not isinstance(value, str):
                quantities.append((float(value), "1"))
            else:
                stated = units.recognise(value) if dimension is None else (units.parse(value, dimension), dimension.unit)
                quantities.append(stated)
        except InputError:
            return None
    scales = {unit for _, unit in quantities}
    return ([number for number, _ in quantities], scales.pop()) if len(scales) == 1 else None
