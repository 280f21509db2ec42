"""Checks of a measured curve and of the arguments of its fit, which raise `InputError`."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, and_more, warn
from dielast.io.table import plural, spoken
from dielast.material.argument_types import checked
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Floats, rms
from dielast.relaxation.ends import away
from dielast.relaxation.nnls import WeightedCurve

TimeRange = tuple[float | None, float | None]
"""The shortest and the longest time of the processes in s; None for a time that follows from the curve."""

TOLERATED = 0.02  # largest change of G(t) by clipping negative moduli; excess of the equilibrium modulus over the end of the curve
ABOVE_CURVE = 0.1  # an equilibrium modulus so far above the smoothed end is refused, and a glassy modulus so far below the start
POOR_FIT = 0.10  # relative rms


def sorted_points(kind: MeasurementKind, columns: Sequence[ArrayLike]) -> list[Floats]:
    """Abscissa and ordinates of a master curve, arrays (n,) in ascending order; `InputError` unless positive and equally long."""
    names = [(spoken(name), unit) for name, unit in (kind.reduced_abscissa, *kind.ordinates)]
    arrays = [np.asarray(values, dtype=float) for values in columns]
    abscissa = arrays[0]
    for (name, _), values in zip(names, arrays, strict=True):
        if values.ndim != 1 or values.shape != abscissa.shape:
            raise InputError(f"{names[0][0]} {abscissa.shape} and {name} {values.shape}: lists of the same length are needed")
    for (name, unit), values in zip(names, arrays, strict=True):
        bad = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
        if bad.size:
            first = f"{name}[{bad[0]}] = {values[bad[0]]:g} {unit}{and_more(bad.size - 1)}"
            raise InputError(f"{first}: a positive, finite number is needed")
    if np.unique(abscissa).size < 2:
        name = kind.abscissa[0]
        at_one = f"a curve of {abscissa.size} point(s) at a single {spoken(name)}"
        raise InputError(f"{at_one}: at least two different {plural(name)} are needed")
    order = np.lexsort((*arrays[:0:-1], abscissa))
    return [values[order] for values in arrays]


def without_strays(kind: MeasurementKind, abscissa: Floats, *values: Floats) -> list[Floats]:
    """Abscissa (n,) and ordinates without stray points, whose relative error would decide the whole fit; warns of them."""
    off = np.array([away(each) for each in values])
    stray = np.any(off != 1, axis=0)
    if np.any(stray):
        worst = int(np.argmax(np.max(np.abs(np.log(off)), axis=0)))
        ratio = off[np.argmax(np.abs(np.log(off[:, worst]))), worst]
        place = f"at {abscissa[worst]:.4g} {kind.abscissa[1]} {ratio:.3g} times its neighbours"
        many = int(np.count_nonzero(stray))
        said = f"a point is {place}: it is" if many == 1 else f"{many} points stray, one {place}: they are"
        warn(f"{said} left out of the fit")
    return [each[~stray] for each in (abscissa, *values)]


def checked_counts(method: str, branches: int, fewest: int, keep: int | None) -> tuple[int, int | None]:
    """The numbers of branches to fit and to keep, at least `fewest` and from 1 to `branches`."""
    branches = int(branches)
    if branches < fewest:
        raise InputError(f"{branches}: {method} needs at least {fewest}", argument="branches")
    keep = None if keep is None else int(keep)
    if keep is not None and not 1 <= keep <= branches:
        raise InputError(f"cannot keep {keep} of {branches} branches", argument="keep")
    return branches, keep


def checked_times(times: TimeRange, argument: str) -> TimeRange:
    """The shortest and the longest time, positive and in this order."""
    shortest, longest = (None if time is None else float(time) for time in times)
    for name, time in (("min", shortest), ("max", longest)):
        if time is not None and not 0 < time < np.inf:
            raise InputError(f"{name} = {time:g} s: a positive, finite time is needed", argument=argument)
    if shortest is not None and longest is not None and shortest >= longest:
        raise InputError(f"min = {shortest:g} s must be shorter than max = {longest:g} s", argument=argument)
    return shortest, longest


@checked
@dataclass(frozen=True, slots=True)
class Plateaus:
    """What is known of a material before its curve is fitted, as Young's moduli in Pa: `equilibrium_modulus` after infinite time (0
    for a melt), and `glassy_modulus` at the shortest times; what is None is found by the fit. A `liquid` has no equilibrium modulus
    and needs no plateau.
    """

    equilibrium_modulus: float | None = None
    glassy_modulus: float | None = None
    liquid: bool = False


def checked_moduli(plateaus: Plateaus, smallest: float, largest: float) -> tuple[float | None, float | None]:
    """Equilibrium modulus, 0 for a liquid, and glassy modulus as shear moduli in Pa, None if not stated.

    `smallest` and `largest` are Young's moduli of the curve in Pa, which the `plateaus` must not contradict.
    """
    equilibrium = None if plateaus.equilibrium_modulus is None else float(plateaus.equilibrium_modulus)
    glassy = None if plateaus.glassy_modulus is None else float(plateaus.glassy_modulus)
    if plateaus.liquid and equilibrium:
        raise InputError(f"{equilibrium:g} Pa: that of a liquid is 0", argument="equilibrium_modulus")
    equilibrium = 0.0 if plateaus.liquid else equilibrium
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
    return None if equilibrium is None else equilibrium / 3, None if glassy is None else glassy / 3


def what_rises(curve: WeightedCurve) -> str:
    """What is wrong with a curve that no spectrum fits well, as its modulus rises with time in parts; empty for other curves.

    The modulus of every spectrum falls, so that none is closer to the curve than the falling curve of least relative error.
    """
    from scipy.optimize import isotonic_regression

    kind, values = curve.kind, curve.values[0]
    weights = np.maximum((values / values.min()) ** -2, 1e-300)  # of values beyond all others, too
    falling = isotonic_regression(values, weights=weights, increasing=kind.stiffness_power < 0)
    least = rms(falling.x / values - 1) / len(curve.values) ** 0.5  # a loss modulus may rise and fall
    if least <= POOR_FIT:
        return ""
    square = np.add.reduceat((falling.x / values - 1) ** 2, falling.blocks[:-1])
    worst = int(np.argmax(square))
    first, last = falling.blocks[worst], falling.blocks[worst + 1] - 1
    along, rises = ("frequency", "falls") if kind.over_frequency else ("time", "rises")
    ends = (last, first) if kind.over_frequency else (first, last)
    stiffness, abscissa, unit = 3 * curve.stiffness, curve.time**kind.time_power, kind.abscissa[1]
    low, high = (f"{stiffness[k]:.3g} Pa at {abscissa[k]:.3g} {unit}" for k in ends)
    return (
        f"no spectrum misses the curve by less than {least:.1%} rms, as the {kind.stiffness} {rises} with {along} in parts of it, "
        f"most from {low} to {high} (scatter, wrong shift factors, or columns mixed up?)"
    )
