"""Intervals of drawn values, and how many draws they need."""

from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError
from dielast.numerics.arrays import Floats, Index


def fewest_draws(level: float) -> int:
    """The smallest number of draws whose extremes are the bounds of an interval of this `level`."""
    if not 0 < level < 1:
        raise InputError(f"{level:g}: a probability above 0 and below 1 is needed, such as 0.9", argument="level")
    return int(np.ceil(2 / (1 - level) - 1 - 1e-9))


def interval(values: Floats, level: float, laws: Index | None = None) -> tuple[Floats, Floats]:
    """Lower and upper bound (...) of an interval that covers a further draw with probability `level`, from `values` (draws, ...).

    The bounds, in the unit of the values, are order statistics without interpolation, so that infinite values (events that have
    not happened) are allowed. NaN does not count as a draw; with too few draws the bounds are NaN. Raises `InputError` for a level
    that is not between 0 and 1.

    Where the draws are of several `laws` (draws,), by number, that tests cannot tell apart, or of a law in several parts of the
    range of its undetermined constants, the interval is from the least lower to the largest upper bound of those of each: it covers
    a draw with this probability whichever of them holds, as no probability of a law is known where none was tested (Walley,
    Statistical Reasoning with Imprecise Probabilities, 1991). A law with too few draws of its own has its least and largest draw
    as bounds.
    """
    fewest_draws(level)
    values = np.asarray(values, dtype=float)
    if not (values.ndim and len(values)):
        raise InputError("at least one draw is needed", argument="values")
    low, high = _ordered(values, level)
    if laws is None:
        return low, high
    laws = np.asarray(laws)
    if laws.shape != values.shape[:1]:
        raise InputError(f"one law for each of {len(values)} draws is needed, not the shape {laws.shape}", argument="laws")
    lows, highs = zip(*(_ordered(values[laws == law], level, few=True) for law in np.unique(laws)), strict=True)
    enough = ~np.isnan(low)
    return np.where(enough, np.fmin.reduce(lows), np.nan), np.where(enough, np.fmax.reduce(highs), np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class DrawIntervals:
    """The intervals that are asked for: their `level`, the `laws` (draws,) of the draws as for an `interval`, and the `confidence`,
    above 0.5, of assured lives, None without them.
    """

    level: float
    laws: Index | None = None
    confidence: float | None = None

    def of(self, values: Floats) -> tuple[Floats, Floats]:
        """Lower and upper bound (...) from `values` (draws, ...)."""
        return interval(values, self.level, self.laws)

    def assured(self, lives: Floats) -> Floats | None:
        """The life (...) that a further draw exceeds with the confidence, from `lives` (draws, ...); NaN for too few draws."""
        return None if self.confidence is None else interval(lives, 2 * self.confidence - 1, self.laws)[0]


def _ordered(values: Floats, level: float, few: bool = False) -> tuple[Floats, Floats]:
    """The bounds (...) of an `interval` from draws of one law; those of too `few` are the least and the largest, instead of NaN."""
    ordered = np.sort(values, axis=0)  # NaN last
    count = np.sum(~np.isnan(values), axis=0)
    tail = 0.5 * (1 - level) * (count + 1)
    first = np.floor(tail + 1e-9).astype(int) - 1
    enough = (first >= 0) | (few & (count > 0))
    first = np.maximum(first, 0)
    low = np.take_along_axis(ordered, first[None], axis=0)[0]
    high = np.take_along_axis(ordered, np.maximum(count - 1 - first, 0)[None], axis=0)[0]
    return np.where(enough, low, np.nan), np.where(enough, high, np.nan)
