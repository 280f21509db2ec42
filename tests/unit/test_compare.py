from __future__ import annotations

import tomllib
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast import FilmStep, Repeat
from dielast.base.errors import DielastWarning, InputError
from dielast.cli.run import compute
from dielast.commands.actuate.run import use_columns
from dielast.commands.membrane.recipe import RelaxRecipe
from dielast.commands.registry import read_cases
from dielast.commands.simulation.compare import Fine, check_comparison, compare_headline, match
from dielast.commands.simulation.pictures import _Curve
from dielast.commands.simulation.recipe import CompareSection
from dielast.commands.simulation.timed_steps import TimedStep, TimedSteps
from dielast.io.files import Inputs
from dielast.recipe.cases import Case
from dielast.sharing.execution import Execution

TIME = np.geomspace(0.1, 1000, 200)
X, Y = "time [s]", "nominal_stress_1 [Pa]"


def given(columns: dict[str, np.ndarray]) -> Fine:
    """A simulation that is known at the times of `columns`, and straight in between."""

    def fine(times: np.ndarray | None) -> dict[str, np.ndarray]:
        if times is None:
            return columns
        within = times[(times >= columns[X][0]) & (times <= columns[X][-1])]
        found = {name: np.exp(np.interp(np.log(within), np.log(columns[X]), np.log(values))) for name, values in columns.items()}
        return found | {X: within}

    return fine


def compare(folder: Path, rows: str, x: str = X, **options: object) -> CompareSection:
    (folder / "m.csv").write_text(rows)
    return CompareSection.model_validate({"file": "m.csv", "x": x, "y": Y, **options}, context={"folder": folder})


def test_columns_may_be_called_otherwise_and_rows_be_chosen(tmp_path: Path) -> None:
    rows = "id;t;s\n7;1,5;100\n8;2,5;200\n8;3,5;300\n"
    options = {"x_column": "t", "y_column": "s", "units": {"x": "s", "y": "Pa"}, "where": {"id": 8}}
    found = match(compare(tmp_path, rows, **options), (known := {X: TIME, Y: TIME}), Inputs(tmp_path), given(known))
    assert found.x.tolist() == [2.5, 3.5]
    assert found.y.tolist() == [200.0, 300.0]
    options["where"] = {"id": 9}
    with pytest.raises(InputError, match="no row has id = 9"):
        match(compare(tmp_path, rows, **options), (known := {X: TIME, Y: TIME}), Inputs(tmp_path), given(known))


def test_loading_and_unloading_are_matched_branch_by_branch(tmp_path: Path) -> None:
    up, down = np.linspace(1, 3, 50), np.linspace(3, 1, 50)
    columns = {"stretch_1 [1]": np.concatenate([up, down]), Y: np.concatenate([10 * up, 5 * down])}
    rows = "stretch_1,nominal_stress_1 [Pa]\n1.5,1\n2.5,1\n2.9,1\n2.5,1\n1.5,1\n"
    found = match(compare(tmp_path, rows, "stretch_1 [1]"), columns, Inputs(tmp_path), given(columns))
    np.testing.assert_allclose(found.model, [15, 25, 29, 12.5, 7.5])


def test_points_out_of_reach_are_left_out_with_a_warning(tmp_path: Path) -> None:
    rows = f"{X},{Y}\n0.01,1\n1,1\n"
    with pytest.warns(DielastWarning, match="does not reach 1 of 2 points"):
        found = match(compare(tmp_path, rows), (known := {X: TIME, Y: np.ones(TIME.size)}), Inputs(tmp_path), given(known))
    assert found.rms_error == 0
    with pytest.raises(InputError, match="reaches none of the 1 points"):
        match(compare(tmp_path, f"{X},{Y}\n0.01,1\n"), (known := {X: TIME, Y: TIME}), Inputs(tmp_path), given(known))


def test_unknown_columns_are_told(tmp_path: Path) -> None:
    known, one = {X: TIME, Y: TIME}, compare(tmp_path, "strain,y\n1,1\n", "strain [1]")
    with pytest.raises(InputError, match=r'^compare\[2\].x: "strain \[1\]" is no column of the result; there are time \[s\]'):
        match(one, known, Inputs(tmp_path), given(known), "compare[2]")


