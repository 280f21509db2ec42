"""The scatter of measured curves: its size and its course are found again, and what says little of them is not overrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dielast import WLF, Free, Gent, Material, MeasuredTest, NoShift, Spectrum
from dielast.base.errors import DielastWarning
from dielast.calibration.estimate import PRIOR_FREEDOM, USUAL_ERROR, ResidualSpace, estimate
from dielast.calibration.fit import fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.scatter import CORRELATIONS, INTEGRALS, Curves, Scatter
from dielast.material.material import CalibratedRange
from dielast.material.use_checks import warn_of_lasting, warn_of_use


def curves_of(count: int, place: np.ndarray) -> Curves:
    model = 1e4 * (1 + np.sin(0.8 * place) ** 2)
    return Curves((model,) * count, (model,) * count, (place,) * count, np.arange(count))


@pytest.mark.parametrize("kind", range(3))
def test_correlations_have_their_integrals(kind: int) -> None:
    distance = np.linspace(0.0, 40.0, 400_001)
    values = CORRELATIONS[kind](distance)
    assert values[0] == 1
    assert 2 * np.trapezoid(values, distance) == pytest.approx(INTEGRALS[kind], rel=1e-6)
    assert np.all(np.linalg.eigvalsh(Scatter(np.zeros(1), 0.1, 0.3, 0.0, smooth=kind).correlation(np.linspace(0, 2, 40))) > -1e-9)


def test_the_size_of_the_error_of_a_model_is_found_again() -> None:
    place, random = np.linspace(0.0, 3.0, 60), np.random.default_rng(5)
    curves = curves_of(6, place)
    truth = Scatter(np.full(6, 0.003), 0.08, 0.3, 0.05, steady=0.2, smooth=1)
    root = np.linalg.cholesky(truth.correlation(place) + 1e-10 * np.eye(60))
    levels = curves.levels(truth.steady)
    sizes = []
    for _ in range(12):
        miss = [level * (0.08 * root @ random.standard_normal(60) + 0.003 * random.standard_normal(60)) for level in levels]
        slopes = np.concatenate([np.ones(60) * level for level in levels])[:, None]
        values = tuple(model + away for model, away in zip(curves.model, miss, strict=True))
        found = estimate(replace(curves, values=values), slopes, np.zeros((1, 1)), Scatter(np.full(6, 0.01), 0.05, 0.3, 0.05))
        sizes.append(found.model_error)
    assert np.median(sizes) == pytest.approx(0.08, rel=0.25)
    # where the fit has taken out all that differences could tell, the error is as usual
    curves, weight = curves_of(1, place[:4]), np.ones(4)
    nothing = ResidualSpace.of(curves, Scatter(np.zeros(1), 0.1, 10.0, 0.05), weight, np.eye(4) * curves.measured)
    assert nothing.size(np.zeros(4)) == pytest.approx(USUAL_ERROR, rel=1e-3)
    assert nothing.known == pytest.approx(PRIOR_FREEDOM)


def test_many_branches_are_smooth_where_tests_do_not_tell_them_apart() -> None:
    times = np.geomspace(300.0, 0.3, 5)
    truth = Material("t", 2e4, Spectrum(times, [1e4, 1.5e4, 2e4, 2.5e4, 3e4]), NoShift(20.0), Gent(100.0), Gent(50.0))
    at = np.linspace(0.0, 20.0, 41)[1:]
    stretch = np.interp(at, [0.0, 10.0, 20.0], [1.0, 2.0, 1.1])
    blank = MeasuredTest("cycle", at, stretch, np.ones(40), 20.0, slack="pushes")
    clean = Laboratory([blank]).answers([truth])[0][0]
    ragged = clean * (1 + 0.01 * np.random.default_rng(2).standard_normal(40))
    start = replace(truth, spectrum=Spectrum(times, np.full(5, 1e4)))
    fit = fit_material(start, [replace_stress(blank, ragged)], {"nonequilibrium.shear_modulus": Free()}, starts=1)
    assert fit.problem.smoothness.shape == (5, 5)
    assert np.linalg.matrix_rank(fit.problem.smoothness) == 3  # a straight line of log moduli is as smooth as can be
    bends = np.abs(np.diff(fit.coordinates, 2))
    assert np.max(bends) < 0.5
    assert np.max(np.abs(fit.coordinates - np.log(truth.spectrum.shear_modulus))) < 0.7
    few = fit_material(
        replace(start, spectrum=Spectrum(times[:3], np.full(3, 1e4))),
        [replace_stress(blank, ragged)],
        {"nonequilibrium.shear_modulus": Free()},
        starts=1,
    )
    assert not few.problem.smoothness.any()


def replace_stress(test: MeasuredTest, stress: np.ndarray) -> MeasuredTest:
    return MeasuredTest(test.name, test.time, test.stretch, stress, test.temperature, slack=test.slack)


def test_beyond_the_tests_is_warned_of(recwarn: pytest.WarningsRecorder) -> None:
    known = CalibratedRange(("uniaxial",), 9.0, (1.0, 100.0), (20.0, 40.0))
    material = Material("m", 2e4, Spectrum([10.0], [1e4]), NoShift(20.0), calibrated=known)
    warn_of_lasting(material, [20.0], [150.0])
    warn_of_use(replace(material, shift=WLF(20.0, 13.0, 187.0)), [22.0, 42.0])
    assert not recwarn.list
    with pytest.warns(
        DielastWarning,
        match="3.6e\\+03 s at 30 degC are longer than the tests .*, which are equivalent to 100 s at this temperature",
    ):
        warn_of_lasting(material, [20.0, 30.0], [150.0, 3600.0])
    with pytest.warns(DielastWarning, match="calibrated by tests from 20 to 40 degC: at 60 degC it is extrapolated"):
        warn_of_use(material, [60.0])
