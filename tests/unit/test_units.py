from __future__ import annotations

import contextlib
import math

import pytest
import scipy.constants
from hypothesis import given, strategies as st

from dielast.base import units
from dielast.base.errors import InputError
from dielast.material.dielectric import VACUUM_PERMITTIVITY


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("2.5 kV", units.VOLTAGE, 2500.0),
        ("0.5 mm", units.LENGTH, 5e-4),
        ("1.5 h", units.TIME, 5400.0),
        ("5min", units.TIME, 300.0),
        ("12.5 %/s", units.STRAIN_RATE, 0.125),
        ("0.1 1/s", units.STRAIN_RATE, 0.1),
        ("20 degC", units.TEMPERATURE, 20.0),
        ("20 °C", units.TEMPERATURE, 20.0),
        ("293.15 K", units.TEMPERATURE, 20.0),
        ("-40 degC", units.TEMPERATURE, -40.0),
        ("20 ° C", units.TEMPERATURE, 20.0),
        ("20 ℃", units.TEMPERATURE, 20.0),
        ("68 ℉", units.TEMPERATURE, 20.0),
        ("20 ℃", units.TEMPERATURE_DIFFERENCE, 20.0),
        ("2 weeks", units.TIME, 1209600.0),
        ("68 degF", units.TEMPERATURE, 20.0),
        ("68 deg F", units.TEMPERATURE, 20.0),
        ("-40 fahrenheit", units.TEMPERATURE, -40.0),
        ("187.1 K", units.TEMPERATURE_DIFFERENCE, 187.1),
        ("18 degF", units.TEMPERATURE_DIFFERENCE, 10.0),
        ("48 MV/m", units.FIELD, 48e6),
        ("48 V/µm", units.FIELD, 48e6),
        ("1 %", units.STRAIN, 0.01),
        ("6e-4 /K", units.THERMAL_EXPANSION, 6e-4),
        ("5e-4 /degF", units.THERMAL_EXPANSION, 9e-4),
    ],
)
def test_quantities_become_si(text: str, dimension: units.Dimension, expected: float) -> None:
    assert units.parse(text, dimension) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("10 kg", units.STRAIN_RATE, '"10 kg": a strain rate is needed, such as "12.5 %/s"'),
        (5, units.TIME, '5: a time is needed with its unit, such as "1.5 h"'),
        ("5", units.TIME, '"5": a time is needed with its unit, such as "1.5 h"'),
        ("soon", units.TIME, '"soon": a time is needed, such as "1.5 h"'),
        ("3 furlong", units.LENGTH, '"3 furlong": unknown unit "furlong"; a length is needed, such as "0.5 mm"'),
        ("1e999 s", units.TIME, '"1e999 s": a time that is finite is needed, such as "1.5 h"'),
        ("2 m^9^9^9", units.LENGTH, 'unknown unit "m^9^9^9"'),
        ("1 degC", units.TIME, "a time is needed"),
        ("68 F", units.TEMPERATURE, '"68 F": a temperature is needed, such as "20 degC"'),
        (True, units.TIME, "a time is needed with its unit"),
        ("23,5 °C", units.TEMPERATURE, '"23,5 °C": a temperature is needed; a decimal comma? write 23.5'),
        ("1,000 s", units.TIME, "a decimal comma? write 1.000 or 1000"),
        ("1,000,000 s", units.TIME, 'unknown unit ",000,000 s"; a time'),
        ("5 Mpa", units.STRESS, 'unknown unit "Mpa"; did you mean "MPa"?'),
        ("5 mpa", units.STRESS, 'unknown unit "mpa"; a stress'),
        ("5 MM", units.LENGTH, 'unknown unit "MM"; a length'),
        ("5 sek", units.TIME, 'unknown unit "sek"; did you mean "s"?'),
        ("5 Volt", units.VOLTAGE, 'unknown unit "Volt"; did you mean "volt"?'),
        ("5 microns", units.LENGTH, 'unknown unit "microns"; did you mean "um"?'),
        ("5 V/S", units.VOLTAGE_RATE, 'such as "0.25 kV/s"; did you mean "V/s"?'),
        ("5 sek", units.STRESS, 'unknown unit "sek"; a stress'),
        ("5 DegC", units.TEMPERATURE, 'did you mean "degC"?'),
    ],
)
def test_wrong_quantities_say_what_is_needed(text: object, dimension: units.Dimension, message: str) -> None:
    with pytest.raises(InputError) as caught:
        units.parse(text, dimension)
    assert message in str(caught.value)


@given(st.text(max_size=80))
def test_any_text_is_a_number_or_an_input_error(text: str) -> None:
    with contextlib.suppress(InputError):
        assert math.isfinite(units.parse(text, units.TIME))


