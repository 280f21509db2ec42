"""Recipes of `lifetime`."""

from typing import Annotated, Literal

from pydantic import Field

from dielast.base.errors import InputError
from dielast.base.units import AREA, LENGTH, MOLAR_ENERGY, NUMBER, STRAIN, TEMPERATURE, TIME, VOLTAGE, VOLTAGE_RATE
from dielast.calibration.failures.law_names import DAMAGE_LAWS, LAWS
from dielast.commands.grids.recipe import VoltageAxis
from dielast.commands.simulation.film_recipe import SHARE_TEXT, FilmBase, FilmSolver, Prestretch, PullInSection, Share
from dielast.commands.simulation.recipe import Cell
from dielast.commands.simulation.uncertainty_recipe import FittedUncertainty
from dielast.material.material import Material
from dielast.readings.columns_recipe import NamedColumns
from dielast.recipe.base import RecipeBase, TextTable, units_of
from dielast.recipe.fields import Area, Numbers, OneOf, PositiveTime, RelativeDeviation, Section, Temperature, Voltage, WithUnit
from dielast.recipe.file_fields import ColumnName, InputFile

QUANTITIES = {
    **{"voltage": VOLTAGE, "time": TIME, "ramp": VOLTAGE_RATE, "intact": TIME, "prestretch": NUMBER, "prestretch_2": NUMBER},
    **{"temperature": TEMPERATURE, "thickness": LENGTH, "area": AREA, "humidity": STRAIN},
}
"""The dimension of the numbers in a column by its role."""
TEXTS = ("suspended", "specimen", "batch", "mode", "recipe")
RelativeHumidity = Annotated[float, WithUnit(STRAIN, above=0.0)]
ONE_LAW = Annotated[str, OneOf(lambda: list(LAWS))]


class FailureColumns(NamedColumns):
    """Columns of the table of specimens, where they are not called as their role. Cells that do not apply are empty."""

    voltage: ColumnName | None = Field(None, description="Constant voltage, or voltage at failure in a ramp.")
    time: ColumnName | None = Field(
        None,
        description="Time from the beginning of the voltage to failure, or to the end of the test. Empty: at the end of the ramp.",
    )
    ramp: ColumnName | None = Field(
        None, description="Rate at which the voltage rises to the voltage of the row. Default: the voltage comes at once."
    )
    recipe: ColumnName | None = Field(
        None,
        description="Recipe of actuate with the programme of the specimen, [[step]], relative to this recipe; instead of voltage.",
    )
    suspended: ColumnName | None = Field(
        None,
        description="Whether the specimen has not failed, or failed otherwise: yes, true, 1, running or suspended; no, false, 0, "
        "failed or empty.",
    )
    intact: ColumnName | None = Field(
        None, description="Time at which a specimen that was found failed at the time of its row was last seen intact."
    )
    prestretch: ColumnName | None = Field(None, description="Prestretch, equibiaxial or of axis 1. Default: film.prestretch.")
    prestretch_2: ColumnName | None = Field(None, description="Prestretch of axis 2. Default: that of axis 1.")
    temperature: ColumnName | None = Field(None, description="Temperature of the specimen. Default: temperature.")
    thickness: ColumnName | None = Field(None, description="Thickness of the undeformed film. Default: film.thickness.")
    area: ColumnName | None = Field(None, description="Area of the electrode on the undeformed film.")
    humidity: ColumnName | None = Field(None, description="Relative humidity.")
    specimen: ColumnName | None = Field(None, description="Name of the specimen. Default: its number.")
    batch: ColumnName | None = Field(None, description="Name of its batch; the strength of each batch has a factor.")
    mode: ColumnName | None = Field(
        None, description="Kind of failure: each kind is fitted apart, with failures of other kinds as suspended."
    )


class FailureData(TextTable):
    """The table of specimens, a row for each."""

    file: InputFile = Field(description="The table.")
    columns: FailureColumns = Field(FailureColumns(), description="Which column holds what.")
    units: Annotated[dict[str, str], units_of(**QUANTITIES)] = Field(
        {}, description="Units by column, where the header states none."
    )
    where: dict[str, Cell] = Field({}, description="Use only the rows where these columns have these values.")


class TestedFilm(FilmBase):
    """The films of the specimens."""

    prestretch: Prestretch | None = Field(None, description="Equibiaxial prestretch, or a pair. Default: the column prestretch.")
    electrode_share: Share | None = Field(None, description=SHARE_TEXT)

    @property
    def prestretches(self) -> tuple[tuple[float, float], ...]:
        """The prestretch, if it is stated."""
        return () if self.prestretch is None else (self.prestretch,)


