"""Shift laws where the answer can be written down: tables of polynomials, three temperatures, and a C2 that two cannot tell."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.base.errors import DielastWarning, InputError
from dielast.material.shift import WLF
from dielast.material.shift.wlf import SMALLEST_C2
from dielast.relaxation.superposition.shiftfit import fit_shift_law


@pytest.mark.parametrize("reference", [0.0, 3.0, 12.0, 29.0, 44.0, 58.0, 60.0])
@pytest.mark.parametrize(
    "temperature", [[0.0, 60.0], [0.0, 25.0, 60.0], [0.0, 10.0, 40.0, 60.0], [0.0, 10.0, 20.0, 35.0, 50.0, 60.0]]
)
def test_a_table_is_a_polynomial_through_four_neighbours(temperature: list[float], reference: float) -> None:
    """Exact for a polynomial of one degree less than there are neighbours."""
    degree = min(len(temperature), 4) - 1
    shape = np.polynomial.Polynomial([0.3, -0.07, 4e-4, -2e-6][: degree + 1])
    at, anchor = np.array(temperature), 1
    fit = fit_shift_law("table", at, shape(at) - shape(at[anchor]), np.zeros((len(at), len(at))), anchor, reference)
    assert fit.law.log10_shift_factor(at) == pytest.approx(shape(at) - shape(reference), abs=1e-12)
    assert fit.origin == pytest.approx(shape(reference) - shape(at[anchor]), abs=1e-12)
    assert fit.origin_weight @ (shape(at) - shape(at[anchor])) == pytest.approx(fit.origin, abs=1e-12)


@pytest.mark.parametrize("reference", [-0.1, 60.1])
def test_a_table_knows_nothing_beyond_its_ends(reference: float) -> None:
    at = np.array([0.0, 30.0, 60.0])
    with pytest.raises(InputError, match="where the shift table ends"):
        fit_shift_law("table", at, -0.1 * at, np.zeros((3, 3)), 0, reference)


@pytest.mark.parametrize("anchor", [0, 1, 2])
def test_three_temperatures_are_just_enough_for_both_constants(anchor: int) -> None:
    law, at = WLF(20.0, 12.0, 90.0), np.array([-10.0, 20.0, 60.0])
    exact = law.log10_shift_factor(at)
    covariance = np.diag([1e-6 * (k != anchor) for k in range(3)])
    fit = fit_shift_law("wlf", at, exact - exact[anchor], covariance, anchor, 20.0)
    assert fit.values == pytest.approx([12.0, 90.0], rel=1e-6)
    assert np.isfinite(fit.covariance).all()
    assert fit.misfit == 0.0


def test_what_a_c2_that_is_only_assumed_may_do_to_the_origin() -> None:
    """Through both shift factors, with any k = 1/C2 about the anchor: log10 a = -g d/(1 + k d)."""
    at, step, move = np.array([0.0, 20.0]), 1.6, -10.0
    with pytest.warns(DielastWarning, match="do not determine the WLF constants"):
        fit = fit_shift_law("wlf", at, np.array([step, 0.0]), np.diag([1e-8, 0.0]), 1, 20.0 + move)

    def origin(k: np.ndarray) -> np.ndarray:
        return -step * (1 - 20 * k) / 20 * move / (1 + k * move)

    assumed = origin(np.array(1 / 293.15))
    assert fit.origin == pytest.approx(assumed, rel=1e-9)
    others = origin(np.linspace(0.0, 1 / (SMALLEST_C2 + 20.0), 2001))
    assert fit.origin_excess == pytest.approx(np.mean((others - assumed) ** 2), rel=0.1)
