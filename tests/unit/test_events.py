"""Events on dense output: roots, dips that come back within a step, first falls."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from films import SOFT
from flat import actuate
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from dielast.mechanics.criteria.breakdown import ElectricalBreakdown
from dielast.mechanics.criteria.criterion import Signal, WatchedFilms
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn
from dielast.mechanics.load import VoltageStep
from dielast.mechanics.watch import EventArrays
from dielast.numerics.roots import fall, samples
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.events import events_of, first_of

Array = NDArray[np.float64]


@given(st.lists(st.floats(1e-6, 1 - 1e-6), min_size=1, max_size=5), st.sampled_from([1.0, 3.0, 5.0]))
def test_falls_are_found_to_rounding(roots: list[float], power: float) -> None:
    wanted = np.array(roots)

    def signal(fraction: Array) -> Array:
        return np.sign(wanted - fraction) * np.abs(wanted - fraction) ** power + 0.1 * (wanted - fraction)

    assert fall(signal, np.zeros_like(wanted), np.ones_like(wanted)) == pytest.approx(wanted, abs=2e-13)


def test_a_column_does_not_depend_on_its_company() -> None:
    wanted = np.linspace(0.01, 0.99, 37)

    def signal(part: Array) -> Callable[[Array], Array]:
        return lambda fraction: np.cos(np.pi / 2 * fraction / part)

    together = fall(signal(wanted), np.zeros(37), np.ones(37) * np.minimum(2 * wanted, 1))
    apart = np.concatenate([fall(signal(w), np.zeros(1), np.minimum(2 * w, 1)) for w in wanted[:, None]])
    assert np.array_equal(together, apart)


def watched(
    monkeypatch: pytest.MonkeyPatch, margin: Callable[[Array], Array], stop_at: str = "pull-in", rtol: float = 1e-4
) -> ActuationHistory:
    """A film whose margin is a given function of time."""
    from dielast.simulate import actuation_history as module

    class Prescribed(PullIn):
        def signal(self, films: WatchedFilms) -> Signal:
            return lambda moment: np.asarray(margin(moment.age))  # the voltage rises at 0 s

    monkeypatch.setattr(module, "CRITERIA", [Prescribed()])
    return actuate(
        SOFT, [VoltageStep(2e3), VoltageStep.hold(1e4)], thickness=5e-4, prestretch=1.5, relax=10.0, stop_at=stop_at, rtol=rtol
    )


@pytest.mark.parametrize("width", [1e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("at", [47.1, 300.0, 1234.5])
def test_a_pair_of_crossings_within_a_step_is_not_stepped_over(monkeypatch: pytest.MonkeyPatch, at: float, width: float) -> None:
    history = watched(monkeypatch, lambda time: 0.1 * np.minimum((time / at - 1) ** 2 - width**2, 1.0))
    assert history.events[0][0].time == pytest.approx(at * (1 - width), rel=1e-9)


def test_the_first_of_three_crossings_counts() -> None:
    def signal(fraction: Array) -> Array:
        return np.asarray(-(fraction - 0.3) * (fraction - 0.6) * (fraction - 0.9))

    values, fractions = samples(signal, signal(np.zeros(1)), signal(np.ones(1)))
    first = int(np.argmax(values[:, 0] <= 0))
    assert fall(signal, fractions[first - 1], fractions[first])[0] == pytest.approx(0.3, abs=1e-12)


def test_a_dip_that_stays_above_zero_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    history = watched(monkeypatch, lambda time: np.minimum((time / 47 - 1) ** 2 + 1e-6, 1.0))
    assert not history.events[0]
    assert history.outcome[0].completed


def test_what_has_fallen_when_it_begins_happens_then(monkeypatch: pytest.MonkeyPatch) -> None:
    history = watched(monkeypatch, lambda time: -np.ones_like(time))
    assert history.events[0][0].time == 0.0
    assert history.outcome[0].reason == "pull-in"


def test_a_dip_from_far_above_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    # a pair of crossings far below the margin at the ends of its step, as steps at 1e-2 are long enough to hold
    def margin(time: Array) -> Array:
        return np.asarray(np.minimum(2.0 * ((time / 300.0 - 1) ** 2 - 0.01), 0.9))

    assert [event.name for event in watched(monkeypatch, margin, rtol=1e-2).events[0]] == ["pull-in"]


def test_of_events_at_one_time_the_first_is_at_the_lowest_voltage() -> None:
    def at(time: float, field: float) -> EventArrays:
        return EventArrays(
            np.array([time]), np.array([field]), *np.zeros((2, 2, 1)), np.zeros(1), np.zeros((0, 1)), *np.zeros((2, 1))
        )

    happened = {ElectricalBreakdown(): at(2.0, -8e6), LossOfTension(0): at(2.0, -7e6), LossOfTension(1): at(2.0, -6e6)}
    names = ["breakdown", "loss-of-tension"]
    assert first_of(happened, names).field.tolist() == [-6e6]
    assert first_of(happened, ["breakdown"]).field.tolist() == [-8e6]
    assert first_of({**happened, PullIn(): at(1.0, -9e6)}, [*names, "pull-in"]).time.tolist() == [1.0]
    found = events_of(happened, 0, 1e-3, 2.0)
    assert [(event.name, event.voltage) for event in found] == [("loss-of-tension", -6e3), ("breakdown", -8e3)]
