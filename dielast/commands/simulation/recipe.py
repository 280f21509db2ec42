"""Recipes of `relax` and `creep`, and what every simulation shares."""

from __future__ import annotations

import difflib
import re
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from dielast.errors import InputError, Mistakes, Problem, shown, shown_path
from dielast.io.table import split_header
from dielast.mechanics.load import wrong_way
from dielast.readings.specimen_recipe import MachineColumns, Specimen, unmeasured
from dielast.recipe.base import RecipeBase, TextTable, units_of
from dielast.recipe.fields import (
    Force,
    InputFile,
    PositiveTime,
    Section,
    SheetName,
    StrainRate,
    Stress,
    Temperature,
    Time,
    on_one_scale,
)
from dielast.recipe.paths import read_path
from dielast.recipe.uncertainty import Uncertainty
from dielast.units import FORCE, FORCE_RATE, STRESS, STRESS_RATE, Dimension, decimal_comma, parse

Step = TypeVar("Step", bound="HistoryStep")
# the recipe's key for each argument of the simulations, those of steps apart
KEYS = {
    "material": "material",
    "temperature": "temperature",
    "mode": "mode",
    "times": "output.times",
    "points_per_decade": "output.points_per_decade",
    "cycles": "output.cycles",
    "rtol": "solver.rtol",
    "thickness": "film.thickness",
    "prestretch": "film.prestretch",
    "prestretch_rate": "film.prestretch_rate",
    "relax": "film.relax",
    "boundary": "film.boundary",
    "breakdown_field": "breakdown",
    "pull_in_timescale": "pull_in.timescale",
    "stop_at": "stop.at",
    "voltage": "voltage",
    "ramp": "voltage.ramp",
    "horizon": "horizon",
    "sample": "uncertainty",
}


def _no_strain(value: Any) -> Any:
    """A stretch as it stands, unless it is plainly a strain."""
    if isinstance(value, str) and (percent := re.fullmatch(r"\s*([+-]?\d+(?:\.\d+)?)\s*%\s*", value)):
        stretch = 1 + float(percent[1]) / 100
        raise InputError(f"{shown(value)}: a bare number is needed, and a stretch is 1 + strain, so this would be {stretch:g}")
    return value


Stretch = Annotated[float, BeforeValidator(_no_strain), Field(gt=0, allow_inf_nan=False)]


def _column(header: str, info: ValidationInfo) -> str:
    """A column of the result, of which the model of the recipe says what it has."""
    known = (info.context or {}).get("columns")
    if known and header not in known:
        near = [own for own in known if split_header(own)[0] == split_header(header)[0]]
        near = near or difflib.get_close_matches(header, known, n=1, cutoff=0.8)
        hint = f'did you mean "{near[0]}"?' if near else "there are " + ", ".join(known)
        raise InputError(f'"{header}" is no column of the result; {hint}')
    return header


def _abscissa(header: str, info: ValidationInfo) -> str:
    """A column of the result, or a swept key in one spelling."""
    swept = (info.context or {}).get("swept", {})
    key = shown_path(read_path(header) or (header,))
    if key in swept:
        values = swept[key]
        if isinstance(values, list) and on_one_scale(values) is None:
            raise InputError(f"the values of {key} are on no scale: numbers, or quantities of one kind, are needed")
        return key
    try:
        return _column(header, info)
    except InputError as error:
        raise error.adding(f"; swept are {', '.join(swept)}" if swept else "") from None


def _cell(value: Any) -> str | int | float:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError(f"{shown(value)}: text or a number is needed")
    return value


Cell = Annotated[str | int | float, PlainValidator(_cell), WithJsonSchema({"type": ["string", "number"]})]
ResultColumn = Annotated[str, AfterValidator(_column)]
COLUMNS = (
    "time [s]",
    "stretch_1 [1]",
    "stretch_2 [1]",
    *(f"{what}_stress_{axis} [Pa]" for what in ("nominal", "true") for axis in (1, 2)),
)


