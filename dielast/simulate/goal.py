"""What films are to reach under a constant voltage, and about which voltage that takes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.mechanics.span import Control, Controls
from dielast.numerics.columns import Cases, Flags, Floats
from dielast.simulate.film_grid import Group, axis_of

WAY = (0.1, 0.25, 0.5, 0.75, 1.0)  # of the logarithm of the stretch to the goal
RELATIVE_STRETCH, AREA_STRAIN = "relative_stretch", "area_strain"


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """Films (films,) are to reach a `target` (films,) `at` a time in s after a constant voltage came: a relative stretch of axis 1,
    the stretch over that after the prestretch; or an area strain of the active part, over its prestretched area.
    """

    name: str
    target: Floats
    at: float

    @classmethod
    def of(cls, at: float, relative_stretch: ArrayLike | None, area_strain: ArrayLike | None) -> Goal:
        """The goals that arguments state; `InputError` for what cannot be one."""
        if (relative_stretch is None) == (area_strain is None):
            raise InputError("either a relative_stretch or an area_strain is needed", argument="goal")
        name, stated = (RELATIVE_STRETCH, relative_stretch) if area_strain is None else (AREA_STRAIN, area_strain)
        assert stated is not None
        target = axis_of(stated, name, "design")
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
        """Those of some of the films."""
        return replace(self, target=self.target[films])

    @property
    def size(self) -> Floats:
        """The way to the goals (films,), as a logarithm."""
        return np.asarray(np.log(self.target) if self.name == RELATIVE_STRETCH else np.log1p(self.target))

    def missed(self, stretch: Floats) -> Floats:
        """How far relative stretches (2, films) are beyond the goals (films,), as a logarithm; below 0 short of them."""
        return np.asarray(np.log(stretch[0] if self.name == RELATIVE_STRETCH else stretch[0] * stretch[1]) - self.size)

    def reached(self, missed: Floats) -> Floats:
        """The relative stretch, or the area strain (films,), of films that miss their goals by so much."""
        return np.asarray(np.exp(self.size + missed) if self.name == RELATIVE_STRETCH else np.expm1(self.size + missed))

    def steps(self, controls: Controls) -> Floats:
        """About which relative stretches (2, films) of the axes the goals are at; `InputError` for what cannot move."""
        held = [control is Control.STRETCH for control in controls]
        if all(held):
            raise InputError("both axes are clamped: no voltage moves the film", argument="boundary")
        if held[0] and self.name == RELATIVE_STRETCH:
            raise InputError("axis 1 is clamped: state an area_strain instead", argument=RELATIVE_STRETCH)
        whole = np.exp(self.size / (1 if self.name == RELATIVE_STRETCH or any(held) else 2))
        return np.stack([np.ones_like(whole) if clamped else whole for clamped in held])


def voltage_about(group: Group, goal: Goal, controls: Controls) -> tuple[Floats, Flags]:
    """About which voltage (films,) in V takes the films of a group to their goals, and which of these (films,) are beyond the limit
    of the equilibrium spring.

    It holds the springs there, each weakened to exp(-t/tau) of its modulus by the time t of the goal and its viscous stretch as
    after the prestretch (quasi-elastic approximation), and takes the largest voltage on the way; a passive part is left out.
    """
    film = group.film
    now, points = film.condition, film.points
    internal = now.internal if film.assembly is None else 2 * np.log(now.internal[:, :, 0])
    held = points.modulus * np.exp(-3 * points.rate * goal.at)
    steps = goal.steps(controls)
    rigid = np.zeros(steps.shape[1])
    with np.errstate(all="ignore"):
        before = _carried(group, held, internal, now.log_squared_stretch)
        for part in WAY:
            way = steps**part
            moved = now.log_squared_stretch + 2 * np.log(way)
            more = np.max(np.where(steps > 1, _carried(group, held, internal, moved) - before * way, -np.inf), axis=0)
            # of a film that this tells nothing about, the field that balances its moduli
            more = np.where(np.isfinite(more) & (more > 0), more, held.sum(axis=0) * goal.size * part)
            rigid = np.maximum(rigid, np.exp(-moved.sum(axis=0)) * more / points.permittivity_at(moved))
        squared = np.repeat(np.exp(moved)[:, None], points.modulus.shape[0], axis=1)
        return np.asarray(group.thickness * np.sqrt(rigid)), np.asarray(points.law.room(squared)[0] <= 0)


def _carried(group: Group, held: Floats, internal: Floats, log_squared_stretch: Floats) -> Floats:
    """True stresses (2, films) in Pa of the springs, of moduli `held` (springs, films), at these Lambda (2, films)."""
    points = group.film.points
    stress = points.law.stress(points.springs(internal, log_squared_stretch))
    carried: Floats = np.einsum("nm,cnm->cm", held, stress)
    return carried
