"""Read the table of specimens of a recipe."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from dielast.base.errors import InputError, Mistakes, and_more, located, shown, warn
from dielast.calibration.failures.likelihood import Seen
from dielast.calibration.failures.specimens import Specimens
from dielast.commands.lifetime.recipe import QUANTITIES, TEXTS, FailureData, LifetimeRecipe
from dielast.commands.registry import read_cases
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs, resolve
from dielast.io.text_table import MeasuredTable, read_measured
from dielast.material.checks import USUAL
from dielast.material.material import Material
from dielast.mechanics.load import VoltageStep
from dielast.numerics.arrays import Floats

YES = ("yes", "y", "true", "1", "running", "suspended", "survived", "x")
NO = ("no", "n", "false", "0", "failed", "")


def read_specimens(recipe: LifetimeRecipe, material: Material, inputs: Inputs) -> Specimens:
    """The specimens of a recipe; raises `InputError` with a line for every mistake, naming the specimen."""
    data, film = recipe.data, recipe.film
    table = read_measured(inputs.read(data.file), data.file, data.text_format(), data.units, with_texts=True)
    table = table.only(table.rows_where(data.where))
    n = table.lines.size
    if not n:
        raise InputError("no specimen in these rows", file=data.file, key="data.where")
    columns = {role: column for role in (*QUANTITIES, *TEXTS) if (column := _column(table, data, role)) is not None}
    numbers = {role: _numbers(table, columns.get(role), role) for role in QUANTITIES}
    texts = {role: [cell.strip() for cell in table.cells[table.find(columns[role], role)]] for role in TEXTS if role in columns}
    empty = [""] * n
    names = [text or str(k + 1) for k, text in enumerate(texts.get("specimen", empty))]
    wrong = Mistakes()

    def refuse(row: int, text: str) -> None:
        wrong.append(table.error(f"specimen {names[row]}: {text}", row).problems[0])

    suspended = np.array([_is_yes(text, refuse, row) for row, text in enumerate(texts.get("suspended", empty))])
    answers = texts.get("suspended", [])
    unstated = [name for name, text in zip(names, answers, strict=False) if not text]
    if unstated and any(text.casefold() in NO for text in filter(None, answers)):  # where some say no, empty may mean unknown
        what = f"suspended is empty for specimen {unstated[0]}{and_more(len(unstated) - 1)}, which counts as no, failed"
        warn(f"{what}: write no or yes", file=data.file)
    recipes, of_recipe = texts.get("recipe", empty), np.full(n, -1)
    programmes = list[Sequence[VoltageStep]]()
    for name in dict.fromkeys(filter(None, recipes)):
        steps = wrong.tried(partial(_programme, name, inputs))
        of_recipe[[row for row, text in enumerate(recipes) if text == name]] = len(programmes)
        programmes.append(steps or ())
    if "voltage" not in columns and not programmes:
        raise table.error("a column of voltages is needed: state columns.voltage")
    if "prestretch" not in columns and film.prestretch is None:
        raise InputError("is needed, as no column holds the prestretch", key="film.prestretch")

    def filled(role: str, default: Floats | float) -> Floats:
        return np.where(np.isnan(numbers[role]), default, numbers[role])

    given, voltage, ramp = of_recipe >= 0, np.abs(numbers["voltage"]), filled("ramp", np.inf)
    # only the end of a ramp has no time of its own
    time = filled("time", np.where(np.isfinite(ramp) & ~given, voltage / np.where(ramp > 0, ramp, 1.0), np.nan))
    intact = np.where(suspended, np.nan, numbers["intact"])
    seen = np.where(suspended, Seen.SUSPENDED, np.where(np.isfinite(intact) & (intact > 0), Seen.BETWEEN, Seen.FAILED))
    seen = np.where((seen == Seen.FAILED) & ((time == 0) | (intact == 0)), Seen.DEAD, seen)
    usual = film.prestretch or (np.nan, np.nan)
    first = filled("prestretch", usual[0])
    second = filled("prestretch_2", filled("prestretch", usual[1])) if "prestretch" in columns else np.full(n, usual[1])
    area, humidity, thickness = numbers["area"], numbers["humidity"], filled("thickness", film.thickness)
    shown = {"time": time, "intact": intact, "prestretch": first, "thickness": thickness, "area": area, "humidity": humidity}
    mistakes = (
        (~given & ~(voltage > 0), "a voltage above 0 is needed"),
        (~(ramp > 0), "a ramp above 0 is needed, or an empty cell for a voltage that comes at once"),
        (np.isnan(time), "a time is needed (only a ramp to failure has none)"),
        (time < 0, "{time:g} s: a time must not be negative"),
        (suspended & (time == 0), "it is suspended at 0 s, so that nothing is known of it: delete the row"),
        (intact >= time, "it was last seen intact at {intact:g} s, not before it was found failed at {time:g} s"),
        (~((first >= 1) & (second >= 1)), "prestretch {prestretch:g}: at least 1 is needed (1 is undeformed)"),
        *((shown[role] <= 0, f"{role} {{{role}:g}}: a positive number is needed") for role in ("thickness", "area", "humidity")),
        (np.isnan(area) & np.any(np.isfinite(area)), "its area is not stated, but that of others is"),
    )
    for rows, text in mistakes:
        for row in np.flatnonzero(rows).tolist():
            refuse(row, text.format(**{role: values[row] for role, values in shown.items()}))
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        refuse(names.index(name), f"{names.count(name)} rows have this name: each row is a specimen of its own")
    wrong.refuse()
    fields = voltage * first * second / thickness
    USUAL["field of tests"].warn([np.max(fields[np.isfinite(fields)])] if np.any(np.isfinite(fields)) else [])
    USUAL["film"].warn(thickness)
    return Specimens(
        tuple(names),
        seen.astype(np.intp),
        time,
        np.where(given, np.nan, voltage),
        ramp,
        np.stack((first, second), axis=1),
        thickness,
        filled("temperature", recipe.usual_temperature(material)),
        intact,
        area,
        humidity,
        tuple(texts.get("batch", empty)),
        tuple(texts.get("mode", empty)),
        of_recipe,
        tuple(programmes),
        tuple({"file": data.file, "line": int(line)} for line in table.lines),
    )


def _column(table: MeasuredTable, data: FailureData, role: str) -> str | int | None:
    """The column of a role: the stated one, or the one that is called so."""
    stated = data.columns.by_role.get(role)
    return stated if stated is not None else role if table.has(role) else None


def _numbers(table: MeasuredTable, column: str | int | None, role: str) -> Floats:
    """The numbers in SI of a column (n,), NaN for empty cells, and where there is no such column."""
    values = np.full(table.lines.size, np.nan)
    if column is not None:
        filled = np.array([bool(cell.strip()) for cell in table.cells[table.find(column, role)]])
        table.check(column, role, QUANTITIES[role])
        if filled.any():
            values[filled] = table.column(column, role, QUANTITIES[role], filled)
    return values


def _is_yes(text: str, refuse: Any, row: int) -> bool:
    plain = text.casefold()
    if plain not in (*YES, *NO):
        refuse(row, f"suspended {shown(text)}: yes or no is needed")
    return plain in YES


def _programme(name: str, inputs: Inputs) -> Sequence[VoltageStep]:
    """The steps of voltage of a recipe of actuate."""
    content, path = inputs.read(name), resolve(inputs.folder, name)
    cases = read_cases(path, content=content)
    recipe = cases[0].recipe
    if recipe.kind != "actuate" or len(cases) > 1 or recipe.control != "voltage":
        raise InputError("a recipe of actuate with steps of voltage and without [sweep] is needed", file=name)
    if any(step.moves or step.charge is not None for step in recipe.step):
        raise InputError("steps of voltage alone are needed: edges stay as they are in a test to failure", file=name)
    with located(file=name):
        timed = solver_steps(recipe, Inputs(path.parent))
    steps = [VoltageStep(one.driven, rate=one.step.rate, duration=one.step.duration) for one in timed]
    return [steps[run.place] for run in timed.runs()]
