"""The likelihood of failures and survivals: exposures that scatter about a location.

A specimen fails when its exposure reaches that of its own strength, so that with v = y - L the observations have the likelihoods

    failed at t              f(v) dy/dt
    suspended at t           1 - F(v)
    dead at once, or at t    F(v)
    failed between t and t'  F(v') - F(v)

(Meeker and Escobar 1998, Ch. 7 and 17). The coordinates are those of the location, of the slopes of the exposure, and the log of
the scatter, in this order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Self

import numpy as np

from dielast.calibration.failures.ageing import Ageing
from dielast.calibration.failures.exposures import Exposure
from dielast.calibration.failures.scatter_laws import ScatterLaw, Terms
from dielast.numerics.arrays import Cases, Floats


class Seen(IntEnum):
    """What was seen of a specimen."""

    FAILED = 0
    SUSPENDED = 1
    DEAD = 2
    BETWEEN = 3


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """What was `seen` (n,) of specimens, the log of their area over the reference (n,), and for those that failed between two looks
    the end `later` (n,) of the exposures at which they were found failed; other specimens have the end of their number there.
    """

    seen: Cases
    log_area: Floats
    later: Cases

    @classmethod
    def of(cls, seen: Cases, log_area: Floats | None = None, later: Cases | None = None) -> Self:
        """With areas of the reference, and no specimen failed between two looks, by default."""
        n = seen.size
        return cls(seen, np.zeros(n) if log_area is None else log_area, np.arange(n) if later is None else later)

    @property
    def failures(self) -> int:
        """The number of specimens that failed."""
        return int(np.count_nonzero(self.seen != Seen.SUSPENDED))


@dataclass(frozen=True, slots=True, eq=False)
class Mixed:
    """L = ln(W e^c) + Z b: `weight` W (n, nodes) interpolates positive numbers e^c, whose logs c are coordinates `nodes`, and
    `factors` Z (n, m) are what acts on their logs, by coordinates `of_factors`.
    """

    weight: Floats
    factors: Floats
    nodes: tuple[str, ...]
    of_factors: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the nodes, then of the factors."""
        return (*self.nodes, *self.of_factors)

    def at(self, own: Floats, slope: Floats) -> tuple[Floats, Floats, Floats]:
        """L and its derivatives."""
        j, m, q = len(self.nodes), len(self.of_factors), slope.shape[1]
        c, b = own[:, :j], own[:, j:]
        top = c.max(axis=1, keepdims=True)
        parts = self.weight * np.exp(c - top)[:, None, :]
        whole = parts.sum(axis=2)
        share = parts / whole[:, :, None]
        k, n = whole.shape
        first, second = np.zeros((k, n, j + m + q)), np.zeros((k, n, j + m + q, j + m + q))
        first[:, :, :j], first[:, :, j : j + m] = share, self.factors
        second[:, :, :j, :j] = share[..., None] * np.eye(j) - share[..., None] * share[:, :, None, :]
        return np.log(whole) + top + b @ self.factors.T, first, second

    def log_prior(self, own: Floats, slope: Floats) -> Floats:
        """Flat."""
        return np.zeros(own.shape[0])

    def elsewhere(self, factors: Floats, weight: Floats) -> Self:
        """That of other films."""
        return replace(self, weight=weight, factors=factors)


