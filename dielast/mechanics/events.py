"""Where a film fails on its way: events located on the stepper's dense output.

An event happens where its signal, positive at first, falls to zero: breakdown where 1 - |E|/E_EB does, pull-in where the stability
margin does, loss of tension where the mechanical stress of a held axis does. `Watch` evaluates every signal at the end and in the
middle of every step, and keeps the bracket of each fall; the brackets are narrowed down together, once a piece of load is through.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from dielast.material.springs import Cases, Floats
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control, Controls, Load
from dielast.mechanics.stability import Fold, Stability, TimeScale, stability
from dielast.mechanics.symmetric import Films, SymmetricPoints
from dielast.numerics.integrate import Segment, Stride
from dielast.numerics.roots import CLOSE, Signal, fall, samples

VANISHING = 1e-3  # margin that is none at a pull-in, where it is zero by definition
FOLD = 0.02  # margin of the film with all branches frozen, below which it is at the end of an equilibrium


class Kind(IntEnum):
    """What can happen to a film."""

    BREAKDOWN = 0
    PULL_IN = 1
    LOSS_OF_TENSION_1 = 2
    LOSS_OF_TENSION_2 = 3


@dataclass(frozen=True, slots=True, eq=False)
class Happened:
    """When each kind of event first happened and how the film was then: arrays (kinds, cases), NaN where it did not happen.

    `time` in s since the voltage programme began, `field` the nominal field in V/m; `log_squared_stretch` and `nominal_stress` are
    (2, kinds, cases), `determinant` is that of the tangent.
    """

    time: Floats
    field: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    determinant: Floats

    @classmethod
    def nothing(cls, cases: int) -> Happened:
        """No event yet."""
        return cls(*(np.full((*both, len(Kind), cases), np.nan) for both in ((), (), (2,), (2,), ())))

    def state(self, kind: Kind) -> Floats:
        """Lambda and nominal stress of both axes, the nominal field, and the determinant (6, cases) when it happened."""
        own = self.log_squared_stretch[:, kind], self.nominal_stress[:, kind]
        return np.concatenate((*own, self.field[kind, None], self.determinant[kind, None]))

    def put(self, cases: Cases, part: Happened) -> None:
        """Write what happened to some of the cases."""
        for each in fields(self):
            getattr(self, each.name)[..., cases] = getattr(part, each.name)


@dataclass(frozen=True, slots=True, eq=False)
class Bracket:
    """Steps in which a signal falls to zero: from `last` at their start to `value` at their end, all (k,). The span of `load` began
    `begin` s after the programme, and the clock of the pull-in time scale at `clock`.
    """

    segment: Segment
    load: Load
    begin: Floats
    clock: Floats
    last: Floats
    value: Floats

    @classmethod
    def joined(cls, brackets: list[Bracket]) -> Bracket:
        """All of them as one; a lone one is there twice, as numbers in a lone column round differently."""
        brackets = brackets * 2 if sum(each.last.size for each in brackets) == 1 else brackets
        numbers = (np.concatenate([getattr(each, name) for each in brackets]) for name in ("begin", "clock", "last", "value"))
        return cls(Segment.joined([each.segment for each in brackets]), Load.joined([each.load for each in brackets]), *numbers)


@dataclass(slots=True, eq=False)
class Watch:
    """Observes the stepper. `breakdown_field` (cases,) in V/m, infinite where breakdown is of no interest; a case ends once all
    events in `until` have happened. Without `tension`, its loss is not looked for, and determinants are not noted. Between pieces
    of load, `begin` and `finish` are called.

    A signal that falls and rises again within one step is found if a parabola through its values at the ends and in the middle of
    the step comes near zero; that is so for one dip as wide as the step, and need not be for one much narrower.
    """

    controls: Controls
    breakdown_field: Floats
    timescale: TimeScale
    until: tuple[Kind, ...]
    tension: bool = True
    happened: Happened = field(init=False)
    _seen: NDArray[np.bool_] = field(init=False)
    _last: Floats = field(init=False)
    _start: Floats = field(init=False)
    _clock: Floats = field(init=False)
    _rising: NDArray[np.bool_] = field(init=False)
    _kinds: list[Kind] = field(init=False)
    _found: dict[Kind, list[Bracket]] = field(init=False, default_factory=dict)
    _tension: Floats | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        cases = self.breakdown_field.size
        self.happened = Happened.nothing(cases)
        self._seen = np.zeros((len(Kind), cases), dtype=bool)
        self._last = np.ones((len(Kind), cases))
        self._start, self._clock, self._rising = np.zeros(cases), np.zeros(cases), np.zeros(cases, dtype=bool)
        held = [control is Control.STRETCH for control in self.controls]
        self._kinds = [Kind.BREAKDOWN] if np.any(np.isfinite(self.breakdown_field)) else []
        self._kinds += [] if all(held) else [Kind.PULL_IN]
        if self.tension:
            self._kinds += [kind for kind, yes in zip((Kind.LOSS_OF_TENSION_1, Kind.LOSS_OF_TENSION_2), held, strict=True) if yes]

    def begin(self, system: Films, state: Floats, start: Floats, jumped: NDArray[np.bool_]) -> None:
        """A piece of load begins at `start` (cases,) in s since the programme began with this state: what has already fallen
        happens now, to films that `jumped` (cases,) to it rather than going on smoothly from the piece before, and to all at the
        very beginning.
        """
        self._start = start
        every, zero = np.arange(start.size), np.zeros_like(start)
        first = self._tension is None
        if first:
            stress = system.membrane(state, system.load.value(zero))[1]
            # an axis without tension has none to lose
            self._tension = np.where(stress > system.points.stress_floor, stress, -np.inf)
        if not (first or jumped.any()):
            return
        for kind in self._kinds:
            value = self._signal(kind, system, every, zero, zero, state)
            fallen = (jumped | first) & ~self._seen[kind] & ~(value > 0)
            some = np.flatnonzero(fallen)
            self._note(kind, system.take(some), some, zero[some], zero[some], state[:, some])
            self._last[kind] = np.where(jumped | first, value, self._last[kind])

    def jump(self, time: Floats, before: Floats, after: Floats) -> None:
        """The nominal field jumps at `time` (cases,) since the programme began: the clock of the time scale starts anew where its
        size rises after a hold or a fall.
        """
        up = np.abs(after) > np.abs(before)
        self._clock = np.where(up & ~self._rising, time, self._clock)
        self._rising = np.where(after == before, self._rising, up)

    def note(
        self,
        kind: Kind,
        cases: Cases,
        time: Floats,
        age: Floats,
        points: Points,
        internal: Floats,
        log_squared_stretch: Floats,
        nominal_stress: Floats,
        field: Floats,
    ) -> None:
        """Note an event of cases (k,) at times (k,) since the programme began, `age` (k,) since the voltage began to rise. All
        other arrays are for these cases, shape (..., k).
        """
        if not cases.size:
            return
        self._seen[kind, cases] = True
        self.happened.time[kind, cases], self.happened.field[kind, cases] = time, field
        self.happened.log_squared_stretch[:, kind, cases] = log_squared_stretch
        self.happened.nominal_stress[:, kind, cases] = nominal_stress
        if not self.tension:
            return
        pair = np.resize(np.arange(cases.size), max(2, cases.size))  # numbers in a lone column round differently
        state = internal[:, :, pair], log_squared_stretch[:, pair], nominal_stress[:, pair], field[pair]
        held = self.held_modulus(some := points.take(pair), age[pair])
        found = stability(some, held, self.controls, *state)
        vanishing = (kind is Kind.PULL_IN) & (np.abs(found.margin) < VANISHING)
        self.happened.determinant[kind, cases] = np.where(vanishing, 0.0, found.determinant)[: cases.size]

    def seen(self, kind: Kind, cases: Cases) -> NDArray[np.bool_]:
        """To which of the cases an event has happened already."""
        return np.asarray(self._seen[kind, cases])

    def age(self, cases: Cases, time: Floats) -> Floats:
        """How long (k,) the voltage has been on at times (k,) since the programme began, from when its size last began to rise."""
        return np.asarray(time - self._clock[cases])

    @property
    def done(self) -> NDArray[np.bool_]:
        """Cases (cases,) that need not go on."""
        return np.asarray(np.all(self._seen[list(self.until)], axis=0)) if self.until else np.zeros(self._seen.shape[1], dtype=bool)

    def __call__(self, stride: Stride) -> NDArray[np.bool_] | None:
        """Note what falls within the step; columns whose case ends with it."""
        system = stride.system
        assert isinstance(system, Films)
        restarted = self._wind(stride, system.load)
        middle = None
        for kind in self._kinds:
            wanted = stride.accepted & ~self._seen[kind, stride.cases]
            if not wanted.any():
                continue
            if middle is None:
                middle = stride.halfway()
            if restarted.size:
                began = system.take(restarted), stride.cases[restarted], stride.begin[restarted], stride.time[restarted]
                self._last[kind, stride.cases[restarted]] = self._signal(kind, *began, stride.before[:, restarted])
            last = self._last[kind, stride.cases]
            half = self._signal(kind, system, stride.cases, stride.begin, stride.time + 0.5 * stride.step, middle)
            value = self._signal(kind, system, stride.cases, stride.begin, stride.until, stride.after)
            fallen = wanted & ~((half > 0) & (value > 0))
            # the bottom of the parabola, where it lies within the step
            curvature = last - 2 * half + value
            bottom = half - np.square(value - last) / (8 * np.where(curvature > 0, curvature, np.inf))
            dipping = wanted & ~fallen & (bottom < CLOSE) & (np.abs(value - last) < 2 * curvature)
            if dipping.any():
                some = np.flatnonzero(dipping)
                fallen[some] = np.any(samples(self._over(kind, stride, some), last[some], value[some])[0] <= 0, axis=0)
            if fallen.any():
                self._keep(kind, stride, np.flatnonzero(fallen), last[fallen], value[fallen])
            self._last[kind, stride.cases[wanted]] = value[wanted]
        done = self.done[stride.cases]
        return done if done.any() else None

    def _wind(self, stride: Stride, load: Load) -> Cases:
        """Start the clock of the time scale anew where a span begins in which the size of the voltage rises, after a hold or a
        fall; returns these columns.
        """
        opening, ending = stride.accepted & (stride.time == 0), stride.accepted & (stride.until == stride.duration)
        restarted = np.zeros(0, dtype=np.intp)
        if opening.any() or ending.any():
            # within a span the size falls after it rises, or keeps to one of them
            size = [np.abs(load.value(share * stride.duration)[2]) for share in (0.0, 0.01, 0.99, 1.0)]
            restarted = np.flatnonzero(opening & (size[1] > size[0]) & ~self._rising[stride.cases])
            self._clock[stride.cases[restarted]] = (self._start[stride.cases] + stride.begin)[restarted]
            self._rising[stride.cases[opening]] = (size[1] > size[0])[opening]
            self._rising[stride.cases[ending]] = (size[3] > size[2])[ending]
        return restarted

    def finish(self, points: Points, internal: Callable[[Points, Load], Films]) -> None:
        """A piece of load is through: find the times of what happened in it; `internal` makes the equations of points and load."""
        for kind, brackets in self._found.items():
            bracket = Bracket.joined(brackets)
            segment = bracket.segment
            some = internal(points.take(segment.cases), bracket.load)
            rows = self._rows(kind, some)
            asked = replace(segment, coefficients=segment.coefficients[:, rows])

            def signal(
                fraction: Floats, kind: Kind = kind, asked: Segment = asked, some: Films = some, bracket: Bracket = bracket
            ) -> Floats:
                local = asked.time + fraction * asked.step
                age = bracket.begin + local - bracket.clock
                return self._value(kind, some, asked.cases, local, age, asked.state(fraction))

            values, fractions = samples(signal, bracket.last, bracket.value)
            first, every = np.argmax(~(values > 0), axis=0), np.arange(bracket.last.size)
            fraction = fall(signal, fractions[first - 1, every], fractions[first, every])
            local, state = segment.time + fraction * segment.step, segment.state(fraction)
            time = bracket.begin + local
            self._book(kind, some, segment.cases, time, local, time - bracket.clock, state)
            if kind is Kind.PULL_IN:
                self._sharpen(some, bracket, local, state)
        self._found = {}

    def _sharpen(self, system: Films, bracket: Bracket, time: Floats, state: Floats) -> None:
        """Book pull-ins anew that are at the end of an equilibrium, where the damper has taken over; `time` (k,) counts in the
        span.
        """
        points, driven, cases = system.points, system.load.value(time), bracket.segment.cases
        bare = replace(points, modulus=np.concatenate((points.modulus[:-1], np.zeros_like(points.modulus[-1:]))))
        internal, (log_squared, nominal) = system.internal(state), system.membrane(state, driven)
        literal = stability(bare, bare.modulus, self.controls, internal, log_squared, nominal, driven[2]).margin
        ends = np.flatnonzero(literal < FOLD)
        if not ends.size:
            return
        ends = np.resize(ends, max(2, ends.size))
        some, began, clock = system.take(ends), bracket.begin[ends], bracket.clock[ends]
        fold = Fold(
            bare.take(ends),
            self.controls,
            some.load.value,
            lambda at: self.held_modulus(some.points, began + at - clock),
            internal[:, :, ends],
            log_squared[:, ends],
            time[ends],
        )
        moment, internal, log_squared, nominal = fold.find()
        internal[:, -1] = log_squared  # the damper has no part in it
        field = some.load.value(moment)[2]
        at = began + moment
        self.note(Kind.PULL_IN, cases[ends], at, at - clock, some.points, internal, log_squared, nominal, field)

    def stability(self, system: Films, cases: Cases, begin: Floats, time: Floats, state: Floats) -> Stability:
        """Stability of these cases (k,) at times (k,) since a span began, `begin` (k,) since the piece did; `system` and `state`
        are those of the cases.
        """
        return self._stability(system, time, self.age(cases, self._start[cases] + begin + time), state)

    def _stability(self, system: Films, time: Floats, age: Floats, state: Floats) -> Stability:
        # sums round by the order of numbers in memory, which must not depend on how they came here
        state = np.ascontiguousarray(state)
        driven = system.load.value(time)
        modulus = self.held_modulus(system.points, age)
        internal = state[None, :-1] if isinstance(system, SymmetricPoints) else system.internal(state)
        return stability(system.points, modulus, self.controls, internal, *system.membrane(state, driven), driven[2])

    def held_modulus(self, points: Points, age: Floats) -> Floats:
        """Modulus (n, k) that the springs hold on to when the voltage has been on for `age` (k,) s; the damper is none of the
        film's springs.
        """
        modulus = points.modulus * self.timescale.weight(points, age)
        modulus[-1] = 0.0
        return np.asarray(modulus)

    def _signal(self, kind: Kind, system: Films, cases: Cases, begin: Floats, time: Floats, state: Floats) -> Floats:
        """The signal (k,) of columns of these cases at times (k,) since a span began, `begin` (k,) since the piece did."""
        return self._value(kind, system, cases, time, self.age(cases, self._start[cases] + begin + time), state)

    def _value(self, kind: Kind, system: Films, cases: Cases, time: Floats, age: Floats, state: Floats) -> Floats:
        """The signal (k,) at times (k,) since a span began."""
        if kind is Kind.PULL_IN:
            return self._stability(system, time, age, state).margin
        driven = system.load.value(time)
        log_squared, nominal = system.membrane(state, driven)
        if kind is Kind.BREAKDOWN:
            return np.asarray(1 - np.abs(driven[2]) * np.exp(0.5 * (log_squared[0] + log_squared[1])) / self.breakdown_field[cases])
        axis = int(kind) - Kind.LOSS_OF_TENSION_1
        assert self._tension is not None
        whole = self._tension[axis, cases]
        return np.where(whole > 0, nominal[axis] / np.abs(whole), 1.0)

    def _keep(self, kind: Kind, stride: Stride, columns: Cases, last: Floats, value: Floats) -> None:
        """Keep the brackets of falls within the step."""
        cases, system = stride.cases[columns], stride.system
        assert isinstance(system, Films)
        begin = self._start[cases] + stride.begin[columns]
        segment = Segment.of(stride, slice(None), columns)
        bracket = Bracket(segment, system.load.take(columns), begin, self._clock[cases], last, value)
        self._found.setdefault(kind, []).append(bracket)
        self._seen[kind, cases] = True

    @staticmethod
    def _rows(kind: Kind, system: Films) -> slice:
        """The part of a state that a signal asks for."""
        return slice(None if kind is Kind.PULL_IN else system.border, None)

    def _over(self, kind: Kind, stride: Stride, columns: Cases) -> Signal:
        """The signal of some columns of a stride over the fraction of the step."""
        count = columns.size
        columns = np.resize(columns, max(2, count))  # numbers in a lone column round differently
        some = stride.system.take(columns)
        assert isinstance(some, Films)
        segment, begin = Segment.of(stride, self._rows(kind, some), columns), stride.begin[columns]

        def signal(fraction: Floats) -> Floats:
            at = np.resize(fraction, columns.size)
            local = segment.time + at * segment.step
            return self._signal(kind, some, segment.cases, begin, local, segment.state(at))[:count]

        return signal

    def _note(self, kind: Kind, system: Films, cases: Cases, begin: Floats, time: Floats, state: Floats) -> None:
        """Book events of cases (k,) at times (k,) since a span began, `begin` (k,) since the piece did."""
        if cases.size:
            at = self._start[cases] + begin + time
            self._book(kind, system, cases, at, time, self.age(cases, at), state)

    def _book(self, kind: Kind, system: Films, cases: Cases, at: Floats, time: Floats, age: Floats, state: Floats) -> None:
        """Book events of cases (k,) at times (k,) since the programme began, which are `time` (k,) since a span began."""
        driven = system.load.value(time)
        log_squared, nominal = system.membrane(state, driven)
        self.note(kind, cases, at, age, system.points, system.internal(state), log_squared, nominal, driven[2])
