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
from dielast.mechanics.stretched import Histories, Steps
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.stride import DenseSteps, TriedStep


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


class _Borne(Steps):
    """Stores the nominal stress of axis 1 in every step, 0 where the specimen is slack."""

    def __call__(self, stride: TriedStep) -> None:
        """Store the step."""
        system = films_of(stride)
        assert isinstance(system, LoadedPoints)
        assert system.slack is not None
        columns = np.flatnonzero(stride.accepted)
        part = DenseSteps.of(stride, slice(-system.axes, 1 - system.axes or None), columns)
        part.coefficients[..., system.slack[columns]] = 0.0
        self.parts.append(part)
        self.begins.append(stride.begin[columns] + stride.time[columns])


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
    system, steps = film.equations(opening), _Borne()
    last = histories.time[:, -1]
    lasting = np.where(status == Status.COMPLETED, last, 0.0)
    done = integrate(system, film.state(system), lasting, rtol=rtol, observe=steps, spans=grips, turns=contact)
    lost = (status != Status.COMPLETED) | (done.status != Status.COMPLETED)
    stress = np.full(times.shape, np.nan)
    if not lost.all():
        stress[~lost] = steps.states(times, last)[0][~lost]
    return stress
