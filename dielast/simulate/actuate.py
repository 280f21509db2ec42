"""Actuation: a prestretched and relaxed film moves under a voltage programme until it fails or the programme ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, shown
from dielast.material.breakdown import BreakdownLaw
from dielast.material.leakage import Leakage
from dielast.material.material import Material
from dielast.mechanics.criteria import CRITERIA, END, names
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.history import electrical_pieces
from dielast.mechanics.load import ChargeStep, VoltageStep
from dielast.mechanics.stability import ONE_PERCENT, TimeScale
from dielast.simulate.actuation_history import ActuationHistory, electrical_of, history_of
from dielast.simulate.cycles import CycleTable
from dielast.simulate.film_runs import FilmRuns, run_films
from dielast.simulate.film_setup import MESH_RTOL, FilmSetup
from dielast.simulate.profile import Profiles, given_times
from dielast.simulate.setup import set_up
from dielast.simulate.wanted import Wanted, check_cycles, check_end
from dielast.simulate.wiring import Wiring


def actuate(
    material: Material | Sequence[Material],
    steps: Sequence[VoltageStep] | Sequence[ChargeStep],
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
    stop_at: str = "breakdown",
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
) -> ActuationHistory:
    """Films of undeformed `thickness` (m), prestretched, held for `relax` s, then driven through the `steps` from 0 V, or from a
    charge of 0.

    `prestretch` is equibiaxial, or a pair (tuple) with None for an axis left free of stress; it is reached at `prestretch_rate`
    (1/s, of the larger axis; both ramp together) or at once. A `force` in N on a `width` in m hangs on it from the beginning (see
    `FilmSetup`). `boundary` says for each axis whether it is then a "dead-load", the
    nominal stress reached, or "clamped"; "frame" and "strip" are films with a passive part, of which the electrode covers
    `electrode_share` (see `FilmSetup`). `breakdown_field` in V/m, or over prestretch (the root of both axes' product), the
    material's by default. A run ends with the first event `stop_at`, such as "breakdown", "pull-in" or "loss-of-tension", or goes
    through them all to the "end" of the programme; one that is to stop at breakdown also stops where a passive part goes slack.
    Cases, `temperature`, `times` (since the programme began), `points_per_decade` and `rtol` as in `creep`, and the `cycles` of
    waveforms, which are about the relative stretch of axis 1. Films with a passive part have `profiles` at the times of `profile`.
    The history of a run that stops ends `with_end`, with the film as it was at the event, by default unless `times` are given.

    A source of voltage may have a `source_resistance` in ohm, between it and the electrode, of an `electrode_area` in m^2 on the
    undeformed film; through the film there may be a `leakage`. Charge, current and energies are given with any of these, with
    charges, or where `electrical` says so. None of these is known of films with a passive part. Raises `InputError` for anything
    wrong with the arguments; numerics that give up are an outcome.
    """
    if stop_at not in (*names(), END):
        raise InputError(f"{stop_at!r}: it must be one of {', '.join((*names(), END))}", argument="stop_at")
    materials = [material] if isinstance(material, Material) else list(material)
    if stop_at != END and not any(known.concerns(materials) for known in CRITERIA if known.name == stop_at):
        needed = f"the material file needs [{stop_at}] with field, time and exponent"
        raise InputError(f"{shown(stop_at)} cannot happen: {needed}", argument="stop_at")
    if points_per_decade < 1:
        raise InputError(f"{points_per_decade}: at least one is needed", argument="points_per_decade")
    setup = set_up(
        material,
        FilmSetup(thickness, prestretch, prestretch_rate, relax, boundary, electrode_share, mesh_rtol, force, width),
        temperature=temperature,
        breakdown_field=breakdown_field,
        breakdown_needed=stop_at == "breakdown",
        rtol=rtol,
        spanning=[
            *(value for step in steps for value in step.varied()),
            *(value for value in (source_resistance, electrode_area) if value is not None),
            *([] if leakage is None else leakage.varied()),
        ],
    )
    cases = setup.temperature.size
    charge = isinstance(next(iter(steps), None), ChargeStep)
    wiring = Wiring.of(charge, source_resistance, leakage, electrode_area, setup.thickness)
    pieces = electrical_pieces(steps, setup.controls, np.ones(cases) if charge else setup.thickness)
    with_circuit = charge or source_resistance is not None or leakage is not None
    electrical = with_circuit if electrical is None else electrical
    if setup.passive is not None and (with_circuit or electrical):
        named = {"steps": charge, "source_resistance": source_resistance is not None, "leakage": leakage is not None}
        argument = next((name for name, is_stated in named.items() if is_stated), "electrical")
        only = "a film with a passive part, boundary frame or strip, takes an ideal source of voltage alone"
        raise InputError(f"{only}, and says nothing of charge and energies", argument=argument)
    wanted = Wanted.of(times, cases, points_per_decade, cycles)
    check_cycles(wanted.cycles, pieces)
    whole = np.sum([piece.begin(np.zeros((3, cases))).duration for piece in pieces], axis=0)
    check_end(wanted.times, whole, "programme")
    seen_at = given_times(profile)
    if seen_at is not None:
        if setup.passive is None:
            raise InputError("it is of films with a passive part, boundary frame or strip", argument="profile")
        check_end(np.broadcast_to(seen_at, (cases, seen_at.size)), whole, "programme", "profile")
    until = () if stop_at == END else (stop_at,)
    # a passive film that is slack wrinkles, which these equations know nothing of
    slack = (LossOfTension.name,) if setup.passive is not None and stop_at == "breakdown" else ()
    parts = setup.groups(wiring.has_circuit)
    taken = [[piece.take(part) for piece in pieces] for part in parts]
    runs = [
        run_films(setup, wiring, part, pull_in_timescale, until, some, wanted, electrical, rtol, seen_at, slack)
        for part, some in zip(parts, taken, strict=True)
    ]
    place = np.empty(cases, dtype=np.intp)
    place[np.concatenate(parts)] = np.arange(sum(part.size for part in parts))
    ends = times is None if with_end is None else with_end
    tables = [run.cycles for run in runs if run.cycles is not None]
    cycling = CycleTable.joined(tables, place) if tables else None
    history, extra = history_of(setup, FilmRuns.joined(runs, place), (*until, *slack), ends, cycling)
    if electrical:
        known = electrical_of(extra, setup.thickness, wiring, source_resistance is not None, leakage is not None)
        history = replace(history, electrical=known)
    if seen_at is None:
        return history
    ended = np.array([outcome.time for outcome in history.outcome])
    collected = [case for run, part in zip(runs, parts, strict=True) if run.profiler for case in run.profiler.collect(ended[part])]
    return replace(history, profiles=Profiles(tuple(collected[row] for row in place.tolist())))
