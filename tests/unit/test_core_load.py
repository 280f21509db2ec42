"""Straight pieces of load: where they begin and end, and what stands still."""

from __future__ import annotations

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.mechanics.cases import of_case
from dielast.mechanics.history import pieces
from dielast.mechanics.line import Line
from dielast.mechanics.load import Step
from dielast.mechanics.span import Control, Load

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
