"""`design`: the voltage that takes each film to a goal, and the life of the film under it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.commands.design.recipe import DesignRecipe
from dielast.commands.simulation.cases import first_of_each, material_of
from dielast.commands.simulation.grid_checks import warn_of_design, warn_of_grid
from dielast.commands.simulation.memory_needed import check_cells
from dielast.commands.simulation.recipe import KEYS
from dielast.errors import Problem, in_keys, placed
from dielast.handover.breakdown_section import breakdown
from dielast.io.files import Inputs
from dielast.material.material import Material
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.execution import Execution, share_out
from dielast.simulate.design import FAILURE_PROBABILITY, YES, Design, check_draws, designed, plan_design, under_way
from dielast.simulate.design_plan import (
    AREA_STRAIN,
    CHUNK,
    RELATIVE_STRETCH,
    UNFINISHED,
    Designed,
    DesignPlan,
    Goal,
    solve_draws,
    solve_films,
)
from dielast.simulate.film_setup import FilmSetup

if TYPE_CHECKING:
    from dielast.material.scatter import Sample

GOAL = {name: f"goal.{name}" for name in (RELATIVE_STRETCH, AREA_STRAIN, "at", "horizon", "failure_probability")}
GOAL_KEYS = KEYS | GOAL | {"goal": "goal", "level": "uncertainty.level"}


def run(cases: Sequence[Case[DesignRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Plan the films, find their voltages, report."""
    recipe = cases[0].recipe
    material, wanted = material_of(cases[0], inputs), recipe.uncertainty
    sample, share = None, recipe.goal.failure_probability or FAILURE_PROBABILITY
    if wanted is not None:
        from dielast.commands.simulation.uncertainty import sample_of

        sample = sample_of(cases[0], material, inputs)
        with in_keys(GOAL_KEYS):
            check_draws(len(sample), wanted.level, share)
    check_cells(_films(recipe), 0 if sample is None else len(sample))
    plan = _plan(recipe, material, sample)
    warn_of_grid(recipe, material, plan.grid.temperature, plan.grid.breakdown_field, recipe.goal.horizon)
    films = plan.films * (1 + plan.grid.draws)
    solved = _solved(solve_films, plan, plan.chunks(size=_chunk(plan.films, execution)), execution, (0, films))
    plan, drawn = under_way(plan, solved), []
    if sample is not None:
        chunks = plan.chunks(drawn=True, size=_chunk(films - plan.films, execution))
        drawn = _solved(solve_draws, plan, chunks, execution, (plan.films, films))
    result = designed(plan, solved, drawn, 0.9 if wanted is None else wanted.level, share)
    warn_of_design(recipe, material, result)

    def figure() -> Any:
        from dielast.commands.simulation.naming import titled
        from dielast.commands.simulation.uncertainty import interval_label
        from dielast.plots.design import plot_design

        title = titled(recipe.title, cases, [material])
        return plot_design(result, title, interval_label([recipe]) if wanted is not None else None, share)

    lost = np.flatnonzero(result.reached == UNFINISHED)
    failures = [("numerics", f"{film_of(result, film)}: given up: the solver did not find its voltage") for film in lost.tolist()]
    sections = headline(result)
    if wanted is not None:
        from dielast.commands.simulation.uncertainty import uncertainty_headline

        sections |= uncertainty_headline([wanted], [sample])
    return Report({"design.csv": result.columns()}, sections, figure, failures=first_of_each(failures, "films"))


def _films(recipe: DesignRecipe) -> int:
    """The number of films."""
    film, goal = recipe.film, recipe.goal.relative_stretch or recipe.goal.area_strain or ()
    return len(recipe.temperature or (1,)) * len(film.thicknesses) * len(film.prestretch) * len(film.shares or (1,)) * len(goal)


def _chunk(films: int, execution: Execution) -> int:
    """The number of films in a chunk, so that all processes get some."""
    return max(1, min(CHUNK, -(-films // execution.jobs)))


def _solved(
    solve: Callable[[DesignPlan, int, int], Designed],
    plan: DesignPlan,
    chunks: Sequence[tuple[int, int]],
    execution: Execution,
    of: tuple[int, int],
) -> list[Designed]:
    """The chunks of films, solved; `of` is the number of films that were solved before, and the total number."""
    solved: list[Designed] = []
    done, films = of
    with closing(share_out(solve, plan, chunks, execution)) as parts:
        for chunk in parts:
            solved.append(chunk)
            done += chunk.films.size
            if execution.progress is not None:
                execution.progress(done, films, "films")
    return sorted(solved, key=lambda part: int(part.films.min(initial=0)))


def _plan(recipe: DesignRecipe, material: Material, sample: Sample | None) -> DesignPlan:
    """The films and the goal of the recipe; errors name the keys of the recipe."""
    film, goal = recipe.film, recipe.goal
    temperatures = recipe.temperature or [material.reference_temperature]
    targets = len(goal.relative_stretch or goal.area_strain or ())
    sizes = (len(temperatures), len(film.thicknesses), len(film.prestretch), len(film.shares or (1,)), targets)
    with placed(partial(_in_recipe_terms, sizes=sizes, temperatures=temperatures)):
        return plan_design(
            material,
            FilmSetup(**film.setup(recipe.solver.mesh_rtol)),
            Goal.of(goal.at, goal.relative_stretch, goal.area_strain),
            horizon=goal.horizon,
            temperature=np.array(temperatures),
            breakdown_field=breakdown(recipe.breakdown),
            pull_in_timescale=recipe.pull_in.criterion,
            rtol=recipe.solver.rtol,
            sample=sample,
            drawn_rtol=recipe.solver.rtol if "rtol" in recipe.solver.model_fields_set else None,
        )


def _in_recipe_terms(problem: Problem, sizes: Sequence[int], temperatures: Sequence[float]) -> Problem:
    """A problem of the solver, whose cases are the films of the grid, with the key of the recipe."""
    if problem.case is None or problem.argument != "prestretch":
        return replace(problem, case=None).in_keys(GOAL_KEYS)
    place = [int(index) for index in np.unravel_index(problem.case, sizes)]
    at = f"{temperatures[place[0]]:g} degC: " if len(temperatures) > 1 else ""
    return Problem(at + problem.text, key=f"film.prestretch[{place[2]}]")


def film_of(result: Design, film: int) -> str:
    """A film in words."""
    first, second = result.prestretch[film].tolist()
    parts = [f"{result.temperature[film]:g} degC", f"prestretch {first:g}" + (f" x {second:g}" if second != first else "")]
    if result.electrode_share is not None:
        parts.append(f"electrode share {result.electrode_share[film]:g}")
    if np.ptp(result.thickness) > 0:
        parts.append(f"thickness {result.thickness[film] * 1e3:g} mm")
    return ", ".join(parts)


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
        said = f"{100 * target:g}_percent" if result.goal == AREA_STRAIN else f"{target:g}"
        goal = f"_for_{said}" if len(goals) > 1 else ""
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
    return values


def _nearest(result: Design, film: int) -> dict[str, Any]:
    """The film that comes nearest to a goal that no film reaches."""
    return {
        "film": "none reaches the goal",
        "nearest": film_of(result, film),
        "because": str(result.because[film]),
        f"largest_{result.goal}": float(result.largest[film]),
    }
