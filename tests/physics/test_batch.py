"""A case gives the same bytes alone and among any others."""

from __future__ import annotations

import numpy as np
import pytest
from films import SOFT
from flat import creep, relax

from dielast.material.material import Material
from dielast.material.shift import WLF
from dielast.material.springs import Gent
from dielast.mechanics.load import Step, Waveform
from dielast.simulate.cycles import CycleTable
from dielast.simulate.membrane import MembraneHistory
from reconstruction import spectrum

VHB = Material("VHB 4905, reconstruction", 26e3, spectrum(), WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0))
TEMPERATURES = np.linspace(-20, 60, 19)


def run(mode: str, temperature: np.ndarray) -> MembraneHistory:
    if mode == "creep":
        return creep(VHB, [Step(stress=5e4, rate=3e3), Step.hold(3600.0), Step(stress=0.0, duration=0.0)], temperature=temperature)
    return relax(VHB, [Step(stretch=2.0, rate=0.125), Step.hold(3600.0)], mode=mode, temperature=temperature)


@pytest.mark.parametrize(
    "mode",
    [
        pytest.param("uniaxial", marks=pytest.mark.trust),
        pytest.param("equibiaxial", marks=pytest.mark.trust),
        pytest.param("pure-shear", marks=pytest.mark.trust),
        "creep",
    ],
)
def test_a_case_does_not_depend_on_its_company(mode: str) -> None:
    whole = run(mode, TEMPERATURES)
    for members in ([3], [3, 7], [3, 7, 11], list(range(3, 19, 2))):
        part = run(mode, TEMPERATURES[members])
        for name in ("time", "stretch_1", "stretch_2", "nominal_stress_1", "nominal_stress_2"):
            np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[members], err_msg=f"{name}, {members}")


def test_a_row_of_cycles_does_not_depend_on_its_company() -> None:
    def cycled(stress: float | np.ndarray) -> CycleTable:
        steps = [Step(stress=stress, rate=1e3), Step.hold(1e3), Step(stress=Waveform(1e4, 2e4, 5.0, 5, "triangle"))]
        table = creep(SOFT, steps, mode="equibiaxial").cycles
        assert table is not None
        return table

    stress = np.array([1e4, 2e4, 3e4])
    whole = cycled(stress)
    for row, value in enumerate(stress):
        for name, column in cycled(float(value)).case(0).items():
            np.testing.assert_array_equal(column, whole.case(row)[name], err_msg=f"{name}, {row}")
