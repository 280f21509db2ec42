"""Actuation: prestretched and relaxed films under a voltage programme, until they fail or the programme ends."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, shown
from dielast.material.breakdown import BreakdownLaw
from dielast.material.leakage import Leakage
from dielast.material.material import Material, materials_of
from dielast.mechanics.criteria import CRITERIA, END, failures_of, names
from dielast.mechanics.criteria.breakdown import ElectricalBreakdown
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn
from dielast.mechanics.history import case_count, duration_of, electrical_pieces
from dielast.mechanics.load import ChargeStep, VoltageStep
from dielast.mechanics.stability import ONE_PERCENT, TimeScale
from dielast.simulate.actuation_history import ActuationHistory, run_films
from dielast.simulate.film_setup import MESH_RTOL, FilmSetup
from dielast.simulate.history import joined, simulating
from dielast.simulate.output import Output, check_end, stated_times
from dielast.simulate.setup import Setup, set_up
from dielast.simulate.wiring import Wiring


# the docstring is that of `actuate`, which simulates what this function has prepared
def prepare(
    material: Material | Sequence[Material],
    steps: Sequence[VoltageStep | ChargeStep],
    *,
    thickness: ArrayLike,
    prestretch: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] = 1.0,
    prestretch_rate: ArrayLike | None = None,
    relax: float = 0.0,
    boundary: str | tuple[str, str] = "dead-load",
    electrode_share: ArrayLike | None = None,
    mesh_rtol: float = MESH_RTOL,
    force: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None,
    width: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None,
    temperature: ArrayLike | None = None,
    breakdown_field: ArrayLike | BreakdownLaw | None = None,
    pull_in_timescale: TimeScale = ONE_PERCENT,
    stop_at: str | None = None,
    times: ArrayLike | None = None,
    points_per_decade: int = 30,
    with_end: bool | None = None,
    rtol: float = 1e-6,
    cycles: str | Sequence[int] | None = None,
    source_resistance: ArrayLike | None = None,
    leakage: Leakage | None = None,
    electrode_area: ArrayLike | None = None,
    electrical: bool | None = None,
    profile: ArrayLike | None = None,
) -> Callable[[], ActuationHistory]:
    """Prestretch films, hold them for `relax` s, and then drive them through the `steps`, from 0 V or from a charge of 0.

    The film: `thickness` is the undeformed one in m. `prestretch` is equibiaxial, or a pair (tuple) with None for an axis free of
    stress; it is reached at `prestretch_rate` in 1/s of the axis with the larger one, both axes together, or at once. `boundary`
    says for each axis what holds the film afterwards: "dead-load" is the nominal stress reached, "clamped" the stretch reached;
    "frame" and "strip" are films with a passive part, with an electrode on the share `electrode_share`. A `force` in N per `width`
    in m acts from the beginning of the prestretch (see `FilmSetup`, also for `mesh_rtol`).

    The run: `temperature` in degC, `rtol`, `times` in s since the programme began, and `points_per_decade` are as in `creep`, and
    so are the `cycles` of waveforms, here of the relative stretch of axis 1. `breakdown_field` is in V/m, or a law, such as a table
    over prestretch (the square root of the product of both axes); the material's by default; without any, there is no breakdown.
    `stop_at` names the event that ends a run, such as "breakdown", "pull-in" or "loss-of-tension", or is "end" for the whole
    programme; by default breakdown, or the first failure if no breakdown field is known. A run to breakdown, or by default, also
    ends where a passive part loses tension. The history of a run that ends at an event ends with the state at that event if
    `with_end`, by default unless `times` are given. `profile` are times in s at which films with a passive part have `profiles`.

    The circuit: a source of voltage may have a `source_resistance` in ohm to an electrode of `electrode_area` in m^2 on the
    undeformed film, and the film may have a `leakage`. Charge, current and energies are computed with either of them, with
    prescribed charges, or if `electrical` is True; not for films with a passive part.

    Every number may be one for all cases or one per case, shape (cases,). The equations are those of Sec. 3 of DOI
    10.1115/1.4030850. Raises `InputError` for invalid arguments; a run in which the numerics give up is an `Outcome`, not an error.
    """
    if stop_at not in (None, *names(), END):
        raise InputError(f"{stop_at!r}: it must be one of {', '.join((*names(), END))}", argument="stop_at")
    cases = case_count(steps, source_resistance, electrode_area, *(() if leakage is None else leakage.varied()))
    setup = set_up(
        material,
        FilmSetup(thickness, prestretch, prestretch_rate, relax, boundary, electrode_share, mesh_rtol, force, width),
        temperature=temperature,
        breakdown_field=breakdown_field,
        rtol=rtol,
        cases=cases,
    )
    cases = setup.temperature.size
    charge = isinstance(next(iter(steps), None), ChargeStep)
    wiring = Wiring.of(charge, source_resistance, leakage, electrode_area, setup.thickness, electrical)
    output = Output.of(times, cases, points_per_decade, cycles, steps)
    pieces = electrical_pieces(steps, setup.controls, np.ones(cases) if charge else setup.thickness)
    if setup.share is not None and wiring.stated:
        only = "a film with a passive part, boundary frame or strip, can only be driven by an ideal source of voltage"
        raise InputError(f"{only}; its charge and energies are not computed", argument=wiring.stated[0])
    duration = duration_of(pieces, cases)
    check_end(output.times, duration, "programme")
    profile_times = None if profile is None else stated_times(profile, cases, "profile")
    if profile_times is not None and setup.share is None:
        raise InputError("a profile needs a film with a passive part, boundary frame or strip", argument="profile")
    check_end(profile_times, duration, "programme", "profile")
    stops = _stops(stop_at, materials_of(material), setup)
    parts = setup.groups(wiring.has_circuit)

    def simulated() -> ActuationHistory:
        histories = [
            run_films(
                setup,
                part,
                wiring,
                pieces,
                output,
                timescale=pull_in_timescale,
                stops=stops,
                with_end=times is None if with_end is None else with_end,
                profile_times=profile_times,
                rtol=rtol,
            )
            for part in parts
        ]
        place = np.empty(cases, dtype=np.intp)
        place[np.concatenate(parts)] = np.arange(sum(part.size for part in parts))
        history: ActuationHistory = joined(histories, place)
        return history

    return simulated


actuate = simulating(prepare, "actuate", ActuationHistory)


def _stops(stop_at: str | None, materials: Sequence[Material], setup: Setup) -> tuple[str, ...]:
    """The names of the criteria that end a film, whichever happens first; raises `InputError` if none of them can happen."""
    if stop_at == END:
        return ()
    known = np.isfinite(setup.endurance.breakdown_field)
    breakdown = stop_at == ElectricalBreakdown.name or (stop_at is None and bool(known.any()))
    if breakdown and not known.all():
        without = materials[int(np.argmin(known)) if len(materials) > 1 else 0].name
        needed = f"material {shown(without)} has no breakdown field: state [breakdown] field in the recipe or the material file"
        raise InputError(f"{needed}, or stop at {shown(PullIn.name)} or {shown(END)}", argument="stop_at")
    if stop_at is not None and not any(criterion.concerns(materials) for criterion in CRITERIA if criterion.name == stop_at):
        needed = f"the material file needs [{stop_at}] with field, time and exponent"
        raise InputError(f"{shown(stop_at)} cannot happen: {needed}", argument="stop_at")
    stops = (ElectricalBreakdown.name,) if breakdown else failures_of(materials) if stop_at is None else (stop_at,)
    # a slack passive film wrinkles, which these equations do not describe
    slack = setup.share is not None and (breakdown or stop_at is None)
    return (*stops, LossOfTension.name) if slack else stops
