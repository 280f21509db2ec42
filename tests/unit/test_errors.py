"""Errors hold their place as data, and whoever knows more of it adds that."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from dielast.base.errors import (
    DielastWarning,
    InputError,
    Mistakes,
    NumericsError,
    Problem,
    in_keys,
    similar,
    warn,
)

STEP = ("hold", "table", "duration", "waveform", "period", "cycles", "stretch", "rate", "low", "high", "points_per_decade")
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
    assert similar(wrong, STEP) == meant
