"""Starting values for the shift factors: horizontal distances of curves at equal modulus, from one curve outwards."""

from itertools import pairwise
from typing import TypeAlias

import numpy as np

from dielast.base.errors import InputError
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Flags, Floats
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.binning import Binned

Monotone: TypeAlias = tuple[Floats, Floats]
"""Ascending levels of log modulus, and the log times at which a monotonic curve passes them."""

TOUCH = 0.02  # decades of modulus; a smaller gap counts as overlap, such as between two plateaus a few percent apart
JUMP = 0.3  # decades of modulus; a larger rise from one point to the next is an error of the instrument
LEVELS = 32  # number of moduli at which the distance of two curves is evaluated
NEIGHBOURS = 3  # number of placed curves with which a new one is compared
TRIAL_STEP = 0.05  # decades between trial shifts
LEAST_NOISE = 0.005  # decades; a match to 1 % is good
USUAL_OFFSET = 0.02  # decades; usual difference of two specimens
REFUTED = 12.0  # squared standard deviations at which a point counts as much against a shift as a matching point counts for it


def starting_shifts(temperature: Floats, data: Binned, anchor: int, kind: MeasurementKind) -> Floats:
    """log10 a of each curve, relative to the curve numbered `anchor`, from the distance of the curves at equal modulus.

    `temperature` (m,) in degC, ascending. The first channel of each curve is first made monotonic (isotonic regression), to be
    insensitive to noise and bumps. The distance is a median, to be insensitive to a bad section. Raises `InputError` if the curves
    fall into groups with no modulus in common.
    """
    falling, bottom, top, common = _falling(data)
    shift = np.zeros(temperature.size)
    placed = np.zeros(temperature.size, dtype=bool)
    placed[anchor] = True
    by_distance = np.argsort(np.abs(temperature - temperature[anchor]), kind="stable")
    while not np.all(placed):
        reachable = [int(k) for k in by_distance if not placed[k] and np.any(common[k, placed] > -TOUCH)]
        if not reachable:
            spans = pairwise(data.bounds)
            rising = np.array([_slope(data.log_time[a:b], data.log_modulus[0, a:b]) > 0 for a, b in spans])
            raise _no_overlap(temperature, bottom, top, common, placed, kind, rising)
        new = reachable[0]
        placed_overlapping = np.flatnonzero(placed & (common[new] > -TOUCH))
        nearest = placed_overlapping[
            np.argsort(np.abs(temperature[placed_overlapping] - temperature[new]), kind="stable")[:NEIGHBOURS]
        ]
        distances = [_distance(falling[new], falling[int(k)]) + shift[k] for k in nearest]
        weights = [np.full(d.size, max(float(common[new, k]), 1e-6) / d.size) for k, d in zip(nearest, distances, strict=True)]
        shift[new] = _weighted_median(np.concatenate(distances), np.concatenate(weights))
        placed[new] = True
    return shift


def steepest(binned: Binned) -> int:
    """The curve with the largest decrease: it is the fixed one, so that the others are not measured against a plateau."""
    falling = binned.log_modulus[0]
    return int(np.argmax([np.subtract(*np.percentile(falling[a:b], (90, 10))) for a, b in pairwise(binned.bounds)]))


def find_isolated(data: Binned, kind: MeasurementKind) -> dict[int, str]:
    """The numbers of single curves that share no modulus with any other, and the reason; empty if there are separate groups."""
    from scipy.sparse.csgraph import connected_components  # slow to load

    _, bottom, top, common = _falling(data)
    joined = common > -TOUCH
    alone = np.count_nonzero(joined, axis=1) == 1
    if not np.any(alone) or connected_components(joined[np.ix_(~alone, ~alone)])[0] != 1:
        return {}
    return {
        int(k): f"its {kind.stiffness}, {10 ** bottom[k]:.3g} to {10 ** top[k]:.3g} Pa, overlaps with that of no other curve: "
        f"measure {kind.more_overlap}, or at a temperature in between"
        for k in np.flatnonzero(alone)
    }


def _falling(data: Binned) -> tuple[list[Monotone], Floats, Floats, Floats]:
    """The monotonic fit to each curve, its lowest and highest level (m,), and the overlap (m, m) of any two curves in decades."""
    falling = [_monotone(data.log_time[a:b], _without_jumps(data.log_modulus[0, a:b])) for a, b in pairwise(data.bounds)]
    bottom, top = np.array([(level[0], level[-1]) for level, _ in falling]).T
    return falling, bottom, top, np.minimum(top[:, None], top) - np.maximum(bottom[:, None], bottom)


def _without_jumps(y: Floats) -> Floats:
    """The curve with single points that cause a large rise replaced by a median of three."""
    if y.size < 3:
        return y
    neighbours = np.stack((y[:-2], y[1:-1], y[2:]))
    middle = np.median(neighbours, axis=0)
    middle = np.concatenate((middle[:1], middle, middle[-1:]))
    rises = np.concatenate(([False], np.diff(y) > JUMP)) | np.concatenate((np.diff(y) > JUMP, [False]))
    return np.where(rises, middle, y)


