"""Numbers, times, temperatures and prestretches as figures print them."""

import re
from collections.abc import Iterable

from dielast.simulate import durations

RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
YEAR, LONG = 365.25 * 86400.0, 1000 * 86400.0  # s
SECONDS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "\N{MICRO SIGN}s"), (1e-9, "ns"))
FIXED = "\N{NO-BREAK SPACE}"


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
