"""The reconstructed master curve of VHB 4905, fitted to the figures of DOI 10.1115/1.4030850: not a measurement."""

from __future__ import annotations

import numpy as np

from dielast.material.spectrum import Spectrum

# log10 G [Pa] over log10 t [s]; coefficients of x^7 .. x^0, valid for -7.4 <= x <= 5.51
LOG_MODULUS = np.poly1d(
    [-1.09196136e-06, 5.82911403e-06, 1.38496445e-04, -9.05466661e-04, -3.87896645e-03, 5.67261496e-02, -2.82629798e-01, 5.03605001]
)
EQUILIBRIUM_MODULUS = 26e3  # Pa, shear
TOTAL_MODULUS = 230e6  # Pa, shear, of all branches
SLOWEST, FASTEST = 1.59e5, 3.98e-8  # s


def spectrum(branches: int = 30, slowest: float = SLOWEST) -> Spectrum:
    """The discrete spectrum by Eqs. 16 (corrected), 19 and 20."""
    tau = slowest * (FASTEST / slowest) ** (np.arange(branches) / (branches - 1))
    x = np.log10(2 * tau)
    slower = 10 ** LOG_MODULUS(x) * (1 - LOG_MODULUS.deriv()(x)) - EQUILIBRIUM_MODULUS
    mu = np.empty(branches)
    mu[0] = (slower[0] + slower[1]) / 2
    mu[1:-1] = (slower[2:] - slower[:-2]) / 2
    mu[-1] = TOTAL_MODULUS - mu[:-1].sum()
    return Spectrum(tau, mu)
