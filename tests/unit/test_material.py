"""Shift laws, and the files that state a material."""

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
from dielast.material.springs import Gent

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
