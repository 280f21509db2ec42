"""Spectra of solids whose spectrum is known, what is said at the limits, and what becomes of what is stated in Young's moduli."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from flat import fit_oscillation, fit_spectrum
from numpy.typing import NDArray

from dielast.base.errors import DielastWarning, InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation import fit as ss
from dielast.relaxation.ends import short_time_end, votes
from dielast.relaxation.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation
from dielast.relaxation.result import SpectrumFit

by_polynomial = partial(fit_spectrum, method="schwarzl-staverman")

Array = NDArray[np.float64]

LEVEL = 2e4  # Pa, shear
TRUTH = Spectrum(np.logspace(3, -3, 7), np.array([1e4, 3e4, 2e4, 5e4, 1e5, 8e4, 2e5]))
TIME = np.logspace(-5, 5, 201)
MODULUS = 3 * TRUTH.relaxation_modulus(TIME, LEVEL)
STORAGE, LOSS = 3 * TRUTH.storage_modulus(TIME, LEVEL), 3 * TRUTH.loss_modulus(TIME)  # over angular frequencies of these numbers
GLASSY = 3 * float(TRUTH.shear_modulus.sum() + LEVEL)
WIDE = np.logspace(-6, 7, 261)
PLATEAUS = 3e4 * 100 ** (0.5 - 0.5 * np.tanh(0.3 * np.log10(WIDE)))  # from 3 MPa to 30 kPa


def relaxation(**options: Any) -> SpectrumFit:
    return fit_spectrum(TIME, MODULUS, method="nnls", branches=7, **options)


def oscillation(**options: Any) -> SpectrumFit:
    return fit_oscillation(TIME, STORAGE, LOSS, branches=7, **options)


FITS: list[Callable[..., SpectrumFit]] = [relaxation, oscillation]


def said(fit: Callable[..., SpectrumFit], **options: Any) -> str:
    """Everything that the fit warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fit(**options)
    assert all(issubclass(entry.category, DielastWarning) for entry in caught)
    return "\n".join(str(entry.message) for entry in caught)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("stated", [{}, {"equilibrium_modulus": 3 * LEVEL}, {"glassy_modulus": GLASSY}])
def test_the_truth_is_found_on_its_own_times_whatever_of_it_is_stated(
    fit: Callable[..., SpectrumFit], stated: dict[str, float]
) -> None:
    """What is stated is Young's modulus, three times the shear modulus that is found."""
    found = fit(relaxation_time=(1e-3, 1e3), **stated)
    np.testing.assert_allclose(found.spectrum.relaxation_time, TRUTH.relaxation_time, rtol=1e-12)
    np.testing.assert_allclose(found.spectrum.shear_modulus, TRUTH.shear_modulus, rtol=1e-4)
    assert found.equilibrium_shear_modulus == pytest.approx(LEVEL, rel=1e-4)
    assert found.max_relative_error < 1e-4
    assert found.clipped_branches == 0
    assert found.smoothing is not None
    np.testing.assert_allclose(found.model, found.measured, rtol=1e-4)
    assert np.all(np.diff(found.reduced_time) > 0)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("stated", [0.95, 1.2])
