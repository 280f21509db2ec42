"""What a summary says of where its numbers come from."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from processes import Run

import dielast as library
from dielast.base.errors import DielastWarning
from dielast.io.files import Inputs
from dielast.report.report import RecipeSource, RunReport, drawn, summarise

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


def test_no_summary_holds_what_is_not_a_number() -> None:
    """In a list, a word keeps the place of a number that is not known; where nothing is known, there is no key."""
    nan, inf = float("nan"), float("inf")
    values = {"stderr": [nan, 0.1, inf], "all": [nan, -inf], "alone": inf, "none": None, "inner": {"a": nan, "b": 1.0}, "no": []}
    report = RunReport({}, {"fit": values}, figure=lambda: None)  # type: ignore[arg-type, return-value]
    summary = summarise("relax", report, {}, Inputs(Path()), RecipeSource("r.toml"), "0")
    assert summary["fit"] == {"stderr": ["undetermined", 0.1, "undetermined"], "inner": {"b": 1.0}, "no": []}


def test_a_figure_that_fails_costs_no_result_and_is_said() -> None:
    def fail() -> Any:
        raise OverflowError("cannot convert\nfloat infinity")

    with pytest.warns(DielastWarning, match=r"the figure relax cannot be drawn and is left out \(OverflowError: cannot convert"):
        assert drawn("relax", RunReport({}, {}, fail), ["png"], {}) == {}
