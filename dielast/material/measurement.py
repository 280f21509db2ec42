"""Viscoelastic measurements at one temperature: a relaxation test, a frequency sweep, a creep test.

Moduli are Young's and compliances tensile; the material is incompressible, so that shear moduli are a third of Young's, and shear
compliances three times the tensile ones.
"""

from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from dielast.base.errors import InputError
from dielast.base.units import ZERO_CELSIUS
from dielast.io.result import Result, freeze
from dielast.io.table import plural, spoken
from dielast.material.argument_types import checked
from dielast.material.measurement_kind import CREEP, OSCILLATION, RELAXATION, MeasurementKind
from dielast.numerics.arrays import Floats


def is_temperature(value: float) -> bool:
    """Whether the `value` in degC is a temperature above absolute zero."""
    return -ZERO_CELSIUS < value < np.inf


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Measurement(Result):
    """A measurement at `temperature` (degC): an abscissa (n,) and one or two ordinates (n,), in the order of the fields.

    Raises `InputError` if the lengths differ, a value is not finite, an abscissa is not positive or the temperature is not above
    absolute zero. For messages, `source` names the origin of the measurement. `ramp_taken_out`, in a test over time, is the
    duration in s of the ramp for which the times are mean ages of the load: 0 after a step, None if it is not known whether there
    was a ramp.
    """

    KIND: ClassVar[MeasurementKind]
    temperature: float

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """The names of the fields of abscissa and ordinates."""
        return tuple(field.name for field in fields(cls)[1 : 2 + len(cls.KIND.ordinates)])

    @property
    def source(self) -> str:
        """The origin of the measurement."""
        raise NotImplementedError

    @property
    def ramp_taken_out(self) -> float | None:
        """The duration in s of the ramp for which times are mean ages; None if not stated."""
        return None

    @property
    def columns(self) -> Floats:
        """Abscissa and ordinates, (1 + c, n)."""
        return np.stack([getattr(self, name) for name in self.names()])

    def __post_init__(self) -> None:
        where, kind = f"{float(self.temperature):g} degC", type(self).KIND
        if not is_temperature(self.temperature):
            raise InputError(f"temperature {where} is not a temperature above absolute zero")
        arrays = {name: np.array(getattr(self, name), dtype=float) for name in self.names()}
        for name, values in arrays.items():
            if values.ndim > 1:
                raise InputError(f"{where}: {plural(name)} of shape {values.shape}: a list of numbers is needed")
            arrays[name] = values.reshape(-1)
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


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RelaxationCurve(Measurement):
    """Young's relaxation modulus `modulus` (n,) in Pa over `time` (n,) in s at `temperature` in degC; points in any order.

    Raises `InputError` as stated for `Measurement`. A modulus may be zero or negative (noise floor): `build_master_curve` leaves
    such points out. `source` names the origin, for warnings.
    """

    KIND = RELAXATION
    time: Floats
    modulus: Floats
    source: str = ""
    ramp_taken_out: float | None = None


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CreepCurve(Measurement):
    """Tensile creep compliance `compliance` (n,) in 1/Pa over `time` (n,) in s at `temperature` in degC; points in any order.

    Raises `InputError` as stated for `Measurement`. Times are counted from the stress step.
    """

    KIND = CREEP
    time: Floats
    compliance: Floats
    source: str = ""
    ramp_taken_out: float | None = None


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencySweep(Measurement):
    """Young's `storage_modulus` and `loss_modulus` (n,) in Pa over `angular_frequency` (n,) in rad/s at `temperature` in degC.

    Points in any order. Raises `InputError` as stated for `Measurement`.
    """

    KIND = OSCILLATION
    angular_frequency: Floats
    storage_modulus: Floats
    loss_modulus: Floats
    source: str = ""


def measurement_of(
    kind: MeasurementKind, temperature: float, columns: Floats, source: str, ramp_taken_out: float | None
) -> Measurement:
    """The measurement of a `kind` with abscissa and ordinates `columns` (1 + c, n)."""
    made: Any = next(curve for curve in (RelaxationCurve, CreepCurve, FrequencySweep) if curve.KIND is kind)
    ramp = {} if kind.over_frequency else {"ramp_taken_out": ramp_taken_out}
    measurement: Measurement = made(temperature, *columns, source, **ramp)
    return measurement
