"""The state of films in a history of load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.mechanics.charged import ChargedPoints, ChargedSymmetricPoints
from dielast.mechanics.criteria.criterion import Moment
from dielast.mechanics.passive.framed import Assembly, FramedFilms, Surroundings
from dielast.mechanics.passive.structure import Structure
from dielast.mechanics.point import LoadedPoints, Points
from dielast.mechanics.span import Controls, Load, stretched
from dielast.mechanics.symmetric import Films, SymmetricPoints, Symmetry
from dielast.numerics.columns import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """The state of all cases: x (2, n, cases), Lambda and nominal stress (2, cases), nominal `field` and `time` (cases,), and the
    `next_step` (cases,) in s that the stepper proposes if the load goes on smoothly, 0 for no proposal.

    If the charge is prescribed or an unknown, `field` is the nominal charge density in C/m^2; in a circuit, `source` (cases,) is
    the value of the source. For films with a passive part, these are quantities of the active part, except that `internal` is the
    viscous stretches xi (2, n, P, cases) of all points; `border` (u + 2, cases) is the border of their state.
    """

    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    field: Floats
    time: Floats
    next_step: Floats
    source: Floats | None = None
    border: Floats | None = None

    def take(self, cases: Cases) -> Condition:
        """The selected cases (k,)."""
        strained = self.internal[..., cases], self.log_squared_stretch[:, cases], self.nominal_stress[:, cases]
        source = None if self.source is None else self.source[cases]
        border = None if self.border is None else self.border[:, cases]
        return Condition(*strained, self.field[cases], self.time[cases], self.next_step[cases], source, border)

    def prescribed(self, controls: Controls) -> Floats:
        """The present values (3, cases) of the quantities that a load with these controls prescribes."""
        return self._values(controls, self.field if self.source is None else self.source)

    def acting(self, controls: Controls) -> Floats:
        """As `prescribed`, with the electrical quantity that acts on the films: in a circuit their charge, not the source."""
        return self._values(controls, self.field)

    def _values(self, controls: Controls, electrical: Floats) -> Floats:
        values = np.where(stretched(controls), np.exp(0.5 * self.log_squared_stretch), self.nominal_stress)
        return np.concatenate((values, electrical[None]))


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """Films in a `condition`, which all keep the `symmetry`, or None. If they have a passive part, `assembly` holds all points."""

    points: Points
    condition: Condition
    symmetry: Symmetry | None = None
    assembly: Assembly | None = None

    @classmethod
    def at_rest(cls, points: Points, symmetry: Symmetry | None) -> Film:
        """Undeformed and relaxed films at time 0."""
        springs, cases = points.rate.shape
        return cls(points, Condition(np.zeros((2, springs, cases)), *np.zeros((2, 2, cases)), *np.zeros((3, cases))), symmetry)

    def take(self, cases: Cases) -> Film:
        """The selected cases (k,)."""
        assembly = None if self.assembly is None else self.assembly.take(cases)
        return Film(self.points.take(cases), self.condition.take(cases), self.symmetry, assembly)

    def framed(self, structure: Structure) -> Film:
        """These homogeneous films, divided into the active and the passive part of a structure."""
        now, assembly = self.condition, Assembly.of(self.points, structure)
        internal = np.repeat(np.exp(0.5 * now.internal)[:, :, None], structure.points, axis=2)
        border = np.concatenate((structure.home, now.nominal_stress))
        return Film(self.points, replace(now, internal=internal, border=border), None, assembly)

    def equations(self, load: Load) -> Films:
        """The equations of all films under a span of load."""
        if self.assembly is not None:
            return FramedFilms(self.assembly, load)
        if self.points.circuit is not None:
            if self.symmetry is None:
                return ChargedPoints(self.points, load)
            return ChargedSymmetricPoints(self.points, load, self.symmetry)
        return LoadedPoints(self.points, load) if self.symmetry is None else SymmetricPoints(self.points, load, self.symmetry)

    def state(self, equations: Films) -> Floats:
        """The state (rows, cases) of the stepper for this condition."""
        now = self.condition
        if isinstance(equations, FramedFilms):
            assert now.border is not None
            return equations.pack(now.internal, now.border)
        membrane = now.internal, now.log_squared_stretch, now.nominal_stress
        if isinstance(equations, ChargedPoints | ChargedSymmetricPoints):
            return equations.pack(*membrane, now.field)
        return equations.pack(*membrane)

    def reached(self, equations: Films, state: Floats, driven: Floats, time: Floats, next_step: Floats) -> Film:
        """The films in a new `state` (rows, cases) at `time` (cases,) in s, under the prescribed values `driven` (3, cases)."""
        border = state[equations.border :] if isinstance(equations, FramedFilms) else None
        membrane = equations.membrane(state, driven)
        acting, source = (driven[2], None) if self.points.circuit is None else (state[equations.border], driven[2])
        return replace(self, condition=Condition(equations.internal(state), *membrane, acting, time, next_step, source, border))

    def moment(self, controls: Controls, cases: Cases, age: Floats) -> Moment:
        """The films as a moment for criteria; they are the `cases` (k,), and the voltage has been on for `age` (k,) s."""
        now = self.condition
        surroundings = None if self.assembly is None or now.border is None else Surroundings(self.assembly, now.border)
        membrane = now.log_squared_stretch, now.nominal_stress
        return Moment(self.points, controls, cases, age, now.internal, *membrane, now.field, surroundings)
