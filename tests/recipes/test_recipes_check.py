"""`make -C recipes check`: golden files that stand for every recipe, and a moved number that is found."""

from __future__ import annotations

import re
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

Make = Callable[..., subprocess.CompletedProcess[str]]
Kitchen = Callable[..., Path]
RECIPES = Path(__file__).parents[2] / "recipes"


def test_every_recipe_has_golden_files_and_they_are_small() -> None:
    names = {path.stem for path in RECIPES.glob("*.toml") if "kind" in tomllib.loads(path.read_text())}
    assert {path.name for path in (RECIPES / "golden").iterdir()} == names
    files = [path for path in (RECIPES / "golden").rglob("*") if path.is_file()]
    assert {path.suffix for path in files} == {".csv", ".toml"}
    assert all((RECIPES / "golden" / name / "summary.toml").is_file() for name in names)
    assert sum(path.stat().st_size for path in files) < 2_000_000


def test_one_percent_of_equilibrium_modulus_fails_and_every_recipe_is_told(kitchen: Kitchen, make: Make) -> None:
    folder = kitchen("Makefile", "vhb4905-reconstruction.toml", "relaxation-test.toml", "golden/relaxation-test")
    creep = (RECIPES / "fig7b.toml").read_text().replace("build/fig6/material.toml", "vhb4905-reconstruction.toml")
    (folder / "creep.toml").write_text(creep)
    assert make("golden-creep").returncode == 0
    stands = make("check")
    assert stands.returncode == 0, stands.stderr

    material = folder / "vhb4905-reconstruction.toml"
    text = material.read_text()
    assert text.count('shear_modulus = "26000 Pa"') == 1
    material.write_text(text.replace('"26000 Pa"', '"26260 Pa"'))
    moved = make("check")
    assert moved.returncode == 2
    cells = {"relaxation-test": r"relax\.csv: nominal_stress_1 \[Pa\]", "creep": r"creep\.csv: stretch_1 \[1\]"}
    for name, cell in cells.items():
        assert f"check-{name}] Error 4" in moved.stderr
        assert f"from golden/{name} beyond a relative 1e-06" in moved.stderr
        assert re.search(rf"^{cell}: \d+ of \d+ cells differ, most row \d+: [-\d.e]+; golden [-\d.e]+", moved.stderr, re.MULTILINE)
