"""Loads applied at once: equilibria as the plain equations have them, and none where there is none or it is unstable."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from dielast.material.springs import Gent
from dielast.mechanics.flow import Flow
from dielast.mechanics.jump import jump
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control

FREE, HELD = Control.STRESS, Control.STRETCH
Array = NDArray[np.float64]


def film(cases: int, limit: float = np.inf, springs: int = 1) -> PointMaterial:
    """Springs of 1 Pa and permittivity 1, so that the squared nominal field is eps E~^2/mu."""
    ones = np.ones((springs, cases))
    return PointMaterial(ones, Flow(0 * ones), Gent(limit), np.ones(cases), np.full(cases, 1e-6))


def carried(points: PointMaterial, internal: Array, log_squared: Array, field: Array) -> Array:
    """Mechanical nominal stresses (2, cases)."""
    first, second = np.exp(log_squared[:, None] - internal)
    back = 1 / (first * second)
    phi = 1 / (1 - (first + second + back - 3) / np.asarray(points.law.J_lim))
    true = np.stack([np.sum(points.modulus * phi * (own - back), axis=0) for own in (first, second)])
    maxwell = points.permittivity * field**2 * np.exp(log_squared[0] + log_squared[1])
    return np.asarray((true - maxwell) / np.exp(log_squared / 2))


@pytest.mark.parametrize("controls", [(FREE, FREE), (FREE, HELD), (HELD, FREE), (HELD, HELD)])
def test_every_load_is_balanced_with_the_viscous_stretches_frozen(controls: tuple[Control, Control]) -> None:
    random, cases = np.random.default_rng(7), 40
    points = film(cases, 60.0, springs=3)
    internal = np.concatenate((np.zeros((2, 1, cases)), random.uniform(-0.3, 0.6, (2, 2, cases))), axis=1)
    target = np.empty((3, cases))
    for axis, control in enumerate(controls):
        target[axis] = random.uniform(1.0, 2.5, cases) if control is HELD else random.uniform(-0.5, 15.0, cases)
    target[2] = random.uniform(0.0, 0.3, cases)
    log_squared, nominal, found = jump(points, controls, target, internal, random.uniform(0.0, 0.5, (2, cases)))
    assert found.all()
    np.testing.assert_allclose(nominal, carried(points, internal, log_squared, target[2]), rtol=1e-10, atol=1e-12)
    for axis, control in enumerate(controls):
        reached = np.exp(log_squared[axis] / 2) if control is HELD else nominal[axis]
        np.testing.assert_allclose(reached, target[axis], rtol=1e-14)


def test_an_elastic_film_has_the_smaller_of_two_equilibria_up_to_its_pull_in() -> None:
    """eps E~^2/mu = lambda^-2 - lambda^-8, largest where lambda^6 = 4."""
    most = 4 ** (-1 / 3) - 4 ** (-4 / 3)
    share = np.array([0.0, 0.3, 0.9, 0.999, 1.001, 1.5, 10.0])
    target = np.stack((0 * share, 0 * share, np.sqrt(share * most)))
    log_squared, _, found = jump(film(7), (FREE, FREE), target, np.zeros((2, 1, 7)), np.zeros((2, 7)))
    assert found.tolist() == [True] * 4 + [False] * 3
    for case in range(4):
        root = brentq(lambda x, e=share[case] * most: x**-2 - x**-8 - e, 1.0, 4 ** (1 / 6), xtol=1e-14)
        assert np.exp(log_squared[:, case] / 2) == pytest.approx([root, root], rel=1e-9)


def test_an_unstable_equilibrium_is_none() -> None:
    share = np.array([0.3, 0.9])
    field = np.sqrt(share * (4 ** (-1 / 3) - 4 ** (-4 / 3)))
    larger = np.array([brentq(lambda x, e=e: x**-2 - x**-8 - e, 4 ** (1 / 6), 10.0, xtol=1e-14) for e in field**2])
    start = np.repeat(2 * np.log(larger)[None], 2, axis=0)
    log_squared, _, found = jump(film(2), (FREE, FREE), np.stack((0 * share, 0 * share, field)), np.zeros((2, 1, 2)), start)
    assert log_squared == pytest.approx(start, abs=1e-9)
    assert not found.any()


@pytest.mark.parametrize("controls", [(FREE, HELD), (HELD, FREE)])
def test_a_film_clamped_along_one_axis(controls: tuple[Control, Control]) -> None:
    """lambda^4 = 1/(lambda_c^2 (1 - eps E~^2 lambda_c^2/mu)) for a clamped lambda_c, and nothing from eps E~^2 lambda_c^2 = mu."""
    clamped = np.array([1.0, 1.0, 1.5, 1.0, 1.0, 1.5, 2.0])
    share = np.array([0.0, 0.5, 0.9, 1.01, 1.5, 3.0, 20.0])
    axis = controls.index(FREE)
    target = np.stack((0 * share, 0 * share, np.sqrt(share) / clamped))
    target[1 - axis] = clamped
    log_squared, nominal, found = jump(film(7), controls, target, np.zeros((2, 1, 7)), np.zeros((2, 7)))
    assert found.tolist() == [True] * 3 + [False] * 4
    assert np.exp(2 * log_squared[axis, :3]) == pytest.approx(1 / (clamped[:3] ** 2 * (1 - share[:3])), rel=1e-9)
    assert np.all(nominal[axis] == 0)
    assert nominal[1 - axis, 0] == pytest.approx(0, abs=1e-12)


@pytest.mark.trust
def test_a_case_does_not_depend_on_its_company() -> None:
    random, cases = np.random.default_rng(3), 30
    target = np.stack((*random.uniform(0.0, 3.0, (2, cases)), random.uniform(0.0, 1.2, cases)))
    points, internal, start = film(cases, 40.0), np.zeros((2, 1, cases)), np.zeros((2, cases))
    together = jump(points, (FREE, FREE), target, internal, start)
    for case in range(0, cases, 3):
        pair = np.array([case, (case + 1) % cases])
        apart = jump(points.take(pair), (FREE, FREE), target[:, pair], internal[:, :, pair], start[:, pair])
        assert together[2][case] == apart[2][0]
        assert np.array_equal(together[0][:, case], apart[0][:, 0]) or not apart[2][0]
