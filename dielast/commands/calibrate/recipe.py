"""Recipes of `calibrate`."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from dielast.commands.simulation.comparison_recipe import Cell
from dielast.errors import InputError, shown
from dielast.readings.specimen_recipe import MachineColumns, Specimen
from dielast.recipe.base import RecipeBase, TextTable, units_of
from dielast.recipe.fields import Section, Share, StrainRate, Temperature, Voltage
from dielast.recipe.file_fields import InputFile
from dielast.units import FORCE, LENGTH, NUMBER, STRAIN, STRESS, TIME

ROLES = {"time": TIME, "stretch": NUMBER, "strain": STRAIN, "extension": LENGTH, "stress": STRESS, "force": FORCE}


class TestData(TextTable):
    """A test as a testing machine wrote it: its history of stretch is followed, its stress is compared. Or a recipe of relax, creep
    or actuate, whose measured points are compared.
    """

    __test__: ClassVar = False  # no test of the project

    file: InputFile | None = Field(None, description="The table of the test.")
    recipe: InputFile | None = Field(
        None, description="Instead: a recipe of relax, creep or actuate whose [[compare]] over time [s] holds what was measured."
    )
    columns: MachineColumns = Field(
        MachineColumns(), description="Which column is what: time, with stretch, strain or extension, and nominal stress or force."
    )
    specimen: Specimen | None = Field(None, description="What extension and force were measured on.")
    units: Annotated[dict[str, str], units_of(**ROLES)] = Field({}, description="Units that the header does not say.")
    where: dict[str, Cell] = Field({}, description="Use only the rows where these columns have these values.")
    mode: Literal["uniaxial", "equibiaxial", "pure-shear"] = Field("uniaxial", description="How the specimen was stretched.")
    temperature: Temperature | None = Field(None, description="Of the test; left out: the material's reference temperature.")
    rate: StrainRate | None = Field(
        None, description="Of the stretch, up and down, for a table without times: they follow from the stretches, from rest on."
    )
    ramp_rate: StrainRate | None = Field(
        None,
        description="Of the ramp from rest to the first point of a table with times, which is then held until its time; left out: "
        "a straight line leads there.",
    )
    voltage: Voltage | None = Field(
        None, description="Constant, between electrodes on both faces of the specimen from the start on; needs specimen.thickness."
    )
    specimen_id: str | None = Field(
        None, min_length=1, description="Tests of one specimen share the factor by which its stress differs; left out: its own."
    )
    label: str | None = Field(None, min_length=1, description="What tables and figures call the test; by default its file.")

    @model_validator(mode="after")
    def _paced(self) -> Self:
        if (self.file is None) == (self.recipe is None):
            raise InputError("either file (a table) or recipe (of relax, creep or actuate) is needed")
        if self.recipe is not None and (other := sorted(self.model_fields_set - {"recipe", "specimen_id", "label"})):
            raise InputError(f"{', '.join(other)}: the recipe of a test states that itself")
        if self.rate is not None and self.ramp_rate is not None:
            raise InputError("is that of the first ramp in a table with times, rate is for one without", key="ramp_rate")
        if self.rate is not None and self.columns.time is not None:
            raise InputError("columns.time and rate both say when: one of them is needed", key="rate")
        if self.rate is not None and self.rate <= 0:
            raise InputError("a rate above 0 is needed: it is that of loading and, downwards, of unloading", key="rate")
        if self.voltage is not None and (self.specimen is None or self.specimen.thickness is None):
            raise InputError('a field needs the undeformed thickness: specimen = { thickness = "0.5 mm" }', key="voltage")
        return self

    @property
    def nominal_field(self) -> float:
        """The voltage over the undeformed thickness in V/m."""
        return 0.0 if self.voltage is None or self.specimen is None else self.voltage / (self.specimen.thickness or 1.0)


def _value(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError(f'{shown(value)}: a number, or text with a unit such as "26 kPa", is needed')
    return value


Value = Annotated[str | float, PlainValidator(_value), WithJsonSchema({"type": ["string", "number"]})]


class FreeValue(Section):
    """Bounds and prior of a constant, in its unit."""

    min: Value | None = Field(None, description="The least value; by default a hundredth of the start.")
    max: Value | None = Field(None, description="The greatest value; by default a hundred times the start.")
    start: Value | None = Field(None, description="Where the first fit begins; by default the prior or the material's value.")
    prior: Value | None = Field(
        None, description='The value expected, with relative; or "draws": as the draws of the starting material have it.'
    )
    relative: Share | None = Field(None, description="Relative standard deviation of the prior.")


class FitOptions(Section):
    """How the fit is done."""

    starts: int = Field(8, ge=1, le=1024, description="The start stated, and points of a Sobol sequence within the bounds.")
    specimen_scatter: Share | None = Field(
        None, description="Relative scatter of stress between specimens of the material; left out: estimated, 5 % to begin with."
    )
    cross_validation: bool | None = Field(
        None, description="Whether each test is predicted from the others; by default where several materials are ranked."
    )
    stable_up_to: float | None = Field(
        None, gt=1, description="Stretch up to which the springs must be stable in all modes; by default the tests' largest."
    )


class PosteriorOptions(Section):
    """Draws of the material for `[uncertainty]` of simulations."""

    draws: int = Field(200, ge=0, le=10_000, description="How many; 0: none.")
    seed: int = Field(1, ge=0, description="Of the random numbers.")
    level: float = Field(0.9, gt=0, lt=1, description="Probability that an interval holds.")


class CalibrateRecipe(RecipeBase):
    """Tests of a testing machine -> a material with intervals."""

    kind: Literal["calibrate"] = Field(description="The subcommand that runs this recipe.")
    material: InputFile | None = Field(None, description="The material file to start from.")
    materials: list[InputFile] | None = Field(
        None, min_length=1, description="Instead: material files of several laws, which are fitted side by side and ranked."
    )
    test: list[TestData] = Field(min_length=1, description="The tests to fit.")
    validate_: list[TestData] = Field([], alias="validate", description="Tests that are only predicted.")
    free: dict[str, FreeValue] = Field(
        description='What may change, by path in the material file, such as "equilibrium.J_lim" = {}; a list in each entry.'
    )
    fit: FitOptions = Field(FitOptions(), description="How the fit is done.")
    uncertainty: PosteriorOptions = Field(PosteriorOptions(), description="Draws of the material.")

    @model_validator(mode="after")
    def _one_start(self) -> Self:
        if (self.material is None) == (self.materials is None):
            raise InputError("either material or materials is needed")
        if not self.free:
            raise InputError('nothing is free: write, for example, "equilibrium.shear_modulus" = {}', key="free")
        return self

    @property
    def started_from(self) -> tuple[str, ...]:
        """The material files to start from."""
        return (self.material,) if self.material is not None else tuple(self.materials or ())
