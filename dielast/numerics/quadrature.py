"""Integrals of many functions at once, each as closely as it needs (Gauss and Kronrod)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dielast.numerics.columns import Cases, Floats

# nodes and weights of Kronrod's 15 points on (-1, 1), from an end to the middle, and Gauss's weights of 7 of them: QUADPACK's
# (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner, Springer 1983)
NODES = (
    0.991455371120812639206854697526329,
    0.949107912342758524526189684047851,
    0.864864423359769072789712788640926,
    0.741531185599394439863864773280788,
    0.586087235467691130294144691693013,
    0.405845151377397166906606412076961,
    0.207784955007898467600689403773245,
    0.0,
)
KRONROD = (
    0.022935322010529224963732008058970,
    0.063092092629978553290700663189204,
    0.104790010322250183839876322541518,
    0.140653259715525918745189590510238,
    0.169004726639267902826583426598550,
    0.190350578064785409913256402421014,
    0.204432940075298892414161999234649,
    0.209482141084727828012999174891714,
)
GAUSS = (
    0.0,
    0.129484966168869693270611432679082,
    0.0,
    0.279705391489276667901467771423780,
    0.0,
    0.381830050505118944950369775488975,
    0.0,
    0.417959183673469387755102040816327,
)
HALVINGS = 50  # of an interval; by then its ends are next to each other
CLOSE = 1e-8  # difference of the two rules, as a share of the integral; that of 15 points is then far more exact

Function = Callable[[Cases, Floats], Floats]
"""Values (m,) of the functions `columns` (m,) at numbers (m,)."""


def integrals(function: Function, low: Floats, high: Floats) -> Floats:
    """Integrals (k,) of functions that are not negative from `low` to `high` (k,).

    Intervals on which the rules of 7 and of 15 points differ are halved again and again, without regard to other columns. The error
    of a smooth function falls with the 23rd power of the interval.
    """
    total, columns = np.zeros(low.size), np.arange(low.size)
    halving = 0
    while True:
        kronrod, gauss = _rules(function, columns, low, high)
        estimate = total.copy()
        np.add.at(estimate, columns, kronrod)
        rough = np.abs(kronrod - gauss) > CLOSE * estimate[columns]
        if halving == HALVINGS or not rough.any():
            return estimate
        np.add.at(total, columns[~rough], kronrod[~rough])
        halving += 1
        # halves of an interval stay beside each other, so that no column's sum depends on the others
        columns, low, high = np.repeat(columns[rough], 2), low[rough], high[rough]
        middle = 0.5 * (low + high)
        low, high = np.stack((low, middle), axis=-1).ravel(), np.stack((middle, high), axis=-1).ravel()


def _rules(function: Function, columns: Cases, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """The integrals by 15 and by 7 points."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    kronrod, gauss = np.zeros((2, low.size))
    for node, weight, coarse in zip(NODES, KRONROD, GAUSS, strict=True):
        for at in (middle - node * half, middle + node * half) if node else (middle,):
            value = function(columns, at)
            kronrod += weight * value
            gauss += coarse * value
    return kronrod * half, gauss * half
