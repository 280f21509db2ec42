"""Films whose edges move while their circuit opens and closes: closed forms, balance of energy, and the membrane peer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dashpots import Dashpots
from flat import actuate
from peers.kept import Run
from peers.membrane import Piece, constant, ramp
from programmes import programme
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from springs import SPRINGS

from dielast import Breakdown, FilmStep, Material, Programme, Repeat, Spectrum, Track, VoltageStep, Waveform, film_limits
from dielast.base.errors import InputError
from dielast.material.dielectric import Leakage
from dielast.material.shift import NoShift
from dielast.mechanics.history import electrical_pieces
from dielast.mechanics.span import Control
from dielast.numerics import integrate

MU, EPS, THICKNESS, DENSITY, AREA = 3e4, 4e-11, 1e-3, 960.0, 1e-4
ELASTIC = Material("neo-Hookean", MU, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), permittivity=EPS, density=DENSITY)
VOLTAGE = 3e3
FIELD = VOLTAGE / THICKNESS


def run(steps: list[FilmStep], material: Material = ELASTIC, **stated: Any) -> Any:
    return actuate(material, steps, **{"thickness": THICKNESS, "stop_at": "end", "rtol": 1e-9} | stated)


def generator(high: float, low: float, rest: float) -> list[FilmStep]:
    """Stretch, charge, release in an open circuit, discharge."""
    return [
        FilmStep(stretch=high, duration=1.0),
        FilmStep(voltage=VOLTAGE, duration=0.1),
        FilmStep(stretch=low, circuit="open", duration=1.0),
        FilmStep(voltage=0.0, duration=0.1),
        FilmStep(stretch=rest, duration=0.5),
    ]


def harvested(mode: str, high: float, low: float) -> float:
    """The energy in J/m^3 of a cycle: int E~ dD~ at the stretch `low` less that at `high`, up to the same charge.

    Where both axes are held, int E~ dD~ = C E~^2/2. Where axis 2 is free of stress, lambda_2^2 = sqrt(1 + d^2)/lambda_1 with
    d = D~/sqrt(mu eps), and int E~ dD~ = mu (sqrt(1 + d^2) - 1)/lambda_1.
    """
    if mode == "uniaxial":
        root = (1 - EPS * (FIELD * high) ** 2 / MU) ** -0.5
        return MU * (root - 1) * (1 / low - 1 / high)
    power = 4 if mode == "equibiaxial" else 2
    return 0.5 * EPS * FIELD**2 * high**power * ((high / low) ** power - 1)


@pytest.mark.parametrize("mode", ["equibiaxial", "pure-shear", pytest.param("uniaxial", marks=pytest.mark.trust)])
def test_a_cycle_of_an_ideal_generator(mode: str) -> None:
    history = run(generator(3.0, 2.0, 1.5), mode=mode, repeat=Repeat(2), rtol=1e-8)
    cycles, wanted = history.cycles, harvested(mode, 3.0, 2.0)
    assert cycles.electrical_energy[0] == pytest.approx(-wanted, rel=1e-9)
    assert cycles.energy_per_mass[0] == pytest.approx(wanted / DENSITY, rel=1e-9)
    assert cycles.mechanical_work[0, 1:] == pytest.approx(wanted, rel=1e-9)
    assert cycles.efficiency[0, 1:] == pytest.approx(1.0, rel=1e-9)
    assert history.electrical_energy[0, -1] == pytest.approx(-2 * wanted, rel=1e-9)
    assert history.stored_energy[0, -1] == pytest.approx(
        history.mechanical_work[0, -1] + history.electrical_energy[0, -1], rel=1e-9
    )
    assert np.abs(history.dissipated_energy).max() < 1e-9 * 2 * wanted
    assert cycles.lowest[0].tolist() == pytest.approx([1.0, 1.5], rel=1e-9)


def test_a_film_that_shrinks_in_an_open_circuit() -> None:
    """Its voltage is as 1/(lambda_1 lambda_2)^2, whatever the steps between; with a constant conductivity sigma, the charge falls
    as exp(-sigma t/eps); with another law, as its own equation says."""
    steps = [
        FilmStep(stretch=(3.0, 2.0), duration=1.0),
        VoltageStep(VOLTAGE, duration=0.1),
        FilmStep(circuit="open", stretch=(2.0, 2.0), duration=1.0),
        FilmStep(stretch=(2.0, 1.2), duration=2.0),
    ]
    times = np.array([1.1, 1.3, 2.0, 2.1, 3.0, 4.1])
    history = run(steps, times=times)
    area = history.stretch_1[0] * history.stretch_2[0]
    assert history.voltage[0] == pytest.approx(VOLTAGE * (6.0 / area) ** 2, rel=1e-8)
    for conductivity, field in ((2e-12, np.inf), (5e-13, 4e6)):
        leaking = run(steps, times=times, leakage=Leakage(conductivity, field))
        full = EPS * FIELD * 36

        def rate(t: float, charge: np.ndarray, conductivity: float = conductivity, field: float = field) -> np.ndarray:
            first = 3 - t if t < 1 else 2.0
            area = first * (2.0 if t < 1 else 2.0 - 0.4 * (t - 1))
            true = charge / (EPS * area)
            return -conductivity * np.exp(np.abs(true) / field) * true * area

        parts = [solve_ivp(rate, (0, 1), [full], "DOP853", rtol=1e-12, atol=1e-20, dense_output=True)]
        parts.append(solve_ivp(rate, (1, 3), parts[0].y[:, -1], "DOP853", rtol=1e-12, atol=1e-20, dense_output=True))
        charge = np.array([parts[int(t > 1)].sol(t)[0] for t in times - 1.1])
        if field == np.inf:
            assert charge == pytest.approx(full * np.exp(-conductivity / EPS * (times - 1.1)), rel=1e-11)
        assert leaking.charge_density[0] == pytest.approx(charge, rel=1e-8)
        assert leaking.voltage[0] == pytest.approx(THICKNESS * charge / (EPS * area**2), rel=1e-8)


def test_a_circuit_that_closes_again() -> None:
    """The source is at its last voltage, at once; behind a resistance the charge of a held film follows as exp(-t/(r C))."""
    steps = [
        FilmStep(stretch=3.0, duration=1.0),
        FilmStep(voltage=VOLTAGE, duration=0.5),
        FilmStep(circuit="open", stretch=2.0, duration=1.0),
        FilmStep(circuit="closed", duration=2.0),
    ]
    times = np.array([2.5001, 3.0, 4.5])
    assert run(steps, times=times).voltage[0] == pytest.approx(VOLTAGE, rel=1e-12)
    resistance = 1e7
    late = run(steps, times=[2.5, *times], resistance=resistance, electrode_area=AREA)
    constant_of_circuit = resistance * AREA / THICKNESS * EPS * 16
    begin = late.voltage[0, 0]
    assert begin > 2 * VOLTAGE
    wanted = VOLTAGE + (begin - VOLTAGE) * np.exp(-(times - 2.5) / constant_of_circuit)
    assert late.voltage[0, 1:] == pytest.approx(wanted, rel=1e-7)


@pytest.mark.parametrize(("mode", "power"), [("equibiaxial", 3), ("pure-shear", 1)])
def test_the_blocked_force_is_less_by_the_maxwell_stress(mode: str, power: int) -> None:
    held = run([FilmStep(stretch=2.0, duration=1.0), FilmStep(voltage=VOLTAGE, duration=0.5)], mode=mode, times=[1.0, 1.2, 1.5])
    voltage = np.array([0.0, 0.4, 1.0]) * FIELD
    elastic = MU * (2.0 - 2.0 ** (-5 if mode == "equibiaxial" else -3))
    assert held.nominal_stress_1[0] == pytest.approx(elastic - EPS * voltage**2 * 2.0**power, rel=1e-9)


def test_the_blocked_force_of_a_film_with_branches() -> None:
    springs = SPRINGS["gent"]
    axes, hold = (("stretch", ramp(1.0, 2.0, 1.0)),) * 2, (("stretch", constant(2.0)),) * 2
    there = Run(
        springs.film,
        [Piece(1.0, axes), Piece(0.5, hold, ("field", ramp(0.0, FIELD, 0.5))), Piece(5.0, hold, ("field", constant(FIELD)))],
        rtol=3e-9,
    )
    times = np.array([0.5, 1.0, 1.3, 1.5, 1.6, 3.0, 6.5])
    steps = [FilmStep(stretch=2.0, duration=1.0), FilmStep(voltage=VOLTAGE, duration=0.5), FilmStep.hold(5.0)]
    here = run(steps, springs.material, times=times)
    assert here.nominal_stress_1[0] == pytest.approx(there.at(times).stress[0], rel=1e-7)


@pytest.mark.parametrize("seed", [4, *(pytest.param(seed, marks=pytest.mark.trust) for seed in (0, 1, 3, 5, 6, 15))])
def test_random_programmes_against_the_peer(seed: int) -> None:
    """4 breaks down; 0 loses tension and pulls in, too; 3 is held by a spring. All of them: bench_programmes."""
    stated = programme(seed)
    assert stated is not None
    assert seed != 0 or set(stated.events) == {"breakdown", "loss-of-tension", "pull-in"}
    assert seed != 3 or any(stated.stiffness)
    off = stated.differences()
    events = {name: off.pop(name) for name in stated.events}
    assert set(off) == {"stretch", "stress", "voltage", "charge"}
    assert max(off.values()) < 1e-7
    assert max(events.values()) < 1e-6


def test_energy_is_conserved_over_cycles_with_all_losses(monkeypatch: pytest.MonkeyPatch) -> None:
    """The dissipation follows from the balance; here it is also the sum over the dashpots, by another quadrature."""
    watches: list[Dashpots] = []

    class Summing(Dashpots):
        def __init__(self, films: Any, criteria: Any, *_: Any) -> None:
            super().__init__(films, np.ones(1), criteria)
            watches.append(self)

    monkeypatch.setattr("dielast.simulate.actuation_history.Watch", Summing)
    material = Material("m", MU, Spectrum(np.array([1.0, 0.05]), np.array([2e4, 5e4])), NoShift(20.0), permittivity=EPS)
    steps = [
        FilmStep(stretch=2.5, duration=0.5),
        FilmStep(voltage=VOLTAGE, duration=0.2),
        FilmStep(circuit="open", stretch=2.0, duration=0.5),
        FilmStep(voltage=0.0, duration=0.2),
    ]
    losses = {"leakage": Leakage(2e-13, 3e7), "resistance": 2e7, "electrode_area": AREA}
    cycles = 3
    history = run(steps, material, repeat=Repeat(cycles), times=[1.4 * cycles], rtol=1e-7, **losses)
    row = {name.split(" ")[0]: values[0, -1] for name, values in history.values.items()}
    given = abs(row["electrical_energy"]) + row["mechanical_work"]
    assert row["dissipated_energy"] == pytest.approx(watches[0].dissipated, abs=1e-6 * given)
    assert row["resistor_energy"] == pytest.approx(watches[0].lost, abs=1e-6 * given)
    assert min(row["dissipated_energy"], row["leaked_energy"], row["resistor_energy"]) > 1e-4 * given
    table = history.cycles
    assert np.sum(table.electrical_energy) == pytest.approx(row["electrical_energy"], abs=1e-9 * given)
    assert np.sum(table.mechanical_work) == pytest.approx(row["mechanical_work"], abs=1e-9 * given)


def test_waveforms_of_edges_and_electrodes_with_a_phase() -> None:
    """Elastic, held at both axes: everything is a function of the two loads, and the net energy that of the loop, by quadrature."""
    wave = {"period": 2.0, "cycles": 3}
    phase = 0.7
    for shape in ("sine", "triangle"):
        stretch, voltage = Waveform(2.0, 3.0, shape=shape, **wave), Waveform(500.0, 2000.0, shape=shape, **wave)
        history = run([FilmStep(stretch=2.0, duration=1.0), FilmStep(stretch=stretch, voltage=voltage, phase=phase)])

        def load(turn: float, low: float, high: float, ahead: float, shape: str = shape) -> float:
            at = turn + ahead / (2 * np.pi)
            return low + (high - low) * (0.5 * (1 - np.cos(2 * np.pi * at)) if shape == "sine" else 1 - abs(2 * (at % 1) - 1))

        late = history.time[0] > 1.0
        turns = (history.time[0, late] - 1.0) / 2.0
        stretches = [load(turn, 2.0, 3.0, 0.0) for turn in turns]
        volts = np.array([load(turn, 500.0, 2000.0, phase) for turn in turns])
        assert history.stretch_1[0, late] == pytest.approx(stretches, rel=1e-9)
        assert history.voltage[0, late] == pytest.approx(volts, rel=1e-8)

        def power(turn: float, shape: str = shape) -> float:
            width = 1e-6
            charge = [
                EPS * load(at, 500.0, 2000.0, phase) / THICKNESS * load(at, 2.0, 3.0, 0.0) ** 4
                for at in (turn - width, turn + width)
            ]
            return load(turn, 500.0, 2000.0, phase) / THICKNESS * (charge[1] - charge[0]) / (2 * width)

        kinks = [0.5, 0.5 - phase / (2 * np.pi), 1 - phase / (2 * np.pi)]
        wanted = quad(power, 0.0, 1.0, points=kinks, epsrel=1e-10)[0]
        assert history.cycles.electrical_energy[0] == pytest.approx(wanted, rel=1e-6)
        assert history.cycles.mechanical_work[0] == pytest.approx(-wanted, rel=1e-6)


@pytest.mark.parametrize("shape", ["sine", pytest.param("triangle", marks=pytest.mark.trust)])
def test_a_ramp_beside_a_waveform(shape: str) -> None:
    """The electrodes go straight to their target over all cycles of the edges, and the reverse; elastic, held at both axes."""
    period, cycles = 2.0, 3
    begin = [FilmStep(stretch=2.0, voltage=500.0, duration=1.0)]

    def up(time: np.ndarray) -> np.ndarray:
        turn = time / period
        return 0.5 * (1 - np.cos(2 * np.pi * turn)) if shape == "sine" else 1 - np.abs(2 * (turn % 1) - 1)

    wave = {"period": period, "cycles": cycles, "shape": shape}
    for step, stretches, volts in (
        (FilmStep(stretch=Waveform(2.0, 3.0, **wave), voltage=2e3), (2, 1, 0), (500, 0, 1500)),
        (FilmStep(stretch=(3.0, 2.0), voltage=Waveform(500.0, 2e3, **wave)), (2, 0, 1), (500, 1500, 0)),
    ):
        history = run([*begin, step, FilmStep.hold(1.0)])
        late = (history.time[0] > 1.0) & (history.time[0] <= 7.0)
        time = history.time[0, late] - 1
        stretch, voltage = (low + wave_ * up(time) + ramp_ * time / 6 for low, wave_, ramp_ in (stretches, volts))
        assert history.stretch_1[0, late] == pytest.approx(stretch, rel=1e-9)
        assert history.voltage[0, late] == pytest.approx(voltage, rel=1e-9)
        area = stretch * (stretch if step.stretch is not None and not isinstance(step.stretch, tuple) else 2.0)
        assert history.charge_density[0, late] == pytest.approx(EPS * voltage / THICKNESS * area**2, rel=1e-8)
        assert history.voltage[0, -1] == pytest.approx(volts[0] + volts[2], rel=1e-9)
        stored = history.stored_energy[0] - history.mechanical_work[0] - history.electrical_energy[0]
        assert np.abs(stored).max() < 1e-8 * history.stored_energy.max()
        assert history.cycles.mean.shape == (1, cycles)
    # a voltage that an open circuit has changed passes 0 within a cycle, where a span ends and its magnitude begins to rise
    opened = FilmStep(stretch=2.5, circuit="open", duration=1.0)
    present = 500 * (2.0 / 2.5) ** 4
    crossing = FilmStep(stretch=Waveform(2.5, 3.0, **wave), voltage=-2e3)
    crossed = run([*begin, opened, crossing])
    late = (crossed.time[0] > 2.0) & (crossed.time[0] <= 8.0)
    time = crossed.time[0, late] - 2
    assert crossed.voltage[0, late] == pytest.approx(present - (2e3 + present) * time / 6, rel=1e-9, abs=1e-6)
    stretch = 2.5 + 0.5 * up(time)
    cycles_of = electrical_pieces(Programme([crossing]), (Control.STRETCH,) * 2, np.full(1, THICKNESS), edges=True)[0]
    begun = cycles_of.begin(np.array([[2.5], [2.5], [present / THICKNESS]]))
    zero = 6 * present / (2e3 + present)
    spans = np.arange(begun.spans)
    lasts = begun.span(np.zeros_like(spans), spans)[1]
    assert begun.rises(np.arange(3)) == pytest.approx(np.array([[zero]]))
    assert np.abs(np.cumsum(lasts) - zero).min() < 1e-12
    assert np.sum(lasts) == pytest.approx(6.0)
    assert crossed.charge_density[0, late] == pytest.approx(EPS * crossed.voltage[0, late] / THICKNESS * stretch**4, rel=1e-8)


def test_laps_take_no_memory_but_their_rows() -> None:
    steps = [FilmStep(stretch=2.0), *generator(3.0, 2.0, 1.5), FilmStep(circuit="closed", duration=1.0)]
    pieces = electrical_pieces(Programme(steps, repeat=Repeat(50, 1, 5)), (Control.STRESS,) * 2, np.full(1, THICKNESS), edges=True)
    assert len(pieces) == 1 + 50 * 5 + 2
    assert len(pieces.stored) == 1 + 2 * 5 + 2
    assert [piece.lap for piece in pieces] == [0, *np.repeat(np.arange(1, 51), 5), 0, 0]
    assert [piece.step for piece in pieces] == [0, *50 * [1, 2, 3, 4, 5], 6, 6]
    assert pieces[-1] is pieces.stored[-1]
    with pytest.raises(IndexError):
        pieces[len(pieces)]


def test_a_film_against_a_spring() -> None:
    """Its stress is that of the film alone and that of the spring; a spring is between a dead load and a clamp."""
    stiffness, start = 2e4, 1.5

    def stretch_of(stiffness: float) -> float:
        load = MU * (start - start**-5)

        def imbalance(x: float) -> float:
            return MU * (x - x**-5) - EPS * FIELD**2 * x**3 - load + stiffness * (x - start)

        return float(brentq(imbalance, start, 1.8, xtol=1e-15))

    steps, film = [VoltageStep(VOLTAGE, duration=1.0)], {"prestretch": start, "times": [1.0], "rtol": 1e-10}
    for spring in (stiffness, 1e3, 1e6):
        history = run(steps, spring=(spring, spring), **film)
        assert history.stretch_1[0, 0] == pytest.approx(stretch_of(spring), rel=1e-9)
        moved = history.stretch_1[0, 0] - start
        begin = MU * (start - start**-5)
        assert history.nominal_stress_1[0, 0] == pytest.approx(begin - spring * moved, rel=1e-9)
        assert history.mechanical_work[0, 0] == pytest.approx(2 * (begin * moved - 0.5 * spring * moved**2), rel=1e-8)
        assert abs(history.dissipated_energy[0, 0]) < 1e-8 * history.electrical_energy[0, 0]


def test_a_spring_delays_pull_in() -> None:
    """Where the stiffness of film, spring and Maxwell stress together is zero, in closed form of the stretch."""
    start, stiffness = 1.2, 5e3

    def field_squared(x: Any) -> Any:
        return (MU * (x - x**-5) - MU * (start - start**-5) + stiffness * (x - start)) / (EPS * x**3)

    grid = np.linspace(start, 2.0, 200_001)
    top = grid[np.argmax(field_squared(grid))]
    steps = [VoltageStep(1.2 * THICKNESS * np.sqrt(field_squared(top)), duration=10.0)]
    history = run(steps, spring=(stiffness, stiffness), prestretch=start, stop_at="pull-in")
    (event,) = history.events[0]
    assert event.stretch_1 == pytest.approx(top, rel=1e-4)
    assert event.voltage == pytest.approx(THICKNESS * np.sqrt(field_squared(top)), rel=1e-8)


def test_events_of_moving_edges() -> None:
    """A released film goes slack, and the true field of an open circuit grows as it shrinks, each where the closed form says so."""
    steps = [
        FilmStep(stretch=3.0, duration=1.0),
        FilmStep(voltage=VOLTAGE, duration=0.1),
        FilmStep(stretch=1.5, circuit="open", duration=1.0),
    ]
    history = run(steps, breakdown_field=5e7)
    times = {event.name: event.time for event in history.events[0]}
    # E = E~ (lambda_1 lambda_2) (3/lambda)^4, so that E = E_EB at lambda^2 = 81 E~/E_EB
    assert times["breakdown"] == pytest.approx(1.1 + (3.0 - np.sqrt(81 * FIELD / 5e7)) / 1.5, rel=1e-9)
    # mu (lambda^2 - lambda^-4) = D~^2/(eps lambda^4)
    slack = brentq(lambda x: MU * (x**6 - 1) - EPS * (81 * FIELD) ** 2, 1.5, 3.0, xtol=1e-14)
    assert times["loss-of-tension"] == pytest.approx(1.1 + (3.0 - slack) / 1.5, rel=1e-9)


def test_energies_of_a_film_whose_edges_stay() -> None:
    """Those of a programme of the electrodes alone are the same; dead load does its stress times the way, and an elastic film loses
    nothing."""
    branches = Material("m", MU, Spectrum(np.array([0.5]), np.array([2e4])), NoShift(20.0), permittivity=EPS)
    steps, film = (
        [VoltageStep(VOLTAGE, duration=1.0), VoltageStep(0.0, duration=1.0)],
        {"prestretch": (2.0, 1.5), "times": [1.0, 2.0]},
    )
    for material in (ELASTIC, branches):
        alone = run(steps, material, electrical=True, **film)
        both = run([FilmStep(voltage=step.voltage, duration=1.0) for step in steps], material, **film)
        scale = np.abs(both.electrical_energy).max()
        for name in ("electrical_energy", "mechanical_work", "stored_energy", "dissipated_energy"):
            assert getattr(alone, name) == pytest.approx(getattr(both, name), abs=1e-8 * scale), name
        way = (alone.stretch_1[0] - 2.0, alone.stretch_2[0] - 1.5)
        work = alone.nominal_stress_1[0] * way[0] + alone.nominal_stress_2[0] * way[1]
        assert alone.mechanical_work[0] == pytest.approx(work, abs=1e-8 * scale)
        lost = alone.dissipated_energy[0, -1] / scale
        assert lost > 1e-3 if material is branches else abs(lost) < 1e-8


def test_edges_let_go_of_a_film_that_only_they_held() -> None:
    """At constant voltage the stress falls with the stretch: stable while held, not under a dead load."""
    at, share = 1.3, 0.43
    stress = MU * (at - at**-5 - share * at**3)
    assert stress > 0 > 1 + 5 * at**-6 - 3 * share * at**2
    field = np.sqrt(share * MU / EPS)
    steps = [
        FilmStep(stretch=at, duration=1.0),
        FilmStep(voltage=THICKNESS * field, duration=1.0),
        FilmStep(stress=1.01 * stress, duration=1.0),
    ]
    history = run(steps, stop_at="pull-in")
    assert [(event.name, event.time) for event in history.events[0]] == [("pull-in", 2.0)]


def test_edges_at_once_do_the_work_of_a_slow_move() -> None:
    """An elastic film has no memory of how fast it came, in an open circuit and at a constant voltage."""
    slow = [
        FilmStep(stretch=2.5, duration=1.0),
        FilmStep(voltage=VOLTAGE, duration=1.0),
        FilmStep(stretch=(2.0, 1.8), duration=1.0),
    ]
    for circuit in ("open", None):
        steps = [*slow[:2], FilmStep(stretch=(2.0, 1.8), circuit=circuit, duration=1.0), FilmStep(stress=(9e3, 7e3), duration=1.0)]
        quick = [
            FilmStep(stretch=2.5),
            FilmStep(voltage=VOLTAGE),
            FilmStep(stretch=(2.0, 1.8), circuit=circuit),
            FilmStep(stress=(9e3, 7e3)),
            FilmStep.hold(1.0),
        ]
        one, other = (run(programme) for programme in (steps, quick))
        for name in ("electrical_energy", "stretch_1", "voltage", "stored_energy"):
            assert getattr(one, name)[0, -1] == pytest.approx(getattr(other, name)[0, -1], rel=1e-8), name
        if circuit == "open":
            assert one.mechanical_work[0, -1] == pytest.approx(other.mechanical_work[0, -1], rel=1e-8)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (FilmStep(charge=1e-3, circuit="closed"), "closed circuit has the voltage of its source"),
        (FilmStep(voltage=1e3, circuit="open"), "open circuit keeps its charge"),
        (FilmStep(voltage=1e3, charge=1e-3), "not both"),
        (FilmStep(stretch=2.0, stress=1e4), "not both"),
        (FilmStep(stress=-1e4), "no compression"),
        (FilmStep(circuit="ajar"), '"open" or "closed"'),
        (FilmStep(stretch=0.0), "must be positive"),
        (FilmStep(stretch=Track([0.0, 1.0], [1.0, 2.0]), voltage=1e3), "a track goes with a track"),
        (FilmStep(stretch=Waveform(1.0, 2.0, 1.0), voltage=Waveform(0.0, 1e3, 2.0)), "of one shape, period"),
        (FilmStep(), "is needed"),
    ],
)
def test_steps_that_contradict_themselves(step: FilmStep, words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        run([FilmStep(stretch=2.0), step])
    assert refused.value.problems[0].step == 1


def test_edges_that_are_held_cannot_move() -> None:
    frame = {"boundary": "frame", "electrode_share": 0.2, "prestretch": 2.0}
    with pytest.raises(InputError, match="edges cannot be moved"):
        run([FilmStep(stretch=2.0)], **frame)
    with pytest.raises(InputError, match="a spring holds the edges along axis 1"):
        run([FilmStep(stretch=2.0)], spring=1e4)
    with pytest.raises(InputError, match="dead-load alone"):
        run([VoltageStep(1e3)], spring=1e4, boundary="clamped")


@pytest.mark.parametrize("mode", ["equibiaxial", "pure-shear", "uniaxial"])
def test_the_map_of_a_generator(mode: str) -> None:
    """The limits of Koh, Keplinger and Suo in closed form, and a cycle fails where it crosses them."""
    at, strength = np.array([1.2, 1.5, 2.0, 3.0]), 5e7
    found = film_limits(ELASTIC, at, thickness=THICKNESS, mode=mode, breakdown=Breakdown((1.0,), (strength,)))
    if mode == "equibiaxial":
        slack, pull_in, area = at**-2.0 - at**-8.0, (1 + 5 * at**-6.0) / (3 * at**2), at**2
    elif mode == "pure-shear":
        # axis 2, held at 1, is slack before axis 1
        slack, pull_in, area = (1 - at**-2.0) / at**2, 1 + 3 * at**-4.0, at
    else:
        # lambda_2^2 = (1 - q)^(-1/2)/lambda_1, so that both axes lose their tension together, where none is left: q = eps E~^2
        # lambda_1^2/mu; lambda_1 s_1/mu = lambda_1^2 - lambda_1^-2 lambda_2^-2 - q lambda_2^2
        def tension(q: float, x: float) -> float:
            across = (1 - q) ** -0.5 / x
            return x**2 - x**-2 / across - q * across

        slack = np.array([brentq(tension, 0.0, 1 - 1e-12, args=(x,), xtol=1e-15) / x**2 for x in at])
        width = np.array([(1 - q * x**2) ** -0.25 * x**-0.5 for q, x in zip(slack, at, strict=True)])
        area, pull_in = at * width, None
    assert found.loss_of_tension == pytest.approx(THICKNESS * np.sqrt(MU / EPS * slack), rel=1e-9)
    if pull_in is not None:
        assert found.pull_in == pytest.approx(THICKNESS * np.sqrt(MU / EPS * pull_in), rel=1e-9)
        assert found.breakdown == pytest.approx(THICKNESS * strength / area, rel=1e-9)
        steps = [FilmStep(stretch=2.0, duration=1.0), FilmStep(voltage=2 * found.loss_of_tension[2], duration=2.0)]
        history = run(steps, mode=mode)
        event = next(event for event in history.events[0] if event.name == "loss-of-tension")
        assert event.voltage == pytest.approx(found.loss_of_tension[2], rel=1e-8)
    with pytest.raises(InputError, match="at least 1"):
        film_limits(ELASTIC, 0.5, thickness=THICKNESS)


def test_a_uniaxial_pull_takes_as_few_steps_as_an_equibiaxial_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """What fades in its springs after a kink is known, whether films beside it are undeformed or not."""
    film = Material("m", 3e4, Spectrum(np.logspace(-5, 3, 9), np.full(9, 4e4)), NoShift(20.0), permittivity=EPS)
    tried, advance = list[float](), integrate.advance
    monkeypatch.setattr(integrate, "advance", lambda *step: (tried.append(float(step[4][0])), advance(*step))[1])
    at = [0.5, 1.0, 1.1, 1.2]

    def pulled(mode: str, voltage: Any, prestretch: Any = 1.0) -> Any:
        steps = [FilmStep(stretch=2.0, duration=1.0), FilmStep(voltage=voltage, duration=0.2)]
        return run(steps, film, mode=mode, prestretch=prestretch, times=at, rtol=1e-6)

    counts = []
    for mode in ("equibiaxial", "uniaxial"):
        tried.clear()
        pulled(mode, 0.0)
        counts.append(len(tried))
    assert counts[1] < 1.3 * counts[0]
    several = pulled("uniaxial", [0.0, 1e3, 0.0], [1.0, 1.0, 1.2])
    for case, (voltage, prestretch) in enumerate([(0.0, 1.0), (1e3, 1.0), (0.0, 1.2)]):
        alone = pulled("uniaxial", voltage, prestretch)
        assert all(np.array_equal(several.values[name][case], value[0]) for name, value in alone.values.items())
    assert several.stretch_2[0] == pytest.approx(several.stretch_1[0] ** -0.5, rel=1e-12)


@pytest.mark.parametrize(
    "mode", ["uniaxial", *(pytest.param(mode, marks=pytest.mark.trust) for mode in ("equibiaxial", "pure-shear"))]
)
def test_a_held_edge_is_set_free_behind_a_resistance(mode: str) -> None:
    """A small resistance delays nothing: the film is that of a stiff source, in rows on both sides of the change of control."""
    film = Material("m", 3e4, Spectrum(np.array([1.0, 0.05]), np.array([2e4, 5e4])), NoShift(20.0), permittivity=EPS)
    steps = [FilmStep(stretch=2.5, duration=0.5), FilmStep(voltage=2e3, duration=0.2), FilmStep(stress=1e4, duration=0.5)]
    at = [0.3, 0.7, 0.9, 1.2]
    bare = run(steps, film, mode=mode, times=at, rtol=1e-7)
    behind = run(steps, film, mode=mode, times=at, rtol=1e-7, resistance=1.0, electrode_area=AREA)
    assert all(outcome.completed for outcome in behind.outcome)
    assert behind.stretch_1 == pytest.approx(bare.stretch_1, rel=1e-6)
    assert behind.nominal_stress_1 == pytest.approx(bare.nominal_stress_1, rel=1e-5)


@pytest.mark.parametrize(
    "losses",
    [pytest.param({}, marks=pytest.mark.trust), {"leakage": Leakage(2e-13, 3e7), "resistance": 2e7, "electrode_area": AREA}],
)
def test_energies_of_laps_add_up_to_those_of_the_history_where_a_held_edge_is_set_free(losses: dict[str, Any]) -> None:
    """The work of all laps is also what springs and dielectric store and dashpots and losses dissipate."""
    film = Material("m", 3e4, Spectrum(np.array([1.0, 0.05]), np.array([2e4, 5e4])), NoShift(20.0), permittivity=EPS)
    steps = [
        FilmStep(stretch=2.5, duration=0.5),
        FilmStep(voltage=VOLTAGE, duration=0.2),
        FilmStep(stress=1e4, duration=0.5),
        FilmStep(voltage=0.0, duration=0.2),
    ]
    history = run(steps, film, mode="uniaxial", repeat=Repeat(2), times=[2.8], rtol=1e-7, **losses)
    energy = {name.partition(" ")[0]: float(value[0, -1]) for name, value in history.values.items() if "J/m^3" in name}
    laps = history.cycles.to_frame().sum()
    assert laps["mechanical_work [J/m^3]"] == pytest.approx(energy["mechanical_work"], rel=1e-7)
    assert laps["electrical_energy [J/m^3]"] == pytest.approx(energy["electrical_energy"], rel=1e-6)
    kept = energy["stored_energy"] + energy["dissipated_energy"]
    assert laps["work [J/m^3]"] == pytest.approx(kept + energy.get("leaked_energy", 0.0), rel=1e-6)
