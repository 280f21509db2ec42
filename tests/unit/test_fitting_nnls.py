"""Non-negative fits against the problem as it is stated, solved in full, and processes placed where the truth has them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from dielast.material.measurement_kind import CREEP, OSCILLATION, RELAXATION, MeasurementKind
from dielast.relaxation.nnls import Known, Solution, Total, WeightedCurve, fit_strengths, place_times

Array = NDArray[np.float64]
OWN = np.logspace(3, -3, 13)
STRENGTH = 1e5 * np.exp(-0.5 * ((np.log10(OWN) + 0.5) / 1.2) ** 2)
RESPONSES = {"relaxation": RELAXATION, "oscillation": OSCILLATION, "creep": CREEP}
CONSTANTS = {"relaxation": [3e4], "oscillation": [3e4], "creep": [2e4, 50.0]}


def curve_of(name: str, noise: float = 0.0, seed: int = 0, points: int = 61) -> WeightedCurve:
    """What a spectrum answers, with noise, some of its points given less weight."""
    rng = np.random.default_rng(seed)
    time, response = np.logspace(-4, 4, points), RESPONSES[name]
    values = response.processes(time, OWN) @ STRENGTH + np.tensordot(CONSTANTS[name], response.constants(time), 1)
    weight = np.where(np.arange(points) % 3 == 0, 1.0, 0.4)
    return WeightedCurve(time, values * (1 + noise * rng.standard_normal(values.shape)), weight, response)


class Stated:
    """The problem of the module's first lines, row by row, in strengths over G(tau) and constants as they are."""

    def __init__(self, curve: WeightedCurve, known: Known) -> None:
        response: MeasurementKind = curve.kind
        size = np.linalg.norm(curve.values, axis=0)
        self.scale = np.exp(np.interp(np.log(OWN), np.log(curve.time), np.log(size)))
        processes = response.processes(curve.time, OWN) * self.scale
        constants = response.constants(curve.time)
        given = sum((own * answer for own, answer in zip(known, constants, strict=True) if own is not None), 0 * curve.values)
        free = [k for k, own in enumerate(known) if own is None]
        self.unit = np.array([1e4, 30.0])[free] if curve.kind is CREEP else np.full(len(free), 1e4)
        columns = [*np.moveaxis(processes, 2, 0), *(constants[free] * self.unit[:, None, None])]
        self.design = np.stack([(column / curve.values).ravel() for column in columns], axis=1)
        self.target = ((curve.values - given) / curve.values).ravel()
        self.weight = np.tile(curve.weight, len(curve.values))
        self.rough = np.zeros((OWN.size - 2, len(columns)))
        for row in range(OWN.size - 2):
            self.rough[row, row : row + 3] = 1.0, -2.0, 1.0

    def solve(self, smoothing: float) -> Array:
        root = np.sqrt(self.weight)[:, None]
        rows = np.vstack([root * self.design, smoothing * self.rough])
        return np.asarray(nnls(rows, np.append(root[:, 0] * self.target, np.zeros(len(self.rough))))[0])

    def score(self, smoothing: float) -> float:
        """Generalised cross-validation: misfit over the square of the share of points that the free unknowns leave."""
        x = self.solve(smoothing)
        design, rough = self.design[:, x > 0], self.rough[:, x > 0]
        hat = np.linalg.solve(design.T @ (self.weight[:, None] * design) + smoothing**2 * rough.T @ rough, design.T)
        taken = np.sum(design.T * hat * self.weight**2)  # a point of less weight follows its own noise less
        left = 1 - taken / self.weight.sum()
        return float(self.weight @ (self.design @ x - self.target) ** 2 / left**2)


KNOWN: list[tuple[str, Known]] = [
    *(("relaxation", (None,)), ("relaxation", (2.9e4,)), ("oscillation", (None,)), ("oscillation", (3e4,))),
    *(("creep", (None, None)), ("creep", (2e4, None)), ("creep", (None, 0.0)), ("creep", (None, 50.0)), ("creep", (2e4, 50.0))),
]


