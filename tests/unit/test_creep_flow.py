"""Whether a creep curve tells a fluid from a solid: noise makes no solid flow, a melt is found, and what is open is said."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.characterise.creep import fit_creep
from dielast.characterise.interconversion import RetardationSpectrum, retardation_from_relaxation
from dielast.characterise.spectrum import SpectrumFit
from dielast.characterise.spectrum_draws import CurveDraws
from dielast.errors import DielastWarning
from dielast.files import Inputs
from dielast.gent import Gent
from dielast.material import Material
from dielast.prony import Spectrum
from dielast.recipe.spectrum import Fit
from dielast.shift import WLF
from dielast.workflow import spectrum as workflow
from dielast.workflow.curve import Curve
from dielast.workflow.draws import ReadDraws

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


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3, 5e-3, 2e-2])
def test_noise_makes_no_solid_flow(noise: float) -> None:
    for seed in range(12):
        fit, said = fitted(SOLID, TIME, noise, seed)
        assert fit.retardation is not None
        assert fit.retardation.fluidity == 0
        assert fit.equilibrium_shear_modulus == pytest.approx(LEVEL, rel=1e-4 + 2 * noise)
        assert fit.spectrum.relaxation_time[0] < 2 * TIME[-1]
        assert not said


@pytest.mark.parametrize("noise", [0.0, 1e-4, 5e-3, 2e-2, 5e-2])
def test_a_melt_is_found_and_its_viscosity(noise: float) -> None:
    time, truth = np.logspace(-6, 4, 121), melt(0.97)
    for seed in range(6):
        fit, said = fitted(truth, time, noise, seed)
        assert fit.equilibrium_shear_modulus == 0
        assert fit.retardation is not None
        assert fit.retardation.fluidity == pytest.approx(truth.fluidity, rel=1e-3 + 4 * noise)
        assert not said


def test_flow_that_the_curve_hardly_shows_is_said() -> None:
    time = np.logspace(-6, 4, 121)
    fit, said = fitted(melt(0.1), time)
    assert fit.equilibrium_shear_modulus == 0
    assert "the material flows, by which its compliance hardly rises yet (10.0% of it" in said
    assert "state equilibrium_modulus (0 for a melt)" in said
    fit, said = fitted(melt(0.1), time, 0.005)
    assert fit.equilibrium_shear_modulus > 0
    assert "does not tell flow from processes slower than the curve" in said
    assert "state equilibrium_modulus (0 for a melt)" in said


@pytest.mark.parametrize("strength", [0.3, 3.0, 30.0])
def test_processes_slower_than_the_curve_are_no_flow(strength: float) -> None:
    truth = melt(0.0, strength, own=3e4)
    fit, said = fitted(truth, np.logspace(-6, 4, 121))
    modulus = 1 / (truth.glassy_compliance + truth.compliance.sum())
    assert fit.equilibrium_shear_modulus == pytest.approx(modulus, rel=0.2)
    assert "does not tell flow from processes slower than the curve" in said


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
            flowing = fit_creep(time, melt(share).creep_compliance(time) / 3, equilibrium_modulus=0.0)
        assert flowing.equilibrium_shear_modulus == 0


@pytest.mark.parametrize(("truth", "flows"), [(SOLID, False), (melt(0.97), True)])
def test_draws_flow_if_and_only_if_the_fit_does(monkeypatch: pytest.MonkeyPatch, truth: RetardationSpectrum, flows: bool) -> None:
    time = np.logspace(-6, 4, 121)
    smooth = truth.creep_compliance(time) / 3
    rng = np.random.default_rng(8)
    curve = Curve("creep", (time, smooth * np.exp(0.005 * rng.standard_normal(time.size))), WLF(20.0, 13.7, 187.1))
    # as resampling makes them: the ends are the least certain
    wave = np.cumsum(rng.standard_normal((12, time.size)), axis=1) * 0.01 / np.sqrt(time.size)
    read = ReadDraws(np.arange(12), CurveDraws(time, (smooth * np.exp(wave))[:, None]), (curve.shift,) * 12)
    monkeypatch.setattr(workflow, "read_curve_draws", lambda *_: read)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        fit = workflow.fit_curve(curve, Fit())
        material = Material("any", fit.equilibrium_shear_modulus, fit.spectrum, curve.shift, Gent(), Gent())
        drawn = workflow.draw_materials("any", curve, fit, material, Fit(), Inputs(Path()))
    assert drawn is not None
    equilibrium = next(column for column in drawn.table if "equilibrium" in column.header).values
    assert len(equilibrium) == 12
    assert (fit.equilibrium_shear_modulus == 0) == flows
    assert np.all((np.asarray(equilibrium, dtype=float) == 0) == flows)
