"""The plan of a design: relaxed films with their goals, and the search for the voltage that takes a film to its goal.

The films of a chunk are searched together: a round is one run of all voltages to try, at most a few per film.
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats, paired
from dielast.numerics.edged_roots import EDGE, ENDED, FAR, FOUND, OPEN, PASSED, SHORT, EdgedRoots
from dielast.numerics.integrate import Status
from dielast.simulate.events import NONE, Names, first_of, name_of_first
from dielast.simulate.film_grid import FilmGrid, Group, axis_of
from dielast.simulate.options import Options

ROUNDS = 100  # of trials, at most: a bracket is halved every other round
MET = 1e-4  # accuracy of a goal, in the logarithm of the stretch or of the area
CLOSE = 0.2  # fraction of that accuracy at which a search ends
SHARE = 1e-3  # the same as a fraction of the way to the goal, if that is smaller
NOISE = 3.0  # accuracy of a stretch, in relative tolerances of the solver
ROUNDING = 1e-12
SPREAD = np.array((0.75, 0.92, 1.13, 1.39))  # first voltages over the expected voltage
CHUNK = 256  # films
UNFINISHED = "unfinished"
WAY = (0.1, 0.25, 0.5, 0.75, 1.0)  # fractions of the logarithm of the stretch at the goal
RELATIVE_STRETCH, AREA_STRAIN = "relative_stretch", "area_strain"
FAILURE_PROBABILITY = 0.05


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Goal(Options):
    """What each film of a design is to do: reach a `relative_stretch` of axis 1 (relative to the prestretch) or an `area_strain` of
    its active part (relative to the prestretched area), one number or a list, `at` a time in s after a constant voltage is applied.

    Its life is computed up to the `horizon` in s; with draws, also the life that a fraction `failure_probability` of films does not
    reach.
    """

    at: float
    horizon: float
    relative_stretch: ArrayLike | None = None
    area_strain: ArrayLike | None = None
    failure_probability: float = FAILURE_PROBABILITY


@dataclass(frozen=True, slots=True, eq=False)
class Targets(ByCase):
    """A `target` (films,) to reach `at` a time in s after a constant voltage is applied; `name` says what it is (see `Goal`)."""

    name: str
    target: Floats
    at: float

    @classmethod
    def of(cls, goal: Goal) -> Self:
        """The targets of a goal; `InputError` unless exactly one kind is stated, with possible values."""
        relative_stretch, area_strain, at = goal.relative_stretch, goal.area_strain, goal.at
        if (relative_stretch is None) == (area_strain is None):
            raise InputError("either a relative_stretch or an area_strain is needed", argument="goal")
        name, stated = (RELATIVE_STRETCH, relative_stretch) if area_strain is None else (AREA_STRAIN, area_strain)
        assert stated is not None
        target = axis_of(stated, name)
        if name == RELATIVE_STRETCH and np.any(target <= 1):
            wrong = float(target.min())
            raise InputError(f"{wrong:g}: a relative stretch above 1 is needed, such as 1.1", argument=name)
        if np.any(target <= 0):
            wrong = float(target.min())
            raise InputError(f"{wrong:g}: an area strain above 0 is needed, such as 0.2 for 20 %", argument=name)
        if not (np.isfinite(at) and at > 0):
            raise InputError(f"{at:g} s: it must be positive", argument="at")
        return cls(name, target, at)

    @property
    def size(self) -> Floats:
        """The logarithm (films,) of the relative stretch or area at the goals."""
        return np.asarray(np.log(self.target) if self.name == RELATIVE_STRETCH else np.log1p(self.target))

    def missed(self, stretch: Floats) -> Floats:
        """The logarithmic distance (films,) of relative stretches (2, films) from the goals, negative short of them."""
        return np.asarray(np.log(stretch[0] if self.name == RELATIVE_STRETCH else stretch[0] * stretch[1]) - self.size)

    def reached(self, missed: Floats) -> Floats:
        """The relative stretch or the area strain (films,) at the logarithmic distance `missed` (films,) from the goals."""
        return np.asarray(np.exp(self.size + missed) if self.name == RELATIVE_STRETCH else np.expm1(self.size + missed))

    def steps(self, controls: Controls) -> Floats:
        """Estimated relative stretches (2, films) of both axes at the goals; `InputError` if the boundary excludes the goal."""
        held = [control is Control.STRETCH for control in controls]
        if all(held):
            raise InputError("both axes are clamped: no voltage moves the film", argument="boundary")
        if held[0] and self.name == RELATIVE_STRETCH:
            raise InputError("axis 1 is clamped: state an area_strain instead", argument=RELATIVE_STRETCH)
        stretch = np.exp(self.size / (1 if self.name == RELATIVE_STRETCH or any(held) else 2))
        return np.stack([np.ones_like(stretch) if clamped else stretch for clamped in held])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DesignPlan(Result):
    """Films of a `grid` with their `goal`, and the `horizon` of their lives in s.

    For the draws, which are solved after the films: `voltage` (films,) in V is the voltage of the design, NaN where there is none,
    and `slope` (films,) the derivative of its square with respect to the logarithm of the stretch.
    """

    grid: FilmGrid
    goal: Targets
    horizon: float
    voltage: Floats = field(default_factory=lambda: np.zeros(0))
    slope: Floats = field(default_factory=lambda: np.zeros(0))

    def relaxed(self) -> Self:
        """The plan with prestretched and relaxed films; raises `NumericsError` if the prestretch of a film cannot be computed."""
        return replace(self, grid=self.grid.relaxed())

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
    """Trials (t,) of voltages on films: the `voltage`, or the voltage at which a film failed as it was applied at once;
    `value`, the distance to the goal; `ended`, the same where the film failed; `kind`, the outcome (see `edged_roots`); `time` in
    s and `mode` of the first event.
    """

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
    mode[state == EDGE] = short[state == EDGE]
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


def _tolerance(goal: Targets, rtol: float) -> Floats:
    """The largest distance (films,) to the goal at which a search ends."""
    return np.maximum(np.minimum(CLOSE * MET, SHARE * goal.size), min(NOISE * rtol, MET))


def _search(plan: DesignPlan, part: Group, goal: Targets, search: EdgedRoots, beyond: Flags, rounds: int = 0) -> tuple[Names, int]:
    """Try voltages until the search is over.

    Returns how films (k,) failed short of their goals at the lowest such voltage, and the number of rounds in all.
    """
    lowest, modes = np.full(beyond.size, np.inf), np.full(beyond.size, NONE, dtype=object)
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
        short = np.flatnonzero((trials.kind == SHORT) & (trials.voltage < lowest[columns]))
        short = short[np.argsort(-trials.voltage[short])]  # of several trials of a film, the lowest is the last
        lowest[columns[short]], modes[columns[short]] = trials.voltage[short], trials.mode[short]
    return modes, rounds


def _tried(plan: DesignPlan, part: Group, goal: Targets, columns: Cases, voltage: Floats, horizon: float) -> _Trials:
    """Try voltages (t,) on columns (t,) of a group, up to a horizon in s."""
    criteria, goal = plan.criteria, goal.take(columns)
    lives = part.lives(columns, voltage, horizon=horizon, watched=criteria, ends=criteria, times=[goal.at])
    end = first_of(lives.happened, criteria)
    mode = name_of_first(lives.happened, criteria)
    mode[(mode == NONE) & ~np.isin(lives.status, (Status.COMPLETED, Status.STOPPED))] = UNFINISHED
    lived = ~(end.time < goal.at) & np.isfinite(lives.stretched[0, 0])
    value = np.where(lived, goal.missed(lives.stretched[:, 0]), np.nan)
    # A film that fails while a voltage is applied at once fails likewise under every higher voltage; its state beyond that failure
    # is not a state that the film would reach.
    failed_at = np.abs(end.field) * part.thickness[columns]
    halfway = (end.time == 0) & (failed_at < voltage * (1 - ROUNDING))
    voltage = np.where(halfway, failed_at, voltage)
    ended = goal.missed(lives.relative_stretch(end))
    passed = (halfway | (end.time > 0)) & (ended >= 0)
    return _Trials(voltage, value, ended, np.where(lived, ENDED, np.where(passed, PASSED, SHORT)), end.time, mode)


def voltage_about(group: Group, goal: Targets) -> tuple[Floats, Flags]:
    """Estimates of the voltage (films,) in V that takes the films of a group to their goals, and whether (films,) a goal is beyond
    the limit of the equilibrium spring.

    Quasi-elastic approximation: springs have the modulus that they retain at the time of the goal, and their viscous stretches are
    those after the prestretch. The estimate is the largest voltage that equilibrium needs on the way. A passive part is neglected.
    """
    film = group.film
    points, present = film.points, film.log_squared_stretch
    internal = film.internal if film.assembly is None else 2 * np.log(film.internal[:, :, 0])
    held = points.retained(goal.at, lambda: points.law.stress(points.springs(internal, present)))
    steps = goal.steps(group.watched.controls)
    squared_field = np.zeros(steps.shape[1])
    with np.errstate(all="ignore"):
        before = _carried(group, held, internal, present)
        for part in WAY:
            stretch_on_way = steps**part
            moved = present + 2 * np.log(stretch_on_way)
            needed = np.max(np.where(steps > 1, _carried(group, held, internal, moved) - before * stretch_on_way, -np.inf), axis=0)
            # where this estimate fails, use the field whose Maxwell stress is of the order of the moduli
            needed = np.where(np.isfinite(needed) & (needed > 0), needed, held.sum(axis=0) * goal.size * part)
            squared_field = np.maximum(squared_field, np.exp(-moved.sum(axis=0)) * needed / points.permittivity_at(moved))
        squared = np.repeat(np.exp(moved)[:, None], points.modulus.shape[0], axis=1)
        return np.asarray(group.thickness * np.sqrt(squared_field)), np.asarray(points.law.margin(squared)[0] <= 0)


def _carried(group: Group, held: Floats, internal: Floats, log_squared_stretch: Floats) -> Floats:
    """True stresses (2, films) in Pa of springs with moduli `held` (springs, films), at Lambda (2, films)."""
    points = group.film.points
    stress = points.law.stress(points.springs(internal, log_squared_stretch))
    carried: Floats = np.einsum("nm,cnm->cm", held, stress)
    return carried
