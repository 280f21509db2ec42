"""Actuation: prestretched and relaxed films under a voltage programme, until they fail or the programme ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dielast.errors import InputError, shown
from dielast.material.material import Material, materials_of
from dielast.mechanics.criteria import CRITERIA, END, failures_of, names
from dielast.mechanics.criteria.breakdown import ElectricalBreakdown
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn
from dielast.mechanics.history import case_count, duration_of, electrical_pieces
from dielast.mechanics.load import ChargeStep, VoltageStep
from dielast.simulate.actuation_history import ActuationHistory, run_films
from dielast.simulate.film_setup import Film
from dielast.simulate.history import joined, simulating
from dielast.simulate.options import Circuit, Failure, Solver
from dielast.simulate.output import Output, check_end
from dielast.simulate.setup import Setup, set_up
from dielast.simulate.wiring import Wiring


# the docstring is that of `actuate`, which simulates what this function has prepared
def prepare(
    material: Material | Sequence[Material],
    film: Film,
    steps: Sequence[VoltageStep | ChargeStep],
    *,
    circuit: Circuit = Circuit(),
    failure: Failure = Failure(),
    output: Output = Output(),
    solver: Solver = Solver(),
) -> Callable[[], ActuationHistory]:
    """Prestretch films, let them relax, and then drive them through the `steps`, from 0 V or from a charge of 0.

    The history begins with the programme, and `cycles` of waveforms are those of the relative stretch of axis 1. Charge, current
    and energies are computed with a resistance or a leakage of the `circuit`, with prescribed charges, or if the `output` asks for
    them; not for films with a passive part.

    Every number may be one for all cases or one per case, shape (cases,). The equations are those of Sec. 3 of DOI
    10.1115/1.4030850. Raises `InputError` for invalid arguments; a run in which the numerics give up is an `Outcome`, not an error.
    """
    stop_at = failure.stop_at
    if stop_at not in (None, *names(), END):
        raise InputError(f"{stop_at!r}: it must be one of {', '.join((*names(), END))}", argument="stop_at")
    if output.internal:
        raise InputError("viscous stretches are those of relax and creep", argument="internal")
    leaks = () if circuit.leakage is None else circuit.leakage.varied()
    cases = case_count(steps, circuit.resistance, circuit.electrode_area, *leaks)
    setup = set_up(material, film, breakdown_field=failure.breakdown_field, solver=solver, cases=cases)
    cases = setup.temperature.size
    charge = isinstance(next(iter(steps), None), ChargeStep)
    wiring = Wiring.of(charge, circuit, setup.thickness, output.electrical)
    stated = output.of_cases(cases, steps)
    pieces = electrical_pieces(steps, setup.controls, np.ones(cases) if charge else setup.thickness)
    if setup.share is not None and wiring.stated:
        only = "a film with a passive part, boundary frame or strip, can only be driven by an ideal source of voltage"
        raise InputError(f"{only}; its charge and energies are not computed", argument=wiring.stated[0])
    duration = duration_of(pieces, cases)
    check_end(stated.rows, duration, "programme")
    if stated.profile is not None and setup.share is None:
        raise InputError("a profile needs a film with a passive part, boundary frame or strip", argument="profile")
    check_end(stated.profile_rows, duration, "programme", "profile")
    stops = _stops(stop_at, materials_of(material), setup)
    parts = setup.groups(wiring.has_circuit)

    def simulated() -> ActuationHistory:
        histories = [
            run_films(setup, part, wiring, pieces, stated, timescale=failure.pull_in_timescale, stops=stops, rtol=solver.rtol)
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
