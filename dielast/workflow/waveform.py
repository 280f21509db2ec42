"""A recipe's voltage steps as the solver takes them: waveforms and tables become ramps."""

from __future__ import annotations

from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from dielast.files import Inputs
from dielast.measured import read_measured
from dielast.recipe.voltage import ActuateRecipe, VoltageStep
from dielast.units import VOLTAGE
from dielast.workflow.history import Entry, ascending_times, marked_still

SINE_POINTS = 100  # a period; straight lines between them stay within 0.05 % of the amplitude


def voltage_entries(recipe: ActuateRecipe, inputs: Inputs) -> list[Entry]:
    """The steps of a voltage programme."""
    if recipe.load is not None:
        inputs.read(recipe.load)
    entries: list[Entry] = []
    for index, step in enumerate(recipe.step):
        if step.hold is not None:
            entries.append(Entry(index, None, None, None, step.hold))
        elif step.table is not None:
            points = read_measured(inputs.read(step.table), step.table)
            # a result of dielast's has two rows where the voltage jumps
            time = ascending_times(points, step.table, jumps=points.has("true_field"))
            lasts = np.diff(time, prepend=0.0).tolist()
            voltage = points.column("voltage", "voltage", VOLTAGE).tolist()
            entries += [Entry(index, "voltage", *own) for own in zip(voltage, repeat(None), lasts, strict=False)]
        elif step.waveform is not None:
            entries += _cycles(index, step)
        else:
            entries.append(Entry(index, "voltage", step.voltage, step.rate, step.duration))
    return marked_still(entries, 0.0)


def _cycles(index: int, step: VoltageStep) -> list[Entry]:
    """Cycles from low to high and back; the first begins with a jump to low if the voltage is not there."""
    low, high, period = step.low or 0.0, step.high or 0.0, step.period or 0.0
    points = 2 if step.waveform == "triangle" else SINE_POINTS
    phase = np.arange(1, points + 1) / points
    height: NDArray[np.float64] = np.array([1.0, 0.0]) if points == 2 else 0.5 * (1 - np.cos(2 * np.pi * phase))
    cycle = [Entry(index, "voltage", float(low + (high - low) * share), None, period / points) for share in height]
    return [Entry(index, "voltage", low, None, 0.0), *cycle * (step.cycles or 1)]
