"""Films as a user states them: geometry, treatment before the voltage, and boundary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.material import Material
from dielast.mechanics.cases import of_case, spread
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.simulate.options import MESH_RTOL, Options, check_tolerance

if TYPE_CHECKING:
    from dielast.mechanics.piece import Piece
    from dielast.mechanics.point_material import PointMaterial

PER_CENT = 20  # a larger stretch may be meant in per cent
CLOSEST = 1e-8  # smallest distance of a share from 0 and from 1; closer films differ by less than rounding

OfAxes = ArrayLike | tuple[ArrayLike | None, ArrayLike | None]  # the values of both axes, a pair if they differ
ByAxis = tuple[Floats | None, Floats | None]  # values (cases,) of both axes, None for a free one

BOUNDARIES = {"dead-load": Control.STRESS, "clamped": Control.STRETCH}
# the controls along both axes of the active part, for boundaries with a passive part
SURROUNDED: dict[str, Controls] = {"frame": (Control.NEITHER, Control.NEITHER), "strip": (Control.NEITHER, Control.STRETCH)}


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Film(Options):
    """A film, and its treatment before the voltage; every value may be one number, or one number per case, shape (cases,).

    `thickness` is the undeformed one in m, `temperature` is in degC, by default the material's reference temperature. `prestretch`
    is equibiaxial, or a pair (tuple) with None for an axis free of stress; it is reached at `prestretch_rate` in 1/s of the axis
    with the larger one, both axes together, or at once, and held for `relax` s. `boundary` says for each axis what holds the film
    afterwards: "dead-load" is the nominal stress reached, "clamped" the stretch reached; "frame" and "strip" are films with a
    passive part.

    With a passive part, the electrode covers a disc in the middle of a circular "frame", or a part of the length of a "strip"
    between bars, whose width is clamped; `electrode_share` is the radius of the electrode over that of the frame, or its share of
    the length of the strip. A `force` in N acts on the undeformed `width` in m along axis 1, or along both axes for pairs, with
    None for an axis without weight; it stretches an axis whose prestretch is None. A force of 0 is an axis free of stress. A
    `spring` of this stiffness in Pa, the nominal stress over the stretch, holds the edges of axis 1, or of each axis for pairs:
    from the end of the relaxation on, the nominal stress there falls by it as the film stretches.
    """

    thickness: ArrayLike
    prestretch: OfAxes = 1.0
    prestretch_rate: ArrayLike | None = None
    relax: float = 0.0
    boundary: str | tuple[str, str] = "dead-load"
    electrode_share: ArrayLike | None = None
    force: OfAxes | None = None
    width: OfAxes | None = None
    temperature: ArrayLike | None = None
    spring: OfAxes | None = None

    @property
    def surrounded(self) -> str | None:
        """The name of a boundary with a passive part, or None."""
        names = {self.boundary} if isinstance(self.boundary, str) else set(self.boundary)
        return next((name for name in SURROUNDED if names == {name}), None)

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

    @property
    def forces(self) -> tuple[ArrayLike | None, ...]:
        """The force along each axis, None without a weight."""
        return _of_axes(self.force, "force")

    def varied(self) -> list[ArrayLike]:
        """The numbers that may differ from case to case."""
        axes = (
            _of_axes(self.prestretch, "prestretch", alike=True),
            self.forces,
            _of_axes(self.width, "width"),
            _of_axes(self.spring, "spring"),
        )
        values = [
            *(value for pair in axes for value in pair),
            self.prestretch_rate,
            self.thickness,
            self.electrode_share,
            self.temperature,
        ]
        return [value for value in values if value is not None]

    def prestretches(self, cases: int) -> ByAxis:
        """The prestretch (cases,) of both axes, None for a free axis; `InputError` for a prestretch below 1."""
        stated = _of_axes(self.prestretch, "prestretch", alike=True)
        first, second = (None if axis is None else spread(axis, "prestretch", cases) for axis in stated)
        for axis in (first, second):
            if axis is not None and np.any(axis < 1):
                case = int(np.argmin(axis))
                below = f"{axis[case]:g}: it must not be below 1 (1 is undeformed)"
                raise InputError(below, argument="prestretch", case=of_case(case, cases))
        return first, second

    def ramp(self, prestretch: ByAxis, cases: int) -> Floats:
        """The duration (cases,) in s of the prestretch."""
        if self.prestretch_rate is None:
            return np.zeros(cases)
        moves = [axis - 1 for axis in prestretch if axis is not None]
        return np.asarray(np.max(moves, axis=0, initial=0.0) / positive(self.prestretch_rate, "prestretch_rate", "/s", cases))

    def weight_stress(self, thickness: Floats, prestretch: ByAxis) -> ByAxis:
        """The nominal stress (cases,) in Pa of the weight along each axis, None without one; `InputError` for weights that are
        negative, incomplete, or not possible at this boundary and prestretch.
        """
        loads: list[Floats | None] = [None, None]
        for axis, (force, width) in enumerate(zip(self.forces, _of_axes(self.width, "width"), strict=True)):
            if force is None:
                if width is not None:
                    raise InputError(f"there is no force on axis {axis + 1}", argument="width")
                continue
            if width is None:
                raise InputError("the film's width is needed, too", argument="force")
            if self.controls[axis] is not Control.STRESS:
                raise InputError(f"a weight along axis {axis + 1} is for boundary dead-load alone", argument="force")
            if prestretch[axis] is not None:
                stated = "this axis is stretched by its weight: its prestretch must be None"
                raise InputError(f"axis {axis + 1}: {stated}", argument="prestretch")
            newtons = spread(force, "force", thickness.size)
            if np.any(newtons < 0):
                raise InputError(f"{float(newtons.min()):g} N: it must not be negative", argument="force")
            loads[axis] = newtons / (positive(width, "width", "m", thickness.size) * thickness)
        return loads[0], loads[1]

    def sprung(self, cases: int) -> ByAxis:
        """The stiffness (cases,) in Pa of the spring along each axis, None without one; `InputError` for an impossible one."""
        found: list[Floats | None] = [None, None]
        for axis, stiffness in enumerate(_of_axes(self.spring, "spring")):
            if stiffness is None:
                continue
            if self.controls[axis] is not Control.STRESS:
                raise InputError(f"a spring along axis {axis + 1} is for boundary dead-load alone", argument="spring")
            found[axis] = positive(stiffness, "spring", "Pa", cases)
        return found[0], found[1]

    def share(self, prestretch: ByAxis, cases: int, mesh_rtol: float = MESH_RTOL) -> Floats | None:
        """The electrode's share (cases,) of films with a passive part, else None; `InputError` if it does not suit the film."""
        name = self.surrounded
        if name != "frame" and mesh_rtol != MESH_RTOL:
            raise InputError("only a film with boundary frame has a mesh", argument="mesh_rtol")
        if name is None:
            if self.electrode_share is not None:
                raise InputError("only a film with boundary frame or strip has an electrode share", argument="electrode_share")
            return None
        whole = "radius of the frame" if name == "frame" else "length of the strip"
        if self.electrode_share is None:
            raise InputError(f"boundary {name} needs the electrode's share of the {whole}", argument="electrode_share")
        share = spread(self.electrode_share, "electrode_share", cases)
        if np.any(wrong := ~((share >= CLOSEST) & (1 - share >= CLOSEST))):
            case = int(np.argmax(wrong))
            needed = f"the electrode's share of the {whole} must lie between {CLOSEST:g} and 1 - {CLOSEST:g}"
            text = f"{share[case]:.12g}: {needed}; a film without a passive part is clamped"
            raise InputError(text, argument="electrode_share", case=of_case(case, cases))
        check_tolerance(mesh_rtol, "mesh_rtol")
        first, second = prestretch
        if first is None or second is None:
            raise InputError(f"boundary {name} needs the prestretch of both axes", argument="prestretch")
        if name == "frame" and np.any(apart := first != second):
            case = int(np.argmax(apart))
            instead = "a round frame needs an equibiaxial prestretch; for a pair use boundary strip, or clamped and dead-load"
            raise InputError(f"{pair_in_words(prestretch, case)}: {instead}", argument="prestretch", case=of_case(case, cases))
        return share


