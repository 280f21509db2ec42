"""The JSON Schema of recipes takes whatever runs, and refuses what an editor can tell to be wrong; cases of sweeps."""

from __future__ import annotations

import csv
import tomllib
from functools import cache
from pathlib import Path

import jsonschema
import pytest
from keys import keys

from dielast.base.errors import InputError
from dielast.commands.actuate.run import prepared
from dielast.commands.registry import COMMANDS, read_cases
from dielast.commands.simulation.cases import case_columns
from dielast.commands.simulation.naming import labels, swept
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs, read_file, resolve
from dielast.io.table import to_csv
from dielast.recipe.cases import settings
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


PULL = """
kind = "relax"
material = "example:vhb4905.toml"
[[step]]
stretch = 2.0
rate = "12.5 %/s"
[[step]]
hold = "2 h"
"""

DRIVEN = """
kind = "actuate"
material = "example:vhb4905.toml"
film = { thickness = "0.5 mm", prestretch = 1.9, boundary = "dead-load" }
pull_in = { timescale = "1 %" }
[[step]]
voltage = "2 kV"
"""


def write(folder: Path, text: str, name: str = "r.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def mistakes(folder: Path, text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        read_cases(write(folder, text))
    return [line.removeprefix(f"{folder / 'r.toml'}: ") for line in caught.value.messages]


def test_every_combination_is_a_case_in_order(tmp_path: Path) -> None:
    sweep = '[sweep]\ntemperature = ["0 degC", "20 degC"]\n"step.0.rate" = ["1 %/s", "2 %/s", "3 %/s"]\n'
    cases = read_cases(write(tmp_path, PULL + sweep))
    assert [(case.recipe.temperature, case.recipe.step[0].rate) for case in cases] == [
        (temperature, rate) for temperature in (0.0, 20.0) for rate in (0.01, 0.02, 0.03)
    ]
    assert cases[4].settings == {"temperature": "20 degC", "step.0.rate": "2 %/s"}


def test_a_value_that_is_swept_twice_is_two_cases(tmp_path: Path) -> None:
    cases = read_cases(write(tmp_path, PULL + '[sweep]\ntemperature = ["20 degC", "68 degF"]\n'))
    assert [case.recipe.temperature for case in cases] == [20.0, 20.0]  # noise gives each its own repetition


def test_films_with_different_breakdown_laws_are_solved_together(tmp_path: Path) -> None:
    laws = '[{ field = "40 MV/m" }, { field = "48 MV/m" }, { law = "power", field = "30.6 MV/m", stretch_exponent = 0.5 }]'
    ramp = DRIVEN.replace("2 kV", '8 kV"\nduration = "10 s')
    (batch,) = prepared(read_cases(write(tmp_path, ramp + f"[sweep]\nbreakdown = {laws}\n")), Inputs(tmp_path)).batches
    first, second, third = (film.events[0] for film in batch.solve() if film.events)
    assert [first.true_field, second.true_field] == pytest.approx([40e6, 48e6])
    assert third.true_field == pytest.approx(30.6e6 * third.stretch_1**0.5)


def test_steps_may_live_in_a_file_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "loads").mkdir()
    (tmp_path / "loads/points.csv").write_text("time [s],stretch\n0,1\n1,2\n")
    write(tmp_path, '[[step]]\nstretch = 1.5\nduration = "3 s"\n[[step]]\ntable = "points.csv"\n', "loads/history.toml")
    text = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\nload = "loads/history.toml"\n'
    (case,) = read_cases(write(tmp_path, text))
    assert (case.recipe.step[0].stretch, case.recipe.step[0].duration) == (1.5, 3.0)
    assert case.recipe.step[1].table == "loads/points.csv"


def test_a_mistake_in_a_load_file_is_told_of_that_file(tmp_path: Path) -> None:
    write(tmp_path, '[[step]]\nstretch = 1.5\nrate = "3 kg"\n', "history.toml")
    text = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\nload = "history.toml"\n'
    assert mistakes(tmp_path, text) == ['history.toml: step[0].rate: "3 kg": a strain rate is needed, such as "12.5 %/s"']
    assert "not both" in mistakes(tmp_path, text + '[[step]]\nhold = "1 s"\n')[0]
    write(tmp_path, 'kind = "relax"\n', "history.toml")
    assert "must hold [[step]] and no other key" in mistakes(tmp_path, text)[0]
    assert "no such file" in mistakes(tmp_path, text.replace("history", "gone"))[0]


def table_of(folder: Path, sweep: str, recipe: str = PULL) -> str:
    return to_csv(case_columns(read_cases(write(folder, f"{recipe}[sweep]\n{sweep}\n")))).decode()


def test_quantities_of_two_dimensions_are_told_as_the_recipe_spells_them(tmp_path: Path) -> None:
    sweep = '"pull_in.timescale" = ["1 %", "0.01 s"]'
    assert table_of(tmp_path, sweep, DRIVEN) == "case,pull_in.timescale\n0,1 %\n1,0.01 s\n"
    assert [(one.values, one.texts) for one in swept(read_cases(tmp_path / "r.toml"))] == [
        ((), ("timescale = 1 %", "timescale = 0.01 s"))
    ]
    assert table_of(tmp_path, '"pull_in.timescale" = ["1 min", "10 s"]', DRIVEN) == "case,pull_in.timescale [s]\n0,60\n1,10\n"
    assert [(one.label, one.values) for one in swept(read_cases(tmp_path / "r.toml"))] == [("timescale [s]", (60.0, 10.0))]


def test_lists_and_tables_are_told_as_toml_and_in_words_to_a_figure(tmp_path: Path) -> None:
    values = '[["clamped", "dead-load"], "clamped"]'
    found = table_of(tmp_path, f'"film.boundary" = {values}', DRIVEN)
    assert [*csv.reader(found.splitlines())] == [["case", "film.boundary"], ["0", '["clamped", "dead-load"]'], ["1", "clamped"]]
    steps = ["{ stretch = 2 }", '{ stretch = 1.5, rate = "1 %/s" }']
    found = table_of(tmp_path, f'"step.0" = [{", ".join(steps)}]')
    assert [row[1] for row in csv.reader(found.splitlines())][1:] == steps
    cases = read_cases(tmp_path / "r.toml")
    material = parse_material(read_file(resolve(tmp_path, "example:vhb4905.toml"), "vhb"), "vhb")
    assert labels(cases, [material, material]) == ["step 0 = stretch 2", "step 0 = stretch 1.5, rate 1 %/s"]
    assert [tomllib.loads(f"x = {step}")["x"] for step in steps] == [case.settings["step.0"] for case in cases]


def test_a_key_within_a_swept_table_is_the_cases_own(tmp_path: Path) -> None:
    sweep = '[sweep]\noutput = [{ points_per_decade = 3 }]\n"output.points_per_decade" = [4, 5]\n'
    cases = read_cases(write(tmp_path, PULL + sweep))
    assert [case.recipe.output.points_per_decade for case in cases] == [4, 5]
    assert [case.settings["output"] for case in cases] == [{"points_per_decade": 3}] * 2


def test_only_files_lose_their_folders() -> None:
    stated = ["title=/tmp/a/b c", "material=/tmp/m.toml", 'sweep."material"=["/x/a.toml", "b.toml"]', "step=[{table='/t/h.csv'}]"]
    assert settings(stated, COMMANDS["relax"].model) == [
        'title = "/tmp/a/b c"',
        'material = "m.toml"',
        'sweep.material = ["a.toml", "b.toml"]',
        'step = [{ table = "h.csv" }]',
    ]
