from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dielast import InputError, Step, creep, read_material, relax
from dielast.io.files import resolve

VHB = read_material(resolve(Path(), "example:vhb4905.toml"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"material": []}, "a Material, or a list of them, is needed"),
        ({"steps": Step(stress=1e4)}, "a list of steps is needed"),
        ({"steps": []}, "at least one step"),
        ({"steps": [3]}, "step 0: 3: a Step is needed"),
        ({"steps": [Step(stress=(5e4,))]}, "step 0: a stress of 1 values: a tuple is a pair"),  # type: ignore[arg-type]
        ({"steps": [Step(stress=(1e4, 2e4, 3e4))]}, "step 0: a stress of 3 values"),  # type: ignore[arg-type]
        ({"steps": [Step(stress=1e4, duration="1 s")]}, 'step 0: duration: "1 s": a number in SI units'),  # type: ignore[arg-type]
        ({"steps": [Step(stress=np.ones((2, 2)))]}, "step 0: stress: an array of shape (2, 2)"),
        ({"steps": [Step(stress=[])]}, "step 0: stress: an array of shape (0,)"),
        ({"temperature": np.ones((2, 2))}, "temperature: an array of shape (2, 2)"),
        ({"temperature": []}, "temperature: an array of shape (0,)"),
        ({"temperature": "20 degC"}, 'temperature: "20 degC": a number'),
        ({"points_per_decade": 1.5}, "a whole number of at least one is needed"),
        ({"rtol": 1.0}, "rtol: 1 is not between"),
        ({"times": [-1.0]}, "output times must be finite and not negative"),
        ({"times": [1e9]}, "lies after the end of the history"),
        ({"mode": "sideways"}, "mode: 'sideways' is not one of"),
    ],
)
def test_wrong_arguments_are_input_errors(arguments: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"material": VHB, "steps": [Step(stress=1e4, duration=1.0)]} | arguments
    with pytest.raises(InputError) as caught:
        creep(given.pop("material"), given.pop("steps"), **given)
    assert message in str(caught.value)


def test_a_list_is_cases_and_a_tuple_is_axes() -> None:
    cases = relax(VHB, [Step(stretch=[2.0, 3.0], duration=1.0)], points_per_decade=2)
    assert cases.stretch_1[:, -1] == pytest.approx([2.0, 3.0])
    axes = relax(VHB, [Step(stretch=(2.0, 3.0), duration=1.0)], points_per_decade=2)
    assert (axes.stretch_1[0, -1], axes.stretch_2[0, -1]) == pytest.approx((2.0, 3.0))
