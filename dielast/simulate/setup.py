"""Films under voltage as a user states them, checked and laid out case by case, and how they are stretched and relaxed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, NumericsError
from dielast.io.result import Result
from dielast.material.breakdown import Breakdown, BreakdownLaw
from dielast.material.breakdown.following import FollowingField
from dielast.material.damage import DamageLaw
from dielast.material.laws_of_cases import LawsOfCases
from dielast.material.material import Material
from dielast.mechanics.cases import of_case, one_set, spread
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.line import Ramp
from dielast.mechanics.passive.forms import Spread, across_disc, across_strip, disc, strip
from dielast.mechanics.passive.mesh import points_needed
from dielast.mechanics.passive.structure import Structure
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control, Controls
from dielast.mechanics.stability import TimeScale, damped
from dielast.mechanics.symmetric import EQUIBIAXIAL
from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.integrate import Status
from dielast.simulate.film import REASONS, Film
from dielast.simulate.follow import follow
from dielast.simulate.reach import or_per_cent, out_of_reach
from dielast.simulate.wanted import LEAST_RTOL, MOST_RTOL, check_tolerance

MESH_RTOL = 1e-6
COARSER = 10.0 ** np.arange(-10, -1)  # tolerances that may do where a finer one does not
CLOSEST = 1e-8  # of shares to 0 and to 1: beyond, stretches no longer tell films apart

Prestretch = ArrayLike | tuple[ArrayLike | None, ArrayLike | None]

BOUNDARIES = {"dead-load": Control.STRESS, "clamped": Control.STRETCH}
# a passive part around the active one: what is prescribed along the axes of the active part
SURROUNDED: dict[str, Controls] = {"frame": (Control.NEITHER, Control.NEITHER), "strip": (Control.NEITHER, Control.STRETCH)}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FilmSetup(Result):
    """A film, and what is done to it before the voltage; every value may be one number or one a case.

    The film is of an undeformed `thickness` in m. `prestretch` is equibiaxial, or a pair (tuple) with None for an axis left free of
    stress; it is reached at `prestretch_rate` (1/s, of the larger axis; both ramp together) or at once, and held for `relax` s.
    `boundary` says for each axis whether it is then a "dead-load", the nominal stress reached, or "clamped"; or, in one word, that
    the electrode covers a disc in the middle of a circular "frame", or a length of a "strip" between bars that keeps its width. The
    passive film around it then moves, too: `electrode_share` is the electrode's radius over that of the frame, or its share of
    the strip's length. What the film around a disc is divided into follows from `mesh_rtol` (see `passive.mesh`).

    A dead load may be a weight: a `force` in N, along axis 1 or a pair with None for an axis without, on an undeformed `width` in
    m, likewise. It hangs on the film from the beginning, and stretches an axis whose prestretch is None.
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
        """The prestretch of both axes; `InputError` unless there are two."""
        pair = self.prestretch if isinstance(self.prestretch, tuple) else (self.prestretch, self.prestretch)
        if len(pair) != 2:
            raise InputError(f"{len(pair)} values: a pair, one for each axis, is needed", argument="prestretch")
        return pair

    @property
    def controls(self) -> Controls:
        """What is prescribed along each axis under voltage; `InputError` for a boundary that is not known."""
        if (surrounded := self.surrounded) is not None:
            return SURROUNDED[surrounded]
        names = (self.boundary, self.boundary) if isinstance(self.boundary, str) else tuple(self.boundary)
        if len(names) != 2 or any(name not in BOUNDARIES for name in names):
            needed = "dead-load or clamped is needed, or one of them for each axis; or frame, or strip"
            raise InputError(f"{self.boundary!r}: {needed}", argument="boundary")
        return BOUNDARIES[names[0]], BOUNDARIES[names[1]]

    def varied(self) -> list[ArrayLike]:
        """All numbers of which there may be one for each case."""
        return [
            value
            for value in (*self.axes, *self.weights, self.prestretch_rate, self.thickness, self.electrode_share)
            if value is not None
        ]

    def check(self) -> None:
        """`InputError` for a number that makes no sense."""
        for value in np.atleast_1d(np.asarray(self.thickness, dtype=float)).tolist():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{value:g} m: it must be positive", argument="thickness")
        if not (np.isfinite(self.relax) and self.relax >= 0):
            raise InputError(f"{self.relax:g} s: it must not be negative", argument="relax")

    @property
    def weights(self) -> tuple[ArrayLike | None, ...]:
        """The forces along both axes and the widths that they act on."""
        pairs = [value if isinstance(value, tuple) else (value, None) for value in (self.force, self.width)]
        for name, pair in zip(("force", "width"), pairs, strict=True):
            if len(pair) != 2:
                raise InputError(f"{len(pair)} values: a number, or a pair, one for each axis, is needed", argument=name)
        return (*pairs[0], *pairs[1])

    def hung(self, cases: int) -> tuple[Floats | None, Floats | None]:
        """The nominal stress (cases,) in Pa of the weight along each axis, None where there is none; `InputError` for a weight
        that cannot be.
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
                stated = "the weight stretches it: there is no prestretch of its own"
                raise InputError(f"axis {axis + 1}: {stated}", argument="prestretch")
            values = spread(force, "force", cases), spread(width, "width", cases), spread(self.thickness, "thickness", cases)
            for name, value, unit in zip(("force", "width"), values, ("N", "m"), strict=False):
                if np.any(value <= 0):
                    raise InputError(f"{float(value.min()):g} {unit}: it must be positive", argument=name)
            loads.append(values[0] / (values[1] * values[2]))
        return loads[0], loads[1]

    def share(self, cases: int) -> Floats | None:
        """The electrode's share (cases,) of a film with a passive part; `InputError` for one that cannot be."""
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
            raise InputError(f"{_pair(first, second, case)}: {instead}", argument="prestretch", case=of_case(case, cases))
        return share

    def stretched(self, cases: int) -> tuple[Floats | None, Floats | None]:
        """The prestretch of both axes (cases,), None for an axis left free; `InputError` for one below 1."""
        first, second = (None if axis is None else spread(axis, "prestretch", cases) for axis in self.axes)
        for axis in (first, second):
            if axis is not None and np.any(axis < 1):
                case = int(np.argmin(axis))
                below = f"{axis[case]:g}: it must not be below 1 (1 is undeformed)"
                raise InputError(below, argument="prestretch", case=of_case(case, cases))
        return first, second

    def ramp(self, cases: int) -> Floats:
        """Time in s (cases,) that the prestretch takes."""
        if self.prestretch_rate is None:
            return np.zeros(cases)
        rates = spread(self.prestretch_rate, "prestretch_rate", cases)
        if np.any(rates <= 0):
            raise InputError(f"{float(rates.min()):g} /s: it must be positive", argument="prestretch_rate")
        moves = [axis - 1 for axis in self.stretched(cases) if axis is not None]
        return np.asarray(np.max(moves, axis=0, initial=0.0) / rates)


