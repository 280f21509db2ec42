"""Array types, and how columns of arrays whose last axis is the cases are selected so that results do not depend on their number.

`Floats` are float64, `Flags` booleans, `Index` integers that index another array; `Cases` index cases, or the columns of an array.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.intp]
Cases = Index


def paired(columns: Cases) -> Cases:
    """The columns (k,); a single column is repeated, to shape (2,).

    numpy sums an array of shape (n, 1) in a different order than an array of shape (n, 2), and so rounds differently. No result may
    depend on how many cases run together, so at least two columns are selected wherever sums over springs or stages follow.
    Both copies then write the same result to the same column.
    """
    return np.repeat(columns, 2) if columns.size == 1 else columns


def where(mask: Flags) -> Cases:
    """The columns (k,) in which a mask is true; a single column is repeated (`paired`)."""
    return paired(np.flatnonzero(mask))
