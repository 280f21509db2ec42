"""The grid of films in recipes of failure-map and design."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from dielast.commands.simulation.film_recipe import (
    ONE_PRESTRETCH,
    SHARE_TEXT,
    FilmBase,
    FilmSolver,
    PullInSection,
    Shares,
    prestretch_of,
)
from dielast.commands.simulation.recipe import MaterialRecipe
from dielast.commands.simulation.uncertainty_recipe import FilmUncertainty
from dielast.errors import InputError
from dielast.handover.law_section import BreakdownField, breakdown
from dielast.recipe.fields import Temperatures
from dielast.simulate.options import Failure, Solver

if TYPE_CHECKING:
    from dielast.material.scatter import Sample
    from dielast.simulate.film_setup import Film

Value = TypeVar("Value")


def _prestretches(value: Any) -> tuple[tuple[float, float], ...]:
    """The prestretches of a grid; a list is its axis."""
    entries = value if isinstance(value, list) else [value]
    if not entries:
        raise InputError("a list of prestretches is needed, such as [1.7, 1.9]")
    return tuple(prestretch_of(entry) for entry in entries)


def _spelled(pair: tuple[float, float]) -> str:
    return f"{pair[0]:.9g}" if pair[0] == pair[1] else f"{pair[0]:.9g} x {pair[1]:.9g}"


def distinct(spelled: Callable[[Value], str]) -> AfterValidator:
    """The axis of a grid, whose values differ in the digits that tables show, in which they are `spelled`."""

    def check(values: tuple[Value, ...]) -> tuple[Value, ...]:
        texts = set[str]()
        for text in map(spelled, values):
            if text in texts:
                raise InputError(f"{text} is stated twice: the values of a list must differ")
            texts.add(text)
        return values

    return AfterValidator(check)


Prestretches = Annotated[
    tuple[tuple[float, float], ...],
    PlainValidator(_prestretches),
    distinct(_spelled),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "array", "items": ONE_PRESTRETCH, "minItems": 1}]}),
]
GridTemperatures = Annotated[Temperatures, distinct("{:.9g} degC".format)]
GridShares = Annotated[Shares, distinct("{:.9g}".format)]


class GridFilm(FilmBase):
    """The films of a grid."""

    prestretch: Prestretches = Field(description="Equibiaxial prestretches, or pairs; a list is an axis of the grid.")
    electrode_share: GridShares | None = Field(None, description=SHARE_TEXT + " A list is an axis of the grid.")

    @property
    def sizes(self) -> tuple[int, int, int]:
        """The numbers of thicknesses, prestretches and electrode shares."""
        return len(self.thicknesses), len(self.prestretch), len(self.shares or (1,))

    def at(self, temperatures: Sequence[float]) -> Film:
        """The films at temperatures in degC."""
        shares = None if self.shares is None else np.array(self.shares)
        sizes = {"thickness": np.array(self.thickness), "prestretch": np.array(self.prestretch), "electrode_share": shares}
        return self.setup(**sizes, temperature=np.array(temperatures))


class GridSolver(FilmSolver):
    """How exactly the equations of a grid of films are solved."""

    rtol: float = Field(
        1e-6,
        ge=1e-12,
        le=1e-2,
        description="Relative tolerance of each time step. Default: 1e-6; for draws of [uncertainty] 5e-4, which leaves an error "
        "of 0.1 % in their times: state rtol where the bounds are closer together than that.",
    )


class GridRecipe(MaterialRecipe):
    """The keys of failure-map and design."""

    temperature: GridTemperatures | None = Field(
        None, description="Temperatures of the films; a list is an axis of the grid. Default: the material's reference temperature."
    )
    breakdown: BreakdownField | None = Field(None, description="Law of the breakdown field. Default: that of the material.")
    pull_in: PullInSection = Field(default_factory=PullInSection, description="The pull-in criterion.")
    solver: GridSolver = Field(GridSolver(), description="How exactly the equations are solved.")
    uncertainty: FilmUncertainty | None = Field(
        None, description="Intervals of all results, from draws of the material and of films."
    )

    def solving(self, sample: Sample | None) -> dict[str, Any]:
        """The arguments by which the films of the grid and those of a `sample` are solved."""
        # without [uncertainty] a sample is one of slight changes, which needs the full accuracy
        stated = "rtol" in self.solver.model_fields_set or self.uncertainty is None
        return {
            "failure": Failure(breakdown(self.breakdown), self.pull_in.criterion),
            "solver": Solver(self.solver.rtol, self.solver.mesh_rtol, self.solver.rtol if stated else None),
            "sample": sample,
        }
