"""Numbers that carry their first and second derivatives in two variables: exact gradients and Hessians of plain formulas.

A `Taylor` number is the quadratic part of a function's Taylor series at a point, after x1 and x2. Sums, products, quotients,
powers and `log` of such numbers follow the rules of differentiation to the last digit, so that an energy written for ordinary
numbers gives stress and tangent without a second formula, and without the cancellation of differences.
"""

from __future__ import annotations

from typing import Any

import numpy as np


class Taylor:
    """`parts` (6, ...): value, d/dx1, d/dx2, d2/dx1dx1, d2/dx1dx2, d2/dx2dx2 of a quantity, real or complex."""

    __array_ufunc__ = None  # an array times a Taylor number is a Taylor number, not an array of them

    def __init__(self, parts: Any) -> None:
        self.parts = np.asarray(parts)

    def function(self, value: Any, first: Any, second: Any) -> Taylor:
        """f of this number, from f, f' and f'' at its value: the chain rule."""
        _, a1, a2, *_ = self.parts
        parts = first * self.parts
        parts[0] = value
        parts[3] += second * a1 * a1
        parts[4] += second * a1 * a2
        parts[5] += second * a2 * a2
        return Taylor(parts)

    def __add__(self, other: Any) -> Taylor:
        if isinstance(other, Taylor):
            return Taylor(self.parts + other.parts)
        parts = self.parts + np.zeros_like(other)
        parts[0] = self.parts[0] + other
        return Taylor(parts)

    def __mul__(self, other: Any) -> Taylor:
        if not isinstance(other, Taylor):
            return Taylor(self.parts * other)
        a0, a1, a2, *_ = self.parts
        b0, b1, b2, *_ = other.parts
        parts = a0 * other.parts + b0 * self.parts
        parts[0] = a0 * b0
        parts[3] += 2 * a1 * b1
        parts[4] += a1 * b2 + a2 * b1
        parts[5] += 2 * a2 * b2
        return Taylor(parts)

    def __pow__(self, n: float) -> Taylor:
        a = self.parts[0]
        return self.function(a**n, n * a ** (n - 1), n * (n - 1) * a ** (n - 2))

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Taylor:
        return Taylor(-self.parts)

    def __sub__(self, other: Any) -> Taylor:
        return self + -other

    def __rsub__(self, other: Any) -> Taylor:
        return other + -self

    def __truediv__(self, other: Any) -> Taylor:
        return self * other**-1.0

    def __rtruediv__(self, other: Any) -> Taylor:
        return other * self**-1.0


def log(x: Any) -> Any:
    """Natural logarithm of a number, real, complex or Taylor."""
    if isinstance(x, Taylor):
        a = x.parts[0]
        return x.function(np.log(a), 1 / a, -(a**-2.0))
    return np.log(x)


def stretches(log_stretch: Any) -> tuple[Taylor, Taylor]:
    """The stretches l1 and l2 as functions of x1 = ln l1 and x2 = ln l2, from `log_stretch` (2, ...).

    The derivatives of an energy W(l1, l2) in x1 and x2 are the stress l_i dW/dl_i and the symmetric tangent of science.md, Sec. 3.
    """
    l1, l2 = np.exp(log_stretch)
    none = np.zeros_like(l1)
    return Taylor(np.stack((l1, l1, none, l1, none, none))), Taylor(np.stack((l2, none, l2, none, none, l2)))
