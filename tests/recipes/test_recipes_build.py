"""`make -C recipes`: everything once and in order, what changed and no more, and nothing half made."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import ENDS, until

Make = Callable[..., subprocess.CompletedProcess[str]]
Kitchen = Callable[..., Path]
RECIPES = Path(__file__).parents[2] / "recipes"
NAMES = sorted(path.stem for path in RECIPES.glob("*.toml") if "kind" in tomllib.loads(path.read_text()))
# one way through the whole: material, test, master curve, spectrum, simulation, and a simulation beside it
CHAIN = ["relaxation-test", "fig4-5", "fig6", "fig7a", "aside"]
QUICK = "OPTIONS=--plot none --quiet"


def built(done: subprocess.CompletedProcess[str]) -> list[str]:
    """The recipes that make runs, in its order."""
    assert done.returncode == 0, done.stderr
    return re.findall(r"dielast \S+ \S+\.toml -o build/(\S+) ", done.stdout)


def planned(folder: Path) -> list[str]:
    """What `python build.py`, which needs no make, would run: recipes and tables, in its order."""
    command = [sys.executable, "build.py", "--dry-run"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=ENDS, check=False)
    assert done.returncode == 0, done.stderr
    return re.findall(r" -o build/(\S+) ", done.stdout)


def needs(name: str) -> set[str]:
    return set(re.findall(r'"build/([^/"]+)', (RECIPES / f"{name}.toml").read_text()))


def test_every_recipe_is_built_once_and_after_what_it_needs(kitchen: Kitchen, make: Make, tmp_path: Path) -> None:
    kitchen()
    order = built(make("-n"))
    assert sorted(order) == NAMES
    for name in NAMES:
        assert all(order.index(need) < order.index(name) for need in needs(name))
    # the same without make
    folder = tmp_path / "recipes"
    without = planned(folder)
    assert sorted(without) == sorted([*NAMES, "table1"])
    for name in NAMES:
        assert all(without.index(need) < without.index(name) for need in needs(name))
    assert without.index("table1") > max(without.index(f"table1-case{case}") for case in (2, 3, 4, 5))
    wrong = subprocess.run([sys.executable, "build.py", "fig13x"], cwd=folder, capture_output=True, text=True, check=False)
    assert wrong.returncode == 1
    assert wrong.stderr.startswith("fig13x: no such recipe; there are table1, ")


FIGURES = ["fig4", "fig5", "fig6", "fig7", "fig8", "fig9", "fig11", "fig12", "fig13", "failure-map"]


@pytest.mark.trust
def test_every_figure_of_the_paper_has_a_target(kitchen: Kitchen, make: Make) -> None:
    kitchen()
    for figure in FIGURES:
        order = built(make("-n", figure))
        own = [name for name in NAMES if re.fullmatch(rf"{figure}[a-z]?|{figure}-\d+", name)] or ["fig4-5"]
        assert set(own) <= set(order)
        # and with them only what they need
        assert {need for name in order for need in needs(name)} | set(own) == set(order)
    for target in ("fig10", "table1"):
        done = make("-n", target)
        assert {"fig6", *(f"table1-case{case}" for case in (2, 3, 4, 5))} <= set(built(done))
        assert "table1.py" in done.stdout


@pytest.fixture
def chain(kitchen: Kitchen) -> Path:
    """A few recipes, made quick: few points, and no others."""
    names = ["relaxation-test", "fig4-5", "fig6", "fig7a"]
    folder = kitchen(
        "Makefile", "build.py", "vhb4905-reconstruction.toml", "fig7a-measured.csv", *(f"{name}.toml" for name in names)
    )
    test = folder / "relaxation-test.toml"
    test.write_text(test.read_text().replace("points_per_decade = 20", "points_per_decade = 6"))
    aside = (folder / "fig7a.toml").read_text().replace("build/fig6/material.toml", "aside-material.toml")
    (folder / "aside.toml").write_text(aside[: aside.index("[[compare]]")])
    shutil.copyfile(folder / "vhb4905-reconstruction.toml", folder / "aside-material.toml")
    return folder


def later(path: Path) -> tuple[int, int]:
    """Touch a file, so that it is newer than all results; hand back the times that it had."""
    before = path.stat()
    os.utime(path)
    return before.st_atime_ns, before.st_mtime_ns


@pytest.mark.trust
def test_what_was_touched_and_what_depends_on_it_is_redone_and_no_more(chain: Path, make: Make) -> None:
    assert sorted(built(make("-j2", QUICK))) == sorted(CHAIN)
    again = make(QUICK)
    assert built(again) == []
    assert "Nothing to be done for 'all'" in again.stdout
    assert make("-q").returncode == 0
    affected = {
        "vhb4905-reconstruction.toml": CHAIN[:4],
        "fig4-5.toml": ["fig4-5", "fig6", "fig7a"],
        "fig7a.toml": ["fig7a"],
        "fig7a-measured.csv": ["fig7a"],
        "build/fig6/material.toml": ["fig7a"],
        "aside-material.toml": ["aside"],
    }
    for name, expected in affected.items():
        before = later(chain / name)
        assert built(make("-n")) == planned(chain) == expected, name
        assert make("-q").returncode == 1
        os.utime(chain / name, ns=before)
    # what was lost comes back, and what depends on it follows
    (chain / "build/fig6/material.toml").unlink()
    assert planned(chain) == ["fig6", "fig7a"]
    assert sorted(built(make("-j2", QUICK))) == ["fig6", "fig7a"]
    assert make("-q").returncode == 0
    # and without make
    later(chain / "fig7a-measured.csv")
    command = [sys.executable, "build.py", "--jobs", "2"]
    done = subprocess.run(command, cwd=chain, capture_output=True, text=True, timeout=ENDS, check=True)
    assert re.findall(r"^dielast \S+ (\S+)\.toml -o ", done.stdout, re.MULTILINE) == ["fig7a"]
    assert planned(chain) == []
    assert make("-q").returncode == 0


def whole(folder: Path) -> None:
    """Every result that counts as done is complete, and there is nothing else."""
    assert not list(folder.glob("build/**/*.part"))
    for summary in folder.glob("build/*/summary.toml"):
        listed = (folder / f"build/{summary.parent.name}.d").read_text().split(": ")[0].split()
        assert sorted(listed) == sorted(str(path.relative_to(folder)) for path in summary.parent.iterdir())


def test_an_interrupted_make_or_a_killed_run_leaves_nothing_half_made(
    chain: Path, make: Make, environment: Path, variables: dict[str, str]
) -> None:
    process = subprocess.Popen(
        ["make", f"VENV={environment}", "READY=", QUICK, "fig6"],
        cwd=chain,
        env={**variables, "SLOW": "fig4-5"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    until(lambda: (chain / "asleep").exists())
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(ENDS) != 0
    assert not (chain / "build/fig4-5").exists()
    whole(chain)

    killed = make("fig6", QUICK, kill="fig4-5")
    assert killed.returncode == 2
    assert "fig4-5/summary.toml] Killed" in killed.stderr
    assert not (chain / "build/fig4-5").exists()
    whole(chain)
    assert built(make("fig6", QUICK)) == ["fig4-5", "fig6"]
    whole(chain)
    # an older result of a run that is killed later does not pass for a new one
    later(chain / "fig6.toml")
    assert make("fig6", QUICK, kill="fig6").returncode == 2
    assert built(make("-n", "fig6")) == ["fig6"]
