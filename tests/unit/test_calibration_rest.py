"""What a measured curve shows about its rest: elastic curves of known slack, offset and sign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dielast import Comparison, MeasuredTest
from dielast.calibration.rest import gives_work, slack_of, stress_at_rest

STRETCH = np.linspace(1.0, 3.0, 101)


def pulled(slack: float = 0.0, noise: float = 0.0, offset: float = 0.0) -> MeasuredTest:
    """A neo-Hookean specimen that is taut from a stretch of 1 + slack on."""
    taut = np.maximum(STRETCH - slack, 1.0)
    random = np.random.default_rng(1)
    stress = (taut - taut**-2) * (1 + noise * random.standard_normal(taut.size)) + offset
    return MeasuredTest("pulled", STRETCH * 1.0 - 1.0, STRETCH, 3e4 * stress, 20.0)


def test_slack_is_seen_where_later_points_are_on_steeper_lines_from_rest() -> None:
    assert slack_of(pulled()) == 0
    assert slack_of(pulled(noise=0.01)) < 0.002
    assert slack_of(pulled(0.06)) == pytest.approx(0.06)
    assert slack_of(pulled(0.06, noise=0.01)) == pytest.approx(0.06, rel=0.1)
    # between two points, the bound is that of the last one without a stress
    assert 0.06 <= slack_of(pulled(0.07)) <= 0.07


def test_an_offset_and_a_force_of_the_other_sign_are_seen() -> None:
    assert stress_at_rest(pulled()) == 0
    largest = 3 - 1 / 9
    assert stress_at_rest(pulled(offset=0.2)) == pytest.approx(0.2 / (largest + 0.2))
    assert not gives_work(pulled())
    assert gives_work(replace(pulled(), stress=-pulled().stress))
    # a table of the unloading alone: an elastic curve lies above its chord
    unloaded = MeasuredTest("unloaded", STRETCH, STRETCH[::-1], pulled().stress[::-1], 20.0)
    assert not gives_work(unloaded)
    assert gives_work(replace(unloaded, stress=-unloaded.stress))
    # compressed specimens take work, too
    assert not gives_work(MeasuredTest("pressed", STRETCH - 1, 1 / STRETCH, 3e4 * (1 / STRETCH - STRETCH**2), 20.0))


def test_a_model_without_a_value_or_with_one_has_no_share_of_the_variance() -> None:
    """As of a material that cannot follow the test, or that runs away after its first point."""
    test, nothing = pulled(), np.full(STRETCH.size, np.nan)
    comparison = Comparison(test, False, nothing, nothing, nothing)
    assert np.isnan([comparison.rms_error, comparison.rms_relative_error, comparison.r_squared]).all()
    first = np.where(STRETCH[1] == STRETCH, 2 * test.stress, np.nan)
    comparison = Comparison(test, False, first, nothing, nothing)
    assert (comparison.rms_error, comparison.rms_relative_error) == (test.stress[1], 1.0)
    assert np.isnan(comparison.r_squared)
    # nor a size, if all is 0 there
    at_rest = np.where(STRETCH == 1, 10.0, np.nan)
    assert np.isnan(Comparison(test, False, at_rest, nothing, nothing).rms_relative_error)
