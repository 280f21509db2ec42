"""Points of a film: equilibria of loads applied at once, electrical loads, and where an equilibrium is stable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from dielast.base.errors import InputError
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.electric import ChargeControl, ElectricalLoad, FieldControl
from dielast.mechanics.flow import Flow
from dielast.mechanics.jump import jump
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control
from dielast.mechanics.stability import ONE_PERCENT, TimeScale, damped, stability

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


NO_EDGE_HELD = (Control.STRESS, Control.STRESS)


@pytest.mark.parametrize("control", [FieldControl(), ChargeControl()])
def test_an_electrical_load_agrees_with_itself(control: ElectricalLoad) -> None:
    permittivity, log_area, value = np.array([4e-11, 3e-11]), np.array([0.3, 1.2]), np.array([2.0, -5.0])
    stress, by_area, by_load = control.linearised(permittivity, log_area, value)
    assert stress == pytest.approx(control.stress(permittivity, log_area, value), rel=1e-14)
    assert stress == pytest.approx(permittivity * control.true_field(permittivity, log_area, value) ** 2, rel=1e-14)
    step = 1e-6
    rise = control.stress(permittivity, log_area + step, value) - control.stress(permittivity, log_area - step, value)
    assert by_area == pytest.approx(rise / (2 * step), rel=1e-8)
    rise = control.stress(permittivity, log_area, value + step) - control.stress(permittivity, log_area, value - step)
    assert by_load == pytest.approx(rise / (2 * step), rel=1e-8)


def test_a_charged_neo_hookean_film_never_pulls_in() -> None:
    """lambda^6 = 1 + D~^2/(mu eps) without a dead load, and the tangent stays positive."""
    modulus, permittivity = 2e4, 4e-11
    charge = np.sqrt(np.array([0.1, 1.0, 3.0, 30.0]) * modulus * permittivity)
    ones = np.ones(charge.size)
    points = PointMaterial(modulus * ones[None], Flow(0 * ones[None]), Gent(), permittivity * ones, ones, ChargeControl())
    target = np.stack((0 * ones, 0 * ones, charge))
    log_squared, nominal, stable = jump(points, NO_EDGE_HELD, target, np.zeros((2, 1, charge.size)), np.zeros((2, charge.size)))
    assert stable.all()
    assert np.exp(3 * log_squared[0]) == pytest.approx(1 + charge**2 / (modulus * permittivity), rel=1e-10)
    margin = stability(points, NO_EDGE_HELD, np.zeros((2, 1, charge.size)), log_squared, nominal, charge).margin
    assert (margin > 1).all()
    held = replace(points, electric=FieldControl())
    assert not jump(held, NO_EDGE_HELD, target / permittivity, np.zeros((2, 1, charge.size)), np.zeros((2, charge.size)))[2][
        1:
    ].any()


PERMITTIVITY = 3.98e-11

SOLID = Material(
    "solid",
    26e3,
    Spectrum(np.array([1.0, 1e3]), np.array([8e4, 3e4])),
    NoShift(20.0),
    Gent(110.0),
    Gent(55.0),
    permittivity=PERMITTIVITY,
)


def free_energy(place: NDArray[np.complex128], viscous: Array) -> complex:
    """Eq. 9 without the load's potential, which is linear: energy of all springs and of the charge, per undeformed volume."""
    first, second, charge = place
    total = charge**2 / (2 * PERMITTIVITY * first**2 * second**2)
    for modulus, limit, (a, b) in zip((26e3, 8e4, 3e4), (110.0, 55.0, 55.0), viscous, strict=True):
        one, two = first / a, second / b
        total += -0.5 * modulus * limit * np.log(1 - (one**2 + two**2 + 1 / (one * two) ** 2 - 3) / limit)
    return complex(total)


