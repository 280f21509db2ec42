"""Laws of ageing by the field as one function g of the log field and a slope: a specimen ages at the rate exp(g).

    power        g = s ln(E/E_c): the inverse power law of exponent s
    exponential  g = s E/E_c: the exponential law
    eyring       g = ln sinh(s E/E_c): thermally activated jumps that the field favours in one direction (Eyring, J. Chem. Phys. 4
                 (1936) 283; for insulation Dissado and Fothergill, Electrical Degradation and Breakdown in Polymers (1992), Ch. 14)

E_c is a field in the middle of those of the specimens, which keeps the numbers of a fit of order one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError
from dielast.numerics.arrays import Floats

KINDS = ("power", "exponential", "eyring")


@dataclass(frozen=True, slots=True)
class Ageing:
    """The law of this `kind`, with E_c the `centre` in V/m (or in V, for laws of the voltage)."""

    kind: str
    centre: float

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"{self.kind!r}: one of {', '.join(KINDS)} is needed", argument="kind")

    @property
    def slopes(self) -> tuple[float, float]:
        """The range of the slope s."""
        return (0.2, 400.0)

    def along(self, log_field: Floats, slope: float) -> tuple[Floats, Floats, Floats]:
        """g, and its first and second derivative by the slope, at log fields of any shape."""
        e = log_field - np.log(self.centre)
        if self.kind == "power":
            return slope * e, e, np.zeros_like(e)
        field = np.exp(e)
        if self.kind == "exponential":
            return slope * field, field, np.zeros_like(e)
        x = slope * field
        coth, over = _coth(x)
        return _log_sinh(x), field * coth, -((field * over) ** 2)

    def at(self, log_field: Floats, slope: Floats) -> tuple[Floats, ...]:
        """g and its derivatives g_e, g_s, g_ee, g_es, g_ss by the log field e and the slope s, which broadcast."""
        e = log_field - np.log(self.centre)
        zero = np.zeros(np.broadcast(e, slope).shape)
        if self.kind == "power":
            return slope * e, slope + zero, e + zero, zero, 1 + zero, zero
        field = np.exp(e)
        if self.kind == "exponential":
            return slope * field, slope * field, field + zero, slope * field, field + zero, zero
        x = slope * field
        coth, over = _coth(x)
        bend = x * coth - (x * over) ** 2
        return _log_sinh(x), x * coth, field * coth, bend, bend / slope, -((field * over) ** 2)

    def field_of(self, g: Floats, slope: Floats) -> Floats:
        """The log field e at which the law is g."""
        if self.kind == "power":
            e = g / slope
        elif self.kind == "exponential":
            e = np.log(np.maximum(g / slope, 1e-300))
        else:
            # sinh x = exp(g)
            e = np.log(np.where(g > 30, np.maximum(g, 30.0) + np.log(2), np.arcsinh(np.exp(np.minimum(g, 30.0)))) / slope)
        return np.asarray(e + np.log(self.centre))


def _log_sinh(x: Floats) -> Floats:
    return np.asarray(x + np.log(-0.5 * np.expm1(-2 * x)))


def _coth(x: Floats) -> tuple[Floats, Floats]:
    """coth x and 1/sinh x."""
    small = np.exp(-2 * x)
    return (1 + small) / (1 - small), 2 * np.exp(-x) / (1 - small)
