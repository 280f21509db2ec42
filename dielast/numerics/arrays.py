"""Array types: `Floats` (float64), `Flags` (booleans), `Index` (integers that index another array)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.intp]