# what a column of the result may be measured as
_MEASURED_AS = {
    "time [s]": {"time"},
    "stretch_1 [1]": {"stretch", "strain", "extension"},
    "nominal_stress_1 [Pa]": {"stress", "force"},
}


def roles_of(header: str) -> set[str]:
    """The columns of a testing machine that a column of the result may be compared with."""
    return _MEASURED_AS.get(header, set())


class Comparison(TextTable):
    """Measured points to lay over the plot; their misfit goes into the summary."""

    file: InputFile = Field(description="The measured points.")
    x: ResultColumn = Field(description="A column of the result, such as time [s].")
    y: ResultColumn = Field(description="A column of the result, such as nominal_stress_1 [Pa].")
    x_column: str | None = Field(None, description="The file's column, where it is called otherwise.")
    y_column: str | None = Field(None, description="The file's column, where it is called otherwise.")
    columns: MachineColumns = Field(
        MachineColumns(), description="The file's columns of time, extension and force, for x and y in time, stretch and stress."
    )
    specimen: Specimen | None = Field(
        None, description="What extension and force were measured on; left out: the recipe's [specimen]."
    )
    units: Annotated[dict[str, str], units_of(x=None, y=None)] = Field(
        {}, description="Units of x and y, where the header does not say them."
    )
    where: dict[str, Cell] = Field({}, description="Use only the rows where these columns have these values.")
    case: int = Field(0, ge=0, description="The case that was measured.")
    label: str | None = Field(None, description="For the legend; by default the file's name.")

    @model_validator(mode="after")
    def _one_column_each(self) -> Self:
        for axis, header, column in (("x", self.x, self.x_column), ("y", self.y, self.y_column)):
            if column is not None and (named := roles_of(header) & self.columns.by_role.keys()):
                raise InputError(f"{axis}_column and columns.{min(named)} say the same: one of them is needed")
        return self


def _kept_cycles(value: Any) -> str | tuple[int, ...]:
    """All cycles, the last one, or some by their numbers."""
    if value in ("all", "last"):
        return str(value)
    numbers = value if isinstance(value, list) else []
    if not numbers or any(isinstance(one, bool) or not isinstance(one, int) or one < 1 for one in numbers):
        raise InputError(f'{shown(value)}: "all", "last" or a list of numbers from 1 is needed, such as [1, 10, 100]')
    return tuple(numbers)


