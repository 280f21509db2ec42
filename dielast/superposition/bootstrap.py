"""The noise of a master curve, by resampling it: what would have come out of the same tests with other noise.

Every measured quantity, moved by the shift factors found, lies on one smooth curve. New tests are that curve plus the residuals
times random signs, a wild bootstrap (C. F. J. Wu, Ann. Stat. 14 (1986) 1261, DOI 10.1214/aos/1176350142): a residual stays where it
was measured, so that noise may differ from curve to curve and along a curve. Where neighbouring residuals are correlated, new noise
of their local size and correlation takes their place. Each curve's mean residual is resampled by itself, for specimens differ, or
with a stated drift a random walk takes its place; curves are tilted as much as they were found to be, and every temperature is off
by its stated standard error, which moves its curve along time.
Each draw is shifted and fitted anew, like the measurement.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import DielastWarning, InputError, NumericsError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.shift import ShiftLaw
from dielast.numerics.random_streams import stream
from dielast.superposition.mastercurve import MasterCurve, Vertical, build_master_curve
from dielast.superposition.measurement import Measurement
from dielast.superposition.spline import gram, roughness, spline_basis

Array = NDArray[np.float64]
Index = NDArray[np.intp]

GRID = 100  # reduced times at which the curves of all draws are kept
ROUNDS = 4  # of weighing outliers down
BEND = 2.5  # standard deviations beyond which a residual bends the smooth curve no further
PASSES = 3  # of finding out how far residuals remember
ABOUT = 5  # points on either side that share one estimate of the noise, where neighbours are correlated
LONGEST = 0.9  # correlation of neighbours that is allowed for
SIGNIFICANT = 3.0  # standard errors of the correlation of neighbours


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MasterCurveDraws(TabularResult):
    """Draws of a master curve of m temperatures: what resampled tests give, each row one draw.

    `log10_shift_factor` and `vertical_shift` (draws, m) at `temperature` (m,) in degC, NaN where a draw does not determine it;
    `law_parameters` (draws, p) are the numbers that the draws of the shift `law` differ in, in the units of `law.drawn`.
    `smooth_ordinates` (draws, c, k) are the smooth curves at `smooth_abscissa` (k,), both as in `MasterCurve`.
    `number` (draws,) counts the draws from 0; those that gave no master curve are missing.
    """

    number: Index
    temperature: Array
    log10_shift_factor: Array
    vertical_shift: Array
    law: ShiftLaw
    law_parameters: Array
    smooth_abscissa: Array
    smooth_ordinates: Array

    def columns(self) -> Table:
        """Shift factors, one draw below the other."""
        count, m = self.log10_shift_factor.shape
        return [
            Column("draw", None, np.repeat(self.number, m)),
            Column("temperature", "degC", np.tile(self.temperature, count)),
            Column("log10_shift_factor", "1", self.log10_shift_factor.ravel()),
            Column("vertical_shift", "1", self.vertical_shift.ravel()),
        ]

    def stderr(self) -> dict[str, float]:
        """Standard errors of the law's parameters by name, as the draws scatter."""
        spread = np.std(self.law_parameters, axis=0, ddof=1)
        return dict(zip((name for name, _ in self.law.drawn()), spread.tolist(), strict=True))


def bootstrap_master_curve(
    curves: Sequence[Measurement],
    master: MasterCurve,
    *,
    draws: int,
    seed: int = 1,
    law: str = "wlf",
    vertical: Vertical = "none",
    thermal_expansion: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> MasterCurveDraws:
    """Draws of the `master` curve that `build_master_curve` made of `curves` with the same arguments.

    A draw depends on `seed` and its own number alone. `progress` is called with the numbers of draws done and of all. Raises
    `InputError` for fewer than two draws, and `NumericsError` if less than half of them give a master curve.
    """
    if draws < 2:
        raise InputError(f"{draws} draws: at least 2 are needed")
    resampled = _Resampled.of(curves, master)
    grid = np.geomspace(master.smooth_abscissa[0], master.smooth_abscissa[-1], GRID)
    rows: list[tuple[int, Array, Array, Array, Array]] = []
    for draw in range(draws):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DielastWarning)
            try:
                drawn = build_master_curve(
                    resampled.draw(stream(seed, "measurements", draw)),
                    reference_temperature=master.reference_temperature,
                    law=law,
                    vertical=vertical,
                    thermal_expansion=thermal_expansion,
                    on=master.shifted_on if master.measurement == "oscillation" else "auto",
                    temperature_stderr=master.stated.temperature_stderr,
                    drift=master.stated.drift,
                )
                values = master.law.numbers_of(drawn.law)
            except (InputError, NumericsError):
                continue
            finally:
                if progress is not None:
                    progress(draw + 1, draws)
        if not master.law.allows(values):
            continue  # slower when warmer: no material's law
        rows.append((draw, drawn.log10_shift_factor, drawn.vertical_shift, values, _on_grid(drawn, grid)))
    if 2 * len(rows) < draws:
        raise NumericsError(f"only {len(rows)} of {draws} draws give a master curve: the data are too poor for an uncertainty")
    number, shift, raised, values, smooth = (np.array(column) for column in zip(*rows, strict=True))
    return MasterCurveDraws(number, master.temperature, shift, raised, master.law, values, grid, smooth)


