"""Checks of a measured curve, of the arguments of its fit, and of the result: `check_*` raises `InputError`, `warn_*` warns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, warn
from dielast.io.table import plural, spoken
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Floats
from dielast.relaxation.ends import End

TimeRange = tuple[float | None, float | None]
"""The shortest and the longest time of the processes in s; None for a time that follows from the curve."""

TOLERATED = 0.02  # largest change of G(t) by clipping negative moduli; excess of the equilibrium modulus over the end of the curve
ABOVE_CURVE = 0.1  # an equilibrium modulus so far above the smoothed end is refused, and a glassy modulus so far below the start
# a stated equilibrium modulus so far below the end of a levelled curve, extrapolated by DECADES_BEYOND, is warned of
BELOW_CURVE = 0.1
DECADES_BEYOND = 2.0
LOOKS_LIKE_SHEAR = (2.5, 3.5)  # ratio of two moduli that suggests Young's over shear
LEVEL_SLOPE = 0.045  # decades of modulus per decade of time, about 10 %: a smaller slope at the end is a plateau
POOR_FIT = 0.10  # relative rms
NEAR_END = 10**0.1  # a curve determines processes up to a tenth of a decade beyond its end


def sorted_points(kind: MeasurementKind, columns: Sequence[ArrayLike]) -> list[Floats]:
    """Abscissa and ordinates of a master curve as arrays (n,), by abscissa; `InputError` unless positive and of one length."""
    names = [(spoken(name), unit) for name, unit in (kind.reduced_abscissa, *kind.ordinates)]
    arrays = [np.asarray(values, dtype=float) for values in columns]
    abscissa = arrays[0]
    for (name, _), values in zip(names, arrays, strict=True):
        if values.ndim != 1 or values.shape != abscissa.shape:
            raise InputError(f"{names[0][0]} {abscissa.shape} and {name} {values.shape}: lists of the same length are needed")
    for (name, unit), values in zip(names, arrays, strict=True):
        bad = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
        if bad.size:
            more = f" (and {bad.size - 1} more)" if bad.size > 1 else ""
            raise InputError(f"{name}[{bad[0]}] = {values[bad[0]]:g} {unit}{more}: a positive, finite number is needed")
    if np.unique(abscissa).size < 2:
        name = kind.abscissa[0]
        at_one = f"a curve of {abscissa.size} point(s) at a single {spoken(name)}"
        raise InputError(f"{at_one}: at least two different {plural(name)} are needed")
    order = np.lexsort((*arrays[:0:-1], abscissa))
    return [values[order] for values in arrays]


def check_counts(method: str, branches: int, fewest: int, keep: int | None) -> None:
    """`InputError` for too few branches, or for a number to keep that is not from 1 to `branches`."""
    if branches < fewest:
        raise InputError(f"{branches}: {method} needs at least {fewest}", argument="branches")
    if keep is not None and not 1 <= keep <= branches:
        raise InputError(f"cannot keep {keep} of {branches} branches", argument="keep")


def check_times(relaxation_time: TimeRange) -> None:
    """`InputError` for a shortest or longest time that is not positive, or a shortest time that is not shorter than the longest."""
    for name, end in zip(("min", "max"), relaxation_time, strict=True):
        if end is not None and not 0 < end < np.inf:
            raise InputError(f"{name} = {end:g} s: a positive, finite time is needed", argument="relaxation_time")
    shortest, longest = relaxation_time
    if shortest is not None and longest is not None and shortest >= longest:
        raise InputError(f"min = {shortest:g} s must be shorter than max = {longest:g} s", argument="relaxation_time")


def check_liquid(liquid: bool, equilibrium: float | None) -> float | None:
    """The stated equilibrium modulus, which is 0 for a liquid; `InputError` if it is stated otherwise for a liquid."""
    if liquid and equilibrium:
        raise InputError(f"{equilibrium:g} Pa: that of a liquid is 0", argument="equilibrium_modulus")
    return 0.0 if liquid else equilibrium


def check_moduli(equilibrium: float | None, glassy: float | None, smallest: float, largest: float) -> None:
    """`InputError` for moduli that contradict each other, or the `smallest` or `largest` of the curve; all Young's, Pa."""
    if equilibrium is not None and not 0 <= equilibrium < np.inf:
        raise InputError(f"{equilibrium:g} Pa: it must be finite and not negative (0 is a melt)", argument="equilibrium_modulus")
    if glassy is not None and not 0 < glassy < np.inf:
        raise InputError(f"{glassy:g} Pa: it must be finite and positive", argument="glassy_modulus")
    if equilibrium is not None and glassy is not None and equilibrium >= glassy:
        raise InputError(
            f"{equilibrium:g} Pa must be smaller than glassy_modulus = {glassy:g} Pa",
            argument="equilibrium_modulus",
            mentions=("glassy_modulus",),
        )
    if glassy is not None and glassy < (1 - ABOVE_CURVE) * largest:
        raise InputError(
            f"{glassy:g} Pa is below the start of the curve, {largest:.4g} Pa: raise it, or leave it out",
            argument="glassy_modulus",
        )
    excess = 0.0 if equilibrium is None else equilibrium / smallest - 1
    if excess > ABOVE_CURVE:
        raise InputError(
            f"{equilibrium:g} Pa is above the end of the curve, {smallest:.4g} Pa: lower it", argument="equilibrium_modulus"
        )
    if excess > TOLERATED:
        warn(f"{equilibrium:g} Pa is {excess:.1%} above the end of the curve, {smallest:.4g} Pa", argument="equilibrium_modulus")