@dataclass(frozen=True, slots=True, eq=False)
class Anchored:
    """L = ln t_0 + g(e_0; s) + Z b: the log exposure of a film that is under the field e^e_0 for t_0 = `time` in s; `factors` Z
    (n, m) act on the log of the time. The coordinates are e_0 and b.
    """

    ageing: Ageing
    time: float
    factors: Floats
    of_factors: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The field, then the factors."""
        return ("field", *self.of_factors)

    def at(self, own: Floats, slope: Floats) -> tuple[Floats, Floats, Floats]:
        """L and its derivatives."""
        m, (k, n) = len(self.of_factors), (own.shape[0], self.factors.shape[0])
        g, g_e, g_s, g_ee, g_es, g_ss = self.ageing.at(own[:, 0], slope[:, 0])
        first, second = np.zeros((k, n, m + 2)), np.zeros((k, n, m + 2, m + 2))
        first[:, :, 0], first[:, :, 1 : 1 + m], first[:, :, -1] = g_e[:, None], self.factors, g_s[:, None]
        second[:, :, 0, 0], second[:, :, -1, -1] = g_ee[:, None], g_ss[:, None]
        second[:, :, 0, -1] = second[:, :, -1, 0] = g_es[:, None]
        return np.log(self.time) + g[:, None] + own[:, 1:] @ self.factors.T, first, second

    def log_prior(self, own: Floats, slope: Floats) -> Floats:
        """Flat in ln t_0 + g, in which the location is linear: the derivative by e_0."""
        return np.asarray(np.log(self.ageing.at(own[:, 0], slope[:, 0])[1]))

    def elsewhere(self, factors: Floats, weight: Floats) -> Self:
        """That of other films."""
        return replace(self, factors=factors)


SCATTERS = {"weibull": (-7.0, 3.0), "lognormal": (-7.0, 3.0), "normal": (-7.0, -0.7)}
"""The range of the log of the scatter."""


Location = Mixed | Anchored
"""The location L of the log exposure, as a function of its coordinates and of the slopes: `at` has L (k, n), and its first (k, n,
m + q) and second derivatives (k, n, m + q, m + q) by its m coordinates (k, m), called `names`, and by the slopes (k, q).
`log_prior` (k,) is the log of a density of coordinates that is flat in those in which the location is linear. `elsewhere` is the
location of other films, with factors (films, m) and weights (films, nodes) of values at nodes.
"""


@dataclass(frozen=True, slots=True, eq=False)
class FailureModel:
    """The likelihood of `observations` as a function of its coordinates: location, slopes, log scatter."""

    observations: Observations
    exposure: Exposure
    location: Location
    scatter: ScatterLaw

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the coordinates."""
        return (*self.location.names, *(name for name, _, _ in self.exposure.slopes), "log_scatter")

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The least and the largest coordinates."""
        wide = [(-800.0, 800.0)] * len(self.location.names)
        ranges = [*wide, *((low, high) for _, low, high in self.exposure.slopes), SCATTERS[self.scatter.name]]
        return np.array([low for low, _ in ranges]), np.array([high for _, high in ranges])

    def parts(self, at: Floats) -> tuple[Floats, Floats, Floats]:
        """The coordinates (k, .) of the location, the slopes, and the log scatter (k, 1)."""
        m = len(self.location.names)
        return at[:, :m], at[:, m:-1], at[:, -1:]

    def log_prior(self, at: Floats) -> Floats:
        """The log (k,) of Jeffreys' prior of a location and scale at coordinates (k, p): flat in what acts linearly on the
        location, and sigma^-m for its m coordinates and slopes, with which draws agree with profile likelihoods.
        """
        own, slope, scatter = self.parts(at)
        return np.asarray(self.location.log_prior(own, slope) - (own.shape[1] + slope.shape[1]) * scatter[:, 0])

    def places(self, at: Floats) -> tuple[Floats, Floats]:
        """v (k, n) of all specimens, and that of the later look of those that failed between two."""
        own, slope, _ = self.parts(at)
        y, location = self.exposure.at(slope).y, self.location.at(own, slope)[0]
        n = self.observations.seen.size
        return y[:, :n] - location, y[:, self.observations.later] - location

    def values(self, at: Floats) -> Floats:
        """The log likelihoods (k, n) of the specimens."""
        return self._evaluated(at, 0)[0]

    def total(self, at: Floats) -> Floats:
        """The log likelihood (k,)."""
        return np.asarray(self.values(at).sum(axis=1))

    def function(self, at: Floats, weight: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """The log likelihood (k,), its gradient (k, p) and second derivatives (k, p, p), specimens counted by a `weight` (k, n)."""
        values, first, second = self._evaluated(at, 2)
        w = np.ones_like(values) if weight is None else weight
        with np.errstate(invalid="ignore"):
            total = np.where(w > 0, w * values, 0.0).sum(axis=1)
        return total, np.einsum("kn,knp->kp", w, first), np.einsum("kn,knpq->kpq", w, second)

    def _evaluated(self, at: Floats, order: int) -> tuple[Floats, Floats, Floats]:
        own, slope, scatter = self.parts(at)
        exposed, (place, place1, place2) = self.exposure.at(slope), self.location.at(own, slope)
        seen, k, n, p = self.observations.seen, at.shape[0], self.observations.seen.size, at.shape[1]
        m = own.shape[1]
        values, first, second = np.zeros((k, n)), np.zeros((k, n, p)), np.zeros((k, n, p, p))

        def moved(ends: Cases, rows: Cases) -> tuple[Floats, Floats, Floats]:
            """v of `ends` of the specimens `rows`, and its derivatives."""
            v = exposed.y[:, ends] - place[:, rows]
            if not order:
                return v, first, second
            by, bend = np.zeros((k, rows.size, p)), np.zeros((k, rows.size, p, p))
            by[:, :, :-1], bend[:, :, :-1, :-1] = -place1[:, rows], -place2[:, rows]
            by[:, :, m:-1] += exposed.y1[:, ends]
            bend[:, :, m:-1, m:-1] += exposed.y2[:, ends]
            return v, by, bend

        def chained(terms: Terms, by: Floats, bend: Floats) -> tuple[Floats, Floats]:
            """The derivatives of terms by all coordinates."""
            gradient = terms.v[..., None] * by
            gradient[:, :, -1] += terms.k
            hessian = terms.v[..., None, None] * bend + terms.vv[..., None, None] * by[..., None] * by[:, :, None, :]
            hessian[:, :, -1, :] += terms.vk[..., None] * by
            hessian[:, :, :, -1] += terms.vk[..., None] * by
            hessian[:, :, -1, -1] += terms.kk
            return gradient, hessian

        for kind in Seen:
            rows = np.flatnonzero(seen == kind)
            if not rows.size:
                continue
            v, by, bend = moved(rows, rows)
            area = self.observations.log_area[rows]
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                if kind is Seen.FAILED:
                    terms = self.scatter.log_density(v, scatter, area)
                elif kind is Seen.DEAD:
                    terms = self.scatter.log_failed(v, scatter, area)
                else:
                    terms = self.scatter.log_survival(np.maximum(v, -1e5), scatter, area)
            values[:, rows] = terms.value
            if kind is Seen.FAILED:
                values[:, rows] += exposed.rate[:, rows]
            if order and kind is not Seen.BETWEEN:
                first[:, rows], second[:, rows] = chained(terms, by, bend)
                if kind is Seen.FAILED:
                    first[:, rows, m:-1] += exposed.rate1[:, rows]
                    second[:, rows, m:-1, m:-1] += exposed.rate2[:, rows]
            if kind is Seen.BETWEEN:
                later, by2, bend2 = moved(self.observations.later[rows], rows)
                end = self.scatter.log_survival(later, scatter, area)
                gap = np.log(-np.expm1(np.minimum(end.value - terms.value, -1e-300)))
                values[:, rows] = terms.value + gap
                if order:
                    # P = S(v) - S(v'): derivatives of ln P from those of ln S
                    (d1, dd1), (d2, dd2) = chained(terms, by, bend), chained(end, by2, bend2)
                    one, two = np.exp(-gap)[..., None], np.exp(end.value - terms.value - gap)[..., None]
                    slope1 = one * d1 - two * d2
                    first[:, rows] = slope1
                    second[:, rows] = (
                        one[..., None] * (dd1 + d1[..., None] * d1[:, :, None, :])
                        - two[..., None] * (dd2 + d2[..., None] * d2[:, :, None, :])
                        - slope1[..., None] * slope1[:, :, None, :]
                    )
        values = np.where(np.isnan(values), -np.inf, values)
        return values, np.where(np.isfinite(first), first, 0.0), np.where(np.isfinite(second), second, 0.0)