def _on_grid(master: MasterCurve, grid: Array) -> Array:
    """Smooth curves (c, k) through all points at the abscissas `grid` (k,), continued straight in log-log beyond their ends."""
    x, wanted = np.log(master.smooth_abscissa), np.log(grid)
    before, after = np.minimum(wanted - x[0], 0.0), np.maximum(wanted - x[-1], 0.0)
    rows = []
    for y in np.log(master.placed_ordinates):
        beyond = before * (y[1] - y[0]) / (x[1] - x[0]) + after * (y[-1] - y[-2]) / (x[-1] - x[-2])
        rows.append(np.exp(np.interp(wanted, x, y) + beyond))
    return np.array(rows)


@dataclass(frozen=True, slots=True, eq=False)
class _Quantity:
    """One measured quantity of all curves, points (n,) by curve, then abscissa: `fitted` values, relative residuals `rest`, the
    residuals' mean by curve (curves,), and the correlation `memory` of neighbours. `along` (n,) is the place of a point on its
    curve, from -1/2 at the shortest to 1/2 at the longest times.
    """

    name: str
    curve: Index
    place: Index
    fitted: Array
    rest: Array
    mean: Array
    memory: float
    along: Array

    @property
    def mean_noise(self) -> Array:
        """Standard error of the mean residual by noise alone (curves,)."""
        count = np.maximum(np.bincount(self.curve, minlength=self.mean.size), 1)
        repeated = (1 + self.memory) / (1 - self.memory)
        return np.asarray(np.sqrt(np.bincount(self.curve, self.rest**2, minlength=self.mean.size) * repeated) / count)

    def draw(self, random: np.random.Generator, raised: Array | None, tilted: Array) -> Array:
        """New values (n,) of curves that are `raised` (curves,) and `tilted` (curves,) from end to end, both in ln of the value.

        Where nothing is said of how they are raised, their own mean residuals tell.
        """
        fresh = random.standard_normal(self.curve.size)
        own = random.standard_normal(self.mean.size)
        # new noise has a mean of its own, and noise that lasts tilts curves by itself
        level = own * np.sqrt(np.maximum(self.mean**2 - self.mean_noise**2, 0.0)) if raised is None else raised
        level = level[self.curve] + (tilted[self.curve] * self.along if self.memory == 0 else 0.0)
        if self.memory == 0:
            # signs alone keep every residual's size, by which outliers are told
            return np.asarray(self.fitted * (np.exp(level) + self.rest * np.sign(fresh)))
        first = np.concatenate(([True], np.diff(self.curve) != 0))
        innovation = np.sqrt(1 - self.memory**2)
        for k in np.flatnonzero(~first):
            fresh[k] = self.memory * fresh[k - 1] + innovation * fresh[k]
        return np.asarray(self.fitted * (np.exp(level) + self._size() * fresh))

    def _size(self) -> Array:
        """Root mean square of the residuals about each point (n,)."""
        low = np.maximum(np.arange(self.curve.size) - ABOUT, np.searchsorted(self.curve, self.curve))
        high = np.minimum(np.arange(self.curve.size) + ABOUT + 1, np.searchsorted(self.curve, self.curve, side="right"))
        total = np.concatenate(([0.0], np.cumsum(self.rest**2)))
        return np.asarray(np.sqrt((total[high] - total[low]) / (high - low)))


