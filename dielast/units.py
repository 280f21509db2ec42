"""Quantities with units, read into SI (temperatures into degC) through a small pint registry.

The registry is our own short list rather than pint's full one, which takes longer to load than a simulation takes to run.
Nothing is guessed: a bare number where a dimension is needed is an error, and so is a unit of another dimension.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from dielast.errors import InputError, shown

if TYPE_CHECKING:
    import pint

ZERO_CELSIUS = 273.15  # K
GRAVITY = 9.80665  # m/s^2, standard acceleration
TIMES = (1e-15, 1e15)  # s: from less than a bond's vibration to 30 million years, where no test and no service begins or ends

DEFINITIONS = """
pico- = 1e-12 = p-
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = μ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m = metre
second = [time] = s = sec
kilogram = [mass] = kg
ampere = [current] = A
kelvin = [temperature]; offset: 0 = K
mole = [substance] = mol
gram = 1e-3 * kilogram = g
degree_Celsius = kelvin; offset: 273.15 = degC = °C = degreeC = celsius
degree_Fahrenheit = 5 / 9 * kelvin; offset: 255.3722222222222 = degF = °F = degreeF = fahrenheit
minute = 60 * second = min
hour = 60 * minute = h = hr
day = 24 * hour = d
week = 7 * day
newton = kilogram * meter / second ** 2 = N
gram_force = 9.80665e-3 * newton = gf
kilogram_force = 9.80665 * newton = kgf
pound_force = 4.4482216152605 * newton = lbf
inch = 0.0254 * meter = in
pascal = newton / meter ** 2 = Pa
bar = 1e5 * pascal = bar
psi = 6894.757293168361 * pascal = psi
dyne = 1e-5 * newton = dyn
joule = newton * meter = J
watt = joule / second = W
volt = watt / ampere = V
coulomb = ampere * second = coul
farad = ampere * second / volt = F
hertz = 1 / second = Hz
radian = [] = rad
percent = 0.01 = %
"""


@dataclass(frozen=True, slots=True)
class Dimension:
    """What a key or a column holds: its name in an error message, the unit it is kept in, and an example to follow."""

    name: str
    unit: str
    example: str


TIME = Dimension("a time", "s", "1.5 h")
LENGTH = Dimension("a length", "m", "0.5 mm")
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
VOLTAGE = Dimension("a voltage", "V", "2.5 kV")
VOLTAGE_RATE = Dimension("a voltage rate", "V/s", "0.25 kV/s")
FIELD = Dimension("an electric field", "V/m", "48 MV/m")
PERMITTIVITY = Dimension("a permittivity", "F/m", "3.98e-11 F/m")
MOLAR_ENERGY = Dimension("a molar energy", "J/mol", "120 kJ/mol")

# The units that recipes use most, by the unit each is kept in: pint, which takes as long to load as a simulation takes to run, is
# then not needed. A test holds every entry to pint's own answer.
COMMON: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "m": {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "um": 1e-6},
    "K": {"K": 1.0},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "1/Pa": {"1/Pa": 1.0, "/Pa": 1.0, "1/kPa": 1e-3, "1/MPa": 1e-6, "1/GPa": 1e-9},
    "Pa*s": {"Pa*s": 1.0, "Pa.s": 1.0, "mPa*s": 1e-3, "mPa.s": 1e-3, "kPa*s": 1e3},
    "Hz": {"Hz": 1.0, "mHz": 1e-3, "kHz": 1e3},
    "rad/s": {"rad/s": 1.0},
    "Pa/s": {"Pa/s": 1.0, "kPa/s": 1e3, "MPa/s": 1e6},
    "1": {"%": 0.01},
    "1/s": {"1/s": 1.0, "/s": 1.0, "%/s": 0.01, "%/min": 0.01 / 60},
    "N": {"N": 1.0, "mN": 1e-3},
    "N/s": {"N/s": 1.0, "mN/s": 1e-3},
    "V": {"V": 1.0, "kV": 1e3},
    "V/s": {"V/s": 1.0, "kV/s": 1e3},
    "V/m": {"V/m": 1.0, "MV/m": 1e6, "kV/mm": 1e6},
    "F/m": {"F/m": 1.0},
    "J/mol": {"J/mol": 1.0, "kJ/mol": 1e3},
}
# Scales with a zero of their own: (scale, offset) into degC by the registry's name, and the names of those that recipes use most.
SCALES = {"degree_Celsius": (1.0, 0.0), "degree_Fahrenheit": (5 / 9, -160 / 9)}
TEMPERATURES = dict.fromkeys(("degC", "°C", "℃"), "degree_Celsius") | dict.fromkeys(("degF", "°F", "℉"), "degree_Fahrenheit")
MISTAKEN = (FORCE, LENGTH, STRESS, STRAIN, TORQUE, STIFFNESS, MASS, TIME, TEMPERATURE, FREQUENCY, ANGULAR_FREQUENCY)
RECOGNISED = (TIME, LENGTH, TEMPERATURE, STRESS, STRESS_RATE, STRAIN_RATE, FORCE, FORCE_RATE, VOLTAGE, VOLTAGE_RATE, FIELD, STRAIN)

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_COMMA = re.compile(r"(?<![\w.,])[+-]?\d++,(\d++)(?![\w.,]*,)")
# what is no unit, and what it stands for in the languages of those who write it
_ABROAD = {"sek": "s", "sekunden": "s", "minuten": "min", "std": "h", "stunden": "h", "tage": "d", "grad": "degC"}
_QUANTITY = re.compile(rf"({_NUMBER})\s*+(.*+)", re.DOTALL)  # of text without blanks around it
# names, small powers, products and quotients: all that units of measure need, and nothing that a parser could choke on
_NAME = r"[A-Za-zµμ°%_]+(?:(?:\^|\*\*)?-?[1-9])?"
_DASHED = re.compile(r"(?<=[A-Za-zµμ°%1-9])-(?=[A-Za-zµμ°])")  # N-m and Pa-s of instruments; s-1 is a power
_TYPESET = str.maketrans({"º": "°", "℃": "°C", "℉": "°F", "²": "2", "³": "3", "⁻": "-", "¹": "1", "⋅": "·", "∙": "·"})
_UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/·.]\s*{_NAME}|\s+{_NAME})*")


def parse(text: Any, dimension: Dimension) -> float:
    """The quantity `text`, such as "2.5 kV", as a number in `dimension.unit`.

    Raises `InputError` for a bare number, an unknown unit, a wrong dimension or a value that is not finite.
    """
    if not isinstance(text, str):
        raise InputError(f"{shown(text)}: {dimension.name} is needed with its unit, such as {shown(dimension.example)}")
    match = _QUANTITY.fullmatch(text.strip())
    if comma := decimal_comma(text):
        raise InputError(f"{shown(text)}: {dimension.name} is needed; {comma}")
    if match is None:
        raise InputError(f"{shown(text)}: {dimension.name} is needed, such as {shown(dimension.example)}")
    number, unit = match.groups()
    if not unit:
        raise InputError(f"{shown(text)}: {dimension.name} is needed with its unit, such as {shown(dimension.example)}")
    try:
        scale, offset = conversion(unit, dimension)
    except InputError as error:
        raise InputError(f"{shown(text)}: {error}{_weight(float(number), unit) if dimension is FORCE else ''}") from None
    value = float(number) * scale + offset
    if not math.isfinite(value):
        raise InputError(f"{shown(text)}: {dimension.name} that is finite is needed, such as {shown(dimension.example)}")
    return value


def _weight(number: float, unit: str) -> str:
    """What to write instead of a mass where a force is needed; empty if it is none."""
    mass, kilogram = _parse_unit(unit.removesuffix("f")), _parse_unit("kg")
    if mass is None or kilogram is None or mass.dimensionality != kilogram.dimensionality:
        return ""
    newton = number * float(_registry().Quantity(1.0, mass).to(kilogram).magnitude) * GRAVITY
    return f'; is it the weight of {number:g} {unit.removesuffix("f")}? then write "{newton:.4g} N"'


def decimal_comma(text: str) -> str:
    """What to write instead of the first number in `text` with a comma in it; empty if there is none."""
    found = _COMMA.search(text)
    if found is None:
        return ""
    thousands = f" or {found[0].replace(',', '')}" if len(found[1]) == 3 else ""
    return f"a decimal comma? write {found[0].replace(',', '.')}{thousands}"


@lru_cache(maxsize=256)
def conversion(unit: str, dimension: Dimension) -> tuple[float, float]:
    """(scale, offset) that take a number in `unit` into `dimension.unit`: converted = number * scale + offset."""
    if dimension is TEMPERATURE:
        if (scale := TEMPERATURES.get(unit.replace(" ", ""))) is not None:  # "deg C" and "° C" are one unit, no product
            return SCALES[scale]
    elif unit in COMMON.get(dimension.unit, ()):
        return COMMON[dimension.unit][unit], 0.0
    return convert_by_pint(unit, dimension)


def convert_by_pint(unit: str, dimension: Dimension) -> tuple[float, float]:
    """The same for any unit that the registry knows."""
    wanted = f"{dimension.name} is needed, such as {shown(dimension.example)}"
    if dimension in (STRAIN, NUMBER) and unit in ("", "-", "1"):
        return 1.0, 0.0
    if dimension is TEMPERATURE and unit == "C":  # instruments' headers; no charge is ever meant where a temperature is wanted
        unit = "degC"
    parsed = _parse_unit(unit)
    if parsed is None:
        near = _near_unit(unit, dimension)
        raise InputError(f'unknown unit "{unit}"; ' + (f'did you mean "{near}"?' if near else wanted))
    if dimension in (FREQUENCY, ANGULAR_FREQUENCY):
        _tell_frequencies_apart(unit, dimension)
    target = _parse_unit(dimension.unit)
    if target is None or parsed.dimensionality != target.dimensionality:
        raise InputError(wanted)
    quantity = _registry().Quantity
    if dimension is TEMPERATURE:
        return SCALES.get(str(parsed)) or (float(quantity(1.0, parsed).to("kelvin").magnitude), -ZERO_CELSIUS)
    if dimension is TEMPERATURE_DIFFERENCE and str(parsed) in SCALES:
        return SCALES[str(parsed)][0], 0.0
    return float(quantity(1.0, parsed).to(target).magnitude), 0.0


def _near_unit(unit: str, dimension: Dimension) -> str | None:
    """The common unit of `dimension` that differs from `unit` in upper and lower case alone, if no other can be meant."""
    known = TEMPERATURES if dimension is TEMPERATURE else COMMON.get(dimension.unit, {})
    if (abroad := _ABROAD.get(unit.casefold())) in known:
        return abroad
    near = [own for own in known if own.casefold() == unit.casefold()]
    # MPa and mPa, mm and Mm
    doubtful = any(_parse_unit(own[0].swapcase() + own[1:]) is not None for own in near if own[0] != unit[0])
    return near[0] if len(near) == 1 and not doubtful else None


def is_ambiguous(unit: str, dimension: Dimension) -> bool:
    """Whether a frequency or an angular frequency is wanted and `unit`, such as 1/s, does not say which of them it is."""
    return dimension in (FREQUENCY, ANGULAR_FREQUENCY) and "Hz" not in unit and "rad" not in unit and _is_rate(unit)


def _tell_frequencies_apart(unit: str, dimension: Dimension) -> None:
    """Hz and rad/s have one dimension and differ by 2 pi: neither is ever taken for the other, nor 1/s for either."""
    needed = f"but {dimension.name} is needed, such as {shown(dimension.example)}"
    if "Hz" in unit and dimension is ANGULAR_FREQUENCY:
        raise InputError(f"{unit} is the unit of a frequency, {needed}")
    if "rad" in unit and dimension is FREQUENCY:
        raise InputError(f"{unit} is the unit of an angular frequency, {needed}")
    if is_ambiguous(unit, dimension):
        raise InputError(f"{unit} may mean a frequency or an angular frequency: say Hz or rad/s")


def _is_rate(unit: str) -> bool:
    parsed, rate = _parse_unit(unit), _parse_unit("1/s")
    return parsed is not None and rate is not None and parsed.dimensionality == rate.dimensionality


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
    return next((dimension for dimension in MISTAKEN if _converts(unit, dimension)), None)


def _converts(unit: str, dimension: Dimension) -> bool:
    if unit.strip() in ("", "-"):
        return False
    try:
        conversion(unit, dimension)
    except InputError:
        return False
    return True


def is_unit(text: str) -> bool:
    """Whether `text` is a unit that dielast knows, or a sign for none (as in a CSV's row of units)."""
    sign = text.strip()
    return sign in ("", "-", "1", "C", "°", "deg") or sign.replace(" ", "") in TEMPERATURES or _parse_unit(sign) is not None


@lru_cache(maxsize=256)
def _parse_unit(unit: str) -> Any | None:
    text = _DASHED.sub("*", unit.strip().translate(_TYPESET))
    if text == "1":
        return _registry().Unit("")
    if text.startswith("/"):
        text = "1" + text
    if len(text) > 40 or _UNIT.fullmatch(text) is None:
        return None
    text = re.sub(r"(?<=[A-Za-z])(?=-?[1-9])", "**", re.sub(r"[·.]", "*", text)).replace("****", "**")
    import pint

    try:
        return _registry().parse_units(text)
    except (pint.PintError, ValueError, TypeError, AttributeError, KeyError):
        return None


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry(DEFINITIONS.strip().splitlines(), autoconvert_offset_to_baseunit=True)
