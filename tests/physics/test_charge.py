"""Films under a charge, behind a resistance, and with a leak: closed forms, the membrane peer, and what pulls in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from films import SOFT
from flat import actuate
from peers.energies import gent
from peers.kept import Run
from peers.membrane import Film, Piece, constant, ramp

from dielast import (
    ArrudaBoyce,
    ChargeStep,
    Gent,
    InputError,
    Leakage,
    Material,
    NeoHookean,
    Ogden,
    Spectrum,
    TimeScale,
    VoltageStep,
    Waveform,
)
from dielast.material.dielectric import LinearPermittivity
from dielast.material.laws_of_cases import stretch_laws
from dielast.material.shift import NoShift
from dielast.mechanics.electric import CHARGE, FIELD, FilmCircuit
from dielast.mechanics.flow import Flow
from dielast.mechanics.point_material import PointMaterial

MU, EPS, THICKNESS, AREA = 26e3, 4e-11, 0.5e-3, 1e-4
ELASTIC = Material("elastic", MU, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), NeoHookean(), NeoHookean(), EPS)
UNIT = np.sqrt(MU * EPS)
FILM = {"thickness": THICKNESS, "stop_at": "end"}


def test_a_charged_film_in_closed_form_and_without_pull_in() -> None:
    """lambda^6 = 1 + D~^2/(mu eps), at once and by a ramp, up to charges at which any voltage has long pulled the film in."""
    charge = UNIT * np.sqrt(np.array([0.1, 1.0, 3.0, 30.0, 1000.0]))
    steps = [ChargeStep(charge), ChargeStep.hold(1.0), ChargeStep(0 * charge, duration=1.0)]
    run = actuate(ELASTIC, steps, points_per_decade=3, **FILM)
    exact = (1 + (charge / UNIT) ** 2) ** (1 / 6)
    assert run.completed
    assert not any(run.events)
    assert (run.stability[:, 1:] > 0).all()
    held = np.argmin(np.abs(run.time - 1.0), axis=1)
    for case, row in enumerate(held):
        assert run.stretch_1[case, row] == pytest.approx(exact[case], rel=1e-9)
        # D~ = eps lambda^4 V/L_3
        assert run.voltage[case, row] == pytest.approx(charge[case] * THICKNESS / (EPS * exact[case] ** 4), rel=1e-9)
        assert run.true_field[case, row] == pytest.approx(charge[case] / (EPS * exact[case] ** 2), rel=1e-9)
    assert run.stretch_1[:, -1] == pytest.approx(1.0, rel=1e-9)
    # an elastic film gives back what it got
    energy = run.electrical_energy
    assert energy[:, -1] == pytest.approx(0.0, abs=1e-6 * np.max(energy))
    stored = MU / 2 * (2 * exact**2 + exact**-4 - 3) + charge**2 / (2 * EPS * exact**4)
    assert energy[np.arange(5), held] == pytest.approx(stored, rel=1e-9)
    # the voltage of the largest charge is below that at which the film pulls in: only the way there differs
    pulling = VoltageStep(0.69 * np.sqrt(MU / EPS) * THICKNESS)
    held_voltage = actuate(ELASTIC, [pulling], thickness=THICKNESS, stop_at="pull-in")
    assert [event.name for event in held_voltage.events[0]] == ["pull-in"]


def test_an_open_circuit_leaks() -> None:
    """D~ = D~_0 exp(-sigma t/eps): from sqrt(3 mu eps), stretches from 1.25992 to 1.05844 after one eps/sigma."""
    sigma = 2e-13
    steps = [ChargeStep(np.sqrt(3) * UNIT), ChargeStep.hold(EPS / sigma)]
    run = actuate(ELASTIC, steps, leakage=Leakage(sigma), electrode_area=AREA, **FILM)
    assert run.stretch_1[0, [0, -1]] == pytest.approx([4 ** (1 / 6), (1 + 3 * np.exp(-2)) ** (1 / 6)], rel=1e-6)
    exact = np.sqrt(3) * UNIT * AREA * np.exp(-run.time[0] * sigma / EPS)
    assert run.charge[0] == pytest.approx(exact, rel=1e-6)
    # nothing flows from the source, and what it gave is stored or leaked
    assert run.current_density[0] == pytest.approx(0.0, abs=1e-15)
    end, field = run.stretch_1[0, -1], run.voltage[0, -1] / THICKNESS
    stored = MU / 2 * (2 * end**2 + end**-4 - 3) + 0.5 * field * run.charge_density[0, -1]
    assert run.electrical_energy[0, -1] == pytest.approx(stored + run.leaked_energy[0, -1], rel=1e-6)


def test_a_clamped_film_is_charged_through_a_resistance() -> None:
    """V = V_s (1 - exp(-t/RC)), of the source's work one half in the film; with a leak the voltage of a divider in the end."""
    resistance, voltage, prestretch = 1e10, 3e3, 1.5
    capacity = EPS * prestretch**4 * AREA / THICKNESS
    times = resistance * capacity * np.geomspace(1e-3, 40.0, 50)
    wired = {"prestretch": prestretch, "boundary": "clamped", "electrode_area": AREA, "times": times, **FILM}
    steps = [VoltageStep(voltage), VoltageStep.hold(times[-1])]
    run = actuate(ELASTIC, steps, resistance=resistance, rtol=1e-8, **wired)
    assert run.source_voltage[0] == pytest.approx(voltage)
    assert run.voltage[0] == pytest.approx(-voltage * np.expm1(-times / (resistance * capacity)), rel=1e-6)
    scale = voltage / resistance
    assert run.current[0] == pytest.approx(scale * np.exp(-times / (resistance * capacity)), abs=1e-6 * scale)
    work = capacity * voltage**2 / (AREA * THICKNESS)
    assert run.electrical_energy[0, -1] == pytest.approx(work, rel=1e-6)
    assert run.resistor_energy[0, -1] == pytest.approx(work / 2, rel=1e-6)
    sigma = 1e-13
    leak = sigma * AREA * prestretch**4 / THICKNESS
    run = actuate(ELASTIC, steps, resistance=resistance, leakage=Leakage(sigma), **wired)
    assert run.voltage[0, -1] == pytest.approx(voltage / (1 + resistance * leak), rel=1e-6)


