"""A test at one temperature, or a master curve from elsewhere, as `spectrum` reads it."""

import math

import numpy as np

from dielast.errors import InputError, warn
from dielast.handover.mastercurve_folder import ReducedCurve
from dielast.io.files import Inputs
from dielast.material.shift import NoShift
from dielast.numerics.arrays import Floats
from dielast.readings.isotherms import WIDEST
from dielast.readings.read import read_all
from dielast.readings.recipe import CurveData
from dielast.readings.steps import TABLE

NO_SCATTER = 1.25  # times as large a value at the same time is no scatter of one test


def read_curve(data: CurveData, inputs: Inputs) -> ReducedCurve:
    """A test at one temperature, or a master curve from elsewhere, without a shift law; all runs of it together.

    Raises `InputError` naming file and line, column or step, or if there are several temperatures.
    """
    dataset = read_all(data, inputs)
    temperature = [test.temperature for test in dataset.measurements]
    if max(temperature) - min(temperature) > data.temperature_tolerance:
        tests = f"there are tests from {min(temperature):g} to {max(temperature):g} degC"
        raise InputError(f'{tests}, and a spectrum is made of one temperature: "dielast mastercurve" joins several', file=data.file)
    measured, stated = round(math.fsum(temperature) / len(temperature), 6), data.reference_temperature
    if stated is not None and abs(measured - stated) > WIDEST * data.temperature_tolerance:
        raise InputError(
            f"the test was at {measured:g} degC, but reference_temperature is {stated:g} degC: leave one out", file=data.file
        )
    columns = np.concatenate([test.columns for test in dataset.measurements], axis=1)
    columns = columns[:, np.all(columns[1:] > 0, axis=0)]
    _warn_of_several(columns, data.file)
    at = measured if stated is None else stated
    exported = set(dataset.formats) != {TABLE}  # of a plain table the recipe says it all
    read = {**dataset.summary, "temperature_degC": at, "points": int(columns.shape[1])} if exported else None
    return ReducedCurve(dataset.kind, tuple(columns), NoShift(at), data=read)


def _warn_of_several(columns: Floats, source: str) -> None:
    """Warn of other values at the same times or frequencies: of several tests, perhaps, that are taken for one."""
    order = np.argsort(columns[0], kind="stable")
    x, y = columns[0, order], np.log(columns[1, order])
    starts = np.flatnonzero(np.append(True, np.diff(x) > 0))
    apart = np.exp(np.maximum.reduceat(y, starts) - np.minimum.reduceat(y, starts))
    if np.any(far := apart > NO_SCATTER):
        again = f"{np.count_nonzero(far)} times or frequencies appear again with values up to {apart.max():.3g} times as large"
        warn(f"{again}: are these several tests? Leave the rows of one in the file", file=source)
