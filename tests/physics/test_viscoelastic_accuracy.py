"""The solver's tolerance, and the paper's relaxation test."""

from __future__ import annotations

import numpy as np
import pytest
from flat import creep, relax
from peers.energies import gent, stress
from scipy.optimize import brentq

from dielast.material.material import Material
from dielast.material.shift import WLF, NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import EQUIBIAXIAL, Gent, NeoHookean
from dielast.mechanics.film import FilmState
from dielast.mechanics.load import Step
from dielast.mechanics.point_material import PointMaterial
from dielast.simulate.setup import prestretched
from reconstruction import spectrum


def vhb(branches: int = 30) -> Material:
    """The reconstruction of VHB 4905 that the paper's figures allow: see the polynomial's use in the spectrum tests."""
    return Material("VHB 4905, reconstruction", 26e3, spectrum(branches), WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0))


CREEP = [Step(stress=0.17 / 3e-6, rate=0.01 / 3e-6), Step.hold(21600.0)]
CREEP_TIMES = np.concatenate((np.linspace(0.1, 17.0, 100), 17.0 + np.geomspace(1e-2, 21600.0, 200)))
RELAX = [Step(stretch=2.0, rate=0.125), Step.hold(7200.0), Step(stretch=1.2, rate=-0.125)]
RELAX_TIMES = np.concatenate(
    (np.linspace(0.05, 8.0, 100), 8.0 + np.geomspace(1e-2, 7200.0, 200), 7208.0 + np.linspace(0.1, 6.0, 50))
)


@pytest.fixture(scope="module")
def references() -> tuple[np.ndarray, np.ndarray]:
    stretch = creep(vhb(), CREEP, times=CREEP_TIMES, rtol=1e-10).stretch_1
    return stretch, relax(vhb(), RELAX, times=RELAX_TIMES, rtol=1e-10).nominal_stress_1


@pytest.mark.parametrize(
    "rtol",
    [
        1e-4,
        pytest.param(1e-5, marks=pytest.mark.trust),
        pytest.param(1e-6, marks=pytest.mark.trust),
        1e-7,
        pytest.param(1e-8, marks=pytest.mark.trust),
        pytest.param(1e-9, marks=pytest.mark.trust),
    ],
)
def test_the_tolerance_asked_for_is_met_within_a_factor_of_three(references: tuple[np.ndarray, np.ndarray], rtol: float) -> None:
    stretch = creep(vhb(), CREEP, times=CREEP_TIMES, rtol=rtol).stretch_1
    assert np.max(np.abs(stretch / references[0] - 1)) <= 3 * rtol
    stress = relax(vhb(), RELAX, times=RELAX_TIMES, rtol=rtol).nominal_stress_1
    # a stress that passes through zero is measured by the size it has before and after
    unloading = RELAX_TIMES > 7208.0
    size = np.where(unloading, np.max(np.abs(references[1][:, unloading])), np.abs(references[1]))
    assert np.max(np.abs(stress - references[1]) / size) <= 3 * rtol


@pytest.mark.parametrize("branches", [1, 3, pytest.param(30, marks=pytest.mark.trust), 300])
def test_spectra_of_any_length(branches: int) -> None:
    tau = np.geomspace(1e8, 1e-8, branches)
    modulus = 1e4 * tau**-0.25
    solid = Material("power law", 26e3, Spectrum(tau, modulus), WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0))
    times = np.geomspace(1e-6, 1e6, 40)
    steps = [Step(stress=5e4), Step.hold(2e6)]
    loose, tight = (creep(solid, steps, times=times, rtol=rtol) for rtol in (1e-6, 1e-8))
    assert loose.stretch_1 == pytest.approx(tight.stretch_1, rel=3e-6)


def test_relaxation_to_two_hours_at_100_percent_is_the_papers_52_kpa() -> None:
    """Fig. 7a's end. Its measured peak, 255 kPa, is above what any spectrum with Table 1's sums reaches; this gives 130."""
    history = relax(vhb(), [Step(stretch=2.0, rate=0.125), Step.hold(7200.0)])
    assert history.nominal_stress_1[0, -1] == pytest.approx(52.2e3, abs=50.0)
    assert history.nominal_stress_1[0].max() == pytest.approx(130e3, rel=0.01)


def test_the_elastic_limit_of_a_creep_step_is_a_root() -> None:
    """At once, all springs answer together: the stretch solves the elastic equation."""
    branches = Spectrum(np.array([500.0, 20.0, 0.3, 1e-3]), np.array([2e4, 5e4, 2e5, 1e6]))
    solid = Material("few", 26e3, branches, WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0))
    history = creep(solid, [Step(stress=1e5), Step.hold(1.0)])

    def imbalance(stretch: float) -> float:
        # the axis left free is that of uniaxial stress: dW/dl_2 = 0
        axes = np.array([stretch]), np.array([stretch**-0.5])
        springs = ((26e3, 110.0), (branches.shear_modulus.sum(), 55.0))
        carried = sum(stress(lambda a, b, m=m, j=j: gent(a, b, m, j), *axes)[0, 0] for m, j in springs)
        return float(carried) - 1e5

    assert history.stretch_1[0, 0] == pytest.approx(brentq(imbalance, 1.0, 3.0, xtol=1e-14), rel=1e-12)


@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_a_prestretched_film_relaxes_as_its_closed_form(rtol: float) -> None:
    """Neo-Hookean branches at a constant equibiaxial stretch: with A the squared elastic stretch, 3 tau dA/dt = (1 - A^3)/A, so
    that t/(3 tau) is the difference of the integral of a/(a^3 - 1).
    """
    stretch, relax_time, tau = np.array([1.3, 3.0]), 40.0, np.array([1e5, 300.0, 30.0, 10.0, 4.0, 1e-3, 1e-8])
    solid = Material("closed form", 26e3, Spectrum(tau, np.full(tau.size, 1e5)), NoShift(20.0), NeoHookean(), NeoHookean())
    points = PointMaterial.of([solid], np.full(2, 20.0), rtol)
    rest = FilmState.at_rest(points, EQUIBIAXIAL)
    film, status = prestretched(rest, (stretch, stretch), np.zeros(2), relax_time, rtol)
    assert not status.any()

    def integral(a: np.ndarray) -> np.ndarray:
        return np.log(a - 1) / 3 - np.log(a * a + a + 1) / 6 + np.arctan((2 * a + 1) / 3**0.5) / 3**0.5

    elastic = np.exp(2 * np.log(stretch) - film.internal[0, 1:-1])
    slow = elastic > 1.001
    took = integral(np.broadcast_to(stretch**2, elastic.shape)[slow]) - integral(elastic[slow])
    change = np.abs(took - (relax_time / (3 * tau))[:, None].repeat(2, axis=1)[slow]) * (elastic - 1 / elastic**2)[slow]
    assert np.max(change) <= 3 * rtol
    assert np.max(np.abs(elastic[-2:] - 1)) <= rtol
    nominal = 26e3 * (stretch - stretch**-5) + 1e5 * np.sum(elastic - elastic**-2, axis=0) / stretch
    assert film.nominal_stress == pytest.approx(np.stack((nominal, nominal)), rel=1e-13)
