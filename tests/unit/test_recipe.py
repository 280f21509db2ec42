from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.commands.registry import COMMANDS, read_cases
from dielast.commands.spectrum.recipe import SpectrumRecipe
from dielast.io.toml import parse_toml
from dielast.recipe.base import RecipeBase

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


def test_a_recipe_under_another_command_names_the_right_one(folder: Path) -> None:
    with pytest.raises(InputError, match='the recipe is for "spectrum": run it with "dielast spectrum"'):
        read_recipe(write(folder, SPECTRUM), "mastercurve")


def test_keys_are_overridden_by_path(folder: Path) -> None:
    path = write(folder, SPECTRUM)
    recipe = read_recipe(path, overrides=["fit.branches=20", 'fit.relaxation_time.max="10 s"', "fit.method=nnls", "title=a b"])
    assert isinstance(recipe, SpectrumRecipe)
    assert (recipe.fit.branches, recipe.fit.relaxation_time.max, recipe.fit.method, recipe.title) == (20, 10.0, "nnls", "a b")


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


def test_keys_without_end_are_one_line() -> None:
    for text in ("a." * 5000 + "b = 1", "a = " + "[" * 50000, "a = " + "{b = " * 50000):
        with pytest.raises(InputError, match=r"^r.toml: .*(nested too deeply|not TOML)"):
            parse_toml(text.encode(), "r.toml")
    assert parse_toml(b"a = [" + b"1.5, " * 500 + b"]", "r.toml") == {"a": [1.5] * 500}
