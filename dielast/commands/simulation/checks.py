"""Warnings of valid simulations that look like mistakes, by `dielast.material.checks`, from recipes, steps and results."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import warn
from dielast.commands.simulation.cases import last
from dielast.commands.simulation.result import CaseResult, SolvedCase, StatedCase
from dielast.commands.simulation.timed_steps import TimedStep
from dielast.handover.law_section import breakdown
from dielast.material.breakdown import BreakdownLaw
from dielast.material.checks import (
    FAINTEST,
    STRONGEST,
    USUAL,
    warn_of_elongation,
    warn_of_field,
    warn_of_prestretches,
    warn_of_stretch,
)
from dielast.material.material import Material
from dielast.material.use_checks import Pace, fastest_branch, warn_of_lasting, warn_of_paces, warn_of_stretches, warn_of_use
from dielast.mechanics.load import Waveform
from dielast.numerics.arrays import Floats
from dielast.simulate.profile import unresolved

if TYPE_CHECKING:
    from dielast.commands.actuate.recipe import ActuateRecipe

AnyCase = TypeVar("AnyCase", bound=StatedCase)

EARLY, EARLIEST = 1e-3, "the first thousandth of what follows takes"
"""The part of the duration after a load at once in which the response is not of interest, though tables begin there."""
MOST_SPANS = 4  # runs of case numbers that a warning names
SLACK = 0.01  # of the highest stress: a larger compressive stress gives a warning
HELD = {
    ("frame", "frame"): ("in a frame", "the film around the electrode"),
    ("strip", "strip"): ("in a strip", "the film beside the electrode"),
    ("clamped", "clamped"): ("with clamped edges", "the film"),
}
"""Boundaries that hold both axes -> where a film is, and what the voltage pushes together if nothing stretches it."""
AT_ONCE = "as the voltage comes on"


def warn_of_tests(cases: Sequence[StatedCase]) -> None:
    """Warn of cases of `relax` or `creep` whose loads, specimens or temperatures look like something else."""
    _warn_of_temperatures(cases)
    if cases[0].recipe.kind == "relax":
        stretches = [value for case in cases for value in case.steps.targets]
        warn_of_stretch(min(stretches, default=1.0), max(stretches, default=1.0))
        return
    specimens = [case.recipe.specimen for case in cases if case.recipe.specimen is not None]
    thickness = [specimen.thickness for specimen in specimens if specimen.thickness is not None]
    USUAL["specimen"].warn(thickness)


def warn_of_membranes(cases: Sequence[SolvedCase]) -> None:
    """Warn of results of `relax` or `creep` that ask too much of their material, or show that a load looks like something else."""
    relaxing = cases[0].recipe.kind == "relax"
    _warn_of_materials(cases, [case.recipe.mode for case in cases])
    warn_of_paces(_paces(cases))
    if relaxing:
        _warn_of_slack([case.result for case in cases])
        return
    lowest = [float(np.min(case.result.columns["nominal_stress_1 [Pa]"], initial=0.0)) for case in cases]
    _warn_of_cases("the load presses", [f"by {-low:.3g} Pa" if low < 0 else "" for low in lowest], ": a thin film buckles instead")
    loaded = [case for case in cases if any(case.steps.targets)]
    if loaded:
        stretches = [_stretches(case.result) for case in loaded]
        margins = [
            case.material.equilibrium_law.margin(np.square(stretch))
            if case.material.equilibrium_modulus > 0
            else np.ones(stretch.shape[1])
            for case, stretch in zip(loaded, stretches, strict=True)
        ]
        first, second = np.concatenate(stretches, axis=1)
        warn_of_elongation(first, second, np.concatenate(margins))


def warn_of_programmes(cases: Sequence[StatedCase]) -> None:
    """Warn of cases of `actuate` whose films, voltages, charges or temperatures look as if they were in another unit."""
    recipes: Sequence[ActuateRecipe] = [case.recipe for case in cases]
    films, materials = [recipe.film for recipe in recipes], [case.material for case in cases]
    _warn_of_temperatures(cases)
    stated = [breakdown(recipe.breakdown) for recipe in recipes]
    USUAL["breakdown field"].warn([field for law in stated if law is not None for field in law.typical_fields()])
    steady = all(
        recipe.control == "charge" and not (material.dielectric and material.dielectric.depends_on_stretch)
        for recipe, material in zip(recipes, materials, strict=True)
    )
    limits = list(map(_limit, cases))
    if any(recipe.stop.at is None for recipe in recipes):
        warn_of_no_breakdown([law is not None for law in limits], materials, steady)
    thickness = np.array([film.thickness for film in films])
    warn_of_setups([film.prestretch for film in films], [recipe.held for recipe in recipes], thickness, limits)
    highest = np.array([max(map(abs, case.steps.targets), default=0.0) for case in cases])
    before_motion, limit = np.array(list(map(_fields, cases))).T
    field = highest * before_motion
    # if none is known, the plausible value closest to the field
    limit = np.where(np.isinf(limit), np.clip(field, FAINTEST, STRONGEST), limit)
    warn_of_field(field, limit, np.array([recipe.control == "charge" for recipe in recipes]))


def warn_of_films(cases: Sequence[SolvedCase]) -> None:
    """Warn of results of `actuate` that ask too much of their material, or of films that break down at once."""
    films = [case.recipe.film for case in cases]
    even = [len({*film.prestretch}) == 1 and len({*film.boundary}) == 1 for film in films]
    _warn_of_materials(cases, ["equibiaxial" if both else None for both in even])
    leaks = [case.recipe.leakage for case in cases]
    scale = [np.inf if leak is None or leak.field is None or not leak.conductivity else leak.field for leak in leaks]
    reached = [float(np.max(np.abs(case.result.columns["true_field [V/m]"]), initial=0.0)) for case in cases]
    USUAL["leakage"].warn(max(field / of_law for field, of_law in zip(reached, scale, strict=True)))
    paces, broken = list(_paces(cases)), [""] * len(cases)
    for index, case in enumerate(cases):
        at_once = AT_ONCE.replace("voltage", case.recipe.control)
        for event in case.result.events or ():
            if event.name != "breakdown" or event.time > 0:
                continue
            before_motion, limit = _fields(case)
            if case.steps.reached_at_once * before_motion >= limit:
                broken[index] = at_once
            else:
                what = f"{_of_case(index, len(cases))}the film breaks down {at_once}, after"
                paces.append(Pace(what, 0.0, fastest_branch(case.material, case.temperature), case.temperature))
    warn_of_paces(paces)
    _warn_of_profiles([case.result for case in cases])
    _warn_of_cases("the film breaks down", broken, ": it is beyond the breakdown field from the start")


def _limit(case: StatedCase) -> BreakdownLaw | None:
    """The law of the breakdown field of a film: that of the recipe, or else that of the material."""
    return breakdown(case.recipe.breakdown) or case.material.breakdown


def _fields(case: StatedCase) -> tuple[float, float]:
    """The true field in V/m that 1 V or 1 C/m^2 makes in a film before it moves, and the breakdown field, infinite if unknown."""
    film, law = case.recipe.film, _limit(case)
    area = film.prestretch[0] * film.prestretch[1]
    limit = np.inf if law is None else float(law.of_film(np.sqrt(area), film.thickness / area))
    if case.recipe.control != "charge":
        return area / film.thickness, limit
    dielectric = case.material.dielectric
    permittivity = 1.0 if dielectric is None else float(dielectric.at(np.array([case.temperature]))[0])
    return 1 / (permittivity * area), limit


def warn_of_no_breakdown(has_limit: Sequence[bool], materials: Sequence[Material], steady: bool = False) -> None:
    """Warn of films of which none `has_limit`, a breakdown field, and without damage: only pull-in ends them, and nothing ends
    `steady` films, under a charge at a permittivity that does not depend on stretch, which have no pull-in.
    """
    if not any(has_limit) and all(material.damage is None for material in materials):
        ends = "no failure ends a film under a charge" if steady else "pull-in alone ends a film"
        warn(f"no breakdown field is known, so that {ends}: state [breakdown] field")


def warn_of_setups(
    prestretch: Sequence[tuple[float, float]],
    boundary: Sequence[tuple[str, ...]],
    thickness: ArrayLike,
    limits: Sequence[BreakdownLaw | None],
) -> None:
    """Warn of prestretches outside the range of the breakdown `limits`, of thicknesses (any shape) in m that seem to be in
    another unit, and of films without a prestretch whose edges a `boundary` holds: they have no tension to lose.
    """
    warn_of_prestretches(prestretch, limits)
    USUAL["film"].warn(thickness)
    for where, pressed in dict.fromkeys(
        HELD[held] for pair, held in zip(prestretch, boundary, strict=True) if max(pair) == 1 and held in HELD
    ):
        buckles = f"without prestretch the voltage pushes {pressed} together, which buckles"
        warn(f"film.prestretch: 1 {where}: {buckles}; the result is of a film that stays flat")


def _warn_of_temperatures(cases: Sequence[StatedCase]) -> None:
    """Warn of temperatures that look wrong, or for which the materials were not measured."""
    for alike in _by_material(cases):
        warn_of_use(alike[0].material, [case.temperature for case in alike])


def _warn_of_materials(cases: Sequence[SolvedCase], modes: Sequence[str | None]) -> None:
    """Warn of times and stretches that the materials are used at; `modes` are the modes of loading of the cases."""
    for alike in _by_material(cases):
        temperature = [case.temperature for case in alike]
        ends = [np.max(case.result.columns["time [s]"], initial=0.0) for case in alike]
        warn_of_lasting(alike[0].material, temperature, ends)
    for mode in dict.fromkeys(modes):
        for alike in _by_material([case for case, other in zip(cases, modes, strict=True) if other == mode]):
            warn_of_stretches(alike[0].material, np.concatenate([_stretches(case.result) for case in alike], axis=1), mode)


def _by_material(cases: Sequence[AnyCase]) -> Iterable[list[AnyCase]]:
    """The cases of each material."""
    groups: dict[int, list[AnyCase]] = {}
    for case in cases:
        groups.setdefault(id(case.material), []).append(case)
    return groups.values()


def _stretches(result: CaseResult) -> Floats:
    """The stretches (2, rows) of a case."""
    return np.array([result.columns[f"stretch_{axis} [1]"] for axis in (1, 2)])


def _warn_of_slack(results: Sequence[CaseResult]) -> None:
    """Warn of specimens that are unloaded faster than they contract: they go slack, or are pushed where that is stated."""
    loose, pushed = list[str](), list[str]()
    for result in results:
        stress, phases = result.columns["nominal_stress_1 [Pa]"], [each for each in result.slack if each.event == "slack"]
        low, high = float(np.min(stress, initial=0.0)), float(np.max(stress, initial=0.0))
        often = f"{len(phases)} times, first " if len(phases) > 1 else ""
        loose += [f"{often}after {first.time:.4g} s, at a stretch of {first.stretch:.6g}" for first in phases[:1]] or [""]
        pushed.append(f"to {low:.3g} Pa" if -low > SLACK * high > 0 else "")
    grips = 'where grips press it, state slack = "pushes"'
    _warn_of_cases("the specimen goes slack", loose, f", and bears nothing; {grips}")
    _warn_of_cases("the stress falls", pushed, ", by which the film is pushed: a thin one goes slack instead")


def _warn_of_profiles(results: Sequence[CaseResult]) -> None:
    """Warn of profiles in which the mesh does not resolve the film next to the electrode."""
    times = [np.zeros(0) if result.profile is None else unresolved(result.profile) for result in results]
    there = "stretches there are inexact, or empty where none is possible"
    late = f" is not resolved next to the electrode: {there}; a smaller solver.mesh_rtol may help"
    _warn_of_cases("the profile", [f"after {found[0]:g} s" if found.size else "" for found in times], late)


def _warn_of_cases(what: str, found: Sequence[str], why: str) -> None:
    """Warn of `what` was `found` in cases, empty where it was not: of the first of them, and which others there are."""
    numbers = np.flatnonzero([bool(text) for text in found])
    if numbers.size:
        others = np.split(numbers[1:], np.flatnonzero(np.diff(numbers[1:]) > 1) + 1)
        spans = [f"{run[0]}" if run.size == 1 else f"{run[0]} to {run[-1]}" for run in others[:MOST_SPANS] if run.size]
        left = sum(run.size for run in others[MOST_SPANS:])
        also = f" (also {', '.join(spans)}{f' and {left} more' if left else ''})" if spans else ""
        warn(f"{f'case {numbers[0]}{also}: ' if len(found) > 1 else ''}{what} {found[numbers[0]]}{why}")


def _of_case(index: int, cases: int) -> str:
    return f"case {index}: " if cases > 1 else ""


def _paces(cases: Sequence[SolvedCase]) -> Iterator[Pace]:
    """The durations of all loads in all cases."""
    for index, case in enumerate(cases):
        recipe, film = case.recipe, getattr(case.recipe, "film", None)
        fastest, of_case = fastest_branch(case.material, case.temperature), _of_case(index, len(cases))
        # a film under voltage may fail at any time, not only at output times
        loads = _loads(case.steps, last(case.result.columns["time [s]"]), recipe.output.times if film is None else None)
        took = () if film is None else [prestretching(film.prestretch, film.prestretch_rate, film.relax)]
        for what, lasting in [*(("prestretch and relaxation take", time) for time in took), *loads]:
            yield Pace(of_case + what, lasting, fastest, case.temperature)


def prestretching(prestretch: tuple[float, float], rate: float | None, relax: float) -> float:
    """The time in s of prestretch and relaxation before the voltage; infinite without a prestretch, or if both are at once."""
    further = max(prestretch) - 1
    return (further / rate if rate else 0.0) + relax or np.inf if further else np.inf


def _loads(steps: Sequence[TimedStep], end: float, outputs: Sequence[float] | None) -> Iterator[tuple[str, float]]:
    """For each step that changes the load before the `end`: a clause about it, and its duration in s; for a load at once, the time
    until the first output of interest, which is among the times of the `outputs` in s if these are stated.
    """
    for timed, following in zip(steps, [*steps[1:], None], strict=True):
        if timed.begin >= end or all(value == timed.before for value, _ in timed.corners):
            continue
        step, wave = f"step[{timed.number}]", timed.driven if isinstance(timed.driven, Waveform) else None
        took = timed.lasts if wave is None else 0.5 * float(np.asarray(wave.period))
        looked_at = next((time - timed.begin for time in outputs or () if time > timed.begin), None)
        if looked_at is not None and looked_at >= took:
            yield f"{step} is first looked at after", looked_at
        elif took > 0 and (looked_at is not None or outputs is None):
            yield f"{step} {'takes' if wave is None else 'goes up or down within'}", min(took, end - timed.begin)
        elif outputs is None and following is not None and end > timed.begin:
            early, ended = EARLY * following.lasts, end - timed.begin
            if early > 0:
                yield f"{step} comes at once, and {'the simulation ends after' if ended < early else EARLIEST}", min(early, ended)
