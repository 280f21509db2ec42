"""The films of a recipe: their boundary and treatment, their lives under constant voltages, and a plan of tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.commands.lifetime.recipe import LifetimeRecipe, PlanSection
from dielast.errors import InputError, warn, without_warnings
from dielast.failures.bounds import TestPlan, plan_test
from dielast.failures.fits import FittedLaw, Lives, life_error, lives_of
from dielast.failures.likelihood import Seen
from dielast.failures.specimens import Simulated, Specimens, simulate_specimens
from dielast.material.material import Material
from dielast.numerics.arrays import Floats
from dielast.simulate.film_setup import Film
from dielast.simulate.options import MESH_RTOL, Solver

FEW, POINTS, LONGER = 25, 13, 100.0  # voltages of tests that are all stated, else their number; horizon over the longest test
LIFE_EXACT, MOST = 3e-3, 16
"""The accepted relative change of a life if every second row is left out, of which a third is an error: far below what tests
determine, and as close as tables of lives are read. Histories have at most `MOST` times the rows of those of the specimens."""


def film_of(recipe: LifetimeRecipe) -> Film:
    """What all films share."""
    film = recipe.film
    force, width = film.weights
    return Film(
        film.thickness,
        prestretch_rate=film.prestretch_rate,
        relax=film.relax,
        boundary=film.boundary,
        electrode_share=None if film.shares is None else film.shares[0],
        force=force,
        width=width,
    )


def solver_of(recipe: LifetimeRecipe) -> Solver:
    """How exactly the specimens, and films under further voltages, are simulated."""
    return Solver(recipe.solver.rtol, recipe.solver.mesh_rtol if recipe.film.boundary[0] == "frame" else MESH_RTOL)


def films_under(
    recipe: LifetimeRecipe, tested: Simulated, material: Material, *, voltage: Floats, prestretch: Floats, end: float
) -> Simulated:
    """Films of the recipe under constant voltages (films,) in V up to the `end` in s, with rows as close as those of the tests."""
    n, usual = voltage.size, recipe.film.thickness
    unknown, empty = np.full(n, np.nan), ("",) * n
    at = material.reference_temperature if recipe.temperature is None else recipe.temperature
    films = Specimens(
        tuple(f"{volt:g} V" for volt in voltage),
        np.full(n, int(Seen.SUSPENDED)),
        np.full(n, end),
        voltage,
        np.full(n, np.inf),
        prestretch,
        np.full(n, usual),
        np.full(n, at),
        unknown,
        unknown,
        unknown,
        empty,
        empty,
        np.full(n, -1),
    )
    with without_warnings():
        return simulate_specimens(
            material,
            films,
            film=film_of(recipe),
            pull_in_timescale=recipe.pull_in.criterion,
            solver=solver_of(recipe),
            points_per_decade=tested.points_per_decade,
        )


def lives_under(recipe: LifetimeRecipe, material: Material, tested: Simulated, fitted: Sequence[FittedLaw]) -> Lives:
    """The lives under the voltages of the recipe, or those of the tests."""
    axis, specimens = recipe.life, tested.specimens
    if axis.values:
        voltage = np.array(axis.values)
    elif axis.points is not None:
        voltage = np.linspace(axis.start or 0.0, axis.to or 0.0, axis.points)
    else:
        held = specimens.voltage[np.isinf(specimens.ramp) & np.isfinite(specimens.voltage)]
        levels = np.array(sorted(set(np.round(held, 9).tolist())))
        ends = tested.voltage[tested.voltage > 0]
        voltage = levels if 1 < levels.size <= FEW else np.linspace(float(ends.min()), float(ends.max()), POINTS)
    pairs = [recipe.film.prestretch] if recipe.film.prestretch else sorted(set(map(tuple, specimens.prestretch.tolist())))
    volts, prestretch = np.tile(voltage, len(pairs)), np.repeat(np.array(pairs, dtype=float), voltage.size, axis=0)
    horizon = axis.horizon or LONGER * float(tested.end.max())
    for factor in (2**k for k in range(MOST.bit_length())):
        closer = replace(tested, points_per_decade=factor * tested.points_per_decade)
        films = films_under(recipe, closer, material, voltage=volts, prestretch=prestretch, end=horizon)
        histories = films.histories.of(films.film)
        alike: dict[str, Any] = {
            "prestretch": prestretch,
            "thickness": films.specimens.thickness,
            "temperature": films.specimens.temperature,
            "pulled_in": films.pulled_in,
        }
        with without_warnings():
            error = life_error(fitted, histories, **alike)
        if error <= LIFE_EXACT:
            break
    else:
        warn(f"lives have numerical errors of {error / 3:.1g}")
    with without_warnings():
        return lives_of(fitted, histories, voltage=volts, **alike)


def planned(goal: PlanSection, recipe: LifetimeRecipe, material: Material, tested: Simulated, best: FittedLaw) -> TestPlan:
    """The test that would show the goal of the recipe."""
    if best.law.model.scatter.name != "weibull":
        raise InputError("a test plan is for Weibull scatter", key="plan")
    pair = goal.prestretch or recipe.film.prestretch or tuple(tested.specimens.prestretch[0].tolist())
    durations = goal.life * np.array([0.25, 0.5, 1.0, 2.0, 4.0])
    films = films_under(
        recipe, tested, material, voltage=np.array([goal.voltage]), prestretch=np.array([pair]), end=float(durations[-1])
    )
    if films.pulled_in[0] < goal.life:
        raise InputError(f"the film pulls in after {films.pulled_in[0]:.4g} s", key="plan.life")
    with np.errstate(divide="ignore"):
        hazard = best.hazard_along(films.histories, films.specimens)
        at = np.interp(np.log(durations), np.log(np.maximum(films.histories.time[0], 1e-300)), np.log(np.maximum(hazard, 1e-300)))
    exposure = np.exp(at)
    usable = durations <= films.histories.end[0] * (1 + 1e-9)
    return plan_test(
        durations[usable],
        exposure[usable],
        float(exposure[2]),
        1.0,
        goal.failure_share,
        goal.confidence,
        shown=float(np.sum(best.hazard)),
        failures=best.law.model.observations.failures,
    )
