"""Default bounds of the parameters of a calibration, each with words for it."""

from collections.abc import Sequence

import numpy as np

from dielast.base.errors import InputError

WIDE = 100.0  # default bounds of a positive number, as a factor on either side of the start
SIGNED = 3.0  # default bounds of a number of either sign, in scales on either side of the start
BELOW, ABOVE = f"start/{WIDE:g}", f"{WIDE:g} times start"

Bound = tuple[float, str]
"""A bound in SI, and what it is by default in words; "" if it was stated."""


def bounds_about(start: float, scale: float | None) -> tuple[Bound, Bound]:
    """The default bounds of a number of either sign with a `scale`, or of a positive number if the scale is None."""
    if scale is None:
        return (start / WIDE, BELOW), (start * WIDE, ABOVE)
    spread = SIGNED * scale
    return (start - spread, f"start - {spread:.4g}"), (start + spread, f"start + {spread:.4g}")


def bounds_between(starts: Sequence[float], values: Sequence[float], k: int, path: str) -> tuple[Bound, Bound]:
    """The default bounds of a relaxation time, half-way in log time from its start to those of the neighbouring branches.

    Branches that could change places would have profiles with two minima, and draws of both, for one and the same material. Raises
    `InputError` with the key `path` unless the starts are positive, different, and in the order of size of the material's `values`.
    """
    in_order = np.array_equal(np.argsort(starts, kind="stable"), np.argsort(values, kind="stable"))
    if min(starts) <= 0 or len(set(starts)) < len(starts) or not in_order:
        needed = (
            "positive starts of the relaxation times, in the order of size of those in the material, are needed, or min and max"
        )
        raise InputError(needed, key=path)
    log = np.log(starts)
    order = np.argsort(log).tolist()
    place = order.index(k)

    def half_way_to(other: int, outermost: Bound) -> Bound:
        if not 0 <= other < len(starts):
            return outermost
        nearest = order[other]
        return float(np.exp(0.5 * (log[k] + log[nearest]))), f"half-way to relaxation_time[{nearest}] in log time"

    lowest, highest = (float(np.exp(log[k] + sign * np.log(WIDE))) for sign in (-1, 1))
    return half_way_to(place - 1, (lowest, BELOW)), half_way_to(place + 1, (highest, ABOVE))


def bounds_apart(starts: Sequence[float], k: int, scale: float, path: str) -> tuple[Bound, Bound]:
    """The default bounds of the exponent of a term, half-way from its start to those of the terms next to it in size.

    Terms that could change places would be one and the same law. Raises `InputError` with the key `path` for equal starts.
    """
    start, others = starts[k], [(each, j) for j, each in enumerate(starts) if j != k]
    for same in [j for each, j in others if each == start][:1]:
        raise InputError(f"start = {start:g} is also that of alpha[{same}]: a different start is needed, or min and max", key=path)
    (lowest, below), (highest, above) = bounds_about(start, scale)
    low = max((pair for pair in others if pair[0] < start), default=None)
    high = min((pair for pair in others if pair[0] > start), default=None)
    return (
        (lowest, below) if low is None else (0.5 * (start + low[0]), f"half-way to alpha[{low[1]}]"),
        (highest, above) if high is None else (0.5 * (start + high[0]), f"half-way to alpha[{high[1]}]"),
    )
