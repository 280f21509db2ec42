"""Starting values for the shift factors: the horizontal distance of curves at equal modulus, outwards from one of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.gather import MeasurementName
from dielast.errors import InputError

Array = NDArray[np.float64]
Index = NDArray[np.intp]

TOUCH = 0.02  # decades of modulus that a gap may measure and still count as touching: two plateaus a few percent apart
JUMP = 0.3  # decades of modulus by which one point must exceed the point before to be a slip of the instrument
LEVELS = 32  # moduli at which the distance of two curves is taken
NEIGHBOURS = 3  # placed curves that a new one is compared with
SAID: dict[MeasurementName, tuple[str, str]] = {
    "relaxation": ("modulus", "longer"),
    "creep": ("inverse compliance", "longer"),
    "oscillation": ("storage modulus", "over more frequencies"),
}


def starting_shifts(
    temperature: Array, curve: Index, log_time: Array, log_modulus: Array, anchor: int, measurement: MeasurementName = "relaxation"
) -> Array:
    """log10 a of each curve, relative to the curve numbered `anchor`, from the distance of the curves at equal modulus.

    `temperature` (m,) in degC, ascending; the points (n,) are sorted by curve, then time. Each curve is first made to fall
    monotonically (isotonic regression), so that noise and bumps do no harm, and the distance is a median, so that a bad
    stretch does none either. Raises `InputError` if the curves fall into groups with no modulus in common.
    """
    bounds = np.searchsorted(curve, np.arange(temperature.size + 1))
    falling = [_monotone(log_time[a:b], _without_jumps(log_modulus[a:b])) for a, b in pairwise(bounds)]
    bottom = np.array([level[0] for level, _ in falling])
    top = np.array([level[-1] for level, _ in falling])
    shift = np.zeros(temperature.size)
    placed = np.zeros(temperature.size, dtype=bool)
    placed[anchor] = True
    common = np.minimum(top[:, None], top) - np.maximum(bottom[:, None], bottom)
    by_distance = np.argsort(np.abs(temperature - temperature[anchor]), kind="stable")
    while not np.all(placed):
        reachable = [int(k) for k in by_distance if not placed[k] and np.any(common[k, placed] > -TOUCH)]
        if not reachable:
            raise _no_overlap(temperature, bottom, top, common, placed, measurement)
        new = reachable[0]
        known = np.flatnonzero(placed & (common[new] > -TOUCH))
        nearest = known[np.argsort(np.abs(temperature[known] - temperature[new]), kind="stable")[:NEIGHBOURS]]
        distances = [_distance(falling[new], falling[int(k)]) + shift[k] for k in nearest]
        weights = [np.full(d.size, max(float(common[new, k]), 1e-6) / d.size) for k, d in zip(nearest, distances, strict=True)]
        shift[new] = _weighted_median(np.concatenate(distances), np.concatenate(weights))
        placed[new] = True
    return shift


def _without_jumps(y: Array) -> Array:
    """The curve without single points that make it rise as no relaxation does: a median of three in their place."""
    if y.size < 3:
        return y
    near = np.stack((y[:-2], y[1:-1], y[2:]))
    middle = np.median(near, axis=0)
    middle = np.concatenate((middle[:1], middle, middle[-1:]))
    rises = np.concatenate(([False], np.diff(y) > JUMP)) | np.concatenate((np.diff(y) > JUMP, [False]))
    return np.where(rises, middle, y)


def _monotone(x: Array, y: Array) -> tuple[Array, Array]:
    """Ascending levels and the log times at which the best falling fit to the curve passes them (pool adjacent violators)."""
    blocks: list[tuple[float, float, int]] = []  # mean y, mean x, count
    for here, value in zip(x.tolist(), y.tolist(), strict=True):
        level, centre, count = value, here, 1
        while blocks and blocks[-1][0] <= level:
            other, middle, many = blocks.pop()
            level = (level * count + other * many) / (count + many)
            centre = (centre * count + middle * many) / (count + many)
            count += many
        blocks.append((level, centre, count))
    table = np.array(blocks[::-1])
    return table[:, 0], table[:, 1]


def _distance(curve: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Log time of `curve` less that of `other` at equal modulus, at evenly spaced levels: steep stretches count for more."""
    low, high = max(curve[0][0], other[0][0]), min(curve[0][-1], other[0][-1])
    levels = np.linspace(low, high, LEVELS + 2)[1:-1] if high > low else np.array([(low + high) / 2])
    return np.interp(levels, *curve) - np.interp(levels, *other)


def _weighted_median(value: Array, weight: Array) -> float:
    order = np.argsort(value, kind="stable")
    half = np.cumsum(weight[order]) - weight[order] / 2
    return float(np.interp(0.5 * np.sum(weight), half, value[order]))


def _no_overlap(
    temperature: Array, bottom: Array, top: Array, common: Array, placed: NDArray[np.bool_], measurement: MeasurementName
) -> InputError:
    inside, outside = np.flatnonzero(placed), np.flatnonzero(~placed)
    near = np.unravel_index(np.argmax(common[np.ix_(inside, outside)]), (inside.size, outside.size))
    pair = sorted((int(inside[near[0]]), int(outside[near[1]])))
    what, more = SAID[measurement]
    said = " and ".join(f"{temperature[k]:g} degC ({what} {10 ** bottom[k]:.3g} to {10 ** top[k]:.3g} Pa)" for k in pair)
    return InputError(f"no overlap between {said}: measure {more}, or at a temperature in between")
