"""How many failures tests contradict where the shape of a Weibull life is known (Weibayes), and test plans.

With the shape b, the sum of t^b over all specimens, failed or not, is that of an exponential test: twice the sum over eta^b is
chi-squared distributed with 2 r + 2 degrees of freedom for a lower bound of the scale eta after r failures (Nelson, IEEE Trans.
Reliability R-34 (1985) 129; Abernethy, The New Weibull Handbook (2006), Ch. 6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaincinv

from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.numerics.arrays import Floats


def most_expected(failures: int, confidence: float) -> float:
    """The number of expected failures that `failures` or fewer contradict at the confidence: half the chi-squared quantile."""
    return float(-np.log1p(-confidence) if failures == 0 else gammaincinv(failures + 1, confidence))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TestPlan(TabularResult):
    """Tests that would show a goal without a further failure: for each `duration` (k,) in s of a test of one specimen, the
    number of `specimens` (k,) and the `total` (k,) time in s of all of them.
    """

    __test__ = False

    duration: Floats
    specimens: Floats
    total: Floats

    def columns(self) -> Table:
        """The table, one row per duration."""
        return [
            Column("duration", "s", self.duration),
            Column("specimens", None, self.specimens.astype(np.int64)),
            Column("total_time", "s", self.total),
        ]


def plan_test(
    duration: ArrayLike,
    exposure: ArrayLike,
    goal: float,
    share: float,
    confidence: float,
    *,
    shown: float = 0.0,
    failures: int = 0,
) -> TestPlan:
    """The specimens still needed to show, at the `confidence`, that at most a `share` of films fails before the exposure `goal`.

    `exposure` (k,) is that of a test of this `duration` (k,) in s, in the unit of the goal: the cumulative hazard, or what grows
    with it. `shown` is the sum of the exposures of the tests so far, with their `failures`; none of the further specimens may fail.
    """
    lacking = max(most_expected(failures, confidence) * (goal / -np.log1p(-share)) - shown, 0.0)
    count = np.ceil(lacking / np.asarray(exposure, dtype=float) - 1e-9)
    lasting = np.asarray(duration, dtype=float)
    return TestPlan(lasting, count, count * lasting)
