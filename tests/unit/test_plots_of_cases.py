"""Figures of few and of many cases: what tells the cases apart, and that matplotlib has nothing to complain of."""

from __future__ import annotations

from io import BytesIO
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dielast.commands.membrane.recipe import RelaxRecipe
from dielast.commands.simulation.naming import swept
from dielast.commands.simulation.pictures import _Curve
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.plots.events import Curve, Mark
from dielast.plots.looks import Swept
from dielast.plots.simulation import plot_cases
from dielast.plots.texts import axis_of, number
from dielast.recipe.cases import Case

TIME = np.geomspace(1e-2, 1e3, 20)


def figure_of(
    cases: Any,
    labels: Any,
    measured: Any,
    x: str,
    y: str,
    scales: Any = ("log", "linear"),
    marks: Any = (),
    bands: Any = (),
    spans: Any = (),
    **more: Any,
) -> Figure:
    """The figure of columns of cases; `marks` are the case, the name, x and y of each event, `spans` those of the first of them."""
    of_case: list[list[Mark]] = [[] for _ in cases]
    for (case, *mark), span in zip_longest(marks, spans):
        of_case[case].append(Mark(*mark, span))
    all_bands = [*bands, *[None] * (len(cases) - len(bands))]
    shown = zip(labels, cases, all_bands, of_case, strict=True)
    found = [Curve(label, case[x], case[y], band, of) for label, case, band, of in shown]
    return plot_cases(found, x, y, scales, measured=measured, **more)


def drawn(count: int, scales: list[Swept], label: str = "rate = {} %/s", **others: Any) -> Figure:
    cases = [{"time [s]": TIME, "stretch_1 [1]": 1 + 0.1 * (case + 1) * TIME**0.1} for case in range(count)]
    marks = [(case, name, 10.0, 1.5) for case in range(count) for name in ("breakdown", "pull-in")]
    labels = [label.format(case) for case in range(count)]
    return figure_of(cases, labels, [], "time [s]", "stretch_1 [1]", marks=marks, swept=scales, **others)


def curves(axes: Axes) -> list[Line2D]:
    """The lines that are no events."""
    return [line for line in axes.get_lines() if line.get_linestyle() != "None"]


def named(figure: Figure) -> list[str]:
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend() is not None)]
    return [text.get_text() for legend in legends if legend is not None for text in legend.get_texts()]


@pytest.mark.parametrize("count", [8, 200])
def test_many_cases_of_one_quantity_have_a_colour_bar(count: int) -> None:
    figure = drawn(count, [Swept("rate [%/s]", tuple(map(float, range(count))))])
    assert named(figure) == ["breakdown", "pull-in"]
    bar = figure.axes[1]
    assert bar.get_ylabel() == "rate [%/s]"
    ticks = [float(label.get_text()) for label in bar.get_yticklabels()]
    assert 4 <= len(ticks) <= 8
    assert ticks[0] == 0
    assert len(set(np.diff(ticks))) == 1


@pytest.mark.trust
def test_a_second_quantity_is_spread_over_panels() -> None:
    first = Swept("prestretch", tuple(np.repeat([1.2, 1.4, 1.6, 1.8], 9)))
    second = Swept("voltage [kV]", tuple(np.tile(np.linspace(2, 6, 9), 4)))
    figure = drawn(36, [first, second])
    assert named(figure) == ["breakdown", "pull-in"]
    assert [axes.get_title("left") for axes in figure.axes[:4]] == [f"prestretch = {value}" for value in (1.2, 1.4, 1.6, 1.8)]
    assert [len(curves(axes)) for axes in figure.axes[:4]] == [9] * 4
    assert figure.axes[4].get_ylabel() == "voltage [kV]"


@pytest.mark.parametrize("label", ["material = {}", "a name that is far too long for the width of a column, of number {} and on"])
def test_cases_without_a_scale_are_named_in_part(label: str) -> None:
    texts = named(drawn(36, [], label))
    assert texts[6:] == ["and 30 more", "breakdown", "pull-in"]
    assert max(map(len, texts)) < 60


def test_rendering_is_silent_and_reproducible() -> None:
    figures = [
        drawn(12, [], title="a title of $ 5 and of more words than there is room for in one line of a column") for _ in range(2)
    ]
    saved = [BytesIO(), BytesIO()]
    for figure, buffer in zip(figures, saved, strict=True):
        figure.savefig(buffer)
    assert saved[0].getvalue() == saved[1].getvalue()


