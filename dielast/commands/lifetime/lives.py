"""Lives under constant voltages: those of the films of a recipe, those by laws without physics to compare with, a plan of tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from dielast.base.errors import InputError, NumericsError, warn, without_warnings
from dielast.calibration.failures.bounds import TestPlan, plan_test
from dielast.calibration.failures.fits import FailureFit, Lives, fit_law, life_error, lives_of
from dielast.calibration.failures.law_models import line_model
from dielast.calibration.failures.law_names import LINES
from dielast.calibration.failures.likelihood import Seen
from dielast.calibration.failures.specimens import Simulated, Specimens, simulate_specimens
from dielast.calibration.profiles import Verdict
from dielast.commands.lifetime.recipe import LifetimeRecipe, PlanSection
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.options import MESH_RTOL, Solver

Solved = TypeVar("Solved")
FEW, POINTS, LONGER = 25, 13, 100.0  # voltages of tests that are all stated, else their number; horizon over the longest test
LIFE_EXACT = 3e-3
"""The accepted relative change of a life if every second row is left out, of which a third is an error: far below what tests
determine, and as close as tables of lives are read."""
MOST = 16  # times as many rows as usual, at most, in histories


def fine_enough(solve: Callable[[int], tuple[Solved, float]], accepted: float) -> tuple[Solved, float]:
    """What `solve` makes of histories with so many times the usual rows, and its error, by which it is `accepted` or the last."""
    factor = 1
    while True:
        solved, error = solve(factor)
        if error <= accepted or factor >= MOST:
            return solved, error
        factor *= 2


def simulated(recipe: LifetimeRecipe, material: Material, specimens: Specimens, points_per_decade: int) -> Simulated:
    """The specimens under their voltages, as films of the recipe."""
    film = recipe.film
    return simulate_specimens(
        material,
        specimens,
        film=film.setup(electrode_share=None if film.shares is None else film.shares[0]),
        pull_in_timescale=recipe.pull_in.criterion,
        solver=Solver(recipe.solver.rtol, recipe.solver.mesh_rtol if film.boundary[0] == "frame" else MESH_RTOL),
        points_per_decade=points_per_decade,
    )


def films_under(
    recipe: LifetimeRecipe, points_per_decade: int, material: Material, *, voltage: Floats, prestretch: Floats, end: float
) -> Simulated:
    """Films of the recipe under constant voltages (films,) in V up to the `end` in s."""
    n = voltage.size
    unknown, empty = np.full(n, np.nan), ("",) * n
    films = Specimens(
        name=tuple(f"{volt:g} V" for volt in voltage),
        seen=np.full(n, int(Seen.SUSPENDED)),
        time=np.full(n, end),
        voltage=voltage,
        ramp=np.full(n, np.inf),
        prestretch=prestretch,
        thickness=np.full(n, recipe.film.thickness),
        temperature=np.full(n, recipe.usual_temperature(material)),
        intact=unknown,
        area=unknown,
        humidity=unknown,
        batch=empty,
        mode=empty,
        programme=np.full(n, -1),
    )
    with without_warnings():
        return simulated(recipe, material, films, points_per_decade)


def lives_under(recipe: LifetimeRecipe, material: Material, tested: Simulated, fitted: Sequence[FailureFit]) -> Lives:
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

    def solve(factor: int) -> tuple[Simulated, float]:
        points = factor * tested.points_per_decade
        films = films_under(recipe, points, material, voltage=volts, prestretch=prestretch, end=horizon)
        with without_warnings():
            return films, life_error(fitted, films)

    films, error = fine_enough(solve, LIFE_EXACT)
    if error > LIFE_EXACT:
        warn(f"lives have numerical errors of {error / 3:.1g}")
    with without_warnings():
        return lives_of(fitted, films)


def planned(goal: PlanSection, recipe: LifetimeRecipe, material: Material, tested: Simulated, best: FailureFit) -> TestPlan:
    """The test that would show the goal of the recipe."""
    if best.law.model.scatter.name != "weibull":
        raise InputError("a test plan is for Weibull scatter", key="plan")
    pair = goal.prestretch or recipe.film.prestretch or tuple(tested.specimens.prestretch[0].tolist())
    durations = goal.life * np.array([0.25, 0.5, 1.0, 2.0, 4.0])
    films = films_under(
        recipe,
        tested.points_per_decade,
        material,
        voltage=np.array([goal.voltage]),
        prestretch=np.array([pair]),
        end=float(durations[-1]),
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
        goal.failure_share,
        goal.confidence,
        shown=float(np.sum(best.hazard)),
        failures=best.law.model.observations.failures,
    )


COLUMNS: tuple[tuple[str, str | None, type], ...] = (
    ("law", None, str),
    ("prestretch_1", "1", float),
    ("prestretch_2", "1", float),
    ("specimens", None, np.int64),
    ("failures", None, np.int64),
    ("parameter", None, str),
    ("value", None, float),
    ("standard_error", None, float),
    ("lower", None, float),
    ("upper", None, float),
    ("verdict", None, str),
    ("log_likelihood", "1", float),
    ("thickness", "m", float),
    ("temperature", "degC", float),
)
Key = tuple[float, float, float, float]
"""What films share: both prestretches, the thickness in m and the temperature in degC."""


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Laws of the time over the voltage by name, without physics, of the specimens (rows,) of one kind of film."""

    fitted: Mapping[tuple[Key, str], tuple[FailureFit, Cases]]
    usual: tuple[float, float]
    """The thickness in m and the temperature in degC of the films whose lives are compared with."""

    def law_of(self, name: str, prestretch: Floats) -> FailureFit | None:
        """The law of the usual film of a prestretch (2,), None without one."""
        found = self.fitted.get(((float(prestretch[0]), float(prestretch[1]), *self.usual), name))
        return None if found is None else found[0]

    def columns(self) -> Table:
        """A row for each parameter of each law."""
        rows = list[tuple[Any, ...]]()
        for ((*pair, thickness, temperature), name), (law, members) in self.fitted.items():
            model = law.law.model
            for cells in zip(*(column.values for column in law.columns()[:6]), strict=True):
                count = len(members), model.observations.failures
                rows.append((name, *pair, *count, *cells, law.fit.value, thickness, temperature))
        parts = list(zip(*rows, strict=True)) if rows else [()] * len(COLUMNS)
        return [
            Column(name, unit, list(map(str, values)) if kind is str else np.array(values, dtype=kind))
            for (name, unit, kind), values in zip(COLUMNS, parts, strict=True)
        ]

    def lives(self, name: str, lives: Lives, share: float) -> Floats:
        """The times (3, films) in s within which a share of the films of `lives` fails by a law, and its bounds; NaN without it."""
        values = np.full((3, lives.voltage.size), np.nan)
        for k, (voltage, prestretch) in enumerate(zip(lives.voltage.tolist(), lives.prestretch, strict=True)):
            if (law := self.law_of(name, prestretch)) is not None:
                values[:, k] = law.line_life(voltage, share)
        return values

    def drawn(self, name: str, lives: Lives) -> Floats:
        """The times (films,) in s within which half of the films of `lives` fails by a law, for a figure; NaN where the failures do
        not determine how the time falls with the voltage (the second parameter), or bound the time on one side only.
        """
        time, lower, upper = self.lives(name, lives, 0.5)
        known = [
            (law := self.law_of(name, prestretch)) is not None
            and law.interval_of(law.law.parameters[1].coordinate).verdict is Verdict.DETERMINED
            for prestretch in lives.prestretch
        ]
        return np.where(np.array(known, dtype=bool) & (lower > 0) & np.isfinite(upper), time, np.nan)

    def of_lives(self, lives: Lives) -> Table:
        """Columns of `lives`: the time within which a tenth of the films fails by each law, with bounds; none without a law."""
        columns = []
        for name in LINES if self.fitted else ():
            values = self.lives(name, lives, 0.1)
            for k, end in enumerate(("", "_lower", "_upper")):
                columns.append(Column(f"{name.replace('-', '_')}_time_b10{end}", "s", values[k]))
        return columns


def lines_of(recipe: LifetimeRecipe, material: Material, tested: Simulated) -> Lines:
    """The laws of each kind of film that failed at several voltages, where they can be fitted."""
    fitted: dict[tuple[Key, str], tuple[FailureFit, Cases]] = {}
    specimens = tested.specimens
    columns = (*specimens.prestretch.T, specimens.thickness, specimens.temperature)
    keys: list[Key] = list(zip(*(column.tolist() for column in columns), strict=True))
    for film in sorted(set(keys)):
        members = np.array([k for k, key in enumerate(keys) if key == film])
        alive = tested.end[members] > 0
        members = members[alive & np.isfinite(specimens.voltage[members])]
        failed = members[tested.seen[members] != Seen.SUSPENDED]
        if failed.size < 3 or len(set(np.round(tested.voltage[failed], 6).tolist())) < 2:
            continue
        for name in LINES:
            law = line_model(name, tested, members, recipe.fit.scatter)
            try:
                fit = fit_law(law, level=recipe.uncertainty.level, draws=0, seed=recipe.uncertainty.seed)
            except (InputError, NumericsError):
                continue
            fitted[film, name] = fit, members
    return Lines(fitted, (recipe.film.thickness, recipe.usual_temperature(material)))
