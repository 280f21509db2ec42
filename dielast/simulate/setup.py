"""Films under voltage: arguments as arrays over cases, and prestretch and relaxation before the voltage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, NumericsError
from dielast.material.breakdown import BreakdownLaw
from dielast.material.breakdown.following import FollowingField
from dielast.material.damage import DamageLaw
from dielast.material.laws_of_cases import LawsOfCases
from dielast.material.material import Material
from dielast.mechanics.cases import of_case, one_set, spread
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.line import Ramp
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control, Controls
from dielast.mechanics.stability import TimeScale, damped
from dielast.mechanics.symmetric import EQUIBIAXIAL
from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.integrate import Status
from dielast.simulate.breakdown_fields import BreakdownFields
from dielast.simulate.film import Film
from dielast.simulate.film_setup import FilmSetup, pair_in_words
from dielast.simulate.follow import follow
from dielast.simulate.history import REASONS
from dielast.simulate.passive_parts import Passive
from dielast.simulate.reach import or_per_cent, out_of_reach
from dielast.simulate.wanted import check_tolerance


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """Films before the prestretch: `thickness` (cases,) in m; `prestretch` of both axes (cases,), None for a free axis, reached
    within `ramp` (cases,) s and held for `relax` s; `hung` is the nominal stress (cases,) in Pa of a weight along each axis, or
    None.
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
        """Cases (cases,) whose axes are equal in prestretch and control."""
        first, second = self.prestretch
        if first is None or second is None or self.controls[0] is not self.controls[1]:
            return np.zeros(self.temperature.size, dtype=bool)
        return np.asarray(first == second)

    def groups(self, with_circuit: Flags | None = None) -> list[Cases]:
        """Groups of cases that run together; a group of one case has it twice.

        Cases with equal axes have one unknown per spring, and are apart from the others; cases `with_circuit` (cases,) are apart
        from those without. Films with a passive part are grouped by the number of their points. So no result depends on other
        cases.
        """
        circuit = np.zeros_like(self.alike) if with_circuit is None else with_circuit
        parts = [np.flatnonzero(alike & wired) for wired in (~circuit, circuit) for alike in (self.alike, ~self.alike)]
        if self.passive is not None:
            counts = self.passive.points
            parts = [np.flatnonzero(counts == count) for count in np.flatnonzero(np.bincount(counts))]
        return [paired(part) for part in parts if part.size]

    def film(self, cases: Cases, rtol: float) -> Film:
        """The films of one of the `groups`, prestretched, relaxed and with a damper, at time 0 of the voltage programme.

        Raises `NumericsError` if the prestretch of a film cannot be computed.
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
                f"{pair_in_words(first, second, lost)} cannot be computed: {REASONS[Status(int(status[lost]))]}",
                argument="prestretch",
                case=of_case(int(cases[lost]), self.temperature.size),
            )
        if self.passive is None or first is None or second is None:
            return film
        return film.framed(self.passive.structure(cases, first, second))

    def watched(self, film: Film, cases: Cases, timescale: TimeScale) -> WatchedFilms:
        """The data for criteria on the films `cases` (k,), which are prestretched and relaxed."""
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
    """Films at rest, prestretched, relaxed for `relax` s and given a damper, and their `Status` (cases,).

    `stretch` (cases,) of each axis is reached within `duration` (cases,) s; None is an axis that is free, or under the nominal
    stress `hung` (cases,) in Pa. Use a film only where its status is COMPLETED.
    """
    first, second = (Control.STRESS if target is None else Control.STRETCH for target in stretch)
    zero = np.zeros_like(duration)
    loads = [zero if load is None else load for load in hung]
    targets = tuple(load if target is None else target for target, load in zip(stretch, loads, strict=True))
    pieces = [Ramp((first, second), (targets[0], targets[1], None), duration)]
    if relax > 0:
        pieces.append(Ramp((first, second), (None, None, None), np.full_like(duration, relax)))
    # only the final viscous stretches matter, not the stress on the way
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
    rtol: float,
    spanning: Sequence[ArrayLike] = (),
) -> Setup:
    """Films from the arguments of a simulation; the number of cases is the largest length of the arrays in them and in `spanning`.

    Raises `InputError` for invalid arguments.
    """
    materials = [material] if isinstance(material, Material) else list(material)
    varied = film.varied()
    if temperature is None:
        temperature = [material.reference_temperature for material in materials]
    if not materials:
        raise InputError("a material is needed")
    for entry in materials:
        if not entry.permittivity:
            needed = "which a film under voltage needs: state [dielectric] permittivity in the material file"
            raise InputError(f"{entry.name!r} has no permittivity, {needed}", argument="material")
    film.check()
    check_tolerance(rtol)
    limits = BreakdownFields(materials, breakdown_field)
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
        raise InputError(f"{pair_in_words(first, second, case)} {limited}", argument="prestretch", case=of_case(case, cases))
    _check_permittivity(points, first, second)
    thickness = spread(film.thickness, "thickness", cases)
    stretch = _equibiaxial((first, second), cases)
    field, following = limits.field(stretch, thickness, cases), limits.following(stretch, thickness, cases)
    if any(load is not None for load in hung) and limits.over_prestretch():
        needed_number = "a field over prestretch is not known of a film that a weight stretches: state one number"
        raise InputError(needed_number, argument="breakdown_field")
    damage = LawsOfCases.of([entry.damage for entry in materials], cases) or None
    passive = None
    if share is not None and first is not None and second is not None:
        passive = Passive.of(points, share, first, None if film.surrounded == "frame" else second, film.mesh_rtol)
    setup = Setup(points, temperatures, thickness, (first, second), ramp, film.relax, controls, field, following, damage)
    return replace(setup, passive=passive, hung=hung)


def _check_permittivity(points: Points, first: Floats | None, second: Floats | None) -> None:
    """`InputError` for a prestretch at which the permittivity is not positive."""
    held = [axis for axis in (first, second) if axis is not None]
    if points.stretching is None or not held:
        return
    # a free axis is assumed to contract as under uniaxial stress
    log_squared = 2 * np.log(np.stack((held[0], held[1] if len(held) == 2 else held[0] ** -0.5)))
    permittivity = points.permittivity_at(log_squared)
    for case in np.flatnonzero(~(np.isfinite(permittivity) & (permittivity > 0)))[:1].tolist():
        wrong = "the permittivity is not positive there: is stretch_coefficient in the material file right?"
        place = of_case(case, permittivity.size)
        raise InputError(f"{pair_in_words(first, second, case)}: {wrong}", argument="prestretch", case=place)


def _equibiaxial(prestretch: tuple[Floats | None, Floats | None], cases: int) -> Floats:
    """The prestretch sqrt(l1 l2) (cases,) of films; the area of a free axis is that under uniaxial stress."""
    first, second = prestretch
    held = [axis for axis in prestretch if axis is not None]
    area = np.ones(cases) if not held else np.sqrt(held[0]) if first is None or second is None else first * second
    return np.sqrt(area)
