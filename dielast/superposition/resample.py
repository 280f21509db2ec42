"""New tests with different noise, as they might have been measured.

Every measured quantity, shifted by the fitted factors, lies on a smooth curve. New tests are that curve plus the residuals times
random signs, a wild bootstrap (C. F. J. Wu, Ann. Stat. 14 (1986) 1261, DOI 10.1214/aos/1176350142): a residual stays at its
abscissa, so that noise may differ between curves and along a curve. If neighbouring residuals are correlated, they are replaced by
new noise with their local size and correlation. The mean residual of each curve is resampled separately, because specimens differ;
with a stated drift, it is replaced by a random walk. Added to either is an offset as the shift factor of a curve may contain.
Curves are tilted by the estimated spread of tilts, and every temperature has an error with its stated standard error, which shifts
its curve along time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.material.measurement import Measurement
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.superposition.binning import windows
from dielast.superposition.points import along_curve, neighbour_correlation
from dielast.superposition.result import MasterCurve
from dielast.superposition.spline import SplineProblem, spacing_bounds

SPACING_RATIO = 1.4  # ratio of successive knot spacings
ROUNDS = 4  # of reweighting outliers
BEND = 2.5  # standard deviations beyond which the weight of a residual is reduced
PASSES = 3  # of estimating the correlation of residuals
NEIGHBOURHOOD = 5  # points on either side whose noise is pooled, if neighbours are correlated
LARGEST_CORRELATION = 0.9  # of neighbours
SIGNIFICANT = 3.0  # standard errors of the correlation of neighbours


@dataclass(frozen=True, slots=True, eq=False)
class _Channel:
    """One ordinate of all points (n,): `fitted` values, relative residuals `rest` minus the `mean` (m,) of their measurement, and
    the `correlation` of neighbours.
    """

    fitted: Floats
    rest: Floats
    mean: Floats
    correlation: float


@dataclass(frozen=True, slots=True, eq=False)
class Resampled:
    """The `measurements` (m of them), their channels as fitted with the shift factors of `master`, and their points (n,).

    Points are sorted by measurement, `owner`, then abscissa; `order` are their original indices. `along` is the position of a point
    along its curve, from -1/2 at the shortest to 1/2 at the longest times. `temperature` (m,) is the index of a measurement's
    temperature in `master`.
    """

    measurements: tuple[Measurement, ...]
    master: MasterCurve
    temperature: Index
    owner: Index
    order: Index
    along: Floats
    channels: tuple[_Channel, ...]

    @classmethod
    def of(cls, curves: Sequence[Measurement], master: MasterCurve) -> Self:
        """Fit every channel of `curves` with the shift factors of `master`, over the reduced abscissa."""
        kind, m = master.kind, len(curves)
        at = np.array([int(np.argmin(np.abs(master.temperature - curve.temperature))) for curve in curves])
        owner = np.repeat(np.arange(m), [curve.columns.shape[1] for curve in curves])
        columns = np.concatenate([curve.columns for curve in curves], axis=1)
        order = np.lexsort((columns[0], owner))
        abscissa, *ordinates = columns[:, order]
        shift = np.where(np.isfinite(master.log10_shift_factor), master.log10_shift_factor, master.log10_shift_factor_fit)[at]
        placed = np.isfinite(shift)
        x = np.log10(abscissa) - kind.time_power * np.where(placed, shift, 0.0)[owner]
        lift = kind.stiffness_power * np.log(master.vertical_shift)[at][owner]
        group = np.where(placed, 0, np.arange(m) + 1)[owner]  # curves without a shift are fitted separately
        along = kind.time_power * along_curve(owner, x, m)
        channels = tuple(_fit_channel(owner, group, x, values, lift, m) for values in ordinates)
        return cls(tuple(curves), master, at, owner, order, along, channels)

    def draw(self, random: np.random.Generator) -> list[Measurement]:
        """New measurements, with the abscissas and types of the originals."""
        at, master, stated, kind = self.temperature, self.master, self.master.stated, self.master.kind
        temperatures, raised = master.temperature.size, None
        if stated.drift > 0:
            # a random walk over the temperatures, in the order in which they were first measured
            listed = np.array(list(dict.fromkeys(at.tolist())))
            walked = np.empty(temperatures)
            walked[listed] = np.cumsum(stated.drift * random.standard_normal(listed.size))
            raised = kind.stiffness_power * walked[at]
        hidden = kind.stiffness_power * np.log(10) * (master.offset_in_shift * random.standard_normal(temperatures))[at]
        tilted = kind.stiffness_power * np.log(10) * master.tilt_spread * random.standard_normal(temperatures)[at]
        shift = master.log10_shift_factor_slope * stated.temperature_stderr * random.standard_normal(temperatures)
        columns = np.concatenate([curve.columns for curve in self.measurements], axis=1)
        columns[0] *= 10 ** (kind.time_power * shift[at])[self.owner]
        for row, channel in enumerate(self.channels, start=1):
            # the tilt of tan delta, on which curves are shifted, is that of the loss modulus
            level = row < len(self.channels) and master.shifted_on == "tan-delta"
            columns[row, self.order] = self._values(channel, random, raised, hidden, np.zeros(at.size) if level else tilted)
        ends = np.cumsum(np.bincount(self.owner, minlength=at.size))[:-1]
        return [curve.with_columns(part) for curve, part in zip(self.measurements, np.split(columns, ends, axis=1), strict=True)]

    def _values(
        self, channel: _Channel, random: np.random.Generator, raised: Floats | None, hidden: Floats, tilted: Floats
    ) -> Floats:
        """New values (n,) of curves with offsets `raised` and `hidden` (m,) and tilts `tilted` (m,) from end to end, as ln.

        If `raised` is None, these offsets have the size of the mean residuals of the curves.
        """
        owner, m, correlation = self.owner, channel.mean.size, channel.correlation
        normal, offset = random.standard_normal(owner.size), random.standard_normal(m)
        if raised is None:  # the mean of the new noise is part of the offset
            count = np.maximum(np.bincount(owner, minlength=m), 1)
            repeated = (1 + correlation) / (1 - correlation)
            noise = np.sqrt(np.bincount(owner, channel.rest**2, minlength=m) * repeated) / count
            raised = offset * np.sqrt(np.maximum(channel.mean**2 - noise**2, 0.0))
        raised = raised + hidden
        if correlation == 0:
            # random signs keep the size of every residual, and so the outliers
            level = raised[owner] + tilted[owner] * self.along
            return np.asarray(channel.fitted * (np.exp(level) + channel.rest * np.sign(normal)))
        innovation = np.sqrt(1 - correlation**2)
        for k in np.flatnonzero(np.diff(owner) == 0) + 1:
            normal[k] = correlation * normal[k - 1] + innovation * normal[k]
        low, high = windows(owner, NEIGHBOURHOOD)
        total = np.concatenate(([0.0], np.cumsum(channel.rest**2)))
        size = np.sqrt((total[high] - total[low]) / (high - low))
        # correlated noise already includes tilts
        return np.asarray(channel.fitted * (np.exp(raised[owner]) + size * normal))


def _fit_channel(owner: Index, group: Index, x: Floats, values: Floats, lift: Floats, m: int) -> _Channel:
    """The smooth curve through one ordinate of all points, shifted up by `lift`; each `group` of points has its curve."""
    fitted, spare, correlation = np.empty(x.size), np.empty(x.size), 0.0
    count = np.maximum(np.bincount(owner, minlength=m), 1)
    for _ in range(PASSES):
        for selected in (group == g for g in np.unique(group)):
            repeated = (1 + correlation) / (1 - correlation)
            smooth, spare[selected] = _smooth(owner[selected], x[selected], values[selected], lift[selected], repeated)
            fitted[selected] = np.exp(smooth - lift[selected])
        relative = values / fitted - 1
        mean = np.bincount(owner, relative, minlength=m) / count
        rest = (relative - mean[owner]) / np.sqrt(spare)
        correlation = _neighbours(owner, rest)
        if correlation == 0:
            break
    return _Channel(fitted, rest, mean, correlation)


def _neighbours(owner: Index, rest: Floats) -> float:
    """Correlation of neighbouring residuals, 0 if it is not significant."""
    scale = np.sqrt(np.bincount(owner, rest**2) / np.maximum(np.bincount(owner), 1))
    r = neighbour_correlation(owner, rest / np.maximum(scale[owner], 1e-300))
    if r <= SIGNIFICANT / np.sqrt(rest.size):
        return 0.0
    # correct the bias due to the fitted level and shift of each curve (M. G. Kendall, Biometrika 41 (1954) 403)
    points = float(np.mean(np.bincount(owner)[np.unique(owner)]))
    return min(r + 2 * (1 + 4 * r) / points, LARGEST_CORRELATION)


def _smooth(owner: Index, x: Floats, values: Floats, lift: Floats, repeated: float) -> tuple[Floats, Floats]:
    """Logarithm of the shifted values on a smooth curve through all points (n,), and the share of its variance that each residual
    retains after the fit. Akaike's criterion selects the knot spacing; `repeated` correlated points count as one independent point.
    """
    good = values > 0
    target = np.log(np.where(good, values, 1.0)) + lift
    widest, finest = spacing_bounds(float(np.ptp(x)), x.size - np.unique(owner).size)
    spacings = widest / SPACING_RATIO ** np.arange(1 + int(np.log(widest / finest) / np.log(SPACING_RATIO) + 1e-9))
    trials = (_robust(owner, x, target, good, spacing, repeated) for spacing in spacings.tolist())
    fitted, leverage, _ = min(trials, key=lambda trial: trial[2])
    shifted = 1.0 / np.bincount(owner)[owner]  # degree of freedom of the shift of a curve
    return fitted, np.clip(1 - repeated * (leverage + shifted), 0.2, 1.0)


def _robust(owner: Index, x: Floats, target: Floats, good: Flags, spacing: float, repeated: float) -> tuple[Floats, Floats, float]:
    """Values and leverages (n,) of a robust spline fit, with separate noise for each curve, and Akaike's criterion."""
    problem = SplineProblem.of(x, spacing)
    trust, scale = good.astype(float), np.ones(x.size)
    for _ in range(ROUNDS):
        weight = trust / scale**2
        inverse, _, fitted = problem.fit(weight, target)
        residual = np.abs(target - fitted)
        noise = np.zeros(int(owner[-1]) + 1)
        for k in np.unique(owner):
            selected = (owner == k) & good
            noise[k] = 1.48 * np.median(residual[selected]) if np.any(selected) else 1.0
        scale = np.maximum(noise[owner], max(0.2 * float(np.median(noise[np.unique(owner)])), 1e-9))
        trust = good * np.minimum(1.0, BEND * scale / np.maximum(residual, 1e-300))
    leverage = weight * problem.leverage(inverse)
    n, p = int(np.count_nonzero(good)) / repeated, float(np.sum(leverage))
    bounded = np.minimum((residual / scale) ** 2, 16.0)[good]
    score = float(np.sum(bounded) + 2 * np.sum(np.log(scale[good]))) / repeated + 2 * p * n / max(n - p - 1, 1)
    return fitted, np.clip(leverage, 0.0, 0.9), score
