"""Shares of the variance of a result that its sources have, by exchanging one source after the other between two inputs.

The first-order share of a source is S_i = Var(E(f | x_i)) / Var(f), the total share T_i = E(Var(f | all but x_i)) / Var(f) (Sobol',
Math. Comput. Simul. 55 (2001) 271, DOI 10.1016/S0378-4754(00)00270-6). With inputs a and b, and a' that is a but for source i of b,

    S_i Var(f) = E[f(b) (f(a') - f(a))]           Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, table 2 (b)
    T_i Var(f) = E[(f(a) - f(a'))^2] / 2          table 2 (f), after Jansen, Comput. Phys. Commun. 117 (1999) 35

DOI 10.1016/j.cpc.2009.09.018 and 10.1016/S0010-4655(98)00154-4. Both are averaged over a and b in either order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Shares:
    """First-order and total shares (sources, ...) of the `variance` (...), each with its standard error."""

    first_order: Floats
    first_order_stderr: Floats
    total: Floats
    total_stderr: Floats
    variance: Floats


def variance_shares(one: Floats, other: Floats, one_exchanged: Floats, other_exchanged: Floats) -> Shares:
    """Shares from the results `one` and `other` (pairs, ...) of independent inputs, and from those (sources, pairs, ...) of the
    same inputs with a source exchanged between the two inputs of each pair.

    Standard errors are those of the jackknife that leaves out a pair (Efron and Stein, Ann. Stat. 9 (1981) 586), NaN with fewer
    than two pairs. What does not vary has no shares: NaN.
    """
    pairs = one.shape[0]
    middle = 0.5 * (one.mean(axis=0) + other.mean(axis=0))
    f, g = one - middle, other - middle
    moved, back = one_exchanged - one, other_exchanged - other
    product, drift = 0.5 * (g * moved + f * back), 0.5 * (moved + back)
    square = 0.25 * (moved**2 + back**2)
    plain, squares = f + g, f**2 + g**2

    def shares(count: int, product: Floats, drift: Floats, square: Floats, plain: Floats, squares: Floats) -> tuple[Floats, ...]:
        """Shares from the sums over so many pairs; all results count from their mean."""
        mean = plain / (2 * count)
        variance = (squares - plain * mean) / (2 * count - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return (product - mean * drift) / count / variance, square / count / variance, variance

    sums = [each.sum(axis=0) for each in (plain, squares)]
    by_source = [each.sum(axis=1) for each in (product, drift, square)]
    first, total, variance = shares(pairs, *by_source, *sums)
    errors = [np.full_like(first, np.nan)] * 2
    if pairs > 1:
        without = [whole[:, None] - each for whole, each in zip(by_source, (product, drift, square), strict=True)]
        rest = [whole - each for whole, each in zip(sums, (plain, squares), strict=True)]
        left = shares(pairs - 1, *without, *rest)[:2]
        errors = [np.sqrt((pairs - 1) * np.var(each, axis=1)) for each in left]
    still = ~(variance > 0)
    first, first_error, total, total_error = (np.where(still, np.nan, each) for each in (first, errors[0], total, errors[1]))
    return Shares(first, first_error, total, total_error, variance)
