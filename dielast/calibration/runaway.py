"""Tests under voltage in which the model runs away: it pulls in across the prescribed stretch, where the specimen is free."""

from __future__ import annotations

import numpy as np

from dielast.calibration.experiment import MeasuredTest
from dielast.calibration.laboratory import under_voltage
from dielast.errors import DielastError
from dielast.material.material import Material
from dielast.mechanics.load import Mode


def runaway_stretch(test: MeasuredTest, material: Material) -> float | None:
    """The prescribed stretch at the last measured point before a material runs away in a test under voltage, None if it does not.

    It runs away if it becomes wider than it is long by expanding across, rather than by being unloaded. An isotropic film without
    stress across would then have to be pushed along, because the larger stress goes with the larger stretch (Baker and Ericksen
    1954): a specimen would wrinkle. A film that is held across, or stretched in both axes, cannot run away.
    """
    if test.mode is not Mode.UNIAXIAL or not test.nominal_field:
        return None
    try:
        history = under_voltage(test, [material])
    except DielastError:
        return None
    length, width = history.stretch_1[0], history.stretch_2[0]
    wider = width > length
    crossing = ~wider[:-1] & wider[1:] & (np.diff(width) > np.abs(np.diff(length)))
    if crossing.any():
        return float(length[int(np.argmax(crossing))])
    return float(length[0]) if wider[int(np.argmax(length))] else None
