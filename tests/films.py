"""Materials of films that several tests put under voltage, and points followed through a history."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.film import FilmState
from dielast.mechanics.piece import Piece
from dielast.mechanics.point_material import PointMaterial
from dielast.simulate.follow import follow
from dielast.simulate.history import Outcome
from dielast.simulate.membrane import symmetry_of
from dielast.simulate.output import Output
from dielast.simulate.recorder import Recorder

SOFT = Material(
    "soft",
    26e3,
    Spectrum(np.geomspace(1e4, 1e-2, 7), np.geomspace(1e4, 3e5, 7)),
    NoShift(20.0),
    Gent(110.0),
    Gent(55.0),
    permittivity=4e-11,
)


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A history at output times, Lambda and nominal stress (2, cases, times)."""

    time: np.ndarray
    log_squared_stretch: np.ndarray
    nominal_stress: np.ndarray
    outcome: tuple[Outcome, ...]
    steps: np.ndarray


def followed(points: PointMaterial, pieces: Sequence[Piece], *, points_per_decade: int = 30, rtol: float = 1e-6) -> Followed:
    """Points at rest under pieces of load."""
    recorder = Recorder(Output(None, points_per_decade))
    result = follow(FilmState.at_rest(points, symmetry_of(pieces)), pieces, rtol=rtol, recorders=[recorder])
    record = recorder.collect()
    outcome = tuple(map(Outcome.of, result.status.tolist(), result.time.tolist()))
    return Followed(record.time, record.values[:2], record.nominal_stress, outcome, result.steps)
