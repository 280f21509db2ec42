"""Where a film fails on its way: events located on the stepper's dense output.

An event happens where its signal, positive at first, falls to zero: breakdown where 1 - |E|/E_EB does, pull-in where the stability
margin does, loss of tension where the mechanical stress of a held axis does. `Watch` sees every step, looks inside the steps that
come close, and keeps the bracket of each fall; the brackets are narrowed down together, once a piece of load is through.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from dielast.gent import Cases, Floats
from dielast.integrate import Stride
from dielast.load import Control
from dielast.point import LoadedPoints, Points
from dielast.roots import CLOSE, Signal, fall, samples
from dielast.stability import Fold, Stability, TimeScale, stability
from dielast.symmetric import SymmetricPoints

Films = LoadedPoints | SymmetricPoints


# Where a signal falls and rises again within a step, both together are less than this, so no signal that has to do more is looked
# at. That is a bound by experience, not by proof, for tolerances up to `STRICT`: there the margin does 0.23 (0.19 at 1e-4), a field
# 0.003. At 1e-2 it is 0.6 and 0.3, so looser tolerances have every step looked into.
MOVE = (0.05, 0.3, 0.3, 0.3)
STRICT = 1e-3
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
class Segment:
    """Dense output of some columns of a step: polynomials in the fraction of the step, `coefficients` (5, rows, k)."""

    cases: Cases
    time: Floats
    step: Floats
    coefficients: Floats

    @classmethod
    def of(cls, stride: Stride, rows: slice, columns: Cases) -> Segment:
        """Rows of the columns of a stride."""
        pair = np.resize(columns, max(2, columns.size))  # numbers in a lone column round differently
        inner = np.einsum("is,srk->irk", stride.method.dense, stride.increments[:, rows, pair])[:, :, : columns.size]
        ends = np.stack((stride.before[rows, columns], stride.after[rows, columns]))
        return cls(stride.cases[columns], stride.time[columns], stride.step[columns], np.concatenate((ends, inner)))

    @classmethod
    def joined(cls, segments: list[Segment]) -> Segment:
        """All of them as one."""
        fields = ((s.cases, s.time, s.step, s.coefficients) for s in segments)
        return cls(*(np.concatenate(parts, axis=-1) for parts in zip(*fields, strict=True)))

    def state(self, fraction: Floats) -> Floats:
        """States (rows, k) at fractions (k,)."""
        before, after, k1, k2, k3 = self.coefficients
        rest = 1 - fraction
        return np.asarray(rest * before + fraction * (after + rest * (k1 + fraction * (k2 + fraction * k3))))


@dataclass(slots=True, eq=False)
class Watch:
    """Observes the stepper. `breakdown_field` (cases,) in V/m, infinite where breakdown is of no interest; a case ends once all
    events in `until` have happened; `rtol` is the stepper's. Without `tension`, its loss is not looked for, and determinants are
    not noted. Between pieces of load, `begin` and `finish` are called.

    A signal that falls and rises again within one step is found if `MOVE` holds and a parabola through its values at the ends and
    in the middle of the step comes near zero; that is so for one dip as wide as the step, and need not be for one much narrower.
    """

    controls: tuple[Control, Control]
    breakdown_field: Floats
    timescale: TimeScale
    until: tuple[Kind, ...]
    rtol: float
    tension: bool = True
    happened: Happened = field(init=False)
    _seen: NDArray[np.bool_] = field(init=False)
    _last: Floats = field(init=False)
    _begin: Floats = field(init=False)
    _kinds: list[Kind] = field(init=False)
    _found: list[tuple[Kind, Segment, Floats, Floats]] = field(init=False, default_factory=list)
    _tension: Floats = field(init=False)

    def __post_init__(self) -> None:
        cases = self.breakdown_field.size
        self.happened = Happened.nothing(cases)
        self._seen = np.zeros((len(Kind), cases), dtype=bool)
        self._last = np.ones((len(Kind), cases))
        self._begin = np.zeros(cases)
        held = [control is Control.STRETCH for control in self.controls]
        self._kinds = [Kind.BREAKDOWN] if np.any(np.isfinite(self.breakdown_field)) else []
        self._kinds += [] if all(held) else [Kind.PULL_IN]
        if self.tension:
            self._kinds += [kind for kind, yes in zip((Kind.LOSS_OF_TENSION_1, Kind.LOSS_OF_TENSION_2), held, strict=True) if yes]

    def determinant(
        self, points: Points, internal: Floats, log_squared_stretch: Floats, nominal_stress: Floats, field: Floats, time: Floats
    ) -> Floats:
        """The determinant (k,) of damped points at times (k,) since the programme began."""
        modulus = self._held_modulus(points, time)
        return stability(points, modulus, self.controls, internal, log_squared_stretch, nominal_stress, field).determinant

    def begin(self, system: Films, state: Floats, start: Floats, fresh: NDArray[np.bool_]) -> None:
        """A piece of load begins at `start` (cases,) with this state: what has already fallen happens now, to those `fresh`
        (cases,) that do not just go on smoothly from the piece before.
        """
        self._begin = start
        if not fresh.any():
            return
        if not hasattr(self, "_tension"):
            stress = np.abs(system.membrane(state, system.load.value(np.zeros_like(start)))[1])
            self._tension = np.where(stress > 0, stress, 1.0)
        every, zero = np.arange(start.size), np.zeros_like(start)
        for kind in self._kinds:
            value = self._signal(kind, system, every, zero, state)
            fallen = fresh & ~self._seen[kind] & ~(value > 0)
            some = np.flatnonzero(fallen)
            self._note(kind, system.take(some), some, zero[some], state[:, some])
            self._last[kind, fresh] = value[fresh]

    def note(
        self,
        kind: Kind,
        cases: Cases,
        time: Floats,
        points: Points,
        internal: Floats,
        log_squared_stretch: Floats,
        nominal_stress: Floats,
        field: Floats,
    ) -> None:
        """Say that an event happened to cases (k,) at times (k,) since the programme began; the rest is theirs, too."""
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
        held = self._held_modulus(some := points.take(pair), time[pair])
        found = stability(some, held, self.controls, *state)
        vanishing = (kind is Kind.PULL_IN) & (np.abs(found.margin) < VANISHING)
        self.happened.determinant[kind, cases] = np.where(vanishing, 0.0, found.determinant)[: cases.size]

    def seen(self, kind: Kind, cases: Cases) -> NDArray[np.bool_]:
        """To which of the cases an event has happened already."""
        return np.asarray(self._seen[kind, cases])

    @property
    def done(self) -> NDArray[np.bool_]:
        """Cases (cases,) that need not go on."""
        return np.asarray(np.all(self._seen[list(self.until)], axis=0)) if self.until else np.zeros(self._seen.shape[1], dtype=bool)

    def __call__(self, stride: Stride) -> NDArray[np.bool_] | None:
        """Note what falls within the step; columns whose case ends with it."""
        system = stride.system
        assert isinstance(system, Films)
        moves = MOVE if self.rtol <= STRICT else (np.inf,) * len(Kind)
        for kind in self._kinds:
            wanted = stride.accepted & ~self._seen[kind, stride.cases]
            if not wanted.any():
                continue
            last = self._last[kind, stride.cases]
            if kind is Kind.PULL_IN and np.all(last[wanted] > 2 * moves[kind]):
                self._last[kind, stride.cases[wanted]] -= 0.5 * moves[kind]  # no lower than this after the step, and far from zero
                continue
            value = self._signal(kind, system, stride.cases, stride.until, stride.after)
            close = wanted & ~((value > 0) & (value + last > moves[kind]))
            if close.any():
                self._look_inside(kind, stride, np.flatnonzero(close), last[close], value[close])
            self._last[kind, stride.cases[wanted]] = value[wanted]
        done = self.done[stride.cases]
        return done if done.any() else None

    def finish(self, system: Films) -> None:
        """A piece of load is through: find the times of what happened in it."""
        for kind in self._kinds:
            found = [item for item in self._found if item[0] is kind]
            if not found:
                continue
            segment = Segment.joined([item[1] for item in found])
            last, value = (np.concatenate([item[index] for item in found]) for index in (2, 3))
            if last.size == 1:  # numbers in a lone column round differently
                segment, last, value = Segment.joined([segment, segment]), np.repeat(last, 2), np.repeat(value, 2)
            some = system.take(segment.cases)

            asked = replace(segment, coefficients=segment.coefficients[:, self._rows(kind, some)])

            def signal(fraction: Floats, kind: Kind = kind, asked: Segment = asked, some: Films = some) -> Floats:
                return self._signal(kind, some, asked.cases, asked.time + fraction * asked.step, asked.state(fraction))

            values, fractions = samples(signal, last, value)
            first, every = np.argmax(~(values > 0), axis=0), np.arange(last.size)
            fraction = fall(signal, fractions[first - 1, every], fractions[first, every])
            time, state = segment.time + fraction * segment.step, segment.state(fraction)
            self._note(kind, some, segment.cases, time, state)
            if kind is Kind.PULL_IN:
                self._sharpen(some, segment.cases, time, state)
        self._found = []

    def _sharpen(self, system: Films, cases: Cases, time: Floats, state: Floats) -> None:
        """Book pull-ins anew that are at the end of an equilibrium, where the damper has taken over."""
        points, driven = system.points, system.load.value(time)
        bare = replace(points, modulus=np.concatenate((points.modulus[:-1], np.zeros_like(points.modulus[-1:]))))
        internal, (log_squared, nominal) = system.internal(state), system.membrane(state, driven)
        literal = stability(bare, bare.modulus, self.controls, internal, log_squared, nominal, driven[2]).margin
        ends = np.flatnonzero(literal < FOLD)
        if not ends.size:
            return
        ends = np.resize(ends, max(2, ends.size))
        some, began = system.take(ends), self._begin[cases[ends]]
        fold = Fold(
            bare.take(ends),
            self.controls,
            some.load.value,
            lambda at: self._held_modulus(some.points, began + at),
            internal[:, :, ends],
            log_squared[:, ends],
            time[ends],
        )
        moment, internal, log_squared, nominal = fold.find()
        internal[:, -1] = log_squared  # the damper has no part in it
        field = some.load.value(moment)[2]
        self.note(Kind.PULL_IN, cases[ends], began + moment, some.points, internal, log_squared, nominal, field)

    def stability(self, system: Films, cases: Cases, time: Floats, state: Floats) -> Stability:
        """Stability of these cases (k,) at times (k,) since the piece began; `system` and `state` are theirs."""
        state = np.ascontiguousarray(
            state
        )  # sums round by the order of numbers in memory, which must not depend on how they came here
        driven = system.load.value(time)
        modulus = self._held_modulus(system.points, self._begin[cases] + time)
        internal = state[None, :-1] if isinstance(system, SymmetricPoints) else system.internal(state)
        return stability(system.points, modulus, self.controls, internal, *system.membrane(state, driven), driven[2])

    def _held_modulus(self, points: Points, time: Floats) -> Floats:
        """Modulus (n, k) that the springs hold on to at times (k,) since the programme began; the damper is none of the film's
        springs.
        """
        modulus = points.modulus * self.timescale.weight(points, time)
        modulus[-1] = 0.0
        return np.asarray(modulus)

    def _signal(self, kind: Kind, system: Films, cases: Cases, time: Floats, state: Floats) -> Floats:
        """The signal (k,) of columns of these cases at times (k,) since the piece began."""
        driven = system.load.value(time)
        log_squared, nominal = system.membrane(state, driven)
        if kind is Kind.BREAKDOWN:
            return np.asarray(1 - np.abs(driven[2]) * np.exp(0.5 * (log_squared[0] + log_squared[1])) / self.breakdown_field[cases])
        if kind is Kind.PULL_IN:
            return self.stability(system, cases, time, state).margin
        axis = int(kind) - Kind.LOSS_OF_TENSION_1
        return np.asarray(nominal[axis] / self._tension[axis, cases])

    def _look_inside(self, kind: Kind, stride: Stride, columns: Cases, last: Floats, value: Floats) -> None:
        """Keep the columns whose signal falls to zero within the step, even if it has risen again by the end."""
        crossing = ~(value > 0)
        if not crossing.all():
            middle = self._part(kind, stride, columns)[1](np.full(columns.size, 0.5))
            curvature = last - 2 * middle + value
            bottom = middle - np.square(value - last) / (8 * np.where(curvature > 0, curvature, np.inf))
            dipping = ~crossing & (bottom < CLOSE) & (np.abs(value - last) < 2 * curvature)
            if dipping.any():
                some = np.flatnonzero(dipping)
                signal = self._part(kind, stride, columns[some])[1]
                crossing[some] = np.any(samples(signal, last[some], value[some])[0] <= 0, axis=0)
        if crossing.any():
            columns, last, value = columns[crossing], last[crossing], value[crossing]
            self._found.append((kind, Segment.of(stride, slice(None), columns), last, value))
            self._seen[kind, stride.cases[columns]] = True

    @staticmethod
    def _rows(kind: Kind, system: Films) -> slice:
        """The part of a state that a signal asks for."""
        return slice(None if kind is Kind.PULL_IN else system.border, None)

    def _part(self, kind: Kind, stride: Stride, columns: Cases) -> tuple[Segment, Signal]:
        """Some columns of a stride, and their signal over the fraction of the step."""
        count = columns.size
        columns = np.resize(columns, max(2, count))  # numbers in a lone column round differently
        some = stride.system.take(columns)
        assert isinstance(some, Films)
        segment = Segment.of(stride, self._rows(kind, some), columns)

        def signal(fraction: Floats) -> Floats:
            at = np.resize(fraction, columns.size)
            return self._signal(kind, some, segment.cases, segment.time + at * segment.step, segment.state(at))[:count]

        return segment, signal

    def _note(self, kind: Kind, system: Films, cases: Cases, time: Floats, state: Floats) -> None:
        """Book events of cases (k,) at times (k,) since the piece began."""
        if not cases.size:
            return
        driven = system.load.value(time)
        log_squared, nominal = system.membrane(state, driven)
        self.note(kind, cases, self._begin[cases] + time, system.points, system.internal(state), log_squared, nominal, driven[2])
