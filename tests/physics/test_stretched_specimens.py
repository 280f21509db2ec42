"""Specimens whose stretch is prescribed: branches on their own give what the coupled equations give, and voltages closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flat import relax

from dielast import Gent, Material, MeasuredTest, MooneyRivlin, NeoHookean, NoShift, Spectrum, Yeoh
from dielast.base.errors import InputError
from dielast.calibration.laboratory import Laboratory
from dielast.material.modulus import EntropicModulus
from dielast.material.shift import Arrhenius
from dielast.mechanics.load import Step, Track
from dielast.mechanics.stretched import Histories

FILM = Material(
    "film", 2e4, Spectrum([300.0, 5.0, 0.1], [1e4, 3e4, 8e4]), NoShift(20.0), Gent(60.0), Gent(40.0), permittivity=4e-11
)
LAWS = {
    "gent": FILM,
    "of several": replace(FILM, equilibrium_law=Yeoh(1e4, -50.0, 1.0), nonequilibrium_law=MooneyRivlin(0.3, 0.2)),
    "warm": replace(FILM, shift=Arrhenius(20.0, 1e5), equilibrium_scaling=EntropicModulus()),
}
MODES = ("uniaxial", "equibiaxial", "pure-shear")
TIME = np.array([0.5, 2.0, 9.0, 10.0, 12.0, 14.0, 20.0, 200.0])
STRETCH = np.interp(TIME, [0.0, 10.0, 14.0], [1.0, 2.2, 1.4])


def specimen(mode: str, field: float = 0.0, temperature: float = 20.0) -> MeasuredTest:
    return MeasuredTest("t", TIME, STRETCH, np.ones(TIME.size), temperature, mode, nominal_field=field)


@pytest.mark.parametrize(
    ("law", "mode"),
    [
        *(pytest.param("gent", mode, marks=pytest.mark.trust) for mode in MODES),
        ("of several", "equibiaxial"),
        pytest.param("warm", "pure-shear", marks=pytest.mark.trust),
    ],
)
def test_branches_on_their_own_carry_what_they_carry_together(law: str, mode: str) -> None:
    material = LAWS[law]
    heat = 45.0 if isinstance(material.shift, Arrhenius) else 20.0
    tests = [specimen(mode, temperature=heat), MeasuredTest("held", [0.0, 1.0, 50.0], [1.5, 1.5, 1.5], [0, 1, 1], heat, mode)]
    stiffer = replace(material, equilibrium_modulus=5e4)
    ramp, held = Laboratory(tests, rtol=1e-8).answers([material, None, stiffer])
    track = Step(stretch=Track(np.append(0.0, tests[0].corner_time[1:]), tests[0].corner_stretch))
    for row, each in ((0, material), (2, stiffer)):
        whole = relax(each, [track], mode=mode, temperature=heat, times=TIME, rtol=1e-9).nominal_stress_1[0]
        assert np.allclose(ramp[row], whole, rtol=1e-6, atol=1e-6 * np.max(whole))
        whole = relax(
            each, [Step(stretch=1.5), Step.hold(50.0)], mode=mode, temperature=heat, times=[1.0, 50.0], rtol=1e-9
        ).nominal_stress_1[0]
        assert np.allclose(held[row], whole, rtol=1e-6)
    assert np.all(np.isnan(ramp[1]))


@pytest.mark.trust
@pytest.mark.parametrize("mode", MODES)
def test_stiff_branches_that_relax_fast_are_as_exact_as_slow_ones(mode: str) -> None:
    """Their elastic strain is small, but not their stress: errors count over this strain, down to rounding errors."""
    fast = replace(FILM, spectrum=Spectrum([300.0, 1e-2, 1e-5], [1e4, 3e5, 5e7]), nonequilibrium_law=Gent(12.0))
    for time, stretch in ((TIME, STRETCH), (TIME, 1 + 0.01 * (STRETCH - 1)), (1e4 * TIME, STRETCH)):
        test = MeasuredTest("t", time, stretch, np.ones(time.size), 20.0, mode)
        track = Step(stretch=Track(np.append(0.0, test.corner_time[1:]), test.corner_stretch))
        whole = relax(fast, [track], mode=mode, times=time, rtol=1e-7).nominal_stress_1[0]
        for rtol in (1e-5, 1e-7, 1e-11):
            found = Laboratory([test], rtol).answers([fast])[0][0]
            assert np.allclose(found, whole, rtol=0, atol=max(3 * rtol, 1e-6) * np.max(np.abs(whole)))


def test_a_history_of_many_corners_is_followed_as_the_library_does() -> None:
    time = np.linspace(0.0, 15.0, 16)
    stretch = 1.5 + 0.4 * np.sin(0.7 * time) + 0.1 * np.cos(3.1 * time)
    stretch[0] = 1.0
    test = MeasuredTest("many", time, stretch, np.ones(16), 20.0)
    assert test.corner_time.size > 12
    track = Track(test.corner_time, test.corner_stretch)
    whole = relax(FILM, [Step(stretch=track)], times=time[1:], rtol=1e-9).nominal_stress_1[0]
    assert np.allclose(Laboratory([test], rtol=1e-8).answers([FILM])[0][0, 1:], whole, rtol=1e-6, atol=1e-6 * np.max(whole))


@pytest.mark.parametrize("mode", MODES)
def test_a_voltage_takes_its_part_of_the_force(mode: str) -> None:
    """Neo-Hookean: s_1 lambda_1 = mu (A - C) - eps E~^2 A B; where axis 2 is free, mu (B - C) = eps E~^2 A B, C = 1/(A B)."""
    modulus, field, permittivity = 6e4, 12e6, 4e-11
    elastic = replace(FILM, equilibrium_modulus=modulus, spectrum=Spectrum([], []), equilibrium_law=NeoHookean())
    first = np.square(STRETCH)
    pull = permittivity * field**2
    second = {"uniaxial": np.sqrt(modulus / (first * (modulus - pull * first))), "equibiaxial": first}.get(
        mode, np.ones_like(first)
    )
    expected = (modulus * (first - 1 / (first * second)) - pull * first * second) / STRETCH
    found = Laboratory([specimen(mode, field)], rtol=1e-8).answers([elastic])[0][0]
    assert np.allclose(found, expected, rtol=1e-6)
    # and none is no part, whichever way that is computed
    bare, faint = Laboratory([specimen(mode), specimen(mode, 1e-3)], rtol=1e-8).answers([FILM])
    assert np.allclose(bare, faint, rtol=1e-5)


def test_a_voltage_that_no_film_holds_leaves_the_others() -> None:
    soft = replace(FILM, equilibrium_modulus=500.0, spectrum=Spectrum([1.0], [100.0]))
    found = Laboratory([specimen("uniaxial", 12e6)]).answers([soft, FILM, replace(FILM, permittivity=None)])[0]
    assert np.isfinite(found).all(axis=1).tolist() == [False, True, False]
    with pytest.raises(InputError, match="has no permittivity"):
        relax(replace(FILM, permittivity=None), [Step(stretch=2.0, rate=1.0)], nominal_field=1e6)


def test_a_first_point_that_comes_late_is_reached_as_is_said() -> None:
    late = [900.0, 1800.0, 3600.0], [2.0, 2.0, 2.0], [5e4, 4e4, 3e4], 20.0
    found = Laboratory([MeasuredTest("a", *late, ramp_rate=0.1), MeasuredTest("b", *late)], rtol=1e-8).answers([FILM])
    steps = [Step(stretch=2.0, rate=0.1), Step.hold(3590.0)]
    assert np.allclose(found[0][0], relax(FILM, steps, times=late[0], rtol=1e-9).nominal_stress_1[0], rtol=1e-6)
    assert found[1][0, 0] > 1.02 * found[0][0, 0]  # a slow ramp ends before it has relaxed
    with pytest.raises(InputError, match="the first point is at 900 s"):
        MeasuredTest("c", *late, ramp_rate=1e-3)
    with pytest.raises(InputError, match="a rate above 0 is needed"):
        MeasuredTest("d", *late, ramp_rate=0.0)


def test_the_largest_elastic_strain_of_a_linear_branch() -> None:
    """A ramp by D in a time h, a hold, a stretch at once: D tau/h (1 - exp(-h/tau)), and D."""
    whole, tau = 2 * np.log(2.0), np.array([2.0, 2.0])
    histories = Histories(np.array([[0.0, 4.0, 9.0], [0.0, 0.0, 9.0]]), np.array([[1.0, 2.0, 2.0]] * 2))
    expected = [whole * 0.5 * (1 - np.exp(-2.0)), whole]
    assert histories.largest_elastic_strain(1 / (3 * tau)) == pytest.approx(expected, rel=1e-14)
