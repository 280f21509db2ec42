"""Events of films on their way, located on the stepper's dense output.

An event happens where the signal of a criterion, positive at first, falls to zero. `Watch` evaluates every signal at the end and in
the middle of every step, and keeps the bracket of each fall; the brackets are narrowed down together, once a piece of load is
through.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from dielast.mechanics.brackets import Brackets
from dielast.mechanics.clock import VoltageClock
from dielast.mechanics.criteria.criterion import Criterion, Moment, Signal, WatchedFilms
from dielast.mechanics.criteria.pull_in import stability_at
from dielast.mechanics.event_arrays import EventArrays
from dielast.mechanics.exposure import Exposure
from dielast.mechanics.span import Load
from dielast.mechanics.stability import Stability
from dielast.mechanics.symmetric import Films
from dielast.numerics.columns import Cases, Flags, Floats, paired, where
from dielast.numerics.roots import CLOSE
from dielast.numerics.stride import DenseSteps, Stride


@dataclass(slots=True, eq=False)
class Lookout:
    """One criterion on the watch: its `signal`, which was `last` (cases,) when it was looked at, or its `exposure`; neither where
    it cannot happen. Whether it was `seen` (cases,) to happen; the `brackets` within which it did; and what `happened`.
    """

    criterion: Criterion
    signal: Signal | None
    seen: Flags
    last: Floats
    happened: EventArrays
    exposure: Exposure | None = None
    brackets: list[Brackets] = field(default_factory=list)

    @classmethod
    def of(cls, criterion: Criterion, films: WatchedFilms) -> Lookout:
        """Of a criterion of which nothing has been seen yet."""
        cases = films.breakdown_field.size
        signal, rate = criterion.signal(films), criterion.rate(films)
        exposure = None if rate is None else Exposure(rate, cases)
        return cls(criterion, signal, np.zeros(cases, dtype=bool), np.ones(cases), EventArrays.never(cases, 0), exposure)


class Watch:
    """Observes the stepper. A case ends once everything in `until` has happened, names of criteria, or anything in `ends`. Between
    pieces of load, `begin` and `finish` are called.

    A signal that falls and rises again within one step is found if a parabola through its values at the ends and in the middle of
    the step comes near zero; that is so for one dip as wide as the step, and need not be for one much narrower.
    """

    def __init__(self, films: WatchedFilms, criteria: Iterable[Criterion], until: Sequence[str], ends: Sequence[str] = ()) -> None:
        cases = films.breakdown_field.size
        self.films, self.until, self.ends = films, until, ends
        self.lookouts = [Lookout.of(criterion, films) for criterion in criteria]
        self.exposures = {one.criterion.name: one.exposure for one in self.lookouts if one.exposure is not None}
        for lookout in self.lookouts:
            lookout.happened = EventArrays.never(cases, len(self.exposures))
        self.clock = VoltageClock.at_rest(cases)
        self._start = np.zeros(cases)
        self._begun = False

    @property
    def happened(self) -> dict[Criterion, EventArrays]:
        """What happened, by criterion."""
        return {lookout.criterion: lookout.happened for lookout in self.lookouts}

    @property
    def done(self) -> Flags:
        """Cases (cases,) that need not go on."""
        none = np.zeros(self._start.shape, dtype=bool)
        seen = [[lookout.seen for lookout in self.lookouts if lookout.criterion.name == name] for name in self.until]
        done = np.all([np.any(ways, axis=0) for ways in seen], axis=0) if seen else none
        return np.asarray(
            np.logical_or.reduce([done, *(lookout.seen for lookout in self.lookouts if lookout.criterion.name in self.ends)])
        )

    def begin(self, system: Films, state: Floats, start: Floats, jumped: Flags) -> None:
        """A piece of load begins at `start` (cases,) in s since the programme began with this state: what has already fallen
        happens now, to films that `jumped` (cases,) to it rather than going on smoothly from the piece before, and to all at the
        very beginning.
        """
        self._start = start
        anew = jumped if self._begun else np.ones_like(jumped)
        self._begun = True
        if not anew.any():
            return
        every = np.arange(start.size)
        moment = Moment.of(system, every, self.clock.age(every, start), np.zeros_like(start), state)
        for lookout in self.lookouts:
            if lookout.signal is None:
                continue
            value = lookout.signal(moment)
            fallen = where(anew & ~lookout.seen & ~(value > 0))
            self.note(lookout, start[fallen], moment.take(fallen))
            lookout.last = np.where(anew, value, lookout.last)

    def __call__(self, stride: Stride) -> Flags | None:
        """Note what falls within the step; columns whose case ends with it."""
        system, cases = _films(stride), stride.cases
        restarted = self.clock.follow(stride, system.load, self._start)
        exposed = {name: exposure.follow(stride, system) for name, exposure in self.exposures.items()}
        opening = halfway = ending = None
        for lookout in self.lookouts:
            wanted = stride.accepted & ~lookout.seen[cases]
            if lookout.signal is None or not wanted.any():
                continue
            if halfway is None:
                halfway = self._moment(stride, stride.time + 0.5 * stride.step, stride.halfway())
                ending = self._moment(stride, stride.until, stride.after)
            assert ending is not None
            if restarted.size:  # by which a signal may have jumped
                opening = opening or self._moment(stride, stride.time, stride.before)
                lookout.last[cases[restarted]] = lookout.signal(opening)[restarted]
            last, half, value = lookout.last[cases], lookout.signal(halfway), lookout.signal(ending)
            fallen = wanted & ~((half > 0) & (value > 0))
            # the bottom of the parabola, where it lies within the step
            curvature = last - 2 * half + value
            bottom = half - np.square(value - last) / (8 * np.where(curvature > 0, curvature, np.inf))
            dips = where(wanted & ~fallen & (bottom < CLOSE) & (np.abs(value - last) < 2 * curvature))
            if dips.size:
                brackets = self._brackets(stride, dips, last, value)
                sampled = brackets.sampled(lookout.signal, system.take(dips), lookout.criterion.needs_springs)[0]
                fallen[dips] = np.any(sampled <= 0, axis=0)
            if fallen.any():
                lookout.brackets.append(self._brackets(stride, where(fallen), last, value))
                lookout.seen[cases[fallen]] = True
            lookout.last[cases[wanted]] = value[wanted]
        for lookout in self.lookouts:
            wanted = stride.accepted & ~lookout.seen[cases]
            if lookout.exposure is not None and wanted.any():
                last, value = exposed[lookout.criterion.name]
                fallen = wanted & ~(value < 1)
                if fallen.any():
                    lookout.brackets.append(self._brackets(stride, where(fallen), last, value))
                    lookout.seen[cases[fallen]] = True
        done = self.done[cases]
        return done if done.any() else None

    def finish(self, equations: Callable[[Cases, Load], Films]) -> None:
        """A piece of load is through: find the times of what happened in it; `equations` are those of some cases under load."""
        for lookout in self.lookouts:
            if not lookout.brackets:
                continue
            brackets = Brackets.joined(lookout.brackets)
            system = equations(brackets.steps.cases, brackets.load)
            criterion = lookout.criterion
            if lookout.exposure is not None:
                time, moment = lookout.exposure.reached(brackets, system)
            else:
                assert lookout.signal is not None
                time, moment = brackets.first_fall(lookout.signal, system, criterion.needs_springs)
            time, moment = criterion.refined(self.films, time, moment, brackets.load)
            parts = zip(self.exposures.values(), brackets.exposed, strict=True)
            self.note(
                lookout, brackets.begin + time, moment, [exposure.at(brackets, before, time, system) for exposure, before in parts]
            )
            lookout.brackets = []

    def note(self, lookout: Lookout, time: Floats, moment: Moment, exposed: Sequence[Floats] | None = None) -> None:
        """Note that it happened at these times (k,) in s since the programme began, to the films of a moment.

        What adds up over time was then `exposed` (k,) each, by default what it is between two steps.
        """
        if not moment.cases.size:
            return
        lookout.seen[moment.cases] = True
        determinant = lookout.criterion.determinant(self.stability(moment))
        membrane = moment.log_squared_stretch, moment.nominal_stress
        added = self.exposed(moment.cases) if exposed is None else np.reshape(exposed, (len(self.exposures), time.size))
        lookout.happened.put(moment.cases, EventArrays(time, moment.field, *membrane, determinant, added))

    def exposed(self, cases: Cases) -> Floats:
        """What has added up over time so far (exposures, k)."""
        return np.reshape([exposure.total[cases] for exposure in self.exposures.values()], (len(self.exposures), cases.size))

    def exposed_along(self, stride: Stride, columns: Cases, fraction: Floats) -> Floats:
        """What has added up (exposures, k) at fractions (k,) of a step that was observed last."""
        parts = [exposure.along(stride, _films(stride), columns, fraction) for exposure in self.exposures.values()]
        return np.reshape(parts, (len(self.exposures), columns.size))

    def stability(self, moment: Moment) -> Stability:
        """How stable films are."""
        return stability_at(moment, self.films.timescale)

    def moment(self, system: Films, cases: Cases, begin: Floats, time: Floats, state: Floats) -> Moment:
        """Films with this `state`, at a `time` (k,) since a span began, which was `begin` (k,) s after the piece did."""
        return Moment.of(system, cases, self.clock.age(cases, self._start[cases] + begin + time), time, state)

    def _moment(self, stride: Stride, time: Floats, state: Floats) -> Moment:
        return self.moment(_films(stride), stride.cases, stride.begin, time, state)

    def _brackets(self, stride: Stride, columns: Cases, last: Floats, value: Floats) -> Brackets:
        """The step of some columns, over which the signal (pool,) goes from `last` to `value`."""
        columns = paired(columns)
        cases = stride.cases[columns]
        return Brackets(
            DenseSteps.of(stride, slice(None), columns),
            _films(stride).load.take(columns),
            self._start[cases] + stride.begin[columns],
            self.clock.started[cases],
            last[columns],
            value[columns],
            np.reshape([exposure.before[columns] for exposure in self.exposures.values()], (len(self.exposures), columns.size)),
        )


def _films(stride: Stride) -> Films:
    """The system of a stride."""
    assert isinstance(stride.system, Films)
    return stride.system
