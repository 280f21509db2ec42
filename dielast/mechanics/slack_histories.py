"""Specimens of prescribed stretch that may be slack, many of different histories at once: the branches are coupled where the
specimen is free.
"""

from dataclasses import dataclass

import numpy as np

from dielast.material.springs import Symmetry
from dielast.mechanics.at_once import apply_at_once
from dielast.mechanics.equations import films_of
from dielast.mechanics.film import FilmState
from dielast.mechanics.history import LATERAL
from dielast.mechanics.load import Mode
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.slack import Contact
from dielast.mechanics.span import Control, Load
from dielast.mechanics.stretched import Histories
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.stride import TriedStep


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
    done = integrate(system, film.state(system), lasting, rtol=rtol, observe=observer, spans=grips, turns=contact)
    lost = (status != Status.COMPLETED) | (done.status != Status.COMPLETED)
    return np.where(lost[:, None], np.nan, observer.stress)
