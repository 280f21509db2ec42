"""A flow law from outside, Eyring's, wherever branches flow: against scipy's Radau on the same equations to 1e-7."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat import actuate, creep, design, relax
from peers.disc import Drive, strip
from peers.energies import gent
from peers.kept import DiscRun, Run, fold
from peers.membrane import Film, Piece, State, branch_stress, constant, flow_rate, ramp
from test_frame_against_peers import of_dielast
from toys import Eyring

from dielast import (
    ChargeStep,
    Gent,
    InputError,
    Leakage,
    Material,
    MeasuredTest,
    Spectrum,
    Step,
    TimeScale,
    VoltageStep,
    export_card,
)
from dielast.calibration.laboratory import Laboratory
from dielast.handover.export.card import CODES
from dielast.material.shift import NoShift
from dielast.mechanics.passive import forms
from dielast.mechanics.passive.mesh import points_needed
from dielast.mechanics.point_material import PointMaterial

MU, EPS, THICKNESS, STRESS = 26e3, 4e-11, 0.5e-3, 4e4
MODULUS, TIME = np.array([3e4, 1e5, 1e6]), np.array([30.0, 1.0, 0.05])
LINEAR = Material("linear", MU, Spectrum(TIME, MODULUS), NoShift(20.0), Gent(110.0), Gent(55.0), EPS)
EYRING = replace(LINEAR, flow=Eyring(STRESS))


def activation(squared: Any) -> tuple[Any, Any]:
    """sinh(y)/y and its derivative in the square of the stress."""
    y = np.sqrt(np.clip(squared / STRESS**2, 1e-6, 1e5))  # Radau tries long steps
    return np.sinh(y) / y, (np.cosh(y) / y - np.sinh(y) / y**2) / (2 * y * STRESS**2)


FILM = Film(
    lambda l1, l2: gent(l1, l2, MU, 110.0), lambda l1, l2: gent(l1, l2, 1.0, 55.0), MODULUS, TIME, EPS, 3e7, activation=activation
)
FREE = ("stress", constant(0.0))
PEER, OURS, WITHIN = 2e-8, 2e-9, 1e-7  # tolerances asked of the two, and of their results
UP, HOLD, RATE = 0.5, 8.0, 0.5
RELAXED: dict[str, Any] = {"thickness": THICKNESS, "prestretch_rate": RATE, "relax": 60.0}
TIMES = np.concatenate((np.linspace(0.1, UP, 5), UP + np.geomspace(1e-2, HOLD, 20)))


def held(*stretch: float) -> Any:
    return tuple(("stretch", constant(one)) for one in stretch)


def relaxed_after(film: Film, *stretch: float) -> State:
    """The film after a prestretch within a time at `RATE`, and 60 s."""
    lasts = (max(stretch) - 1) / RATE
    stretching: Any = tuple(("stretch", ramp(1.0, one, lasts)) for one in stretch)
    return replace(Run(film, [Piece(lasts, stretching), Piece(60.0, held(*stretch))], rtol=PEER).final, time=0.0)


@pytest.mark.parametrize(
    "mode", ["uniaxial", *(pytest.param(mode, marks=pytest.mark.trust) for mode in ("equibiaxial", "pure-shear"))]
)
def test_stress_dissipation_and_calibration_at_a_prescribed_stretch(mode: str) -> None:
    course = [("stretch", ramp(1.0, 2.0, UP)), ("stretch", constant(2.0))]
    second = {"uniaxial": [FREE, FREE], "equibiaxial": course, "pure-shear": [("stretch", constant(1.0))] * 2}[mode]
    run = Run(FILM, [Piece(lasts, (a, b)) for lasts, a, b in zip((UP, HOLD), course, second, strict=True)], rtol=PEER)
    there = run.at(TIMES)
    steps = [Step(stretch=2.0, duration=UP), Step.hold(HOLD)]
    stiffer = replace(EYRING, spectrum=Spectrum(TIME, 2 * MODULUS))
    here = relax([EYRING, LINEAR, stiffer], steps, mode=mode, times=TIMES, rtol=OURS, internal=True)
    scale = np.max(there.stress)
    assert here.nominal_stress_1[0] == pytest.approx(there.stress[0], rel=WITHIN)
    assert here.stretch_2[0] == pytest.approx(there.stretch[1], rel=WITHIN)
    assert np.max(np.abs(here.nominal_stress_1[0] / here.nominal_stress_1[1] - 1)) > 0.05  # the flow matters
    p = branch_stress(FILM, np.log(there.stretch), there.log_viscous)
    assert here.dissipation()[0] == pytest.approx(np.einsum("ank,ank->k", p, flow_rate(FILM, p)), rel=10 * WITHIN)
    time, stretch = np.append(0.0, TIMES), np.append(1.0, np.interp(TIMES, [0.0, UP], [1.0, 2.0]))
    test = MeasuredTest("t", time, stretch, np.ones(time.size), 20.0, mode)
    found = Laboratory([test], rtol=OURS).answers([EYRING, LINEAR, stiffer])[0]
    assert found[0, 1:] == pytest.approx(there.stress[0], rel=WITHIN, abs=WITHIN * scale)
    assert found[1:, 1:] == pytest.approx(here.nominal_stress_1[1:], rel=WITHIN, abs=WITHIN * scale)


@pytest.mark.trust
def test_creep_under_unequal_loads() -> None:
    pulled = [("stress", ramp(0.0, 4e4, 1.0)), ("stress", ramp(0.0, 2e4, 1.0))], [("stress", constant(s)) for s in (4e4, 2e4)]
    run = Run(FILM, [Piece(lasts, tuple(axes)) for lasts, axes in zip((1.0, HOLD), pulled, strict=True)], rtol=PEER)
    here = creep(EYRING, [Step(stress=(4e4, 2e4), duration=1.0), Step.hold(HOLD)], times=TIMES, rtol=OURS)
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(run.at(TIMES).stretch, rel=WITHIN)


DEAD, CLAMPED = "dead-load", "clamped"


@pytest.mark.parametrize(
    ("prestretch", "boundary", "voltage", "hold"),
    [
        pytest.param((1.9, 1.9), (DEAD, DEAD), 4.6e3, 6.9, marks=pytest.mark.trust),
        ((2.0, 1.6), (DEAD, DEAD), 4.4e3, 8.0),
        pytest.param((2.0, 1.6), (DEAD, CLAMPED), 4.4e3, 8.0, marks=pytest.mark.trust),
        pytest.param((2.0, 1.6), (CLAMPED, CLAMPED), 6e3, 8.0, marks=pytest.mark.trust),
    ],
)
def test_films_under_voltage(prestretch: tuple[float, float], boundary: tuple[str, str], voltage: float, hold: float) -> None:
    relaxed, field = relaxed_after(FILM, *prestretch), voltage / THICKNESS
    fixed, loaded = held(*prestretch), [("stress", constant(stress)) for stress in relaxed.stress]
    axes: Any = tuple(fixed[axis] if boundary[axis] == CLAMPED else loaded[axis] for axis in range(2))
    pieces = [Piece(UP, axes, ("field", ramp(0.0, field, UP))), Piece(hold, axes, ("field", constant(field)))]
    run = Run(FILM, pieces, relaxed, rtol=PEER)
    times = TIMES[hold > TIMES]
    there = run.at(times)
    film: dict[str, Any] = {"prestretch": prestretch, "boundary": boundary, **RELAXED}
    asked: dict[str, Any] = {"breakdown_field": FILM.breakdown, "stop_at": "end", "times": times, "rtol": OURS}
    here = actuate(EYRING, [VoltageStep(voltage, duration=UP), VoltageStep.hold(hold)], **film, **asked)
    scale = np.max(np.abs(there.stress))
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=WITHIN)
    assert np.stack((here.nominal_stress_1[0], here.nominal_stress_2[0])) == pytest.approx(there.stress, abs=WITHIN * scale)
    if DEAD in boundary:
        rest = Run(FILM, [Piece(1.0, axes)], relaxed, rtol=PEER).determinant(0.0)
        assert here.stability[0] == pytest.approx(run.determinant(times) / rest, rel=WITHIN, abs=5 * WITHIN)
    events = {event.name: event for event in here.events[0] if event.name != "loss-of-tension"}
    assert set(events) == {name for name in ("breakdown", "pull-in") if run.events(name)}
    assert len(events) == {(DEAD, DEAD): 1 + (prestretch[0] == prestretch[1]), (DEAD, CLAMPED): 1}.get(boundary, len(events))
    for name, event in events.items():
        assert event.time == pytest.approx(run.events(name)[0], rel=2 * WITHIN)


@pytest.mark.parametrize("prestretch", [(1.9, 1.9), pytest.param((2.0, 1.6), marks=pytest.mark.trust)])
def test_films_with_a_charge_and_films_behind_a_resistance(prestretch: tuple[float, float]) -> None:
    relaxed = relaxed_after(FILM, *prestretch)
    load: Any = tuple(("stress", constant(stress)) for stress in relaxed.stress)
    charge, field, area, resistance = 1.5e-3, 3e3 / THICKNESS, 1e-4, 3e10
    r = resistance * area / THICKNESS
    leaking = replace(FILM, leakage=lambda true: 2e-13 * np.exp(abs(true) / 2e7) * true)
    wires: Any = {"leakage": Leakage(2e-13, 2e7), "resistance": resistance}
    for film, kind, steps, wired in (
        (FILM, [("charge", ramp(0.0, charge, UP)), ("charge", constant(charge))], [ChargeStep(charge, duration=UP)], {}),
        (leaking, [("source", ramp(0.0, field, UP)), ("source", constant(field))], [VoltageStep(3e3, duration=UP)], wires),
    ):
        pieces = [Piece(UP, load, kind[0], r), Piece(HOLD, load, kind[1], r)]
        there = Run(film, pieces, relaxed, rtol=PEER).at(TIMES)
        steps = [*steps, type(steps[0]).hold(HOLD)]
        asked: dict[str, Any] = {"times": TIMES, "rtol": OURS, "electrode_area": area, **wired, **RELAXED}
        here = actuate(EYRING, steps, prestretch=prestretch, stop_at="end", **asked)
        assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=WITHIN)
        assert here.voltage[0] == pytest.approx(there.field * THICKNESS, rel=WITHIN)


@pytest.mark.parametrize(
    ("boundary", "share", "prestretch", "voltage"),
    [("frame", 0.15, 1.5, 6.5e3), pytest.param("strip", 0.3, (2.0, 1.5), 5e3, marks=pytest.mark.trust)],
)
def test_films_with_a_passive_part(boundary: str, share: float, prestretch: Any, voltage: float) -> None:
    field, lasts = voltage / THICKNESS, (np.max(prestretch) - 1) / RATE
    if boundary == "frame":
        one, pair = np.array([share]), np.array([prestretch])
        (count,) = points_needed(PointMaterial.of(EYRING, np.array([20.0]), 1e-6), one, pair, 1e-6)
        peer, frame = of_dielast(forms.disc(one, pair, int(count))), ((1 / prestretch, 1.0),)
    else:
        peer, frame = strip(share), tuple((1.0, stretch) for stretch in prestretch)
    moving, still = (tuple(made) for made in ([ramp(*ends, lasts) for ends in frame], [constant(end) for _, end in frame]))
    begin = DiscRun(FILM, peer, [Drive(lasts, moving), Drive(60.0, still)], rtol=1e-9, atol=1e-12).final
    drives = [Drive(UP, still, ramp(0.0, field, UP)), Drive(HOLD, still, constant(field))]
    run = DiscRun(FILM, peer, drives, replace(begin, time=0.0), rtol=1e-9, atol=1e-12)
    film: dict[str, Any] = {"prestretch": prestretch, "boundary": boundary, "electrode_share": share, **RELAXED}
    steps = [VoltageStep(voltage, duration=UP), VoltageStep.hold(HOLD)]
    here = actuate(EYRING, steps, stop_at="end", times=TIMES, rtol=OURS, **film)
    there = run.at(TIMES)
    assert here.stretch_1[0] == pytest.approx(there.u[0], rel=WITHIN)
    assert here.nominal_stress_1[0] == pytest.approx(there.stress[0, 0], rel=10 * WITHIN)
    linear = actuate(LINEAR, steps, stop_at="end", times=TIMES, rtol=1e-6, **film)
    assert np.max(np.abs(here.stretch_1[0] / linear.stretch_1[0] - 1)) > 1e-4
    signs = np.sign(run.eigenvalue(TIMES))
    assert (np.sign(here.stability[0]) == signs).all()


@pytest.mark.trust
def test_the_literal_criterion_at_its_fold() -> None:
    film = replace(FILM, modulus=MODULUS[:2], time=TIME[:2])  # a fast branch would hold the film
    material = replace(EYRING, spectrum=Spectrum(TIME[:2], MODULUS[:2]))
    relaxed = relaxed_after(film, 1.9, 1.9)
    load = ("stress", constant(relaxed.stress[0]))
    piece = Piece(100.0, (load, load), ("field", constant(3.8e3 / THICKNESS)))
    there = fold(film, piece, relaxed, rtol=PEER)
    asked: dict[str, Any] = {"prestretch": 1.9, "stop_at": "pull-in", "rtol": 1e-9, **RELAXED}
    steps = [VoltageStep(3.8e3), VoltageStep.hold(100.0)]
    here = actuate(material, steps, pull_in_timescale=TimeScale.fixed(0.0), **asked).events[0][0]
    assert here.time == pytest.approx(there.time, rel=1e-6)
    assert here.stretch_1 == pytest.approx(float(np.exp(there.log_stretch[0])), rel=1e-6)


def test_a_design_reaches_its_goal() -> None:
    film: dict[str, Any] = {"prestretch": 1.8, **RELAXED}
    found = design(EYRING, at=5.0, horizon=20.0, relative_stretch=1.1, rtol=1e-7, **film)
    voltage = float(np.ravel(found.voltage)[0])
    there = actuate(EYRING, [VoltageStep(voltage), VoltageStep.hold(5.0)], stop_at="end", times=[5.0], rtol=1e-8, **film)
    assert there.stretch_1[0, 0] / 1.8 == pytest.approx(1.1, rel=1e-5)


def test_no_card_holds_the_flow() -> None:
    for code in CODES.names:
        with pytest.raises(InputError, match=rf"^formats: {code} has Prony series, whose flow is linear: no card can hold Eyring"):
            export_card(EYRING, code)
