"""Points of curves in bins of log time, and starting shifts of curves whose distances are known."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from dielast.base.errors import InputError
from dielast.material.measurement_kind import RELAXATION
from dielast.relaxation.superposition.binning import BINS_PER_DECADE, SIGNAL_TO_NOISE, Binned, bin_curves
from dielast.relaxation.superposition.overlap import JUMP, TOUCH, starting_shifts

Array = NDArray[np.float64]


def shifts(curves: list[tuple[Array, Array]], anchor: int = 0, temperature: list[float] | None = None) -> Array:
    """Starting shifts of curves (log time, log modulus), 10 degC apart unless stated."""
    number = np.repeat(np.arange(len(curves)), [x.size for x, _ in curves])
    x, y = np.concatenate([x for x, _ in curves]), np.concatenate([y for _, y in curves])
    at: Array = np.array(temperature or [10.0 * k for k in range(len(curves))])
    return starting_shifts(at, Binned(number, x, y[None], np.zeros((1, x.size)), number), anchor, RELAXATION)


def fall(x: Array) -> Array:
    """Any falling curve: two steps of unequal steepness."""
    return np.asarray(6 - np.tanh(x) - 0.5 * np.tanh(3 * (x - 4)) - 0.02 * x)


def seen(shift: float, first: float, last: float, step: float = 0.1) -> tuple[Array, Array]:
    """A stretch of the curve, measured at another temperature."""
    x: Array = np.asarray(np.arange(round((last - first) / step) + 1) * step + first, dtype=float)
    return x + shift, fall(x)


TRUTH = np.array([5.0, 3.2, 0.0, -1.1, -4.6])


@pytest.mark.parametrize("anchor", range(5))
def test_stretches_of_one_curve_are_as_far_apart_as_they_were_slid(anchor: int) -> None:
    ranges = [(-3, 0), (-2, 1), (-1, 3.5), (0, 5), (2, 6)]
    curves = [seen(shift, *ends) for shift, ends in zip(TRUTH, ranges, strict=True)]
    np.testing.assert_allclose(shifts(curves, anchor), TRUTH - TRUTH[anchor], atol=1e-12)


@pytest.mark.parametrize("order", list(permutations([(-3, 0), (-1, 2), (1, 4), (3, 6)])))
def test_overlaps_form_a_chain_in_any_order_of_temperatures(order: list[tuple[float, float]]) -> None:
    curves = [seen(shift, *ends) for shift, ends in zip((0.0, 1.0, -2.0, 0.5), order, strict=True)]
    np.testing.assert_allclose(shifts(curves, 0), [0.0, 1.0, -2.0, 0.5], atol=1e-9)


def test_a_bad_stretch_does_no_harm() -> None:
    """A third of the curve is off by a fifth of its modulus: the median of the distances is not."""
    clean, spoilt = seen(0.0, -3, 3), seen(2.0, -3, 3)
    bad = (spoilt[1] > 6.4) & (spoilt[1] < 6.9)
    spoilt[1][bad] += 0.08
    assert shifts([clean, spoilt])[1] == pytest.approx(2.0, abs=0.02)


def test_a_long_overlap_outvotes_a_short_one() -> None:
    """The last curve shares all of its moduli with one and a tenth with another, just where it went astray."""
    x = np.linspace(0.0, 10.0, 101)
    upper, lower, last = (x, 8 - 0.1 * x), (x + 10.0, 7.1 - 0.1 * x), (x + 3.0, 8 - 0.1 * x)
    last[0][-10:] += 2.0
    np.testing.assert_allclose(shifts([upper, lower, last]), [0.0, 1.0, 3.0], atol=0.1)


@pytest.mark.parametrize("at", [0, 1, 10, 28, 29])
@pytest.mark.parametrize("factor", [10 ** (JUMP + 0.1), 30.0])
def test_one_point_that_jumps_up_is_not_believed(at: int, factor: float) -> None:
    """Without it, pool adjacent violators would flatten half of the curve."""
    x = np.linspace(0.0, 6.0, 30)
    clean, spoilt = (x, 8 - 0.5 * x), (x + 1.0, 8 - 0.5 * x)
    spoilt[1][at] += np.log10(factor)
    assert shifts([clean, spoilt])[1] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_few_points_are_enough_for_a_distance(size: int) -> None:
    x = np.linspace(0.0, 6.0, 30)
    few = np.array([3.0, 4.0, 5.0])[:size]
    np.testing.assert_allclose(shifts([(x, 8 - 0.5 * x), (few + 1.0, 8 - 0.5 * few)]), [0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("gap", [0.5 * TOUCH, 0.0])
def test_plateaus_that_touch_are_put_end_to_end(gap: float) -> None:
    """The slower curve ends a hair above where the faster one begins: its end goes to that one's beginning."""
    x = np.linspace(0.0, 3.0, 31)
    upper, lower = (x + 5.0, 8 - 0.5 * x), (x, 6.5 - gap - 0.5 * x)
    np.testing.assert_allclose(shifts([upper, lower]), [0.0, 0.0 - 8.0], atol=1e-12)
    np.testing.assert_allclose(shifts([lower, upper]), [0.0, 8.0], atol=1e-12)


def test_a_gap_names_the_two_curves_on_its_sides() -> None:
    """Of two groups of two, the ones that are nearest in modulus, with what they measure."""
    x = np.linspace(0.0, 2.0, 21)
    tops = [9.0, 8.2, 6.5, 6.0]
    curves = [(x, top - 0.5 * x) for top in tops]
    said = r"10 degC \(modulus 1.58e\+07 to 1.58e\+08 Pa\) and 20 degC \(modulus 3.16e\+05 to 3.16e\+06 Pa\): measure longer"
    for anchor in range(4):
        with pytest.raises(InputError, match=said):
            shifts(curves, anchor)
    with pytest.raises(InputError, match=r"no overlap between 0 degC .* and 10 degC"):
        shifts([(x, 8 - 0.5 * x), (x, 7 - 1.1 * TOUCH - 0.5 * x)])


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
