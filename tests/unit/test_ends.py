"""The history of a run that stops at an event ends with the film as it was at the event, however sparse the output is."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from films import SOFT
from flat import actuate

from dielast.mechanics.load import VoltageStep, Waveform
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.record import Record, ending

COLUMNS = ("voltage", "stretch_1", "stretch_2", "relative_stretch_1", "nominal_stress_1", "nominal_stress_2", "true_field")
LATER = [VoltageStep(2e3, duration=10.0), VoltageStep.hold(100.0), VoltageStep(3.6e3), VoltageStep.hold(5e3)]
run = partial(actuate, SOFT, steps=LATER, thickness=5e-4, prestretch=1.9, relax=600.0, breakdown_field=4.8e7)


def last(history: ActuationHistory, case: int = 0) -> dict[str, float]:
    row = int(np.flatnonzero(np.isfinite(history.stretch_1[case]))[-1])
    return {name: float(getattr(history, name)[case, row]) for name in (*COLUMNS, "time", "stability")}


@pytest.mark.parametrize(
    ("stop_at", "boundary", "voltage"),
    [
        ("breakdown", "dead-load", 3.6e3),
        pytest.param("breakdown", ("dead-load", "clamped"), 5e3, marks=pytest.mark.trust),
        ("pull-in", "dead-load", 5.5e3),
    ],
)
def test_the_last_row_is_the_state_at_the_stop(stop_at: str, boundary: str | tuple[str, str], voltage: float) -> None:
    steps = [*LATER[:2], VoltageStep(voltage), LATER[3]]
    stopped = partial(run, steps=steps, stop_at=stop_at, boundary=boundary)
    fine = stopped(points_per_decade=7)
    (event,) = [event for event in fine.events[0] if event.name == stop_at]
    given = run(steps=steps, stop_at="end", boundary=boundary, times=[event.time])
    for points_per_decade in (1, 50):
        history = stopped(points_per_decade=points_per_decade)
        assert history.events == fine.events
        row = last(history)
        assert row["time"] == event.time == history.outcome[0].time
        for name in ("voltage", "stretch_1", "stretch_2", "true_field"):
            assert row[name] == pytest.approx(getattr(event, name), rel=1e-12), name
        assert event.time > 110
        # after it there is nothing, before it the rows that were there anyway
        reached = np.isfinite(history.stretch_1[0])
        assert np.all(np.diff(history.time[0][reached])[-2:] > 0)
        assert np.all(np.diff(history.time[0]) >= 0)
        for name, value in last(fine).items():
            assert row[name] == pytest.approx(value, rel=1e-9, abs=1e-300), name
        # and all its numbers are those of the dense output there
        for name in COLUMNS:
            assert row[name] == pytest.approx(float(getattr(given, name)[0, 0]), rel=2e-5), name
        if stop_at == "pull-in":
            assert row["stability"] == 0
        else:
            assert row["stability"] == pytest.approx(float(given.stability[0, 0]), rel=1e-5)


@pytest.mark.trust
def test_a_case_has_the_same_end_alone_and_among_others() -> None:
    fields = np.array([4.0e7, 4.8e7, 9e9])
    together = run(breakdown_field=fields)
    assert [outcome.reason for outcome in together.outcome] == ["breakdown", "breakdown", ""]
    for case, field in enumerate(fields):
        assert last(run(breakdown_field=field)) == last(together, case)


def test_listed_times_stay_as_they_are_unless_the_end_is_wanted() -> None:
    whole = run()
    end = whole.outcome[0].time
    times = [1.0, 50.0, 200.0, 4000.0]
    assert 200 < end < 4000
    listed = run(times=times)
    np.testing.assert_array_equal(listed.time[0], times)
    assert np.isfinite(listed.stretch_1[0]).tolist() == [True, True, True, False]
    ended = run(times=times, with_end=True)
    assert ended.time[0].tolist() == [1.0, 50.0, 200.0, end]
    assert last(ended) == last(whole)
    bare = run(with_end=False)
    assert last(bare)["time"] < end


def test_a_film_that_fails_at_once_has_one_row() -> None:
    history = run(steps=[VoltageStep(1.5e4), VoltageStep.hold(10.0)])
    assert history.outcome[0].time == 0
    assert np.count_nonzero(np.isfinite(history.stretch_1[0])) == 1
    event = history.events[0][0]
    row = last(history)
    assert row["voltage"] == event.voltage < 1.5e4
    assert row["true_field"] == pytest.approx(4.8e7, rel=1e-6)
    assert row["stretch_1"] == event.stretch_1 > 1.9
    # the dead load is held on the way
    assert row["nominal_stress_1"] == pytest.approx(last(run())["nominal_stress_1"], rel=1e-12)


def test_a_jump_later_on_keeps_the_row_before_it() -> None:
    steps = [VoltageStep(2e3), VoltageStep.hold(10.0), VoltageStep(1.5e4), VoltageStep.hold(10.0)]
    history = run(steps=steps)
    assert history.outcome[0].time == 10
    reached = np.isfinite(history.stretch_1[0])
    assert history.time[0][reached][-2:].tolist() == [10.0, 10.0]
    before, after = history.voltage[0][reached][-2:]
    assert before == pytest.approx(2e3)
    assert 2e3 < after < 1.5e4


def test_rows_of_one_time_are_not_doubled() -> None:
    time, values = np.array([[1.0, 2.0, 3.0, 4.0]] * 4), np.arange(16.0).reshape(1, 4, 4)
    values[0, 1, 2:] = values[0, 2, :] = values[0, 3, 3] = np.nan
    reached = np.array([4.0, 2.0, 0.5, 3.5])
    at_end = np.array([[np.nan, 50.0, 60.0, 70.0]])
    ended = ending(Record(time, values), reached, at_end)
    assert ended.time.tolist() == [[1, 2, 3, 4], [1, 2, 3, 4], [0.5, 2, 3, 4], [1, 2, 3, 3.5]]
    np.testing.assert_array_equal(
        ended.values[0], [[0, 1, 2, 3], [4, 50, np.nan, np.nan], [60, np.nan, np.nan, np.nan], [12, 13, 14, 70]]
    )
    assert time[3, 3] == 4  # what came in is left alone


@pytest.mark.parametrize("field", [(1e7, 9e9), (9e9, 1e7), (1e7, 1e7)])
def test_films_that_fail_before_a_waveform_have_no_cycles(field: tuple[float, float]) -> None:
    """Films with equal and with different axes are solved apart; none, one or both of them come to the waveform."""
    steps = [VoltageStep(2.9e3, duration=1.0), VoltageStep(Waveform(0.0, 3e3, 10.0, 2))]
    lateral = np.array([1.9, 1.5])
    together = run(steps=steps, prestretch=(np.full(2, 1.9), lateral), breakdown_field=np.array(field))
    assert together.cycles is not None
    for case in range(2):
        alone = run(steps=steps, prestretch=(1.9, float(lateral[case])), breakdown_field=field[case])
        assert np.isfinite(together.cycles.mean[case]).tolist() == [field[case] > 1e8] * 2
        for header, values in alone.case(0).items():
            np.testing.assert_array_equal(together.case(case)[header], values, err_msg=header)
        assert together.outcome[case] == alone.outcome[0]
