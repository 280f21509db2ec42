"""What recipes of `actuate` say of the source, of what leaks, and of what is written about it."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from dielast.commands.simulation.recipe import Output
from dielast.errors import InputError
from dielast.recipe.fields import Quantity, Section
from dielast.simulate.electrical import UNITS
from dielast.units import (
    CHARGE,
    CHARGE_DENSITY,
    CHARGE_DENSITY_RATE,
    CHARGE_RATE,
    CONDUCTIVITY,
    FIELD,
    RESISTANCE,
    VOLTAGE,
    VOLTAGE_RATE,
    Dimension,
    parse,
)

ELECTRICAL_COLUMNS = tuple(f"{name} [{unit}]" for name, unit in UNITS.items())
RATES = {VOLTAGE.unit: VOLTAGE_RATE, CHARGE.unit: CHARGE_RATE, CHARGE_DENSITY.unit: CHARGE_DENSITY_RATE}
"""The rate of a quantity, by its unit."""


def _in_one_of(dimensions: tuple[Dimension, ...], value: Any) -> tuple[float, str]:
    """The number in the unit of the dimension that it has, and this unit; the error of the first dimension if it has none."""
    mistakes = []
    for dimension in dimensions:
        try:
            return parse(value, dimension), dimension.unit
        except InputError as error:
            mistakes.append(error)
    raise mistakes[0]


def _quantity(*dimensions: Dimension) -> Any:
    examples = {"type": "string", "examples": [dimension.example for dimension in dimensions]}
    return Annotated[tuple[float, str], PlainValidator(partial(_in_one_of, dimensions)), WithJsonSchema(examples)]


Charge = _quantity(CHARGE, CHARGE_DENSITY)
Electric = _quantity(VOLTAGE, CHARGE, CHARGE_DENSITY)
ElectricRate = _quantity(VOLTAGE_RATE, CHARGE_RATE, CHARGE_DENSITY_RATE)
Resistance = Annotated[float, Quantity(RESISTANCE, at_least=0.0)]
Conductivity = Annotated[float, Quantity(CONDUCTIVITY, at_least=0.0)]
LeakageField = Annotated[float, Quantity(FIELD, above=0.0)]


class SourceSection(Section):
    """The source of the voltage."""

    resistance: Resistance = Field(
        description="Between the source and the electrode, whose voltage is then that of the source less resistance times current; "
        "needs film.electrode_diameter. Pull-in is at constant charge within the time constant of the circuit, at constant voltage "
        "beyond it (pull_in.timescale)."
    )


class LeakageSection(Section):
    """Current through the film: the current density is conductivity exp(field/E_c) times the true field."""

    conductivity: Conductivity = Field(description="At a small field.")
    field: LeakageField | None = Field(
        None, description="E_c, in which the conductivity grows by a factor of e; left out: a constant conductivity."
    )


class ElectricalOutput(Output):
    """Where the result is given, and whether with what is electrical."""

    electrical: bool | None = Field(
        None,
        description="Whether to write charge, current and energies, and the efficiency of cycles; by default with charges, "
        "[source] or [leakage]. Charge and current are per undeformed area, and in all where film.electrode_diameter is stated.",
    )