def test_swept_quantities_keep_the_unit_of_the_recipe() -> None:
    recipe: Any = None

    def cases(key: str, values: list[object]) -> list[Case[Any]]:
        return [Case(recipe, {key: value}) for value in values]

    (kilo,) = swept(cases("step.0.voltage", ["2 kV", "2.5 kV"]))
    assert (kilo.label, kilo.values) == ("voltage [kV]", (2.0, 2.5))
    (mixed,) = swept(cases("step.0.voltage", ["900 V", "2.5 kV"]))
    assert (mixed.label, mixed.values) == ("voltage [kV]", (0.9, 2.5))
    (plain,) = swept(cases("film.prestretch", [1.5, 2]))
    assert (plain.label, plain.values) == ("prestretch", (1.5, 2.0))
    (cold,) = swept(cases("temperature", ["-20 degC", "20 degC"]))
    assert (cold.label, cold.values, cold.text(0)) == ("temperature [°C]", (-20.0, 20.0), "temperature = \N{MINUS SIGN}20 °C")
    (times,) = swept(cases("step.0.hold", ["10 min", "1 h"]))
    assert (times.label, times.values, times.texts) == ("hold [s]", (600.0, 3600.0), ("hold = 10 min", "hold = 1 h"))
    (named,) = swept(cases("material", ["a.toml", "b.toml"]))
    assert (named.values, named.texts) == ((), ("material = a.toml", "material = b.toml"))
    assert swept([Case(recipe)]) == []


def test_a_bar_within_its_mark_is_not_promised() -> None:
    cases = [{"time [s]": TIME, "stretch_1 [1]": 1 + 0.1 * TIME**0.1}]
    for span, line in (((499.0, 501.0), "None"), ((300.0, 900.0), "-")):
        figure = figure_of(
            cases, [""], [], "time [s]", "stretch_1 [1]", ("linear", "linear"), marks=[(0, "breakdown", 500.0, 1.18)], spans=[span]
        )
        (legend,) = figure.legends
        handle = legend.legend_handles[1]
        assert isinstance(handle, Line2D)
        assert handle.get_linestyle() == line


def test_the_unit_of_a_quantity_follows_its_kind_and_its_range() -> None:
    assert axis_of("voltage [V]", [np.array([0.0, 900.0])]) == ("voltage [kV]", 1e-3)
    assert axis_of("voltage [V]", [np.array([0.0, 80.0])]) == ("voltage [V]", 1.0)
    assert axis_of("nominal_stress_1 [Pa]", [np.array([-5e6, np.nan]), np.array([])]) == ("nominal stress [kPa]", 1e-3)
    assert axis_of("nominal_stress_1 [Pa]", [np.array([1e4]), np.array([-2e7])]) == ("nominal stress [MPa]", 1e-6)
    assert axis_of("relaxation_modulus [Pa]", [np.array([1e4])]) == ("relaxation modulus [MPa]", 1e-6)
    assert axis_of("stretch_2 [1]") == ("stretch along axis 2", 1.0)


def test_six_bands_of_two_factors_share_panels_by_one_of_them() -> None:
    scales = [Swept("prestretch", (1.7, 1.7, 1.7, 1.9, 1.9, 1.9)), Swept("voltage [kV]", (3.0, 3.2, 3.4) * 2)]
    bands = [(TIME, 0.95 * (1 + 0.1 * TIME**0.1), 1.05 * (1 + 0.1 * TIME**0.1))] * 6
    figure = drawn(6, scales, bands=bands)
    assert [axes.get_title("left") for axes in figure.axes] == ["prestretch = 1.7", "prestretch = 1.9"]
    assert named(figure)[:3] == ["voltage = 3 kV", "voltage = 3.2 kV", "voltage = 3.4 kV"]
    # more than there is room for: some, and it is said
    many = drawn(36, [Swept("rate [%/s]", tuple(map(float, range(36))))], bands=bands * 6)
    assert len(many.axes) == 12
    (legend,) = many.legends
    assert legend.get_title().get_text() == "12 of 36 cases"


def test_the_legend_of_one_disordered_quantity_ascends() -> None:
    figure = drawn(3, [Swept("voltage [kV]", (3.0, 1.0, 2.0))], "voltage = {} kV")
    assert named(figure)[:3] == ["voltage = 1 kV", "voltage = 2 kV", "voltage = 0 kV"]  # the labels are those of cases 1, 2, 0


def test_an_event_has_a_bar_for_its_time() -> None:
    cases = [{"time [s]": TIME, "stretch_1 [1]": 1 + 0.1 * TIME**0.1}]
    marks = [(0, "breakdown", 500.0, 1.18), (0, "pull-in", 800.0, 1.19), (0, "loss-of-tension", 900.0, 1.195)]
    spans = [(200.0, 2000.0), (300.0, np.inf), (np.inf, np.inf)]
    for scale in ("linear", "log"):
        figure = figure_of(cases, [""], [], "time [s]", "stretch_1 [1]", (scale, "linear"), marks=marks, spans=spans)
        axes = figure.axes[0]
        bars = {
            float(np.asarray(line.get_ydata())[0]): np.asarray(line.get_xdata())
            for line in axes.get_lines()
            if line.get_marker() == "|"
        }
        assert bars.keys() == {1.18, 1.19}
        assert bars[1.18].tolist() == [200.0, 2000.0]
        # what may never come goes on to the end of the axis, and has a tip there
        (tip,) = [line for line in axes.get_lines() if line.get_marker() == ">"]
        (end,) = np.asarray(tip.get_xdata()).tolist()
        assert bars[1.19].tolist() == [300.0, end]
        assert axes.get_xlim()[1] == pytest.approx(end)
        assert bars[1.19][1] > 2000


