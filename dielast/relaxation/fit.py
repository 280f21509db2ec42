"""From a master curve to the discrete relaxation spectrum of a generalised Maxwell solid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, warn
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.spectrum import Spectrum
from dielast.relaxation import schwarzl_staverman as ss
from dielast.relaxation.checks import (
    TOLERATED,
    Ends,
    check_counts,
    check_ends,
    check_moduli,
    judge_equilibrium,
    judge_fit,
    of_liquid,
    range_of_times,
    rms,
    share_kept,
    sorted_points,
)
from dielast.relaxation.ends import extremes, long_time_end, short_time_end, votes
from dielast.relaxation.interconversion import RetardationSpectrum
from dielast.relaxation.nnls import Curve, Known, Total, fit_strengths, place_times

Array = NDArray[np.float64]
Method = Literal["schwarzl-staverman", "nnls"]
Test = Literal["relaxation", "oscillation", "creep"]

_ROUNDING = 1e-12  # of the largest modulus: what is less negative is zero
_POOR_POLYNOMIAL = 0.05  # relative rms


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpectrumFit(TabularResult):
    """A fitted relaxation spectrum and how well it gives the curve of its `test` back.

    `spectrum` and `equilibrium_shear_modulus` (Pa) are shear; `reduced_time` (s) is (n,), ascending, and `measured` and `model` are
    Young's moduli of relaxation (n,), storage and loss (2, n) in Pa, or tensile creep compliances (n,) in 1/Pa. An oscillation's
    reduced time is one over its angular frequency. The errors are those of model/measured - 1 over all points, each counting once;
    where only the slowest branches are kept, over the points from the shortest relaxation time kept onwards, which is what they
    are meant for.

    `clipped_branches` counts the processes whose modulus came out negative and was set to zero. `polynomial_rms_relative_error`
    belongs to schwarzl-staverman, `smoothing` to nnls, and `retardation` to creep, which is fitted by a retardation spectrum first;
    None otherwise.
    """

    method: Method
    spectrum: Spectrum
    equilibrium_shear_modulus: float
    rms_relative_error: float
    max_relative_error: float
    reduced_time: Array
    measured: Array
    model: Array
    clipped_branches: int = 0
    polynomial_rms_relative_error: float | None = None
    smoothing: float | None = None
    test: Test = "relaxation"
    retardation: RetardationSpectrum | None = None

    def columns(self) -> Table:
        """The curve beside the model."""
        if self.test == "oscillation":
            ascending = slice(None, None, -1)
            return [
                Column("reduced_angular_frequency", "rad/s", 1 / self.reduced_time[ascending]),
                Column("measured_storage", "Pa", self.measured[0, ascending]),
                Column("model_storage", "Pa", self.model[0, ascending]),
                Column("measured_loss", "Pa", self.measured[1, ascending]),
                Column("model_loss", "Pa", self.model[1, ascending]),
            ]
        unit = "1/Pa" if self.test == "creep" else "Pa"
        return [
            Column("reduced_time", "s", self.reduced_time),
            Column("measured", unit, self.measured),
            Column("model", unit, self.model),
        ]

    @property
    def branches(self) -> int:
        """Number of processes in the spectrum."""
        return len(self.spectrum)


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
    liquid: bool = False,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve: `modulus` (Young's, Pa) over `reduced_time` (s), both (n,), in any order.

    "schwarzl-staverman" (Eqs. 14-20 of DOI 10.1115/1.4030850) reads the spectrum off a polynomial through log G over log t; "nnls"
    fits non-negative moduli to the relative error. The material is incompressible: shear modulus = Young's / 3. Points that crowd
    together in log time share their weight.

    `relaxation_time` holds the shortest and the longest in s; left out, schwarzl-staverman takes the range in which t = 2 tau stays
    on the curve, and nnls places the end inside the curve where it fits best. `equilibrium_modulus` (Young's, Pa; 0 for a melt) is
    by default read from the end of the curve, or fitted by nnls. `glassy_modulus` (Young's, Pa), that at the shortest times,
    is three times the sum of all moduli, the equilibrium one too, so that mu_neq of Eq. 20 is the rest; by default
    schwarzl-staverman takes the curve's largest modulus, smoothed, or H at the shortest relaxation time beside the equilibrium
    modulus if that is more, and nnls leaves it free. `keep` truncates to the slowest branches (Sec. 3.4). A
    `liquid` has no equilibrium modulus, and no plateau is asked of it.

    Raises `InputError` for points or arguments that allow no fit, and where a modulus is negative by more than 2 % of G(t);
    warns of smaller ones (they are set to zero), of extrapolation, of an end that is no plateau, of a plateau far above the given
    equilibrium modulus and of a poor fit.
    """
    time, measured = sorted_points(("reduced time", "s", reduced_time), ("modulus", "Pa", modulus))
    equilibrium_modulus = of_liquid(liquid, equilibrium_modulus)
    _check_arguments(method, branches, polynomial_degree, keep)
    check_ends(relaxation_time)
    curve = Curve(time, measured[None] / 3, votes(np.log10(time)))
    plateau = long_time_end(np.log10(time), curve.size)
    check_moduli(equilibrium_modulus, glassy_modulus, *extremes(np.log10(time), 3 * curve.size))
    known = None if equilibrium_modulus is None else equilibrium_modulus / 3

    polynomial_error = smoothing = None
    if method == "nnls":
        tau = placed_times(curve, branches, relaxation_time, (known,), kept=share_kept(branches, keep))
        solution = fit_strengths(curve, tau, (known,), None if glassy_modulus is None else Total(glassy_modulus / 3, (1.0,)))
        moduli, equilibrium, smoothing = solution.strength, float(solution.constants[0]), solution.smoothing
    else:
        own, kept = (time[0] / 2, time[-1] / 2), share_kept(branches, keep)
        shortest, longest = range_of_times(relaxation_time, own, time, seen_at=(2, 2), kept=kept)
        tau = ss.relaxation_times(longest, shortest, branches)
        equilibrium = plateau.modulus if known is None else known
        polynomial = ss.fit_polynomial(np.log10(time), np.log10(curve.size), polynomial_degree, curve.weight)
        polynomial_error = _judge_polynomial(polynomial, curve)
        cumulative = _cumulative(polynomial, equilibrium, tau, time)
        total = _nonequilibrium(curve, equilibrium, cumulative) if glassy_modulus is None else glassy_modulus / 3 - equilibrium
        moduli = ss.discrete_moduli(cumulative, total)
    if not liquid:
        judge_equilibrium(known, equilibrium, plateau)

    truncated = keep is not None and keep < branches
    tau, moduli = tau[:keep], moduli[:keep]
    spectrum = Spectrum(tau, np.maximum(moduli, 0.0))
    model = spectrum.relaxation_modulus(time, equilibrium)
    clipped = _judge_clipping(tau, moduli, branches, time, model)
    mean, worst = judge_fit(model / curve.values - 1, time, tau[-1] if truncated else None)
    return SpectrumFit(
        method=method,
        spectrum=spectrum,
        equilibrium_shear_modulus=equilibrium,
        rms_relative_error=mean,
        max_relative_error=worst,
        reduced_time=time,
        measured=measured,
        model=3 * model,
        clipped_branches=clipped,
        polynomial_rms_relative_error=polynomial_error,
        smoothing=smoothing,
    )