def _monotone(x: Floats, y: Floats) -> Monotone:
    """The best monotonic (falling) fit to a curve; the log time of a level is the mean of those of its points."""
    from scipy.optimize import isotonic_regression  # slow to load

    levels, level = np.unique(isotonic_regression(y, increasing=False).x, return_inverse=True)
    return levels, np.bincount(level, x) / np.bincount(level)


def _distance(curve: Monotone, other: Monotone) -> Floats:
    """Log time of `curve` minus that of `other` at equal modulus, at evenly spaced levels, so that steep sections count most."""
    low, high = max(curve[0][0], other[0][0]), min(curve[0][-1], other[0][-1])
    levels = np.linspace(low, high, LEVELS + 2)[1:-1] if high > low else np.array([(low + high) / 2])
    return np.interp(levels, *curve) - np.interp(levels, *other)


def _weighted_median(value: Floats, weight: Floats) -> float:
    order = np.argsort(value, kind="stable")
    half = np.cumsum(weight[order]) - weight[order] / 2
    return float(np.interp(0.5 * np.sum(weight), half, value[order]))


def _slope(x: Floats, y: Floats) -> float:
    """Of the straight line through the points, times a positive number."""
    return float(np.sum((x - np.mean(x)) * y))


def _no_overlap(
    temperature: Floats, bottom: Floats, top: Floats, common: Floats, placed: Flags, kind: MeasurementKind, rising: Flags
) -> InputError:
    """The error that names the two curves, one of them already placed, that are closest in modulus; or the curves that are no
    decays, `rising` (m,), if these are most of them.
    """
    if 2 * np.count_nonzero(rising) > rising.size:
        along, falls = ("frequency", "falls") if kind.over_frequency else ("time", "rises")
        places = ", ".join(f"{value:g}" for value in temperature[rising])
        return InputError(
            f"at {places} degC the {kind.stiffness} {falls} with {along}, which no {kind.stiffness} does: "
            "are columns mixed up, or is it another quantity?"
        )
    inside, outside = np.flatnonzero(placed), np.flatnonzero(~placed)
    neighbours = np.unravel_index(np.argmax(common[np.ix_(inside, outside)]), (inside.size, outside.size))
    pair = sorted((int(inside[neighbours[0]]), int(outside[neighbours[1]])))
    both = " and ".join(f"{temperature[k]:g} degC ({kind.stiffness} {10 ** bottom[k]:.3g} to {10 ** top[k]:.3g} Pa)" for k in pair)
    return InputError(f"no overlap between {both}: measure {kind.more_overlap}, or at a temperature in between")


def matching_shifts(data: Binned, anchor: int) -> Floats:
    """log10 a of each sweep, relative to the one numbered `anchor`, from the best match of both moduli with a neighbour.

    Trial shifts of a curve are compared with the next curve towards the anchor: points that both moduli of
    the neighbour predict count for a shift, others against it; an offset common to both moduli costs little. This works for a level
    storage modulus, and for a loss modulus that rises and falls, which have no distance at equal modulus.
    """
    parts = [(data.log_time[a:b], data.log_modulus[:, a:b]) for a, b in pairwise(data.bounds)]
    shift = np.zeros(len(parts))
    for outwards in (range(anchor - 1, -1, -1), range(anchor + 1, len(parts))):
        last = anchor
        for k in outwards:
            shift[k] = shift[last] + _best_match(parts[k], parts[last], 1 if k < last else -1)
            last = k
    return shift


def _best_match(curve: tuple[Floats, Floats], other: tuple[Floats, Floats], sign: int) -> float:
    """log10 a of `curve` relative to `other`, with the given `sign`, or zero."""
    (x, y), (other_x, values) = curve, other
    variance = np.array([max(_noise(channel), _noise(theirs), LEAST_NOISE) ** 2 for channel, theirs in zip(y, values, strict=True)])
    width = float(max(x[-1] - other_x[0], other_x[-1] - x[0]))
    least, best = np.inf, 0.0
    for shift in sign * np.arange(0.0, max(width, TRIAL_STEP), TRIAL_STEP):
        shifted = x - shift
        inside = (shifted >= other_x[0]) & (shifted <= other_x[-1])
        if np.count_nonzero(inside) < 2:
            break
        difference = np.array(
            [row[inside] - np.interp(shifted[inside], other_x, theirs) for row, theirs in zip(y, values, strict=True)]
        )
        weight = 1 / variance[:, None]
        level = float(np.sum(weight * difference) / (np.sum(weight * np.ones_like(difference)) + USUAL_OFFSET**-2))
        score = float(np.sum(np.minimum((difference - level) ** 2 * weight, REFUTED)) + (level / USUAL_OFFSET) ** 2)
        score -= REFUTED / 2 * difference.size
        if score < least:
            least, best = score, float(shift)
    return best


def _noise(y: Floats) -> float:
    """Standard deviation of the noise, from the distance of each point from the line through its neighbours."""
    if y.size < 4:
        return LEAST_NOISE
    return robust_deviation(y[2:] - 2 * y[1:-1] + y[:-2]) / float(np.sqrt(6.0))