@dataclass(frozen=True, slots=True, eq=False)
class Passive:
    """The passive parts of films: the electrode's `share` (cases,) of a disc in a frame, or of a strip, and in how many `points`
    (cases,) the passive part is computed.
    """

    share: Floats
    points: Cases
    is_strip: bool

    @classmethod
    def of(cls, points: Points, share: Floats, first: Floats, second: Floats | None, mesh_rtol: float) -> Passive:
        """Of films with these prestretches (cases,), strips where there is a second one; `InputError` for a `mesh_rtol` that no
        number of points meets.
        """
        if second is not None:
            return cls(share, np.ones(share.size, dtype=np.intp), True)
        needed = points_needed(points, share, first, mesh_rtol)
        if not needed.all():
            case = int(np.argmin(needed))
            film = f"the film around an electrode of share {float(share[case])!r}, at prestretch {first[case]:g},"
            exact = f"no division of {film} is so exact"
            larger = next((each for each in COARSER if each > mesh_rtol and points_needed(points, share, first, each).all()), None)
            instead = "nor so that a larger one would do" if larger is None else f"{larger:g} can be had"
            raise InputError(f"{mesh_rtol:g}: {exact}; {instead}", argument="mesh_rtol", case=of_case(case, share.size))
        return cls(share, needed, False)

    def structure(self, cases: Cases, first: Floats, second: Floats) -> Structure:
        """The structure of some films with as many points, at prestretches (k,)."""
        share = self.share[cases]
        return strip(share, first, second) if self.is_strip else disc(share, first, int(self.points[cases[0]]))

    def spread(self, cases: Cases) -> Spread:
        """Where in these films profiles are told."""
        share = self.share[cases]
        return across_strip(share) if self.is_strip else across_disc(share, int(self.points[cases[0]]))


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
    controls: Controls
    breakdown_field: Floats
    following: FollowingField | None = None
    damage: LawsOfCases[DamageLaw] | None = None
    passive: Passive | None = None
    hung: tuple[Floats | None, Floats | None] = (None, None)

    @property
    def alike(self) -> Flags:
        """Cases (cases,) both of whose axes are alike."""
        first, second = self.prestretch
        if first is None or second is None or self.controls[0] is not self.controls[1]:  # so are those of a disc in a frame
            return np.zeros(self.temperature.size, dtype=bool)
        return np.asarray(first == second)

    def groups(self, with_circuit: Flags | None = None) -> list[Cases]:
        """Cases whose axes are alike, which run with one unknown a spring, and the others, each parted into those without and
        `with_circuit` (cases,), so that no case depends on what it runs with; lone ones twice. Films with a passive part run with
        those that have as many points.
        """
        circuit = np.zeros_like(self.alike) if with_circuit is None else with_circuit
        parts = [np.flatnonzero(alike & wired) for wired in (~circuit, circuit) for alike in (self.alike, ~self.alike)]
        if self.passive is not None:
            counts = self.passive.points
            parts = [np.flatnonzero(counts == count) for count in np.flatnonzero(np.bincount(counts))]
        return [paired(part) for part in parts if part.size]

    def film(self, cases: Cases, rtol: float) -> Film:
        """Some of the films, one of `groups`, stretched and relaxed, and damped; at time 0 of the voltage programme.

        Raises `NumericsError` if one does not get through.
        """
        first, second = (None if axis is None else axis[cases] for axis in self.prestretch)
        symmetry = EQUIBIAXIAL if self.alike[cases].all() else None
        hung = tuple(None if load is None else load[cases] for load in self.hung)
        film, status = prestretched(
            Film.at_rest(self.points.take(cases), symmetry), (first, second), self.ramp[cases], self.relax, rtol, hung
        )
        if status.any():
            lost = int(np.argmax(status > 0))
            raise NumericsError(
                f"{_pair(first, second, lost)} cannot be computed: {REASONS[Status(int(status[lost]))]}",
                argument="prestretch",
                case=of_case(int(cases[lost]), self.temperature.size),
            )
        if self.passive is None or first is None or second is None:
            return film
        return film.framed(self.passive.structure(cases, first, second))

    def watched(self, film: Film, cases: Cases, timescale: TimeScale) -> WatchedFilms:
        """What criteria may ask of some of the films, stretched and relaxed."""
        following = None if self.following is None else self.following.take(cases)
        damage = None if self.damage is None else self.damage.take(cases)
        relaxed = film.condition.nominal_stress, film.points.stress_floor
        return WatchedFilms(self.controls, self.breakdown_field[cases], timescale, *relaxed, following, damage)


