"""The tangent and its determinant against the Hessian of the free energy, differentiated by complex step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control
from dielast.mechanics.stability import ONE_PERCENT, TimeScale, damped, stability

FREE, HELD = Control.STRESS, Control.STRETCH
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
Array = NDArray[np.float64]


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