KeptCycles = Annotated[
    str | tuple[int, ...],
    PlainValidator(_kept_cycles),
    WithJsonSchema(
        {"anyOf": [{"enum": ["all", "last"]}, {"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 1}]}
    ),
]


class Output(Section):
    """Where the result is given, and noise for making test data."""

    points_per_decade: int = Field(30, ge=1, le=10000, description="Of time, from the start of each step.")
    times: list[Time] | None = Field(None, min_length=1, description="Times since the start, instead of those that suit the load.")
    cycles: KeptCycles | None = Field(
        None,
        description="The cycles of a waveform that the table holds in full, counted from 1 in each step; cycles.csv has a row for "
        "each. By default all up to 100, else 1, 2, 5, 10, 20 and so on, and the last.",
    )
    noise: float | None = Field(None, ge=0, le=1, description="Relative Gaussian noise on the measured quantity.")
    seed: int = Field(1, ge=0, description="Of the noise; the same seed makes the same noise.")

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        if self.times is not None and any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise InputError("times must ascend")
        return self


class Solver(Section):
    """How exactly the equations are solved."""

    rtol: float = Field(1e-6, ge=1e-12, le=1e-2, description="Relative tolerance of each time step.")


class PlotAxes(Section):
    """What the plot shows; columns of the result."""

    x: Annotated[str, AfterValidator(_abscissa)] | None = Field(
        None,
        description="A column of the result, by default time [s], or what is compared; or a swept key, such as step.0.voltage.",
    )
    y: ResultColumn | None = Field(
        None, description="A column of the result; by default what the kind predicts, or what is compared."
    )
    join: Literal["times", "cases"] | None = Field(
        None,
        description="What a line joins: the times of a case; or all cases, at their end, or with output.times a line for each "
        "time, as isochrones. By default cases where x is a swept key, or where it is the same at all of output.times.",
    )
    x_scale: Literal["linear", "log"] | None = Field(
        None, description="By default log for times of relax and creep that go to one load and hold it."
    )
    y_scale: Literal["linear", "log"] = Field("linear", description="Of the vertical axis.")


Sweep = Annotated[
    dict[str, Any],
    WithJsonSchema(
        {
            "type": "object",
            "properties": {
                "mode": {
                    "anyOf": [{"const": "zip"}, {"type": "array"}],
                    "description": '"zip" pairs the lists: the first values of all make one case, the second ones the next. A list '
                    "is one of values of the key mode.",
                }
            },
            "additionalProperties": True,
        }
    ),
]


class SimulationRecipe(RecipeBase):
    """What every simulation has; `COLUMNS` are those of its result that can be drawn."""

    COLUMNS: ClassVar[tuple[str, ...]] = COLUMNS

    material: InputFile = Field(description="A material file, written by spectrum or by hand.")
    temperature: Temperature | None = Field(None, description="Default: the material's reference temperature.")
    load: InputFile | None = Field(None, description="A TOML file that holds the steps instead.")
    sweep: Sweep | None = Field(None, description="Lists of values by key path; every combination is one case.")
    compare: list[Comparison] = Field([], description="Measured points over the plot; their misfit goes into the summary.")
    output: Output = Field(Output(), description="Where the result is given.")
    solver: Solver = Field(Solver(), description="How exactly the equations are solved.")
    plot: PlotAxes = Field(PlotAxes(), description="What the plot shows.")
    uncertainty: Uncertainty | None = Field(None, description="Intervals about all results, from draws of the material.")

    @model_validator(mode="after")
    def _cases_to_join(self) -> Self:
        if self.plot.join == "cases" and (not self.sweep or self.plot.x in (None, "time [s]")):
            raise InputError('join = "cases" needs a [sweep], and an x that is not the time', key="plot")
        if self.plot.join == "times" and self.plot.x in {shown_path(read_path(key) or (key,)) for key in self.sweep or ()}:
            raise InputError(f'join = "times": over {self.plot.x} there are cases alone', key="plot")
        return self


class Aim(NamedTuple):
    """The `value` of a quantity that a step goes to, and the rate at which, if that is stated; a stretch has no `unit`."""

    quantity: str
    value: float
    rate: float | None
    unit: str = ""

    def missed(self, present: float | None) -> str | None:
        """What is wrong with a rate that never leads here from `present`, which is None where the recipe does not tell."""
        if self.rate == 0:
            return f"rate 0 never reaches the {self.quantity if self.unit else 'target'}"
        move = 0.0 if present is None else self.value - present
        # what is reached already, but for rounding, can be reached at any rate
        if self.rate is None or move * self.rate >= 0 or abs(move) <= 1e-12 * abs(self.value):
            return None
        strain = self.quantity == "stretch" and self.value < 1 <= (present or 0.0)
        hint = f"; a stretch is 1 + strain: if {self.value:g} is a strain, write {1 + self.value:g}" if strain else ""
        return wrong_way(self.rate, move, self.quantity, self.unit) + hint


OF_A_TABLE = ("columns", "sheet")
"""Keys of a step that go with its table."""


class HistoryStep(Section):
    """A step holds for a time, follows a table, or goes to a target at a rate, within a duration, or at once."""

    hold: PositiveTime | None = Field(None, description="Keep what is there for so long.")
    table: InputFile | None = Field(
        None,
        description="Follow measured points: columns time and the prescribed quantity, or what a testing machine writes for it.",
    )
    duration: Time | None = Field(None, description="Time to reach the target, instead of rate; with neither: at once.")
    waveform: Literal["triangle", "sine"] | None = Field(None, description="Cycles between low and high, starting from low.")
    period: PositiveTime | None = Field(None, description="Of a waveform.")
    cycles: int | None = Field(None, ge=1, le=1_000_000, description="Of a waveform; by default 1.")
    sheet: SheetName | None = Field(None, description="Of a table that is a workbook; left out: the first.")

    def aim(self) -> Aim | None:
        """Where the step goes, if the recipe says so."""
        return None

    def details(self) -> tuple[str, ...]:
        """Keys that go with a waveform."""
        return ("low", "high", "period", "cycles")

    @model_validator(mode="after")
    def _whole_waveform(self) -> Self:
        stated = [key for key in self.details() if getattr(self, key) is not None]
        if self.waveform is None and stated:
            raise InputError(f"{stated[0]} goes with waveform")
        if self.waveform is not None and (missing := [key for key in ("high", "period") if key not in stated]):
            raise InputError(f"a waveform needs {' and '.join(missing)}")
        return self

    @model_validator(mode="after")
    def _one_action(self) -> Self:
        known = [key for key in type(self).model_fields if key not in ("rate", "duration", *OF_A_TABLE, *self.details())]
        actions = [key for key in known if getattr(self, key) is not None]
        paces = [key for key in ("rate", "duration") if getattr(self, key, None) is not None]
        if len(actions) != 1:
            found = f", not {' and '.join(actions)} together" if actions else ""
            raise InputError(f"one of {', '.join(known)} is needed{found}")
        if actions[0] in ("hold", "table", "waveform") and paces:
            raise InputError(f"{paces[0]} does not go with {actions[0]}")
        if len(paces) > 1:
            raise InputError("rate and duration do not go together")
        for key in OF_A_TABLE:
            if getattr(self, key, None) is not None and self.table is None:
                raise InputError(f"{key} is about a table")
        return self


def starting(start: float) -> AfterValidator:
    """Steps from `start` on, every rate of which leads to its target, as far as the recipe tells where a step begins."""

    def check(steps: list[Step]) -> list[Step]:
        wrong = Mistakes()
        present: dict[str, float] | None = None  # by quantity; at first all are at the start
        for index, step in enumerate(steps):
            if step.hold is not None:
                continue
            aim = step.aim()
            if aim is not None:
                told = aim.missed(start if present is None else present.get(aim.quantity))
                if told is not None:
                    wrong.append(Problem(told, key=f"[{index}]"))
            # where a table or a waveform ends is not asked
            present = {} if aim is None else {aim.quantity: aim.value}
        wrong.refuse()
        return steps

    return AfterValidator(check)


class StretchStep(HistoryStep):
    """A step of prescribed stretch."""

    stretch: Stretch | None = Field(None, description="Stretch to reach (1 is undeformed).")
    rate: StrainRate | None = Field(None, description="Of the stretch; negative to unload.")
    low: Stretch | None = Field(None, description="Of a waveform; by default 1.")
    high: Stretch | None = Field(None, description="Of a waveform.")
    columns: MachineColumns | None = Field(None, description="Columns of the table, where they are called otherwise.")

    def aim(self) -> Aim | None:
        """The stretch."""
        return None if self.stretch is None else Aim("stretch", self.stretch, self.rate)


def _load_rate(value: Any) -> tuple[float, str]:
    """A force or stress rate and its unit."""
    for dimension in (FORCE_RATE, STRESS_RATE):
        try:
            return parse(value, dimension), dimension.unit
        except InputError:
            continue
    if isinstance(value, str) and (comma := decimal_comma(value)):
        raise InputError(f"{shown(value)}: a force or stress rate is needed; {comma}")
    raise InputError(f'{shown(value)}: a force or stress rate is needed, such as "{FORCE_RATE.example}" or "{STRESS_RATE.example}"')


def _load(value: Any) -> tuple[float, str]:
    """A force or stress and its unit."""
    for dimension in (FORCE, STRESS):
        try:
            return parse(value, dimension), dimension.unit
        except InputError:
            continue
    raise InputError(f'{shown(value)}: a force or a stress is needed, such as "{FORCE.example}" or "{STRESS.example}"')


LoadValue = Annotated[
    tuple[float, str],
    PlainValidator(_load),
    WithJsonSchema({"type": "string", "examples": [FORCE.example, STRESS.example]}),
]
LoadRate = Annotated[
    tuple[float, str],
    PlainValidator(_load_rate),
    WithJsonSchema({"type": "string", "examples": [FORCE_RATE.example, STRESS_RATE.example]}),
]


class LoadStep(HistoryStep):
    """A step of prescribed force or nominal stress."""

    force: Force | None = Field(None, description="Force to reach; needs the specimen.")
    stress: Stress | None = Field(None, description="Nominal stress to reach.")
    rate: LoadRate | None = Field(None, description="Of the force or the stress; negative to unload.")
    low: LoadValue | None = Field(None, description="Of a waveform, a force or a nominal stress; by default 0.")
    high: LoadValue | None = Field(None, description="Of a waveform.")
    columns: MachineColumns | None = Field(None, description="Columns of the table, where they are called otherwise.")

    def aim(self) -> Aim | None:
        """The force or the stress."""
        rate = None if self.rate is None else self.rate[0]
        if self.force is not None:
            return Aim("force", self.force, rate, FORCE.unit)
        return None if self.stress is None else Aim("stress", self.stress, rate, STRESS.unit)

    @model_validator(mode="after")
    def _one_quantity(self) -> Self:
        if self.low is not None and self.high is not None and self.low[1] != self.high[1]:
            raise InputError("low and high of a waveform must both be forces, or both stresses")
        return self

    @model_validator(mode="after")
    def _rate_of_the_target(self) -> Self:
        if self.rate is not None:
            needed: Dimension = FORCE_RATE if self.force is not None else STRESS_RATE
            if self.rate[1] != needed.unit:
                target = "force" if self.force is not None else "stress"
                raise InputError(f'{needed.name} is needed with {target}, such as "{needed.example}"', key="rate")
        return self


Mode = Literal["uniaxial", "equibiaxial", "pure-shear"]


class RelaxRecipe(SimulationRecipe):
    """Prescribed stretch -> stress."""

    COLUMNS: ClassVar = (*COLUMNS, "relaxation_modulus [Pa]")

    kind: Literal["relax"] = Field(description="The subcommand that runs this recipe.")
    mode: Mode = Field("uniaxial", description="How the specimen is stretched.")
    specimen: Specimen | None = Field(None, description="What extension and force in tables were measured on.")
    step: Annotated[list[StretchStep], starting(1.0)] = Field(min_length=1, description="What happens, step by step.")


class CreepRecipe(SimulationRecipe):
    """Prescribed force or nominal stress -> stretch."""

    kind: Literal["creep"] = Field(description="The subcommand that runs this recipe.")
    mode: Mode = Field("uniaxial", description="How the specimen is loaded.")
    specimen: Specimen | None = Field(None, description="What force and extension are of; not needed with stress.")
    step: Annotated[list[LoadStep], starting(0.0)] = Field(min_length=1, description="What happens, step by step.")

    @model_validator(mode="after")
    def _a_section_for_forces(self) -> Self:
        for index, step in enumerate(self.step):
            forced = "high" if step.high is not None and step.high[1] == FORCE.unit else "force"
            if (step.force is not None or forced == "high") and unmeasured(("force",), self.specimen):
                needed = "a force needs [specimen] with width and thickness, or state stress"
                raise InputError(needed, key=f"step[{index}].{forced}")
        return self