@dataclass(frozen=True, slots=True, eq=False)
class _Resampled:
    """The measurements, and their quantities as fitted."""

    curves: tuple[Measurement, ...]
    quantities: tuple[_Quantity, ...]
    temperature: Index
    master: MasterCurve

    @classmethod
    def of(cls, curves: Sequence[Measurement], master: MasterCurve) -> _Resampled:
        """Fit every quantity with the shift factors of `master`."""
        names = dict.fromkeys(name for curve in curves for name in _quantities(curve))
        place = np.array([int(np.argmin(np.abs(master.temperature - curve.temperature))) for curve in curves])
        return cls(tuple(curves), tuple(_fit_quantity(name, curves, master) for name in names), place, master)

    def draw(self, random: np.random.Generator) -> list[Measurement]:
        """New measurements."""
        place, master, stated = self.temperature, self.master, self.master.stated
        raised = None
        if stated.drift > 0:
            # from one temperature to the next, in the order in which they were first measured
            listed = np.array(list(dict.fromkeys(place.tolist())))
            walked = np.empty(master.temperature.size)
            walked[listed] = np.cumsum(stated.drift * random.standard_normal(listed.size))
            raised = walked[place]
        tilted = np.log(10) * master.tilt_spread * random.standard_normal(master.temperature.size)[place]
        moved = master.log10_shift_factor_slope * stated.temperature_stderr * random.standard_normal(master.temperature.size)
        fresh = {quantity.name: quantity.draw(random, *self._of(quantity.name, raised, tilted)) for quantity in self.quantities}
        result = []
        for index, curve in enumerate(self.curves):
            values: dict[str, Any] = {name: np.array(getattr(curve, name)) for name in _quantities(curve)}
            for quantity in self.quantities:
                if quantity.name in values:
                    own = quantity.curve == index
                    values[quantity.name][quantity.place[own]] = fresh[quantity.name][own]
            abscissa = fields(curve)[1].name
            slower = 1.0 if "time" in abscissa else -1.0
            values[abscissa] = getattr(curve, abscissa) * 10 ** (slower * moved[place[index]])
            result.append(replace(curve, **values))
        return result

    def _of(self, name: str, raised: Array | None, tilted: Array) -> tuple[Array | None, Array]:
        """What moduli are raised and tilted by, said of one quantity: a compliance is an inverse; tan delta tilts the loss."""
        if name == "compliance":
            return (None if raised is None else -raised), -tilted
        return raised, tilted if (name, self.master.shifted_on) != ("storage_modulus", "tan-delta") else np.zeros(tilted.size)


def _quantities(curve: Measurement) -> tuple[str, ...]:
    """What was measured: the fields between abscissa and source."""
    return tuple(field.name for field in fields(curve)[2:-1])


def _fit_quantity(name: str, curves: Sequence[Measurement], master: MasterCurve) -> _Quantity:
    """The smooth curve through one quantity of all curves, over the reduced abscissa."""
    placed = np.where(np.isfinite(master.log10_shift_factor), master.log10_shift_factor, master.log10_shift_factor_fit)
    log_b = np.log(master.vertical_shift)
    owner, place, x, y, measured, raised, apart = [], [], [], [], [], [], []
    for index, curve in enumerate(curves):
        if name not in _quantities(curve):
            continue
        abscissa = getattr(curve, fields(curve)[1].name)
        values = getattr(curve, name)
        k = int(np.argmin(np.abs(master.temperature - curve.temperature)))
        order = np.argsort(abscissa, kind="stable")
        away = placed[k] if np.isfinite(placed[k]) else 0.0
        slower = -1.0 if "time" in fields(curve)[1].name else 1.0
        lift = -log_b[k] if name == "compliance" else log_b[k]
        owner.append(np.full(order.size, index))
        place.append(order)
        x.append(np.log10(abscissa[order]) + slower * away)
        measured.append(values[order])
        raised.append(np.full(order.size, lift))
        apart.append(np.full(order.size, 0 if np.isfinite(placed[k]) else index + 1))
        y.append(values[order])
    curve_of, group = np.concatenate(owner), np.concatenate(apart)
    u, value, lift_of = np.concatenate(x), np.concatenate(measured), np.concatenate(raised)
    fitted, spare, remembered = np.empty(u.size), np.empty(u.size), 0.0
    count = np.bincount(curve_of, minlength=len(curves))
    for _ in range(PASSES):
        for own in (group == g for g in np.unique(group)):
            smooth, spare[own] = _smooth(curve_of[own], u[own], value[own], lift_of[own], (1 + remembered) / (1 - remembered))
            fitted[own] = np.exp(smooth - lift_of[own])
        relative = value / fitted - 1
        mean = np.bincount(curve_of, relative, minlength=len(curves)) / np.maximum(count, 1)
        rest = (relative - mean[curve_of]) / np.sqrt(spare)
        remembered = _neighbours(curve_of, rest)
        if remembered == 0:
            break
    low, high = np.full(len(curves), np.inf), np.full(len(curves), -np.inf)
    np.minimum.at(low, curve_of, u)
    np.maximum.at(high, curve_of, u)
    along = (u - ((low + high) / 2)[curve_of]) / np.maximum(high - low, 1e-12)[curve_of]
    if slower > 0:  # a frequency
        along = -along
    return _Quantity(name, curve_of, np.concatenate(place), fitted, rest, mean, remembered, along)


