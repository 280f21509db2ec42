"""What is asked of a measured curve and of the arguments of its fit, and what is said of the result."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, warn
from dielast.relaxation.ends import End

Array = NDArray[np.float64]
Ends = tuple[float | None, float | None]

TOLERATED = 0.02  # of G(t): what clipping negative moduli may change; and the equilibrium modulus above the curve without a word
_ABOVE = 0.1  # of the curve's smoothed end: an equilibrium modulus that lies higher is refused; likewise a glassy one that is lower
_BELOW = 0.1  # of the end of a curve that has levelled off, continued by _MORE_DECADES: an equilibrium modulus below is doubted
_MORE_DECADES = 2.0
_THIRD = (2.5, 3.5)  # ratio of the two that looks like Young's against shear
LEVEL_SLOPE = 0.045  # decades of modulus per decade of time, about 10 %: a flatter end is a plateau
_POOR_FIT = 0.10  # relative rms
_NEXT_TO = 10**0.1  # a tenth of a decade: that close to its end, a curve still tells


def sorted_points(*columns: tuple[str, str, ArrayLike]) -> list[Array]:
    """The columns (name, unit, values) of a curve as arrays, by the first of them; all must be positive and of one length."""
    arrays = [np.asarray(values, dtype=float) for _, _, values in columns]
    abscissa = arrays[0]
    for (name, _, _), own in zip(columns, arrays, strict=True):
        if own.ndim != 1 or own.shape != abscissa.shape:
            raise InputError(f"{columns[0][0]} {abscissa.shape} and {name} {own.shape}: lists of the same length are needed")
    for (name, unit, _), own in zip(columns, arrays, strict=True):
        bad = np.flatnonzero(~(np.isfinite(own) & (own > 0)))
        if bad.size:
            more = f" (and {bad.size - 1} more)" if bad.size > 1 else ""
            raise InputError(f"{name}[{bad[0]}] = {own[bad[0]]:g} {unit}{more}: a positive, finite number is needed")
    if np.unique(abscissa).size < 2:
        one = columns[0][0].removeprefix("reduced ")
        several = one[:-1] + "ies" if one.endswith("y") else one + "s"
        raise InputError(f"a curve of {abscissa.size} point(s) at a single {one}: at least two different {several} are needed")
    order = np.lexsort((*arrays[:0:-1], abscissa))
    return [own[order] for own in arrays]


def check_counts(method: str, branches: int, fewest: int, keep: int | None) -> None:
    """How many branches are wanted, and how many of them to keep."""
    if branches < fewest:
        raise InputError(f"{branches}: {method} needs at least {fewest}", argument="branches")
    if keep is not None and not 1 <= keep <= branches:
        raise InputError(f"cannot keep {keep} of {branches} branches", argument="keep")


def check_ends(relaxation_time: Ends) -> None:
    """The shortest and the longest time wanted, where stated."""
    for name, end in zip(("min", "max"), relaxation_time, strict=True):
        if end is not None and not 0 < end < np.inf:
            raise InputError(f"{name} = {end:g} s: a positive, finite time is needed", argument="relaxation_time")
    shortest, longest = relaxation_time
    if shortest is not None and longest is not None and shortest >= longest:
        raise InputError(f"min = {shortest:g} s must be shorter than max = {longest:g} s", argument="relaxation_time")


def of_liquid(liquid: bool, equilibrium: float | None) -> float | None:
    """The equilibrium modulus that is known: zero of a liquid."""
    if liquid and equilibrium:
        raise InputError(f"{equilibrium:g} Pa: that of a liquid is 0", argument="equilibrium_modulus")
    return 0.0 if liquid else equilibrium


def check_moduli(equilibrium: float | None, glassy: float | None, smallest: float, largest: float) -> None:
    """The moduli prescribed, beside the `smallest` and the `largest` of the curve; all Young's, Pa."""
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
    if glassy is not None and glassy < (1 - _ABOVE) * largest:
        raise InputError(
            f"{glassy:g} Pa is below the start of the curve, {largest:.4g} Pa: raise it, or leave it out",
            argument="glassy_modulus",
        )
    excess = 0.0 if equilibrium is None else equilibrium / smallest - 1
    if excess > _ABOVE:
        raise InputError(
            f"{equilibrium:g} Pa is above the end of the curve, {smallest:.4g} Pa: lower it", argument="equilibrium_modulus"
        )
    if excess > TOLERATED:
        warn(f"{equilibrium:g} Pa is {excess:.1%} above the end of the curve, {smallest:.4g} Pa", argument="equilibrium_modulus")


