"""Softening from cycle to cycle is told from relaxation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from machines import QUIET, cycles, hold, softened

from dielast import Gent, Material, MeasuredTest, NeoHookean, NoShift, Spectrum
from dielast.calibration.softening import softening

SOFT = Material("soft", 20e3, Spectrum([100.0, 3.0], [18e3, 40e3]), NoShift(20.0), Gent(110.0), Gent(55.0))
FAST = Material("fast", 30e3, Spectrum([50.0, 1.0, 0.05], [20e3, 60e3, 300e3]), NoShift(20.0), Gent(60.0), Gent(15.0))
PLAIN = Material("plain", 20e3, Spectrum([300.0, 10.0], [40e3, 40e3]), NoShift(20.0), NeoHookean(), NeoHookean())
TIGHT = Material("tight", 20e3, Spectrum([300.0, 10.0], [20e3, 20e3]), NoShift(20.0), Gent(6.0), Gent(6.0))
MATERIALS = pytest.mark.parametrize("material", [SOFT, FAST, PLAIN, TIGHT], ids=lambda material: material.name)


@MATERIALS
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_relaxation_is_no_softening(material: Material, noise: float) -> None:
    random = np.random.default_rng(6)
    for ramp, count, low in ((1.0, 3, 1.0), (10.0, 2, 1.0), (100.0, 2, 1.2)):
        made = cycles(material, replace(QUIET, noise=noise), random, ramp=ramp, count=count, low=low, points=30)
        assert softening(made.test()) == 0.0
        # without force, a film that is longer than at the beginning is slack
        assert softening(made.test(force=np.maximum(made.force, 0.0))) == 0.0
    assert softening(hold(material, replace(QUIET, noise=noise), random).test()) == 0.0


@MATERIALS
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_specimen_that_softens_is_recognised(material: Material, noise: float) -> None:
    for ramp, share in ((1.0, 0.1), (10.0, 0.1), (10.0, 0.4), (100.0, 0.2)):
        made = cycles(material, replace(QUIET, noise=noise), np.random.default_rng(2), ramp=ramp, points=30, slack="pushes")
        found = softening(softened(made, share).test())
        # the mean over the loading is less than the share next to rest
        assert 0.5 * share < found < 1.1 * share
    # a slack specimen recovers further, which hides less than a fifth
    made = cycles(material, replace(QUIET, noise=noise), np.random.default_rng(2), ramp=10.0, points=30)
    assert 0.2 < softening(softened(made, 0.4).test()) < 0.44


def test_one_loading_does_not_show_softening() -> None:
    made = softened(cycles(SOFT, QUIET, np.random.default_rng(2), count=1), 0.4)
    assert softening(made.test()) == 0.0
    test = made.test()
    assert softening(MeasuredTest("field", test.time, test.stretch, test.stress, 20.0, nominal_field=1e7)) == 0.0