@pytest.mark.parametrize(("name", "known"), KNOWN)
def test_the_solution_is_that_of_the_problem_as_stated(name: str, known: Known) -> None:
    curve = curve_of(name, 0.03)
    found = fit_strengths(curve, OWN, known)
    stated = Stated(curve, known)
    x = stated.solve(found.smoothing)
    np.testing.assert_allclose(found.strength, x[: OWN.size] * stated.scale, rtol=1e-6, atol=1e-3)
    free = [k for k, own in enumerate(known) if own is None]
    np.testing.assert_allclose(found.constants[free], x[OWN.size :] * stated.unit, rtol=1e-6, atol=1e-6)
    for own, constant in zip(known, found.constants, strict=True):
        assert own is None or constant == own


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["relaxation", "oscillation"])
def test_the_smoothing_is_the_largest_of_nearly_the_best_cross_validation(name: str, seed: int) -> None:
    curve = curve_of(name, 0.03, seed)
    chosen = fit_strengths(curve, OWN, (None,)).smoothing
    stated = Stated(curve, (None,))
    scores = {smoothing: stated.score(smoothing) for smoothing in 10 ** np.arange(-4.0, 2.01, 0.25)}
    least = min(scores.values())
    assert stated.score(chosen) <= 1.04 * least
    assert min(score for smoothing, score in scores.items() if smoothing > 2 * chosen) > 1.005 * least


def total_of(found: Solution, shares: tuple[float, ...]) -> float:
    return float(found.strength.sum() + np.dot(shares, found.constants))


@pytest.mark.parametrize(("name", "known"), KNOWN)
@pytest.mark.parametrize("share", [0.0, 1.0, 2.5])
def test_a_prescribed_sum_is_kept(name: str, known: Known, share: float) -> None:
    """Of the processes, and of the first constant so many times, be it known or sought."""
    shares = (share, 0.0)[: len(known)]
    own = fit_strengths(curve_of(name, 0.02), OWN, known)
    value = 1.05 * total_of(own, shares)
    found = fit_strengths(curve_of(name, 0.02), OWN, known, Total(value, shares))
    assert total_of(found, shares) == pytest.approx(value, rel=1e-6)
    assert np.all(found.strength >= 0)
    np.testing.assert_allclose(found.strength.sum(), own.strength.sum(), rtol=0.3)  # not met by one of the two alone


def spectrum_curve(own: Array, response: MeasurementKind = RELAXATION) -> WeightedCurve:
    time = np.logspace(-4, 4, 241)
    values = response.processes(time, own) @ (1e5 / (1 + np.arange(own.size) % 2)) + 3e4 * response.constants(time)[0]
    return WeightedCurve(time, values, np.ones(241), response)


@pytest.mark.parametrize("inset", [(0.0, 0.0), (0.5, 0.5), (1.5, 0.5), (0.0, 1.0), (2.0, 0.0), (0.6, 0.4), (1.4, 0.5)])
def test_ends_that_may_move_go_where_the_truth_has_them(inset: tuple[float, float]) -> None:
    """The truth is a row of six processes whose ends lie so many spacings inside the range that is given."""
    low, high, count = -3.0, 3.0, 6
    spacing = (high - low) / (count - 1)
    truth = np.logspace(high - inset[1] * spacing, low + inset[0] * spacing, count)
    found = place_times(spectrum_curve(truth), count, 10**low, 10**high, (True, True), (None,))
    np.testing.assert_allclose(np.log10(found), np.log10(truth), atol=0.05 * spacing)
    np.testing.assert_allclose(np.diff(np.log10(found), n=2), 0.0, atol=1e-9)


def test_points_are_averaged_over_twentieths_of_a_decade() -> None:
    """A power law stays one, no weight is lost, and round spacings are not at the mercy of rounding."""
    for first, per_decade in ((-4.0, 60), (0.3, 60), (-1.7, 20), (2.0, 5)):
        x = first + np.arange(4 * per_decade) / per_decade
        weight: Array = np.asarray(1.0 + np.arange(x.size) % 4, dtype=float)
        values = np.stack([10 ** (7 - 0.3 * x), 10 ** (5 + 0.1 * x)])
        averaged = WeightedCurve(10**x, values, weight, OSCILLATION).averaged()
        share = max(per_decade // 20, 1)
        assert averaged.time.size == x.size // share
        np.testing.assert_allclose(averaged.weight, weight.reshape(-1, share).sum(axis=1))
        at = np.log10(averaged.time)
        np.testing.assert_allclose(at, np.average(x.reshape(-1, share), axis=1, weights=weight.reshape(-1, share)), atol=1e-12)
        np.testing.assert_allclose(np.log10(averaged.values), [7 - 0.3 * at, 5 + 0.1 * at], atol=1e-12)
        assert averaged.kind is OSCILLATION
