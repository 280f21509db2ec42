"""Films under voltage: arguments as arrays over cases, and prestretch and relaxation before the voltage."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, NumericsError
from dielast.material.breakdown import Breakdown, BreakdownLaw
from dielast.material.law import DamageLaw
from dielast.material.laws_of_cases import FailureLaws, LawsOfCases, StretchDependentBreakdown
from dielast.material.material import Material, materials_of
from dielast.material.springs import EQUIBIAXIAL
from dielast.mechanics.cases import of_case, one_set, temperatures_of
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.film import FilmState
from dielast.mechanics.line import Line
from dielast.mechanics.passive.forms import Spread, across_disc, across_strip, disc, strip
from dielast.mechanics.passive.mesh import points_needed
from dielast.mechanics.point_material import EdgeSprings, PointMaterial
from dielast.mechanics.span import Control, Controls
from dielast.mechanics.stability import TimeScale, damped
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.integrate import Status
from dielast.simulate.film_setup import ByAxis, Film, check_limits, pair_in_words, positive
from dielast.simulate.follow import follow
from dielast.simulate.history import REASONS
from dielast.simulate.options import Solver, check_tolerance

FINER = 0.1  # of the tolerance: a film close to pull-in amplifies what its prestretch leaves, and springs alone take few steps
COARSER = 10.0 ** np.arange(-10, -1)  # tolerances to suggest where the requested one cannot be met


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """Films before the prestretch: `thickness` (cases,) in m; `prestretch` of both axes (cases,), None for a free axis, reached
    within `ramp` (cases,) s and held for `relax` s; `weight_stress` is the nominal stress (cases,) in Pa of a weight along each
    axis, or None. With a passive part, `share` (cases,) is that of the electrode of a disc in a frame or of a strip, and `mesh`
    (cases,) the number of points in the passive part of a disc, 0 for a strip. `spring` is the stiffness (cases,) in Pa of a
    spring at the edges of each axis, or None.
    """

    points: PointMaterial
    temperature: Floats
    thickness: Floats
    prestretch: ByAxis
    ramp: Floats
    relax: float
    controls: Controls
    endurance: FailureLaws
    weight_stress: ByAxis = (None, None)
    share: Floats | None = None
    mesh: Cases = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    spring: ByAxis = (None, None)

    @property
    def alike(self) -> Flags:
        """Cases (cases,) whose axes are equal in prestretch and control."""
        first, second = self.prestretch
        if first is None or second is None or self.controls[0] is not self.controls[1]:
            return np.zeros(self.temperature.size, dtype=bool)
        return np.asarray(first == second)

    def groups(self, circuit: Cases | None = None, alike: Flags | bool = True) -> list[Cases]:
        """Groups of cases that run together; a group of one case has it twice.

        Cases with equal axes, which a load keeps `alike` (cases,), have one unknown per spring, and are apart from the others;
        cases with different kinds of `circuit` (cases,), from 0, are apart. Films with a passive part are grouped by the number of
        their points. So no result depends on other cases.
        """
        kind = np.zeros(self.alike.shape, dtype=np.intp) if circuit is None else circuit
        equal = self.alike & alike
        if any(spring is not None for spring in self.spring):
            equal = np.zeros_like(equal)
        parts = [np.flatnonzero(axes & (kind == one)) for one in range(int(kind.max()) + 1) for axes in (equal, ~equal)]
        if self.share is not None:
            parts = [np.flatnonzero(self.mesh == count) for count in np.flatnonzero(np.bincount(self.mesh))]
        return [paired(part) for part in parts if part.size]

    def film(self, cases: Cases, rtol: float, alike: bool = True) -> FilmState:
        """The films of one of the `groups`, prestretched, relaxed and with a damper, at time 0 of the voltage programme; a load
        keeps equal axes `alike`.

        Raises `NumericsError` if the prestretch of a film cannot be computed.
        """
        first, second = prestretch = _of_cases(self.prestretch, cases)
        film = FilmState.at_rest(self.points.take(cases), EQUIBIAXIAL if alike and self.alike[cases].all() else None)
        film, status = prestretched(film, prestretch, self.ramp[cases], self.relax, rtol, _of_cases(self.weight_stress, cases))
        if status.any():
            lost = int(np.argmax(status > 0))
            raise NumericsError(
                f"{pair_in_words(prestretch, lost)} cannot be computed: {REASONS[Status(int(status[lost]))]}",
                argument="prestretch",
                case=of_case(int(cases[lost]), self.temperature.size),
            )
        if self.share is None or first is None or second is None:
            return film
        share, count = self.share[cases], int(self.mesh[cases[0]])
        return film.framed(disc(share, first, count) if count else strip(share, first, second))

    def spread(self, cases: Cases) -> Spread | None:
        """The places of the films of one of the `groups` at which profiles are evaluated, None without a passive part."""
        if self.share is None:
            return None
        share, count = self.share[cases], int(self.mesh[cases[0]])
        return across_disc(share, count) if count else across_strip(share)

    def watched(self, film: FilmState, cases: Cases, timescale: TimeScale, moved: bool = False) -> WatchedFilms:
        """The data for criteria on the films `cases` (k,), which are prestretched and relaxed, and whose edges may be `moved`."""
        begin = film.nominal_stress, film.points.stress_floor
        return WatchedFilms(self.controls, self.endurance.take(cases), timescale, *begin, moved)

    def springs(self, cases: Cases, home: Floats) -> EdgeSprings | None:
        """The springs at the edges of the films `cases` (k,), which bear the prescribed stress at the stretches `home` (2, k)."""
        if all(spring is None for spring in self.spring):
            return None
        stiffness = [np.zeros(cases.size) if spring is None else spring[cases] for spring in self.spring]
        return EdgeSprings(np.array(stiffness), home)


def _of_cases(values: ByAxis, cases: Cases) -> ByAxis:
    """The values of both axes for the selected cases (k,)."""
    first, second = (None if axis is None else axis[cases] for axis in values)
    return first, second


def prestretched(
    film: FilmState,
    stretch: ByAxis,
    duration: Floats,
    relax: float | Floats,
    rtol: float,
    weight_stress: ByAxis = (None, None),
) -> tuple[FilmState, Cases]:
    """Films at rest, prestretched, relaxed for `relax` s, one number or (cases,), and given a damper, and their `Status` (cases,).

    `stretch` (cases,) of each axis is reached within `duration` (cases,) s; None is an axis that is free, or under the nominal
    stress `weight_stress` (cases,) in Pa, all of it from the beginning. Use a film only where its status is COMPLETED.
    """
    first, second = (Control.STRESS if target is None else Control.STRETCH for target in stretch)
    zero = np.zeros_like(duration)
    pieces = [Line.to((first, second), (*stretch, None), duration)]
    if any(load is not None for load in weight_stress):
        pieces.insert(0, Line.to((first, second), (*weight_stress, None), zero))
    if np.any(np.asarray(relax) > 0):
        pieces.append(Line.to((first, second), (None, None, None), np.full_like(duration, relax)))
    # only the final viscous stretches matter, not the stress on the way
    relaxing = replace(film, points=replace(film.points, stress_floor=np.full_like(film.points.stress_floor, np.inf)))
    if Control.STRESS in (first, second):
        followed = follow(relaxing, pieces, rtol=rtol)
        reached, status = followed.film, followed.status
    else:  # every spring flows for itself, in steps of its own
        springs, cases = film.points.modulus.shape
        followed = follow(relaxing.apart(), [piece.take(np.tile(np.arange(cases), springs)) for piece in pieces], rtol=FINER * rtol)
        reached, status = film.together(followed.film), followed.status.reshape(springs, cases).max(axis=0)
    internal = np.concatenate((reached.internal, reached.log_squared_stretch[:, None]), axis=1)
    return replace(reached, points=damped(film.points), internal=internal, time=zero, next_step=zero), status


def set_up(
    material: Material | Sequence[Material],
    film: Film,
    *,
    breakdown_field: ArrayLike | BreakdownLaw | None,
    solver: Solver,
    cases: int = 1,
) -> Setup:
    """Films from the arguments of a simulation, whose other arguments are for `cases` cases; each of the arrays has this length or
    1, or all have the same length if `cases` is 1.

    Raises `InputError` for invalid arguments.
    """
    materials = materials_of(material)
    if not materials:
        raise InputError("a material is needed")
    for entry in materials:
        if not entry.permittivity:
            needed = "which a film under voltage needs: state [dielectric] permittivity in the material file"
            raise InputError(f"{entry.name!r} has no permittivity, {needed}", argument="material")
    if not 0 <= film.relax < np.inf:
        raise InputError(f"{film.relax:g} s: it must not be negative", argument="relax")
    check_tolerance(solver.rtol)
    temperature = film.temperature
    if temperature is None:
        temperature = [material.reference_temperature for material in materials]
    fields = [] if breakdown_field is None or isinstance(breakdown_field, BreakdownLaw) else [breakdown_field]
    cases = one_set([cases, len(materials), *map(np.size, (*film.varied(), temperature, *fields))])
    thickness, prestretch = positive(film.thickness, "thickness", "m", cases), film.prestretches(cases)
    controls = film.controls
    share, weight_stress, ramp = (
        film.share(prestretch, cases, solver.mesh_rtol),
        film.weight_stress(thickness, prestretch),
        film.ramp(prestretch, cases),
    )
    temperatures = temperatures_of(temperature, cases)
    points = PointMaterial.of(materials, temperatures, solver.rtol)
    held = [axis for axis in prestretch if axis is not None]
    check_limits(points, held, ramp == 0, prestretch)
    _check_permittivity(points, prestretch)
    # the area of a free axis is that under uniaxial stress
    area = held[0] * held[1] if len(held) == 2 else np.sqrt(held[0]) if held else np.ones(cases)
    laws = [entry.breakdown for entry in materials] if breakdown_field is None else [breakdown_field]
    if any(load is not None for load in weight_stress) and any(
        isinstance(law, Breakdown) and len(law.prestretch) > 1 for law in laws
    ):
        needed_number = "the prestretch under a weight is not known beforehand: state one number, not a table"
        raise InputError(needed_number, argument="breakdown_field")
    damage = LawsOfCases.of(_damage(materials, temperatures), cases) or None
    endurance = FailureLaws(*_breakdown(laws, np.sqrt(area), thickness), damage)
    mesh = np.zeros(cases, dtype=np.intp)
    if share is not None and film.surrounded == "frame":
        mesh = _mesh(points, share, held[0], solver.mesh_rtol)
    ends = controls, endurance, weight_stress, share, mesh
    return Setup(points, temperatures, thickness, prestretch, ramp, film.relax, *ends, film.sprung(cases))


def _damage(materials: Sequence[Material], temperature: Floats) -> list[DamageLaw | None]:
    """The damage laws of cases at their temperatures (cases,) in degC: one for all, or one for each."""
    laws = [entry.damage for entry in materials]
    if all(law is None or law.activation_energy is None for law in laws):
        return laws
    each = list(materials) if len(materials) > 1 else [materials[0]] * temperature.size
    return [
        None if one.damage is None else one.damage.at(at, one.reference_temperature)
        for one, at in zip(each, temperature.tolist(), strict=True)
    ]


def _mesh(points: PointMaterial, share: Floats, prestretch: Floats, mesh_rtol: float) -> Cases:
    """The number of points (cases,) in the passive part of discs; `InputError` for a `mesh_rtol` that no number meets."""
    needed = points_needed(points, share, prestretch, mesh_rtol)
    if not needed.all():
        case = int(np.argmin(needed))
        film = f"the film around an electrode of share {float(share[case])!r}, at prestretch {prestretch[case]:g},"
        larger = next((rtol for rtol in COARSER if rtol > mesh_rtol and points_needed(points, share, prestretch, rtol).all()), None)
        instead = "nor so that a larger one would do" if larger is None else f"{larger:g} can be had"
        text = f"{mesh_rtol:g}: no division of {film} is so exact; {instead}"
        raise InputError(text, argument="mesh_rtol", case=of_case(case, share.size))
    return needed


def _breakdown(
    laws: Sequence[ArrayLike | BreakdownLaw | None], stretch: Floats, thickness: Floats
) -> tuple[Floats, StretchDependentBreakdown | None]:
    """E_EB (cases,) in V/m at the prestretch sqrt(l1 l2) of films with an undeformed thickness in m, both (cases,), infinite where
    it is not known; and its change with the state of the film after the prestretch, None if no law has one.

    There is one law or field for all films, or one law for each. Raises `InputError` for a field that is not positive.
    """
    cases, present = thickness.size, thickness / np.square(stretch)
    fields, following = np.full(cases, np.inf), list[BreakdownLaw | None]([None] * len(laws))
    for index, law in enumerate(laws):
        cases_of = slice(None) if len(laws) == 1 else slice(index, index + 1)
        if isinstance(law, BreakdownLaw):
            fields[cases_of] = law.of_film(stretch[cases_of], present[cases_of])
            following[index] = law if law.follows_film else None
        elif law is not None:
            fields = positive(law, "breakdown_field", "V/m", cases)
    followed = LawsOfCases.of(following, cases)
    return fields, StretchDependentBreakdown.of(followed, thickness, stretch) if followed else None


def _check_permittivity(points: PointMaterial, prestretch: ByAxis) -> None:
    """`InputError` for a prestretch at which the permittivity is not positive."""
    held = [axis for axis in prestretch if axis is not None]
    if not held:
        return
    # a free axis is assumed to contract as under uniaxial stress
    log_squared = 2 * np.log(np.stack((held[0], held[1] if len(held) == 2 else held[0] ** -0.5)))
    permittivity = points.permittivity_at(log_squared)
    for case in np.flatnonzero(~(np.isfinite(permittivity) & (permittivity > 0)))[:1].tolist():
        wrong = "the permittivity is not positive there: is stretch_coefficient in the material file right?"
        place = of_case(case, permittivity.size)
        raise InputError(f"{pair_in_words(prestretch, case)}: {wrong}", argument="prestretch", case=place)
