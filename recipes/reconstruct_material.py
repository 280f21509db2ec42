"""Make the reconstructed material VHB 4905: a reconstruction from published figures, not a measurement.

The raw data of DOI 10.1115/1.4030850 are not public. A seventh-order polynomial through the published master curve gives a spectrum
by the paper's own recipe (Eqs. 16 to 20); shift law, its range of temperatures, J_lim and dielectric constants are the paper's.

Usage: python reconstruct_material.py > vhb4905-reconstruction.toml
"""

import sys

import numpy as np

from dielast import WLF, Breakdown, Gent, Material, Spectrum, write_material

# log10 G [Pa] over log10 t [s], fitted to the published figures; coefficients of x^7 .. x^0, valid for -7.4 <= x <= 5.51
LOG_MODULUS = np.poly1d(
    [-1.09196136e-06, 5.82911403e-06, 1.38496445e-04, -9.05466661e-04, -3.87896645e-03, 5.67261496e-02, -2.82629798e-01, 5.03605001]
)
EQUILIBRIUM_MODULUS = 26e3  # Pa, shear
TOTAL_MODULUS = 230e6  # Pa, shear, of all branches
BRANCHES, SLOWEST, FASTEST = 30, 1.59e5, 3.98e-8  # relaxation times in s


def spectrum() -> Spectrum:
    tau = SLOWEST * (FASTEST / SLOWEST) ** (np.arange(BRANCHES) / (BRANCHES - 1))
    x = np.log10(2 * tau)
    slower = 10 ** LOG_MODULUS(x) * (1 - LOG_MODULUS.deriv()(x)) - EQUILIBRIUM_MODULUS
    mu = np.empty(BRANCHES)
    mu[0] = (slower[0] + slower[1]) / 2
    mu[1:-1] = (slower[2:] - slower[:-2]) / 2
    mu[-1] = TOTAL_MODULUS - mu[:-1].sum()
    return Spectrum(tau, mu)


if __name__ == "__main__":
    material = Material(
        name="VHB 4905 (reconstruction)",
        equilibrium_modulus=EQUILIBRIUM_MODULUS,
        spectrum=spectrum(),
        shift=WLF(reference_temperature=20.0, C1=13.7, C2=187.1),
        equilibrium_law=Gent(110.0),
        nonequilibrium_law=Gent(55.0),
        permittivity=3.98e-11,
        breakdown=Breakdown((1.7, 1.9), (40e6, 48e6)),
        measured_temperature=(-40.0, 60.0),
    )
    sys.stdout.buffer.write(b"# A reconstruction from published figures, not a measurement; made by reconstruct_material.py.\n")
    sys.stdout.buffer.write(write_material(material))
