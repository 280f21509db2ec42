"""Condensed curves whose points and noise can be written down: power laws, and scatter of a known pattern."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from dielast.relaxation.superposition.binning import BINS_PER_DECADE, MIN_FREEDOM, POOL, SIGNAL_TO_NOISE, Binned, bin_curves

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


def test_a_mean_is_taken_of_the_modulus_with_the_trend_of_its_neighbours_removed() -> None:
    """The neighbours' levels are 10, 1 and 0.01 of one reading each: the bin between has the slope from the first to the last."""
    x = np.array([0.0, 0.06, 0.08, 0.12])
    modulus = np.array([10.0, 1.2, 0.8, 0.01])
    points = bin_curves(np.zeros(4, dtype=np.intp), 10**x, modulus)
    slope = -3 / 0.12
    mean = np.mean(modulus[1:3] * 10 ** (-slope * np.array([-0.01, 0.01])))
    np.testing.assert_allclose(points.log_modulus, [1.0, np.log10(mean), -2.0], atol=1e-12)


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


def test_readings_of_one_time_have_no_line() -> None:
    """Any number of readings at one time scatter about their mean with one degree of freedom less."""
    x = np.repeat(np.arange(12) / BINS_PER_DECADE, 4)
    points = bin_curves(np.zeros(48, dtype=np.intp), 10**x, np.tile(5.0 + 0.01 * NOISE, 12))
    np.testing.assert_allclose(scatter(points, 4), 4 * 0.01**2 / 3, rtol=1e-9)


def test_noise_is_pooled_over_neighbours_of_the_same_curve() -> None:
    amplitude = np.array([0.01 * (1 + k) for k in range(16)])
    points = binned([dense(np.full(9, 5.0), amplitude[:9])], [dense(np.full(7, 5.0), amplitude[9:], decade=-3.0)])
    squares = 4 * amplitude**2
    for k in range(16):
        own = range(9) if k < 9 else range(9, 16)
        near = [j for j in own if abs(j - k) <= POOL]
        assert scatter(points, 4)[k] == pytest.approx(sum(squares[near]) / (FREEDOM * len(near)), rel=1e-3), k


def test_a_sparse_curve_tells_no_noise_whatever_its_neighbours_do() -> None:
    values = np.array([7.0, 6.5, 6.6, 3.0, 2.9, 2.95, 1.0, 1.2])
    points = binned([dense(np.full(9, 5.0), 0.1)], [sparse(values)], [dense(np.full(9, 5.0), 0.1)])
    alone = points.curve == 1
    np.testing.assert_allclose(points.log_modulus[alone], np.log10(values), atol=1e-12)
    assert np.all(points.variance[alone] == 0)
    assert np.all(points.variance[~alone] > 0)


def test_few_readings_are_believed_only_with_enough_freedom() -> None:
    """Two bins beside a sparse curve have four degrees of freedom, three have six."""
    for bins in (2, 3):
        points = binned([sparse(np.full(9, 5.0)), dense(np.full(bins, 5.0), 0.1, decade=9 / BINS_PER_DECADE)])
        assert np.any(points.variance > 0) == (bins * FREEDOM >= MIN_FREEDOM)


def test_noise_is_borrowed_back_in_time_as_it_is_or_in_proportion_whichever_is_more() -> None:
    """Additive or proportional noise is not known: of a modulus ten times as high the proportion, of one half as high the same."""
    near = [5.0] * (POOL + 1)
    early = np.array([50.0, 2.5, 20.0, 5.0])
    points = binned([sparse([*early, *near]), dense(np.full(9, 5.0), 0.1, decade=(early.size + POOL + 1) / BINS_PER_DECADE)])
    known = 4 * 0.1**2 / FREEDOM
    np.testing.assert_allclose(scatter(points, 1)[: early.size], known * np.maximum(early / 5.0, 1.0) ** 2, rtol=1e-9)


def test_noise_is_borrowed_on_in_time_in_proportion() -> None:
    near = [5.0] * (POOL + 1)
    late = np.array([2.5, 0.1, 10.0])
    points = binned([dense(np.full(9, 5.0), 0.1), sparse([*near, *late], decade=9 / BINS_PER_DECADE)])
    known = 4 * 0.1**2 / FREEDOM
    np.testing.assert_allclose(scatter(points, 1)[-late.size :], known * (late / 5.0) ** 2, rtol=1e-9)


def test_noise_is_borrowed_from_the_nearest_bin_that_knows() -> None:
    """Between two dense stretches of other noise: from the later one."""
    between = np.full(2 * POOL + 5, 5.0)
    first, last = dense(np.full(9, 5.0), 0.1), dense(np.full(9, 5.0), 0.3, decade=(9 + between.size) / BINS_PER_DECADE)
    points = binned([first, sparse(between, decade=9 / BINS_PER_DECADE), last], [sparse(between)])
    middle = 9 + between.size // 2
    assert scatter(points, 1)[middle] == pytest.approx(4 * 0.3**2 / FREEDOM, rel=1e-9)


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


def test_a_level_curve_is_never_a_noise_floor_however_noisy() -> None:
    points = binned([dense(np.full(12, LOST), 1.0)])
    assert points.log_time.size == 12


def test_what_is_low_is_measured_by_the_curve_itself() -> None:
    """A tail at a twentieth of its own curve is low, and at a twentieth of another curve's is not."""
    tail = dense(np.full(6, LOST), 1.0, decade=4.0)
    high, near = ([sparse(np.full(8, factor * LOST)), tail] for factor in (20.0, 5.0))
    points = binned(high, near, high)
    np.testing.assert_array_equal(np.bincount(points.curve), [8, 14, 8])


def test_means_below_zero_have_no_logarithm_and_are_left_out() -> None:
    """One of them stands in the middle, where there is no floor, and tells its neighbours no slope."""
    points = binned([sparse([9.0, 8.0, -7.0, 6.0, 0.0, 5.0])])
    np.testing.assert_array_equal(points.bin_of_point, [0, 1, -1, 2, -1, 3])
    np.testing.assert_allclose(10**points.log_modulus, [9.0, 8.0, 6.0, 5.0], rtol=1e-12)


@pytest.mark.parametrize("sizes", [(1, 1), (5, 1), (1, 5), (1, 5, 1)])
def test_curves_of_one_point_are_curves(sizes: tuple[int, ...]) -> None:
    points = binned(*([sparse(10.0 ** -np.arange(size), decade=3.0 * k)] for k, size in enumerate(sizes)))
    np.testing.assert_array_equal(points.curve, np.repeat(np.arange(len(sizes)), sizes))
    np.testing.assert_array_equal(points.bin_of_point, np.arange(sum(sizes)))
    first = np.concatenate(([0], np.cumsum(sizes)[:-1]))
    np.testing.assert_allclose(points.log_time[first], 3.0 * np.arange(len(sizes)), atol=1e-12)
    np.testing.assert_allclose(points.log_modulus[first], 0.0, atol=1e-12)
