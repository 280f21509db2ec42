"""Moduli over temperature: entropic springs, in simulations, files, cards, and from master curves with a vertical shift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flat import actuate, creep, relax

from dielast import (
    CardOptions,
    DielastWarning,
    Gent,
    InputError,
    Material,
    NoShift,
    Spectrum,
    Step,
    VoltageStep,
    export_card,
    write_material,
)
from dielast.handover.export.card import CODES, prepare
from dielast.handover.material_file import parse_material
from dielast.material.modulus import EntropicModulus
from dielast.material.shift import WLF, ShiftTable

ZERO = 273.15
FILM = Material(
    "film", 26e3, Spectrum(np.array([10.0, 0.1]), np.array([5e4, 1e5])), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11
)
ENTROPIC = replace(FILM, equilibrium_scaling=EntropicModulus(), nonequilibrium_scaling=EntropicModulus())
MATERIAL = """\
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
[nonequilibrium]
relaxation_time_s = [10.0]
shear_modulus_Pa = [50000.0]
[shift]
law = "none"
[temperature]
"""


def read(*lines: str) -> Material:
    return parse_material((MATERIAL + "\n".join(lines)).encode(), "film.toml")


def test_the_factor_is_that_of_absolute_temperature_and_density() -> None:
    temperature = np.array([[20.0, 60.0], [-40.0, 0.0]])
    assert EntropicModulus().factor(temperature, 20.0) == pytest.approx((temperature + ZERO) / (20 + ZERO), rel=1e-14)
    expanded = EntropicModulus(6e-4).factor(60.0, 20.0)
    assert expanded == pytest.approx((60 + ZERO) / (20 + ZERO) / (1 + 6e-4 * 40), rel=1e-14)
    with pytest.raises(InputError, match="no positive density at 120 degC"):
        EntropicModulus(-0.01).factor([20.0, 120.0], 20.0)
    with pytest.raises(InputError, match="above absolute zero"):
        EntropicModulus().factor(-300.0, 20.0)


def test_all_stresses_of_entropic_films_go_with_temperature() -> None:
    steps = [Step(stretch=2.0, rate=1.0), Step.hold(100.0)]
    temperature = np.array([20.0, 60.0, -20.0])
    factor = (temperature + ZERO) / (20 + ZERO)
    here, there = (relax(own, steps, temperature=temperature, rtol=1e-8) for own in (ENTROPIC, FILM))
    assert here.nominal_stress_1 == pytest.approx(there.nominal_stress_1 * factor[:, None], rel=1e-6)
    np.testing.assert_array_equal(here.nominal_stress_1[0], there.nominal_stress_1[0])
    at_rest = replace(FILM, equilibrium_scaling=EntropicModulus())
    relaxed = relax(at_rest, [Step(stretch=2.0), Step.hold(1e4)], temperature=60.0).nominal_stress_1[0]
    same = relax(FILM, [Step(stretch=2.0), Step.hold(1e4)], temperature=60.0).nominal_stress_1[0]
    assert relaxed[-1] == pytest.approx(same[-1] * factor[1], rel=1e-6)
    springs = 26e3 * (2 - 1 / 4) * (factor[1] - 1) / (1 - 2 / 110)  # I1 - 3 = 4 + 1 - 3
    assert relaxed[0] - same[0] == pytest.approx(springs, rel=1e-6)


def test_creep_and_voltages_feel_it() -> None:
    """Under a load, or a squared voltage, that goes with temperature, an entropic film does the same at every temperature."""
    factor = (60 + ZERO) / (20 + ZERO)
    hot = creep(ENTROPIC, [Step(stress=3e4 * factor), Step.hold(10.0)], temperature=60.0, rtol=1e-8)
    cool = creep(ENTROPIC, [Step(stress=3e4), Step.hold(10.0)], rtol=1e-8)
    assert hot.stretch_1 == pytest.approx(cool.stretch_1, rel=1e-7)
    film = {"thickness": 0.5e-3, "prestretch": 1.8, "relax": 60.0, "stop_at": "pull-in"}
    events = [
        actuate(ENTROPIC, [VoltageStep(voltage), VoltageStep.hold(1e4)], temperature=temperature, **film, rtol=1e-8).events[0]
        for voltage, temperature in ((5e3, 20.0), (5e3 * np.sqrt(factor), 60.0), (5e3, 60.0))
    ]
    assert events[0][0].name == events[1][0].name == "pull-in"
    assert events[1][0].time == pytest.approx(events[0][0].time, rel=1e-5)
    assert not events[2] or events[2][0].time > 1.1 * events[0][0].time


def test_materials_with_and_without_it_run_side_by_side() -> None:
    both = relax([FILM, ENTROPIC], [Step(stretch=1.5)], temperature=60.0)
    assert both.nominal_stress_1[1] == pytest.approx(both.nominal_stress_1[0] * (60 + ZERO) / (20 + ZERO), rel=1e-9)


def test_material_files_state_it() -> None:
    assert read().equilibrium_scaling == read('equilibrium = "constant"').equilibrium_scaling
    assert b"temperature]" not in write_material(read('equilibrium = "constant"'))
    one = read('equilibrium = "entropic"')
    assert one.equilibrium_scaling == EntropicModulus()
    assert not one.nonequilibrium_scaling.depends_on_temperature
    two = read('equilibrium = "entropic"', 'nonequilibrium = "entropic"', 'thermal_expansion = "6e-4 /K"')
    assert two.equilibrium_scaling == two.nonequilibrium_scaling == EntropicModulus(6e-4)
    for material in (one, two):
        assert write_material(parse_material(write_material(material), "again.toml")) == write_material(material)
    with pytest.raises(InputError, match="one thermal_expansion for the equilibrium spring and the branches, not two"):
        write_material(replace(two, equilibrium_scaling=EntropicModulus()))


def test_cards_hold_at_their_temperature_and_say_so() -> None:
    material = replace(ENTROPIC, shift=WLF(20.0, 13.7, 187.1))
    options = CardOptions(hyperelastic="neo-hookean")
    with pytest.warns(DielastWarning, match="the moduli of the cards hold at 20 degC only: those of the equil"):
        (card,) = export_card(material, "abaqus", options).values()
    (plain,) = export_card(replace(FILM, shift=material.shift), "abaqus", options).values()
    assert "Moduli hold at 20 degC ONLY" in card.replace("\n** ", " ")
    lines = [[line for line in text.splitlines() if not line.startswith("**")] for text in (card, plain)]
    assert lines[0] == lines[1]
    table = replace(ENTROPIC, shift=ShiftTable(20.0, (20.0, 60.0), (0.0, -2.0)))
    with pytest.warns(DielastWarning, match="hold at 60 degC only"):
        there = prepare(table, CODES["ansys"], CardOptions(hyperelastic="neo-hookean", temperature=60.0))
    factor = (60 + ZERO) / (20 + ZERO)
    assert there.equilibrium == pytest.approx(26e3 * factor, rel=1e-12)
    assert there.modulus == pytest.approx(FILM.spectrum.shear_modulus * factor, rel=1e-12)