def _of_axes(value: OfAxes | None, name: str, alike: bool = False) -> tuple[ArrayLike | None, ...]:
    """The values of both axes; if only one is stated, it is that of axis 1, or of both axes if they are `alike`. `InputError` for a
    tuple that is not a pair.
    """
    if not isinstance(value, tuple):
        return value, value if alike else None
    if len(value) != 2:
        raise InputError(f"{len(value)} values: a number, or a pair, one for each axis, is needed", argument=name)
    return value


def pair_in_words(prestretch: ByAxis, case: int) -> str:
    """The prestretch of a case for messages, such as "1.9", "3 x 2" or "3 x free"."""
    axes = ["free" if axis is None else f"{axis[case]:g}" for axis in prestretch]
    return axes[0] if axes[0] == axes[1] else " x ".join(axes)


def positive(value: ArrayLike, name: str, unit: str, cases: int) -> Floats:
    """The values as an array (cases,); `InputError` with the argument `name` unless all are finite and positive."""
    values = spread(value, name, cases)
    if np.any(values <= 0):
        raise InputError(f"{float(values.min()):g} {unit}: it must be positive", argument=name)
    return values


def check_limits(
    points: PointMaterial, held: Sequence[Floats], at_once: Flags, prestretch: ByAxis | None = None, step: int | None = None
) -> None:
    """`InputError` for stretches of the axes `held`, each (cases,), beyond the limit of a spring (see `out_of_reach`).

    They are those of the `prestretch` of both axes, or of a `step`, which the error names.
    """
    beyond, spring = out_of_reach(points, held, at_once)
    if beyond.any():
        case = int(np.argmax(beyond))
        largest = max(float(stretch[case]) for stretch in held)
        stated, argument = (f"stretch {largest:g}", None) if prestretch is None else (pair_in_words(prestretch, case), "prestretch")
        limit = points.law.of_spring(int(spring[case]), case).describe_limit()
        text = f"{stated} is beyond {limit}{_or_per_cent(largest)}"
        raise InputError(text, step=step, argument=argument, case=of_case(case, beyond.size))


