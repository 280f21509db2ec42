"""Laws of the permittivity and of moduli over temperature: equations, stresses, and the files that state them."""

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
    VoltageStep,
    Waveform,
    export_card,
    write_material,
)
from dielast.handover.export.card import CODES, prepare
from dielast.handover.material_file import parse_material
from dielast.material.dielectric import (
    VACUUM_PERMITTIVITY,
    ConstantPermittivity,
    DielectricLaw,
    LinearPermittivity,
    PermittivityTable,
)
from dielast.material.laws_of_cases import log_ratio, stretch_laws
from dielast.material.modulus import EntropicModulus
from dielast.material.shift import WLF, ShiftTable
from dielast.mechanics.load import Step
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.stability import TimeScale

MATERIAL = """\
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
[nonequilibrium]
relaxation_time_s = [10.0]
shear_modulus_Pa = [50000.0]
[shift]
law = "none"
"""


def read(*lines: str, section: str = "dielectric") -> Material:
    return parse_material(f"{MATERIAL}[{section}]\n{chr(10).join(lines)}".encode(), "film.toml")


@pytest.mark.parametrize("coefficient", [-0.2, -0.053, 0.0, 0.1])
def test_the_linear_law_is_its_equation_and_its_derivatives(coefficient: float) -> None:
    law = LinearPermittivity(4e-11, stretch_coefficient=coefficient)
    log_squared = 2 * np.log(np.array([[1.0, 1.3, 2.0], [1.0, 1.1, 0.8]]))
    ratio, slope, bend = law.log_ratio(log_squared)
    assert np.exp(ratio) == pytest.approx([1, 1 + 0.4 * coefficient, 1 + 0.8 * coefficient], rel=1e-14)
    step = 1e-5
    for axis in range(2):
        move = step * np.eye(2)[axis][:, None]
        above, below = law.log_ratio(log_squared + move), law.log_ratio(log_squared - move)
        assert slope[axis] == pytest.approx((above[0] - below[0]) / (2 * step), rel=1e-8, abs=1e-11)
        rise = (above[1] - below[1]) / (2 * step)
        assert bend[axis : axis + 2] == pytest.approx(rise, rel=1e-8, abs=1e-11)


def test_a_table_is_linear_in_between_and_ends_at_its_ends() -> None:
    table = PermittivityTable((0.0, 20.0, 80.0), (4.9, 4.7, 4.1))
    assert table.at([0.0, 10.0, 50.0]) / VACUUM_PERMITTIVITY == pytest.approx([4.9, 4.8, 4.4], rel=1e-14)
    assert table.at(20.0) == ConstantPermittivity(0.0, 4.7).at(20.0)
    with pytest.raises(InputError, match=r"81 degC is outside the permittivity table, which is for 0 to 80 degC: state a"):
        table.at([20.0, 81.0])
    for temperature, values in (((), ()), ((0.0,), (4.0, 5.0)), ((1.0, 1.0), (4.0, 4.0)), ((0.0,), (0.5,)), ((np.nan,), (4.0,))):
        with pytest.raises(InputError):
            PermittivityTable(temperature, values)


def test_cases_of_several_laws_run_side_by_side() -> None:
    laws: list[DielectricLaw] = [
        ConstantPermittivity(4e-11),
        LinearPermittivity(4e-11, stretch_coefficient=-0.05),
        LinearPermittivity(4e-11, stretch_coefficient=-0.05),
        LinearPermittivity(4e-11, stretch_coefficient=0.1),
    ]
    assert not stretch_laws(laws[:1], 3)
    assert len(stretch_laws(laws[1:3], 2).laws) == 1
    gathered = stretch_laws(laws, 4)
    assert len(gathered.laws) == 3
    log_squared = np.random.default_rng(0).uniform(0, 1, (2, 4))
    order = np.array([3, 1, 1, 0])
    for found, *alone in zip(
        log_ratio(gathered.take(order), log_squared), *(laws[k].log_ratio(log_squared) for k in order), strict=True
    ):
        np.testing.assert_array_equal(found, np.stack([values[..., k] for k, values in enumerate(alone)], axis=-1))
    films = [Material("film", 26e3, Spectrum(np.array([10.0]), np.array([5e4])), NoShift(20.0), permittivity=law) for law in laws]
    steps, film = [VoltageStep(3e3, duration=1.0), VoltageStep.hold(20.0)], {"thickness": 1e-3, "prestretch": 1.3, "relax": 10.0}
    together = actuate(films, steps, **film, stop_at="end", points_per_decade=3)
    for case, own in enumerate(films):
        alone_run = actuate(own, steps, **film, stop_at="end", points_per_decade=3)
        np.testing.assert_allclose(together.stretch_1[case], alone_run.stretch_1[0], rtol=1e-8)
    assert together.stretch_1[0, -1] > together.stretch_1[1, -1] == together.stretch_1[2, -1]


def test_a_material_file_states_the_laws_by_their_keys() -> None:
    assert read('permittivity = "4e-11 F/m"').permittivity == 4e-11
    linear = read('permittivity = "4e-11 F/m"', "stretch_coefficient = -0.05")
    assert linear.permittivity == LinearPermittivity(4e-11, stretch_coefficient=-0.05)
    assert read('law = "linear"', "relative_permittivity = 4.5", "stretch_coefficient = 0.0").permittivity == LinearPermittivity(
        relative_permittivity=4.5
    )
    table = read('temperature = ["0 degC", "353.15 K"]', "relative_permittivity = [4.9, 4]")
    assert table.permittivity == PermittivityTable((0.0, 80.0), (4.9, 4.0))
    assert read('temperature = "20 degC"', "relative_permittivity = 4.7").permittivity == PermittivityTable((20.0,), (4.7,))
    for material in (linear, table):
        assert write_material(parse_material(write_material(material), "again.toml")) == write_material(material)


