"""The interface of a criterion: a name, and a signal of a film that is positive until the event of the criterion happens.

A new criterion is a subclass of `Criterion` in a module of this folder, and a line in `CRITERIA`. Its signal is a function of a
`FilmSnapshot`. A criterion on a quantity that accumulates over time has a rate instead; its signal is 1 minus the integral of the
rate. The rest follows: the first fall of the signal to zero is an event with a row in events.csv, a marker in figures and a name
for `stop.at`; if the criterion is a failure, it is also a failure mode of maps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dielast.material.laws_of_cases import FailureLaws
from dielast.material.material import Material
from dielast.mechanics.equations import Films
from dielast.mechanics.passive.framed import FramedFilms, Surroundings
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Controls, Load
from dielast.mechanics.stability import Stability, TimeScale
from dielast.numerics.arrays import ByCase, Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class FilmSnapshot(ByCase):
    """Films at a moment, in columns (k,) that belong to `cases` (k,).

    `internal` is x (2, n, k), or (1, n, k) if both axes are equal; Lambda and the mechanical nominal stress in Pa are (2, k).
    `electrical` (k,) is the quantity that acts on the film: the nominal field V/L_3 in V/m, or the nominal charge density in
    C/m^2. `age` (k,) is the time in s since the magnitude of the voltage or charge of the source last began to rise.

    For films with a passive part, these are the quantities of the active part, except that `internal` is the viscous stretches xi
    (2, n, P, k) of all points; `surroundings` describes the passive part.
    """

    points: PointMaterial
    controls: Controls
    cases: Cases
    age: Floats
    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    electrical: Floats
    surroundings: Surroundings | None = None

    @classmethod
    def of(cls, system: Films, cases: Cases, age: Floats, time: Floats, state: Floats) -> FilmSnapshot:
        """Films with the equations `system` in the `state` (rows, k), at `time` (k,) in s since the span of load began.

        For signals that do not depend on the springs, the rows of the border are enough.
        """
        # rounding of sums depends on the layout in memory, which must not depend on the caller
        state = np.ascontiguousarray(state)
        driven = system.driven(time, state)
        internal = system.compact(state) if isinstance(system, LoadedPoints) else system.internal(state)
        membrane = system.membrane(state, driven)
        passive_part = Surroundings(system.assembly, state[system.border :]) if isinstance(system, FramedFilms) else None
        return cls(system.points, system.load.controls, cases, age, internal, *membrane, driven[2], passive_part)

    @property
    def log_area(self) -> Floats:
        """Lambda_1 + Lambda_2 = 2 ln(lambda_1 lambda_2), (k,)."""
        return np.asarray(self.log_squared_stretch[0] + self.log_squared_stretch[1])

    @property
    def true_field(self) -> Floats:
        """|E| (k,) in V/m."""
        permittivity = self.points.permittivity_at(self.log_squared_stretch)
        return np.abs(self.points.electric.true_field(permittivity, self.log_area, self.electrical))

    @property
    def tension(self) -> Floats:
        """The nominal stresses (2, k) in Pa that may fall to zero, of the film or of the passive part around it."""
        return self.nominal_stress if self.surroundings is None else self.surroundings.tension


Signal = Callable[[FilmSnapshot], Floats]
"""The signal (k,) of a snapshot of films, positive until the event happens."""


@dataclass(frozen=True, slots=True, eq=False)
class WatchedFilms(ByCase):
    """The data on films that criteria may use.

    `controls` is what the load prescribes along each axis, at first if the edges are `moved`; `timescale` is that of pull-in;
    `nominal_stress` (2, cases) in Pa is the mechanical stress of the relaxed films, which counts as 0 up to `stress_floor`
    (cases,).
    """

    controls: Controls
    endurance: FailureLaws
    timescale: TimeScale
    nominal_stress: Floats
    stress_floor: Floats
    moved: bool = False


class Criterion:
    """A criterion for an event. Criteria with the same name describe the same kind of event (such as one for each axis)."""

    name: ClassVar[str]
    """The name in files, figures and recipes."""

    marker: ClassVar[str]
    """The shape of its events in figures, as a letter: x, o, v, s, D, P, ^ ... (see `plots.looks`)."""

    hatch: ClassVar[str] = "...."
    """The hatch in failure maps of cells in which it happens first; empty for the most common one."""

    is_failure: ClassVar[bool] = True
    """Whether the film is lost: maps compute its time, and figures dim the curve after it."""

    needs_springs: ClassVar[bool] = False
    """Whether the signal depends on the viscous stretches."""

    ends_equilibria: ClassVar[bool] = False
    """Whether a film has no equilibrium beyond the event: on the way to a voltage applied at once, it is not looked for, but placed
    at the end.
    """

    def possible(self, controls: Controls) -> bool:
        """Whether the event can happen under a load of these controls."""
        return True

    def signal(self, films: WatchedFilms) -> Signal | None:
        """The signal for these films; None if the event cannot happen in any of them, or if the criterion has a rate."""
        return None

    def rate(self, films: WatchedFilms) -> Signal | None:
        """The rate (k,) in 1/s, at least 0, whose integral over time reaches 1 at the event; None if the criterion has a signal."""
        return None

    def arming(self, films: WatchedFilms) -> Floats | None:
        """The least signal (cases,) that a film must have had before its event can happen; None if there is none."""
        return None

    def concerns(self, materials: Sequence[Material]) -> bool:
        """Whether films of these materials may have this event; if none may, maps omit it."""
        return True

    def refined(self, films: WatchedFilms, time: Floats, snapshot: FilmSnapshot, load: Load) -> tuple[Floats, FilmSnapshot]:
        """The time (k,) in s since a span of `load` began, and the films, of a zero of the signal, located more accurately.

        `time` and `snapshot` are those of the zero as located on the steps.
        """
        return time, snapshot

    def determinant(self, stability: Stability) -> Floats:
        """The pull-in determinant (k,) to record for an event with this stability."""
        return stability.determinant
