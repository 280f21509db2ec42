"""Recipes of `design`."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from dielast.commands.simulation.grid_recipe import GridFilm, GridRecipe, distinct
from dielast.errors import InputError
from dielast.material.scatter import fewest_draws
from dielast.recipe.fields import Numbers, PositiveTime, Section, WithUnit
from dielast.simulate.design_plan import AREA_STRAIN, RELATIVE_STRETCH
from dielast.units import LENGTH, STRAIN

Thicknesses = Annotated[tuple[float, ...], WithUnit(LENGTH, above=0.0, many=True), distinct("{:.9g} m".format)]
Stretches = Annotated[tuple[float, ...], Numbers(above=1.0), distinct("{:.9g}".format)]
Strains = Annotated[tuple[float, ...], WithUnit(STRAIN, above=0.0, many=True), distinct("{:.9g}".format)]


class DesignFilm(GridFilm):
    """The films of a design."""

    thickness: Thicknesses = Field(description="Undeformed thickness; a list is an axis of the grid.")  # type: ignore[assignment]


class GoalSection(Section):
    """The goal of each film: a relative stretch, or an area strain."""

    relative_stretch: Stretches | None = Field(
        None, description="Stretch of axis 1 over its prestretch; a list is an axis of the grid."
    )
    area_strain: Strains | None = Field(
        None,
        description="Area strain of the active part against its prestretched area, instead of relative_stretch; a list is an axis "
        "of the grid.",
    )
    at: PositiveTime = Field(description="Time after which the goal is reached under a constant voltage.")
    horizon: PositiveTime = Field(description="Time for which the voltage stays on; a film that lives longer survives.")
    failure_probability: float | None = Field(
        None,
        gt=0,
        lt=0.5,
        description="With [uncertainty]: designs are ranked by the life that this share of their films does not reach. Default: "
        "0.05.",
    )

    def _check(self) -> None:
        if self.relative_stretch is not None and self.area_strain is not None:
            raise InputError(f"{RELATIVE_STRETCH} and {AREA_STRAIN} are two goals: state one of them")
        if self.relative_stretch is None and self.area_strain is None:
            raise InputError(f'a goal is needed: {RELATIVE_STRETCH}, such as 1.1, or {AREA_STRAIN}, such as "20 %"')
        if self.at > self.horizon:
            raise InputError(f"{self.at:g} s is longer than the horizon of {self.horizon:g} s", key="at")


class DesignRecipe(GridRecipe):
    """Which film and which voltage reach a goal, and how long that lasts."""

    ELSEWHERE: ClassVar = {
        "voltage": "design finds the voltage; failure-map has an axis of voltages",
        "horizon": "belongs to the goal: write goal.horizon",
    }

    kind: Literal["design"] = Field(description="The subcommand that runs this recipe.")
    film: DesignFilm = Field(
        description="The films, one for every combination of the lists, and their prestretch before the voltage."
    )
    goal: GoalSection = Field(description="The goal of each film.")

    def _check(self) -> None:
        self.film.check_boundary(self.solver)
        if self.film.boundary == ("clamped", "clamped"):
            raise InputError("both axes are clamped: no voltage moves the film", key="film.boundary")
        if self.film.boundary[0] == "clamped" and self.goal.relative_stretch is not None:
            raise InputError(f"axis 1 is clamped: state goal.{AREA_STRAIN} instead", key=f"goal.{RELATIVE_STRETCH}")
        share = self.goal.failure_probability
        if share is None:
            return
        if self.uncertainty is None:
            raise InputError("needs [uncertainty], which states what scatters", key="goal.failure_probability")
        if self.uncertainty.draws < (fewest := fewest_draws(1 - 2 * share)):
            text = f"{self.uncertainty.draws} draws are too few for this probability: at least {fewest} are needed"
            raise InputError(text, key="goal.failure_probability")