def recipe(folder: Path, rows: str, **options: object) -> list[Case[RelaxRecipe]]:
    """Three cases of an hour, compared with these points."""
    (folder / "m.csv").write_text(rows)
    steps = [{"stretch": 2.0, "rate": "12.5 %/s"}, {"hold": "3592 s"}]
    keys = {
        "kind": "relax",
        "material": "example:vhb4905.toml",
        "step": steps,
        "compare": [{"file": "m.csv", "x": X, "y": Y, **options}],
    }
    return [Case(RelaxRecipe.model_validate(keys, context={"folder": folder}))] * 3


def test_a_case_that_is_not_there_is_told_by_its_key(tmp_path: Path) -> None:
    cases = recipe(tmp_path, f"{X},{Y}\n1,1\n", case=3)
    with pytest.raises(InputError, match=r"^compare\[1\].case: 3: cases are numbered from 0, and the last is 2$"):
        check_comparison(1, cases[0].recipe.compare[0], cases, Inputs(tmp_path))


def test_points_after_the_last_step_are_told_before_anything_is_solved(tmp_path: Path) -> None:
    cases = recipe(tmp_path, f"{X},{Y}\n3600,1\n1e6,1\n")
    check_comparison(0, cases[0].recipe.compare[0], cases, Inputs(tmp_path))
    cases = recipe(tmp_path, f"{X},{Y}\n3601,1\n1e6,1\n")
    with pytest.raises(InputError, match=r"m.csv: the steps end at 3600 s, before the first of the 2 points at 3601 s"):
        check_comparison(0, cases[0].recipe.compare[0], cases, Inputs(tmp_path))


def test_advice_that_is_followed_already_is_not_given(tmp_path: Path) -> None:
    rows = f"id,{X},strain,{Y}\n" + "".join(f"1,{t},{s},1\n" for t, s in ((1, 1), (9, 3), (2, 1), (8, 3), (1, 1), (9, 3)))
    columns = {X: TIME, "strain": np.linspace(1, 3, TIME.size), Y: TIME}
    advice = {}
    for x in (X, "strain"):
        for where in ({}, {"id": 1}):
            with pytest.raises(InputError) as caught:
                match(compare(tmp_path, rows, x, where=where), columns, Inputs(tmp_path), given(columns))
            advice[x, bool(where)] = str(caught.value).rpartition(": ")[2]
    assert advice == {
        (X, False): "choose one curve (where)",
        (X, True): "choose one curve (by more columns in where)",
        ("strain", False): "choose one curve (where), or compare over time",
        ("strain", True): "choose one curve (by more columns in where), or compare over time",
    }


def test_points_that_the_misfit_leaves_out_are_counted_apart(tmp_path: Path) -> None:
    columns = {X: TIME, Y: np.ones(TIME.size)}
    whole = match(compare(tmp_path, f"{X},{Y}\n1,2\n10,2\n"), columns, Inputs(tmp_path), given(columns))
    known = {"y": Y, "case": 0}
    assert compare_headline([whole]) == known | {"points": 2, "rms_error": 1.0, "rms_relative_error": 0.5}
    with pytest.warns(DielastWarning, match="does not reach 1 of 3 points"):
        part = match(compare(tmp_path, f"{X},{Y}\n1,2\n10,2\n1e6,9\n"), columns, Inputs(tmp_path), given(columns))
    assert compare_headline([part]) == known | {"points": 2, "points_left_out": 1, "rms_error": 1.0, "rms_relative_error": 0.5}
    assert compare_headline([whole, part])["points"] == [2, 2]
    assert compare_headline([whole, part])["points_left_out"] == [0, 1]


STRETCHED = "stretch_1 [1]"


@pytest.mark.parametrize("header", ["strain [%]", "Dehnung (%)", "elongation", "y", "stretch", "Dehnungsverhältnis", "lambda [1]"])
@pytest.mark.parametrize("factor", [0.0, 1.0, 100.0])  # on the strain; 0 stands for stretches
def test_a_strain_is_not_compared_with_a_stretch_without_a_word(tmp_path: Path, header: str, factor: float) -> None:
    strain = np.linspace(0.2, 0.4, 9)
    values = factor * strain if factor else 1 + strain
    # per cent that are said to be such are strains of 0.2 to 0.4
    doubted = factor > 0 or "strain" in header or "(%)" in header or header == "elongation"
    rows = f"time [s],{header}\n" + "".join(f"{t + 1},{value}\n" for t, value in enumerate(values.tolist()))
    comparison = compare(tmp_path, rows, y=STRETCHED, y_column=header)
    columns = {X: TIME, STRETCHED: 1 + 0.1 * TIME**0.1}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        match(comparison, columns, Inputs(tmp_path), given(columns))
    said = [str(one.message) for one in caught]
    assert ["compared with a stretch, which is 1 + strain" in one for one in said] == [True] * doubted


