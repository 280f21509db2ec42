"""Electrical loads: each prescribed quantity is a class, and nothing of the solver knows which it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dielast.material.springs import Gent
from dielast.mechanics.electric import ChargeControl, ElectricalLoad, FieldControl
from dielast.mechanics.flow import Flow
from dielast.mechanics.jump import jump
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control
from dielast.mechanics.stability import stability

FREE = (Control.STRESS, Control.STRESS)


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
    log_squared, nominal, stable = jump(points, FREE, target, np.zeros((2, 1, charge.size)), np.zeros((2, charge.size)))
    assert stable.all()
    assert np.exp(3 * log_squared[0]) == pytest.approx(1 + charge**2 / (modulus * permittivity), rel=1e-10)
    margin = stability(points, FREE, np.zeros((2, 1, charge.size)), log_squared, nominal, charge).margin
    assert (margin > 1).all()
    held = replace(points, electric=FieldControl())
    assert not jump(held, FREE, target / permittivity, np.zeros((2, 1, charge.size)), np.zeros((2, charge.size)))[2][1:].any()
