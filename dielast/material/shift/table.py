"""A table of measured shift factors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.law import Constant, check_table
from dielast.material.shift.law import ShiftLaw, slower_when_hot
from dielast.numerics.arrays import Floats

ROUNDING = 1e-6  # of log10 a; dielast writes 9 digits


@checked
@dataclass(frozen=True, slots=True, repr=False)
class ShiftTable(Result, ShiftLaw):
    """Measured shift factors, interpolated linearly in log10 a over T; `InputError` outside the measured range.

    `temperature` in degC, ascending, and `log10_shift` have the same length. log10 a at the reference temperature is subtracted.
    """

    reference_temperature: float
    temperature: tuple[float, ...]
    log10_shift: tuple[float, ...]

    name: ClassVar = "table"
    title: ClassVar = "shift table"
    constants: ClassVar = (
        Constant("temperature", "Temperatures of the table in degC.", many=True, key="temperature_degC"),
        Constant(
            "log10_shift",
            "Log10 of the shift factor of relaxation times at each temperature of the table; positive below the reference "
            "temperature.",
            many=True,
            key="log10_shift_factor",
        ),
    )

    def __post_init__(self) -> None:
        check_table(self.title, ("temperatures", self.temperature), ("shift factors", self.log10_shift))

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """log10 a(T), shifted so that it is zero at the reference temperature."""
        values = np.asarray(temperature, dtype=float)
        low, high = self.measured_range()
        outside = (values < low) | (values > high)
        if np.any(outside):
            first = float(np.atleast_1d(values[outside])[0])
            raise InputError(f"{first:g} degC is outside the shift table's {low:g} to {high:g} degC", argument="temperature")
        return np.asarray(np.interp(values, self.temperature, self.log10_shift) - self._origin())

    def _origin(self) -> float:
        return float(np.interp(self.reference_temperature, self.temperature, self.log10_shift))

    def measured_range(self) -> tuple[float, float]:
        """The first and the last temperature."""
        return self.temperature[0], self.temperature[-1]

    def label(self) -> str:
        """The interpolation of the table, for a legend."""
        return "linear in between"

    def warning(self) -> str:
        """A warning if the table is not 0 at the reference temperature, or if log10 a increases between two temperatures."""
        return "; ".join(filter(None, (self._displaced(), self._increasing())))

    def _increasing(self) -> str:
        rises = np.diff(self.log10_shift)
        if not np.any(rises > ROUNDING):
            return ""
        k = int(np.argmax(rises))
        low, high = self.temperature[k : k + 2]
        stated = f"the shift table's log10 a increases by {rises[k]:.3g} from {low:g} to {high:g} degC"
        whole = "should the signs be the other way round?" if np.all(rises > 0) else "is this entry right?"
        return slower_when_hot(stated, whole)

    def _displaced(self) -> str:
        there, origin = self.reference_temperature, self._origin()
        if abs(origin) <= ROUNDING:
            return ""
        stated = f"the shift table gives log10 a = {origin:.3g} at the reference temperature {there:g} degC, where it must be 0"
        mend = f"state the temperature that the table refers to, or an entry of 0 at {there:g} degC"
        return f"{stated}: {origin:.3g} is subtracted from every entry; {mend}"

    @classmethod
    def through(cls, temperature: Floats, log10_shift_factor: Floats, reference_temperature: float) -> tuple[Self, Floats]:
        """The table itself, with a row for the reference temperature, interpolated by a cubic through its four neighbours."""
        if not temperature[0] <= reference_temperature <= temperature[-1]:
            raise InputError(
                f"{reference_temperature:g} degC is outside {temperature[0]:g} to {temperature[-1]:g} degC, where the shift table "
                "ends: choose a law, or a reference temperature within",
                argument="reference_temperature",
            )
        weight = np.zeros(temperature.size)
        first = int(np.clip(np.searchsorted(temperature, reference_temperature) - 2, 0, max(temperature.size - 4, 0)))
        near = np.arange(first, min(first + 4, temperature.size))
        gap = temperature[near][:, None] - temperature[near] + np.eye(near.size)
        ratio = np.where(np.eye(near.size) > 0, 1.0, (reference_temperature - temperature[near]) / gap)
        weight[near] = np.prod(ratio, axis=1)
        relative = log10_shift_factor - float(weight @ log10_shift_factor)
        rows = {**dict(zip(temperature.tolist(), relative.tolist(), strict=True)), float(reference_temperature): 0.0}
        return cls(reference_temperature, *zip(*sorted(rows.items()), strict=True)), weight

    def drawn(self) -> dict[tuple[str, str], float]:
        """The shift factor at every temperature."""
        rows = zip(self.temperature, self.log10_shift, strict=True)
        return {(f"log10_shift_factor_{temperature:g}", "1"): value for temperature, value in rows}

    def redrawn(self, numbers: list[float]) -> Self:
        """The table with other shift factors."""
        return replace(self, log10_shift=tuple(numbers))

    def numbers_of(self, other: ShiftLaw) -> Floats:
        """The shift factors of the other law at the temperatures of this table."""
        return other.log10_shift_factor(np.array(self.temperature))

    @classmethod
    def from_summary(
        cls, reference_temperature: float, summary: Mapping[str, Any], measured: Callable[[], tuple[Floats, Floats]]
    ) -> Self:
        """The table of the measured shift factors."""
        temperature, factor = measured()
        measured_rows = dict(zip(temperature.tolist(), factor.tolist(), strict=True)) | {reference_temperature: 0.0}
        rows = sorted((at, value) for at, value in measured_rows.items() if np.isfinite(value))
        return cls(reference_temperature, *zip(*rows, strict=True))