def range_of_times(
    wanted: TimeRange, default: tuple[float, float], time: Floats, seen_at: tuple[float, float], kept: float
) -> tuple[float, float]:
    """The shortest and the longest time of a process in s: `wanted` where stated, else `default`.

    The shortest and the longest process have their effect on the curve at `seen_at` times their time; warns if that is beyond the
    curve. Only a fraction `kept` of the decades of times counts, from the longest on.
    """
    shortest, longest = (float(usual if end is None else end) for end, usual in zip(wanted, default, strict=True))
    if shortest >= longest:
        raise InputError(f"no relaxation time lies between min = {shortest:.3g} s and max = {longest:.3g} s: state both")
    least = longest * (shortest / longest) ** kept
    if seen_at[0] * least < time[0] / NEAR_END or seen_at[1] * longest > time[-1] * NEAR_END:
        warn(
            f"relaxation times from {least:.3g} to {longest:.3g} s reach beyond what the curve, from {time[0]:.3g} to "
            f"{time[-1]:.3g} s, determines: the spectrum is extrapolated"
        )
    return shortest, longest


def warn_of_equilibrium(known: float | None, fitted: float, plateau: End) -> None:
    """Warn of an equilibrium modulus (shear, Pa) that was `fitted` without a plateau, or is `known` and far below a plateau."""
    if known is None and -plateau.slope > LEVEL_SLOPE:
        warn(
            f"the curve has not levelled off: it falls by {1 - 10**plateau.slope:.0%} in its last decade, so that the equilibrium "
            f"modulus of {3 * fitted:.3g} Pa (Young's) is a guess: state equilibrium_modulus (0 for a melt)",
            mentions=("equilibrium_modulus",),
        )
    # The equilibrium modulus of a levelled curve is near its end: no lower than its last slope leads within a few decades.
    level, equilibrium = 3 * plateau.modulus, 3 * fitted
    doubtful = (1 - BELOW_CURVE) * level * 10 ** (DECADES_BEYOND * plateau.slope)
    if known is None or -plateau.slope > LEVEL_SLOPE or equilibrium >= doubtful:
        return
    third = ""
    if equilibrium > 0 and LOOKS_LIKE_SHEAR[0] < level / equilibrium < LOOKS_LIKE_SHEAR[1]:
        third = ", a third of that: it is Young's modulus that is meant, three times the shear modulus"
    warn(
        f"the curve has levelled off at {level:.4g} Pa, far above equilibrium_modulus = {equilibrium:g} Pa{third}",
        mentions=("equilibrium_modulus",),
    )


def rms(values: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def fit_errors(error: Floats, time: Floats, shortest_kept: float | None) -> tuple[float, float]:
    """Rms and largest relative error (channels, n); for a truncated spectrum, of the times from its shortest relaxation time on."""
    if shortest_kept is not None:
        error = error[:, time >= shortest_kept]
        if error.size == 0:
            raise InputError(f"the curve ends before {shortest_kept:.3g} s, the shortest relaxation time kept: keep more branches")
    mean, worst = rms(error), float(np.max(np.abs(error)))
    if mean > POOR_FIT:
        warn(f"the spectrum misses the curve by {mean:.1%} rms and {worst:.1%} at worst: try more branches or another method")
    return mean, worst
