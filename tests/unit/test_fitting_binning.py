"""Condensed curves whose points and noise can be written down: power laws, and scatter of a known pattern."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from dielast.relaxation.superposition.binning import BINS_PER_DECADE, POOL, SIGNAL_TO_NOISE, Binned, bin_curves

Array = NDArray[np.float64]
NOISE = np.array([1.0, -1.0, -1.0, 1.0])  # four readings of a bin that no straight line explains
FREEDOM = NOISE.size - 2  # besides the mean and the slope of a line


def dense(level: ArrayLike, amplitude: ArrayLike = 0.0, decade: float = 0.0, pattern: Array = NOISE) -> tuple[Array, Array]:
    """Log time and modulus of bins of one level each, their readings scattering by `amplitude` times the pattern."""
    level, amplitude = np.broadcast_arrays(np.asarray(level, dtype=float), np.asarray(amplitude, dtype=float))
    step = 1 / BINS_PER_DECADE / pattern.size
    x: Array = np.asarray(decade + step * np.arange(level.size * pattern.size), dtype=float)
    return x, (level[:, None] + amplitude[:, None] * pattern).ravel()


def sparse(level: ArrayLike, decade: float = 0.0) -> tuple[Array, Array]:
    """One reading to a bin."""
    level = np.atleast_1d(np.asarray(level, dtype=float))
    return decade + np.arange(level.size) / BINS_PER_DECADE, level


def binned(*curves: list[tuple[Array, Array]]) -> Binned:
    """Bin curves that are made of pieces."""
    x, modulus = (np.concatenate([piece[k] for curve in curves for piece in curve]) for k in (0, 1))
    number = np.repeat(np.arange(len(curves)), [sum(piece[0].size for piece in curve) for curve in curves])
    return bin_curves(number, 10**x, modulus)


def scatter(points: Binned, count: int) -> Array:
    """Variance of one reading, from that of the logarithm of a mean of so many."""
    return np.asarray(points.variance * count * (10**points.log_modulus * np.log(10)) ** 2)


@pytest.mark.parametrize("per_bin", [1, 2, 3, 7])
def test_power_laws_stay_what_they_are(per_bin: int) -> None:
    """Whatever their slope, level and first time: what decays within a bin is no noise, and no curve looks at the next one."""
    step = 1 / BINS_PER_DECADE / per_bin
    size = per_bin * np.array([30, 12, 50])
    start, slope, level = np.array([-1.3, 2.0, 0.4]), np.array([-2.0, -0.1, -0.7]), np.array([9.0, 3.0, -6.0])
    curve = np.repeat(np.arange(3), size)
    x = start[curve] + step * np.concatenate([np.arange(n) for n in size])
    points = bin_curves(curve, 10**x, 10 ** (level[curve] + slope[curve] * x))
    np.testing.assert_array_equal(points.curve, np.repeat(np.arange(3), size // per_bin))
    np.testing.assert_array_equal(points.bin_of_point, np.repeat(np.arange(92), per_bin))
    np.testing.assert_allclose(points.log_time, x.reshape(-1, per_bin).mean(axis=1), atol=1e-12)
    np.testing.assert_allclose(points.log_modulus, level[points.curve] + slope[points.curve] * points.log_time, atol=1e-11)
    assert np.all(points.variance < 1e-4 * step**2)  # what is left is the bend of ten to the power of a line, and rounding


def test_a_decade_has_twenty_points_however_many_were_read() -> None:
    """As the documentation of the residual says; from each curve's own first time on."""
    x = np.linspace(0.3, 3.3, 3001)[:-1]
    points = bin_curves(np.zeros(3000, dtype=np.intp), 10**x, np.ones(3000))
    np.testing.assert_allclose(points.log_time, 0.3 + 0.05 * np.arange(60) + 0.0245, atol=1e-9)


