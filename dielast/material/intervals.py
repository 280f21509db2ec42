"""Intervals of drawn values, how many draws they need, and strata of draws: parts of the ranges of constants that tests do not
determine.

Of where such a constant lies in its range nothing is known, not even a probability (Walley, Statistical Reasoning with Imprecise
Probabilities, 1991). Each range is divided into parts with equally many draws, and a stratum is a part of each (Cochran,
Sampling Techniques, 1977, Ch. 5). Strata have about as many draws each if the constants are independent; where they are correlated,
some hold few, whose least and largest values are then the bounds. An interval is to hold that of the draws in every stratum: it
then covers whichever part the constants lie in, and not only on average over their ranges. A few hundred draws divide the ranges of
the first few.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError
from dielast.material.material import Material, Numbers, numbers_of
from dielast.numerics.arrays import Floats, Index

# Choices: a stratum has bounds from as few draws, and a range no more parts.
FEWEST_DRAWS, MOST_PARTS = 12, 4


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


def division(draws: int, constants: int) -> tuple[int, int]:
    """How many of the `constants` so many `draws` divide, and into how many parts each."""
    most = draws // FEWEST_DRAWS
    divided = min(constants, int(np.log2(max(most, 1))))
    return divided, 1 if divided == 0 else min(MOST_PARTS, int(most ** (1 / divided) + 1e-9))


def strata_of(values: Floats) -> Index:
    """The number (draws,) of the stratum of each draw, from the `values` (draws, constants) of the constants, those first that are
    divided first.

    Parts have equally many draws, as far as draws of equal values, which share a part, allow, and no part of a range has fewer
    than `FEWEST_DRAWS`. A constant that has one value in all draws has no range to be divided.
    """
    draws = len(values)
    varied = [column for column in values.T if draws and np.min(column) < np.max(column)]
    divided, parts = division(draws, len(varied))
    number = np.zeros(draws, dtype=np.intp)
    for column in varied[:divided]:
        _, which, count = np.unique(column, return_inverse=True, return_counts=True)
        middle = np.cumsum(count) - (count + 1) / 2  # the mean rank of the draws of each value
        number = number * parts + _filled(np.floor(middle * parts / draws).astype(np.intp)[which], parts)
    return number


def _filled(part: Index, parts: int) -> Index:
    """The parts (draws,) of a range; one with too few draws, as others have the same value, is joined to the next one, and the last
    one to the one before.
    """
    edges, held = [0], np.bincount(part, minlength=parts)
    for last in range(1, parts):
        if held[edges[-1] : last].sum() >= FEWEST_DRAWS:
            edges.append(last)
    if len(edges) > 1 and held[edges[-1] :].sum() < FEWEST_DRAWS:
        edges.pop()
    return np.asarray(np.searchsorted(edges, part, side="right") - 1)


def strata_of_materials(materials: Sequence[Material], paths: Sequence[str]) -> Index:
    """The stratum (draws,) of draws with the same laws, by their constants at `paths` in a material file; paths of constants that
    the laws do not have are left out.
    """
    every = [numbers_of(material) for material in materials]
    columns = [values for path in paths if None not in (values := [_value(numbers, path) for numbers in every])]
    return strata_of(np.array(columns, dtype=float).reshape(len(columns), len(every)).T)


def _value(numbers: Numbers, path: str) -> float | None:
    """The constant at a path such as equilibrium.J_lim or nonequilibrium.relaxation_time[0], None if there is none."""
    section, _, rest = path.partition(".")
    key, _, place = rest.partition("[")
    value = numbers.get(section, {}).get(key)
    if not place or value is None:
        return None if isinstance(value, list) else value
    index = int(place.rstrip("]") or -1) if place.rstrip("]").isdecimal() else -1
    return value[index] if isinstance(value, list) and 0 <= index < len(value) else None
