"""Cycles, tables and holds of any length: what they cost in steps and rows, and what they come to."""

from __future__ import annotations

import numpy as np
import pytest
from films import SOFT
from flat import actuate, creep, relax

from dielast import Material, NoShift, Spectrum, Step, VoltageStep
from dielast.base.errors import InputError
from dielast.material.springs import Gent
from dielast.mechanics.line import EVEN_ROWS, Line
from dielast.mechanics.load import Track, Waveform
from dielast.mechanics.piece import Chain, Cycles
from dielast.mechanics.span import Control
from reconstruction import spectrum

LINEAR = Material("linear", 20e3, Spectrum([0.3, 0.02], [3e4, 8e4]), NoShift(20.0), permittivity=4e-11)
FREE = (Control.STRESS, Control.STRESS)


def complex_modulus(pace: float) -> complex:
    """Shear modulus of LINEAR at small strain."""
    spectrum = LINEAR.spectrum
    wt = 1j * pace * spectrum.relaxation_time
    return complex(LINEAR.equilibrium_modulus + np.sum(spectrum.shear_modulus * wt / (1 + wt)))


@pytest.mark.parametrize("period", [pytest.param(0.1, marks=pytest.mark.trust), pytest.param(1.0, marks=pytest.mark.trust), 40.0])
def test_a_small_sine_has_the_complex_modulus(period: float) -> None:
    strain, cycles = 1e-5, 40 if period < 1 else 8 if period < 10 else 4
    wave = [Step(stretch=Waveform(1.0, 1 + 2 * strain, period, cycles))]
    history = relax(LINEAR, wave, rtol=1e-9, cycles="last", slack="pushes")
    table, wanted = history.cycles, 3 * complex_modulus(2 * np.pi / period)
    assert table is not None
    assert table.amplitude[0, -1] == pytest.approx(abs(wanted) * strain, rel=2e-4)
    assert table.phase[0, -1] == pytest.approx(np.angle(wanted), abs=2e-4)
    assert table.work[0, -1] == pytest.approx(np.pi * wanted.imag * strain**2, rel=2e-3)
    lowest, highest, mean = table.lowest[0, -1], table.highest[0, -1], table.mean[0, -1]
    assert (highest - lowest) / 2 == pytest.approx(abs(wanted) * strain, rel=1e-3)
    assert lowest < mean < highest
    # in creep the stretch lags as much as the stress leads here
    stress = 10.0
    creeping = creep(LINEAR, [Step(stress=Waveform(-stress, stress, period, cycles))], rtol=1e-9, cycles="last").cycles
    assert creeping is not None
    assert creeping.phase[0, -1] == pytest.approx(-np.angle(wanted), abs=2e-3)
    assert creeping.amplitude[0, -1] == pytest.approx(stress / abs(wanted), rel=2e-3)


def test_the_stress_on_a_sine_of_the_stretch_is_within_rtol_at_every_time_in_few_steps() -> None:
    stiff = Material("stiff", 26e3, spectrum(30), NoShift(20.0), Gent(110.0), Gent(55.0))
    cycle, times = [Step(stretch=Waveform(1.0, 2.0, 10.0))], np.linspace(0.0, 10.0, 201)[1:]
    loose, tight = (relax(stiff, cycle, rtol=rtol, times=times) for rtol in (1e-4, 1e-5))
    error = np.abs(loose.nominal_stress_1 - tight.nominal_stress_1)
    assert np.max(error) < 5e-5 * np.max(np.abs(tight.nominal_stress_1))
    assert loose.steps[0] < 85


