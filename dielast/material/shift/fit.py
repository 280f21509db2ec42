"""Weighted least squares for the constants of a shift law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class MovedLaw:
    """A fitted law about another reference temperature, and its `origin`: log10 a there, relative to the base temperature.

    `to_constants` (p, q) and `to_origin` (q,) are derivatives of the law's constants and of the origin with respect to the fitted
    parameters.

    `others` are the origins of other laws that the data allow, if a parameter is assumed and not fitted.
    """

    law: Any
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


def fit_factor(whiten: Floats, column: Floats, wanted: Floats) -> tuple[float, Floats, Floats, float]:
    """Fit `wanted` (k,) as a factor times `column` (k,): the factor, its variance (1, 1), its response (1, k) and the misfit."""
    white = whiten @ column
    variance = 1 / float(white @ white)
    response = variance * (white @ whiten)
    value = float(response @ wanted)
    return value, np.array([[variance]]), response[None, :], reduced_chi_square(whiten @ (wanted - value * column), 1)


def reduced_chi_square(whitened: Floats, parameters: int) -> float:
    """The squared distance (k,) in standard errors per degree of freedom; 0 without degrees of freedom."""
    freedom = whitened.size - parameters
    return float(whitened @ whitened) / freedom if freedom > 0 else 0.0
