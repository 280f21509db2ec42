"""The memory that the results of a run take, estimated before the run begins."""

from collections.abc import Sequence
from typing import Any

from dielast.commands.simulation.recipe import SimulationRecipe
from dielast.io.files import Inputs
from dielast.mechanics.line import EVEN_ROWS, HOLD_DECADES, JUMP_DECADES, RAMP_DECADES
from dielast.recipe.cases import Case
from dielast.sharing.memory import check_memory
from dielast.simulate.output import Output

NUMBER = 8  # bytes
COPIES = 4.5  # copies of each number of a table from the solver to the file, as measured
CELL = 200  # bytes of a cell of a map in each draw: three times, mode and outcome, with intermediate arrays


def check_series(cases: Sequence[Case[Any]], columns: int, inputs: Inputs, jobs: int) -> None:
    """Raise `NumericsError` if tables of so many `columns`, and the draws of `jobs` cases at a time, do not fit in memory."""
    points: dict[str, int] = {}
    rows = [_rows(case.recipe, inputs, points) for case in cases]
    draws = [0 if case.recipe.uncertainty is None else case.recipe.uncertainty.draws for case in cases]
    together = sorted((count * many for count, many in zip(rows, draws, strict=True)), reverse=True)[:jobs]
    what = f"{len(cases)} case{'s' * (len(cases) > 1)} of {max(rows)} rows{f', each drawn {max(draws)} times,' * any(draws)}"
    cycling = any(getattr(step, "waveform", None) is not None for case in cases for step in case.recipe.step)
    keys = f"output.points_per_decade{', output.cycles' * cycling} or output.times"
    fewer = [f"rows ({keys})", *["cases"] * (len(cases) > 1), *["draws"] * any(draws)]
    check_memory(NUMBER * columns * COPIES * (sum(rows) + sum(together)), what, f"state fewer {' or '.join(fewer)}")


def check_cells(cells: int, draws: int) -> None:
    """Raise `NumericsError` if the times of so many `cells` of a map, and of each of its `draws`, do not fit in memory."""
    what = f"{cells} cells{f' of {draws} draws each' if draws else ''}"
    check_memory(float(CELL) * cells * (1 + draws), what, "state fewer voltages, prestretches, temperatures or draws")


def _rows(recipe: SimulationRecipe, inputs: Inputs, points: dict[str, int]) -> int:
    """Estimated number of rows in the table of a case; `points` are the numbers of points of the tables that have been read."""
    if recipe.output.times is not None:
        return len(recipe.output.times)
    count, jumped = 0, False
    for step in getattr(recipe, "step", ()):
        at_once = step.hold is None and step.table is None and not step.duration and getattr(step, "rate", None) is None
        decades = JUMP_DECADES if jumped else HOLD_DECADES
        if step.hold is None:
            decades = JUMP_DECADES if "voltage" in type(step).model_fields else RAMP_DECADES
        count += 1 if at_once else decades * recipe.output.points_per_decade + EVEN_ROWS
        jumped = at_once
        if step.table is not None:
            if step.table not in points:
                points[step.table] = inputs.read(step.table).count(b"\n")
            count += points[step.table]
        elif getattr(step, "waveform", None) is not None:
            cycles = step.cycles or 1
            # a row of cycles.csv takes about as much
            count += 2 * EVEN_ROWS * Output(cycles=recipe.output.cycles).kept(cycles).size + cycles
    return count