def test_every_name_has_its_size_in_si() -> None:
    sizes = {  # of 1 of each, as the SI Brochure and NIST SP 811 state them
        units.LENGTH: "m metre 1, in inch 0.0254, mil 2.54e-5, ft foot feet 0.3048, µm μm um micrometer 1e-6, kilometres 1e3",
        units.TIME: "s sec second 1, min minute 60, h hr hour 3600, d day 86400, week 604800, ns 1e-9, ps 1e-12, 1/Hz 1, coul/A 1",
        units.MASS: "kg kilogram 1, g gram 1e-3, mg 1e-6",
        units.FORCE: "N newton 1, dyn dyne 1e-5, gf gram_force 9.80665e-3, kgf kilogram_force 9.80665, lbf 4.4482216152605",
        units.STRESS: "Pa pascal J/m^3 1, mbar 100, bar 1e5, GPa gigapascals 1e9, psi lbf/in^2 6894.757293168361"
        ", ksi kpsi 6894757.293168361, dyn/cm² 0.1",
        units.STIFFNESS: "N/m N.m^-1 1, N/mm 1e3, J/m² 1",
        units.TORQUE: "N*m N-m J joule W*s 1, µN·m 1e-6",
        units.VOLTAGE: "V volt W/A J/coul coulomb/F 1, kV kilovolt 1e3",
        units.PERMITTIVITY: "F/m farad/meter coul/V/m 1, pF/m 1e-12",
        units.COMPLIANCE: "1/Pa /Pa Pa^-1 Pa⁻¹ 1, 1/MPa MPa-1 1e-6, 1/GPa 1e-9, cm²/dyn 10",
        units.VISCOSITY: "Pa*s Pa.s Pa-s 1, mPa.s mPa·s 1e-3, kPa*s 1e3",
        units.STRAIN_RATE: "1/s /s s-1 Hz 1, %/s percent/s 0.01, %/min 1.6666666666666667e-4, m/s/m 1",
        units.STRAIN: "rad radian m/m 1, % percent 0.01, mm/m 1e-3",
        units.FREQUENCY: "Hz 1, mHz 1e-3, kHz 1e3",
        units.ANGULAR_FREQUENCY: "rad/s rad.s^-1 radian/second 1, rad/min 0.016666666666666666",
        units.MOLAR_ENERGY: "J/mol joule/mole 1, kJ/mol 1e3",
        units.THERMAL_EXPANSION: "1/K 1/kelvin 1/degC 1/°C /celsius 1, 1/degF 1/fahrenheit 1.8",
    }
    for dimension, listed in sizes.items():
        for *names, size in map(str.split, listed.split(", ")):
            for name in names:
                assert units.conversion(name, dimension) == (pytest.approx(float(size), rel=1e-15), 0.0), name
            assert units.conversion(names[-1], dimension) == units.conversion(f" {names[-1]} ", dimension)
    # names parted by blanks
    assert units.parse("1 kg m/s^2", units.FORCE) == units.parse("1 J per m", units.FORCE) == 1.0
    assert units.parse("1 N per square mm", units.STRESS) == units.parse("1 N/sq mm", units.STRESS) == pytest.approx(1e6)
    assert units.parse("1 N mm/cubic mm", units.STRESS) == units.parse("1 N/mm squared", units.STRESS) == pytest.approx(1e6)
    assert units.parse("5 kilograms", units.MASS) == 5.0


@pytest.mark.parametrize(
    "unit", ["square", "per", "m per", "p°C", "kdegF", "m//s", "*m", "m^", "m^10", "m^0", "2m", "é", "_", "as", "deg"]
)
def test_no_unit_is_made_up(unit: str) -> None:
    assert units.parse_unit(unit) is None
    assert units.kind_of(unit) is None


@pytest.mark.parametrize(
    "text", ["0" + " " * 50_000 + "x" + " " * 50_000 + "y", "0" + " " * 50_000 + "\n" + " " * 50_000 + "s\n\rx"]
)
def test_blanks_without_end_are_read_in_no_time(text: str) -> None:
    """Which a pattern that tries every way to share them out would not."""
    with pytest.raises(InputError, match="unknown unit"):
        units.parse(text, units.TIME)


def test_a_mass_where_a_force_is_needed_gets_its_weight() -> None:
    for text, newton in (("0.17 kg", "1.667"), ("170 g", "1.667")):
        with pytest.raises(InputError, match=f'a force is needed, such as "0.17 N"; is it the weight .* then write "{newton} N"$'):
            units.parse(text, units.FORCE)
    with pytest.raises(InputError, match=r'^"3 mm": a force is needed, such as "0.17 N"$'):
        units.parse("3 mm", units.FORCE)


def test_constants_of_nature() -> None:
    assert pytest.approx(units.GAS_CONSTANT, rel=1e-9) == scipy.constants.R
    assert scipy.constants.epsilon_0 == pytest.approx(VACUUM_PERMITTIVITY, rel=1e-9)
    assert scipy.constants.zero_Celsius == units.ZERO_CELSIUS
