"""What a measured curve shows about its rest: elastic curves of known slack, offset and sign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dielast import MeasuredTest
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
    # compressed specimens take work, too
    assert not gives_work(MeasuredTest("pressed", STRETCH - 1, 1 / STRETCH, 3e4 * (1 / STRETCH - STRETCH**2), 20.0))
