"""Names and units of quantities in figures."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from dielast.io.table import spoken
from dielast.simulate.quantities import quantity_of

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
    called = spoken(name) if quantity is None or not quantity.label else quantity.label
    if name.endswith("modulus") and unit == "Pa":
        return f"{called} [{MODULUS}]", 1e-6
    finite = [np.abs(column[np.isfinite(column)]) for column in values]
    shown, factor = unit_for(unit, max((float(column.max()) for column in finite if column.size), default=np.inf))
    return (f"{called} [{shown}]" if shown not in ("", "1") else called), factor
