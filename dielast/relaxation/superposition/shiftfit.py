"""Fit a shift law to shift factors that come with a covariance.

No material follows a law exactly: where two processes with different laws take turns, the slope of log10 a changes over some of its
range, and the constants of the law change with it by far more than the shift factors miss the law. The misfit is therefore a random
effect: the slope of log10 a differs from that of the law by a relative error that is smooth over log10 a. The distribution of its
spread is that of the restricted likelihood (H. D. Patterson and R. Thompson, Biometrika 58 (1971) 545) and of a prior. The misfit
enters as a covariance of the shift factors, in addition to their own.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError, warn, without_warnings
from dielast.material.shift import SHIFTS, ShiftLaw
from dielast.material.shift.law import FittedLaw, MovedLaw
from dielast.numerics.arrays import Floats, rms

NEGLIGIBLE = 1e-3  # decades
# Relative errors of the slope of a law that misses, a choice: smaller ones do not show, and with larger ones there is no law.
SPREADS = np.geomspace(0.003, 0.3, 16)
# Prior probability that the law misses, in a spread that is even in the logarithm. A choice: one law in ten. A larger one widens
# the errors of a law that fits, a smaller one makes them too narrow where the law misses by less than shows.
PROBABLE = 0.1
WIDTHS = 400  # number of widths among which that of the level is sought
LEVEL = 0.9  # level of the intervals that a single spread reproduces


@dataclass(frozen=True, slots=True, eq=False)
class ShiftFit:
    """A shift law, its parameters by name (SI units) and their covariance (p, p); a table has none.

    `misfit` is the reduced chi-square of the law against the shift factors: the squared distance between the two in standard errors
    of the shift factors, per degree of freedom. It is about 1 if the law fits, far above 1 if it does not, and 0 for a table and if
    there are no more temperatures than parameters. `spread` is the standard deviation of the relative error of the law's slope over
    temperature. The covariance includes it, and is multiplied by the misfit that is left beside it, if that is above 1. `doubt`
    (p, p) is the part of the covariance that is due to both, relative to the product of the parameters.

    `origin` is log10 a at the reference temperature relative to the temperature about which the law was fitted. It is the value of
    the law plus the distance of the shift factors from the law, interpolated between the neighbouring temperatures; at a measured
    temperature it is therefore the measured value. `origin_weight` (m,) is its derivative with respect to the shift factors, and
    `origin_excess` the additional variance due to the misfit and to an assumed C2.

    `about` is the law about a temperature in degC, and `moments` the covariance of the fitted parameters; None for a table.
    """

    law: ShiftLaw
    names: tuple[str, ...]
    values: Floats
    covariance: Floats
    misfit: float
    origin: float
    origin_weight: Floats
    origin_excess: float
    about: Callable[[float], MovedLaw] | None = None
    moments: Floats | None = None
    spread: float = 0.0
    doubt: Floats | None = None

    def stderr_between(self, temperature: float, other: float) -> float:
        """Standard error of the difference of the law's log10 a between two temperatures (degC): 0 for a table, infinite beyond a
        pole of the law, or of another law that the data allow.
        """
        if self.about is None or self.moments is None:
            return 0.0
        try:
            here, there = self.about(temperature), self.about(other)
        except InputError:
            return np.inf
        step = here.to_origin - there.to_origin
        doubt = _spread(here.others - here.origin - (there.others - there.origin))
        return float(np.hypot(np.sqrt(step @ self.moments @ step), doubt))

    def doubted(self, values: Floats, random: np.random.Generator) -> Floats:
        """The parameters `values` (p,) of a draw of the shift factors, with a draw of the misfit of the law; the signs remain."""
        if self.doubt is None:
            return values
        return np.asarray(values * np.exp(random.multivariate_normal(np.zeros(values.size), self.doubt, method="eigh")))

    @property
    def parameters(self) -> dict[str, float]:
        """Values by name, in the units of the law's constants: C1 and C2 (K), or activation_energy (J/mol)."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def stderr(self) -> dict[str, float]:
        """Standard errors by name; infinite if the data do not determine the parameter."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))


def fit_shift_law(
    law: str,
    temperature: Floats,
    log10_shift_factor: Floats,
    covariance: Floats,
    anchor: int,
    reference_temperature: float,
    superposed: bool = True,
) -> ShiftFit:
    """Fit `law` to log10 a (m,) at `temperature` (m,) in degC, ascending, by generalised least squares with the covariance (m, m).

    The shift factors are relative to the temperature numbered `anchor`, where log10 a and its covariance are zero; the law is then
    referred to `reference_temperature`, which need not have been measured. If the data cannot separate C1 from C2, this warns, and
    uses C2 = T_ref in kelvin, with which WLF is Arrhenius' law. The variance of the origin then allows for every C2 that agrees
    with the data and puts the pole of the law at least 50 K below the coldest temperature.
    """
    m, base = temperature.size, float(temperature[anchor])
    kind = SHIFTS[law]
    if exact := kind.through(temperature, log10_shift_factor, reference_temperature):
        table, weight = exact
        return ShiftFit(table, (), np.zeros(0), np.zeros((0, 0)), 0.0, float(weight @ log10_shift_factor), weight, 0.0)
    others = np.arange(m) != anchor
    fitted = _fit_about(law, temperature, log10_shift_factor, covariance, anchor)
    distance, relative, measured = (temperature - base)[others], log10_shift_factor[others], covariance[np.ix_(others, others)]
    of_slope = _of_slope(fitted, distance)
    spread, scale = _likely_spread(fitted, distance, relative, measured, of_slope, PROBABLE if superposed else 1.0)

    def about(temperature: float) -> MovedLaw:
        return fitted.about(temperature - base)

    moved = about(reference_temperature)
    near = np.array([np.interp(reference_temperature, temperature, row) for row in np.eye(m)])
    neighbours = [(near[k], about(float(temperature[k])), k) for k in np.flatnonzero(near)]
    off = np.array([log10_shift_factor[k] - neighbour.origin for _, neighbour, k in neighbours])
    shares = np.array([share for share, _, _ in neighbours])
    # the difference of the law between the neighbours and the reference temperature
    step = moved.to_origin - sum(share * neighbour.to_origin for share, neighbour, _ in neighbours)
    weight = near.copy()
    weight[others] += step @ fitted.response
    nearby = sum(share * (neighbour.others - neighbour.origin) for share, neighbour, _ in neighbours)
    doubt = _spread(moved.others - moved.origin - nearby)
    moments = scale * fitted.response @ (measured + spread**2 * of_slope) @ fitted.response.T
    doubted = moments - fitted.response @ measured @ fitted.response.T  # by the misfit of the law, not by the shift factors
    constants = np.array(list(moved.law.drawn().values()))
    product = np.outer(constants, constants)
    values, doubtful = (moved.to_constants @ part @ moved.to_constants.T for part in (moments, doubted))
    if fitted.assumed:
        far = reference_temperature not in temperature and doubt > NEGLIGIBLE
        known = f"is known to +- {doubt:.2g} only" if np.isfinite(doubt) else "is not known at all"
        warn(fitted.assumed + (f"; log10 a at {reference_temperature:g} degC {known}, for want of C2" if far else ""))
    return ShiftFit(
        moved.law,
        tuple(constant.name for constant in kind.constants),
        constants,
        np.full(values.shape, np.inf) if fitted.assumed else values,
        fitted.misfit,
        moved.origin + float(shares @ off),
        weight,
        max(float(step @ doubted @ step), 0.0) + float(shares @ (off - shares @ off) ** 2) * (1 - 1 / scale) + doubt**2,
        about,
        moments,
        spread,
        doubtful / np.where(product == 0, 1.0, product),  # constants of 0 have no doubt: there is no shift at all
    )


def misfit_without(law: str, temperature: Floats, log10_shift_factor: Floats, covariance: Floats, anchor: int) -> Floats:
    """The `misfit` (m,) of `law` when it is fitted to all temperatures but one; arguments as for `fit_shift_law`."""
    misfit = np.zeros(temperature.size)
    for omitted in range(temperature.size):
        kept = np.arange(temperature.size) != omitted
        # where the anchor itself is omitted, all others are relative to a neighbour
        base = anchor if omitted != anchor else anchor - 1 if anchor else 1
        move = np.eye(temperature.size)
        move[:, base] -= 1
        relative, moved = move @ log10_shift_factor, move @ covariance @ move.T
        with without_warnings():  # the fit to all temperatures gives its warnings
            fitted = _fit_about(law, temperature[kept], relative[kept], moved[np.ix_(kept, kept)], int(np.sum(kept[:base])))
        misfit[omitted] = fitted.misfit
    return misfit


def _fit_about(law: str, temperature: Floats, log10_shift_factor: Floats, covariance: Floats, anchor: int) -> FittedLaw:
    """`law` fitted about the temperature numbered `anchor`, by generalised least squares."""
    others, base = np.arange(temperature.size) != anchor, float(temperature[anchor])
    measured = covariance[np.ix_(others, others)]
    whiten = np.linalg.inv(np.linalg.cholesky(measured + 1e-14 * np.mean(np.diag(measured)) * np.eye(temperature.size - 1)))
    return SHIFTS[law].fit(base, temperature[others] - base, log10_shift_factor[others], whiten)


def _of_slope(fitted: FittedLaw, distance: Floats) -> Floats:
    """Covariance (k, k) of log10 a at the `distance` (k,) from the base, if the relative error of the slope has a spread of 1.

    The error is a Matern process of order 3/2 over log10 a (C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine
    Learning, 2006, Eq. 4.17), with the range of log10 a as its length.
    """
    at = np.sort(np.append(distance, 0.0))
    decades = np.array([fitted.about(float(move)).origin for move in at])
    step, middle = np.diff(decades), (decades[1:] + decades[:-1]) / 2
    apart = np.sqrt(3) * np.abs(middle[:, None] - middle) / max(float(np.ptp(decades)), NEGLIGIBLE)
    summed = np.tri(at.size, step.size, -1) * step
    summed = np.delete(summed - summed[base := int(np.searchsorted(at, 0.0))], base, axis=0)
    return np.asarray(summed @ ((1 + apart) * np.exp(-apart)) @ summed.T)


def _likely_spread(
    fitted: FittedLaw, distance: Floats, log10_shift: Floats, measured: Floats, of_slope: Floats, probable: float
) -> tuple[float, float]:
    """The spread of the relative error of the slope with which intervals are as wide as over its distribution, and the factor on
    the covariance that is left then.

    `log10_shift` (k,) at `distance` (k,) has the covariance `measured` (k, k). Errors of the shift factors that are larger than
    stated multiply all covariances, if this is likelier than a spread.
    """
    from scipy.special import ndtr, ndtri  # slow to load

    laws = [fitted.about(float(move)) for move in distance]
    miss = log10_shift - np.array([law.origin for law in laws])
    slopes = np.array([law.to_origin for law in laws])[:, np.diag(fitted.moments) > 0]
    k, p = slopes.shape
    spreads = np.append(0.0, SPREADS)
    precision = np.linalg.inv(measured + spreads[:, None, None] ** 2 * of_slope)
    normal = slopes.T @ precision @ slopes
    pulled = precision @ miss
    right = pulled @ slopes
    square = pulled @ miss - np.einsum("sp,sp->s", right, np.linalg.solve(normal, right[..., None])[..., 0])
    scale = np.maximum(square / max(k - p, 1), 1.0)
    cost = np.linalg.slogdet(normal)[1] - np.linalg.slogdet(precision)[1] + (k - p) * np.log(scale) + square / scale
    probability = np.exp((np.min(cost) - cost) / 2) * np.append(1 - probable, np.full(SPREADS.size, probable / SPREADS.size))
    # how much wider the least certain combination of the parameters gets
    response = fitted.response[np.diag(fitted.moments) > 0]
    moments = response @ (measured + spreads[:, None, None] ** 2 * of_slope) @ response.T * scale[:, None, None]
    root = np.linalg.inv(np.linalg.cholesky(moments[0]))
    width = np.sqrt(np.maximum.accumulate(np.linalg.eigvalsh(root @ moments @ root.T)[:, -1]))
    tried = np.geomspace(1.0, width[-1], WIDTHS)
    inside = (2 * ndtr(ndtri((1 + LEVEL) / 2) * tried[:, None] / width) - 1) @ probability / np.sum(probability)
    square = np.interp(LEVEL, inside, tried) ** 2  # between two spreads, it is linear in their squares
    return float(np.sqrt(np.interp(square, width**2, spreads**2))), float(np.interp(square, width**2, scale))


def _spread(differences: Floats) -> float:
    """Root mean square; infinite if a difference is unknown."""
    if not differences.size:
        return 0.0
    return rms(differences) if np.all(np.isfinite(differences)) else np.inf
