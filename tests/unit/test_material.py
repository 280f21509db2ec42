"""Shift laws, springs and spectra of a material, and the files that state it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.handover.material_file import parse_material, write_material
from dielast.material.law import Constant
from dielast.material.material import Breakdown, Material
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftTable, VogelFulcherTammann
from dielast.material.spectrum import Spectrum
from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Gent, NeoHookean, Ogden, SpringLaw, Yeoh, gathered

TABLE = ShiftTable(10.0, (0.0, 20.0, 40.0), (2.0, 0.0, -1.0))
LAWS = [WLF(20.0, 13.7, 187.1), Arrhenius(20.0, 1e5), TABLE]


@pytest.mark.parametrize("law", [*LAWS, NoShift(20.0)])
def test_zero_at_the_reference_temperature(law: WLF) -> None:
    assert float(law.log10_shift_factor(law.reference_temperature)) == 0.0
    assert law.log10_shift_factor([[0.0, 20.0]]).shape == (1, 2)


@pytest.mark.parametrize("law", LAWS)
def test_cold_is_slow(law: WLF) -> None:
    shift = law.log10_shift_factor(np.linspace(0, 40, 21))
    assert np.all(np.diff(shift) < 0)


@given(temperature=st.floats(-50, 200), C1=st.floats(1, 40))
def test_arrhenius_is_wlf_with_c2_at_the_reference_in_kelvin(temperature: float, C1: float) -> None:
    energy = C1 * np.log(10) * 8.314462618 * 293.15
    np.testing.assert_allclose(
        Arrhenius(20.0, energy).log10_shift_factor(temperature), WLF(20.0, C1, 293.15).log10_shift_factor(temperature), atol=1e-9
    )


@pytest.mark.parametrize(
    ("law", "temperature", "message"),
    [
        (LAWS[0], -167.1, "pole"),
        (LAWS[1], -273.15, "absolute zero"),
        (TABLE, 41.0, "outside the shift table"),
        (TABLE, -1.0, "outside"),
    ],
)
def test_where_a_law_ends(law: WLF, temperature: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        law.log10_shift_factor(temperature)


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({"at_least": 1.0}, "a number of at least 1 is needed"),
        ({"above": 0.0, "at_least": 1.0}, "a number above 0 and of at least 1 is needed"),
    ],
)
def test_a_drawn_number_is_refused_with_its_bounds(bounds: dict[str, float], message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(WLF, "constants", (Constant("C1", "", **bounds),))
    with pytest.raises(InputError, match=rf'^column "C1 \[1\]": 0.5: {message}$'):
        WLF(20.0, 13.6, 187.1).redrawn([0.5])


@given(reference=st.floats(-20, 80), C1=st.floats(2, 30), C2=st.floats(40, 300), above=st.floats(0.1, 200))
def test_vogel_fulcher_tammann_is_wlf_in_other_constants(reference: float, C1: float, C2: float, above: float) -> None:
    law = VogelFulcherTammann(reference, np.log(10) * C1 * C2, reference - C2)
    temperature = law.T_V + above
    by_hand = (law.B / above - law.B / C2) / np.log(10)
    wlf = WLF(reference, C1, C2)
    assert law.log10_shift_factor(temperature) == pytest.approx(by_hand, rel=1e-12, abs=1e-9)
    assert law.log10_shift_factor(temperature) == pytest.approx(float(wlf.log10_shift_factor(temperature)), rel=1e-9, abs=1e-9)
    assert law.log10_shift_factor(reference) == pytest.approx(0.0, abs=1e-9)
    assert pytest.approx(C1, rel=1e-9) == law.equivalent().C1
    # its constants do not depend on the reference temperature: differences of log10 a are those about any other
    other = VogelFulcherTammann(reference + 10, law.B, law.T_V)
    moved = law.log10_shift_factor(temperature) - law.log10_shift_factor(reference + 10)
    assert other.log10_shift_factor(temperature) == pytest.approx(float(moved), rel=1e-9, abs=1e-8)


def test_vogel_fulcher_tammann_says_where_it_ends_and_what_no_polymer_has() -> None:
    law = VogelFulcherTammann(20.0, 5902.0, -167.1)
    with pytest.raises(InputError, match=r"^temperature: -170 degC is at or below the Vogel temperature, -167.1 degC"):
        law.log10_shift_factor([0.0, -170.0])
    with pytest.raises(InputError, match=r"^T_V: 20 degC: a temperature below the reference temperature, 20 degC"):
        VogelFulcherTammann(20.0, 5902.0, 20.0)
    assert law.warning() == ""
    assert "C1 C2 is" in VogelFulcherTammann(20.0, 59.0, -167.1).warning()


VHB = """
name = "VHB 4905"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
J_lim = 110.0
[nonequilibrium]
J_lim = 55.0
relaxation_time_s = [159000.0, 58000.0]
shear_modulus_Pa = [1017.5, 1377.0]
[shift]
law = "wlf"
C1 = 13.7
C2 = "187.1 K"
[dielectric]
permittivity = "3.98e-11 F/m"
[breakdown]
prestretch = [1.7, 1.9]
field = ["40 MV/m", "48 MV/m"]
"""


@pytest.mark.parametrize("where", ["-1 degC", "61 degC"])
def test_a_shift_table_must_hold_the_reference_temperature(where: str) -> None:
    table = '[shift]\nlaw = "table"\ntemperature_degC = [0.0, 60.0]\nlog10_shift_factor = [1.0, -2.0]\n'
    text = VHB.split("[shift]")[0] + table
    parse_material(text.encode(), "vhb.toml")
    found = where.removesuffix(" degC")
    with pytest.raises(
        InputError, match=rf"^vhb.toml: reference_temperature: {found} degC is outside the shift table's 0 to 60 degC: an "
    ):
        parse_material(text.replace("20 degC", where).encode(), "vhb.toml")


def test_a_vogel_temperature_lies_below_the_reference_temperature_of_its_file() -> None:
    law = VogelFulcherTammann(100.0, 1500.0, 50.0)
    shift = '[shift]\nlaw = "vft"\nB = "1500 K"\nT_V = "50 degC"\n'
    text = VHB.split("[shift]")[0].replace("20 degC", "100 degC") + shift
    assert parse_material(text.encode(), "a").shift == law
    with pytest.raises(InputError, match=r"^a: shift.T_V: 50 degC: a temperature below the reference temperature, 40 degC, is"):
        parse_material(text.replace("100 degC", "40 degC").encode(), "a")


def test_a_material_without_branches_is_elastic() -> None:
    before, after = VHB.split("[nonequilibrium]")
    shift = "[shift]" + after.partition("[shift]")[2]
    with pytest.raises(InputError, match="nonequilibrium: is needed"):  # it may have been forgotten
        parse_material((before + shift).encode(), "vhb.toml")
    text = f"{before}[nonequilibrium]\nrelaxation_time_s = []\nshear_modulus_Pa = []\n{shift}"
    material = parse_material(text.encode(), "vhb.toml")
    assert len(material.spectrum) == 0
    rest = after[after.index("[dielectric]") :]
    stated = text.replace(shift, f'[shift]\nlaw = "none"\n{rest}')
    assert write_material(parse_material((before + rest).encode(), "a")) == write_material(parse_material(stated.encode(), "a"))
    with pytest.raises(InputError, match='shift: is needed; law = "none" says'):
        parse_material((VHB.partition("[shift]")[0] + rest).encode(), "vhb.toml")
    assert material.relaxation_time([0.0, 20.0]).shape == (2, 0)
    assert material.spectrum.relaxation_modulus([0.0, 1.0], 26e3).tolist() == [26e3, 26e3]
    assert write_material(parse_material(write_material(material), "vhb.toml")) == write_material(material)
    with pytest.raises(InputError, match="every shear modulus is zero"):
        parse_material(text.replace("26 kPa", "0 Pa").encode(), "vhb.toml")


laws = st.one_of(
    st.builds(WLF, st.just(20.0), st.floats(0.1, 100), st.floats(50, 1000)),
    st.builds(Arrhenius, st.just(20.0), st.floats(1e3, 1e6)),
    st.just(NoShift(20.0)),
    st.just(ShiftTable(20.0, (0.0, 20.0, 40.0), (1.5, 0.0, -1.0))),
)


@given(laws, st.lists(st.tuples(st.floats(1e-12, 1e12), st.floats(0, 1e12)), min_size=1, max_size=40), st.floats(1, 1e9))
def test_a_material_survives_its_file(law: WLF, branches: list[tuple[float, float]], equilibrium: float) -> None:
    tau, mu = map(np.array, zip(*branches, strict=True))
    material = Material("any", equilibrium, Spectrum(tau, mu), law, Gent(110.0), Gent(), 4e-11, Breakdown((1.0,), (4e7,)))
    back = parse_material(write_material(material), "any.toml")
    np.testing.assert_allclose(back.spectrum.relaxation_time, material.spectrum.relaxation_time, rtol=1e-8)
    np.testing.assert_allclose(back.spectrum.shear_modulus, material.spectrum.shear_modulus, rtol=1e-8)
    np.testing.assert_allclose(back.shift.log10_shift_factor([5.0, 35.0]), law.log10_shift_factor([5.0, 35.0]), rtol=1e-7)
    assert back.equilibrium_modulus == pytest.approx(equilibrium, rel=1e-8)
    assert (back.equilibrium_law.J_lim, back.nonequilibrium_law.J_lim) == (110.0, math.inf)
    assert back.breakdown == Breakdown((1.0,), (4e7,))
    assert write_material(back) == write_material(parse_material(write_material(back), "any.toml"))


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


def test_relative_permittivity_is_times_that_of_vacuum() -> None:
    text = VHB.replace('permittivity = "3.98e-11 F/m"', "relative_permittivity = 4.5")
    assert parse_material(text.encode(), "vhb.toml").permittivity == pytest.approx(3.984e-11, rel=1e-3)
