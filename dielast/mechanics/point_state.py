"""The states of loaded material points: what their rows mean, and what follows from them (`point` has the equations).

The state of one point is a column (2n + 2,): x_i = 2 ln xi_i of the n springs, axis 1 then axis 2, and last the unknowns of axes 1
and 2: Lambda_i = 2 ln lambda_i where the stress is prescribed, the nominal stress s_i where the stretch is. The last axis of arrays
is the cases, which are independent: no result depends on the cases beside it.

Under a load that keeps every spring symmetric, axis 1 stands for both, and half of the rows are enough: under uniaxial stress
lambda_2 = lambda_1^(-1/2) and xi_2 = xi_1^(-1/2) hold exactly, under equibiaxial load lambda_2 = lambda_1 and xi_2 = xi_1. A state
is then a column (n + 1,), x of axis 1 and its unknown. In arrays, `axes` is 1 or 2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.material.springs import UNIAXIAL, Symmetry
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.elimination import stress_of
from dielast.mechanics.point_material import PointMaterial, in_both_axes
from dielast.mechanics.span import Control, Load, UnderLoad
from dielast.numerics.arrays import Flags, Floats, paired


@dataclass(frozen=True, slots=True, eq=False)
class PointStates(UnderLoad):
    """The states of material points in one smooth span of load, which keeps the `symmetry`, if there is one. A nominal field is
    compatible only with equibiaxial symmetry.
    """

    points: PointMaterial
    load: Load
    symmetry: Symmetry | None = None
    slack: Flags | None = None
    """The points (cases,) whose axis 1 is free of stress although a load prescribes the distance of its grips; None: no point."""

    axes: int = field(init=False)
    """The number of axes in the state."""
    border: int = field(init=False)
    """Index of the first row of the border, counted from the end of the state."""
    held: tuple[bool | Flags, ...] = field(init=False)
    """Whether the stretch of each axis is prescribed, for all points alike, or in flags (cases,)."""
    free: list[int] = field(init=False)
    """The axes whose stretch is not prescribed, or not for all points."""
    stretched: bool = field(init=False)
    """Whether a load prescribes the stretch of an axis: its stress then follows from the springs, unless the point is slack."""
    loose: bool = field(init=False)
    """Whether all points are slack, so that the stretch of axis 1 is not prescribed for any."""

    CHARGES: ClassVar[int] = 0
    """The number of charges among the unknowns."""

    def __post_init__(self) -> None:
        axes = 2 if self.symmetry is None else 1
        held: list[bool | Flags] = [control is Control.STRETCH for control in self.load.controls[:axes]]
        slack = self.slack if held[0] is True else None
        loose = slack is not None and bool(slack.all())
        if slack is not None and slack.any():
            held[0] = False if loose else ~slack
        free = [axis for axis, fixed in enumerate(held) if fixed is not True]
        derived = {"axes": axes, "border": -axes - self.CHARGES, "held": tuple(held), "free": free, "loose": loose}
        for name, value in {**derived, "stretched": loose or any(fixed is not False for fixed in held)}.items():
            object.__setattr__(self, name, value)

    @property
    def of_membrane(self) -> slice:
        """The rows of a state on which the membrane depends."""
        return slice(None) if self.stretched else slice(self.border, None)

    def pack(self, internal: Floats, log_squared_stretch: Floats) -> Floats:
        """State (rows, cases) from x (2, n, cases) and Lambda (2, cases)."""
        return np.concatenate((internal[: self.axes].reshape(-1, internal.shape[2]), log_squared_stretch[: self.axes]))

    def internal(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state."""
        internal = self.packed(state)
        return internal if self.symmetry is None else np.concatenate((internal, self.symmetry.second * internal))

    def compact(self, state: Floats) -> Floats:
        """x (2, n, cases) of a state, or (1, n, cases) where both axes are equal."""
        return self.internal(state) if self.symmetry == UNIAXIAL else self.packed(state)

    def packed(self, state: Floats) -> Floats:
        """x (axes, n, cases) of a state."""
        return state[: self.border].reshape(self.axes, -1, state.shape[1])

    def membrane(self, state: Floats, driven: Floats) -> tuple[Floats, Floats]:
        """Lambda and the nominal stress, both (2, cases), of a `state` under the prescribed values `driven` (3, cases).

        In a state of the border alone, the nominal stress along axes of prescribed stretch is NaN.
        """
        log_squared = self.log_squared(state, driven)
        nominal = self.applied(driven, log_squared)
        if self.stretched:
            along = zip(self.held, self._carried(state, driven, log_squared), driven[: self.axes], nominal, strict=True)
            nominal = np.array([free if held is False else np.where(held, true / fixed, free) for held, true, fixed, free in along])
        if self.symmetry is not None:
            nominal = np.concatenate((nominal, np.zeros_like(nominal) if self.symmetry == UNIAXIAL else nominal))
        return self._of_both(log_squared), nominal

    def held_stress(self, state: Floats, driven: Floats) -> Floats:
        """The nominal stress (cases,) of axis 1 of a `state` under `driven` (3, cases), at the stretch that is prescribed."""
        return np.asarray(self._carried(state, driven, self.log_squared(state, driven))[0] / driven[0])

    def of_both_axes(self, state: Floats, driven: Floats) -> Floats:
        """Lambda (2, cases) of a `state` under the prescribed values `driven` (3, cases)."""
        return self._of_both(self.log_squared(state, driven))

    def _of_both(self, log_squared: Floats) -> Floats:
        return log_squared if self.symmetry is None else np.concatenate((log_squared, self.symmetry.second * log_squared))

    def log_squared(self, state: Floats, driven: Floats) -> Floats:
        """Lambda (axes, cases), which the border holds or the load prescribes."""
        unknown, prescribed = state[-self.axes :], driven[: self.axes]
        if not self.stretched:
            return unknown
        if not self.free:
            return np.asarray(2.0 * np.log(prescribed))
        along = zip(self.held, prescribed, unknown, strict=True)
        return np.array([free if held is False else np.where(held, 2.0 * np.log(fixed), free) for held, fixed, free in along])

    def applied(self, driven: Floats, log_squared: Floats) -> Floats:
        """The nominal stress (axes, cases) that the load prescribes at Lambda (axes, cases), 0 along axes of prescribed stretch."""
        stress = driven[: self.axes]
        if self.stretched:
            stress = np.zeros_like(stress)
            for axis in self.free:
                stress[axis] = driven[axis] if self.held[axis] is False and not (self.loose and axis == 0) else 0.0
        if self.points.edges is None:
            return stress
        return np.asarray(stress - self.points.edges.borne(in_both_axes(log_squared))[: self.axes])

    def _carried(self, state: Floats, driven: Floats, log_squared: Floats) -> Floats:
        """The true mechanical stress (axes, cases) of the springs at Lambda (axes, cases), less the Maxwell stress."""
        if len(state) == -self.border:
            return np.full_like(log_squared, np.nan)
        elastic = np.subtract(log_squared[:, None], self.packed(state), order="C")
        modulus, count = self.points.modulus, state.shape[1]
        if count == 1:
            pair = paired(np.zeros(1, dtype=np.intp))
            elastic, modulus = elastic.take(pair, axis=-1), modulus.take(pair, axis=-1)
        stress = stress_of(self.points.law, self.symmetry, elastic)
        carried = np.einsum("nm,cnm->cm", modulus, stress)[:, :count]
        return np.asarray(carried - self.points.maxwell_stress(log_squared, driven[ELECTRIC]) if self.electric else carried)

    def lifted(self) -> Floats:
        """1 for springs that flow under prescribed stretches, else 0 (n, cases): their known part follows the load."""
        flows = self.points.flow.fluidity > 0
        for held in self.held:
            if held is not True:
                flows = flows & held
        return flows.astype(float)