def prestretched(
    film: Film,
    stretch: tuple[Floats | None, Floats | None],
    duration: Floats,
    relax: float,
    rtol: float,
    hung: Sequence[Floats | None] = (None, None),
) -> tuple[Film, Cases]:
    """Films at rest stretched within `duration` (cases,) s to `stretch` (cases,) an axis, None for an axis left free or with a
    nominal stress in Pa `hung` (cases,) on it, held for `relax` s and given a damper; and the `Status` (cases,) of each. Use a film
    only where its status is COMPLETED.
    """
    first, second = (Control.STRESS if target is None else Control.STRETCH for target in stretch)
    zero = np.zeros_like(duration)
    loads = [zero if load is None else load for load in hung]
    targets = tuple(load if target is None else target for target, load in zip(stretch, loads, strict=True))
    pieces = [Ramp((first, second), (targets[0], targets[1], None), duration)]
    if relax > 0:
        pieces.append(Ramp((first, second), (None, None, None), np.full_like(duration, relax)))
    # only the viscous stretches at the end matter, not the stress on the way
    relaxing = replace(film.points, stress_floor=np.full_like(film.points.stress_floor, np.inf))
    followed = follow(replace(film, points=relaxing), pieces, rtol=rtol)
    condition = followed.film.condition
    internal = np.concatenate((condition.internal, condition.log_squared_stretch[:, None]), axis=1)
    condition = replace(condition, internal=internal, time=zero, next_step=zero)
    return replace(film, points=damped(film.points), condition=condition), followed.status


