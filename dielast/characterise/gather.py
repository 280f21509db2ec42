"""Relaxation curves as they are measured, checked and put into one order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.measurement import RelaxationCurve
from dielast.errors import InputError, warn

Array = NDArray[np.float64]
Index = NDArray[np.intp]

MIN_POINTS = 3
DIFFERENCE = 1.05  # factor of modulus between two runs at one temperature that is worth a warning,
CONTRADICTION = 1.25  # and that is an error


@dataclass(frozen=True, slots=True, eq=False)
class Gathered:
    """All points (n,), sorted by temperature, time and modulus; `curve` is the place in the ascending `temperature` (m,)."""

    temperature: Array
    curve: Index
    time: Array
    modulus: Array


def gather(curves: Sequence[RelaxationCurve]) -> Gathered:
    """Check `curves`, merge those of one temperature, and sort; raises `InputError` as `build_master_curve` says."""
    temperature, run_curve = np.unique([float(curve.temperature) for curve in curves], return_inverse=True)
    if temperature.size < 2:
        raise InputError(f"a master curve needs at least two temperatures, but {_said(temperature)}")
    run = np.repeat(np.arange(len(curves)), [curve.time.size for curve in curves])
    time = np.concatenate([curve.time for curve in curves])
    modulus = np.concatenate([curve.modulus for curve in curves])
    for k in np.flatnonzero(np.bincount(run_curve) > 1):
        _check_runs(float(temperature[k]), [curves[int(i)] for i in np.flatnonzero(run_curve == k)])
    curve = run_curve[run]
    total = np.bincount(curve, minlength=temperature.size)
    below = np.bincount(curve[modulus <= 0], minlength=temperature.size)
    for k in np.flatnonzero(below):
        first = int(np.flatnonzero((curve == k) & (modulus <= 0))[0] - np.searchsorted(run, run[np.flatnonzero(curve == k)[0]]))
        if 2 * below[k] > total[k]:
            raise InputError(
                f"{temperature[k]:g} degC: {below[k]} of {total[k]} moduli are zero or negative, the first at point {first}: "
                "positive moduli are needed"
            )
        warn(f"{temperature[k]:g} degC: {below[k]} of {total[k]} moduli are zero or negative (noise floor)")
    for k in np.flatnonzero(total - below < MIN_POINTS):
        raise InputError(f"{temperature[k]:g} degC: only {total[k] - below[k]} usable points; at least {MIN_POINTS} are needed")
    order = np.lexsort((modulus, time, curve))
    return Gathered(temperature, curve[order], time[order], modulus[order])


def _said(temperature: Array) -> str:
    return f"all curves are at {temperature[0]:g} degC" if temperature.size else "there are no curves"


def _check_runs(temperature: float, runs: list[RelaxationCurve]) -> None:
    """Two runs at one temperature are one measurement if they agree where their times overlap."""
    for i, one in enumerate(runs):
        for other in runs[i + 1 :]:
            here, there = (_sorted_log(run) for run in (one, other))
            if not here[0].size or not there[0].size:
                continue
            inside = (here[0] >= there[0][0]) & (here[0] <= there[0][-1])
            back = (there[0] >= here[0][0]) & (there[0] <= here[0][-1])
            gap = np.concatenate(
                (here[1][inside] - np.interp(here[0][inside], *there), np.interp(there[0][back], *here) - there[1][back])
            )
            factor = 10 ** abs(float(np.median(gap))) if gap.size else 1.0
            if factor > CONTRADICTION:
                raise InputError(
                    f"{temperature:g} degC was measured twice and the runs contradict each other: "
                    f"their moduli differ by a factor of {factor:.3g}; leave one out"
                )
            if factor > DIFFERENCE:
                warn(f"{temperature:g} degC: two runs differ by a factor of {factor:.3g} in modulus; they are taken together")


def _sorted_log(run: RelaxationCurve) -> tuple[Array, Array]:
    good = run.modulus > 0
    order = np.lexsort((run.modulus[good], run.time[good]))
    return np.log10(run.time[good][order]), np.log10(run.modulus[good][order])
