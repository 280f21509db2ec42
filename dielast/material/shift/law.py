"""Base of the time-temperature shift laws: the factor on all relaxation times at a temperature.

The shift factor is a(T) = tau(T) / tau(T_ref): log10 a > 0 below the reference temperature, where relaxation is slower, and < 0
above it. Reduced time is t / a(T). Temperatures are in degC.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.law import Constant, Law
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class MovedLaw:
    """A fitted law about another reference temperature, and its `origin`: log10 a there, relative to the base temperature.

    `to_constants` (p, q) and `to_origin` (q,) are derivatives of the law's constants and of the origin with respect to the fitted
    parameters.

    `others` are the origins of other laws that the data allow, if a parameter is assumed and not fitted.
    """

    law: ShiftLaw
    to_constants: Floats
    origin: float
    to_origin: Floats
    others: Floats


@dataclass(frozen=True, slots=True, eq=False)
class FittedLaw:
    """A law fitted about the base temperature; `about(distance)` is the law about a temperature so many K away.

    `moments` (q, q) is the covariance of the parameters, `response` (q, k) their derivative with respect to the shift factors,
    `misfit` the reduced chi-square. `assumed` is a message on a parameter that is assumed, and why.
    """

    about: Callable[[float], MovedLaw]
    moments: Floats
    response: Floats
    misfit: float
    assumed: str = ""


class ShiftLaw(Law):
    """Base of the shift laws: frozen dataclasses whose first field is `reference_temperature` (degC), where log10 a = 0.

    A law defines `log10_shift_factor`, and `fit` if it can be fitted to shift factors.
    """

    __slots__ = ()
    reference_temperature: float
    is_fitted: ClassVar[bool] = True  # whether mastercurve can fit it
    depends_on_temperature: ClassVar[bool] = True

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """log10 a(T) for temperatures in degC, of the same shape; `InputError` where the law does not hold."""
        raise NotImplementedError

    def measured_range(self) -> tuple[float, float] | None:
        """Lowest and highest temperature (degC) at which the law holds; None if the law has no such range."""
        return None

    def label(self) -> str:
        """The law and its constants, for the legend of a figure."""
        return self.title

    def warning(self) -> str:
        """A warning if the constants look wrong, else an empty text."""
        return ""

    def equivalent(self) -> ShiftLaw:
        """The same law under the name that finite-element codes know it by."""
        return self

    @classmethod
    def fit(cls, base: float, distance: Floats, log10_shift: Floats, whiten: Floats) -> FittedLaw:
        """Fit the law to shift factors by generalised least squares.

        `log10_shift` (k,) is log10 a at temperatures `base` + `distance` (k,), relative to `base` (degC); `whiten` (k, k) makes its
        errors independent, with variance 1.
        """
        raise InputError(f"the {cls.title} law cannot be fitted: state it in the material file")

    @classmethod
    def through(cls, temperature: Floats, log10_shift_factor: Floats, reference_temperature: float) -> tuple[Self, Floats] | None:
        """The law that meets log10 a (m,) at `temperature` (m,), ascending, exactly; None if the law cannot.

        Also returns the weights (m,) of the shift factors in log10 a at the `reference_temperature`.
        """
        return None

    def drawn(self) -> dict[tuple[str, str], float]:
        """The numbers that differ between draws, by name and unit."""
        return {(constant.name, constant.unit): float(getattr(self, constant.name)) for constant in self.constants}

    def drawn_headers(self) -> list[str]:
        """The headers of the columns of `drawn`."""
        return [f"{name} [{unit}]" for name, unit in self.drawn()]

    def redrawn(self, numbers: list[float]) -> Self:
        """The law with other numbers, in the order of `drawn`; raises `InputError` naming the column of an invalid number."""
        for constant, header, value in zip(self.constants, self.drawn_headers(), numbers, strict=True):
            if not constant.is_allowed(value):
                raise InputError(f'column "{header}": {value:g}: a number {constant.bounds} is needed')
        return self.with_values({constant.name: value for constant, value in zip(self.constants, numbers, strict=True)})

    def numbers_of(self, other: ShiftLaw) -> Floats:
        """The numbers of the `other` law, which was fitted in the same way, in the order of `drawn`."""
        return np.array(list(other.drawn().values()))

    @classmethod
    def summary_names(cls) -> dict[str, Constant]:
        """The constants that are single numbers, by their names in a summary, which end with the unit."""
        return {constant.name + constant.suffix: constant for constant in cls.constants if not constant.many}

    def summary(self, covariance: Floats) -> dict[str, float]:
        """The constants for a summary, with standard errors and covariances from their `covariance` (p, p)."""
        summary: dict[str, float] = {}
        names = self.summary_names()
        for index, (key, constant) in enumerate(names.items()):
            summary |= {key: getattr(self, constant.name), f"{key}_stderr": float(np.sqrt(covariance[index, index]))}
        for (i, first), (j, second) in combinations(enumerate(names.values()), 2):
            summary[f"{first.name}_{second.name}_covariance{first.suffix}{second.suffix}"] = float(covariance[i, j])
        return summary

    @classmethod
    def from_summary(
        cls, reference_temperature: float, summary: Mapping[str, Any], measured: Callable[[], tuple[Floats, Floats]]
    ) -> Self:
        """The law from the constants in a `summary`; `measured` are temperatures (degC) and log10 a, if they are needed."""
        named = {constant.name: float(summary[key]) for key, constant in cls.summary_names().items()}
        return cls(reference_temperature, **named)  # type: ignore[call-arg]


@checked
@dataclass(frozen=True, slots=True)
class NoShift(ShiftLaw):
    """Relaxation times that do not depend on temperature: log10 a = 0 at all temperatures; `reference_temperature` in degC."""

    reference_temperature: float

    name: ClassVar = "none"
    title: ClassVar = "no shift"
    is_fitted: ClassVar = False
    depends_on_temperature: ClassVar = False

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """0 at every temperature."""
        return np.zeros(np.shape(temperature))


def refuse_frozen(temperature: ArrayLike, above: Floats, limit: str) -> None:
    """`InputError` for the lowest `temperature` (degC) if any is not `above` (K, same shape) the `limit` of a law, in words."""
    if np.any(above <= 0):
        raise InputError(f"{float(np.min(np.asarray(temperature))):g} degC is at or below {limit}", argument="temperature")


def slower_when_hot(what: str, mend: str) -> str:
    """The warning of shift factors that increase with temperature; `what` states them, `mend` says what may be wrong."""
    return f"{what}: relaxation gets slower with temperature, but in polymers it gets faster; {mend}"


def fit_factor(whiten: Floats, column: Floats, log10_shift: Floats) -> tuple[float, Floats, Floats, float]:
    """`log10_shift` (k,) as a factor times `column` (k,): the factor, its variance (1, 1), its response (1, k) and the misfit."""
    white = whiten @ column
    variance = 1 / float(white @ white)
    response = variance * (white @ whiten)
    value = float(response @ log10_shift)
    return value, np.array([[variance]]), response[None, :], reduced_chi_square(whiten @ (log10_shift - value * column), 1)


def reduced_chi_square(whitened: Floats, parameters: int) -> float:
    """The squared distance (k,) in standard errors per degree of freedom; 0 without degrees of freedom."""
    freedom = whitened.size - parameters
    return float(whitened @ whitened) / freedom if freedom > 0 else 0.0
