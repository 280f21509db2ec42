"""Numbers in SI as a notebook gives them: arrays, lists, columns of data frames, and what only looks like one of these."""

from __future__ import annotations

from typing import Any

import numpy as np

from dielast.errors import InputError, shown
from dielast.numerics.arrays import Floats

# what numpy would make numbers of in silence: a duration in nanoseconds of its count, a complex number of its real part
NO_NUMBERS = {"m": "durations", "M": "dates", "c": "complex numbers", "U": "text", "S": "text"}


def real_numbers(values: Any, name: str) -> Floats:
    """The values as an array of any shape; `InputError` with the argument `name` for text, dates, durations, complex numbers,
    values that a mask hides, and whatever else is no array of numbers.
    """
    needed = "a number in SI units, or a list of numbers, is needed"
    try:
        array = np.asanyarray(values)
        if array.dtype.kind == "O":
            array = np.array([_number(value) for value in array.ravel()]).reshape(array.shape)
        if array.dtype.kind in NO_NUMBERS and array.size:
            raise InputError(f"{shown(values)}: {needed}, not {NO_NUMBERS[array.dtype.kind]}", argument=name)
        if np.any(getattr(array, "mask", False)):  # numpy.ma takes its time to load
            raise InputError(f"some values are masked: leave them out ({name}.compressed())", argument=name)
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{shown(values)}: {needed}", argument=name) from None


def real_number(value: Any, name: str) -> float:
    """One number; `InputError` with the argument `name` as `real_numbers` says, and for several."""
    array = real_numbers(value, name)
    if array.ndim:
        raise InputError(f"an array of shape {array.shape}: one number is needed", argument=name)
    return float(array)


def _number(value: Any) -> float:
    if isinstance(value, str):
        raise TypeError
    return float(value)
