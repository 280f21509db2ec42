"""Make the reconstructed relaxation test of VHB 4905: a reconstruction from published figures, not a measurement.

The raw data of DOI 10.1115/1.4030850 are not public. A seventh-order polynomial through the published master curve gives a spectrum
by the paper's own recipe (Eqs. 16 to 20), and the small-strain closed form E = 3 [mu_eq + sum mu_k exp(-t / (a(T) tau_k))] (Eqs. 11
and 17) gives what its 21 relaxation tests must have looked like. Relative Gaussian noise is added with a fixed seed.

Usage: python reconstruct_relaxation_test.py [POINTS_A_CURVE] > vhb4905-relaxation-test.csv
"""

import sys

import numpy as np

# log10 G [Pa] over log10 t [s], fitted to the published figures; coefficients of x^7 .. x^0, valid for -7.4 <= x <= 5.51
LOG_MODULUS = np.poly1d(
    [-1.09196136e-06, 5.82911403e-06, 1.38496445e-04, -9.05466661e-04, -3.87896645e-03, 5.67261496e-02, -2.82629798e-01, 5.03605001]
)
EQUILIBRIUM_MODULUS = 26e3  # Pa, shear
TOTAL_MODULUS = 230e6  # Pa, shear, of all branches
BRANCHES, SLOWEST, FASTEST = 30, 1.59e5, 3.98e-8  # relaxation times in s
REFERENCE, C1, C2 = 20.0, 13.7, 187.1  # degC, 1, K
TEMPERATURES = np.arange(60, -41, -5)  # degC
START, END = 0.1, 1200.0  # s
NOISE, SEED = 0.01, 1


def spectrum() -> tuple[np.ndarray, np.ndarray]:
    tau = SLOWEST * (FASTEST / SLOWEST) ** (np.arange(BRANCHES) / (BRANCHES - 1))
    x = np.log10(2 * tau)
    slower = 10 ** LOG_MODULUS(x) * (1 - LOG_MODULUS.deriv()(x)) - EQUILIBRIUM_MODULUS
    mu = np.empty(BRANCHES)
    mu[0] = (slower[0] + slower[1]) / 2
    mu[1:-1] = (slower[2:] - slower[:-2]) / 2
    mu[-1] = TOTAL_MODULUS - mu[:-1].sum()
    return tau, mu


def main(points: int) -> None:
    tau, mu = spectrum()
    noise = np.random.default_rng(SEED)
    time = np.geomspace(START, END, points)
    print("# Reconstruction of VHB 4905 from published figures, not a measurement")
    print("temperature [degC],time [s],relaxation_modulus [Pa]")
    for temperature in TEMPERATURES:
        shift = 10 ** (-C1 * (temperature - REFERENCE) / (C2 + temperature - REFERENCE))
        modulus = 3 * (EQUILIBRIUM_MODULUS + np.exp(-time[:, None] / (shift * tau)) @ mu)
        modulus *= 1 + NOISE * noise.standard_normal(points)
        for t, value in zip(time, modulus, strict=True):
            print(f"{temperature},{t:.6g},{value:.6g}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
