"""`[source]`, `[leakage]` and the electrical output in recipes of `actuate`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dielast.commands.simulation.recipe import Output
from dielast.commands.simulation.step_recipe import AnyOf
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
)

ELECTRICAL_COLUMNS = tuple(f"{name} [{unit}]" for name, unit in UNITS.items())
RATES = {VOLTAGE.unit: VOLTAGE_RATE, CHARGE.unit: CHARGE_RATE, CHARGE_DENSITY.unit: CHARGE_DENSITY_RATE}
"""The rate of a quantity, by its unit."""


Charge = Annotated[tuple[float, str], AnyOf((CHARGE, CHARGE_DENSITY))]
Electric = Annotated[tuple[float, str], AnyOf((VOLTAGE, CHARGE, CHARGE_DENSITY))]
ElectricRate = Annotated[tuple[float, str], AnyOf((VOLTAGE_RATE, CHARGE_RATE, CHARGE_DENSITY_RATE))]
Resistance = Annotated[float, Quantity(RESISTANCE, at_least=0.0)]
Conductivity = Annotated[float, Quantity(CONDUCTIVITY, at_least=0.0)]
LeakageField = Annotated[float, Quantity(FIELD, above=0.0)]


class SourceSection(Section):
    """The source of the voltage."""

    resistance: Resistance = Field(
        description="Resistance between the source and the electrode; needs film.electrode_diameter. The voltage of the electrode "
        "is that of the source minus resistance times current. A disturbance over a time (pull_in.timescale) shorter "
        "than the time constant of the circuit is at constant charge, a longer one at constant voltage; a film that "
        "runs away only as fast as the circuit charges it has no pull-in."
    )


class LeakageSection(Section):
    """Current through the film: the current density is conductivity exp(field/E_c) times the true field."""

    conductivity: Conductivity = Field(description="Conductivity at a small field.")
    field: LeakageField | None = Field(
        None,
        description="Increase E_c of the true field over which the conductivity grows by a factor e. Default: constant "
        "conductivity.",
    )


class ElectricalOutput(Output):
    """The times of the result, and whether it includes charge, current and energies."""

    electrical: bool | None = Field(
        None,
        description="Whether to write charge, current and energies, and the efficiency of cycles. Default: true with charges, "
        "[source] or [leakage]. Charge and current are per undeformed area; with film.electrode_diameter also in C and A.",
    )