@pytest.mark.parametrize(
    ("electric", "prestretch"),
    [
        pytest.param("charge", (1.9, 1.9), marks=pytest.mark.trust),
        ("leak", (2.0, 1.6)),
        pytest.param("source", (2.0, 1.6), marks=pytest.mark.trust),
        pytest.param("softening", (2.0, 1.6), marks=pytest.mark.trust),
    ],
)
def test_viscoelastic_films_agree_with_the_peer(electric: str, prestretch: tuple[float, float]) -> None:
    modulus, time = np.array([3e4, 1e5, 3e6]), np.array([30.0, 1.0, 0.01])
    eps: float | object = EPS
    material = Material("gent", MU, Spectrum(time, modulus), NoShift(20.0), Gent(110.0), Gent(55.0), EPS)
    if electric == "softening":
        eps = lambda l1, l2: EPS * (1 - 0.053 * (l1 + l2 - 2))  # noqa: E731
        material = replace(material, permittivity=LinearPermittivity(EPS, stretch_coefficient=-0.053))
    leaks = electric != "charge"
    film = Film(
        lambda l1, l2: gent(l1, l2, MU, 110.0),
        lambda l1, l2: gent(l1, l2, 1.0, 55.0),
        modulus,
        time,
        eps,
        leakage=(lambda field: 2e-13 * np.exp(abs(field) / 2e7) * field) if leaks else None,
    )
    held = tuple(("stretch", constant(stretch)) for stretch in prestretch)
    relaxed = Run(film, [Piece(60.0, held)], rtol=3e-8).final
    load = tuple(("stress", constant(stress)) for stress in relaxed.stress)
    up, hold, resistance = 0.5, 50.0, 3e10
    times = np.concatenate((np.linspace(0.05, up, 5), up + np.geomspace(1e-2, hold, 20)))
    wired = {"leakage": Leakage(2e-13, 2e7) if leaks else None, "electrode_area": AREA}
    if electric in ("charge", "leak"):
        charge = 1.5e-3
        # what the source has delivered is that through a resistance too high for anything else
        kind = ("charge", ramp(0.0, charge, up)) if electric == "charge" else None
        pieces = [Piece(up, load, kind), Piece(hold, load, ("charge", constant(charge)))] if kind else []
        if not pieces:
            huge = 1e6
            pieces = [
                Piece(up, load, ("source", constant(huge * charge / up)), huge),
                Piece(hold, load, ("source", constant(0.0)), np.inf),
            ]
        steps = [ChargeStep(charge, duration=up), ChargeStep.hold(hold)]
    else:
        field = 3e3 / THICKNESS
        r = resistance * AREA / THICKNESS
        pieces = [Piece(up, load, ("source", ramp(0.0, field, up)), r), Piece(hold, load, ("source", constant(field)), r)]
        steps, wired = [VoltageStep(3e3, duration=up), VoltageStep.hold(hold)], wired | {"resistance": resistance}
    if electric == "leak":
        # the peer has no source of current but one of a voltage that dwarfs that of the film
        huge = 1e16
        pieces[0] = Piece(up, load, ("source", constant(huge * charge / up)), huge)
    run = Run(film, pieces, replace(relaxed, time=0.0), theta=lambda t: 0 * t, rtol=3e-8)
    there = run.at(times)
    here = actuate(
        material,
        steps,
        prestretch=prestretch,
        relax=60.0,
        times=times,
        rtol=1e-9,
        pull_in_timescale=TimeScale.fixed(0.0),
        **wired,
        **FILM,
    )
    within = 1e-7
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=within)
    assert here.charge_density[0] == pytest.approx(there.charge, rel=within)
    assert here.voltage[0] == pytest.approx(there.field * THICKNESS, rel=within)
    if "resistance" in wired:
        current = (np.minimum(times / up, 1.0) * field - there.field) / r
        assert here.current_density[0] == pytest.approx(current, rel=1e-5, abs=1e-6 * np.max(np.abs(current)))
    at_rest = Run(film, [Piece(1.0, load)], replace(relaxed, time=0.0), theta=lambda t: 0 * t, rtol=3e-8).determinant(0.0)
    assert here.stability[0] == pytest.approx(run.determinant(times) / at_rest, rel=within)
    assert not here.events[0]