def set_up(
    material: Material | Sequence[Material],
    film: FilmSetup,
    *,
    temperature: ArrayLike | None,
    breakdown_field: ArrayLike | BreakdownLaw | None,
    breakdown_needed: bool,
    rtol: float,
    spanning: Sequence[ArrayLike] = (),
) -> Setup:
    """Lay out films; the cases are as many as the longest of the arrays in any argument and in `spanning`. Raises `InputError`."""
    materials = [material] if isinstance(material, Material) else list(material)
    varied = film.varied()
    if temperature is None:
        temperature = [each.reference_temperature for each in materials]
    if not materials:
        raise InputError("a material is needed")
    for entry in materials:
        if not entry.permittivity:
            needed = "which a film under voltage needs: state [dielectric] permittivity in the material file"
            raise InputError(f"{entry.name!r} has no permittivity, {needed}", argument="material")
    film.check()
    check_tolerance(rtol)
    limits = _Limits(materials, breakdown_field, breakdown_needed)
    given = [*varied, temperature, *limits.varied(), *spanning]
    cases = one_set([*map(np.size, given), len(materials)])
    first, second = film.stretched(cases)
    controls, share, hung = film.controls, film.share(cases), film.hung(cases)
    temperatures = spread(temperature, "temperature", cases)
    points, ramp = Points.of(materials, temperatures, rtol), film.ramp(cases)
    beyond, spring = out_of_reach(points, [axis for axis in (first, second) if axis is not None], ramp == 0)
    if beyond.any():
        case = int(np.argmax(beyond))
        largest = max(float(axis[case]) for axis in (first, second) if axis is not None)
        limited = f"is beyond {points.law.of_spring(int(spring[case]), case).describe_limit()}{or_per_cent(largest)}"
        raise InputError(f"{_pair(first, second, case)} {limited}", argument="prestretch", case=of_case(case, cases))
    _check_permittivity(points, first, second)
    thickness = spread(film.thickness, "thickness", cases)
    stretch = _equibiaxial((first, second), cases)
    field, following = limits.field(stretch, thickness, cases), limits.following(stretch, thickness, cases)
    if any(load is not None for load in hung) and limits.over_prestretch():
        open_ = "a field over prestretch is not known of a film that a weight stretches: state one number"
        raise InputError(open_, argument="breakdown_field")
    damage = LawsOfCases.of([entry.damage for entry in materials], cases) or None
    passive = None
    if share is not None and first is not None and second is not None:
        passive = Passive.of(points, share, first, None if film.surrounded == "frame" else second, film.mesh_rtol)
    laid_out = Setup(points, temperatures, thickness, (first, second), ramp, film.relax, controls, field, following, damage)
    return replace(laid_out, passive=passive, hung=hung)


