"""Load histories: what a step means, and what is wrong with it."""

from __future__ import annotations

import numpy as np
import pytest
from flat import relax

from dielast.base.errors import InputError
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.history import case_count, pieces
from dielast.mechanics.load import Step, Track
from dielast.mechanics.span import Control, Load

SOLID = Material("one", 26e3, Spectrum([10.0], [1e5]), NoShift(20.0), Gent(110.0), Gent(55.0))


@pytest.mark.parametrize(
    ("mode", "controls", "second"),
    [
        ("uniaxial", (Control.STRETCH, Control.STRESS), 0.0),
        ("equibiaxial", (Control.STRETCH, Control.STRETCH), 2.0),
        ("pure-shear", (Control.STRETCH, Control.STRETCH), 1.0),
    ],
)
def test_a_mode_says_what_a_value_means(mode: str, controls: tuple[Control, Control], second: float) -> None:
    (piece,) = pieces([Step(stretch=2.0, rate=0.5)], mode, 1)
    assert piece.controls == controls
    assert piece.end[1] == second
    line = piece.begin(np.array([[1.0], [second if mode == "uniaxial" else 1.0], [0.0]]))
    assert (line.end[0], line.duration) == (2.0, 2.0)


def test_a_hold_keeps_what_the_step_before_prescribed() -> None:
    first, hold = pieces([Step(stress=(None, 1e4), stretch=(1.5, None), duration=1.0), Step.hold(5.0)], "equibiaxial", 1)
    assert hold.controls == first.controls
    assert np.isnan(hold.end).all()


def test_values_may_differ_from_case_to_case() -> None:
    steps = [Step(stretch=[1.5, 2.0, 3.0], rate=[0.1, 1.0, 10.0]), Step.hold(1.0)]
    assert case_count(steps, 20.0) == 3
    history = relax(SOLID, steps)
    assert history.stretch_1[:, -1] == pytest.approx([1.5, 2.0, 3.0])
    assert history.time[:, -1] == pytest.approx([6.0, 2.0, 1.2])
    with pytest.raises(InputError, match="do not make one set of cases"):
        relax(SOLID, steps, temperature=[10.0, 20.0])


def test_a_table_is_followed_in_straight_lines() -> None:
    time, stretch = np.array([0.0, 1.0, 3.0, 4.0]), np.array([1.0, 1.5, 1.5, 1.2])
    history = relax(SOLID, [Step(stretch=Track(time, stretch))], times=np.linspace(0, 4, 17))
    assert history.stretch_1[0] == pytest.approx(np.interp(np.linspace(0, 4, 17), time, stretch), rel=1e-12)


def test_cycles_unload_with_a_negative_rate() -> None:
    history = relax(SOLID, 3 * [Step(stretch=2.0, rate=1.0), Step(stretch=1.0, rate=-1.0)], slack="pushes")
    assert history.completed
    assert history.time[0, -1] == pytest.approx(6.0)
    assert history.nominal_stress_1[0, -1] < 0


def test_a_ramp_between_two_states() -> None:
    ramp = Load.between((Control.STRESS, Control.STRESS), np.zeros((3, 2)), np.ones((3, 2)), np.array([0.0, 2.0]))
    assert ramp.value(np.array([0.0, 1.0])).tolist() == [[0.0, 0.5]] * 3
    assert ramp.moving.tolist() == [False, True]
    assert ramp.electric


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([Step(stretch=2.0, rate=1.0), Step(stretch=1.0, rate=1.0)], "step 1: rate 1 leads away from the target"),
        # a track that begins late is two pieces of one step, and the rate of a stress after a stretch is tested on the way
        ([Step(stretch=Track([1.0, 2.0], [1.5, 2.0])), Step(stretch=1.0, rate=1.0)], "step 1: rate 1 leads away"),
        ([Step(stretch=Track([1.0, 2.0], [1.5, 2.0])), Step(stress=1e4, rate=1e4)], "step 1: rate 10000 leads away"),
        (
            [Step(stretch=2.0), Step(stretch=1.5, stress=Track([0.0, 1.0], [0.0, 1e4]))],
            "step 1: a waveform or a track states its times",
        ),
        ([Step(stretch=2.0, rate=1.0, duration=1.0)], "step 0: a rate or a duration"),
        ([Step(stretch=2.0, stress=1e4)], "step 0: a stretch or a stress"),
        ([Step(stretch=(2.0, None))], "step 0: axis 2 needs either a stretch or a stress"),
        ([Step()], "step 0: a stretch, a stress, or the duration"),
        ([Step(stretch=9.0)], "step 0: stretch 9 is beyond the Gent limit, J_lim = 55"),
    ],
)
def test_wrong_steps_are_said_to_be_wrong(steps: list[Step], message: str) -> None:
    with pytest.raises(InputError, match=message):
        relax(SOLID, steps)
