"""Before and during a long run: how much there is to do, how long it takes, how far it is."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from processes import SMALL_CHUNKS, Run

Starter = Callable[[str], Path]


def test_validate_says_on_a_terminal_what_a_recipe_amounts_to(dielast: Run, starter: Starter) -> None:
    paths = [starter(kind) for kind in ("failure-map", "design", "measure", "relax")]
    terminal = "import dielast.cli.terminal as terminal; terminal._Unheard.isatty = lambda self: True"
    done = dielast("validate", *(path.name for path in paths), prelude=terminal)
    assert done.stdout.splitlines() == [f"{path.name}: ok" for path in paths]
    assert done.stderr.splitlines() == [
        "note: failure-map.toml: 26 cells",
        "note: design.toml: 15 films",
        "note: measure.toml: 12 photographs",
    ]


def test_a_plan_measures_the_first_cells_and_writes_nothing(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    path = starter("failure-map")
    patient = "import dielast.commands.plan as plan; plan.ENOUGH = plan.LONGEST = 1e6"
    few = dielast("failure-map", path.name, "--plan", prelude=patient)
    assert re.fullmatch(r"failure-map.toml: 26 cells; takes \S+ (s|min) here\n", few.stdout), few.stderr
    quick = f"{SMALL_CHUNKS}\nimport dielast.commands.plan as plan; plan.ENOUGH = 0.0"
    many = dielast("failure-map", path.name, "--plan", "--set", "voltage.points=3000", prelude=quick)
    assert re.search(r"6,000 cells; takes about \S+ (s|min) here, by the first \S+ of 6,000 cells$", many.stdout.strip()), (
        many.stdout
    )
    never = "import dielast.commands.plan as plan; plan.LONGEST = 0.3"
    cut = dielast("design", starter("design").name, "--plan", prelude=never).stdout
    assert re.search(r"15 films; takes longer than \S+ (s|min) here$", cut.strip())
    assert {file.name for file in tmp_path.iterdir()} == {"failure-map.toml", "design.toml"}
    wrong = dielast("failure-map", path.name, "--plan", "--set", "horizon=3")
    assert wrong.returncode == 2
    assert "horizon" in wrong.stderr


def test_without_a_terminal_a_line_a_minute_says_how_far_a_run_is(dielast: Run, starter: Starter) -> None:
    path, often = starter("measure"), "import dielast.cli.terminal as terminal; terminal.MINUTE = 0.05"
    lines = dielast("measure", path.name, "--plot", "none", prelude=often).stderr.splitlines()
    assert lines
    assert all(
        re.match(r"progress: (running for 0 min|\d+ of 12 photographs after 0 min(, about \d+ min left)?)$", line) for line in lines
    )
    assert not dielast("measure", path.name, "--plot", "none", "-q", prelude=often).stderr