def share_kept(branches: int, keep: int | None) -> float:
    """How much of the decades of so many evenly spaced times is left if only the slowest are kept."""
    return 1.0 if keep is None or branches < 2 else (keep - 1) / (branches - 1)


def range_of_times(
    wanted: Ends, default: tuple[float, float], time: Array, seen_at: tuple[float, float], kept: float = 1.0
) -> tuple[float, float]:
    """Shortest and longest time of a process in s; warns where the times at which these two are seen, in units of their own, are
    off the curve, but for the shorter ones of which only a share, `kept`, of the decades is left."""
    shortest, longest = (float(own if end is None else end) for end, own in zip(wanted, default, strict=True))
    if shortest >= longest:
        raise InputError(f"no relaxation time lies between min = {shortest:.3g} s and max = {longest:.3g} s: state both")
    least = longest * (shortest / longest) ** kept
    if seen_at[0] * least < time[0] / _NEXT_TO or seen_at[1] * longest > time[-1] * _NEXT_TO:
        warn(
            f"relaxation times from {least:.3g} to {longest:.3g} s reach farther than the curve, from {time[0]:.3g} to "
            f"{time[-1]:.3g} s, can tell: the spectrum is extrapolated"
        )
    return shortest, longest


def judge_equilibrium(known: float | None, found: float, plateau: End) -> None:
    """Warn of an equilibrium modulus (shear, Pa) that was `found` where there is no plateau, or is `known` and far below one."""
    if known is None and -plateau.slope > LEVEL_SLOPE:
        warn(
            f"the curve has not levelled off: it falls by {1 - 10**plateau.slope:.0%} in its last decade, so that the equilibrium "
            f"modulus of {3 * found:.3g} Pa (Young's) is a guess: state equilibrium_modulus (0 for a melt)",
            mentions=("equilibrium_modulus",),
        )
    # A curve that has levelled off shows its equilibrium modulus, but for some decades of its last slope.
    level, equilibrium = 3 * plateau.modulus, 3 * found
    doubtful = (1 - _BELOW) * level * 10 ** (_MORE_DECADES * plateau.slope)
    if known is None or -plateau.slope > LEVEL_SLOPE or equilibrium >= doubtful:
        return
    third = ""
    if equilibrium > 0 and _THIRD[0] < level / equilibrium < _THIRD[1]:
        third = ", a third of that: it is Young's modulus that is meant, three times the shear modulus"
    warn(
        f"the curve has levelled off at {level:.4g} Pa, far above equilibrium_modulus = {equilibrium:g} Pa{third}",
        mentions=("equilibrium_modulus",),
    )


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def judge_fit(error: Array, time: Array, shortest_kept: float | None) -> tuple[float, float]:
    """Rms and greatest magnitude of relative errors (channels, n) at `time`; of a truncated spectrum, where it is meant to hold."""
    if shortest_kept is not None:
        error = error[:, time >= shortest_kept]
        if error.size == 0:
            raise InputError(f"the curve ends before {shortest_kept:.3g} s, the shortest relaxation time kept: keep more branches")
    mean, worst = rms(error), float(np.max(np.abs(error)))
    if mean > _POOR_FIT:
        warn(f"the spectrum misses the curve by {mean:.1%} rms and {worst:.1%} at worst: try more branches or another method")
    return mean, worst