def _check_permittivity(points: Points, first: Floats | None, second: Floats | None) -> None:
    """`InputError` for a prestretch at which the permittivity is not positive."""
    held = [axis for axis in (first, second) if axis is not None]
    if points.stretching is None or not held:
        return
    # an axis left free settles as under uniaxial stress
    log_squared = 2 * np.log(np.stack((held[0], held[1] if len(held) == 2 else held[0] ** -0.5)))
    permittivity = points.permittivity_at(log_squared)
    for case in np.flatnonzero(~(np.isfinite(permittivity) & (permittivity > 0)))[:1].tolist():
        wrong = "the permittivity is not positive there: is stretch_coefficient in the material file right?"
        place = of_case(case, permittivity.size)
        raise InputError(f"{_pair(first, second, case)}: {wrong}", argument="prestretch", case=place)


@dataclass(frozen=True, slots=True, eq=False)
class _Limits:
    """The breakdown field as it is stated, in V/m, over prestretch, or by the materials; and whether it must be known."""

    materials: Sequence[Material]
    stated: ArrayLike | BreakdownLaw | None
    needed: bool

    def varied(self) -> list[ArrayLike]:
        """The numbers of which there may be one for each case."""
        return [] if self.stated is None or isinstance(self.stated, BreakdownLaw) else [self.stated]

    def laws(self) -> list[BreakdownLaw | None]:
        """The law of all films, or of each, None where none is stated."""
        if isinstance(self.stated, BreakdownLaw):
            return [self.stated]
        return [None if self.varied() else material.breakdown for material in self.materials]

    def over_prestretch(self) -> bool:
        """Whether a field is a table over prestretch."""
        return any(isinstance(law, Breakdown) and len(law.prestretch) > 1 for law in self.laws())

    def following(self, stretch: Floats, thickness: Floats, cases: int) -> FollowingField | None:
        """How the field changes from the prestretch on, where a law says so."""
        laws = LawsOfCases.of([law if law is not None and law.follows_film else None for law in self.laws()], cases)
        return FollowingField.of(laws, thickness, stretch) if laws else None

    def field(self, stretch: Floats, thickness: Floats, cases: int) -> Floats:
        """E_EB (cases,) in V/m at the prestretch sqrt(l1 l2) of films of an undeformed thickness in m, each (cases,); infinite
        where it is neither known nor needed.
        """
        for stated in self.varied():
            fields = spread(stated, "breakdown_field", cases)
            if np.any(fields <= 0):
                raise InputError(f"{float(fields.min()):g} V/m: it must be positive", argument="breakdown_field")
            return fields
        fields, present = np.full(cases, np.inf), thickness / np.square(stretch)
        for index, material in enumerate(self.materials):
            cases_of = slice(None) if len(self.materials) == 1 else slice(index, index + 1)
            known = self.stated if isinstance(self.stated, BreakdownLaw) else material.breakdown
            if known is not None:
                fields[cases_of] = known.of_film(stretch[cases_of], present[cases_of])
            elif self.needed:
                missing = f"a breakdown field is needed: material {material.name!r} has none, and none is given"
                raise InputError(missing, argument="breakdown_field")
        return fields


def _equibiaxial(prestretch: tuple[Floats | None, Floats | None], cases: int) -> Floats:
    """The prestretch sqrt(l1 l2) (cases,) of films; an axis left free keeps the area of uniaxial stress."""
    first, second = prestretch
    held = [axis for axis in prestretch if axis is not None]
    area = np.ones(cases) if not held else np.sqrt(held[0]) if first is None or second is None else first * second
    return np.sqrt(area)


def _pair(first: Floats | None, second: Floats | None, case: int) -> str:
    """The prestretch of a case in words."""
    axes = ["free" if axis is None else f"{axis[case]:g}" for axis in (first, second)]
    return axes[0] if axes[0] == axes[1] else " x ".join(axes)
