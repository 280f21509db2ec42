"""The columns of results over time, each stated once: what it is called, its unit, how it follows from what was solved, and its
axis in figures. Tables, comparisons, figures and bounds take what they need from here; a column more is an entry more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.material.laws_of_cases import log_ratio
from dielast.mechanics.point_material import PointMaterial
from dielast.numerics.arrays import Floats
from dielast.simulate.record import ELECTRICAL, Record

if TYPE_CHECKING:
    from dielast.simulate.events import Event
    from dielast.simulate.wiring import Wiring

ON_REQUEST = "output.electrical = true"
SOURCE, LEAKAGE = "[source]", "[leakage]"
DURATIONS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (1.0, "s"), (1e-3, "ms"), (1e-6, "\N{MICRO SIGN}s"), (1e-9, "ns"))
ELECTRODE = "the size of the electrode: state film.electrode_diameter"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A column of a result.

    `of` gives its values (cases, times) in the SI `unit` from what was solved, `SolvedTests` or `SolvedFilms`, None where it does
    not apply. `label` is its name on an axis, by default `name` in words. A quantity that `falls` towards a failure is below its
    lower bound in a draw that has failed; others are above their upper bound. `needs` is what a recipe must state for it, `only`
    the kind of recipe that has it. Quantities that are not `written` can be compared and drawn, but are not in the table. `at` is
    the value at an event of a film, from the stretches when the voltage begins; without it, the table is interpolated.
    """

    name: str
    unit: str
    of: Callable[[Any], Floats | None]
    label: str = ""
    falls: bool = False
    needs: tuple[str, ...] = ()
    only: str = ""
    written: bool = True
    at: Callable[[Event, tuple[float, float]], float] | None = None

    @property
    def header(self) -> str:
        """The header of the column, `name [unit]`."""
        return f"{self.name} [{self.unit}]"


@dataclass(frozen=True, slots=True, eq=False)
class SolvedTests:
    """Mechanical tests: their `record`, and whether they are relaxation under uniaxial stretch."""

    record: Record
    relaxes: bool

    def relaxation_modulus(self) -> Floats | None:
        """Nominal stress over (stretch - 1) in axis 1; NaN at stretch 1, where it is undefined."""
        strain = self.record.stretch[0] - 1
        return self.record.nominal_stress[0] / np.where(strain != 0, strain, np.nan) if self.relaxes else None