def _or_per_cent(stretch: float) -> str:
    """The question to add to an error about a `stretch` so large that it may be meant in per cent; empty for others."""
    if stretch < PER_CENT:
        return ""
    share = stretch / 100
    as_stretch = f", and a stretch of {stretch:g} % is {share:g}" if share >= 1 else ""
    return f"; is it in per cent? a strain of {stretch:g} % is a stretch of {1 + share:g}{as_stretch}"


def out_of_reach(points: PointMaterial, held: Sequence[Floats], at_once: Flags) -> tuple[Flags, Cases]:
    """Whether (cases,) the stretches of the axes `held`, each (cases,), are beyond the limit of a spring, and the spring (cases,)
    with the smallest margin.

    It is the equilibrium spring, or any spring where the stretches are reached `at_once` from rest.
    """
    if not held:
        return np.zeros(at_once.shape, dtype=bool), np.zeros(at_once.shape, dtype=np.intp)
    squared = [np.square(stretch) for stretch in held]
    # a free axis is assumed to contract as under uniaxial stress
    squared_stretches = np.stack((squared[0], squared[1] if len(squared) == 2 else 1 / np.sqrt(squared[0])))
    margin = points.law.margin(np.repeat(squared_stretches[:, None], points.modulus.shape[0], axis=1))
    margin[1:, ~at_once] = np.inf
    first = np.argmin(margin, axis=0)
    return np.asarray(np.min(margin, axis=0) <= 0), first


def reachable(materials: Sequence[Material], pairs: Floats, at_once: bool) -> Flags:
    """Whether (materials, n) the springs of each material can be stretched to the `pairs` (n, 2) of prestretches, which are reached
    `at_once` or slowly: see `out_of_reach`.
    """
    squared = np.square(pairs).T

    def reached(material: Material) -> Flags:
        flags = np.ones(len(pairs), dtype=bool)
        if material.equilibrium_modulus:
            flags &= material.equilibrium_law.margin(squared) > 0
        if at_once and len(material.spectrum):
            flags &= material.nonequilibrium_law.margin(squared) > 0
        return flags

    each = {id(material): material for material in materials}
    flags = {number: reached(material) for number, material in each.items()}
    return np.array([flags[id(material)] for material in materials])


def check_reach(points: PointMaterial, pieces: Sequence[Piece], rest: bool = True) -> None:
    """`InputError` for a stretch that pieces of load prescribe beyond the limit of the equilibrium spring, or of the branches if
    applied at once to films at `rest`.
    """
    never = np.zeros(points.stress_floor.size, dtype=bool)
    for index, piece in enumerate(pieces):
        stretched = [axis for axis, control in enumerate(piece.controls) if control is Control.STRETCH]
        for number, target in enumerate(piece.targets):
            held = [target[axis] for axis in stretched if not np.isnan(target[axis]).any()]
            at_once = piece.at_once if rest and index == number == 0 else never
            check_limits(points, held, at_once, step=piece.step)
