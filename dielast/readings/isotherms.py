"""Division of readings into isothermal sets, and of the sets into runs of the test."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, warn

WIDEST = 4  # spread of the readings of one set, in tolerances
SHORTEST = 3  # number of points of a run


def isotherms(
    temperature: NDArray[np.float64],
    abscissa: NDArray[np.float64],
    source: NDArray[np.intp],
    label: NDArray[np.intp],
    tolerance: float,
) -> list[tuple[float, NDArray[np.intp]]]:
    """The temperature in degC and the rows of each run, by ascending temperature; all arguments of shape (n,).

    Rows with a nonnegative `label` belong to the set of that label; the others are sorted by temperature and divided at gaps wider
    than `tolerance` (K). The temperature of a set is the mean of its readings. Raises `InputError` if the readings of a set spread
    over more than four tolerances.
    """
    sets = [np.flatnonzero(label == value) for value in np.unique(label[label >= 0])]
    free = np.flatnonzero(label < 0)
    order = free[np.argsort(temperature[free], kind="stable")]
    starts = np.flatnonzero(np.diff(temperature[order], prepend=-np.inf) > tolerance)
    parted = np.split(order, starts[1:]) if order.size else []
    stated = f"temperature_tolerance = {tolerance:g} K apart"
    for groups, what, why in (
        (sets, "temperatures of one set", f"are more than {WIDEST} {stated}"),
        (parted, "temperatures", f"run into one another: no two are more than {stated}"),
    ):
        for readings in (temperature[members] for members in groups):
            if np.ptp(readings) > WIDEST * tolerance:
                raise InputError(f"{what} from {readings.min():g} to {readings.max():g} degC {why}")
    _warn_of_scatter(temperature, parted, source, tolerance)
    runs = [(_level(temperature[members]), members) for members in sets]
    for members in parted:
        runs += [(_level(temperature[members]), run) for run in _runs(np.sort(members), abscissa, source)]
    return sorted(runs, key=lambda run: run[0])


def _warn_of_scatter(
    temperature: NDArray[np.float64], parted: list[NDArray[np.intp]], source: NDArray[np.intp], tolerance: float
) -> None:
    """Warn of sets next to each other in temperature whose rows alternate in a file: one set, perhaps, whose readings scatter."""
    for colder, warmer in pairwise(parted):
        low, high = _level(temperature[colder]), _level(temperature[warmer])
        rows = np.sort(np.concatenate((colder, warmer)))
        if high - low > WIDEST * tolerance or np.unique(source[rows]).size > 1:
            continue
        if np.count_nonzero(np.diff(np.isin(rows, warmer))) > 2:
            warn(
                f"the rows at {low:g} and {high:g} degC alternate: if they are one temperature whose readings scatter, state "
                f"columns.set, or a temperature_tolerance above {tolerance:g} K"
            )
            return


def _level(readings: NDArray[np.float64]) -> float:
    """The mean of a set's readings, which scatter with the thermostat; equal readings are returned without rounding."""
    return float(readings[0]) if np.ptp(readings) == 0 else round(float(np.mean(readings)), 6)


def _runs(rows: NDArray[np.intp], abscissa: NDArray[np.float64], source: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """The `rows` of one temperature by run: a new run begins with a new file, or where the abscissa restarts.

    Points in no order are one run.
    """
    along = abscissa[rows]
    if np.count_nonzero(np.diff(along) < 0) > np.count_nonzero(np.diff(along) > 0):
        with np.errstate(over="ignore"):
            along = 1 / along  # a sweep from high to low frequency
    restarts = (np.diff(source[rows]) != 0) | (along[1:] < 0.5 * along[:-1])
    runs = np.split(rows, np.flatnonzero(restarts) + 1)
    return runs if min(run.size for run in runs) >= SHORTEST else [rows]
