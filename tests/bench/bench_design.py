"""What a design costs beside a row of a failure map: process time of 50 films, without draws and with 100.

Usage: python tests/bench/bench_design.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from flat import failure_map, plan_failure_map

from dielast import FilmScatter, NormalScatter, WeibullScatter, draw_sample, read_material
from dielast.material.intervals import DrawIntervals
from dielast.simulate.design import YES, designed, plan_design, under_way
from dielast.simulate.design_plan import DesignPlan, Goal, solve_draws, solve_films
from dielast.simulate.film_setup import Film
from dielast.simulate.map_plan import solve_cells

FILMS, DRAWS, REPEATS = 50, 100, 3
MATERIAL = read_material(Path(__file__).parents[2] / "dielast/examples/vhb4905.toml")
HORIZON = 30 * 86400.0


def least(run: Callable[[], Any], repeats: int = REPEATS) -> tuple[float, Any]:
    """The least process time in s of some runs, and what the last one gives."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        times.append(time.process_time() - start)
    return min(times), result


def main() -> None:
    """Print the costs."""
    sample = draw_sample([MATERIAL], DRAWS, scatter=FilmScatter(breakdown_field=WeibullScatter(20), thickness=NormalScatter(0.02)))
    print("| boundary | relative stretch | rounds | reach it | cost over that of a row | a round | with 100 draws | off, largest |")
    print("|---|---|---|---|---|---|---|---|")
    for film in ({}, {"boundary": "frame", "electrode_share": 0.05}):
        given: dict[str, Any] = {"thickness": 5e-4, "relax": 5400.0, "horizon": HORIZON, **film}
        row = plan_failure_map(MATERIAL, voltage=np.linspace(2.5e3, 5e3, FILMS), prestretch=[1.9], **given)
        of_row, _ = least(lambda row=row: [solve_cells(row, *chunk) for chunk in row.chunks()])
        for goal in (1.1, 1.2, 1.35):
            films = Film(5e-4, np.linspace(1.5, 2.1, FILMS), relax=5400.0, **film), Goal(3600.0, HORIZON, goal)
            plan = plan_design(MATERIAL, *films).relaxed()
            cost, solved = least(lambda plan=plan: [solve_films(plan, *chunk) for chunk in plan.chunks()])
            result = designed(under_way(plan, solved), solved, [], DrawIntervals(0.9), 0.05)
            reached = result.reached == YES
            off = float(np.max(np.abs(result.largest[reached] / goal - 1), initial=0.0))
            drawn = plan_design(MATERIAL, *films, sample=sample).relaxed()
            with_draws, _ = least(lambda drawn=drawn: _with_draws(drawn), 1)
            costs = f"{cost / of_row:.2f} | {cost / of_row / result.rounds:.2f} | {with_draws / cost:.1f}"
            print(f"| {film.get('boundary', 'dead-load')} | {goal} | {result.rounds} | {reached.sum()} | {costs} | {off:.1e} |")
    sweep()


def _with_draws(plan: DesignPlan) -> None:
    """Solve a design with its draws."""
    plan = under_way(plan, [solve_films(plan, *chunk) for chunk in plan.chunks()])
    for chunk in plan.chunks(drawn=True):
        solve_draws(plan, *chunk)


def sweep() -> None:
    """The voltage of a film beside a sweep of 400 voltages."""
    film: dict[str, Any] = {"prestretch": 1.9, "thickness": 5e-4, "relax": 5400.0, "horizon": HORIZON}
    plan = plan_design(MATERIAL, Film(5e-4, 1.9, relax=5400.0), Goal(3600.0, HORIZON, 1.2)).relaxed()
    solved = [solve_films(plan, *chunk) for chunk in plan.chunks()]
    found = under_way(plan, solved).voltage[0]
    volts = np.linspace(2e3, 4e3, 400)
    cells = failure_map(MATERIAL, voltage=volts, stretch_at={"then": 3600.0}, **film)
    stretch = cells.relative_stretch["then"][0, 0, 0]
    known = np.isfinite(stretch)
    print(f"\nvoltage {found:.3f} V; interpolated in 400 voltages {np.interp(1.2, stretch[known], volts[known]):.3f} V")


if __name__ == "__main__":
    main()
