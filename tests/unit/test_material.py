from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.handover.material_file import parse_material, read_material, write_material
from dielast.material.material import Breakdown, Material
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent

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


def test_a_material_file_is_read() -> None:
    material = parse_material(VHB.encode(), "vhb.toml")
    assert material.equilibrium_modulus == 26e3
    assert material.equilibrium_law.J_lim == 110.0
    assert material.spectrum.shear_modulus.tolist() == [1017.5, 1377.0]
    assert material.shift == WLF(20.0, 13.7, 187.1)
    assert material.permittivity == 3.98e-11
    assert material.breakdown == Breakdown((1.7, 1.9), (40e6, 48e6))
    slower = 10 ** (13.7 * 20 / 167.1)
    np.testing.assert_allclose(material.relaxation_time([0.0, 20.0])[0], slower * np.array([159000.0, 58000.0]))


def test_left_out_sections_take_their_defaults() -> None:
    text = VHB.split("[dielectric]")[0].replace("J_lim = 110.0\n", "")
    material = parse_material(text.encode(), "vhb.toml")
    assert material.equilibrium_law.J_lim == math.inf
    assert material.permittivity is None
    assert material.breakdown is None


def test_relative_permittivity_is_times_that_of_vacuum() -> None:
    text = VHB.replace('permittivity = "3.98e-11 F/m"', "relative_permittivity = 4.5")
    assert parse_material(text.encode(), "vhb.toml").permittivity == pytest.approx(3.984e-11, rel=1e-3)


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


def test_a_missing_material_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_material(tmp_path / "none.toml")


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
