"""Relaxed films under constant voltages: events and stretches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dielast.mechanics.criteria import CRITERIA
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.line import Ramp
from dielast.mechanics.span import Controls
from dielast.mechanics.watch import EventArrays, Watch
from dielast.numerics.arrays import Cases, Floats, paired
from dielast.simulate.film_grid import Group
from dielast.simulate.follow import follow
from dielast.simulate.record import Recorder
from dielast.simulate.wanted import Wanted


@dataclass(frozen=True, slots=True, eq=False)
class Lives:
    """The events that `happened` to films (k,), their `Status`, and their relative stretches.

    `stretched` (2, times, k) are the relative stretches at the requested times, over those when the voltage is applied; NaN for
    times that a film does not reach.
    """

    happened: Mapping[Criterion, EventArrays]
    status: Cases
    stretched: Floats
    begin: Floats
    """The stretches (2, k) when the voltage is applied."""

    def relative_stretch(self, moment: EventArrays) -> Floats:
        """The relative stretches (2, k) at an event."""
        return np.asarray(np.exp(0.5 * moment.log_squared_stretch) / self.begin)


def live(
    group: Group,
    columns: Cases,
    voltage: Floats,
    controls: Controls,
    *,
    horizon: float,
    ramp: float = 0.0,
    watched: Sequence[str],
    until: Sequence[str],
    ends: Sequence[str] = (),
    times: Sequence[float] = (),
) -> Lives:
    """Simulate `columns` (k,) of a group under a `voltage` (k,) in V, which is reached within `ramp` s and held up to `horizon` s.

    `watched` names the criteria to evaluate. A film ends when all events in `until`, or any event in `ends`, have happened.
    """
    count = columns.size
    columns, voltage = paired(columns), np.repeat(voltage, 2) if count == 1 else voltage
    film, field = group.film.take(columns), voltage / group.thickness[columns]
    watch = Watch(group.watched.take(columns), [criterion for criterion in CRITERIA if criterion.name in watched], until, ends)
    pieces = [Ramp(controls, (None, None, field), np.full(field.size, ramp))]
    if horizon > ramp:
        pieces.append(Ramp(controls, (None, None, None), np.full(field.size, horizon - ramp)))
    begin = np.exp(0.5 * film.condition.log_squared_stretch)
    recorder = None
    if len(times):
        wanted = Wanted(np.broadcast_to(np.array(times), (field.size, len(times))))
        recorder = Recorder(wanted, field.size, film.points.rate.shape[0])
    status = follow(film, pieces, rtol=group.rtol, watch=watch, recorder=recorder).status
    stretched = np.zeros((2, 0, field.size))
    if recorder is not None:
        stretched = recorder.collect().stretch.transpose(0, 2, 1) / begin[:, None]
    happened = {criterion: entry.take(np.arange(count)) for criterion, entry in watch.happened.items()}
    return Lives(happened, status[:count], stretched[..., :count], begin[:, :count])
