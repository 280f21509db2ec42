"""Viscoelastic measurements at one temperature, as they come: a relaxation test, a frequency sweep, a creep test.

Moduli are Young's and compliances tensile throughout this boundary; the material is incompressible, so that shear moduli are a
third and shear compliances three times as much.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.units import ZERO_CELSIUS

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RelaxationCurve(Result):
    """Young's relaxation modulus `modulus` (n,) in Pa over `time` (n,) in s at `temperature` in degC; points in any order.

    Raises `InputError` if the lengths differ, a value is not finite, a time is not positive or the temperature is below absolute
    zero. A modulus may be zero or negative, as a noise floor gives; `build_master_curve` deals with it. `source` says where it
    comes from, for warnings.
    """

    temperature: float
    time: Array
    modulus: Array
    source: str = ""

    def __post_init__(self) -> None:
        _check(self, {"time": "s", "modulus": "Pa"}, "times must be positive, counted from the strain step")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CreepCurve(Result):
    """Tensile creep compliance `compliance` (n,) in 1/Pa over `time` (n,) in s at `temperature` in degC; points in any order.

    Raises `InputError` as `RelaxationCurve` does, times being counted from the stress step.
    """

    temperature: float
    time: Array
    compliance: Array
    source: str = ""

    def __post_init__(self) -> None:
        _check(self, {"time": "s", "compliance": "1/Pa"}, "times must be positive, counted from the stress step")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencySweep(Result):
    """Young's `storage_modulus` and `loss_modulus` (n,) in Pa over `angular_frequency` (n,) in rad/s at `temperature` in degC.

    Points in any order. Raises `InputError` as `RelaxationCurve` does.
    """

    temperature: float
    angular_frequency: Array
    storage_modulus: Array
    loss_modulus: Array
    source: str = ""

    def __post_init__(self) -> None:
        units = {"angular_frequency": "rad/s", "storage_modulus": "Pa", "loss_modulus": "Pa"}
        _check(self, units, "angular frequencies must be positive")


Measurement: TypeAlias = RelaxationCurve | CreepCurve | FrequencySweep


def _check(measurement: Measurement, units: dict[str, str], positive: str) -> None:
    """Make read-only arrays of the fields named in `units`, the first of them the positive abscissa."""
    where = f"{measurement.temperature:g} degC"
    if not -ZERO_CELSIUS < measurement.temperature < np.inf:
        raise InputError(f"temperature {where} is not a temperature above absolute zero")
    arrays = {name: np.array(getattr(measurement, name), dtype=float).reshape(-1) for name in units}
    abscissa, *others = arrays
    for name in others:
        if arrays[name].size != arrays[abscissa].size:
            raise InputError(
                f"{where}: {arrays[abscissa].size} {_many(abscissa)} but {arrays[name].size} {_many(name)}: "
                f"one {_one(name)} for each {_one(abscissa)} is needed"
            )
    for name, values in arrays.items():
        for k in np.flatnonzero(~np.isfinite(values))[:1]:
            raise InputError(f"{where}: {_one(name)} of point {k} is {values[k]}: a finite number is needed")
    for k in np.flatnonzero(arrays[abscissa] <= 0)[:1]:
        raise InputError(f"{where}: {_one(abscissa)} of point {k} is {arrays[abscissa][k]:g} {units[abscissa]}: {positive}")
    for name, values in arrays.items():
        values.flags.writeable = False
        object.__setattr__(measurement, name, values)


def _one(name: str) -> str:
    return name.replace("_", " ")


def _many(name: str) -> str:
    one = _one(name)
    if one.endswith("modulus"):
        return one[:-2] + "i"
    return one[:-1] + "ies" if one.endswith("y") else one + "s"
