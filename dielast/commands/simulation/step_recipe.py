"""`[[step]]`: what steps of any quantity share."""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from dielast.base.errors import InputError, Mistakes, Problem, shown
from dielast.base.units import Dimension, parse
from dielast.mechanics.line import wrong_way
from dielast.recipe.fields import PositiveTime, Section, Time
from dielast.recipe.file_fields import InputFile, SheetName

Step = TypeVar("Step", bound="HistoryStep")


@dataclass(frozen=True, slots=True)
class AnyOf:
    """Marks a quantity of one of these dimensions, stated as text with a unit, read as its number and its SI unit; messages speak
    of the first dimension, or of what the quantity is `called`.
    """

    dimensions: tuple[Dimension, ...]
    called: str | None = None

    def read(self, value: Any) -> tuple[float, str]:
        """The number and the unit; raises `InputError`."""
        mistakes = []
        for dimension in self.dimensions:
            try:
                return parse(value, dimension), dimension.unit
            except InputError as error:
                mistakes.append(error)
        if self.called is None:
            raise mistakes[0]
        first, examples = self.dimensions[0], [shown(dimension.example) for dimension in self.dimensions]
        raise InputError(str(mistakes[0]).replace(first.name, self.called).replace(examples[0], " or ".join(examples)))

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": "string", "examples": [dimension.example for dimension in self.dimensions]}


class Aim(NamedTuple):
    """The `value` of a quantity that a step goes to, and the rate at which, if that is stated; a stretch has no `unit`."""

    quantity: str
    value: float
    rate: float | None
    unit: str = ""

    def missed(self, present: float | None) -> str | None:
        """The mistake in a rate that never leads here from `present`, None where the recipe leaves the start open; or None."""
        if self.rate == 0:
            return f"rate 0 never reaches the {self.quantity if self.unit else 'target'}"
        move = 0.0 if present is None else self.value - present
        # a target that is reached already, but for rounding, allows any rate
        if self.rate is None or move * self.rate >= 0 or abs(move) <= 1e-12 * abs(self.value):
            return None
        strain = self.quantity == "stretch" and self.value < 1 <= (present or 0.0)
        hint = f"; a stretch is 1 + strain: if {self.value:g} is a strain, write {1 + self.value:g}" if strain else ""
        return wrong_way(self.rate, move, self.quantity, self.unit) + hint


OF_A_TABLE, OF_A_WAVEFORM = ("columns", "sheet"), ("low", "high", "period", "cycles", "phase")
"""Keys of a step that go with its table, and with its waveform."""


class HistoryStep(Section):
    """A step holds for a time, follows a table, or goes to a target at a rate, within a duration, or at once.

    `CONTROL` is the quantity that the solver prescribes; before the first step it is `REST`.
    """

    CONTROL: ClassVar[str]
    REST: ClassVar[float] = 0.0
    ELSEWHERE: ClassVar = {
        "from": "a step begins where the one before ends; of a waveform low is the lowest value",
        "to": "a step goes to the value of what it changes, such as stretch = 2.0; of a waveform high is the highest value",
    }

    hold: PositiveTime | None = Field(None, description="Time for which the load stays as it is.")
    table: InputFile | None = Field(
        None,
        description="Follow measured points: columns time and the prescribed quantity, or what a testing machine writes for it.",
    )
    duration: Time | None = Field(None, description="Time to reach the target, instead of rate. Default: at once.")
    waveform: Literal["triangle", "sine"] | None = Field(None, description="Cycles between low and high, starting from low.")
    period: PositiveTime | None = Field(None, description="Period of the waveform.")
    cycles: int | None = Field(None, ge=1, le=1_000_000, description="Number of cycles of the waveform. Default: 1.")
    sheet: SheetName | None = Field(None, description="Sheet of a table that is a workbook. Default: the first sheet.")

    def aim(self) -> Aim | None:
        """The target of the step, if the recipe states one."""
        return None

    def _check(self) -> None:
        self._check_waveform()
        self._check_action()

    def _check_waveform(self) -> None:
        """`InputError` for keys of a waveform without it, and for a waveform that lacks keys."""
        stated = [key for key in OF_A_WAVEFORM if getattr(self, key, None) is not None]
        if self.waveform is None and stated:
            raise InputError(f"{stated[0]} goes with waveform")
        if self.waveform is not None and (missing := [key for key in ("high", "period") if key not in stated]):
            raise InputError(f"a waveform needs {' and '.join(missing)}")
        if self.waveform is not None:
            self._check_ends()

    def _check_ends(self) -> None:
        """`InputError` for a low above high; a quantity with its unit is a pair, and low is `REST` where it is left out."""
        low, high = getattr(self, "low", None), getattr(self, "high", None)
        (least, unit), (most, other) = (value if isinstance(value, tuple) else (value, "") for value in (low, high))
        least = self.REST if least is None else least
        if (low is None or unit == other) and least > most:
            stated = f"low is {least:g}" if low is not None else f"low, which is left out, is {least:g}"
            raise InputError(f"{stated}, above high, {most:g}: low is the lowest value of a waveform", key="low")

    def _check_action(self) -> None:
        """`InputError` unless the step does one thing, with keys that go with it."""
        possible = [key for key in type(self).model_fields if key not in ("rate", "duration", *OF_A_TABLE, *OF_A_WAVEFORM)]
        actions = [key for key in possible if getattr(self, key) is not None]
        paces = [key for key in ("rate", "duration") if getattr(self, key, None) is not None]
        if len(actions) != 1:
            instead = f", not {' and '.join(actions)} together" if actions else ""
            raise InputError(f"one of {', '.join(possible)} is needed{instead}")
        if actions[0] in ("hold", "table", "waveform") and paces:
            raise InputError(f"{paces[0]} does not go with {actions[0]}")
        if len(paces) > 1:
            raise InputError("rate and duration do not go together")
        for key in OF_A_TABLE:
            if getattr(self, key, None) is not None and self.table is None:
                raise InputError(f"{key} goes with table")


def starting(start: float) -> AfterValidator:
    """Steps from `start` on, every rate of which leads to its target, as far as the recipe states where a step begins."""

    def check(steps: list[Step]) -> list[Step]:
        wrong = Mistakes()
        present: dict[str, float] | None = None  # by quantity; at first all are at the start
        for index, step in enumerate(steps):
            if step.hold is not None:
                continue
            aim = step.aim()
            if aim is not None:
                mistake = aim.missed(start if present is None else present.get(aim.quantity))
                if mistake is not None:
                    wrong.append(Problem(mistake, key=f"[{index}]"))
            # the end of a table or a waveform is not worked out
            present = {} if aim is None else {aim.quantity: aim.value}
        wrong.refuse()
        return steps

    return AfterValidator(check)
