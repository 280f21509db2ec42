"""Profiles of a chain of parameters in a narrow curved valley, whose ends are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast.calibration.profiles import END, Verdict, profiles_of

WIDTH, NARROW = 0.2, 1e-3


def test_profiles_follow_a_narrow_valley_to_the_end_of_the_interval() -> None:
    """The first parameter is known to 0.2, each further one follows the one before, y = x + x^2, to 0.001: the ends of its interval
    are those of the first, carried along.
    """
    size, level = 3, 0.9
    slopes = (np.eye(size) - np.eye(size, k=-1)) / NARROW
    slopes[0, 0] = 1 / WIDTH
    information = slopes.T @ slopes
    covariance = np.linalg.inv(information)

    def residuals(at: Any, fits: Any) -> Any:
        follows = (at[:, 1:] - at[:, :-1] - at[:, :-1] ** 2) / NARROW
        return np.concatenate((at[:, :1] / WIDTH, follows), axis=1)

    space = SimpleNamespace(bounds=(np.full(size, -3.0), np.full(size, 3.0)))
    fit = SimpleNamespace(coordinates=np.zeros(size), space=space, problem=SimpleNamespace(precision=np.zeros((size, size))))
    likelihood: Any = SimpleNamespace(
        fit=fit,
        residuals=residuals,
        covariance=covariance,
        standard_error=np.sqrt(np.diag(covariance)),
        information=information,
        thresholds=lambda own: np.full(size, 2.706 if own == level else 10.83),
    )
    ends = WIDTH * np.sqrt(2.706) * np.array([-1.0, 1.0])
    for profile in profiles_of(likelihood, level):
        assert profile.verdict is Verdict.DETERMINED
        assert [profile.lower, profile.upper] == pytest.approx(ends, rel=END)
        ends = ends + ends**2
