from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from dielast.commands.mastercurve.recipe import MasterCurveRecipe
from dielast.commands.registry import COMMANDS, read_cases
from dielast.commands.spectrum.recipe import SpectrumRecipe
from dielast.errors import InputError
from dielast.io.toml import parse_toml
from dielast.recipe.base import RecipeBase

MASTERCURVE = """
kind = "mastercurve"
[data]
file = "dma.csv"
columns = { temperature = "T [degC]", time = "t [s]", modulus = "E [Pa]" }
[shift]
reference_temperature = "20 degC"
"""
SPECTRUM = 'kind = "spectrum"\nmastercurve = "."\n'


def read_recipe(path: Path, kind: str | None = None, overrides: tuple[str, ...] | list[str] = ()) -> RecipeBase:
    (case,) = read_cases(path, kind, overrides)
    recipe: RecipeBase = case.recipe
    return recipe


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "dma.csv").write_text("T [degC],t [s],E [Pa]\n20,1,1\n")
    return tmp_path


def write(folder: Path, text: str) -> Path:
    path = folder / "r.toml"
    path.write_text(text)
    return path


def mistakes(folder: Path, text: str, *overrides: str) -> list[str]:
    path = write(folder, text)
    with pytest.raises(InputError) as caught:
        read_recipe(path, None, overrides)
    assert all(line.startswith((f"{path}: ", "--set ")) and "\n" not in line for line in caught.value.messages)
    return [line.removeprefix(f"{path}: ") for line in caught.value.messages]


def test_a_recipe_is_read_with_its_defaults(folder: Path) -> None:
    recipe = read_recipe(write(folder, MASTERCURVE), "mastercurve")
    assert isinstance(recipe, MasterCurveRecipe)
    assert (recipe.shift.law, recipe.shift.vertical, recipe.data.discard_before) == ("wlf", "none", 0.0)
    recipe = read_recipe(write(folder, SPECTRUM))
    assert isinstance(recipe, SpectrumRecipe)
    assert (recipe.fit.method, recipe.fit.branches, recipe.fit.polynomial_degree) == (None, 30, 7)


def test_a_temperature_may_be_fahrenheit(folder: Path) -> None:
    recipe = read_recipe(write(folder, MASTERCURVE.replace("20 degC", "68 degF")))
    assert isinstance(recipe, MasterCurveRecipe)
    assert recipe.shift.reference_temperature == 20.0


def test_relaxation_times_may_be_longer_than_any_test(folder: Path) -> None:
    recipe = read_recipe(write(folder, SPECTRUM + '[fit]\nrelaxation_time = { min = "1e-20 s", max = "1e20 s" }\n'))
    assert isinstance(recipe, SpectrumRecipe)
    assert (recipe.fit.relaxation_time.min, recipe.fit.relaxation_time.max) == (1e-20, 1e20)


def test_five_mistakes_make_five_lines(folder: Path) -> None:
    text = """
kind = "mastercurve"
[data]
file = "gone.csv"
columns = { temperatur = "T", time = 3.5, modulus = "E" }
discard_before = "1 kg"
[shift]
reference_temperature = 20
law = "wfl"
"""
    assert sorted(mistakes(folder, text)) == [
        'data.columns.temperatur: unknown key; did you mean "temperature"?',
        "data.columns.time: 3.5: a column's name, or its number from 1, is needed",
        'data.discard_before: "1 kg": a time is needed, such as "1.5 h"',
        'data.file: "gone.csv": no such file',
        'shift.law: "wfl": one of "wlf", "arrhenius", "table" or "vft" is needed',
        'shift.reference_temperature: 20: a temperature is needed with its unit, such as "20 degC"',
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "kind: is needed: one of"),
        ('kind = "mastercurv"', 'kind: "mastercurv": did you mean "mastercurve"?'),
        ("kind = 3", "kind: 3: one of"),
        ('kind = "spectrum"', "either mastercurve (a folder), [data] (a file) or prony (a card) is needed"),
        ("kind = ", "line 1: not TOML: "),
        ('kind = "spectrum"\nkind = "spectrum"', "line 2: not TOML: "),
        (SPECTRUM + "[fit]\nbranches = 0", "fit.branches: 0: at least 1 is needed"),
        (SPECTRUM + "[fit]\nbranches = 2.5", "fit.branches: 2.5: a whole number is needed"),
        (SPECTRUM + '[fit]\nrelaxation_time = { min = "2 s", max = "1 s" }', "min (2 s) must be below max (1 s)"),
        (SPECTRUM + '[fit]\nequilibrium_modulus = "-1 Pa"', "a stress or modulus of at least 0 Pa is needed"),
        (SPECTRUM + "fit = 3", "fit: 3: a table of keys is needed"),
        (
            SPECTRUM + '[material]\nbreakdown = { prestretch = [1.9, 1.7], field = ["1 MV/m", "2 MV/m"] }',
            "prestretches of a breakdown",
        ),
        (SPECTRUM + "[truncate]", "truncate.keep: is needed"),
        (SPECTRUM + '[reduce]\nwindow = ["1 s", "1e300 h"]', 'reduce.window[1]: "1e300 h": a time from 1e-15 to 1e+15 s is needed'),
        (SPECTRUM.replace('"."', '"dma.csv"'), 'mastercurve: "dma.csv": a folder is needed'),
        (MASTERCURVE.replace('file = "dma.csv"', 'files = "*.txt"'), 'data.files: "*.txt": no file matches'),
        (MASTERCURVE.replace('modulus = "E [Pa]"', 'stress = "s"'), "or extension) and stress (or force) go together"),
        (
            MASTERCURVE.replace('modulus = "E [Pa]"', 'modulus = "E [Pa]", stress = "s"'),
            "data.columns: either modulus, or strain and stress, is needed, or compliance, not modulus and stress",
        ),
        (MASTERCURVE.replace("file =", 'files = ["dma.csv"]\nfile ='), "data: either file or files is needed, not both"),
        (
            MASTERCURVE + 'thermal_expansion = "6e-4 /K"',
            'shift: thermal_expansion acts only with vertical = "density-temperature", not with vertical = "none"',
        ),
        (MASTERCURVE.replace(', modulus = "E [Pa]"', ""), "data.columns: either modulus, or strain and stress, is needed"),
        (
            MASTERCURVE.replace('temperature = "T [degC]", ', "").replace("file =", "files =").replace('"dma.csv"', '["dma.csv"]'),
            "data: temperatures are needed from one of columns.temperature, temperatures, temperature_in_name",
        ),
        (MASTERCURVE.replace("[shift]", 'units = { tme = "s" }\n[shift]'), 'data.units: unit of an unknown column "tme"'),
        (MASTERCURVE.replace('"20 degC"', '"-300 degC"'), "a temperature above -273.15 degC is needed"),
        (MASTERCURVE.replace("[shift]", 'units = { time = "parsec" }\n[shift]'), 'data.units: time = "parsec": unknown unit'),
        (MASTERCURVE.replace("[shift]", 'units = { time = "kg" }\n[shift]'), 'data.units: time = "kg": a time is needed'),
        (MASTERCURVE.replace("[shift]", 'separator = "\\n"\n[shift]'), 'data.separator: "\\n": one character is needed'),
        (MASTERCURVE.replace("[shift]", 'separator = ","\ndecimal = ","\n[shift]'), "cannot be both separator and decimal"),
        (MASTERCURVE.replace("[shift]", 'encoding = "a\\u0000b"\n[shift]'), "unknown encoding"),
        (MASTERCURVE.replace("dma.csv", "x" * 300), "no such file"),
        (MASTERCURVE.replace("dma.csv", "a\\nb"), "no such file"),
    ],
)
def test_each_mistake_says_what_is_needed(folder: Path, text: str, expected: str) -> None:
    assert any(expected in line for line in mistakes(folder, text))


