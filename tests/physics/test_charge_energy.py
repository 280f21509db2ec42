"""Work of the source and of the loads is stored, dissipated in dashpots, leaked, or lost in the source's resistance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dashpots import Dashpots
from films import SOFT
from flat import actuate

from dielast.material.dielectric import Leakage, LinearPermittivity
from dielast.material.laws_of_cases import FailureLaws
from dielast.material.springs import EQUIBIAXIAL
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.film import FilmState
from dielast.mechanics.history import electrical_pieces
from dielast.mechanics.load import ChargeStep, ElectricalStep, Programme, VoltageStep, Waveform
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Controls
from dielast.mechanics.stability import ONE_PERCENT
from dielast.simulate import electrical
from dielast.simulate.electrical import ElectricMeter
from dielast.simulate.follow import follow
from dielast.simulate.options import Circuit
from dielast.simulate.output import Output
from dielast.simulate.recorder import Recorder
from dielast.simulate.setup import prestretched
from dielast.simulate.wiring import Wiring

THICKNESS, AREA = 0.5e-3, 1e-4
FREE, HELD = Control.STRESS, Control.STRETCH
RAMPS: list[ElectricalStep] = [
    VoltageStep(2e3, duration=3.0),
    VoltageStep.hold(200.0),
    VoltageStep(-1e3, duration=10.0),
    VoltageStep.hold(50.0),
]
AT_ONCE: list[ElectricalStep] = [VoltageStep(1.8e3), VoltageStep.hold(100.0), VoltageStep(0.0), VoltageStep.hold(50.0)]
CHARGES: list[ElectricalStep] = [
    ChargeStep(2e-3, duration=3.0),
    ChargeStep.hold(200.0),
    ChargeStep(1e-3),
    ChargeStep.hold(20.0),
    ChargeStep(-1e-3, duration=10.0),
    ChargeStep.hold(50.0),
]


def stored(points: PointMaterial, film: FilmState) -> float:
    """Energy of springs and dielectric in J/m^3."""
    squared = points.springs(film.internal, film.log_squared_stretch)
    field, charge = points.nominal(film.log_squared_stretch, film.electrical)
    return float((np.sum(points.modulus * points.law.energy(squared), axis=0) + 0.5 * field * charge)[0])


@pytest.mark.parametrize(
    ("steps", "resistance", "leakage", "prestretch", "controls"),
    [
        pytest.param(RAMPS, None, Leakage(2e-14, 2e7), (1.9, 1.9), (FREE, FREE), marks=pytest.mark.trust),
        pytest.param(AT_ONCE, None, None, (2.5, 1.2), (FREE, FREE), marks=pytest.mark.trust),
        (RAMPS, 3e10, Leakage(2e-14, 2e7), (1.9, 1.9), (FREE, FREE)),
        pytest.param(AT_ONCE, 3e10, None, (2.0, 1.5), (FREE, HELD), marks=pytest.mark.trust),
        pytest.param(RAMPS, 1e5, Leakage(2e-14), (2.5, 1.2), (FREE, FREE), marks=pytest.mark.trust),
        pytest.param(CHARGES, None, Leakage(2e-14, 2e7), (1.9, 1.9), (FREE, FREE), marks=pytest.mark.trust),
        (CHARGES, None, Leakage(1e-13), (1.7, 1.7), (HELD, HELD)),
        pytest.param(CHARGES, None, None, (2.5, 1.2), (HELD, FREE), marks=pytest.mark.trust),
    ],
)
def test_energy_is_conserved(
    steps: list[ElectricalStep],
    resistance: float | None,
    leakage: Leakage | None,
    prestretch: tuple[float, float],
    controls: Controls,
) -> None:
    material = replace(SOFT, permittivity=LinearPermittivity(4e-11, stretch_coefficient=-0.05)) if prestretch[0] > 2.2 else SOFT
    rtol, one = 1e-9, np.ones(1)
    points = PointMaterial.of(material, 20 * one, rtol)
    charge = isinstance(steps[0], ChargeStep)
    wiring = Wiring.of(charge, Circuit(resistance, leakage, AREA), THICKNESS * one)
    symmetry = EQUIBIAXIAL if prestretch[0] == prestretch[1] and controls[0] is controls[1] else None
    film, _ = prestretched(FilmState.at_rest(points, symmetry), (prestretch[0] * one, prestretch[1] * one), 5 * one, 600.0, rtol)
    film = replace(film, points=wiring.wired(film.points, np.zeros(1, dtype=np.intp)))
    begin = film
    watched = WatchedFilms(controls, FailureLaws(np.inf * one), ONE_PERCENT, begin.nominal_stress, points.stress_floor)
    watch, meter = Dashpots(watched, wiring.resistance), ElectricMeter(wiring.leakage, 1)
    pieces = electrical_pieces(Programme(steps), controls, one if charge else THICKNESS * one)
    recorder = Recorder(Output(points_per_decade=2), watch, meter)
    end = follow(film, pieces, rtol=rtol, watch=watch, recorders=[recorder]).film
    work, leaked, lost, edges = meter.totals[:, 0]
    free = np.array([control is FREE for control in controls])
    moved = np.exp(0.5 * end.log_squared_stretch) - np.exp(0.5 * begin.log_squared_stretch)
    mechanical = float(np.sum((begin.nominal_stress * moved)[free]))
    assert edges == pytest.approx(mechanical, abs=1e-12 * abs(work))
    gained = stored(film.points, end) - stored(film.points, begin)
    scale = abs(work) + abs(mechanical)
    assert work + mechanical == pytest.approx(gained + watch.dissipated + leaked + lost, abs=1e-6 * scale)
    assert lost == pytest.approx(watch.lost, abs=1e-6 * scale)
    assert (leaked > 1e-3 * scale) == (leakage is not None)
    assert watch.dissipated > 0
    # the last row of the table is the end
    record = recorder.collect()
    assert record.electrical[3:7, 0, -1] == pytest.approx(meter.totals[:, 0], rel=1e-12, abs=1e-12 * scale)


def test_the_heat_of_a_small_resistance_is_r_i_squared() -> None:
    """What drops across it is less than the tolerance of the film's voltage, and cannot be taken from the difference of the two."""
    steps = [VoltageStep(3e3, duration=3.0)]
    ohm = np.array([1.0, 1e3, 1e6])
    run = actuate(SOFT, steps, thickness=5e-4, prestretch=1.9, resistance=ohm, electrode_area=2e-5, stop_at="end")
    heat = run.resistor_energy
    assert heat is not None
    assert (np.diff(heat, axis=1) >= 0).all()
    assert heat[:, -1] / ohm == pytest.approx(heat[-1, -1] / ohm[-1], rel=1e-3)
    time, current = run.time[0], run.current[0]
    volume = 2e-5 * 5e-4
    assert heat[0, -1] == pytest.approx(np.trapezoid(ohm[0] * current**2, time) / volume, rel=0.02)