def hessian(place: Array, viscous: Array) -> Array:
    """Second derivatives, by a complex step along one variable and a central difference of high order along the other."""
    step, weights = 1e-3 * np.abs(place), {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    result = np.empty((3, 3))
    for i in range(3):
        for j in range(3):

            def slope(shift: float, i: int = i, j: int = j) -> float:
                at = place.astype(complex)
                at[j] += shift * step[j]
                at[i] += 1e-30j * step[i]
                return float(free_energy(at, viscous).imag / (1e-30 * step[i]))

            result[i, j] = sum(w * (slope(k) - slope(-k)) for k, w in weights.items()) / step[j]
    return result


def state(seed: int) -> tuple[Array, Array, float]:
    """Stretches, viscous stretches with the equilibrium spring's, nominal field."""
    random = np.random.default_rng(seed)
    stretch = random.uniform(1.0, 3.5, 2)
    viscous = np.concatenate((np.ones((1, 2)), random.uniform(0.8, 2.0, (2, 2))))
    return stretch, viscous, float(random.uniform(1e6, 3e7))


def equilibrium_stress(stretch: Array, viscous: Array, field: float) -> Array:
    """Mechanical nominal stresses, from the energy's slopes."""
    charge = PERMITTIVITY * field * np.prod(stretch) ** 2
    result = np.empty(2)
    for axis in range(2):
        at = np.array([*stretch, charge], dtype=complex)
        at[axis] += 1e-30j
        result[axis] = free_energy(at, viscous).imag / 1e-30
    return result


@pytest.mark.parametrize("seed", range(8))
def test_the_tangent_is_the_hessian_of_the_free_energy(seed: int) -> None:
    stretch, viscous, field = state(seed)
    points = PointMaterial.of(SOLID, np.array([20.0]), 1e-6)
    points = replace(points, modulus=np.array([[26e3], [8e4], [3e4]]))
    internal, log_squared = 2 * np.log(viscous.T)[:, :, None], 2 * np.log(stretch)[:, None]
    nominal = equilibrium_stress(stretch, viscous, field)[:, None]
    matrix = hessian(np.array([*stretch, PERMITTIVITY * field * np.prod(stretch) ** 2]), viscous)
    at_field = matrix[:2, :2] - np.outer(matrix[:2, 2], matrix[2, :2]) / matrix[2, 2]
    for controls, expected in (
        ((FREE, FREE), np.linalg.det(matrix) / matrix[2, 2]),
        ((FREE, HELD), at_field[0, 0]),
        ((HELD, FREE), at_field[1, 1]),
        ((HELD, HELD), 1.0),
    ):
        found = stability(points, controls, internal, log_squared, nominal, np.array([field]))
        sign = -1 if controls == (FREE, FREE) and at_field[0, 0] < 0 < expected else 1
        assert found.determinant[0] == pytest.approx(sign * expected, rel=1e-9, abs=1e-9 * np.abs(at_field).max() ** 2)
    assert matrix[2, 2] == pytest.approx(1 / (PERMITTIVITY * np.prod(stretch) ** 2), rel=1e-9)


def test_alike_axes_need_only_one_of_them() -> None:
    points = PointMaterial.of(SOLID, np.array([20.0, 20.0]), 1e-6)
    internal = np.log([[[1.0, 1.0], [1.2, 1.4], [1.1, 1.3]]])
    log_squared, nominal, field = np.full((2, 2), 0.9), np.full((2, 2), 3e4), np.array([2e6, 1e7])
    one = stability(points, (FREE, FREE), internal, log_squared, nominal, field)
    both = stability(points, (FREE, FREE), np.repeat(internal, 2, axis=0), log_squared, nominal, field)
    assert one.determinant == pytest.approx(both.determinant, rel=1e-13)
    assert one.margin == pytest.approx(both.margin, rel=1e-13)


def test_a_film_without_load_has_the_margin_of_its_springs() -> None:
    points = PointMaterial.of(SOLID, np.array([20.0]), 1e-6)
    zero = np.zeros((2, 1))
    found = stability(points, (FREE, FREE), np.zeros((2, 3, 1)), zero, zero, np.zeros(1))
    assert found.margin[0] == 1.0
    assert found.determinant[0] == pytest.approx(12 * (26e3 + 8e4 + 3e4) ** 2)


def test_stiffness_falls_from_frozen_to_relaxed() -> None:
    points = PointMaterial.of(SOLID, np.array([20.0]), 1e-6)

    def retained(scale: TimeScale, time: float) -> list[float]:
        stress = np.zeros((2, *points.modulus.shape))
        return list(points.flow.retained(scale.watched(np.array([time])), lambda: stress)[:, 0])

    assert retained(TimeScale.fixed(0.0), 1e9) == [1.0, 1.0, 1.0]
    assert retained(ONE_PERCENT, 100.0) == pytest.approx([1.0, np.exp(-1.0), np.exp(-1e-3)])
    assert retained(TimeScale.fixed(1e3), 0.0) == pytest.approx([1.0, 0.0, np.exp(-1.0)])
    assert retained(TimeScale.fixed(1e9), 0.0) == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize("make", [TimeScale.fraction, TimeScale.fixed])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_a_time_scale_must_make_sense(make: type[TimeScale], value: float) -> None:
    with pytest.raises(InputError, match="pull-in time scale"):
        make(value)


def test_the_damper_is_one_spring_more() -> None:
    points = PointMaterial.of(SOLID, np.array([20.0, 20.0]), 1e-6)
    held = damped(points)
    assert held.modulus.shape == (4, 2)
    assert np.all(held.modulus[-1] >= 1e4 * 26e3)
    assert np.all(held.flow.fluidity[-1] > 1e9 * points.flow.fluidity.max())
    assert np.array_equal(held.modulus[:-1], points.modulus)
