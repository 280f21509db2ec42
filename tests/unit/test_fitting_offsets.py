"""The spread of the vertical offsets of whole curves: neither scatter that noise alone explains, nor ever less than nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.characterise import masterfit
from dielast.characterise.masterfit import LOOSE, Points, fit_master
from dielast.characterise.robust import Weights

Array = NDArray[np.float64]

TRUTH = np.array([3.0, 1.5, 0.0, -1.2, -2.5])
M, SIZE = TRUTH.size, 30
OFFSET = np.array([1.0, -0.7, 0.4, -0.9, 0.6])
OFFSET = OFFSET / OFFSET.std(ddof=1)
NOISY = 4


def measured(noise: Array, error: Array, offset: Array) -> Points:
    """Curves so wavy that sliding them along and up are far from the same; of each, the `noise` and the `offset` in decades.

    `error` (M, SIZE) is in units of the noise.
    """
    curve, x = np.repeat(np.arange(M), SIZE), np.tile(np.linspace(0.0, 3.0, SIZE), M)
    u = x - TRUTH[curve]
    y = 7 - 0.4 * u + 0.3 * np.sin(2 * u) + offset[curve] + noise[curve] * error.ravel()
    return Points(curve, x, y, noise[curve] ** 2, M, np.zeros_like(curve), np.ones(u.size))


def uneven(tight: float, noisy: float) -> Array:
    return np.where(np.arange(M) == NOISY, noisy, tight)


def spread_of(points: Points, anchor: int) -> float:
    """What is first taken for the spread, the shifts fitted alone and every point weighted as is due to it."""
    theta = np.concatenate((TRUTH, np.zeros(M)))
    free = np.delete(np.arange(2 * M), [anchor, M + anchor])
    along, both = (masterfit._Prior(theta, np.full(2 * M, LOOSE), some) for some in (free[: M - 1], free))
    one = np.ones(theta[points.curve].size)
    state = masterfit._assemble(points, theta, along, Weights(1 / points.variance, one, points.variance, one, 0.0), 0.25)
    for _ in range(3):
        state, _ = masterfit._step(points, along, state)
    return masterfit._offset_spread(points, state, both, anchor)


@pytest.mark.parametrize("anchor", [2, NOISY])
def test_the_spread_is_unbiased_where_a_noisy_curve_scatters_as_much(anchor: int) -> None:
    """Mean square over repetitions, within three of its own standard errors of that of the offsets that were made.

    One curve's offset is known to 1.3 times their spread only, which adds a third to the mean square. They are small, so that all
    is linear, and far above the noise of the other curves, so that none is missed: that would be a choice among the repetitions.
    """
    repetitions, spread = 200, 2e-3
    ratio = np.empty(repetitions)
    for seed in range(repetitions):
        rng = np.random.default_rng(seed)
        offset = spread * rng.permutation(OFFSET)
        ratio[seed] = spread_of(measured(uneven(4e-4, 1e-2), rng.standard_normal((M, SIZE)), offset), anchor) / spread
    assert ratio.min() > 0
    square = ratio**2
    stderr = square.std(ddof=1) / np.sqrt(repetitions)
    assert 3 * stderr < 0.33 / 2  # so many repetitions that the third would show
    assert abs(square.mean() - 1) < 3 * stderr


@pytest.mark.parametrize("anchor", [2, NOISY])
def test_noise_alone_makes_no_offsets(anchor: int) -> None:
    """The chance is one in 100 000 for each of the repetitions."""
    for seed in range(100):
        error = np.random.default_rng(seed).standard_normal((M, SIZE))
        assert spread_of(measured(uneven(4e-4, 1e-2), error, np.zeros(M)), anchor) == 0


@pytest.mark.parametrize("anchor", [2, NOISY])
def test_an_offset_that_is_sure_but_less_than_the_noise_of_another_curve_has_no_spread(anchor: int) -> None:
    """A tight curve 2 % off is no chance, yet all offsets together scatter less than the noise of one curve lets expect.

    Errors take turns in sign, so that the noisy curve has no offset although it might have one of 6 %.
    """
    offset = np.log10(1.02) * (np.arange(M) == 1)
    error = np.tile((-1.0) ** np.arange(SIZE), (M, 1))
    noise = 1e-3
    alike, points = (measured(uneven(noise, noisy), error, offset) for noisy in (noise, 0.1))
    assert spread_of(alike, anchor) == pytest.approx(offset.std(ddof=1), abs=noise / np.sqrt(SIZE))
    assert spread_of(points, anchor) == 0
    fit = fit_master(points, TRUTH, anchor, False)
    assert fit.offset_spread == 0
    assert np.all(np.isfinite(fit.shift))
    assert np.all(np.isfinite(fit.covariance))
    assert np.all(np.isfinite(fit.residual))
