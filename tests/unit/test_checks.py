"""Legal but foolish inputs are warned of with what they look like, sound ones never."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dielast.base.errors import DielastWarning, InputError
from dielast.commands.simulation.checks import warn_of_no_breakdown, warn_of_setups
from dielast.material.checks import (
    USUAL,
    warn_of_elongation,
    warn_of_field,
    warn_of_material,
    warn_of_prestretches,
    warn_of_strain,
    warn_of_stretch,
    warn_of_temperature,
)
from dielast.material.material import VACUUM_PERMITTIVITY, Breakdown, Material
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftLaw, ShiftTable
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.material.use_checks import Pace, fastest_branch, warn_of_paces, warn_of_use

VHB = Material(
    "VHB",
    26e3,
    Spectrum(np.geomspace(1e-7, 1e5, 13), np.geomspace(1e8, 1e3, 13)),
    WLF(20.0, 13.7, 187.1),
    permittivity=4.5 * VACUUM_PERMITTIVITY,
    breakdown=Breakdown((1.7, 1.9), (4e7, 4.8e7)),
    measured_temperature=(-40.0, 60.0),
)


def warn_of_law(law: ShiftLaw) -> None:
    warn_of_material(replace(VHB, shift=law))


def scaled(factor: float) -> Material:
    spectrum = Spectrum(VHB.spectrum.relaxation_time, factor * VHB.spectrum.shear_modulus)
    return replace(VHB, equilibrium_modulus=factor * VHB.equilibrium_modulus, spectrum=spectrum)


def relaxing(share: float) -> Material:
    branches = np.array([share * VHB.equilibrium_modulus])
    return replace(VHB, spectrum=Spectrum(np.array([1.0]), branches))


def test_sound_inputs_are_not_doubted() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_material(VHB)
        warn_of_material(replace(VHB, equilibrium_modulus=0.0))  # a melt
        warn_of_law(WLF(20.0, 23.0347, 293.15))  # Arrhenius' law with 129 kJ/mol
        USUAL["largest modulus"].warn(2e9)
        warn_of_temperature([-40.0, 60.0], "tests at")
        warn_of_temperature([130.0, 190.0], "tests at")  # polystyrene
        warn_of_strain([0.01, 0.05])
        warn_of_use(VHB, [60.0, -44.0])
        warn_of_use(replace(VHB, measured_temperature=None), 90.0)
        for C1, C2 in ((13.7, 187.1), (17.44, 51.6), (8.86, 101.6), (32.2, 80.0), (1.9, 222.0)):  # VHB, universal, PMMA, PDMS
            warn_of_law(WLF(20.0, C1, C2))
        warn_of_law(Arrhenius(20.0, 95e3))
        warn_of_material(relaxing(0.02))  # hardly lossy
        warn_of_material(relaxing(0.0))  # elastic, on purpose
        warn_of_material(replace(VHB, equilibrium_law=Gent(2.0)))
        USUAL["plateau"].warn(77e3)
        USUAL["film"].warn([1e-6, 1e-2])
        USUAL["specimen"].warn(0.05)
        warn_of_field([0.0, 2e5], 4e7)
        warn_of_field(2e8, 4e7)
        warn_of_field(0.0, 4e7)  # no voltage, on purpose
        warn_of_stretch(0.8, 1.0)
        warn_of_stretch(1.0, 1.5)
        warn_of_elongation([1.0, 6.0], [1.0, 0.4], [1.0, 0.7])
        warn_of_elongation([1.0, 1.0001], [1.0, 1.0], [1.0, 1.0])
        warn_of_paces([Pace("step[0] takes", 1.0, 0.5, 20.0), Pace("step[1] takes", 1.0, 0.0, 20.0)])


@pytest.mark.parametrize(
    ("doubt", "said"),
    [
        (lambda: warn_of_material(scaled(1e-3)), "equilibrium shear modulus is 26 Pa"),
        (lambda: warn_of_material(replace(VHB, equilibrium_modulus=2e8)), "equilibrium shear modulus is 2e"),
        (lambda: warn_of_material(scaled(1e3)), "more than any polymer's glass"),
        (lambda: warn_of_material(replace(VHB, permittivity=4.5)), "times that of the vacuum"),
        (lambda: warn_of_material(replace(VHB, permittivity=560 * VACUUM_PERMITTIVITY)), r"560 times .* such as 5\.6\?"),
        (lambda: warn_of_material(replace(VHB, equilibrium_modulus=60e6)), r"6e\+07 Pa, but rubbers .* such as 60000 Pa\?"),
        (lambda: warn_of_material(replace(VHB, breakdown=Breakdown((1.0,), (40e3,)))), "breakdown field of 40000 V/m"),
        (lambda: USUAL["breakdown field"].warn([40e6, 40e12]), "breakdown field of 4e"),
        (lambda: USUAL["largest modulus"].warn(2e11), "largest Young's modulus is 2e"),
        (lambda: USUAL["largest modulus"].warn(100.0), "less than that of a gel"),
        (lambda: warn_of_temperature(np.array([-40.0, 60.0]) - 273.15, "tests at"), "but stated as kelvin"),
        (lambda: warn_of_temperature(np.array([-40.0, 60.0]) + 273.15, "tests at"), "in kelvin, but stated as degC"),
        (lambda: warn_of_temperature([-190.0, 20.0], "tests at"), "is the scale right"),
        (lambda: warn_of_strain([1.05, 1.05]), "is it a stretch, so that the strain is 0.05, or"),
        (lambda: warn_of_strain([1.05, 1.05]), r"or in per cent, which its unit must state\?"),
        (lambda: warn_of_strain([0.5]), "at small strain only; or is it in per cent"),
        (lambda: warn_of_strain([1.0]), r"is 1, that is 100 %: is it in per cent, which its unit must state\?"),
        (lambda: warn_of_strain([5.0]), r"is 5, that is 500 %: is it in per cent"),
        (lambda: warn_of_use(VHB, [20.0, 80.0, 70.0]), "measured from -40 to 60 degC: at 80 degC it is extrapolated"),
        (lambda: warn_of_use(VHB, -60.0), "at -60 degC it is extrapolated"),
        (lambda: warn_of_use(replace(VHB, shift=NoShift(20.0)), [22.0, 40.0]), "at 40 degC it relaxes as at 20 degC: state"),
        (lambda: warn_of_use(replace(VHB, shift=NoShift(20.0)), [22.0, 0.0]), "at 0 degC it relaxes as at 20 degC: state"),
        (lambda: warn_of_use(replace(VHB, measured_temperature=None), 293.15), "in kelvin, but stated as degC"),
        (lambda: warn_of_material(relaxing(0.005)), "the branches add up to 130 Pa beside an equilibrium modulus of 26000 Pa"),
        (lambda: warn_of_material(replace(VHB, nonequilibrium_law=Gent(0.1))), r"J_lim = 0.1 \(nonequilibrium\)"),
        (lambda: warn_of_material(replace(VHB, shift=WLF(20.0 - 273.15, 13.7, 187.1))), "which is 20 K"),
        (
            lambda: warn_of_material(replace(VHB, shift=WLF(293.15, 13.7, 187.1))),
            "reference temperature is 293.15 degC: was the value in kelvin",
        ),
        (lambda: warn_of_law(WLF(20.0, 13.7 * np.log(10), 187.1)), "is C1 for natural logarithms, 2.303 times too large"),
        (lambda: warn_of_law(WLF(20.0, 40.0, 187.1)), "C1 C2 is 7.48e"),
        (lambda: warn_of_law(WLF(20.0, 0.0137, 187.1)), r"C1 C2 is 2.56 K, .* in another unit"),
        (lambda: warn_of_law(WLF(20.0, 13.7, 1.871)), "C1 C2 is 25.6 K"),
        (lambda: warn_of_law(WLF(20.0, 2e3, 293.15)), "an activation energy of 11224.6 kJ/mol"),
        (lambda: warn_of_law(WLF(20.0, 13.7, 18710.0)), "in another unit"),
        (lambda: warn_of_law(Arrhenius(20.0, 95.0)), "an activation energy of 0.095 kJ/mol"),
        (
            lambda: warn_of_law(Arrhenius(20.0, -100e3)),
            "-100 kJ/mol: relaxation gets slower with .* its sign be positive",
        ),
        (lambda: warn_of_law(WLF(20.0, -13.7, 187.1)), "WLF with C1 = -13.7 .* slower with .* should C1 be positive"),
        (
            lambda: warn_of_law(ShiftTable(20.0, (0.0, 20.0, 40.0), (-1.0, 0.0, 1.0))),
            "log10 a increases by 1 from 0 to 20 degC: .* should the signs be the other way round",
        ),
        (
            lambda: warn_of_law(ShiftTable(20.0, (0.0, 20.0, 40.0), (1.0, 0.0, 0.2))),
            "log10 a increases by 0.2 from 20 to 40 degC: relaxation gets slower .* is this entry right",
        ),
        (lambda: USUAL["plateau"].warn(77.0), "levels off at 77 Pa"),
        (lambda: USUAL["film"].warn(0.5), "the thickness is 500 mm, but a film has 1 um to 10 mm"),
        (lambda: USUAL["film"].warn([5e-4, 5e-7]), "the thickness is 0.0005 mm"),
        (lambda: warn_of_field([0.0, 3e4], 4e7), "1/1333 of the breakdown field: no film moves"),
        (lambda: warn_of_field(3e10, 4e7), "750 times the breakdown field"),
        (lambda: warn_of_stretch(0.5, 1.0), "is it a strain, so that the stretch is 1.5"),
        (lambda: warn_of_stretch(1.0, 1.0), "undeformed: is it a strain of 100 %"),
        (
            lambda: warn_of_elongation([1.0, 10.6], [1.0, 0.307], [1.0, 0.02]),
            "stretches the film to 10.6, where its chains are taut",
        ),
        (lambda: warn_of_elongation([1.0, 1 + 1e-6], [1.0, 1.0], [1.0, 1.0]), "by less than 1e-05"),
    ],
)
def test_what_is_foolish_is_said(doubt: Callable[[], None], said: str) -> None:
    with pytest.warns(DielastWarning, match=said):
        doubt()


def test_only_the_most_hasty_pace_is_told() -> None:
    hasty = [Pace(f"step[{index}] takes", took, 393.0, 20.0) for index, took in enumerate((8.0, 400.0, 1.0))]
    with pytest.warns(DielastWarning) as caught:
        warn_of_paces(hasty)
    assert [str(each.message).partition(":")[0] for each in caught] == [
        "step[2] takes 1 s, but the fastest branch takes 393 s at 20 degC"
    ]


def test_a_branch_that_takes_for_ever_is_told_so() -> None:
    for fastest in (np.inf, 3e212):
        with pytest.warns(DielastWarning, match=r"takes 1 s, but the fastest branch takes more than 1e\+15 s at -160 degC: the"):
            warn_of_paces([Pace("step[0] takes", 1.0, fastest, -160.0)])


def test_a_shift_table_is_doubted_unless_it_refers_to_its_reference() -> None:
    temperatures, off = (0.0, 25.0, 40.0), (1.6, 0.5, -1.3)
    said = (
        r"^the shift table gives log10 a = 0.72 at the reference temperature 20 degC, where it must be 0: 0.72 is subtracted from "
        r"every entry; state the temperature that the table refers to, or an entry of 0 at 20 degC$"
    )
    with pytest.warns(DielastWarning, match=said):
        warn_of_material(replace(VHB, shift=ShiftTable(20.0, temperatures, off)))
    rounded = tuple(float(f"{value - 0.72:.9g}") for value in off)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_material(replace(VHB, shift=ShiftTable(20.0, temperatures, rounded)))


def test_a_branch_without_modulus_is_none() -> None:
    spectrum = Spectrum(np.array([100.0, 1.0]), np.array([1e4, 0.0]))
    assert fastest_branch(replace(VHB, spectrum=spectrum), 20.0) == 100
    assert fastest_branch(relaxing(0.0), 20.0) == 0


def test_a_pole_tells_what_the_reference_temperature_was_in_kelvin() -> None:
    with pytest.raises(InputError, match=r"C2 = 187.1 K below 293.15 degC, which if it were kelvin would be 20 degC"):
        WLF(293.15, 13.7, 187.1).log10_shift_factor(20.0)
    with pytest.raises(InputError, match=r"C2 = 187.1 K below 20 degC$"):
        WLF(20.0, 13.7, 187.1).log10_shift_factor(-200.0)


def test_a_prestretch_beyond_the_breakdown_fields_takes_the_nearest_and_says_how_to_state_one() -> None:
    known = Breakdown((1.7, 1.9), (4e7, 4.8e7))
    np.testing.assert_allclose(known.at([1.0, 1.7, 1.8, 1.9, 5.0]), [4e7, 4e7, 4.4e7, 4.8e7, 4.8e7])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_prestretches(
            [(1.7, 1.7), (1.9 * (1 + 1e-12), 1.9), (3.0, 1.0), (5.0, 5.0)], [known, known, None, Breakdown((), (4e7,))]
        )
    found = (
        r"^prestretch 3 \(and 1 more\): breakdown fields are stated for 1.7 to 1.9: the nearest, 48 MV/m, is taken; to state one, "
        r'write \[breakdown\] prestretch = \[1.7, 1.9, 3\], field = \["40 MV/m", "48 MV/m", "..."\]$'
    )
    with pytest.warns(DielastWarning, match=found):
        warn_of_prestretches([(1.8, 1.8), (3.0, 3.0), (4.0, 2.0)], [known] * 3)
    with pytest.warns(DielastWarning, match=r"^prestretch 2 x 1 \(as 1.414 equibiaxial\): .*, 40 MV/m, .* = \[1.414, 1.7, 1.9\]"):
        warn_of_prestretches([(2.0, 1.0)], [known])
    alone = r"^prestretch 1.9: breakdown fields are stated for 1.7 alone: the nearest, 40 MV/m, is taken"
    with pytest.warns(DielastWarning, match=alone):
        warn_of_prestretches([(1.7, 1.7), (1.9, 1.9)], [Breakdown((1.7,), (4e7,))] * 2)


@pytest.mark.parametrize(("held", "where"), [("frame", "in a frame"), ("strip", "in a strip"), ("clamped", "with clamped edges")])
def test_a_held_film_without_prestretch_is_warned_of(held: str, where: str) -> None:
    with pytest.warns(DielastWarning, match=f"{where}: without prestretch the voltage pushes"):
        warn_of_setups([(2.0, 2.0), (1.0, 1.0)], [(held, held)] * 2, 5e-4, [None] * 2)
    warn_of_setups([(2.0, 2.0), (1.0, 1.0)], [("frame", "frame"), ("dead-load", "dead-load")], 5e-4, [None] * 2)


@pytest.mark.parametrize(
    ("steady", "ends"), [(True, "no failure ends a film under a charge"), (False, "pull-in alone ends a film")]
)
def test_a_film_without_a_breakdown_field_is_warned_of(steady: bool, ends: str) -> None:
    """Under a charge a film does not pull in, unless its permittivity depends on the stretch."""
    with pytest.warns(DielastWarning, match=f"^no breakdown field is known, so that {ends}: state"):
        warn_of_no_breakdown([False], [replace(VHB, damage=None)], steady)
