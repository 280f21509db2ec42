"""What a criterion is: a name, and a signal of a film that is positive until what it stands for happens.

A new criterion is a subclass of `Criterion` in a module of this folder, and a line in `CRITERIA`. Its signal is a function of a
`Moment`; of what adds up over time, the rate is, and the signal is 1 minus its integral. Everything else follows: when the signal
first falls to zero, that is an event with its row in events.csv, its mark in
figures and its name for `stop.at`; and, of a criterion that is a failure, a failure mode of maps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dielast.material.breakdown.following import FollowingField
from dielast.material.damage import DamageLaw
from dielast.material.laws_of_cases import LawsOfCases
from dielast.material.material import Material
from dielast.mechanics.passive.framed import FramedFilms, Surroundings
from dielast.mechanics.point import Points
from dielast.mechanics.span import Controls, Load
from dielast.mechanics.stability import Stability, TimeScale
from dielast.mechanics.symmetric import Films, SymmetricPoints
from dielast.numerics.columns import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """Films at a moment, columns (k,) that are of `cases` (k,): `internal` is x (2, n, k), or (1, n, k) where both axes are alike,
    Lambda and the mechanical nominal stress in Pa are (2, k), `field` (k,) is the electrical quantity that acts on the film, the
    nominal field V/L_3 in V/m or the nominal charge density in C/m^2. `age` (k,) is how long in s the voltage, or the charge, of
    the source has been on, since its size last began to rise.

    Of films of an active and a passive part all this is that of the active part, but for `internal`, the viscous stretches xi
    (2, n, P, k) of all points; the rest is in the `surroundings`.
    """

    points: Points
    controls: Controls
    cases: Cases
    age: Floats
    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    field: Floats
    surroundings: Surroundings | None = None

    @classmethod
    def of(cls, system: Films, cases: Cases, age: Floats, time: Floats, state: Floats) -> Moment:
        """Films with these equations and this `state` (rows, k) at the `time` (k,) since the span of load began.

        For signals that need no springs, the rows of the border will do.
        """
        # sums round by the order of numbers in memory, which must not depend on how they came here
        state = np.ascontiguousarray(state)
        driven = system.driven(time, state)
        internal = state[None, : system.border] if isinstance(system, SymmetricPoints) else system.internal(state)
        membrane = system.membrane(state, driven)
        around = Surroundings(system.assembly, state[system.border :]) if isinstance(system, FramedFilms) else None
        return cls(system.points, system.load.controls, cases, age, internal, *membrane, driven[2], around)

    @property
    def log_area(self) -> Floats:
        """Lambda_1 + Lambda_2 = 2 ln(lambda_1 lambda_2), (k,)."""
        return np.asarray(self.log_squared_stretch[0] + self.log_squared_stretch[1])

    @property
    def true_field(self) -> Floats:
        """|E| (k,) in V/m."""
        permittivity = self.points.permittivity_at(self.log_squared_stretch)
        return np.abs(self.points.electric.true_field(permittivity, self.log_area, self.field))

    @property
    def tension(self) -> Floats:
        """The nominal stresses (2, k) in Pa that may fall to zero: those of the film, or of the passive part around it."""
        return self.nominal_stress if self.surroundings is None else self.surroundings.tension

    def take(self, columns: Cases) -> Moment:
        """Some of the columns."""
        return replace(
            self,
            points=self.points.take(columns),
            cases=self.cases[columns],
            age=self.age[columns],
            internal=self.internal[..., columns],
            log_squared_stretch=self.log_squared_stretch[:, columns],
            nominal_stress=self.nominal_stress[:, columns],
            field=self.field[columns],
            surroundings=None if self.surroundings is None else self.surroundings.take(columns),
        )


Signal = Callable[[Moment], Floats]
"""A number (k,) for each column of a moment, positive until it happens."""


@dataclass(frozen=True, slots=True, eq=False)
class WatchedFilms:
    """What a criterion may ask of the films that it is to watch: what is held along each axis, the `breakdown_field` (cases,) in
    V/m (infinite where it is of no interest), the time scale of pull-in, and the mechanical nominal stress (2, cases) in Pa of the
    relaxed films, of which a `stress_floor` (cases,) is as good as none. `following` says how the breakdown field changes with
    the film from then on, and `damage` how fast the film ages, where such laws are known.
    """

    controls: Controls
    breakdown_field: Floats
    timescale: TimeScale
    nominal_stress: Floats
    stress_floor: Floats
    following: FollowingField | None = None
    damage: LawsOfCases[DamageLaw] | None = None

    def take(self, cases: Cases) -> WatchedFilms:
        """Some of the films."""
        return replace(
            self,
            breakdown_field=self.breakdown_field[cases],
            nominal_stress=self.nominal_stress[:, cases],
            stress_floor=self.stress_floor[cases],
            following=None if self.following is None else self.following.take(cases),
            damage=None if self.damage is None else self.damage.take(cases),
        )


class Criterion:
    """One way in which something happens to a film. Criteria of one name are one thing that may happen in several ways."""

    name: ClassVar[str]
    """As files, figures and recipes have it."""

    marker: ClassVar[str]
    """Of its events in figures: one of the letters x, o, v, s, D, P, ^ and so on that stand for shapes there."""

    hatch: ClassVar[str] = "...."
    """Of the cells of a map in which it happens first; none for the commonest."""

    is_failure: ClassVar[bool] = True
    """Whether the film is lost: maps find its time, and figures dim what comes after."""

    needs_springs: ClassVar[bool] = False
    """Whether the signal depends on the viscous stretches."""

    found_in_jumps: ClassVar[bool] = True
    """Whether it is looked for on the way to a voltage applied at once that the film cannot hold."""

    ends_equilibria: ClassVar[bool] = False
    """Whether it happens where such a way ends, as there is no equilibrium beyond."""

    def signal(self, films: WatchedFilms) -> Signal | None:
        """The signal of these films, None where it cannot happen to any of them, or where it has a rate."""
        return None

    def rate(self, films: WatchedFilms) -> Signal | None:
        """Of a criterion without signal: the rate (k,) in 1/s, at least 0, whose integral over time comes to 1 when it happens."""
        return None

    def concerns(self, materials: Sequence[Material]) -> bool:
        """Whether films of these materials may fail so: maps of others have no column of it."""
        return True

    def refined(self, films: WatchedFilms, time: Floats, moment: Moment, load: Load) -> tuple[Floats, Moment]:
        """The `time` (k,) since a span of `load` began and the moment at which the signal of `films` was found to vanish, more
        exactly.
        """
        return time, moment

    def determinant(self, stability: Stability) -> Floats:
        """The pull-in determinant (k,) of an event at this stability."""
        return stability.determinant
