"""Synthetic experiments whose truth is known: noisy relaxation tests through the whole chain to times to failure."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flat import failure_map, plan_failure_map
from numpy.typing import NDArray

from dielast.base.errors import DielastWarning
from dielast.material.intervals import interval
from dielast.material.material import Breakdown, Material
from dielast.material.measurement import RelaxationCurve
from dielast.material.scatter import draw_sample
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.relaxation.beyond import end_of
from dielast.relaxation.fit import fit_spectrum
from dielast.relaxation.result import Method, SpectrumFit
from dielast.relaxation.spectrum_draws import CurveDraws, draw_spectra
from dielast.relaxation.superposition.bootstrap import bootstrap_master_curve
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve
from dielast.simulate.failure_map import solve_map
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
    """Bounds of the times to failure of a map, the times found, and whether the bounds hold the truth; likewise those of the
    shift factors, ascending, and of C1 and C2, by their standard errors (`fit`) and by the draws (`drawn`)."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    found: NDArray[np.float64]
    held: NDArray[np.bool_]
    shifts_held: NDArray[np.bool_]
    law_held_by_fit: NDArray[np.bool_]
    law_held_by_draws: NDArray[np.bool_]


@dataclass(frozen=True)
class Flaws:
    """What is wrong with a test besides noise: standard deviation of each temperature in K, of the modulus from one temperature to
    the next, and of what a curve is tilted by from end to end."""

    thermometer: float = 0.0
    walk: float = 0.0
    tilt: float = 0.0


def measure(seed: int, noise: float = 0.01, points: int = 40, flaws: Flaws = Flaws()) -> list[RelaxationCurve]:
    random, other = np.random.default_rng([7, seed]), np.random.default_rng([8, seed])
    time = np.geomspace(0.1, 1200, points)
    away = flaws.thermometer * other.standard_normal(TEMPERATURES.size)
    level = np.exp(np.cumsum(flaws.walk * other.standard_normal(TEMPERATURES.size)))
    tilt = flaws.tilt * other.standard_normal(TEMPERATURES.size)
    curves = []
    for k, temperature in enumerate(TEMPERATURES):
        shift = 10 ** float(TRUTH.shift.log10_shift_factor(temperature + away[k]))
        modulus = 3 * TRUTH.spectrum.relaxation_modulus(time / shift, EQUILIBRIUM_MODULUS)
        modulus *= level[k] * (time**2 / (time[0] * time[-1])) ** (tilt[k] / 2 / np.log(time[-1] / time[0]))
        curves.append(RelaxationCurve(float(temperature), time, modulus * (1 + noise * random.standard_normal(points))))
    return curves


def superposed(curves: list[RelaxationCurve], flaws: Flaws = Flaws()) -> MasterCurve:
    """The master curve, thermometer and drift being stated as they are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        stated = {"temperature_stderr": flaws.thermometer, "drift": flaws.walk}
        return build_master_curve(curves, reference_temperature=20.0, **stated)


def ensemble(
    curves: list[RelaxationCurve], method: Method, draws: int, flaws: Flaws = Flaws(), master: MasterCurve | None = None
) -> tuple[Material, list[Material]]:
    """The material found, and its draws."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        master = master or superposed(curves, flaws)
        drawn = bootstrap_master_curve(curves, master, draws=draws)
        fit = fit_spectrum(master.reduced_time, master.relaxation_modulus, method=method)
        tau = fit.spectrum.relaxation_time

        def refit(time: NDArray[np.float64], modulus: NDArray[np.float64]) -> SpectrumFit:
            return fit_spectrum(time, modulus[0], method=method, relaxation_time=(float(tau[-1]), float(tau[0])))

        smooth = CurveDraws(drawn.smooth_abscissa, drawn.smooth_ordinates)
        end = end_of(fit)
        shown = end.carried_on()
        spectra = draw_spectra(master.reduced_abscissa, master.ordinates, smooth, fit, refit, open_end=not end.reached)
    found = replace(TRUTH, equilibrium_modulus=shown.equilibrium_shear_modulus, spectrum=shown.spectrum, shift=master.law)
    tau = spectra.relaxation_time
    members = [
        replace(
            found,
            equilibrium_modulus=float(level),
            spectrum=Spectrum(tau, moduli),
            shift=WLF(20.0, *drawn.law_parameters[k]),
        )
        for k, level, moduli in zip(spectra.used, spectra.equilibrium_modulus, spectra.shear_modulus, strict=True)
    ]
    return found, members


def held_by_fit(master: MasterCurve, width: float = 1.645) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether shift factors and constants of the law are within so many standard errors of the truth."""
    away = np.abs(master.log10_shift_factor - TRUTH.shift.log10_shift_factor(master.temperature))
    moved = master.temperature != 20.0
    law = [abs(master.law_parameters[name] - getattr(TRUTH.shift, name)) < width * master.law_stderr[name] for name in ("C1", "C2")]
    return (away <= width * master.log10_shift_factor_stderr)[moved], np.array(law)


def experiment(seed: int, method: Method = "nnls", draws: int = 60, level: float = 0.9, flaws: Flaws = Flaws()) -> Experiment:
    """Measure, shift, fit, and predict times to failure; standard errors are compared at level 0.9."""
    curves = measure(seed, flaws=flaws)
    master = superposed(curves, flaws)
    found, members = ensemble(curves, method, draws, flaws, master)
    main, *drawn = solve_map(plan_failure_map(found, sample=draw_sample(members, len(members)), **MAP))
    times = np.array([each.time_to_failure for each in drawn])
    low, high = interval(np.where(np.isnan(times), np.inf, times), level)
    truth = failure_map(TRUTH, **MAP).time_to_failure
    ends = np.array(interval(np.array([[own.shift.C1, own.shift.C2] for own in members]), level))
    constants = np.array([TRUTH.shift.C1, TRUTH.shift.C2])
    by_draws = (ends[0] <= constants) & (constants <= ends[1])
    return Experiment(low, high, main.time_to_failure, (low <= truth) & (truth <= high), *held_by_fit(master), by_draws)
