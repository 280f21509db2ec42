"""Lines of the time to failure over voltage: two laws, how good each is, and which of them a figure draws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat import failure_map

from dielast import FailureMap, Material, Spectrum, fit_lifetime
from dielast.material.damage import InversePower
from dielast.material.shift import NoShift
from dielast.plots.failure_map import plot_failure_map
from dielast.simulate.lifetime import EXPONENTIAL_LAW, MARKER, POWER_LAW, ROOM

VOLTAGE = np.linspace(3e3, 5e3, 11)
EXPONENTIAL = 10 ** (12 - 2.5e-3 * VOLTAGE)
POWER = 1e3 * (VOLTAGE / 4e3) ** -17.5


def a_map(*times: np.ndarray) -> FailureMap:
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
    exponential, power, some = fit_lifetime(a_map(EXPONENTIAL, POWER, lived))
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
        lines = fit_lifetime(a_map(10 ** (decades + size * MARKER * span * bend)))
        assert lines[0].drawn_law == law
        assert lines.not_drawn() == "" or lines.not_drawn().startswith("1 of 1 lines: no law meets all points")
        figure = plot_failure_map(a_map(10 ** (decades + size * MARKER * span * bend)), lines)
        legend = figure.axes[0].get_legend()
        assert legend is not None
        note = legend.get_title().get_text()
        assert note == ("lines: inverse power law" if law else "without a line: no law meets all points")
        laws = [line for line in figure.axes[0].get_lines() if line.get_linestyle() not in ("None", "none")]
        assert len(laws) == bool(law)


def test_few_points_and_a_film_that_fails_without_a_voltage() -> None:
    two = np.where(VOLTAGE > 4.7e3, EXPONENTIAL, np.nan)
    one, none = np.where(VOLTAGE > 4.9e3, EXPONENTIAL, np.nan), np.full(VOLTAGE.size, np.nan)
    lines = fit_lifetime(a_map(two, one, none))
    assert [line.drawn_law for line in lines] == [EXPONENTIAL_LAW, "", ""]
    assert (lines[0].rms_residual, lines[0].power_rms_residual) == (0.0, 0.0)
    assert np.all(np.isnan([line.aic_difference for line in lines]))
    assert np.all(np.isnan([line.power_exponent for line in lines[1:]]))
    assert lines.not_drawn() == ""
    (grounded,) = fit_lifetime(replace(a_map(EXPONENTIAL), voltage=VOLTAGE - VOLTAGE[0]))
    assert np.isnan(grounded.power_exponent)
    assert grounded.drawn_law == EXPONENTIAL_LAW
