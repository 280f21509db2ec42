"""The relaxation spectrum of Schwarzl and Staverman, second order, from a polynomial through the master curve.

Equations 14 to 20 of DOI 10.1115/1.4030850, with the equilibrium modulus subtracted in Eq. 16 as Eqs. 17, 18 and 20 require.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class CumulativeSpectrum:
    """H(tau), the sum of the moduli of all processes slower than tau.

    `log10_modulus` is f0, the polynomial log10 G over x = log10 t (G in Pa, t in s); `equilibrium_modulus` is mu_eq in Pa (shear).
    """

    log10_modulus: Chebyshev
    equilibrium_modulus: float

    def __call__(self, relaxation_time: ArrayLike) -> Floats:
        """H(tau) = 10^f0 (1 - f0') - mu_eq at x = log10(2 tau), Eq. 16, in Pa and of the shape of `relaxation_time` (s)."""
        x = np.log10(2 * np.asarray(relaxation_time, dtype=float))
        f0, slope = self.log10_modulus(x), self.log10_modulus.deriv()(x)
        return np.asarray(10**f0 * (1 - slope) - self.equilibrium_modulus)


def fit_polynomial(log10_time: Floats, log10_modulus: Floats, degree: int, weight: Floats) -> Chebyshev:
    """Least-squares polynomial through points of shape (n,), each squared residual times its `weight`.

    It is in Chebyshev form over the range of the points, where the fit is well conditioned at any degree and in any unit of time.
    Raises `InputError` if the points do not determine it.
    """
    times = np.unique(log10_time).size
    if times <= degree:
        raise InputError(
            f"a polynomial of degree {degree} needs points at {degree + 1} different times, and the curve has {times}: "
            f"lower polynomial_degree",
            mentions=("polynomial_degree",),
        )
    domain = [float(log10_time.min()), float(log10_time.max())]
    fitted, (_, rank, _, _) = Chebyshev.fit(log10_time, log10_modulus, degree, domain=domain, w=np.sqrt(weight), full=True)
    if rank <= degree:
        raise InputError(
            f"the curve's times are too bunched for a polynomial of degree {degree}: lower polynomial_degree",
            mentions=("polynomial_degree",),
        )
    return fitted


def relaxation_times(slowest: float, fastest: float, branches: int) -> Floats:
    """Eq. 19: tau_k = tau_max (tau_min / tau_max)^((k - 1)/(N - 1)), slowest first, of shape (branches,)."""
    return np.asarray(np.geomspace(slowest, fastest, branches))


def discrete_moduli(cumulative: Floats, total: float) -> Floats:
    """Eq. 20: moduli in Pa from H at N relaxation times (N,), slowest first, and mu_neq = `total`, their sum.

    mu_1 = (H_1 + H_2)/2, mu_k = (H_{k+1} - H_{k-1})/2, mu_N = mu_neq - sum of the others. So the sum of the first k < N moduli is
    the mean of H_k and H_{k+1}: the staircase of the discrete spectrum follows H. A modulus may be negative.
    """
    slower = (cumulative[:-1] + cumulative[1:]) / 2
    return np.diff(np.concatenate([[0.0], slower, [total]]))
