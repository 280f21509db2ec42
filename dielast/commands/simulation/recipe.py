"""The keys that recipes of relax, creep and actuate share, and the columns of a result as recipes name them."""

from typing import Annotated, Any, ClassVar, Literal, Self, get_args

from pydantic import AfterValidator, Field, PlainValidator, ValidationInfo, WithJsonSchema

from dielast.base.errors import InputError, shown, shown_path, similar
from dielast.commands.simulation.uncertainty_recipe import Uncertainty
from dielast.handover.material_file import MaterialFile, material_file
from dielast.io.table import split_header
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Floats
from dielast.readings.columns_recipe import STRAINS, STRESSES, MachineColumns, Specimen
from dielast.recipe.base import RecipeBase, TextTable, units_of
from dielast.recipe.fields import AscendingTimes, OneOf, Section, Temperature, on_one_scale
from dielast.recipe.file_fields import InputFile
from dielast.recipe.paths import read_path
from dielast.simulate.quantities import TESTS, Quantity

# arguments of the simulations -> keys of the recipe, except those of steps
KEYS = {
    **{name: name for name in ("material", "temperature", "mode", "voltage", "horizon")},
    **{name: f"output.{name}" for name in ("times", "points_per_decade", "cycles", "profile")},
    **{name: f"film.{name}" for name in ("thickness", "prestretch", "prestretch_rate", "relax", "boundary", "electrode_share")},
    **{"force": "film.force", "width": "film.width", "rtol": "solver.rtol", "mesh_rtol": "solver.mesh_rtol"},
    **{"breakdown_field": "breakdown", "pull_in_timescale": "pull_in.timescale", "stop_at": "stop.at"},
    **{"ramp": "voltage.ramp", "sample": "uncertainty"},
}


MEASURED_AS = {"time [s]": {"time"}, "stretch_1 [1]": {*STRAINS}, "nominal_stress_1 [Pa]": {*STRESSES}}
"""Column of the result -> columns of a testing machine that measure the same."""


def _column(header: str, info: ValidationInfo) -> str:
    """A column of the result; the model of the recipe lists them as `columns`."""
    columns = (info.context or {}).get("columns")
    if columns and header not in columns:
        named = {split_header(column)[0]: column for column in columns}
        near = similar(split_header(header)[0], named)
        hint = f'did you mean "{named[near]}"?' if near else "there are " + ", ".join(columns)
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


ResultColumn = Annotated[str, AfterValidator(_column)]
Abscissa = Annotated[str, AfterValidator(_abscissa)]
"""A column of the result, or a swept key."""


def _cell(value: Any) -> str | int | float:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError(f"{shown(value)}: text or a number is needed")
    return value


Cell = Annotated[str | int | float, PlainValidator(_cell), WithJsonSchema({"type": ["string", "number"]})]
LoadingMode = Annotated[str, OneOf(lambda: [mode.value for mode in Mode])]


class CompareSection(TextTable):
    """Measured points that are drawn over the plot; their misfit goes into the summary."""

    file: InputFile = Field(description="Table of the measured points.")
    x: ResultColumn = Field(description="Column of the result on the horizontal axis, such as time [s].")
    y: ResultColumn = Field(description="Column of the result on the vertical axis, such as nominal_stress_1 [Pa].")
    x_column: str | None = Field(None, description="Column of the file for x, if its name differs.")
    y_column: str | None = Field(None, description="Column of the file for y, if its name differs.")
    columns: MachineColumns = Field(
        MachineColumns(),
        description="Columns of the file for time, extension, force and the like, from which x and y are computed.",
    )
    specimen: Specimen | None = Field(
        None, description="The specimen on which extension and force were measured. Default: the recipe's [specimen]."
    )
    units: Annotated[dict[str, str], units_of(x=None, y=None)] = Field(
        {}, description="Units of x and y, where the header states none."
    )
    where: dict[str, Cell] = Field({}, description="Use only the rows where these columns have these values.")
    case: int = Field(0, ge=0, description="Number of the case that was measured.")
    label: str | None = Field(None, description="Name in the legend. Default: the name of the file.")

    def _check(self) -> None:
        super()._check()
        for axis, header, column in (("x", self.x, self.x_column), ("y", self.y, self.y_column)):
            if column is not None and (named := MEASURED_AS.get(header, set()) & self.columns.by_role.keys()):
                raise InputError(f"{axis}_column and columns.{min(named)} state the same column: one of them is needed")


def _kept_cycles(value: Any) -> str | tuple[int, ...]:
    """All cycles, the last cycle, or cycles by their numbers."""
    if value in ("all", "last"):
        return str(value)
    numbers = value if isinstance(value, list) else []
    if not numbers or any(isinstance(number, bool) or not isinstance(number, int) or number < 1 for number in numbers):
        raise InputError(f'{shown(value)}: "all", "last" or a list of numbers from 1 is needed, such as [1, 10, 100]')
    return tuple(numbers)


