"""Fit a shift law to shift factors that come with a covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, warn
from dielast.material.shift import WLF, Arrhenius, ShiftLaw, ShiftTable
from dielast.units import ZERO_CELSIUS

Array = NDArray[np.float64]
LawName = Literal["wlf", "arrhenius", "table"]

SMALLEST_C2 = 50.0  # K, about the coldest temperature: that of most polymers at their glass transition, below which nobody shifts
TRIALS = 25  # values of an assumed C2
NEGLIGIBLE = 1e-3  # decades
HARDLY = 0.25  # relative standard error of C2 beyond which it is warned of


@dataclass(frozen=True, slots=True, eq=False)
class ShiftFit:
    """A shift law, its parameters by name (SI units) and their covariance (p, p); a table has none.

    `misfit` is the reduced chi-square of the law against the shift factors: the squared distance between the two in standard errors
    of the shift factors, per degree of freedom. About one where the law fits, far above one where it does not, zero for a table and
    where there are no more temperatures than parameters. Above one, the covariance has been scaled up by it.

    `origin` is log10 a at the reference temperature relative to the temperature that the law was fitted about: the law's, and how
    far the shift factors lie off it there, between neighbours in proportion. It is thus that of a measured temperature at all
    temperatures that are. `origin_weight` (m,) is the derivative of it with respect to the shift factors, `origin_excess` the
    variance that the misfit and a C2 that is only assumed add.
    """

    law: ShiftLaw
    names: tuple[str, ...]
    values: Array
    covariance: Array
    misfit: float
    origin: float
    origin_weight: Array
    origin_excess: float

    @property
    def parameters(self) -> dict[str, float]:
        """Values by name: C1 and C2 (K), or activation_energy (J/mol)."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def stderr(self) -> dict[str, float]:
        """Standard errors by name; infinite for what the data do not determine."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))


def fit_shift_law(
    law: LawName, temperature: Array, log10_shift_factor: Array, covariance: Array, anchor: int, reference_temperature: float
) -> ShiftFit:
    """Fit `law` to log10 a (m,) at `temperature` (m,) in degC, ascending, by generalised least squares with the covariance (m, m).

    The shift factors are relative to the temperature numbered `anchor`, where log10 a and its covariance are zero; the law is then
    moved to `reference_temperature`, which need not have been measured. Warns where the data cannot tell C1 from C2, and then takes
    C2 = T_ref in kelvin, with which WLF is Arrhenius' law. The variance of the origin then allows for any C2 that the data do
    and that is at least `SMALLEST_C2` about the coldest temperature.
    """
    m, base = temperature.size, float(temperature[anchor])
    if law == "table":
        return _table(temperature, log10_shift_factor, reference_temperature)
    others = np.arange(m) != anchor
    distance, wanted = temperature[others] - base, log10_shift_factor[others]
    own = covariance[np.ix_(others, others)]
    whiten = np.linalg.inv(np.linalg.cholesky(own + 1e-14 * np.mean(np.diag(own)) * np.eye(m - 1)))
    fitted = (_arrhenius if law == "arrhenius" else _wlf)(base, distance, wanted, whiten)
    moved = fitted.about(reference_temperature - base)
    near = np.array([np.interp(reference_temperature, temperature, row) for row in np.eye(m)])
    beside = [(near[k], fitted.about(float(temperature[k]) - base), k) for k in np.flatnonzero(near)]
    off = np.array([log10_shift_factor[k] - own.origin for _, own, k in beside])
    shares = np.array([share for share, _, _ in beside])
    # what is left of the law: from the neighbours to the reference temperature
    step = moved.to_origin - sum(share * own.to_origin for share, own, _ in beside)
    weight = near.copy()
    weight[others] += step @ fitted.response
    doubt = _spread(moved.others - moved.origin - sum(share * (own.others - own.origin) for share, own, _ in beside))
    scale = max(fitted.misfit, 1.0)
    spread = fitted.moments * scale
    values = moved.to_values @ spread @ moved.to_values.T
    if fitted.held:
        far = reference_temperature not in temperature and doubt > NEGLIGIBLE
        known = f"is known to +- {doubt:.2g} only" if np.isfinite(doubt) else "is not known at all"
        warn(fitted.held + (f"; log10 a at {reference_temperature:g} degC {known}, for want of C2" if far else ""))
    return ShiftFit(
        moved.law,
        fitted.names,
        moved.values,
        np.full(values.shape, np.inf) if fitted.held else values,
        fitted.misfit,
        moved.origin + float(shares @ off),
        weight,
        (float(step @ fitted.moments @ step) + float(shares @ (off - shares @ off) ** 2) / scale) * (scale - 1) + doubt**2,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Moved:
    """A law about its reference temperature, and derivatives of its parameters and its origin with respect to those fitted.

    `others` are the origins of other laws that the data allow, if some of this one is only assumed.
    """

    law: ShiftLaw
    values: Array
    to_values: Array
    origin: float
    to_origin: Array
    others: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Fitted:
    """Parameters fitted about the base temperature: their moments, and their response (p, m - 1) to the shift factors.

    `held` says what is only assumed, if anything.
    """

    names: tuple[str, ...]
    about: Callable[[float], _Moved]
    moments: Array
    response: Array
    misfit: float
    held: str = ""


def _linear(whiten: Array, column: Array, wanted: Array) -> tuple[float, Array, Array, float]:
    """Weighted fit of one factor: its value, its variance (1, 1), its response (1, m - 1) and the misfit."""
    white = whiten @ column
    variance = 1 / float(white @ white)
    response = variance * (white @ whiten)
    value = float(response @ wanted)
    return value, np.array([[variance]]), response[None, :], _misfit(whiten @ (wanted - value * column), 1)


def _arrhenius(base: float, distance: Array, wanted: Array, whiten: Array) -> _Fitted:
    unit = Arrhenius(base, 1.0)
    energy, moments, response, misfit = _linear(whiten, unit.log10_shift_factor(base + distance), wanted)
    if energy <= 0:
        warn(f"the activation energy comes out as {energy:.3g} J/mol: relaxation gets slower with temperature")

    def about(move: float) -> _Moved:
        rise = float(unit.log10_shift_factor(base + move))
        return _Moved(Arrhenius(base + move, energy), np.array([energy]), np.eye(1), energy * rise, np.array([rise]), np.zeros(0))

    return _Fitted(("activation_energy",), about, moments, response, misfit)


def _wlf(base: float, distance: Array, wanted: Array, whiten: Array) -> _Fitted:
    """WLF as log10 a = -g d / (1 + k d), d = T - T_base, g = C1/C2, k = 1/C2: regular also where C2 is large."""
    lowest = -0.98 / float(distance.max()) if distance.max() > 0 else -np.inf
    highest = -0.98 / float(distance.min()) if distance.min() < 0 else np.inf  # a pole among the measured temperatures is no law
    g, k = _gauss_newton(distance, wanted, whiten, lowest, highest)
    jacobian = _jacobian(distance, g, k, whiten)
    normal: Array = jacobian.T @ jacobian
    misfit = _misfit(whiten @ (wanted + g * distance / (1 + k * distance)), 2)
    scale = np.sqrt(np.diag(normal))
    regular = distance.size >= 2 and np.linalg.cond(normal / np.outer(scale, scale)) < 1e12
    moments: Array = np.asarray(np.linalg.inv(normal)) if regular else np.full((2, 2), np.inf)
    spread = float(np.sqrt(moments[1, 1] * max(misfit, 1.0)))
    plausible, held = np.zeros((0, 2)), ""
    if k <= max(spread, 0.0):
        k_fitted, k = k, 1 / (base + ZERO_CELSIUS)
        g, variance, response, misfit = _linear(whiten, -distance / (1 + k * distance), wanted)
        moments = np.array([[variance[0, 0], 0.0], [0.0, 0.0]])
        largest = min(1 / (SMALLEST_C2 + max(-float(distance.min()), 0.0)), k_fitted + 2 * spread)
        plausible = _with_k(np.linspace(0.0, max(largest, k), TRIALS), distance, wanted, whiten)
        response = np.vstack((response, np.zeros(response.shape)))
        why = "do not tell the WLF constants C1 and C2 apart" if spread >= abs(k_fitted) else "bend the other way than the WLF law"
        held = (
            f"the shift factors of {distance.size + 1} temperatures {why}: C2 = T_ref in kelvin is assumed, "
            "which makes it Arrhenius' law, and only the ratio C1/C2 is fitted"
        )
    else:
        response = np.asarray(moments @ jacobian.T @ whiten)
        if spread > HARDLY * k:
            warn(f"these temperatures hardly tell the WLF constants C1 and C2 apart: C2 is known to {100 * spread / k:.0f} % only")

    def about(move: float) -> _Moved:
        pole = 1 + k * move
        if pole <= 0:
            raise InputError(
                f"{base + move:g} degC is at or below {base - 1 / k:g} degC, the pole of the WLF law",
                argument="reference_temperature",
            )
        values = np.array([g / (k * pole), 1 / k + move])
        to_values = np.array([[1 / (k * pole), -g * (1 + 2 * k * move) / (k * pole) ** 2], [0.0, -1 / k**2]])
        to_origin = np.array([-move / pole, g * move**2 / pole**2])
        poles = 1 + plausible[:, 1] * move
        others = -plausible[:, 0] * move / np.where(poles > 0, poles, np.nan)
        return _Moved(WLF(base + move, *values.tolist()), values, to_values, -g * move / pole, to_origin, others)

    return _Fitted(("C1", "C2"), about, moments, response, misfit, held)


def _spread(differences: Array) -> float:
    """Root mean square; infinite if some are not known."""
    if not differences.size:
        return 0.0
    return float(np.sqrt(np.mean(differences**2))) if np.all(np.isfinite(differences)) else np.inf


def _with_k(k: Array, distance: Array, wanted: Array, whiten: Array) -> Array:
    """g and k (n, 2) for the given k (n,)."""
    columns = -distance / (1 + k[:, None] * distance) @ whiten.T
    return np.stack((columns @ whiten @ wanted / np.sum(columns**2, axis=1), k), axis=1)


def _linear_guess(distance: Array, wanted: Array, whiten: Array, lowest: float, highest: float) -> tuple[float, float]:
    """g, k from wanted (1 + k d) = -g d, which is linear in both."""
    matrix = whiten @ np.stack((-distance, -wanted * distance), axis=1)
    g, k = np.linalg.lstsq(matrix, whiten @ wanted, rcond=None)[0].tolist()
    return g, float(np.clip(k, lowest, highest))


def _jacobian(distance: Array, g: float, k: float, whiten: Array) -> Array:
    pole = 1 + k * distance
    return whiten @ np.stack((-distance / pole, g * distance**2 / pole**2), axis=1)


def _gauss_newton(distance: Array, wanted: Array, whiten: Array, lowest: float, highest: float) -> tuple[float, float]:
    g, k = _linear_guess(distance, wanted, whiten, lowest, highest)

    def miss(g: float, k: float) -> Array:
        return whiten @ (wanted + g * distance / (1 + k * distance))

    for _ in range(100):
        rest = miss(g, k)
        step = np.linalg.lstsq(_jacobian(distance, g, k, whiten), rest, rcond=None)[0]
        factor = 1.0
        while factor > 1e-6:
            new_g, new_k = g + factor * step[0], float(np.clip(k + factor * step[1], lowest, highest))
            fresh = miss(new_g, new_k)
            if fresh @ fresh <= rest @ rest:
                break
            factor /= 2
        else:
            break
        moved = abs(new_g - g) / max(abs(g), 1e-12) + abs(new_k - k) / max(abs(k), 1e-12)
        g, k = float(new_g), new_k
        if moved < 1e-12:
            break
    return g, k


def _table(temperature: Array, log10_shift_factor: Array, reference: float) -> ShiftFit:
    """The table itself, with a row for the reference temperature, interpolated by a cubic through its four neighbours."""
    if not temperature[0] <= reference <= temperature[-1]:
        raise InputError(
            f"{reference:g} degC is outside {temperature[0]:g} to {temperature[-1]:g} degC, where the shift table ends: choose a "
            "law, or a reference temperature within",
            argument="reference_temperature",
        )
    weight = np.zeros(temperature.size)
    first = int(np.clip(np.searchsorted(temperature, reference) - 2, 0, max(temperature.size - 4, 0)))
    near = np.arange(first, min(first + 4, temperature.size))
    gap = temperature[near][:, None] - temperature[near] + np.eye(near.size)
    ratio = np.where(np.eye(near.size) > 0, 1.0, (reference - temperature[near]) / gap)
    weight[near] = np.prod(ratio, axis=1)
    origin = float(weight @ log10_shift_factor)
    rows = {**dict(zip(temperature.tolist(), (log10_shift_factor - origin).tolist(), strict=True)), float(reference): 0.0}
    table = ShiftTable(reference, *zip(*sorted(rows.items()), strict=True))
    return ShiftFit(table, (), np.zeros(0), np.zeros((0, 0)), 0.0, origin, weight, 0.0)


def _misfit(whitened: Array, parameters: int) -> float:
    freedom = whitened.size - parameters
    return float(whitened @ whitened) / freedom if freedom > 0 else 0.0
