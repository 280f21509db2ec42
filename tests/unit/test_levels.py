"""How likely equilibrium moduli are, by the curve alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.material.spectrum import Spectrum
from dielast.relaxation.fit import fit_spectrum
from dielast.relaxation.levels import likely_levels
from dielast.relaxation.result import SpectrumFit

TIME, LONGER = np.geomspace(0.01, 1e3, 200), np.geomspace(0.01, 1e4, 240)  # s; of the slowest branch the longer one shows the end
NOISE = 0.005
CHANCE = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
NORMAL = np.array([-1.6449, -0.6745, 0.0, 0.6745, 1.6449])  # at these chances


def fitted(time: NDArray[np.float64], slowest: float, seed: int) -> SpectrumFit:
    """A fit to noisy readings of three branches, of which the slowest one has this modulus."""
    truth = Spectrum(np.array([100.0, 1.0, 0.01]), np.array([slowest, 2e5, 3e5]))
    noise = NOISE * np.random.default_rng(seed).standard_normal(time.size)
    modulus = 3 * truth.relaxation_modulus(time, 1e5) * (1 + noise)
    return fit_spectrum(time, modulus, branches=3, relaxation_time=(0.01, 100.0))


def test_where_no_modulus_is_near_zero_it_is_least_squares() -> None:
    """Mean and standard deviation are then those of the linear problem, and so is every quantile."""
    fit = fitted(LONGER, 1e5, 5)
    design = np.column_stack([np.exp(-LONGER[:, None] / fit.spectrum.relaxation_time), np.ones(LONGER.size)])
    rows = design / (fit.measured[:, None] / 3)
    best, square, *_ = np.linalg.lstsq(rows, np.ones(LONGER.size), rcond=None)
    deviation = np.sqrt(float(square[0]) / (LONGER.size - 4) * np.linalg.inv(rows.T @ rows)[-1, -1])
    level = likely_levels(fit, CHANCE) * fit.equilibrium_shear_modulus
    np.testing.assert_allclose(level, best[-1] + NORMAL * deviation, rtol=0, atol=0.02 * deviation)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_branches_of_no_modulus_leave_room_below_rather_than_above(seed: int) -> None:
    """Relaxation that is too slow to be seen may take its place, but no branch makes up for a higher one."""
    low, _, middle, _, high = np.log(likely_levels(fitted(TIME, 0.0, seed), CHANCE))
    assert middle - low > 1.2 * (high - middle) > 0


def test_a_curve_without_noise_leaves_nothing_open() -> None:
    truth = Spectrum(np.array([100.0, 1.0, 0.01]), np.array([1e5, 2e5, 3e5]))
    fit = fit_spectrum(LONGER, 3 * truth.relaxation_modulus(LONGER, 1e5), branches=3, relaxation_time=(0.01, 100.0))
    np.testing.assert_allclose(likely_levels(fit, CHANCE) * fit.equilibrium_shear_modulus, 1e5, rtol=1e-5)
