"""Generalised least squares of a linear model with a known covariance, and where it is not believed."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import fdtri

from dielast.calibration import efficient as module
from dielast.calibration.efficient import LEVEL, efficient
from dielast.calibration.estimate import Left
from dielast.calibration.levenberg import SETTLED
from dielast.calibration.problem import FitProblem
from dielast.calibration.scatter import Curves, Scatter, Scatters, covariance_of
from dielast.calibration.weighting import Weighting


@pytest.mark.parametrize(("apart", "believed"), [(0.98, True), (1.02, False)])
def test_the_estimate_is_that_of_aitken_unless_it_is_too_far_from_that_of_independent_points(
    monkeypatch: pytest.MonkeyPatch, apart: float, believed: bool
) -> None:
    """With one parameter, both estimates differ by d of variance V - V*: d^2 over it is Fisher's F, and has a limit (`apart` is |d|
    over that limit).
    """
    place = np.linspace(0.0, 3.0, 40)
    model = 1e4 * (1 + 0.3 * np.sin(place))
    slopes = (1e4 * np.cos(2 * place))[:, None]
    scatter = Scatter(np.array([0.01]), 0.05, 0.5, 0.0, smooth=1)
    monkeypatch.setattr(module, "likely", lambda *_: Scatters((scatter,), np.ones(1)))
    about = Curves((model,), (model,), (place,), np.zeros(1, dtype=np.intp))
    covariance, weight = covariance_of(about, scatter), Weighting.of(about, scatter).weight[:, None]
    inverse = np.linalg.inv(covariance)
    usual = np.linalg.pinv(weight * slopes) * weight.T  # estimates (1, n) from measured values
    best = np.linalg.solve(slopes.T @ inverse @ slopes, slopes.T @ inverse)
    difference = best - usual
    variance = (usual @ covariance @ usual.T - best @ covariance @ best.T).item()
    assert (difference @ covariance @ difference.T).item() == pytest.approx(variance, rel=1e-6)  # Hausman
    freedom = Left.of(about, scatter, weight[:, 0], slopes).known
    limit = np.sqrt(variance * fdtri(1.0, freedom, LEVEL))
    # errors that move both estimates apart by as much
    error = difference[0] * apart * limit / float(difference[0] @ difference[0])
    measured = model + error
    curves = Curves((measured,), (model,), (place,), np.zeros(1, dtype=np.intp))

    problem: Any = SimpleNamespace(
        prior=np.zeros((1, 1)),
        space=SimpleNamespace(bounds=(np.full(1, -9.0), np.full(1, 9.0))),
        answers=lambda at: model + at @ slopes.T,
        beforehand=lambda at: np.zeros((len(at), 0)),
    )
    problem.weighted = partial(FitProblem.weighted, problem)
    at = usual @ error
    found = efficient(problem, curves, scatter, slopes, at, np.ones(1, dtype=bool))
    if believed:
        assert found is not None
        # above the least sum of squares by no more than the change at which a fit ends
        aitken = best @ error
        left = error - slopes @ aitken
        off = slopes @ (found[0] - aitken)
        assert off @ inverse @ off <= SETTLED * (left @ inverse @ left)
        assert abs(aitken - at).item() == pytest.approx(apart * limit, rel=1e-9)
    else:
        assert found is None
    assert efficient(problem, curves, scatter, slopes, at, np.zeros(1, dtype=bool)) is None  # at a bound
