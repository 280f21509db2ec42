"""Events of films, located on the dense output of the stepper, and how long the voltage has been on.

An event is the fall to zero of the signal of a criterion, which is positive at first. `Watch` evaluates every signal in the middle
and at the end of every step, and stores a bracket where a signal falls. All brackets of a piece of load are refined together at the
end of the piece.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dielast.mechanics.brackets import Brackets, Exposure
from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.mechanics.criteria.pull_in import stability_at
from dielast.mechanics.equations import Films, films_of
from dielast.mechanics.span import Load
from dielast.mechanics.stability import Stability
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats, paired, where
from dielast.numerics.roots import CLOSE
from dielast.numerics.stride import DenseSteps, TriedStep

JUST_INSIDE = 0.01  # fraction of a span, from either end, at which the magnitude of the voltage shows whether it rises at that end


@dataclass(slots=True, eq=False)
class VoltageClock:
    """A clock that restarts whenever the magnitude of the voltage begins to rise after a hold or a fall.

    The time scale of pull-in is a share of its time.

    `started` (cases,) is the time of the last restart in s since the voltage programme began; `rising` (cases,) says whether the
    magnitude rises now.
    """

    started: Floats
    rising: Flags

    @classmethod
    def at_rest(cls, cases: int) -> VoltageClock:
        """The clock before the programme."""
        return cls(np.zeros(cases), np.zeros(cases, dtype=bool))

    def age(self, cases: Cases, time: Floats) -> Floats:
        """The time (k,) in s since the last restart, of cases (k,) at times (k,) in s since the programme began."""
        return np.asarray(time - self.started[cases])

    def jump(self, time: Floats, before: Floats, after: Floats) -> None:
        """The nominal field jumps from `before` to `after` at a `time`, all (cases,)."""
        up = np.abs(after) > np.abs(before)
        self.started = np.where(up & ~self.rising, time, self.started)
        self.rising = np.where(after == before, self.rising, up)

    def follow(self, stride: TriedStep, load: Load, start: Floats) -> Cases:
        """Follow a step of a piece that began at `start` (cases,) in s; returns the columns in which the clock restarted."""
        opening, ending = stride.accepted & (stride.time == 0), stride.accepted & (stride.until == stride.duration)
        restarted = np.zeros(0, dtype=np.intp)
        if np.count_nonzero(opening) or np.count_nonzero(ending):
            # within a span the magnitude is monotonic, or rises and then falls
            begin, after_begin, before_end, end = (
                np.abs(load.value(share * stride.duration)[2]) for share in (0.0, JUST_INSIDE, 1 - JUST_INSIDE, 1.0)
            )
            restarted = np.flatnonzero(opening & (after_begin > begin) & ~self.rising[stride.cases])
            self.started[stride.cases[restarted]] = (start[stride.cases] + stride.begin)[restarted]
            self.rising[stride.cases[opening]] = (after_begin > begin)[opening]
            self.rising[stride.cases[ending]] = (end > before_end)[ending]
        return restarted


@dataclass(frozen=True, slots=True, eq=False)
class EventArrays(ByCase):
    """The first event of one criterion: arrays (cases,), NaN for films without that event.

    `time` is in s since the voltage programme began, `field` the nominal field in V/m; Lambda and the mechanical nominal stress in
    Pa are (2, cases); `determinant` is that of pull-in, `exposed` (exposures, cases) are the integrals of exposure; `charge` is the
    nominal charge density in C/m^2, `stored` the energy in J/m^3.
    """

    time: Floats
    field: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    determinant: Floats
    exposed: Floats
    charge: Floats
    stored: Floats

    @classmethod
    def never(cls, cases: int, exposures: int) -> EventArrays:
        """No events yet, in films with this number of `exposures`."""
        return cls(*(np.full((*axes, cases), np.nan) for axes in ((), (), (2,), (2,), (), (exposures,), (), ())))

    @property
    def row(self) -> Floats:
        """A row of output at the event (6 + exposures, cases): Lambda, nominal stress, field, determinant, exposures."""
        single = self.field[None], self.determinant[None]
        return np.concatenate((self.log_squared_stretch, self.nominal_stress, *single, self.exposed))

    def put(self, cases: Cases, part: EventArrays) -> None:
        """Write the events `part` of the cases (k,)."""
        for name in self.__match_args__:
            getattr(self, name)[..., cases] = getattr(part, name)


@dataclass(slots=True, eq=False)
class EventSearch:
    """The state of the search for one criterion.

    `signal` is None if the criterion has a rate or cannot be met, `exposure` is None unless it has a rate. `seen` (cases,) marks
    the cases in which the event has happened, `last` (cases,) is the signal (or the exposure) at the last evaluation, `brackets`
    contain the events of the present piece of load, and `happened` the events that have been located. A signal with `least`
    (cases,) counts in the cases that are `armed` (cases,): once it has been larger than that.
    """

    criterion: Criterion
    signal: Signal | None
    exposure: Exposure | None
    seen: Flags
    last: Floats
    happened: EventArrays
    least: Floats | None
    armed: Flags
    brackets: list[Brackets] = field(default_factory=list)


class Watch:
    """The observer of the stepper that looks for events. `begin` and `finish` are to be called before and after a piece of load.

    A case ends once the events of all criteria named in `until`, or of any criterion named in `ends`, have happened; criteria that
    no film can meet, such as breakdown without a breakdown field, are not waited for.

    A signal that falls below zero and rises again within one step is detected if a parabola through its values at the ends and in
    the middle of the step comes close to zero: reliably for a single dip as wide as the step, not for a much narrower one.
    """

    def __init__(self, films: WatchedFilms, criteria: Iterable[Criterion], until: Sequence[str], ends: Sequence[str] = ()) -> None:
        cases = films.stress_floor.size
        self.films, self.until, self.ends = films, until, ends
        rates = [(criterion, criterion.rate(films)) for criterion in criteria]
        exposures = {criterion: Exposure(rate, cases) for criterion, rate in rates if rate is not None}
        self.exposures = list(exposures.values())
        self.searches = [
            EventSearch(
                criterion,
                criterion.signal(films),
                exposures.get(criterion),
                np.zeros(cases, dtype=bool),
                np.ones(cases),
                EventArrays.never(cases, len(exposures)),
                least := criterion.arming(films),
                np.full(cases, least is None),
            )
            for criterion, _ in rates
        ]
        self.clock = VoltageClock.at_rest(cases)
        self._start = np.zeros(cases)
        self._begun = False
        self.done = self._ended()
        """Mask (cases,) of the cases that have ended."""
        self._twice: tuple[Films, Films] | None = None
        """The films of the last steps, and the same with every column twice."""

    def __getstate__(self) -> dict[str, Any]:
        # without what the criteria make of the films: such functions cannot be pickled
        return {**vars(self), "searches": [replace(search, signal=None) for search in self.searches], "_twice": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for search in self.searches:
            search.signal = search.criterion.signal(self.films)
            if search.exposure is not None and (rate := search.criterion.rate(self.films)) is not None:
                search.exposure.rate = rate

    @property
    def happened(self) -> dict[Criterion, EventArrays]:
        """The events so far, by criterion."""
        return {search.criterion: search.happened for search in self.searches}

    def _ended(self) -> Flags:
        """Mask (cases,) of the cases that have ended."""
        possible = [search for search in self.searches if search.signal is not None or search.exposure is not None]
        awaited = [name for name in self.until if any(search.criterion.name == name for search in possible)]
        ended = [search.seen for search in possible if search.criterion.name in self.ends]
        if awaited:
            ways = [[search.seen for search in possible if search.criterion.name == name] for name in awaited]
            ended.append(np.all([np.any(seen, axis=0) for seen in ways], axis=0))
        return np.any(ended, axis=0) if ended else np.zeros(self._start.shape, dtype=bool)

    def begin(self, system: Films, state: Floats, start: Floats, jumped: Flags, changed: bool = False) -> None:
        """Begin a piece of load at `start` (cases,) in s since the programme began, with this state.

        Signals that are not positive are events at this time, in films that `jumped` (cases,) at the beginning of the piece, and in
        all films at the beginning of the first piece. `changed` says that the load prescribes other quantities from here on.
        """
        self._start = start
        starting = jumped if self._begun else np.ones_like(jumped)
        self._begun = True
        if not starting.any():
            return
        every = np.arange(start.size)
        snapshot = FilmSnapshot.of(system, every, self.clock.age(every, start), np.zeros_like(start), state)
        for search in self.searches:
            if search.signal is None:
                continue
            value = search.signal(snapshot)
            below = ~(value > 0) if search.least is None else value <= 0  # NaN where the event cannot happen in this load
            fallen = where(starting & search.armed & ~search.seen & below)
            self.note(search, start[fallen], snapshot.take(fallen))
            search.last = np.where(starting, value, search.last)
            if search.least is not None:
                search.armed = (search.armed & (not changed)) | (starting & (value > search.least))

    def __call__(self, stride: TriedStep) -> Flags | None:
        """Store the brackets of signals that fall within the step; returns the mask (pool,) of columns whose case ends with it."""
        system, cases = films_of(stride), stride.cases
        restarted = self.clock.follow(stride, system.load, self._start)
        for exposure in self.exposures:
            exposure.follow(stride, system)
        opening = within = None
        pool, fallen_anywhere = cases.size, False
        for search in self.searches:
            if (search.signal is None and search.exposure is None) or not search.criterion.possible(system.load.controls):
                continue
            watched = stride.accepted & ~search.seen[cases]
            if not np.count_nonzero(watched):
                continue
            if search.exposure is not None:
                last, value = search.exposure.before, search.exposure.after
                fallen = watched & ~(value < 1)
            else:
                assert search.signal is not None
                within = within or self._halfway_and_after(stride)
                signals = search.signal(within)
                half, value = signals[:pool], signals[pool:]
                if restarted.size:  # signals depend on the clock, and jump where it restarts
                    opening = opening or self._moment(stride, stride.time, stride.before)
                    search.last[cases[restarted]] = search.signal(opening)[restarted]
                if search.least is not None and np.count_nonzero(waking := watched & ~search.armed[cases]):
                    search.armed[cases[waking]] = (value > search.least[cases])[waking]
                    search.last[cases[waking]] = value[waking]
                    watched = watched & ~waking
                last = search.last[cases]
                # a parabola whose minimum lies within the step falls at most by a quarter of its whole change below its middle
                if np.min(np.minimum(value, half - 0.25 * np.abs(value - last))) > CLOSE:
                    search.last[cases[watched]] = value[watched]
                    continue
                fallen = watched & ~((half > 0) & (value > 0))
                # the minimum of the parabola, where it lies within the step
                curvature = last - 2 * half + value
                bottom = half - np.square(value - last) / (8 * np.where(curvature > 0, curvature, np.inf))
                dipping = watched & ~fallen & (bottom < CLOSE) & (np.abs(value - last) < 2 * curvature)
                if np.count_nonzero(dipping):
                    brackets = self._brackets(stride, dips := where(dipping), last, value)
                    sampled = brackets.sampled(search.signal, system.take(dips), search.criterion.needs_springs)
                    fallen[dips] = np.any(sampled <= 0, axis=0)
            if np.count_nonzero(fallen):
                search.brackets.append(self._brackets(stride, where(fallen), last, value))
                search.seen[cases[fallen]] = fallen_anywhere = True
            search.last[cases[watched]] = value[watched]
        if fallen_anywhere:
            self.done = self._ended()
        done = self.done[cases]
        return done if np.count_nonzero(done) else None

    def finish(self, equations: Callable[[Cases, Load], Films]) -> None:
        """End a piece of load: locate its events. `equations` returns the films of given cases under a load."""
        with np.errstate(all="ignore"):  # between two steps a spring may seem beyond its limit: such values are not finite
            for search in self.searches:
                if search.brackets:
                    self._locate(search, equations)

    def _locate(self, search: EventSearch, equations: Callable[[Cases, Load], Films]) -> None:
        """Locate the events of a criterion in its brackets."""
        brackets = Brackets.joined(search.brackets)
        system = equations(brackets.steps.cases, brackets.load)
        criterion = search.criterion
        if search.exposure is not None:
            time, snapshot = search.exposure.reached(brackets, system)
        else:
            assert search.signal is not None
            time, snapshot = brackets.first_fall(search.signal, system, criterion.needs_springs)
        time, snapshot = criterion.refined(self.films, time, snapshot, brackets.load)
        parts = zip(self.exposures, brackets.exposed, strict=True)
        exposed = [exposure.at(brackets, before, time, system) for exposure, before in parts]
        self.note(search, brackets.begin + time, snapshot, exposed)
        search.brackets = []

    def note(self, search: EventSearch, time: Floats, snapshot: FilmSnapshot, exposed: Sequence[Floats] | None = None) -> None:
        """Store events at `time` (k,) in s since the programme began, of the films in a `snapshot`.

        `exposed` are the exposures (k,) at that time, by default those at the end of the last step.
        """
        if not snapshot.cases.size:
            return
        search.seen[snapshot.cases] = True
        self.done = self._ended()
        determinant = search.criterion.determinant(self.stability(snapshot))
        membrane = snapshot.log_squared_stretch, snapshot.nominal_stress
        added = self.exposed(snapshot.cases) if exposed is None else np.reshape(exposed, (len(self.exposures), time.size))
        field, charge = snapshot.points.nominal(snapshot.log_squared_stretch, snapshot.electrical)
        stored = np.full_like(time, np.nan)
        if snapshot.surroundings is None:
            stored = snapshot.points.stored(snapshot.internal, snapshot.log_squared_stretch, snapshot.electrical)
        search.happened.put(snapshot.cases, EventArrays(time, field, *membrane, determinant, added, charge, stored))

    def exposed(self, cases: Cases) -> Floats:
        """The exposures (exposures, k) at the end of the last step."""
        return np.reshape([exposure.total[cases] for exposure in self.exposures], (len(self.exposures), cases.size))

    def exposed_along(self, stride: TriedStep, columns: Cases, fraction: Floats) -> Floats:
        """The exposures (exposures, k) at fractions (k,) of the last step."""
        parts = [exposure.along(stride, films_of(stride), columns, fraction) for exposure in self.exposures]
        return np.reshape(parts, (len(self.exposures), columns.size))

    def stability(self, snapshot: FilmSnapshot) -> Stability:
        """Determinant and margin (k,) of films; where edges move, the margin stands for both, as determinants of
        different axes cannot be compared.
        """
        found = stability_at(snapshot, self.films.timescale)
        return replace(found, determinant=found.margin) if self.films.moved else found

    def age(self, cases: Cases, begin: Floats, time: Floats) -> Floats:
        """How long (k,) in s the voltage has been on, at `time` (k,) in s since a span began.

        The span began `begin` (k,) in s after the piece of load.
        """
        return self.clock.age(cases, self._start[cases] + begin + time)

    def _moment(self, stride: TriedStep, time: Floats, state: Floats) -> FilmSnapshot:
        return FilmSnapshot.of(films_of(stride), stride.cases, self.age(stride.cases, stride.begin, time), time, state)

    def _halfway_and_after(self, stride: TriedStep) -> FilmSnapshot:
        """The films (2 pool,) in the middle of a step, and then those at its end: one evaluation takes half as long as two."""
        system, cases = films_of(stride), np.concatenate((stride.cases, stride.cases))
        if self._twice is None or self._twice[0] is not system:
            self._twice = system, system.take(np.tile(np.arange(stride.cases.size), 2))
        time = np.concatenate((stride.time + 0.5 * stride.step, stride.until))
        age = self.age(cases, np.concatenate((stride.begin, stride.begin)), time)
        return FilmSnapshot.of(self._twice[1], cases, age, time, np.concatenate((stride.halfway(), stride.after), axis=1))

    def _brackets(self, stride: TriedStep, columns: Cases, last: Floats, value: Floats) -> Brackets:
        """Brackets for some columns (k,) of the step, over which the signal (pool,) goes from `last` to `value`."""
        columns = paired(columns)
        cases = stride.cases[columns]
        return Brackets(
            DenseSteps.of(stride, slice(None), columns),
            films_of(stride).load.take(columns),
            self._start[cases] + stride.begin[columns],
            self.clock.started[cases],
            last[columns],
            value[columns],
            np.reshape([exposure.before[columns] for exposure in self.exposures], (len(self.exposures), columns.size)),
        )
