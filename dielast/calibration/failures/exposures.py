"""What specimens were exposed to up to their ends, as functions of the slopes of a law: the log exposure y that scatters, and for
failures the log of its growth dy/dt.

All have the arrays (k, ends) of `Exposed` for k sets of slopes (k, q). A slope of ageing enters by tables of y and its derivatives
over the log of the slope, between which polynomials of fifth degree interpolate: their error is far below that of the histories.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.calibration.failures.ageing import Ageing
from dielast.calibration.failures.histories import POWERS, Histories, log_moments
from dielast.numerics.arrays import Cases, Floats

STEPS = 60  # nodes of a table over the log of a slope


@dataclass(frozen=True, slots=True, eq=False)
class Exposed:
    """y and ln dy/dt (k, ends), with first derivatives (k, ends, q) and second derivatives (k, ends, q, q) by the slopes."""

    y: Floats
    y1: Floats
    y2: Floats
    rate: Floats
    rate1: Floats
    rate2: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Plain:
    """Exposures without slopes: `y` (ends,), and `rate` (ends,) = ln dy/dt."""

    y: Floats
    rate: Floats

    @property
    def slopes(self) -> tuple[tuple[str, float, float], ...]:
        """None."""
        return ()

    def at(self, slope: Floats) -> Exposed:
        """The same for every set."""
        k, n = slope.shape[0], self.y.size
        y, rate = np.broadcast_to(self.y, (k, n)), np.broadcast_to(self.rate, (k, n))
        none, neither = np.zeros((k, n, 0)), np.zeros((k, n, 0, 0))
        return Exposed(y, none, neither, rate, none, neither)


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """ln of the largest field over l^a (h/h_ref)^-b so far, for the slopes a and b of the stretch l and the thickness h.

    `log_field` and `log_stretch` (ends, points) are those at which it may be largest, the last being the end; `thinner` (ends,) is
    ln(h_ref/H) with the undeformed thickness H, `growth` and `widening` (ends,) are the rates of ln field and ln stretch in 1/s.
    With h = H/l^2 the exponents act together: E/(l^a (h/h_ref)^-b) = E l^-(a + 2b) (h_ref/H)^-b.
    """

    log_field: Floats
    log_stretch: Floats
    end: tuple[Floats, Floats]
    thinner: Floats
    growth: Floats
    widening: Floats

    @property
    def slopes(self) -> tuple[tuple[str, float, float], ...]:
        """The exponents of stretch and thickness."""
        return (("stretch_exponent", POWERS[0], 0.5 * POWERS[1]), ("thickness_exponent", 0.0, 0.25 * POWERS[1]))

    def at(self, slope: Floats) -> Exposed:
        """The exposures at pairs of exponents (k, 2)."""
        a, b = slope[:, 0, None], slope[:, 1, None]
        power = a + 2 * b
        over = self.log_field - power[:, :, None] * self.log_stretch
        place = np.argmax(over, axis=2)
        y = np.take_along_axis(over, place[:, :, None], axis=2)[:, :, 0]
        stretch = np.take_along_axis(np.broadcast_to(self.log_stretch, over.shape), place[:, :, None], axis=2)[:, :, 0]
        y1 = np.stack((-stretch, -2 * stretch - self.thinner), axis=2)
        growth = self.growth - power * self.widening
        present = self.end[0] - power * self.end[1] >= y - 1e-9  # a film that withstood more before does not fail now
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(present & (growth > 0), np.log(growth), -np.inf)
            once = np.where(growth > 0, -self.widening / growth, 0.0)
        rate1 = np.stack((once, 2 * once), axis=2)
        rate2 = -(once**2)[:, :, None, None] * np.array([[1.0, 2.0], [2.0, 4.0]])
        return Exposed(y - b * self.thinner, y1, np.zeros((*y.shape, 2, 2)), rate, rate1, rate2)


def _nodes(ageing: Ageing) -> Floats:
    """The logs (nodes,) of the slopes of the tables."""
    low, high = np.log(ageing.slopes).tolist()
    return np.linspace(low, high, STEPS)


@dataclass(frozen=True, slots=True, eq=False)
class Aged:
    """ln of the integral of exp(g) dt for a law of `ageing`: tables `y`, `once`, `twice` (nodes, ends) over u = ln slope, equally
    spaced from `first` by `step`; `log_field` (ends,) is that at the end, -inf where there is none.
    """

    ageing: Ageing
    first: float
    step: float
    y: Floats
    once: Floats
    twice: Floats
    log_field: Floats

    @classmethod
    def along(cls, histories: Histories, ageing: Ageing, films: Cases, time: Floats) -> Self:
        """Of the films (ends,) up to a `time` (ends,) in s."""
        exposure = histories.exposure(ageing, np.exp(_nodes(ageing)), films, time)
        return cls._of(ageing, exposure, histories.at(films, time)[0])

    @classmethod
    def at_rows(cls, histories: Histories, ageing: Ageing) -> Self:
        """Up to every row of all films, one film after another."""
        moments = histories.integrated(ageing, np.exp(_nodes(ageing))).reshape(3, STEPS, -1)
        return cls._of(ageing, log_moments(moments), histories.field.ravel())

    @classmethod
    def _of(cls, ageing: Ageing, exposure: tuple[Floats, Floats, Floats], field: Floats) -> Self:
        """With y and its derivatives by the slope, each (nodes, ends), and the field (ends,) at the end."""
        u, (y, mean, bend) = _nodes(ageing), exposure
        slope = np.exp(u)[:, None]
        once = mean * slope
        with np.errstate(divide="ignore"):
            return cls(ageing, float(u[0]), float(u[1] - u[0]), y, once, bend * slope**2 + once, np.log(field))

    @property
    def slopes(self) -> tuple[tuple[str, float, float], ...]:
        """The slope of the law."""
        return (("exponent", *self.ageing.slopes),)

    def at(self, slope: Floats) -> Exposed:
        """The exposures at slopes (k, 1)."""
        s = slope[:, 0]
        place = (np.log(s) - self.first) / self.step
        node = np.clip(np.floor(place).astype(int), 0, self.y.shape[0] - 2)
        y, once, twice = self._between(node, (place - node)[:, None])
        # by the slope instead of its log
        y1 = once / s[:, None]
        y2 = (twice - once) / s[:, None] ** 2
        g, _, g_s, _, _, g_ss = self.ageing.at(np.where(np.isfinite(self.log_field), self.log_field, 0.0), s[:, None])
        ages = np.isfinite(self.log_field)
        rate = np.where(ages, g - y, -np.inf)
        return Exposed(y, y1[..., None], y2[..., None, None], rate, (g_s - y1)[..., None], (g_ss - y2)[..., None, None])

    def _between(self, node: Cases, t: Floats) -> tuple[Floats, Floats, Floats]:
        """y and its derivatives (k, ends) by u, at the share t (k, 1) of the interval after each node (k,)."""
        h = self.step
        p0, p1 = self.y[node], self.y[node + 1]
        m0, m1 = self.once[node] * h, self.once[node + 1] * h
        a0, a1 = self.twice[node] * h**2, self.twice[node + 1] * h**2
        # the polynomial of fifth degree with these values and derivatives at both ends
        with np.errstate(invalid="ignore"):
            rise, turn, bend = p1 - p0 - m0 - a0 / 2, m1 - m0 - a0, a1 - a0
        c3, c4, c5 = 10 * rise - 4 * turn + bend / 2, -15 * rise + 7 * turn - bend, 6 * rise - 3 * turn + bend / 2
        value = p0 + t * (m0 + t * (a0 / 2 + t * (c3 + t * (c4 + t * c5))))
        first = m0 + t * (a0 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)))
        second = a0 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5))
        never = ~np.isfinite(p0)
        return np.where(never, -np.inf, value), np.where(never, 0.0, first / h), np.where(never, 0.0, second / h**2)


Exposure = Plain | Envelope | Aged
"""What ends are exposed to: `slopes` are the name, the least and the largest value of each slope, `at` has the exposures at sets
of slopes (k, q).
"""
