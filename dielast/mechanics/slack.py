"""Specimens between grips that cannot push: slack where the nominal stress of a prescribed stretch would be negative.

A slack specimen bears nothing and recovers freely, longer than the distance of its grips, until it is as long as that again and is
taut. Stress s and stretch l of axis 1, and the stretch L of the grips, are complementary: s >= 0, l >= L, s (l - L) = 0. Both are
continuous, as the tension rises with the stretch, and so are the rates of flow. While a specimen is free its branches are coupled,
so that many specimens of different prescribed histories run as films do (`borne`), and not branch by branch as in `stretched`.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.material.springs import Symmetry
from dielast.mechanics.at_once import apply_at_once
from dielast.mechanics.equations import films_of
from dielast.mechanics.film import FilmState
from dielast.mechanics.history import LATERAL
from dielast.mechanics.jump import jump
from dielast.mechanics.load import Mode
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import FLOOR, ROUNDING, PointMaterial
from dielast.mechanics.span import Control, Controls, Load
from dielast.mechanics.stretched import Histories
from dielast.numerics.arrays import Cases, Flags, Floats, paired, where
from dielast.numerics.integrate import SHRINK, Status, Stepper
from dielast.numerics.roots import ROOT, OfFraction, fall, samples
from dielast.numerics.stride import TriedStep

NEARBY = 0.1  # largest change of Lambda in a turn, in which the state is continuous to the tolerance of the integration


@dataclass(slots=True)
class Contact:
    """The turns of the stepper for specimens that are slack or not, `slack` (cases,), and the `events`: the case, the time in s,
    the stretch there, and whether the specimen goes slack (else taut).

    A signal falls to zero at an event: of a taut specimen the stress over a modulus, of a slack one the logarithm of its length
    over the distance of the grips. It is known to the tolerance `rtol` of the integration.
    """

    slack: Flags
    rtol: float
    events: list[tuple[int, float, float, bool]] = field(default_factory=list)
    _start: Floats = field(default_factory=lambda: np.zeros(0))
    _turned: Floats = field(default_factory=lambda: np.zeros(0))
    """Times (cases,) in s since the piece of load began of the last change of the equations; NaN before."""
    _zero: Floats = field(default_factory=lambda: np.zeros(0))
    """Where the signals (cases,) have their zero: below 0 by the error of the last event, until they have risen above 0."""

    def begin(self, film: FilmState, controls: Controls, start: Floats, jumped: Flags, status: Cases) -> FilmState:
        """The specimens at the beginning of a piece of load with these `controls`, which `start` (3, cases) prescribes, and to
        which the load of some has `jumped` (cases,). Where a slack specimen has no equilibrium, `status` (cases,) is changed.
        """
        self._start, self._turned = film.time, np.full(self.slack.size, np.nan)
        self._zero = np.where(jumped, 0.0, self._zero) if self._zero.size else np.zeros(self.slack.size)
        if controls[0] is not Control.STRETCH:
            self.slack = np.zeros_like(self.slack)
            return replace(film, slack=None)
        pressed = film.nominal_stress[0] * FLOOR / film.points.stress_floor < self._zero - self.rtol
        loose = (jumped | ~self.slack) & (status == 0) & pressed
        if loose.any():
            free = np.concatenate((np.zeros((1, loose.size)), start[1:]))
            film = apply_at_once(film, (Control.STRESS, controls[1]), free, loose, status, None)
        every = np.arange(loose.size)
        self.note(every, film.time, start[0], np.where(jumped, False, self.slack) | loose)
        return replace(film, slack=self.slack, grips=start[0])

    def signal(self, system: LoadedPoints, time: Floats, state: Floats) -> Floats:
        """The signals (k,) of a `state` (rows, k) at `time` (k,) in s since the span began; those of slack specimens need only the
        rows of the border.
        """
        assert system.slack is not None
        driven = system.load.value(time)
        taut = np.zeros_like(time) if system.slack.all() else system.held_stress(state, driven) * FLOOR / system.points.stress_floor
        return np.asarray(np.where(system.slack, 0.5 * state[-system.axes] - np.log(driven[0]), taut))

    def share(self, stride: TriedStep, landing: Flags) -> Floats:
        """The fractions (pool,) of the steps at which specimens go slack or taut; see `Turns`."""
        system, steps = films_of(stride), stride.stored(slice(None))
        assert isinstance(system, LoadedPoints)
        assert system.slack is not None

        def along(columns: Cases) -> OfFraction:
            same = np.array_equal(columns, np.arange(landing.size))
            part = system if same else system.take(columns)
            assert part.slack is not None
            dense = steps.rows(slice(part.border, None)) if part.slack.all() else steps
            dense = dense if same else dense.take(columns)
            return lambda fraction: self.signal(part, dense.time + fraction * dense.step, dense.state(fraction)) - zero[columns]

        first = self.signal(system, stride.time, stride.before)
        zero = self._zero[stride.cases] = np.minimum(np.maximum(self._zero[stride.cases], first), 0.0)
        first, last = first - zero, self.signal(system, stride.until, stride.after) - zero
        middle = along(np.arange(landing.size))(np.full(landing.size, 0.5))
        # a step that ends at a zero does so to the tolerance of a stress of zero; other falls are sure beyond that of the stretch
        least = np.where(landing, max(self.rtol * FLOOR, ROUNDING), self.rtol)
        share = np.where(landing & (np.abs(last) <= least), 1.0, np.inf)
        # four times as far below as a parabola
        lowest = np.minimum(np.minimum(first, middle), last) - np.abs(first - 2 * middle + last)
        near = where(np.logical_and(stride.accepted, np.logical_or(system.slack, lowest < 0)))
        if not near.size:
            return share
        values, fractions = samples(along(near), first[near], last[near])
        fallen = values < -least[near]
        some = paired(np.flatnonzero(fallen.any(axis=0)))
        if not some.size:
            return share
        falls, fallen, values, fractions = near[some], fallen[:, some], values[:, some], fractions[:, some]
        just = self._turned[stride.cases[falls]] == (stride.begin + stride.time)[falls]
        positive = values > 0
        positive[0] &= ~just  # beside an event the signal begins at zero: it must have risen to fall again
        end = np.argmax(fallen, axis=0)
        positive &= np.arange(len(values))[:, None] < end
        inside, begin = positive.any(axis=0), len(values) - 1 - np.argmax(positive[::-1], axis=0)
        each, signal = np.arange(falls.size), along(falls)
        low, high = fractions[np.where(inside, begin, 0), each], fractions[end, each]
        root = fall(lambda fraction: np.where(inside, signal(fraction), 0.5 - fraction), low, high)
        root = np.where(root <= ROOT, 0.0, np.where(root >= 1 - ROOT, 1.0, root))  # at an end
        share[falls] = np.where(inside, root, np.where(just, SHRINK, 0.0))
        return share

    def present(self, system: LoadedPoints, cases: Cases) -> LoadedPoints:
        """The specimens of these `cases` (k,), slack or taut as they are now; see `Turns`."""
        return replace(system, slack=self.slack[cases])

    def turn(
        self, system: LoadedPoints, columns: Cases, cases: Cases, elapsed: Floats, time: Floats, state: Floats
    ) -> LoadedPoints:
        """The specimens with those in `columns` (k,) slack if they were taut, and taut if they were slack; see `Turns`."""
        assert system.slack is not None
        slack = system.slack.copy()
        slack[columns] = ~slack[columns]
        moment = np.zeros(state.shape[1])
        moment[columns] = time
        driven = system.load.value(moment)
        internal, membrane = system.internal(state), system.membrane(state, driven)[0]
        for loose, control in ((True, Control.STRESS), (False, Control.STRETCH)):
            if (turned := paired(columns[slack[columns] == loose])).size:
                target, controls = driven[:, turned], (control, system.load.controls[1])
                target[0] = 0.0 if loose else target[0]
                points, inside = system.points.take(turned), internal.take(turned, axis=-1)
                log_squared, _, stable = jump(points, controls, target, inside, membrane[:, turned], NEARBY)
                # springs that lose their stiffness have no free equilibrium, and would turn from slack to taut without end
                state[-system.axes :, turned] = np.where(stable, log_squared[: system.axes], np.nan)
        stretch = driven[0]
        changed = replace(system, slack=slack)
        self._turned[cases] = elapsed
        self._zero[cases] = np.minimum(self.signal(changed, moment, state)[columns], 0.0)
        self.note(cases, self._start[cases] + elapsed, stretch[columns], slack[columns])
        return changed

    def note(self, cases: Cases, time: Floats, stretch: Floats, slack: Flags) -> None:
        """Specimens of the `cases` (k,) go slack or taut at `time` (k,) in s, where the distance of the grips is `stretch` (k,)."""
        changed = np.flatnonzero(self.slack[cases] != slack)
        changed = changed[np.unique(cases[changed], return_index=True)[1]]
        self.slack = self.slack.copy()
        self.slack[cases] = slack
        rows = zip(cases[changed].tolist(), time[changed].tolist(), stretch[changed].tolist(), slack[changed].tolist(), strict=True)
        self.events += rows


@dataclass(frozen=True, slots=True, eq=False)
class Grips:
    """The spans of load between the corners of `histories`, in a `mode`."""

    histories: Histories
    mode: Mode

    @property
    def spans(self) -> int:
        """The number of intervals between corners."""
        return self.histories.spans

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The load in the spans `index` (k,) of `cases` (k,), and the durations (k,) in s of these spans."""
        (start, slope), lasts = self.histories.span(cases, index)
        control, value = LATERAL[self.mode]
        zero = np.zeros_like(start)
        return Load((Control.STRETCH, control), np.stack((start, zero + value, zero)), np.stack((slope, zero, zero))), lasts

    def smooth(self, index: Cases) -> Flags:
        """False (k,): every corner is a kink."""
        return np.zeros(index.shape, dtype=bool)


