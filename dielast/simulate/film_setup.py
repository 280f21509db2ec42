"""Films as a user states them: geometry, treatment before the voltage, and boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.material.arguments import real_number, real_numbers
from dielast.mechanics.cases import of_case, spread
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Floats
from dielast.simulate.wanted import LEAST_RTOL, MOST_RTOL

MESH_RTOL = 1e-6
CLOSEST = 1e-8  # smallest distance of a share from 0 and from 1; closer films differ by less than rounding

Prestretch = ArrayLike | tuple[ArrayLike | None, ArrayLike | None]

BOUNDARIES = {"dead-load": Control.STRESS, "clamped": Control.STRETCH}
# the controls along both axes of the active part, for boundaries with a passive part
SURROUNDED: dict[str, Controls] = {"frame": (Control.NEITHER, Control.NEITHER), "strip": (Control.NEITHER, Control.STRETCH)}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FilmSetup(Result):
    """A film, and its treatment before the voltage; every value may be one number or one number per case.

    `thickness` is the undeformed one in m. `prestretch` is equibiaxial, or a pair (tuple) with None for an axis free of stress; it
    is reached at `prestretch_rate` (1/s, of the axis with the larger one; both ramp together) or at once, and held for `relax` s.

    `boundary` says for each axis what holds the film under voltage: "dead-load" is the nominal stress reached, "clamped" the
    stretch. With a passive part it is one word: the electrode covers a disc in the middle of a circular "frame", or a part of the
    length of a "strip" between bars, whose width is clamped. `electrode_share` is then the radius of the electrode over that of the
    frame, or its share of the length of the strip. The mesh of the film around a disc follows from `mesh_rtol` (see
    `passive.mesh`).

    A weight may provide the dead load: a `force` in N and the undeformed `width` in m on which it acts, along axis 1, or pairs with
    None for an axis without weight. The weight acts from the beginning, and stretches an axis whose prestretch is None.
    """

    thickness: ArrayLike
    prestretch: Prestretch = 1.0
    prestretch_rate: ArrayLike | None = None
    relax: float = 0.0
    boundary: str | tuple[str, str] = "dead-load"
    electrode_share: ArrayLike | None = None
    mesh_rtol: float = MESH_RTOL
    force: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None
    width: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None

    @property
    def surrounded(self) -> str | None:
        """The name of a boundary with a passive part, or None."""
        names = {self.boundary} if isinstance(self.boundary, str) else set(self.boundary)
        return next((name for name in SURROUNDED if names == {name}), None)

    @property
    def axes(self) -> tuple[ArrayLike | None, ArrayLike | None]:
        """The prestretch of both axes; `InputError` if it is a tuple of any other length."""
        pair = self.prestretch if isinstance(self.prestretch, tuple) else (self.prestretch, self.prestretch)
        if len(pair) != 2:
            raise InputError(f"{len(pair)} values: a pair, one for each axis, is needed", argument="prestretch")
        return pair

    @property
    def controls(self) -> Controls:
        """The controls along both axes under voltage; `InputError` for an unknown boundary."""
        if (surrounded := self.surrounded) is not None:
            return SURROUNDED[surrounded]
        names = (self.boundary, self.boundary) if isinstance(self.boundary, str) else tuple(self.boundary)
        if len(names) != 2 or any(name not in BOUNDARIES for name in names):
            needed = "dead-load or clamped is needed, or one of them for each axis; or frame, or strip"
            raise InputError(f"{self.boundary!r}: {needed}", argument="boundary")
        return BOUNDARIES[names[0]], BOUNDARIES[names[1]]

    def varied(self) -> list[ArrayLike]:
        """The numbers that may differ from case to case."""
        return [
            value
            for value in (*self.axes, *self.weights, self.prestretch_rate, self.thickness, self.electrode_share)
            if value is not None
        ]

    def check(self) -> None:
        """`InputError` for a thickness that is not positive, or a relaxation time that is negative."""
        for value in np.atleast_1d(real_numbers(self.thickness, "thickness")).tolist():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{value:g} m: it must be positive", argument="thickness")
        if not 0 <= real_number(self.relax, "relax") < np.inf:
            raise InputError(f"{self.relax:g} s: it must not be negative", argument="relax")

    @property
    def weights(self) -> tuple[ArrayLike | None, ...]:
        """The forces along both axes, followed by the widths on which they act; `InputError` for tuples that are not pairs."""
        pairs = [value if isinstance(value, tuple) else (value, None) for value in (self.force, self.width)]
        for name, pair in zip(("force", "width"), pairs, strict=True):
            if len(pair) != 2:
                raise InputError(f"{len(pair)} values: a number, or a pair, one for each axis, is needed", argument=name)
        return (*pairs[0], *pairs[1])

    def hung(self, cases: int) -> tuple[Floats | None, Floats | None]:
        """The nominal stress (cases,) in Pa of the weight along each axis, None without one; `InputError` for weights that are not
        positive, incomplete, or not possible at this boundary and prestretch.
        """
        forces, widths = self.weights[:2], self.weights[2:]
        loads: list[Floats | None] = []
        for axis, (force, width) in enumerate(zip(forces, widths, strict=True)):
            if force is None:
                if width is not None:
                    raise InputError(f"there is no force on axis {axis + 1}", argument="width")
                loads.append(None)
                continue
            if width is None:
                raise InputError("the film's width is needed, too", argument="force")
            if self.controls[axis] is not Control.STRESS:
                raise InputError(f"a weight along axis {axis + 1} is for boundary dead-load alone", argument="force")
            if self.axes[axis] is not None:
                stated = "the weight stretches it: state no prestretch for it"
                raise InputError(f"axis {axis + 1}: {stated}", argument="prestretch")
            values = spread(force, "force", cases), spread(width, "width", cases), spread(self.thickness, "thickness", cases)
            for name, value, unit in zip(("force", "width"), values, ("N", "m"), strict=False):
                if np.any(value <= 0):
                    raise InputError(f"{float(value.min()):g} {unit}: it must be positive", argument=name)
            loads.append(values[0] / (values[1] * values[2]))
        return loads[0], loads[1]

    def share(self, cases: int) -> Floats | None:
        """The electrode's share (cases,) of films with a passive part, else None; `InputError` if it does not suit the film."""
        name, stated = self.surrounded, self.electrode_share
        if name != "frame" and self.mesh_rtol != MESH_RTOL:
            raise InputError("it is for the boundary frame alone", argument="mesh_rtol")
        if name is None:
            if stated is not None:
                raise InputError("it is for the boundaries frame and strip alone", argument="electrode_share")
            return None
        whole = "radius of the frame" if name == "frame" else "length of the strip"
        if stated is None:
            raise InputError(f"boundary {name} needs the electrode's share of the {whole}", argument="electrode_share")
        share = spread(stated, "electrode_share", cases)
        if np.any(wrong := ~((share > 0) & (share < 1))):
            case = int(np.argmax(wrong))
            needed = (
                f"{share[case]:g}: the electrode's share of the {whole} must lie between 0 and 1; a film without a passive part"
            )
            raise InputError(f"{needed} is clamped", argument="electrode_share", case=of_case(case, cases))
        if np.any(close := (share < CLOSEST) | (1 - share < CLOSEST)):
            case = int(np.argmax(close))
            instead = f"{CLOSEST:g} is as small as none" if share[case] < 0.5 else "such a film is boundary clamped"
            text = f"{float(share[case])!r}: it must lie {CLOSEST:g} or more from 0 and 1; {instead}"
            raise InputError(text, argument="electrode_share", case=of_case(case, cases))
        if not LEAST_RTOL <= self.mesh_rtol <= MOST_RTOL:
            raise InputError(f"{self.mesh_rtol:g} is not between {LEAST_RTOL:g} and {MOST_RTOL:g}", argument="mesh_rtol")
        first, second = self.stretched(cases)
        if first is None or second is None:
            raise InputError(f"boundary {name} needs the prestretch of both axes", argument="prestretch")
        if name == "frame" and np.any(apart := first != second):
            case = int(np.argmax(apart))
            instead = "a round frame needs an equibiaxial prestretch; for a pair use boundary strip, or clamped and dead-load"
            raise InputError(f"{pair_in_words(first, second, case)}: {instead}", argument="prestretch", case=of_case(case, cases))
        return share

    def stretched(self, cases: int) -> tuple[Floats | None, Floats | None]:
        """The prestretch (cases,) of both axes, None for a free axis; `InputError` for a prestretch below 1."""
        first, second = (None if axis is None else spread(axis, "prestretch", cases) for axis in self.axes)
        for axis in (first, second):
            if axis is not None and np.any(axis < 1):
                case = int(np.argmin(axis))
                below = f"{axis[case]:g}: it must not be below 1 (1 is undeformed)"
                raise InputError(below, argument="prestretch", case=of_case(case, cases))
        return first, second

    def ramp(self, cases: int) -> Floats:
        """The duration (cases,) in s of the prestretch."""
        if self.prestretch_rate is None:
            return np.zeros(cases)
        rates = spread(self.prestretch_rate, "prestretch_rate", cases)
        if np.any(rates <= 0):
            raise InputError(f"{float(rates.min()):g} /s: it must be positive", argument="prestretch_rate")
        moves = [axis - 1 for axis in self.stretched(cases) if axis is not None]
        return np.asarray(np.max(moves, axis=0, initial=0.0) / rates)


def pair_in_words(first: Floats | None, second: Floats | None, case: int) -> str:
    """The prestretch of a case for messages, such as "1.9", "3 x 2" or "3 x free"."""
    axes = ["free" if axis is None else f"{axis[case]:g}" for axis in (first, second)]
    return axes[0] if axes[0] == axes[1] else " x ".join(axes)
