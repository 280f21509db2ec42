"""Profiles of a chain of parameters in a narrow curved valley, whose ends are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast.calibration.courses import ACCURATE
from dielast.calibration.profiles import Verdict, profiles_of

WIDTH, NARROW = 0.2, 1e-3


@pytest.mark.parametrize(("size", "bound"), [(3, 3.0), (4, 3.0), (4, 9.0)])
def test_profiles_follow_a_narrow_valley_to_the_end_of_the_interval(size: int, bound: float) -> None:
    """The first parameter is known to 0.2, each further one follows the one before, y = x + x^2, to 0.001: the ends of its interval
    are those of the first, carried along, and so is the rise at a bound. An end before a bound that is not ruled out is open.
    """
    level, decisive = 0.9, 10.83
    slopes = (np.eye(size) - np.eye(size, k=-1)) / NARROW
    slopes[0, 0] = 1 / WIDTH
    information = slopes.T @ slopes
    covariance = np.linalg.inv(information)

    def residuals(at: Any, fits: Any) -> Any:
        follows = (at[:, 1:] - at[:, :-1] - at[:, :-1] ** 2) / NARROW
        return np.concatenate((at[:, :1] / WIDTH, follows), axis=1)

    space = SimpleNamespace(bounds=(np.full(size, -bound), np.full(size, bound)), precision=np.zeros((size, size)))
    fit = SimpleNamespace(coordinates=np.zeros(size), space=space, problem=SimpleNamespace(space=space))
    likelihood: Any = SimpleNamespace(
        fit=fit,
        residuals=residuals,
        covariance=covariance,
        standard_error=np.sqrt(np.diag(covariance)),
        information=information,
        thresholds=lambda own: np.full(size, 2.706 if own == level else decisive),
    )
    ends = WIDTH * np.sqrt(2.706) * np.array([-1.0, 1.0])
    for place, profile in enumerate(profiles_of(likelihood, level)):
        first = bound
        for _ in range(place):
            first = np.sqrt(0.25 + first) - 0.5
        ruled_out = (first / WIDTH) ** 2 >= decisive
        assert profile.verdict is (Verdict.DETERMINED if ruled_out else Verdict.LOWER)
        assert profile.lower == pytest.approx(ends[0], rel=ACCURATE)
        if ruled_out:
            assert profile.upper == pytest.approx(ends[1], rel=ACCURATE)
        else:
            assert np.isnan(profile.upper)
            assert [profile.coordinate[-1], profile.rise[-1]] == pytest.approx([bound, (first / WIDTH) ** 2], rel=1e-3)
        ends = ends + ends**2
