"""Histories of true field and stretch under a voltage programme, and what specimens are exposed to along them up to their ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.calibration.failures.ageing import Ageing
from dielast.io.result import Result
from dielast.numerics.arrays import Cases, Floats

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
PARTS, PART_WEIGHTS = 0.5 * (1 + NODES), 0.5 * WEIGHTS
"""Places within an interval, as shares of it, and their weights: Gauss and Legendre's."""
POWERS = (-8.0, 16.0)  # of the stretch, over which a field is largest
MANY = 2_000_000  # moments over slopes and rows that are in memory at a time
STRAIGHT = 1e-7
"""Points of an envelope that exceed the line between others by less, in ln field, are left out."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Histories(Result):
    """Films under their programmes: `time` (films, rows) in s, true `field` in V/m and `stretch` sqrt(l1 l2), all (films, rows).

    Rows after the end of a history repeat its last row. Two rows at one time are the states before and after a jump. Between rows,
    field and stretch are powers of time, and the field is linear where it begins or ends at 0.

    `skipped` (films, rows) is the period in s of cycles that are left out between a row and the next, 0 elsewhere; None for none.
    Their exposure per time is the mean of that of the whole cycles before and after them, and their state at a phase is that of the
    cycle before.
    """

    time: Floats
    field: Floats
    stretch: Floats
    skipped: Floats | None = None

    @classmethod
    def padded(cls, time: Floats, field: Floats, stretch: Floats, skipped: Floats | None = None) -> Self:
        """From arrays (films, rows) with NaN in rows that a film does not have; every film has a row."""
        known = np.isfinite(field) & np.isfinite(stretch) & np.isfinite(time)
        order = np.argsort(~known, axis=1, kind="stable")
        last = known.sum(axis=1) - 1
        rows = np.minimum(np.arange(time.shape[1]), last[:, None])
        index = np.take_along_axis(order, rows, axis=1)
        columns = (time, np.abs(field), stretch, *(() if skipped is None else (skipped,)))
        return cls(*(np.take_along_axis(values, index, axis=1) for values in columns))

    def of(self, films: Cases) -> Self:
        """Those of some films (k,)."""
        skipped = None if self.skipped is None else self.skipped[films]
        return type(self)(self.time[films], self.field[films], self.stretch[films], skipped)

    def _gaps(self) -> tuple[Cases, Cases, Cases, Cases]:
        """The films and the rows (k,) after which cycles are left out, the first row of the cycle before, and the last one of the
        cycle after.
        """
        film, row = (np.zeros(0, dtype=np.intp),) * 2 if self.skipped is None else np.nonzero(self.skipped)
        period = np.zeros(0) if self.skipped is None else self.skipped[film, row]
        ends = self.time[film, row] - period, self.time[film, row + 1] + period
        before, after = (np.argmin(np.abs(self.time[film] - end[:, None]), axis=1) for end in ends)
        return film, row, before, after

    @property
    def end(self) -> Floats:
        """The last time (films,) in s."""
        return np.asarray(self.time[:, -1])

    def coarser(self) -> Self:
        """The same with every second row between jumps left out, the last first, to see the error of what is integrated along
        them.
        """
        time = self.time.copy()
        jump = np.diff(time, axis=1) == 0
        near = np.zeros(time.shape, dtype=bool)
        near[:, 1:] |= jump
        near[:, :-1] |= jump
        near |= self.field == 0
        near[:, [0, -1]] = True
        film, row, before, after = self._gaps()
        for kept in (row, row + 1, before, after):
            near[film, kept] = True
        index = np.arange(time.shape[1])
        stays = np.minimum.accumulate(np.where(near, index, index.size)[:, ::-1], axis=1)[:, ::-1]
        gone = (stays - index) % 2 == 1
        return self.padded(np.where(gone, np.nan, time), self.field, self.stretch, self.skipped)

    def interval_of(self, films: Cases, time: Floats) -> Cases:
        """The row (k,) that begins the interval of the films (k,) that contains `time` (k,) in s, or ends there."""
        rows = np.sum(self.time[films] < time[:, None], axis=1) - 1
        return np.asarray(np.clip(rows, 0, self.time.shape[1] - 2))

    def at(self, films: Cases, time: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Field and stretch (k,) of the films (k,) at a `time` (k,) in s, and the rates of their logarithms in 1/s before it; the
        rates are NaN at a time of 0.
        """
        row = self.interval_of(films, time)
        if self.skipped is not None:
            period, end = self.skipped[films, row], self.time[films, row]
            early = np.mod(end - time, np.where(period > 0, period, 1.0))
            time = np.where(period > 0, end - early, time)
            row = self.interval_of(films, time)
        share, start, width = self._share(films, row, time)
        (field, growth), (stretch, widening) = (
            _between(column[films, row], column[films, row + 1], share, start, time, width) for column in (self.field, self.stretch)
        )
        return field, stretch, growth, widening

    def _share(self, films: Cases, row: Cases, time: Floats) -> tuple[Floats, Floats, Floats]:
        start, end = self.time[films, row], self.time[films, row + 1]
        width = end - start
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(width > 0, (time - start) / np.where(width > 0, width, 1.0), 1.0)
        return np.clip(share, 0.0, 1.0), start, width

    def integrated(self, ageing: Ageing, slope: Floats) -> Floats:
        """Cumulative moments (3, slopes, films, rows) of exp(g) dt: 1, g_s and g_s^2 + g_ss, with g = ln of the rate of ageing
        at the `slope` (slopes,).
        """
        a, b = self.field[:, :-1, None], self.field[:, 1:, None]
        start, width = self.time[:, :-1, None], np.diff(self.time, axis=1)[..., None]
        field = _between(a, b, PARTS, start, start + PARTS * width, width)[0]
        pieces = _moments(ageing, slope, field, width * PART_WEIGHTS)
        whole = np.zeros((3, slope.size, *self.time.shape))
        film, row, before, after = self._gaps()
        if film.size:
            lasts = np.diff(self.time, axis=1)[film, row]
            pieces[..., film, row] = 0
            np.cumsum(pieces, axis=-1, out=whole[..., 1:])
            parts, times = np.zeros(whole.shape[:2] + film.shape), np.zeros(film.size)
            for first, last in ((before, row), (row + 1, after)):
                span = self.time[film, last] - self.time[film, first]
                complete = span > 0.999 * self.skipped[film, row] if self.skipped is not None else span > 0
                parts += np.where(complete, whole[..., film, last] - whole[..., film, first], 0.0)
                times += np.where(complete, span, 0.0)
            pieces[..., film, row] = parts / times * lasts
        np.cumsum(pieces, axis=-1, out=whole[..., 1:])
        return whole

    def exposure(self, ageing: Ageing, slope: Floats, films: Cases, time: Floats) -> tuple[Floats, Floats, Floats]:
        """ln of the integral of exp(g) dt up to `time` (k,) in s of the films (k,), and its first and second derivative by the
        slope, all (slopes, k); -inf where there was no field.
        """
        if slope.size > 1 and slope.size * self.time.size > MANY:
            halves = [self.exposure(ageing, half, films, time) for half in np.array_split(slope, 2)]
            log, mean, spread = (np.concatenate(part) for part in zip(*halves, strict=True))
            return log, mean, spread
        whole, row = self.integrated(ageing, slope), self.interval_of(films, time)
        share, start, width = self._share(films, row, time)
        parts = share[:, None] * PARTS
        a, b = self.field[films, row][:, None], self.field[films, row + 1][:, None]
        at = start[:, None] + parts * width[:, None]
        field = _between(a, b, parts, start[:, None], at, width[:, None])[0]
        rest = _moments(ageing, slope, field, (share * width)[:, None] * PART_WEIGHTS)
        if self.skipped is not None:
            rest = np.where(self.skipped[films, row] > 0, share * (whole[:, :, films, row + 1] - whole[:, :, films, row]), rest)
        return log_moments(whole[:, :, films, row] + rest)

    def largest(self, films: Cases, time: Floats) -> tuple[Floats, Floats]:
        """Fields and stretches (k, points) of the films (k,) up to `time` (k,) in s, among which a field over any power of the
        stretch is largest: the corners of the upper envelope of ln field over ln stretch; a place without a corner repeats
        the last.
        """
        found = []
        end_field, end_stretch, *_ = self.at(films, time)
        for k, film in enumerate(films.tolist()):
            known = (self.time[film] < time[k]) & (self.field[film] > 0)
            x = np.log(np.append(self.stretch[film][known], end_stretch[k]))
            with np.errstate(divide="ignore"):
                y = np.log(np.append(self.field[film][known], end_field[k]))
            found.append(_upper_hull(x, y))
        most = max(len(x) for x, _ in found)
        fill = [
            np.array([np.append(part, np.full(most - part.size, part[-1])) for part in parts]) for parts in zip(*found, strict=True)
        ]
        return np.exp(fill[1]), np.exp(fill[0])


