"""The shift laws themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.material.law import Constant
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftTable, VogelFulcherTammann

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
