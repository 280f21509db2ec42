"""Mistakes in recipes are told in words of this project, not in those of the library that finds them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, Field, ValidationError

from dielast.commands.registry import COMMANDS, read_cases
from dielast.errors import InputError
from dielast.recipe.fields import Section
from dielast.recipe.validate import _PLAIN, _models, check
from dielast.report.summary import print_summary

HEAD = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n[[step]]\nstretch = 2.0\n'
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('kind = "spectrum"\nmastercurve = "."\n[reduce]\nwindow = ["1 s", "2 s", "3 s"]\n', "at most 2 entries are allowed"),
        ('kind = "spectrum"\nmastercurve = "."\n[reduce]\nwindow = ["1 s"]\n', '["1 s"]: at least 2 entries are needed'),
        ('kind = "spectrum"\nmastercurve = "."\n[export]\nformats = []\n', "export.formats: []: at least 1 entry is needed"),
        (
            'kind = "spectrum"\nmastercurve = "."\n[uncertainty]\ndraws = 40\n',
            "uncertainty: the draws of a spectrum are those of its master curve: state [uncertainty] in the recipe of",
        ),
        (HEAD + '[sweep]\n"sweep.x" = [1, 2]\n', 'sweep."sweep.x": a sweep cannot be swept'),
        (HEAD + "[sweep]\nsweep = [1, 2]\n", 'sweep."sweep": a sweep cannot be swept'),
    ],
)
def test_counted_in_words(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_cases(tmp_path / "r.toml")
    assert any(message in line for line in caught.value.messages)
    assert not any(word in line for line in caught.value.messages for word in ("validation", "Input should", "List should"))


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
