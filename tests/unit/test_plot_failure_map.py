"""The figure of a failure map stays legible, however many films and voltages there are."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.plots.failure_map import plot_failure_map
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import fit_lifetime


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
        time_to_breakdown=time,
        time_to_pull_in=2 * time,
        time_to_failure=time,
        failure_mode=np.full(time.shape, "breakdown"),
        outcome=np.full(time.shape, "completed"),
    )


@pytest.mark.parametrize(
    ("shape", "films"), [((1, 11, 41), 4), ((1, 5, 41), 4), ((1, 2, 41), 2), ((2, 3, 13), 6), ((1, 6, 3), 6), ((7, 11, 41), 6)]
)
def test_points_do_not_crowd(shape: tuple[int, int, int], films: int) -> None:
    result = a_map(*shape)
    axes = plot_failure_map(result, fit_lifetime(result)).axes[0]
    marked = [line for line in axes.get_lines() if line.get_marker() not in ("", "None", None)]
    assert len(marked) == films
    for line in marked:
        every = line.get_markevery()
        assert isinstance(every, list)
        # from the first voltage to the last, evenly
        assert len(every) == min(13, shape[2])
        assert (every[0], every[-1]) == (0, shape[2] - 1)
        assert np.ptp(np.diff(every)) <= 1


def test_the_legend_says_what_the_bands_are() -> None:
    result = a_map(1, 2, 13)
    bounds = (result.time_to_failure / 2, result.time_to_failure * 2)
    legend = plot_failure_map(result, fit_lifetime(result), None, bounds, "90 % interval").axes[0].get_legend()
    assert legend is not None
    assert "bands: 90 % interval" in legend.get_title().get_text()


def test_a_band_that_some_draws_outlive_is_open_above() -> None:
    result = a_map(1, 2, 13)
    upper = result.time_to_failure * 2
    closed = plot_failure_map(result, fit_lifetime(result), None, (result.time_to_failure / 2, upper), "90 % interval").axes[0]
    upper[0, 0, :2] = np.inf
    opened = plot_failure_map(result, fit_lifetime(result), None, (result.time_to_failure / 2, upper), "90 % interval").axes[0]
    legends = [axes.get_legend() for axes in (closed, opened)]
    assert ["open above" in legend.get_title().get_text() for legend in legends if legend is not None] == [False, True]
    assert [len([text for text in axes.texts if text.get_text() == "\N{UPWARDS ARROW}"]) for axes in (closed, opened)] == [0, 2]
    # the band leaves the axes, beyond the horizon
    top = opened.get_ylim()[1]
    assert top > result.horizon
    highest = [max(np.asarray(path.vertices)[:, 1].max() for path in band.get_paths()) for band in opened.collections]
    assert highest[0] >= top > highest[1]