def placed_times(curve: Curve, branches: int, wanted: Ends, known: Known, past: float = 1.0, kept: float = 1.0) -> Array:
    """Times of the processes for nnls in s, slowest first, by default up to so many times `past` the curve's own ends; `kept` as in
    `range_of_times`."""
    # A process still shows a decade away from its own time, hardly farther.
    own = curve.time[0] / past, curve.time[-1] * past
    shortest, longest = range_of_times(wanted, own, curve.time, seen_at=(10, 0.1), kept=kept)
    return place_times(curve, branches, shortest, longest, (wanted[0] is None, wanted[1] is None), known)


def _check_arguments(method: str, branches: int, degree: int, keep: int | None) -> None:
    if method not in get_args(Method):
        raise InputError(f'"{method}": "schwarzl-staverman" or "nnls" is needed', argument="method")
    if method != "nnls" and degree < 1:
        raise InputError(f"{degree}: at least 1 is needed", argument="polynomial_degree")
    check_counts(method, branches, 1 if method == "nnls" else 3, keep)


def _nonequilibrium(curve: Curve, equilibrium: float, cumulative: Array) -> float:
    """mu_neq from the curve. Where it falls from its first point on, faster processes than that are in it: then H is more."""
    largest = short_time_end(np.log10(curve.time), curve.size).modulus
    return max(largest - equilibrium, float(cumulative[-1]))


def _cumulative(polynomial: Chebyshev, equilibrium: float, tau: Array, time: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        cumulative = ss.CumulativeSpectrum(polynomial, equilibrium)(tau)
    if not np.all(np.isfinite(cumulative)):
        raise InputError(
            f"relaxation times from {tau[-1]:.3g} to {tau[0]:.3g} s are so far off the curve that its polynomial exceeds all "
            f"numbers there: keep them between {time[0] / 2:.3g} and {time[-1] / 2:.3g} s, or lower polynomial_degree",
            mentions=("polynomial_degree",),
        )
    return cumulative


def _judge_polynomial(polynomial: Chebyshev, curve: Curve) -> float:
    error = rms(10 ** polynomial(np.log10(curve.time)) / curve.size - 1)
    if error > _POOR_POLYNOMIAL:
        warn(
            f"the polynomial of degree {polynomial.degree()} misses the curve by {error:.1%} rms: try another polynomial_degree, "
            f'or method = "nnls"',
            mentions=("polynomial_degree", "method"),
        )
    return error


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
    if change[at] > TOLERATED:
        last, first = negative[-1] and moduli.size == branches, negative[0]
        remedy = "a larger glassy_modulus, " if last else "a lower equilibrium_modulus, " if first else ""
        raise InputError(
            f"{found}, and setting them to zero would change {effect}: try another polynomial_degree, narrower relaxation times, "
            f'{remedy}or method = "nnls"',
            mentions=("polynomial_degree", "method", "glassy_modulus", "equilibrium_modulus"),
        )
    warn(f"{found} and were set to zero, which changes {effect}")
    return count