KeptCycles = Annotated[
    str | tuple[int, ...],
    PlainValidator(_kept_cycles),
    WithJsonSchema(
        {"anyOf": [{"enum": ["all", "last"]}, {"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 1}]}
    ),
]


class OutputSection(Section):
    """The times of the result, and noise for making test data."""

    points_per_decade: int = Field(
        30, ge=1, le=10000, description="Number of output times per decade of time, from the start of each step."
    )
    times: AscendingTimes | None = Field(
        None,
        description="Output times since the start. Default: points_per_decade, and the ends of all steps. Two rows at one time are "
        "the states before and after: where a load jumps, or a voltage begins to rise and restarts pull_in.timescale.",
    )
    cycles: KeptCycles | None = Field(
        None,
        description="The cycles of a waveform whose course is in the main table, counted from 1 in each step; cycles.csv has a row "
        "for every cycle. Default: all, if there are at most 100; else 1, 2, 5, 10, 20 and so on, and the last.",
    )
    noise: float | None = Field(None, ge=0, le=1, description="Relative Gaussian noise on the measured quantity.")
    seed: int = Field(1, ge=0, description="Seed of the noise; the same seed makes the same noise.")


class Solver(Section):
    """How exactly the equations are solved."""

    rtol: float = Field(1e-6, ge=1e-12, le=1e-2, description="Relative tolerance of each time step.")


class PlotAxes(Section):
    """The columns of the result that the plot shows."""

    x: Abscissa | None = Field(
        None,
        description="Column of the result, or a swept key such as step.0.voltage. Default: x of [[compare]], else time [s].",
    )
    y: ResultColumn | None = Field(
        None, description="Column of the result. Default: y of [[compare]], else the quantity that the command predicts."
    )
    join: Literal["times", "cases"] | None = Field(
        None,
        description="What a line joins: the times of one case; or all cases, at their end or, with output.times, at each of these "
        "times (isochrones). Default: cases if x is a swept key or does not change over output.times, else times.",
    )
    x_scale: Literal["linear", "log"] | None = Field(
        None,
        description="Scale of the horizontal axis. Default: log for the time of a relax or creep test with one load held, else "
        "linear.",
    )
    y_scale: Literal["linear", "log"] = Field("linear", description="Scale of the vertical axis.")


Sweep = Annotated[
    dict[str, Any],
    WithJsonSchema(
        {
            "type": "object",
            "properties": {
                "mode": {
                    "anyOf": [{"const": "zip"}, {"type": "array"}],
                    "description": '"zip" pairs the lists: the first values of all lists make one case, the second values the '
                    "next. A list holds swept values of the key mode.",
                }
            },
            "additionalProperties": True,
        }
    ),
]


class MaterialRecipe(RecipeBase):
    """The keys of every recipe that simulates with a material."""

    material: InputFile = Field(description="Material file, written by spectrum, by calibrate or by hand.")

    @classmethod
    def material_model(cls) -> type[MaterialFile]:
        """The model of the material file."""
        return material_file()


class SimulationRecipe(MaterialRecipe):
    """The keys of relax, creep and actuate; `QUANTITIES` are those of its result, which can be compared and drawn."""

    QUANTITIES: ClassVar[list[Quantity]] = TESTS
    ELSEWHERE: ClassVar = {"sensitivity": "relax and creep have no time to failure; actuate and failure-map take it"}

    temperature: Temperature | None = Field(
        None, description="Temperature of the film or specimen. Default: the material's reference temperature."
    )
    load: InputFile | None = Field(None, description="TOML file that holds the steps, instead of [[step]].")
    sweep: Sweep | None = Field(
        None,
        description="Lists of values by key path in this recipe, or in the material file, such as equilibrium.J_lim; every "
        "combination is one case.",
    )
    compare: list[CompareSection] = Field(
        [], description="Measured points that are drawn over the plot; their misfit goes into the summary."
    )
    output: OutputSection = Field(OutputSection(), description="The times of the result.")
    solver: Solver = Field(Solver(), description="How exactly the equations are solved.")
    plot: PlotAxes = Field(PlotAxes(), description="What the plot shows.")
    uncertainty: Uncertainty | None = Field(None, description="Intervals of the main table, from draws of the material.")

    @classmethod
    def quantities(cls) -> list[Quantity]:
        """The quantities that results of this kind of recipe have."""
        kind = get_args(cls.model_fields["kind"].annotation)
        return [quantity for quantity in cls.QUANTITIES if quantity.only in ("", *kind)]

    @classmethod
    def columns(cls) -> list[str]:
        """The headers of the quantities."""
        return [quantity.header for quantity in cls.quantities()]

    def lacking(self, quantity: Quantity) -> list[str]:
        """What the quantity needs that the recipe does not state."""
        return list(quantity.needs)

    def at_times(self, times: Floats, **changes: Any) -> Self:
        """The recipe with other output times in s, and other values of the keys that are named."""
        output = self.output.model_copy(update={"times": times.tolist()})
        return self.model_copy(update={**changes, "output": output})

    def provided(self) -> list[Quantity]:
        """The quantities in the table of this recipe."""
        return [quantity for quantity in self.quantities() if quantity.written and not self.lacking(quantity)]

    def _check_columns(self) -> None:
        """`InputError` for a column to draw that the result lacks without further keys."""
        drawn = {"plot": self.plot} | {f"compare[{index}]": comparison for index, comparison in enumerate(self.compare)}
        by_header = {quantity.header: quantity for quantity in self.quantities()}
        for key, header in ((f"{place}.{axis}", getattr(axes, axis)) for place, axes in drawn.items() for axis in ("x", "y")):
            if header in by_header and (needed := self.lacking(by_header[header])):
                raise InputError(f'"{header}" needs {needed[0]}', key=key)

    def _check(self) -> None:
        self._check_columns()
        if self.plot.join == "cases" and (not self.sweep or self.plot.x in (None, "time [s]")):
            raise InputError('join = "cases" needs a [sweep] and an x other than time [s]', key="plot")
        if self.plot.join == "times" and self.plot.x in {shown_path(read_path(key) or (key,)) for key in self.sweep or ()}:
            raise InputError(
                f'join = "times" needs a column of the result as x; over the swept key {self.plot.x} state join = "cases"',
                key="plot",
            )