@pytest.mark.parametrize("shape", ["sine", pytest.param("triangle", marks=pytest.mark.trust)])
def test_the_work_of_a_cycle_is_the_area_of_its_loops(shape: str) -> None:
    wave = Waveform(500.0, 2500.0, 2.0, 4, shape)
    film = {"thickness": 5e-4, "prestretch": 1.5, "relax": 60.0, "stop_at": "end", "rtol": 1e-8}
    history = actuate(LINEAR, [VoltageStep(wave)], times=np.linspace(0.0, 8.0, 8001), **film)
    table = history.cycles
    assert table is not None
    time, field = history.time[0], history.voltage[0] / 5e-4
    charge = 4e-11 * np.square(history.stretch_1[0] * history.stretch_2[0]) * field
    for cycle in range(4):
        rows = (time >= 2.0 * cycle - 1e-9) & (time <= 2.0 * (cycle + 1) + 1e-9)
        electric = np.trapezoid(field[rows], charge[rows])
        mechanical = sum(
            np.trapezoid(stress[0][rows], stretch[0][rows])
            for stress, stretch in ((history.nominal_stress_1, history.stretch_1), (history.nominal_stress_2, history.stretch_2))
        )
        assert table.work[0, cycle] == pytest.approx(electric + mechanical, rel=1e-5)
        assert table.highest[0, cycle] == pytest.approx(history.relative_stretch_1[0][rows].max(), rel=1e-5)
        assert table.lowest[0, cycle] == pytest.approx(history.relative_stretch_1[0][rows].min(), rel=1e-5)


@pytest.mark.parametrize(
    ("shape", "low"), [pytest.param("triangle", 0.0, marks=pytest.mark.trust), ("triangle", -1500.0), ("sine", -1500.0)]
)
def test_a_waveform_is_what_many_ramps_come_to(shape: str, low: float) -> None:
    points = 200 if shape == "sine" else 2
    cycles = 3 if shape == "triangle" else 1
    phase = np.arange(points * cycles + 1) / points
    height = 0.5 * (1 - np.cos(2 * np.pi * phase)) if shape == "sine" else 1 - np.abs(2 * (phase % 1) - 1)
    track = Track(2.0 * phase, low + (2000.0 - low) * height)
    asked = np.linspace(0.05, 2.0 * cycles, 57)
    film = {"thickness": 5e-4, "prestretch": (1.6, 1.4), "relax": 60.0, "stop_at": "end", "times": asked}
    whole = actuate(SOFT, [VoltageStep(Waveform(low, 2000.0, 2.0, cycles, shape))], **film)
    ramps = actuate(SOFT, [VoltageStep(track)], **film)
    # straight lines between points of a sine are off by half the square of its angle between two
    off = (np.pi / points) ** 2 / 2 if shape == "sine" else 0.0
    assert whole.stretch_1[0] == pytest.approx(ramps.stretch_1[0], rel=2e-6 + off)
    assert whole.voltage[0] == pytest.approx(ramps.voltage[0], abs=3e-3 + off * (2000.0 - low) / 2)
    assert whole.stability[0] == pytest.approx(ramps.stability[0], rel=2e-3)


def test_ten_times_the_cycles_take_ten_times_the_steps() -> None:
    def steps(cycles: int) -> int:
        history = creep(SOFT, [Step(stress=Waveform(0.0, 2e4, 1.0, cycles))], rtol=1e-4, cycles="last")
        assert history.time.shape[1] < 3 * EVEN_ROWS
        assert history.cycles is not None
        assert np.isfinite(history.cycles.work).all()
        return int(history.steps[0])

    few, many = steps(5), steps(50)
    assert many < 11 * few


def test_which_cycles_are_kept() -> None:
    def kept(cycles: object, many: int) -> list[int]:
        wave = Waveform(0.0, 1e3, 1.0, many)
        history = creep(LINEAR, [Step(stress=wave)], rtol=1e-3, cycles=cycles)
        assert history.cycles is not None
        assert history.cycles.work.shape == (1, many)
        time = history.time[0]
        assert np.all(np.diff(time) > 0)
        inside = np.unique(np.floor(time[np.abs(time - np.round(time)) > 1e-6]).astype(int)) + 1
        return inside.tolist()

    assert kept("last", 4) == [4]
    assert kept([1, 3], 4) == [1, 3]
    assert kept(None, 101) == [1, 2, 5, 10, 20, 50, 100, 101]
    assert kept(None, 12) == list(range(1, 13))
    assert kept("all", 13) == list(range(1, 14))


