"""The state of films in a history of load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.material.springs import Symmetry
from dielast.mechanics.charged import ChargedPoints
from dielast.mechanics.criteria.criterion import FilmSnapshot
from dielast.mechanics.electric import FIELD, Drive, FilmCircuit
from dielast.mechanics.equations import Films
from dielast.mechanics.passive.framed import Assembly, FramedFilms, Surroundings
from dielast.mechanics.passive.structure import Structure
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Controls, Load, stretch_prescribed
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class FilmState(ByCase):
    """The state of films: x (2, n, cases), Lambda and nominal stress (2, cases), the `electrical` quantity that acts on them and
    the `time` (cases,), and the `next_step` (cases,) in s that the stepper proposes if the load goes on smoothly, 0 for no
    proposal. All films keep the `symmetry`, or None.

    The electrical quantity is the nominal field in V/m, or, if the charge is prescribed or an unknown, the nominal charge density
    in C/m^2; in a circuit, `source` (cases,) is the value of the source; `wires`, the circuit for all drives, let the `drive` of
    the electrodes change. For films with a passive part, these are quantities of the active part, except that `internal` is the
    viscous stretches xi (2, n, P, cases) of all points; `border` (u + 2, cases) is the border of their state, and `assembly` holds
    all points. Specimens that may be slack have `slack` (cases,), and `grips` (cases,), the distance of their grips as a stretch.
    """

    points: PointMaterial
    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    electrical: Floats
    time: Floats
    next_step: Floats
    symmetry: Symmetry | None = None
    source: Floats | None = None
    border: Floats | None = None
    assembly: Assembly | None = None
    wires: FilmCircuit | None = None
    drive: Drive = Drive.VOLTAGE
    slack: Flags | None = None
    grips: Floats | None = None

    @classmethod
    def at_rest(cls, points: PointMaterial, symmetry: Symmetry | None) -> FilmState:
        """Undeformed and relaxed films at time 0."""
        springs, cases = points.modulus.shape
        axes, single = np.zeros((2, cases)), np.zeros(cases)
        return cls(points, np.zeros((2, springs, cases)), axes, axes, single, single, single, symmetry)

    def copied(self) -> FilmState:
        """The same films, with arrays of the state that may be changed."""
        names = ("internal", "log_squared_stretch", "nominal_stress", "electrical", "border")
        arrays = {name: getattr(self, name) for name in names}
        return replace(self, **{name: array.copy() for name, array in arrays.items() if array is not None})

    def under(self, drive: Drive | None) -> FilmState:
        """The same films under another drive of their electrodes, with their charge; the source then has the voltage of the films.
        None stands for the present drive.
        """
        if drive is None or self.wires is None or drive is self.drive:
            return self
        field, charge = self.points.nominal(self.log_squared_stretch, self.electrical)
        points = replace(self.points, electric=self.wires.acting(drive), circuit=self.wires.under(drive))
        acting = field if points.electric == FIELD else charge
        source = None if points.circuit is None else field if drive is Drive.VOLTAGE else charge
        return replace(self, points=points, drive=drive, electrical=acting, source=source)

    def apart(self) -> FilmState:
        """The springs of homogeneous films as films of one spring each, spring after spring."""
        springs, cases = self.points.modulus.shape
        single = replace(self, points=self.points.without_springs(), internal=self.internal[:, :0])
        single = single.take(np.tile(np.arange(cases), springs))
        return replace(single, points=self.points.apart(), internal=self.internal.reshape(2, 1, -1))

    def together(self, apart: FilmState) -> FilmState:
        """These films, their springs and stretches those of films of one spring each (`apart`), which move together."""
        internal = apart.internal.reshape(self.internal.shape)
        log_squared = apart.log_squared_stretch[:, : self.time.size]
        with np.errstate(all="ignore"):  # a spring that has locked
            stress = self.points.law.stress(self.points.springs(internal, log_squared))
        carried = np.einsum("nm,cnm->cm", self.points.modulus, stress)
        nominal = carried / np.exp(0.5 * log_squared)
        return replace(self, internal=internal, log_squared_stretch=log_squared, nominal_stress=nominal)

    def framed(self, structure: Structure) -> FilmState:
        """These homogeneous films, divided into the active and the passive part of a structure."""
        internal = np.repeat(np.exp(0.5 * self.internal)[:, :, None], structure.points, axis=2)
        border = np.concatenate((structure.home, self.nominal_stress))
        assembly = Assembly.of(self.points, structure)
        return replace(self, internal=internal, border=border, symmetry=None, assembly=assembly)

    def prescribed(self, controls: Controls) -> Floats:
        """The present values (3, cases) of the quantities that a load with these controls prescribes."""
        return self._values(controls, self.electrical if self.source is None else self.source)

    def acting(self, controls: Controls) -> Floats:
        """As `prescribed`, with the electrical quantity that acts on the films: in a circuit their charge, not the source."""
        return self._values(controls, self.electrical)

    def _values(self, controls: Controls, electrical: Floats) -> Floats:
        stress = self.nominal_stress
        if self.points.edges is not None:
            stress = stress + self.points.edges.borne(self.log_squared_stretch)
        values = np.where(stretch_prescribed(controls), np.exp(0.5 * self.log_squared_stretch), stress)
        if self.slack is not None and controls[0] is Control.STRETCH:
            values[0] = np.where(self.slack, self.grips, values[0])
        return np.concatenate((values, electrical[None]))

    def equations(self, load: Load) -> Films:
        """The equations of all films under a span of load."""
        if self.assembly is not None:
            return FramedFilms(self.assembly, load)
        form = LoadedPoints if self.points.circuit is None else ChargedPoints
        slack = self.slack if load.controls[0] is Control.STRETCH else None
        return form(self.points, load, self.symmetry, slack)

    def state(self, equations: Films) -> Floats:
        """The state (rows, cases) of the stepper."""
        if isinstance(equations, FramedFilms):
            assert self.border is not None
            return equations.pack(self.internal, self.border)
        if isinstance(equations, ChargedPoints):
            return equations.pack(self.internal, self.log_squared_stretch, self.electrical)
        return equations.pack(self.internal, self.log_squared_stretch)

    def reached(self, equations: Films, state: Floats, driven: Floats, time: Floats, next_step: Floats) -> FilmState:
        """The films in a new `state` (rows, cases) at `time` (cases,) in s, under the prescribed values `driven` (3, cases)."""
        acting, source = (driven[2], None) if self.points.circuit is None else (state[equations.border], driven[2])
        log_squared, nominal = equations.membrane(state, np.stack((driven[0], driven[1], acting)))
        border = state[equations.border :] if isinstance(equations, FramedFilms) else None
        now = self.points, equations.internal(state), log_squared, nominal, acting, time, next_step
        return FilmState(*now, self.symmetry, source, border, self.assembly, self.wires, self.drive, self.slack, driven[0])

    def snapshot(self, controls: Controls, cases: Cases, age: Floats) -> FilmSnapshot:
        """The films as criteria see them; they are the `cases` (k,), and the voltage has been on for `age` (k,) s."""
        surroundings = None if self.assembly is None or self.border is None else Surroundings(self.assembly, self.border)
        membrane = self.log_squared_stretch, self.nominal_stress
        return FilmSnapshot(self.points, controls, cases, age, self.internal, *membrane, self.electrical, surroundings)