def test_moduli_add_up_to_the_glassy_modulus_with_the_equilibrium_one(fit: Callable[..., SpectrumFit], stated: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        found = fit(relaxation_time=(1e-3, 1e3), glassy_modulus=stated * GLASSY)
    assert 3 * (found.spectrum.shear_modulus.sum() + found.equilibrium_shear_modulus) == pytest.approx(stated * GLASSY, rel=1e-6)


@pytest.mark.parametrize("fit", FITS)
def test_one_branch_is_enough_and_all_may_be_kept(fit: Callable[..., SpectrumFit]) -> None:
    """Keeping all of them is no truncation: the fit is judged everywhere."""
    all_kept, none_stated = fit(relaxation_time=(1e-3, 1e3), keep=7), fit(relaxation_time=(1e-3, 1e3))
    assert all_kept.max_relative_error == none_stated.max_relative_error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        one = fit_spectrum(TIME, MODULUS, method="nnls", branches=1)
        assert one.branches == fit_oscillation(TIME, STORAGE, LOSS, branches=1).branches == 1


@pytest.mark.parametrize("fit", FITS)
def test_what_is_kept_is_judged_from_its_shortest_time_on(fit: Callable[..., SpectrumFit]) -> None:
    kept = fit(relaxation_time=(1e-3, 1e3), keep=3)
    np.testing.assert_allclose(kept.spectrum.relaxation_time, [1e3, 1e2, 1e1], rtol=1e-12)
    error = np.abs(kept.model / kept.measured - 1)
    late = kept.reduced_time >= kept.spectrum.relaxation_time[-1]
    assert kept.max_relative_error == pytest.approx(error[..., late].max(), rel=1e-12)
    assert kept.rms_relative_error == pytest.approx(np.sqrt(np.mean(error[..., late] ** 2)), rel=1e-12)
    assert error[..., ~late].max() > 2 * kept.max_relative_error


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize(("beyond", "extrapolated"), [(12.0, False), (13.2, True)])
def test_a_process_is_told_by_the_curve_up_to_a_decade_away(
    fit: Callable[..., SpectrumFit], beyond: float, extrapolated: bool
) -> None:
    """And a tenth of a decade more."""
    assert ("extrapolated" in said(fit, relaxation_time=(1e-5 / beyond, 1e3))) == extrapolated
    assert ("extrapolated" in said(fit, relaxation_time=(1e-3, 1e5 * beyond))) == extrapolated


@pytest.mark.parametrize(("beyond", "extrapolated"), [(0.62, False), (0.64, True)])
def test_the_polynomial_tells_processes_whose_double_time_is_on_the_curve(beyond: float, extrapolated: bool) -> None:
    """Times from half of the first to half of the last, and a tenth of a decade more."""

    def fit(**options: Any) -> SpectrumFit:
        return by_polynomial(WIDE, PLATEAUS, equilibrium_modulus=2.9e4, **options)

    assert ("extrapolated" in said(fit, relaxation_time=(1e-6 * 0.25 / beyond, 1e5))) == extrapolated
    assert ("extrapolated" in said(fit, relaxation_time=(1e-5, 1e7 * beyond))) == extrapolated
    np.testing.assert_allclose(fit().spectrum.relaxation_time[[0, -1]], [0.5e7, 0.5e-6], rtol=1e-12)


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve")
@pytest.mark.parametrize(("fit", "past"), [(relaxation, 1.0), (oscillation, 10**0.5)])
def test_processes_are_sought_no_farther_than_the_curve_tells(fit: Callable[..., SpectrumFit], past: float) -> None:
    """Up to its ends, of an oscillation half a decade beyond them; one end may be stated, and then stays."""
    free = fit().spectrum.relaxation_time
    assert free[0] <= 1e5 * past * (1 + 1e-9)
    assert free[-1] >= 1e-5 / past * (1 - 1e-9)
    assert fit(relaxation_time=(2e-3, None)).spectrum.relaxation_time[-1] == pytest.approx(2e-3, rel=1e-12)
    assert fit(relaxation_time=(None, 5e2)).spectrum.relaxation_time[0] == pytest.approx(5e2, rel=1e-12)


def test_an_oscillation_that_falls_to_its_end_is_said_to_fall() -> None:
    early = TIME > 1e-2  # frequencies down to where G' still falls
    with pytest.warns(DielastWarning, match="the curve has not levelled off"):
        fit_oscillation(TIME[early], STORAGE[early], LOSS[early], branches=12)
    assert said(oscillation, relaxation_time=(1e-3, 1e3)) == ""


def test_the_end_of_an_oscillation_is_that_of_its_storage_modulus() -> None:
    """An equilibrium modulus is compared with it, and not with the loss modulus."""
    with pytest.raises(InputError, match=r"is above the end of the curve, 6.00\de\+04 Pa"):
        oscillation(equilibrium_modulus=1.2 * 3 * LEVEL)
    with pytest.warns(DielastWarning, match="above the end of the curve"):
        oscillation(relaxation_time=(1e-3, 1e3), equilibrium_modulus=1.05 * 3 * LEVEL)
    assert "above the end" not in said(oscillation, relaxation_time=(1e-3, 1e3), equilibrium_modulus=1.015 * 3 * LEVEL)


def test_the_sum_of_the_moduli_is_what_the_curve_falls_by() -> None:
    """Its smoothed first modulus less the equilibrium modulus, unless the polynomial has more of it at the shortest time."""
    largest = short_time_end(np.log10(WIDE), PLATEAUS / 3).modulus
    polynomial = ss.fit_polynomial(np.log10(WIDE), np.log10(PLATEAUS / 3), 7, votes(np.log10(WIDE)))
    by = {}
    for fastest in (5e-7, 1e-4):
        fit = by_polynomial(WIDE, PLATEAUS, equilibrium_modulus=2.9e4, relaxation_time=(fastest, None))
        seen = float(ss.cumulative_spectrum(polynomial, 2.9e4 / 3, fastest))
        assert fit.spectrum.shear_modulus.sum() == pytest.approx(max(largest - 2.9e4 / 3, seen), rel=1e-9)
        by[fastest] = seen < largest - 2.9e4 / 3
    assert by == {5e-7: False, 1e-4: True}


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve")
def test_a_curve_that_falls_from_its_first_point_on_has_more_than_it_shows() -> None:
    """Of a power law t^-n, H(tau) = (1 + n) G(2 tau) at the shortest time of half the first one: 1 + n times the first modulus."""
    time = np.logspace(-2, 4, 121)
    fit = by_polynomial(time, 3e6 * time**-0.3, equilibrium_modulus=0.0)
    assert fit.spectrum.shear_modulus.sum() == pytest.approx(1.3 * 1e6 * time[0] ** -0.3, rel=1e-6)
    assert fit.polynomial_rms_relative_error == pytest.approx(0.0, abs=1e-9)


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve")
def test_the_polynomial_is_judged_by_what_it_misses() -> None:
    """Of ripples of 10 % about a line, one over the square root of two."""
    time = np.logspace(-3, 3, 241)
    rippled = 3e5 * time**-0.1 * (1 + 0.1 * np.sin(60 * np.log10(time)))
    with pytest.warns(DielastWarning, match=r"the polynomial of degree 2 misses the curve by 7.\d% rms"):
        fit = by_polynomial(time, rippled, polynomial_degree=2, equilibrium_modulus=0.0)
    assert fit.polynomial_rms_relative_error == pytest.approx(0.1 / 2**0.5, rel=0.02)
    assert "polynomial" not in said(lambda: by_polynomial(time, 3e5 * time**-0.1, polynomial_degree=1, equilibrium_modulus=0.0))


@pytest.mark.filterwarnings("ignore:equilibrium_modulus.* above the end of the curve")
@pytest.mark.parametrize(
    ("options", "advice"),
    [
        ({"equilibrium_modulus": 1.09 * PLATEAUS[-1]}, "a lower equilibrium_modulus"),
        ({"equilibrium_modulus": 1.09 * PLATEAUS[-1], "keep": 29}, "a lower equilibrium_modulus"),
        ({"equilibrium_modulus": 1.09 * PLATEAUS[-1], "glassy_modulus": 2.4e6}, "a larger glassy_modulus"),
    ],
)
def test_advice_names_what_made_a_modulus_negative(options: dict[str, Any], advice: str) -> None:
    """The slowest is what the equilibrium modulus leaves, the fastest what the glassy modulus does."""
    with pytest.raises(InputError, match=f"came out negative .*, {advice}, or method") as refused:
        by_polynomial(WIDE, PLATEAUS, **options)
    assert str(refused.value).count("modulus,") == 1


def test_a_negative_branch_that_is_not_kept_does_no_harm() -> None:
    assert fit_spectrum(WIDE, PLATEAUS, glassy_modulus=2.4e6, keep=29).clipped_branches == 0


def test_what_clipping_changes_is_told_where_it_changes_most() -> None:
    """The change of G(t) is that of all negative moduli together."""
    time = WIDE
    bumpy = PLATEAUS * (1 + 0.05 * np.exp(-0.5 * ((np.log10(time) - 4) / 0.5) ** 2))
    with pytest.warns(DielastWarning) as caught:
        fit = by_polynomial(time, bumpy, polynomial_degree=20)
    (said,) = [str(each.message) for each in caught if "came out negative" in str(each.message)]
    polynomial = ss.fit_polynomial(np.log10(time), np.log10(bumpy / 3), 20, votes(np.log10(time)))
    tau = fit.spectrum.relaxation_time
    cumulative = ss.cumulative_spectrum(polynomial, fit.equilibrium_shear_modulus, tau)
    moduli = ss.discrete_moduli(cumulative, max(float(fit.spectrum.shear_modulus.sum()), float(cumulative[-1])))
    negative = moduli[:-1] < 0
    lost = np.exp(-time[:, None] / tau[:-1][negative]) @ -moduli[:-1][negative] / (fit.model / 3)
    assert (
        f"{negative.sum()} of 30 moduli came out negative (the slowest at a relaxation time of {tau[:-1][negative][0]:.3g} s)"
        in said
    )
    assert said.endswith(f"changes G({time[np.argmax(lost)]:.3g} s) by {lost.max():.2%}")
    assert fit.clipped_branches == negative.sum()


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_interconversion_knows_no_unit(unit: float) -> None:
    """A flowing and a solid material, in moduli of 1e-6 and of 1e6: the identity of the two brackets holds in every unit."""
    for level in (0.0, 0.3 * unit):
        spectrum = Spectrum(np.array([30.0, 2.0, 0.1]), unit * np.array([0.2, 1.0, 0.5]))
        creep = retardation_from_relaxation(spectrum, level)
        back, equilibrium = relaxation_from_retardation(creep)
        np.testing.assert_allclose(back.relaxation_time, spectrum.relaxation_time, rtol=1e-12)
        np.testing.assert_allclose(back.shear_modulus, spectrum.shear_modulus, rtol=1e-12)
        assert equilibrium == pytest.approx(level, rel=1e-12)
        assert creep.glassy_compliance == pytest.approx(1 / (level + 1.7 * unit), rel=1e-12)
        assert creep.fluidity == (0.0 if level else pytest.approx(1 / (unit * (6.0 + 2.0 + 0.05)), rel=1e-12))


def test_a_zero_right_beside_a_pole_costs_no_digits() -> None:
    """A process of almost no strength: the retardation time stands off its own by 1e-14 of it, and the strength is right."""
    spectrum = Spectrum(np.array([100.0, 1.0]), np.array([1e-9, 1.0]))
    creep = retardation_from_relaxation(spectrum, 1.0)
    others = 1.0 - 0.01 / (1 - 0.01)  # their modulus at s = -1/100, which the weak process sees, to first order in its strength
    assert creep.compliance[0] == pytest.approx(1e-9 / others**2, rel=1e-6)
    assert creep.retardation_time[0] > 100.0
    back, _ = relaxation_from_retardation(creep)
    np.testing.assert_allclose(back.shear_modulus, spectrum.shear_modulus, rtol=1e-5)


@pytest.mark.parametrize("retarded", [0, 2])
def test_processes_are_sorted_and_their_numbers_locked(retarded: int) -> None:
    given = np.array([1.0, 100.0])[:retarded]
    creep = RetardationSpectrum(given, np.array([3e-6, 1e-6])[:retarded], 1e-6, 0.0)
    np.testing.assert_array_equal(creep.retardation_time, given[::-1])
    np.testing.assert_array_equal(creep.compliance, np.array([3e-6, 1e-6])[:retarded][::-1])
    assert creep.creep_compliance(0.0) == 1e-6
    assert not creep.compliance.flags.writeable
    given[:] = 7.0
    assert np.all(creep.retardation_time != 7.0)


@pytest.mark.parametrize(
    "parts",
    [
        (np.array([1.0, np.inf]), np.ones(2), 1.0, 0.0),
        (np.array([1.0, np.nan]), np.ones(2), 1.0, 0.0),
        (np.array([1.0, -1.0]), np.ones(2), 1.0, 0.0),
        (np.ones(2), np.array([1.0, -1e-9]), 1.0, 0.0),
        (np.ones(2), np.array([1.0, np.inf]), 1.0, 0.0),
        (np.ones(2), np.ones(2), -1e-9, 1.0),
        (np.ones(2), np.ones(2), np.nan, 0.0),
        (np.ones(2), np.ones(2), 1.0, np.inf),
    ],
)
def test_impossible_retardation_is_refused(parts: tuple[Array, Array, float, float]) -> None:
    with pytest.raises(InputError):
        RetardationSpectrum(*parts)


@pytest.mark.parametrize(("moduli", "equilibrium"), [([0.0], 0.0), ([1.0], -1e-9), ([2.0], -1.0), ([1.0], np.inf), ([1.0], np.nan)])
def test_impossible_relaxation_does_not_creep(moduli: list[float], equilibrium: float) -> None:
    with pytest.raises(InputError, match="moduli that are not negative, and not all zero"):
        retardation_from_relaxation(Spectrum(np.ones(1), np.array(moduli)), equilibrium)


def test_a_spring_alone_neither_relaxes_nor_creeps() -> None:
    creep = retardation_from_relaxation(Spectrum(np.ones(1), np.zeros(1)), 0.5)
    assert (creep.retardation_time.size, creep.glassy_compliance, creep.fluidity) == (0, 2.0, 0.0)
    spectrum, level = relaxation_from_retardation(creep)
    assert (len(spectrum), level) == (0, 0.5)
