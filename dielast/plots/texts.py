"""Numbers, times, temperatures and prestretches as figures print them."""

from __future__ import annotations

import re
from collections.abc import Iterable

from dielast.simulate import durations

SECONDS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "\N{MICRO SIGN}s"), (1e-9, "ns"))
FIXED = "\N{NO-BREAK SPACE}"


def typeset(text: str) -> str:
    """Text for print: minus signs before numbers and in exponents, °C."""
    text = re.sub(r"(?<![\w.)\]])-(?=\.?\d)|(?<=\de)-(?=\d)|(?<=\^)-(?=\d)", "\N{MINUS SIGN}", text)
    return text.replace("degC", "°C").replace("degF", "°F")


def number(value: float, digits: int = 4) -> str:
    """A number to so many digits, for a label."""
    return typeset(f"{value + 0.0:.{digits}g}")


def degrees(temperature: float) -> str:
    """A temperature to a tenth of a degree, for a label."""
    return f"{number(round(temperature, 1), 6)} °C"


def prestretched(pair: Iterable[float]) -> str:
    """The prestretch of axes 1 and 2, as one number if they are equal."""
    first, second = map(float, pair)
    return f"prestretch {number(first)}" + (f" \N{MULTIPLICATION SIGN} {number(second)}" if first != second else "")


def lasting(seconds: float, digits: int = 3) -> str:
    """A time in the largest unit of which it is at least one, for a label."""
    return typeset(durations.lasting(seconds, digits))
