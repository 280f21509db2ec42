"""Viscoelastic measurements at one temperature: a relaxation test, a frequency sweep, or a creep test.

Moduli are Young's and compliances tensile in all of these; the material is incompressible, so that shear moduli are a third of
these, and shear compliances three times as much.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from dielast.errors import InputError
from dielast.io.result import Result, freeze
from dielast.io.table import plural, spoken
from dielast.material.measurement_kind import CREEP, OSCILLATION, RELAXATION, MeasurementKind
from dielast.numerics.arrays import Floats
from dielast.units import ZERO_CELSIUS


def is_temperature(value: float) -> bool:
    """Whether the `value` in degC is a temperature above absolute zero."""
    return -ZERO_CELSIUS < value < np.inf


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Measurement(Result):
    """A measurement at `temperature` (degC): an abscissa and one or two ordinates, (n,) each, in the order of the fields.

    For messages, `source` names the origin of the measurement, and `time_offset` in s is what was subtracted from the measured
    times. Raises `InputError` if the lengths differ, a value is not finite, an abscissa is not positive, or the temperature is not
    above absolute zero.
    """

    KIND: ClassVar[MeasurementKind]
    temperature: float

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """The names of the fields of abscissa and ordinates."""
        return tuple(field.name for field in fields(cls)[1 : 2 + len(cls.KIND.ordinates)])

    @property
    def source(self) -> str:
        """The origin of the measurement, for messages."""
        raise NotImplementedError

    @property
    def time_offset(self) -> float:
        """The time in s that was subtracted from the measured times."""
        return 0.0

    @property
    def columns(self) -> Floats:
        """Abscissa and ordinates, (1 + c, n)."""
        return np.stack([getattr(self, name) for name in self.names()])

    def with_columns(self, columns: Floats) -> Self:
        """The measurement with other values (1 + c, n)."""
        return replace(self, **dict(zip(self.names(), columns, strict=True)))

    def __post_init__(self) -> None:
        where, kind = f"{self.temperature:g} degC", type(self).KIND
        if not is_temperature(self.temperature):
            raise InputError(f"temperature {where} is not a temperature above absolute zero")
        arrays = {name: np.array(getattr(self, name), dtype=float).reshape(-1) for name in self.names()}
        abscissa, *others = arrays
        for name in others:
            if arrays[name].size != arrays[abscissa].size:
                raise InputError(
                    f"{where}: {arrays[abscissa].size} {plural(abscissa)} but {arrays[name].size} {plural(name)}: "
                    f"one {spoken(name)} for each {spoken(abscissa)} is needed"
                )
        for name, values in arrays.items():
            for k in np.flatnonzero(~np.isfinite(values))[:1]:
                raise InputError(f"{where}: {spoken(name)} of point {k} is {values[k]}: a finite number is needed")
        for k in np.flatnonzero(arrays[abscissa] <= 0)[:1]:
            start = f", counted from the {kind.step} step" if kind.step else ""
            stated = f"{spoken(abscissa)} of point {k} is {arrays[abscissa][k]:g} {kind.abscissa[1]}"
            raise InputError(f"{where}: {stated}: {plural(abscissa)} must be positive{start}")
        freeze(self, arrays)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RelaxationCurve(Measurement):
    """Young's relaxation modulus `modulus` (n,) in Pa over `time` (n,) in s at `temperature` in degC; points in any order.

    Raises `InputError` as `Measurement` does. A modulus may be zero or negative, as in a noise floor; `build_master_curve` treats
    such points. `source` names the origin, for messages.
    """

    KIND = RELAXATION
    time: Floats
    modulus: Floats
    source: str = ""
    time_offset: float = 0.0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CreepCurve(Measurement):
    """Tensile creep compliance `compliance` (n,) in 1/Pa over `time` (n,) in s at `temperature` in degC; points in any order.

    Raises `InputError` as `Measurement` does. Times count from the stress step.
    """

    KIND = CREEP
    time: Floats
    compliance: Floats
    source: str = ""
    time_offset: float = 0.0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencySweep(Measurement):
    """Young's `storage_modulus` and `loss_modulus` (n,) in Pa over `angular_frequency` (n,) in rad/s at `temperature` in degC.

    Points are in any order. Raises `InputError` as `Measurement` does.
    """

    KIND = OSCILLATION
    angular_frequency: Floats
    storage_modulus: Floats
    loss_modulus: Floats
    source: str = ""


def measurement_of(kind: MeasurementKind, temperature: float, columns: Floats, source: str, time_offset: float) -> Measurement:
    """The measurement of a `kind` with abscissa and ordinates `columns` (1 + c, n)."""
    made: Any = next(known for known in (RelaxationCurve, CreepCurve, FrequencySweep) if known.KIND is kind)
    offset = {} if kind.over_frequency else {"time_offset": time_offset}
    measurement: Measurement = made(temperature, *columns, source, **offset)
    return measurement
