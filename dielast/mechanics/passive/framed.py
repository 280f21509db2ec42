"""Films with an active and a passive part, as systems for the stepper: the equations of `point` at every point of a `Structure`.

The state of one film is a column: the viscous stretches xi_i of the n springs at all P points (axis 1 then axis 2, springs,
points), followed by the border. The border is the u unknowns of the structure, the nominal stress s_1 of the active part, and the
transverse nominal stress that may be the first to fall to zero: s_2 of the active part of a strip, that of the annulus at the rim
of a disc. The equations, again of index 1, are

    d ln xi_i/dt = (2p - q, 2q - p)_i / (6 tau)             for each spring at each point (`flow`),
    0 = F_j(u, xi, E~)                                      for each unknown (`structure`),
    0 = s_1 - dW/dl_1 at the active part, and the same for the other stress.

Here the state holds xi, not ln xi. The springs of fast branches are relaxed, xi = l, and l is linear in u; so they stay relaxed in
every linear combination of states. With ln xi they would not, and the stiffest springs would respond with large stresses.

The springs of a point are eliminated as in `point`. The resulting 2x2 tangent of each point is assembled into the small tangent of
the structure. The nominal field acts on the active part.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.elimination import Eliminated
from dielast.mechanics.passive.structure import Structure, inverse, rim_stiffness
from dielast.mechanics.point import FOLLOWER_WEIGHT
from dielast.mechanics.point_material import SYMMETRIC, PointMaterial
from dielast.mechanics.span import Control, Controls, Load, UnderLoad
from dielast.numerics.arrays import ByCase, Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """The `points` of the active parts (n springs, cases), `all_points` (n, P cases) point after point, and the `structure` that
    couples them. Arrays over the points are (..., P, cases).
    """

    points: PointMaterial
    all_points: PointMaterial
    structure: Structure
    stress_floor: Floats = field(init=False)
    """The size (cases,) in Pa of stresses by which errors are measured: the rounding error of the stress of the stiffest spring,
    the damper, bounds the accuracy of every stress.
    """

    def __post_init__(self) -> None:
        modulus = self.points.modulus
        with np.errstate(all="ignore"):
            floor = modulus[0] + self.points.stress_floor * (modulus.sum(axis=0) / modulus[:-1].sum(axis=0))
        object.__setattr__(self, "stress_floor", floor)

    @classmethod
    def of(cls, points: PointMaterial, structure: Structure) -> Assembly:
        """Films of one material throughout."""
        return cls(points, points.take(np.tile(np.arange(points.stress_floor.size), structure.points)), structure)

    def take(self, cases: Cases) -> Assembly:
        """The selected cases (k,)."""
        wide = self.all_points.take(self.structure.columns(cases))
        return Assembly(self.points.take(cases), wide, self.structure.take(cases))

    def wide(self, narrow: Floats) -> Floats:
        """Values of the cases (..., cases), repeated for all points (..., P cases)."""
        return np.concatenate([narrow] * self.structure.points, axis=-1)

    def by_point(self, values: Floats) -> Floats:
        """Values (..., P cases) as (..., P, cases)."""
        return values.reshape(*values.shape[:-1], self.structure.points, -1)

    def springs(self, viscous: Floats, stretch: Floats) -> Floats:
        """Squared elastic stretches (2, n, P cases) at xi (2, n, P, cases) or (2, n, P cases) and stretches (2, P, cases)."""
        elastic = stretch.reshape(2, 1, -1) / viscous.reshape(2, viscous.shape[1], -1)
        elastic *= elastic
        return np.asarray(elastic)

    def maxwell_stress(self, stretch: Floats, field: Floats) -> Floats:
        """The Maxwell stress (2, cases), or (1, cases) if both are equal, of point 0 at stretches (2, P, cases)."""
        return self.points.maxwell_stress(2 * np.log(stretch[:, 0]), field)

    def maxwell_tangent(self, stretch: Floats, field: Floats) -> tuple[Floats, Floats, Floats]:
        """The same with its derivatives, as by `PointMaterial.maxwell_tangent`."""
        return self.points.maxwell_tangent(2 * np.log(stretch[:, 0]), field)

    def carried(self, stress: Floats, maxwell: Floats | None) -> Floats:
        """True mechanical stresses (2, P, cases): those of springs, of unit modulus (2, n, P cases), less the Maxwell stress
        (2, cases) in point 0.
        """
        carried = self.by_point(np.einsum("nm,cnm->cm", self.all_points.modulus, stress))
        if maxwell is not None:
            carried[:, 0] -= maxwell
        return carried

    def slope(self, half: Floats, stretch: Floats, carried: Floats | None = None, maxwell: Floats | None = None) -> Floats:
        """ds_i/dl_j (2, 2, P, cases): from `half` (2, 2, P cases), the tangent of all springs together in Lambda, and the terms of
        the true mechanical stress `carried` (2, P, cases) and of the Maxwell stress, whose derivative (2, 2, cases) is in Lambda.
        """
        slope = self.by_point(half)
        if carried is not None:
            slope = slope.copy()
            slope[0, 0] -= 0.5 * carried[0]
            slope[1, 1] -= 0.5 * carried[1]
            if maxwell is not None:
                slope[:, :, 0] -= maxwell
        return np.asarray(slope * (2 / (stretch[:, None] * stretch)))


@dataclass(frozen=True, slots=True, eq=False)
class FramedFilms(UnderLoad):
    """Films in one smooth span of load: the system that the stepper integrates."""

    assembly: Assembly
    load: Load

    @property
    def points(self) -> PointMaterial:
        """The points of the active parts."""
        return self.assembly.points

    @property
    def border(self) -> int:
        """Index of the first row of the border, counted from the end of the state."""
        return -self.assembly.structure.unknowns - 2

    @property
    def of_membrane(self) -> slice:
        """The rows of a state on which the membrane depends."""
        return slice(self.border, None)

    def pack(self, internal: Floats, border: Floats) -> Floats:
        """State (rows, cases) from xi (2, n, P, cases) and the border (u + 2, cases)."""
        return np.concatenate((internal.reshape(-1, internal.shape[-1]), border))

    def internal(self, state: Floats) -> Floats:
        """xi (2, n, P, cases) of a state."""
        return state[: self.border].reshape(2, -1, self.assembly.structure.points, state.shape[1])

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress of the active part, both (2, cases), of a `state` under the prescribed values `driven`
        (3, cases).
        """
        return membrane(state[self.border :], driven, self.load.controls)

    def error(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """Largest relative error (cases,) of stretches, stresses and viscous stretches due to an `increment` of the `state`."""
        structure = self.assembly.structure
        worst = np.max(np.abs(increment[: self.border] / state[: self.border]), axis=0)
        stretch = structure.stretch(state[self.border : -2])
        change = np.max(np.abs(structure.moved(increment[self.border : -2]) / stretch), axis=(0, 1))
        worst = np.maximum(worst, np.where(self.load.moving, FOLLOWER_WEIGHT, 1.0) * change)
        stress = np.max(np.abs(increment[-2:]) / (np.abs(state[-2:]) + self.assembly.stress_floor), axis=0)
        return np.asarray(np.maximum(worst, FOLLOWER_WEIGHT * stress))

    def linearise(self, times: Floats, state: Floats, step: Floats, gamma: float) -> FramedArrowhead:
        """The linear system of a step (cases,) in s from `state`, whose stages are at `times` (stages, cases)."""
        return FramedArrowhead(self, times, state, step, gamma)


def membrane(border: Floats, driven: Floats, controls: Controls) -> tuple[Floats, Floats]:
    """Lambda and the nominal stress, both (2, cases), of the active part of films with this border (u + 2, cases)."""
    first = 2 * np.log(border[0])
    if controls[1] is Control.STRETCH:
        return np.stack((first, 2 * np.log(driven[1]))), border[-2:].copy()
    return np.stack((first, first)), np.stack((border[-2], border[-2]))


class FramedArrowhead:
    """The linear system of one step, factorised; its cost is linear in the numbers of springs and of points.

    With phi = 2 d ln xi/dt and its derivative G in the stress (`flow`), v = 2 u_xi/xi and w = 2 u_l/l, the equations of a spring
    are (c + h G K) v = right + h G K w with the diagonal c = 1/gamma - h phi/2. So v = w + D^-1 (right - c w) with D the matrix on
    the left, and the contribution of the spring to the stress is mu Q (c w - right), Q = K D^-1. What is kept is scaled so that
    xi right/2 takes the place of `right`, and u_xi that of v.
    """

    def __init__(self, system: FramedFilms, times: Floats, state: Floats, step: Floats, gamma: float) -> None:
        self.assembly, self.border = system.assembly, system.border
        assembly, load, structure = self.assembly, system.load, system.assembly.structure
        wide = assembly.all_points
        self.electric, self.field = load.electric, load.values(times)[:, ELECTRIC]
        self.stretch = stretch = structure.stretch(state[self.border : -2])
        self.viscous = viscous = state[: self.border].reshape(2, len(wide.modulus), -1)
        self.stress, tangent = wide.law.tangent(assembly.springs(viscous, stretch))
        flow = wide.flow.over(assembly.wide(step))
        self.half_flow = flow.of_fluidity(0.5 * flow.fluidity)
        self.rate = self.half_flow.rate(self.stress)
        hold = 1 / gamma - self.rate
        self.springs = Eliminated.of(tangent, flow.mobility(self.stress), hold).scaled(viscous)
        self.held = np.multiply(hold, viscous, out=hold)
        self.share = self.springs.share
        self.share *= 2 * wide.modulus / viscous
        half = 0.5 * np.einsum("abnm,bnm->abm", self.share, self.held)
        maxwell = by_stretch = self.load_term = None
        if load.electric:
            maxwell, by_stretch, by_load = assembly.maxwell_tangent(stretch, self.field[0])
            self.load_term = by_load * (step * load.slope(times[0])[ELECTRIC]) / stretch[:, 0]
        carried = assembly.carried(self.stress, maxwell)
        self.nominal = carried / stretch
        pushed = structure.pushed(assembly.slope(half, stretch, carried, by_stretch))
        inward = np.einsum("uvc,apvc->uapc", inverse(structure.assembled(pushed)), -structure.weighted)
        self.inward = np.concatenate((inward, structure.watched)).reshape(-1, 2 * structure.points, step.size)
        moved = structure.gather / stretch[:, :, None]
        self.outward = np.concatenate((structure.border(pushed), moved.reshape(-1, *moved.shape[2:])))

    def increment(self, stage: int, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i of a stage at `state`, in `out`; `history` is sum_j c_ij u_j, None in the first stage."""
        assembly, border = self.assembly, self.border
        if history is None:
            nominal, right = self.nominal, self.rate * self.viscous
        else:
            stretch = assembly.structure.stretch(state[border:-2])
            viscous = state[:border].reshape(self.viscous.shape)
            stress = assembly.all_points.law.stress(assembly.springs(viscous, stretch))
            nominal = assembly.carried(stress, assembly.maxwell_stress(stretch, self.field[stage]) if self.electric else None)
            nominal /= stretch
            right = self.half_flow.rate(stress)
            right *= viscous
            right += history[:border].reshape(right.shape)
        nominal = nominal - assembly.by_point(np.einsum("abnm,bnm->am", self.share, right)) / self.stretch
        if gamma_i and self.load_term is not None:
            nominal[:, 0] -= gamma_i * self.load_term
        # the unknowns and what the present stresses add to those of the border, and then what follows the unknowns
        unknown = np.einsum("kqc,qc->kc", self.inward, nominal.reshape(-1, nominal.shape[-1]), out=out[border:])
        follows = np.einsum("kuc,uc->kc", self.outward, unknown[:-2])
        unknown[-2:] += follows[:2]
        unknown[-2:] -= state[-2:]
        change = follows[2:].reshape(2, 1, -1)
        right -= self.held * change
        assert out.flags.c_contiguous  # otherwise `reshape` copies, and the increments of the springs are lost
        internal = out[:border].reshape(right.shape)
        self.springs.solve(right, out=internal)
        internal += self.viscous * change
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings(ByCase):
    """All points of films with a passive part at a moment, and the `border` (u + 2, k) of their states."""

    assembly: Assembly
    border: Floats

    @property
    def tension(self) -> Floats:
        """The nominal stresses (2, k) in Pa, longitudinal and transverse, that may fall to zero."""
        return self.border[-2:]

    def stretch(self) -> Floats:
        """Stretches (2, P, k)."""
        return self.assembly.structure.stretch(self.border[:-2])

    def without_damper(self) -> Surroundings:
        """The films without stress in the last spring, the damper."""
        return replace(self, assembly=replace(self.assembly, all_points=self.assembly.all_points.undamped()))

    def stresses(self, internal: Floats, field: Floats) -> Floats:
        """Nominal stresses (2, P, k) in Pa at xi (2, n, P, k)."""
        assembly, stretch = self.assembly, self.stretch()
        stress = assembly.all_points.law.stress(assembly.springs(internal, stretch))
        return assembly.carried(stress, assembly.maxwell_stress(stretch, field)) / stretch

    def stiffness(self, watched: Floats, internal: Floats, field: Floats) -> tuple[Floats, Floats]:
        """The stiffness (k,) in Pa of the whole film at the rim of the active part, and the stiffness of its springs alone, if they
        are `watched` for a time (k,) in s.
        """
        assembly, stretch, structure = self.assembly, self.stretch(), self.assembly.structure
        stress, half = assembly.all_points.law.tangent(assembly.springs(internal, stretch))
        held = assembly.all_points.retained(assembly.wide(watched), lambda: stress)
        spring_tangent = np.einsum("nm,cnm->cm", held, half)[SYMMETRIC]
        maxwell, by_stretch, _ = assembly.maxwell_tangent(stretch, field)
        carried = assembly.carried(stress, maxwell)
        slopes = np.empty((2, 2, 2, *carried.shape[1:]))
        slopes[0] = assembly.slope(spring_tangent, stretch, carried, by_stretch)
        slopes[1] = assembly.slope(spring_tangent, stretch)
        rim, alone = rim_stiffness(structure.tangent(slopes).transpose(1, 2, 0, 3))
        return rim, alone
