"""`[uncertainty]` of simulations: how many draws, and what scatters from film to film."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.material.scatter import DamageScatter, NormalScatter, Scatter, WeibullScatter, fewest_draws
from dielast.recipe.fields import Area, Section, Share

SENSITIVITY_TEXT = (
    "Whether to write sensitivity.csv and its figure: what drives the time to failure. With [uncertainty], the share that each "
    "source (spectrum, shift, springs, permittivity, breakdown field, thickness and so on, as far as the draws differ in it) has "
    "in the variance of the log life, first-order and total, with standard errors; it takes as many films more as there are draws "
    "for each source. Without, the derivative of the log life by the log of each number."
)
DrawCount = Annotated[int, Field(ge=2, le=100_000)]
Level = Annotated[float, Field(gt=0, lt=1)]


class Uncertainty(Section):
    """How many draws of the material are simulated, and what interval of them is told."""

    ELSEWHERE: ClassVar = dict.fromkeys(
        ("breakdown_field", "thickness", "damage"),
        "relax and creep draw the material alone; films scatter in actuate and failure-map",
    )

    draws: DrawCount = Field(
        200,
        description="How many draws of the material to use, the first ones of its table; at most all of them. An interval of "
        "level 0.9 takes at least 19.",
    )
    seed: int = Field(1, ge=0, description="Of random numbers; of no effect here, where draws come from the material's table.")
    level: Level = Field(0.9, description="Probability that an interval holds.")

    @model_validator(mode="after")
    def _enough(self) -> Self:
        if self.draws < (fewest := fewest_draws(self.level)):
            wrong = f"{self.draws} do not tell an interval of level {self.level:g}: at least {fewest} are needed"
            raise InputError(wrong, key="draws")
        return self


class FieldScatter(Section):
    """How the breakdown field scatters from film to film."""

    law: Literal["weibull", "normal"] = Field(description="The distribution.")
    shape: float | None = Field(
        None, gt=0, allow_inf_nan=False, description="Of Weibull's distribution, whose scale is the breakdown field stated."
    )
    relative: Share | None = Field(
        None, description="Standard deviation of the normal distribution over its mean, the field stated."
    )

    @model_validator(mode="after")
    def _number_of_the_law(self) -> Self:
        needed, other = ("shape", "relative") if self.law == "weibull" else ("relative", "shape")
        if getattr(self, needed) is None:
            raise InputError(f'law "{self.law}" needs {needed}')
        if getattr(self, other) is not None:
            raise InputError(f'law "{self.law}" does not take {other}')
        return self

    def scatter(self) -> Scatter:
        """The distribution."""
        return WeibullScatter(self.shape) if self.shape is not None else NormalScatter(self.relative or 0.0)


class DamageAtFailure(Section):
    """How the damage at which films fail scatters: a share 1 - exp(-(area/reference_area) D^shape) of them has failed at D."""

    shape: float = Field(gt=0, allow_inf_nan=False, description="Of Weibull's distribution of the damage.")
    area: Area | None = Field(
        None, description="Of the electrode, on the undeformed film; left out: that for which the constants of [damage] hold."
    )
    reference_area: Area | None = Field(
        None, description="Of the electrodes for which the constants of [damage] hold, undeformed as well."
    )

    @model_validator(mode="after")
    def _two_areas(self) -> Self:
        if (self.area is None) != (self.reference_area is None):
            raise InputError("area and reference_area belong together: state both or none")
        return self

    def scatter(self) -> DamageScatter:
        """The distribution."""
        return DamageScatter(self.shape, (self.area or 1.0) / (self.reference_area or 1.0))


class FilmUncertainty(Uncertainty):
    """The same for films under voltage, which scatter too."""

    draws: DrawCount = Field(
        200,
        description="How many films to draw. They are of the draws of the material in the order of its table, and of some of these "
        "again, chosen at random, if that is not enough; where nothing else scatters, at most all of the table are used. "
        "An interval of level 0.9 takes at least 19; bounds of an event that happens in some draws only need as many in which it "
        "happens, else they are empty.",
    )
    seed: int = Field(
        1,
        ge=0,
        description="Of the random numbers for breakdown_field, thickness and damage, and for draws of the material that are used "
        "again; without these it has no effect.",
    )
    level: Level = Field(
        0.9,
        description="Probability that an interval holds. A time without upper bound may be never; voltage, stretches and field of "
        "an event are told of the films to which it happens. Over time, a film that has failed counts as beyond every upper bound "
        "of stretches and field, and every lower one of stress and stability: where too many have failed, there is no such bound.",
    )
    breakdown_field: FieldScatter | None = Field(None, description="Scatter of the breakdown field from film to film.")
    thickness: Share | None = Field(
        None, description="Relative standard deviation of the undeformed thickness from film to film, normally distributed."
    )

    damage: DamageAtFailure | None = Field(
        None,
        description="Scatter of the damage at failure from film to film; left out: that of the breakdown field is one of the "
        "field of [damage], too.",
    )

    def scatter(self) -> dict[str, Scatter | DamageScatter]:
        """The distributions by what has them."""
        field = None if self.breakdown_field is None else self.breakdown_field.scatter()
        thickness = None if self.thickness is None else NormalScatter(self.thickness)
        damage = None if self.damage is None else self.damage.scatter()
        known = {"breakdown_field": field, "thickness": thickness, "damage": damage}
        return {name: scatter for name, scatter in known.items() if scatter is not None}