def test_a_recipe_under_another_command_names_the_right_one(folder: Path) -> None:
    with pytest.raises(InputError, match='the recipe is for "spectrum": run it with "dielast spectrum"'):
        read_recipe(write(folder, SPECTRUM), "mastercurve")


def test_keys_are_overridden_by_path(folder: Path) -> None:
    path = write(folder, SPECTRUM)
    recipe = read_recipe(path, overrides=["fit.branches=20", 'fit.relaxation_time.max="10 s"', "fit.method=nnls", "title=a b"])
    assert isinstance(recipe, SpectrumRecipe)
    assert (recipe.fit.branches, recipe.fit.relaxation_time.max, recipe.fit.method, recipe.title) == (20, 10.0, "nnls", "a b")


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("fit.branches", "PATH=VALUE is needed"),
        ("fit..x=1", "PATH=VALUE is needed"),
        ("fit.branch=3", 'fit.branch: unknown key; did you mean "branches"?'),
        ("kind.x=3", "kind is not a table"),
        ("fit.branches=many", 'fit.branches: "many": a whole number is needed'),
    ],
)
def test_a_wrong_override_is_told(folder: Path, override: str, expected: str) -> None:
    assert any(expected in line for line in mistakes(folder, SPECTRUM, override))


def test_lists_are_overridden_by_index(folder: Path) -> None:
    text = SPECTRUM + '[material]\nbreakdown = { prestretch = [1.7, 1.9], field = ["40 MV/m", "48 MV/m"] }'
    recipe = read_recipe(write(folder, text), overrides=["material.breakdown.field.1='50 MV/m'"])
    assert isinstance(recipe, SpectrumRecipe)
    assert recipe.material.breakdown is not None
    assert recipe.material.breakdown.field == (40e6, 50e6)
    assert "has entries 0 to 1" in mistakes(folder, text, "material.breakdown.field.2=1")[0]


@given(
    st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9), lambda x: st.lists(x, max_size=3))
)
def test_any_value_anywhere_is_read_or_told(value: object) -> None:
    from dielast.recipe.validate import check

    for key in ("mastercurve", "data", "fit", "truncate", "material", "title"):
        for document in (
            {key: value},
            {key: {"file": value, "branches": value, "columns": value, "name": value, "breakdown": value}},
        ):
            try:
                check(SpectrumRecipe, {"kind": "spectrum", "mastercurve": "x", **document}, "any", Path("/nowhere"))
            except InputError as error:
                assert error.messages  # noqa: PT017


def test_every_kind_has_a_schema_and_a_description_for_each_section() -> None:
    for kind in COMMANDS:
        schema = COMMANDS[kind].model.model_json_schema()
        assert schema["properties"]["kind"]["const"] == kind
        assert all(definition.get("description") for definition in schema["$defs"].values())
        json.dumps(schema)


def test_a_byte_order_mark_is_no_mistake(folder: Path) -> None:
    path = folder / "bom.toml"
    path.write_text(SPECTRUM, encoding="utf-8-sig")
    assert isinstance(read_recipe(path), SpectrumRecipe)


def test_keys_without_end_are_one_line() -> None:
    for text in ("a." * 5000 + "b = 1", "a = " + "[" * 50000, "a = " + "{b = " * 50000):
        with pytest.raises(InputError, match=r"^r.toml: .*(nested too deeply|not TOML)"):
            parse_toml(text.encode(), "r.toml")
    assert parse_toml(b"a = [" + b"1.5, " * 500 + b"]", "r.toml") == {"a": [1.5] * 500}
