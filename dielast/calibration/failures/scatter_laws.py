"""Distributions of the exposure at failure, with the derivatives of their logarithms.

With v the log of the exposure over that which is typical of the material, and k the log of the scatter:

    weibull      w = v/sigma + ln a, P_f = 1 - exp(-e^w), sigma = e^k = 1/shape, a the area ratio (weakest link)
    lognormal    w = v/sigma, P_f = Phi(w)
    normal       w = (e^v - 1)/r, P_f = Phi(w), r = e^k the relative standard deviation

Meeker and Escobar, Statistical Methods for Reliability Data (1998), Ch. 4; Weibull, J. Appl. Mech. 18 (1951) 293 for the area.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr, ndtri

from dielast.base.errors import InputError
from dielast.numerics.arrays import Floats

Derivatives = tuple[Floats, Floats, Floats]
"""A function of w, and its first and second derivative, all of the shape of w."""
HALF_LOG_2PI = 0.5 * np.log(2 * np.pi)


@dataclass(frozen=True, slots=True)
class Standard:
    """A standard distribution of w: logarithms of density, survival and distribution function, and its quantile."""

    density: Callable[[Floats], Derivatives]
    survival: Callable[[Floats], Derivatives]
    failed: Callable[[Floats], Derivatives]
    quantile: Callable[[Floats], Floats]


def _extreme_density(w: Floats) -> Derivatives:
    grown = np.exp(w)
    return w - grown, 1 - grown, -grown


def _extreme_survival(w: Floats) -> Derivatives:
    grown = np.exp(w)
    return -grown, -grown, -grown


def _extreme_failed(w: Floats) -> Derivatives:
    grown = np.exp(np.maximum(w, -700.0))
    slope = np.where(grown < 700, grown / np.expm1(np.minimum(grown, 700.0)), 0.0)
    return np.log(-np.expm1(-grown)) + np.minimum(w + 700.0, 0.0), slope, slope * (1 - grown - slope)


def _normal_density(w: Floats) -> Derivatives:
    return -0.5 * w**2 - HALF_LOG_2PI, -w, -np.ones_like(w)


def _normal_failed(w: Floats) -> Derivatives:
    log = log_ndtr(w)
    slope = np.exp(-0.5 * w**2 - HALF_LOG_2PI - log)
    return log, slope, -slope * (slope + w)


def _normal_survival(w: Floats) -> Derivatives:
    log, slope, bend = _normal_failed(-w)
    return log, -slope, bend


EXTREME = Standard(_extreme_density, _extreme_survival, _extreme_failed, lambda p: np.log(-np.log1p(-p)))
NORMAL = Standard(_normal_density, _normal_survival, _normal_failed, lambda p: np.asarray(ndtri(p)))


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """Log likelihoods (..., n), and their derivatives by v and k: first (`v`, `k`) and second (`vv`, `vk`, `kk`)."""

    value: Floats
    v: Floats
    k: Floats
    vv: Floats
    vk: Floats
    kk: Floats


@dataclass(frozen=True, slots=True)
class ScatterLaw:
    """A distribution of the exposure at failure by `name`; `linear` says whether it is that of e^v - 1 instead of v."""

    name: str
    standard: Standard
    linear: bool = False

    @property
    def scales_with_area(self) -> bool:
        """Whether the weakest spot of a larger film is weaker."""
        return self.standard is EXTREME

    def place(self, v: Floats, k: Floats, log_area: Floats) -> tuple[Floats, ...]:
        """w, and its derivatives w_v, w_k, w_vv, w_vk, w_kk."""
        v = np.clip(v, -1e5, 1e5)  # an exposure of 0 has the log -inf
        if self.linear:
            slope, w = np.exp(np.minimum(v - k, 700.0)), np.expm1(np.minimum(v, 700.0)) * np.exp(-k)
            return w, slope, -w, slope, -slope, w
        slope = np.exp(-k) + np.zeros_like(v)
        part = v * slope
        shift = log_area if self.scales_with_area else 0.0
        return np.clip(part + shift, -1e4, 600.0), slope, -part, np.zeros_like(part), -slope, part

    def log_density(self, v: Floats, k: Floats, log_area: Floats) -> Terms:
        """The log density of v; `v` (..., n), `k` (..., 1) and `log_area` (n,) broadcast."""
        of_w = _chained(self.standard.density, self.place(v, k, log_area))
        value, slope = (v - k, 1.0) if self.linear else (-k, 0.0)  # ln dw/dv, and its derivative by v
        return replace(of_w, value=of_w.value + value, v=of_w.v + slope, k=of_w.k - 1)

    def log_survival(self, v: Floats, k: Floats, log_area: Floats) -> Terms:
        """The log probability of a larger v."""
        return _chained(self.standard.survival, self.place(v, k, log_area))

    def log_failed(self, v: Floats, k: Floats, log_area: Floats) -> Terms:
        """The log probability of at most v."""
        return _chained(self.standard.failed, self.place(v, k, log_area))

    def quantile(self, probability: Floats, k: Floats) -> Floats:
        """v that films of the reference area do not exceed with this `probability`."""
        w, scale = self.standard.quantile(np.asarray(probability, dtype=float)), np.exp(k)
        if self.linear:
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.where(1 + scale * w > 0, np.log1p(np.maximum(scale * w, -1.0)), -np.inf)
        return np.asarray(scale * w)


def _chained(function: Callable[[Floats], Derivatives], place: tuple[Floats, ...]) -> Terms:
    w, w_v, w_k, w_vv, w_vk, w_kk = place
    g, g1, g2 = function(w)
    return Terms(g, g1 * w_v, g1 * w_k, g2 * w_v**2 + g1 * w_vv, g2 * w_v * w_k + g1 * w_vk, g2 * w_k**2 + g1 * w_kk)


WEIBULL = ScatterLaw("weibull", EXTREME)
LOGNORMAL = ScatterLaw("lognormal", NORMAL)
NORMAL_FIELD = ScatterLaw("normal", NORMAL, linear=True)
SCATTER_LAWS = {law.name: law for law in (WEIBULL, LOGNORMAL, NORMAL_FIELD)}


def scatter_law(name: str) -> ScatterLaw:
    """The law of this name; raises `InputError` for another name."""
    if name not in SCATTER_LAWS:
        raise InputError(f"{name!r}: one of {', '.join(SCATTER_LAWS)} is needed", argument="scatter")
    return SCATTER_LAWS[name]