def test_scatter_within_bins_is_the_noise_of_their_means() -> None:
    points = binned([dense(np.full(20, 5.0), 0.01)])
    np.testing.assert_allclose(points.log_modulus, np.log10(5.0), atol=1e-12)
    np.testing.assert_allclose(scatter(points, 4), 4 * 0.01**2 / FREEDOM, rtol=1e-9)
    tiny = binned([dense(np.full(20, 5e-290), 1e-292)])  # whose squares are zero
    assert np.all(np.isfinite(tiny.variance))


def test_a_straight_line_within_a_bin_is_no_noise_but_two_readings_know_of_none() -> None:
    lines = binned([dense(np.full(20, 5.0), 0.01, pattern=np.array([-1.5, -0.5, 0.5, 1.5]))])
    np.testing.assert_allclose(lines.variance, 0.0, atol=1e-20)
    pairs = binned([dense(np.full(20, 5.0), 0.01, pattern=np.array([1.0, -1.0]))])
    np.testing.assert_allclose(scatter(pairs, 2), 2 * 0.01**2, rtol=1e-9)
    threes = binned([dense(np.full(20, 5.0), 0.01, pattern=np.array([1.0, -2.0, 1.0]))])
    np.testing.assert_allclose(scatter(threes, 3), 6 * 0.01**2, rtol=1e-9)


def test_noise_is_borrowed_back_in_time_as_it_is_or_in_proportion_whichever_is_more() -> None:
    """Additive or proportional noise is not known: of a modulus ten times as high the proportion, of one half as high the same."""
    near = [5.0] * (POOL + 1)
    early = np.array([50.0, 2.5, 20.0, 5.0])
    points = binned([sparse([*early, *near]), dense(np.full(9, 5.0), 0.1, decade=(early.size + POOL + 1) / BINS_PER_DECADE)])
    known = 4 * 0.1**2 / FREEDOM
    np.testing.assert_allclose(scatter(points, 1)[: early.size], known * np.maximum(early / 5.0, 1.0) ** 2, rtol=1e-9)


LOST, CLEAR = 4.0, 4.5  # below and above three standard deviations of readings that scatter by one each
assert LOST < SIGNAL_TO_NOISE * np.sqrt(4 / FREEDOM) < CLEAR


@pytest.mark.parametrize(
    ("tail", "dropped"),
    [
        ("LLLLLL", "LLLLLL"),
        ("CCCCLL", "....LL"),
        ("LCLCLC", "L.L.L."),  # half of the tail is lost
        ("LCCCLL", "L...LL"),
        ("LCCCCLL", ".....LL"),  # from its first bin on less than half is: the floor begins later
        ("LLCCCCC", "......."),
        ("CCCCCC", "......"),
    ],
)
def test_a_noise_floor_is_a_tail_that_is_mostly_lost(tail: str, dropped: str) -> None:
    """Only what is lost is dropped, and the raw points know that they were. Other curves do not count."""
    top = sparse(np.full(8, 1000.0))
    floor = dense([LOST if sign == "L" else CLEAR for sign in tail], 1.0, decade=4.0)
    other = [sparse(np.full(8, 1000.0)), dense(np.full(6, CLEAR), 1.0, decade=4.0)]
    points = binned(other, [top, floor], other)
    gone = np.array([sign == "L" for sign in dropped])
    kept = np.concatenate([np.full(14 + 8, True), ~gone, np.full(14, True)])
    assert points.log_time.size == kept.sum()
    expected = np.where(kept, np.cumsum(kept) - 1, -1)
    raw = [*[1] * 8, *[4] * 6, *[1] * 8, *[4] * len(tail), *[1] * 8, *[4] * 6]
    np.testing.assert_array_equal(points.bin_of_point, np.repeat(expected, raw))


def test_means_below_zero_have_no_logarithm_and_are_left_out() -> None:
    """One of them stands in the middle, where there is no floor, and tells its neighbours no slope."""
    points = binned([sparse([9.0, 8.0, -7.0, 6.0, 0.0, 5.0])])
    np.testing.assert_array_equal(points.bin_of_point, [0, 1, -1, 2, -1, 3])
    np.testing.assert_allclose(10**points.log_modulus, [9.0, 8.0, 6.0, 5.0], rtol=1e-12)