@pytest.mark.parametrize("prestretch", [1.9, (2.0, 1.6)])
def test_the_current_is_the_rate_of_the_charge_and_what_leaks(prestretch: float | tuple[float, float]) -> None:
    """Under a voltage, whose charge follows from the stretches; also just after a voltage applied at once."""
    film = {"prestretch": prestretch, "relax": 60.0, **FILM}
    times = np.linspace(0.0, 2.0, 1001)
    steps = [VoltageStep(1e3), VoltageStep(Waveform(1e3, 2e3, 1.0, 2))]
    run = actuate(SOFT, steps, times=times, leakage=Leakage(1e-13), rtol=1e-8, **film)
    charge, current = run.charge_density[0], run.current_density[0]
    leak = 1e-13 * charge / 4e-11  # sigma E lambda_1 lambda_2
    flowing = (current - leak)[1:]
    simpson = np.cumsum((flowing[:-2:2] + 4 * flowing[1:-1:2] + flowing[2::2]) * (times[1] - times[0]) / 3)
    assert charge[3::2] - charge[1] == pytest.approx(simpson, abs=1e-6 * np.max(charge))
    held = actuate(SOFT, [VoltageStep(2e3), VoltageStep.hold(1.0)], electrical=True, **film)
    assert held.current_density[0, 0] == pytest.approx(held.current_density[0, 1], rel=1e-5)
    assert held.current_density[0, 0] > 0


