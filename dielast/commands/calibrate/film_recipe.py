"""The film of a table of voltage and stretch, and the columns of such a table."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from dielast.base.errors import InputError, placed
from dielast.base.units import NUMBER, STRAIN, TIME, TIMES, VOLTAGE, VOLTAGE_RATE
from dielast.commands.simulation.film_recipe import SHARE_TEXT, FilmSolver, OneFilm, Shares
from dielast.readings.columns_recipe import MachineColumns
from dielast.recipe.fields import Section, Temperature, WithUnit
from dielast.recipe.file_fields import ColumnName

VOLTAGE_COLUMNS = {"voltage": VOLTAGE, "relative_stretch": NUMBER, "area_strain": STRAIN}
"""Columns of actuated films alone."""


def _range(values: tuple[float, ...]) -> tuple[float, ...]:
    """One number, or the least and the largest value."""
    if len(values) > 2 or (len(values) == 2 and not 0 < values[0] < values[1]):
        raise InputError("one value is needed, or two that are above 0 and ascend: the least and the largest")
    return values


RampRates = Annotated[tuple[float, ...], WithUnit(VOLTAGE_RATE, above=0.0, many=True), AfterValidator(_range)]
RelaxTimes = Annotated[tuple[float, ...], WithUnit(TIME, at_least=0.0, within=TIMES, many=True), AfterValidator(_range)]


class TestColumns(MachineColumns):
    """Columns of a table, where they have other names than usual."""

    voltage: ColumnName | None = Field(None, description='Voltage of an actuated film. Default: "voltage".')
    relative_stretch: ColumnName | None = Field(
        None, description="Stretch of an actuated film along axis 1 over that before the voltage; instead of stretch."
    )
    area_strain: ColumnName | None = Field(
        None, description="Relative change of the area of an actuated film since before the voltage; instead of stretch."
    )


class TestFilm(OneFilm):
    """The film whose stretch was measured at voltages."""

    relax: RelaxTimes = Field(  # type: ignore[assignment]
        (0.0,),
        validate_default=False,
        description="Time at constant prestretch before the voltage; or two: unknown between these.",
        json_schema_extra={"default": "0 s"},
    )
    electrode_share: Annotated[Shares, AfterValidator(_range)] | None = Field(
        None, description=f"{SHARE_TEXT} Or two: unknown between these."
    )

    def _check(self) -> None:
        super()._check()
        # the film of a test is not the only one of its recipe: whoever holds it says where it is
        with placed(lambda problem: replace(problem, key=(problem.key or "").removeprefix("film.") or None)):
            self.check_boundary(FilmSolver())


class PredictedFilm(Section):
    """A film whose voltage for a stretch is to be predicted: next_tests.csv ranks possible tests by what they tell of it."""

    film: TestFilm = Field(description="The film.")
    relative_stretch: float = Field(1.2, gt=1, le=10, description="Stretch along axis 1 over that before the voltage.")
    ramp: Annotated[float, WithUnit(VOLTAGE_RATE, above=0.0)] = Field(
        100.0, description="Rate at which the voltage rises.", json_schema_extra={"default": "100 V/s"}
    )
    temperature: Temperature | None = Field(None, description="Temperature of the film. Default: the mean of those of the tests.")

    def _check(self) -> None:
        for key in ("relax", "electrode_share"):
            if len(np.atleast_1d(getattr(self.film, key) or 0.0)) > 1:
                raise InputError("one value is needed: what is unknown has no prediction", key=f"film.{key}")
