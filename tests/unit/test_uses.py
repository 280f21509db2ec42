"""Programmes whose steps repeat: cycles and time under voltage up to a moment, comparison, and figure."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast import FilmStep
from dielast.cli.run import compute
from dielast.commands.actuate.uses import use_columns
from dielast.commands.registry import read_cases
from dielast.commands.simulation.pictures import _Curve
from dielast.commands.simulation.solver_steps import TimedStep
from dielast.sharing.execution import Execution

LAPS = """
kind = "actuate"
material = "example:vhb4905"
film = { thickness = "1 mm", prestretch = 1.5, relax = "10 min" }
step = [{ stretch = 2.5, duration = "2 s" }, { voltage = "1 kV", duration = "1 s" }, { voltage = "0 V", duration = "1 s" }]
repeat = { times = 3 }
stop = { at = "end" }
compare = [{ file = "points.csv", x = "time [s]", y = "nominal_stress_1 [Pa]", y_column = "stress" }]
"""


def stated(times: int) -> Any:
    """Edges that go from 1 to 3 and back to 2 at a rate, with a voltage in between: 6 s at first, then 4 s each time."""
    programme = [
        FilmStep(stretch=3.0, rate=0.5),
        FilmStep(voltage=1e3, duration=1.0),
        FilmStep(stretch=2.0, voltage=0.0, rate=-1.0),
    ]
    steps, begin, before, edges = [], 0.0, 0.0, (1.0, 1.0)
    for number, step in enumerate(programme):
        timed = TimedStep(step, number, begin, before, edges)
        begin, before, edges = timed.end, timed.after, timed.stretched
        steps.append(timed)
    repeat, output = SimpleNamespace(times=times, steps=None), SimpleNamespace(times=None)
    return SimpleNamespace(steps=steps, recipe=SimpleNamespace(repeat=repeat, output=output))


@pytest.mark.parametrize(
    ("time", "cycles", "actuated"), [(3.0, 0.5, 0.0), (6.0, 1.0, 2.0), (8.0, 1.5, 2.0), (10.0, 2.0, 4.0), (18.0, 4.0, 8.0)]
)
def test_a_repeated_step_at_a_rate_begins_where_the_cycle_ends(time: float, cycles: float, actuated: float) -> None:
    found = use_columns(np.zeros(1, dtype=np.intp), np.array([time]), [stated(10)])
    assert [column.values[0] for column in found] == pytest.approx([cycles, actuated])


def test_the_line_of_a_figure_breaks_where_laps_are_left_out() -> None:
    case = stated(6)
    rows = np.array([0.0, 4.0, 5.0, 6.0, 20.0, 21.0, 22.0, 24.0, 25.0, 26.0])  # laps 1, 5 and 6 of 6
    broken = _Curve(case, case.steps, {"time [s]": rows}, None, ()).left_out(rows)
    assert rows[broken].tolist() == [6.0]


def test_measured_points_of_later_laps_are_compared(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("time [s],stress [Pa]\n5,1e5\n9.5,1e5\n12,1e5\n")
    path = tmp_path / "cycles.toml"
    path.write_text(LAPS)
    report = compute("actuate", read_cases(path), path, (), Execution())[0]
    compared = tomllib.loads(report["summary.toml"].decode())["compare"]
    assert (compared["points"], compared.get("points_left_out", 0)) == (3, 0)
