"""Actuation: prestretched and relaxed films under a voltage programme, until they fail or the programme ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dielast.base.errors import InputError, shown
from dielast.material.material import Material, materials_of
from dielast.mechanics.criteria import CRITERIA, END, failures_of, names
from dielast.mechanics.criteria.breakdown import ElectricalBreakdown
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn
from dielast.mechanics.history import case_count, duration_of, electrical_pieces
from dielast.mechanics.load import ChargeStep, FilmStep, Programme, VoltageStep
from dielast.mechanics.piece import Piece, loads_axis_1_alone
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.simulate.actuation_history import ActuationHistory, run_films
from dielast.simulate.film_setup import Film, check_reach
from dielast.simulate.history import joined, simulating
from dielast.simulate.options import Circuit, Failure, Solver
from dielast.simulate.output import Output, check_end
from dielast.simulate.setup import Setup, set_up
from dielast.simulate.wiring import Wiring


# the docstring is that of `actuate`, which simulates what this function has prepared
def prepare(
    material: Material | Sequence[Material],
    film: Film,
    steps: Programme | Sequence[VoltageStep | ChargeStep | FilmStep],
    *,
    circuit: Circuit = Circuit(),
    failure: Failure = Failure(),
    output: Output = Output(),
    solver: Solver = Solver(),
) -> Callable[[], ActuationHistory]:
    """Prestretch films, let them relax, and then drive them through the `steps`, from 0 V or from a charge of 0.

    Film steps move the edges as well, which are at first as the boundary of the film holds them. A `Programme` says which of its
    steps repeat, as a cycle, and what one stretch or stress means for both axes.

    The history begins with the programme, and `cycles` of waveforms are those of the relative stretch of axis 1. Charge, current
    and energies are computed with a resistance or a leakage of the `circuit`, with prescribed charges, or if the `output` asks for
    them; not for films with a passive part.

    Every number may be one for all cases or one per case, shape (cases,). The equations are those of Sec. 3 of DOI
    10.1115/1.4030850. Raises `InputError` for invalid arguments; a run in which the numerics give up is an `Outcome`, not an error.
    """
    stated, stop_at = Programme.of(steps), failure.stop_at
    steps = stated.steps
    if stop_at not in (None, *names(), END):
        raise InputError(f"{stop_at!r}: it must be one of {', '.join((*names(), END))}", argument="stop_at")
    if output.internal:
        raise InputError("viscous stretches are those of relax and creep", argument="internal")
    leaks = () if circuit.leakage is None else circuit.leakage.varied()
    cases = case_count(steps, circuit.resistance, circuit.electrode_area, *leaks)
    setup = set_up(material, film, breakdown_field=failure.breakdown_field, solver=solver, cases=cases)
    cases = setup.temperature.size
    programme = stated.moves_edges or any(spring is not None for spring in setup.spring)
    first = next(iter(steps), None)
    charge = isinstance(first, ChargeStep) if not programme else any(getattr(step, "charge", None) is not None for step in steps)
    wiring = Wiring.of(charge, circuit, setup.thickness, output.electrical, programme)
    rows = output.of_cases(cases, steps, stated.repeat)
    unit = np.ones(cases) if charge and not programme else setup.thickness
    pieces = electrical_pieces(stated, setup.controls, unit, edges=programme)
    if programme:
        _check_edges(setup, pieces.stored)
    if setup.share is not None and wiring.stated:
        only = "a film with a passive part, boundary frame or strip, can only be driven by an ideal source of voltage"
        raise InputError(f"{only}; its charge and energies are not computed", argument=wiring.stated[0])
    held = [{} if axis is None else {Control.STRETCH: axis} for axis in setup.prestretch]
    duration = duration_of(pieces, cases, held if programme else None)
    check_end(rows.rows, duration, "programme")
    if rows.profile is not None and setup.share is None:
        raise InputError("a profile needs a film with a passive part, boundary frame or strip", argument="profile")
    check_end(rows.profile_rows, duration, "programme", "profile")
    stops = _stops(stop_at, materials_of(material), setup)
    alike = _alike(pieces.stored, cases) if programme else np.ones(cases, dtype=bool)
    lone = _lone(setup, pieces.stored, wiring.kinds)
    parts = setup.groups(wiring.kinds + lone * (1 + int(wiring.kinds.max())), alike)
    density = _density(materials_of(material), cases)

    def simulated() -> ActuationHistory:
        histories = [
            run_films(
                setup,
                part,
                wiring,
                pieces,
                rows,
                timescale=failure.pull_in_timescale,
                stops=stops,
                rtol=solver.rtol,
                alike=bool(alike[part].all()) and all(spring is None for spring in setup.spring),
                lone=bool(lone[part[0]]),
                density=density,
            )
            for part in parts
        ]
        place = np.empty(cases, dtype=np.intp)
        place[np.concatenate(parts)] = np.arange(sum(part.size for part in parts))
        history: ActuationHistory = joined(histories, place)
        return history

    return simulated


actuate = simulating(prepare, "actuate", ActuationHistory)


def _check_edges(setup: Setup, pieces: Sequence[Piece]) -> None:
    """`InputError` for stretches beyond the limit of a spring, and for edges that a spring holds."""
    check_reach(setup.points, pieces, rest=False)
    for piece in pieces:
        for axis, (control, spring) in enumerate(zip(piece.controls, setup.spring, strict=True)):
            if spring is not None and control is not Control.STRESS:
                held = f"a spring holds the edges along axis {axis + 1}: state a stress or a force, which moves its other end"
                raise InputError(held, step=piece.step, argument="stretch")


def _alike(pieces: Sequence[Piece], cases: int) -> Flags:
    """Cases (cases,) whose load is equal along both axes."""
    equal = np.ones(cases, dtype=bool)
    for piece in pieces:
        equal &= piece.controls[0] is piece.controls[1]
        for target in piece.targets:
            equal &= (target[0] == target[1]) | np.isnan(target[:2]).all(axis=0)
    return equal


def _lone(setup: Setup, pieces: Sequence[Piece], circuit: Cases) -> Cases:
    """The number (cases,) of pieces, from the first on, that load undeformed films along axis 1 alone; 0 for films in a `circuit`
    (cases,) of another kind than 0, with a passive part, weights or springs.
    """
    others = (setup.share, *setup.weight_stress, *setup.spring)
    leading = (circuit == 0) & all(other is None for other in others)
    for stretch in setup.prestretch:
        leading &= True if stretch is None else stretch == 1
    count = np.zeros(leading.size, dtype=np.intp)
    for piece in pieces:
        leading &= loads_axis_1_alone(piece)
        count += leading
    return count


def _density(materials: Sequence[Material], cases: int) -> Floats | None:
    """The density (cases,) in kg/m^3, NaN where a material has none, None if none has one."""
    stated = [np.nan if material.density is None else material.density for material in materials]
    return None if np.isnan(stated).all() else np.broadcast_to(stated, (cases,))


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
    # a slack film wrinkles, which these equations do not describe
    held = setup.share is not None or any(control is not Control.STRESS for control in setup.controls)
    slack = held and (breakdown or stop_at is None)
    return (*stops, LossOfTension.name) if slack else stops
