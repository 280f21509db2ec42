"""The JSON Schema of recipes takes whatever runs, and refuses what an editor can tell to be wrong."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import jsonschema
import pytest
from keys import keys

from dielast.base.errors import InputError
from dielast.commands.registry import COMMANDS, read_cases
from dielast.recipe.schema import recipe_schema

TOP = Path(__file__).parents[2]
RECIPES = [
    path
    for pattern in ("recipes/*.toml", "dielast/commands/*/starters/*.toml", "tests/golden/*/*.toml")
    for path in sorted(TOP.glob(pattern))
    if "kind" in tomllib.loads(path.read_text())
]
RELAX = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n'
STEP = "[[step]]\nstretch = 2.0\n"
ACTUATE = 'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[[step]]\nvoltage = "1 kV"\n'
MAP = RELAX.replace("relax", "failure-map") + 'horizon = "1 h"\n[voltage]\nvalues = "3 kV"\n[film]\nthickness = "1 mm"\n'


@cache
def validator() -> jsonschema.Draft202012Validator:
    schema = recipe_schema(COMMANDS)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_there_are_recipes_of_every_sort() -> None:
    assert {path.parent.name for path in RECIPES} >= {"recipes", "starters", "relax-sweep"}
    assert any("load =" in path.read_text() for path in RECIPES)


@pytest.mark.parametrize("path", RECIPES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_every_recipe_of_the_project_fits_the_schema(path: Path) -> None:
    validator().validate(tomllib.loads(path.read_text()))


@pytest.mark.parametrize(
    "text",
    [
        RELAX + 'load = "history.toml"\n',
        RELAX + '[sweep]\nload = ["history.toml"]\n',
        RELAX + "[sweep]\nstep = [[{ stretch = 2.0 }], [{ stretch = 3.0 }]]\n",
        RELAX + '[sweep]\n"step.0.rate" = ["1 %/s", "2 %/s"]\n' + STEP,
        'kind = "relax"\n' + STEP + '[sweep]\nmaterial = ["example:vhb4905.toml"]\n',
        ACTUATE + '[sweep]\n"film.thickness" = ["1 mm", "2 mm"]\n',
        ACTUATE + '[film]\nprestretch = 1.9\n[sweep]\n"film.thickness" = ["1 mm", "2 mm"]\n',
        ACTUATE + '[film]\nthickness = "1 mm"\n[breakdown]\n[sweep]\nmode = "zip"\n"breakdown.field" = ["40 MV/m", "50 MV/m"]\n',
        ACTUATE + '[film]\nthickness = "1 mm"\nprestretch = [3.0, 1.0]\nboundary = ["clamped", "dead-load"]\n',
        MAP + "prestretch = 1.9\n",
        MAP + "prestretch = [1.7, [3.0, 1.0], 2]\n",
    ],
)
def test_what_runs_fits_the_schema(tmp_path: Path, text: str) -> None:
    (tmp_path / "history.toml").write_text(STEP)
    (tmp_path / "r.toml").write_text(text)
    assert read_cases(tmp_path / "r.toml")
    validator().validate(tomllib.loads(text))


@pytest.mark.parametrize(
    "text",
    [
        RELAX,
        RELAX + 'load = "history.toml"\n' + STEP,
        RELAX + "step = []\n",
        'kind = "relax"\n' + STEP,
        RELAX + STEP + "[film]\n",
        RELAX + STEP + '[[compare]]\nfile = "history.toml"\nx = "time [s]"\n',
        RELAX + STEP + "[sweep]\nsweep = 3\n[output]\nseed = 0.5\n",
        ACTUATE + "[film]\nprestretch = 1.9\n",
        MAP + "prestretch = []\n",
        MAP + "prestretch = 1.9\n[sweep]\ntemperature = []\n",
        MAP,
        STEP,
    ],
)
def test_what_does_not_run_does_not_fit_either(tmp_path: Path, text: str) -> None:
    (tmp_path / "history.toml").write_text(STEP)
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError):
        read_cases(tmp_path / "r.toml")
    assert not validator().is_valid(tomllib.loads(text))


def test_how_a_sweep_pairs_its_lists_is_among_the_keys() -> None:
    own = {key.path: key for key in keys(COMMANDS["relax"].model)}
    assert own["sweep.mode"].takes == '"zip" or list'
    assert "pairs the lists" in own["sweep.mode"].meaning
    recipe = tomllib.loads(RELAX + STEP + '[sweep]\nmode = "zip"\ntemperature = ["0 degC", "20 degC"]\n')
    assert validator().is_valid(recipe)
    recipe["sweep"]["mode"] = ["uniaxial", "equibiaxial"]  # a key of the recipe, too
    assert validator().is_valid(recipe)
    recipe["sweep"]["mode"] = "pairs"
    assert not validator().is_valid(recipe)
