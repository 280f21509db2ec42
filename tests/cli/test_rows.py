"""The rows of a table are close enough for straight lines between them, up to a failure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.io.table import number_columns, parse_csv
from dielast.sharing.execution import Execution

WITHIN = 2e-3  # of a column's range
CYCLES = """
kind = "{kind}"
material = "example:vhb4905"
{film}
[[step]]
waveform = "{shape}"
{swing}
period = "1 s"
cycles = 3
"""
FILM = '[film]\nthickness = "0.5 mm"\nprestretch = 1.9\nrelax = "1.5 h"\n'


def table(path: Path, kind: str, times: np.ndarray | None = None) -> tuple[list[str], np.ndarray, float]:
    """Header, numbers (rows, columns) up to the first event, and when that was."""
    asked = [] if times is None else ["output.times=[" + ",".join(f'"{time!r} s"' for time in times.tolist()) + "]"]
    files = compute(kind, read_cases(path, kind, asked), path, (), Execution())[0]
    header = list(parse_csv(files[f"{kind}.csv"], "result"))
    numbers = np.array(number_columns(files[f"{kind}.csv"], "result", header)).T
    first = np.inf
    if kind == "actuate" and (events := number_columns(files["events.csv"], "events.csv", ["time [s]"])[0]).size:
        first = float(events.min())
    return header, numbers[numbers[:, header.index("time [s]")] <= first], first


def assert_close_rows(path: Path, kind: str, without: tuple[str, ...] = ()) -> None:
    header, rows, first = table(path, kind)
    time = rows[:, header.index("time [s]")]
    gaps = np.diff(time) > 1e-8 * time[1:]
    between = np.unique(np.concatenate([time[:-1][gaps] + share * np.diff(time)[gaps] for share in (0.25, 0.5, 0.75)]))
    _, dense, _ = table(path, kind, between[between < min(first, time[-1] * (1 - 1e-9))])
    again = np.flatnonzero(np.diff(time) == 0) + 1
    time[again] = np.nextafter(time[again], np.inf)  # what has jumped
    for column, name in enumerate(header):
        whole = np.ptp(rows[:, column])
        if name not in ("case", "temperature [degC]", "time [s]", *without) and whole > 0:
            off = np.abs(np.interp(dense[:, header.index("time [s]")], time, rows[:, column]) - dense[:, column])
            assert off.max() <= WITHIN * whole, name


@pytest.mark.parametrize("kind", ["actuate", *(pytest.param(kind, marks=pytest.mark.trust) for kind in ("relax", "creep"))])
def test_straight_lines_between_the_rows_of_the_starters(kind: str, starter: Callable[[str], Path]) -> None:
    assert_close_rows(starter(kind), kind)


@pytest.mark.parametrize(
    ("kind", "swing"), [("actuate", 'high = "2.5 kV"'), ("relax", "high = 1.5"), ("creep", 'low = "10 kPa"\nhigh = "50 kPa"')]
)
@pytest.mark.parametrize("shape", ["triangle", pytest.param("sine", marks=pytest.mark.trust)])
def test_straight_lines_between_the_rows_of_cycles(kind: str, swing: str, shape: str, tmp_path: Path) -> None:
    path = tmp_path / "cycles.toml"
    path.write_text(CYCLES.format(kind=kind, shape=shape, swing=swing, film=FILM if kind == "actuate" else ""))
    # the clock of the time scale starts anew in each cycle, and the determinant falls from its glassy value at once
    assert_close_rows(path, kind, ("stability [1]",))
