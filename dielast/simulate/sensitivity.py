"""What drives the life of films: shares of the spread of the log life, or its derivatives by one number after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.exchange import Exchange, Source
from dielast.material.material import Material
from dielast.material.perturbed import Perturbed
from dielast.material.scatter import Sample
from dielast.numerics.columns import Floats
from dielast.numerics.shares import variance_shares
from dielast.simulate.failure_map import FailureMap, failure_cells, plan_failure_map, solve_map

LN10 = np.log(10.0)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LifeShares(TabularResult):
    """Shares (sources, films) of the variance of the log life of films, whose columns are `films`, that the `sources` have.

    `first_order` is what is explained by a source alone, `total` what is left where all others are known; each has a standard
    error. `spread` (films,) is the standard deviation of log10 life, in decades. `censored` (films,) is the share of the runs
    without a time to failure above 0 s: they survive, fail at once, or were not finished. A film with any has no shares, NaN.

    Sources are independent of each other, but for the parts of a material, which are drawn together. Of a part, `total` is the
    share if it alone is drawn anew, and `first_order` the covariance of the life with what the part explains, over the variance
    (Li et al., J. Phys. Chem. A 114 (2010) 6022, DOI 10.1021/jp9096919): parts that compensate each other have totals above that
    of the material, and first-order shares below zero.
    """

    films: Table
    sources: tuple[Source, ...]
    first_order: Floats
    first_order_stderr: Floats
    total: Floats
    total_stderr: Floats
    spread: Floats
    censored: Floats

    def columns(self) -> Table:
        """One row for each source of each film."""
        count = len(self.sources)
        names = ("first_order", "first_order_stderr", "total", "total_stderr")
        return [
            *_of_films(self.films, self.censored.size, [source.name for source in self.sources]),
            Column("part_of", None, [source.part_of for source in self.sources] * self.censored.size),
            *(Column(name, "1", getattr(self, name).T.ravel()) for name in names),
            Column("spread", "1", np.repeat(self.spread, count)),
            Column("censored", "1", np.repeat(self.censored, count)),
        ]

    @property
    def left_out(self) -> int:
        """The number of films without shares."""
        return int(np.count_nonzero(np.all(np.isnan(self.total), axis=0)))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LifeElasticities(TabularResult):
    """Derivatives (sources, films) of the log life of films, whose columns are `films`, by the log of one constant at a time: by
    how many per cent the life changes if the constant is one per cent larger.

    The `elasticity_error` (sources, films) bounds the error of the central difference for a smooth life; it is large at a kink,
    such as a change from breakdown to pull-in. NaN if a film does not fail, or fails at once.
    """

    films: Table
    sources: tuple[str, ...]
    elasticity: Floats
    elasticity_error: Floats

    def columns(self) -> Table:
        """One row for each number of each film."""
        return [
            *_of_films(self.films, self.elasticity.shape[1], self.sources),
            Column("elasticity", "1", self.elasticity.T.ravel()),
            Column("elasticity_error", "1", self.elasticity_error.T.ravel()),
        ]

    @property
    def left_out(self) -> int:
        """The number of films without elasticities."""
        return int(np.count_nonzero(np.all(np.isnan(self.elasticity), axis=0)))


Sensitivity = LifeShares | LifeElasticities
Variation = Exchange | Perturbed


def variation_for(material: Material, sample: Sample | None, seed: int = 1) -> Variation:
    """The films to be solved for the sensitivity of a life, in its `sample`: exchanges between the draws of a sample where there
    is one, and the material with its numbers changed one at a time where there is none.
    """
    return Perturbed.of(material) if sample is None else Exchange.of(sample, seed)


def sensitivity_of(variation: Variation, life: Floats, films: Table) -> Sensitivity:
    """The sensitivity of films with these columns to the sources of a variation, from the `life` (draws, films) in s of all of its
    draws, NaN where they do not fail.
    """
    known = life > 0
    logs = np.log(np.where(known, life, 1.0))
    if isinstance(variation, Perturbed):
        slope, error = variation.slopes(np.where(known, logs, np.nan))
        return LifeElasticities(films, variation.names, slope, error)
    pairs, count = variation.first.size, len(variation.sources)
    exchanged = logs[variation.draws :].reshape(count, 2, pairs, -1)
    shares = variance_shares(logs[variation.first], logs[variation.second], exchanged[:, 0], exchanged[:, 1])
    used = np.concatenate((variation.first, variation.second, np.arange(variation.draws, len(life))))
    censored = np.mean(~known[used], axis=0)
    values = {name: np.where(censored > 0, np.nan, getattr(shares, name)) for name in (field.name for field in fields(shares))}
    spread = np.sqrt(values.pop("variance")) / LN10
    return LifeShares(films, variation.sources, **values, spread=spread, censored=censored)


def life_sensitivity(material: Material, sample: Sample | None = None, *, seed: int = 1, **film: Any) -> Sensitivity:
    """What drives the life of the films of a `failure_map`, whose arguments `film` are.

    With a `sample` of draws of materials and films: the shares of the sources in the variance of the log life. n draws and k
    sources need n(k + 1) lives of each film; `seed` sets the pairs of draws. Without a sample: the derivatives by all constants.
    All lives are solved to `rtol`; a map of draws is solved to the looser `drawn_rtol` only if that is stated.

        sample = draw_sample(read_draws("material.toml"), 200, thickness=NormalScatter(0.02))
        life_sensitivity(material, sample, voltage=4e3, prestretch=1.9, thickness=0.5e-3, horizon=1e9).to_frame()

    SI units and shapes as in `failure_map`. Raises `InputError` for invalid arguments.
    """
    variation = variation_for(material, sample, seed)
    film.setdefault("drawn_rtol", film.get("rtol", 1e-6))
    result, *drawn = solve_map(plan_failure_map(material, sample=variation.sample, **film))
    return sensitivity_of_map(variation, result, drawn)


def sensitivity_of_map(variation: Variation, result: FailureMap, drawn: Sequence[FailureMap]) -> Sensitivity:
    """The sensitivity of every cell of a map, from the maps of all draws of the variation."""
    life = np.array([map_of_draw.time_to_failure.ravel() for map_of_draw in drawn])
    return sensitivity_of(variation, life, failure_cells(result))


def _of_films(films: Table, count: int, sources: Any) -> Table:
    """The columns of the films, for each of the sources, and the names of these."""
    rows = np.repeat(np.arange(count), len(sources))
    repeated = [Column(column.name, column.unit, np.asarray(column.values)[rows]) for column in films]
    return [*repeated, Column("source", None, list(sources) * count)]
