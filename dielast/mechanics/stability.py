"""Pull-in: when a film under voltage ceases to be in stable equilibrium (Eqs. 9 and 10 of DOI 10.1115/1.4030850).

The 3x3 Hessian of the free energy in (lambda_1, lambda_2, D~), with D~ the nominal charge density, is singular where the 2x2
tangent ds_i/dlambda_j at fixed nominal field V/L_3 is: its determinant is that of the tangent times d2W/dD~2 = 1/(eps lambda_1^2
lambda_2^2). A clamped axis drops out of the determinant. In logarithmic stretches the tangent is

    T_ij = sum mu K_ij - 2 dm_i/dLambda_j - s_i lambda_i delta_ij,    ds_i/dlambda_j = T_ij / (lambda_i lambda_j),

to which a spring of stiffness k at an edge adds k lambda_i^2 delta_ij, with m the Maxwell stress (`electric`); dm_i/dLambda_j =
eps E^2 if the permittivity does not depend on stretch.

Eq. 9 takes every branch as frozen. If a disturbance is watched for a time theta, a branch retains exp(-theta/tau) of its stiffness
(`flow`).

Under a prescribed charge, the tangent is that at fixed charge, and a film of constant permittivity never pulls in. In a circuit,
charge flows while the film is watched. Behind a source with a resistance, the charge is constant for theta far below the time
constant r C of the circuit, and the voltage is constant for theta far above it, where the film pulls in as it would without a
resistance (`electric`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.springs import EQUIBIAXIAL
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, stretch_prescribed
from dielast.numerics.arrays import Floats

FOLD_STEPS, FOLD_REACH = 6, 1e-2  # number of Newton steps to a fold, and its largest relative distance from the start
DAMPER_MODULUS_RATIO = 1e4  # modulus of the damper over that of the equilibrium spring
DAMPER_TIME_RATIO = 1e-12  # relaxation time of the damper over the shortest one of the film
# 1/s; the rate of the damper is based on at least this rate, so that it is fast compared with the load even if no branch is
SLOWEST_RATE = 1e4


@checked
@dataclass(frozen=True, slots=True)
class TimeScale:
    """The time theta for which a disturbance is watched: `share` times the time since the voltage began to rise, plus `seconds`.

    Raises `InputError` unless both are finite and not negative. For the clock of the share see `watch.VoltageClock`.
    """

    share: float = 0.01
    seconds: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.share) and self.share >= 0):
            raise InputError(f"pull-in time scale {self.share:g}: a share of the time must be finite and not negative")
        if not (np.isfinite(self.seconds) and self.seconds >= 0):
            raise InputError(f"pull-in time scale {self.seconds:g} s: it must be finite and not negative")

    @classmethod
    def fraction(cls, share: float) -> TimeScale:
        """A fraction of the time since the magnitude of the voltage last began to rise."""
        return cls(share, 0.0)

    @classmethod
    def fixed(cls, seconds: float) -> TimeScale:
        """A fixed time in s; 0 is the criterion of Eq. 9 as printed, with every branch frozen."""
        return cls(0.0, seconds)

    def watched(self, time: Floats) -> Floats:
        """theta (cases,) in s at `time` (cases,) in s since the voltage began to rise."""
        return np.asarray(self.share * time + self.seconds)


ONE_PERCENT = TimeScale.fraction(0.01)


@dataclass(frozen=True, slots=True, eq=False)
class Stability:
    """The `determinant` (cases,) of ds_i/dlambda_j in Pa^2 (in Pa with one axis clamped, 1 with both), and the `margin` (cases,).

    The margin is this determinant over that of the springs alone: 1 in a film without load, 0 at pull-in, and negative where an
    equilibrium is unstable. For a film with a passive part, the determinant is replaced by the stiffness of the whole film at the
    rim of its active part in Pa (`passive.structure`), which falls to zero together with the smallest eigenvalue of the tangent.
    """

    determinant: Floats
    margin: Floats


def stability(
    points: PointMaterial,
    controls: tuple[Control, Control],
    internal: Floats,
    log_squared_stretch: Floats,
    nominal_stress: Floats,
    electrical: Floats,
    watched: Floats | None = None,
) -> Stability:
    """Stability at x (2, n, cases), or (1, n, cases) if both axes are equal, Lambda and nominal stress (2, cases), and the
    prescribed `electrical` quantity (cases,), such as the nominal field in V/m.

    `watched` (cases,) is the time scale in s, in which springs flow, except the last, the damper, which carries nothing, and charge
    flows in a circuit. Without it, the charge and every spring are frozen.
    """
    free = [control is Control.STRESS for control in controls]
    if not any(free):
        return Stability(*np.ones((2, log_squared_stretch.shape[1])))
    k11, k12, k22 = _spring_tangent(points, internal, log_squared_stretch, watched)
    maxwell = 2 * points.watched_maxwell_tangent(log_squared_stretch, electrical, watched)
    stretch = np.exp(0.5 * log_squared_stretch)
    if points.edges is not None:
        held = 2 * points.edges.tangent(log_squared_stretch)
        k11, k22 = k11 + held[0], k22 + held[1]
    t11, t22 = k11 - maxwell[0, 0] - nominal_stress[0] * stretch[0], k22 - maxwell[1, 1] - nominal_stress[1] * stretch[1]
    if all(free):
        determinant, springs_alone = t11 * t22 - (k12 - maxwell[0, 1]) * (k12 - maxwell[1, 0]), k11 * k22 - k12 * k12
        scale = np.square(stretch[0] * stretch[1])
        determinant = np.where((t11 < 0) & (determinant > 0), -determinant, determinant)  # unstable in both directions
    else:
        axis = 0 if free[0] else 1
        determinant, springs_alone, scale = (t11, t22)[axis], (k11, k22)[axis], np.square(stretch[axis])
    return Stability(determinant / scale, determinant / springs_alone)


def _spring_tangent(
    points: PointMaterial, internal: Floats, log_squared_stretch: Floats, watched: Floats | None
) -> tuple[Floats, Floats, Floats]:
    """The entries sum mu K11, sum mu K12 and sum mu K22, all (cases,), with the moduli that springs retain."""
    if len(internal) == 2:
        stress, half = points.law.tangent(points.springs(internal, log_squared_stretch))
        modulus = points.modulus if watched is None else points.retained(watched, lambda: stress)
        k11, k12, k22 = 2 * np.einsum("nm,cnm->cm", modulus, half)
        return k11, k12, k22
    front = np.exp(log_squared_stretch[0] - internal[0])

    def equal_stress() -> Floats:
        return points.law.axial_stress(EQUIBIAXIAL, front.copy(), 1 / np.square(front))[None]

    modulus = points.modulus if watched is None else points.retained(watched, equal_stress)
    along, across = points.law.equibiaxial_tangent(front)
    k12 = 2 * np.einsum("nm,nm->m", modulus, across)
    k11 = k12 + 2 * np.einsum("nm,nm->m", modulus, along)
    return k11, k12, k11


def damped(points: PointMaterial) -> PointMaterial:
    """The points with an additional last spring, the damper: a branch so fast and stiff that it matters only where the film has no
    equilibrium.

    There the other springs, frozen, cannot hold the load, and the equations would no longer be of index 1. With the damper the film
    runs away, in a time far below its shortest relaxation time and that of any load, along the path that the fastest processes of a
    real film would allow.
    """
    fastest = points.flow.fluidity.max(axis=0)
    fluidity = np.maximum(fastest, SLOWEST_RATE) / DAMPER_TIME_RATIO
    modulus = np.maximum(DAMPER_MODULUS_RATIO * points.modulus[0], points.modulus.sum(axis=0))
    return replace(
        points,
        modulus=np.concatenate((points.modulus, modulus[None])),
        flow=points.flow.with_linear(fluidity),
        law=points.law.with_idle_spring(),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Fold:
    """The end of an equilibrium with every viscous stretch frozen, where stretch over time has a vertical tangent (a fold).

    The damper smooths the fold in the solution; here it is located exactly. The unknowns are Lambda and time. Viscous stretches x
    (2, n, cases) continue at their rates at `time` (cases,) in s; `driven` returns the prescribed values (3, cases) at a time, and
    `watched` the time scale (cases,) in s, None if every spring is frozen.
    """

    points: PointMaterial
    controls: tuple[Control, Control]
    driven: Callable[[Floats], Floats]
    watched: Callable[[Floats], Floats] | None
    internal: Floats
    log_squared_stretch: Floats
    time: Floats

    def find(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Time (cases,), x (2, n, cases), Lambda and nominal stress (2, cases) of the fold.

        Time and Lambda are unchanged in cases where Newton's method does not converge nearby.
        """
        start = np.concatenate((self.log_squared_stretch, self.time[None]))
        unit = np.stack((np.ones_like(self.time), np.ones_like(self.time), self.time))
        scale = 1e-5 * unit
        stress = self.points.law.stress(self.points.springs(self.internal, self.log_squared_stretch))
        rate = self.points.flow.rate(stress)
        unknown = start.copy()
        with np.errstate(all="ignore"):
            for _ in range(FOLD_STEPS):
                moves = [scale * axis for axis in np.eye(3)[:, :, None]]
                slopes = [(self._residual(unknown + move, rate) - self._residual(unknown - move, rate)) / 2 for move in moves]
                matrix = np.moveaxis(np.array(slopes), (0, 1, 2), (2, 1, 0))
                finite = np.isfinite(matrix)
                regular = finite.all(axis=(1, 2)) & (np.abs(np.linalg.det(np.where(finite, matrix, 0.0))) > 0)
                matrix[~regular] = np.eye(3)
                step = scale * np.linalg.solve(matrix, -self._residual(unknown, rate).T[:, :, None])[:, :, 0].T
                unknown = unknown + np.where(regular, step, np.nan)
            near = np.all(np.abs(unknown - start) <= FOLD_REACH * unit, axis=0)
            near &= np.all(np.abs(step) <= 1e-8 * np.maximum(np.abs(unknown), 1e-3), axis=0)
            refined = np.where(near, unknown, start)
            internal, _, nominal, _ = self._film(refined, rate)
        return refined[2], internal, refined[:2], nominal

    def _residual(self, unknown: Floats, rate: Floats) -> Floats:
        """The residual (3, cases): the margin, and for both axes before it the imbalance over the modulus of the equilibrium spring
        where the axis is free, the deviation in Lambda where it is driven.
        """
        log_squared, time = unknown[:2], unknown[2]
        internal, driven, nominal, carried = self._film(unknown, rate)
        imbalance = (carried - nominal * np.exp(0.5 * log_squared)) / self.points.modulus[0]
        deviation = np.where(stretch_prescribed(self.controls), log_squared - self.log_squared_stretch, imbalance)
        watched = None if self.watched is None else self.watched(time)
        here = stability(self.points, self.controls, internal, log_squared, nominal, driven[ELECTRIC], watched)
        return np.concatenate((deviation, here.margin[None]))

    def _film(self, unknown: Floats, rate: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """x (2, n, cases), the prescribed values (3, cases), and the nominal and true mechanical stress (2, cases)."""
        log_squared, time = unknown[:2], unknown[2]
        internal, driven = self.internal + rate * (time - self.time), self.driven(time)
        stress = self.points.law.stress(self.points.springs(internal, log_squared))
        carried = np.einsum("nm,cnm->cm", self.points.modulus, stress) - self.points.maxwell_stress(log_squared, driven[ELECTRIC])
        prescribed = driven[:2] if self.points.edges is None else driven[:2] - self.points.edges.borne(log_squared)
        nominal = np.where(stretch_prescribed(self.controls), carried * np.exp(-0.5 * log_squared), prescribed)
        return internal, driven, nominal, carried
