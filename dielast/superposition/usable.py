"""Selection of the curves that can be shifted: with enough points, and with a modulus in common with another curve."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from dielast.errors import DielastWarning, InputError, warn
from dielast.material.measurement import Measurement
from dielast.superposition.condense import Condensed, condense
from dielast.superposition.gather import Gathered, gather, where
from dielast.superposition.overlap import find_isolated

MIN_BINS = 3  # number of points of a curve, which are averages over bins of log time


def usable_curves(curves: Sequence[Measurement]) -> tuple[Gathered, Condensed]:
    """All curves that can be shifted, gathered and condensed: without curves of too few points, or without overlap.

    Warns of each omitted curve; raises `InputError` if fewer than two remain.
    """
    kept, reasons = list(curves), []
    while True:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DielastWarning)  # the call below issues them once
            data = gather(kept)
        condensed, m = condense(data), data.temperature.size
        lost = np.bincount(data.curve[(condensed.bin_of_point < 0) & data.good], minlength=m)
        out = _too_short(np.bincount(condensed.curve, minlength=m).tolist(), lost.tolist(), data.kind.over_frequency)
        if not out and m > 2:
            out = find_isolated(m, condensed.curve, condensed.log_modulus[0], data.kind)
        if not out:
            break
        why = {data.temperature[k]: f"{where(curves, data.temperature[k])}: {reason}" for k, reason in out.items()}
        if m - len(why) < 2:
            raise InputError(next(iter(why.values())))
        reasons += list(why.values())
        kept = [curve for curve in kept if curve.temperature not in why]
    for reason in reasons:
        warn(f"{reason}; this curve is left out")
    data = gather(kept)
    if np.any(lost):
        end = data.kind.ends[1 if data.kind.stiffness_power > 0 else 0]
        places = ", ".join(f"{data.temperature[k]:g} degC ({lost[k]})" for k in np.flatnonzero(lost))
        warn(f"points at the {end} end of curves that are lost in noise are left out: {places}")
    return data, condensed


def _too_short(used: list[int], lost: list[int], over_frequency: bool) -> dict[int, str]:
    """The reasons why curves, by number, have too few points `used`; others are `lost` in noise."""
    axis, reasons = "frequency" if over_frequency else "time", {}
    for k, count in enumerate(used):
        if count < MIN_BINS:
            floor = f" ({lost[k]} are noise floor)" if lost[k] else ""
            reasons[k] = f"only {count} distinct points in log {axis}{floor}; at least {MIN_BINS} are needed"
    return reasons
