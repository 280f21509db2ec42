"""Adaptive Gauss integrals of many functions at once."""

from collections.abc import Callable

import numpy as np

from dielast.numerics.arrays import Cases, Floats

FINE, COARSE = (np.polynomial.legendre.leggauss(points) for points in (15, 7))
"""Nodes and weights of two Gauss-Legendre rules on (-1, 1)."""
HALVINGS = 50  # at most, of an interval; its ends are then neighbouring numbers
CLOSE = 1e-8  # accepted difference of the two rules over the integral; the error of the finer rule is then far smaller

Function = Callable[[Cases, Floats], Floats]
"""Values (m,) of the functions `columns` (m,) at numbers (m,)."""


def integrals(function: Function, low: Floats, high: Floats) -> Floats:
    """Integrals (k,) of nonnegative functions from `low` (k,) to `high` (k,).

    Intervals on which the 7-point and the 15-point rule differ are halved repeatedly, independently in each column. For a smooth
    function the error falls with the 31st power of the length of an interval.
    """
    total, columns = np.zeros(low.size), np.arange(low.size)
    halving = 0
    while True:
        fine, coarse = (_by_rule(rule, function, columns, low, high) for rule in (FINE, COARSE))
        estimate = total.copy()
        np.add.at(estimate, columns, fine)
        rough = np.abs(fine - coarse) > CLOSE * estimate[columns]
        if halving == HALVINGS or not rough.any():
            return estimate
        np.add.at(total, columns[~rough], fine[~rough])
        halving += 1
        # the halves of an interval stay adjacent, so that the order of summation in a column does not depend on other columns
        columns, low, high = np.repeat(columns[rough], 2), low[rough], high[rough]
        middle = 0.5 * (low + high)
        low, high = np.stack((low, middle), axis=-1).ravel(), np.stack((middle, high), axis=-1).ravel()


def _by_rule(rule: tuple[Floats, Floats], function: Function, columns: Cases, low: Floats, high: Floats) -> Floats:
    """The integrals (m,) by a rule with its nodes and weights."""
    middle, half, total = 0.5 * (low + high), 0.5 * (high - low), np.zeros(low.size)
    for node, weight in zip(*rule, strict=True):
        total += weight * function(columns, middle + node * half)
    return total * half
