"""Values that are zero or negative: a noise floor, or readings that are wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, warn
from dielast.io.table import spoken
from dielast.material.measurement_kind import MeasurementKind

LOW = 0.1  # of the largest value of a curve, below which its noise floor lies
NEIGHBOURS = 2  # readings on either side that show how large a value should be


def check_signs(
    kind: MeasurementKind, temperature: float, columns: NDArray[np.float64], source: Sequence[str], line: NDArray[np.intp]
) -> None:
    """Warn of the rows (n,) of a curve, abscissa and ordinates `columns` (1 + c, n), that have an ordinate of zero or below.

    They are noise floor where the readings beside them are low, else wrong. `source` and `line` are file and line of each row.
    Raises `InputError` if most rows are not positive.
    """
    below = columns[1:] <= 0
    rows, at = np.any(below, axis=0), f"at {temperature:g} degC"
    if 2 * np.count_nonzero(rows) > rows.size:
        text = f"{np.count_nonzero(rows)} of {rows.size} {kind.values} {at} are zero or negative: positive {kind.values} are needed"
        raise InputError(text, file=source[int(np.argmax(rows))], line=int(line[np.argmax(rows)]))
    order = np.argsort(columns[0], kind="stable")
    amid = np.zeros(below.shape, dtype=bool)
    for high, values in zip(amid, np.abs(columns[1:, order]), strict=True):
        around = np.lib.stride_tricks.sliding_window_view(np.pad(values, NEIGHBOURS, mode="reflect"), 2 * NEIGHBOURS + 1)
        high[order] = np.sort(np.delete(around, NEIGHBOURS, axis=1), axis=1)[:, NEIGHBOURS - 1] > LOW * values.max()
    wrong = np.any(below & amid, axis=0)
    for chosen, what in (
        (wrong, "amid large values, which is no noise floor: correct these rows, or delete them; they are left out"),
        (
            rows & ~wrong,
            "where the curve is low: left out as its noise floor; if it should not be, check the zero of the sensor",
        ),
    ):
        if np.any(chosen):
            first, others = int(np.argmax(chosen)), int(np.count_nonzero(chosen)) - 1
            name = spoken(kind.ordinates[int(np.argmax(below[:, first]))][0])
            more = f" here, and in {others} more row{'s' if others > 1 else ''}," if others else ""
            warn(f"the {name} {at} is zero or negative{more} {what}", file=source[first], line=int(line[first]))
