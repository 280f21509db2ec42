"""Load histories: what a step means, where its straight pieces begin and end, and what is wrong with it."""

from __future__ import annotations

import numpy as np
import pytest
from flat import relax

from dielast.base.errors import InputError
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.cases import of_case
from dielast.mechanics.history import case_count, pieces
from dielast.mechanics.line import Line
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


BOTH = (Control.STRETCH, Control.STRESS)


def test_a_ramp_begins_and_ends_where_it_should_and_stands_still_where_it_takes_no_time() -> None:
    start, end = (
        np.array([[1.0, 1.5, 1.0], [0.0, 2e4, 0.0], [0.0, 1e6, 0.0]]),
        np.array([[2.0, 1.0, 1.0], [1e4, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    )
    duration = np.array([4.0, 2.0, 0.0])
    ramp = Load.between(BOTH, start, end, duration)
    assert np.array_equal(ramp.value(np.zeros(3)), start)
    assert ramp.value(duration)[:, :2] == pytest.approx(end[:, :2], abs=1e-12)
    assert ramp.value(0.25 * duration) == pytest.approx(0.75 * start + 0.25 * end * (duration > 0) + 0.25 * start * (duration == 0))
    assert ramp.value(np.full(3, 9.0))[:, 2].tolist() == start[:, 2].tolist()
    assert ramp.moving.tolist() == [True, True, False]
    assert ramp.electric
    part = ramp.take(np.array([2, 0]))
    assert np.array_equal(part.value(duration[[2, 0]]), ramp.value(duration)[:, [2, 0]])


@pytest.mark.parametrize(("field", "electric"), [((0.0, 0.0), False), ((0.0, 1e6), True), ((1e6, 1e6), True), ((1e6, 0.0), True)])
def test_a_ramp_knows_whether_anything_moves_and_whether_there_is_a_field(field: tuple[float, float], electric: bool) -> None:
    start, end = np.array([[1.0], [0.0], [field[0]]]), np.array([[1.0], [0.0], [field[1]]])
    ramp = Load.between(BOTH, start, end, np.ones(1))
    assert ramp.electric == electric
    assert ramp.moving.tolist() == [field[0] != field[1]]
    assert not Load.between(BOTH, start, end, np.zeros(1)).moving.any()


def test_a_rate_is_that_of_the_axis_that_moves_furthest() -> None:
    (piece,) = pieces([Step(stretch=([2.0, 1.5, 1.0], [1.5, 4.0, 1.0]), rate=0.5)], "uniaxial", 3)
    present = np.array([[1.0] * 3, [1.0] * 3, [0.0] * 3])
    line = piece.begin(present)
    end, duration = line.end, line.duration
    assert end.tolist() == [[2.0, 1.5, 1.0], [1.5, 4.0, 1.0], [0.0, 0.0, 0.0]]
    assert duration.tolist() == [2.0, 6.0, 0.0]


def test_only_the_paced_quantity_counts_for_a_rate() -> None:
    (piece,) = pieces([Step(stretch=(2.0, None), stress=(None, 1e5), rate=0.5)], "uniaxial", 1)
    line = piece.begin(np.array([[1.0], [0.0], [0.0]]))
    end, duration = line.end, line.duration
    assert end[:, 0].tolist() == [2.0, 1e5, 0.0]
    assert duration.tolist() == [2.0]
    (piece,) = pieces([Step(stress=(1e4, -3e4), rate=-1e3)], "uniaxial", 1)
    assert piece.begin(np.array([[2e4], [0.0], [0.0]])).duration.tolist() == [30.0]


def test_what_is_reached_already_but_for_rounding_takes_no_time() -> None:
    (piece,) = pieces([Step(stretch=1.3, rate=0.5)], "uniaxial", 2)
    duration = piece.begin(np.array([[1.3 * (1 + 4e-16), 1.3 - 1e-9], [0.0, 0.0], [0.0, 0.0]])).duration
    assert duration[0] == 0.0
    assert duration[1] == pytest.approx(2e-9, rel=1e-6)


def test_a_rate_that_leads_away_names_its_case_and_the_sign_that_is_needed() -> None:
    (piece,) = pieces([Step(stretch=[2.0, 2.0, 0.5], rate=[1.0, -1.0, 1.0])], "uniaxial", 3)
    with pytest.raises(InputError, match=r"case 1: rate -1 leads away from the target: \+1 of stretch is to go, so .* positive"):
        piece.begin(np.ones((3, 3)))
    (piece,) = pieces([Step(stretch=0.5, rate=1.0)], "uniaxial", 1)
    with pytest.raises(InputError, match=r"^step 0: rate 1 leads away from the target: -0.5 of stretch is to go, so .* negative"):
        piece.begin(np.ones((3, 1)))
    assert (of_case(0, 1), of_case(0, 2)) == (None, 0)


def test_what_is_not_prescribed_anew_stays_as_it_is() -> None:
    hold = Line.to(BOTH, (None, None, np.array([5.0])), np.array([3.0]))
    line = hold.begin(np.array([[1.7], [2e4], [1.0]]))
    assert line.end[:, 0].tolist() == [1.7, 2e4, 5.0]
    assert line.duration.tolist() == [3.0]