def test_energies_do_not_depend_on_how_many_steps_are_evaluated_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """In films of several groups, through cycles, a voltage applied at once, and failures."""
    steps = [VoltageStep(Waveform(0.0, 2e3, 2.0)), VoltageStep(6e3), VoltageStep.hold(1.0)]
    ohm = np.array([0.0, 1e9, 1e12])
    runs = []
    for many in (electrical.MANY, 1):
        monkeypatch.setattr(electrical, "MANY", many)
        film = {"thickness": 5e-4, "prestretch": 1.9, "electrode_area": 2e-5, "breakdown_field": 48e6, "points_per_decade": 2}
        runs.append(actuate(SOFT, steps, resistance=ohm, leakage=Leakage(1e-13), **film))  # type: ignore[arg-type]
    together, alone = runs
    assert len({outcome.reason for outcome in together.outcome}) > 1
    assert {"charge [C]", "source_voltage [V]", "leaked_energy [J/m^3]", "resistor_energy [J/m^3]"} <= together.values.keys()
    for header, values in together.values.items():
        assert np.array_equal(values, alone.values[header], equal_nan=True)


@pytest.mark.parametrize("step", [ChargeStep(Waveform(0.0, 2e-3, 10.0, 2)), VoltageStep(Waveform(0.0, 2e3, 10.0, 2))])
def test_the_work_of_a_cycle_does_not_depend_on_whether_energies_are_asked_for(step: ElectricalStep) -> None:
    asked, plain = (actuate(SOFT, [step], thickness=THICKNESS, prestretch=1.9, electrical=asked).cycles for asked in (True, False))
    assert asked is not None
    assert plain is not None
    assert plain.work == pytest.approx(asked.work, rel=1e-9)


def test_the_steps_that_wait_for_their_energies_do_not_grow_with_the_history(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where no output is requested for many cycles."""
    waiting, evaluate = [], ElectricMeter._evaluate

    def counted(meter: ElectricMeter) -> None:
        waiting.append(meter._size)
        evaluate(meter)

    monkeypatch.setattr(electrical, "MANY", 16)
    monkeypatch.setattr(ElectricMeter, "_evaluate", counted)
    steps = [VoltageStep(Waveform(0.0, 2e3, 2.0, 5))]
    actuate(SOFT, steps, thickness=5e-4, prestretch=1.9, electrode_area=2e-5, resistance=1e9, times=[0.0, 10.0])
    assert sum(waiting) > 100
    assert max(waiting) <= 16 + 2
