"""Quantities with units, read into SI (temperatures into degC).

The table below holds the units of measurements on elastomers. Nothing is guessed: a bare number where a dimension is needed is an
error, and so is a unit of another dimension.
"""

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from dielast.base.errors import InputError, shown

ZERO_CELSIUS = 273.15  # K
GAS_CONSTANT = 8.314462618  # J/(mol K), CODATA 2018
GRAVITY = 9.80665  # m/s^2, standard acceleration
TIMES = (1e-15, 1e15)  # s: from less than a bond's vibration to 30 million years, where no test and no service begins or ends

BASE = ("m", "s", "kg", "A", "K", "mol")
# Names of units, their size and what they are made of. Sizes are exact by definition: SI Brochure, 9th edition; for inch,
# mil, foot and pound-force NIST SP 811, appendix B.8.
_TABLE = """
meter metre m: 1 m
second sec s: 1 s
kilogram kg: 1 kg
ampere A: 1 A
kelvin K: 1 K
mole mol: 1 mol
gram g: 1e-3 kg
degree_Celsius degreeC celsius degC °C: 1 K
degree_Fahrenheit degreeF fahrenheit degF °F: 0.5555555555555556 K
minute min: 60 s
hour hr h: 3600 s
day d: 86400 s
week: 604800 s
newton N: 1 kg*m/s^2
gram_force gf: 9.80665e-3 N
kilogram_force kgf: 9.80665 N
pound_force lbf: 4.4482216152605 N
dyne dyn: 1e-5 N
inch in: 0.0254 m
mil: 2.54e-5 m
foot feet ft: 0.3048 m
pascal Pa: 1 N/m^2
bar: 1e5 Pa
psi: 6894.757293168361 Pa
ksi: 1 kpsi
joule J: 1 N*m
watt W: 1 J/s
volt V: 1 W/A
coulomb coul C: 1 A*s
farad F: 1 A*s/V
ohm Ω: 1 V/A
siemens S: 1 A/V
hertz Hz: 1 1/s
radian rad: 1 1
percent %: 0.01 1
"""
DEFINITIONS = [(names, float(size), made_of) for names, size, made_of in re.findall(r"^(.+): (\S+) (\S+)$", _TABLE, re.MULTILINE)]
_PREFIXES = "pico p 1e-12, nano n 1e-9, micro µ μ u 1e-6, milli m 1e-3, centi c 1e-2, kilo k 1e3, mega M 1e6, giga G 1e9"
PREFIXES = [("", 1.0), *((name, float(size)) for *names, size in map(str.split, _PREFIXES.split(", ")) for name in names)]
ZERO_OF_SCALE = {"degree_Celsius": 0.0, "degree_Fahrenheit": -160 / 9}  # in degC, of scales that do not begin at absolute zero


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit by its `scale` in SI, the `powers` (m, s, kg, A, K, mol) of its dimension, and the reading in degC at the zero of its
    scale, if it is one of temperature.
    """

    scale: float
    powers: tuple[int, ...]
    zero: float = -ZERO_CELSIUS


BASE_UNITS = {name: Unit(1.0, tuple(int(name == other) for other in BASE)) for name in BASE}


@dataclass(frozen=True, slots=True)
class Dimension:
    """What a key or a column holds: its name in an error message, the unit it is kept in, and an example to follow."""

    name: str
    unit: str
    example: str


TIME = Dimension("a time", "s", "1.5 h")
LENGTH = Dimension("a length", "m", "0.5 mm")
AREA = Dimension("an area", "m^2", "4 cm^2")
TEMPERATURE = Dimension("a temperature", "degC", "20 degC")
TEMPERATURE_DIFFERENCE = Dimension("a temperature difference", "K", "187.1 K")
THERMAL_EXPANSION = Dimension("a thermal expansion coefficient", "1/K", "6e-4 /K")
STRESS = Dimension("a stress or modulus", "Pa", "26 kPa")
COMPLIANCE = Dimension("a compliance", "1/Pa", "1e-6 /Pa")
VISCOSITY = Dimension("a viscosity", "Pa*s", "5 Pa*s")
FREQUENCY = Dimension("a frequency", "Hz", "10 Hz")
ANGULAR_FREQUENCY = Dimension("an angular frequency", "rad/s", "10 rad/s")
STRESS_RATE = Dimension("a stress rate", "Pa/s", "1 kPa/s")
STRAIN = Dimension("a strain", "1", "1 %")
NUMBER = Dimension("a number", "1", "1.5")
STRAIN_RATE = Dimension("a strain rate", "1/s", "12.5 %/s")
FORCE = Dimension("a force", "N", "0.17 N")
FORCE_RATE = Dimension("a force rate", "N/s", "0.01 N/s")
TORQUE = Dimension("a torque", "N*m", "1 mN*m")
STIFFNESS = Dimension("a stiffness", "N/m", "1 N/mm")
MASS = Dimension("a mass", "kg", "5 g")
DENSITY = Dimension("a density", "kg/m^3", "960 kg/m^3")
VOLTAGE = Dimension("a voltage", "V", "2.5 kV")
VOLTAGE_RATE = Dimension("a voltage rate", "V/s", "0.25 kV/s")
FIELD = Dimension("an electric field", "V/m", "48 MV/m")
CHARGE = Dimension("a charge", "C", "20 nC")
CHARGE_DENSITY = Dimension("a charge density", "C/m^2", "2 mC/m^2")
CHARGE_RATE = Dimension("a rate of charge", "A", "5 nC/s")
CHARGE_DENSITY_RATE = Dimension("a rate of charge density", "A/m^2", "0.5 mC/m^2/s")
ENERGY_DENSITY = Dimension("an energy density", "J/m^3", "5 kJ/m^3")
CAPACITANCE = Dimension("a capacitance", "F", "1 nF")
CAPACITANCE_DENSITY = Dimension("a capacitance per area", "F/m^2", "80 nF/m^2")
RESISTANCE = Dimension("a resistance", "ohm", "10 Mohm")
CONDUCTIVITY = Dimension("a conductivity", "S/m", "3e-14 S/m")
PERMITTIVITY = Dimension("a permittivity", "F/m", "3.98e-11 F/m")
MOLAR_ENERGY = Dimension("a molar energy", "J/mol", "120 kJ/mol")

# units that an unknown one may be a misspelling of
_COMMON = (
    *("s", "ms", "min", "h", "d", "m", "mm", "µm", "um", "K", "degC", "°C", "℃", "degF", "°F", "℉"),
    *("Pa", "kPa", "MPa", "GPa", "1/Pa", "/Pa", "1/kPa", "1/MPa", "1/GPa", "Pa*s", "Pa.s", "mPa*s", "mPa.s", "kPa*s"),
    *("Hz", "mHz", "kHz", "rad/s", "kN", "Pa/s", "kPa/s", "MPa/s", "%", "1/s", "/s", "%/s", "%/min", "N", "mN", "N/s", "mN/s"),
    *("V", "kV", "V/s", "kV/s", "V/m", "MV/m", "kV/mm", "F/m", "J/mol", "kJ/mol"),
    *("C", "uC", "nC", "C/m^2", "ohm", "kohm", "Mohm", "Gohm", "S/m"),
)
MISTAKEN = (FORCE, LENGTH, STRESS, STRAIN, TORQUE, STIFFNESS, MASS, TIME, TEMPERATURE, FREQUENCY, ANGULAR_FREQUENCY)
RECOGNISED = (
    *(TIME, LENGTH, TEMPERATURE, STRESS, STRESS_RATE, STRAIN_RATE, FORCE, FORCE_RATE, VOLTAGE, VOLTAGE_RATE, FIELD, STRAIN),
    *(CHARGE, CHARGE_DENSITY, CHARGE_RATE, CHARGE_DENSITY_RATE, RESISTANCE, CONDUCTIVITY),
)

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_COMMA = re.compile(r"(?<![\w.,])[+-]?\d++,(\d++)(?![\w.,]*,)")
# what units are called in other languages, and on the screens of instruments
_OTHERWISE = {"sek": "s", "sekunden": "s", "minuten": "min", "std": "h", "stunden": "h", "tage": "d", "grad": "degC"}
_OTHERWISE |= {"micron": "um", "microns": "um", "pct": "%", "oc": "degC", "c": "degC", "of": "degF", "f": "degF", "rads": "rad/s"}
_WORD = 4  # letters of a unit in full, such as Volt
_QUANTITY = re.compile(rf"({_NUMBER})\s*+(.*+)", re.DOTALL)  # of text without blanks around it
# a name with a small power, and products and quotients of such: units of measurement need no more
_NAME = r"[A-Za-zµμ°%_Ω]+(?:(?:\^|\*\*)?-?[1-9])?"
_UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/·.]\s*{_NAME}|\s+{_NAME})*")
_FACTOR = re.compile(r"(?P<sign>[*/·.\s]*)(?P<name>%|[A-Za-zµμ°_Ω]+)(?:(?:\^|\*\*)?(?P<power>-?[1-9]))?")
_DASHED = re.compile(r"(?<=[A-Za-zµμ°%1-9])-(?=[A-Za-zµμ°])")  # N-m and Pa-s of instruments; s-1 is a power
_SQUARED = re.compile(r"\b(?:square|sq) ([A-Za-zµμ]+)|([A-Za-zµμ]+) squared\b")
_CUBED = re.compile(r"\bcubic ([A-Za-zµμ]+)|([A-Za-zµμ]+) cubed\b")
_DEGREE = re.compile(r"(deg|°)\s+(?=[CF]\b)")
_TYPESET = str.maketrans(
    {"\N{OHM SIGN}": "Ω", "º": "°", "℃": "°C", "℉": "°F", "²": "2", "³": "3", "⁻": "-", "¹": "1", "⋅": "·", "∙": "·"}
)
LONGEST_UNIT = 40  # characters


TEMPERATURES = (1e-100, 1e6)  # degC: no test and no service is hotter
COMPUTABLE = SMALLEST, LARGEST = 1e-100, 1e100
"""Magnitudes between which products of three numbers stay within the range of floating-point numbers."""


def parse(text: Any, dimension: Dimension, within: tuple[float, float] = (0.0, math.inf)) -> float:
    """The quantity `text`, such as "2.5 kV", as a number in `dimension.unit`.

    Raises `InputError` for a bare number, an unknown unit, a wrong dimension, or a value that is neither 0
    nor of a magnitude `within` bounds.
    """
    needed, example = f"{shown(text)}: {dimension.name}", f"such as {shown(dimension.example)}"
    if not isinstance(text, str):
        raise InputError(f"{needed} is needed with its unit, {example}")
    if comma := decimal_comma(text):
        raise InputError(f"{needed} is needed; {comma}")
    match = _QUANTITY.fullmatch(text.strip())
    if match is None:
        raise InputError(f"{needed} is needed, {example}")
    number, unit = match.groups()
    if not unit:
        raise InputError(f"{needed} is needed with its unit, {example}")
    try:
        scale, offset = conversion(unit, dimension)
    except InputError as error:
        raise InputError(f"{shown(text)}: {error}{_weight(float(number), unit) if dimension is FORCE else ''}") from None
    value = float(number) * scale + offset
    if not math.isfinite(value):
        raise InputError(f"{needed} that is finite is needed, {example}")
    if value != 0 and not within[0] <= abs(value) <= within[1]:
        raise InputError(f"{needed} from {within[0]:g} to {within[1]:g} {dimension.unit} is needed")
    return value


def _weight(number: float, unit: str) -> str:
    """What to write instead of a mass where a force is needed; empty if `unit` is not one of mass."""
    mass = parse_unit(unit.removesuffix("f"))
    if mass is None or mass.powers != BASE_UNITS["kg"].powers:
        return ""
    newton = number * mass.scale * GRAVITY
    return f'; is it the weight of {number:g} {unit.removesuffix("f")}? then write "{newton:.4g} N"'


def decimal_comma(text: str) -> str:
    """What to write instead of the first number in `text` with a comma in it; empty if there is none."""
    comma = _COMMA.search(text)
    if comma is None:
        return ""
    thousands = f" or {comma[0].replace(',', '')}" if len(comma[1]) == 3 else ""
    return f"a decimal comma? write {comma[0].replace(',', '.')}{thousands}"


@lru_cache(maxsize=256)
def conversion(unit: str, dimension: Dimension) -> tuple[float, float]:
    """(scale, offset) that take a number in `unit` into `dimension.unit`: converted = number * scale + offset.

    Raises `InputError` for an unknown unit and for one of another dimension.
    """
    try:
        return _conversion(unit, dimension)
    except InputError as error:
        near = _near_unit(unit, dimension)
        if near is None:
            raise
        wrong = str(error) if parse_unit(unit) is not None else f'unknown unit "{unit}"'
        raise InputError(f'{wrong}; did you mean "{near}"?') from None


def _conversion(unit: str, dimension: Dimension) -> tuple[float, float]:
    """The same, without a suggestion."""
    needed = f"{dimension.name} is needed, such as {shown(dimension.example)}"
    if dimension in (STRAIN, NUMBER) and unit in ("", "-", "1"):
        return 1.0, 0.0
    if dimension is TEMPERATURE and unit == "C":  # in the headers of instruments
        unit = "degC"
    parsed, target = parse_unit(unit), parse_unit(dimension.unit)
    if parsed is None:
        raise InputError(f'unknown unit "{unit}"; {needed}')
    if dimension in (FREQUENCY, ANGULAR_FREQUENCY):
        _tell_frequencies_apart(unit, dimension)
    if target is None or parsed.powers != target.powers:
        raise InputError(needed)
    return parsed.scale / target.scale, parsed.zero if dimension is TEMPERATURE else 0.0


def _near_unit(unit: str, dimension: Dimension) -> str | None:
    """The unit of `dimension` that is written otherwise elsewhere, or differs from `unit` in upper and lower case alone.

    None if another can be meant.
    """
    for word in (_OTHERWISE.get(unit.casefold()), unit.casefold() if len(unit) >= _WORD else None):
        if word is not None and converts(word, dimension):
            return word
    near = [common for common in _COMMON if common.casefold() == unit.casefold() and converts(common, dimension)]
    # MPa and mPa, mm and Mm
    doubtful = any(converts(common[0].swapcase() + common[1:], dimension) for common in near if common[0] != unit[0])
    return near[0] if len(near) == 1 and not doubtful else None


def is_ambiguous(unit: str, dimension: Dimension) -> bool:
    """Whether a frequency or an angular frequency is needed and `unit`, such as 1/s, does not say which of them it is."""
    return dimension in (FREQUENCY, ANGULAR_FREQUENCY) and "Hz" not in unit and "rad" not in unit and converts(unit, STRAIN_RATE)


def _tell_frequencies_apart(unit: str, dimension: Dimension) -> None:
    """Hz and rad/s have one dimension and differ by 2 pi: neither is ever taken for the other, nor 1/s for either."""
    needed = f"but {dimension.name} is needed, such as {shown(dimension.example)}"
    if "Hz" in unit and dimension is ANGULAR_FREQUENCY:
        raise InputError(f"{unit} is the unit of a frequency, {needed}")
    if "rad" in unit and dimension is FREQUENCY:
        raise InputError(f"{unit} is the unit of an angular frequency, {needed}")
    if is_ambiguous(unit, dimension):
        raise InputError(f"{unit} may mean a frequency or an angular frequency: state Hz or rad/s")


def recognise(text: str) -> tuple[float, str]:
    """The quantity `text` as a number and the unit that dielast keeps such quantities in; raises `InputError` if it is none."""
    for dimension in RECOGNISED:
        try:
            return parse(text, dimension), dimension.unit
        except InputError:
            continue
    raise InputError(f"{shown(text)}: not a quantity")


def kind_of(unit: str) -> Dimension | None:
    """What the quantity in `unit` is, of those that columns of a test are taken for by mistake; None for any other."""
    return next((dimension for dimension in MISTAKEN if converts(unit, dimension)), None)


def converts(unit: str, dimension: Dimension) -> bool:
    """Whether `unit` is one of the dimension; a sign for none is not."""
    if unit.strip() in ("", "-"):
        return False
    try:
        _conversion(unit, dimension)
    except InputError:
        return False
    return True


def is_unit(text: str) -> bool:
    """Whether `text` is a unit that dielast knows, or a sign for none (as in a CSV's row of units)."""
    sign = text.strip()
    return sign in ("", "-", "1", "C", "°", "deg") or parse_unit(sign) is not None


@lru_cache(maxsize=256)
def parse_unit(text: str) -> Unit | None:
    """The unit written as `text`, such as "N/mm^2", "kg m/s²" or "1/degC"; None if it is unknown.

    Factors are taken from left to right: N/m*s is (N/m)*s. In a product or a power, degC and degF are differences.
    """
    text = text.strip().translate(_TYPESET)
    if len(text) > LONGEST_UNIT:
        return None
    text = _DEGREE.sub(r"\1", _DASHED.sub("*", text))
    text = _CUBED.sub(r"\1\2^3", _SQUARED.sub(r"\1\2^2", text))
    if text == "1":
        return Unit(1.0, (0,) * len(BASE))
    text = f"1{text}" if text.startswith("/") else text
    if _UNIT.fullmatch(text) is None:
        return None
    factors = list(_FACTOR.finditer(text.removeprefix("1")))
    scale, powers, zero, divided = 1.0, [0] * len(BASE), -ZERO_CELSIUS, False
    for factor in factors:
        if factor["name"] == "per":
            divided = True
            continue
        unit = _named_unit(factor["name"])
        if unit is None:
            return None
        power = int(factor["power"] or 1) * (-1 if divided or "/" in factor["sign"] else 1)
        scale = scale * unit.scale**power if power > 0 else scale / unit.scale**-power
        powers = [total + power * exponent for total, exponent in zip(powers, unit.powers, strict=True)]
        zero, divided = (unit.zero if len(factors) == power == 1 else -ZERO_CELSIUS), False
    return None if divided else Unit(scale, tuple(powers), zero)


@lru_cache(maxsize=256)
def _named_unit(text: str) -> Unit | None:
    """The unit of one name, which may have a prefix and the s of a plural."""
    stems = [(text[len(prefix) :], prefix_size) for prefix, prefix_size in PREFIXES if text.startswith(prefix)]
    plurals = [(stem[:-1], prefix_size) for stem, prefix_size in stems if stem.endswith("s") and len(stem) > 2]
    for stem, prefix_size in (*stems, *plurals):
        for names, size, made_of in DEFINITIONS:
            if stem not in names.split():
                continue
            base = BASE_UNITS.get(made_of) or parse_unit(made_of)
            zero = ZERO_OF_SCALE.get(names.split()[0], -ZERO_CELSIUS)
            has_prefix = prefix_size != 1.0
            assert base is not None
            return None if has_prefix and zero != -ZERO_CELSIUS else Unit(prefix_size * size * base.scale, base.powers, zero)
    return None
