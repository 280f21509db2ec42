"""Springs whose limits differ from case to case, Prony series, and the shape of relaxation spectra in frequency."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.material.shift import WLF, Arrhenius, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Gent, NeoHookean, Ogden, SpringLaw, Yeoh, gathered

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
        assert np.array_equal(one.margin(at), other.margin(at))
    assert isinstance(law.of_spring(0, 1), NeoHookean)
    assert law.of_spring(2, 1).describe_limit() == "the Gent limit, J_lim = 40"


def test_materials_of_different_laws_run_side_by_side() -> None:
    laws: list[tuple[SpringLaw, SpringLaw]] = [
        (Gent(110.0), Gent(55.0)),
        (Yeoh(1.0, -0.01, 1e-3), Gent(50.0)),
        (Gent(90.0), Gent(40.0)),
        (Ogden((1.0, -0.2), (1.6, -2.5)), Ogden((1.0,), (3.0,))),
        (Ogden((2.0, -0.2, 1e-3), (1.6, -2.5, 5.0)), Ogden((1.0,), (3.0,))),
    ]
    law = gathered(laws, np.ones((3, 5), dtype=bool))
    squared = np.random.default_rng(0).uniform(1.0, 3.0, (2, 3, 5))
    some = np.array([4, 1, 2, 0, 2])
    taken = law.take(some)
    damped = law.with_idle_spring().take(some)
    wider = np.concatenate((squared, squared[:, :1]), axis=1)
    for place, case in [*enumerate(some.tolist()), *((None, case) for case in range(5))]:
        alone = gathered([laws[case]], np.ones((3, 1), dtype=bool))
        own, whole = squared[..., case : case + 1], (law, squared) if place is None else (taken, squared[..., some])
        column = case if place is None else place
        assert np.array_equal(whole[0].stress(whole[1])[..., column], alone.stress(own)[..., 0])
        assert np.array_equal(whole[0].tangent(whole[1])[1][..., column], alone.tangent(own)[1][..., 0])
        assert np.array_equal(whole[0].energy(whole[1])[..., column], alone.energy(own)[..., 0])
        assert np.array_equal(whole[0].margin(whole[1])[..., column], alone.margin(own)[..., 0])
        front = own[0].copy()
        for symmetry in (UNIAXIAL, EQUIBIAXIAL):
            both, all_fronts = front**-symmetry.thinning, whole[1][0].copy()
            thickness = all_fronts**-symmetry.thinning
            expected = alone.axial_tangent(symmetry, front.copy(), both.copy())
            found = whole[0].axial_tangent(symmetry, all_fronts.copy(), thickness.copy())
            assert np.array_equal(found[0][..., column], expected[0][..., 0])
            assert np.array_equal(found[1][..., column], expected[1][..., 0])
            assert np.array_equal(whole[0].axial_stress(symmetry, all_fronts, thickness)[..., column], expected[0][..., 0])
        if place is not None:
            idle = alone.with_idle_spring().stress(wider[..., case : case + 1])
            assert np.array_equal(damped.stress(wider[..., some])[..., column], idle[..., 0])
        expected_law = laws[case][0].values()
        for name, value in whole[0].of_spring(0, column).values().items():
            assert np.array_equal(value, expected_law[name])
    assert isinstance(law.take(np.array([0, 2])), Gent)
    mixed = gathered([(NeoHookean(), laws[3][1])], np.ones((3, 5), dtype=bool))
    for whole in (law, taken, mixed):
        single = whole.apart(3, 5).take(np.arange(15)[::-1])  # springs as cases of one spring each
        expected = whole.stress(squared).reshape(2, 1, 15)[..., ::-1]
        assert np.array_equal(single.stress(squared.reshape(2, 1, 15)[..., ::-1]), expected)


def test_a_limit_that_all_cases_share_is_stored_for_each_case() -> None:
    law = gathered([(Gent(110.0), Gent(55.0))], CARRYING)
    squared = np.random.default_rng(1).uniform(1.0, 3.0, (2, 3, 4))
    some = np.array([3, 1, 1])
    assert isinstance(law, Gent)
    assert law.take(some).arrays()["J_lim"].tolist() == [[110.0] * 3, [55.0] * 3, [55.0] * 3]
    assert np.array_equal(law.take(some).stress(squared[..., some]), law.stress(squared)[..., some])


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


def test_processes_keep_the_order_in_which_they_are_stated_and_are_frozen() -> None:
    spectrum = Spectrum(np.array([1.0, 100.0, 10.0]), np.array([3.0, 1.0, 2.0]))
    assert spectrum.relaxation_time.tolist() == [1, 100, 10]
    assert spectrum.shear_modulus.tolist() == [3, 1, 2]
    with pytest.raises(ValueError, match="read-only"):
        spectrum.shear_modulus[0] = 5.0


def test_truncation_keeps_the_slowest() -> None:
    kept = Spectrum(np.array([1.0, 100.0, 10.0]), np.array([3.0, 1.0, 2.0])).slowest(2)
    assert kept.relaxation_time.tolist() == [100, 10]
    assert len(kept) == 2


@pytest.mark.parametrize("keep", [0, 4, -1])
def test_truncation_to_an_impossible_number_is_refused(keep: int) -> None:
    spectrum = Spectrum(np.array([1.0, 100.0, 10.0]), np.ones(3))
    with pytest.raises(InputError, match=f"cannot keep {keep} of 3"):
        spectrum.slowest(keep)


def test_modulus_is_the_sum_of_exponentials_for_times_of_any_shape() -> None:
    spectrum = Spectrum(np.array([10.0, 2.0]), np.array([5.0, 7.0]))
    time = np.array([[0.0, 1.0], [20.0, 1e9]])
    expected = 3 + 5 * np.exp(-time / 10) + 7 * np.exp(-time / 2)
    np.testing.assert_allclose(spectrum.relaxation_modulus(time, 3.0), expected, rtol=1e-14)
    assert spectrum.relaxation_modulus(0.0) == pytest.approx(12)


@pytest.mark.parametrize(
    ("times", "moduli", "found"),
    [
        ([1.0, 2.0], [1.0], "2 relaxation times but 1"),
        ([0.0], [1.0], "relaxation time must be positive"),
        ([np.inf], [1.0], "relaxation time must be positive"),
        ([1.0], [-1.0], "not negative"),
        ([1.0], [np.nan], "must be finite"),
    ],
)
def test_impossible_series_are_refused(times: list[float], moduli: list[float], found: str) -> None:
    with pytest.raises(InputError, match=found):
        Spectrum(np.array(times), np.array(moduli))
