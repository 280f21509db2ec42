"""Frequency sweeps of entangled melts whose shift factors are known: terminal zone, rubbery plateau, and the wedge of the glass.

The chains relax by double reptation (C. Tsenoglou, ACS Polym. Prepr. 28 (1987) 185; J. des Cloizeaux, Europhys. Lett. 5 (1988)
437) of a log-normal distribution of molar masses; below the time of an entanglement the spectrum is a power law with a glassy end
(M. Baumgaertel, A. Schausberger, H. H. Winter, Rheol. Acta 29 (1990) 400). Both are sums of Maxwell elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.material.measurement import FrequencySweep
from dielast.material.shift import WLF

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Melt:
    """Sweeps at ascending temperatures, and log10 a relative to the `reference` temperature, one of theirs."""

    sweeps: list[FrequencySweep]
    temperature: Array
    shift: Array
    reference: float


def maxwell_elements(
    plateau: float, entanglements: float, polydispersity: float, glassy: float, wedge: float
) -> tuple[Array, Array]:
    """Relaxation times in units of that of an entanglement, and moduli in Pa (shear)."""
    # chains: a dozen masses of a log-normal distribution by weight, the odd modes of reptation, and all pairs of them
    width = np.sqrt(np.log(polydispersity))
    away = np.linspace(-2.2, 2.2, 12)
    weight = np.exp(-(away**2) / 2)
    weight /= weight.sum()
    mode = np.arange(1, 12, 2)
    share = np.outer(weight, 1 / mode**2)
    slowest = 3 * entanglements**3.4 * np.exp(3.4 * width * away)
    rate = (mode**2 / slowest[:, None]).ravel()
    share = share.ravel() / share.sum()
    times = 1 / (rate[:, None] + rate)
    moduli = plateau * np.outer(share, share)
    # below an entanglement's time: H ~ tau^-wedge up to the glass, by eight elements a decade
    tau = np.logspace(0.5, -9, 77)
    height = plateau * wedge * tau**-wedge * np.exp(-tau / 3)
    level = np.cumsum(height) * np.log(10) / 8
    height = np.where(level < glassy, height, 0.0) * np.log(10) / 8
    return np.concatenate((times.ravel(), tau)), np.concatenate((moduli.ravel(), height))


def moduli_of(times: Array, moduli: Array, frequency: Array) -> tuple[Array, Array]:
    """Storage and loss modulus, Young's, at the reduced angular `frequency`."""
    x = frequency[:, None] * times
    return 3 * (x**2 / (1 + x**2)) @ moduli, 3 * (x / (1 + x**2)) @ moduli


def melt(seed: int, without: int | None = None) -> Melt:
    """A melt of its own for each `seed`; `without` leaves out the temperature of that number."""
    rng = np.random.default_rng([31, seed])
    times, moduli = maxwell_elements(
        plateau=10 ** rng.uniform(5, 6.3),
        entanglements=10 ** rng.uniform(0.8, 1.8),
        polydispersity=rng.uniform(1.03, 3.0),
        glassy=10 ** rng.uniform(8.7, 9.3),
        wedge=rng.uniform(0.5, 0.75),
    )
    count = int(rng.integers(3, 11))
    law = WLF(0.0, rng.uniform(5, 16), rng.uniform(50, 200))
    widest = rng.uniform(0.5, 1.6)  # decades from one temperature to the next, where that is most
    points = int(rng.integers(5, 13)) * 3 + 1
    frequency = np.logspace(-1, 2, points)
    # even steps of temperature, the coldest of them the widest in log a
    coldest = rng.uniform(0, 40)
    step = 1.0
    while float(law.log10_shift_factor(coldest) - law.log10_shift_factor(coldest + step)) < widest:
        step += 0.5
    temperature = coldest + step * np.arange(count)
    if without is not None and count > 3:
        temperature = np.delete(temperature, without % count)
    shift = law.log10_shift_factor(temperature)
    # what is measured: from the coldest's highest frequency in the wedge, or in the plateau, downwards
    highest = rng.uniform(-2.0, 4.0)
    reduced = frequency * 10 ** (highest - 2 - float(law.log10_shift_factor(coldest)))
    noise, shared, level = rng.uniform(0.01, 0.03), rng.uniform(0, 0.02), rng.uniform(0, 0.05)
    sweeps = []
    for one, factor in zip(temperature.tolist(), shift, strict=True):
        own = np.random.default_rng([32, seed, round(10 * one)])
        storage, loss = moduli_of(times, moduli, reduced * 10**factor)
        both = np.exp(level * own.standard_normal() + shared * own.standard_normal(points))
        storage = storage * both * np.exp(noise * own.standard_normal(points))
        loss = loss * both * np.exp(noise * own.standard_normal(points))
        sweeps.append(FrequencySweep(one, frequency, storage, loss))
    middle = temperature.size // 2
    return Melt(sweeps, temperature, shift - shift[middle], float(temperature[middle]))
