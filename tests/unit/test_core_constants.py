"""Constants of nature against another source of them, and the units that they come in."""

from __future__ import annotations

import pytest
import scipy.constants

from dielast.material.material import VACUUM_PERMITTIVITY
from dielast.material.shift import GAS_CONSTANT
from dielast.units import ZERO_CELSIUS


def test_constants_of_nature() -> None:
    assert pytest.approx(GAS_CONSTANT, rel=1e-9) == scipy.constants.R
    assert scipy.constants.epsilon_0 == pytest.approx(VACUUM_PERMITTIVITY, rel=1e-9)
    assert scipy.constants.zero_Celsius == ZERO_CELSIUS
