"""Synthetic laboratories whose truth is known: materials of several spectral shapes, tests with stated and unstated flaws.

A regime is a `Laboratory`; `measure` gives one experiment of it. The shape of the spectrum changes from one seed to the next.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.relaxation.interconversion import RetardationSpectrum, retardation_from_relaxation
from reconstruction import EQUILIBRIUM_MODULUS, spectrum as reconstruction

Array = NDArray[np.float64]
Shape = Literal["reconstruction", "power law", "two bumps", "stretched exponential"]

LAW = WLF(20.0, 13.7, 187.1)
COLDEST, HOTTEST = -40.0, 60.0  # degC; at the hottest, all spectra have reached their plateau within a test
SHORTEST, LONGEST = 0.1, 1200.0  # s; frequencies are their inverse
SHAPES: tuple[Shape, ...] = ("reconstruction", "power law", "two bumps", "stretched exponential")
PER_DECADE = 8  # Maxwell elements of the spectra


@dataclass(frozen=True)
class Truth:
    """A material: shear moduli in Pa, times in s at 20 degC, and its shift law."""

    shape: Shape
    spectrum: Spectrum
    equilibrium_modulus: float
    law: WLF = LAW


@dataclass(frozen=True)
class Laboratory:
    """What is measured and how well: relative `noise` of each point, `points` of a curve, number of `temperatures` up to `hottest`
    degC; standard deviations of the temperatures (`thermometer`, K), of the modulus from one test to the next (`drift`, relative),
    and of the tilt of a curve from end to end (`tilt`, relative). The drift is stated to dielast unless `drift_stated` is False.

    A test over time may start with a `ramp` that is left in, as response over the load of the moment or over the last load
    (`over_last`); its duration in s differs from one experiment to the next by up to 10 %, so that no rounding is right by chance.
    It is recorded from `first` s on, or from its end if `first` is `ramp`. log10 a of the slow processes is larger by the
    factor 1 + `slow`.
    """

    kind: Literal["relaxation", "creep", "sweep"] = "relaxation"
    noise: float = 0.005
    points: int = 62
    temperatures: int = 14
    hottest: float = HOTTEST
    thermometer: float = 0.0
    drift: float = 0.0
    drift_stated: bool = True
    tilt: float = 0.0
    ramp: float = 0.0
    over_last: bool = False
    first: float = SHORTEST
    slow: float = 0.0

    @property
    def temperature(self) -> Array:
        """Temperatures in degC, in the order of the tests: from the hottest down."""
        return np.round(np.linspace(self.hottest, COLDEST, self.temperatures), 1)

    @property
    def reference(self) -> float:
        """The measured temperature that is nearest to 20 degC."""
        return float(self.temperature[np.argmin(np.abs(self.temperature - 20.0))])

    @property
    def stated(self) -> dict[str, float]:
        """Arguments of `build_master_curve` that state the errors."""
        return {"temperature_stderr": self.thermometer, "drift": self.drift if self.drift_stated else 0.0}


# Clean ones first: noise alone, which gives no reason for a warning.
CLEAN: dict[str, Laboratory] = {
    "noise 0.5 %": Laboratory(),
    "noise 0.1 %": Laboratory(noise=0.001),
    "noise 2 %": Laboratory(noise=0.02),
    "12 points": Laboratory(points=12),
    "120 points": Laboratory(points=120),
    "5 temperatures": Laboratory(temperatures=5),
    "28 temperatures": Laboratory(temperatures=28),
    "creep": Laboratory(kind="creep"),
    "sweeps": Laboratory(kind="sweep"),
}
FLAWED: dict[str, Laboratory] = {
    "thermometer 0.3 K": Laboratory(thermometer=0.3),
    "drift 2 % stated": Laboratory(drift=0.02),
    "drift 2 % not stated": Laboratory(drift=0.02, drift_stated=False),
    "tilt 1 %": Laboratory(tilt=0.01),
    "plateau not reached by 20 K": Laboratory(hottest=HOTTEST - 20),
    "plateau not reached by 40 K": Laboratory(hottest=HOTTEST - 40),
}
OF_LAW: dict[str, Laboratory] = {
    "ramp 1 s, from its end on": Laboratory(ramp=1.0, first=1.0),
    "ramp 1 s, over the strain": Laboratory(ramp=1.0),
    "ramp 1 s, over last strain": Laboratory(ramp=1.0, over_last=True),
    "ramp 0.4 s, over the strain": Laboratory(ramp=0.4),
    "ramp 0.2 s, over the strain": Laboratory(ramp=0.2),
    "ramp 0.4 s, from 1 s on": Laboratory(ramp=0.4, first=1.0),
    "creep, ramp 1 s": Laboratory(kind="creep", ramp=1.0),
    "creep, ramp 0.4 s": Laboratory(kind="creep", ramp=0.4),
    "creep, ramp 1 s, over last": Laboratory(kind="creep", ramp=1.0, over_last=True),
    "creep, ramp 1 s, from its end": Laboratory(kind="creep", ramp=1.0, first=1.0),
    "two processes, +3 %": Laboratory(slow=0.03),
    "two processes, +10 %": Laboratory(slow=0.10),
    "two processes, -10 %": Laboratory(slow=-0.10),
    "two processes, +20 %": Laboratory(slow=0.20),
}
REGIMES = CLEAN | FLAWED | OF_LAW


def truth_of(seed: int) -> Truth:
    """The material of an experiment: the shapes take turns."""
    return material(SHAPES[seed % len(SHAPES)])


@cache
def material(shape: Shape) -> Truth:
    """A material with this shape of the spectrum, at 20 degC."""
    if shape == "reconstruction":
        return Truth(shape, reconstruction(), EQUILIBRIUM_MODULUS)
    tau = np.logspace(4.5, -9.0, int(13.5 * PER_DECADE) + 1)
    width, equilibrium = np.log(10) / PER_DECADE, 5e4
    if shape == "power law":  # rubbery and glassy wedge (M. Baumgaertel, A. Schausberger, H. H. Winter, Rheol. Acta 29 (1990) 400)
        height = 3e4 * (tau / tau[0]) ** 0.2 + 2e3 * (tau / tau[0]) ** -0.42
        height *= np.exp(-2 * tau / tau[0])
    elif shape == "two bumps":
        x = np.log10(tau)
        height = 4e6 * np.exp(-(((x + 5.5) / 1.6) ** 2) / 2) + 6e4 * np.exp(-(((x - 1.2) / 1.3) ** 2) / 2)
    else:
        from scipy.optimize import nnls

        time = np.logspace(-10, 6, 400)
        stretched = np.exp(-((time / 10.0) ** 0.25))
        basis = np.exp(-time[:, None] / tau)
        height = 1e3 * equilibrium / width * nnls(basis, stretched)[0]
        kept = height > 0
        return Truth(shape, Spectrum(tau[kept], height[kept] * width), equilibrium)
    return Truth(shape, Spectrum(tau, height * width), equilibrium)


@cache
def _retardation(shape: Shape) -> RetardationSpectrum:
    truth = material(shape)
    return retardation_from_relaxation(truth.spectrum, truth.equilibrium_modulus)


def measure(laboratory: Laboratory, seed: int) -> list[Measurement]:
    """The tests of one experiment, in the order in which they are made; equal seeds have equal noise and flaws in all regimes."""
    truth, noise, flaws = truth_of(seed), np.random.default_rng([41, seed]), np.random.default_rng([42, seed])
    duration = ramp_of(laboratory, seed)
    begin = duration if duration > 0 and laboratory.first == laboratory.ramp else laboratory.first
    temperature, time = laboratory.temperature, np.geomspace(begin, LONGEST, laboratory.points)
    m = temperature.size
    off, step, lean = flaws.standard_normal((3, 100))[:, :m]
    shift = 10 ** np.asarray(truth.law.log10_shift_factor(temperature + laboratory.thermometer * off))
    level = np.exp(np.cumsum(laboratory.drift * step))
    along = np.linspace(-0.5, 0.5, time.size)
    curves: list[Measurement] = []
    for k, at in enumerate(temperature.tolist()):
        factor = level[k] * np.exp(laboratory.tilt * lean[k] * along)
        scatter = 1 + laboratory.noise * noise.standard_normal((2, time.size))
        if laboratory.kind == "relaxation":
            modulus = 3 * _relaxation(laboratory, seed, time, float(shift[k]))
            curves.append(RelaxationCurve(at, time, modulus * factor * scatter[0]))
        elif laboratory.kind == "creep":
            compliance = _creep(laboratory, seed, time, float(shift[k])) / 3
            curves.append(CreepCurve(at, time, compliance / factor * scatter[0]))
        else:
            frequency = 1 / time[::-1]
            reduced = frequency * shift[k]
            storage = 3 * truth.spectrum.storage_modulus(reduced, truth.equilibrium_modulus)
            loss = 3 * truth.spectrum.loss_modulus(reduced)
            curves.append(FrequencySweep(at, frequency, storage * factor[::-1] * scatter[0], loss * factor[::-1] * scatter[1]))
    return curves


def ramp_of(laboratory: Laboratory, seed: int) -> float:
    """The duration in s of the ramp of an experiment; 0 if there is none."""
    return laboratory.ramp * float(np.random.default_rng([46, seed]).uniform(0.9, 1.1))


def _relaxation(laboratory: Laboratory, seed: int, time: Array, shift: float) -> Array:
    """Shear modulus in Pa at `time` in s, where the fast processes are slower than at 20 degC by the factor `shift`."""
    truth, ramp = truth_of(seed), ramp_of(laboratory, seed)
    tau, moduli = truth.spectrum.relaxation_time, truth.spectrum.shear_modulus
    here = tau * shift ** np.where(np.log10(tau) > _border(seed), 1 + laboratory.slow, 1.0)
    if not ramp:
        return np.asarray(truth.equilibrium_modulus + np.exp(-time[:, None] / here) @ moduli)
    # the stress of a ramp is the integral of the modulus over the ages of its parts
    ramped = np.minimum(time, ramp)
    grown = (np.exp(-(time - ramped)[:, None] / here) - np.exp(-time[:, None] / here)) @ (here * moduli)
    return np.asarray((truth.equilibrium_modulus * ramped + grown) / (ramp if laboratory.over_last else ramped))


def _creep(laboratory: Laboratory, seed: int, time: Array, shift: float) -> Array:
    """Shear compliance in 1/Pa at `time` in s, where all processes are slower than at 20 degC by the factor `shift`."""
    retardation, ramp = _retardation(truth_of(seed).shape), ramp_of(laboratory, seed)
    if not ramp:
        return np.asarray(retardation.creep_compliance(time / shift))
    here, ramped = retardation.retardation_time * shift, np.minimum(time, ramp)
    last = retardation.glassy_compliance + retardation.compliance.sum()
    faded = (np.exp(-(time - ramped)[:, None] / here) - np.exp(-time[:, None] / here)) @ (here * retardation.compliance)
    flown = retardation.fluidity / shift * (time**2 - (time - ramped) ** 2) / 2
    return np.asarray((last * ramped - faded + flown) / (ramp if laboratory.over_last else ramped))


def _border(seed: int) -> float:
    """log10 of the time in s at 20 degC that separates fast from slow processes."""
    return float(np.random.default_rng([45, seed]).uniform(-5.0, 0.0))


def true_laws(laboratory: Laboratory, seed: int) -> tuple[WLF, WLF]:
    """The law about the reference temperature: of the process that relaxes in the middle of the test at most of the temperatures,
    and of the other one.
    """
    law, reference = truth_of(seed).law, laboratory.reference
    moved = law.C2 + reference - law.reference_temperature
    fast, slow = (WLF(reference, law.C1 * law.C2 / moved * factor, moved) for factor in (1.0, 1 + laboratory.slow))
    middle = np.log10(SHORTEST * LONGEST) / 2 - np.median(law.log10_shift_factor(laboratory.temperature))
    return (slow, fast) if _border(seed) < middle else (fast, slow)


def true_shift(laboratory: Laboratory, seed: int) -> Array:
    """log10 a at the ascending temperatures, relative to the reference temperature, by the first of the `true_laws`."""
    return np.asarray(true_laws(laboratory, seed)[0].log10_shift_factor(laboratory.temperature[::-1]))
