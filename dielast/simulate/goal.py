"""The goals of films under a constant voltage, and an estimate of the voltage that reaches them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.simulate.film_grid import Group, axis_of

WAY = (0.1, 0.25, 0.5, 0.75, 1.0)  # fractions of the logarithm of the stretch at the goal
RELATIVE_STRETCH, AREA_STRAIN = "relative_stretch", "area_strain"


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """A `target` (films,) to reach `at` a time in s after a constant voltage is applied.

    `name` says what the target is: a relative stretch of axis 1 (relative to the prestretch), or an area strain of the active part
    (relative to its prestretched area).
    """

    name: str
    target: Floats
    at: float

    @classmethod
    def of(cls, at: float, relative_stretch: ArrayLike | None, area_strain: ArrayLike | None) -> Goal:
        """The goals from the arguments of `design`; `InputError` unless exactly one kind is stated, with possible values."""
        if (relative_stretch is None) == (area_strain is None):
            raise InputError("either a relative_stretch or an area_strain is needed", argument="goal")
        name, stated = (RELATIVE_STRETCH, relative_stretch) if area_strain is None else (AREA_STRAIN, area_strain)
        assert stated is not None
        target = axis_of(stated, name)
        if name == RELATIVE_STRETCH and np.any(target <= 1):
            wrong = float(target.min())
            raise InputError(f"{wrong:g}: a relative stretch above 1 is needed, such as 1.1", argument=name)
        if np.any(target <= 0):
            wrong = float(target.min())
            raise InputError(f"{wrong:g}: an area strain above 0 is needed, such as 0.2 for 20 %", argument=name)
        if not (np.isfinite(at) and at > 0):
            raise InputError(f"{at:g} s: it must be positive", argument="at")
        return cls(name, target, at)

    def take(self, films: Cases) -> Goal:
        """The goals of the selected films (k,)."""
        return replace(self, target=self.target[films])

    @property
    def size(self) -> Floats:
        """The logarithm (films,) of the relative stretch or area at the goals."""
        return np.asarray(np.log(self.target) if self.name == RELATIVE_STRETCH else np.log1p(self.target))

    def missed(self, stretch: Floats) -> Floats:
        """The logarithmic distance (films,) of relative stretches (2, films) from the goals, negative short of them."""
        return np.asarray(np.log(stretch[0] if self.name == RELATIVE_STRETCH else stretch[0] * stretch[1]) - self.size)

    def reached(self, missed: Floats) -> Floats:
        """The relative stretch or the area strain (films,) at the logarithmic distance `missed` (films,) from the goals."""
        return np.asarray(np.exp(self.size + missed) if self.name == RELATIVE_STRETCH else np.expm1(self.size + missed))

    def steps(self, controls: Controls) -> Floats:
        """Estimated relative stretches (2, films) of both axes at the goals; `InputError` if the boundary excludes the goal."""
        held = [control is Control.STRETCH for control in controls]
        if all(held):
            raise InputError("both axes are clamped: no voltage moves the film", argument="boundary")
        if held[0] and self.name == RELATIVE_STRETCH:
            raise InputError("axis 1 is clamped: state an area_strain instead", argument=RELATIVE_STRETCH)
        stretch = np.exp(self.size / (1 if self.name == RELATIVE_STRETCH or any(held) else 2))
        return np.stack([np.ones_like(stretch) if clamped else stretch for clamped in held])


def voltage_about(group: Group, goal: Goal) -> tuple[Floats, Flags]:
    """Estimates of the voltage (films,) in V that takes the films of a group to their goals, and whether (films,) a goal is beyond
    the limit of the equilibrium spring.

    Quasi-elastic approximation: the modulus of each spring is reduced to exp(-t/tau) at the time t of the goal, and its viscous
    stretch is that after the prestretch. The estimate is the largest voltage that equilibrium needs on the way. A passive part is
    neglected.
    """
    film = group.film
    points, present = film.points, film.log_squared_stretch
    internal = film.internal if film.assembly is None else 2 * np.log(film.internal[:, :, 0])
    held = points.modulus * np.exp(-3 * points.rate * goal.at)
    steps = goal.steps(group.watched.controls)
    squared_field = np.zeros(steps.shape[1])
    with np.errstate(all="ignore"):
        before = _carried(group, held, internal, present)
        for part in WAY:
            stretch_on_way = steps**part
            moved = present + 2 * np.log(stretch_on_way)
            needed = np.max(np.where(steps > 1, _carried(group, held, internal, moved) - before * stretch_on_way, -np.inf), axis=0)
            # where this estimate fails, use the field whose Maxwell stress is of the order of the moduli
            needed = np.where(np.isfinite(needed) & (needed > 0), needed, held.sum(axis=0) * goal.size * part)
            squared_field = np.maximum(squared_field, np.exp(-moved.sum(axis=0)) * needed / points.permittivity_at(moved))
        squared = np.repeat(np.exp(moved)[:, None], points.modulus.shape[0], axis=1)
        return np.asarray(group.thickness * np.sqrt(squared_field)), np.asarray(points.law.margin(squared)[0] <= 0)


def _carried(group: Group, held: Floats, internal: Floats, log_squared_stretch: Floats) -> Floats:
    """True stresses (2, films) in Pa of springs with moduli `held` (springs, films), at Lambda (2, films)."""
    points = group.film.points
    stress = points.law.stress(points.springs(internal, log_squared_stretch))
    carried: Floats = np.einsum("nm,cnm->cm", held, stress)
    return carried
