"""`[uncertainty]` of simulations: how many draws, and what scatters from film to film."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from dielast.base.errors import InputError
from dielast.material.intervals import DrawIntervals, fewest_draws
from dielast.material.scatter import NormalScatter, Scatter, WeibullScatter
from dielast.numerics.arrays import Index
from dielast.recipe.fields import Area, RelativeDeviation, Section

CONFIDENCE = 0.9
SENSITIVITY_TEXT = (
    "Whether to write sensitivity.csv and its figure: what drives the time to failure. With [uncertainty]: the first-order and "
    "total share of each source of scatter (spectrum, shift, springs, permittivity, breakdown field, thickness and so on) in the "
    "variance of the log life, with standard errors; for each source, as many more films are simulated as there are draws. "
    "Without [uncertainty]: the derivative of the log life by the log of each constant."
)
SPECIMENS = Field(
    True,
    description="Whether each draw is another specimen of a calibrated material, with a model that is wrong by as much as the "
    "tests showed: a factor on all moduli with the scatter of [calibrated] in the material file, if it states one. "
    "With false, intervals are those of the material's constants alone.",
)
DrawCount = Annotated[int, Field(ge=2, le=100_000)]
Level = Annotated[float, Field(gt=0, lt=1)]


class FittedUncertainty(Section):
    """Intervals of what is fitted, and draws of the material."""

    draws: int = Field(200, ge=0, le=10_000, description="Number of draws of the material; 0: none.")
    seed: int = Field(1, ge=0, description="Seed of the random numbers.")
    level: float = Field(0.9, gt=0, lt=1, description="Probability that an interval covers.")


class Uncertainty(Section):
    """How many draws of the material are simulated, and the level of the intervals."""

    ELSEWHERE: ClassVar = dict.fromkeys(
        ("breakdown_field", "thickness", "damage"),
        "relax and creep draw only the material; actuate, failure-map and design draw films as well",
    )

    draws: DrawCount = Field(
        200,
        description="Number of draws of the material, from the top of its table. If the table is shorter, draws are used again, "
        "each for another specimen; with specimens = false, at most as many as there are. An interval of level 0.9 needs at "
        "least 19.",
    )
    seed: int = Field(
        1,
        ge=0,
        description="Seed of the random numbers for specimens; without these it has no effect, as all draws come from the "
        "material's table.",
    )
    level: Level = Field(0.9, description="Probability that an interval covers.")
    specimens: bool = SPECIMENS

    def _check(self) -> None:
        if self.draws < (fewest := fewest_draws(self.level)):
            wrong = f"{self.draws} are too few for an interval of level {self.level:g}: at least {fewest} are needed"
            raise InputError(wrong, key="draws")

    def intervals(self, laws: Index | None) -> DrawIntervals:
        """The intervals from draws of these laws (draws,); for films of which a share may fail, with assured lives."""
        return DrawIntervals(self.level, laws)


class FieldScatter(Section):
    """How the breakdown field scatters from film to film."""

    law: Literal["weibull", "normal"] = Field(description="Law of the distribution.")
    shape: float | None = Field(
        None, gt=0, allow_inf_nan=False, description="Shape of the Weibull distribution, whose scale is the stated breakdown field."
    )
    relative: RelativeDeviation | None = Field(
        None, description="Standard deviation of the normal distribution over its mean, which is the stated breakdown field."
    )

    def _check(self) -> None:
        needed, other = ("shape", "relative") if self.law == "weibull" else ("relative", "shape")
        if getattr(self, needed) is None:
            raise InputError(f'law "{self.law}" needs {needed}')
        if getattr(self, other) is not None:
            raise InputError(f'law "{self.law}" does not take {other}')

    def scatter(self) -> Scatter:
        """The distribution."""
        return WeibullScatter(self.shape) if self.shape is not None else NormalScatter(self.relative or 0.0)


class DamageAtFailure(Section):
    """Scatter of the damage at failure: at a damage D a share 1 - exp(-(area/reference_area) D^shape) of the films has failed."""

    shape: float = Field(gt=0, allow_inf_nan=False, description="Shape of the Weibull distribution of the damage at failure.")
    area: Area | None = Field(
        None, description="Area of the electrode on the undeformed film. Default: that for which the constants of [damage] hold."
    )
    reference_area: Area | None = Field(
        None, description="Area, on the undeformed film, of the electrodes for which the constants of [damage] hold."
    )

    def _check(self) -> None:
        if (self.area is None) != (self.reference_area is None):
            raise InputError("area and reference_area belong together: state both or none")

    def scatter(self) -> WeibullScatter:
        """The distribution."""
        return WeibullScatter(self.shape, (self.area or 1.0) / (self.reference_area or 1.0))


class FilmUncertainty(Uncertainty):
    """`[uncertainty]` of films under voltage: draws of the material, and scatter from film to film."""

    draws: DrawCount = Field(
        200,
        description="Number of films to draw. They take the draws of the material from the top of its table, then some of these "
        "draws again, chosen at random, if the table is too short; where only the material scatters, each draw is "
        "used once at most. An interval of level 0.9 needs at least 19 draws; bounds of an event need 19 draws in "
        "which it happens, else they are empty.",
    )
    seed: int = Field(
        1,
        ge=0,
        description="Seed of the random numbers for specimens, breakdown_field, thickness and damage, and for the draws of the "
        "material that are used again; without these it has no effect.",
    )
    level: Level = Field(
        0.9,
        description="Probability that an interval covers. A time without an upper bound may be infinite. Intervals of the voltage, "
        "stretches and field at an event are those of the films in which it happens. In tables over time, a film that has failed "
        "counts as above every upper bound of stretch and field, and as below every lower bound of stress and stability; where too "
        "many films have failed, the bound is empty.",
    )
    breakdown_field: FieldScatter | None = Field(None, description="Scatter of the breakdown field from film to film.")
    thickness: RelativeDeviation | None = Field(
        None, description="Relative standard deviation of the undeformed thickness from film to film, with a normal distribution."
    )

    damage: DamageAtFailure | None = Field(
        None,
        description="Scatter of the damage at failure from film to film. Default: the field of [damage] scatters with the "
        "breakdown field.",
    )

    area: Area | None = Field(
        None,
        description="Area of the electrode on the undeformed film, for a material whose [breakdown] or [damage] states shape and "
        "reference_area. Default: the reference area.",
    )
    failure_share: RelativeDeviation | None = Field(
        None,
        description='Share of films, such as "10 %": instead of films at random, every draw is the film before which this share of '
        "the films of its material fails. The intervals are then those of the life that this share does not reach, with level as "
        "confidence.",
    )
    confidence: float | None = Field(
        None,
        gt=0.5,
        lt=1,
        description="With failure_share: confidence with which the other films exceed the column assured_life, over the draws of "
        "the material. Default: 0.9.",
    )

    def _check(self) -> None:
        super()._check()
        if self.confidence is None:
            return
        if self.failure_share is None:
            raise InputError('needs failure_share, such as "5 %": the share of films that may fail before', key="confidence")
        if self.draws < (fewest := fewest_draws(2 * self.confidence - 1)):
            raise InputError(f"{self.draws} draws are too few for it: at least {fewest} are needed", key="confidence")

    def intervals(self, laws: Index | None) -> DrawIntervals:
        """The intervals from draws of these laws (draws,); with a failure_share, lives are assured that the other films exceed."""
        return DrawIntervals(self.level, laws, None if self.failure_share is None else self.confidence or CONFIDENCE)

    def scatter(self) -> dict[str, Scatter]:
        """The distributions by the quantity that scatters."""
        stated = {"breakdown_field": self.breakdown_field, "damage": self.damage}
        scatter = {name: section.scatter() for name, section in stated.items() if section is not None}
        return scatter if self.thickness is None else scatter | {"thickness": NormalScatter(self.thickness)}
