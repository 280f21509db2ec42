"""Arguments that are numbers in SI: arrays, lists or columns of data frames; refused are values that only look like numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from dielast.errors import InputError, shown
from dielast.numerics.arrays import Flags, Floats
from dielast.units import ZERO_CELSIUS

# kinds that numpy converts without a warning: a duration to its count of nanoseconds, a complex number to its real part
NO_NUMBERS = {"m": "durations", "M": "dates", "c": "complex numbers", "U": "text", "S": "text"}


def real_numbers(values: Any, name: str) -> Floats:
    """The values as an array of any shape; `InputError` with the argument `name` for text, dates, durations, complex numbers,
    masked values, and all other values that are no array of numbers.
    """
    needed = "a number in SI units, or a list of numbers, is needed"
    try:
        array = np.asanyarray(values)
        if array.dtype.kind == "O":
            if any(isinstance(value, str) for value in array.ravel()):
                raise TypeError
            array = np.array([float(value) for value in array.ravel()]).reshape(array.shape)
        if array.dtype.kind in NO_NUMBERS and array.size:
            raise InputError(f"{shown(values)}: {needed}, not {NO_NUMBERS[array.dtype.kind]}", argument=name)
        if np.any(getattr(array, "mask", False)):  # without an import of numpy.ma, which is slow
            raise InputError(f"some values are masked: leave them out ({name}.compressed())", argument=name)
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{shown(values)}: {needed}", argument=name) from None


def real_number(value: Any, name: str) -> float:
    """One number; `InputError` with the argument `name` as in `real_numbers`, and for several numbers."""
    array = real_numbers(value, name)
    if array.ndim:
        raise InputError(f"an array of shape {array.shape}: one number is needed", argument=name)
    return float(array)


def whole_number(value: Any, name: str) -> int:
    """One whole number; `InputError` with the argument `name` as in `real_number`, and for a fraction."""
    number = real_number(value, name)
    if not number.is_integer():
        raise InputError(f"{number:g}: a whole number is needed", argument=name)
    return int(number)


def are_too_cold(temperature: Floats) -> Flags:
    """Whether temperatures (any shape) in degC are at or below absolute zero."""
    return np.asarray(temperature <= -ZERO_CELSIUS)
