"""The stress of a ramp of strain by linear viscoelasticity, written down independently of how spectra are reduced."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dielast.material.spectrum import Spectrum

Array = NDArray[np.float64]


def area(spectrum: Spectrum, level: float, time: Array) -> Array:
    """The integral of G from 0 to `time` (n,) in Pa s; `level` is the equilibrium modulus in Pa."""
    tau = spectrum.relaxation_time
    return np.asarray(level * time - np.expm1(-time[:, None] / tau) @ (tau * spectrum.shear_modulus))


def ramp_error(some: Spectrum, full: Spectrum, level: float, time: Array) -> float:
    """Greatest relative error of the stress at each `time` (n,) of ramps that began at 0 and took any part of that time.

    The stress over the strain of a ramp that took T is the mean of G from time - T to time.
    """
    worst = 0.0
    for own in time.tolist():
        before = np.append(0.0, own * np.append(np.geomspace(1e-8, 0.5, 150), 1 - np.geomspace(0.5, 1e-4, 50)[1:]))
        stress, wanted = (area(each, level, np.array([own])) - area(each, level, before) for each in (some, full))
        worst = max(worst, float(np.abs(stress / wanted - 1).max()))
    return worst