def _neighbours(curve: Index, rest: Array) -> float:
    """Correlation of neighbouring residuals, zero if it is not significant."""
    scale = np.sqrt(np.bincount(curve, rest**2) / np.maximum(np.bincount(curve), 1))
    z = rest / np.maximum(scale[curve], 1e-300)
    joined = curve[1:] == curve[:-1]
    r = float(np.sum((z[1:] * z[:-1])[joined]) / max(float(np.sum(z**2)), 1e-300))
    if r <= SIGNIFICANT / np.sqrt(z.size):
        return 0.0
    # level and place of each curve have been fitted, which hides some (M. G. Kendall, Biometrika 41 (1954) 403)
    points = float(np.mean(np.bincount(curve)[np.unique(curve)]))
    return min(r + 2 * (1 + 4 * r) / points, LONGEST)


def _smooth(curve: Index, x: Array, value: Array, lift: Array, repeated: float) -> tuple[Array, Array]:
    """Logarithm of the raised value on a smooth curve through all points (n,), and the share of its variance that each residual
    keeps. The knots are as dense as Akaike's criterion asks for, with so many `repeated` points counting for one.
    """
    good = value > 0
    target = np.log(np.where(good, value, 1.0)) + lift
    best: tuple[float, Array, Array] | None = None
    for spacing in _spacings(x, np.unique(curve).size):
        fitted, leverage, score = _spline(curve, x, target, good, spacing, repeated)
        if best is None or score < best[0]:
            best = score, fitted, leverage
    assert best is not None
    own = 1.0 / np.bincount(curve)[curve]  # what a curve's own shift takes out
    return best[1], np.clip(1 - repeated * (best[2] + own), 0.2, 1.0)


def _spacings(x: Array, curves: int) -> Iterator[float]:
    """Knot spacings in decades, wide to narrow, never fewer than about three points to an interval."""
    span = float(np.ptp(x))
    finest = max(0.15, 3 * span / max(x.size - curves, 1))
    spacing = max(min(1.6, span / 3), finest)
    while spacing >= finest * (1 - 1e-9):
        yield spacing
        spacing /= 1.4


def _spline(
    curve: Index, x: Array, target: Array, good: NDArray[np.bool_], spacing: float, repeated: float
) -> tuple[Array, Array, float]:
    """Values and leverages (n,) of a robust spline fit, and Akaike's criterion."""
    origin = float(x.min())
    size = int(np.ceil(float(np.ptp(x)) / spacing + 1e-9)) + 3
    index, basis, _ = spline_basis(x, origin, spacing, size)
    rows = index + np.arange(4)[:, None]
    trust, scale = good.astype(float), np.ones(x.size)
    for _ in range(ROUNDS):
        weight = trust / scale**2
        inverse = np.linalg.inv(gram(index, basis, weight, size) + roughness(size, spacing))
        coefficient = inverse @ np.bincount(rows.ravel(), (basis * weight * target).ravel(), minlength=size)
        fitted = np.sum(basis * coefficient[rows], axis=0)
        rest = np.abs(target - fitted)
        noise = np.zeros(int(curve[-1]) + 1)
        for k in np.unique(curve):
            noise[k] = 1.48 * np.median(rest[(curve == k) & good]) if np.any((curve == k) & good) else 1.0
        scale = np.maximum(noise[curve], max(0.2 * float(np.median(noise[np.unique(curve)])), 1e-9))
        trust = good * np.minimum(1.0, BEND * scale / np.maximum(rest, 1e-300))
    leverage = weight * np.einsum("an,abn,bn->n", basis, inverse[rows[:, None], rows[None]], basis)
    n, p = int(np.count_nonzero(good)) / repeated, float(np.sum(leverage))
    bounded = np.minimum((rest / scale) ** 2, 16.0)[good]
    score = float(np.sum(bounded) + 2 * np.sum(np.log(scale[good]))) / repeated + 2 * p * n / max(n - p - 1, 1)
    return fitted, np.clip(leverage, 0.0, 0.9), score
