"""The membrane under relaxation and creep against closed forms and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flat import creep, relax

from dielast.material.material import Material
from dielast.material.shift import WLF, NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, NeoHookean
from dielast.mechanics.load import Step

EQUILIBRIUM = 26e3  # Pa


def material(
    branches: int, span: tuple[float, float] = (4e-8, 1.6e5), glassy: float = 2.3e8, limits: tuple[float, float] = (110.0, 55.0)
) -> Material:
    """Branches evenly over the decades of `span`, moduli falling with the relaxation time like those of a rubber."""
    tau = np.geomspace(span[1], span[0], branches)
    weight = tau**-0.5 + 1e-6
    modulus = glassy * weight / weight.sum()
    return Material("test", EQUILIBRIUM, Spectrum(tau, modulus), WLF(20.0, 13.7, 187.1), Gent(limits[0]), Gent(limits[1]))


def elastic_stress(stretch: float, modulus: float, limit: float) -> float:
    """Uniaxial nominal stress of a Gent spring."""
    return modulus * (stretch - stretch**-2) / (1 - (stretch**2 + 2 / stretch - 3) / limit)


@pytest.mark.parametrize("branches", [1, 3, 30, 300])
def test_small_strain_ramp_and_hold_are_the_prony_series(branches: int) -> None:
    solid = material(branches)
    strain, ramp = 1e-6, 0.1
    rate = strain / ramp
    times = np.concatenate((np.geomspace(1e-7, ramp, 40), ramp + np.geomspace(1e-7, 1e4, 60)))
    history = relax(solid, [Step(stretch=1 + strain, duration=ramp), Step.hold(1e4 + 1)], times=times, rtol=1e-8)
    tau, mu = solid.spectrum.relaxation_time, solid.spectrum.shear_modulus
    loading = np.minimum(times, ramp)[:, None]
    decayed = np.where(times[:, None] > ramp, np.exp(-(times[:, None] - loading) / tau), 1.0)
    closed = 3 * rate * (EQUILIBRIUM * loading[:, 0] + (decayed * -np.expm1(-loading / tau) * tau) @ mu)
    # the model differs from its linearisation by a share of the order of the strain; 1e-6 Pa is rounding, 20 ulp of 230 MPa
    assert history.nominal_stress_1[0] == pytest.approx(closed, rel=5e-6, abs=1e-6)


def test_small_strain_modulus_after_a_step_at_once() -> None:
    solid = material(30)
    history = relax(solid, [Step(stretch=1 + 1e-6), Step.hold(1e6)], rtol=1e-8)
    assert history.relaxation_modulus[0] == pytest.approx(
        3 * solid.spectrum.relaxation_modulus(history.time[0], EQUILIBRIUM), rel=5e-6
    )


@pytest.mark.parametrize("stress", [-2e4, 2e5, *(pytest.param(stress, marks=pytest.mark.trust) for stress in (1e4, 5e4))])
def test_dead_load_reaches_the_equilibrium_spring(stress: float) -> None:
    history = creep(material(10), [Step(stress=stress, duration=1.0), Step.hold(1e9)], rtol=1e-8)
    end = history.stretch_1[0, -1]
    assert elastic_stress(end, EQUILIBRIUM, 110.0) == pytest.approx(stress, rel=1e-8)


def test_a_fast_ramp_meets_all_springs_and_a_slow_one_the_equilibrium_spring() -> None:
    solid = material(5, span=(1.0, 1e4), glassy=1e6)
    fast, slow = (relax(solid, [Step(stretch=2.0, duration=duration)], rtol=1e-8) for duration in (1e-9, 1e9))
    equilibrium = elastic_stress(2.0, EQUILIBRIUM, 110.0)
    assert fast.nominal_stress_1[0, -1] == pytest.approx(equilibrium + elastic_stress(2.0, 1e6, 55.0), rel=1e-8)
    assert slow.nominal_stress_1[0, -1] == pytest.approx(equilibrium, rel=1e-4)


def test_at_once_is_the_limit_of_ever_faster_ramps() -> None:
    solid = material(5, span=(1.0, 1e4), glassy=1e6)
    times = np.geomspace(1e-3, 1e4, 20)
    jump = creep(solid, [Step(stress=5e4), Step.hold(2e4)], times=times, rtol=1e-9)
    ramp = creep(solid, [Step(stress=5e4, duration=1e-9), Step.hold(2e4)], times=times, rtol=1e-9)
    assert ramp.stretch_1 == pytest.approx(jump.stretch_1, rel=3e-9)


@pytest.mark.parametrize("control", ["stress", pytest.param("stretch", marks=pytest.mark.trust)])
def test_biaxial_equations_keep_the_uniaxial_and_equibiaxial_symmetry(control: str) -> None:
    """The symmetric path and the full one are different code: a later piece that breaks the symmetry takes the full one."""
    solid = material(12)
    target = {"stress": 6e4, "stretch": 2.0}[control]
    times = np.geomspace(1e-3, 1e3, 30)
    hold = Step.hold(1e3)
    pair = {
        "stress": Step(stress=(target, 0.0), duration=1.0),
        "stretch": Step(stretch=(target, None), stress=(None, 0.0), duration=1.0),
    }
    plain = Step(**{control: target}, duration=1.0)
    # a later piece without the symmetry sends the whole history down the full path
    breaking = Step(stretch=(2.0, 1.0), duration=1.0)
    for mode in ("uniaxial", "equibiaxial"):
        first = pair[control] if mode == "uniaxial" else plain
        test = {"stress": creep, "stretch": relax}[control]
        symmetric = test(solid, [plain, hold], mode=mode, times=times, rtol=1e-8)
        full = test(solid, [first, hold, breaking], mode=mode, times=times, rtol=1e-8)
        assert full.stretch_1 == pytest.approx(symmetric.stretch_1, rel=3e-8)
        assert full.stretch_2 == pytest.approx(symmetric.stretch_2, rel=3e-8)
        assert full.nominal_stress_1 == pytest.approx(symmetric.nominal_stress_1, rel=3e-8)
        if mode == "uniaxial":
            assert full.stretch_2 == pytest.approx(full.stretch_1**-0.5, rel=3e-8)
        else:
            assert full.stretch_2 == pytest.approx(full.stretch_1, rel=1e-12)


def test_swapping_the_axes_swaps_the_results() -> None:
    solid = material(5, span=(1e-2, 1e3), glassy=1e6)
    steps = [
        Step(stretch=(2.0, None), stress=(None, 3e4), duration=1.0),
        Step.hold(100.0),
        Step(stretch=(1.2, None), stress=(None, 0.0)),
    ]
    swapped = [
        Step(stretch=(None, 2.0), stress=(3e4, None), duration=1.0),
        Step.hold(100.0),
        Step(stretch=(None, 1.2), stress=(0.0, None)),
    ]
    one, other = creep(solid, steps, rtol=1e-8), creep(solid, swapped, rtol=1e-8)
    # the order of the axes changes the rounding, and with it the steps: the two agree as two solutions to this tolerance do
    assert other.stretch_2 == pytest.approx(one.stretch_1, rel=3e-8)
    assert other.stretch_1 == pytest.approx(one.stretch_2, rel=3e-8)
    assert other.nominal_stress_2 == pytest.approx(one.nominal_stress_1, rel=3e-8)
    assert other.nominal_stress_1 == pytest.approx(one.nominal_stress_2, rel=3e-8)


@pytest.mark.parametrize(
    "mode", [pytest.param("uniaxial", marks=pytest.mark.trust), pytest.param("equibiaxial", marks=pytest.mark.trust), "pure-shear"]
)
def test_work_is_stored_or_dissipated(mode: str) -> None:
    solid = material(6, span=(1e-2, 1e3), glassy=1e6)
    times = np.unique(np.concatenate([start + np.geomspace(1e-6, 10.0, 4000) for start in (0.0, 10.0, 20.0)]))
    steps = [Step(stretch=2.0, duration=10.0), Step.hold(10.0), Step(stretch=1.2, duration=10.0)]
    history = relax(solid, steps, mode=mode, times=times, rtol=1e-9, internal=True)
    dissipation = history.dissipation()[0]
    assert np.all(dissipation >= 0)

    def work(stress: np.ndarray, stretch: np.ndarray) -> np.ndarray:
        return np.cumsum(0.5 * (stress[1:] + stress[:-1]) * np.diff(stretch))

    done = work(history.nominal_stress_1[0], history.stretch_1[0]) + work(history.nominal_stress_2[0], history.stretch_2[0])
    lost = np.cumsum(0.5 * (dissipation[1:] + dissipation[:-1]) * np.diff(times))
    stored = history.stored_energy()[0]
    balance = done - lost - (stored[1:] - stored[0])
    assert np.max(np.abs(balance)) < 1e-5 * done.max()  # what the trapezoidal rule leaves


def test_colder_is_slower_by_the_shift_factor() -> None:
    solid = material(10)
    shift = 10 ** solid.shift.log10_shift_factor(0.0)
    times = np.geomspace(1e-2, 1e2, 20)
    warm = creep(solid, [Step(stress=3e4), Step.hold(1e3)], times=times, rtol=1e-9)
    cold = creep(solid, [Step(stress=3e4), Step.hold(1e3 * shift)], times=times * shift, temperature=0.0, rtol=1e-9)
    assert cold.stretch_1 == pytest.approx(warm.stretch_1, rel=3e-9)


def test_branches_without_modulus_change_nothing() -> None:
    plain = Material("test", EQUILIBRIUM, Spectrum([10.0, 0.1], [1e5, 1e6]), NoShift(20.0), Gent(110.0), Gent(55.0))
    padded = Material("test", EQUILIBRIUM, Spectrum([1e9, 10.0, 0.1], [0.0, 1e5, 1e6]), NoShift(20.0), Gent(110.0), Gent(55.0))
    steps = [Step(stress=1e5, duration=1e-3), Step.hold(1e4)]
    assert np.array_equal(creep(plain, steps).stretch_1, creep(padded, steps).stretch_1)


def test_materials_with_fewer_branches_run_beside_others() -> None:
    few, many = material(3), material(30)
    steps = [Step(stress=5e4, duration=1.0), Step.hold(1e4)]
    times = np.geomspace(1e-3, 1e4, 50)
    both = creep([few, many], steps, times=times, rtol=1e-8)
    for index, solid in enumerate((few, many)):
        assert both.stretch_1[index] == pytest.approx(creep(solid, steps, times=times, rtol=1e-8).stretch_1[0], rel=1e-12)


@pytest.mark.trust
@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "pure-shear"])
def test_a_case_does_not_depend_on_its_company_or_on_the_output_grid(mode: str) -> None:
    solid = material(30)
    temperatures = np.linspace(-20, 60, 13)
    steps = [Step(stress=5e4, duration=1.0), Step.hold(1e4)]
    times = np.geomspace(1e-3, 1e4, 50)
    together = creep(solid, steps, mode=mode, times=times, temperature=temperatures)
    alone = creep(solid, steps, mode=mode, times=times, temperature=temperatures[5])
    assert np.array_equal(together.stretch_1[5], alone.stretch_1[0])
    assert np.array_equal(
        creep(solid, steps, mode=mode, times=times[::7], temperature=temperatures[5]).stretch_1[0], alone.stretch_1[0, ::7]
    )


@pytest.mark.parametrize(
    "mode", ["uniaxial", pytest.param("equibiaxial", marks=pytest.mark.trust), pytest.param("pure-shear", marks=pytest.mark.trust)]
)
def test_stretches_within_one_percent_of_the_gent_limit(mode: str) -> None:
    def excess(stretch: float) -> float:
        second = {"uniaxial": stretch**-0.5, "equibiaxial": stretch, "pure-shear": 1.0}[mode]
        return stretch**2 + second**2 + (stretch * second) ** -2 - 3

    low, high = 1.0, 20.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 110 else (low, middle)
    stretch = 0.999 * low
    history = relax(material(10), [Step(stretch=stretch, rate=1.0), Step.hold(1e6)], mode=mode)
    assert history.completed
    assert np.all(np.isfinite(history.nominal_stress_1))
    back = creep(material(10), [Step(stress=history.nominal_stress_1[0, -1], duration=10.0), Step.hold(1e9)], mode=mode)
    assert back.stretch_1[0, -1] == pytest.approx(stretch, rel=1e-3)


@pytest.mark.parametrize("duration", [1e-9, 1e-3, 1e3, 1e9])
def test_steps_of_any_duration(duration: float) -> None:
    steps = [Step(stretch=2.0, duration=duration), Step.hold(duration), Step(stress=2e4, duration=duration), Step.hold(1e9)]
    history = creep(material(17, span=(1e-8, 1e8)), steps)
    assert history.completed
    assert elastic_stress(history.stretch_1[0, -1], EQUILIBRIUM, 110.0) == pytest.approx(2e4, rel=1e-3)


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "pure-shear"])
def test_another_law_takes_the_place_of_gents(mode: str) -> None:
    solid = material(7)
    other = replace(solid, equilibrium_law=NeoHookean(), nonequilibrium_law=NeoHookean())
    distant = replace(solid, equilibrium_law=Gent(), nonequilibrium_law=Gent())
    steps = [Step(stretch=2.0, duration=1.0), Step.hold(100.0)]
    one, two = (relax(each, steps, mode=mode) for each in (other, distant))
    assert one.nominal_stress_1 == pytest.approx(two.nominal_stress_1, rel=1e-9)


def test_a_film_without_an_equilibrium_spring_thins_to_nothing_in_finite_time() -> None:
    """Under a dead load the true stress of a liquid grows as it thins: the solution ends, and that is said, not filled in."""
    fluid = Material("fluid", 0.0, Spectrum([1.0], [1e5]), NoShift(20.0), Gent(110.0), Gent(55.0))
    history = creep(fluid, [Step(stress=3e4), Step.hold(30.0)])
    assert history.outcome[0].reason == "the rates grow beyond all bounds"
    assert 1 < history.outcome[0].time < 30
    late = history.time[0] > history.outcome[0].time
    assert np.isnan(history.stretch_1[0, late]).all()
    assert history.stretch_1[0, ~late][-1] > 30


def test_voltage_free_rest_stays_at_rest() -> None:
    history = creep(material(5), [Step.hold(1e6)])
    assert np.all(history.stretch_1 == 1)
    assert np.all(history.nominal_stress_1 == 0)