def test_the_headline_says_what_is_compared(tmp_path: Path) -> None:
    columns = {X: TIME, Y: 1e4 * TIME**-0.1, STRETCHED: TIME**0.1}
    rows = f"time [s],stress [Pa],stretch\n1,1e4,1\n10,{1e4 * 10**-0.1},{10**0.1}\n"
    stress, stretch = ({"y": Y, "y_column": "stress"}, {"y": STRETCHED, "y_column": "stretch"})
    found = [match(compare(tmp_path, rows, **one), columns, Inputs(tmp_path), given(columns)) for one in (stress, stretch)]
    assert compare_headline(found) | {"rms_error": 0, "rms_relative_error": 0} == {
        "y": [Y, STRETCHED],
        "case": [0, 0],
        "points": [2, 2],
        "rms_error": 0,
        "rms_relative_error": 0,
    }
    assert compare_headline(found[:1])["y"] == Y


LAPS = """
kind = "actuate"
material = "example:vhb4905"
film = { thickness = "1 mm", prestretch = 1.5, relax = "10 min" }
step = [{ stretch = 2.5, duration = "2 s" }, { voltage = "1 kV", duration = "1 s" }, { voltage = "0 V", duration = "1 s" }]
repeat = { times = 3 }
stop = { at = "end" }
compare = [{ file = "points.csv", x = "time [s]", y = "nominal_stress_1 [Pa]", y_column = "stress" }]
"""


def stated(times: int) -> Any:
    """Edges that go from 1 to 3 and back to 2 at a rate, with a voltage in between: 6 s at first, then 4 s each time."""
    programme = [
        FilmStep(stretch=3.0, rate=0.5),
        FilmStep(voltage=1e3, duration=1.0),
        FilmStep(stretch=2.0, voltage=0.0, rate=-1.0),
    ]
    steps, begin, before, edges = [], 0.0, 0.0, (1.0, 1.0)
    for number, step in enumerate(programme):
        timed = TimedStep(step, number, begin, before, edges)
        begin, before, edges = timed.end, timed.after, timed.stretched
        steps.append(timed)
    return SimpleNamespace(steps=TimedSteps(steps, Repeat(times)), recipe=SimpleNamespace(output=SimpleNamespace(times=None)))


@pytest.mark.parametrize(
    ("time", "cycles", "actuated"), [(3.0, 0.5, 0.0), (6.0, 1.0, 2.0), (8.0, 1.5, 2.0), (10.0, 2.0, 4.0), (18.0, 4.0, 8.0)]
)
def test_a_repeated_step_at_a_rate_begins_where_the_cycle_ends(time: float, cycles: float, actuated: float) -> None:
    found = use_columns(np.zeros(1, dtype=np.intp), np.array([time]), [stated(10)])
    assert [column.values[0] for column in found] == pytest.approx([cycles, actuated])


def test_the_line_of_a_figure_breaks_where_laps_are_left_out() -> None:
    case = stated(6)
    rows = np.array([0.0, 4.0, 5.0, 6.0, 20.0, 21.0, 22.0, 24.0, 25.0, 26.0])  # laps 1, 5 and 6 of 6
    broken = _Curve(case, case.steps, {"time [s]": rows}, None, ()).left_out(rows)
    assert rows[broken].tolist() == [6.0]


def test_measured_points_of_later_laps_are_compared(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("time [s],stress [Pa]\n5,1e5\n9.5,1e5\n12,1e5\n")
    path = tmp_path / "cycles.toml"
    path.write_text(LAPS)
    report = compute("actuate", read_cases(path), path, (), Execution())[0]
    compared = tomllib.loads(report["summary.toml"].decode())["compare"]
    assert (compared["points"], compared.get("points_left_out", 0)) == (3, 0)
