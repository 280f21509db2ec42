"""A recipe's voltage steps as the solver takes them."""

from __future__ import annotations

from dielast.commands.actuate.recipe import ActuateRecipe, VoltageColumns
from dielast.commands.simulation.history import Entry, ascending_times, marked_still, tracks
from dielast.io.files import Inputs
from dielast.io.text_table import TextFormat, read_measured
from dielast.mechanics.load import Waveform
from dielast.units import VOLTAGE


def voltage_entries(recipe: ActuateRecipe, inputs: Inputs) -> list[Entry]:
    """The steps of a voltage programme."""
    if recipe.load is not None:
        inputs.read(recipe.load)
    entries: list[Entry] = []
    for index, step in enumerate(recipe.step):
        if step.hold is not None:
            entries.append(Entry(index, None, None, None, step.hold))
        elif step.table is not None:
            points = read_measured(inputs.read(step.table), step.table, TextFormat(sheet=step.sheet))
            columns = step.columns or VoltageColumns()
            # a result of dielast's has two rows where the voltage jumps
            time = ascending_times(points, step.table, points.has("true_field"), columns.time or "time")
            entries += tracks(index, "voltage", time, points.column(columns.voltage or "voltage", "voltage", VOLTAGE))
        elif step.waveform is not None:
            wave = Waveform(step.low or 0.0, step.high or 0.0, step.period or 0.0, step.cycles or 1, step.waveform)
            entries.append(Entry(index, "voltage", wave))
        else:
            entries.append(Entry(index, "voltage", step.voltage, step.rate, step.duration))
    return marked_still(entries, 0.0)
