"""Starting shifts of curves whose distances are known: straight lines, plateaus that touch, bad stretches, and gaps."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.material.measurement_kind import RELAXATION
from dielast.relaxation.superposition.binning import Binned
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


def test_temperatures_nearby_are_asked_first() -> None:
    """The two coldest curves went astray at low moduli, which is all that the warmest one has: its neighbours know better."""
    x = np.linspace(0.0, 10.0, 101)
    curves = [(x + shift, 8 - 0.3 * x) for shift in (5.0, 4.0, 3.0, 2.0, 1.0, 0.0)]
    for late, _ in curves[:2]:
        late[70:] += 2.0
    curves[2], curves[5] = (curves[2][0][:67], curves[2][1][:67]), (curves[5][0][70:], curves[5][1][70:])
    np.testing.assert_allclose(shifts(curves), [0.0, -1.0, -2.0, -3.0, -4.0, -5.0], atol=0.1)


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
