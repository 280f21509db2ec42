"""Number columns of the tables that one command writes and the next one reads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dielast.errors import InputError
from dielast.io.table import number_columns
from dielast.numerics.arrays import Floats as Array


def finite_columns(content: bytes, name: str, headers: Sequence[str], positive: bool = False) -> Array:
    """The columns `headers` (k, n) of a table; raises `InputError` naming row and column of a cell that is not a finite number or,
    with `positive`, not above 0."""
    columns = np.array(number_columns(content, name, headers))
    wrong = ~np.isfinite(columns) | ((columns <= 0) & positive)
    for row, column in np.argwhere(wrong.T)[:1]:
        needed = "a positive number" if positive else "a number"
        raise InputError(f'column "{headers[column]}": {needed} is needed', file=name, row=row + 2)
    return columns
