"""From a master curve to the discrete relaxation spectrum of a generalised Maxwell solid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray

from dielast.characterise import schwarzl_staverman as ss
from dielast.characterise.curve import long_time_end, short_time_end, votes
from dielast.characterise.nnls import Curve, fit_moduli, place_relaxation_times
from dielast.errors import InputError, warn
from dielast.prony import Spectrum

Array = NDArray[np.float64]
Method = Literal["schwarzl-staverman", "nnls"]
Ends = tuple[float | None, float | None]

_TOLERATED = 0.02  # of G(t): what clipping negative moduli may change; and the equilibrium modulus above the curve without a word
_ABOVE = 0.1  # of the curve's smoothed end: an equilibrium modulus that lies higher is refused
_BELOW = (
    0.1  # of the end of a curve that has levelled off, continued by _MORE_DECADES: an equilibrium modulus farther below is doubted
)
_MORE_DECADES = 2.0
_THIRD = (2.5, 3.5)  # ratio of the two that looks like Young's against shear
_ROUNDING = 1e-12  # of the largest modulus: what is less negative is zero
_LEVEL_SLOPE = 0.045  # decades of modulus per decade of time, about 10 %: a flatter end is a plateau
_POOR_POLYNOMIAL = 0.05  # relative rms
_POOR_FIT = 0.10  # relative rms
_NEXT_TO = 10**0.1  # a tenth of a decade: that close to its end, a curve still tells


@dataclass(frozen=True, slots=True, eq=False)
class SpectrumFit:
    """A fitted relaxation spectrum and how well it gives the curve back.

    `spectrum` and `equilibrium_shear_modulus` (Pa) are shear; `reduced_time` (s), `measured` and `model` (Young's, Pa), all of
    shape (n,), are sorted by time. The errors are those of model/measured - 1 over all points, each counting once; where only the
    slowest branches are kept, over the points from the shortest relaxation time kept onwards, which is what they are meant for.

    `branches` counts the processes in `spectrum`, `clipped_branches` those of them whose modulus came out negative and was set to
    zero. `polynomial_rms_relative_error` belongs to schwarzl-staverman and `smoothing` to nnls; None otherwise.
    """

    method: Method
    spectrum: Spectrum
    equilibrium_shear_modulus: float
    branches: int
    clipped_branches: int
    rms_relative_error: float
    max_relative_error: float
    reduced_time: Array
    measured: Array
    model: Array
    polynomial_rms_relative_error: float | None = None
    smoothing: float | None = None


def fit_spectrum(
    reduced_time: ArrayLike,
    modulus: ArrayLike,
    *,
    method: Method = "schwarzl-staverman",
    branches: int = 30,
    polynomial_degree: int = 7,
    relaxation_time: Ends = (None, None),
    equilibrium_modulus: float | None = None,
    glassy_modulus: float | None = None,
    keep: int | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve: `modulus` (Young's, Pa) over `reduced_time` (s), both (n,), in any order.

    "schwarzl-staverman" (Eqs. 14-20 of DOI 10.1115/1.4030850) reads the spectrum off a polynomial through log G over log t; "nnls"
    fits non-negative moduli to the relative error. The material is incompressible: shear modulus = Young's / 3. Points that crowd
    together in log time share their weight.

    `relaxation_time` holds the shortest and the longest in s; left out, schwarzl-staverman takes the range in which t = 2 tau stays
    on the curve, and nnls places the end inside the curve where it fits best. `equilibrium_modulus` (Young's, Pa; 0 for a melt) is
    by default read from the end of the curve, or fitted by nnls. `glassy_modulus` (Young's, Pa) is three times mu_neq, the sum of
    all moduli (Eq. 20); by default schwarzl-staverman takes the curve's largest modulus, smoothed, less the equilibrium modulus, or
    H at the shortest relaxation time if that is more, and nnls leaves it free. `keep` truncates to the slowest branches (Sec. 3.4).

    Raises `InputError` for points or arguments that allow no fit, and where a modulus is negative by more than 2 % of G(t);
    warns of smaller ones (they are set to zero), of extrapolation, of an end that is no plateau, of a plateau far above the given
    equilibrium modulus and of a poor fit.
    """
    time, measured = _sorted_curve(reduced_time, modulus)
    _check_arguments(method, branches, polynomial_degree, relaxation_time, keep)
    curve = Curve(time, measured / 3, votes(np.log10(time)))
    plateau = long_time_end(np.log10(time), curve.modulus)
    _check_moduli(equilibrium_modulus, glassy_modulus, 3 * plateau.modulus)
    known = None if equilibrium_modulus is None else equilibrium_modulus / 3
    total = None if glassy_modulus is None else glassy_modulus / 3

    polynomial_error = smoothing = None
    if method == "nnls":
        tau = _placed_times(curve, branches, relaxation_time, known)
        solution = fit_moduli(curve, tau, known, total)
        moduli, equilibrium, smoothing = solution.shear_modulus, solution.equilibrium_modulus, solution.smoothing
    else:
        tau = _times_on_the_curve(time, branches, relaxation_time)
        equilibrium = plateau.modulus if known is None else known
        polynomial = ss.fit_polynomial(np.log10(time), np.log10(curve.modulus), polynomial_degree, curve.weight)
        polynomial_error = _judge_polynomial(polynomial, curve)
        cumulative = _cumulative(polynomial, equilibrium, tau, time)
        moduli = ss.discrete_moduli(cumulative, _glassy_total(curve, equilibrium, cumulative) if total is None else total)
    if known is None:
        _warn_unless_level(plateau.slope, equilibrium)
    elif -plateau.slope <= _LEVEL_SLOPE:
        _warn_if_below(3 * known, 3 * plateau.modulus, plateau.slope)

    truncated = keep is not None and keep < branches
    tau, moduli = tau[:keep], moduli[:keep]
    spectrum = Spectrum(tau, np.maximum(moduli, 0.0))
    model = spectrum.relaxation_modulus(time, equilibrium)
    clipped = _judge_clipping(tau, moduli, branches, time, model)
    rms, worst = _judge_fit((model / curve.modulus - 1)[time >= (tau[-1] if truncated else 0.0)], tau[-1])
    return SpectrumFit(
        method=method,
        spectrum=spectrum,
        equilibrium_shear_modulus=equilibrium,
        branches=len(spectrum),
        clipped_branches=clipped,
        rms_relative_error=rms,
        max_relative_error=worst,
        reduced_time=time,
        measured=measured,
        model=3 * model,
        polynomial_rms_relative_error=polynomial_error,
        smoothing=smoothing,
    )


def _sorted_curve(reduced_time: ArrayLike, modulus: ArrayLike) -> tuple[Array, Array]:
    time, measured = np.asarray(reduced_time, dtype=float), np.asarray(modulus, dtype=float)
    if time.ndim != 1 or time.shape != measured.shape:
        raise InputError(f"reduced times {time.shape} and moduli {measured.shape}: two lists of the same length are needed")
    for name, unit, values in (("reduced time", "s", time), ("modulus", "Pa", measured)):
        bad = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
        if bad.size:
            more = f" (and {bad.size - 1} more)" if bad.size > 1 else ""
            raise InputError(f"{name}[{bad[0]}] = {values[bad[0]]:g} {unit}{more}: a positive, finite number is needed")
    if np.unique(time).size < 2:
        raise InputError(f"a curve of {time.size} point(s) at a single time: at least two different times are needed")
    order = np.lexsort((measured, time))
    return time[order], measured[order]


def _check_arguments(method: str, branches: int, degree: int, relaxation_time: Ends, keep: int | None) -> None:
    if method not in get_args(Method):
        raise InputError(f'method "{method}": "schwarzl-staverman" or "nnls" is needed')
    fewest = 1 if method == "nnls" else 3
    if branches < fewest:
        raise InputError(f"branches = {branches}: {method} needs at least {fewest}")
    if method != "nnls" and degree < 1:
        raise InputError(f"polynomial_degree = {degree}: at least 1 is needed")
    for name, end in zip(("min", "max"), relaxation_time, strict=True):
        if end is not None and not 0 < end < np.inf:
            raise InputError(f"relaxation_time {name} = {end:g} s: a positive, finite time is needed")
    shortest, longest = relaxation_time
    if shortest is not None and longest is not None and shortest >= longest:
        raise InputError(f"relaxation_time min = {shortest:g} s must be shorter than max = {longest:g} s")
    if keep is not None and not 1 <= keep <= branches:
        raise InputError(f"cannot keep {keep} of {branches} branches")


def _check_moduli(equilibrium: float | None, glassy: float | None, smallest: float) -> None:
    if equilibrium is not None and not 0 <= equilibrium < np.inf:
        raise InputError(f"equilibrium_modulus = {equilibrium:g} Pa: it must be finite and not negative (0 is a melt)")
    if glassy is not None and not 0 < glassy < np.inf:
        raise InputError(f"glassy_modulus = {glassy:g} Pa: it must be finite and positive")
    if equilibrium is not None and glassy is not None and equilibrium >= glassy:
        raise InputError(f"equilibrium_modulus = {equilibrium:g} Pa must be smaller than glassy_modulus = {glassy:g} Pa")
    excess = 0.0 if equilibrium is None else equilibrium / smallest - 1
    if excess > _ABOVE:
        raise InputError(f"equilibrium_modulus = {equilibrium:g} Pa is above the end of the curve, {smallest:.4g} Pa: lower it")
    if excess > _TOLERATED:
        warn(f"equilibrium_modulus = {equilibrium:g} Pa is {excess:.1%} above the end of the curve, {smallest:.4g} Pa")


def _range(wanted: Ends, default: tuple[float, float]) -> tuple[float, float]:
    """Shortest and longest relaxation time in s."""
    shortest, longest = (float(own if end is None else end) for end, own in zip(wanted, default, strict=True))
    if shortest >= longest:
        raise InputError(f"no relaxation time lies between min = {shortest:.3g} s and max = {longest:.3g} s: state both")
    return shortest, longest


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _placed_times(curve: Curve, branches: int, wanted: Ends, equilibrium: float | None) -> Array:
    """Relaxation times for nnls, slowest first."""
    shortest, longest = _range(wanted, (curve.time[0], curve.time[-1]))
    # A process still shows a decade away from its relaxation time, hardly farther.
    _warn_of_extrapolation(shortest, longest, curve.time, seen_at=(10, 0.1))
    return place_relaxation_times(curve, branches, shortest, longest, (wanted[0] is None, wanted[1] is None), equilibrium)


def _times_on_the_curve(time: Array, branches: int, wanted: Ends) -> Array:
    """Relaxation times for schwarzl-staverman, slowest first."""
    shortest, longest = _range(wanted, (time[0] / 2, time[-1] / 2))
    _warn_of_extrapolation(shortest, longest, time, seen_at=(2, 2))
    return ss.relaxation_times(longest, shortest, branches)


def _glassy_total(curve: Curve, equilibrium: float, cumulative: Array) -> float:
    """mu_neq from the curve. Where it falls from its first point on, faster processes than that are in it: then H is more."""
    largest = short_time_end(np.log10(curve.time), curve.modulus).modulus
    return max(largest - equilibrium, float(cumulative[-1]))


def _cumulative(polynomial: Chebyshev, equilibrium: float, tau: Array, time: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        cumulative = ss.CumulativeSpectrum(polynomial, equilibrium)(tau)
    if not np.all(np.isfinite(cumulative)):
        raise InputError(
            f"relaxation times from {tau[-1]:.3g} to {tau[0]:.3g} s are so far off the curve that its polynomial exceeds all "
            f"numbers there: keep them between {time[0] / 2:.3g} and {time[-1] / 2:.3g} s"
        )
    return cumulative


def _judge_polynomial(polynomial: Chebyshev, curve: Curve) -> float:
    error = _rms(10 ** polynomial(np.log10(curve.time)) / curve.modulus - 1)
    if error > _POOR_POLYNOMIAL:
        warn(
            f"the polynomial of degree {polynomial.degree()} misses the curve by {error:.1%} rms: try another polynomial_degree, "
            f'or method = "nnls"'
        )
    return error


def _warn_of_extrapolation(shortest: float, longest: float, time: Array, seen_at: tuple[float, float]) -> None:
    """Warn where the times at which the ends of the spectrum are seen, in units of their own, are off the curve."""
    if seen_at[0] * shortest < time[0] / _NEXT_TO or seen_at[1] * longest > time[-1] * _NEXT_TO:
        warn(
            f"relaxation times from {shortest:.3g} to {longest:.3g} s reach farther than the curve, from {time[0]:.3g} to "
            f"{time[-1]:.3g} s, can tell: the spectrum is extrapolated"
        )


def _warn_unless_level(slope: float, equilibrium: float) -> None:
    if -slope > _LEVEL_SLOPE:
        warn(
            f"the curve has not levelled off: it falls by {1 - 10**slope:.0%} in its last decade, so that the equilibrium modulus "
            f"of {3 * equilibrium:.3g} Pa (Young's) is a guess: state equilibrium_modulus (0 for a melt)"
        )


def _warn_if_below(equilibrium: float, level: float, slope: float) -> None:
    """A curve that has levelled off shows its equilibrium modulus (both Young's, Pa), but for some decades of its last slope."""
    if equilibrium >= (1 - _BELOW) * level * 10 ** (_MORE_DECADES * slope):
        return
    third = ""
    if equilibrium > 0 and _THIRD[0] < level / equilibrium < _THIRD[1]:
        third = ", a third of that: it is Young's modulus that is meant, three times the shear modulus"
    warn(f"the curve has levelled off at {level:.4g} Pa, far above equilibrium_modulus = {equilibrium:g} Pa{third}")


def _judge_clipping(tau: Array, moduli: Array, branches: int, time: Array, model: Array) -> int:
    """Number of negative moduli; refuses where setting them to zero changes G(t) too much."""
    negative = moduli < -_ROUNDING * float(model.max())
    if not negative.any():
        return 0
    count = int(negative.sum())
    change = np.exp(-time[:, None] / tau[negative]) @ -moduli[negative] / model
    at = int(np.argmax(change))
    found = f"{count} of {tau.size} moduli came out negative (the slowest at a relaxation time of {tau[negative][0]:.3g} s)"
    effect = f"G({time[at]:.3g} s) by {change[at]:.2%}"
    if change[at] > _TOLERATED:
        last, first = negative[-1] and moduli.size == branches, negative[0]
        remedy = "a larger glassy_modulus, " if last else "a lower equilibrium_modulus, " if first else ""
        raise InputError(
            f"{found}, and setting them to zero would change {effect}: try another polynomial_degree, narrower relaxation times, "
            f'{remedy}or method = "nnls"'
        )
    warn(f"{found} and were set to zero, which changes {effect}")
    return count


def _judge_fit(error: Array, shortest: float) -> tuple[float, float]:
    """Rms and greatest magnitude of the relative errors."""
    if error.size == 0:
        raise InputError(f"the curve ends before {shortest:.3g} s, the shortest relaxation time kept: keep more branches")
    rms, worst = _rms(error), float(np.max(np.abs(error)))
    if rms > _POOR_FIT:
        warn(f"the spectrum misses the curve by {rms:.1%} rms and {worst:.1%} at worst: try more branches or another method")
    return rms, worst
