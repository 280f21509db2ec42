"""Recipes of `calibrate`."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PlainValidator, ValidationInfo, WithJsonSchema, WrapValidator

from dielast.base.errors import InputError
from dielast.base.units import FORCE, LENGTH, NUMBER, STRAIN, STRESS, TIME
from dielast.commands.calibrate.film_recipe import VOLTAGE_COLUMNS, PredictedFilm, RampRates, TestColumns, TestFilm
from dielast.commands.membrane.recipe import SLACK, Slack
from dielast.commands.simulation.recipe import Cell, LoadingMode
from dielast.commands.simulation.uncertainty_recipe import FittedUncertainty
from dielast.readings.columns_recipe import Specimen
from dielast.recipe.base import RecipeBase, TextTable, units_of
from dielast.recipe.fields import Pair, RelativeDeviation, Section, StrainRate, Temperature, Time, Voltage
from dielast.recipe.file_fields import NAMES_FILES, PATH, InputFile, existing_file

ROLES = {"time": TIME, "stretch": NUMBER, "strain": STRAIN, "extension": LENGTH, "stress": STRESS, "force": FORCE}
ROLES |= VOLTAGE_COLUMNS
ANY_FORM = {"separator", "decimal", "encoding", "skip_rows", "sheet"}
OF_FILMS = {"file", "film", "ramp", "columns", "units", "where", "temperature", "specimen_id", "label", *ANY_FORM}
"""Keys of a voltage test."""


class TestData(TextTable):
    """A table of a testing machine, whose stretch history is simulated and whose stress is compared; a table of voltage and stretch
    of an actuated film, without times; or a recipe of relax, creep or actuate, whose measured points are compared.
    """

    __test__: ClassVar = False  # pytest would take the name for a test

    file: InputFile | None = Field(None, description="The table of the test.")
    recipe: InputFile | None = Field(
        None,
        description="Instead of file: a recipe of relax, creep or actuate with the measured points as [[compare]] over time [s].",
    )
    columns: TestColumns = Field(
        TestColumns(),
        description="Which column holds what: time; stretch, strain or extension; nominal stress or force; of an actuated film, "
        "voltage; stretch, relative_stretch or area_strain.",
    )
    specimen: Specimen | None = Field(None, description="The specimen on which extension and force were measured.")
    units: Annotated[dict[str, str], units_of(**ROLES)] = Field({}, description="Units by column, where the header states none.")
    where: dict[str, Cell] = Field({}, description="Use only the rows where these columns have these values.")
    mode: LoadingMode = Field("uniaxial", description="How the specimen was stretched.")
    temperature: Temperature | None = Field(
        None, description="Temperature of the test. Default: the material's reference temperature."
    )
    rate: StrainRate | None = Field(
        None, description="Rate of the stretch, up and down, for a table without times, which follow from it and the stretches."
    )
    ramp_rate: StrainRate | None = Field(
        None,
        description="Rate of the ramp from rest to the first stretch of a table with times; this stretch is held until the time of "
        "the first point. Default: a ramp that ends at the time of the first point.",
    )
    voltage: Voltage | None = Field(
        None, description="Constant voltage between electrodes on both faces of the specimen; needs specimen.thickness."
    )
    film: TestFilm | None = Field(
        None,
        description="The film of a table of voltage and stretch, which needs no times; the misfit is in voltage at the measured "
        "stretch. Needs ramp.",
    )
    ramp: RampRates | None = Field(
        None,
        description='Rate at which the voltage of the film rises; or two, as in ["10 V/s", "1 kV/s"]: unknown between these, with '
        "a uniform distribution in the logarithm.",
    )
    discard_before: Time = Field(0.0, description="Leave the points before this time of the test out of the misfit.")
    discard: list[Pair[Time]] = Field(
        [],
        description='Leave the points from one time to another out of the misfit, as in [["4.0 s", "4.6 s"]]; the history goes '
        "through them nevertheless.",
    )
    ignore: Literal["ringing", "none"] = Field(
        "ringing",
        description="Points that are left out of the misfit without being stated, with a warning; ringing: where the force swings "
        "as that of no film does, and where a specimen at rest bears a force; none: none.",
    )
    slack: Slack | None = Field(None, description=SLACK)
    specimen_id: str | None = Field(
        None,
        min_length=1,
        description="Name of the specimen: tests of one specimen share its stress factor. Default: another specimen.",
    )
    label: str | None = Field(None, min_length=1, description="Name of the test in tables and figures. Default: its file.")

    def _check(self) -> None:
        super()._check()
        if self.file is None and self.recipe is None:
            raise InputError("either file (a table) or recipe (of relax, creep or actuate) is needed")
        if self.file is not None and self.recipe is not None:
            raise InputError("file and recipe are both stated: remove one of them, or write a [[test]] for each")
        if self.recipe is not None and (other := sorted(self.model_fields_set - {"recipe", "specimen_id", "label"})):
            raise InputError(f"{', '.join(other)}: the recipe of a test states that itself")
        if self.film is not None:
            if other := sorted(self.model_fields_set - OF_FILMS):
                raise InputError(f"{', '.join(other)}: has no effect on a table of voltage and stretch: leave it out")
            if stated := sorted(self.columns.model_fields_set - {"stretch", *VOLTAGE_COLUMNS}):
                raise InputError("has no effect on a table of voltage and stretch: leave it out", key=f"columns.{stated[0]}")
            if self.ramp is None:
                raise InputError('the rate of the voltage is needed, such as ramp = "100 V/s", or a range of it', key="ramp")
        elif self.ramp is not None:
            raise InputError("is the rate of the voltage of a film: state film as well", key="ramp")
        elif stated := [role for role in VOLTAGE_COLUMNS if getattr(self.columns, role) is not None]:
            raise InputError("is a column of an actuated film: state film and ramp as well", key=f"columns.{stated[0]}")
        if self.rate is not None and self.ramp_rate is not None:
            raise InputError(
                "is the rate of the first ramp of a table with times; for a table without times, state rate", key="ramp_rate"
            )
        if self.rate is not None and self.columns.time is not None:
            raise InputError("columns.time and rate both state the times: one of them is needed", key="rate")
        if self.rate is not None and self.rate <= 0:
            raise InputError(
                "a rate above 0 is needed: it holds for loading and, with the opposite sign, for unloading", key="rate"
            )
        for k, (begin, end) in enumerate(self.discard):
            if begin >= end:
                raise InputError(f"from {begin:g} s to {end:g} s: the first time must be the earlier one", key=f"discard[{k}]")
        if self.voltage is not None and (self.specimen is None or self.specimen.thickness is None):
            raise InputError('a field needs the undeformed thickness: specimen = { thickness = "0.5 mm" }', key="voltage")

    @property
    def nominal_field(self) -> float:
        """The voltage over the undeformed thickness in V/m."""
        return 0.0 if self.voltage is None or self.specimen is None else self.voltage / (self.specimen.thickness or 1.0)


# checked with the material, whose constants have units, so that all mistakes of [free] come at once
Value = Annotated[str | float, PlainValidator(lambda value: value), WithJsonSchema({"type": ["string", "number"]})]


class FreeValue(Section):
    """Bounds and prior of a constant, in its unit."""

    min: Value | None = Field(
        None, description="The least value. Default: start/100; for the defaults of other constants see the key free."
    )
    max: Value | None = Field(
        None, description="The greatest value. Default: 100 times start; for the defaults of other constants see the key free."
    )
    start: Value | None = Field(None, description="Where the first fit begins. Default: the prior, or the material's value.")
    prior: Value | None = Field(
        None, description='The expected value, with relative; or "draws": the distribution in the draws of the starting material.'
    )
    relative: RelativeDeviation | None = Field(None, description="Relative standard deviation of the prior.")


class FitOptions(Section):
    """How the fit is done."""

    starts: int = Field(
        8, ge=1, le=1024, description="Number of starting points: start, and points of a Sobol sequence within the bounds."
    )
    specimen_scatter: RelativeDeviation | None = Field(
        None, description="Relative scatter of stress between specimens of the material. Default: estimated, starting from 5 %."
    )
    cross_validation: bool | None = Field(
        None,
        description="Whether each test is predicted from the others. Default: true where several materials are ranked; those of a "
        "single test are ranked by Akaike's criterion, corrected for few points, or by their number of constants where it has no "
        "value.",
    )
    stable_up_to: float | None = Field(
        None, gt=1, description="Stretch up to which the springs must be stable in all modes. Default: the largest of the tests."
    )


def _tried(value: Any) -> Any:
    from dielast.calibration.spring_pairs import pairs_of

    entries = value if isinstance(value, list) else [value]
    if not entries or not all(
        isinstance(name, str) for entry in entries for name in (entry if isinstance(entry, list) else [entry])
    ):
        raise InputError('"all", or a list of laws and of pairs of laws, such as ["gent", ["yeoh", "gent"]], is needed')
    return pairs_of(value)


_NAMES = {"type": "array", "items": {"type": "string"}, "minItems": 1}
_LAWS = {"anyOf": [{"const": "all"}, {"type": "array", "items": {"anyOf": [{"type": "string"}, _NAMES]}, "minItems": 1}]}


class SpringTrials(Section):
    """Laws of springs to try in the place of those of the material."""

    try_: Annotated[list[tuple[str, str]], PlainValidator(_tried), WithJsonSchema(_LAWS)] = Field(
        alias="try",
        description='"all"; or a list of laws, each of which is tried for the equilibrium spring and for the branches, with pairs '
        'such as ["gent", "neo-hookean"], the equilibrium spring first. All pairs are fitted and ranked by cross-validation; the '
        "constants of their shapes are free, between bounds by the stretches of the tests.",
    )


class FittedMaterial(Section):
    """The material file to start from, and the name of the fitted material."""

    file: InputFile | None = Field(None, description="The material file to start from, unless materials states several.")
    name: str | None = Field(None, min_length=1, description="Name of the fitted material. Default: that of the file.")


def _start(value: Any, handler: Any, info: ValidationInfo) -> FittedMaterial:
    """A table, or the file alone."""
    start: FittedMaterial = handler(value if isinstance(value, dict) else {"file": existing_file(value, info)})
    return start


_KEYS = {name: {"type": "string", "description": field.description} for name, field in FittedMaterial.model_fields.items()}
_TABLE = {"type": "object", "properties": _KEYS, "additionalProperties": False}
StartMaterial = Annotated[FittedMaterial, WrapValidator(_start), WithJsonSchema({"anyOf": [PATH, _TABLE]}), NAMES_FILES]


class CalibrateRecipe(RecipeBase):
    """Tests of a testing machine -> a material with intervals."""

    kind: Literal["calibrate"] = Field(description="The subcommand that runs this recipe.")
    material: StartMaterial | None = Field(
        None,
        description="The material file to start from; or a table with the file, and the name of the fitted material, as in "
        '{ file = "start.toml", name = "VHB 4910, lot 7" }; the name alone beside materials.',
    )
    materials: list[InputFile] | None = Field(
        None,
        min_length=1,
        description="Instead of material: material files with different laws, which are fitted side by side and ranked.",
    )
    test: list[TestData] = Field(min_length=1, description="The tests to fit.")
    validate_: list[TestData] = Field([], alias="validate", description="Tests that are only predicted.")
    free: dict[str, FreeValue] = Field(
        description='The constants to fit, by path in the material file, such as "equilibrium.J_lim" = {}; for a list, all its '
        'entries. In braces, all optional: min, max, start, prior and relative, as in { min = "5 kPa", max = "50 kPa" }. Default '
        "of start: the prior, or the value in the material file. Defaults of min and max: start/100 and 100 times start; for a "
        "constant of either sign, three times the larger of the magnitude of start and the shear modulus (1 for a bare number) "
        "below and above start; for a relaxation time without min and max, half-way in log time to the starts of the "
        "neighbouring branches; for an exponent of Ogden's law without them, half-way to the starts of the terms next to it in "
        "size. A value that ends at a bound is warned of."
    )
    springs: SpringTrials | None = Field(None, description="Laws of springs to try in the place of those of the material.")
    prediction: PredictedFilm | None = Field(
        None,
        description="The film whose voltage next_tests.csv and laws.csv are about. Default: a film 1 mm thick under dead load that "
        "is stretched equibiaxially as far, in I1, as the tests were, for a further stretch of 1.2.",
    )
    fit: FitOptions = Field(FitOptions(), description="How the fit is done.")
    uncertainty: FittedUncertainty = Field(FittedUncertainty(), description="Intervals, and draws of the material.")

    def _check(self) -> None:
        if self.start is None and self.materials is None:
            needed = "material = { file = ..., name = ... }, or materials" if self.name else "either material or materials"
            raise InputError(f"{needed} is needed")
        if self.start is not None and self.materials is not None:
            raise InputError("material and materials are both stated: remove one of them; materials ranks several files")
        if not self.free:
            raise InputError('nothing is free: write, for example, "equilibrium.shear_modulus" = {}', key="free")

    @property
    def frees_shift(self) -> bool:
        """Whether a constant of the shift law is free."""
        return any(path.startswith("shift.") for path in self.free)

    @property
    def started_from(self) -> tuple[str, ...]:
        """The material files to start from."""
        return (self.start,) if self.start is not None else tuple(self.materials or ())

    @property
    def start(self) -> str | None:
        """The only material file to start from."""
        return None if self.material is None else self.material.file

    @property
    def name(self) -> str | None:
        """The name of the fitted material, None if it is that of the file."""
        return None if self.material is None else self.material.name