class FitOptions(Section):
    """The law of failure and its scatter. Constants that are stated here are known and not fitted."""

    law: ONE_LAW | None = Field(
        None,
        description="Law of the breakdown field: table (over prestretch) or power (of stretch and thickness); or law of damage: "
        "inverse-power or eyring. Default: table.",
    )
    laws: list[ONE_LAW] | None = Field(None, min_length=1, description="Instead of law: several, which are ranked by likelihood.")
    scatter: Literal["weibull", "normal"] = Field("weibull", description="Scatter of strength from film to film.")
    prestretch: Annotated[tuple[float, ...], Numbers(at_least=1.0)] | None = Field(
        None, description="table: prestretches of the entries, ascending. Default: those of all specimens that failed."
    )
    time: PositiveTime = Field(3600.0, validate_default=False, description="damage: time for which damage.field is withstood.")
    shape: float | None = Field(None, gt=0, description="Shape of the Weibull scatter, if known; needed where nothing has failed.")
    relative: RelativeDeviation | None = Field(None, description="Relative standard deviation of normal scatter, if known.")
    exponent: float | None = Field(None, gt=0, description="Exponent of inverse-power, if known; needed where nothing has failed.")
    stretch_exponent: float | None = Field(None, description="Exponent of the stretch of power, if known.")
    thickness_exponent: float | None = Field(
        None, ge=0, description="Exponent of the thickness of power, if known. Default: 0 if all films have one thickness."
    )
    activation_energy: Annotated[float, WithUnit(MOLAR_ENERGY)] | None = Field(
        None, description="Activation energy of the life, if known. Default: fitted if temperatures differ."
    )
    reference_area: Area | None = Field(
        None, description="Area for which the constants hold, if areas are in the table. Default: their geometric mean."
    )
    reference_humidity: RelativeHumidity | None = Field(
        None, description="Relative humidity for which the constants hold, if the table has it. Default: its geometric mean."
    )
    mode: str | None = Field(None, description="Kind of failure whose law goes into material.toml. Default: the most frequent one.")

    def _check(self) -> None:
        if self.law is not None and self.laws is not None:
            raise InputError("law and laws are both stated: remove one of them; laws ranks several")
        if len(set(self.ranked)) < len(self.ranked):
            raise InputError("a law is stated twice", key="laws")
        if self.scatter == "normal" and (damage := [law for law in self.ranked if law in DAMAGE_LAWS]):
            raise InputError(f'{damage[0]}: damage scatters by Weibull\'s law: state scatter = "weibull"', key="scatter")

    @property
    def ranked(self) -> tuple[str, ...]:
        """The laws to fit."""
        return tuple(self.laws or (self.law or "table",))

    @property
    def known(self) -> dict[str, float]:
        """Constants that are not fitted."""
        keys = ("shape", "relative", "exponent", "stretch_exponent", "thickness_exponent")
        known = {key: value for key in keys if (value := getattr(self, key)) is not None}
        return known if self.activation_energy is None else known | {"activation_energy": self.activation_energy / 1e4}


class LifeAxis(VoltageAxis):
    """The constant voltages for which lives are stated. Default: those of the tests."""

    horizon: PositiveTime | None = Field(None, description="Longest life that is stated. Default: 100 times the longest test.")

    def _check(self) -> None:
        if self.values is not None or self.start is not None or self.to is not None or self.points is not None:
            super()._check()


class PlanSection(Section):
    """Tests that would show a goal, if none of their specimens fails."""

    life: PositiveTime = Field(description="Life that is to be shown.")
    voltage: Voltage = Field(description="Constant voltage of the life, and of the tests.")
    prestretch: Prestretch | None = Field(
        None, description="Prestretch of the films. Default: film.prestretch, or that of most specimens."
    )
    failure_share: RelativeDeviation = Field(
        0.1, validate_default=False, description='Share of films that may fail before, such as "10 %".'
    )
    confidence: float = Field(0.9, gt=0, lt=1, description="Confidence that no more of them do.")


class LifetimeRecipe(RecipeBase):
    """Measured failures -> a material with a breakdown field or damage."""

    kind: Literal["lifetime"] = Field(description="The subcommand that runs this recipe.")
    material: InputFile = Field(description="Material file: how the films creep. Its laws of failure are replaced.")
    temperature: Temperature | None = Field(
        None, description="Temperature of specimens without one of their own. Default: the material's reference temperature."
    )
    film: TestedFilm = Field(description="The films of the specimens, and their treatment before the voltage.")
    data: FailureData = Field(description="The specimens.")
    fit: FitOptions = Field(FitOptions(), description="The law of failure and its scatter.")
    life: LifeAxis = Field(LifeAxis(), description="The voltages for which lives are stated.")
    plan: PlanSection | None = Field(None, description="Tests that would show a goal.")
    pull_in: PullInSection = Field(default_factory=PullInSection, description="The pull-in criterion.")
    solver: FilmSolver = Field(FilmSolver(), description="How exactly the equations are solved.")
    uncertainty: FittedUncertainty = Field(FittedUncertainty(), description="Intervals, and draws of the material.")

    def usual_temperature(self, material: Material) -> float:
        """That in degC of specimens without one of their own."""
        return material.reference_temperature if self.temperature is None else self.temperature

    def _check(self) -> None:
        self.film.check_boundary(self.solver)
