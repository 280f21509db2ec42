"""What a summary says of where its numbers come from."""

from __future__ import annotations

import hashlib
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

import dielast as library

Run = Callable[..., subprocess.CompletedProcess[str]]
Starter = Callable[[str], Path]


def test_the_summary_tells_the_recipe_and_what_was_set(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("relax")
    material = tmp_path / "folder/own.toml"
    material.parent.mkdir()
    material.write_text(Path(library.__file__).with_name("examples").joinpath("vhb4905.toml").read_text())
    settings = ("temperature=20 degC", "output.points_per_decade = 2", f"material={material}")
    done = dielast("relax", recipe, "--plot", "none", "-q", *(part for one in settings for part in ("--set", one)))
    assert (done.returncode, done.stderr) == (0, "")
    summary = tomllib.loads((tmp_path / "relax/summary.toml").read_text())
    assert summary["set"] == ['temperature = "20 degC"', "output.points_per_decade = 2", 'material = "own.toml"']
    digests = [{"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()} for path in (recipe, material)]
    assert summary["inputs"] == digests
    assert dielast("relax", recipe, "--plot", "none", "-q", "-o", "plain").returncode == 0
    assert "set" not in tomllib.loads((tmp_path / "plain/summary.toml").read_text())
