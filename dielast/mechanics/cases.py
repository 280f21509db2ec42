"""Arguments that are one value for all cases, or one value per case."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.material.shift.arrhenius import kelvin
from dielast.numerics.arrays import Floats


def of_case(case: int, cases: int) -> int | None:
    """The case that an error names as its place; None if there is only one case."""
    return case if cases > 1 else None


def numbers(values: ArrayLike, name: str) -> Floats:
    """One number or a list of them as an array (cases,); `InputError` with the argument `name` for an array of another shape."""
    array = np.asarray(values, dtype=float)
    if array.ndim > 1 or not array.size:
        raise InputError(f"an array of shape {array.shape}: one number, or one for each case, is needed", argument=name)
    return array.reshape(-1)


def one_set(sizes: Iterable[int]) -> int:
    """The number of cases of arrays of these sizes; `InputError` if two sizes differ and neither is 1."""
    several = set(sizes) - {1}
    if len(several) > 1:
        raise InputError(f"arrays of {' and '.join(map(str, sorted(several)))} values do not make one set of cases")
    return several.pop() if several else 1


def spread(value: ArrayLike, name: str, cases: int) -> Floats:
    """The values as an array (cases,), a single number repeated; `InputError` with the argument `name` if one is not finite."""
    array = numbers(value, name)
    if not np.all(np.isfinite(array)):
        raise InputError("every value must be finite", argument=name)
    return np.ascontiguousarray(np.broadcast_to(array, (cases,)))


def temperatures_of(value: ArrayLike, cases: int) -> Floats:
    """The temperatures in degC as an array (cases,); `InputError` at or below absolute zero."""
    values = spread(value, "temperature", cases)
    if np.any(below := kelvin(values) <= 0):
        case = int(np.argmax(below))
        raise InputError(f"{values[case]:g} degC is at or below absolute zero", argument="temperature", case=of_case(case, cases))
    return values
