"""What the numerical core refuses, and how it says so: one line that names the place and what is expected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from films import followed
from flat import actuate, creep, plan_failure_map, relax
from scipy.optimize import brentq

from dielast.base.errors import InputError, NumericsError
from dielast.handover.export.card import export_card
from dielast.material.intervals import interval
from dielast.material.material import Breakdown, Material
from dielast.material.scatter import draw_sample
from dielast.material.shift import WLF, NoShift, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.history import pieces
from dielast.mechanics.load import Step, Track, VoltageStep, Waveform
from dielast.mechanics.point_material import PointMaterial
from dielast.numerics import integrate
from dielast.simulate.film_setup import out_of_reach

SOLID = Material(
    "soft", 26e3, Spectrum(np.array([100.0, 1.0]), np.array([2e4, 9e4])), NoShift(20.0), Gent(110.0), Gent(55.0), 4e-11
)
MEASURED = replace(SOLID, shift=ShiftTable(20.0, (0.0, 20.0, 40.0), (1.0, 0.0, -1.0)))
HOLD = [Step(stress=1e4), Step.hold(1.0)]
FILM: dict[str, Any] = {"thickness": 5e-4, "prestretch": 1.5, "breakdown_field": 4e7}


def driven(steps: list[VoltageStep], **change: Any) -> Callable[[], object]:
    return lambda: actuate(change.pop("material", SOLID), steps, **(FILM | change))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda: creep(MEASURED, HOLD, temperature=41.0), r"temperature: 41 degC is outside the shift table's 0 to 40 degC"),
        (lambda: creep(MEASURED, HOLD, temperature=[20.0, 41.0]), r"case 1: temperature: 41 degC is outside"),
        (lambda: creep([SOLID, MEASURED], HOLD, temperature=[99.0, -1.0]), r"case 1: temperature: -1 degC is outside"),
        (lambda: ShiftTable(20.0, (0.0, 20.0), (1.0,)), r"2 temperatures but 1 shift factors: one for each is needed"),
        (lambda: ShiftTable(20.0, (), ()), r"a shift table needs at least one entry"),
        (lambda: ShiftTable(20.0, (0.0, 40.0, 20.0), (1.0, 0.0, -1.0)), r"must ascend"),
        (lambda: ShiftTable(20.0, (0.0, 20.0, 20.0), (1.0, 0.0, -1.0)), r"must ascend"),
        (lambda: Breakdown((1.0, 2.0), (4e7,)), r"2 prestretches but 1 fields: one for each is needed"),
        (lambda: Breakdown((), (4e7, 5e7)), r"2 fields, but no prestretch: state the prestretch of each, or one field for all"),
        (driven([VoltageStep(1e3)], temperature=[20.0, -300.0]), r"temperature: .*-300 degC is at or below absolute zero"),
        (lambda: Breakdown((), ()), r"a breakdown table needs at least one entry"),
        (lambda: Breakdown((1.0, 3.0, 2.0), (4e7, 5e7, 6e7)), r"prestretches of a breakdown table must ascend"),
        (lambda: Breakdown((1.0, 1.0), (4e7, 5e7)), r"prestretches of a breakdown table must ascend"),
        (lambda: Breakdown((1.0, 2.0), (4e7, 0.0)), r"a breakdown field must be positive"),
        (
            driven([VoltageStep(1e3)], prestretch=(1.5, 1.5, 1.5)),
            r"prestretch: 3 values: a number, or a pair, .* is needed",
        ),
        (driven([VoltageStep(1e3)], material=[]), r"a material is needed"),
        (driven([VoltageStep(1e3)], temperature=np.nan), r"temperature: every value must be finite"),
        (driven([VoltageStep(1e3)], points_per_decade=0), r"points_per_decade: 0: a whole number of at least one is needed"),
        (driven([VoltageStep(1e3)], prestretch=[1.5, 0.5]), r"case 1: prestretch: 0.5: it must not be below 1"),
        (driven([VoltageStep(1e3)], prestretch=(1.5, 8.0)), r"prestretch: 1.5 x 8 is beyond the Gent limit, J_lim = 55"),
        (driven([VoltageStep(duration=1.0, rate=1.0)]), r"step 0: a voltage, or the duration of a hold is needed"),
        (driven([VoltageStep(1e3, rate=0.0)]), r"step 0: rate 0 never reaches the voltage"),
        (driven([VoltageStep(np.inf)]), r"step 0: voltage: every value must be finite"),
        (
            driven([VoltageStep(1e3, rate=[1.0, -1.0])]),
            r"step 0: case 1: rate -1 V/s leads away from the voltage: \+1000 V are to go, so the rate must be positive",
        ),
        (driven([VoltageStep(1e3), VoltageStep(500.0, rate=1.0)]), r"step 1: .* -500 V are to go, so the rate must be negative"),
        # one case that is wrong among others is enough
        (driven([VoltageStep(1e3, rate=[1.0, 0.0])]), r"step 0: rate 0 never reaches the voltage"),
        (driven([VoltageStep(1e3, duration=[1.0, -1.0])]), r"step 0: duration: -1 s: it must not be negative"),
        (driven([VoltageStep(1e3)], thickness=[5e-4, 0.0]), r"thickness: 0 m: it must be positive"),
        (driven([VoltageStep(1e3)], breakdown_field=[4e7, 0.0]), r"breakdown_field: 0 V/m: it must be positive"),
        (
            driven([VoltageStep(1e3)], prestretch=190.0),
            r"prestretch: 190 is beyond the Gent limit, J_lim = 55; is it in per cent\? a strain of 190 % is a stretch of 2.9, "
            r"and a stretch of 190 % is 1.9$",
        ),
        (driven([VoltageStep(1e3)], prestretch_rate=[0.1, 0.0]), r"prestretch_rate: 0 /s: it must be positive"),
        (driven([VoltageStep(1e3)], temperature=[20.0, np.inf]), r"temperature: every value must be finite"),
        (driven([VoltageStep(1e3)], rtol=0.10001), r"rtol: 0.10001 is not between 1e-12 and 0.1"),
        (lambda: creep(SOLID, HOLD, rtol=0.9999e-12), r"rtol: 9.999e-13 is not between 1e-12 and 0.1"),
        (lambda: relax(SOLID, [Step(stretch=2.0, rate=[1.0, 0.0])]), r"step 0: rate 0 never reaches the target"),
        (lambda: relax(SOLID, [Step(stretch=2.0, duration=[1.0, -1.0])]), r"step 0: duration: -1 s: it must not be negative"),
        (lambda: relax(SOLID, [Step(stretch=[2.0, 0.0])]), r"step 0: stretch 0: it must be positive"),
        (lambda: Track([0.0, 1.0, 1.0], [1.0, 2.0, 1.5]), r"the history goes back in time: 1 s follows 1 s"),
        (lambda: Track([0.0, np.inf], [1.0, 2.0]), r"must be finite and not negative"),
        (lambda: Track([], []), r"one value for each time, got 0 for 0"),
        (lambda: Track([[0.0, 1.0]], [[0.0, 1.0]]), r"one value for each time"),
        (lambda: relax(SOLID, [Step(stretch=[2.0, np.nan])]), r"step 0: stretch: every value must be finite"),
        (lambda: relax(SOLID, [Step(stretch=50.0)]), r"stretch 50 is beyond .*; is it in per cent\? a strain of 50 % .* of 1.5$"),
        (lambda: relax(SOLID, [Step(stretch=[2.0, 11.0], rate=1.0)]), r"step 0: case 1: stretch 11 is beyond the Gent limit"),
        (lambda: relax(SOLID, [Step(stretch=2.0)], temperature=[20.0, np.nan]), r"temperature: every value must be finite"),
        (lambda: creep(SOLID, HOLD, times=[0.0, np.nan]), r"output times must be finite and not negative"),
        (lambda: creep(SOLID, HOLD, times=[0.0, -1.0]), r"output times must be finite and not negative"),
        (lambda: Track([0.0, 1.0], [0.0]), r"one value for each time, got 1 for 2"),
        (lambda: Track([-1.0, 1.0], [0.0, 1.0]), r"must be finite and not negative"),
        (lambda: Track([0.0, 1.0], [0.0, np.nan]), r"the values of a history must be finite"),
        (lambda: Waveform(0.0, 1e3, 0.0), r"period: 0 s: it must be positive"),
        (lambda: Waveform(0.0, 1e3, [1.0, -2.0]), r"period: -2 s: it must be positive"),
        (lambda: Waveform(0.0, np.inf, 1.0), r"high: it must be finite"),
        (lambda: Waveform(0.0, 1e3, 1.0, 0), r"cycles: 0: a whole number of at least one is needed"),
        (lambda: Waveform(0.0, 1e3, 1.0, 1, "square"), r'waveform: "square": it must be one of sine, triangle'),
        (lambda: relax(SOLID, [Step(stretch=Waveform(0.0, 1.5, 1.0))]), r"step 0: stretch 0: it must be positive"),
        (lambda: relax(SOLID, [Step(stretch=Waveform(1.0, 11.0, 1.0))]), r"step 0: stretch 11 is beyond the Gent limit"),
        (lambda: relax(SOLID, [Step(stretch=Track([0.0, 1.0], [1.0, 2.0]), rate=1.0)]), r"step 0: .* states its times itself"),
        (lambda: creep(SOLID, HOLD, cycles="first"), r'cycles: "first": "all", "last" or a list of their numbers'),
        (lambda: creep(SOLID, HOLD, cycles=[0]), r"cycles: \[0\]: "),
        (driven([VoltageStep(Waveform(0.0, 1e3, 1.0), duration=1.0)]), r"step 0: a waveform or a track states its times itself"),
        (lambda: creep(SOLID, HOLD, times=[[0.0], [0.5], [1.0]]), r"times: one list for all cases, or one for each of 1 cases"),
        (lambda: relax(SOLID, [Step(stretch=2.0)]).stored_energy(), r"energies need the viscous stretches"),
        (lambda: creep(SOLID, [Step.hold(1.0), Step(stretch=2.0)]), r"step 1: stretch: creep is about a stress .*, or use relax"),
        (lambda: relax(SOLID, steps=[Step(stress=(1e4, 0.0))]), r"step 0: stress: relax is about a stretch .*, or use creep"),
        (lambda: Gent(-1.0), r"J_lim: -1: the value of I1 - 3 at which the spring locks is needed, which is above 0"),
        (lambda: Gent(np.array([[5.0], [np.nan]])), r"J_lim: nan: "),
        (lambda: WLF(20.0, 13.7, -100.0), r"C2: -100: a number of K above 0 is needed"),
        (lambda: WLF(20.0, np.nan, 100.0), r"C1: nan: a finite number is needed"),
        (lambda: interval(np.arange(20.0), 2), r"level: 2: a probability above 0 and below 1 is needed, such as 0.9"),
        (lambda: export_card(SOLID, "abacus"), r'formats: "abacus": did you mean "abaqus"\?'),
        (lambda: plan_failure_map(SOLID, voltage=[np.nan], horizon=1.0, **FILM), r"voltage: every value must be finite"),
        (
            lambda: plan_failure_map(
                SOLID, voltage=[1e3], horizon=1.0, sample=draw_sample([replace(SOLID, permittivity=None)], 1), **FILM
            ),
            r"sample: in a draw: material: 'soft' has no permittivity",
        ),
    ],
)
def test_what_is_refused(action: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        action()
    assert "\n" not in str(caught.value)


def test_a_prestretch_that_locks_the_branches_is_given_up_with_its_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(integrate, "MOST_STEPS", 2_000)
    # far beyond the branch's limit, and faster than it can flow below the largest stress that a number holds
    solid = replace(SOLID, spectrum=Spectrum([1e20], [1e5]))
    with pytest.raises(NumericsError, match=r"case 1: prestretch: 6 cannot be computed: "):
        driven([VoltageStep(1e3)], material=solid, prestretch=[1.5, 6.0], prestretch_rate=1e6)()


def test_a_load_without_equilibrium_ends_its_case_where_it_is_applied() -> None:
    # nothing finite balances what no number can hold
    points = PointMaterial.of(SOLID, np.array([20.0, 20.0]), 1e-6)
    steps = [Step.hold(2.0), Step(stress=[1e4, 1e308]), Step.hold(3.0)]
    record = followed(points, pieces(steps, "equibiaxial", 2), points_per_decade=3)
    assert record.outcome[0].completed
    assert record.outcome[0].time == 5.0
    assert not record.outcome[1].completed
    assert record.outcome[1].time == 2.0
    assert record.outcome[1].reason.startswith("no stable equilibrium")
    before = ~(record.time[1] > 2.0) & (np.arange(record.time.shape[1]) < np.argmax(record.time[1] > 2.0) - 1)
    assert np.isfinite(record.nominal_stress[:, 1, before]).all()
    assert np.isnan(record.nominal_stress[:, 1, ~before]).all()


def test_what_is_just_allowed() -> None:
    for arguments in ({"rtol": 0.1}, {"rtol": 1e-12}, {"points_per_decade": 1}, {"times": [0.0, 0.0, 1.0]}):
        assert creep(SOLID, HOLD, **({"points_per_decade": 2} | arguments)).completed
    assert Breakdown((1.0,), (4e7,)).field == (4e7,)
    assert ShiftTable(20.0, (20.0,), (0.5,)).log10_shift_factor(20.0) == 0.0
    for edge in (0.0, 40.0):
        assert creep(MEASURED, HOLD, temperature=edge, points_per_decade=2).completed
    assert driven([VoltageStep(1e3, duration=0.0)], prestretch=1.0, relax=0.0, points_per_decade=1)() is not None


def test_each_case_has_its_own_material_whatever_the_others_are() -> None:
    shortest = replace(SOLID, spectrum=SOLID.spectrum.slowest(1), equilibrium_modulus=4e4)
    longest = replace(MEASURED, spectrum=Spectrum([1e3, 50.0, 2.0], [1e4, 2e4, 5e4]), permittivity=None)
    # the shift table knows nothing of 99 degC, and need not
    materials, temperature = [longest, shortest, longest, SOLID], [10.0, 99.0, 30.0, 99.0]
    together = creep(materials, HOLD, temperature=temperature, points_per_decade=3)
    for case, (material, at) in enumerate(zip(materials, temperature, strict=True)):
        alone = creep(material, HOLD, temperature=at, points_per_decade=3)
        np.testing.assert_allclose(together.stretch_1[case], alone.stretch_1[0], rtol=1e-6)


def test_the_reach_of_a_stretch_is_the_limit_of_its_springs() -> None:
    """I1 = lambda^2 + 2/lambda with the other axis free, lambda_1^2 + lambda_2^2 + 1/(lambda_1 lambda_2)^2 with both held."""
    points = PointMaterial.of(SOLID, np.full(4, 20.0), 1e-6)
    at_once, hair = np.array([False, False, True, True]), 1e-9
    uniaxial = [brentq(lambda x, j=j: x**2 + 2 / x - 3 - j, 2.0, 20.0, xtol=1e-14) for j in (110.0, 55.0)]
    beyond, spring = out_of_reach(
        points, [np.array([uniaxial[0] - hair, uniaxial[0] + hair, uniaxial[1] - hair, uniaxial[1] + hair])], at_once
    )
    assert beyond.tolist() == [False, True, False, True]
    assert spring.tolist() == [0, 0, 1, 1]
    second = np.full(4, 1.7)
    biaxial = [brentq(lambda x, j=j: x**2 + 1.7**2 + 1 / (1.7 * x) ** 2 - 3 - j, 2.0, 20.0, xtol=1e-14) for j in (110.0, 55.0)]
    first = np.array([biaxial[0] - hair, biaxial[0] + hair, biaxial[1] - hair, biaxial[1] + hair])
    assert out_of_reach(points, [first, second], at_once)[0].tolist() == [False, True, False, True]
    assert out_of_reach(points, [], at_once)[0].tolist() == [False] * 4
