"""Steps of `actuate`: what drives the electrodes of the film, and what moves its edges."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from math import isfinite, radians
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field, PlainValidator, WithJsonSchema

from dielast.base.errors import InputError, shown
from dielast.base.units import (
    CHARGE,
    CHARGE_DENSITY,
    CHARGE_DENSITY_RATE,
    CHARGE_RATE,
    FORCE,
    NUMBER,
    STRAIN_RATE,
    STRESS,
    VOLTAGE,
    VOLTAGE_RATE,
    Dimension,
    parse,
)
from dielast.commands.simulation.step_recipe import Aim, AnyOf, HistoryStep
from dielast.readings.columns_recipe import NamedColumns
from dielast.recipe.fields import Pair, Section, Voltage
from dielast.recipe.file_fields import ColumnName

RATES = {VOLTAGE.unit: VOLTAGE_RATE, CHARGE.unit: CHARGE_RATE, CHARGE_DENSITY.unit: CHARGE_DENSITY_RATE}
"""The rate of a quantity, by its unit."""
Charge = Annotated[tuple[float, str], AnyOf((CHARGE, CHARGE_DENSITY))]
Electric = Annotated[tuple[float, str], AnyOf((VOLTAGE, CHARGE, CHARGE_DENSITY))]
AnyRate = Annotated[
    tuple[float, str], AnyOf((VOLTAGE_RATE, CHARGE_RATE, CHARGE_DENSITY_RATE, STRAIN_RATE), "a rate of voltage, charge or stretch")
]

ELECTRODES = ("voltage", "charge", "circuit")
EDGES = ("stretch", "stress", "force")


class Ends(NamedTuple):
    """What the edges go to, one value or one for each axis; or, of a waveform, the `low` and `high` values."""

    low: tuple[float, ...] | None
    high: tuple[float, ...]


def _ends_of(dimension: Dimension) -> Callable[[Any], Ends]:
    """Reads what the edges go to as a quantity of this dimension; a stretch is a number."""

    def one(value: Any) -> float:
        if dimension is not NUMBER:
            if (number := parse(value, dimension)) < 0:
                raise InputError(f"{shown(value)}: a film bears no compression; at least 0 is needed")
            return number
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
            raise InputError(f"{shown(value)}: a stretch above 0 is needed (1 is undeformed), or a pair such as [3.0, 1.5]")
        return float(value)

    def pair(value: Any) -> tuple[float, ...]:
        if not isinstance(value, list):
            return (one(value),)
        if len(value) != 2:
            raise InputError(f"{shown(value)}: one value, or a pair, one for each axis, is needed")
        return one(value[0]), one(value[1])

    def read(value: Any) -> Ends:
        if not isinstance(value, dict):
            return Ends(None, pair(value))
        if set(value) != {"low", "high"}:
            raise InputError(f"{shown(value)}: {{ low = ..., high = ... }} is needed for a waveform")
        low, high = pair(value["low"]), pair(value["high"])
        if len(low) != len(high):
            raise InputError(f"{shown(value)}: low and high need one value each, or both a pair")
        return Ends(low, high)

    return read


def _schema(one: dict[str, Any]) -> WithJsonSchema:
    either = {"anyOf": [one, {"type": "array", "items": one, "minItems": 2, "maxItems": 2}]}
    waveform = {"type": "object", "required": ["low", "high"]}
    return WithJsonSchema({"anyOf": [*either["anyOf"], waveform]})


def _phase(value: Any) -> float:
    """An angle in rad."""
    for unit, factor in (("deg", radians(1)), ("\N{DEGREE SIGN}", radians(1)), ("rad", 1.0)):
        if isinstance(value, str) and value.strip().endswith(unit):
            with suppress(ValueError):
                if isfinite(number := float(value.strip().removesuffix(unit))):
                    return number * factor
    raise InputError(f'{shown(value)}: an angle is needed, such as "90 deg"')


_TEXT = {"type": "string"}
Stretch = Annotated[Ends, PlainValidator(_ends_of(NUMBER)), _schema({"type": "number", "exclusiveMinimum": 0})]
Stress = Annotated[Ends, PlainValidator(_ends_of(STRESS)), _schema(_TEXT | {"examples": [STRESS.example]})]
Force = Annotated[Ends, PlainValidator(_ends_of(FORCE)), _schema(_TEXT | {"examples": [FORCE.example]})]
Phase = Annotated[float, PlainValidator(_phase), WithJsonSchema(_TEXT | {"examples": ["90 deg"]})]


class ElectricalColumns(NamedColumns):
    """Columns of a table of voltages or charges, where they are called otherwise, and of the stretch or stress of the edges."""

    time: ColumnName | None = Field(None, description='Time. Default: "time".')
    voltage: ColumnName | None = Field(None, description='Voltage. Default: "voltage".')
    charge: ColumnName | None = Field(None, description='Charge. Default: "charge" or "charge_density".')
    stretch: ColumnName | None = Field(None, description="Stretch of the edges. Default: none; they stay as they are.")
    stress: ColumnName | None = Field(None, description="Nominal stress at the edges. Default: none.")


class SourceStep(HistoryStep):
    """A step of what drives the electrodes, of what holds the edges, or of both; what is left out stays as it was."""

    CONTROL: ClassVar = "voltage"

    voltage: Voltage | None = Field(
        None, description="Voltage to reach; beside a waveform of the edges, in a straight line over all its cycles."
    )
    charge: Charge | None = Field(
        None,
        description='With control = "charge": the total charge that the source has delivered at the end of the step, in C, which '
        "needs film.electrode_diameter, or per undeformed area. A hold is an open circuit.",
    )
    circuit: Literal["open", "closed"] | None = Field(
        None,
        description='"open": the charge of the film stays, but for leakage, until a voltage is stated; "closed": the source is at '
        "its last voltage again.",
    )
    stretch: Stretch | None = Field(
        None,
        description="Stretch of the edges, which hold stretches from here on: one number in the mode of the recipe, or a pair, one "
        "for each axis. With waveform: { low, high }, or, beside low and high of the voltage, the value that it goes to meanwhile.",
    )
    stress: Stress | None = Field(
        None, description="Nominal stress at the edges, which are under dead load from here on; else as stretch."
    )
    force: Force | None = Field(None, description="Force at the edges instead of stress; needs film.width.")
    phase: Phase | None = Field(None, description="Angle by which the waveform of voltage or charge is ahead of that of the edges.")
    rate: AnyRate | None = Field(
        None,
        description="Rate of the voltage or the charge, or of the stretch if that is stated, along the axis that moves most; "
        "negative to lower it.",
    )
    low: Electric | None = Field(None, description="Lowest voltage or charge of the waveform. Default: 0.")
    high: Electric | None = Field(None, description="Highest voltage or charge of the waveform.")
    columns: ElectricalColumns | None = Field(None, description="Columns of the table, if their names differ.")

    @property
    def moves(self) -> list[str]:
        """The keys that state what a programme of the electrodes alone does not have."""
        columns = [] if self.columns is None else [f"columns.{key}" for key in ("stretch", "stress") if getattr(self.columns, key)]
        return [key for key in ("stretch", "stress", "force", "circuit") if getattr(self, key) is not None] + columns

    def aim(self) -> Aim | None:
        """The voltage or the charge."""
        if self.moves:
            return None
        rate = None if self.rate is None else self.rate[0]
        if self.charge is not None:
            return Aim("charge" if self.charge[1] == CHARGE.unit else "charge density", self.charge[0], rate, self.charge[1])
        return None if self.voltage is None else Aim("voltage", self.voltage, rate, VOLTAGE.unit)

    @property
    def stated(self) -> dict[str, str]:
        """The units of the keys that state a voltage or a charge."""
        units = {} if self.voltage is None else {"voltage": VOLTAGE.unit}
        for key in ("charge", "low", "high"):
            if (value := getattr(self, key)) is not None:
                units[key] = value[1]
        return units

    def _check_waveform(self) -> None:
        edges = [getattr(self, key) for key in ("stretch", "stress", "force") if getattr(self, key) is not None]
        if not edges or self.waveform is None:
            super()._check_waveform()
            if any(ends.low is not None for ends in edges):
                raise InputError("low and high go with waveform")
            return
        if self.period is None:
            raise InputError("a waveform needs period")
        if self.high is None and any(ends.low is None for ends in edges):
            raise InputError("a waveform of the edges goes from low to high: state { low = ..., high = ... }")
        if self.high is not None:
            self._check_ends()

    def _check_action(self) -> None:
        if not self.moves or self.table is not None:
            if self.phase is not None:
                raise InputError("goes with waveforms of edges and electrodes", key="phase")
            super()._check_action()
            return
        self._check_together()

    def _check(self) -> None:
        super()._check()
        if self.rate is not None and (self.rate[1] == STRAIN_RATE.unit) != (self.stretch is not None):
            needed = f'{STRAIN_RATE.name} is needed, such as "{STRAIN_RATE.example}"'
            raise InputError(needed if self.stretch is not None else "a strain rate goes with stretch", key="rate")
        if self.stretch is not None:
            return
        units = set(self.stated.values())
        if len(units) > 1:
            raise InputError("low and high of a waveform must both be voltages, charges, or charge densities")
        for unit in units:
            if self.rate is not None and self.rate[1] != RATES[unit].unit:
                raise InputError(f'{RATES[unit].name} is needed, such as "{RATES[unit].example}"', key="rate")

    def _check_together(self) -> None:
        """`InputError` unless the keys of a step that moves the edges, or states the circuit, go together."""
        edges, electrodes = ([key for key in keys if getattr(self, key) is not None] for keys in (EDGES, ELECTRODES))
        if len(edges) > 1:
            raise InputError(f"{edges[0]} and {edges[1]} both say what holds the edges: one of them is needed")
        if self.circuit is not None and len(electrodes) > 1:
            if self.circuit == "open":
                raise InputError(f"an open circuit keeps its charge: leave out {electrodes[0]}, or circuit", key=electrodes[0])
            instead = "a closed circuit has the voltage of its source" if self.charge is not None else "a stated voltage closes it"
            raise InputError(f"{instead}: leave out {electrodes[0]}, or circuit", key=electrodes[0])
        if len(electrodes) > 1:
            raise InputError("voltage and charge do not go together: one of them is needed")
        if self.hold is not None:
            raise InputError(
                f"does not go with {(edges or electrodes)[0]}: state duration, the time in which the step reaches it", key="hold"
            )
        if self.waveform is not None:
            for key in ("rate", "duration", *(("voltage", "charge") if self.high is not None else ())):
                if getattr(self, key) is not None:
                    instead = ": low and high state those of the waveform" if key in ELECTRODES else ""
                    raise InputError(f"{key} does not go with waveform{instead}")
            still = self.high is None or not any(getattr(self, key).low for key in edges)
            if self.phase is not None and still:
                raise InputError("goes with waveforms of edges and electrodes", key="phase")
            if self.circuit is not None and self.high is not None:
                raise InputError("a waveform of the voltage or charge is stated: leave circuit out", key="circuit")
            return
        if self.rate is not None and self.duration is not None:
            raise InputError("rate and duration do not go together")
        if self.rate is not None and self.stretch is None and self.circuit is None:
            raise InputError("the rate of a stress or a force is not known beforehand: state duration", key="rate")
        if self.rate is not None and self.circuit is not None and not edges:
            raise InputError("does not go with circuit alone: state duration", key="rate")


class Repetition(Section):
    """Steps that run again and again; cycles.csv has a row for each time."""

    times: int = Field(ge=1, le=1_000_000, description="How many times the cycle runs.")
    steps: Pair[int] | None = Field(None, description="First and last step of the cycle, counted from 0. Default: all steps.")

    def mistakes(self, steps: Sequence[HistoryStep]) -> Iterator[tuple[str, str]]:
        """The keys that do not suit the steps, and what is wrong with them."""
        if self.steps is not None and not 0 <= self.steps[0] <= self.steps[1] < len(steps):
            yield "steps", f"{self.steps}: two numbers in order are needed, from 0 to {len(steps) - 1}"
        if any(step.waveform is not None for step in steps):
            yield "times", "a waveform has cycles of its own: state its cycles, or leave repeat out"
