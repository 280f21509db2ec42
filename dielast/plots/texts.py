"""Numbers, times, temperatures, prestretches and quantities with their units as figures print them."""

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from dielast.simulate import durations
from dielast.simulate.quantities import quantity_of

RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
YEAR, LONG = 365.25 * 86400.0, 1000 * 86400.0  # s
SECONDS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "\N{MICRO SIGN}s"), (1e-9, "ns"))
FIXED = "\N{NO-BREAK SPACE}"
# SI unit -> units from the largest to the smallest: name, factor from SI, and the least magnitude for which it is taken
UNITS: dict[str, tuple[tuple[str, float, float], ...]] = {
    "V": (("kV", 1e-3, 100.0), ("V", 1.0, 0.0)),
    "V/m": (("MV/m", 1e-6, 1e5), ("kV/m", 1e-3, 100.0), ("V/m", 1.0, 0.0)),
    "Pa": (("MPa", 1e-6, 1e7), ("kPa", 1e-3, 100.0), ("Pa", 1.0, 0.0)),
    "m": (("mm", 1e3, 1e-5), ("µm", 1e6, 0.0)),
    "C": (("µC", 1e6, 1e-7), ("nC", 1e9, 0.0)),
    "C/m^2": (("mC/m²", 1e3, 0.0),),
    "ohm": (("GΩ", 1e-9, 1e10), ("MΩ", 1e-6, 1e5), ("kΩ", 1e-3, 1e3), ("Ω", 1.0, 0.0)),
    "A": (("mA", 1e3, 1e-4), ("µA", 1e6, 1e-7), ("nA", 1e9, 0.0)),
    "A/m^2": (("A/m²", 1.0, 0.1), ("mA/m²", 1e3, 0.0)),
    "J/m^3": (("kJ/m³", 1e-3, 0.0),),
    "F/m": (("pF/m", 1e12, 0.0),),
    "F": (("µF", 1e6, 1e-7), ("nF", 1e9, 1e-10), ("pF", 1e12, 0.0)),
    "F/m^2": (("µF/m²", 1e6, 1e-7), ("nF/m²", 1e9, 0.0)),
    "degC": (("°C", 1.0, 0.0),),
}
MODULUS = "MPa"  # moduli run over many decades, and have one unit in all figures


def typeset(text: str) -> str:
    """Text for print: minus signs before numbers and in exponents, °C."""
    text = re.sub(r"(?<![\w.)\]])-(?=\.?\d)|(?<=\de)-(?=\d)|(?<=\^)-(?=\d)", "\N{MINUS SIGN}", text)
    return text.replace("degC", "°C").replace("degF", "°F")


def power_of_ten(exponent: int) -> str:
    """Ten to an integer power, for a label."""
    return f"10{str(exponent).translate(RAISED)}"


def number(value: float, digits: int = 4) -> str:
    """A number to so many digits, for a label; with a power of ten if it is below 0.0001 or at least a million."""
    rounded = float(f"{value:.{digits}g}")
    if 1e-4 <= abs(rounded) < 1e6:
        return typeset(f"{rounded:.{max(digits, 6)}g}")
    factor, _, exponent = f"{rounded + 0.0:.{digits}g}".partition("e")
    if not exponent:
        return typeset(factor)
    power = power_of_ten(int(exponent))
    return power if factor == "1" else typeset(f"{factor}\N{MULTIPLICATION SIGN}{power}")


def shortened(text: str, most: int) -> str:
    """A text of at most so many characters that keeps its beginning and its end: names often differ at their ends."""
    if len(text) <= most:
        return text
    end = most // 2
    return f"{text[: most - 1 - end].rstrip()}\N{HORIZONTAL ELLIPSIS}{text[-end:].lstrip()}"


def degrees(temperature: float) -> str:
    """A temperature to a tenth of a degree, for a label."""
    return f"{number(round(temperature, 1), 6)} °C"


def prestretched(pair: Iterable[float]) -> str:
    """The prestretch of axes 1 and 2, as one number if they are equal."""
    first, second = map(float, pair)
    return f"prestretch {number(first)}" + (f" \N{MULTIPLICATION SIGN} {number(second)}" if first != second else "")


def lasting(seconds: float, digits: int = 3) -> str:
    """A time in the largest unit of which it is at least one, for a label; more than a thousand days in years."""
    return typeset(durations.lasting(seconds, digits)) if seconds < LONG else f"{number(seconds / YEAR, digits)} years"


def unit_for(unit: str, largest: float) -> tuple[str, float]:
    """The unit in figures for quantities of this SI unit with this `largest` magnitude, and the factor from SI."""
    for shown, factor, least in UNITS.get(unit, ((unit, 1.0, 0.0),)):
        if not largest < least:
            return shown, factor
    return unit, 1.0


def axis_of(header: str, values: Iterable[NDArray[np.float64]] = ()) -> tuple[str, float]:
    """The label of an axis that shows these `values` of a column, and the factor from SI into the unit shown."""
    name, _, rest = header.partition(" [")
    unit, quantity = rest.rstrip("]"), quantity_of(header)
    called = name.replace("_", " ") if quantity is None or not quantity.label else quantity.label
    if name.endswith("modulus") and unit == "Pa":
        return f"{called} [{MODULUS}]", 1e-6
    finite = [np.abs(column[np.isfinite(column)]) for column in values]
    shown, factor = unit_for(unit, max((float(column.max()) for column in finite if column.size), default=np.inf))
    return (f"{called} [{shown}]" if shown not in ("", "1") else called), factor