@pytest.mark.trust
def test_pull_in_behind_a_resistance_is_that_of_the_time_scale() -> None:
    """A circuit much faster than the time scale is a voltage; one much slower is a charge, which never pulls the film in."""
    steps = [VoltageStep(6e3, duration=1.0), VoltageStep.hold(100.0)]
    film = {"prestretch": 1.7, "relax": 600.0, "electrode_area": AREA, **FILM}
    resistance = np.array([0.0, 1e3, 3e7, 1e14])
    run = actuate(SOFT, steps, resistance=resistance, **film)
    times = [[event.time for event in events if event.name == "pull-in"] for events in run.events]
    assert [len(own) for own in times] == [1, 1, 1, 0]
    assert times[1] == pytest.approx(times[0], rel=1e-6)
    assert times[0][0] < times[2][0] < times[0][0] * 1.1
    assert run.completed or run.outcome[0].time > times[0][0]
    literal = actuate(SOFT, steps, resistance=1e8, pull_in_timescale=TimeScale.fixed(0.0), **film)
    assert not any(event.name == "pull-in" for event in literal.events[0])


@pytest.mark.parametrize("coefficient", [0.0, -0.05])
def test_what_the_circuit_lets_flow_while_a_film_is_watched(coefficient: float) -> None:
    """The tangent goes from that at constant charge to that at constant voltage, as the discharge of a film held does."""
    one = np.ones(1)
    log_squared = np.array([[1.1], [0.7]])
    law = LinearPermittivity(EPS, stretch_coefficient=coefficient)
    stretching = stretch_laws([law], 1)
    circuit = FilmCircuit(Leakage(0 * one, np.inf * one), 2e9 * one)
    points = PointMaterial(MU * one[None], Flow(0 * one[None]), Gent(), EPS * one, one, CHARGE, stretching, circuit)
    permittivity, _ = points.capacitance(log_squared)
    capacity = permittivity * np.exp(log_squared.sum(axis=0))
    charge = 1.3e-3 * one
    by_voltage = replace(points, electric=FIELD, circuit=None).maxwell_tangent(log_squared, charge / capacity)[1]
    by_charge = np.broadcast_to(points.maxwell_tangent(log_squared, charge)[1], (2, 2, 1))
    constant = (2e9 * capacity)[0]
    for times in (0.0, 1.0, 40.0):
        tangent = points.watched_maxwell_tangent(log_squared, charge, times * constant * one)
        exact = by_voltage + (by_charge - by_voltage) * np.exp(-times)
        assert np.broadcast_to(tangent, (2, 2, 1)) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("law", [pytest.param(ArrudaBoyce(5.0), marks=pytest.mark.trust), Ogden((0.8, 0.2), (1.6, 3.0))])
def test_every_spring_composes_with_cycles_of_charge(law: Gent) -> None:
    """A film without losses gives back all that it gets; one with a leak less, by what leaks in a cycle that repeats itself."""
    spring = replace(ELASTIC, equilibrium_law=law, nonequilibrium_law=law)
    wave = Waveform(0.0, np.array([1.0, 2.0]) * UNIT, 1.0, 2)
    few = {"prestretch": 1.2, "points_per_decade": 3, **FILM}
    run = actuate(spring, [ChargeStep(wave)], **few)
    assert run.cycles is not None
    assert run.cycles.efficiency is not None
    assert run.cycles.efficiency == pytest.approx(1.0, abs=1e-6)
    assert run.cycles.work == pytest.approx(0.0, abs=1e-6 * MU)
    voltage = Waveform(0.0, 2e3, 1.0, 2)
    lossy = {"leakage": Leakage(2e-12), "resistance": 1e8, "electrode_area": AREA}
    run = actuate(spring, [VoltageStep(voltage)], **lossy, **few)
    assert run.cycles is not None
    assert run.cycles.efficiency is not None
    rows = [int(np.argmin(np.abs(run.time[0] - end))) for end in (1.0, 2.0)]
    leaked, lost, given = (
        float(np.diff(energy[0, rows])[0]) for energy in (run.leaked_energy, run.resistor_energy, run.electrical_energy)
    )
    assert given == pytest.approx(leaked + lost, rel=1e-5)
    assert run.cycles.work[0, -1] == pytest.approx(leaked, rel=1e-5)
    assert 0 < run.cycles.efficiency[0, -1] < 1


