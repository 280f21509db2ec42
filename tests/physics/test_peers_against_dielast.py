"""dielast against the membrane peer: histories, determinants and events to 1e-7, Gent and neo-Hookean films."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat import actuate, creep, relax
from peers.energies import gent, neo_hookean
from peers.kept import Run, fold, in_json
from peers.membrane import Film, Piece, constant, ramp

from dielast import Gent, Material, Spectrum, Step, TimeScale, VoltageStep
from dielast.material.dielectric import LinearPermittivity
from dielast.material.shift import NoShift

MU, EPS, THICKNESS, BREAKDOWN = 26e3, 4e-11, 0.5e-3, 2.9e7
MODULUS, TIME = np.array([3e4, 1e5, 3e6]), np.array([30.0, 1.0, 0.01])
GENT = Material("gent", MU, Spectrum(TIME, MODULUS), NoShift(20.0), Gent(110.0), Gent(55.0), EPS)
NEO_HOOKEAN = replace(GENT, equilibrium_law=Gent(), nonequilibrium_law=Gent())
GENT_FILM = Film(
    lambda l1, l2: gent(l1, l2, MU, 110.0), lambda l1, l2: gent(l1, l2, 1.0, 55.0), MODULUS, TIME, EPS, breakdown=BREAKDOWN
)
NEO_HOOKEAN_FILM = replace(
    GENT_FILM, equilibrium=lambda l1, l2: neo_hookean(l1, l2, MU), branch=lambda l1, l2: neo_hookean(l1, l2, 1.0)
)
COEFFICIENT = -0.053
SOFTENING = replace(GENT, permittivity=LinearPermittivity(EPS, stretch_coefficient=COEFFICIENT))
SOFTENING_FILM = replace(GENT_FILM, permittivity=lambda l1, l2: EPS * (1 + COEFFICIENT * (l1 + l2 - 2)))
FREE = ("stress", constant(0.0))
WITHIN = 1e-7  # of dielast's and the peer's results
PEER, OURS = 3e-8, 1e-9  # tolerances asked of the two


@pytest.mark.trust
def test_uniaxial_relaxation_of_a_neo_hookean_film() -> None:
    run = Run(
        NEO_HOOKEAN_FILM,
        [Piece(2.0, (("stretch", ramp(1.0, 2.0, 2.0)), FREE)), Piece(50.0, (("stretch", constant(2.0)), FREE))],
        rtol=PEER,
    )
    times = np.concatenate((np.linspace(0.1, 2.0, 10), 2.0 + np.geomspace(1e-2, 50.0, 20)))
    there = run.at(times)
    here = relax(NEO_HOOKEAN, [Step(stretch=2.0, rate=0.5), Step.hold(50.0)], times=times, rtol=OURS)
    assert here.stretch_2[0] == pytest.approx(there.stretch[1], rel=WITHIN)
    assert here.nominal_stress_1[0] == pytest.approx(there.stress[0], rel=WITHIN)


def test_creep_under_unequal_loads() -> None:
    run = Run(
        GENT_FILM,
        [
            Piece(1.0, (("stress", ramp(0.0, 4e4, 1.0)), ("stress", ramp(0.0, 2e4, 1.0)))),
            Piece(50.0, (("stress", constant(4e4)), ("stress", constant(2e4)))),
        ],
        rtol=PEER,
    )
    times = np.concatenate((np.linspace(0.1, 1.0, 10), 1.0 + np.geomspace(1e-2, 50.0, 20)))
    there = run.at(times)
    here = creep(GENT, [Step(stress=(4e4, 2e4), duration=1.0), Step.hold(50.0)], times=times, rtol=OURS)
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=WITHIN)


@pytest.mark.parametrize(
    ("prestretch", "voltage", "film", "material"),
    [
        pytest.param((1.9, 1.9), 4.8e3, GENT_FILM, GENT, marks=pytest.mark.trust),
        pytest.param((2.0, 1.6), 5.2e3, GENT_FILM, GENT, marks=pytest.mark.trust),  # test_springs_against_peer.py has a shorter one
        pytest.param((2.0, 1.6), 5.65e3, SOFTENING_FILM, SOFTENING, marks=pytest.mark.trust),
    ],
    ids=["equibiaxial", "unequal", "softening unequal"],
)
def test_actuation_under_dead_load_to_breakdown_and_through_pull_in(
    prestretch: tuple[float, float], voltage: float, film: Film, material: Material
) -> None:
    up, hold = 0.5, 8.0
    held = tuple(("stretch", constant(stretch)) for stretch in prestretch)
    relaxed = Run(film, [Piece(60.0, held)], rtol=PEER).final
    load, field = tuple(("stress", constant(stress)) for stress in relaxed.stress), voltage / THICKNESS
    run = Run(
        film,
        [Piece(up, load, ("field", ramp(0.0, field, up))), Piece(hold, load, ("field", constant(field)))],
        replace(relaxed, time=0.0),
        rtol=PEER,
    )
    times = np.concatenate((np.linspace(0.05, up, 5), up + np.geomspace(1e-2, hold, 20)))
    there = run.at(times)
    here = actuate(
        material,
        [VoltageStep(voltage, duration=up), VoltageStep.hold(hold)],
        thickness=THICKNESS,
        prestretch=prestretch,
        relax=60.0,
        breakdown_field=BREAKDOWN,
        stop_at="end",
        times=times,
        rtol=OURS,
    )
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=WITHIN)
    assert here.true_field[0] == pytest.approx(there.true_field, rel=WITHIN)
    at_begin = run.determinant(0.0)
    at_rest = Run(film, [Piece(1.0, load)], replace(relaxed, time=0.0), rtol=PEER).determinant(0.0)
    assert at_begin == pytest.approx(at_rest, rel=1e-12)
    assert here.stability[0] == pytest.approx(run.determinant(times) / at_rest, rel=WITHIN, abs=5 * WITHIN)
    events = {event.name: event for event in here.events[0]}
    assert set(events) == {"breakdown", "pull-in"}
    for name, event in events.items():
        (time,) = run.events(name)
        assert event.time == pytest.approx(time, rel=WITHIN)
        assert (event.stretch_1, event.stretch_2) == pytest.approx(tuple(run.at(time).stretch[:, 0]), rel=WITHIN)


@pytest.mark.parametrize(
    ("boundary", "film", "material", "voltage"),
    [
        (("clamped", "clamped"), NEO_HOOKEAN_FILM, NEO_HOOKEAN, 7.5e3),
        pytest.param(("dead-load", "clamped"), SOFTENING_FILM, SOFTENING, 9.0e3, marks=pytest.mark.trust),
    ],
    ids=["constant", "softening"],
)
def test_actuation_of_clamped_films(boundary: tuple[str, str], film: Film, material: Material, voltage: float) -> None:
    up, hold, prestretch = 1.0, 20.0, (1.8, 1.4)
    held = tuple(("stretch", constant(stretch)) for stretch in prestretch)
    relaxed = Run(film, [Piece(60.0, held)], rtol=PEER).final
    axes = tuple(held[axis] if boundary[axis] == "clamped" else ("stress", constant(relaxed.stress[axis])) for axis in range(2))
    field = voltage / THICKNESS
    run = Run(
        film,
        [Piece(up, axes, ("field", ramp(0.0, field, up))), Piece(hold, axes, ("field", constant(field)))],
        replace(relaxed, time=0.0),
        rtol=PEER,
    )
    times = np.concatenate((np.linspace(0.1, up, 5), up + np.geomspace(1e-2, hold, 15)))
    there = run.at(times)
    here = actuate(
        material,
        [VoltageStep(voltage, duration=up), VoltageStep.hold(hold)],
        thickness=THICKNESS,
        prestretch=prestretch,
        relax=60.0,
        boundary=boundary,
        stop_at="end",
        times=times,
        rtol=OURS,
    )
    assert here.stretch_1[0] == pytest.approx(there.stretch[0], rel=WITHIN)
    scale = np.max(np.abs(there.stress))
    assert np.stack((here.nominal_stress_1[0], here.nominal_stress_2[0])) == pytest.approx(
        there.stress, rel=WITHIN, abs=WITHIN * scale
    )
    lost = [event.time for event in here.events[0] if event.name == "loss-of-tension"]
    assert lost == pytest.approx(sorted(run.events("loss-of-tension-1") + run.events("loss-of-tension-2")), rel=WITHIN)
    assert len(lost) >= 1


@pytest.mark.parametrize(
    ("film", "material", "voltage"),
    [pytest.param(GENT_FILM, GENT, 4.0e3, marks=pytest.mark.trust), (SOFTENING_FILM, SOFTENING, 5.9e3)],
    ids=["constant", "softening"],
)
def test_the_literal_criterion_at_its_fold(film: Film, material: Material, voltage: float) -> None:
    held = ("stretch", constant(1.9))
    slow = Spectrum(TIME[:2], MODULUS[:2])  # a fast branch would hold the film
    film, material = replace(film, modulus=MODULUS[:2], time=TIME[:2]), replace(material, spectrum=slow)
    relaxed = Run(film, [Piece(60.0, (held, held))], rtol=PEER).final
    load = ("stress", constant(relaxed.stress[0]))
    piece = Piece(100.0, (load, load), ("field", constant(voltage / THICKNESS)))
    there = fold(film, piece, replace(relaxed, time=0.0), rtol=PEER)
    here = actuate(
        material,
        [VoltageStep(voltage), VoltageStep.hold(100.0)],
        thickness=THICKNESS,
        prestretch=1.9,
        relax=60.0,
        stop_at="pull-in",
        pull_in_timescale=TimeScale.fixed(0.0),
        rtol=1e-8,
    ).events[0][0]
    assert here.time == pytest.approx(there.time, rel=1e-6)
    assert here.stretch_1 == pytest.approx(float(np.exp(there.log_stretch[0])), rel=1e-6)


def test_a_question_with_another_number_anywhere_is_another() -> None:
    """Answers of peers are kept by their questions (peers/kept.py)."""

    def asked(modulus: float, limit: float, load: float, rtol: float) -> Any:
        film = Film(lambda l1, l2: gent(l1, l2, modulus, limit), neo_hookean, np.array([1e4]), np.array([modulus]))
        return Run(film, [Piece(1.0, (("stress", ramp(0.0, load, 1.0)),) * 2)], rtol=rtol).question

    numbers = (MU, 110.0, 1e4, 1e-6)
    others = [(*numbers[:k], 1.001 * numbers[k], *numbers[k + 1 :]) for k in range(4)]
    same, *different = (json.dumps(asked(*each)) for each in (numbers, *others))
    assert same == json.dumps(asked(*numbers))
    assert len({same, *different}) == 5
    one, two = (lambda l1, l2: gent(l1, l2, MU, 110.0)), (lambda l1, l2: gent(l1, l2, MU, 55.0))
    assert in_json(one) != in_json(two)
