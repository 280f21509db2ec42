from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dielast import (
    Film,
    HeldVoltages,
    InputError,
    Output,
    RelaxationCurve,
    Solver,
    Step,
    VoltageStep,
    actuate,
    build_master_curve,
    creep,
    failure_map,
    read_material,
    relax,
)
from dielast.io.files import resolve

VHB = read_material(resolve(Path(), "example:vhb4905.toml"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"material": []}, "a Material, or a list of them, is needed"),
        ({"steps": Step(stress=1e4)}, "a list of Steps is needed"),
        ({"steps": []}, "at least one step"),
        ({"steps": [3]}, "steps: 3: a Step is needed"),
        ({"steps": [Step(stress=(5e4,))]}, "step 0: a stress of 1 values: a tuple is a pair"),  # type: ignore[arg-type]
        ({"steps": [Step(stress=(1e4, 2e4, 3e4))]}, "step 0: a stress of 3 values"),  # type: ignore[arg-type]
        ({"steps": [Step(stress=np.ones((2, 2)))]}, "step 0: stress: an array of shape (2, 2)"),
        ({"steps": [Step(stress=[])]}, "step 0: stress: an array of shape (0,)"),
        ({"temperature": np.ones((2, 2))}, "temperature: an array of shape (2, 2)"),
        ({"temperature": []}, "temperature: an array of shape (0,)"),
        ({"temperature": "20 degC"}, 'temperature: "20 degC": a number'),
        (lambda: {"output": Output(points_per_decade=1.5)}, "points_per_decade: 1.5: a whole number is needed"),
        (lambda: {"solver": Solver(1.0)}, "rtol: 1 is not between"),
        (lambda: {"output": Output([0.5, 0.1])}, "must ascend"),
        (lambda: {"output": Output([1e9])}, "lies after the end of the history"),
        (lambda: {"output": Output([1.0000001])}, "1.0000001 s lies after the end of the history at 1 s"),
        ({"mode": "sideways"}, "mode: 'sideways' is not one of"),
    ],
)
def test_wrong_arguments_are_input_errors(arguments: Any, message: str) -> None:
    given: dict[str, Any] = {"material": VHB, "steps": [Step(stress=1e4, duration=1.0)]}
    with pytest.raises(InputError) as caught:
        creep(**given | (arguments() if callable(arguments) else arguments))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (np.array([1, 2], dtype="timedelta64[s]"), "time: .* is needed, not durations"),
        (np.array(["2026-01-01", "2026-01-02"], dtype="datetime64[D]"), "is needed, not dates"),
        ([1 + 0j, 2.0], "is needed, not complex numbers"),
        (["1", "2"], "is needed, not text"),
        (np.array(["1", 2.0], dtype=object), "a number in SI units"),
        (np.ma.masked_less([1.0, 2.0], 1.5), r"time: some values are masked: leave them out, by their method"),
        ([[1.0, 2.0]], r"20 degC: times of shape \(1, 2\): a list of numbers is needed"),
        ([[1.0], 2.0], "a number in SI units"),
    ],
)
def test_what_is_no_list_of_numbers_is_refused(time: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        RelaxationCurve(20.0, time, [1e6, 9e5])


def test_arguments_of_a_wrong_type_are_input_errors() -> None:
    step, film, chart = VoltageStep(1e3), Film(5e-4), HeldVoltages(4e3, 10.0)
    series = pd.Series([1.0, 2.0], index=[7, 8])
    assert RelaxationCurve(20, series, np.array([1e6, 9e5], dtype=object)).time.tolist() == [1.0, 2.0]
    curve: Any = RelaxationCurve(20.0, [1.0, 2.0], np.ma.array([1e6, 9e5]))
    wrong: list[tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any], str]] = [
        (build_master_curve, (curve,), {"reference_temperature": 20.0}, "curves: .*a list of Measurements is needed"),
        (build_master_curve, ([1, 2],), {"reference_temperature": 20.0}, "curves: 1: a Measurement is needed"),
        (build_master_curve, (7,), {"reference_temperature": 20.0}, "curves: 7: a list of Measurements is needed"),
        (build_master_curve, ([curve],), {"reference_temperature": 20.0, "drift": "2 %"}, 'drift: "2 %": a number'),
        (build_master_curve, ([curve],), {"reference_temperature": "20 degC"}, 'reference_temperature: "20 degC": a number'),
        (RelaxationCurve, ("20 degC", [1.0], [1.0]), {}, 'temperature: "20 degC": a number'),
        (replace, (VHB,), {"equilibrium_modulus": "26 kPa"}, 'equilibrium_modulus: "26 kPa": a number'),
        (actuate, (VHB, film, step), {}, "steps: .*a list of VoltageSteps or ChargeSteps or FilmSteps is needed"),
        (actuate, (VHB, film, [Step(duration=1.0)]), {}, "steps: .*a list of VoltageSteps or ChargeSteps or FilmSteps is needed"),
        (Film, (5e-4,), {"relax": "10 min"}, 'relax: "10 min": a number'),
    ]
    wrong += [
        (failure_map, (VHB, Film([5e-4, 1e-3], [1.9]), chart), {}, r"thickness: an array of shape \(2,\): one number is needed"),
        (HeldVoltages, (4e3,), {"horizon": "1 h"}, 'horizon: "1 h": a number'),
    ]
    for function, given, named, message in wrong:
        with pytest.raises(InputError, match=message):
            function(*given, **named)


def test_a_long_hold_after_a_short_ramp_has_rows_in_every_decade() -> None:
    history = relax(VHB, [Step(stretch=1.5, duration=1e-8), Step(duration=1e9)], output=Output(points_per_decade=2))
    held = history.time[0][history.time[0] > 1.001e-8] - 1e-8
    assert held[0] < 1e-10
    assert np.diff(np.log10(held)).max() < 1.0


def test_a_list_is_cases_and_a_tuple_is_axes() -> None:
    cases = relax(VHB, [Step(stretch=[2.0, 3.0], duration=1.0)], output=Output(points_per_decade=2))
    assert cases.stretch_1[:, -1] == pytest.approx([2.0, 3.0])
    axes = relax(VHB, [Step(stretch=(2.0, 3.0), duration=1.0)], output=Output(points_per_decade=2))
    assert (axes.stretch_1[0, -1], axes.stretch_2[0, -1]) == pytest.approx((2.0, 3.0))