def _between(a: Floats, b: Floats, share: Floats, start: Floats, time: Floats, width: Floats) -> tuple[Floats, Floats]:
    """A value at a `share` of an interval that begins at `start` with a and ends with b, and the rate of its logarithm."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        positive = (a > 0) & (b > 0)
        ratio = np.log(np.where(positive, b / np.where(positive, a, 1.0), 1.0))
        wide = np.log((start + width) / np.where(start > 0, start, 1.0))
        over_log = np.where(
            (start > 0) & (wide > 0), np.log(time / np.where(start > 0, start, 1.0)) / np.where(wide > 0, wide, 1.0), share
        )
        power = np.where(positive, a * np.exp(ratio * over_log), 0.0)
        linear = a + (b - a) * share
        value = np.where(positive, power, linear)
        by_power = np.where((start > 0) & (wide > 0), ratio / np.where(wide > 0, wide, 1.0) / time, ratio / width)
        rate = np.where(positive, by_power, (b - a) / width / np.where(linear > 0, linear, np.nan))
    return np.asarray(value), np.asarray(rate)


def _moments(ageing: Ageing, slope: Floats, field: Floats, weight: Floats) -> Floats:
    """Sums over the last axis of weight exp(g) times 1, g_s and g_s^2 + g_ss, (3, slopes, ...)."""
    rows = []
    acts = field > 0
    log_field = np.log(np.where(acts, field, 1.0))
    for one in slope.tolist():
        g, g_s, g_ss = ageing.along(log_field, one)
        mass = np.where(acts, weight * np.exp(g), 0.0)
        rows.append([np.sum(part, axis=-1) for part in (mass, mass * g_s, mass * (g_s**2 + g_ss))])
    return np.moveaxis(np.array(rows), 0, 1)


def log_moments(moments: Floats) -> tuple[Floats, Floats, Floats]:
    """ln of the first of three `moments` (3, ...) of exp(g) dt, and its first and second derivative by the slope."""
    zeroth, first, second = moments
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(zeroth > 0, first / zeroth, 0.0)
        return np.log(zeroth), mean, np.where(zeroth > 0, second / zeroth - mean**2, 0.0)


def _upper_hull(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The corners of the upper envelope of points, by ascending x (Andrew 1979, Inf. Process. Lett. 9, 216)."""
    hull: list[tuple[float, float]] = []
    order = np.lexsort((-y, x))
    for point in zip(x[order].tolist(), y[order].tolist(), strict=True):
        while hull and hull[-1][1] <= point[1] and hull[-1][0] == point[0]:
            hull.pop()
        while len(hull) > 1 and (hull[-1][0] - hull[-2][0]) * (point[1] - hull[-2][1]) >= (hull[-1][1] - hull[-2][1] - STRAIGHT) * (
            point[0] - hull[-2][0]
        ):
            hull.pop()
        if not hull or point[0] > hull[-1][0]:
            hull.append(point)
    first, second = (np.array(part) for part in zip(*hull, strict=True))
    slope = np.diff(second) / np.diff(first)
    # corners at which no power in the range is the slope are never largest
    kept = np.append(slope <= POWERS[1], True) & np.append(True, slope >= POWERS[0])
    return first[kept], second[kept]
