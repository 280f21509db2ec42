"""Adaptive Gauss-Kronrod integrals of many functions at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dielast.numerics.arrays import Cases, Floats

# Nodes and weights of the 15-point Kronrod rule on (-1, 1), from an end to the middle, and the weights of the 7-point Gauss rule at
# the same nodes, as in QUADPACK (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner, Springer 1983).
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
HALVINGS = 50  # at most, of an interval; its ends are then neighbouring numbers
CLOSE = 1e-8  # accepted difference of the two rules over the integral; the error of the 15-point rule is then far smaller

Function = Callable[[Cases, Floats], Floats]
"""Values (m,) of the functions `columns` (m,) at numbers (m,)."""


def integrals(function: Function, low: Floats, high: Floats) -> Floats:
    """Integrals (k,) of nonnegative functions from `low` (k,) to `high` (k,).

    Intervals on which the 7-point and the 15-point rule differ are halved repeatedly, independently in each column. For a smooth
    function the error falls with the 23rd power of the length of an interval.
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
        # the halves of an interval stay adjacent, so that the order of summation in a column does not depend on other columns
        columns, low, high = np.repeat(columns[rough], 2), low[rough], high[rough]
        middle = 0.5 * (low + high)
        low, high = np.stack((low, middle), axis=-1).ravel(), np.stack((middle, high), axis=-1).ravel()


def _rules(function: Function, columns: Cases, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """The integrals (m,) by the 15-point and by the 7-point rule."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    kronrod, gauss = np.zeros((2, low.size))
    for node, weight, coarse in zip(NODES, KRONROD, GAUSS, strict=True):
        for at in (middle - node * half, middle + node * half) if node else (middle,):
            value = function(columns, at)
            kronrod += weight * value
            gauss += coarse * value
    return kronrod * half, gauss * half
