"""Mistakes in recipes are told in words of this project, not in those of the library that finds them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, Field, ValidationError

from dielast.base.errors import InputError
from dielast.commands.registry import COMMANDS
from dielast.recipe.fields import Section
from dielast.recipe.validate import _PLAIN, _models, check
from dielast.report.summary import print_summary

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


class Named(Section):
    """Of a name."""

    name: str = Field(min_length=3)


def test_characters_are_counted_too(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='name: "a": at least 3 characters are needed'):
        check(Named, {"name": "a"}, "r.toml", tmp_path)


def test_a_list_of_one_is_a_list(capsys: pytest.CaptureFixture[str]) -> None:
    breakdown = {"cases": [0], "time_s": [646.522147], "nothing": []}
    print_summary({"kind": "actuate", "breakdown": breakdown, "actuate": {"cases": 1}}, Path())
    assert capsys.readouterr().out == "breakdown.cases = [0]\nbreakdown.time_s = [646.52]\nactuate.cases = 1\n"
