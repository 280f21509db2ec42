"""What a run loads: nothing that it was not asked for, as loading takes longer than most simulations."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dielast.commands.registry import COMMANDS

# what only draws, comparisons, golden files, figures, other kinds of recipes, odd units, several processes or notebooks need
UNASKED = (
    *("scipy", "pandas", "matplotlib", "rich", "numpy.ma", "numpy.random", "statistics"),
    *("concurrent.futures", "multiprocessing", "importlib.resources.readers", "logging"),
    *(
        "dielast.relaxation.superposition",
        "dielast.relaxation",
        "dielast.handover.export",
        "dielast.readings.instruments",
        "dielast.plots",
        "dielast.handover.material_draws",
    ),
    *("dielast.commands.spectrum.recipe", "dielast.readings.recipe", "dielast.sharing.processes", "dielast.sharing.cluster"),
    *(f"dielast.commands.simulation.{name}" for name in ("bounds", "compare", "uncertainty")),
    *(
        "dielast.handover.mastercurve_folder",
        "dielast.report.golden",
        "dielast.commands.spectrum",
    ),
)
OF_FILMS = (
    "dielast.mechanics.events",
    "dielast.commands.actuate.recipe",
    "dielast.simulate.actuate",
    "dielast.io.text_table",
)
PROGRAM = """
import json, sys
from dielast.cli import main
try:
    main()
finally:
    print(json.dumps(sorted(sys.modules)))
"""


@pytest.mark.parametrize(
    ("kind", "more"),
    [
        ("relax", OF_FILMS),
        pytest.param("actuate", ("dielast.simulate.failure_map",), marks=pytest.mark.trust),
        ("failure-map", ("dielast.simulate.actuate", "dielast.io.text_table")),
    ],
)
def test_a_run_without_figure_loads_only_what_it_needs(
    kind: str, more: tuple[str, ...], starter: Callable[[str], Path], tmp_path: Path
) -> None:
    command = [sys.executable, "-c", PROGRAM, kind, str(starter(kind)), "--plot", "none", "-q", "-o", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = set(json.loads(done.stdout))
    assert sorted(loaded & {*UNASKED, *more}) == []
    assert COMMANDS[kind].model.__module__ in loaded
