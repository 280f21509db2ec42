"""Numbers, times, temperatures and quantities with their units as figures print them, and the ticks and labels of axes."""

import re
from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from dielast.simulate import quantities

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
    return typeset(quantities.lasting(seconds, digits)) if seconds < LONG else f"{number(seconds / YEAR, digits)} years"


def unit_for(unit: str, largest: float) -> tuple[str, float]:
    """The unit in figures for quantities of this SI unit with this `largest` magnitude, and the factor from SI."""
    for shown, factor, least in UNITS.get(unit, ((unit, 1.0, 0.0),)):
        if not largest < least:
            return shown, factor
    return unit, 1.0


def axis_of(header: str, values: Iterable[NDArray[np.float64]] = ()) -> tuple[str, float]:
    """The label of an axis that shows these `values` of a column, and the factor from SI into the unit shown."""
    name, _, rest = header.partition(" [")
    unit, quantity = rest.rstrip("]"), quantities.quantity_of(header)
    called = name.replace("_", " ") if quantity is None or not quantity.label else quantity.label
    if name.endswith("modulus") and unit == "Pa":
        return f"{called} [{MODULUS}]", 1e-6
    finite = [np.abs(column[np.isfinite(column)]) for column in values]
    shown, factor = unit_for(unit, max((float(column.max()) for column in finite if column.size), default=np.inf))
    return (f"{called} [{shown}]" if shown not in ("", "1") else called), factor


DIGIT = 0.636  # width of a digit over the size of the font, DejaVu Sans


def remainder(label: str, offset: float, power: int) -> str:
    """The `label` of an axis, the numbers at which are those of the quantity less an `offset` and in units of a `power` of ten."""
    name, bracket, unit = label.partition(" [")
    if offset:
        sign = "\N{MINUS SIGN}" if offset > 0 else "+"
        name += f" {sign} {number(abs(offset), 12)}"
    if power:
        unit = " ".join(filter(None, (power_of_ten(power), unit.rstrip("]"))))
    return f"{name} [{unit.rstrip(']')}]" if bracket or power else name


def clear_ticks(axes: Axes) -> bool:
    """Fewer ticks on a linear x axis whose numbers would run into each other; returns whether there are fewer now."""
    if not isinstance(axes.xaxis.get_major_locator(), MaxNLocator):
        return False
    low, high = axes.get_xlim()
    ticks = [tick for tick in axes.get_xticks() if low <= tick <= high]
    longest = max(map(len, axes.xaxis.get_major_formatter().format_ticks(ticks)), default=0)
    size = float(axes.xaxis.get_major_ticks(1)[0].label1.get_fontsize())  # points
    wide = (longest + 1) * DIGIT * size / 72  # inches
    across = axes.bbox.width / axes.figure.dpi
    apart = across * float(np.min(np.diff(ticks), initial=np.inf)) / (high - low)
    if apart < wide:
        axes.locator_params(axis="x", nbins=max(int(across / wide), 1))
    return apart < wide


def log_axis(axes: Axes, which: str, *, narrow: bool = False) -> None:
    """A decimal log axis whose major ticks stay apart over many decades, with minor ticks if they fit; fewer labels if `narrow`."""
    scale, axis = (axes.set_xscale, axes.xaxis) if which == "x" else (axes.set_yscale, axes.yaxis)
    scale("log")
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    decades = float(np.log10(high) - np.log10(low)) if low > 0 and high > low else 1.0
    if decades > 7:
        axis.set_major_locator(LogLocator(base=10 ** int(np.ceil(decades / 7)), numticks=20))
        axis.set_minor_locator(LogLocator(base=10, numticks=60))
    else:
        axis.set_minor_locator(LogLocator(base=10, subs=tuple(range(2, 10)), numticks=60))
    if decades >= 2:
        axis.set_minor_formatter(NullFormatter())
        # an empty label takes as long to place as a word
        axis.set_tick_params(which="minor", **{"labelbottom" if which == "x" else "labelleft": False})
        return

    def plain(value: float, _: float | None = None) -> str:
        first = f"{value:.12e}"[0]
        return number(value) if decades < 0.4 or first in ("12357" if decades < 0.8 else "13" if narrow else "125") else ""

    axis.set_major_formatter(plain)
    axis.set_minor_formatter(plain)


def limits(shown: tuple[float, float], above: float, below: float) -> tuple[float, float]:
    """The ends of a log axis of time with strips for films that live longer or fail at once; `above` and `below` are their shares
    of the height of the axes.
    """
    decades = np.log10(shown[1] / shown[0]) / (1 - above - below)
    return float(shown[0] * 10 ** (-decades * below)), float(shown[1] * 10 ** (decades * above))


def ticks_within(axes: Axes, shown: tuple[float, float]) -> None:
    """Remove ticks from the strips, which have no times."""
    for locate, ticks in (
        (axes.yaxis.set_major_locator, axes.get_yticks()),
        (axes.yaxis.set_minor_locator, axes.get_yticks(minor=True)),
    ):
        locate(FixedLocator([tick for tick in ticks if shown[0] <= tick <= shown[1]]))
