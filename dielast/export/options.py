"""How a card is written: its options and systems of units."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dielast.errors import InputError


@dataclass(frozen=True, slots=True)
class Units:
    """A consistent system of units: factors from SI, and the names of the units."""

    stress: float
    density: float
    molar_energy: float
    names: str


UNITS = {
    "SI": Units(1.0, 1.0, 1.0, "m, kg, s, N, Pa"),
    "mm-t-s": Units(1e-6, 1e-12, 1e3, "mm, tonne, s, N, MPa"),
    "mm-N-MPa": Units(1e-6, 1e-12, 1e3, "mm, tonne, s, N, MPa"),
}
MODULI = ("instantaneous", "long-term")
SCALES = ("degC", "K")


@dataclass(frozen=True, slots=True)
class CardOptions:
    """How a card is written; SI, degC.

    units: "SI", "mm-t-s" or "mm-N-MPa" (equal to mm-t-s). temperature_scale: "degC" or "K", scale of the model's temperatures.
    hyperelastic: None keeps the material's springs; the name of a law, such as "neo-hookean", replaces their law. J_lim: one limit
    for all springs, for codes that take only one. moduli: "instantaneous" or "long-term", for codes that allow both. bulk_modulus
    (Pa) or poisson_ratio (at time zero): for a compressible card; the material is incompressible. density in kg/m^3.
    temperature (degC): temperature of the card for a code that cannot carry the shift law. notes: further lines for the card's
    comments, ASCII. Raises `InputError` for an unknown or contradictory option.
    """

    units: str = "SI"
    temperature_scale: str = "degC"
    hyperelastic: str | None = None
    J_lim: float | None = None
    moduli: str = "instantaneous"
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    density: float | None = None
    temperature: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for key, value, known in (
            ("units", self.units, tuple(UNITS)),
            ("temperature_scale", self.temperature_scale, SCALES),
            ("moduli", self.moduli, MODULI),
        ):
            if value not in known:
                raise InputError(f'"{value}": one of {", ".join(str(name) for name in known if name)} is needed', argument=key)
        for key, number in (("J_lim", self.J_lim), ("bulk_modulus", self.bulk_modulus), ("density", self.density)):
            if number is not None and not 0 < number < math.inf:
                raise InputError(f"{number:g}: a positive number is needed", argument=key)
        if self.poisson_ratio is not None and not 0 <= self.poisson_ratio < 0.5:
            raise InputError(f"{self.poisson_ratio:g}: at least 0 and below 0.5 is needed", argument="poisson_ratio")
        if self.bulk_modulus is not None and self.poisson_ratio is not None:
            raise InputError("state bulk_modulus or poisson_ratio, not both", argument="bulk_modulus")
