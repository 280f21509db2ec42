"""A ramp that is left in tests over time: what it does to all curves at one time, whatever their temperature.

The stress of a ramp of duration T is T times the mean modulus over the ages of its parts: it rises up to T, and later is that of a
step at T/2, to second order in T/t (L. J. Zapas and J. C. Phillips, J. Res. Natl. Bur. Stand. A 75 (1971) 33). Divided by the
strain of the moment it does not rise, but all curves bend at T, so that they do not superpose unless time counts from T/2.

Two processes with different laws do not superpose either, and a shift of the times may explain some of this. A ramp differs from
them in two ways. All curves bend at one time, and less and less after it, as T/t, so that the misfit is largest at the beginning of
the curves; two processes take turns at a reduced time, anywhere on the curves. And a ramp explains all of the misfit: what remains
is within noise, or no more than by the nearest duration that was tried.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from dielast.base.errors import InputError, NumericsError, warn, without_warnings
from dielast.numerics.arrays import Floats
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.binning import Binned
from dielast.relaxation.superposition.gather import MIN_BINS, Gathered
from dielast.relaxation.superposition.joint_fit import MasterFit, best_fit
from dielast.relaxation.superposition.points import FitPoints

SIGNIFICANT = 4.0  # standard errors of a significant rise
DURATIONS = 2**0.5  # ratio of successive durations that are tried
DROPPED = 2.0  # durations before which no step stands for a ramp
EXPLAINED = 0.5  # share of the square of the misfit that a ramp must explain to be named: a choice
# Share that a ramp may leave beyond noise: a quarter of its effect, squared. The closest duration leaves up to 0.15 T, and the
# step at T/2 terms of second order, about a tenth of the effect at 2 T.
LEFT = 0.25**2


def warn_if_modulus_rises(data: Gathered, binned: Binned) -> bool:
    """Warn if at most temperatures the modulus rises at first: no relaxation modulus does, and no creep compliance falls."""
    if data.kind.over_frequency or np.any(data.offset > 0):
        return False
    ends, rising = [], 0
    for first, last in pairwise(binned.bounds.tolist()):
        x, y = binned.log_time[first:last], binned.log_modulus[0, first:last]
        noise = robust_deviation(np.diff(y, 2)) / np.sqrt(6)  # of a point, from the bends between three
        level = np.flatnonzero(y >= np.max(y) - noise)[0]
        ends.append(x[level])
        rising += bool(level >= 1 and y[level] - y[0] > SIGNIFICANT * np.sqrt(2) * noise)
    if 2 * rising <= len(ends):
        return False
    falls = "rises" if data.kind.stiffness_power > 0 else "falls"
    text = f"at {rising} of {len(ends)} temperatures the {data.kind.value} {falls} up to about {10 ** np.median(ends):.2g} s"
    warn(f"{text}, which no step of {data.kind.step} does: {_advice(float(10 ** np.median(ends)), data)}")
    return True


def warn_if_ramp(data: Gathered, points: FitPoints, fit: MasterFit, anchor: int, vertical: bool, drift: Floats | None) -> None:
    """Warn if curves that do not superpose would, if their times counted from the middle of a ramp; `anchor` and what follows are
    arguments of `best_fit`.
    """
    if data.kind.over_frequency or np.any(data.offset > 0) or not fit.misfit.matters:
        return
    time, best, found, alone = 10**points.log_time, EXPLAINED, 0.0, False
    duration = float(np.min(time))
    while duration * DROPPED < np.max(time):
        kept = time >= DROPPED * duration
        if np.min(np.bincount(points.curve[kept], minlength=points.curves)) < MIN_BINS + 1:
            break
        left = replace(
            points,
            **{name: getattr(points, name)[kept] for name in ("curve", "log_time", "log_modulus", "variance", "channel", "lift")},
        )
        moved = replace(left, log_time=np.log10(time[kept] - duration / 2))
        try:
            with without_warnings():
                plain, ramped = (best_fit(each, [fit.shift], anchor, vertical, drift)[-1] for each in (left, moved))
        except (InputError, NumericsError, np.linalg.LinAlgError):
            break
        if plain.sure and ramped.rms**2 < best * plain.rms**2:
            best, found = ramped.rms**2 / plain.rms**2, duration
            alone = bool((not ramped.sure or best < LEFT) and np.argmax(plain.by_part) == 0)
        duration *= DURATIONS
    if alone:
        warn(f"all curves bend as after a ramp of about {found:.1g} s, counted from its beginning: {_advice(found, data)}")


def _advice(duration: float, data: Gathered) -> str:
    return (
        f'state the time in which the {data.kind.step} was applied, such as ramp = "{duration:.1g} s": times then count from the '
        "middle of the ramp, and its points are left out; until then, neither shift factors nor the law are to be trusted"
    )
