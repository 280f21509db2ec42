"""Roots of rising functions that have no value beyond an edge: closed forms, few rounds, and where there is no root."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dielast.numerics.edged_roots import EDGE, ENDED, FAR, FOUND, LOW, OPEN, PASSED, SHORT, EdgedRoots

SPREAD = np.array((0.75, 0.92, 1.13, 1.39))


def runaway(edge: np.ndarray, top: np.ndarray, goal: np.ndarray, search: EdgedRoots, rounds: int) -> int:
    """Search the stretches of springs whose load has a maximum at the `edge`, where the stretch is at its `top`: the stretch is
    top (1 - sqrt(1 - (V/edge)^2)) up to there, and a trial beyond lasts the shorter the higher it is."""
    for count in range(rounds):
        columns, argument = search.trials()
        if not columns.size:
            return count
        ratio = argument / edge[columns]
        lives = ratio <= 1
        value = top[columns] * (1 - np.sqrt(1 - np.minimum(ratio, 1) ** 2)) - goal[columns]
        kind = np.where(lives, ENDED, np.where(top[columns] >= goal[columns], PASSED, SHORT))
        lasted = np.where(lives, np.nan, -20 * (ratio - 1))
        search.note(columns, argument, np.where(lives, value, top[columns] - goal[columns] - 0.1), kind, lasted)
    return rounds


@settings(max_examples=25)
@given(
    share=st.lists(st.floats(0.02, 0.98), min_size=1, max_size=6),
    guess=st.floats(0.3, 3.0),
    top=st.floats(0.05, 2.0),
)
def test_a_root_before_the_edge_is_found_in_few_rounds(share: list[float], guess: float, top: float) -> None:
    goal = top * np.array(share)
    edge, tops = np.full(goal.size, 3e3), np.full(goal.size, top)
    exact = 3e3 * np.sqrt(1 - (1 - goal / top) ** 2)
    search = EdgedRoots(guess * exact[:, None] * SPREAD, np.full(goal.size, 1e-5 * goal.min()))
    runaway(edge, tops, goal, search, 12)
    assert np.all(search.state == FOUND)
    # the stretch turns upwards at the edge, where the argument is known better than the value
    assert search.root == pytest.approx(exact, rel=1e-4)
    assert np.all(search.passes | (np.abs(np.nanmin(np.abs(search.value), axis=1)) < 1e-4))


def test_near_its_guess_a_root_takes_four_rounds() -> None:
    goal = np.linspace(0.05, 0.9, 40)
    exact = 3e3 * np.sqrt(1 - (1 - goal) ** 2)
    search = EdgedRoots(1.2 * exact[:, None] * SPREAD, 1e-4 * goal)
    assert runaway(np.full(40, 3e3), np.ones(40), goal, search, 12) <= 4
    assert search.root == pytest.approx(exact, rel=1e-5)
    assert np.all((-goal < search.highest) & (search.highest < 0))


@settings(max_examples=20)
@given(beyond=st.floats(1.01, 5.0), guess=st.floats(0.3, 3.0))
def test_no_root_before_the_edge_is_told_in_eight_rounds(beyond: float, guess: float) -> None:
    search = EdgedRoots(guess * 3e3 * SPREAD[None], np.array([1e-5]))
    assert runaway(np.array([3e3]), np.array([0.5]), np.array([0.5 * beyond]), search, 9) <= 8
    assert search.state.tolist() == [EDGE]
    assert search.below[0] <= 3e3 <= search.above[0] <= search.below[0] * (1 + 2e-4)
    assert -0.5 * (beyond - 1) - 0.02 <= search.highest[0] < 0  # how near it comes


@pytest.mark.parametrize(("constant", "state"), [(0.1, LOW), (-0.1, FAR)])
def test_values_that_never_change_their_sign(constant: float, state: int) -> None:
    search = EdgedRoots(1e3 * SPREAD[None], np.array([1e-5]))
    for _ in range(40):
        columns, argument = search.trials()
        if not columns.size:
            break
        kind = np.full(columns.size, ENDED)
        search.note(columns, argument, np.full(columns.size, constant), kind, np.full(columns.size, np.nan))
    assert search.state.tolist() == [state]


@settings(max_examples=20)
@given(beyond=st.floats(1.01, 5.0), guess=st.floats(0.3, 3.0), goal=st.floats(0.1, 0.9))
def test_how_high_values_come_before_an_edge(beyond: float, guess: float, goal: float) -> None:
    """Though they rise vertically there."""
    search = EdgedRoots(guess * 3e3 * SPREAD[None], np.array([1e-5]), to_edge=True)
    assert runaway(np.array([3e3]), np.array([goal]), np.array([goal * beyond]), search, 40) <= 20
    assert search.state.tolist() == [EDGE]
    assert search.highest[0] == pytest.approx(goal - goal * beyond, abs=1e-5)


@settings(max_examples=20)
@given(cliff=st.floats(900, 1500), steep=st.floats(-9, -2), share=st.floats(0.05, 0.95))
def test_a_root_at_a_cliff_is_found_by_halving_the_bracket(cliff: float, steep: float, share: float) -> None:
    search = EdgedRoots(1e3 * SPREAD[None], np.array([1e-5]))
    for _ in range(100):
        columns, argument = search.trials()
        if not columns.size:
            break
        value = 0.5 + 0.5 * np.tanh((argument - cliff) / (cliff * 10**steep)) - share + 1e-4 * (argument - cliff) / cliff
        search.note(columns, argument, value, np.full(columns.size, ENDED), np.full(columns.size, np.nan))
    assert search.state.tolist() == [FOUND]
    assert search.root[0] == pytest.approx(cliff * (1 + 10**steep * np.arctanh(2 * share - 1)), rel=1e-3 * 10**steep)


def test_columns_know_nothing_of_each_other() -> None:
    goal, edge = np.array([0.2, 0.7, 1.4, 0.5]), np.array([3e3, 1e3, 2e3, 5e3])
    first = np.array([2e3, 9e2, 1.5e3, 3e3])[:, None] * SPREAD
    together = EdgedRoots(first, np.full(4, 1e-6))
    runaway(edge, np.ones(4), goal, together, 9)
    for column in range(4):
        alone = EdgedRoots(first[[column]], np.full(1, 1e-6))
        runaway(edge[[column]], np.ones(1), goal[[column]], alone, 9)
        assert alone.state[0] == together.state[column] != OPEN
        assert np.array_equal(alone.root, together.root[[column]], equal_nan=True)


def test_what_passed_beyond_a_trial_that_ended_short_tells_nothing() -> None:
    """Trials that end at once, without telling how nearly they lasted: one far up passed zero, as no lower one would."""
    search = EdgedRoots(2e3 * SPREAD[None], np.array([1e-5]))
    rounds = 0
    while rounds < 9:
        columns, argument = search.trials()
        if not columns.size:
            break
        kind = np.select([argument < 1999.0, argument < 2700.0], [0, 2], 1)
        search.note(columns, argument, np.where(kind == 0, 1e-4 * argument - 0.3, np.nan), kind, np.full(columns.size, -np.inf))
        rounds += 1
    assert rounds <= 6
    assert search.state.tolist() == [EDGE]
    assert search.below[0] <= 1999.0 <= search.above[0]
