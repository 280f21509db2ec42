"""Springs whose limits differ from case to case, and the shape of relaxation spectra in frequency."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.material.shift import WLF, Arrhenius, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import FirstAndRest, Gent, join
from dielast.mechanics import kinematics


def test_limits_of_each_case_are_joined_and_taken_case_by_case() -> None:
    first, rest = np.array([110.0, 90.0, np.inf]), np.array([55.0, 40.0, 30.0])
    law = join(Gent(first), Gent(rest), 2)
    squared = np.random.default_rng(0).uniform(1.0, 3.0, (2, 3, 3))
    stress = kinematics.stress(law, squared)
    for case in range(3):
        for spring, limit in enumerate((first[case], rest[case], rest[case])):
            alone = kinematics.stress(Gent(limit), squared[:, spring, case : case + 1])
            assert stress[:, spring, case : case + 1] == pytest.approx(alone, rel=1e-15)
    some = np.array([2, 0])
    assert np.array_equal(kinematics.stress(law.take(some), squared[..., some]), stress[..., some])
    assert np.array_equal(law.largest_invariant(), 3 + np.stack((first, rest, rest)))
    assert np.array_equal(FirstAndRest(Gent(first), Gent(rest)).largest_invariant(), 3 + np.stack((first, rest)))
    apart = FirstAndRest(Gent(first[None]), Gent(np.stack((rest, rest))))
    assert np.array_equal(kinematics.stress(apart.take(some), squared[..., some]), stress[..., some])
    assert np.array_equal(kinematics.energy(apart, squared), kinematics.energy(law, squared))


def test_a_limit_that_all_cases_share_stays_as_it_is() -> None:
    law = join(Gent(110.0), Gent(55.0), 2)
    squared = np.random.default_rng(1).uniform(1.0, 3.0, (2, 3, 4))
    some = np.array([3, 1, 1])
    assert np.array_equal(kinematics.stress(law.take(some), squared[..., some]), kinematics.stress(law, squared)[..., some])


def test_hardening_is_the_slope_of_the_stiffness_and_energy_its_integral() -> None:
    law, step = Gent(40.0), 1e-5
    invariant = np.linspace(3.0, 40.0, 20)
    stiffness, slope = law.hardening(invariant)
    assert np.array_equal(stiffness, law.stiffness(invariant))
    assert slope == pytest.approx((law.stiffness(invariant + step) - law.stiffness(invariant - step)) / (2 * step), rel=1e-8)
    assert 0.5 * stiffness == pytest.approx((law.energy(invariant + step) - law.energy(invariant - step)) / (2 * step), rel=1e-8)
    assert law.energy(np.array([3.0]))[0] == 0.0


def test_moduli_in_frequency_are_the_transforms_of_relaxation() -> None:
    """G' = w int (G - mu_eq) sin wt dt + mu_eq and G'' = w int (G - mu_eq) cos wt dt."""
    spectrum = Spectrum(np.array([3.0, 0.2]), np.array([5e4, 2e5]))
    time = np.linspace(0.0, 120.0, 2_400_001)
    relaxing = spectrum.relaxation_modulus(time)
    for w in (0.1, 1.0, 7.0):
        storage, loss = (w * np.trapezoid(relaxing * wave(w * time), time) for wave in (np.sin, np.cos))
        assert spectrum.storage_modulus(w, 3e4) == pytest.approx(3e4 + storage, rel=1e-6)
        assert spectrum.loss_modulus(w) == pytest.approx(loss, rel=1e-6)
    assert spectrum.storage_modulus([[0.0, 1e12]], 3e4) == pytest.approx(np.array([[3e4, 28e4]]), rel=1e-6)


def test_shift_factors_by_hand() -> None:
    assert WLF(20.0, 8.86, 101.6).log10_shift_factor(70.0) == pytest.approx(-8.86 * 50 / 151.6, rel=1e-14)
    # 80 kJ/mol between 20 and 60 degC: 80000/8.314462618 (1/333.15 - 1/293.15) / ln 10
    assert Arrhenius(20.0, 80e3).log10_shift_factor(60.0) == pytest.approx(-1.711474, abs=1e-6)
    table = ShiftTable(30.0, (0.0, 20.0, 40.0), (2.0, 0.5, -1.0))
    assert table.log10_shift_factor([0.0, 20.0, 30.0, 40.0]) == pytest.approx([2.25, 0.75, 0.0, -0.75], abs=1e-14)
