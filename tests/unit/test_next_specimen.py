"""Coverage of bands of the next specimen, in small synthetic laboratories."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import genhyperbolic, norm, t as student

from dielast import Free, Material, MeasuredTest, NeoHookean, NoShift, Spectrum, draw_sample
from dielast.calibration.fit import fit_material
from dielast.calibration.likelihood import likelihood_of
from dielast.calibration.result import Calibration
from dielast.material.scatter import WIDEST, SpecimenScatter, interval

MODULUS, SCATTER, ERROR = 4e4, 0.06, 0.03
START = Material("m", 5e4, Spectrum([], []), NoShift(20.0), NeoHookean(), NeoHookean())
STRETCH = np.linspace(1.1, 2.5, 12)


DISTANCE = np.sqrt(3) * np.abs(np.log(STRETCH)[:, None] - np.log(STRETCH)) / 0.3
ALONG = np.linalg.cholesky((1 + DISTANCE) * np.exp(-DISTANCE) + 1e-9 * np.eye(STRETCH.size))


def stress(random: np.random.Generator) -> np.ndarray:
    """Nominal stresses of a specimen of its own modulus, with an error of the model along the curve, and noise."""
    wave = ALONG @ random.standard_normal(STRETCH.size)
    off = np.exp(SCATTER * random.standard_normal()) * (1 + ERROR * wave + 0.003 * random.standard_normal(12))
    return MODULUS * (STRETCH - STRETCH**-2) * off


@pytest.mark.parametrize(("laboratories", "bounds"), [(8, (0.8, 0.97)), pytest.param(60, (0.84, 0.95), marks=pytest.mark.trust)])
def test_bands_hold_the_next_specimen(laboratories: int, bounds: tuple[float, float]) -> None:
    held, narrow = [], []
    for laboratory in range(laboratories):
        random = np.random.default_rng([laboratory, 70])
        tests = [MeasuredTest(f"pull {k}", np.arange(1.0, 13.0), STRETCH, stress(random), 20.0) for k in range(5)]
        fit = fit_material(START, tests, {"equilibrium.shear_modulus": Free()}, starts=1)
        found = likelihood_of(fit)
        known = Calibration(fit, found, (), np.zeros((0, 1)), ()).material
        own = known.equilibrium_modulus * np.exp(found.standard_error[0] * random.standard_normal(100))
        members = [replace(known, equilibrium_modulus=modulus) for modulus in own.tolist()]
        further = np.array([stress(random) for _ in range(40)]) / (STRETCH - STRETCH**-2)
        for coverage, sample in ((held, draw_sample(members, 400)), (narrow, draw_sample(members, 100, specimens=False))):
            low, high = interval(np.array([member.equilibrium_modulus for member in sample.specimens()]), 0.9)
            coverage.append(np.mean((further >= low) & (further <= high)))
    assert bounds[0] < np.mean(held) < bounds[1]
    assert np.mean(narrow) < 0.6


@pytest.mark.parametrize(("relative", "freedom"), [(0.06, 2.0), (0.1, 6.0), (0.5, 3.0), (0.06, 300.0)])
def test_the_scatter_of_specimens_is_generalised_hyperbolic(relative: float, freedom: float) -> None:
    """Its tail is bounded where Student's is not: with 2 degrees of freedom, one of 10,000 is 2.5 times as stiff, not 55 times."""
    quantile = np.array([0.02, 0.3, 0.75, 0.95, 0.9975, 0.9999])
    delta, steep = relative * np.sqrt(freedom), 1 / WIDEST
    expected = genhyperbolic.ppf(quantile, -freedom / 2, steep * delta, 0.0, 0.0, delta) / relative
    assert SpecimenScatter(relative, freedom).deviates(quantile) == pytest.approx(expected, rel=2e-4)


def test_the_scatter_of_specimens_is_students_where_the_prior_says_nothing() -> None:
    quantile = np.array([0.05, 0.6, 0.9, 0.99])
    for freedom in (3.0, 12.0, 1e4):
        assert SpecimenScatter(1e-4, freedom).deviates(quantile) == pytest.approx(student.ppf(quantile, freedom), rel=2e-4)
    assert SpecimenScatter(0.05).deviates(quantile) == pytest.approx(norm.ppf(quantile), rel=1e-9)


@pytest.mark.filterwarnings("error")
def test_a_very_large_scatter_of_specimens_has_deviates() -> None:
    """Far out, less than the least number that there is lies beyond."""
    found = SpecimenScatter(3.0, 3.0).deviates(np.array([1e-6, 0.25, 0.5, 0.75]))
    assert np.all(np.isfinite(found))
    assert np.all(np.diff(found) > 0)
