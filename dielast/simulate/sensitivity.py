"""Sensitivity of the life of films: shares in the variance of log life, or derivatives with respect to one number at a time."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.material.sensitivity import Exchange, Perturbed, Source
from dielast.numerics.arrays import Floats
from dielast.numerics.shares import variance_shares
from dielast.simulate.failure_map import FailureMap, HeldVoltages, failure_cells, plan_failure_map, solve_map
from dielast.simulate.film_setup import Film
from dielast.simulate.options import Failure, Solver

LN10 = np.log(10.0)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LifeShares(TabularResult):
    """Shares (sources, films) of `sources` in the variance of the log life of `films` (a table that identifies them).

    `first_order` is the share that a source explains alone, `total` the share that remains if all other sources are known; both
    have standard errors. `spread` (films,) is the standard deviation of log10 life, in decades. `censored` (films,) is the fraction
    of runs without a time to failure above 0 s: these survive, fail at once, or were not finished. A film with such runs has no
    shares (NaN).

    Sources are independent of each other, except the parts of a material, which are drawn together. For a part, `total` is its
    share if only this part is drawn anew, and `first_order` is the covariance of the life with the contribution of the part, over
    the variance (Li et al., J. Phys. Chem. A 114 (2010) 6022, DOI 10.1021/jp9096919). Parts that compensate each other have totals
    above that of the material, and negative first-order shares.
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
        """The table, one row per film and source."""
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
    """Derivatives (sources, films) of the log life of `films` (a table that identifies them) with respect to the log of one number
    at a time: the change of the life in per cent if the number increases by one per cent.

    `elasticity_error` (sources, films) bounds the error of the central difference where the life is smooth; a large value indicates
    a kink, such as from breakdown to pull-in. NaN where a film does not fail, or fails at once.
    """

    films: Table
    sources: tuple[str, ...]
    elasticity: Floats
    elasticity_error: Floats

    def columns(self) -> Table:
        """The table, one row per film and number."""
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


def variation_for(material: Material, sample: Sample | None, seed: int = 1, *, has_breakdown: bool = True) -> Variation:
    """The variation of a material for the sensitivity of a life: exchanges between the draws of a `sample`, or, without a sample,
    the material with its numbers changed one at a time, and with the breakdown field if the film `has_breakdown`.
    """
    return Perturbed.of(material, has_breakdown=has_breakdown) if sample is None else Exchange.of(sample, seed)


def sensitivity_of(variation: Variation, life: Floats, films: Table) -> Sensitivity:
    """The sensitivity of films (identified by the table `films`) to the sources of a variation.

    `life` (draws, films) in s is the life in all its draws, NaN where a film does not fail.
    """
    fails = life > 0
    logs = np.log(np.where(fails, life, 1.0))
    if isinstance(variation, Perturbed):
        slope, error = variation.slopes(np.where(fails, logs, np.nan))
        return LifeElasticities(films, variation.names, slope, error)
    pairs, count = variation.first.size, len(variation.sources)
    exchanged = logs[variation.draws :].reshape(count, 2, pairs, -1)
    shares = variance_shares(logs[variation.first], logs[variation.second], exchanged[:, 0], exchanged[:, 1])
    used = np.concatenate((variation.first, variation.second, np.arange(variation.draws, len(life))))
    censored = np.mean(~fails[used], axis=0)
    values = {name: np.where(censored > 0, np.nan, getattr(shares, name)) for name in (field.name for field in fields(shares))}
    spread = np.sqrt(values.pop("variance")) / LN10
    return LifeShares(films, variation.sources, **values, spread=spread, censored=censored)


def life_sensitivity(
    material: Material,
    film: Film,
    voltages: HeldVoltages,
    sample: Sample | None = None,
    *,
    seed: int = 1,
    failure: Failure = Failure(),
    solver: Solver = Solver(),
) -> Sensitivity:
    """The sensitivity of the life of the films of a `failure_map`, which has the same arguments.

    With a `sample`, the draws of material and films, the result is the shares of sources in the variance of the log life
    (`LifeShares`). For n draws and k sources this takes n(k + 1) lives per film; `seed` selects the pairs of draws. Without a
    sample, the result is the derivatives with respect to every number (`LifeElasticities`). All lives are solved to `rtol`, unless
    `drawn_rtol` is stated.

        sample = draw_sample(read_draws("material.toml"), 200, scatter=FilmScatter(thickness=NormalScatter(0.02)))
        life_sensitivity(material, Film(0.5e-3, 1.9), HeldVoltages(4e3, horizon=1e9), sample).to_frame()

    Raises `InputError` for invalid arguments. Source of the shares: `numerics.shares` (Sobol' 2001, Saltelli et al. 2010).
    """
    has_breakdown = failure.breakdown_field is not None or material.breakdown is not None
    variation = variation_for(material, sample, seed, has_breakdown=has_breakdown)
    solver = replace(solver, drawn_rtol=solver.drawn_rtol or solver.rtol)
    plan = plan_failure_map(material, film, voltages, failure=failure, solver=solver, sample=variation.sample)
    result, *drawn = solve_map(plan)
    return sensitivity_of_map(variation, result, drawn)


def sensitivity_of_map(variation: Variation, result: FailureMap, drawn: Sequence[FailureMap]) -> Sensitivity:
    """The sensitivity of every cell of a map, from the maps of all draws of the variation, in their order."""
    life = np.array([draw.time_to_failure.ravel() for draw in drawn])
    return sensitivity_of(variation, life, failure_cells(result))


def _of_films(films: Table, count: int, sources: Any) -> Table:
    """The columns of the films, repeated for each source, and the column of the sources."""
    rows = np.repeat(np.arange(count), len(sources))
    repeated = [Column(column.name, column.unit, np.asarray(column.values)[rows]) for column in films]
    return [*repeated, Column("source", None, list(sources) * count)]
