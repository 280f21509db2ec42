"""The figure of a failure map stays legible, however many films and voltages there are, and its lines are honest."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from films import SOFT
from flat import failure_map
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dielast import Material, Spectrum
from dielast.material.damage import InversePower
from dielast.material.shift import NoShift
from dielast.plots.failure_map import decade_name, plot_failure_map
from dielast.plots.operating_map import plot_operating_map
from dielast.plots.style import COLOURS
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import EXPONENTIAL_LAW, MARKER, POWER_LAW, ROOM, fit_lifetime

UP, DOWN = r"$\uparrow$", r"$\downarrow$"


def a_map(temperatures: int, prestretches: int, voltages: int) -> FailureMap:
    voltage = np.linspace(3000.0, 5000.0, voltages)
    prestretch = np.repeat(np.linspace(1.7, 1.9, prestretches)[:, None], 2, axis=1)
    temperature = 20.0 + 10.0 * np.arange(temperatures)
    time = 10.0 ** (9 - voltage / 700 - 2 * prestretch[:, :1] + 0.02 * temperature[:, None, None])
    return FailureMap(
        temperature=temperature,
        prestretch=prestretch,
        voltage=voltage,
        horizon=1e9,
        breakdown_field=np.full(prestretches, 4e7),
        times={"breakdown": time, "pull-in": 2 * time},
        time_to_failure=time,
        failure_mode=np.full(time.shape, "breakdown"),
        outcome=np.full(time.shape, "completed"),
    )


def drawn_lines(axes: Axes) -> list[Line2D]:
    """The lines of markers that are times, not what is beyond them."""
    marked = [line for line in axes.get_lines() if line.get_marker() not in ("", "None", None)]
    return [line for line in marked if line.get_transform() == axes.transData]


def placed(axes: Axes, marker: str) -> dict[str, list[float]]:
    """Voltages in kV by colour of the arrows, or markers, in the rows beyond the times."""
    rows = [line for line in axes.get_lines() if line.get_marker() == marker and line.get_transform() == axes.get_xaxis_transform()]
    return {str(line.get_color()): np.asarray(line.get_xdata()).round(9).tolist() for line in rows if len(line.get_xdata())}


def named(figure: Figure) -> list[list[str]]:
    legends = [axes.get_legend() for axes in figure.axes]
    return [[text.get_text() for text in legend.get_texts()] for legend in legends if legend is not None]


def test_a_band_that_some_draws_outlive_is_open_above() -> None:
    result = a_map(1, 2, 13)
    upper = result.time_to_failure * 2
    closed = plot_failure_map(result, fit_lifetime(result), None, (result.time_to_failure / 2, upper), "90 % interval").axes[0]
    upper[0, 0, :2] = np.inf
    opened = plot_failure_map(result, fit_lifetime(result), None, (result.time_to_failure / 2, upper), "90 % interval").axes[0]
    legends = [axes.get_legend() for axes in (closed, opened)]
    titles = [legend.get_title().get_text() for legend in legends if legend is not None]
    assert ["beyond the horizon" in title for title in titles] == [False, True]
    assert placed(closed, UP) == {}
    # at the voltages themselves
    assert placed(opened, UP) == {COLOURS[0]: (result.voltage[:2] / 1e3).round(9).tolist()}
    # the band leaves the times, beyond the horizon
    assert opened.get_ylim()[1] > result.horizon
    highest = [max(np.asarray(path.vertices)[:, 1].max() for path in band.get_paths()) for band in opened.collections]
    assert highest[0] > result.horizon > highest[1]


def test_a_band_from_zero_reaches_the_foot_and_has_arrows_at_its_voltages() -> None:
    result = a_map(1, 2, 6)
    lower, upper = result.time_to_failure / 2, result.time_to_failure * 2
    lower[0, 0, 3:], lower[0, 1, 4:] = 0.0, 0.0
    figure = plot_failure_map(result, fit_lifetime(result), None, (lower, upper), "90 % interval")
    axes, voltage = figure.axes[0], (result.voltage / 1e3).round(9)
    assert placed(axes, DOWN) == {COLOURS[0]: voltage[3:].tolist(), COLOURS[1]: voltage[4:].tolist()}
    shortest = lower[lower > 0].min()
    for band in axes.collections:
        vertices = np.concatenate([np.asarray(path.vertices) for path in band.get_paths()])
        assert vertices[:, 0].max() == pytest.approx(5.0)
        assert vertices[:, 1].min() < shortest
    # no tick says a time where there is none
    assert min(*axes.get_yticks(), *axes.get_yticks(minor=True)) > axes.get_ylim()[0] * 2
    assert "0" in [text.get_text() for text in axes.texts]
    (legend,) = [own.get_legend() for own in figure.axes]
    assert legend is not None
    assert "\N{DOWNWARDS ARROW} down to 0" in legend.get_title().get_text()
    figure.savefig(BytesIO())


def test_films_that_fail_at_once_have_markers_at_the_foot() -> None:
    result = a_map(1, 2, 6)
    result.time_to_failure[0, 1, 3:] = 0.0
    axes = plot_failure_map(result, fit_lifetime(result)).axes[0]
    assert placed(axes, "s") == {COLOURS[1]: (result.voltage[3:] / 1e3).round(9).tolist()}
    legend = axes.get_legend()
    assert legend is not None
    assert "fails at once" in legend.get_title().get_text()


def test_a_band_at_one_voltage_only_is_seen() -> None:
    result = a_map(1, 2, 6)
    lower, upper = result.time_to_failure / 2, result.time_to_failure * 2
    lower[0, 0, 1:] = upper[0, 0, 1:] = np.inf
    axes = plot_failure_map(result, fit_lifetime(result), None, (lower, upper)).axes[0]
    lines = [own for own in axes.collections if isinstance(own, LineCollection)]
    ((low, high),) = [segment for own in lines for segment in own.get_segments()]
    assert (low[0], high[0]) == (3.0, 3.0)
    assert (low[1], high[1]) == pytest.approx((lower[0, 0, 0], upper[0, 0, 0]))


def test_every_prestretch_is_drawn_equibiaxial_or_not() -> None:
    result = a_map(2, 4, 6)
    result.prestretch[:] = [[3.0, 1.2], [2.0, 1.5], [2.0, 2.0], [1.0, 1.0]]
    result.time_to_failure[:, 3] = np.nan
    result.failure_mode[:, 3] = "none"
    figure = plot_failure_map(result, fit_lifetime(result))
    names = [
        "prestretch 3 \N{MULTIPLICATION SIGN} 1.2",
        "prestretch 2 \N{MULTIPLICATION SIGN} 1.5",
        "prestretch 2",
        "prestretch 1: survives",
    ]
    assert named(figure) == [names, names]
    assert [axes.get_title("right") for axes in figure.axes] == ["20 °C", "30 °C"]
    assert [len(drawn_lines(axes)) for axes in figure.axes] == [3, 3]
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    assert figure.axes[0].get_xlim() == figure.axes[1].get_xlim()


@pytest.mark.parametrize(
    ("shape", "count", "films"),
    [((1, 10, 6), 2, 10), ((3, 4, 6), 3, 12), ((3, 10, 6), 6, 30), ((8, 1, 6), 2, 8), ((8, 2, 6), 4, 16), ((7, 11, 6), 6, 33)],
)
def test_films_are_spread_over_panels_and_what_is_left_out_is_said(shape: tuple[int, int, int], count: int, films: int) -> None:
    result = a_map(*shape)
    result.prestretch[:, 1] = 1.3
    figure = plot_failure_map(result, fit_lifetime(result))
    assert len(figure.axes) == count
    assert sum(map(len, named(figure))) == films
    said = figure.get_supxlabel()
    assert (f"{films} of {shape[0] * shape[1]} films" in said) == (films < shape[0] * shape[1])
    for axes in figure.axes:
        assert len(drawn_lines(axes)) <= 6


@pytest.mark.parametrize(
    ("shape", "said"), [((1, 11, 13), "4 of 11 films; (b) shows all"), ((3, 7, 13), "3 of 21 films; (b) shows all at 20 °C")]
)
def test_lines_beside_a_map_say_what_they_leave_out(shape: tuple[int, int, int], said: str) -> None:
    result = a_map(*shape)
    legend = plot_failure_map(result, fit_lifetime(result)).axes[0].get_legend()
    assert legend is not None
    assert said in legend.get_title().get_text().splitlines()


def test_a_row_of_arrows_names_its_film_within_the_frame() -> None:
    result = a_map(1, 2, 13)
    lower, upper = result.time_to_failure / 2, result.time_to_failure * 2
    upper[0, 0, :3], lower[0, 1, 9:] = np.inf, 0.0
    figure = plot_failure_map(result, fit_lifetime(result), None, (lower, upper), "90 % interval")
    figure.draw_without_rendering()
    (axes,) = figure.axes
    frame = axes.get_window_extent()
    found = {}
    for line in axes.get_lines():
        ends = line.get_transform().transform(np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float))
        assert line.get_clip_on()
        if line.get_marker() in ("o", "s", UP, DOWN) and len(ends) < 13:
            assert np.all((frame.min <= ends) & (ends <= frame.max))
            found[line.get_marker()] = ends[0]
    # the marker of the film beside the first arrow of its row
    for marker, arrow in (("o", UP), ("s", DOWN)):
        assert found[marker][1] == found[arrow][1]
        assert 0 < found[arrow][0] - found[marker][0] < 20


@pytest.mark.parametrize(
    ("exponent", "name"),
    [(-7, "0.1 \N{MICRO SIGN}s"), (-3, "1 ms"), (-1, "0.1 s"), (2, "100 s"), (3, "1000 s (17 min)"), (5, "10⁵ s (1.2 d)")],
)
def test_the_name_of_a_decade(exponent: int, name: str) -> None:
    assert decade_name(exponent) == name


@pytest.mark.parametrize(("lives", "crosses"), [([1.02, 1.05], 0), ([1.02, np.nan], 1)])
def test_an_operating_map_explains_a_cross_only_where_it_has_one(lives: list[float], crosses: int) -> None:
    times = np.full((1, 1, 2), np.nan)
    stretch = np.array(lives)[None, None, None]
    result = failure_map(
        SOFT, voltage=[1e3, 2e3], prestretch=[1.8], thickness=5e-4, horizon=10.0, breakdown_field=1e9, stretch_at={"1 s": 1.0}
    )
    result = replace(result, relative_stretch={"1 s": stretch}, time_to_failure=times)
    labels = [text.get_text() for legend in plot_operating_map(result).legends for text in legend.get_texts()]
    assert sum("highest voltage" in label for label in labels) == crosses


def test_a_map_without_failures_shows_its_voltages() -> None:
    result = a_map(1, 6, 6)
    never = np.full(result.time_to_failure.shape, np.nan)
    survives = replace(result, times={"breakdown": never}, time_to_failure=never, failure_mode=np.full(never.shape, "none"))
    figure = plot_failure_map(survives, fit_lifetime(survives))
    low, high = figure.axes[0].get_xlim()
    assert 2.5 < low <= 3.0 < 5.0 <= high < 5.5
    assert figure.axes[0].get_ylim()[1] >= survives.horizon
    assert "every film survives" in [text.get_text() for text in figure.axes[0].texts]


def test_an_operating_map_shows_films_that_fail_at_once() -> None:
    result = a_map(1, 6, 6)
    zero = np.zeros(result.time_to_failure.shape)
    unknown = {"1 s": np.full((1, *zero.shape), np.nan)}
    at_once = replace(result, times={"breakdown": zero}, time_to_failure=zero, relative_stretch=unknown)
    labels = [text.get_text() for legend in plot_operating_map(at_once).legends for text in legend.get_texts()]
    assert labels == ["fails at once"]


def test_the_label_of_a_short_contour_is_within_the_map() -> None:
    """Only one corner of the map fails within 10 s: the line there is too short for a label on it."""
    result = a_map(1, 5, 16)
    time = 10.0 ** (3.98 - np.add.outer(np.linspace(0, 1, 5), np.linspace(0, 2, 16)))[None]
    cornered = replace(result, times={"breakdown": time}, time_to_failure=time)
    figure = plot_failure_map(cornered, fit_lifetime(cornered))
    figure.draw_without_rendering()
    mapped = figure.axes[1]
    texts = [text for text in mapped.texts if text.get_text()]
    assert "10 s" in [text.get_text() for text in texts]
    frame = mapped.get_window_extent()
    for text in texts:
        extent = text.get_window_extent()
        assert extent.x1 <= frame.x1 + 1
        assert extent.x0 >= frame.x0 - 1


VOLTAGE = np.linspace(3e3, 5e3, 11)
EXPONENTIAL = 10 ** (12 - 2.5e-3 * VOLTAGE)
POWER = 1e3 * (VOLTAGE / 4e3) ** -17.5


def map_of(*times: np.ndarray) -> FailureMap:
    """Films of these times to breakdown at VOLTAGE."""
    time = np.array(times)[None]
    pairs = np.repeat(np.linspace(1.7, 1.9, len(times))[:, None], 2, axis=1)
    modes = np.where(np.isfinite(time), "breakdown", "none")
    outcome = np.full(time.shape, "completed")
    known = {"breakdown": time, "pull-in": np.full(time.shape, np.nan)}
    return FailureMap(np.array([20.0]), pairs, VOLTAGE, 1e9, np.full(len(times), 4e7), known, time, modes, outcome)


def test_a_film_that_does_not_creep_has_the_exponent_of_its_damage_law() -> None:
    silicone = Material("silicone", 1e6, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), permittivity=4e-11)
    silicone = replace(silicone, damage=InversePower(80e6, 3600.0, 18.5))
    film: dict[str, Any] = {"thickness": 0.5e-3, "prestretch": 1.7, "boundary": "clamped", "horizon": 1e12}
    (line,) = fit_lifetime(failure_map(silicone, voltage=np.linspace(8e3, 16e3, 15), **film))
    assert line.power_exponent == pytest.approx(18.5, rel=1e-9)
    assert line.power_intercept == pytest.approx(np.log10(3600.0) + 18.5 * np.log10(80e6 * 0.5e-3 / 1.7**2), rel=1e-9)
    assert line.power_rms_residual < 1e-7
    assert line.power_r_squared == pytest.approx(1.0)
    assert (line.drawn_law, line.aic_difference > 0) == (POWER_LAW, True)
    assert line.drawn(np.array([1e4])) == pytest.approx(3600.0 * (80e6 * 0.5e-3 / 1.7**2 / 1e4) ** 18.5, rel=1e-8)


def test_each_law_describes_its_kind_better_and_what_is_censored_is_not_used() -> None:
    lived = np.where(VOLTAGE > 3.5e3, EXPONENTIAL, np.nan)
    exponential, power, some = fit_lifetime(map_of(EXPONENTIAL, POWER, lived))
    assert (exponential.slope, exponential.intercept) == (pytest.approx(-2.5e-3), pytest.approx(12.0))
    assert (exponential.drawn_law, power.drawn_law) == (EXPONENTIAL_LAW, POWER_LAW)
    assert exponential.aic_difference < 0 < power.aic_difference
    # Akaike's criterion, from the sums of squares
    off = power.power_exponent * (np.log10(VOLTAGE) - np.polyval(np.polyfit(VOLTAGE, np.log10(VOLTAGE), 1), VOLTAGE))
    assert power.rms_residual == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-6)
    assert power.aic_difference == pytest.approx(VOLTAGE.size * np.log(np.mean(off**2) / 1e-12), rel=1e-6)
    assert some.points == np.count_nonzero(VOLTAGE > 3.5e3)
    assert some.slope == pytest.approx(-2.5e-3)


def test_a_line_that_misses_a_point_by_a_marker_is_not_drawn() -> None:
    """A bend of 0.9 and 1.1 of a marker's size off the line that fits best."""
    decades = np.log10(POWER)
    span = float(np.log10(ROOM**2) + np.ptp(decades))
    bend = np.cos(np.pi * np.arange(VOLTAGE.size))  # from point to point, so that no law follows it
    for size, law in ((0.8, POWER_LAW), (1.3, "")):
        lines = fit_lifetime(map_of(10 ** (decades + size * MARKER * span * bend)))
        assert lines[0].drawn_law == law
        assert lines.not_drawn() == "" or lines.not_drawn().startswith("1 of 1 lines: no law meets all points")
        figure = plot_failure_map(map_of(10 ** (decades + size * MARKER * span * bend)), lines)
        legend = figure.axes[0].get_legend()
        assert legend is not None
        note = legend.get_title().get_text()
        assert note == ("lines: inverse power law" if law else "without a line: no law meets all points")
        laws = [line for line in figure.axes[0].get_lines() if line.get_linestyle() not in ("None", "none")]
        assert len(laws) == bool(law)


def test_few_points_and_a_film_that_fails_without_a_voltage() -> None:
    two = np.where(VOLTAGE > 4.7e3, EXPONENTIAL, np.nan)
    one, none = np.where(VOLTAGE > 4.9e3, EXPONENTIAL, np.nan), np.full(VOLTAGE.size, np.nan)
    lines = fit_lifetime(map_of(two, one, none))
    assert [line.drawn_law for line in lines] == [EXPONENTIAL_LAW, "", ""]
    assert (lines[0].rms_residual, lines[0].power_rms_residual) == (0.0, 0.0)
    assert np.all(np.isnan([line.aic_difference for line in lines]))
    assert np.all(np.isnan([line.power_exponent for line in lines[1:]]))
    assert lines.not_drawn() == ""
    (grounded,) = fit_lifetime(replace(map_of(EXPONENTIAL), voltage=VOLTAGE - VOLTAGE[0]))
    assert np.isnan(grounded.power_exponent)
    assert grounded.drawn_law == EXPONENTIAL_LAW