def test_a_long_hold_after_a_fast_load_reaches_equilibrium() -> None:
    vhb = Material(
        "cold to hot", 26e3, Spectrum(np.geomspace(1e5, 1e-7, 25), np.geomspace(1e3, 1e8, 25)), NoShift(20.0), Gent(110.0)
    )
    wanted = 26e3 * (2 - 0.25) / (1 - (4 + 1 - 3) / 110)
    for steps in ([Step(stretch=2.0), Step.hold(1e7)], [Step(stretch=2.0, duration=1e-15), Step.hold(1e12)]):
        history = relax(vhb, steps, rtol=1e-9, points_per_decade=3)
        assert history.completed
        assert history.nominal_stress_1[0, -1] == pytest.approx(wanted, rel=1e-6)


def test_a_hold_keeps_what_a_ramp_has_reached_but_for_rounding() -> None:
    held = []
    for duration in (7.0, 8.0):  # 100 V / 0.4 mm / 7 s * 7 s is a little more than 100 V / 0.4 mm
        steps = [VoltageStep(100.0, duration=duration), VoltageStep.hold(20.0)]
        history = actuate(LINEAR, steps, thickness=4e-4, stop_at="end", rtol=1e-4)
        held.append(history.voltage[0, history.time[0] > duration])
    assert held[0].size == held[1].size
    assert np.ptp(held[0]) == 0


@pytest.mark.parametrize(("low", "high"), [(-2.0, 3.0), (1.0, 3.0), (-3.0, -1.0), (0.0, 2.0), (3.0, -1.0), (2.0, 2.0)])
@pytest.mark.parametrize("triangle", [True, False])
def test_spans_of_a_cycle_join_and_end_where_the_size_is_least(low: float, high: float, triangle: bool) -> None:
    one = np.ones(1)
    wave = Waveform(low, high, 4.0, 2, "triangle" if triangle else "sine")
    piece = Cycles.of(FREE, *(np.array([[0.0], [0.0], [end]]) for end in (low, high)), wave)
    time, last = 0.0, low
    case = np.zeros(1, dtype=np.intp)
    for index in range(piece.spans):
        load, lasts = piece.span(case, case + index)
        phase = time / 4.0
        wanted = 0.5 * (1 - np.cos(2 * np.pi * phase)) if not triangle else 1 - abs(2 * (phase % 1) - 1)
        assert load.value(0 * one)[2, 0] == pytest.approx(low + (high - low) * wanted, abs=1e-12)
        assert load.value(0 * one)[2, 0] == pytest.approx(last, abs=1e-12)
        steps = np.linspace(0.0, 1.0, 41)
        size = np.abs([load.value(share * lasts)[2, 0] for share in steps])
        if lasts[0] > 1e-9:  # the size falls no more once it has risen
            assert not np.any((np.diff(size)[:-1] < -1e-9) & (np.diff(size)[1:] > 1e-9))
            middle, width = 0.5 * lasts, 1e-6 * lasts
            slope = (load.value(middle + width) - load.value(middle - width))[2, 0] / (2 * width[0])
            assert load.slope(middle)[2, 0] == pytest.approx(slope, rel=1e-6, abs=1e-6)
        time, last = time + lasts[0], load.value(lasts)[2, 0]
    assert time == pytest.approx(8.0)
    assert piece.end[2, 0] == low


def test_rows_are_close_in_what_is_driven() -> None:
    one, scale = np.ones(1), np.array([[1.0], [0.0], [0.0]])
    ramp = Line(FREE, np.zeros((3, 1)), np.array([[1.0], [0.0], [0.0]]), 5 * one)
    wave = Cycles.of(FREE, np.zeros((3, 1)), scale, Waveform(0.0, 1.0, 1.0, 3))
    chain = Chain.of(
        FREE, np.zeros((3, 1)), scale, np.array([0.0, 1.0, 1.5, 9.0]), np.array([0.0, 1.0, 0.2, 0.2])[:, None] * np.ones(3)
    )
    for piece, swing in ((ramp, 1), (wave, 6), (chain, 1.8)):
        rows = piece.rows(30, np.arange(piece.cycles), one)[0]
        assert np.all(np.diff(rows) > 0)
        assert rows[-1] == piece.duration[0]
        assert rows.size > 50 * swing
        assert rows[0] < 2e-3 * piece.duration[0] / max(piece.cycles, 1)


