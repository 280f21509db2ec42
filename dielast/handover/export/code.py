"""How a card is written, what a finite-element code can represent, and a material as a card of the code states it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, Mistakes, Problem
from dielast.material.argument_types import checked
from dielast.material.shift import ShiftLaw, kelvin
from dielast.material.springs import CardForm, SpringLaw

LARGEST_LOSS = 1e-7  # of the equilibrium modulus, in a code that takes it for one minus the sum of ratios
Lines = list[str]


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


@checked
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
        wrong = Mistakes()
        for key, value, known in (
            ("units", self.units, tuple(UNITS)),
            ("temperature_scale", self.temperature_scale, SCALES),
            ("moduli", self.moduli, MODULI),
        ):
            if value not in known:
                names = ", ".join(str(name) for name in known if name)
                wrong.append(Problem(f'"{value}": one of {names} is needed', argument=key))
        for key, number in (("J_lim", self.J_lim), ("bulk_modulus", self.bulk_modulus), ("density", self.density)):
            if number is not None and not 0 < number < math.inf:
                wrong.append(Problem(f"{number:g}: a positive number is needed", argument=key))
        if self.poisson_ratio is not None and not 0 <= self.poisson_ratio < 0.5:
            wrong.append(Problem(f"{self.poisson_ratio:g}: at least 0 and below 0.5 is needed", argument="poisson_ratio"))
        if self.bulk_modulus is not None and self.poisson_ratio is not None:
            wrong.append(Problem("state bulk_modulus or poisson_ratio, not both", argument="bulk_modulus"))
        wrong.refuse()


@dataclass(frozen=True, slots=True)
class Code:
    """A finite-element code, and how its files are written.

    `springs` and `shifts` hold the spring and shift laws of the code by name, each with the function that writes its lines, given
    the `CardForm` or the shift law, and the card. `write` makes the files (name -> ASCII text) of a card.
    `most_terms`: the largest number of branches. `flows`: whether a material may lack an equilibrium modulus. `separate_limits`:
    whether the branches may have other constants than the equilibrium spring. `poisson_ratio`: at time zero, where the code must
    have a bulk modulus and none is stated; None where a card can be incompressible. `absolute`: shift laws that are written for
    absolute temperatures only. `units`: the one system of units of its cards; None leaves the choice. `most_exponents`: the largest
    number of terms of an Ogden spring. `unlike`: laws of springs that the code has under the same name with another equation, and
    how they differ.
    """

    name: str
    springs: Mapping[str, Callable[[CardForm, Card], Lines]]
    shifts: Mapping[str, Callable[[Any, Card], Lines]]
    write: Callable[[Card], dict[str, str]]
    most_terms: int | None = None
    flows: bool = False
    separate_limits: bool = False
    poisson_ratio: float | None = None
    absolute: tuple[str, ...] = ()
    units: str | None = None
    most_exponents: int | None = None
    unlike: Mapping[str, str] = field(default_factory=dict)


def number(value: float) -> str:
    """15 significant digits, fewer where that would take more than the 20 characters that Abaqus reads."""
    return next(text for digits in range(15, 0, -1) if len(text := f"{value:.{digits}g}") <= 20)


def rows_of(numbers: Iterable[str], width: int) -> list[tuple[str, ...]]:
    """The numbers in rows of at most so many."""
    rest = iter(numbers)
    return list(iter(lambda: tuple(islice(rest, width)), ()))


def ogden_terms(spring: CardForm) -> list[tuple[float, float]]:
    """mu_p and alpha_p of the terms of an Ogden spring, in the form mu_p/alpha_p."""
    constants = spring.constants
    return [(constants[f"mu_{term}"], constants[f"alpha_{term}"]) for term in range(1, len(constants) // 2 + 1)]


@dataclass(frozen=True, slots=True, eq=False)
class Card:
    """A material as a card states it, in the card's units; temperatures in degC.

    `law` is the code's name of the springs that `equilibrium_law` and `branch_law` are written as. `modulus` and `time` are of
    shape (n,), slowest first. `bulk` is None for an incompressible card.
    """

    code: Code
    options: CardOptions
    name: str
    law: str
    equilibrium_law: SpringLaw
    branch_law: SpringLaw
    equilibrium: float
    modulus: NDArray[np.float64]
    time: NDArray[np.float64]
    shift: ShiftLaw
    bulk: float | None
    density: float | None
    notes: tuple[str, ...] = field(repr=False)

    @property
    def units(self) -> Units:
        """The units of the numbers."""
        return UNITS[self.options.units]

    @property
    def instantaneous(self) -> float:
        """Shear modulus at time zero."""
        return math.fsum((self.equilibrium, *self.modulus.tolist()))

    def compressibilities(self, terms: int) -> list[float]:
        """2/K, zero for an incompressible card, for a volumetric energy of so many `terms`, of which all but the first are zero."""
        return [0.0 if self.bulk is None else 2 / self.bulk, *[0.0] * (terms - 1)]

    @property
    def branches(self) -> list[tuple[float, float]]:
        """Modulus and relaxation time of every branch."""
        return list(zip(self.modulus.tolist(), self.time.tolist(), strict=True))

    @property
    def default_bulk(self) -> list[str]:
        """A comment on a bulk modulus that the options do not state."""
        stated = self.options.bulk_modulus is not None or self.options.poisson_ratio is not None
        return [] if stated else [f"by default from Poisson's ratio {self.code.poisson_ratio:g} at time zero."]

    def spring_lines(self, modulus: float) -> Lines:
        """The lines of the elastic spring, of a shear `modulus` in the card's units."""
        form = self.equilibrium_law.form(self.law, modulus)
        assert form is not None  # `prepare` has seen to it
        return self.code.springs[self.law](form, self)

    def shift_lines(self) -> Lines:
        """The lines of the shift law; none where relaxation times hold at one temperature only."""
        return self.code.shifts[self.shift.name](self.shift, self) if self.shift.depends_on_temperature else []

    def shift_data(self, *constants: float) -> list[str]:
        """The reference temperature of the shift law, and its `constants` in the card's units."""
        return [self.temperature(self.shift.reference_temperature), *map(number, constants)]

    def temperature(self, value: float) -> str:
        """A temperature in degC as a number on the model's scale."""
        return number(kelvin(value) if self.options.temperature_scale == "K" else value)

    def ratios_below_one(self) -> list[str]:
        """Modulus of every branch over the instantaneous one, as it is written.

        Raises `InputError` if one minus their sum no longer gives the equilibrium modulus.
        """
        written = [number(value / self.instantaneous) for value in self.modulus.tolist()]
        rest, wanted = math.fsum((1.0, *(-float(text) for text in written))), self.equilibrium / self.instantaneous
        if abs(rest - wanted) > LARGEST_LOSS * wanted:
            raise InputError(
                f"{self.code.name} takes one minus the sum of the ratios for the equilibrium modulus, which is "
                f"only {wanted:.2g} of the instantaneous one and would be lost in rounding: keep fewer branches ([truncate] keep)",
                argument="formats",
            )
        return written
