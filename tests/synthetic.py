"""Synthetic experiments whose truth is known: noisy relaxation tests through the whole chain to times to failure."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.bootstrap import bootstrap_master_curve
from dielast.characterise.mastercurve import RelaxationCurve, build_master_curve
from dielast.characterise.spectrum import Method, SpectrumFit, fit_spectrum
from dielast.characterise.spectrum_draws import CurveDraws, draw_spectra
from dielast.ensemble import draw_sample, interval
from dielast.errors import DielastWarning
from dielast.gent import Gent
from dielast.material import Breakdown, Material
from dielast.prony import Spectrum
from dielast.shift import WLF
from dielast.simulate.failure_map import failure_map, plan_failure_map, solve_map
from reconstruction import EQUILIBRIUM_MODULUS, spectrum

TRUTH = Material(
    "truth",
    EQUILIBRIUM_MODULUS,
    spectrum(),
    WLF(20.0, 13.7, 187.1),
    Gent(110.0),
    Gent(55.0),
    3.98e-11,
    Breakdown((1.7, 1.9), (40e6, 48e6)),
)
TEMPERATURES = np.arange(60.0, -41.0, -10.0)
MAP: dict[str, Any] = {
    "voltage": [3.8e3, 4.0e3, 4.2e3],
    "prestretch": [1.7, 1.9],
    "temperature": [20.0, 40.0],
    "thickness": 5e-4,
    "horizon": 86400.0,
    "relax": 5400.0,
}


@dataclass(frozen=True)
class Experiment:
    """Bounds of the times to failure of a map, the times found, and whether the bounds hold the truth."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    found: NDArray[np.float64]
    held: NDArray[np.bool_]


def measure(seed: int, noise: float = 0.01, points: int = 40) -> list[RelaxationCurve]:
    random = np.random.default_rng([7, seed])
    time = np.geomspace(0.1, 1200, points)
    curves = []
    for temperature in TEMPERATURES:
        shift = 10 ** float(TRUTH.shift.log10_shift_factor(temperature))
        modulus = 3 * TRUTH.spectrum.relaxation_modulus(time / shift, EQUILIBRIUM_MODULUS)
        curves.append(RelaxationCurve(float(temperature), time, modulus * (1 + noise * random.standard_normal(points))))
    return curves


def ensemble(curves: list[RelaxationCurve], method: Method, draws: int) -> tuple[Material, list[Material]]:
    """The material found, and its draws."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        master = build_master_curve(curves, reference_temperature=20.0)
        drawn = bootstrap_master_curve(curves, master, draws=draws)
        fit = fit_spectrum(master.reduced_time, master.relaxation_modulus, method=method)
        tau = fit.spectrum.relaxation_time

        def refit(time: NDArray[np.float64], modulus: NDArray[np.float64]) -> SpectrumFit:
            return fit_spectrum(time, modulus[0], method=method, relaxation_time=(float(tau[-1]), float(tau[0])))

        smooth = CurveDraws(drawn.smooth_abscissa, drawn.smooth_ordinates)
        spectra = draw_spectra(master.reduced_abscissa, master.ordinates, smooth, fit, refit)
    found = replace(TRUTH, equilibrium_modulus=fit.equilibrium_shear_modulus, spectrum=fit.spectrum, shift=master.law)
    members = [
        replace(found, equilibrium_modulus=float(level), spectrum=Spectrum(tau, moduli), shift=WLF(20.0, *drawn.law_parameters[k]))
        for k, level, moduli in zip(spectra.used, spectra.equilibrium_modulus, spectra.shear_modulus, strict=True)
    ]
    return found, members


def experiment(seed: int, method: Method = "nnls", draws: int = 60, level: float = 0.9) -> Experiment:
    """Measure, shift, fit, and predict times to failure."""
    found, members = ensemble(measure(seed), method, draws)
    main, *drawn = solve_map(plan_failure_map(found, sample=draw_sample(members, len(members)), **MAP))
    times = np.array([each.time_to_failure for each in drawn])
    low, high = interval(np.where(np.isnan(times), np.inf, times), level)
    truth = failure_map(TRUTH, **MAP).time_to_failure
    return Experiment(low, high, main.time_to_failure, (low <= truth) & (truth <= high))
