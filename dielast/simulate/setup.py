"""What a user says of films under voltage, checked and laid out case by case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, NumericsError
from dielast.material.material import Breakdown, Material
from dielast.material.springs import Floats
from dielast.mechanics.load import of_case
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control
from dielast.numerics.integrate import Status
from dielast.simulate.film import Film, prestretch
from dielast.simulate.follow import REASONS
from dielast.simulate.reach import or_per_cent, out_of_reach

Prestretch = ArrayLike | tuple[ArrayLike | None, ArrayLike | None]

BOUNDARIES = {"dead-load": Control.STRESS, "clamped": Control.STRETCH}


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """Films before they are stretched: `thickness` (cases,) in m; `prestretch` of both axes (cases,), None for an axis left free;
    `ramp` (cases,) the time in s that takes.
    """

    points: Points
    temperature: Floats
    thickness: Floats
    prestretch: tuple[Floats | None, Floats | None]
    ramp: Floats
    relax: float
    controls: tuple[Control, Control]
    breakdown_field: Floats

    def groups(self) -> list[NDArray[np.intp]]:
        """Cases whose axes are alike, which run with one unknown a spring, and the others, so that no case depends on what it runs
        with.

        A lone case is named twice, as sums over a lone column round differently.
        """
        first, second = self.prestretch
        one_boundary = self.controls[0] is self.controls[1]
        if first is None or second is None or not one_boundary:
            groups = [np.arange(self.temperature.size)]
        else:
            groups = [group for group in (np.flatnonzero(first == second), np.flatnonzero(first != second)) if group.size]
        return [np.resize(group, max(2, group.size)) for group in groups]

    def film(self, cases: NDArray[np.intp], rtol: float) -> Film:
        """Some of the films, one of `groups`, stretched and relaxed; `NumericsError` if one does not get through."""
        first, second = (None if axis is None else axis[cases] for axis in self.prestretch)
        alike = first is not None and second is not None and bool(np.all(first == second)) and self.controls[0] is self.controls[1]
        points = self.points.take(cases)
        film, status = prestretch(points, (first, second), self.ramp[cases], self.relax, alike=alike, rtol=rtol)
        if status.any():
            lost = int(np.argmax(status > 0))
            raise NumericsError(
                f"{_pair(first, second, lost)} cannot be computed: {REASONS[Status(int(status[lost]))]}",
                argument="prestretch",
                case=of_case(int(cases[lost]), self.temperature.size),
            )
        return film


def set_up(
    material: Material | Sequence[Material],
    prestretch: Prestretch,
    *,
    spanning: Sequence[ArrayLike],
    thickness: ArrayLike,
    prestretch_rate: ArrayLike | None,
    relax: float,
    boundary: str | tuple[str, str],
    temperature: ArrayLike | None,
    breakdown_field: ArrayLike | Breakdown | None,
    breakdown_needed: bool,
    rtol: float,
) -> Setup:
    """Arguments as in `actuate`; the cases are as many as the longest of them and of the arrays in `spanning`. Raises
    `InputError`.
    """
    materials = [material] if isinstance(material, Material) else list(material)
    axes = list(prestretch) if isinstance(prestretch, tuple) else [prestretch, prestretch]
    if len(axes) != 2:
        raise InputError(f"{len(axes)} values: a pair, one for each axis, is needed", argument="prestretch")
    if temperature is None:
        temperature = [each.reference_temperature for each in materials]
    _check(materials, thickness, relax, rtol)
    field = (
        breakdown_field
        if isinstance(breakdown_field, Breakdown) or breakdown_field is None
        else np.asarray(breakdown_field, dtype=float)
    )
    given = [*axes, temperature, prestretch_rate, thickness, None if isinstance(field, Breakdown) else field, *spanning]
    sizes = {np.size(value) for value in given if value is not None} | {len(materials)}
    sizes.discard(1)
    if len(sizes) > 1:
        raise InputError(f"arrays of {' and '.join(map(str, sorted(sizes)))} values do not make one set of cases")
    cases = sizes.pop() if sizes else 1
    first, second = (None if axis is None else _spread(axis, cases, "prestretch") for axis in axes)
    for axis in (first, second):
        if axis is not None and np.any(axis < 1):
            case = int(np.argmin(axis))
            below = f"{axis[case]:g}: it must not be below 1 (1 is undeformed)"
            raise InputError(below, argument="prestretch", case=of_case(case, cases))
    temperatures = _spread(temperature, cases, "temperature")
    points, ramp = Points.of(materials, temperatures, rtol), _ramp(first, second, prestretch_rate, cases)
    beyond, limit = out_of_reach(points, [axis for axis in (first, second) if axis is not None], ramp == 0)
    if beyond.any():
        case = int(np.argmax(beyond))
        largest = max(float(axis[case]) for axis in (first, second) if axis is not None)
        limited = f"is beyond the Gent limit, J_lim = {limit[case]:g}{or_per_cent(largest)}"
        raise InputError(f"{_pair(first, second, case)} {limited}", argument="prestretch", case=of_case(case, cases))
    return Setup(
        points,
        temperatures,
        _spread(thickness, cases, "thickness"),
        (first, second),
        ramp,
        relax,
        _controls(boundary),
        _breakdown_field(materials, field, first, second, cases, breakdown_needed),
    )


def _pair(first: Floats | None, second: Floats | None, case: int) -> str:
    """The prestretch of a case in words."""
    axes = ["free" if axis is None else f"{axis[case]:g}" for axis in (first, second)]
    return axes[0] if axes[0] == axes[1] else " x ".join(axes)


def _check(materials: Sequence[Material], thickness: ArrayLike, relax: float, rtol: float) -> None:
    """`InputError` for a number that makes no sense."""
    if not materials:
        raise InputError("a material is needed")
    for each in materials:
        if not each.permittivity:
            needed = "which a film under voltage needs: state [dielectric] permittivity in the material file"
            raise InputError(f"{each.name!r} has no permittivity, {needed}", argument="material")
    for value in np.atleast_1d(np.asarray(thickness, dtype=float)).tolist():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{value:g} m: it must be positive", argument="thickness")
    if not (np.isfinite(relax) and relax >= 0):
        raise InputError(f"{relax:g} s: it must not be negative", argument="relax")
    if not 1e-12 <= rtol <= 0.1:
        raise InputError(f"{rtol:g} is not between 1e-12 and 0.1", argument="rtol")


def _ramp(first: Floats | None, second: Floats | None, rate: ArrayLike | None, cases: int) -> Floats:
    """Time in s (cases,) that the prestretch takes at a `rate` of the larger axis."""
    if rate is None:
        return np.zeros(cases)
    rates = _spread(rate, cases, "prestretch_rate")
    if np.any(rates <= 0):
        raise InputError(f"{float(rates.min()):g} /s: it must be positive", argument="prestretch_rate")
    return np.asarray(np.max([axis - 1 for axis in (first, second) if axis is not None], axis=0, initial=0.0) / rates)


def _controls(boundary: str | tuple[str, str]) -> tuple[Control, Control]:
    """What is prescribed along each axis under voltage."""
    names = (boundary, boundary) if isinstance(boundary, str) else tuple(boundary)
    if len(names) != 2 or any(name not in BOUNDARIES for name in names):
        raise InputError(f"{boundary!r}: dead-load or clamped is needed, or one of them for each axis", argument="boundary")
    return BOUNDARIES[names[0]], BOUNDARIES[names[1]]


def _breakdown_field(
    materials: Sequence[Material],
    field: Floats | Breakdown | None,
    first: Floats | None,
    second: Floats | None,
    cases: int,
    needed: bool,
) -> Floats:
    """E_EB (cases,) in V/m, infinite where it is neither known nor needed."""
    if isinstance(field, np.ndarray):
        fields = _spread(field, cases, "breakdown_field")
        if np.any(fields <= 0):
            raise InputError(f"{float(fields.min()):g} V/m: it must be positive", argument="breakdown_field")
        return fields
    # an axis left free keeps the area of uniaxial stress
    wide = first if first is not None else second
    area = np.ones(cases) if wide is None else (first * second if first is not None and second is not None else np.sqrt(wide))
    equibiaxial = np.sqrt(area)
    fields = np.full(cases, np.inf)
    for index, each in enumerate(materials):
        own = slice(None) if len(materials) == 1 else slice(index, index + 1)
        known = field or each.breakdown
        if known is not None:
            fields[own] = known.at(equibiaxial[own])
        elif needed:
            missing = f"a breakdown field is needed: material {each.name!r} has none, and none is given"
            raise InputError(missing, argument="breakdown_field")
    return fields


def _spread(value: ArrayLike, cases: int, name: str) -> Floats:
    """One finite number for each case."""
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise InputError("every value must be finite", argument=name)
    return np.ascontiguousarray(np.broadcast_to(array.reshape(-1), (cases,)))
