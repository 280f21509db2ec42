"""Designs: for many films, the voltage that takes a film to a goal at a given time, and its life under that voltage."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.io.result import Result, TabularResult
from dielast.io.table import Column, Table
from dielast.material.intervals import DrawIntervals, fewest_draws, interval
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.numerics.arrays import Cases, Floats, Texts
from dielast.numerics.edged_roots import EDGE, FAR, FOUND, LOW, OPEN
from dielast.simulate.design_plan import UNFINISHED, Designed, DesignPlan, Goal, Targets, solve_draws, solve_films
from dielast.simulate.film_grid import lay_out
from dielast.simulate.film_setup import Film
from dielast.simulate.options import Failure, Solver

YES, FAILS_FIRST, OUT_OF_REACH = "yes", "no: fails first", "no: out of reach"
CREEPS, LIMITED = "creeps to the goal without a voltage", "beyond the limit of its springs"
Bounds = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DesignBounds(Result):
    """Results of the draws of films, arrays (films,), NaN where the design has no voltage.

    `voltage` are bounds of the voltage that reaches the goal, and `time_to_failure` those of the time to failure in s under the
    voltage of the design; an upper bound is infinite where no voltage reaches the goal, or the failure is beyond the horizon.
    `failure_probability` is the fraction of draws that fail within the horizon, and `safe_life` in s the life that a fraction
    `failure_probability` (as requested) does not reach.
    """

    voltage: Bounds
    time_to_failure: Bounds
    failure_probability: Floats
    safe_life: Floats
    assured_life: Floats | None = None
    """The life (films,) in s that the draws exceed with the required confidence, if they are those of the film before which a
    required share fails.
    """

    def take(self, films: Cases) -> Self:
        """The results of the selected films (k,)."""
        voltage, time = ((low[films], high[films]) for low, high in (self.voltage, self.time_to_failure))
        assured_life = None if self.assured_life is None else self.assured_life[films]
        return type(self)(voltage, time, self.failure_probability[films], self.safe_life[films], assured_life)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Design(TabularResult):
    """Films (films,), sorted: for each goal first those that reach it, and of these first the one with the longest life.

    Of each film: `temperature` in degC, `prestretch` (films, 2), `thickness` in m, and `electrode_share` if it has a passive part.
    `target` is the relative stretch or the area strain (as `goal` says) to reach `at` a time in s after a constant voltage is
    applied.

    `reached` says whether a voltage reaches the goal:

    - "yes": `voltage` in V does, and the film then fails at `time_to_failure` in s, NaN if not within the `horizon`;
    - "no: fails first": under every voltage that would reach the goal, the film fails earlier, by `failure_mode`;
    - "no: out of reach": no voltage reaches it, or the film creeps to the goal without a voltage;
    - "unfinished": the numerics gave up.

    `because` is the reason where it is not reached. `largest` is the relative stretch or area strain at the given time, or the
    largest that any voltage reaches if the goal is not reached. `rounds` is the number of rounds of the search, `drawn` the results
    of the draws, None without draws.
    """

    temperature: Floats
    prestretch: Floats
    thickness: Floats
    electrode_share: Floats | None
    goal: str
    target: Floats
    at: float
    horizon: float
    voltage: Floats
    time_to_failure: Floats
    failure_mode: Texts
    reached: Texts
    because: Texts
    largest: Floats
    rounds: int
    drawn: DesignBounds | None = None

    def columns(self) -> Table:
        """The table, one row per film."""
        varied = {
            "electrode_share": ("1", self.electrode_share),
            "thickness": ("m", self.thickness if np.ptp(self.thickness) > 0 else None),
            self.goal: ("1", self.target if np.ptp(self.target) > 0 else None),
        }
        drawn = self.drawn
        return [
            Column("temperature", "degC", self.temperature),
            *(Column(f"prestretch_{axis + 1}", "1", self.prestretch[:, axis]) for axis in (0, 1)),
            *(Column(name, unit, values) for name, (unit, values) in varied.items() if values is not None),
            *_with_bounds("voltage", "V", self.voltage, None if drawn is None else drawn.voltage),
            *_with_bounds("time_to_failure", "s", self.time_to_failure, None if drawn is None else drawn.time_to_failure),
            Column("failure_mode", None, self.failure_mode.tolist()),
            Column("reached", None, self.reached.tolist()),
            *([] if drawn is None else [Column("failure_probability", "1", drawn.failure_probability)]),
            *([] if drawn is None else [Column("safe_life", "s", drawn.safe_life)]),
            *([] if drawn is None or drawn.assured_life is None else [Column("assured_life", "s", drawn.assured_life)]),
        ]

    @property
    def out_of_reach(self) -> dict[str, int]:
        """The number of films whose goal is out of reach, by reason."""
        reasons = self.because[self.reached == OUT_OF_REACH].tolist()
        return {reason: reasons.count(reason) for reason in sorted(set(reasons))}

    @property
    def life(self) -> Floats:
        """The life (films,) in s by which films are compared: the assured or the safe life, or the time to failure without draws.

        It is infinite beyond the horizon, and NaN where the goal is not reached.
        """
        drawn = self.drawn
        life = self.time_to_failure if drawn is None else drawn.safe_life if drawn.assured_life is None else drawn.assured_life
        endless = (self.reached == YES) & (np.isnan(life) if self.drawn is None else np.isposinf(life))
        return np.where(endless, np.inf, np.where(self.reached == YES, life, np.nan))


def _with_bounds(name: str, unit: str, values: Floats, bounds: Bounds | None) -> Table:
    """A column, followed by the columns of its bounds."""
    sides = zip(("lower", "upper"), bounds or (), strict=False)
    return [Column(name, unit, values), *(Column(f"{name}_{side}", unit, bound) for side, bound in sides)]


def design(
    material: Material,
    film: Film,
    goal: Goal,
    *,
    failure: Failure = Failure(),
    solver: Solver = Solver(),
    sample: Sample | None = None,
    level: float = 0.9,
) -> Design:
    """For each film, the voltage that takes it to a `goal` at a given time, and the life of the film under that voltage.

    Every combination of prestretch (n,) or (n, 2), electrode share, thickness and temperature of the `film` and of the targets of
    the goal is a film. Loss of tension of a passive part ends a film.

    With a `sample` of materials, its draws give bounds at the confidence `level`, and the life that the goal's probability of
    failure of films does not reach. Raises `InputError` for invalid arguments.
    """
    plan = plan_design(material, film, goal, failure=failure, solver=solver, sample=sample).relaxed()
    check_draws(plan.grid.draws, level, goal.failure_probability)
    solved = [solve_films(plan, *chunk) for chunk in plan.chunks()]
    plan = under_way(plan, solved)
    drawn = [solve_draws(plan, *chunk) for chunk in plan.chunks(drawn=True)]
    return designed(plan, solved, drawn, DrawIntervals(level, None if sample is None else sample.laws), goal.failure_probability)


def check_draws(draws: int, level: float, failure_probability: float) -> None:
    """`InputError` for a level or a probability that is out of range, or needs more draws than `draws`."""
    if not 0 < failure_probability < 0.5:
        text = f"{failure_probability:g}: a share above 0 and below 0.5 is needed, such as 0.05"
        raise InputError(text, argument="failure_probability")
    for name, probability in (("level", level), ("failure_probability", 1 - 2 * failure_probability)):
        if 0 < draws < (fewest := fewest_draws(probability)):
            raise InputError(f"{draws} draws are too few for this {name}: at least {fewest} are needed", argument=name)


def plan_design(
    material: Material,
    film: Film,
    goal: Goal,
    *,
    failure: Failure = Failure(),
    solver: Solver = Solver(),
    sample: Sample | None = None,
) -> DesignPlan:
    """Check the arguments of `design`, and lay out its films and those of all draws of a `sample`; `DesignPlan.relaxed`
    prestretches and relaxes them. Raises `InputError` as `design` does.
    """
    targets, horizon = Targets.of(goal), goal.horizon
    if not (np.isfinite(horizon) and horizon > 0):
        raise InputError(f"{horizon:g} s: it must be positive", argument="horizon")
    if goal.at > horizon:
        raise InputError(f"{goal.at:g} s is longer than the horizon of {horizon:g} s", argument="at")
    targets.steps(film.controls)
    grid = lay_out(material, film, failure=failure, solver=solver, sample=sample, copies=targets.target.size)
    return DesignPlan(grid, targets.take(np.arange(grid.temperature.size) % targets.target.size), horizon)


def under_way(plan: DesignPlan, solved: Sequence[Designed]) -> DesignPlan:
    """The plan with the voltages of its films, all of which are `solved`, so that the draws can be solved next."""
    voltage, slope = np.full((2, plan.films), np.nan)
    for part in solved:
        found = part.state == FOUND
        voltage[part.films[found]], slope[part.films[found]] = part.voltage[found], part.slope[found]
    return replace(plan, voltage=voltage, slope=slope)


def designed(
    plan: DesignPlan,
    solved: Sequence[Designed],
    drawn: Sequence[Designed],
    intervals: DrawIntervals,
    failure_probability: float,
) -> Design:
    """The design from the solved films, in any order, and from their draws; if lives are assured, each draw is the film before
    which a required share fails.
    """
    place = np.argsort(np.concatenate([part.films for part in solved]))

    def whole(name: str) -> NDArray[Any]:
        return np.asarray(np.concatenate([getattr(part, name) for part in solved])[place])

    state, goal = whole("state"), plan.goal
    reached = np.select([state == FOUND, state == EDGE, state == OPEN], [YES, FAILS_FIRST, UNFINISHED], OUT_OF_REACH)
    mode = whole("mode").astype(str)
    because = np.select([state == FOUND, state == LOW, state == FAR], ["", CREEPS, LIMITED], mode)
    result = Design(
        plan.grid.temperature,
        plan.grid.prestretch,
        plan.grid.thickness,
        plan.grid.electrode_share,
        goal.name,
        goal.target,
        goal.at,
        plan.horizon,
        plan.voltage,
        whole("time"),
        mode,
        reached,
        because,
        goal.reached(whole("missed")),
        max(part.rounds for part in solved),
        _bounds(plan, drawn, intervals, failure_probability) if plan.grid.draws else None,
    )
    return _best_first(result)


def _bounds(plan: DesignPlan, drawn: Sequence[Designed], intervals: DrawIntervals, failure_probability: float) -> DesignBounds:
    """The results of the draws of all films."""
    voltage, time = np.full((2, plan.grid.draws * plan.films), np.nan)
    for part in drawn:
        films = part.films - plan.films
        voltage[films] = part.voltage
        time[films] = np.where(part.mode == UNFINISHED, np.nan, np.where(np.isnan(part.time), np.inf, part.time))
    voltage, time = (values.reshape(plan.grid.draws, plan.films) for values in (voltage, time))
    finished = ~np.isnan(time)
    share = np.sum(np.isfinite(time), axis=0) / np.maximum(finished.sum(axis=0), 1)
    safe = interval(time, 1 - 2 * failure_probability, intervals.laws)[0]
    share = np.where(finished.any(axis=0), share, np.nan)
    return DesignBounds(intervals.of(voltage), intervals.of(time), share, safe, intervals.assured(time))


def _best_first(result: Design) -> Design:
    """Sort the films of each goal: first those that reach it, by decreasing life; then the others, by how close they come."""
    yes = result.reached == YES
    probability = np.zeros(yes.size) if result.drawn is None else result.drawn.failure_probability
    # films of equal life are sorted by failure probability, and then by voltage
    keys = [result.voltage, probability, np.where(yes, -result.life, -result.largest), ~yes, result.target]
    order = np.lexsort([np.where(np.isnan(key), np.inf, key) for key in keys])
    values = {entry.name: getattr(result, entry.name) for entry in fields(result)}
    ordered: dict[str, Any] = {name: value[order] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(result, **ordered, drawn=None if result.drawn is None else result.drawn.take(order))
