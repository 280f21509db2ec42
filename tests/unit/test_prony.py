"""The Prony series: order, truncation, modulus, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.material.spectrum import Spectrum


def test_processes_keep_the_order_in_which_they_are_stated_and_are_frozen() -> None:
    spectrum = Spectrum(np.array([1.0, 100.0, 10.0]), np.array([3.0, 1.0, 2.0]))
    assert spectrum.relaxation_time.tolist() == [1, 100, 10]
    assert spectrum.shear_modulus.tolist() == [3, 1, 2]
    with pytest.raises(ValueError, match="read-only"):
        spectrum.shear_modulus[0] = 5.0


def test_truncation_keeps_the_slowest() -> None:
    kept = Spectrum(np.array([1.0, 100.0, 10.0]), np.array([3.0, 1.0, 2.0])).slowest(2)
    assert kept.relaxation_time.tolist() == [100, 10]
    assert len(kept) == 2


@pytest.mark.parametrize("keep", [0, 4, -1])
def test_truncation_to_an_impossible_number_is_refused(keep: int) -> None:
    spectrum = Spectrum(np.array([1.0, 100.0, 10.0]), np.ones(3))
    with pytest.raises(InputError, match=f"cannot keep {keep} of 3"):
        spectrum.slowest(keep)


def test_modulus_is_the_sum_of_exponentials_for_times_of_any_shape() -> None:
    spectrum = Spectrum(np.array([10.0, 2.0]), np.array([5.0, 7.0]))
    time = np.array([[0.0, 1.0], [20.0, 1e9]])
    expected = 3 + 5 * np.exp(-time / 10) + 7 * np.exp(-time / 2)
    np.testing.assert_allclose(spectrum.relaxation_modulus(time, 3.0), expected, rtol=1e-14)
    assert spectrum.relaxation_modulus(0.0) == pytest.approx(12)


@pytest.mark.parametrize(
    ("times", "moduli", "found"),
    [
        ([1.0, 2.0], [1.0], "2 relaxation times but 1"),
        ([0.0], [1.0], "relaxation time must be positive"),
        ([np.inf], [1.0], "relaxation time must be positive"),
        ([1.0], [-1.0], "not negative"),
        ([1.0], [np.nan], "must be finite"),
    ],
)
def test_impossible_series_are_refused(times: list[float], moduli: list[float], found: str) -> None:
    with pytest.raises(InputError, match=found):
        Spectrum(np.array(times), np.array(moduli))
