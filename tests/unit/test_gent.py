"""Springs: stresses and tangents are derivatives of the energy."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Gent, NeoHookean, SpringLaw, gathered

LAWS = [Gent(), Gent(110.0), Gent(55.0)]
STRETCHES = np.array([[1.0, 1.3, 0.6, 3.0, 2.5], [1.0, 0.9, 1.5, 0.6, 2.5]])


def energy(law: Gent, log_stretch: np.ndarray) -> np.ndarray:
    return law.energy(np.exp(2 * log_stretch))


@pytest.mark.parametrize("law", LAWS)
def test_stress_is_the_slope_of_the_energy(law: Gent) -> None:
    log, step = np.log(STRETCHES), 1e-5
    stress = law.stress(STRETCHES**2)
    for axis in range(2):
        bump = step * np.eye(2)[axis][:, None]
        assert stress[axis] == pytest.approx((energy(law, log + bump) - energy(law, log - bump)) / (2 * step), rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_tangent_is_half_the_slope_of_the_stress(law: Gent) -> None:
    log, step = np.log(STRETCHES), 1e-6
    stress, half = law.tangent(STRETCHES**2)
    assert stress == pytest.approx(law.stress(STRETCHES**2), rel=1e-13, abs=1e-14)
    for axis, rows in ((0, (0, 1)), (1, (1, 2))):
        bump = step * np.eye(2)[axis][:, None]
        slope = (law.stress(np.exp(2 * (log + bump))) - law.stress(np.exp(2 * (log - bump)))) / (2 * step)
        assert 2 * half[list(rows)] == pytest.approx(slope, rel=1e-7)


def test_uniaxial_and_equibiaxial_closed_forms() -> None:
    stretch = np.array([0.5, 1.0, 2.0, 5.0])
    uniaxial = Gent().stress(np.stack((stretch**2, 1 / stretch)))
    assert uniaxial[0] == pytest.approx(stretch**2 - 1 / stretch)
    assert uniaxial[1] == pytest.approx(0, abs=1e-14)
    equibiaxial = Gent(110.0).stress(np.stack((stretch[:3], stretch[:3])) ** 2)
    front, back = stretch[:3] ** 2, stretch[:3] ** -4
    assert equibiaxial[0] == pytest.approx((front - back) / (1 - (2 * front + back - 3) / 110))


def test_a_distant_limit_is_neo_hookean() -> None:
    assert Gent(1e14).stress(STRETCHES**2) == pytest.approx(Gent().stress(STRETCHES**2), rel=1e-12)
    assert energy(Gent(1e14), np.log(STRETCHES)) == pytest.approx(energy(Gent(), np.log(STRETCHES)), rel=1e-12)


def test_beyond_the_limit_nothing_is_finite() -> None:
    beyond = np.array([[36.0], [36.0]])
    with np.errstate(divide="ignore"):
        assert not np.isfinite(Gent(55.0).stress(beyond)).any()
    assert np.isinf(Gent(55.0).energy(beyond)).all()
    assert Gent(55.0).largest_invariant() == 58.0


def test_one_invariant_is_as_good_as_many() -> None:
    for law in LAWS:
        many = np.array([3.0, 5.0, 40.0])
        for k, one in enumerate(many):
            invariant = np.array(one)
            assert law.stiffness(invariant) == law.stiffness(one) == law.stiffness(many)[k]
            assert law.hardening(invariant) == (law.hardening(many)[0][k], law.hardening(many)[1][k])
            assert law.energy_of(invariant) == law.energy_of(many)[k]
        assert many.tolist() == [3.0, 5.0, 40.0]


def test_joined_laws_act_row_by_row() -> None:
    squared = np.repeat(STRETCHES[:, None] ** 2, 3, axis=1)
    law = gathered([(Gent(110.0), Gent(55.0))], np.ones((3, 5), dtype=bool))
    stress, half = law.tangent(squared)
    for row, alone in enumerate((Gent(110.0), Gent(55.0), Gent(55.0))):
        expected = alone.tangent(squared[:, row])
        assert np.array_equal(stress[:, row], expected[0])
        assert np.array_equal(half[:, row], expected[1])
    assert law.energy(squared)[0] == pytest.approx(Gent(110.0).energy(squared[:, 0]))
    assert law.margin(squared)[1] == pytest.approx(Gent(55.0).margin(squared[:, 1]))


@pytest.mark.parametrize("law", [*LAWS, NeoHookean()])
def test_the_short_ways_under_a_symmetry_agree_with_the_whole_law(law: SpringLaw) -> None:
    front = np.array([1.0, 1.7, 0.6, 5.0])
    for symmetry in (UNIAXIAL, EQUIBIAXIAL):
        expected = SpringLaw.axial_tangent(law, symmetry, front, front**-symmetry.thinning)
        stress, tangent = law.axial_tangent(symmetry, front.copy(), front**-symmetry.thinning)
        assert law.axial_stress(symmetry, front.copy(), front**-symmetry.thinning) == pytest.approx(stress, rel=1e-14, abs=1e-14)
        assert stress == pytest.approx(expected[0], rel=1e-13, abs=1e-14)
        assert tangent == pytest.approx(expected[1], rel=1e-13)
    for short, whole in zip(law.equibiaxial_tangent(front.copy()), SpringLaw.equibiaxial_tangent(law, front), strict=True):
        assert short == pytest.approx(whole, rel=1e-13)
