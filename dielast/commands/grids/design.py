"""`design`: the voltage that takes each film to a goal, and the life of the film under it."""

from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from dielast.base.errors import in_keys, placed
from dielast.commands.grids.films import PreparedGrid, in_words, planned, sample_for, warn_of_design, warn_of_grid
from dielast.commands.grids.recipe import DesignRecipe
from dielast.commands.simulation.cases import first_of_each, material_of
from dielast.commands.simulation.recipe import KEYS
from dielast.io.files import Inputs
from dielast.material.intervals import DrawIntervals
from dielast.material.scatter import Sample
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution
from dielast.sharing.study import Study, Work
from dielast.simulate.design import YES, Design, check_draws, designed, plan_design, under_way
from dielast.simulate.design_plan import (
    AREA_STRAIN,
    CHUNK,
    FAILURE_PROBABILITY,
    RELATIVE_STRETCH,
    UNFINISHED,
    DesignPlan,
    Goal,
    solve_draws,
    solve_films,
)

GOAL = {name: f"goal.{name}" for name in (RELATIVE_STRETCH, AREA_STRAIN, "at", "horizon", "failure_probability")}
GOAL_KEYS = KEYS | GOAL | {"goal": "goal", "level": "uncertainty.level"}


def prepared(cases: Sequence[Case[DesignRecipe]], inputs: Inputs) -> PreparedGrid[DesignPlan]:
    """The design, read, checked and warned of, but not solved. Raises `InputError`, and `NumericsError` if memory is short."""
    recipe, material = cases[0].recipe, material_of(cases[0], inputs)
    sample = sample_for(cases[0], material, inputs)
    with in_keys(GOAL_KEYS):
        check_draws(0 if sample is None else len(sample), _intervals(recipe, sample).level, _failing(recipe))
    goal = recipe.goal
    plan = partial(plan_design, goal=Goal(goal.at, goal.horizon, goal.relative_stretch, goal.area_strain))
    targets = len(goal.relative_stretch or goal.area_strain or ())
    stated, in_recipe_terms = planned(plan, recipe, material, sample, GOAL_KEYS, targets=targets)
    warn_of_grid(recipe, material, stated.grid.temperature, stated.grid.breakdown_field)
    return PreparedGrid(material, sample, stated, in_recipe_terms)


def _intervals(recipe: DesignRecipe, sample: Sample | None) -> DrawIntervals:
    return DrawIntervals(0.9) if recipe.uncertainty is None or sample is None else recipe.uncertainty.intervals(sample.laws)


def _failing(recipe: DesignRecipe) -> float:
    """The probability of failure at the safe life."""
    return recipe.goal.failure_probability or FAILURE_PROBABILITY


def run(cases: Sequence[Case[DesignRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Plan the films, find their voltages, report."""
    recipe, ready = cases[0].recipe, prepared(cases, inputs)
    material, sample, stated = ready.material, ready.sample, recipe.uncertainty
    share = _failing(recipe)
    with placed(ready.in_recipe_terms):
        plan = ready.plan.relaxed()
    study = Study.of(cases, inputs, execution)

    def size(films: int) -> int:
        """The films of a chunk: all processes get some."""
        return max(1, min(CHUNK, -(-films // execution.jobs)))

    solved = study.solve(Work(solve_films, "films"), plan, plan.chunks(size=size(plan.films)))
    plan = under_way(plan, solved)
    drawn = study.solve(Work(solve_draws, "films of draws"), plan, plan.chunks(True, size(plan.films * plan.grid.draws)))
    result = designed(plan, solved, drawn, _intervals(recipe, sample), share)
    warn_of_design(recipe, material, result)

    def figure() -> Any:
        from dielast.commands.simulation.naming import titled
        from dielast.commands.simulation.uncertainty import interval_label
        from dielast.plots.design import plot_design

        title = titled(recipe.title, cases, [material])
        required = None if stated is None else stated.failure_share
        return plot_design(result, title, interval_label([recipe]) if stated is not None else None, required or share)

    lost = np.flatnonzero(result.reached == UNFINISHED)
    failures = [("numerics", f"{film_of(result, film)}: given up: the solver did not find its voltage") for film in lost.tolist()]
    sections = headline(result)
    if stated is not None:
        from dielast.commands.simulation.uncertainty import uncertainty_headline

        sections |= uncertainty_headline([stated], [sample])
    return RunReport({"design.csv": result.columns()}, sections, figure, failures=first_of_each(failures, "films"))


def film_of(result: Design, film: int) -> str:
    """A film in words."""
    text = in_words(result, float(result.temperature[film]), film)
    return text if np.ptp(result.thickness) == 0 else f"{text}, thickness {result.thickness[film] * 1e3:g} mm"


def headline(result: Design) -> dict[str, dict[str, Any]]:
    """The numbers of films that reach the goal or not, and the best film."""
    reached = result.reached
    counts = {
        "films": int(reached.size),
        "reach_the_goal": int(np.count_nonzero(reached == YES)),
        "fail_first": int(np.count_nonzero(reached == "no: fails first")),
        "out_of_reach": int(np.count_nonzero(reached == "no: out of reach")),
        "given_up": int(np.count_nonzero(reached == UNFINISHED)),
        "rounds": result.rounds,
    }
    sections: dict[str, dict[str, Any]] = {"design": counts}
    goals, temperatures = (sorted(set(values.tolist())) for values in (result.target, result.temperature))
    for target, temperature in product(goals, temperatures):
        spelled = f"{100 * target:g}_percent" if result.goal == AREA_STRAIN else f"{target:g}"
        goal = f"_for_{spelled}" if len(goals) > 1 else ""
        at = f"_at_{temperature:g}_degC" if len(temperatures) > 1 else ""
        # films are sorted, the best first
        first = int(np.flatnonzero((result.target == target) & (result.temperature == temperature))[0])
        sections[f"best{goal}{at}"] = _best(result, first) if reached[first] == YES else _nearest(result, first)
    return sections


def _best(result: Design, film: int) -> dict[str, Any]:
    """The best film of a goal."""
    life = float(result.time_to_failure[film])
    values: dict[str, Any] = {"film": film_of(result, film), "voltage_V": float(result.voltage[film])}
    values["failure_mode"] = str(result.failure_mode[film])
    values["time_to_failure_s"] = life if np.isfinite(life) else None
    if result.drawn is not None:
        values["failure_probability"] = float(result.drawn.failure_probability[film])
        values["safe_life_s"] = float(result.drawn.safe_life[film])
        if result.drawn.assured_life is not None:
            values["assured_life_s"] = float(result.drawn.assured_life[film])
    return values


def _nearest(result: Design, film: int) -> dict[str, Any]:
    """The film that comes nearest to a goal that no film reaches."""
    return {
        "film": "none reaches the goal",
        "nearest": film_of(result, film),
        "because": str(result.because[film]),
        f"largest_{result.goal}": float(result.largest[film]),
    }
