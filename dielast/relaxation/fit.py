"""From a master curve of relaxation to the discrete relaxation spectrum of a generalised Maxwell solid."""

from __future__ import annotations

from typing import get_args

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike

from dielast.errors import InputError, warn
from dielast.material.measurement_kind import RELAXATION
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats
from dielast.relaxation import schwarzl_staverman as ss
from dielast.relaxation.checks import TOLERATED, TimeRange, range_of_times, rms
from dielast.relaxation.ends import short_time_end
from dielast.relaxation.nnls import WeightedCurve
from dielast.relaxation.result import Method, SpectrumFit
from dielast.relaxation.task import FitTask

__all__ = ["Method", "SpectrumFit", "fit_spectrum"]


ROUNDING = 1e-12  # of the largest modulus: smaller negative values are rounding errors
POOR_POLYNOMIAL = 0.05  # relative rms


def fit_spectrum(
    reduced_time: ArrayLike,
    modulus: ArrayLike,
    *,
    method: Method = "schwarzl-staverman",
    branches: int = 30,
    polynomial_degree: int = 7,
    relaxation_time: TimeRange = (None, None),
    equilibrium_modulus: float | None = None,
    glassy_modulus: float | None = None,
    keep: int | None = None,
    liquid: bool = False,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve: `modulus` (Young's, Pa) over `reduced_time` (s), both (n,), in any order.

    "schwarzl-staverman" (Eqs. 14-20 of DOI 10.1115/1.4030850) derives the spectrum from a polynomial through log G over log t of
    `polynomial_degree`; "nnls" fits non-negative moduli to the relative error. The material is incompressible: shear modulus =
    Young's / 3. Points that are dense in log time share their weight.

    `relaxation_time` is the shortest and the longest time in s. If one is None, schwarzl-staverman uses the range in which t = 2
    tau stays on the curve, and nnls places it inside the curve where it fits best. `equilibrium_modulus` (Young's, Pa; 0 for a
    melt) is by default that at the end of the curve, or fitted by nnls. `glassy_modulus` (Young's, Pa), that at the shortest times,
    is three times the sum of all shear moduli including the equilibrium modulus, which determines mu_neq of Eq. 20. By default,
    schwarzl-staverman uses the largest modulus of the curve, smoothed, or the equilibrium modulus plus H at the shortest relaxation
    time if that is larger; nnls does not prescribe it. `keep` truncates to the slowest branches (Sec. 3.4). A `liquid` has no
    equilibrium modulus and needs no plateau.

    Raises `InputError` for points or arguments that allow no fit, and if negative moduli contribute more than 2 % of G(t). Warns of
    smaller negative moduli (they are set to 0), of extrapolation, of an end without a plateau, of a plateau far above the stated
    equilibrium modulus, and of a poor fit.
    """
    if method not in get_args(Method):
        raise InputError(f'"{method}": "schwarzl-staverman" or "nnls" is needed', argument="method")
    if method != "nnls" and polynomial_degree < 1:
        raise InputError(f"{polynomial_degree}: at least 1 is needed", argument="polynomial_degree")
    task = FitTask.of(
        RELAXATION,
        (reduced_time, modulus),
        branches,
        relaxation_time,
        equilibrium_modulus,
        glassy_modulus,
        keep,
        liquid,
        method=method,
        fewest=1 if method == "nnls" else 3,
    )
    if method == "nnls":
        return task.fit_moduli(past=1.0)
    return _schwarzl_staverman(task, polynomial_degree)


def _schwarzl_staverman(task: FitTask, degree: int) -> SpectrumFit:
    """The spectrum from a polynomial of this `degree` through log modulus over log time."""
    curve, time = task.curve, task.curve.time
    # Eq. 16 reads the curve at t = 2 tau
    shortest, longest = range_of_times(task.times, (time[0] / 2, time[-1] / 2), time, seen_at=(2, 2), kept=task.kept)
    tau = ss.relaxation_times(longest, shortest, task.branches)
    equilibrium = task.plateau.modulus if task.equilibrium is None else task.equilibrium
    polynomial = ss.fit_polynomial(np.log10(time), np.log10(curve.size), degree, curve.weight)
    error = _polynomial_error(polynomial, curve)
    cumulative = _cumulative(polynomial, equilibrium, tau, time)
    total = _nonequilibrium(curve, equilibrium, cumulative) if task.glassy is None else task.glassy - equilibrium
    moduli = ss.discrete_moduli(cumulative, total)
    task.warn_of_equilibrium(equilibrium)
    tau, moduli = tau[: task.keep], moduli[: task.keep]
    spectrum = Spectrum(tau, np.maximum(moduli, 0.0))
    clipped = _clipped(tau, moduli, task.branches, time, spectrum.relaxation_modulus(time, equilibrium))
    return task.finish("schwarzl-staverman", spectrum, equilibrium, clipped_branches=clipped, polynomial_rms_relative_error=error)


def _nonequilibrium(curve: WeightedCurve, equilibrium: float, cumulative: Floats) -> float:
    """mu_neq from the curve. If the curve falls from its first point on, faster processes contribute, and H is larger."""
    largest = short_time_end(np.log10(curve.time), curve.size).modulus
    return max(largest - equilibrium, float(cumulative[-1]))


def _cumulative(polynomial: Chebyshev, equilibrium: float, tau: Floats, time: Floats) -> Floats:
    with np.errstate(over="ignore", invalid="ignore"):
        cumulative = ss.CumulativeSpectrum(polynomial, equilibrium)(tau)
    if not np.all(np.isfinite(cumulative)):
        raise InputError(
            f"relaxation times from {tau[-1]:.3g} to {tau[0]:.3g} s are so far off the curve that its polynomial exceeds all "
            f"numbers there: keep them between {time[0] / 2:.3g} and {time[-1] / 2:.3g} s, or lower polynomial_degree",
            mentions=("polynomial_degree",),
        )
    return cumulative


def _polynomial_error(polynomial: Chebyshev, curve: WeightedCurve) -> float:
    error = rms(10 ** polynomial(np.log10(curve.time)) / curve.size - 1)
    if error > POOR_POLYNOMIAL:
        warn(
            f"the polynomial of degree {polynomial.degree()} misses the curve by {error:.1%} rms: try another polynomial_degree, "
            f'or method = "nnls"',
            mentions=("polynomial_degree", "method"),
        )
    return error


def _clipped(tau: Floats, moduli: Floats, branches: int, time: Floats, model: Floats) -> int:
    """The number of negative moduli; `InputError` if setting them to 0 changes G(t) too much."""
    negative = moduli < -ROUNDING * float(model.max())
    if not negative.any():
        return 0
    count = int(negative.sum())
    change = np.exp(-time[:, None] / tau[negative]) @ -moduli[negative] / model
    at = int(np.argmax(change))
    clipped = f"{count} of {tau.size} moduli came out negative (the slowest at a relaxation time of {tau[negative][0]:.3g} s)"
    effect = f"G({time[at]:.3g} s) by {change[at]:.2%}"
    if change[at] > TOLERATED:
        last, first = negative[-1] and moduli.size == branches, negative[0]
        remedy = "a larger glassy_modulus, " if last else "a lower equilibrium_modulus, " if first else ""
        raise InputError(
            f"{clipped}, and setting them to zero would change {effect}: try another polynomial_degree, narrower relaxation times, "
            f'{remedy}or method = "nnls"',
            mentions=("polynomial_degree", "method", "glassy_modulus", "equilibrium_modulus"),
        )
    warn(f"{clipped} and were set to zero, which changes {effect}")
    return count
