"""The plan of a design: relaxed films with their goals, and the search for the voltage that takes a film to its goal.

The films of a chunk are searched together: a round is one run of all voltages to try, at most a few per film.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dielast.io.result import Result
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.edged_roots import EDGE, ENDED, FAR, FOUND, OPEN, PASSED, SHORT, EdgedRoots
from dielast.numerics.integrate import Status
from dielast.simulate.film_grid import FilmGrid, Group
from dielast.simulate.goal import Goal, voltage_about
from dielast.simulate.history import first_of

ROUNDS = 100  # of trials, at most: a bracket is halved every other round
MET = 1e-4  # accuracy of a goal, in the logarithm of the stretch or of the area
CLOSE = 0.2  # fraction of that accuracy at which a search ends
SHARE = 1e-3  # the same as a fraction of the way to the goal, if that is smaller
NOISE = 3.0  # accuracy of a stretch, in relative tolerances of the solver
ROUNDING = 1e-12
SPREAD = np.array((0.75, 0.92, 1.13, 1.39))  # first voltages over the expected voltage
CHUNK = 256  # films
NONE, UNFINISHED = "none", "unfinished"
Names = NDArray[np.object_]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DesignPlan(Result):
    """Films of a `grid` with their `goal`: `temperature` (films,) in degC, `prestretch` (films, 2), undeformed `thickness` (films,)
    in
    m, and `electrode_share` (films,) if they have a passive part.

    For the draws, which are solved after the films: `voltage` (films,) in V is the voltage of the design, NaN where there is none,
    and `slope` (films,) the derivative of its square with respect to the logarithm of the stretch.
    """

    grid: FilmGrid
    goal: Goal
    horizon: float
    temperature: Floats
    prestretch: Floats
    thickness: Floats
    electrode_share: Floats | None = None
    voltage: Floats = field(default_factory=lambda: np.zeros(0))
    slope: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def films(self) -> int:
        """The number of films, not counting draws."""
        return self.goal.target.size

    @property
    def criteria(self) -> tuple[str, ...]:
        """The names of the criteria that end a film, including loss of tension: a slack film wrinkles, beyond these equations."""
        return (*self.grid.failures, LossOfTension.name)

    def chunks(self, drawn: bool = False, size: int = CHUNK) -> list[tuple[int, int]]:
        """First film and end of each chunk, of the films or of the draws; a chunk lies within one group."""
        return self.grid.chunks(size, drawn=drawn)


@dataclass(frozen=True, slots=True, eq=False)
class Designed:
    """Results for `films` (k,): the `state` of the search (see `edged_roots`); the `voltage` in V that reaches the goal, and its
    `slope`, the derivative of its square with respect to the logarithm of the stretch.

    `missed` is the remaining distance to the goal, or the smallest one among the trials if the goal is not reached. `time` in s and
    `mode` are those of the failure under the voltage, NaN and "none" without failure; `mode` of a film that fails first is that
    failure. `rounds` is the number of rounds of trials.
    """

    films: Cases
    state: Cases
    voltage: Floats
    slope: Floats
    missed: Floats
    time: Floats
    mode: Names
    rounds: int


@dataclass(frozen=True, slots=True, eq=False)
class _Trials:
    """Trials (t,) of voltages on columns of films: the `voltage`, or the voltage at which a film failed as it was applied at once;
    `value`, the distance to the goal; `ended`, the same where the film failed; `kind`, the outcome (see `edged_roots`); `time` in
    s and `mode` of the first event.
    """

    columns: Cases
    voltage: Floats
    value: Floats
    ended: Floats
    kind: Cases
    time: Floats
    mode: Names


def solve_films(plan: DesignPlan, first: int, end: int) -> Designed:
    """Find the voltages of a chunk of films, and the lives of the films under them."""
    group, columns = plan.grid.cells_of(first, end)
    films = group.films[columns]
    goal = plan.goal.take(films)
    part = group.take(columns)
    pair = paired(np.arange(films.size))
    expected, limited = voltage_about(part.take(pair), goal.take(pair))
    search = EdgedRoots(expected[: films.size, None] * SPREAD, _tolerance(goal, group.rtol), to_edge=True)
    beyond = limited[: films.size]
    short, rounds = _search(plan, part, goal, search, beyond)
    state = np.where(beyond, FAR, search.state)
    found = np.flatnonzero(state == FOUND)
    voltage, time, missed = np.full((3, films.size), np.nan)
    mode = np.full(films.size, NONE, dtype=object)
    voltage[found] = search.root[found]
    slope = np.full(films.size, np.nan)
    if found.size:
        lives = _tried(plan, part, goal, found, voltage[found], plan.horizon)
        rounds += 1
        time[found], mode[found], missed[found] = lives.time, lives.mode, lives.value
        slope[found] = search.slope_at_root[found]
    lost = (state == OPEN) | ((state == FOUND) & ~(np.abs(missed) <= MET))
    state = np.where(lost, OPEN, state)
    for column in np.flatnonzero(state == EDGE).tolist():
        mode[column] = short.get(column, NONE)
    mode[lost] = UNFINISHED
    missed = np.where(state == FOUND, missed, search.highest)
    return Designed(films, state, voltage, slope, missed, time, mode, rounds)


def solve_draws(plan: DesignPlan, first: int, end: int) -> Designed:
    """Find the lives of a chunk of drawn films under the voltage of the design, and the voltage that each draw needs."""
    group, columns = plan.grid.cells_of(first, end)
    columns = columns[np.isfinite(plan.voltage[group.films[columns] % plan.films])]
    films = group.films[columns]
    film_of_draw = films % plan.films
    goal, every = plan.goal.take(film_of_draw), np.arange(films.size)
    if not films.size:
        nothing = np.zeros(0)
        return Designed(films, films, nothing, nothing, nothing, nothing, np.zeros(0, dtype=object), 0)
    part = group.take(columns)
    search = EdgedRoots(plan.voltage[film_of_draw][:, None], _tolerance(goal, group.rtol), slope=plan.slope[film_of_draw])
    lives = _tried(plan, part, goal, every, plan.voltage[film_of_draw], plan.horizon)
    search.note(every, lives.voltage, lives.value, lives.kind, np.log(lives.time / goal.at))
    _, rounds = _search(plan, part, goal, search, np.zeros(films.size, dtype=bool), 1)
    state = search.state
    voltage = np.where(state == FOUND, search.root, np.where(state == OPEN, np.nan, np.inf))
    return Designed(films, state, voltage, plan.slope[film_of_draw], lives.value, lives.time, lives.mode, rounds)


def _tolerance(goal: Goal, rtol: float) -> Floats:
    """The largest distance (films,) to the goal at which a search ends."""
    return np.maximum(np.minimum(CLOSE * MET, SHARE * goal.size), min(NOISE * rtol, MET))


def _search(
    plan: DesignPlan, part: Group, goal: Goal, search: EdgedRoots, beyond: Flags, rounds: int = 0
) -> tuple[dict[int, str], int]:
    """Try voltages until the search is over.

    Returns, by column, how films failed short of their goals at the lowest such voltage, and the number of rounds in all.
    """
    lowest: dict[int, tuple[float, str]] = {}
    while rounds < ROUNDS - 1:
        columns, voltage = search.trials()
        columns, voltage = columns[~beyond[columns]], voltage[~beyond[columns]]
        if not columns.size:
            break
        trials = _tried(plan, part, goal, columns, voltage, goal.at)
        rounds += 1
        with np.errstate(divide="ignore"):
            value = np.where(trials.kind == SHORT, trials.ended, trials.value)
            search.note(columns, trials.voltage, value, trials.kind, np.log(trials.time / goal.at))
        for trial in np.flatnonzero(trials.kind == SHORT).tolist():
            column, volts = int(columns[trial]), float(trials.voltage[trial])
            if column not in lowest or volts < lowest[column][0]:
                lowest[column] = volts, str(trials.mode[trial])
    return {column: mode for column, (_, mode) in lowest.items()}, rounds


def _tried(plan: DesignPlan, part: Group, goal: Goal, columns: Cases, voltage: Floats, horizon: float) -> _Trials:
    """Try voltages (t,) on columns (t,) of a group, up to a horizon in s."""
    criteria, goal = plan.criteria, goal.take(columns)
    lives = part.lives(columns, voltage, horizon=horizon, watched=criteria, ends=criteria, times=[goal.at])
    end = first_of(lives.happened, criteria)
    mode = np.full(columns.size, NONE, dtype=object)
    mode[~np.isin(lives.status, (Status.COMPLETED, Status.STOPPED))] = UNFINISHED
    for name in reversed(criteria):
        mode[first_of(lives.happened, [name]).time == end.time] = name
    lived = ~(end.time < goal.at) & np.isfinite(lives.stretched[0, 0])
    value = np.where(lived, goal.missed(lives.stretched[:, 0]), np.nan)
    # A film that fails while a voltage is applied at once fails likewise under every higher voltage; its state beyond that failure
    # is not a state that the film would reach.
    failed_at = np.abs(end.field) * part.thickness[columns]
    halfway = (end.time == 0) & (failed_at < voltage * (1 - ROUNDING))
    voltage = np.where(halfway, failed_at, voltage)
    ended = goal.missed(lives.relative_stretch(end))
    passed = (halfway | (end.time > 0)) & (ended >= 0)
    return _Trials(columns, voltage, value, ended, np.where(lived, ENDED, np.where(passed, PASSED, SHORT)), end.time, mode)
