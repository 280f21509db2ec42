"""Springs whose limits differ from case to case, and the shape of relaxation spectra in frequency."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.errors import InputError
from dielast.material.shift import WLF, Arrhenius, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, NeoHookean, SpringLaw, gathered

CARRYING = np.ones((3, 3), dtype=bool)


def pairs(first: np.ndarray, rest: np.ndarray) -> list[tuple[SpringLaw, SpringLaw]]:
    return [(Gent(one), Gent(other)) for one, other in zip(first.tolist(), rest.tolist(), strict=True)]


def test_limits_of_each_case_are_joined_and_taken_case_by_case() -> None:
    first, rest = np.array([110.0, 90.0, np.inf]), np.array([55.0, 40.0, 30.0])
    law = gathered(pairs(first, rest), CARRYING)
    squared = np.random.default_rng(0).uniform(1.0, 3.0, (2, 3, 3))
    stress = law.stress(squared)
    for case in range(3):
        for spring, limit in enumerate((first[case], rest[case], rest[case])):
            alone = Gent(limit).stress(squared[:, spring, case : case + 1])
            assert stress[:, spring, case : case + 1] == pytest.approx(alone, rel=1e-15)
            assert law.of_spring(spring, case).values() == {"J_lim": limit}
    some = np.array([2, 0])
    assert np.array_equal(law.take(some).stress(squared[..., some]), stress[..., some])
    assert np.array_equal(law.values()["J_lim"], np.stack((first, rest, rest)))


def test_a_spring_that_carries_nothing_has_no_limit() -> None:
    carrying = CARRYING.copy()
    carrying[2, 1] = False
    law = gathered(pairs(np.full(3, 110.0), np.array([55.0, 40.0, 30.0])), carrying)
    assert law.values()["J_lim"].tolist() == [[110.0, 110.0, 110.0], [55.0, 40.0, 30.0], [55.0, np.inf, 30.0]]
    assert law.with_idle_spring().values()["J_lim"][3].tolist() == [np.inf] * 3


def test_springs_of_two_laws_act_row_by_row() -> None:
    law = gathered([(NeoHookean(), Gent(55.0)), (NeoHookean(), Gent(40.0)), (NeoHookean(), Gent(30.0))], CARRYING)
    same = gathered(pairs(np.full(3, np.inf), np.array([55.0, 40.0, 30.0])), CARRYING)
    squared = np.random.default_rng(0).uniform(1.0, 3.0, (2, 3, 3))
    some = np.array([2, 0])
    for one, other in ((law, same), (law.with_idle_spring().take(some), same.with_idle_spring().take(some))):
        at = squared if one is law else np.concatenate((squared, squared[:, :1]), axis=1)[..., some]
        assert one.stress(at) == pytest.approx(other.stress(at), rel=1e-15)
        assert one.tangent(at)[1] == pytest.approx(other.tangent(at)[1], rel=1e-15)
        assert one.energy(at) == pytest.approx(other.energy(at), rel=1e-15)
        assert np.array_equal(one.room(at), other.room(at))
    assert isinstance(law.of_spring(0, 1), NeoHookean)
    assert law.of_spring(2, 1).describe_limit() == "the Gent limit, J_lim = 40"


def test_materials_of_different_laws_do_not_share_a_run() -> None:
    with pytest.raises(InputError, match="materials of the laws Gent and neo-Hookean cannot share a run"):
        gathered([(Gent(110.0), Gent(55.0)), (NeoHookean(), Gent(55.0))], CARRYING[:, :2])


def test_a_limit_that_all_cases_share_stays_as_it_is() -> None:
    law = gathered([(Gent(110.0), Gent(55.0))], CARRYING)
    squared = np.random.default_rng(1).uniform(1.0, 3.0, (2, 3, 4))
    some = np.array([3, 1, 1])
    assert law.take(some) is law
    assert np.array_equal(law.take(some).stress(squared[..., some]), law.stress(squared)[..., some])


def test_hardening_is_the_slope_of_the_stiffness_and_energy_its_integral() -> None:
    law, step = Gent(40.0), 1e-5
    invariant = np.linspace(3.0, 40.0, 20)
    stiffness, slope = law.hardening(invariant)
    assert np.array_equal(stiffness, law.stiffness(invariant))
    assert slope == pytest.approx((law.stiffness(invariant + step) - law.stiffness(invariant - step)) / (2 * step), rel=1e-8)
    assert 0.5 * stiffness == pytest.approx(
        (law.energy_of(invariant + step) - law.energy_of(invariant - step)) / (2 * step), rel=1e-8
    )
    assert law.energy_of(np.array([3.0]))[0] == 0.0


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