@dataclass(frozen=True, slots=True, eq=False)
class _Borne:
    """Stores the nominal `stress` (cases, k) of axis 1 at `times` (cases, k) in s, 0 where the specimen is slack."""

    times: Floats
    stress: Floats

    def __call__(self, stride: TriedStep) -> None:
        """Store the times within the step."""
        system, begin = films_of(stride), stride.begin + stride.time
        assert isinstance(system, LoadedPoints)
        assert system.slack is not None
        times = self.times[stride.cases]
        within = (times <= stride.elapsed[:, None]) & ((times > begin[:, None]) | (begin[:, None] == 0))
        columns, rows = (paired(part) for part in np.nonzero(within & stride.accepted[:, None]))
        if not columns.size:
            return
        fraction = np.clip((times[columns, rows] - begin[columns]) / stride.step[columns], 0.0, 1.0)
        time = stride.time[columns] + fraction * stride.step[columns]
        films, state = system.take(columns), stride.dense(slice(None), columns, fraction)
        nominal = films.membrane(state, films.driven(time, state))[1]
        self.stress[stride.cases[columns], rows] = np.where(system.slack[columns], 0.0, nominal[0])


def borne(points: PointMaterial, mode: Mode, symmetry: Symmetry | None, histories: Histories, times: Floats, rtol: float) -> Floats:
    """The nominal stress (cases, k) in Pa at `times` (cases, k) in s of specimens that bear no pressure, to the tolerance `rtol`;
    NaN where a specimen cannot follow its history.
    """
    grips, every = Grips(histories, mode), np.arange(times.shape[0])
    opening = grips.span(every, np.zeros_like(every))[0]
    film, status = FilmState.at_rest(points, symmetry), np.zeros(every.size, dtype=np.intp)
    jumped, contact = opening.start[0] != 1, Contact(np.zeros(every.size, dtype=bool), rtol)
    if jumped.any():
        film = apply_at_once(film, opening.controls, opening.start, jumped, status, None)
    film = contact.begin(film, opening.controls, opening.start, jumped, status)
    system, observer = film.equations(opening), _Borne(times, np.full(times.shape, np.nan))
    lasting = np.where(status == Status.COMPLETED, histories.time[:, -1], 0.0)
    done = Stepper(system, film.state(system), lasting, rtol=rtol, spans=grips, turns=contact).run(observer)
    lost = (status != Status.COMPLETED) | (done.status != Status.COMPLETED)
    return np.where(lost[:, None], np.nan, observer.stress)
