"""Fit a shift law to shift factors that come with a covariance."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dielast.errors import InputError, warn, without_warnings
from dielast.material.shift import SHIFTS, ShiftLaw
from dielast.material.shift.law import FittedLaw, MovedLaw
from dielast.numerics.arrays import Floats, rms

NEGLIGIBLE = 1e-3  # decades


@dataclass(frozen=True, slots=True, eq=False)
class ShiftFit:
    """A shift law, its parameters by name (SI units) and their covariance (p, p); a table has none.

    `misfit` is the reduced chi-square of the law against the shift factors: the squared distance between the two in standard errors
    of the shift factors, per degree of freedom. It is about 1 if the law fits, far above 1 if it does not, and 0 for a table and if
    there are no more temperatures than parameters. If it is above 1, the covariance is multiplied by it.

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

    @property
    def parameters(self) -> dict[str, float]:
        """Values by name, in the units of the law's constants: C1 and C2 (K), or activation_energy (J/mol)."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def stderr(self) -> dict[str, float]:
        """Standard errors by name; infinite if the data do not determine the parameter."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))


def fit_shift_law(
    law: str, temperature: Floats, log10_shift_factor: Floats, covariance: Floats, anchor: int, reference_temperature: float
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
    scale = max(fitted.misfit, 1.0)
    spread = fitted.moments * scale
    values = moved.to_constants @ spread @ moved.to_constants.T
    if fitted.assumed:
        far = reference_temperature not in temperature and doubt > NEGLIGIBLE
        known = f"is known to +- {doubt:.2g} only" if np.isfinite(doubt) else "is not known at all"
        warn(fitted.assumed + (f"; log10 a at {reference_temperature:g} degC {known}, for want of C2" if far else ""))
    return ShiftFit(
        moved.law,
        tuple(constant.name for constant in kind.constants),
        np.array(list(moved.law.drawn().values())),
        np.full(values.shape, np.inf) if fitted.assumed else values,
        fitted.misfit,
        moved.origin + float(shares @ off),
        weight,
        (float(step @ fitted.moments @ step) + float(shares @ (off - shares @ off) ** 2) / scale) * (scale - 1) + doubt**2,
        about,
        spread,
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


def _spread(differences: Floats) -> float:
    """Root mean square; infinite if a difference is unknown."""
    if not differences.size:
        return 0.0
    return rms(differences) if np.all(np.isfinite(differences)) else np.inf
