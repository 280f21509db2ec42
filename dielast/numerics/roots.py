"""The first zero within a step of signals that are positive at its start, many signals at once."""

from collections.abc import Callable

import numpy as np

from dielast.numerics.arrays import Floats

OfFraction = Callable[[Floats], Floats]
"""A signal (k,) as a function of the fractions (k,) of steps."""

CLOSE = 0.05  # the minimum of a dip is located if a parabola expects it below this value
INSIDE = np.array((0.25, 0.5, 0.75))  # fractions of the step at which signals are sampled
DIP, GOLDEN = 24, 0.6180339887498949  # number and ratio of the golden sections that locate a minimum
FALLS, ROOT = 60, 1e-13  # largest number of iterations, and accuracy of a root as a fraction of the step


def samples(signal: OfFraction, last: Floats, value: Floats) -> tuple[Floats, Floats]:
    """Samples (5, k) of signals over a step, and the fractions (5, k) of the step at which they are taken.

    `last` and `value` (k,) are the signals at the start and the end of the step. The lowest of the three inner samples is replaced
    by the minimum of its dip where this minimum comes close to zero.
    """
    values = np.stack((last, *(signal(np.full(last.size, at)) for at in INSIDE), value))
    fractions = np.repeat(np.concatenate(([0.0], INSIDE, [1.0]))[:, None], last.size, axis=1)
    every = np.arange(values.shape[1])
    lowest = np.argmin(values, axis=0)
    inner = np.clip(lowest, 1, len(values) - 2)
    before, middle, after = (values[inner + shift, every] for shift in (-1, 0, 1))
    curvature = before - 2 * middle + after
    bottom = middle - np.square(after - before) / (8 * np.where(curvature > 0, curvature, 1.0))
    dipping = (middle > 0) & (np.abs(after - before) < 2 * curvature) & (bottom < CLOSE)
    if not dipping.any():
        return values, fractions
    left, right = fractions[inner - 1, every], fractions[inner + 1, every]
    for _ in range(DIP):
        first, second = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        lower = signal(first) < signal(second)
        left, right = np.where(lower, left, first), np.where(lower, second, right)
    at = 0.5 * (left + right)
    minimum = signal(at)
    better = dipping & (minimum < middle)
    values[inner[better], every[better]] = minimum[better]
    fractions[inner[better], every[better]] = at[better]
    return values, fractions


def fall(signal: OfFraction, low: Floats, high: Floats) -> Floats:
    """Zeros (k,) of signals between `low` (k,), where they are positive, and `high` (k,), where they are not.

    Chandrupatla's method, independently in each column: T. R. Chandrupatla, Adv. Eng. Software 28 (1997) 145,
    DOI 10.1016/S0965-9978(96)00051-8.
    """
    a, b = high.copy(), low.copy()
    fa, fb = signal(a), signal(b)
    c, fc = a.copy(), fa.copy()
    t = np.full_like(a, 0.5)
    done = np.zeros(a.shape, dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(FALLS):
            x = np.where(done, a, a + t * (b - a))
            fx = signal(x)
            same = (fx > 0) == (fa > 0)
            c, fc = np.where(same, a, b), np.where(same, fa, fb)
            b, fb = np.where(same, b, a), np.where(same, fb, fa)
            a, fa = x, fx
            best = np.where(np.abs(fa) < np.abs(fb), a, b)
            width = np.abs(b - a)
            margin = 0.5 * ROOT / np.where(width > 0, width, 1.0)
            done = done | (width <= ROOT) | (fa == 0)
            if done.all():
                break
            share, rise = (a - b) / (c - b), (fa - fb) / (fc - fb)
            inverse = (fa / (fb - fa)) * (fc / (fb - fc)) + ((c - a) / (b - a)) * (fa / (fc - fa)) * (fb / (fc - fb))
            quadratic = (rise**2 < share) & ((1 - rise) ** 2 < 1 - share) & np.isfinite(inverse)
            t = np.clip(np.where(quadratic, inverse, 0.5), margin, 1 - margin)
    return np.where(fa == 0, a, best)