@pytest.mark.parametrize(
    ("mode", "begins"),
    [
        pytest.param("uniaxial", 0.0, marks=pytest.mark.trust),
        ("uniaxial", 100.0),
        ("equibiaxial", 0.0),
        pytest.param("pure-shear", 100.0, marks=pytest.mark.trust),
    ],
)
def test_a_path_is_loaded_in_its_mode(mode: str, begins: float) -> None:
    """Whatever it begins with: a load of 0 or a stretch of 1 says nothing about what comes."""
    stress, stretch = [begins, 3e4, begins], [1 + begins / 1e3, 1.5, 1 + begins / 1e3]
    for run, name, values in ((creep, "stress", stress), (relax, "stretch", stretch)):
        ramps = [Step(**{name: value}, duration=1.5 * (row > 0)) for row, value in enumerate(values)]
        asked = {"mode": mode, "times": [0.7, 1.5, 2.9], "rtol": 1e-8}
        wanted = run(LINEAR, ramps, **asked)
        for path in (Waveform(values[0], values[1], 3.0, 1, "triangle"), Track([0.0, 1.5, 3.0], values)):
            found = run(LINEAR, [Step(**{name: path})], **asked)
            for column in ("stretch_1", "stretch_2", "nominal_stress_1", "nominal_stress_2"):
                assert getattr(found, column)[0] == pytest.approx(getattr(wanted, column)[0], rel=1e-6, abs=1e-3), (column, path)


@pytest.mark.parametrize(
    ("shape", "relax_time"),
    [
        *(("sine", 1.0), ("triangle", 0.0)),
        *(pytest.param(*each, marks=pytest.mark.trust) for each in (("sine", 0.0), ("triangle", 1.0))),
    ],
)
def test_a_film_that_hardly_flows_follows_every_wave(shape: str, relax_time: float) -> None:
    """Its stretch depends on the present voltage alone, however small the wave and however slow the branch: one long step must
    not pass over a wave. The reference applies each voltage at once.
    """
    slow = [Material("slow", 20e3, Spectrum([tau], [2e4]), NoShift(20.0), permittivity=4e-11) for tau in (1e6, 1e9, 1e14)]
    times, film = np.linspace(0.0, 3.0, 43), {"thickness": 5e-4, "prestretch": 1.5, "stop_at": "end"}
    for low, high in ((0.0, 100.0), (0.0, 500.0), (-500.0, 500.0)):
        phase = times % 1
        height = 0.5 * (1 - np.cos(2 * np.pi * phase)) if shape == "sine" else 1 - np.abs(2 * phase - 1)
        held = [VoltageStep(low + (high - low) * height), VoltageStep(duration=1e-9)]
        wanted = actuate(slow[-1], held, times=[1e-9], **film).relative_stretch_1[:, 0]
        wave = [VoltageStep(Waveform(low, high, 1.0, 3, shape))]
        cycling = actuate(slow, wave, times=times, relax=relax_time, **film).relative_stretch_1
        # the branch flows by a millionth of its stretch within a second
        assert np.abs(cycling - wanted).max() < 1e-3 * (wanted.max() - wanted.min()) + 1e-6, (low, high)


@pytest.mark.parametrize("volts", [20.0, 500.0])
def test_amplitude_and_phase_of_a_small_swing_do_not_depend_on_its_mean(volts: float) -> None:
    """The linear film answers the square of the voltage: all cycles scale with it, from the first on."""
    film = {"thickness": 5e-4, "stop_at": "end", "rtol": 1e-6}
    table, small = (
        actuate(LINEAR, [VoltageStep(Waveform(0.0, high, 3.0, 3, "triangle"))], **film).cycles for high in (volts, 1000.0)
    )
    assert table is not None
    assert small is not None
    assert table.amplitude[0] == pytest.approx(small.amplitude[0] * (volts / 1000.0) ** 2, rel=1e-2)
    assert table.phase[0] == pytest.approx(small.phase[0], abs=1e-2)


def test_cycles_that_there_are_not_are_refused() -> None:
    with pytest.raises(InputError, match="cycles: 7: the waveform has only 4 cycles"):
        creep(LINEAR, [Step(stress=Waveform(0.0, 1e3, 1.0, 4))], cycles=[1, 7])