def test_a_prestretch_at_which_nothing_is_left_is_refused() -> None:
    film = Material(
        "film", 2e4, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), permittivity=LinearPermittivity(4e-11, None, -0.6)
    )
    with pytest.raises(InputError, match=r"prestretch: 1 x 2.9: the permittivity is not positive there"):
        actuate(film, [VoltageStep(1e3)], thickness=1e-3, prestretch=(1.0, 2.9))
    with pytest.raises(InputError, match="prestretch: 4 x free: the permittivity is not positive there"):
        actuate(film, [VoltageStep(1e3)], thickness=1e-3, prestretch=(4.0, None))


def test_a_table_is_asked_of_films_under_voltage_alone() -> None:
    table = PermittivityTable((0.0, 80.0), (4.9, 4.0))
    film = Material("film", 2e4, Spectrum(np.array([10.0]), np.array([5e4])), NoShift(20.0), permittivity=table)
    relax(film, [Step(stretch=2.0), Step.hold(1.0)], temperature=-10.0, points_per_decade=2)
    with pytest.raises(InputError, match=r"case 1: temperature: 90 degC is outside the permittivity table, which is for 0 to 80"):
        actuate(film, [VoltageStep(1e3)], thickness=1e-3, temperature=[20.0, 90.0])
    assert PointMaterial.of(film, np.array([0.0, 80.0]), 1e-6).permittivity == pytest.approx(
        np.array([4.9, 4.0]) * VACUUM_PERMITTIVITY
    )


def test_a_softening_dielectric_pulls_in_where_its_equation_says() -> None:
    """e^2 = (x - x^-5)/{x^3 [1 + 2 c (x - 1)] + c x^4/2} is largest at x = 1.27506, e = 0.70969, for c = -0.053."""
    modulus, permittivity, thickness = 2e4, 4e-11, 1e-3
    film = Material(
        "film",
        modulus,
        Spectrum(np.zeros(0), np.zeros(0)),
        NoShift(20.0),
        Gent(),
        permittivity=LinearPermittivity(permittivity, stretch_coefficient=-0.053),
    )
    unit = thickness * np.sqrt(modulus / permittivity)
    for timescale in (TimeScale.fixed(0.0), TimeScale.fraction(0.01)):
        (event,) = actuate(
            film,
            [VoltageStep(0.8 * unit, duration=1.0)],
            thickness=thickness,
            stop_at="pull-in",
            pull_in_timescale=timescale,
            rtol=1e-8,
        ).events[0]
        assert event.name == "pull-in"
        assert event.stretch_1 == event.stretch_2 == pytest.approx(1.27506, abs=1e-5)
        assert event.voltage / unit == pytest.approx(0.70969, abs=1e-5)
    held = actuate(film, [VoltageStep(np.array([0.70968, 0.70970]) * unit)], thickness=thickness, stop_at="pull-in")
    assert [[event.name for event in events] for events in held.events] == [[], ["pull-in"]]


def test_an_elastic_film_gives_back_the_work_of_a_cycle() -> None:
    """The stress that a stretching dielectric adds is the derivative of the energy that its charge holds: no cycle gains work."""
    film = Material(
        "film",
        2e4,
        Spectrum(np.zeros(0), np.zeros(0)),
        NoShift(20.0),
        Gent(80.0),
        permittivity=LinearPermittivity(4e-11, stretch_coefficient=-0.1),
    )
    steps = [VoltageStep(Waveform(0.0, 5e3, 1.0, cycles=2))]
    run = actuate(film, steps, thickness=0.5e-3, prestretch=(1.6, 1.3), stop_at="end", rtol=1e-7)
    assert run.cycles is not None
    assert run.cycles.amplitude[0] == pytest.approx(run.cycles.amplitude[0, 0], rel=1e-6)
    assert run.cycles.amplitude[0, 0] > 0.01
    stored = 0.5 * 4e-11 * (5e3 / 0.5e-3) ** 2
    assert run.cycles.work[0] == pytest.approx(0.0, abs=1e-6 * stored)


ZERO = 273.15

FILM = Material(
    "film", 26e3, Spectrum(np.array([10.0, 0.1]), np.array([5e4, 1e5])), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11
)

ENTROPIC = replace(FILM, equilibrium_scaling=EntropicModulus(), nonequilibrium_scaling=EntropicModulus())


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
    assert (
        read(section="temperature").equilibrium_scaling
        == read('equilibrium = "constant"', section="temperature").equilibrium_scaling
    )
    assert b"temperature]" not in write_material(read('equilibrium = "constant"', section="temperature"))
    one = read('equilibrium = "entropic"', section="temperature")
    assert one.equilibrium_scaling == EntropicModulus()
    assert not one.nonequilibrium_scaling.depends_on_temperature
    two = read('equilibrium = "entropic"', 'nonequilibrium = "entropic"', 'thermal_expansion = "6e-4 /K"', section="temperature")
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
