"""Names and units of quantities in figures."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

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
    "degC": (("°C", 1.0, 0.0),),
}
MODULUS = "MPa"  # moduli run over many decades, and have one unit in all figures
NAMES = {
    "stretch_1": "stretch",
    "stretch_2": "stretch along axis 2",
    "nominal_stress_1": "nominal stress",
    "nominal_stress_2": "nominal stress along axis 2",
    "true_stress_1": "true stress",
    "true_stress_2": "true stress along axis 2",
    "relative_stretch_1": "relative stretch",
    "relative_stretch_2": "relative stretch along axis 2",
    "stability": "stability det H / det H$_0$",
    "damage": "damage",
}


def unit_for(unit: str, largest: float) -> tuple[str, float]:
    """The unit in figures for quantities of this SI unit with this `largest` magnitude, and the factor from SI."""
    for shown, factor, least in UNITS.get(unit, ((unit, 1.0, 0.0),)):
        if not largest < least:
            return shown, factor
    return unit, 1.0


def axis_of(header: str, values: Iterable[NDArray[np.float64]] = ()) -> tuple[str, float]:
    """The label of an axis that shows these `values` of a column, and the factor from SI into the unit shown."""
    name, _, rest = header.partition(" [")
    unit = rest.rstrip("]")
    called = NAMES.get(name, name.replace("_", " "))
    if name.endswith("modulus") and unit == "Pa":
        return f"{called} [{MODULUS}]", 1e-6
    finite = [np.abs(column[np.isfinite(column)]) for column in values]
    shown, factor = unit_for(unit, max((float(column.max()) for column in finite if column.size), default=np.inf))
    return (f"{called} [{shown}]" if shown not in ("", "1") else called), factor
