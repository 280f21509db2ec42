"""From a master curve of relaxation or oscillation to the discrete relaxation spectrum of a generalised Maxwell solid.

The spectrum of Schwarzl and Staverman is that of second order, from a polynomial through the master curve: equations 14 to 20 of
DOI 10.1115/1.4030850, with the equilibrium modulus subtracted in Eq. 16 as Eqs. 17, 18 and 20 require.
"""

from typing import get_args

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, shown, warn
from dielast.material.measurement_kind import OSCILLATION, RELAXATION
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats, rms
from dielast.relaxation.checks import TOLERATED, Plateaus, TimeRange, what_rises
from dielast.relaxation.ends import short_time_end
from dielast.relaxation.nnls import WeightedCurve
from dielast.relaxation.result import Method, SpectrumFit
from dielast.relaxation.task import FitTask

PAST_ENDS = 10**0.5  # a process affects the loss modulus within half a decade on either side of its frequency
FEWEST_BRANCHES = 3
ROUNDING = 1e-12  # of the largest modulus: smaller negative values are rounding errors
POOR_POLYNOMIAL = 0.05  # relative rms


def fit_spectrum(
    reduced_time: ArrayLike,
    modulus: ArrayLike,
    *,
    method: Method = "nnls",
    branches: int | None = None,
    polynomial_degree: int = 7,
    relaxation_time: TimeRange = (None, None),
    plateaus: Plateaus = Plateaus(),
    keep: int | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve: `modulus` (Young's, Pa) over `reduced_time` (s), both (n,), in any order.

    "nnls" fits non-negative moduli to the relative error. "schwarzl-staverman" (Eqs. 14-20 of DOI 10.1115/1.4030850) derives the
    spectrum from a polynomial through log G over log t of `polynomial_degree`, and has the error of that polynomial and of the
    approximation. The material is incompressible: shear modulus = Young's / 3. Points that are dense in log time share their
    weight.

    There are by default 30 `branches`, or 5 a decade of the curve if these are more, the method is nnls, and `keep` is not stated;
    an end of `relaxation_time`, the shortest and the longest time in s, counts in place of that of the curve. If one is None,
    schwarzl-staverman uses the range in which t = 2 tau stays on the curve, and nnls places it inside the curve where it fits best.
    The equilibrium modulus of the `plateaus` is by default that at the end of the curve, or fitted by nnls. Their glassy modulus is
    three times the sum of all shear moduli including the equilibrium modulus, which determines mu_neq of Eq. 20. By default,
    schwarzl-staverman uses the largest modulus of the curve, smoothed, or the equilibrium modulus plus H at the shortest relaxation
    time if that is larger; nnls does not prescribe it. `keep` truncates to the slowest branches (Sec. 3.4).

    Raises `InputError` for points or arguments that allow no fit, and if negative moduli contribute more than 2 % of G(t). Warns of
    smaller negative moduli (they are set to 0), of extrapolation, of an end without a plateau, of a plateau far above the stated
    equilibrium modulus, and of a poor fit.
    """
    if method not in get_args(Method):
        raise InputError(f'{shown(method)}: "schwarzl-staverman" or "nnls" is needed', argument="method")
    by_polynomial = method != "nnls"
    degree = int(polynomial_degree) if by_polynomial else 0
    if by_polynomial and degree < 1:
        raise InputError(f"{degree}: at least 1 is needed", argument="polynomial_degree")
    columns, fewest = (reduced_time, modulus), FEWEST_BRANCHES if by_polynomial else 1
    task = FitTask(RELAXATION, columns, branches, relaxation_time, plateaus, keep, method, fewest)
    return schwarzl_staverman(task, degree) if by_polynomial else task.fit_moduli(past=1.0)


def fit_oscillation(
    reduced_angular_frequency: ArrayLike,
    storage_modulus: ArrayLike,
    loss_modulus: ArrayLike,
    *,
    branches: int | None = None,
    relaxation_time: TimeRange = (None, None),
    plateaus: Plateaus = Plateaus(),
    keep: int | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve of storage and loss modulus (Young's, Pa) over angular frequency (rad/s).

    All are of shape (n,), in any order. Non-negative moduli are fitted to the relative errors of both moduli together, with the
    smoothness that the data support (`dielast.relaxation.nnls`); the other arguments are as in `fit_spectrum`. The equilibrium
    modulus is fitted by default.

    Raises `InputError` for points or arguments that allow no fit; warns as `fit_spectrum` does, with the storage modulus at the
    lowest frequencies as the end of the curve.
    """
    columns = (reduced_angular_frequency, storage_modulus, loss_modulus)
    task = FitTask(OSCILLATION, columns, branches, relaxation_time, plateaus, keep)
    return task.fit_moduli(PAST_ENDS)


def schwarzl_staverman(task: FitTask, degree: int) -> SpectrumFit:
    """The spectrum from a polynomial of this `degree` through log modulus over log time; raises and warns as `fit_spectrum`."""
    curve, time = task.curve, task.curve.time
    # Eq. 16 reads the curve at t = 2 tau
    shortest, longest = task.range_of_times((time[0] / 2, time[-1] / 2), seen_at=(2, 2))
    tau = np.geomspace(longest, shortest, task.branches)  # Eq. 19: tau_k = tau_max (tau_min / tau_max)^((k - 1)/(N - 1))
    equilibrium = task.plateau.modulus if task.equilibrium is None else task.equilibrium
    polynomial = fit_polynomial(np.log10(time), np.log10(curve.size), degree, curve.weight)
    error = rms(10 ** polynomial(np.log10(time)) / curve.size - 1)
    if error > POOR_POLYNOMIAL:
        warn(
            f"the polynomial of degree {degree} misses the curve by {error:.1%} rms: try another polynomial_degree, "
            f'or method = "nnls"',
            mentions=("polynomial_degree", "method"),
        )
    with np.errstate(over="ignore", invalid="ignore"):
        cumulative = cumulative_spectrum(polynomial, equilibrium, tau)
    if not np.all(np.isfinite(cumulative)):
        raise InputError(
            f"relaxation times from {tau[-1]:.3g} to {tau[0]:.3g} s are so far off the curve that its polynomial exceeds all "
            f"numbers there: keep them between {time[0] / 2:.3g} and {time[-1] / 2:.3g} s, or lower polynomial_degree",
            mentions=("polynomial_degree",),
        )
    if task.glassy is None:  # if the curve falls from its first point on, faster processes contribute, and H is larger
        total = max(short_time_end(np.log10(time), curve.size).modulus - equilibrium, float(cumulative[-1]))
    else:
        total = task.glassy - equilibrium
    moduli = discrete_moduli(cumulative, total)
    task.warn_of_equilibrium(equilibrium)
    tau, moduli = tau[: task.keep], moduli[: task.keep]
    spectrum = Spectrum(tau, np.maximum(moduli, 0.0))
    clipped = _clipped(tau, moduli, task.branches, curve, spectrum.relaxation_modulus(time, equilibrium))
    return task.finish("schwarzl-staverman", spectrum, equilibrium, clipped_branches=clipped, polynomial_rms_relative_error=error)


def cumulative_spectrum(log10_modulus: Chebyshev, equilibrium_modulus: float, relaxation_time: Floats) -> Floats:
    """H(tau), the sum of the moduli (Pa) of all processes slower than `relaxation_time` (s), of the same shape.

    H = 10^f0 (1 - f0') - mu_eq at x = log10(2 tau), Eq. 16, with the polynomial f0(x), log10 G (Pa) over x = log10 t (s), and
    mu_eq in Pa (shear).
    """
    x = np.log10(2 * relaxation_time)
    f0, slope = log10_modulus(x), log10_modulus.deriv()(x)
    return np.asarray(10**f0 * (1 - slope) - equilibrium_modulus)


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


def discrete_moduli(cumulative: Floats, total: float) -> Floats:
    """Eq. 20: moduli in Pa from H at N relaxation times (N,), slowest first, and mu_neq = `total`, their sum.

    mu_1 = (H_1 + H_2)/2, mu_k = (H_{k+1} - H_{k-1})/2, mu_N = mu_neq - sum of the others. So the sum of the first k < N moduli is
    the mean of H_k and H_{k+1}: the staircase of the discrete spectrum follows H. A modulus may be negative.
    """
    slower = (cumulative[:-1] + cumulative[1:]) / 2
    return np.diff(np.concatenate([[0.0], slower, [total]]))


def _clipped(tau: Floats, moduli: Floats, branches: int, curve: WeightedCurve, model: Floats) -> int:
    """The number of negative moduli; `InputError` if setting them to 0 changes G(t) too much."""
    negative = moduli < -ROUNDING * float(model.max())
    if not negative.any():
        return 0
    count = int(negative.sum())
    change = np.exp(-curve.time[:, None] / tau[negative]) @ -moduli[negative] / model
    at = int(np.argmax(change))
    clipped = f"{count} of {tau.size} moduli came out negative (the slowest at a relaxation time of {tau[negative][0]:.3g} s)"
    effect = f"G({curve.time[at]:.3g} s) by {change[at]:.2%}"
    if change[at] > TOLERATED:
        last, first = negative[-1] and moduli.size == branches, negative[0]
        remedy = "a larger glassy_modulus, " if last else "a lower equilibrium_modulus, " if first else ""
        advice = f'try another polynomial_degree, narrower relaxation times, {remedy}or method = "nnls"'
        raise InputError(
            f"{clipped}, and setting them to zero would change {effect}: {what_rises(curve) or advice}",
            mentions=("polynomial_degree", "method", "glassy_modulus", "equilibrium_modulus"),
        )
    warn(f"{clipped} and were set to zero, which changes {effect}")
    return count