def test_results_do_not_depend_on_company_and_events_hold_what_is_electrical() -> None:
    steps = [VoltageStep(3e3, duration=1.0), VoltageStep.hold(100.0)]
    film = {"thickness": THICKNESS, "prestretch": 1.9, "relax": 600.0, "electrode_area": AREA, "breakdown_field": 2.5e7}
    resistance = np.array([0.0, 1e9, 5e9])
    together = actuate(SOFT, steps, resistance=resistance, leakage=Leakage(1e-14, 2e7), **film)
    for case, ohm in enumerate(resistance):
        alone = actuate(SOFT, steps, resistance=ohm, leakage=Leakage(1e-14, 2e7), **film)
        for header, values in alone.case(0).items():
            assert np.array_equal(values, together.case(case)[header], equal_nan=True), header
        (event,) = alone.events[0]
        last = {header: values[-1] for header, values in alone.case(0).items()}
        assert event.name == "breakdown"
        assert last["time [s]"] == event.time
        assert last["voltage [V]"] == pytest.approx(event.voltage, rel=1e-12)
        assert last["true_field [V/m]"] == pytest.approx(2.5e7, rel=1e-9)
        area = last["stretch_1 [1]"] ** 4
        assert last["charge_density [C/m^2]"] == pytest.approx(4e-11 * area * event.voltage / THICKNESS, rel=1e-9)
        assert last["electrical_energy [J/m^3]"] > last["leaked_energy [J/m^3]"] > 0
    # a charge applied at once: the film breaks down on the way to it, in the state where the field reaches that of breakdown
    (event,) = (run := actuate(SOFT, [ChargeStep(9e-3)], **film)).events[0]
    assert event.time == 0
    assert event.true_field == pytest.approx(2.5e7, rel=1e-6)  # the tolerance of the solver
    assert run.charge_density[0, 0] == pytest.approx(4e-11 * event.true_field * event.stretch_1 * event.stretch_2, rel=1e-9)


def test_what_cannot_be_is_refused() -> None:
    charge, voltage = [ChargeStep(1e-3)], [VoltageStep(1e3)]
    for steps, wired, message in (
        ([ChargeStep(1e-3), VoltageStep(1e3)], {}, "step 1: a voltage does not go with a charge"),
        (
            charge,
            {"resistance": 1.0, "electrode_area": AREA},
            "resistance: a source that prescribes the charge takes no resistance",
        ),
        (voltage, {"resistance": -1.0, "electrode_area": AREA}, "resistance: -1 ohm: it must not be negative"),
        (voltage, {"resistance": 1.0}, "resistance: .*area of the electrode"),
        (voltage, {"resistance": 1.0, "electrode_area": 0.0}, "electrode_area: 0 m.2: it must be positive"),
        ([ChargeStep(rate=1.0)], {}, "a charge, or the duration of a hold is needed"),
    ):
        with pytest.raises(InputError, match=message):
            actuate(ELASTIC, steps, **wired, **FILM)
    with pytest.raises(InputError, match="conductivity -1 S/m"):
        Leakage(-1.0)
    with pytest.raises(InputError, match="field 0 V/m: a positive number is needed"):
        Leakage(1.0, 0.0)


def test_leakage_is_odd_in_the_field_and_its_slope_is_its_derivative() -> None:
    leakage, field, step = Leakage(2e-13, 2e7), np.array([-6e7, -1e6, 0.0, 3e5, 5e7]), 1e3
    assert leakage.current_density(-field) == pytest.approx(-leakage.current_density(field), rel=1e-15)
    assert leakage.current_density(field)[-1] == pytest.approx(2e-13 * np.exp(2.5) * 5e7, rel=1e-14)
    rise = leakage.current_density(field + step) - leakage.current_density(field - step)
    assert leakage.slope(field) == pytest.approx(rise / (2 * step), rel=1e-4, abs=0.0)
