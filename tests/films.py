"""Materials of films that several tests put under voltage."""

from __future__ import annotations

import numpy as np

from dielast.gent import Gent
from dielast.material import Material
from dielast.prony import Spectrum
from dielast.shift import NoShift

SOFT = Material(
    "soft",
    26e3,
    Spectrum(np.geomspace(1e4, 1e-2, 7), np.geomspace(1e4, 3e5, 7)),
    NoShift(20.0),
    Gent(110.0),
    Gent(55.0),
    permittivity=4e-11,
)
