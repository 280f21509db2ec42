"""Tests under voltage in which the model runs away: it pulls in across the prescribed stretch, where the specimen is free."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dielast.calibration.experiment import MeasuredTest
from dielast.calibration.laboratory import completed_stress, under_voltage
from dielast.material.material import Material
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Floats


def stable_stress(test: MeasuredTest, materials: Sequence[Material]) -> list[Floats]:
    """The stress (n,) of each material in a test under voltage, NaN beyond the last point before it runs away.

    It runs away if it becomes wider than it is long by expanding across, rather than by being unloaded. An isotropic film without
    stress across would then have to be pushed along, because the larger stress goes with the larger stretch (Baker and Ericksen
    1954): a specimen would wrinkle. A film that is held across, or stretched in both axes, cannot run away.
    """
    history = under_voltage(test, materials)
    stresses = completed_stress(history)
    if test.mode is not Mode.UNIAXIAL:
        return stresses
    for k, (length, width) in enumerate(zip(history.stretch_1, history.stretch_2, strict=True)):
        wider = width > length
        crossing = ~wider[:-1] & wider[1:] & (np.diff(width) > np.abs(np.diff(length)))
        if crossing.any():  # the stress up to there is kept even where the simulation was given up later
            stable = np.arange(length.size) <= np.argmax(crossing)
            stresses[k] = np.where(stable, history.nominal_stress_1[k], np.nan)
        elif wider[int(np.argmax(length))]:
            stresses[k][1:] = np.nan
    return stresses