def test_a_bar_from_zero_on_a_log_axis_begins_at_the_first_time() -> None:
    cases = [{"time [s]": TIME, "stretch_1 [1]": 1 + 0.1 * TIME**0.1}]
    figure = figure_of(cases, [""], [], "time [s]", "stretch_1 [1]", marks=[(0, "breakdown", 5.0, 1.18)], spans=[(0.0, 7.0)])
    (bar,) = [line for line in figure.axes[0].get_lines() if line.get_marker() == "|"]
    assert np.asarray(bar.get_xdata()).tolist() == [TIME[0], 7.0]


@pytest.mark.parametrize("count", [1, 3, 12])
def test_measured_points_say_to_which_case_they_belong(count: int) -> None:
    cases = [{"time [s]": TIME, "stretch_1 [1]": 1 + 0.1 * (case + 1) * TIME**0.1} for case in range(count)]
    labels = ["" if count == 1 else f"temperature = {case} °C" for case in range(count)]
    points = count - 1, Curve("measured, a.csv", TIME, 1 + 0.1 * TIME**0.1)
    scales = [Swept("temperature [°C]", tuple(map(float, range(count))))]
    figure = figure_of(cases, labels, [points], "time [s]", "stretch_1 [1]", swept=scales)
    assert named(figure)[-1] == ("measured, a.csv" if count == 1 else f"temperature = {count - 1} °C: measured, a.csv")


def test_a_line_is_broken_at_the_cycles_that_are_left_out_alone(tmp_path: Path) -> None:
    """The rows of a long hold are further apart than a period, and the first rows of a waveform much closer together."""
    wave = {"waveform": "sine", "low": 2.0, "high": 2.5, "period": "20 s", "cycles": 12}
    steps = [{"stretch": 2.0, "rate": "100 %/s"}, {"hold": "599 s"}, wave, {"hold": "600 s"}]
    keys = {"kind": "relax", "material": "example:vhb4905.toml", "step": steps}
    recipe = RelaxRecipe.model_validate(keys, context={"folder": tmp_path})
    held = [0.5, 1.0, 1.0, 100.0, 350.0, 600.0, 600.0]
    cycles = [600.001, 610.0, 620.0, 680.0, 690.0, 700.0]  # the first and the fifth
    after = [840.0, 840.0, 900.0, 1100.0, 1440.0]
    time = np.array([*held, *cycles, *after])
    curve = _Curve(Case(recipe), solver_steps(recipe, Inputs(tmp_path)), {}, None, ())
    assert time[curve.left_out(time)].tolist() == [620.0, 700.0]


def test_a_log_axis_begins_before_the_first_of_few_points() -> None:
    case = {"time [s]": np.array([1.0, 3600.0]), "stretch_1 [1]": np.array([1.2, 1.4])}
    figure = figure_of([case], [""], [], "time [s]", "stretch_1 [1]")
    low, high = figure.axes[0].get_xlim()
    assert 0.1 < low < 1.0 < 3600.0 < high
    assert sum(bool(label.get_text()) for label in figure.axes[0].get_xticklabels()) >= 2


@pytest.mark.parametrize(
    ("times", "values", "labels"),
    [
        (np.linspace(0.0, 1e12, 5), 1.0 + np.arange(5.0), ("time [10¹² s]", "stretch")),
        (np.linspace(0.0, 1e-9, 5), 1.2 + 1e-9 * np.arange(5.0), ("time [10⁻⁹ s]", "stretch \N{MINUS SIGN} 1.2 [10⁻⁹]")),
        (np.arange(5.0), 1.0 + np.arange(5.0), ("time [s]", "stretch")),
    ],
)
def test_what_the_numbers_of_an_axis_leave_out_is_in_its_label(times: Any, values: Any, labels: tuple[str, str]) -> None:
    cases = [{"time [s]": times, "stretch_1 [1]": values}]
    figure = figure_of(cases, [""], [], "time [s]", "stretch_1 [1]", scales=("linear", "linear"))
    for _ in range(2):
        figure.draw_without_rendering()
        axes = figure.axes[0]
        assert (axes.get_xlabel(), axes.get_ylabel()) == labels
        assert not any(axis.offsetText.get_visible() and axis.offsetText.get_text() for axis in (axes.xaxis, axes.yaxis))


def test_axes_without_a_value_say_so() -> None:
    case = {"time [s]": TIME, "stretch_1 [1]": np.full(TIME.size, np.nan)}
    (axes,) = figure_of([case], [""], [], "time [s]", "stretch_1 [1]").axes
    assert [text.get_text() for text in axes.texts] == ["no value to show"]
    assert not len(axes.get_xticks())


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (20000.0, "20000"),
        (123456.0, "123500"),
        (1e6, "10⁶"),
        (-2.5e-5, "\N{MINUS SIGN}2.5\N{MULTIPLICATION SIGN}10⁻⁵"),
        (1.2e-4, "0.00012"),
    ],
)
def test_a_number_in_a_label_has_no_exponent_of_a_program(value: float, text: str) -> None:
    assert number(value) == text
