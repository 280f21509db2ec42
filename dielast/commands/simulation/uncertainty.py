"""The draws for `[uncertainty]`, and their texts in summaries and legends."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, in_keys, reached_by, warn
from dielast.commands.simulation.cases import material_key, one_or_list
from dielast.commands.simulation.uncertainty_recipe import FilmUncertainty, Uncertainty
from dielast.handover.law_section import breakdown
from dielast.handover.material_draws import further_constants, in_folder_of, read_draws_beside
from dielast.handover.material_file import parse_file
from dielast.io.files import Inputs
from dielast.material.intervals import fewest_draws
from dielast.material.material import Material
from dielast.material.scatter import (
    FilmScatter,
    Sample,
    damage_scatter,
    draw_sample,
    field_scatter,
    of_area,
    specimen_scatter,
)
from dielast.material.spectrum import Spectrum
from dielast.recipe.cases import Case
from dielast.simulate.film_setup import reachable

_NAMED = 4  # further prestretches in a message
BESIDE = 1.1  # factor by which a material may lie outside the range of its draws by chance
NOTHING = 1e-6  # of the instantaneous modulus, which a melt falls below soon after its slowest time


@reached_by("uncertainty")
def sample_of(case: Case[Any], material: Material, inputs: Inputs) -> Sample:
    """The draws of the material of a case; raises `InputError` if nothing differs between them."""
    name, uncertainty = case.recipe.material, case.recipe.uncertainty
    if case.of_material:
        check_unchanged(name, inputs, material, list(case.of_material))
    members = read_draws_beside(inputs, name, material)
    if members and len(members) < (fewest := fewest_draws(uncertainty.level)):
        raise InputError(
            f"the {len(members)} draws of {name} are too few for an interval of level {uncertainty.level:g}: at least {fewest} are "
            "needed",
            key="uncertainty.level",
        )
    if members:
        _warn_of_draws(name, material, members)
        if (film := getattr(case.recipe, "film", None)) is not None:
            alike = getattr(case.recipe, "sensitivity", False)  # which compares the same draws of all films
            members = _stretchable(members, film.prestretches, film.prestretch_rate is None, uncertainty, alike)
    films: FilmUncertainty | None = uncertainty if isinstance(uncertainty, FilmUncertainty) else None
    scatter: dict[str, Any] = {} if films is None else films.scatter()
    area, share = (None, None) if films is None else (films.area, films.failure_share)
    if "damage" in scatter and material.damage is None:
        raise InputError(f"{name} has no [damage] that could scatter", key="uncertainty.damage")
    field = getattr(case.recipe, "breakdown", None) or material.breakdown or material.damage
    if "breakdown_field" in scatter and field is None:
        missing = "no breakdown field is known that could scatter: [breakdown] field in the recipe or the material file"
        raise InputError(missing, key="uncertainty.breakdown_field")
    limit = breakdown(getattr(case.recipe, "breakdown", None))
    if limit is not None:  # whose scatter is that of the recipe's law
        members, material = tuple(replace(member, breakdown=limit) for member in members), replace(material, breakdown=limit)
    if area is not None:
        if limit is not None:
            raise InputError(
                "is for the material's own breakdown: the recipe's [breakdown] states that of its films", key="uncertainty.area"
            )
        with in_keys({"area": "uncertainty.area"}):
            members, material = tuple(of_area(member, area) for member in members), of_area(material, area)
    stated = films is not None and (field_scatter(material) is not None or damage_scatter(material) is not None)
    if share is not None and not (scatter or stated):
        raise InputError("nothing scatters from film to film, of which this could be a share", key="uncertainty.failure_share")
    specimens = uncertainty.specimens and specimen_scatter(material) is not None
    if uncertainty.specimens and not specimens and "specimens" in uncertainty.model_fields_set:
        warn(f"{name} states no scatter of specimens in [calibrated], which calibrate writes", key="uncertainty.specimens")
    if not members and not scatter and not stated and not specimens:
        raise InputError(
            f"{name} names no draws, and no scatter is stated: mastercurve with [uncertainty] and then spectrum write a "
            "material with draws",
            key="uncertainty",
        )
    if specimens and not members:
        warn(f"{name} names no draws: intervals leave the errors of its constants out; calibrate writes draws", key="uncertainty")
    draws = uncertainty.draws
    random = specimens or (share is None and (scatter or stated))
    if members and not random and draws > len(members):
        # a draw that is used again adds no information
        if "draws" in uncertainty.model_fields_set:
            less = f"{name} has {len(members)} draws, and nothing else scatters: {len(members)} draws are used instead of {draws}"
            warn(less, key="uncertainty.draws")
        draws = len(members)
    return draw_sample(
        members or (material,),
        draws,
        seed=uncertainty.seed,
        scatter=FilmScatter(**scatter),
        share=share,
        area=area,
        specimens=specimens,
    )


def _stretchable(
    members: Sequence[Material], prestretches: Sequence[tuple[float, float]], at_once: bool, uncertainty: Uncertainty, alike: bool
) -> tuple[Material, ...]:
    """The draws whose springs can be prestretched to one of the `prestretches`; to all of them if all films must have `alike`
    draws, or too few would be left of one: that a film was prestretched rules the others out, with a warning.
    """
    pairs, fewest = np.array(prestretches), fewest_draws(uncertainty.level)
    reached = reachable(members, pairs, at_once)
    alike = alike or int(reached[: uncertainty.draws].sum(axis=0).min()) < fewest
    if reached.all() or (alike and int(reached.all(axis=1).sum()) < fewest):
        return tuple(members)  # none, or most: a mistake that the first of them names
    locks = np.any(~reached, axis=1, keepdims=True) if alike else ~reached
    farthest = max(prestretches, key=lambda pair: pair[0] ** 2 + pair[1] ** 2 + (pair[0] * pair[1]) ** -2)
    named = [" x ".join(f"{axis:g}" for axis in dict.fromkeys(pair)) for pair in ([farthest] if alike else prestretches)]
    first, *others = [(count, name) for count, name in zip(locks.sum(axis=0).tolist(), named, strict=True) if count]
    lock = f"{first[0]} of {len(members)} draws lock below a prestretch of {first[1]}"
    below = [f", {count} below {name}" for count, name in others[:_NAMED]] + [", ..."] * (len(others) > _NAMED)
    slower = ", at once: state film.prestretch_rate" if reachable(members, pairs, False).sum() > reached.sum() else ""
    out = "left out" if len(prestretches) == 1 else "left out of all films" if alike else "left out of these films"
    warn(f"{lock}{''.join(below)}{slower}; they are {out}")
    return tuple(member for member, flags in zip(members, reached, strict=True) if (flags.all() if alike else flags.any()))


def check_unchanged(name: str, inputs: Inputs, material: Material, changes: Sequence[str]) -> None:
    """`InputError` for a change of constants that differ between the draws of the `material`, which is that of a material file with
    `changes`.
    """
    file = parse_file(inputs.read(name), name)
    if file.draws is None:
        return
    plain = file.material()
    drawn = [
        part
        for part, changed in (
            ("the equilibrium modulus", material.equilibrium_modulus != plain.equilibrium_modulus),
            ("the relaxation spectrum", _differ(material.spectrum, plain.spectrum)),
            ("the shift law", material.shift.name != plain.shift.name or material.shift.drawn() != plain.shift.drawn()),
            ("the reference temperature", material.reference_temperature != plain.reference_temperature),
        )
        if changed
    ]
    # the draws of a calibration have all constants of a law
    further = further_constants(inputs.read(in_folder_of(name, file.draws)))
    sections = {path.partition(".")[0] for path in further} & {key.partition(".")[0] for key in changes}
    drawn += [f"[{section}]" for section in sorted(sections)]
    if drawn:
        what = f"the draws of {name} differ in {' and '.join(drawn)}"
        raise InputError(f"{what}, which {', '.join(changes)} cannot change", key="uncertainty")


def _differ(first: Spectrum, second: Spectrum) -> bool:
    """Whether two spectra differ in times or moduli."""
    pairs = ((first.relaxation_time, second.relaxation_time), (first.shear_modulus, second.shear_modulus))
    return not all(np.array_equal(first, second) for first, second in pairs)


def _warn_of_draws(name: str, material: Material, members: Sequence[Material]) -> None:
    """Warn of draws that are not about the material."""
    tau = np.union1d(material.spectrum.relaxation_time, members[0].spectrum.relaxation_time)
    with np.errstate(over="ignore"):  # a time beyond all numbers is one at which all has relaxed
        time = np.append(tau, 10 * tau.max(initial=1.0))
        modulus = material.spectrum.relaxation_modulus(time, material.equilibrium_modulus)
        drawn = np.array([member.spectrum.relaxation_modulus(time, member.equilibrium_modulus) for member in members])
        low, high = drawn.min(axis=0), drawn.max(axis=0)
        counts = np.maximum(modulus, high) > NOTHING * modulus.max()
        missed = counts & ((modulus * BESIDE < low) | (modulus > high * BESIDE))
    for k in np.flatnonzero(missed)[:1]:
        warn(
            f"a shear modulus of {modulus[k]:.4g} Pa after {time[k]:.3g} s is far from those of all draws, {low[k]:.4g} to "
            f"{high[k]:.4g} Pa: if the material has been edited, make its draws anew",
            file=name,
        )


def uncertainty_headline(
    uncertainties: Sequence[Uncertainty | None], samples: Sequence[Sample | None]
) -> dict[str, dict[str, Any]]:
    """The section of a summary that says what the intervals of the cases are; none without them."""
    pairs = zip(uncertainties, samples, strict=True)
    rows = [
        {"draws": len(sample), "materials": len(set(map(id, sample.materials))), "seed": stated.seed, "level": stated.level}
        for stated, sample in pairs
        if stated is not None and sample is not None
    ]
    if not rows:
        return {}
    values = {key: [row[key] for row in rows] for key in rows[0]}
    return {"uncertainty": {key: row[0] if len(set(row)) == 1 else one_or_list(row) for key, row in values.items()}}


def samples_of(cases: Sequence[Case[Any]], materials: Sequence[Material], inputs: Inputs) -> list[Sample | None]:
    """The draws of every case, none in cases without `[uncertainty]`."""
    keys = [_key_of_draws(case) for case in cases]
    drawn: dict[str, Sample] = {}
    for key, case, material in zip(keys, cases, materials, strict=True):
        if case.recipe.uncertainty is not None and key not in drawn:
            drawn[key] = sample_of(case, material, inputs)
    return [drawn.get(key) for key in keys]


def _key_of_draws(case: Case[Any]) -> str:
    """Of cases with equal keys, the draws are the same."""
    film = getattr(case.recipe, "film", None)
    stretched = "" if film is None else f"{film.prestretches} {film.prestretch_rate}"
    return f"{material_key(case)}\n{case.recipe.uncertainty!r}\n{getattr(case.recipe, 'breakdown', None)!r}\n{stretched}"


def typical_materials(materials: Sequence[Material], samples: Sequence[Sample | None]) -> list[Material]:
    """The materials of the films without scatter of the cases; cases that share material and draws go on sharing a material."""
    made: dict[tuple[int, int], Material] = {}
    for material, sample in zip(materials, samples, strict=True):
        made.setdefault((id(material), id(sample)), material if sample is None else sample.typical(material))
    return [made[id(material), id(sample)] for material, sample in zip(materials, samples, strict=True)]


def interval_label(recipes: Sequence[Any]) -> str:
    """What a legend calls the bands of these recipes, such as "90 % interval"."""
    levels = sorted({recipe.uncertainty.level for recipe in recipes if recipe.uncertainty is not None})
    return " and ".join(f"{100 * level:g} %" for level in levels) + " interval" + "s" * (len(levels) > 1)
