"""The films of maps and designs: prestretched and relaxed once for the material, and once for every draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, in_a_draw
from dielast.material.arguments import real_numbers
from dielast.material.breakdown import BreakdownLaw
from dielast.material.material import Material
from dielast.mechanics.criteria import failures_of
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.span import Controls
from dielast.mechanics.stability import TimeScale
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.film import Film
from dielast.simulate.film_setup import FilmSetup, Prestretch
from dielast.simulate.setup import Setup, set_up

if TYPE_CHECKING:
    from dielast.material.scatter import Sample

DRAWN_RTOL = 5e-4  # default for draws; times are then accurate to 0.1 %, usually far less than the differences between draws


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Relaxed films that run together, one per column. `films` are their numbers in the grid: first the films of the material, then
    those of each draw. `rtol` is the tolerance of their solution.
    """

    film: Film
    films: Cases
    watched: WatchedFilms
    thickness: Floats
    rtol: float


def groups_of(setup: Setup, timescale: TimeScale, first: int, rtol: float) -> tuple[Group, ...]:
    """The films of a setup, numbered from `first`, with this pull-in time scale."""
    groups = []
    for columns in setup.groups():
        films = np.flatnonzero(np.bincount(columns))  # np.unique would load numpy.ma, which is slow
        film = setup.film(columns, rtol)
        groups.append(Group(film, first + films, setup.watched(film, columns, timescale), setup.thickness[films], rtol))
    return tuple(groups)


@dataclass(frozen=True, slots=True, eq=False)
class FilmGrid:
    """Relaxed films in `groups`: those of the material (films,), then those of each of the `draws`.

    `breakdown_field` (films,) in V/m is that of the films of the material, infinite where none is known; `controls` are those of
    all films, and `failures` are the names of the failures that can happen to them.
    """

    groups: tuple[Group, ...]
    breakdown_field: Floats
    controls: Controls
    failures: tuple[str, ...]
    draws: int = 0


def axis_of(values: ArrayLike, name: str, of: str = "map") -> Floats:
    """The values as an axis (n,) of a grid; `InputError` unless they are a list of finite numbers. `of` names the grid."""
    array = np.atleast_1d(real_numbers(values, name))
    if array.ndim != 1 or not array.size:
        raise InputError(f"the {name} axis of a {of} must be a list of numbers, and not empty", argument=name)
    if not np.all(np.isfinite(array)):
        raise InputError("every value must be finite", argument=name)
    return array


def prestretches_of(prestretch: Prestretch, of: str = "map") -> Floats:
    """The prestretches (n, 2) of axes 1 and 2, from a list of numbers (equibiaxial) or of pairs."""
    pairs = real_numbers(prestretch, "prestretch")
    pairs = np.stack((pairs, pairs), axis=-1) if pairs.ndim < 2 else pairs
    pairs = pairs.reshape(-1, 2) if pairs.shape[-1] == 2 else pairs
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not pairs.size:
        text = f"the prestretches of a {of} must be a list of numbers or of pairs, and not empty"
        raise InputError(text, argument="prestretch")
    return pairs


def check_weights(film: FilmSetup, pairs: Floats) -> None:
    """`InputError` for a prestretch (prestretches, 2) other than 1 along an axis that a weight stretches."""
    for axis, weight in enumerate(film.weights[:2]):
        if weight is not None and np.any(pairs[:, axis] != 1):
            stated = "the weight stretches it: a prestretch of 1 says so"
            raise InputError(f"axis {axis + 1}: {stated}", argument="prestretch")


def lay_out(
    material: Material,
    film: FilmSetup,
    *,
    prestretch: Floats,
    temperature: Floats,
    breakdown_field: ArrayLike | BreakdownLaw | None,
    pull_in_timescale: TimeScale,
    rtol: float,
    sample: Sample | None = None,
    drawn_rtol: float | None = None,
) -> FilmGrid:
    """Prestretch and relax films of the material with `prestretch` (films, 2) and `temperature` (films,) in degC.

    With a `sample`, also the films of its draws, solved to `drawn_rtol`, by default a larger tolerance. Thickness and electrode
    share of the `film`, and the breakdown field, are numbers or (films,). Raises `InputError` for invalid arguments.
    """
    films = temperature.size

    def of_all(materials: Sequence[Material], field: ArrayLike | BreakdownLaw | None, thick: ArrayLike, tolerance: float) -> Setup:
        """The setup of the films of all materials, one material after another."""
        first, second = (np.tile(prestretch[:, axis], len(materials)) for axis in (0, 1))
        stretched = (None if film.weights[0] is not None else first, None if film.weights[1] is not None else second)
        share = None if film.electrode_share is None else np.tile(film.electrode_share, len(materials))
        return set_up(
            [material for material in materials for _ in range(films)] if len(materials) > 1 else materials,
            replace(film, thickness=thick, prestretch=stretched, electrode_share=share),
            temperature=np.tile(temperature, len(materials)),
            breakdown_field=field,
            rtol=tolerance,
        )

    setup = of_all([material], breakdown_field, film.thickness, rtol)
    groups = groups_of(setup, pull_in_timescale, 0, rtol)
    if sample is not None:
        field = breakdown_field
        if field is not None and not isinstance(field, BreakdownLaw):
            field = np.tile(setup.breakdown_field, len(sample))
        tolerance = drawn_rtol or max(rtol, DRAWN_RTOL)
        thick = np.tile(setup.thickness, len(sample)) * np.repeat(sample.thickness_factor, films)
        with in_a_draw(argument="sample"):
            drawn = of_all(sample.aged(), field, thick, tolerance)
            scaled = drawn.breakdown_field * np.repeat(sample.breakdown_factor, films)
            groups += groups_of(replace(drawn, breakdown_field=scaled), pull_in_timescale, films, tolerance)
    concerned = failures_of([material, *(() if sample is None else sample.materials)])
    return FilmGrid(groups, setup.breakdown_field, setup.controls, concerned, 0 if sample is None else len(sample))
