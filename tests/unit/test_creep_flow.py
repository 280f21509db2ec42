"""Whether a creep curve tells a fluid from a solid: noise makes no solid flow, a melt is found, and what is open is said."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast import Plateaus
from dielast.base.errors import DielastWarning
from dielast.commands.spectrum import run as workflow
from dielast.commands.spectrum.recipe import FitSection
from dielast.handover.mastercurve_folder import ReadDraws, ReducedCurve
from dielast.material.material import Material
from dielast.material.measurement_kind import CREEP
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.relaxation.beyond import end_of
from dielast.relaxation.creep import fit_creep
from dielast.relaxation.interconversion import RetardationSpectrum, retardation_from_relaxation
from dielast.relaxation.result import SpectrumFit

Array = NDArray[np.float64]
TAU = np.geomspace(1e5, 1e-7, 37)
_DECADE = np.log10(TAU) + 3
RUBBER = Spectrum(TAU, 10 ** (6.5 - 0.55 * _DECADE - 0.02 * _DECADE**2))
LEVEL = 5e4
TIME = np.logspace(-6, 7, 157)
SOLID = retardation_from_relaxation(RUBBER, LEVEL)
SHAPE = np.geomspace(1e2, 1e-6, 33)


def melt(share: float, strength: float = 0.0, own: float = 1e5) -> RetardationSpectrum:
    """A compliance that is to this share flow at 1e4 s, with one process more, of `strength` times all others."""
    compliance = 1e-6 * SHAPE**0.5 / np.sum(SHAPE**0.5)
    fluidity = share / (1 - share) * (1e-9 + float(compliance.sum())) / 1e4
    slow = np.append(own, SHAPE), np.append(strength * compliance.sum(), compliance)
    return RetardationSpectrum(*slow, 1e-9, fluidity)


def fitted(truth: RetardationSpectrum, time: Array, noise: float = 0.0, seed: int = 0) -> tuple[SpectrumFit, str]:
    """The fit and what was said of the long times."""
    scatter = np.exp(noise * np.random.default_rng(seed).standard_normal(time.size))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fit = fit_creep(time, truth.creep_compliance(time) / 3 * scatter)
    return fit, " ".join(str(one.message) for one in caught if "glassy" not in str(one.message))


@pytest.mark.parametrize("noise", [0.0, 1e-3, 2e-2])
def test_noise_makes_no_solid_flow(noise: float) -> None:
    for seed in range(3):
        fit, said = fitted(SOLID, TIME, noise, seed)
        assert fit.retardation is not None
        assert fit.retardation.fluidity == 0
        assert fit.equilibrium_shear_modulus == pytest.approx(LEVEL, rel=1e-4 + 2 * noise)
        assert fit.spectrum.relaxation_time[0] < 2 * TIME[-1]
        assert not said


@pytest.mark.parametrize("noise", [0.0, 5e-3, *(pytest.param(noise, marks=pytest.mark.trust) for noise in (1e-4, 2e-2, 5e-2))])
def test_a_melt_is_found_and_its_viscosity(noise: float) -> None:
    time, truth = np.logspace(-6, 4, 121), melt(0.97)
    for seed in range(3):
        fit, said = fitted(truth, time, noise, seed)
        assert fit.equilibrium_shear_modulus == 0
        assert fit.retardation is not None
        assert fit.retardation.fluidity == pytest.approx(truth.fluidity, rel=1e-3 + 4 * noise)
        assert not said


def test_flow_that_the_curve_hardly_shows_is_said() -> None:
    time = np.logspace(-6, 4, 121)
    fit, said = fitted(melt(0.1), time)
    assert fit.equilibrium_shear_modulus == 0
    assert "the material flows, but flow is only 10.0% of its compliance" in said
    assert "state equilibrium_modulus (0 for a melt)" in said
    fit, said = fitted(melt(0.1), time, 0.005)
    assert fit.equilibrium_shear_modulus > 0
    assert "does not distinguish flow from processes slower than the curve" in said
    assert "state equilibrium_modulus (0 for a melt)" in said


@pytest.mark.parametrize("strength", [0.3, 3.0, 30.0])
def test_processes_slower_than_the_curve_are_no_flow(strength: float) -> None:
    truth = melt(0.0, strength, own=3e4)
    fit, said = fitted(truth, np.logspace(-6, 4, 121))
    modulus = 1 / (truth.glassy_compliance + truth.compliance.sum())
    assert fit.equilibrium_shear_modulus == pytest.approx(modulus, rel=0.2)
    assert "does not distinguish flow from processes slower than the curve" in said


@pytest.mark.filterwarnings("ignore:the spectrum is .* below the curve at its end")
def test_what_is_stated_is_not_asked_of_the_data() -> None:
    time = np.logspace(-6, 4, 121)
    scatter = np.exp(0.005 * np.random.default_rng(3).standard_normal(time.size))
    solid = fit_creep(TIME, SOLID.creep_compliance(TIME) / 3, flows=True)
    assert solid.equilibrium_shear_modulus == pytest.approx(LEVEL, rel=1e-3)  # there is none to find
    with pytest.warns(DielastWarning, match="has not levelled off"):
        held = fit_creep(time, melt(0.9).creep_compliance(time) / 3 * scatter, flows=False)
    assert held.retardation is not None
    assert held.retardation.fluidity == 0
    for share in (0.01, 0.1):
        with pytest.warns(DielastWarning, match="far above equilibrium_modulus = 0 Pa"):
            flowing = fit_creep(time, melt(share).creep_compliance(time) / 3, plateaus=Plateaus(equilibrium_modulus=0.0))
        assert flowing.equilibrium_shear_modulus == 0


def test_a_little_flow_of_exact_values_is_found() -> None:
    """On a row of times that the truth has, nothing is missed but what rounding leaves: flow of 1e-5 is beyond doubt."""
    own, time = np.logspace(4, -4, 9), np.logspace(-6, 6, 145)
    truth = RetardationSpectrum(own, 1e-6 * np.array([5, 3, 4, 1, 2, 0.5, 1, 0.2, 0.3]), 2e-7, 1e-16)
    assert truth.fluidity * time[-1] < 1e-5 * truth.creep_compliance(time[-1])
    with pytest.warns(DielastWarning, match="the material flows, but flow is only"):
        fit = fit_creep(time, truth.creep_compliance(time) / 3, branches=9, retardation_time=(1e-4, 1e4))
    assert fit.retardation is not None
    assert fit.retardation.fluidity == pytest.approx(truth.fluidity, rel=1e-3)


def test_the_glassy_compliance_of_a_solid_may_be_out_of_reach_too() -> None:
    """It is then a hundredth of the first point, so that all moduli together are a hundred times that stiffness."""
    time = np.logspace(0, 5, 101)
    creep = -1e-6 * np.expm1(-time / 1e3)
    with pytest.warns(DielastWarning, match="does not show the glassy compliance"):
        fit = fit_creep(time, creep)
    assert 3 * fit.equilibrium_shear_modulus == pytest.approx(1e6, rel=0.01)
    everything = 3 * (fit.spectrum.shear_modulus.sum() + fit.equilibrium_shear_modulus)
    assert everything == pytest.approx(100 / creep[0], rel=1e-6)


@pytest.mark.parametrize("branches", [1, 30])
@pytest.mark.parametrize("points", [50, 61])
def test_an_elastic_solid_is_one_whether_or_not_rounding_leaves_a_process(branches: int, points: int) -> None:
    time = np.logspace(-3, 3, points)
    for young in (6e4, 65536.0, 1e5, 1e6):
        fit = fit_creep(time, np.full(points, 1 / young), branches=branches)
        assert 3 * fit.equilibrium_shear_modulus == pytest.approx(young, rel=1e-9)
        relaxation = fit.spectrum.relaxation_modulus(time, fit.equilibrium_shear_modulus)
        np.testing.assert_allclose(3 * relaxation, young, rtol=1e-9)


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve")
@pytest.mark.parametrize("keep", [3, 5, 9])
def test_a_truncated_spectrum_is_shown_as_it_is_and_judged_where_it_holds(keep: int) -> None:
    compliance = SOLID.creep_compliance(TIME) / 3
    whole, fit = fit_creep(TIME, compliance, branches=12), fit_creep(TIME, compliance, branches=12, keep=keep)
    np.testing.assert_array_equal(fit.spectrum.shear_modulus, whole.spectrum.shear_modulus[:keep])
    kept = retardation_from_relaxation(fit.spectrum, fit.equilibrium_shear_modulus)
    np.testing.assert_allclose(fit.model, kept.creep_compliance(TIME) / 3, rtol=1e-9)
    error, late = np.abs(fit.model / compliance - 1), fit.spectrum.relaxation_time[-1] <= TIME
    assert fit.max_relative_error == pytest.approx(error[late].max(), rel=1e-9)
    assert fit.rms_relative_error == pytest.approx(np.sqrt(np.mean(error[late] ** 2)), rel=1e-9)
    assert error.max() > 2 * fit.max_relative_error
    everything = fit_creep(TIME, compliance, branches=12, keep=len(whole.spectrum))
    for one in (whole, everything):
        assert one.max_relative_error == pytest.approx(np.abs(whole.model / compliance - 1).max(), rel=1e-9)
        assert one.rms_relative_error == pytest.approx(np.sqrt(np.mean((whole.model / compliance - 1) ** 2)), rel=1e-9)


@pytest.mark.parametrize(("truth", "flows"), [(SOLID, False), (melt(0.97), True), (melt(0.9999), True)])
def test_draws_flow_if_and_only_if_the_fit_does(monkeypatch: pytest.MonkeyPatch, truth: RetardationSpectrum, flows: bool) -> None:
    time = np.logspace(-6, 4, 121)
    smooth = truth.creep_compliance(time) / 3
    rng = np.random.default_rng(8)
    curve = ReducedCurve(CREEP, (time, smooth * np.exp(0.005 * rng.standard_normal(time.size))), WLF(20.0, 13.7, 187.1))
    # as resampling makes them: the ends are the least certain
    wave = np.cumsum(rng.standard_normal((12, time.size)), axis=1) * 0.01 / np.sqrt(time.size)
    read = ReadDraws(np.arange(12), time, (smooth * np.exp(wave))[:, None], (curve.shift,) * 12)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        fit = workflow.fit_curve(curve, FitSection())
        material = Material("any", fit.equilibrium_shear_modulus, fit.spectrum, curve.shift, Gent(), Gent())
        fitting, asked = workflow.fit_curve, list[int | None]()

        def fit_curve(curve: ReducedCurve, fit: FitSection, **options: Any) -> SpectrumFit:
            asked.append(fit.branches)
            return fitting(curve, fit, **options)

        monkeypatch.setattr(workflow, "fit_curve", fit_curve)
        drawn = workflow.draw_materials(read, curve, fit, material, FitSection())
    assert drawn is not None
    assert asked == [None, *[50] * 12]  # the number that the curve demands is that of all draws
    equilibrium = next(column for column in drawn[0] if "equilibrium" in column.header).values
    assert len(equilibrium) == 12
    assert (fit.equilibrium_shear_modulus == 0) == flows
    assert np.all((np.asarray(equilibrium, dtype=float) == 0) == flows)
    # of a curve that is uncertain by 1 %, no draw is far off, also of a melt with next to no modulus at the end
    stiffness = sum(np.asarray(column.values, dtype=float) for column in drawn[0] if "shear_modulus" in column.header)
    np.testing.assert_allclose(stiffness, fit.equilibrium_shear_modulus + fit.spectrum.shear_modulus.sum(), rtol=0.1)


def test_a_melt_whose_curve_shows_no_flow_holds_its_plateau_and_one_that_flows_long_is_no_mistake() -> None:
    """The reciprocal of a level compliance is the modulus; after many relaxation times, a melt has next to none."""
    with pytest.warns(DielastWarning, match="the curve shows no flow: the viscosity of .* is a guess"):
        fit = fit_creep(TIME, SOLID.creep_compliance(TIME) / 3, plateaus=Plateaus(liquid=True))
    assert fit.equilibrium_shear_modulus == 0
    held = fit.spectrum.relaxation_modulus(TIME[-1:], 0.0) * SOLID.creep_compliance(TIME[-1:])
    assert held == pytest.approx(1.0, rel=0.01)
    flowing = retardation_from_relaxation(Spectrum(np.logspace(-4, 1, 6), np.full(6, 1e5)))
    time = np.logspace(-4, 4, 80)
    end = end_of(fit_creep(time, flowing.creep_compliance(time) / 3, plateaus=Plateaus(liquid=True)), stated=True)
    assert (end.range, end.reached) == (None, False)
