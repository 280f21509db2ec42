"""Shares of sources in the variance of a result (Sobol' indices), by exchanging one source at a time between two inputs.

The first-order share of a source is S_i = Var(E(f | x_i)) / Var(f), the total share T_i = E(Var(f | all but x_i)) / Var(f) (Sobol',
Math. Comput. Simul. 55 (2001) 271, DOI 10.1016/S0378-4754(00)00270-6). With inputs a and b, and a' equal to a except for its source
i, which is taken from b,

    S_i Var(f) = E[f(b) (f(a') - f(a))]           Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, table 2 (b)
    T_i Var(f) = E[(f(a) - f(a'))^2] / 2          table 2 (f), after Jansen, Comput. Phys. Commun. 117 (1999) 35

DOI 10.1016/j.cpc.2009.09.018 and 10.1016/S0010-4655(98)00154-4. Both estimates are averaged with those for a and b exchanged.
"""

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Shares:
    """First-order and total shares (sources, ...) in the `variance` (...), with standard errors (sources, ...)."""

    first_order: Floats
    first_order_stderr: Floats
    total: Floats
    total_stderr: Floats
    variance: Floats


def variance_shares(one: Floats, other: Floats, one_exchanged: Floats, other_exchanged: Floats) -> Shares:
    """Shares from pairs of independent inputs.

    `one` and `other` (pairs, ...) are the results of the two inputs of each pair; `one_exchanged` and `other_exchanged`
    (sources, pairs, ...) are the results of the same inputs after one source is exchanged between them.

    Standard errors are those of the jackknife that omits one pair (Efron and Stein, Ann. Stat. 9 (1981) 586), NaN with fewer than
    two pairs. The shares in a result that does not vary are NaN.
    """
    pairs = one.shape[0]
    middle = 0.5 * (one.mean(axis=0) + other.mean(axis=0))
    f, g = one - middle, other - middle
    change_f, change_g = one_exchanged - one, other_exchanged - other
    product, drift = 0.5 * (g * change_f + f * change_g), 0.5 * (change_f + change_g)
    square = 0.25 * (change_f**2 + change_g**2)
    results, squares = f + g, f**2 + g**2

    def shares(count: int, product: Floats, drift: Floats, square: Floats, results: Floats, squares: Floats) -> tuple[Floats, ...]:
        """First-order shares, total shares and variance from sums over `count` pairs of results, taken relative to their mean."""
        mean = results / (2 * count)
        variance = (squares - results * mean) / (2 * count - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return (product - mean * drift) / count / variance, square / count / variance, variance

    sums = [terms.sum(axis=0) for terms in (results, squares)]
    by_source = [terms.sum(axis=1) for terms in (product, drift, square)]
    first, total, variance = shares(pairs, *by_source, *sums)
    errors = [np.full_like(first, np.nan)] * 2
    if pairs > 1:  # the sums without one pair, for each pair
        by_source_without = [
            all_pairs[:, None] - terms for all_pairs, terms in zip(by_source, (product, drift, square), strict=True)
        ]
        sums_without = [all_pairs - terms for all_pairs, terms in zip(sums, (results, squares), strict=True)]
        replicates = shares(pairs - 1, *by_source_without, *sums_without)[:2]
        errors = [np.sqrt((pairs - 1) * np.var(replicate, axis=1)) for replicate in replicates]
    constant = ~(variance > 0)
    first, first_error, total, total_error = (np.where(constant, np.nan, values) for values in (first, errors[0], total, errors[1]))
    return Shares(first, first_error, total, total_error, variance)