@dataclass(frozen=True, slots=True, eq=False)
class SolvedFilms:
    """Films (cases,) under voltage: their `record`, `thickness` in m, and, when the voltage begins, `begin` (2, cases), the
    stretches, and `determinant` of pull-in.

    `stored` (cases,) is the energy in J/m^3 stored then. `prestretch` (2, cases) is that which was stated, 1 for an axis with a
    weight. `with_damage` (cases,) is 1 for films with a damage law and NaN for others, None if there is none.
    """

    record: Record
    points: PointMaterial
    wiring: Wiring
    thickness: Floats
    prestretch: Floats
    begin: Floats
    determinant: Floats
    with_damage: Floats | None
    stored: Floats

    def electrical(self, *names: str) -> Floats | None:
        """The sum of rows of `ELECTRICAL` in the record."""
        return np.asarray(sum(self.record.electrical[ELECTRICAL.index(name)] for name in names)) if self.wiring.electrical else None

    def dissipated(self) -> Floats | None:
        """The energy that the dashpots have turned into heat: what source and edges have done, less what leaked, was lost in the
        resistance, or is stored.
        """
        done, rest = self.electrical("work", "mechanical"), self.electrical("leaked", "lost", "stored")
        return None if done is None or rest is None else done - rest + self.stored[:, None]

    def relative(self, axis: int) -> Floats:
        """The stretch of an axis relative to that when the voltage begins."""
        return np.asarray(self.record.stretch[axis] / self.begin[axis, :, None])

    def damage(self) -> Floats | None:
        """The damage of films with a damage law."""
        return None if self.with_damage is None else self.record.exposed[0] * self.with_damage[:, None]

    def if_stated(self, argument: str, values: Floats | None) -> Floats | None:
        """The values, if the argument is stated."""
        return values if argument in self.wiring.stated else None

    def of_source(self) -> Floats | None:
        """The voltage of a source with a resistance."""
        field = self.electrical("source")
        return None if field is None else self.if_stated("resistance", field * self.thickness[:, None])

    def on_electrode(self, density: Floats | None) -> Floats | None:
        """What an electrode of known size has in all, from its value per undeformed area."""
        area = self.wiring.area
        return None if density is None or area is None else density * area[:, None]

    def capacitance(self) -> Floats:
        """The charge over the voltage, per undeformed area, in F/m^2: eps (stretch_1 stretch_2)^2 / thickness, where eps is the
        permittivity at these stretches.
        """
        cases, rows = self.record.time.shape
        log_squared, every = self.record.values[:2].reshape(2, -1), np.repeat(np.arange(cases), rows)
        permittivity = self.points.permittivity[every]
        if self.points.stretching:
            permittivity = permittivity * np.exp(log_ratio(self.points.stretching.take(every), log_squared)[0])
        capacity = (permittivity * np.exp(log_squared[0] + log_squared[1])).reshape(cases, rows)
        return np.asarray(capacity / self.thickness[:, None])

    def axis(self, choose: np.ufunc) -> Floats | None:
        """The largest or smallest diameter in m of an electrode that is a circle on the prestretched film."""
        if self.wiring.area is None:
            return None
        diameter = 2 * np.sqrt(self.wiring.area * self.prestretch[0] * self.prestretch[1] / np.pi)
        return np.asarray(choose(self.relative(0), self.relative(1)) * diameter[:, None])


TESTS: list[Quantity] = [
    Quantity("time", "s", lambda test: test.record.time),
    Quantity("stretch_1", "1", lambda test: test.record.stretch[0], "stretch"),
    Quantity("stretch_2", "1", lambda test: test.record.stretch[1], "stretch along axis 2"),
    Quantity("nominal_stress_1", "Pa", lambda test: test.record.nominal_stress[0], "nominal stress", falls=True),
    Quantity("nominal_stress_2", "Pa", lambda test: test.record.nominal_stress[1], "nominal stress along axis 2", falls=True),
    Quantity("true_stress_1", "Pa", lambda test: test.record.nominal_stress[0] * test.record.stretch[0], "true stress"),
    Quantity(
        "true_stress_2", "Pa", lambda test: test.record.nominal_stress[1] * test.record.stretch[1], "true stress along axis 2"
    ),
    Quantity("relaxation_modulus", "Pa", SolvedTests.relaxation_modulus, only="relax"),
]
"""The columns of `relax` and `creep`, in order."""

