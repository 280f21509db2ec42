"""Loads that follow many measured points: the solver goes on from one point to the next without starting anew."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flat import actuate, creep, relax
from numpy.typing import NDArray

import dielast
from dielast.handover.material_file import parse_material
from dielast.mechanics.load import Step, Track, VoltageStep

Array = NDArray[np.float64]
FILE = Path(dielast.__file__).parent / "examples/vhb4905.toml"
VHB = parse_material(FILE.read_bytes(), FILE.name)
TIME = np.arange(1.0, 21.0)
# soon after a point, where a kink shows, as well as between points
LOOK = np.unique(np.concatenate((TIME, TIME[1:] - 0.999, TIME[1:] - 0.97, TIME[1:] - 0.5)))
WAVE = np.sin(TIME / 5)
NOISE = np.random.default_rng(1).normal(0.0, 1.0, TIME.size)


@pytest.mark.parametrize("noise", [0.0, pytest.param(0.02, marks=pytest.mark.trust)])
def test_a_stress_that_follows_a_table(noise: float) -> None:
    stress = 4e4 * (1 + 0.5 * WAVE + noise * NOISE)
    loose, tight = (creep(VHB, [Step(stress=Track(TIME, stress))], times=LOOK, rtol=rtol) for rtol in (1e-6, 1e-8))
    assert loose.stretch_1 == pytest.approx(tight.stretch_1, rel=1e-6)
    assert loose.steps[0] < (6 if noise == 0 else 9) * TIME.size  # 14 and 16 where each point is a start


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=pytest.mark.trust), 0.003])
def test_a_stretch_that_follows_a_table(noise: float) -> None:
    stretch = 1.3 + 0.2 * WAVE + noise * NOISE
    loose, tight = (relax(VHB, [Step(stretch=Track(TIME, stretch))], times=LOOK, rtol=rtol) for rtol in (1e-6, 1e-8))
    assert loose.nominal_stress_1 == pytest.approx(tight.nominal_stress_1, rel=1e-6)


@pytest.mark.parametrize("prestretch", [pytest.param(1.9, marks=pytest.mark.trust), (2.0, 1.5)])
def test_a_voltage_that_follows_a_table(prestretch: float | tuple[float, float]) -> None:
    steps = [VoltageStep(Track(TIME, 1500 + 1000 * WAVE + 30 * NOISE))]
    loose, tight = (
        actuate(
            VHB,
            steps,
            thickness=5e-4,
            prestretch=prestretch,
            relax=60.0,
            breakdown_field=1e9,
            stop_at="end",
            times=LOOK,
            rtol=rtol,
        )
        for rtol in (1e-6, 1e-8)
    )
    assert loose.stretch_1 == pytest.approx(tight.stretch_1, rel=1e-6)
    assert loose.stability == pytest.approx(tight.stability, rel=1e-5)


def test_a_ramp_that_locks_every_spring_is_given_up_soon() -> None:
    result = relax(VHB, [Step(stretch=9.0, rate=1e12)])
    assert not result.outcome[0].completed
    assert "standstill" in result.outcome[0].reason
    assert result.steps[0] <= 2000
