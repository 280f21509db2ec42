"""Recipes as they are read; all mistakes are told at once, each once, in their order and in TOML's own spelling."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from pydantic import BaseModel, ValidationError

from dielast.base.errors import (
    DielastWarning,
    InputError,
    Mistakes,
    NumericsError,
    Problem,
    in_keys,
    quoted,
    shown,
    shown_path,
    similar,
    warn,
)
from dielast.commands.registry import COMMANDS, read_cases
from dielast.commands.spectrum.recipe import SpectrumRecipe
from dielast.handover.material_file import read_material
from dielast.io.toml import parse_toml
from dielast.recipe.base import RecipeBase
from dielast.recipe.cases import check_load
from dielast.recipe.paths import read_path, read_setting
from dielast.recipe.validate import _PLAIN, _models
from dielast.report.summary import print_summary
from dielast.simulate.quantities import FILMS, ON_REQUEST

HEAD = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n'
STEP = '[[step]]\nstretch = 2.0\nrate = "12.5 %/s"\n'


def mistakes(folder: Path, text: str, *overrides: str) -> list[str]:
    path = folder / "r.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_cases(path, None, overrides)
    return [line.removeprefix(f"{path}: ") for line in caught.value.messages]


def test_a_sweep_has_an_end(tmp_path: Path) -> None:
    many = '"solver.rtol" = [' + "1, " * 1000 + "]\ntemperature = [" + "20, " * 1000 + "]\n"
    told = mistakes(tmp_path, HEAD + STEP + "[sweep]\n" + many)
    assert "sweep: 1000000 cases: at most 100000 are allowed" in told
    assert len(told) == 3


def test_a_path_with_brackets_is_the_same_path(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(HEAD + STEP + '[sweep]\n"step[0].stretch" = [2, 3]\n')
    cases = read_cases(tmp_path / "r.toml", None, ["step[0].rate=1 /s"])
    assert [(case.settings, case.recipe.step[0].rate) for case in cases] == [({"step.0.stretch": n}, 1.0) for n in (2, 3)]
    assert (read_path("a[1][2].b"), read_path('"a[1]".b'), read_path("[0].b")) == (
        ("a", "1", "2", "b"),
        ("a[1]", "b"),
        ("[0]", "b"),
    )


def test_a_table_is_no_recipe_and_no_load_file(tmp_path: Path) -> None:
    path = tmp_path / "hist.csv"
    path.write_text("time [s],stretch\n0,1\n")
    for read, hint in ((read_cases, "tables are named in a recipe"), (read_material, "a material file is needed")):
        with pytest.raises(InputError, match=f"hist.csv: line 1: not TOML: .*; {hint}"):
            read(path)


def test_the_rates_of_a_load_file_are_checked(tmp_path: Path) -> None:
    (tmp_path / "h.toml").write_text('[[step]]\nvoltage = "1 kV"\nrate = "-1 V/s"\n')
    with pytest.raises(InputError, match="leads away"):
        check_load(COMMANDS, tmp_path / "h.toml")


@pytest.mark.parametrize("kind", ["relax", "creep", "actuate"])
def test_the_columns_of_the_recipes_are_those_of_the_results(kind: str, tmp_path: Path) -> None:
    golden = Path(__file__).parents[1] / "golden"
    headers = {
        header
        for path in golden.glob(f"{kind}-*/**/{kind}.csv")
        for header in path.read_text().split("\n", 1)[0].split(",")
        if header not in ("case", "temperature [degC]")
    }
    rest = 'film = { thickness = "1 mm" }\n' if kind == "actuate" else ""
    told = mistakes(tmp_path, HEAD.replace("relax", kind) + rest + '[[step]]\nhold = "1 s"\n[plot]\ny = "foo"\n')
    known = set(told[0].split("there are ")[1].split(", "))
    assert headers
    on_request = {quantity.header for quantity in FILMS if ON_REQUEST in quantity.needs or not quantity.written}
    on_request |= {"damage [1]"}
    assert known - headers == (on_request if kind == "actuate" else set())
    assert headers <= known


def test_one_key_of_a_sweep_can_be_set(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(HEAD + STEP + '[sweep]\ntemperature = ["20 degC", "30 degC"]\n')
    cases = read_cases(tmp_path / "r.toml", "relax", ['sweep."step.0.stretch"=[2, 3]', "sweep . 'solver.rtol' = [1e-5]"])
    assert [case.settings for case in cases] == [
        {"temperature": temperature, "step.0.stretch": stretch, "solver.rtol": 1e-5}
        for temperature in ("20 degC", "30 degC")
        for stretch in (2, 3)
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("a", '"a"'),
        (True, "true"),
        (2.5, "2.5"),
        (["1 s", False, 2], '["1 s", false, 2]'),
        ((1, 2), "[1, 2]"),
        ({"a": 1, "b c": {}}, '{ a = 1, "b c" = {} }'),
        ([1000] * 5000, "[" + "1000, " * 9 + "10..."),
        ({"a\nb": "c\nd"}, r'{ "a\nb" = "c\nd" }'),
    ],
)
def test_values_are_shown_as_toml_has_them(value: Any, text: str) -> None:
    assert shown(value) == text


def test_what_is_nested_without_end_is_cut() -> None:
    value: Any = 1
    for _ in range(100_000):
        value = [value]
    assert shown(value) == "[" * 9 + "..." + "]" * 9


KEY = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=5)


@given(st.lists(KEY, min_size=1, max_size=4), st.text(max_size=5))
def test_a_path_is_read_as_it_is_shown(keys: list[str], value: str) -> None:
    path = shown_path(keys)
    assert read_path(path) == tuple(keys)
    assert read_setting(f"{path}={value}") == (tuple(keys), value.strip())


@given(st.text("ab.=\"'\\ \n", max_size=12))
def test_any_path_is_read_or_none(text: str) -> None:
    path = read_path(text)
    assert path is None or all(isinstance(key, str) for key in path)
    assert quoted(text)[0] in "\"'"


ODD: list[Any] = [
    *(True, 3, 2.5, "x", "", -1, 1e9, 10**12, float("nan"), float("inf")),
    *([], [1], [[]], ["1 s"], ["1 s", "2 s", "3 s"], [1, 2, 3], {}, {"a": 1}, {"a": [1]}, {"a": {}}),
]


def models_within(model: type[BaseModel], found: set[type[BaseModel]]) -> set[type[BaseModel]]:
    if model not in found:
        found.add(model)
        for field in model.model_fields.values():
            for inner in _models(field.annotation):
                models_within(inner, found)
    return found


@pytest.mark.parametrize("kind", COMMANDS)
def test_every_kind_of_mistake_has_words_of_its_own(kind: str, tmp_path: Path) -> None:
    for model in models_within(COMMANDS[kind].model, set()):
        for name, field in model.model_fields.items():
            for value in ODD:
                try:
                    model.model_validate({field.alias or name: value}, context={"folder": tmp_path})
                except ValidationError as error:
                    types = {problem["type"] for problem in error.errors()} - {"value_error", "extra_forbidden"}
                    assert types <= _PLAIN.keys(), (model, name, value)


def test_a_list_of_one_is_a_list(capsys: pytest.CaptureFixture[str]) -> None:
    breakdown = {"cases": [0], "time_s": [646.522147], "nothing": []}
    print_summary({"kind": "actuate", "breakdown": breakdown, "actuate": {"cases": 1}}, Path())
    assert capsys.readouterr().out == "breakdown.cases = [0]\nbreakdown.time_s = [646.52]\nactuate.cases = 1\n"


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


def mistakes_of(folder: Path, text: str, *overrides: str) -> list[str]:
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
    assert "has entries 0 to 1" in mistakes_of(folder, text, "material.breakdown.field.2=1")[0]


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


PLACE = ("hold", "table", "duration", "waveform", "period", "cycles", "stretch", "rate", "low", "high", "points_per_decade")
KEYS = {"keep": "truncate.keep", "degree": "fit.degree"}


def test_a_message_names_the_file_the_line_the_step_the_case_and_the_key_or_the_argument() -> None:
    problem = Problem("is needed", argument="rate", step=1, case=2, file=Path("a.csv"), line=3)
    assert str(problem) == "a.csv: line 3: step 1: case 2: rate: is needed"
    assert str(problem.at(key="film.rate", file="b.csv")) == "a.csv: line 3: step 1: case 2: film.rate: is needed"
    assert str(Problem("is needed")) == "is needed"


@pytest.mark.parametrize("kind", [InputError, NumericsError])
def test_an_error_and_its_places_can_be_pickled(kind: type[InputError | NumericsError]) -> None:
    error = kind("is needed", argument="rate", case=0)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert again.problems == error.problems == (Problem("is needed", argument="rate", case=0),)
    assert again.messages == ("case 0: rate: is needed",)
    assert str(again) == "case 0: rate: is needed"


def test_arguments_become_keys_in_errors_and_warnings_of_a_command() -> None:
    with pytest.raises(NumericsError) as caught, in_keys(KEYS):
        raise NumericsError("too few: lower degree", argument="keep", mentions=("degree",))
    assert caught.value.messages == ("truncate.keep: too few: lower fit.degree",)
    with pytest.warns(DielastWarning, match=r"^truncate\.keep: too few$"), in_keys(KEYS):
        warn("too few", argument="keep")
    with pytest.warns(DielastWarning, match=r"^keep: too few$"):
        warn("too few", argument="keep")


def test_several_attempts_are_told_together_and_each_problem_once() -> None:
    def refuse() -> int:
        raise InputError(Problem("one", key="a"), Problem("two"))

    wrong = Mistakes()
    assert (wrong.tried(lambda: 1), wrong.tried(refuse), wrong.tried(refuse)) == (1, None, None)
    with pytest.raises(InputError) as caught:
        wrong.refuse()
    assert caught.value.messages == ("a: one", "two")
    Mistakes().refuse()


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        *[
            ("raet", "rate"),
            ("STRETCH", "stretch"),
            ("pointsPerDecade", "points_per_decade"),
            ("points-per-decade", "points_per_decade"),
        ],
        *[("wave", "waveform"), ("periods", "period"), ("decade", "points_per_decade"), ("strech_rate", "rate")],
        *[("from", None), ("to", None), ("x", None), ("", None), ("x" * 100_000, None)],
    ],
)
def test_a_name_is_suggested_for_a_slip_and_for_nothing_else(wrong: str, meant: str | None) -> None:
    assert similar(wrong, PLACE) == meant