FILMS: list[Quantity] = [
    Quantity("time", "s", lambda film: film.record.time, at=lambda event, _: event.time),
    Quantity("voltage", "V", lambda film: film.record.field * film.thickness[:, None], at=lambda event, _: event.voltage),
    Quantity("stretch_1", "1", lambda film: film.record.stretch[0], "stretch", at=lambda event, _: event.stretch_1),
    Quantity("stretch_2", "1", lambda film: film.record.stretch[1], "stretch along axis 2", at=lambda event, _: event.stretch_2),
    Quantity(
        "relative_stretch_1",
        "1",
        lambda film: film.relative(0),
        "relative stretch",
        at=lambda event, begin: event.stretch_1 / begin[0],
    ),
    Quantity(
        "relative_stretch_2",
        "1",
        lambda film: film.relative(1),
        "relative stretch along axis 2",
        at=lambda event, begin: event.stretch_2 / begin[1],
    ),
    Quantity("nominal_stress_1", "Pa", lambda film: film.record.nominal_stress[0], "nominal stress", falls=True),
    Quantity("nominal_stress_2", "Pa", lambda film: film.record.nominal_stress[1], "nominal stress along axis 2", falls=True),
    Quantity(
        "true_field",
        "V/m",
        lambda film: film.record.field * film.record.stretch[0] * film.record.stretch[1],
        at=lambda event, _: event.true_field,
    ),
    Quantity(
        "stability",
        "1",
        lambda film: film.record.determinant / np.abs(film.determinant[:, None]),  # negative from the start if unstable
        "stability det H / det H$_0$",
        falls=True,
    ),
    Quantity("damage", "1", SolvedFilms.damage),
    Quantity("source_voltage", "V", SolvedFilms.of_source, needs=(SOURCE, ON_REQUEST)),
    Quantity("charge_density", "C/m^2", lambda film: film.electrical("charge"), needs=(ON_REQUEST,)),
    Quantity("charge", "C", lambda film: film.on_electrode(film.electrical("charge")), needs=(ELECTRODE, ON_REQUEST)),
    Quantity("current_density", "A/m^2", lambda film: film.electrical("current"), needs=(ON_REQUEST,)),
    Quantity("current", "A", lambda film: film.on_electrode(film.electrical("current")), needs=(ELECTRODE, ON_REQUEST)),
    Quantity("electrical_energy", "J/m^3", lambda film: film.electrical("work"), needs=(ON_REQUEST,)),
    Quantity(
        "leaked_energy", "J/m^3", lambda film: film.if_stated("leakage", film.electrical("leaked")), needs=(LEAKAGE, ON_REQUEST)
    ),
    Quantity(
        "resistor_energy",
        "J/m^3",
        lambda film: film.if_stated("resistance", film.electrical("lost")),
        needs=(SOURCE, ON_REQUEST),
    ),
    Quantity("mechanical_work", "J/m^3", lambda film: film.electrical("mechanical"), needs=(ON_REQUEST,)),
    Quantity("stored_energy", "J/m^3", lambda film: film.electrical("stored"), needs=(ON_REQUEST,)),
    Quantity("dissipated_energy", "J/m^3", SolvedFilms.dissipated, needs=(ON_REQUEST,)),
    Quantity(
        "area_strain",
        "1",
        lambda film: film.relative(0) * film.relative(1) - 1,
        at=lambda event, begin: event.stretch_1 * event.stretch_2 / (begin[0] * begin[1]) - 1,
    ),
    Quantity(
        "thickness_stretch",
        "1",
        lambda film: 1 / (film.record.stretch[0] * film.record.stretch[1]),
        falls=True,
        at=lambda event, _: 1 / (event.stretch_1 * event.stretch_2),
    ),
    Quantity("capacitance", "F/m^2", SolvedFilms.capacitance, "capacitance per undeformed area"),
    Quantity("capacitance", "F", lambda film: film.on_electrode(film.capacitance()), needs=(ELECTRODE,)),
    Quantity("major_axis", "m", lambda film: film.axis(np.maximum), needs=(ELECTRODE,), written=False),
    Quantity("minor_axis", "m", lambda film: film.axis(np.minimum), needs=(ELECTRODE,), written=False),
]
"""The columns of `actuate`, in order."""


CELLS: list[Quantity] = []
"""Columns of `failure-map` at the end of the table, besides the times of all criteria and stretches: `of` a `FailureMap`, arrays
(temperatures, prestretches, voltages), NaN where a film has failed.
"""


def values_of(quantities: list[Quantity], solved: SolvedTests | SolvedFilms) -> dict[str, Floats]:
    """The values (cases, times) of all quantities that apply, by header."""
    values = {quantity.header: quantity.of(solved) for quantity in quantities}
    return {header: np.asarray(found) for header, found in values.items() if found is not None}


def quantity_of(header: str) -> Quantity | None:
    """The quantity of a column of any result over time, None for another header."""
    return next((quantity for quantity in (*FILMS, *TESTS) if quantity.header == header), None)


def lasting(seconds: float, digits: int = 9) -> str:
    """A time as text, in the largest unit of which it is at least one: as columns and figures name a time after the load."""
    for unit, name in DURATIONS:
        if seconds >= unit * (1 - 1e-9):
            return f"{seconds / unit:.{digits}g} {name}"
    return f"{seconds:.{digits}g} s"
